"""Moves of the tool along a path: what a target fixes, how the orientation changes, how the arm follows.

Source: Siciliano et al. (2009), section 4.3.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import replace
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, PrivateAttr

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, InputError, PlanningError, of_joint
from trajcli.frozen import frozen
from trajcli.geometry.paths.orientation import (
    AxisAngleOrientation,
    FixedOrientation,
    OrientationCurve,
    SegmentProgress,
    TangentOrientation,
)
from trajcli.geometry.paths.pose import PoseCurve, Screw
from trajcli.geometry.paths.position import PositionCurve
from trajcli.geometry.rotation import AXES, AxisName
from trajcli.kinematics.following.motion import motion_along
from trajcli.kinematics.following.tolerance import Tolerance
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.target import (
    IkTarget,
    OrientationConstraint,
    meeting,
    partial_target,
    residuals,
)
from trajcli.kinematics.jacobian import jacobian
from trajcli.kinematics.robot import Robot, ToolLimits
from trajcli.language.numbers import FieldPath, Flaw, Model, Number
from trajcli.language.poses import Configuration
from trajcli.language.targets import Target, ik_target
from trajcli.planners.planner import Event, Planned, Planner
from trajcli.planners.tool_path.follow import (
    JointMotion,
    UnreachablePathError,
    diagnosis_of_motion,
    followed,
    followed_in_time,
)
from trajcli.planners.tool_path.law import LawSpec, law_along
from trajcli.trajectory import State, resting
from trajcli.units import Quantity

if TYPE_CHECKING:
    from trajcli.kinematics.following.motion import ToolMotion
    from trajcli.planners.course import Course

Orientation = Literal["axis_angle", "euler", "fixed", "tangent"]

_WHOLE = (True, True, True)
_ALL_SIX = 6
_UPRIGHT = 1e-6  # rad from upright
_SAME = 1e-9  # of an entry of a matrix: two orientations that are meant to be one
REMEDIES = {
    "acceleration_jump": "use `law: {shape: quintic}` or jerk_limited, or say limits: {jerk: null} in the job"
}
_ARRIVED = 1e-5  # rad or m: joint values that are given, and reached on the path


class ToleranceSpec(Model):
    """How near the joints' curve must come to path and law; 1e-6 at most where the tool has limits."""

    position: Annotated[
        float,
        Number(Quantity("length"), "Of the tool's place; of its velocity a part of the peak.", above=0.0),
    ] = 1e-6
    angle: Annotated[
        float,
        Number(Quantity("angle"), "Of its orientation and of the joints, likewise.", above=0.0),
    ] = 1e-6

    @property
    def tolerance(self) -> Tolerance:
        """The same as a value of the kinematics."""
        return Tolerance(self.position, self.angle)


@frozen
class PlannedPath:
    """A path of the tool, and how the arm shall arrive at its end.

    Attributes:
        path: The poses.
        arrival: Joint values (n,) in which the target says that the arm arrives; None where it is a pose.
        configuration: Names of the branch on which it shall arrive; None where they do not matter.
        events: What was conceded.
        overlap: The motion itself where segments overlap in time; None where the law makes it from the path.
        targets: The fields of the move that name points of the path, each with its s, m or rad.
    """

    path: ToolPath
    arrival: Array | None = None
    configuration: Configuration | None = None
    events: tuple[Event, ...] = ()
    overlap: ToolMotion | None = None
    targets: tuple[tuple[FieldPath, float], ...] = ()


