"""Planners of moves, by their names in job files: the table that schema, messages, tests and docs read.

A job loads the planners that it uses and no other: building all their models costs more than most plans.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from importlib import import_module
from typing import Annotated, Any

from pydantic import Field, GetCoreSchemaHandler, TypeAdapter, ValidationError
from pydantic_core import CoreSchema, core_schema

from trajcli.frozen import frozen
from trajcli.language.numbers import Model
from trajcli.planners.planner import Planner

_WHERE = {
    "cubic": "point_to_point.polynomial.Cubic",
    "quintic": "point_to_point.polynomial.Quintic",
    "septic": "point_to_point.polynomial.Septic",
    "cycloidal": "point_to_point.cycloidal.Cycloidal",
    "trapezoid": "point_to_point.trapezoid.Trapezoid",
    "jerk_limited": "point_to_point.jerk_limited.JerkLimited",
    "spline": "waypoints.spline.Spline",
    "blends": "waypoints.blends.Blends",
    "time_optimal": "waypoints.time_optimal.TimeOptimal",
    "waypoints": "waypoints.waypoints.FastestThroughPoints",
    "line": "tool_path.line.LineMove",
    "arc": "tool_path.arc.ArcMove",
    "path": "tool_path.path.PathMove",
    "screw": "tool_path.line.ScrewMove",
    "hold": "point_to_point.point_to_point.Hold",
}
"""The module and class of each planner, by its name in job files."""

_BETWEEN = {
    "attach": "between_moves.Attach",
    "detach": "between_moves.Detach",
    "tool": "between_moves.ChangeTool",
    "signal": "between_moves.SetSignal",
}
"""Likewise what stands between moves, by its key in job files."""

ALSO_CALLED = {
    "ptp": "jerk_limited",
    "movej": "jerk_limited",
    "ruckig": "jerk_limited",
    "otg": "jerk_limited",
    "s_curve": "jerk_limited",
    "scurve": "jerk_limited",
    "lspb": "trapezoid",
    "trapezoidal": "trapezoid",
    "trap": "trapezoid",
    "minimum_jerk": "quintic",
    "min_jerk": "quintic",
    "jtraj": "quintic",
    "lin": "line",
    "movel": "line",
    "linear": "line",
    "ctraj": "line",
    "circ": "arc",
    "movec": "arc",
    "circle": "arc",
    "circular": "arc",
    "movep": "path",
    "toppra": "time_optimal",
    "topp": "time_optimal",
    "topp_ra": "time_optimal",
    "totg": "time_optimal",
    "mstraj": "blends",
    "wait": "hold",
    "dwell": "hold",
    "pause": "hold",
    "sleep": "hold",
}
"""What other programs and books call what a planner does, in lower case."""


@frozen
class _Planners(Mapping[str, type[Planner]]):
    """Every planner by its name; one that is asked for is loaded."""

    where: Mapping[str, str]

    def __getitem__(self, tag: str) -> type[Planner]:
        module, _, name = self.where[tag].rpartition(".")
        planner: type[Planner] = getattr(import_module(f"trajcli.planners.{module}"), name)
        return planner

    def __contains__(self, tag: object) -> bool:
        return tag in self.where

    def __iter__(self) -> Iterator[str]:
        return iter(self.where)

    def __len__(self) -> int:
        return len(self.where)


PLANNERS = _Planners(_WHERE)
HANDLING = _Planners(_BETWEEN)
"""What takes up a payload or leaves it, changes the tool, or sets a signal: an entry among the moves, by its
key."""


@frozen
class _ByName:
    """A planner, chosen by its name: a tagged union, also where there is but one.

    pydantic makes no union of one type, and its errors would not say which planner they are about.
    """

    tags: tuple[str, ...]

    def __get_pydantic_core_schema__(self, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:  # noqa: ANN401
        every = _Planners({**_WHERE, **_BETWEEN})
        choices = {tag: handler.generate_schema(every[tag]) for tag in self.tags}
        return core_schema.tagged_union_schema(choices, discriminator="planner")


def defaults_of_paths() -> type[Model]:
    """Return the model of what a job states for all its moves along paths."""
    model: type[Model] = import_module("trajcli.planners.tool_path.line").Defaults
    return model


def moves_adapter(tags: Iterable[str]) -> TypeAdapter[list[Planner]]:
    """Return what reads a list of at least one move, each planned by one of the planners named."""
    planner = _ByName(tuple(sorted(tags)))
    return TypeAdapter(Annotated[list[Annotated[Planner, planner]], Field(min_length=1)])


def changed(planner: Planner, change: Mapping[str, Any]) -> Planner | None:
    """Return a move with some fields changed, its `planner` perhaps among them; None where they do not fit.

    Args:
        planner: The move; fields that the other planner does not have are left out.
        change: By name, in SI; a mapping changes fields of the model in that field.
    """
    fields = dict(change)
    kind = PLANNERS[str(fields.pop("planner", planner.tag))]
    shared = set(kind.model_fields) & set(type(planner).model_fields) - {"planner"}
    kept = {name: getattr(planner, name) for name in shared}
    try:
        for name, value in fields.items():
            if isinstance(value, Mapping):
                inner: Any = kept[name]
                given = {key: getattr(inner, key) for key in inner.model_fields_set}
                fields[name] = type(inner)(**{**given, **value})
        return kind(**{**kept, **fields})
    except ValidationError:
        return None


__all__ = ["ALSO_CALLED", "HANDLING", "PLANNERS", "Planner", "changed", "defaults_of_paths", "moves_adapter"]
