"""Runs a closed form over blocks of poses and judges every answer by forward kinematics.

Forward kinematics takes the cosines and sines of the closed form, which saves most of its time: the angles
are their arc tangents to the last bit, and a pair that had not length 1 would show as a gap. Of two mirrored
answers (joints 4 and 6 half a turn further, joint 5 bent the other way) it judges the first: the hand's
rotation is the same product in both.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.geometry.rotation import Flags, cos_sin
from trajcli.kinematics.chain import Link, MovingFrame, links_of
from trajcli.kinematics.columns import Column, Entry, advance
from trajcli.kinematics.inverse.lines import Arm, Goal
from trajcli.kinematics.inverse.method import Choice, Method
from trajcli.kinematics.inverse.subproblems import Mirrored, Opposed, Turn, Value, Watch, added, angle
from trajcli.kinematics.robot import Robot

_BLOCK = 4096  # poses at a time: eight branches of them stay in the processor's cache
_WORKSPACE = 1 << 21  # numbers: more than the temporary arrays of a block
_ORDER: tuple[Choice, ...] = ("shoulder", "elbow", "wrist")


@dataclass(frozen=True, eq=False)
class Candidates:
    """Every branch of a flat batch of N poses, also where the pose is out of reach. Joints come first.

    Attributes:
        joints: Shape (n, branches, N).
        gaps: Shape (2, branches, N): m, and an upper bound of the angle in rad, at most 1.5 times too large.
        watched: Shape (N,): an angle is free, or two branches fall together.
    """

    joints: Array
    gaps: Array
    watched: Flags


def candidates(robot: Robot, arm: Arm, method: Method, poses: Array) -> Candidates:
    """Return all branches of poses (N, 4, 4) by a method that has a closed form."""
    np.empty(
        _WORKSPACE
    )  # freed at once: the allocator then keeps blocks of this size instead of returning them
    count, links, twos = len(poses), links_of(robot), (2,) * len(method.choices)
    joints, gaps = np.empty((len(links), *twos, count)), np.empty((2, *twos, count))
    watched = np.zeros(count, dtype=bool)
    present = [choice for choice in _ORDER if choice in method.choices]
    axes = [*(len(twos) - 1 - method.choices.index(choice) for choice in present), len(twos)]
    for low in range(0, count, _BLOCK):
        block = slice(low, min(low + _BLOCK, count))
        rows = np.ascontiguousarray(poses[block].reshape(-1, 16).T)
        goal, watch = Goal(arm, rows[:12]), Watch(rows.shape[1], arm.length)
        values = method.solve(goal, watch) if method.solve else ()
        shape = (*twos, rows.shape[1])
        for i, value in enumerate(values):
            joints[i, ..., block] = np.broadcast_to(_plain(value), shape).transpose(axes)
        for i, gap in enumerate(_gaps(robot, links, _judged(values, len(twos)), goal)):
            gaps[i, ..., block] = np.broadcast_to(gap, shape).transpose(axes)
        watched[block] = watch.rows
    return Candidates(joints.reshape(len(links), -1, count), gaps.reshape(2, -1, count), watched)


def _plain(value: Value) -> Entry:
    """Return angles or slides."""
    if isinstance(value, Mirrored | Opposed):
        return value.angles()
    return angle(value) if isinstance(value, tuple) else value


def _judged(values: Sequence[Value], choices: int) -> list[Turn | Entry]:
    """Return turns and slides; of a mirrored hand (two joints half a turn further) the first answer's."""
    if sum(isinstance(value, Mirrored) for value in values) < 2:
        return [value.both() if isinstance(value, Mirrored | Opposed) else value for value in values]
    return [_first_of(value, choices) for value in values]


def _first_of(value: Value, choices: int) -> Turn | Entry:
    if isinstance(value, Mirrored | Opposed):
        return value.turn
    if isinstance(value, tuple):
        return _without_last_choice(value[0], choices), _without_last_choice(value[1], choices)
    return _without_last_choice(value, choices)


def _without_last_choice(entry: Entry, choices: int) -> Entry:
    return entry[0] if isinstance(entry, np.ndarray) and entry.ndim > choices else entry


class _Frame(MovingFrame):
    """A moving frame that turns by pairs of cosine and sine."""

    def carry(self, link: Link, value: Turn | Entry) -> None:
        """Move through a link with its joint's value."""
        self.screw(*link.before)
        if isinstance(value, tuple):
            cosine, sine = cos_sin(link.theta)
            turn = added((float(cosine), float(sine)), value, link.sign)
            self._turned, self._x_now = added(self._cos_sin(), turn), None
            self.p = advance(self.p, link.d, self.z)
        else:
            self.move(link, np.asarray(value))
        self.screw(*link.after)


def _gaps(
    robot: Robot, links: Sequence[Link], values: Sequence[Turn | Entry], goal: Goal
) -> tuple[Array, Array]:
    """Return how far forward kinematics is from the goal, m and rad.

    |dx|^2 + |dz|^2 of two axes is at least the square of a small angle, and at most twice that.
    """
    frame = _Frame(robot.base)
    for link, value in zip(links, values, strict=True):
        frame.carry(link, value)
    frame.attach(robot.tool)
    turned = np.sqrt(_square(frame.x, goal.x) + _square(frame.z, goal.z))
    return np.sqrt(_square(frame.p, goal.p)), turned


def _square(a: Column, b: Column) -> Array:
    """Return |a - b|^2."""
    first, second, third = (np.asarray(x - y) for x, y in zip(a, b, strict=True))
    return np.asarray(first * first + second * second + third * third)
