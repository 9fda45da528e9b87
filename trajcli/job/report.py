"""Report of a job: the model of what `--report` writes, in SI, and its conversion to the units of a job.

schemas/report.schema.json describes it. A number that is no time and no ratio says in its annotation which
field beside it names its unit.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from trajcli.job.report_parts import (
    AtLimitReport,
    ConsumerReport,
    EffortReport,
    EffortsReport,
    FlyByReport,
    InSi,
    JointQuantity,
    MeasuredIn,
    MountedToolReport,
    PathReferenceReport,
    PayloadReport,
    ReferenceReport,
    ReportPart,
    ReportSeconds,
    SavingReport,
    SignalReport,
    TrajectorySeconds,
    UnitName,
    described,
    in_units,
)
from trajcli.limits.kinds import ToolLimit

__all__ = ["MeasuredIn", "Report", "ReportPart", "UnitName", "in_units"]


class PeakReport(ReportPart):
    """The extremes of one joint's quantity in one move."""

    joint: str
    quantity: JointQuantity
    low: Annotated[float, MeasuredIn(), described("Smallest value, SI.")]
    low_time: Annotated[float, described("Where it is, seconds from the start of the trajectory.")]
    high: Annotated[float, MeasuredIn(), described("Largest value, SI.")]
    high_time: Annotated[float, described("Where it is, seconds from the start of the trajectory.")]
    limit: Annotated[
        tuple[float | None, float | None], MeasuredIn(), described("Bounds, SI; null is unlimited.")
    ]
    used: Annotated[
        float | None,
        described("Largest part of the bound that is used, of positions from mid-range; null if unlimited."),
    ]
    unit: UnitName


class ByPositionReport(ReportPart):
    """Where a joint uses most of its limit of velocity by position in one move."""

    joint: str
    used: Annotated[float, described("Largest part of the limit that is used.")]
    velocity: Annotated[float, MeasuredIn(), described("There, SI.")]
    limit: Annotated[float, MeasuredIn(), described("There, with the sign of the velocity, SI.")]
    unit: UnitName
    distance: Annotated[float, MeasuredIn("distance_unit"), described("To the position limit ahead, SI.")]
    distance_unit: UnitName
    time: Annotated[float, described("Where it is, seconds from the start of the trajectory.")]


class BindingReport(ReportPart):
    """The limit of which a move uses most."""

    joint: Annotated[str | None, described("Null: the quantity is of the tool.")]
    quantity: JointQuantity | Literal["velocity_by_position", "effort"] | ToolLimit
    used: Annotated[float, described("Part of the bound that is used: 1 is all of it.")]


class WaypointReport(ReportPart):
    """A point that a move passes, its start and target among them."""

    time: TrajectorySeconds
    missed: Annotated[
        list[float],
        MeasuredIn("units"),
        described("Distance at which each joint passes it, SI; zero where it goes through."),
    ]
    units: Annotated[list[str], described("Unit of each joint.")]


class OutsideReport(ReportPart):
    """How far a joint leaves the range that the waypoints of a move span."""

    joint: str
    beyond: Annotated[float, MeasuredIn(), described("Above (positive) or below (negative) that range, SI.")]
    time: Annotated[float, described("Where it is furthest, seconds from the start of the trajectory.")]
    unit: UnitName


class OffChordReport(ReportPart):
    """How far a joint leaves the straight chords between the points of a move."""

    joint: str
    distance: Annotated[float, MeasuredIn(), described("At most, SI.")]
    time: Annotated[float, described("Where, seconds from the start of the trajectory.")]
    unit: UnitName


class FastestReport(ReportPart):
    """How near a motion that was searched for is to the fastest through its points."""

    lower: Annotated[
        float | None, described("No motion through the points is faster, seconds; null where none is known.")
    ]
    above: Annotated[float | None, described("Part by which the move is at most above the fastest possible.")]
    joint: Annotated[str | None, described("The joint that needs so long; null where several together do.")]
    method: Annotated[
        Literal["bounded", "heuristic"],
        described("bounded: `above` is proven; heuristic: nothing is known of it."),
    ]
    starts: Annotated[int, described("How many starting points were tried.")]
    agreeing: Annotated[
        int, described("How many of them led to this duration, or a thousandth above it at most.")
    ]
    found: Annotated[
        list[float | None], described("Durations to which they led, seconds; null where one led to none.")
    ]
    stopping: Annotated[
        float | None, described("Seconds with a stop at each point; null where there is none.")
    ]
    off_chords: list[OffChordReport]


class ToolPeakReport(ReportPart):
    """The largest magnitude of one quantity of the tool in one move."""

    quantity: ToolLimit
    value: Annotated[float, MeasuredIn(), described("SI, of the tool as forward kinematics has it.")]
    bound: Annotated[float, MeasuredIn(), described("It is proven to be at most this at every time, SI.")]
    time: Annotated[float, described("Where it is, seconds from the start of the trajectory.")]
    limit: Annotated[float | None, MeasuredIn(), described("SI; null is unlimited.")]
    unit: UnitName
    negligible: Annotated[bool, described("Whether it is what rounding leaves of a tool at rest.")]


