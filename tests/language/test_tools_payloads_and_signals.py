"""Masses, tools, zones and signals of jobs: numbers by hand, and the same again in a resolved job of other units."""

from __future__ import annotations

import math

import numpy as np
import pytest
from jsonschema import Draft202012Validator
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.job.dump import dump_job
from trajcli.job.read import LoadedJob, job_from_text
from trajcli.kinematics.robot import Friction, MountedTool, Payload
from trajcli.kinematics.zone import Zone
from trajcli.language.numbers import ReadingContext
from trajcli.language.signals import SignalAt
from trajcli.language.zones import SignalsField, ZoneField

DEG = math.pi / 180
HEAD = "version: 1\nunits: {angle: deg, length: mm}\nrobot: ur5e\nstart: {joints: [0, -90, 90, 0, 90, 0]}\n"
HOLD = "{planner: hold, duration: 1}"


def job(more: str = "", moves: str = HOLD, head: str = HEAD) -> LoadedJob:
    return job_from_text(f"{head}{more}moves: [{moves}]\n", "job.yaml")


def both(loaded: LoadedJob) -> list[LoadedJob]:
    """Return a job and what its resolved form is read as, also where plain numbers are in rad and m."""
    text = dump_job(loaded)
    assert "{angle: deg, length: mm}" in text
    in_si = text.replace("{angle: deg, length: mm}", "{angle: rad, length: m}")
    return [loaded, job_from_text(text), job_from_text(in_si)]


INERTIA = "inertia: [0.3, 0.4, 0.5, 0.01, -0.02, 0.03]"
TENSOR = [[0.3, 0.01, -0.02], [0.01, 0.4, 0.03], [-0.02, 0.03, 0.5]]
LOADS = [
    ("{mass: 2}", 2, [0, 0, 0], np.zeros((3, 3))),
    ("{mass: 500 g, com: [1, -2, 3 cm]}", 0.5, [0.001, -0.002, 0.03], np.zeros((3, 3))),
    (f"{{mass: 2, com: [1, -2, 3], {INERTIA}}}", 2, [0.001, -0.002, 0.003], TENSOR),
    ("{mass: 0}", 0, [0, 0, 0], np.zeros((3, 3))),
]


@pytest.mark.parametrize(("written", "mass", "com", "inertia"), LOADS)
def test_payloads(written: str, mass: float, com: list[float], inertia: list[list[float]]) -> None:
    for each in both(job(moves=f"{{attach: {written}}}, {HOLD}")):
        load = each.job.moves[0].carried_after(None)
        assert isinstance(load, Payload)
        assert load.mass == mass
        np.testing.assert_allclose(load.com, com, rtol=1e-15)
        np.testing.assert_array_equal(load.inertia, inertia)


@pytest.mark.parametrize(("written", "mass", "com", "inertia"), LOADS)
def test_tools_by_name_and_in_place(
    written: str, mass: float, com: list[float], inertia: list[list[float]]
) -> None:
    """The first one, and one that a move puts on."""
    tool = f"{{xyz: [10, 20, 30], rpy: [5, -6, 7], {written[1:]}"
    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", [5, -6, 7], degrees=True).as_matrix()
    pose[:3, 3] = 0.01, 0.02, 0.03
    named = job(f"tools: {{grip: {tool}}}\ntool: grip\n", f"{HOLD}, {{tool: grip}}, {HOLD}")
    placed = job(f"tool: {tool}\n", f"{HOLD}, {{tool: {tool}}}, {HOLD}")
    for loaded, name in ((named, "grip"), (placed, None)):
        for each in both(loaded):
            tools = [each.job.tool, each.job.moves[1].tool]  # type: ignore[attr-defined]
            for found in tools:
                assert isinstance(found, MountedTool)
                assert (found.name or None) == name
                np.testing.assert_allclose(found.pose, pose, atol=1e-16)
                assert found.load is not None
                assert found.load.mass == mass
                np.testing.assert_allclose(found.load.com, com, rtol=1e-15)
                np.testing.assert_array_equal(found.load.inertia, inertia)
            np.testing.assert_allclose(each.robot.tool, pose, atol=1e-16)
    light, again, _ = (each.job.tool for each in both(job("tools: {grip: {xyz: [1, 2, 3]}}\ntool: grip\n")))
    assert light is not None
    assert again is not None
    assert (light.load, again.load, again.name) == (None, None, "grip")


