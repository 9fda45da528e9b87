"""Verdicts on velocities near the ends of ranges: mutants that are over by little, or judged by other numbers."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from motions import between, limits, state, trajectory

from trajcli.checks.verify import verify
from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.findings import Finding
from trajcli.kinematics.robot import Limits
from trajcli.trajectory import Trajectory

# FR3's joint 1 (libfranka test/fr3.urdf): range, deceleration and offset
END, D, OFFSET = 2.7501, 6.0, 0.30


def near(d: float = D, o: float = OFFSET, end: float = END) -> Limits:
    return dataclasses.replace(limits(position=end), velocity_by_position=np.array([[d, o]]))


def findings(move: Trajectory, of: Limits) -> list[Finding]:
    return [f for f in verify(move, [of]).findings if f.kind == "velocity_by_position"]


def sampled_use(curve: PiecewisePolynomial) -> float:
    """Return the largest v / (sqrt(2 d x) - o) by its definition at many times."""
    t = np.linspace(curve.start, curve.end, 40_001)
    q, v = curve.evaluate(t)[:, 0], curve.evaluate(t, 1)[:, 0]
    bound = np.sqrt(2 * D * np.where(v > 0, END - q, q + END)) - OFFSET
    return float((np.abs(v) / bound).max())


@pytest.mark.parametrize("target", [2.6, -2.6])
def test_a_motion_over_by_a_hundredth_of_a_per_cent_is_seen_and_one_at_the_limit_is_not(
    target: float,
) -> None:
    curve = between([0.0], [target], duration=1.0)
    used = sampled_use(curve)
    assert used > 1
    inside, over = (trajectory(scale_time(curve, used * k)) for k in (1 + 1e-7, 1 - 1e-4))
    assert findings(inside, near()) == []
    (found,) = findings(over, near())
    assert (found.move, found.joint, found.method) == (0, "j1", "exact")
    assert found.value / found.limit == pytest.approx(1.0001, abs=2e-6)
    assert over.curve.evaluate(found.time, 1)[0] == pytest.approx(found.value, rel=1e-9)
    q = over.curve.evaluate(found.time)[0]
    assert abs(found.limit) == pytest.approx(np.sqrt(2 * D * (END - abs(q))) - OFFSET, rel=1e-9)
    assert np.sign(found.limit) == np.sign(target)


@pytest.mark.parametrize("mutant", [near(d=10 * D), near(o=OFFSET / 10), near(d=D / 10), near(o=10 * OFFSET)])
def test_a_deceleration_or_an_offset_that_is_ten_times_off_is_noticed(mutant: Limits) -> None:
    curve = between([0.0], [2.6], duration=1.0)
    move = trajectory(scale_time(curve, sampled_use(curve)))
    own, other = findings(move, near(end=END - 1e-6)), findings(move, mutant)
    loose = mutant.velocity_by_position[0, 0] > D or mutant.velocity_by_position[0, 1] < OFFSET
    assert own
    assert bool(other) is not loose


def test_the_factor_is_the_stretch_after_which_the_limit_holds() -> None:
    curve = between([0.0], [2.6], duration=0.7)
    (found,) = findings(trajectory(curve), near())
    assert found.factor == pytest.approx(sampled_use(curve), rel=1e-9)
    assert findings(trajectory(scale_time(curve, found.factor)), near()) == []
    assert findings(trajectory(scale_time(curve, found.factor * 0.9999)), near()) != []
    assert found.hint is not None
    assert "it must last" in found.hint


def test_no_stretch_helps_where_the_joint_may_not_move_at_all() -> None:
    zone = OFFSET**2 / (2 * D)
    assert zone == pytest.approx(7.5e-3)  # of FR3's joint 1
    (found,) = findings(trajectory(between([0.0], [END - 0.9 * zone], duration=60.0)), near())
    assert (found.factor, found.limit) == (None, 0.0)
    assert "slowing down does not help" in str(found.hint)
    assert findings(trajectory(between([END - 0.9 * zone], [0.0], duration=60.0)), near()) == []


def test_a_joint_at_rest_beside_its_limit_is_no_finding() -> None:
    assert findings(trajectory(between([END - 1e-4], [END - 1e-4], duration=1.0)), near()) == []


def test_each_move_is_judged_by_its_own_part_of_the_curve() -> None:
    slow, fast = between([0.0], [2.6], duration=20.0), between([2.6], [-2.6], duration=1.0)
    move = trajectory(slow, fast)
    (found,) = [f for f in verify(move, [near(), near()]).findings if f.kind == "velocity_by_position"]
    assert found.move == 1
    assert found.time > 20


def test_a_move_that_starts_too_fast_is_told_that_slowing_does_not_help() -> None:
    curve = PiecewisePolynomial(np.array([0.0, 0.1]), np.array([[[-5.0]], [[1.0]], [[2.7]]]))
    move = trajectory(curve, start=state([2.7], 1.0), end=state([2.75], 0.0))
    (found,) = findings(move, near())
    assert found.time == pytest.approx(0.1, abs=0.1)


def test_limits_by_position_need_a_range() -> None:
    with pytest.raises(ValueError, match="needs position limits"):
        dataclasses.replace(limits(), velocity_by_position=np.array([[D, OFFSET]]))
