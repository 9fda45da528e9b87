"""Motion of the tool over the time of a move: its path, its law, and its reference at any time."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side, distinct
from trajcli.frozen import frozen
from trajcli.kinematics.following.follower import ReferenceAt
from trajcli.kinematics.following.tolerance import Tolerance
from trajcli.kinematics.following.tool_path import ToolPath, ToolReference


@frozen
class ToolMotion:
    """The tool over the time of a move.

    Attributes:
        path: Where it goes; where segments overlap only near it, and time alone says where it is.
        law: s(t) from t = 0, m, or rad where the tool turns in place.
        reference_at: The reference at times (N,), derivatives by t; from one side of breaks.
        breaks: Times at which a second derivative may jump, the ends included.
        tolerance: How near the joints' curve promises to be.
        pure_rotation: Whether s is an angle.
        ruled_by: "translation" or "rotation", whose limits determine the speed; None where a duration does.
        overlaps: Whether segments of the path overlap in time, so that its corners are cut.
    """

    path: ToolPath | None
    law: PiecewisePolynomial
    reference_at: ReferenceAt
    breaks: Array
    tolerance: Tolerance
    pure_rotation: bool = False
    ruled_by: str | None = None
    overlaps: bool = False

    @property
    def length(self) -> float:
        """Length of the path, m, or rad where the tool turns in place; beside a zone that of a part."""
        return float(self.law.piece_ends()[1][-1, 0]) if self.path is None else self.path.length

    def reference(self, times: Array, side: Side = "right") -> ToolReference:
        """Return the reference of the tool at times (N,) from the start of the move."""
        return self.reference_at(np.clip(times, self.law.start, self.law.end), side)

    def scaled(self, factor: float) -> ToolMotion:
        """Return the same motion in `factor` times the time."""
        reference_at = self.reference_at

        def slower(times: Array, side: Side) -> ToolReference:
            reference = reference_at(np.clip(times / factor, self.law.start, self.law.end), side)
            aims = reference.aims.copy()
            if aims.shape[1]:
                aims[:, 1] /= factor
                aims[:, 2] /= factor**2
            pins = reference.pins
            if pins is not None:
                pins = pins / np.array([1.0, factor, factor**2])[:, None, None]
            first, second = reference.first / factor, reference.second / factor**2
            return replace(reference, first=first, second=second, aims=aims, pins=pins)

        law = scale_time(self.law, factor)
        return replace(self, law=law, reference_at=slower, breaks=self.breaks * factor)


def motion_along(
    path: ToolPath,
    law: PiecewisePolynomial,
    law_breaks: Array,
    tolerance: Tolerance,
    ruled_by: str | None = None,
) -> ToolMotion:
    """Return the motion along a path under a law.

    Args:
        path: Where the tool goes.
        law: s(t).
        law_breaks: Where a derivative of it jumps, the ends included.
        tolerance: How near the joints' curve promises to be.
        ruled_by: Which limits determine the speed.
    """
    crossings = path.crossings(law, law_breaks)

    def reference_at(times: Array, side: Side) -> ToolReference:
        return path.at_time(law, times, side, crossings)

    breaks = distinct(np.concatenate([law_breaks, crossings]))
    return ToolMotion(path, law, reference_at, breaks, tolerance, path.poses.pure_rotation, ruled_by)
