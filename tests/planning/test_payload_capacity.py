"""The largest payload against plans of jobs that attach it."""

from __future__ import annotations

import json
from decimal import ROUND_DOWN, Decimal
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tiers import few

from trajcli.cli.job_commands import PayloadCommand
from trajcli.cli.payload import run_payload
from trajcli.dynamics.newton_euler import InverseDynamics
from trajcli.errors import InputError, TrajcliError, VerificationError
from trajcli.job.read import job_from_text
from trajcli.planning import plan as plan_module
from trajcli.planning import planned_move
from trajcli.planning.payload_capacity import PayloadCapacity, payload_capacity
from trajcli.planning.plan import plan_job

HEAD = """
version: 1
units: {angle: deg, length: mm}
robot:
  name: arm
  convention: standard
  joints:
    - {name: a, a: 500, velocity: 100, acceleration: 300, link: {mass: 4, com: [-250, 0, 0], inertia: [0.01, 0.1, 0.1, 0, 0, 0]}}
    - {name: b, a: 400, velocity: 100, acceleration: 300, link: {mass: 2, com: [-200, 0, 0], inertia: [0.01, 0.05, 0.05, 0, 0, 0]}}
gravity: [0, -9.81, 0]
"""
EMPTY = (
    HEAD
    + """
limits: {effort: {a: 90, b: [-40, 30]}}
start: {joints: [0, 0]}
moves:
  - {planner: quintic, to: {joints: [90, 20]}, duration: 2}
  - {planner: quintic, to: {joints: [20, 90]}, duration: 1.5}
  - {planner: quintic, to: {joints: [0, -90]}, duration: 4}
"""
)
LAST = "  - {planner: quintic, to: {joints: [0, -90]}, duration: 4}\n"
MIDDLE = "  - {planner: quintic, to: {joints: [20, 90]}, duration: 1.5}\n"
CARRYING = EMPTY.replace(
    MIDDLE,
    f"  - {{attach: {{mass: MASS, com: [60, 20, 0], inertia: [0.01, 0.02, 0.02, 0, 0, 0]}}}}\n{MIDDLE}  - {{detach: {{}}}}\n",
)
FREE = CARRYING.replace(", duration: 1.5", "")
SLOWED = CARRYING.replace(", duration: 1.5", ", duration: 1.5, when_over_limit: slow")
WHOLE = EMPTY.replace("moves:\n", "moves:\n  - {attach: {mass: MASS}}\n")
FIRST = EMPTY.replace(
    "moves:\n  - {planner: quintic, to: {joints: [90, 20]}, duration: 2}\n",
    "moves:\n  - {attach: {mass: MASS}}\n  - {planner: quintic, to: {joints: [90, 20]}, duration: 2}\n  - {detach: {}}\n",
)


def verifies(text: str, mass: float) -> bool:
    """Return whether `trajcli plan` would end with 0 with a mass in the place of MASS."""
    try:
        return plan_job(job_from_text(text.replace("MASS", repr(mass)))).verdict.passed
    except TrajcliError:
        return False


@pytest.mark.full
@pytest.mark.parametrize(
    ("job", "at", "outside"),
    few(
        [
            (CARRYING.replace("MASS", "0.5"), None, CARRYING),
            (CARRYING.replace("MASS", "0.5"), 2, CARRYING),
            (FREE.replace("MASS", "0.5"), None, FREE),
            (SLOWED.replace("MASS", "0.5"), None, SLOWED),
            (EMPTY, None, WHOLE),
            (EMPTY, 0, FIRST),
        ],
        2,
    ),
    ids=few(["attached", "its move", "free duration", "slowed", "at the tcp", "in one move"], 2),
)
def test_masses_up_to_the_largest_verify_from_outside(job: str, at: int | None, outside: str) -> None:
    found = payload_capacity(job_from_text(job), at)
    largest = float(found.mass or 0)
    assert [part for part in few((1, 0.99, 1e-3, 0.5), 2) if not verifies(outside, part * largest)] == []
    assert [part for part in few((1 + 1e-6, 1.01, 20, 2), 2) if verifies(outside, part * largest)] == []


