"""Units of measurement: of a file's plain numbers, and in strings that carry their own.

Inside the house everything is SI. A number of a file is `value * factor(quantity, units)`; a string such as
"120 deg/s" says its unit itself. The units that strings may use:

| dimension | units |
|---|---|
| angle | rad, mrad, deg, °, rev; rpm for rev/min |
| length | m, cm, mm, um |
| time | s, ms, us, min |
| frequency | Hz, kHz |
| mass | kg, g |
| force | N, kN |
| torque | N m, Nm, kN m |
| inertia | kg m^2, kg m² |

A rate is an angle or a length over a time: `deg/s`, `mm/s^2`, `m/s³`, `rev/min`. Ratios have no unit.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Literal, get_args

from trajcli.errors import Amount, InputError
from trajcli.frozen import comparable

Dimension = Literal["angle", "length", "time", "frequency", "ratio", "mass", "force", "torque", "inertia"]
AngleUnit = Literal["rad", "deg"]
LengthUnit = Literal["m", "mm"]

_ANGLES = {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180, "°": math.pi / 180, "rev": 2 * math.pi}
_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6}
_TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "min": 60.0}
_FREQUENCIES = {"Hz": 1.0, "kHz": 1e3}
_UNITS = {
    "angle": _ANGLES,
    "length": _LENGTHS,
    "time": _TIMES,
    "frequency": _FREQUENCIES,
    "mass": {"kg": 1.0, "g": 1e-3},
    "force": {"N": 1.0, "kN": 1e3},
    "torque": {"N m": 1.0, "Nm": 1.0, "kN m": 1e3, "kNm": 1e3},
    "inertia": {"kg m^2": 1.0, "kg m²": 1.0},
}
_FIXED = {
    "time": "s",
    "frequency": "Hz",
    "ratio": "",
    "mass": "kg",
    "force": "N",
    "torque": "N m",
    "inertia": "kg m^2",
}

_ALIASES = {"rpm": "rev/min"}
_EXPONENTS = {"": 1, "^2": 2, "²": 2, "^3": 3, "³": 3}
_RATES = ("", "/s", "/s^2", "/s^3")
_ORDERS = ("", " per second", " per second squared", " per second cubed")
_EXAMPLES = {
    "angle": "120 deg",
    "length": "250 mm",
    "time": "0.5 s",
    "frequency": "500 Hz",
    "mass": "3.2 kg",
    "force": "400 N",
    "torque": "28 N m",
    "inertia": "0.02 kg m^2",
}
_QUOTED = 40  # characters of the user's text that a message repeats

_DECIMAL_COMMA = re.compile(r"\s*([-+]?[0-9]+),([0-9]+)")
_NUMBER = re.compile(r"\s*([-+]?(?:\.[0-9]+|[0-9]+(?:\.[0-9]*)?)(?:[eE][-+]?[0-9]+)?)\s*(.*?)\s*", re.DOTALL)
_RATE = re.compile(r"([^\s/]+)\s*/\s*([a-z]+)(\^2|\^3|²|³|)")


class UnitError(ValueError):
    """A string is not a quantity of the wanted kind; the message says what was expected."""


@comparable
class Units:
    """The units of a file's plain numbers; time is always in seconds, frequency in hertz."""

    angle: AngleUnit = "rad"
    length: LengthUnit = "m"

    def __post_init__(self) -> None:
        if self.angle not in ("rad", "deg") or self.length not in ("m", "mm"):
            raise ValueError(
                f"no such units: angle {self.angle!r}, length {self.length!r}; expected rad or deg, m or mm"
            )


def units_of(value: object) -> Units:
    """Return the units that a mapping states as far as they are right; what is left out is SI."""
    given = value if isinstance(value, Mapping) else {}
    angle, length = given.get("angle"), given.get("length")
    return Units("deg" if angle == "deg" else "rad", "mm" if length == "mm" else "m")


@comparable
class Quantity:
    """What a number measures.

    Attributes:
        dimension: The kind of number.
        order: Time derivative, for angles and lengths: 0 the value, 1 velocity, 2 acceleration, 3 jerk.
    """

    dimension: Dimension
    order: int = 0

    def __post_init__(self) -> None:
        if self.order not in range(4 if self.dimension in ("angle", "length") else 1):
            raise ValueError(f"a {self.dimension} has no time derivative of order {self.order}")


def factor(quantity: Quantity, units: Units) -> float:
    """Return the SI value of one user unit; exactly 1.0 where the user's unit is SI."""
    if quantity.dimension == "angle":
        return _ANGLES[units.angle]
    return _LENGTHS[units.length] if quantity.dimension == "length" else 1.0


def unit_name(quantity: Quantity, units: Units) -> str:
    """Return the user's unit as messages say it, such as "deg/s" or "mm/s^2"; empty for a ratio."""
    if quantity.dimension in _FIXED:
        return _FIXED[quantity.dimension]
    return (units.angle if quantity.dimension == "angle" else units.length) + _RATES[quantity.order]


def joint_quantity(joint_type: str, order: int = 0) -> Quantity:
    """Return what the value of a joint measures, or its time derivative of the given order."""
    return Quantity("length" if joint_type == "prismatic" else "angle", order)


def effort_quantity(joint_type: str) -> Quantity:
    """Return what drives a joint: a force, or a torque."""
    return Quantity("force" if joint_type == "prismatic" else "torque")


