"""By how many times a tolerance joints and tool are off, against forward kinematics."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from followed_paths import CASES

from trajcli.geometry.paths.orientation import AxisAngleOrientation, FixedOrientation
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.geometry.paths.position import Line, Pivot
from trajcli.geometry.rotation import exp
from trajcli.kinematics.following.follower import follower
from trajcli.kinematics.following.tolerance import (
    Tolerance,
    ToleranceRatio,
    _by_kind,
    _floored,
    probes,
    tolerance_ratio,
)
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.following.tracking import track_branch
from trajcli.kinematics.forward import forward
from trajcli.kinematics.jacobian import jacobian
from trajcli.kinematics.robot import Joint, Robot, unlimited

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


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_two_parallel_joints_turn_the_tool_by_their_sum(order, sign):
    """Of a UR5e the second and the third: with the same sign it turns by both, against each other by none of them."""
    measure, off = ratio(position=1e3, angle=1e-9), sign * 1e-4
    exact = np.abs(KNOWN.values[order, ROWS]).max(axis=1)
    joint_peak = 1.0 if order == 0 else np.maximum(measure.joint_peaks[order - 1, 0], exact)
    tool_peak = 1.0 if order == 0 else measure.tool_peaks[order - 1, 1]
    racing = 0.0 if order == 0 else 1e-8 * exact
    of_joint, of_tool = 1e-4 / (1e-9 * joint_peak), 2e-4 / (1e-9 * tool_peak + racing)
    fitted = changed(order, off)
    fitted[order, :, 2] += off
    np.testing.assert_allclose(measure(KNOWN, ROWS, fitted), np.maximum(of_tool, of_joint), rtol=1e-4)
    fitted[order, :, 2] -= 2 * off
    np.testing.assert_allclose(measure(KNOWN, ROWS, fitted), of_joint, rtol=1e-6)
    if order == 0:
        assert np.all(of_tool > of_joint)


@pytest.mark.parametrize("order", [1, 2])
def test_where_joints_race_they_are_measured_by_themselves(order):
    """At the rows they are thousands of times as fast as was seen between breaks."""
    measure = ratio(position=1e3, angle=1e-9)
    slow = replace(measure, joint_peaks=1e-3 * measure.joint_peaks, tool_peaks=1e9 * measure.tool_peaks)
    fitted = changed(order, 1e-4)
    exact = np.abs(KNOWN.values[order, ROWS]).max()
    assert slow.joint_peaks[order - 1, 0] < exact
    np.testing.assert_allclose(slow(KNOWN, ROWS, fitted), 1e-4 / (1e-9 * exact), rtol=1e-6)


def test_joints_that_slide_are_measured_in_metres_by_those_that_slide():
    rates = np.array([[1.0, -7.0, 0.2, 0.1], [-3.0, 2.0, 0.4, -0.6]])
    turning = np.array([True, True, False, False])
    assert _by_kind(rates, turning).tolist() == [7.0, 7.0, 0.6, 0.6]
    assert _by_kind(rates, ~turning).tolist() == [7.0, 7.0, 0.6, 0.6]
    kinds = ("revolute", "prismatic", "revolute")
    joints = tuple(Joint(f"q{k}", kind) for k, kind in enumerate(kinds))
    arm = SimpleNamespace(
        robot=Robot("mixed", joints, unlimited(3), "standard", np.eye(4), np.eye(4)), length=1.0
    )
    measure = ToleranceRatio(arm, Tolerance(2e-6, 3e-5), np.ones((2, 3)), np.ones((2, 2)))  # type: ignore[arg-type]
    assert measure._joint.tolist() == [3e-5, 2e-6, 3e-5]


@pytest.mark.parametrize("order", [1, 2])
def test_a_rate_of_turning_is_measured_beside_that_of_moving(order):
    """Joints that may be off by anything, and a tool whose position may, too."""
    measure = ratio(position=1e3, angle=1e-9)
    free = replace(measure, joint_peaks=1e12 * measure.joint_peaks)
    racing = 1e-8 * np.abs(KNOWN.values[order, ROWS]).max(axis=1)
    wanted = 1e-4 / (1e-9 * measure.tool_peaks[order - 1, 1] + racing)
    np.testing.assert_allclose(free(KNOWN, ROWS, changed(order, 1e-4)), wanted, rtol=1e-6)


@pytest.mark.parametrize("turning", [False, True])
def test_what_the_tool_does_not_do_is_measured_by_what_it_does(turning):
    """A line without a turn: of the turn a tenth of what moves a point of the arm's length so fast; and a turn alone."""
    pose = forward(MADE.robot, MADE.start)
    start, length = pose[:3, 3], ARM.length
    if turning:
        orientation = AxisAngleOrientation.between(
            pose[:3, :3], exp(np.array([0.0, 0.0, 0.2])) @ pose[:3, :3]
        )
        path = ToolPath(PoseCurve(Pivot(start, start, orientation.length), orientation), (True,) * 3, "all")
    else:
        line = Line(start, start + np.array([0.0, 0.0, 0.1]))
        path = ToolPath(PoseCurve(line, FixedOrientation(pose[:3, :3], line.length)), (True,) * 3, "all")
    arm = follower(MADE.robot, path.at_s, MADE.start, 0.0)
    coarse = track_branch(arm, path.breaks)
    measure = tolerance_ratio(arm, Tolerance(), path.breaks, coarse.evaluate(probes(path.breaks)))
    wanted = [0.1 * length, 1.0] if turning else [1.0, 0.1 / length]
    np.testing.assert_allclose(measure.tool_peaks[0], wanted, rtol=1e-6)


@pytest.mark.parametrize("breaks", [[0.0, 1.0], [0.5, 1.0, 3.0], np.linspace(2.0, 4.0, 40)])
def test_peaks_are_looked_for_inside_of_all_segments(breaks):
    """As often in each, at the same places seen from either end of it."""
    breaks = np.asarray(breaks)
    count = breaks.size - 1
    shares = (probes(breaks).reshape(count, -1) - breaks[:-1, None]) / np.diff(breaks)[:, None]
    assert shares.size >= 33
    assert (np.diff(shares, axis=1) > 0).all()
    assert ((shares > 0) & (shares < 1)).all()
    np.testing.assert_allclose(shares, 1 - shares[:, ::-1], atol=1e-12)
    np.testing.assert_allclose(shares, np.tile(shares[0], (count, 1)), atol=1e-12)


@pytest.mark.parametrize("duration", [0.5, 20.0])
def test_what_hardly_moves_is_measured_by_a_thousandth_of_what_does(duration):
    """An acceleration at least by what gets to that speed in the whole of the time; at rest a micrometre counts."""
    speeds, rates = _floored(np.array([[10.0, 1e-9], [0.0, 7.0]]), duration)
    np.testing.assert_allclose(speeds, [10.0, 1e-2])
    np.testing.assert_allclose(rates, [10.0 / duration, 7.0])
    speeds, rates = _floored(np.zeros((2, 2)), duration)
    np.testing.assert_allclose(speeds, 1e-6 / duration)
    np.testing.assert_allclose(rates, 1e-6 / duration**2)
