"""Numbers with units, as field types of pydantic models, and the base of these models.

A field type is an annotation, such as `Annotated[float, Number(...)]`, that pydantic asks for a validator
and a JSON schema. The reading context says which units the file uses and which joints the robot has; without
one (a planner built in Python) values are SI.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ValidationInfo,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, PydanticCustomError, core_schema

from trajcli.frozen import comparable
from trajcli.units import (
    Quantity,
    UnitError,
    Units,
    factor,
    parse_quantity,
    unit_name,
)

if TYPE_CHECKING:
    from trajcli.language.recorded import Recorded, RecordedPoses

MAX_JOINTS = 12
LONGEST_NAME = 200
"""Characters of a name that a file gives: more would fill messages."""
_UNPRINTED = ("Cc", "Cf", "Cs", "Zl", "Zp")  # controls, marks of direction, halves of pairs, breaks of lines
LARGEST_POSITION = 1e12
"""Magnitude of an angle or a length, rad or m, that no robot reaches."""
LARGEST_RATE = 1e30
"""Magnitude of a velocity, an acceleration or a jerk that no robot reaches, SI."""
LARGEST_OTHER = 1e12
"""Magnitude of times, frequencies and ratios that no job needs."""
SMALLEST = 1e-12
"""Least duration, s, and least limit, SI; below it rounding is as large as what is asked for."""
SMALLEST_DISTANCE = 1e-15
"""Least length or angle that must be above zero, such as a tolerance, m or rad."""
FieldPath = tuple[str | int, ...]
Flaw = tuple[FieldPath, str, str | None]
"""Where below a value something is wrong, what, and what would fix it."""
AT_KEY = "\0key"
"""Last step of a path that means a key itself, not the value behind it."""


@dataclass
class ReadingContext:
    """Units, robot and points of the file whose values are read.

    Attributes:
        units: Units of plain numbers.
        joint_names: Names of the robot's joints; None when the robot could not be read, or is not known yet:
            values by joint are then checked for form only.
        joint_types: "revolute" or "prismatic" for each joint.
        points: The file's named points, as plain mappings.
        shifted: Relative points that were resolved, by name: their fields as in a file.
        frames: The file's frames, as plain mappings.
        tools: The file's tools, as plain mappings.
        placed: Frames that were resolved, by name: T_world_frame, (4, 4), m.
        circular: Frames of a circle that was found: it is said once.
        base: Where the arm stands, T_world_base, (4, 4), m.
        waits: Whether a target is given relative to what only the plan knows.
        has_far_angle: Whether a pose has a plain angle of more than two turns, which is a slip of the unit.
        has_matrix: Whether a rotation is given by its matrix.
        read_points: Reads a file of recorded joint values, its path relative to the job; raises FlawError.
        read_poses: Likewise one of poses of the tool.
    """

    units: Units = field(default_factory=Units)
    joint_names: tuple[str, ...] | None = None
    joint_types: tuple[str, ...] = ()
    points: Mapping[str, Any] = field(default_factory=dict)
    shifted: dict[str, dict[str, Any]] = field(default_factory=dict)
    frames: Mapping[str, Any] = field(default_factory=dict)
    tools: Mapping[str, Any] = field(default_factory=dict)
    placed: dict[str, np.ndarray] = field(default_factory=dict)
    circular: set[str] = field(default_factory=set)
    base: np.ndarray = field(default_factory=lambda: np.eye(4))
    waits: bool = False
    has_far_angle: bool = False
    has_matrix: bool = False
    read_points: Callable[[str], Recorded] | None = None
    read_poses: Callable[[str], RecordedPoses] | None = None

    def joint_quantity(self, joint: int, order: int) -> Quantity:
        """Return the quantity of a joint's value or of its time derivative."""
        prismatic = joint < len(self.joint_types) and self.joint_types[joint] == "prismatic"
        return Quantity("length" if prismatic else "angle", order)


