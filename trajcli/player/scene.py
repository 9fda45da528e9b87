"""Scene of a planned job, or of two motions: what a page shows of arm, motion, limits and verdict."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trajcli.columns import EFFORT
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.findings import Finding
from trajcli.grids import AT_BREAK
from trajcli.kinematics.robot import QUANTITIES, JointType, Limits, Robot
from trajcli.planners.planner import Event
from trajcli.planning.binding_limits import tightest_of_moves
from trajcli.planning.plan import Plan
from trajcli.player.rows import ORDERS, DrawnRows, packed, rows_of_curve
from trajcli.trajectory import Span, Trajectory
from trajcli.units import Quantity, Units, effort_unit, factor, joint_quantity, typeset, unit_name
from trajcli.version import __version__

BUDGET = 0.5
"""MB that the visual meshes of a page take."""
_MOST_WAYPOINTS = 40
_MOST_STEPS = 100
_SAME = 1e-4  # rad or m: waypoints that are nearer than this are one
_MADE_BY = f"Made by trajcli {__version__}"
_OF_OTHER = ("title", "subtitle", "verdict", "joints", "robot", "length", "tool", "rows", "loads")
"""What a page shows of the second motion."""


def scene_of_plan(plan: Plan, meshes: float = BUDGET) -> dict[str, Any]:
    """Return the scene of a plan, verified or not, as the player reads it: SI, and the units to show.

    Args:
        plan: The plan.
        meshes: How long the visual meshes of a URDF may be, MB; with 0 none are shown.

    Raises:
        FileError: When the URDF of the job cannot be read any more.
    """
    loaded, trajectory, verdict = plan.loaded, plan.trajectory, plan.verdict
    spans = [span for span in trajectory.spans if span.duration > 0]
    when = [finding.time for finding in verdict.findings if finding.time is not None]
    rows, loads = _rows_and_loads(plan, [span.start for span in spans], when)
    causes = _causes(plan)
    state, text = (
        ("verified", "verified") if verdict.passed else ("violated", _counted(len(causes), "finding"))
    )
    moves = _counted(loaded.move_count, "move")
    names, types = trajectory.joint_names, trajectory.joint_types
    scene = {
        "version": 1,
        "title": loaded.name,
        "subtitle": f"{loaded.robot.name} · {moves} · {trajectory.duration:.6g} s",
        "verdict": {"state": state, "text": text},
        "made_by": _MADE_BY,
        "joints": joints_in_units(names, types, loaded.units),
        **geometry_of(loaded.robot, rows, loaded.units, trajectory=trajectory),
        "rows": rows.packed(),
        "moves": [*_moves(plan)],
        "limits": limits_of([(s.start, s.end, plan.moves[s.index].robot.limits) for s in spans]),
        "loads": loads,
        **_marks(plan),
        "waypoints": waypoints_of([*_waypoints(plan)]) if loaded.robot.convention else [],
        "findings": [_finding(plan, finding) for finding in verdict.findings],
        "causes": causes,
        "opens_at": opening(verdict.findings, causes),
        "events": [_event(plan, event) for event in plan.events if not event.is_internal],
        "steps": [_step(plan, k) for k in range(min(len(verdict.steps), _MOST_STEPS))],
        "notes": list(_notes(plan)),
    }
    from trajcli.player.meshes import meshes_of_job

    return dressed(scene, *meshes_of_job(loaded, meshes))


def dressed(scene: dict[str, Any], meshes: list[dict[str, Any]], remarks: list[str]) -> dict[str, Any]:
    """Return a scene whose arm has meshes, with remarks on them, which stand among its notes, too."""
    robot = scene["robot"] and {**scene["robot"], **({"meshes": meshes} if meshes else {})}
    return {**scene, "robot": robot, "notes": [*scene["notes"], *remarks], "remarks": remarks}


def _rows_and_loads(
    plan: Plan, borders: Sequence[float], when: Sequence[float]
) -> tuple[DrawnRows, list[dict[str, Any]]]:
    """Return the rows of a plan, with efforts where some are limited or a load is carried, and the loads."""
    rows = rows_of_curve(plan.trajectory.curve, borders, when)
    if plan.loaded.robot.convention is None:
        return rows, []
    from trajcli.player.marks import efforts_of_rows, loads_of, shows_efforts

    if shows_efforts(plan):
        rows = DrawnRows(rows.times, {**rows.values, EFFORT: efforts_of_rows(plan, rows)})
    return rows, loads_of(plan)


def _marks(plan: Plan) -> dict[str, Any]:
    from trajcli.player.marks import marks_of, signals_of_plan, zones_of

    zones = zones_of(plan) if plan.loaded.robot.convention else []
    return {"marks": marks_of(plan), "zones": zones, "signals": signals_of_plan(plan)}


def joints_in_units(names: Sequence[str], types: Sequence[JointType], units: Units) -> list[dict[str, Any]]:
    """Return the name of each joint, its units by order of the derivative, and how many make one in SI.

    The last unit is that of efforts, which are in SI.
    """
    return [
        {
            "name": name,
            "units": [
                *(typeset(unit_name(joint_quantity(kind, order), units)) for order in range(len(ORDERS))),
                effort_unit(kind),
            ],
            "scale": 1 / factor(joint_quantity(kind), units),
        }
        for name, kind in zip(names, types, strict=True)
    ]


def geometry_of(
    robot: Robot | None,
    rows: DrawnRows,
    units: Units,
    reason: str = "",
    *,
    trajectory: Trajectory | None = None,
) -> dict[str, Any]:
    """Return what is drawn in space: the arm's table and the path of its tool; or why nothing is.

    Args:
        robot: The arm; None where there is none.
        rows: Its motion.
        units: To be shown.
        reason: Why there is no arm.
        trajectory: Whose spans, from the first row on, know the tool on the flange; None where that is one.
    """
    if robot is None or robot.convention is None:
        if robot is not None:
            reason = (
                f"{robot.name} has bare joints: without Denavit-Hartenberg rows there is nothing to draw."
            )
        return {"robot": None, "no_geometry": f"{reason} The plots show its motion."}
    length, angle = Quantity("length"), Quantity("angle")
    ranges = np.array([rows.values["q"].min(axis=0), rows.values["q"].max(axis=0)]).T.tolist()
    table = [
        {
            **{key: getattr(joint, key) for key in ("theta", "d", "a", "alpha", "sign")},
            **({"beta": joint.beta} if joint.beta else {}),
            "prismatic": joint.type == "prismatic",
            "modified": robot.convention == "modified",
            "range": between,
        }
        for joint, between in zip(robot.joints, ranges, strict=True)
    ]
    arm: dict[str, Any] = {"rows": table, "base": robot.base.tolist(), "tool": robot.tool.tolist()}
    if trajectory is not None:
        moving = [span for span in trajectory.spans if span.duration > 0] or list(trajectory.spans[:1])
        arm["tool"] = (moving[0].arm(robot) if moving else robot).tool.tolist()
        changes = [
            {"time": float(rows.times[0]) + span.start, "tool": span.arm(robot).tool.tolist()}
            for before, span in pairwise(moving)
            if span.tool is not before.tool
        ]
        arm |= {"changes": changes} if changes else {}
    return {
        "robot": arm,
        "length": {"unit": unit_name(length, units), "scale": 1 / factor(length, units)},
        "angle": {"unit": unit_name(angle, units), "scale": 1 / factor(angle, units)},
        "tool": _tool(robot, rows, units, trajectory),
    }


def _tool(robot: Robot, rows: DrawnRows, units: Units, trajectory: Trajectory | None) -> dict[str, Any]:
    from trajcli.kinematics.forward import forward

    q, times = rows.values["q"], rows.times - rows.times[0]
    times[:-1][np.diff(times) == 0] -= 2 * AT_BREAK  # of two rows at one time the first belongs to what ends

    def of_tools(values: Callable[[Robot, NDArray[np.intp]], Array]) -> Array:
        everything = np.arange(times.size)
        return values(robot, everything) if trajectory is None else trajectory.of_tools(robot, times, values)

    positions = of_tools(lambda arm, k: forward(arm, q[k])[:, :3, 3])
    speed = Quantity("length", 1)
    return {
        "positions": packed(positions.T),
        "speeds": packed(_speeds(rows, positions, of_tools)[None]),
        "unit": unit_name(speed, units),
        "scale": 1 / factor(speed, units),
    }


def _speeds(
    rows: DrawnRows, positions: Array, of_tools: Callable[[Callable[[Robot, NDArray[np.intp]], Array]], Array]
) -> Array:
    """Return the speed of the tcp on each row, (N,), m/s; from its positions where no rates are known."""
    from trajcli.kinematics.jacobian import tcp_twist

    if "qd" in rows.values:
        q, qd = rows.values["q"], rows.values["qd"]
        twist = of_tools(lambda arm, k: tcp_twist(arm, q[k], qd[k]))
        return np.asarray(np.linalg.norm(twist[:, :3], axis=1))
    if rows.times.size < 2:
        return np.zeros(rows.times.size)
    return np.asarray(np.linalg.norm(np.gradient(positions, rows.times, axis=0), axis=1))


def limits_of(parts: Sequence[tuple[float, float, Limits]]) -> list[dict[str, Any]]:
    """Return the limits in force by interval of time, SI, null where there is none; equal neighbours are one.

    Args:
        parts: Start, end and limits of each interval, s.
    """
    intervals: list[dict[str, Any]] = []
    for start, end, limits in parts:
        bounds = [_finite(limits.of_order(order)) for order in range(len(QUANTITIES))]
        bounds += [_finite(limits.effort)] if limits.has_effort else []
        if intervals and intervals[-1]["bounds"] == bounds:
            intervals[-1]["end"] = end
        else:
            intervals.append({"start": start, "end": end, "bounds": bounds})
    return intervals


def _finite(bounds: Array) -> list[list[float | None]]:
    return [[value if math.isfinite(value) else None for value in pair] for pair in bounds.tolist()]


def waypoints_of(points: Sequence[tuple[float, Array, str]]) -> list[dict[str, Any]]:
    """Return points of a motion, those that are equal once; of very many every so manyth.

    Args:
        points: Time, s, joint values (n,), SI, and name of each; the name is empty where it has none.
    """
    distinct: dict[tuple[float, ...], dict[str, Any]] = {}
    for time, joints, name in points:
        key = tuple(np.rint(joints / _SAME).tolist())
        point = distinct.setdefault(key, {"time": time, "joints": joints.tolist(), "name": name})
        point["name"] = point["name"] or name
    kept = list(distinct.values())
    return kept[:: math.ceil(len(kept) / _MOST_WAYPOINTS) or 1]


def _waypoints(plan: Plan) -> Iterator[tuple[float, Array, str]]:
    """Yield the start, the points that moves pass, and their ends."""
    curve, spans = plan.trajectory.curve, plan.trajectory.spans
    yield 0.0, curve.evaluate(0.0), next((span.origin for span in spans if not span.handles), "")
    for move, span in zip(plan.moves, spans, strict=True):
        points = move.planned.via_points
        for time in [] if points is None else points.times.tolist():
            at = min(max(span.start + time, span.start), span.end)
            yield at, curve.evaluate(min(at, curve.end)), ""
        yield span.end, curve.evaluate(min(span.end, curve.end), side="left"), span.goal


def _moves(plan: Plan) -> Iterator[dict[str, Any]]:
    """Yield what is shown of each move: its title, and the limit of which it uses most."""
    tightest = {one.span.index: one for one in tightest_of_moves(plan)}
    for span in plan.trajectory.spans:
        if not span.handles:
            one = tightest.get(span.index)
            used = "" if one is None else f"; {one.name} uses {one.share} of its limit"
            words = {
                "title": span.title,
                "label": f"{span.index} {span.title}",
                "detail": f"{span.duration:.6g} s{used}",
            }
            yield {**_interval(span), "index": span.index, **words}


def _interval(span: Span) -> dict[str, float]:
    return {"start": span.start, "end": span.end}


def _finding(plan: Plan, finding: Finding) -> dict[str, Any]:
    names = plan.trajectory.joint_names
    return {
        "time": finding.time,
        "joint": names.index(finding.joint) if finding.joint in names else None,
        "order": order_of(finding.kind),
        "value": finding.value,
        "label": "" if finding.move is None else f"{plan.loaded.called(finding.move)}:",
        "message": finding.text(plan.loaded.say),
        "hint": finding.hint,
    }


def _causes(plan: Plan) -> list[list[int]]:
    """Return the numbers of findings of one cause, the worst of each first."""
    if plan.verdict.passed:
        return []
    from trajcli.planning.causes import causes_of

    return [list(cause.indices) for cause in causes_of(plan)]


def opening(findings: Sequence[Finding], causes: Sequence[Sequence[int]]) -> float | None:
    """Return the time of the worst finding, s, at which a page opens; None where none has a time."""
    from trajcli.planning.causes import badness

    worst = [findings[cause[0]] for cause in causes if findings[cause[0]].time is not None]
    return max(worst, key=badness).time if worst else None


def order_of(kind: str) -> int | None:
    """Return the number of the plot that a kind of limit stands in; None where it stands in none."""
    plots = (*QUANTITIES, "effort")
    return plots.index(kind) if kind in plots else None


def _event(plan: Plan, event: Event) -> dict[str, Any]:
    time = 0.0 if event.move is None else plan.trajectory.spans[event.move].start
    label = "" if event.move is None else f"{plan.loaded.called(event.move)}:"
    return {"time": time, "label": label, "message": event.message}


def _step(plan: Plan, index: int) -> dict[str, Any]:
    step, trajectory = plan.verdict.steps[index], plan.trajectory
    quantity = joint_quantity(trajectory.joint_types[trajectory.joint_names.index(step.joint)], 2)
    size = step.size / factor(quantity, plan.loaded.units)
    unit = typeset(unit_name(quantity, plan.loaded.units))
    return {"time": step.time, "label": f"{step.joint}:", "message": f"by {size:.4g} {unit}"}


def _notes(plan: Plan) -> Iterator[str]:
    """Yield remarks, and what was not judged."""
    verdict = plan.verdict
    for remark in plan.remarks:
        said = _event(plan, remark)
        yield f"{said['label']} {said['message']}".strip()
    if plan.unchecked:
        yield f"Without a limit, not checked: {plan.unchecked}."
    if verdict.unchecked_of_tool:
        names = ", ".join(name.replace("_", " ") for name in verdict.unchecked_of_tool)
        yield f"Limited, but not checked in every move: {names} of the tool."
    for what, indices in verdict.sampled:
        moves = ", ".join(map(str, indices[:20])) + (", ..." if len(indices) > 20 else "")
        yield f"On samples only: {what}, moves {moves}."
    if len(verdict.steps) > _MOST_STEPS:
        yield f"Of {len(verdict.steps)} steps in acceleration the first {_MOST_STEPS} are listed."
    if plan.flyby is not None and plan.loaded.robot.convention:
        from trajcli.player.marks import MOST_ZONES

        if len(plan.flyby.zones) > MOST_ZONES:
            yield f"Of {len(plan.flyby.zones)} zones the first {MOST_ZONES} are drawn."


def _counted(count: int, noun: str) -> str:
    return f"{count} {noun}{'s' * (count != 1)}"


def scene_of_two(first: Mapping[str, Any], second: Mapping[str, Any]) -> dict[str, Any]:
    """Return the scene of two motions of one kind of arm; limits, moves and marks are those of the first.

    Args:
        first: A scene, as of a plan or a file.
        second: Another.

    Raises:
        InputError: When their joints are not of the same number and kinds.
    """
    kinds = [[_kind(joint) for joint in scene["joints"]] for scene in (first, second)]
    if len(kinds[0]) != len(kinds[1]):
        counts = [f"{scene['title']} has {len(scene['joints'])}" for scene in (first, second)]
        raise InputError(
            f"the motions have not as many joints: {counts[0]}, {counts[1]}", hint="view each alone"
        )
    for number, pair in enumerate(zip(*kinds, strict=True)):
        if "?" not in pair and pair[0] != pair[1]:
            names = [f"{kind} in {scene['title']}" for kind, scene in zip(pair, (first, second), strict=True)]
            raise InputError(f"joint {number + 1} is {' and '.join(names)}", hint="view each alone")
    other = {key: second[key] for key in _OF_OTHER if key in second}
    notes = [f"{second['title']}: {note}" for note in second["notes"]]
    findings = [f"{second['title']}: {one['label']} {one['message']}" for one in _worst(second)]
    return {
        **first,
        "other": {**other, "moves": second["moves"]},
        "notes": [*first["notes"], *findings, *notes],
    }


def _worst(scene: Mapping[str, Any]) -> list[Mapping[str, Any]]:
    return [scene["findings"][cause[0]] for cause in scene["causes"]]


def _kind(joint: Mapping[str, Any]) -> str:
    unit = joint["units"][0]
    return "?" if " or " in unit else {"deg": "an angle", "rad": "an angle"}.get(unit, "a length")
