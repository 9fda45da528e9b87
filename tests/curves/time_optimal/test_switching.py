"""The switching structure against closed forms and the definition."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from topp_paths import polyline, random_bounds, spline, symmetric

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.parameterization import time_optimal
from trajcli.curves.time_optimal.phase_plane import switching_structure


def listed(found):
    return [(b.joint, b.quantity, b.sign) for b in found]


def test_a_trapezoid():
    path = polyline([[0.0, 0.0], [-3.0, 1.0]])
    velocity, acceleration = symmetric(1.0, 2.0), np.array([[-2.0, 1.0], [-9.0, 9.0]])
    found = switching_structure(time_optimal(path, velocity, acceleration).trajectory, velocity, acceleration)
    assert listed(found) == [(0, "acceleration", -1), (0, "velocity", -1), (0, "acceleration", 1)]
    times = [(b.start, b.end) for b in found]
    np.testing.assert_allclose(times, [(0, 0.5), (0.5, 2.75), (2.75, 3.75)], atol=1e-8)


def test_the_joint_that_binds_changes_at_a_corner():
    path = polyline([[0.0, 0.0], [1.0, 0.2], [1.2, 1.2]])
    velocity, acceleration = symmetric(9.0, 9.0), symmetric(1.0, 1.0)
    found = switching_structure(time_optimal(path, velocity, acceleration).trajectory, velocity, acceleration)
    assert listed(found) == [(j, "acceleration", sign) for j in (0, 1) for sign in (1, -1)]
    np.testing.assert_allclose([b.end for b in found], [1, 2, 3, 4], atol=1e-8)


@pytest.mark.parametrize("seed", range(4))
def test_a_limit_binds_where_it_is_said_to(seed):
    rng = np.random.default_rng(seed)
    path, (velocity, acceleration) = spline(rng.uniform(-1, 1, (6, 3))), random_bounds(rng, 3)
    trajectory = time_optimal(path, velocity, acceleration).trajectory
    found = switching_structure(trajectory, velocity, acceleration)
    middles = (trajectory.breaks[1:] + trajectory.breaks[:-1]) / 2
    bound = {"velocity": (1, velocity), "acceleration": (2, acceleration)}
    used = []
    for b in found:
        t = middles[(middles > b.start) & (middles < b.end)]
        order, bounds = bound[b.quantity]
        share = trajectory.evaluate(t, order)[:, b.joint] / bounds[b.joint, (b.sign + 1) // 2]
        assert share.min() >= 0.9
        used += share.tolist()
    assert np.mean(used) >= 0.98
    assert all(a.end <= b.start for a, b in pairwise(found))
    assert sum(b.end - b.start for b in found) >= 0.9 * trajectory.duration


def test_of_two_limits_at_once_the_first_stays():
    halves = np.array(
        [[0.5, 0.5 + 1e-3 * (-1) ** k] for k in range(10)]
    )  # of the accelerations of ten pieces
    curve = PiecewisePolynomial(np.arange(11.0), np.stack([halves, 0 * halves, 0 * halves]))
    found = switching_structure(curve, symmetric(9, 9), symmetric(1, 1))
    assert [(b.start, b.end, b.joint) for b in found] == [(0.0, 10.0, 1)]


def of_jerks(*jerks):
    """Return a motion whose joints have these jerks (n,), one after the other for a second each, from rest."""
    rows, state = [], np.zeros((3, len(jerks[0])))
    for jerk in np.array(jerks, dtype=float):
        q, v, a = state
        rows.append([jerk / 6, a / 2, v, q])
        state = np.array([q + v + a / 2 + jerk / 6, v + a + jerk / 2, a + jerk])
    return PiecewisePolynomial(np.arange(len(jerks) + 1.0), np.array(rows).transpose(1, 0, 2))


def test_limits_of_jerk_bind_in_either_direction():
    """Of [-2, 1] and [-1, 4]: a jerk of 1 binds the first joint, -1 the second alone, 4 and -2 both."""
    curve = of_jerks([1, -0.5], [-1, -1], [0.5, 4], [-2, 0], [0.9, -0.9])
    jerk = np.array([[-2.0, 1.0], [-1.0, 4.0]])
    found = switching_structure(curve, symmetric(99, 99), symmetric(99, 99), jerk)
    assert listed(found) == [(0, "jerk", 1), (1, "jerk", -1), (1, "jerk", 1), (0, "jerk", -1)]
    assert [(b.start, b.end) for b in found] == [(0, 1), (1, 2), (2, 3), (3, 4)]
    assert switching_structure(curve, symmetric(99, 99), symmetric(99, 99)) == []


@pytest.mark.parametrize("jerk", [None, symmetric(99, 99)])
def test_limits_of_efforts_bind_beside_the_others(jerk):
    """Shares of the upper limits of both joints, then of the lower ones; the velocity of joint 0 binds at last."""
    curve = PiecewisePolynomial(np.arange(6.0), np.array([[[0.5, 0.1]] * 4 + [[3.0, 0.0]], np.zeros((5, 2))]))
    efforts = np.array([[1, 0, 0, 0], [0, 0.99, 0, 0], [0, 0, 0.96, 0], [0, 0, 0, 1], [0.2, 0, 0, 0]], float)
    found = switching_structure(curve, symmetric(3, 9), symmetric(9, 9), jerk, efforts)
    assert listed(found) == [
        (0, "effort", 1),
        (1, "effort", 1),
        (0, "effort", -1),
        (1, "effort", -1),
        (0, "velocity", 1),
    ]


def test_a_limit_is_used_by_the_mean_of_both_ends_of_a_piece():
    """An acceleration from 0.88 of its limit to 1.04, or back, binds; from 0.8 to 1.06, or back, it does not."""
    for ends, binds in (((0.88, 1.04), True), ((0.8, 1.06), False)):
        for first, last in (ends, ends[::-1]):
            piece = np.array([(last - first) / 6, first / 2, 0.0, 0.0])[:, None, None]
            curve = PiecewisePolynomial([0.0, 1.0], piece)
            assert bool(switching_structure(curve, symmetric(9), symmetric(1))) is binds


def test_one_limit_that_is_nearer_by_more_takes_over():
    """Both bind; the second one is nearer by half a hundredth, then by two hundredths."""
    halves = 0.5 * np.array([[1.0, 0.96], [0.97, 0.975], [0.97, 0.99], [0.98, 0.985]])
    curve = PiecewisePolynomial(np.arange(5.0), np.stack([halves, 0 * halves, 0 * halves]))
    found = switching_structure(curve, symmetric(99, 99), symmetric(1, 1))
    assert [(b.joint, b.start, b.end) for b in found] == [(0, 0.0, 2.0), (1, 2.0, 4.0)]


@pytest.mark.parametrize(
    ("shares", "wanted"),
    [
        (
            [[0.97, 0.9], [0.946, 0.955]],
            [(0, 0.0, 1.0), (1, 1.0, 2.0)],
        ),  # what does not bind any more does not stay
        ([[1.0, 0.1], [0.94, 0.1]], [(0, 0.0, 1.0)]),
        ([[0.94, 0.1], [0.96, 0.1], [0.94, 0.1]], [(0, 1.0, 2.0)]),
    ],
)
def test_a_limit_binds_no_longer_than_it_is_used(shares, wanted):
    """To 95 of 100, whether another one is used as far or not."""
    halves = 0.5 * np.array(shares)
    curve = PiecewisePolynomial(np.arange(len(shares) + 1.0), np.stack([halves, 0 * halves, 0 * halves]))
    found = switching_structure(curve, symmetric(99, 99), symmetric(1, 1))
    assert [(b.joint, b.start, b.end) for b in found] == wanted
