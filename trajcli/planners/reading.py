"""How a value of a job file becomes SI: the field types that carry unit, bounds and description once.

A field type is an annotation, such as `Annotated[float, Number(...)]`, that pydantic asks for a validator
and for a JSON schema. The reading context says which units the file uses and which joints the robot has;
without one (a planner built in Python) values are SI.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from pydantic import GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from trajcli.units import Quantity, UnitError, Units, factor, parse_quantity, unit_name

MAX_JOINTS = 12
Path = tuple[str | int, ...]
Flaw = tuple[Path, str, str | None]


@dataclass
class ReadingContext:
    """What is known about the file while its values are read.

    Attributes:
        units: Units of plain numbers.
        joint_names: Names of the robot's joints; None when the robot could not be read, or is not known yet:
            values by joint are then checked for form only.
        joint_types: "revolute" or "prismatic" for each joint.
        points: The file's named points, as plain mappings.
    """

    units: Units = field(default_factory=Units)
    joint_names: tuple[str, ...] | None = None
    joint_types: tuple[str, ...] = ()
    points: Mapping[str, Any] = field(default_factory=dict)

    def joint_quantity(self, joint: int, order: int) -> Quantity:
        """Return the quantity of a joint's value or of its time derivative."""
        prismatic = joint < len(self.joint_types) and self.joint_types[joint] == "prismatic"
        return Quantity("length" if prismatic else "angle", order)


SI = ReadingContext()


class FlawError(ValueError):
    """Something about a value is wrong: where below it, what, and what would fix it."""

    def __init__(self, message: str, *path: str | int, hint: str | None = None) -> None:
        super().__init__(message)
        self.flaws: list[Flaw] = [(path, message, hint)]


def refuse(flaws: Sequence[Flaw]) -> PydanticCustomError:
    """Return the error that carries the flaws of one value through pydantic."""
    return PydanticCustomError(
        "flaws", "{text}", {"text": "; ".join(flaw[1] for flaw in flaws), "flaws": list(flaws)}
    )


def shown(value: object) -> str:
    """Return a value of a file as it is quoted in messages."""
    if isinstance(value, str):
        return f'"{value}"'
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "a mapping"
    return (
        "a list"
        if isinstance(value, list | tuple)
        else f"{value:g}"
        if isinstance(value, float)
        else str(value)
    )


def read_number(value: object, quantity: Quantity, units: Units) -> float:
    """Return a number, or a string with its unit, in SI.

    Raises:
        FlawError: When it is neither, not finite, or of another unit.
    """
    unit = unit_name(quantity, units)
    if isinstance(value, str):
        try:
            return parse_quantity(value, quantity)
        except UnitError as error:
            raise FlawError(str(error)) from None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FlawError(f"expected a number{f' ({unit})' if unit else ''}, got {shown(value)}")
    if not math.isfinite(value):
        raise FlawError(f"expected a finite number{f' ({unit})' if unit else ''}, got {value}")
    return float(value) * factor(quantity, units)


class FieldType:
    """Base of the annotations: pydantic calls `read`, the JSON schema is `json_schema`."""

    description: str

    def read(self, value: Any, context: ReadingContext) -> Any:  # noqa: ANN401
        """Return the value in SI.

        Raises:
            FlawError: When it does not fit.
        """
        raise TypeError(type(self).__name__)

    def json_schema(self) -> JsonSchemaValue:
        """Return the JSON schema of what may stand in a file."""
        raise TypeError(type(self).__name__)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:  # noqa: ANN401
        def validate(value: Any, info: core_schema.ValidationInfo) -> Any:  # noqa: ANN401
            try:
                return self.read(value, info.context or SI)
            except FlawError as error:
                raise refuse(error.flaws) from None

        return core_schema.with_info_plain_validator_function(validate)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return {**self.json_schema(), "description": self.description}


