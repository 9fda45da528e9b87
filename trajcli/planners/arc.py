"""A circular arc or a helix of the tool."""

from __future__ import annotations

from typing import Literal

from trajcli.curves.piecewise import Array
from trajcli.kinematics.robot import Robot
from trajcli.planners.arc_fields import ArcFields
from trajcli.planners.operational import OperationalMove, Way


class Arc(OperationalMove, ArcFields):
    """Along a circle, also several turns, or a helix.

    Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.3.1.
    """

    planner: Literal["arc"] = "arc"

    def way(self, before: Array, robot: Robot) -> Way:
        """Return the arc from the pose `before` (4, 4)."""
        from trajcli.planners.tool_arcs import arc_way

        return arc_way(before, self, self.orientation, robot)
