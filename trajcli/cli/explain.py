"""`trajcli explain`."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from typing import Any

from trajcli.cli.passing_text import passing_lines
from trajcli.cli.reached_text import pose_reached_lines
from trajcli.cli.tool_text import tool_lines
from trajcli.job.read import load_job
from trajcli.pipeline.arm import Arm
from trajcli.pipeline.explain import closed_form, explanation, stretches_of
from trajcli.pipeline.plan import Plan, plan_job
from trajcli.streams.whole_file import standard_output

_SYMBOLS = {"position": "q", "velocity": "qd", "acceleration": "qdd", "jerk": "qddd"}
_ROUNDING = 1e-12
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
        from trajcli.pipeline.report import verification_error

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
        yield from pose_reached_lines(move, Arm(plan.loaded.robot, plan.loaded.units))
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
    stretches = stretches_of(move, units)
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
