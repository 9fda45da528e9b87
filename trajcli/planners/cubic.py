"""Polynomials of the third degree."""

from __future__ import annotations

from typing import ClassVar, Literal

from trajcli.planners.polynomial import PolynomialPlanner


class Cubic(PolynomialPlanner):
    """Third degree: position and velocity imposed at both ends; the acceleration steps there.

    Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.2.1.
    """

    continuity: ClassVar[Literal[1, 2]] = 1
    imposes: ClassVar[int] = 1
    conditions: ClassVar[int] = 2

    planner: Literal["cubic"] = "cubic"
