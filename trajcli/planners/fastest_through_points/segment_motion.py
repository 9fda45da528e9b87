"""Exact motions between given states at points, segment by segment, and how far they leave chords."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.extrema import peaks
from trajcli.curves.piecewise import Array, PiecewisePolynomial, concatenate
from trajcli.frozen import frozen
from trajcli.planners.fastest_through_points.problem import WaypointProblem
from trajcli.planners.planner import Phase
from trajcli.planners.ruckig import BoundaryProblem, PhaseProfile, fastest, together
from trajcli.planners.ruckig import joined as joined_profiles

_ROUNDINGS = 4  # of breaks, that may add up
_MOST = 1e-7  # relative: no acceleration is lowered by more


@frozen
class PointMotion:
    """A motion through points.

    Attributes:
        curve: q(t) from t = 0, of all joints of the problem.
        times: When each point is passed, shape (K + 1,).
        phases: Of each joint, in order of time; of all at once where they have one law.
    """

    curve: PiecewisePolynomial
    times: Array
    phases: tuple[Phase, ...]

    @property
    def duration(self) -> float:
        """Seconds."""
        return self.curve.duration

    def among(self, joints: NDArray[np.intp], position: Array) -> PointMotion:
        """Return the motion of all joints of a robot, most of which stand still.

        Args:
            joints: Which of them this motion moves.
            position: Where all of them stand at the start, shape (n,).
        """
        curve, count = self.curve, position.size
        if count == joints.size:
            return self
        coefficients = np.zeros((curve.degree + 1, curve.pieces, count))
        coefficients[-1] = position
        coefficients[:, :, joints] = curve.coefficients
        phases = [p if p.joint is None else replace(p, joint=int(joints[p.joint])) for p in self.phases]
        return PointMotion(PiecewisePolynomial(curve.breaks, coefficients), self.times, tuple(phases))


def joined(parts: Sequence[PointMotion]) -> PointMotion:
    """Return motions that follow each other as one; each begins where the one before ends."""
    times, phases, begins = [np.zeros(1)], [], 0.0
    for part in parts:
        times.append(begins + part.times[1:])
        phases += [Phase(p.name, begins + p.start, begins + p.end, p.joint, p.point) for p in part.phases]
        begins = float(times[-1][-1])
    curve = concatenate([part.curve for part in parts])
    stamps = np.concatenate(times)
    stamps[-1] = curve.end
    return PointMotion(curve, stamps, tuple(phases))


def exact_motion(
    problem: WaypointProblem, states: Array, names: Sequence[str], total: float = 0.0
) -> PointMotion:
    """Return the motion whose segments are fastest between states (K + 1, n, 2), each to its target exactly.

    Args:
        problem: Points and limits.
        states: Velocity and acceleration at the points.
        names: Of the joints, for messages.
        total: About how long all of it lasts, s.

    Raises:
        PlanningError: When a segment has no motion.
    """
    bounds = _bounds(problem, total)
    rows = np.concatenate([problem.points[..., None], states], axis=2).tolist()
    parts = []
    for k, least in enumerate(problem.least.tolist()):
        boundaries = [
            BoundaryProblem(name, tuple(first), tuple(last), bound)
            for name, first, last, bound in zip(names, rows[k], rows[k + 1], bounds, strict=True)
        ]
        profiles = together(boundaries, [fastest(boundary) for boundary in boundaries], least)
        parts.append(_segment(profiles))
    return joined(parts)


def _bounds(problem: WaypointProblem, total: float) -> Array:
    """Return the bounds (n, 3, 2); the acceleration leaves room for what rounding a late break may cost."""
    jerk = np.stack([-problem.jerk, problem.jerk], axis=1)
    share = _ROUNDINGS * np.spacing(total) * problem.jerk / np.abs(problem.acceleration).min(axis=1)
    acceleration = problem.acceleration * (1 - np.minimum(share, _MOST))[:, None]
    return np.stack([problem.velocity, acceleration, jerk], axis=1)


def _segment(profiles: Sequence[PhaseProfile]) -> PointMotion:
    curve = joined_profiles(profiles)
    phases = [phase for joint, profile in enumerate(profiles) for phase in profile.phases(joint)]
    phases.sort(key=lambda phase: (phase.start, phase.joint or 0))
    return PointMotion(curve, np.array([0.0, curve.duration]), tuple(phases))


def off_chords(motion: PointMotion, points: Array, velocity: Array) -> tuple[Array, Array]:
    """Return by how much each joint leaves the lines through neighbouring points, and when, each (n,).

    A position is compared with the point of the line that is nearest when each joint is measured by the time
    that it needs at its velocity limit.

    Args:
        motion: Of all joints.
        points: Shape (m, n).
        velocity: Bounds, shape (n, 2), perhaps infinite.
    """
    curve = motion.curve
    weight = 1 / np.abs(velocity).max(axis=1) ** 2
    middle = 0.5 * (curve.breaks[1:] + curve.breaks[:-1])
    segment = np.clip(np.searchsorted(motion.times, middle) - 1, 0, len(points) - 2)
    lines = np.array([after - before for before, after in pairwise(points)])
    squares = (lines * lines * weight).sum(axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        across = np.where(squares[:, None] > 0, lines * weight / squares[:, None], 0.0)
    coefficients = curve.coefficients.copy()
    coefficients[-1] -= points[segment]
    along = (coefficients * across[segment]).sum(axis=2)
    coefficients -= along[..., None] * lines[segment]
    (extremes,) = peaks(PiecewisePolynomial(curve.breaks, coefficients), (0,))
    high = extremes.high >= -extremes.low
    times = np.where(high, extremes.high_time, extremes.low_time)
    return extremes.magnitude, times - curve.start
