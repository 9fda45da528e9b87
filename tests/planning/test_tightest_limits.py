"""The limit of which a move uses most: peaks in closed form over their bounds, by direction and by joint."""

from __future__ import annotations

import json
from typing import Any

import pytest

from trajcli.job.read import job_from_text
from trajcli.planning.binding_limits import tightest_limit, tightest_of_move, tightest_of_moves
from trajcli.planning.plan import Plan, plan_job

BARS = [{"name": "a", "a": 0.5}, {"name": "b", "a": 0.4}]


def planned(moves: list[dict[str, Any]], limits: dict[str, Any]) -> Plan:
    """Return the plan of moves of two joints from [0, 0]."""
    arm = {"convention": "standard", "joints": BARS}
    job = {"version": 1, "robot": arm, "start": {"joints": [0, 0]}, "moves": moves, "limits": limits}
    return plan_job(job_from_text(json.dumps(job)))


def quintic(to: list[float], duration: float) -> dict[str, Any]:
    """Its peaks: 15/8 D/T, 10/sqrt(3) D/T^2, and 60 D/T^3 at both ends."""
    return {"planner": "quintic", "to": {"joints": to}, "duration": duration}


VELOCITY, ACCELERATION, JERK = 15 / 8, 10 / 3**0.5, 60.0


@pytest.mark.parametrize(
    ("to", "limits", "quantity", "joint", "used"),
    [
        ([1, 2], {"velocity": 5}, "velocity", "b", VELOCITY * 2 / 5),
        ([-2, 1], {"velocity": 5}, "velocity", "a", VELOCITY * 2 / 5),
        ([-1, 1], {"velocity": [[-3, 9], [-9, 5]]}, "velocity", "a", VELOCITY / 3),
        ([1, -1], {"velocity": [[-3, 9], [-4, 50]]}, "velocity", "b", VELOCITY / 4),
        ([1, 0.1], {"velocity": 5, "acceleration": 10, "jerk": 1000}, "acceleration", "a", ACCELERATION / 10),
        ([1, 0.1], {"velocity": 5, "acceleration": 50, "jerk": 100}, "jerk", "a", JERK / 100),
        ([0, 1], {"tcp": {"speed": 2, "angular_speed": 9}}, "speed", None, 0.4 * VELOCITY / 2),
        ([0, 1], {"tcp": {"speed": 9, "angular_speed": 3}}, "angular_speed", None, VELOCITY / 3),
    ],
)
def test_it_is_the_largest_peak_over_its_bound(
    to: list[float], limits: dict[str, Any], quantity: str, joint: str | None, used: float
) -> None:
    plan = planned([quintic(to, 1.0)], limits)
    found = tightest_of_move(plan, 0)
    assert found is not None
    assert (found.quantity, found.joint) == (quantity, joint)
    assert found.used == pytest.approx(used, rel=2e-6)
    assert found.name == f"{quantity.replace('_', ' ')} of {joint or 'the tool'}"
    assert found.share == f"{100 * found.used:.4g} %"


def test_the_first_of_equal_moves_counts_and_one_that_uses_nothing_is_left_out() -> None:
    moves = [
        {"planner": "hold", "duration": 1},
        quintic([1, 0], 2.0),
        quintic([0, 0], 1.0),
        quintic([1, 0], 1.0),
    ]
    plan = planned(moves, {"velocity": 5})
    assert [one.span.index for one in tightest_of_moves(plan)] == [1, 2, 3]
    assert tightest_of_move(plan, 0) is None
    assert tightest_limit(plan) == f"velocity of a in move 2, {100 * VELOCITY / 5:.4g} % used"
    assert tightest_limit(planned(moves, {})) == ""


def test_of_joints_and_quantities_that_use_the_same_the_first_counts() -> None:
    """Effort and tool are known to a millionth only: where they seem to use a trifle more, the joint counts."""
    limits = {"velocity": 2, "tcp": {"angular_speed": 2 * (1 - 5e-7)}}
    found = tightest_of_move(planned([quintic([1, 0], 1.0)], limits), 0)
    assert found is not None
    assert (found.quantity, found.joint) == ("velocity", "a")


@pytest.mark.parametrize("effort", [[-20, 40], [-20, 10]])
def test_efforts_count_by_direction(effort: list[float]) -> None:
    """10 N at 1 m, held level: 10 N m against gravity, which pulls up or down."""
    link = {"mass": 10 / 9.81, "com": [0, 0, 0], "inertia": [0] * 6}
    still = {**link, "mass": 1e-9}
    joints = [
        {"name": "a", "a": 1, "effort": effort, "link": link},
        {"name": "b", "a": 1, "effort": 1, "link": still},
    ]
    for sign in (1, -1):
        sides = effort if sign > 0 else [-effort[1], -effort[0]]
        arm = {"convention": "standard", "joints": [{**joints[0], "effort": sides}, joints[1]]}
        job = {"version": 1, "robot": arm, "gravity": [0, -9.81 * sign, 0], "limits": {"effort": "robot"}}
        job |= {"start": {"joints": [0, 0]}, "moves": [quintic([0, 0.01], 100.0)]}
        found = tightest_of_move(plan_job(job_from_text(json.dumps(job))), 0)
        assert found is not None
        assert (found.quantity, found.joint) == ("effort", "a")
        assert found.used == pytest.approx(10 / effort[1], rel=1e-5)


def test_a_velocity_by_position_counts() -> None:
    """|v| <= sqrt(2 d s) of the way s that is left: a ramp of 0.8 d uses sqrt(0.8) of it all along."""
    near = {"deceleration": 2.5, "offset": 0.0}
    joints = [{"name": "a", "position": [-9, 1], "velocity_by_position": near}, {"name": "b"}]
    move = {"planner": "trapezoid", "to": {"joints": [1, 0]}, "acceleration": 2, "velocity": 1}
    job = {"version": 1, "robot": {"joints": joints}, "limits": {"velocity": 9}}
    job |= {"start": {"joints": [0, 0]}, "moves": [move]}
    found = tightest_of_move(plan_job(job_from_text(json.dumps(job))), 0)
    assert found is not None
    assert (found.quantity, found.joint) == ("velocity_by_position", "a")
    assert found.used == pytest.approx(0.8**0.5, rel=1e-6)
    assert found.name == "velocity by position of a"
