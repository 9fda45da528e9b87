"""Dynamics of a joint in robot files: effort, friction, the motor's inertia, mass and inertia of the link.

These numbers are in SI whatever the units of the file, but for the centre of mass, which is a length.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

from pydantic import model_validator
from pydantic.json_schema import JsonSchemaValue

from trajcli.errors import InputError
from trajcli.frozen import comparable
from trajcli.kinematics.robot import Friction, Joint, LinkInertia
from trajcli.language.limits import UNLIMITED, LowerUpper
from trajcli.language.numbers import (
    FieldType,
    FlawError,
    Model,
    Number,
    ReadingContext,
    number_schema,
    read_number,
    refuse,
    shown,
)
from trajcli.language.targets import Numbers
from trajcli.units import Quantity

_SI = Quantity("ratio")
_LENGTH = Quantity("length")


@comparable
class EffortBound(FieldType):
    """The bound of a joint's torque or force, SI: a magnitude, a pair by direction, or null."""

    description: str

    def read(self, value: Any, context: ReadingContext) -> LowerUpper:  # noqa: ANN401
        """Return (lower, upper), N m or N."""
        if value is None:
            return UNLIMITED
        if isinstance(value, list | tuple) and len(value) == 2:
            low, high = (read_number(item, _SI, context.units) for item in value)
            if low < 0 < high:
                return low, high
        elif not isinstance(value, list | tuple):
            size = read_number(value, _SI, context.units)
            if size > 0:
                return -size, size
        got = f"[{', '.join(map(shown, value))}]" if isinstance(value, list | tuple) else shown(value)
        raise FlawError(
            "expected a number above 0 (N m or N), a pair [lower, upper], a negative and a positive number, "
            f"or null (not known), got {got}"
        )

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of a magnitude, a pair or null."""
        pair = {"type": "array", "items": number_schema(_SI), "minItems": 2, "maxItems": 2}
        return {"anyOf": [number_schema(_SI, exclusiveMinimum=0.0), pair, {"type": "null"}]}


class FrictionSpec(Model):
    """Friction of a joint: coulomb sign(qd) + viscous qd; what is left out is zero."""

    coulomb: Annotated[float, Number(_SI, "Coulomb friction, N m or N.", at_least=0.0)] = 0.0
    viscous: Annotated[float, Number(_SI, "Viscous friction, N m s/rad or N s/m.", at_least=0.0)] = 0.0

    def as_friction(self) -> Friction:
        """Return the plain value."""
        return Friction(self.coulomb, self.viscous)


class LinkSpec(Model):
    """Mass of the link behind a joint, with all that is fixed to it, in the frame of the joint's row."""

    mass: Annotated[float, Number(_SI, "Mass, kg.", above=0.0)]
    com: Annotated[
        tuple[float, ...], Numbers(3, _LENGTH, "Centre of mass in the link's DH frame (length unit).")
    ]
    inertia: Annotated[
        tuple[float, ...],
        Numbers(6, _SI, "ixx, iyy, izz, ixy, ixz, iyz about the centre of mass, kg m^2."),
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