SI = ReadingContext()
TWO_TURNS = 4 * math.pi
"""rad: no pose needs a larger angle, and most joints have a smaller range."""
_WHOLE = 1e-9  # a ratio that is a whole number but for rounding
_BEYOND_ANY_ROBOT = "no robot has such a number: check its exponent and its unit"


class FlawError(ValueError):
    """Something about a value is wrong: where below it, what, and what would fix it."""

    def __init__(self, message: str, *path: str | int, hint: str | None = None) -> None:
        super().__init__(message)
        self.flaws: list[Flaw] = [(path, message, hint)]

    def below(self, *keys: str | int) -> list[Flaw]:
        """Return the flaws of a value that stands at some keys of another one."""
        return [((*keys, *path), text, hint) for path, text, hint in self.flaws]


@contextmanager
def flaws_below(*keys: str | int) -> Iterator[None]:
    """Put flaws from within below some keys."""
    try:
        yield
    except FlawError as error:
        error.flaws = error.below(*keys)
        raise


def refuse(flaws: Sequence[Flaw]) -> PydanticCustomError:
    """Return the error that carries the flaws of one value through pydantic."""
    return PydanticCustomError(
        "flaws", "{text}", {"text": "; ".join(flaw[1] for flaw in flaws), "flaws": list(flaws)}
    )


def refuse_flaws(flaws: Iterable[Flaw]) -> None:
    """Raise the error that carries the flaws of one value, where it has any.

    Raises:
        PydanticCustomError: With all of them.
    """
    found = list(flaws)
    if found:
        raise refuse(found)


class _Null:
    """Stands for a null where a file may leave a value out, but not empty."""


NULL = _Null()


def flaw_of_name(name: str) -> str | None:
    """Return what is wrong with a name; None where nothing is.

    Control characters in a name could write commands into the log of a continuous integration.
    """
    if not name:
        return "expected a text that is not empty"
    if len(name) > LONGEST_NAME:
        from trajcli.suggest import abridged

        return f"a name has at most {LONGEST_NAME} characters, '{abridged(name)}' has {len(name)}"
    if name.isprintable():
        return None
    from unicodedata import category

    bad = next((letter for letter in name if category(letter) in _UNPRINTED), None)
    return None if bad is None else f"a name holds no control characters, got U+{ord(bad):04X} in {name!r}"


def shown(value: object) -> str:
    """Return a value of a file as it is quoted in messages."""
    if isinstance(value, str):
        from trajcli.suggest import abridged

        return f'"{abridged(value)}"'
    if value is None or value is NULL:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, Mapping):
        return "a mapping"
    if isinstance(value, list | tuple):
        return "a list"
    return f"{value:.15g}" if isinstance(value, float) else str(value)


def read_number(value: object, quantity: Quantity, units: Units) -> float:
    """Return a number, or a string with its unit, in SI.

    Raises:
        FlawError: When it is neither, not finite, or of another unit.
    """
    unit = unit_name(quantity, units)
    if isinstance(value, str):
        try:
            number = parse_quantity(value, quantity)
        except UnitError as error:
            raise FlawError(str(error)) from None
        return within_bounds(number, value, quantity, units)
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise FlawError(f"expected a number{f' ({unit})' if unit else ''}, got {shown(value)}")
    if not math.isfinite(value):
        raise FlawError(f"expected a finite number{f' ({unit})' if unit else ''}, got {value}")
    return within_bounds(float(value) * factor(quantity, units), value, quantity, units)


def _largest(quantity: Quantity) -> float:
    """Return the largest magnitude, SI, that a number of a quantity may have."""
    if quantity.dimension in ("angle", "length"):
        return LARGEST_RATE if quantity.order else LARGEST_POSITION
    return LARGEST_OTHER


