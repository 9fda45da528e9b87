"""Explanation of a job: its report with polynomials, poses and paths, in the units of the job."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache
from typing import Annotated, Any, Literal

from pydantic import SerializerFunctionWrapHandler, TypeAdapter, model_serializer

from trajcli.job.report import MoveReport, OutsideReport, Report, WaypointReport
from trajcli.job.report_parts import MeasuredIn, ReportPart, UnitName, described

Vector = list[float]
MoveSeconds = Annotated[float, described("Seconds from the start of the move.")]


class PolynomialReport(ReportPart):
    """One polynomial of one coordinate."""

    start: MoveSeconds
    end: MoveSeconds
    local: Annotated[Vector, MeasuredIn(), described("Coefficients in powers of t - start, ascending.")]
    absolute: Annotated[Vector, MeasuredIn(), described("Coefficients in powers of t, ascending.")]
    unshifted: Annotated[
        Vector | None,
        MeasuredIn(),
        described("Coefficients in powers of t - origin: the times of the job. Null without a shift."),
    ] = None
    velocity: Annotated[
        Vector | None,
        MeasuredIn(),
        described("Coefficients of the first derivative in powers of t, where asked for; unit per s."),
    ] = None
    acceleration: Annotated[
        Vector | None,
        MeasuredIn(),
        described("Coefficients of the second derivative in powers of t, where asked for; unit per s^2."),
    ] = None
    in_pi: Annotated[
        list[str | None] | None,
        described(
            "The coefficients `absolute` as multiples of pi, such as 3 pi/2; null for each that is "
            "none, and for all where none is, or the unit is not rad."
        ),
    ] = None
    unit: UnitName


def polynomial_reports(rows: Iterable[dict[str, Any]]) -> list[PolynomialReport]:
    """Return the reports that have these fields: a long motion has thousands."""
    return _polynomials().validate_python(list(rows))


@cache
def _polynomials() -> TypeAdapter[list[PolynomialReport]]:
    return TypeAdapter(list[PolynomialReport])


class _Sparse(ReportPart):
    """A part that leaves out what there is not."""

    @model_serializer(mode="wrap")
    def _without_nulls(self, serialize: SerializerFunctionWrapHandler) -> dict[str, Any]:
        return {key: value for key, value in serialize(self).items() if value is not None}


class ChoiceReport(ReportPart):
    """Why a pose is reached on its branch and not on another."""

    by: Literal["configuration", "nearest"]
    configuration: Annotated[dict[str, str], described("The names that the job asks for.")]
    near: Annotated[Vector, MeasuredIn("units"), described("Where the arm comes from.")]
    units: list[str]
    candidates: Annotated[int, described("Answers within the limits that have these names.")]
    within_limits: Annotated[int, described("Answers within the limits.")]


class PoseReport(_Sparse):
    """How a pose that the job names is reached.

    The arm is singular there where the tcp can move in fewer directions, among those that the pose fixes,
    than it can nearby.
    """

    joints: Annotated[Vector, MeasuredIn("units")]
    units: list[str]
    branch: dict[str, str]
    method: str
    chosen: ChoiceReport
    singular: bool
    rank: Annotated[dict[str, int], described("Numbers of these directions.")]
    free_direction: Annotated[
        Vector | None,
        described(
            "Unit vector of joint values in the units of the job, along which the arm can move while "
            "the tcp keeps the pose."
        ),
    ] = None


class PhaseReport(ReportPart):
    """A named interval of a move."""

    name: str
    start: MoveSeconds
    end: MoveSeconds
    joint: str | None


class LineSegmentReport(ReportPart):
    """A straight segment of a path."""

    kind: Literal["line"] = "line"
    start: Annotated[Vector, MeasuredIn()]
    end: Annotated[Vector, MeasuredIn()]
    length: Annotated[float, MeasuredIn()]
    unit: UnitName = "m"


class ArcSegmentReport(ReportPart):
    """An arc, or a helix."""

    kind: Literal["arc", "helix"]
    start: Annotated[Vector, MeasuredIn()]
    end: Annotated[Vector, MeasuredIn()]
    center: Annotated[Vector, MeasuredIn()]
    axis: Vector
    radius: Annotated[float, MeasuredIn()]
    angle: Annotated[float, MeasuredIn("angle_unit")]
    pitch: Annotated[float, MeasuredIn()]
    length: Annotated[float, MeasuredIn()]
    unit: UnitName = "m"
    angle_unit: UnitName = "rad"


class RotationSegmentReport(ReportPart):
    """A rotation of the tool where it stands."""

    kind: Literal["rotation"] = "rotation"
    place: Annotated[Vector, MeasuredIn()]
    angle: Annotated[float, MeasuredIn("angle_unit")]
    unit: UnitName = "m"
    angle_unit: UnitName = "rad"


class ScrewSegmentReport(_Sparse):
    """A screw: the axis in world, a point of it, and angle and distance along it.

    Source: Lynch and Park, Modern Robotics (2017), section 3.3.2.
    """

    kind: Literal["screw"] = "screw"
    axis: Vector
    point: Annotated[Vector | None, MeasuredIn()] = None
    angle: Annotated[float, MeasuredIn("angle_unit")]
    advance: Annotated[float, MeasuredIn()]
    unit: UnitName = "m"
    angle_unit: UnitName = "rad"


SegmentReport = LineSegmentReport | ArcSegmentReport | RotationSegmentReport | ScrewSegmentReport


class CornerReport(ReportPart):
    """A corner between two segments."""

    kind: str
    place: Annotated[float, MeasuredIn(), described("s on the path.")]
    point: Annotated[Vector, MeasuredIn()]
    turn: Annotated[float, MeasuredIn("turn_unit")]
    radius: Annotated[float, MeasuredIn()]
    deviation: Annotated[float, MeasuredIn()]
    unit: UnitName = "m"
    turn_unit: UnitName = "rad"


class WeaveReport(ReportPart):
    """A swing to both sides of the path, which is then its seam: length, segments and s are of that."""

    shape: Literal["sine", "triangle", "trapezoid"]
    amplitude: Annotated[float, MeasuredIn(), described("To each side.")]
    lengths: Annotated[
        Vector, MeasuredIn(), described("Of a cycle, for each part of the seam between stops.")
    ]
    cycles: Annotated[list[float], described("For each of these parts, whole or half ones.")]
    unit: UnitName = "m"


class PathReport(_Sparse):
    """The path of the tool as a drawing office would state it, and the law along it."""

    length: Annotated[float, MeasuredIn()]
    unit: UnitName
    segments: list[SegmentReport]
    corners: list[CornerReport]
    weave: WeaveReport | None = None
    law: list[PolynomialReport]


class ExplainedWaypoint(WaypointReport):
    """A point that a move passes, its start and target among them."""

    time: MoveSeconds
    joints: Annotated[Vector, MeasuredIn("units")]


class ExplainedOutside(OutsideReport):
    """How far a joint leaves the range that the waypoints of a move span."""

    time: MoveSeconds


class KnotReport(ReportPart):
    """A knot of a spline with virtual points: a point that it passes, or a virtual one."""

    time: MoveSeconds
    virtual: Annotated[bool, described("Whether its position follows from the spline.")]
    position: Annotated[Vector, MeasuredIn("units")]
    velocity: Annotated[Vector, MeasuredIn("velocity_units")]
    acceleration: Annotated[Vector, MeasuredIn("acceleration_units")]
    units: list[str]
    velocity_units: list[str]
    acceleration_units: list[str]


class BlendReport(ReportPart):
    """A parabola that rounds a point, q(t) = b0 + b1 (t - t_k) + b2 (t - t_k)^2, in the times of the job.

    Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.2.2.
    """

    index: Annotated[int, described("Of the point among the waypoints, the start being 0.")]
    joint: str
    time: Annotated[float, described("t_k, when the job would pass the point, s.")]
    start: Annotated[float, described("Where the parabola begins, s in the times of the job.")]
    end: Annotated[float, described("Where it ends, s in the times of the job.")]
    coefficients: Annotated[Vector, MeasuredIn(), described("b0, b1 and b2.")]
    unit: UnitName


class ExplainedMove(MoveReport):
    """One move, with its polynomials."""

    joints: list[str]
    from_pose: PoseReport | None
    to_pose: PoseReport | None
    breaks: list[MoveSeconds]
    polynomials: Annotated[dict[str, list[PolynomialReport]], described("By the name of the joint.")]
    closed_form: Annotated[dict[str, str] | None, described("Formulas of which these are a fit.")]
    closed_form_derivatives: Annotated[
        dict[str, list[str]] | None,
        described("Of these formulas the first and second derivative, where asked for."),
    ] = None
    knots: Annotated[
        list[KnotReport] | None, described("Of a spline with virtual points; null for others.")
    ] = None
    blends: Annotated[list[BlendReport] | None, described("Parabolas about the points that they round.")] = (
        None
    )
    phases: list[PhaseReport]
    binding_phases: Annotated[bool, described("Whether the phases say which limit binds.")]
    arrivals: Annotated[dict[str, float] | None, described("Durations of each joint alone, s.")]
    origin: Annotated[float, described("Where the zero of the move's own time lies, s.")]
    waypoints: tuple[ExplainedWaypoint, ...] | None = None
    outside: tuple[ExplainedOutside, ...] | None = None
    path: PathReport | None


class UnitsReport(ReportPart):
    """The units of all numbers."""

    angle: str
    length: str
    time: Literal["s"] = "s"


class Explanation(Report):
    """What `trajcli explain --json` prints."""

    units: UnitsReport
    joints: list[str]
    moves: tuple[ExplainedMove, ...]
