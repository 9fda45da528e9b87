"""Segments of composite paths: their fields, and the curves and targets that these mean.

What people record has segments without length, and places where the path turns back: the former count for
nothing, and the latter are stopped at.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Annotated, Any

import numpy as np
from pydantic import Field, GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, Problem, TrajcliError
from trajcli.geometry.paths.corner import REVERSAL, turn_between
from trajcli.geometry.paths.position import SAME_POINT, Line, PositionCurve
from trajcli.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from trajcli.kinematics.following.tool_path import SpeedLimits
from trajcli.kinematics.robot import Robot, ToolLimits
from trajcli.language.limits import AngularSpeed, ToolSpeed
from trajcli.language.numbers import (
    AT_KEY,
    FlawError,
    Model,
    Number,
    ReadingContext,
    flaws_below,
    object_schema,
    refuse,
    refuse_flaws,
    shown,
)
from trajcli.language.points import ListOrRecorded, NamedTarget
from trajcli.language.recorded import RecordedPoses
from trajcli.language.targets import Target
from trajcli.planners.planner import Event
from trajcli.planners.tool_path.arc import ArcFields, arc_of, arc_target
from trajcli.planners.tool_path.law import LawSpec
from trajcli.planners.tool_path.move import ToolTarget, flaws_of_target, tool_target
from trajcli.units import Quantity

_SAME_TURN = 1e-9  # rad: rounding of rotations
_MERGE = Number(
    Quantity("length"),
    "Poses that are no further than this from the one before are left out (length unit).",
    at_least=0.0,
)


class SegmentLaw(Model):
    """Speeds of the tool on one segment, instead of those of the move's law."""

    speed: ToolSpeed | None = None
    angular_speed: AngularSpeed | None = None

    @model_validator(mode="after")
    def _says_something(self) -> SegmentLaw:
        if self.speed is None and self.angular_speed is None:
            hint = "leave it out, or say law: {speed: ...}"
            raise refuse([((), "the law of a segment gives `speed`, `angular_speed` or both", hint)])
        return self


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

    law: Annotated[
        SegmentLaw | None,
        Field(description="Of this segment, instead of the move's; the move's has the shape time_optimal."),
    ] = None

    @model_validator(mode="after")
    def _is_one(self) -> Segment:
        if (self.line is None) == (self.arc is None):
            raise refuse([((), "a segment is either a `line` or an `arc`", None)])
        if self.line is not None:
            refuse_flaws(flaws_of_target(self.line, ("line",), "a segment"))
        return self


_SCHEMA_OF_FILE = object_schema(
    {
        "csv": {
            "type": "string",
            "description": "A file of poses, relative to the job's folder: columns x, y, z (m, or x_mm ...) "
            "and qw, qx, qy, qz as `pose` writes them; without these the orientation is kept.",
        },
        "in": {"type": "string", "description": "The frame in which they are given; world if left out."},
        "merge": {
            **_MERGE.json_schema(),
            "default": 0,
            "description": _MERGE.description,
        },
    },
    "csv",
)


class SegmentsField(ListOrRecorded):
    """Lets {csv: PATH} stand for lines to the poses of a file."""

    listed = Annotated[list[Segment], Field(min_length=1)]
    recorded = RecordedPoses

    def from_mapping(self, value: Mapping[str, Any], context: ReadingContext) -> RecordedPoses:
        """Return the poses of a file, in world, m."""
        keys = ("csv", "in", "merge")
        unknown = [str(key) for key in value if key not in keys]
        if unknown:
            from trajcli.suggest import did_you_mean, valid_names

            hint = did_you_mean(unknown[0], keys) or valid_names(keys)
            raise FlawError(f"unknown key '{unknown[0]}'", unknown[0], AT_KEY, hint=hint)
        path = value.get("csv")
        if not isinstance(path, str):
            raise FlawError(
                f"expected the path of a file, got {shown(path)}", *(["csv"] if "csv" in value else [])
            )
        if context.read_poses is None:
            raise FlawError("only a job can read a file of poses", "csv", hint="list the segments")
        with flaws_below("merge"):
            merge = _MERGE.read(value.get("merge", 0.0), context)
        poses = replace(context.read_poses(path), merge=merge)
        if "in" not in value:
            return poses
        from trajcli.language.frames import frame_named

        with flaws_below("in"):
            frame = frame_named(value["in"], context)
        return _in_frame(poses, frame)

    def written(
        self,
        value: RecordedPoses,
        serialize: core_schema.SerializerFunctionWrapHandler,
        context: ReadingContext,
    ) -> Any:  # noqa: ANN401
        """Return the lines to the poses."""
        return serialize(_lines_to(value))

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return {"anyOf": [handler(schema), _SCHEMA_OF_FILE]}


