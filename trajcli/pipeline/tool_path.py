"""The path of a tool as a drawing office would state it: lines, arcs, corners, and the law along it."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.pipeline.polynomials import stretches
from trajcli.pipeline.stretch import PlannedMove
from trajcli.planners.tool_path.path import PathMove
from trajcli.units import Quantity, Units, factor

if TYPE_CHECKING:
    from trajcli.geometry.paths.pose import Screw
    from trajcli.kinematics.following.tool_path import ToolPath


def path_in_units(move: PlannedMove, units: Units) -> dict[str, Any] | None:
    """Return {length, unit, segments, corners, law} of the tool's path, in the job's units."""
    tool = move.planned.tool
    if tool is None:
        return None
    dimension = "angle" if tool.in_place else "length"
    scale = factor(Quantity(dimension), units)  # type: ignore[arg-type]
    law = [
        {"start": s.start, "end": s.end, "local": s.local.tolist(), "absolute": s.absolute.tolist()}
        for s in stretches(tool.law.breaks, tool.law.coefficients[:, :, 0] / scale)
    ]
    overlaps = isinstance(move.planner, PathMove) and move.planner.corner == "overlap"
    segments, corners = _drawing(tool.path, units, overlaps=overlaps)
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
