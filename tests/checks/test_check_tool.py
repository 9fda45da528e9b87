"""Checks of the tool: right motions pass; a mutant for each kind of finding fails it, and says what a peer finds."""

from __future__ import annotations

import dataclasses
import re
from functools import cache

import numpy as np
import pytest
from hermite_curves import hermite_pieces

from trajcli.checks.tool import SampledTool, _check_speeds, check_tool
from trajcli.checks.verify import limit_findings, verify
from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import PiecewisePolynomial, concatenate, constant
from trajcli.geometry.paths.orientation import AxisAngleOrientation, SegmentProgress
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.geometry.paths.position import Line
from trajcli.job.robot import load_robot
from trajcli.kinematics.following.motion import motion_along
from trajcli.kinematics.following.tolerance import Tolerance
from trajcli.kinematics.following.tool_path import SpeedLimits, ToolPath
from trajcli.kinematics.forward import forward
from trajcli.kinematics.jacobian import tcp_acceleration, tcp_twist
from trajcli.kinematics.robot import Limits, Robot, ToolLimits, unlimited
from trajcli.limits.kinds import LimitedMove
from trajcli.limits.tool import ToolFamily
from trajcli.limits.tool_bound import SpeedRun
from trajcli.planners.tool_path.follow import followed
from trajcli.trajectory import Promise, Span, Trajectory, resting

WHOLE = (True, True, True)
DURATION, LENGTH, TURN = 2.0, 0.2, 0.6
# peaks of a quintic law over length and duration: 15/8, 10/sqrt(3), 60
SPEED, ACCELERATION, JERK = (
    15 / 8 * LENGTH / DURATION,
    10 / np.sqrt(3) * LENGTH / DURATION**2,
    60 * LENGTH / DURATION**3,
)


def law(length=LENGTH, duration=DURATION, conditions=3):
    states = np.zeros((conditions, 2, 1))
    states[0, 1] = length
    return hermite_pieces(np.array([0.0, duration]), states)


def trajectory_of(robot: Robot, curve: PiecewisePolynomial) -> Trajectory:
    ends = [resting(end) for end in (curve.evaluate(curve.start), curve.evaluate(curve.end))]
    names, types = robot.joint_names, robot.joint_types
    return Trajectory(curve, names, types, (Span(0, "line", 0.0, curve.duration, 2),), *ends)


def limited(robot: Robot, **tcp: float) -> Robot:
    limits = unlimited(len(robot.joints))
    return dataclasses.replace(
        robot, limits=Limits(*(limits.of_order(k) for k in range(4)), ToolLimits(**tcp))
    )


def moving(tcp=None, *, the_law=None, turn=(0.0, 0.0, TURN), tolerance=1e-6) -> SampledTool:
    """Return a line of a UR5e with a rotation, followed within a tolerance."""
    robot, q = load_robot("ur5e"), np.array([0.3, -1.2, 1.4, -0.9, -1.3, 0.4])
    pose = forward(robot, q)
    place = Line(pose[:3, 3], pose[:3, 3] + [0.0, LENGTH * 0.6, LENGTH * 0.8])
    from scipy.spatial.transform import Rotation

    last = Rotation.from_rotvec(turn).as_matrix() @ pose[:3, :3]
    turning = AxisAngleOrientation(np.stack([pose[:3, :3], last]), SegmentProgress.even(place.length))
    path = ToolPath(PoseCurve(place, turning), WHOLE, "all")
    s = the_law or law(place.length)
    motion = motion_along(path, s, s.breaks, Tolerance(tolerance, tolerance))
    curve = followed(robot, path, q).by_time(motion)
    return SampledTool(
        trajectory_of(robot, curve),
        Span(0, "line", 0.0, curve.duration, 2),
        limited(robot, **(tcp or {})),
        motion,
    )


RIGHT = moving()
ROOMY = {
    "speed": SPEED * (1 + 1e-4),
    "angular_speed": SPEED * TURN / LENGTH * (1 + 1e-4),
    "acceleration": ACCELERATION * (1 + 1e-4),
    "angular_acceleration": ACCELERATION * TURN / LENGTH * (1 + 1e-4),
    "jerk": JERK * (1 + 1e-4),
}


