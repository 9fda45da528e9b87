"""What a time-optimal motion says of itself: stops and their times, ends, bounds, and its law beside its trajectory."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from topp_paths import over, polyline, random_bounds, spline, symmetric

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal import parameterization
from trajcli.curves.time_optimal.constraints import JointConstraint
from trajcli.curves.time_optimal.parameterization import (
    GridSolution,
    PathProblem,
    UnsettledSpeedError,
    _tightened_solution,
    time_optimal,
)
from trajcli.curves.time_optimal.passes import StandstillError, UnlimitedSpeedError, UnreachableSpeedError

needed = GridSolution.needed.fget
FROM_REST = 2 * np.sqrt([0.3, 0.3, 0.4])  # over these distances, at 1 m/s^2


def test_stops_are_those_asked_for_and_the_corners_each_at_its_time() -> None:
    path = polyline([[0.0], [0.3], [0.6], [0.2]], [0.0, 0.3, 0.6, 1.0])
    found = time_optimal(path, symmetric(9.0), symmetric(1.0), stops=[0.3])
    assert found.stops.tolist() == [0.3, 0.6]
    np.testing.assert_allclose(found.stop_times, np.cumsum(FROM_REST)[:2], rtol=1e-4)
    assert found.trajectory.duration == pytest.approx(FROM_REST.sum(), rel=1e-4)
    np.testing.assert_allclose(found.law.evaluate(found.stop_times)[:, 0], found.stops, atol=1e-9)
    np.testing.assert_allclose(found.law.evaluate(found.stop_times, 1), 0.0, atol=1e-6)
    assert 0.999 * FROM_REST.sum() <= found.lower_bound <= found.trajectory.duration


def test_each_end_has_its_speed() -> None:
    path = polyline([[0.0], [1.0]])
    found = time_optimal(path, symmetric(0.9), symmetric(1.0), start_velocity=0.5, end_velocity=0.2)
    rates = [float(found.law.evaluate(t, 1)[0]) for t in (0.0, found.law.end)]
    assert rates == [pytest.approx(0.5), pytest.approx(0.2)]
    cruise = 1.0 - (0.9**2 - 0.5**2) / 2 - (0.9**2 - 0.2**2) / 2
    assert found.trajectory.duration == pytest.approx(0.4 + 0.7 + cruise / 0.9, rel=1e-4)


@pytest.mark.parametrize("speed", [-0.1, np.nan, np.inf])
@pytest.mark.parametrize("end", ["start_velocity", "end_velocity"])
def test_speeds_of_both_ends_are_finite_and_not_negative(end: str, speed: float) -> None:
    with pytest.raises(ValueError, match="must be finite, not negative"):
        time_optimal(polyline([[0.0], [1.0]]), symmetric(1.0), symmetric(1.0), **{end: speed})


def test_a_speed_where_the_path_stands_still_is_kept_if_it_is_given() -> None:
    """With q = s^2 the joint rests at s = 0 whatever sd is, and sd^2 is half of its acceleration there."""
    path = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[1.0]], [[0.0]], [[0.0]]]))
    fastest = time_optimal(path, symmetric(9.0), symmetric(1.0))
    assert float(fastest.law.evaluate(0.0, 1)[0]) == pytest.approx(np.sqrt(0.5), rel=1e-3)
    given = time_optimal(path, symmetric(9.0), symmetric(1.0), start_velocity=0.3)
    assert float(given.law.evaluate(0.0, 1)[0]) == pytest.approx(0.3, rel=1e-6)


def curved(seed: int = 6) -> tuple[PiecewisePolynomial, np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return spline(rng.uniform(-1, 1, (6, 3)), np.arange(6.0)), *random_bounds(rng, 3)


@pytest.mark.parametrize(("velocity", "acceleration"), [(1.0, 1.0), (0.3, 100.0), (100.0, 1.0)])
def test_a_motion_that_is_stretched_is_the_path_under_its_law_and_meets_a_limit(
    velocity: float, acceleration: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    for name in ("_ROUNDS", "_MOST_TIGHTENINGS"):
        monkeypatch.setattr(parameterization, name, 0)
    path, *bounds = curved()
    bounds = [bounds[0] * velocity, bounds[1] * acceleration]
    found = time_optimal(path, *bounds)
    assert found.stretch > 1 + 1e-7
    assert found.law.end == pytest.approx(found.trajectory.end, rel=1e-12)
    times = np.linspace(0.0, found.law.end, 501)
    s = found.law.evaluate(times)[:, 0].clip(path.start, path.end)
    np.testing.assert_allclose(found.trajectory.evaluate(times), path.evaluate(s), atol=1e-9)
    assert 0.99 <= max(over(found.trajectory, *bounds)) <= 1 + 1e-9
    assert found.tightened == 0


@pytest.mark.parametrize("speeds", [(0.3, 0.0), (0.0, 0.3), (0.3, 0.2)])
def test_a_motion_with_a_speed_at_either_end_is_not_stretched(
    speeds: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    path, *bounds = curved()
    ends = {"start_velocity": speeds[0], "end_velocity": speeds[1]}
    found = time_optimal(path, *bounds, **ends)
    assert found.refinements > 0
    assert found.stretch == 1.0
    assert max(over(found.trajectory, *bounds)) <= 1 + 1e-9
    monkeypatch.setattr(parameterization, "_MOST_TIGHTENINGS", 0)
    with pytest.raises(UnsettledSpeedError) as caught:
        time_optimal(path, *bounds, **ends)
    assert caught.value.over > 1.0


def test_every_further_constraint_counts() -> None:
    path, wide = polyline([[0.0], [1.0]]), symmetric(50.0)
    loose, tight = (JointConstraint(path, symmetric(v), symmetric(a)) for v, a in ((5.0, 9.0), (0.5, 1.0)))
    for further in ([loose, tight], [tight, loose]):
        found = time_optimal(path, wide, wide, further=further, along=(0.5, 1.0))
        assert found.trajectory.duration == pytest.approx(2.5, rel=1e-4)
        assert found.lower_bound == pytest.approx(2.5, rel=1e-3)
    none = np.array([[-np.inf, np.inf]])
    alone = time_optimal(path, none, none, further=[tight])
    assert alone.trajectory.duration == pytest.approx(2.5, rel=1e-4)
    assert time_optimal(path, none, none, further=[tight], along=(0.5, 1.0)).lower_bound > 2.49


def test_limits_of_further_constraints_count_in_the_bound() -> None:
    path, wide = polyline([[0.0], [1.0]]), symmetric(50.0)
    tight = JointConstraint(path, symmetric(0.5), symmetric(1.0))
    found = time_optimal(path, wide, wide, further=[tight])
    assert found.trajectory.duration == pytest.approx(2.5, rel=1e-4)
    assert 4 * 2 / np.sqrt(50) <= found.lower_bound <= 2.5 * (1 + 1e-9)


def test_a_path_of_no_length_has_no_fastest_law() -> None:
    with pytest.raises(UnlimitedSpeedError) as refused:
        time_optimal(
            PiecewisePolynomial(np.full(2, 3.0), np.zeros((2, 1, 1))), symmetric(1.0), symmetric(1.0)
        )
    assert refused.value.s == 3.0


def test_where_nothing_bounds_the_acceleration_the_start_is_named() -> None:
    path = PiecewisePolynomial(np.array([2.0, 3.0]), np.array([[[1.0]], [[0.0]]]))
    with pytest.raises(UnlimitedSpeedError) as refused:
        time_optimal(path, symmetric(1.0), np.array([[-np.inf, np.inf]]))
    assert refused.value.s == 2.0


def test_speeds_that_cannot_be_are_said_each_at_its_end() -> None:
    with pytest.raises(ValueError, match=r"path velocities -1\.0 and 2\.5 must be finite, not negative"):
        time_optimal(
            polyline([[0.0], [1.0]]), symmetric(9.0), symmetric(1.0), start_velocity=-1.0, end_velocity=2.5
        )


@pytest.mark.parametrize(("velocity", "acceleration"), [(1.0, 1.44), (1.2, 1.3)])
def test_what_is_exceeded_is_named_in_the_middle_of_its_interval_by_its_own_factor(
    velocity: float, acceleration: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """An acceleration by its own excess, though slowing down by its root would do."""
    excess = np.array([[[1.0, velocity], [1.0, acceleration]]])
    solution = SimpleNamespace(grid=np.array([0.0, 0.25, 1.0]), pieces=None, needed=1.2, excess=excess)
    monkeypatch.setattr(parameterization, "_refined_solution", lambda _: (solution, 0, 0.0))
    monkeypatch.setattr(parameterization, "_tightened_solution", lambda _: (solution, 1))
    with pytest.raises(UnsettledSpeedError) as refused:
        time_optimal(polyline([[0.0], [1.0]]), symmetric(9.0), symmetric(9.0), start_velocity=0.1)
    assert (refused.value.s, refused.value.over) == (0.625, max(velocity, acceleration))
    assert f"s = 0.625 a limit is passed by a factor of {acceleration:g}" in str(refused.value)


def test_a_motion_that_is_stretched_stops_at_its_stops_later(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(GridSolution, "needed", property(lambda _: 1.5))
    monkeypatch.setattr(parameterization, "_MOST_TIGHTENINGS", 0)
    path = polyline([[0.0], [0.3], [0.6], [0.2]], [0.0, 0.3, 0.6, 1.0])
    found = time_optimal(path, symmetric(9.0), symmetric(1.0), stops=[0.3])
    assert found.stretch == 1.5
    np.testing.assert_allclose(found.stop_times, 1.5 * np.cumsum(FROM_REST)[:2], rtol=1e-4)


@pytest.mark.parametrize("over", [5e-9, 1e-8, 1e-3])
def test_what_a_verdict_would_not_forgive_is_stretched_away(over: float) -> None:
    """Limits may be passed by a billionth of them; of an acceleration the root is enough."""
    for index, power in ((0, 1.0), (1, 0.5)):
        excess = np.ones((2, 2, 3))
        excess[1, index, 2] += over
        solution: Any = SimpleNamespace(excess=excess)
        assert needed(solution) == pytest.approx((1 + over) ** power, rel=1e-14, abs=0)
    assert needed(SimpleNamespace(excess=np.full((1, 2, 2), 1 + 1e-12))) == 1.0  # type: ignore[arg-type]


def test_what_a_finer_grid_would_gain_is_estimated(monkeypatch: pytest.MonkeyPatch) -> None:
    path, *bounds = curved()
    fine = time_optimal(path, *bounds)
    monkeypatch.setattr(parameterization, "_ROUNDS", 0)
    coarse = time_optimal(path, *bounds)
    assert 0 <= fine.lost <= 1e-3
    gained = coarse.trajectory.duration / fine.trajectory.duration - 1
    assert gained / 5 <= coarse.lost <= 20 * gained


def test_the_strictest_of_the_constraints_says_how_fine_a_grid_is() -> None:
    further: Any = (SimpleNamespace(estimate=0.1), SimpleNamespace(estimate=0.7))
    path = polyline([[0.0], [1.0]])
    joints = JointConstraint(path, symmetric(1.0), symmetric(1.0))
    for rows in (further, further[::-1]):
        assert PathProblem(joints, rows, np.empty(0), (0.0, 0.0)).estimate == 0.1


def test_a_path_that_stands_still_at_its_ends_may_be_stretched(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of two joints by 3 s^2 - 2 s^3 and by 10 s^3 - 15 s^4 + 6 s^5: any sd is rest at both ends."""
    for name in ("_ROUNDS", "_MOST_TIGHTENINGS"):
        monkeypatch.setattr(parameterization, name, 0)
    rows = [[0.0, 0.0, -2.0, 3.0, 0.0, 0.0], [6.0, -15.0, 10.0, 0.0, 0.0, 0.0]]
    path = PiecewisePolynomial(np.array([0.0, 1.0]), np.array(rows).T[:, None, :])
    bounds = symmetric(1.0, 1.0), symmetric(2.0, 2.0)
    found = time_optimal(path, *bounds)
    assert found.stretch > 1.0
    assert max(over(found.trajectory, *bounds)) <= 1 + 1e-9


