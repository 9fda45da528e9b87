"""Events of laws: how they were found, how near they are to the optimum, which limit of jerk they keep."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from typing import TYPE_CHECKING

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, Amounts
from trajcli.kinematics.robot import Robot
from trajcli.planners.planner import Event

if TYPE_CHECKING:
    from trajcli.curves.time_optimal.parameterization import TimeOptimalMotion

_NEXT_TO_NOTHING = 1e-4  # percent


def how_found(motion: TimeOptimalMotion) -> list[Event]:
    """Return the remark that says how a law was found, if any."""
    steps, count = getattr(motion, "steps", None), motion.refinements
    if steps is not None:
        text = f"the law has {motion.law.pieces} pieces after {steps} convex step{'s' * (steps != 1)}"
    elif count:
        times = "once" if count == 1 else f"{count} times"
        text = f"the grid was refined {times}, to {motion.grid.size} grid points of the path"
    else:
        return []
    return [Event("refined", text)]


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


def jerk_events(names: Sequence[str], bounds: Iterable[Array]) -> list[Event]:
    """Return the event of jerk limits, (2,) of each joint, that differ by direction."""
    some = [name for name, (low, high) in zip(names, bounds, strict=True) if low != -high]
    text = (
        f"the jerk limit of {', '.join(some)} differs by direction: the smaller magnitude is kept both ways"
    )
    return [Event("jerk_limit_both_ways", text)] if some else []
