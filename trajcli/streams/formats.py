"""Formats of sample streams: the writer that the ending of a file's name stands for.

A format is a module of this folder and a line in `FORMATS`. Its functions get rows in blocks of shape (N, m),
and the m columns, which say what is in them: quantity, joint and unit.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import BinaryIO

from trajcli.columns import Column
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import frozen
from trajcli.streams.csv import verify_csv, write_csv, write_csv_blocks
from trajcli.streams.decimals import Digits
from trajcli.streams.whole_file import is_special, whole_file


@frozen
class StreamFormat:
    """A format in which rows are written.

    Attributes:
        name: For messages.
        write: Writes blocks of rows, one by one, to a stream.
        write_blocks: The same, and yields each block when it has been written.
        verify: Reads a stream from its beginning, and raises TrajcliError where it does not hold these rows.
        in_order: Whether the text of a block is final when it is written, and is read once and in order. Then
            it is compared in memory, and the file by its checksum; otherwise the file is read block by block.
    """

    name: str
    write: Callable[[Iterable[Array], Sequence[Column], BinaryIO, Digits], None]
    write_blocks: Callable[[Iterable[Array], Sequence[Column], BinaryIO, Digits], Iterator[Array]]
    verify: Callable[[BinaryIO, Iterable[Array], Sequence[Column], Digits], None]
    in_order: bool = False


FORMATS: Mapping[str, StreamFormat] = {
    ".csv": StreamFormat("CSV", write_csv, write_csv_blocks, verify_csv, in_order=True),
}
DEFAULT = FORMATS[".csv"]
"""The format of standard output, of devices, and of files whose names tell no other."""


def format_of(path: str | Path) -> StreamFormat:
    """Return the format that the name of a file stands for; a device or a pipe needs no name.

    Raises:
        InputError: When the table does not know its ending: the file would promise what it does not hold.
    """
    name = str(path)
    ending = next((known for known in FORMATS if name.lower().endswith(known)), None)
    if ending is not None:
        return FORMATS[ending]
    if name == "-" or is_special(name):
        return DEFAULT
    written = " or ".join(known.name for known in FORMATS.values())
    suffix = Path(name).suffix.lower()
    as_what = f"as {suffix}" if suffix else f"to a file without an ending, '{Path(name).name}'"
    raise InputError(
        f"rows are written as {written}, not {as_what}", hint=f"name the file {' or '.join(FORMATS)}"
    )


def write_verified(
    path: str | Path,
    rows: Iterable[Array],
    columns: Sequence[Column],
    digits: Digits = "fixed",
) -> None:
    """Write a file that appears whole or not at all, and is compared with its rows before it does.

    Args:
        path: The file; its ending names the format. A device or pipe is written to directly, and not
            compared.
        rows: Blocks of shape (N, m); each is compared with its text, and the finished file with all text.
        columns: What the rows hold, in the units that the columns say.
        digits: Of numbers that are written as text: nine decimals, or as many as restore each bit.

    Raises:
        InputError: When the ending is that of a format which is not written.
        FileError: When the file cannot be written.
        BrokenPipeError: When the path is a pipe whose reader has closed it.
        TrajcliError: When a value is not finite, or the file does not hold what was written.
    """
    stream_format = format_of(path)
    with whole_file(path) as out:
        if not out.readable():
            stream_format.write(rows, columns, out, digits)
            return
        if stream_format.in_order:
            # whoever writes no file does not pay for the import
            from trajcli.streams.checked_file import write_and_compare

            write_and_compare(
                out,
                lambda text: stream_format.write_blocks(rows, columns, text, digits),
                lambda text, blocks: stream_format.verify(text, blocks, columns, digits),
            )
            return
        with Path(out.name).open("rb") as back:
            flushed = _flushed(stream_format.write_blocks(rows, columns, out, digits), out)
            stream_format.verify(back, flushed, columns, digits)


def _flushed(blocks: Iterable[Array], out: BinaryIO) -> Iterator[Array]:
    for block in blocks:
        out.flush()
        yield block
