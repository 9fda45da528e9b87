"""Columns of a sample stream: their names and the quantities they hold.

A column in SI has its plain name (`q1`, `qd1`, `x`), any other carries its unit (`q1_deg`, `qd1_deg`,
`q3_mm`). What is about the tool is said in world: its pose T_world_tcp, its velocity at the tcp, and the
time derivative of that.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Literal

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, TrajcliError
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.robot import JointType
from trajcli.units import (
    Dimension,
    Quantity,
    Units,
    effort_quantity,
    factor,
    joint_quantity,
    unit_name,
)

Group = Literal[
    "t", "q", "qd", "qdd", "qddd", "pose", "twist", "twistd", "path", "tau", "zone", "signals", "move"
]
GROUPS: tuple[Group, ...] = (
    "t",
    "q",
    "qd",
    "qdd",
    "qddd",
    "pose",
    "twist",
    "twistd",
    "path",
    "tau",
    "zone",
    "signals",
    "move",
)
JOINT_ORDERS = {"q": 0, "qd": 1, "qdd": 2, "qddd": 3}
EFFORT: Group = "tau"
"""The group of torques and forces, in N m and N whatever the units."""
SIGNALS: Group = "signals"
"""The group of the signals of a job: a column `signal.NAME` for each."""
_SIGNAL = "signal."
JOINT_GROUPS = (*JOINT_ORDERS, EFFORT)
"""Groups with a column for each joint."""


def _tool(linear: Sequence[str], angular: Sequence[str], order: int) -> dict[str, Quantity]:
    lengths, angles = Quantity("length", order), Quantity("angle", order)
    return {**dict.fromkeys(linear, lengths), **dict.fromkeys(angular, angles)}


TOOL_COLUMNS: Mapping[str, Mapping[str, Quantity]] = {
    "pose": {**_tool("xyz", (), 0), **dict.fromkeys(("qw", "qx", "qy", "qz"), Quantity("ratio"))},
    "twist": _tool(("vx", "vy", "vz"), ("wx", "wy", "wz"), 1),
    "twistd": _tool(("ax", "ay", "az"), ("ex", "ey", "ez"), 2),
}
"""What the columns of a group about the tool are called, and what each measures."""
_COLUMNS: Mapping[str, Mapping[str, Quantity]] = {
    "t": {"t": Quantity("time")},
    **TOOL_COLUMNS,
    # Arc length of the tool along its path in a move, and its derivatives; zero where there is no path.
    "path": {"s": Quantity("length"), "sd": Quantity("length", 1), "sdd": Quantity("length", 2)},
    "zone": {"zone": Quantity("ratio")},
    "move": {"move": Quantity("ratio")},
}
_QUANTITIES = {kind: quantity for group in _COLUMNS.values() for kind, quantity in group.items()}

_DIMENSIONS: dict[str, Dimension] = {"deg": "angle", "mm": "length"}
_UNIT_FACTORS = {
    "deg": factor(Quantity("angle"), Units(angle="deg")),
    "mm": factor(Quantity("length"), Units(length="mm")),
}
_NAME = re.compile(r"(?P<stem>.+?)(?:_(?P<unit>deg|mm))?", re.DOTALL)
_JOINT = re.compile(r"(?P<kind>qd{0,3}|tau)(?P<number>[1-9][0-9]*)")


@comparable
class Column:
    """What one column holds.

    Attributes:
        kind: "t", "q", "qd", "qdd", "qddd", "tau", "move", or the plain name of any other column, as "x".
        joint: Index of the joint, from 0; None where the column is not about one joint.
        unit: "deg" or "mm"; None for SI.
        quantity: What its numbers measure; None where nothing says it, as in a file the name `q1` of a joint
            of any type.
    """

    kind: str
    joint: int | None = None
    unit: str | None = None
    quantity: Quantity | None = None

    @property
    def name(self) -> str:
        """The column's name in a file."""
        number = "" if self.joint is None else str(self.joint + 1)
        return f"{self.kind}{number}" + (f"_{self.unit}" if self.unit else "")

    @property
    def factor(self) -> float:
        """SI per unit of the column."""
        return _UNIT_FACTORS[self.unit] if self.unit else 1.0

    @property
    def whole_numbers(self) -> bool:
        """Whether the column counts, and is written without decimals."""
        return self.kind in ("move", "zone")


def parse_column(name: str) -> Column:
    """Return what `name` says; a name that is not of this language is a kind of its own."""
    if name.startswith(_SIGNAL):
        return Column(name, None, None, Quantity("ratio"))
    parts = _NAME.fullmatch(name)
    stem, unit = (parts["stem"], parts["unit"]) if parts else (name, None)
    joint = _JOINT.fullmatch(stem)
    if joint is None or (unit is not None and joint["kind"] == EFFORT):
        quantity = _QUANTITIES.get(stem)
        contradicted = quantity is not None and unit is not None and quantity.dimension != _DIMENSIONS[unit]
        return Column(stem, None, unit, None if contradicted else quantity)
    kind = joint["kind"]
    quantity = Quantity(_DIMENSIONS[unit], JOINT_ORDERS[kind]) if unit else None
    return Column(kind, int(joint["number"]) - 1, unit, quantity)


