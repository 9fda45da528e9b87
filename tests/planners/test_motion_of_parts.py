"""Parts of motions that fly by: lines between states, joints through zones, what hardly moves, and what is judged."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from planners.test_chains_within_limits import POINTS, WAYS, arm, line, zone_at
from ruckig import InputParameter, Result, Ruckig, Trajectory
from tiers import few

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.errors import PlanningError
from trajcli.kinematics.robot import Payload
from trajcli.planners.course import JointCourse
from trajcli.planners.flying_by import flown_parts as parts_module
from trajcli.planners.flying_by.between_stops import FlyByChain, chain_of
from trajcli.planners.flying_by.chain_parts import row_of
from trajcli.planners.flying_by.flown_parts import (
    CourseLaws,
    FlownPart,
    NoLawError,
    findings_of,
    flown_parts,
    joint_uses,
    move_part,
    state_at,
    zone_motion,
)
from trajcli.planners.flying_by.motion_search import with_shares


def ruckig_of(first: np.ndarray, last: np.ndarray, bounds: np.ndarray) -> Trajectory:
    """Return ruckig's motion between states (n, 3) within bounds (n, 6)."""
    count = len(first)
    asked, found = InputParameter(count), Trajectory(count)
    asked.current_position, asked.current_velocity, asked.current_acceleration = first.T.tolist()
    asked.target_position, asked.target_velocity, asked.target_acceleration = last.T.tolist()
    asked.min_velocity, asked.max_velocity = bounds[:, :2].T.tolist()
    asked.min_acceleration, asked.max_acceleration = bounds[:, 2:4].T.tolist()
    asked.max_jerk = bounds[:, 5].tolist()
    assert Ruckig(count).calculate(asked, found) == Result.Working
    return found


def corner(**bounds: Any) -> FlyByChain:
    """Return two lines with a zone between them."""
    robot = arm(**bounds)
    courses = [line(POINTS[0], WAYS[0], robot, 2.0), line(POINTS[1], WAYS[3], robot)]
    rest = np.zeros(2)
    return chain_of(courses, [zone_at(POINTS[1], robot)], (rest, rest), [1.0])


BY_DIRECTION = {
    "velocity": [[-3, 2.0], [-1, 2.5]],
    "acceleration": [[-8, 7.0], [-6, 9.0]],
    "jerk": [[-60, 60.0]] * 2,
}
STATES = np.array([[0.9, -1.0], [0.7, 2.0]])  # of the courses at the borders


@pytest.mark.parametrize("bounds", [{}, BY_DIRECTION])
def test_all_joints_go_through_a_zone_together_as_fast_as_ruckig(bounds: dict[str, Any]) -> None:
    chain = corner(**bounds)
    motion = zone_motion(chain, 0, STATES)
    ends = []
    for course, s, (speed, change) in zip(
        chain.courses, (chain.corners[0].left, chain.corners[0].joined), STATES, strict=True
    ):
        way = course.curve.evaluate(0.0, 1)
        ends.append(np.stack([course.curve.evaluate(s), speed * way, change * way], axis=1))
    limits = chain.corners[0].limits
    jerk = limits.jerk[:, 1:]
    rows = np.concatenate([limits.velocity, limits.acceleration, -jerk, jerk], axis=1)
    assert motion.curve.duration == pytest.approx(ruckig_of(*ends, rows).duration, rel=1e-9)
    assert (motion.tool, motion.law) == (None, None)
    for time, rows in ((0.0, ends[0]), (motion.curve.end, ends[1])):
        for order in range(3):
            np.testing.assert_allclose(motion.curve.evaluate(time, order), rows[:, order], atol=1e-9)


