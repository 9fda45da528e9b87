"""Frames, offsets from points and what they keep, against products of matrices."""

from __future__ import annotations

import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tiers import few

from trajcli.errors import InputError, PlanningError
from trajcli.job.dump import dump_job
from trajcli.job.inline import inline_target
from trajcli.job.read import LoadedJob, job_from_text
from trajcli.kinematics.inverse.vendor_flags import kuka_flags
from trajcli.language.targets import Target, ik_target
from trajcli.units import Units

HEAD = "version: 1\nunits: {angle: deg, length: mm}\nrobot: ur5e\nbase: {xyz: [10, 20, 300], rpy: [5, -10, 70]}\n"
FRAMES = """\
frames:
  cell: {xyz: [300, -100, 50], rpy: [3, 5, 20]}
  tray: {in: cell, xyz: [10, 20, 30], rotvec: [10, 20, 30]}
  bolt: {in: base, xyz: [100, 0, 7], quat_xyzw: [0, 0, 0.6, 0.8]}
  flat: {xyz: [1, 2, 3]}
"""
MOVES = "start: {joints: [0, -90, 90, 0, 90, 0]}\nmoves: [{planner: hold, duration: 1}]\n"


def pose(rotation: Rotation, *xyz: float) -> np.ndarray:
    result = np.eye(4)
    result[:3, :3], result[:3, 3] = rotation.as_matrix(), np.array(xyz) / 1e3
    return result


def euler(*degrees: float) -> Rotation:
    return Rotation.from_euler("xyz", degrees, degrees=True)


CELL = pose(euler(3, 5, 20), 300, -100, 50)
AXES = {
    "world": np.eye(4),
    "base": pose(euler(5, -10, 70), 10, 20, 300),
    "cell": CELL,
    "tray": CELL @ pose(Rotation.from_rotvec([10, 20, 30], degrees=True), 10, 20, 30),
    "bolt": pose(euler(5, -10, 70), 10, 20, 300) @ pose(Rotation.from_quat([0, 0, 0.6, 0.8]), 100, 0, 7),
    "flat": pose(Rotation.identity(), 1, 2, 3),
}


def read(points: str, moves: str = MOVES) -> LoadedJob:
    return job_from_text(f"{HEAD}{FRAMES}points:\n{points}{moves}", "job.yaml")


def again(job: LoadedJob) -> LoadedJob:
    """Return what the resolved job is read as, which its points are in rad and m, too."""
    text = dump_job(job)
    same = job_from_text(text)
    assert (
        job_from_text(text.replace("{angle: deg, length: mm}", "{angle: rad, length: m}")).job.points
        == same.job.points
    )
    return same


OFFSET = pose(euler(4, -5, 6), 1, -2, 3)
OFFSET_TEXT = "offset: {xyz: [1, -2, 3], rpy: [4, -5, 6]}"
ORIENTATIONS = [
    "rpy: [170, 20, 30]",
    "matrix: [[0, 1, 0], [1, 0, 0], [0, 0, -1]]",
    "euler: {sequence: ZYZ, angles: [1, 2, 3]}",
]
TURNS = [euler(170, 20, 30), Rotation.from_matrix([[0, 1, 0], [1, 0, 0], [0, 0, -1]]),
         Rotation.from_euler("ZYZ", [1, 2, 3], degrees=True)]  # fmt: skip


ALONG = [(outer, along) for along in (*AXES, "tool") for outer in AXES]


