"""By how many times a tolerance joints and tool are off, against forward kinematics."""

from __future__ import annotations

import numpy as np
import pytest
from followed_paths import CASES

from trajcli.kinematics.following.follower import follower
from trajcli.kinematics.following.tolerance import Tolerance, ToleranceRatio, probes, tolerance_ratio
from trajcli.kinematics.following.tracking import track_branch
from trajcli.kinematics.forward import forward
from trajcli.kinematics.jacobian import jacobian

MADE = CASES["ur5e, pose on an arc"]
ARM = follower(MADE.robot, MADE.path.at_s, MADE.start, 0.0)
COARSE = track_branch(ARM, MADE.path.breaks)
S = np.linspace(0.1, 0.9, 5) * MADE.path.length
KNOWN = ARM.joint_state(S, "right", COARSE.evaluate(S))
ROWS = np.array([3, 1])


def ratio(**tolerance) -> ToleranceRatio:
    breaks = MADE.path.breaks
    return tolerance_ratio(ARM, Tolerance(**tolerance), breaks, COARSE.evaluate(probes(breaks)))


def changed(order, size):
    fitted = KNOWN.values[:, ROWS].copy()
    fitted[order, :, 1] += size
    return fitted


def test_what_is_exact_does_not_miss():
    assert ratio(position=1e-6, angle=1e-6)(KNOWN, ROWS, KNOWN.values[:, ROWS]).max() < 1e-6


def test_a_joint_that_is_off_moves_the_tool():
    fitted = changed(0, 1e-5)
    wanted, poses = MADE.path.poses.evaluate(S[ROWS])[0], forward(MADE.robot, fitted[0])
    aside = np.linalg.norm(wanted[:, :3, 3] - poses[:, :3, 3], axis=1)
    assert aside.min() > 1e-6
    np.testing.assert_allclose(ratio(position=1e-9, angle=1.0)(KNOWN, ROWS, fitted), aside / 1e-9, rtol=1e-6)
    np.testing.assert_allclose(ratio(position=1.0, angle=1e-9)(KNOWN, ROWS, fitted), 1e4, rtol=1e-6)


@pytest.mark.parametrize("order", [1, 2])
def test_a_rate_that_is_off_moves_the_tool_at_another_one(order):
    measure = ratio(position=1e-9, angle=1e3)
    off = jacobian(MADE.robot, KNOWN.values[0, ROWS])[:, :3, 1] * 1e-4
    racing = 1e-8 * ARM.length * np.abs(KNOWN.values[order, ROWS]).max(axis=1)
    allowed = 1e-9 * measure.tool_peaks[order - 1, 0] + racing
    expected = np.linalg.norm(off, axis=1) / allowed
    np.testing.assert_allclose(measure(KNOWN, ROWS, changed(order, 1e-4)), expected, rtol=1e-6)


def test_peaks_are_those_of_the_tool_and_of_any_joint():
    measure, s = ratio(), np.linspace(0, MADE.path.length, 2001)
    known = ARM.joint_state(s, "right", COARSE.evaluate(s))
    _, first, second = MADE.path.poses.evaluate(s)
    for rates, peaks in ((first, measure.tool_peaks[0]), (second, measure.tool_peaks[1])):
        sizes = [np.linalg.norm(part, axis=1).max() for part in (rates[:, :3], rates[:, 3:])]
        for size, peak in zip(sizes, peaks, strict=True):
            assert peak == pytest.approx(size, rel=1e-2) or size < 0.11 * peaks.max()
    np.testing.assert_allclose(
        measure.joint_peaks, np.abs(known.values[1:]).max(axis=(1, 2))[:, None].repeat(6, 1), rtol=2e-2
    )
