"""Ranges, ticks and text of axes: what is in view, which numbers stand at it, and how wide words are."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from math import ceil, floor, log10

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.plots.panel import Panel

_SHARE = 0.2  # of the view that values shall take up: limits further off are not drawn, but said
_HALF = 0.5  # the same where only the limit on one side is near
_MARGIN = 0.06  # of the view, around what is in it
_LEAST = 1e-9  # of the largest value, or units: a smaller range is rounding, and not to be blown up
_AT_REST = 1e-6  # of a limit: what moves less rests, as far as a picture can show
_MOST_DIGITS = 15  # of a float64, any of them
_FIXED = (1e-4, 1e7)  # from this step, and below this number, ticks are written without an exponent
_CUT = "\N{HORIZONTAL ELLIPSIS}"
_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)


def view_of(panel: Panel) -> tuple[float, float]:
    """Return the range of y of a panel: all values and markers, and the limits where they are near."""
    columns = [trace.y for trace in panel.traces]
    columns += [marks[:, 1] for marks in (panel.waypoints, panel.virtual_points, panel.findings)]
    values = np.concatenate(columns)
    values = values[np.isfinite(values)]
    low, high = (float(values.min()), float(values.max())) if values.size else (0.0, 0.0)
    return _with_limits(low, high, finite_limits(panel))


def finite_limits(panel: Panel) -> Array:
    """Return all values of the limits of a panel, in order."""
    lines = [line[:, 1] for line in panel.limits]
    values = np.concatenate(lines) if lines else np.empty(0)
    return np.sort(values[np.isfinite(values)])


def _with_limits(low: float, high: float, limits: Array) -> tuple[float, float]:
    span, size = high - low, max(abs(low), abs(high))
    of_limits = _AT_REST * float(np.abs(limits).min(initial=np.inf)) if limits.size else 0.0
    resting = span <= max(_LEAST * max(size, 1.0), of_limits)
    for bounds, share in ((limits, _SHARE), (limits[limits > low], _HALF), (limits[limits < high], _HALF)):
        if bounds.size:
            first, last = min(low, float(bounds[0])), max(high, float(bounds[-1]))
            if resting or span >= share * (last - first):
                return _widened(first, last)
    return _widened(low - size - 1.0, high + size + 1.0) if resting else _widened(low, high)


def _widened(low: float, high: float) -> tuple[float, float]:
    margin = _MARGIN * (high - low)
    return low - margin, high + margin


def note_of(panel: Panel, view: tuple[float, float]) -> str:
    """Return what a panel says of limits that are not in view."""
    if panel.unlimited:
        return "no limit"
    limits = finite_limits(panel)
    outside = limits[(limits < view[0]) | (limits > view[1])]
    if not outside.size:
        return ""
    below, above = outside[outside < view[0]], outside[outside > view[1]]
    if below.size and above.size and below[-1] == -above[0]:
        return f"limit \N{PLUS-MINUS SIGN}{above[0]:.4g} out of view"
    named = [f"{value:.4g}" for value in (*below[-1:], *above[:1])]
    return f"limit{'s' * (len(named) > 1)} {', '.join(named)} out of view"


def ticks_of(view: tuple[float, float], count: int) -> tuple[list[float], list[str]]:
    """Return round numbers within a range, at most as many as asked for but two, and how they are written."""
    low, high = view
    raw = (high - low) / count
    magnitude = 10.0 ** floor(log10(raw))
    step = next(factor * magnitude for factor in _STEPS if factor * magnitude >= raw * (1 - 1e-9))
    first, last = ceil(low / step - 1e-9), floor(high / step + 1e-9)
    values = [index * step for index in range(first, last + 1)]
    largest = max((abs(value) for value in values), default=step)
    if _FIXED[0] <= step and largest < _FIXED[1]:
        decimals = max(0, ceil(-log10(step / 10) - 1e-9)) if step != round(step) else 0
        return values, [_trimmed(f"{value + 0.0:.{decimals}f}") for value in values]
    digits = ceil(log10(max(largest / step, 1.0)) - 1e-9) + 2
    return values, [f"{value + 0.0:.{min(digits, _MOST_DIGITS)}g}" for value in values]


def _trimmed(text: str) -> str:
    """Return a decimal number without zeros at its end, and without the sign of zero."""
    short = text.rstrip("0").rstrip(".") if "." in text else text
    return "0" if short == "-0" else short


@cache
def text_width(text: str, size: float) -> float:
    """Return the width of a text of a size in points, inches."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    font = FontProperties(family="DejaVu Sans", size=size)
    return float(text_to_path.get_text_width_height_descent(text, font, ismath=False)[0]) / 72.0


def shortened(text: str, size: float, width: float) -> str:
    """Return a text that is no wider than `width` inches; what is left out is marked."""
    if text_width(text, size) <= width:
        return text
    width, longest = width - text_width(_CUT, size), 0
    step = 1 << (len(text) - 1).bit_length()
    while step:  # the width grows with the length
        if longest + step < len(text) and text_width(text[: longest + step], size) <= width:
            longest += step
        step >>= 1
    return text[:longest] + _CUT if longest else ""


def labels_with_room(
    names: Sequence[str], middles: Array, widths: Array, size: float
) -> list[tuple[int, float]]:
    """Return index and middle of the names of intervals that have room beside the ones before, inches.

    Args:
        names: Of the intervals.
        middles: Where each is, inches, shape (m,).
        widths: Of each, inches, shape (m,); one without extent has no name.
        size: Of the text, points.
    """
    kept: list[tuple[int, float]] = []
    gap, end = 0.5 * size / 72, -math.inf
    for index, (name, middle, width) in enumerate(zip(names, middles.tolist(), widths.tolist(), strict=True)):
        half = 0.5 * text_width(name, size)
        if width > 0 and middle - half >= end + gap:
            kept.append((index, middle))
            end = middle + half
    return kept
