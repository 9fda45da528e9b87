"""The verdict: all checks over one set of peaks."""

from __future__ import annotations

import numpy as np
import pytest
from motions import between, limits, state, trajectory

from trajcli.checks.continuity import acceleration_steps, check_continuity
from trajcli.checks.verify import check_limits, verify
from trajcli.curves.piecewise import PiecewisePolynomial


def test_a_valid_motion_passes_and_says_its_peaks() -> None:
    whole = trajectory(
        between([0.0, 5.0], [1.0, 5.0], duration=2.0), between([1.0, 5.0], [0.0, 3.0], duration=4.0)
    )
    verdict = verify(whole, [limits(2, position=6.0, velocity=1.0, acceleration=2.0, jerk=8.0)] * 2)
    assert verdict.passed
    assert (verdict.findings, list(verdict.steps), verdict.unchecked) == ((), [], ())
    assert len(verdict.peaks) == 2
    assert verdict.peaks[0][1].high == pytest.approx([1.875 / 2, 0.0])
    assert verdict.peaks[1][1].low == pytest.approx([-1.875 / 4, -1.875 / 2])
    assert verdict.peaks[1][3].magnitude == pytest.approx([60 / 64, 120 / 64])


def test_the_verdict_holds_what_the_checks_find_by_move_and_time() -> None:
    first, second = between([0.0], [1.0], duration=1.0, conditions=2), between([1.2], [0.0], duration=1.0)
    whole = trajectory(first, second, start=state([0.0], velocity=0.1))
    bounds = [limits(velocity=1.0), limits(acceleration=1.0, jerk=30.0)]
    verdict = verify(whole, bounds)
    assert not verdict.passed
    assert [(f.move, f.kind) for f in verdict.findings] == [
        (0, "velocity_jump"),
        (0, "velocity"),
        (1, "jerk"),
        (1, "position_jump"),
        (1, "acceleration"),
    ]
    separate = check_limits(whole, bounds) + check_continuity(whole, bounds)
    assert {(f.move, f.time, f.text()) for f in verdict.findings} == {
        (f.move, f.time, f.text()) for f in separate
    }
    assert list(verdict.steps) == list(acceleration_steps(whole, bounds))
    assert [(s.move, s.time) for s in verdict.steps] == [(0, 0.0), (0, 1.0)]


def test_what_nobody_limits_is_said() -> None:
    whole = trajectory(between([0.0, 0.0], [1.0, 1.0]), between([1.0, 1.0], [0.0, 0.0]))
    all_bounded = limits(2, position=9.0, velocity=9.0, acceleration=9.0, jerk=99.0)
    one_sided = np.array([[-9.0, np.inf], [-9.0, 9.0]])
    open_ended = limits(2, position=9.0, velocity=one_sided, acceleration=9.0)
    assert verify(whole, [all_bounded, all_bounded]).unchecked == ()
    expected = (("j1", "velocity"), ("j1", "jerk"), ("j2", "jerk"))
    assert verify(whole, [all_bounded, open_ended]).unchecked == expected


def test_limits_must_be_as_many_as_moves() -> None:
    with pytest.raises(ValueError):
        verify(trajectory(between([0.0], [1.0])), [])


def test_ten_thousand_pieces_give_one_finding_for_each_move_joint_and_kind() -> None:
    rng = np.random.default_rng(2)
    curve = PiecewisePolynomial(np.arange(10_001) * 0.1, rng.normal(size=(4, 10_000, 6)))
    verdict = verify(trajectory(curve), [limits(6, velocity=1.0)])
    assert {f.kind for f in verdict.findings} == {"velocity", "position_jump", "velocity_jump"}
    assert len(verdict.findings) == 18
