"""Rows and excess of limits of jerk against the third derivative of q(s(t)), and breaks at which curvature jumps."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.third_order.jerk import JointJerkConstraint, LawJerkConstraint, curvature_jumps
from trajcli.curves.time_optimal.time_law import LawPieces

JERK = np.array([[-3.0, 8.0], [-np.inf, 5.0], [-2.0, np.inf], [-np.inf, np.inf]])


def path_of(seed, degree=4, pieces=3, joints=4):
    rng = np.random.default_rng(seed)
    return PiecewisePolynomial(
        np.linspace(0.0, 1.0, pieces + 1), rng.normal(size=(degree + 1, pieces, joints))
    )


def law_of(seed, path, each=5):
    """Return a law s(t), increasing, of degree 4, whose breaks hold those of the path."""
    rng = np.random.default_rng(seed)
    s = np.linspace(0.0, 1.0, path.pieces * each + 1)
    columns, durations = [], []
    for begin, end in pairwise(s):
        row = rng.normal(size=4) * np.array([0.02, 0.05, 0.2, 0.0]) + np.array([0, 0, 0, 1.0])
        h = (end - begin) / np.polyval([*row, 0.0], 1.0)
        columns.append([h * row[0], h * row[1], h * row[2], h * row[3], begin])
        durations.append(1.0)
    return LawPieces(np.array(durations), np.array(columns).T)


def jerk_at(path, law, piece, times):
    """Return the third derivative of q(s(t)) at times (k,) of a piece by numpy's own polynomials, (k, n)."""
    row = np.poly1d(law.coefficients[:, piece])
    owner = piece // 5
    values = []
    for column in path.coefficients[:, owner].T:
        inner = np.poly1d(column)(row - path.breaks[owner])
        values.append(np.polyval(np.polyder(np.poly1d(inner).coeffs, 3), times))
    return np.array(values).T


def about(s):
    """Return a law at rest at s (p,): the rows of these limits are the same about every law."""
    return (np.array(s), *np.zeros((3, len(s))))


@pytest.mark.parametrize("side", ["left", "right"])
def test_rows_are_the_third_derivative_by_the_chain_rule(side):
    """s(t) = s + v t + a t^2 / 2 + u t^3 / 6: the jerk of q(s(t)) at t = 0, for both bounds of each joint."""
    path, s, (v, a, u) = path_of(1), np.array([0.1, 1 / 3, 0.7]), (0.8, -0.5, 1.3)
    rows = JointJerkConstraint(path, JERK).rows(about(s), side)
    found = rows.first * u + 3 * rows.second * v * a + rows.third * v**3
    assert found.shape == rows.limit.shape == (3, 4)
    for k, at in enumerate(s):
        piece = int(np.searchsorted(path.breaks, at, side)) - 1
        law = np.poly1d([u / 6, a / 2, v, at - path.breaks[piece]])
        jerks = [np.poly1d(column)(law).deriv(3)(0.0) for column in path.coefficients[:, piece].T]
        np.testing.assert_allclose(found[k], [jerks[0], jerks[1], -jerks[0], -jerks[2]], rtol=1e-9)
    np.testing.assert_array_equal(rows.limit, np.tile([8.0, 5.0, 3.0, 2.0], (3, 1)))


@pytest.mark.parametrize("seed", range(4))
def test_the_excess_of_joints_is_above_dense_times_and_near_to_them(seed):
    path = path_of(seed, degree=3)
    law = law_of(seed, path)
    excess = JointJerkConstraint(path, JERK).excess(law)
    times = np.linspace(0.0, 1.0, 401)
    for piece, found in enumerate(excess):
        jerk = jerk_at(path, law, piece, times)
        used = np.maximum(jerk / JERK[:, 1], jerk / JERK[:, 0]).max()
        assert used * (1 - 1e-9) <= found <= used * 1.3 + 0.02
    free = JointJerkConstraint(path, np.tile([-np.inf, np.inf], (4, 1))).excess(law)
    assert not free.any()


