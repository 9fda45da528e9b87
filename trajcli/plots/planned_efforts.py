"""Inverse dynamics along a plan: efforts of the joints on both sides of each of their steps."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial, derivative_coefficients, horner
from trajcli.frozen import frozen
from trajcli.kinematics.robot import Robot
from trajcli.planning.plan import Plan
from trajcli.plots.sampling import STEPS, local_times


@frozen
class EffortSamples:
    """Efforts along a plan.

    Attributes:
        times: On the curve of the trajectory, shape (N,), s; a step stands there as two rows of one time.
        values: Shape (N, n), N m or N.
    """

    times: Array
    values: Array


def effort_samples(plan: Plan) -> EffortSamples:
    """Return the efforts of all moves with what each of them carries, and where the checks saw peaks.

    They step where the acceleration does, where a payload is attached or detached, and where a joint with
    Coulomb friction turns back: at rest friction has the sign of the motion beside.

    Raises:
        InputError: When the robot has no geometry, or a link no inertia.
    """
    curve, parts = plan.trajectory.curve, []
    middles = curve.breaks[:-1] + curve.lengths / 2 - curve.start
    for index, (move, span) in enumerate(zip(plan.moves, plan.trajectory.spans, strict=True)):
        first, last = np.searchsorted(middles, [span.start, span.end])
        long = np.flatnonzero(curve.lengths[first:last] > 0) + first
        if long.size:
            pieces = curve.breaks[long], curve.lengths[long], curve.coefficients[:, long]
            longest = curve.duration / STEPS
            parts.append(_efforts(move.robot, pieces, longest, np.array(list(_peaks(plan, index)))))
    nothing = np.empty(0), np.empty((0, curve.dimension))
    times, values = zip(nothing, *parts, strict=True)
    return EffortSamples(np.concatenate(times), np.concatenate(values))


def _peaks(plan: Plan, index: int) -> Iterator[float]:
    """Yield when the checks saw the largest efforts of a move, on the curve."""
    efforts = plan.verdict.efforts[index] if index < len(plan.verdict.efforts) else None
    if efforts is not None:
        yield from (peak.time for peak in (*efforts.highest, *efforts.lowest))


def _efforts(
    robot: Robot, pieces: tuple[Array, Array, Array], longest: float, peaks: Array
) -> tuple[Array, Array]:
    """Return times (N,) and efforts (N, n) of a move, by starts, lengths and coefficients of its pieces."""
    from trajcli.dynamics.effort_bound import cut_where_joints_turn
    from trajcli.dynamics.newton_euler import InverseDynamics, direction

    dynamics = InverseDynamics(robot)
    starts, lengths, coefficients = cut_where_joints_turn(dynamics, *pieces)
    curve = PiecewisePolynomial(np.append(starts, starts[-1] + lengths[-1]), coefficients)
    piece, local = local_times(curve, max(math.ceil(curve.duration / longest), 1))
    owner = np.clip(np.searchsorted(starts, peaks, "right") - 1, 0, curve.pieces - 1)
    inside = np.clip(peaks - starts[owner], 0.0, curve.lengths[owner])
    piece, local = np.append(piece, owner), np.append(local, inside)
    ordered = np.lexsort((local, piece))
    piece, local = piece[ordered], local[ordered]
    speeds = derivative_coefficients(coefficients, 1)
    q, qd, qdd = (
        horner(derivative_coefficients(coefficients, order)[:, piece], local[:, None]) for order in range(3)
    )
    viscous = np.array([joint.friction.viscous for joint in robot.joints])
    coulomb = np.array([joint.friction.coulomb for joint in robot.joints])
    signs = direction(horner(speeds, curve.lengths[:, None] / 2))
    known = np.isfinite(np.concatenate([q, qd, qdd], axis=1)).all(axis=1)
    values = np.full(q.shape, np.nan)
    values[known] = dynamics.rigid_effort(q[known], qd[known], qdd[known])
    values += viscous * qd + coulomb * signs[piece]
    return np.minimum(curve.breaks[piece] + local, curve.breaks[piece + 1]), values
