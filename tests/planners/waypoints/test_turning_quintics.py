"""time_optimal along quintics where all joints turn back at once, against motions of one joint to and fro."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from through_jobs import plan

V, A = 1.0, 5.0


def between_rests(distance):
    """Return the shortest time from rest to rest: a trapezoid of velocity, or a triangle."""
    return distance / V + V / A if distance > V * V / A else 2 * (distance / A) ** 0.5


@pytest.mark.parametrize(
    "turns", [[0.0, 0.873, 0.252, 1.746], [0.0, 1.5, 1.25, 3.0], [0.0, 0.04, -1.2, 0.08], [0.0, 1.0, 0.0]]
)
@pytest.mark.parametrize("direction", [[1.0], [1.0, -0.4, 0.7]])
def test_no_time_is_lost_where_all_joints_turn(turns, direction):
    """All joints move in proportion, and the first one has the whole of its limits from turn to turn."""
    points = [{"joints": row} for row in np.outer(turns, direction).tolist()]
    move = {"planner": "time_optimal", "rule": "quintic", "through": points[1:]}
    made = plan(points[0], move, limits={"velocity": V, "acceleration": A})
    fastest = sum(between_rests(abs(b - a)) for a, b in pairwise(turns))
    assert fastest * (1 - 1e-9) < made.trajectory.duration < 1.005 * fastest
    assert "stretched" not in [event.kind for event in made.events]


def test_the_path_goes_through_its_points_and_its_acceleration_joins():
    points = [{"joints": row} for row in ([0.0, 0.0], [1.0, 0.5], [0.3, -0.2], [0.8, 1.0])]
    move = {"planner": "time_optimal", "rule": "quintic", "through": points[1:]}
    made = plan(points[0], move, limits={"velocity": V, "acceleration": A})
    passed = made.moves[0].planned.via_points
    found = made.trajectory.curve.evaluate(passed.times)
    np.testing.assert_allclose(found, [point["joints"] for point in points], atol=1e-9)
    inner = passed.times[1:-1]
    np.testing.assert_allclose(made.trajectory.curve.evaluate(inner, 1), 0.0, atol=1e-6)
