"""Figure of a picture: its panels in a grid, below each other, and the views of the path."""

from __future__ import annotations

from typing import Any

import numpy as np

from trajcli.plots.axes import labels_with_room, note_of, shortened, text_width, ticks_of, view_of
from trajcli.plots.frame import (
    AXIS,
    BELOW,
    BESIDE,
    GREY,
    LARGE,
    LEFT,
    NORMAL,
    RIGHT,
    SMALL,
    TITLE,
    PanelFrame,
    Sheet,
    left_of,
    panel_width,
)
from trajcli.plots.legend import (
    BORDER,
    FINDING,
    LIMIT,
    LIMIT_COLOUR,
    MARKED,
    MOST_BORDERS,
    VIRTUAL_POINT,
    WAYPOINT,
    Legend,
    MoveTitles,
    marker_style,
    style_of,
)
from trajcli.plots.panel import MoveBorders, Panel, PanelBlock, Picture

_PANEL_WIDTHS = {1: 6.2, 2: 4.3, 3: 3.2, 4: 2.8, 5: 2.5}  # by the number of columns of joints, inches
_WIDE = 11.0  # of the panels of a figure without joints
_HEAD, _LINE = 0.4, 0.2
_FLAT, _TALL, _PLANE = 1.1, 1.5, 2.6
_FEW_ROWS = 4
_X_TICKS, _Y_TICKS = 5, 5
_MARKS = 0.96  # of the height of a panel: where marks stand
_BOLD = 0.8  # of the width of a bold text is that of a plain one, at least


def figure_of(picture: Picture) -> Any:  # noqa: ANN401
    """Return the `matplotlib.figure.Figure` of a picture; whoever writes it gives it a canvas."""
    from matplotlib.figure import Figure

    layout = _Layout(picture)
    figure = Figure(figsize=(layout.width, layout.height))
    sheet = Sheet(figure, layout.width, layout.height)
    title = shortened(picture.title, LARGE, _BOLD * (layout.width - 0.4))
    sheet.text(0.2, 0.12, title, LARGE, va="top", weight="bold")
    layout.legend.draw(sheet, _HEAD)
    layout.titles.draw(sheet, _HEAD + layout.legend.height)
    top, number = _HEAD + layout.legend.height + layout.titles.height, 0
    for block, height in zip(picture.blocks, layout.heights, strict=True):
        _draw_block(sheet, block, picture.borders, top, number)
        top, number = top + height, number + len(block.panels)
    if picture.views is not None:
        from trajcli.plots.path_views import draw_views

        draw_views(sheet, picture.views, top)
    return figure


class _Layout:
    """Sizes of a figure, inches."""

    def __init__(self, picture: Picture) -> None:
        first = picture.blocks[0] if picture.blocks else None
        widths = _PANEL_WIDTHS.get(first.columns) if first is not None and first.over_time else None
        panels = _WIDE if widths is None or first is None else first.columns * (widths + BESIDE) - BESIDE
        self.width = LEFT + panels + RIGHT
        self.legend = Legend(picture, self.width)
        self.titles = MoveTitles(picture, self.width)
        self.heights = [_height(block, picture.borders, self.width) for block in picture.blocks]
        self.height = _HEAD + self.legend.height + self.titles.height + sum(self.heights)
        if picture.views is not None:
            from trajcli.plots.path_views import views_height

            self.height += views_height(self.width)


def _panel_height(block: PanelBlock) -> float:
    if not block.flat:
        return _PLANE
    return _TALL if _rows(block) <= _FEW_ROWS else _FLAT


