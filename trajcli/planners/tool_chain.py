"""From the segments of a path to the way of its tool: joined by stops or rounded corners, or overlapping."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, InputError, PlanningError, Problem, TrajcliError
from trajcli.geometry.paths.chain import Chain, Corner, join
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.geometry.paths.position import Line, PositionCurve
from trajcli.kinematics.following.tolerance import Tolerance
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.robot import Robot
from trajcli.planners.operational import Way
from trajcli.planners.path import PathMove, Segment
from trajcli.planners.planner import Event
from trajcli.planners.tool_arcs import arc_of, arc_target, notes_of
from trajcli.planners.tool_orientation import orientation_along
from trajcli.planners.tool_overlap import overlapped
from trajcli.planners.tool_target import ToolTarget, tool_target

_SHRUNK = 1e-9  # relative


def chain_way(before: Array, move: PathMove, robot: Robot) -> Way:
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
    way = Way(path, last.joints, end.configuration if end else None, (*notes_of(places), *_events(chain)))
    if not overlap:
        return way
    tolerance = Tolerance(move.tolerance.position, move.tolerance.angle)
    motion = overlapped(before, places, targets, move, robot.limits.tcp, tolerance)
    return replace(way, overlap=replace(motion, path=path), events=notes_of(places))


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
