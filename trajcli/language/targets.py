"""Targets of moves: joint states, and poses of which what is left out is free."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import (
    Field,
    SerializationInfo,
    SerializerFunctionWrapHandler,
    ValidationInfo,
    model_serializer,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue, SkipJsonSchema

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, PlanningError, Problem
from trajcli.frozen import comparable
from trajcli.language.numbers import (
    SI,
    FieldType,
    FlawError,
    Instance,
    Model,
    Number,
    ReadingContext,
    refuse,
    written_number,
)
from trajcli.language.per_joint import NamedValues, PerJoint
from trajcli.language.poses import (
    AXIS_SCHEMA,
    MATRIX_SCHEMA,
    ROTATIONS,
    Configuration,
    EulerSequence,
    Pose,
    moved,
    numbers_schema,
    read_direction,
    read_numbers,
    read_rows,
)
from trajcli.trajectory import State
from trajcli.units import Quantity

if TYPE_CHECKING:
    from trajcli.kinematics.inverse.target import IkTarget

_ANGLE, _LENGTH, _RATIO = Quantity("angle"), Quantity("length"), Quantity("ratio")
_FAR = 1e9  # m: float64 tells there no micrometres any more
_UPRIGHT = 1e-9  # rad: a pitch this close to a quarter turn is one
AIMS = ("yaw", "pitch", "direction")

AxisName = Literal["x", "y", "z"]
Row = tuple[float, ...]


@comparable
class Numbers(FieldType):
    """A given count of numbers of one quantity.

    Attributes:
        count: How many.
        quantity: What each measures.
        description: For the JSON schema.
    """

    count: int
    quantity: Quantity
    description: str

    def read(self, value: Any, context: ReadingContext) -> Row:  # noqa: ANN401
        """Return the numbers in SI."""
        return tuple(read_numbers(value, self.count, self.quantity, context).tolist())

    def write(self, value: Row, context: ReadingContext) -> list[float | str]:
        """Return the numbers with their unit."""
        return [written_number(number, self.quantity) for number in value]

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of the list."""
        return numbers_schema(self.count, self.quantity)


@comparable
class Direction(FieldType):
    """The name of an axis, or three numbers."""

    description: str

    def read(self, value: Any, context: ReadingContext) -> Row:  # noqa: ANN401
        """Return the three numbers."""
        return tuple(read_direction(value, context).tolist())

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of a name or three numbers."""
        return AXIS_SCHEMA


@comparable
class Matrix(FieldType):
    """A rotation matrix, or a homogeneous one whose last column is a position."""

    description: str

    def read(self, value: Any, context: ReadingContext) -> tuple[Row, ...]:  # noqa: ANN401
        """Return its rows, the position in m."""
        return read_rows(value, context)

    def write(self, value: tuple[Row, ...], context: ReadingContext) -> list[list[float | str]]:
        """Return its rows, the position with its unit."""
        return [
            [*row[:3], *(written_number(number, _RATIO if index == 3 else _LENGTH) for number in row[3:])]
            for index, row in enumerate(value)
        ]

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of three or four rows."""
        return MATRIX_SCHEMA


class AxisAngleSpec(Model):
    """A rotation by an angle about an axis."""

    axis: Annotated[Row, Direction("x, y, z, or three numbers; only the direction counts.")]
    angle: Annotated[float, Number(_ANGLE, "Angle, right-handed about the axis (angle unit).")]


class EulerSpec(Model):
    """Euler angles."""

    sequence: Annotated[EulerSequence, Field(description="The axes, in the order of the angles.")]
    frame: Annotated[Literal["current", "fixed"], Field(description="Whose axes they are.")] = "current"
    angles: Annotated[Row, Numbers(3, _ANGLE, "The three angles (angle unit).")]


def _refuse_two(given: Sequence[str]) -> None:
    """Refuse two keys of which only one may be given."""
    if len(given) > 1:
        text = f"{given[0]} and {given[1]} exclude each other"
        raise refuse([((given[1],), text, "leave one of them out")])