class LowestSpeedReport(ReportPart):
    """Where the tool is slowest between the first and the last point at which its speed is the wanted one."""

    speed: Annotated[float, MeasuredIn(), described("m/s, or rad/s where the tool turns in its place.")]
    place: Annotated[float, MeasuredIn("place_unit"), described("s on the path, m or rad.")]
    joint: Annotated[str | None, described("The joint that is the reason, where one is known.")]
    unit: UnitName
    place_unit: UnitName


class SegmentSpeedsReport(ReportPart):
    """Neighbouring segments of a path with the same limits of speed, which other segments do not have."""

    first: Annotated[int, described("Index of the first of these segments, from 0.")]
    last: Annotated[int, described("Index of the last one.")]
    begins: Annotated[
        float, MeasuredIn("place_unit"), described("s on the path, m; in a rounded corner its middle.")
    ]
    ends: Annotated[float, MeasuredIn("place_unit"), described("Likewise.")]
    place_unit: UnitName = "m"
    start: TrajectorySeconds
    end: TrajectorySeconds
    peaks: Annotated[list[ToolPeakReport], described("Of the speeds that are limited here, for all t.")]


class ToolReport(ReportPart):
    """The tool on its path."""

    length: Annotated[
        float, MeasuredIn(), described("Of the path, m, or rad where the tool turns in its place.")
    ]
    unit: Literal["m", "rad", "mm", "deg"]
    ruled_by: Annotated[
        Literal["translation", "rotation"] | None,
        described("Whose limits say how fast; null where a duration or the joints do."),
    ]
    wanted_speed: Annotated[
        float | None,
        MeasuredIn("speed_unit"),
        described("Along the path, m/s or rad/s; null where no speed is named."),
    ]
    speed_unit: UnitName
    held: Annotated[float | None, described("Part of the path over which the wanted speed is held, 0 to 1.")]
    lowest: LowestSpeedReport | None
    segments: Annotated[
        list[SegmentSpeedsReport] | None,
        described("Where limits of speed step from segment to segment; null where they do not."),
    ] = None
    peaks: list[ToolPeakReport]
    deviation: Annotated[
        float, MeasuredIn("deviation_unit"), described("Largest distance from its path on rows, m.")
    ]
    deviation_bound: Annotated[
        float | None,
        MeasuredIn("deviation_unit"),
        described("What the distance does not exceed at any time; null where only rows say it."),
    ] = None
    deviation_unit: UnitName = "m"
    turned: Annotated[
        float, MeasuredIn("turned_unit"), described("Largest angle from its orientation on rows, rad.")
    ]
    turned_bound: Annotated[
        float | None,
        MeasuredIn("turned_unit"),
        described("What the angle does not exceed at any time; null where only rows say it."),
    ] = None
    turned_unit: UnitName = "rad"
    method: Annotated[
        Literal["bounded", "sampled"],
        described(
            "bounded: deviation and turned are proven for all t; sampled: at least one of them on rows "
            "alone, as the branch always is."
        ),
    ] = "sampled"


class MoveReport(ReportPart):
    """One move."""

    index: Annotated[int, described("From 0.")]
    planner: str
    label: Annotated[str | None, described("What it is for; null where the job says nothing.")] = None
    round: Annotated[
        str | None, described("In which round of a repeat, such as slot 3 of 18; null outside of any.")
    ] = None
    start: TrajectorySeconds
    end: TrajectorySeconds
    duration: ReportSeconds
    continuity: Annotated[Literal[1, 2], described("Derivatives that the planner joins without a jump.")]
    stretch: Annotated[float, described("How many times longer it lasts than its planner said.")]
    peaks: list[PeakReport]
    velocity_by_position: Annotated[
        list[ByPositionReport] | None, described("Null where no joint has such a limit.")
    ] = None
    efforts: Annotated[list[EffortReport] | None, described("Null where no limit of effort is in force.")] = (
        None
    )
    payload: Annotated[PayloadReport | None, described("What the tool carries; null for nothing.")] = None
    mounted: Annotated[
        MountedToolReport | None,
        described("The tool on the flange, where the job has `tools` or changes it; else null."),
    ] = None
    binding: BindingReport | None
    at_limit: list[AtLimitReport] = Field(
        default_factory=list,
        description="Limits of velocity, acceleration and jerk that bind, and for how long.",
    )
    savings: Annotated[
        list[SavingReport] | None,
        described("Asked for by `explain --sensitivity`; empty where the duration is given."),
    ] = None
    waypoints: Annotated[
        tuple[WaypointReport, ...] | None, described("The points it passes; null for a move without any.")
    ] = None
    outside: Annotated[
        tuple[OutsideReport, ...] | None,
        described("Joints that leave the range of the waypoints, and how far; null without waypoints."),
    ] = None
    fastest: Annotated[
        FastestReport | None, described("Of a motion that was searched for; null for other moves.")
    ] = None
    tool: Annotated[ToolReport | None, described("The tool on its path; null for a move in joint space.")] = (
        None
    )
    tool_peaks: Annotated[
        list[ToolPeakReport] | None,
        described("Of the tool in joint space; null where `limits.tcp` asks for none."),
    ] = None
    reference: ReferenceReport | None = None
    path_reference: Annotated[
        PathReferenceReport | None,
        described(
            "Asked for by `--reference`; null for a move from state to state. `explain` has that of "
            "time-optimal moves always."
        ),
    ] = None


