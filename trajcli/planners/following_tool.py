"""From the motion of the tool to the joints' curve."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from trajcli.curves.hermite_fit import FitError, fit
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.frozen import frozen
from trajcli.kinematics.following.follower import Follower, LostError, follower
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.following.tolerance import Tolerance, probes, tolerance_ratio
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.following.tracking import StuckError, track_branch
from trajcli.kinematics.robot import Robot
from trajcli.planners.planner import Event, Phase
from trajcli.planners.tool_trouble import Trouble


@frozen
class Made:
    """A motion of tool and joints.

    Attributes:
        curve: q(t).
        motion: What the tool was told.
        phases: Named stretches of time.
        events: What was conceded.
    """

    curve: PiecewisePolynomial
    motion: ToolMotion
    phases: tuple[Phase, ...] = ()
    events: tuple[Event, ...] = ()


@frozen
class Followed:
    """Joints along a path, as a function of its parameter.

    Attributes:
        robot: The arm.
        path: Of the tool.
        follower: Gives the exact joints at a place.
        coarse: Joints near the exact ones, a curve over s.
    """

    robot: Robot
    path: ToolPath
    follower: Follower
    coarse: PiecewisePolynomial

    def by_place(self, tolerance: Tolerance) -> PiecewisePolynomial:
        """Return q(s) within a tolerance.

        Raises:
            PlanningError: When no 4096 pieces are enough: names the singularity.
        """
        trouble = trouble_on(self.robot, self.path, self.follower)
        return _fitted(self.follower, self.path.breaks, self.coarse.evaluate, tolerance, trouble)

    def by_time(self, motion: ToolMotion) -> PiecewisePolynomial:
        """Return q(t) within the motion's tolerance.

        Raises:
            PlanningError: As `by_place`.
        """
        timed = replace(self.follower, demands=motion.timed)

        def guess(times: Array) -> Array:
            places = motion.law.evaluate(times)[:, 0]
            return self.coarse.evaluate(places.clip(self.coarse.start, self.coarse.end))

        return _fitted(timed, motion.breaks, guess, motion.tolerance, trouble_of(self.robot, motion, timed))


def trouble_on(robot: Robot, path: ToolPath, exact: Follower) -> Trouble:
    """Return who explains what goes wrong along a path."""
    return Trouble(robot, path.by_place, path.length, None, path.poses.in_place, len(exact.held))


def trouble_of(robot: Robot, motion: ToolMotion, exact: Follower | None = None) -> Trouble:
    """Return who explains what goes wrong on a motion."""
    free = 0 if exact is None else len(exact.held)
    return Trouble(robot, motion.timed, motion.law.end, motion.law, motion.in_place, free)


def followed(robot: Robot, path: ToolPath, start: Array) -> Followed:
    """Return the joints along a path from the joint values `start` (n,).

    Raises:
        PlanningError: Where the arm cannot follow, and why.
    """
    exact = follower(robot, path.by_place, start, 0.0)
    try:
        return Followed(robot, path, exact, track_branch(exact, path.breaks))
    except StuckError as error:
        raise trouble_on(robot, path, exact).stuck(error) from None


def followed_in_time(robot: Robot, motion: ToolMotion, start: Array) -> PiecewisePolynomial:
    """Return q(t) of a motion that is known by its time alone.

    Raises:
        PlanningError: Where the arm cannot follow, and why.
    """
    middle = np.array([0.5 * motion.law.end])
    known = follower(robot, lambda _, side: motion.timed(middle, side), start, 0.0)
    exact = replace(known, demands=motion.timed)
    trouble = trouble_of(robot, motion, exact)
    try:
        coarse = track_branch(exact, motion.breaks)
    except StuckError as error:
        raise trouble.stuck(error) from None
    return _fitted(exact, motion.breaks, coarse.evaluate, motion.tolerance, trouble)


def _fitted(
    exact: Follower,
    breaks: Array,
    guess: Callable[[Array], Array],
    tolerance: Tolerance,
    trouble: Trouble,
) -> PiecewisePolynomial:
    try:
        misfit = tolerance_ratio(exact, tolerance, breaks, guess(probes(breaks)))
        return fit(exact.solved, misfit, breaks, guess)
    except (LostError, FitError) as error:
        at = float(error.places[0]) if isinstance(error, LostError) else error.place
        raise trouble.unfit(at, guess) from None