def group_of(column: Column) -> str:
    """Return the group that a column belongs to; one of no group is a group of its own."""
    if column.kind.startswith(_SIGNAL):
        return SIGNALS
    return next((group for group, kinds in _COLUMNS.items() if column.kind in kinds), column.kind)


@frozen
class RowField:
    """A group of the columns of rows, or a signal: the columns from `first` to before `stop`.

    Attributes:
        name: Of the group, or of the column of a signal.
        first: Index of its first column.
        stop: One behind the index of the last.
        alone: Whether it is a single number, about no joint.
        whole_numbers: Whether that counts.
    """

    name: str
    first: int
    stop: int
    alone: bool
    whole_numbers: bool


def row_fields(columns: Sequence[Column]) -> tuple[RowField, ...]:
    """Return the groups of columns in their order.

    Raises:
        TrajcliError: When the columns of a group stand apart.
    """
    fields: dict[str, RowField] = {}
    last = ""
    for index, column in enumerate(columns):
        group = group_of(column)
        name = column.kind if group == SIGNALS else group
        if name in fields and name != last:
            raise TrajcliError(f"the columns {name} stand apart")
        first = fields[name].first if name in fields else index
        alone = name == column.kind and column.joint is None and first == index
        fields[name] = RowField(name, first, index + 1, alone, alone and column.whole_numbers)
        last = name
    return tuple(fields.values())


def kinds_of(group: str) -> tuple[str, ...]:
    """Return the kinds of the columns of a group that is not about joints; none for another name."""
    return tuple(_COLUMNS.get(group, ()))


def columns_of(
    groups: Sequence[Group],
    joint_types: Sequence[JointType],
    units: Units,
    signals: Sequence[str] = (),
) -> tuple[Column, ...]:
    """Return every column of `groups`, in the order of the groups, joints from the base on.

    Raises:
        InputError: When `groups` is empty, or holds an unknown group or one twice.
    """
    check_groups(groups)
    columns: list[Column] = []
    for group in groups:
        if group in JOINT_GROUPS:
            for joint, kind in enumerate(joint_types):
                effort = group == EFFORT
                quantity = effort_quantity(kind) if effort else joint_quantity(kind, JOINT_ORDERS[group])
                columns.append(Column(group, joint, _unit(quantity, units), quantity))
        elif group == SIGNALS:
            columns += [Column(_SIGNAL + name, None, None, Quantity("ratio")) for name in signals]
        else:
            measured = _COLUMNS[group].items()
            columns += [Column(kind, None, _unit(quantity, units), quantity) for kind, quantity in measured]
    return tuple(columns)


def check_groups(groups: Sequence[str]) -> None:
    """Refuse a choice of columns that cannot be written.

    Raises:
        InputError: When `groups` is empty, or holds an unknown group or one twice.
    """
    hint = f"the columns are {', '.join(GROUPS)}"
    if not groups:
        raise InputError("no columns are asked for", hint=hint)
    for index, group in enumerate(groups):
        if group not in GROUPS:
            raise InputError(f"there are no columns '{group}'", hint=hint)
        if group in groups[:index]:
            raise InputError(f"the columns '{group}' are asked for twice", hint="name them once")


def joint_factors(joint_types: Sequence[JointType], units: Units) -> Array:
    """Return SI per user unit for each joint's position and its time derivatives, shape (n,)."""
    return _factors(map(joint_quantity, joint_types), units)


def group_factors(group: str, units: Units) -> Array:
    """Return SI per user unit for each column of a group that is not about joints, shape (columns,)."""
    return _factors(_COLUMNS[group].values(), units)


def whole_number_columns(columns: Iterable[Column]) -> tuple[int, ...]:
    """Return the indices of the columns that are written without decimals."""
    return tuple(index for index, column in enumerate(columns) if column.whole_numbers)


def require_finite(rows: Array, columns: Sequence[Column], before: int) -> None:
    """Refuse rows with a value that is not finite.

    Args:
        rows: Shape (N, m).
        columns: What they hold.
        before: How many rows came before them.

    Raises:
        TrajcliError: With the column, the value and the row of the first.
    """
    finite = np.isfinite(rows)
    if not finite.all():
        row, index = np.argwhere(~finite)[0]
        raise TrajcliError(
            f"{columns[index].name} is {rows[row, index]} in row {before + row}; nothing of it is written"
        )


def _factors(quantities: Iterable[Quantity], units: Units) -> Array:
    return np.array([factor(quantity, units) for quantity in quantities], dtype=np.float64)


def _unit(quantity: Quantity, units: Units) -> str | None:
    unit = unit_name(Quantity(quantity.dimension), units)
    return unit if unit in _UNIT_FACTORS else None
