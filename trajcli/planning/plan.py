"""Planning of a job: from its moves to a judged trajectory."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from trajcli.checks.verify import Verdict, verify
from trajcli.curves.piecewise import Array, concatenate
from trajcli.errors import (
    Amount,
    Amounts,
    InputError,
    MissingLimitError,
    Place,
    PlanningError,
    Problem,
    TrajcliError,
)
from trajcli.frozen import frozen
from trajcli.grids import NANOSECOND
from trajcli.job.limits import with_move_limits
from trajcli.job.read import LoadedJob
from trajcli.kinematics.robot import QUANTITIES, Payload, Robot
from trajcli.language.targets import Target
from trajcli.limits.tolerances import JUMP_ABSOLUTE
from trajcli.planners.planner import Event, PlannedMove, Planner, Resolve
from trajcli.planning.planned_move import (
    KnownMoves,
    handed_over,
    law_of_tool,
    placed,
    plan_move_within,
    promises_of,
    with_tools,
)
from trajcli.progress import report_progress
from trajcli.trajectory import State, Trajectory

if TYPE_CHECKING:
    from trajcli.planning.adaptation import Adaptation
    from trajcli.planning.flown_job import FlyBy
    from trajcli.planning.resolve_poses import ResolvedPose

Carried = Callable[[int, Payload | None], Payload | None]


@frozen
class Plan:
    """A planned and judged job.

    Attributes:
        loaded: The job.
        moves: Its moves, in order.
        trajectory: All of them, joined.
        verdict: Of the checks.
        events: Concessions, in order of the moves; the job's own first.
        remarks: How curves were computed, where that is worth a word; in the same order.
        flyby: What flying by corners gained; None where no zone is named.
        poses: How poses are reached, by the index of the move that goes there, or None for the job's start.
    """

    loaded: LoadedJob
    moves: tuple[PlannedMove, ...]
    trajectory: Trajectory
    verdict: Verdict
    events: tuple[Event, ...]
    poses: Mapping[int | None, ResolvedPose]
    remarks: tuple[Event, ...] = ()
    flyby: FlyBy | None = None

    def __repr__(self) -> str:
        moves, duration = self.loaded.move_count, self.trajectory.duration
        of_moves = f"{moves} move{'s' * (moves != 1)}"
        of_what = f"{self.loaded.name!r}, {self.loaded.robot.name}, {of_moves}"
        return f"{type(self).__name__}({of_what}, {duration:g} s, {self.verdict.text})"

    @property
    def unchecked(self) -> str:
        """What has no limit and is not checked, in words; beside efforts what is carried."""
        joints: dict[str, list[str]] = {}
        for joint, quantity in self.verdict.unchecked:
            joints.setdefault(quantity, []).append(joint)
        count = len(self.trajectory.joint_names)
        parts = {
            quantity: quantity if len(some) == count else f"{quantity} of {', '.join(some)}"
            for quantity, some in sorted(
                joints.items(), key=lambda item: (*QUANTITIES, "effort").index(item[0])
            )
        }
        if "effort" in parts:
            heaviest = max(span.payload.mass for span in self.trajectory.spans if span.payload is not None)
            parts["effort"] += f" with {heaviest:g} kg carried"
        return ", ".join(parts.values())


def plan_job(
    loaded: LoadedJob,
    carried: Carried | None = None,
    *,
    advise: bool = True,
    adapted: Adaptation | None = None,
    planned: KnownMoves | None = None,
) -> Plan:
    """Return the plan of a job, with its verdict: a verdict with findings is no error here.

    Args:
        loaded: The job.
        carried: What the tool carries in a move instead, by its index and what the job says.
        advise: Whether findings come with what would help, which is tried out.
        adapted: By what moves are planned otherwise than their limits alone say.
        planned: Moves of other plans of the job that need not be planned anew; those of this one are added.

    Raises:
        InputError: When a move loosens a limit, or lacks one it needs.
        PlanningError: When a move has no curve.
    """
    poses: dict[int | None, ResolvedPose] = {}
    corners = None
    if loaded.job.names_zones:
        from trajcli.planning.flown_job import flown_corners, flown_plan

        corners = flown_corners(loaded)  # one that cannot be is refused before anything is planned
    moves = _plan_moves(loaded, poses, carried, adapted, planned or KnownMoves())
    flyby, of_corners = None, list[Event]()
    if corners is not None:
        moves, flyby, of_corners = flown_plan(loaded, moves, corners, adapted)
    events = [*loaded.events, *_events_of(poses.get(None), None)]
    for move in moves:
        events += _events_of(poses.get(move.index), move.index)
        events += [replace(event, move=move.index) for event in move.planned.events]
        certificate = move.planned.certificate
        if certificate is not None:
            remark = certificate.remark(move.duration, move.robot.joint_names)
            events.append(replace(remark, move=move.index))
    events += of_corners
    hint = _unit_hint(loaded) if loaded.has_far_angle else None
    if hint is not None:
        events.append(Event("units", hint))
    trajectory = _trajectory_of(moves, loaded, _first_state(loaded, _first_moving(moves), events), flyby)
    if loaded.job.has_signals:
        from trajcli.planning.signals import signals_of

        trajectory = replace(trajectory, signals=signals_of(loaded, moves, trajectory, flyby))
    events += [*_ends_moving(loaded, moves), *_velocity_steps(trajectory)]
    report_progress("checking the trajectory")
    verdict = verify(trajectory, [move.robot.limits for move in moves], promises_of(moves))
    if advise and not verdict.passed:
        from trajcli.planning.advice import with_tested_advice

        verdict = _in_units(_with_unit_hint(with_tested_advice(verdict, moves, loaded.say), loaded), loaded)
    shown = tuple(replace(event, message=event.text(loaded.say), amounts={}) for event in events)
    conceded = tuple(event for event in shown if event.concedes)
    remarks = tuple(event for event in shown if not event.concedes)
    return Plan(loaded, tuple(moves), trajectory, verdict, conceded, poses, remarks, flyby)


def _plan_moves(
    loaded: LoadedJob,
    poses: dict[int | None, ResolvedPose],
    carried: Carried | None,
    adapted: Adaptation | None,
    planned: KnownMoves,
) -> list[PlannedMove]:
    """Return the moves of a job, and note how its poses are reached."""
    moves, lacking = list[PlannedMove](), list[Problem]()
    resolve = partial(_resolved, loaded=loaded, poses=poses, robot=loaded.robot)
    origin: Target | None
    standing: Target | None
    with _errors_at(loaded, loaded.document.place(("start",))):
        begin = origin = standing = placed(loaded, loaded.job.start, loaded.robot, None, None)
        state = resolve(begin, np.zeros(len(loaded.robot.joints)), index=None).as_state()
    robot, begun, aimed = loaded.robot, 0.0, 0  # the origin is the target of the planner of this id
    for index, planner in enumerate(loaded.job.moves):
        report_progress(f"planning {loaded.called(index)}")
        start = handed_over(state, loaded.job.moves[index - 1] if index else None, planner)
        robot = planner.equipped(robot)
        if planner.changes_tool:
            resolve, origin, standing = partial(resolve, robot=robot), None, None
        used = robot if carried is None else replace(robot, payload=carried(index, robot.payload))
        motion = (id(planner), aimed, start.bits, used.equipment)
        try:
            with _errors_of(loaded, index, planner, begun):
                there = placed(loaded, planner, robot, state.position, standing)
                move = _repeated(loaded, index, start, motion, planned, poses, adapted)
                if move is None:
                    reachable = there.with_joint_targets(partial(resolve, index=index), state.position)
                    with _points_of_errors(loaded, index):
                        move = _plan_move(loaded, used, index, reachable.coming_from(origin), start, adapted)
                    planned.moves[motion] = move, poses.get(index)
            moves.append(move)
            begun += float(move.planned.curve.breaks[-1])
            state = move.planned.end
        except MissingLimitError as error:
            lacking += error.problems
            end = _declared_end(there, partial(resolve, index=index), state)
            if end is None:
                break
            state = end
        except TrajcliError:
            if not lacking:
                raise
            break
        origin = there.target or origin
        aimed = id(planner) if planner.target is not None or planner.changes_tool else aimed
        standing = there.target or (standing if np.array_equal(state.position, start.position) else None)
    if lacking:
        raise MissingLimitError(*_without_repeats(lacking))
    _require_start_acceleration(loaded, moves)
    return moves


def _repeated(
    loaded: LoadedJob,
    index: int,
    start: State,
    motion: tuple[object, ...],
    planned: KnownMoves,
    poses: dict[int | None, ResolvedPose],
    adapted: Adaptation | None,
) -> PlannedMove | None:
    """Return a move that is the same motion as one before; None where none is."""
    move = planned.move(index, motion, poses) if adapted is None or adapted.changes_nothing else None
    if move is not None and adapted is not None:
        grid = (loaded.job.output.rate, loaded.job.output.align)
        adapted.note_repeated(planned.moves[motion][0].index, index, start, grid)
    return move


_TAKEN_UP = 1e-6  # rad/s^2 or m/s^2, and relative: what rounding leaves of an acceleration at the start


def _require_start_acceleration(loaded: LoadedJob, moves: Sequence[PlannedMove]) -> None:
    """Refuse a start with an acceleration that the first motion does not take up."""
    first = _first_moving(moves)
    wanted, curve = first.start.acceleration, first.planned.curve
    if wanted.any() and not np.allclose(curve.evaluate(curve.start, 2), wanted, _TAKEN_UP, _TAKEN_UP):
        hint = "use quintic or jerk_limited for the first move, or leave it out"
        message = f"{first.planner.tag} cannot start with an acceleration"
        place = loaded.document.place(("start",))
        raise InputError(Problem(message, hint, place=place))


def _declared_end(planner: Planner, resolve: Resolve, state: State) -> State | None:
    """Return the state in which a move that could not be planned would end, where the job says it."""
    target = planner.target
    if target is None or not target.gives_joints_or_pose:
        return None
    try:
        return resolve(target, state.position).as_state()
    except TrajcliError:
        return None


def _without_repeats(problems: Sequence[Problem]) -> Iterator[Problem]:
    """Yield the problems of moves without those that say of a later move what was said of one before."""
    alike: dict[tuple[str, str | None], list[Problem]] = {}
    for problem in problems:
        said = problem.message.partition(": ")[2]
        alike.setdefault((said, problem.hint), []).append(problem)
    for first, *more in alike.values():
        counted = f" (and {len(more)} more move{'s' * (len(more) > 1)} likewise)" if more else ""
        yield replace(first, message=first.message + counted)


def _resolved(
    target: Target,
    near: Array,
    *,
    loaded: LoadedJob,
    index: int | None,
    poses: dict[int | None, ResolvedPose],
    robot: Robot,
) -> Target:
    """Return the target with joints instead of a pose, and note how that is reached."""
    if not target.gives_pose:
        poses.pop(index, None)  # of the points of a move the last one counts
        return target
    from trajcli.planning.resolve_poses import resolve_pose

    try:
        near = near if target.near is None else np.array(target.near)
        resolved, poses[index] = resolve_pose(target, robot, near)
    except TrajcliError as error:
        name = loaded.point_meant(target, ("start",) if index is None else ("moves", index))
        if name is None:
            raise
        problems = (problem.within(f"the point '{name}'") for problem in error.problems)
        raise type(error)(*problems).located(place=loaded.document.place(("points", name))) from None
    return resolved


def _events_of(pose: ResolvedPose | None, index: int | None) -> list[Event]:
    if pose is None:
        return []
    from trajcli.planning.resolve_poses import branch_events

    events = [*pose.events, *(branch_events(pose) if index is None else ())]
    return [replace(event, move=index) for event in events]


def _plan_move(
    loaded: LoadedJob,
    carrying: Robot,
    index: int,
    planner: Planner,
    start: State,
    adapted: Adaptation | None,
) -> PlannedMove:
    """Return a move of the robot with what its tool carries then."""
    robot = with_move_limits(carrying, planner.limits, index)
    if adapted is None:
        return plan_move_within(loaded, index, planner, start, robot)
    from trajcli.planning.adaptation import without_bounds

    output = loaded.job.output
    key = adapted.whole_key(index, start, (output.rate, output.align))
    move = adapted.planned.get(key)
    if move is None:
        move = plan_move_within(loaded, index, planner, start, adapted.within(robot, index), adapted)
        if adapted.tightens(index):
            move = replace(move, robot=robot, planned=without_bounds(move.planned))
        adapted.planned[key] = move
    return move


def _ends_moving(loaded: LoadedJob, moves: Sequence[PlannedMove]) -> Iterator[Event]:
    """Yield the event of a trajectory that ends in motion although nobody says so."""
    last = next(move for move in reversed(moves) if not move.planner.handles)
    velocity = last.planned.end.velocity
    if not (last.planned.ends_open and velocity.any()):
        return
    joint = int(np.abs(velocity).argmax())
    message = "the trajectory ends in motion, {joint} with {velocity}"
    amounts: Amounts = {
        "joint": loaded.robot.joint_names[joint],
        "velocity": Amount(float(velocity[joint]), 1, joint),
    }
    yield Event("ends_moving", message, last.index, amounts)


_SEEN = 1e-6  # of a joint's largest velocity: a smaller change in a short ramp is none that rows show


def _velocity_steps(trajectory: Trajectory) -> Iterator[Event]:
    """Yield the event of ramps that are over before the next time that stamps can tell."""
    curve = trajectory.curve
    short = curve.lengths <= NANOSECOND
    if not short.any():
        return
    first, last = curve.piece_ends(1)
    steps = np.where(short[:, None], np.abs(last - first), 0.0)
    if not (steps > JUMP_ABSOLUTE + _SEEN * np.maximum(np.abs(first), np.abs(last)).max(axis=0)).any():
        return
    piece, joint = np.unravel_index(steps.argmax(), steps.shape)
    time, length = curve.breaks[piece] - curve.start, curve.lengths[piece]
    message = (
        f"the velocity of {{joint}} changes by {{step}} in {length:.3g} s, at t = {time:.6g} s: "
        f"in stamps of {NANOSECOND:g} s that is a step, and no row has its acceleration"
    )
    step = Amount(float(steps[piece, joint]), 1, int(joint))
    yield Event("velocity_step", message, None, {"joint": trajectory.joint_names[joint], "step": step})


def _first_moving(moves: Sequence[PlannedMove]) -> PlannedMove:
    return next(move for move in moves if not move.planner.handles)


def _first_state(loaded: LoadedJob, first: PlannedMove, events: list[Event]) -> State:
    """Return the state in which the trajectory starts.

    Where the job does not say how fast, and the first move's method leaves that open, it is the method's. So
    is the position in which a first blend begins that is centred on a point passed in motion.
    """
    begins, given = first.planned.begins, loaded.job.start.velocity
    if begins is None or (given is not None and not np.array_equal(begins.velocity, first.start.velocity)):
        return first.start
    name = first.robot.joint_names
    if given is None and begins.velocity.any():
        joint = int(np.abs(begins.velocity).argmax())
        message = "the trajectory begins in motion, {joint} with {velocity}"
        amounts: Amounts = {"joint": name[joint], "velocity": Amount(float(begins.velocity[joint]), 1, joint)}
        events.append(Event("begins_moving", message, first.index, amounts))
    apart = begins.position - first.start.position
    if apart.any():
        joint = int(np.abs(apart).argmax())
        message = "the trajectory begins before its first point, {joint} by {distance}"
        amounts = {"joint": name[joint], "distance": Amount(float(abs(apart[joint])), 0, joint)}
        events.append(Event("begins_before", message, first.index, amounts))
    return begins


def _trajectory_of(
    moves: list[PlannedMove], loaded: LoadedJob, first: State, flyby: FlyBy | None
) -> Trajectory:
    curve, spans, end = concatenate([move.planned.curve for move in moves]), [], 0.0
    for move in moves:
        start, end = end, float(move.planned.curve.breaks[-1] + end)
        of_round, ends = loaded.document.round_of(move.index), loaded.ends(move.index)
        spans.append(move.span(start, end, of_round, ends))
    if loaded.job.changes_tool:
        spans = [*with_tools(spans, moves, loaded.robot)]
    robot, last = loaded.robot, moves[-1].planned.end
    laws = tuple(law_of_tool(move) for move in moves)
    return Trajectory(
        curve,
        robot.joint_names,
        robot.joint_types,
        tuple(spans),
        first,
        last,
        laws,
        loaded.job.output.start_time,
        tuple((zone.entered, zone.left) for zone in flyby.zones) if flyby else (),
    )


@contextmanager
def _errors_of(loaded: LoadedJob, index: int, planner: Planner, begun: float) -> Iterator[None]:
    """Give errors the move they are about, its place, the job's units, and times since `begun`, s."""
    try:
        with _errors_at(loaded, loaded.place_of_move(index)):
            yield
    except TrajcliError as error:
        problems = (
            replace(
                problem.within(loaded.called(index)),
                move=index,
                time=None if problem.time is None else begun + problem.time,
            )
            for problem in error.problems
        )
        raise type(error)(*problems) from None


