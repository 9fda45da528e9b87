"""Composite paths of lines and arcs: stops, rounded corners, and segments that overlap in time.

Where segments overlap, each begins before the one before it has ended, so that corners are cut. The position
is p0 + sum_i (c_i(s_i(t)) - c_i(0)), the textbook's formula for anticipated segments, and the orientation
R0 prod_i exp(f_i(t) v_i) with the rotation vectors v_i of the segments and the part f_i of each that is done.

Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.3.2, eq. 4.43.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, model_validator

from trajcli.curves.operations import merge_breaks
from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side
from trajcli.errors import Amount, InputError, PlanningError, Problem, TrajcliError
from trajcli.frozen import frozen
from trajcli.geometry.paths.chain import Chain, Corner, join
from trajcli.geometry.paths.corner import REVERSAL, turn_between
from trajcli.geometry.paths.orientation import turn_vectors
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.geometry.paths.position import SAME_POINT, Line, PositionCurve
from trajcli.geometry.rotation import exp
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.following.tool_path import ToolPath, ToolReference
from trajcli.kinematics.robot import Robot, ToolLimits
from trajcli.language.numbers import Flaw, Model, Number, refuse
from trajcli.language.points import NamedTarget
from trajcli.language.targets import Target
from trajcli.planners.planner import Event
from trajcli.planners.tool_path.arc import ArcFields, arc_of, arc_target, center_events
from trajcli.planners.tool_path.derivatives import PathDerivatives, largest_norm
from trajcli.planners.tool_path.law import LawSegment, lasting_at_least, law_bounds
from trajcli.planners.tool_path.move import (
    PlannedPath,
    ToolPathMove,
    ToolTarget,
    flaws_of_target,
    orientation_along,
    tool_target,
)
from trajcli.units import Quantity

_ONE_TIME = 1e-9  # of the duration: times this close to each other are one
_SHRUNK = 1e-9  # relative
_SAME_TURN = 1e-9  # rad: rounding of rotations
_SAMPLES = 257  # of a segment at which its largest curvature is looked for

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
    radius: (
        Annotated[
            float,
            Number(
                Quantity("length"),
                "That of the corner after this segment, instead of the move's; 0 stops there (length unit).",
                at_least=0.0,
            ),
        ]
        | None
    ) = None

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

    @property
    def target(self) -> Target | None:
        """Where the last segment ends; None where an arc ends after an angle."""
        last = self.segments[-1]
        return last.line if last.arc is None else last.arc.to

    @property
    def why_not_flown_by(self) -> str | None:
        """Why no motion can fly by a corner of this move; None where it can."""
        if self.corner == "overlap":
            return "its segments overlap in time"
        if self.corner == "stop" and len(self.segments) > 1:
            return "it stops at corners of its own (`corner: stop`)"
        return super().why_not_flown_by

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
        if self.law.time_law.uses_joint_limits:
            text = "segments that overlap have laws of their own"
            yield ("law",), text, "use another shape, or corner: round"
        if self.orientation in ("euler", "tangent"):
            text = f"orientation: {self.orientation} is not defined where segments overlap"
            yield ("orientation",), text, "use axis_angle or fixed, or corner: round"

    def path_from(self, before: Array, robot: Robot) -> PlannedPath:
        """Return the segments, joined, from the pose `before` (4, 4)."""
        curves, targets, kept = _segments(before, self, robot)
        overlap = self.overlap is not None and len(curves) > 1
        radii, turned_back = _turning_back(curves, self._radii(kept), kept)
        chain = join(curves, np.array(radii))
        how, start = self.orientation, before[:3, :3]
        turning = orientation_along(how, start, targets, chain, chain.progress, self.origin)
        poses = PoseCurve(chain, turning)
        if poses.jumps.size and not overlap:
            raise _jump(float(poses.jumps[0]))
        last = targets[-1]
        fixed = "all" if self.orientation == "tangent" else last.orientation
        turns = tuple(target.turn for target in targets)
        path = ToolPath(poses, last.position, fixed, last.tool_axis, turns, chain.progress)
        to = self.segments[-1].line or (self.segments[-1].arc and self.segments[-1].arc.to)
        merged = _merged(len(self.segments), kept)
        events = (*merged, *turned_back, *center_events(curves), *(() if overlap else _radius_events(chain)))
        ends = [*(corner.s for corner in chain.corners), path.length]
        planned = PlannedPath(
            path,
            last.joints,
            to.configuration if to else None,
            events,
            targets=tuple(
                (("segments", k, "line") if segment.arc is None else ("segments", k, "arc", "to"), s)
                for k, segment, s in zip(kept, [self.segments[k] for k in kept], ends, strict=True)
                if segment.arc is None or segment.arc.to is not None
            ),
        )
        if not overlap:
            return planned
        motion = overlapping_motion(before, curves, targets, self, robot.limits.tcp)
        return replace(planned, overlap=replace(motion, path=path, overlaps=True))

    def _radii(self, kept: Sequence[int]) -> list[float]:
        """Return the radius of each corner between the segments that are kept, m: the least that is given."""
        if self.corner != "round":
            return [0.0] * (len(kept) - 1)
        radii = []
        for first, last in pairwise(kept):
            given = [s.radius for s in self.segments[first:last] if s.radius is not None]
            radii.append(min(given, default=self.radius or 0.0))
        return radii


def _jump(s: float) -> PlanningError:
    """Return the error of a tool whose attitude to the path jumps at a corner."""
    message = "at the corner at s = {place} a tool that keeps its attitude to the path would jump"
    hint = "say `corner: round`, or orientation: axis_angle"
    return PlanningError(Problem(message, hint, amounts={"place": Amount(s, 0, None, "length")}))


def _segments(
    before: Array, move: PathMove, robot: Robot
) -> tuple[list[PositionCurve], list[ToolTarget], list[int]]:
    """Return curve, target and index of each segment: a line to where the tool is already is left out."""
    curves: list[PositionCurve] = []
    targets: list[ToolTarget] = []
    kept: list[int] = []
    pose = before
    last = len(move.segments) - 1
    for index, segment in enumerate(move.segments):
        try:
            if _stays(segment, pose, robot) and (kept or index < last):
                continue
            curve, target = _segment(segment, pose, robot)
        except TrajcliError as error:
            raise type(error)(*(_in_segment(index, problem) for problem in error.problems)) from None
        if targets and (target.orientation, target.tool_axis) != (
            targets[-1].orientation,
            targets[-1].tool_axis,
        ):
            message = f"segment {index} fixes another part of the orientation than the one before"
            hint = "give the targets of all segments the same kind of orientation"
            raise InputError(Problem(message, hint, field=("segments", index)))
        curves.append(curve)
        targets.append(target)
        kept.append(index)
        pose = target.pose
    return curves, targets, kept


def _stays(segment: Segment, pose: Array, robot: Robot) -> bool:
    """Return whether it is a line to the pose (4, 4) in which the tool is already."""
    off = np.full((4, 4), 1.0) if segment.line is None else tool_target(segment.line, pose, robot).pose - pose
    return float(np.linalg.norm(off[:3, 3])) <= SAME_POINT and float(np.abs(off[:3, :3]).max()) <= _SAME_TURN


def _merged(count: int, kept: Sequence[int]) -> list[Event]:
    """Return the event of segments without a length that were left out."""
    left = sorted({*range(count)} - {*kept})
    some = "segment {}" if len(left) == 1 else f"{len(left)} segments, the first is {{}}:"
    message = "counts for nothing: it ends where it begins"
    return [Event("merged", f"{some.format(left[0])} {message}")] if left else []


def _in_segment(index: int, problem: Problem) -> Problem:
    """Return a problem that stands in a segment, with the place of that."""
    below = problem.field or ()
    return replace(problem.within(f"segment {index}"), field=("segments", index, *below))


def _turning_back(
    curves: Sequence[PositionCurve], radii: Sequence[float], kept: Sequence[int]
) -> tuple[list[float], list[Event]]:
    """Return the radii with 0, which stops, where the path turns back, and an event for each of these."""
    left, events = list(radii), []
    for k, (before, after) in enumerate(pairwise(curves)):
        if left[k] and turn_between(before, after) > np.pi - REVERSAL:
            left[k] = 0.0
            message = f"the path turns back behind segment {kept[k]}, and stops there"
            events.append(Event("turns_back", message))
    return left, events


def _segment(segment: Segment, pose: Array, robot: Robot) -> tuple[PositionCurve, ToolTarget]:
    if segment.arc is not None:
        target = arc_target(segment.arc, pose, robot)
        return arc_of(segment.arc, pose, target, robot), target
    if segment.line is None:
        raise InputError("a segment is either a `line` or an `arc`")
    target = tool_target(segment.line, pose, robot)
    return Line(pose[:3, 3], target.pose[:3, 3]), target


def _radius_events(chain: Chain) -> tuple[Event, ...]:
    """Return an event for each corner whose radius was shrunk."""
    return tuple(
        _shrunk(number, corner)
        for number, corner in enumerate(chain.corners, 1)
        if corner.kind != "smooth" and corner.used < corner.asked * (1 - _SHRUNK)
    )


def _shrunk(number: int, corner: Corner) -> Event:
    text = f"the radius of corner {number} was shrunk from {{asked}} to {{used}} to fit: it passes at {{by}}"
    amounts = {
        "asked": Amount(corner.asked, 0, None, "length"),
        "used": Amount(corner.used, 0, None, "length"),
        "by": Amount(corner.deviation, 0, None, "length"),
    }
    return Event("shrunk", text, amounts=amounts)


@frozen
class OverlappingSegments:
    """Segments of which two are in progress at once around each corner, and never more.

    Attributes:
        before: Pose at the start, (4, 4).
        curves: Positions of the segments.
        vectors: Rotation vectors of the segments, in the axes of where they begin, shape (k, 3).
        laws: s_i(t), each from the time at which its segment begins to that at which it is done.
        last: The target of the last segment.
        turns: Changes of yaw or pitch, rad, one for each segment.
    """

    before: Array
    curves: tuple[PositionCurve, ...]
    vectors: Array
    laws: tuple[PiecewisePolynomial, ...]
    last: ToolTarget
    turns: Array

    def reference_at(self, times: Array, side: Side) -> ToolReference:
        """Return what the tool shall do at times (N,)."""
        order = np.argsort(times, kind="stable")
        ordered, first, second = times[order], np.zeros((times.size, 6)), np.zeros((times.size, 6))
        begun, done = self._rows_in_progress(ordered, side)
        behind = np.searchsorted(done, np.arange(times.size), "right")
        poses, aims = self._poses[behind], np.zeros((times.size, 3))
        aims[:, 0] = np.append(0.0, np.cumsum(self.turns))[behind]
        for k in np.flatnonzero(begun < done).tolist():
            rows = slice(begun[k], done[k])
            self._add(k, ordered[rows], side, poses[rows], first[rows], second[rows], aims[rows])
        back = np.empty_like(order)
        back[order] = np.arange(order.size)
        target = self.last
        if target.orientation not in ("yaw", "pitch"):
            aims = aims[:, :0]
        else:
            aims[:, 0] += ToolPath.angle_of(self.before, target.orientation, target.tool_axis)
        return ToolReference(
            poses[back],
            first[back],
            second[back],
            target.position,
            target.orientation,
            target.tool_axis,
            aims[back],
        )

    def _rows_in_progress(self, ordered: Array, side: Side) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return the first row (k,) of increasing times in which each segment is begun, and is done."""
        opposite: Side = "right" if side == "left" else "left"
        starts, ends = (np.array([getattr(law, name) for law in self.laws]) for name in ("start", "end"))
        begun, done = (np.searchsorted(ordered, edges, opposite) for edges in (starts, ends))
        begun[0], done[-1] = 0, ordered.size  # start and end have one side only
        return begun, done

    def _add(
        self, k: int, times: Array, side: Side, poses: Array, first: Array, second: Array, aims: Array
    ) -> None:
        """Add what segment k does at times (m,) to the rows of those that began before it."""
        curve, law = self.curves[k], self.laws[k]
        rates = law.evaluate_orders(np.clip(times, law.start, law.end), (0, 1, 2), side=side)[:, :, 0]
        s = np.clip(rates[:, 0], 0.0, curve.length)
        p, tangent, curvature = curve.evaluate(s, side)
        poses[:, :3, 3] += p - curve.evaluate(np.zeros(1))[0]
        first[:, :3] += tangent * rates[:, 1:2]
        second[:, :3] += curvature * rates[:, 1:2] ** 2 + tangent * rates[:, 2:]
        part = rates / curve.length
        axis = poses[:, :3, :3] @ self.vectors[k]
        own = axis * part[:, 1:2]
        second[:, 3:] += axis * part[:, 2:] + np.cross(first[:, 3:], own)
        first[:, 3:] += own
        poses[:, :3, :3] = poses[:, :3, :3] @ exp(self.vectors[k] * part[:, :1])
        aims += self.turns[k] * part

    @cached_property
    def _poses(self) -> Array:
        """The pose (k + 1, 4, 4) after no segment, after the first one, and so on to the last."""
        poses = np.tile(self.before, (len(self.curves) + 1, 1, 1))
        for k, (curve, turned) in enumerate(zip(self.curves, exp(self.vectors), strict=True), 1):
            ends = curve.evaluate(np.array([0.0, curve.length]), "left")[0]
            poses[k, :3, 3] = poses[k - 1, :3, 3] + ends[1] - ends[0]
            poses[k, :3, :3] = poses[k - 1, :3, :3] @ turned
        return poses


