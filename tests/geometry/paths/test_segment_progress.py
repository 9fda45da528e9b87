"""Values that go along segments against what a user computes from the borders: lines, and even rates between blends."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.geometry.paths.orientation import SegmentProgress

TARGETS = np.array([[0.3, 1.0], [0.9, -2.0], [-1.5, 0.0], [0.4, 0.4]])
BORDERS = np.array([0.0, 0.5, 2.0, 2.8])


def test_without_blends_values_are_straight_from_border_to_border():
    progress = SegmentProgress(BORDERS, np.zeros(2))
    s = np.linspace(0.0, 2.8, 57)
    values, slopes, bends = progress.between(TARGETS, s)
    for k in range(2):
        np.testing.assert_allclose(values[:, k], np.interp(s, BORDERS, TARGETS[:, k]), atol=1e-12)
    rates = np.diff(TARGETS, axis=0) / np.diff(BORDERS)[:, None]
    for side, segment in (("left", 0), ("right", 1)):
        np.testing.assert_allclose(progress.between(TARGETS, np.array([0.5]), side)[1][0], rates[segment])
    np.testing.assert_allclose(slopes[-1], rates[-1])
    assert not bends.any()


@pytest.mark.parametrize("widths", [(0.2, 0.3), (0.5, 0.8), (0.0, 0.4)])
def test_derivatives_are_those_of_the_values(widths):
    progress, h = SegmentProgress(BORDERS, np.array(widths)), 1e-6
    s = np.linspace(0.01, 2.79, 101)
    _, slopes, bends = progress.between(TARGETS, s)
    ahead, behind = (progress.between(TARGETS, s + sign * h) for sign in (1, -1))
    np.testing.assert_allclose((ahead[0] - behind[0]) / (2 * h), slopes, atol=1e-7)
    np.testing.assert_allclose((ahead[1] - behind[1]) / (2 * h), bends, atol=1e-3)
    np.testing.assert_allclose(progress.between(TARGETS, BORDERS[[0, -1]])[0], TARGETS[[0, -1]], atol=1e-12)


def test_far_from_its_blends_a_segment_has_its_own_rate():
    progress = SegmentProgress(BORDERS, np.array([0.1, 0.2]))
    rates = np.diff(TARGETS, axis=0) / np.diff(BORDERS)[:, None]
    np.testing.assert_allclose(progress.between(TARGETS, np.array([0.2, 1.2, 2.5]))[1], rates)
    np.testing.assert_allclose(
        progress.between(TARGETS, np.array([1.25]))[0][0], (TARGETS[1] + TARGETS[2]) / 2
    )


def test_one_segment_and_one_of_no_length():
    values, slopes, _ = SegmentProgress.even(2.0).between(TARGETS[:2], np.array([0.0, 0.5, 2.0]))
    np.testing.assert_allclose(
        values, TARGETS[0] + np.array([[0.0], [0.25], [1.0]]) * (TARGETS[1] - TARGETS[0])
    )
    np.testing.assert_allclose(slopes, np.tile((TARGETS[1] - TARGETS[0]) / 2.0, (3, 1)))
    still = SegmentProgress.even(0.0).between(TARGETS[:2], np.zeros(1))
    np.testing.assert_allclose(still[0], TARGETS[:1])
