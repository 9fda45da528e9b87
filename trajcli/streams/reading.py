"""Reading of files with motions: tables of rows, whatever their format.

What is no CSV file has the columns of one in SI: t, q1.., qd1.., qdd1..
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from trajcli.streams.table import Table, read_csv
from trajcli.streams.whole_file import is_special

if TYPE_CHECKING:
    from trajcli.streams.mcap.read import LoggedMotion
    from trajcli.streams.ros_messages import JointMessage

_ALL_DECIMALS = 17  # of a float64
ENDINGS_OF_ROWS = (".csv", ".txt", ".jsonl", ".mcap")
_YAML = (".yaml", ".yml")
_HEAD = 1 << 16  # bytes of a YAML file that are looked at
_JOINT_NAMES = re.compile(rb"^[ \t-]*joint_names[ \t]*:", re.MULTILINE)
_MCAP = b"\x89MCAP0\r\n"


def read_table(path: str | Path, topic: str | None = None) -> Table:
    """Read the rows of a file: CSV, JSON lines, MCAP, or a ROS message in YAML, by its name or first bytes.

    Args:
        path: The file; "-" is standard input, and CSV.
        topic: Of MCAP, the topic; /joint_states unless given.

    Raises:
        FileError: When it cannot be read.
        InputError: When it is no such file, or has no such topic.
    """
    ending = Path(str(path)).suffix.lower()
    if is_log(path):
        from trajcli.streams.mcap.read import read_mcap

        return _table(read_mcap(path, topic))
    if ending in _YAML:
        from trajcli.streams.ros_messages import read_ros_yaml

        return _table(read_ros_yaml(path))
    if ending == ".jsonl":
        from trajcli.streams.jsonl import read_jsonl

        return read_jsonl(path)
    return read_csv(path)


def is_log(path: str | Path) -> bool:
    """Return whether a file is read as MCAP."""
    return str(path).lower().endswith(".mcap") or _begins_as_mcap(path)


def holds_motion(path: str | Path) -> bool:
    """Return whether a file is one of rows or messages by its name or first bytes, and no job."""
    ending = Path(str(path)).suffix.lower()
    return ending in ENDINGS_OF_ROWS or is_log(path) or (ending in _YAML and is_ros_message(path))


def is_ros_message(path: str | Path) -> bool:
    """Return whether a YAML file is a ROS message with a joint trajectory: a job has no `joint_names`."""
    if is_special(str(path)):
        return False
    try:
        with Path(path).open("rb") as stream:
            return _JOINT_NAMES.search(stream.read(_HEAD)) is not None
    except (OSError, ValueError):
        return False


def _begins_as_mcap(path: str | Path) -> bool:
    if str(path) == "-" or is_special(str(path)):
        return False
    try:
        with Path(path).open("rb") as stream:
            return stream.read(len(_MCAP)) == _MCAP
    except (OSError, ValueError):
        return False


def _table(motion: LoggedMotion | JointMessage) -> Table:
    """Return a motion under the names of a CSV file in SI."""
    names, parts = ["t"], [motion.times[:, None]]
    states = {"q": motion.position, "qd": motion.velocity, "qdd": motion.acceleration}
    states["tau"] = getattr(motion, "effort", motion.position[:, :0])
    for kind, values in states.items():
        names += [f"{kind}{joint + 1}" for joint in range(values.shape[1])]
        parts.append(values)
    decimals = np.full(len(names), _ALL_DECIMALS, dtype=np.int64)
    return Table(tuple(names), np.concatenate(parts, axis=1), decimals, motion.file)
