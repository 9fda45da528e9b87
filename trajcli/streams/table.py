"""Tables of numbers read from CSV files of any origin."""

from __future__ import annotations

import errno
import re
import sys
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager
from itertools import islice
from math import isfinite
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from trajcli.columns import parse_column, whole_number_columns
from trajcli.curves.piecewise import Array
from trajcli.errors import FileError, InputError, Place, Problem
from trajcli.frozen import frozen
from trajcli.streams.decimals import DECIMALS, NotFixedError, scan_fixed
from trajcli.streams.number_cells import decimals_of, scan_decimals

_CHUNK = 1 << 20  # bytes read at a time
_LONGEST_HEADER = 1 << 16  # bytes; what has no line feed by then is no CSV
_MOST_PROBLEMS = 10
_NUMBER = re.compile(rb"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]+)?")


@frozen
class Table:
    """The content of a CSV file.

    Attributes:
        names: The m columns' names.
        columns: Shape (N, m), N >= 1, in the units that the names say.
        decimals: Shape (m,): the most decimals that any value of a column shows; what the file rounds to.
        file: Its name, for messages.
    """

    names: tuple[str, ...]
    columns: Array
    decimals: NDArray[np.int64]
    file: str

    def __post_init__(self) -> None:
        for name in ("columns", "decimals"):
            view = getattr(self, name).view()  # no copy: this may be most of the memory in use
            view.flags.writeable = False
            object.__setattr__(self, name, view)

    def column(self, name: str) -> Array:
        """Return the values (N,) of the column called `name`."""
        return self.columns[:, self.names.index(name)]


def read_csv(source: str | Path) -> Table:
    """Read a CSV file: a line of names, perhaps behind a #, then lines of as many finite numbers.

    Lines may end in CR LF, the last one in nothing; empty lines are skipped.

    Args:
        source: Its path; "-" is standard input.

    Raises:
        FileError: When it cannot be read.
        InputError: When it is not such a file; with file, line and column of what is wrong.
    """
    file = "stdin" if str(source) == "-" else str(source)
    with _opened(source, file) as stream:
        names = _read_names(stream, file)
        reader = _Reader(file, names)
        blocks = [np.empty((0, len(names)))]
        for text in _chunks(stream):
            blocks.append(reader.read(text))
            if len(reader.problems) == _MOST_PROBLEMS:
                break
    if reader.problems:
        raise InputError(*reader.problems)
    columns = np.concatenate(blocks)
    if len(columns) == 0:
        raise InputError(_no_rows(file, names))
    return Table(names, columns, reader.decimals, file)


@frozen
class TableBlocks:
    """A CSV file that is read block by block, so that memory does not grow with its length.

    Attributes:
        names: The m columns' names.
        blocks: Each of shape (N, m), N >= 1, in the units that the names say; they can be taken once.
        file: Its name, for messages.
    """

    names: tuple[str, ...]
    blocks: Iterator[Array]
    file: str


def open_rows(source: str | Path) -> TableBlocks:
    """Open a CSV file as `read_csv` reads it; what is wrong with a row shows when its block is taken.

    Raises:
        FileError: When it cannot be read.
        InputError: When it is not such a file.
    """
    file = "stdin" if str(source) == "-" else str(source)
    with ExitStack() as stack:
        stream = stack.enter_context(_opened(source, file))
        names = _read_names(stream, file)
        return TableBlocks(names, _blocks(stack.pop_all(), stream, file, names), file)


def _blocks(opened: ExitStack, stream: BinaryIO, file: str, names: tuple[str, ...]) -> Iterator[Array]:
    reader, empty = _Reader(file, names), True
    with opened:
        for text in _chunks(stream):
            block = reader.read(text)
            if reader.problems:
                raise InputError(*reader.problems)
            if len(block):
                empty = False
                yield block
    if empty:
        raise InputError(_no_rows(file, names))


def _no_rows(file: str, names: Sequence[str]) -> Problem:
    place = Place(file, 1, 1, ",".join(names))
    return Problem("the file has no rows, only the columns' names", place=place)


@contextmanager
def _opened(source: str | Path, file: str) -> Iterator[BinaryIO]:
    try:
        if str(source) == "-":
            yield _standard_input()
        else:
            with Path(source).open("rb") as stream:
                yield stream
    except OSError as error:
        raise FileError(f"cannot read {file}: {error.strerror or error}") from error


def _standard_input() -> BinaryIO:
    if sys.stdin is None:
        raise OSError(errno.EBADF, "it is closed")
    return sys.stdin.buffer


def _read_names(stream: BinaryIO, file: str) -> tuple[str, ...]:
    line = stream.readline(_LONGEST_HEADER)
    try:
        header = line.decode("utf-8-sig").rstrip("\r\n")
    except UnicodeDecodeError:
        header = "\0"
    if not line:
        raise InputError(f"{file} is empty", hint="a CSV begins with a line of the columns' names")
    if "\0" in header or len(line) == _LONGEST_HEADER:
        raise InputError(f"{file} is not text", hint="a CSV begins with a line of the columns' names")
    listed = header.removeprefix("#")  # numpy.savetxt writes the names as a comment
    names = tuple(name.strip().removeprefix('"').removesuffix('"') for name in listed.split(","))
    flaw = _flaw_of_names(names)
    if flaw:
        index, message, hint = flaw
        column = len(",".join(header.split(",")[:index])) + (2 if index else 1)
        place = Place(file, 1, column, header, max(len(names[index]), 1))
        raise InputError(Problem(message, hint, place))
    return names


