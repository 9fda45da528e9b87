"""Rounding of corners between curves: blends with continuous curvature, and the radii that there is room for.

The blend is the quintic r(u), u from 0 to 1, with r' = v T and r'' = v^2 K at both ends, T the direction and
K the curvature vector of the neighbour. Every speed v > 0 gives the same tangent and curvature there; the one
is taken whose largest curvature is smallest, so that the blend can be gone through fast. Between lines its
curvature is then at most 1.2 times that of the circular arc with the same ends.

Source: Farin (2002), chapter 11 (geometric continuity).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from trajcli.errors import InputError, PlanningError, Problem
from trajcli.frozen import frozen
from trajcli.geometry.paths.arc_length import ArcLength, FrameTransport, derivative, values
from trajcli.geometry.paths.position import (
    SAME_POINT,
    PositionCurve,
    Side,
    Smooth,
    Triple,
    angle_between,
    inside,
    shown_length,
)
from trajcli.geometry.rotation import Array

SAME_DIRECTION = 1e-10  # rad, a turn below which the step in joint velocity is rounding
SAME_CURVATURE = 1e-9  # of the larger of two curvatures
REVERSAL = np.radians(1.0)  # from half a turn, nearer to which a blend would be a spike
_QUARTER = np.pi / 2.0  # of an arc, more of which a blend would cut away
_SLOWEST, _FASTEST = 0.05, 3.0  # of the end speeds v, in radii
_SPEEDS, _ROUNDS = 24, 3  # tried in each round, the next one between the neighbours of the best
_TRIED = np.linspace(0.0, 1.0, 97)
_TIE = 1e-9  # relative, so that rounding does not choose between two speeds
_FINER = 16  # steps of the parallel transport on each panel of the arc length: exact to 1e-13 rad


CornerKind = Literal["smooth", "bend", "stop", "rounded"]


@frozen
class Blend(Smooth):
    """A quintic by arc length.

    Attributes:
        coefficients: Of r(u), shape (6, 3), m, highest power first.
    """

    coefficients: Array

    @cached_property
    def arc(self) -> ArcLength:
        """Its arc length."""
        return ArcLength(self.coefficients)

    @cached_property
    def length(self) -> float:
        """Arc length, m."""
        return float(self.arc.lengths[-1])

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return p, p', p'' as `PositionCurve` says; both sides are the same."""
        u = self.arc.parameter(inside(s, self.length))
        slope, bend = self._derivatives(u)[:2]
        speed = np.linalg.norm(slope, axis=-1, keepdims=True)
        first = slope / speed
        across = bend - np.einsum("ni,ni->n", bend, first)[:, None] * first
        return values(self.coefficients, u), first, across / speed**2

    def transport(self, s: Array, side: Side = "right") -> Triple:
        """Return Q, w', w'' as `PositionCurve` says: w' = p' x p'', the rate that does not roll about p'."""
        u = self.arc.parameter(inside(s, self.length))
        slope, bend, third = self._derivatives(u)
        square = np.einsum("ni,ni->n", slope, slope)[:, None]
        inner = np.einsum("ni,ni->n", slope, bend)[:, None]
        across = np.cross(slope, bend)
        change = np.cross(slope, third) / square**2 - 3.0 * across * inner / square**3
        return self._transport.at(u), across / square**1.5, change

    def majorants(self, s: Array, rising: Array) -> tuple[Array, Array]:
        """Return the bounds of p and Q as `PositionCurve` says: none are known."""
        del s
        nothing = np.full(rising.shape, np.inf)
        return nothing, nothing

    @cached_property
    def _slopes(self) -> tuple[Array, Array, Array]:
        first = derivative(self.coefficients)
        second = derivative(first)
        return first, second, derivative(second)

    @cached_property
    def _transport(self) -> FrameTransport:
        knots = self.arc.knots
        within = np.arange(_FINER) / _FINER
        finer = (knots[:-1, None] + np.diff(knots)[:, None] * within).ravel()
        return FrameTransport(self._rate, np.append(finer, 1.0))

    def _rate(self, u: Array) -> Array:
        slope, bend = values(self._slopes[0], u), values(self._slopes[1], u)
        return np.asarray(np.cross(slope, bend) / np.einsum("...i,...i", slope, slope)[..., None])

    def _derivatives(self, u: Array) -> Triple:
        first, second, third = (values(row, u) for row in self._slopes)
        return first, second, third

    def distance(self, point: Array) -> float:
        """Return how near the curve comes to a point (3,), m."""
        apart, slope = self.coefficients.copy(), self._slopes[0]
        apart[-1] -= point
        # of the squared distance, the roots of half its derivative (r - point) . r'
        condition = sum(np.convolve(apart[:, i], slope[:, i]) for i in range(3))
        roots = np.roots(np.asarray(condition))
        inner = roots.real[np.abs(roots.imag) <= _TIE]
        candidates = np.concatenate([[0.0, 1.0], np.clip(inner, 0.0, 1.0)])
        return float(np.linalg.norm(values(apart, candidates), axis=-1).min())