WRONG = [  # more, moves, message, what it points at
    ("tool: {xyz: [1, 2, 3], com: [1, 2, 3]}\n", HOLD, "com says how a mass is spread, and there is none", "com"),
    (f"tool: {{{INERTIA}}}\n", HOLD, "inertia says how a mass is spread, and there is none", "inertia"),
    ("tool: {mass: -1}\n", HOLD, "at least 0 kg, got -1", "-1"),
    ("tool: {mass: 1, com: [1, x, 3]}\n", HOLD, "expected a length", "x,"),
    ("tool: {mass: 1, com: [1, 2]}\n", HOLD, "expected 3 numbers, got 2 values", "[1, 2]"),
    ("tool: {mass: 0, inertia: [1, 1, 1, 0, 0, 0]}\n", HOLD, "nothing without mass has a moment of inertia", "[1, 1, 1, 0"),
    ("tool: {mass: 1, inertia: [1, 1, 3, 0, 0, 0]}\n", HOLD, "above the sum of the two others", "[1, 1, 3, 0"),
    ("tool: {xyz: [1, 2, 3], weight: 3}\n", HOLD, "unknown key 'weight'", "weight"),
    ("tool: 3\n", HOLD, "expected a pose on the flange, got 3", "3"),
    ("tool: gripp\ntools: {grip: {}}\n", HOLD, "there is no tool 'gripp'", "gripp"),
    ("tools: {grip: {xyz: [1, 2]}}\ntool: grip\n", HOLD, "expected 3 numbers, got 2 values", "[1, 2]"),
    ("", f"{{attach: {{mass: 1, inertia: [1, 1, 3, 0, 0, 0]}}}}, {HOLD}", "above the sum of the two others", "[1, 1, 3, 0"),
    ("", f"{{attach: {{mass: 0, inertia: [1, 1, 1, 0, 0, 0]}}}}, {HOLD}", "nothing without mass", "[1, 1, 1, 0"),
    ("gravity: [0, 0]\n", HOLD, "expected 3 numbers", "[0, 0]"),
    ("zone: here\n", HOLD, "expected a length, `stop`, or a mapping of position, orientation, joints", "here"),
    ("zone: -1\n", HOLD, "at least 0 mm, got -1", "-1"),
    ("zone: 3 deg\n", HOLD, "expected a length", "3 deg"),
    ("zone: {}\n", HOLD, "a zone needs one of position, orientation, joints", "{}"),
    ("zone: {radius: 3}\n", HOLD, "a zone has no 'radius'", "radius"),
    ("zone: {position: 3 deg}\n", HOLD, "expected a length", "3 deg"),
    ("zone: {orientation: 3 mm}\n", HOLD, "expected an angle", "3 mm"),
    ("zone: true\n", HOLD, "expected a number (mm), got true", "true"),
]  # fmt: skip


@pytest.mark.parametrize(("more", "moves", "message", "at"), WRONG)
def test_what_no_thing_has_is_refused_once_where_it_stands(
    more: str, moves: str, message: str, at: str
) -> None:
    with pytest.raises(InputError) as caught:
        job(more, moves)
    (problem,) = caught.value.problems
    assert message in problem.message
    assert problem.place is not None
    assert problem.place.source[problem.place.column - 1 :].startswith(at)


def test_gravity_is_in_metres_whatever_the_units() -> None:
    for each in both(job("gravity: [0, 981 cm/s^2, -3]\n")):
        assert each.robot.gravity.tolist() == [0, 9.81, -3]


def test_friction_and_rotors_of_joints() -> None:
    robot = "{joints: [{friction: {coulomb: 3}}, {friction: {viscous: 0.5}}, {rotor: 0.25}, {type: prismatic, effort: 2 kN}]}"
    for each in both(job(head=HEAD.replace("ur5e", robot).replace("[0, -90, 90, 0, 90, 0]", "0"))):
        joints = each.robot.joints
        assert [joint.friction for joint in joints] == [
            Friction(3, 0),
            Friction(0, 0.5),
            Friction(),
            Friction(),
        ]
        assert [joint.rotor for joint in joints] == [0, 0, 0.25, 0]
        assert joints[3].effort == (-2000, 2000)


ZONES = [  # as written, position, orientation
    ("20", 0.02, None),
    ("2 cm", 0.02, None),
    ("stop", 0, None),
    ("0", 0, None),
    ("{position: 5, orientation: 3}", 0.005, 3 * DEG),
    ("{orientation: 0.5 rev}", None, math.pi),
    ("{position: 0, orientation: 0}", 0, 0),
    ("{position: 3}", 0.003, None),
]


@pytest.mark.parametrize(("written", "position", "orientation"), ZONES)
@pytest.mark.parametrize("joints", [None, "5", "[1, 2, 3, 4, 5, 6]"])
def test_zones(written: str, position: float | None, orientation: float | None, joints: str | None) -> None:
    if joints is not None and not written.startswith("{"):
        return
    text = written if joints is None else f"{written[:-1]}, joints: {joints}}}"
    expected = None if joints is None else [k * DEG for k in ([5] * 6 if joints == "5" else range(1, 7))]
    for each in both(job(f"zone: {text}\n")):
        zone = each.job.zone
        assert (zone.position is None) == (position is None)
        assert zone.position == (None if position is None else pytest.approx(position, rel=1e-15))
        assert zone.orientation == (None if orientation is None else pytest.approx(orientation, rel=1e-15))
        assert zone.joints == (None if expected is None else pytest.approx(expected, rel=1e-15))


