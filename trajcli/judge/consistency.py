"""Consistency of recorded rows: columns that are derivatives of each other, and jumps from row to row.

Over an interval of length T positions must change by what velocities say, T times their mean, up to what a
step in acceleration within or beside the interval may add: T^2 times the difference of the slopes of the
velocity beside each other. Accelerations likewise, up to T times the difference of their changes.

A change between two rows is a jump where its neighbours are much smaller, and slower: more than the limit of
the next derivative allows, or more than the columns that say how fast it changes.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.findings import Collector, Finding, NamedJoints, at_time, excess_amounts
from trajcli.frozen import frozen
from trajcli.judge.intervals import DENSE, Intervals
from trajcli.judge.rounding import stated_errors
from trajcli.kinematics.robot import Limits
from trajcli.limits.tolerances import JUMP_ABSOLUTE, JUMP_RELATIVE, exceeds

_ISOLATED = 4.0  # times the changes beside it: a motion that merely is fast changes from row to row alike
_FASTER = 2.0  # times as fast as those beside it: rows may be uneven
_STEPS = 2.0  # times what one step in acceleration within an interval explains: there may be several
_MEANT, _MEANT_OF_ALL = 1e-3, 1e-4  # of the joint's peak, and of all: a column that differs by less is meant
_AROUND = 32  # intervals on each side among which most disagree where a column of accelerations is wrong
_FEWEST = 8  # of them that are counted, also where there are fewer
OF_ROUNDING = (0.0, 15 / 4, 20 / 3**0.5)
"""Times e / h^order: what a quintic of length h, off by e at both ends, makes of rows that are on it."""
_NEAR = 2  # intervals on each side that a jump is compared with
_QUANTITIES = ("position", "velocity", "acceleration")

ChangesBranch = Callable[[Array, int], bool]
"""Whether the tool does not jump where joints do: rows around, and the index of the one before the jump."""


@frozen
class Changes:
    """How one quantity changes over all intervals of a window, P of them.

    Attributes:
        order: 0 for positions, 1 for velocities, 2 for accelerations.
        change: Value at the end minus value at the start, shape (P, n).
        error: By how much it may be off by rounding, shape (P, n).
        stated: What the columns of the next derivative say that it is; None where there are none.
        slack: By how much the latter may be off by rounding and by what happens between rows.
    """

    order: int
    change: Array
    error: Array
    stated: Array | None
    slack: Array | None

    def disagree(self, lengths: Array, limits: Limits) -> NDArray[np.bool_]:
        """Return where the columns of two derivatives exclude each other, shape (P, n).

        Between rows that are far apart a joint may do all that its limits allow.

        Args:
            lengths: Of the intervals, s, shape (P,).
            limits: In force.
        """
        if self.stated is None or self.slack is None:
            return np.zeros(self.change.shape, dtype=bool)
        sizes = np.abs(self.change) + np.abs(self.stated)
        slack = self.slack + self.error + JUMP_ABSOLUTE + JUMP_RELATIVE * sizes
        sparse = lengths > DENSE
        if sparse.any():
            further = np.abs(limits.of_order(self.order + 2)).max(axis=1) * lengths[sparse, None] ** 2 / 4.0
            if self.order == 1:  # the acceleration may also step from one limit to the other
                steps = 2.0 * np.abs(limits.acceleration).max(axis=1) * lengths[sparse, None]
                further = np.minimum(further, steps)
            slack[sparse] += further
        return np.asarray(np.abs(self.change - self.stated) > slack)

    def persistent(self, disagree: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return where columns exclude each other in most of the intervals around that are not still, (P, n).

        An acceleration may step between two rows, leave and return: a wrong column is wrong in many of them.
        """
        if self.order == 0 or self.stated is None or not disagree.any():
            return disagree
        moving = np.abs(self.change) + np.abs(self.stated) > self.error + JUMP_ABSOLUTE
        wrong, judged = (_around(flags) for flags in (disagree, moving))
        return np.asarray(disagree & (2 * wrong > np.maximum(judged, _FEWEST)))

    def isolated(
        self, piece: NDArray[np.intp], joint: NDArray[np.intp], values: Array, times: float = _ISOLATED
    ) -> NDArray[np.bool_]:
        """Return which of some values (P, n) are much larger than those near to them, but for one beside."""
        near = piece + np.arange(-_NEAR, _NEAR + 1)[:, None]
        inside = (near >= 0) & (near < len(values))
        steps = np.where(inside, values[np.clip(near, 0, len(values) - 1), joint], 0.0)
        sizes = np.abs(steps)
        own = sizes[_NEAR].copy()
        largest = (own > 0.0) & (own >= sizes.max(axis=0))
        alone = np.sort(sizes, axis=0)[-3] * times <= own
        if len(values) == 1 and self.stated is None:  # nothing says that it is no motion, and a fast one
            alone[:] = False
        if self.order == 0 and len(values) == 2:  # nothing else tells a jump from a motion that goes on
            alone &= np.abs(steps.sum(axis=0)) * times <= own * (times + 1)
        return np.asarray(largest & alone)


