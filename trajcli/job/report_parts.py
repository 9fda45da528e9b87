"""Parts of a report: comparisons, efforts, loads, zones; numbers that know their unit, in those of a job."""

from __future__ import annotations

from functools import cache
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from trajcli.frozen import comparable
from trajcli.units import AngleUnit, LengthUnit, Quantity, Units, factor

Part = TypeVar("Part", bound="ReportPart")


def described(text: str) -> Any:  # noqa: ANN401
    """Return what the schema says about a field."""
    return Field(description=text)


TrajectorySeconds = Annotated[float, described("Seconds from the start of the trajectory.")]
ReportSeconds = Annotated[float, described("Seconds.")]
UnitName = Annotated[str, described("Unit of the numbers beside it, such as rad/s.")]
JointQuantity = Literal["position", "velocity", "acceleration", "jerk"]


@comparable
class MeasuredIn:
    """Marks a number of a report, or several of them.

    Attributes:
        field: Name of the field of the same part that holds the unit; a list holds one for each number.
    """

    field: str = "unit"


InSi = Annotated[float, MeasuredIn(), described("SI.")]


class ReportPart(BaseModel):
    """A part of a report."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True, from_attributes=True)


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


def in_units(part: Part, units: Units) -> Part:
    """Return a report in SI, or a part of one, with all numbers in the units of a job."""
    changes: dict[str, Any] = {}
    measured = _measured(type(part))
    for name, value in part.__dict__.items():
        if name in measured:
            changes[name] = _converted(value, getattr(part, measured[name]), units)
        elif name in measured.values():
            changes[name] = _unit_symbols(value, units)
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


def _unit_symbols(unit: str | list[str], units: Units) -> str | list[str]:
    names = [_in_job(each, units.angle, units.length)[1] for each in _each(unit, 1)]
    return names[0] if isinstance(unit, str) else names


def _each(unit: str | list[str], count: int) -> list[str]:
    return [unit] * count if isinstance(unit, str) else unit


@cache
def _in_job(unit: str, angle: AngleUnit, length: LengthUnit) -> tuple[float, str]:
    """Return the SI value of the job's unit that stands for an SI unit, and its name."""
    start, slash, per = unit.partition("/")
    if start not in ("rad", "m"):
        return 1.0, unit
    quantity = Quantity("angle" if start == "rad" else "length")
    return factor(quantity, Units(angle, length)), (angle if start == "rad" else length) + slash + per
