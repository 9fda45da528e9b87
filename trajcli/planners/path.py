"""A chain of lines and arcs of the tool under one law."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import Field, model_validator

from trajcli.curves.piecewise import Array
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import Flaw, Model, Number, refuse
from trajcli.language.targets import NamedTarget
from trajcli.planners.arc_fields import ArcFields
from trajcli.planners.operational import OperationalMove, Way
from trajcli.planners.tool_fields import flaws_of_target
from trajcli.units import Quantity

Radius = Annotated[
    float,
    Number(
        Quantity("length"), "Way before and after a corner over which it is rounded (length unit).", above=0.0
    ),
]


class Segment(Model):
    """A line or an arc of a path, from where the one before ends."""

    line: Annotated[NamedTarget | None, Field(description="Where a straight segment ends.")] = None
    arc: ArcFields | None = None
    radius: Radius | None = None

    @model_validator(mode="after")
    def _is_one(self) -> Segment:
        if (self.line is None) == (self.arc is None):
            raise refuse([((), "a segment is either a `line` or an `arc`", None)])
        flaws = [] if self.line is None else list(flaws_of_target(self.line, ("line",), "a segment"))
        if flaws:
            raise refuse(flaws)
        return self


class PathMove(OperationalMove):
    """Lines and arcs under one law; corners are stopped at, rounded, or cut by overlapping in time.

    Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.3.2.
    """

    planner: Literal["path"] = "path"
    segments: Annotated[list[Segment], Field(min_length=1, description="Lines and arcs, in order.")]
    corner: Annotated[
        Literal["stop", "round", "overlap"],
        Field(
            description="stop: at rest in each corner; round: with a smooth curve of the given `radius`; "
            "overlap: each segment begins before the last one ends, by the time `overlap`."
        ),
    ] = "round"
    radius: Radius | None = None
    overlap: (
        Annotated[
            float, Number(Quantity("time"), "Time by which neighbouring segments overlap, s.", above=0.0)
        ]
        | None
    ) = None

    @model_validator(mode="after")
    def _corners_fit(self) -> PathMove:
        flaws = list(self._flaws())
        if flaws:
            raise refuse(flaws)
        return self

    def _flaws(self) -> Iterator[Flaw]:
        yield from self._flaws_of_radii()
        if self.corner == "overlap":
            yield from self._flaws_of_overlap()
        elif self.overlap is not None:
            yield ("overlap",), f"corner: {self.corner} does not overlap", "say `corner: overlap`"

    def _flaws_of_radii(self) -> Iterator[Flaw]:
        if self.corner == "round":
            for k, segment in enumerate(self.segments[:-1]):
                if segment.radius is None and self.radius is None:
                    hint = "give the move, or each segment, a `radius`"
                    yield ("segments", k), "the corner after this segment has no radius", hint
            return
        text, hint = f"corner: {self.corner} has no radius", "say `corner: round`"
        if self.radius is not None:
            yield ("radius",), text, hint
        for k, segment in enumerate(self.segments):
            if segment.radius is not None:
                yield ("segments", k, "radius"), text, hint

    def _flaws_of_overlap(self) -> Iterator[Flaw]:
        if self.overlap is None:
            yield ("corner",), "corner: overlap needs the time `overlap`", None
        if self.law.shape == "time_optimal":
            text = "segments that overlap have laws of their own"
            yield ("law",), text, "use another shape, or corner: round"
        if self.orientation in ("euler", "tangent"):
            text = f"orientation: {self.orientation} is not defined where segments overlap"
            yield ("orientation",), text, "use axis_angle or fixed, or corner: round"

    def way(self, before: Array, robot: Robot) -> Way:
        """Return the chain from the pose `before` (4, 4)."""
        from trajcli.planners.tool_chain import chain_way

        return chain_way(before, self, robot)
