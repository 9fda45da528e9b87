"""Arms with the units of their users: joint values in and out, and a watch on the limits of position."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import numpy as np

from trajcli.catalogue.entries import catalogue_names
from trajcli.columns import joint_factors
from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, InputError
from trajcli.frozen import comparable, frozen
from trajcli.job.robot import RobotSheet, is_urdf, load_sheet
from trajcli.job.yaml.load import read_document
from trajcli.kinematics.forward import links_of
from trajcli.kinematics.inverse.joint_turns import beyond
from trajcli.kinematics.robot import MountedTool, Robot
from trajcli.streams.whole_file import kind_of
from trajcli.units import (
    Quantity,
    Units,
    amount_text,
    factor,
    joint_quantity,
    named_units,
    unit_name,
    units_of,
)

if TYPE_CHECKING:
    from trajcli.job.read import LoadedJob

_TWO_TURNS = 4.0 * np.pi  # rad: no joint is sent there, and 13 degrees read as radians are


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

    @property
    def joint_units(self) -> list[str]:
        """Units of the joints' values."""
        return [self.joint_unit(joint) for joint in range(len(self.robot.joints))]

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
                hint=f"they are {units}" + "; `- < FILE` reads rows of a CSV" * (name == "q"),
            )
        from trajcli.job.inline import inline_number

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
    """Return the sheet of a robot of the catalogue, of a robot file of any name, or of a job's robot.

    A file is a job where it has a key `robot` or `moves`. Its robot has the job's base, tool and limits, and
    the job's units.

    Raises:
        InputError: When there is no such robot, or with every flaw of the file.
        FileError: When the file cannot be read.
    """
    if name in catalogue_names() or kind_of(name) != "file" or is_urdf(name):
        return load_sheet(name)
    loaded = job_of_arm(name)
    if loaded is None:
        return load_sheet(Path(name))
    return RobotSheet(loaded.robot, loaded.units, None, None, f"the robot of the job {loaded.name}", None)


def job_of_arm(name: str) -> LoadedJob | None:
    """Return the job that names an arm; None where it is named otherwise.

    Raises:
        InputError: With every flaw of the file.
        FileError: When it cannot be read.
    """
    if not names_job(name):
        return None
    from trajcli.job.read import load_job  # brings the planners

    return load_job(name)


def names_job(name: str) -> bool:
    """Return whether the name of an arm is that of a job: of a file with a key `robot` or `moves`.

    Raises:
        InputError: When the file is no YAML.
        FileError: When it cannot be read.
    """
    if name in catalogue_names() or kind_of(name) != "file" or is_urdf(name):
        return False
    return bool({"robot", "moves"} & read_document(name).plain().keys())


def files_of_arm(name: str) -> Iterator[tuple[str, str]]:
    """Yield the files that `open_sheet` reads: what each is, and its path.

    Raises:
        InputError: When the file is no YAML.
        FileError: When it cannot be read.
    """
    if names_job(name):
        from trajcli.job.read import files_of  # brings the planners

        yield from files_of(read_document(name))
    elif name not in catalogue_names():
        yield "the robot's file", name


def frame_of_rows(loaded: LoadedJob) -> Array | None:
    """Return T_world_frame (4, 4) of the frame in which rows of a job say the pose; None for world."""
    seen, robot = loaded.robot_of_rows, loaded.robot
    return None if seen is robot else np.asarray(robot.base @ np.linalg.inv(seen.base))


def stated_units(name: str) -> Units | None:
    """Return the units that a user's job or robot file states under `units`; None where it states none.

    A robot of the catalogue states none: it knows nothing of the user's numbers. Nor does standard input,
    which is read once.

    Raises:
        InputError: When the file is no YAML.
        FileError: When it cannot be read.
    """
    if name in catalogue_names() or name == "-" or is_urdf(name):
        return None
    units = read_document(name).plain().get("units")
    return units_of(units) if isinstance(units, Mapping) and units else None


