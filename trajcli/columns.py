"""What the columns of a sample stream are called, and what a column's name says.

A column in SI has its plain name (`q1`, `qd1`, `x`), any other carries its unit (`q1_deg`, `qd1_deg`,
`q3_mm`). What is about the tool is said in world: its pose T_world_tcp, its velocity at the tcp, and the
time derivative of that.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from typing import Literal

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import comparable
from trajcli.kinematics.robot import JointType
from trajcli.units import Dimension, Quantity, Units, factor, unit_name

Group = Literal["t", "q", "qd", "qdd", "qddd", "pose", "twist", "twistd", "path", "move"]
JOINT_ORDERS = {"q": 0, "qd": 1, "qdd": 2, "qddd": 3}
TOOL_COLUMNS: dict[str, dict[str, Dimension]] = {
    "pose": {**dict.fromkeys(("x", "y", "z"), "length"), **dict.fromkeys(("qw", "qx", "qy", "qz"), "ratio")},
    "twist": {**dict.fromkeys(("vx", "vy", "vz"), "length"), **dict.fromkeys(("wx", "wy", "wz"), "angle")},
    "twistd": {**dict.fromkeys(("ax", "ay", "az"), "length"), **dict.fromkeys(("ex", "ey", "ez"), "angle")},
}
"""What the columns of a group about the tool are called, and of what dimension each is, times apart."""
PATH_COLUMNS = ("s", "sd", "sdd")
"""The way of the tool along its path in a move, and its derivatives; zero where there is none."""
GROUPS: tuple[Group, ...] = ("t", "q", "qd", "qdd", "qddd", "pose", "twist", "twistd", "path", "move")

_UNIT_FACTORS = {
    "deg": factor(Quantity("angle"), Units(angle="deg")),
    "mm": factor(Quantity("length"), Units(length="mm")),
}
_NAME = re.compile(r"(?P<stem>.+?)(?:_(?P<unit>deg|mm))?", re.DOTALL)
_JOINT = re.compile(r"(?P<kind>qd{0,3})(?P<number>[1-9][0-9]*)")


@comparable
class Column:
    """What one column holds.

    Attributes:
        kind: "t", "q", "qd", "qdd", "qddd", "move", or the plain name of any other column, such as "x".
        joint: Index of the joint, from 0; None where the column is not about one joint.
        unit: "deg" or "mm"; None for SI.
    """

    kind: str
    joint: int | None = None
    unit: str | None = None

    @property
    def name(self) -> str:
        """The column's name in a file."""
        number = "" if self.joint is None else str(self.joint + 1)
        return f"{self.kind}{number}" + (f"_{self.unit}" if self.unit else "")

    @property
    def quantity(self) -> tuple[str, int | None]:
        """Kind and joint: the same for columns that differ in nothing but their unit."""
        return self.kind, self.joint

    @property
    def factor(self) -> float:
        """SI per unit of the column."""
        return _UNIT_FACTORS[self.unit] if self.unit else 1.0

    @property
    def whole_numbers(self) -> bool:
        """Whether the column counts, and is written without decimals."""
        return self.kind == "move"


def parse_column(name: str) -> Column:
    """Return what `name` says; a name that is not of this language is a kind of its own."""
    parts = _NAME.fullmatch(name)
    stem, unit = (parts["stem"], parts["unit"]) if parts else (name, None)
    joint = _JOINT.fullmatch(stem)
    if joint:
        return Column(joint["kind"], int(joint["number"]) - 1, unit)
    return Column(stem, None, unit)


def column_names(groups: Sequence[Group], joint_types: Sequence[JointType], units: Units) -> list[str]:
    """Return the name of every column of `groups`, in the order of the groups, joints from the base on.

    Raises:
        InputError: When `groups` is empty, or holds an unknown group or one twice.
    """
    check_groups(groups)
    names: list[str] = []
    for group in groups:
        if group in JOINT_ORDERS:
            suffixes = [_suffix(_dimension(kind), units) for kind in joint_types]
            names += [Column(group, k, suffix).name for k, suffix in enumerate(suffixes)]
        elif group in TOOL_COLUMNS:
            measured = TOOL_COLUMNS[group].items()
            names += [Column(kind, None, _suffix(dimension, units)).name for kind, dimension in measured]
        elif group == "path":
            names += [Column(name, None, _suffix("length", units)).name for name in PATH_COLUMNS]
        else:
            names.append(group)
    return names


def check_groups(groups: Sequence[str]) -> None:
    """Refuse a choice of columns that cannot be written.

    Raises:
        InputError: When `groups` is empty, or holds an unknown group or one twice.
    """
    hint = f"the columns are {', '.join(GROUPS)}"
    if not groups:
        raise InputError("no columns are asked for", hint=hint)
    for place, group in enumerate(groups):
        if group not in GROUPS:
            raise InputError(f"there are no columns '{group}'", hint=hint)
        if group in groups[:place]:
            raise InputError(f"the columns '{group}' are asked for twice", hint="name them once")


def joint_factors(joint_types: Sequence[JointType], units: Units) -> Array:
    """Return SI per user unit for each joint's position and its time derivatives, shape (n,)."""
    return _factors((_dimension(kind) for kind in joint_types), units)


def tool_factors(group: str, units: Units) -> Array:
    """Return SI per user unit for each column of a group of `TOOL_COLUMNS`, shape (columns,)."""
    return _factors(TOOL_COLUMNS[group].values(), units)


def whole_number_columns(names: Sequence[str]) -> tuple[int, ...]:
    """Return the places of the columns that are written without decimals."""
    return tuple(place for place, name in enumerate(names) if parse_column(name).whole_numbers)


def _dimension(joint_type: JointType) -> Dimension:
    return "length" if joint_type == "prismatic" else "angle"


def _factors(dimensions: Iterable[Dimension], units: Units) -> Array:
    return np.array([factor(Quantity(dimension), units) for dimension in dimensions], dtype=np.float64)


def _suffix(dimension: Dimension, units: Units) -> str | None:
    unit = unit_name(Quantity(dimension), units)
    return unit if unit in _UNIT_FACTORS else None
