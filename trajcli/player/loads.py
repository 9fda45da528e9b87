"""Loads and efforts of an animated motion: what the tool carries and when, and what drives the joints."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.planning.plan import Plan
from trajcli.player.rows import DrawnRows

_DENSITY = 2700.0  # kg/m^3, of aluminium: a load is drawn as a ball of it
_RADII = (0.012, 0.35)  # m: a ball is neither lost nor larger than arms are


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
    known = np.isfinite(np.concatenate([q, qd, qdd], axis=1)).all(axis=1)
    owners = _owners(plan, rows.times)
    for index, move in enumerate(plan.moves):
        own = known & (owners == index)
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
