"""What `explain` says of the tool on its path."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from trajcli.pipeline.polynomials import polynomial_text
from trajcli.units import Quantity, Units, to_user, unit_name

_MOST = 40  # pieces of a law that are listed
_NOISE = 1e-6  # SI: a tool that turns, or goes, less than that does not
_ZERO = 1e-9  # user units: a coordinate or an angle below that is rounding
_REACHED = 0.999  # of the wanted speed
_SPEED_OF = {"length": "speed", "angle": "angular_speed"}


def tool_lines(move: Mapping[str, Any], units: Units) -> Iterator[str]:
    """Yield the segments of the path, its law, and how the tool moved along it."""
    path, tool = move["path"], move["tool"]
    if path is None or tool is None:
        return
    yield f"  path: {path['length']:.9g} {path['unit']}"
    yield from (f"    {_segment(segment, units)}" for segment in path["segments"])
    yield from (f"    corner {n}: {_corner(corner, units)}" for n, corner in enumerate(path["corners"], 1))
    yield from _law(path)
    yield from _speeds(tool, move["start"], units)


def _segment(segment: Mapping[str, Any], units: Units) -> str:
    kind, length = segment["kind"], units.length
    if kind == "screw":
        where = f" through {_point(segment['point'])} {length}" if "point" in segment else ""
        turned = f"{segment['angle']:.9g} {units.angle} about it"
        along = f"{_clean(segment['advance']):.9g} {length} along it"
        return f"screw about the axis {_point(segment['axis'])}{where}: {turned}, {along}"
    if kind == "rotation":
        return f"rotation by {segment['angle']:.9g} {units.angle} at {_point(segment['place'])} {length}"
    ends = f"{_point(segment['start'])} to {_point(segment['end'])} {length}, length {segment['length']:.9g}"
    if kind == "line":
        return f"line from {ends}"
    around = f"center {_point(segment['center'])}, axis {_point(segment['axis'])}"
    size = f"radius {segment['radius']:.9g}, angle {segment['angle']:.9g} {units.angle}"
    pitch = f", pitch {segment['pitch']:.9g}" if kind == "helix" else ""
    return f"{kind} from {ends}: {around}, {size}{pitch}"


def _corner(corner: Mapping[str, Any], units: Units) -> str:
    where = f"at s = {corner['place']:.9g} {units.length}, turn {_clean(corner['turn']):.6g} {units.angle}"
    if corner["kind"] != "rounded":
        told = {
            "stop": "stops there",
            "overlap": "cut by overlapping in time",
            "smooth": "goes on smoothly",
            "bend": "the curvature jumps",
        }
        return f"{where}: {told[corner['kind']]}"
    size = f"radius {corner['radius']:.6g}, passes at {corner['deviation']:.6g} {units.length}"
    return f"{where}: rounded, {size}"


def _law(path: Mapping[str, Any]) -> Iterator[str]:
    law = path["law"]
    if len(law) > _MOST:
        yield f"  s(t): {len(law)} pieces, listed by --json"
        return
    for piece in law:
        when = f"{piece['start']:.10g} <= t <= {piece['end']:.10g}: " if len(law) > 1 else ""
        yield f"  {when}s(t) = {polynomial_text(np.array(piece['absolute']))}"


def _speeds(tool: Mapping[str, Any], start: float, units: Units) -> Iterator[str]:
    yield "  tool:"
    for peak in tool["peaks"]:
        dimension, order = _quantity(peak["quantity"])
        quantity = Quantity(dimension, order)  # type: ignore[arg-type]
        if peak["value"] <= _NOISE:
            continue
        value, unit = to_user(peak["value"], quantity, units), unit_name(quantity, units)
        limit = "no limit"
        if peak["limit"] is not None:
            used = 100 * peak["value"] / peak["limit"]
            limit = f"limit {to_user(peak['limit'], quantity, units):.9g}, {used:.4g} % used"
        name = peak["quantity"].replace("_", " ")
        yield f"    {name}: at most {value:.6g} {unit} (t = {peak['time'] - start:.6g}); {limit}"
    yield from _held(tool, units)
    if tool["ruled_by"]:
        yield f"    the limits of {tool['ruled_by']} say how fast"
    off = to_user(tool["deviation"], Quantity("length"), units)
    turned = to_user(tool["turned"], Quantity("angle"), units)
    told = f"{_clean(off):.3g} {units.length}, turned by {_clean(turned):.3g} {units.angle}"
    yield f"    off the path by at most {told}"


def _held(tool: Mapping[str, Any], units: Units) -> Iterator[str]:
    if tool["held"] is None:
        return
    dimension = "length" if tool["unit"] == "m" else "angle"
    speed, place = Quantity(dimension, 1), Quantity(dimension)  # type: ignore[arg-type]
    wanted = f"{to_user(tool['wanted_speed'], speed, units):.6g} {unit_name(speed, units)}"
    if tool["held"] == 0:
        top = next(p["value"] for p in tool["peaks"] if p["quantity"] == _SPEED_OF[dimension])
        reached = "reached, but not held" if top >= _REACHED * tool["wanted_speed"] else "not reached"
        yield f"    tool speed of {wanted} {reached}"
        return
    text = f"    tool speed of {wanted} held on {100 * tool['held']:.4g} % of the path"
    lowest = tool["lowest"]
    if lowest is not None:
        text += f", lowest {to_user(lowest['speed'], speed, units):.4g} {unit_name(speed, units)}"
        text += f" at s = {to_user(lowest['place'], place, units):.4g} {unit_name(place, units)}"
        text += f" because of {lowest['joint']}" if lowest["joint"] else ""
    yield text


def _quantity(name: str) -> tuple[str, int]:
    angular = name.startswith("angular_")
    return "angle" if angular else "length", 1 if name.endswith("speed") else 2


def _point(values: list[float]) -> str:
    return "[" + ", ".join(f"{_clean(value):.9g}" for value in values) + "]"


def _clean(value: float) -> float:
    return value if abs(value) > _ZERO else 0.0