@pytest.mark.parametrize(("outer", "along"), few(ALONG, 10))
def test_an_offset_along_any_axes_from_a_point_in_any_frame(outer: str, along: str) -> None:
    """In chains of two, also where an offset does not turn; the point keeps its branch."""
    offsets = ((OFFSET, OFFSET_TEXT), (pose(Rotation.identity(), 0, 7, 0), "offset: {xyz: [0, 7, 0]}"))
    points, expected = "", {}
    for number, (text, turn) in enumerate(zip(ORIENTATIONS, TURNS, strict=True)):
        for kind, (offset, written) in enumerate(offsets):
            a, b, c = (f"{letter}{number}{kind}" for letter in "abc")
            points += f"  {a}: {{in: {outer}, xyz: [40, 50, 60], {text}, configuration: {{elbow: up}}}}\n"
            points += f"  {b}: {{from: {a}, {written}, frame: {along}}}\n"
            points += f"  {c}: {{from: {b}, {written}, frame: {along}}}\n"
            expected[a] = AXES[outer] @ pose(turn, 40, 50, 60)
            for before, name in ((a, b), (b, c)):
                start = expected[before]
                axes = AXES.get(along, start)[:3, :3]
                moved = expected[name] = np.eye(4)
                moved[:3, 3] = start[:3, 3] + axes @ offset[:3, 3]
                moved[:3, :3] = axes @ offset[:3, :3] @ axes.T @ start[:3, :3]
    job = read(points)
    assert len(expected) == 18
    for each in (job, again(job)):
        for name, where in expected.items():
            point = each.job.points[name]
            np.testing.assert_allclose(point.full_pose(), where, atol=2e-14)
            assert point.configuration is not None
            assert point.configuration.elbow == "up"


@pytest.mark.parametrize("order", ["abcd", "dcba", "cdab", "bdac"])
def test_chains_are_products_in_whatever_order_they_are_written(order: str) -> None:
    steps = {
        "b": "{xyz: [1, 0, 0], rpy: [0, 0, 90]}",
        "c": "{xyz: [0, 2, 0], rpy: [90, 0, 0]}",
        "d": "{xyz: [0, 0, 3]}",
    }
    text = {"a": "{xyz: [7, 8, 9], rpy: [0, 90, 0]}"}
    text |= {name: f"{{from: {before}, offset: {steps[name]}}}" for before, name in ("ab", "bc", "cd")}
    points = read("".join(f"  {name}: {text[name]}\n" for name in order)).job.points
    a = pose(euler(0, 90, 0), 7, 8, 9)
    b = a @ pose(euler(0, 0, 90), 1, 0, 0)
    c = b @ pose(euler(90, 0, 0), 0, 2, 0)
    for name, expected in {"a": a, "b": b, "c": c, "d": c @ pose(euler(0, 0, 0), 0, 0, 3)}.items():
        np.testing.assert_allclose(points[name].full_pose(), expected, atol=1e-15)


def test_a_circle_of_points_is_named_by_those_in_it() -> None:
    with pytest.raises(InputError) as caught:
        read("  c: {from: a}\n  d: {from: c}\n  a: {from: b}\n  b: {from: a}\n  n: m\n  m: o\n  o: m\n")
    said = [problem.message for problem in caught.value.problems]
    assert said[:2] == ["the point 'a' is relative to itself (a -> b -> a)"] * 2
    assert {text.partition(" (")[0] for text in said[2:4]} <= {
        f"the point '{n}' is relative to itself" for n in "ab"
    }
    assert [text.partition(" (")[0] for text in said[4:]] == [
        f"the point '{n}' is named by itself" for n in "mom"
    ]
    assert len(said) == 7


def test_what_stands_beside_from_is_kept_or_counts_more() -> None:
    points = read(
        "  a: {xyz: [1, 2, 3], rpy: [0, 0, 5], joints: {wrist_3_joint: 30}, velocity: 7, acceleration: 8}\n"
        "  b: {from: a, offset: {xyz: [0, 0, 1]}}\n"
        "  c: {from: b, joints: {elbow_joint: 10, wrist_3_joint: 20}, velocity: {wrist_1_joint: 9}, acceleration: 3}\n"
        "  s: {from: c, velocity: 3}\n  d: {xyz: [1, 2, 3], direction: [0, 3, 4], tool_axis: y}\n"
        "  e: {from: d, offset: {xyz: [0, 0, 1]}, frame: tray}\n"
    ).job.points
    degrees = {name: {k: np.degrees(v) for k, v in (point.pinned.by_index if point.pinned else {}).items()}
               for name, point in points.items()}  # fmt: skip
    assert degrees["a"] == degrees["b"] == pytest.approx({5: 30})
    assert degrees["c"] == pytest.approx({2: 10, 5: 20})
    assert degrees["s"] == pytest.approx({2: 10, 5: 20})
    assert points["b"].velocity is None
    assert points["b"].acceleration is None
    assert points["c"].velocity == pytest.approx((0, 0, 0, np.radians(9), 0, 0))
    assert points["c"].acceleration == pytest.approx((np.radians(3),) * 6)
    assert (points["e"].direction, points["e"].tool_axis) == ((0, 3, 4), "y")


