"""Position curves p(s) by arc length: lines, parts of curves, and a fixed position."""

from __future__ import annotations

from typing import Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike

from trajcli.errors import Amount, InputError, PlanningError, Problem
from trajcli.frozen import frozen
from trajcli.geometry.rotation import Array

Side = Literal["left", "right"]
Triple = tuple[Array, Array, Array]
SAME_POINT = 1e-9  # m, below which two points are one: no robot is that exact, and rounding is far below
_ROUNDING = 1e-9  # of the length, by which laws end beside it


class Parametrised(Protocol):
    """What a law s(t) leads along: how far s goes, and where that is not smooth."""

    @property
    def length(self) -> float:
        """How far s goes."""
        ...

    @property
    def breaks(self) -> Array:
        """Where a derivative may jump."""
        ...

    @property
    def stops(self) -> Array:
        """Where a law must stop."""
        ...


class PositionCurve(Parametrised, Protocol):
    """A curve p(s) in space, s its arc length from 0 to `length`.

    Attributes:
        length: m.
        breaks: Inner arc lengths (k,), m, increasing, where a derivative may jump.
        stops: Those of them where the direction jumps: a law must stop there.
    """

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return p (m), p' (1) and p'' (1/m), each of shape (N, 3), at s (N,); |p'| = 1.

        Args:
            s: Arc lengths, shape (N,), m.
            side: Which of two neighbouring pieces speaks at a break.

        Raises:
            ValueError: When an arc length lies outside the curve.
        """
        ...

    def transport(self, s: Array, side: Side = "right") -> Triple:
        """Return how a tool that keeps its attitude to the curve has turned since its start.

        Args:
            s: Arc lengths, shape (N,), m.
            side: Which of two neighbouring pieces speaks at a break.

        Returns:
            Rotations Q (N, 3, 3) with Q(0) = I and p'(s) = Q(s) p'(0); their rate w' (N, 3), rad/m, in world
            axes; and the derivative w'' (N, 3) of the rate, rad/m^2.
        """
        ...

    def majorants(self, s: Array, rising: Array) -> tuple[Array, Array]:
        """Return bounds of |p^(m)| / m! and |Q^(m)| / m! by the time of a law s(t), from m = 1 on.

        They hold on whole pieces of it, none of which passes a break. Of Q the operator norm is bounded.

        Args:
            s: Within each piece, shape (P,), m.
            rising: Bounds of |s^(m)| / m! as `growth` of power series gives them, shape (order + 1, P).

        Returns:
            Two of the shape of `rising`; infinite where nothing is known.
        """
        ...


class Smooth:
    """Curves without breaks."""

    @property
    def breaks(self) -> Array:
        """None."""
        return np.empty(0)

    @property
    def stops(self) -> Array:
        """None."""
        return np.empty(0)

    @property
    def jumps(self) -> Array:
        """None."""
        return np.empty(0)


@frozen
class Line(Smooth):
    """A straight line.

    Attributes:
        start: Shape (3,), m.
        end: Shape (3,), m.

    Source: Siciliano et al. (2009), eq. 4.34.
    """

    start: Array
    end: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", point(self.start, "start"))
        object.__setattr__(self, "end", point(self.end, "end"))
        if self.length <= SAME_POINT:
            text = "a line from {start} that is {length} long has no direction (it needs more than {least})"
            hint = "leave it out; to turn in place, use one `line` for the rotation alone"
            amounts = {
                "start": shown_position(self.start),
                "length": shown_length(self.length),
                "least": shown_length(SAME_POINT),
            }
            raise InputError(Problem(text, hint, amounts=amounts))

    @property
    def length(self) -> float:
        """Distance of the ends, m."""
        return float(np.linalg.norm(self.end - self.start))

    @property
    def direction(self) -> Array:
        """Unit vector (3,) of travel."""
        return np.asarray((self.end - self.start) / self.length)

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return p, p', p'' as `PositionCurve` says; both sides are the same."""
        fraction = inside(s, self.length)[:, None] / self.length
        positions = (1.0 - fraction) * self.start + fraction * self.end  # exact at both ends
        return positions, np.tile(self.direction, (fraction.size, 1)), np.zeros((fraction.size, 3))

    def transport(self, s: Array, side: Side = "right") -> Triple:
        """Return Q, w', w'' as `PositionCurve` says: nothing turns."""
        count = inside(s, self.length).size
        return np.tile(np.eye(3), (count, 1, 1)), np.zeros((count, 3)), np.zeros((count, 3))

    def majorants(self, s: Array, rising: Array) -> tuple[Array, Array]:
        """Return the bounds of p and Q as `PositionCurve` says: |p'| = 1."""
        del s
        return rising, np.zeros(rising.shape)


