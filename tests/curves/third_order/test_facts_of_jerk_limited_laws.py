"""What a jerk-limited motion says of itself: its bound and whose it is, its stops, and limits of a second arm."""

from __future__ import annotations

import numpy as np
import pytest
from jerk_paths import both, polyline, spline
from ruckig import InputParameter, Result, Ruckig, Trajectory
from tiers import few

from trajcli.curves.extrema import peaks
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.third_order.jerk import JointJerkConstraint, LawJerkConstraint
from trajcli.curves.third_order.parameterization import _stretch, jerk_limited_time_optimal
from trajcli.curves.time_optimal.constraints import JointConstraint
from trajcli.curves.time_optimal.time_law import LawPieces, law_and_trajectory


def from_rest(distance: float, limits: tuple[float, float, float]) -> float:
    """Return what ruckig needs from rest to rest."""
    wanted, answer = InputParameter(1), Trajectory(1)
    wanted.current_position, wanted.target_position = [0.0], [distance]
    wanted.max_velocity, wanted.max_acceleration, wanted.max_jerk = ([each] for each in limits)
    assert Ruckig(1).calculate(wanted, answer) == Result.Working
    return float(answer.duration)


@pytest.mark.parametrize("shares", [(4.0, 1.0, 1.0), (1.0, 9.0, 1.0), (1.0, 1.0, 64.0), (1.0, 1.0, 1.0)])
def test_a_law_is_slowed_by_what_takes_its_largest_share(shares: tuple[float, float, float]) -> None:
    """In k times the time velocities are a k-th, accelerations a k^2-th and jerks a k^3-th."""
    factor = _stretch(np.array([[0.5, share] for share in shares]))
    slowed = [share / factor ** (order + 1) for order, share in enumerate(shares)]
    assert max(slowed) == pytest.approx(1.0)


LIMITS = (0.8, 2.0, 10.0)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_between_stops_the_bound_is_the_sum_of_what_lies_between(sign: float) -> None:
    path = polyline(sign * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.6]]))
    found = jerk_limited_time_optimal(path, *(both([limit] * 2) for limit in LIMITS))
    needed = [from_rest(distance, LIMITS) for distance in (1.0, 0.6)]
    assert found.lower_bound == pytest.approx(sum(needed), rel=1e-6)
    assert found.trajectory.duration == pytest.approx(sum(needed), rel=2e-3)
    assert (found.bounding_joint, found.bounded_by_stops) == (None, True)
    np.testing.assert_allclose(found.stops, [1.0])
    np.testing.assert_allclose(found.stop_times, needed[:1], rtol=2e-3)
    np.testing.assert_allclose(found.law.evaluate(found.stop_times)[:, 0], found.stops, atol=1e-9)


@pytest.mark.parametrize("joint", [0, 1])
def test_without_stops_one_joint_may_need_the_bound(joint: int) -> None:
    limits = [np.array([9.0, 9.0]), np.array([90.0, 90.0]), np.array([900.0, 900.0])]
    for order, limit in enumerate(LIMITS):
        limits[order][joint] = limit
    path = polyline(np.array([[0.0, 0.0], [0.5, 0.5]]))
    found = jerk_limited_time_optimal(path, *(both(limit) for limit in limits))
    assert found.lower_bound == pytest.approx(from_rest(0.5, LIMITS), rel=1e-6)
    assert (found.bounding_joint, found.bounded_by_stops) == (joint, False)


def test_where_jerk_hardly_counts_the_bound_is_that_without_it() -> None:
    rng = np.random.default_rng(3)
    path = spline(np.linspace(0, 1, 6), rng.uniform(-1, 1, (6, 2)))
    found = jerk_limited_time_optimal(path, both([1.0, 1.0]), both([3.0, 3.0]), both([1e5, 1e5]))
    assert found.lower_bound <= found.trajectory.duration <= 1.02 * found.lower_bound
    assert (found.bounding_joint, found.bounded_by_stops) == (None, False)
    assert 0.0 <= found.lost < 0.01


def test_limits_of_a_second_arm_are_kept_and_cost_what_they_cost_one_arm_of_all_joints() -> None:
    rng = np.random.default_rng(8)
    points, s = rng.uniform(-1, 1, (5, 3)), np.linspace(0, 1, 5)
    limits = [both([size] * 3) for size in (1.0, 3.0, 30.0)]
    whole = jerk_limited_time_optimal(spline(s, points), *limits)
    other = spline(s, points[:, 1:])
    found = jerk_limited_time_optimal(
        spline(s, points[:, :1]),
        *(bounds[:1] for bounds in limits),
        further=[JointConstraint(other, limits[0][1:], limits[1][1:])],
        further_jerk=[JointJerkConstraint(other, limits[2][1:])],
    )
    assert found.trajectory.duration == pytest.approx(whole.trajectory.duration, rel=5e-3)
    _, moved = law_and_trajectory(other, LawPieces(found.law.lengths, found.law.coefficients[:, :, 0]))
    for peak, bounds in zip(peaks(moved, (1, 2, 3)), limits, strict=True):
        assert (peak.high <= bounds[1:, 1] * (1 + 1e-9)).all()
        assert (peak.low >= bounds[1:, 0] * (1 + 1e-9)).all()