def judged(rows: SampledTool, **fields) -> list:
    tool = dataclasses.replace(rows, **fields)
    move = LimitedMove(tool.trajectory, tool.span, tool.robot.limits, tool.robot, tool.motion)
    survey = ToolFamily().survey(move)
    return [*check_tool(tool), *([] if survey is None else limit_findings(move, survey))]


def kinds(findings) -> list[str]:
    return [finding.kind for finding in findings]


def with_limits(rows: SampledTool, **tcp) -> SampledTool:
    return dataclasses.replace(rows, robot=limited(rows.robot, **tcp))


def shifted(rows: SampledTool, offset) -> SampledTool:
    """Return rows whose joints are moved by a bump in the middle of the motion."""
    curve = rows.trajectory.curve
    coefficients = curve.coefficients.copy()
    coefficients[-1] += np.asarray(offset)
    return dataclasses.replace(
        rows, trajectory=trajectory_of(rows.robot, PiecewisePolynomial(curve.breaks, coefficients))
    )


def test_a_right_motion_passes_with_and_without_limits():
    assert judged(RIGHT) == []
    assert judged(with_limits(RIGHT, **ROOMY)) == []


@pytest.mark.parametrize("size", [1e-2, 2e-6])
def test_a_tool_beside_its_path(size):
    """All joints stand as they should but one, which moves the tool by lever times angle."""
    found = judged(shifted(RIGHT, [size, 0, 0, 0, 0, 0]))
    assert set(kinds(found)) >= {"tool_path"}
    (beside,) = [finding for finding in found if finding.kind == "tool_path"]
    times = np.linspace(0, DURATION, 2001)
    places = forward(RIGHT.robot, RIGHT.trajectory.curve.evaluate(times))[:, :3, 3]
    lever = np.linalg.norm(places[:, :2], axis=1).max()
    assert beside.value == pytest.approx(size * lever, rel=2e-2)
    assert beside.limit == 1e-6
    assert beside.factor is None


@pytest.mark.parametrize(("position", "angle"), [(1e-3, 1e-6), (1e-6, 1e-3)])
def test_a_tool_that_is_turned_is_measured_by_the_angle_that_was_promised(position, angle):
    """The last joint turns it about its own axis, and moves it nowhere."""
    rows = shifted(RIGHT, [0, 0, 0, 0, 0, 2e-5])
    motion = dataclasses.replace(rows.motion, tolerance=Tolerance(position, angle))
    found = judged(dataclasses.replace(rows, motion=motion))
    assert [(each.kind, each.limit) for each in found] == [("tool_orientation", 1e-6)] * (angle < 2e-5)
    both = dataclasses.replace(shifted(RIGHT, [2e-5, 0, 0, 0, 0, 0]), motion=motion)  # of either a little
    assert kinds(judged(both)) == ["tool_orientation" if angle < position else "tool_path"]


def test_rows_tell_distance_and_angle_apart_where_not_all_of_a_position_is_fixed():
    rows, law = shifted(RIGHT, [0, 0, 0, 0, 0, 2e-5]), RIGHT.motion.law
    path = ToolPath(RIGHT.motion.path.poses, (True, False, False), "all")
    motion = motion_along(path, law, law.breaks, RIGHT.motion.tolerance)
    distance, angle = dataclasses.replace(rows, motion=motion).deviation
    assert distance.max() < 2e-6
    assert angle == pytest.approx(2e-5, abs=2e-6)


def test_a_tool_above_its_path():
    """The second joint lifts it: all three coordinates count."""
    rows = shifted(RIGHT, [0, 2e-5, 0, 0, 0, 0])
    (beside,) = [finding for finding in judged(rows) if finding.kind == "tool_path"]
    times = np.linspace(0, DURATION, 2001)
    went, told = (
        forward(RIGHT.robot, each.trajectory.curve.evaluate(times))[:, :3, 3] for each in (rows, RIGHT)
    )
    assert beside.value == pytest.approx(np.linalg.norm(went - told, axis=1).max(), rel=1e-4)
    assert np.linalg.norm((went - told)[:, :2], axis=1).max() < 0.9 * beside.value


