"""Weaving curves: waves to both sides of a seam, by the arc length of the seam.

    p(s) = c(s) + a w(f(s)) u(s)

with the seam c, the amplitude a, a wave w of the phase f that begins and ends at zero, and the unit vector u
across the seam. Where corners of the seam are rounded u follows quintics that join two derivatives of its
direction, so that p has a continuous second derivative where c has one. |p'| is not 1: s is of the seam.

Source: Farin (2002), chapter 7 (quintic Hermite interpolation).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache, cached_property
from itertools import pairwise
from typing import Literal

import numpy as np

from trajcli.curves.hermite import hermite_coefficients
from trajcli.curves.piecewise import PiecewisePolynomial, derivative_coefficients, horner
from trajcli.errors import PlanningError, Problem
from trajcli.frozen import frozen
from trajcli.geometry.paths.arc import Arc
from trajcli.geometry.paths.chain import Chain
from trajcli.geometry.paths.corner import Blend
from trajcli.geometry.paths.orientation import OrientationCurve
from trajcli.geometry.paths.position import (
    Line,
    PartOfCurve,
    PositionCurve,
    Side,
    Triple,
    inside,
    nearest,
    shown_length,
)
from trajcli.geometry.power_series import growth, series_exponential, series_product
from trajcli.geometry.rotation import Array

WaveShape = Literal["sine", "triangle", "trapezoid"]

_ROUNDED = 0.05  # of a cycle: a corner of a wave, from where it begins to bend to where it is straight again
_CLOSE = 1e-9  # of the seam: breaks that are nearer are one
_STILL = 1e-12  # of bounds of rates of an orientation: rounding of one that stays
_SQUARE = 0.1  # of a unit vector: what must be left of the side across the seam
_CORNERS: dict[str, tuple[tuple[float, float], ...]] = {
    "triangle": ((0.25, -1.0), (0.75, 1.0)),
    "trapezoid": ((0.125, 0.0), (0.375, -1.0), (0.625, 0.0), (0.875, 1.0)),
}
"""Phases of the corners of a wave, and what the slope is behind each, in multiples of that at the start."""


@frozen
class Weave:
    """A curve that swings to both sides of a seam, as long as that.

    Attributes:
        seam: By arc length.
        orientation: Of the tool along it; with no `across` the tool's z says which way is across.
        amplitude: To each side, m.
        cycles: Of the wave between neighbouring stops, whole or half ones, one number for each interval.
        shape: Of the wave.
        across: A vector (3,) in world, whose part square to the seam is the side; None for that square to
            the seam and to the tool's z.

    Raises:
        PlanningError: When the side is along the seam somewhere.
    """

    seam: PositionCurve
    orientation: OrientationCurve
    amplitude: float
    cycles: tuple[float, ...]
    shape: WaveShape = "sine"
    across: Array | None = None

    def __post_init__(self) -> None:
        s = np.concatenate([[0.0], self.seam.breaks, self.orientation.breaks, [self.length]])
        s = np.sort(np.concatenate([s, 0.5 * (s[1:] + s[:-1]), np.linspace(0.0, self.length, 33)]))
        sizes = np.linalg.norm(self._side(s, "right")[0], axis=1)
        if sizes.min() < _SQUARE:
            text = "a weave goes across the seam, but at s = {s} its side is along it"
            hint = "give `side` of the weave, a vector across the seam"
            what = "the z axis of the tool" if self.across is None else "`side`"
            message = text.replace("its side", what)
            raise PlanningError(Problem(message, hint, amounts={"s": shown_length(float(s[sizes.argmin()]))}))

    @property
    def length(self) -> float:
        """Length of the seam, m."""
        return self.seam.length

    @property
    def stops(self) -> Array:
        """Where a law must stop: where the direction of the seam jumps, or the side in a bend."""
        return stops_of(self.seam)

    @cached_property
    def breaks(self) -> Array:
        """Breaks of the seam, and where the wave bends or is steepest."""
        phases = _wave(self.shape).breaks[:-1] if self.shape != "sine" else np.arange(4) / 4
        rows = []
        for low, high, cycles in self._sections:
            done = (np.arange(np.ceil(cycles))[:, None] + phases).reshape(-1) / cycles
            rows.append(low + done[done < 1.0] * (high - low))
        fixed = np.sort(np.concatenate([self.seam.breaks, self.stops]))
        fixed = fixed[np.append(True, np.diff(fixed) > 0)] if fixed.size else fixed
        edges = np.concatenate([[0.0], fixed, [self.length]])
        own = np.concatenate(rows)
        own = own[np.abs(own - nearest(edges, own)) > _CLOSE * self.length]
        return np.sort(np.concatenate([fixed, own]))

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return p, p', p'' as `PositionCurve` says, but |p'| is not 1."""
        s = inside(s, self.length)
        position, first, second = self.seam.evaluate(s, side)
        u, turn, bend = _unit(*self._side(s, side))
        w, slope, curve = (self.amplitude * row[:, None] for row in self._waved(s, side))
        return (
            position + w * u,
            first + slope * u + w * turn,
            second + curve * u + 2.0 * slope * turn + w * bend,
        )

    def transport(self, s: Array, side: Side = "right") -> Triple:
        """Return Q, w', w'' as `PositionCurve` says, of the seam."""
        return self.seam.transport(s, side)

    def majorants(self, s: Array, rising: Array) -> tuple[Array, Array]:
        """Return the bounds of p and Q as `PositionCurve` says: of p about a line whose side stays."""
        along, turned = self.seam.majorants(s, rising)
        whole = self.seam
        while isinstance(whole, PartOfCurve):
            whole = whole.curve
        stays = self.across is not None or not (self.orientation.majorant(s, rising)[1:] > _STILL).any()
        if not (isinstance(whole, Line) and stays):
            return np.full(rising.shape, np.inf), turned
        rate = self.cycles[0] / self.length
        return along + self.amplitude * _wave_majorant(self.shape, s * rate, rate * rising), turned

    @property
    def _sections(self) -> list[tuple[float, float, float]]:
        """Where each interval between stops begins and ends, and its cycles."""
        edges = [0.0, *self.stops.tolist(), self.length]
        return [(low, high, n) for (low, high), n in zip(pairwise(edges), self.cycles, strict=True)]

    def _waved(self, s: Array, side: Side) -> Triple:
        """Return w and its two derivatives by s (N,), each (N,)."""
        edges = np.array([0.0, *self.stops.tolist(), self.length])
        section = np.searchsorted(edges[1:-1], s, side)
        rate = np.array(self.cycles)[section] / np.diff(edges)[section]
        phase = (s - edges[section]) * rate
        w, slope, curve = _of_phase(self.shape, phase)
        return w, slope * rate, curve * rate**2

    def _side(self, s: Array, side: Side) -> Triple:
        """Return a vector across the seam and its two derivatives at s (N,), each (N, 3)."""
        t, turn, bend = _tangent(self.seam, s, side)
        if self.across is not None:
            b = np.asarray(self.across) / np.linalg.norm(self.across)
            along, change, more = ((row @ b)[:, None] for row in (t, turn, bend))
            return b - along * t, -change * t - along * turn, -more * t - 2 * change * turn - along * bend
        rotation, rate, growth = self.orientation.evaluate(s, side)
        z = rotation[:, :, 2]
        spin = np.cross(rate, z)
        swirl = np.cross(growth, z) + np.cross(rate, spin)
        return (
            np.cross(t, z),
            np.cross(turn, z) + np.cross(t, spin),
            np.cross(bend, z) + 2.0 * np.cross(turn, spin) + np.cross(t, swirl),
        )


