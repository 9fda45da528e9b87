"""Limits of torques and forces for all t, by bounds of inverse dynamics with what the tool carries.

A limit does not scale with the duration: gravity and Coulomb friction stay, the rest shrinks. Where these
alone are over the limit no duration helps, though a motion that falls fast enough may keep the limit there.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from trajcli.checks.tolerances import EFFORT_RELATIVE
from trajcli.curves.piecewise import Array
from trajcli.dynamics.effort_bound import (
    EffortPeak,
    EffortStretch,
    EffortSurvey,
    effort_survey,
    needed_stretch,
)
from trajcli.dynamics.newton_euler import InverseDynamics
from trajcli.errors import Amount, Amounts
from trajcli.findings import Finding, at_time
from trajcli.frozen import frozen
from trajcli.kinematics.robot import Robot
from trajcli.trajectory import Span, Trajectory
from trajcli.units import effort_unit


@frozen
class MoveEfforts:
    """The largest efforts of all joints in a move, times on the curve of the trajectory.

    Attributes:
        survey: What they are taken from.
        highest: Of each joint, upwards.
        lowest: Of each joint, downwards: of the efforts with the other sign.
    """

    survey: EffortSurvey
    highest: tuple[EffortPeak, ...]
    lowest: tuple[EffortPeak, ...]

    def share(self, limits: Array) -> float:
        """Return how much of the limits (n, 2) they take at most: above 1 where they break one."""
        low, high = limits.T
        upwards = np.array([peak.most for peak in self.highest]) / high
        downwards = np.array([peak.most for peak in self.lowest]) / -low
        return float(max(upwards.max(), downwards.max()))


def move_efforts(trajectory: Trajectory, span: Span, robot: Robot) -> MoveEfforts | None:
    """Return the largest efforts in a move of an arm with limits of them; None for a move of no length.

    Raises:
        InputError: When a link of the arm has no inertia, or the arm no geometry.
    """
    curve = trajectory.curve
    middles = curve.breaks[:-1] + curve.lengths / 2 - curve.start
    first, last = np.searchsorted(middles, [span.start, span.end])
    if span.duration == 0 or first == last:
        return None
    dynamics, coefficients = InverseDynamics(robot), curve.coefficients[:, first:last]
    with np.errstate(over="ignore", invalid="ignore"):
        survey = effort_survey(dynamics, curve.breaks[first : last + 1], coefficients, robot.limits.effort)
        return MoveEfforts(survey, tuple(survey.highest()), tuple(survey.lowest()))


def check_efforts(trajectory: Trajectory, span: Span, robot: Robot, efforts: MoveEfforts) -> list[Finding]:
    """Return where joints of a move are over their limits of torque or force.

    Args:
        trajectory: What to judge.
        span: The move.
        robot: With the limits in force, and what its tool carries.
        efforts: From `move_efforts`.
    """
    return [
        _finding(
            trajectory,
            span,
            (joint, sign, limit),
            peak,
            needed_stretch(efforts.survey, joint, sign, limit, EFFORT_RELATIVE / 2),
        )
        for joint, sign, limit, peak in _over(robot, efforts)
    ]


def held_over_limit(robot: Robot, efforts: MoveEfforts) -> tuple[int, float, EffortPeak] | None:
    """Return where a joint is over its limit that gravity and friction alone exceed, if one is.

    Args:
        robot: With the limits in force.
        efforts: From `move_efforts`.

    Returns:
        Index of the joint, its limit with its sign, and where gravity and friction alone take most of it.
    """
    for joint, sign, limit, _ in _over(robot, efforts):
        needed = needed_stretch(efforts.survey, joint, sign, limit, EFFORT_RELATIVE / 2)
        if not np.isfinite(needed.factor) and needed.peak.static > limit:
            return joint, sign * limit, efforts.survey.peak(joint, sign, np.inf)
    return None


def _over(robot: Robot, efforts: MoveEfforts) -> Iterator[tuple[int, int, float, EffortPeak]]:
    """Yield index, direction, magnitude of the limit and peak of the joints that are over one."""
    for joint, (low, high) in enumerate(robot.limits.effort.tolist()):
        for sign, limit, peak in ((1, high, efforts.highest[joint]), (-1, -low, efforts.lowest[joint])):
            if not peak.most <= limit * (1 + EFFORT_RELATIVE):
                yield joint, sign, limit, peak


def _finding(
    trajectory: Trajectory,
    span: Span,
    bound: tuple[int, int, float],
    peak: EffortPeak,
    needed: EffortStretch,
) -> Finding:
    """Return the finding about one joint in one direction, `bound` by (joint, sign, limit)."""
    joint, sign, limit = bound
    unit, when = effort_unit(trajectory.joint_types[joint]), peak.time - trajectory.curve.start
    value = sign * peak.most
    amounts: Amounts = {
        "joint": trajectory.joint_names[joint],
        "value": Amount(value, unit=unit, rounded="up" if sign > 0 else "down"),
        "limit": Amount(sign * limit, unit=unit, rounded="down" if sign > 0 else "up"),
        "gravity": Amount(sign * peak.gravity, unit=unit),
    }
    what = "force" if unit == "N" else "torque"
    message = f"{{joint}} needs a {what} of {{value}} {at_time(when)}, {{gravity}} of it against gravity; "
    message += "its limit is {limit}"
    return Finding(
        move=span.index,
        joint=trajectory.joint_names[joint],
        kind="effort",
        value=value,
        limit=sign * limit,
        time=when,
        method="bounded",
        factor=needed.factor if np.isfinite(needed.factor) else None,
        message=message,
        amounts=amounts,
    )
