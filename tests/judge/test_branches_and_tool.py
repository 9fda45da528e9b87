"""Tool of recorded motions: branch flips, deviation, singularities, limits, each beside its clean twin."""

from __future__ import annotations

from dataclasses import replace
from functools import cache, partial
from pathlib import Path

import numpy as np
import pytest
from line_of_ur5e import JOB, plan
from recorded_rows import part
from tiers import few

import trajcli
from trajcli.api.plans import PlannedJob
from trajcli.findings import Finding
from trajcli.judge import tool_path
from trajcli.judge.file import CheckOptions, check_file
from trajcli.judge.judgement import Judgement
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.judge.recorded_tool import ToolJudge
from trajcli.kinematics.robot import ToolLimits, unlimited
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

PERIOD = 4e-3


def recorded(decimals: int = 9) -> RecordedMotion:
    rows = plan().trajectory.sample(1 / PERIOD)
    off = np.full(6, 0.5 * 10.0**-decimals)
    states = [np.round(values, decimals) for values in (rows.q, rows.qd, rows.qdd)]
    resolution = Resolution(0.5e-9, off, off, off)
    return RecordedMotion(
        np.round(rows.t, 9), *states, None, None, np.zeros(len(rows), int), None, resolution, "rows"
    )


def judged_rows(motion: RecordedMotion, *, by_job: bool = True, **limits: float) -> Judgement:
    robot = plan().moves[0].robot
    robot = replace(robot, limits=replace(robot.limits, tcp=ToolLimits(**limits)))
    paths = {0: plan().moves[0].planned.tool} if by_job else None
    required = Requirements(robot, tool=lambda: ToolJudge(robot, paths))
    blocks = [part(motion, slice(low, low + 300)) for low in range(0, len(motion.t), 300)]
    return judge_motion(lambda: blocks, required)


def only(judgement: Judgement, kind: str) -> object:
    (found,) = [each for each in judgement.findings if each.kind == kind]
    return found


@pytest.mark.parametrize("by_job", [True, False])
def test_the_line_as_it_was_planned_is_satisfied(by_job: bool) -> None:
    judgement = judged_rows(recorded(), by_job=by_job)
    assert judgement.verdict == "satisfied", judgement.findings
    assert judgement.findings == ()


@pytest.mark.parametrize("by_job", [True, False])
def test_a_branch_flip_is_found(by_job: bool) -> None:
    """From row 201 on the wrist stands the other way round: the tool goes on as if nothing were."""
    motion, arm = part(recorded(), slice(0, 225)), trajcli.load_robot("ur5e")
    q = motion.q.copy()
    for row in range(200, len(q)):
        answers = arm.ik(arm.fk(q[row]), near=q[row])
        other = next(answer for answer in answers if answer.branch["wrist"] != answers[0].branch["wrist"])
        q[row] = other.joints
    assert np.abs(arm.fk(q[200]) - arm.fk(motion.q[200])).max() < 1e-8
    flipped = replace(motion, q=np.round(q, 9), qd=None, qdd=None)
    judgement = judged_rows(flipped, by_job=by_job)
    found = [each for each in judgement.findings if each.kind == "branch"]
    assert judgement.verdict == "exceeded"
    assert {each.row for each in found} & {200, 201}
    assert all(abs(each.time - 200 * PERIOD) <= 1.01 * PERIOD for each in found)
    assert not [each for each in judgement.errors if each.kind == "deviation"]


def test_a_tool_beside_its_line_is_found_by_how_much() -> None:
    """A millimetre to the side in row 251, by the Jacobian."""
    motion, arm = recorded(), trajcli.load_robot("ur5e")
    along = np.array([0.45, 0.25, 0.35]) - arm.fk(motion.q[0])[:3, 3]
    aside = np.cross(along, [0, 0, 1.0])
    aside *= 1e-3 / np.linalg.norm(aside)
    q = motion.q.copy()
    q[250] += np.linalg.solve(arm.jacobian(q[250]), np.append(aside, np.zeros(3)))
    judgement = judged_rows(replace(motion, q=q, qd=None, qdd=None))
    found = only(judgement, "deviation")
    assert found.value == pytest.approx(1e-3, rel=1e-2)
    assert (found.row, found.move, found.quantity, found.limit) == (251, 0, "position", 1e-6)


