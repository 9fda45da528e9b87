"""Views of the path of the tool: in space, from above, from the front and from the side."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.plots.axes import text_width, ticks_of
from trajcli.plots.frame import (
    AXIS,
    BELOW,
    GREY,
    NORMAL,
    SMALL,
    TITLE,
    PanelFrame,
    Sheet,
    left_of,
    panel_width,
)
from trajcli.plots.legend import LIMIT_COLOUR, PROGRAMMED, START, WAYPOINT, ZONE, marker_style, style_of
from trajcli.plots.panel import PathViews

_LEAST, _MOST = 2.1, 3.2  # width of a view, inches
_VIEW_TICKS, _SPACE_TICKS = 4, 3
_SPACE = 0.8  # of the view in space is its box: numbers and labels stand outside of it
_SPACE_PADS = (3, 5, 6)  # of the labels, points
_ARROWS = 5  # along a path
_SHORTEST = 0.02  # of the view: a shorter path has no arrows
_ONCE = 0.6  # opacity of a path
_BESIDE_POINT, _NAME_HEIGHT = 0.09, 0.13  # of names, inches
_ROUND = 48  # sides of a circle
_SHIFT = 0.3  # of that view to the left, inches


def views_height(width: float) -> float:
    """Return the height of the views on a sheet of a width, inches."""
    return 4 // _views_columns(width) * (TITLE + _view_size(width) + AXIS) + BELOW


def draw_views(sheet: Sheet, views: PathViews, top: float) -> None:
    """Draw the path in space and from three sides, to one scale."""
    centres, sizes = views.zones[:, :3], views.zones[:, 3:]
    balls = [centres - sizes, centres + sizes]
    points = np.concatenate([*(trace for _, trace in views.traces), views.waypoints, *balls])
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    half = max(0.55 * float(np.ptp(points, axis=0).max()), 1e-6)
    ranges = [(float(value) - half, float(value) + half) for value in middle]
    columns, size = _views_columns(sheet.width), _view_size(sheet.width)
    titles = ("path of the tool", "from above", "from the front", "from the side")
    for index, title in enumerate(titles):
        row, column = divmod(index, columns)
        left = left_of(column, panel_width(columns, sheet.width))
        box = (left, top + row * (TITLE + size + AXIS) + TITLE, size, size)
        if index == 0:
            sheet.text(left, box[1] - 0.06, title, NORMAL, va="baseline")
            _draw_space(sheet, views, box, ranges)
        else:
            _draw_side(sheet, views, box, ranges, (((0, 1), (0, 2), (1, 2))[index - 1], title))


def _draw_side(
    sheet: Sheet,
    views: PathViews,
    box: tuple[float, float, float, float],
    ranges: list[tuple[float, float]],
    sides: tuple[tuple[int, int], str],
) -> None:
    """Draw the path along one axis of the world."""
    (first, second), title = sides
    frame = PanelFrame(sheet, box, ranges[first], ranges[second], f"view-{'xyz'[first]}{'xyz'[second]}")
    for source, trace in views.traces:
        flat = trace[:, [first, second]]
        frame.plot(flat[:, 0], flat[:, 1], f"source{source}", **_see_through(source))
        _draw_direction(frame, flat, source)
    for number, line in enumerate(views.programmed, 1):
        frame.plot(line[:, first], line[:, second], f"programmed{number}", **PROGRAMMED)
    for number, (corner, size) in enumerate(_balls(views), 1):
        circle = corner + size * _circle((first, second))
        frame.plot(circle[:, first], circle[:, second], f"zone{number}", **ZONE)
    if views.waypoints.size:
        frame.plot(
            views.waypoints[:, first],
            views.waypoints[:, second],
            "waypoints",
            **marker_style(WAYPOINT, len(views.waypoints)),
        )
    (x, x_names), (y, y_names) = (ticks_of(ranges[side], _VIEW_TICKS) for side in (first, second))
    frame.outline(x, y)
    frame.x_axis(x, x_names, f"{'xyz'[first]} [{views.unit}]")
    frame.y_axis(y, y_names, f"{'xyz'[second]} [{views.unit}]")
    frame.titles(title, "", LIMIT_COLOUR)
    _draw_names(frame, [(name, at[[first, second]]) for name, at in views.named])


def _see_through(source: int) -> dict[str, Any]:
    """Return the style of a path: what is passed twice is darker."""
    return {**style_of(source), "alpha": _ONCE, "linewidth": 1.5}


def _draw_direction(frame: PanelFrame, path: Array, source: int) -> None:
    """Mark where a path (N, 2) starts, and by arrows where it goes."""
    colour = style_of(source)["color"]
    frame.plot(path[:1, 0], path[:1, 1], f"start{source}", **{**START, "color": colour})
    steps = np.linalg.norm(np.diff(path, axis=0), axis=1)
    gone = np.append(0.0, np.cumsum(steps))
    if not np.isfinite(gone[-1]) or gone[-1] < _SHORTEST * (frame.x[1] - frame.x[0]):
        return
    for number in range(_ARROWS):
        at = np.searchsorted(gone, (number + 0.5) / _ARROWS * gone[-1], "right")
        k = int(np.clip(at, 1, len(path) - 1))
        along = path[k] - path[k - 1]
        angle = float(np.degrees(np.arctan2(along[1], along[0]))) - 90.0
        style = {"linestyle": "none", "marker": (3, 0, angle), "markersize": 5.0, "color": colour}
        middle = 0.5 * (path[k] + path[k - 1])
        frame.plot(middle[:1], middle[1:], f"arrow{source}-{number}", **style)


def _draw_names(frame: PanelFrame, named: Sequence[tuple[str, Array]]) -> None:
    """Write the names of points beside them, where they have room; the first wins."""
    taken: list[tuple[float, float, float, float]] = []
    for name, (x, y) in named:
        down = frame.bottom - (y - frame.y[0]) / (frame.y[1] - frame.y[0]) * frame.height
        left, width, down = (
            frame.across(x) + 0.5 * _BESIDE_POINT,
            text_width(name, SMALL),
            down - _BESIDE_POINT,
        )
        box = (left, down - 0.5 * _NAME_HEIGHT, left + width, down + 0.5 * _NAME_HEIGHT)
        inside = box[1] > frame.top and box[2] < frame.left + frame.width and box[3] < frame.bottom
        apart = all(
            box[2] < other[0] or other[2] < box[0] or box[3] < other[1] or other[3] < box[1]
            for other in taken
        )
        if inside and apart:
            taken.append(box)
            frame.sheet.text(left, down, name, SMALL, va="center_baseline", color=GREY)


def _draw_space(
    sheet: Sheet,
    views: PathViews,
    box: tuple[float, float, float, float],
    ranges: list[tuple[float, float]],
) -> None:
    from mpl_toolkits.mplot3d import Axes3D

    left, top, width, height = box
    bounds = (
        (left - _SHIFT) / sheet.width,
        1 - (top + height) / sheet.height,
        width / sheet.width,
        height / sheet.height,
    )
    axes = Axes3D(sheet.figure, bounds)
    axes.set_box_aspect((1, 1, 1), zoom=_SPACE)
    sheet.figure.add_axes(axes)
    for source, trace in views.traces:
        axes.plot(*trace.T, gid=f"space-source{source}", **_see_through(source))
        axes.plot(*trace[:1].T, gid=f"space-start{source}", **{**START, "color": style_of(source)["color"]})
    for number, line in enumerate(views.programmed, 1):
        axes.plot(*line.T, gid=f"space-programmed{number}", **PROGRAMMED)
    for number, (corner, size) in enumerate(_balls(views), 1):
        for plane in ((0, 1), (0, 2), (1, 2)):
            axes.plot(*(corner + size * _circle(plane)).T, gid=f"space-zone{number}", **ZONE)
    if views.waypoints.size:
        axes.plot(*views.waypoints.T, gid="space-waypoints", **marker_style(WAYPOINT, len(views.waypoints)))
    axes.set(xlim=ranges[0], ylim=ranges[1], zlim=ranges[2])
    for side, axis in enumerate((axes.xaxis, axes.yaxis, axes.zaxis)):
        low, high = ranges[side]
        inner = 0.15 * (high - low)  # numbers at the corners would stand on each other
        axis.set_ticks(*ticks_of((low + inner, high - inner), _SPACE_TICKS))
        axis.set_label_text(f"{'xyz'[side]} [{views.unit}]", fontsize=SMALL)
        axis.set_tick_params(labelsize=SMALL, pad=0)
        axis.set_rotate_label(False)
        axis.labelpad = _SPACE_PADS[side]


def _balls(views: PathViews) -> Iterator[tuple[Array, float]]:
    """Yield the corner (3,) and the radius of each zone."""
    for row in views.zones:
        yield row[:3], float(row[3])


def _circle(plane: tuple[int, int]) -> Array:
    """Return points of a circle of radius 1 in the plane of two axes, (_ROUND + 1, 3)."""
    angles = np.linspace(0.0, 2.0 * np.pi, _ROUND + 1)
    points = np.zeros((angles.size, 3))
    points[:, plane[0]], points[:, plane[1]] = np.cos(angles), np.sin(angles)
    return points


def _views_columns(width: float) -> int:
    return 4 if panel_width(4, width) >= _LEAST else 2


def _view_size(width: float) -> float:
    return min(panel_width(_views_columns(width), width), _MOST)
