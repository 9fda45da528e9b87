"""Units of recorded columns: by their names, by what the user says, by a language that fixes them."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from trajcli.columns import GROUPS, JOINT_ORDERS, Column, group_of, parse_column
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.robot import JointType
from trajcli.streams.recorded.column_names import ColumnName
from trajcli.streams.recorded.column_roles import ColumnRoles, NamedFile
from trajcli.units import (
    AngleUnit,
    Dimension,
    LengthUnit,
    Quantity,
    UnitError,
    Units,
    factor,
    joint_quantity,
    named_units,
    parse_quantity,
)

_PER_SECOND = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
_RATES = ("", "/s", "/s^2", "/s^3")
_EFFORT = re.compile(r"tau[1-9][0-9]*")


@comparable
class SaidUnits:
    """Units that a user says; None for what is left open.

    Attributes:
        angle: "rad" or "deg".
        length: "m" or "mm".
        time: "s", "ms", "us" or "ns".
    """

    angle: AngleUnit | None = None
    length: LengthUnit | None = None
    time: str | None = None


def parse_units(units: str | Units | None) -> SaidUnits:
    """Return the units of a text such as "deg,mm".

    Raises:
        InputError: When one is unknown, or two are of one dimension.
    """
    if not isinstance(units, str):
        return SaidUnits() if units is None else SaidUnits(units.angle, units.length)
    said = named_units(units, _PER_SECOND)
    return SaidUnits(
        cast("AngleUnit | None", said.get("angle")),
        cast("LengthUnit | None", said.get("length")),
        said.get("time"),
    )


def columns_said(
    names: Sequence[str], said: SaidUnits, joint_types: Sequence[JointType] = ()
) -> tuple[Column, ...]:
    """Return what columns of trajcli's own names hold; those that name no unit have the one that is said.

    Args:
        names: Of the columns.
        said: What somebody says.
        joint_types: Of the joints whose columns are meant, too.
    """
    found = []
    for column in map(parse_column, names):
        quantity, joint = column.quantity, column.joint
        if joint is not None and joint < len(joint_types) and column.kind in JOINT_ORDERS:
            quantity = joint_quantity(joint_types[joint], JOINT_ORDERS[column.kind])
        dimension = None if column.unit or quantity is None else quantity.dimension
        unit = {"angle": said.angle, "length": said.length}.get(dimension or "")
        found.append(replace(column, unit=unit) if unit in ("deg", "mm") else column)
    return tuple(found)


def is_own_language(names: Sequence[str]) -> bool:
    """Return whether all names are those of trajcli's own streams, whose plain columns are in SI."""
    return all(_is_own(name) for name in names)


def _is_own(name: str) -> bool:
    column = parse_column(name)
    if column.kind in JOINT_ORDERS:
        return column.joint is not None
    return (column.joint is None and group_of(column) in GROUPS) or _EFFORT.fullmatch(name) is not None


@frozen
class ColumnScales:
    """How the numbers of the columns become SI.

    Attributes:
        factors: SI per unit of each column of the file; of the time, what `per_second` says.
        per_second: Units of the column of time in a second.
        open: Indices of the columns of joints whose unit nothing says.
        notes: Sentences about units that were taken.
        open_time: Whether nothing says the unit of the times, which are taken for seconds.
    """

    factors: Array
    per_second: float
    open: tuple[int, ...] = ()
    notes: tuple[str, ...] = ()
    open_time: bool = False


def scales_of(
    file: NamedFile,
    roles: ColumnRoles,
    said: SaidUnits,
    *,
    plain: Units | None = None,
    joint_types: Sequence[JointType] | None = None,
    declared: Units | None = None,
) -> ColumnScales:
    """Return the scales of the columns.

    Args:
        file: Names and places.
        roles: What the columns are.
        said: Units that the user says; they count for columns that name none.
        plain: Units of columns that name none where the file's language or format fixes them.
        joint_types: Of each joint; without them a joint of no unit is revolute.
        declared: Units of a job or a robot; they count where nothing else says any.

    Raises:
        InputError: When a column names a unit that does not measure it.
    """
    factors = np.ones(len(file.names))
    open_columns: list[int] = []
    bare = False
    for quantity, columns in roles.joints.items():
        for joint, index in enumerate(columns):
            kind = None if joint_types is None or joint >= len(joint_types) else joint_types[joint]
            unit = _Unit(file, roles.names[index], quantity, kind)
            scale = unit.factor(said, plain, declared)
            bare |= roles.names[index].unit is None and quantity != "tau"
            factors[index] = 1.0 if scale is None else scale
            open_columns += [index] if scale is None else []
    per_second = _per_second(file, roles, said)
    factors[roles.time] = 1 / per_second
    notes = tuple(_notes(said, plain, declared)) if bare else ()
    open_time = per_second == 1.0 and said.time is None and plain is None and not roles.names[roles.time].unit
    return ColumnScales(factors, per_second, tuple(open_columns), notes, open_time)


