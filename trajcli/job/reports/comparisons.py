"""Comparisons in a report: limits that bind, motions of peers, and the rules of consumers."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from trajcli.job.reports.part import (
    InSi,
    JointQuantity,
    MeasuredIn,
    ReportPart,
    TrajectorySeconds,
    UnitName,
    described,
)


class AtLimitReport(ReportPart):
    """For how long a move is at one limit: within a millionth of it, from the roots of polynomials."""

    joint: str
    quantity: JointQuantity | Literal["velocity_by_position"]
    seconds: Annotated[float, described("In either direction.")]
    share: Annotated[float, described("Of the duration of the move.")]
    method: Annotated[
        Literal["exact", "phases"], described("phases: from the switching structure of a time-optimal law.")
    ] = "exact"


class SavingReport(ReportPart):
    """What a limit of one joint would save if it were 10 % higher, found by planning with it."""

    joint: str
    quantity: JointQuantity
    saved: Annotated[float | None, described("Seconds; null where no such motion is known.")]
    share: Annotated[float | None, described("Of the duration of the moves that were planned anew.")]
    reason: Annotated[str | None, described("Why none is known.")] = None


class PeerViolation(ReportPart):
    """A limit that the motion of a peer breaks, judged for all t as a motion of our own."""

    joint: str
    quantity: JointQuantity
    value: InSi
    limit: InSi
    unit: UnitName
    time: Annotated[float, described("Seconds from the start of the motion.")]


class ReferenceReport(ReportPart):
    """The shortest duration that any point-to-point move may have under the same limits, from ruckig."""

    duration: Annotated[float | None, described("Seconds; null where there is no bound.")]
    ratio: Annotated[float | None, described("Duration of the move over it; null where that says nothing.")]
    joint: Annotated[str | None, described("The joint that needs it, or for which there is none.")]
    reason: Annotated[str | None, described("Why there is no bound.")] = None
    through_points: Annotated[
        bool, described("Whether it is of motions through all points of the move, not to its end alone.")
    ] = False
    violations: list[PeerViolation] = Field(
        default_factory=list,
        description="Of ruckig's motions, each joint by itself; it does not know limits of position.",
    )


class LimitUseReport(ReportPart):
    """The limit of which a motion uses most, for all t."""

    quantity: Literal["velocity", "acceleration"]
    joint: str
    used: Annotated[float, described("Part of the limit that is used: 1 is all of it.")]
    time: Annotated[float, described("Seconds from the start of the motion.")]


class PathReferenceReport(ReportPart):
    """The motion of toppra along the same path, within the same limits of velocity and acceleration."""

    solver: Literal["toppra"] = "toppra"
    duration: Annotated[float | None, described("Seconds; null where it finds no motion.")]
    ratio: Annotated[float | None, described("Duration of the move over it.")]
    use: Annotated[LimitUseReport | None, described("What toppra uses; above 1 it is too fast.")]
    own_use: Annotated[LimitUseReport | None, described("What the move uses.")]
    violations: list[PeerViolation] = Field(
        default_factory=list,
        description="Of toppra's motion; the limits of jerk are not toppra's, and are not judged.",
    )
    deviation: Annotated[
        float,
        MeasuredIn("deviation_unit"),
        described(
            "By how much toppra's path misses that of the move, of all joints together; 0 where it is "
            "the same polynomial."
        ),
    ] = 0.0
    deviation_unit: Annotated[
        str, described("rad or m; empty where joints of both kinds are measured together, in SI.")
    ] = "rad"
    reason: Annotated[str | None, described("Why there is none.")] = None


class ConsumerFinding(ReportPart):
    """A rule of a consumer that the rows break, of one joint: the worst row, and how many there are."""

    rule: Annotated[str, described("Id of the rule in the profile.")]
    severity: Annotated[
        Literal["error", "warning"],
        described("error: the consumer refuses or aborts such a motion; warning: it runs less well."),
    ]
    kind: str
    joint: str | None
    move: int
    time: TrajectorySeconds
    row: Annotated[int, described("From 1, as written.")]
    count: Annotated[int, described("Of rows that break it.")]
    factor: Annotated[float | None, described("The move must last this many times longer; null: no help.")]
    method: Annotated[
        Literal["exact", "differences"], described("differences: of rows, at the period of the consumer.")
    ]
    message: Annotated[str, described("What is wrong, in SI.")]
    hint: Annotated[str | None, described("What would fix it.")] = None


class UnjudgedRule(ReportPart):
    """A rule of a consumer that could not be judged."""

    rule: str
    reason: str


class ConsumerReport(ReportPart):
    """What the rows do against the rules of their consumer, as they are written."""

    profile: str
    accepted: Annotated[bool, described("Whether all necessary rules are kept.")]
    findings: list[ConsumerFinding]
    unjudged: list[UnjudgedRule]
