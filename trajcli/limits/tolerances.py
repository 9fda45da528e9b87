"""Tolerances of the checks, each with its reason."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.curves.piecewise import Array
from trajcli.trajectory import Trajectory

# A planner that runs at a limit reaches it by way of a dozen roundings, each 1e-16 of the value and each
# magnified by what cancels; 1e-9 is a million times that, and a million times finer than any data sheet.
LIMIT_RELATIVE = 1e-9

# A bound of zero, or a joint that stands at its stop, leaves nothing to be relative to: a picometre, or a
# picoradian, is a thousandth of the last decimal that is written.
LIMIT_ABSOLUTE = 1e-12

# Two formulas for the same state agree up to rounding; a real jump is a planner's mistake and has the size of
# the motion. Relative to the joint's peak of the quantity that jumps, for the reason of LIMIT_RELATIVE.
JUMP_RELATIVE = 1e-9

# A joint that rests has a peak of zero, or of a rounding: positions of some radians or metres carry 1e-15.
JUMP_ABSOLUTE = 1e-12

# Breaks are float64. When a piece ends one unit in the last place of its break too late, the value there is
# off by that times the next derivative: a ramp of 1e-14 s at 1e15 rad/s^2 is steep, not discontinuous. Both
# ends of the piece are rounded, hence two units.
JUMP_BREAK_UNITS = 2.0

# The end of a long piece is a sum of terms that may be much larger than it: each is rounded.
SUM_UNITS = 8.0

# A span whose length was added up in another order than the curve's breaks ends some units beside one.
BORDER_UNITS = 4.0


# A curve through points is a sum of terms as large as the points and their distances; what it carries of
# their rounding is a few hundred units in the last place, even at the end of a long piece.
WAYPOINT_RELATIVE = 1e-12
WAYPOINT_ABSOLUTE = 1e-12

# Inverse kinematics misses a pose by at most 1e-9 m and rad; a row has nine decimals.
TARGET_CLOSURE = 1e-8

# On a path the joints follow from the tool: joint values of a target are met as well as the arm can tell the
# tool's tolerance, which near a singularity is several times as much at a joint.
TARGET_ON_PATH = 2e-5

# The tool's peaks are looked for between rows until what is proven of them is above by less than this.
TOOL_RELATIVE = 1e-6

# What is proven of the distance from a path is above it by at most 0.002 of what was promised.
PATH_RELATIVE = 3e-3

# What is proven of efforts between rows is off them by some 1e-7, and a planner's own proof by as much.
EFFORT_RELATIVE = 1e-6

# When a braking joint comes inside its limits is the root of a quadratic, of the rounding of its phases.
BRAKING_RELATIVE = 1e-9

# Knots stand in whole nanoseconds: half of one in a piece of 50 microseconds.
JOINED_RELATIVE = 1e-5


def exceeds(value: ArrayLike, bound: ArrayLike) -> NDArray[np.bool_]:
    """Return whether values are above an upper bound by more than rounding; for a lower bound negate both.

    Args:
        value: Any shape, SI. One that is not a number exceeds everything.
        bound: Broadcasts against `value`; infinite means unlimited.
    """
    limit = np.asarray(bound, dtype=np.float64)
    return np.logical_not(np.asarray(value) <= limit + LIMIT_RELATIVE * np.abs(limit) + LIMIT_ABSOLUTE)


def allowed_jump(peak: Array, breaks: Array, next_derivative: Array) -> Array:
    """Return the difference between the two sides of a break that rounding explains, shape (m, n).

    Args:
        peak: Shape (n,): the joint's largest absolute value of the quantity over the trajectory.
        breaks: Shape (m,), s.
        next_derivative: Shape (m, n): largest absolute value of the quantity's derivative at the break.
    """
    late = JUMP_BREAK_UNITS * np.spacing(np.abs(breaks))[:, None] * next_derivative
    return JUMP_ABSOLUTE + JUMP_RELATIVE * peak + late


def allowed_at_end(trajectory: Trajectory, times: Array, targets: Array) -> Array:
    """Return the distances from targets of moves in joint space that rounding explains, shape (m, n).

    Args:
        trajectory: The one whose moves end there.
        times: When, s on the trajectory, shape (m,).
        targets: Where, shape (m, n).
    """
    curve = trajectory.curve
    late = JUMP_BREAK_UNITS * np.spacing(np.abs(times))[:, None] * np.abs(trajectory.before(times, 1))
    piece = np.maximum(np.searchsorted(curve.breaks, curve.start + times) - 1, 0)
    powers = curve.lengths[piece] ** np.arange(curve.degree, -1, -1)[:, None]
    summands = (np.abs(curve.coefficients[:, piece]) * powers[:, :, None]).sum(axis=0)
    rounding = SUM_UNITS * np.spacing(summands)
    tolerance: Array = JUMP_ABSOLUTE + JUMP_RELATIVE * np.maximum(np.abs(targets), 1.0) + late + rounding
    return tolerance


def waypoint_tolerance(trajectory: Trajectory, times: Array, largest: Array) -> Array:
    """Return the distance from waypoints that rounding explains, shape (m, n).

    Args:
        trajectory: The one that passes them.
        times: When, s on the trajectory, shape (m,); rounded as breaks are.
        largest: Absolute value of each joint at any of them, shape (n,).
    """
    speed = np.abs(trajectory.curve.evaluate(times, 1))
    late = JUMP_BREAK_UNITS * np.spacing(np.abs(times))[:, None] * speed
    tolerance: Array = WAYPOINT_ABSOLUTE + WAYPOINT_RELATIVE * largest + late
    return tolerance
