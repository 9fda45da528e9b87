"""Rows and caps of constraints against the chain rule: at a cap, or on a row, a limit is just met."""

from __future__ import annotations

import numpy as np
import pytest
from hermite_curves import hermite_pieces
from topp_paths import polyline, random_bounds, spline

from trajcli.curves.approach import ApproachLimits
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.constraints import (
    ApproachConstraint,
    JointConstraint,
    corners,
    is_at_rest,
)
from trajcli.curves.time_optimal.time_law import law_pieces

S = np.linspace(0.0, 1.0, 41)


def joints(seed, n=3):
    rng = np.random.default_rng(seed)
    path = spline(rng.uniform(-1, 1, (7, n)))
    return path, *random_bounds(rng, n)


@pytest.mark.parametrize("seed", range(4))
def test_at_its_cap_one_joint_has_its_limit_of_velocity(seed):
    path, velocity, acceleration = joints(seed)
    rows = JointConstraint(path, velocity, acceleration).rows(S, "right")
    qd = path.evaluate(S, 1) * np.sqrt(rows.cap)[:, None]
    share = np.maximum(qd / velocity[:, 1], qd / velocity[:, 0]).max(axis=1)
    np.testing.assert_allclose(share, 1.0, rtol=1e-12)


@pytest.mark.parametrize("seed", range(4))
def test_a_row_is_met_where_a_joint_has_its_limit_of_acceleration(seed):
    """Of each row: u that meets it with x makes the joint's acceleration its limit, by the second derivative of q(s(t))."""
    path, velocity, acceleration = joints(seed)
    acceleration[0, 1], acceleration[2, 0] = np.inf, -np.inf
    rows = JointConstraint(path, velocity, acceleration).rows(S[1:-1], "right")
    assert rows.a.shape == rows.b.shape == rows.c.shape == (39, 4)
    owners, limits = [1, 2, 0, 1], [*acceleration[1:, 1], *acceleration[:2, 0]]
    for k, (joint, limit) in enumerate(zip(owners, limits, strict=True)):
        x = 0.7
        u = (rows.c[:, k] - rows.b[:, k] * x) / rows.a[:, k]
        for s, each in zip(S[1:-1], u, strict=True):
            # s(t) = s + sd t + u t^2 / 2 around t = 0
            here = path.evaluate(np.array([s]), 1)[0] * each + path.evaluate(np.array([s]), 2)[0] * x
            assert here[joint] == pytest.approx(limit, rel=1e-9)
    one = JointConstraint(path, velocity, np.full((3, 2), np.inf) * [-1, 1])
    assert not one.bounds_sdd
    assert JointConstraint(path, velocity, acceleration).bounds_sdd


@pytest.mark.parametrize(("slope", "rests"), [(1e-15, True), (-1e-15, True), (1e-9, False), (-1e-9, False)])
@pytest.mark.parametrize("joint", [0, 1])
def test_a_joint_that_rounding_alone_moves_has_no_acceleration_by_it(joint, slope, rests):
    """The other joint goes from 0 to 1: a ten trillionth of that is what rounding leaves of rest."""
    slopes = np.array([1.0, 1.0])
    slopes[joint] = slope
    path = PiecewisePolynomial(np.array([0.0, 1.0]), np.stack([slopes, [0.0, 0.0]])[:, None])
    bounds = np.tile([-1.0, 1.0], (2, 1))
    wanted = np.where(slopes == slope, 0.0 if rests else slope, slopes)
    rows = JointConstraint(path, bounds, bounds).rows(S, "right")
    np.testing.assert_array_equal(rows.a, np.tile(np.append(wanted, -wanted), (S.size, 1)))


@pytest.mark.parametrize("side", ["left", "right"])
def test_rows_at_a_corner_are_those_of_its_side(side):
    path = polyline([[0.0], [1.0], [-1.0]])
    corner = path.breaks[1:2]
    constraint = JointConstraint(path, np.array([[-0.5, 2.0]]), np.array([[-9.0, 9.0]]))
    rows = constraint.rows(corner, side)
    slope = path.evaluate(corner, 1, side=side)[0, 0]
    assert rows.cap[0] ** 0.5 * abs(slope) == pytest.approx(2.0 if side == "left" else 0.5)
    assert constraint.largest(corner, side).tolist() == rows.cap.tolist()


