"""Job model: the job file as pydantic models, in SI.

Units, names and per-joint forms are resolved while the file is read.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache
from itertools import pairwise
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import (
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    TypeAdapter,
    ValidationError,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from trajcli.columns import SIGNALS, Group
from trajcli.frozen import comparable
from trajcli.kinematics.robot import GRAVITY, MountedTool, Payload, Robot
from trajcli.language.dynamics import Gravity, NamedTool, ToolField
from trajcli.language.limits import JobLimitsSpec
from trajcli.language.numbers import (
    AT_KEY,
    NO_TRUTH,
    FieldType,
    FlawError,
    Model,
    Name,
    Number,
    PointName,
    ReadingContext,
    object_schema,
    refuse,
    shown,
)
from trajcli.language.per_joint import PerJoint
from trajcli.language.points import NamedTarget
from trajcli.language.poses import Pose
from trajcli.language.zones import ZoneField
from trajcli.planners import HANDLING, PLANNERS, Planner, defaults_of_paths, moves_adapter
from trajcli.planners.planner import WhenOverLimit
from trajcli.units import Quantity, Units

ROBOT_DEFINITION = "a robot"
"""Stands in a schema for the definition of a robot, which comes from another model."""
RAIL_DEFINITION = "an arm on a rail"
"""Stands in a schema for the definition of an arm on a rail, which comes from another model."""
CATALOGUE_NAME = "a name of the catalogue"
"""Stands in a schema for the names of the robots that come with trajcli."""


class UnitsSpec(Model):
    """Units of plain numbers."""

    angle: Annotated[Literal["rad", "deg"], Field(description="Unit of angles.")] = "rad"
    length: Annotated[Literal["m", "mm"], Field(description="Unit of lengths.")] = "m"

    def as_units(self) -> Units:
        """Return the plain value."""
        return Units(self.angle, self.length)


@comparable
class RobotSource(FieldType):
    """A robot, with which the loader has replaced what names it."""

    description: str = (
        "Name of a catalogue robot, {file: PATH}, {urdf: PATH}, the robot itself, or {rail: ..., arm: ...}."
    )

    def read(self, value: Any, context: ReadingContext) -> Robot:  # noqa: ANN401
        """Return the robot."""
        if isinstance(value, Robot):
            return value
        raise FlawError(f"expected a robot, got {shown(value)}")

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of the four forms."""
        file = {"file": {"type": "string", "description": "A robot file or a URDF, relative to the job."}}
        urdf = {
            "urdf": {"type": "string", "description": "A URDF, relative to the job."},
            "root": {"type": "string", "description": "Link where the chain begins; else the outermost."},
            "tip": {"type": "string", "description": "Link where the chain ends: the tcp; else chosen."},
            "exact": {"type": "boolean", "description": "Keep angles near right ones as they are."},
        }
        inline = {"$comment": ROBOT_DEFINITION}
        on_rail = {"$comment": RAIL_DEFINITION}
        of_file, of_urdf = object_schema(file, "file"), object_schema(urdf, "urdf")
        return {"anyOf": [{"$comment": CATALOGUE_NAME}, of_file, of_urdf, inline, on_rail]}


