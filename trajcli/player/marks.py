"""Marks of an animated motion: what is taken up and left, zones about corners, signals."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount
from trajcli.planning.flown_job import FlownZone
from trajcli.planning.plan import Plan
from trajcli.trajectory import Span

_MOST_ZONES = 400  # that are drawn: a page of more would be large


def marks_of(plan: Plan) -> list[dict[str, Any]]:
    """Return the entries that are no moves, such as attach and detach: when, and what they are."""
    return [
        {"time": span.start, "index": span.index, "label": _called(span, plan)}
        for span in plan.trajectory.spans
        if span.handles
    ]


def _called(span: Span, plan: Plan) -> str:
    set_by_it = [
        f"{signal.name} = {change.value:g}"
        for signal in plan.trajectory.signals
        for change in signal.changes
        if change.move == span.index
    ]
    mass = 0.0 if span.payload is None else span.payload.mass
    what = ", ".join(set_by_it) or (f"{mass:.4g} kg" if mass > 0 else "")
    return f"{span.title}: {what}" if what else span.title


def zones_of(plan: Plan) -> list[dict[str, Any]]:
    """Return the zones that are flown: ball, programmed path, times, and a line about each."""
    zones = () if plan.flyby is None else plan.flyby.zones[:_MOST_ZONES]
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
    """Return positions to a tenth of a micrometre."""
    rounded: list[Any] = np.round(values, 7).tolist()
    return rounded


def _words(plan: Plan, zone: FlownZone) -> Iterator[str]:
    """Yield the size of a zone, how near the tool comes to its corner, and what binds in it."""
    say = plan.loaded.say
    of = plan.trajectory.joint_names[zone.joint] if zone.joint is not None else zone.of
    dimension = {"position": "length", "orientation": "angle"}.get(zone.of)
    sizes = [
        say(Amount(float(f"{value:.4g}"), dimension=dimension, joint=zone.joint))  # type: ignore[arg-type]
        for value in (zone.used, zone.asked)
    ]
    yield f"{sizes[0]} of {sizes[1]} ({of})"
    if zone.nearest is not None:
        nearest = say(Amount(float(f"{zone.nearest:.3g}"), dimension="length"))
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
