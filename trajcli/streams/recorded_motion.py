"""Recorded motion: rows of joint values from a file of anybody, in SI, with the rounding of its numbers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.robot import JointType
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.reading import open_rows_of
from trajcli.streams.recorded.column_names import MOVE, read_name
from trajcli.streams.recorded.column_roles import ColumnRoles, assign_roles, ordered_joints
from trajcli.streams.recorded.column_units import (
    ColumnScales,
    is_own_language,
    no_seconds,
    no_unit,
    parse_units,
    scales_of,
)
from trajcli.streams.row_sources import EXACT, FULL_DECIMALS, ColumnExtents, RowSource, decimals_of_still
from trajcli.units import Units

Names = tuple[str, ...] | None
_STATES = ("q", "qd", "qdd")
_LARGEST = 1e100  # of a number in a file, in whatever unit
_LAST_MOVE = 2.0**53  # a whole number from there on is none that a float64 tells from the next
_NO_SECONDS = 1000.0  # between rows: so far apart stand those of no arm
_KEPT = 1 << 23  # numbers that are kept in memory; of a longer file rows are read anew

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
        relative: Of q, qd and qdd as a share of each value: 2^-24 where they were single precision.
        relative_time: Of the time stamps, likewise.
    """

    time: float
    q: Array
    qd: Array
    qdd: Array
    relative: tuple[float, ...] = (0.0, 0.0, 0.0)
    relative_time: float = 0.0

    @property
    def roundings(self) -> list[tuple[Array, float]]:
        """Of positions, velocities and accelerations, in units and as a share."""
        return list(zip((self.q, self.qd, self.qdd), self.relative, strict=True))


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
        message_joints: Names of all joints of a ROS message, also of those that are left out; None elsewhere.
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
    message_joints: tuple[str, ...] | None = None


@comparable
class WrittenColumn:
    """A column as a file writes it.

    Attributes:
        name: Its name in the file.
        quantity: "t", "q", "qd", "qdd", "qddd", "tau" or "move".
        joint: Index of the joint; None for times and moves.
        factor: SI per unit of the column.
        decimals: The most that a number of it has; None where they are binary.
    """

    name: str
    quantity: str
    joint: int | None
    factor: float
    decimals: int | None