def test_less_than_the_tolerance_beside_its_path_passes():
    assert judged(shifted(RIGHT, [3e-7, 0, 0, 0, 0, 0])) == []


def test_a_tool_that_is_turned():
    """The last joint turns the tool about itself and leaves its place."""
    found = judged(shifted(RIGHT, [0, 0, 0, 0, 0, 5e-6]))
    assert kinds(found) == ["tool_orientation"]
    assert found[0].value == pytest.approx(5e-6, rel=0.3)


def test_a_tool_turned_about_what_is_free_passes():
    """The path fixes the place and the direction of z, which the last joint of this arm leaves."""
    path = dataclasses.replace(RIGHT.motion.path, orientation="direction")
    motion = motion_along(path, RIGHT.motion.law, RIGHT.motion.breaks, RIGHT.motion.tolerance)
    rows = dataclasses.replace(RIGHT, motion=motion)
    assert judged(rows) == []
    assert judged(shifted(rows, [0, 0, 0, 0, 0, 1e-3])) == []
    assert "tool_orientation" in kinds(judged(shifted(rows, [0, 0, 0, 0, 1e-3, 0])))


LAWS = {
    "tool_speed": ("speed", SPEED, 1),
    "tool_angular_speed": ("angular_speed", SPEED * TURN / LENGTH, 1),
    "tool_acceleration": ("acceleration", ACCELERATION, 2),
    "tool_angular_acceleration": ("angular_acceleration", ACCELERATION * TURN / LENGTH, 2),
    "tool_jerk": ("jerk", JERK, 3),
}


@pytest.mark.parametrize("kind", LAWS)
def test_a_limit_below_the_laws_own_peak_is_broken(kind):
    name, peak, order = LAWS[kind]
    (found,) = judged(with_limits(RIGHT, **{name: peak * 0.99}))
    assert found.kind == kind
    assert found.value == pytest.approx(peak, rel=1e-4)
    assert found.limit == pytest.approx(peak * 0.99)
    assert found.factor == pytest.approx((1 / 0.99) ** (1 / order), rel=1e-4)
    assert judged(with_limits(RIGHT, **{name: peak * (1 + 1e-4)})) == []


@cache
def loosely_guided():
    return moving(tolerance=1e-2)


@pytest.mark.parametrize("kind", LAWS)
def test_no_tolerance_of_the_path_is_one_of_a_limit(kind):
    """A tool that may be a centimetre beside its path may not be a part in a hundred above its limits."""
    name, peak, _ = LAWS[kind]
    (found,) = judged(with_limits(loosely_guided(), **{name: peak * 0.99}))
    assert found.kind == kind


@pytest.mark.parametrize(("kind", "part"), [("tool_speed", 1), ("tool_acceleration", 2)])
def test_peaks_are_those_of_a_dense_sampling(kind, part):
    (found,) = judged(with_limits(RIGHT, **{LAWS[kind][0]: 0.01}))
    t = np.linspace(0, DURATION, 20_001)
    curve = RIGHT.trajectory.curve
    q = [curve.evaluate(t, order) for order in range(3)]
    rows = tcp_twist(RIGHT.robot, *q[:2]) if part == 1 else tcp_acceleration(RIGHT.robot, *q)
    sizes = np.linalg.norm(rows[:, :3], axis=1)
    assert found.value == pytest.approx(sizes.max(), rel=1e-6)
    assert found.time == pytest.approx(t[sizes.argmax()], abs=2e-3) or sizes[
        np.abs(t - found.time).argmin()
    ] == pytest.approx(sizes.max(), rel=1e-6)


