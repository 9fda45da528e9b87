"""Rows of the tool alone: joints found back from recorded poses, twists and accelerations.

Poses name their joints by inverse kinematics: of all answers within the limits the one nearest to the row
before, from the start that the job says. Twists and accelerations are then those of the joints by the inverse
of the Jacobian J: qd = J^-1 V, qdd = J^-1 (A - Jdot qd), where it has one.
"""

from __future__ import annotations

import numpy as np

from trajcli.columns import Column, kinds_of, parse_column
from trajcli.curves.piecewise import Array
from trajcli.kinematics.jacobian import jacobian, tcp_acceleration
from trajcli.kinematics.robot import Robot
from trajcli.queries.arm import ArmInUnits
from trajcli.queries.inverse_stream import joints_of
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.reading import open_rows_of
from trajcli.streams.recorded.column_roles import NamedFile
from trajcli.streams.row_sources import EXACT, ArrayRows, unplaced
from trajcli.streams.table import TableBlocks
from trajcli.units import Units

_TOLERANCE = 1e-6  # m and rad: what the answers may miss of rounded poses
_REGULAR = 1e3  # largest over smallest singular value: beyond it rates of the tool do not tell the joints'
_LOST = 1  # decimals of a pose that its joints do not have
_RATES_LOST = 3  # likewise of rates of the tool


def joints_found_back(source: ByteSource, robot: Robot, start: Array) -> ArrayRows | None:
    """Return rows of joints that take the tool through the poses of a file; None where it has other columns.

    Args:
        source: The file.
        robot: Whose tool it is, in world.
        start: Joints from which the first row is reached, rad or m, shape (n,).

    Raises:
        InputError: When the file cannot be read as rows.
        PlanningError: When a pose cannot be reached within the limits.
    """
    if robot.convention is None:
        return None
    rows = open_rows_of(source)
    columns = tuple(map(parse_column, rows.named.names))
    at = {column.kind: index for index, column in enumerate(columns)}
    if any(column.joint is not None for column in columns) or not {"t", "x", "y", "z"} <= at.keys():
        return None
    values = np.concatenate(list(rows.blocks(range(len(columns)), ())))
    poses = TableBlocks(rows.named.names, iter([values]), source.file)
    times_and_joints = np.concatenate(
        list(joints_of(ArmInUnits(robot, Units()), poses, start, _TOLERANCE).blocks)
    )
    decimals = rows.decimals(range(len(columns)))
    of_pose = int(decimals[at["x"]]) + (3 if columns[at["x"]].unit == "mm" else 0)
    q = times_and_joints[:, 1:]
    groups = [("q", q, of_pose - _LOST)]
    groups += [
        (kind, rates, of_pose - _RATES_LOST)
        for kind, rates in zip(("qd", "qdd"), _rates(robot, q, values, columns), strict=False)
    ]
    names, parts, written = ["t"], [times_and_joints[:, :1]], [int(decimals[at["t"]])]
    for kind, rates, digits in groups:
        names += [f"{kind}{joint + 1}" for joint in range(q.shape[1])]
        parts.append(rates)
        written += [digits if decimals[at["x"]] != EXACT else EXACT] * q.shape[1]
    if "move" in at:
        names.append("move")
        parts.append(values[:, [at["move"]]])
        written.append(0)
    note = "the joints are found back from the poses, from the job's start on"
    return ArrayRows(
        "csv",
        NamedFile(source.file, tuple(names), unplaced),
        np.concatenate(parts, axis=1),
        np.array(written, dtype=np.int64),
        np.zeros(len(names)),
        si=True,
        notes=(note,),
    )


def _rates(robot: Robot, q: Array, values: Array, columns: tuple[Column, ...]) -> list[Array]:
    """Return the rates of the joints (N, n) that the file's rates of the tool say, velocities first."""
    twist, twistd = (_of_group(group, values, columns) for group in ("twist", "twistd"))
    if twist is None or q.shape[1] != twist.shape[1]:
        return []
    slopes = jacobian(robot, q)
    if np.linalg.cond(slopes).max() > _REGULAR:
        return []
    qd: Array = np.asarray(np.linalg.solve(slopes, twist[..., None])[..., 0])
    if twistd is None:
        return [qd]
    bias = tcp_acceleration(robot, q, qd, np.zeros_like(qd))
    return [qd, np.asarray(np.linalg.solve(slopes, (twistd - bias)[..., None])[..., 0])]


def _of_group(group: str, values: Array, columns: tuple[Column, ...]) -> Array | None:
    """Return the columns of a group in SI, (N, 6); None where one is missing."""
    at = {column.kind: index for index, column in enumerate(columns)}
    kinds = kinds_of(group)
    if not set(kinds) <= at.keys():
        return None
    index = [at[kind] for kind in kinds]
    return np.asarray(values[:, index] * [columns[k].factor for k in index])
