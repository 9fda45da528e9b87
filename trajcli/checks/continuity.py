"""Continuity: jumps in position and velocity, and in acceleration where jerk is limited.

Both sides of every break are compared. Before the first break the arm is in the trajectory's declared start,
and after the last one in its declared end.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import overload

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.extrema import IntervalPeaks
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.findings import Finding, at_time, joint_amounts
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.robot import Limits
from trajcli.limits.joints import numbered, peaks_by_move
from trajcli.limits.tolerances import allowed_jump
from trajcli.trajectory import Trajectory

JERK_HINT = "use jerk_limited or quintic, or say limits: {jerk: null} in the job"
_BLOCK = 16_384  # breaks looked at together: what is computed of them takes some MB
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
    peaks_of_moves = peaks_by_move(trajectory) if peaks is None else peaks
    spans, limited = _span_of_pieces(trajectory), _limited_spans(trajectory, limits_by_move)
    findings: list[Finding] = []
    for order in range(3):
        found = []
        for jumps in _jumps(trajectory, order, peaks_of_moves, spans):
            if order < 2:
                found.append(jumps.chosen(jumps.present, jumps.later))
                continue
            begins, ends = _breaking(jumps, limited)
            found.append(jumps.chosen(begins | ends, np.where(begins, jumps.later, jumps.earlier)))
        findings += _largest(trajectory, order, _together(found))
    return findings


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
    peaks_of_moves = peaks_by_move(trajectory) if peaks is None else peaks
    limited = None if limits_by_move is None else _limited_spans(trajectory, limits_by_move)
    found = []
    for jumps in _jumps(trajectory, 2, peaks_of_moves, _span_of_pieces(trajectory)):
        legal = jumps.present
        if limited is not None:
            begins, ends = _breaking(jumps, limited)
            legal = legal & ~(begins | ends)
        found.append(jumps.chosen(legal, np.where(jumps.begins, jumps.later, jumps.earlier)))
    steps = _together(found)
    times = trajectory.curve.breaks[steps.rows] - trajectory.curve.start
    moves = np.array([trajectory.spans[k].index for k in steps.owners.tolist()], dtype=np.intp)
    return AccelerationSteps(moves, steps.joints, times, steps.sizes, trajectory.joint_names)


@frozen
class _Chosen:
    """Some of the jumps, k of them, in order of time.

    Attributes:
        rows: Indices of the breaks, shape (k,).
        joints: Indices of the joints, shape (k,).
        owners: Index in `spans` of the move that each belongs to, shape (k,).
        sizes: Value after minus value before, shape (k,).
        allowed: The difference that rounding explains, shape (k,).
    """

    rows: NDArray[np.intp]
    joints: NDArray[np.intp]
    owners: NDArray[np.intp]
    sizes: Array
    allowed: Array


@frozen
class _Jumps:
    """The two sides of some breaks that follow each other, m of them.

    Attributes:
        row: Index of the first of these breaks.
        before: Value on the left side, shape (m, n).
        after: Value on the right side, shape (m, n).
        allowed: The difference that rounding explains, shape (m, n).
        earlier: Index in `spans` of the move before each break, of the first one at the start, shape (m, 1).
        later: Index in `spans` of the move after each break, of the last one at the end, shape (m, 1).
    """

    row: int
    before: Array
    after: Array
    allowed: Array
    earlier: NDArray[np.intp]
    later: NDArray[np.intp]

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

    def chosen(self, which: NDArray[np.bool_], owner: NDArray[np.intp]) -> _Chosen:
        """Return some of the jumps, (m, n), with the span that each belongs to, (m, n) or (m, 1)."""
        rows, joints = np.nonzero(which)
        owners = np.broadcast_to(owner, which.shape)[rows, joints]
        return _Chosen(rows + self.row, joints, owners, self.size[rows, joints], self.allowed[rows, joints])


def _together(parts: Sequence[_Chosen]) -> _Chosen:
    names = ("rows", "joints", "owners", "sizes", "allowed")
    return _Chosen(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def _jumps(
    trajectory: Trajectory, order: int, peaks: IntervalPeaks, spans: NDArray[np.intp]
) -> Iterator[_Jumps]:
    """Yield the two sides of all breaks, the first and the last included, many breaks at a time."""
    curve, quantity = trajectory.curve, _QUANTITIES[order]
    peak = peaks.of_orders[order].magnitude.max(axis=0)
    nothing = np.zeros((1, curve.dimension))
    outside = (
        nothing,
        nothing,
        *(getattr(end, quantity)[None] for end in (trajectory.start, trajectory.end)),
    )
    for row in range(0, curve.pieces + 1, _BLOCK):
        behind = min(row + _BLOCK, curve.pieces + 1)
        left, right = max(row - 1, 0), min(behind, curve.pieces)
        part = PiecewisePolynomial(curve.breaks[left : right + 1], curve.coefficients[:, left:right])
        (first, last), (slope_first, slope_last) = part.piece_ends(order), np.abs(part.piece_ends(order + 1))
        sides = [
            (slope_last, slope_first[row - left :]),
            (last, first[row - left :]),
        ]
        slopes, values = (
            (
                (before if row else np.concatenate([start, before]))[: behind - row],
                (after if behind <= curve.pieces else np.concatenate([after, end]))[: behind - row],
            )
            for (before, after), (start, end) in zip(sides, (outside[:2], outside[2:]), strict=True)
        )
        breaks = np.arange(row, behind)
        yield _Jumps(
            row,
            *values,
            allowed_jump(peak, curve.breaks[row:behind], np.maximum(*slopes)),
            spans[np.maximum(breaks - 1, 0)][:, None],
            spans[np.minimum(breaks, curve.pieces - 1)][:, None],
        )


def _limited_spans(trajectory: Trajectory, limits_by_move: Sequence[Limits]) -> NDArray[np.bool_]:
    """Return whether each span limits the jerk of each joint, (spans, n)."""
    if len(limits_by_move) != len(trajectory.spans):
        raise ValueError(f"{len(limits_by_move)} limits for {len(trajectory.spans)} moves")
    which, different = numbered(limits_by_move)
    return np.array([np.isfinite(limits.jerk).any(axis=1) for limits in different])[which]


def _breaking(jumps: _Jumps, limited: NDArray[np.bool_]) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return where a step breaks the jerk limit of the move after it, and of that before it, (m, n)."""
    begins = jumps.present & jumps.begins & limited[jumps.later[:, 0]]
    ends = jumps.present & jumps.ends & limited[jumps.earlier[:, 0]]
    return begins, ends