def test_a_limit_that_cannot_be_settled_is_named_where_it_is_passed(monkeypatch: pytest.MonkeyPatch) -> None:
    """It is one of a second arm, which bends about s = 0.75 alone."""
    monkeypatch.setattr(parameterization, "_MOST_TIGHTENINGS", 0)
    bend = spline(
        [[0.0], [0.0], [0.03], [0.0], [0.0]], np.array([0.0, 0.7, 0.75, 0.8, 1.0]), bc_type="clamped"
    )
    other = JointConstraint(bend, symmetric(1.0), symmetric(2.0))
    with pytest.raises(UnsettledSpeedError) as caught:
        time_optimal(
            polyline([[0.0], [1.0]]), symmetric(9.0), symmetric(9.0), further=[other], start_velocity=0.05
        )
    assert 0.65 < caught.value.s < 0.85


class Attempt:
    """A solution that says only what it takes, and by how much it passes limits in its two intervals."""

    x = np.ones(3)

    def __init__(
        self, duration: float, needed: float, over: tuple[float, float], following: Any = None
    ) -> None:
        self.duration, self.needed, self.following = duration, needed, following
        self.excess = np.array([[[1.0, 1.0], [1.0 + over[0], 1.0 + over[1]]]])
        self.even: list[list[bool]] = []
        self.problem: Any = None

    def tightened(self, factors: np.ndarray, even: np.ndarray) -> Attempt:
        self.even.append(even.tolist())
        return self.following or self


