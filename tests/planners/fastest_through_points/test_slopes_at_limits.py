"""Derivatives by states at the edge of the limits, beyond which there is no motion: those a little inside."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.planners.fastest_through_points.position_limits import distances
from trajcli.planners.fastest_through_points.problem import WaypointProblem
from trajcli.planners.fastest_through_points.state_times import durations, state_times

EDGE, INSIDE = 0.999999, 0.9999  # of a limit


def problem_of(points):
    """Return one joint's way through points, with a position limit a little beyond the last."""
    count = len(points)
    fixed = np.zeros((count, 1, 2), dtype=bool)
    fixed[[0, -1]] = True
    bounds = [np.array([[-limit, limit]]) for limit in (1.0, 3.0)]
    position = np.array([[-10.0, max(points) + 0.05]])
    states = np.zeros((count, 1, 2))
    least = np.zeros(count - 1)
    return WaypointProblem(
        np.array(points)[:, None], *bounds, np.array([20.0]), states, fixed, least, position
    )


def states_of(share, edge):
    """Return states that reach so much of a limit at the point between, perhaps by a ramp before or after it."""
    slow = share - 1.5**2 / 40.0
    between = {"velocity": (share, 0.0), "acceleration": (0.0, 3.0 * share)}
    states = np.zeros((3, 1, 2))
    states[1, 0] = {**between, "ramp after": (slow, 1.5), "ramp before": (slow, -1.5)}[edge]
    return states


@pytest.mark.parametrize("edge", ["velocity", "acceleration", "ramp after", "ramp before"])
def test_positions_and_durations_change_as_a_little_inside(edge):
    problem = problem_of([0.0, 1.0, 1.1])
    found = []
    for share in (EDGE, INSIDE):
        states = states_of(share, edge)
        times = 1.2 * durations(problem, states)
        found.append((distances(problem, times, states).slopes, state_times(problem, states).slopes))
    for at_edge, inside in zip(*found, strict=True):
        assert np.abs(inside).max() > 0.1
        assert at_edge == pytest.approx(inside, rel=0.02, abs=0.01)