def round_corner(before: PositionCurve, after: PositionCurve, radius: float) -> Blend:
    """Return the blend from `radius` before the corner of two curves to `radius` after it.

    Args:
        before: Ends in the corner.
        after: Starts there.
        radius: m of arc length, on each side.

    Raises:
        InputError: When the radius is not positive or too large for the curves.
        PlanningError: When the path turns back.
    """
    largest = room_for_radius(before, after)
    if not 0.0 < radius <= largest:
        raise InputError(
            f"a corner radius of {radius:.6g} m does not fit: it must be in (0, {largest:.6g}] m"
        )
    turn = turn_between(before, after)
    if turn > np.pi - REVERSAL:
        raise PlanningError(
            f"the path turns back by {np.degrees(turn):.6g} deg: such a corner cannot be rounded (the "
            f"largest is {np.degrees(np.pi - REVERSAL):.6g} deg)",
            hint="stop there instead: `corner: stop`",
        )
    first = before.evaluate(np.array([before.length - radius]), "right")
    last = after.evaluate(np.array([radius]), "left")
    return Blend(_gentlest([row[0] for row in first], [row[0] for row in last], radius))


def sharp_kind(before: PositionCurve, after: PositionCurve) -> CornerKind:
    """Return what a corner is as long as nothing is rounded."""
    if turn_between(before, after) > SAME_DIRECTION:
        return "stop"
    return "bend" if curvature_jumps(before, after) else "smooth"


def asked_radii(radii: ArrayLike, corners: int) -> list[float]:
    """Return a radius for each corner, m.

    Raises:
        InputError: When the number is wrong, or one is neither 0 nor positive.
    """
    given = np.asarray(radii, dtype=np.float64)
    if given.ndim and given.shape != (corners,):
        raise InputError(f"the path has {corners} corners, there are {given.size} radii", hint="one for each")
    wrong = given[~(np.isfinite(given) & ((given == 0.0) | (given > SAME_POINT)))]
    if wrong.size:
        text = "a corner radius must be 0 (stop there) or more than {least}, it is {given}"
        amounts = {"least": shown_length(SAME_POINT), "given": shown_length(wrong[0])}
        raise InputError(Problem(text, amounts=amounts))
    return [float(radius) for radius in np.broadcast_to(given, (corners,))]


def fitting_radii(
    segments: Sequence[PositionCurve], kinds: Sequence[CornerKind], asked: Sequence[float]
) -> tuple[list[float], list[float]]:
    """Return the radii, m, that fit where there is something to round, and those that fit where there is not.

    Neighbours share a segment that is too short, one that needs less than half leaves the rest to the other;
    a corner that goes on smoothly, over which only a rotation is to fade into the next one, gets what is
    left.

    Args:
        segments: k of them.
        kinds: Of the k - 1 corners.
        asked: Their radii, m.
    """
    wanted = [
        0.0 if kind == "smooth" or radius == 0.0 else min(radius, room_for_radius(*pair))
        for radius, kind, pair in zip(asked, kinds, pairwise(segments), strict=True)
    ]
    cut = _fitting(segments, wanted, [0.0] * len(asked))
    fading = [radius if kind == "smooth" else 0.0 for radius, kind in zip(asked, kinds, strict=True)]
    return cut, _fitting(segments, fading, cut)


