"""Speeds between the places of the grid: paths on which they peak there, judged by dense rows."""

from __future__ import annotations

import numpy as np
import pytest
from topp_paths import symmetric

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
