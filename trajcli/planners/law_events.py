"""Events of time-optimal laws along paths: how they were found, and how near to the optimum."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from trajcli.errors import Amount, Amounts
from trajcli.kinematics.robot import Robot
from trajcli.planners.planner import Event

if TYPE_CHECKING:
    from trajcli.curves.third_order.parameterization import JerkLimitedMotion
    from trajcli.curves.time_optimal.parameterization import TimeOptimalMotion

_NEXT_TO_NOTHING = 1e-4  # percent


def solved_by_convex_steps(motion: JerkLimitedMotion) -> Event:
    """Return the remark that says how a law was found."""
    pieces, steps = motion.law.pieces, motion.steps
    return Event("refined", f"the law has {pieces} pieces after {steps} convex step{'s' * (steps != 1)}")


def distance_from_bound(motion: TimeOptimalMotion, robot: Robot, stretch: float = 1.0) -> Event:
    """Return the remark that says how much faster a motion along the same path may be at most.

    Args:
        motion: The fastest that was found.
        robot: For the name of a joint.
        stretch: By what factor it was slowed down after that.
    """
    if motion.lower_bound == 0.0:
        return Event("bound", "nothing is known of the fastest possible along this path")
    above = 100.0 * max(motion.law.duration * stretch / motion.lower_bound - 1.0, 0.0)
    digit = 10.0 ** (math.floor(math.log10(above)) - 1) if above > _NEXT_TO_NOTHING else _NEXT_TO_NOTHING
    text = f"at most {math.ceil(above / digit) * digit:.9g} % above the fastest possible along this path: "
    joint = getattr(motion, "bounding_joint", None)
    amounts: Amounts = {"bound": Amount(motion.lower_bound, rounded="down")}
    if getattr(motion, "bounded_by_stops", False):
        text += "from stop to stop its slowest joints need {bound} in all"
        return Event("bound", text, amounts=amounts)
    if joint is None:
        text += "limits of velocity and acceleration alone ask for {bound}"
        return Event("bound", text, amounts=amounts)
    text += "{joint} alone needs {bound} between its turning points"
    return Event("bound", text, amounts={**amounts, "joint": robot.joint_names[joint]})
