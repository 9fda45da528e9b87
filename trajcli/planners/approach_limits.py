"""Limits of velocity by position of a robot, as constraints on the motion along a path of its joints."""

from __future__ import annotations

from typing import TYPE_CHECKING

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.errors import Amount, Amounts, PlanningError, Problem
from trajcli.kinematics.robot import Robot

if TYPE_CHECKING:
    from trajcli.curves.time_optimal.constraints import PathConstraint

_NONE = 1e-9  # SI: a velocity limit below it lets nothing move


def approach_constraints(path: PiecewisePolynomial, robot: Robot) -> tuple[PathConstraint, ...]:
    """Return the constraint by which velocities are limited by position; none where no joint has such limits.

    Args:
        path: q(s).
        robot: With the limits in force.

    Raises:
        PlanningError: When the path leads a joint towards its position limit where it may not move there.
    """
    if not robot.limits.has_velocity_by_position:
        return ()
    from trajcli.curves.approach import approach_uses
    from trajcli.curves.time_optimal.constraints import ApproachConstraint

    limits = robot.limits.approach
    for use in approach_uses(path.breaks, path.coefficients, limits):
        if abs(use.limit) < _NONE < abs(use.velocity):
            name = robot.joint_names[use.component]
            message = "{joint} would move towards its position limit, {distance} from it, where it may not"
            amounts: Amounts = {"joint": name, "distance": Amount(max(use.distance, 0.0), 0, use.component)}
            hint = "keep further from the limit: velocity_by_position allows no motion towards it so near"
            raise PlanningError(Problem(message, hint, joint=name, amounts=amounts))
    return (ApproachConstraint(path, limits),)