def open_arm(
    name: str,
    tool: str | None = None,
    *,
    base: str | None = None,
    units: str | None = None,
    si: bool = False,
    frame: Literal["world", "base"] = "world",
) -> ArmInUnits:
    """Return an arm of the catalogue, of a robot file or of a job.

    Args:
        name: Of a robot in the catalogue, or the path of a robot file or a job.
        tool: T_flange_tcp as YAML or @FILE, instead of the robot's own and the job's.
        base: T_world_base likewise.
        units: Of numbers, such as "deg,mm"; what it leaves out is as in the file.
        si: Whether numbers are in rad and m, whatever units the file has.
        frame: "base" counts poses from the robot's base, as if it stood at the world's origin.

    Raises:
        InputError: When there is no such robot, it has no geometry, a pose is none, or units are unknown
            or given twice.
        FileError: When a file cannot be read.
    """
    if si and units is not None:
        raise InputError("--si is the same as --units rad,m", hint="leave one of --si and --units out")
    sheet = open_sheet(name)
    shown = Units() if si else parse_units(units or "", sheet.units)
    robot = sheet.robot
    links_of(robot)  # refuses bare joints before anything is read or written
    if tool is not None or base is not None:
        from trajcli.job.inline import inline_pose

        if tool is not None:  # what the other tool weighs goes with it
            robot = robot.with_tool(MountedTool(inline_pose(tool, "--tool", shown)))
        robot = robot if base is None else robot.standing_at(inline_pose(base, "--base", shown))
    return ArmInUnits(robot.standing_at(np.eye(4)) if frame == "base" else robot, shown)


def parse_units(text: str, default: Units = Units()) -> Units:  # noqa: B008
    """Return the units that "deg,mm" names; what it leaves out is that of `default`.

    Raises:
        InputError: When a unit is unknown, or two are of one dimension.
    """
    chosen = named_units(text) if text else {}
    angle, length = chosen.get("angle", default.angle), chosen.get("length", default.length)
    return Units("deg" if angle == "deg" else "rad", "mm" if length == "mm" else "m")


def beyond_two_turns(robot: Robot, values: Array, units: Sequence[str]) -> str | None:
    """Return a remark on the first joint, given in rad, more than 4 pi from zero; None where there is none.

    Args:
        robot: The arm.
        values: Shape (N, n), rad or m.
        units: In which each joint was given.
    """
    radians = np.array([unit == "rad" for unit in units])
    rows, joints = np.nonzero((np.abs(values) > _TWO_TURNS) & radians)
    if not len(rows):
        return None
    joint, value = int(joints[0]), float(values[rows[0], joints[0]])
    shown = f"{robot.joint_names[joint]} is at {value:.9g} rad, more than two turns from zero"
    return f"{shown}: if these are degrees, say --units deg, or q1_deg in a CSV"


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
        remark: On the first joint beyond two turns, as `beyond_two_turns` says it; None while there is none.
        tool_off: How far the tcp is from where rows that say it have it, m, at most.
        frame: T_world_frame (4, 4) of the frame in which they say it; None for world.
    """

    tool_off = 0.0
    frame: Array | None = None

    def __init__(self, robot: Robot) -> None:
        self.rows, self.outside = 0, 0
        self.first: JointOutsideLimits | None = None
        self.remark: str | None = None
        self._robot = robot

    def see(
        self,
        values: Array,
        factors: Array,
        units: Sequence[str],
        times: Array | None = None,
        slack: float = 0.0,
    ) -> None:
        """Count the next rows.

        Args:
            values: Shape (N, n), rad or m.
            factors: SI per unit of each joint, shape (n,).
            units: Their names.
            times: Shape (N,), s.
            slack: What rounding may have added to a number, in the units.
        """
        self.remark = self.remark or beyond_two_turns(self._robot, values, units)
        excess = beyond(values, self._robot.limits.position)
        excess[np.abs(excess) <= slack * factors] = 0.0
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
