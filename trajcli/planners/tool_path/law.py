"""The law of a move along a path: how its parameter s grows with time.

Laws s(t) over a stretch of a path, from rest to rest.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING, Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from trajcli.curves.hermite import hermite_coefficients
from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import Amount, PlanningError, Problem
from trajcli.frozen import comparable, frozen
from trajcli.language.limits import AngularAcceleration, AngularSpeed, ToolAcceleration, ToolJerk, ToolSpeed
from trajcli.language.numbers import Flaw, Model, refuse
from trajcli.language.targets import Duration, MinimumDuration
from trajcli.planners.planner import Phase

if TYPE_CHECKING:
    from trajcli.curves.trapezoid import InfeasibleProfileError


Shape = Literal["trapezoid", "cubic", "quintic", "cycloidal", "jerk_limited", "time_optimal"]


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

    @model_validator(mode="after")
    def _fits_shape(self) -> LawSpec:
        flaws: list[Flaw] = []
        if self.duration is not None and self.minimum_duration is not None:
            flaws.append((("minimum_duration",), "duration and minimum_duration exclude each other", None))
        if self.deceleration is not None and self.shape != "trapezoid":
            text = f"a {self.shape} law slows down as it speeds up"
            flaws.append((("deceleration",), text, "leave it out, or use shape trapezoid"))
        if self.jerk is not None and self.shape in ("trapezoid", "time_optimal"):
            text = f"the acceleration of a {self.shape} law steps: its jerk cannot be limited"
            flaws.append((("jerk",), text, "use shape jerk_limited or quintic"))
        if self.shape == "trapezoid" and self.duration and self.speed and self.acceleration:
            text = "duration, speed and acceleration together ask too much of a trapezoid"
            flaws.append((("acceleration",), text, "leave one of the three out"))
        if self.shape in ("time_optimal", "jerk_limited") and self.duration is not None:
            text = f"a {self.shape} law is as short as its limits allow"
            flaws.append((("duration",), text, "say `minimum_duration`, or use another shape"))
        if flaws:
            raise refuse(flaws)
        return self


_PEAKS = {"cubic": (1.5, 6.0, 12.0), "quintic": (1.875, 10 / math.sqrt(3), 60.0)}
_PEAKS["cycloidal"] = (2.0, 2 * math.pi, 4 * math.pi**2)
"""Largest speed, acceleration and jerk of a law over 1 in the time 1."""
_CONDITIONS = {"cubic": 2, "quintic": 3}
_ROUNDING = 1e-9  # relative


@comparable
class PathBounds:
    """What the parameter of a path may do, per s, s^2, s^3; infinite for anything.

    Attributes:
        speed: Largest sd.
        acceleration: Largest sdd.
        deceleration: Largest -sdd.
        jerk: Largest magnitude of sddd.
        unit: Whether the parameter is a length or an angle.
    """

    speed: float
    acceleration: float
    deceleration: float
    jerk: float
    unit: Literal["length", "angle"] = "length"

    def values(self) -> tuple[float, float, float, float]:
        """Return the four numbers."""
        return self.speed, self.acceleration, self.deceleration, self.jerk

    def with_each(self, other: PathBounds, pick: Callable[[float, float], float]) -> PathBounds:
        """Return what `pick` makes of each number and the other one."""
        speed, acceleration, deceleration, jerk = map(pick, self.values(), other.values())
        return PathBounds(speed, acceleration, deceleration, jerk, self.unit)


@frozen
class LawSegment:
    """The law over a stretch.

    Attributes:
        law: s(t) from 0, of dimension 1, starting at s = 0.
        breaks: Where a derivative of it jumps, s, ends included; pieces that only make up a smooth function
            have none.
        phases: Named stretches of time.
    """

    law: PiecewisePolynomial
    breaks: Array
    phases: tuple[Phase, ...] = ()

    def scaled(self, factor: float) -> LawSegment:
        """Return the law that takes `factor` times as long."""
        phases = tuple(Phase(p.name, p.start * factor, p.end * factor) for p in self.phases)
        return LawSegment(scale_time(self.law, factor), self.breaks * factor, phases)


def law_segment(spec: LawSpec, length: float, bounds: PathBounds, duration: float | None) -> LawSegment:
    """Return the law over `length`, in the given duration or as fast as the bounds let it.

    Args:
        spec: Says which shape; time_optimal is not among those made here.
        length: Of the stretch, m or rad, above zero.
        bounds: At least those that the shape needs are finite.
        duration: s; None for the fastest.

    Raises:
        PlanningError: When no such law exists; names the interval of what does.
    """
    if spec.shape == "trapezoid":
        return _trapezoid(spec, length, bounds, duration)
    if spec.shape == "jerk_limited":
        return _jerk_limited(length, bounds)
    fastest = _fastest(spec.shape, length, bounds)
    time = fastest if duration is None else duration
    if time < fastest * (1 - _ROUNDING):
        raise _too_short(spec, length, bounds, time, fastest)
    if spec.shape == "cycloidal":
        from trajcli.curves.cycloid import cycloid_law

        law = cycloid_law(time)
        scaled = PiecewisePolynomial(law.breaks, law.coefficients * length)
        return LawSegment(scaled, np.array([0.0, time]))
    start = np.zeros((_CONDITIONS[spec.shape], 1))
    end = start.copy()
    end[0] = length
    coefficients = hermite_coefficients(start, end, np.array(time))[:, None, :]
    law = PiecewisePolynomial(np.array([0.0, time]), coefficients)
    return LawSegment(law, law.breaks)


def _fastest(shape: str, length: float, bounds: PathBounds) -> float:
    limits = (bounds.speed, min(bounds.acceleration, bounds.deceleration), bounds.jerk)
    pairs = zip(_PEAKS[shape], limits, strict=True)
    times = [(peak * length / limit) ** (1 / order) for order, (peak, limit) in enumerate(pairs, 1)]
    return float(max(times))


def _jerk_limited(length: float, bounds: PathBounds) -> LawSegment:
    from trajcli.planners.point_to_point.ruckig import BoundaryProblem, fastest

    limits = [bounds.speed, min(bounds.acceleration, bounds.deceleration), bounds.jerk]
    both = np.array(limits)[:, None] * [-1.0, 1.0]
    profile = fastest(BoundaryProblem("the path", (0.0, 0.0, 0.0), (length, 0.0, 0.0), both))
    law = profile.curve()
    return LawSegment(law, law.breaks, tuple(profile.phases(None)))


def _trapezoid(spec: LawSpec, length: float, bounds: PathBounds, duration: float | None) -> LawSegment:
    from trajcli.curves.trapezoid import (
        InfeasibleProfileError,
        MotionBounds,
        fastest_profile,
        profile_of_duration,
        profile_of_speed,
    )

    rates = MotionBounds(bounds.speed, bounds.acceleration, bounds.deceleration)
    try:
        if duration is None:
            profile = fastest_profile(length, 0.0, 0.0, rates, rates)
        elif math.isfinite(bounds.speed):
            slower = bounds.deceleration if spec.deceleration is not None else None
            profile = profile_of_speed(length, 0.0, 0.0, duration, bounds.speed, slower)
        else:
            profile = profile_of_duration(length, 0.0, 0.0, duration, rates, rates)
    except InfeasibleProfileError as error:
        raise _infeasible(error, length, bounds, duration or 0.0) from None
    phases = tuple(Phase(*phase) for phase in profile.phases())
    law = profile.curve(0.0, length, duration)
    return LawSegment(law, law.breaks, phases)


def _infeasible(
    error: InfeasibleProfileError, length: float, bounds: PathBounds, duration: float
) -> PlanningError:
    order = {"speed": 1, "acceleration": 2}.get(error.reason)
    amounts = {"length": Amount(length, 0, None, bounds.unit), "duration": Amount(duration)}
    if order is None:
        message = "no trapezoid covers {length} in {duration}"
        return PlanningError(Problem(message, "allow more time, or faster ramps", amounts=amounts))
    given = bounds.speed if order == 1 else bounds.acceleration
    amounts["given"] = Amount(given, order, None, bounds.unit)
    amounts["low"] = Amount(error.low, order, None, bounds.unit)
    amounts["high"] = Amount(error.high, order, None, bounds.unit)
    allowed = "above {low} and at most {high}" if math.isfinite(error.high) else "at least {low}"
    message = f"a trapezoid over {{length}} in {{duration}} cannot have {{given}}: it must be {allowed}"
    hint = f"change the {error.reason}, or the duration"
    return PlanningError(Problem(message, hint, amounts=amounts))


def _too_short(
    spec: LawSpec, length: float, bounds: PathBounds, duration: float, fastest: float
) -> PlanningError:
    """Return the error of a duration in which a polynomial exceeds what the law itself names."""
    limits = (bounds.speed, min(bounds.acceleration, bounds.deceleration), bounds.jerk)
    order, peak, limit = max(
        ((n, k, limit) for n, (k, limit) in enumerate(zip(_PEAKS[spec.shape], limits, strict=True), 1)),
        key=lambda row: float((row[1] * length / row[2]) ** (1 / row[0])),
    )
    amounts = {
        "length": Amount(length, 0, None, bounds.unit),
        "duration": Amount(duration),
        "reached": Amount(peak * length / duration**order, order, None, bounds.unit),
        "limit": Amount(limit, order, None, bounds.unit),
        "fastest": Amount(fastest),
    }
    message = (
        f"a {spec.shape} law over {{length}} in {{duration}} reaches {{reached}}, but the law says at most "
        "{limit}: that takes {fastest}"
    )
    return PlanningError(Problem(message, "allow more time, or leave one of the two out", amounts=amounts))