class MotionFile:
    """A file with a motion, whose rows are taken block by block.

    Attributes:
        source: Its name, for messages.
        format: "csv", "jsonl", "ros", "mcap", "npy" or "fields", as of `RowSource`.
        joints: n names; None where the file says none.
        quantities: Of q, qd, qdd, qddd, tau and move those that it has.
        resolution: How far its numbers may be rounded.
        rows: How many there are.
        unread: Names of the columns that are not used.
        notes: Sentences about what was taken for what.
    """

    def __init__(
        self, rows: RowSource, roles: ColumnRoles, scales: ColumnScales, order: Sequence[int], names: Names
    ) -> None:
        """Read all rows once, for what only all of them say.

        Args:
            rows: The file.
            roles: What its columns are.
            scales: How their numbers become SI.
            order: Which of its joints are wanted, in their order.
            names: Of these; None where nobody names them.

        Raises:
            InputError: When a row is none, or nothing says the unit of a column.
        """
        self._rows, self._fixed = rows, roles.fixed
        self._taken = roles.taken
        at = {index: position for position, index in enumerate(self._taken)}
        self._time, self._move = at[roles.time], None if roles.move is None else at[roles.move]
        self._joints = {key: [at[found[joint]] for joint in order] for key, found in roles.joints.items()}
        self._factors = scales.factors[list(self._taken)]
        self._per_second = scales.per_second
        self._bounds = np.full(len(self._taken), _LARGEST)
        self._bounds[[] if self._move is None else self._move] = _LAST_MOVE
        self.source, self.format, self.joints = rows.named.file, rows.format, names
        self.quantities = (*roles.joints, *((MOVE,) if self._move is not None else ()))
        self.unread = roles.unread
        self._message_joints = rows.joint_names if rows.format == "ros" else None
        self.notes = (*rows.notes, *scales.notes)
        self._kept: list[Array] | None = []
        self._read_all(scales)

    def _read_all(self, scales: ColumnScales) -> None:
        """Read all rows once, and keep them where they are few."""
        self.rows = kept = 0
        everywhere = ColumnExtents(len(self._taken))
        for block in self._rows.blocks(self._taken, self._fixed):
            if scales.open:
                self._refuse_open(scales.open, block)
            everywhere.add(block)
            wrong = np.abs(block) > self._bounds
            if self._move is not None:
                wrong[:, self._move] |= block[:, self._move] % 1 > 0
            if wrong.any():
                self._refuse(block, *np.argwhere(wrong)[0].tolist())
            self.rows += len(block)
            kept += block.size
            if self._kept is not None:
                self._kept.append(block)
                self._kept = self._kept if kept <= _KEPT else None
        self.resolution = self._resolution(everywhere)
        apart = everywhere.span(self._time) / max(self.rows - 1, 1)
        if scales.open_time and apart >= _NO_SECONDS:
            raise no_seconds(self._rows.named, self._rows.named.names[self._taken[self._time]], apart)

    def _refuse(self, block: Array, row: int, column: int) -> NoReturn:
        """Refuse a number that no motion has: one that overflows wherever it is used, or a part of a move."""
        name = self._rows.named.names[self._taken[column]]
        message = f"{name} is {block[row, column]:.6g} in row {self.rows + row + 1}"
        hint = (
            "moves are counted: say `--columns move=none`" if column == self._move else "check its exponent"
        )
        raise self._rows.named.wrong(message, hint, name)

    def _refuse_open(self, columns: Sequence[int], block: Array) -> NoReturn:
        """Refuse columns whose unit nothing says; the first rows give a hint."""
        at = [position for position, index in enumerate(self._taken) if index in columns]
        positions = [index for index in self._joints["q"] if index in at] or at
        names = [self._rows.named.names[self._taken[position]] for position in at]
        raise no_unit(self._rows.named, names, float(np.abs(block[:, positions]).max()))

    def blocks(self, rows: int = BLOCK_ROWS) -> Iterator[RecordedMotion]:
        """Yield all rows, at most `rows` at a time; as often as it is asked for."""
        first = 1
        for block in blocks_of_size(self._blocks(), rows):
            yield self._motion(block, first)
            first += len(block)

    def whole(self) -> RecordedMotion:
        """Return all rows at once."""
        return self._motion(np.concatenate(list(self._blocks())), 1)

    def written_columns(self) -> tuple[WrittenColumn, ...]:
        """Return the columns that are used, in the order of the file."""
        where: dict[int, tuple[str, int | None]] = {self._time: ("t", None)}
        if self._move is not None:
            where[self._move] = (MOVE, None)
        for quantity, found in self._joints.items():
            where |= {position: (quantity, joint) for joint, position in enumerate(found)}
        decimals = self._rows.decimals(self._taken).tolist()
        return tuple(
            WrittenColumn(
                self._rows.named.names[self._taken[position]],
                *where[position],
                1.0 / self._per_second if position == self._time else float(self._factors[position]),
                None if decimals[position] == EXACT else decimals[position],
            )
            for position in sorted(where)
        )

    def _blocks(self) -> Iterable[Array]:
        return self._kept if self._kept is not None else self._rows.blocks(self._taken, self._fixed)

    def _motion(self, block: Array, first: int) -> RecordedMotion:
        def values(quantity: str) -> Array | None:
            found = self._joints.get(quantity)
            return None if found is None else block[:, found] * self._factors[found]

        return RecordedMotion(
            block[:, self._time] / self._per_second,
            block[:, self._joints["q"]] * self._factors[self._joints["q"]],
            values("qd"),
            values("qdd"),
            values("qddd"),
            values("tau"),
            None if self._move is None else block[:, self._move].astype(np.int64),
            self.joints,
            self.resolution,
            self.source,
            first,
            self._message_joints,
        )

    def _resolution(self, everywhere: ColumnExtents) -> Resolution:
        """Return the rounding of the numbers, from their decimals."""
        decimals = self._rows.decimals(self._taken)
        quantities = {at: name for name, found in self._joints.items() for at in found}
        alike = [(quantities.get(at, at), factor) for at, factor in enumerate(self._factors.tolist())]
        written = decimals_of_still(decimals, everywhere.still, alike)
        decimals = np.where((decimals > 0) | (self._factors != 1.0), written, decimals)
        half = np.where(decimals == EXACT, 0.0, 0.5 * 10.0 ** -np.maximum(decimals, 0).astype(np.float64))
        # nobody rounds to whole radians, metres or seconds
        half[(decimals <= 0) & (self._factors == 1.0)] = 0.0
        half *= self._factors
        q, qd, qdd = (self._halves(half, decimals, everywhere, name) for name in _STATES)
        stamp = float(np.spacing(everywhere.largest[self._time]) / 2 / self._per_second)
        time = 0.0 if decimals[self._time] == EXACT else max(float(half[self._time]), stamp)
        relative = self._rows.relative[list(self._taken)]
        shares = tuple(float(relative[self._joints.get(name, [])].max(initial=0.0)) for name in _STATES)
        return Resolution(time, q, qd, qdd, shares, float(relative[self._time]))

    def _halves(
        self, half: Array, decimals: NDArray[np.int64], everywhere: ColumnExtents, quantity: str
    ) -> Array:
        """Return the rounding of a quantity by joint, (n,); zeros where there is none."""
        found = self._joints.get(quantity)
        if found is None:
            return np.zeros(len(self._joints["q"]))
        if decimals[found].max() >= FULL_DECIMALS:
            return np.zeros(len(found))
        values, written = half[found], decimals[found] > 0
        bare = ~written & (everywhere.largest[found] == 0.0)  # zeros without a point: as the others
        values[bare] = values[written].max(initial=0.0)
        return np.asarray(values)


