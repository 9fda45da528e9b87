"""Laws of lines beside zones: what they name is kept on the way to a corner that is flown by, and behind it.

The tool of planar2r goes where the textbook says; along a straight line its rates are differences of its places.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest
from tiers import few

from trajcli.job.read import job_from_text
from trajcli.planning.plan import Plan, plan_job

CORNER, END = np.array([0.300748, 0.392283]), np.array([0.154969, 0.392283])
JOINTS = [0.3, 1.2]
FREE = {"velocity": 3, "acceleration": 20}


def place(q: np.ndarray) -> np.ndarray:
    """Return the place of the tool of planar2r, m."""
    both = q.sum(axis=-1)
    arms = (0.3 * np.cos(q[..., 0]) + 0.2 * np.cos(both), 0.3 * np.sin(q[..., 0]) + 0.2 * np.sin(both))
    return np.stack(arms, axis=-1)


def flown(*laws: dict[str, Any], limits: dict[str, Any] = FREE) -> Plan:
    """Return the plan of two lines that fly by the corner between them."""
    job = {
        "version": 1,
        "robot": "planar2r",
        "limits": limits,
        "zone": 0.02,
        "start": {"joints": JOINTS},
        "moves": [
            {"planner": "line", "to": {"xyz": [*to, 0]}, "law": law}
            for to, law in zip((CORNER.tolist(), END.tolist()), laws, strict=True)
        ],
    }
    return plan_job(job_from_text(json.dumps(job)))


def rates(plan: Plan, number: int) -> tuple[np.ndarray, np.ndarray]:
    """Return speeds and accelerations along a line, where the tool is outside of the zone."""
    assert plan.flyby is not None
    (zone,) = plan.flyby.zones
    first, last = ((0.0, zone.entered), (zone.left, plan.trajectory.duration))[number]
    times = np.linspace(first, last, 4001)
    places = place(plan.trajectory.curve.evaluate(times))
    ends = (place(np.array(JOINTS)), CORNER), (CORNER, END)
    along = (ends[number][1] - ends[number][0]) / np.linalg.norm(ends[number][1] - ends[number][0])
    s = (places - ends[number][0]) @ along
    return np.gradient(s, times), np.diff(s, 2) / (times[1] - times[0]) ** 2


@pytest.mark.parametrize(("number", "jerk"), few([(0, None), (0, 600), (1, None), (1, 600)], 2))
def test_the_deceleration_that_a_law_names_is_kept_beside_a_zone(number: int, jerk: float | None) -> None:
    """Slowing down alone is slower than the other acceleration, and no bound is above the motion."""
    laws = [{"speed": 0.5, "acceleration": 2.0}, {"speed": 0.5, "acceleration": 2.0}]
    laws[number]["deceleration"] = 0.4
    plan = flown(*laws, limits={**FREE, "jerk": jerk})
    _, changes = rates(plan, number)
    assert changes.min() > -0.4 * (1 + 1e-3)
    assert changes.max() <= 2.0 * (1 + 1e-3)
    assert (np.abs(changes + 0.4) < 4e-3).mean() > 0.5
    assert changes.max() > 1.9
    assert rates(plan, 1 - number)[1].min() < -1.9
    assert plan.flyby is not None
    assert plan.flyby.second_order is not None
    assert plan.flyby.second_order <= plan.trajectory.duration


def test_a_deceleration_says_nothing_of_a_turn_in_place() -> None:
    """It is one of a length: 0.01 m/s^2 is no 0.01 rad/s^2, beside a zone as elsewhere."""
    law = {"angular_speed": 1.0, "angular_acceleration": 5.0, "deceleration": 0.01}
    turn = {"planner": "line", "to": {"from": "here", "offset": {"rpy": [0, 0, 0.5]}}, "law": law}
    job = {"version": 1, "robot": "ur5e", "start": {"joints": [0, -1.5, 1.5, -1.5, -1.5, 0]}, "moves": [turn]}
    plan = plan_job(job_from_text(json.dumps(job)))
    (move,) = plan.moves
    course = move.planner.course(move.start.position, move.robot, move.planned)
    assert plan.trajectory.duration == pytest.approx(0.5 / 1.0 + 1.0 / 5.0, rel=1e-9)
    assert course.limits_along == (1.0, 5.0, 5.0)
    assert course.bounds(course.rates(np.array([0.2])))(np.zeros((1, 2)))[0, 2] == pytest.approx(-5.0)


def speeds_in_zone(plan: Plan) -> np.ndarray:
    """Return how fast the tool goes within the zone, by differences of its places, m/s."""
    assert plan.flyby is not None
    (zone,) = plan.flyby.zones
    times = np.linspace(zone.entered, zone.left, 2001)
    places = place(plan.trajectory.curve.evaluate(times))
    return np.linalg.norm(np.diff(places, axis=0), axis=1) / (times[1] - times[0])


@pytest.mark.full
@pytest.mark.parametrize("speeds", few([(0.1, 0.15), (0.15, 0.1)], 1))
def test_in_a_zone_the_higher_of_the_speeds_that_two_laws_name_is_kept(speeds: tuple[float, float]) -> None:
    """Joints alone would go far faster there; a law that names none leaves it to them."""
    laws = [{"speed": speed, "shape": "time_optimal"} for speed in speeds]
    plan = flown(*laws, limits={**FREE, "jerk": 200})
    inside = speeds_in_zone(plan)
    assert inside.max() <= 0.15 * (1 + 1e-6)
    assert inside.max() > 0.12
    free = flown(laws[0], {"shape": "time_optimal"}, limits={**FREE, "jerk": 200})
    assert speeds_in_zone(free).max() > 0.2
    assert free.flyby is not None
    assert plan.flyby is not None
    assert plan.trajectory.duration < plan.flyby.stopping * 0.99


@pytest.mark.full
def test_a_zone_at_a_low_speed_of_the_tool_is_flown_by_nearly_at_that_speed() -> None:
    """The way is no shorter than what lies outside of the ball and a chord of it, at 100 mm/s."""
    law = {"shape": "time_optimal", "speed": 100}
    job = {
        "version": 1,
        "units": {"angle": "deg", "length": "mm"},
        "robot": "ur5e",
        "limits": {"acceleration": 800, "jerk": 8000},
        "zone": 50,
        "start": {"xyz": [400, 100, 250], "rpy": [180, 0, 0], "configuration": {"elbow": "up"}},
        "moves": [
            {"planner": "line", "to": {"xyz": xyz}, "law": law}
            for xyz in ([400, -100, 250], [600, -100, 250])
        ],
    }
    plan = plan_job(job_from_text(json.dumps(job)))
    least = (150 + 150 + 50 * np.sqrt(2)) / 100
    assert least < plan.trajectory.duration < 1.05 * least
