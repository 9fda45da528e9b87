"""Dynamics in files: efforts, friction, the motor's inertia, mass and inertia of links, payloads and tools.

These numbers are in SI whatever the units of the file, but for the centre of mass, which is a length.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import ValidationError, model_validator
from pydantic.json_schema import JsonSchemaValue

from trajcli.errors import InputError
from trajcli.frozen import comparable
from trajcli.kinematics.robot import Friction, Joint, LinkInertia, MountedTool, Payload
from trajcli.language.numbers import (
    AT_KEY,
    SI,
    FieldType,
    FlawError,
    Model,
    Number,
    ReadingContext,
    refuse,
    shown,
    written_number,
)
from trajcli.language.per_joint import UNLIMITED
from trajcli.language.poses import ROTATIONS, Pose, numbers_schema, read_numbers
from trajcli.language.targets import Numbers
from trajcli.units import Quantity

_SI = Quantity("ratio")
_MASS, _INERTIA = Quantity("mass"), Quantity("inertia")
_LENGTH = Quantity("length")
_OF_MASS = ("mass", "com", "inertia")
_SUCH_AS = "such as {xyz: [0, 0, 0.15], mass: 0.8}"


@comparable
class Gravity(FieldType):
    """The acceleration of a body that falls, in world: m/s^2 whatever the units of the file."""

    description: str

    def read(self, value: Any, context: ReadingContext) -> tuple[float, ...]:  # noqa: ANN401
        """Return the three numbers, m/s^2."""
        return tuple(read_numbers(value, 3, Quantity("length", 2), SI).tolist())

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of three numbers."""
        return numbers_schema(3, Quantity("length", 2))


class FrictionSpec(Model):
    """Friction of a joint: coulomb sign(qd) + viscous qd; what is left out is zero."""

    coulomb: Annotated[float, Number(_SI, "Coulomb friction, N m or N.", at_least=0.0)] = 0.0
    viscous: Annotated[float, Number(_SI, "Viscous friction, N m s/rad or N s/m.", at_least=0.0)] = 0.0

    def as_friction(self) -> Friction:
        """Return the plain value."""
        return Friction(self.coulomb, self.viscous)


class LinkSpec(Model):
    """Mass of the link behind a joint, with all that is fixed to it, in the frame of the joint's row."""

    mass: Annotated[float, Number(_MASS, "Mass, kg.", above=0.0)]
    com: Annotated[
        tuple[float, ...], Numbers(3, _LENGTH, "Centre of mass in the link's DH frame (length unit).")
    ]
    inertia: Annotated[
        tuple[float, ...],
        Numbers(6, _INERTIA, "ixx, iyy, izz, ixy, ixz, iyz about the centre of mass, kg m^2."),
    ]

    @model_validator(mode="after")
    def _is_possible(self) -> LinkSpec:
        try:
            self.as_inertia()
        except InputError as error:
            raise refuse([(("inertia",), str(error), error.problems[0].hint)]) from None
        return self

    def as_inertia(self) -> LinkInertia:
        """Return the plain value.

        Raises:
            InputError: When no solid has such an inertia.
        """
        x, y, z = self.com
        xx, yy, zz, xy, xz, yz = self.inertia
        return LinkInertia(self.mass, (x, y, z), (xx, yy, zz, xy, xz, yz))


class PayloadSpec(Model):
    """What the tool carries from here on, in the tcp frame."""

    mass: Annotated[float, Number(_MASS, "Mass, kg.", at_least=0.0)]
    com: Annotated[
        tuple[float, ...], Numbers(3, _LENGTH, "Centre of mass in the tcp frame (length unit).")
    ] = (0.0, 0.0, 0.0)
    inertia: Annotated[
        tuple[float, ...],
        Numbers(
            6,
            _INERTIA,
            "ixx, iyy, izz, ixy, ixz, iyz about the centre of mass, kg m^2; zero: a point mass.",
        ),
    ] = (0.0,) * 6

    @model_validator(mode="after")
    def _is_possible(self) -> PayloadSpec:
        try:
            self.as_payload()
        except InputError as error:
            raise refuse([(("inertia",), str(error), error.problems[0].hint)]) from None
        if self.mass == 0 and any(self.inertia):
            raise refuse([(("inertia",), "nothing without mass has a moment of inertia", None)])
        return self

    def as_payload(self) -> Payload:
        """Return the plain value.

        Raises:
            InputError: When no solid has such an inertia.
        """
        xx, yy, zz, xy, xz, yz = self.inertia
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        return Payload(self.mass, np.array(self.com), tensor)


