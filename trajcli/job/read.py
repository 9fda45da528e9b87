"""Reading of job files: YAML with places, then the robot, then everything else in SI."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from trajcli.columns import TOOL_COLUMNS
from trajcli.errors import Amount, Amounts, InputError, Place, Problem, utf8
from trajcli.frozen import frozen
from trajcli.job.limits import (
    flaws_of_dynamics,
    looser_bounds,
    looser_problem,
    looser_tool_bounds,
    with_job_limits,
)
from trajcli.job.model import Job
from trajcli.job.robot import RobotSheet, find_sheet
from trajcli.job.yaml.document import Node
from trajcli.job.yaml.load import Document, parse_document, read_document
from trajcli.kinematics.robot import GEOMETRY_HINT, Robot, unlimited
from trajcli.language.limits import JobLimitsSpec, LimitsSpec
from trajcli.language.numbers import FieldPath, FlawError, ReadingContext
from trajcli.language.poses import Pose
from trajcli.language.targets import PoseFields, Target
from trajcli.planners.planner import Event, Planner
from trajcli.trajectory import move_title
from trajcli.units import Units, amount_text, units_of

if TYPE_CHECKING:
    from trajcli.language.recorded import Recorded, RecordedPoses

_STRUCTURES = frozenset(("repeat", "call", "approach", "retreat"))
"""Keys of entries among the moves that stand for other moves."""
_GOALS = ("to", "through", "segments", "line", "arc")
"""Keys under which an entry of the moves says where it ends, the last first."""
_RECORDED = ("start", "through", "segments")
"""Keys under which a file of places may be named."""
_STAYS = frozenset(
    (
        "planner",
        "duration",
        "label",
        "limits",
        "when_over_limit",
        "zone",
        "attach",
        "detach",
        "tool",
        "signal",
        "value",
        "at",
        "defaults",
    )
)
"""Keys of entries that move nothing."""
_UNREAD = Robot("unread", (), unlimited(0), None, np.eye(4), np.eye(4))
"""Stands for a robot whose own flaws are known, while the rest of the job is read."""


@frozen
class LoadedJob:
    """A job that was read.

    Attributes:
        job: In SI.
        name: The job's own, or the file's stem.
        robot: With the job's limits in force.
        document: For the places of later errors.
        events: Concessions, such as a limit looser than the robot's.
        source: Where the numbers of the robot come from.
        has_far_angle: Whether a pose has an angle in rad that is probably meant in degrees.
        waits: Whether a target is relative to what only the plan knows.
    """

    job: Job
    name: str
    robot: Robot
    document: Document
    events: tuple[Event, ...]
    source: str = "the job"
    has_far_angle: bool = False
    waits: bool = False

    def __repr__(self) -> str:
        tags = ", ".join(move.tag for move in self.job.moves)
        return f"LoadedJob({self.name!r}, {self.robot.name}: {tags})"

    @property
    def units(self) -> Units:
        """Units of the file and of messages."""
        return self.job.units.as_units()

    @property
    def output_units(self) -> Units:
        """Units of the rows that are written: those of the file, unless the job says others."""
        given = self.job.output.units
        return Units(given.angle or self.units.angle, given.length or self.units.length)

    @property
    def robot_of_rows(self) -> Robot:
        """The robot as it stands in the frame in which the rows say where its tool is."""
        name = self.job.output.frame
        if name in (None, "world"):
            return self.robot
        return self.robot.seen_from(self.robot.stand if name == "base" else self.job.frames[name])

    def with_output(self, change: Mapping[str, Any]) -> LoadedJob:
        """Return the same job with other values of some fields of its output."""
        output = self.job.output.model_copy(update=change)
        return replace(self, job=self.job.model_copy(update={"output": output}))

    def say(self, amount: Amount) -> str:
        """Return a number of a message in the job's units."""
        return amount_text(amount, self.robot.joint_types, self.units)

    def point_meant(self, target: Target, path: FieldPath) -> str | None:
        """Return the name of the point that a target is, where the value at a path of the file names it."""
        named = {text for text in _texts(self.document.node(path)) if text in self.job.points}
        fields = PoseFields.model_fields
        return next(
            (
                name
                for name in sorted(named)
                if all(getattr(self.job.points[name], field) == getattr(target, field) for field in fields)
            ),
            None,
        )

    def start_meant(self) -> tuple[str, Place]:
        """Return by what name the start goes, and where it stands: there, or where its point is given."""
        named = self.document.node(("start",))
        point = None if named is None else named.value
        if isinstance(point, str) and point in self.job.points:
            return f"the start, point '{point}'", self.document.place(("points", point))
        return "the start", self.document.place(("start",))

    @property
    def move_count(self) -> int:
        """How many moves it has: what is attached or detached between them is none."""
        return sum(not move.handles for move in self.job.moves)

    def title(self, index: int) -> str:
        """Return the title of a move, such as "pick -> above_place (jerk_limited)"."""
        move = self.job.moves[index]
        return move_title(self.ends(index), move.caption, move.tag, self.document.round_of(index))

    def called(self, index: int) -> str:
        """Return by what a move goes in messages: its number, and its title."""
        title = self.title(index)
        return f"move {index}, {title}" if title.endswith(")") else f"move {index} ({title})"

    def ends(self, index: int) -> str:
        """Return the points between which a move goes, such as "pick -> place", or nothing."""
        goal = self._goal(("moves", index))
        if not goal:
            return ""
        before = index - 1
        while before >= 0 and self._goal(("moves", before)) is None:
            before -= 1
        origin = self._goal(("moves", before) if before >= 0 else ("start",))
        return f"{origin} -> {goal}" if origin else f"-> {goal}"

    def _goal(self, path: FieldPath) -> str | None:
        """Return the name of the point in which an entry ends: empty without one, None where it stays."""
        node: Node | None = self.document.node(path)
        moving = path == ("start",)
        while node is not None and not isinstance(node.value, str):
            if isinstance(node.value, list):
                node, moving = (node.value[-1] if node.value else None), True
                continue
            below = node.value if isinstance(node.value, dict) else {}
            key = next((key for key in _GOALS if key in below), None)
            moving = moving or key is not None or not _STAYS.issuperset(below)
            node = None if key is None else below[key]
        if node is not None and node.value in self.job.points:
            return self.document.without_round(str(node.value))
        return "" if moving else None

    def place_of_move(self, index: int) -> Place:
        """Return where a move stands in the file."""
        return self.document.place(("moves", index))