@contextmanager
def _points_of_errors(loaded: LoadedJob, index: int) -> Iterator[None]:
    """Give errors about a target of a move its place, or the name of its point and the place of that."""
    try:
        yield
    except (InputError, PlanningError) as error:
        raise type(error)(*(_about_point(loaded, index, problem) for problem in error.problems)) from None


def _about_point(loaded: LoadedJob, index: int, problem: Problem) -> Problem:
    if problem.field is None:
        return problem
    path = ("moves", index, *problem.field)
    node = loaded.document.node(path)
    if node is None or not isinstance(node.value, str) or node.value not in loaded.job.points:
        return replace(problem, place=loaded.document.place(path))
    place = loaded.document.place(("points", node.value))
    return replace(problem.within(f"the point '{node.value}'"), place=place)


@contextmanager
def _errors_at(loaded: LoadedJob, place: Place) -> Iterator[None]:
    """Give errors their place in the file, and the job's units."""
    try:
        yield
    except TrajcliError as error:
        said = error.said_by(loaded.say).located(place=place)
        hint = _unit_hint(loaded) if isinstance(error, PlanningError) else None
        if hint is None:
            raise said from None
        problems = (
            replace(problem, hint=f"{hint}; else {problem.hint}" if problem.hint else hint)
            for problem in said.problems
        )
        raise type(error)(*problems) from None


def _unit_hint(loaded: LoadedJob) -> str | None:
    from trajcli.planning.advice import unit_hint

    return unit_hint(loaded)


def _with_unit_hint(verdict: Verdict, loaded: LoadedJob) -> Verdict:
    """Return the verdict with a hint to the units where a position is beyond its limit because of them.

    Rates are then over their limits for the same reason.
    """
    beyond = any(finding.kind == "position" for finding in verdict.findings)
    hint = _unit_hint(loaded) if beyond else None
    if hint is None:
        return verdict
    findings = (replace(f, hint=hint) if f.kind in QUANTITIES else f for f in verdict.findings)
    return replace(verdict, findings=tuple(findings))


def _in_units(verdict: Verdict, loaded: LoadedJob) -> Verdict:
    return replace(verdict, findings=tuple(found.said_by(loaded.say) for found in verdict.findings))
