"""How far the answers of a closed form are from their goals, by forward kinematics.

Forward kinematics takes the cosines and sines of the closed form, which saves most of its time: the angles
are their arc tangents to the last bit, and a pair that had not length 1 would show as a gap.

Everything is seen from the first link, where the others start from exact zeros and ones: the goal is carried
there through the first joint, which has the fewest answers.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.geometry.rotation import cos_sin
from trajcli.kinematics.chain import Link, links_of
from trajcli.kinematics.columns import (
    ZERO,
    Column,
    Entry,
    advance,
    combine,
    minus,
    plus,
    product,
    scaled,
    total,
    uncombine,
)
from trajcli.kinematics.inverse.lines import Floats, Goal
from trajcli.kinematics.inverse.subproblems import Turn, added, turned_back
from trajcli.kinematics.robot import Robot

_X: Floats = (1.0, 0.0, 0.0)
_Y: Floats = (0.0, 1.0, 0.0)
_Z: Floats = (0.0, 0.0, 1.0)
_NO_TURN: Turn = (1.0, 0.0)


class Judge:
    """Forward kinematics of one robot, to be compared with goals."""

    def __init__(self, robot: Robot) -> None:
        """Take the robot's links and tool.

        Raises:
            InputError: When the robot has no geometry.
        """
        self._links = links_of(robot)
        turns = np.transpose(cos_sin([link.theta for link in self._links])).tolist()
        self._offsets = [cast("Turn", tuple(turn)) for turn in turns]
        self._tool_rows = robot.tool[:3, :3].tolist()
        self._tool_tip = robot.tool[:3, 3].tolist()

    def gaps(self, values: Sequence[Turn | Entry], goal: Goal) -> tuple[Array, Array]:
        """Return how far forward kinematics is from the goal, m and rad.

        |dx|^2 + |dz|^2 of two axes of the flange is at least the square of a small angle, and at most twice
        that.

        Args:
            values: Turns and slides of all joints, each of a shape that broadcasts to (..., B).
            goal: B targets.
        """
        frame = _Frame()
        frame.screw(*self._links[0].after)
        for link, offset, value in zip(self._links[1:], self._offsets[1:], values[1:], strict=True):
            frame.screw(*link.before)
            frame.move(*_motion(link, offset, value))
            frame.screw(*link.after)
        frame.slide(*self._tool_tip)
        first, axes = values[0], (goal.x, goal.y, goal.z)
        x, z = (self._seen(_weighted(self._tool_rows[i], axes), first) for i in (0, 2))
        turned = _square(frame.x, x) + _square(frame.z, scaled(frame.flip_z, z))
        return np.sqrt(_square(frame.p, self._seen_place(goal.p, first))), np.sqrt(turned)

    def _seen(self, vector: Column, value: Turn | Entry) -> Column:
        """Return a direction in the base as the first link sees it behind its joint."""
        link = self._links[0]
        turn, _ = _motion(link, self._offsets[0], value)
        return turned_back(turned_back(vector, _X, link.before[1:]), _Z, turn)

    def _seen_place(self, place: Column, value: Turn | Entry) -> Column:
        """Return a place in the base as the first link sees it behind its joint."""
        link = self._links[0]
        a, *twist = link.before
        turn, distance = _motion(link, self._offsets[0], value)
        local = advance(place, -a, _X)
        local = turned_back(local, _X, (twist[0], twist[1]))
        return turned_back(minus(local, scaled(distance, _Z)), _Z, turn)


class _Frame:
    """A frame that moves along the chain, with axes x, y and z, of which x and y have yet to turn.

    A right angle between neighbouring axes only renames them: signs stand aside, so that nothing is negated,
    and turns about the same direction are added before anything turns.

    Attributes:
        z: The axis, but for its sign.
        flip_z: The sign of z.
        p: The origin.
    """

    def __init__(self) -> None:
        self._x, self._y, self.z = cast("tuple[Column, Column, Column]", (_X, _Y, _Z))
        self._flip_y = self.flip_z = 1.0
        self._turn, self.p = _NO_TURN, ZERO

    def move(self, turn: Turn, distance: Entry) -> None:
        """Turn about z and slide along it."""
        self._turn = added(self._turn, turn)
        self.p = advance(self.p, product(self.flip_z, distance), self.z)

    def screw(self, a: float, cosine: float, sine: float) -> None:
        """Slide along x by a, and turn about it by the angle of the given cosine and sine."""
        twisted = (cosine, sine) != _NO_TURN
        x = self.x if a != 0.0 or twisted else ZERO
        self.p = advance(self.p, a, x)
        if not twisted:
            return
        y, z, up, out = self._turned_y(), self.z, self._flip_y, self.flip_z
        self._x, self._turn = x, _NO_TURN
        if cosine == 0.0:
            self._y, self._flip_y, self.z, self.flip_z = z, sine * out, y, -sine * up
            return
        self._y, self._flip_y = combine(cosine * up, y, sine * out, z), 1.0
        self.z, self.flip_z = combine(cosine * out, z, -sine * up, y), 1.0

    def slide(self, a: float, b: float, c: float) -> None:
        """Slide along the three axes."""
        p = self.p
        if a != 0.0:
            p = advance(p, a, self.x)
        if b != 0.0:
            p = advance(p, self._flip_y * b, self._turned_y())
        self.p = advance(p, self.flip_z * c, self.z)

    @property
    def x(self) -> Column:
        """First axis."""
        cosine, sine = self._turn
        join = combine if self._flip_y > 0.0 else uncombine
        return join(cosine, self._x, sine, self._y)

    def _turned_y(self) -> Column:
        """Return the second axis but for its sign."""
        cosine, sine = self._turn
        join = uncombine if self._flip_y > 0.0 else combine
        return join(cosine, self._y, sine, self._x)


def _motion(link: Link, offset: Turn, value: Turn | Entry) -> tuple[Turn, Entry]:
    """Return the turn about a link's axis and the slide along it."""
    if isinstance(value, tuple):
        return added(offset, value, link.sign), link.d
    return offset, total(product(link.sign, value), link.d)


def _weighted(weights: Sequence[float], axes: Sequence[Column]) -> Column:
    """Return the sum of three columns with weights."""
    x, y, z = (scaled(weight, axis) for weight, axis in zip(weights, axes, strict=True))
    return plus(plus(x, y), z)


def _square(a: Column, b: Column) -> Array:
    """Return |a - b|^2."""
    first, second, third = (np.asarray(x - y) for x, y in zip(a, b, strict=True))
    for gap in (first, second, third):
        np.square(gap, out=gap)
    full = first if first.shape == np.broadcast(first, second, third).shape else None
    return np.asarray(np.add(np.add(first, second, out=full), third, out=full))
