"""Frame of a panel: lines and markers in its own coordinates, ticks, and labels around it, sizes in inches.

Lines are drawn straight onto the figure. The axes of matplotlib take four times as long for a grid of panels,
most of it for ticks, and their labels go where room is not asked for.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import comparable

SMALL, NORMAL, LARGE = 7.0, 8.0, 10.0
"""Sizes of text, points."""

LEFT, RIGHT, BESIDE = 0.85, 0.25, 0.85
"""Room left of the first frame, right of the last and between two, inches."""

TITLE, AXIS, BELOW = 0.3, 0.45, 0.1
"""Room above a frame, for the numbers and the label below it, and below that, inches."""

GREY = "#555555"
_TICK = 0.035  # inches
_LABEL = 0.62  # of the label at y, left of the frame
_BELOW = 0.2  # of the label at x, below the frame


def panel_width(columns: int, width: float) -> float:
    """Return the width of each of the frames side by side that fill a sheet, inches."""
    return (width - LEFT - RIGHT - (columns - 1) * BESIDE) / columns


def left_of(column: int, width: float) -> float:
    """Return the left edge of a frame among others of a width, inches."""
    return LEFT + column * (width + BESIDE)


@comparable
class Sheet:
    """A figure on which lengths are inches from the upper left corner.

    Attributes:
        figure: Of matplotlib.
        width: Inches.
        height: Inches.
    """

    figure: Any
    width: float
    height: float

    def text(self, left: float, top: float, text: str, size: float, **options: Any) -> None:  # noqa: ANN401
        """Write a text."""
        self.figure.text(left / self.width, 1 - top / self.height, text, fontsize=size, **options)

    def line(self, x: Sequence[float], y: Sequence[float], **style: Any) -> None:  # noqa: ANN401
        """Draw a line through points; NaN interrupts it."""
        from matplotlib.lines import Line2D

        up = self.height - np.asarray(y, dtype=np.float64)
        self.figure.add_artist(Line2D(np.asarray(x), up, transform=self.figure.dpi_scale_trans, **style))


class PanelFrame:
    """A rectangle of a sheet with a range of x and one of y.

    Attributes:
        sheet: Where it stands.
        left: Inches from the left.
        top: Inches from above.
        width: Inches.
        height: Inches.
        x: Its range.
        y: Its range.
        name: What the identifiers of its lines in an SVG begin with.
    """

    def __init__(
        self,
        sheet: Sheet,
        box: tuple[float, float, float, float],
        x: tuple[float, float],
        y: tuple[float, float],
        name: str,
    ) -> None:
        from matplotlib.transforms import Affine2D, Bbox, TransformedBbox

        self.sheet, self.x, self.y, self.name = sheet, x, y, name
        self.left, self.top, self.width, self.height = box
        self.bottom = self.top + self.height
        scale = self.width / (x[1] - x[0]), self.height / (y[1] - y[0])
        inches = Affine2D().translate(-x[0], -y[0]).scale(*scale)
        corner = self.left, sheet.height - self.bottom
        self._transform = inches.translate(*corner) + sheet.figure.dpi_scale_trans
        box_inside = Bbox.from_bounds(*corner, self.width, self.height)
        self._clip = TransformedBbox(box_inside, sheet.figure.dpi_scale_trans)

    def plot(self, x: Array, y: Array, part: str, **style: Any) -> None:  # noqa: ANN401
        """Draw a line, or markers, through points (N,) in the frame's units; what is outside is cut off."""
        from matplotlib.lines import Line2D

        line = Line2D(x, y, transform=self._transform, gid=f"{self.name}-{part}", **style)
        line.set_clip_box(self._clip)
        self.sheet.figure.add_artist(line)

    def uprights(self, x: Array, part: str, **style: Any) -> None:  # noqa: ANN401
        """Draw vertical lines from edge to edge at `x` (k,)."""
        ends = np.repeat(x, 3)
        heights = np.tile([self.y[0], self.y[1], np.nan], x.size)
        self.plot(ends, heights, part, **style)

    def across(self, value: float) -> float:
        """Return the distance of a value of x from the left of the sheet, inches."""
        return self.left + (value - self.x[0]) / (self.x[1] - self.x[0]) * self.width

    def outline(self, x_ticks: Sequence[float], y_ticks: Sequence[float]) -> None:
        """Draw the rectangle, and ticks outside of it."""
        right, gap = self.left + self.width, np.nan
        x = [self.left, right, right, self.left, self.left]
        y = [self.bottom, self.bottom, self.top, self.top, self.bottom]
        for tick in x_ticks:
            at = self.across(tick)
            x, y = [*x, gap, at, at], [*y, gap, self.bottom, self.bottom + _TICK]
        for tick in y_ticks:
            at = self._down(tick)
            x, y = [*x, gap, self.left - _TICK, self.left], [*y, gap, at, at]
        self.sheet.line(x, y, color="black", linewidth=0.6, zorder=3, gid=f"{self.name}-frame")

    def x_axis(self, ticks: Sequence[float], names: Sequence[str], label: str) -> None:
        """Write numbers and a label below."""
        for tick, name in zip(ticks, names, strict=True):
            self.sheet.text(self.across(tick), self.bottom + 0.06, name, SMALL, ha="center", va="top")
        middle = self.left + 0.5 * self.width
        self.sheet.text(middle, self.bottom + _BELOW, label, SMALL, ha="center", va="top")

    def y_axis(self, ticks: Sequence[float], names: Sequence[str], label: str) -> None:
        """Write numbers and a label on the left."""
        for tick, name in zip(ticks, names, strict=True):
            at = self._down(tick)
            self.sheet.text(self.left - 0.06, at, name, SMALL, ha="right", va="center_baseline")
        middle = self.top + 0.5 * self.height
        options = {"rotation": 90, "ha": "center", "va": "center"}
        self.sheet.text(self.left - _LABEL, middle, label, SMALL, **options)

    def titles(self, title: str, note: str, colour: str) -> None:
        """Write a title above on the left, and a remark on the right."""
        self.sheet.text(self.left, self.top - 0.06, title, NORMAL, va="baseline")
        if note:
            options = {"ha": "right", "va": "baseline", "color": colour}
            self.sheet.text(self.left + self.width, self.top - 0.06, note, SMALL, **options)

    def _down(self, value: float) -> float:
        """Return the distance of a value of y from the top of the sheet, inches."""
        return self.bottom - (value - self.y[0]) / (self.y[1] - self.y[0]) * self.height
