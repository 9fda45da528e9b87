"""Writing of edited motions: in the columns, units and decimals of their file, or in another format."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import BinaryIO

import numpy as np

from trajcli.columns import EFFORT, JOINT_GROUPS, JOINT_ORDERS, Column
from trajcli.curves.piecewise import Array
from trajcli.editing.edited_motion import ORDERS, EditedMotion, rounded
from trajcli.errors import InputError
from trajcli.findings import time_text
from trajcli.grids import ROWS
from trajcli.knots import Deviation, Knots
from trajcli.streams.csv import encoder_of
from trajcli.streams.decimals import DECIMALS
from trajcli.streams.formats import FormatName, Goal, StreamFormat, WriteOptions, format_of, write_verified
from trajcli.streams.mcap.recording import Recording
from trajcli.streams.recorded_motion import WrittenColumn
from trajcli.streams.whole_file import standard_output, whole_file
from trajcli.units import Quantity
from trajcli.version import __version__

_PER_SECOND = 1_000_000_000
_LATEST = 2**31 - 1  # s: what a time of ROS 2 can say
_HELD = 15  # decimals: a number of 64 bits surely has so many digits; with more, all its own are written


def write_motion(motion: EditedMotion, path: str | None, form: FormatName | None = None) -> tuple[str, ...]:
    """Write a motion; return what a reader should know about what the format cannot hold.

    Args:
        motion: Its columns are kept where the format has columns.
        path: The ending of its name says the format; None or "-" is CSV on standard output.
        form: The format where the name leaves that open.

    Raises:
        InputError: When the format cannot hold the motion.
        FileError: When the file cannot be written.
        BrokenPipeError: When the reader has closed the pipe.
    """
    chosen = format_of(path, form)
    if chosen.name == "CSV":
        with standard_output() if path in (None, "-") else whole_file(str(path)) as out:
            write_table(motion, out)
        return _note_of_names(motion)
    options, notes = _options(motion, chosen)
    columns = _si_columns(motion, chosen)
    rows = _si_rows(motion, columns) if chosen.content != "knots" else iter(())
    if path in (None, "-"):
        with standard_output() as out:
            chosen.write(rows, columns, out, options)
    else:
        write_verified(Path(str(path)), rows, columns, options, chosen)
    return notes


def as_read(motion: EditedMotion, path: str | None, form: FormatName | None = None) -> EditedMotion:
    """Return a motion as a reader finds it in what `write_motion` writes.

    Raises:
        InputError: When nothing says the format.
    """
    chosen = format_of(path, form)
    if chosen.name == "CSV":
        return replace(motion, columns=_table_columns(motion)).as_written()
    stamps = None if chosen.content == "rows" else DECIMALS  # whole nanoseconds
    exact = tuple(
        replace(column, decimals=None)
        if column.quantity != "t"
        else replace(column, factor=1.0, decimals=stamps)
        for column in motion.columns
    )
    return replace(motion, columns=exact).as_written()


def _table_columns(motion: EditedMotion) -> tuple[WrittenColumn, ...]:
    return motion.columns if motion.format == "csv" else plain_columns(motion)


def write_table(motion: EditedMotion, out: BinaryIO) -> None:
    """Write a motion as comma-separated values: names, order, units and decimals of its columns."""
    columns = _table_columns(motion)
    out.write(_header([column.name for column in columns]))
    decimals = [0 if column.quantity == "move" else column.decimals for column in columns]
    for block in _blocks(motion, columns):
        out.write(_encoded(block, decimals))


def _header(names: Iterable[str]) -> bytes:
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerow(names)
    return text.getvalue().encode()


def _encoded(block: Array, decimals: list[int | None]) -> bytes:
    """Return lines of numbers with the decimals of each column; None for all digits."""
    decimals = [count if (count or 0) <= _HELD else None for count in decimals]
    whole = [index for index, count in enumerate(decimals) if count == 0]
    if all(count in (0, DECIMALS) for count in decimals):
        return encoder_of("fixed")(block, whole)
    if all(count in (0, None) for count in decimals):
        return encoder_of("full")(block, whole)
    cells = block.copy()
    for index, count in enumerate(decimals):
        cells[:, index] = rounded(cells[:, index], count)
    line = ",".join("%r" if count is None else f"%.{count}f" for count in decimals) + "\n"
    return "".join(line % tuple(row) for row in cells.tolist()).encode()


def plain_columns(motion: EditedMotion) -> tuple[WrittenColumn, ...]:
    """Return the columns of trajcli's own language, in SI; decimals are kept, or those of a plan."""
    given = {
        (column.quantity, column.joint): column.decimals
        for column in motion.columns
        if column.factor == 1.0 or (column.decimals or 0) > DECIMALS
    }

    def column(name: str, quantity: str, joint: int | None) -> WrittenColumn:
        decimals = given.get((quantity, joint))
        return WrittenColumn(name, quantity, joint, 1.0, DECIMALS if decimals is None else decimals)

    joints = range(motion.rows.q.shape[1])
    found = [column("t", "t", None)]
    found += [column(f"{name}{joint + 1}", name, joint) for name in motion.quantities for joint in joints]
    return (*found, column("move", "move", None)) if motion.writes_moves else tuple(found)


