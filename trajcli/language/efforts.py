"""Limits of torque and force in files: N m and N whatever the units of the file."""

from __future__ import annotations

from typing import Any, Literal

from pydantic.json_schema import JsonSchemaValue

from trajcli.frozen import comparable
from trajcli.language.numbers import (
    FieldType,
    FlawError,
    ReadingContext,
    number_schema,
    read_number,
    shown,
)
from trajcli.language.per_joint import (
    UNLIMITED,
    LowerUpper,
    per_joint_schema,
    read_per_joint,
    with_pair_hint,
)
from trajcli.units import Quantity, Units, effort_quantity

EffortBounds = tuple[LowerUpper | None, ...] | Literal["robot"]
OF_ROBOT: Literal["robot"] = "robot"
"""Stands under `limits.effort` for the efforts that the robot has."""


def read_effort(value: Any, joint_type: str | None) -> LowerUpper:  # noqa: ANN401
    """Return (lower, upper), N m or N, from a magnitude, a pair by direction, or null.

    Args:
        value: As it stands in the file.
        joint_type: "revolute" or "prismatic".

    Raises:
        FlawError: When it is none of these.
    """
    quantity = effort_quantity(joint_type or "revolute")
    if value is None:
        return UNLIMITED
    if isinstance(value, list | tuple) and len(value) == 2:
        low, high = (read_number(item, quantity, Units()) for item in value)
        if low < 0 < high:
            return low, high
    elif not isinstance(value, list | tuple):
        size = read_number(value, quantity, Units())
        if size > 0:
            return -size, size
    got = f"[{', '.join(map(shown, value))}]" if isinstance(value, list | tuple) else shown(value)
    raise FlawError(
        "expected a number above 0 (N m or N), a pair [lower, upper], a negative and a positive number, "
        f"or null (unlimited), got {got}"
    )


def _effort_schema() -> JsonSchemaValue:
    quantity = Quantity("torque")
    pair = {"type": "array", "items": number_schema(quantity), "minItems": 2, "maxItems": 2}
    return {"anyOf": [number_schema(quantity, exclusiveMinimum=0.0), pair, {"type": "null"}]}


@comparable
class EffortBound(FieldType):
    """The bound of a joint's torque or force, SI: a magnitude, a pair by direction, or null."""

    description: str

    def read(self, value: Any, context: ReadingContext) -> LowerUpper:  # noqa: ANN401
        """Return (lower, upper), N m or N."""
        return read_effort(value, context.joint_types[0] if context.joint_types else None)

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of a magnitude, a pair or null."""
        return _effort_schema()


@comparable
class Efforts(FieldType):
    """Bounds of efforts: one for all joints, a list, a mapping by joint name, or `robot`: the robot's own."""

    description: str

    def read(self, value: Any, context: ReadingContext) -> EffortBounds:  # noqa: ANN401
        """Return (lower, upper), N m or N, for each joint; None where it is left out; or "robot"."""
        if value == OF_ROBOT:
            return OF_ROBOT
        if isinstance(value, str) and value[:1].isalpha():
            text = f"expected bounds by joint (N m or N), or robot, got {shown(value)}"
            raise FlawError(text, hint="`effort: robot`: the robot's own efforts")

        def read_one(item: Any, joint: int) -> LowerUpper:  # noqa: ANN401
            types = context.joint_types
            return read_effort(item, types[joint] if joint < len(types) else None)

        try:
            bounds = read_per_joint(value, context, read_one, None)
        except FlawError as error:
            raise with_pair_hint(error, value) from None
        return bounds if any(bound is not None for bound in bounds) else ()

    def write(self, value: EffortBounds, context: ReadingContext) -> dict[str, Any] | str:
        """Return the bounds by joint name."""
        if isinstance(value, str):
            return value
        names = context.joint_names or ()
        return {
            name: None if bound == UNLIMITED else list(bound)
            for name, bound in zip(names, value, strict=False)
            if bound is not None
        }

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of a bound for all joints, a list, a mapping, or the word `robot`."""
        one = _effort_schema()
        single = [branch for branch in one["anyOf"] if branch.get("type") != "array"]
        return {"anyOf": [{"const": OF_ROBOT}, *single, *per_joint_schema(one)["anyOf"][1:]]}
