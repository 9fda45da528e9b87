"""Weaves of moves along a path: waves to both sides of a seam."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from typing import Annotated, Literal

import numpy as np
from pydantic import Field, model_validator

from trajcli.errors import Amount, InputError, Problem
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.language.numbers import Model, Number, refuse
from trajcli.language.targets import Direction, Row
from trajcli.planners.planner import Event
from trajcli.planners.tool_path.law import LawSpec
from trajcli.planners.tool_path.move import PlannedPath, ToolPathMove
from trajcli.units import Quantity

_LENGTH = Quantity("length")
_SAME = 1e-6  # relative: a cycle whose length differs by less is the one asked for
_MOST_CYCLES = 100_000


class WeaveSpec(Model):
    """A swing to both sides of the path, across it and square to the tool's z."""

    shape: Annotated[
        Literal["sine", "triangle", "trapezoid"],
        Field(description="Of the wave; corners are rounded within 5 % of a cycle."),
    ] = "sine"
    amplitude: Annotated[float, Number(_LENGTH, "To each side (length unit).", above=0.0)]
    length: (
        Annotated[float, Number(_LENGTH, "Of a whole cycle along the seam (length unit).", above=0.0)] | None
    ) = None
    frequency: (
        Annotated[
            float,
            Number(
                Quantity("frequency"),
                "Instead of the length: that is then the law's speed over it, Hz.",
                above=0.0,
            ),
        ]
        | None
    ) = None
    side: (
        Annotated[Row, Direction("To which side first, in world; square to path and tool's z if left out.")]
        | None
    ) = None

    @model_validator(mode="after")
    def _has_a_length(self) -> WeaveSpec:
        if (self.length is None) == (self.frequency is None):
            text = "a weave has a `length` of a cycle, or a `frequency`"
            raise refuse([((), text, "give one of the two")])
        return self

    def cycle(self, law: LawSpec) -> float:
        """Return the length of a cycle under a law that has a speed where that is needed, m."""
        if self.length is not None:
            return self.length
        return (law.speed or 0.0) / (self.frequency or 1.0)


class WovenMove(ToolPathMove):
    """A move along a path of the tool that may weave about it."""

    weave: Annotated[
        WeaveSpec | None, Field(description="A swing to both sides; law and `at` are of the path itself.")
    ] = None

    @property
    def why_not_flown_by(self) -> str | None:
        """Why no motion can fly by a corner of this move; None where it can."""
        return super().why_not_flown_by if self.weave is None else "it weaves"

    @model_validator(mode="after")
    def _weave_fits(self) -> WovenMove:
        if self.weave and self.weave.frequency and self.law.speed is None:
            text = "a frequency makes a length with the `speed` of the law, which has none"
            hint = "say law: {speed: ...}, or give the `length` of a cycle"
            raise refuse([(("weave", "frequency"), text, hint)])
        return self

    def woven(self, planned: PlannedPath) -> PlannedPath:
        """Return a path with its weave, if it has one.

        Raises:
            InputError: When the tool only turns, or there are too many cycles.
            PlanningError: When the side is along the path.
        """
        if self.weave is None:
            return planned
        from trajcli.kinematics.following.weave import Weave, stops_of

        poses, spec = planned.path.poses, self.weave
        if not isinstance(poses, PoseCurve) or poses.pure_rotation:
            hint = "leave `weave` out, or go somewhere"
            raise InputError("a weave needs a path, and the tool stays in its place", hint=hint)
        wanted, edges = spec.cycle(self.law), [0.0, *stops_of(poses.position).tolist(), poses.length]
        if poses.length > _MOST_CYCLES * wanted:
            raise _too_many(poses.length / _MOST_CYCLES, wanted)
        lengths = [high - low for low, high in pairwise(edges)]
        cycles = tuple(_cycles(length / wanted) for length in lengths)
        across = None if spec.side is None else np.array(spec.side)
        weave = Weave(poses.position, poses.orientation, spec.amplitude, cycles, spec.shape, across)
        used = [length / count for length, count in zip(lengths, cycles, strict=True)]
        path = replace(planned.path, poses=PoseCurve(weave, poses.orientation))
        return replace(planned, path=path, events=(*planned.events, *_fitted(used, wanted)))


def _too_many(least: float, wanted: float) -> InputError:
    """Return the error of cycles that are shorter than the seam allows, m."""
    message = (
        f"at most {_MOST_CYCLES} cycles weave about a seam, so each is {{least}} or longer, not {{wanted}}"
    )
    amounts = {"least": Amount(least, 0, None, "length", "up"), "wanted": Amount(wanted, 0, None, "length")}
    return InputError(Problem(message, "let cycles be longer", field=("weave",), amounts=amounts))


def _cycles(wanted: float) -> float:
    """Return how many cycles of a wave begin and end on the seam: as many as wanted, or else whole ones."""
    halves = round(2.0 * wanted)
    if halves and abs(2.0 * wanted - halves) <= _SAME * halves:
        return halves / 2.0
    return float(max(1, round(wanted)))


def _fitted(used: list[float], wanted: float) -> Iterator[Event]:
    """Yield the remark on cycles that are not as long as asked for, so that whole ones fit."""
    worst = max(used, key=lambda length: abs(length - wanted))
    if abs(worst - wanted) > _SAME * wanted:
        amounts = {"used": Amount(worst, 0, None, "length"), "wanted": Amount(wanted, 0, None, "length")}
        text = "a cycle of the weave is {used} long, not {wanted}: whole ones fit between stops"
        yield Event("weave_fitted", text, amounts=amounts)