def joint_units(joint_types: Sequence[str], order: int = 0) -> list[str]:
    """Return the SI unit of each joint's position, or of its time derivative of an order."""
    return [unit_name(joint_quantity(kind, order), Units()) for kind in joint_types]


def effort_unit(joint_type: str) -> str:
    """Return the unit of what drives a joint, the same in all units of a job."""
    return _FIXED[effort_quantity(joint_type).dimension]


def named_units(text: str, times: Iterable[str] = ()) -> dict[str, str]:
    """Return the unit of each dimension that the option `--units`, such as "deg,mm", names.

    Args:
        text: Its value.
        times: Units of time that it may name.

    Raises:
        InputError: When one is unknown, or two are of one dimension.
    """
    from trajcli.suggest import did_you_mean

    measured = dict.fromkeys(get_args(AngleUnit), "angle") | dict.fromkeys(get_args(LengthUnit), "length")
    measured |= dict.fromkeys(times, "time")
    named: dict[str, str] = {}
    for unit in map(str.strip, text.split(",")):
        if unit not in measured:
            hint = did_you_mean(unit, measured) or f"units are {', '.join(measured)}"
            raise InputError(f"--units: unknown unit '{unit}'", hint=hint)
        if measured[unit] in named:
            raise InputError(
                f"--units: {named[measured[unit]]} and {unit} are both units of {measured[unit]}"
            )
        named[measured[unit]] = unit
    return named


def typeset(unit: str) -> str:
    """Return a unit as pictures show it, such as "deg/s²" for "deg/s^2"."""
    return unit.replace("^2", "²").replace("^3", "³")


def to_user(si: float, quantity: Quantity, units: Units) -> float:
    """Return an SI number in user units."""
    return si / factor(quantity, units)


def amount_text(amount: Amount, joint_types: Sequence[str], units: Units) -> str:
    """Return a number of a message in user units.

    Args:
        amount: The number, SI.
        joint_types: "revolute" or "prismatic" for each joint.
        units: Of the user.
    """
    if amount.value in (math.inf, -math.inf):
        return "unlimited"
    if amount.unit is not None:
        return str(amount)
    if amount.joint is not None:
        quantity = joint_quantity(joint_types[amount.joint], amount.order)
    else:
        quantity = Quantity(amount.dimension or "time", amount.order)
    numbers = amount.numbers(lambda value: to_user(value, quantity, units))
    return f"{numbers} {unit_name(quantity, units)}"


def parse_quantity(text: str, quantity: Quantity) -> float:
    """Return a number with its unit, such as "120 deg/s", in SI.

    Args:
        text: A decimal number and a unit of the module's table, with or without a space between.
        quantity: What it must measure.

    Raises:
        UnitError: When it is no such quantity, or too large for a float64.
    """
    match = _NUMBER.fullmatch(text)
    if match is None:
        raise UnitError(_expected(quantity, text))
    comma = _DECIMAL_COMMA.match(text)
    if comma is not None:
        raise UnitError(f"{_expected(quantity, text)}: write {comma[1]}.{comma[2]}, decimals have a point")
    number, unit = match.groups()
    if not unit:
        unitless = quantity.dimension == "ratio"
        remedy = f"write {number} without quotes" + ("" if unitless else ", or give it a unit")
        raise UnitError(f"{_expected(quantity, text)}: {remedy}")
    scale = _scale(unit, quantity)
    if scale is None:
        raise UnitError(_expected(quantity, text) + _unknown(unit, quantity))
    value = float(number) * scale
    if not math.isfinite(value):
        raise UnitError(f"{_shown(text)} is too large")
    return value


def _scale(unit: str, quantity: Quantity) -> float | None:
    """Return the SI value of one `unit`; None when it does not measure the quantity."""
    table = _UNITS.get(quantity.dimension, {})
    if quantity.order == 0:
        return table.get(unit)
    rate = _RATE.fullmatch(_ALIASES.get(unit, unit))
    if rate is None or _EXPONENTS[rate[3]] != quantity.order or rate[1] not in table or rate[2] not in _TIMES:
        return None
    return table[rate[1]] / _TIMES[rate[2]] ** quantity.order


def _unknown(unit: str, quantity: Quantity) -> str:
    """Return the words that name the quantity's units, after a unit which is none at all."""
    names = [name for table in _UNITS.values() for name in table]
    rate = _RATE.fullmatch(_ALIASES.get(unit, unit))
    base, period = (rate[1], rate[2]) if rate else (unit, "s")
    if (base in names and period in _TIMES) or quantity.dimension == "ratio":
        return ""
    periods = f", per {', '.join(_TIMES)}" if quantity.order else ""
    return f" (units: {', '.join(_UNITS[quantity.dimension])}{periods})"


def _expected(quantity: Quantity, text: str) -> str:
    if quantity.dimension == "ratio":
        return f"expected a number without a unit such as 0.5, got {_shown(text)}"
    what = f"{'an' if quantity.dimension == 'angle' else 'a'} {quantity.dimension}{_ORDERS[quantity.order]}"
    example = _EXAMPLES[quantity.dimension] + _RATES[quantity.order]
    return f'expected {what} such as "{example}", got {_shown(text)}'


def _shown(text: str) -> str:
    return f'"{text}"' if len(text) <= _QUOTED else f'"{text[:_QUOTED]}..."'
