"""Boundary states of a move, and the joint limits that it needs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from trajcli.curves.piecewise import PiecewisePolynomial, constant
from trajcli.errors import Amount, MissingLimitError, PlanningError, Problem, of_joint
from trajcli.kinematics.robot import QUANTITIES, Robot
from trajcli.planners.planner import Planned
from trajcli.trajectory import State

_NOTHING = 1e-15  # rad or m: a move this short is none; a thousandth of what counts as a jump


def standstill(state: State, duration: float, remedies: Mapping[str, str] | None = None) -> Planned:
    """Return the move that stays in `state` for `duration` seconds: zero where the state is not at rest."""
    curve = constant(state.position, duration) if duration else instant(state)
    return Planned(curve, state, remedies=remedies or {})


def instant(state: State) -> PiecewisePolynomial:
    """Return the curve of no length whose derivatives are those of `state`."""
    rows = np.stack([state.acceleration / 2, state.velocity, state.position])
    return PiecewisePolynomial(np.zeros(2), rows[:, None, :])


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
    return PlanningError(of_joint(name, message, hint, {"value": Amount(value, order, joint)}, value=value))


def unknown_duration(planner: str, quantity: str, joints: Sequence[int], robot: Robot) -> MissingLimitError:
    """Return the error that asks for a limit from which the duration of a move follows."""
    why = "to find its fastest duration"
    return missing_limit(planner, quantity, joints, robot, why, "give the move a `duration`")


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
