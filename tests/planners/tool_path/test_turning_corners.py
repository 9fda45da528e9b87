"""Corners through which the tool's rotation changes its rate: what a law must leave for that, by dense rows."""

from __future__ import annotations

from math import cos, sin, sqrt

import numpy as np
import pytest
from tool_jobs import START, planned, times_of, tool_rates

MOST = 2.0  # rad/s^2
FREE = {
    "velocity": 100.0,
    "acceleration": 1e4,
    "jerk": None,
    "tcp": {"speed": 5.0, "acceleration": 100.0, "angular_speed": 20.0, "angular_acceleration": MOST},
}


def turning(turns, lengths, bend, radius, shape="trapezoid"):
    """Return the plan of two lines with a bend between them, along which the tool turns about the vertical."""
    corner = np.array(START["xyz"]) + np.array([0.0, lengths[0], 0.0])
    end = corner + lengths[1] * np.array([sin(bend), cos(bend), 0.0])
    segments = [
        {"line": {"xyz": place.tolist(), "rpy": [np.pi, 0.0, yaw]}}
        for place, yaw in zip((corner, end), np.cumsum(turns).tolist(), strict=True)
    ]
    move = {"planner": "path", "radius": radius, "segments": segments, "law": {"shape": shape}}
    return planned("ur5e", START, move, limits=FREE)


def peak(made):
    """Return the largest angular acceleration, from the joints alone."""
    return tool_rates(made, times_of(made, 4001))[3].max()


@pytest.mark.full
@pytest.mark.parametrize("shape", ["trapezoid", "quintic", "cycloidal"])
def test_a_rate_that_grows_while_the_law_speeds_up(shape):
    """About one axis a rate that grows with the way, and a speed that grows with time, add up.

    The whole first segment and as much of the second one is a corner, and the ramps are long. Yet the law is not slow:
    it takes no more than four times what a turn by as much takes at least.
    """
    for turns in ((0.1, 0.8), (0.8, 0.1)):
        lengths = (0.1, 0.2) if turns[0] < turns[1] else (0.2, 0.1)
        made = turning(turns, lengths, 0.1, 0.9, shape)
        assert made.verdict.passed
        assert peak(made) <= MOST * (1 + 1e-9)
        assert made.trajectory.duration <= 4 * 2 * sqrt(sum(turns) / MOST)


@pytest.mark.parametrize("shape", ["trapezoid", "quintic", "cycloidal"])
def test_a_rate_that_changes_at_full_speed(shape):
    """A small corner between long segments: it is passed at a speed that needs most of the limit, and no more."""
    made = turning((0.4, -0.4), (0.3, 0.3), 0.3, 0.05, shape)
    assert made.verdict.passed
    assert 0.5 * MOST <= peak(made) <= MOST * (1 + 1e-9)