class FindingReport(ReportPart):
    """Something that is wrong."""

    move: int | None
    joint: str | None
    kind: str
    value: InSi
    limit: InSi
    unit: UnitName
    time: TrajectorySeconds
    method: Annotated[
        Literal["exact", "bounded", "sampled"],
        described("exact: a root; bounded: proven between rows; sampled: the largest on rows."),
    ]
    factor: Annotated[float | None, described("The move must last this many times longer; null: no help.")]
    message: Annotated[str, described("What is wrong, in the units of the job.")]
    hint: Annotated[str | None, described("What would fix it.")] = None


class EventReport(ReportPart):
    """A concession."""

    kind: str
    message: str
    move: int | None


class StepReport(ReportPart):
    """A legal step in a joint's acceleration."""

    move: int
    joint: str
    time: TrajectorySeconds
    size: Annotated[float, MeasuredIn(), described("Acceleration after minus before, SI.")]
    unit: UnitName


class UncheckedReport(ReportPart):
    """A quantity that is not checked because it has no limit; efforts are named where a load is carried."""

    joint: str
    quantity: JointQuantity | Literal["effort"]


class UncheckedToolReport(ReportPart):
    """A limit of the tool that is stated, but cannot be judged in some move."""

    quantity: ToolLimit


class KnotsDeviation(ReportPart):
    """What quintics between the knots miss, of the joint that deviates most."""

    position: Annotated[float, MeasuredIn("position_unit"), described("Of the position, for all t; SI.")]
    position_unit: UnitName
    velocity: Annotated[float, MeasuredIn("velocity_unit"), described("Of the velocity, for all t; SI.")]
    velocity_unit: UnitName


class KnotsReport(ReportPart):
    """The knots that a controller gets, and how well quintics between them reproduce the trajectory."""

    count: Annotated[int, described("How many.")]
    deviation: KnotsDeviation


class WorstOfRows(ReportPart):
    """The limit that the curve through the rows passes by the largest factor."""

    kind: str
    joint: Annotated[str | None, described("null: the tool.")]
    move: int | None
    row: Annotated[int, described("The row that it stands at, or behind; from 1.")]
    time: Annotated[float, described("Of that row, s, as written.")]
    value: InSi
    limit: InSi
    unit: UnitName


class RowsReport(ReportPart):
    """What becomes of the limits as the rows are joined by what their columns state."""

    interpolation: Literal["linear", "cubic", "quintic"]
    verdict: Annotated[Literal["satisfied", "exceeded"], described("exceeded: the event joined_over_limit.")]
    worst: WorstOfRows | None = None
    rate_that_keeps: Annotated[
        float | None, described("Hz; a higher rate whose rows keep every limit; null: none found.")
    ] = None


class Report(ReportPart):
    """What became of a job."""

    version: Literal[1] = 1
    trajcli: Annotated[str, described("Version of trajcli.")]
    verdict: Literal["verified", "violated"]
    job: Annotated[str, described("The job's name.")]
    robot: Annotated[str, described("The robot's name.")]
    duration: ReportSeconds
    moves: tuple[MoveReport, ...]
    findings: list[FindingReport]
    events: Annotated[list[EventReport], described("Concessions, which `--strict` refuses.")]
    remarks: list[EventReport] = Field(
        default_factory=list, description="How curves were computed, where that is worth a word."
    )
    steps: list[StepReport]
    unchecked: list[UncheckedReport]
    unchecked_of_tool: list[UncheckedToolReport] = Field(default_factory=list)
    savings: Annotated[
        list[SavingReport] | None, described("Of all moves together, asked for by `explain --sensitivity`.")
    ] = None
    consumer: Annotated[ConsumerReport | None, described("Asked for by `--for`; null otherwise.")] = None
    efforts: Annotated[EffortsReport | None, described("Of an arm with geometry; null for bare joints.")] = (
        None
    )
    knots: Annotated[
        KnotsReport | None,
        described("Of /joint_trajectory; null where a limit is broken, or the motion lasts months."),
    ] = None
    rows: Annotated[
        RowsReport | None,
        described("Of the rows as written; null where a limit is broken, or nothing joins them."),
    ] = None
    flyby: Annotated[
        FlyByReport | None, described("Of corners that are flown by; null where no zone is named.")
    ] = None
    signals: Annotated[list[SignalReport], described("Signals as they are set, by time.")] = []
