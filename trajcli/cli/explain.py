"""`trajcli explain`: the explanation of a job as text for people or JSON for programs."""

from __future__ import annotations

import sys
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from trajcli.cli.outcome import print_text
from trajcli.cli.polynomials import amount, blend_lines, knot_lines, polynomial_lines
from trajcli.cli.progress import is_terminal, progress
from trajcli.cli.tool_text import clean, point_text, pose_lines, tool_lines
from trajcli.errors import InputError, at_least
from trajcli.job.read import load_job
from trajcli.output.delivery.delivered import plan_of
from trajcli.output.explain import explanation
from trajcli.planners import HANDLING

if TYPE_CHECKING:
    from trajcli.cli.job_commands import ExplainCommand
    from trajcli.job.explanation import (
        ExplainedMove,
        ExplainedWaypoint,
        Explanation,
    )
    from trajcli.job.report import PeakReport
    from trajcli.job.report_parts import AtLimitReport, SavingReport
    from trajcli.planning.plan import Plan

_MOST_LIMITS = 6  # that bind, in one line
_SCREEN = 40  # lines about single moves on a terminal
_MOST_POINTS = 20  # points that are listed one by one
_TIME_DECIMALS = 12
_ROUNDING = 1e-12  # in units of the job: what is missed by less is met
_FITTED = 1e-9  # of the largest: rates of a joint that rests, where the arm follows its tool
_SYMBOLS = {"position": "q", "velocity": "qd", "acceleration": "qdd", "jerk": "qddd"}
_SLOWER = {"position": "position", "velocity": "position", "acceleration": "velocity", "jerk": "acceleration"}


def waypoint_lines(move: ExplainedMove) -> Iterator[str]:
    """Yield when the points are passed, at what distance, and where the curve leaves their range."""
    if move.origin:
        whole = f"from {-move.origin:.6g} to {move.duration - move.origin:.6g}"
        yield f"  unshifted times: t - {move.origin:.10g} s, {whole}"
    if move.waypoints is not None:
        yield from _points(move.waypoints, move.joints, move.origin)
    for one in move.outside or ():
        side = "above" if one.beyond > 0 else "below"
        size = f"{abs(one.beyond):.6g} {one.unit}"
        yield f"  {one.joint} goes {size} {side} the points at t = {one.time:.6g} s"


def _points(points: Sequence[ExplainedWaypoint], joints: Sequence[str], origin: float) -> Iterator[str]:
    times = ", ".join(f"{point.time - origin:.6g}" for point in points[:_MOST_POINTS])
    more = f", ... {points[-1].time - origin:.6g}" if len(points) > _MOST_POINTS else ""
    yield f"  {len(points)} points at (s{', unshifted' * bool(origin)}): {times}{more}"
    if not any(any(point.missed) for point in points):
        return
    for joint, name in enumerate(joints):
        missed = [value if value > _ROUNDING else 0.0 for value in (p.missed[joint] for p in points)]
        if any(missed):
            unit = points[0].units[joint]
            listed = ", ".join(amount(value, unit, 6) for value in missed[:_MOST_POINTS])
            more = f", ... at most {amount(max(missed), unit, 6)}" if len(points) > _MOST_POINTS else ""
            yield f"  {name} passes them at a distance of ({unit}): {listed}{more}"


def run_explain(options: ExplainCommand) -> int:
    """Print what there is to say about each move, or about one; return the exit code.

    Raises:
        VerificationError: After printing, when the trajectory breaks a limit.
        TrajcliError: When there is nothing to explain.
    """
    loaded = load_job(options.job, options.override)
    count = len(loaded.job.moves)
    if options.move is not None and not 0 <= options.move < count:
        hint = "its only move is 0" if count == 1 else f"its moves are 0 to {count - 1}"
        raise InputError(f"--move {options.move}: {loaded.name} has no such move", hint=hint)
    with progress():
        plan = plan_of(loaded)
        explained = explanation(
            plan,
            move=options.move,
            derivatives=options.derivatives,
            sensitivity=options.sensitivity,
            reference=options.reference,
        )
    if options.as_json:
        print_text(explained.model_dump_json(indent=2) + "\n")
    elif is_terminal(sys.stdout):
        from trajcli.cli.terminal import on_terminal

        short = options.move is None and not (options.full or options.derivatives or options.reference)
        lines = _overview(explained, plan) if short else _lines(explained, plan, peers=options.reference)
        print_text(on_terminal(lines))
    else:
        print_text("".join(f"{line}\n" for line in _lines(explained, plan, peers=options.reference)))
    if not plan.verdict.passed:
        from trajcli.output.report import verification_error

        raise verification_error(plan)
    return 0