def test_of_a_bent_path_a_zone_begins_with_what_its_bend_asks_for() -> None:
    chain = corner()
    bend = np.array([0.2, -0.3])
    rows = np.stack([bend / 2, WAYS[0] - bend / 2, POINTS[0]])[:, None, :]
    curved = JointCourse(PiecewisePolynomial(np.array([0.0, 1.0]), rows), arm())
    (zone,) = chain.corners
    chain = replace(chain, courses=(curved, chain.courses[1]), corners=(replace(zone, left=0.9),))
    motion = zone_motion(chain, 0, STATES)
    path = WAYS[0] - bend / 2 + 0.9 * bend
    np.testing.assert_allclose(motion.curve.evaluate(0.0, 1), 0.9 * path, atol=1e-12)
    np.testing.assert_allclose(motion.curve.evaluate(0.0, 2), 0.81 * bend - path, atol=1e-9)


def through(first: list[list[float]], last: list[list[float]], bounds: np.ndarray) -> PiecewisePolynomial:
    ends = np.array(first, dtype=float), np.array(last, dtype=float)
    return parts_module._through(ends, bounds, [f"j{k + 1}" for k in range(len(bounds))]).curve


WIDE = np.array([[-3.0, 3.0, -8.0, 8.0, -60.0, 60.0]])
LITTLE = 1e-6  # of a limit


@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize(
    ("state", "stays"),
    [
        ([0.0, 0.0, 0.0, 0.0, 0.0], True),
        ([0.9 * LITTLE * 9 / 8, 0.9 * LITTLE * 3, 0.0, 0.9 * LITTLE * 3, 0.9 * LITTLE * 8], True),
        ([-0.9 * LITTLE * 9 / 8, -0.9 * LITTLE * 3, -0.9 * LITTLE * 8, 0.0, 0.0], True),
        ([1.5 * LITTLE * 9 / 8, 0.0, 0.0, 0.0, 0.0], False),
        ([-1.5 * LITTLE * 9 / 8, 0.0, 0.0, 0.0, 0.0], False),
        ([0.0, 1.5 * LITTLE * 3, 0.0, 0.0, 0.0], False),
        ([0.0, 0.0, 0.0, -1.5 * LITTLE * 3, 0.0], False),
        ([0.0, 0.0, 1.5 * LITTLE * 8, 0.0, 0.0], False),
        ([0.0, 0.0, 0.0, 0.0, -90.0 * LITTLE * 8], False),
    ],
)
def test_a_joint_that_hardly_moves_follows_a_quintic_as_long_as_the_others(
    state: list[float], joint: int, *, stays: bool
) -> None:
    """What rounding alone may move: a millionth of velocity, acceleration, or of the distance v^2 / a."""
    step, *rates = state
    rows = [([0.1, *rates[:2]], [0.1 + step, *rates[2:]]), ([0.2, 0.5, 0.0], [0.6, 0.3, 1.0])]
    rows = rows[::-1] if joint else rows
    curve = through([row[0] for row in rows], [row[1] for row in rows], np.tile(WIDE, (2, 1)))
    for time, side in ((0.0, 0), (curve.end, 1)):
        found = np.stack([curve.evaluate(time, order) for order in range(3)], axis=1)
        np.testing.assert_allclose(found, [row[side] for row in rows], atol=1e-9)
    alone = ruckig_of(np.array([rows[1 - joint][0]]), np.array([rows[1 - joint][1]]), WIDE).duration
    if not stays:
        assert not curve.degree > 3 or np.abs(curve.coefficients[:-4]).max() < 1e-12
        return
    assert curve.duration == pytest.approx(alone, rel=1e-9)
    assert np.abs(curve.evaluate(0.5 * curve.end, 4)[1 - joint]) < 1e-9
    times = np.linspace(0.0, curve.end, 101)[1:-1]
    x, ends = times / curve.end, np.array(rows[joint]) * curve.end ** np.arange(3)
    quintic = np.linalg.solve(  # of Lagrange: position, velocity, acceleration at both ends
        [[k == j for k in range(6)] if j < 2 else [2.0 * (k == 2) for k in range(6)] for j in range(3)]
        + [[1.0] * 6, [*map(float, range(6))], [k * (k - 1.0) for k in range(6)]],
        ends.reshape(-1),
    )
    want = np.polynomial.polynomial.polyval(x, quintic)
    np.testing.assert_allclose(curve.evaluate(times)[:, joint], want, atol=1e-12)


