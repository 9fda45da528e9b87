"""Why there is no such trapezoid, with the interval of what there is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from trajcli.errors import Amount, PlanningError, Problem

if TYPE_CHECKING:
    from trajcli.curves.trapezoid import InfeasibleProfileError
    from trajcli.kinematics.robot import Robot
    from trajcli.planners.trapezoid import Trapezoid

_HINTS = {
    "speed": "choose a velocity inside the interval, or change the duration",
    "acceleration": "raise the acceleration, or the duration",
    "duration": "choose a duration inside the interval",
    "too_fast": "say `overshoot: true`, raise the deceleration, or start slower",
    "too_slow": "raise the acceleration, end slower, or say `overshoot: true`",
    "turns": "say `overshoot: true` and at most one of duration and velocity, or let the arm start and end "
    "in the direction of the motion",
}


def explain_infeasible(
    error: InfeasibleProfileError, joint: int, size: float, move: Trapezoid, robot: Robot
) -> PlanningError:
    """Return the error in terms of one joint.

    Args:
        error: What the profile said, in units of the law.
        joint: The joint that rules.
        size: Joint units per unit of the law.
        move: What was asked for.
        robot: For the names.
    """
    name = robot.joint_names[joint]
    amounts: dict[str, Amount] = {}
    if error.reason in ("speed", "acceleration"):
        order = 1 if error.reason == "speed" else 2
        given = (move.velocity or (0.0,) * 12)[joint] if order == 1 else _acceleration(move, robot, joint)
        amounts = {
            "low": Amount(error.low * size, order, joint),
            "high": Amount(error.high * size, order, joint),
            "given": Amount(given, order, joint),
            "duration": Amount(move.duration or 0.0),
        }
    elif error.reason == "duration":
        amounts = {"low": Amount(error.low), "high": Amount(error.high)}
    elif error.reason in ("too_fast", "too_slow"):
        amounts = {"needed": Amount(error.low * size, 0, joint)}
    message = _message(error, name)
    return PlanningError(Problem(message, _HINTS[error.reason], joint=name, amounts=amounts))


def _message(error: InfeasibleProfileError, name: str) -> str:
    unbounded = error.high == float("inf")
    return {
        "speed": f"no trapezoid of {{duration}}: the velocity of {name} must be above {{low}} "
        "and at most {high}, got {given}",
        "acceleration": f"no trapezoid of {{duration}}: the acceleration of {name} must be at least {{low}}, "
        "got {given}",
        "duration": f"no trapezoid for {name}: its duration must be at least {{low}}"
        + ("" if unbounded else " and at most {high}"),
        "too_fast": f"{name} is too fast to end in the target: it needs {{needed}} to slow down",
        "too_slow": f"{name} cannot reach its end velocity in time: it needs {{needed}} to speed up",
        "turns": f"{name} would have to turn round to start and end with the given velocities",
    }[error.reason]


def _acceleration(move: Trapezoid, robot: Robot, joint: int) -> float:
    if move.acceleration is not None:
        return move.acceleration[joint]
    return float(abs(robot.limits.acceleration[joint]).min())
