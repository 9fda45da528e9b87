"""Joint limits for all t, from the roots of derivatives."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trajcli.checks.tolerances import BORDER_UNITS, exceeds
from trajcli.curves.extrema import Peaks, peaks_between
from trajcli.curves.piecewise import Array
from trajcli.findings import Finding, at_time, excess_amounts
from trajcli.kinematics.robot import Limits
from trajcli.trajectory import Span, Trajectory

_KINDS: tuple[str, ...] = ("position", "velocity", "acceleration", "jerk")


def peaks_by_move(trajectory: Trajectory) -> list[tuple[Peaks, ...]]:
    """Return for each span the extremes of position, velocity, acceleration and jerk, times on the curve.

    At the border of two moves each is asked for its own side.
    """
    curve = trajectory.curve
    borders = np.array([(span.start, span.end) for span in trajectory.spans]) + curve.start
    return peaks_between(curve, _on_breaks(borders, curve.breaks))


def check_limits(
    trajectory: Trajectory,
    limits_by_move: Sequence[Limits],
    peaks: Sequence[tuple[Peaks, ...]] | None = None,
) -> list[Finding]:
    """Return where a joint breaks a limit: for each move, joint and quantity the worst excess, if any.

    A move of no length is judged by its position and velocity: it has no time to accelerate in.

    Args:
        trajectory: What to judge.
        limits_by_move: One for each span.
        peaks: `peaks_by_move(trajectory)`, where that is known already.

    Raises:
        ValueError: When there are more or fewer limits than spans.
    """
    findings: list[Finding] = []
    for span, limits, of_span in zip(
        trajectory.spans, limits_by_move, peaks_by_move(trajectory) if peaks is None else peaks, strict=True
    ):
        for order in range(4 if span.duration > 0 else 2):
            bounds, extremes = limits.of_order(order), of_span[order]
            broken = exceeds(extremes.high, bounds[:, 1]) | exceeds(-extremes.low, -bounds[:, 0])
            findings += [
                _worst(trajectory, span, order, int(i), bounds[i], extremes) for i in np.flatnonzero(broken)
            ]
    return findings


def _worst(
    trajectory: Trajectory, span: Span, order: int, joint: int, bounds: Array, extremes: Peaks
) -> Finding:
    """Return the finding in the direction that is worse: by ratio, or by distance where it is a position."""
    low, high = extremes.low[joint], extremes.high[joint]
    below, above = (bounds[0] - low, high - bounds[1]) if order == 0 else (low / bounds[0], high / bounds[1])
    downwards = below > above
    value, limit = (low, bounds[0]) if downwards else (high, bounds[1])
    time = extremes.low_time[joint] if downwards else extremes.high_time[joint]
    slower = order > 0 and span.duration > 0
    name, kind = trajectory.joint_names[joint], _KINDS[order]
    when = float(time) - trajectory.curve.start
    return Finding(
        move=span.index,
        joint=name,
        kind=kind,
        value=float(value),
        limit=float(limit),
        time=when,
        factor=float(value / limit) ** (1 / order) if slower else None,
        message=f"the {kind} of {{joint}} reaches {{value}} {at_time(when)}, its limit is {{limit}}",
        amounts=excess_amounts(trajectory, joint, order, value=float(value), limit=float(limit)),
    )


def _on_breaks(times: Array, breaks: Array) -> Array:
    """Return `times` with those that rounding put beside a break moved onto it."""
    after = np.clip(np.searchsorted(breaks, times), 1, breaks.size - 1)
    low, high = breaks[after - 1], breaks[after]
    nearest = np.where(times - low < high - times, low, high)
    rounding = BORDER_UNITS * np.spacing(np.abs(nearest))
    return np.where(np.abs(times - nearest) <= rounding, nearest, times)
