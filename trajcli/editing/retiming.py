"""Retiming of recorded motions: the smallest stretch with which limits are kept, of all or of each move.

A motion q(t) stretched by the factor k is q(t / k): its derivatives of order m are 1 / k^m of what they were.
So a limit of order m that is used c times needs k = c^(1 / m), and one of velocity by position k = c. The
factor that follows from all limits is tried on the rows themselves, as `trajcli check` judges them; where
rounding leaves room, or a limit does not scale, it is bracketed.

Source: Siciliano et al., "Robotics: Modelling, Planning and Control", 7.3, dynamic scaling of trajectories.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from math import isfinite, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.editing.edited_motion import ORDERS, EditedMotion
from trajcli.errors import InputError, Problem, VerificationError
from trajcli.findings import Finding
from trajcli.frozen import frozen
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.kinematics.robot import QUANTITIES, Robot
from trajcli.limits.kinds import STRETCHABLE
from trajcli.streams.decimals import DECIMALS
from trajcli.streams.recorded_motion import RecordedMotion

_FINE = 1e-4  # relative: how far above the smallest factor the one that is found may be
_SLOWEST, _FASTEST = 1e6, 1e-9
_TRIES = 40
_SMALL_ROUNDING = 0.01  # of a limit: where it is more, it hides how far the limit is used
_FEWER = 5  # times that derivatives are written with fewer decimals: as the file has them, and one less each
_NUDGE = 1e-7  # relative: what the rounding of the rows that are written may ask for besides
_AT_REST = 1e-9  # of the largest velocity of a joint: below that a border of two moves is at rest
_MICROSECONDS = 1e-3  # s: intervals below this need stamps with more than nine decimals
_NO_EFFORT = "the columns of efforts are left out: they would be others"

Judge = Callable[[RecordedMotion], Finding | None]
"""Returns what is worst about rows; None where limits are kept."""


@frozen
class Stretch:
    """A factor of time, and why it is not smaller.

    Attributes:
        factor: New time over old time.
        moves: Indices of the moves that have it; None for the whole motion.
        binding: What a smaller factor breaks; None where the motion keeps its time.
    """

    factor: float
    moves: tuple[int, ...] | None
    binding: Finding | None


def retime(
    motion: EditedMotion,
    requirements: Requirements,
    *,
    fastest: bool = False,
    per_move: bool = False,
    as_read: Callable[[EditedMotion], EditedMotion] = EditedMotion.as_written,
) -> tuple[EditedMotion, tuple[Stretch, ...]]:
    """Return a motion over the same positions that keeps its limits, and by what it is stretched.

    Args:
        motion: What is retimed.
        requirements: Its limits.
        fastest: Whether it may also become faster; else it keeps its time where it keeps its limits.
        per_move: Whether each move has a factor of its own; moves that meet in motion share one, and one
            that stands still keeps its time.
        as_read: Returns a motion as a reader of what is written of it finds it.

    Raises:
        InputError: When there are no moves, or nothing bounds how fast it may be, or nothing says which move
            of several that differ a row is of.
        VerificationError: When something is wrong with it that no time mends.
    """
    if motion.rows.move is None:
        requirements = _of_any_row(requirements, motion)
    judge, strictly = (_judge_of(requirements, strict=strict) for strict in (False, True))
    ranges = _ranges(motion) if per_move else [(slice(0, motion.rows.t.size), None)]
    stretches = []
    for rows, moves in ranges:
        part = _part(motion.rows, rows)
        hurried = fastest and (moves is None or _travels(part))
        factor, binding = _smallest(part, judge, strictly, fastest=hurried)
        stretches.append(Stretch(factor, moves, binding))
    return _verified(motion, [rows for rows, _ in ranges], stretches, judge, as_read)


def _of_any_row(requirements: Requirements, motion: EditedMotion) -> Requirements:
    """Return requirements of rows that say no move: there are some where all moves have the same."""
    arms = {
        _what_limits(arm, tool=requirements.tool is not None): arm for arm in requirements.by_move.values()
    }
    if len(arms) > 1:
        rows = f"{motion.rows.source} has no column `move` and does not last as long as the plan of the job"
        hint = "plan CSV with `columns: [t, q, qd, qdd, move]`, or retime by --robot"
        raise InputError(f"{rows}, whose moves differ in limits, tool or load", hint=hint)
    return replace(requirements, robot=next(iter(arms.values()), requirements.robot))


def _what_limits(robot: Robot, *, tool: bool) -> tuple[object, ...]:
    """Return what the limits of an arm depend on, as a key; its tool and loads only where they count."""
    limits = robot.limits
    bounds = (getattr(limits, name).tobytes() for name in (*QUANTITIES, "velocity_by_position", "effort"))
    return (*bounds, limits.tcp, *(robot.equipment if tool or limits.has_effort else ()))


def _judge_of(requirements: Requirements, *, strict: bool) -> Judge:
    """Return what judges rows: as `trajcli check` does, or strictly where rounding is small.

    The strict one is for other times of rows whose columns agree: a jump in them is more than limits allow.
    """

    def judge(rows: RecordedMotion) -> Finding | None:
        wrong = [f for f in judge_motion(lambda: (rows,), requirements).findings if _counts(f, strict=strict)]
        for finding in wrong:
            if not strict and finding.kind not in STRETCHABLE:
                hint = finding.hint or "another time of the motion does not help"
                text, joint = finding.text(), finding.joint
                raise VerificationError(
                    Problem(text, hint, joint=joint, time=finding.time, kind=finding.kind)
                )
        return max(wrong, key=lambda finding: finding.factor or 0.0, default=None)  # a jump is a jerk, too

    return judge


def _counts(finding: Finding, *, strict: bool) -> bool:
    """Return whether a motion with a finding does not keep its limits."""
    if finding.severity != "error":
        return False
    small = finding.limit is not None and finding.rounding <= _SMALL_ROUNDING * abs(finding.limit)
    return finding.certainty == "exceeded" or (strict and small and finding.kind in STRETCHABLE)


def _part(rows: RecordedMotion, part: slice) -> RecordedMotion:
    names = (*ORDERS, "tau", "move")
    values: dict[str, Any] = {
        name: None if (found := getattr(rows, name)) is None else found[part] for name in names
    }
    return replace(rows, t=rows.t[part], **values)


def _travels(rows: RecordedMotion) -> bool:
    """Return whether a joint moves in some rows; those of a hold stand still, and no limit times them."""
    return bool((np.ptp(rows.q, axis=0) > 2 * rows.resolution.q).any())


def _smallest(
    rows: RecordedMotion, judge: Judge, strictly: Judge, *, fastest: bool
) -> tuple[float, Finding | None]:
    """Return the smallest factor with which limits are kept, and what a smaller one breaks.

    Whether the motion keeps them as it is, is left to its rounding, as `trajcli check` does.
    """
    broken, low, longest = judge(rows), 1.0, _SLOWEST
    rows = replace(rows, t=rows.t - rows.t[0])  # stamps of far times have fewer digits
    if broken is None:
        longest = 1.0
        if not fastest:
            return 1.0, None
        while broken is None:
            low /= 2.0
            if low < _FASTEST:
                what = f"no limit bounds how fast {rows.source} may be"
                raise InputError(what, hint="it does not move, or its joints have no limits")
            broken = strictly(stretched(rows, low))
    high = low
    for _ in range(_TRIES):
        binding, low = broken, high
        high *= max(broken.factor, 1 + _FINE / 4) if broken.factor is not None else 2.0
        if not isfinite(high) or high > _SLOWEST:
            break
        high = min(high, longest)
        broken = None if high == 1.0 else strictly(stretched(rows, high))
        if broken is None:
            return _bracketed(rows, strictly, (low, high), binding)
    raise VerificationError(
        Problem(f"no stretch keeps the limits: {binding.text()}", joint=binding.joint, kind=binding.kind)
    )


def _bracketed(
    rows: RecordedMotion, judge: Judge, ends: tuple[float, float], binding: Finding
) -> tuple[float, Finding]:
    """Return a factor that keeps limits, near to one that does not, and what the latter breaks."""
    low, high = ends
    middle = high / (1 + _FINE)  # the factor of the closed form needs this one trial
    while high > low * (1 + 2 * _FINE) and middle > low:
        broken = judge(stretched(rows, middle))
        if broken is None:
            high = middle
        else:
            low, binding = middle, broken
        middle = sqrt(low * high)
    return high, binding


def stretched(rows: RecordedMotion, factor: float) -> RecordedMotion:
    """Return rows over a time that is longer by a factor, from their first stamp on."""
    values: dict[str, Any] = {
        name: None if (found := getattr(rows, name)) is None else found / factor**order
        for order, name in enumerate(ORDERS)
    }
    before = rows.resolution
    resolution = replace(before, time=before.time * factor, qd=before.qd / factor, qdd=before.qdd / factor**2)
    t = rows.t[0] + (rows.t - rows.t[0]) * factor
    return replace(rows, t=t, tau=None, resolution=resolution, **values)


def _ranges(motion: EditedMotion) -> list[tuple[slice, tuple[int, ...]]]:
    """Return the rows of moves, borders in both, and their indices; of moves that meet in motion together."""
    move = motion.rows.move
    if move is None:
        hint = "leave --per-move out, or plan CSV with `columns: [t, q, qd, qdd, move]`"
        raise InputError(f"{motion.rows.source} has no column `move`", hint=hint)
    borders = np.flatnonzero(np.diff(move)) + 1
    resting = [border for border in borders.tolist() if _rests(motion, border)]
    edges = [0, *resting, move.size - 1]
    return [
        (slice(low, high + 1), tuple(dict.fromkeys(move[low : max(high, low + 1)].tolist())))
        for low, high in pairwise(edges)
        if high > low
    ]


def _rests(motion: EditedMotion, row: int) -> bool:
    """Return whether all joints rest at a row; where nothing says velocities, time may change anywhere."""
    velocities = motion.rows.qd
    if velocities is None:
        return True
    slack = 2 * motion.rows.resolution.qd + _AT_REST * (1 + np.abs(velocities).max(axis=0))
    return bool((np.abs(velocities[row]) <= slack).all())


def _verified(
    motion: EditedMotion,
    ranges: list[slice],
    stretches: list[Stretch],
    judge: Judge,
    as_read: Callable[[EditedMotion], EditedMotion],
) -> tuple[EditedMotion, tuple[Stretch, ...]]:
    """Return the retimed motion, which keeps its limits as it will be read."""
    tries = coarser = 0
    while True:
        found = _assembled(motion, ranges, [stretch.factor for stretch in stretches], coarser)
        read = as_read(found).rows
        try:
            broken = None if found is motion and _as_certain(read, motion.rows) else judge(read)
        except VerificationError as error:
            # numbers that are rounded twice are off by more than their decimals say: fewer are certain
            if not read.resolution.q.any() and as_read is not EditedMotion.as_written:
                _verified_as_csv(motion, ranges, stretches, judge, error)
                raise
            if coarser == _FEWER:
                raise
            coarser += 1
            continue
        tries += 1
        if broken is None:
            return found, tuple(stretches)
        if tries > _TRIES:
            message = f"rounded as it would be written, {broken.text()}"
            raise VerificationError(Problem(message, joint=broken.joint, kind=broken.kind))
        stretches = [_longer(stretch, broken) for stretch in stretches]


def _as_certain(read: RecordedMotion, rows: RecordedMotion) -> bool:
    """Return whether numbers that are read again are rounded as those of the file were."""
    both = zip(read.resolution.roundings, rows.resolution.roundings, strict=True)
    return all(np.array_equal(a, b) and share == other for (a, share), (b, other) in both)


def _verified_as_csv(
    motion: EditedMotion,
    ranges: list[slice],
    stretches: list[Stretch],
    judge: Judge,
    error: VerificationError,
) -> None:
    """Refuse all digits of a motion with the advice to write its decimals, where these leave room."""
    try:
        _verified(motion, ranges, stretches, judge, EditedMotion.as_written)
    except VerificationError:
        return
    hint = "the decimals of a CSV leave room for that, all digits do not: `-o FILE.csv`"
    raise VerificationError(*(replace(problem, hint=hint) for problem in error.problems)) from None


def _longer(stretch: Stretch, broken: Finding) -> Stretch:
    """Return a stretch that is longer where something is broken in its moves."""
    if broken.move is not None and stretch.moves is not None and broken.move not in stretch.moves:
        return stretch
    more = 1 + _NUDGE if broken.factor is None else max(broken.factor, 1 + _NUDGE)
    return replace(stretch, factor=stretch.factor * more, binding=stretch.binding or broken)


def _assembled(motion: EditedMotion, ranges: list[slice], factors: list[float], coarser: int) -> EditedMotion:
    """Return the motion with a factor for each range of rows, its derivatives with fewer decimals."""
    rows = motion.rows
    if all(factor == 1.0 for factor in factors):
        return motion
    of_row = np.ones(rows.t.size)
    for part, factor in zip(ranges, factors, strict=True):
        of_row[part] = factor  # a border has the factor of what follows
    t = _stamps(rows.t, of_row, uniform=len(factors) == 1)
    quantities: dict[str, Array] = {
        name: values / of_row[:, None] ** order
        for order, name in enumerate(ORDERS)
        if (values := motion.quantities.get(name)) is not None
    }
    notes = () if rows.tau is None else (_NO_EFFORT,)
    fine = float(np.diff(t).min()) < _MICROSECONDS
    found = motion.with_rows(t, quantities, rows.move, *notes, decimals=DECIMALS + 3 * fine)
    if not coarser:
        return found.with_planned_decimals(ORDERS[1:])
    return found if coarser == 1 else _coarser(found, coarser - 1)


def _coarser(motion: EditedMotion, fewer: int) -> EditedMotion:
    """Return a motion whose derivatives are written with fewer decimals than its file has."""
    columns = tuple(
        replace(column, decimals=max(column.decimals - fewer, 0))
        if column.quantity in ORDERS[1:] and column.decimals is not None
        else column
        for column in motion.columns
    )
    note = (
        f"derivatives are written with {fewer} decimal{'s' * (fewer > 1)} fewer: the others are not certain"
    )
    return replace(motion, columns=columns, notes=(*motion.notes, note))


def _stamps(t: Array, of_row: NDArray[np.float64], *, uniform: bool) -> Array:
    """Return stamps whose intervals are longer by the factors of their first rows."""
    lengths = np.diff(t) * of_row[:-1]
    local: Array = (t - t[0]) * of_row[0] if uniform else np.append(0.0, np.cumsum(lengths))
    stamps: Array = t[0] + local
    return stamps
