"""A straight line of the tool, or a rotation in its place."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from trajcli.curves.piecewise import Array
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import refuse
from trajcli.language.targets import NamedTarget
from trajcli.planners.operational import OperationalMove, Way
from trajcli.planners.tool_fields import flaws_of_target


class Line(OperationalMove):
    """Straight to the target; where only the orientation differs, the tool turns in its place.

    Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.3.
    """

    planner: Literal["line"] = "line"
    to: Annotated[NamedTarget, Field(description="Where the move ends, or the name of a point.")]

    @model_validator(mode="after")
    def _ends_at_rest(self) -> Line:
        flaws = list(flaws_of_target(self.to, ("to",), self.tag))
        if flaws:
            raise refuse(flaws)
        return self

    def way(self, before: Array, robot: Robot) -> Way:
        """Return the line from the pose `before` (4, 4)."""
        from trajcli.planners.tool_ways import line_way

        return line_way(before, self.to, self.orientation, robot)
