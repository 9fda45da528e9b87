"""A distance in joint space: how far each joint may be from a point."""

from __future__ import annotations

from typing import Any

from pydantic.json_schema import JsonSchemaValue

from trajcli.frozen import comparable
from trajcli.planners.per_joint import per_joint_schema, read_per_joint
from trajcli.planners.reading import FieldType, Number, ReadingContext, written_number
from trajcli.units import Quantity


@comparable
class Deviation(FieldType):
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
        return per_joint_schema(Number(Quantity("angle"), "", at_least=0.0).json_schema())
