"""Continuity: jumps in position and velocity, and in acceleration where jerk is limited.

Both sides of every break are compared. Before the first break the arm is in the trajectory's declared start,
and after the last one in its declared end.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import overload

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.extrema import IntervalPeaks
from trajcli.curves.piecewise import Array
from trajcli.findings import Finding, at_time, joint_amounts
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.robot import Limits
from trajcli.limits.joints import peaks_by_move
from trajcli.limits.tolerances import allowed_jump
from trajcli.trajectory import Trajectory

JERK_HINT = "use jerk_limited or quintic, or say limits: {jerk: null}"
_SAME = 1e-12  # jumps that differ by less than this part are equal: the earliest is named
_QUANTITIES = ("position", "velocity", "acceleration")
_KINDS: tuple[str, ...] = ("position_jump", "velocity_jump", "acceleration_jump")


@comparable
class AccelerationStep:
    """A step in a joint's acceleration, which is legal where the joint has no jerk limit.

    Attributes:
        move: Index of the move it belongs to: the one that begins with it, or the one that ends with it where
            the acceleration is zero afterwards.
        joint: Name of the joint.
        time: Seconds from the start of the trajectory.
        size: Acceleration after minus before, SI.
    """

    move: int
    joint: str
    time: float
    size: float


@frozen
class AccelerationSteps(Sequence[AccelerationStep]):
    """Steps in order of time; a long motion has one for every joint at every break, made when asked for.

    Attributes:
        moves: Index of the move that each belongs to, shape (k,).
        joints: Index of the joint, shape (k,).
        times: Seconds from the start of the trajectory, shape (k,).
        sizes: Acceleration after minus before, SI, shape (k,).
        joint_names: Of all joints.
    """

    moves: NDArray[np.intp]
    joints: NDArray[np.intp]
    times: Array
    sizes: Array
    joint_names: tuple[str, ...]

    def __len__(self) -> int:
        return self.times.size

    @overload
    def __getitem__(self, index: int) -> AccelerationStep: ...

    @overload
    def __getitem__(self, index: slice) -> list[AccelerationStep]: ...

    def __getitem__(self, index: int | slice) -> AccelerationStep | list[AccelerationStep]:
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        name = self.joint_names[int(self.joints[index])]
        return AccelerationStep(
            int(self.moves[index]), name, float(self.times[index]), float(self.sizes[index])
        )


def check_continuity(
    trajectory: Trajectory,
    limits_by_move: Sequence[Limits],
    peaks: IntervalPeaks | None = None,
) -> list[Finding]:
    """Return where a joint jumps and must not: for each move, joint and quantity the largest jump, if any.

    A jump at the border of two moves is the later one's. A step in acceleration is a finding where a move
    that it belongs to limits the joint's jerk: a step to zero belongs to the move that ends, a step from zero
    to the move that begins, any other to both.

    Args:
        trajectory: What to judge.
        limits_by_move: One for each span.
        peaks: `peaks_by_move(trajectory)`, where that is known already.

    Raises:
        ValueError: When there are more or fewer limits than spans.
    """
    known = peaks_by_move(trajectory) if peaks is None else peaks
    findings: list[Finding] = []
    for order in range(2):
        jumps = _jumps(trajectory, order, known)
        findings += _largest(trajectory, order, jumps, jumps.present, _later(trajectory))
    steps = _jumps(trajectory, 2, known)
    begins, ends = _limited(trajectory, limits_by_move, steps)
    owner = np.where(begins, _later(trajectory), _earlier(trajectory))
    return findings + _largest(trajectory, 2, steps, begins | ends, owner)


def acceleration_steps(
    trajectory: Trajectory,
    limits_by_move: Sequence[Limits] | None = None,
    peaks: IntervalPeaks | None = None,
) -> AccelerationSteps:
    """Return the steps in acceleration in order of time, or only the legal ones.

    Args:
        trajectory: What to look at.
        limits_by_move: One for each span, to leave out the steps that `check_continuity` finds.
        peaks: `peaks_by_move(trajectory)`, where that is known already.

    Raises:
        ValueError: When there are more or fewer limits than spans.
    """
    jumps = _jumps(trajectory, 2, peaks_by_move(trajectory) if peaks is None else peaks)
    chosen = jumps.present
    if limits_by_move is not None:
        begins, ends = _limited(trajectory, limits_by_move, jumps)
        chosen = chosen & ~(begins | ends)
    rows, joints = np.nonzero(chosen)
    owners = np.where(jumps.begins, _later(trajectory), _earlier(trajectory))[rows, joints]
    times = (trajectory.curve.breaks - trajectory.curve.start)[rows]
    moves = np.array([span.index for span in trajectory.spans])[owners]
    return AccelerationSteps(moves, joints, times, jumps.size[rows, joints], trajectory.joint_names)


@frozen
class _Jumps:
    """The two sides of every break, first and last included, each of shape (pieces + 1, n).

    Attributes:
        before: Value on the left side.
        after: Value on the right side.
        allowed: The difference that rounding explains.
    """

    before: Array
    after: Array
    allowed: Array

    @property
    def size(self) -> Array:
        """Value after minus value before."""
        return self.after - self.before

    @property
    def present(self) -> NDArray[np.bool_]:
        """Where there is more than rounding explains."""
        return np.logical_not(np.abs(self.size) <= self.allowed)

    @property
    def begins(self) -> NDArray[np.bool_]:
        """Where the right side is not zero: above half of what is allowed, so that no jump lacks a side."""
        return np.logical_not(np.abs(self.after) <= self.allowed / 2)

    @property
    def ends(self) -> NDArray[np.bool_]:
        """Where the left side is not zero."""
        return np.logical_not(np.abs(self.before) <= self.allowed / 2)


def _jumps(trajectory: Trajectory, order: int, peaks: IntervalPeaks) -> _Jumps:
    curve, quantity = trajectory.curve, _QUANTITIES[order]
    first, last = curve.piece_ends(order)
    slope_first, slope_last = np.abs(curve.piece_ends(order + 1))
    nothing = np.zeros((1, curve.dimension))
    slope = np.maximum(np.concatenate([nothing, slope_last]), np.concatenate([slope_first, nothing]))
    peak = peaks.of_orders[order].magnitude.max(axis=0)
    return _Jumps(
        before=np.concatenate([getattr(trajectory.start, quantity)[None], last]),
        after=np.concatenate([first, getattr(trajectory.end, quantity)[None]]),
        allowed=allowed_jump(peak, curve.breaks, slope),
    )


def _limited(
    trajectory: Trajectory, limits_by_move: Sequence[Limits], steps: _Jumps
) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return where a step breaks the jerk limit of the move after it, and of that before it, (m, n)."""
    if len(limits_by_move) != len(trajectory.spans):
        raise ValueError(f"{len(limits_by_move)} limits for {len(trajectory.spans)} moves")
    limited = np.array([np.isfinite(limits.jerk).any(axis=1) for limits in limits_by_move])
    begins = steps.present & steps.begins & limited[_later(trajectory)[:, 0]]
    ends = steps.present & steps.ends & limited[_earlier(trajectory)[:, 0]]
    return begins, ends


