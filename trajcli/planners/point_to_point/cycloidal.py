"""The cycloidal law on a straight line in joint space."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from trajcli.curves.operations import along_line
from trajcli.curves.piecewise import Array
from trajcli.curves.rest_to_rest import PEAKS, cycloid_law
from trajcli.kinematics.robot import Robot
from trajcli.language.targets import Duration
from trajcli.planners.boundary_states import same_state, standstill, start_in_motion, unknown_duration
from trajcli.planners.planner import Planned
from trajcli.planners.point_to_point.point_to_point import PointToPoint
from trajcli.trajectory import State

FORMULAS = (
    "t/{T} - sin(2 pi t/{T})/(2 pi)",
    "(1 - cos(2 pi t/{T}))/{T}",
    "(2 pi/{T}^2) sin(2 pi t/{T})",
)
"""s(t) over the duration T and its first two derivatives, as they are printed."""


class Cycloidal(PointToPoint):
    """Rest to rest with a sine-shaped acceleration, zero at both ends.

    Source: Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots (2008), section
    2.2.2; Siciliano et al., Robotics: Modelling, Planning and Control (2009), problem 4.2.
    """

    continuity: ClassVar[Literal[1, 2]] = 2
    one_shape: ClassVar[bool] = True
    imposes: ClassVar[int] = 0

    planner: Literal["cycloidal"] = "cycloidal"
    duration: Duration | None = None

    def plan(self, start: State, robot: Robot) -> Planned:
        """Return the move to the target.

        Raises:
            MissingLimitError: When the duration is left out and a moving joint has no limit.
            PlanningError: When the arm moves at the start.
        """
        if not start.at_rest:
            raise start_in_motion(self.tag, start, robot)
        end = self.to.as_state()
        if same_state(start, end):
            return standstill(end, self.duration or 0.0)
        displacement = end.position - start.position
        law = cycloid_law(self.duration or self._fastest(displacement, robot))
        return Planned(along_line(start.position, displacement, law), end, law=law, formulas=FORMULAS)

    def _fastest(self, displacement: Array, robot: Robot) -> float:
        """Return the shortest duration (s) in which all joints keep their limits."""
        durations = []
        for order in (1, 2, 3):
            bounds = robot.limits.of_order(order)
            bound = np.min(np.abs(bounds), axis=1)  # acceleration and jerk peak in both directions
            if order == 1:
                bound = np.where(displacement < 0, -bounds[:, 0], bounds[:, 1])
            durations.append((PEAKS[order] * np.abs(displacement) / bound) ** (1 / order))
        longest = np.max(durations, axis=0)
        lacking = np.flatnonzero((displacement != 0) & (longest == 0))
        if lacking.size:
            raise unknown_duration(self.tag, "velocity", lacking.tolist(), robot)
        return float(longest.max())
