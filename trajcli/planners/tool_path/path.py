"""A chain of lines and arcs of the tool under one law.

From the segments of a path to the way of its tool: joined by stops or rounded corners, or overlapping.

Segments that overlap in time: each begins before the one before it has ended, so that corners are cut.

The place is p0 + sum_i (c_i(s_i(t)) - c_i(0)), the textbook's formula for a chain of anticipated segments,
and the orientation R0 prod_i exp(f_i(t) v_i) with the rotation vectors v_i of the segments and the part f_i
of each that is done.

Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.3.2, eq. 4.43.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from trajcli.curves.operations import merge_breaks
from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side, concatenate, constant
from trajcli.errors import Amount, InputError, PlanningError, Problem, TrajcliError
from trajcli.frozen import frozen
from trajcli.geometry.paths.chain import Chain, Corner, join
from trajcli.geometry.paths.orientation import turn_vectors
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.geometry.paths.position import Line, PositionCurve
from trajcli.geometry.rotation import exp
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.following.tolerance import Tolerance
from trajcli.kinematics.following.tool_path import ToolPath, ToolReference
from trajcli.kinematics.robot import Robot, ToolLimits
from trajcli.language.numbers import Flaw, Model, Number, refuse
from trajcli.language.targets import NamedTarget
from trajcli.planners.planner import Event
from trajcli.planners.tool_path.arc import ArcFields, arc_of, arc_target, notes_of
from trajcli.planners.tool_path.law import LawSegment, law_segment
from trajcli.planners.tool_path.law_bounds import bounds_for, segment_derivatives
from trajcli.planners.tool_path.move import PlannedPath, ToolPathMove
from trajcli.planners.tool_path.target import ToolTarget, flaws_of_target, orientation_along, tool_target
from trajcli.units import Quantity

Radius = Annotated[
    float,
    Number(
        Quantity("length"), "Way before and after a corner over which it is rounded (length unit).", above=0.0
    ),
]


class Segment(Model):
    """A line or an arc of a path, from where the one before ends."""

    line: Annotated[NamedTarget | None, Field(description="Where a straight segment ends.")] = None
    arc: ArcFields | None = None
    radius: Radius | None = None

    @model_validator(mode="after")
    def _is_one(self) -> Segment:
        if (self.line is None) == (self.arc is None):
            raise refuse([((), "a segment is either a `line` or an `arc`", None)])
        flaws = [] if self.line is None else list(flaws_of_target(self.line, ("line",), "a segment"))
        if flaws:
            raise refuse(flaws)
        return self


class PathMove(ToolPathMove):
    """Lines and arcs under one law; corners are stopped at, rounded, or cut by overlapping in time.

    Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.3.2.
    """

    planner: Literal["path"] = "path"
    segments: Annotated[list[Segment], Field(min_length=1, description="Lines and arcs, in order.")]
    corner: Annotated[
        Literal["stop", "round", "overlap"],
        Field(
            description="stop: at rest in each corner; round: with a smooth curve of the given `radius`; "
            "overlap: each segment begins before the last one ends, by the time `overlap`."
        ),
    ] = "round"
    radius: Radius | None = None
    overlap: (
        Annotated[
            float, Number(Quantity("time"), "Time by which neighbouring segments overlap, s.", above=0.0)
        ]
        | None
    ) = None

    @model_validator(mode="after")
    def _corners_fit(self) -> PathMove:
        flaws = list(self._flaws())
        if flaws:
            raise refuse(flaws)
        return self

    def _flaws(self) -> Iterator[Flaw]:
        yield from self._flaws_of_radii()
        if self.corner == "overlap":
            yield from self._flaws_of_overlap()
        elif self.overlap is not None:
            yield ("overlap",), f"corner: {self.corner} does not overlap", "say `corner: overlap`"

    def _flaws_of_radii(self) -> Iterator[Flaw]:
        if self.corner == "round":
            for k, segment in enumerate(self.segments[:-1]):
                if segment.radius is None and self.radius is None:
                    hint = "give the move, or each segment, a `radius`"
                    yield ("segments", k), "the corner after this segment has no radius", hint
            return
        text, hint = f"corner: {self.corner} has no radius", "say `corner: round`"
        if self.radius is not None:
            yield ("radius",), text, hint
        for k, segment in enumerate(self.segments):
            if segment.radius is not None:
                yield ("segments", k, "radius"), text, hint

    def _flaws_of_overlap(self) -> Iterator[Flaw]:
        if self.overlap is None:
            yield ("corner",), "corner: overlap needs the time `overlap`", None
        if self.law.shape == "time_optimal":
            text = "segments that overlap have laws of their own"
            yield ("law",), text, "use another shape, or corner: round"
        if self.orientation in ("euler", "tangent"):
            text = f"orientation: {self.orientation} is not defined where segments overlap"
            yield ("orientation",), text, "use axis_angle or fixed, or corner: round"

    def way(self, before: Array, robot: Robot) -> PlannedPath:
        """Return the chain from the pose `before` (4, 4)."""
        return chain_path(before, self, robot)


_ONE_TIME = 1e-9  # of the duration: times this close to each other are one


@frozen
class Overlapped:
    """Segments under way, some at once.

    Attributes:
        before: Pose at the start, (4, 4).
        places: The segments.
        vectors: Rotation vectors of the segments, in the axes of where they begin, shape (k, 3).
        laws: s_i(t) over the whole duration.
        last: The target of the last segment.
        turns: Changes of yaw or pitch, rad, one for each segment.
    """

    before: Array
    places: tuple[PositionCurve, ...]
    vectors: Array
    laws: tuple[PiecewisePolynomial, ...]
    last: ToolTarget
    turns: Array

    def timed(self, times: Array, side: Side) -> ToolReference:
        """Return the demand at times (N,)."""
        count = times.size
        poses = np.tile(self.before, (count, 1, 1))
        first, second = np.zeros((count, 6)), np.zeros((count, 6))
        aims = np.zeros((count, 3))
        for place, vector, law, turn in zip(self.places, self.vectors, self.laws, self.turns, strict=True):
            rates = law.evaluate_orders(times, (0, 1, 2), side=side)[:, :, 0]
            s = np.clip(rates[:, 0], 0.0, place.length)
            p, slope, bend = place.evaluate(s, side)
            poses[:, :3, 3] += p - place.evaluate(np.zeros(1))[0]
            first[:, :3] += slope * rates[:, 1:2]
            second[:, :3] += bend * rates[:, 1:2] ** 2 + slope * rates[:, 2:]
            part = rates / place.length
            axis = poses[:, :3, :3] @ vector
            own = axis * part[:, 1:2]
            second[:, 3:] += axis * part[:, 2:] + np.cross(first[:, 3:], own)
            first[:, 3:] += own
            poses[:, :3, :3] = poses[:, :3, :3] @ exp(vector * part[:, :1])
            aims += turn * part
        target = self.last
        if target.orientation not in ("yaw", "pitch"):
            aims = aims[:, :0]
        else:
            aims[:, 0] += ToolPath.begins(self.before, target.orientation, target.tool_axis)
        return ToolReference(
            poses, first, second, target.position, target.orientation, target.tool_axis, aims
        )


def overlapped(
    before: Array,
    places: Sequence[PositionCurve],
    targets: Sequence[ToolTarget],
    move: PathMove,
    limits: ToolLimits,
    tolerance: Tolerance,
) -> ToolMotion:
    """Return the motion of segments that overlap by the move's time.

    Raises:
        PlanningError: When a segment is shorter than the overlap.
    """
    rotations = np.stack([before[:3, :3], *(target.pose[:3, :3] for target in targets)])
    if move.orientation == "fixed":
        orientation_along("fixed", before[:3, :3], targets, places[0], None)
    vectors = turn_vectors(rotations[:-1], rotations[1:])
    stretches = _stretches(places, vectors, move, limits)
    begins = np.concatenate([[0.0], np.cumsum([s.law.duration - (move.overlap or 0.0) for s in stretches])])
    _check(stretches, move.overlap or 0.0)
    end = float(begins[-1] + (move.overlap or 0.0))
    laws = [
        _padded(stretch.law, float(start), end) for stretch, start in zip(stretches, begins[:-1], strict=True)
    ]
    merged = merge_breaks(laws)
    whole = PiecewisePolynomial(merged.breaks, merged.coefficients.sum(axis=2, keepdims=True))
    edges = [stretch.breaks + start for stretch, start in zip(stretches, begins[:-1], strict=True)]
    breaks = _distinct(np.concatenate(edges), end)
    turns = np.array([target.turn for target in targets])
    segments = Overlapped(before, tuple(places), vectors, tuple(laws), targets[-1], turns)
    return ToolMotion(None, whole, segments.timed, breaks, tolerance)


def _stretches(
    places: Sequence[PositionCurve],
    vectors: Array,
    move: PathMove,
    limits: ToolLimits,
) -> list[LawSegment]:
    spec, total = move.law, sum(place.length for place in places)
    whole = None
    if spec.duration is not None:
        whole = spec.duration + (len(places) - 1) * (move.overlap or 0.0)
    stretches, crowd = [], _crowd(places)
    lower = replace(
        limits, acceleration=limits.acceleration / crowd, jerk=limits.jerk / 2
    )  # two at once add up
    for place, vector in zip(places, vectors, strict=True):
        rates = segment_derivatives(place, float(np.linalg.norm(vector)) / place.length)
        bounds, _ = bounds_for(spec, lower, rates, "path")
        share = None if whole is None else whole * place.length / total
        stretches.append(law_segment(spec, place.length, bounds, share))
    if spec.minimum_duration is None:
        return stretches
    lasts = sum(stretch.law.duration for stretch in stretches)
    least = spec.minimum_duration + (len(places) - 1) * (move.overlap or 0.0)
    return stretches if lasts >= least else [stretch.scaled(least / lasts) for stretch in stretches]


def _crowd(places: Sequence[PositionCurve]) -> float:
    """Return how many accelerations along a segment add up to where one slows down and the next speeds up."""
    turns = [
        after.evaluate(np.zeros(1))[1][0] - before.evaluate(np.array([before.length]), "left")[1][0]
        for before, after in pairwise(places)
    ]
    return max(1.0, *(float(np.linalg.norm(turn)) for turn in turns))


def _check(stretches: Sequence[LawSegment], overlap: float) -> None:
    for index, stretch in enumerate(stretches):
        sides = 1 if index in (0, len(stretches) - 1) else 2
        if stretch.law.duration < sides * overlap:
            message = f"segment {index} lasts {{lasts}}, too short to overlap its neighbours by {{overlap}}"
            amounts = {"lasts": Amount(stretch.law.duration), "overlap": Amount(overlap)}
            hint = "shorten `overlap`, or go slower"
            raise PlanningError(Problem(message, hint, amounts=amounts))


def _padded(law: PiecewisePolynomial, start: float, end: float) -> PiecewisePolynomial:
    """Return the law at rest before `start` and after it is done, over [0, end]."""
    before = constant(np.zeros(1), start)
    rest = end - start - law.duration
    after = constant(law.piece_ends()[1][-1], rest if rest > _ONE_TIME * end else 0.0)
    joined = concatenate([before, law, after])
    breaks = joined.breaks.copy()
    breaks[-1] = end
    return PiecewisePolynomial(breaks, joined.coefficients)


def _distinct(times: Array, end: float) -> Array:
    """Return the distinct times within [0, end], those that rounding keeps apart made one."""
    ordered = np.sort(np.clip(times, 0.0, end))
    keep = np.append(True, np.diff(ordered) > _ONE_TIME * end)
    distinct = ordered[keep]
    distinct[-1] = end
    return np.asarray(distinct)


_SHRUNK = 1e-9  # relative


def chain_path(before: Array, move: PathMove, robot: Robot) -> PlannedPath:
    """Return the way along the segments of a move from a pose (4, 4)."""
    places, targets = _segments(before, move, robot)
    overlap = move.overlap is not None and len(places) > 1
    radii = [0.0] * (len(places) - 1)
    if move.corner == "round":
        radii = [segment.radius or move.radius or 0.0 for segment in move.segments[:-1]]
    chain = join(places, np.array(radii))
    turning = orientation_along(move.orientation, before[:3, :3], targets, chain, chain.progress)
    poses = PoseCurve(chain, turning)
    if poses.jumps.size and not overlap:
        amounts = {"place": Amount(float(poses.jumps[0]), 0, None, "length")}
        message = "at the corner at s = {place} a tool that keeps its attitude to the path would jump"
        hint = "say `corner: round`, or orientation: axis_angle"
        raise PlanningError(Problem(message, hint, amounts=amounts))
    last = targets[-1]
    fixed = "all" if move.orientation == "tangent" else last.orientation
    turns = tuple(target.turn for target in targets)
    path = ToolPath(poses, last.position, fixed, last.tool_axis, turns, chain.progress)
    end = move.segments[-1].line or (move.segments[-1].arc and move.segments[-1].arc.to)
    way = PlannedPath(
        path, last.joints, end.configuration if end else None, (*notes_of(places), *_events(chain))
    )
    if not overlap:
        return way
    tolerance = Tolerance(move.tolerance.position, move.tolerance.angle)
    motion = overlapped(before, places, targets, move, robot.limits.tcp, tolerance)
    return replace(way, overlap=replace(motion, path=path, overlaps=True), events=notes_of(places))


def _segments(before: Array, move: PathMove, robot: Robot) -> tuple[list[PositionCurve], list[ToolTarget]]:
    places: list[PositionCurve] = []
    targets: list[ToolTarget] = []
    pose = before
    for index, segment in enumerate(move.segments):
        try:
            place, target = _segment(segment, pose, robot)
        except TrajcliError as error:
            problems = (replace(p, message=f"segment {index}: {p.message}") for p in error.problems)
            raise type(error)(*problems) from None
        if targets and (target.orientation, target.tool_axis) != (
            targets[-1].orientation,
            targets[-1].tool_axis,
        ):
            message = f"segment {index} fixes another part of the orientation than the one before"
            raise InputError(message, hint="give the targets of all segments the same kind of orientation")
        places.append(place)
        targets.append(target)
        pose = target.pose
    return places, targets


def _segment(segment: Segment, pose: Array, robot: Robot) -> tuple[PositionCurve, ToolTarget]:
    if segment.arc is not None:
        target = arc_target(segment.arc, pose, robot)
        return arc_of(segment.arc, pose, target, robot), target
    if segment.line is None:
        raise InputError("a segment is either a `line` or an `arc`")
    target = tool_target(segment.line, pose, robot)
    return Line(pose[:3, 3], target.pose[:3, 3]), target


def _events(chain: Chain) -> tuple[Event, ...]:
    events = []
    for number, corner in enumerate(chain.corners, 1):
        if corner.kind != "smooth" and corner.used < corner.asked * (1 - _SHRUNK):
            events.append(_shrunk(number, corner))
    return tuple(events)


def _shrunk(number: int, corner: Corner) -> Event:
    text = f"the radius of corner {number} was shrunk from {{asked}} to {{used}} to fit: it passes at {{by}}"
    amounts = {
        "asked": Amount(corner.asked, 0, None, "length"),
        "used": Amount(corner.used, 0, None, "length"),
        "by": Amount(corner.deviation, 0, None, "length"),
    }
    return Event("shrunk", text, amounts=amounts)
