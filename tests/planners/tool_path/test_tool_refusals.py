"""Moves along a path that are refused: each with one clear error, its place, and what would fix it."""

from __future__ import annotations

import copy
import re

import numpy as np
import pytest
from tool_jobs import (
    DOWN,
    LIMITS,
    ROUND,
    START,
    TCP,
    TO,
    arm,
    line,
    plan,
    refusal,
    rows,
    times_of,
)

from trajcli.errors import MissingLimitError, PlanningError
from trajcli.kinematics.forward import forward


def without(*names):
    limits = copy.deepcopy(LIMITS)
    for name in names:
        del limits["tcp"][name]
    return limits


MISSING = [
    (line(), ("speed", "acceleration", "angular_speed", "angular_acceleration"), "acceleration"),
    (
        line(law={"shape": "cubic"}),
        ("speed", "acceleration", "angular_speed", "angular_acceleration"),
        "speed",
    ),
    (line(law={"shape": "jerk_limited"}), (), "jerk"),
    (line({"rpy": [np.pi, 0, 0.8]}), ("angular_acceleration",), "angular_acceleration"),
    (
        line({"rpy": [np.pi, 0, 0.8]}, law={"shape": "cubic"}),
        ("angular_speed", "angular_acceleration"),
        "angular_speed",
    ),
    (line(law={"duration": 3}), ("acceleration", "angular_acceleration"), "acceleration"),
    (line(law={"deceleration": 1}), ("acceleration", "angular_acceleration"), "acceleration"),
    (line(law={"deceleration": 1, "duration": 3}), ("acceleration", "angular_acceleration"), "acceleration"),
    (
        line({"rpy": [np.pi, 0, 0.8]}, law={"duration": 3, "speed": 0.1}),
        ("angular_acceleration",),
        "angular_acceleration",
    ),
]


@pytest.mark.parametrize(("move", "names", "key"), MISSING)
def test_a_missing_limit_is_named_by_its_key(move, names, key):
    error = refusal("ur5e", START, move, limits=without(*names))
    assert isinstance(error, MissingLimitError)
    assert error.exit_code == 2
    assert f"tcp: {{{key}: ...}}" in error.problems[0].hint
    assert error.problems[0].place is not None


def test_the_fastest_law_needs_the_joints_limits():
    error = refusal("ur5e", START, line(law={"shape": "time_optimal"}), limits={"tcp": TCP})
    assert isinstance(error, MissingLimitError)
    assert "acceleration of shoulder_pan_joint" in str(error)


def segment(**fields):
    ends = [{"line": {"xyz": [0.4, 0.3, 0.05]}}, {"line": TO}]
    return {"planner": "path", "corner": "stop", "segments": ends, **fields}


