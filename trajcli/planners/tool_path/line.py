"""Straight lines, pure rotations and screw motions of the tool, and what a job says of all its paths."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, model_validator

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.geometry.paths.orientation import FixedOrientation
from trajcli.geometry.paths.pose import PoseCurve, Screw
from trajcli.geometry.paths.position import SAME_POINT, Line, Pivot
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import Model, refuse_flaws
from trajcli.language.points import NamedTarget
from trajcli.language.targets import Target
from trajcli.planners.tool_path.law import LawSpec
from trajcli.planners.tool_path.move import (
    Orientation,
    PlannedPath,
    ToleranceSpec,
    ToolPathMove,
    ToolTarget,
    flaws_of_target,
    orientation_along,
    path_of_poses,
    path_to,
    tool_target,
)
from trajcli.planners.tool_path.weave import WovenMove

_SAME_ANGLE = 1e-12  # rad: a rotation by less is none


class LineMove(WovenMove):
    """Straight to the target; where only the orientation differs, the tool turns in its place.

    Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.3.
    """

    planner: Literal["line"] = "line"
    to: Annotated[NamedTarget, Field(description="Where the move ends, or the name of a point.")]

    @model_validator(mode="after")
    def _ends_at_rest(self) -> LineMove:
        refuse_flaws(flaws_of_target(self.to, ("to",), self.tag))
        return self

    def path_from(self, before: Array, robot: Robot) -> PlannedPath:
        """Return the line from the pose `before` (4, 4), or the rotation about the tcp."""
        target = tool_target(self.to, before, robot)
        start, end = before[:3, 3], target.pose[:3, 3]
        if np.linalg.norm(end - start) > SAME_POINT:
            return self.woven(path_to(Line(start, end), before, target, self, self.to))
        turning = orientation_along(self.orientation, before[:3, :3], [target], None, None, self.origin)
        if turning.length <= _SAME_ANGLE:
            return self.woven(_path_of_no_length(before, target, self.to))
        return self.woven(
            path_of_poses(PoseCurve(Pivot(start, end, turning.length), turning), target, self.to)
        )


class ScrewMove(ToolPathMove):
    """To the target along the one screw that leads there: translation along an axis, rotation about it.

    Source: Lynch and Park, Modern Robotics (2017), section 9.2.1.
    """

    planner: Literal["screw"] = "screw"
    to: Annotated[NamedTarget, Field(description="Where the move ends, or the name of a point.")]
    orientation: ClassVar[Literal["axis_angle"]] = "axis_angle"  # type: ignore[misc]

    @model_validator(mode="after")
    def _ends_at_rest(self) -> ScrewMove:
        refuse_flaws(flaws_of_target(self.to, ("to",), self.tag))
        return self

    def path_from(self, before: Array, robot: Robot) -> PlannedPath:
        """Return the screw from the pose `before` (4, 4)."""
        target = tool_target(self.to, before, robot)
        if target.orientation != "all":
            message = "a screw needs the whole orientation of its target"
            raise InputError(message, hint="give `rpy`, `quat_wxyz`, `matrix`, `axis_angle` or `euler`")
        screw = Screw(before, target.pose)
        if screw.length <= _SAME_ANGLE:
            return _path_of_no_length(before, target, self.to)
        return path_of_poses(screw, target, self.to)


def _path_of_no_length(before: Array, target: ToolTarget, to: Target) -> PlannedPath:
    poses = PoseCurve(Pivot(before[:3, 3], target.pose[:3, 3], 0.0), FixedOrientation(before[:3, :3], 0.0))
    return path_of_poses(poses, target, to)


class Defaults(Model):
    """What holds for every line, arc, path and screw that does not say otherwise."""

    law: Annotated[
        LawSpec | None,
        Field(
            description="Key by key, but for a law that names a shape or a duration; without a shape it is "
            "time_optimal."
        ),
    ] = None
    tolerance: Annotated[ToleranceSpec | None, Field(description="Key by key.")] = None
    orientation: Annotated[Orientation | None, Field(description="Of those that have one.")] = None
