"""Rows as their consumer joins them, by scipy's Hermite curves: the largest share of a limit of a joint."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import BPoly

from trajcli.grids import Grid
from trajcli.planning.plan import Plan
from trajcli.samples import sample

SAMPLES = 41  # of an interval


def control_points(rows: np.ndarray, lengths: np.ndarray) -> np.ndarray:
    """Return Bernstein coefficients (k, intervals, n) of what shares the derivatives (N, orders, n) of rows.

    Source: Farouki (2012), section 5, what `BPoly.from_derivatives` solves interval by interval.
    """
    orders = rows.shape[1]
    degree, h = 2 * orders - 1, lengths[:, None]
    ends = []
    for values, step in ((rows[:-1], h), (rows[1:], -h)):
        points = [values[:, 0]]
        if orders > 1:
            points.append(values[:, 0] + step / degree * values[:, 1])
        if orders > 2:
            change = 2 * step / degree * values[:, 1] + step**2 / (degree * (degree - 1)) * values[:, 2]
            points.append(values[:, 0] + change)
        ends.append(points)
    return np.stack([*ends[0], *ends[1][::-1]])


def largest_share(plan: Plan, grid: Grid, shortest: float) -> float:
    """Return the largest share of a limit that Hermite curves through all rows use, by dense samples.

    Args:
        plan: With the columns of the rows.
        grid: Where they stand.
        shortest: Intervals that are looked at, s: in shorter ones the last bits are a jerk of their own.
    """
    groups = tuple(group for group in ("q", "qd", "qdd") if group in plan.loaded.job.output.columns)
    joints = len(plan.trajectory.joint_names)
    rows = np.concatenate([*sample(plan.trajectory, grid, groups)]).reshape(grid.count, len(groups), joints)
    t = np.concatenate([local for _, local in grid.blocks()])
    lengths = np.diff(t)
    curve, worst = BPoly(control_points(rows, lengths), t), 0.0
    times = t[:-1, None] + lengths[:, None] * np.linspace(1e-9, 1 - 1e-9, SAMPLES)
    times = times[lengths > shortest].ravel()
    owner = np.searchsorted([span.start for span in plan.trajectory.spans], times, "right") - 1
    for order in range(1, len(groups) + 1):
        values = curve.derivative(order)(times)
        bounds = np.stack([move.robot.limits.of_order(order) for move in plan.moves])[owner]
        worst = max(worst, float(np.maximum(values / bounds[..., 0], values / bounds[..., 1]).max()))
    return worst