def test_a_turned_tool_is_found_by_how_much() -> None:
    motion = recorded()
    q = motion.q.copy()
    q[:, 5] += 2e-3
    found = only(judged_rows(replace(motion, q=q)), "deviation")
    assert found.value == pytest.approx(2e-3, rel=1e-3)
    assert found.quantity == "orientation"


def test_rounding_of_rows_is_no_deviation() -> None:
    """Five decimals leave some 10 um at the tool."""
    judgement = judged_rows(replace(recorded(5), qd=None, qdd=None))
    found = [each for each in judgement.findings if each.kind == "deviation"]
    assert found
    assert {each.certainty for each in found} == {"within rounding"}


def test_the_speed_of_the_tool_is_that_of_its_law() -> None:
    """A quintic law of 2 s along the line: the peak is 15/8 of the mean speed."""
    motion, arm = recorded(), trajcli.load_robot("ur5e")
    length = np.linalg.norm(np.array([0.45, 0.25, 0.35]) - arm.fk(motion.q[0])[:3, 3])
    peak = 15 / 8 * length / 2
    judged = partial(judged_rows, motion, by_job=False)
    found = only(judged(speed=peak * 0.9999), "tool_speed")
    assert found.value == pytest.approx(peak, rel=1e-5)
    assert found.time == pytest.approx(1.0, abs=0.02)
    assert judged(speed=peak * 1.0001).verdict == "satisfied"
    acceleration = 10 / np.sqrt(3) * length / 4
    found = only(judged(acceleration=acceleration * 0.999), "tool_acceleration")
    assert found.value == pytest.approx(acceleration, rel=1e-3)
    assert judged(acceleration=acceleration * 1.001).verdict == "satisfied"


@pytest.mark.parametrize("by_job", [True, False])
def test_nearness_to_a_singularity_is_a_warning(by_job: bool) -> None:
    """The wrist of the arm is straight where joint 5 is zero; beside the path of a move this is told, too."""
    count = 500
    q = np.tile([0.2, -1.2, 1.6, -1.0, 0.0, 0.4], (count, 1))
    q[:, 4] = np.linspace(-0.5, 0.5001, count)
    nothing = np.zeros(6)
    exact = Resolution(0.0, nothing, nothing, nothing)
    moves = np.zeros(count, int) if by_job else None
    motion = RecordedMotion(np.arange(count) * 0.01, q, None, None, None, None, moves, None, exact, "rows")
    judgement = judged_rows(motion, by_job=by_job)
    found = only(judgement, "singularity")
    assert judgement.verdict == ("exceeded" if by_job else "satisfied")  # it is beside that path
    assert found.severity == "warning"
    assert abs(found.time - 2.5) < 0.3


@pytest.mark.parametrize("orders", [1, 2, 3])
def test_a_tool_at_its_limits_is_no_false_alarm(orders: int) -> None:
    """A trapezoid along the line at the limits of the tool, as rows of 250 Hz of any columns."""
    job = {**JOB, "limits": {"acceleration": 20.0, "tcp": {"speed": 0.12, "acceleration": 0.5}}}
    job["moves"] = [{"planner": "line", "to": {"xyz": [0.45, 0.25, 0.35]}}]
    at_limits = trajcli.plan(job)
    rows = at_limits.trajectory.sample(250)
    off = np.full(6, 0.5e-9)
    states = [np.round(values, 9) for values in (rows.q, rows.qd, rows.qdd)[:orders]] + [None] * (3 - orders)
    resolution = Resolution(0.5e-9, off, off, off)
    motion = RecordedMotion(
        np.round(rows.t, 9), *states, None, None, np.zeros(len(rows), int), None, resolution, "rows"
    )
    robot = at_limits.moves[0].robot
    required = Requirements(robot, tool=lambda: ToolJudge(robot, {0: at_limits.moves[0].planned.tool}))
    judgement = judge_motion(lambda: (motion,), required)
    assert judgement.passed, [found.text() for found in judgement.findings]
    tight = replace(robot, limits=replace(robot.limits, tcp=ToolLimits(speed=0.1199)))
    assert not judge_motion(lambda: (motion,), Requirements(tight, tool=lambda: ToolJudge(tight, {}))).passed


