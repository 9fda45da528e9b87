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
WriteBlocks = Callable[[Iterable[Array], Sequence[Column], BinaryIO], Iterator[Array]]
VerifyBlocks = Callable[[BinaryIO, Iterable[Array], Sequence[Column]], None]

FormatName = Literal["csv", "mcap", "jsonl", "npy", "npz", "ros", "ros-goal"]


@frozen
class Goal:
    """What a controller gets of a motion.

    Attributes:
        joint_names: n names.
        knots: With n joints.
        orders: How many of position, velocity and acceleration its points state: 1 to 3.
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
        functions: Returns the two functions of the format: one writes blocks of rows of some columns, one by
            one, to a stream, and yields each when it is written (the stream is complete when the iterator has
            ended); one reads a stream from its beginning, and raises TrajcliError where it does not hold
            these rows.
        content: Rows of the columns that the job asks for; a log with messages, topics and times of a clock;
            or the knots of the motion, and no rows.
        si: Whether its rows are SI, whatever the units of the job.
        text: Whether it is text, which a terminal can show.
        decimals: Whether its numbers may have nine decimals, or all their digits.
    """

    name: str
    functions: Callable[[WriteOptions], tuple[WriteBlocks, VerifyBlocks]]
    content: Literal["rows", "log", "knots"] = "rows"
    si: bool = True
    text: bool = True
    decimals: bool = False

    def write(
        self, rows: Iterable[Array], columns: Sequence[Column], out: BinaryIO, options: WriteOptions
    ) -> None:
        """Write blocks of rows, one by one, to a stream."""
        for _ in self.functions(options)[0](rows, columns, out):
            pass


def _csv(options: WriteOptions) -> tuple[WriteBlocks, VerifyBlocks]:
    return partial(write_csv_blocks, digits=options.digits), partial(verify_csv, digits=options.digits)


def _jsonl(options: WriteOptions) -> tuple[WriteBlocks, VerifyBlocks]:
    del options
    from trajcli.streams.jsonl import verify_jsonl, write_jsonl_blocks

    return write_jsonl_blocks, verify_jsonl


def _npy(options: WriteOptions) -> tuple[WriteBlocks, VerifyBlocks]:
    del options
    from trajcli.streams.arrays import verify_npy, write_npy_blocks

    return write_npy_blocks, verify_npy


def _npz(options: WriteOptions) -> tuple[WriteBlocks, VerifyBlocks]:
    del options
    from trajcli.streams.arrays import verify_npz, write_npz_blocks

    return write_npz_blocks, verify_npz


def _mcap(options: WriteOptions) -> tuple[WriteBlocks, VerifyBlocks]:
    from trajcli.streams.mcap.verify import verify_mcap
    from trajcli.streams.mcap.write import write_mcap_blocks

    recording = _made(options.recording)
    return partial(write_mcap_blocks, recording=recording), partial(verify_mcap, recording=recording)


def _ros(options: WriteOptions, message: RosMessage) -> tuple[WriteBlocks, VerifyBlocks]:
    from trajcli.streams.ros_yaml import verify_ros_yaml, write_ros_yaml

    goal = _made(options.goal)

    def write(rows: Iterable[Array], columns: Sequence[Column], out: BinaryIO) -> Iterator[Array]:
        del columns
        write_ros_yaml(goal.joint_names, goal.knots, out, message, goal.orders)
        yield from rows

    def verify(written: BinaryIO, rows: Iterable[Array], columns: Sequence[Column]) -> None:
        del columns
        for _ in rows:  # the file is written when they have ended
            pass
        verify_ros_yaml(written, goal.joint_names, goal.knots, message, goal.orders)

    return write, verify


def _made(make: Callable[[], T] | None) -> T:
    if make is None:
        raise TrajcliError("this format is written of a motion, and there is only a table")
    return make()


FORMATS: Mapping[FormatName, StreamFormat] = {
    "csv": StreamFormat("CSV", _csv, si=False, decimals=True),
    "mcap": StreamFormat("MCAP", _mcap, "log", text=False),
    "jsonl": StreamFormat("JSON lines", _jsonl),
    "npy": StreamFormat("NPY", _npy, text=False),
    "npz": StreamFormat("NPZ", _npz, text=False),
    "ros": StreamFormat("a ROS message", partial(_ros, message="ros"), "knots"),
    "ros-goal": StreamFormat("a ROS goal", partial(_ros, message="ros-goal"), "knots"),
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
    ending = next((each for each in ENDINGS if name.lower().endswith(each)), None)
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
        rows: Blocks of shape (N, m); each is read back from the file and compared as soon as it is written.
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
        write, verify = stream_format.functions(how)
        with Path(out.name).open("rb") as back:
            verify(back, _flushed(write(rows, columns, out), out), columns)


def _flushed(blocks: Iterable[Array], out: BinaryIO) -> Iterator[Array]:
    for block in blocks:
        out.flush()
        yield block
    out.flush()