class ToolPathMove(Planner):
    """A move whose tool follows a path, from rest to rest, on the branch on which it starts."""

    continuity: ClassVar[Literal[1, 2]] = 1

    orientation: Annotated[
        Orientation,
        Field(
            description="axis_angle: the shortest rotation about a fixed axis; euler: evenly in the angles "
            "in which the target is given; fixed: none; tangent: the tool keeps its attitude to the path."
        ),
    ] = "axis_angle"
    law: LawSpec = LawSpec()
    tolerance: ToleranceSpec = ToleranceSpec()
    _origin: Target | None = PrivateAttr(default=None)

    def coming_from(self, origin: Target | None) -> Self:
        """Return the planner that knows how the job gives the pose in which the arm stands before it."""
        moved = self.model_copy()
        moved._origin = origin  # noqa: SLF001 - its own kind
        return moved

    smoother: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "`law: {shape: quintic}`": {"law": {"shape": "quintic"}},
        "jerk_limited": {"law": {"shape": "jerk_limited"}},
    }
    faster: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "`shape: time_optimal` under `law`": {"law": {"shape": "time_optimal"}},
    }

    def without_duration(self) -> tuple[float, Self] | None:
        """Return the duration of the law, s, and the move whose law finds it itself, if one is given."""
        given, free = self.law.duration, self.law.model_copy(update={"duration": None})
        return None if given is None else (given, self.model_copy(update={"law": free}))

    def lasting(self, duration: float) -> Iterator[tuple[str, Self]]:
        """Yield what the law may be given so that the move lasts `duration` seconds."""
        law = self.law
        names = ["duration"] if law.minimum_duration is None and law.takes_any_duration else []
        names += ["minimum_duration"] if law.duration is None else []
        for name in names:
            longer = law.model_copy(update={name: duration})
            yield f"`{name}: {duration:.12g}` under `law`", self.model_copy(update={"law": longer})

    @property
    def joins(self) -> Literal[1, 2]:
        """Acceleration joins where the law begins and ends without any."""
        return self.law.time_law.continuity

    @property
    def why_not_flown_by(self) -> str | None:
        """Why no motion can fly by a corner of this move; None where it can."""
        given = [name for name in ("duration", "minimum_duration") if getattr(self.law, name) is not None]
        return f"its law has a `{given[0]}`" if given else None

    def course(self, start: Array, robot: Robot, planned: Planned) -> Course:
        """Return the joints along the path, from joint values (n,).

        Raises:
            InputError: When the fields do not make a path.
            PlanningError: When there is no such path, or the arm cannot follow it.
        """
        from trajcli.planners.tool_path.course import ToolCourse

        del planned
        joints = followed(robot, self._pinned_path(start, robot).path, start)
        tolerance = self.tolerance.tolerance
        return ToolCourse(joints.by_s(tolerance), robot, joints, self.law, tolerance)

    @property
    def origin(self) -> Target | None:
        """How the job gives the pose in which the arm stands before the move; None where it does not."""
        return self._origin

    def path_from(self, before: Array, robot: Robot) -> PlannedPath:
        """Return the path of the tool from the pose `before` (4, 4).

        Raises:
            InputError: When the fields do not make a path.
            PlanningError: When there is no such path.
        """
        raise TypeError(f"{type(self).__name__} does not say where to go")

    def _pinned_path(self, start: Array, robot: Robot) -> PlannedPath:
        """Return the path from joint values (n,), with the joints that its target pins."""
        planned, target = self.path_from(forward(robot, start), robot), self.target
        if target is None or target.pinned is None:
            return planned
        from trajcli.kinematics.following.follower import with_pinned

        if planned.overlap is not None:
            hint = "leave `corner: overlap` out, or the joints"
            raise InputError("no joint is pinned where segments overlap in time", hint=hint)
        return replace(planned, path=with_pinned(planned.path, target.pinned.by_index, start, robot))

    def plan(self, start: State, robot: Robot) -> Planned:
        """Return the move along the path.

        Raises:
            InputError: When the robot has no geometry, or the fields do not make a path.
            MissingLimitError: When nothing says how fast.
            PlanningError: When there is no such path, or the arm cannot follow it; says where and why.
        """
        if robot.convention is None:
            hint = "give its joints theta, d, a and alpha"
            raise InputError(f"{robot.name} has no geometry, so its tool has no path", hint=hint)
        if not start.at_rest:
            from trajcli.planners.boundary_states import start_in_motion

            raise start_in_motion(self.tag, start, robot)
        planned = self._pinned_path(start.position, robot)
        if planned.path.length == 0:
            from trajcli.planners.boundary_states import standstill

            check_arrival(planned, start.position, robot)
            return standstill(start, self.law.duration or self.law.minimum_duration or 0.0, REMEDIES)
        try:
            joints = self._followed(planned, start.position, robot)
        except UnreachablePathError as error:
            raise _about_target(error, planned, robot) from None
        diagnosis = diagnosis_of_motion(robot, joints.motion)
        diagnosis.refuse_limits(joints.curve, max(self.tolerance.position, self.tolerance.angle))
        end = joints.curve.piece_ends()[1][-1]
        check_arrival(planned, end, robot)
        return Planned(
            joints.curve,
            resting(end),
            phases=joints.phases,
            tool=joints.motion,
            wanted_speed=_wanted_speed(self.law, robot.limits.tcp, planned.path),
            remedies=REMEDIES,
            events=(*planned.events, *joints.events),
            phase_plane=joints.phase_plane,
            continuity=joints.continuity,
        )

    def _followed(self, planned: PlannedPath, start: Array, robot: Robot) -> JointMotion:
        path, tolerance = planned.path, self.tolerance.tolerance
        if planned.overlap is not None:
            return JointMotion(followed_in_time(robot, planned.overlap, start), planned.overlap)
        if self.law.time_law.uses_joint_limits:
            from trajcli.planners.tool_path.time_optimal import fastest_along

            return fastest_along(followed(robot, path, start), self.law, tolerance, self.tag)
        joints = None if path.orientation == "all" else followed(robot, path, start)
        with nullcontext() if joints is None else joints.diagnosed():
            led = path if joints is None else joints.executed
            law, ruled_by = law_along(led, self.law, robot.limits.tcp, self.tag)
        motion = motion_along(path, law.law, law.breaks, tolerance, ruled_by)
        return JointMotion((joints or followed(robot, path, start)).by_time(motion), motion, law.phases)


