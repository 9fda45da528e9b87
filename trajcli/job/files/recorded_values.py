"""Recordings from CSV files that a job names: joint values in any units, and poses of the tool."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import FileError, InputError, Problem
from trajcli.job.yaml.load import Document
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import LARGEST_POSITION, FlawError
from trajcli.language.recorded import Recorded, RecordedPoses
from trajcli.streams.joint_columns import joint_columns
from trajcli.streams.table import Table, read_csv

_OF_TIME = re.compile(r"(ts?|time|(time)?stamp|secs?|seconds)([ _\[(].*)?")
_OF_TURN = re.compile(r"(r[xyz]|rpy|roll|pitch|yaw|rot|rotvec|quat|quaternion|q[wxyz])([ _\[(].*)?")


def read_recording(path: str, document: Document, robot: Robot) -> Recorded:
    """Return the recording of a job.

    Args:
        path: Relative to the job's folder.
        document: The job's.
        robot: Its joints say which columns are needed.

    Raises:
        FileError: When it cannot be read; with the place of its name in the job.
        FlawError: When it is not as it should be.
    """
    with _of_job(path, document, "through"):
        return _recorded(read_csv(Path(document.file).parent / path), robot)


@contextmanager
def _of_job(path: str, document: Document, field: str) -> Iterator[None]:
    """Place what is wrong with a file where a field of a move of the job names it."""
    try:
        yield
    except FileError as error:
        raise error.located(place=document.place(named_at(document, path, field))) from None
    except InputError as error:
        flaws = "; ".join(map(placed_text, error.problems))
        raise FlawError(flaws, "csv", hint=error.problems[0].hint) from None


def named_at(document: Document, path: str, field: str) -> tuple[str | int, ...]:
    """Return where a move of the job names a recording in a field, or its start does."""
    moves = document.node(("moves",))
    listed = moves.value if moves is not None and isinstance(moves.value, list) else []
    for index, move in enumerate(listed):
        recorded = move.child(field)
        node = recorded and recorded.child("csv")
        if node is not None and node.value == path:
            return ("moves", index, field, "csv")
    start = document.node(("start", "csv"))
    return ("start", "csv") if start is not None and start.value == path else ("moves",)


def placed_text(problem: Problem) -> str:
    """Return a problem of a file as a text, with its place there."""
    return f"{problem.place}: {problem.text()}" if problem.place else problem.text()


def _recorded(table: Table, robot: Robot) -> Recorded:
    positions = joint_values(table, robot)
    if "t" not in table.names:
        hint = "call it t, with its values in s; or remove it: times are then found from the limits"
        _refuse_others(table, _OF_TIME, "times stand in the column t, in s", hint)
        return Recorded(positions, file=table.file)
    times = table.column("t")
    late = np.flatnonzero(np.diff(times) <= 0)
    if late.size:
        row = int(late[0]) + 1
        raise InputError(
            f"{table.file}: times must increase, but row {row + 1} has t = {times[row]:.12g} s after "
            f"{times[row - 1]:.12g} s",
            hint="remove the rows that repeat a time, or the column t: times are then found from the limits",
        )
    return Recorded(positions, times, table.file)


def joint_values(table: Table, robot: Robot) -> Array:
    """Return the values of all joints (N, n), rad or m, from columns such as q1, q2_deg or a joint's name.

    Raises:
        InputError: When columns of joints are not as they should be, or hold a value that no robot has.
    """
    positions = joint_columns(robot, table.names, table.file).values(table.columns)
    refuse_large(positions, table)
    positions.flags.writeable = False  # who keeps it takes it without a copy
    return positions


def refuse_large(values: Array, table: Table) -> None:
    """Refuse angles or lengths that no robot has, rad or m.

    Raises:
        InputError: Names the file.
    """
    if max(values.max(initial=0.0), -values.min(initial=0.0)) > LARGEST_POSITION:
        text = f"{table.file}: a value is larger than {LARGEST_POSITION:g} rad or m"
        raise InputError(text, hint="check its exponent and unit")


def _refuse_others(table: Table, pattern: re.Pattern[str], where: str, hint: str) -> None:
    """Refuse columns under other names than they are read by: nobody would notice that they are not."""
    other = next((name for name in table.names if pattern.fullmatch(name.lower())), None)
    if other is not None:
        raise InputError(f"{table.file}: {where}; this file has '{other}'", hint=hint)


_LENGTHS, _QUATERNION = ("x", "y", "z"), ("qw", "qx", "qy", "qz")
_UNIT = 1e-4  # by which the length of a quaternion may differ from 1: what few decimals leave


def read_poses(path: str, document: Document) -> RecordedPoses:
    """Return the recorded poses of a job.

    Args:
        path: Relative to the job's folder.
        document: The job's.

    Raises:
        FileError: When it cannot be read; with the place of its name in the job.
        FlawError: When it is not as it should be.
    """
    with _of_job(path, document, "segments"):
        table = read_csv(Path(document.file).parent / path)
        return RecordedPoses(_positions(table), _quaternions(table), table.file)


def _positions(table: Table) -> Array:
    """Return the positions (m, 3), m."""
    positions = np.stack([_length(table, name) for name in _LENGTHS], axis=1)
    refuse_large(positions, table)
    return positions


def _length(table: Table, name: str) -> Array:
    found = [(each, factor) for each, factor in ((name, 1.0), (f"{name}_mm", 1e-3)) if each in table.names]
    if not found:
        hint = f"columns are those that `pose` writes: call it {name} (m) or {name}_mm"
        raise InputError(f"{table.file}: no column {name}", hint=hint)
    if len(found) > 1:
        raise InputError(f"{table.file}: two columns for {name}: {found[0][0]} and {found[1][0]}")
    return np.asarray(table.column(found[0][0]) * found[0][1])


def _quaternions(table: Table) -> Array | None:
    """Return unit quaternions (m, 4), w first; None where there are no such columns."""
    present = [name for name in _QUATERNION if name in table.names]
    if not present:
        hint = "write them so; or remove it: the orientation is then kept"
        _refuse_others(table, _OF_TURN, "orientations stand in the columns qw, qx, qy, qz", hint)
        return None
    if len(present) < len(_QUATERNION):
        lacking = ", ".join(name for name in _QUATERNION if name not in present)
        hint = "give qw, qx, qy and qz, or none of them: the orientation is then kept"
        raise InputError(f"{table.file}: no column {lacking}", hint=hint)
    return unit_quaternions(np.stack([table.column(name) for name in _QUATERNION], axis=1), table)


def unit_quaternions(rows: Array, table: Table) -> Array:
    """Return quaternions (N, 4), w first, of length 1.

    Raises:
        InputError: Names the first row whose length is another by more than rounding.
    """
    sizes = np.linalg.norm(rows, axis=1)
    wrong = np.flatnonzero(np.abs(sizes - 1.0) > _UNIT)
    if wrong.size:
        row = int(wrong[0])
        text = f"{table.file}: row {row + 1}: the quaternion has length {sizes[row]:.6g}, not 1"
        raise InputError(text, hint="the order is qw, qx, qy, qz")
    return np.asarray(rows / sizes[:, None])
