"""Plans put together by hand: a curve, its moves with their limits, and nothing else that rows are judged by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.trajectory import Span, State, Trajectory
from trajcli.units import Units


def arm(*joints: Joint) -> Robot:
    """Return an arm without limits."""
    return Robot("arm", joints, unlimited(len(joints)), "standard", np.eye(4), np.eye(4))


def in_joint(n: int, joint: int, low: float, high: float) -> np.ndarray:
    """Return bounds (n, 2) of one joint."""
    rows = np.tile([-np.inf, np.inf], (n, 1))
    rows[joint] = low, high
    return rows


def made_plan(
    lengths: Sequence[float],
    coefficients: np.ndarray,
    moves: Sequence[tuple[int, Robot, Any]],
    *,
    start: float = 0.0,
    units: Units | None = None,
) -> Any:
    """Return a plan of a curve whose moves have so many pieces each, with a robot and the path of its tool.

    Args:
        lengths: Of the pieces, s.
        coefficients: Shape (degree + 1, pieces, n), highest power first.
        moves: Number of pieces, robot and path of each.
        start: Of the curve, s.
        units: Of the rows.
    """
    breaks = start + np.append(0.0, np.cumsum(lengths))
    curve = PiecewisePolynomial(breaks, coefficients)
    borders = np.cumsum([0, *(count for count, _, _ in moves)])
    spans = [
        Span(k, "made", float(breaks[a] - start), float(breaks[b] - start), 1)
        for k, (a, b) in enumerate(pairwise(borders.tolist()))
    ]
    joints = moves[0][1].joints
    still = State(*np.zeros((3, len(joints))))
    names, types = tuple(j.name for j in joints), tuple(j.type for j in joints)
    planned = [SimpleNamespace(tool=path, parts=(), curve=curve, braking=None) for _, _, path in moves]
    return SimpleNamespace(
        trajectory=Trajectory(curve, names, types, tuple(spans), still, still),
        moves=[
            SimpleNamespace(index=k, robot=robot, planned=one)
            for k, ((_, robot, _), one) in enumerate(zip(moves, planned, strict=True))
        ],
        verdict=_Verdict(lengths, coefficients, borders.tolist()),
        loaded=SimpleNamespace(robot=moves[0][1], output_units=units or Units()),
    )


@dataclass
class _Verdict:
    """What is asked of a verdict: the peaks of each move, made where they are asked for."""

    lengths: Sequence[float]
    coefficients: np.ndarray
    borders: Sequence[int]

    @cached_property
    def peaks(self) -> list[Any]:
        return [_peaks(self.lengths, self.coefficients, a, b) for a, b in pairwise(self.borders)]


def _peaks(lengths: Sequence[float], coefficients: np.ndarray, first: int, last: int) -> list[Any]:
    peaks, degree = [], len(coefficients) - 1
    t = np.linspace(0, 1, 2001)[:, None] * lengths[first:last]
    for order in range(4):
        factors = [np.prod(np.arange(k - order + 1.0, k + 1)) for k in range(degree, order - 1, -1)]
        derivative = coefficients[: max(degree + 1 - order, 0), first:last] * np.reshape(factors, (-1, 1, 1))
        values = np.zeros((2001, last - first, coefficients.shape[2]))
        for row in derivative:
            values = values * t[..., None] + row
        low, high = values.min(axis=(0, 1)), values.max(axis=(0, 1))
        peaks.append(SimpleNamespace(low=low, high=high, magnitude=np.maximum(high, -low)))
    return peaks