def _overview(explained: Explanation, plan: Plan) -> Iterator[str]:
    """Yield what fits one screen: the moves that use most of a limit, and what binds in each of them."""
    from trajcli.cli.terminal import tightest_lines, wrapped

    yield _head(explained, plan)
    yield from tightest_lines(plan, sys.stdout)
    shown = 0
    for move in explained.moves:
        if move.planner in HANDLING:
            continue
        lines = [*_carried(move), *_speed(move.model_copy(update={"binding": None}))]  # the table has it
        shown += sum(wrapped(line, sys.stdout).count("\n") + 1 for line in lines) + 1
        if lines and shown <= _SCREEN:
            yield f"{plan.loaded.called(move.index)}:"
            yield from lines
    yield "formulas: --move N has those of one move, --full those of all"


def _head(explained: Explanation, plan: Plan) -> str:
    count = plan.loaded.move_count
    alone = f"move {explained.moves[0].index}, one of " if len(explained.moves) < len(plan.moves) else ""
    moves = f"{alone}{count} move{'s' * (count != 1)}"
    return f"{explained.job} on {explained.robot}: {moves}, {explained.duration:.10g} s"


def _lines(explained: Explanation, plan: Plan, *, peers: bool = False) -> Iterator[str]:
    units = explained.units
    joints = ", ".join(f"q{i} = {name}" for i, name in enumerate(explained.joints, 1) if name != f"j{i}")
    yield _head(explained, plan)
    yield f"angles in {units.angle}, lengths in {units.length}, t in s from the start of each move" + (
        f"; {joints}" if joints else ""
    )
    noted = [*explained.events, *explained.remarks]
    for move in explained.moves:
        yield ""
        title = plan.loaded.title(move.index)
        yield f"move {move.index}: {title}, {move.duration:.10g} s, from t = {move.start:.10g} s"
        yield from _carried(move)
        yield from (
            f"  signal {signal.name} = {signal.value:.10g} at {signal.time:.6g} s of the job"
            for signal in explained.signals
            if signal.move == move.index
        )
        if move.planner in HANDLING:
            continue
        yield from pose_lines(move)
        yield from waypoint_lines(move)
        yield from tool_lines(move)
        yield from polynomial_lines(move)
        yield from knot_lines(move)
        yield from blend_lines(move)
        yield from _phases(move)
        yield from _peaks(move)
        yield from _by_position(move)
        yield from _efforts(move)
        yield from _speed(move)
        yield from _zones(explained, move.index)
        yield from _peers(move) if peers else ()
        yield from (f"  {event.kind}: {event.message}" for event in noted if event.move == move.index)
    if explained.savings is not None and len(explained.moves) > 1:
        yield ""
        yield "all moves together:"
        yield from _savings(explained.savings)
    general = [event for event in noted if event.move is None]
    yield from _flown_by(explained)
    yield from (f"{event.kind}: {event.message}" for event in general)
    efforts = explained.efforts
    if efforts is not None and efforts.inertials is not None:
        how = "judged for all t" if efforts.judged else f"not judged, {efforts.reason}"
        yield f"efforts: {how}; masses and inertias from {efforts.inertials}"


def _flown_by(explained: Explanation) -> Iterator[str]:
    flyby = explained.flyby
    if flyby is not None and flyby.zones:
        bound = "" if flyby.bound is None else f"; bound: {flyby.bound.duration:.6g} s ({flyby.bound.method})"
        yield f"flying by its corners: {flyby.duration:.6g} s, stopping there {flyby.stopping:.6g} s{bound}"