QUARTER = {"center": [0.4, 0.15, 0.05], "axis": "z", "to": {"xyz": [0.45, 0.15, 0.05]}}
TWO = [{"line": {"xyz": [0.4, 0.3, 0.05]}}, {"line": {"xyz": [0.5, 0.3, 0.05]}}]
WRONG = {
    "moving end": (line({**TO, "velocity": 0.1}), "line ends at rest", 2),
    "moving end of a screw": ({"planner": "screw", "to": {**TO, "velocity": 0.1}}, "screw ends at rest", 2),
    "no place": (line({"velocity": 0}), "needs a pose or `joints`", 2),
    "duration of the fastest": (
        line(law={"shape": "time_optimal", "duration": 2}),
        "as short as its limits",
        2,
    ),
    "jerk of a trapezoid": (line(law={"jerk": 5}), "its jerk cannot be limited", 2),
    "deceleration": (line(law={"shape": "cubic", "deceleration": 1}), "slows down as it speeds up", 2),
    "three of trapezoid": (line(law={"duration": 2, "speed": 0.2, "acceleration": 1}), "ask too much", 2),
    "both durations": (
        line(law={"shape": "cubic", "duration": 2, "minimum_duration": 1}),
        "exclude each other",
        2,
    ),
    "speed out of the interval": (line(law={"duration": 2, "speed": 0.05}), "it must be above", 3),
    "too little time": (line(law={"duration": 0.1}), "no trapezoid|trapezoid over|cannot", 3),
    "tolerance": (line(tolerance={"position": 0}), "above 0", 2),
    "shape": (line(law={"shape": "parabola"}), "parabola", 2),
    "orientation": (line(orientation="euler", to_=1), "to_", 2),
    "euler without angles": (
        line({"xyz": TO["xyz"], "quat_wxyz": [0, 1, 0, 0]}, orientation="euler"),
        "no angles",
        2,
    ),
    "tangent in place": (line({"rpy": DOWN}, orientation="tangent"), "tangent", 3),
    "tangent and a target's": (line(orientation="tangent"), "follows from the path", 3),
    "tangent and that of the start, behind a bend": (
        {"planner": "arc", **QUARTER, "to": {**QUARTER["to"], "rpy": DOWN}, "orientation": "tangent"},
        "follows from the path",
        3,
    ),
    "screw of a place": (
        {"planner": "screw", "to": {"xyz": [0.4, 0.2, 0.1], "yaw": 1, "tool_axis": "x"}},
        "a screw needs the whole",
        2,
    ),
    "arc of nothing": ({"planner": "arc"}, "not given by nothing", 2),
    "arc of too much": ({"planner": "arc", **ROUND, "to": TO}, "not given by", 2),
    "pitch of a via": ({"planner": "arc", "via": TO, "to": TO, "pitch": 0.1}, "a helix is given by", 2),
    "via without place": ({"planner": "arc", "via": {"rpy": DOWN}, "to": TO}, "needs `xyz`", 2),
    "points in a row": (
        {"planner": "arc", "via": {"xyz": [0.4, 0.2, 0.05]}, "to": {"xyz": [0.4, 0.3, 0.05]}},
        "line",
        3,
    ),
    "center at the start": (
        {"planner": "arc", "center": START["xyz"], "axis": "z", "angle": 1.0},
        "needs a radius",
        2,
    ),
    "center not between": (
        {"planner": "arc", "center": [0.4, 0.2, 0.05], "to": {"xyz": [0.4, 0.5, 0.05]}},
        "center",
        3,
    ),
    "no radius": (segment(corner="round"), "has no radius", 2),
    "radius of a stop": (segment(corner="stop", radius=0.01), "corner: stop has no radius", 2),
    "overlap of a stop": (segment(corner="stop", overlap=0.1), "does not overlap", 2),
    "overlap without time": (segment(corner="overlap"), "needs the time", 2),
    "overlap and fastest": (
        segment(corner="overlap", overlap=0.1, law={"shape": "time_optimal"}),
        "laws of their own",
        2,
    ),
    "overlap and euler": (
        segment(corner="overlap", overlap=0.1, orientation="euler"),
        "not defined where",
        2,
    ),
    "overlap too long": (segment(corner="overlap", overlap=5), "too short to overlap", 3),
    "no segments": ({"planner": "path", "segments": []}, "at least 1|segments", 2),
    "two in one": (
        {"planner": "path", "segments": [{"line": TO, "arc": ROUND}]},
        "either a `line` or an `arc`",
        2,
    ),
    "another kind": (
        {
            "planner": "path",
            "corner": "stop",
            "segments": [{"line": TO}, {"line": {"xyz": [0.5, 0.3, 0.05], "yaw": 1, "tool_axis": "x"}}],
        },
        "fixes another part",
        2,
    ),
    "tangent in a corner": (
        {"planner": "path", "corner": "stop", "segments": TWO, "orientation": "tangent"},
        "would jump",
        3,
    ),
}


@pytest.mark.parametrize(("move", "message", "code"), WRONG.values(), ids=WRONG)
def test_wrong_input_is_one_clear_error(move, message, code):
    error = refusal("ur5e", START, move)
    (problem,) = error.problems
    assert any(part in problem.text() for part in message.split("|")), problem.text()
    assert problem.place is not None
    assert problem.place.line == 1
    assert error.exit_code == code


@pytest.mark.full
def test_a_moving_start_is_refused():
    run = {"planner": "jerk_limited", "to": {"joints": [0.1, -1.5, 1.5, 0, 1.5, 0], "velocity": 0.1}}
    limits = {**LIMITS, "jerk": 500}
    error = refusal("ur5e", {"joints": [0, -1.5, 1.5, 0, 1.5, 0]}, run, line(), limits=limits)
    assert "rest" in str(error)
    assert error.problems[0].move == 1


def test_a_start_with_an_acceleration_alone_is_refused():
    start = {"joints": [0, -1.5, 1.5, 0, 1.5, 0], "acceleration": [0, 0, 0, 0.25, 0, 0]}
    error = refusal("ur5e", start, line(law={"shape": "quintic"}))
    assert "line starts at rest, but the acceleration of wrist_1_joint is 0.25 rad/s^2 at its start" in str(
        error
    )
    assert error.problems[0].joint == "wrist_1_joint"


def test_bare_joints_have_no_tool():
    error = refusal({"joints": 6}, {"joints": 0}, line())
    assert error.exit_code == 2
    assert "no geometry" in str(error)


def test_out_of_reach_says_where_and_by_how_much():
    """The wrist of a planar arm with the hand along x reaches 0.5 m: by Pythagoras the line ends there."""
    start = {"xyz": [0.45, 0.05, 0], "yaw": 0, "tool_axis": "x", "configuration": {"elbow": "up"}}
    to = {"xyz": [0.45, 0.55, 0], "yaw": 0, "tool_axis": "x"}
    error = refusal("planar3r", start, line(to))
    edge = np.sqrt(0.25 - 0.35**2) - 0.05
    text = str(error)
    assert isinstance(error, PlanningError)
    assert "does not reach" in text
    said, missed = (float(re.search(f"{word} ([0-9.e-]+) m", text).group(1)) for word in ("s =", "up to"))
    assert said == pytest.approx(edge, abs=1e-5)
    assert missed == pytest.approx(np.hypot(0.35, 0.55) - 0.5, abs=1e-6)


