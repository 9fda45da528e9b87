"""Lower bounds of the duration along a path, from the work that limits of acceleration allow.

Between two places a joint that does not turn gains at most 2 c |q1 - q0| of the square of its velocity,
whatever the motion, and loses as little: so no motion is faster at a grid point than the two passes over
these rows alone, with the caps there. With its velocities at both ends of an interval so bounded each joint
needs a time of its own, up to a peak and down again; the longest is a bound. It holds on any grid.

Source: Bobrow, Dubowsky and Gibson (1985), for the two passes; the bound on any grid is our own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from trajcli.curves.extrema import critical_points
from trajcli.curves.piecewise import Array, PiecewisePolynomial, distinct
from trajcli.curves.time_optimal.collocation import interval_rows
from trajcli.curves.time_optimal.constraints import JointConstraint, PathConstraint
from trajcli.curves.time_optimal.passes import UnlimitedSpeedError, UnreachableSpeedError, solve

_ROUNDING = 1e-8  # relative: taken off, so that a bound stays one
_DIFFERENCE = 1e-15  # of positions: what their difference may be off
_CLOSE = 1e-12  # of the path: points that are nearer are one


def lower_bound(
    joints: JointConstraint,
    caps: Sequence[PathConstraint],
    along: tuple[float, float],
    points: tuple[Array, Array],
    ends: tuple[float, float],
) -> float:
    """Return a duration, s, that no motion within the limits falls below; 0 where nothing is known.

    Args:
        joints: The path and the limits of the joints.
        caps: What else bounds sd at single places, by `largest`, and times between them, by `shortest`.
        along: Limits of sd and of the size of sdd.
        points: Grid points, the denser the better, and where the motion must stop, each of shape (k,).
        ends: sd at the start and at the end; infinite for any.
    """
    grid, stops = points
    joints = _with_parameter(joints, along)
    grid = _with_turns(joints.path, grid)
    rows = interval_rows(grid, [joints], stops)
    if rows.C.shape[0] != rows.near[0].shape[0]:
        return 0.0  # rows of our own making, where nothing bounds the speed
    cap = rows.cap.copy()
    for each in caps:
        cap[:-1] = np.minimum(cap[:-1], each.largest(grid[:-1], "right"))
        cap[1:] = np.minimum(cap[1:], each.largest(grid[1:], "left"))
    rows = replace(rows, cap=cap)
    needed = np.max([each.shortest(grid) for each in caps] or [np.zeros(grid.size - 1)], axis=0)
    if not np.isfinite(joints.acceleration).any():
        return _sum(_shortest(joints, grid, cap), needed)
    try:
        x = solve(rows, *ends).x
    except (UnlimitedSpeedError, UnreachableSpeedError):
        return 0.0
    return _sum(_shortest(joints, grid, x), needed)


def _sum(of_joints: Array, needed: Array) -> float:
    """Return a duration below which no motion falls, by what joints and what else need in each interval."""
    return float(np.maximum(of_joints, needed).sum() * (1.0 - _ROUNDING))


def _with_parameter(joints: JointConstraint, along: tuple[float, float]) -> JointConstraint:
    """Return the joints and s itself as one more."""
    path = joints.path
    own = np.zeros((path.degree + 1, path.pieces, 1))
    own[-2, :, 0], own[-1, :, 0] = 1.0, path.breaks[:-1]
    curve = PiecewisePolynomial(path.breaks, np.concatenate([path.coefficients, own], axis=2))
    bounds = (
        np.concatenate([each, [[-limit, limit]]])
        for each, limit in zip((joints.velocity, joints.acceleration), along, strict=True)
    )
    return JointConstraint(curve, *bounds)


def _with_turns(path: PiecewisePolynomial, grid: Array) -> Array:
    (turns,) = critical_points(path.coefficients, path.lengths, (0,))
    finer = distinct(np.concatenate([grid, (path.breaks[:-1, None] + turns).reshape(-1)]))
    apart = np.diff(finer) > _CLOSE * path.duration
    return np.append(finer[:-1][apart], finer[-1])


def _shortest(joints: JointConstraint, grid: Array, x: Array) -> Array:
    """Return the shortest time of each interval (N,), with sd^2 at most x (N + 1,) at its ends."""
    path = joints.path
    first, last = path.evaluate(grid[:-1]), path.evaluate(grid[1:], side="left")
    up, size = last > first, np.maximum(np.abs(first), np.abs(last))
    D = np.maximum(np.abs(last - first) - _DIFFERENCE * size, 0.0)
    gain, loss = (
        np.abs(np.where(up == rising, joints.acceleration[:, 1], joints.acceleration[:, 0]))
        for rising in (True, False)
    )
    fastest = np.where(up, joints.velocity[:, 1], -joints.velocity[:, 0])
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        begin = np.abs(path.evaluate(grid[:-1], 1)) * np.sqrt(x[:-1, None])
        end = np.abs(path.evaluate(grid[1:], 1, side="left")) * np.sqrt(x[1:, None])
        peak = np.sqrt((2.0 * gain * loss * D + loss * begin**2 + gain * end**2) / (gain + loss))
        peak = np.minimum(np.maximum.reduce([peak, begin, end]), fastest)
        begin, end = np.minimum(begin, peak), np.minimum(end, peak)
        cruise = D - (peak**2 - begin**2) / (2.0 * gain) - (peak**2 - end**2) / (2.0 * loss)
        times = (peak - begin) / gain + (peak - end) / loss + np.maximum(cruise, 0.0) / peak
        least = np.where(np.isfinite(times) & (D > 0), times, np.where(D > 0, D / fastest, 0.0))
    return np.asarray(least.max(axis=1))
