"""The planner waypoints on reference problems: durations, bounds, limits."""

from __future__ import annotations

import numpy as np
import pytest
from tiers import few
from waypoint_problems import LISTS, missed, most_used, planned, stopping

ONE_JOINT = [pytest.param(case, id=case["id"]) for case in LISTS["one_joint"]]
EXAMPLES = [pytest.param(case, id=case["id"]) for case in LISTS["examples"] if len(case["waypoints"]) < 10]
FEW = np.random.default_rng(7).choice(len(LISTS["waypoints"]), len(few(range(8), 2)), replace=False)
WANTED, NEVER = 1.002, 1.03


def judged(case, plan):
    """Check what holds for every motion; return its duration over the best that is known."""
    duration, known = plan.trajectory.duration, case.get("best", case.get("optimum"))
    certificate = plan.moves[0].planned.certificate
    assert missed(plan, case) < 1e-12
    assert most_used(plan, case) < 1 + 1e-9
    assert certificate.lower <= min(duration, known) * (1 + 1e-7)
    if "lower" in case:
        assert certificate.lower >= case["lower"] * (1 - 1e-6)
    if "ends" not in case:
        assert certificate.stopping == pytest.approx(stopping(case), rel=1e-8)
        assert duration <= stopping(case) * (1 + 1e-9)
    return duration / known


@pytest.mark.full
@pytest.mark.parametrize("case", few(EXAMPLES, 2))
def test_documented_examples_reach_their_goals(case):
    plan = planned(case)
    judged(case, plan)
    assert plan.trajectory.duration <= case["goal"]


@pytest.mark.parametrize("case", few(ONE_JOINT, 5))
def test_one_joint_against_brute_force(case):
    assert judged(case, planned(case)) <= 1.001


@pytest.mark.full
def test_some_random_lists():
    ratios = [judged(case, planned(case)) for case in (LISTS["waypoints"][k] for k in FEW.tolist())]
    assert np.quantile(ratios, 0.9) <= WANTED
    assert max(ratios) <= NEVER


@pytest.mark.soak
def test_all_random_lists():
    ratios = [judged(case, planned(case)) for case in LISTS["waypoints"]]
    assert np.mean(np.array(ratios) <= WANTED) >= 0.9
    assert max(ratios) <= NEVER


@pytest.mark.soak
def test_long_lists():
    for case in LISTS["examples"]:
        if len(case["waypoints"]) >= 10:
            assert judged(case, planned(case)) <= WANTED
