"""The bound of motions through points: by hand, and below every motion that passes them."""

from __future__ import annotations

import json

import numpy as np
import pytest
import random_jobs
from tiers import few

from trajcli.errors import TrajcliError
from trajcli.job.read import job_from_text
from trajcli.peers.lower_bound import duration_through
from trajcli.peers.move_reference import reference_of
from trajcli.planning.plan import plan_job


def job(moves: list[dict], jerk: float | None) -> str:
    limits = {"velocity": 2, "acceleration": 8, **({} if jerk is None else {"jerk": jerk})}
    head = {"version": 1, "robot": {"joints": 2}, "limits": limits, "start": {"joints": [0, 0]}}
    return json.dumps({**head, "moves": moves})


def test_there_and_back_takes_two_moves_from_rest_to_rest() -> None:
    """A joint that turns at 1 rad stands there: trapezoids over 1 rad take 1 / 2 + 2 / 8 s each."""
    through = [{"joints": [1.0, 0.1]}, {"joints": [0.0, 0.2]}, {"joints": [1.0, 0.3]}]
    move = {"planner": "spline", "through": through, "to": {"joints": [0.0, 0.4]}}
    (planned,) = plan_job(job_from_text(job([move], None))).moves
    found = reference_of(planned)
    assert found.duration == pytest.approx(4 * 0.75, rel=1e-9)
    assert (found.through_points, found.joint) == (True, "j1")
    assert found.ratio == pytest.approx(planned.duration / 3.0, rel=1e-9)


def test_joints_that_are_slow_in_turn_bound_it_together() -> None:
    """2 rad of one joint, then 2 rad of the other, at 2 rad/s: two seconds, and each alone takes 1.25 s."""
    points = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 2.0]])
    text = job(
        [{"planner": "spline", "through": [{"joints": [2.0, 0.0]}], "to": {"joints": [2.0, 2.0]}}], None
    )
    (planned,) = plan_job(job_from_text(text)).moves
    limits = planned.robot.limits
    found = duration_through(points, planned.start, planned.planned.end, limits)
    assert (found.duration, found.joint) == (pytest.approx(2.0, rel=1e-9), None)
    assert reference_of(planned).duration == pytest.approx(2.0, rel=1e-9)


@pytest.mark.parametrize("planner", few(["spline", "waypoints", "time_optimal"], 1))
def test_no_motion_through_points_is_below_it(planner: str) -> None:
    """Motions of three planners, found by search, optimal control and splines, are no faster."""
    tried = 0
    for seed in few(range(40), 3):
        rng = np.random.default_rng(seed)
        points = rng.uniform(-2, 2, (int(rng.integers(2, 5)), 2)).round(3).tolist()
        move = {"planner": planner, "through": [{"joints": q} for q in points[:-1]]}
        move |= {"to": {"joints": points[-1]}}
        try:
            (planned,) = plan_job(job_from_text(job([move], 60.0))).moves
        except TrajcliError:
            continue
        via = planned.planned.via_points
        if via is None or via.missed.max() > 1e-12:
            continue
        found = reference_of(planned)
        assert found.ratio is not None
        assert found.ratio >= 1 - 1e-9, (seed, planner)
        tried += 1
    assert tried >= 2


def test_points_that_are_passed_at_a_distance_bound_nothing() -> None:
    move = {
        "planner": "blends",
        "through": [{"joints": [1, 0.1]}, {"joints": [0, 0.2]}],
        "to": {"joints": [1, 0.3]},
    }
    (planned,) = plan_job(job_from_text(job([move], None))).moves
    assert not reference_of(planned).through_points


def test_random_moves_are_never_faster_than_their_bound() -> None:
    for seed in few(range(30), 4):
        rng = np.random.default_rng(seed)
        fields = random_jobs.random_job(rng, "spline", 2, rest=bool(seed % 2), unlimited=0.0)
        try:
            with np.errstate(all="ignore"):
                plan = plan_job(random_jobs.loaded(fields | {"when_over_limit": "slow"}))
        except TrajcliError:
            continue
        for move in plan.moves if plan.verdict.passed else ():
            found = reference_of(move)
            assert found.ratio is None or found.ratio >= 1 - 1e-9, seed
