"""Why no duration keeps the limits of a move between moving states: stopping distances, and ranges that are left."""

from __future__ import annotations

from typing import Any

import pytest
from random_jobs import loaded
from tiers import few

from trajcli.errors import Problem
from trajcli.planning.plan import plan_job

SLOWED = 2.0  # rad/s^2, the lower limit of the acceleration; the upper one is four times as much


def not_slowed(start: dict[str, Any], to: dict[str, Any], **limits: Any) -> Problem | None:
    """Return why a quintic of one joint that is too fast is not slowed."""
    job = {
        "version": 1,
        "robot": {"joints": 1},
        "limits": {"position": [[-1, 1]], "velocity": 9, "acceleration": [[-SLOWED, 4 * SLOWED]], **limits},
        "start": start,
        "moves": [{"planner": "quintic", "to": to, "duration": 0.2}],
        "when_over_limit": "slow",
    }
    return plan_job(loaded(job)).moves[0].not_slowed


@pytest.mark.parametrize(
    ("end", "velocity", "share"),
    [
        *[(end, velocity, 0.97) for end in ("starts", "ends") for velocity in (1.0, -1.0)],
        *few([("starts", 1.0, 1.03), ("starts", -1.0, 1.03), ("ends", -1.0, 1.03), ("ends", 1.0, 1.03)], 2),
    ],
)
def test_a_joint_needs_the_way_in_which_its_acceleration_stops_it(
    end: str, velocity: float, share: float
) -> None:
    """v^2 / (2 a): it stops, or comes to its velocity, with the limit of the one direction or of the other."""
    braking = (end == "starts") == (velocity > 0)
    room = share * velocity**2 / (2 * (SLOWED if braking else 4 * SLOWED))
    side = 1.0 if (end == "starts") == (velocity > 0) else -1.0
    moving = {"joints": [side * (1 - room)], "velocity": [velocity]}
    ends = ({"joints": [0]}, moving) if end == "ends" else (moving, {"joints": [0]})
    why = not_slowed(*ends)
    said = why is not None and f"{{joint}} {end} with {{velocity}}, {{room}} from its limit" in why.message
    assert said == (share < 1)
    if why is not None and said:
        assert why.amounts["room"].value == pytest.approx(room)  # type: ignore[union-attr]
        assert why.amounts["needed"].value == pytest.approx(room / share)  # type: ignore[union-attr]


@pytest.mark.parametrize("sign", [1, -1])
def test_the_range_is_left_ever_further_on_either_side(sign: int) -> None:
    """A cubic that starts away from its target swings out by a part of v T, however slow it is."""
    job = {
        "version": 1,
        "robot": {"joints": 2},
        "limits": {
            "position": [sorted([-0.13 * sign, 2 * sign]), [-9, 9]],
            "velocity": 1.1,
            "acceleration": 8,
        },
        "start": {"joints": [0, 0], "velocity": [-sign, 0]},
        "moves": [{"planner": "cubic", "to": {"joints": [1.2 * sign, 0.4]}, "duration": 0.3}],
        "when_over_limit": "slow",
    }
    why = plan_job(loaded(job)).moves[0].not_slowed
    assert why is not None
    assert why.message == "the longer it lasts, the further {joint} goes beyond its position limit"
    assert why.amounts == {"joint": "j1"}
    job["limits"] = {"position": 9, "velocity": 1.1, "acceleration": 8}
    assert plan_job(loaded(job)).verdict.passed


@pytest.mark.full
def test_a_move_between_moving_states_is_slowed_to_a_limit_of_the_tool() -> None:
    job = {
        "version": 1,
        "robot": "ur5e",
        "limits": {"tcp": {"speed": 0.3}},
        "start": {"joints": [0, -1, 1, 0, 0, 0], "velocity": [0.1, 0, 0, 0, 0, 0]},
        "moves": [{"planner": "quintic", "to": {"joints": [0.5, -1, 1, 0, 0, 0]}, "duration": 1.5}],
        "when_over_limit": "slow",
    }
    plan = plan_job(loaded(job))
    assert plan.verdict.passed
    assert [event.kind for event in plan.events] == ["slowed"]
