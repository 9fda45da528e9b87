"""Comparisons in a report: limits that bind, motions of peers, and the rules of consumers."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from trajcli.job.reports.part import JointQuantity, MeasuredIn, ReportPart, UnitName


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
    through_points: Annotated[
        bool,
        Field(description="Whether it is of motions through all points of the move, not to its end alone."),
    ] = False
    violations: list[PeerViolation] = Field(
        default_factory=list,
        description="Of ruckig's motions, each joint by itself; it does not know limits of position.",
    )


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
    violations: list[PeerViolation] = Field(
        default_factory=list,
        description="Of toppra's motion; the limits of jerk are not toppra's, and are not judged.",
    )
    deviation: Annotated[
        float,
        MeasuredIn("deviation_unit"),
        Field(
            description="By how much toppra's path misses that of the move, of all joints together; 0 where "
            "it is the same polynomial."
        ),
    ] = 0.0
    deviation_unit: Annotated[
        str, Field(description="rad or m; empty where joints of both kinds are measured together, in SI.")
    ] = "rad"
    reason: Annotated[str | None, Field(description="Why there is none.")] = None


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