def test_a_zone_that_is_none_says_what_one_is_and_one_that_is_made_stays_itself() -> None:
    for text, hint in (
        ("here", "`zone: 20 mm` is a ball about the corner"),
        ("{radius: 3}", "it has position, "),
    ):
        with pytest.raises(InputError) as caught:
            job(f"zone: {text}\n")
        assert str(caught.value.problems[0].hint).startswith(hint)
    schema = ZoneField("About the corner.").json_schema()
    taken = ("stop", 20, "20 mm", {"position": 0, "joints": [1, 2]}, {"orientation": "3 deg"})
    refused = ("here", -1, {}, {"radius": 3}, {"position": "far"}, None)
    assert [Draft202012Validator(schema).is_valid(each) for each in taken + refused] == [True] * 5 + [
        False
    ] * 6
    assert (schema["description"], SignalsField("Set.").json_schema()["description"]) == (
        "About the corner.",
        "Set.",
    )
    zone = Zone(orientation=0.5)
    assert ZoneField("").read(zone, ReadingContext()) is zone


LINE = "planner: line, to: {from: here, offset: {xyz: [0, 0, 50]}}, law: {shape: quintic, duration: 2}"
SIGNALS = [  # as written, what it is
    ("{signal: a, value: 1}", SignalAt("a", 1)),
    ("{signal: a_2, value: -2.5, when: enter}", SignalAt("a_2", -2.5, "enter")),
    ("{signal: a, value: 0, when: leave, before: -20 ms}", SignalAt("a", 0, "leave", None, -0.02)),
    ("{signal: a, value: 1, when: {path: -10}, before: 0.5}", SignalAt("a", 1, "nearest", -0.01, 0.5)),
    ("{signal: a, value: 1, when: {path: 2 cm}}", SignalAt("a", 1, "nearest", 0.02)),
    ("{signal: a, value: 1, when: {path: 0}}", SignalAt("a", 1, "nearest", 0.0)),
]


@pytest.mark.parametrize(("written", "expected"), SIGNALS)
def test_signals_on_the_way(written: str, expected: SignalAt) -> None:
    for text in (written, f"[{written}, {{signal: z, value: 3}}]"):
        for each in both(job(moves=f"{{{LINE}, at: {text}}}")):
            found = each.job.moves[0].at
            assert found == ((expected,) if text == written else (expected, SignalAt("z", 3)))


WRONG_SIGNALS = [
    ("{signal: a}", "`value` is missing", "{signal"),
    ("{value: 1}", "`signal` is missing", "{value"),
    ("{signal: a, value: 1, whn: enter}", "a signal has no 'whn'", "whn"),
    ("{signal: 1a, value: 1}", "'1a' is no name of a signal", "1a"),
    ("{signal: a-b, value: 1}", "'a-b' is no name of a signal", "a-b"),
    ("{signal: a b, value: 1}", "'a b' is no name of a signal", "a b"),
    ("{signal: _a, value: 1}", "'_a' is no name of a signal", "_a"),
    ("{signal: ä, value: 1}", "'ä' is no name of a signal", "ä"),
    ("{signal: a, value: on}", "expected a number", "on"),
    ("{signal: a, value: true}", "expected a number, got true", "true"),
    ("{signal: a, value: 1, when: now}", "expected enter, nearest, leave or {path: L}", "now"),
    ("{signal: a, value: 1, when: {path: 1, at: 2}}", "expected enter, nearest, leave or {path: L}", "{path"),
    ("{signal: a, value: 1, when: {path: 1 s}}", "expected a length", "1 s"),
    ("{signal: a, value: 1, before: 1 mm}", "expected a time", "1 mm"),
    ("[]", "expected at least one signal", "[]"),
    ("3", "expected {signal: NAME", "3"),
]


@pytest.mark.parametrize(("written", "message", "at"), WRONG_SIGNALS)
def test_wrong_signals_are_refused_where_they_stand(written: str, message: str, at: str) -> None:
    for text in (written, f"[{{signal: z, value: 3}}, {written}]"):
        if written == "[]" != text:
            continue
        with pytest.raises(InputError) as caught:
            job(moves=f"{{{LINE}, at: {text}}}")
        (problem,) = caught.value.problems
        assert message in problem.message
        assert problem.place is not None
        assert problem.place.source[problem.place.column - 1 :].startswith(at)
