"""Start and end of a recorded motion: where it shall begin, and how it shall end."""

from __future__ import annotations

import numpy as np

from trajcli.checks.finding import at_time
from trajcli.curves.piecewise import Array
from trajcli.errors import Amount
from trajcli.judge.finding import JudgedFinding, JudgedKind, Severity
from trajcli.judge.intervals import JointAxes
from trajcli.judge.rounding import stated_errors
from trajcli.streams.recorded_motion import Resolution
from trajcli.trajectory import State

EndState = tuple[float, int, tuple[Array | None, ...]]
"""Time, number and states (1, n) of a row."""

_REST = 1e-6
"""rad/s or m/s, relative to nothing: what a file of six decimals makes of rest."""


def judge_start(
    row: EndState, start: State, tolerance: Array, resolution: Resolution, axes: JointAxes
) -> list[JudgedFinding]:
    """Return where the first row is not the state in which the motion shall begin: the worst joint of each.

    Args:
        row: The first one.
        start: Where it shall begin.
        tolerance: How near, rad or m, shape (n,).
        resolution: Rounding of the file.
        axes: The joints.
    """
    return [
        *_position(row, start.position, tolerance, resolution, axes, "start"),
        *_velocity(row, start.velocity, resolution, axes, "start", "error"),
    ]


def judge_end(
    row: EndState, end: State | None, tolerance: Array | None, resolution: Resolution, axes: JointAxes
) -> list[JudgedFinding]:
    """Return where the last row is not the state in which the motion shall end.

    Where nobody says it, it shall be at rest, and a warning says where it is not.

    Args:
        row: The last one.
        end: Where it shall end; None where nobody says.
        tolerance: How near, rad or m, shape (n,).
        resolution: Rounding of the file.
        axes: The joints.
    """
    if end is None or tolerance is None:
        rest = np.zeros(len(axes.names))
        return _velocity(row, rest, resolution, axes, "end", "warning")
    return [
        *_position(row, end.position, tolerance, resolution, axes, "end"),
        *_velocity(row, end.velocity, resolution, axes, "end", "error"),
    ]


def _position(
    row: EndState, wanted: Array, tolerance: Array, resolution: Resolution, axes: JointAxes, kind: JudgedKind
) -> list[JudgedFinding]:
    time, number, (q, *_) = row
    if q is None:
        return []
    room = stated_errors(q, resolution.q, resolution.relative)[0]
    over = np.abs(q[0] - wanted) - tolerance
    joint = int(over.argmax())
    if over[joint] <= 0:
        return []
    value, limit = float(q[0, joint]), float(wanted[joint])
    which = "first" if kind == "start" else "last"
    within = Amount(float(tolerance[joint]), 0, joint, axes.dimension(joint), "down")
    return [
        JudgedFinding(
            rule="state",
            severity="error",
            kind=kind,
            joint=axes.names[joint],
            value=value,
            limit=limit,
            time=time,
            row=number,
            count=int((over > 0).sum()),
            quantity="position",
            certainty="exceeded" if over[joint] > room[joint] else "within rounding",
            rounding=float(room[joint]),
            message=f"the {which} row has {{joint}} at {{value}} {at_time(time)}, expected {{limit}} "
            "within {tolerance}",
            amounts={**axes.amounts(joint, 0, value, limit), "tolerance": within},
        )
    ]


def _velocity(
    row: EndState,
    wanted: Array,
    resolution: Resolution,
    axes: JointAxes,
    kind: JudgedKind,
    severity: Severity,
) -> list[JudgedFinding]:
    time, number, (_, qd, _) = row
    if qd is None or not np.isfinite(qd).all():
        return []
    room = stated_errors(qd, resolution.qd, resolution.relative)[0] + _REST
    over = np.abs(qd[0] - wanted)
    joint = int(over.argmax())
    if over[joint] <= room[joint]:
        return []
    value, limit = float(qd[0, joint]), float(wanted[joint])
    which = "first" if kind == "start" else "last"
    return [
        JudgedFinding(
            rule="state",
            severity=severity,
            kind=kind,
            joint=axes.names[joint],
            value=value,
            limit=limit,
            time=time,
            row=number,
            count=int((over > room).sum()),
            quantity="velocity",
            rounding=float(room[joint]),
            message=f"the {which} row has a velocity of {{joint}} of {{value}} {at_time(time)}, "
            "expected {limit}",
            amounts=axes.amounts(joint, 1, value, limit),
        )
    ]
