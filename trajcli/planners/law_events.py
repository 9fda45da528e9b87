"""Events of jerk-limited laws along paths: how they were found, and how near to the optimum."""

from __future__ import annotations

from typing import TYPE_CHECKING

from trajcli.errors import Amount, Amounts
from trajcli.kinematics.robot import Robot
from trajcli.planners.planner import Event

if TYPE_CHECKING:
    from trajcli.curves.third_order.parameterization import JerkLimitedMotion


def solved_by_convex_steps(motion: JerkLimitedMotion) -> Event:
    """Return the remark that says how a law was found."""
    pieces, steps = motion.law.pieces, motion.steps
    return Event("refined", f"the law has {pieces} pieces after {steps} convex step{'s' * (steps != 1)}")


def distance_from_bound(motion: JerkLimitedMotion, robot: Robot, stretch: float = 1.0) -> Event:
    """Return the remark that says how much faster a motion along the same path may be at most.

    Args:
        motion: The fastest that was found.
        robot: For the name of a joint.
        stretch: By what factor it was slowed down after that.
    """
    above = 100.0 * max(motion.law.duration * stretch / motion.lower_bound - 1.0, 0.0)
    text = f"at most {above:.2g} % above the fastest possible along this path: "
    amounts: Amounts = {"bound": Amount(motion.lower_bound, rounded="down")}
    if motion.bounding_joint is None:
        return Event(
            "bound", f"{text}without limits of jerk it takes {{bound}}, by estimate", amounts=amounts
        )
    text += "{joint} alone needs {bound} between its turning points"
    return Event("bound", text, amounts={**amounts, "joint": robot.joint_names[motion.bounding_joint]})
