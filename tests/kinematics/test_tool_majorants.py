"""Bounds of derivatives of the tool's motion against power series of arms that are sums of complex exponentials."""

from __future__ import annotations

from dataclasses import replace
from math import factorial

import numpy as np
import pytest
from numpy.polynomial import chebyshev

from trajcli.geometry.power_series import growth, series_exponential, series_product
from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.kinematics.tool_derivatives import majorants

ORDER, LENGTH = 11, 0.3
RNG = np.random.default_rng(11)


def curve(joints: int, degree: int = 5) -> np.ndarray:
    """Return coefficients (degree + 1, 1, n), highest power first, of a lively motion."""
    return RNG.normal(size=(degree + 1, 1, joints)) * np.array([8.0, 6, 4, 3, 2, 0.5])[:, None, None]


def shifted(coefficients: np.ndarray, t: float) -> np.ndarray:
    """Return the Taylor coefficients (ORDER + 1, n) at t, lowest first."""
    rows = np.zeros((ORDER + 1, coefficients.shape[-1]))
    for joint, row in enumerate(coefficients[:, 0].T):
        polynomial = np.poly1d(row)
        for k in range(len(row)):
            rows[k, joint] = polynomial(t) / factorial(k)
            polynomial = polynomial.deriv()
    return rows


def exponential(series: np.ndarray) -> np.ndarray:
    """Return the Taylor coefficients of exp(i f), by the sum of powers of f."""
    power, result = np.eye(1, ORDER + 1)[0].astype(complex), np.zeros(ORDER + 1, dtype=complex)
    rest = series.astype(complex) * 1j
    rest[0] = 0
    for k in range(ORDER + 1):
        result += power / factorial(k)
        power = np.convolve(power, rest)[: ORDER + 1]
    return result * np.exp(1j * series[0])


