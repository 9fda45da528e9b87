"""Largest derivatives of a path of the tool by its parameter."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from trajcli.curves.piecewise import Array, distinct
from trajcli.frozen import comparable

if TYPE_CHECKING:
    from trajcli.kinematics.following.tool_path import ToolPath

_SAMPLES = 257  # values of s at which the largest derivatives of the path are looked for


@comparable
class PathDerivatives:
    """The largest derivatives of a path by its parameter s.

    Attributes:
        moves: Whether the tcp moves; else it only turns, and s is an angle.
        curvature: Of the position, 1/m.
        turning: First derivative of the orientation, rad per unit of s.
        turning_change: Second derivative of the orientation, rad per unit squared.
    """

    moves: bool
    curvature: float
    turning: float
    turning_change: float


def path_derivatives(path: ToolPath) -> PathDerivatives:
    """Return the largest derivatives of a path, by sampling between its breaks."""
    s = distinct(np.concatenate([np.linspace(0.0, path.length, _SAMPLES), path.breaks]))
    sides = [path.poses.evaluate(s, side) for side in ("left", "right")]
    first, second = (np.stack([side[k] for side in sides]) for k in (1, 2))
    turning, change = (largest_norm(rows[..., 3:]) for rows in (first, second))
    return PathDerivatives(not path.poses.pure_rotation, largest_norm(second[..., :3]), turning, change)


def largest_norm(rows: Array) -> float:
    """Return the largest norm of rows (..., 3)."""
    return float(np.linalg.norm(rows, axis=-1).max())