@pytest.mark.parametrize("side", ["left", "right"])
def test_caps_of_approaches_at_a_corner_are_those_of_its_side(side):
    """At 1 the joint is 0.5 below the end that it comes from, and 3 above the one to which it turns back."""
    path = polyline([[0.0], [1.0], [-1.0]])
    corner = path.breaks[1:2]
    limits = ApproachLimits(np.array([[-2.0, 1.5]]), np.array([4.0]), np.array([0.0]))
    rows = ApproachConstraint(path, limits).rows(corner, side)
    slope = abs(path.evaluate(corner, 1, side=side)[0, 0])
    wanted = (2 * 4.0 * (0.5 if side == "left" else 3.0)) ** 0.5
    assert rows.cap[0] ** 0.5 * slope == pytest.approx(wanted, rel=1e-6)
    assert ApproachConstraint(path, limits).largest(corner, side).tolist() == rows.cap.tolist()


def test_no_motion_is_faster_than_the_shortest_times():
    """One along the path at nearly any speed keeps limits that are wide enough."""
    path, velocity, acceleration = joints(0)
    limits = ApproachLimits(np.tile([-9.0, 9.0], (3, 1)), np.full(3, 1e12), np.zeros(3))
    for constraint in (
        JointConstraint(path, 1e6 * velocity, 1e12 * acceleration),
        ApproachConstraint(path, limits),
    ):
        law = law_pieces(S, np.full(S.size, 1e6))
        assert constraint.excess(law).max() < 1.0
        assert (constraint.shortest(S) <= law.durations).all()
        assert constraint.shortest(S).shape == (S.size - 1,)


def test_wrong_bounds_are_refused():
    path, velocity, acceleration = joints(0)
    for wrong in (velocity[:2], velocity * [0, 1], velocity * [1, 0], -velocity):
        with pytest.raises(ValueError, match="velocity bounds must be 3 pairs"):
            JointConstraint(path, wrong, acceleration)
        with pytest.raises(ValueError, match="acceleration bounds must be 3 pairs"):
            JointConstraint(path, velocity, wrong)


def a_law(seed, size=2.0):
    """Return pieces of a law on [0, 1] that is nobody's solution, with constant sdd in each."""
    rng = np.random.default_rng(seed)
    grid = np.linspace(0.0, 1.0, 61)
    x = rng.uniform(0.3, 3.0, 61) * size
    x[[0, -1]] = 0.0
    return law_pieces(grid, x)


@pytest.mark.parametrize("seed", range(4))
def test_where_velocity_alone_is_limited_its_excess_is_that_between_grid_points(seed):
    """With acceleration unlimited, and with one that says little: the largest of 2001 times of each piece."""
    path, velocity, _ = joints(seed)
    law = a_law(seed)
    t = np.linspace(0.0, 1.0, 2001)[:, None] * law.durations
    s = np.array([np.polyval(row, column) for row, column in zip(law.coefficients.T, t.T, strict=True)])
    sd = np.array(
        [np.polyval(np.polyder(row), column) for row, column in zip(law.coefficients.T, t.T, strict=True)]
    )
    qd = path.evaluate(np.clip(s, 0, 1).reshape(-1), 1).reshape(*s.shape, 3) * sd[..., None]
    used = np.maximum(qd / velocity[:, 1], qd / velocity[:, 0]).max(axis=(1, 2))
    scale = np.median(used)  # so that half of the pieces are too fast
    for acceleration in (np.inf, 1e4):
        bounds = np.tile([-acceleration, acceleration], (3, 1))
        excess = JointConstraint(path, velocity * scale, bounds).excess(law)[0]
        over = used > scale
        assert 5 < over.sum() < 55
        assert (excess[over] >= used[over] / scale * (1 - 1e-9)).all()
        assert (excess[over] <= used[over] / scale * 1.2).all()
        assert (excess[~over] <= 1.1).all()


def allowed(position, limits, joint):
    """Return the most negative and the largest velocity of a joint at positions, by the formula of the limit."""
    low, high = limits.position[joint]
    down, up = (
        np.maximum(np.sqrt(2 * limits.deceleration[joint] * np.maximum(x, 0.0)) - limits.offset[joint], 0.0)
        for x in (position - low, high - position)
    )
    return -down, up


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("seed", range(3))
def test_caps_of_approaches_are_the_limit_of_the_joint_that_comes_nearest(seed, sign):
    path, _, _ = joints(seed)
    path = PiecewisePolynomial(path.breaks, sign * path.coefficients)
    limits = ApproachLimits(
        np.array([[-1.6, 1.5], [-1.5, 1.8], [-9.0, 9.0]]),
        np.array([2.0, 5.0, np.inf]),
        np.array([0.05, 0.1, 0.0]),
    )
    rows = ApproachConstraint(path, limits).rows(S, "right")
    q, qd = path.evaluate(S), path.evaluate(S, 1) * np.sqrt(rows.cap)[:, None]
    shares = []
    for joint in (0, 1):
        low, high = allowed(q[:, joint], limits, joint)
        shares.append(np.where(qd[:, joint] > 0, qd[:, joint] / high, qd[:, joint] / low))
    np.testing.assert_allclose(np.max(shares, axis=0), 1.0, rtol=1e-6)
    assert rows.a.shape == rows.b.shape == rows.c.shape == (41, 0)


