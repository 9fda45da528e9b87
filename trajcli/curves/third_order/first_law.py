"""First law: the moving average of the law of second order between its stops, on nodes that are even in time.

The average of s over a window of width w has the speed (s(t + w/2) - s(t - w/2)) / w and the acceleration
(sd(t + w/2) - sd(t - w/2)) / w, which is continuous wherever sd is: steps of acceleration become ramps.
"""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial, horner
from trajcli.curves.third_order.quartic_law import QuarticLaw
from trajcli.curves.time_optimal.parameterization import TimeOptimalMotion
from trajcli.frozen import frozen

_NODES = 64  # over the whole path
_FEWEST = 3  # of a piece of the path
_MANY = 64  # breaks of a section between two stops: with more, a node at each is enough
_NARROWEST = 1e-8  # of the duration of a section: rounding is all that a narrower window would show
_WIDEST = 0.3  # likewise: a wider window would leave nothing of the law
_SEARCHED = 8  # samples between two nodes, among which the times of breaks are looked up
_NEWTON = 12  # steps after that
_SLOWEST = 0.3  # of the speed at an end: an acceleration there is not followed to less
_REST = (0.0, 0.0)


@frozen
class MovingAverage:
    """The average of a law s(t), which goes on at the speeds of its ends before its start and after its end.

    Attributes:
        law: Of dimension 1.
        width: Of the window, s, positive.
        speeds: Before the start and after the end.
    """

    law: PiecewisePolynomial
    width: float
    speeds: tuple[float, float]

    @property
    def start(self) -> float:
        """When it begins to move, or shortly before it passes the start of the law."""
        return self.law.start - 0.5 * self.width

    @property
    def end(self) -> float:
        """When it arrives, or shortly after it passes the end of the law."""
        return self.law.end + 0.5 * self.width

    def states(self, t: Array) -> tuple[Array, Array, Array]:
        """Return s, sd and sdd at times (k,) from start to end."""
        late, early = t + 0.5 * self.width, t - 0.5 * self.width
        s = (self._covered(late) - self._covered(early)) / self.width
        speed = (self._s(late) - self._s(early)) / self.width
        return s, speed, (self._speed(late) - self._speed(early)) / self.width

    def _outside(self, t: Array) -> tuple[Array, Array, Array]:
        """Return how long before the start and after the end, and the nearest time within the law."""
        law = self.law
        return np.minimum(t - law.start, 0.0), np.maximum(t - law.end, 0.0), np.clip(t, law.start, law.end)

    def _s(self, t: Array) -> Array:
        before, after, inside = self._outside(t)
        return np.asarray(self.law.evaluate(inside)[:, 0] + before * self.speeds[0] + after * self.speeds[1])

    def _speed(self, t: Array) -> Array:
        before, after, inside = self._outside(t)
        speed = self.law.evaluate(inside, 1)[:, 0]
        return np.where(before < 0, self.speeds[0], np.where(after > 0, self.speeds[1], speed))

    def _covered(self, t: Array) -> Array:
        """Return the integral of s from the start of the law to t."""
        law = self.law
        powers = np.arange(law.degree + 1, 0, -1)[:, None]
        rows = np.concatenate([law.coefficients[:, :, 0] / powers, np.zeros((1, law.pieces))])
        whole = np.concatenate([[0.0], np.cumsum(horner(rows, law.lengths))])
        before, after, inside = self._outside(t)
        piece = np.clip(np.searchsorted(law.breaks, inside, "right") - 1, 0, law.pieces - 1)
        first, last = float(law.evaluate(law.start)[0]), float(law.evaluate(law.end)[0])
        early = before * first + 0.5 * before**2 * self.speeds[0]
        late = after * last + 0.5 * after**2 * self.speeds[1]
        return np.asarray(horner(rows[:, piece], inside - law.breaks[piece]) + whole[piece] + early + late)


@frozen
class EndStates:
    """sd and sdd at the start and at the end of a path, both zero where the motion is at rest.

    Attributes:
        start: sd, not negative, and sdd.
        end: The same.
    """

    start: tuple[float, float]
    end: tuple[float, float]

    @property
    def rests(self) -> bool:
        """Whether both are rest, so that the motion may be slowed down as a whole."""
        return self.start[0] == 0.0 == self.end[0]