def magnitude_schema(quantity: Quantity, *, positive: bool = False) -> JsonSchemaValue:
    """Return the bounds of a plain number in a JSON schema, of the unit that allows most, to three digits.

    Args:
        quantity: What the number measures; a length, where it may be an angle or a length.
        positive: Whether it must be above zero.
    """
    units = Units("deg", "mm")
    largest = _largest(quantity) / factor(quantity, units)
    digit = 10.0 ** (math.floor(math.log10(largest)) - 2)
    largest = math.ceil(largest / digit - _WHOLE) * digit
    return {"minimum": _least(quantity) if positive else -largest, "maximum": largest}


def object_schema(properties: Mapping[str, Any], *required: str, **stated: Any) -> JsonSchemaValue:  # noqa: ANN401
    """Return the JSON schema of a mapping that has no other keys; what else is stated stands at its end."""
    shape = {"type": "object", "properties": dict(properties), "required": list(required)}
    return {**shape, "additionalProperties": False, **stated}


def number_schema(quantity: Quantity, **stated: float) -> JsonSchemaValue:
    """Return the JSON schema of a number, or of a string with its unit where the quantity has one.

    Args:
        quantity: What it measures.
        stated: Bounds of its own, by their name in a schema.
    """
    bounds = magnitude_schema(quantity, positive=stated.get("exclusiveMinimum") == 0)
    number = {"type": "number", **bounds, **stated}
    if quantity.dimension == "ratio":
        return number
    return {"anyOf": [number, {"type": "string", "pattern": r"^\s*[-+.0-9]"}]}


def _least(quantity: Quantity) -> float:
    """Return the smallest number above zero, SI, that a number of a quantity may be."""
    is_distance = quantity.dimension in ("angle", "length") and quantity.order == 0
    return SMALLEST_DISTANCE if is_distance else SMALLEST


def within_bounds(number: float, value: object, quantity: Quantity, units: Units) -> float:
    """Return a number in SI, unless no robot has such: powers of numbers, and sums of them, stay finite.

    Args:
        number: SI.
        value: The number as the user wrote it.
        quantity: What it measures.
        units: For the bound in the message.

    Raises:
        FlawError: When it is too large.
    """
    largest = _largest(quantity)
    if abs(number) <= largest:
        return number
    bound = f"{largest / factor(quantity, units):.6g} {unit_name(quantity, units)}".rstrip()
    raise FlawError(f"expected a magnitude of at most {bound}, got {shown(value)}", hint=_BEYOND_ANY_ROBOT)


def check_not_tiny(number: float, value: object, quantity: Quantity, units: Units) -> None:
    """Refuse a number above zero, such as a duration or a limit, that is smaller than any robot needs.

    Raises:
        FlawError: When it is too small.
    """
    least = _least(quantity)
    if 0 < number < least:
        bound = f"{least / factor(quantity, units):.6g} {unit_name(quantity, units)}".rstrip()
        raise FlawError(f"expected at least {bound}, got {shown(value)}", hint=_BEYOND_ANY_ROBOT)


def written_number(value: float, quantity: Quantity) -> float | str:
    """Return an SI number as it may stand in a file of any units, to be read bit by bit."""
    if quantity.dimension not in ("angle", "length"):
        return value
    return f"{value!r} {unit_name(quantity, Units())}"


def _no_truth(value: Any) -> Any:  # noqa: ANN401
    if isinstance(value, bool):
        raise refuse([((), f"expected a number, got {shown(value)}", None)])
    return value


NO_TRUTH = BeforeValidator(_no_truth)
"""Refuses true, which equals 1 in Python."""


