"""Lower bound of the duration of a point-to-point move, from a solver that did not plan it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from trajcli.curves.extrema import piece_extremes
from trajcli.curves.operations import stacked
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import PlanningError
from trajcli.frozen import comparable
from trajcli.kinematics.robot import QUANTITIES, Limits
from trajcli.limits.tolerances import exceeds
from trajcli.peers.path_reference import LimitBreach, breaches_of
from trajcli.planners.ruckig import BoundaryProblem, fastest, inside
from trajcli.trajectory import State

_Alone = tuple[int, PiecewisePolynomial, Limits]  # a joint, its motion by itself, and its limits
_ORDERS = (0, 1, 2, 3)
_ROUNDING = 1e-12
_NOWHERE = 1e-9  # rad or m: a joint that comes back so near to where it was need not move
_NOTHING = 1e-9  # rad or m, and of the velocity limit: what rounding leaves of a joint that rests


@comparable
class LowerBound:
    """No motion between the two states within the limits is faster.

    Attributes:
        duration: Seconds.
        joint: Index of the joint that needs so long; None when no joint needs any time.
        breaches: Limits, those of the position among them, that the solver's own motions break, each joint
            moving by itself.
    """

    duration: float
    joint: int | None
    breaches: tuple[LimitBreach, ...] = ()


@comparable
class NoBound:
    """Nothing can be said about the fastest motion.

    Attributes:
        reason: Why, as a clause: "its velocity is unlimited".
        joint: Index of the joint that is the reason.
    """

    reason: str
    joint: int


def fastest_duration(start: State, end: State, limits: Limits) -> LowerBound | NoBound:
    """Return the time that the slowest joint needs if each moves by itself, under exactly the given limits.

    Without a jerk limit accelerations may step, and those at the ends do not count. Where the jerk limit
    differs by direction the looser one holds both ways, so that the bound stays a bound. Position limits are
    left out.

    Args:
        start: State at the start.
        end: State at the end.
        limits: Those that the motion was judged by.
    """
    bound = LowerBound(0.0, None)
    motions: list[_Alone] = []
    for joint in range(start.position.size):
        problem = _problem(start, end, limits, joint)
        if problem.done or _hardly_moves(problem):
            continue
        reason = _why_unbounded(problem)
        if reason:
            return NoBound(reason, joint)
        try:
            profile = fastest(problem)
        except PlanningError:
            return NoBound("no motion within its limits could be found", joint)
        if profile.braking:
            return NoBound("its start state leads out of its limits", joint)
        if profile.duration > bound.duration:
            bound = LowerBound(profile.duration, joint)
        own = Limits(limits.position[joint][None], *(problem.bounds[order][None] for order in range(3)))
        motions.append((joint, profile.curve(), own))
    return replace(bound, breaches=tuple(_breaches(motions)))


def duration_through(points: Array, start: State, end: State, limits: Limits) -> LowerBound:
    """Return a time that no motion through points falls short of; zero where nothing bounds it.

    It is the larger one of what a joint needs from turning point to turning point, and of the sum over the
    segments of what their slowest joint needs at its velocity limit.

    Args:
        points: Those that it passes, start and target among them, shape (m, n).
        start: State at the start.
        end: State at the end.
        limits: Those that the motion was judged by.
    """
    from trajcli.curves.turning_bound import MonotoneStretches, durations_by_joint, turning_points

    steps, velocity = np.diff(points, axis=0), limits.velocity
    at_speed = np.where(steps > 0, steps / velocity[:, 1], steps / velocity[:, 0]).max(axis=1)
    stretches = []
    for joint in range(points.shape[1]):
        turns = turning_points(points[:, joint])
        signs = np.sign(np.diff(turns)[[0, -1]]) if turns.size > 1 else np.zeros(2)
        speeds = np.maximum(np.array([start.velocity[joint], end.velocity[joint]]) * signs, 0.0)
        bounds = tuple(limits.of_order(order)[joint] for order in (1, 2, 3))
        stretches.append(MonotoneStretches.between(turns, bounds, speeds, np.ones(2, dtype=bool)))
    by_joint, together = durations_by_joint(stretches), float(at_speed.sum())
    worst = int(by_joint.argmax())
    return (
        LowerBound(together, None)
        if together > by_joint[worst]
        else LowerBound(float(by_joint[worst]), worst)
    )


def _breaches(motions: Sequence[_Alone]) -> Iterator[LimitBreach]:
    """Yield the limits that motions of single joints break, those of the position among them.

    All of them are looked at together, and closely only those that pass one.
    """
    if not motions:
        return
    curves = [curve for _, curve, _ in motions]
    owner = np.repeat(np.arange(len(curves)), [curve.pieces for curve in curves])
    polynomials = stacked([curve.coefficients for curve in curves])
    lengths, passed = np.concatenate([curve.lengths for curve in curves]), np.zeros(owner.size, dtype=bool)
    for order, (low, high) in enumerate(piece_extremes(polynomials, lengths, _ORDERS)):
        bounds = np.concatenate([limits.of_order(order) for *_, limits in motions])[owner]
        passed |= exceeds(high[:, 0], bounds[:, 1]) | exceeds(-low[:, 0], -bounds[:, 0])
    for index in np.unique(owner[passed]).tolist():
        joint, curve, limits = motions[index]
        for breach in breaches_of(curve, limits, _ORDERS):
            yield replace(breach, joint=joint)


def _problem(start: State, end: State, limits: Limits, joint: int) -> BoundaryProblem:
    bounds = np.stack([limits.of_order(order)[joint] for order in (1, 2, 3)])
    bounds[2] = np.abs(bounds[2]).max() * np.array([-1.0, 1.0])
    counts = float(np.isfinite(bounds[2, 1]))
    ends = []
    for state in (start, end):
        rates = float(state.velocity[joint]), counts * float(state.acceleration[joint])
        velocity, acceleration = (
            inside(rate, *limit) for rate, limit in zip(rates, bounds[:2].tolist(), strict=True)
        )
        ends.append((float(state.position[joint]), velocity, acceleration))
    if abs(ends[1][0] - ends[0][0]) <= _NOWHERE:
        ends[1] = (ends[0][0], *ends[1][1:])
    return BoundaryProblem(f"joint {joint + 1}", ends[0], ends[1], bounds)


def _hardly_moves(problem: BoundaryProblem) -> bool:
    """Return whether a joint only carries what others leave of rounding: nothing is bounded by that."""
    speed = float(np.abs(problem.bounds[0]).min())
    rates = max(abs(problem.initial[1]), abs(problem.final[1]))
    return max(rates, abs(problem.displacement)) <= _NOTHING * min(speed, 1.0)


def _why_unbounded(problem: BoundaryProblem) -> str | None:
    for order in (1, 2):
        low, high = problem.bounds[order - 1].tolist()
        if not np.isfinite([low, high]).all():
            return f"its {QUANTITIES[order]} is unlimited"
        for when, state in (("starts", problem.initial), ("ends", problem.final)):
            if not low * (1 + _ROUNDING) <= state[order] <= high * (1 + _ROUNDING):
                return f"it {when} outside its {QUANTITIES[order]} limit"
    return None