def _in_frame(poses: RecordedPoses, frame: Array) -> RecordedPoses:
    """Return poses that are given in a frame T_world_frame (4, 4), in world."""
    positions, turned = poses.positions @ frame[:3, :3].T + frame[:3, 3], poses.quaternions
    if turned is not None:
        turned = np.asarray(quaternion_from_matrix(frame[:3, :3] @ matrix_from_quaternion(turned)))
    return RecordedPoses(positions, turned, poses.file, poses.merge)


def line_to(poses: RecordedPoses, index: int) -> Segment:
    """Return the line to one of some poses."""
    position, turned = tuple(poses.positions[index].tolist()), poses.quaternions
    rotation = None if turned is None else tuple(turned[index].tolist())
    return Segment.model_construct(line=Target.model_construct(xyz=position, quat_wxyz=rotation))


def _lines_to(poses: RecordedPoses) -> list[Segment]:
    return [line_to(poses, index) for index in range(len(poses.positions))]


def segments_from(
    given: Sequence[Segment] | RecordedPoses, before: Array
) -> tuple[Sequence[Segment], list[Event]]:
    """Return the segments of a path from a pose (4, 4), and the event of recorded poses that are left out."""
    if not isinstance(given, RecordedPoses):
        return given, []
    poses = given.after(before[:3, 3])
    count = len(given.positions) - int(given.begins_at(before[:3, 3])) - len(poses.positions)
    text = f"left out {count} of {len(given.positions)} poses of {given.file}: too near to the one before"
    return _lines_to(poses), [Event("merged", text)] if count else []


def curves_of(
    before: Array, segments: Sequence[Segment], robot: Robot
) -> tuple[list[PositionCurve], list[ToolTarget], list[int]]:
    """Return curve, target and index of each segment: a line to where the tool is already is left out.

    Args:
        before: Pose at the start, (4, 4).
        segments: In order.
        robot: For targets by its joints.

    Raises:
        InputError: When one fixes another part of the orientation than the one before.
        TrajcliError: When an arc cannot be; with the place of its segment.
    """
    curves: list[PositionCurve] = []
    targets: list[ToolTarget] = []
    kept: list[int] = []
    pose = before
    last = len(segments) - 1
    for index, segment in enumerate(segments):
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


def merged_events(count: int, kept: Sequence[int]) -> list[Event]:
    """Return the event of segments without a length that were left out."""
    left = sorted({*range(count)} - {*kept})
    if not left:
        return []
    message = f"segment {left[0]} counts for nothing: it ends where it begins"
    more = f"; {len(left) - 1} more likewise" if len(left) > 1 else ""
    return [Event("merged", message + more)]


def _in_segment(index: int, problem: Problem) -> Problem:
    """Return a problem that stands in a segment, with the place of that."""
    below = problem.field or ()
    return replace(problem.within(f"segment {index}"), field=("segments", index, *below))


def corner_radii(segments: Sequence[Segment], kept: Sequence[int], radius: float) -> list[float]:
    """Return the radius of each corner between the segments that are kept, m: the least that is given.

    Args:
        segments: All of them.
        kept: Indices of those with a length, k.
        radius: Where none of those between gives one, m.
    """
    radii = []
    for first, last in pairwise(kept):
        given = [s.radius for s in segments[first:last] if s.radius is not None]
        radii.append(min(given, default=radius))
    return radii


def stepping_speeds(
    segments: Sequence[Segment], kept: Sequence[int], borders: Array, law: LawSpec, limits: ToolLimits
) -> SpeedLimits | None:
    """Return the limits of speed that step from segment to segment; None where no segment has a law.

    Args:
        segments: All of them.
        kept: Indices of those with a length, k.
        borders: Where these begin, and the end, m, (k + 1,).
        law: Of the move, for segments that do not say otherwise.
        limits: Of the tool, where the law does not.
    """
    if all(segments[k].law is None for k in kept):
        return None
    own = [segments[k].law or SegmentLaw.model_construct() for k in kept]
    speed, angular = (
        np.array([getattr(each, name) or getattr(law, name) or getattr(limits, name) for each in own])
        for name in ("speed", "angular_speed")
    )
    steps = (speed[1:] != speed[:-1]) | (angular[1:] != angular[:-1])
    first = np.append(True, steps)
    ends = np.append(borders[:-1][first], borders[-1])
    begins = [0, *np.array(kept)[1:][steps].tolist(), len(segments)]
    return SpeedLimits(ends, tuple(begins), speed[first], angular[first])


def turning_back(
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