def written_dynamics(joint: Joint, say: Callable[[float, Quantity], float | str]) -> dict[str, Any]:
    """Return the keys of a joint that say something, to be read bit by bit.

    Args:
        joint: Of a robot.
        say: Returns a number, SI, as it stands in the file.
    """
    keys: dict[str, Any] = {}
    if joint.effort != UNLIMITED:
        keys["effort"] = list(joint.effort)
    if joint.friction != Friction():
        keys["friction"] = {"coulomb": joint.friction.coulomb, "viscous": joint.friction.viscous}
    if joint.rotor:
        keys["rotor"] = joint.rotor
    if joint.link is not None:
        com = [say(length, _LENGTH) for length in joint.link.com]
        keys["link"] = {"mass": joint.link.mass, "com": com, "inertia": list(joint.link.inertia)}
    return keys


@comparable
class ToolField(FieldType):
    """A tool as it is: a pose of its tcp on the flange, and perhaps its mass in the frame of the tcp."""

    description: str

    def read(self, value: Any, context: ReadingContext) -> MountedTool:  # noqa: ANN401
        """Return the tool."""
        if isinstance(value, np.ndarray | MountedTool):
            return value if isinstance(value, MountedTool) else MountedTool(value)
        if not isinstance(value, Mapping):
            raise FlawError(f"expected a pose on the flange, got {shown(value)}", hint=_SUCH_AS)
        unknown = [key for key in value if key not in ("xyz", *ROTATIONS, *_OF_MASS)]
        if unknown:
            hint = f"a tool has xyz, {', '.join((*ROTATIONS, *_OF_MASS))}"
            raise FlawError(f"unknown key '{unknown[0]}'", unknown[0], AT_KEY, hint=hint)
        pose = Pose("").read({key: value[key] for key in value if key not in _OF_MASS}, context)
        return MountedTool(pose, _load({key: value[key] for key in _OF_MASS if key in value}, context))

    def write(self, value: MountedTool, context: ReadingContext) -> dict[str, Any]:
        """Return the tool as it may stand in a job of any units."""
        load = {} if value.load is None else _written_load(value.load)
        return {**Pose("").write(value.pose, context), **load}

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of a pose, a mass and how it is spread."""
        pose = Pose("").json_schema()
        of_mass = PayloadSpec.model_json_schema()["properties"]
        own = {key: {k: v for k, v in of_mass[key].items() if k != "title"} for key in _OF_MASS}
        own["mass"]["description"] = "Own mass of the tool, kg."
        needed = {"com": ["mass"], "inertia": ["mass"]}
        return {**pose, "properties": {**pose["properties"], **own}, "dependentRequired": needed}


@comparable
class NamedTool(ToolField):
    """A tool by its name under `tools`, or as it is."""

    def read(self, value: Any, context: ReadingContext) -> MountedTool:  # noqa: ANN401
        """Return the tool."""
        return tool_named(value, context) if isinstance(value, str) else super().read(value, context)

    def write(self, value: MountedTool, context: ReadingContext) -> Any:  # noqa: ANN401
        """Return its name where it has one."""
        return value.name or super().write(value, context)

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of either form."""
        name = {"type": "string", "minLength": 1, "description": "Name of a tool under `tools`."}
        return {"anyOf": [name, super().json_schema()]}


def tool_named(name: str, context: ReadingContext) -> MountedTool:
    """Return a tool of the job by its name.

    Raises:
        FlawError: When there is none; without a flaw where the tool itself is wrong, which is said there.
    """
    if name not in context.tools:
        from trajcli.suggest import did_you_mean, valid_names

        hint = did_you_mean(name, context.tools) or valid_names(context.tools, "tools")
        raise FlawError(f"there is no tool '{name}'", hint=hint or "the job has no `tools`")
    value = context.tools[name]
    if isinstance(value, MountedTool):
        return value
    try:
        tool = ToolField("").read(value, context)
    except FlawError as error:
        error.flaws = []
        raise
    return MountedTool(tool.pose, tool.load, name)


def _load(given: Mapping[str, Any], context: ReadingContext) -> Payload | None:
    if not given:
        return None
    if "mass" not in given:
        key = next(iter(given))
        raise FlawError(f"{key} says how a mass is spread, and there is none", key, AT_KEY, hint="add `mass`")
    try:
        return PayloadSpec.model_validate(given, context=context).as_payload()
    except ValidationError as error:
        raise _flaws_of(error) from None


def _flaws_of(error: ValidationError) -> FlawError:
    """Return the flaws of a mass as those of the tool that has it."""
    found = FlawError("the mass of a tool is wrong")
    found.flaws = [
        ((*one["loc"], *path), text, hint)
        for one in error.errors(include_url=False)
        for path, text, hint in one["ctx"]["flaws"]
    ]
    return found


def _written_load(load: Payload) -> dict[str, Any]:
    (xx, xy, xz), (_, yy, yz), (_, _, zz) = load.inertia.tolist()
    com = [written_number(length, _LENGTH) for length in load.com.tolist()]
    return {"mass": load.mass, "com": com, "inertia": [xx, yy, zz, xy, xz, yz]}
