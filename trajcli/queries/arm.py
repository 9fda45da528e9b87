"""Arms with the units of their users: joint values in and out, and a watch on the limits of position."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np

from trajcli.columns import joint_factors
from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, InputError
from trajcli.frozen import comparable, frozen
from trajcli.job.inline import inline_number, inline_pose
from trajcli.job.robot import RobotSheet, catalogue_names, load_sheet
from trajcli.kinematics.inverse.joint_turns import beyond
from trajcli.kinematics.robot import Robot
from trajcli.kinematics.serial_chain import links_of
from trajcli.units import (
    Quantity,
    Units,
    amount_text,
    factor,
    joint_quantity,
    unit_name,
)


@frozen
class ArmInUnits:
    """A robot that has geometry.

    Attributes:
        robot: With the tool in use.
        units: Of the numbers that the user gives and gets.
    """

    robot: Robot
    units: Units

    @property
    def joint_factors(self) -> Array:
        """SI per user unit of each joint's value, shape (n,)."""
        return joint_factors(self.robot.joint_types, self.units)

    @property
    def length_factor(self) -> float:
        """Metres per user unit of length."""
        return factor(Quantity("length"), self.units)

    @property
    def angle_factor(self) -> float:
        """Radians per user unit of angle."""
        return factor(Quantity("angle"), self.units)

    @property
    def twist_factors(self) -> Array:
        """SI per user unit of a twist's or an acceleration's entries, linear ones first, shape (6,)."""
        return np.repeat([self.length_factor, self.angle_factor], 3)

    def joint_unit(self, joint: int, order: int = 0) -> str:
        """Return the unit of a joint's value, or of its time derivative of the given order."""
        return unit_name(self._quantity(joint, order), self.units)

    def joint_values(self, words: Sequence[str], name: str = "q", order: int = 0) -> Array:
        """Return values of all joints in SI, shape (n,).

        Args:
            words: A number, in the arm's units or with its own unit, for each joint; commas separate too.
            name: What the values are called in messages.
            order: 0 for positions, 1 for velocities.

        Raises:
            InputError: When there is not one for each joint, or one is no such number.
        """
        values = [value.strip() for word in words for value in word.split(",")]
        count = len(self.robot.joints)
        if len(values) != count:
            units = ", ".join(
                f"{joint} ({self.joint_unit(i, order)})" for i, joint in enumerate(self.robot.joint_names)
            )
            raise InputError(
                f"{name} has {len(values)} value{'s' * (len(values) != 1)}, "
                f"{self.robot.name} has {count} joint{'s' * (count != 1)}",
                hint=f"they are {units}",
            )
        names = [f"{name} of {joint}" for joint in self.robot.joint_names]
        return np.array(
            [
                inline_number(text, names[i], self._quantity(i, order), self.units)
                for i, text in enumerate(values)
            ]
        )

    def say(self, amount: Amount) -> str:
        """Return a number of a message in the arm's units."""
        return amount_text(amount, self.robot.joint_types, self.units)

    def _quantity(self, joint: int, order: int) -> Quantity:
        return joint_quantity(self.robot.joint_types[joint], order)


def open_sheet(name: str) -> RobotSheet:
    """Return the sheet of a robot of the catalogue, or of a robot file of any name.

    Raises:
        InputError: When there is no such robot, or with every flaw of the file.
        FileError: When the file cannot be read.
    """
    is_file = name not in catalogue_names() and Path(name).is_file()
    return load_sheet(Path(name) if is_file else name)


def open_arm(
    name: str, tool: str | None = None, *, si: bool = False, frame: Literal["world", "base"] = "world"
) -> ArmInUnits:
    """Return an arm of the catalogue or of a file.

    Args:
        name: Of a robot in the catalogue, or the path of a robot file.
        tool: T_flange_tcp as YAML or @FILE, instead of the robot's own.
        si: Whether numbers are in rad and m, whatever units the robot's file has.
        frame: "base" counts poses from the robot's base, as if it stood at the world's origin.

    Raises:
        InputError: When there is no such robot, it has no geometry, or the tool is no pose.
        FileError: When a file cannot be read.
    """
    sheet = open_sheet(name)
    units = Units() if si else sheet.units
    robot = sheet.robot
    links_of(robot)  # refuses bare joints before anything is read or written
    if tool is not None:
        robot = replace(robot, tool=inline_pose(tool, "--tool", units))
    return ArmInUnits(replace(robot, base=np.eye(4)) if frame == "base" else robot, units)


@comparable
class JointOutsideLimits:
    """A joint value outside its limits, in the unit that it was given in.

    Attributes:
        row: Which row it stands in, from 0.
        time: Of that row, s; None where it has none.
        joint: Name of the joint; of several in a row the one that is furthest outside.
        value: Of the joint.
        limit: The bound that it exceeds.
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
    """Count of the rows of a stream that are outside the position limits.

    Attributes:
        rows: How many were seen.
        outside: How many of them have a joint outside its limits.
        first: The first of these; None while there is none.
    """

    def __init__(self, robot: Robot) -> None:
        """Watch the position limits of a robot."""
        self.rows, self.outside = 0, 0
        self.first: JointOutsideLimits | None = None
        self._robot = robot

    def see(
        self,
        values: Array,
        factors: Array,
        units: Sequence[str],
        times: Array | None = None,
        room: float = 0.0,
    ) -> None:
        """Count the next rows.

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
            self.first = JointOutsideLimits(
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
