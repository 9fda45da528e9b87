"""Legend of a picture, and the styles of what it names: colours, dashes, markers."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from trajcli.plots.axes import shortened, text_width
from trajcli.plots.frame import GREY, NORMAL, SMALL, Sheet
from trajcli.plots.panel import MoveBorders, Picture

COLOURS = ("#0072B2", "#009E73", "#CC79A7", "#000000", "#56B4E9", "#E69F00")
"""Of the sources, which all kinds of colour vision tell apart; vermilion is left for limits.

Source: Okabe and Ito, Color Universal Design (2008); their yellow is too pale on white.
"""
DASHES: tuple[Any, ...] = ("-", (0, (5, 1.5)), (0, (1, 1)), (0, (5, 1, 1, 1)))
"""Of the sources beside their colours; of more sources than colours, equal colours have other dashes."""

LIMIT_COLOUR = "#D55E00"
LIMIT: Mapping[str, Any] = {"color": LIMIT_COLOUR, "linewidth": 1.0, "linestyle": (0, (4, 2))}
BORDER: Mapping[str, Any] = {"color": "#999999", "linewidth": 0.6}
WAYPOINT: Mapping[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 3.5,
    "markerfacecolor": "white",
    "markeredgecolor": "black",
    "markeredgewidth": 0.8,
    "zorder": 4,
}
VIRTUAL_POINT: Mapping[str, Any] = {**WAYPOINT, "marker": "D", "markeredgecolor": "#CC79A7"}
START: Mapping[str, Any] = {
    "linestyle": "none",
    "marker": "s",
    "markersize": 4.5,
    "color": COLOURS[0],
    "zorder": 5,
}
ZONE: Mapping[str, Any] = {"color": "#999999", "linewidth": 0.8}
PROGRAMMED: Mapping[str, Any] = {"color": "black", "linewidth": 0.8, "linestyle": (0, (3, 2))}
FINDING: Mapping[str, Any] = {
    **WAYPOINT,
    "marker": "X",
    "markersize": 7.0,
    "markerfacecolor": "black",
    "markeredgecolor": "white",
}

MARK = "\u25be"
"""Before the titles of entries where something is taken up, left or set."""
MARKED: Mapping[str, Any] = {"linestyle": "none", "marker": "v", "markersize": 4.0, "color": "black"}
"""Of those entries, in panels."""

MOST_BORDERS = 80
"""Of moves in a panel that are drawn; more of them would hide everything else."""

_MOST_LARGE, _SMALL_MARKER = 60, 1.5  # so many markers of a panel are large; of more each is this small
_SAMPLE, _GAP, _INDENT = 0.32, 0.65, 0.2  # of the legend, inches
_LONGEST = 3.0  # of a name, inches
_LINE = 0.2  # height of a row, inches
_TITLE_LINE = 0.155  # of titles of moves, inches
_LONGEST_TITLE = 3.6  # inches
_MOST_TITLES = 36


def style_of(source: int) -> dict[str, Any]:
    """Return colour and dashes of a source."""
    round_number, index = divmod(source, len(COLOURS))
    dashes = DASHES[(index + round_number) % len(DASHES)]
    return {"color": COLOURS[index], "linestyle": dashes, "linewidth": 1.2 if source == 0 else 1.0}


def marker_style(style: Mapping[str, Any], count: int) -> dict[str, Any]:
    """Return the style of markers, which are smaller where there are many."""
    small = {"markersize": _SMALL_MARKER, "markeredgewidth": 0.4} if count > _MOST_LARGE else {}
    return {**style, **small}


class Legend:
    """Names of lines and markers, in rows.

    Attributes:
        height: Inches.
    """

    def __init__(self, picture: Picture, width: float) -> None:
        self._entries = list(_entries(picture))
        sizes = [text_width(name, NORMAL) for name, _ in self._entries]
        self._step = max(sizes, default=0.0) + _GAP
        self._columns = max(1, int((width - 2 * _INDENT) / self._step))
        self.height = _LINE * -(-len(self._entries) // self._columns) + 0.1

    def draw(self, sheet: Sheet, top: float) -> None:
        """Draw it on a sheet from `top` on."""
        for index, (name, style) in enumerate(self._entries):
            row, column = divmod(index, self._columns)
            left, middle = _INDENT + column * self._step, top + (row + 0.5) * _LINE
            ends = [left, left + 0.5 * _SAMPLE, left + _SAMPLE]
            sheet.line(ends, [middle] * 3, markevery=[1], **style)
            sheet.text(left + _SAMPLE + 0.08, middle, name, NORMAL, va="center_baseline")


class MoveTitles:
    """Indices and titles of the moves, in rows: once for all panels.

    Attributes:
        height: Inches.
    """

    def __init__(self, picture: Picture, width: float) -> None:
        timed = any(block.over_time for block in picture.blocks)
        self._lines = list(_title_lines(picture.borders)) if timed and picture.borders is not None else []
        self._step = max((text_width(line, SMALL) for line in self._lines), default=0.0) + 2 * _INDENT
        self._columns = max(1, int((width - _INDENT) / self._step))
        rows = -(-len(self._lines) // self._columns)
        self.height = _TITLE_LINE * rows + 0.08 if rows else 0.0

    def draw(self, sheet: Sheet, top: float) -> None:
        """Draw them on a sheet from `top` on, row by row."""
        for number, line in enumerate(self._lines):
            row, column = divmod(number, self._columns)
            left, middle = _INDENT + column * self._step, top + (row + 0.5) * _TITLE_LINE
            sheet.text(left, middle, line, SMALL, va="center_baseline", color=GREY)


def _title_lines(borders: MoveBorders) -> Iterator[str]:
    """Yield index and title of each move, of very many those of the first."""
    entries = [(index, "", title) for index, title in zip(borders.indices, borders.titles, strict=True)]
    entries += [(index, MARK, f"{title}, {time:.6g} s") for time, index, title in borders.marks]
    count = len(entries)
    shown = count if count <= _MOST_TITLES else _MOST_TITLES - 1
    for index, mark, title in sorted(entries)[:shown]:
        yield shortened(f"{mark}{index} {title}", SMALL, _LONGEST_TITLE)
    if shown < count:
        yield f"and {count - shown} more"


def _entries(picture: Picture) -> Iterator[tuple[str, Mapping[str, Any]]]:
    """Yield what the legend names, and how it is drawn."""
    panels = [panel for block in picture.blocks for panel in block.panels]
    for index, name in enumerate(picture.sources):
        yield shortened(name, NORMAL, _LONGEST), style_of(index)
    timed = any(block.over_time for block in picture.blocks)
    many = picture.borders is not None and 2 < picture.borders.times.size <= MOST_BORDERS
    views = picture.views
    points = views is not None and views.waypoints.size > 0
    kinds: tuple[tuple[str, bool, Mapping[str, Any]], ...] = (
        ("limit", any(np.isfinite(line[:, 1]).any() for panel in panels for line in panel.limits), LIMIT),
        ("border of moves", timed and many, BORDER),
        ("waypoint", points or any(panel.waypoints.size for panel in panels), WAYPOINT),
        ("start of a path", views is not None, START),
        ("zone", views is not None and views.zones.size > 0, ZONE),
        ("programmed path", views is not None and len(views.programmed) > 0, PROGRAMMED),
        ("virtual point", any(panel.virtual_points.size for panel in panels), VIRTUAL_POINT),
        ("finding", any(panel.findings.size for panel in panels), FINDING),
    )
    yield from ((name, style) for name, present, style in kinds if present)