def test_a_singularity_says_where_and_which_joint():
    """A wrist that must turn through its middle: the third axis of the hand lines up with the fourth joint's."""
    start = [0.1, 0.7, -0.6, 0.9, 0.5, 0.2]
    robot = arm("puma560")
    here, beyond = np.array(start), np.array(start)
    beyond[4] = -0.5
    to = {"matrix": rows(forward(robot, beyond))}
    error = refusal("puma560", {"joints": rows(here)}, line(to))
    assert isinstance(error, PlanningError)
    assert "singularity" in str(error)
    assert "singular value" in str(error)
    middle = np.linalg.norm(forward(robot, beyond)[:3, 3] - forward(robot, here)[:3, 3])
    assert 0 <= float(str(error).split("s = ")[1].split()[0]) <= max(middle, 1.0)


def test_a_joints_limit_is_named_with_its_place():
    start = [0.0, -1.5, 1.5, 0, 1.5, 0]
    narrow = {**LIMITS, "position": {"shoulder_pan_joint": [-0.2, 0.2]}}
    place = forward(arm("ur5e"), np.array(start))[:3, 3]
    error = refusal(
        "ur5e", {"joints": start}, line({"xyz": rows(place + np.array([0.0, 0.25, 0.0]))}), limits=narrow
    )
    assert isinstance(error, PlanningError)
    assert "shoulder_pan_joint would be at" in str(error)
    assert "its limit is" in str(error)
    assert error.problems[0].joint == "shoulder_pan_joint"
    free = plan("ur5e", {"joints": start}, line({"xyz": rows(place + np.array([0.0, 0.25, 0.0]))}))
    worst = np.abs(free.trajectory.curve.evaluate(times_of(free, 2001))[:, 0]).max()
    assert worst > 0.2
    assert f"{worst:.4f}"[:5] in str(error)


def test_a_tangent_ends_where_the_path_turns_it_to():
    """The target that leaves its orientation out, and a line to one that asks for that of the start."""
    arc = {"planner": "arc", **QUARTER, "orientation": "tangent"}
    ends = [
        plan("ur5e", START, move).moves[0].planned.end.position for move in (arc, {**arc, "axis": [0, 0, -1]})
    ]
    straight = {"planner": "line", "to": {"xyz": TO["xyz"], "rpy": DOWN}, "orientation": "tangent"}
    ends.append(plan("ur5e", START, straight).moves[0].planned.end.position)
    turned = forward(arm("ur5e"), np.array(ends))[:, :3, 0]  # the x axis of the tool
    np.testing.assert_allclose(turned @ turned[2], [0.0, 0.0, 1.0], atol=1e-5)  # by 90 and by -270 degrees


def test_a_screw_says_with_what_a_whole_orientation_is_given():
    error = refusal("ur5e", START, {"planner": "screw", "to": {"xyz": [0.4, 0.2, 0.1], "direction": "z"}})
    assert error.problems[0].hint == "give `rpy`, `quat_wxyz`, `matrix`, `axis_angle` or `euler`"


@pytest.mark.parametrize("planner", ["line", "screw"])
def test_the_branch_that_a_target_names_is_the_one_on_which_the_tool_arrives(planner):
    """On a path the arm keeps its branch: of both elbows, one is that of the start."""
    above, below = ({"planner": planner, "to": {**TO, "configuration": {"elbow": e}}} for e in ("up", "down"))
    plan("ur5e", START, above)
    error = refusal("ur5e", START, below)
    assert re.search(r"arrives in the configuration [a-z_ ]*\bup\b[a-z_ ]*, not down", str(error))


def test_no_screw_turns_otherwise_than_about_its_axis():
    error = refusal("ur5e", START, {"planner": "screw", "to": TO, "orientation": "euler"})
    assert "unknown key 'orientation'" in str(error)


def test_angles_typed_in_a_frame_that_is_turned_are_refused_with_what_works():
    """Angles in such a frame are others in world: the hint says where they are to be typed."""
    to = line(TO | {"in": "part"}, orientation="euler")
    error = refusal("ur5e", START, to, frames={"part": {"xyz": [0, 0.01, 0], "rpy": [0, 0, 0.3]}})
    assert "in world or a frame with its axes" in str(error.problems[0].hint)
    made = plan("ur5e", START, to, frames={"part": {"xyz": [0, 0.01, 0]}}, when_over_limit="slow")
    reached = forward(arm("ur5e"), made.trajectory.curve.piece_ends()[1][-1])
    np.testing.assert_allclose(reached[:3, 3], np.add(TO["xyz"], [0, 0.01, 0]), atol=1e-5)