def overlapping_motion(
    before: Array,
    curves: Sequence[PositionCurve],
    targets: Sequence[ToolTarget],
    move: PathMove,
    limits: ToolLimits,
) -> ToolMotion:
    """Return the motion of segments that overlap by the move's time.

    Raises:
        PlanningError: When a segment is shorter than the overlap.
    """
    rotations = np.stack([before[:3, :3], *(target.pose[:3, :3] for target in targets)])
    if move.orientation == "fixed":
        orientation_along("fixed", before[:3, :3], targets, curves[0], None)
    vectors = turn_vectors(rotations[:-1], rotations[1:])
    overlap = move.overlap or 0.0
    segments = _law_segments(curves, vectors, move, limits)
    starts = np.concatenate([[0.0], np.cumsum([segment.law.duration - overlap for segment in segments])])
    _check(segments, overlap)
    end = float(starts[-1] + overlap)
    pairs = list(zip(segments, starts[:-1], strict=True))
    laws = [
        PiecewisePolynomial(segment.law.breaks + start, segment.law.coefficients) for segment, start in pairs
    ]
    merged = merge_breaks([_in_turn(laws[first::2], end) for first in (0, 1)])
    whole = PiecewisePolynomial(merged.breaks, merged.coefficients.sum(axis=2, keepdims=True))
    breaks = _distinct(np.concatenate([segment.breaks + start for segment, start in pairs]), end)
    turns = np.array([target.turn for target in targets])
    tool = OverlappingSegments(before, tuple(curves), vectors, tuple(laws), targets[-1], turns)
    return ToolMotion(None, whole, tool.reference_at, breaks, move.tolerance.tolerance)


