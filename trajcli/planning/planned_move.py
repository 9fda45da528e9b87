"""One move: planned, within limits that its planner does not know, slowed, and in whole periods."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial, concatenate, constant
from trajcli.errors import InputError, PlanningError
from trajcli.frozen import frozen
from trajcli.job.read import LoadedJob
from trajcli.kinematics.robot import MountedTool, Robot
from trajcli.language.numbers import Model
from trajcli.language.targets import Target
from trajcli.limits.kinds import has_further_limits
from trajcli.limits.tolerances import JUMP_ABSOLUTE
from trajcli.planners.planner import PlannedMove, Planner, WhenOverLimit
from trajcli.trajectory import Promise, Span, State

if TYPE_CHECKING:
    from trajcli.kinematics.following.motion import ToolMotion
    from trajcli.planning.adaptation import Adaptation
    from trajcli.planning.resolve_poses import ResolvedPose


T = TypeVar("T")
_TRIES = 20  # durations of a move with its breaks on rows


@frozen
class Stand:
    """Where the arm stands before a move.

    Attributes:
        robot: With the tool in force.
        joints: Its joint values (n,), rad or m; None before the start.
        target: How the job gives that; None where it does not.
        points: The named points of the job.
    """

    robot: Robot
    joints: Array | None
    target: Target | None
    points: Mapping[str, Target]

    def placed(self, value: T) -> T:
        """Return a move, a target, or a list of them, with joints or a pose in each target that waits for it.

        Raises:
            InputError: When nothing stands yet, or the arm has no geometry.
        """
        if isinstance(value, Target):
            return self._target(value) if value.waits else value  # type: ignore[return-value]
        if isinstance(value, Model):
            fields = {name: getattr(value, name) for name in value.model_fields_set}
            new = {name: self.placed(field) for name, field in fields.items()}
            changed = {name: field for name, field in new.items() if field is not fields[name]}
            return value.model_copy(update=changed) if changed else value
        if isinstance(value, list | tuple) and any(isinstance(item, Model) for item in value):
            items = [self.placed(item) for item in value]
            same = all(new is old for new, old in zip(items, value, strict=True))
            return value if same else type(value)(items)
        return value

    def _target(self, target: Target) -> Target:
        if target.joints_by is not None:
            joints = tuple((self._joints() + np.array(target.joints_by)).tolist())
            return target.model_copy(update={"joints_by": None, "joints": joints})
        pose = self._pose(target)
        near: Target | None = target
        while near is not None and near.relative is not None:
            near = self.points.get(near.relative.origin)
        return target.model_copy(
            update={
                "relative": None,
                "near": None if near is None else near.joints,
                "xyz": tuple(pose[:3, 3].tolist()),
                "matrix": tuple(map(tuple, pose[:3, :3].tolist())),
            }
        )

    def _joints(self) -> Array:
        if self.joints is None:
            raise InputError("the start cannot be relative to where the arm stands", hint="give it as it is")
        return self.joints

    def _pose(self, target: Target) -> Array:
        if self.robot.convention is None:
            hint = "give its joints theta, d, a and alpha"
            raise InputError(
                f"{self.robot.name} has no geometry, so nothing is relative to its tool", hint=hint
            )
        if target.relative is not None:
            at_here = target.relative.origin == "here"
            return target.relative.after(
                self._here() if at_here else self._pose(self.points[target.relative.origin])
            )
        if target.gives_pose:
            return target.full_pose()
        from trajcli.kinematics.forward import forward

        joints = target.joints or (self._joints() + np.array(target.joints_by)).tolist()
        return forward(self.robot, np.array(joints))

    def _here(self) -> Array:
        """Return where the tool stands, (4, 4): as the job says it, where it gives a whole pose."""
        joints, given = self._joints(), self.target
        if given is not None and given.gives_position and given.rotation_form is not None:
            return given.full_pose()
        from trajcli.kinematics.forward import forward

        return forward(self.robot, joints)


@frozen
class KnownMoves:
    """Moves that are planned: the same motion in another round, or another plan, is planned once.

    Attributes:
        moves: By all that a motion depends on beside the job, each with how its pose is reached.
    """

    moves: dict[tuple[object, ...], tuple[PlannedMove, ResolvedPose | None]] = field(default_factory=dict)

    def move(
        self, index: int, motion: tuple[object, ...], poses: dict[int | None, ResolvedPose]
    ) -> PlannedMove | None:
        """Return a move that is the same motion as one before, its pose noted; None where none is."""
        found = self.moves.get(motion)
        if found is None:
            return None
        same, pose = found
        if pose is not None:
            poses[index] = pose
        return same if same.index == index else replace(same, index=index)


def with_tools(spans: Iterable[Span], moves: Iterable[PlannedMove], own: Robot) -> Iterator[Span]:
    """Yield the spans of moves with the tool that is on the flange then, where it is not the first one."""
    found: dict[tuple[bytes, object], MountedTool] = {}
    first = (own.tool.tobytes(), own.tool_load)
    for span, move in zip(spans, moves, strict=True):
        robot = move.robot
        key = (robot.tool.tobytes(), robot.tool_load)
        if key != first and key not in found:
            found[key] = MountedTool(robot.tool, robot.tool_load, robot.tool_name)
        yield replace(span, tool=found.get(key))


def handed_over(state: State, before: Planner | None, after: Planner) -> State:
    """Return the state in which `after` starts: the acceleration is handed over between continuity 2 only.

    Rates too small to be seen as a jump are rest.
    """
    smooth = before is None or (before.joins == 2 and after.joins == 2)
    velocity, acceleration = (
        np.where(np.abs(rates) <= JUMP_ABSOLUTE, 0.0, rates) for rates in (state.velocity, state.acceleration)
    )
    return State(state.position, velocity, acceleration if smooth else np.zeros_like(acceleration))


def promises_of(moves: Sequence[PlannedMove]) -> list[Promise]:
    """Return what each move says of itself; rounds that are the same motion say it once."""
    found: dict[tuple[object, ...], Promise] = {}
    promises = list[Promise]()
    for move in moves:
        key = id(move.planner), id(move.start), id(move.robot), id(move.planned), move.over_limit
        if key not in found:
            found[key] = move.promise
        promises.append(found[key])
    return promises


def path_of_tool(move: PlannedMove) -> ToolMotion | None:
    """Return the reference of the tool along its path, beside zones that of the part on it; None for none."""
    return next((part.tool for part in move.planned.parts if part.tool is not None), move.planned.tool)


def law_of_tool(move: PlannedMove) -> PiecewisePolynomial | None:
    """Return the time law s(t) of the tool along its path; while it turns in its place it has none."""
    tool = path_of_tool(move)
    return None if tool is None or tool.pure_rotation else law_of_path(move, tool)


def law_of_path(move: PlannedMove, tool: ToolMotion) -> PiecewisePolynomial:
    """Return the time law s(t) of a move whose tool follows its path as `tool` says, m or rad.

    In a zone, where the tool has no path, s stays as it is on its border.
    """
    parts = move.planned.parts
    if not parts:
        return tool.law
    (first, *_), (*_, last) = (ends[:, 0].tolist() for ends in tool.law.piece_ends())
    pieces = [tool.law.shifted(-tool.law.start)]
    if parts[0].around is not None:
        pieces.insert(0, constant([first], parts[0].end - parts[0].start))
    if parts[-1].around is not None:
        pieces.append(constant([last], parts[-1].end - parts[-1].start))
    return concatenate(pieces)


def placed(loaded: LoadedJob, value: T, robot: Robot, joints: Array | None, standing: Target | None) -> T:
    """Return a move or a target with joints or a pose in each target that waits for where the arm stands.

    Args:
        loaded: The job.
        value: The move or the target.
        robot: With the tool in force.
        joints: Where the arm stands, (n,), rad or m; None before the start.
        standing: How the job gives that; None where it does not.

    Raises:
        InputError: When nothing stands yet, or the arm has no geometry.
    """
    if not loaded.waits:
        return value
    return Stand(robot, joints, standing, loaded.job.points).placed(value)


def plan_move_within(
    loaded: LoadedJob,
    index: int,
    planner: Planner,
    start: State,
    robot: Robot,
    adapted: Adaptation | None = None,
) -> PlannedMove:
    """Return a move of a job, planned, and retimed as the job asks for.

    Args:
        loaded: The job.
        index: Of the move.
        planner: Of the move, its target by joints.
        start: State in which it begins.
        robot: With the limits in force.
        adapted: By what it is planned otherwise than its limits alone say.

    Raises:
        InputError: When it lacks a limit.
        PlanningError: When it has no curve.
    """
    job = loaded.job
    key = None if adapted is None else adapted.key(index, start)
    move = None if adapted is None else adapted.fastest.get(key)
    if move is None:
        move = _fastest(index, planner, start, robot, planner.when_over_limit or job.when_over_limit)
    if adapted is not None and not planner.handles:
        adapted.fastest[key] = move
        if move.over_limit == "slow":
            move = adapted.stretched(move)
            if adapted.period is not None:
                move = _on_rows(move, adapted.period) or move
    if job.output.align:
        from trajcli.planning.retime import align_to_period

        move = align_to_period(move, job.output.rate)
    if robot.limits.has_effort and not planner.handles:
        from trajcli.planning.retime import require_holdable

        require_holdable(move)
    return move


def _fastest(
    index: int, planner: Planner, start: State, robot: Robot, over_limit: WhenOverLimit
) -> PlannedMove:
    """Return a move as its planner and its limits make it, before anything is known of its rows."""
    try:
        move = PlannedMove(index, planner, start, robot, planner.plan(start, robot), over_limit)
    except PlanningError as error:
        if over_limit != "slow":
            raise
        from trajcli.planning.retime import long_enough

        move = long_enough(index, planner, start, robot, error)
    return _within_limits(move)


def _within_limits(move: PlannedMove) -> PlannedMove:
    """Return the move within limits that its planner does not know, and slowed where the job asks for it."""
    if has_further_limits(move.robot.limits):
        from trajcli.planning.retime import keep_further_limits

        move = keep_further_limits(move)
    if move.over_limit == "slow":
        from trajcli.planning.retime import slow_to_limits

        move = slow_to_limits(move)
    return move


def _on_rows(move: PlannedMove, period: float) -> PlannedMove | None:
    """Return the move with its breaks on rows, within all limits; None where its method has none."""
    least = move.duration
    for _ in range(_TRIES):
        planned = move.planner.on_rows(move.start, move.robot, period, least)
        if planned is None:
            return None
        other = replace(move, planned=replace(planned, events=move.planned.events))
        kept = _within_limits(other)
        if kept.duration == other.duration:
            return other
        if kept.duration <= least:  # by another law
            return None
        least = kept.duration
    return None
