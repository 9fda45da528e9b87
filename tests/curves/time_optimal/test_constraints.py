"""The excess of constraints against dense evaluation of laws, and what the loop makes of it."""

from __future__ import annotations

import re

import numpy as np
import pytest
from topp_paths import SpeedCap, dense, over, polyline, random_bounds, spline, symmetric

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal import parameterization
from trajcli.curves.time_optimal.constraints import JointConstraint
from trajcli.curves.time_optimal.parameterization import UnsettledSpeedError, time_optimal
from trajcli.curves.time_optimal.passes import StandstillError
from trajcli.curves.time_optimal.time_law import LawPieces, law_and_trajectory, law_pieces


def random_law(rng) -> LawPieces:
    """Return the pieces of a law on [0, 1] that is nobody's solution."""
    grid = np.linspace(0.0, 1.0, 61)
    x = rng.uniform(0.3, 3.0, 61)
    x[[0, -1]] = 0.0
    mean, ramps = np.diff(x) / (2 * np.diff(grid)), rng.uniform(-3, 3, 60)
    return law_pieces(grid, x, mean - ramps, mean + ramps)


def used_by_definition(path, law, velocity, acceleration):
    """Return the shares of velocity and acceleration by the chain rule, at times so dense, shape (2, N)."""
    s, sd, sdd = dense(law)
    s = s.clip(path.start, path.end)
    first, second = (path.evaluate(s.reshape(-1), order).reshape(*s.shape, -1) for order in (1, 2))
    qd = first * sd[..., None]
    qdd = second * sd[..., None] ** 2 + first * sdd[..., None]
    shares = [
        np.maximum(values / bounds[:, 1], values / bounds[:, 0]).max(axis=(0, 2))
        for values, bounds in ((qd, velocity), (qdd, acceleration))
    ]
    return np.stack(shares)


@pytest.mark.parametrize("seed", range(6))
def test_the_excess_of_joints_bounds_what_is_used_and_is_near_to_it(seed):
    rng = np.random.default_rng(seed)
    path = spline(rng.uniform(-1, 1, (7, 3)))  # breaks at sixths, among the grid points; q'' has no jumps
    velocity, acceleration = random_bounds(rng, 3)
    velocity, acceleration = 6 * velocity, 30 * acceleration
    law = random_law(rng)
    used = used_by_definition(path, law, velocity, acceleration)
    excess = JointConstraint(path, velocity, acceleration).excess(law)
    assert excess.shape == (2, 60)
    exceeded = used > 1.0
    assert exceeded.any(axis=1).all()
    assert not exceeded.all(axis=1).any()
    assert (excess >= used - 1e-9)[exceeded].all()
    assert (excess <= 1.0 + 1e-9)[~exceeded].mean() > 0.9
    assert (excess - used)[exceeded].max() <= 0.1 * used.max()
    few = np.array([3, 40, 41])
    np.testing.assert_array_equal(
        JointConstraint(path, velocity, acceleration).excess(law.chosen(few)), excess[:, few]
    )


class Wave(SpeedCap):
    """A speed limit that is 1 at every 96th part of [0, 1], where grid points stand, and 0.7 between them."""

    def __init__(self):
        super().__init__(lambda s: 1.0 - 0.3 * np.sin(96 * np.pi * s) ** 2)


class BlindWave(Wave):
    """The same, that does not see what happens between grid points."""

    def excess(self, law):
        return np.zeros((2, law.durations.size))


def share_of(wave: Wave, law: PiecewisePolynomial) -> float:
    """Return the largest share of a speed limit along a law."""
    t = np.linspace(law.start, law.end, 50_001)
    s, sd = law.evaluate_orders(t, (0, 1))[:, :, 0].T
    return float((sd / wave.limit(s)).max())


@pytest.mark.full
def test_a_limit_that_is_exceeded_between_grid_points_is_tightened():
    path, limits = polyline([[0.0], [1.0]]), (symmetric(9.0), symmetric(50.0))
    blind = time_optimal(path, *limits, further=[BlindWave()])
    assert share_of(Wave(), blind.law) > 1.3
    assert blind.tightened == 0
    found = time_optimal(path, *limits, further=[Wave()])
    assert share_of(Wave(), found.law) <= 1.0 + 1e-6
    assert found.tightened > 50
    assert found.stretch <= 1.0001
    assert blind.trajectory.duration < found.trajectory.duration < 1.0 / 0.7 + 0.1


def test_what_tightening_leaves_is_stretched_or_named(monkeypatch):
    for name in ("_ROUNDS", "_TIGHTENINGS", "_MOST_TIGHTENINGS"):
        monkeypatch.setattr(parameterization, name, 0)
    path, limits = polyline([[0.0], [1.0]]), (symmetric(9.0), symmetric(50.0))
    found = time_optimal(path, *limits, further=[Wave()])
    assert share_of(Wave(), found.law) == pytest.approx(1.0, rel=1e-4)
    assert found.stretch > 1.3
    with pytest.raises(UnsettledSpeedError, match=r"factor of 1\.[34]") as caught:
        time_optimal(path, *limits, further=[Wave()], start_velocity=0.5)
    assert 0.0 < caught.value.s < 1.0


@pytest.mark.parametrize("seed", range(4))
def test_joints_whose_limits_come_as_a_further_constraint_are_as_fast(seed):
    """What a second arm on the same path parameter may do counts as if both were one arm."""
    rng = np.random.default_rng(seed)
    points = rng.uniform(-1, 1, (6, 4))
    velocity, acceleration = random_bounds(rng, 4)
    first, second = spline(points[:, :2]), spline(points[:, 2:])
    both = time_optimal(spline(points), velocity, acceleration)
    more = JointConstraint(second, velocity[2:], acceleration[2:])
    found = time_optimal(first, velocity[:2], acceleration[:2], further=[more])
    # one that is exceeded does not lower the limits of the other
    gained = 1.0 - found.trajectory.duration / both.trajectory.duration
    assert -6e-4 <= gained <= 6e-4
    assert min(found.tightened, both.tightened) > 0
    _, moved = law_and_trajectory(second, LawPieces(found.law.lengths, found.law.coefficients[:, :, 0]))
    assert max(over(moved, velocity[2:], acceleration[2:])) <= 1.0 + 1e-9


def test_where_nothing_may_move_the_place_and_what_helps_are_named():
    path, limits = polyline([[0.0], [1.0]]), (symmetric(9.0), symmetric(50.0))
    blocked = SpeedCap(lambda s: np.where(np.abs(s - 0.5) < 0.2, 0.0, 1.0))
    with pytest.raises(StandstillError) as caught:
        time_optimal(path, *limits, further=[blocked])
    (place,) = re.findall(r"^the limits let nothing move on from s = (\S+)$", str(caught.value))
    assert float(place) == pytest.approx(0.3, abs=1 / 96)
    (problem,) = caught.value.problems
    assert problem.hint == "raise limits of effort"
