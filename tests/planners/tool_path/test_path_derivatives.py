"""Largest derivatives of a path against functions whose maxima are known."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from trajcli.planners.tool_path.derivatives import PathDerivatives, path_derivatives

Size = Callable[[np.ndarray, str], np.ndarray]
ALONG = np.array([2.0, -1.0, 2.0]) / 3.0


def steady(size: float) -> Size:
    return lambda s, side: np.full(s.shape, size)


def bumps(*places: tuple[float, float], width: float = 0.004) -> Size:
    """Return 1 and bumps at places, up to heights."""
    return lambda s, side: (
        1 + sum((height - 1) * np.exp(-(((s - place) / width) ** 2)) for place, height in places)
    )


def step(place: float, height: float, larger: str) -> Size:
    """Return 1, and beside a place on one side of it a height that is lost within a thousandth."""

    def size(s: np.ndarray, side: str) -> np.ndarray:
        beyond = s - place if larger == "right" else place - s
        inside = (beyond > 0) | ((beyond == 0) & (side == larger))
        return np.where(inside, 1 + (height - 1) * np.exp(-1000 * np.abs(beyond)), 1.0)

    return size


def derivatives(
    orientation: str = "all",
    length: float = 1.0,
    breaks: tuple[float, ...] = (),
    *,
    turns: bool = False,
    **sizes: Size,
) -> PathDerivatives:
    """Return what is found of a path whose four derivatives have such sizes."""
    names = ("stretch", "turning", "curvature", "turning_change")
    given = [sizes.get(name, steady(1.0)) for name in names]

    def evaluate(s: np.ndarray, side: str) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        rows = [size(s, side)[:, None] * ALONG for size in given]
        return np.tile(np.eye(4), (s.size, 1, 1)), np.hstack(rows[:2]), np.hstack(rows[2:])

    path: Any = SimpleNamespace(
        breaks=np.array([0.0, *breaks, length]),
        length=length,
        orientation=orientation,
        poses=SimpleNamespace(evaluate=evaluate, pure_rotation=turns),
    )
    return path_derivatives(path)


NAMES = ("curvature", "turning", "turning_change", "stretch")


@pytest.mark.parametrize("name", NAMES)
def test_each_is_the_largest_of_its_own_derivative(name: str) -> None:
    wave: Size = lambda s, side: 2 + np.cos(2 * np.pi * (s - 0.31))  # noqa: E731
    found = derivatives(**{name: wave})
    assert [getattr(found, each) for each in NAMES] == pytest.approx(
        [3.0 if each == name else 1.0 for each in NAMES], rel=1e-4
    )


@pytest.mark.parametrize("larger", ["left", "right"])
@pytest.mark.parametrize("name", NAMES)
def test_both_sides_of_a_break_count(name: str, larger: str) -> None:
    found = derivatives(breaks=(0.37,), **{name: step(0.37, 4.0, larger)})
    assert getattr(found, name) == pytest.approx(4.0)
    if name.startswith("turning"):
        found = derivatives("direction", breaks=(0.37,), **{name: step(0.37, 4.0, larger)})
        assert getattr(found, name) == pytest.approx(4.0, rel=3e-6)


def test_a_turn_about_what_is_left_free_is_looked_for_closer() -> None:
    """The higher of two bumps lies between samples that are lower than those of the other one."""
    peaks = bumps((100.5 / 256, 2.0), (181 / 256, 1.7))
    change = bumps((30.45 / 256, 5.0), (202 / 256, 3.9))
    assert derivatives(turning=peaks).turning < 1.9
    for orientation in ("direction", "yaw", "none"):
        found = derivatives(orientation, turning=peaks, turning_change=change)
        assert (found.turning, found.turning_change) == pytest.approx((2.0, 5.0), rel=5e-5)


def test_short_pieces_are_looked_at_within() -> None:
    found = derivatives(breaks=(0.5, 0.5005), curvature=bumps((0.50025, 7.0), width=1e-4))
    assert found.curvature == pytest.approx(7.0)


@pytest.mark.parametrize(("times", "kept"), [(0.9, False), (1.1, True), (1e3, True)])
def test_a_turn_is_even_that_hardly_changes_over_the_whole_path(times: float, kept: bool) -> None:
    change = times * 1e-6 * 5.0 / 3.0  # over a length of 3 this is so many millionths of 5
    found = derivatives("direction", 3.0, turning=steady(5.0), turning_change=steady(change))
    assert found.turning_change == pytest.approx(change if kept else 0.0, rel=1e-5)


@pytest.mark.parametrize(("size", "stretch"), [(0.5, 1.0), (1 + 5e-7, 1.0), (1 + 2e-6, 1 + 2e-6), (1.3, 1.3)])
def test_a_stretch_is_what_the_tool_goes_beyond_s(size: float, stretch: float) -> None:
    assert derivatives(stretch=steady(size)).stretch == pytest.approx(stretch, abs=1e-9)


@pytest.mark.parametrize("turns", [False, True])
def test_a_tool_that_only_turns_does_not_move(turns: bool) -> None:
    assert derivatives(turns=turns).moves is not turns
