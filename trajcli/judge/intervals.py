"""Intervals between recorded rows: a window of rows with the curve through them, that moves along a file."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.hermite import hermite_coefficients
from trajcli.curves.piecewise import Array, control_points, derivative_coefficients, horner
from trajcli.frozen import frozen
from trajcli.judge.reconstruction import Interpolation, piece_coefficients, stated_orders
from trajcli.judge.rounding import PieceRows, stated_errors
from trajcli.streams.recorded_motion import Resolution

BESIDE = 2  # intervals on either side that are looked at, too
DENSE = 0.0100001
"""Seconds between rows that controllers take one by one: they run at 100 Hz or faster."""
_UNRESOLVED, _UNRESOLVED_LAST = 0.2, 1.5
"""Of the jump of the highest derivative times powers of the length: how far a piece may go beyond a motion
that changes its law once between two rows (0.143 and 1.5 at most)."""
_CURVED = 0.1
"""Likewise of the jump of the derivative after that: how far a piece bends beside a motion that bends on
(1/12 at most)."""
_AT_ONCE = 256  # pieces whose rounding is looked at together
HIGHEST = {"hold": 0, "linear": 1, "cubic": 2, "quintic": 3, "jtc-upsampling": 3}
"""Highest derivative that pieces of an interpolation determine."""


@frozen
class Intervals:
    """A window of rows that stand in order of time; those between `first` and `last` are judged in it.

    Attributes:
        t: Time stamps as they are meant, s, shape (N,).
        lengths: Of the intervals, shape (N - 1,).
        late: By how much each may be off by rounding, shape (N - 1,).
        states: Positions, velocities, accelerations (N, n) of the rows, as far as the file has them.
        rows: Number of each row in the file, shape (N,).
        moves: Index of the move of each row, shape (N,); -1 where the file has none.
        interpolation: How the rows are joined.
        resolution: Rounding of the values.
        first: Index of the first interval to judge.
        last: Index of the one after the last.
        ends: Whether the last row is the last one.
    """

    t: Array
    lengths: Array
    late: Array
    states: tuple[Array | None, ...]
    rows: NDArray[np.int64]
    moves: NDArray[np.int64]
    interpolation: Interpolation
    resolution: Resolution
    first: int
    last: int
    ends: bool

    @cached_property
    def coefficients(self) -> Array:
        """Of the pieces, (degree + 1, N - 1, n), highest power first."""
        q, qd, qdd = self.states
        return piece_coefficients(self.lengths, np.asarray(q), qd, qdd, self.interpolation)

    @cached_property
    def highest(self) -> NDArray[np.intp]:
        """Order of the highest derivative that each piece determines, shape (N - 1,)."""
        order = HIGHEST.get(self.interpolation)
        if order is not None:
            return np.full(self.lengths.size, order)
        q, qd, qdd = self.states
        counts = stated_orders(np.asarray(q), qd, qdd)
        return np.minimum(counts[:-1], counts[1:])

    @cached_property
    def hulls(self) -> tuple[tuple[Array, Array], ...]:
        """Least and largest control points (N - 1, n) of each derivative that some piece determines."""
        if len(self.coefficients) == 1:  # rows are held
            both = self.coefficients[0], self.behind
            return ((np.minimum(*both), np.maximum(*both)),)
        lengths, highest = self.lengths[:, None], int(self.highest.max(initial=0))
        of_orders = (derivative_coefficients(self.coefficients, order) for order in range(highest + 1))
        points = (control_points(derivative, lengths) for derivative in of_orders)
        return tuple((of_order.min(axis=0), of_order.max(axis=0)) for of_order in points)

    @cached_property
    def behind(self) -> Array:
        """Positions behind pieces that hold, but for the row that the next piece holds, (N - 1, n)."""
        q = np.asarray(self.states[0])
        return np.concatenate([q[:-2], q[-1:]]) if self.ends else q[:-1]

    @cached_property
    def jumps(self) -> tuple[Array, Array]:
        """Largest jumps of the highest derivative, and of the one after it, near to each piece, (N - 1, n).

        They tell whether the rows resolve the motion: where that changes its law between two rows, the pieces
        beside each other disagree.
        """
        order = int(self.highest.max())
        return self._jumps_near(order), self._jumps_near(order + 1)

    def _jumps_near(self, order: int) -> Array:
        top, lengths = derivative_coefficients(self.coefficients, order), self.lengths[:, None]
        ends = horner(top, lengths)
        jump = np.abs(top[-1, 1:] - ends[:-1])  # at each inner row
        outer = np.zeros((2, top.shape[2]))
        if len(lengths) > 1:  # at the first and the last row, against what the piece beside goes on with
            outer[0] = np.abs(top[-1, 0] - horner(top[:, 1], -lengths[0]))
            outer[1] = np.abs(ends[-1] - horner(top[:, -2], lengths[-2] + lengths[-1]))
        padded = np.concatenate([outer[:1], outer[:1], jump, outer[1:], outer[1:]])
        return np.asarray(np.max([padded[k : k + len(lengths)] for k in range(4)], axis=0))

    def piece_rows(self, piece: NDArray[np.intp], joint: NDArray[np.intp], count: int) -> PieceRows:
        """Return what stands at the ends of pieces (m,), for one joint each.

        Args:
            piece: Indices of pieces.
            joint: Of each the index of a joint.
            count: How many of position, velocity and acceleration the pieces use.
        """
        ends, errors = [], []
        for values, (rounding, share) in zip(self.states[:count], self.resolution.roundings, strict=False):
            if values is None:
                break
            both = np.stack([values[piece, joint], values[piece + 1, joint]])
            absolute = np.broadcast_to(rounding, values.shape[1:])[joint]
            ends.append(both)
            errors.append(stated_errors(both, absolute, share).max(axis=0))
        spline = self.interpolation == "jtc-upsampling"
        beside = self._rates_off[piece, joint] if spline else 0.0
        return PieceRows(self.lengths[piece], self.late[piece], tuple(ends), tuple(errors), spline, beside)

    @cached_property
    def _rates_off(self) -> Array:
        """By how much mean rates may be off, of pieces and, halved row by row, of those near, (N - 1, n).

        The slopes of a spline follow from means of neighbours with weights that fall by half at least.
        """
        q, length = np.asarray(self.states[0]), self.lengths[:, None]
        off = stated_errors(q, *self.resolution.roundings[0])
        with np.errstate(divide="ignore", invalid="ignore"):
            shortest = np.maximum(length - self.late[:, None], 0.0)
            more = np.abs(np.diff(q, axis=0)) * (1.0 / shortest - 1.0 / length)
            rates = np.nan_to_num(np.maximum(off[:-1], off[1:]) / shortest + more, nan=np.inf, posinf=np.inf)
        for k in (1, 2, 4, 8, 16):
            padded = np.pad(rates, ((k, k), (0, 0)))
            rates = np.maximum(rates, 0.5**k * np.maximum(padded[2 * k :], padded[: -2 * k]))
        return np.asarray(rates)

    def rows_by_level(self, pieces: NDArray[np.intp]) -> Iterator[tuple[NDArray[np.intp], PieceRows]]:
        """Yield which pieces determine equally many derivatives, and the rows of all their joints."""
        joints, levels = np.arange(self.coefficients.shape[2]), self.highest[pieces]
        for level in set(levels.tolist()):
            chosen = np.flatnonzero(levels == level)
            count = 1 if self.interpolation == "jtc-upsampling" else max(level, 1)
            every = np.repeat(pieces[chosen], joints.size)
            yield chosen, self.piece_rows(every, np.tile(joints, chosen.size), count)

    def runs(self) -> Iterator[tuple[tuple[int, int], int, int]]:
        """Yield the moves before and after intervals, and the first and the last + 1 of neighbours alike."""
        pairs = np.stack([self.moves[self.first : self.last], self.moves[self.first + 1 : self.last + 1]])
        if pairs.size and (pairs == pairs[0, 0]).all():
            yield (int(pairs[0, 0]), int(pairs[0, 0])), self.first, self.last
            return
        borders = np.flatnonzero((np.diff(pairs, axis=1) != 0).any(axis=0)) + 1
        edges = [0, *borders.tolist(), pairs.shape[1]]
        for low, high in pairwise(edges):
            if high > low:
                before, after = pairs[:, low].tolist()
                yield (before, after), self.first + low, self.first + high

    def row_at(self, piece: int, local: float) -> int:
        """Return the number of the row at a time within a piece, or before it."""
        at_end = local >= self.lengths[piece] * (1 - 1e-12)
        return int(self.rows[piece + 1 if at_end else piece])


def explained_by_law(
    window: Intervals, piece: NDArray[np.intp], joint: NDArray[np.intp], order: int, level: int
) -> Array:
    """Return how far pieces (m,) may go beyond a motion that changes its law once between two dense rows.

    Minus infinity where rows are not dense.

    Args:
        window: The rows.
        piece: Indices of pieces.
        joint: Of each the index of a joint.
        order: Of the derivative that is looked at.
        level: Of the highest derivative that the pieces determine.
    """
    length, below = window.lengths[piece], level - order
    share = _UNRESOLVED if below else _UNRESOLVED_LAST
    highest, beyond = (jumps[piece, joint] for jumps in window.jumps)
    explained = share * length**below * highest + _CURVED * length ** (below + 1) * beyond
    return np.where(length <= DENSE, explained, -np.inf)


@frozen
class JoinedPairs(Intervals):
    """Intervals that need not be neighbours, one behind the other in a time of their own.

    Attributes:
        stated: What the rows before and after them state, shape (orders, 2, m, n).
        moves_after: Index of the move of the row after each, shape (m,).
        begun: When each begins, s from the start of the trajectory, shape (m,).
    """

    stated: Array
    moves_after: NDArray[np.int64]
    begun: Array

    @cached_property
    def coefficients(self) -> Array:
        """Of the pieces, (degree + 1, m, n), highest power first."""
        return hermite_coefficients(self.stated[:, 0], self.stated[:, 1], self.lengths[:, None])

    def piece_rows(self, piece: NDArray[np.intp], joint: NDArray[np.intp], count: int) -> PieceRows:
        """Return what stands at the ends of pieces (m,), for one joint each."""
        ends = tuple(values[:, piece, joint] for values in self.stated[:count])
        absolute = self.resolution.q[joint]
        errors = tuple(stated_errors(both, absolute, 0.0).max(axis=0) for both in ends)
        return PieceRows(self.lengths[piece], self.late[piece], ends, errors)

    def runs(self) -> Iterator[tuple[tuple[int, int], int, int]]:
        """Yield the moves before and after intervals, and the first and the last + 1 of those alike."""
        changes = (np.diff(self.moves) != 0) | (np.diff(self.moves_after) != 0)
        edges = [0, *(np.flatnonzero(changes) + 1).tolist(), self.moves.size]
        for low, high in pairwise(edges):
            yield (int(self.moves[low]), int(self.moves_after[low])), low, high

    def row_at(self, piece: int, local: float) -> int:
        """Return the number of the row at a time within a piece, or before it."""
        return int(self.rows[piece]) + int(local >= self.lengths[piece] * (1 - 1e-12))


def largest_first(sizes: Array, chosen: NDArray[np.bool_]) -> Iterator[NDArray[np.intp]]:
    """Yield the indices of those of some sizes (m,) that are chosen, the largest first, many at a time."""
    order = np.flatnonzero(chosen)[np.argsort(-sizes[chosen], kind="stable")]
    for low in range(0, order.size, _AT_ONCE):
        yield order[low : low + _AT_ONCE]
