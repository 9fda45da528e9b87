"""Marks of an animated motion: what is taken up and carried, efforts, zones about corners, signals."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount
from trajcli.planning.flown_job import FlownZone
from trajcli.planning.plan import Plan
from trajcli.player.rows import DrawnRows
from trajcli.trajectory import Span

_DENSITY = 2700.0  # kg/m^3, of aluminium: a load is drawn as a ball of it
_RADII = (0.012, 0.35)  # m: a ball is neither lost nor larger than arms are
MOST_ZONES = 400  # that are drawn: a page of more would be large


def marks_of(plan: Plan) -> list[dict[str, Any]]:
    """Return the entries that are no moves, such as attach and detach: when, and what they are."""
    return [
        {"time": span.start, "index": span.index, "label": _called(span, plan)}
        for span in plan.trajectory.spans
        if span.handles
    ]


def _called(span: Span, plan: Plan) -> str:
    load = getattr(plan.loaded.job.moves[span.index], "attach", None)
    what = f"{load.mass:.4g} kg" if load else ""
    what += ", ".join(
        f"{signal.name} = {change.value:g}"
        for signal in plan.trajectory.signals
        for change in signal.changes
        if change.move == span.index
    )
    return f"{span.title}: {what}" if what else span.title


def zones_of(plan: Plan) -> list[dict[str, Any]]:
    """Return the zones that are flown: ball, programmed path, times, and a line about each."""
    zones = () if plan.flyby is None else plan.flyby.zones[:MOST_ZONES]
    return [_zone(plan, zone) for zone in zones]


def _zone(plan: Plan, zone: FlownZone) -> dict[str, Any]:
    robot = plan.moves[zone.move].robot
    ball = zone.ball(robot)
    return {
        "start": zone.entered,
        "end": zone.left,
        "time": zone.passed,
        "label": f"zone {zone.number}, {plan.loaded.called(zone.move)}:",
        "message": "; ".join(_words(plan, zone)),
        "ball": None if ball is None else _rounded(ball),
        "programmed": _rounded(zone.tool_path(robot)),
    }


def _rounded(values: Array) -> list[Any]:
    """Return positions to 1e-7 m."""
    rounded: list[Any] = np.round(values, 7).tolist()
    return rounded


def _words(plan: Plan, zone: FlownZone) -> Iterator[str]:
    """Yield the size of a zone, how near the tool comes to its corner, and what binds in it."""
    say = plan.loaded.say
    of = plan.trajectory.joint_names[zone.joint] if zone.joint is not None else zone.of
    dimension = {"position": "length", "orientation": "angle"}.get(zone.of)
    sizes = [
        say(Amount(value, dimension=dimension, joint=zone.joint, digits=4))  # type: ignore[arg-type]
        for value in (zone.used, zone.asked)
    ]
    yield f"{sizes[0]} of {sizes[1]} ({of})"
    if zone.nearest is not None:
        nearest = say(Amount(zone.nearest, dimension="length", digits=3))
        yield f"the tool comes to {nearest} from the corner"
    yield f"binding: {zone.binds}"


def signals_of_plan(plan: Plan) -> list[dict[str, Any]]:
    """Return the signals: name, and the value from each change on, with what sets it."""
    return [
        {
            "name": signal.name,
            "changes": [
                {"time": change.time, "value": change.value, "label": plan.loaded.called(change.move)}
                for change in signal.changes
            ],
        }
        for signal in plan.trajectory.signals
    ]


def loads_of(plan: Plan) -> list[dict[str, Any]]:
    """Return what the tool carries, by interval of time: mass, kg, its centre in the frame of the tcp, m.

    Beside it stands the radius of a ball of aluminium, m.
    """
    loads: list[dict[str, Any]] = []
    before = None
    for span in plan.trajectory.spans:
        payload = span.payload
        if payload is None or payload.mass == 0:
            before = None
            continue
        if before == payload.bits:
            loads[-1]["end"] = span.end
        else:
            radius = float(np.clip(np.cbrt(0.75 * payload.mass / _DENSITY / np.pi), *_RADII))
            ball = {"mass": payload.mass, "com": payload.com.tolist(), "radius": radius}
            loads.append({"start": span.start, "end": span.end, **ball})
        before = payload.bits
    return [load for load in loads if load["end"] > load["start"]]


def shows_efforts(plan: Plan) -> bool:
    """Whether an effort is limited in some move, or a load is carried, by an arm whose inertias are known."""
    robot = plan.loaded.robot
    if robot.convention is None or robot.without_inertia:
        return False
    robots = [move.robot for move in plan.moves]
    return any(each.limits.has_effort or (each.payload and each.payload.mass > 0) for each in robots)


def efforts_of_rows(plan: Plan, rows: DrawnRows) -> Array:
    """Return the efforts of the joints on rows of a plan's curve (N, n), N m or N, with what is carried then.

    Of two rows of one time the first is before it, the other after it.
    """
    from trajcli.dynamics.newton_euler import InverseDynamics

    q, qd, qdd = (rows.values[name] for name in ("q", "qd", "qdd"))
    efforts = np.zeros_like(q)
    finite = np.isfinite(np.concatenate([q, qd, qdd], axis=1)).all(axis=1)
    owners = _owners(plan, rows.times)
    for index, move in enumerate(plan.moves):
        own = finite & (owners == index)
        if own.any():
            efforts[own] = InverseDynamics(move.robot).effort(q[own], qd[own], qdd[own])
    return efforts


def _owners(plan: Plan, times: Array) -> NDArray[np.intp]:
    """Return the index of the move that each row belongs to, shape (N,)."""
    spans = [span for span in plan.trajectory.spans if span.duration > 0] or list(plan.trajectory.spans)
    starts = np.array([span.start for span in spans[1:]])
    before = np.append(times[1:] == times[:-1], False)
    number = np.where(before, np.searchsorted(starts, times, "left"), np.searchsorted(starts, times, "right"))
    return np.array([span.index for span in spans], dtype=np.intp)[number]
