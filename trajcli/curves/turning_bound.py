"""Lower bounds of durations: the time that each joint alone needs between its turning points.

Where a joint turns back it stands still, at whatever acceleration. So between two turning points it needs at
least the time of the fastest motion over their distance with speed zero at both and free acceleration there,
and with the states of the motion's ends where that begins or ends. Where only points to pass are given, it
turns at or beyond them. The sum over its monotone stretches bounds the motion, and so does the largest sum of
all joints. Turning back by next to nothing is left out, which only lowers the bound.

The fastest such motion goes up to a peak speed by one ramp and down by another, with a cruise between them
where the peak is the limit. A ramp with free acceleration at its outer end begins with as much as it may: to
gain w it takes sqrt(2 w / j), or where that needs more than the limit a, w / a + a / (2 j); from rest without
acceleration 2 sqrt(w / j), or w / a + a / j.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.extrema import critical_points
from trajcli.curves.operations import cut
from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side, horner
from trajcli.frozen import frozen

_NOTHING = 1e-9  # of the range of a joint: turning back by less is rounding
_UNLIMITED = 1e9  # rad/s or m/s, where no limit is
_HALVINGS = 64
_BACK = 1e-6  # of directions of length 1: opposite ones that differ by less go back
_SIDES: tuple[Side, Side] = ("left", "right")
_ROUNDING = 1e-12  # relative: taken off, so that a bound stays one


@frozen
class MonotoneStretches:
    """Intervals of one joint between turning points, k of them; rates are along each, all positive.

    Attributes:
        distance: Shape (k,).
        limit: Speed, shape (k,).
        rates: Acceleration at which it speeds up, and slows down, shape (2, k).
        jerk: Shape (k,).
        speeds: At its start and end, shape (2, k).
        free: Whether the acceleration is free there, shape (2, k).
    """

    distance: Array
    limit: Array
    rates: Array
    jerk: Array
    speeds: Array
    free: NDArray[np.bool_]

    @classmethod
    def between(
        cls, turns: Array, bounds: Sequence[Array], speeds: Array, free: NDArray[np.bool_]
    ) -> MonotoneStretches:
        """Return the stretches of one joint between its turning points; none where nothing bounds their time.

        Args:
            turns: Its first position, those at which it turns and the last one, shape (k + 1,).
            bounds: Of its velocity, acceleration and jerk, each of shape (2,).
            speeds: At its start and end, along its direction there, at least 0, shape (2,).
            free: Whether the acceleration is free there, shape (2,).
        """
        steps = np.diff(turns if np.isfinite(bounds[1]).all() else turns[:1])
        up, down = (steps > 0).astype(int), (steps <= 0).astype(int)
        velocity, acceleration, jerk = (np.abs(each) for each in bounds)
        at_ends, free_ends = np.zeros((2, steps.size)), np.ones((2, steps.size), dtype=bool)
        for end, position in enumerate((slice(0, 1), slice(-1, None))):
            at_ends[end, position], free_ends[end, position] = speeds[end], free[end]
        return cls(
            np.abs(steps),
            np.minimum(velocity[up], _UNLIMITED),
            np.stack([acceleration[up], acceleration[down]]),
            np.full(steps.size, float(jerk.max())),
            at_ends,
            free_ends,
        )

    def least_times(self) -> Array:
        """Return the least time of each, shape (k,)."""
        low, high = self.speeds.max(axis=0), np.maximum(self.limit, self.speeds.max(axis=0))
        covered = self._covered(low)[0] <= self.distance  # else nothing is said of how it stops
        for _ in range(_HALVINGS):
            middle = 0.5 * (low + high)
            fits = self._covered(middle)[0] <= self.distance
            low, high = np.where(fits, middle, low), np.where(fits, high, middle)
        length, time = self._covered(low)
        remainder = np.maximum(self.distance - length, 0.0) / np.maximum(high, low)
        least = np.where(covered, time + remainder, self.distance / self.limit)
        return np.asarray(least * (1.0 - _ROUNDING))

    def _covered(self, peak: Array) -> tuple[Array, Array]:
        """Return distance and time of both ramps to and from peak speeds (k,)."""
        change = np.maximum(peak - self.speeds, 0.0)
        full = self.rates / self.jerk
        share = np.where(self.free, 0.5, 1.0)  # of a ramp of acceleration over its whole range
        short = change <= share * self.rates * full
        time_short = np.where(self.free, np.sqrt(2.0 * change / self.jerk), 2.0 * np.sqrt(change / self.jerk))
        gain_short = np.where(self.free, 2.0 / 3.0, 0.5) * change * time_short
        even = np.maximum(change - 0.5 * self.rates * full, 0.0) / self.rates
        gained = self.rates * even
        gain_free = 0.5 * gained * even + gained * full + self.rates * full**2 / 3.0
        time_long = np.where(self.free, even + full, change / self.rates + full)
        gain_long = np.where(self.free, gain_free, 0.5 * change * time_long)
        time = np.where(short, time_short, time_long)
        length = self.speeds * time + np.where(short, gain_short, gain_long)
        return length.sum(axis=0), time.sum(axis=0)


def turning_bound(
    path: PiecewisePolynomial,
    bounds: tuple[Array, Array, Array],
    speeds: tuple[float, float],
    turning: tuple[bool, bool] = (False, False),
) -> tuple[float, int]:
    """Return a duration that no motion along a path is shorter than, s, and the joint that needs it.

    Args:
        path: q(s) with n joints.
        bounds: Of velocity, acceleration and jerk, each of shape (n, 2).
        speeds: sd at the start and at the end; zero is rest, without acceleration unless it turns back.
        turning: Whether all joints turn back at the start, and at the end.
    """
    values, free = _at_breaks_and_turns(path), (np.array(speeds) > 0.0) | turning
    slopes = np.abs(path.evaluate(np.array([path.start, path.end]), 1)) * np.array(speeds)[:, None]
    times = durations_by_joint(
        [
            MonotoneStretches.between(
                turning_points(values[:, joint]), [each[joint] for each in bounds], slopes[:, joint], free
            )
            for joint in range(path.dimension)
        ]
    )
    return float(times.max()), int(times.argmax())


def bound_between_stops(
    path: PiecewisePolynomial,
    bounds: tuple[Array, Array, Array],
    speeds: tuple[float, float],
    stops: Array,
) -> tuple[float, int | None]:
    """Return what `turning_bound` does of a path with stops: between them the slowest joint counts each time.

    sd is zero at a stop and nowhere below, so that sdd is zero there where it exists. At a corner q' sdd
    is the same on both sides, which are not parallel: it is zero, too. Only where the path goes back as it
    came may the acceleration be anything. Straight lines are bounded by the tightest limits of all joints.

    Args:
        path: Likewise.
        bounds: Likewise.
        speeds: Likewise.
        stops: Values of s between the ends, shape (k,), at which the motion stands.

    Returns:
        The duration, and the joint that needs it; None where there are stops.
    """
    if not stops.size:
        return turning_bound(path, bounds, speeds)
    turning = [False, *(_goes_back(path, s) for s in stops.tolist()), False]
    at_stops, total = [speeds[0], *np.zeros(stops.size), speeds[1]], []
    for k, s in enumerate([*stops.tolist(), path.end]):
        part, path = cut(path, s) if s < path.end else (path, path)
        ends, turns = (at_stops[k], at_stops[k + 1]), (turning[k], turning[k + 1])
        found = [turning_bound(part, bounds, ends, turns)[0]]
        if part.pieces == 1 and not part.coefficients[:-2].any():
            slopes = part.coefficients[-2, 0]
            velocity, acceleration, jerk = (bounds_along(slopes, bound)[None] for bound in bounds)
            found.append(turning_bound(_length_of(part), (velocity, acceleration, jerk), ends, turns)[0])
        total.append(max(found))
    return math.fsum(total), None


def _goes_back(path: PiecewisePolynomial, s: float) -> bool:
    """Return whether a path goes back at s as it came, or has no direction there."""
    before, behind = (path.evaluate(np.array([s]), 1, side=side)[0] for side in _SIDES)
    sizes = float(np.linalg.norm(before)), float(np.linalg.norm(behind))
    if min(sizes) == 0.0:
        return True
    return float(np.abs(before / sizes[0] + behind / sizes[1]).max()) < _BACK


def _length_of(line: PiecewisePolynomial) -> PiecewisePolynomial:
    """Return s along a line, as a curve of s."""
    return PiecewisePolynomial(line.breaks, np.array([[[1.0]], [[line.start]]]))


def bounds_along(slopes: Array, bounds: Array) -> Array:
    """Return the bounds (2,) of a derivative of s along a line with q' (n,), by those of joints (n, 2)."""
    moving = slopes != 0.0
    with np.errstate(over="ignore"):
        ratios = np.sort(bounds[moving] / slopes[moving, None], axis=1)
    return np.array([ratios[:, 0].max(), ratios[:, 1].min()])


