"""A judge of trajectories that samples and zooms in; it shares no code with the checks."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.polynomial import polynomial

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.kinematics.robot import Limits
from trajcli.trajectory import Trajectory

KINDS = ("position", "velocity", "acceleration", "jerk")
CELLS, ROUNDS = 16, 14
SURE, DOUBT = 2e-9, 5e-10  # a limit is broken above one billionth; the judge is good for a tenth of that


def extremes(curve: PiecewisePolynomial, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the smallest and the largest value of a derivative by joint, each (n,), both sides of breaks."""
    low, high = piece_extremes(curve, order)
    return low.min(axis=0), high.max(axis=0)


def piece_extremes(curve: PiecewisePolynomial, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the smallest and the largest value on each piece, each (pieces, n).

    Each of many cells of a piece is zoomed into around its best sample, so that no peak is missed.
    """
    lengths = curve.lengths[:, None]
    scales = lengths[None] ** np.arange(curve.degree + 1)[:, None, None]
    ascending = polynomial.polyder(curve.coefficients[::-1] * scales, order, axis=0)  # over unit time
    found = []
    for sign in (-1.0, 1.0):
        edges = np.linspace(0, 1, CELLS + 1)[:, None, None] * np.ones(curve.coefficients.shape[1:])
        low, high, best = edges[:-1], edges[1:], None
        for _ in range(ROUNDS):
            x = low + (high - low) * np.linspace(0, 1, 5)[:, None, None, None]
            values = sign * sum(c * x**k for k, c in enumerate(ascending))
            k = values.argmax(axis=0)[None]
            best = np.take_along_axis(values, k, axis=0)[0].max(axis=0)
            low = np.take_along_axis(x, np.maximum(k - 1, 0), axis=0)[0]
            high = np.take_along_axis(x, np.minimum(k + 1, 4), axis=0)[0]
        found.append(sign * best / lengths**order)
    return found[0], found[1]


def broken_limits(
    trajectory: Trajectory, limits: Sequence[Limits]
) -> tuple[set[tuple[int, str, str]], set[tuple[int, str, str]]]:
    """Return (move, joint, kind) of limits that are broken, and of those that are met or broken narrowly."""
    sure, doubt = set(), set()
    middles = (trajectory.curve.breaks[1:] + trajectory.curve.breaks[:-1]) / 2
    for order, kind in enumerate(KINDS):
        low, high = piece_extremes(trajectory.curve, order)
        for span, bounds in zip(trajectory.spans, limits, strict=True):
            inside = (middles > span.start) & (middles < span.end)
            for joint, name in enumerate(trajectory.joint_names if inside.any() else ()):
                lower, upper = bounds.of_order(order)[joint]
                over = [high[inside, joint].max() - upper, lower - low[inside, joint].min()]
                for excess, bound in zip(over, (upper, lower), strict=True):
                    if excess > SURE * abs(bound) + 1e-11:
                        sure.add((span.index, name, kind))
                    elif excess > DOUBT * abs(bound) + 1e-13:
                        doubt.add((span.index, name, kind))
    return sure, doubt


def step_breakers(trajectory: Trajectory, limits: Sequence[Limits]) -> set[str]:
    """Return the joints whose acceleration steps although their jerk is limited, in all moves alike."""
    curve = trajectory.curve
    first = 2 * curve.coefficients[-3] if curve.degree > 1 else np.zeros(curve.coefficients.shape[1:])
    last = np.array(
        [
            [
                polynomial.polyval(length, polynomial.polyder(curve.coefficients[::-1, piece, joint], 2))
                for joint in range(curve.dimension)
            ]
            for piece, length in enumerate(curve.lengths)
        ]
    )
    before = np.concatenate([trajectory.start.acceleration[None], last])
    after = np.concatenate([first, trajectory.end.acceleration[None]])
    peak = np.abs(extremes(curve, 2)).max(axis=0)
    steps = (np.abs(after - before) > 1e-8 * peak + 1e-11).any(axis=0)
    limited = np.isfinite(limits[0].jerk).any(axis=1)
    return {
        name
        for name, step, bound in zip(trajectory.joint_names, steps, limited, strict=True)
        if step and bound
    }
