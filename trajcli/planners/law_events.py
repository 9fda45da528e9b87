"""Events of jerk-limited laws along paths: how they were found, and how near to the optimum."""

from __future__ import annotations

from typing import TYPE_CHECKING

from trajcli.errors import Amount
from trajcli.planners.planner import Event

if TYPE_CHECKING:
    from trajcli.curves.third_order.parameterization import JerkLimitedMotion


def solved_by_convex_steps(motion: JerkLimitedMotion) -> Event:
    """Return the remark that says how a law was found."""
    pieces, steps = motion.law.pieces, motion.steps
    return Event("refined", f"the law has {pieces} pieces after {steps} convex step{'s' * (steps != 1)}")


def distance_from_bound(motion: JerkLimitedMotion, stretch: float = 1.0) -> Event:
    """Return the remark that says how much faster a motion along the same path may be at most.

    Args:
        motion: The fastest that was found.
        stretch: By what factor it was slowed down after that.
    """
    above = 100.0 * (motion.law.duration * stretch / motion.lower_bound - 1.0)
    text = f"at most {above:.2g} % above the fastest possible along this path: "
    amounts = {"bound": Amount(motion.lower_bound, rounded="down")}
    return Event("bound", f"{text}without limits of jerk it takes {{bound}}", amounts=amounts)