def _blocks(motion: EditedMotion, columns: tuple[WrittenColumn, ...]) -> Iterator[Array]:
    """Yield blocks of rows in the units of the columns."""
    for low in range(0, motion.rows.t.size, ROWS):
        part = slice(low, low + ROWS)
        yield np.stack([_cells(motion, column, part) for column in columns], axis=1)


def _cells(motion: EditedMotion, column: WrittenColumn, part: slice) -> Array:
    if column.quantity == "move" and motion.rows.move is not None:
        return motion.rows.move[part].astype(np.float64)
    if column.joint is None:
        return motion.rows.t[part] / column.factor
    values: Array = motion.quantities[column.quantity][part, column.joint] / column.factor
    return values


def _si_columns(motion: EditedMotion, form: StreamFormat) -> tuple[Column, ...]:
    """Return the columns of a format in SI: those there are."""
    count = motion.rows.q.shape[1]
    names = [name for name in ORDERS if name in motion.quantities]
    found = [Column("t", quantity=Quantity("time"))]
    for name in names:
        angle = Quantity("angle", JOINT_ORDERS[name])
        found += [Column(name, joint, None, angle) for joint in range(count)]
    if EFFORT in motion.quantities:
        found += [Column(EFFORT, joint, None, Quantity("torque")) for joint in range(count)]
    if motion.writes_moves and form.content == "rows":
        found.append(Column("move", quantity=Quantity("ratio")))
    return tuple(found)


def _si_rows(motion: EditedMotion, columns: tuple[Column, ...]) -> Iterator[Array]:
    rows = motion.rows
    for low in range(0, rows.t.size, ROWS):
        part = slice(low, low + ROWS)
        cells = [rows.t[part, None]]
        for name in dict.fromkeys(column.kind for column in columns):
            if name in JOINT_GROUPS:
                cells.append(motion.quantities[name][part])
            elif name == "move" and rows.move is not None:
                cells.append(rows.move[part, None].astype(np.float64))
        yield np.concatenate(cells, axis=1)


def _options(motion: EditedMotion, form: StreamFormat) -> tuple[WriteOptions, tuple[str, ...]]:
    """Return what a format needs beside rows, and what it leaves out."""
    if form.content == "rows":
        return WriteOptions(), _note_of_names(motion)
    log, given = form.content == "log", motion.quantities
    stated = next((order for order, name in enumerate(ORDERS[:3]) if name not in given), 3)
    held = (*ORDERS[:3], EFFORT) if log else ORDERS[:stated]
    notes = [
        f"the columns {name} are left out: the format is written without them"
        for name in given
        if name not in held
    ]
    notes += ["the column move is left out: the format is written without it"] * motion.writes_moves
    knots = _knots(motion)
    if form.content == "knots":
        return WriteOptions(goal=lambda: Goal(motion.joint_names, knots, stated)), tuple(notes)
    recording = _recording(motion, knots)
    return WriteOptions(recording=lambda: recording), tuple(notes)


def _note_of_names(motion: EditedMotion) -> tuple[str, ...]:
    """Return that rows number the joints which a message names; nothing of other files."""
    named = motion.format in ("ros", "mcap", "jsonl") and motion.rows.joints
    return (f"columns number the joints: {', '.join(named)}",) if named else ()


def _knots(motion: EditedMotion) -> Knots:
    """Return the rows as knots: states at whole nanoseconds from the first one on."""
    rows = motion.rows
    nanoseconds = np.rint((rows.t - rows.t[0]) * _PER_SECOND).astype(np.int64)
    if (np.diff(nanoseconds) <= 0).any():
        raise InputError(f"{rows.source} has rows in one nanosecond, which times of ROS cannot tell apart")
    states = [motion.quantities.get(name, np.empty((rows.t.size, 0))) for name in ORDERS[:3]]
    return Knots(nanoseconds, states[0], states[1], states[2], Deviation(0.0, 0.0, (0, 0)))


def _recording(motion: EditedMotion, knots: Knots) -> Recording:
    t = motion.rows.t
    if t[0] < 0 or t[-1] > _LATEST:
        extent = f"{motion.rows.source} goes from {time_text(t[0])} s to {time_text(t[-1])} s"
        raise InputError(f"a log has times from 0 to {_LATEST} s, and {extent}")
    metadata = {
        "version": __version__,
        "source": motion.rows.source,
        "epoch": "0",
        "units": "SI: rad or m by joint, s; epoch in ns",
    }
    return Recording(
        joint_names=motion.joint_names,
        origin=round(float(t[0]) * _PER_SECOND),
        epoch=0,
        duration=round(float(t[-1] - t[0]) * _PER_SECOND),
        knots=knots,
        frames=None,
        path=None,
        attachments=(),
        metadata=metadata,
    )
