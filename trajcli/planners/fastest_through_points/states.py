"""Velocities and accelerations at the points for which the segments between them last least in sum.

Each segment is the fastest motion between the states at its ends, so that limits hold by construction. Its
duration is that of its slowest joint, or of what all joints can last together. The sum is lowered by a
sequence of linear programmes within a trust region.

Source: Nocedal and Wright (2006), chapters 4 and 18.
"""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.planners.fastest_through_points.linear_programme import SegmentProgramme, solved
from trajcli.planners.fastest_through_points.position_limits import distances, leaving
from trajcli.planners.fastest_through_points.problem import WaypointProblem
from trajcli.planners.fastest_through_points.state_times import (
    StateTimes,
    durations,
    state_times,
)

_FAR = 100.0  # for a bound that does not bind, in units of the scales or of the durations
_FIRST, _LARGEST, _SMALLEST = 0.2, 0.5, 1e-4  # trust region, of the scales of the states
_SLOWER, _SLOWINGS = 0.85, 40  # by how much, and how often, a joint that leaves its position limits is slowed
_SHRUNK = 0.4  # of the trust region, after a gain that is poor or none
_PATIENCE, _HOPE = 4, 0.25  # rounds, and the part of what is behind a rival that they must gain
_GOOD, _POOR = 0.7, 0.3  # of the gain that was foreseen
_TIME, _STATE, _RAMP, _WALLS, _WITH_WALLS = 0, 1, 3, 5, 7  # rows of a segment and joint, and how many
_ENOUGH = 1e-6  # relative: a foreseen gain below it is none


@frozen
class StateMotion:
    """States at the points and what they lead to.

    Attributes:
        states: Shape (K + 1, n, 2).
        times: Duration of each segment, shape (K,).
    """

    states: Array
    times: Array

    @property
    def duration(self) -> float:
        """Of the whole motion; infinite where a segment has none."""
        return float(self.times.sum())


def evaluated(problem: WaypointProblem, states: Array) -> StateMotion:
    """Return what states (K + 1, n, 2), moved inside the limits, lead to.

    A segment in which a joint leaves its position limits lasts for ever.
    """
    inside = problem.inside(states)
    times = durations(problem, inside)
    if problem.walled and np.isfinite(times).all():
        times = np.where(leaving(problem, times, inside).any(axis=1), np.inf, times)
    return StateMotion(inside, times)


def within_position_limits(problem: WaypointProblem, states: Array) -> StateMotion:
    """Return what states lead to; joints that leave their position limits are slowed where they do."""
    inside = problem.inside(states)
    times = durations(problem, inside)
    for _ in range(_SLOWINGS if problem.walled and np.isfinite(times).all() else 0):
        wrong = leaving(problem, times, inside)
        if not wrong.any():
            break
        beside = np.zeros(inside.shape[:2], dtype=bool)
        beside[:-1] |= wrong
        beside[1:] |= wrong
        inside = problem.inside(np.where(beside[..., None], inside * [_SLOWER, _SLOWER**2], inside))
        times = durations(problem, inside)
    return evaluated(problem, inside)


def improved(
    problem: WaypointProblem, motion: StateMotion, rival: float = np.inf, rounds: int = 60
) -> StateMotion:
    """Return a motion that lasts no longer, after at most so many linear programmes.

    Args:
        problem: Points and limits.
        motion: To begin with.
        rival: A duration that is known to be possible, s: a motion that nears it too slowly is left.
        rounds: How many linear programmes.
    """
    if problem.segments == 1 or not np.isfinite(motion.duration):
        return motion
    region, survey = _FIRST, state_times(problem, motion.states)
    history = [motion.duration] * _PATIENCE
    for _ in range(rounds):
        late, gained = len(history) > 2 * _PATIENCE, history[-_PATIENCE] - motion.duration
        if region < _SMALLEST or (late and gained < _HOPE * (motion.duration - rival)):
            break
        history.append(motion.duration)
        change, foreseen = _step(problem, motion, survey, region)
        if foreseen <= _ENOUGH * motion.duration:
            break
        other = evaluated(problem, motion.states + change)
        gain = motion.duration - other.duration
        if gain > 0:
            motion = other
            survey = state_times(problem, motion.states)
        if gain >= _GOOD * foreseen:
            region = min(2 * region, _LARGEST)
        elif gain < _POOR * foreseen:
            region *= _SHRUNK
    return motion


def _step(
    problem: WaypointProblem, motion: StateMotion, survey: StateTimes, region: float
) -> tuple[Array, float]:
    """Return the change of the states (K + 1, n, 2) and the gain that it promises."""
    segments, joints = problem.steps.shape
    unit, usual = float(motion.times.mean()), np.maximum(survey.alone.max(axis=1), problem.least)
    count = _WITH_WALLS if problem.walled else _WALLS
    rows = np.zeros((segments, joints, count, 5))
    low, high = np.full((2, segments, joints, count), _FAR) * np.array([-1.0, 1.0])[:, None, None, None]
    free = ~problem.fixed
    both = np.concatenate([free[:-1], free[1:]], axis=2)
    rows[:, :, _TIME, :4], rows[:, :, _TIME, 4] = -survey.slopes / unit * both, 1.0
    low[:, :, _TIME] = np.maximum((survey.alone - usual[:, None]) / unit, -_FAR)
    _fill_state_rows(problem, motion, region, rows, (low, high))
    if problem.walled:
        wall = distances(problem, motion.times, motion.states)
        size = (problem.scales[:, 0] * unit)[:, None]
        rows[:, :, _WALLS:, :4] = wall.slopes / size[..., None] * both[:, :, None]
        rows[:, :, _WALLS + 1] *= -1
        low[:, :, _WALLS:] = np.maximum(-np.maximum(wall.distance, 0.0) / size, -_FAR)
    least = np.maximum((problem.least - usual) / unit, -_FAR)[:, None]
    far = np.full((segments, 1), _FAR)
    programme = SegmentProgramme(rows, low, high, np.ones((segments, 1)), least, far)
    x, s = programme.split(solved(programme, region, exactness=1e-3))
    return x * problem.scales, -float(s.sum()) * unit


def _fill_state_rows(
    problem: WaypointProblem, motion: StateMotion, region: float, rows: Array, bounds: tuple[Array, Array]
) -> None:
    """Write the rows of the states at the points after each segment: trust region and limits."""
    scales, after, states = problem.scales, ~problem.fixed[1:], motion.states[1:]
    low, high = bounds
    for k, limits in enumerate((problem.velocity, problem.acceleration)):
        rows[:, :, _STATE + k, 2 + k] = after[..., k]
        left = (limits - states[..., k, None]) / scales[:, k, None]
        low[:, :, _STATE + k] = np.maximum(left[..., 0], -region)
        high[:, :, _STATE + k] = np.minimum(left[..., 1], region)
    bent = states[..., 1] / problem.jerk * (scales[:, 1] / scales[:, 0])
    used = states[..., 1] ** 2 / (2 * problem.jerk)
    for k, (sign, limit) in enumerate(((1.0, problem.velocity[:, 1]), (-1.0, -problem.velocity[:, 0]))):
        rows[:, :, _RAMP + k, 2], rows[:, :, _RAMP + k, 3] = sign * after[..., 0], bent * after[..., 1]
        high[:, :, _RAMP + k] = np.maximum((limit - sign * states[..., 0] - used) / scales[:, 0], 0.0)
