"""The tool on its path: recomputed by forward kinematics on rows of the trajectory."""

from __future__ import annotations

import numpy as np

from trajcli.checks.finding import Finding, Kind, Method
from trajcli.checks.tolerances import JUMP_RELATIVE, TOOL_RELATIVE, exceeds
from trajcli.checks.tool_rows import SPEEDS, ToolRows
from trajcli.curves.extrema import peaks
from trajcli.kinematics.dexterity import characteristic_length
from trajcli.kinematics.inverse.target import residual_jacobian


def check_tool(rows: ToolRows) -> list[Finding]:
    """Return where the tool leaves its path or its limits, and where the arm changes its branch.

    Args:
        rows: Of one move.
    """
    return [*_check_path(rows), *_check_limits(rows), *_check_jerk(rows), *_check_branch(rows)]


def _check_path(rows: ToolRows) -> list[Finding]:
    """Return by how much the tool is beside its path, or turned, where that is more than was promised."""
    tolerance, found = rows.motion.tolerance, []
    kinds: tuple[tuple[Kind, float], ...] = (
        ("tool_path", tolerance.position),
        ("tool_orientation", tolerance.angle),
    )
    for (kind, limit), sizes in zip(kinds, rows.beside, strict=True):
        if exceeds(sizes.max(), limit):
            worst = int(sizes.argmax())
            time = float(rows.times[worst])
            found.append(_finding(rows, kind, float(sizes[worst]), limit, time, None))
    return found


def _check_limits(rows: ToolRows) -> list[Finding]:
    found = []
    for kind, name, order, part in SPEEDS:
        limit = float(getattr(rows.robot.limits.tcp, name))
        if np.isinf(limit):
            continue
        peak = rows.peaks[name]
        promised = rows.motion.tolerance.position if part.start == 0 else rows.motion.tolerance.angle
        if peak.most > limit * (1 + TOOL_RELATIVE + 2 * promised):
            factor = (peak.most / limit) ** (1 / order)
            found.append(_finding(rows, kind, peak.most, limit, peak.time, factor, "bounded"))
    return found


def _check_jerk(rows: ToolRows) -> list[Finding]:
    """Return where the law's jerk breaks its limit, or its acceleration steps although jerk is limited."""
    limit, law = rows.robot.limits.tcp.jerk, rows.motion.law
    if np.isinf(limit) or rows.motion.in_place:
        return []
    before, after = law.piece_ends(2)[1][:, 0], law.piece_ends(2)[0][:, 0]
    steps = np.abs(np.append(after, 0.0) - np.append(0.0, before))
    accelerations, jerks = peaks(law, (2, 3))
    hint = "use shape jerk_limited or quintic, or leave the limit of the tool's jerk out"
    if steps.max() > JUMP_RELATIVE * float(accelerations.magnitude[0]):
        return [
            Finding(
                rows.span.index,
                None,
                "tool_acceleration_jump",
                float(steps.max()),
                0.0,
                rows.span.start + float(law.breaks[int(steps.argmax())]),
                hint=hint,
            )
        ]
    value = float(jerks.magnitude[0])
    if value <= limit * (1 + TOOL_RELATIVE):
        return []
    time = float(jerks.high_time[0] if jerks.high[0] >= value else jerks.low_time[0])
    return [_finding(rows, "tool_jerk", value, limit, time, (value / limit) ** (1 / 3), "exact")]


def _check_branch(rows: ToolRows) -> list[Finding]:
    """Return where the arm passes from one branch to another: the determinant of its rows changes sign."""
    target = rows.target
    slopes = residual_jacobian(target, *rows.linearised)
    if slopes.shape[1] != slopes.shape[2] or target.orientation == "direction":
        return []  # without as many independent rows as joints there is no determinant
    slopes[:, : sum(target.position)] /= characteristic_length(rows.robot)
    signs = np.sign(np.linalg.det(slopes))
    changes = np.flatnonzero(signs[1:] * signs[:-1] < 0)
    if not changes.size:
        return []
    return [_finding(rows, "branch", 0.0, 0.0, float(rows.times[changes[0]]), None)]


def _finding(
    rows: ToolRows,
    kind: Kind,
    value: float,
    limit: float,
    time: float,
    factor: float | None,
    method: Method = "sampled",
) -> Finding:
    return Finding(rows.span.index, None, kind, value, limit, rows.span.start + time, method, factor)