def test_joints_that_race_make_the_tool_faster_than_its_law():
    """The law is slow enough; the curve that is judged goes the same way in half the time."""
    fast = trajectory_of(RIGHT.robot, scale_time(RIGHT.trajectory.curve, 0.5))
    motion = RIGHT.motion.scaled(0.5)
    rows = SampledTool(fast, Span(0, "line", 0.0, fast.duration, 2), RIGHT.robot, motion)
    assert judged(rows) == []
    found = judged(with_limits(rows, **{name: ROOMY[name] for name in ("speed", "acceleration")}))
    assert kinds(found) == ["tool_speed", "tool_acceleration"]
    assert [finding.factor for finding in found] == pytest.approx([2, 2], rel=1e-3)


def test_a_tool_that_does_not_move_with_its_law():
    """The same way in twice the time is not what the law says."""
    slow = trajectory_of(RIGHT.robot, scale_time(RIGHT.trajectory.curve, 2.0))
    half = dataclasses.replace(RIGHT, trajectory=slow, span=Span(0, "line", 0.0, DURATION, 2))
    assert "tool_path" in kinds(judged(half))


def test_a_step_of_acceleration_although_jerk_is_limited():
    cubic = moving(the_law=law(conditions=2))
    assert judged(cubic) == []
    (found,) = judged(with_limits(cubic, jerk=1e6))
    assert found.kind == "tool_acceleration_jump"
    assert found.value == pytest.approx(6 * LENGTH / DURATION**2)
    assert found.time in (0.0, DURATION)


def planar(elbow) -> SampledTool:
    """Return a planar arm that goes along the tool's way for which its elbow has the given angles over time."""
    t = np.linspace(0, DURATION, 65)
    rows = np.stack([0.4 + 0.1 * t, elbow(t), -0.3 + 0.05 * t], axis=1)
    from scipy.interpolate import make_interp_spline

    spline = make_interp_spline(t, rows, k=5)
    derivatives = np.stack([spline(t, order) for order in range(3)])
    return told(hermite_pieces(t, derivatives))


def told(curve: PiecewisePolynomial) -> SampledTool:
    """Return a planar arm whose tool is told exactly where the joints bring it."""
    robot = load_robot("planar3r")
    whole = trajectory_of(robot, curve)

    def timed(times, side):
        from trajcli.kinematics.following.tool_path import ToolReference

        poses = forward(robot, curve.evaluate(np.clip(times, 0, DURATION)))
        zero = np.zeros((len(poses), 6))
        return ToolReference(
            poses,
            zero,
            zero,
            (True, True, False),
            "yaw",
            "x",
            np.stack([np.arctan2(poses[:, 1, 0], poses[:, 0, 0])] * 3, axis=1),
        )

    motion = dataclasses.replace(
        RIGHT.motion, path=None, reference_at=timed, breaks=np.array([0.0, DURATION]), law=law()
    )
    return SampledTool(whole, Span(0, "line", 0.0, DURATION, 2), limited(robot), motion)


def test_an_elbow_that_straightens_through_changes_the_branch():
    assert judged(planar(lambda t: 0.5 + 0.1 * t)) == []
    (found,) = judged(planar(lambda t: 0.55 - 0.5 * t))
    assert found.kind == "branch"
    assert found.time == pytest.approx(1.1, abs=0.02)
    assert found.factor is None


def test_of_several_changes_of_the_branch_the_first_is_named():
    """0.3 - t + t^2 / 2 is zero twice, at 1 s less and more 0.632 s."""
    (found,) = judged(planar(lambda t: 0.3 - t + t**2 / 2))
    assert (found.kind, found.time) == ("branch", pytest.approx(1 - np.sqrt(0.4), abs=0.1))


def test_a_determinant_of_zero_on_a_row_hides_no_change_of_branch():
    """The arm lies along x at t = 1 s, where each row of its Jacobian across x is exactly zero."""

    def elbow(turn: float) -> SampledTool:
        """Half a radian, straight at the break, and on or back by as much."""
        pieces = np.zeros((2, 2, 3))
        pieces[:, :, 1] = [[-0.5, turn], [0.5, 0.0]]
        return told(PiecewisePolynomial(np.array([0.0, 1.0, 2.0]), pieces))

    (found,) = judged(elbow(-0.5))
    assert (found.kind, found.time) == ("branch", pytest.approx(1.0, abs=1e-12))
    assert judged(elbow(0.5)) == []