def changes_of(window: Intervals) -> list[Changes]:
    """Return how positions, velocities and accelerations change, as far as the rows have them."""
    states = window.states
    roundings, length, late = window.resolution.roundings, window.lengths[:, None], window.late[:, None]
    found, positions = [], np.zeros(0)
    for order, values in enumerate(states):
        if values is None:
            continue
        off = stated_errors(values, *roundings[order])
        change, error = np.diff(values, axis=0), off[:-1] + off[1:]
        positions = off if order == 0 else positions
        made = OF_ROUNDING[order] * np.maximum(positions[:-1], positions[1:]) / length**order
        error = error + np.minimum(made, _MEANT_OF_ALL * np.nan_to_num(np.abs(values)).max(axis=0))
        stated = slack = None
        rates = states[order + 1] if order < 2 else None
        if rates is not None:
            off = stated_errors(rates, *roundings[order + 1])
            mean = 0.5 * (rates[:-1] + rates[1:])
            stated = length * mean
            turns = np.diff(rates, axis=0) / (length if order == 0 else 1.0)
            bend = np.abs(np.diff(turns, axis=0, prepend=0.0, append=0.0))
            padded = np.concatenate([bend[:1], bend, bend[-1:]])
            near = np.max([padded[k : k + len(change)] for k in range(4)], axis=0)
            slack = _STEPS * length ** (2 if order == 0 else 1) * near
            largest = np.nan_to_num(np.abs(rates)).max(axis=0)
            meant = _MEANT * largest + _MEANT_OF_ALL * largest.max()
            slack = slack + 0.5 * length * (off[:-1] + off[1:]) + late * np.abs(mean) + length * meant
        found.append(Changes(order, change, error, stated, slack))
    return found