def _about_target(error: PlanningError, planned: PlannedPath, robot: Robot) -> PlanningError:
    """Return the error of a path out of reach, with the field of the first target that is out of reach."""
    from trajcli.kinematics.inverse.solve import solve

    s = np.array([s for _, s in planned.targets])
    if not s.size:
        return PlanningError(*error.problems)
    missed = ~solve(robot, planned.path.at_s(s, "left").target(), None).valid.any(axis=-1)
    field = planned.targets[int(missed.argmax())][0] if missed.any() else None
    few = planned.arrival is not None and planned.path.orientation == "all" and len(robot.joints) < _ALL_SIX
    also = ", or give the target by `xyz` alone" * few
    return PlanningError(*(replace(each, field=field, hint=f"{each.hint}{also}") for each in error.problems))


def _wanted_speed(law: LawSpec, limits: ToolLimits, path: ToolPath) -> float | None:
    """Return the speed along the path that is asked for, m/s, or rad/s of a rotation; None where none is.

    Where limits step along the path, no one is.
    """
    if path.speeds is not None:
        return None
    angular = path.poses.pure_rotation
    given, limit = (law.angular_speed, limits.angular_speed) if angular else (law.speed, limits.speed)
    speed = limit if given is None else given
    return None if math.isinf(speed) or law.duration is not None else speed


def check_arrival(planned: PlannedPath, end: Array, robot: Robot) -> None:
    """Refuse to arrive in other joint values than the target names, or on another branch.

    Raises:
        PlanningError: Names the joint or the branch.
    """
    if planned.arrival is not None and np.abs(end - planned.arrival).max() > _ARRIVED:
        joint = int(np.abs(end - planned.arrival).argmax())
        message = "the tool arrives where the target says, but with {joint} at {value} instead of {wanted}"
        hint = "on a path the arm keeps its branch: go there in joint space, or give the target as a pose"
        ends = {"value": end, "wanted": planned.arrival}
        amounts = {key: Amount(float(joints[joint]), 0, joint) for key, joints in ends.items()}
        raise PlanningError(of_joint(robot.joint_names[joint], message, hint, amounts))
    configuration = planned.configuration
    wanted = {} if configuration is None else configuration.branch_names
    if configuration is not None and configuration.flags is not None:
        configuration.flags.require(robot, end)
    if not wanted:
        return
    from trajcli.kinematics.inverse.pinned_joints import solve_pinned

    target = planned.path.at_s(np.array([planned.path.length]), "left").target()
    answers = solve_pinned(robot, target, {pin.joint: pin.last for pin in planned.path.pinned}, end[None])
    apart = np.where(answers.valid[0], np.abs(answers.joints[0] - end).max(axis=-1), np.inf)
    names = answers.names[int(apart.argmin())]
    if any(getattr(names, choice) != word for choice, word in wanted.items()):
        message = f"the arm arrives in the configuration {names}, not {' '.join(wanted.values())}"
        hint = "on a path the arm keeps its branch: start in that configuration, or leave it out"
        raise PlanningError(message, hint=hint)