def load_job(
    path: str | Path,
    overrides: Sequence[str] = (),
    *,
    rate: str | None = None,
    rows: str | None = None,
    si: bool = False,
) -> LoadedJob:
    """Return the job of a file; `-` is standard input.

    Args:
        path: The file.
        overrides: Such as "moves.0.duration=3"; they replace what the file says, or add to it.
        rate: Replaces `output.rate`.
        rows: Replaces `output.rows`.
        si: Whether rows are in rad and m, whatever `output.units` says.

    Raises:
        InputError: With every flaw of the file at once.
        FileError: When it cannot be read.
    """
    if not overrides and rate is None and rows is None and not si:
        return _load(read_document(str(path)))
    from trajcli.job.override import Setting, overridden, parse_setting

    settings = [parse_setting(text) for text in overrides]
    if rate is not None:
        settings.append(Setting(f"--rate {rate}", ("output", "rate"), rate))
    if rows is not None:
        settings.append(Setting(f"--rows {rows}", ("output", "rows"), rows))
    if si:
        settings.append(Setting("--si", ("output", "units"), "{angle: rad, length: m}"))
    return _load(overridden(read_document(str(path)), settings))


def job_from_text(text: str, file: str = "<text>") -> LoadedJob:
    """Return the job of a text.

    Raises:
        InputError: With every flaw of the text at once.
    """
    return _load(parse_document(text, file))


def job_of_document(document: Document) -> LoadedJob:
    """Return the job of a document.

    Raises:
        InputError: With every flaw of the document at once.
        FileError: When a file that it names cannot be read.
    """
    return _load(document)


def files_of(document: Document) -> Iterator[tuple[str, str]]:
    """Yield the files that a job was read from: what each is, and its path; standard input is `-`."""
    standard = document.file in ("-", "<stdin>")
    yield "the job", "-" if standard else document.file
    folder = Path(document.file).parent
    root = document.plain()
    robot, sequences = root.get("robot"), root.get("sequences")
    while isinstance(robot, Mapping) and "arm" in robot:  # on a rail
        robot = robot["arm"]
    for key in ("file", "urdf"):
        if isinstance(robot, Mapping) and isinstance(robot.get(key), str):
            yield "the robot's file", str(folder / robot[key])
    limits = root.get("limits")
    if isinstance(limits, Mapping) and isinstance(limits.get("file"), str):
        yield "the file of limits", str(folder / limits["file"])
    lists = [[root], root.get("moves"), *(sequences.values() if isinstance(sequences, Mapping) else ())]
    recordings = dict.fromkeys(path for moves in lists for path in _recordings(moves))
    yield from (("the recording", str(folder / path)) for path in recordings)


def _recordings(moves: Any) -> Iterator[str]:  # noqa: ANN401
    """Yield the files of a start and of a list of moves, those that are repeated counted."""
    for move in moves if isinstance(moves, list) else []:
        places = [move.get(key) for key in _RECORDED] if isinstance(move, Mapping) else []
        yield from (at["csv"] for at in places if isinstance(at, Mapping) and isinstance(at.get("csv"), str))
        if isinstance(move, Mapping) and "repeat" in move:
            yield from _recordings(move.get("moves"))


