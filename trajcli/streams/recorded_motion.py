"""Recorded motion: rows of joint values from a file of anybody, in SI, with the rounding of its numbers."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from trajcli.columns import Column, parse_column
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import frozen
from trajcli.kinematics.robot import JointType
from trajcli.streams.reading import read_table
from trajcli.streams.table import Table
from trajcli.units import Units

BLOCK_ROWS = 65536
"""Rows of a block, unless another number is asked for."""


@frozen
class Resolution:
    """The largest errors by which the numbers of a file may have been rounded, as they are written.

    Attributes:
        time: Of the time stamps, s: half a unit of their last decimal; 0 where they are binary.
        q: Likewise of the positions, by joint, rad or m, shape (n,).
        qd: Of the velocities, shape (n,); zeros where there are none.
        qdd: Of the accelerations, shape (n,).
        relative: Of all values, as a share of each: 2^-24 where they were single precision, otherwise 0.
        relative_time: Of the time stamps, likewise.
    """

    time: float
    q: Array
    qd: Array
    qdd: Array
    relative: float = 0.0
    relative_time: float = 0.0


@frozen
class RecordedMotion:
    """Some rows of a recorded motion, or all of them, in SI.

    Attributes:
        t: Time stamps as written, s, shape (N,).
        q: Positions, rad or m, shape (N, n).
        qd: Velocities, shape (N, n); None where the file has none, as the following.
        qdd: Accelerations, shape (N, n).
        qddd: Jerks, shape (N, n).
        tau: Efforts, N m or N, shape (N, n).
        move: Index of the move of each row, shape (N,).
        joints: n names; None where the file says none.
        resolution: Of the whole file.
        source: Name of the file, for messages.
        first_row: Number of the first of these rows, from 1, a line of names not counted.
    """

    t: Array
    q: Array
    qd: Array | None
    qdd: Array | None
    qddd: Array | None
    tau: Array | None
    move: NDArray[np.int64] | None
    joints: tuple[str, ...] | None
    resolution: Resolution
    source: str
    first_row: int = 1


class MotionFile:
    """A file with a motion, whose rows are taken block by block.

    Attributes:
        source: Its name, for messages.
        format: "csv", "jsonl", "ros", "mcap" or "npy".
        joints: n names; None where the file says none.
        quantities: Of q, qd, qdd, qddd, tau and move those that it has.
        resolution: How far its numbers may be rounded.
        rows: How many there are.
        notes: Sentences about what was taken for what, and what was left out.
    """

    def __init__(self, table: Table, kind: str, joints: tuple[str, ...] | None) -> None:
        self._table = table
        self.source, self.format, self.joints = table.file, kind, joints
        columns = [parse_column(name) for name in table.names]
        self._indices = {
            quantity: _in_order(columns, quantity) for quantity in ("q", "qd", "qdd", "qddd", "tau")
        }
        self._factors = np.array([column.factor for column in columns])
        self.quantities = tuple(name for name, found in self._indices.items() if found)
        self.resolution = self._resolution()
        self.rows = len(table.columns)
        self.notes: tuple[str, ...] = ()

    def blocks(self, rows: int = BLOCK_ROWS) -> Iterator[RecordedMotion]:
        """Yield all rows, at most `rows` at a time; as often as it is asked for."""
        for low in range(0, self.rows, rows):
            yield self._motion(slice(low, low + rows))

    def whole(self) -> RecordedMotion:
        """Return all rows at once."""
        return self._motion(slice(None))

    def _motion(self, rows: slice) -> RecordedMotion:
        values = {
            name: self._table.columns[rows, found] * self._factors[found] if found else None
            for name, found in self._indices.items()
        }
        time = self._table.column("t")[rows]
        moves = self._table.column("move")[rows].astype(np.int64) if "move" in self._table.names else None
        return RecordedMotion(
            time,
            np.asarray(values["q"]),
            values["qd"],
            values["qdd"],
            values["qddd"],
            values["tau"],
            moves,
            self.joints,
            self.resolution,
            self.source,
            (rows.start or 0) + 1,
        )

    def _resolution(self) -> Resolution:
        half = 0.5 * 10.0 ** -self._table.decimals.astype(np.float64) * self._factors
        count = len(self._indices["q"])
        q, qd, qdd = (half[found] if found else np.zeros(count) for found in map(self._indices.get, _ORDERS))
        return Resolution(float(half[self._table.names.index("t")]), q, qd, qdd)


_ORDERS = ("q", "qd", "qdd")


def open_motion(
    source: str | Path,
    *,
    columns: str | None = None,
    units: str | Units | None = None,
    topic: str | None = None,
    field: str | None = None,
    joints: Sequence[str] | None = None,
    joint_types: Sequence[JointType] | None = None,
    declared: Units | None = None,
) -> MotionFile:
    """Open a file with a motion; "-" is standard input.

    Args:
        source: Its path.
        columns: What the columns are, such as "t=timestamp,q=target_q": names or what they begin with.
        units: Units of numbers whose columns name none, such as "deg,mm".
        topic: Of MCAP, the topic that is read.
        field: Of messages with several states, the one that is read, such as "reference".
        joints: Names of the joints that are expected, in the order wanted.
        joint_types: "revolute" or "prismatic" for each of them.
        declared: Units that a job or a robot says; they count where neither the names nor `units` say any.

    Raises:
        FileError: When it cannot be read.
        InputError: When it is not such a file, with the place of what is wrong.
    """
    table = read_table(source, topic)
    named = [parse_column(name) for name in table.names]
    count = len(_in_order(named, "q"))
    if "t" not in table.names or not count:
        raise InputError(f"{table.file} has no columns t and q1, q2, ...")
    if joints is not None and len(joints) != count:
        raise InputError(f"{table.file} has {count} joints, expected {len(joints)}")
    return MotionFile(table, "csv", None if joints is None else tuple(joints))


def _in_order(columns: Sequence[Column], kind: str) -> list[int]:
    """Return the indices of the columns of one quantity, by joint."""
    found = [(column.joint, index) for index, column in enumerate(columns) if column.kind == kind]
    return [index for joint, index in sorted(found, key=lambda pair: pair[0] or 0) if joint is not None]