def _rows(block: PanelBlock) -> int:
    return -(-len(block.panels) // block.columns)


def _row_height(block: PanelBlock) -> float:
    """Return the height of a row; where x is not the time of all, each row has numbers below."""
    return TITLE + _panel_height(block) + (0.0 if block.over_time else AXIS)


def _height(block: PanelBlock, borders: MoveBorders | None, width: float) -> float:
    head = _LINE * bool(block.headings) + _strip(block, borders)
    return head + _rows(block) * _row_height(block) + AXIS * block.over_time + BELOW


def _strip(block: PanelBlock, borders: MoveBorders | None) -> float:
    """Return the height of the strip with the indices of moves."""
    return 0.0 if borders is None or not block.over_time else _LINE


def _time_range(block: PanelBlock, borders: MoveBorders | None) -> tuple[float, float]:
    times = [trace.x for panel in block.panels for trace in panel.traces]
    shown = np.concatenate([*times, *([] if borders is None else [borders.times])])
    low, high = float(shown.min()), float(shown.max())
    margin = 0.01 * (high - low) if high > low else 0.5
    return low - margin, high + margin


def _draw_block(
    sheet: Sheet, block: PanelBlock, borders: MoveBorders | None, top: float, number: int
) -> None:
    """Draw a block from `top` on; its panels are numbered from `number`."""
    width, height = panel_width(block.columns, sheet.width), _panel_height(block)
    for column, heading in enumerate(block.headings):
        sheet.text(left_of(column, width), top + 0.04, heading, NORMAL, va="top", weight="bold")
    top += _LINE * bool(block.headings) + _strip(block, borders)
    times = _time_range(block, borders) if block.over_time else None
    for index, panel in enumerate(block.panels):
        row, column = divmod(index, block.columns)
        box = (left_of(column, width), top + row * _row_height(block) + TITLE, width, height)
        view = _plane_view(panel) if times is None else view_of(panel)
        frame = PanelFrame(sheet, box, times or _plane_range(panel), view, f"panel{number + index}")
        if times is not None and borders is not None:
            if 2 < borders.times.size <= MOST_BORDERS:
                frame.uprights(borders.times[1:-1], "borders", **BORDER)
            if row == 0:
                _draw_indices(frame, borders)
        lowest = index + block.columns >= len(block.panels)
        note = "" if times is None else note_of(panel, view)
        _draw_panel(frame, panel, note, numbered=times is None or lowest)


def _draw_indices(frame: PanelFrame, borders: MoveBorders) -> None:
    """Write the indices of moves above a frame, where there is room, and mark what takes no time."""
    edges = np.array([frame.across(time) for time in borders.times])
    names = [str(index) for index in borders.indices]
    if borders.marks and borders.times.size <= MOST_BORDERS:
        times = np.array([time for time, _, _ in borders.marks])
        frame.plot(
            times, np.full(times.size, _MARKS * frame.y[1] + (1 - _MARKS) * frame.y[0]), "marks", **MARKED
        )
    for number, middle in labels_with_room(names, 0.5 * (edges[:-1] + edges[1:]), np.diff(edges), SMALL):
        options = {"ha": "center", "va": "bottom", "color": GREY}
        frame.sheet.text(middle, frame.top - 0.9 * TITLE, names[number], SMALL, **options)


def _draw_panel(frame: PanelFrame, panel: Panel, note: str, *, numbered: bool) -> None:
    """Draw what a panel holds, with a remark above it, and with numbers at x where asked for."""
    for line in panel.limits:
        frame.plot(line[:, 0], line[:, 1], "limit", **LIMIT)
    for trace in panel.traces:
        frame.plot(trace.x, trace.y, f"source{trace.source}", **style_of(trace.source))
    _draw_marks(frame, panel)
    x_ticks, x_names = _ticks_with_room(frame)
    y_ticks, y_names = ticks_of(frame.y, _Y_TICKS)
    frame.outline(x_ticks, y_ticks)
    frame.y_axis(y_ticks, y_names, panel.y_label)
    if numbered:
        frame.x_axis(x_ticks, x_names, panel.x_label)
    width = 0.95 * (frame.width - text_width(note, SMALL)) - 0.15
    frame.titles(shortened(panel.title, NORMAL, width), note, LIMIT_COLOUR)


def _ticks_with_room(frame: PanelFrame) -> tuple[list[float], list[str]]:
    """Return ticks at x, fewer where their numbers are long, such as times since 1970."""
    for count in range(_X_TICKS, 0, -1):
        ticks, names = ticks_of(frame.x, count)
        if sum(text_width(name, SMALL) for name in names) <= frame.width:
            break
    return ticks, names


def _draw_marks(frame: PanelFrame, panel: Panel) -> None:
    if panel.findings.size:
        dots = {"color": "black", "linewidth": 0.7, "linestyle": (0, (1, 2))}
        frame.uprights(np.unique(panel.findings[:, 0]), "finding-times", **dots)
    seen = panel.findings[np.isfinite(panel.findings[:, 1])]
    for points, part, style in (
        (panel.waypoints, "waypoints", WAYPOINT),
        (panel.virtual_points, "virtual-points", VIRTUAL_POINT),
        (seen, "findings", FINDING),
    ):
        if points.size:
            frame.plot(points[:, 0], points[:, 1], part, **marker_style(style, len(points)))


def _plane_view(panel: Panel) -> tuple[float, float]:
    """Return the range of sd: the law, and as much of its limit as is near."""
    top = max((float(trace.y.max()) for trace in panel.traces), default=1.0)
    limit = np.concatenate([line[:, 1] for line in panel.limits])
    finite = limit[np.isfinite(limit)]
    high = min(float(finite.max()), 2.0 * top) if finite.size else top
    return 0.0, 1.06 * max(high, top) or 1.0


def _plane_range(panel: Panel) -> tuple[float, float]:
    s = np.concatenate([line[:, 0] for line in panel.limits])
    margin = 0.01 * float(np.ptp(s))
    return float(s.min()) - margin, float(s.max()) + margin