def _around(flags: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Return how many of some flags (P, n) are set among those near to each."""
    summed = np.cumsum(np.concatenate([np.zeros_like(flags[:1]), flags]), axis=0)
    middle = np.arange(len(flags))
    return np.asarray(
        summed[np.minimum(middle + _AROUND + 1, len(flags))] - summed[np.maximum(middle - _AROUND, 0)]
    )


def judge_consistency(
    window: Intervals,
    pieces: slice,
    limits: Limits,
    move: int,
    axes: NamedJoints,
    worst: Collector,
    changes: list[Changes],
    changes_branch: ChangesBranch | None = None,
) -> None:
    """Add columns that are no derivatives of each other, and jumps.

    Args:
        window: The rows.
        pieces: Which intervals.
        limits: In force.
        move: Its index, -1 for none.
        axes: The joints.
        worst: What is added to.
        changes: Of the window, from `changes_of`.
        changes_branch: Tells a branch flip from another jump of the positions; None without geometry.
    """
    for of_order in changes:
        judge = _Judge(window, of_order, axes, move, worst)
        disagree = of_order.disagree(window.lengths, limits)
        persistent = of_order.persistent(disagree)[pieces]
        if of_order.order == 1:  # a limited acceleration may be anything below its limit between two rows
            disagree = disagree & np.isinf(limits.acceleration).any(axis=1)
        jumping = (disagree | judge.over_limit(limits))[pieces]
        if persistent.any() or jumping.any():
            judge.add(pieces.start, persistent, jumping, changes_branch)


@frozen
class _Judge:
    """The changes of one quantity in one move."""

    window: Intervals
    changes: Changes
    axes: NamedJoints
    move: int
    worst: Collector

    def over_limit(self, limits: Limits) -> NDArray[np.bool_]:
        """Return where the quantity changes by more than the limit of the next derivative allows, (P, n)."""
        bounds = limits.of_order(self.changes.order + 1)
        if not np.isfinite(bounds).any():
            return np.zeros(self.changes.change.shape, dtype=bool)
        longest = (self.window.lengths + self.window.late)[:, None]
        change, slack = self.changes.change, self.changes.error
        return exceeds(change - slack, bounds[:, 1] * longest) | exceeds(
            -change - slack, -bounds[:, 0] * longest
        )

    def add(
        self,
        first: int,
        persistent: NDArray[np.bool_],
        jumping: NDArray[np.bool_],
        changes_branch: ChangesBranch | None,
    ) -> None:
        """Add jumps, and derivatives that are wrong persistently, among intervals from the first on."""
        changes = self.changes
        piece, joint = np.nonzero(persistent | jumping)
        row = piece + first
        per_time = changes.change / np.maximum(self.window.lengths, JUMP_ABSOLUTE)[:, None]
        jumps = changes.isolated(row, joint, per_time, _FASTER) & jumping[piece, joint]
        jumps &= changes.isolated(row, joint, changes.change)
        if changes.stated is not None:
            moved, said = (
                np.abs(self._beside(values, row, joint)) for values in (changes.change, changes.stated)
            )
            jumps &= np.logical_not(moved < said)  # else it is the column of the derivative that jumps
        other = persistent[piece, joint] & ~jumps
        sizes = np.abs(changes.change[row, joint])
        branch = np.zeros(row.size, dtype=bool)
        if changes.order == 0 and changes_branch is not None:
            q = np.asarray(self.window.states[0])
            for k in np.flatnonzero(jumps):
                low = max(int(row[k]) - 1, 0)
                branch[k] = changes_branch(q[low : int(row[k]) + 3], int(row[k]) - low)
        quantity = _QUANTITIES[changes.order]

        def make(kind: str) -> Callable[[int], Finding]:
            return lambda k: self._finding(kind, int(row[k]), int(joint[k]))

        add = self.worst.add
        add("jump", self.move, joint, sizes, make("jump"), quantity=quantity, chosen=jumps & ~branch)
        add("branch", self.move, joint, sizes, make("branch"), chosen=branch)
        if changes.stated is not None:
            missed = np.abs(changes.change - changes.stated)[row, joint]
            name = _QUANTITIES[changes.order + 1]
            add("derivative", self.move, joint, missed, make("derivative"), quantity=name, chosen=other)

    def _beside(self, values: Array, row: NDArray[np.intp], joint: NDArray[np.intp]) -> Array:
        """Return by how much values differ from the median of those near to them."""
        near = np.clip(row + np.arange(-_NEAR, _NEAR + 1)[:, None], 0, len(values) - 1)
        return np.asarray(values[row, joint] - np.median(values[near, joint], axis=0))

    def _finding(self, kind: str, row: int, joint: int) -> Finding:
        changes, length = self.changes, float(self.window.lengths[row])
        order, stated = changes.order, changes.stated
        value, limit = float(changes.change[row, joint]), 0.0 if stated is None else float(stated[row, joint])
        time = float(self.window.t[row])
        text = f"the {_QUANTITIES[order]} of {{joint}} jumps by {{value}} {at_time(time)}"
        rounding = float(changes.error[row, joint])
        if stated is not None and changes.slack is not None:
            rounding += float(changes.slack[row, joint])
        if kind == "branch":
            text = (
                f"{{joint}} jumps by {{value}} {at_time(time)}, the tool does not: the arm changes its branch"
            )
        if kind == "derivative":
            value, limit, rounding, order = limit / length, value / length, rounding / length, order + 1
            name, below = _QUANTITIES[order], _QUANTITIES[order - 1]
            text = (
                f"the column of the {name} of {{joint}} says {{value}} {at_time(time)}, "
                f"its {below} changes by {{limit}}"
            )
        return Finding(
            rule={"jump": "continuity", "derivative": "derivative"}.get(kind, "path"),
            kind=kind,
            joint=self.axes.joint_names[joint],
            value=value,
            limit=limit,
            time=time,
            row=int(self.window.rows[row]),
            method="differences",
            quantity=None if kind == "branch" else _QUANTITIES[order],
            rounding=rounding,
            message=text,
            amounts=excess_amounts(self.axes, joint, order, value, limit),
        )
