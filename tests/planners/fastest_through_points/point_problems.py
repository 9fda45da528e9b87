"""Problems of points whose joints are alike, and ruckig's motions between states at them."""

from __future__ import annotations

from typing import Any

import numpy as np
import ruckig
from numpy.typing import NDArray

from trajcli.planners.fastest_through_points.problem import WaypointProblem

Values = NDArray[np.float64]
VELOCITY, ACCELERATION, JERK = np.array([[-1.0, 1.5]]), np.array([[-3.0, 4.0]]), 20.0


def problem(points: Any, slower: float = 1.0, walls: Any = None, joints: int = 1) -> WaypointProblem:
    """Return a problem of joints alike, `slower` times slower, free at all points but its ends."""
    points = np.reshape(np.asarray(points, dtype=float), (-1, joints))
    fixed = np.zeros((len(points), joints, 2), dtype=bool)
    fixed[[0, -1]] = True
    position = np.tile([-np.inf, np.inf] if walls is None else walls, (joints, 1))
    rates = np.tile(VELOCITY, (joints, 1)), np.tile(ACCELERATION, (joints, 1)), np.full(joints, JERK)
    velocity, acceleration, jerk = (rate / slower**order for order, rate in enumerate(rates, 1))
    least = np.zeros(len(points) - 1)
    return WaypointProblem(
        points, velocity, acceleration, jerk, np.zeros(fixed.shape), fixed, least, position.astype(float)
    )


def by_ruckig(given: WaypointProblem, k: int, joint: int, states: Values, least: float = 0.0) -> Any:
    """Return ruckig's motion of one joint over one segment between states (K + 1, n, 2); None for none."""
    wanted, answer = ruckig.InputParameter(1), ruckig.Trajectory(1)
    (wanted.min_velocity,), (wanted.max_velocity,) = ([[v]] for v in given.velocity[joint])
    (wanted.min_acceleration,), (wanted.max_acceleration,) = ([[a]] for a in given.acceleration[joint])
    wanted.max_jerk = [given.jerk[joint]]
    if least:
        wanted.minimum_duration = least
    wanted.current_position, wanted.target_position = given.points[k : k + 2, joint][:, None].tolist()
    (wanted.current_velocity,), (wanted.target_velocity,) = ([[v]] for v in states[k : k + 2, joint, 0])
    (wanted.current_acceleration,), (wanted.target_acceleration,) = (
        [[a]] for a in states[k : k + 2, joint, 1]
    )
    return answer if ruckig.Ruckig(1).calculate(wanted, answer) == ruckig.Result.Working else None


def times_of(given: WaypointProblem, states: Values) -> list[float]:
    """Return how long each segment lasts between states, by ruckig, where every joint can wait."""
    return [
        max(by_ruckig(given, k, joint, states).duration for joint in range(given.joints))
        for k in range(given.segments)
    ]


def with_states(given: WaypointProblem, inner: Any) -> Values:
    states = np.zeros_like(given.states)
    states[1:-1] = inner
    return states
