"""Majorants of paths against Taylor coefficients of their formulas in complex numbers."""

from __future__ import annotations

from collections.abc import Callable
from math import factorial

import numpy as np
import pytest
from euler_curves import euler_between

from trajcli.geometry.paths.arc import Arc
from trajcli.geometry.paths.chain import join
from trajcli.geometry.paths.orientation import (
    AxisAngleOrientation,
    FixedOrientation,
    SegmentProgress,
    TangentOrientation,
)
from trajcli.geometry.paths.pose import PoseCurve, Screw
from trajcli.geometry.paths.position import Line, PartOfCurve, Pivot
from trajcli.geometry.pose import build
from trajcli.geometry.power_series import growth
from trajcli.geometry.rotation import Frame, exp
from trajcli.kinematics.following.weave import Weave

ORDER, DURATION = 9, 0.4
S = [0.9, -0.4, 0.3, 0.5]  # 0.5 + 0.3 t - 0.4 t^2 + 0.9 t^3, which stays within 0.5 to 0.65
MIDDLE = float(np.polyval(S, DURATION / 2))
Formula = Callable[[np.ndarray], list[np.ndarray]]
"""From the Taylor coefficients of s(t), lowest first, to those of the entries of a vector."""


def product(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.convolve(one, other)[: ORDER + 1]


def cis(angle: np.ndarray) -> np.ndarray:
    """Return the Taylor coefficients of exp(i f), by the sum of powers of f."""
    rest, power = 1j * angle, np.eye(1, ORDER + 1)[0].astype(complex)
    rest[0], result = 0, np.zeros(ORDER + 1, dtype=complex)
    for k in range(ORDER + 1):
        result += power / factorial(k)
        power = product(power, rest)
    return result * np.exp(1j * angle[0])


def largest(formula: Formula) -> np.ndarray:
    """Return the largest Taylor coefficients of orders 1 to 9 of a vector, over the piece."""
    best = np.zeros(ORDER)
    for t in np.linspace(0, DURATION, 201):
        series = np.zeros(ORDER + 1)
        series[: len(S)] = [np.polyval(np.polyder(S, k), t) / factorial(k) for k in range(len(S))]
        best = np.maximum(best, np.linalg.norm(formula(series), axis=0)[1:])
    return best


def bounds(of: Callable[..., object]) -> np.ndarray:
    """Return what a path says, of orders 1 to 9."""
    coefficients = np.array(S)[:, None, None]
    rising = growth(coefficients, np.array([DURATION]), ORDER)[:, :, 0]
    return np.asarray(of(np.array([MIDDLE]), rising))[..., 1:, 0]


def near(found: np.ndarray, formula: Formula, within: float = 100.0) -> None:
    true = largest(formula)
    assert (found >= true * (1 - 1e-9)).all()
    assert (found <= within * true + 1e-12).all()


def turn(rate: float) -> Formula:
    return lambda s: [cis(rate * s)]


Z = np.array([0.0, 0.0, 1.0])
ARC = Arc(np.array([0.2, 0, 0]), np.zeros(3), Z, -4.0, 0.3)
PER_RADIAN = float(np.hypot(0.2, 0.3 / (2 * np.pi)))


def test_lines_go_as_far_as_s() -> None:
    line = Line(np.zeros(3), np.array([0.6, 0, 0.8]))
    for curve in (line, PartOfCurve(Line(np.zeros(3), np.array([0, 3.0, 0])), 1.0, 2.0)):
        near(bounds(curve.majorants)[0], lambda s: [s])
        assert not bounds(curve.majorants)[1].any()


def waves(shape: str, length: float = 3.0, cycles: float = 4.0) -> Weave:
    seam = Line(np.zeros(3), np.array([length, 0.0, 0.0]))
    return Weave(seam, FixedOrientation(np.diag([1.0, -1.0, -1.0]), length), 0.02, (cycles,), shape)


def test_a_sine_about_a_line_is_the_line_and_an_exponential_of_its_phase() -> None:
    rate = 2 * np.pi / 3

    def weave(s: np.ndarray) -> list[np.ndarray]:
        return [s, 0.02 * cis(rate * s).imag]

    near(bounds(waves("sine", cycles=1.0).majorants)[0], weave, within=1000.0)
    assert not bounds(waves("sine").majorants)[1].any()


@pytest.mark.parametrize(("shape", "slope"), [("triangle", 4 / (1 - 1.5 * 0.025)), ("trapezoid", 8.0)])
def test_flanks_of_a_wave_are_lines_and_its_corners_quartics(shape: str, slope: float) -> None:
    """Two pieces of time: one on a flank, and one in the first half of a corner, where slopes go over."""
    seam = waves(shape, 3.0, 0.3)  # s from 0.5 to 0.65 is within 0.05 to 0.065 of a cycle
    near(bounds(seam.majorants)[0], lambda s: [s, 0.02 * slope * 0.1 * s])
    corner, behind = (0.25, -2.0) if shape == "triangle" else (0.125, -1.0)
    begins = corner - 0.025  # there x of the smooth step 3 x^2 - 2 x^3 is 0; it is 1 behind 0.05 of a cycle
    rate = (begins + 0.001) / 0.5
    woven, law = waves(shape, 3.0, 3.0 * rate), [-0.02, 0.05, 0.5]
    assert np.polyval(law, DURATION) * rate < corner  # where its own quartic ends
    rising = growth(np.array(law)[:, None, None], np.array([DURATION]), ORDER)[:, :, 0]
    found = woven.majorants(np.array([np.polyval(law, DURATION / 2)]), rising)[0][1:, 0]
    for t in np.linspace(0, DURATION, 101):
        s = np.zeros(ORDER + 1)
        s[:3] = [np.polyval(np.polyder(law, k), t) / factorial(k) for k in range(3)]
        x = rate * s / 0.05
        x[0] -= begins / 0.05
        square = product(x, x)
        bend = behind * (product(square, x) - product(square, square) / 2) * 0.05
        true = np.linalg.norm([s, 0.02 * slope * (rate * s + bend)], axis=0)[1:]
        assert (found >= true * (1 - 1e-9)).all()
        assert true[3] > 0


def test_other_weaves_have_no_bound() -> None:
    turning = AxisAngleOrientation.between(np.eye(3), exp(0.3 * np.array([1.0, 0.0, 0.0])), 3.0)
    seam = Line(np.zeros(3), np.array([3.0, 0.0, 0.0]))
    arc = Weave(ARC, FixedOrientation(np.eye(3), ARC.length), 0.02, (4.0,))
    for weave in (Weave(seam, turning, 0.02, (4.0,)), arc):
        assert np.isinf(bounds(weave.majorants)[0]).all()
    fixed = Weave(seam, turning, 0.02, (4.0,), "sine", np.array([0.0, 1.0, 0.0]))
    assert np.isfinite(bounds(fixed.majorants)[0]).all()


def test_a_pivot_moves_by_what_its_ends_are_apart() -> None:
    found = bounds(Pivot(np.zeros(3), np.array([0, 0, 8e-10]), 1.0).majorants)
    np.testing.assert_allclose(found[0], 8e-10 * bounds(Line(np.zeros(3), Z).majorants)[0], rtol=1e-12)
    assert np.isinf(found[1]).all()


def test_a_helix_turns_and_climbs() -> None:
    angle = 1 / PER_RADIAN

    def helix(s: np.ndarray) -> list[np.ndarray]:
        return [0.2 * cis(angle * s), 0.3 / (2 * np.pi) * angle * s]

    near(bounds(ARC.majorants)[0], helix)
    near(bounds(ARC.majorants)[1], turn(angle))
    down = Arc(ARC.start, ARC.center, ARC.axis, ARC.angle, -ARC.pitch)
    np.testing.assert_array_equal(bounds(down.majorants), bounds(ARC.majorants))
    tangent = TangentOrientation(ARC, np.eye(3))
    np.testing.assert_array_equal(bounds(tangent.majorant), bounds(ARC.majorants)[1])


def test_a_steep_helix_climbs_faster_than_it_turns() -> None:
    radius, climb = 1e-3, 2.0 / (2 * np.pi)
    angle = 1 / float(np.hypot(radius, climb))
    steep = Arc(np.array([radius, 0, 0]), np.zeros(3), Z, 4.0, 2.0)
    near(bounds(steep.majorants)[0], lambda s: [radius * cis(angle * s), climb * angle * s], within=1000.0)


def test_a_screw_is_a_helix_about_its_axis() -> None:
    """1.5 rad about z through [0, -0.4, 0], and 0.5 m along it: the tool goes hypot(0.6, 0.5) m."""
    radius, angle, climb = 0.4, 1.5, 0.5
    center = np.array([0.0, -radius, 0.0])
    end = build(exp(angle * Z), center + exp(angle * Z) @ -center + climb * Z)
    screw = Screw(np.eye(4), end)
    length = float(np.hypot(radius * angle, climb))
    assert screw.length == pytest.approx(length)

    def helix(s: np.ndarray) -> list[np.ndarray]:
        return [radius * cis(angle / length * s), climb / length * s]

    near(bounds(screw.majorants)[0], helix)
    near(bounds(screw.majorants)[1], turn(angle / length))
    straight = Screw(np.eye(4), build(np.eye(3), np.array([0, 0.8, 0])))
    near(bounds(straight.majorants)[0], lambda s: [s])
    assert not bounds(straight.majorants)[1].any()


def test_rotations_turn_by_their_angles() -> None:
    axis = AxisAngleOrientation.between(np.eye(3), exp(2.0 * Z), 1.25)
    near(bounds(axis.majorant), turn(2.0 / 1.25))
    assert not bounds(FixedOrientation(np.eye(3), 1.0).majorant).any()
    euler = euler_between([0.1, 0, 0.2], [1.1, 0, -0.4], "ZYZ", length=1.0)
    slower = euler_between([0.1, 0, 0.2], [1.1, 0, 1.2], "ZYZ", length=1.0)
    near(bounds(slower.majorant), turn(2.0))  # both turn about the same axis while the second one rests
    assert (bounds(euler.majorant) >= largest(turn(0.4))).all()


@pytest.mark.parametrize(("middle", "last"), [(0.0, 1.0), (np.pi, -1.0)])
@pytest.mark.parametrize("frame", ["current", "fixed"])
def test_angles_about_one_axis_turn_by_their_sum(middle: float, last: float, frame: Frame) -> None:
    """With s = t by exp(2 i t), whose Taylor coefficients are 2^m / m!: of opposite signs, too, where z is reversed."""
    curve = euler_between([0.0, middle, 0.0], [1.0, middle, last], "ZYZ", frame, length=1.0)
    found = curve.majorant(np.array([0.5]), np.eye(1, 5, 1)[0][:, None])
    np.testing.assert_allclose(found[1:, 0], [2**m / factorial(m) for m in range(1, 5)], rtol=1e-12)


@pytest.mark.parametrize(
    ("border", "half"),
    [(0.55, 0.2), (0.5, 0.3), (0.66, 0.17), (0.9, 0.1), (0.9, 0.0), (0.3, 0.1), (0.3, 0.0)],
)
def test_one_rotation_fades_into_the_next_one(border: float, half: float) -> None:
    """Both about z, by 1.2 rad over the first segment and by 0.7 rad over the second one."""
    progress = SegmentProgress(np.array([0.0, border, 1.3]), np.array([half]))
    rotations = np.stack([exp(angle * Z) for angle in (0.0, 1.2, 1.9)])

    def faded(s: np.ndarray) -> list[np.ndarray]:
        x, one = s / (2 * half or 1.0), np.eye(1, ORDER + 1)[0]
        x[0] -= (border - half) / (2 * half or 1.0)
        cubic = product(product(x, x), x)
        ramp = 2 * half * (cubic - product(cubic, x) / 2)
        if abs(MIDDLE - border) >= half:
            ramp = (s - border * one) * (border < MIDDLE)
        return [cis(1.2 / border * (s - ramp) + 0.7 / (1.3 - border) * ramp)]

    near(
        bounds(AxisAngleOrientation(rotations, progress).majorant),
        faded,
        within=1e5 if abs(MIDDLE - border) < half else 100.0,
    )


def test_a_ramp_is_bounded_by_its_largest_derivatives() -> None:
    """w (x^3 - x^4 / 2) with x = s / w, s = t: the bounds of all four are reached."""
    w, x = 0.4, np.linspace(0, 1, 1001)
    progress = SegmentProgress(np.array([0.0, 0.5, 1.5]), np.array([w / 2]))
    ramp = [w * np.polyval(np.polyder([-0.5, 1, 0, 0, 0], k), x) / w**k / factorial(k) for k in range(1, 5)]
    rising = np.eye(1, 5, 1)[0][:, None]
    found = progress.majorant(np.array([0.0, 3.0]), np.array([0.6]), rising)
    np.testing.assert_allclose(found[1:, 0], [3 * np.abs(row).max() for row in ramp], rtol=1e-12)
    behind = progress.majorant(np.array([2.0, 0.0]), np.array([0.6]), rising)
    np.testing.assert_allclose(behind, 4 / 3 * found, rtol=1e-12)  # 2 rad over 0.5 m, not 3 rad over 1 m


def test_a_chain_says_what_the_part_says_that_is_gone_through() -> None:
    first, last = Line(np.zeros(3), np.array([0.3, 0, 0])), Line(np.array([0.3, 0, 0]), np.array([0.3, 1, 0]))
    sharp = join([first, last])
    np.testing.assert_array_equal(bounds(sharp.majorants), bounds(last.majorants))
    circle = Arc(np.array([0.3, 0, 0]), np.array([0.3, 0.5, 0]), Z, 2.0)
    turning = join([first, circle])
    np.testing.assert_allclose(bounds(turning.majorants), bounds(circle.majorants), rtol=1e-12)
    fixed = FixedOrientation(np.eye(3), turning.length)
    pose = bounds(PoseCurve(turning, fixed).majorants)
    np.testing.assert_array_equal(pose, [bounds(turning.majorants)[0], np.zeros(ORDER)])
    longer = [Line(np.zeros(3), np.array([0.8, 0, 0])), Line(np.array([0.8, 0, 0]), np.array([0.8, 1, 0]))]
    assert np.isinf(bounds(join(longer, 0.35).majorants)).all()
