"""Corners as others round them: Pilz's blend of two moves that stop, and justblend's of a polyline of joints.

Source: MoveIt 2, pilz_industrial_motion_planner, trajectory_blender_transition_window, whose rule is mixed in
joints here; justblend 0.1.0.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Move = Any  # a move as planned from rest to rest

_GRID = 2001  # times of a move or of a blend, at which it is looked at
_HALF = 0.5  # of a segment, the most that a blend of justblend takes


def pilz(moves: Sequence[Move], radii: Sequence[float]) -> float:
    """Return the duration of a chain by Pilz's rule, slowed evenly until all limits are kept, s.

    In the ball about a corner both moves run at once, the end of one and the start of the other, mixed by a
    quintic in time.

    Args:
        moves: From rest to rest.
        radii: Of the balls about their corners, m, one less.
    """
    left = [_time_at_border(move, radius, end=True) for move, radius in zip(moves, radii, strict=False)]
    joined = [_time_at_border(move, radius, end=False) for move, radius in zip(moves[1:], radii, strict=True)]
    starts, ends = [0.0, *joined], [*left, moves[-1].planned.curve.duration]
    if any(start > end for start, end in zip(starts, ends, strict=True)):
        return float("nan")  # balls overlap: there the rule has no answer
    total, slower = 0.0, 1.0
    for move, start, end in zip(moves, starts, ends, strict=True):
        total += end - start
        rates = move.planned.curve.evaluate_orders(np.linspace(start, end, _GRID), (1, 2, 3))
        slower = max(slower, _over(rates.transpose(1, 0, 2), [move]))
    for (before, behind), entered, gone in zip(pairwise(moves), left, joined, strict=True):
        first = before.planned.curve.duration - entered
        length = max(first, gone)
        total += length
        slower = max(slower, _over(_mixed(before, behind, entered, gone, length), [before, behind]))
    return total * slower


def _mixed(before: Move, behind: Move, entered: float, gone: float, length: float) -> Array:
    """Return the rates of three orders (3, m, n) of a blend."""
    tau = np.linspace(0.0, 1.0, _GRID)
    one = _rows(before, entered + tau * length)
    other = _rows(behind, tau * length + (gone - length))
    apart = other - one
    share = np.stack(
        [
            tau**3 * (10 - 15 * tau + 6 * tau**2),
            30 * tau**2 * (1 - tau) ** 2 / length,
            60 * tau * (1 - tau) * (1 - 2 * tau) / length**2,
            (60 - 360 * tau + 360 * tau**2) / length**3,
        ]
    )[:, :, None]
    return np.stack(
        [
            one[1] + share[1] * apart[0] + share[0] * apart[1],
            one[2] + share[2] * apart[0] + 2 * share[1] * apart[1] + share[0] * apart[2],
            one[3]
            + share[3] * apart[0]
            + 3 * share[2] * apart[1]
            + 3 * share[1] * apart[2]
            + share[0] * apart[3],
        ]
    )


def _rows(move: Move, times: Array) -> Array:
    """Return positions and rates of three orders (4, m, n); before and after a move it rests."""
    curve = move.planned.curve
    rows = (
        curve.evaluate_orders(np.clip(times, curve.start, curve.end), (0, 1, 2, 3)).transpose(1, 0, 2).copy()
    )
    rows[1:, (times < curve.start) | (times > curve.end)] = 0.0
    return np.asarray(rows)


def _over(rates: Array, moves: Sequence[Move]) -> float:
    """Return by what a motion must be slower to keep the higher limits of its moves."""
    slower = 1.0
    for order, values in enumerate(rates, start=1):
        limits = np.max([np.abs(move.robot.limits.of_order(order)).min(axis=1) for move in moves], axis=0)
        slower = max(slower, float((np.abs(values) / limits).max()) ** (1 / order))
    return slower


def _time_at_border(move: Move, radius: float, *, end: bool) -> float:
    """Return when the tool of a move enters the ball about its end, or leaves that about its start."""
    from trajcli.kinematics.forward import forward

    curve = move.planned.curve
    times = np.linspace(curve.start, curve.end, 10 * _GRID)
    path = forward(move.robot, curve.evaluate(times))[:, :3, 3]
    outside = np.flatnonzero(np.linalg.norm(path - path[-1 if end else 0], axis=1) > radius)
    if not outside.size:
        return float(times[0] if end else times[-1])
    return float(times[min(outside[-1] + 1, times.size - 1)] if end else times[outside[0]])


def justblend(moves: Sequence[Move], radii: Sequence[float]) -> float | None:
    """Return the duration of joint moves that justblend joins by blends within the balls, s.

    None where it is not installed, or where moves differ in their limits: it has one set for all.
    """
    try:
        import justblend as peer
    except ImportError:
        return None
    limits = [np.array([move.robot.limits.of_order(order)[:, 1] for order in (1, 2, 3)]) for move in moves]
    if any(not np.array_equal(each, limits[0]) for each in limits):
        return None
    corners = np.array([moves[0].start.position, *(move.planned.end.position for move in moves)])
    lengths = np.linalg.norm(np.diff(corners, axis=0), axis=1)
    options = peer.GenerationOptions()
    options.corner_handling = peer.CornerHandling.HYBRID
    shares = [
        min(_share(before, radius, end=True) * one, _share(behind, radius, end=False) * other)
        for (before, behind), (one, other), radius in zip(
            pairwise(moves), pairwise(lengths), radii, strict=True
        )
    ]
    options.blend_radii = np.array(shares)
    generator = peer.SCurveTrajectoryGenerator(corners.shape[1])
    generator.set_limits(peer.Limits(*limits[0]))
    generator.set_options(options)
    return float(generator.generate(corners).duration())


def _share(move: Move, radius: float, *, end: bool) -> float:
    """Return the part of a straight joint move inside the ball about one of its ends, at most half."""
    from trajcli.kinematics.forward import forward

    first, last = np.array(move.start.position), np.array(move.planned.end.position)
    s = np.linspace(0.0, 1.0, 10 * _GRID)
    shares = 1 - s if end else s
    path = forward(move.robot, first + s[:, None] * (last - first))[:, :3, 3]
    outside = np.linalg.norm(path - path[-1 if end else 0], axis=1) > radius
    return min(_HALF, float(shares[outside].min())) if outside.any() else _HALF