def _load(document: Document) -> LoadedJob:
    units = units_of(_plain(document.node(("units",))))
    document = _expanded(document, units)
    plain = dict(document.plain())
    problems: list[Problem] = []
    sheet: RobotSheet | None = None
    if "robot" in plain:
        try:
            sheet = find_sheet(plain["robot"], document, units)
        except InputError as error:
            problems += error.problems
    robot = None if sheet is None else sheet.robot
    given = {"robot": robot or _UNREAD} if "robot" in plain else {}
    context = ReadingContext(units, points=_points(plain.get("points")))
    context.frames, context.tools = _points(plain.get("frames")), _points(plain.get("tools"))
    if robot is not None:
        context.base = _base(plain.get("base"), context, robot)
        context.joint_names, context.joint_types = robot.joint_names, robot.joint_types
    context.read_points = partial(_recorded, document, robot)
    context.read_poses = partial(_recorded_poses, document)
    try:
        job = Job.model_validate({**plain, **given}, context=context)
    except ValidationError as error:
        from trajcli.job.messages import problems_of

        problems += problems_of(error, Job, document)
    if problems or robot is None:
        raise InputError(*sorted(problems, key=_position))
    limits, noted = _with_limits_file(job.limits, document, robot)
    try:
        placed = replace(robot, gravity=np.array(job.gravity))
        placed = placed if job.base is None else placed.standing_at(job.base)
        placed = placed if job.tool is None else placed.with_tool(job.tool)
        effective, events = with_job_limits(placed, limits)
    except InputError as error:
        raise error.said_by(str).located(place=document.place(("limits", "position"))) from None
    name = job.name or ("stdin" if document.file in ("-", "<stdin>") else utf8(Path(document.file).stem))
    source = "the job" if sheet is None else sheet.source or _named_source(plain["robot"])
    said = () if sheet is None else _said_in_reading(sheet, context, document)
    events = [*noted, *said, *events, *_own_tool_replaced(job, robot, plain["robot"])]
    loaded = LoadedJob(
        job, name, effective, document, tuple(events), source, context.has_far_angle, context.waits
    )
    _require_no_flaws(loaded)
    return loaded


def _said_in_reading(sheet: RobotSheet, context: ReadingContext, document: Document) -> Iterator[Event]:
    """Yield what was taken for granted in reading a job and its robot."""
    if context.has_matrix or "matrix" in str(_plain(document.node(("robot",)))):
        from trajcli.job.messages import matrices_off_rotation

        yield from matrices_off_rotation(document)
    yield from (Event(kind, message) for kind, message in sheet.concessions)


def _own_tool_replaced(job: Job, robot: Robot, named: object) -> list[Event]:
    """Return the remark that an arm of the catalogue has its flange in the tool that a job replaces."""
    if job.tool is None or not isinstance(named, str) or np.array_equal(robot.tool, np.eye(4)):
        return []
    from trajcli.geometry.rotation import axis_angle_from_matrix

    turn = axis_angle_from_matrix(robot.tool[:3, :3])
    amounts: Amounts = {
        "robot": robot.name,
        "xyz": Amount(tuple(robot.tool[:3, 3].tolist()), dimension="length"),
        "rotvec": Amount(tuple((turn.axis * turn.angle).tolist()), dimension="angle"),
    }
    message = (
        "the tool of the job stands in place of that of {robot} itself, which leads from the last row of its "
        "table to its flange: a tool from there begins with xyz {xyz}, rotvec {rotvec}"
    )
    return [Event("own_tool_replaced", message, amounts=amounts)]


def _require_no_flaws(loaded: LoadedJob) -> None:
    """Refuse limits, columns and dynamics of a job that was read, and that do not fit its robot."""
    flaws = [
        *_loosened_by_moves(loaded),
        *_loosened_tool_limits(loaded),
        *_columns_without_geometry(loaded),
        *flaws_of_dynamics(loaded.job, loaded.robot, loaded.document),
    ]
    once: dict[Any, Problem] = {}
    for flaw in flaws:  # of a move that is written once, several rounds say the same
        once.setdefault((_position(flaw), flaw.joint, flaw.message), flaw)
    if flaws:
        raise InputError(*sorted(once.values(), key=_position))


