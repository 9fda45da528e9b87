"""Durations of the fastest motions between the states at points, and their derivatives by the states.

Ruckig takes many joints at once, each by itself where none waits for another: all states of a list, and all
that differences need, cost one call.

What a joint needs between the points at which it turns bounds the whole motion, and so does the sum over
segments of what the slowest joint needs at its velocity limit, and the fastest motion of a joint from start
to target that leaves out all points between.

Source: Berscheid and Kroeger (2021).
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.curves.turning_bound import MonotoneStretches, durations_by_joint, turning_points
from trajcli.frozen import frozen
from trajcli.planners.fastest_through_points.problem import WaypointProblem

_ROOM = 1 + 1e-9  # of a limit: what is outside by less is left to ruckig
_DIFFERENCE = 1e-5  # of the scale of a state
_SOLVED = 1e-9  # relative: the accuracy of ruckig's durations


@frozen
class StateTimes:
    """What the states at the points mean for the durations.

    Attributes:
        alone: Fastest of each joint by itself, shape (K, n).
        slopes: Of `alone` by velocity and acceleration before and after, in units of their scales, shape
            (K, n, 4).
    """

    alone: Array
    slopes: Array


def durations(problem: WaypointProblem, states: Array) -> Array:
    """Return the shortest common duration (K,) of each segment between states (K + 1, n, 2).

    Infinite where ruckig finds no motion.
    """
    import ruckig

    n = problem.joints
    solver, answer, wanted = ruckig.Ruckig(n), ruckig.Trajectory(n), ruckig.InputParameter(n)
    set_limits(wanted, problem.velocity, problem.acceleration, problem.jerk)
    wanted.current_position = [0.0] * n
    velocities, accelerations = states[..., 0].tolist(), states[..., 1].tolist()
    found = []
    for k, (step, least) in enumerate(zip(problem.steps.tolist(), problem.least.tolist(), strict=True)):
        wanted.target_position = step
        wanted.current_velocity, wanted.target_velocity = velocities[k], velocities[k + 1]
        wanted.current_acceleration, wanted.target_acceleration = accelerations[k], accelerations[k + 1]
        wanted.minimum_duration = least or None
        try:
            result = solver.calculate(wanted, answer)
        except (ruckig.RuckigError, ValueError):
            found.append(np.inf)
            continue
        found.append(answer.duration if result == ruckig.Result.Working else np.inf)
    return np.array(found)


def state_times(problem: WaypointProblem, states: Array) -> StateTimes:
    """Return the durations between states (K + 1, n, 2) inside the limits, and their derivatives."""
    segments, joints = problem.steps.shape
    scales = problem.scales
    pairs = np.concatenate([states[:-1], states[1:]], axis=2)
    moves = np.zeros((9, segments, joints, 4))
    for k in range(4):
        moves[1 + 2 * k, ..., k], moves[2 + 2 * k, ..., k] = 1, -1
    sizes = _DIFFERENCE * np.concatenate([scales, scales], axis=1)
    trial = np.clip(pairs + moves * sizes, *_box(problem))
    steps = np.broadcast_to(problem.steps, trial.shape[:3])
    times = alone_times(problem, steps, trial)
    finite = np.isfinite(times)  # beyond the limits there is none: then the other side alone says it
    trial, times = np.where(finite[..., None], trial, trial[0]), np.where(finite, times, times[0])
    spans = np.stack([(trial[1 + 2 * k] - trial[2 + 2 * k])[..., k] for k in range(4)], axis=2)
    changes = np.stack([times[1 + 2 * k] - times[2 + 2 * k] for k in range(4)], axis=2)
    spans = spans / np.concatenate([scales, scales], axis=1)
    slopes = np.where(np.isfinite(changes) & (spans > 0), changes / np.where(spans > 0, spans, 1.0), 0.0)
    return StateTimes(times[0], slopes)


def _box(problem: WaypointProblem) -> tuple[Array, Array]:
    rows = np.stack([problem.velocity, problem.acceleration], axis=1)  # (n, 2, 2)
    both = np.concatenate([rows, rows], axis=1)
    return both[..., 0], both[..., 1]


def alone_times(problem: WaypointProblem, steps: Array, pairs: Array) -> Array:
    """Return the fastest duration of each joint by itself.

    Args:
        problem: Limits.
        steps: Displacements, shape (..., n).
        pairs: Velocity and acceleration before, then after, shape (..., n, 4).

    Returns:
        Shape (..., n); infinite where ruckig finds no motion.
    """
    shape = steps.shape
    count = int(np.prod(shape[:-1]))
    jerk = problem.jerk[:, None]
    limits = np.concatenate([problem.velocity, problem.acceleration, -jerk, jerk], axis=1)
    rows = np.tile(limits, (count, 1))
    return fastest_durations(steps.reshape(-1), pairs.reshape(-1, 4), rows).reshape(shape)


def fastest_durations(steps: Array, pairs: Array, limits: Array) -> Array:
    """Return the shortest durations (N,) of motions of one variable each; infinite where there is none.

    Args:
        steps: Displacements, shape (N,).
        pairs: Velocity and acceleration before, then after, shape (N, 4).
        limits: Lower and upper bounds of velocity, acceleration and jerk, shape (N, 6); of the jerk the upper
            one holds both ways.
    """
    possible = np.flatnonzero(reachable(pairs[:, 2:], limits))
    found, own = np.full(steps.size, np.inf), np.empty(possible.size)
    if possible.size:
        _fill(own, steps[possible], pairs[possible], limits[possible], slice(0, possible.size))
    found[possible] = own
    return found


def reachable(states: Array, limits: Array) -> NDArray[np.bool_]:
    """Return whether states (N, 2) can be reached from within limits: else ruckig refuses a whole call.

    An acceleration a that was built up from zero changed the velocity by a |a| / (2 jerk).
    """
    velocity, acceleration = states.T
    before = velocity - acceleration * np.abs(acceleration) / (2 * limits[:, 5])
    low, high = limits[:, 0], limits[:, 1]
    within = (low * _ROOM <= before) & (before <= high * _ROOM)
    return np.asarray(within & (low * _ROOM <= velocity) & (velocity <= high * _ROOM))


def common_duration(steps: Array, pairs: Array, limits: Array) -> float:
    """Return the shortest duration in which all joints arrive together, s; infinite where there is none.

    Args:
        steps: Displacements, shape (n,).
        pairs: Velocity and acceleration before, then after, shape (n, 4).
        limits: As for `fastest_durations`, shape (n, 6).
    """
    answer = _answer(_asked(steps, pairs, limits))
    return np.inf if answer is None else float(answer.duration)


def _asked(steps: Array, pairs: Array, limits: Array) -> Any:  # noqa: ANN401 (ruckig has no types)
    """Return ruckig's input for joints from position zero."""
    import ruckig

    wanted = ruckig.InputParameter(steps.size)
    set_limits(wanted, limits[:, :2], limits[:, 2:4], limits[:, 5])
    wanted.current_position, wanted.target_position = [0.0] * steps.size, steps.tolist()
    columns = pairs.T.tolist()
    wanted.current_velocity, wanted.current_acceleration = columns[0], columns[1]
    wanted.target_velocity, wanted.target_acceleration = columns[2], columns[3]
    return wanted


