"""Speeds between grid points: paths on which they peak there, judged by dense rows."""

from __future__ import annotations

import numpy as np
import pytest
from topp_paths import random_bounds, spline, symmetric

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.parameterization import time_optimal

WIDE = [-0.448, 0.592, -3.941, -0.922, 0.34, -0.161]
OTHER = [-0.359, -0.104, 0.683, 0.761, -0.633, 0.846]


@pytest.mark.parametrize(
    ("powers", "velocity", "acceleration"), [(WIDE, 0.07, 28.429), (OTHER, 0.028, 9.034)]
)
def test_a_joint_that_may_accelerate_hard_keeps_its_speed_where_it_turns(powers, velocity, acceleration):
    """It goes at its largest speed but for ramps, each of which costs v / 2a: at the ends, and before and after turns."""
    path = PiecewisePolynomial([0.0, 1.0], np.array(powers)[:, None, None])
    found = time_optimal(path, symmetric(velocity), symmetric(acceleration)).trajectory
    s = np.linspace(0.0, 1.0, 100_001)
    length = np.abs(np.diff(np.polyval(powers, s))).sum()
    turns = np.count_nonzero(np.diff(np.sign(np.diff(np.polyval(powers, s)))))
    exact = length / velocity + (1 + turns) * velocity / acceleration
    t = np.linspace(0.0, 1.0, 101)
    rates = [
        np.polyval(np.polyder(row), t * h)
        for row, h in zip(found.coefficients[:, :, 0].T, found.lengths, strict=True)
    ]
    assert np.abs(rates).max() <= velocity * (1 + 1e-9)
    assert exact * (1 - 1e-5) <= found.duration <= 1.005 * exact


def largest(row, length):
    """Return the largest and the smallest value of a polynomial from 0 to `length`, by numpy's roots."""
    turns = np.roots(np.polyder(row))
    turns = turns.real[(np.abs(turns.imag) < 1e-9) & (turns.real > 0) & (turns.real < length)]
    values = np.polyval(row, np.concatenate([[0.0, length], turns]))
    return values.max(), values.min()


@pytest.mark.parametrize("seed", [88, 438, 746])
def test_limits_are_kept_by_a_tenth_of_what_the_checks_allow(seed):
    """What is verified within a billionth is planned within less, so that rounding on the way does not matter."""
    rng = np.random.default_rng(seed)
    path = spline(rng.uniform(-1, 1, (4, 2)))
    bounds = random_bounds(rng, 2)
    found = time_optimal(path, *bounds).trajectory
    for joint in range(2):
        for row, length in zip(found.coefficients[:, :, joint].T, found.lengths, strict=True):
            for order, limits in enumerate(bounds, 1):
                high, low = largest(np.polyder(row, order), length)
                assert high <= limits[joint, 1] * (1 + 2e-10)
                assert low >= limits[joint, 0] * (1 + 2e-10)
