"""Time laws s(t) along a path of the tool: their shapes, and the bounds that the tool's limits set them.

A law goes from rest to rest over each segment of the path between two stops.

Source: Biagiotti and Melchiorri (2008), chapters 2 and 3.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from trajcli.curves.hermite import hermite_coefficients
from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import Array, PiecewisePolynomial, concatenate
from trajcli.errors import Amount, MissingLimitError, PlanningError, Problem
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.robot import ToolLimits
from trajcli.language.limits import AngularAcceleration, AngularSpeed, ToolAcceleration, ToolJerk, ToolSpeed
from trajcli.language.numbers import Flaw, Model, refuse_flaws
from trajcli.language.targets import Duration, MinimumDuration
from trajcli.planners.planner import Phase
from trajcli.planners.tool_path.derivatives import PathDerivatives, path_derivatives

if TYPE_CHECKING:
    from trajcli.curves.trapezoid import InfeasibleProfileError, MotionBounds, VelocityProfile
    from trajcli.kinematics.following.tool_path import ToolPath

_ROUNDING = 1e-9  # relative
_ALONG, _ACROSS = 0.6, 0.8  # of an acceleration, where the path is bent: 0.6^2 + 0.8^2 = 1


@comparable
class PathBounds:
    """Bounds on the derivatives of s by time, per s, s^2, s^3; infinite where there is none.

    Attributes:
        speed: Largest sd.
        acceleration: Largest sdd.
        deceleration: Largest -sdd.
        jerk: Largest magnitude of sddd.
        unit: Whether s is a length or an angle.
    """

    speed: float
    acceleration: float
    deceleration: float
    jerk: float
    unit: Literal["length", "angle"] = "length"

    @property
    def by_order(self) -> tuple[float, float, float]:
        """Bounds on the magnitudes of sd, sdd and sddd."""
        return self.speed, min(self.acceleration, self.deceleration), self.jerk

    def with_each(self, other: PathBounds, pick: Callable[[float, float], float]) -> PathBounds:
        """Return what `pick` makes of each bound and the other one."""
        names = ("speed", "acceleration", "deceleration", "jerk")
        speed, acceleration, deceleration, jerk = (
            pick(getattr(self, name), getattr(other, name)) for name in names
        )
        return PathBounds(speed, acceleration, deceleration, jerk, self.unit)


@frozen
class LawSegment:
    """The law over a segment of a path, or over all of them.

    Attributes:
        law: s(t) from t = 0, of dimension 1, starting at s = 0.
        breaks: Times at which a derivative of it jumps, ends included; pieces that only make up a smooth
            function have none.
        phases: Named intervals of time.
    """

    law: PiecewisePolynomial
    breaks: Array
    phases: tuple[Phase, ...] = ()

    def scaled(self, factor: float) -> LawSegment:
        """Return the law that takes `factor` times as long."""
        phases = tuple(Phase(p.name, p.start * factor, p.end * factor) for p in self.phases)
        return LawSegment(scale_time(self.law, factor), self.breaks * factor, phases)


@frozen
class TimeLaw:
    """A shape of s(t) from rest to rest.

    Attributes:
        shape: Its name in job files.
        continuity: Derivatives that join at rest without a jump: 1 (velocity) or 2 (acceleration).
        needs: The bounds without which there is no fastest law: some of "speed", "acceleration", "jerk".
        has_ramps: Whether it speeds up and slows down with constant accelerations of their own.
        has_jerk: Whether its jerk can be limited.
        takes_duration: Whether it can last a given time; else it is as short as its limits allow.
        uses_joint_limits: Whether it follows from the limits of the joints, too: then it has no segments.
    """

    shape: str
    continuity: Literal[1, 2]
    needs: tuple[str, ...] = ()
    has_ramps: bool = False
    has_jerk: bool = True
    takes_duration: bool = True
    uses_joint_limits: bool = False

    def segment(self, spec: LawSpec, length: float, bounds: PathBounds, duration: float | None) -> LawSegment:
        """Return the law over one segment, in the given duration or as fast as the bounds let it.

        Args:
            spec: What the job says of the law.
            length: Of the segment, m or rad, above zero.
            bounds: At least those that the shape needs are finite.
            duration: s; None for the fastest.

        Raises:
            PlanningError: When no such law exists; names the interval of what does.
        """
        raise TypeError(f"{type(self).__name__} has no segments")


@frozen
class TrapezoidLaw(TimeLaw):
    """Trapezoidal velocity: speed up, cruise, slow down."""

    shape: str = "trapezoid"
    continuity: Literal[1, 2] = 1
    needs: tuple[str, ...] = ("acceleration",)
    has_ramps: bool = True
    has_jerk: bool = False

    def segment(self, spec: LawSpec, length: float, bounds: PathBounds, duration: float | None) -> LawSegment:
        """Return the trapezoid."""
        from trajcli.curves import trapezoid

        both = trapezoid.MotionBounds(bounds.speed, bounds.acceleration, bounds.deceleration)
        slowing = bounds.deceleration if spec.deceleration and bounds.unit == "length" else None
        try:
            if duration is None:
                profile = trapezoid.fastest_profile(length, 0.0, 0.0, both, both)
            elif math.isfinite(bounds.speed):
                speed, steepest = bounds.speed, bounds.acceleration
                profile = trapezoid.profile_of_speed(length, 0.0, 0.0, duration, speed, slowing, steepest)
            else:
                profile = _triangle(length, both, duration) or trapezoid.profile_of_duration(
                    length, 0.0, 0.0, duration, both, both
                )
        except trapezoid.InfeasibleProfileError as error:
            raise _no_trapezoid(error, spec, length, bounds, duration or 0.0) from None
        law = profile.curve(0.0, length, duration)
        return LawSegment(law, law.breaks, tuple(Phase(*phase) for phase in profile.phases()))


def _triangle(length: float, bounds: MotionBounds, duration: float) -> VelocityProfile | None:
    """Return the triangle that lasts a duration, where its ramps are those of the bounds but for rounding.

    The cruise of a trapezoid is a root there: rounding of the length, squared, would make one of 1e-7 s.
    """
    from trajcli.curves.trapezoid import VelocityProfile

    up, down = 1.0 / bounds.acceleration, 1.0 / bounds.deceleration
    if abs(2.0 * length * (up + down) / duration**2 - 1.0) > _ROUNDING / 2:
        return None
    rise, peak = duration * up / (up + down), 2.0 * length / duration
    return VelocityProfile(0.0, ((rise, peak), (duration - rise, 0.0)))


def _no_trapezoid(
    error: InfeasibleProfileError, spec: LawSpec, length: float, bounds: PathBounds, duration: float
) -> PlanningError:
    order = {"speed": 1, "acceleration": 2}.get(error.reason)
    amounts = {"length": Amount(length, 0, None, bounds.unit), "duration": Amount(duration)}
    if order is None:
        message = "no trapezoid covers {length} in {duration}"
        return PlanningError(
            Problem(message, "allow a longer `duration` of the `law`, or faster ramps", amounts=amounts)
        )
    given = bounds.speed if order == 1 else bounds.acceleration
    amounts["given"] = Amount(given, order, None, bounds.unit)
    amounts["low"] = Amount(error.low, order, None, bounds.unit, "up")
    amounts["high"] = Amount(error.high, order, None, bounds.unit, "down")
    allowed = "above {low} and at most {high}" if math.isfinite(error.high) else "at least {low}"
    message = f"a trapezoid over {{length}} in {{duration}} cannot have {{given}}: it must be {allowed}"
    turns = getattr(spec, error.reason) is None and getattr(spec, f"angular_{error.reason}") is not None
    angular = "angular_" if turns or bounds.unit == "angle" else ""
    hint = f"change `{angular}{error.reason}` or `duration` of the `law`"
    return PlanningError(Problem(message, hint, amounts=amounts))


@frozen
class PolynomialLaw(TimeLaw):
    """One polynomial, scaled to length and duration.

    Attributes:
        peaks: Largest speed, acceleration and jerk of the law over the length 1 in the time 1.
    """

    peaks: tuple[float, float, float] = (math.inf, math.inf, math.inf)

    def segment(self, spec: LawSpec, length: float, bounds: PathBounds, duration: float | None) -> LawSegment:
        """Return the law, no faster than the bounds let its peaks be."""
        limited = list(enumerate(zip(self.peaks, bounds.by_order, strict=True), 1))
        times = [(peak * length / limit) ** (1 / order) for order, (peak, limit) in limited]
        fastest = float(max(times))
        time = fastest if duration is None else duration
        if time >= fastest * (1 - _ROUNDING):
            return LawSegment(self._lasting(time, length), np.array([0.0, time]))
        order, (peak, limit) = limited[times.index(fastest)]
        amounts = {
            "length": Amount(length, 0, None, bounds.unit),
            "duration": Amount(time),
            "reached": Amount(peak * length / time**order, order, None, bounds.unit),
            "limit": Amount(limit, order, None, bounds.unit),
            "fastest": Amount(fastest, rounded="up"),
        }
        message = (
            f"a {self.shape} law over {{length}} in {{duration}} reaches {{reached}}, "
            "but the law says at most {limit}: that takes {fastest}"
        )
        raise PlanningError(
            Problem(
                message,
                "allow a `duration` of {fastest} under `law`, or leave one of the two out",
                amounts=amounts,
            )
        )

    def _lasting(self, time: float, length: float) -> PiecewisePolynomial:
        """Return the polynomial whose derivatives up to the continuity are zero at both ends."""
        start = np.zeros((1 + self.continuity, 1))
        end = start.copy()
        end[0] = length
        coefficients = hermite_coefficients(start, end, np.array(time))[:, None, :]
        return PiecewisePolynomial(np.array([0.0, time]), coefficients)


@frozen
class CubicLaw(PolynomialLaw):
    """Third degree."""

    shape: str = "cubic"
    continuity: Literal[1, 2] = 1
    peaks: tuple[float, float, float] = (1.5, 6.0, 12.0)


@frozen
class QuinticLaw(PolynomialLaw):
    """Fifth degree."""

    shape: str = "quintic"
    continuity: Literal[1, 2] = 2
    peaks: tuple[float, float, float] = (1.875, 10 / math.sqrt(3), 60.0)


@frozen
class CycloidalLaw(PolynomialLaw):
    """A cycloid, in polynomial pieces: its acceleration is one period of a sine."""

    shape: str = "cycloidal"
    continuity: Literal[1, 2] = 2
    peaks: tuple[float, float, float] = (2.0, 2 * math.pi, 4 * math.pi**2)

    def _lasting(self, time: float, length: float) -> PiecewisePolynomial:
        from trajcli.curves.rest_to_rest import cycloid_law

        law = cycloid_law(time)
        return PiecewisePolynomial(law.breaks, law.coefficients * length)


@frozen
class JerkLimitedLaw(TimeLaw):
    """The fastest law within speed, acceleration and jerk."""

    shape: str = "jerk_limited"
    continuity: Literal[1, 2] = 2
    needs: tuple[str, ...] = ("speed", "acceleration", "jerk")
    takes_duration: bool = False

    def segment(self, spec: LawSpec, length: float, bounds: PathBounds, duration: float | None) -> LawSegment:
        """Return the fastest law."""
        from trajcli.planners.ruckig import BoundaryProblem, fastest

        both = np.array(bounds.by_order)[:, None] * [-1.0, 1.0]
        profile = fastest(BoundaryProblem("the path", (0.0, 0.0, 0.0), (length, 0.0, 0.0), both))
        law = profile.curve()
        return LawSegment(law, law.breaks, tuple(profile.phases(None)))


@frozen
class TimeOptimalLaw(TimeLaw):
    """As fast as joints and tool can along the whole path."""

    shape: str = "time_optimal"
    continuity: Literal[1, 2] = 1
    takes_duration: bool = False
    uses_joint_limits: bool = True


LAWS: dict[str, TimeLaw] = {
    law.shape: law
    for law in (TrapezoidLaw(), CubicLaw(), QuinticLaw(), CycloidalLaw(), JerkLimitedLaw(), TimeOptimalLaw())
}
"""Every law by its shape: the job language has the same words."""

if TYPE_CHECKING:
    Shape = str
else:
    Shape = Literal[tuple(LAWS)]


class LawSpec(Model):
    """How fast the tool goes along its path; what is left out comes from `limits.tcp`."""

    shape: Annotated[
        Shape,
        Field(
            description="trapezoid: speed up, cruise, slow down; cubic, quintic, cycloidal: one polynomial, "
            "or cycloid; jerk_limited: within speed, acceleration and jerk; time_optimal: as fast as joints "
            "and tool can along this path."
        ),
    ] = "trapezoid"
    duration: Duration | None = None
    minimum_duration: MinimumDuration | None = None
    speed: ToolSpeed | None = None
    acceleration: ToolAcceleration | None = None
    deceleration: ToolAcceleration | None = None
    jerk: ToolJerk | None = None
    angular_speed: AngularSpeed | None = None
    angular_acceleration: AngularAcceleration | None = None

    @property
    def time_law(self) -> TimeLaw:
        """The law of this shape."""
        return LAWS[self.shape]

    @property
    def takes_any_duration(self) -> bool:
        """Whether it may be given a duration beside its other fields."""
        full = self.time_law.has_ramps and self.speed is not None and self.acceleration is not None
        return self.time_law.takes_duration and not full

    @model_validator(mode="after")
    def _fits_shape(self) -> LawSpec:
        flaws: list[Flaw] = []
        if self.duration is not None and self.minimum_duration is not None:
            flaws.append((("minimum_duration",), "duration and minimum_duration exclude each other", None))
        if self.deceleration is not None and not self.time_law.has_ramps:
            text = f"a {self.shape} law slows down as it speeds up"
            flaws.append((("deceleration",), text, "leave it out, or use shape trapezoid"))
        if self.jerk is not None and not self.time_law.has_jerk:
            text = f"the acceleration of a {self.shape} law steps: its jerk cannot be limited"
            flaws.append((("jerk",), text, "use shape jerk_limited or quintic"))
        if self.time_law.has_ramps and self.duration and self.speed and self.acceleration:
            text = f"duration, speed and acceleration together ask too much of a {self.shape}"
            flaws.append((("acceleration",), text, "leave one of the three out"))
        if self.duration is not None and not self.time_law.takes_duration:
            text = f"a {self.shape} law is as short as its limits allow"
            flaws.append((("duration",), text, "say `minimum_duration`, or use another shape"))
        refuse_flaws(flaws)
        return self


def law_bounds(
    spec: LawSpec, limits: ToolLimits, derivatives: PathDerivatives, planner: str
) -> tuple[PathBounds, str | None]:
    """Return the bounds of a law of this shape, and whether translation or rotation sets the speed.

    With a duration nothing is lowered by the limits, which the move is verified by: a law does what it names.

    Raises:
        MissingLimitError: When one that the shape needs is unlimited.
    """
    bounds, ruled_by = _bounds(spec, limits, derivatives)
    if spec.duration is None:
        _require(spec, bounds, derivatives, planner)
        return bounds, ruled_by
    named, _ = _bounds(spec, ToolLimits(), derivatives)
    if not spec.time_law.has_ramps or math.isfinite(named.speed):
        return named, None
    named = named.with_each(bounds, lambda own, other: own if math.isfinite(own) else other)
    if math.isinf(named.acceleration):
        raise _missing(["acceleration"], derivatives, planner, spec)
    return replace(named, speed=math.inf), None


def _bounds(spec: LawSpec, limits: ToolLimits, derivatives: PathDerivatives) -> tuple[PathBounds, str]:
    """Return the bounds that law and limits set, and whether translation or rotation sets the speed.

    An acceleration that a law names is along the path; one that comes from the limits is of the tool, which a
    bent path also accelerates across: there 0.6 of it goes along and 0.8 across.
    """
    bent = derivatives.moves and derivatives.curvature > 0
    along = (_ALONG if derivatives.stretch == 1.0 else 1.0 - _ACROSS) if bent else 1.0
    speed = _or(spec.speed, limits.speed / derivatives.stretch)
    if spec.acceleration is None and bent:
        speed = min(speed, math.sqrt(_ACROSS * limits.acceleration / derivatives.curvature))
    acceleration = _or(spec.acceleration, along * limits.acceleration / derivatives.stretch)
    linear = PathBounds(
        speed, acceleration, _or(spec.deceleration, acceleration), _or(spec.jerk, limits.jerk)
    )
    angular = _rotation_bounds(spec, limits, derivatives)
    if not derivatives.moves:
        return replace(angular, unit="angle"), "rotation"
    return linear.with_each(angular, min), "rotation" if angular.speed < linear.speed else "translation"


def _rotation_bounds(spec: LawSpec, limits: ToolLimits, derivatives: PathDerivatives) -> PathBounds:
    if derivatives.turning == 0:
        return PathBounds(math.inf, math.inf, math.inf, math.inf)
    speed = _or(spec.angular_speed, limits.angular_speed) / derivatives.turning
    acceleration = _or(spec.angular_acceleration, limits.angular_acceleration)
    if derivatives.turning_change > 0:
        speed = min(speed, math.sqrt(_ACROSS * acceleration / derivatives.turning_change))
        acceleration *= _ALONG / 3  # w'' need not be perpendicular to w': sizes add up
    both = acceleration / derivatives.turning
    return PathBounds(speed, both, both, math.inf)


def _or(value: float | None, other: float) -> float:
    return other if value is None else value


def _require(spec: LawSpec, bounds: PathBounds, derivatives: PathDerivatives, planner: str) -> None:
    """Refuse bounds that lack one that the fastest law of this shape needs."""
    lacking = [name for name in spec.time_law.needs if math.isinf(getattr(bounds, name))]
    if not lacking and all(map(math.isinf, bounds.by_order)):
        lacking = ["speed"]
    if lacking:
        raise _missing(lacking, derivatives, planner, spec)


def _missing(
    names: list[str], derivatives: PathDerivatives, planner: str, spec: LawSpec
) -> MissingLimitError:
    """Return the error that asks for bounds, for all that lack at once."""
    if "jerk" in names and not derivatives.moves:
        message = f"a {spec.shape} law needs a jerk, and a rotation in place has no limit of it"
        return MissingLimitError(Problem(message, "use shape quintic or cycloidal"))
    keys = [name if derivatives.moves else f"angular_{name}" for name in names]
    said = " and ".join(", ".join(keys).replace("_", " ").rsplit(", ", 1))
    message = f"{planner} with a {spec.shape} law needs the {said} of the tool"
    more = " or a `duration`" if spec.time_law.takes_duration else ""
    if spec.duration is not None:
        speed = "speed" if derivatives.moves else "angular_speed"
        message, more = f"{message}, or its {speed.replace('_', ' ')}", f" or `{speed}`"
    limits, own = ", ".join(f"{key}: ..." for key in keys), ", ".join(f"`{key}`" for key in keys)
    hint = f"add `limits: {{tcp: {{{limits}}}}}` to the job, or {own}{more} to the `law`"
    return MissingLimitError(Problem(message, hint))


def law_along(
    path: ToolPath, spec: LawSpec, limits: ToolLimits, planner: str
) -> tuple[LawSegment, str | None]:
    """Return the law over the whole path, at rest at every stop, and whether translation or rotation sets it.

    A duration is shared by the segments between stops as their lengths are; where one is given, it rules.

    Raises:
        MissingLimitError: When neither the law nor the limits say how fast.
        PlanningError: When no such law exists.
    """
    bounds, ruled_by = law_bounds(spec, limits, path_derivatives(path), planner)
    stops = np.concatenate([[0.0], path.poses.stops, [path.length]])
    segments = []
    for low, high in pairwise(stops.tolist()):
        length = high - low
        share = None if spec.duration is None else spec.duration * length / path.length
        segments.append(spec.time_law.segment(spec, length, bounds, share))
    return _one_segment(lasting_at_least(spec.minimum_duration, segments), stops), ruled_by


def lasting_at_least(duration: float | None, segments: list[LawSegment]) -> list[LawSegment]:
    """Return the segments, slowed down where they last less than a duration altogether."""
    total = math.fsum(segment.law.duration for segment in segments)
    if duration is None or total >= duration:
        return segments
    return [segment.scaled(duration / total) for segment in segments]


def _one_segment(segments: list[LawSegment], stops: Array) -> LawSegment:
    laws, breaks, phases, begin = [], [np.zeros(1)], list[Phase](), 0.0
    for segment, s in zip(segments, stops[:-1], strict=True):
        coefficients = segment.law.coefficients.copy()
        coefficients[-1] += s
        laws.append(PiecewisePolynomial(segment.law.breaks, coefficients))
        breaks.append(segment.breaks[1:] + begin)
        phases += [Phase(p.name, p.start + begin, p.end + begin) for p in segment.phases]
        begin += segment.law.duration
    return LawSegment(concatenate(laws), np.concatenate(breaks), tuple(phases))