@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("sign", [1, -1])
def test_the_excess_of_approaches_is_that_of_dense_times(sign, joint):
    """By the second joint too, in both directions, in every piece; what exceeds the limit must last so much longer."""
    path, _, _ = joints(5, 2)
    path = PiecewisePolynomial(path.breaks, sign * path.coefficients)
    limits = ApproachLimits(np.tile([-1.9, 1.7], (2, 1)), np.full(2, np.inf), np.zeros(2))
    limits = ApproachLimits(limits.position, np.where(np.arange(2) == joint, 2.0, np.inf), np.full(2, 0.02))
    law = a_law(3)
    excess = ApproachConstraint(path, limits).excess(law)
    t = np.linspace(0.0, 1.0, 801)[:, None] * law.durations
    for k, (row, times) in enumerate(zip(law.coefficients.T, t.T, strict=True)):
        s, sd = (np.polyval(np.polyder(row, order), times) for order in (0, 1))
        q, qd = path.evaluate(np.clip(s, 0, 1))[:, joint], path.evaluate(np.clip(s, 0, 1), 1)[:, joint] * sd
        low, high = allowed(q, limits, joint)
        used = np.where(qd > 0, qd / high, qd / low).max()
        if used > 1.0:
            assert excess[0, k] == pytest.approx(used, rel=1e-4)
        else:
            assert excess[0, k] <= 1.0
    assert not excess[1].any()
    assert (excess[0] > 1.0).sum() > 5


@pytest.mark.parametrize("at_end", [False, True])
@pytest.mark.parametrize("still", [False, True])
def test_a_path_is_at_rest_where_its_derivative_vanishes(at_end, still):
    """q = s^2 from 0 on; with 1e-6 of its rate more it is not at rest, nor where one of two joints moves."""
    coefficients = np.array([[[1.0, 0.5]], [[0.0, 0.0 if still else 1e-6]], [[0.0, 0.0]]])
    path = PiecewisePolynomial(np.array([0.0, 1.0]), coefficients)
    if at_end:
        mirrored = np.array([[[1.0, 0.5]], [[-2.0, -1.0 - (0.0 if still else 1e-6)]], [[1.0, 0.5]]])
        path = PiecewisePolynomial(np.array([0.0, 1.0]), mirrored)
    assert is_at_rest(path) == ((not at_end) and still, at_end and still)


@pytest.mark.parametrize("rests", range(3))
def test_of_many_pieces_the_first_and_the_last_end_count(rests):
    """Cubics of which one end or both ends are at rest, and all others move."""
    rates = np.array([[0.0, 1.0, 2.0, 3.0], [3.0, 0.0, 0.0, 2.0], [3.0, 2.0, 1.0, 0.0]])[rests]
    values = np.stack([np.cumsum(rates), rates])[:, :, None]
    path = hermite_pieces(np.arange(4.0), values)
    assert is_at_rest(path) == (rests == 0, rests == 2)


def test_a_joint_that_hardly_moves_has_no_corner_by_rounding():
    """The second joint jumps by 1e-14 of the first one's rate: its own rate, but nothing of the motion."""
    values = np.array([[1.0, 1e-14], [1.0, -1e-14], [1.0, 0.0]])
    path = PiecewisePolynomial(np.arange(4.0), np.stack([values, np.arange(3.0)[:, None] * [1.0, 0.0]]))
    assert corners(path).size == 0


@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("jump", [1e-3, -1e-3, 2.0])
def test_corners_are_the_breaks_at_which_a_rate_jumps(joint, jump):
    """Also back to front: the rate is the same at breaks 1 and 3, and jumps at 2 only."""
    rates = np.tile([1.0, -0.5], (4, 1))
    rates[2:, joint] += jump
    starts = np.concatenate([np.zeros((1, 2)), np.cumsum(rates[:-1], axis=0)])
    path = PiecewisePolynomial(np.arange(5.0), np.stack([rates, starts]))
    np.testing.assert_array_equal(corners(path), [2.0])