def flaws_of_target(target: Target, path: FieldPath, planner: str) -> Iterator[Flaw]:
    """Yield what is wrong with the target of a move along a path: it is a position or a pose, and at rest."""
    if not target.gives_joints_or_pose:
        yield path, f"{planner} needs a pose or `joints` in its target", None
    for name in ("velocity", "acceleration"):
        if any(getattr(target, name) or ()):
            yield (*path, name), f"{planner} ends at rest", "leave it out, or use a move in joint space"


@frozen
class ToolTarget:
    """A pose to go to, and what of it is fixed on the path there.

    Attributes:
        pose: T_world_tcp, shape (4, 4): what the target leaves free is as it was before.
        position: Which of x, y and z are fixed.
        orientation: What is fixed of the orientation.
        tool_axis: Which axis of the tcp is meant by direction, yaw and pitch.
        turn: Change of yaw or pitch on the path, rad; zero for other kinds.
        joints: Joint values (n,) that the target imposes; None where it is a pose.
        typed: The three angles (3,) that give the target, their sequence and frame; None if others do.
        kept: Whether the target says nothing of the orientation.
    """

    pose: Array
    position: tuple[bool, bool, bool]
    orientation: OrientationConstraint
    tool_axis: AxisName = "z"
    turn: float = 0.0
    joints: Array | None = None
    typed: tuple[Array, str, str] | None = None
    kept: bool = False


def kept_orientation(pose: Array, robot: Robot) -> ToolTarget:
    """Return the target of a pose with the orientation of before: free on an arm of less than six joints."""
    return ToolTarget(pose, _WHOLE, "all" if len(robot.joints) >= _ALL_SIX else "none", kept=True)


def tool_target(target: Target, before: Array, robot: Robot) -> ToolTarget:
    """Return what a target means for a tool that comes from the pose `before` (4, 4).

    A target without orientation keeps it; one without a position keeps that.
    """
    if target.joints is not None:
        joints = np.array(target.joints)
        decided = np.linalg.matrix_rank(jacobian(robot, joints)[:3]) == joints.size  # by the place alone
        return ToolTarget(forward(robot, joints), _WHOLE, "none" if decided else "all", joints=joints)
    goal = ik_target(target)
    position = goal.poses[:3, 3] if target.gives_position else before[:3, 3]
    if goal.orientation == "none":
        pose = before.copy()
        pose[:3, 3] = position
        return kept_orientation(pose, robot)
    _refuse_upright(goal, before)
    aims = None if goal.orientation == "all" else goal.aims
    kind = {"all": "rotation", "direction": "direction"}.get(goal.orientation, goal.orientation)
    given = goal.poses[:3, :3] if aims is None else aims if kind == "direction" else aims[0]
    whole = partial_target(position, **{kind: given}, tool_axis=goal.tool_axis).flat()  # type: ignore[arg-type]
    pose = meeting(whole, before[None])[0]
    turn = float(residuals(whole, before[None])[0, 3]) if kind in ("yaw", "pitch") else 0.0
    return ToolTarget(pose, _WHOLE, goal.orientation, goal.tool_axis, turn, typed=_typed(target))


def _refuse_upright(goal: IkTarget, before: Array) -> None:
    """Refuse a yaw or pitch from where the tool axis is upright: it has no heading to turn from."""
    if goal.orientation not in ("yaw", "pitch"):
        return
    axis = before[:3, AXES.index(goal.tool_axis)]
    if np.hypot(axis[0], axis[1]) <= _UPRIGHT:
        message = f"the {goal.tool_axis} axis of the tool is upright where the move starts: it has no heading"
        hint = f"say another `tool_axis`, or give the target's orientation without {goal.orientation}"
        raise PlanningError(message, hint=hint)


def _typed(target: Target) -> tuple[Array, str, str] | None:
    if target.euler is not None:
        return np.array(target.euler.angles), target.euler.sequence, target.euler.frame
    return None if target.rpy is None else (np.array(target.rpy), "XYZ", "fixed")


