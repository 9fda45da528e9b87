"""The report as a model: what `--report` writes, and what schemas/report.schema.json describes. All SI."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from trajcli.language.numbers import Model

ReportSeconds = Annotated[float, Field(description="Seconds.")]
JointQuantity = Literal["position", "velocity", "acceleration", "jerk"]


class PeakReport(Model):
    """The extremes of one joint's quantity in one move."""

    joint: str
    quantity: JointQuantity
    low: Annotated[float, Field(description="Smallest value, SI.")]
    low_time: Annotated[float, Field(description="Where it is, seconds from the start of the trajectory.")]
    high: Annotated[float, Field(description="Largest value, SI.")]
    high_time: Annotated[float, Field(description="Where it is, seconds from the start of the trajectory.")]
    limit: Annotated[tuple[float | None, float | None], Field(description="Bounds, SI; null is unlimited.")]
    used: Annotated[
        float | None, Field(description="Largest part of the bound that is used; null if unlimited.")
    ]


class BindingReport(Model):
    """The limit that a move uses most."""

    joint: str
    quantity: JointQuantity
    used: Annotated[float, Field(description="Part of the bound that is used: 1 is all of it.")]


class ReferenceReport(Model):
    """The shortest duration that any point-to-point move may have under the same limits, found by ruckig."""

    duration: Annotated[float | None, Field(description="Seconds; null where there is no bound.")]
    ratio: Annotated[
        float | None, Field(description="Duration of the move over it; null where that says nothing.")
    ]
    joint: Annotated[str | None, Field(description="The joint that needs it, or for which there is none.")]
    reason: Annotated[str | None, Field(description="Why there is no bound.")] = None


class WaypointReport(Model):
    """A point that a move passes, its start and target among them."""

    time: Annotated[float, Field(description="Seconds from the start of the trajectory.")]
    missed: Annotated[
        list[float],
        Field(description="By how much each joint passes beside it, SI; zero where it goes through."),
    ]


class OutsideReport(Model):
    """How far a joint leaves the range that the waypoints of a move span."""

    joint: str
    beyond: Annotated[float, Field(description="Above (positive) or below (negative) that range, SI.")]
    time: Annotated[
        float, Field(description="Where it is furthest, seconds from the start of the trajectory.")
    ]


class ToolPeakReport(Model):
    """The largest magnitude of one quantity of the tool in one move."""

    quantity: Literal["speed", "acceleration", "angular_speed", "angular_acceleration"]
    value: Annotated[float, Field(description="SI, of the tool as forward kinematics has it.")]
    bound: Annotated[float, Field(description="It is proven to be at most this at every time, SI.")]
    time: Annotated[float, Field(description="Where it is, seconds from the start of the trajectory.")]
    limit: Annotated[float | None, Field(description="SI; null is unlimited.")]


class LowestSpeedReport(Model):
    """Where the tool is slowest between the first and the last place at which its speed is the wanted one."""

    speed: Annotated[float, Field(description="m/s, or rad/s where the tool turns in its place.")]
    place: Annotated[float, Field(description="s on the path, m or rad.")]
    joint: Annotated[str | None, Field(description="The joint that is the reason, where one is known.")]


class ToolReport(Model):
    """The tool on its path."""

    length: Annotated[float, Field(description="Of the path, m, or rad where the tool turns in its place.")]
    unit: Literal["m", "rad"]
    ruled_by: Annotated[
        Literal["translation", "rotation"] | None,
        Field(description="Whose limits say how fast; null where a duration or the joints do."),
    ]
    wanted_speed: Annotated[
        float | None, Field(description="Along the path, m/s or rad/s; null where no speed is named.")
    ]
    held: Annotated[
        float | None, Field(description="Part of the path over which the wanted speed is held, 0 to 1.")
    ]
    lowest: LowestSpeedReport | None
    peaks: list[ToolPeakReport]
    deviation: Annotated[float, Field(description="Largest distance of the tool from its path, m.")]
    turned: Annotated[float, Field(description="Largest angle between the tool and its orientation, rad.")]


class MoveReport(Model):
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
    binding: BindingReport | None
    waypoints: Annotated[
        list[WaypointReport] | None, Field(description="The points it passes; null for a move without any.")
    ] = None
    outside: Annotated[
        list[OutsideReport] | None,
        Field(
            description="Joints that leave the range of the waypoints, and how far; null without waypoints."
        ),
    ] = None
    tool: Annotated[
        ToolReport | None, Field(description="The tool on its path; null for a move in joint space.")
    ] = None
    reference: ReferenceReport | None = None


class FindingReport(Model):
    """Something that is wrong."""

    move: int | None
    joint: str | None
    kind: str
    value: Annotated[float, Field(description="SI.")]
    limit: Annotated[float, Field(description="SI.")]
    time: Annotated[float, Field(description="Seconds from the start of the trajectory.")]
    method: Annotated[
        Literal["exact", "bounded", "sampled"],
        Field(description="exact: a root; bounded: proven between rows; sampled: the largest on rows."),
    ]
    factor: Annotated[
        float | None, Field(description="The move must last this many times longer; null: no help.")
    ]
    hint: str | None = None


class EventReport(Model):
    """A concession that was made."""

    kind: str
    message: str
    move: int | None


class StepReport(Model):
    """A legal step in a joint's acceleration."""

    move: int
    joint: str
    time: Annotated[float, Field(description="Seconds from the start of the trajectory.")]
    size: Annotated[float, Field(description="Acceleration after minus before, SI.")]


class UncheckedReport(Model):
    """A quantity that is not checked because it has no limit."""

    joint: str
    quantity: JointQuantity


class Report(Model):
    """What became of a job."""

    version: Literal[1] = 1
    trajcli: Annotated[str, Field(description="Version of trajcli.")]
    verdict: Literal["verified", "violated"]
    job: Annotated[str, Field(description="The job's name.")]
    robot: Annotated[str, Field(description="The robot's name.")]
    duration: ReportSeconds
    moves: list[MoveReport]
    findings: list[FindingReport]
    events: list[EventReport]
    steps: list[StepReport]
    unchecked: list[UncheckedReport]
