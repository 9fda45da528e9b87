"""Limits of torques and forces for all t, by bounds of inverse dynamics with what the tool carries.

A limit does not scale with the duration: gravity and Coulomb friction stay, the rest shrinks. Where these
alone are over the limit no duration helps, though a motion that falls fast enough may keep the limit there.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.dynamics.effort_bound import (
    EffortPeak,
    EffortSurvey,
    effort_survey,
    needed_stretch,
)
from trajcli.dynamics.newton_euler import InverseDynamics
from trajcli.errors import Amount, Amounts, Problem, of_joint
from trajcli.findings import Finding, NamedJoints, at_time
from trajcli.frozen import frozen
from trajcli.kinematics.robot import Robot
from trajcli.limits.kinds import LimitedMove, LimitFamily, LimitSurvey
from trajcli.limits.tolerances import EFFORT_RELATIVE
from trajcli.units import effort_unit


@frozen
class MoveEfforts(LimitSurvey):
    """The largest efforts of all joints in a motion.

    Attributes:
        robot: With the limits in force, and what its tool carries.
        survey: What they are taken from.
        highest: Of each joint, upwards.
        lowest: Of each joint, downwards: of the efforts with the other sign.
    """

    robot: Robot
    survey: EffortSurvey
    highest: tuple[EffortPeak, ...]
    lowest: tuple[EffortPeak, ...]

    def over(self, joints: NamedJoints, origin: float = 0.0) -> Iterator[Finding]:
        """Yield the joints that are over their limits of torque or force, in each direction."""
        for joint, sign, limit, peak in self.beyond():
            since = replace(peak, time=peak.time - origin)
            yield effort_excess(joints, self.survey, joint, sign, limit, since)

    def excess(self) -> float:
        """Return by how much of a limit the efforts are above it."""
        return self.share() - (1 + EFFORT_RELATIVE / 2)

    def share(self) -> float:
        """Return how much of the limits they take at most: above 1 where they break one."""
        low, high = self.robot.limits.effort.T
        upwards = np.array([peak.upper_bound for peak in self.highest]) / high
        downwards = np.array([peak.upper_bound for peak in self.lowest]) / -low
        return float(max(upwards.max(), downwards.max()))

    def beyond(self) -> Iterator[tuple[int, int, float, EffortPeak]]:
        """Yield index, direction, magnitude of the limit and peak of the joints that are over one."""
        for joint, (low, high) in enumerate(self.robot.limits.effort.tolist()):
            for sign, limit, peak in ((1, high, self.highest[joint]), (-1, -low, self.lowest[joint])):
                if not peak.upper_bound <= limit * (1 + EFFORT_RELATIVE):
                    yield joint, sign, limit, peak

    def held_over(self) -> tuple[int, float, EffortPeak] | None:
        """Return where a joint is over its limit that gravity and friction alone exceed, if one is.

        Returns:
            Index of the joint, its limit with its sign, and where gravity and friction alone take most of it.
        """
        for joint, sign, limit, _ in self.beyond():
            needed = needed_stretch(self.survey, joint, sign, limit, EFFORT_RELATIVE / 2)
            if not np.isfinite(needed.factor) and needed.peak.static > limit:
                return joint, sign * limit, self.survey.peak(joint, sign, np.inf)
        return None


def effort_excess(
    joints: NamedJoints, survey: EffortSurvey, joint: int, sign: int, limit: float, peak: EffortPeak
) -> Finding:
    """Return where a joint is over its limit in one direction.

    Args:
        joints: All of them.
        survey: Of the motion.
        joint: Index.
        sign: 1 for upwards, -1 for downwards.
        limit: Its magnitude.
        peak: Of the effort in this direction.
    """
    unit = effort_unit(joints.joint_types[joint])
    factor = needed_stretch(survey, joint, sign, limit, EFFORT_RELATIVE / 2).factor
    amounts: Amounts = {
        "joint": joints.joint_names[joint],
        "value": Amount(sign * peak.upper_bound, unit=unit, rounded="up" if sign > 0 else "down"),
        "limit": Amount(sign * limit, unit=unit, rounded="down" if sign > 0 else "up"),
        "gravity": Amount(sign * peak.gravity, unit=unit),
    }
    what = "force" if unit == "N" else "torque"
    needs = f"{{joint}} needs a {what} of {{value}} {at_time(peak.time)}, {{gravity}} of it against gravity"
    return Finding(
        kind="effort",
        joint=joints.joint_names[joint],
        value=sign * peak.upper_bound,
        limit=sign * limit,
        time=peak.time,
        factor=factor if np.isfinite(factor) else None,
        message=needs + "; its limit is {limit}",
        amounts=amounts,
        method="bounded",
    )


def gravity_problem(
    robot: Robot,
    joint: int,
    needed: float,
    limit: float,
    position: Array,
    *,
    rubs: bool,
    time: float | None = None,
) -> Problem:
    """Return the problem of a joint that gravity alone takes over its limit.

    Args:
        robot: The arm.
        joint: Index.
        needed: What holds the joint, N m or N.
        limit: On that side.
        position: Of all joints there, (n,), rad or m.
        rubs: Whether friction is part of what holds it.
        time: From the start of the move, s; None where it is not known.
    """
    name, unit = robot.joint_names[joint], effort_unit(robot.joint_types[joint])
    amounts = {
        "needed": Amount(needed, unit=unit),
        "limit": Amount(limit, unit=unit),
        "more": Amount(abs(needed) - abs(limit), unit=unit),
        **{f"q{k}": Amount(value, 0, k) for k, value in enumerate(position.tolist())},
    }
    cause = "gravity with friction" if rubs else "gravity"
    when = "" if time is None else f"at t = {time:.6g} s of the move, "
    where = ", ".join(f"{{q{k}}}" for k in range(position.size))
    message = (
        f"{cause} alone takes {{needed}} of {{joint}} {when}with the joints at {where}: "
        "{more} more than its effort limit of {limit}"
    )
    hint = "no duration helps: carry less, go another way, or raise the limit"
    return of_joint(name, message, hint, amounts, time=time, value=needed, limit=limit)


class EffortFamily(LimitFamily):
    """Torques and forces of joints."""

    def survey(self, move: LimitedMove) -> MoveEfforts | None:
        """Return the largest efforts in a move; None for a move of no length, and where no arm is known.

        Raises:
            InputError: When a link of the arm has no inertia, or the arm no geometry.
        """
        breaks, coefficients = move.pieces
        robot = move.robot
        if robot is None or not coefficients.shape[1]:
            return None
        with np.errstate(over="ignore", invalid="ignore"):
            survey = effort_survey(InverseDynamics(robot), breaks, coefficients, robot.limits.effort)
            return MoveEfforts(robot, survey, tuple(survey.highest()), tuple(survey.lowest()))


FAMILY = EffortFamily()
