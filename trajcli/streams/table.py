"""Tables of numbers read from CSV files of any origin."""

from __future__ import annotations

import errno
import sys
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import FileError, InputError, Place, Problem
from trajcli.frozen import frozen
from trajcli.streams.text_layout import Header, read_header
from trajcli.streams.text_rows import RowReader, chunks

_CHUNK = 1 << 20  # bytes read at a time


@frozen
class Table:
    """The content of a CSV file.

    Attributes:
        names: The m columns' names.
        columns: Shape (N, m), N >= 1, in the units that the names say.
        decimals: Shape (m,): the most decimals that any value of a column shows; what the file rounds to.
        file: Its name, for messages.
        joints: Names of the joints 1, 2, ... of a message; None where it says none.
    """

    names: tuple[str, ...]
    columns: Array
    decimals: NDArray[np.int64]
    file: str
    joints: tuple[str, ...] | None = None

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

    Cells are separated by commas, semicolons, tabs or blanks, as `text_layout` finds them. Lines may end in
    CR LF, the last one in nothing; empty lines are skipped.

    Args:
        source: Its path; "-" is standard input.

    Raises:
        FileError: When it cannot be read.
        InputError: When it is not such a file; with file, line and column of what is wrong.
    """
    file = "stdin" if str(source) == "-" else str(source)
    with opened(source, file) as stream:
        header, text = read_header(stream, file)
        reader = RowReader(header)
        columns = joined_blocks(rows_of(stream, text, header, reader))
    return Table(header.names, columns, reader.decimals, file)


def joined_blocks(blocks: Iterable[Array]) -> Array:
    """Return blocks of rows, (N, m) each and one at least, as one array; hardly a row is in memory twice.

    The array grows by an eighth at a time, which the system does without copying where it is large.
    """
    rows, count = np.empty((0, 0)), 0
    for block in blocks:
        if not count:
            rows = np.empty(block.shape)
        elif count + len(block) > len(rows):
            rows.resize((max(count + len(block), len(rows) * 9 // 8), rows.shape[1]), refcheck=False)
        rows[count : count + len(block)] = block
        count += len(block)
    rows.resize((count, rows.shape[1]), refcheck=False)
    return rows


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
        stream = stack.enter_context(opened(source, file))
        header, text = read_header(stream, file)
        return TableBlocks(header.names, _blocks(stack.pop_all(), stream, text, header), file)


def _blocks(opened: ExitStack, stream: BinaryIO, text: bytes, header: Header) -> Iterator[Array]:
    with opened:
        yield from rows_of(stream, text, header, RowReader(header))


def rows_of(stream: BinaryIO, text: bytes, header: Header, reader: RowReader) -> Iterator[Array]:
    """Yield the rows of a stream, block by block, each of shape (N, columns), N >= 1.

    Args:
        stream: Behind the names.
        text: What was read behind them.
        header: The names.
        reader: Of the rows.

    Raises:
        InputError: When a line is no row, or there are none.
    """
    empty = True
    for lines in chunks(stream, header.file, text, _CHUNK):
        block = reader.read(lines)
        if len(block):
            empty = False
            yield block
    if empty:
        message = "the file has no rows, only the columns' names"
        raise InputError(Problem(message, place=Place(header.file, header.line, 1, header.text)))


@contextmanager
def opened(source: str | Path, file: str) -> Iterator[BinaryIO]:
    """Open a file, or standard input for "-", with errors that name it."""
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
