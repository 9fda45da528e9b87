"""Entries between moves: payload, tool and signals change where the arm stands, in no time."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any, ClassVar, Literal

import numpy as np
from pydantic import Field
from pydantic.json_schema import SkipJsonSchema

from trajcli.curves.piecewise import constant
from trajcli.errors import Amount, PlanningError, of_joint
from trajcli.kinematics.robot import MountedTool, Payload, Robot
from trajcli.language.dynamics import NamedTool, PayloadSpec
from trajcli.language.numbers import FlawError, Model, Number
from trajcli.language.signals import SignalName
from trajcli.planners.planner import Planned, Planner
from trajcli.trajectory import State
from trajcli.units import Quantity


class BetweenMoves(Planner):
    """A change where the arm is and as it moves there, such as of what the tool carries."""

    continuity: ClassVar[Literal[1, 2]] = 2
    handles: ClassVar[bool] = True
    needs_geometry: ClassVar[str] = "a payload"
    at: ClassVar[Any] = None  # type: ignore[misc]
    zone: ClassVar[Any] = None  # type: ignore[misc]
    # what would say how to move stands beside a planner only
    limits: ClassVar[Any] = None  # type: ignore[misc]
    when_over_limit: ClassVar[Any] = None  # type: ignore[misc]

    def equipped(self, robot: Robot) -> Robot:
        """Return the robot with what its tool carries from here on.

        Raises:
            FlawError: When it takes up a second payload, or leaves what is not there.
        """
        return replace(robot, payload=self.carried_after(robot.payload))

    def plan(self, start: State, robot: Robot) -> Planned:
        """Return the curve of no length."""
        del robot
        return Planned(constant(start.position, 0.0), start, no_lower_bound="it does not move")


class Attach(BetweenMoves):
    """From here on the tool carries a payload."""

    planner: SkipJsonSchema[Literal["attach"]] = Field("attach", exclude=True)
    attach: Annotated[PayloadSpec, Field(description="What the tool carries from here on.")]

    def carried_after(self, payload: Payload | None) -> Payload | None:
        """Return its own payload.

        Raises:
            FlawError: When the tool carries one already.
        """
        if payload is not None:
            text = f"the tool carries {payload.mass:g} kg already"
            raise FlawError(text, "attach", hint="write `- {detach: {}}` before it")
        return self.attach.as_payload()


class Empty(Model):
    """No fields: what is left is what was attached."""


class Detach(BetweenMoves):
    """From here on the tool carries nothing."""

    planner: SkipJsonSchema[Literal["detach"]] = Field("detach", exclude=True)
    detach: Annotated[Empty, Field(description="Nothing: what is left is what was attached.")]

    def carried_after(self, payload: Payload | None) -> Payload | None:
        """Return that there is no payload.

        Raises:
            FlawError: When there was none before.
        """
        if payload is None:
            text = "nothing is attached here that could be detached"
            raise FlawError(text, "detach", hint="attach a payload in a move before it")
        return None


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
            amounts = {"velocity": Amount(float(start.velocity[joint]), 1, joint)}
            message = "a tool is changed where the arm stands, and {joint} moves with {velocity}"
            hint = "end the move before it at rest: leave `velocity` out of its target"
            raise PlanningError(of_joint(robot.joint_names[joint], message, hint, amounts))
        return super().plan(start, robot)


class SetSignal(BetweenMoves):
    """A signal has a value from here on."""

    needs_geometry: ClassVar[str] = ""

    planner: SkipJsonSchema[Literal["signal"]] = Field("signal", exclude=True)
    signal: Annotated[str, SignalName("Name of the signal."), Field(description="Name of the signal.")]
    value: Annotated[float, Number(Quantity("ratio"), "What it is from here on.")]