def test_a_wrist_that_passes_its_middle_changes_the_branch():
    """A pose that is told as the joints go, with the fifth joint through zero: flip to no flip."""
    robot = load_robot("puma560")
    first, last = np.array([0.2, 0.7, -0.8, 0.4, 0.5, -0.3]), np.array([0.2, 0.7, -0.8, 0.4, -0.3, -0.3])
    states = np.zeros((3, 2, 6))
    states[0] = first, last
    curve = hermite_pieces(np.array([0.0, DURATION]), states)

    def timed(times, side):
        from trajcli.kinematics.following.tool_path import ToolReference

        poses = forward(robot, curve.evaluate(np.clip(times, 0, DURATION)))
        zero = np.zeros((len(poses), 6))
        return ToolReference(poses, zero, zero, WHOLE, "all", "z", zero[:, :0])

    motion = dataclasses.replace(
        RIGHT.motion, path=None, reference_at=timed, breaks=np.array([0.0, DURATION]), law=law()
    )
    whole = trajectory_of(robot, curve)
    (found,) = judged(SampledTool(whole, whole.spans[0], limited(robot), motion))
    assert found.kind == "branch"
    crossing = curve.evaluate(found.time)[4]
    assert abs(crossing) < 0.11  # the first of eight rows of a piece behind it


def test_times_are_those_of_the_whole_trajectory():
    slow = with_limits(RIGHT, angular_speed=SPEED * TURN / LENGTH / 2)
    still = constant(RIGHT.trajectory.curve.evaluate(0.0), 1.0)
    whole = trajectory_of(RIGHT.robot, concatenate([still, RIGHT.trajectory.curve]))
    later = dataclasses.replace(slow, trajectory=whole, span=Span(1, "line", 1.0, 1.0 + DURATION, 2))
    (alone,), (after,) = judged(slow), judged(later)
    assert (after.move, after.time) == (1, pytest.approx(alone.time + 1.0))
    assert f"at t = {after.time:.9g} s" in after.text()


def said(rows: SampledTool, kind: str, **promised) -> tuple[str, str | None]:
    """Return message and remedy of the one finding of a kind, from the trajectory and the promise alone."""
    promise = Promise(tool=rows.motion, robot=rows.robot, **promised)
    findings = verify(rows.trajectory, [rows.robot.limits], [promise]).findings
    (finding,) = [finding for finding in findings if finding.kind == kind]
    number, place = re.compile(r"(?<= )\d[-+.e\d]*(?= (m|rad|s)\b)"), "#"
    amounts = [f"{amount.value:.9g}" for amount in finding.amounts.values()]
    assert all(amount in finding.text() for amount in amounts if f"{finding.limit:.9g}" != amount)
    return number.sub(place, finding.text()), finding.hint


def test_findings_about_the_tool_say_what_is_wrong_and_what_would_fix_it():
    slow = {"ends": (RIGHT.trajectory.start, RIGHT.trajectory.end), "over_limit": "error"}
    message, remedy = said(with_limits(RIGHT, angular_speed=SPEED * TURN / LENGTH / 2), "tool_angular_speed")
    assert message == "the angular speed of the tool reaches # rad/s at t = # s, its limit is # rad/s"
    assert (remedy or "").startswith("it must last 2 times longer (")
    message, remedy = said(with_limits(RIGHT, jerk=JERK / 8), "tool_jerk", **slow)
    assert message == "the jerk of the tool reaches # m/s^3 at t = # s, its limit is # m/s^3"
    assert remedy == f"it must last 2 times longer ({2 * DURATION:.6g} s), or say `when_over_limit: slow`"
    moving_ends = {
        **slow,
        "ends": (RIGHT.trajectory.start, dataclasses.replace(RIGHT.trajectory.end, velocity=np.full(6, 0.1))),
    }
    assert (
        said(with_limits(RIGHT, jerk=JERK / 8), "tool_jerk", **moving_ends)[1]
        == "say `when_over_limit: slow`"
    )
    beside = shifted(RIGHT, [1e-2, 0, 0, 0, 0, 0])
    message, remedy = said(beside, "tool_path", **slow)
    assert message == "the tool is beside its path by # m at t = # s, promised were # m"
    assert remedy == "this is a bug: report it"
    message, remedy = said(beside, "tool_orientation", **slow)
    assert message == "the tool is turned from its path by # rad at t = # s, promised were # rad"
    step = with_limits(moving(the_law=law(conditions=2)), jerk=1e6)
    message, remedy = said(step, "tool_acceleration_jump", **slow)
    assert message == "the acceleration of the tool steps by # m/s^2 at t = # s"
    assert remedy == (
        "use a planner or a law whose acceleration does not step, or leave the limit of the tool's jerk out"
    )
    message, remedy = said(planar(lambda t: 0.55 - 0.5 * t), "branch", **slow)
    assert (message, remedy) == (
        "the arm changes its branch at t = # s: it passes a singularity",
        "move the path",
    )


