"""Speed of approach to a bound, against the limit that the distance to the bound sets it.

A component that is x away from a bound of its position may approach it with

    v <= max(0, sqrt(2 d x) - o):

what a deceleration d stops in that distance, less an offset o. Nearer than o^2 / (2 d) it may only leave.

With v = -x' the limit is kept by a motion that takes k times as long where (v / k + o)^2 - 2 d x <= 0
wherever v > 0: a polynomial inequality. The smallest such k, the use of the limit, is found from below: at
the largest value of the polynomial for one k, and at the fastest points, k is raised to what they need.

Source: Dinkelbach, On nonlinear fractional programming, Management Science 13 (1967), for the iteration;
Franka Robotics, FR3 position-based velocity limits (libfranka, rate_limiting.h), for the limit.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.extrema import all_roots, critical_points
from trajcli.curves.piecewise import Array, control_points, derivative_coefficients, horner
from trajcli.frozen import comparable, frozen

ROOM = 1e-12
"""Speed, SI, that is allowed at any distance: what rounding makes of rest."""
_ROUNDING = 8 * 2.0**-52  # of the numbers that make a distance: by so much it is taken for larger
_SETTLED = 1e-13  # relative: a use that is raised by less is found
_STEPS = 60
_HOPELESS = 1e9  # a use above it is not worth more digits


@frozen
class ApproachLimits:
    """Limits of the speeds with which components approach the ends of their ranges.

    Attributes:
        position: Lower and upper end of each range, shape (n, 2); finite where there is a deceleration.
        deceleration: Shape (n,), positive; infinite for no limit.
        offset: Speed that is taken off, shape (n,), not negative.
    """

    position: Array
    deceleration: Array
    offset: Array

    @property
    def limited(self) -> NDArray[np.intp]:
        """Indices of the components that have a limit, shape (m,)."""
        return np.flatnonzero(np.isfinite(self.deceleration))

    def bounds(self, position: Array) -> tuple[Array, Array]:
        """Return the most negative and the largest velocity allowed at positions (..., n), infinite for none.

        At the edge of a range, or beyond it, and near to it there is none but `ROOM` left.
        """
        free = ~np.isfinite(self.deceleration)
        d, low, high = (np.where(free, 1.0, each) for each in (self.deceleration, *self.position.T))
        down, up = (allowed_speed(x, d, self.offset) for x in (position - low, high - position))
        return -np.where(free, np.inf, down), np.where(free, np.inf, up)


@comparable
class ApproachUse:
    """Where a component uses most of its limit.

    Attributes:
        component: Index.
        used: Largest share of the limit, which is how many times longer the motion must last to keep it.
        velocity: There, signed, SI.
        limit: On the velocity there, with its sign, SI.
        distance: To the bound ahead, SI; negative behind it.
        time: On the curve's own time, s.
    """

    component: int
    used: float
    velocity: float
    limit: float
    distance: float
    time: float


def allowed_speed(distance: Array, deceleration: Array, offset: Array) -> Array:
    """Return the speed with which bounds may be approached from a distance; arrays broadcast."""
    stopped = np.sqrt(2.0 * deceleration * np.maximum(distance, 0.0))
    return np.asarray(np.maximum(stopped - offset, 0.0) + ROOM)


def approach_uses(breaks: Array, coefficients: Array, limits: ApproachLimits) -> list[ApproachUse]:
    """Return for each component that has a limit where it uses most of it, in either direction.

    Args:
        breaks: Shape (w + 1,), s.
        coefficients: Shape (degree + 1, w, n), highest power first, in powers of the time since the break.
        limits: Of the n components.
    """
    limited, found = limits.limited, []
    approaches, d, o = _approaches(coefficients, np.diff(breaks), limits)
    used, times = _piece_uses(approaches, np.diff(breaks), d, o)
    for k, component in enumerate(limited.tolist()):
        both = used[:, [k, k + limited.size]]
        piece, end = divmod(int(both.argmax()), 2)
        column, t = k + end * limited.size, times[piece, k + end * limited.size]
        polynomial = approaches[:, piece, column]
        distance, speed = (
            float(horner(polynomial, t)),
            -float(horner(derivative_coefficients(polynomial, 1), t)),
        )
        bound = float(allowed_speed(np.array(distance), d[column], o[column])) - ROOM
        bound = bound if bound > ROOM else 0.0
        sign = -1.0 if end else 1.0
        use = (float(both[piece, end]), sign * speed, sign * bound, distance, float(breaks[piece] + t))
        found.append(ApproachUse(component, *use))
    return found


def uses_of_pieces(
    coefficients: Array, lengths: Array, limits: ApproachLimits, at_least: float
) -> tuple[Array, Array]:
    """Return how much of their limits components use in each piece, and when, both of shape (w, 2 m).

    Args:
        coefficients: Shape (degree + 1, w, n), highest power first.
        lengths: Of the pieces, which need not be one curve, shape (w,).
        limits: Of the n components, m of which have one.
        at_least: What uses less may use a little more than is returned.
    """
    approaches, d, o = _approaches(coefficients, lengths, limits)
    return _piece_uses(approaches, lengths, d, o, at_least)


def durations_at_limit(coefficients: Array, lengths: Array, limits: ApproachLimits, near: float) -> Array:
    """Return for how long each component that has a limit is at it, or above, shape (m,).

    Args:
        coefficients: Shape (degree + 1, w, n), highest power first.
        lengths: Of the pieces, shape (w,).
        limits: Of the n components, m of which have one.
        near: Relative: as near as that to the limit counts.
    """
    approaches, d, o = _approaches(coefficients, lengths, limits)
    shape = approaches.shape[1:]
    distances = approaches.reshape(len(approaches), -1)
    speeds = -derivative_coefficients(distances, 1)
    excess = _excess(distances, speeds / (1 - near), *(np.tile(each, shape[0]) for each in (d, o)))
    whole = np.repeat(lengths, shape[1])
    roots = (all_roots(each[:, :, None], whole)[:, :, 0] for each in (excess, speeds))
    knots = np.sort(np.concatenate([np.zeros((1, whole.size)), whole[None], *roots]), axis=0)
    middles = (knots[1:] + knots[:-1]) / 2
    at_limit = (horner(excess, middles) >= 0) & (horner(speeds, middles) > ROOM)
    seconds = np.where(at_limit, np.diff(knots, axis=0), 0.0).sum(axis=0).reshape(shape).sum(axis=0)
    return np.asarray(seconds[: shape[1] // 2] + seconds[shape[1] // 2 :])


def _approaches(coefficients: Array, lengths: Array, limits: ApproachLimits) -> tuple[Array, Array, Array]:
    """Return the distances (degree + 1, w, 2 m) to upper and then lower ends, and limits (2 m,).

    They are larger by what rounding makes of them: who brakes into a bound comes near to it with a speed that
    is large beside the root of a distance which is rounded to nothing.
    """
    limited = limits.limited
    to_upper, to_lower = -coefficients[:, :, limited], coefficients[:, :, limited]
    low, high = limits.position[limited].T
    summed = horner(np.abs(to_lower), lengths[:, None])
    to_upper[-1] += high + _ROUNDING * (summed + np.abs(high))
    to_lower[-1] -= low - _ROUNDING * (summed + np.abs(low))
    d, o = (np.tile(each[limited], 2) for each in (limits.deceleration, limits.offset))
    return np.concatenate([to_upper, to_lower], axis=2), d, o


def _piece_uses(
    distances: Array, lengths: Array, deceleration: Array, offset: Array, at_least: float | None = None
) -> tuple[Array, Array]:
    """Return how much of their limits approaches use in each piece, and when, (w, m).

    What uses less than `at_least`, by default than another piece of its column, is not looked at closely.
    """
    speeds = -derivative_coefficients(distances, 1)
    (fastest,) = critical_points(speeds, lengths, (0,))
    d, o = (np.broadcast_to(each, distances.shape[1:]) for each in (deceleration, offset))
    column = lengths[:, None]
    ends = np.broadcast_to(np.stack([0.0 * column, column]), (2, *distances.shape[1:]))
    used, times = _largest_ratio(distances, speeds, np.concatenate([ends, fastest]), (d, o))
    level = used.max(axis=0) if at_least is None else np.full(used.shape[1], at_least)
    slowest, nearest = (control_points(each, column) for each in (speeds, distances))
    allowed = allowed_speed(nearest.min(axis=0), d, o)
    near = np.nonzero((slowest.max(axis=0) > level * allowed) & (used > 0.0) & (used < _HOPELESS))
    if near[0].size:
        rows = distances[:, near[0], near[1]]
        at_ends = np.maximum(used[near], level[near[1]])
        raised, when = _raised(rows, lengths[near[0]], (d[near], o[near]), at_ends)
        better = raised > at_ends
        used[tuple(index[better] for index in near)] = raised[better]
        times[tuple(index[better] for index in near)] = when[better]
    return used, times


def _largest_ratio(
    distances: Array, speeds: Array, candidates: Array, limit: Sequence[Array]
) -> tuple[Array, Array]:
    """Return the largest share (...) of the limit at candidates (k, ...), and at which it is."""
    speed, distance = horner(speeds, candidates), horner(distances, candidates)
    ratio = np.maximum(speed, 0.0) / allowed_speed(distance, *limit)
    best = ratio.argmax(axis=0)[None]
    return np.take_along_axis(ratio, best, 0)[0], np.take_along_axis(candidates, best, 0)[0]


def _raised(distances: Array, lengths: Array, limit: Sequence[Array], at_ends: Array) -> tuple[Array, Array]:
    """Return the uses (a,) of single pieces, raised from those `at_ends`, and when they are."""
    crossings = _crossings(distances, lengths, limit)
    ratio, times = _largest_ratio(distances, -derivative_coefficients(distances, 1), crossings, limit)
    used = np.maximum(at_ends, ratio)
    live = np.flatnonzero(used < _HOPELESS)
    if not live.size:
        return used, times
    for _ in range(_STEPS):
        x, length = distances[:, live], lengths[live]
        d, o = (each[live] for each in limit)
        speeds = -derivative_coefficients(x, 1)
        excess = _excess(x, speeds / used[live], d, o)
        (turns,) = critical_points(excess[:, :, None], length, (0,))
        inside = np.concatenate([turns[:, :, 0], length[None]])
        ratio, when = _largest_ratio(x, speeds, inside, (d, o))
        more = ratio > used[live]
        going = ratio > used[live] * (1.0 + _SETTLED)
        used[live[more]], times[live[more]] = ratio[more], when[more]
        live = live[going & (ratio < _HOPELESS)]
        if not live.size:
            break
    return used, times


def _crossings(distances: Array, lengths: Array, limit: Sequence[Array]) -> Array:
    """Return points (k, a) of pieces, among them all at which the distance is the least that lets one move.

    Who comes nearer than that is on its course to the bound there; what is fastest behind it may be nowhere
    else a candidate.
    """
    deceleration, offset = limit
    shifted = distances.copy()
    shifted[-1] -= offset**2 / (2.0 * deceleration)
    return np.concatenate([all_roots(shifted[:, :, None], lengths)[:, :, 0], lengths[None]])


def _excess(distances: Array, speeds: Array, deceleration: Array, offset: Array) -> Array:
    """Return the polynomials (v + o - ROOM)^2 - 2 d x, shape (2 degree - 1 or degree + 1, a)."""
    shifted = speeds.copy()
    shifted[-1] += offset - ROOM
    count, size = len(shifted), max(2 * len(shifted) - 1, len(distances))
    excess = np.zeros((size, distances.shape[1]))
    for power in range(count):
        excess[size - 2 * count + 1 + power : size - count + 1 + power] += shifted[power] * shifted
    excess[size - len(distances) :] -= 2.0 * deceleration * distances
    return excess
