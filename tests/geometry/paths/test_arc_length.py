from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from trajcli.geometry.paths.arc_length import ArcLength, FrameTransport


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


def test_along_a_line_the_parameter_is_the_part_of_the_length():
    arc = ArcLength(np.array([[1.0, 2.0, 2.0], [0.3, 0.0, -0.1]]))
    s = np.linspace(0, 3, 25)
    np.testing.assert_allclose(arc.parameter(s), s / 3, rtol=0, atol=1e-15)


def wandering(u):
    """Return a rate whose axis turns and whose size changes, rad."""
    return np.stack([3 * np.cos(4 * u), 2 * np.sin(3 * u) + u**2, 4 * u**3 - 1], axis=-1)


def test_transport_is_of_sixth_order_and_the_same_between_its_knots():
    def equation(u, flat):
        return np.cross(wandering(u), flat.reshape(3, 3), axisb=0, axisc=0).ravel()

    u = np.linspace(0, 1, 13)
    exact = solve_ivp(equation, (0, 1), np.eye(3).ravel(), "DOP853", u, rtol=1e-13, atol=1e-14)
    rotations = exact.y.T.reshape(-1, 3, 3)
    off = [
        np.abs(FrameTransport(wandering, np.linspace(0, 1, steps + 1)).at(u) - rotations).max()
        for steps in (2, 4, 8, 16)
    ]
    assert off[1] < off[0] / 45
    assert off[2] < off[1] / 58
    assert off[3] < min(off[2] / 61, 5e-8)
