"""Parts of a report: numbers that know their unit, and their conversion to the units of a job."""

from __future__ import annotations

from functools import cache
from typing import Annotated, Any, Literal, TypeVar

from pydantic import BaseModel, ConfigDict, Field

from trajcli.frozen import comparable
from trajcli.units import AngleUnit, LengthUnit, Quantity, Units, factor

Part = TypeVar("Part", bound="ReportPart")


def described(text: str) -> Any:  # noqa: ANN401
    """Return what the schema says about a field."""
    return Field(description=text)


TrajectorySeconds = Annotated[float, described("Seconds from the start of the trajectory.")]
ReportSeconds = Annotated[float, described("Seconds.")]
UnitName = Annotated[str, described("Unit of the numbers beside it, such as rad/s.")]
JointQuantity = Literal["position", "velocity", "acceleration", "jerk"]


@comparable
class MeasuredIn:
    """Marks a number of a report, or several of them.

    Attributes:
        field: Name of the field of the same part that holds the unit; a list holds one for each number.
    """

    field: str = "unit"


InSi = Annotated[float, MeasuredIn(), described("SI.")]


class ReportPart(BaseModel):
    """A part of a report."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True, from_attributes=True)


def in_units(part: Part, units: Units) -> Part:
    """Return a report in SI, or a part of one, with all numbers in the units of a job."""
    changes: dict[str, Any] = {}
    measured = _measured(type(part))
    for name, value in part.__dict__.items():
        if name in measured:
            changes[name] = _converted(value, getattr(part, measured[name]), units)
        elif name in measured.values():
            changes[name] = _unit_symbols(value, units)
        elif isinstance(value, ReportPart):
            changes[name] = in_units(value, units)
        elif isinstance(value, list | tuple) and value and isinstance(value[0], ReportPart):
            changes[name] = type(value)(in_units(each, units) for each in value)
    return part.model_copy(update=changes)


@cache
def _measured(part: type[ReportPart]) -> dict[str, str]:
    """Return for each number of a kind of part the field that holds its unit."""
    return {
        name: mark.field
        for name, field in part.model_fields.items()
        for mark in field.metadata
        if isinstance(mark, MeasuredIn)
    }


def _converted(value: Any, unit: str | list[str], units: Units) -> Any:  # noqa: ANN401
    """Return a number, or several, in SI, in the units of the job."""
    if isinstance(value, list | tuple):
        factors = [_in_job(each, units.angle, units.length)[0] for each in _each(unit, len(value))]
        pairs = zip(value, factors, strict=True)
        return type(value)(None if number is None else number / factor for number, factor in pairs)
    return None if value is None else value / _in_job(str(unit), units.angle, units.length)[0]


def _unit_symbols(unit: str | list[str], units: Units) -> str | list[str]:
    names = [_in_job(each, units.angle, units.length)[1] for each in _each(unit, 1)]
    return names[0] if isinstance(unit, str) else names


def _each(unit: str | list[str], count: int) -> list[str]:
    return [unit] * count if isinstance(unit, str) else unit


@cache
def _in_job(unit: str, angle: AngleUnit, length: LengthUnit) -> tuple[float, str]:
    """Return the SI value of the job's unit that stands for an SI unit, and its name."""
    start, slash, per = unit.partition("/")
    if start not in ("rad", "m"):
        return 1.0, unit
    quantity = Quantity("angle" if start == "rad" else "length")
    return factor(quantity, Units(angle, length)), (angle if start == "rad" else length) + slash + per
