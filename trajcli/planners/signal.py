"""Signals between moves: set where the arm stands, in no time."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Field
from pydantic.json_schema import SkipJsonSchema

from trajcli.language.numbers import Number
from trajcli.language.signals import SignalName
from trajcli.planners.payload import BetweenMoves
from trajcli.units import Quantity


class SetSignal(BetweenMoves):
    """A signal has a value from here on."""

    needs_geometry: ClassVar[str] = ""

    planner: SkipJsonSchema[Literal["signal"]] = Field("signal", exclude=True)
    signal: Annotated[str, SignalName("Name of the signal."), Field(description="Name of the signal.")]
    value: Annotated[float, Number(Quantity("ratio"), "What it is from here on.")]
