"""Fastest laws along paths of joints, with and without limits of jerk, and what is said of them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.third_order.curved_paths import with_end_curvature
from trajcli.curves.third_order.jerk import ThirdOrderConstraint
from trajcli.curves.third_order.parameterization import jerk_limited_time_optimal
from trajcli.curves.third_order.quartic_law import ReversingLawError
from trajcli.curves.time_optimal.constraints import PathConstraint
from trajcli.curves.time_optimal.parameterization import TimeOptimalMotion, UnsettledSpeedError, time_optimal
from trajcli.curves.time_optimal.passes import UnreachableSpeedError
from trajcli.errors import Amount, PlanningError, of_joint
from trajcli.kinematics.robot import Robot
from trajcli.limits.kinds import path_constraints
from trajcli.planners.effort_limits import solved_within_efforts
from trajcli.planners.law_events import distance_from_bound, how_found
from trajcli.planners.planner import LITTLE, Event, stretched
from trajcli.planners.waypoints.joint_path import JointPath
from trajcli.planners.waypoints.spline_rules import Rule

_MOST_STOPS = 10  # that an event lists
_OFF = 1e-9  # relative: an acceleration this little off the path is along it
BENT_RULES: tuple[Rule, ...] = ("computed", "shape_preserving")
"""Rules of splines whose curvature jumps."""


def require_continuous_curvature(rule: Rule | None) -> None:
    """Refuse a spline whose curvature jumps.

    Raises:
        PlanningError: Names the rules that fit.
    """
    if rule in BENT_RULES:
        message = f"the curvature of a spline with rule {rule} jumps, which no limit of jerk allows"
        hint = "use rule not_a_knot, natural, clamped or quintic, or `jerk: ignore`"
        raise PlanningError(message, hint=hint)


def solve_within_jerk(
    path: JointPath, acceleration: Array, robot: Robot, *, bends: bool, of_tool: bool
) -> tuple[JointPath, TimeOptimalMotion]:
    """Return the path, bent at ends in motion where it may be, and the fastest law that is found along it.

    Args:
        path: Through the points.
        acceleration: In which it starts, shape (n,).
        robot: Its limits.
        bends: Whether the path may be bent so that the acceleration lies along it.
        of_tool: Whether limits of the tool are kept as well.

    Raises:
        PlanningError: When the acceleration does not lie along the path, or the limits leave no room.
    """
    tangent = path.curve.evaluate(path.curve.start, 1)
    length = float(tangent @ tangent)
    along = float(acceleration @ tangent) / length if path.speeds[0] and length else 0.0
    across = acceleration - along * tangent
    if bends and any(path.speeds):
        start = across / path.speeds[0] ** 2 if path.speeds[0] else None
        end = np.zeros_like(across) if path.speeds[1] else None
        path = replace(path, curve=with_end_curvature(path.curve, start, end))
    if not (bends and path.speeds[0]):
        _require_along(across, acceleration, robot)
    limits = robot.limits
    curve, speeds = path.curve, path.speeds
    further, of_jerk = _further(curve, robot, of_tool=of_tool)

    def solve(efforts: tuple[PathConstraint, ...]) -> TimeOptimalMotion:
        return jerk_limited_time_optimal(
            curve,
            limits.velocity,
            limits.acceleration,
            limits.jerk,
            start=(speeds[0], along),
            end=(speeds[1], 0.0),
            further=(*further, *efforts),
            further_jerk=of_jerk,
        )

    with _ends_refused():
        return path, solved_within_efforts(curve, robot, solve)


@contextmanager
def _ends_refused() -> Iterator[None]:
    """Say by how much velocities at the ends are too high."""
    try:
        yield
    except UnreachableSpeedError as error:
        share = error.allowed / error.speed
        message = f"time_optimal cannot have so high a velocity at its ends: at most {share:.6g} of it"
        raise PlanningError(message, hint="lower it, or let the move before end at rest") from None
    except ReversingLawError:
        message = "time_optimal finds no motion that starts with such velocities and accelerations"
        raise PlanningError(message, hint="lower them, or say `jerk: ignore`") from None
    except UnsettledSpeedError as error:
        message = f"with these velocities at its ends time_optimal passes a limit by {error.over:.9g} times"
        raise PlanningError(message, hint="lower them a little") from None


def _further(
    curve: PiecewisePolynomial, robot: Robot, *, of_tool: bool
) -> tuple[tuple[PathConstraint, ...], tuple[ThirdOrderConstraint, ...]]:
    """Return what limits laws along a path besides the rates of joints, and what limits their jerk."""
    if not of_tool:
        return path_constraints(curve, robot), ()
    from trajcli.planners.course import JointCourse

    course = JointCourse(curve, robot)
    return course.constraints(curve), course.jerk_constraints


def solve_second_order(path: JointPath, robot: Robot, *, of_tool: bool) -> TimeOptimalMotion:
    """Return the fastest law without limits of jerk.

    Args:
        path: Through the points.
        robot: Its limits.
        of_tool: Whether limits of the tool are kept as well.

    Raises:
        PlanningError: When the velocities at the ends are too high.
    """
    limits = robot.limits
    further, _ = _further(path.curve, robot, of_tool=of_tool)

    def solve(efforts: tuple[PathConstraint, ...]) -> TimeOptimalMotion:
        return time_optimal(
            path.curve,
            limits.velocity,
            limits.acceleration,
            start_velocity=path.speeds[0],
            end_velocity=path.speeds[1],
            further=(*further, *efforts),
        )

    with _ends_refused():
        return solved_within_efforts(path.curve, robot, solve)


def _require_along(across: Array, acceleration: Array, robot: Robot) -> None:
    off = np.abs(across)
    if off.max() <= _OFF * np.abs(acceleration).max():
        return
    joint = int(off.argmax())
    name, value = robot.joint_names[joint], float(acceleration[joint])
    amounts = {"acceleration": Amount(value, 2, joint)}
    message = "time_optimal starts along its path, but {acceleration} of {joint} leaves it"
    hint = "let the move before end at rest or without acceleration, or say `jerk: ignore`"
    raise PlanningError(of_joint(name, message, hint, amounts, value=value))


def events_of_law(motion: TimeOptimalMotion, robot: Robot, factor: float) -> Iterator[Event]:
    """Yield how good a law is, how it was found, and where it stops.

    Args:
        motion: With the law.
        robot: For the names of joints.
        factor: By which it is slowed down.
    """
    yield from how_found(motion)
    if factor == 1.0:
        yield distance_from_bound(motion, robot)
    if motion.stretch > 1 + LITTLE:
        yield stretched(motion.stretch)
    if motion.stops.size:
        times = ", ".join(f"{time:.6g}" for time in (factor * motion.stop_times[:_MOST_STOPS]).tolist())
        more = ", ..." if motion.stops.size > _MOST_STOPS else ""
        count = motion.stops.size
        text = f"stops at {count} corner{'s' * (count != 1)}, at t = {times}{more} s of the move"
        yield Event("stops", f"{text}: give `corner` to round them")
