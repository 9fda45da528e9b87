"""Formats of sample streams: the writer that the ending of a file's name stands for.

A format is a module of this folder and a line in `FORMATS`. Its functions get rows in blocks of shape (N, m),
the m columns, which say what is in them (quantity, joint and unit), and what else there is to say about how
and what is written.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO, Literal, TypeVar

from trajcli.columns import Column
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, TrajcliError
from trajcli.frozen import frozen
from trajcli.streams.csv import verify_csv, write_csv_blocks
from trajcli.streams.decimals import Digits
from trajcli.streams.whole_file import is_special, whole_file

if TYPE_CHECKING:
    from trajcli.knots import Knots
    from trajcli.streams.mcap.recording import Recording
    from trajcli.streams.ros_yaml import RosMessage

T = TypeVar("T")

FormatName = Literal["csv", "mcap", "jsonl", "npy", "npz", "ros", "ros-goal"]


@frozen
class Goal:
    """What a controller gets of a motion.

    Attributes:
        joint_names: n names.
        knots: With n joints.
        orders: How many of position, velocity and acceleration its points state.
    """

    joint_names: tuple[str, ...]
    knots: Knots
    orders: int = 3


@frozen
class WriteOptions:
    """What the rows do not say.

    Attributes:
        digits: Of numbers that are written as text: nine decimals, or as many as restore each bit.
        recording: Makes what a log holds beside its rows; None where there is only a table.
        goal: Makes what a controller gets; None where there is only a table.
    """

    digits: Digits = "fixed"
    recording: Callable[[], Recording] | None = None
    goal: Callable[[], Goal] | None = None


@frozen
class StreamFormat:
    """A format in which rows are written.

    Attributes:
        name: For messages.
        write_blocks: Writes blocks of rows, one by one, to a stream, and yields each when it is written; the
            stream is complete when the iterator has ended.
        verify: Reads a stream from its beginning, and raises TrajcliError where it does not hold these rows.
        content: Rows of the columns that the job asks for; a log with messages, topics and times of a clock;
            or the knots of the motion, and no rows.
        si: Whether its rows are SI, whatever the units of the job.
        text: Whether it is text, which a terminal can show.
        decimals: Whether its numbers may have nine decimals, or all their digits.
        in_order: Whether the text of a block is final when it is written, and is read once and in order. Then
            it is compared in memory, and the file by its checksum; otherwise the file is read block by block.
    """

    name: str
    write_blocks: Callable[[Iterable[Array], Sequence[Column], BinaryIO, WriteOptions], Iterator[Array]]
    verify: Callable[[BinaryIO, Iterable[Array], Sequence[Column], WriteOptions], None]
    content: Literal["rows", "log", "knots"] = "rows"
    si: bool = True
    text: bool = True
    decimals: bool = False
    in_order: bool = False

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


def _write_jsonl(
    rows: Iterable[Array], columns: Sequence[Column], out: BinaryIO, options: WriteOptions
) -> Iterator[Array]:
    del options
    from trajcli.streams.jsonl import write_jsonl_blocks

    return write_jsonl_blocks(rows, columns, out)


def _verify_jsonl(
    written: BinaryIO, rows: Iterable[Array], columns: Sequence[Column], options: WriteOptions
) -> None:
    del options
    from trajcli.streams.jsonl import verify_jsonl

    verify_jsonl(written, rows, columns)


def _write_arrays(
    rows: Iterable[Array], columns: Sequence[Column], out: BinaryIO, options: WriteOptions, *, archive: bool
) -> Iterator[Array]:
    del options
    from trajcli.streams.arrays import write_npy_blocks, write_npz_blocks

    return (write_npz_blocks if archive else write_npy_blocks)(rows, columns, out)


def _verify_arrays(
    written: BinaryIO,
    rows: Iterable[Array],
    columns: Sequence[Column],
    options: WriteOptions,
    *,
    archive: bool,
) -> None:
    del options
    from trajcli.streams.arrays import verify_npy, verify_npz

    (verify_npz if archive else verify_npy)(written, rows, columns)


def _arrays(name: str, *, archive: bool) -> StreamFormat:
    write, verify = partial(_write_arrays, archive=archive), partial(_verify_arrays, archive=archive)
    return StreamFormat(name, write, verify, text=False)


def _write_mcap(
    rows: Iterable[Array], columns: Sequence[Column], out: BinaryIO, options: WriteOptions
) -> Iterator[Array]:
    from trajcli.streams.mcap.write import write_mcap_blocks

    return write_mcap_blocks(rows, columns, out, _made(options.recording))


def _verify_mcap(
    written: BinaryIO, rows: Iterable[Array], columns: Sequence[Column], options: WriteOptions
) -> None:
    from trajcli.streams.mcap.verify import verify_mcap

    verify_mcap(written, rows, columns, _made(options.recording))


def _write_ros(
    rows: Iterable[Array],
    columns: Sequence[Column],
    out: BinaryIO,
    options: WriteOptions,
    *,
    message: RosMessage,
) -> Iterator[Array]:
    del columns
    from trajcli.streams.ros_yaml import write_ros_yaml

    goal = _made(options.goal)
    write_ros_yaml(goal.joint_names, goal.knots, out, message, goal.orders)
    yield from rows


def _verify_ros(
    written: BinaryIO,
    rows: Iterable[Array],
    columns: Sequence[Column],
    options: WriteOptions,
    *,
    message: RosMessage,
) -> None:
    del columns
    from trajcli.streams.ros_yaml import verify_ros_yaml

    goal = _made(options.goal)
    for _ in rows:  # the file is written when they have ended
        pass
    verify_ros_yaml(written, goal.joint_names, goal.knots, message, goal.orders)


def _made(make: Callable[[], T] | None) -> T:
    if make is None:
        raise TrajcliError("this format is written of a motion, and there is only a table")
    return make()


def _ros(name: str, message: RosMessage) -> StreamFormat:
    write, verify = partial(_write_ros, message=message), partial(_verify_ros, message=message)
    return StreamFormat(name, write, verify, "knots")


FORMATS: Mapping[FormatName, StreamFormat] = {
    "csv": StreamFormat("CSV", _write_csv, _verify_csv, si=False, decimals=True, in_order=True),
    "mcap": StreamFormat("MCAP", _write_mcap, _verify_mcap, "log", text=False),
    "jsonl": StreamFormat("JSON lines", _write_jsonl, _verify_jsonl, in_order=True),
    "npy": _arrays("NPY", archive=False),
    "npz": _arrays("NPZ", archive=True),
    "ros": _ros("a ROS message", "ros"),
    "ros-goal": _ros("a ROS goal", "ros-goal"),
}
ENDINGS: Mapping[str, tuple[FormatName, ...]] = {
    ".csv": ("csv",),
    ".mcap": ("mcap",),
    ".jsonl": ("jsonl",),
    ".npy": ("npy",),
    ".npz": ("npz",),
    ".yaml": ("ros", "ros-goal"),
}
"""The formats that the ending of a file's name may stand for; the first unless another is asked for."""
DEFAULT = FORMATS["csv"]
"""The format of standard output, of devices, and of files whose names tell no other."""


