"""Views of a path: which axes each side shows, to one scale, with zones, programmed paths, arrows and names in place."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text

from trajcli.plots.frame import Sheet
from trajcli.plots.panel import PathViews
from trajcli.plots.path_views import draw_views, views_height

S = np.linspace(0, 1, 41)[:, None]
PATH = np.array([100.0, 200, 50]) + S * [80, 40, -20] + S**2 * [0, 0, 60]
ZONE = np.array([[150.0, 260, 40, 30.0], [100, 190, 60, 5]])
PROGRAMMED = np.array([[120.0, 260, 40], [150, 260, 40], [150, 260, 70]])
WAYPOINTS = np.array([[100.0, 200, 50], [180, 240, 90]])
SIDES = {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
TITLES = {"xy": "from above", "xz": "from the front", "yz": "from the side"}


def drawn(views: PathViews, width: float = 12.0) -> tuple[Figure, dict[str, Any]]:
    height = views_height(width)
    figure = Figure(figsize=(width, height))
    draw_views(Sheet(figure, width, height), views, 0.0)
    lines = figure.findobj(Line2D)
    return figure, {line.get_gid(): line for line in lines if line.get_gid()}


@pytest.fixture(scope="module")
def shown() -> tuple[Figure, dict[str, Any]]:
    named = (("first", WAYPOINTS[0]), ("last", WAYPOINTS[1]))
    return drawn(PathViews("mm", ((0, PATH),), WAYPOINTS, ZONE, (PROGRAMMED,), named))


@pytest.mark.parametrize("side", SIDES)
def test_each_side_has_its_two_axes(side: str, shown: tuple[Figure, dict[str, Any]]) -> None:
    figure, lines = shown
    axes = list(SIDES[side])
    for name, points in (
        ("source0", PATH),
        ("programmed1", PROGRAMMED),
        ("waypoints", WAYPOINTS),
        ("start0", PATH[:1]),
    ):
        data = np.array(lines[f"view-{side}-{name}"].get_data()).T
        assert data == pytest.approx(points[:, axes]), name
    for number, row in enumerate(ZONE, 1):
        circle = np.array(lines[f"view-{side}-zone{number}"].get_data()).T
        assert np.linalg.norm(circle - row[axes], axis=1) == pytest.approx(row[3])
        assert np.ptp(circle, axis=0) == pytest.approx(2 * row[3], rel=1e-2)
    for number in range(5):
        arrow = lines[f"view-{side}-arrow0-{number}"]
        at = np.array(arrow.get_data())[:, 0]
        flat = PATH[:, axes]
        k = int(np.linalg.norm(flat - at, axis=1).argmin())
        along = flat[min(k + 1, 40)] - flat[max(k - 1, 0)]
        angle = np.radians(arrow.get_marker()[2] + 90)  # a triangle of matplotlib points upwards at 0
        assert np.dot([np.cos(angle), np.sin(angle)], along / np.linalg.norm(along)) > 0.99
    (title,) = place(figure, TITLES[side])
    left, top = lines[f"view-{side}-source0"].get_transform().transform(PATH[:, axes]).T
    assert np.abs(left.mean() - title[0]) < 1.6 * figure.dpi  # above its own view
    assert 0 < title[1] - top.max() < 2.5 * figure.dpi
    pixels = lines[f"view-{side}-source0"].get_transform().transform(np.array([[0.0, 0], [1, 0], [0, 1]]))
    assert pixels[1][0] - pixels[0][0] == pytest.approx(pixels[2][1] - pixels[0][1])  # one scale


def place(figure: Figure, text: str) -> list[tuple[float, float]]:
    """Return where a text stands, pixels."""
    return [
        each.get_window_extent().get_points().mean(axis=0)
        for each in figure.findobj(Text)
        if each.get_text() == text
    ]


def test_labels_and_names_stand_at_their_views(shown: tuple[Figure, dict[str, Any]]) -> None:
    figure, lines = shown
    starts = {side: lines[f"view-{side}-source0"].get_transform() for side in SIDES}
    for name, point in (("first", WAYPOINTS[0]), ("last", WAYPOINTS[1])):
        at = np.array(place(figure, name))
        for side, axes in SIDES.items():
            wanted = starts[side].transform(point[list(axes)])
            assert np.linalg.norm(at - wanted, axis=1).min() < 0.4 * figure.dpi, (name, side)
    labels = [text.get_text() for text in figure.findobj(Text)]
    assert [labels.count(f"{axis} [mm]") for axis in "xyz"] == [3, 3, 3]  # in space and in two sides each
    at = {axis: np.array(place(figure, f"{axis} [mm]")) for axis in "xyz"}
    for side, axes in SIDES.items():
        low, high = (
            starts[side].transform(np.vstack([PATH, ZONE[:, :3]])[:, list(axes)]).T[:2, :].min(axis=1),
            None,
        )
        del high
        below = [
            point
            for point in at["xyz"[axes[0]]]
            if abs(point[0] - low[0]) < 3.5 * figure.dpi and point[1] < low[1]
        ]
        assert below, side


def test_the_views_hold_all_of_the_path_its_balls_and_points(shown: tuple[Figure, dict[str, Any]]) -> None:
    figure, _ = shown
    (space,) = figure.axes
    everything = np.vstack([PATH, WAYPOINTS, ZONE[:, :3] - ZONE[:, 3:], ZONE[:, :3] + ZONE[:, 3:]])
    ranges = np.array([space.get_xlim(), space.get_ylim(), space.get_zlim()])  # type: ignore[attr-defined]
    assert ranges.mean(axis=1) == pytest.approx((everything.min(axis=0) + everything.max(axis=0)) / 2)
    assert np.diff(ranges)[:, 0] == pytest.approx(1.1 * np.ptp(everything, axis=0).max())
    found = {line.get_gid(): np.array(line.get_data_3d()).T for line in space.lines}  # type: ignore[attr-defined]
    assert found["space-source0"] == pytest.approx(PATH)
    assert found["space-programmed1"] == pytest.approx(PROGRAMMED)
    assert found["space-waypoints"] == pytest.approx(WAYPOINTS)
    assert found["space-start0"] == pytest.approx(PATH[:1])


def test_names_that_have_no_room_are_left_out() -> None:
    names = (("one", PATH[0]), ("on it", PATH[0] + 0.1), ("x" * 60, PATH[20]))
    figure, _ = drawn(PathViews("mm", ((0, PATH),), WAYPOINTS, named=names))
    assert len(place(figure, "one")) == 3
    assert not place(figure, "on it")
    assert not place(figure, "x" * 60)


def test_a_path_that_goes_nowhere_has_no_arrows() -> None:
    _, lines = drawn(PathViews("m", ((0, PATH), (1, PATH[:1] + 0 * PATH)), WAYPOINTS))
    assert "view-xy-arrow0-0" in lines
    assert "view-xy-arrow1-0" not in lines
