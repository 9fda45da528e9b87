"""A screw motion of the tool: constant twist."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from trajcli.curves.piecewise import Array
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import refuse
from trajcli.language.targets import NamedTarget
from trajcli.planners.operational import OperationalMove, Way
from trajcli.planners.tool_fields import flaws_of_target


class Screw(OperationalMove):
    """To the target along the one screw that leads there: translation along an axis, rotation about it.

    Source: Lynch and Park, Modern Robotics (2017), section 9.2.1.
    """

    planner: Literal["screw"] = "screw"
    to: Annotated[NamedTarget, Field(description="Where the move ends, or the name of a point.")]
    orientation: ClassVar[Literal["axis_angle"]] = "axis_angle"  # type: ignore[misc]

    @model_validator(mode="after")
    def _ends_at_rest(self) -> Screw:
        flaws = list(flaws_of_target(self.to, ("to",), self.tag))
        if flaws:
            raise refuse(flaws)
        return self

    def way(self, before: Array, robot: Robot) -> Way:
        """Return the screw from the pose `before` (4, 4)."""
        from trajcli.planners.tool_ways import screw_way

        return screw_way(before, self.to, robot)
