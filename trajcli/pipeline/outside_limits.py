"""Joint values outside the limits of a robot: how many rows, and the first of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import comparable
from trajcli.kinematics.inverse.joint_turns import beyond
from trajcli.kinematics.robot import Robot


@comparable
class Outside:
    """A joint value outside its limits, in the unit that it was given in.

    Attributes:
        row: Which row it stands in, from 0.
        time: Of that row, s; None where it has none.
        joint: Name of the joint; of several in a row the one that is furthest outside.
        value: Of the joint.
        limit: The bound that it passes.
        unit: Of both.
        others: How many more joints of the row are outside.
    """

    row: int
    time: float | None
    joint: str
    value: float
    limit: float
    unit: str
    others: int


class LimitWatch:
    """Looks at rows of joint values as they pass.

    Attributes:
        rows: How many have passed.
        outside: How many of them have a joint outside its limits.
        first: The first of these; None while there is none.
    """

    def __init__(self, robot: Robot) -> None:
        """Watch the position limits of a robot."""
        self.rows, self.outside = 0, 0
        self.first: Outside | None = None
        self._robot = robot

    def see(
        self,
        values: Array,
        factors: Array,
        units: Sequence[str],
        times: Array | None = None,
        room: float = 0.0,
    ) -> None:
        """Take note of the next rows.

        Args:
            values: Shape (N, n), rad or m.
            factors: SI per unit of each joint, shape (n,).
            units: Their names.
            times: Shape (N,), s.
            room: What rounding may have added to a number, in the units.
        """
        excess = beyond(values, self._robot.limits.position)
        excess[np.abs(excess) <= room * factors] = 0.0
        rows = np.flatnonzero(excess.any(axis=1))
        if len(rows) and self.first is None:
            row = int(rows[0])
            joint = int(np.abs(excess[row]).argmax())
            value = float(values[row, joint])
            self.first = Outside(
                self.rows + row,
                None if times is None else float(times[row]),
                self._robot.joint_names[joint],
                value / float(factors[joint]),
                (value - float(excess[row, joint])) / float(factors[joint]),
                units[joint],
                int(np.count_nonzero(excess[row])) - 1,
            )
        self.rows += len(values)
        self.outside += len(rows)
