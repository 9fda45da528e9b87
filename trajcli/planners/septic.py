"""Polynomials of the seventh degree."""

from __future__ import annotations

from typing import ClassVar, Literal

from trajcli.planners.polynomial import PolynomialPlanner


class Septic(PolynomialPlanner):
    """Seventh degree: position, velocity and acceleration imposed at both ends, jerk zero there.

    Source: Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots (2008), section
    2.1.5.
    """

    continuity: ClassVar[Literal[1, 2]] = 2
    imposes: ClassVar[int] = 2
    conditions: ClassVar[int] = 4

    planner: Literal["septic"] = "septic"
