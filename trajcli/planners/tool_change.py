"""Tool change between moves: another tcp on the flange, where the arm stands, in no time."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field
from pydantic.json_schema import SkipJsonSchema

from trajcli.errors import Amount, Amounts, PlanningError, Problem
from trajcli.kinematics.robot import MountedTool, Robot
from trajcli.language.dynamics import NamedTool
from trajcli.planners.payload import BetweenMoves
from trajcli.planners.planner import Planned
from trajcli.trajectory import State


class ChangeTool(BetweenMoves):
    """From here on poses are of another tool; what is attached keeps its place on the flange."""

    needs_geometry: ClassVar[str] = "a tool change"
    changes_tool: ClassVar[bool] = True

    planner: SkipJsonSchema[Literal["tool"]] = Field("tool", exclude=True)
    tool: Annotated[
        MountedTool, NamedTool("The tool from here on: a name under `tools`, or a pose on the flange.")
    ]

    @property
    def caption(self) -> str:
        """Its label, or the name of the tool."""
        return self.label or self.tool.name

    def equipped(self, robot: Robot) -> Robot:
        """Return the robot with the tool."""
        return robot.with_tool(self.tool)

    def plan(self, start: State, robot: Robot) -> Planned:
        """Return the curve of no length.

        Raises:
            PlanningError: When the arm moves there.
        """
        if start.velocity.any():
            joint = int(np.abs(start.velocity).argmax())
            amounts: Amounts = {
                "joint": robot.joint_names[joint],
                "velocity": Amount(float(start.velocity[joint]), 1, joint),
            }
            message = "a tool is changed where the arm stands, and {joint} moves with {velocity}"
            hint = "end the move before it at rest: leave `velocity` out of its target"
            raise PlanningError(Problem(message, hint, amounts=amounts))
        return super().plan(start, robot)
