"""Report of a job: the model of what `--report` writes, in SI, and its conversion to the units of a job.

schemas/report.schema.json describes it. A number that is no time and no ratio says in its annotation which
field beside it names its unit.
"""

from __future__ import annotations

from functools import cache
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from trajcli.frozen import comparable
from trajcli.units import AngleUnit, LengthUnit, Quantity, Units, factor

Part = TypeVar("Part", bound="ReportPart")
ReportSeconds = Annotated[float, Field(description="Seconds.")]
UnitName = Annotated[str, Field(description="Unit of the numbers beside it, such as rad/s.")]
JointQuantity = Literal["position", "velocity", "acceleration", "jerk"]


@comparable
class MeasuredIn:
    """Marks a number of a report, or several of them.

    Attributes:
        field: Name of the field of the same part that holds the unit; a list holds one for each number.
    """

    field: str = "unit"


class ReportPart(BaseModel):
    """A part of a report."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)


def in_units(part: Part, units: Units) -> Part:
    """Return a report in SI, or a part of one, with all numbers in the units of a job."""
    changes: dict[str, Any] = {}
    measured = _measured(type(part))
    for name, value in part.__dict__.items():
        if name in measured:
            changes[name] = _converted(value, getattr(part, measured[name]), units)
        elif name in measured.values():
            changes[name] = _named(value, units)
        elif isinstance(value, ReportPart):
            changes[name] = in_units(value, units)
        elif isinstance(value, list | tuple) and value and isinstance(value[0], ReportPart):
            changes[name] = type(value)(in_units(each, units) for each in value)
    return part.model_copy(update=changes)


@cache
def _measured(part: type[ReportPart]) -> dict[str, str]:
    """Return for each number of a kind of part the field that holds its unit."""
    return {
        name: mark.field
        for name, field in part.model_fields.items()
        for mark in field.metadata
        if isinstance(mark, MeasuredIn)
    }


def _converted(value: Any, unit: str | list[str], units: Units) -> Any:  # noqa: ANN401
    """Return a number, or several, in SI, in the units of the job."""
    if isinstance(value, list | tuple):
        factors = [_in_job(each, units.angle, units.length)[0] for each in _each(unit, len(value))]
        pairs = zip(value, factors, strict=True)
        return type(value)(None if number is None else number / factor for number, factor in pairs)
    return None if value is None else value / _in_job(str(unit), units.angle, units.length)[0]


def _named(unit: str | list[str], units: Units) -> str | list[str]:
    names = [_in_job(each, units.angle, units.length)[1] for each in _each(unit, 1)]
    return names[0] if isinstance(unit, str) else names


def _each(unit: str | list[str], count: int) -> list[str]:
    return [unit] * count if isinstance(unit, str) else unit


@cache
def _in_job(unit: str, angle: AngleUnit, length: LengthUnit) -> tuple[float, str]:
    """Return the SI value of the job's unit that stands for an SI unit, and its name."""
    start, slash, rest = unit.partition("/")
    if start not in ("rad", "m"):
        return 1.0, unit
    quantity = Quantity("angle" if start == "rad" else "length")
    return factor(quantity, Units(angle, length)), (angle if start == "rad" else length) + slash + rest


class PeakReport(ReportPart):
    """The extremes of one joint's quantity in one move."""

    joint: str
    quantity: JointQuantity
    low: Annotated[float, MeasuredIn(), Field(description="Smallest value, SI.")]
    low_time: Annotated[float, Field(description="Where it is, seconds from the start of the trajectory.")]
    high: Annotated[float, MeasuredIn(), Field(description="Largest value, SI.")]
    high_time: Annotated[float, Field(description="Where it is, seconds from the start of the trajectory.")]
    limit: Annotated[
        tuple[float | None, float | None],
        MeasuredIn(),
        Field(description="Bounds, SI; null is unlimited."),
    ]
    used: Annotated[
        float | None, Field(description="Largest part of the bound that is used; null if unlimited.")
    ]
    unit: UnitName