def _later(trajectory: Trajectory) -> NDArray[np.intp]:
    """Return the index in `spans` of the move after each break, the last move at the end; (pieces + 1, 1)."""
    spans = _span_of_pieces(trajectory)
    return np.append(spans, spans[-1])[:, None]


def _earlier(trajectory: Trajectory) -> NDArray[np.intp]:
    """Return the index in `spans` of the move before each break, the first at the start; (pieces + 1, 1)."""
    spans = _span_of_pieces(trajectory)
    return np.append(spans[0], spans)[:, None]


def _span_of_pieces(trajectory: Trajectory) -> NDArray[np.intp]:
    """Return the span of each piece, looked up at its middle because borders may be rounded; (pieces,)."""
    starts = np.array([span.start for span in trajectory.spans])
    breaks = trajectory.curve.breaks - trajectory.curve.start
    later = np.searchsorted(starts, (breaks[1:] + breaks[:-1]) / 2, "right")
    return np.maximum(later - 1, 0)


def _largest(
    trajectory: Trajectory, order: int, jumps: _Jumps, chosen: NDArray[np.bool_], owner: NDArray[np.intp]
) -> list[Finding]:
    """Return a finding for the largest of the chosen jumps of each move and joint."""
    owners = np.broadcast_to(owner, chosen.shape)
    rows, joints = _first_largest(np.abs(jumps.size), chosen, owners)
    times = trajectory.curve.breaks - trajectory.curve.start
    findings = []
    for row, joint in zip(rows.tolist(), joints.tolist(), strict=True):
        name, time = trajectory.joint_names[joint], float(times[row])
        value, limit = float(jumps.size[row, joint]), float(jumps.allowed[row, joint])
        finding = Finding(
            move=trajectory.spans[int(owners[row, joint])].index,
            joint=name,
            kind=_KINDS[order],
            value=value,
            limit=limit,
            time=time,
            hint=JERK_HINT if order == 2 else None,
            message=f"the {_QUANTITIES[order]} of {{joint}} jumps by {{value}} {at_time(time)}",
            amounts=joint_amounts(trajectory, joint, order, value=value, limit=limit),
        )
        findings.append(finding)
    return findings


def _first_largest(
    sizes: Array, chosen: NDArray[np.bool_], owner: NDArray[np.intp]
) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return rows and columns of the largest chosen size of each owner and column, first of equal ones."""
    rows, columns = np.nonzero(chosen)
    group = owner[rows, columns] * sizes.shape[1] + columns
    largest = np.full(int(group.max(initial=-1)) + 1, 0.0)
    np.maximum.at(largest, group, sizes[rows, columns])
    top = np.flatnonzero(np.logical_not(sizes[rows, columns] < largest[group] * (1 - _SAME)))
    first = top[np.unique(group[top], return_index=True)[1]]
    return rows[first], columns[first]
