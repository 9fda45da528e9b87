"""Rows as files write them, before anybody knows their units: text, JSON lines, messages, arrays."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, Place
from trajcli.frozen import frozen
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.decimals import DECIMALS
from trajcli.streams.mcap.read import LoggedMotion, log_blocks
from trajcli.streams.recorded.column_names import TIME, read_name
from trajcli.streams.recorded.column_roles import NamedFile
from trajcli.streams.table import rows_of
from trajcli.streams.text_layout import layout_of, read_header
from trajcli.streams.text_rows import RowReader

EXACT = -1
"""Decimals of a column whose numbers were not rounded to decimals."""

FULL_DECIMALS = 13
"""Decimals from which on a writer shows all digits of a float64, and rounds nothing."""

_QUANTITIES = ("q", "qd", "qdd", "tau")  # of messages


class ColumnExtents:
    """The largest magnitudes of some columns, and which of them show one number alone.

    Attributes:
        largest: Shape (m,).
    """

    def __init__(self, width: int) -> None:
        self.largest = np.zeros(width)
        self._low, self._high = np.full(width, np.inf), np.full(width, -np.inf)

    def add(self, block: Array) -> None:
        """Take more rows, (N, m)."""
        low, high = block.min(axis=0), block.max(axis=0)
        np.maximum(self.largest, np.maximum(high, -low), out=self.largest)
        np.minimum(self._low, low, out=self._low)
        np.maximum(self._high, high, out=self._high)

    def span(self, column: int) -> float:
        """Return how far the numbers of a column are apart."""
        return float(self._high[column] - self._low[column])

    @property
    def still(self) -> NDArray[np.bool_]:
        """Whether each column shows the same number in all rows, shape (m,)."""
        return np.asarray(self._low == self._high)


def decimals_of_still(
    decimals: NDArray[np.int64], still: NDArray[np.bool_], alike: Sequence[object]
) -> NDArray[np.int64]:
    """Return the decimals of columns (m,); those that show one number alone have the most of their kind.

    Who writes the shortest digits writes 0.25 for 0.250000: a joint that stands says nothing of its decimals.
    It has nine at most, unless it shows more: a slide that was planned in mm has twelve in m.

    Args:
        decimals: That each shows.
        still: Which of them show one number alone.
        alike: Of each what it is: columns of one quantity and one unit are alike.
    """
    found = decimals.copy()
    for kind in set(alike):
        among = np.array([other == kind for other in alike])
        chosen, largest = among & still & (decimals != EXACT), int(decimals[among].max())
        found[chosen] = np.maximum(
            decimals[chosen], min(largest, DECIMALS) if largest < FULL_DECIMALS else largest
        )
    return found


class RowSource(ABC):
    """Rows of a file whose columns have names.

    Attributes:
        format: Of the file: "csv", "jsonl", "ros", "mcap", "npy", or "fields" of arrays with names.
        named: Names of the columns, and where they stand.
        joint_names: n names; None where the file says none beside its columns.
        si: Whether the format fixes the units: rad, m and s.
        relative: Rounding of each column as a share of its values, shape (m,).
        notes: Sentences about what was taken and what was left out.
    """

    format: str
    named: NamedFile
    joint_names: tuple[str, ...] | None = None
    si: bool = False
    relative: Array
    notes: tuple[str, ...] = ()

    @abstractmethod
    def blocks(self, taken: Sequence[int], fixed: Sequence[int]) -> Iterator[Array]:
        """Yield the rows of some columns, rising indices, block by block, (N, columns); as often as asked.

        The columns `fixed` hold texts that must be the same in all rows.
        """

    @abstractmethod
    def decimals(self, taken: Sequence[int]) -> NDArray[np.int64]:
        """Return the decimals of some columns, shape (columns,), once all their rows were taken."""


class TextRows(RowSource):
    """Rows of a table in text, which are read anew whenever they are asked for."""

    format = "csv"

    def __init__(self, source: ByteSource) -> None:
        """Read the names, and the texts of the first row.

        Raises:
            FileError: When the file cannot be read.
            InputError: When it is no table of numbers.
        """
        self._source = source
        with source.open() as stream:
            self._header, text = read_header(stream, source.file)
            while not text.strip() and (text := stream.readline()):
                pass
        line = text.replace(b"\r\n", b"\n").rstrip(b"\n")
        layout = layout_of(self._header.names, self._header.text, line)
        cells = [cell for _, cell in layout.cells(line.decode("utf-8", "replace"))]
        first = tuple(cells) if len(cells) == len(self._header.names) else ()
        self.named = NamedFile(source.file, self._header.names, self._header.place, first)
        self.relative = np.zeros(len(self._header.names))
        self._reader: RowReader | None = None

    def blocks(self, taken: Sequence[int], fixed: Sequence[int]) -> Iterator[Array]:
        """Yield the rows of some columns."""
        with self._source.open() as stream:
            header, text = read_header(stream, self._source.file)
            self._reader = RowReader(header, taken, fixed)
            yield from rows_of(stream, text, header, self._reader)

    def decimals(self, taken: Sequence[int]) -> NDArray[np.int64]:
        """Return the decimals that the columns show."""
        return np.zeros(len(taken), np.int64) if self._reader is None else self._reader.decimals


@frozen
class ArrayRows(RowSource):
    """Rows that are in memory; its attributes are those of `RowSource`.

    Attributes:
        columns: Shape (N, m); any numbers.
        written: Decimals of each column, shape (m,), or `EXACT`.
    """

    format: str
    named: NamedFile
    columns: NDArray[np.float64]
    written: NDArray[np.int64]
    relative: Array
    joint_names: tuple[str, ...] | None = None
    si: bool = False
    notes: tuple[str, ...] = ()

    def blocks(self, taken: Sequence[int], fixed: Sequence[int]) -> Iterator[Array]:
        """Yield the rows of some columns."""
        del fixed  # numbers only
        yield self.columns[:, list(taken)]

    def decimals(self, taken: Sequence[int]) -> NDArray[np.int64]:
        """Return the decimals of the columns."""
        return self.written[list(taken)]


class TimedRows(RowSource):
    """Rows of a file without time, at a rate: a column `t` stands in front of the others."""

    def __init__(self, rows: RowSource, rate: float) -> None:
        """Take the rows of a file.

        Args:
            rows: Of the file.
            rate: Rows per second.

        Raises:
            InputError: When they have a time.
        """
        named = rows.named
        stamps = next((name for name in named.names if read_name(name).quantity == TIME), None)
        if stamps is not None:
            raise named.wrong(
                f"--rate is about rows without time, and {stamps} is one", "leave --rate out", stamps
            )
        self._rows, self._rate = rows, rate
        self.format, self.joint_names, self.si = rows.format, rows.joint_names, rows.si
        first = ("", *named.first) if named.first else ()
        self.named = NamedFile(
            named.file,
            ("t", *named.names),
            lambda name: named.place(None if name == "t" else name),
            first,
        )
        self.relative = np.concatenate([[0.0], rows.relative])
        self.notes = (*rows.notes, f"rows stand {1 / rate:.9g} s apart, as --rate says")

    def blocks(self, taken: Sequence[int], fixed: Sequence[int]) -> Iterator[Array]:
        """Yield the rows of some columns."""
        others, done = [k - 1 for k in taken if k > 0], 0
        for block in self._rows.blocks(others, [k - 1 for k in fixed]):
            if len(others) == len(taken):
                yield block
            else:
                yield np.hstack([((done + np.arange(len(block))) / self._rate)[:, None], block])
            done += len(block)

    def decimals(self, taken: Sequence[int]) -> NDArray[np.int64]:
        """Return the decimals of some columns; times are exact."""
        others = self._rows.decimals([k - 1 for k in taken if k > 0])
        return others if len(others) == len(taken) else np.concatenate([[EXACT], others])


def unplaced(name: str | None = None) -> Place | None:
    """Return the place of a name in a file without a line of names: none."""
    del name
    return None


def in_columns(file: str, times: Array, states: Sequence[Array]) -> tuple[NamedFile, Array]:
    """Return a motion under the names of a CSV file in SI, and its rows (N, m).

    Args:
        file: Name of the file.
        times: Shape (N,).
        states: Positions, velocities, accelerations and efforts, each (N, n), or (N, 0) where there are none.
    """
    names, parts = ["t"], [times[:, None]]
    for kind, values in zip(_QUANTITIES, states, strict=True):
        names += [f"{kind}{joint + 1}" for joint in range(values.shape[1])]
        parts.append(values)
    return NamedFile(file, tuple(names), unplaced), np.concatenate(parts, axis=1)


_NANOSECONDS = 9  # decimals of a stamp in whole nanoseconds


class LoggedRows(RowSource):
    """Rows of a topic, which are read anew whenever they are asked for."""

    format = "mcap"
    si = True

    def __init__(self, source: ByteSource, topic: str | None, field: str | None) -> None:
        """Read the first messages.

        Raises:
            FileError: When the file cannot be read.
            InputError: When it is no MCAP, or has no such topic or field.
        """
        self._source, self._topic, self._field = source, topic, field
        with source.open() as stream:
            first = next(log_blocks(stream, source.file, topic, field))
        self.joint_names = first.joint_names
        found = _no_number(first, 0)
        if found is not None:
            self.notes = (f"efforts are left out: {found}",)
        self._efforts = 0 if found is not None else first.effort.shape[1]
        self.named, _ = in_columns(source.file, first.times, self._states(first))
        self.relative = np.zeros(len(self.named.names))

    def blocks(self, taken: Sequence[int], fixed: Sequence[int]) -> Iterator[Array]:
        """Yield the rows of some columns."""
        del fixed  # numbers only
        efforts, before = len(self.named.names) - self._efforts, 0
        with self._source.open() as stream:
            for block in log_blocks(stream, self._source.file, self._topic, self._field):
                found = _no_number(block, before) if max(taken, default=0) >= efforts else None
                if found is not None:
                    hint = "`--columns tau=none` of `check` and `convert` leaves efforts out"
                    raise InputError(f"{self._source.file}: {found}", hint=hint)
                before += block.times.size
                yield in_columns(self._source.file, block.times, self._states(block))[1][:, list(taken)]

    def _states(self, motion: LoggedMotion) -> tuple[Array, Array, Array, Array]:
        efforts = motion.effort[:, : self._efforts]
        return motion.position, motion.velocity, motion.acceleration, efforts

    def decimals(self, taken: Sequence[int]) -> NDArray[np.int64]:
        """Return that stamps are whole nanoseconds, and nothing else is rounded."""
        return np.array([EXACT if index else _NANOSECONDS for index in taken], dtype=np.int64)


def _no_number(motion: LoggedMotion, before: int) -> str | None:
    """Return which effort of some messages is none, where others stand before them; None where all are."""
    for row, joint in np.argwhere(~np.isfinite(motion.effort))[:1].tolist():
        name, value = motion.joint_names[joint], motion.effort[row, joint]
        return f"the effort of {name} in message {before + row} of {motion.topic} is {value}"
    return None
