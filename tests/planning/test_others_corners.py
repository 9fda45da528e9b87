"""Programs with zones against what others make of the same corners: none is faster."""

from __future__ import annotations

import json

import numpy as np
import pytest
from extras import require_module
from tiers import few

from benchmarks.corner_rules import justblend, pilz
from benchmarks.flying_programs import planar_joints, random_joint_moves, without_zones
from trajcli.job.read import job_from_text
from trajcli.planning.plan import Plan, plan_job


def planned(job: dict) -> Plan:
    plan = plan_job(job_from_text(json.dumps(job)))
    assert plan.verdict.passed
    return plan


@pytest.mark.full
@pytest.mark.parametrize("seed", few(range(1, 25), 1))
def test_a_random_program_is_faster_than_by_other_rules(seed):
    """Pilz's blend of moves that stop, slowed until limits are kept, and the closed form of justblend."""
    require_module("justblend", "justblend")
    job = random_joint_moves(seed)
    moves, radii = planned(without_zones(job)).moves, [job["zone"] / 1e3] * 2
    ours = planned(job).trajectory.duration
    closed = justblend(moves, radii)
    assert closed is not None
    assert ours < 0.99 * min(closed, pilz(moves, radii))


def test_a_corner_by_justblend_is_what_its_author_measures():
    """A corner of 20 mm takes it 1.4913 s, where stopping takes 1.4573 s: measured with justblend 0.1.0 itself."""
    require_module("justblend", "justblend")
    moves = planned(without_zones(planar_joints(0.02))).moves
    assert justblend(moves, [0.02]) == pytest.approx(1.4913, abs=2e-4)


def test_a_blend_by_pilz_passes_limits_that_stopping_keeps():
    """Mixed while both run, the moves take less time; slowed until jerk is kept, more than with a stop."""
    plan = planned(without_zones(planar_joints(0.02)))
    slowed, generous = pilz(plan.moves, [0.02]), np.inf
    for radius in (0.05, 0.1):
        assert pilz(plan.moves, [radius]) < slowed
        generous = min(generous, pilz(plan.moves, [radius]))
    assert plan.trajectory.duration < generous