def _answer(wanted: Any) -> Any:  # noqa: ANN401
    """Return ruckig's trajectory for an input; None where it has none."""
    import ruckig

    count = wanted.degrees_of_freedom
    answer = ruckig.Trajectory(count)
    with suppress(ruckig.RuckigError, ValueError):
        if ruckig.Ruckig(count).calculate(wanted, answer) == ruckig.Result.Working:
            return answer
    return None


def _fill(found: Array, steps: Array, pairs: Array, limits: Array, part: slice) -> None:
    """Write the durations of a part; one that has no motion spoils a call, so that a part is halved."""
    import ruckig

    count = part.stop - part.start
    wanted = _asked(steps[part], pairs[part], limits[part])
    wanted.synchronization = ruckig.Synchronization.No
    answer = _answer(wanted)
    if answer is not None:
        found[part] = answer.independent_min_durations
    elif count == 1:
        found[part] = np.inf
    else:
        middle = part.start + count // 2
        _fill(found, steps, pairs, limits, slice(part.start, middle))
        _fill(found, steps, pairs, limits, slice(middle, part.stop))


def set_limits(wanted: Any, velocity: Array, acceleration: Array, jerk: Array) -> None:  # noqa: ANN401
    """Give ruckig's input the limits of its joints, (n, 2), (n, 2) and (n,)."""
    wanted.min_velocity, wanted.max_velocity = velocity.T.tolist()
    wanted.min_acceleration, wanted.max_acceleration = acceleration.T.tolist()
    wanted.max_jerk = jerk.tolist()


def shortest_duration(problem: WaypointProblem) -> tuple[float, int | None]:
    """Return a proven lower bound of the duration, s, and the joint that needs it; None: several together."""
    problem = replace(problem, jerk=problem.jerk * problem.looser)
    ends = np.concatenate([problem.states[0], problem.states[-1]], axis=1)
    direct = alone_times(problem, problem.points[-1] - problem.points[0], ends)
    direct = np.where(np.isfinite(direct), direct * (1 - _SOLVED), 0.0)
    between_turns = durations_by_joint([_stretches(problem, joint) for joint in range(problem.joints)])
    by_joint = np.maximum(between_turns, direct).tolist()
    together = float(problem.times_at_speed.sum())
    worst = int(np.argmax(by_joint))
    if by_joint[worst] >= together:
        return by_joint[worst], worst
    return together, None


def _stretches(problem: WaypointProblem, joint: int) -> MonotoneStretches:
    turns = turning_points(problem.points[:, joint])
    steps = np.diff(turns, prepend=turns[0])
    ends = problem.states[[0, -1], joint]
    along = ends[:, 0] * np.sign(steps[[min(1, steps.size - 1), -1]])
    bounds = problem.velocity[joint], problem.acceleration[joint], problem.jerk[joint] * np.array([-1.0, 1.0])
    return MonotoneStretches.between(turns, bounds, np.maximum(along, 0.0), (ends != 0.0).any(axis=1))