OTHER_TOOL = EMPTY.replace(
    "limits:", "tools: {long: {xyz: [300, 0, 0]}, bare: {}}\ntool: long\nlimits:"
).replace("moves:\n", "moves:\n  - {attach: {mass: MASS}}\n  - {tool: bare}\n")


@pytest.mark.full
@pytest.mark.parametrize("at", [None, 3])
def test_what_is_attached_keeps_its_place_on_the_flange_behind_a_change_of_the_tool(at: int | None) -> None:
    """At 300 mm from the flange, and not at the tcp of the second tool."""
    found = payload_capacity(job_from_text(OTHER_TOOL.replace("MASS", "0.5")), at)
    assert found.moves == (0, 1, 2, 3, 4)
    assert verifies(OTHER_TOOL, float(found.mass or 0))
    assert not verifies(OTHER_TOOL, float(found.mass or 0) * (1 + 1e-6))


LIFTING = """
version: 1
robot: ur5e
limits: {effort: robot}
start: {joints: [0, -1.6, 1.6, -1.6, -1.6, 0]}
moves:
  - {planner: time_optimal, through: [{joints: [0.5, -1.5, 1.6, -1.6, -1.6, 0]}]}
  - {attach: {mass: 2}}
  - {planner: time_optimal, through: [{joints: [0.4, -1.0, 1.6, -2.2, -1.6, 0]}]}
"""


@pytest.mark.full
def test_where_each_mass_has_its_own_motion_few_are_tried(monkeypatch) -> None:  # type: ignore[no-untyped-def]
    loaded, planned = job_from_text(LIFTING), list[int]()
    known = planned_move.plan_move_within

    def counted(job, index, *rest):  # type: ignore[no-untyped-def]
        planned.append(index)
        return known(job, index, *rest)

    monkeypatch.setattr(plan_module, "plan_move_within", counted)
    mass = payload_capacity(loaded).mass
    assert mass is not None
    assert planned.count(0) == 1  # nothing is carried there: what is planned once is known
    assert 4 < planned.count(2) < 16  # halving to 1e-10 would take thirty
    held = job_from_text(LIFTING.replace("mass: 2", f"mass: {mass * (1 + 2e-10)!r}"))
    with pytest.raises(TrajcliError, match="gravity alone"):
        plan_job(held)
    assert verifies(LIFTING.replace("mass: 2", "mass: MASS"), mass)


@pytest.mark.full
def test_what_binds_is_said_with_its_place() -> None:
    loaded = job_from_text(EMPTY)
    found = payload_capacity(loaded)
    assert found.mass is not None
    # a point at the tcp: gravity and inertia of one kilogram, about both axes in closed form
    plan = plan_job(loaded)
    t = np.linspace(0, plan.trajectory.duration, 20001)
    q, qd, qdd = (plan.trajectory(t, order) for order in range(3))
    angle, rate, change = (np.stack([each[:, 0], each.sum(axis=1)]) for each in (q, qd, qdd))
    arms = np.array([[0.5], [0.4]])
    x, y = arms * np.cos(angle), arms * np.sin(angle)
    ax = (-y * change - x * rate**2).sum(axis=0)
    ay = (x * change - y * rate**2).sum(axis=0) + 9.81
    moments = np.stack([x.sum(axis=0) * ay - y.sum(axis=0) * ax, x[1] * ay - y[1] * ax], axis=1)
    empty = InverseDynamics(loaded.robot).effort(q, qd, qdd)
    bounds = np.where(moments > 0, [90, 30], [-90, -40])
    masses = (bounds - empty) / moments
    row, joint = np.unravel_index(masses.argmin(), masses.shape)
    assert found.mass == pytest.approx(masses.min(), rel=1e-5)
    assert found.joint == "ab"[joint]
    assert found.limit == bounds[row, joint]
    assert found.effort == pytest.approx(found.limit, rel=1e-5)
    assert found.time == pytest.approx(t[row], abs=1e-3)
    assert found.move == int(np.searchsorted([2, 3.5], t[row], "right"))


