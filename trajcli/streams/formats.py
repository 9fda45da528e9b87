"""Formats of sample streams: the writer that the ending of a file's name stands for.

A format is a module of this folder and a line in `FORMATS`. Its functions get rows in blocks of shape (N, m),
the m columns, which say what is in them (quantity, joint and unit), and what else there is to say about how
and what is written.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

import numpy as np

from trajcli.columns import Column, Group
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, TrajcliError
from trajcli.frozen import frozen
from trajcli.streams.csv import verify_csv, write_csv_blocks
from trajcli.streams.decimals import Digits
from trajcli.streams.whole_file import is_special, whole_file

if TYPE_CHECKING:
    from trajcli.streams.mcap.recording import Recording
    from trajcli.streams.table import Table

_ALL_DECIMALS = 17  # of a float64


@frozen
class WriteOptions:
    """What the rows do not say.

    Attributes:
        digits: Of numbers that are written as text: nine decimals, or as many as restore each bit.
        recording: Makes what a log holds beside its rows; None where there is only a table.
    """

    digits: Digits = "fixed"
    recording: Callable[[], Recording] | None = None


@frozen
class StreamFormat:
    """A format in which rows are written.

    Attributes:
        name: For messages.
        write_blocks: Writes blocks of rows, one by one, to a stream, and yields each when it is written; the
            stream is complete when the iterator has ended.
        verify: Reads a stream from its beginning, and raises TrajcliError where it does not hold these rows.
        groups: The columns that it needs, in SI; None where it writes those that the job asks for.
        text: Whether it is text: a terminal can show it, and numbers have digits.
        log: Whether it holds messages with topics and times of a clock.
    """

    name: str
    write_blocks: Callable[[Iterable[Array], Sequence[Column], BinaryIO, WriteOptions], Iterator[Array]]
    verify: Callable[[BinaryIO, Iterable[Array], Sequence[Column], WriteOptions], None]
    groups: tuple[Group, ...] | None = None
    text: bool = True
    log: bool = False

    def write(
        self, rows: Iterable[Array], columns: Sequence[Column], out: BinaryIO, options: WriteOptions
    ) -> None:
        """Write blocks of rows, one by one, to a stream."""
        for _ in self.write_blocks(rows, columns, out, options):
            pass


def _write_csv(
    rows: Iterable[Array], columns: Sequence[Column], out: BinaryIO, options: WriteOptions
) -> Iterator[Array]:
    return write_csv_blocks(rows, columns, out, options.digits)


def _verify_csv(
    written: BinaryIO, rows: Iterable[Array], columns: Sequence[Column], options: WriteOptions
) -> None:
    verify_csv(written, rows, columns, options.digits)


def _write_mcap(
    rows: Iterable[Array], columns: Sequence[Column], out: BinaryIO, options: WriteOptions
) -> Iterator[Array]:
    from trajcli.streams.mcap.write import write_mcap_blocks

    return write_mcap_blocks(rows, columns, out, _recording(options))


def _verify_mcap(
    written: BinaryIO, rows: Iterable[Array], columns: Sequence[Column], options: WriteOptions
) -> None:
    from trajcli.streams.mcap.verify import verify_mcap

    verify_mcap(written, rows, columns, _recording(options))


def _recording(options: WriteOptions) -> Recording:
    if options.recording is None:
        raise TrajcliError("a log is written of a motion, and there is only a table")
    return options.recording()


FORMATS: Mapping[str, StreamFormat] = {
    ".csv": StreamFormat("CSV", _write_csv, _verify_csv),
    ".mcap": StreamFormat("MCAP", _write_mcap, _verify_mcap, ("t", "q", "qd", "qdd"), text=False, log=True),
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
    *,
    form: StreamFormat | None = None,
    recording: Callable[[], Recording] | None = None,
) -> None:
    """Write a file that appears whole or not at all, and is read back before it does.

    Args:
        path: The file; its ending names the format. A device or pipe is written to directly, and not read
            back.
        rows: Blocks of shape (N, m); each is written, and compared with what then stands in the file.
        columns: What the rows hold, in the units that the columns say.
        digits: Of numbers that are written as text: nine decimals, or as many as restore each bit.
        form: The format, where the name does not say it.
        recording: Makes what a log holds beside its rows.

    Raises:
        InputError: When the ending is that of a format which is not written.
        FileError: When the file cannot be written.
        BrokenPipeError: When the path is a pipe whose reader has closed it.
        TrajcliError: When a value is not finite, or the file does not hold what was written.
    """
    stream_format, options = form or format_of(path), WriteOptions(digits, recording)
    with whole_file(path) as out:
        if not out.readable():
            stream_format.write(rows, columns, out, options)
            return
        with Path(out.name).open("rb") as back:
            flushed = _flushed(stream_format.write_blocks(rows, columns, out, options), out)
            stream_format.verify(back, flushed, columns, options)


def read_table(path: str | Path, topic: str | None = None) -> Table:
    """Read the rows of a file: CSV, or MCAP where its name ends so or its first bytes are those of MCAP.

    Args:
        path: The file; "-" is standard input, and CSV.
        topic: Of MCAP, the topic; /joint_states unless given.

    Raises:
        FileError: When it cannot be read.
        InputError: When it is no such file, or has no such topic.
    """
    if is_log(path):
        return _table_of_log(path, topic)
    from trajcli.streams.table import read_csv

    return read_csv(path)


def _table_of_log(path: str | Path, topic: str | None) -> Table:
    """Return the motion of a topic under the names of a CSV file in SI: t, q1.., qd1.., qdd1..."""
    from trajcli.streams.mcap.read import read_mcap
    from trajcli.streams.table import Table

    motion = read_mcap(path, topic)
    names, parts = ["t"], [motion.times[:, None]]
    for kind, values in (("q", motion.position), ("qd", motion.velocity), ("qdd", motion.acceleration)):
        names += [f"{kind}{joint + 1}" for joint in range(values.shape[1])]
        parts.append(values)
    decimals = np.full(len(names), _ALL_DECIMALS, dtype=np.int64)
    return Table(tuple(names), np.concatenate(parts, axis=1), decimals, motion.file)


def is_log(path: str | Path) -> bool:
    """Return whether a file is read as MCAP."""
    return str(path).lower().endswith(".mcap") or _begins_as_mcap(path)


def _begins_as_mcap(path: str | Path) -> bool:
    if str(path) == "-" or is_special(str(path)):
        return False
    try:
        with Path(path).open("rb") as stream:
            return stream.read(8) == b"\x89MCAP0\r\n"
    except (OSError, ValueError):
        return False


def _flushed(blocks: Iterable[Array], out: BinaryIO) -> Iterator[Array]:
    for block in blocks:
        out.flush()
        yield block
    out.flush()