class ByPositionReport(ReportPart):
    """Where a joint uses most of its limit of velocity by position in one move."""

    joint: str
    used: Annotated[float, Field(description="Largest part of the limit that is used.")]
    velocity: Annotated[float, MeasuredIn(), Field(description="There, SI.")]
    limit: Annotated[float, MeasuredIn(), Field(description="There, with the sign of the velocity, SI.")]
    unit: UnitName
    distance: Annotated[
        float, MeasuredIn("distance_unit"), Field(description="To the position limit ahead, SI.")
    ]
    distance_unit: UnitName
    time: Annotated[float, Field(description="Where it is, seconds from the start of the trajectory.")]


class EffortReport(ReportPart):
    """The extremes of what drives one joint in one move: inverse dynamics with what the tool carries."""

    joint: str
    low: Annotated[float, Field(description="Smallest torque or force, N m or N.")]
    low_time: Annotated[float, Field(description="Where it is, seconds from the start of the trajectory.")]
    high: Annotated[float, Field(description="Largest torque or force, N m or N.")]
    high_time: Annotated[float, Field(description="Where it is, seconds from the start of the trajectory.")]
    bound: Annotated[
        tuple[float, float], Field(description="It is proven to lie between these at every time, N m or N.")
    ]
    limit: Annotated[
        tuple[float | None, float | None], Field(description="Bounds, N m or N; null is unlimited.")
    ]
    used: Annotated[
        float | None, Field(description="Largest part of the bound that is used; null if unlimited.")
    ]
    head_room: Annotated[
        float | None, Field(description="What is left of the limit there, N m or N; negative beyond it.")
    ]
    gravity: Annotated[
        float, Field(description="Where most is used, what it takes to hold arm and payload, N m or N.")
    ]
    gravity_share: Annotated[
        float, Field(description="The same as part of the effort: above 1 where the motion helps.")
    ]
    unit: Literal["N m", "N"]
    method: Literal["bounded"] = "bounded"


class PayloadReport(ReportPart):
    """What the tool carries."""

    mass: Annotated[float, Field(description="kg.")]
    mass_unit: Literal["kg"] = "kg"
    com: Annotated[
        list[float], MeasuredIn("com_unit"), Field(description="Centre of mass in the tcp frame, m.")
    ]
    com_unit: UnitName = "m"
    inertia: Annotated[
        list[float], Field(description="ixx, iyy, izz, ixy, ixz, iyz about the centre of mass, kg m^2.")
    ]
    inertia_unit: Literal["kg m^2"] = "kg m^2"


class EffortsReport(ReportPart):
    """Whether torques and forces were judged, and by which numbers."""

    judged: Annotated[bool, Field(description="Whether the effort of some joint was judged in some move.")]
    reason: Annotated[str | None, Field(description="Why not; null where they were.")] = None
    inertials: Annotated[
        str | None, Field(description="Where masses and inertias come from; null where the robot has none.")
    ] = None
    gravity: Annotated[list[float], Field(description="Acceleration of a body that falls, in world, m/s^2.")]
    gravity_unit: Literal["m/s^2"] = "m/s^2"


class BindingReport(ReportPart):
    """The limit that a move uses most."""

    joint: str
    quantity: JointQuantity | Literal["velocity_by_position", "effort"]
    used: Annotated[float, Field(description="Part of the bound that is used: 1 is all of it.")]


class AtLimitReport(ReportPart):
    """For how long a move is at one limit: within a millionth of it, from the roots of polynomials."""

    joint: str
    quantity: JointQuantity | Literal["velocity_by_position"]
    seconds: Annotated[float, Field(description="In either direction.")]
    share: Annotated[float, Field(description="Of the duration of the move.")]
    method: Annotated[
        Literal["exact", "phases"],
        Field(description="phases: from the switching structure of a time-optimal law."),
    ] = "exact"


class SavingReport(ReportPart):
    """What a limit of one joint would save if it were 10 % higher, found by planning with it."""

    joint: str
    quantity: JointQuantity
    saved: Annotated[float | None, Field(description="Seconds; null where no such motion is known.")]
    share: Annotated[float | None, Field(description="Of the duration of the moves that were planned anew.")]
    reason: Annotated[str | None, Field(description="Why none is known.")] = None


