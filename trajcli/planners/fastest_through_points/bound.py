"""Lower bounds of the duration of motions through points.

The time that each joint needs between the points at which it turns bounds the whole motion, and so does the
sum over segments of what the slowest joint needs at its velocity limit, and the fastest motion of a joint
from start to target that leaves out all points between.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from trajcli.curves.turning_bound import MonotoneStretches, durations_by_joint, turning_points
from trajcli.planners.fastest_through_points.problem import WaypointProblem
from trajcli.planners.fastest_through_points.state_times import alone_times

_SOLVED = 1e-9  # relative: the accuracy of ruckig's durations


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