class _FirstRow:
    """Lets {csv: PATH} stand for a start: the first row of a recording."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:  # noqa: ANN401
        return core_schema.with_info_before_validator_function(self._read, handler(source))

    @staticmethod
    def _read(value: Any, info: core_schema.ValidationInfo) -> Any:  # noqa: ANN401
        context = info.context
        if not isinstance(value, Mapping) or "csv" not in value or context is None:
            return value
        try:
            return _first_row(value, context)
        except FlawError as error:
            raise refuse(error.flaws) from None

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        keys = {"csv": {"type": "string", "description": "A recording, relative to the job's folder."}}
        state = handler(schema)
        return {**state, "anyOf": [*state["anyOf"], object_schema(keys, "csv")]}


def _first_row(value: Mapping[str, Any], context: ReadingContext) -> dict[str, Any]:
    """Return the state of the first row of the file that `csv` names."""
    other = next((key for key in value if key != "csv"), None)
    if other is not None:
        raise FlawError(f"csv and {other} exclude each other", other, AT_KEY, hint="leave one of them out")
    if not isinstance(value["csv"], str):
        raise FlawError(f"expected the path of a file, got {shown(value['csv'])}", "csv")
    first = context.read_points(value["csv"]).positions[0]  # type: ignore[misc]
    return {"joints": PerJoint(0, "").write(tuple(first.tolist()), context)}


Seconds = Annotated[float, Number(Quantity("time"), "Time, s.")]


class OutputUnits(Model):
    """Units of the columns that are written, where they are not those of the job."""

    angle: Annotated[
        Literal["rad", "deg"] | None, Field(description="Unit of angles; left out: the job's.")
    ] = None
    length: Annotated[
        Literal["m", "mm"] | None, Field(description="Unit of lengths; left out: the job's.")
    ] = None


class Output(Model):
    """Which rows and columns are written."""

    units: Annotated[
        OutputUnits, Field(description="Units of the columns; what is left out is the job's.")
    ] = OutputUnits()
    rate: Annotated[float, Number(Quantity("frequency"), "Rows per second, Hz.", above=0.0)] = 1000.0
    times: Annotated[
        tuple[Seconds, ...] | None, Field(min_length=1, description="Times of the rows instead of a rate, s.")
    ] = None
    rows: Annotated[
        Literal["rate", "knots", "both"] | None,
        Field(
            description="Where rows stand: at the times of the rate, at the knots of the curve, or at both; "
            "left out: the rate, and in messages of ROS the knots."
        ),
    ] = None
    start_time: Annotated[float, Number(Quantity("time"), "Time of the first row, s.")] = 0.0
    align: Annotated[
        bool, Field(strict=True, description="Stretch each move to a whole number of periods.")
    ] = False
    columns: Annotated[
        tuple[Group, ...],
        Field(
            min_length=1,
            description="Groups of columns, in this order; pose, twist, twistd need a robot with geometry.",
        ),
    ] = ("t", "q", "qd", "qdd")
    frame: Annotated[
        Annotated[str, Name("The frame of the columns pose, twist and twistd; left out: world.")] | None,
        Field(alias="in", description="The frame of the columns pose, twist and twistd; left out: world."),
    ] = None
    consumer: Annotated[
        Annotated[str, Name("Profile of the consumer for which the job is planned, such as ros-jtc.")] | None,
        Field(
            alias="for",
            description="Profile of the consumer that the rows are for, such as ros-jtc: "
            "what is not said of the rows is as it takes them, and they keep all limits as it joins them.",
        ),
    ] = None

    @model_validator(mode="after")
    def _fits_together(self) -> Output:
        if self.times is not None and "rate" in self.model_fields_set:
            raise refuse([(("times",), "rate and times exclude each other", "leave one of them out")])
        if self.times is not None and self.rows is not None:
            raise refuse([(("rows",), "rows and times exclude each other", "leave one of them out")])
        if self.times is not None and self.align:
            raise refuse([(("align",), "align needs a rate, not times", "leave one of them out")])
        for index, (before, time) in enumerate(pairwise(self.times or ()), 1):
            if time <= before:
                text = f"times must increase, but {time:.12g} s comes after {before:.12g} s"
                raise refuse([(("times", index), text, None)])
        for index, group in enumerate(self.columns):
            if group in self.columns[:index]:
                raise refuse([(("columns", index), f"the columns '{group}' stand twice", "name them once")])
        return self


class _Moves:
    """Reads moves by the planners they name: only those are loaded."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:  # noqa: ANN401
        return core_schema.with_info_plain_validator_function(self._read)

    @staticmethod
    def _read(value: Any, info: core_schema.ValidationInfo) -> list[Planner]:  # noqa: ANN401
        if not isinstance(value, list):
            return _validated(value, info.context)
        first: dict[int, int] = {}
        for index, entry in enumerate(value):
            first.setdefault(id(entry), index)
        once = [value[index] for index in first.values()]
        try:
            moves = _validated([_tagged(entry) for entry in once], info.context)
        except ValidationError:
            if len(once) == len(value):
                raise
            stand_in = HANDLING["detach"].model_construct()  # for each that is read already
            stood = [_tagged(e) if first[id(e)] == n else stand_in for n, e in enumerate(value)]
            return _validated(stood, info.context)  # for the places of the flaws
        if len(once) == len(value):
            return moves
        read = dict(zip(first, moves, strict=True))
        return [read[id(entry)] for entry in value]

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        from trajcli.job.program.schemas import STRUCTURES

        moves = handler(moves_adapter(PLANNERS).core_schema)
        beside = [handler(TypeAdapter(HANDLING[key]).core_schema) for key in HANDLING]
        return {**moves, "items": {"anyOf": [moves["items"], *beside, *STRUCTURES]}}


