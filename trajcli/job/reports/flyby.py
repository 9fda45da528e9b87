"""Zones and signals in reports: what flying by the corners of a job gained, what each zone came to."""

from __future__ import annotations

from typing import Annotated, Literal

from trajcli.job.reports.part import (
    MeasuredIn,
    ReportPart,
    ReportSeconds,
    TrajectorySeconds,
    UnitName,
    described,
)


class ZoneReport(ReportPart):
    """A corner that is flown by."""

    number: Annotated[int, described("From 1, as in the column `zone`.")]
    move: Annotated[int, described("Index of the move that ends in its corner.")]
    of: Annotated[
        Literal["position", "orientation", "joints"], described("What its nearer border is measured by.")
    ]
    joint: Annotated[str | None, described("The joint, where it is joints.")] = None
    asked: Annotated[float, MeasuredIn(), described("Its size in the job.")]
    used: Annotated[float, MeasuredIn(), described("Its size at the nearer border.")]
    unit: UnitName
    entered: TrajectorySeconds
    left: TrajectorySeconds
    nearest: Annotated[
        float | None,
        MeasuredIn("length_unit"),
        described("Smallest distance of the tool from the corner; null without geometry."),
    ]
    farthest: Annotated[
        float | None, MeasuredIn("length_unit"), described("Largest distance of the tool from it.")
    ]
    deviation: Annotated[
        float | None,
        MeasuredIn("length_unit"),
        described("Largest distance of the tool from the programmed path."),
    ]
    length_unit: UnitName = "m"
    turn: Annotated[
        float | None,
        MeasuredIn("turn_unit"),
        described("Largest angle of the tool from how it stands in the corner."),
    ]
    turn_unit: UnitName = "rad"
    binds: Annotated[str, described("The limit of a joint that is used most in it.")]
    lowered: Annotated[
        float | None,
        described("Part of the full pace at which its joints use what other limits leave them; else null."),
    ] = None


class FlyByReport(ReportPart):
    """What flying by corners gained."""

    duration: ReportSeconds
    stopping: Annotated[float, described("Of the job with a stop in every corner, s.")]
    saved: Annotated[float, described("The difference, s.")]
    bound: Annotated[
        BoundReport | None,
        described("Null where moves stop although zones are named; others last as planned."),
    ]
    searched: Annotated[
        float,
        described(
            "Of the fastest motion of the job that was found, before limits that it passed lowered its "
            "pace, s; it proves nothing."
        ),
    ]
    zones: list[ZoneReport]


class SignalReport(ReportPart):
    """A signal that is set."""

    name: Annotated[str, described("Of the signal.")]
    value: Annotated[float, described("From then on.")]
    move: Annotated[int, described("Index of the move that sets it.")]
    time: TrajectorySeconds


class BoundReport(ReportPart):
    """A duration that no motion through these zones falls below."""

    duration: Annotated[float, described("Of the whole job, holds included, s.")]
    method: Annotated[
        Literal["proven", "second_order"],
        described(
            "No motion is faster in either case. proven: all limits of joints count; second_order: "
            "without limits of jerk but next to stops."
        ),
    ]
