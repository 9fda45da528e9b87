"""Report of a job: the model of what `--report` writes, in SI, and its conversion to the units of a job.

schemas/report.schema.json describes it. A number that is no time and no ratio says in its annotation which
field beside it names its unit.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from trajcli.job.report_parts.efforts import EffortReport, EffortsReport, PayloadReport
from trajcli.job.report_parts.part import MeasuredIn, ReportPart, UnitName

ReportSeconds = Annotated[float, Field(description="Seconds.")]
JointQuantity = Literal["position", "velocity", "acceleration", "jerk"]


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
