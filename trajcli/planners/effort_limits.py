"""Limits of torque and force of a robot, in time-optimal motions along a path of its joints.

Between grid points these limits are sampled, and proven when the motion is known: what is left over them is
a matter of some 1e-5, by which the motion is stretched, or, where its ends have velocities, the limits
lowered.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import PlanningError
from trajcli.kinematics.robot import Robot

if TYPE_CHECKING:
    from trajcli.curves.time_optimal.constraints import PathConstraint
    from trajcli.curves.time_optimal.parameterization import TimeOptimalMotion
    from trajcli.dynamics.effort_constraint import EffortConstraint, HeldOverLimitError

_ROOM = 5e-7  # relative: half of what checks allow
_ROUNDS = 3  # of tangents at the speeds of the motion before: the last one changes next to nothing
_RESTS = 1e-9  # of the largest speed: less at an end is rounding
_TRIES = 4  # of lower limits between moving states
_LOWERED = 1.5  # times what is proven to be over them

_Solve = Callable[["tuple[PathConstraint, ...]"], "TimeOptimalMotion"]


def lacks_acceleration(robot: Robot) -> NDArray[np.bool_]:
    """Return which joints have neither limits of acceleration nor of effort, shape (n,)."""
    limits = robot.limits
    bounded = np.isfinite(limits.acceleration).all(axis=1) | np.isfinite(limits.effort).all(axis=1)
    return np.asarray(~bounded)


def effort_constraints(path: PiecewisePolynomial, robot: Robot) -> tuple[EffortConstraint, ...]:
    """Return the constraint by which efforts are limited along a path; none where no joint has such a limit.

    Args:
        path: q(s).
        robot: With the limits in force, and what its tool carries.

    Raises:
        InputError: When a link of the arm has no inertia, or the arm no geometry.
    """
    if not robot.limits.has_effort:
        return ()
    from trajcli.dynamics.effort_constraint import EffortConstraint
    from trajcli.dynamics.newton_euler import InverseDynamics

    limits = robot.limits
    return (EffortConstraint(InverseDynamics(robot), path, limits.effort, limits.velocity),)


def solved_within_efforts(path: PiecewisePolynomial, robot: Robot, solve: _Solve) -> TimeOptimalMotion:
    """Return the fastest motion along a path, within limits of effort that are proven for all t.

    Args:
        path: q(s).
        robot: With the limits in force, and what its tool carries.
        solve: Returns the fastest motion within what else limits it and the given constraints.

    Raises:
        PlanningError: When gravity and friction alone take a joint to its limit.
        InputError: When a link of the arm has no inertia, or the arm no geometry.
    """
    if not robot.limits.has_effort:
        return solve(())
    from trajcli.dynamics.effort_constraint import HeldOverLimitError

    limits, lowered = robot.limits.effort, 1.0
    for _ in range(_TRIES):
        (constraint,) = effort_constraints(path, robot)
        try:
            motion = _solved(replace(constraint, limits=limits * lowered), solve)
        except HeldOverLimitError as error:
            if lowered < 1.0:
                break  # by what gravity leaves of the limit itself the motion before is judged
            raise _held(error, path, robot) from None
        factor, over = _proven(motion.trajectory, robot)
        if factor == 1.0:
            return motion
        begins, ends = motion.law.piece_ends(1)
        if max(abs(float(begins[0, 0])), abs(float(ends[-1, 0]))) <= _RESTS * float(begins.max()):
            return _slower(motion, factor)
        lowered /= 1.0 + _LOWERED * over
    return motion


def effort_shares(trajectory: PiecewisePolynomial, robot: Robot) -> Array | None:
    """Return the shares of their upper and lower limits that efforts use, (pieces, 2 n); None without limits.

    They are means over both ends of each piece.

    Args:
        trajectory: q(t).
        robot: With the limits in force, and what its tool carries.
    """
    if not robot.limits.has_effort:
        return None
    from trajcli.dynamics.newton_euler import InverseDynamics

    states = [np.stack(trajectory.piece_ends(order)) for order in range(3)]
    mean = InverseDynamics(robot).effort(*states).mean(axis=0)
    low, high = robot.limits.effort.T
    return np.concatenate([mean / high, mean / low], axis=1)


def _solved(constraint: EffortConstraint, solve: _Solve) -> TimeOptimalMotion:
    """Return the fastest motion, with viscous friction by its tangents at the speeds of the motion."""
    motion = solve((constraint,))
    for _ in range(_ROUNDS - 1 if constraint.has_viscous else 0):
        points, speeds = motion.grid, motion.law.evaluate(motion.law.breaks, 1)[:, 0]

        def near(s: Array, points: Array = points, speeds: Array = speeds) -> Array:
            return np.interp(s, points, speeds)

        motion = solve((replace(constraint, speed=near),))
    return motion


def _proven(trajectory: PiecewisePolynomial, robot: Robot) -> tuple[float, float]:
    """Return by what factor a motion must last longer to keep its efforts, and how far it is over them."""
    from trajcli.dynamics.effort_bound import effort_survey, needed_stretch
    from trajcli.dynamics.newton_euler import InverseDynamics

    limits = robot.limits.effort
    survey = effort_survey(InverseDynamics(robot), trajectory.breaks, trajectory.coefficients, limits)
    factor, over = 1.0, 0.0
    for joint, sign, limit in survey.doubtful(limits, _ROOM):
        needed = needed_stretch(survey, joint, sign, limit, _ROOM).factor
        if needed > 1.0:
            factor, over = max(factor, needed), max(over, survey.peak(joint, sign).upper_bound / limit - 1.0)
    return factor, over


def _slower(motion: TimeOptimalMotion, factor: float) -> TimeOptimalMotion:
    """Return the motion stretched, where a stretch helps."""
    if not np.isfinite(factor):
        return motion  # the verdict says why
    return replace(
        motion,
        trajectory=scale_time(motion.trajectory, factor),
        law=scale_time(motion.law, factor),
        stretch=motion.stretch * factor,
        stop_times=motion.stop_times * factor,
    )


def _held(error: HeldOverLimitError, path: PiecewisePolynomial, robot: Robot) -> PlanningError:
    """Return the error that names joint and place, and says by how much gravity is over the limit."""
    from trajcli.limits.effort import gravity_problem

    rubs = robot.joints[error.joint].friction.coulomb > 0.0
    position = path.evaluate(error.s)
    return PlanningError(gravity_problem(robot, error.joint, error.effort, error.limit, position, rubs=rubs))
