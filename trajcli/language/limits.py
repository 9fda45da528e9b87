"""Limits in job files: bounds by joint, of efforts too, and of the tool, and the factors that scale them."""

from __future__ import annotations

from collections.abc import Callable
from math import isfinite
from typing import Annotated, Any, Literal

from pydantic import Field
from pydantic.json_schema import JsonSchemaValue

from trajcli.frozen import comparable
from trajcli.kinematics.robot import QUANTITIES
from trajcli.language.numbers import (
    FieldType,
    FlawError,
    Model,
    Number,
    ReadingContext,
    check_not_tiny,
    flaws_below,
    number_schema,
    read_number,
    shown,
    written_number,
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


def read_bound(value: Any, quantity: Quantity, context: ReadingContext) -> LowerUpper:  # noqa: ANN401
    """Return (lower, upper) in SI from a magnitude, a pair by direction, or null for unlimited, ends too.

    Raises:
        FlawError: When it is none of these, or the pair is the wrong way round.
    """
    rate = quantity.order > 0
    if value is None:
        return UNLIMITED
    if isinstance(value, list | tuple):
        if len(value) != 2:
            raise FlawError(f"expected a pair [lower, upper], got {len(value)} values")
        low, high = (_read_end(item, index, quantity, context) for index, item in enumerate(value))
        if (rate and not low < 0 < high) or low >= high:
            wanted = "a negative and a positive number" if rate else "the lower number first"
            raise FlawError(
                f"expected a pair [lower, upper], {wanted}, got [{shown(value[0])}, {shown(value[1])}]"
            )
        if rate:
            for index, end in enumerate((low, high)):
                check_not_tiny(abs(end), value[index], quantity, context.units)
        return low, high
    size = read_number(value, quantity, context.units)
    if size <= 0:
        raise FlawError(
            f"expected a number above 0, a pair [lower, upper] or null (unlimited), got {shown(value)}"
        )
    check_not_tiny(size, value, quantity, context.units)
    return -size, size


def _read_end(value: Any, index: int, quantity: Quantity, context: ReadingContext) -> float:  # noqa: ANN401
    with flaws_below(index):
        return UNLIMITED[index] if value is None else read_number(value, quantity, context.units)


def written_bound(
    bound: LowerUpper, quantity: Quantity, say: Callable[[float, Quantity], float | str] = written_number
) -> list[float | str | None] | None:
    """Return (lower, upper) in SI as it may stand in a file of any units, to be read bit by bit."""
    return None if bound == UNLIMITED else [say(end, quantity) if isfinite(end) else None for end in bound]


def _bound_schema(order: int) -> JsonSchemaValue:
    # a length has the wider bounds: whether the joint slides is not known to a schema
    number = Number(Quantity("length", order), "", above=0.0).json_schema()
    signed = Number(Quantity("length", order), "").json_schema()
    end = {"anyOf": [signed, {"type": "null"}]}
    pair = {"type": "array", "items": end, "minItems": 2, "maxItems": 2}
    return {"anyOf": [number, pair, {"type": "null"}]}


@comparable
class JointBound(FieldType):
    """The bound of one joint, whose type is the first of the context."""

    order: int
    description: str

    def read(self, value: Any, context: ReadingContext) -> LowerUpper:  # noqa: ANN401
        """Return (lower, upper) in SI."""
        return read_bound(value, context.joint_quantity(0, self.order), context)

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of a magnitude, a pair or null."""
        return _bound_schema(self.order)


@comparable
class JointRate(FieldType):
    """A magnitude of a derivative of one joint's position, whose type is the first of the context."""

    order: int
    description: str
    positive: bool = True

    def read(self, value: Any, context: ReadingContext) -> float:  # noqa: ANN401
        """Return the number in SI."""
        quantity = context.joint_quantity(0, self.order)
        size = read_number(value, quantity, context.units)
        if size < 0 or (self.positive and size == 0):
            raise FlawError(f"expected a number {self.rule}, got {shown(value)}")
        check_not_tiny(size, value, quantity, context.units)
        return size

    @property
    def rule(self) -> str:
        """What the number must be, in words."""
        return "above 0" if self.positive else "at least 0"

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of a number or a string with its unit."""
        bound = {"above": 0.0} if self.positive else {"at_least": 0.0}
        return Number(Quantity("length", self.order), "", **bound).json_schema()


class VelocityByPosition(Model):
    """A limit of velocity that depends on the distance to the position limit ahead."""

    deceleration: Annotated[float, JointRate(2, "d (angle or length unit per s^2).")]
    offset: Annotated[
        float,
        JointRate(1, "o, taken off the velocity (angle or length unit per s).", positive=False),
    ] = 0.0


def _by_joint(
    value: Any,  # noqa: ANN401
    context: ReadingContext,
    read_one: Callable[[Any, int], LowerUpper],
) -> tuple[LowerUpper | None, ...]:
    """Return the bound of each joint, None where it is left out; none at all where all are."""
    try:
        bounds = read_per_joint(value, context, read_one, None)
    except FlawError as error:
        raise with_pair_hint(error, value) from None
    return bounds if any(bound is not None for bound in bounds) else ()


@comparable
class Bounds(FieldType):
    """One bound for all joints, a list, or a mapping by joint name; None where a joint is left out."""

    order: int
    description: str

    def read(self, value: Any, context: ReadingContext) -> tuple[LowerUpper | None, ...]:  # noqa: ANN401
        """Return (lower, upper) in SI for each joint."""

        def read_one(item: Any, joint: int) -> LowerUpper:  # noqa: ANN401
            return read_bound(item, context.joint_quantity(joint, self.order), context)

        return _by_joint(value, context, read_one)

    def write(self, value: tuple[LowerUpper | None, ...], context: ReadingContext) -> dict[str, Any]:
        """Return the bounds by joint name; without names, nothing can be written."""
        names = context.joint_names or ()
        return {
            name: written_bound(bound, context.joint_quantity(joint, self.order))
            for joint, (name, bound) in enumerate(zip(names, value, strict=False))
            if bound is not None
        }

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of a bound for all joints, a list of bounds, or a mapping."""
        one = _bound_schema(self.order)
        single = {"anyOf": [branch for branch in one["anyOf"] if branch.get("type") != "array"]}
        whole = per_joint_schema(one)
        return {"anyOf": [single, *whole["anyOf"][1:]]}


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

        return _by_joint(value, context, read_one)

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


Factor = Annotated[float, Number(Quantity("ratio"), "Factor above 0 and at most 1.", above=0.0, at_most=1.0)]


class Scale(Model):
    """Factors by which limits are multiplied after they were replaced."""

    velocity: Factor = 1.0
    acceleration: Factor = 1.0
    jerk: Factor = 1.0


ToolSpeed = Annotated[
    float, Number(Quantity("length", 1), "Speed of the tool (length unit per s).", above=0.0)
]
ToolAcceleration = Annotated[
    float,
    Number(Quantity("length", 2), "Magnitude of the tool's acceleration (length unit per s^2).", above=0.0),
]
ToolJerk = Annotated[
    float, Number(Quantity("length", 3), "Jerk of the tool along its path (length unit per s^3).", above=0.0)
]
AngularSpeed = Annotated[
    float, Number(Quantity("angle", 1), "Angular speed of the tool (angle unit per s).", above=0.0)
]
AngularAcceleration = Annotated[
    float,
    Number(
        Quantity("angle", 2), "Magnitude of the tool's angular acceleration (angle unit per s^2).", above=0.0
    ),
]

AngularJerk = Annotated[
    float,
    Number(Quantity("angle", 3), "Magnitude of the tool's angular jerk (angle unit per s^3).", above=0.0),
]


class ToolLimitsSpec(Model):
    """Limits of the tool, in all moves; what is left out is unlimited."""

    speed: ToolSpeed | None = None
    acceleration: ToolAcceleration | None = None
    jerk: ToolJerk | None = None
    angular_speed: AngularSpeed | None = None
    angular_acceleration: AngularAcceleration | None = None
    angular_jerk: AngularJerk | None = None


class LimitsSpec(Model, defer_build=False):  # made once, not for each planner that has it
    """Limits that replace or tighten others; what is left out stays as it is, null is unlimited."""

    position: Annotated[
        tuple[LowerUpper | None, ...], Bounds(0, "Range of each joint (angle or length unit).")
    ] = ()
    velocity: Annotated[tuple[LowerUpper | None, ...], Bounds(1, "Velocity limit of each joint, per s.")] = ()
    acceleration: Annotated[
        tuple[LowerUpper | None, ...], Bounds(2, "Acceleration limit of each joint, per s^2.")
    ] = ()
    jerk: Annotated[tuple[LowerUpper | None, ...], Bounds(3, "Jerk limit of each joint, per s^3.")] = ()
    effort: Annotated[
        EffortBounds,
        Efforts("Torque or force limit of each joint, N m or N; `robot`: the robot's own."),
    ] = ()
    scale: Scale = Scale()
    tcp: ToolLimitsSpec | None = None

    def of_order(self, order: int) -> tuple[LowerUpper | None, ...]:
        """Return the bounds of a derivative, of order 0 (position) to 3 (jerk); empty where none is given."""
        return getattr(self, QUANTITIES[order])  # type: ignore[no-any-return]


class JobLimitsSpec(LimitsSpec):
    """Limits of a job, which may stand in a file of MoveIt's."""

    file: Annotated[
        str | None,
        Field(
            strict=True,
            min_length=1,
            description="MoveIt's joint_limits.yaml, relative to the job's folder; other keys win over it.",
        ),
    ] = None
