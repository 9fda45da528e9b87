"""Judgement of a file: what a job or a robot asks of the motion that it holds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, TrajcliError
from trajcli.findings import Finding
from trajcli.frozen import comparable, frozen
from trajcli.judge.judgement import Judgement, as_joined, as_planned, worst_first
from trajcli.judge.motion import JUDGED_ROWS, Requirements, judge_motion
from trajcli.kinematics.robot import Robot
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.reading import open_rows_of, refuse_job
from trajcli.streams.recorded.column_roles import note_of_unread
from trajcli.streams.recorded.column_units import columns_said, parse_units
from trajcli.streams.recorded_motion import MotionFile, RecordedMotion, motion_of, open_motion
from trajcli.units import Quantity, Units, amount_text, joint_quantity

if TYPE_CHECKING:
    from trajcli.consumers.judgement import ConsumerJudge
    from trajcli.job.read import LoadedJob
    from trajcli.judge.recorded_tool import ToolJudge
    from trajcli.judge.rows.planned_rows import RowComparison
    from trajcli.planning.plan import Plan

_MESSAGES = ("ros", "mcap")  # of knots, unless a table was converted to one
Delivered = Callable[["LoadedJob", str | None, str], "Plan"]
"""Returns the plan of a job for a consumer, by its profile (None for its own), as a format has it."""
_LARGEST_RATE = 1e9  # rows per second
_START_TOLERANCE = 1e-3  # rad or m: what a controller takes for the state that it is in
_STEP = 1e-6  # rad/s^2 or m/s^2: an acceleration that changes by more in the end steps there
_SAME_DURATION = 1e-6  # s: a file that lasts as long as the plan, within that, is taken for its motion
_NAMED = ("csv", "jsonl", "fields")  # formats with columns that are not about joints
_ENTIRE = ("jtc-upsampling",)  # interpolations that need all rows at once


@comparable
class CheckOptions:
    """What is said beside the file; see `trajcli check --help`."""

    job: str | None = None
    override: Sequence[str] = ()
    robot: str | None = None
    limits: str | None = None
    columns: str | None = None
    rate: str | None = None
    units: str | None = None
    topic: str | None = None
    field: str | None = None
    interpolate: str | None = None
    profile: str | None = None
    start_tolerance: str | None = None
    payload: str | None = None


@frozen
class CheckedFile:
    """A file with its judgement.

    Attributes:
        judgement: Of its motion.
        robot: With the limits that it was judged by.
        units: For people.
        plan: Of the job, where it has one.
        motion: The file, to read from anew.
    """

    judgement: Judgement
    robot: Robot
    units: Units
    plan: Plan | None
    motion: MotionFile


@frozen
class _Given:
    """What a job, or a robot, says of the motion."""

    robot: Robot
    units: Units
    events: tuple[str, ...]
    notes: tuple[str, ...] = ()
    loaded: LoadedJob | None = None
    plan: Plan | None = None
    shown: Units | None = None


def check_file(
    source: str | ByteSource,
    options: CheckOptions,
    plan: Plan | None = None,
    delivered: Delivered | None = None,
) -> CheckedFile:
    """Return the judgement of a file.

    Args:
        source: Its path; "-" is standard input. An opened one is read from its first byte on.
        options: What it is judged by.
        plan: Of a job that was planned before; the options then name no job and no robot.
        delivered: Returns the plan of a job for a consumer.

    Raises:
        InputError: When it is no motion, or options do not fit it or each other.
        FileError: When a file cannot be read.
    """
    opened = source if isinstance(source, ByteSource) else ByteSource(source, _rate_of(options.rate))
    if plan is None and options.job is None and options.robot is None:
        refuse_job(opened)
    given = _given(options) if plan is None else _of_plan(plan)
    planned_with = None
    if plan is None and delivered is not None:
        given, planned_with = _as_delivered(opened, given, options, delivered)
    given = _carrying(given, options)
    robot = given.robot
    motion = _opened(opened, options, given, _declared(options))
    shown = _said_units(options, given.shown or given.units)
    consumer = _consumer_of(options.profile, given)
    requirements = _requirements(options, given, shown, consumer)
    if consumer is not None and options.interpolate is None and consumer().profile.interpolation is not None:
        requirements = replace(requirements, interpolate=consumer().profile.interpolation)
    compared = _compared(opened, given, options)
    requirements = replace(requirements, planned=compared is not None and compared.planned)
    by_time = None if "move" in motion.quantities else moves_by_time(given.plan, motion.blocks())

    def blocks() -> Iterable[RecordedMotion]:
        entire = requirements.interpolate in _ENTIRE
        rows: Iterator[RecordedMotion] = iter((motion.whole(),)) if entire else motion.blocks(JUDGED_ROWS)
        return rows if by_time is None else map(by_time, rows)

    judgement = judge_motion(blocks, requirements)
    of_tool, read = _of_tool_columns(opened, options, given, motion, by_time, planned=requirements.planned)
    judgement = replace(judgement, findings=worst_first([*judgement.findings, *of_tool]))
    of_none = [name for name in motion.unread if name not in read and not requirements.planned]
    notes = (*motion.notes, *note_of_unread(of_none), *given.notes, *judgement.notes)
    if given.loaded is not None and "move" not in motion.quantities and by_time is None:
        notes = (*notes, "no column `move`: limits and paths of single moves are not judged")
    judged = replace(judgement, notes=notes, events=given.events, source=motion.source)
    judged = replace(_beside_plan(judged, compared, options), planned_with=planned_with)
    return CheckedFile(judged, robot, shown, given.plan, motion)


def _rate_of(word: str | None) -> float | None:
    """Return the rows per second of a file without time, where somebody says them."""
    if word is None:
        return None
    from trajcli.job.inline import inline_number

    rate = inline_number(word, "--rate", Quantity("ratio"), Units())
    if not 0 < rate <= _LARGEST_RATE:
        raise InputError(
            f"--rate: expected rows per second, above 0 and at most {_LARGEST_RATE:g}, got {word}"
        )
    return rate


def _as_delivered(
    source: ByteSource, given: _Given, options: CheckOptions, delivered: Delivered
) -> tuple[_Given, str | None]:
    """Return the same with the plan for the consumer whose rows these are, and the options that make it."""
    loaded = given.loaded
    if given.plan is None or loaded is None:
        return given, None
    asked: list[str | None] = [options.profile] if options.profile else []
    of_job = loaded.job.output.consumer
    if of_job and options.profile in (None, of_job):
        asked.append(None)  # what the job says of its rows counts, as it does not beside `--for`
    for name in asked:
        if (found := _made_for(source, given, options, delivered, (name, loaded))) is not None:
            return found, None
    if options.profile is None and (
        asked or (compared := _compared(source, given, options)) is None or compared.planned
    ):
        return given, None
    from trajcli.judge.rows.rows_for_consumers import consumers_of

    for made in consumers_of(source, given.plan, options.topic, options.field):
        if options.profile not in (None, made.profile):
            continue
        found = _made_for(source, given, options, delivered, (made.profile, made.loaded))
        if found is not None and found.plan is not None:
            return found, made.options(given.plan, found.plan)
    return given, None


def _made_for(
    source: ByteSource,
    given: _Given,
    options: CheckOptions,
    delivered: Delivered,
    consumer: tuple[str | None, LoadedJob],
) -> _Given | None:
    """Return what a job asks for a consumer, where the rows are those of that plan.

    Without one, what the job plans by itself is judged by its rules.
    """
    profile, loaded = consumer
    rows = open_rows_of(source, topic=options.topic, field=options.field, joints=len(given.robot.joints))
    for form in (rows.format, "csv") if rows.format in _MESSAGES else (rows.format,):
        try:
            with np.errstate(all="ignore"):
                found = _of_plan(delivered(loaded, profile, form))
        except TrajcliError:
            continue
        compared = _compared(source, found, options)
        if compared is not None and compared.planned:
            return found
    return None


def _opened(source: ByteSource, options: CheckOptions, given: _Given, declared: Units | None) -> MotionFile:
    """Return the motion of a file; joints that it does not have are found back from its poses."""
    joints, types = given.robot.joint_names, given.robot.joint_types
    named = (options.columns, options.topic, options.field)  # what one of them is about has joints
    if given.plan is not None and not any(named):
        from trajcli.judge.rows.tool_rows import joints_found_back

        said = parse_units(options.units)
        found = joints_found_back(source, given.plan.loaded.robot_of_rows, given.plan, said)
        if found is not None:
            return motion_of(found, joints=joints, joint_types=types)
    return open_motion(
        source,
        columns=options.columns,
        units=options.units,
        topic=options.topic,
        field=options.field,
        joints=joints,
        joint_types=types,
        declared=declared,
    )


def _compared(source: ByteSource, given: _Given, options: CheckOptions) -> RowComparison | None:
    """Return whether the rows are those of the motion that the job plans; None where it plans none."""
    if given.plan is None or not given.plan.verdict.passed:
        return None
    from trajcli.judge.rows.planned_rows import compare_with_plan

    said, mapped = parse_units(options.units), options.columns is not None
    read = _opened(source, options, given, _declared(options)).written_columns() if mapped else ()
    return compare_with_plan(source, given.plan, options.topic, options.field, said, read)


def _declared(options: CheckOptions) -> Units | None:
    """Return the units that a file of the job or of the robot states, where one is named."""
    from trajcli.queries.arm import stated_units

    name = options.job or options.robot
    return stated_units(name) if name else None


def _beside_plan(judgement: Judgement, found: RowComparison | None, options: CheckOptions) -> Judgement:
    """Return the judgement that says whether the rows are those of the motion that the job plans."""
    if found is None:
        return judgement
    if found.planned and options.interpolate is None and options.profile is None:
        return as_planned(judgement)
    if found.planned:
        return as_joined(judgement)
    note = f"these are no rows of the motion that the job plans: {found.difference}"
    return replace(judgement, notes=(*judgement.notes, note), planned_rows=False)


def _of_tool_columns(
    source: ByteSource,
    options: CheckOptions,
    given: _Given,
    motion: MotionFile,
    by_time: Callable[[RecordedMotion], RecordedMotion] | None,
    *,
    planned: bool,
) -> tuple[list[Finding], set[str]]:
    """Return what is wrong with the columns about the tool beside joints, and the names of those columns.

    Only a job says which tool it is; rows of its plan are compared with that as a whole.
    """
    if given.loaded is None or given.robot.convention is None or motion.format not in _NAMED:
        return [], set()
    from trajcli.judge.rows.tool_rows import ArmsOfMoves
    from trajcli.judge.tool_columns import judge_tool_columns, open_tool_table
    from trajcli.planning.planned_move import path_of_tool

    joints = len(given.robot.joints)
    rows = open_rows_of(source, topic=options.topic, field=options.field, joints=joints)
    said = parse_units(options.units)
    table = open_tool_table(rows, JUDGED_ROWS, said)
    if table is None:
        return [], set()
    columns = zip(rows.named.names, columns_said(rows.named.names, said), strict=True)
    read = {name for name, column in columns if column in table.columns}
    if planned:
        return [], read
    moves = () if given.plan is None else given.plan.moves
    paths = None if given.plan is None else {move.index: path_of_tool(move) for move in moves}
    blocks = motion.blocks(JUDGED_ROWS)
    seen = given.loaded.robot_of_rows
    return judge_tool_columns(
        blocks if by_time is None else map(by_time, blocks),
        table,
        ArmsOfMoves(given.robot, moves),
        paths,
        ArmsOfMoves(seen, moves),
    ), read


def moves_by_time(
    plan: Plan | None, blocks: Iterable[RecordedMotion]
) -> Callable[[RecordedMotion], RecordedMotion] | None:
    """Return what names the moves of rows of a file that does not: by the times of the plan.

    None where there is no plan, or the file does not last as long.

    Args:
        plan: Of the job.
        blocks: All rows of the file.
    """
    if plan is None:
        return None
    stamps = [(rows.t[0], rows.t[-1], rows.resolution.time) for rows in blocks]
    if not stamps:
        return None
    trajectory, rounding = plan.trajectory, stamps[0][2]
    first, last = float(stamps[0][0]), float(stamps[-1][1])
    alone = len(trajectory.spans) == 1
    if not alone and not abs(last - first - trajectory.duration) <= _SAME_DURATION + rounding:
        return None
    starts = np.array([span.start for span in trajectory.spans])
    indices = np.array([span.index for span in trajectory.spans], dtype=np.int64)

    def named(rows: RecordedMotion) -> RecordedMotion:
        since = rows.t - first + rounding + np.spacing(abs(last))
        later = np.searchsorted(starts, np.where(np.isfinite(since), since, 0.0), "right") - 1
        return replace(rows, move=indices[np.clip(later, 0, len(indices) - 1)])

    return named


def _given(options: CheckOptions) -> _Given:
    """Return what the job, or the robot and the limits say."""
    if options.job is not None:
        if options.robot is not None or options.limits is not None:
            other = "--robot" if options.robot is not None else "--limits"
            hint = "name one of them; --set limits.KEY=VALUE changes a limit of the job"
            raise InputError(f"--job says robot and limits itself, and {other} is given", hint=hint)
        return _of_job(options.job, options.override)
    if options.override:
        hint = "name the job with --job, or leave it out"
        raise InputError("--set overrides values of a job, and there is none", hint=hint)
    if options.robot is None:
        raise InputError(
            "what is the motion judged by?", hint="name a job with --job, or an arm with --robot"
        )
    if options.start_tolerance is not None:
        raise InputError(
            "--start-tolerance is about the start that a job says", hint="name it with --job, or leave it out"
        )
    from trajcli.queries.arm import open_sheet

    sheet = open_sheet(options.robot)
    if options.limits is None:
        return _Given(sheet.robot, sheet.units, ())
    from trajcli.job.limits_file import with_limits_file

    units = _said_units(options, Units())  # as in a job: rad and m, unless somebody says others
    robot, events = with_limits_file(sheet.robot, options.limits, units)
    say = partial(amount_text, joint_types=robot.joint_types, units=units)
    conceded = tuple(event.text(say) for event in events if event.concedes)
    return _Given(robot, sheet.units, conceded, shown=units)


def _of_job(path: str, overrides: Sequence[str]) -> _Given:
    """Return what a job says: its limits, and where it can be planned its paths, start and end."""
    from trajcli.job.read import load_job
    from trajcli.planning.plan import plan_job

    loaded = load_job(path, overrides)
    try:
        with np.errstate(all="ignore"):
            return _of_plan(plan_job(loaded))
    except TrajcliError as error:
        note = f"the job has no plan, so its paths, start and end are not judged: {error.problems[0].text()}"
        return _Given(loaded.robot, loaded.units, _conceded(loaded), (note,), loaded)


def _of_plan(plan: Plan) -> _Given:
    return _Given(plan.loaded.robot, plan.loaded.units, _conceded(plan.loaded), (), plan.loaded, plan)


def _conceded(loaded: LoadedJob) -> tuple[str, ...]:
    """Return what a job takes for granted."""
    return tuple(event.text(loaded.say) for event in loaded.events if event.concedes)


def _said_units(options: CheckOptions, default: Units) -> Units:
    """Return the units that somebody says for the file; what is left open is as by default."""
    said = parse_units(options.units)
    return Units(said.angle or default.angle, said.length or default.length)


def _carrying(given: _Given, options: CheckOptions) -> _Given:
    """Return the same with what the tool carries; the efforts that the arm states are then its limits."""
    if options.payload is None:
        return given
    if given.loaded is not None:
        hint = "the job says what is carried, by `attach`"
        raise InputError("--job and --payload exclude each other", hint=hint)
    from trajcli.dynamics.newton_euler import InverseDynamics
    from trajcli.job.inline import inline_payload
    from trajcli.job.limits import own_efforts

    payload = inline_payload(options.payload, _said_units(options, given.shown or given.units))
    robot = replace(given.robot, payload=payload)
    if not robot.limits.has_effort:
        robot = replace(robot, limits=replace(robot.limits, effort=own_efforts(robot)))
    if not robot.limits.has_effort:
        raise InputError(f"{robot.name} states no efforts", hint="give them with --limits: {effort: ...}")
    InverseDynamics(robot)  # refuses arms without inertias before anything is read
    return replace(given, robot=robot)


def _requirements(
    options: CheckOptions, given: _Given, units: Units, consumer: Callable[[], ConsumerJudge] | None
) -> Requirements:
    tool = _tool_of(given)
    if given.plan is None or given.loaded is None:
        arms = {} if given.loaded is None else _arms_of(given.loaded)
        return Requirements(given.robot, arms, options.interpolate, tool=tool, consumer=consumer)
    trajectory = given.plan.trajectory
    last = trajectory.curve.evaluate(trajectory.curve.end, 2, side="left")
    kept = (
        np.abs(last - trajectory.end.acceleration) <= _STEP
    )  # one that steps there is none that is promised
    tolerance = np.array(_tolerances(options.start_tolerance, given.robot, units))
    return Requirements(
        given.robot,
        {move.index: move.robot for move in given.plan.moves},
        options.interpolate,
        trajectory.start,
        tolerance,
        replace(trajectory.end, acceleration=np.where(kept, trajectory.end.acceleration, np.nan)),
        tool,
        consumer,
    )


def _arms_of(loaded: LoadedJob) -> dict[int, Robot]:
    """Return the arm of each move of a job that has no plan, with the limits in force and what it carries."""
    from trajcli.job.limits import with_move_limits

    arms, robot = {}, loaded.robot
    for index, planner in enumerate(loaded.job.moves):
        robot = planner.equipped(robot)
        arms[index] = with_move_limits(robot, planner.limits, index)
    return arms


def _tolerances(word: str | None, robot: Robot, units: Units) -> list[float]:
    """Return how near the first row must be, by joint, SI."""
    if word is None:
        return [_START_TOLERANCE] * len(robot.joints)
    from trajcli.job.inline import inline_number

    found = []
    for kind in robot.joint_types:
        value = inline_number(word, "--start-tolerance", joint_quantity(kind), units)
        if value < 0:
            raise InputError(f"--start-tolerance: expected a number of at least 0, got {word}")
        found.append(value)
    return found


def _tool_of(given: _Given) -> Callable[[], ToolJudge] | None:
    if given.robot.convention is None:
        return None
    from trajcli.judge.recorded_tool import ToolJudge, judge_of_moves

    if given.loaded is None:
        return lambda: ToolJudge(given.robot)
    moves = () if given.plan is None else given.plan.moves
    return lambda: judge_of_moves(given.robot, moves)


def _consumer_of(profile: str | None, given: _Given) -> Callable[[], ConsumerJudge] | None:
    if profile is None:
        return None
    from trajcli.consumers.judgement import ConsumerJudge

    start: Array | None = None if given.plan is None else given.plan.trajectory.start.position
    return lambda: ConsumerJudge(profile, given.robot, start)