class PeerViolation(ReportPart):
    """A limit that the motion of a peer breaks, judged for all t as a motion of our own."""

    joint: str
    quantity: JointQuantity
    value: Annotated[float, MeasuredIn(), Field(description="SI.")]
    limit: Annotated[float, MeasuredIn(), Field(description="SI.")]
    unit: UnitName
    time: Annotated[float, Field(description="Seconds from the start of the motion.")]


class ReferenceReport(ReportPart):
    """The shortest duration that any point-to-point move may have under the same limits, from ruckig."""

    duration: Annotated[float | None, Field(description="Seconds; null where there is no bound.")]
    ratio: Annotated[
        float | None, Field(description="Duration of the move over it; null where that says nothing.")
    ]
    joint: Annotated[str | None, Field(description="The joint that needs it, or for which there is none.")]
    reason: Annotated[str | None, Field(description="Why there is no bound.")] = None
    violations: Annotated[
        list[PeerViolation],
        Field(description="Of ruckig's motions, each joint by itself; it does not know limits of position."),
    ] = []


class LimitUseReport(ReportPart):
    """The limit of which a motion uses most, for all t."""

    quantity: Literal["velocity", "acceleration"]
    joint: str
    used: Annotated[float, Field(description="Part of the limit that is used: 1 is all of it.")]
    time: Annotated[float, Field(description="Seconds from the start of the motion.")]


class PathReferenceReport(ReportPart):
    """The motion of toppra along the same path, within the same limits of velocity and acceleration."""

    solver: Literal["toppra"] = "toppra"
    duration: Annotated[float | None, Field(description="Seconds; null where it finds no motion.")]
    ratio: Annotated[float | None, Field(description="Duration of the move over it.")]
    use: Annotated[LimitUseReport | None, Field(description="What toppra uses; above 1 it is too fast.")]
    own_use: Annotated[LimitUseReport | None, Field(description="What the move uses.")]
    violations: Annotated[
        list[PeerViolation],
        Field(description="Of toppra's motion; the limits of jerk are not toppra's, and are not judged."),
    ] = []
    deviation: Annotated[
        float,
        Field(
            description="By how much toppra's path misses that of the move, of all joints together; 0 where "
            "it is the same polynomial."
        ),
    ] = 0.0
    reason: Annotated[str | None, Field(description="Why there is none.")] = None


class WaypointReport(ReportPart):
    """A point that a move passes, its start and target among them."""

    time: Annotated[float, Field(description="Seconds from the start of the trajectory.")]
    missed: Annotated[
        list[float],
        MeasuredIn("units"),
        Field(description="Distance at which each joint passes it, SI; zero where it goes through."),
    ]
    units: Annotated[list[str], Field(description="Unit of each joint.")]


class OutsideReport(ReportPart):
    """How far a joint leaves the range that the waypoints of a move span."""

    joint: str
    beyond: Annotated[
        float, MeasuredIn(), Field(description="Above (positive) or below (negative) that range, SI.")
    ]
    time: Annotated[
        float, Field(description="Where it is furthest, seconds from the start of the trajectory.")
    ]
    unit: UnitName


class ToolPeakReport(ReportPart):
    """The largest magnitude of one quantity of the tool in one move."""

    quantity: Literal["speed", "acceleration", "angular_speed", "angular_acceleration"]
    value: Annotated[float, MeasuredIn(), Field(description="SI, of the tool as forward kinematics has it.")]
    bound: Annotated[
        float, MeasuredIn(), Field(description="It is proven to be at most this at every time, SI.")
    ]
    time: Annotated[float, Field(description="Where it is, seconds from the start of the trajectory.")]
    limit: Annotated[float | None, MeasuredIn(), Field(description="SI; null is unlimited.")]
    unit: UnitName
    negligible: Annotated[bool, Field(description="Whether it is what rounding leaves of a tool at rest.")]


class LowestSpeedReport(ReportPart):
    """Where the tool is slowest between the first and the last point at which its speed is the wanted one."""

    speed: Annotated[
        float, MeasuredIn(), Field(description="m/s, or rad/s where the tool turns in its place.")
    ]
    place: Annotated[float, MeasuredIn("place_unit"), Field(description="s on the path, m or rad.")]
    joint: Annotated[str | None, Field(description="The joint that is the reason, where one is known.")]
    unit: UnitName
    place_unit: UnitName


