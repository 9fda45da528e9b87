"""Inverse kinematics of an arm some of whose joints are pinned: that of the arm of the other joints.

Pinned joints at the beginning of the chain, such as a rail, move its base, those at its end its tool: the
rows of the others stay as they are, and so do their closed form and the names of its branches. Where one is
pinned between others, the rows are made anew from the axes that are left.

Source: Denavit and Hartenberg (1955).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import PlanningError, Problem
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.solutions import Solutions
from trajcli.kinematics.inverse.solve import TOLERANCE, solve
from trajcli.kinematics.inverse.target import IkTarget
from trajcli.kinematics.robot import QUANTITIES, Joint, Limits, Robot


def solve_pinned(
    robot: Robot,
    target: IkTarget,
    pins: Mapping[int, float],
    near: Array | None,
    tolerance: float = TOLERANCE,
) -> Solutions:
    """Return every configuration of a robot that meets a target with some joints at given values.

    Args:
        robot: Its base, tool and limits count.
        target: One target, or several.
        pins: Values by the index of the joint, rad or m.
        near: Joint values (..., n), as for `solve`.
        tolerance: What an answer may miss the target by, m and rad.

    Raises:
        PlanningError: When every joint is pinned.
    """
    if not pins:
        return solve(robot, target, near, tolerance)
    others = [joint for joint in range(len(robot.joints)) if joint not in pins]
    if not others:
        raise PlanningError(Problem("every joint is pinned: nothing is left to be solved", "leave one out"))
    found = solve(without_pinned(robot, pins), target, None if near is None else near[..., others], tolerance)
    return replace(
        found,
        joints=_with_pins(found.joints, others, pins),
        free=_with_pins(found.free, others, dict.fromkeys(pins, 0.0)).astype(bool),
        bounds=robot.limits.position,
    )


def _with_pins(values: NDArray[np.generic], others: Sequence[int], pins: Mapping[int, float]) -> Array:
    """Return values of the other joints (..., k) with those of the pinned ones among them, (..., n)."""
    whole = np.empty((*values.shape[:-1], len(others) + len(pins)))
    whole[..., others] = values
    for joint, value in pins.items():
        whole[..., joint] = value
    return whole


def without_pinned(robot: Robot, pins: Mapping[int, float]) -> Robot:
    """Return the arm of the joints that are not pinned, which reaches the same poses.

    Args:
        robot: An arm with geometry.
        pins: Values by the index of the joint, rad or m; not of every joint.
    """
    others = [joint for joint in range(len(robot.joints)) if joint not in pins]
    first, last = others[0], others[-1]
    if len(others) == last - first + 1:
        base = _chain(robot, range(first), pins)
        tool = _chain(robot, range(last + 1, len(robot.joints)), pins)
        kept = replace(robot, base=robot.base @ base, tool=tool @ robot.tool)
        return replace(kept, joints=robot.joints[first : last + 1], limits=_limits(robot, others))
    return _with_new_rows(robot, others, pins)


def _chain(robot: Robot, joints: Sequence[int], pins: Mapping[int, float]) -> Array:
    """Return the pose (4, 4) behind the rows of some joints at their values."""
    if not len(joints):
        return np.eye(4)
    part = replace(
        robot,
        joints=tuple(robot.joints[joint] for joint in joints),
        limits=_limits(robot, joints),
        base=np.eye(4),
        tool=np.eye(4),
    )
    return forward(part, np.array([pins.get(joint, 0.0) for joint in joints]))


def _limits(robot: Robot, joints: Sequence[int]) -> Limits:
    return Limits(**{name: getattr(robot.limits, name)[list(joints)] for name in QUANTITIES})


def _with_new_rows(robot: Robot, others: Sequence[int], pins: Mapping[int, float]) -> Robot:
    """Return the arm of other joints with rows made from their axes."""
    from trajcli.kinematics.dh_rows import AxisInChain, dh_table

    axes, before = list[AxisInChain](), np.eye(4)
    for joint, frame in zip(others, _axis_frames(robot, others, pins), strict=True):
        own = robot.joints[joint]
        origin, axis = np.linalg.inv(before) @ frame, np.array([0.0, 0.0, float(own.sign)])
        axes.append(AxisInChain(own.type == "prismatic", origin, axis))
        before = frame
    whole = _chain(robot, range(len(robot.joints)), pins) @ robot.tool
    table = dh_table(axes, np.linalg.inv(before) @ whole)
    joints = tuple(
        Joint(robot.joints[joint].name, robot.joints[joint].type, *row[:4], beta=row[4])
        for joint, row in zip(others, table.rows, strict=True)
    )
    kept = replace(robot, base=robot.base @ table.base, tool=table.tool, convention="standard")
    return replace(kept, joints=joints, limits=_limits(robot, others))


def _axis_frames(robot: Robot, others: Sequence[int], pins: Mapping[int, float]) -> Iterator[Array]:
    """Yield a frame (4, 4) in the base whose z axis is that of each of some joints, all but pins at zero."""
    for joint in others:
        before = _chain(robot, range(joint), pins)
        if robot.convention == "standard":
            yield before
            continue
        own = robot.joints[joint]
        bare = replace(own, theta=0.0, d=0.0)
        arm = replace(robot, joints=(bare,), limits=_limits(robot, [joint]), base=before, tool=np.eye(4))
        yield forward(arm, np.zeros(1))
