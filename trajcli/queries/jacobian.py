"""Jacobian report of one configuration: matrix, dexterity and singular directions, in the user's units."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.kinematics.dexterity import dexterity, singular_directions
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.target import partial_target, ranks
from trajcli.kinematics.jacobian import ReferenceFrame, jacobian, jacobian_dot_qd
from trajcli.queries.arm import ArmInUnits
from trajcli.queries.pose import plain

_DUST = 1e-12  # of a unit vector: what rounding leaves of a zero
_ALIKE = 9  # decimals by which sizes differ: which of two alike is the larger one, only rounding would say


def jacobian_report(
    arm: ArmInUnits, q: Array, frame: ReferenceFrame, qd: Array | None = None
) -> dict[str, Any]:
    """Return {jacobian, manipulability, condition, rank, position, singular_directions, idle_motions, ...}.

    With joint rates in rad and the arm's unit of length, `jacobian` (6, n) gives the tcp's linear velocity in
    that unit of length and its angular one in rad, by second, as textbooks do whatever the unit of angles is.
    `manipulability` is in m and rad; `condition` is of the Jacobian scaled by the arm's length, None where
    the rank is lost. `position` says of the linear rows alone their manipulability, in m, their rank, and
    their rank nearby. `singular_directions` are unit vectors u with u J = 0 for the J in m and rad:
    components of the velocity (v, w), in the axes of `frame`, that are zero for all joint rates.
    `idle_motions` are unit vectors of joint rates, in rad and m, that leave the tcp at rest.

    Args:
        arm: The arm.
        q: Joint values (n,), rad or m.
        frame: In whose axes everything is written.
        qd: Joint rates (n,), SI, for `jdot_qd`, the acceleration of the tcp while they do not change.

    Raises:
        InputError: When the arm has no geometry, or a value is not finite.
    """
    measures, lost = dexterity(arm.robot, q), singular_directions(arm.robot, q)
    condition = float(measures.condition)
    in_rad = replace(arm, units=replace(arm.units, angle="rad"))
    shown = jacobian(arm.robot, q, frame) * in_rad.joint_factors / in_rad.twist_factors[:, None]
    result = {
        "jacobian": plain(shown),
        "manipulability": float(measures.manipulability),
        "condition": condition if np.isfinite(condition) else None,
        "rank": int(measures.rank),
        "position": _of_position(arm, q),
        "singular_directions": plain(_directions(arm, q, frame, lost.blocked, lost.length)),
        "idle_motions": plain(simplest(lost.idle)),
    }
    if qd is not None:
        result["jdot_qd"] = plain(jacobian_dot_qd(arm.robot, q, qd, frame) / in_rad.twist_factors)
    return result


def _of_position(arm: ArmInUnits, q: Array) -> dict[str, Any]:
    """Return manipulability, rank and rank nearby of the position, which is singular where they differ."""
    (rank,), nearby = ranks(arm.robot, q[None], partial_target(np.zeros(3)))
    values = np.linalg.svd(jacobian(arm.robot, q)[:3], compute_uv=False)
    return {"manipulability": float(values[:nearby].prod()), "rank": int(rank), "nearby": nearby}


def _directions(arm: ArmInUnits, q: Array, frame: ReferenceFrame, blocked: Array, length: float) -> Array:
    axes = {"world": np.eye(3), "base": arm.robot.stand[:3, :3]}.get(frame)
    turn = forward(arm.robot, q)[:3, :3] if axes is None else axes
    return simplest(np.hstack([blocked[:, :3] / length @ turn, blocked[:, 3:] @ turn]))


def simplest(rows: Array) -> Array:
    """Return unit vectors (k, m) that span the space of `rows`, with the zeros that elimination gives.

    Their first component that is not zero is positive, whatever signs the rows have.
    """
    left = np.array(rows)
    done: list[int] = []
    for _ in range(len(left)):
        free = [i for i in range(len(left)) if i not in done]
        largest = int(np.round(np.abs(left[free]), _ALIKE).argmax())
        row, column = free[largest // left.shape[1]], largest % left.shape[1]
        left[row] /= left[row, column]
        others = [i for i in range(len(left)) if i != row]
        left[others] -= np.outer(left[others, column], left[row])
        done.append(row)
    left[np.abs(left) < _DUST] = 0.0
    first = np.array([np.argmax(row != 0.0) for row in left], dtype=np.intp)
    signs = np.sign(left[np.arange(len(left)), first])[:, None]
    unit: Array = left / (signs * np.linalg.norm(left, axis=1, keepdims=True))
    return unit[np.argsort(first, kind="stable")]
