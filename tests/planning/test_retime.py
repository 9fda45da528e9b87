"""Moves that are made to last longer: `when_over_limit: slow`, and `align`."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from independent_judge import KINDS, extremes
from random_jobs import TAGS, loaded, random_job

from trajcli.errors import InputError, PlanningError
from trajcli.kinematics.robot import Limits
from trajcli.planners.planner import PlannedMove
from trajcli.planning.plan import Plan, plan_job
from trajcli.planning.retime import next_periods, with_duration

SEEDS = st.integers(0, 2**32 - 1)
few = settings(max_examples=15, deadline=None)


def plan_of(job: dict[str, Any]) -> Plan | None:
    """Return the plan, or None where some move is impossible."""
    try:
        return plan_job(loaded(job))
    except (PlanningError, InputError):
        return None


def share(move: PlannedMove) -> float:
    """Return the largest share of a limit that the move uses: 1 at the limit, by an independent judge."""
    limits: Limits = move.robot.limits
    shares = []
    for order in range(len(KINDS)):
        low, high = extremes(move.planned.curve, order)
        lower, upper = limits.of_order(order).T
        shares += [low / lower, high / upper] if order else [1 + high - upper, 1 + lower - low]
    return float(np.max(shares))


def loose(move: dict[str, Any], duration: float) -> dict[str, Any]:
    """Return the move with nothing that ties its timing to the limits."""
    kept = {key: value for key, value in move.items() if key in ("planner", "to", "synchronize", "overshoot")}
    return {**kept, "duration": duration}


def without_jerk_limits(job: dict[str, Any]) -> None:
    for row in job["robot"]["joints"]:
        row["jerk"] = None


@few
@given(seed=SEEDS, tag=st.sampled_from(["cubic", "quintic", "septic", "cycloidal", "trapezoid"]))
def test_slow_is_the_smallest_stretch_from_rest_to_rest(seed: int, tag: str) -> None:
    job = random_job(np.random.default_rng(seed), tag, 3, rest=True, unlimited=0.1)
    job["moves"] = [loose(job["moves"][0], 0.05)]
    if tag in ("cubic", "trapezoid"):
        without_jerk_limits(job)
    if tag == "trapezoid":
        moved = np.abs(np.subtract(job["moves"][0]["to"]["joints"], job["start"]["joints"]))
        assume(moved.max() > 1e-3)
        speeds = (1.5 * np.maximum(moved, 1e-3) / 0.05).tolist()
        job["moves"][0] |= {"synchronize": "time", "velocity": speeds}
    over = plan_of(job)
    assume(over is not None and not over.verdict.passed)
    slow = plan_of({**job, "when_over_limit": "slow"})
    assert slow is not None
    assert slow.verdict.passed
    (move,) = slow.moves
    assert move.duration == pytest.approx(0.05 * move.stretch, rel=1e-12)
    assert share(move) == pytest.approx(1, abs=1e-9)
    assert share(with_duration(move, move.duration * (1 - 1e-6))) > 1 + 5e-7
    (event,) = slow.events
    assert event.kind == "slowed"
    assert event.move == 0
    stated = float(event.message.split()[1])
    assert move.stretch * (1 - 1e-12) <= stated <= move.stretch * (1 + 1e-5)
    assert "{" not in event.message


@pytest.mark.full
@settings(max_examples=5, deadline=None)
@given(seed=SEEDS, tag=st.sampled_from(["cubic", "quintic", "septic", "trapezoid"]), joints=st.integers(1, 3))
def test_slow_is_the_smallest_stretch_between_moving_states(seed: int, tag: str, joints: int) -> None:
    rng = np.random.default_rng(seed)
    job = random_job(rng, tag, joints, unlimited=0.1)
    job["moves"] = [loose(job["moves"][0], float(rng.uniform(0.05, 0.5)))]
    for state in (job["start"], job["moves"][0]["to"]):
        state["velocity"] = rng.uniform(-0.25, 0.25, joints).tolist()
        if tag in ("cubic", "trapezoid"):
            state.pop("acceleration", None)
    if tag in ("cubic", "trapezoid"):
        without_jerk_limits(job)
    if tag == "trapezoid":
        job["moves"][0] |= {"acceleration": 100.0, "overshoot": True, "synchronize": "none"}
    over = plan_of(job)
    assume(over is not None and not over.verdict.passed)
    slow = plan_of({**job, "when_over_limit": "slow"})
    assert slow is not None
    assume(slow.events)
    assert slow.verdict.passed
    (move,) = slow.moves
    assert share(move) <= 1 + 1e-9
    assert np.array_equal(move.planned.end.velocity, job["moves"][0]["to"]["velocity"])
    for factor in [1 - 1e-6, *np.geomspace(1 / move.stretch, 0.999, 12)]:
        assert share(with_duration(move, move.duration * factor)) > 1, f"{factor} of the stretch would do"


def test_slow_finds_a_stretch_that_keeps_a_position_limit_too() -> None:
    """A cubic that starts away from the target first swings out: further, the longer it lasts."""
    job = {
        "version": 1,
        "robot": {"joints": 1},
        "limits": {"position": 10, "velocity": 3, "acceleration": 20},
        "start": {"joints": [0], "velocity": [-1]},
        "moves": [{"planner": "cubic", "to": {"joints": [4]}, "duration": 1}],
        "when_over_limit": "slow",
    }
    plan = plan_of(job)
    assert plan is not None
    assert plan.verdict.passed
    assert plan.moves[0].duration > 1


@pytest.mark.parametrize(
    ("limits", "start", "kind"),
    [
        ({"position": 0.5, "velocity": 1}, {"joints": [0]}, "position"),
        ({"velocity": 1}, {"joints": [0], "velocity": [1.5]}, "velocity"),
    ],
)
def test_slow_does_not_help_against_everything(
    limits: dict[str, float], start: dict[str, Any], kind: str
) -> None:
    job = {
        "version": 1,
        "robot": {"joints": 1},
        "limits": limits,
        "start": start,
        "moves": [{"planner": "quintic", "to": {"joints": [1]}, "duration": 0.7}],
        "when_over_limit": "slow",
    }
    plan = plan_of(job)
    assert plan is not None
    assert not plan.verdict.passed
    assert kind in {finding.kind for finding in plan.verdict.findings}
    assert plan.events == ()
    assert plan.trajectory.duration == 0.7


def test_a_move_overrides_the_job() -> None:
    over = {"planner": "quintic", "to": {"joints": [1]}, "duration": 0.5}
    job = {
        "version": 1,
        "robot": {"joints": 1},
        "limits": {"velocity": 1},
        "start": {"joints": [0]},
        "moves": [{**over, "when_over_limit": "error"}, {**over, "to": {"joints": [0]}}],
        "when_over_limit": "slow",
    }
    plan = plan_of(job)
    assert plan is not None
    assert [finding.move for finding in plan.verdict.findings] == [0]
    assert [move.duration for move in plan.moves] == pytest.approx([0.5, 1.875], rel=1e-12)
    assert [event.move for event in plan.events] == [1]


@few
@given(
    seed=SEEDS,
    tags=st.lists(st.sampled_from(TAGS), min_size=1, max_size=2),
    rate=st.sampled_from([1000.0, 500.0, 250.0, 30.0, 7.0]),
)
def test_align_gives_whole_periods(seed: int, tags: list[str], rate: float) -> None:
    rng = np.random.default_rng(seed)
    jobs = [random_job(rng, tag, 2, rest=True, unlimited=0.0) for tag in tags]
    job = {**jobs[0], "moves": [one["moves"][0] for one in jobs]}
    free, aligned = plan_of(job), plan_of({**job, "output": {"align": True, "rate": rate}})
    assume(free is not None)
    assert free is not None
    assert aligned is not None
    for span, before in zip(aligned.trajectory.spans, free.moves, strict=True):
        for time in (span.start, span.end):
            assert time * rate == pytest.approx(round(time * rate), abs=1e-6)
        assert -1e-9 <= (span.duration - before.duration) * rate < 1 + 1e-6
    kinds = {(finding.move, finding.joint, finding.kind) for finding in aligned.verdict.findings}
    assert kinds <= {(finding.move, finding.joint, finding.kind) for finding in free.verdict.findings}


def test_align_between_moving_states_plans_again() -> None:
    job = {
        "version": 1,
        "robot": {"joints": 1},
        "start": {"joints": [0], "velocity": [0.5]},
        "moves": [
            {"planner": "cubic", "to": {"joints": [1], "velocity": [0.2]}, "duration": 1.2345},
            {"planner": "trapezoid", "to": {"joints": [2]}, "acceleration": 0.9, "velocity": 0.8},
            {"planner": "jerk_limited", "to": {"joints": [0]}},
        ],
        "limits": {"velocity": 2, "acceleration": 5, "jerk": 50},
        "output": {"align": True, "rate": 10},
    }
    plan = plan_of(job)
    assert plan is not None
    assert [round(span.end * 10, 9) % 1 for span in plan.trajectory.spans] == [0, 0, 0]
    assert plan.moves[0].duration == 1.3
    curve = plan.trajectory.curve
    assert curve.evaluate(0.0, 1)[0] == 0.5
    assert curve.evaluate(1.3, 1)[0] == pytest.approx(0.2, rel=1e-9)


def test_align_does_not_push_a_move_over_its_limit() -> None:
    """The joint swings out before it turns: one period more would take it past its position limit."""
    job: dict[str, Any] = {
        "version": 1,
        "robot": {"joints": 1},
        "start": {"joints": [0], "velocity": [-1]},
        "moves": [{"planner": "cubic", "to": {"joints": [1]}, "duration": 1.01}],
    }
    free = plan_of(job)
    assert free is not None
    lowest = float(extremes(free.trajectory.curve, 0)[0][0])
    job["robot"] = {"joints": [{"position": [lowest * (1 + 1e-6), 2]}]}
    allowed = plan_of(job)
    assert allowed is not None
    assert allowed.verdict.passed
    job["output"] = {"align": True, "rate": 1}
    with pytest.raises(PlanningError, match="whole number of periods"):
        plan_job(loaded(job))


def test_align_of_a_move_far_shorter_than_a_period() -> None:
    job = {
        "version": 1,
        "robot": {"joints": 1},
        "start": {"joints": [0]},
        "limits": {"velocity": 1},
        "moves": [
            {"planner": "cubic", "to": {"joints": [1e-13]}},
            {"planner": "cubic", "to": {"joints": [1e-13]}},
        ],
        "output": {"align": True, "rate": 1000},
    }
    plan = plan_of(job)
    assert plan is not None
    assert [move.duration for move in plan.moves] == [0.001, 0.0]
    assert plan.verdict.passed


def stretched(move: dict[str, Any], factor: float = 2.5) -> tuple[PlannedMove, PlannedMove]:
    """Return a move of two joints from rest to rest, and the same in `factor` times the time."""
    limits = {"velocity": [1, 2], "acceleration": [3, 5], "jerk": [40, 60]}
    if move["planner"] == "trapezoid":
        del limits["jerk"]
    job = {"version": 1, "robot": "planar2r", "start": {"joints": [0.1, 0.9]}, "limits": limits}
    (planned,) = plan_job(loaded({**job, "moves": [move]})).moves
    return planned, with_duration(planned, factor * planned.duration)


OVER, TO = [{"joints": [0.6, 1.1]}, {"joints": [0.2, 0.7]}], {"joints": [0.8, 1.4]}


def test_a_stretched_law_and_its_phases_are_those_of_the_stretched_curve() -> None:
    plain, longer = stretched({"planner": "trapezoid", "to": TO})
    assert plain.planned.law is not None
    assert longer.planned.law is not None
    t = np.linspace(0, plain.duration, 50)
    s = longer.planned.law.evaluate(2.5 * t)
    chord = np.subtract(TO["joints"], [0.1, 0.9])
    np.testing.assert_allclose(longer.planned.curve.evaluate(2.5 * t), [0.1, 0.9] + s * chord, atol=1e-12)
    for one, other in zip(plain.planned.phases, longer.planned.phases, strict=True):
        assert (other.start, other.end) == pytest.approx((2.5 * one.start, 2.5 * one.end), rel=1e-12)
    twice = with_duration(longer, 2 * longer.duration)
    assert twice.stretch == pytest.approx(5, rel=1e-12)


def test_each_joint_of_a_stretched_move_arrives_when_it_says() -> None:
    _, longer = stretched({"planner": "trapezoid", "to": TO, "synchronize": "none"})
    assert longer.planned.arrivals is not None
    for joint, time in enumerate(longer.planned.arrivals):
        assert longer.planned.curve.evaluate(time)[joint] == pytest.approx(TO["joints"][joint], abs=1e-12)
        assert abs(longer.planned.curve.evaluate(0.99 * time)[joint] - TO["joints"][joint]) > 1e-6


@pytest.mark.parametrize("planner", ["spline", "blends", "time_optimal", "waypoints"])
def test_a_stretched_move_passes_its_points_when_it_says(planner: str) -> None:
    plain, longer = stretched({"planner": planner, "through": OVER, "to": TO})
    one, other, curve = plain.planned, longer.planned, longer.planned.curve
    for points in (other.via_points, other.virtual_points):
        assert points is not None or planner != "spline"
        if points is not None:
            off = np.abs(curve.evaluate(np.clip(points.times, 0, longer.duration)) - points.points)
            assert np.all(off <= points.missed + 1e-9)
    assert other.origin == pytest.approx(2.5 * one.origin, rel=1e-12)
    assert (one.origin > 0) == (planner == "blends")
    if planner == "time_optimal":
        assert other.phase_plane is not None
        assert other.phase_plane.law.end == pytest.approx(longer.duration, rel=1e-12)
    if planner == "waypoints":
        assert one.certificate is not None
        assert other.certificate is not None
        np.testing.assert_allclose(other.certificate.off_times, 2.5 * one.certificate.off_times, rtol=1e-12)


def test_the_tool_of_a_stretched_move_is_where_its_reference_says() -> None:
    law = {"shape": "quintic", "duration": 1}
    _, longer = stretched({"planner": "line", "to": {"xyz": [0.3, 0.2, 0]}, "law": law})
    assert longer.planned.tool is not None
    t = np.linspace(0, longer.duration, 9)
    q = longer.planned.curve.evaluate(t)
    lengths = [joint.a for joint in longer.robot.joints]
    xy = sum(a * np.stack([np.cos(s), np.sin(s)], 1) for a, s in zip(lengths, np.cumsum(q, 1).T, strict=True))
    np.testing.assert_allclose(longer.planned.tool.reference(t).poses[:, :2, 3], xy, atol=2e-6)


@pytest.mark.parametrize("sign", [1, -1])
def test_what_gravity_alone_exceeds_is_refused_on_either_side(sign: int) -> None:
    """A mass of 1 kg on 1 m held level takes 9.81 N m, upwards or, hanging from above, downwards."""
    link = {"mass": 1, "com": [0, 0, 0], "inertia": [0] * 6}
    bound = [-20, 8] if sign > 0 else [-8, 20]
    robot = {"convention": "standard", "joints": [{"name": "a", "a": 1, "effort": bound, "link": link}]}
    job: dict[str, Any] = {
        "version": 1,
        "robot": robot,
        "gravity": [0, -9.81 * sign, 0],
        "limits": {"effort": "robot"},
        "start": {"joints": [-0.3]},
        "moves": [{"planner": "quintic", "to": {"joints": [0.3]}, "duration": 3}],
    }
    with pytest.raises(PlanningError) as caught:
        plan_job(loaded(job))
    (problem,) = caught.value.problems
    assert problem.joint == "a"
    assert problem.text().startswith(
        f"move 0 (quintic): gravity alone takes {9.81 * sign:g} N m of a at t = 1.5 s"
    )
    assert "1.81 N m more than its effort limit" in problem.text()


def test_a_duration_that_is_too_short_becomes_the_shortest_that_there_is() -> None:
    """A trapezoid by 2 rad with v = 1 and a = 3 lasts 2 + 1/3 s."""
    move = {"planner": "trapezoid", "to": {"joints": [2, 1]}, "duration": 0.5}
    job = {"version": 1, "robot": {"joints": 2}, "limits": {"velocity": 1, "acceleration": 3}}
    job |= {"start": {"joints": [0, 0]}, "moves": [move], "when_over_limit": "slow"}
    plan = plan_of(job)
    assert plan is not None
    (slowed,), (event,) = plan.moves, plan.events
    assert slowed.duration == pytest.approx(7 / 3, rel=1e-12)
    assert slowed.stretch == pytest.approx(14 / 3, rel=1e-12)
    assert (slowed.over_limit, event.kind, event.move) == ("slow", "slowed", 0)
    assert event.message.startswith("stretched 4.66667 times, from 0.5 s to 2.33333333 s: ")
    with pytest.raises(PlanningError):
        plan_job(loaded({**job, "when_over_limit": "error"}))


def test_a_stretch_by_millionths_is_not_said_to_be_none() -> None:
    """A quintic by 1 rad in 1 s has 1.875 rad/s at its middle."""
    move = {"planner": "quintic", "to": {"joints": [1]}, "duration": 1}
    job = {"version": 1, "robot": {"joints": 1}, "limits": {"velocity": 1.875 / (1 + 2.5e-6)}}
    job |= {"start": {"joints": [0]}, "moves": [move], "when_over_limit": "slow"}
    plan = plan_of(job)
    assert plan is not None
    assert plan.moves[0].stretch == pytest.approx(1 + 2.5e-6, rel=1e-9)
    assert plan.events[0].message.startswith("stretched 1.00001 times, from 1 s to 1.0000025 s, to keep")


def test_what_a_stretched_move_is_said_to_keep_is_the_limit_that_asks_for_most() -> None:
    """By 0.1 and 3 rad in half a second: 15/8 D/T is 0.375 of one limit, 5.625 times the other, jerk a little."""
    move = {"planner": "quintic", "to": {"joints": [1, 3]}, "duration": 0.5}
    job = {"version": 1, "robot": {"joints": 2}, "limits": {"velocity": [1, 2]}}
    job |= {"start": {"joints": [0, 0]}, "moves": [move], "when_over_limit": "slow"}
    plan = plan_of(job)
    assert plan is not None
    (event,) = plan.events
    assert event.message == "stretched 5.625 times, from 0.5 s to 2.8125 s, to keep the velocity limit of j2"
    job["limits"] = {"position": [[-9, 9], [-9, 1]], "velocity": 1}
    over = plan_of(job)
    assert over is not None
    assert over.moves[0].not_slowed is not None
    assert over.moves[0].not_slowed.message == "change the target, the start or the limit"


def test_whole_periods_of_durations_that_sums_have_rounded() -> None:
    assert next_periods(0.1 + 0.2, 10) == 3
    assert next_periods(0.3 * (1 + 1e-6), 10) == 4
    assert next_periods(0.0, 10) == 1


def test_align_passes_over_durations_that_no_motion_has() -> None:
    """From and to 1 rad/s over 0.5 rad with 1 rad/s^2: at most 2 - sqrt(2) s, or there and back again."""
    job = {
        "version": 1,
        "robot": {"joints": 1},
        "limits": {"velocity": 2, "acceleration": 1, "jerk": None},
        "start": {"joints": [0], "velocity": [1]},
        "moves": [{"planner": "jerk_limited", "to": {"joints": [0.5], "velocity": [1]}}],
        "output": {"align": True, "rate": 1},
    }
    plan = plan_of(job)
    assert plan is not None
    assert plan.verdict.passed
    assert plan.moves[0].duration == pytest.approx(4, abs=1e-12)  # two turns take at least 2 + sqrt(2)


def test_stretches_of_a_move_in_motion_multiply() -> None:
    start = {"joints": [0], "velocity": [0.5]}
    job = {"version": 1, "robot": {"joints": 1}, "start": start}
    job["moves"] = [{"planner": "cubic", "to": {"joints": [1]}, "duration": 1}]
    (move,) = plan_job(loaded(job)).moves
    twice = with_duration(with_duration(move, 2.0), 3.0)
    assert (twice.duration, twice.stretch) == (3.0, pytest.approx(3.0, rel=1e-12))
    assert twice.planned.curve.evaluate(0.0, 1)[0] == pytest.approx(0.5, rel=1e-12)
