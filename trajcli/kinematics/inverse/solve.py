"""Inverse kinematics: every solution of a robot for its targets, by closed form or by search."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.geometry.rotation import AXES, Flags
from trajcli.kinematics.forward import configurations, forward
from trajcli.kinematics.inverse.answers import Answers, by_name, closures, polish, rough
from trajcli.kinematics.inverse.families.choose import method_for
from trajcli.kinematics.inverse.families.method import IkMethod, candidates
from trajcli.kinematics.inverse.families.screw_axes import PARALLEL, AxisGeometry, axis_geometry
from trajcli.kinematics.inverse.joint_turns import choose_turns
from trajcli.kinematics.inverse.solutions import Solutions
from trajcli.kinematics.inverse.target import IkTarget, partial_target, pose_target
from trajcli.kinematics.robot import Robot

if TYPE_CHECKING:
    from trajcli.kinematics.inverse.partial_targets import Postures

TOLERANCE = 1e-9  # m and rad: what a branch may miss its target by


def solve(
    robot: Robot, target: IkTarget | ArrayLike, near: ArrayLike | None = None, tolerance: float = TOLERANCE
) -> Solutions:
    """Return every configuration of a robot that meets its targets.

    Args:
        robot: Its base, tool and limits count.
        target: Poses T_world_tcp (*batch, 4, 4), or an `IkTarget` that fixes fewer coordinates.
        near: Joint values (*batch, n) or (n,), which decide between full turns of a joint, between points of
            a self-motion manifold, and between the solutions of a redundant arm; zero if absent.
        tolerance: What a valid branch may miss its target by, m and rad.

    Raises:
        InputError: When the robot has no geometry, a target or near is malformed, or the tolerance is not
            positive; or when a target gives the yaw of a tool axis that is always vertical.
    """
    if not tolerance > 0.0:
        raise InputError(f"the tolerance must be positive, it is {tolerance:.6g}")
    targets = target if isinstance(target, IkTarget) else pose_target(target)
    arm, flat = axis_geometry(robot), targets.flat()
    nearby = _near(robot, near, targets.batch)
    unturned = flat.orientation in ("direction", "yaw", "pitch") and _is_unturned(robot, arm, flat)
    answers = _answers(robot, arm, flat, nearby, tolerance)
    singular, free = _singular_and_free(robot, flat, answers, nearby, tolerance)
    # all are (n, branches, N); the closure (2, branches, N), flags (1, branches, N)
    by_joint = (answers.joints, answers.valid[None], answers.closure, singular[None], free)
    joints, valid, closure, is_singular, is_free = (_batch_first(array, targets.batch) for array in by_joint)
    bounds, fixed = robot.limits.position, flat.tool_axis if unturned else None
    return Solutions(
        answers.method, joints, valid[..., 0], closure, is_singular[..., 0], is_free, bounds, fixed
    )


def _singular_and_free(
    robot: Robot, target: IkTarget, answers: Answers, near: Array | None, tolerance: float
) -> tuple[Flags, Flags]:
    """Resolve suspects; return what is singular (branches, N) and which joints are free (n, branches, N)."""
    if answers.suspect.any():
        from trajcli.kinematics.inverse.searched import resolve_suspects

        return resolve_suspects(robot, target, answers, near, tolerance)
    free = answers.free[:, None, None] & answers.valid
    return np.zeros(answers.valid.shape, dtype=bool), free


def reached_if_turned(robot: Robot, target: IkTarget) -> bool:
    """Return whether one target is met within the limits where what it fixes of its orientation is free."""
    if target.orientation == "none" or not any(target.position):
        return target.orientation != "none"
    free = partial_target(target.flat().poses[0, :3, 3], fixed=target.position)
    return bool(solve(robot, free).within_limits.any())


def _answers(
    robot: Robot, arm: AxisGeometry, target: IkTarget, near: Array | None, tolerance: float
) -> Answers:
    method = method_for(robot)
    if method.solve is not None and method.held is None and fits(method, target, robot.base):
        return _by_closed_form(robot, arm, method, target, near, tolerance)
    from trajcli.kinematics.inverse.partial_targets import Postures, by_postures
    from trajcli.kinematics.inverse.searched import by_held_joint, by_search, numeric_instead

    if method.held is not None:
        return by_held_joint(robot, method, target, near, tolerance)
    if method.solve is None:
        return by_search(robot, method, target, near, tolerance)

    if method.needs == "pose":
        start = np.zeros((len(target.poses), len(arm.axes))) if near is None else near
        answers = by_postures(robot, arm, method, target, start, tolerance)
        if answers is not None:
            return answers
    answers = by_search(robot, numeric_instead(method, target), target, near, tolerance)
    return _with_names(answers, Postures(robot, arm, method, 1, target.tool_axis))


def _with_names(answers: Answers, postures: Postures) -> Answers:
    """Return the answers of a search sorted by the branches of the closed form for their whole poses."""
    columns, rows = np.nonzero(answers.valid)
    branch = np.full(answers.valid.shape, -1)
    if len(rows):
        joints = answers.joints[:, columns, rows].T
        branch[columns, rows] = postures.branch(joints, forward(postures.robot, joints))[0]
    return by_name(answers, branch, postures.method.branches)


def _batch_first(array: NDArray[Any], batch: tuple[int, ...]) -> NDArray[Any]:
    """Return (k, branches, N) as a view (*batch, branches, k)."""
    shaped = array.reshape(*array.shape[:2], *batch)
    return shaped.transpose(*range(2, shaped.ndim), 1, 0)


def fits(method: IkMethod, target: IkTarget, base: Array) -> bool:
    """Return whether a closed form answers targets of this kind, with T_world_base (4, 4)."""
    if method.needs == "pose":
        return target.whole
    idle = np.zeros(3) if method.idle is None else base[:3, :3] @ np.array(method.idle)
    unfixed = ~np.array(target.position)
    return not unfixed.any() or bool(np.abs(idle[unfixed]).min() >= 1.0 - PARALLEL)


def _near(robot: Robot, near: ArrayLike | None, batch: tuple[int, ...]) -> Array | None:
    if near is None:
        return None
    values = configurations(robot, near, "the configuration to be near to")
    return np.broadcast_to(values, (*batch, values.shape[-1])).reshape(-1, values.shape[-1])


def _is_unturned(robot: Robot, arm: AxisGeometry, target: IkTarget) -> bool:
    """Return whether no joint turns the tool axis that a target means."""
    from trajcli.kinematics.inverse.tool_axis import always_vertical, fixed_axis

    unturned = fixed_axis(arm, target.tool_axis)
    if unturned and target.orientation == "yaw" and always_vertical(arm, target.tool_axis):
        others = " or ".join(axis for axis in AXES if axis != target.tool_axis)
        raise InputError(
            f"the {target.tool_axis} axis of the tool of {robot.name} is always vertical and has no yaw",
            hint=f"say which axis of the tool heads there, with `tool_axis: {others}`",
        )
    return unturned


def _by_closed_form(
    robot: Robot, arm: AxisGeometry, method: IkMethod, target: IkTarget, near: Array | None, tolerance: float
) -> Answers:
    count = len(target.poses)
    valid, poor = np.zeros((len(method.branches), count), dtype=bool), np.zeros(count, dtype=bool)

    def on_block(rows: slice, joints: Array, closure: Array) -> None:
        if not target.whole:
            closure[:] = closures(robot, target.rows(rows), joints)
        miss = np.maximum(closure[0], closure[1])
        valid[:, rows], poor[rows] = miss <= tolerance, rough(miss).any(axis=0)
        choose_turns(robot, joints, None if near is None else near[rows].T, np.pi)

    raw = candidates(robot, arm, method, target.poses, on_block)
    joints, closure, degenerate = raw.joints, raw.residuals, raw.degenerate
    rows = np.flatnonzero(poor | degenerate)
    if len(rows):
        polish(robot, target, joints, closure, degenerate, rows)
        valid[:, rows] = closure[:, :, rows].max(axis=0) <= tolerance
    if tolerance > TOLERANCE:  # branches that end where none meets the target exactly may be one
        degenerate |= (valid & (closure.max(axis=0) > TOLERANCE)).any(axis=0)
    missed = np.flatnonzero(~valid.any(axis=0))
    if len(missed):
        closure[..., missed] = closures(robot, target.rows(missed), joints[..., missed])
    return Answers(
        method, joints, closure, valid, degenerate, np.zeros(len(joints), dtype=bool), 0, closed_form=True
    )
