"""Paths, speeds and poses of the tool as text."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from trajcli.cli.numbers import numbers
from trajcli.cli.polynomials import law_lines

if TYPE_CHECKING:
    from trajcli.job.explanation import (
        ChoiceReport,
        CornerReport,
        ExplainedMove,
        PoseReport,
        SegmentReport,
        WeaveReport,
    )
    from trajcli.job.report import ToolReport

_ZERO = 1e-9  # user units: a coordinate or an angle below that is rounding
_REACHED = 0.999  # of the wanted speed
_CORNERS = {
    "stop": "stops there",
    "overlap": "cut by overlapping in time",
    "smooth": "goes on smoothly",
    "bend": "the curvature jumps",
}


def tool_lines(move: ExplainedMove) -> Iterator[str]:
    """Yield the segments of the path, its law, and how the tool moved along it."""
    path, tool = move.path, move.tool
    if path is None or tool is None:
        return
    yield f"  path: {path.length:.9g} {path.unit}"
    yield from (f"    {_segment(segment)}" for segment in path.segments)
    yield from (f"    corner {n}: {_corner(corner)}" for n, corner in enumerate(path.corners, 1))
    if path.weave is not None:
        yield f"    weave: {_weave(path.weave)}"
    yield from law_lines(path.law)
    yield from _speeds(tool, move.start)


def _segment(segment: SegmentReport) -> str:
    if segment.kind == "screw":
        where = "" if segment.point is None else f" through {point_text(segment.point)} {segment.unit}"
        turned = f"{segment.angle:.9g} {segment.angle_unit} about it"
        along = f"{clean(segment.advance):.9g} {segment.unit} along it"
        return f"screw about the axis {point_text(segment.axis)}{where}: {turned}, {along}"
    if segment.kind == "rotation":
        where = f"{point_text(segment.place)} {segment.unit}"
        return f"rotation by {segment.angle:.9g} {segment.angle_unit} at {where}"
    between = f"{point_text(segment.start)} to {point_text(segment.end)} {segment.unit}"
    ends = f"{between}, length {segment.length:.9g}"
    if segment.kind == "line":
        return f"line from {ends}"
    around = f"center {point_text(segment.center)}, axis {point_text(segment.axis)}"
    size = f"radius {segment.radius:.9g}, angle {segment.angle:.9g} {segment.angle_unit}"
    pitch = f", pitch {segment.pitch:.9g}" if segment.kind == "helix" else ""
    return f"{segment.kind} from {ends}: {around}, {size}{pitch}"


def _weave(weave: WeaveReport) -> str:
    parts = zip(weave.cycles, weave.lengths, strict=True)
    cycles = ", then ".join(f"{count:g} of {length:.6g}" for count, length in parts)
    how = f"{weave.amplitude:.6g} {weave.unit} to each side"
    return f"{weave.shape}, {how}, cycles along the path: {cycles} {weave.unit}"


def _corner(corner: CornerReport) -> str:
    turn = f"turn {clean(corner.turn):.6g} {corner.turn_unit}"
    where = f"at s = {corner.place:.9g} {corner.unit}, {turn}"
    if corner.kind != "rounded":
        return f"{where}: {_CORNERS[corner.kind]}"
    size = f"radius {corner.radius:.6g}, passes at {corner.deviation:.6g} {corner.unit}"
    return f"{where}: rounded, {size}"


def _speeds(tool: ToolReport, start: float) -> Iterator[str]:
    yield "  tool:"
    for peak in tool.peaks:
        if peak.negligible:
            continue
        limit = "no limit"
        if peak.limit is not None:
            limit = f"limit {peak.limit:.9g}, {100 * (peak.value / peak.limit):.4g} % used"
        name = peak.quantity.replace("_", " ")
        value = f"{peak.value:.6g} {peak.unit} (t = {peak.time - start:.6g})"
        yield f"    {name}: at most {value}; {limit}"
    yield from _by_segment(tool, start)
    yield from _held(tool)
    if tool.ruled_by:
        yield f"    the limits of {tool.ruled_by} say how fast"
    off = tool.deviation if tool.deviation_bound is None else tool.deviation_bound
    turned = tool.turned if tool.turned_bound is None else tool.turned_bound
    text = f"    off the path by at most {clean(off):.3g} {tool.deviation_unit}"
    yield f"{text}, turned by {clean(turned):.3g} {tool.turned_unit}"


def _by_segment(tool: ToolReport, start: float) -> Iterator[str]:
    """Yield the speeds of segments that have limits of their own."""
    for run in tool.segments or ():
        which = f"segment {run.first}" if run.first == run.last else f"segments {run.first} to {run.last}"
        speeds = [
            f"{peak.quantity.replace('_', ' ')} at most {peak.value:.6g} of {peak.limit:.9g} {peak.unit}"
            for peak in run.peaks
            if not peak.negligible
        ]
        where = f"s = {run.begins:.6g} to {run.ends:.6g} {run.place_unit}"
        when = f"t = {run.start - start:.6g} to {run.end - start:.6g}"
        yield f"    {which} ({where}, {when}): {', '.join(speeds) or 'no limit of speed'}"


def _held(tool: ToolReport) -> Iterator[str]:
    if tool.held is None or tool.wanted_speed is None:
        return
    wanted = f"{tool.wanted_speed:.6g} {tool.speed_unit}"
    if tool.held == 0:
        top = next(peak.value for peak in tool.peaks if peak.unit == tool.speed_unit)
        reached = "reached, but not held" if top >= _REACHED * tool.wanted_speed else "not reached"
        yield f"    tool speed of {wanted} {reached}"
        return
    text = f"    tool speed of {wanted} held on {100 * tool.held:.4g} % of the path"
    lowest = tool.lowest
    if lowest is not None:
        text += f", lowest {lowest.speed:.4g} {lowest.unit} at s = {lowest.place:.4g} {lowest.place_unit}"
        text += f" because of {lowest.joint}" if lowest.joint else ""
    yield text


def point_text(values: list[float]) -> str:
    """Return the entries of a vector as a list."""
    return "[" + ", ".join(f"{clean(value):.9g}" for value in values) + "]"


def clean(value: float) -> float:
    """Return a number in the units of the job, zero for what is rounding."""
    return value if abs(value) > _ZERO else 0.0


def pose_lines(move: ExplainedMove) -> Iterator[str]:
    """Yield what `explain` says of the poses from which a move comes and to which it goes."""
    for pose, head, origin in (
        (move.from_pose, "starts at a pose", "zero"),
        (move.to_pose, "goes to a pose", "where the arm comes from"),
    ):
        if pose is not None:
            units = ", ".join(dict.fromkeys(pose.units))
            yield f"  {head}: joints {numbers(pose.joints)} ({units})"
            branch = _listed_names(pose.branch) if pose.branch else f"without a name ({pose.method})"
            yield f"    branch: {branch}; {_singular(pose)}"
            yield f"    chosen: {_choice(pose.chosen, origin)}"
            if pose.free_direction is not None:
                along = numbers(pose.free_direction)
                yield f"    the arm can move without leaving the pose: joints along {along}"


def _listed_names(names: Mapping[str, str]) -> str:
    return ", ".join(f"{choice} {name}" for choice, name in names.items())


def _singular(pose: PoseReport) -> str:
    rank = f"rank {pose.rank['here']}, nearby {pose.rank['nearby']}"
    return f"singular ({rank})" if pose.singular else "not singular"


def _choice(chosen: ChoiceReport, origin: str) -> str:
    if chosen.within_limits == 1:
        return "the only answer within the limits"
    answers = f"of {chosen.within_limits} answers found within the limits, "
    nearest = f"the nearest to {origin}"
    if not chosen.configuration:
        return answers + nearest
    named = f"{_listed_names(chosen.configuration)} as the configuration says"
    count = chosen.candidates
    return answers + (f"{count} have {named}; of these {nearest}" if count > 1 else f"1 has {named}")