def bounds(name: str, coefficients: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    rising = growth(coefficients, np.array([LENGTH]), ORDER)
    position, spin = majorants(load_robot(name), coefficients[-1], rising)
    return position[:, 0], spin[:, 0]


def test_growth_bounds_every_derivative_everywhere() -> None:
    coefficients = curve(3)
    found = growth(coefficients, np.array([LENGTH]), ORDER)[:, 0]
    assert found.shape == (ORDER + 1, 3)
    rows = np.stack([shifted(coefficients, t) for t in np.linspace(0, LENGTH, 301)])
    assert (np.abs(rows[:, 1:]).max(axis=0) <= found[1:] * (1 + 1e-12)).all()
    assert (np.abs(rows[:, 0] - rows[0, 0]).max(axis=0) <= found[0]).all()
    same = np.abs(coefficients)  # of positive coefficients the derivatives are largest at the end
    rising, end = growth(same, np.array([LENGTH]), ORDER)[:, 0], shifted(same, LENGTH)
    np.testing.assert_allclose(rising[1:], end[1:], rtol=1e-12)
    np.testing.assert_allclose(rising[0], end[0] - shifted(same, 0.0)[0], rtol=1e-12)


def test_products_and_exponentials_of_series_are_those_of_the_functions() -> None:
    """Of several pieces at once, in some of which a power has no part; exp(f) is the product of exp(f_k r^k)."""
    one, other = RNG.uniform(0.1, 2.0, (2, ORDER + 1, 4))
    one[1, 0] = one[0, 1] = one[3:, 2] = other[2, 1] = other[0, 3] = 0.0
    products = [np.convolve(f, g)[: ORDER + 1] for f, g in zip(one.T, other.T, strict=True)]
    np.testing.assert_allclose(series_product(one, other), np.transpose(products), rtol=1e-12)
    one[0] = 0.0
    for f, found in zip(one.T, series_exponential(one).T, strict=True):
        whole = np.eye(1, ORDER + 1)[0]
        for k in range(1, ORDER + 1):
            factor = np.zeros(ORDER + 1)
            factor[::k] = [f[k] ** j / factorial(j) for j in range(ORDER // k + 1)]
            whole = np.convolve(whole, factor)[: ORDER + 1]
        np.testing.assert_allclose(found, whole, rtol=1e-12)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_slide_is_as_long_a_lever_as_it_goes(sign: int) -> None:
    """It turns by w t and slides from nothing by v t: at the end |p'|^2 = v^2 + (w v T)^2."""
    joints = Joint("turn", alpha=-np.pi / 2), Joint("slide", "prismatic")
    arm = Robot("turning slide", joints, unlimited(2), "standard", np.eye(4), np.eye(4))
    v, w = 0.5 * sign, 40.0
    rising = growth(np.array([[[w, v]], [[0.0, 0.0]]]), np.array([LENGTH]), ORDER)
    position, _ = majorants(arm, np.zeros((1, 2)), rising)
    assert 1.0 <= position[1, 0] / np.hypot(v, w * v * LENGTH) <= 1.2


@pytest.mark.parametrize("sign", [1, -1])
def test_each_piece_is_bounded_by_the_lever_that_it_begins_with(sign: int) -> None:
    """Steady turns about slides that stand at 0.1, 2 and 0.5 m: d w^k / k!."""
    joints = Joint("turn", alpha=-np.pi / 2), Joint("slide", "prismatic")
    arm = Robot("turning slide", joints, unlimited(2), "standard", np.eye(4), np.eye(4))
    out, w = np.array([0.1, 2.0, 0.5]), sign * np.array([3.0, 1.0, -2.0])
    start = np.stack([np.array([0.3, -1.1, 2.0]), out], axis=1)
    coefficients = np.stack([np.stack([w, np.zeros(3)], axis=1), start])
    position, _ = majorants(arm, start, growth(coefficients, np.full(3, LENGTH), ORDER))
    for k in range(1, ORDER + 1):
        np.testing.assert_allclose(position[k], out * np.abs(w) ** k / factorial(k), rtol=1e-9)


def test_every_coefficient_of_a_slide_counts() -> None:
    slide = Robot("slide", (Joint("slide", "prismatic"),), unlimited(1), "standard", np.eye(4), np.eye(4))
    coefficients = np.ones((ORDER + 1, 1, 1))
    position, _ = majorants(slide, np.ones((1, 1)), growth(coefficients, np.array([LENGTH]), ORDER))
    np.testing.assert_allclose(position[1:, 0], shifted(coefficients, LENGTH)[1:, 0], rtol=1e-12)


def test_a_planar_arm_is_a_sum_of_exponentials() -> None:
    """p = 0.3 exp(i q1) + 0.2 exp(i (q1 + q2)); w = q1' + q2'."""
    for _ in range(5):
        coefficients = curve(2)
        position, spin = bounds("planar2r", coefficients)
        lengths = [joint.a for joint in load_robot("planar2r").joints]
        for t in np.linspace(0, LENGTH, 31):
            q = shifted(coefficients, t)
            p = sum(a * exponential(sum_) for a, sum_ in zip(lengths, np.cumsum(q, axis=1).T, strict=True))
            assert (np.abs(p[1:]) <= position[1:] * (1 + 1e-12)).all()
            w = np.abs(q.sum(axis=1)[1:] * np.arange(1, ORDER + 1))
            assert (w <= spin[:-1] * (1 + 1e-12)).all()


@pytest.mark.parametrize("start", [0.0, 0.7, -2.3])
def test_a_steady_turn_is_bounded_tightly(start: float) -> None:
    """Of p = a exp(i r t) the bounds are the derivatives: a r^k / k!, and w = r, wherever it begins."""
    coefficients = np.zeros((2, 1, 2))
    coefficients[0, 0, 0] = rate = 3.0
    coefficients[1, 0, 0] = start
    position, spin = bounds("planar2r", coefficients)
    reach = sum(joint.a for joint in load_robot("planar2r").joints)
    np.testing.assert_allclose(
        position[1:], [reach * rate**k / factorial(k) for k in range(1, ORDER + 1)], rtol=1e-12
    )
    np.testing.assert_allclose(spin, [rate, *[0.0] * ORDER], atol=1e-12)


def test_a_tool_reaches_further() -> None:
    """A tool of 1 m along the stretched arm: every derivative of the position grows by that of 1 m."""
    coefficients, robot = curve(2), load_robot("planar2r")
    tool = np.eye(4)
    tool[0, 3] = 1.0
    rising = growth(coefficients, np.array([LENGTH]), ORDER)
    (short, _), (long, _) = (
        majorants(arm, coefficients[-1], rising) for arm in (robot, replace(robot, tool=tool))
    )
    for t in (0.0, LENGTH):
        further = np.abs(exponential(shifted(coefficients, t).sum(axis=1)))
        assert (further[1:] <= (long - short)[1:, 0] * (1 + 1e-12)).all()


def test_the_spin_of_one_joint_is_its_speed() -> None:
    """With positive coefficients all derivatives are largest at the end."""
    coefficients = np.abs(curve(2)) * [1, 0]
    _, spin = bounds("planar2r", coefficients)
    speed = shifted(coefficients, LENGTH)[1:, 0] * np.arange(1, ORDER + 1)
    np.testing.assert_allclose(spin[:-1], speed, rtol=1e-12)


@pytest.mark.parametrize("name", ["rpr", "rrp", "cylindrical", "cobra600", "ur5e", "panda", "stanford"])
def test_arms_of_all_kinds_stay_within_their_bounds(name: str) -> None:
    """Derivatives of the position from a Chebyshev series of forward kinematics."""
    robot = load_robot(name)
    coefficients = curve(len(robot.joints)) * 0.3
    position, _ = bounds(name, coefficients)
    t = (1 - np.cos(np.pi * (np.arange(40) + 0.5) / 40)) * LENGTH / 2
    q = np.stack([np.polyval(row, t) for row in coefficients[:, 0].T], axis=1)
    series = chebyshev.chebfit(2 * t / LENGTH - 1, forward(robot, q)[:, :3, 3], 30)
    for k in range(1, 7):
        derived = chebyshev.chebder(series, k) * (2 / LENGTH) ** k / factorial(k)
        values = np.linalg.norm(chebyshev.chebval(np.linspace(-1, 1, 101), derived), axis=0)
        assert values.max() <= position[k] * (1 + 1e-6)
        assert position[k] < 1e4 * values.max()  # and they say something
