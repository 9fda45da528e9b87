"""Corners of linear segments with blends, in time and position, and the curve that rounds them.

An end blend that lies inside its segment is a centred one whose corner is half a blend further in. A
waypoint that is to be passed exactly has two corners, an offset before and after it in time, on a line
through it.
"""

from __future__ import annotations

from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.curves.operations import merge_breaks
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.frozen import frozen

_ROUNDING = 8 * np.finfo(np.float64).eps  # of the end: a straight piece this short is none
OFFSET = 0.625  # of a blend: two corners around a waypoint leave a quarter of it straight between them


Ends = Literal["centred", "inside"]


@frozen
class CornerSpec:
    """What the corners are made from: m waypoints of n joints.

    Attributes:
        times: s, shape (m,), strictly increasing.
        positions: Shape (m, n).
        start_velocity: Shape (n,).
        end_velocity: Shape (n,).
        ends: Where the first and last blend lie.
        exactly: Whether each inner waypoint has two corners.
    """

    times: Array
    positions: Array
    start_velocity: Array
    end_velocity: Array
    ends: Ends
    exactly: bool

    @classmethod
    def of(
        cls,
        times: ArrayLike,
        positions: ArrayLike,
        start_velocity: ArrayLike,
        end_velocity: ArrayLike,
        ends: Ends,
        *,
        exactly: bool,
    ) -> CornerSpec:
        """Return the specification with its arrays in shape.

        Raises:
            ValueError: When times and positions do not fit, are not finite, or the times do not increase.
        """
        t, q = np.array(times, dtype=np.float64), np.array(positions, dtype=np.float64)
        if t.ndim != 1 or q.ndim != 2 or t.size != q.shape[0] or t.size < 2:
            raise ValueError(
                f"times {t.shape} and positions {q.shape} do not fit: expected (m,), (m, n), m >= 2"
            )
        v = [
            np.broadcast_to(np.asarray(x, dtype=np.float64), q.shape[1:])
            for x in (start_velocity, end_velocity)
        ]
        if not all(np.isfinite(values).all() for values in (t, q, *v)):
            raise ValueError("times, positions and velocities must be finite")
        late = np.flatnonzero(np.diff(t) <= 0)
        if late.size:
            k = int(late[0])
            raise ValueError(f"times must increase: point {k + 1} at {t[k + 1]:.9g} s follows {t[k]:.9g} s")
        return cls(t, q, v[0], v[1], ends, exactly)

    @cached_property
    def points(self) -> NDArray[np.intp]:
        """Index of the waypoint of each corner, shape (M,)."""
        points = np.arange(self.times.size)
        return np.repeat(points, 2)[1:-1] if self.exactly else points

    @cached_property
    def side(self) -> Array:
        """-1 for a corner before its waypoint, 1 after it, 0 for the only one, shape (M, 1)."""
        side = np.zeros((self.points.size, 1))
        if self.exactly:
            side[1:-1:2], side[2:-1:2] = -1.0, 1.0
        return side

    @cached_property
    def through(self) -> Array:
        """Velocity at which an inner waypoint is passed exactly, shape (m, n).

        The slower one of the segments around it where they agree in sign, else zero: between two points the
        corners then follow each other in order, and no joint overshoots.
        """
        v = np.diff(self.positions, axis=0) / np.diff(self.times)[:, None]
        slower = np.sign(v[1:]) * np.minimum(np.abs(v[:-1]), np.abs(v[1:]))
        through = np.zeros_like(self.positions)
        through[1:-1] = np.where(v[:-1] * v[1:] > 0, slower, 0.0)
        return through

    def blend_room(self) -> tuple[Array, Array]:
        """Return how many times its blend each waypoint takes after and before it, each of shape (m, 1).

        One to be passed exactly takes 5/8 of its blend up to its corner and half of it beyond.
        """
        return self._room_of(self.times.size, OFFSET + 0.5 if self.exactly else 0.5)

    def corner_room(self) -> tuple[Array, Array]:
        """Return how many times its blend each corner takes after and before it, each of shape (M, 1)."""
        return self._room_of(self.points.size, 0.5)

    def _room_of(self, count: int, inner: float) -> tuple[Array, Array]:
        """Return room (count, 1) after and before, with that of inner blends given."""
        taken = np.full((count, 1), inner)
        taken[[0, -1]] = 1.0 if self.ends == "inside" else 0.5
        return taken, taken


