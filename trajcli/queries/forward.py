"""Forward kinematics of streams: poses and Jacobians for each row of joint values of a CSV."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from trajcli.columns import Column, Group, columns_of, kinds_of, parse_column
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.geometry.rotation import quaternion_from_matrix, without_jumps
from trajcli.kinematics.dexterity import dexterity
from trajcli.kinematics.forward import forward
from trajcli.kinematics.jacobian import ReferenceFrame, jacobian
from trajcli.language.numbers import LARGEST_POSITION
from trajcli.queries.arm import ArmInUnits, LimitWatch
from trajcli.streams.decimals import DECIMALS
from trajcli.streams.joint_columns import JointColumns, joint_columns
from trajcli.streams.table import TableBlocks

_HALF = 0.5 * 10.0**-DECIMALS  # a joint that rests at its limit may be rounded beyond it


class Stream(NamedTuple):
    """Rows that are computed block by block, on demand.

    Attributes:
        columns: The m columns.
        blocks: Each of shape (N, m).
    """

    columns: tuple[Column, ...]
    blocks: Iterator[Array]


def refuse_far(values: Array, file: str) -> None:
    """Refuse rows that hold what no robot reaches.

    Args:
        values: Any shape, SI.
        file: Where they stand.

    Raises:
        InputError: Names the largest.
    """
    largest = float(np.abs(values).max(initial=0.0))
    if largest > LARGEST_POSITION:
        message = f"expected a magnitude of at most {LARGEST_POSITION:g} (rad, m), got {largest:.9g}"
        raise InputError(f"{file}: {message}", hint="check its exponent and its unit")


def poses_of(arm: ArmInUnits, rows: TableBlocks, watch: LimitWatch) -> Stream:
    """Return t, where there is one, and the tcp's pose (x y z qw qx qy qz) for each row of joint values.

    Lengths are in the arm's unit, which the names say. The sign of the quaternion is such that it never
    jumps from row to row, and that w >= 0 in the first.

    Args:
        arm: The arm.
        rows: With a column for each joint.
        watch: Sees the joint values as their rows are taken.

    Raises:
        InputError: When a joint has no column, or one of another unit; when taken, if a row is wrong.
    """
    inputs = joint_columns(arm.robot, rows.names, rows.file)
    groups: tuple[Group, ...] = ("pose",) if inputs.time is None else ("t", "pose")
    columns = columns_of(groups, arm.robot.joint_types, arm.units)
    return Stream(columns, _poses(arm, rows, inputs, watch))


def _poses(arm: ArmInUnits, rows: TableBlocks, inputs: JointColumns, watch: LimitWatch) -> Iterator[Array]:
    last = None
    found = {column.kind: (i, column.factor) for i, column in enumerate(map(parse_column, rows.names))}
    axes = [found[axis] for axis in "xyz"] if found.keys() >= {*kinds_of("pose")} else []
    for block in rows.blocks:
        q = inputs.values(block)
        refuse_far(q, rows.file)
        times = None if inputs.time is None else block[:, inputs.time]
        watch.see(q, inputs.factors, inputs.units, times, _HALF)
        poses = forward(arm.robot, q)
        quaternions = without_jumps(quaternion_from_matrix(poses[:, :3, :3]), last)
        last = quaternions[-1]
        if axes:
            stated = np.stack([block[:, i] * unit for i, unit in axes], axis=1)
            if watch.frame is not None:
                stated = stated @ watch.frame[:3, :3].T + watch.frame[:3, 3]
            off = float(np.linalg.norm(stated - poses[:, :3, 3], axis=1).max())
            watch.tool_off = max(watch.tool_off, off)
        yield np.hstack([inputs.times(block), poses[:, :3, 3] / arm.length_factor, quaternions])


def jacobians_of(arm: ArmInUnits, rows: TableBlocks, frame: ReferenceFrame, watch: LimitWatch) -> Stream:
    """Return t, where there is one, measures and the Jacobian, row by row, for each row of joint values.

    All is in SI: manipulability; inverse_condition, the smallest over the largest singular value of the
    scaled Jacobian, zero where it loses rank; J11 to J6n.

    Args:
        arm: The arm.
        rows: With a column for each joint.
        frame: In whose axes the Jacobian stands.
        watch: Sees the joint values as their rows are taken.

    Raises:
        InputError: As `poses_of`.
    """
    inputs = joint_columns(arm.robot, rows.names, rows.file)
    entries = [f"J{i}{j}" for i in range(1, 7) for j in range(1, len(arm.robot.joints) + 1)]
    time = [] if inputs.time is None else ["t"]
    columns = map(parse_column, [*time, "manipulability", "inverse_condition", *entries])
    return Stream(tuple(columns), _jacobians(arm, rows, inputs, frame, watch))


def _jacobians(
    arm: ArmInUnits,
    rows: TableBlocks,
    inputs: JointColumns,
    frame: ReferenceFrame,
    watch: LimitWatch,
) -> Iterator[Array]:
    for block in rows.blocks:
        q = inputs.values(block)
        refuse_far(q, rows.file)
        watch.see(q, inputs.factors, inputs.units)
        measures = dexterity(arm.robot, q)
        entries = jacobian(arm.robot, q, frame).reshape(len(q), -1)
        columns = np.stack([measures.manipulability, 1.0 / measures.condition], axis=1)
        yield np.hstack([inputs.times(block), columns, entries])