@dataclass(frozen=True)
class Number(FieldType):
    """A number with its unit, such as a duration.

    Attributes:
        quantity: What it measures.
        description: For the JSON schema; the unit is added.
        above: It must be above this, SI.
        at_least: It must be at least this, SI.
        at_most: It must be at most this, SI.
    """

    quantity: Quantity
    description: str
    above: float | None = None
    at_least: float | None = None
    at_most: float | None = None

    def read(self, value: Any, context: ReadingContext) -> float:  # noqa: ANN401
        """Return the number in SI."""
        number = read_number(value, self.quantity, context.units)
        unit = unit_name(self.quantity, context.units)
        rules = [
            ("above", self.above, number.__gt__),
            ("at least", self.at_least, number.__ge__),
            ("at most", self.at_most, number.__le__),
        ]
        stated = [(word, bound, keeps) for word, bound, keeps in rules if bound is not None]
        if not all(keeps(bound) for _, bound, keeps in stated):
            bounds = " and ".join(f"{word} {bound:g}" for word, bound, _ in stated)
            raise FlawError(f"expected a number {bounds}{f' {unit}' if unit else ''}, got {shown(value)}")
        return number

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of a number or a string with its unit."""
        number: dict[str, Any] = {"type": "number"}
        for key, bound in (
            ("exclusiveMinimum", self.above),
            ("minimum", self.at_least),
            ("maximum", self.at_most),
        ):
            if bound is not None:
                number[key] = bound
        if self.quantity.dimension == "ratio":
            return number
        return {"anyOf": [number, {"type": "string", "pattern": "^[-+.0-9]"}]}


def read_per_joint(
    value: Any,  # noqa: ANN401
    context: ReadingContext,
    read_one: Callable[[Any, int], Any],
    missing: Any = ...,  # noqa: ANN401
) -> tuple[Any, ...]:
    """Return one value for each joint from one for all, a list, or a mapping by joint name.

    Args:
        value: As it stands in the file.
        context: Which joints there are.
        read_one: Reads the value of the joint with the given index.
        missing: What a mapping leaves out; without it, leaving one out is a flaw.

    Raises:
        FlawError: With every flaw that was found.
    """
    names = context.joint_names
    if isinstance(value, Mapping):
        items = _named_items(value, names)
    elif isinstance(value, list | tuple):
        items = {i: (i, item) for i, item in enumerate(value)}
        if names is not None and len(value) != len(names):
            raise FlawError(
                f"expected {len(names)} values, one for each joint, got {len(value)}", hint=_listed(names)
            )
    elif names is None and context is SI:
        raise FlawError(f"expected a list with one value for each joint, got {shown(value)}")
    else:
        items = {i: (None, value) for i in range(len(names or ("",)))}
    return _read_items(items, names, read_one, missing)


def _listed(names: Sequence[str]) -> str:
    return f"the joints are {', '.join(names)}"


def _named_items(value: Mapping[str, Any], names: tuple[str, ...] | None) -> dict[int, tuple[str, Any]]:
    if names is None:
        return {i: (name, item) for i, (name, item) in enumerate(value.items())}
    unknown: list[Flaw] = [
        ((n,), f"the robot has no joint '{n}'", _listed(names)) for n in value if n not in names
    ]
    if unknown:
        error = FlawError("")
        error.flaws = unknown
        raise error
    return {names.index(name): (name, item) for name, item in value.items()}


def _read_items(
    items: Mapping[int, tuple[str | int | None, Any]],
    names: tuple[str, ...] | None,
    read_one: Callable[[Any, int], Any],
    missing: Any,  # noqa: ANN401
) -> tuple[Any, ...]:
    count = len(names) if names is not None else len(items)
    lacking = [index for index in range(count) if index not in items]
    if lacking and missing is ...:
        listed = ", ".join((names or ())[index] for index in lacking)
        raise FlawError(f"no value for {listed}", hint="name every joint, or give a list")
    values: list[Any] = [missing] * count
    flaws: list[Flaw] = []
    for index, (key, item) in items.items():
        try:
            values[index] = read_one(item, index)
        except FlawError as error:
            prefix: Path = () if key is None else (key,)
            flaws += [((*prefix, *path), text, hint) for path, text, hint in error.flaws]
            if key is None:
                break
    if flaws:
        error = FlawError("")
        error.flaws = flaws
        raise error
    return tuple(values)


@dataclass(frozen=True)
class PerJoint(FieldType):
    """A joint value or one of its time derivatives, for each joint.

    Attributes:
        order: 0 for a position, 1 to 3 for its derivatives.
        description: For the JSON schema.
        zero_missing: Whether joints that a mapping leaves out are zero.
        above: Each value must be above this, SI.
    """

    order: int
    description: str
    zero_missing: bool = False
    above: float | None = None

    def read(self, value: Any, context: ReadingContext) -> tuple[float, ...]:  # noqa: ANN401
        """Return one number for each joint, in SI."""

        def read_one(item: Any, joint: int) -> float:  # noqa: ANN401
            number = Number(context.joint_quantity(joint, self.order), self.description, above=self.above)
            return number.read(item, context)

        return read_per_joint(value, context, read_one, 0.0 if self.zero_missing else ...)

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of one value for all joints, a list, or a mapping by joint name."""
        one = Number(Quantity("angle", self.order), self.description, above=self.above).json_schema()
        return per_joint_schema(one)


def per_joint_schema(one: JsonSchemaValue) -> JsonSchemaValue:
    """Return the schema of `one` for all joints, a list, or a mapping by joint name."""
    listed = {"type": "array", "items": one, "minItems": 1, "maxItems": MAX_JOINTS}
    return {"anyOf": [one, listed, {"type": "object", "additionalProperties": one}]}