def _expanded(document: Document, units: Units) -> Document:
    """Return the document with its repeats and calls written out; itself where it has none."""
    sections = document.root.value if isinstance(document.root.value, dict) else {}
    moves, *named = (
        sections[key].value if key in sections else None for key in ("moves", "points", "frames")
    )
    entries = [entry.value for entry in moves] if isinstance(moves, list) else []
    values = [node.value for some in named if isinstance(some, dict) for node in some.values()]
    if not (
        not sections.keys().isdisjoint(("sequences", "defaults"))
        or any(isinstance(entry, dict) and not entry.keys().isdisjoint(_STRUCTURES) for entry in entries)
        or any(map(_is_many, values))
    ):
        return document
    from trajcli.job.program.expand import expanded

    return expanded(document, units)


def _is_many(point: Any) -> bool:  # noqa: ANN401
    """Return whether a point is a grid or a list of names."""
    if isinstance(point, list):
        return any(isinstance(item.value, str) for item in point)
    return isinstance(point, dict) and "grid" in point


def _named_source(value: Any) -> str:  # noqa: ANN401
    """Return where a robot comes from whose file does not say it: the file that the job names, or the job."""
    return str(value["file"]) if isinstance(value, Mapping) and "file" in value else "the job"


def _with_limits_file(
    spec: JobLimitsSpec | None, document: Document, robot: Robot
) -> tuple[LimitsSpec | None, tuple[Event, ...]]:
    """Return the limits of a job with those of the file that it names, and what there is to note about it."""
    if spec is None or spec.file is None:
        return spec, ()
    from trajcli.job.files.moveit_limits import read_moveit_limits

    of_file = read_moveit_limits(spec.file, document, robot)
    return of_file.under(spec), of_file.events


def _plain(node: Node | None) -> Any:  # noqa: ANN401
    return None if node is None else node.plain()


def _texts(node: Node | None) -> Iterator[str]:
    value = None if node is None else node.value
    if isinstance(value, str):
        yield value
    for below in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        yield from _texts(below)


def _recorded(document: Document, robot: Robot | None, path: str) -> Recorded:
    """Return the recording of a path; jobs without one do not pay for the import."""
    if robot is None:
        from trajcli.language.recorded import Recorded

        return Recorded(np.zeros((1, 1)))
    from trajcli.job.files.recorded_values import read_recording

    return read_recording(path, document, robot)


def _recorded_poses(document: Document, path: str) -> RecordedPoses:
    from trajcli.job.files.recorded_values import read_poses

    return read_poses(path, document)


def _once(moves: Sequence[Planner]) -> Iterator[tuple[int, Planner]]:
    """Yield each move with its index, one that is repeated once."""
    seen: set[int] = set()
    for index, move in enumerate(moves):
        if id(move) not in seen:
            seen.add(id(move))
            yield index, move


def _loosened_by_moves(loaded: LoadedJob) -> Iterator[Problem]:
    robot = loaded.robot
    for index, move in _once(loaded.job.moves):
        for looser in looser_bounds(robot, move.limits) if move.limits is not None else ():
            problem = looser_problem(robot, looser, index)
            path = ("moves", index, "limits", looser.quantity)
            below = [(*path, key) for key in (robot.joint_names[looser.joint], looser.joint)]
            place = loaded.document.place(next(filter(loaded.document.node, below), path))
            yield replace(problem, message=problem.text(loaded.say), amounts={}, place=place)


def _loosened_tool_limits(loaded: LoadedJob) -> Iterator[Problem]:
    for index, move in _once(loaded.job.moves):
        for name, amounts in looser_tool_bounds(loaded.robot, move.limits) if move.limits is not None else ():
            place = loaded.document.place(("moves", index, "limits", "tcp", name))
            before, after = (loaded.say(amount) for amount in amounts)
            what = f"the {name.replace('_', ' ')} of the tool is {before}, got {after}"
            hint = "raise it under the job's `limits`"
            yield Problem(f"a move can only tighten limits: {what}", hint, place, move=index)


def _columns_without_geometry(loaded: LoadedJob) -> Iterator[Problem]:
    for index, group in enumerate(loaded.job.output.columns):
        if group in TOOL_COLUMNS and loaded.robot.convention is None:
            message = f"the columns '{group}' need a robot with geometry, {loaded.robot.name} has bare joints"
            yield Problem(message, GEOMETRY_HINT, loaded.document.place(("output", "columns", index)))


def _position(problem: Problem) -> tuple[str, int, int]:
    return (problem.place.file, problem.place.line, problem.place.column) if problem.place else ("", 0, 0)


def _base(value: Any, context: ReadingContext, robot: Robot) -> np.ndarray:  # noqa: ANN401
    """Return where the arm stands, as far as that is right; what is wrong is reported with the rest."""
    try:
        return robot.stand if value is None else Pose("").read(value, context)
    except FlawError:
        return robot.stand


def _points(value: Any) -> Mapping[str, Any]:  # noqa: ANN401
    return value if isinstance(value, Mapping) else {}
