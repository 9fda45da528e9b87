"""Rows of a convex step against the law that the step leads to, and its tangent of the limit of jerk."""

from __future__ import annotations

from math import comb

import numpy as np
import pytest
from jerk_paths import both, spline

from trajcli.curves.third_order.convex_step import _of_nodes, _rows, _second_order, _third_order, faster
from trajcli.curves.third_order.jerk import JointJerkConstraint
from trajcli.curves.third_order.path_limits import SHARES, LawLimits, sampled
from trajcli.curves.third_order.quartic_law import QuarticLaw
from trajcli.curves.time_optimal.constraints import JointConstraint

PATH = spline(np.linspace(0, 1, 5), np.array([[0.0, 0], [0.4, 1], [0.9, 0.6], [1.3, 1.4], [2, 1]]))
VELOCITY, ACCELERATION, JERK = both([3.0, 4.0]), np.array([[-9.0, 12.0], [-20.0, 15.0]]), both([90.0, 120.0])
LIMITS = LawLimits((JointConstraint(PATH, VELOCITY, ACCELERATION),), (JointJerkConstraint(PATH, JERK),))


def law_of(speeds, accelerations):
    return QuarticLaw(np.linspace(0, 1, len(speeds)), np.array(speeds, float), np.array(accelerations, float))


MOVING = law_of([0.4, 0.5, 0.55, 0.6, 0.5], [0.1, 0.2, 0.1, -0.1, -0.3])
RESTING = law_of([0.0, 0.5, 0.7, 0.5, 0.0], [0.0, 0.6, 0.1, -0.6, 0.0])


def hermite(law, b, slope):
    """Return Hermite's numbers (4, N): b and h b' at both ends of each interval."""
    return np.stack([b[:-1], law.lengths * slope[:-1], b[1:], law.lengths * slope[1:]])


def rates(law, share, b, slope):
    """Return s, sd, sdd and sddd of the law whose time passes sqrt(b) times as fast, by differences of the old one's time."""
    x, h = share, law.lengths
    at = [
        np.polynomial.Polynomial(each)
        for each in ([1, 0, -3, 2], [0, 1, -2, 1], [0, 0, 3, -2], [0, 0, -1, 1])
    ]
    value, first, second = (
        sum(part * each.deriv(k)(x) for part, each in zip(hermite(law, b, slope), at, strict=True)) / h**k
        for k in range(3)
    )
    s, v, a, u = law.states(share)
    fast = np.sqrt(value)  # d tau / dt; by the chain rule
    quicker = 0.5 * first  # d^2 tau / dt^2
    return (
        s,
        v * fast,
        a * value + v * quicker,
        u * fast**3 + 3 * a * fast * quicker + 0.5 * v * second * fast,
    )


@pytest.mark.parametrize("share", SHARES)
def test_rows_of_velocity_and_acceleration_say_what_the_faster_law_uses(share):
    random = np.random.default_rng(int(10 * share))
    b, slope = 1 + random.uniform(-0.3, 0.5, 5), random.uniform(-0.2, 0.2, 5)
    lowered = 1 + random.uniform(0, 0.5, (3, 4))
    sample = sampled(MOVING, share)
    cap, (rows, left) = _second_order(sample, LIMITS.second[0], lowered)
    change = hermite(MOVING, b - 1, slope)
    s, v, a, _ = rates(MOVING, share, b, slope)
    q1, q2 = (PATH.evaluate(s, k, side=sample.side).T for k in (1, 2))
    used = np.maximum(q1 * v / VELOCITY[:, 1:], q1 * v / VELOCITY[:, :1]).max(axis=0)
    capped = 1 - (cap[1][0] - (cap[0][:, 0] * change).sum(axis=0))
    assert capped == pytest.approx(np.maximum((used * lowered[0]) ** 2, b_at(MOVING, share, b, slope) / 9))
    accelerations = q1 * a + q2 * v**2
    shares = (
        np.concatenate([accelerations / ACCELERATION[:, 1:], accelerations / ACCELERATION[:, :1]])
        * lowered[1]
    )
    assert 1 - (left - np.einsum("kmn,kn->mn", rows, change)) == pytest.approx(shares)


def b_at(law, share, b, slope):
    x = share
    weights = [2 * x**3 - 3 * x**2 + 1, x**3 - 2 * x**2 + x, 3 * x**2 - 2 * x**3, x**3 - x**2]
    return sum(weight * each for weight, each in zip(weights, hermite(law, b, slope), strict=True))


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0])
def test_rows_of_jerk_are_above_what_the_faster_law_uses_and_touch_it_where_nothing_changes(share):
    random = np.random.default_rng(3)
    lowered = 1 + random.uniform(0, 0.5, (3, 4))
    sample = sampled(MOVING, share)
    rows, left = _third_order(sample, LIMITS.third[0], lowered[2])
    for size in (0.3, 1e-3, 5e-4):
        b, slope = 1 + size * random.uniform(-1, 1, 5), size * random.uniform(-1, 1, 5)
        s, v, a, u = rates(MOVING, share, b, slope)
        q1, q2, q3 = (PATH.evaluate(s, k, side=sample.side).T for k in (1, 2, 3))
        jerk = (q1 * u + 3 * q2 * v * a + q3 * v**3) * lowered[2]
        used = np.concatenate([jerk / JERK[:, 1:], jerk / JERK[:, :1]])
        said = 1 - (left - np.einsum("kmn,kn->mn", rows, hermite(MOVING, b - 1, slope)))
        # |L b| <= J b^(-1/2) is kept where its tangent is: what is said of the limit is at least what is used of it
        kept = said <= 1
        assert (used[kept] <= 1 + 1e-12).all()
        root = np.sqrt(b_at(MOVING, share, b, slope))
        assert said == pytest.approx(used / root + 0.5 * (root**2 - 1))


