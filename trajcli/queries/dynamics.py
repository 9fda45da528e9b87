"""Inverse dynamics of one state and of streams: efforts of the joints, and what they are made of."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from trajcli.columns import EFFORT, Group, columns_of, parse_column
from trajcli.curves.piecewise import Array
from trajcli.dynamics.newton_euler import InverseDynamics
from trajcli.queries.arm import ArmInUnits, LimitWatch
from trajcli.queries.forward import Stream, refuse_far
from trajcli.queries.pose import plain
from trajcli.streams.joint_columns import JointColumns, joint_columns
from trajcli.streams.table import TableBlocks

_RATES = ("qd", "qdd")


def dynamics_report(arm: ArmInUnits, q: Array, qd: Array, qdd: Array) -> dict[str, Any]:
    """Return {tau, gravity, mass_matrix, coriolis, friction}, in N m, N and kg m^2 whatever the units.

    tau = mass_matrix qdd + coriolis + gravity + friction: `coriolis` and `friction` are efforts (n,),
    `gravity` is tau at rest without friction, `mass_matrix` (n, n) includes the rotors.

    Args:
        arm: The arm, with gravity and what its tool carries.
        q: Joint values (n,), rad or m.
        qd: Their velocities, SI.
        qdd: Their accelerations, SI.

    Raises:
        InputError: When the arm has no geometry, a link no inertia, or a value is not finite.
    """
    dynamics = InverseDynamics(arm.robot)
    return {
        "tau": plain(dynamics.effort(q, qd, qdd)),
        "gravity": plain(dynamics.gravity_effort(q)),
        "mass_matrix": plain(dynamics.mass_matrix(q)),
        "coriolis": plain(dynamics.coriolis(q, qd)),
        "friction": plain(dynamics.friction(qd)),
    }


def efforts_of(arm: ArmInUnits, rows: TableBlocks, watch: LimitWatch) -> Stream:
    """Return t, where there is one, and the efforts of the joints for each row of q, qd and qdd.

    Velocities and accelerations without any column are zero.

    Args:
        arm: The arm, with gravity and what its tool carries.
        rows: With a column for each joint.
        watch: Sees the joint values as their rows are taken.

    Raises:
        InputError: When a joint has no column, or one of another unit; when the arm has no inertias; when
            taken, if a row is wrong.
    """
    dynamics = InverseDynamics(arm.robot)
    names, file = rows.names, rows.file
    inputs = joint_columns(arm.robot, names, file)
    missing = left_out(rows)
    rates = [None if kind in missing else joint_columns(arm.robot, names, file, kind) for kind in _RATES]
    groups: tuple[Group, ...] = (EFFORT,) if inputs.time is None else ("t", EFFORT)
    columns = columns_of(groups, arm.robot.joint_types, arm.units)
    return Stream(columns, _efforts(dynamics, rows, inputs, rates, watch))


def left_out(rows: TableBlocks) -> tuple[str, ...]:
    """Return which of qd and qdd have no column, and count as zero."""
    kinds = {parse_column(name).kind for name in rows.names}
    return tuple(kind for kind in _RATES if kind not in kinds)


def _efforts(
    dynamics: InverseDynamics,
    rows: TableBlocks,
    inputs: JointColumns,
    rates: list[JointColumns | None],
    watch: LimitWatch,
) -> Iterator[Array]:
    for block in rows.blocks:
        q = inputs.values(block)
        motion = [np.zeros_like(q) if each is None else each.values(block) for each in rates]
        refuse_far(np.concatenate([q, *motion]), rows.file)
        watch.see(q, inputs.factors, inputs.units)
        yield np.hstack([inputs.times(block), dynamics.effort(q, *motion)])