def room_for_radius(before: PositionCurve, after: PositionCurve) -> float:
    """Return the largest radius, m, with which the corner between two curves can be rounded.

    The blend stays on both curves, and on each turns by at most a quarter with the curvature at the corner.
    """
    bends = [np.linalg.norm(row) for row in corner_values(before, after)[1]]
    quarter = min((_QUARTER / float(bend) for bend in bends if bend > 0.0), default=np.inf)
    return min(before.length, after.length, quarter)


def corner_values(
    before: PositionCurve, after: PositionCurve
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Return the two directions (3,) and the two curvature vectors (3,), 1/m, that meet in a corner."""
    _, arriving, bend = before.evaluate(np.array([before.length]), "left")
    _, leaving, other = after.evaluate(np.array([0.0]))
    return (arriving[0], leaving[0]), (bend[0], other[0])


def turn_between(before: PositionCurve, after: PositionCurve) -> float:
    """Return the angle, rad, by which the direction turns in the corner between two curves."""
    return angle_between(*corner_values(before, after)[0])


def curvature_jumps(before: PositionCurve, after: PositionCurve) -> bool:
    """Return whether the curvature vector is another one after the corner."""
    one, other = corner_values(before, after)[1]
    larger = max(float(np.linalg.norm(one)), float(np.linalg.norm(other)))
    return float(np.linalg.norm(one - other)) > SAME_CURVATURE * larger


def _gentlest(first: list[Array], last: list[Array], radius: float) -> Array:
    """Return the coefficients (6, 3) of the quintic whose largest curvature is smallest."""
    low, high = _SLOWEST, _FASTEST
    for _ in range(_ROUNDS):
        speeds = np.geomspace(low, high, _SPEEDS)
        rows = _quintics(first, last, radius * speeds)
        peaks = _largest_curvature(rows)
        best = int(np.argmax(peaks <= peaks.min() * (1.0 + _TIE)))
        low, high = speeds[max(best - 1, 0)], speeds[min(best + 1, _SPEEDS - 1)]
    return np.asarray(rows[:, best])


def _quintics(first: list[Array], last: list[Array], speed: Array) -> Array:
    """Return the coefficients (6, k, 3) for position, direction, curvature at both ends and k end speeds."""
    v = speed[:, None]
    start, slope, bend = np.broadcast_to(first[0], (v.size, 3)), v * first[1], v**2 * first[2]
    across, end_slope, end_bend = (
        last[0] - start - slope - bend / 2.0,
        v * last[1] - slope - bend,
        v**2 * last[2],
    )
    end_bend = end_bend - bend
    return np.array(
        [
            6.0 * across - 3.0 * end_slope + end_bend / 2.0,
            -15.0 * across + 7.0 * end_slope - end_bend,
            10.0 * across - 4.0 * end_slope + end_bend / 2.0,
            bend / 2.0,
            slope,
            start,
        ]
    )


def _largest_curvature(rows: Array) -> Array:
    """Return the largest curvature (k,), 1/m, of curves with coefficients (6, k, 3), at 97 points."""
    powers = _TRIED[:, None] ** np.arange(5.0, -1.0, -1.0)
    slope = np.einsum("up,pki->uki", powers[:, 1:] * np.arange(5.0, 0.0, -1.0), rows[:-1])
    bend = np.einsum("up,pki->uki", powers[:, 2:] * np.array([20.0, 12.0, 6.0, 2.0]), rows[:-2])
    speed = np.linalg.norm(slope, axis=-1)
    across = np.linalg.norm(np.cross(slope, bend), axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        curvature: Array = np.where(speed > 0.0, across / speed**3, np.inf)
    return np.asarray(curvature.max(axis=0))


def _fitting(
    segments: Sequence[PositionCurve], wanted: Sequence[float], taken: Sequence[float]
) -> list[float]:
    """Return the radii that fit into what is left of the segments by radii that were taken before."""
    around, gone = [0.0, *wanted, 0.0], [0.0, *taken, 0.0]
    result = []
    for i, radius in enumerate(wanted):
        free = [
            segment.length - gone[other] - min(around[other], segment.length / 2.0)
            for segment, other in ((segments[i], i), (segments[i + 1], i + 2))
        ]
        fits = min(radius, *free)
        result.append(fits if fits > SAME_POINT else 0.0)
    return result
