"""Moves from one joint state to another, and the standstill."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal, Self

from pydantic import Field, model_validator

from trajcli.curves.piecewise import Array
from trajcli.kinematics.robot import Robot
from trajcli.language.numbers import refuse
from trajcli.language.points import NamedTarget
from trajcli.language.targets import Duration
from trajcli.planners.boundary_states import standstill, start_in_motion
from trajcli.planners.planner import Planned, Planner, Resolve
from trajcli.trajectory import State


class PointToPoint(Planner):
    """A planner whose target is a joint state.

    Attributes:
        imposes: Highest derivative that the planner imposes at the target: 0, 1 or 2 (acceleration).
        stops_anywhere: Whether a target may leave the position open.
    """

    imposes: ClassVar[int] = 2
    stops_anywhere: ClassVar[bool] = False
    smoother: ClassVar[Mapping[str, Mapping[str, Any]]] = {
        "jerk_limited": {"planner": "jerk_limited"},
        "quintic": {"planner": "quintic"},
    }

    to: Annotated[NamedTarget, Field(description="The state in which the move ends, or the name of a point.")]

    def with_joint_targets(self, resolve: Resolve, near: Array) -> Self:
        """Return the planner with joints in the place of the target's pose."""
        return self.model_copy(update={"to": resolve(self.to, near)})

    @model_validator(mode="after")
    def _can_impose_target(self) -> PointToPoint:
        if not self.to.gives_joints_or_pose and not self.stops_anywhere:
            raise refuse(
                [
                    (
                        ("to",),
                        f"{self.tag} needs `joints` or a pose in its target",
                        "jerk_limited can stop anywhere",
                    )
                ]
            )
        for order, name in ((1, "velocity"), (2, "acceleration")):
            if order > self.imposes and any(getattr(self.to, name) or ()):
                instead = "use quintic or jerk_limited, or leave it out"
                raise refuse([(("to", name), f"{self.tag} does not impose the {name} at its end", instead)])
        return self


class Hold(Planner):
    """Hold the position for a given time; starts and ends at rest."""

    continuity: ClassVar[Literal[1, 2]] = 1

    planner: Literal["hold"] = "hold"
    duration: Duration

    def plan(self, start: State, robot: Robot) -> Planned:
        """Return the standstill.

        Raises:
            PlanningError: When the arm moves at the start.
        """
        if not start.at_rest:
            raise start_in_motion(self.tag, start, robot)
        return standstill(start, self.duration)
