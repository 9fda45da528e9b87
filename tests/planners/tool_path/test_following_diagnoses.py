"""Why an arm cannot follow: a lift with a turning arm of length a, of which everything is known.

Its tool is at x = a cos(turn), z = lift + a sin(turn): along x the arm turns by dx / (a sin) and the lift goes
by cot(turn) dx, and at x = a it is stretched out.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from trajcli.errors import PlanningError, Problem
from trajcli.job.read import job_from_text
from trajcli.planning.plan import plan_job

LAW = "{speed: 1, acceleration: 1}"
FASTEST = "{shape: time_optimal}"


def refusal(
    x: float, length: float = 2.0, turn: float = 60.0, lift: str = "", arm: str = "", law: str = LAW
) -> Problem:
    """Return why the tool cannot go along x to a place from where the arm stands, the lift at zero."""
    z = float(length * np.sin(np.radians(turn)))
    text = f"""
version: 1
units: {{angle: deg, length: m}}
robot:
  convention: standard
  joints: [{{name: lift, type: prismatic, alpha: 90{lift}}}, {{name: turn, a: {length}{arm}}}]
limits: {{velocity: 1e4, acceleration: 1e4, jerk: null}}
start: {{joints: [0, {turn}]}}
moves: [{{planner: line, to: {{xyz: [{x!r}, 0, {z!r}]}}, law: {law}}}]
"""
    with pytest.raises(PlanningError) as caught:
        plan_job(job_from_text(text))
    return caught.value.problems[0]


@pytest.mark.parametrize(
    ("turn", "length", "name", "unit", "law"),
    [
        (60.0, 2.0, "lift", "m", LAW),
        (60.0, 0.5, "turn", "rad", FASTEST),
        (-60.0, 2.0, "lift", "m", FASTEST),
        (-60.0, 0.5, "turn", "rad", LAW),
    ],
)
def test_the_joint_that_goes_fastest_into_a_singularity_is_named(
    turn: float, length: float, name: str, unit: str, law: str
) -> None:
    problem = refusal(length, length, turn, law=law)
    assert problem.joint == name
    said = re.search(
        r"singularity at s = (\S+) m: there (\S+) would have to go (\S+) (\S+) for each m of the path \(smallest",
        problem.message,
    )
    assert said is not None, problem.message
    place, joint, rate, shown = said.groups()
    assert float(place) == pytest.approx(0.5 * length, rel=1e-4)
    angle = np.arccos((0.5 * length + float(place)) / length)
    expected = 1 / np.tan(angle) if name == "lift" else 1 / (length * np.sin(angle))
    assert float(rate) == pytest.approx(expected, rel=0.02)
    assert (joint, shown) == (name, unit)


@pytest.mark.full
def test_a_place_beyond_the_reach_is_missed_by_what_lies_beyond() -> None:
    problem = refusal(2.5)
    said = re.search(r"beyond s = (\S+) m: it stays up to (\S+) m away", problem.message)
    assert said is not None, problem.message
    assert (float(said[1]), float(said[2])) == (pytest.approx(1.0, abs=1e-5), pytest.approx(0.5))
    assert "direction" not in (problem.hint or "")


@pytest.mark.parametrize(
    ("fields", "joint", "value", "limit", "law"),
    [
        ({"lift": ", position: [-3, 1]"}, "lift", 1.1075510, 1.0, LAW),
        ({"turn": -60.0, "lift": ", position: [-1, 3]"}, "lift", -1.1075510, -1.0, FASTEST),
        ({"arm": ", position: [20, 90]"}, "turn", 18.194872, 20, FASTEST),
        ({"turn": -60.0, "arm": ", position: [-90, -20]"}, "turn", -18.194872, -20, LAW),
        ({"lift": ", position: [-3, 1.1]", "arm": ", position: [25, 90]"}, "turn", 18.194872, 25, FASTEST),
        ({"lift": ", position: [-3, 0.9]", "arm": ", position: [18.1, 90]"}, "lift", 1.1075510, 0.9, LAW),
        ({"lift": ", position: [-3, 0.9]", "arm": ", position: [19, 90]"}, "lift", 1.1075510, 0.9, FASTEST),
    ],
)
def test_the_joint_that_is_furthest_beyond_its_range_is_named(
    fields: dict[str, Any], joint: str, value: float, limit: float, law: str
) -> None:
    """At x = 1.9 the arm stands at acos(0.95), and the lift has gone 2 (sin(60 deg) - sin of that)."""
    problem = refusal(1.9, **fields, law=law)
    said = re.search(
        r"(\S+) would be at (\S+) (\S+) at s = (\S+) m of the path, its limit is (\S+) (\S+)$",
        problem.message,
    )
    assert said is not None, problem.message
    unit = {"lift": "m", "turn": "deg"}[joint]
    assert (said[1], problem.joint, said[3], said[6]) == (joint, joint, unit, unit)
    numbers = [float(said[k]) for k in (2, 4, 5)]
    assert numbers == [pytest.approx(value, rel=1e-5), pytest.approx(0.9), pytest.approx(limit)]


@pytest.mark.parametrize("law", [LAW, FASTEST])
def test_a_range_that_is_left_on_the_way_is_left_where_the_joint_is_farthest(law: str) -> None:
    """Through the middle: at x = 0 the arm stands upright, and the lift is lowest."""
    problem = refusal(-0.8, lift=", position: [-0.2, 3]", law=law)
    said = re.search(
        r"lift would be at (\S+) m at s = (\S+) m of the path, its limit is -0.2 m", problem.message
    )
    assert said is not None, problem.message
    assert float(said[1]) == pytest.approx(2 * np.sin(np.radians(60)) - 2, abs=1e-5)
    assert float(said[2]) == pytest.approx(1.0, abs=1e-3)
