"""Columns of joints: which column of a file in names of this tool holds which joint, and in what unit.

Names are those of `trajcli.columns`, `q1` and `q1_deg`, or those of the joints, `elbow` and `elbow_deg`.
What is called otherwise is read by `trajcli.streams.recorded`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from trajcli.columns import Column, parse_column
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, Place, Problem
from trajcli.kinematics.robot import Robot

_FROM_ZERO = re.compile(r"(?:qd{0,3}|tau)0(?:_deg|_mm)?")
_NO_JOINTS = ("t", "move")  # whatever joints are called


class JointColumns(NamedTuple):
    """Index of the time's column, and index, SI per unit and unit of each joint's column."""

    time: int | None
    joints: NDArray[np.intp]
    factors: Array
    units: list[str]

    def times(self, rows: Array) -> Array:
        """Return the times (N, 1), or (N, 0) where there are none."""
        return rows[:, :0] if self.time is None else rows[:, [self.time]]

    def values(self, rows: Array) -> Array:
        """Return joint values (N, n), rad or m: without a copy where they stand so in the rows."""
        first, count = int(self.joints[0]), len(self.joints)
        if (self.factors == 1.0).all() and (self.joints == np.arange(first, first + count)).all():
            return rows[:, first : first + count]
        return np.asarray(rows[:, self.joints] * self.factors)


def joint_columns(robot: Robot, names: Sequence[str], file: str, kind: str = "q") -> JointColumns:
    """Return where the values of the joints stand, or derivatives of them.

    Args:
        robot: With n joints.
        names: Of all columns.
        file: Its name, for messages.
        kind: "q", "qd", "qdd", "qddd" or "tau".

    Raises:
        InputError: When a joint has no such column or two, or one of another unit; when there is one of a
            joint beyond the last, or joints are counted from zero.
    """
    refuse_zero(names, file)
    by_joint: dict[int, tuple[int, Column]] = {}
    for index, column in _of_joints(robot, names, kind):
        flaw = _flaw(robot, names[index], column, by_joint, names)
        if flaw:
            raise _refused(names, file, index, *flaw)
        by_joint[column.joint or 0] = index, column
    missing = [f"{kind}{i + 1}" for i in range(len(robot.joints)) if i not in by_joint]
    if missing:
        message = f"{robot.name} has {len(robot.joints)} joints, and there is no column {', '.join(missing)}"
        hint = f"columns are called {kind}1 in SI, {kind}1_deg or {kind}1_mm otherwise"
        hint += converted(names, file, len(robot.joints))
        raise InputError(Problem(message, hint, Place(file, 1, 1, ",".join(names))))
    columns = [by_joint[i] for i in range(len(robot.joints))]
    indices = np.array([index for index, _ in columns])
    si = ["m" if kind == "prismatic" else "rad" for kind in robot.joint_types]
    units = [column.unit or plain for (_, column), plain in zip(columns, si, strict=True)]
    return JointColumns(
        time_column(names), indices, np.array([column.factor for _, column in columns]), units
    )


def time_column(names: Sequence[str]) -> int | None:
    """Return the index of the last column of times, s; None where there is none."""
    return next((k for k in reversed(range(len(names))) if names[k] == "t"), None)


def refuse_zero(names: Sequence[str], file: str) -> None:
    """Refuse a file that counts joints from zero, of which the first would be passed over.

    Raises:
        InputError: Names its column.
    """
    for index, name in enumerate(names):
        if _FROM_ZERO.fullmatch(name):
            message = f"{name}: joints are counted from 1, as q1, q2, ..."
            raise _refused(names, file, index, message, f"rename them{converted(names, file)}")


def converted(names: Sequence[str], file: str, joints: int | None = None) -> str:
    """Return the rest of an advice for a file in other names; empty where `convert` would not help.

    Args:
        names: Of all columns.
        file: Its name.
        joints: How many are needed; any unless given.
    """
    from trajcli.streams.recorded.column_roles import NamedFile, assign_roles

    try:
        roles = assign_roles(NamedFile(file, tuple(names), lambda _: None))
    except InputError:
        return ""
    helps = joints in (None, len(roles.joints["q"]))
    return "; `trajcli convert FILE --si` calls columns so" if helps else ""


def _of_joints(robot: Robot, names: Sequence[str], kind: str) -> Iterator[tuple[int, Column]]:
    """Yield index and column of each that is of a joint: by its number, or positions by the joint's name."""
    columns = [parse_column(name) for name in names]
    numbered = {column.joint for column in columns if column.kind == kind}
    for index, column in enumerate(columns):
        if column.kind == kind and column.joint is not None:
            yield index, column
        elif kind == "q" and column.kind in robot.joint_names and column.kind not in _NO_JOINTS:
            joint = robot.joint_names.index(column.kind)
            # beside q1 a column x is the tool's, whatever joints are called
            if column.quantity is None or joint not in numbered:
                yield index, Column("q", joint, column.unit)


def _flaw(
    robot: Robot, name: str, column: Column, by_joint: dict[int, tuple[int, Column]], names: Sequence[str]
) -> tuple[str, str | None] | None:
    joint = column.joint or 0
    count = len(robot.joints)
    if joint >= count:
        return f"{name} is the column of joint {joint + 1}, {robot.name} has {count} joints", None
    if joint in by_joint:
        return f"{name} and {names[by_joint[joint][0]]} are columns of the same joint", "leave one out"
    kind = robot.joint_types[joint]
    unit = "mm" if kind == "prismatic" else "deg"
    if column.unit not in (None, unit):
        message = f"{name} cannot be in {column.unit}: {robot.joint_names[joint]} is {kind}"
        return message, f"expected {column.kind}{joint + 1} or {column.kind}{joint + 1}_{unit}"
    return None


def _refused(names: Sequence[str], file: str, index: int, message: str, hint: str | None) -> InputError:
    start = len(",".join(names[:index])) + (2 if index else 1)
    return InputError(Problem(message, hint, Place(file, 1, start, ",".join(names), len(names[index]))))
