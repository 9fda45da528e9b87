"""Stay where the arm stands."""

from __future__ import annotations

from typing import ClassVar, Literal

from trajcli.kinematics.robot import Robot
from trajcli.language.targets import Duration
from trajcli.planners.planner import Planned, Planner
from trajcli.planners.point_to_point import require_rest, standstill
from trajcli.trajectory import State


class Hold(Planner):
    """Hold the position for a given time; starts and ends at rest."""

    continuity: ClassVar[Literal[1, 2]] = 1

    planner: Literal["hold"] = "hold"
    duration: Duration

    def plan(self, start: State, robot: Robot) -> Planned:
        """Return the standstill.

        Raises:
            PlanningError: When the arm moves at the start.
        """
        require_rest(self.tag, start, robot)
        return standstill(start, self.duration)