class ToolReport(ReportPart):
    """The tool on its path."""

    length: Annotated[
        float, MeasuredIn(), Field(description="Of the path, m, or rad where the tool turns in its place.")
    ]
    unit: Literal["m", "rad", "mm", "deg"]
    ruled_by: Annotated[
        Literal["translation", "rotation"] | None,
        Field(description="Whose limits say how fast; null where a duration or the joints do."),
    ]
    wanted_speed: Annotated[
        float | None,
        MeasuredIn("speed_unit"),
        Field(description="Along the path, m/s or rad/s; null where no speed is named."),
    ]
    speed_unit: UnitName
    held: Annotated[
        float | None, Field(description="Part of the path over which the wanted speed is held, 0 to 1.")
    ]
    lowest: LowestSpeedReport | None
    peaks: list[ToolPeakReport]
    deviation: Annotated[
        float, MeasuredIn("deviation_unit"), Field(description="Largest distance from its path, m.")
    ]
    deviation_unit: UnitName = "m"
    turned: Annotated[
        float, MeasuredIn("turned_unit"), Field(description="Largest angle from its orientation, rad.")
    ]
    turned_unit: UnitName = "rad"
    method: Annotated[
        Literal["sampled"],
        Field(
            description="How deviation, turned and the branch are judged: on rows, without a proof between."
        ),
    ] = "sampled"


class MoveReport(ReportPart):
    """One move."""

    index: Annotated[int, Field(description="From 0.")]
    planner: str
    start: Annotated[float, Field(description="Seconds from the start of the trajectory.")]
    end: Annotated[float, Field(description="Seconds from the start of the trajectory.")]
    duration: ReportSeconds
    continuity: Annotated[
        Literal[1, 2], Field(description="Derivatives that the planner joins without a jump.")
    ]
    stretch: Annotated[float, Field(description="How many times longer it lasts than its planner said.")]
    peaks: list[PeakReport]
    velocity_by_position: Annotated[
        list[ByPositionReport] | None, Field(description="Null where no joint has such a limit.")
    ] = None
    efforts: Annotated[
        list[EffortReport] | None, Field(description="Null where no limit of effort is in force.")
    ] = None
    payload: Annotated[
        PayloadReport | None, Field(description="What the tool carries; null for nothing.")
    ] = None
    binding: BindingReport | None
    at_limit: Annotated[
        list[AtLimitReport],
        Field(description="Limits of velocity, acceleration and jerk that bind, and for how long."),
    ] = []
    savings: Annotated[
        list[SavingReport] | None,
        Field(description="Asked for by `explain --sensitivity`; empty where the duration is given."),
    ] = None
    waypoints: Annotated[
        tuple[WaypointReport, ...] | None,
        Field(description="The points it passes; null for a move without any."),
    ] = None
    outside: Annotated[
        tuple[OutsideReport, ...] | None,
        Field(
            description="Joints that leave the range of the waypoints, and how far; null without waypoints."
        ),
    ] = None
    tool: Annotated[
        ToolReport | None, Field(description="The tool on its path; null for a move in joint space.")
    ] = None
    tool_peaks: Annotated[
        list[ToolPeakReport] | None,
        Field(description="Of the tool in joint space; null where `limits.tcp` asks for none."),
    ] = None
    reference: ReferenceReport | None = None
    path_reference: Annotated[
        PathReferenceReport | None,
        Field(
            description="Asked for by `--reference`; null for a move from state to state. `explain` has that "
            "of time-optimal moves always."
        ),
    ] = None


class FindingReport(ReportPart):
    """Something that is wrong."""

    move: int | None
    joint: str | None
    kind: str
    value: Annotated[float, MeasuredIn(), Field(description="SI.")]
    limit: Annotated[float, MeasuredIn(), Field(description="SI.")]
    unit: UnitName
    time: Annotated[float, Field(description="Seconds from the start of the trajectory.")]
    method: Annotated[
        Literal["exact", "bounded", "sampled"],
        Field(description="exact: a root; bounded: proven between rows; sampled: the largest on rows."),
    ]
    factor: Annotated[
        float | None, Field(description="The move must last this many times longer; null: no help.")
    ]
    message: Annotated[str, Field(description="What is wrong, in the units of the job.")]
    hint: Annotated[str | None, Field(description="What would fix it.")] = None