def corners(spec: CornerSpec, offsets: Array, blends: Array) -> RoundedPolyline:
    """Return the corners.

    Args:
        spec: m waypoints.
        offsets: How far two corners of one waypoint are from it in time, s, shape (m, 1) or (m, n).
        blends: Of each corner, s, shape (M, 1) or (M, n).
    """
    points, offset = spec.points, spec.side * offsets[spec.points]
    times = spec.times[points, None] + offset
    positions = spec.positions[points] + offset * spec.through[points]
    if spec.ends == "inside":
        times[0] += blends[0] / 2
        times[-1] -= blends[-1] / 2
        positions[0] += spec.start_velocity * blends[0] / 2
        positions[-1] -= spec.end_velocity * blends[-1] / 2
    inside = (points[1:] == points[:-1])[:, None]
    between = np.diff(positions, axis=0) / np.where(inside, 1.0, np.diff(times, axis=0))
    velocities = np.where(inside, spec.through[points[1:]], between)
    velocities = np.concatenate([spec.start_velocity[None], velocities, spec.end_velocity[None]])
    return RoundedPolyline(points, times, positions, blends, velocities)


@frozen
class RoundedPolyline:
    """The corners of a polyline in time, each rounded by a parabola centred on it.

    M corners of n joints; `times` and `blends` have one column where all joints share them, else n.

    Attributes:
        points: Index of the waypoint that each corner belongs to, shape (M,).
        times: Where the two lines of each corner meet, s, shape (M, 1) or (M, n).
        positions: The corner itself, shape (M, n).
        blends: Duration of the parabola, s, shape (M, 1) or (M, n); zero where the velocity does not change.
        velocities: Before the first corner, between corners, after the last, shape (M + 1, n).
    """

    points: NDArray[np.intp]
    times: Array
    positions: Array
    blends: Array
    velocities: Array

    @property
    def start(self) -> float:
        """Where the earliest first parabola begins, s."""
        return float((self.times[0] - self.blends[0] / 2).min())

    @property
    def end(self) -> float:
        """Where the latest last parabola ends, s."""
        return float((self.times[-1] + self.blends[-1] / 2).max())

    def curve(self, end: float) -> PiecewisePolynomial:
        """Return the curve from 0 to `end`, which are `start` and `end`, rounding apart.

        A joint whose own first parabola begins later comes in, and one whose last ends earlier goes out,
        with its velocity there.
        """
        columns = self.times.shape[1]
        if columns == 1:
            return self._laid_out(0, slice(None), end)
        return merge_breaks([self._laid_out(j, slice(j, j + 1), end) for j in range(columns)])

    def _laid_out(self, column: int, joints: slice, end: float) -> PiecewisePolynomial:
        """Return the curve of the joints that share one column of times."""
        time, velocity = self.times[:, column], self.velocities[:, joints]
        edges = self._edges(column, end)
        lengths = np.diff(edges)
        corner = np.clip(np.arange(lengths.size) - 1, 0, None) // 2
        coefficients = np.zeros((3, lengths.size, velocity.shape[1]))
        coefficients[1] = np.repeat(velocity, 2, axis=0)[: lengths.size]
        coefficients[2] = self.positions[corner, joints]
        coefficients[2] += coefficients[1] * (edges[:-1] - time[corner])[:, None]
        bent, parabolas = np.diff(velocity, axis=0), lengths[1::2, None]
        # over the length that rounding has left, so that the velocity is continuous however late it is
        np.divide(bent / 2, parabolas, out=coefficients[0, 1::2], where=parabolas > 0)
        kept = lengths > 0
        return PiecewisePolynomial(np.append(edges[:-1][kept], edges[-1]), coefficients[:, kept])

    def _edges(self, column: int, end: float) -> Array:
        """Return where the pieces line, parabola, line, ... parabola, line begin, and the end: (2M + 2,).

        A parabola is rounded outwards: its acceleration may be a limit, which rounding must not exceed.
        """
        time, half = self.times[:, column], self.blends[:, column] / 2
        low, high = np.nextafter(time - half, -np.inf), np.nextafter(time + half, np.inf)
        low, high = np.where(half > 0, [low, high], time)
        apart = _ROUNDING * end
        low[1:] = np.where(low[1:] - high[:-1] > apart, low[1:], high[:-1])
        low[0] = low[0] if low[0] > apart else 0.0
        high[-1] = high[-1] if end - high[-1] > apart else end
        return np.maximum.accumulate(
            np.concatenate([[0.0], np.stack([low, high], axis=1).reshape(-1), [end]])
        )


def scaled_to_fit(asked: Array, lengths: Array, after: Array, before: Array) -> Array:
    """Return blend durations that do not overlap, shape (K, c), none longer than asked.

    Args:
        asked: Durations, s, shape (K, c).
        lengths: Between neighbours, s, shape (K - 1, c).
        after: How many times its duration each blend takes of the length after it, shape (K, 1).
        before: The same for the length before it.
    """
    needed = after[:-1] * asked[:-1] + before[1:] * asked[1:]
    over = needed > lengths
    factor = np.where(over, lengths / np.where(over, needed, 1.0), 1.0)
    free = np.ones((1, factor.shape[1]))
    fitting: Array = asked * np.minimum(np.concatenate([free, factor]), np.concatenate([factor, free]))
    return fitting
