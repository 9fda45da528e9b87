"""Boundary states of a move, and the joint limits that it needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from trajcli.curves.piecewise import Array, constant
from trajcli.errors import Amount, Amounts, MissingLimitError, PlanningError, Problem
from trajcli.kinematics.robot import QUANTITIES, Limits, Robot
from trajcli.planners.planner import Planned
from trajcli.trajectory import State

_NOTHING = 1e-15  # rad or m: a move this short is none; a thousandth of what counts as a jump
_SMALL_POSITION = 1e-3  # rad or m: what goes beyond a position bound smaller than this is relative to this


def standstill(state: State, duration: float, remedies: Mapping[str, str] | None = None) -> Planned:
    """Return the move that stays in `state`, which is at rest, for `duration` seconds, which may be zero."""
    return Planned(constant(state.position, duration), state, remedies=remedies or {})


def same_state(a: State, b: State) -> bool:
    """Return whether two states are equal: positions up to rounding, velocities and accelerations exactly."""
    apart = _NOTHING + 4 * np.spacing(np.maximum(np.abs(a.position), np.abs(b.position)))
    close = bool((np.abs(a.position - b.position) <= apart).all())
    return close and all(np.array_equal(getattr(a, k), getattr(b, k)) for k in ("velocity", "acceleration"))


def start_in_motion(planner: str, start: State, robot: Robot) -> PlanningError:
    """Return the error of a start that is not at rest; it names the first joint that moves."""
    order, values = (1, start.velocity) if start.velocity.any() else (2, start.acceleration)
    joint = int(np.flatnonzero(values)[0])
    name, quantity, value = robot.joint_names[joint], QUANTITIES[order], float(values[joint])
    message = f"{planner} starts at rest, but the {quantity} of {{joint}} is {{value}} at its start"
    hint = "let the move before end at rest, or use quintic or jerk_limited"
    amounts: Amounts = {"joint": name, "value": Amount(value, order, joint)}
    return PlanningError(Problem(message, hint, joint=name, value=value, amounts=amounts))


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
        also: Other remedies.
    """
    names = ", ".join(robot.joint_names[joint] for joint in joints)
    remedies = [f"add `limits: {{{quantity}: ...}}` to the job (a number: null means unlimited)", *also]
    return MissingLimitError(
        Problem(
            f"{planner} needs a limit on the {quantity} of {names} {why}",
            " or ".join(remedies),
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