def _zones(explained: Explanation, move: int) -> Iterator[str]:
    for zone in () if explained.flyby is None else explained.flyby.zones:
        if zone.move != move:
            continue
        of = zone.joint or zone.of
        text = f"  zone {zone.number}: {zone.used:.6g} of {zone.asked:.6g} {zone.unit} ({of})"
        text += f", entered at {zone.entered:.6g} s, left at {zone.left:.6g} s of the job"
        if zone.nearest is not None and zone.farthest is not None and zone.deviation is not None:
            text += f"; the tool {zone.nearest:.4g} to {zone.farthest:.4g} {zone.length_unit} from the corner"
            text += f", {zone.deviation:.4g} {zone.length_unit} off its path"
        yield f"{text}; binding: {zone.binds}"


def _peers(move: ExplainedMove) -> Iterator[str]:
    from trajcli.cli.plan import peer_lines

    return peer_lines(move)


def _phases(move: ExplainedMove) -> Iterator[str]:
    if move.binding_phases and move.phases:
        yield "  which limit binds when (s):"
        yield from (
            f"    {phase.start:.6g}..{phase.end:.6g}: {phase.name} of {phase.joint}" for phase in move.phases
        )
        return
    shown: dict[str | None, list[str]] = {}
    for phase in move.phases:
        shown.setdefault(phase.joint, []).append(f"{phase.name} {phase.start:.6g}..{phase.end:.6g}")
    for joint, phases in shown.items():
        yield f"  phases{f' of {joint}' if joint else ''} (s): {', '.join(phases)}"
    if move.arrivals:
        alone = ", ".join(f"{name} {time:.6g}" for name, time in move.arrivals.items())
        yield f"  durations of each joint alone (s): {alone}"


def _peaks(move: ExplainedMove) -> Iterator[str]:
    yield "  peaks:"
    largest: dict[str, float] = {}
    for peak in move.peaks:
        size = max(abs(peak.low), abs(peak.high))
        largest[peak.quantity] = max(largest.get(peak.quantity, 0.0), size)
    for peak in move.peaks:
        size = max(abs(peak.low), abs(peak.high))
        # a rate is rounding, too, where over the whole move it would hardly change what it is the rate of
        scale = max(largest[peak.quantity], largest.get(_SLOWER[peak.quantity], 0.0) / (move.duration or 1.0))
        nothing = (_ROUNDING if move.tool is None else _FITTED) * scale
        if size <= nothing and peak.quantity != "position":
            continue
        nothing = max(_ROUNDING * size, nothing if move.tool else 0.0)
        extent = f"{_extent(peak, move.start, nothing)} {peak.unit}; {_limit(peak)}"
        yield f"    {peak.joint} {_SYMBOLS[peak.quantity]}: {extent}"


def _by_position(move: ExplainedMove) -> Iterator[str]:
    for use in move.velocity_by_position or ():
        if use.used > _ROUNDING:
            velocity, limit = amount(use.velocity, use.unit), amount(use.limit, use.unit, beside=False)
            where = f"{amount(use.distance, use.distance_unit)} {use.distance_unit} before its position limit"
            when = f"t = {round(use.time - move.start, _TIME_DECIMALS):.6g}"
            yield (
                f"    {use.joint} qd by position: {velocity} {use.unit} ({when}), {where}; limit {limit}, "
                f"{100 * use.used:.4g} % used"
            )


def _carried(move: ExplainedMove) -> Iterator[str]:
    payload, tool = move.payload, move.mounted
    if tool is not None:
        name = f"tool {tool.name}" if tool.name else "tool"
        weight = "" if tool.load is None else f", {tool.load.mass:.9g} kg"
        yield f"  {name}: tcp at {point_text(tool.xyz)} {tool.xyz_unit} of the flange{weight}"
    if payload is None:
        return
    point = "" if any(payload.inertia) else ", a point mass"
    where = f"{point_text(payload.com)} {payload.com_unit} of the tcp"
    yield f"  carries {payload.mass:.9g} kg at {where}{point}"