def test_where_all_joints_hardly_move_they_are_as_fast_as_ruckig() -> None:
    ends = np.array([[[0.0, 0.0, 0.0]] * 2, [[1e-7, 0.0, 0.0], [5e-8, 0.0, 0.0]]])
    curve = through(*ends.tolist(), np.tile(WIDE, (2, 1)))
    assert curve.duration == pytest.approx(4 * (1e-7 / 2 / 60) ** (1 / 3), rel=1e-9)  # of jerk alone


@pytest.mark.parametrize(
    ("bounds", "factor"),
    [
        ([-3, 3, -8, 8, -900.0, 900.0], 1.0),
        ([-3, 0.6, -8, 8, -900.0, 900.0], 4.0),
        ([-3, 3, -8, 2.0, -900.0, 900.0], 2.0),
        ([-3, 3, -2.0, 8, -900.0, 900.0], 2.0),
        ([-3, 3, -8, 8, -900.0, 7.0], 4.0),
        ([-3, 3, -8, 8, -3.5, 900.0], 4.0),
        ([-3, 1e-9, -8, 8, -900.0, 900.0], None),
    ],
)
@pytest.mark.parametrize("joint", [0, 1])
def test_where_joints_find_no_common_duration_quintics_take_as_long_as_their_limits_ask_for(
    bounds: list[float], factor: float | None, joint: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """From rest to rest over d in T: 15 d / 8 T, 10 d / sqrt(3) T^2, 60 d / T^3 at its ends, -30 between."""

    def refuse(*given: Any) -> None:
        raise PlanningError("no common duration")

    monkeypatch.setattr(parts_module, "together", refuse)
    monkeypatch.setattr(
        parts_module,
        "fastest",
        lambda problem: SimpleNamespace(duration=1.0 if problem.name == "j1" else 0.7),
    )
    first = np.zeros((2, 3))
    last = first.copy()
    last[joint, 0] = 1.0
    last[1 - joint, 0] = 1e-3
    rows = np.tile([[-3, 3, -8, 8, -900.0, 900.0]], (2, 1))
    rows[joint] = bounds
    if factor is None:
        with pytest.raises(PlanningError, match="no common duration"):
            through(first.tolist(), last.tolist(), rows)
        return
    curve = through(first.tolist(), last.tolist(), rows)
    assert curve.duration == pytest.approx(factor)
    peaks = [
        15 / 8 / factor,
        10 / np.sqrt(3) / factor**2,
        10 / np.sqrt(3) / factor**2,
        60 / factor**3,
        30 / factor**3,
    ]
    assert (peaks <= np.array(bounds)[[1, 3, 2, 5, 4]] * [1, 1, -1, 1, -1]).all()
    assert curve.evaluate(curve.end / 2, 1)[joint] == pytest.approx(peaks[0])


def test_of_a_joint_without_a_fastest_motion_its_change_of_velocity_at_its_acceleration_counts(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def refuse(*given: Any) -> None:
        raise PlanningError("no motion")

    monkeypatch.setattr(parts_module, "fastest", refuse)
    problem = parts_module.BoundaryProblem("j1", (0.0, 0.5, -0.2), (0.1, 0.1, 4.0), WIDE.reshape(3, 2))
    assert parts_module._least_duration(problem) == pytest.approx(2.0)
    assert parts_module._least_duration(replace(problem, initial=(0.0, 0.5, 0.0))) == 0.0
    assert parts_module._least_duration(replace(problem, initial=(0.0, 0.5, 1e-300))) == 1e9


def test_errors_of_all_courses_come_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Those that had no law before are asked first, all of them; what is given is asked for nothing."""
    chain = corner()
    row = row_of(chain, [1.0, 1.0], [1.0, 1.0], {})
    laws, asked = CourseLaws(), list[int]()

    def refuse(course: Any, index: int, *given: Any) -> FlownPart:
        asked.append(index)
        raise NoLawError(f"law {index}", {index: 0.1 * index + 0.1}, far=index == 1)

    monkeypatch.setattr(laws, "along", refuse)
    rows = np.concatenate([np.zeros((1, 2)), STATES, np.zeros((1, 2))])
    with pytest.raises(NoLawError, match="law 0") as refused:
        flown_parts(chain, row, rows, laws)
    assert (refused.value.failing, refused.value.far) == ({0: 0.1, 1: pytest.approx(0.2)}, True)
    with pytest.raises(NoLawError, match="law 1"):
        flown_parts(chain, row, rows, laws, {0: FlownPart(chain.courses[0].curve)})
    with pytest.raises(NoLawError, match="law 0") as refused:
        flown_parts(chain, row, rows, laws, None, [0])
    assert not refused.value.far
    assert asked == [0, 1, 1, 0]


def test_the_parts_of_a_motion_join() -> None:
    chain = corner()
    chain = replace(chain, tempos=(1.0, 0.8))
    row = row_of(chain, [1.0, 1.0], [1.0, 1.0], {})
    rows = np.array([[0.0, 0.0], [0.8, -1.0], [0.6, 1.5], [0.0, 0.0]])
    before, zone, behind = flown_parts(chain, row, rows, CourseLaws())
    borders = (
        chain.courses[0].curve.evaluate(chain.corners[0].left),
        chain.courses[1].curve.evaluate(chain.corners[0].joined),
    )
    np.testing.assert_allclose(before.curve.evaluate(0.0), POINTS[0])
    np.testing.assert_allclose(before.curve.evaluate(before.curve.end), borders[0], atol=1e-9)
    np.testing.assert_allclose(behind.curve.evaluate(0.0), borders[1], atol=1e-9)
    for first, last in ((before, zone), (zone, behind)):
        for order in range(3):
            gap = first.curve.evaluate(first.curve.end, order) - last.curve.evaluate(0.0, order)
            assert np.abs(gap).max() < 1e-9
    jerk = np.abs(behind.curve.evaluate(np.linspace(0, behind.curve.end, 2001), 3)).max()
    assert jerk == pytest.approx(0.8**3 * 60, rel=1e-9), "at its own pace"


def test_a_part_is_judged_by_the_limits_of_its_course_or_zone() -> None:
    """Each has its own velocity; a zone is left where its borders are too far out."""
    chain = corner()
    one, two = (
        replace(course, robot=arm(velocity=bound))
        for course, bound in zip(chain.courses, (1.0, 2.0), strict=True)
    )
    (zone,) = chain.corners
    chain = replace(chain, courses=(one, two), corners=(replace(zone, robot=arm(velocity=1.5)),))

    def moving(speed: float, start: np.ndarray = POINTS[1]) -> FlownPart:
        return FlownPart(
            PiecewisePolynomial(np.array([0.0, 0.01]), np.array([[speed, 0.0], start])[:, None, :])
        )

    for number, bound in ((0, 1.0), (1, 1.5), (2, 2.0)):
        assert not findings_of(chain, number, moving(0.999 * bound))
        (finding,) = findings_of(chain, number, moving(1.001 * bound))
        assert (finding.kind, finding.joint, finding.limit) == ("velocity", "j1", bound)
        assert finding.factor == pytest.approx(1.001)
        part = move_part(chain, number, moving(bound), 2.5)
        assert (part.start, part.end, part.tool) == (2.5, 2.51, None)
        assert part.robot.limits.velocity[0, 1] == bound
        assert part.around is (zone.around if number == 1 else None)
    away = POINTS[1] + [0.0, 0.06]
    (left,) = findings_of(chain, 1, moving(0.1, away))
    assert left.factor is None
    assert not findings_of(chain, 0, moving(0.1, away))
    tool: Any = object()
    assert move_part(chain, 2, replace(moving(0.1), tool=tool), 0.0).tool is tool
    assert move_part(chain, 1, replace(moving(0.1), tool=tool), 0.0).tool is None


@pytest.mark.parametrize(("time", "rates"), few([(0.0, (2.0, 0.0)), (1.0, (3.0, 0.5)), (2.0, (3.5, 0.5))], 3))
def test_the_state_at_a_break_is_that_behind_it_and_at_the_end_that_before_it(
    time: float, rates: tuple[float, float]
) -> None:
    rows = np.array([[[0.0], [0.25]], [[2.0], [3.0]], [[1.0], [3.0]]])
    state = state_at(PiecewisePolynomial(np.array([0.0, 1.0, 2.0]), rows), time)
    assert (state.velocity[0], state.acceleration[0]) == rates
    assert state.position[0] == {0.0: 1.0, 1.0: 3.0, 2.0: 6.25}[time]


def test_each_course_is_asked_for_between_its_borders_at_its_pace(monkeypatch: pytest.MonkeyPatch) -> None:
    chain = replace(corner(), tempos=(0.9, 0.8))
    row, laws, asked = row_of(chain, [1.0, 1.0], [1.0, 1.0], {}), CourseLaws(), list[Any]()
    rows = np.concatenate([np.zeros((1, 2)), STATES, np.zeros((1, 2))])
    along = laws.along

    def recorded(*given: Any) -> FlownPart:
        asked.append(given)
        return along(*given)

    monkeypatch.setattr(laws, "along", recorded)
    flown_parts(chain, row, rows, laws)
    for k, (course, index, stretch, ends, tempo, part) in enumerate(asked):
        assert (course, index, stretch, tempo) == (chain.courses[k], k, chain.stretch(k), (0.9, 0.8)[k])
        assert part is row.parts[2 * k]
        np.testing.assert_array_equal(ends, rows[2 * k : 2 * k + 2])


def test_a_zone_uses_its_shares_of_the_limits() -> None:
    chain = with_shares(corner(), np.array([[0.9, 0.5, 0.125]]))
    alone = zone_motion(chain, 0, STATES)
    row = row_of(chain, [1.0, 1.0], [1.0, 1.0], {})
    rows = np.concatenate([np.zeros((1, 2)), STATES, np.zeros((1, 2))])
    within = flown_parts(chain, row, rows, CourseLaws())[1]
    for part in (alone, within):
        jerks = np.abs(part.curve.evaluate_orders(np.linspace(0, part.curve.end, 201), (3,))).max()
        assert jerks == pytest.approx(0.125 * 60, rel=1e-9)


def test_uses_are_of_the_bound_in_the_direction_of_the_motion() -> None:
    """Each joint goes one way: the first up with 1, the second down with 2."""
    limits = arm(velocity=[[-9.0, 4.0], [-5.0, 1e3]], acceleration=[[-1.0, 8.0]] * 2).limits
    rows = np.array([[0.5, -1.0], [0.0, 0.0], [0.0, 0.0]])[:, None, :]  # accelerations of 1 and -2
    uses = joint_uses(PiecewisePolynomial(np.array([0.0, 1.0]), rows), limits)
    np.testing.assert_allclose(uses, [[1 / 4, 2 / 5], [1 / 8, 2.0], [0.0, 0.0]])


def test_a_part_is_judged_with_what_the_tool_carries(monkeypatch: pytest.MonkeyPatch) -> None:
    spans, payload = list[Any](), Payload(2.0, np.zeros(3), np.zeros((3, 3)))
    monkeypatch.setattr(parts_module, "limited_part", lambda trajectory, span, one: spans.append(span))
    monkeypatch.setattr(parts_module, "part_findings", lambda *given: [])
    chain = corner()
    courses = tuple(replace(course, robot=replace(course.robot, payload=payload)) for course in chain.courses)
    corners = tuple(replace(each, robot=courses[0].robot) for each in chain.corners)
    chain = replace(chain, courses=courses, corners=corners)
    for number in range(3):
        findings_of(chain, number, FlownPart(chain.courses[0].curve))
    assert [(span.index, span.payload) for span in spans] == [(number, payload) for number in range(3)]
