"""Zones and signals in reports: what flying by the corners of a job gained, what each zone came to."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from trajcli.job.reports.part import MeasuredIn, ReportPart, ReportSeconds, UnitName


class ZoneReport(ReportPart):
    """A corner that is flown by."""

    number: Annotated[int, Field(description="From 1, as in the column `zone`.")]
    move: Annotated[int, Field(description="Index of the move that ends in its corner.")]
    of: Annotated[
        Literal["position", "orientation", "joints"],
        Field(description="What its nearer border is measured by."),
    ]
    joint: Annotated[str | None, Field(description="The joint, where it is joints.")] = None
    asked: Annotated[float, MeasuredIn(), Field(description="Its size in the job.")]
    used: Annotated[float, MeasuredIn(), Field(description="Its size at the nearer border.")]
    unit: UnitName
    entered: Annotated[float, Field(description="Seconds from the start of the trajectory.")]
    left: Annotated[float, Field(description="Seconds from the start of the trajectory.")]
    nearest: Annotated[
        float | None,
        MeasuredIn("length_unit"),
        Field(description="Smallest distance of the tool from the corner; null without geometry."),
    ]
    farthest: Annotated[
        float | None, MeasuredIn("length_unit"), Field(description="Largest distance of the tool from it.")
    ]
    deviation: Annotated[
        float | None,
        MeasuredIn("length_unit"),
        Field(description="Largest distance of the tool from the programmed path."),
    ]
    length_unit: UnitName = "m"
    turn: Annotated[
        float | None,
        MeasuredIn("turn_unit"),
        Field(description="Largest angle of the tool from how it stands in the corner."),
    ]
    turn_unit: UnitName = "rad"
    binds: Annotated[str, Field(description="The limit of a joint that is used most in it.")]
    lowered: Annotated[
        float | None,
        Field(description="Part of the pace that its joints allow, where other limits lower it; else null."),
    ] = None


class FlyByReport(ReportPart):
    """What flying by corners gained."""

    duration: ReportSeconds
    stopping: Annotated[float, Field(description="Of the job with a stop in every corner, s.")]
    saved: Annotated[float, Field(description="The difference, s.")]
    bound: Annotated[
        BoundReport | None,
        Field(description="Null where moves stop although zones are named; others last as planned."),
    ]
    searched: Annotated[
        float,
        Field(
            description="Of the fastest motion of the job that was found, before limits that it passed "
            "lowered its pace, s; it proves nothing."
        ),
    ]
    zones: list[ZoneReport]


class SignalReport(ReportPart):
    """A signal that is set."""

    name: Annotated[str, Field(description="Of the signal.")]
    value: Annotated[float, Field(description="From then on.")]
    move: Annotated[int, Field(description="Index of the move that sets it.")]
    time: Annotated[float, Field(description="Seconds from the start of the trajectory.")]


class BoundReport(ReportPart):
    """A duration that no motion through these zones falls below."""

    duration: Annotated[float, Field(description="Of the whole job, holds included, s.")]
    method: Annotated[
        Literal["proven", "second_order"],
        Field(
            description="No motion is faster in either case. proven: all limits of joints count; "
            "second_order: without limits of jerk but next to stops."
        ),
    ]
