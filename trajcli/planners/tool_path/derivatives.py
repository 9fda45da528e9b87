"""Largest derivatives of a path of the tool by its parameter."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from trajcli.curves.piecewise import Array, Side, distinct
from trajcli.frozen import comparable

if TYPE_CHECKING:
    from trajcli.kinematics.following.tool_path import ToolPath

_CLOSER, _HIGHEST, _BETWEEN = 4, 5, 9  # rounds, samples looked at closer in each, and how many there
_EVEN = 1e-6  # of the first derivative, over the whole path: a turn that changes by less is even
_SAFE = 1.0 + 1e-6  # times a peak that is looked for
_SAMPLES = 257  # values of s at which the largest derivatives of the path are looked for
_SHORT = 4  # distances of samples: in shorter pieces they are looked for at
_WITHIN = np.arange(1, 16) / 16  # parts of these, too


@comparable
class PathDerivatives:
    """The largest derivatives of a path by its parameter s.

    Attributes:
        moves: Whether the tcp moves; else it only turns, and s is an angle.
        curvature: Of the position, 1/m.
        turning: First derivative of the orientation, rad per unit of s.
        turning_change: Second derivative of the orientation, rad per unit squared.
        stretch: Of the position by s; 1 where that is its arc length.
    """

    moves: bool
    curvature: float
    turning: float
    turning_change: float
    stretch: float = 1.0


def path_derivatives(path: ToolPath) -> PathDerivatives:
    """Return the largest derivatives of a path, by sampling between its breaks.

    How a tool turns about what its targets leave free has its peaks anywhere: these are looked for closer.
    """
    breaks = path.breaks
    starts, lengths = breaks[:-1], np.diff(breaks)
    short = lengths * (_SAMPLES - 1) < _SHORT * path.length
    within = (starts[short, None] + lengths[short, None] * _WITHIN).ravel()
    s = distinct(np.concatenate([np.linspace(0.0, path.length, _SAMPLES), breaks, within]))
    first, second = _derivatives(path, s)
    turning, change = (largest_norm(rows[..., 3:]) for rows in (first, second))
    if path.orientation != "all":
        turning, change = (
            _SAFE
            * largest(lambda s: np.linalg.norm(_derivatives(path, s)[..., 3:], axis=-1).max(axis=1).T, s)
        ).tolist()
        change = change if change * path.length > _EVEN * turning else 0.0
    stretch = max(1.0, largest_norm(first[..., :3]))
    stretch = stretch if stretch > 1.0 + _EVEN else 1.0
    curvature = largest_norm(second[..., :3])
    return PathDerivatives(not path.poses.pure_rotation, curvature, turning, change, stretch)


def _derivatives(path: ToolPath, s: Array) -> Array:
    """Return X' and X'' at s (N,), (2, k, N, 6): from both sides, or from one where they are the same."""
    sides: tuple[Side, ...] = ("left", "right") if path.breaks.size > 2 else ("right",)
    return np.stack([path.poses.evaluate(s, side)[1:] for side in sides], axis=1)


def largest(sizes: Callable[[Array], Array], s: Array) -> Array:
    """Return the largest (k,) of sizes (N, k) at s (N,), closer and closer around high samples."""
    best = np.zeros(1)
    for _ in range(_CLOSER):
        rows = sizes(s)
        best = np.maximum(best, rows.max(axis=0))
        highest = rows.argsort(axis=0)[-_HIGHEST:].ravel()
        low, high = s[np.maximum(highest - 1, 0)], s[np.minimum(highest + 1, s.size - 1)]
        s = np.unique(low + (high - low) * np.linspace(0.0, 1.0, _BETWEEN)[:, None])
    return best


def largest_norm(rows: Array) -> float:
    """Return the largest norm of rows (..., 3)."""
    return float(np.linalg.norm(rows, axis=-1).max())
