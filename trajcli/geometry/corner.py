"""Rounding the corner between two curves: a blend that is continuous in position, direction and curvature.

The blend is the quintic r(u), u from 0 to 1, with r' = v T and r'' = v^2 K at both ends, T the direction and
K the curvature vector of the neighbour. Every speed v > 0 gives the same tangent and curvature there; the one
is taken whose largest curvature is smallest, so that the blend can be gone through fast. Between lines its
curvature is then at most 1.2 times that of the circular arc with the same ends.

Source: Farin, Curves and Surfaces for CAGD (2002), chapter 11 (geometric continuity).
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from trajcli.errors import InputError, PlanningError
from trajcli.frozen import frozen
from trajcli.geometry.arc_length import ArcLength, derivative, values
from trajcli.geometry.place_curve import PlaceCurve, Side, Smooth, Triple, angle_between, inside
from trajcli.geometry.rotation import Array
from trajcli.geometry.transport import Transport

SAME_DIRECTION = 1e-10  # rad, a turn below which the step in joint velocity is rounding
SAME_CURVATURE = 1e-9  # of the larger of two curvatures
REVERSAL = np.radians(1.0)  # from half a turn, nearer to which a blend would be a spike
_QUARTER = np.pi / 2.0  # of an arc, more of which a blend would cut away
_SLOWEST, _FASTEST = 0.05, 3.0  # of the end speeds v, in radii
_SPEEDS, _ROUNDS = 24, 3  # tried in each round, the next one between the neighbours of the best
_TRIED = np.linspace(0.0, 1.0, 97)
_TIE = 1e-9  # relative, so that rounding does not choose between two speeds
_FINER = 16  # steps of the parallel transport on each panel of the arc length: exact to 1e-13 rad


@frozen
class Blend(Smooth):
    """A quintic by arc length.

    Attributes:
        coefficients: Of r(u), shape (6, 3), m, highest power first.
    """

    coefficients: Array

    @cached_property
    def _arc(self) -> ArcLength:
        return ArcLength(self.coefficients)

    @cached_property
    def length(self) -> float:
        """Arc length, m."""
        return float(self._arc.lengths[-1])

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return p, p', p'' as `PlaceCurve` says; both sides are the same."""
        u = self._arc.parameter(inside(s, self.length))
        slope, bend = self._derivatives(u)[:2]
        speed = np.linalg.norm(slope, axis=-1, keepdims=True)
        first = slope / speed
        across = bend - np.einsum("ni,ni->n", bend, first)[:, None] * first
        return values(self.coefficients, u), first, across / speed**2

    def transport(self, s: Array, side: Side = "right") -> Triple:
        """Return Q, w', w'' as `PlaceCurve` says: w' = p' x p'', the rate that does not roll about p'."""
        u = self._arc.parameter(inside(s, self.length))
        slope, bend, third = self._derivatives(u)
        square = np.einsum("ni,ni->n", slope, slope)[:, None]
        inner = np.einsum("ni,ni->n", slope, bend)[:, None]
        across = np.cross(slope, bend)
        change = np.cross(slope, third) / square**2 - 3.0 * across * inner / square**3
        return self._transport.at(u), across / square**1.5, change

    @cached_property
    def _slopes(self) -> tuple[Array, Array, Array]:
        first = derivative(self.coefficients)
        second = derivative(first)
        return first, second, derivative(second)

    @cached_property
    def _transport(self) -> Transport:
        knots = self._arc.knots
        within = np.arange(_FINER) / _FINER
        finer = (knots[:-1, None] + np.diff(knots)[:, None] * within).ravel()
        return Transport(self._rate, np.append(finer, 1.0))

    def _rate(self, u: Array) -> Array:
        slope, bend = values(self._slopes[0], u), values(self._slopes[1], u)
        return np.asarray(np.cross(slope, bend) / np.einsum("...i,...i", slope, slope)[..., None])

    def _derivatives(self, u: Array) -> Triple:
        first, second, third = (values(row, u) for row in self._slopes)
        return first, second, third

    def distance(self, place: Array) -> float:
        """Return how near the curve comes to a point (3,), m."""
        apart, slope = self.coefficients.copy(), self._slopes[0]
        apart[-1] -= place
        # of the squared distance, the roots of half its derivative (r - place) . r'
        condition = sum(np.convolve(apart[:, i], slope[:, i]) for i in range(3))
        roots = np.roots(np.asarray(condition))
        inner = roots.real[np.abs(roots.imag) <= _TIE]
        candidates = np.concatenate([[0.0, 1.0], np.clip(inner, 0.0, 1.0)])
        return float(np.linalg.norm(values(apart, candidates), axis=-1).min())


