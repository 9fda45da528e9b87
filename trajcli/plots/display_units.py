"""Units of axes: those of the job, or those that the columns of files name."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Literal

from trajcli.columns import EFFORT, JOINT_ORDERS, Column
from trajcli.errors import InputError
from trajcli.frozen import comparable
from trajcli.kinematics.robot import JointType
from trajcli.units import Quantity, Units, effort_unit, factor, joint_quantity, typeset, unit_name

_EITHER = {
    "q": "rad or m",
    "qd": "rad/s or m/s",
    "qdd": "rad/s² or m/s²",
    "qddd": "rad/s³ or m/s³",
    EFFORT: "N m or N",
}
_SYMBOLS = {"qd": "q\u0307", "qdd": "q\u0308", "qddd": "q\u20db", EFFORT: "\u03c4", "sd": "s\u0307"}
"""How quantities are written whose names in columns are letters."""
_TYPES: dict[str | None, JointType] = {"deg": "revolute", "mm": "prismatic"}


@comparable
class DisplayUnits:
    """The joints of a picture, and the units of its axes.

    Attributes:
        joint_names: n names.
        joint_types: n types; None where nothing says whether its numbers are angles or lengths.
        units: Of angles and lengths.
    """

    joint_names: tuple[str, ...]
    joint_types: tuple[JointType | None, ...]
    units: Units

    def joint_factor(self, joint: int) -> float:
        """Return SI per unit of a joint's axis; those of efforts are in SI."""
        kind = self.joint_types[joint]
        return 1.0 if kind is None else factor(joint_quantity(kind), self.units)

    def joint_label(self, quantity: str, joint: int) -> str:
        """Return the label of a joint's axis: symbol of "q", "qd", "qdd", "qddd" or "tau", and unit."""
        kind = self.joint_types[joint]
        if kind is None:
            unit = _EITHER[quantity]
        elif quantity == EFFORT:
            unit = effort_unit(kind)
        else:
            unit = unit_name(joint_quantity(kind, JOINT_ORDERS[quantity]), self.units)
        return f"{_SYMBOLS.get(quantity, quantity)} [{typeset(unit)}]"

    def factor(self, dimension: Literal["length", "angle", "ratio"]) -> float:
        """Return SI per unit of an axis."""
        return factor(Quantity(dimension), self.units)

    def label(self, symbol: str, dimension: Literal["length", "angle", "ratio"], order: int = 0) -> str:
        """Return the label of an axis; of what has no unit only that of time remains."""
        written = _SYMBOLS.get(symbol, symbol)
        if dimension == "ratio":
            return f"{written} [{('-', '1/s', '1/s²')[order]}]"
        return f"{written} [{typeset(unit_name(Quantity(dimension, order), self.units))}]"


def units_of_files(columns: Iterable[tuple[str, Column]]) -> DisplayUnits:
    """Return the units of files that no job explains: those of their columns' names.

    Args:
        columns: Name of the file and column, of all files.

    Raises:
        InputError: When a joint has an angle in one file and a length in another.
    """
    listed = list(columns)
    units: dict[int, tuple[str, str]] = {}
    count = 0
    for file, column in listed:
        if column.joint is None:
            continue
        count = max(count, column.joint + 1)
        before = units.get(column.joint)
        if column.unit is None:
            continue
        if before is not None and before[1] != column.unit:
            message = f"joint {column.joint + 1} is in {before[1]} in {before[0]}, in {column.unit} in {file}"
            raise InputError(message, hint="plot the files on their own")
        units[column.joint] = (file, column.unit)
    every = {column.unit for _, column in listed}
    return DisplayUnits(
        tuple(f"j{number + 1}" for number in range(count)),
        tuple(_TYPES[units[joint][1]] if joint in units else None for joint in range(count)),
        Units("deg" if "deg" in every else "rad", "mm" if "mm" in every else "m"),
    )


def require_joints(file: str, columns: Sequence[Column], display: DisplayUnits) -> None:
    """Refuse a file that does not fit the joints of a job.

    Raises:
        InputError: When it has more joints, or an angle where a joint has lengths.
    """
    for column in columns:
        if column.joint is None:
            continue
        if column.joint >= len(display.joint_names):
            count = len(display.joint_names)
            message = f"{file} has a column {column.name}, and the robot of the job {count} joint"
            raise InputError(message + "s" * (count != 1), hint="plot the file on its own")
        kind, said = display.joint_types[column.joint], _TYPES.get(column.unit)
        if kind is not None and said not in (None, kind):
            name = display.joint_names[column.joint]
            raise InputError(f"{file} has a column {column.name}, and {name} is a {kind} joint")