def test_what_a_point_relative_to_joints_says_of_its_branch_holds_for_those_relative_to_it() -> None:
    job = read(
        "  j: {joints: [0, -90, 90, 0, 90, 0]}\n"
        "  a: {from: j, configuration: {elbow: down}, joints: {wrist_3_joint: 20}, velocity: 3}\n"
        "  b: {from: a, offset: {xyz: [0, 0, 1]}}\n  c: {from: b, configuration: {wrist: flip}, joints: {elbow_joint: 10}}\n"
    )
    pins_alone = read(
        "  j: {joints: [0, -90, 90, 0, 90, 0]}\n  a: {from: j, joints: {wrist_3_joint: 20}}\n  b: {from: a}\n"
    ).job.points["b"]
    assert pins_alone.pinned is not None
    assert pins_alone.pinned.by_index == pytest.approx({5: np.radians(20)})
    for each in (job, again(job)):
        points = each.job.points
        told = {
            name: point.configuration and point.configuration.branch_names for name, point in points.items()
        }
        assert told == {"j": None, "a": {"elbow": "down"}, "b": {"elbow": "down"}, "c": {"wrist": "flip"}}
        pins = [points[name].pinned for name in "abc"]
        assert [pin and {k: round(np.degrees(v)) for k, v in pin.by_index.items()} for pin in pins] == [
            {5: 20},
            {5: 20},
            {2: 10},
        ]
        assert points["b"].velocity is None


def of_move(target: str) -> Target:
    moves = MOVES.replace("{planner: hold, duration: 1}", f"{{planner: line, to: {target}}}")
    text = "  j: {joints: [0, -90, 90, 0, 90, 0]}\n  h: {from: here, offset: {xyz: [0, 0, 1]}}\n  k: {joints_by: 3}\n"
    job = read(text, moves)
    resolved = again(job)
    (move,), (same,) = job.job.moves, resolved.job.moves
    assert (job.waits, resolved.waits) == (True, True)
    assert move.to == same.to  # type: ignore[attr-defined]
    return move.to  # type: ignore[attr-defined, no-any-return]


@pytest.mark.parametrize("origin", ["here", "j", "h", "k"])
@pytest.mark.parametrize("along", few([*AXES, "tool", ""], 3))
def test_what_only_the_plan_knows_is_kept_as_a_displacement(origin: str, along: str) -> None:
    frame = f", frame: {along}" if along else ""
    relative = of_move(f"{{from: {origin}, {OFFSET_TEXT}{frame}, configuration: {{elbow: down}}}}").relative
    assert relative is not None
    assert relative.origin == origin
    start = pose(euler(10, 20, 30), 1, 2, 3)
    axes = AXES[along][:3, :3] if along in AXES else start[:3, :3]
    expected = np.eye(4)
    expected[:3, :3] = axes @ OFFSET[:3, :3] @ axes.T @ start[:3, :3]
    expected[:3, 3] = start[:3, 3] + axes @ OFFSET[:3, 3]
    np.testing.assert_allclose(relative.after(start), expected, atol=1e-14)


def test_a_point_that_cannot_stand_in_a_list_is_refused_there_and_a_wrong_one_where_it_is() -> None:
    move = MOVES.replace("{planner: hold, duration: 1}", "{planner: spline, through: [halt, a], to: a}")
    with pytest.raises(InputError) as caught:
        read("  halt: {velocity: 0}\n  a: {joints: 3}\n", move)
    (problem,) = caught.value.problems
    assert problem.message == "a waypoint needs `joints` or a pose"
    assert problem.place is not None
    assert problem.place.source[problem.place.column - 1 :].startswith("halt, a]")
    with pytest.raises(InputError) as caught:
        read("  halt: {velocity: x}\n  a: {joints: 3}\n", move)
    (problem,) = caught.value.problems
    assert problem.place is not None
    assert problem.place.source[problem.place.column - 1 :].startswith("x}")


