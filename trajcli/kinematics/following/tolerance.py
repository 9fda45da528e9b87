"""How near the joints' curve must come to what the tool is told to do."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array, Side
from trajcli.kinematics.dexterity import characteristic_length
from trajcli.kinematics.following.follower import Follower
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.target import residuals
from trajcli.kinematics.inverse.turns import revolute
from trajcli.kinematics.jacobian import jacobian

_PROBES = 33  # places between neighbouring breaks, all together, at which the peaks are looked for
_RACING = 1e-8  # of what the fastest joint does: near a singularity rounding leaves no less at the tool
_ASIDE = 0.1  # of the speed with which a point of the arm's length would go


@dataclass(frozen=True)
class Tolerance:
    """What a joint curve may be off.

    Attributes:
        position: m, of the tool and of prismatic joints; of their velocity and acceleration a part of the
            peak.
        angle: rad, of the tool and of revolute joints; likewise.
    """

    position: float = 1e-6
    angle: float = 1e-6


@dataclass(frozen=True, eq=False)
class Misfit:
    """By how many times the tolerance joint values and their derivatives are off.

    Attributes:
        follower: Knows what is exact.
        tolerance: What is allowed.
        joint_peaks: Largest first and second derivative of any joint of the same kind, shape (2, n), as far
            as they are known; where joints race there may be larger ones.
        tool_peaks: Largest first and second derivative of the tool's place and orientation, shape (2, 2).
    """

    follower: Follower
    tolerance: Tolerance
    joint_peaks: Array
    tool_peaks: Array

    def __call__(self, places: Array, exact: Array, fitted: Array) -> Array:
        """Return the misfit (N,) of fitted (3, N, n) from exact (3, N, n) values at places (N,)."""
        off = np.abs(fitted - exact)
        turning = revolute(self.follower.robot)
        joint = np.where(turning, self.tolerance.angle, self.tolerance.position)
        worst = (off[0] / joint).max(axis=1)
        rows = jacobian(self.follower.robot, exact[0])
        tool = np.array([self.tolerance.position, self.tolerance.angle])
        scale = characteristic_length(self.follower.robot)
        worst = np.maximum(worst, (self._beside(places, fitted[0]) / tool).max(axis=1))
        for order in (1, 2):
            peaks = np.maximum(self.joint_peaks[order - 1], _by_kind(exact[order], turning))
            worst = np.maximum(worst, (off[order] / (joint * peaks)).max(axis=1))
            moved = (rows @ (fitted - exact)[order][..., None])[..., 0]
            sizes = np.linalg.norm(moved.reshape(-1, 2, 3), axis=2)
            racing = np.abs(exact[order]).max(axis=1, keepdims=True) * [_RACING * scale, _RACING]
            worst = np.maximum(worst, (sizes / (tool * self.tool_peaks[order - 1] + racing)).max(axis=1))
        return np.asarray(worst)

    def _beside(self, places: Array, joints: Array) -> Array:
        """Return how far the tool is from its path, (N, 2), m and rad."""
        demand = self.follower.demands(places, "right")
        off = residuals(demand.target(), forward(self.follower.robot, joints))
        split = sum(demand.position)
        sizes = [np.linalg.norm(off[:, :split], axis=1), np.linalg.norm(off[:, split:], axis=1)]
        return np.stack(sizes, axis=1)


def misfit_of(follower: Follower, tolerance: Tolerance, breaks: Array, guess: Array) -> Misfit:
    """Return the misfit, its peaks looked for between breaks.

    Args:
        follower: Knows what is exact.
        tolerance: What is allowed.
        breaks: Shape (m,), increasing.
        guess: Joint values near the exact ones at the places `probes(breaks)`, shape (N, n).
    """
    places = probes(breaks)
    side: Side = "right"
    exact = follower.exact(places, side, guess)
    turning = revolute(follower.robot)
    duration = float(breaks[-1] - breaks[0])
    joint_peaks = np.stack([_by_kind(exact[order], turning) for order in (1, 2)])
    demand = follower.demands(places, side)
    rows = jacobian(follower.robot, exact[0])
    rates = (rows @ exact[1][..., None])[..., 0].reshape(-1, 2, 3)
    seconds = demand.second.reshape(-1, 2, 3)
    tool_peaks = np.array([np.linalg.norm(part, axis=2).max(axis=0) for part in (rates, seconds)])
    scale = characteristic_length(follower.robot)
    for row in tool_peaks:  # what the tool does not do is measured by what it does
        row[:] = max(row[0], _ASIDE * row[1] * scale), max(row[1], _ASIDE * row[0] / scale)
    return Misfit(follower, tolerance, _floored(joint_peaks, duration), _floored(tool_peaks, duration))


def _by_kind(rates: Array, turning: NDArray[np.bool_]) -> Array:
    """Return the largest rate (N, n) of any joint that turns, and of any that slides, for each joint (n,)."""
    largest = np.abs(rates).max(axis=0)
    kinds = (largest * turning).max(), (largest * ~turning).max()
    return np.asarray(np.where(turning, *kinds))


def probes(breaks: Array) -> Array:
    """Return places between breaks, shape (N,)."""
    each = max(3, -(-_PROBES // (breaks.size - 1)))
    inner = (np.arange(each) + 0.5) / each
    return np.asarray((breaks[:-1, None] + np.diff(breaks)[:, None] * inner).reshape(-1))


def _floored(peaks: Array, duration: float) -> Array:
    """Return peaks (2, k) that are not so small that only rounding is left of them."""
    speed = np.maximum(peaks[0], max(float(peaks[0].max()) * 1e-3, 1e-6 / duration))
    return np.stack([speed, np.maximum(peaks[1], speed / duration)])