def smoothed_law(
    path: PiecewisePolynomial,
    second: TimeOptimalMotion,
    bounds: tuple[Array, Array],
    ends: EndStates,
) -> QuarticLaw:
    """Return a law at rest at all stops of a path, with the given states at its ends.

    Args:
        path: q(s) with n joints.
        second: The optimum of second order along it.
        bounds: Of acceleration and of jerk, each of shape (n, 2).
        ends: Speeds and accelerations.

    Raises:
        ReversingLawError: When no law that leads forward has these accelerations at its ends.
    """
    ramp = _longest_ramp(*bounds, second.law.duration)
    times = np.concatenate([[0.0], second.stop_times, [second.law.end]])
    borders = np.concatenate([[path.start], second.stops, [path.end]])
    last, parts = borders.size - 2, list[list[Array]]()
    for k in range(last + 1):
        law = _section(second.law, times[k : k + 2])
        inner = path.breaks[(path.breaks > borders[k]) & (path.breaks < borders[k + 1])]
        breaks = np.concatenate([borders[k : k + 1], inner, borders[k + 1 : k + 2]])
        around = EndStates(ends.start if k == 0 else _REST, ends.end if k == last else _REST)
        width = min(max(ramp, _NARROWEST * law.duration), _WIDEST * law.duration)
        average = MovingAverage(law, width, (around.start[0], around.end[0]))
        count = max(_NODES * law.duration / second.law.duration, _FEWEST)
        states = _nodes(average, breaks, count, around)
        parts.append([row[k > 0 :] for row in states])
    joined = QuarticLaw(*(np.concatenate(rows) for rows in zip(*parts, strict=True)))
    return joined.calmed()


def _longest_ramp(acceleration: Array, jerk: Array, longest: float) -> float:
    """Return the longest time in which the jerk of a joint ramps its acceleration up, or else the longest."""
    with np.errstate(invalid="ignore"):
        ramps = np.abs(acceleration).min(axis=1) / np.abs(jerk).min(axis=1)
    ramps = ramps[np.isfinite(ramps) & (ramps > 0.0)]
    return float(ramps.max(initial=0.0)) or longest


def _section(law: PiecewisePolynomial, interval: Array) -> PiecewisePolynomial:
    """Return the part of a law between two of its breaks."""
    first, last = np.searchsorted(law.breaks, interval)
    return PiecewisePolynomial(law.breaks[first : last + 1], law.coefficients[:, first:last])


def _nodes(
    average: MovingAverage, breaks: Array, count: float, ends: EndStates
) -> tuple[Array, Array, Array]:
    """Return s, sd and sdd at nodes between breaks (k,), evenly in time; their number is about `count`."""
    passed = _passed(average, breaks, count)
    spacing = (passed[-1] - passed[0]) / count
    fewest = _FEWEST if breaks.size <= _MANY else 1
    parts = np.maximum(np.ceil(np.diff(passed) / spacing), fewest).astype(np.intp)
    owner = np.repeat(np.arange(parts.size), parts)
    step = np.arange(owner.size) - (np.cumsum(parts) - parts)[owner]
    times = passed[owner] + np.diff(passed)[owner] * step / parts[owner]
    s, speed, acceleration = average.states(np.append(times, passed[-1]))
    s[np.append(step == 0, True)] = breaks
    for end, state in ((0, ends.start), (-1, ends.end)):
        if state[0] > 0.0:
            near = abs(
                float(average.states(np.array([passed[end] + (1 + 2 * end) * average.width]))[0][0] - s[end])
            )
            speed, acceleration = _led_to(state, s - s[end], 1 + 2 * end, near, speed, acceleration)
        speed[end], acceleration[end] = state
    return s, speed, acceleration


def _led_to(
    state: tuple[float, float], offsets: Array, sign: int, length: float, speed: Array, acceleration: Array
) -> tuple[Array, Array]:
    """Return speeds and accelerations that come near to a state as the offsets (k,) from it vanish.

    They come near to those of a constant acceleration that leads through the state: where it is slow, and
    slows down or has just begun to move, its speed is another one soon. It is led away over `length`;
    `sign` is 1 where the state is the first one, or -1.
    """
    x = np.minimum(np.abs(offsets) / length, 1.0)
    weight, slope = x**2 * (3.0 - 2.0 * x), sign * 6.0 * x * (1.0 - x) / length
    squares = 1.0 + 2.0 * state[1] * offsets / state[0] ** 2
    wanted = state[0] * np.sqrt(np.maximum(squares, _SLOWEST**2))
    rising = np.where(squares > _SLOWEST**2, state[1] / wanted, 0.0)
    led = wanted + (speed - wanted) * weight
    with np.errstate(divide="ignore", invalid="ignore"):
        along = np.where(speed > 0.0, acceleration / speed, 0.0)
    changed = led * (slope * (speed - wanted) + weight * along + (1.0 - weight) * rising)
    return led, np.where(x < 1.0, changed, acceleration)


def _passed(average: MovingAverage, breaks: Array, count: float) -> Array:
    """Return when the average passes breaks (k,); where it rests at the first or the last, when it does."""
    times = np.linspace(average.start, average.end, _SEARCHED * (int(count) + _FEWEST * breaks.size))
    passed = np.interp(breaks, average.states(times)[0], times)
    spacing = times[1] - times[0]
    for _ in range(_NEWTON):
        s, speed, _ = average.states(passed)
        with np.errstate(divide="ignore", invalid="ignore"):
            step = np.where(speed > 0, (breaks - s) / speed, 0.0)
        passed = np.clip(passed + np.clip(step, -spacing, spacing), average.start, average.end)
    if average.speeds[0] == 0.0:
        passed[0] = average.start
    if average.speeds[1] == 0.0:
        passed[-1] = average.end
    return passed
