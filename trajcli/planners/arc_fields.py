"""Fields that give an arc of the tool."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated

from pydantic import Field, model_validator

from trajcli.language.numbers import Flaw, Model, Number, refuse
from trajcli.language.targets import Direction, NamedTarget, Numbers, Row
from trajcli.planners.tool_fields import flaws_of_target
from trajcli.units import Quantity

_LENGTH, _ANGLE = Quantity("length"), Quantity("angle")


class ArcFields(Model):
    """A circular arc: through a point, about a center, or by an angle about an axis."""

    via: Annotated[
        NamedTarget | None, Field(description="A point that the arc passes; its place counts.")
    ] = None
    to: Annotated[NamedTarget | None, Field(description="Where the arc ends, or the name of a point.")] = None
    center: Annotated[Row, Numbers(3, _LENGTH, "Center of the circle, in world (length unit).")] | None = None
    axis: (
        Annotated[Row, Direction("Axis of the circle, in world: the arc goes right-handed about it.")] | None
    ) = None
    angle: Annotated[float, Number(_ANGLE, "Signed, also several turns (angle unit).")] | None = None
    pitch: Annotated[float, Number(_LENGTH, "Way along the axis for each turn (length unit).")] = 0.0

    @model_validator(mode="after")
    def _is_one_arc(self) -> ArcFields:
        flaws = list(self._flaws())
        if flaws:
            raise refuse(flaws)
        return self

    def _flaws(self) -> Iterator[Flaw]:
        forms = "give `via` and `to`, `center` and `to`, or `center`, `axis` and `angle`"
        given = {name for name in ("via", "to", "center", "axis", "angle") if getattr(self, name) is not None}
        if given not in (
            {"via", "to"},
            {"center", "to"},
            {"center", "to", "axis"},
            {"center", "axis", "angle"},
        ):
            yield (), f"an arc is not given by {', '.join(sorted(given)) or 'nothing'}", forms
        elif self.pitch and "angle" not in given:
            yield ("pitch",), "a helix is given by center, axis and angle", "leave pitch out"
        for name in ("via", "to"):
            target = getattr(self, name)
            if target is not None:
                yield from flaws_of_target(target, (name,), "an arc")
        if self.via is not None and self.via.joints is None and not self.via.gives_position:
            yield ("via",), "the point that an arc passes needs `xyz`", None
