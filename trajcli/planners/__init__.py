"""Planners: one file each. The union below is their registration; schema, messages, tests, docs read it."""

from __future__ import annotations

from typing import Annotated, Union, get_args

from pydantic import Field

from trajcli.planners.arc import Arc
from trajcli.planners.blends import Blends
from trajcli.planners.cubic import Cubic
from trajcli.planners.cycloidal import Cycloidal
from trajcli.planners.hold import Hold
from trajcli.planners.jerk_limited import JerkLimited
from trajcli.planners.line import Line
from trajcli.planners.path import PathMove
from trajcli.planners.planner import Planner
from trajcli.planners.quintic import Quintic
from trajcli.planners.screw import Screw
from trajcli.planners.septic import Septic
from trajcli.planners.spline import Spline
from trajcli.planners.time_optimal import TimeOptimal
from trajcli.planners.trapezoid import Trapezoid

Move = Annotated[
    Union[  # noqa: UP007
        Cubic,
        Quintic,
        Septic,
        Cycloidal,
        Trapezoid,
        JerkLimited,
        Spline,
        Blends,
        TimeOptimal,
        Line,
        Arc,
        PathMove,
        Screw,
        Hold,
    ],
    Field(discriminator="planner"),
]

PLANNERS: dict[str, type[Planner]] = {
    str(planner.model_fields["planner"].default): planner for planner in get_args(get_args(Move)[0])
}

__all__ = ["PLANNERS", "Move", "Planner"]
