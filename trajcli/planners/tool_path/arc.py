"""Circular arcs and helices of the tool."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount
from trajcli.geometry.paths.arc import Arc
from trajcli.geometry.paths.position import SAME_POINT, PositionCurve
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import Flaw, Model, Number, refuse_flaws
from trajcli.language.points import NamedTarget
from trajcli.language.targets import Direction, Numbers, Row, Target
from trajcli.planners.planner import Event
from trajcli.planners.tool_path.move import (
    PlannedPath,
    ToolTarget,
    flaws_of_target,
    kept_orientation,
    path_to,
    tool_target,
)
from trajcli.planners.tool_path.weave import WovenMove
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
        refuse_flaws(self._flaws())
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
        if self.via is not None and not (self.via.joints or self.via.waits or self.via.gives_position):
            yield ("via",), "the point that an arc passes needs `xyz`", None


class ArcMove(WovenMove, ArcFields):
    """Along a circle, also several turns, or a helix.

    Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.3.1.
    """

    planner: Literal["arc"] = "arc"

    def path_from(self, before: Array, robot: Robot) -> PlannedPath:
        """Return the arc from the pose `before` (4, 4)."""
        target = arc_target(self, before, robot)
        arc = arc_of(self, before, target, robot)
        planned = path_to(arc, before, target, self, self.to)
        via = () if self.via is None else ((("via",), arc.s_of(_position(self.via, robot))),)
        return self.woven(replace(planned, events=center_events([arc]), targets=(*via, *planned.targets)))


def arc_target(fields: ArcFields, before: Array, robot: Robot) -> ToolTarget:
    """Return where an arc ends; one that is given by its angle ends with the orientation it begins with."""
    if fields.to is not None:
        return tool_target(fields.to, before, robot)
    pose = before.copy()
    pose[:3, 3] = _by_angle(fields, before).end
    return kept_orientation(pose, robot)


def arc_of(fields: ArcFields, before: Array, target: ToolTarget, robot: Robot) -> Arc:
    """Return the arc from a pose (4, 4) to a target."""
    if fields.to is None:
        return _by_angle(fields, before)
    start, end = before[:3, 3], target.pose[:3, 3]
    if fields.via is not None:
        return Arc.through(start, _position(fields.via, robot), end)
    return Arc.around(start, np.array(fields.center), end, fields.axis)


def _position(target: Target, robot: Robot) -> Array:
    """Return where the tcp is in a target, (3,)."""
    pose = target.full_pose() if target.joints is None else forward(robot, np.array(target.joints))
    return pose[:3, 3]


def _by_angle(fields: ArcFields, before: Array) -> Arc:
    return Arc(
        before[:3, 3], np.array(fields.center), np.array(fields.axis), fields.angle or 0.0, fields.pitch
    )


def center_events(segments: Iterable[PositionCurve]) -> tuple[Event, ...]:
    """Return an event for each arc whose center was moved."""
    text = "the center of the arc was moved by {by} to fit its ends"
    return tuple(
        Event("moved_center", text, amounts={"by": Amount(arc.moved, 0, None, "length")})
        for arc in segments
        if isinstance(arc, Arc) and arc.moved > SAME_POINT
    )