def _flaw_of_names(names: Sequence[str]) -> tuple[int, str, str | None] | None:
    """Return the index of the first wrong name, what is wrong, and what would fix it."""
    for index, name in enumerate(names):
        if not name:
            return index, f"column {index + 1} of {len(names)} has no name", None
        if _is_number(name.encode()):
            return (
                index,
                f"{name} stands where a column's name should be",
                "put a line of names on top: t,q1,q2",
            )
        if name in names[:index]:
            return index, f"there are two columns '{name}'", None
    if len(names) == 1 and re.search(r"[;\t ]", names[0]):
        return 0, f"there is one column '{names[0]}'", "columns are separated by commas"
    return None


def _chunks(stream: BinaryIO) -> Iterator[bytes]:
    """Yield chunks of whole lines, each ending in a line feed."""
    while text := stream.read(_CHUNK):
        text += stream.readline()
        if b"\r" in text:
            text = text.replace(b"\r\n", b"\n")
        yield text if text.endswith(b"\n") else text + b"\n"


class _Reader:
    """Parser of rows, which counts their decimals and collects problems.

    Attributes:
        decimals: The most decimals seen, by column.
        problems: What is wrong, the first few things.
    """

    def __init__(self, file: str, names: Sequence[str]) -> None:
        self.decimals = np.zeros(len(names), dtype=np.int64)
        self.problems: list[Problem] = []
        self._file = file
        self._names = names
        self._line = 2
        self._nine_decimals = True  # until they are not
        self._whole_numbers = whole_number_columns(map(parse_column, names))
        self._fixed_decimals = np.full(len(names), DECIMALS)
        self._fixed_decimals[list(self._whole_numbers)] = 0

    def read(self, text: bytes) -> Array:
        """Return the rows (N, m) of whole lines; none if something is wrong with them."""
        try:
            rows, decimals = self._read_blocks(text)
            self.decimals = np.maximum(self.decimals, decimals)
        except NotFixedError:
            rows = self._read_any(text)
        self._line += text.count(b"\n")
        return rows

    def _read_blocks(self, text: bytes) -> tuple[Array, NDArray[np.int64]]:
        """Return the rows of lines and their decimals; NotFixedError where they are of an unusual form."""
        if self._nine_decimals:
            try:
                return scan_fixed(text, len(self._names), self._whole_numbers), self._fixed_decimals
            except NotFixedError:
                self._nine_decimals = False
        return scan_decimals(text, len(self._names))

    def _read_any(self, text: bytes) -> Array:
        """Return the rows of lines whose numbers are written in any form."""
        width = len(self._names)
        lines = text.split(b"\n")
        cells = [line.split(b",") for line in lines if line.strip()]
        rows = np.empty((0, width))
        if not cells:
            return rows
        try:
            # float() would take 1_000.
            if b"_" not in text and all(len(line) == width for line in cells):
                rows = np.array([list(map(float, line)) for line in cells])
        except ValueError:
            rows = np.empty((0, width))
        if len(rows) != len(cells) or not np.isfinite(rows).all():
            self._explain(lines)
            return np.empty((0, width))
        self.decimals = np.maximum(self.decimals, _most_decimals(cells))
        return rows

    def _explain(self, lines: Sequence[bytes]) -> None:
        """Say what is wrong with lines of which some are."""
        flaws = (
            flaw
            for number, line in enumerate(lines, start=self._line)
            if line.strip()
            for flaw in self._flaws_of(line, number)
        )
        self.problems += islice(flaws, _MOST_PROBLEMS - len(self.problems))

    def _flaws_of(self, line: bytes, number: int) -> Iterator[Problem]:
        cells, source = line.split(b","), line.decode(errors="replace")
        if len(cells) != len(self._names):
            place = Place(self._file, number, 1, source, max(len(source), 1))
            yield Problem(
                f"the line has {len(cells)} values, expected {len(self._names)} as in line 1", place=place
            )
            return
        column = 1
        for name, cell in zip(self._names, cells, strict=True):
            text = cell.decode(errors="replace")
            if not (_is_number(cell) and isfinite(float(cell))):
                place = Place(self._file, number, column, source, max(len(text), 1))
                value = f"'{text.strip()}'" if text.strip() else "empty"
                yield Problem(f"{name} is {value}, expected a finite number", place=place)
            column += len(text) + 1


def _is_number(cell: bytes) -> bool:
    return _NUMBER.fullmatch(cell.strip()) is not None


def _most_decimals(cells: Sequence[Sequence[bytes]]) -> NDArray[np.int64]:
    """Return how many decimals the numbers of each column show at most, shape (m,)."""
    return np.array([max(map(decimals_of, column)) for column in zip(*cells, strict=True)])
