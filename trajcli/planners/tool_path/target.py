"""What a target on a path of the tool fixes, seen from where the tool starts.

How the orientation changes along a path of the tool.

What a target of a move along a path of the tool may say.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, PlanningError
from trajcli.frozen import frozen
from trajcli.geometry.paths.orientation import (
    AxisAngleOrientation,
    FixedOrientation,
    OrientationCurve,
    SegmentProgress,
    TangentOrientation,
)
from trajcli.geometry.paths.position import PositionCurve
from trajcli.geometry.rotation import AXES, AxisName
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.target import (
    IkTarget,
    OrientationConstraint,
    meeting,
    partial_target,
    residuals,
)
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import FieldPath, Flaw
from trajcli.language.targets import Target, ik_target

_WHOLE = (True, True, True)
_ALL_SIX = 6
_UPRIGHT = 1e-6  # rad from upright


@frozen
class ToolTarget:
    """A pose to go to, and what of it is fixed on the way there.

    Attributes:
        pose: T_world_tcp, shape (4, 4): what the target leaves free is as it was before.
        position: Which of x, y and z are fixed.
        orientation: What is fixed of the orientation.
        tool_axis: Which axis of the tcp is meant by direction, yaw and pitch.
        turn: Change of yaw or pitch on the way, rad; zero for other kinds.
        joints: Joint values (n,) that the target imposes; None where it is a pose.
        typed: The three angles (3,) that give the target, their sequence and frame; None if others do.
    """

    pose: Array
    position: tuple[bool, bool, bool]
    orientation: OrientationConstraint
    tool_axis: AxisName = "z"
    turn: float = 0.0
    joints: Array | None = None
    typed: tuple[Array, str, str] | None = None


def tool_target(target: Target, before: Array, robot: Robot) -> ToolTarget:
    """Return what a target means for a tool that comes from the pose `before` (4, 4).

    A target without orientation leaves it free on an arm with fewer than six joints, and keeps it on others;
    one without a position keeps that.
    """
    if target.joints is not None:
        joints = np.array(target.joints)
        return ToolTarget(forward(robot, joints), _WHOLE, "all", joints=joints)
    goal = ik_target(target)
    position = goal.poses[:3, 3] if target.gives_position else before[:3, 3]
    if goal.orientation == "none":
        pose = before.copy()
        pose[:3, 3] = position
        return ToolTarget(pose, _WHOLE, "all" if len(robot.joints) >= _ALL_SIX else "none")
    _refuse_upright(goal, before)
    aims = None if goal.orientation == "all" else goal.aims
    kind = {"all": "rotation", "direction": "direction"}.get(goal.orientation, goal.orientation)
    given = goal.poses[:3, :3] if aims is None else aims if kind == "direction" else aims[0]
    whole = partial_target(position, **{kind: given}, tool_axis=goal.tool_axis).flat()  # type: ignore[arg-type]
    pose = meeting(whole, before[None])[0]
    turn = float(residuals(whole, before[None])[0, 3]) if kind in ("yaw", "pitch") else 0.0
    return ToolTarget(pose, _WHOLE, goal.orientation, goal.tool_axis, turn, typed=_typed(target))


def _refuse_upright(goal: IkTarget, before: Array) -> None:
    """Refuse a yaw or pitch from where the tool axis is upright: it has no heading to turn from.

    Raises:
        PlanningError: Names the axis.
    """
    if goal.orientation not in ("yaw", "pitch"):
        return
    axis = before[:3, AXES.index(goal.tool_axis)]
    if np.hypot(axis[0], axis[1]) <= _UPRIGHT:
        message = f"the {goal.tool_axis} axis of the tool is upright where the move starts: it has no heading"
        raise PlanningError(
            message,
            hint=f"say another `tool_axis`, or give the target's orientation without {goal.orientation}",
        )


def _typed(target: Target) -> tuple[Array, str, str] | None:
    if target.euler is not None:
        return np.array(target.euler.angles), target.euler.sequence, target.euler.frame
    return None if target.rpy is None else (np.array(target.rpy), "XYZ", "fixed")


Orientation = Literal["axis_angle", "euler", "fixed", "tangent"]

_SAME = 1e-9  # of an entry of a matrix: two orientations that are meant to be one


def orientation_along(
    how: Orientation,
    start: Array,
    targets: Sequence[ToolTarget],
    place: PositionCurve | None,
    progress: SegmentProgress | None,
) -> OrientationCurve:
    """Return R(s) from the orientation at the start through those of the targets.

    Args:
        how: The way.
        start: Shape (3, 3).
        targets: One for each segment.
        place: The path; None for a rotation alone.
        progress: How far each segment is done; None for a rotation alone: s is then the angle.

    Raises:
        InputError: When the targets do not give what the way needs.
        PlanningError: When they ask for another orientation than the way has.
    """
    rotations = np.stack([start, *(target.pose[:3, :3] for target in targets)])
    turns = float(np.abs(rotations - start).max())
    if how == "fixed":
        if turns > _SAME:
            message = "orientation: fixed keeps the orientation, but the target asks for another one"
            raise PlanningError(message, hint="leave the target's orientation out, or use axis_angle")
        return FixedOrientation(start, 0.0 if progress is None else progress.length)
    if how == "tangent":
        if turns > _SAME:
            message = "orientation: tangent follows from the path, but the target asks for an orientation"
            raise PlanningError(message, hint="leave the target's orientation out, or use axis_angle")
        if place is None:
            message = "orientation: tangent needs a path, and the tool stays in its place"
            raise PlanningError(message, hint="use axis_angle")
        return TangentOrientation(place, start)
    if how == "euler":
        return _even(rotations, targets, progress)
    return (
        AxisAngleOrientation.between(*rotations)
        if progress is None
        else AxisAngleOrientation(rotations, progress)
    )


def _even(
    rotations: Array, targets: Sequence[ToolTarget], progress: SegmentProgress | None
) -> OrientationCurve:
    from trajcli.geometry.paths.euler_interpolation import euler_interpolation

    forms = {(typed[1], typed[2]) for target in targets if (typed := target.typed) is not None}
    if len(forms) != 1:
        what = "different angles" if forms else "no angles"
        message = f"orientation: euler goes evenly in the target's angles, and the targets have {what}"
        raise InputError(message, hint="give each target `euler` of one sequence, or `rpy`")
    sequence, frame = forms.pop()
    known = [None, *(None if target.typed is None else target.typed[0] for target in targets)]
    return euler_interpolation(rotations, progress, sequence, frame, known)  # type: ignore[arg-type]


def flaws_of_target(target: Target, path: FieldPath, planner: str) -> Iterator[Flaw]:
    """Yield what is wrong with the target of a move along a path: it is a place, and at rest."""
    if not target.is_place:
        yield path, f"{planner} needs a pose or `joints` in its target", None
    for name in ("velocity", "acceleration"):
        if any(getattr(target, name) or ()):
            yield (*path, name), f"{planner} ends at rest", "leave it out, or use a move in joint space"