@pytest.mark.parametrize("start", [0.0, 1e8])
def test_a_tool_at_its_limit_is_there_by_stamps_of_years_too(start: float) -> None:
    """Stamps at 1e8 s are coarse, 1.5e-8 s: in that time this jerk, 1000 rad/s^3, adds more than a millionth."""
    t, jerk = np.arange(9) * 0.005, np.array([1000.0] * 2 + [0.0] * 4 + [-1000.0] * 2)
    states = [np.zeros(9) for _ in range(3)]
    for k, j in enumerate(jerk):
        q, v, a = (values[k] for values in states)
        h = 0.005
        new = q + v * h + a * h**2 / 2 + j * h**3 / 6, v + a * h + j * h**2 / 2, a + j * h
        for values, value in zip(states, new, strict=True):
            values[k + 1] = value
    still = np.array([0.0, -1.2, 1.3, -0.4, 0.7, 0.2])
    rows = [np.where(np.arange(6) == 0, values[:, None], 0.0) for values in states]
    nothing = np.zeros(6)
    exact = Resolution(0.0, nothing, nothing, nothing)
    motion = RecordedMotion(
        t + start, rows[0] + still, rows[1], rows[2], None, None, None, None, exact, "rows"
    )
    robot = plan().moves[0].robot
    for share, verdict in ((1.0, "satisfied"), (1.0 - 3e-6, "exceeded")):
        tcp = ToolLimits(angular_acceleration=10.0 * share)
        judged_by = replace(robot, limits=replace(robot.limits, tcp=tcp))
        required = Requirements(judged_by, interpolate="quintic", tool=lambda own=judged_by: ToolJudge(own))
        judgement = judge_motion(lambda: [motion], required)
        assert judgement.verdict == verdict, judgement


@pytest.mark.parametrize("speed", [1.0, 1e-4])
def test_a_tool_that_turns_slowly_is_no_faster_in_its_rows_than_they_say(speed: float) -> None:
    """Up to its limit in 10.5 periods: the cubics swing over it in the eleventh alone, rows of 1 kHz keep it.

    A turn of 1e-7 rad from row to row has no digits in the cosine.
    """
    t, ramp = np.arange(41) * 1e-3, 0.0105
    q, qd = np.tile([0.0, -1.2, 1.3, -0.4, 0.7, 0.2], (41, 1)), np.zeros((41, 6))
    reached = np.minimum(t, ramp)
    q[:, 0], qd[:, 0] = speed * (0.5 * reached**2 / ramp + t - reached), speed * reached / ramp
    nothing = np.zeros(6)
    exact = Resolution(0.0, nothing, nothing, nothing)
    motion = RecordedMotion(t, q, qd, None, None, None, None, None, exact, "rows")
    robot = plan().moves[0].robot
    robot = replace(robot, limits=replace(unlimited(6), tcp=ToolLimits(angular_speed=speed)))
    judgement = judge_motion(lambda: [motion], Requirements(robot, tool=lambda: ToolJudge(robot)))
    found = only(judgement, "tool_angular_speed")
    assert (found.severity, judgement.verdict) == ("warning", "satisfied")
    assert found.value == pytest.approx(1.00198 * speed, rel=1e-4)