def later(rows: SampledTool, begins: float) -> SampledTool:
    """Return rows of a second move, before which the arm stands for a while."""
    still = constant(rows.trajectory.curve.evaluate(0.0), begins)
    whole = trajectory_of(rows.robot, concatenate([still, rows.trajectory.curve]))
    end = begins + rows.trajectory.curve.duration
    return dataclasses.replace(rows, trajectory=whole, span=Span(1, "line", begins, end, 2))


@pytest.mark.parametrize("begins", [0.0, 1.5])
@pytest.mark.parametrize("slow", [0, 1, None])
@pytest.mark.parametrize("which", ["speed", "angular_speed"])
def test_each_segment_of_a_path_has_its_own_limits_of_speed(which: str, slow: int | None, begins: float):
    """Both halves reach the same speed, where they meet: of one of them less is allowed."""
    peak = SPEED if which == "speed" else SPEED * TURN / LENGTH
    path = RIGHT.motion.path
    assert path is not None
    allowed = np.array([peak * (1 + 1e-4)] * 2)
    if slow is not None:
        allowed[slow] = 0.9 * peak
    free = np.full(2, np.inf)
    borders = np.array([0.0, path.length / 2, path.length])
    of_speed = (allowed, free) if which == "speed" else (free, allowed)
    motion = dataclasses.replace(
        RIGHT.motion, path=dataclasses.replace(path, speeds=SpeedLimits(borders, (0, 1, 2), *of_speed))
    )
    rows = dataclasses.replace(RIGHT, motion=motion)
    found = list(_check_speeds(later(rows, begins) if begins else rows))
    assert len(found) == (slow is not None)
    for each in found:
        assert each.kind == f"tool_{which}"
        assert each.message.startswith(f"segment {slow}: ")
        assert each.value == pytest.approx(peak, rel=1e-3)
        assert each.time == pytest.approx(begins + DURATION / 2, abs=0.05)
        assert each.move == (1 if begins else 0)


@pytest.mark.parametrize("which", ["speed", "angular_speed"])
@pytest.mark.parametrize(("share", "count"), [(1.0, 0), (1 - 2e-6, 1)])
def test_a_tool_that_is_just_as_fast_as_a_segment_allows_passes(which: str, share: float, count: int) -> None:
    """Its largest speed is that of a dense sampling of its twist, which the Jacobian makes of the joints' rates."""
    path, curve = RIGHT.motion.path, RIGHT.trajectory.curve
    assert path is not None
    times = np.linspace(0.48, 0.52, 8001) * DURATION
    twist = tcp_twist(RIGHT.robot, curve.evaluate(times), curve.evaluate(times, 1))
    peak = np.linalg.norm(twist[:, :3] if which == "speed" else twist[:, 3:], axis=1).max()
    allowed, free, borders = np.array([share * peak]), np.full(1, np.inf), np.array([0.0, path.length])
    of_speed = (allowed, free) if which == "speed" else (free, allowed)
    limited_path = dataclasses.replace(path, speeds=SpeedLimits(borders, (0, 1), *of_speed))
    rows = dataclasses.replace(RIGHT, motion=dataclasses.replace(RIGHT.motion, path=limited_path))
    assert len(list(_check_speeds(rows))) == count