@pytest.mark.parametrize("law", [MOVING, RESTING])
def test_rows_of_nodes_are_those_of_hermite_with_linear_ends_at_rest(law):
    """Where the motion rests b is linear over the interval; where it moves at an end nothing changes there."""
    random = np.random.default_rng(0)
    b, slope = random.uniform(-1, 1, 5), random.uniform(-1, 1, 5)
    h = law.lengths
    scale = np.concatenate([h[:1], 0.5 * (h[1:] + h[:-1]), h[-1:]])
    given_b, given_slope = b.copy(), slope.copy()
    for end, other, way in ((0, 1, -h[0]), (-1, -2, h[-1])):
        rests = law.speed[end] == 0
        given_slope[end] = slope[other] if rests else 0.0
        given_b[end] = b[other] + way * slope[other] if rests else 0.0
    rows = random.uniform(-1, 1, (4, 3, 4))
    of_nodes = _of_nodes(rows, law, scale)
    unknowns = np.stack([b[:-1], scale[:-1] * slope[:-1], b[1:], scale[1:] * slope[1:]])
    direct = np.einsum("kmn,kn->mn", rows, hermite(law, given_b, given_slope))
    assert np.einsum("kmn,kn->mn", of_nodes, unknowns) == pytest.approx(direct)


@pytest.mark.parametrize("law", [MOVING, RESTING])
def test_a_step_is_faster_and_keeps_what_it_may_not_pass(law):
    law = law.slowed(1.4)
    b, slope = faster(law, LIMITS, np.ones((3, 4)), 1e-4, np.inf)
    after = law.changed(b, slope)
    assert after.duration < 0.97 * law.duration
    assert 0.8 < LIMITS.excess(after).max() < 1.05
    lowered = np.full((3, 4), 1.1)
    lower = law.changed(*faster(law, LIMITS, lowered, 1e-4, np.inf))
    assert after.duration < lower.duration < law.duration
    assert (LIMITS.excess(lower) * lowered).max() < 1.05
    if law.speed[0] > 0:
        assert (b[[0, -1]], slope[[0, -1]]) == (pytest.approx(1), pytest.approx(0))


def test_a_step_is_at_most_three_times_as_fast_and_less_by_the_tangent_of_jerk():
    """b <= 9; and J (3 - b) / 2 is left of a limit of jerk that nothing is used of."""
    far = [both(np.full(2, 1e6)) for _ in range(3)]
    second, third = (JointConstraint(PATH, far[0], far[1]),), (JointJerkConstraint(PATH, far[2]),)
    for limits, fastest in ((LawLimits(second, ()), 9.0), (LawLimits(second, third), 3.0)):
        b, slope = faster(RESTING, limits, np.ones((3, 4)), 1e-6, np.inf)
        assert b[1:-1] == pytest.approx(fastest, rel=0.01)
        assert np.abs(slope[1:-1] * RESTING.lengths[1:]).max() < 0.2 * fastest


def test_rows_of_a_step_are_those_of_each_share_of_an_interval():
    """Caps at five control points first, one of which is at each end; then accelerations, and jerks at three places."""
    lowered = 1 + np.random.default_rng(5).uniform(0, 0.5, (3, 4))
    rows, slack = _rows(MOVING, LIMITS, lowered)
    assert rows.shape[1:] == slack.shape == (5 + 5 * 4 + 3 * 4, 4)
    for share, cap in ((0.0, 0), (1.0, 4)):
        caps, others = _second_order(sampled(MOVING, share), LIMITS.second[0], lowered)
        for k in range(4):  # those of an end are among the control points; their order is that of nearness
            np.testing.assert_allclose(rows[:, cap, k], caps[0][:, 0, k], atol=1e-12)
            for row, left in zip(others[0][:, :, k].T, others[1][:, k], strict=True):
                assert (
                    np.abs(np.vstack([rows[:, 5:, k], slack[None, 5:, k]]).T - [*row, left]).max(axis=1).min()
                    < 1e-12
                )
    for share in SHARES:  # control points are those of the quartic through what is sampled
        bernstein = [comb(4, k) * share**k * (1 - share) ** (4 - k) for k in range(5)]
        caps, _ = _second_order(sampled(MOVING, share), LIMITS.second[0], lowered)
        np.testing.assert_allclose(np.einsum("k,ikn->in", bernstein, rows[:, :5]), caps[0][:, 0], atol=1e-12)
        np.testing.assert_allclose(bernstein @ slack[:5], caps[1][0], atol=1e-12)
    for share in (0.0, 0.5, 1.0):
        jerk, left = _third_order(sampled(MOVING, share), LIMITS.third[0], lowered[2])
        for k in range(4):
            for row, each in zip(jerk[:, :, k].T, left[:, k], strict=True):
                assert (
                    np.abs(np.vstack([rows[:, :, k], slack[None, :, k]]).T - [*row, each]).max(axis=1).min()
                    < 1e-12
                )


def test_each_limit_has_its_caps_and_of_all_other_rows_the_nearest_count():
    """Of two limits of acceleration and one of jerk there are 5 + 5 caps, and 52 rows."""
    tighter = JointConstraint(PATH, 0.1 * VELOCITY, 0.1 * ACCELERATION)
    limits = LawLimits((LIMITS.second[0], tighter), LIMITS.third)
    rows, slack = _rows(MOVING, limits, np.ones((3, 4)))
    assert (rows.shape, slack.shape) == ((4, 46, 4), (46, 4))
    for k, constraint in enumerate(limits.second):
        caps, _ = _second_order(sampled(MOVING, 0.0), constraint, np.ones((3, 4)))
        np.testing.assert_allclose(rows[:, 5 * k], caps[0][:, 0], atol=1e-12)
