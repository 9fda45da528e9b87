"""Point to point under bounds on velocity, acceleration and jerk, from any state to any state."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from trajcli.kinematics.robot import Robot
from trajcli.language.targets import MinimumDuration
from trajcli.planners.planner import Planned
from trajcli.planners.point_to_point import PointToPoint
from trajcli.trajectory import State


class JerkLimited(PointToPoint):
    """Fastest motion within the limits, from any state to any state, or to a velocity.

    Source: Berscheid and Kroeger, Jerk-limited Real-time Trajectory Generation with Arbitrary Target States
    (RSS 2021); Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots (2008),
    section 3.4.
    """

    continuity: ClassVar[Literal[1, 2]] = 2
    stops_anywhere: ClassVar[bool] = True

    planner: Literal["jerk_limited"] = "jerk_limited"
    minimum_duration: MinimumDuration | None = None
    synchronize: Annotated[
        Literal["time", "phase", "none"],
        Field(
            description="time: all joints arrive together; phase: one law for all joints, straight in joint "
            "space; none: each joint arrives by itself."
        ),
    ] = "time"

    def plan(self, start: State, robot: Robot) -> Planned:
        """Return the move to the target, or to its velocity where it has no joints.

        Raises:
            MissingLimitError: When a moving joint lacks a limit on velocity, acceleration or jerk.
            PlanningError: When no such motion exists.
        """
        from trajcli.planners.jerk_limited_motion import Request, plan_motion

        request = Request(
            start=start,
            end=self._end(start),
            control="velocity" if self.to.joints is None else "position",
            synchronize=self.synchronize,
            minimum_duration=self.minimum_duration or 0.0,
        )
        return plan_motion(request, robot)

    def _end(self, start: State) -> State:
        """Return the target; under velocity control its position means nothing."""
        if self.to.joints is not None:
            return self.to.as_state()
        zero = (0.0,) * start.position.size
        return State(
            start.position, np.array(self.to.velocity or zero), np.array(self.to.acceleration or zero)
        )