def test_a_speed_that_nobody_knows_is_none_that_a_segment_allows() -> None:
    rows = dataclasses.replace(RIGHT)
    unknown = dataclasses.replace(RIGHT.peaks["speed"], upper_bound=np.nan)
    vars(rows)["speed_runs"] = (SpeedRun((0, 0), (0.0, 1.0), (0.0, 1.0), (1.0, 1.0), (unknown, unknown)),)
    assert [each.kind for each in _check_speeds(rows)] == ["tool_speed", "tool_angular_speed"]


def test_a_tool_is_looked_at_from_its_start_to_its_end() -> None:
    times, breaks = RIGHT.times, RIGHT.trajectory.curve.breaks
    assert (np.diff(times) > 0).all()
    assert set(breaks.tolist()) <= set(times.tolist())
    assert (times[0], times[-1]) == (0.0, DURATION)


def test_a_branch_and_a_bound_have_the_times_of_the_whole():
    beside = shifted(RIGHT, 1e-3 * np.eye(6)[2])
    alone, after = ([each.time for each in check_tool(rows)] for rows in (beside, later(beside, 1.5)))
    assert len(alone) == 2
    assert after == pytest.approx([time + 1.5 for time in alone], abs=1e-6)
    crossing = planar(lambda t: 0.4 - 0.4 * t)
    (here,), (there,) = (
        [each for each in check_tool(rows) if each.kind == "branch"]
        for rows in (crossing, later(crossing, 1.5))
    )
    assert there.time == pytest.approx(here.time + 1.5, abs=1e-9)
    assert here.time == pytest.approx(1.0, abs=0.1)


def test_a_tool_beside_its_path_between_the_rows_is_found_by_its_bound():
    """The first joint leaves by a polynomial that is zero at all rows of one piece, and three tolerances between."""
    curve = RIGHT.trajectory.curve
    piece, rows = curve.pieces // 2, np.linspace(0, 1, 9)
    length = np.diff(curve.breaks)[piece]
    bump = np.poly1d(rows, r=True)
    dense = np.linspace(0, 1, 4001)
    radius = np.linalg.norm(forward(RIGHT.robot, curve.evaluate(curve.breaks[piece]))[:2, 3])
    bump *= 3e-6 / radius / np.abs(bump(dense)).max()
    coefficients = np.pad(curve.coefficients, ((10 - len(curve.coefficients), 0), (0, 0), (0, 0)))
    coefficients[:, piece, 0] += bump.coefficients / length ** np.arange(9, -1, -1)
    moved = trajectory_of(RIGHT.robot, PiecewisePolynomial(curve.breaks, coefficients))
    rows_of_tool = dataclasses.replace(RIGHT, trajectory=moved)
    assert rows_of_tool.deviation[0].max() < 1e-7
    beside, turned = check_tool(rows_of_tool)
    for found, kind, value in (
        (beside, "tool_path", 3e-6),
        (turned, "tool_orientation", 3e-6 / radius),
    ):
        assert (found.kind, found.method, found.limit) == (kind, "bounded", 1e-6)
        assert found.value == pytest.approx(value, rel=0.02)
        assert curve.breaks[piece] <= found.time <= curve.breaks[piece + 1]


def test_what_is_judged_on_rows_alone_is_named():
    """No determinant tells branches apart where a turn is free, and the angle of a yaw has no majorant."""
    motion = RIGHT.motion
    free, yaw = (dataclasses.replace(motion.path, orientation=which) for which in ("direction", "yaw"))
    freely = motion_along(free, motion.law, motion.breaks, motion.tolerance)
    assert list(RIGHT.sampled) == ["branch"]
    assert list(dataclasses.replace(RIGHT, motion=freely).sampled) == []
    by_yaw = dataclasses.replace(RIGHT, motion=dataclasses.replace(motion, path=yaw))
    assert list(by_yaw.sampled) == ["angle from its orientation", "branch"]
