"""Defaults of a job for its moves along paths of the tool."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from trajcli.language.numbers import Model
from trajcli.planners.tool_path.law import LawSpec
from trajcli.planners.tool_path.move import Orientation, ToleranceSpec


class Defaults(Model):
    """What holds for every line, arc, path and screw that does not say otherwise."""

    law: Annotated[
        LawSpec | None,
        Field(
            description="Key by key, but for a law that names a shape or a duration; without a shape it is "
            "time_optimal."
        ),
    ] = None
    tolerance: Annotated[ToleranceSpec | None, Field(description="Key by key.")] = None
    orientation: Annotated[Orientation | None, Field(description="Of those that have one.")] = None
