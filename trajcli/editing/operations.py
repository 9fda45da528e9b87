"""Operations on recorded motions: time reversal, cutting, joining, sampling on another grid.

Each keeps the columns. Rows that stay are taken as they are, so that an operation and its inverse give the
same rows; rows between them are those of the curve that the columns determine.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.editing.edited_motion import ORDERS, EditedMotion, decimals_for
from trajcli.errors import InputError, Problem, VerificationError
from trajcli.grids import UniformGrid

_NO_EFFORT = "the columns of efforts are left out: they would be others"
_SAME = 1e-9  # rad, m and their rates, beside the rounding of both files: states that agree
_NEAR = 1e-6  # of an interval: a stamp this near to a row is that of the row


def reverse(motion: EditedMotion) -> EditedMotion:
    """Return the motion that goes back: q(t0 + t1 - t), over the same time."""
    rows = motion.rows
    t = (rows.t[0] + rows.t[-1]) - rows.t[::-1]
    t[0], t[-1] = rows.t[0], rows.t[-1]
    quantities = {
        name: (-1.0) ** order * values[::-1] + 0.0
        for order, name in enumerate(ORDERS)
        if (values := motion.quantities.get(name)) is not None
    }
    # a row is of the move of the interval that follows, the last one of that before
    move = None if rows.move is None else np.append(rows.move[-2::-1], rows.move[0])
    notes = () if rows.tau is None else (_NO_EFFORT,)
    return motion.with_rows(t, quantities, move, *notes, decimals=decimals_for(motion, t))


def cut(motion: EditedMotion, first: float, last: float) -> EditedMotion:
    """Return the rows from one time to another, both included; between rows, as the curve is.

    Args:
        motion: What is cut.
        first: s, as in the file.
        last: s, likewise.

    Raises:
        InputError: When the motion is not there at these times, or they are not in order.
    """
    t = motion.rows.t
    slack = _slack_of(motion, float(np.diff(t).min()) / 4)
    for name, time in (("--from", first), ("--to", last)):
        if not t[0] - slack <= time <= t[-1] + slack:
            extent = f"{motion.rows.source} goes from {t[0]:.15g} s to {t[-1]:.15g} s"
            raise InputError(f"{name} {time:.9g}: {extent}", hint="give times of the file, s")
    begin, end = _snapped(motion, np.array([first, last]), slack)
    if not begin < end:
        raise InputError(f"--from {first:.9g} is not before --to {last:.9g}")
    return _at(motion, np.concatenate([[begin], t[(t > begin) & (t < end)], [end]]))


def resample(motion: EditedMotion, rate: float) -> EditedMotion:
    """Return the motion at rows 1 / rate apart, and one at the end.

    Raises:
        InputError: When there can be no such rows.
    """
    t = motion.rows.t
    grid = UniformGrid(float(t[-1] - t[0]), rate, float(t[0]))
    # a grid of far too long a period has the end alone
    times = np.concatenate([t[:1], *(stamps for stamps, _ in grid.blocks())])
    times[-1] = t[-1]
    # no two of the times come to one row, but the first two and the last two
    return _at(motion, np.unique(_snapped(motion, times, _slack_of(motion, (0.5 - _NEAR) / rate))))


def _slack_of(motion: EditedMotion, largest: float) -> float:
    """Return how far a stamp may be off, by its rounding and at most by `largest`, s."""
    t, resolution = motion.rows.t, motion.rows.resolution
    relative = resolution.relative_time * float(np.abs(t).max())
    return min(2 * max(resolution.time, relative) + _NEAR * float(np.diff(t).min()), largest)


def _nearest(motion: EditedMotion, times: Array) -> np.ndarray:
    """Return the index of the row nearest to each time."""
    t = motion.rows.t
    after = np.clip(np.searchsorted(t, times), 1, t.size - 1)
    return np.where(times - t[after - 1] <= t[after] - times, after - 1, after)


def _snapped(motion: EditedMotion, times: Array, slack: float) -> Array:
    """Return times, those within `slack` of a row as the stamp of that row."""
    stamps = motion.rows.t[_nearest(motion, times)]
    return np.where(np.abs(stamps - times) <= slack, stamps, times)


def _at(motion: EditedMotion, times: Array) -> EditedMotion:
    """Return the motion at some times: rows as they are where there is one, else as the curve is.

    Where a row is new, columns that the curve does not take are left out.
    """
    rows = motion.rows
    nearest = _nearest(motion, times)
    between = rows.t[nearest] != times
    quantities = {name: values[nearest].copy() for name, values in motion.quantities.items()}
    notes: tuple[str, ...] = ()
    if between.any():
        of_curve = ORDERS[: 1 + (rows.qd is not None) * (1 + (rows.qdd is not None))]
        others = ", ".join(name for name in quantities if name not in of_curve)
        notes = (f"the columns {others} are left out: nothing says them between rows",) * bool(others)
        quantities, curve = {name: quantities[name] for name in of_curve}, motion.curve()
        for order, values in enumerate(quantities.values()):
            values[between] = curve.evaluate(times[between], order)
        motion = motion.with_planned_decimals(of_curve)
    before = np.clip(np.searchsorted(rows.t, times, side="right") - 1, 0, rows.t.size - 1)
    move = None if rows.move is None else rows.move[before]
    return motion.with_rows(times, quantities, move, *notes, decimals=decimals_for(motion, times))


def join(first: EditedMotion, second: EditedMotion) -> EditedMotion:
    """Return one motion after the other: the second begins when the first ends, and where it ends.

    Columns and units are those of the first. Where the accelerations of both differ, the row between them
    has that of the second. Moves are counted on, unless both motions end and begin in one move at one time,
    as parts of one file do.

    Raises:
        InputError: When they have not the same joints, or the second lacks a column of the first.
        VerificationError: When position or velocity would jump; with the jump.
    """
    a, b = first.rows, second.rows
    _check_alike(first, second)
    _check_states_agree(first, second)
    shift = float(a.t[-1] - b.t[0])
    t = np.concatenate([a.t, b.t[1:] + shift if shift else b.t[1:]])
    quantities: Mapping[str, Array] = {
        name: np.concatenate([values[:-1], second.quantities[name]])
        for name, values in first.quantities.items()
    }
    move, notes = None, (*second.notes, *_step(first, second))
    if a.move is not None and b.move is not None:
        parts = not shift and a.move[-1] == b.move[0]
        later = 0 if parts else int(a.move.max()) + 1 - int(b.move.min())
        move = np.concatenate([a.move[:-1], b.move + later])
    elif a.move is not None:
        notes = (*notes, f"the column move is left out: {b.source} has none")
    return first.with_rows(t, quantities, move, *notes, decimals=decimals_for(first, t))


def _check_alike(first: EditedMotion, second: EditedMotion) -> None:
    a, b = first.rows, second.rows
    count, other = a.q.shape[1], b.q.shape[1]
    if count != other:
        raise InputError(f"{a.source} has {count} joints, {b.source} has {other}")
    if a.joints is not None and b.joints is not None and a.joints != b.joints:
        names = f"{', '.join(a.joints)}; {b.source} has {', '.join(b.joints)}"
        raise InputError(f"{a.source} has the joints {names}")
    lacking = [name for name in first.quantities if name not in second.quantities]
    if lacking:
        raise InputError(f"{b.source} has no columns {', '.join(lacking)}, as {a.source} has")


def _check_states_agree(first: EditedMotion, second: EditedMotion) -> None:
    """Refuse a jump of position or velocity between two motions, beyond the rounding of both."""
    problems = []
    for order, (name, what) in enumerate((("q", "position"), ("qd", "velocity"))):
        ends = [motion.quantities.get(name) for motion in (first, second)]
        if ends[0] is None or ends[1] is None:
            continue
        before, after = ends[0][-1], ends[1][0]
        halves, shares = zip(
            *(each.rows.resolution.roundings[order] for each in (first, second)), strict=True
        )
        slack = 2 * sum(halves) + sum(shares) * np.abs(after) + _SAME * (1 + np.abs(after))
        problems += [
            _jump(first, second, joint, what, (float(before[joint]), float(after[joint])))
            for joint in np.flatnonzero(np.abs(after - before) > slack).tolist()
        ]
    if problems:
        raise VerificationError(*problems)


def _jump(
    first: EditedMotion, second: EditedMotion, joint: int, what: str, ends: tuple[float, float]
) -> Problem:
    """Return what jumps from one motion to the next, in the units of the first one's columns."""
    kind = {"position": "q", "velocity": "qd"}[what]
    column = next(each for each in first.columns if (each.quantity, each.joint) == (kind, joint))
    before, after = (value / column.factor for value in ends)
    name = first.joint_names[joint]
    where = f"from the end of {first.rows.source} ({before:.9g}) to the start of {second.rows.source}"
    jump = f"jumps by {after - before:.9g} {where} ({after:.9g})"
    return Problem(
        f"the {what} of {name} {jump}, in the units of {column.name}",
        "motions are joined where both are in one state",
        joint=name,
        time=float(first.rows.t[-1]),
        value=ends[1] - ends[0],
        limit=0.0,
        kind="jump",
    )


def _step(first: EditedMotion, second: EditedMotion) -> tuple[str, ...]:
    """Return that an acceleration steps where two motions meet."""
    before, after = first.quantities.get("qdd"), second.quantities.get("qdd")
    if before is None or after is None:
        return ()
    rounding = 2 * (first.rows.resolution.qdd + second.rows.resolution.qdd)
    steps = np.abs(after[0] - before[-1]) - rounding - _SAME * (1 + np.abs(after[0]))
    joint = int(steps.argmax())
    if steps[joint] <= 0:
        return ()
    values = f"from {before[-1, joint]:.9g} to {after[0, joint]:.9g} (SI)"
    where = f"the acceleration of {first.joint_names[joint]} steps at {first.rows.t[-1]:.9g} s"
    return (f"{where} {values}; the row there has the later one",)