class FieldType:
    """Base of the annotations: pydantic calls `read`, the JSON schema is `json_schema`."""

    description: str

    def read(self, value: Any, context: ReadingContext) -> Any:  # noqa: ANN401
        """Return the value in SI.

        Raises:
            FlawError: When it does not fit.
        """
        raise TypeError(type(self).__name__)

    def write(self, value: Any, context: ReadingContext) -> Any:  # noqa: ANN401
        """Return what `read` reads as this very value, bit by bit, whatever the file's units."""
        return value

    def json_schema(self) -> JsonSchemaValue:
        """Return the JSON schema of what may stand in a file."""
        raise TypeError(type(self).__name__)

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:  # noqa: ANN401
        def validate(value: Any, info: core_schema.ValidationInfo) -> Any:  # noqa: ANN401
            try:
                return self.read(value, info.context or SI)
            except FlawError as error:
                raise refuse(error.flaws) from None

        def serialize(value: Any, info: core_schema.SerializationInfo) -> Any:  # noqa: ANN401
            context = info.context
            return value if value is None or context is None else self.write(value, context)

        serialization = core_schema.plain_serializer_function_ser_schema(serialize, info_arg=True)
        return core_schema.with_info_plain_validator_function(validate, serialization=serialization)

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return {**self.json_schema(), "description": self.description}


class Instance:
    """Lets a field hold only instances of its type, which no file writes: pydantic asks for no more."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:  # noqa: ANN401
        return core_schema.is_instance_schema(source)


@comparable
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
        if self.above == 0:
            check_not_tiny(number, value, self.quantity, context.units)
        return number

    def write(self, value: float, context: ReadingContext) -> float | str:
        """Return the number with its SI unit."""
        return written_number(value, self.quantity)

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of a number or a string with its unit."""
        bounds = {"exclusiveMinimum": self.above, "minimum": self.at_least, "maximum": self.at_most}
        stated = {key: bound for key, bound in bounds.items() if bound is not None}
        return number_schema(self.quantity, **stated)


@comparable
class Name(FieldType):
    """A name that messages, files and logs of continuous integration can hold: one line, not too long.

    Attributes:
        description: For the JSON schema.
    """

    description: str

    def read(self, value: Any, context: ReadingContext) -> str:  # noqa: ANN401
        """Return the name."""
        if not isinstance(value, str):
            raise FlawError(f"expected a text, got {shown(value)}")
        flaw = flaw_of_name(value)
        if flaw is not None:
            raise FlawError(flaw)
        return value

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of a text of one line."""
        return {"type": "string", "minLength": 1, "maxLength": LONGEST_NAME}


NO_NAMES = ("here", "world", "base", "tool", "stop")
"""Words that stand where the name of a point or a frame may stand, and mean something else."""

_DECIMAL = "[-+]?([.][0-9]+|[0-9]+([.][0-9]*)?)([eE][-+]?[0-9]+)?"


class PointName(Name):
    """A name of a point, a frame or a tool, which no other word can be taken for."""

    def read(self, value: Any, context: ReadingContext) -> str:  # noqa: ANN401
        """Return the name."""
        name = super().read(value, context)
        if name in NO_NAMES or re.fullmatch(_DECIMAL, name):
            words = f"{', '.join(NO_NAMES)} and numbers have a meaning of their own"
            raise FlawError(
                f"'{name}' is no name of a point, a frame or a tool", hint=f"choose another: {words}"
            )
        return name

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of such a name."""
        others = [{"enum": list(NO_NAMES)}, {"pattern": f"^{_DECIMAL}$"}]
        return {**super().json_schema(), "not": {"anyOf": others}}


class Model(BaseModel):
    """Base of everything that a job file may hold: frozen, and strict about unknown keys."""

    # Most models stand only in others, and never need the reader that would be made with each class.
    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)

    @model_validator(mode="before")
    @classmethod
    def _nothing_left_empty(cls, data: Any, info: ValidationInfo) -> Any:  # noqa: ANN401
        # `duration:` with nothing behind it is a slip of the pen: only what a file leaves out is left out
        if info.context is None or not isinstance(data, dict) or None not in data.values():
            return data
        fields = cls.model_fields.items()
        optional = {field.alias or name for name, field in fields if field.default is None}
        return {key: NULL if value is None and key in optional else value for key, value in data.items()}
