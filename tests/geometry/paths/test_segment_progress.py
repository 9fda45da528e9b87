"""Values that go along segments against what a user computes from the borders: lines, and even rates between blends."""

from __future__ import annotations

import math

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


@pytest.mark.parametrize("widths", [(0.2, 0.3), (0.5, 0.8), (0.0, 0.4), (0.05, 0.8), (0.5, 0.0)])
@pytest.mark.parametrize("side", ["left", "right"])
def test_the_rate_of_a_segment_rises_and_falls_at_its_two_borders(widths, side):
    def risen(border, width):
        x = (s - border + width) / (2 * width or 1)
        sharp = s > border if side == "left" else s >= border
        return np.where(width > 0, np.where(x < 0, 0, np.where(x > 1, 1, x * x * (3 - 2 * x))), sharp)

    s = np.sort(np.concatenate([np.linspace(0, 2.8, 2801), BORDERS]))
    first, second = (risen(*each) for each in zip(BORDERS[1:-1], widths, strict=True))
    share = np.stack([1 - first, first - second, second], axis=-1) / np.diff(BORDERS)
    values, slopes, _ = SegmentProgress(BORDERS, np.array(widths)).between(TARGETS, s, side)
    np.testing.assert_allclose(slopes, share @ np.diff(TARGETS, axis=0), rtol=0, atol=1e-12)
    steps = np.diff(s)[:, None] * (slopes[1:] + slopes[:-1]) / 2
    whole = TARGETS[0] + np.concatenate([np.zeros((1, 2)), np.cumsum(steps, axis=0)])
    np.testing.assert_allclose(values, whole, rtol=0, atol=8e-3)  # rates step without a blend


@pytest.mark.parametrize(
    ("borders", "widths", "breaks"),
    [
        ([0, 0.5, 2], [0.5], [0.5, 1]),
        ([0, 1.5, 2], [0.5], [1, 1.5]),
        ([0, 1, 2, 3], [0.4999, 0.4999], [0.5001, 1, 1.4999, 1.5001, 2, 2.4999]),
        ([0, 1, 2, 3], [0.5, 0.5 - 1e-13], [0.5, 1, 1.5, 2, 2.5]),
        ([0, 1, 2, 3], [0.5, 0.5 - 1e-9], [0.5, 1, 1.5, 1.5 + 1e-9, 2, 2.5 - 1e-9]),
        ([0, 1, 2], [0.0], [1]),
    ],
)
def test_breaks_are_inside_and_apart(borders, widths, breaks):
    progress = SegmentProgress(np.array(borders, dtype=float), np.array(widths))
    assert progress.breaks.shape == (len(breaks),)
    np.testing.assert_allclose(progress.breaks, breaks, rtol=0, atol=1e-12)


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
    assert np.isfinite(SegmentProgress.even(0.0).majorant(np.zeros(1), np.zeros(1), np.ones((4, 1)))).all()
    still = SegmentProgress.even(0.0).between(TARGETS[:2], np.zeros(1))
    np.testing.assert_allclose(still[0], TARGETS[:1])


@pytest.mark.parametrize(("first", "second"), [(1.0, 1.0), (3.0, 0.5), (0.0, 2.0)])
def test_bounds_of_what_is_done_hold_where_one_segment_fades_into_the_next(first, second):
    """All segments count for themselves, as their axes may point anywhere; the law is s = t."""
    width = 0.3
    progress = SegmentProgress(np.array([0.0, 1.0, 3.0]), np.array([width / 2]))
    rising = np.zeros((5, 3))
    rising[1] = 1.0
    found = progress.majorant(np.array([first, 2.0 * second]), np.array([0.4, 1.0, 2.0]), rising)
    x = np.linspace(0.0, 1.0, 1001)
    ramp = 3 * x**2 - 2 * x**3, 6 * x * (1 - x) / width, (6 - 12 * x) / width**2, np.full(1001, 12) / width**3
    fading = [first * (1 - ramp[0]) + second * ramp[0]]
    fading += [(first + second) * np.abs(each) for each in ramp[1:]]
    sizes = np.array([each.max() / math.factorial(m) for m, each in enumerate(fading, 1)])
    assert (found[1:, 1] >= sizes * (1 - 1e-12)).all()
    assert (found[1:, 1] <= 2.5 * np.maximum(sizes, 1e-12)).all()
    np.testing.assert_allclose(found[:, 0], [0, first, 0, 0, 0], rtol=1e-12)
    np.testing.assert_allclose(found[:, 2], [0, second, 0, 0, 0], rtol=1e-12)


def test_what_is_outside_of_a_path_is_refused():
    progress = SegmentProgress(np.array([0.0, 1.0, 3.0]), np.array([0.1]))
    for s in (-0.01, 3.01):
        with pytest.raises(ValueError, match="s"):
            progress.at(np.array([0.5, s]))
