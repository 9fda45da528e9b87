"""What is said of laws: percentages that are never below the truth, and by whom a bound is set."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.planners.law_events import distance_from_bound, how_found, jerk_events

ROBOT = Robot("r", (Joint("first"), Joint("second")), unlimited(2), None, np.eye(4), np.eye(4))


def motion(duration: float, bound: float, **more: Any) -> Any:
    return SimpleNamespace(law=SimpleNamespace(duration=duration, pieces=7), lower_bound=bound, **more)


@pytest.mark.parametrize("stretch", [1.0, 1.25])
@pytest.mark.parametrize("above", [0.0, 3e-7, 1e-6, 2.5e-6, 0.000123, 0.0101, 0.5, 1.0, 37.0])
def test_a_motion_is_at_most_so_much_above_its_bound_and_hardly_less(above: float, stretch: float) -> None:
    """To two digits, rounded up; what it was slowed down by counts."""
    event = distance_from_bound(motion(3.0 * (1 + above) / stretch, 3.0), ROBOT, stretch)
    said = float(event.message.removeprefix("at most ").partition(" %")[0]) / 100
    assert above * (1 - 1e-9) <= said <= max(1.1 * above, 1e-6)
    assert "limits of velocity and acceleration alone" in event.message
    assert (event.kind, event.amounts["bound"].value, event.amounts["bound"].rounded) == (
        "bound",
        3.0,
        "down",
    )


def test_a_duration_that_rounding_puts_below_its_bound_is_at_it() -> None:
    assert distance_from_bound(motion(3.0 * (1 - 1e-12), 3.0), ROBOT).message.startswith("at most 0 %")


def test_who_sets_the_bound_is_said() -> None:
    of_joint = distance_from_bound(motion(3.0, 2.0, bounding_joint=1, bounded_by_stops=False), ROBOT)
    assert of_joint.message.endswith("{joint} alone needs {bound} between its turning points")
    assert of_joint.amounts["joint"] == "second"
    stops = distance_from_bound(motion(3.0, 2.0, bounding_joint=None, bounded_by_stops=True), ROBOT)
    assert stops.message.endswith("from stop to stop its slowest joints need {bound} in all")
    neither = distance_from_bound(motion(3.0, 2.0, bounding_joint=None, bounded_by_stops=False), ROBOT)
    assert neither.message.endswith("limits of velocity and acceleration alone ask for {bound}")
    assert neither.message.startswith("at most 50 % above")
    assert "nothing is known" in distance_from_bound(motion(3.0, 0.0), ROBOT).message


def test_steps_are_counted() -> None:
    words = "the law has 7 pieces after {} convex step{}"
    for steps, ending in ((1, ""), (2, "s")):
        (event,) = how_found(motion(1.0, 1.0, steps=steps, refinements=0))
        assert event.message == words.format(steps, ending)


def test_refinements_of_a_grid_are_counted() -> None:
    assert not how_found(motion(1.0, 1.0, refinements=0))
    for count, words in ((1, "once"), (2, "2 times")):
        (event,) = how_found(motion(1.0, 1.0, refinements=count, grid=np.zeros(101)))
        assert event.message == f"the grid was refined {words}, to 101 grid points of the path"


def test_joints_whose_jerk_differs_by_direction_are_named() -> None:
    bounds = [np.array(pair) for pair in ((-5.0, 5.0), (-4.0, 5.0), (-5.0, 4.0), (-np.inf, np.inf))]
    (event,) = jerk_events("abcd", bounds)
    assert event.message.startswith("the jerk limit of b, c differs by direction")
    assert jerk_events("ad", [bounds[0], bounds[3]]) == []
