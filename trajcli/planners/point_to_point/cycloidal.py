"""The cycloidal law on a straight line in joint space."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from trajcli.curves.cycloid import PEAKS, cycloid_law
from trajcli.curves.operations import along_line
from trajcli.kinematics.robot import Robot
from trajcli.language.targets import Duration
from trajcli.planners.planner import Planned
from trajcli.planners.point_to_point.point_to_point import (
    PointToPoint,
    bound_along,
    missing_limit,
    require_rest,
    same_state,
    standstill,
)
from trajcli.trajectory import State

FORMULA = "t/{T} - sin(2 pi t/{T})/(2 pi)"


class Cycloidal(PointToPoint):
    """Rest to rest with a sine-shaped acceleration, zero at both ends.

    Source: Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots (2008), section
    2.2.2; Siciliano et al., Robotics: Modelling, Planning and Control (2009), problem 4.2.
    """

    continuity: ClassVar[Literal[1, 2]] = 2
    imposes: ClassVar[int] = 0

    planner: Literal["cycloidal"] = "cycloidal"
    duration: Duration | None = None

    def plan(self, start: State, robot: Robot) -> Planned:
        """Return the move to the target.

        Raises:
            MissingLimitError: When the duration is left out and a moving joint has no limit.
            PlanningError: When the arm moves at the start.
        """
        require_rest(self.tag, start, robot)
        end = self.to.as_state()
        if same_state(start, end):
            return standstill(end, self.duration or 0.0)
        displacement = end.position - start.position
        law = cycloid_law(self.duration or self._fastest(displacement, robot))
        return Planned(along_line(start.position, displacement, law), end, law=law, formula=FORMULA)

    def _fastest(self, displacement: np.ndarray, robot: Robot) -> float:
        sizes = []
        for order in (1, 2, 3):
            bounds = robot.limits.of_order(order)
            # acceleration and jerk reach their peak in both directions
            bound = bound_along(bounds, displacement) if order == 1 else np.min(np.abs(bounds), axis=1)
            sizes.append((PEAKS[order] * np.abs(displacement) / bound) ** (1 / order))
        bounded = np.max(sizes, axis=0)
        lacking = np.flatnonzero((displacement != 0) & (bounded == 0))
        if lacking.size:
            why = "to find its fastest duration"
            raise missing_limit(
                self.tag, "velocity", lacking.tolist(), robot, why, "give the move a `duration`"
            )
        return float(bounded.max())