def blocks_of_size(blocks: Iterable[Array], rows: int) -> Iterator[Array]:
    """Yield the same rows (N, m), `rows` at a time, and what is left."""
    held: list[Array] = []
    count = 0
    for block in blocks:
        held.append(block)
        count += len(block)
        if count >= rows:
            joined = np.concatenate(held) if len(held) > 1 else block
            for low in range(0, count - count % rows, rows):
                yield joined[low : low + rows]
            held, count = [joined[count - count % rows :]], count % rows
    if count:
        yield np.concatenate(held)


def open_motion(
    source: str | Path | ByteSource,
    *,
    columns: str | Mapping[str, str] | None = None,
    units: str | Units | None = None,
    topic: str | None = None,
    field: str | None = None,
    joints: Sequence[str] | None = None,
    joint_types: Sequence[JointType] | None = None,
    declared: Units | None = None,
) -> MotionFile:
    """Open a file with a motion; "-" is standard input.

    Units are by the names of the columns, else by `units`, else by the format (messages of ROS, MCAP and
    trajcli's own names are in SI), else by `declared`; they are never guessed.

    Args:
        source: Its path, or the file where it is open.
        columns: What the columns are, such as "t=timestamp,q=target_q": names or what they begin with.
        units: Units of numbers whose columns name none, such as "deg,mm".
        topic: Of MCAP, the topic that is read.
        field: Of messages with several states, the one that is read, such as "reference".
        joints: Names of the joints that are expected, in the order wanted.
        joint_types: "revolute" or "prismatic" for each of them.
        declared: Units that a job or a robot says; they count where nothing else says any.

    Raises:
        FileError: When it cannot be read.
        InputError: When it is not such a file, with the place of what is wrong.
    """
    rows = open_rows_of(source, topic=topic, field=field, joints=None if joints is None else len(joints))
    return motion_of(
        rows, columns=columns, units=units, joints=joints, joint_types=joint_types, declared=declared
    )


def motion_of(
    rows: RowSource,
    *,
    columns: str | Mapping[str, str] | None = None,
    units: str | Units | None = None,
    joints: Sequence[str] | None = None,
    joint_types: Sequence[JointType] | None = None,
    declared: Units | None = None,
) -> MotionFile:
    """Return the motion in rows that are open; as `open_motion`, which says what its arguments are.

    Raises:
        FileError: When they cannot be read.
        InputError: When they are no motion.
    """
    said = parse_units(units)
    own = rows.format != "npy" and is_own_language(rows.named.names)
    numbered = own and any(read_name(name).quantity == "q" for name in rows.named.names)
    roles = assign_roles(rows.named, columns, None if numbered else joints)
    names = rows.joint_names or roles.joint_names
    order, ordered, notes = ordered_joints(rows.named, roles, names, joints)
    scales = scales_of(
        rows.named,
        roles,
        said,
        plain=Units() if rows.si or own else None,
        joint_types=None if joint_types is None else _by_file(joint_types, order, len(roles.joints["q"])),
        declared=None if rows.si else declared,  # messages are in SI, whatever a job says
    )
    found = MotionFile(rows, roles, scales, order, ordered)
    found.notes += notes
    return found


def _by_file(types: Sequence[JointType], order: Sequence[int], count: int) -> list[JointType]:
    """Return the types of joints in the order of the file's columns."""
    found: list[JointType] = ["revolute"] * count
    for wanted, joint in zip(types, order, strict=False):
        found[joint] = wanted
    return found
