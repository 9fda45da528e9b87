"""Efforts, loads, zones and signals in reports."""

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


class EffortReport(ReportPart):
    """The extremes of what drives one joint in one move: inverse dynamics with what the tool carries."""

    joint: str
    low: Annotated[float, described("Smallest torque or force, N m or N.")]
    low_time: Annotated[float, described("Where it is, seconds from the start of the trajectory.")]
    high: Annotated[float, described("Largest torque or force, N m or N.")]
    high_time: Annotated[float, described("Where it is, seconds from the start of the trajectory.")]
    bound: Annotated[
        tuple[float, float], described("It is proven to lie between these at every time, N m or N.")
    ]
    limit: Annotated[tuple[float | None, float | None], described("Bounds, N m or N; null is unlimited.")]
    used: Annotated[float | None, described("Largest part of the bound that is used; null if unlimited.")]
    head_room: Annotated[
        float | None, described("What is left of the limit there, N m or N; negative beyond it.")
    ]
    gravity: Annotated[
        float, described("Where most is used, what it takes to hold arm and payload, N m or N.")
    ]
    gravity_share: Annotated[
        float, described("The same as part of the effort: above 1 where the motion helps.")
    ]
    unit: Literal["N m", "N"]
    method: Literal["bounded"] = "bounded"


class PayloadReport(ReportPart):
    """What the tool carries."""

    mass: Annotated[float, described("kg.")]
    mass_unit: Literal["kg"] = "kg"
    com: Annotated[list[float], MeasuredIn("com_unit"), described("Centre of mass in the tcp frame, m.")]
    com_unit: UnitName = "m"
    inertia: Annotated[
        list[float], described("ixx, iyy, izz, ixy, ixz, iyz about the centre of mass, kg m^2.")
    ]
    inertia_unit: Literal["kg m^2"] = "kg m^2"


class MountedToolReport(ReportPart):
    """The tool on the flange."""

    name: Annotated[str | None, described("By which the job calls it; null without one.")] = None
    xyz: Annotated[list[float], MeasuredIn("xyz_unit"), described("Its tcp in the flange, m.")]
    xyz_unit: UnitName = "m"
    matrix: Annotated[list[list[float]], described("Orientation of its tcp in the flange.")]
    load: Annotated[PayloadReport | None, described("Its own mass; null where nobody says it.")] = None


class EffortsReport(ReportPart):
    """Whether torques and forces were judged, and by which numbers."""

    judged: Annotated[bool, described("Whether the effort of some joint was judged in some move.")]
    reason: Annotated[str | None, described("Why not; null where they were.")] = None
    inertials: Annotated[
        str | None, described("Where masses and inertias come from; null where the robot has none.")
    ] = None
    gravity: Annotated[list[float], described("Acceleration of a body that falls, in world, m/s^2.")]
    gravity_unit: Literal["m/s^2"] = "m/s^2"


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
