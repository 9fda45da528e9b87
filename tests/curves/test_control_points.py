"""Control points against the basis that they are the weights of."""

from __future__ import annotations

from math import comb

import numpy as np
import pytest

from trajcli.curves.piecewise import control_points


@pytest.mark.parametrize("degree", range(10))
def test_the_weights_of_the_basis_give_the_polynomial(degree):
    rng = np.random.default_rng(degree)
    coefficients, lengths = rng.normal(size=(degree + 1, 4, 3)), rng.uniform(0.1, 3, (4, 1))
    points = control_points(coefficients, lengths)
    for share in np.linspace(0, 1, 7):
        basis = [comb(degree, k) * share**k * (1 - share) ** (degree - k) for k in range(degree + 1)]
        expected = sum(c * (share * lengths) ** (degree - k) for k, c in enumerate(coefficients))
        np.testing.assert_allclose(np.tensordot(basis, points, 1), expected, rtol=1e-10, atol=1e-11)


def test_control_points_of_a_parabola():
    """4 t (1 - t): its ends, and twice its top."""
    points = control_points(np.array([-4.0, 4.0, 0.0]), np.array(1.0))
    np.testing.assert_allclose(points, [0, 2, 0], atol=1e-15)
