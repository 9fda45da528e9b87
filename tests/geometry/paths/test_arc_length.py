from __future__ import annotations

import numpy as np
import pytest

from trajcli.geometry.paths.arc_length import ArcLength


def parabola(width):
    """Return the coefficients of (x^2, width x, 0) with x = u - 1/2, nearly a cusp where `width` is small."""
    return np.array([[1.0, 0, 0], [-1.0, width, 0], [0.25, -width / 2, 0]])


def exact(width, u):
    """Return the parabola's arc length up to u, the integral of sqrt(4 x^2 + width^2)."""

    def integral(x):
        return (x * np.sqrt(4 * x**2 + width**2) + width**2 / 2 * np.arcsinh(2 * x / width)) / 2

    return integral(u - 0.5) - integral(-0.5)


@pytest.mark.parametrize("width", [10.0, 1.0, 0.1, 0.01, 0.003])
def test_length_and_parameter_of_a_parabola(width):
    arc = ArcLength(parabola(width))
    assert arc.lengths[-1] == pytest.approx(exact(width, 1.0), rel=1e-14)
    u = np.linspace(0, 1, 201)
    np.testing.assert_allclose(arc.parameter(exact(width, u)), u, rtol=0, atol=3e-14 / width)
    assert arc.knots.size < 60