@pytest.mark.full
def test_of_several_payloads_one_or_all() -> None:
    two = CARRYING.replace("MASS", "1").replace(LAST, "") + "  - {attach: {mass: 2}}\n"
    two += "  - {planner: quintic, to: {joints: [0, 0]}, duration: 4}\n"
    alone = payload_capacity(job_from_text(two), 2).mass
    last = payload_capacity(job_from_text(two), 5).mass
    every = payload_capacity(job_from_text(two)).mass
    assert every == pytest.approx(min(alone or 0, last or 0), rel=1e-6)
    assert alone != pytest.approx(last, rel=1e-3)
    other = CARRYING.replace("MASS", "3").replace(LAST, "")
    assert payload_capacity(job_from_text(other)).mass == pytest.approx(alone, rel=1e-6)


FLOWN = (
    HEAD
    + """
limits: {jerk: 3000, effort: {a: 90, b: [-40, 30]}}
zone: 40
start: {joints: [60, 20]}
moves:
  - {attach: {mass: MASS}}
  - {planner: jerk_limited, to: {joints: [20, 20]}}
  - {planner: jerk_limited, to: {joints: [60, 80]}}
"""
)


@pytest.mark.full
def test_what_flies_by_corners_carries_what_it_could_hold_with_stops(monkeypatch) -> None:  # type: ignore[no-untyped-def]
    """On both lines gravity pulls most in the corner: there the second joint can hold 30 N m."""
    flown, planned = plan_module.plan_job, list[bool]()

    def counted(loaded, *rest, **fields):  # type: ignore[no-untyped-def]
        planned.append(loaded.job.flies_by)
        return flown(loaded, *rest, **fields)

    monkeypatch.setattr("trajcli.planning.payload_capacity.plan_job", counted)
    found = payload_capacity(job_from_text(FLOWN.replace("MASS", "1")))
    arm = 9.81 * np.cos(np.radians(40))
    assert found.mass == pytest.approx((30 - 2 * 0.2 * arm) / (0.4 * arm), rel=1e-6)
    assert (found.joint, found.limit) == ("b", 30)
    assert planned.count(True) == 2  # on both sides of what can be held with stops
    assert not verifies(FLOWN, float(found.mass or 0) * (1 + 1e-6))
    unlimited = FLOWN.replace("MASS", "1").replace(", effort: {a: 90, b: [-40, 30]}", "")
    with pytest.raises(InputError, match="no limit of effort"):
        payload_capacity(job_from_text(unlimited))