def _law_segments(
    curves: Sequence[PositionCurve], vectors: Array, move: PathMove, limits: ToolLimits
) -> list[LawSegment]:
    """Return the law of each segment, of which neighbours together keep the limits."""
    spec, total = move.law, sum(curve.length for curve in curves)
    shared = (len(curves) - 1) * (move.overlap or 0.0)
    lower = replace(  # two at once add up
        limits, acceleration=limits.acceleration / _largest_turn(curves), jerk=limits.jerk / 2
    )
    segments = []
    for curve, vector in zip(curves, vectors, strict=True):
        curvature = largest_norm(curve.evaluate(np.linspace(0.0, curve.length, _SAMPLES))[2])
        derivatives = PathDerivatives(True, curvature, float(np.linalg.norm(vector)) / curve.length, 0.0)
        bounds, _ = law_bounds(spec, lower, derivatives, "path")
        share = None if spec.duration is None else (spec.duration + shared) * curve.length / total
        segments.append(spec.time_law.segment(spec, curve.length, bounds, share))
    return lasting_at_least(spec.minimum_duration and spec.minimum_duration + shared, segments)


def _largest_turn(curves: Sequence[PositionCurve]) -> float:
    """Return how many accelerations along a segment add up to where one slows down and the next speeds up."""
    turns = [
        after.evaluate(np.zeros(1))[1][0] - before.evaluate(np.array([before.length]), "left")[1][0]
        for before, after in pairwise(curves)
    ]
    return max(1.0, *(float(np.linalg.norm(turn)) for turn in turns))


