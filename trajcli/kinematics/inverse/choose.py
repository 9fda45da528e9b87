"""The list of families, and which one an arm belongs to: seen from the lines of its DH table alone."""

from __future__ import annotations

from functools import lru_cache

from trajcli.kinematics.inverse import planar, positioning, spherical_wrist, three_parallel
from trajcli.kinematics.inverse.lines import Arm, arm_of
from trajcli.kinematics.inverse.method import Method
from trajcli.kinematics.robot import Robot

FAMILIES = (planar.match, spherical_wrist.match, three_parallel.match, positioning.match)


@lru_cache(maxsize=16)
def method_for(robot: Robot) -> Method:
    """Return how the inverse kinematics of a robot is found: the first family that fits, else numerically.

    Axes count as parallel when the sine of their angle is at most 1e-9, and as meeting when their distance is
    at most 1e-9 of the arm's length.

    Raises:
        InputError: When the robot has no geometry.
    """
    arm = arm_of(robot)
    for match in FAMILIES:
        method = match(arm)
        if method is not None:
            return method
    return numeric_method(arm)


def numeric_method(arm: Arm) -> Method:
    """Return the method for arms that no closed form fits."""
    count = len(arm.lines)
    if count > 6:
        reason = f"{count} joints are more than the six coordinates of a pose: the answers are a family"
    else:
        reason = f"no closed form for this chain ({arm.kinds}) is among the families"
    return Method("numeric: damped Newton from many seeds", "numeric", (), reason)
