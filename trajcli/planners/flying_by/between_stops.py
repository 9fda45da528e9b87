"""Chains: the moves between two stops, their courses, the zones between them and their borders."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.kinematics.robot import QUANTITIES, Limits, Robot, ToolLimits
from trajcli.kinematics.zone import ZoneAround
from trajcli.planners.course import Course

_NEXT_TO_STOP = 0.95  # of a move, the largest part that a zone takes where its other end is a stop
_LEFT = 0.05  # of a move that stays between two zones
_SAMPLES = 257  # of a move, at which its distance from the corner is looked at
_SECTIONS, _PER_SECTION = 8, 63  # by which the place on its border is found: 64^8 parts of an interval

Shares = Callable[[Array], Array]
"""How much of a zone is used at values of s (N,), (N,)."""


@frozen
class CornerZone:
    """A corner that is flown by.

    Attributes:
        around: Its zone, of the size that was asked for.
        left: The s of the course before at which its path enters the zone.
        joined: The s of the course behind at which its path leaves it.
        robot: With the limits in force inside.
        shares: What parts of the limits of joints are used inside, of velocity, acceleration and jerk.
    """

    around: ZoneAround
    left: float
    joined: float
    robot: Robot
    shares: tuple[float, float, float] = (1.0, 1.0, 1.0)

    @property
    def pace(self) -> float:
        """How much slower a motion at full limits has to be to use no more of any than these parts."""
        velocity, acceleration, jerk = self.shares
        return min(velocity, math.sqrt(acceleration), math.cbrt(jerk))

    @property
    def limits(self) -> Limits:
        """Limits with these parts of those of the joints."""
        limits = self.robot.limits
        velocity, acceleration, jerk = (
            share * limits.of_order(order) for order, share in enumerate(self.shares, 1)
        )
        return replace(limits, velocity=velocity, acceleration=acceleration, jerk=jerk)


@frozen
class FlyByChain:
    """Moves between two stops.

    Attributes:
        courses: At least two.
        corners: Between them.
        ends: sd and sdd at the start and at the end, each (2,).
        tempos: What part of the speeds that limits allow is used on each course: of accelerations its square.
    """

    courses: tuple[Course, ...]
    corners: tuple[CornerZone, ...]
    ends: tuple[Array, Array]
    tempos: tuple[float, ...]

    def stretch(self, index: int) -> tuple[float, float]:
        """Return from which s to which a course is followed."""
        first = self.corners[index - 1].joined if index else 0.0
        last = self.corners[index].left if index < len(self.corners) else self.courses[index].length
        return first, last


def chain_of(
    courses: Sequence[Course], zones: Sequence[ZoneAround], ends: tuple[Array, Array], sizes: Sequence[float]
) -> FlyByChain:
    """Return the chain of courses through zones.

    Args:
        courses: In order.
        zones: About the corners between them.
        ends: sd and sdd at the start and at the end.
        sizes: What part of each zone is used for its borders.
    """
    reach = [
        [_border(courses[k + behind], around, size, before=not behind) for behind in (0, 1)]
        for k, (around, size) in enumerate(zip(zones, sizes, strict=True))
    ]
    stretches = [
        shared(reach[k - 1][1] if k else None, reach[k][0] if k < len(zones) else None, course.length)
        for k, course in enumerate(courses)
    ]
    corners = [
        CornerZone(around, stretches[k][1], stretches[k + 1][0], _inside(courses[k], courses[k + 1]))
        for k, around in enumerate(zones)
    ]
    return FlyByChain(tuple(courses), tuple(corners), ends, (1.0,) * len(courses))


def _border(course: Course, around: ZoneAround, size: float, *, before: bool) -> float:
    """Return the s at which a course is on the border of a zone of `size` times the size."""
    smaller = replace(around, zone=around.zone.scaled(size))
    return border(lambda s: smaller.shares(course.curve.evaluate(s)), course.length, before=before)


def _inside(before: Course, after: Course) -> Robot:
    """Return the arm with the limits inside a zone: of joints the higher, of the tool the lower ones.

    Of speeds that laws name the higher one counts.
    """
    robots, named = (before.robot, after.robot), [vars(course.tcp) for course in (before, after)]
    tools = [vars(robot.limits.tcp) for robot in robots]
    for key in ("speed", "angular_speed"):
        tools.append({**tools[0], key: max(tool[key] for tool in named)})
    tcp = ToolLimits(**{key: min(tool[key] for tool in tools) for key in tools[0]})
    looser = with_looser_limits(*robots)
    return replace(looser, limits=replace(looser.limits, tcp=tcp))


def with_looser_limits(robot: Robot, other: Robot) -> Robot:
    """Return an arm with the looser of two arms' limits, of each joint and of the tool."""
    joints: dict[str, Array] = {}
    for name in (*QUANTITIES, "effort"):
        pair = np.stack([getattr(each.limits, name) for each in (robot, other)])
        joints[name] = np.stack([pair[:, :, 0].min(axis=0), pair[:, :, 1].max(axis=0)], axis=1)
    tools = [vars(each.limits.tcp) for each in (robot, other)]
    tcp = ToolLimits(**{key: max(tool[key] for tool in tools) for key in tools[0]})
    limits: Any = {**joints, "tcp": tcp}
    return replace(robot, limits=replace(robot.limits, **limits))


def border(shares: Shares, length: float, *, before: bool) -> float:
    """Return the s at which a path is on the border of a zone about one of its ends.

    Between there and the corner it stays inside.

    Args:
        shares: Of the zone.
        length: Last s of the path.
        before: Whether the corner is at its end, else at its start.
    """
    s = np.linspace(0.0, length, _SAMPLES)
    outside = np.flatnonzero(shares(s) > 1.0)
    if not outside.size:
        return 0.0 if before else length
    index = int(outside[-1] if before else outside[0])
    out, inside = s[index], s[index + 1 if before else index - 1]
    for _ in range(_SECTIONS):
        between = np.linspace(out, inside, _PER_SECTION + 2)[1:-1]
        left = np.flatnonzero(shares(between) > 1.0)
        last = int(left[-1]) if left.size else -1
        ends = np.concatenate([[out], between, [inside]])
        out, inside = ends[last + 1], ends[last + 2]
    return float(inside)


def shared(entered: float | None, left: float | None, length: float) -> tuple[float, float]:
    """Return where a move begins behind the zone at its start, and where it ends before the next one.

    Each zone may take half of the move, and more where the other takes less; next to a stop it may take
    nearly all. A little is always left of the move.

    Args:
        entered: The s on the border of the zone at its start; None where it starts at a stop.
        left: The s on the border of the zone at its end; None where it ends at a stop.
        length: Of the move.
    """
    if entered is None and left is None:
        return 0.0, length
    if entered is None:
        return 0.0, max(left or 0.0, (1 - _NEXT_TO_STOP) * length)
    if left is None:
        return min(entered, _NEXT_TO_STOP * length), length
    gap = _LEFT * length
    if left - entered >= gap:
        return entered, left
    middle = 0.5 * length
    if left > middle:
        return left - gap, left
    if entered < middle:
        return entered, entered + gap
    return middle - 0.5 * gap, middle + 0.5 * gap
