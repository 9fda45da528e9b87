"""Tolerance of a joint curve: the ratio of its error, of the joints and at the tool, to what is allowed."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from trajcli.curves.hermite_fit import RowIndices
from trajcli.curves.piecewise import Array
from trajcli.frozen import comparable, frozen
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.following.follower import Follower, JointState
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.joint_turns import revolute
from trajcli.kinematics.inverse.target import IkTarget, closure_of

_PROBES = 33  # values of s between breaks, all together, at which the peaks are looked for
_RACING = 1e-8  # of what the fastest joint does: near a singularity rounding leaves no less at the tool
_ASIDE = 0.1  # of the speed with which a point of the arm's length would go


@comparable
class Tolerance:
    """What a joint curve may be off.

    Attributes:
        position: m, of the tool and of prismatic joints; of their velocity and acceleration a part of the
            peak.
        angle: rad, of the tool and of revolute joints; likewise.
    """

    position: float = 1e-6
    angle: float = 1e-6


@frozen
class ToleranceRatio:
    """By how many times the tolerance joint values and their derivatives are off.

    Attributes:
        follower: Gives the exact values.
        tolerance: What is allowed.
        joint_peaks: Largest first and second derivative of any joint of the same kind, shape (2, n), as far
            as they are known; where joints race there may be larger ones.
        tool_peaks: Largest first and second derivative of the tool's position and orientation, shape (2, 2).
    """

    follower: Follower
    tolerance: Tolerance
    joint_peaks: Array
    tool_peaks: Array

    def __call__(self, state: JointState, rows: RowIndices, fitted: Array) -> Array:
        """Return the ratio (K,) of fitted values and derivatives (3, K, n) at some rows of exact ones."""
        exact, jacobians = state.values[:, rows], state.jacobians[rows]
        error = fitted - exact
        size = np.abs(error)
        ratio = np.maximum(
            (size[0] / self._joint).max(axis=1),
            (self._tool_deviations(state.target.rows(rows), fitted[0]) / self._tool).max(axis=1),
        )
        for order in (1, 2):
            peaks = np.maximum(self.joint_peaks[order - 1], _by_kind(exact[order], self._turning))
            ratio = np.maximum(ratio, (size[order] / (self._joint * peaks)).max(axis=1))
            moved = (jacobians @ error[order][..., None])[..., 0]
            racing = np.abs(exact[order]).max(axis=1, keepdims=True) * self._racing
            allowed = self._tool * self.tool_peaks[order - 1] + racing
            ratio = np.maximum(ratio, (_sizes(moved) / allowed).max(axis=1))
        return np.asarray(ratio)

    @cached_property
    def _turning(self) -> Flags:
        return revolute(self.follower.robot)

    @cached_property
    def _joint(self) -> Array:
        return np.where(self._turning, self.tolerance.angle, self.tolerance.position)

    @cached_property
    def _tool(self) -> Array:
        return np.array([self.tolerance.position, self.tolerance.angle])

    @cached_property
    def _racing(self) -> Array:
        return _RACING * np.array([self.follower.length, 1.0])

    def _tool_deviations(self, target: IkTarget, joints: Array) -> Array:
        """Return how far the tool is from its path, (K, 2), m and rad."""
        return closure_of(target, forward(self.follower.robot, joints))


def tolerance_ratio(follower: Follower, tolerance: Tolerance, breaks: Array, guess: Array) -> ToleranceRatio:
    """Return the tolerance ratio of an arm, its peaks looked for between breaks.

    Args:
        follower: Gives the exact values.
        tolerance: What is allowed.
        breaks: Shape (m,), increasing.
        guess: Joint values near the exact ones at `probes(breaks)`, shape (N, n).
    """
    state = follower.joint_state(probes(breaks), "right", guess)
    exact, turning = state.values, revolute(follower.robot)
    duration = float(breaks[-1] - breaks[0])
    joint_peaks = np.stack([_by_kind(exact[order], turning) for order in (1, 2)])
    rates = (state.jacobians @ exact[1][..., None])[..., 0]
    tool_peaks = np.array([_sizes(part).max(axis=0) for part in (rates, state.reference.second)])
    for row in tool_peaks:  # what the tool does not do is measured by what it does
        row[:] = (
            max(row[0], _ASIDE * row[1] * follower.length),
            max(row[1], _ASIDE * row[0] / follower.length),
        )
    return ToleranceRatio(
        follower, tolerance, _floored(joint_peaks, duration), _floored(tool_peaks, duration)
    )


def _sizes(twists: Array) -> Array:
    """Return the sizes (N, 2) of the linear and the angular part of rows (N, 6)."""
    return np.asarray(np.linalg.norm(twists.reshape(-1, 2, 3), axis=2))


def _by_kind(rates: Array, turning: Flags) -> Array:
    """Return the largest rate (N, n) of any joint that turns, and of any that slides, for each joint (n,)."""
    largest = np.abs(rates).max(axis=0)
    kinds = (largest * turning).max(), (largest * ~turning).max()
    return np.asarray(np.where(turning, *kinds))


def probes(breaks: Array) -> Array:
    """Return values of s between breaks, shape (N,)."""
    each = max(3, -(-_PROBES // (breaks.size - 1)))
    inner = (np.arange(each) + 0.5) / each
    return np.asarray((breaks[:-1, None] + np.diff(breaks)[:, None] * inner).reshape(-1))


def _floored(peaks: Array, duration: float) -> Array:
    """Return peaks (2, k) that are not so small that only rounding is left of them."""
    speed = np.maximum(peaks[0], max(float(peaks[0].max()) * 1e-3, 1e-6 / duration))
    return np.stack([speed, np.maximum(peaks[1], speed / duration)])
