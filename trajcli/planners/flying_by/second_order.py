"""Proven lower bound of the duration of a chain: motions without limits of jerk, each joint alone in zones.

Along a course only the speed at each s counts: it is below the limit of speed there, and its square rises
and falls no faster than limits of acceleration allow. Through a zone each joint goes by itself from one
velocity to another, and its velocity is below what accelerates from the one and brakes to the other. Speeds
at borders are in intervals, and the fastest chain of intervals is found by dynamic programming: what each
part lasts at least for speeds anywhere in two of them is added up. Chains that last longer than the motion
that is known are left out, the other intervals are halved. All motions obey these relations, so that the
bound holds whatever the search does. Next to stops limits of jerk count, too.

Source: Bobrow, Dubowsky and Gibson (1985), for speeds over s; Bellman (1957).
"""

from __future__ import annotations

import math

import numpy as np

from trajcli.curves.piecewise import Array, control_points, derivative_coefficients, taylor_shift
from trajcli.frozen import frozen
from trajcli.planners.course import Course
from trajcli.planners.flying_by.between_stops import FlyByChain
from trajcli.planners.flying_by.search import least_sums

_CELLS = 48  # of a course, at least
_INTERVALS = 24  # of the speed at a border, at the most
_SETTLED = 3  # times that bounds of sd and sdd are found by each other
_STILL = 1e-3  # of the largest q': a joint that moves less may be moved by rounding alone
_ROUNDS = 6  # of halving
_HALVINGS = 30  # of a duration through a zone
_LARGE = 1e100  # stands for no bound
_ROUNDING = (
    1e-12  # of a step: one that is a ramp's own must not be less by rounding, as that would last much longer
)
_DIGIT = 1e-6  # s, to which a bound is rounded down: last bits of processors do not show
SAFE = 1e-9  # relative: taken off, for the rounding of sums

SpeedIntervals = Array
"""Least and largest speeds at a border, (n, 2)."""


def second_order_duration(chain: FlyByChain, duration: float) -> float:
    """Return a duration, s, that no motion of a chain falls below.

    Args:
        chain: Between two stops, or with a start in motion, with borders of the whole zones.
        duration: Of a motion that is known, s.
    """
    last, standing = len(chain.courses) - 1, [not rates.any() for rates in chain.ends]
    courses = [
        course_part(course, chain.stretch(k), (k == 0 and standing[0], k == last and standing[1]))
        for k, course in enumerate(chain.courses)
    ]
    parts: list[CoursePart | ZonePassage] = [courses[0]]
    borders = [np.full((1, 2), chain.ends[0][0])]
    for k in range(last):
        parts += [zone_passage(chain, k), courses[k + 1]]
        tops = courses[k].top(-1), courses[k + 1].top(0)
        borders += [_halved(np.array([[0.0, top]]), _INTERVALS) for top in tops]
    borders.append(np.full((1, 2), chain.ends[1][0]))
    least = 0.0
    for _ in range(_ROUNDS):
        lasting = [part.durations(borders[k], borders[k + 1], duration) for k, part in enumerate(parts)]
        through = [one + other for one, other in zip(*least_sums(lasting), strict=True)]
        least = max(least, float(through[0].min()))
        if least >= duration:
            break
        kept = [rows[values < duration] for rows, values in zip(borders, through, strict=True)]
        if not all(map(len, kept)):  # the sums of one border are rounded otherwise than those of another
            break
        borders = [kept[0], *(_halved(rows, _INTERVALS) for rows in kept[1:-1]), kept[-1]]
    return rounded_down(least)


