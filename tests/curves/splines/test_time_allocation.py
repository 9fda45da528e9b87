"""Durations of pieces against closed forms, and against scipy's search over the same family."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, make_interp_spline
from scipy.optimize import minimize
from tiers import few

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.splines.time_allocation import DensePoints, fastest_durations

FREE = (-np.inf, np.inf)


def bounds(velocity=FREE, acceleration=FREE, jerk=FREE, joints=1):
    pairs = [(-one, one) if np.ndim(one) == 0 else one for one in (velocity, acceleration, jerk)]
    return np.tile(np.array(pairs, dtype=float)[:, None], (1, joints, 1))


def times_of(durations):
    return np.concatenate([[0.0], np.cumsum(durations)])


def straight(q):
    """Return the family of straight pieces between points (m, n): each lasts as long as its slowest joint."""

    def family(h):
        return PiecewisePolynomial(times_of(h), np.stack([np.diff(q, axis=0) / h[:, None], q[:-1]]))

    return family


def resting(q):
    """Return the family of cubics at rest at every point."""

    def family(h):
        distance, h = np.diff(q, axis=0), h[:, None]
        return PiecewisePolynomial(
            times_of(h[:, 0]), np.stack([-2 * distance / h**3, 3 * distance / h**2, 0 * distance, q[:-1]])
        )

    return family


def smooth(q, ends="clamped"):
    """Return scipy's cubic splines, as curves: what matters to a piece is also how long its neighbours last."""

    def family(h):
        spline = CubicSpline(times_of(h), q, bc_type=ends)
        return PiecewisePolynomial(spline.x, spline.c)

    return family


def points(seed, count, joints=1):
    return np.cumsum(np.random.default_rng(seed).uniform(-1, 1, (count, joints)), axis=0)


@pytest.mark.parametrize("guess", [0.01, 1.0, 50.0])
def test_each_straight_piece_takes_the_time_of_its_slowest_joint(guess):
    q = points(1, 8, 2)
    expected = np.abs(np.diff(q, axis=0)).max(axis=1) / 2
    found = fastest_durations(straight(q), np.full(7, guess), bounds(velocity=2, joints=2))
    assert found.sum() == pytest.approx(expected.sum(), rel=0.02)
    assert (found >= expected * (1 - 1e-9)).all()


@pytest.mark.parametrize(("count", "faster"), [(30, 1.0), (3000, 1.0), (30, 1e3), (30, 1e-3)])
def test_cubics_at_rest_have_a_closed_form(count, faster):
    """The distance D takes max(3 D / 2 V, sqrt(6 D / A), cbrt(12 D / J)), and a thousandth of it with limits of so fast a clock."""
    q = points(2, count)
    distance = np.abs(np.diff(q, axis=0))[:, 0]
    expected = (
        np.maximum.reduce([1.5 * distance, np.sqrt(6 * distance / 2), np.cbrt(12 * distance / 9)]) / faster
    )
    found = fastest_durations(
        resting(q), np.full(count - 1, 1.0), bounds(faster, 2 * faster**2, 9 * faster**3)
    )
    assert found.sum() == pytest.approx(expected.sum(), rel=0.02)
    assert (found >= expected * (1 - 1e-9)).all()


def test_directions_have_their_own_bounds():
    q = np.array([[0.0], [1.0], [0.0]])
    found = fastest_durations(straight(q), np.ones(2), bounds(velocity=(-0.25, 1.0)))
    np.testing.assert_allclose(found, [1, 4], rtol=0.02)


@pytest.mark.parametrize(("seed", "count", "joints"), few([(1, 3, 1), (2, 5, 1), (3, 5, 2), (4, 8, 2)], 2))
def test_no_slower_than_a_search_of_scipy(seed, count, joints):
    q, family = points(seed, count, joints), smooth(points(seed, count, joints))
    limits, guess = bounds(1, 3, joints=joints), np.full(count - 1, 1.0)

    def room(y):
        curve = family(np.exp(y))
        at = (curve.breaks[:-1, None] + curve.lengths[:, None] * np.linspace(0.001, 0.999, 24)).ravel()
        return np.concatenate(
            [1 - np.abs(curve.evaluate(at, o)).ravel() / b for o, b in ((1, 1.0), (2, 3.0))]
        )

    best = np.inf
    for k in range(5):
        start = np.random.default_rng(k).normal(0, 0.3, count - 1) + np.log(2)
        search = {"type": "ineq", "fun": room}
        found = minimize(lambda y: np.exp(y).sum(), start, constraints=search, method="SLSQP")
        if room(found.x).min() > -1e-6:
            best = min(best, np.exp(found.x).sum())
    found = fastest_durations(family, guess, limits)
    assert found.sum() <= 1.02 * best
    assert q.shape == (count, joints)


def test_the_limits_are_kept_and_one_is_reached():
    family = smooth(points(5, 40, 3), "natural")
    found = fastest_durations(family, np.ones(39), bounds(1, 3, 40, joints=3))
    curve = family(found)
    at = np.linspace(0, curve.duration, 40_001)
    used = [np.abs(curve.evaluate(at, order)).max() / bound for order, bound in ((1, 1), (2, 3))]
    used.append(np.abs(curve.piece_ends(3)[0]).max() / 40)
    assert max(used) <= 1 + 1e-9
    assert max(used) > 1 - 1e-6