def stops_of(seam: PositionCurve) -> Array:
    """Return where a weave along a seam stops (k,), m: at its stops, and where its curvature jumps."""
    if not isinstance(seam, Chain):
        return seam.stops
    return np.array([corner.s for corner in seam.corners if corner.kind in ("stop", "bend")])


def _of_phase(shape: WaveShape, phase: Array) -> Triple:
    """Return the wave, from -1 to 1, and its two derivatives at phases (N,), in cycles."""
    if shape == "sine":
        angle, full = 2.0 * np.pi * phase, 2.0 * np.pi
        return np.sin(angle), full * np.cos(angle), -(full**2) * np.sin(angle)
    part = phase - np.floor(phase)
    rows = _wave(shape).evaluate_orders(part, (0, 1, 2))[:, :, 0].T
    return rows[0], rows[1], rows[2]


def _wave_majorant(shape: WaveShape, phase: Array, rising: Array) -> Array:
    """Return bounds of |w^(m)| / m! by time (order + 1, P), on pieces with these phases (P,), in cycles.

    The wave is exp(i f), or a polynomial of the phase f, of what the phase rises by.
    """
    rising = np.concatenate([np.zeros((1, rising.shape[1])), rising[1:]])
    if shape == "sine":
        return series_exponential(2.0 * np.pi * rising)
    wave = _wave(shape)
    piece = np.clip(np.searchsorted(wave.breaks, phase - np.floor(phase), "right") - 1, 0, wave.pieces - 1)
    sizes = growth(wave.coefficients, wave.lengths, wave.degree)[:, piece, 0]
    result, power = np.zeros(rising.shape), rising
    for size in sizes[1:]:
        result += size * power
        power = series_product(power, rising)
    return result


