"""Fields that several planners share: times, values by joint, targets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import (
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    ValidationError,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from trajcli.planners.per_joint import PerJoint
from trajcli.planners.pose_fields import PoseFields
from trajcli.planners.reading import SI, Number, refuse, shown
from trajcli.suggest import did_you_mean, valid_names
from trajcli.trajectory import State
from trajcli.units import Quantity

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


class Target(PoseFields, defer_build=False):  # made once, not for each planner that has it
    """The state that a point names, or that a move starts from or ends in: by its joints, or by a pose."""

    joints: JointPositions | None = None
    velocity: JointVelocities | None = None
    acceleration: JointAccelerations | None = None

    @model_validator(mode="after")
    def _says_something(self) -> Target:
        if self.joints is not None and self.gives_pose:
            key = self.pose_keys[0]
            raise refuse([((key,), f"joints and {key} exclude each other", "leave one of them out")])
        if self.joints is None and self.velocity is None and not self.gives_pose:
            text = "a state needs `joints` or a pose (or `velocity` alone, for a stop)"
            raise refuse([((), text, None)])
        return self

    @property
    def is_place(self) -> bool:
        """Whether it says where to be, and not only how fast."""
        return self.joints is not None or self.gives_pose

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


class Named:
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


NamedTarget = Annotated[Target, Named()]