def durations_by_joint(joints: Sequence[MonotoneStretches]) -> Array:
    """Return the least time that each of n joints needs for all of its stretches; 0 where it has none."""
    owner = np.repeat(np.arange(len(joints)), [each.distance.size for each in joints])
    names = ("distance", "limit", "rates", "jerk", "speeds", "free")
    joined = MonotoneStretches(
        *(np.concatenate([getattr(each, name) for each in joints], axis=-1) for name in names)
    )
    return np.asarray(np.bincount(owner, joined.least_times(), len(joints)), dtype=np.float64)


def _at_breaks_and_turns(path: PiecewisePolynomial) -> Array:
    """Return q at all breaks and wherever a q' vanishes, in order of s for each joint, shape (m, n)."""
    (inside,) = critical_points(path.coefficients, path.lengths, (0,))
    points = np.concatenate([np.zeros((1, path.pieces, path.dimension)), inside])
    values = horner(path.coefficients, points).transpose(1, 0, 2).reshape(-1, path.dimension)
    return np.concatenate([values, path.evaluate(np.array([path.end]))])


def turning_points(values: Array) -> Array:
    """Return the first of values (m,), those at which their direction changes, and the last one."""
    nothing = _NOTHING * float(np.ptp(values))
    kept = [float(values[0])]
    for value in values[1:].tolist():
        if abs(value - kept[-1]) <= nothing:
            continue
        if len(kept) > 1 and (value - kept[-1]) * (kept[-1] - kept[-2]) > 0:
            kept[-1] = value
        else:
            kept.append(value)
    return np.array(kept)