class EventReport(ReportPart):
    """A concession."""

    kind: str
    message: str
    move: int | None


class StepReport(ReportPart):
    """A legal step in a joint's acceleration."""

    move: int
    joint: str
    time: Annotated[float, Field(description="Seconds from the start of the trajectory.")]
    size: Annotated[float, MeasuredIn(), Field(description="Acceleration after minus before, SI.")]
    unit: UnitName


class UncheckedReport(ReportPart):
    """A quantity that is not checked because it has no limit."""

    joint: str
    quantity: JointQuantity


class UncheckedToolReport(ReportPart):
    """A limit of the tool that is stated, but cannot be judged in some move."""

    quantity: Literal["speed", "acceleration", "jerk", "angular_speed", "angular_acceleration"]


class KnotsDeviation(ReportPart):
    """What quintics between the knots miss, of the joint that deviates most."""

    position: Annotated[
        float, MeasuredIn("position_unit"), Field(description="Of the position, for all t; SI.")
    ]
    position_unit: UnitName
    velocity: Annotated[
        float, MeasuredIn("velocity_unit"), Field(description="Of the velocity, for all t; SI.")
    ]
    velocity_unit: UnitName


class KnotsReport(ReportPart):
    """The knots that a controller gets, and how well quintics between them reproduce the trajectory."""

    count: Annotated[int, Field(description="How many.")]
    deviation: KnotsDeviation


class ConsumerFinding(ReportPart):
    """A rule of a consumer that the rows break, of one joint: the worst row, and how many there are."""

    rule: Annotated[str, Field(description="Id of the rule in the profile.")]
    severity: Annotated[
        Literal["error", "warning"],
        Field(description="error: the consumer refuses or aborts such a motion; warning: it runs less well."),
    ]
    kind: str
    joint: str | None
    move: int
    time: Annotated[float, Field(description="Seconds from the start of the trajectory.")]
    row: Annotated[int, Field(description="From 1, as written.")]
    count: Annotated[int, Field(description="Of rows that break it.")]
    factor: Annotated[
        float | None, Field(description="The move must last this many times longer; null: no help.")
    ]
    method: Annotated[
        Literal["exact", "differences"],
        Field(description="differences: of rows, at the period of the consumer."),
    ]
    message: Annotated[str, Field(description="What is wrong, in SI.")]
    hint: Annotated[str | None, Field(description="What would fix it.")] = None


class UnjudgedRule(ReportPart):
    """A rule of a consumer that could not be judged."""

    rule: str
    reason: str


class ConsumerReport(ReportPart):
    """What the rows do against the rules of their consumer, as they are written."""

    profile: str
    accepted: Annotated[bool, Field(description="Whether all necessary rules are kept.")]
    findings: list[ConsumerFinding]
    unjudged: list[UnjudgedRule]


class Report(ReportPart):
    """What became of a job."""

    version: Literal[1] = 1
    trajcli: Annotated[str, Field(description="Version of trajcli.")]
    verdict: Literal["verified", "violated"]
    job: Annotated[str, Field(description="The job's name.")]
    robot: Annotated[str, Field(description="The robot's name.")]
    duration: ReportSeconds
    moves: tuple[MoveReport, ...]
    findings: list[FindingReport]
    events: Annotated[list[EventReport], Field(description="Concessions, which `--strict` refuses.")]
    remarks: Annotated[
        list[EventReport], Field(description="How curves were computed, where that is worth a word.")
    ] = []
    steps: list[StepReport]
    unchecked: list[UncheckedReport]
    unchecked_of_tool: list[UncheckedToolReport] = []
    savings: Annotated[
        list[SavingReport] | None,
        Field(description="Of all moves together, asked for by `explain --sensitivity`."),
    ] = None
    consumer: Annotated[ConsumerReport | None, Field(description="Asked for by `--for`; null otherwise.")] = (
        None
    )
    efforts: Annotated[
        EffortsReport | None, Field(description="Of an arm with geometry; null for bare joints.")
    ] = None
    knots: Annotated[
        KnotsReport | None,
        Field(description="Of /joint_trajectory and of ROS goals; null where a limit is broken."),
    ] = None
