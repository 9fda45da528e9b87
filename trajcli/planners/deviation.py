"""A distance in joint space that no joint exceeds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pydantic.json_schema import JsonSchemaValue

from trajcli.planners.reading import FieldType, Number, ReadingContext
from trajcli.units import Quantity


@dataclass(frozen=True)
class Deviation(FieldType):
    """A distance that no joint exceeds: a length where all joints are prismatic, else an angle."""

    description: str

    def read(self, value: Any, context: ReadingContext) -> float:  # noqa: ANN401
        """Return rad or m."""
        return Number(_deviation(context), self.description, at_least=0.0).read(value, context)

    def write(self, value: float, context: ReadingContext) -> Any:  # noqa: ANN401
        """Return the number with its SI unit."""
        return Number(_deviation(context), "").write(value, context)

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of a number with or without a unit."""
        return Number(Quantity("angle"), "", at_least=0.0).json_schema()


def _deviation(context: ReadingContext) -> Quantity:
    sliding = bool(context.joint_types) and set(context.joint_types) == {"prismatic"}
    return Quantity("length" if sliding else "angle")