def _check(segments: Sequence[LawSegment], overlap: float) -> None:
    """Refuse segments that are too short for their overlaps."""
    for index, segment in enumerate(segments):
        sides = 1 if index in (0, len(segments) - 1) else 2
        if segment.law.duration < sides * overlap:
            message = f"segment {index} lasts {{lasts}}, too short to overlap its neighbours by {{overlap}}"
            amounts = {"lasts": Amount(segment.law.duration), "overlap": Amount(overlap)}
            hint = "shorten `overlap`, or go slower"
            raise PlanningError(Problem(message, hint, amounts=amounts))


def _in_turn(laws: Sequence[PiecewisePolynomial], end: float) -> PiecewisePolynomial:
    """Return what laws that do not overlap add up to over [0, end], at rest between them."""
    breaks, coefficients, s = np.zeros(1), list[Array](), np.zeros(1)
    for law in laws:
        if law.start - breaks[-1] > _ONE_TIME * end:
            coefficients.append(_at_rest(s, law))
            breaks = np.append(breaks, law.start)
        coefficients.append(law.coefficients.copy())
        coefficients[-1][-1] += s
        breaks = np.append(breaks, law.breaks[1:])
        s = s + law.piece_ends()[1][-1]
    if end - breaks[-1] > _ONE_TIME * end:
        coefficients.append(_at_rest(s, laws[-1]))
        breaks = np.append(breaks, end)
    breaks[-1] = end
    return PiecewisePolynomial(breaks, np.concatenate(coefficients, axis=1))


def _at_rest(s: Array, law: PiecewisePolynomial) -> Array:
    """Return the coefficients (degree + 1, 1, 1) of one piece at rest at s (1,), of the degree of a law."""
    return np.concatenate([np.zeros((law.degree, 1, 1)), s.reshape(1, 1, 1)])


def _distinct(times: Array, end: float) -> Array:
    """Return the distinct times within [0, end], those that rounding keeps apart made one."""
    ordered = np.sort(np.clip(times, 0.0, end))
    keep = np.append(True, np.diff(ordered) > _ONE_TIME * end)
    distinct = ordered[keep]
    distinct[-1] = end
    return np.asarray(distinct)
