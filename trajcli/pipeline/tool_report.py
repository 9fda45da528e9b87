"""What a report says about the tool on its path."""

from __future__ import annotations

import math

import numpy as np

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.job.report import LowestSpeedReport, ToolPeakReport, ToolReport
from trajcli.pipeline.stretch import PlannedMove
from trajcli.planners.tool_path.move import ToolPathMove
from trajcli.trajectory import Span, Trajectory

_HELD = 0.999  # of the wanted speed: that much counts as holding it
_EACH = 16  # times of a piece of the law at which its speed is looked at
_NEAR = 0.02  # of the duration: a limit that binds as near as this is the reason


def tool_report(trajectory: Trajectory, span: Span, move: PlannedMove) -> ToolReport:
    """Return the report of a move along a path.

    Args:
        trajectory: The whole.
        span: Of the move.
        move: Its tool is told to follow a path.

    Raises:
        ValueError: When the move has no path.
    """
    from trajcli.checks.tool_rows import SPEEDS, ToolRows

    tool = move.planned.tool
    if tool is None:
        raise ValueError(f"move {move.index} has no path")
    rows = ToolRows(trajectory, span, move.robot, tool)
    peaks = []
    for _, name, _, _ in SPEEDS:
        peak = rows.peaks[name]
        limit = float(getattr(move.robot.limits.tcp, name))
        shown = None if math.isinf(limit) else limit
        at = span.start + peak.time
        peaks.append(ToolPeakReport(quantity=name, value=peak.value, bound=peak.most, time=at, limit=shown))
    deviation, turned = (float(sizes.max(initial=0.0)) for sizes in rows.beside)
    wanted = wanted_speed(move)
    held, lowest = _held(move, tool.law, wanted)
    return ToolReport(
        length=_length(tool.law),
        unit="rad" if tool.in_place else "m",
        ruled_by=tool.ruled_by,
        wanted_speed=wanted,
        held=held,
        lowest=lowest,
        peaks=peaks,
        deviation=deviation,
        turned=turned,
    )


def _length(law: PiecewisePolynomial) -> float:
    return float(law.piece_ends()[1][-1, 0])


def wanted_speed(move: PlannedMove) -> float | None:
    """Return the speed along the path that is asked for, m/s, or rad/s in place; None where none is."""
    if not isinstance(move.planner, ToolPathMove) or move.planned.tool is None:
        return None
    law, limits = move.planner.law, move.robot.limits.tcp
    if move.planned.tool.in_place:
        speed = limits.angular_speed if law.angular_speed is None else law.angular_speed
    else:
        speed = limits.speed if law.speed is None else law.speed
    return None if math.isinf(speed) or law.duration is not None else speed


def _held(
    move: PlannedMove, law: PiecewisePolynomial, wanted: float | None
) -> tuple[float | None, LowestSpeedReport | None]:
    """Return over which part of the path the wanted speed is held, and where it is lowest in between."""
    if wanted is None:
        return None, None
    part = np.linspace(0.0, 1.0, _EACH + 1)[:-1]
    times = np.append((law.breaks[:-1, None] + law.lengths[:, None] * part).reshape(-1), law.end)
    places, speeds = law.evaluate_orders(times, (0, 1))[:, :, 0].T
    fast = speeds >= _HELD * wanted
    both = fast[1:] & fast[:-1]
    held = float(np.diff(places)[both].sum() / places[-1])
    if not fast.any():
        return held, None
    first, last = int(fast.argmax()), int(fast.size - 1 - fast[::-1].argmax())
    slowest = first + int(speeds[first : last + 1].argmin())
    if speeds[slowest] >= _HELD * wanted:
        return held, None
    lowest = LowestSpeedReport(
        speed=float(speeds[slowest]), place=float(places[slowest]), joint=_reason(move, float(times[slowest]))
    )
    return held, lowest


def _reason(move: PlannedMove, time: float) -> str | None:
    """Return the joint whose limit binds nearest to a time of the move."""
    apart = [
        (max(phase.start - time, time - phase.end, 0.0), phase.joint)
        for phase in move.planned.phases
        if phase.joint is not None
    ]
    if not apart:
        return None
    distance, joint = min(apart)
    return move.robot.joint_names[joint] if distance <= _NEAR * move.duration else None
