"""Reference of a tool over time: on the right side of each corner, and on the same path when it goes slower."""

from __future__ import annotations

import numpy as np
import pytest
from followed_paths import CASES
from hermite_curves import hermite_pieces
from scipy.spatial.transform import Rotation

from trajcli.geometry.paths.chain import join
from trajcli.geometry.paths.orientation import AxisAngleOrientation, FixedOrientation
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.geometry.paths.position import Line, Pivot
from trajcli.kinematics.following.motion import ToolMotion, motion_along
from trajcli.kinematics.following.tolerance import Tolerance
from trajcli.kinematics.following.tool_path import ToolPath, ToolReference

CORNER = join([Line([0, 0, 0], [0.3, 0, 0]), Line([0.3, 0, 0], [0.3, 0.4, 0])])
PATH = ToolPath(PoseCurve(CORNER, FixedOrientation(np.eye(3), CORNER.length)), (True, True, True), "all")


def stopping(*s):
    """Return a law through values of s, at rest in each, with an acceleration of zero, a second apart."""
    states = np.zeros((3, len(s), 1))
    states[0, :, 0] = s
    return hermite_pieces(np.arange(len(s), dtype=float), states)


@pytest.mark.parametrize("factor", [1.0, 3.0])
@pytest.mark.parametrize("before", [1e-3, 1e-5, 1e-7])
def test_beside_a_stop_the_tool_is_on_its_own_segment(factor, before):
    """A quintic law is within 1e-18 m of the corner for some time, where s does not tell the segment."""
    law = stopping(0.0, 0.3, 0.7)
    motion = motion_along(PATH, law, law.breaks, Tolerance()).scaled(factor)
    np.testing.assert_allclose(motion.breaks, factor * np.arange(3), rtol=1e-15)
    times = factor * np.array([1 - before, 1 + before])
    for side in ("left", "right"):
        reference = motion.reference(times, side)
        assert np.abs(reference.second[0, 1:]).max() == 0  # along x, slowing down
        assert reference.second[0, 0] < 0
        assert np.abs(reference.second[1, [0, 2]]).max() == 0  # along y, speeding up
        assert reference.second[1, 1] > 0


def test_at_a_stop_both_sides_are_told():
    law = hermite_pieces(
        np.arange(3.0), np.array([[0.0, 0.3, 0.7], [0, 0, 0]])[:, :, None]
    )  # cubic: it steps
    motion = motion_along(PATH, law, law.breaks, Tolerance())
    left, right = (motion.reference(np.array([1.0]), side).second[0, :3] for side in ("left", "right"))
    np.testing.assert_allclose(left, [-6 * 0.3, 0, 0], atol=1e-12)
    np.testing.assert_allclose(right, [0, 6 * 0.4, 0], atol=1e-12)


@pytest.mark.parametrize("name", ["ur5e, yaw of x", "ur5e, pitch of y", "ur5e, pose on an arc"])
def test_the_same_way_in_more_time(name):
    """Rates of the slower motion are finite differences of its reference."""
    path = CASES[name].path
    law = stopping(0.0, path.length)
    motion = motion_along(path, law, law.breaks, Tolerance()).scaled(2.5)
    step, times = 1e-4, np.array([0.6, 1.3, 2.2])
    before, here, after = (motion.reference(times + shift) for shift in (-step, 0, step))
    for order in (0, 1):
        if here.aims.shape[1]:
            slope = (after.aims[:, order] - before.aims[:, order]) / (2 * step)
            np.testing.assert_allclose(here.aims[:, order + 1], slope, rtol=0, atol=1e-7)
    moved = (after.poses[:, :3, 3] - before.poses[:, :3, 3]) / (2 * step)
    np.testing.assert_allclose(here.first[:, :3], moved, rtol=0, atol=1e-7)
    changed = (after.first - before.first) / (2 * step)
    np.testing.assert_allclose(here.second, changed, rtol=0, atol=1e-7)
    np.testing.assert_allclose(
        motion.reference(np.array([2.5])).poses, motion.reference(np.array([9.0])).poses
    )


