"""`trajcli explain`.

What `explain` says of the tool on its path.

What `explain` says of the points that a move passes.

How a pose of a job is reached, in words.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from trajcli.cli.numbers import numbers
from trajcli.job.read import load_job
from trajcli.output.explain import closed_form, explanation, polynomial_intervals_of
from trajcli.output.polynomials import polynomial_text
from trajcli.planning.plan import Plan, plan_job
from trajcli.queries.arm import ArmInUnits
from trajcli.streams.whole_file import standard_output
from trajcli.units import Quantity, Units, to_user, unit_name

_MOST_LAW_PIECES = 40  # pieces of a law that are listed
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
    if len(law) > _MOST_LAW_PIECES:
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


_MOST_POINTS = 20  # points that are listed one by one
_ROUNDING = 1e-12  # in units of the job: what is missed by less is met


def passing_lines(move: Mapping[str, Any]) -> Iterator[str]:
    """Yield when the points are passed, by how much beside, and where the curve leaves their range."""
    if move["origin"]:
        whole = f"from {-move['origin']:.6g} to {move['duration'] - move['origin']:.6g}"
        yield f"  unshifted times: t - {move['origin']:.10g} s, {whole}"
    passed = move["waypoints"]
    if passed is not None:
        yield from _points(passed, move["joints"], move["origin"])
    for one in move["outside"] or ():
        way = "above" if one["beyond"] > 0 else "below"
        size = f"{abs(one['beyond']):.6g} {one['unit']}"
        yield f"  {one['joint']} goes {size} {way} the points at t = {one['time']:.6g} s"


def _points(passed: list[dict[str, Any]], joints: list[str], origin: float) -> Iterator[str]:
    times = ", ".join(f"{point['time'] - origin:.6g}" for point in passed[:_MOST_POINTS])
    more = f", ... {passed[-1]['time'] - origin:.6g}" if len(passed) > _MOST_POINTS else ""
    yield f"  {len(passed)} points at (s{', unshifted' * bool(origin)}): {times}{more}"
    if not any(any(point["missed"]) for point in passed):
        return
    for joint, name in enumerate(joints):
        missed = [value if value > _ROUNDING else 0.0 for value in (p["missed"][joint] for p in passed)]
        if any(missed):
            listed = ", ".join(f"{value:.6g}" for value in missed[:_MOST_POINTS])
            more = f", ... at most {max(missed):.6g}" if len(passed) > _MOST_POINTS else ""
            yield f"  {name} passes them at a distance of ({passed[0]['units'][joint]}): {listed}{more}"


def pose_reached_lines(move: Mapping[str, Any], arm: ArmInUnits) -> Iterator[str]:
    """Yield what `explain` says of the poses from which a move comes and to which it goes."""
    for key, head, origin in (
        ("from_pose", "starts at a pose", "zero"),
        ("to_pose", "goes to a pose", "where the arm comes from"),
    ):
        told = move[key]
        if told is not None:
            units = dict.fromkeys(arm.joint_unit(i) for i in range(len(arm.robot.joints)))
            yield f"  {head}: joints {numbers(told['joints'])} ({', '.join(units)})"
            yield f"    branch: {_branch(told)}; {_singular(told)}"
            yield f"    chosen: {_choice(told['chosen'], origin)}"
            if "free_direction" in told:
                along = numbers(told["free_direction"])
                yield f"    the arm can move without leaving the pose: joints along {along}"


def _branch(told: Mapping[str, Any]) -> str:
    return _named(told["branch"]) if told["branch"] else f"without a name ({told['method']})"


def _named(names: Mapping[str, str]) -> str:
    return ", ".join(f"{choice} {name}" for choice, name in names.items())


def _singular(told: Mapping[str, Any]) -> str:
    here, nearby = told["rank"]["here"], told["rank"]["nearby"]
    return f"singular (rank {here}, nearby {nearby})" if told["singular"] else "not singular"


def _choice(chosen: Mapping[str, Any], origin: str) -> str:
    count, within = chosen["candidates"], chosen["within_limits"]
    if within == 1:
        return "the only answer within the limits"
    answers = f"of {within} answers found within the limits, "
    nearest = f"the nearest to {origin}"
    if not chosen["configuration"]:
        return answers + nearest
    named = f"{_named(chosen['configuration'])} as the configuration says"
    return answers + (f"{count} have {named}; of these {nearest}" if count > 1 else f"1 has {named}")


_SYMBOLS = {"position": "q", "velocity": "qd", "acceleration": "qdd", "jerk": "qddd"}
_FITTED = 1e-9  # of the largest: rates of a joint that rests, where the arm follows its tool
_MOST_PIECES = 100  # of a joint that are listed
_TIME_DECIMALS = 12


def run_explain(job: str, overrides: Sequence[str], *, as_json: bool) -> int:
    """Print what there is to say about each move; return the exit code.

    Raises:
        VerificationError: After printing, when the trajectory breaks a limit.
        TrajcliError: When there is nothing to explain.
    """
    plan = plan_job(load_job(job, overrides))
    told = explanation(plan)
    text = json.dumps(told, indent=2, ensure_ascii=False) if as_json else "\n".join(_lines(plan, told))
    with standard_output() as out:
        out.write((text + "\n").encode())
    if not plan.verdict.passed:
        from trajcli.output.report import verification_error

        raise verification_error(plan)
    return 0


def _lines(plan: Plan, told: dict[str, Any]) -> Iterator[str]:
    units = told["units"]
    joints = ", ".join(f"q{i} = {name}" for i, name in enumerate(told["joints"], 1) if name != f"j{i}")
    count = len(told["moves"])
    moves = f"{count} move{'s' * (count != 1)}"
    yield f"{told['job']} on {told['robot']}: {moves}, {told['duration']:.10g} s"
    yield f"angles in {units['angle']}, lengths in {units['length']}, t in s from the start of each move" + (
        f"; {joints}" if joints else ""
    )
    for index, move in enumerate(told["moves"]):
        yield ""
        yield f"move {index}: {move['planner']}, {move['duration']:.10g} s, from t = {move['start']:.10g} s"
        yield from pose_reached_lines(move, ArmInUnits(plan.loaded.robot, plan.loaded.units))
        yield from passing_lines(move)
        yield from tool_lines(move, plan.loaded.units)
        yield from _polynomials(plan, index)
        yield from _phases(move)
        yield from _peaks(move)
        yield from _speed(move)
        yield from (
            f"  {event['kind']}: {event['message']}" for event in told["events"] if event["move"] == index
        )
    general = [event for event in told["events"] if event["move"] is None]
    yield from (f"{event['kind']}: {event['message']}" for event in general)


def _polynomials(plan: Plan, index: int) -> Iterator[str]:
    move, units = plan.moves[index], plan.loaded.units
    formulas = closed_form(move, units)
    if formulas is not None:
        yield from (f"  q{i}(t) = {formula}" for i, formula in enumerate(formulas.values(), 1))
        return
    if move.planned.tool is not None:
        count = move.planned.curve.pieces
        yield f"  joints: {count} pieces of degree {move.planned.curve.degree}, listed by --json"
        return
    stretches = polynomial_intervals_of(move, units)
    counts = {len(rows) for rows in stretches}
    if len(stretches) > 1 and len(counts) == 1 and min(counts) > _MOST_PIECES:
        yield f"  q1(t) .. q{len(stretches)}(t): {min(counts)} pieces each, listed by --json"
        return
    for number, rows in enumerate(stretches, 1):
        if len(rows) > _MOST_PIECES:
            yield f"  q{number}(t): {len(rows)} pieces, listed by --json"
            continue
        one = len({row.text for row in rows}) == 1
        for row in rows[:1] if one else rows:
            when = "" if one else f"{row.start:.10g} <= t <= {row.end:.10g}: "
            yield f"  {when}q{number}(t) = {row.text}"


def _phases(move: dict[str, Any]) -> Iterator[str]:
    if move["planner"] == "time_optimal" and move["phases"]:
        yield "  which limit binds when (s):"
        yield from (
            f"    {phase['start']:.6g}..{phase['end']:.6g}: {phase['name']} of {phase['joint']}"
            for phase in move["phases"]
        )
        return
    shown: dict[str | None, list[str]] = {}
    for phase in move["phases"]:
        shown.setdefault(phase["joint"], []).append(
            f"{phase['name']} {phase['start']:.6g}..{phase['end']:.6g}"
        )
    for joint, phases in shown.items():
        yield f"  phases{f' of {joint}' if joint else ''} (s): {', '.join(phases)}"
    if move["arrivals"]:
        alone = ", ".join(f"{name} {time:.6g}" for name, time in move["arrivals"].items())
        yield f"  durations of each joint alone (s): {alone}"


def _peaks(move: dict[str, Any]) -> Iterator[str]:
    yield "  peaks:"
    largest: dict[str, float] = {}
    for peak in move["peaks"]:
        size = max(abs(peak["low"]), abs(peak["high"]))
        largest[peak["quantity"]] = max(largest.get(peak["quantity"], 0.0), size)
    for peak in move["peaks"]:
        size, most = max(abs(peak["low"]), abs(peak["high"])), largest[peak["quantity"]]
        nothing = (_ROUNDING if move["tool"] is None else _FITTED) * most
        if size <= nothing and peak["quantity"] != "position":
            continue
        nothing = max(_ROUNDING * size, nothing if move["tool"] else 0.0)
        extent = f"{_extent(peak, move['start'], nothing)} {peak['unit']}; {_limit(peak)}"
        yield f"    {peak['joint']} {_SYMBOLS[peak['quantity']]}: {extent}"


def _extent(peak: dict[str, Any], start: float, nothing: float) -> str:
    """Return the extremes with their times in the move; what is not above `nothing` is rounding."""
    if max(abs(peak["low"]), abs(peak["high"])) <= nothing:
        return "0"
    said = []
    for end in ("low", "high"):
        value = peak[end] if abs(peak[end]) > nothing else 0.0
        said.append(f"{value:.9g} (t = {round(peak[f'{end}_time'] - start, _TIME_DECIMALS):.6g})")
    return said[0] if peak["low"] == peak["high"] else " .. ".join(said)


def _limit(peak: dict[str, Any]) -> str:
    low, high = peak["limit"]
    if low is None and high is None:
        return "no limit"
    tells = peak["used"] is not None and peak["quantity"] != "position"
    return f"limits {_bound(low)} .. {_bound(high)}" + (f", {100 * peak['used']:.4g} % used" if tells else "")


def _bound(bound: float | None) -> str:
    return "unlimited" if bound is None else f"{bound:.9g}"


def _speed(move: dict[str, Any]) -> Iterator[str]:
    binding, reference = move["binding"], move["reference"]
    if binding and binding["used"] > 0:
        part = f"{100 * binding['used']:.4g} % used"
        yield f"  binding limit: {binding['quantity']} of {binding['joint']}, {part}"
    if move["stretch"] != 1:
        yield f"  stretched {move['stretch']:.6g} times"
    if reference["duration"] is None:
        yield f"  no bound for the duration: {reference['joint']}, {reference['reason']}"
    elif reference["ratio"] is not None:
        fastest = f"{reference['duration']:.6g} s, {reference['joint']}"
        how = "the fastest" if move["path"] is None else "the fastest off the path"
        yield f"  duration: {reference['ratio']:.4g} x {how} under the same limits ({fastest})"