WRONG = [  # points, their message, line and what it points at
    ("  p: {joints: 0, joints_by: 3}\n", "joints and joints_by exclude each other", "3}"),
    ("  p: {joints_by: 3, xyz: [0, 0, 0]}\n", "joints_by and xyz exclude each other", "[0, 0, 0]"),
    ("  p: {joints: 3, yaw: 3}\n", "joints and yaw exclude each other", "3}"),
    ("  p: {xyz: [1, 2, 3], yaw: 3, pitch: 2}\n", "yaw and pitch exclude each other", "2}"),
    ("  p: {rpy: [1, 2, 3], direction: z}\n", "rpy and direction exclude each other", "z}"),
    ("  p: {rpy: [1, 2, 3], rotvec: [1, 2, 3]}\n", "rpy and rotvec exclude each other", "[1, 2, 3]}"),
    ("  p: {xyz: [1, 2, 3], matrix: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}\n", "already has a position", "[1, 2, 3], m"),
    ("  p: {matrix: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0.1, 1]]}\n", "the last row of a 4x4 matrix must be [0, 0, 0, 1], it is [0, 0, 0.1, 1]", "[0, 0, 0.1, 1]"),
    ("  p: {matrix: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1], [0, 0, 0, 1]]}\n", "expected a 3x3 or 4x4 matrix", "[[1"),
    ("  p: {matrix: [[1, 0, 0], [0, 1, 0], [0, 0, -1]]}\n", "the matrix mirrors space", "[[1"),
    ("  p: {matrix: [[1, 0, 0, 1 deg], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}\n", "expected a length", "1 deg"),
    ("  p: {matrix: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1 mm]]}\n", "without a unit", "1 mm"),
    ("  p: {configuration: {elbow: up}, joints: 0}\n", "configuration says something about a pose", "{elbow"),
    ("  p: {tool_axis: x, joints: 0}\n", "tool_axis says something about a pose", "x,"),
    ("  p: {xyz: [1, 2, x]}\n", "expected a length", "x]"),
    ("  p: {rpy: [1, 2]}\n", "expected 3 numbers, got 2 values", "[1, 2]"),
    ("  p: {rpy: [1, 2, 3, 4]}\n", "expected 3 numbers, got 4 values", "[1, 2, 3, 4]"),
    ("  p: {acceleration: 3}\n", "a state needs `joints` or a pose", "{acc"),
    ("  p: {xyz: [1, 2, 3], configuration: {abb: [0, 0, 0, 8]}}\n", "the last from 0 to 7", "[0, 0, 0, 8]"),
    ("  p: {xyz: [1, 2, 3], configuration: {abb: [0, 0, 0, -1]}}\n", "the last from 0 to 7", "[0, 0, 0, -1]"),
    ("  p: {xyz: [1, 2, 3], configuration: {kuka: {s: 32}}}\n", "from 0 to 31", "32"),
    ("  p: {xyz: [1, 2, 3], configuration: {kuka: {s: B100000}}}\n", "from 0 to 31", "B100000"),
    ("  p: {xyz: [1, 2, 3], configuration: {kuka: {s: 2, t: 64}}}\n", "from 0 to 63", "64"),
    ("  p: {xyz: [1, 2, 3], configuration: {kuka: {s: true}}}\n", "from 0 to 31", "true"),
    ("  p: {xyz: [1, 2, 3], configuration: {fanuc: N U X}}\n", "expected a FANUC configuration", "N U X"),
    ("  p: {xyz: [1, 2, 3], configuration: {fanuc: N U T, wrist: flip}}\n", "fanuc and wrist exclude each other", "N U T"),
    ("  p: {xyz: [1, 2, 3], configuration: {kuka: {s: 1}, abb: [0, 0, 0, 0]}}\n", "abb and kuka exclude each other", "[0,"),
    ("  p: q\n  q: p\n", "named by itself (p -> q -> p)", "q\n"),
    ("  p: {in: cell, configuration: {elbow: up}}\n", "configuration says something about a pose", "{elbow"),
]  # fmt: skip