def _efforts(move: ExplainedMove) -> Iterator[str]:
    """Yield the extremes of the efforts, what of the limits is left, and what gravity takes of it."""
    for effort in move.efforts or ():
        ends = ((effort.low, effort.low_time), (effort.high, effort.high_time))
        extent = " .. ".join(
            f"{clean(end):.6g} (t = {round(time - move.start, _TIME_DECIMALS):.6g})" for end, time in ends
        )
        limits = "no limit"
        if effort.used is not None:
            low, high = ("unlimited" if bound is None else f"{bound:.9g}" for bound in effort.limit)
            left = f"{clean(effort.head_room or 0.0):.6g} {effort.unit} left"
            limits = f"limits {low} .. {high}, {100 * effort.used:.4g} % used, {left}"
        gravity = f"{clean(effort.gravity):.6g} {effort.unit} of it against gravity"
        yield f"    {effort.joint} tau: {extent} {effort.unit}; {limits}, {gravity}"


def _extent(peak: PeakReport, start: float, nothing: float) -> str:
    """Return the extremes with their times in the move; what is not above `nothing` is rounding."""
    if max(abs(peak.low), abs(peak.high)) <= nothing:
        return "0"
    ends = []
    for end, time in ((peak.low, peak.low_time), (peak.high, peak.high_time)):
        value = end if abs(end) > nothing else 0.0
        ends.append(f"{amount(value, peak.unit)} (t = {round(time - start, _TIME_DECIMALS):.6g})")
    return ends[0] if peak.low == peak.high else " .. ".join(ends)


def _limit(peak: PeakReport) -> str:
    low, high = peak.limit
    if low is None and high is None:
        return "no limit"
    limits = f"limits {_bound(low, peak.unit)} .. {_bound(high, peak.unit)}"
    if peak.used is None or peak.quantity == "position":
        return limits
    return f"{limits}, {100 * peak.used:.4g} % used"


def _bound(bound: float | None, unit: str) -> str:
    return "unlimited" if bound is None else amount(bound, unit, beside=False)


def _at_limit(one: AtLimitReport) -> str:
    name = one.quantity.replace("_", " ")
    return f"{name} of {one.joint} for {one.seconds:.6g} s ({100 * one.share:.4g} %)"


def _savings(savings: Sequence[SavingReport] | None) -> Iterator[str]:
    """Yield what higher limits would save, of those that save something."""
    if savings is None:
        return
    if not savings:
        yield "  its limits do not say how long it lasts: none that is higher would save time"
        return
    if not any(one.saved or one.reason for one in savings):
        yield "  no limit of a joint that is 10 % higher would save time"
    for one in savings:
        if one.saved:
            share = f" ({100 * one.share:.4g} %)" if one.share is not None else ""
            yield f"  10 % more {one.quantity} of {one.joint} would save {one.saved:.6g} s{share}"
    for one in savings:
        if one.reason is not None:
            yield f"  10 % more {one.quantity} of {one.joint}: {one.reason}"


def _speed(move: ExplainedMove) -> Iterator[str]:
    binding, reference = move.binding, move.reference
    if binding and binding.used > 0:
        name = f"{binding.quantity.replace('_', ' ')} of {binding.joint or 'the tool'}"
        yield f"  binding limit: {name}, {100 * binding.used:.4g} % used"
    if move.at_limit:
        times = ", ".join(_at_limit(one) for one in move.at_limit[:_MOST_LIMITS])
        more = f" and {len(move.at_limit) - _MOST_LIMITS} more" if len(move.at_limit) > _MOST_LIMITS else ""
        yield f"  at its limits: {times}{more}"
    yield from _savings(move.savings)
    if move.stretch != 1:
        yield f"  stretched {at_least(move.stretch)} times"
    if reference is None:
        return
    if reference.duration is None:
        yield f"  no bound for the duration: {reference.joint}, {reference.reason}"
    elif reference.ratio is not None:
        needs = "several joints together" if reference.joint is None else reference.joint
        fastest = f"{reference.duration:.6g} s, {needs}"
        where = (
            " through its points"
            if reference.through_points
            else ""
            if move.path is None
            else " off the path"
        )
        how = f"the fastest{where}"
        yield f"  duration: {reference.ratio:.4g} x {how} under the same limits ({fastest})"
