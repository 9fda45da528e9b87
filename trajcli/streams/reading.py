"""Reading of files with motions: rows of every format, by the name or the first bytes of a file."""

from __future__ import annotations

import re
import sys
from codecs import BOM_UTF8
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from trajcli.errors import InputError, utf8
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.recorded.column_roles import NamedFile, assign_roles, ordered_joints
from trajcli.streams.row_sources import (
    EXACT,
    ArrayRows,
    LoggedRows,
    RowSource,
    TextRows,
    TimedRows,
    in_columns,
    unplaced,
)
from trajcli.streams.table import Table, joined_blocks
from trajcli.streams.whole_file import is_folder, is_special, kind_of, paths_below

_ALL_DECIMALS = 17  # of a float64
ENDINGS_OF_ROWS = (".csv", ".txt", ".jsonl", ".mcap", ".npy", ".npz")
_YAML = (".yaml", ".yml")
_OF_JOBS = (*_YAML, ".json")
_PEEKED = 4096  # bytes of standard input that are looked at
_HEAD = 1 << 16  # bytes of a file that are looked at
_JOINT_NAMES = re.compile(  # begins a line, or stands with its points in one, as JSON is written by programs
    rb"""^[ \t{-]*["']?joint_names["']?[ \t]*:|^[ \t[]*\{.*"joint_names"[ \t]*:.*"points"[ \t]*:""",
    re.MULTILINE,
)
_JSON_ARRAY = re.compile(rb"\s*\[\s*\{")
_MCAP = b"\x89MCAP0\r\n"
_BY_FIRST_BYTES = (
    (re.compile(re.escape(_MCAP)), "mcap"),
    (re.compile(rb"\x93NUMPY"), "npy"),
    (re.compile(rb"PK\x03\x04.{26}[^\x00]{1,200}?\.npy", re.DOTALL), "npz"),  # its first member is an array
)
_BY_ENDING = {
    **{ending: ending[1:] for ending in (".mcap", ".npy", ".npz", ".jsonl", ".csv")},
    **dict.fromkeys(_YAML, "ros"),
}
_OTHERS = {
    b"#ROSBAG": ("a bag of ROS 1", "`rosbags-convert` makes MCAP of it"),
    b"SQLite format 3": ("a bag of ROS 2 in SQLite", "`ros2 bag convert` makes MCAP of it"),
    b"PAR1": ("a parquet file", "trajcli.check takes its columns as arrays; or save them as CSV or .npy"),
    b"\x89HDF": ("an HDF5 file", "save its arrays as CSV or .npy"),
    b"PK\x03\x04": ("an archive (.zip, .xlsx)", "save one table of it as CSV, or arrays as .npz"),
    **dict.fromkeys(
        (b"\xff\xfe", b"\xfe\xff"),
        ("text in UTF-16", "`iconv -f UTF-16 -t UTF-8 FILE | trajcli ... -` makes UTF-8 of it"),
    ),
    b"\x1f\x8b": ("compressed by gzip", "`gunzip -c FILE | trajcli ... -` unpacks it"),
}
"""Files that are known by their first bytes and are not read: what they are, and what would be read."""


def read_table(
    path: str | Path | ByteSource, topic: str | None = None, joints: Sequence[str] | None = None
) -> Table:
    """Read all rows of a file: CSV, JSON lines, MCAP, arrays of numpy, or a ROS message in YAML.

    What is no CSV file has the columns of one in SI: t, q1.., qd1.., qdd1..

    Args:
        path: The file; "-" is standard input. An opened one is read from its first byte on.
        topic: Of MCAP, the topic; /joint_states unless given. Other files have none.
        joints: Names of the joints that are wanted, in their order; those of messages are put into it.

    Raises:
        FileError: When it cannot be read.
        InputError: When it is no such file, has no such topic, or lacks a joint.
    """
    source = path if isinstance(path, ByteSource) else ByteSource(path)
    of_log = topic is not None and format_of_rows(source) == "mcap"
    rows = open_rows_of(source, topic=topic if of_log else None)
    every = range(len(rows.named.names))
    columns = joined_blocks(rows.blocks(every, ()))
    decimals = rows.decimals(every)
    shown = np.where(decimals == EXACT, _ALL_DECIMALS, decimals)
    table = Table(rows.named.names, columns, shown, rows.named.file, rows.joint_names)
    return table if joints is None else with_joints(table, joints)


