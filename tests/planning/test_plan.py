"""From a job to a judged trajectory: the verdict against an independent judge, and the rules between moves."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from independent_judge import broken_limits, extremes, step_breakers
from random_jobs import MOST_JOINTS, RATES, TAGS, loaded, random_job
from tiers import few

from trajcli.errors import InputError, PlanningError
from trajcli.peers.lower_bound import LowerBound, fastest_duration
from trajcli.peers.move_reference import reference_of
from trajcli.planning.plan import Plan, plan_job

SEEDS = st.integers(0, 2**32 - 1)
drawn = settings(max_examples=40, deadline=None)


def plan_of(job: dict[str, Any]) -> Plan | None:
    """Return the plan, or None where some move is impossible."""
    try:
        return plan_job(loaded(job))
    except (PlanningError, InputError):
        return None


def random_sequence(seed: int, joints: int, moves: int, unlimited: float) -> dict[str, Any]:
    rng = np.random.default_rng(seed)
    tags = rng.choice(TAGS, moves)
    jobs = [
        random_job(rng, str(tag), joints, rest=bool(rng.random() < 0.7), unlimited=unlimited) for tag in tags
    ]
    return {**jobs[0], "moves": [job["moves"][0] for job in jobs]}


def job_of(*moves: dict[str, Any], start: Any = None, **rest: Any) -> dict[str, Any]:
    return {
        "version": 1,
        "robot": {"joints": 1},
        "start": start or {"joints": [0]},
        "moves": list(moves),
        **rest,
    }


@settings(max_examples=30, deadline=None)
@given(seed=SEEDS, joints=st.integers(1, 4), moves=st.integers(1, 3), unlimited=st.sampled_from([0.1, 0.6]))
def test_the_verdict_is_that_of_an_independent_judge(
    seed: int, joints: int, moves: int, unlimited: float
) -> None:
    plan = plan_of(random_sequence(seed, joints, moves, unlimited))
    assume(plan is not None and plan.trajectory.duration > 0)
    assert plan is not None
    limits = [move.robot.limits for move in plan.moves]
    found = {(f.move, f.joint, f.kind) for f in plan.verdict.findings}
    sure, open_to_doubt = broken_limits(plan.trajectory, limits)
    jumps = step_breakers(plan.trajectory, limits)
    assert {joint for _, joint, kind in found if kind == "acceleration_jump"} == jumps
    broken = {finding for finding in found if not finding[2].endswith("_jump")}
    assert sure <= broken
    assert broken <= sure | open_to_doubt
    opens = {move.index for move in plan.moves if move.planned.begins is not None}  # rules with open ends
    assert not any(
        kind == "position_jump" or (kind == "velocity_jump" and index not in opens)
        for index, _, kind in found
    )
    assert plan.verdict.passed == (not found)


@drawn
@given(
    seed=SEEDS,
    tag=st.sampled_from(["cubic", "quintic", "septic", "cycloidal", "trapezoid"]),
    order=st.integers(0, 3),
    upper=st.booleans(),
    over=st.sampled_from([5e-10, 2e-9]),
)
def test_a_limit_is_broken_from_one_billionth_on(
    seed: int, tag: str, order: int, upper: bool, over: float
) -> None:
    """Put one limit just below the peak of a motion that does not depend on it."""
    job = random_job(np.random.default_rng(seed), tag, 2, rest=seed % 2 == 0, unlimited=1.0)
    (move,) = job["moves"]
    for field in ("velocity", "minimum_duration"):
        move.pop(field, None)
    move["duration"] = 2.0
    if tag == "trapezoid":
        move["acceleration"] = 40.0
    free = plan_of(job)
    assume(free is not None and free.trajectory.duration > 0)
    assert free is not None
    low, high = (float(bound[0]) for bound in extremes(free.trajectory.curve, order))
    peak = high if upper else low
    sign = 1.0 if upper else -1.0
    assume(sign * peak > 1e-2)  # else the absolute part of the tolerance rules
    limit = peak / (1 + over)
    bound = [-1e6, limit] if upper else [limit, 1e6]
    quantity = ("position", *RATES)[order]
    job["robot"]["joints"][0][quantity] = bound
    judged = plan_of(job)
    assert judged is not None
    (finding, *more) = [f for f in judged.verdict.findings if f.kind == quantity] or [None]
    assert not more
    assert (finding is not None) == (over > 1e-9)
    if finding is not None:
        assert finding.joint == "j1"
        assert finding.value == pytest.approx(peak, rel=1e-9)
        assert finding.limit == limit
        at = judged.trajectory.curve.evaluate(finding.time, order, side="left")[0]
        after = judged.trajectory.curve.evaluate(finding.time, order)[0]
        assert finding.value == pytest.approx(max(at, after) if upper else min(at, after), rel=1e-9)


@pytest.mark.full
@settings(max_examples=50, deadline=None)
@given(
    seed=SEEDS,
    tag=st.sampled_from([tag for tag in TAGS if tag != "hold"]),
    joints=st.integers(1, MOST_JOINTS),
)
def test_no_planner_beats_the_bound(seed: int, tag: str, joints: int) -> None:
    rng = np.random.default_rng(seed)
    job = random_job(rng, tag, joints, rest=seed % 2 == 0, unlimited=0.0)
    if tag in ("cubic", "trapezoid"):  # with a jerk limit these never pass
        for row in job["robot"]["joints"]:
            row["jerk"] = None
    for field in ("duration", "minimum_duration"):
        job["moves"][0].pop(field, None)
    assume("joints" in job["moves"][0]["to"])  # the bound is for a place
    plan = plan_of(job)
    assume(plan is not None and plan.verdict.passed)
    assert plan is not None
    (move,) = plan.moves
    begins = move.planned.begins or move.start  # a natural spline begins in motion
    bound = fastest_duration(begins, move.planned.end, move.robot.limits)
    assume(isinstance(bound, LowerBound))
    assert isinstance(bound, LowerBound)
    assert move.duration >= bound.duration * (1 - 1e-9)
    told = reference_of(move)
    assert told.ratio is None or told.ratio >= 1 - 1e-9


@drawn
@given(seed=SEEDS, joints=st.integers(1, 6), overshoot=st.booleans())
def test_the_fastest_trapezoid_of_each_joint_is_the_bound(seed: int, joints: int, overshoot: bool) -> None:
    """Without a jerk limit the time-optimal motion is a trapezoid, whatever its boundary velocities."""
    rng = np.random.default_rng(seed)
    job = random_job(rng, "trapezoid", joints, unlimited=0.0)
    for row in job["robot"]["joints"]:
        row["jerk"] = None
    target = {"joints": job["moves"][0]["to"]["joints"]}
    job["start"]["velocity"] = rng.uniform(-0.25, 0.25, joints).tolist()
    move = {"planner": "trapezoid", "to": target, "synchronize": "none", "overshoot": overshoot}
    job["moves"] = [move]
    plan = plan_of(job)
    assume(plan is not None)
    assert plan is not None
    assert plan.verdict.passed
    bound = fastest_duration(plan.moves[0].start, plan.moves[0].planned.end, plan.moves[0].robot.limits)
    assert isinstance(bound, LowerBound)
    assert plan.trajectory.duration == pytest.approx(bound.duration, rel=1e-9)


def test_acceleration_is_handed_over_between_planners_of_continuity_2_only() -> None:
    def to(position: float, **state: float) -> dict[str, Any]:
        return {"joints": [position], **{name: [value] for name, value in state.items()}}

    quintic = {"planner": "quintic", "to": to(1, velocity=0.5, acceleration=0.7), "duration": 2}
    cubic = {"planner": "cubic", "to": to(2, velocity=0.4), "duration": 2}
    septic = {"planner": "septic", "to": to(3, velocity=0.2, acceleration=-0.3), "duration": 2}
    last = {"planner": "quintic", "to": to(4), "duration": 2}
    plan = plan_of(job_of(quintic, septic, cubic, last))
    assert plan is not None
    starts = [
        (float(move.start.position[0]), float(move.start.velocity[0]), float(move.start.acceleration[0]))
        for move in plan.moves
    ]
    assert starts == [(0, 0, 0), (1, 0.5, 0.7), (3, 0.2, 0.0), (2, 0.4, 0.0)]
    curve = plan.trajectory.curve
    assert curve.evaluate(2.0, 2, side="left")[0] == pytest.approx(0.7, rel=1e-12)
    assert curve.evaluate(2.0, 2)[0] == pytest.approx(0.7, rel=1e-12)
    # the cubic's: one where it begins, from -0.3, and one where it ends, to zero
    assert [(step.move, step.time) for step in plan.verdict.steps] == [(2, 4.0), (2, 6.0)]
    assert plan.verdict.passed


def test_moves_follow_each_other() -> None:
    sequence = random_sequence(3, 2, 1, 0.0)
    poses = [[0.5, 1.0], [0.5, 1.0], [-1.0, 0.3], [2.0, 2.0]]
    tags = ["quintic", "cubic", "cycloidal", "septic"]
    sequence["moves"] = [
        {"planner": tag, "to": {"joints": q}, "duration": 0.1 * (k + 1)}
        for k, (tag, q) in enumerate(zip(tags, poses, strict=True))
    ]
    sequence["moves"].insert(2, {"planner": "hold", "duration": 0.7})
    plan = plan_of(sequence)
    assert plan is not None
    spans = plan.trajectory.spans
    assert [span.index for span in spans] == [0, 1, 2, 3, 4]
    assert [span.planner for span in spans] == ["quintic", "cubic", "hold", "cycloidal", "septic"]
    assert [a.end for a in spans[:-1]] == [b.start for b in spans[1:]]
    assert spans[-1].end == plan.trajectory.duration
    assert plan.trajectory.duration == pytest.approx(1.7, rel=1e-12)
    ends = plan.trajectory.curve.evaluate(np.array([span.end for span in spans]))
    np.testing.assert_allclose(ends, [poses[k] for k in (0, 1, 1, 2, 3)], rtol=0, atol=1e-12)


@pytest.mark.parametrize("tag", ["hold", "cycloidal"])
def test_a_move_that_starts_at_rest_refuses_another_start(tag: str) -> None:
    first = {"planner": "cubic", "to": {"joints": [1], "velocity": [0.5]}, "duration": 1}
    second = {"planner": tag, "duration": 1, **({"to": {"joints": [2]}} if tag == "cycloidal" else {})}
    with pytest.raises(PlanningError, match=rf"move 1 \({tag}\): .*velocity of j1 is 0.5 rad/s") as caught:
        plan_job(loaded(job_of(first, second)))
    (problem,) = caught.value.problems
    assert problem.move == 1
    assert problem.place is not None
    assert problem.hint


@pytest.mark.parametrize(
    "limit", few([{"velocity": 1}, {"acceleration": 1}, {"jerk": 1}, {"velocity": 1, "jerk": 5}], 2)
)
@pytest.mark.parametrize("tag", ["cubic", "quintic", "septic", "cycloidal"])
@pytest.mark.parametrize("displacement", few([1e-18, 3e-17, 1e-15, 1e-13, 1e-11, 1e-9], 4))
def test_a_tiny_move_late_in_a_job_passes(tag: str, limit: dict[str, float], displacement: float) -> None:
    job = job_of(
        {"planner": "hold", "duration": 9.7},
        {"planner": tag, "to": {"joints": [displacement]}},
        {"planner": "quintic", "to": {"joints": [0.2]}, "duration": 4},
        limits=limit,
    )
    plan = plan_of(job)
    assert plan is not None
    assert [finding for finding in plan.verdict.findings if finding.kind != "acceleration_jump"] == []
    assert plan.trajectory.curve.piece_ends()[1][-1, 0] == pytest.approx(0.2, abs=1e-12)


def test_a_move_may_only_tighten_limits() -> None:
    move = {"planner": "quintic", "to": {"joints": [1]}, "limits": {"velocity": 0.5}}
    plan = plan_of(job_of(move, {**move, "to": {"joints": [2]}, "limits": {}}, limits={"velocity": 1}))
    assert plan is not None
    first, second = plan.moves
    assert first.duration == pytest.approx(2 * second.duration, rel=1e-12)  # the peak scales with 1 / T
    assert plan.verdict.passed
    with pytest.raises(InputError, match="can only tighten"):
        plan_job(loaded(job_of({**move, "limits": {"velocity": 2}}, limits={"velocity": 1})))