@frozen
class PartOfCurve:
    """A part of a curve.

    Attributes:
        curve: The whole.
        first: Where the part begins, m of the whole's arc length.
        last: Where it ends.
    """

    curve: PositionCurve
    first: float
    last: float

    @property
    def length(self) -> float:
        """Length of the part, m."""
        return self.last - self.first

    @property
    def breaks(self) -> Array:
        """Breaks of the whole inside the part."""
        return self._own(self.curve.breaks)

    @property
    def stops(self) -> Array:
        """Stops of the whole inside the part."""
        return self._own(self.curve.stops)

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return p, p', p'' as `PositionCurve` says."""
        return self.curve.evaluate(inside(s, self.length) + self.first, side)

    def transport(self, s: Array, side: Side = "right") -> Triple:
        """Return Q, w', w'' as `PositionCurve` says."""
        before, _, _ = self.curve.transport(np.array([self.first]))
        rotation, rate, change = self.curve.transport(inside(s, self.length) + self.first, side)
        return rotation @ before[0].T, rate, change

    def majorants(self, s: Array, rising: Array) -> tuple[Array, Array]:
        """Return the bounds of p and Q as `PositionCurve` says."""
        return self.curve.majorants(s + self.first, rising)

    def _own(self, s: Array) -> Array:
        """Return those of s (k,) of the whole that are inside the part, by its own arc length."""
        return s[(s > self.first) & (s < self.last)] - self.first


@frozen
class Pivot(Smooth):
    """A fixed position, for a rotation alone: s is then an angle, and p' is zero, not a unit vector.

    Start and end may be apart by rounding; the position goes evenly from one to the other.

    Attributes:
        start: Shape (3,), m.
        end: Shape (3,), m, at most `SAME_POINT` away.
        length: How far s goes: what the orientation needs, rad; zero for no motion at all.
    """

    start: Array
    end: Array
    length: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "start", point(self.start, "start"))
        object.__setattr__(self, "end", point(self.end, "end"))
        distance = float(np.linalg.norm(self.end - self.start))
        if distance > SAME_POINT:
            raise InputError(f"start and end are {distance:.6g} m apart: this is no rotation in place")
        if not (np.isfinite(self.length) and self.length >= 0.0):
            raise InputError(f"the length of a rotation must be a finite angle, it is {self.length}")

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return p, p', p'' at s (N,), rad; both sides are the same."""
        values = inside(s, self.length)
        rate = (self.end - self.start) / (self.length or 1.0)
        positions = self.start + values[:, None] * rate
        return positions, np.tile(rate, (values.size, 1)), np.zeros((values.size, 3))

    def transport(self, s: Array, side: Side = "right") -> Triple:
        """Refuse: there is no direction to keep an attitude to."""
        del s, side
        raise PlanningError(
            "a rotation in place has no direction of travel that a tool could keep its attitude to",
            hint="orientation: axis_angle",
        )

    def majorants(self, s: Array, rising: Array) -> tuple[Array, Array]:
        """Return the bounds of p and Q as `PositionCurve` says; there is no Q."""
        del s
        rate = float(np.linalg.norm(self.end - self.start)) / (self.length or 1.0)
        return rate * rising, np.full(rising.shape, np.inf)


def point(values: ArrayLike, name: str) -> Array:
    """Return three finite numbers as an array (3,) that cannot be written to.

    Raises:
        InputError: When they are not three, or not finite.
    """
    result = np.array(values, dtype=np.float64)
    if result.shape != (3,) or not np.isfinite(result).all():
        raise InputError(f"the {name} must be three finite numbers, it is {values!r}")
    result.flags.writeable = False
    return result


def shown_vector(vector: Array) -> str:
    """Return a vector for a message."""
    return "[" + ", ".join(f"{value:.6g}" for value in (vector + 0.0).tolist()) + "]"


def shown_position(vector: Array) -> Amount:
    """Return a position (3,), m, as a message says it."""
    return Amount(tuple(vector.tolist()), 0, None, "length")


def shown_length(length: float) -> Amount:
    """Return a length, m, as a message says it."""
    return Amount(float(length), 0, None, "length")


def inside(s: Array, length: float) -> Array:
    """Return arc lengths (N,) within [0, length], those beside it by no more than rounding moved inside.

    Raises:
        ValueError: When one lies outside.
    """
    values = np.asarray(s, dtype=np.float64)
    slack = _ROUNDING * length
    if values.size and not (values.min() >= -slack and values.max() <= length + slack):
        raise ValueError(f"s from {values.min()!r} to {values.max()!r} leaves the curve's [0, {length!r}]")
    return np.clip(values, 0.0, length)


def nearest(breaks: Array, s: Array) -> Array:
    """Return the nearest one of breaks (k,), increasing, k > 0, for each s (N,): of two the lower one."""
    after = np.searchsorted(breaks, s).clip(1, max(breaks.size - 1, 1))
    low, high = breaks[after - 1], breaks[np.minimum(after, breaks.size - 1)]
    return np.asarray(np.where(np.abs(s - low) <= np.abs(s - high), low, high))


def angle_between(first: Array, second: Array) -> float:
    """Return the angle, rad, between two unit vectors (3,), accurate near 0 and near pi."""
    return float(2.0 * np.arctan2(np.linalg.norm(first - second), np.linalg.norm(first + second)))
