"""What a move along a path tells its tool to do: for the planner that follows it, and for those who judge."""

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
        path: Where it goes; where segments overlap it is only near, and time alone says where it is.
        law: s(t) from t = 0, m, or rad where the tool turns in its place.
        timed: The demand at times (N,), derivatives by t; from one side of breaks.
        breaks: Times at which a second derivative may jump, the ends included.
        tolerance: How near the joints' curve promises to be.
        in_place: Whether s is an angle.
        ruled_by: "translation" or "rotation", whichever limits say how fast; None where a duration does.
        overlaps: Whether segments of the path overlap in time, so that its corners are cut.
    """

    path: ToolPath | None
    law: PiecewisePolynomial
    timed: ReferenceAt
    breaks: Array
    tolerance: Tolerance
    in_place: bool = False
    ruled_by: str | None = None
    overlaps: bool = False

    def demand(self, times: Array, side: Side = "right") -> ToolReference:
        """Return what the tool is told at times (N,) from the start of the move."""
        return self.timed(np.clip(times, self.law.start, self.law.end), side)

    def scaled(self, factor: float) -> ToolMotion:
        """Return the same way in `factor` times the time."""
        timed = self.timed

        def slower(times: Array, side: Side) -> ToolReference:
            demand = timed(np.clip(times / factor, self.law.start, self.law.end), side)
            aims = demand.aims.copy()
            if aims.shape[1]:
                aims[:, 1] /= factor
                aims[:, 2] /= factor**2
            return replace(demand, first=demand.first / factor, second=demand.second / factor**2, aims=aims)

        law = scale_time(self.law, factor)
        return replace(self, law=law, timed=slower, breaks=self.breaks * factor)


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
        ruled_by: Which limits say how fast.
    """
    passed = path.passed(law, law_breaks)

    def timed(times: Array, side: Side) -> ToolReference:
        return path.by_time(law, times, side, passed)

    breaks = distinct(np.concatenate([law_breaks, passed]))
    return ToolMotion(path, law, timed, breaks, tolerance, path.poses.in_place, ruled_by)
