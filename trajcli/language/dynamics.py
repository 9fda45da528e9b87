"""Dynamics in files: efforts, friction, the motor's inertia, mass and inertia of links and payloads.

These numbers are in SI whatever the units of the file, but for the centre of mass, which is a length.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any

import numpy as np
from pydantic import model_validator
from pydantic.json_schema import JsonSchemaValue

from trajcli.errors import InputError
from trajcli.frozen import comparable
from trajcli.kinematics.robot import Friction, Joint, LinkInertia, Payload
from trajcli.language.numbers import (
    SI,
    FieldType,
    Model,
    Number,
    ReadingContext,
    number_schema,
    refuse,
)
from trajcli.language.per_joint import UNLIMITED
from trajcli.language.poses import read_numbers
from trajcli.language.targets import Numbers
from trajcli.units import Quantity

_SI = Quantity("ratio")
_MASS, _INERTIA = Quantity("mass"), Quantity("inertia")
_LENGTH = Quantity("length")


@comparable
class Gravity(FieldType):
    """The acceleration of a body that falls, in world: m/s^2 whatever the units of the file."""

    description: str

    def read(self, value: Any, context: ReadingContext) -> tuple[float, ...]:  # noqa: ANN401
        """Return the three numbers, m/s^2."""
        return tuple(read_numbers(value, 3, Quantity("length", 2), SI).tolist())

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of three numbers."""
        items = number_schema(Quantity("length", 2))
        return {"type": "array", "items": items, "minItems": 3, "maxItems": 3}


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