def format_of(path: str | Path | None, asked: FormatName | None = None) -> StreamFormat:
    """Return the format that the name of a file stands for; a device, a pipe or a stream needs no name.

    Args:
        path: The file; None or "-" is standard output.
        asked: The name of a format; it decides where the file's name leaves that open.

    Raises:
        InputError: When the table does not know its ending, or the file would promise what it does not hold.
    """
    name = "-" if path is None else str(path)
    ending = next((known for known in ENDINGS if name.lower().endswith(known)), None)
    if ending is None or name == "-" or is_special(name):
        if name == "-" or is_special(name):
            return DEFAULT if asked is None else FORMATS[asked]
        raise _unknown_ending(name)
    names = ENDINGS[ending]
    if asked is not None and asked not in names:
        hint = "leave --format out, or name the file " + " or ".join(
            e for e, n in ENDINGS.items() if asked in n
        )
        raise InputError(f"--format {asked} contradicts the name of the file, {name}", hint=hint)
    return FORMATS[asked or names[0]]


def _unknown_ending(name: str) -> InputError:
    suffix = Path(name).suffix.lower()
    as_what = f"as {suffix}" if suffix else f"to a file without an ending, '{Path(name).name}'"
    written = " or ".join(FORMATS[names[0]].name for names in ENDINGS.values())
    return InputError(
        f"rows are written as {written}, not {as_what}", hint=f"name the file {' or '.join(ENDINGS)}"
    )


def write_verified(
    path: str | Path,
    rows: Iterable[Array],
    columns: Sequence[Column],
    options: WriteOptions | None = None,
    form: StreamFormat | None = None,
) -> None:
    """Write a file that appears whole or not at all, and is compared with its rows before it does.

    Args:
        path: The file; its ending names the format. A device or pipe is written to directly, and not
            compared.
        rows: Blocks of shape (N, m); each is compared with its text, and the finished file with all text.
        columns: What the rows hold, in the units that the columns say.
        options: What the rows do not say.
        form: The format, where the name does not say it.

    Raises:
        InputError: When the ending is that of a format which is not written.
        FileError: When the file cannot be written.
        BrokenPipeError: When the path is a pipe whose reader has closed it.
        TrajcliError: When a value is not finite, or the file does not hold what was written.
    """
    stream_format, how = form or format_of(path), options or WriteOptions()
    with whole_file(path) as out:
        if not out.readable():
            stream_format.write(rows, columns, out, how)
            return
        if stream_format.in_order:
            # whoever writes no file does not pay for the import
            from trajcli.streams.checked_file import write_and_compare

            write_and_compare(
                out,
                lambda text: stream_format.write_blocks(rows, columns, text, how),
                lambda text, blocks: stream_format.verify(text, blocks, columns, how),
            )
            return
        with Path(out.name).open("rb") as back:
            flushed = _flushed(stream_format.write_blocks(rows, columns, out, how), out)
            stream_format.verify(back, flushed, columns, how)


def _flushed(blocks: Iterable[Array], out: BinaryIO) -> Iterator[Array]:
    for block in blocks:
        out.flush()
        yield block
    out.flush()
