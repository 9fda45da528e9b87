"""Waypoints in job files: listed one by one, as a table, or recorded in a file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import numpy as np
from pydantic import GetJsonSchemaHandler, model_validator
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import CoreSchema, core_schema

from trajcli.language.numbers import (
    AT_KEY,
    FlawError,
    Number,
    ReadingContext,
    flaws_below,
    number_schema,
    object_schema,
    refuse,
    shown,
)
from trajcli.language.per_joint import JointDistance, PerJoint
from trajcli.language.points import ListOrRecorded, Named
from trajcli.language.poses import read_numbers
from trajcli.language.recorded import Recorded
from trajcli.language.targets import Target
from trajcli.units import Quantity

_TIME = Quantity("time")
_MERGE = JointDistance(
    "Points no joint of which is further than this from the point before are left out (angle or length unit, "
    "as the joint is)."
)
_KEYS = ("csv", "positions", "times", "merge")


class Waypoint(Target):
    """A point to pass: a state, and when."""

    time: (
        Annotated[float, Number(_TIME, "When it is passed, s from the start of the move.", above=0.0)] | None
    ) = None
    blend: Annotated[float, Number(_TIME, "Duration of the blend around it, s.", above=0.0)] | None = None

    @model_validator(mode="after")
    def _is_somewhere(self) -> Waypoint:
        if not self.gives_joints_or_pose:
            raise refuse([((), "a waypoint needs `joints` or a pose", None)])
        return self


NamedWaypoint = Annotated[Waypoint, Named("Waypoint")]


class PointsField(ListOrRecorded):
    """Lets {csv: PATH} stand for the points of a file, and {positions: [...]} for a table of them."""

    listed = tuple[NamedWaypoint, ...]
    recorded = Recorded

    def from_mapping(self, value: Mapping[str, Any], context: ReadingContext) -> Recorded:
        """Return the points of a file or of a table."""
        unknown = [key for key in value if key not in _KEYS]
        if unknown:
            raise FlawError(
                f"unknown key '{unknown[0]}'", unknown[0], AT_KEY, hint=f"the keys are {', '.join(_KEYS)}"
            )
        if ("csv" in value) == ("positions" in value):
            raise FlawError("expected a list of waypoints, {csv: PATH} or {positions: [...]}")
        points = _from_file(value, context) if "csv" in value else _inline(value, context)
        with flaws_below("merge"):
            merge = _MERGE.read(value["merge"], context) if "merge" in value else ()
        return Recorded(points.positions, points.times, points.file, merge)

    def written(
        self, value: Recorded, serialize: core_schema.SerializerFunctionWrapHandler, context: ReadingContext
    ) -> Any:  # noqa: ANN401
        """Return the points as a table with the SI unit of each joint."""
        one = PerJoint(0, "")
        table: dict[str, Any] = {
            "positions": [one.write(tuple(q), context) for q in value.positions.tolist()]
        }
        if value.times is not None:
            table["times"] = value.times.tolist()
        if value.merge:
            table["merge"] = _MERGE.write(value.merge, context)
        return table

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> JsonSchemaValue:
        keys = {
            "csv": {"type": "string", "description": "A file of joint values, relative to the job's folder."},
            "merge": {**_MERGE.json_schema(), "default": 0, "description": _MERGE.description},
        }
        rows = {"type": "array", "items": PerJoint(0, "").json_schema(), "minItems": 1}
        table = {
            "positions": {**rows, "description": "Joint values, one row for each point."},
            "times": {
                "type": "array",
                "items": number_schema(_TIME),
                "description": "When, s from the start.",
            },
            "merge": keys["merge"],
        }
        forms = [object_schema(keys, "csv"), object_schema(table, "positions")]
        return {"anyOf": [handler(schema), *forms]}


Through = Annotated[tuple[NamedWaypoint, ...] | Recorded, PointsField()]


def _from_file(value: Mapping[str, Any], context: ReadingContext) -> Recorded:
    path = value["csv"]
    if "times" in value:
        raise FlawError("a file's times stand in its column t", "times", hint="leave `times` out")
    if not isinstance(path, str):
        raise FlawError(f"expected the path of a file, got {shown(path)}", "csv")
    if context.read_points is None:
        raise FlawError("only a job can read a file of points", "csv", hint="give `positions`")
    return context.read_points(path)


def _inline(value: Mapping[str, Any], context: ReadingContext) -> Recorded:
    rows = value["positions"]
    if not isinstance(rows, list | tuple) or not rows:
        raise FlawError(f"expected a list of rows of joint values, got {shown(rows)}", "positions")
    positions, one = [], PerJoint(0, "Position of each joint.")
    for index, row in enumerate(rows):
        with flaws_below("positions", index):
            positions.append(one.read(row, context))
    if len(counts := {len(row) for row in positions}) > 1:
        raise FlawError(f"expected rows of as many values, got {counts}", "positions")
    if "times" not in value:
        return Recorded(np.array(positions))
    times = read_numbers(value["times"], len(positions), _TIME, context, "times")
    if (np.diff(times) <= 0).any():
        raise FlawError("times must increase", "times", int(np.flatnonzero(np.diff(times) <= 0)[0]) + 1)
    return Recorded(np.array(positions), times)
