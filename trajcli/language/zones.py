"""Zones in job files: a length, `stop`, or what the tool and the joints may leave the corner by.

Beside them the field of signals that are set about a corner: what reads these is loaded where a job has some.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from pydantic.json_schema import JsonSchemaValue

from trajcli.frozen import comparable
from trajcli.language.numbers import AT_KEY, FieldType, FlawError, Number, ReadingContext, shown
from trajcli.language.per_joint import JointDistance, read_each
from trajcli.units import Quantity

if TYPE_CHECKING:
    from trajcli.kinematics.zone import Zone

_LENGTH = Number(Quantity("length"), "Distance of the tool from the corner.", at_least=0.0)
_ANGLE = Number(Quantity("angle"), "Angle of the tool from how it stands in the corner.", at_least=0.0)
_JOINTS = JointDistance("Distance of each joint from the corner.")
_PARTS: Mapping[str, FieldType] = {"position": _LENGTH, "orientation": _ANGLE, "joints": _JOINTS}


@comparable
class ZoneField(FieldType):
    """A zone about a corner."""

    description: str

    def read(self, value: Any, context: ReadingContext) -> Zone:  # noqa: ANN401
        """Return the zone, in SI; `stop` is a ball of no size."""
        from trajcli.kinematics.zone import Zone  # of jobs without zones none is loaded

        if isinstance(value, Zone):
            return value
        if value == "stop":
            return Zone(position=0.0)
        if not isinstance(value, Mapping):
            if isinstance(value, str) and not any(letter.isdigit() for letter in value):
                text = f"expected a length, `stop`, or a mapping of {', '.join(_PARTS)}, got {shown(value)}"
                raise FlawError(text, hint="`zone: 20 mm` is a ball about the corner")
            return Zone(position=_LENGTH.read(value, context))
        return Zone(**_read_parts(value, context))

    def write(self, value: Zone, context: ReadingContext) -> Any:  # noqa: ANN401
        """Return a length, or the mapping."""
        if value.orientation is None and value.joints is None and value.position is not None:
            return _LENGTH.write(value.position, context) if value.position else "stop"
        return {
            key: part.write(getattr(value, key), context)
            for key, part in _PARTS.items()
            if getattr(value, key) is not None
        }

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of the three forms."""
        parts = {key: part.json_schema() for key, part in _PARTS.items()}
        mapping = {"type": "object", "properties": parts, "additionalProperties": False, "minProperties": 1}
        forms = [_LENGTH.json_schema(), {"const": "stop"}, mapping]
        return {"anyOf": forms, "description": self.description}


@comparable
class SignalsField(FieldType):
    """Signals that a move sets: one, or a list."""

    description: str

    def read(self, value: Any, context: ReadingContext) -> Any:  # noqa: ANN401
        """Return them, in SI."""
        from trajcli.language.signals import read_signals

        return read_signals(value, context)

    def write(self, value: Any, context: ReadingContext) -> Any:  # noqa: ANN401
        """Return a list of mappings."""
        from trajcli.language.signals import written_signals

        return written_signals(value, context)

    def json_schema(self) -> JsonSchemaValue:
        """Return the schema of one, or a list."""
        from trajcli.language.signals import schema_of_signals

        return {**schema_of_signals(), "description": self.description}


def _read_parts(value: Mapping[str, Any], context: ReadingContext) -> dict[str, Any]:
    """Return what a mapping limits, in SI."""
    unknown, listed = [key for key in value if key not in _PARTS], ", ".join(_PARTS)
    if unknown:
        raise FlawError(f"a zone has no '{unknown[0]}'", unknown[0], AT_KEY, hint=f"it has {listed}")
    if not value:
        raise FlawError(f"a zone needs one of {listed}")
    return read_each(value.items(), lambda key, item: _PARTS[key].read(item, context))