def with_joints(table: Table, joints: Sequence[str]) -> Table:
    """Return a table with its joints in another order, by their names where it says them.

    Raises:
        InputError: When it has other joints.
    """
    if table.joints is None:
        return table
    named = NamedFile(table.file, table.names, unplaced)
    roles = assign_roles(named)
    order, names, _ = ordered_joints(named, roles, table.joints, joints)
    taken = [roles.time, *(found[joint] for found in roles.joints.values() for joint in order)]
    numbered = [roles.time, *(k for found in roles.joints.values() for k in found[: len(order)])]
    return Table(
        tuple(table.names[k] for k in numbered),
        table.columns[:, taken],
        table.decimals[taken],
        table.file,
        names,
    )


def open_rows_of(
    path: str | Path | ByteSource,
    *,
    topic: str | None = None,
    field: str | None = None,
    joints: int | None = None,
) -> RowSource:
    """Open the rows of a file of any format.

    Args:
        path: The file; "-" is standard input. An opened one is read from its first byte on.
        topic: Of MCAP, the topic; /joint_states unless given.
        field: Of messages with several states, the one that is read.
        joints: Number of joints that are expected, for arrays without names.

    Raises:
        FileError: When it cannot be read.
        InputError: When it is no such file, or has no such topic.
    """
    source = path if isinstance(path, ByteSource) else ByteSource(path)
    rows = _rows_of_format(source, topic=topic, field=field, joints=joints)
    return rows if source.rate is None else TimedRows(rows, source.rate)


def _rows_of_format(
    source: ByteSource, *, topic: str | None, field: str | None, joints: int | None
) -> RowSource:
    kind, timed = format_of_rows(source), source.rate is None
    if kind != "mcap" and (topic is not None or field is not None):
        option = "--topic" if topic is not None else "--field"
        raise InputError(f"{option} is about MCAP, and {source.file} is none", hint=f"leave {option} out")
    if kind == "mcap":
        return LoggedRows(source, topic, field)
    if kind == "ros":
        return _message(source)
    if kind == "jsonl":
        from trajcli.streams.jsonl import JsonRows

        return JsonRows(source)
    if kind == "npy":
        from trajcli.streams.npy import ArrayFile

        return ArrayFile(source, joints, timed=timed)
    if kind == "npz":
        from trajcli.streams.npy import open_archive

        return open_archive(source, joints, timed=timed)
    return TextRows(source)


def refuse_job(source: ByteSource) -> None:
    """Refuse a job in the place of a motion, and a file that is not there, before more is asked for.

    Raises:
        FileError: When it cannot be read.
        InputError: When it is YAML and holds no motion.
    """
    if format_of_rows(source) == "ros":
        _message(source)


def format_of_rows(source: ByteSource) -> str:
    """Return "mcap", "npy", "npz", "ros", "jsonl" or "csv", by the first bytes or the name of a file.

    Raises:
        FileError: When it cannot be read.
        InputError: When it is known to be of a format that is not read.
    """
    head = source.head(_HEAD)
    kind = next((kind for pattern, kind in _BY_FIRST_BYTES if pattern.match(head)), None)
    if kind is not None:
        return kind
    for magic, (what, hint) in _OTHERS.items():
        if head.startswith(magic):
            raise InputError(f"{source.file} is {what}, which is not read", hint=hint)
    if source.ending in _BY_ENDING:
        return _BY_ENDING[source.ending]
    first = head.removeprefix(BOM_UTF8).lstrip().split(b"\n", maxsplit=1)[0]
    if first.startswith(b"{"):
        from trajcli.streams.jsonl import is_json_object

        if is_json_object(first) and not _JOINT_NAMES.search(first):
            return "jsonl"
    if _JOINT_NAMES.search(head):
        return "ros"
    if _JSON_ARRAY.match(head):
        hint = "`jq -c '.[]' FILE | trajcli ... -` makes lines of its objects"
        raise InputError(f"{source.file} is an array in JSON, which is not read", hint=hint)
    return "csv"