class PoseFields(Model):
    """A pose of the tcp in world: a position, an orientation or a part of one, or both."""

    xyz: Annotated[Row, Numbers(3, _LENGTH, "Position of the tcp in world (length unit).")] | None = None
    rpy: (
        Annotated[Row, Numbers(3, _ANGLE, "Angles about fixed x, y, z: R = Rz Ry Rx (angle unit).")] | None
    ) = None
    quat_wxyz: Annotated[Row, Numbers(4, _RATIO, "Unit quaternion, w first.")] | None = None
    quat_xyzw: Annotated[Row, Numbers(4, _RATIO, "Unit quaternion, w last (ROS, scipy).")] | None = None
    rotvec: (
        Annotated[Row, Numbers(3, _ANGLE, "Axis times angle, as rx, ry, rz of a UR pendant (angle unit).")]
        | None
    ) = None
    matrix: (
        Annotated[tuple[Row, ...], Matrix("Rotation 3x3, or homogeneous 4x4 with the position.")] | None
    ) = None
    axis_angle: AxisAngleSpec | None = None
    euler: EulerSpec | None = None
    yaw: Annotated[float, Number(_ANGLE, "Heading of the tool axis in world (angle unit).")] | None = None
    pitch: (
        Annotated[float, Number(_ANGLE, "Elevation of the tool axis over the x-y plane (angle unit).")] | None
    ) = None
    direction: Annotated[Row, Direction("Where the tool axis points, in world.")] | None = None
    tool_axis: Annotated[
        AxisName | None,
        Field(description="The axis of the tcp that yaw, pitch and direction mean; z if left out."),
    ] = None
    configuration: Configuration | None = None

    @model_validator(mode="after")
    def _is_one_pose(self) -> PoseFields:
        given = [key for key in (*ROTATIONS, *AIMS) if getattr(self, key) is not None]
        _refuse_two(given)
        if given and given[0] in ROTATIONS:
            try:
                self.full_pose()
            except FlawError as error:
                raise refuse(error.flaws) from None
        somewhere = self.gives_pose or getattr(self, "relative", None) is not None
        if not somewhere and (self.configuration is not None or self.tool_axis is not None):
            key = "configuration" if self.configuration is not None else "tool_axis"
            raise refuse([((key,), f"{key} says something about a pose, and there is none", "leave it out")])
        return self

    @property
    def pose_keys(self) -> tuple[str, ...]:
        """The keys of a pose that are given."""
        return tuple(key for key in ("xyz", *ROTATIONS, *AIMS) if getattr(self, key) is not None)

    @property
    def gives_pose(self) -> bool:
        """Whether any part of a pose is given."""
        return bool(self.pose_keys)

    @property
    def rotation_form(self) -> str | None:
        """The key that gives a full orientation, if one does."""
        return next((key for key in ROTATIONS if getattr(self, key) is not None), None)

    @property
    def gives_position(self) -> bool:
        """Whether the position is fixed."""
        return self.xyz is not None or (self.matrix is not None and len(self.matrix) == 4)

    def full_pose(self) -> Array:
        """Return the pose (4, 4), lengths in m; what is not given is zero."""
        written: dict[str, Any] = {} if self.xyz is None else {"xyz": self.xyz}
        form = self.rotation_form
        if form is not None:
            value = getattr(self, form)
            written[form] = value.model_dump(context=SI) if isinstance(value, Model) else value
        return Pose("").read(written, SI)