@pytest.mark.parametrize(("points", "message", "at"), WRONG)
def test_wrong_states_are_refused_where_they_stand(points: str, message: str, at: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)) as caught:
        read(points)
    place = caught.value.problems[0].place
    assert place is not None
    assert f"{place.source}\n"[place.column - 1 :].startswith(at)


@pytest.mark.parametrize(
    ("given", "s", "t"),
    [("31", 31, None), ("B010", 2, None), ("'b11111'", 31, None), ("0", 0, 63), ("5", 5, 0)],
)
def test_bits_of_a_kuka_position(given: str, s: int, t: int | None) -> None:
    turn = "" if t is None else f", t: {t}"
    configuration = (
        read(f"  p: {{xyz: [1, 2, 3], configuration: {{kuka: {{s: {given}{turn}}}}}}}\n")
        .job.points["p"]
        .configuration
    )
    assert configuration is not None
    assert configuration.kuka is not None
    assert (configuration.kuka.s, configuration.kuka.t) == (s, t)
    assert configuration.flags == kuka_flags(s, t)
    assert configuration.branch_names == {}
    named = read("  p: {xyz: [1, 2, 3], configuration: {wrist: flip}}\n").job.points["p"].configuration
    assert named is not None
    assert (named.branch_names, named.flags) == ({"wrist": "flip"}, None)


def test_steps_between_frames_are_along_the_axes_that_are_asked_for() -> None:
    """Of the first one's own, of world or of the frame in which the first one is given."""
    for outer, along, axes in (
        ("world", "", np.eye(3)),
        ("cell", "", AXES["cell"][:3, :3]),
        ("cell", ", frame: world", np.eye(3)),
        ("world", ", frame: bolt", AXES["bolt"][:3, :3]),
        ("cell", ", frame: first", None),
    ):
        first = AXES[outer] @ pose(euler(7, 8, 9), 40, 50, 60)
        more = f"  first: {{in: {outer}, xyz: [40, 50, 60], rpy: [7, 8, 9]}}\n"
        more += f"  lane: {{grid: {{from: first, steps: [{{count: 3, xyz: [10, -20, 30]}}]{along}}}}}\n"
        move = "{repeat: lane, moves: [{planner: line, to: {in: lane, xyz: [1, 2, 3], rpy: [0, 0, 0]}}]}"
        text = f"{HEAD}{FRAMES}{more}{MOVES.replace('{planner: hold, duration: 1}', move)}"
        for count, each in enumerate(job_from_text(text).job.moves):
            place = first.copy()
            axis = first[:3, :3] if axes is None else axes
            place[:3, 3] += axis @ np.array([10, -20, 30]) * count / 1e3
            expected = place @ pose(Rotation.identity(), 1, 2, 3)
            np.testing.assert_allclose(each.to.full_pose(), expected, atol=1e-14)  # type: ignore[attr-defined]


def test_what_stands_beside_a_pose_in_a_frame_is_kept() -> None:
    beside = (
        "velocity: 5, acceleration: {elbow_joint: 6}, joints: {wrist_3_joint: 30}, configuration: {elbow: up}"
    )
    for frame in AXES:
        points = read(f"  p: {{in: {frame}, xyz: [1, 2, 3], rpy: [1, 2, 3], {beside}}}\n").job.points
        assert points["p"].velocity == pytest.approx((np.radians(5),) * 6)
        assert points["p"].acceleration == pytest.approx((0, 0, np.radians(6), 0, 0, 0))
        assert points["p"].pinned is not None
        assert points["p"].pinned.by_index == pytest.approx({5: np.radians(30)})
        assert points["p"].configuration is not None


@pytest.mark.parametrize("lean", ["[1e-6, 0, 0]", "[0, 1e-6, 0]", "[90, 0, 0]", "[0, -90, 0]"])
def test_headings_and_elevations_are_about_a_vertical(lean: str) -> None:
    for part, other in (("yaw", "pitch"), ("pitch", "yaw")):
        text = f"{HEAD}frames: {{f: {{rpy: {lean}}}}}\npoints: {{p: {{in: f, {part}: 3}}}}\n{MOVES}"
        with pytest.raises(
            InputError, match=f"{part} is about the vertical, and the z axis of 'f' leans"
        ) as caught:
            job_from_text(text)
        place = caught.value.problems[0].place
        assert place is not None
        assert place.source[place.column - 1 :].startswith("3}")
        for upright in ("[0, 0, 40]", "[180, 0, 0]", "[0, 180, 0]", "[1e-8, 0, 0]"):
            point = job_from_text(text.replace(lean, upright)).job.points["p"]
            assert getattr(point, part) is not None
            assert getattr(point, other) is None


