"""Fields that several planners share: times, values by joint, targets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import (
    BaseModel,
    ConfigDict,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ValidationError,
    ValidationInfo,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from trajcli.planners.per_joint import PerJoint
from trajcli.planners.reading import NULL, SI, Number, refuse, shown
from trajcli.suggest import did_you_mean, valid_names
from trajcli.trajectory import State
from trajcli.units import Quantity


class Model(BaseModel):
    """Base of everything that a job file may hold: frozen, and strict about unknown keys."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    @model_validator(mode="before")
    @classmethod
    def _nothing_left_empty(cls, data: Any, info: ValidationInfo) -> Any:  # noqa: ANN401
        # `duration:` with nothing behind it is a slip of the pen: only what a file leaves out is left out
        if info.context is None or not isinstance(data, dict) or None not in data.values():
            return data
        optional = {name for name, field in cls.model_fields.items() if field.default is None}
        return {key: NULL if value is None and key in optional else value for key, value in data.items()}


Duration = Annotated[float, Number(Quantity("time"), "Duration of the move, s.", above=0.0)]
MinimumDuration = Annotated[
    float, Number(Quantity("time"), "The move lasts at least this long, s.", above=0.0)
]
JointPositions = Annotated[
    tuple[float, ...],
    PerJoint(0, "Position of each joint (angle or length unit): one for all, a list, or by joint name."),
]
JointVelocities = Annotated[
    tuple[float, ...],
    PerJoint(1, "Velocity of each joint, per s; joints left out of a mapping are 0.", zero_missing=True),
]
JointAccelerations = Annotated[
    tuple[float, ...],
    PerJoint(
        2, "Acceleration of each joint, per s^2; joints left out of a mapping are 0.", zero_missing=True
    ),
]
JointSpeeds = Annotated[tuple[float, ...], PerJoint(1, "Speed of each joint, per s, above 0.", above=0.0)]
JointAccelerationMagnitudes = Annotated[
    tuple[float, ...],
    PerJoint(2, "Magnitude of the acceleration of each joint, per s^2, above 0.", above=0.0),
]


class Target(Model):
    """The state that a point names, or that a move starts from or ends in."""

    joints: JointPositions | None = None
    velocity: JointVelocities | None = None
    acceleration: JointAccelerations | None = None

    @model_validator(mode="after")
    def _says_something(self) -> Target:
        if self.joints is None and self.velocity is None:
            raise refuse([((), "a state needs `joints` (or `velocity` alone, for a stop)", None)])
        return self

    def as_state(self) -> State:
        """Return the state; what is not given is zero.

        Raises:
            ValueError: When the target has no joints.
        """
        if self.joints is None:
            raise ValueError("a target without joints is no state")
        zero = (0.0,) * len(self.joints)
        return State(
            np.array(self.joints), np.array(self.velocity or zero), np.array(self.acceleration or zero)
        )


class _Named:
    """Lets the name of a point stand for the point."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:  # noqa: ANN401
        return core_schema.with_info_wrap_validator_function(self._read, handler(source))

    @staticmethod
    def _read(
        value: Any,  # noqa: ANN401
        validate: core_schema.ValidatorFunctionWrapHandler,
        info: core_schema.ValidationInfo,
    ) -> Any:  # noqa: ANN401
        if not isinstance(value, str):
            if not isinstance(value, Mapping | Target):
                hint = "write {joints: ...}, or the name of a point"
                raise refuse([((), f"expected a state, got {shown(value)}", hint)])
            return validate(value)
        state = _look_up(value, (info.context or SI).points)
        try:
            return validate(state)
        except ValidationError:
            raise refuse([]) from None  # the flaw is the point's, and is reported where the point stands

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        name = {"type": "string", "description": "Name of a point under `points`."}
        return {"anyOf": [name, handler(schema)]}


def _look_up(name: str, points: Mapping[str, Any]) -> Any:  # noqa: ANN401
    """Return the state that a point's name stands for; the point may itself be the name of another."""
    state, seen = name, [name]
    while state in points:
        state = points[state]
        if not isinstance(state, str):
            return state
        if state in seen:
            raise refuse(
                [((), f"the point '{state}' is named by itself ({' -> '.join([*seen, state])})", None)]
            )
        seen.append(state)
    if len(seen) > 1:
        raise refuse([])  # reported where the point that names it stands
    raise refuse([((), f"there is no point '{name}'", _known(name, points))])


def _known(name: str, points: Mapping[str, Any]) -> str:
    return did_you_mean(name, points) or valid_names(points, "points") or "the job has no `points`"


NamedTarget = Annotated[Target, _Named()]