def room_for_radius(before: PlaceCurve, after: PlaceCurve) -> float:
    """Return the largest radius, m, with which the corner between two curves can be rounded.

    The blend stays on both curves, and on each turns by at most a quarter with the curvature at the corner.
    """
    bends = [np.linalg.norm(row) for row in corner_values(before, after)[1]]
    quarter = min((_QUARTER / float(bend) for bend in bends if bend > 0.0), default=np.inf)
    return min(before.length, after.length, quarter)


def corner_values(before: PlaceCurve, after: PlaceCurve) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Return the two directions (3,) and the two curvature vectors (3,), 1/m, that meet in a corner."""
    _, arriving, bend = before.evaluate(np.array([before.length]), "left")
    _, leaving, other = after.evaluate(np.array([0.0]))
    return (arriving[0], leaving[0]), (bend[0], other[0])


def turn_between(before: PlaceCurve, after: PlaceCurve) -> float:
    """Return the angle, rad, by which the direction turns in the corner between two curves."""
    return angle_between(*corner_values(before, after)[0])


def curvature_jumps(before: PlaceCurve, after: PlaceCurve) -> bool:
    """Return whether the curvature vector is another one after the corner."""
    one, other = corner_values(before, after)[1]
    larger = max(float(np.linalg.norm(one)), float(np.linalg.norm(other)))
    return float(np.linalg.norm(one - other)) > SAME_CURVATURE * larger


def round_corner(before: PlaceCurve, after: PlaceCurve, radius: float) -> Blend:
    """Return the blend from `radius` before the corner of two curves to `radius` after it.

    Args:
        before: Ends in the corner.
        after: Starts there.
        radius: m of arc length, on each side.

    Raises:
        InputError: When the radius is not positive or too large for the curves.
        PlanningError: When the path turns back.
    """
    room = room_for_radius(before, after)
    if not 0.0 < radius <= room:
        raise InputError(f"a corner radius of {radius:.6g} m does not fit: it must be in (0, {room:.6g}] m")
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
    """Return the coefficients (6, k, 3) for place, direction and curvature at both ends and k end speeds."""
    v = speed[:, None]
    start, slope, bend = np.broadcast_to(first[0], (v.size, 3)), v * first[1], v**2 * first[2]
    place, end_slope, end_bend = (
        last[0] - start - slope - bend / 2.0,
        v * last[1] - slope - bend,
        v**2 * last[2],
    )
    end_bend = end_bend - bend
    return np.array(
        [
            6.0 * place - 3.0 * end_slope + end_bend / 2.0,
            -15.0 * place + 7.0 * end_slope - end_bend,
            10.0 * place - 4.0 * end_slope + end_bend / 2.0,
            bend / 2.0,
            slope,
            start,
        ]
    )


def _largest_curvature(rows: Array) -> Array:
    """Return the largest curvature (k,), 1/m, of curves with coefficients (6, k, 3), at 97 places."""
    powers = _TRIED[:, None] ** np.arange(5.0, -1.0, -1.0)
    slope = np.einsum("up,pki->uki", powers[:, 1:] * np.arange(5.0, 0.0, -1.0), rows[:-1])
    bend = np.einsum("up,pki->uki", powers[:, 2:] * np.array([20.0, 12.0, 6.0, 2.0]), rows[:-2])
    speed = np.linalg.norm(slope, axis=-1)
    across = np.linalg.norm(np.cross(slope, bend), axis=-1)
    with np.errstate(divide="ignore", invalid="ignore"):
        curvature: Array = np.where(speed > 0.0, across / speed**3, np.inf)
    return np.asarray(curvature.max(axis=0))