def test_a_rate_that_turns_around_smoothly_is_no_corner():
    path = PiecewisePolynomial(
        np.array([0.0, 1.0, 2.0]), np.array([[[-1.0], [-1.0]], [[2.0], [0.0]], [[0.0], [1.0]]])
    )
    assert corners(path).size == 0


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("joint", [0, 1])
def test_a_speed_between_its_ends_is_seen_whatever_another_joint_may_do(joint, side):
    """0.9 at both ends and 1.2 between them, as 0.9 + 1.2 t (1 - t), with little of an acceleration of 100.

    The other joint rests, and may hardly accelerate; of both directions one has more room.
    """
    coefficients = np.zeros((4, 2, 1))
    coefficients[:, joint, 0] = side * np.array([-0.4, 0.6, 0.9, 0.0])
    velocity = np.tile([-1.0, 1.0], (2, 1))
    acceleration = np.tile([-0.1, 0.1], (2, 1))
    acceleration[joint] = [-100.0, 100.0]
    path = PiecewisePolynomial(np.array([0.0, 1.0]), np.zeros((1, 1, 2)))
    constraint = JointConstraint(path, velocity, acceleration)
    (used, _) = constraint._excess(coefficients, np.ones(1))
    assert 1.2 - 1e-9 <= used[0] <= 1.6
    velocity[joint] = [-1.0, 9.0] if side > 0 else [-9.0, 1.0]
    assert JointConstraint(path, velocity, acceleration)._excess(coefficients, np.ones(1))[0][0] < 1.0


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("roomy", [1.0, 90.0])
@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("joint", [0, 1])
def test_a_speed_that_rises_slowly_and_falls_fast_is_seen(joint, backwards, roomy, side):
    """0.9 + 0.18 (t - t^8) is 1.017 where t^7 is 1/8, more than half of its slope at the start would add.

    The direction in which nothing moves may have far more room; the other joint rests.
    """
    rates = np.zeros(9)
    rates[[0, 7, 8]] = -0.18, 0.18, 0.9
    if backwards:
        rates = np.array(np.poly1d(rates)(np.poly1d([-1.0, 1.0])).coeffs)
    coefficients = np.zeros((10, 2, 1))
    coefficients[:, joint, 0] = side * np.polyint(rates)
    velocity = np.tile([-1.0, 1.0], (2, 1))
    velocity[joint] = [-roomy, 1.0] if side > 0 else [-1.0, roomy]
    path = PiecewisePolynomial(np.array([0.0, 1.0]), np.zeros((1, 1, 2)))
    constraint = JointConstraint(path, velocity, np.tile([-9.0, 9.0], (2, 1)))
    largest = 0.9 + 0.18 * 7 / 8 * 8 ** (-1 / 7)
    assert largest - 1e-12 <= constraint._excess(coefficients, np.ones(1))[0, 0] <= 1.1


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("at_end", [False, True])
def test_rest_up_to_rounding_is_rest_at_either_end_of_a_path_in_either_direction(at_end, sign):
    """q' goes from 1e-17 to 1, or back."""
    rising = np.array([[[0.5]], [[1e-17]], [[0.0]]])
    falling = np.array([[[-0.5]], [[1.0 + 1e-17]], [[0.0]]])
    path = PiecewisePolynomial(np.array([0.0, 1.0]), sign * (falling if at_end else rising))
    assert is_at_rest(path) == (not at_end, at_end)


@pytest.mark.parametrize("backwards", [False, True])
def test_a_rate_is_none_beside_the_largest_at_either_end_of_a_piece(backwards):
    """From 1 to 1e-10 in one piece, or back: a ten billionth of the largest is rest."""
    rates = np.array([1e-10, 1.0] if backwards else [1.0, 1e-10])
    rows = np.array([(rates[1] - rates[0]) / 2, rates[0], 0.0])[:, None, None]
    assert is_at_rest(PiecewisePolynomial(np.array([0.0, 1.0]), rows)) == (backwards, not backwards)


def test_what_is_looked_at_block_by_block_is_the_same_as_at_once(monkeypatch):
    path, velocity, acceleration = joints(2)
    limits = ApproachLimits(np.tile([-1.9, 1.7], (3, 1)), np.full(3, 2.0), np.full(3, 0.02))
    law = a_law(3)
    for constraint in (JointConstraint(path, velocity, acceleration), ApproachConstraint(path, limits)):
        at_once = constraint.excess(law)
        with monkeypatch.context() as patched:
            patched.setattr("trajcli.curves.time_optimal.time_law._BLOCK", 7)
            np.testing.assert_allclose(constraint.excess(law), at_once, rtol=1e-12)
        assert at_once[0, 40:].max() > 0.1


def test_where_nothing_may_move_the_excess_is_a_number():
    """The joint goes on beyond the end of its range, where it may not move at all."""
    path = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([1.0, 0.0])[:, None, None])
    limits = ApproachLimits(np.array([[-1.0, 0.5]]), np.array([1.0]), np.array([0.0]))
    excess = ApproachConstraint(path, limits).excess(law_pieces(np.linspace(0, 1, 11), np.ones(11)))[0]
    assert np.isfinite(excess).all()
    assert (excess[5:] >= 100.0).all()
    assert (excess <= 1e3).all()
