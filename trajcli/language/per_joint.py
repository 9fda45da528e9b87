"""Values by joint: one for all joints, a list, or a mapping by joint name."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any, Self, TypeVar

from pydantic.json_schema import JsonSchemaValue

from trajcli.frozen import comparable
from trajcli.language.numbers import (
    AT_KEY,
    MAX_JOINTS,
    SI,
    FieldPath,
    FieldType,
    Flaw,
    FlawError,
    Number,
    ReadingContext,
    shown,
    written_number,
)
from trajcli.units import Quantity

LowerUpper = tuple[float, float]
K = TypeVar("K", str, int)
V = TypeVar("V")
UNLIMITED: LowerUpper = (-math.inf, math.inf)


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
    items: dict[int, tuple[str | int | None, Any]]
    if isinstance(value, Mapping):
        items = _named_items(value, names)
    elif isinstance(value, list | tuple):
        items = {i: (i, item) for i, item in enumerate(value)}
        if names is not None and len(value) != len(names):
            hint = _listed(names) + "; decimals have a point" * (len(value) > len(names))
            raise FlawError(f"expected {len(names)} values, one for each joint, got {len(value)}", hint=hint)
    elif names is None and context is SI:
        raise FlawError(f"expected a list with one value for each joint, got {shown(value)}")
    else:
        items = dict.fromkeys(range(len(names or ("",))), (None, value))
    if names is None and context is not SI:  # of a robot with flaws: which joints slide is not known
        for i, (key, item) in items.items():
            if isinstance(item, str | list) and str(item).lstrip("-+.['")[:1].isdigit():
                items[i] = key, 1
        return _read_items(items, names, read_one, missing)[:1]
    return _read_items(items, names, read_one, missing)


def _listed(names: Sequence[str]) -> str:
    return f"the joints are {', '.join(names)}"


def _named_items(
    value: Mapping[str, Any], names: tuple[str, ...] | None
) -> dict[int, tuple[str | int | None, Any]]:
    if names is None:
        return {i: (name, item) for i, (name, item) in enumerate(value.items())}
    unknown: list[Flaw] = [
        ((n, AT_KEY), f"the robot has no joint '{n}'", _listed(names)) for n in value if n not in names
    ]
    if unknown:
        raise flawed(unknown)
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
            prefix: FieldPath = () if key is None else (key,)
            flaws += error.below(*prefix)
            if key is None:
                break
    if flaws:
        raise flawed(flaws)
    return tuple(values)


def flawed(flaws: list[Flaw]) -> FlawError:
    """Return the error that holds several flaws of one value."""
    error = FlawError("; ".join(flaw[1] for flaw in flaws))
    error.flaws = flaws
    return error


def read_each(items: Iterable[tuple[K, Any]], read: Callable[[K, Any], V]) -> dict[K, V]:
    """Return what each item is read as, by its key.

    Raises:
        FlawError: With the flaws of all, each below the key of its item.
    """
    values, flaws = dict[K, V](), list[Flaw]()
    for key, item in items:
        try:
            values[key] = read(key, item)
        except FlawError as error:
            flaws += error.below(key)
    if flaws:
        raise flawed(flaws)
    return values


def with_pair_hint(error: FlawError, value: Any) -> FlawError:  # noqa: ANN401
    """Return the error of bounds by joint; where a pair stands in the place of a list, it says what to do."""
    if isinstance(value, list | tuple) and [type(v) in (int, float) for v in value] == [True, True]:
        named = f"a list has one entry for each joint: for a pair write {{NAME: {list(value)}}}"
        error.flaws = [(path, text, named) for path, text, _ in error.flaws]
    return error


class NamedValues(tuple[float, ...]):
    """Values by joint of which a mapping names only some: the others are zero, or free.

    Attributes:
        named: Whether each joint is named, in the order of the values.
    """

    named: tuple[bool, ...]

    def __new__(cls, values: Iterable[float], named: Iterable[bool]) -> Self:
        """Return the values (n,) with which of them are named (n,)."""
        row = super().__new__(cls, values)
        row.named = tuple(named)
        return row

    @property
    def by_index(self) -> dict[int, float]:
        """The values that are named, by the index of the joint."""
        return {k: value for k, (value, named) in enumerate(zip(self, self.named, strict=True)) if named}

    def __getnewargs__(self) -> tuple[tuple[float, ...], tuple[bool, ...]]:
        return tuple(self), self.named


@comparable
class PerJoint(FieldType):
    """A joint value or one of its time derivatives, for each joint.

    Attributes:
        order: 0 for a position, 1 to 3 for its derivatives.
        description: For the JSON schema.
        zero_missing: Whether joints that a mapping leaves out are zero.
        above: Each value must be above this, SI.
        some: Whether a mapping may leave joints out, and whoever has the values says what that means.
    """

    order: int
    description: str
    zero_missing: bool = False
    above: float | None = None
    some: bool = False

    def read(self, value: Any, context: ReadingContext) -> tuple[float, ...]:  # noqa: ANN401
        """Return one number for each joint, in SI; `NamedValues` where a mapping leaves some out."""

        def read_one(item: Any, joint: int) -> float:  # noqa: ANN401
            number = Number(context.joint_quantity(joint, self.order), self.description, above=self.above)
            return number.read(item, context)

        if isinstance(value, NamedValues):
            return value
        left_out = self.zero_missing or (self.some and isinstance(value, Mapping) and bool(value))
        values = read_per_joint(value, context, read_one, 0.0 if left_out else ...)
        names = context.joint_names
        if isinstance(value, Mapping) and names is not None and len(value) < len(names):
            return NamedValues(values, (name in value for name in names))
        if isinstance(value, Mapping) and self.some and names is None and context is not SI:
            return NamedValues(values, (True for _ in values))  # how many there are is not known
        return values

    def write(
        self, value: tuple[float, ...], context: ReadingContext
    ) -> list[float | str] | dict[str, float | str]:
        """Return a list with the SI unit of each joint, or a mapping of those that are named."""
        rows = [written_number(v, context.joint_quantity(i, self.order)) for i, v in enumerate(value)]
        if isinstance(value, NamedValues) and context.joint_names is not None:
            table = zip(context.joint_names, rows, value.named, strict=True)
            return {name: row for name, row, named in table if named}
        return rows

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of one value for all joints, a list, or a mapping by joint name."""
        # a length has the wider bounds: which joints slide is not known to a schema
        one = Number(Quantity("length", self.order), self.description, above=self.above).json_schema()
        return per_joint_schema(one)


def per_joint_schema(one: JsonSchemaValue) -> JsonSchemaValue:
    """Return the schema of `one` for all joints, a list, or a mapping by joint name."""
    listed = {"type": "array", "items": one, "minItems": 1, "maxItems": MAX_JOINTS}
    return {"anyOf": [one, listed, {"type": "object", "additionalProperties": one}]}


@comparable
class JointDistance(FieldType):
    """A distance for each joint, an angle or a length as the joint is; one number stands for all."""

    description: str

    def read(self, value: Any, context: ReadingContext) -> tuple[float, ...]:  # noqa: ANN401
        """Return one distance for each joint, rad or m."""

        def read_one(item: Any, joint: int) -> float:  # noqa: ANN401
            return Number(context.joint_quantity(joint, 0), "", at_least=0.0).read(item, context)

        return read_per_joint(value, context, read_one)

    def write(self, value: tuple[float, ...], context: ReadingContext) -> list[float | str]:
        """Return a list with the SI unit of each joint."""
        return [written_number(v, context.joint_quantity(i, 0)) for i, v in enumerate(value)]

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of one number for all joints, a list, or a mapping by joint name."""
        return per_joint_schema(Number(Quantity("length"), "", at_least=0.0).json_schema())
