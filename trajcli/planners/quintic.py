"""Polynomials of the fifth degree."""

from __future__ import annotations

from typing import ClassVar, Literal

from trajcli.planners.polynomial import PolynomialPlanner


class Quintic(PolynomialPlanner):
    """Fifth degree: position, velocity and acceleration imposed at both ends.

    Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.2.1.
    """

    continuity: ClassVar[Literal[1, 2]] = 2
    imposes: ClassVar[int] = 2
    conditions: ClassVar[int] = 3

    planner: Literal["quintic"] = "quintic"