def test_elevations_in_frames_upside_down_and_upright() -> None:
    for rpy, sign in (("[0, 0, 40]", 1), ("[180, 0, 0]", -1), ("[0, 180, 0]", -1)):
        text = f"{HEAD}frames: {{f: {{rpy: {rpy}}}}}\npoints: {{p: {{in: f, pitch: -90, tool_axis: x}}}}\n{MOVES}"
        point = job_from_text(text).job.points["p"]
        assert point.pitch == pytest.approx(-sign * np.pi / 2)
        target = ik_target(point)
        assert (target.orientation, target.tool_axis) == ("direction", "x")
        np.testing.assert_allclose(target.aims, [0, 0, -sign], atol=1e-15)


def test_targets_fix_what_they_say_and_leave_the_rest_free() -> None:
    text = (
        "  a: {rpy: [0, 0, 90]}\n  b: {xyz: [1, 2, 3], yaw: 30, tool_axis: y}\n  c: {direction: [0, 3, 4], tool_axis: x}\n"
        "  d: {xyz: [1, 2, 3]}\n  e: {pitch: 89}\n  f: {xyz: [1.1e12, 0, 0]}\n"
        "  g: {matrix: [[1, 0, 0, 7], [0, 1, 0, 8], [0, 0, 1, 9], [0, 0, 0, 1]]}\n"
    )
    points = read(text).job.points
    found = {name: ik_target(points[name]) for name in "abcdeg"}
    assert {name: (each.position[0], each.orientation, each.tool_axis) for name, each in found.items()} == {
        "a": (False, "all", "z"),
        "b": (True, "yaw", "y"),
        "c": (False, "direction", "x"),
        "d": (True, "none", "z"),
        "e": (False, "pitch", "z"),
        "g": (True, "all", "z"),
    }
    np.testing.assert_allclose(found["g"].poses[..., :3, 3], [0.007, 0.008, 0.009])
    assert points["g"].gives_position
    with pytest.raises(PlanningError, match="no robot reaches so far"):
        ik_target(points["f"])


@pytest.mark.parametrize("frame", [*AXES, ""])
def test_a_whole_matrix_in_a_frame_has_its_position_there(frame: str) -> None:
    rows = "[[0, -1, 0, 7], [1, 0, 0, 8], [0, 0, 1, 9 cm], [0, 0, 0, 1]]"
    where = f"in: {frame}, " if frame else ""
    job = read(f"  p: {{{where}matrix: {rows}}}\n  q: {{from: p, offset: {{xyz: [0, 0, 1]}}}}\n")
    expected = AXES[frame or "world"] @ pose(euler(0, 0, 90), 7, 8, 90)
    for each in (job, again(job)):
        np.testing.assert_allclose(each.job.points["p"].full_pose(), expected, atol=1e-15)
        above = expected @ pose(Rotation.identity(), 0, 0, 1)
        np.testing.assert_allclose(each.job.points["q"].full_pose(), above, atol=1e-15)


def test_joints_beside_a_pose_that_is_asked_for_are_some_by_name() -> None:
    robot = read("  j: {joints: 0}\n").robot
    text = "{xyz: [1, 2, 3], joints: JOINTS}"
    asked = inline_target(text.replace("JOINTS", "{elbow_joint: 30}"), Units("deg", "mm"), robot)
    assert asked.pins == pytest.approx({2: np.radians(30)})
    for joints in ("[1, 2, 3, 4, 5, 6]", "3", str(dict.fromkeys(robot.joint_names, 1)).replace("'", "")):
        with pytest.raises(InputError, match="beside a pose `joints` pins some joints by name"):
            inline_target(text.replace("JOINTS", joints), Units("deg", "mm"), robot)
    with pytest.raises(InputError, match="the target fixes nothing"):
        inline_target("{joints: {elbow_joint: 30}}", Units(), robot)
