"""Recorded motion in memory with the columns of its file, so that what is made of it is written alike."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import InputError
from trajcli.findings import time_text
from trajcli.frozen import frozen
from trajcli.judge.reconstruction import reconstruct
from trajcli.kinematics.robot import JointType
from trajcli.streams.decimals import DECIMALS
from trajcli.streams.recorded_motion import (
    MotionFile,
    RecordedMotion,
    Resolution,
    WrittenColumn,
    open_motion,
)
from trajcli.units import Units

ORDERS = ("q", "qd", "qdd", "qddd")
"""Quantities of joints by the order of their derivative."""

_ROUNDED = 12  # decimals; where there are more, scaling costs more digits than rounding gives
_SAME_TIME = 1e-12  # s: stamps that decimals say exactly


@frozen
class ReadingOptions:
    """How a file is read; see `trajcli check --help`."""

    columns: str | None = None
    units: str | None = None
    topic: str | None = None
    field: str | None = None


@frozen
class EditedMotion:
    """All rows of a motion in SI, and how its file wrote them.

    Attributes:
        rows: Its motion.
        columns: In the order of the file.
        format: "csv", "jsonl", "ros", "mcap", "npy" or "fields", as of `RowSource`.
        notes: What was taken for what, and what was left out.
    """

    rows: RecordedMotion
    columns: tuple[WrittenColumn, ...]
    format: str
    notes: tuple[str, ...]

    @property
    def quantities(self) -> Mapping[str, Array]:
        """Rows (N, n) of each quantity of joints that there is, SI."""
        found = {name: getattr(self.rows, name) for name in (*ORDERS, "tau")}
        return {name: values for name, values in found.items() if values is not None}

    @property
    def writes_moves(self) -> bool:
        """Whether the file names the moves of its rows; a job may, where it does not."""
        return any(column.quantity == "move" for column in self.columns)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints: of the file, or j1, j2, ..."""
        return self.rows.joints or tuple(f"j{number}" for number in range(1, self.rows.q.shape[1] + 1))

    def curve(self) -> PiecewisePolynomial:
        """Return the curve q(t) through the rows."""
        return reconstruct(self.rows)

    def with_rows(
        self,
        t: Array,
        quantities: Mapping[str, Array],
        move: NDArray[np.int64] | None,
        *notes: str,
        decimals: int | None = None,
    ) -> EditedMotion:
        """Return a motion of other rows in the same columns; a quantity that is absent loses its columns.

        Args:
            t: Stamps, s, shape (N,).
            quantities: By name, each of shape (N, n).
            move: Index of the move of each row; None without one.
            *notes: What a reader should know besides.
            decimals: Of the stamps, at least; as many as the file has unless given.
        """
        values: dict[str, Any] = {name: quantities.get(name) for name in (*ORDERS, "tau")}
        rows = replace(self.rows, t=t, move=move, first_row=1, **values)
        present = {"t", *quantities, *(() if move is None else ("move",))}
        columns = tuple(column for column in self.columns if column.quantity in present)
        if decimals is not None:
            columns = tuple(_with_decimals(column, decimals) for column in columns)
        return EditedMotion(rows, columns, self.format, (*self.notes, *notes))

    def with_planned_decimals(self, quantities: Sequence[str]) -> EditedMotion:
        """Return the motion with some quantities of joints written with at least the decimals of a plan."""
        columns = tuple(
            replace(column, decimals=max(column.decimals, DECIMALS))
            if column.quantity in quantities and column.decimals is not None
            else column
            for column in self.columns
        )
        return replace(self, columns=columns)

    def as_written(self) -> EditedMotion:
        """Return the motion that a reader of its file finds: rounded to the decimals of its columns.

        A column without decimals is exact.
        """
        t = self.rows.t
        values: dict[str, Any] = {name: rows.copy() for name, rows in self.quantities.items()}
        resolution = self.rows.resolution
        rounding = {name: np.array(getattr(resolution, name)) for name in ("q", "qd", "qdd")}
        time = resolution.time
        for column in self.columns:
            if column.quantity == "move":
                continue
            half = 0.0 if column.decimals is None else 0.5 * 10.0**-column.decimals * column.factor
            half *= half != 0.5  # as readers have it: nobody rounds to whole radians, metres or seconds
            if column.joint is None:
                t, time = rounded(t / column.factor, column.decimals) * column.factor, half
                continue
            of_joint = values[column.quantity][:, column.joint]
            of_joint[:] = rounded(of_joint / column.factor, column.decimals) * column.factor
            if column.quantity in rounding:
                rounding[column.quantity][column.joint] = half
        exact = Resolution(time, rounding["q"], rounding["qd"], rounding["qdd"])
        return replace(self, rows=replace(self.rows, t=t, resolution=exact, **values))


def rounded(values: Array, decimals: int | None) -> Array:
    """Return values with that many decimals, all of them for None, without a negative zero."""
    return (np.round(values, decimals) if decimals is not None and decimals <= _ROUNDED else values) + 0.0


def _with_decimals(column: WrittenColumn, decimals: int) -> WrittenColumn:
    if column.quantity != "t" or column.decimals is None:
        return column
    # stamps in ms need three decimals fewer for the same instant
    needed = max(decimals + round(np.log10(column.factor)), 0)
    return replace(column, decimals=max(column.decimals, needed))


def decimals_for(motion: EditedMotion, t: Array) -> int | None:
    """Return how many decimals of a second new stamps need; None where those of the file say them."""
    column = next(column for column in motion.columns if column.quantity == "t")
    if column.decimals is None:
        return None
    said = rounded(t / column.factor, column.decimals) * column.factor
    return None if bool((np.abs(said - t) <= _SAME_TIME + np.spacing(np.abs(t))).all()) else DECIMALS


def read_motion(
    source: str,
    options: ReadingOptions,
    *,
    joints: tuple[str, ...] | None = None,
    joint_types: tuple[JointType, ...] | None = None,
    declared: Units | None = None,
) -> EditedMotion:
    """Return the motion of a file.

    Args:
        source: Its path; "-" is standard input.
        options: How it is read.
        joints: Names that are expected, in their order; None for those of the file.
        joint_types: Of these.
        declared: Units where nothing else says any; None refuses columns without a unit.

    Raises:
        InputError: When it is no motion of two rows at least, or its stamps do not increase.
        FileError: When it cannot be read.
    """
    file = open_motion(
        source,
        columns=options.columns,
        units=options.units,
        topic=options.topic,
        field=options.field,
        joints=joints,
        joint_types=joint_types,
        declared=declared,
    )
    return _whole(file)


def _whole(file: MotionFile) -> EditedMotion:
    rows = file.whole()
    if len(rows.t) < 2:
        raise InputError(f"{file.source} has {len(rows.t)} row, a motion has two at least")
    late = np.flatnonzero(np.diff(rows.t) <= 0)
    if late.size:
        row, before, after = int(late[0]) + 2, *map(time_text, rows.t[late[0] : late[0] + 2])
        raise InputError(
            f"{file.source}: the time stamp of row {row} is {after} s, that before it {before} s",
            hint="stamps must increase; `trajcli check` lists all that is wrong with the stamps",
        )
    lost = (f"columns that are left out: {', '.join(file.unread)}",) if file.unread else ()
    return EditedMotion(rows, file.written_columns(), file.format, (*lost, *file.notes))