def test_an_arm_in_the_horizontal_that_rests_carries_anything(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("trajcli.planning.payload_capacity.LARGEST", 1e3)
    text = EMPTY.replace("gravity: [0, -9.81, 0]", "gravity: [0, 0, -9.81]")
    text = text[: text.index("moves:")] + "moves: [{planner: hold, duration: 1}]\n"
    found = payload_capacity(job_from_text(text))
    assert (found.mass, found.joint) == (None, None)


@pytest.mark.parametrize(
    ("second", "where"),
    [
        ("[60, 0, 0]", "at [60, 0, 0] mm of the tcp"),
        ("[50, 0, 0]", "at the centres of mass that the job says"),
        ("[60, 5, 0]", "at the centres of mass that the job says"),
        ("[60, 0, 5]", "at the centres of mass that the job says"),
    ],
)
def test_a_place_is_named_where_all_is_carried_there(
    second: str,
    where: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("trajcli.planning.payload_capacity.LARGEST", 1e3)
    text = EMPTY.replace("gravity: [0, -9.81, 0]", "gravity: [0, 0, -9.81]")
    attached = [
        f"{{attach: {{mass: 1, com: {com}}}}}, {{planner: hold, duration: 1}}"
        for com in ("[60, 0, 0]", second)
    ]
    moves = ", {detach: {}}, ".join(attached)
    (tmp_path / "job.yaml").write_text(text[: text.index("moves:")] + f"moves: [{moves}]\n")
    assert run_payload(PayloadCommand(job=str(tmp_path / "job.yaml"))) == 0
    assert capsys.readouterr().out == f"any mass {where} will do in moves 1, 4\n"


def test_what_is_attached_behind_all_moves_is_carried_by_none(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    job = tmp_path / "job.yaml"
    moves = "moves: [{planner: hold, duration: 1}, {attach: {mass: 2}}]\n"
    job.write_text(EMPTY[: EMPTY.index("moves:")] + moves, encoding="utf-8")
    assert run_payload(PayloadCommand(job=str(job))) == 0
    assert capsys.readouterr().out == "any mass will do: no move carries it\n"


@pytest.mark.parametrize(
    ("text", "at", "message"),
    [
        (EMPTY, 3, "--at 3: arm has no such move"),
        (EMPTY, -1, "--at -1"),
        (CARRYING.replace("MASS", "1"), 3, "nothing is carried there"),
        (
            EMPTY.replace("limits: {effort: {a: 90, b: [-40, 30]}}", ""),
            None,
            "no limit of effort is in force",
        ),
        (EMPTY.replace("duration: 2}", "duration: 0.5}"), None, "does not verify even without the payload"),
    ],
)
def test_one_clear_error(text: str, at: int | None, message: str) -> None:
    with pytest.raises(TrajcliError) as refused:
        payload_capacity(job_from_text("name: arm\n" + text), at)
    assert message in str(refused.value)
    assert refused.value.exit_code == (1 if "verify" in message else 2)
    assert len(refused.value.problems) == 1


def test_gravity_that_is_too_much_without_any_payload_is_the_error_of_the_job() -> None:
    with pytest.raises(TrajcliError, match="gravity") as refused:
        payload_capacity(job_from_text(EMPTY.replace("a: 90", "a: 20")))
    assert refused.value.exit_code == 3
    assert not isinstance(refused.value, InputError)


@pytest.mark.full
def test_a_duration_that_binds_is_the_cause(tmp_path, capsys, monkeypatch) -> None:  # type: ignore[no-untyped-def]
    quickest = "{planner: time_optimal, through: [{joints: [60, 50]}, {joints: [20, 90]}], duration: 1.6}"
    text = CARRYING.replace("{planner: quintic, to: {joints: [20, 90]}, duration: 1.5}", quickest)
    text = text.replace(LAST, "")
    found = payload_capacity(job_from_text(text.replace("MASS", "0.5")))
    assert found.mass is not None
    assert found.cause is not None
    assert "it shall last 1.6 s" in found.cause
    assert (found.move, found.joint, found.effort, found.limit) == (2, None, None, None)
    assert verifies(text, found.mass)
    assert not verifies(text, found.mass * 1.001)
    job = tmp_path / "job.yaml"
    job.write_text(text.replace("MASS", "0.5"))
    monkeypatch.setattr("trajcli.cli.payload.payload_capacity", lambda *_: found)
    assert run_payload(PayloadCommand(job=str(job))) == 0
    assert capsys.readouterr().out.splitlines()[1] == f"  with more, {found.cause}"


def test_the_command_for_people_and_programs(tmp_path, capsys) -> None:  # type: ignore[no-untyped-def]
    job = tmp_path / "job.yaml"
    job.write_text(CARRYING.replace("MASS", "0.5").replace(LAST, ""))
    assert run_payload(PayloadCommand(job=str(job), as_json=True)) == 0
    told = json.loads(capsys.readouterr().out)
    assert list(told) == ["mass", "joint", "move", "time", "effort", "limit", "cause", "com", "moves"]
    assert (told["com"], told["moves"]) == ([0.06, 0.02, 0.0], [2])
    assert (told["joint"], told["move"]) in (("a", 2), ("b", 2))
    assert run_payload(PayloadCommand(job=str(job), override=["moves.1.attach.mass=0.1"], at=2)) == 0
    first, second = capsys.readouterr().out.splitlines()
    assert first.startswith("largest mass at [60, 20, 0] mm of the tcp in move 2: ")
    shown = float(first.rsplit(" ", 2)[1])
    assert 0 < told["mass"] - shown < 1e-4 * told["mass"] or shown == pytest.approx(told["mass"], rel=1e-5)
    assert shown <= told["mass"]
    assert f"with more, {told['joint']} needs" in second


@pytest.mark.parametrize("mass", [2.5, 9.123456, 1.000006, 0.99999951, 123.456499, 31.415926535])
def test_the_mass_that_is_shown_is_the_largest_of_six_digits_that_verifies(
    mass: float, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    job = tmp_path / "job.yaml"
    job.write_text(CARRYING.replace("MASS", "0.5"))
    found = PayloadCapacity(mass, None, (2,), cause="it slips")
    monkeypatch.setattr("trajcli.cli.payload.payload_capacity", lambda *_: found)
    assert run_payload(PayloadCommand(job=str(job))) == 0
    shown = capsys.readouterr().out.splitlines()[0].rsplit(" ", 2)[1]
    exact = Decimal(repr(mass))
    assert Decimal(shown) == round_down(exact, exact.adjusted() - 5)


@pytest.mark.parametrize(
    ("found", "second"),
    [
        (
            {"mass": 0.0, "joint": "b", "move": 4, "time": 1.25, "effort": -30.5, "limit": -30.0},
            "with more, b needs -30.5 N m in move 4, t = 1.25 s, its limit is -30 N m",
        ),
        ({"mass": 2.0, "joint": "a", "move": 2, "effort": 91.0}, "with more, a needs 91 N m in move 2"),
        ({"mass": 2.0, "joint": "a", "move": 2, "cause": "it slips"}, "with more, it slips"),
    ],
)
def test_what_binds_is_said_with_its_numbers(
    found: dict[str, Any],
    second: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    job = tmp_path / "job.yaml"
    job.write_text(CARRYING.replace("MASS", "0.5"))
    capacity = PayloadCapacity(com=None, moves=(2,), **found)
    monkeypatch.setattr("trajcli.cli.payload.payload_capacity", lambda *_: capacity)
    assert run_payload(PayloadCommand(job=str(job))) == 0
    first, line = capsys.readouterr().out.splitlines()
    assert first.endswith(f" in move 2: {found['mass']:g} kg")
    assert line == f"  {second}"


def round_down(value: Decimal, exponent: int) -> Decimal:
    return value.quantize(Decimal(1).scaleb(exponent), ROUND_DOWN)


def test_a_job_for_a_consumer_must_give_it_rows_with_any_mass(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """A trapezoid's acceleration steps between rows: quintics through them pass its limit, whatever is carried."""
    text = HEAD + "limits: {effort: {a: 90, b: [-40, 30]}}\nstart: {joints: [0, 0]}\nmoves:\n"
    text += "  - {planner: trapezoid, to: {joints: [90, 20]}}\n"
    (tmp_path / "alone.yaml").write_text(text, encoding="utf-8")
    (tmp_path / "for.yaml").write_text(text + "output: {for: ros-jtc, rate: 50}\n", encoding="utf-8")
    assert run_payload(PayloadCommand(job=str(tmp_path / "alone.yaml"))) == 0
    assert "largest mass" in capfd.readouterr().out
    with pytest.raises(VerificationError, match="ros-jtc"):
        run_payload(PayloadCommand(job=str(tmp_path / "for.yaml")))
