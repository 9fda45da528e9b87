"""What planners from one joint state to another share: the target, and the limits they may need.

Stay where the arm stands.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, model_validator

from trajcli.curves.piecewise import Array, constant
from trajcli.errors import Amount, MissingLimitError, PlanningError, Problem
from trajcli.kinematics.robot import QUANTITIES, Limits, Robot
from trajcli.language.numbers import refuse
from trajcli.language.targets import Duration, NamedTarget
from trajcli.planners.planner import Planned, Planner, Resolve
from trajcli.trajectory import State

_NOTHING = 1e-15  # rad or m: a move this short is none; a thousandth of what counts as a jump
_SMALL_POSITION = 1e-3  # rad or m: what goes beyond a position bound smaller than this is relative to this


class PointToPoint(Planner):
    """A planner whose target is a joint state.

    Attributes:
        imposes: Highest derivative that the planner imposes at the target: 0, 1 or 2 (acceleration).
        stops_anywhere: Whether a target may leave the position open.
    """

    imposes: ClassVar[int] = 2
    stops_anywhere: ClassVar[bool] = False

    to: Annotated[NamedTarget, Field(description="The state in which the move ends, or the name of a point.")]

    def with_joint_targets(self, resolve: Resolve, near: Array) -> Self:
        """Return the planner with joints in the place of the target's pose."""
        return self.model_copy(update={"to": resolve(self.to, near)})

    @model_validator(mode="after")
    def _can_impose_target(self) -> PointToPoint:
        if not self.to.is_place and not self.stops_anywhere:
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


def standstill(state: State, duration: float, remedies: Mapping[str, str] | None = None) -> Planned:
    """Return the move that stays in `state`, which is at rest, for `duration` seconds, which may be zero."""
    return Planned(constant(state.position, duration), state, remedies=remedies or {})


def same_state(a: State, b: State) -> bool:
    """Return whether two states are equal: positions up to rounding, velocities and accelerations exactly."""
    apart = _NOTHING + 4 * np.spacing(np.maximum(np.abs(a.position), np.abs(b.position)))
    close = bool((np.abs(a.position - b.position) <= apart).all())
    return close and all(np.array_equal(getattr(a, k), getattr(b, k)) for k in ("velocity", "acceleration"))


def require_rest(planner: str, state: State, robot: Robot, *, where: str = "start") -> None:
    """Refuse a start (or target) that is not at rest.

    Raises:
        PlanningError: Names the first joint that moves.
    """
    for order, values in ((1, state.velocity), (2, state.acceleration)):
        if values.any():
            joint = int(np.flatnonzero(values)[0])
            name, quantity = robot.joint_names[joint], QUANTITIES[order]
            message = f"{planner} {where}s at rest, but the {quantity} of {name} is {{value}} at its {where}"
            hint = "let the move before end at rest, or use quintic or jerk_limited"
            amounts = {"value": Amount(float(values[joint]), order, joint)}
            raise PlanningError(
                Problem(message, hint, joint=name, value=float(values[joint]), amounts=amounts)
            )


def missing_limit(
    planner: str, quantity: str, joints: Sequence[int], robot: Robot, why: str, *also: str
) -> MissingLimitError:
    """Return the error that asks for a limit.

    Args:
        planner: Tag of the planner.
        quantity: The missing one: "velocity", "acceleration" or "jerk".
        joints: Indices of the joints that lack it.
        robot: For the names.
        why: What the limit is needed for.
        also: Other ways out.
    """
    names = ", ".join(robot.joint_names[joint] for joint in joints)
    ways = [f"add `limits: {{{quantity}: ...}}` to the job (a number: null means unlimited)", *also]
    return MissingLimitError(
        Problem(
            f"{planner} needs a limit on the {quantity} of {names} {why}",
            " or ".join(ways),
            joint=robot.joint_names[joints[0]],
        )
    )


def share_of_limits(extremes: Sequence[tuple[Array, Array]], limits: Limits) -> Array:
    """Return how much of its limits a motion uses: above 1 where it breaks one, shape (...).

    Args:
        extremes: Lowest and highest value, each (..., n), of position, velocity, acceleration and jerk.
        limits: Those of the n joints. Position counts as 1 plus what it goes beyond, relative to the bound.
    """
    shares = []
    for order, (low, high) in enumerate(extremes):
        lower, upper = limits.of_order(order).T
        if order:
            shares.append(np.maximum(low / lower, high / upper).max(axis=-1))
            continue
        beyond = np.maximum((lower - low) / _scale(lower), (high - upper) / _scale(upper))
        shares.append(1 + np.maximum(beyond.max(axis=-1), -1.0))
    share: Array = np.max(shares, axis=0)
    return share


def _scale(bound: Array) -> Array:
    return np.where(np.isfinite(bound), np.maximum(np.abs(bound), _SMALL_POSITION), 1.0)


def bound_along(bounds: Array, direction: Array) -> Array:
    """Return the magnitude (n,) of each joint's bound (n, 2) in its direction of motion (n,)."""
    along: Array = np.where(direction < 0, -bounds[:, 0], bounds[:, 1])
    return along


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
        require_rest(self.tag, start, robot)
        return standstill(start, self.duration)
