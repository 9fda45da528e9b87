"""Composite paths of lines and arcs: stops, rounded corners, and segments that overlap in time."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, InputError, PlanningError, Problem
from trajcli.geometry.paths.chain import Chain, Corner, join
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import Flaw, Number, refuse_flaws
from trajcli.language.recorded import RecordedPoses
from trajcli.language.targets import Target
from trajcli.planners.planner import Event
from trajcli.planners.tool_path.arc import center_events
from trajcli.planners.tool_path.move import PlannedPath, orientation_along
from trajcli.planners.tool_path.segments import (
    Segment,
    SegmentsField,
    corner_radii,
    curves_of,
    line_to,
    merged_events,
    segments_from,
    stepping_speeds,
    turning_back,
)
from trajcli.planners.tool_path.weave import WovenMove
from trajcli.units import Quantity

_SHRUNK = 1e-9  # relative
_MOST_EVENTS = 8  # corners that are shrunk: of more the worst is told

Radius = Annotated[
    float,
    Number(
        Quantity("length"), "Way before and after a corner over which it is rounded (length unit).", above=0.0
    ),
]


class PathMove(WovenMove):
    """Lines and arcs under one law; corners are stopped at, rounded, or cut by overlapping in time.

    Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.3.2.
    """

    planner: Literal["path"] = "path"
    segments: Annotated[
        list[Segment] | RecordedPoses,
        SegmentsField(),
        Field(description="Lines and arcs, in order, or a file of poses to which lines lead."),
    ]
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
        return _end_of(self._listed[-1])

    @property
    def _listed(self) -> Sequence[Segment]:
        """The segments; of recorded poses a line to the last one."""
        given = self.segments
        return [line_to(given, -1)] if isinstance(given, RecordedPoses) else given

    @property
    def _count(self) -> int:
        given = self.segments
        return len(given.positions) if isinstance(given, RecordedPoses) else len(given)

    @property
    def why_not_flown_by(self) -> str | None:
        """Why no motion can fly by a corner of this move; None where it can."""
        if self.corner == "overlap":
            return "its segments overlap in time"
        return super().why_not_flown_by

    @model_validator(mode="after")
    def _corners_fit(self) -> PathMove:
        refuse_flaws(self._flaws())
        return self

    def _flaws(self) -> Iterator[Flaw]:
        yield from self._flaws_of_radii()
        yield from self._flaws_of_laws()
        if self.corner == "overlap":
            yield from self._flaws_of_overlap()
        elif self.overlap is not None:
            yield ("overlap",), f"corner: {self.corner} does not overlap", "say `corner: overlap`"

    def _flaws_of_radii(self) -> Iterator[Flaw]:
        if self.corner == "round":
            if isinstance(self.segments, RecordedPoses) and self.radius is None and self._count > 1:
                text = "the corners between recorded poses have no radius"
                yield ("segments",), text, "give the move a `radius`"
            for k, segment in enumerate(self._listed[:-1]):
                if segment.radius is None and self.radius is None:
                    hint = "give the move, or each segment, a `radius`"
                    yield ("segments", k), "the corner after this segment has no radius", hint
            return
        text, hint = f"corner: {self.corner} has no radius", "say `corner: round`"
        if self.radius is not None:
            yield ("radius",), text, hint
        for k, segment in enumerate(self._listed):
            if segment.radius is not None:
                yield ("segments", k, "radius"), text, hint

    def _flaws_of_laws(self) -> Iterator[Flaw]:
        for k, segment in enumerate(self._listed):
            if segment.law is not None and not self.law.time_law.uses_joint_limits:
                text = f"a segment has a law of its own, and a {self.law.shape} law is one for the whole path"
                yield ("segments", k, "law"), text, "say law: {shape: time_optimal} in the move"

    def _flaws_of_overlap(self) -> Iterator[Flaw]:
        if self.weave is not None:
            yield ("weave",), "segments that overlap in time have no path to weave about", "use corner: round"
        if self.overlap is None:
            yield ("corner",), "corner: overlap needs the time `overlap`", None
        if self.law.time_law.uses_joint_limits:
            text = "segments that overlap have laws of their own"
            yield ("law",), text, "use another shape, or corner: round"
        if self.orientation in ("euler", "tangent"):
            text = f"orientation: {self.orientation} is not defined where segments overlap"
            yield ("orientation",), text, "use axis_angle or fixed, or corner: round"

    def _refuse_inner_pins(self) -> None:
        """Refuse joints that are pinned before the last segment; recorded poses pin none."""
        for index, segment in enumerate(self._listed[:-1]):
            inner = _end_of(segment)
            if inner is not None and inner.pinned is not None:
                message = f"a joint is pinned in segment {index}, and goes evenly along the whole path"
                raise InputError(Problem(message, "pin it in the last one", field=("segments", index)))

    def path_from(self, before: Array, robot: Robot) -> PlannedPath:
        """Return the segments, joined, from the pose `before` (4, 4)."""
        self._refuse_inner_pins()
        segments, left_out = segments_from(self.segments, before)
        curves, targets, kept = curves_of(before, segments, robot)
        radius = self.radius or 0.0 if self.corner == "round" else 0.0
        radii = corner_radii(segments, kept, radius)
        radii, turned_back = turning_back(curves, radii, kept)
        chain = join(curves, np.array(radii))
        how, start = self.orientation, before[:3, :3]
        turning = orientation_along(how, start, targets, chain, chain.progress, self.origin)
        poses = PoseCurve(chain, turning)
        if poses.jumps.size:
            raise _jump(float(poses.jumps[0]))
        last = targets[-1]
        fixed = "all" if self.orientation == "tangent" else last.orientation
        turns = tuple(target.turn for target in targets)
        speeds = stepping_speeds(segments, kept, chain.borders, self.law, robot.limits.tcp)
        path = ToolPath(poses, last.position, fixed, last.tool_axis, turns, chain.progress, speeds)
        to = _end_of(segments[-1])
        merged = merged_events(len(segments), kept)
        events = (*left_out, *merged, *turned_back, *center_events(curves), *_radius_events(chain))
        ends = [*(corner.s for corner in chain.corners), path.length]
        planned = PlannedPath(
            path,
            last.joints,
            to.configuration if to else None,
            events,
            targets=tuple(
                (("segments", k, *(("line",) if segments[k].arc is None else ("arc", "to"))), s)
                for k, s in zip(kept, ends, strict=True)
                if _end_of(segments[k]) is not None
            ),
        )
        if self.overlap is None or len(curves) == 1:
            return self.woven(planned)
        from trajcli.planners.tool_path.overlap import overlapping_motion

        motion = overlapping_motion(before, curves, targets, self, self.overlap, robot.limits.tcp)
        return replace(planned, overlap=replace(motion, path=path, overlaps=True))


def _jump(s: float) -> PlanningError:
    """Return the error of a tool whose attitude to the path jumps at a corner."""
    message = "at the corner at s = {place} a tool that keeps its attitude to the path would jump"
    hint = "say `corner: round`, or orientation: axis_angle"
    return PlanningError(Problem(message, hint, amounts={"place": Amount(s, 0, None, "length")}))


def _radius_events(chain: Chain) -> tuple[Event, ...]:
    shrunk = [
        (number, corner)
        for number, corner in enumerate(chain.corners, 1)
        if corner.kind != "smooth" and corner.used < corner.asked * (1 - _SHRUNK)
    ]
    if len(shrunk) <= _MOST_EVENTS:
        return tuple(_shrunk(*each) for each in shrunk)
    worst = _shrunk(*min(shrunk, key=lambda each: each[1].used / each[1].asked))
    return (replace(worst, message=f"{worst.message}; {len(shrunk) - 1} more corners likewise, by less"),)


def _shrunk(number: int, corner: Corner) -> Event:
    text = f"the radius of corner {number} was shrunk from {{asked}} to {{used}} to fit: it passes at {{by}}"
    amounts = {
        "asked": Amount(corner.asked, 0, None, "length"),
        "used": Amount(corner.used, 0, None, "length"),
        "by": Amount(corner.deviation, 0, None, "length"),
    }
    return Event("shrunk", text, amounts=amounts)


def _end_of(segment: Segment) -> Target | None:
    return segment.line if segment.arc is None else segment.arc.to