@pytest.mark.parametrize("backward", [False, True])
def test_a_peak_where_two_pieces_meet_is_as_uncertain_as_the_piece_that_has_it(*, backward: bool) -> None:
    """A second of t^3, up to 6 rad/s^2, beside a millisecond without acceleration, whose rows tell it to 12 rad/s^2."""
    t, q1, qd1 = np.array([[0.0, 1.0, 1.001], [0.0, 1.0, 1.003], [0.0, 3.0, 3.0]])
    if backward:
        t, q1, qd1 = 1.001 - t[::-1], q1[::-1], -qd1[::-1]
    q, qd = np.tile([0.0, -1.2, 1.3, -0.4, 0.7, 0.2], (3, 1)), np.zeros((3, 6))
    q[:, 0], qd[:, 0] = q1, qd1
    off = np.full(6, 1e-6)
    motion = RecordedMotion(
        t, q, qd, None, None, None, None, None, Resolution(0.0, off, 0 * off, off), "rows"
    )
    robot = plan().moves[0].robot
    robot = replace(robot, limits=replace(unlimited(6), tcp=ToolLimits(angular_acceleration=5.9)))
    judgement = judge_motion(lambda: [motion], Requirements(robot, tool=lambda: ToolJudge(robot)))
    found = only(judgement, "tool_angular_acceleration")
    assert (found.value, found.certainty) == (pytest.approx(6.0, rel=1e-5), "exceeded")
    assert found.rounding < 1e-3


@cache
def planar_line() -> PlannedJob:
    path = {"xyz": [0.35, 0.25, 0.0], "yaw": 1.5, "tool_axis": "x"}
    line = {"planner": "line", "to": path, "law": {"shape": "quintic", "duration": 1}}
    return trajcli.plan(
        {"version": 1, "robot": "planar3r", "start": {"joints": [-0.2, 1.0, 0.3]}, "moves": [line]}
    )


def changes_of_branch(elbow: np.ndarray, size: int) -> list[tuple[int | None, float | None, int]]:
    """Return rows, times and counts of changes found of a planar arm that is straight where its elbow is at zero.

    There the rows of its Jacobian across x are exactly zero.
    """
    job = planar_line()
    q = np.stack([0 * elbow, elbow, 0 * elbow], axis=1)
    off = np.full(3, 0.5e-9)
    resolution, moves = Resolution(0.5e-9, off, off, off), np.zeros(len(q), int)
    rows = RecordedMotion(
        np.arange(len(q)) / 50.0, q, None, None, None, None, moves, None, resolution, "rows"
    )
    robot = job.moves[0].robot
    required = Requirements(robot, tool=lambda: ToolJudge(robot, {0: job.moves[0].planned.tool}))
    blocks = [part(rows, slice(low, low + size)) for low in range(0, len(q), size)]
    found = judge_motion(lambda: blocks, required).findings
    return [(each.row, each.time, each.count) for each in found if each.kind == "branch"]


@pytest.mark.parametrize("size", [41, 22, 21, 20, 10, 1])
@pytest.mark.parametrize("half", [1, -1])
def test_a_determinant_of_zero_on_a_row_hides_no_change_of_branch(half: int, size: int) -> None:
    """However rows come in blocks: it is in one row, and in the middle between two."""
    elbow = np.arange(20, -21, -1) / 100.0
    found = changes_of_branch(np.where(elbow < 0, half * elbow, elbow), size)
    assert found == ([(22, pytest.approx(21 / 50), 2)] if half == 1 else [])


