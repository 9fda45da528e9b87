"""Accelerations sdd at the ends of the intervals of a grid: continuous but where the motion switches.

Where a row binds in an interval it says what sdd is at its ends. Where the motion is as fast as it may be,
sdd follows from the mean values of the intervals around. An interval within which the motion switches from
one to the other continues one of its neighbours.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.curves.time_optimal.collocation import IntervalRows
from trajcli.curves.time_optimal.time_law import blocks
from trajcli.frozen import frozen

_NEARLY = 1e-3  # of c: a row with less left over binds
_ROUNDING = 1e-9  # of the other terms of a row
_FULL = 1e-6  # of the largest sd^2: as near to it is at it
_SMALL = 1e-2  # of the larger a at both ends: a row with a smaller one does not say what sdd is there
_APART = 3.0  # times the change from one interval to the next: what a row says beyond it is not believed
_KINK = 4.0  # times the change around: where sdd changes so much faster, it steps
_STEP = 1.0  # of the largest sdd: where it changes by less, it does not
_BESIDE = 0.1  # of the step at its other end: a constant sdd with a smaller step at one end takes it up
_JOINS = 0.2  # of sdd: where two rows differ by less it goes on
_AT_MOST, _SWITCHES = 0, 2  # kinds of intervals beside those where an upper (1) or a lower (-1) bound binds


@frozen
class BindingRows:
    """What binds in each interval, and sdd at both ends by it, or NaN; each of shape (N,)."""

    kind: NDArray[np.intp]
    near: Array
    far: Array


def end_accelerations(
    rows: IntervalRows, x: Array, mvc: Array, bound: BindingRows, even: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Return sdd at the near and at the far ends of the intervals, each of shape (N,).

    Args:
        rows: Of N intervals.
        x: sd^2 at the grid points, the solution for them, shape (N + 1,).
        mvc: Largest sd^2 there, shape (N + 1,).
        bound: What `binding_rows` returns for these rows and this solution.
        even: In which intervals sdd shall be constant, shape (N,).
    """
    lengths = np.diff(rows.grid)
    mean = np.diff(x) / (2.0 * lengths)
    full = x >= mvc * (1.0 - _FULL)
    kind = np.where((bound.kind == 0) & ~(full[1:] & full[:-1]), _SWITCHES, bound.kind)
    kind[even] = _SWITCHES
    left, right = kind[:-1], kind[1:]
    goes_on = (left == right) & (left < _SWITCHES) & (rows.cap[1:-1] > 0)
    goes_on &= ~((left == _AT_MOST) & _kinks(mean, rows.grid))
    near, far = _guessed(mean, lengths, goes_on)
    near, far = _believed(bound, mean, goes_on, near, far)
    end, begin = far[:-1], near[1:]
    similar = np.abs(end - begin) <= _JOINS * np.maximum(np.abs(end), np.abs(begin))
    goes_on |= similar & (np.maximum(left, right) < _SWITCHES) & (rows.cap[1:-1] > 0)
    upper, lower = (left == 1) & (right == 1), (left == -1) & (right == -1)
    joined = np.where(
        upper, np.minimum(end, begin), np.where(lower, np.maximum(end, begin), 0.5 * (end + begin))
    )
    far[:-1], near[1:] = np.where(goes_on, joined, end), np.where(goes_on, joined, begin)
    _continue(kind == _SWITCHES, even, mean, near, far)
    return near, far


def _continue(
    switches: NDArray[np.bool_], even: NDArray[np.bool_], mean: Array, near: Array, far: Array
) -> None:
    """Let intervals in which the motion switches begin or end as the nearer one of their neighbours does."""
    near[switches], far[switches] = mean[switches], mean[switches]
    alone = switches.copy()
    alone[1:] &= ~switches[:-1]
    alone[:-1] &= ~switches[1:]
    alone[[0, -1]] = False
    which = np.flatnonzero(alone)
    before, after = far[which - 1], near[which + 1]
    from_left, from_right = np.abs(before - mean[which]), np.abs(after - mean[which])
    least, larger = np.minimum(from_left, from_right), np.maximum(from_left, from_right)
    chosen = ~even[which] | (least <= _BESIDE * larger)
    which, before, after = which[chosen], before[chosen], after[chosen]
    first = (from_left <= from_right)[chosen]
    near[which] = np.where(first, before, 2.0 * mean[which] - after)
    far[which] = np.where(first, 2.0 * mean[which] - before, after)