class _Defaults:
    """Lets a job state what holds for every move along a path; who reads one has put it into the moves."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:  # noqa: ANN401
        return core_schema.with_info_plain_validator_function(self._read)

    @staticmethod
    def _read(value: Any, info: core_schema.ValidationInfo) -> Any:  # noqa: ANN401
        law = value.get("law") if isinstance(value, Mapping) else None
        if isinstance(law, Mapping):
            value = {**value, "law": {"shape": "time_optimal", **law}}
        return defaults_of_paths().model_validate(value, context=info.context)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return handler(TypeAdapter(defaults_of_paths()).core_schema)


class _OrMany:
    """Lets a grid or a list stand for a point in the schema: who reads one in a job has expanded it."""

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        from trajcli.job.program.schemas import MANY

        one = handler(schema)
        return {"anyOf": [*one.get("anyOf", [one]), *MANY]}


def _validated(entries: Any, context: Any) -> list[Planner]:  # noqa: ANN401
    return _adapter(_tags_of(entries)).validate_python(entries, context=context)


def _tagged(entry: Any) -> Any:  # noqa: ANN401
    """Return an entry of the moves with the name of what reads it where it has none: its first key."""
    if not isinstance(entry, Mapping) or "planner" in entry:
        return entry
    key = next((key for key in HANDLING if key in entry), None)
    return entry if key is None else {"planner": key, **entry}


def _tags_of(moves: Any) -> frozenset[str]:  # noqa: ANN401
    """Return the planners, and what handles a payload, that moves name; all where a name is wrong."""
    if not isinstance(moves, list) or not moves:
        return frozenset((*PLANNERS, *HANDLING))
    tags = [m.get("planner") if isinstance(m, Mapping) else getattr(m, "planner", None) for m in moves]
    right = [tag for tag in tags if isinstance(tag, str) and (tag in PLANNERS or tag in HANDLING)]
    return frozenset(right if len(right) == len(moves) else (*PLANNERS, *HANDLING))


@cache
def _adapter(tags: frozenset[str]) -> TypeAdapter[list[Planner]]:
    return moves_adapter(tags)


class FramePose(Pose):
    """A pose that may be given in a frame of the job; it is read into T_world_frame."""

    def read(self, value: Any, context: ReadingContext) -> np.ndarray:  # noqa: ANN401
        """Return the pose in world, shape (4, 4)."""
        if isinstance(value, np.ndarray):
            return value
        from trajcli.language.frames import pose_of_frame

        return pose_of_frame(value, context)

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of a pose with `in`."""
        name = {"type": "string", "description": "The frame in which it is given; left out: world."}
        pose = super().json_schema()
        return {**pose, "properties": {"in": name, **pose["properties"]}}


