"""Words of advice: factors and durations of the textbook, and no way out that another finding bars."""

from __future__ import annotations

import json
from typing import Any

import pytest

from trajcli.findings import Finding
from trajcli.job.read import job_from_text
from trajcli.planning.plan import Plan, plan_job

JERK = {"velocity": 2, "acceleration": 8, "jerk": 50}
SLOW = ", or say `when_over_limit: slow`"
NO_HELP = "slowing down does not help: change the target, the start or the limit"


def planned(limits: dict[str, Any], *moves: dict[str, Any], **more: Any) -> Plan:
    start = {"joints": [0, 0]}
    job = {"version": 1, "robot": {"joints": 2}, "start": start, "limits": limits, "moves": list(moves)}
    return plan_job(job_from_text(json.dumps({**job, **more})))


def hints(plan: Plan, move: int = 0) -> dict[str, str | None]:
    """Return the hint against each kind of finding about a move; all findings of a kind have the same."""
    found: dict[str, list[Finding]] = {}
    for finding in plan.verdict.findings:
        if finding.move == move:
            found.setdefault(finding.kind, []).append(finding)
    assert all(len({finding.hint for finding in each}) == 1 for each in found.values())
    return {kind: each[0].hint for kind, each in found.items()}


def to(planner: str, **more: Any) -> dict[str, Any]:
    return {"planner": planner, "to": {"joints": [1, 0.4]}, **more}


@pytest.mark.parametrize(
    ("move", "factor", "duration"),
    [
        (to("quintic", duration=0.5), "3.75", "1.875"),  # 15/8 D / v
        (to("cubic", duration=0.5), "3", "1.5"),  # 3/2 D / v
        (to("cycloidal", duration=0.5), "4", "2"),  # 2 D / v
        (to("septic", duration=2), "1.09375", "2.1875"),  # 35/16 D / v
    ],
)
def test_a_move_that_is_too_short_is_told_the_duration_of_the_textbook(
    move: dict[str, Any], factor: str, duration: str
) -> None:
    plan = planned({"velocity": 1}, move)
    assert hints(plan) == {"velocity": f"it must last {factor} times longer ({duration} s){SLOW}"}
    assert planned({"velocity": 1}, {**move, "duration": float(duration)}).verdict.passed


def test_a_trapezoid_with_rates_of_its_own_is_told_its_least_duration() -> None:
    """1 rad at 3 rad/s and 20 rad/s^2 takes 1/3 + 3/20 s, three times too little at 1 rad/s."""
    plan = planned({"velocity": 1, "acceleration": 9}, to("trapezoid", velocity=3, acceleration=20))
    (hint,) = set(hints(plan).values())
    assert hint == f"it must last 3 times longer (1.45 s: `minimum_duration: 1.45`){SLOW}"


def test_a_move_in_motion_is_told_the_least_duration_that_keeps_its_limit() -> None:
    """It is no multiple of the velocity: the one at its start stays. A thousandth less is too short."""
    start = {"joints": [0, 0], "velocity": [0.5, 0]}
    move = {"planner": "cubic", "to": {"joints": [2, 0.4]}}
    hint = hints(planned({"velocity": [1, 2]}, {**move, "duration": 1}, start=start))["velocity"] or ""
    duration = float(hint.partition("longer (")[2].partition(" s")[0])
    assert hint.endswith(SLOW)
    for share, passes in ((1.0, True), (0.999, False)):
        again = planned({"velocity": [1, 2]}, {**move, "duration": duration * share}, start=start)
        assert again.verdict.passed == passes


@pytest.mark.parametrize("slow", [False, True])
def test_beside_a_position_that_no_time_mends_slowing_alone_is_not_advised(*, slow: bool) -> None:
    limits = {"velocity": 1, "position": [[-9, 0.9], [-9, 9]]}
    plan = planned(limits, to("quintic", duration=1), when_over_limit="slow" if slow else "error")
    told = hints(plan)
    assert told["position"] == NO_HELP
    longer = "it must last 1.875 times longer (1.875 s), all its times alike"
    assert told["velocity"] == (NO_HELP if slow else longer)
    factors = {finding.kind: finding.factor for finding in plan.verdict.findings}
    assert factors["position"] is None
    assert factors["velocity"] == (None if slow else pytest.approx(1.875, rel=1e-6))


def test_steps_are_told_what_has_none_and_keeps_the_limits_in_the_same_time() -> None:
    """A quintic of 3 s keeps them, one of 0.3 s does not: then jerk_limited alone, which finds its time."""
    assert hints(planned(JERK, to("cubic", duration=3))) == {
        "acceleration_jump": "use jerk_limited or quintic, or say limits: {jerk: null} in the job"
    }
    told = hints(planned(JERK, to("cubic", duration=0.3)))
    assert (
        told["acceleration_jump"]
        == told["jerk"]
        == "use jerk_limited, or say limits: {jerk: null} in the job"
    )
    # sqrt(6 D / (a T^2)) = 2.88675..., rounded up; as the steps stay, slowing is no way out of all
    assert told["velocity"] == told["acceleration"] == "it must last 2.88676 times longer (0.866026 s)"


def test_a_limit_of_jerk_of_the_move_itself_is_named() -> None:
    plan = planned({"velocity": 2, "acceleration": 8}, to("cubic", duration=3, limits={"jerk": 50}))
    own = " and leave `jerk` out of the move's own"
    hint = f"use jerk_limited or quintic, or say limits: {{jerk: null}} in the job{own}"
    assert hints(plan) == {"acceleration_jump": hint}


@pytest.mark.parametrize(
    ("limits", "second"),
    [
        (JERK, {"planner": "waypoints", "through": [{"joints": [1, 1]}], "to": {"joints": [2, 0]}}),
        ({"jerk": 50}, {"planner": "quintic", "to": {"joints": [2, 0]}}),
    ],
)
def test_no_move_loses_the_limit_of_jerk_without_which_it_cannot_be_planned(
    limits: dict[str, Any], second: dict[str, Any]
) -> None:
    """Searched motions need one, and so does a fastest quintic that has no other limit."""
    hint = hints(planned(limits, to("cubic", duration=3), second))["acceleration_jump"] or ""
    assert "quintic" in hint
    assert "null" not in hint
    free = hints(planned(limits, to("cubic", duration=3)))["acceleration_jump"] or ""
    assert free.endswith("or say limits: {jerk: null} in the job")


@pytest.mark.parametrize("before", [0, 1])
def test_a_step_where_two_moves_meet_is_advised_for_either(before: int) -> None:
    """The cubic begins without acceleration, as 6 d = 4 v T; the move before ends with 0.4 rad/s^2."""
    velocity, duration = 0.4, 3.0
    middle = {"joints": [0.5, 0.3], "velocity": [velocity, 0], "acceleration": [0.4, 0]}
    moves = [
        *([{"planner": "quintic", "to": {"joints": [0.1, 0]}, "duration": 6}] * before),
        {"planner": "quintic", "to": middle, "duration": 2.5},
        {
            "planner": "cubic",
            "to": {"joints": [0.5 + 2 * velocity * duration / 3, 0.3]},
            "duration": duration,
        },
    ]
    meeting, own = "let the moves meet without acceleration, or ", "use jerk_limited or quintic"
    free = ", or say limits: {jerk: null} in the job"
    plan = planned(JERK, *moves)
    assert hints(plan, before) == {"acceleration_jump": f"{meeting}{own} for move {before + 1}{free}"}
    assert hints(plan, before + 1) == {"acceleration_jump": f"{own}{free}"}
    del middle["acceleration"]
    assert hints(planned(JERK, *moves), before) == {}