@pytest.mark.parametrize("sign", [1, -1])
def test_the_excess_of_a_law_is_its_own_third_derivative(sign):
    """s''' = 24 c4 t + 6 c3, largest at one end of each piece, of either sign."""
    columns = sign * np.array([[0.5, -0.2], [-0.3, 0.1], [0.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    law = LawPieces(np.array([0.7, 1.3]), columns)
    ends = np.abs([6 * columns[1], 24 * columns[0] * law.durations + 6 * columns[1]]).max(axis=0)
    np.testing.assert_allclose(LawJerkConstraint(4.0).excess(law), ends / 4.0)
    rows = LawJerkConstraint(4.0).rows(about([0.1, 0.5, 0.9]), "left")
    np.testing.assert_array_equal(rows.first, np.tile([1.0, -1.0], (3, 1)))
    assert rows.second.shape == rows.third.shape == rows.limit.shape == (3, 2)
    assert not np.concatenate([rows.second, rows.third]).any()
    assert (rows.limit == 4.0).all()


@pytest.mark.parametrize("wrong", [[[0.0, 1.0]], [[-1.0, 0.0]], [[1.0, -1.0]], [[-1.0, 1.0], [-1.0, 1.0]]])
def test_wrong_bounds_are_refused(wrong):
    with pytest.raises(ValueError, match="jerk bounds must be"):
        JointJerkConstraint(path_of(0, joints=1), np.array(wrong))


def bending(jumps, rate=1.0):
    """Return q(s) of as many joints as jumps, (k, n) of q'' at the inner breaks, with continuous q and q'."""
    bends = np.cumsum(np.concatenate([np.full((1, jumps.shape[1]), 1.0), jumps]), axis=0) / 2
    value, slope, rows = np.zeros(jumps.shape[1]), np.full(jumps.shape[1], rate), []
    for bend in bends:
        rows.append([bend, slope, value])
        value, slope = value + slope + bend, slope + 2 * bend
    return PiecewisePolynomial(np.arange(len(bends) + 1.0), np.array(rows).transpose(1, 0, 2))


@pytest.mark.parametrize("jump", [1e-3, -1e-3, -1.0])
@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("at", [0, 2])
def test_curvature_jumps_where_a_joint_with_a_limit_of_jerk_has_one(jump, joint, at):
    jumps = np.zeros((3, 2))
    jumps[at, joint] = jump
    path, both = bending(jumps), np.tile([-5.0, 5.0], (2, 1))
    np.testing.assert_array_equal(curvature_jumps(path, both), [at + 1.0])
    one, free = both.copy(), both.copy()
    one[joint, 0] = -np.inf  # one bound is enough
    np.testing.assert_array_equal(curvature_jumps(path, one), [at + 1.0])
    free[joint] = -np.inf, np.inf
    assert curvature_jumps(path, free).size == 0


@pytest.mark.parametrize("sign", [1, -1])
def test_what_rounding_leaves_is_no_jump(sign):
    """Of its own largest curvature, of that of another joint, and of the rate of a path that is nearly straight."""
    both = np.tile([-5.0, 5.0], (2, 1))
    assert curvature_jumps(bending(sign * np.array([[3e-7, 0.0]])), both).size == 0
    assert curvature_jumps(bending(sign * np.array([[3e-6, 0.0]])), both).size == 1
    straight = bending(np.array([[1e-9 * sign]]), rate=10.0)
    still = PiecewisePolynomial(straight.breaks, straight.coefficients * [[[1e-9]], [[1.0]], [[1.0]]])
    assert curvature_jumps(still, both[:1]).size == 0


@pytest.mark.parametrize("sign", [1, -1])
def test_where_a_path_lies_says_nothing_about_its_bends(sign):
    """A slide a thousand kilometres away jumps as one at home does, and one that does not there does not here."""
    both = np.array([[-5.0, 5.0]])
    for jump, found in ((1e-4 * sign, 1), (1e-9 * sign, 0)):
        path = bending(np.array([[jump]]))
        for away in (0.0, 1e6):
            coefficients = path.coefficients.copy()
            coefficients[-1] += away - coefficients[-1, :1]
            assert curvature_jumps(PiecewisePolynomial(path.breaks, coefficients), both).size == found


@pytest.mark.parametrize("last", [True, False])
@pytest.mark.parametrize("sign", [1, -1])
def test_the_larger_end_of_a_piece_counts(sign, last):
    """s''' goes from 6 to 1, or from 1 to 6."""
    slope = (-5.0 if last else 5.0) / 24.0
    columns = sign * np.array([[slope], [1.0 if last else 1 / 6], [0.0], [1.0], [0.0]])
    np.testing.assert_allclose(LawJerkConstraint(4.0).excess(LawPieces(np.ones(1), columns)), [1.5])


@pytest.mark.parametrize("wrong", [[[-1.0, 1.0], [0.0, 1.0]], [[-1.0, 0.0], [-1.0, 1.0]]])
def test_bounds_of_every_joint_are_looked_at(wrong):
    with pytest.raises(ValueError, match="jerk bounds must be"):
        JointJerkConstraint(path_of(0, joints=2), np.array(wrong))


def test_a_jump_is_one_of_a_joint_by_its_own_curvature():
    """One that bends a ten thousandth as much as the other has a jump of a ten thousandth of its own."""
    both = np.tile([-5.0, 5.0], (2, 1))
    path = bending(np.array([[0.0, 1e-4]]))
    small = PiecewisePolynomial(path.breaks, path.coefficients * np.array([1.0, 1e-4]))
    np.testing.assert_array_equal(curvature_jumps(small, both), [1.0])


@pytest.mark.parametrize("at_end", [True, False])
def test_the_largest_curvature_may_stand_at_either_end_of_a_piece(at_end):
    """q'' is 1, at one outer end 1000: a jump of 1e-4 is rounding of that."""
    slow, fast = [0.0, 0.5], [999.0 / 6, 0.5] if at_end else [-999.0 / 6, 500.0]
    pair = [slow, fast] if at_end else [fast, slow]
    rows = np.zeros((4, 2, 1))
    rows[:2, :, 0] = np.array(pair).T
    rows[1, 1] += 0.5e-4
    assert curvature_jumps(PiecewisePolynomial(np.arange(3.0), rows), np.array([[-5.0, 5.0]])).size == 0
    rows[1, 1] += 0.5e-2
    assert curvature_jumps(PiecewisePolynomial(np.arange(3.0), rows), np.array([[-5.0, 5.0]])).size == 1
