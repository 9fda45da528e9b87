"""Start, end and order of recorded rows: where they shall begin, how they end, that stamps increase."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount
from trajcli.findings import (
    Collector,
    Finding,
    FindingSeverity,
    NamedJoints,
    at_time,
    excess_amounts,
    time_text,
)
from trajcli.judge.rounding import stated_errors
from trajcli.kinematics.robot import QUANTITIES
from trajcli.streams.recorded_motion import Resolution
from trajcli.trajectory import State

EndState = tuple[float, int, tuple[Array | None, ...]]
"""Time, number and states (1, n) of a row."""

_REST = 1e-6
"""rad/s or m/s, relative to nothing: what a file of six decimals makes of rest."""


def judge_start(
    row: EndState, start: State, tolerance: Array, resolution: Resolution, axes: NamedJoints
) -> list[Finding]:
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
        *_rate(row, start.velocity, 1, resolution, axes, ("start", "error")),
    ]


def judge_end(
    row: EndState,
    end: State | None,
    tolerance: Array | None,
    resolution: Resolution,
    axes: NamedJoints,
) -> list[Finding]:
    """Return where the last row is not the state in which the motion shall end.

    Where nobody says it, it shall be at rest, and a warning says where it is not.

    Args:
        row: The last one.
        end: Where it shall end; None where nobody says. An acceleration that nobody says is NaN.
        tolerance: How near, rad or m, shape (n,).
        resolution: Rounding of the file.
        axes: The joints.
    """
    if end is None or tolerance is None:
        standing = np.zeros(len(axes.joint_names))
        return _rate(row, standing, 1, resolution, axes, ("end", "warning"))
    return [
        *_position(row, end.position, tolerance, resolution, axes, "end"),
        *_rate(row, end.velocity, 1, resolution, axes, ("end", "error")),
        *_rate(
            row,
            end.acceleration,
            2,
            resolution,
            axes,
            ("end", "error"),
        ),
    ]


def _position(
    row: EndState, wanted: Array, tolerance: Array, resolution: Resolution, axes: NamedJoints, kind: str
) -> list[Finding]:
    time, number, (q, *_) = row
    if q is None:
        return []
    slack = stated_errors(q, *resolution.roundings[0])[0]
    over = np.abs(q[0] - wanted) - tolerance
    joint = int(np.where(over > 0, over - slack, -np.inf).argmax())  # roundings differ by joint
    if over[joint] <= 0:
        return []
    value, limit = float(q[0, joint]), float(wanted[joint])
    which = "first" if kind == "start" else "last"
    within = Amount(
        float(tolerance[joint]),
        0,
        joint,
        "length" if axes.joint_types[joint] == "prismatic" else "angle",
        "down",
    )
    return [
        Finding(
            rule="state",
            kind=kind,
            joint=axes.joint_names[joint],
            value=value,
            limit=limit,
            time=time,
            row=number,
            count=int((over > 0).sum()),
            quantity="position",
            certainty="exceeded" if over[joint] > slack[joint] else "within rounding",
            rounding=float(slack[joint]),
            message=f"the {which} row has {{joint}} at {{value}} {at_time(time)}, expected {{limit}} "
            "within {tolerance}",
            amounts={**excess_amounts(axes, joint, 0, value, limit), "tolerance": within},
        )
    ]


def _rate(
    row: EndState,
    wanted: Array,
    order: int,
    resolution: Resolution,
    axes: NamedJoints,
    end: tuple[str, FindingSeverity],
) -> list[Finding]:
    """Return where a row has another velocity, or acceleration, than is wanted, shape (n,)."""
    time, number, states = row
    rates = states[order]
    if rates is None or not np.isfinite(rates).all():
        return []
    said = np.isfinite(wanted)
    slack = stated_errors(rates, *resolution.roundings[order])[0] + _REST
    over = np.where(said, np.abs(rates[0] - wanted), 0.0)
    joint = int((over - slack).argmax())
    if over[joint] <= slack[joint]:
        return []
    value, limit = float(rates[0, joint]), float(wanted[joint])
    kind, severity = end
    which = "first" if kind == "start" else "last"
    what = QUANTITIES[order]
    return [
        Finding(
            rule="state",
            severity=severity,
            kind=kind,
            joint=axes.joint_names[joint],
            value=value,
            limit=limit,
            time=time,
            row=number,
            count=int((over > slack).sum()),
            quantity=what,
            rounding=float(slack[joint]),
            message=f"the {which} row has {'an' if order > 1 else 'a'} {what} of {{joint}} of {{value}} "
            f"{at_time(time)}, expected {{limit}}",
            amounts=excess_amounts(axes, joint, order, value, limit),
        )
    ]


def judge_order_of_stamps(
    t: Array, rows: NDArray[np.int64], before: float, moves: NDArray[np.int64], worst: Collector
) -> NDArray[np.bool_]:
    """Return which of some stamps are finite and later than all before them; add the others as findings.

    Args:
        t: As they are written, s, shape (N,).
        rows: Their numbers, shape (N,).
        before: The latest one before them; -inf for none.
        moves: Index of the move of each, -1 for none.
        worst: What is added to.
    """
    finite = np.isfinite(t)
    if t[0] > before and finite.all() and (t[1:] > t[:-1]).all():
        return finite
    latest = np.maximum.accumulate(np.append(before, np.where(finite, t, -np.inf)))[:-1]
    increasing = finite & (np.where(finite, t, -np.inf) > latest)
    wrong = np.flatnonzero(~increasing)

    def make(k: int) -> Finding:
        row = int(wrong[k])
        number, time, last = int(rows[row]), float(t[row]), float(latest[row])
        text = f"the time stamp of row {number} is {time!r}"
        if np.isfinite(time):
            how = "doubled" if time == last else "earlier than the one before"
            text = f"the time stamp of row {number}, {time_text(time)} s, is {how}: "
            text += f"the latest is {time_text(last)} s"
        value_and_limit = (time, last) if np.isfinite(time) else (None, None)
        return Finding(
            rule="time",
            kind="time",
            value=value_and_limit[0],
            limit=value_and_limit[1],
            time=value_and_limit[0],
            row=number,
            message=text,
            hint="time stamps must strictly increase",
        )

    nothing = np.full(wrong.size, -1)
    worst.add("time", int(moves[wrong[0]]), nothing, np.ones(wrong.size), make)
    return increasing