def _notes(said: SaidUnits, plain: Units | None, declared: Units | None) -> Iterator[str]:
    """Say which units count for columns that name none, where somebody may think otherwise."""
    text = "columns that name no unit are read in"
    if said.angle is not None or said.length is not None:
        if plain is not None:
            units = " and ".join(unit for unit in (said.angle, said.length) if unit)
            yield f"{text} {units}, as --units says"
    elif plain is None and declared is not None:
        yield f"{text} {declared.angle} and {declared.length}, as the job or the robot says"
    elif plain is not None and declared not in (None, plain):
        yield f"{text} rad and m: --units says otherwise where they are not"


@frozen
class _Unit:
    """What says the unit of a column of a joint."""

    file: NamedFile
    name: ColumnName
    quantity: str
    joint_type: JointType | None

    @property
    def order(self) -> int:
        """Time derivative that the column holds."""
        return JOINT_ORDERS.get(self.quantity, 0)

    @property
    def dimension(self) -> Dimension:
        """What the joint's position measures."""
        return "length" if self.joint_type == "prismatic" else "angle"

    def factor(self, said: SaidUnits, plain: Units | None, declared: Units | None) -> float | None:
        """Return SI per unit of the column; None where nothing says the unit."""
        if self.name.unit is not None:
            return self._factor_of(self.name.unit)
        if self.quantity == "tau":
            return 1.0
        measured = Quantity(self.dimension, self.order)
        own = said.length if self.dimension == "length" else said.angle
        if own is not None:
            return factor(measured, Units(said.angle or "rad", said.length or "m"))
        units = plain or declared
        return None if units is None else factor(measured, units)

    def _factor_of(self, unit: str) -> float:
        """Return the factor of a unit that the column names."""
        if self.quantity == "tau":
            if unit != "Nm":
                raise self._wrong(
                    f"'{unit}' is no unit of effort", "efforts are in N m, or N for prismatic joints"
                )
            return 1.0
        text = unit if "/" in unit or unit == "rpm" else f"{unit}{_RATES[self.order]}"
        dimensions: tuple[Dimension, ...] = (
            ("angle", "length") if self.joint_type is None else (self.dimension,)
        )
        for dimension in dimensions:
            try:
                return parse_quantity(f"1 {text}", Quantity(dimension, self.order))
            except UnitError:
                continue
        what = "angle or length" if self.joint_type is None else self.dimension
        rate = ("", " per second", " per second squared", " per second cubed")[self.order]
        joint = "" if self.joint_type is None else f", and the joint is {self.joint_type}"
        raise self._wrong(f"'{unit}' is no unit of an {what}{rate}".replace("an length", "a length") + joint)

    def _wrong(self, message: str, hint: str | None = None) -> InputError:
        return self.file.wrong(f"the column {self.name.text}: {message}", hint, self.name.text)


def _per_second(file: NamedFile, roles: ColumnRoles, said: SaidUnits) -> float:
    """Return how many units of the column of time are a second."""
    name = roles.names[roles.time]
    if name.unit is not None:
        if name.unit not in _PER_SECOND:
            raise file.wrong(f"the column {name.text}: '{name.unit}' is no unit of time", name=name.text)
        return _PER_SECOND[name.unit]
    return _PER_SECOND[said.time or ("ns" if roles.nanoseconds else "s")]


def no_seconds(file: NamedFile, name: str, apart: float) -> InputError:
    """Return the error about times whose unit nothing says, and which are too far apart to be seconds."""
    hint = "say it as in --units rad,ns, or --units rad,s where they are seconds"
    return file.wrong(f"nothing says the unit of {name}: the rows stand {apart:.6g} apart", hint, name)


def no_unit(file: NamedFile, names: Sequence[str], largest: float) -> InputError:
    """Return the error about columns whose unit nothing says.

    Args:
        file: Names and places.
        names: Of the columns.
        largest: The largest magnitude in them.
    """
    listed = ", ".join(names) if len(names) <= 3 else f"{names[0]} .. {names[-1]}"
    guess = "degrees?" if largest > 4 * np.pi else "radians?"
    hint = f"values up to {largest:.3g}: {guess} say it with --units rad or --units deg"
    if file.place(names[0]) is not None:
        suffixed = re.sub(r"\W+", "_", names[0]).strip("_")
        hint += f", or call it {suffixed}_deg"
    return file.wrong(f"nothing says the unit of {listed}", hint, names[0])