@pytest.mark.parametrize("ends", [(0.3, 0.1), (0.0, 0.2), (0.25, 0.0)])
def test_speeds_of_both_ends_are_kept_and_count_in_the_bound(ends: tuple[float, float]) -> None:
    path = polyline(np.array([[0.0], [0.6]]))
    bounds = [both([limit]) for limit in LIMITS]
    found = jerk_limited_time_optimal(path, *bounds, start=(ends[0], 0.0), end=(ends[1], 0.0))
    rates = [float(found.law.evaluate(t, 1)[0]) for t in (0.0, found.law.end)]
    np.testing.assert_allclose(rates, ends, atol=1e-6)
    wanted, answer = InputParameter(1), Trajectory(1)
    wanted.current_position, wanted.target_position = [0.0], [0.6]
    wanted.current_velocity, wanted.target_velocity = [ends[0]], [ends[1]]
    wanted.max_velocity, wanted.max_acceleration, wanted.max_jerk = ([each] for each in LIMITS)
    assert Ruckig(1).calculate(wanted, answer) == Result.Working
    assert 0.8 * answer.duration <= found.lower_bound <= answer.duration * (1 + 1e-9)
    assert found.trajectory.duration == pytest.approx(answer.duration, rel=2e-2)


class OfTool(LawJerkConstraint):
    """A limit of the jerk of the law that stands for one of a tool, whose path bends with the joints'."""

    curved = True


def test_a_tool_with_a_limit_of_jerk_stops_where_the_curvature_jumps() -> None:
    """A joint that goes evenly and then faster; it has no limit of jerk itself."""
    path = PiecewisePolynomial(
        np.array([0.0, 0.5, 1.0]), np.array([[[0.0], [0.8]], [[1.0], [1.0]], [[0.0], [0.5]]])
    )
    free = np.array([[-np.inf, np.inf]])
    bounds = both([1.0]), both([2.0]), free
    law, tool = LawJerkConstraint(20.0), OfTool(20.0)
    for further, stops in (([law], []), ([tool], [0.5]), ([law, tool], [0.5]), ([tool, law], [0.5])):
        found = jerk_limited_time_optimal(path, *bounds, further_jerk=further)
        assert found.stops.tolist() == stops
        rates = found.law.evaluate(found.stop_times, 1)
        np.testing.assert_allclose(rates, 0.0, atol=1e-6)


@pytest.mark.parametrize("ends", few([(0.5, 0.0), (0.2, 0.6), (0.0, 0.5)], 2))
def test_where_jerk_hardly_counts_the_speeds_of_both_ends_say_what_the_bound_is(
    ends: tuple[float, float],
) -> None:
    """Ramps from and to 0.8 m/s at 2 m/s^2, and the rest at that speed."""
    path, bounds = polyline(np.array([[0.0], [1.0]])), [both([limit]) for limit in (0.8, 2.0, 1e5)]
    found = jerk_limited_time_optimal(path, *bounds, start=(ends[0], 0.0), end=(ends[1], 0.0))
    ramps = [((0.8 - speed) / 2.0, (0.8**2 - speed**2) / 4.0) for speed in ends]
    shortest = sum(time for time, _ in ramps) + (1.0 - sum(way for _, way in ramps)) / 0.8
    assert shortest * 0.98 <= found.lower_bound <= shortest * (1 + 1e-4)
    assert shortest * (1 - 1e-9) <= found.trajectory.duration <= shortest * 1.01


@pytest.mark.parametrize("corner", [False, True])
def test_limits_along_the_path_that_others_imply_are_in_the_bound(corner: bool) -> None:
    """At 0.5 m/s and 1 m/s^2 along it one metre takes 2.5 s, and half a metre 1.5 s."""
    points = np.array([[0.0, 0.0], [0.5, 0.0], [0.5, 0.5]]) if corner else np.array([[0.0, 0.0], [1.0, 0.0]])
    path, wide = polyline(points), [both([limit] * 2) for limit in (50.0, 50.0, 1e5)]
    even = PiecewisePolynomial(path.breaks, np.stack([np.ones((path.pieces, 1)), path.breaks[:-1, None]]))
    further = [JointConstraint(even, both([0.5]), both([1.0]))]
    found = jerk_limited_time_optimal(path, *wide, further=further, along=(0.5, 1.0))
    assert found.lower_bound == pytest.approx(2 * 1.5 if corner else 2.5, rel=1e-2)
    assert found.lower_bound <= found.trajectory.duration * (1 + 1e-9)
    assert (found.bounding_joint, found.bounded_by_stops) == (None, False)


def test_what_a_finer_grid_would_save_is_a_share_of_the_duration() -> None:
    rng = np.random.default_rng(3)
    path = spline(np.linspace(0, 1, 6), rng.uniform(-1, 1, (6, 2)))
    shares = [
        jerk_limited_time_optimal(
            path, *(both([limit / slower**order] * 2) for order, limit in enumerate((1.0, 3.0, 30.0), 1))
        ).lost
        for slower in (1.0, 64.0)
    ]
    assert shares[1] == pytest.approx(shares[0], rel=0.5)
