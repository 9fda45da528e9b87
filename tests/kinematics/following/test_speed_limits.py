"""Limits of speed that step along a path, and pinned joints, against dense samples and finite differences."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from followed_paths import CASES
from hermite_curves import hermite_pieces

from trajcli.geometry.paths.chain import join
from trajcli.geometry.paths.orientation import FixedOrientation, SegmentProgress
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.geometry.paths.position import Line
from trajcli.kinematics.following.tool_path import PinnedJoint, SpeedLimits, ToolPath

BORDERS = np.array([0.0, 1.0, 1.5, 3.0, 4.0])
SPEED, ANGULAR = np.array([2.0, 5.0, 1.0, 3.0]), np.array([0.1, 0.4, 0.3, np.inf])
STEPS = SpeedLimits(BORDERS, (0, 1, 2, 3, 4), SPEED, ANGULAR)


def test_at_a_border_each_side_has_its_own_limits():
    s = np.array([0.0, 0.99, 1.0, 1.2, 1.5, 2.9, 3.0, 4.0])
    for side, rows in (("right", [0, 0, 1, 1, 2, 2, 3, 3]), ("left", [0, 0, 0, 1, 1, 2, 2, 3])):
        speed, angular = STEPS.at(s, side)
        assert speed.tolist() == SPEED[rows].tolist()
        assert angular.tolist() == ANGULAR[rows].tolist()


def test_between_neighbours_the_largest_of_all_intervals_that_they_touch_counts():
    rng = np.random.default_rng(4)
    for _ in range(40):
        s = np.unique(np.concatenate([rng.choice(BORDERS, 3), rng.uniform(0.0, 4.0, 3)]))
        speed, angular = STEPS.most_between(s)
        for k, (low, high) in enumerate(pairwise(s)):
            inside = low + (high - low) * (np.arange(400) + 0.5) / 400
            row = np.clip(np.searchsorted(BORDERS, inside, "right") - 1, 0, 3)
            assert (speed[k], angular[k]) == (SPEED[row].max(), ANGULAR[row].max())


def chain(pinned=(), speeds=None):
    corner = join([Line([0, 0, 0], [0.3, 0, 0]), Line([0.3, 0, 0], [0.3, 0.4, 0])])
    poses = PoseCurve(corner, FixedOrientation(np.eye(3), corner.length))
    return ToolPath(poses, (True, True, True), "all", speeds=speeds, pinned=pinned)


def test_breaks_are_those_of_the_path_and_of_its_limits_once_each():
    assert chain().breaks.tolist() == [0.0, 0.3, 0.7]
    ones = np.ones(3)
    steps = SpeedLimits(np.array([0.0, 0.1, 0.3, 0.7]), (0, 1, 2, 3), ones, ones)
    assert chain(speeds=steps).breaks.tolist() == [0.0, 0.1, 0.3, 0.7]


def test_near_a_break_an_s_is_at_it_and_beyond_the_ends_at_the_ends():
    path = chain()
    for off in (-1e-14, 1e-14):
        for side, direction in (("left", [1, 0, 0]), ("right", [0, 1, 0])):
            here = path.at_s(np.array([0.3 + off]), side)
            assert here.first[0, :3].tolist() == direction
    for off, direction in ((-1e-9, [1, 0, 0]), (1e-9, [0, 1, 0])):
        for side in ("left", "right"):
            assert path.at_s(np.array([0.3 + off]), side).first[0, :3].tolist() == direction
    ends = path.at_s(np.array([-1e-15, 0.7 + 1e-15]), "right").poses[:, :3, 3]
    assert ends == pytest.approx(np.array([[0, 0, 0], [0.3, 0.4, 0]]), abs=1e-16)


@pytest.mark.parametrize("name", ["ur5e, pose on an arc", "ur5e, pitch of y", "ur5e, direction of x"])
def test_rates_by_time_are_differences_of_what_they_are_rates_of(name):
    """Also those of joints that are pinned: evenly over s, not over time."""
    pins = (PinnedJoint(2, 0.5, -1.1), PinnedJoint(0, 0.0, 0.3))
    path = replace(CASES[name].path, pinned=pins)
    states = np.array([[0.0, 0.4, 1.0], [0.0, 0.7, 0.0], [0.0, 0.1, 0.0]])[:, :, None] * path.length
    law = hermite_pieces(np.array([0.0, 0.8, 2.0]), states)
    times, step = np.array([0.3, 0.7, 1.1, 1.9]), 1e-4
    none = np.empty(0)
    at = [path.at_time(law, times + shift, "right", none) for shift in (-step, 0.0, step)]
    s = law.evaluate(times)[:, 0] / path.length
    assert at[1].pinned == (2, 0)
    assert at[1].pins[0] == pytest.approx(np.stack([0.5 - 1.6 * s, 0.3 * s], axis=1))
    for order in (0, 1):
        slope = (at[2].pins[order] - at[0].pins[order]) / (2 * step)
        assert at[1].pins[order + 1] == pytest.approx(slope, abs=1e-6)
    moved = (at[2].poses[:, :3, 3] - at[0].poses[:, :3, 3]) / (2 * step)
    assert at[1].first[:, :3] == pytest.approx(moved, abs=1e-6)
    assert at[1].second == pytest.approx((at[2].first - at[0].first) / (2 * step), abs=1e-5)
    turned = np.einsum(
        "nij,nkj->nik", at[2].poses[:, :3, :3] - at[0].poses[:, :3, :3], at[1].poses[:, :3, :3]
    )
    spin = np.stack([turned[:, 2, 1], turned[:, 0, 2], turned[:, 1, 0]], axis=1) / (2 * step)
    assert at[1].first[:, 3:] == pytest.approx(spin, abs=1e-6)


def test_two_segments_have_their_angles_one_after_the_other():
    """The heading is the sum of what the segments before have turned."""
    corner = join([Line([0, 0, 0], [0.3, 0, 0]), Line([0.3, 0, 0], [0.3, 0.4, 0])])
    poses = PoseCurve(corner, FixedOrientation(np.eye(3), corner.length))
    progress = SegmentProgress(np.array([0.0, 0.3, 0.7]), np.zeros(1))
    path = ToolPath(poses, (True, True, True), "yaw", "x", (0.5, -0.2), progress)
    headings = path.at_s(np.array([0.0, 0.15, 0.3, 0.5, 0.7]), "right").aims[:, 0]
    assert headings == pytest.approx([0.0, 0.25, 0.5, 0.4, 0.3])


def test_headings_that_fade_into_each_other_have_the_rates_of_differences():
    progress = SegmentProgress(np.array([0.0, 0.3, 0.7]), np.array([0.1]))
    path = replace(chain(), orientation="yaw", tool_axis="x", angle_changes=(0.5, -0.2), progress=progress)
    states = np.array([[0.0, 0.25, 0.7], [0.0, 0.4, 0.0], [0.0, 0.1, 0.0]])[:, :, None]
    law = hermite_pieces(np.array([0.0, 0.8, 2.0]), states)
    times, step = np.array([0.7, 0.9, 1.0, 1.7]), 1e-4
    crossings = path.crossings(law, law.breaks)
    at = [path.at_time(law, times + shift, "right", crossings) for shift in (-step, 0.0, step)]
    for order in (0, 1):
        slope = (at[2].aims[:, order] - at[0].aims[:, order]) / (2 * step)
        assert at[1].aims[:, order + 1] == pytest.approx(slope, abs=1e-5)
    assert np.abs(at[1].aims[:3, 2]).min() > 0.1


def test_a_law_whose_break_is_shortly_before_a_corner_passes_it_when_it_does():
    """A break of its own that is a ten-thousandth of the duration away is another time."""
    path = chain()
    for early in (1e-4, -1e-4, 1e-6):
        states = np.array([[0.0, 0.3 - 0.35 * early, 0.7], [0.0, 0.35, 0.0], [0.0, 0.0, 0.0]])[:, :, None]
        law = hermite_pieces(np.array([0.0, 1.0, 2.0]), states)
        (when,) = path.crossings(law, law.breaks)
        assert when == pytest.approx(1.0 + early, abs=1e-8)
        assert law.evaluate(np.array([when]))[0, 0] == pytest.approx(0.3, abs=1e-13)


def test_beside_a_stop_the_tool_is_where_the_law_is():
    states = np.array([[0.0, 0.3, 0.7], [0, 0, 0], [0, 0, 0]], dtype=float)[:, :, None]
    law, path = hermite_pieces(np.array([0.0, 1.0, 2.0]), states), chain()
    times = np.array([0.9, 0.999, 1.0, 1.001, 1.1])
    crossings = path.crossings(law, law.breaks)
    assert crossings.tolist() == [1.0]
    s = law.evaluate(times)[:, 0]
    expected = np.stack([np.minimum(s, 0.3), np.maximum(s - 0.3, 0.0)], axis=1)
    for side in ("left", "right"):
        assert path.at_time(law, times, side, crossings).poses[:, :2, 3] == pytest.approx(expected, abs=1e-12)