def test_a_joint_without_a_bound_frees_no_other():
    q = np.array([[0.0, 0.0], [3.0, 1.0], [0.0, 2.0]])
    limits = bounds(velocity=1e3, joints=2)
    limits[1, 1] = -6.0, 6.0
    np.testing.assert_allclose(fastest_durations(resting(q), np.ones(2), limits), [1, 1], rtol=0.02)


def test_the_search_begins_with_the_best_guess_where_few_pieces_are_too_fast(monkeypatch):
    """What is found without any step of Newton: the stretched guess, or another one that is slowed where it needs it."""
    monkeypatch.setattr("trajcli.curves.splines.time_allocation._centred", lambda _, point, *_others: point)
    steps = np.ones(60)
    steps[30] = 4.0
    q, limits = np.append(0.0, np.cumsum(steps))[:, None], bounds(velocity=1.0)
    even = np.ones(60)
    assert fastest_durations(straight(q), even, limits).sum() == pytest.approx(240)
    assert fastest_durations(straight(q), even, limits, [steps]).sum() == pytest.approx(63)
    assert fastest_durations(straight(q), steps, limits, [even]).sum() == pytest.approx(63)
    eased = fastest_durations(straight(q), even, limits, [even])
    assert 63 < eased.sum() < 100
    assert (eased >= steps).all()


def test_no_durations_at_all():
    """A velocity that is given at an end and above its limit stays so however long the pieces last."""

    def family(h):
        spline = CubicSpline(times_of(h), [[0.0], [1.0], [2.0]], bc_type=((1, [5.0]), (1, [0.0])))
        return PiecewisePolynomial(spline.x, spline.c)

    assert fastest_durations(family, np.ones(2), bounds(1, 3)) is None


def test_what_uses_no_limit_has_no_smallest_durations():
    assert fastest_durations(straight(np.zeros((3, 1))), np.ones(2), bounds(1, 3)) is None


def test_it_says_the_same_every_time():
    family = smooth(points(6, 12, 2))
    first, second = (fastest_durations(family, np.ones(11), bounds(1, 3, joints=2)) for _ in range(2))
    assert first.tobytes() == second.tobytes()


def test_a_curve_may_end_before_the_durations_do():
    """As under a law that overshoots: then points are reached before the time that it is given for them."""
    q, limits = np.arange(4.0)[:, None], bounds(velocity=2.0)

    def family(h):
        return straight(q)(np.minimum(h, 1.0))

    found = fastest_durations(family, np.array([50.0, 1.0, 1.0]), limits)
    assert np.minimum(found, 1.0) == pytest.approx(0.5, rel=1e-3)


def law_of(times, values, slopes):
    """Return scipy's law through values at times: its ends free, or of given slope and without acceleration."""
    if slopes is None:
        return CubicSpline(times, values)
    knots = [*[times[0]] * 4, (times[0] + times[1]) / 2, *times[1:-1], (times[-2] + times[-1]) / 2]
    ends = tuple([(1, slope), (2, 0.0)] for slope in slopes)
    return make_interp_spline(times, values, k=3, t=[*knots, *[times[-1]] * 4], bc_type=ends)


@pytest.mark.parametrize("slopes", [None, (0.0, 0.0), (1.5, 0.7)])
def test_dense_points_are_passed_when_a_law_through_some_of_them_says(slopes, monkeypatch):
    """First 24 durations, then three times as many, which begin with the shortest that were found."""
    begun = []
    u = np.cumsum(np.random.default_rng(3).uniform(0.5, 1.5, 217))

    def found(family, coarse, _bounds, longer):
        begun.append(coarse)
        chosen = np.round(np.linspace(0, 216, coarse.size + 1)).astype(int)
        fine = family(coarse * longer[len(begun) - 1])
        ends = times_of(coarse * longer[len(begun) - 1])
        np.testing.assert_allclose(times_of(fine)[chosen], ends, rtol=1e-9)
        np.testing.assert_allclose(law_of(ends, u[chosen], slopes)(times_of(fine)), u, rtol=1e-9)
        return coarse * longer[len(begun) - 1]

    dense = DensePoints(lambda h: h, u, bounds(), *([slopes] if slopes != (0.0, 0.0) else []))
    for longer, least in (([1.0, 1.01], 1.0), ([1.01, 0.999], 1.01 * 0.999)):
        begun.clear()
        monkeypatch.setattr(
            "trajcli.curves.splines.time_allocation.fastest_durations",
            lambda *given, longer=longer: found(*given, longer),
        )
        durations = dense.durations(np.diff(u))
        assert [one.size for one in begun] == [24, 72]
        np.testing.assert_allclose([one.sum() for one in begun], np.ptp(u) * np.array([1, longer[0]]))
        assert durations.sum() == pytest.approx(np.ptp(u) * least)
    monkeypatch.setattr("trajcli.curves.splines.time_allocation.fastest_durations", lambda *_: None)
    assert dense.durations(np.diff(u)) is None


@pytest.mark.parametrize("guess", [1.05, 1.1])
def test_a_piece_between_moving_ends_keeps_its_limit_inside_too(guess):
    """Over 1 from 0.9 to 0.9: in the middle the velocity is 1.5 / T - 0.45, which is 1 for T = 1.5 / 1.45.

    With the ends moving it does not scale with the duration: from 1.1 in proportion to 0.914 it would be 1.04.
    """
    ends = ((1, np.array([0.9])), (1, np.array([0.9])))
    found = fastest_durations(smooth(np.array([[0.0], [1.0]]), ends), np.array([guess]), bounds(velocity=1.0))
    np.testing.assert_allclose(found, [1.5 / 1.45], rtol=1e-6)