def is_log(path: str | Path) -> bool:
    """Return whether a file is read as MCAP."""
    return str(path).lower().endswith(".mcap") or _first_bytes(path, len(_MCAP)) == _MCAP


def holds_motion(path: str | Path) -> bool:
    """Return whether a file is one of rows or messages by its name or first bytes, and no job."""
    ending = Path(str(path)).suffix.lower()
    return ending in ENDINGS_OF_ROWS or is_log(path) or (ending in _OF_JOBS and is_ros_message(path))


def is_job(name: str) -> bool:
    """Return whether a file is a job, no motion: by its ending or first bytes; one that is not there is."""
    if name != "-" and (Path(name).suffix.lower() in _OF_JOBS or holds_motion(name)):
        return not holds_motion(name)
    try:
        if name == "-":
            head = getattr(sys.stdin.buffer, "peek", bytes)(_PEEKED)
        elif Path(name).is_file():
            with Path(name).open("rb") as stream:
                head = stream.read(_PEEKED)
        else:
            return not Path(name).exists()
    except (OSError, AttributeError):  # who reads it says what is wrong
        return False
    return not _begins_as_motion(head)


def _begins_as_motion(head: bytes) -> bool:
    """Return whether some first bytes are those of rows or messages; a job begins with a key and a colon."""
    if any(pattern.match(head) for pattern, _ in _BY_FIRST_BYTES) or _JOINT_NAMES.search(head):
        return True
    lines = map(bytes.strip, head.removeprefix(BOM_UTF8).splitlines())
    first = next((line for line in lines if line and not line.startswith((b"#", b"%", b"---"))), b"")
    if b":" in first:
        return first.startswith(b"{") and b"version" not in first
    return len(re.split(rb"[,;\s]+", first)) > 1


def motion_files(name: str) -> list[str]:
    """Return the files of motions below a folder by name, but no hidden ones; of a file its own name.

    Raises:
        InputError: When a folder holds none, or the name is empty.
        FileError: When it cannot be read.
    """
    if not name:
        raise InputError("the name of a file is empty", hint="name files or folders; . is the current one")
    if not is_folder(name):
        return [name]
    paths = [path for path in paths_below(name, "[!.]*") if kind_of(path) == "file"]
    visible = (path for path in paths if not any(p.startswith(".") for p in path.relative_to(name).parts))
    found = [str(path) for path in visible if holds_motion(path)]
    if not found:
        raise InputError(f"there is no motion in the folder {utf8(name)}", hint="expected such as .csv files")
    return found


def is_ros_message(path: str | Path) -> bool:
    """Return whether a YAML file is a ROS message with a joint trajectory: a job has no `joint_names`."""
    return _JOINT_NAMES.search(_first_bytes(path, _HEAD)) is not None


def _first_bytes(path: str | Path, count: int) -> bytes:
    """Return some bytes of a plain file; none of what is no file, or cannot be read."""
    if str(path) == "-" or is_special(str(path)):
        return b""
    try:
        with Path(path).open("rb") as stream:
            return stream.read(count)
    except (OSError, ValueError):
        return b""


def _message(source: ByteSource) -> ArrayRows:
    from trajcli.streams.ros_messages import read_ros_yaml

    message = read_ros_yaml(source)
    states = (message.position, message.velocity, message.acceleration, message.effort)
    named, columns = in_columns(source.file, message.times, states)
    relative = np.zeros(len(named.names))
    return ArrayRows("ros", named, columns, message.decimals, relative, message.joint_names, si=True)