@pytest.mark.parametrize("rests", [True, False])
def test_of_motions_that_may_be_stretched_the_fastest_is_kept_else_the_last(rests: bool) -> None:
    """Limits are lowered in one interval, then in the other; where speeds are given the last one keeps most."""
    last = Attempt(11.0, 1.05, (0.0, 1e-6))
    second = Attempt(10.0, 1.02, (0.0, 0.05), last)
    first = Attempt(10.0, 1.1, (0.2, 0.0), second)
    for each in (first, second, last):
        each.problem = SimpleNamespace(rests=rests)
    given: Any = first
    best, count = _tightened_solution(given)
    assert best is (second if rests else last)
    assert count == 2
    # from the fourth round on an excess that must go keeps sdd constant; a little is stretched away
    assert last.even[0] == [False, False]
    assert last.even[-1] == [False, not rests]


@pytest.mark.parametrize("error", [StandstillError(0.0), UnreachableSpeedError("start", 0.0, 1.0, 0.5)])
def test_what_a_coarse_grid_has_no_room_for_is_tried_on_finer_ones(
    error: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    known, sizes = parameterization._solution_on_grid, list[int]()

    def on_grid(problem: PathProblem, grid: np.ndarray, before: Any) -> GridSolution:
        sizes.append(grid.size - 1)
        if len(sizes) < 4:
            raise error
        return known(problem, grid, before)

    monkeypatch.setattr(parameterization, "_solution_on_grid", on_grid)
    path, *bounds = curved()
    assert time_optimal(path, *bounds).trajectory.duration > 0
    assert sizes[:4] == [sizes[0] * 2**k for k in range(4)]
    monkeypatch.setattr(parameterization, "_solution_on_grid", lambda *_: (_ for _ in ()).throw(error))
    with pytest.raises(type(error)):
        time_optimal(path, *bounds)