@pytest.mark.parametrize(("first", "at"), [(1.0, 64), (-1.0, 64), (1.0, 65), (1.0, 127)])
def test_a_change_of_branch_at_the_end_of_rows_that_are_judged_together_is_found(
    first: float, at: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Here 64 are; the row before it is straight, and the branch at first may be another one."""
    monkeypatch.setattr(tool_path, "_ROWS", 64)
    elbow = np.where(np.arange(140) < 20, first, 1.0) * np.where(np.arange(140) < at, 0.1, -0.1)
    elbow[at - 1] = 0.0
    ((row, time, count),) = changes_of_branch(elbow, 3000)
    place = at if first > 0 else 20
    assert count == (2 if first > 0 else 4)
    assert (row, time) in [(place, pytest.approx((place - 0.5) / 50)), (place + 1, pytest.approx(place / 50))]


@pytest.mark.parametrize("size", [60, 15, 7])
def test_changes_of_branch_are_counted_from_the_first_one(size: int) -> None:
    """There are four, in rows and between them; a file that begins straight begins on no branch."""
    signs = np.where((np.arange(60) // 15) % 2 == 0, 1.0, -1.0)
    elbow = 0.1 * np.roll(signs, -6) * np.where(np.arange(60) < 3, 0.0, 1.0)
    assert changes_of_branch(elbow, size) == [(10, pytest.approx(9 / 50), 8)]


SQUARE = {
    "version": 1,
    "robot": "ur5e",
    "limits": {"acceleration": 20.0, "tcp": {"speed": 0.25, "acceleration": 2.0}},
    "start": {"xyz": [0.4, 0.1, 0.25], "rpy": [np.pi, 0, 0]},
    "moves": [
        {
            "planner": "path",
            "corner": "stop",
            "segments": [
                {"line": {"xyz": [*corner, 0.25]}}
                for corner in ([0.5, 0.1], [0.5, 0.2], [0.4, 0.2], [0.4, 0.1])
            ],
        }
    ],
}


def test_a_path_that_ends_where_it_starts_is_followed_from_place_to_place() -> None:
    """Each row is on the side of the square on which it is driven; a step to the side is found by how much."""
    made, arm, rate = trajcli.plan(SQUARE), trajcli.load_robot("ur5e"), 125
    rows = made.trajectory.sample(rate)
    paths = {0: made.moves[0].planned.tool}
    off = np.full(6, 0.5e-9)
    resolution, moves = Resolution(0.5e-9, off, off, off), np.zeros(len(rows), int)
    required = Requirements(made.moves[0].robot, tool=lambda: ToolJudge(made.moves[0].robot, paths))

    def deviations(q: np.ndarray) -> list[tuple[int | None, float | None]]:
        motion = RecordedMotion(
            rows.t + 3.0, np.round(q, 9), None, None, None, None, moves, None, resolution, "rows"
        )
        found = judge_motion(lambda: [motion], required).errors
        return [(each.row, each.value) for each in found if each.kind == "deviation"]

    assert deviations(rows.q) == []
    q, row = rows.q.copy(), len(rows) - 3
    q[row] += np.linalg.solve(arm.jacobian(q[row]), [2e-4, 0.0, 0.0, 0.0, 0.0, 0.0])
    assert deviations(q) == [(row + 1, pytest.approx(2e-4, rel=1e-2))]


@pytest.mark.parametrize("back", [[0.4, 0.1, 0.25], [0.42, 0.13, 0.25]])
def test_a_path_that_turns_back_is_followed_around_its_corner(back: list[float]) -> None:
    """Beside a sharp corner both sides are as near; the way back is told from the way there by the turned tool."""
    segments = [{"line": {"xyz": [0.5, 0.1, 0.25]}}, {"line": {"xyz": back, "rpy": [np.pi, 0.4, 0]}}]
    move = {**SQUARE["moves"][0], "segments": segments, "law": {"shape": "quintic"}}
    limits = {"tcp": {"speed": 0.25, "acceleration": 1.0, "angular_speed": 1.0}}
    made, rate = trajcli.plan({**SQUARE, "limits": limits, "moves": [move]}), 250
    robot, rows = made.moves[0].robot, made.trajectory.sample(rate)
    paths, off = {0: made.moves[0].planned.tool}, np.full(6, 0.5e-9)
    required = Requirements(robot, tool=lambda: ToolJudge(robot, paths))

    def deviations(q: np.ndarray, qd: np.ndarray) -> list[float | None]:
        resolution, moves = Resolution(0.5e-9, off, off, off), np.zeros(len(q), int)
        motion = RecordedMotion(rows.t, q, qd, rows.qdd, None, None, moves, None, resolution, "rows")
        found = judge_motion(lambda: [motion], required).findings
        return [each.value for each in found if each.kind == "deviation"]

    assert deviations(rows.q, rows.qd) == []
    q, row = rows.q.copy(), len(rows) // 2 + 10  # behind the corner: a fault there is on neither side
    q[row] += np.linalg.solve(trajcli.load_robot("ur5e").jacobian(q[row]), [0.0, 0.0, 3e-5, 0.0, 0.0, 0.0])
    assert max(value or 0.0 for value in deviations(q, rows.qd)) == pytest.approx(3e-5, rel=0.05)


@cache
def to_and_fro(way: float, turn: float, passes: int) -> PlannedJob:
    """Return a tool that goes along x, and then to and fro on a short way; it turns about z all the time."""
    ends = [(0.5 + way * (k % 2), turn * k) for k in range(passes + 1)]
    segments = [{"line": {"xyz": [x, 0.1, 0.25], "rpy": [np.pi, 0, angle]}} for x, angle in ends]
    limits = {"tcp": {"speed": 0.25, "acceleration": 1, "angular_speed": 2, "angular_acceleration": 50}}
    return trajcli.plan({**SQUARE, "limits": limits, "moves": [{**SQUARE["moves"][0], "segments": segments}]})


@pytest.mark.parametrize("rate", few([8, 20, 125], 2))
def test_a_tool_that_goes_to_and_fro_is_known_by_how_it_is_turned(rate: int) -> None:
    """It passes each place eight times, another way round: rows right beside a corner are on one side of it alone.

    From one row to the next it gets no further than one millimetre, past none of the corners or past several.
    """
    made = to_and_fro(5e-4, 0.02, 8)
    robot, rows, off = made.moves[0].robot, made.trajectory.sample(rate), np.full(6, 0.5e-9)
    paths, resolution = {0: made.moves[0].planned.tool}, Resolution(0.5e-9, off, off, off)
    moves = np.zeros(len(rows), int)
    required = Requirements(robot, interpolate="hold", tool=lambda: ToolJudge(robot, paths))

    def deviations(q: np.ndarray) -> list[tuple[int | None, float | None, str | None]]:
        values = np.round(q, 9), None, None, None, None, moves, None, resolution, "rows"
        found = judge_motion(lambda: [RecordedMotion(rows.t, *values)], required).findings
        return [(each.row, each.value, each.quantity) for each in found if each.kind == "deviation"]

    assert deviations(rows.q) == []
    x = trajcli.load_robot("ur5e").fk(rows.q)[:, 0, 3] - 0.5
    inside = np.flatnonzero(
        (x > 2.2e-4) & (x < 2.8e-4)
    )  # in the middle of the way: 5e-3 rad from other passes
    for row in inside[[0, -1]] if rate > 100 else ():
        q = rows.q.copy()
        q[row, 5] += 3e-5
        assert deviations(q) == [(row + 1, pytest.approx(3e-5, rel=0.1), "orientation")]


@pytest.mark.parametrize("rate", [30, 60])
def test_between_rows_a_tool_that_goes_to_and_fro_is_on_the_pass_of_its_time(rate: int) -> None:
    """Curves between rows cut the corners, by a thirtieth of the turn of one pass at most; another pass is a whole one off."""
    made = to_and_fro(5e-4, 0.02, 8)
    robot, rows, off = made.moves[0].robot, made.trajectory.sample(rate), np.full(6, 0.5e-12)
    paths, resolution = {0: made.moves[0].planned.tool}, Resolution(0.5e-9, off, off, off)
    required = Requirements(robot, tool=lambda: ToolJudge(robot, paths))
    values = rows.q, rows.qd, rows.qdd, None, None, np.zeros(len(rows), int), None, resolution, "rows"
    found = judge_motion(lambda: [RecordedMotion(rows.t, *values)], required).findings
    turned = [
        each.value or 0.0 for each in found if (each.kind, each.quantity) == ("deviation", "orientation")
    ]
    assert 0 < max(turned) < 0.02 / 30


@pytest.mark.parametrize("axis", [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.6, 0.0, -0.8]])
def test_a_tool_that_turns_in_its_place_is_turned_from_its_path_by_how_much(axis: list[float]) -> None:
    """About a fixed axis by 0.6 rad: all rows of the plan are on it, but for one that turns about another axis."""
    about = np.sin(0.3) * np.array(axis)  # times the quaternion of its start, of half a turn about x
    end = {"xyz": [0.4, 0.1, 0.25], "quat_wxyz": [-about[0], np.cos(0.3), about[2], -about[1]]}
    limits = {"tcp": {"angular_speed": 1.0, "angular_acceleration": 4.0}}
    made = trajcli.plan({**SQUARE, "limits": limits, "moves": [{"planner": "line", "to": end}]})
    rows, robot, off = made.trajectory.sample(250), made.moves[0].robot, np.full(6, 0.5e-12)
    paths, resolution = {0: made.moves[0].planned.tool}, Resolution(0.5e-9, off, off, off)
    moves = np.zeros(len(rows), int)
    required = Requirements(robot, interpolate="hold", tool=lambda: ToolJudge(robot, paths))

    def deviations(q: np.ndarray) -> list[Finding]:
        motion = RecordedMotion(rows.t, q, None, None, None, None, moves, None, resolution, "rows")
        found = judge_motion(lambda: [motion], required).findings
        return [each for each in found if each.kind == "deviation"]

    assert deviations(rows.q) == []
    q, aside = (
        rows.q.copy(),
        1e-4 * np.cross(axis, [0.0, 0.6, 0.8]) / np.linalg.norm(np.cross(axis, [0.0, 0.6, 0.8])),
    )
    q[60] += np.linalg.solve(trajcli.load_robot("ur5e").jacobian(q[60]), [0.0, 0.0, 0.0, *aside])
    (found,) = deviations(q)
    assert (found.row, found.quantity, found.value) == (61, "orientation", pytest.approx(1e-4, rel=1e-3))
    assert found.text().endswith("promised are 1e-06 rad")


HALF_CIRCLE = """
version: 1
robot: {file: GANTRY}
start: {joints: [0, 0.5, 1]}
moves: [{planner: arc, center: [0, 0, 1], axis: [-1, 0, 0], angle: 3.141592653589793, law: {duration: 2, speed: 1}}]
output: {rate: 20, columns: [t, q, move]}
"""


def test_straight_lines_between_rows_leave_an_arc_by_the_height_of_their_chords(tmp_path: Path) -> None:
    """Slides move the tool itself, so that a chord of the angle d is r (1 - cos(d / 2)) inside of the arc."""
    gantry = Path(__file__).parents[2] / "examples" / "robots" / "gantry.yaml"
    job, whole, half = tmp_path / "job.yaml", tmp_path / "whole.csv", tmp_path / "half.csv"
    job.write_text(HALF_CIRCLE.replace("GANTRY", str(gantry)), "utf-8")
    made, options = trajcli.plan(str(job)), CheckOptions(job=str(job))
    made.save(str(whole))
    names, *lines = whole.read_text("utf-8").splitlines(keepends=True)
    half.write_text("".join([names, *lines[:2], *lines[2::2]]), "utf-8")
    heights = 0.5 * (1 - np.cos(np.array([0.05, 0.1]) / 0.5 / 2))

    judgement = check_file(str(whole), options).judgement
    assert (judgement.verdict, judgement.planned_rows) == ("satisfied", True)
    found = only(judgement, "deviation")
    assert (found.severity, found.value) == ("warning", pytest.approx(heights[0], abs=2e-6))
    (joined,) = [each.message for each in made.report().events if each.kind == "joined_over_limit"]
    for said in (*judgement.events, joined.partition(";")[0]):
        assert float(said.rsplit(" ", 1)[-1]) == pytest.approx(heights[0] / 1e-6, rel=0.01)

    judgement = check_file(str(half), options).judgement
    assert (judgement.verdict, judgement.planned_rows) == ("exceeded", False)
    assert only(judgement, "deviation").value == pytest.approx(heights[1], abs=2e-6)
