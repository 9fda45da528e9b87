"""A robot as it stands in a file, and the robot it describes."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, ValidationInfo, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from trajcli.job.model import UnitsSpec
from trajcli.kinematics.robot import Joint, Limits, Robot
from trajcli.planners.bounds import UNLIMITED, Bound, JointBound
from trajcli.planners.fields import Model
from trajcli.planners.poses import Pose
from trajcli.planners.reading import MAX_JOINTS, Number, ReadingContext, refuse, shown
from trajcli.units import Quantity

_DH = ("theta", "d", "a", "alpha")
_ANGLE, _LENGTH = Quantity("angle"), Quantity("length")


class JointModel(Model):
    """One joint: its DH row and its limits."""

    name: Annotated[
        str | None, Field(min_length=1, description="Unique name; j1, j2, ... when left out.")
    ] = None
    type: Annotated[Literal["revolute", "prismatic"], Field(description="How the joint moves.")] = "revolute"
    theta: Annotated[float, Number(_ANGLE, "Angle about z (angle unit).")] = 0.0
    d: Annotated[float, Number(_LENGTH, "Offset along z (length unit).")] = 0.0
    a: Annotated[float, Number(_LENGTH, "Length along x (length unit).")] = 0.0
    alpha: Annotated[float, Number(_ANGLE, "Angle about x (angle unit).")] = 0.0
    sign: Annotated[Literal[1, -1], Field(description="Direction in which the joint counts.")] = 1
    position: Annotated[Bound, JointBound(0, "Range [lower, upper] (angle or length unit).")] = UNLIMITED
    velocity: Annotated[Bound, JointBound(1, "Velocity limit, or [lower, upper], per s.")] = UNLIMITED
    acceleration: Annotated[Bound, JointBound(2, "Acceleration limit, or [lower, upper], per s^2.")] = (
        UNLIMITED
    )
    jerk: Annotated[Bound, JointBound(3, "Jerk limit, or [lower, upper], per s^3.")] = UNLIMITED

    @model_validator(mode="before")
    @classmethod
    def _announce_type(cls, data: Any, info: ValidationInfo) -> Any:  # noqa: ANN401
        # the units of the limits depend on the type, which stands beside them
        if isinstance(info.context, ReadingContext) and isinstance(data, dict):
            info.context.joint_types = (str(data.get("type", "revolute")),)
        return data


class _Counted:
    """Lets a number stand for that many bare joints."""

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:  # noqa: ANN401
        return core_schema.no_info_before_validator_function(self._expand, handler(source))

    @staticmethod
    def _expand(value: Any) -> Any:  # noqa: ANN401
        if isinstance(value, list):
            return value
        if isinstance(value, bool) or not isinstance(value, int):
            raise refuse([((), f"expected a list of joints or their number, got {shown(value)}", None)])
        if not 1 <= value <= MAX_JOINTS:
            raise refuse([((), f"expected 1 to {MAX_JOINTS} joints, got {value}", None)])
        return [{} for _ in range(value)]

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        return {"anyOf": [{"type": "integer", "minimum": 1, "maximum": MAX_JOINTS}, handler(schema)]}


class RobotModel(Model):
    """A robot: its joints as a Denavit-Hartenberg table with limits, base and tool."""

    name: Annotated[str, Field(description="For messages and reports.")] = "robot"
    units: Annotated[
        UnitsSpec | None, Field(description="Only in a robot file; inline the job's units hold.")
    ] = None
    source: Annotated[str | None, Field(description="Where the numbers come from.")] = None
    licence: Annotated[str | None, Field(description="Licence of the source.")] = None
    note: Annotated[str | None, Field(description="What a user should know about the numbers.")] = None
    convention: Annotated[
        Literal["standard", "modified"] | None,
        Field(description="Whose DH rows the joints are; modified: a and alpha belong to the link before."),
    ] = None
    joints: Annotated[
        list[JointModel],
        Field(
            min_length=1,
            max_length=MAX_JOINTS,
            description="From the base on; a number: that many bare joints.",
        ),
        _Counted(),
    ]
    base: Annotated[np.ndarray, Pose("T_world_base.")] | None = None
    tool: Annotated[np.ndarray, Pose("T_flange_tcp.")] | None = None

    @model_validator(mode="after")
    def _is_consistent(self) -> RobotModel:
        joints = self.joints
        names = [joint.name for joint in joints if joint.name is not None]
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise refuse([(("joints",), f"joint names must be unique, '{twice[0]}' stands twice", None)])
        described = [joint for joint in joints if any(key in joint.model_fields_set for key in _DH)]
        if described and self.convention is None:
            text = "joints with theta, d, a or alpha need a `convention`"
            raise refuse([((), text, "say `convention: standard` or `convention: modified`")])
        return self

    def as_robot(self) -> Robot:
        """Return the robot that this describes."""
        models = self.joints
        joints = tuple(_joint(index, model) for index, model in enumerate(models, 1))
        rows = {
            k: np.array([getattr(m, k) for m in models])
            for k in ("position", "velocity", "acceleration", "jerk")
        }
        base, tool = (np.eye(4) if pose is None else pose for pose in (self.base, self.tool))
        described = any(key in model.model_fields_set for model in models for key in _DH)
        return Robot(self.name, joints, Limits(**rows), self.convention if described else None, base, tool)


def _joint(index: int, model: JointModel) -> Joint:
    name = model.name or f"j{index}"
    return Joint(name, model.type, model.theta, model.d, model.a, model.alpha, model.sign)