def orientation_along(
    how: Orientation,
    start: Array,
    targets: Sequence[ToolTarget],
    position: PositionCurve | None,
    progress: SegmentProgress | None,
    origin: Target | None = None,
) -> OrientationCurve:
    """Return R(s) from the orientation at the start through those of the targets.

    Args:
        how: The rule by which it changes.
        start: Shape (3, 3).
        targets: One for each segment.
        position: The path; None for a rotation alone.
        progress: How far each segment is done; None for a rotation alone: s is then the angle.
        origin: How the job gives the start; None where it does not.

    Raises:
        InputError: When the targets do not give what the rule needs.
        PlanningError: When they ask for another orientation than the rule gives.
    """
    rotations = np.stack([start, *(target.pose[:3, :3] for target in targets)])
    turns = float(np.abs(rotations - start).max())
    if how == "fixed":
        if turns > _SAME:
            message = "orientation: fixed keeps the orientation, but the target asks for another one"
            raise PlanningError(message, hint="leave the target's orientation out, or use axis_angle")
        return FixedOrientation(start, 0.0 if progress is None else progress.length)
    if how == "tangent":
        if position is None:
            message = "orientation: tangent needs a path, and the tool stays in its place"
            raise PlanningError(message, hint="use axis_angle")
        tangent = TangentOrientation(position, start)
        ends = tangent.evaluate(np.array([tangent.length]), "left")[0][0]
        if turns > _SAME or not (targets[-1].kept or np.abs(ends - rotations[-1]).max() <= _SAME):
            message = "orientation: tangent follows from the path, but the target asks for an orientation"
            raise PlanningError(message, hint="leave the target's orientation out, or use axis_angle")
        return tangent
    if how == "euler":
        return _even_in_angles(rotations, targets, progress, origin)
    if progress is None:
        return AxisAngleOrientation.between(*rotations)
    return AxisAngleOrientation(rotations, progress)


def _even_in_angles(
    rotations: Array, targets: Sequence[ToolTarget], progress: SegmentProgress | None, origin: Target | None
) -> OrientationCurve:
    """Return R(s) that goes evenly in the angles in which the targets are given.

    Angles beyond half a turn are meant as they are typed, and so are then those of the start.
    """
    from trajcli.geometry.paths.euler_interpolation import (
        angles_to_count_from,
        beyond_half_a_turn,
        euler_interpolation,
    )

    forms = {(typed[1], typed[2]) for target in targets if (typed := target.typed) is not None}
    if len(forms) != 1:
        what = "different angles" if forms else "no angles"
        message = f"orientation: euler goes evenly in the target's angles, and the targets have {what}"
        hint = "give each target `euler` of one sequence, or `rpy`, in world or a frame with its axes"
        raise InputError(message, hint=hint)
    sequence, frame = forms.pop()
    angles = [None, *(None if target.typed is None else target.typed[0] for target in targets)]
    first = None if origin is None else _typed(origin)
    started = None if first is None or first[1:] != (sequence, frame) else first[0]
    if beyond_half_a_turn([started, *angles]):
        nearest = next(row for row in angles if row is not None)
        angles[0] = angles_to_count_from(rotations[0], sequence, frame, nearest, started)  # type: ignore[arg-type]
    return euler_interpolation(rotations, progress, sequence, frame, angles)  # type: ignore[arg-type]


def path_to(
    position: PositionCurve, before: Array, target: ToolTarget, move: ToolPathMove, to: Target | None
) -> PlannedPath:
    """Return the path of a move along a curve from a pose (4, 4) to a target, which the job gives as `to`."""
    progress = SegmentProgress.even(position.length)
    start, how = before[:3, :3], move.orientation
    turning = orientation_along(how, start, [target], position, progress, move.origin)
    return path_of_poses(PoseCurve(position, turning), target, to, how)


def path_of_poses(
    poses: PoseCurve | Screw, target: ToolTarget, to: Target | None, orientation: Orientation = "axis_angle"
) -> PlannedPath:
    """Return the path with what its target fixes; an orientation that follows from it is fixed whole."""
    fixed = "all" if orientation == "tangent" else target.orientation
    path = ToolPath(poses, target.position, fixed, target.tool_axis, (target.turn,))
    configuration, targets = (None, ()) if to is None else (to.configuration, ((("to",), path.length),))
    return PlannedPath(path, target.joints, configuration, targets=targets)