def test_breaks_of_path_and_law_that_are_one_are_one():
    law = stopping(0.0, 0.3 - 1e-14, 0.7)
    motion = motion_along(PATH, law, law.breaks, Tolerance())
    assert motion.breaks.tolist() == [0.0, 1.0, 2.0]
    through = hermite_pieces(np.array([0.0, 2.0]), np.array([[0.0, 0.7], [0, 0], [0, 0]])[:, :, None])
    breaks = motion_along(PATH, through, through.breaks, Tolerance()).breaks
    assert breaks.size == 3
    assert through.evaluate(breaks[1])[0] == pytest.approx(0.3, abs=1e-15)


def test_a_motion_in_more_time_is_made_of_what_is_said_of_it_at_the_same_places():
    """Of x = sin t, with an aim and a pinned joint likewise: each derivative by a factor of time less, from either side."""
    asked = []

    def reference_at(times, side):
        asked.append((times.tolist(), side))
        waves = np.stack([np.sin(times), np.cos(times), -np.sin(times)])
        first, second = (np.outer(wave, np.arange(1.0, 7.0)) for wave in waves[1:])
        poses = np.tile(np.eye(4), (times.size, 1, 1))
        pins = np.stack([waves, 2 * waves], axis=-1)
        return ToolReference(poses, first, second, (True,) * 3, "yaw", "x", waves.T.copy(), (1, 3), pins)

    law = hermite_pieces(np.array([0.0, 1.0, 2.0]), np.array([[0.0, 0.3, 0.7], [0, 0, 0]])[:, :, None])
    motion = ToolMotion(None, law, reference_at, law.breaks, Tolerance(), True, "rotation", True)
    assert motion.length == pytest.approx(0.7)
    motion.reference(np.array([-1.0, 1.5, 3.0]))
    assert asked[-1] == ([0.0, 1.5, 2.0], "right")
    slower = motion.scaled(4.0)
    assert (slower.law.start, slower.law.end, slower.breaks.tolist()) == (0.0, 8.0, [0.0, 4.0, 8.0])
    assert slower.length == pytest.approx(0.7)
    assert (slower.pure_rotation, slower.ruled_by, slower.overlaps) == (True, "rotation", True)
    times = np.array([-1.0, 2.0, 4.0, 9.0])
    for side in ("left", "right"):
        found = slower.reference(times, side)
        assert asked[-1] == ([0.0, 0.5, 1.0, 2.0], side)
        t = np.clip(times / 4, 0, 2)
        waves = np.stack([np.sin(t), np.cos(t) / 4, -np.sin(t) / 16])
        np.testing.assert_allclose(found.aims, waves.T, rtol=1e-15)
        np.testing.assert_allclose(found.pins, np.stack([waves, 2 * waves], axis=-1), rtol=1e-15)
        np.testing.assert_allclose(found.first, np.outer(waves[1], np.arange(1, 7)), rtol=1e-15)
        np.testing.assert_allclose(found.second, np.outer(waves[2], np.arange(1, 7)), rtol=1e-15)


def test_a_motion_along_a_path_knows_the_path_and_what_rules_its_speed():
    law = stopping(0.0, 0.3, 0.7)
    motion = motion_along(PATH, law, law.breaks, Tolerance(), "translation")
    assert (motion.length, motion.ruled_by, motion.pure_rotation) == (
        pytest.approx(0.7),
        "translation",
        False,
    )
    turn = AxisAngleOrientation.between(np.eye(3), Rotation.from_rotvec([0, 0, 0.5]).as_matrix(), 0.5)
    path = ToolPath(PoseCurve(Pivot([0.1, 0.2, 0.3], [0.1, 0.2, 0.3], 0.5), turn), (True, True, True), "all")
    assert motion_along(path, stopping(0.0, 0.5), np.array([0.0, 1.0]), Tolerance()).pure_rotation
