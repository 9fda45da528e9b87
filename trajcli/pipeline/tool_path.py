"""The path of a tool as a drawing office would state it: lines, arcs, corners, and the law along it."""

from __future__ import annotations

from typing import Any

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.pipeline.polynomials import stretches
from trajcli.pipeline.stretch import PlannedMove
from trajcli.units import Quantity, Units, factor


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
    segments, corners = _drawing(tool.path, units)
    return {
        "length": float(tool.law.piece_ends()[1][-1, 0]) / scale,
        "unit": units.angle if tool.in_place else units.length,
        "segments": segments,
        "corners": corners,
        "law": law,
    }


def _drawing(path: Any, units: Units) -> tuple[list[dict[str, Any]], list[dict[str, Any]]]:  # noqa: ANN401
    from trajcli.geometry.chain import Chain
    from trajcli.geometry.screw import Screw

    poses = None if path is None else path.poses
    if poses is None:
        return [], []
    if isinstance(poses, Screw):
        twist = poses.twist
        lengths, angles = (factor(Quantity(kind), units) for kind in ("length", "angle"))
        screw = {
            "kind": "screw",
            "translation": _plain(twist[:3] / lengths),
            "rotation": _plain(twist[3:] / angles),
        }
        return [screw], []
    if not isinstance(poses.place, Chain):
        return [_segment(poses.place, units)], []
    length, angle = (factor(Quantity(kind), units) for kind in ("length", "angle"))
    corners = [
        {
            "kind": corner.kind,
            "place": corner.place / length,
            "point": _plain(corner.point / length),
            "turn": corner.turn / angle,
            "radius": corner.used / length,
            "deviation": corner.deviation / length,
        }
        for corner in poses.place.corners
    ]
    return [_segment(segment, units) for segment in poses.place.segments], corners


def _segment(place: Any, units: Units) -> dict[str, Any]:  # noqa: ANN401
    from trajcli.geometry.arc import Arc
    from trajcli.geometry.place_curve import Pivot

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