def _halved(rows: SpeedIntervals, count: int) -> SpeedIntervals:
    """Return intervals, the widest ones divided, up to a number of them."""
    parts = max(1, count // len(rows))
    shares = np.linspace(0.0, 1.0, parts + 1)
    ends = rows[:, :1] + shares * (rows[:, 1:] - rows[:, :1])
    ends[:, -1] = rows[:, 1]
    return np.stack([ends[:, :-1], ends[:, 1:]], axis=2).reshape(-1, 2)


def rounded_down(bound: float) -> float:
    """Return a proven bound, s, without what rounding may have added to it."""
    return math.floor(bound * (1 - SAFE) / _DIGIT) * _DIGIT


@frozen
class CoursePart:
    """A course from border to border in cells of s, in each of which its law has bounds.

    Attributes:
        lengths: Of the cells, (m,).
        caps: Largest square of the speed in each, (m,).
        rises: Largest change of that square by s, (m,).
        falls: Largest one downwards, (m,).
        from_stops: Squares of speeds at ends of cells that a start from rest allows, and an end at rest,
            (2, m + 1); very large for none.
        least: Durations that jerk next to stops asks for in each, (m,), s.
    """

    lengths: Array
    caps: Array
    rises: Array
    falls: Array
    from_stops: Array
    least: Array

    def top(self, cell: int) -> float:
        """Return the largest speed at the outer end of the first cell, 0, or of the last one, -1."""
        return math.sqrt(float(self.caps[cell]))

    def durations(self, first: SpeedIntervals, last: SpeedIntervals, longest: float) -> Array:
        """Return what it lasts at least from speeds in some intervals to speeds in others, (p, q).

        Args:
            first: Of the speed at its start.
            last: Of the speed at its end.
            longest: What stands for what is not possible, s.
        """
        ahead = _swept(first[:, 1] ** 2, self.caps, self.rises, self.lengths)
        back = _swept(last[:, 1] ** 2, self.caps[::-1], self.falls[::-1], self.lengths[::-1])[:, ::-1]
        ahead, back = np.minimum(ahead, self.from_stops[0]), np.minimum(back, self.from_stops[1])
        squares = np.minimum(ahead[:, None], back)  # (p, q, m + 1)
        times = np.maximum(
            _cell_times(squares[:, :, :-1], self.caps, self.rises, self.lengths),
            _cell_times(squares[:, :, 1:], self.caps, self.falls, self.lengths),
        )
        found = np.maximum(times, self.least).sum(axis=2)
        never = (first[:, 0] ** 2)[:, None] > back[:, 0] * (1 + SAFE)
        never |= last[:, 0] ** 2 > (ahead[:, -1] * (1 + SAFE))[:, None]
        return np.where(never, longest, found)


def _swept(start: Array, caps: Array, slopes: Array, lengths: Array) -> Array:
    """Return largest squares of the speed at ends of cells, (p, m + 1), from those at the start (p,)."""
    rows = [np.minimum(start, caps[0])]
    for k, (cap, slope, length) in enumerate(zip(caps, slopes, lengths, strict=True)):
        following = min(cap, caps[k + 1]) if k + 1 < len(caps) else cap
        rows.append(np.minimum(rows[-1] + slope * length, following))
    return np.stack(rows, axis=1)


def _cell_times(squares: Array, caps: Array, slopes: Array, lengths: Array) -> Array:
    """Return what cells last at least, (p, q, m), with the square of the speed on one side."""
    speed = np.sqrt(squares)
    with np.errstate(divide="ignore", invalid="ignore"):
        rising = np.minimum(lengths, np.maximum(caps - squares, 0.0) / slopes)
        reached = np.sqrt(squares + slopes * rising)
        times = 2.0 * rising / (speed + reached) + (lengths - rising) / np.sqrt(caps)
    return np.where(np.isnan(times), 0.0, times)


def course_part(course: Course, stretch: tuple[float, float], stops: tuple[bool, bool]) -> CoursePart:
    """Return a course between borders in cells.

    Joints keep q' sd within their velocities and q' sdd + q'' sd^2 within their accelerations. In a cell q'
    and q'' lie within their control points. What bounds sdd bounds sd^2 where a joint turns back, which
    bounds sdd again.

    Args:
        course: Any.
        stretch: From which s to which.
        stops: Whether it is at rest at its start, and at its end.
    """
    positions, lengths, coefficients = _cells(course, stretch)
    slopes, bends = (
        control_points(derivative_coefficients(coefficients, order), lengths[:, None]) for order in (1, 2)
    )
    forward = np.where(slopes.max(axis=0) < 0, -1.0, 1.0)  # joints that go backwards are mirrored
    slopes, bends = slopes * forward, bends * forward
    size, largest = np.maximum(slopes.min(axis=0), 0.0), np.abs(slopes).max(axis=0)
    ahead = _ahead(course.robot.limits.velocity, forward)
    up = _ahead(course.robot.limits.acceleration, forward)
    down = _ahead(course.robot.limits.acceleration, -forward)
    speed, *others = course.limits_along or (math.inf, math.inf, math.inf)
    caps = np.minimum(_over(ahead, size) ** 2, min(speed, _LARGE) ** 2)
    rises = falls = np.full(len(lengths), _LARGE)
    for _ in range(_SETTLED):
        bounds = []
        for bound, sign, other in ((up, -1.0, others[0]), (down, 1.0, others[1])):
            extra = np.maximum((sign * bends).max(axis=0), 0.0) * caps[:, None]
            bounds.append(np.minimum(_over(bound + extra, size), min(other, _LARGE)))
        rises, falls = bounds
        change = largest * np.maximum(rises, falls)[:, None]
        for bound, sign in ((up, 1.0), (down, -1.0)):
            bent = np.maximum((sign * bends).min(axis=0), 0.0)
            caps = np.minimum(caps, _over(bound + change, bent))
    from_stops, times = _at_rest(positions, slopes * forward, course.robot.limits.jerk, stops)
    return CoursePart(lengths, caps, 2.0 * rises, 2.0 * falls, from_stops, times)


def _ahead(limits: Array, forward: Array) -> Array:
    """Return magnitudes of limits (n, 2) in the directions (m, n) in which joints go."""
    return np.where(forward > 0, limits[:, 1], -limits[:, 0])


def _over(bounds: Array, sizes: Array) -> Array:
    """Return the least quotient of each row (m,) of bounds by sizes, each (m, n), those of zero left out."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(sizes > 0, np.minimum(bounds / sizes, _LARGE), _LARGE).min(axis=1))


def _cells(course: Course, stretch: tuple[float, float]) -> tuple[Array, Array, Array]:
    """Return q at ends of cells of a course (m + 1, n), their lengths (m,), and q(s) in each, (k, m, n)."""
    begin, end = stretch
    breaks = course.curve.breaks
    inner = breaks[(breaks > begin) & (breaks < end)]
    ends = np.unique(np.concatenate([np.linspace(begin, end, _CELLS + 1), inner]))
    piece = np.clip(
        np.searchsorted(breaks, 0.5 * (ends[:-1] + ends[1:]), side="right") - 1, 0, len(breaks) - 2
    )
    offsets = ends[:-1] - breaks[piece]
    shifted = taylor_shift(course.curve.coefficients[:, piece], offsets[:, None])
    return course.curve.evaluate(ends), np.diff(ends), shifted


def _at_rest(positions: Array, slopes: Array, jerk: Array, stops: tuple[bool, bool]) -> tuple[Array, Array]:
    """Return what limits of jerk ask next to stops.

    As long as a joint goes forward from rest a^2 <= 2 J v, as a da <= J dv, so that v dv / dq <= sqrt(2 J v):
    after the way q its velocity is at most (9 J q^2 / 2)^(1/3), and q takes at least (6 q / J)^(1/3).
    Backwards in time the jerk keeps its sign.

    Args:
        positions: Of joints at ends of cells, (m + 1, n).
        slopes: Control points of q' in cells, (k, m, n).
        jerk: Limits, (n, 2).
        stops: Whether the course is at rest at its start, and at its end.

    Returns:
        Largest squares of the speed (2, m + 1), from both ends, and least times of cells (m,).
    """
    squares, times = np.full((2, len(positions)), _LARGE), np.zeros(len(positions) - 1)
    still = np.abs(slopes).max(axis=0) < _STILL * np.abs(slopes).max()
    least, largest = (np.where(still, 0.0, each) for each in (slopes.min(axis=0), slopes.max(axis=0)))
    for side in np.flatnonzero(stops).tolist():
        rows, low, high = (each[::-1] if side else each for each in (positions, least, largest))
        limits, covered = np.stack([jerk[:, 1], -jerk[:, 0]]), np.abs(rows - rows[0])
        keeps = [np.logical_and.accumulate(each) for each in (low > 0, high < 0)]
        for joints, limit, sizes in zip(keeps, limits, (low, -high), strict=True):
            speeds = np.cbrt(4.5 * np.minimum(limit, _LARGE) * covered[1:] ** 2)
            found = _over(speeds, np.where(joints, sizes, 0.0)) ** 2
            own = np.where(joints, np.diff(np.cbrt(6.0 * covered / limit), axis=0), 0.0).max(axis=1)
            squares[side, 1:] = np.minimum(squares[side, 1:], found)
            times = np.maximum(times, own[::-1] if side else own)
    squares[1] = squares[1, ::-1]
    return squares, times


@frozen
class ZonePassage:
    """A zone from border to border: joints alone, with bounded velocities and accelerations.

    Attributes:
        steps: How far each joint goes, (n,).
        before: q' at the border before, (n,).
        behind: q' at the border behind, (n,).
        velocity: Limits, (n, 2).
        acceleration: Limits, (n, 2).
    """

    steps: Array
    before: Array
    behind: Array
    velocity: Array
    acceleration: Array

    def durations(self, first: SpeedIntervals, last: SpeedIntervals, longest: float) -> Array:
        """Return what it lasts at least from speeds in some intervals to speeds in others, (p, q).

        Args:
            first: Of the speed at its start.
            last: Of the speed at its end.
            longest: What stands for what is not possible, and for all that is longer, s.
        """
        v0, v1 = (
            np.sort(rows[None] * slopes[:, None, None], axis=2)
            for rows, slopes in ((first, self.before), (last, self.behind))
        )
        lowest, highest = self.velocity.T[:, :, None, None]
        brake, gain = self.acceleration.T[:, :, None, None] * [[[[-1.0]]], [[[1.0]]]]
        low0, high0, low1, high1 = v0[:, :, :1], v0[:, :, 1:], v1[:, None, :, 0], v1[:, None, :, 1]
        since = np.maximum((low1 - high0) / gain, (low0 - high1) / brake).max(axis=0)
        since = np.clip(since, 0.0, longest)
        steps = self.steps[:, None, None]
        up = _until(since, (steps, high0, high1, gain, brake, highest), longest)
        down = _until(up, (-steps, -low0, -low1, brake, gain, -lowest), longest)
        return np.asarray(down)


def _until(since: Array, passage: tuple[Array, ...], longest: float) -> Array:
    """Return the least durations, from given ones on, in which joints can go as far as their steps.

    In T one goes at most as far as the integral of min(v, v0 + a t, v1 + b (T - t)), which is a convex
    function of T as long as it does not reach v, and rises then: what is too short is one interval.

    Args:
        since: Durations, (p, q).
        passage: The step of each joint, its largest velocities at the start and at the end, its
            accelerations a and b, and its largest velocity v, each broadcast to (n, p, q).
        longest: The longest duration that matters, s.
    """
    rows = list(np.broadcast_arrays(since[None], *passage))
    low, rows[1] = np.array(rows[0]), rows[1] - _ROUNDING * np.abs(rows[1])
    short = _farthest(low, *rows[2:]) < rows[1]
    some = [row[short] for row in rows[1:]]
    below, above = low[short], np.full(int(short.sum()), longest)
    never = _farthest(above, *some[1:]) < some[0]
    for _ in range(_HALVINGS):
        middle = 0.5 * (below + above)
        shorter = _farthest(middle, *some[1:]) < some[0]
        below, above = np.where(shorter, middle, below), np.where(shorter, above, middle)
    low[short] = np.where(never, longest, below)
    return np.asarray(low.max(axis=0))


def _farthest(duration: Array, v0: Array, v1: Array, gain: Array, brake: Array, top: Array) -> Array:
    """Return the integral of min(v, v0 + a t, v1 + b (T - t)) over t from 0 to T."""
    turn = np.clip((v1 - v0 + brake * duration) / (gain + brake), 0.0, duration)
    found = v0 * turn + 0.5 * gain * turn**2
    left = duration - turn
    found = found + v1 * left + 0.5 * brake * left**2
    for velocity, slope, time in ((v0, gain, turn), (v1, brake, left)):
        over, least = np.maximum(velocity + slope * time - top, 0.0), np.maximum(velocity - top, 0.0)
        found = found - 0.5 * (over**2 - least**2) / slope
    return np.asarray(found)


def zone_passage(chain: FlyByChain, number: int) -> ZonePassage:
    """Return a zone of a chain as a passage from border to border."""
    corner = chain.corners[number]
    before, behind = chain.courses[number].curve, chain.courses[number + 1].curve
    borders = np.array([corner.left]), np.array([corner.joined])
    first, last = before.evaluate_orders(borders[0], (0, 1))[0], behind.evaluate_orders(borders[1], (0, 1))[0]
    limits = corner.robot.limits
    return ZonePassage(last[0] - first[0], first[1], last[1], limits.velocity, limits.acceleration)
