"""The law of a whole path: bounds of its parameter from the limits of the tool, a stop at every corner."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial, concatenate, distinct
from trajcli.errors import MissingLimitError, Problem
from trajcli.frozen import comparable, frozen
from trajcli.geometry.paths.position import PositionCurve
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.robot import ToolLimits
from trajcli.planners.planner import Phase
from trajcli.planners.tool_path.law import LawSegment, LawSpec, PathBounds, law_segment

_SAMPLES = 257  # places at which the largest rates of the orientation are looked for
_ALONG, _ACROSS = 0.6, 0.8  # of an acceleration, where the path is bent: 0.6^2 + 0.8^2 = 1


@comparable
class PathDerivatives:
    """The largest derivatives of a path by its parameter.

    Attributes:
        way: Of the place: 1, or 0 where it rests.
        bend: Curvature of the place, 1/m.
        turn: Of the orientation, rad per unit.
        twist: Second derivative of the orientation, rad per unit squared.
    """

    way: float
    bend: float
    turn: float
    twist: float


@frozen
class ToolLaw:
    """s(t) over the whole path.

    Attributes:
        law: From t = 0, s from 0 to the length.
        breaks: Where a derivative of it jumps, s, ends included.
        phases: Named stretches of time.
        ruled_by: "translation" or "rotation", whichever is slower; None where a duration rules.
    """

    law: PiecewisePolynomial
    breaks: Array
    phases: tuple[Phase, ...]
    ruled_by: str | None


def path_derivatives(path: ToolPath) -> PathDerivatives:
    """Return the largest derivatives of a path, by sampling between its breaks."""
    places = distinct(np.concatenate([np.linspace(0.0, path.length, _SAMPLES), path.breaks]))
    sides = [path.poses.evaluate(places, side) for side in ("left", "right")]
    first, second = (np.stack([side[k] for side in sides]) for k in (1, 2))
    way = 0.0 if path.poses.pure_rotation else 1.0
    turn, twist = (_largest(rows[..., 3:]) for rows in (first, second))
    return PathDerivatives(way, _largest(second[..., :3]), turn, twist)


def segment_derivatives(place: PositionCurve, turn: float) -> PathDerivatives:
    """Return the largest derivatives of a segment whose orientation turns evenly, by `turn` rad/m."""
    places = np.linspace(0.0, place.length, _SAMPLES)
    return PathDerivatives(1.0, _largest(place.evaluate(places)[2]), turn, 0.0)


def _largest(rows: Array) -> float:
    return float(np.linalg.norm(rows, axis=-1).max())


def bounds_of(spec: LawSpec, limits: ToolLimits, rates: PathDerivatives) -> tuple[PathBounds, str]:
    """Return what the parameter may do, and whether translation or rotation says so.

    An acceleration that a law names is along the path; one that comes from the limits is of the tool, which a
    bent path also accelerates across: there 0.6 of it goes along and 0.8 across.
    """
    along, across = (1.0, math.inf) if rates.bend * rates.way == 0 else (_ALONG, _ACROSS)
    speed = _or(spec.speed, limits.speed)
    if spec.acceleration is None and rates.bend > 0 and rates.way:
        speed = min(speed, math.sqrt(across * limits.acceleration / rates.bend))
    acceleration = _or(spec.acceleration, along * limits.acceleration)
    slowing = _or(spec.deceleration, _or(spec.acceleration, along * limits.acceleration))
    place = PathBounds(speed, acceleration, slowing, _or(spec.jerk, limits.jerk))
    angular = _rotation_bounds(spec, limits, rates)
    if not rates.way:
        return replace(angular, unit="angle"), "rotation"
    both = place.with_each(angular, min)
    return both, "rotation" if angular.speed < place.speed else "translation"


def bounds_for(
    spec: LawSpec, limits: ToolLimits, rates: PathDerivatives, planner: str
) -> tuple[PathBounds, str | None]:
    """Return what a law of this shape may do, and whether translation or rotation says so.

    With a duration nothing is lowered by the limits, which the move is verified by: a law does what it names.

    Raises:
        MissingLimitError: When one that the shape needs is unlimited.
    """
    bounds, ruled_by = bounds_of(spec, limits, rates)
    if spec.duration is None:
        return require_bounds(spec, bounds, rates, planner), ruled_by
    named, _ = bounds_of(spec, ToolLimits(), rates)
    if spec.shape != "trapezoid":
        return named, None
    if math.isinf(named.speed):
        either = named.with_each(bounds, lambda own, other: own if math.isfinite(own) else other)
        named = replace(either, speed=math.inf)
        if math.isinf(min(named.acceleration, named.deceleration)):
            raise _missing("acceleration", rates, planner, spec)
    return named, None


def _rotation_bounds(spec: LawSpec, limits: ToolLimits, rates: PathDerivatives) -> PathBounds:
    """Return what the rotation lets the parameter do."""
    if rates.turn == 0:
        return PathBounds(math.inf, math.inf, math.inf, math.inf)
    speed = _or(spec.angular_speed, limits.angular_speed) / rates.turn
    acceleration = _or(spec.angular_acceleration, limits.angular_acceleration)
    if rates.twist > 0 and math.isfinite(acceleration):
        speed = min(speed, math.sqrt(_ACROSS * acceleration / rates.twist))
        acceleration *= _ALONG / 3  # w'' need not be perpendicular to w': sizes add up
    return PathBounds(speed, acceleration / rates.turn, acceleration / rates.turn, math.inf)


def _or(value: float | None, other: float) -> float:
    return other if value is None else value


def law_over(path: ToolPath, spec: LawSpec, limits: ToolLimits, planner: str) -> ToolLaw:
    """Return the law of a shape over the whole path, at rest at every place where the path must stop.

    A duration is shared by the stretches between stops as their lengths are.

    Raises:
        MissingLimitError: When neither the law nor the limits say how fast.
        PlanningError: When no such law exists.
    """
    rates = path_derivatives(path)
    bounds, ruled_by = bounds_for(spec, limits, rates, planner)
    stops = np.concatenate([[0.0], path.poses.stops, [path.length]])
    stretches = []
    for low, high in pairwise(stops.tolist()):
        length = high - low
        share = None if spec.duration is None else spec.duration * length / path.length
        stretches.append(law_segment(spec, length, bounds, share))
    total = sum(stretch.law.duration for stretch in stretches)
    if spec.minimum_duration is not None and total < spec.minimum_duration:
        stretches = [stretch.scaled(spec.minimum_duration / total) for stretch in stretches]
    return _joined(stretches, stops, ruled_by)


def _joined(stretches: list[LawSegment], stops: Array, ruled_by: str | None) -> ToolLaw:
    laws, breaks, phases, begins = [], [np.zeros(1)], [], 0.0
    for stretch, place in zip(stretches, stops[:-1], strict=True):
        coefficients = stretch.law.coefficients.copy()
        coefficients[-1] += place
        laws.append(PiecewisePolynomial(stretch.law.breaks, coefficients))
        breaks.append(stretch.breaks[1:] + begins)
        phases += [Phase(p.name, p.start + begins, p.end + begins) for p in stretch.phases]
        begins += stretch.law.duration
    return ToolLaw(concatenate(laws), np.concatenate(breaks), tuple(phases), ruled_by)


def require_bounds(spec: LawSpec, bounds: PathBounds, rates: PathDerivatives, planner: str) -> PathBounds:
    """Return the bounds that the fastest law of this shape needs.

    Raises:
        MissingLimitError: When one is unlimited.
    """
    ramps = math.isfinite(min(bounds.acceleration, bounds.deceleration))
    needs = {
        "speed": math.isfinite(bounds.speed) or spec.shape not in ("jerk_limited",),
        "acceleration": ramps or spec.shape not in ("trapezoid", "jerk_limited"),
        "jerk": math.isfinite(bounds.jerk) or spec.shape != "jerk_limited",
    }
    lacking = next((name for name, there in needs.items() if not there), None)
    if lacking is None and all(map(math.isinf, bounds.values())):
        lacking = "speed"
    if lacking is not None:
        raise _missing(lacking, rates, planner, spec)
    return bounds


def _missing(name: str, rates: PathDerivatives, planner: str, spec: LawSpec) -> MissingLimitError:
    if name == "jerk" and not rates.way:
        message = f"a {spec.shape} law needs a jerk, and a rotation in place has no limit of it"
        return MissingLimitError(Problem(message, "use shape quintic or cycloidal"))
    key = name if rates.way else f"angular_{name}"
    message = f"{planner} with a {spec.shape} law needs the {key.replace('_', ' ')} of the tool"
    more = "" if spec.shape == "jerk_limited" else " or a `duration`"
    if spec.duration is not None:
        speed = "speed" if rates.way else "angular_speed"
        message, more = f"{message}, or its {speed.replace('_', ' ')}", f" or `{speed}`"
    hint = f"add `limits: {{tcp: {{{key}: ...}}}}` to the job, or `{key}`{more} to the `law`"
    return MissingLimitError(Problem(message, hint))
