"""What a report says about the tool on its path.

The path of a tool as a drawing office would state it: lines, arcs, corners, and the law along it.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.job.report import LowestSpeedReport, ToolPeakReport, ToolReport
from trajcli.output.polynomials import polynomial_intervals
from trajcli.planners.planner import PlannedMove
from trajcli.trajectory import Span, Trajectory
from trajcli.units import Quantity, Units, factor

if TYPE_CHECKING:
    from trajcli.geometry.paths.pose import Screw
    from trajcli.kinematics.following.tool_path import ToolPath

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
    from trajcli.checks.tool import SPEEDS, SampledTool

    tool = move.planned.tool
    if tool is None:
        raise ValueError(f"move {move.index} has no path")
    rows = SampledTool(trajectory, span, move.robot, tool)
    peaks = []
    for _, name, _, _ in SPEEDS:
        peak = rows.peaks[name]
        limit = float(getattr(move.robot.limits.tcp, name))
        shown = None if math.isinf(limit) else limit
        at = span.start + peak.time
        peaks.append(ToolPeakReport(quantity=name, value=peak.value, bound=peak.most, time=at, limit=shown))
    deviation, turned = (float(sizes.max(initial=0.0)) for sizes in rows.deviation)
    wanted = move.planned.wanted_speed
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


def path_in_units(move: PlannedMove, units: Units) -> dict[str, Any] | None:
    """Return {length, unit, segments, corners, law} of the tool's path, in the job's units."""
    tool = move.planned.tool
    if tool is None:
        return None
    dimension = "angle" if tool.in_place else "length"
    scale = factor(Quantity(dimension), units)  # type: ignore[arg-type]
    law = [
        {"start": s.start, "end": s.end, "local": s.local.tolist(), "absolute": s.absolute.tolist()}
        for s in polynomial_intervals(tool.law.breaks, tool.law.coefficients[:, :, 0] / scale)
    ]
    segments, corners = _drawing(tool.path, units, overlaps=tool.overlaps)
    return {
        "length": float(tool.law.piece_ends()[1][-1, 0]) / scale,
        "unit": units.angle if tool.in_place else units.length,
        "segments": segments,
        "corners": corners,
        "law": law,
    }


def _drawing(
    path: ToolPath | None, units: Units, *, overlaps: bool
) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:
    """Return the segments of a path and the corners between them."""
    from trajcli.geometry.paths.chain import Chain
    from trajcli.geometry.paths.pose import PoseCurve, Screw

    if path is None:
        return [], []
    if isinstance(path.poses, Screw):
        return [_screw(path.poses, units)], []
    place = path.poses.place if isinstance(path.poses, PoseCurve) else None
    if not isinstance(place, Chain):
        return ([] if place is None else [_segment(place, units)]), []
    length, angle = (factor(Quantity(kind), units) for kind in ("length", "angle"))
    corners = [
        {
            "kind": "overlap" if overlaps else corner.kind,
            "place": corner.place / length,
            "point": _plain(corner.point / length),
            "turn": corner.turn / angle,
            "radius": corner.used / length,
            "deviation": corner.deviation / length,
        }
        for corner in place.corners
    ]
    return [_segment(segment, units) for segment in place.segments], corners


def _screw(screw: Screw, units: Units) -> dict[str, Any]:
    """Return the axis of a screw in world, a point of it, and angle and way along it.

    Source: Lynch and Park, Modern Robotics (2017), section 3.3.2.
    """
    length, angle = (factor(Quantity(kind), units) for kind in ("length", "angle"))
    rotation, origin = screw.start[:3, :3], screw.start[:3, 3]
    moved, turned = rotation @ screw.twist[:3], rotation @ screw.twist[3:]
    size = float(np.linalg.norm(turned))
    if size == 0:
        way = float(np.linalg.norm(moved))
        return {"kind": "screw", "axis": _plain(moved / way), "angle": 0.0, "advance": way / length}
    axis = turned / size
    return {
        "kind": "screw",
        "axis": _plain(axis),
        "point": _plain((origin + np.cross(axis, moved) / size) / length),
        "angle": size / angle,
        "advance": float(axis @ moved) / length,
    }


def _segment(place: Any, units: Units) -> dict[str, Any]:  # noqa: ANN401
    from trajcli.geometry.paths.arc import Arc
    from trajcli.geometry.paths.position import Pivot

    length, angle = (factor(Quantity(kind), units) for kind in ("length", "angle"))
    if isinstance(place, Pivot):
        return {"kind": "rotation", "place": _plain(place.start / length), "angle": place.length / angle}
    if isinstance(place, Arc):
        return {
            "kind": "helix" if place.pitch else "arc",
            "start": _plain(place.start / length),
            "end": _plain(place.end / length),
            "center": _plain(place.center / length),
            "axis": _plain(place.axis),
            "radius": place.radius / length,
            "angle": place.angle / angle,
            "pitch": place.pitch / length,
            "length": place.length / length,
        }
    ends = place.evaluate(np.array([0.0, place.length]))[0] / length
    return {"kind": "line", "start": _plain(ends[0]), "end": _plain(ends[1]), "length": place.length / length}


def _plain(vector: Array) -> list[float]:
    return [float(value) + 0.0 for value in vector]