Duration = Annotated[float, Number(Quantity("time"), "Duration of the move, s.", above=0.0)]
MinimumDuration = Annotated[
    float, Number(Quantity("time"), "The move lasts at least this long, s.", above=0.0)
]
JointPositions = Annotated[
    tuple[float, ...],
    PerJoint(
        0,
        "Position of each joint (angle or length unit): one for all, a list, or by joint name. Beside a "
        "pose, some by name: these are pinned, and the others are solved.",
        some=True,
    ),
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


@comparable
class Relative:
    """A displacement from a pose that only the plan knows.

    Attributes:
        origin: Name of a point that is given by its joints, or "here": where the arm stands then.
        offset: How far from it, the rows of (4, 4), m.
        in_world: Whether it is along and about the axes of world, not those of the tool.
    """

    origin: str
    offset: tuple[Row, ...]
    in_world: bool

    def after(self, pose: Array) -> Array:
        """Return a pose (4, 4) after the displacement."""
        offset = np.array(self.offset)
        if not self.in_world:
            return np.asarray(pose @ offset)
        return moved(pose, offset, np.eye(3))


RELATIVE, NEAR, PINNED = "\0relative", "\0near", "\0pinned"
"""Keys of what a target holds beside what a file gives: none can write them."""


_Displacement = Annotated[Relative, Instance()]
_NamedValues = Annotated[NamedValues, Instance()]


class Target(PoseFields, defer_build=False):  # made once, not for each planner that has it
    """The state that a point names, or that a move starts from or ends in: by its joints, or by a pose."""

    joints: JointPositions | None = None
    velocity: JointVelocities | None = None
    acceleration: JointAccelerations | None = None
    joints_by: (
        Annotated[
            tuple[float, ...],
            PerJoint(
                0,
                "How far each joint goes from where the arm stands; those left out of a mapping stay.",
                zero_missing=True,
            ),
        ]
        | None
    ) = None
    frame: Annotated[
        str | None,
        Field(alias="in", description="The frame in which the pose is given; left out: world."),
    ] = None
    relative: SkipJsonSchema[_Displacement | None] = Field(None, alias=RELATIVE, exclude=True)
    near: SkipJsonSchema[tuple[float, ...] | None] = Field(None, alias=NEAR, exclude=True)
    pinned: SkipJsonSchema[_NamedValues | None] = Field(None, alias=PINNED, exclude=True)

    @model_validator(mode="after")
    def _joints_are_pinned_or_all(self, info: ValidationInfo) -> Target:
        if not isinstance(self.joints, NamedValues):
            return self
        if not self.gives_pose and self.relative is None:
            names = info.context.joint_names if info.context is not None else ()
            if names is None:
                return self
            lacking = [name for name, named in zip(names, self.joints.named, strict=True) if not named]
            text, hint = f"no value for {', '.join(lacking)}", "name every joint, or give a list"
            raise refuse([(("joints",), text, hint)])
        self.__dict__["pinned"], self.__dict__["joints"] = self.joints, None
        return self

    @model_validator(mode="after")
    def _says_something(self) -> Target:
        if self.frame is not None:
            raise refuse([(("in",), "only a job has frames", "give the pose in world")])
        given = [key for key in ("joints", "joints_by") if getattr(self, key) is not None]
        given += [*self.pose_keys[:1], *(["from"] if self.relative is not None else [])]
        _refuse_two(given)
        if isinstance(self.joints_by, NamedValues) and not any(self.joints_by.named):
            raise refuse([(("joints_by",), "no joint is named", "name one, or leave it out")])
        if not given and self.velocity is None:
            text = "a state needs `joints` or a pose (or `velocity` alone, for a stop)"
            raise refuse([((), text, None)])
        return self

    @model_serializer(mode="wrap")
    def _written(self, serialize: SerializerFunctionWrapHandler, info: SerializationInfo) -> dict[str, Any]:
        written: dict[str, Any] = serialize(self)
        if self.pinned is not None and info.context is not None:
            written["joints"] = PerJoint(0, "").write(self.pinned, info.context)
        if self.relative is None or info.context is None:
            return written
        offset = Pose("").write(np.array(self.relative.offset), info.context)
        frame = "world" if self.relative.in_world else "tool"
        return {"from": self.relative.origin, "offset": offset, "frame": frame, **written}

    @property
    def waits(self) -> bool:
        """Whether only the plan knows where it is: relative to where the arm stands, or to joints."""
        return self.relative is not None or self.joints_by is not None

    @property
    def gives_joints_or_pose(self) -> bool:
        """Whether it says where to be, and not only how fast."""
        return self.joints is not None or self.gives_pose or self.waits

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


class AskedPose(PoseFields):
    """A pose that joint values are asked for, and joints that are pinned beside it."""

    joints: JointPositions | None = None

    @model_validator(mode="after")
    def _joints_are_pinned(self) -> AskedPose:
        if self.joints is not None and not isinstance(self.joints, NamedValues):
            text = "beside a pose `joints` pins some joints by name, and leaves others to be solved"
            raise refuse([(("joints",), text, "such as {joint: value}")])
        return self

    @property
    def pins(self) -> dict[int, float]:
        """Values of the joints that are pinned, by index, rad or m."""
        return self.joints.by_index if isinstance(self.joints, NamedValues) else {}


def ik_target(fields: PoseFields) -> IkTarget:
    """Return the coordinates of the tcp's pose that a target fixes.

    Raises:
        PlanningError: When the position is further than any robot reaches.
    """
    from trajcli.kinematics.inverse.target import partial_target

    pose = fields.full_pose()
    furthest = float(np.abs(pose[:3, 3]).max())
    if fields.gives_position and not furthest <= _FAR:
        far = Amount(furthest, 0, None, "length")
        message = "a position has a coordinate of {far}: no robot reaches so far"
        raise PlanningError(Problem(message, "check the numbers and their units", amounts={"far": far}))
    position = pose[:3, 3] if fields.gives_position else None
    if fields.rotation_form is not None:
        return partial_target(position, rotation=pose[:3, :3])
    if fields.pitch is not None and math.pi / 2 - abs(fields.pitch) <= _UPRIGHT:
        upright = (0.0, 0.0, math.copysign(1.0, fields.pitch))  # there the elevation has no slope to follow
        return partial_target(position, direction=upright, tool_axis=fields.tool_axis or "z")
    return partial_target(
        position,
        direction=fields.direction,
        yaw=fields.yaw,
        pitch=fields.pitch,
        tool_axis=fields.tool_axis or "z",
    )