class Job(Model):
    """One robot, named points, and the moves to plan."""

    version: Annotated[Literal[1], NO_TRUTH, Field(description="Version of the job language: 1.")]
    name: Annotated[str, Name("For reports; the file's stem when left out.")] | None = None
    units: UnitsSpec = UnitsSpec()
    robot: Annotated[Robot, RobotSource()]
    tool: (
        Annotated[
            MountedTool,
            NamedTool("T_flange_tcp, instead of the robot's own: a name under `tools`, or a pose."),
        ]
        | None
    ) = None
    base: (
        Annotated[
            np.ndarray, Pose("T_world_base, instead of the robot's own: a pedestal, a ceiling, a table.")
        ]
        | None
    ) = None
    gravity: Annotated[
        tuple[float, ...],
        Gravity("Acceleration of a body that falls, in world, m/s^2 whatever the units."),
    ] = GRAVITY
    limits: Annotated[JobLimitsSpec | None, Field(description="Replace the robot's, then scale.")] = None
    points: dict[Annotated[str, PointName("Name of a point.")], Annotated[NamedTarget, _OrMany()]] = Field(
        default_factory=dict, description="Named states, or grids and lists of them."
    )
    frames: dict[
        Annotated[str, PointName("Name of a frame.")],
        Annotated[np.ndarray, FramePose("A work object: a pose in world, or in another frame."), _OrMany()],
    ] = Field(
        default_factory=dict, description="Frames in which poses are given, or grids and lists of them."
    )
    tools: dict[
        Annotated[str, PointName("Name of a tool.")],
        Annotated[MountedTool, ToolField("A tool: the pose of its tcp on the flange, and perhaps its mass.")],
    ] = Field(default_factory=dict, description="Tools by name, for `tool: NAME` and `- tool: NAME`.")
    defaults: Annotated[
        Any,
        _Defaults(),
        Field(exclude=True, description="For every line, arc, path and screw that says no other."),
    ] = None
    sequences: dict[Annotated[str, Name("Name of a sequence.")], Annotated[list[Planner], _Moves()]] = Field(
        default_factory=dict,
        exclude=True,
        description="Lists of moves by name, for `- call: NAME`; of a job that was read, those not called.",
    )
    start: Annotated[
        NamedTarget,
        _FirstRow(),
        Field(
            description="Where the arm stands before the first move; {csv: PATH}: first row of a recording."
        ),
    ]
    moves: Annotated[list[Planner], _Moves(), Field(description="What to do, in order.")]
    when_over_limit: Annotated[
        WhenOverLimit,
        Field(
            description="error: exit 1; slow: the smallest stretch of the move that verifies, and an event."
        ),
    ] = "error"
    zone: (
        Annotated[
            Any,
            ZoneField(
                "About every corner between moves that may be flown by: stop, or how near; left out: stop."
            ),
        ]
        | None
    ) = None
    output: Output = Output()

    @model_validator(mode="after")
    def _start_is_a_state(self) -> Job:
        if not self.start.gives_joints_or_pose:
            raise refuse([(("start",), "the start needs `joints` or a pose", None)])
        first = next((move for move in self.moves if not move.handles), None)
        if first is None:
            raise refuse([(("moves",), f"nothing moves: {', '.join(HANDLING)} stand between moves", None)])
        if first.joins == 1 and any(self.start.acceleration or ()):
            hint = "use quintic or jerk_limited for the first move, or leave it out"
            raise refuse([(("start",), f"{first.tag} cannot start with an acceleration", hint)])
        return self

    @model_validator(mode="after")
    def _names_are_of_one_thing(self) -> Job:
        both = [name for name in self.points if name in self.frames]
        if both:
            hint = "points and frames share names: choose another"
            raise refuse([(("points", n, AT_KEY), f"'{n}' is a point and a frame", hint) for n in both])
        return self

    @model_validator(mode="after")
    def _rows_are_in_a_frame(self) -> Job:
        name, names = self.output.frame, (*self.frames, "world", "base")
        if name is not None and name not in names:
            from trajcli.suggest import did_you_mean, valid_names

            hint = did_you_mean(name, names) or valid_names(names, "frames")
            raise refuse([(("output", "in"), f"there is no frame '{name}'", hint)])
        return self

    @property
    def changes_tool(self) -> bool:
        """Whether the tool is changed between moves."""
        return any(move.changes_tool for move in self.moves)

    @property
    def names_zones(self) -> bool:
        """Whether a zone is named, for all corners or for one."""
        return self.zone is not None or any(move.zone is not None for move in self.moves)

    @property
    def flies_by(self) -> bool:
        """Whether a zone leaves a corner without a stop there."""
        return any(zone and not zone.stops for zone in (self.zone, *(move.zone for move in self.moves)))

    def with_stops(self) -> Job:
        """Return the job that stops at every corner."""
        stop = {"zone": None}
        moves = [move if move.zone is None else move.model_copy(update=stop) for move in self.moves]
        return self.model_copy(update={**stop, "moves": moves})

    @property
    def has_signals(self) -> bool:
        """Whether any move sets a signal."""
        return any(move.at or hasattr(move, "signal") for move in self.moves)

    @model_validator(mode="after")
    def _signals_are_set(self) -> Job:
        if SIGNALS in self.output.columns and not self.has_signals:
            hint = "a move sets one by `at: {signal: NAME, value: 1}`, or leave the columns out"
            path = ("output", "columns", self.output.columns.index(SIGNALS))
            raise refuse([(path, "no move of the job sets a signal", hint)])
        return self

    @model_validator(mode="after")
    def _payloads_alternate(self) -> Job:
        carried: Payload | None = None
        for index, move in enumerate(self.moves):
            try:
                carried = move.carried_after(carried)
            except FlawError as error:
                flaws = error.below("moves", index)
                raise refuse(flaws) from None
        return self