def _guessed(mean: Array, lengths: Array, goes_on: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Return sdd at both ends from the mean values around, between which it goes on or not."""
    share = lengths[1:] / (lengths[1:] + lengths[:-1])
    middle = np.where(goes_on, mean[:-1] * share + mean[1:] * (1.0 - share), np.nan)
    near, far = np.append(np.nan, middle), np.append(middle, np.nan)
    near, far = _filled(near, 2.0 * mean - far), _filled(far, 2.0 * mean - near)
    return _filled(near, mean), _filled(far, mean)


def _believed(
    bound: BindingRows, mean: Array, goes_on: NDArray[np.bool_], near: Array, far: Array
) -> tuple[Array, Array]:
    """Return sdd at both ends by the rows that bind, where that is credible, else as guessed.

    Where a row says it at one end only, it changes linearly to the other.
    """
    change = np.where(goes_on, np.abs(np.diff(mean)), 0.0)
    limit = _APART * np.maximum(np.append(0.0, change), np.append(change, 0.0))
    with np.errstate(invalid="ignore"):
        first, last = (np.where(np.abs(u - mean) <= limit, u, np.nan) for u in (bound.near, bound.far))
    first, last = _filled(first, 2.0 * mean - last), _filled(last, 2.0 * mean - first)
    return _filled(first, near), _filled(last, far)


def _filled(values: Array, others: Array) -> Array:
    return np.where(np.isnan(values), others, values)


def _kinks(mean: Array, grid: Array) -> NDArray[np.bool_]:
    """Return at which inner grid points sdd steps, as it changes there far more than before and after."""
    change = np.abs(np.diff(mean))
    slope = change / (grid[2:] - grid[:-2])
    around = np.maximum(np.append(0.0, slope[:-1]), np.append(slope[1:], 0.0))
    return np.asarray((slope > _KINK * around) & (change > _STEP * np.abs(mean).max()))


def binding_rows(rows: IntervalRows, x: Array) -> BindingRows:
    """Return which rows bind in the intervals, and what they say."""
    count = x.size - 1
    kind, near, far = np.zeros(count, dtype=np.intp), np.empty(count), np.empty(count)
    for block in blocks(count):
        begin, end = x[:-1][block], x[1:][block]
        C, px, ry = rows.C[:, block], rows.P[:, block] * begin, rows.R[:, block] * end
        with np.errstate(divide="ignore", invalid="ignore"):
            slack = (C - px - ry) / (_NEARLY * C + _ROUNDING * (np.abs(px) + np.abs(ry)))
        # of equals the first, whatever rounding says
        slack = np.where(np.isnan(slack), np.inf, np.round(slack, 4))
        which, columns = slack.argmin(axis=0), np.arange(begin.size)
        source, owner = rows.sources[which], rows.owners[which]
        a0, b0, c0 = (each[:, block][source, columns] for each in rows.near)
        a1, b1, c1 = (each[:, block][source, columns] for each in rows.far)
        e0, e1 = (each[:, block][owner, columns] for each in (rows.eased[:, :-1], rows.eased[:, 1:]))
        binds, small = slack[which, columns] <= 1.0, _SMALL * np.maximum(np.abs(a0), np.abs(a1))
        says = binds & (np.abs(a0 + a1) >= np.abs(a0 - a1) * (1.0 - _SMALL))
        with np.errstate(divide="ignore", invalid="ignore"):
            near[block] = np.where(says & (np.abs(a0) > small), (c0 * e0 - b0 * begin) / a0, np.nan)
            far[block] = np.where(says & (np.abs(a1) > small), (c1 * e1 - b1 * end) / a1, np.nan)
        kind[block] = np.where(binds, np.sign(a0 + a1), 0)
    return BindingRows(kind, near, far)