@cache
def _wave(shape: WaveShape) -> PiecewisePolynomial:
    """Return one cycle of a wave with straight flanks, its corners rounded by quartics, its peaks 1 and -1.

    In a corner the slope goes over by 3 x^2 - 2 x^3, so that the second derivative is zero at both ends.
    """
    half, slope = _ROUNDED / 2.0, 1.0
    breaks, rows, value, at = [0.0], [], 0.0, 0.0
    for corner, behind in _CORNERS[shape]:
        rows.append([0.0, 0.0, 0.0, slope, value])
        value += slope * (corner - half - at)
        change = behind - slope
        quartic = [-change / (2.0 * _ROUNDED**3), change / _ROUNDED**2, 0.0, slope, value]
        for begins in (0.0, half):  # a break in the middle, where it bends most
            tau = np.poly1d(quartic)
            rows.append([float(tau.deriv(m)(begins) / np.prod(range(1, m + 1))) for m in (4, 3, 2, 1, 0)])
        breaks += [corner - half, corner, corner + half]
        value, slope, at = float(np.polyval(quartic, _ROUNDED)), behind, corner + half
    rows.append([0.0, 0.0, 0.0, slope, value])
    coefficients = np.array(rows).T[:, :, None]
    curve = PiecewisePolynomial(np.array([*breaks, 1.0]), coefficients)
    peak = float(curve.evaluate(np.array([0.25]))[0, 0])
    return PiecewisePolynomial(curve.breaks, curve.coefficients / peak)


def _tangent(curve: PositionCurve, s: Array, side: Side) -> Triple:
    """Return the direction of a seam and two derivatives of it at s (N,), each (N, 3)."""
    if isinstance(curve, Chain):
        return _of_chain(curve, s, side)
    _, t, turn = curve.evaluate(s, side)
    whole = curve
    while isinstance(whole, PartOfCurve):
        whole = whole.curve
    if not isinstance(whole, Arc):
        return t, turn, np.zeros_like(t)
    level = t - (t @ whole.axis)[:, None] * whole.axis
    return t, turn, -np.square(np.linalg.norm(level, axis=1) / whole.radius)[:, None] * level


def _of_chain(chain: Chain, s: Array, side: Side) -> Triple:
    """Return that of a chain: over its rounded corners by quintics between the parts beside them."""
    s = inside(s, chain.length)
    part = np.searchsorted(chain.breaks, s, side)
    result = np.empty((3, s.size, 3))
    for k in np.flatnonzero(np.bincount(part)).tolist():
        rows, curve = part == k, chain.parts[k]
        local = np.clip(s[rows] - chain.offsets[k], 0.0, curve.length)
        if isinstance(curve, Blend):
            ends = _ends_beside(chain, k)
            result[:, rows] = _unit(*_quintic(*ends, curve.length)(local))
        else:
            result[:, rows] = _tangent(curve, local, side)
    return result[0], result[1], result[2]


def _ends_beside(chain: Chain, k: int) -> tuple[Array, Array]:
    """Return the direction with two derivatives (3, 3) where the blend k of a chain begins, and ends."""
    ends = []
    for beside, at_end in ((k - 1, True), (k + 1, False)):
        curve = chain.parts[beside]
        s = np.array([curve.length if at_end else 0.0])
        row = _tangent(curve, s, "left" if at_end else "right")
        ends.append(np.stack([each[0] for each in row]))
    return ends[0], ends[1]


def _quintic(first: Array, last: Array, length: float) -> Callable[[Array], Triple]:
    """Return the quintic with value and two derivatives (3, 3) at both ends, as a function of s."""
    coefficients = hermite_coefficients(first[:, None], last[:, None], np.array([[length]]))[:, 0]

    def values(s: Array) -> Triple:
        rows = (horner(derivative_coefficients(coefficients, m)[:, None], s[:, None]) for m in range(3))
        one, two, three = rows
        return one, two, three

    return values


def _unit(vector: Array, first: Array, second: Array) -> Triple:
    """Return the unit vectors of vectors, each (N, 3), with their two derivatives."""
    size = np.linalg.norm(vector, axis=1, keepdims=True)
    u = vector / size
    growth = (u * first).sum(axis=1, keepdims=True)
    turn = (first - u * growth) / size
    more = (turn * first + u * second).sum(axis=1, keepdims=True)
    return u, turn, (second - 2.0 * turn * growth - u * more) / size