def _span_of_pieces(trajectory: Trajectory) -> NDArray[np.intp]:
    """Return the span of each piece, looked up at its middle because borders may be rounded; (pieces,)."""
    starts = np.array([span.start for span in trajectory.spans])
    breaks = trajectory.curve.breaks - trajectory.curve.start
    later = np.searchsorted(starts, (breaks[1:] + breaks[:-1]) / 2, "right")
    return np.maximum(later - 1, 0)


def _largest(trajectory: Trajectory, order: int, chosen: _Chosen) -> list[Finding]:
    """Return a finding for the largest of the chosen jumps of each move and joint."""
    findings = []
    for k in _first_largest(chosen, trajectory.curve.dimension).tolist():
        joint, value, limit = int(chosen.joints[k]), float(chosen.sizes[k]), float(chosen.allowed[k])
        time = float(trajectory.curve.breaks[chosen.rows[k]] - trajectory.curve.start)
        finding = Finding(
            move=trajectory.spans[int(chosen.owners[k])].index,
            joint=trajectory.joint_names[joint],
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


def _first_largest(chosen: _Chosen, joints: int) -> NDArray[np.intp]:
    """Return which of the jumps are the largest of their owner and joint, the first of equal ones."""
    group, sizes = chosen.owners * joints + chosen.joints, np.abs(chosen.sizes)
    largest = np.full(int(group.max(initial=-1)) + 1, 0.0)
    np.maximum.at(largest, group, sizes)
    top = np.flatnonzero(np.logical_not(sizes < largest[group] * (1 - _SAME)))
    return top[np.unique(group[top], return_index=True)[1]]
