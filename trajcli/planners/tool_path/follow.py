"""Joint curves that follow the tool, and why an arm cannot: workspace, limits, singularities."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Literal

import numpy as np

from trajcli.curves.extrema import peaks
from trajcli.curves.hermite_fit import FitError, fit, most_pieces
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import Amount, Amounts, PlanningError, Problem, of_joint
from trajcli.frozen import frozen
from trajcli.kinematics.dexterity import characteristic_length
from trajcli.kinematics.following.follower import (
    ExecutedPoses,
    Follower,
    LostError,
    ReferenceAt,
    follower,
)
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.following.tolerance import Tolerance, probes, tolerance_ratio
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.following.tracking import StuckError, track_branch
from trajcli.kinematics.jacobian import linearisation
from trajcli.kinematics.robot import Robot, ToolLimits
from trajcli.limits.tool import limits_tool
from trajcli.planners.planner import Event, Phase

if TYPE_CHECKING:
    from trajcli.curves.time_optimal.phase_plane import PhasePlane
    from trajcli.kinematics.following.tool_path import ToolReference

_BISECTIONS = 20
_SAMPLES = 17  # of the rest of the path, at which it is asked whether the arm reaches it
_NEXT = 4e-6  # of the whole: how far beyond the failure the first of them is
_CLOSER = 6  # times they are drawn closer about the worst: a hole may be as narrow as _NEXT
_SLOW = (
    20.0  # rad, or lengths of the arm, for each of these: a joint that goes less is not near a singularity
)
_REGULAR = 1e-3  # of the largest singular value: with more there is no singularity nearby
_SLOPE = 1e-5  # of the whole: step of the difference that says how fast a joint would have to go
_KEEPS_RATES = Tolerance()  # so near, a tool whose law is at a limit of its rates is not above it


class UnreachablePathError(PlanningError):
    """The path leaves the arm's workspace."""


@frozen
class FollowingDiagnosis:
    """Explains what goes wrong along a path, or over the time of a motion.

    Attributes:
        robot: The arm.
        reference: What the tool shall do, by s or by time.
        end: Last s, or time.
        law: s(t); None where the tool is known by s.
        angular: Whether s is an angle: the tcp rests.
        free: How many directions of the joint values the targets leave free.
    """

    robot: Robot
    reference: ReferenceAt
    end: float
    law: PiecewisePolynomial | None
    angular: bool
    free: int = 0

    def stuck(self, error: StuckError) -> PlanningError:
        """Return the error of an arm that could not be followed beyond some s."""
        return self._unreachable(error.s) or self._singular(error.s, error.joints, error.rates)

    def unfit(self, at: float, guess: Callable[[Array], Array], allowed: int) -> PlanningError:
        """Return the error of joints that no curve of so many pieces follows around some s or time."""
        step = _SLOPE * self.end
        around = np.clip(np.array([at - step, at, at + step]), 0.0, self.end)
        before, here, after = guess(around)
        rates = (after - before) / (around[2] - around[0])
        return self._unreachable(at) or self._singular(at, here, rates, allowed=allowed)

    def refuse_limits(self, curve: PiecewisePolynomial, slack: float) -> None:
        """Refuse a curve that leaves the range of a joint: the branch is fixed, and going slower is no help.

        Raises:
            PlanningError: Names the joint that is furthest beyond, where, and by how much.
        """
        (extremes,) = peaks(curve, (0,))
        low, high = self.robot.limits.position.T
        beyond = np.maximum(low - extremes.low, extremes.high - high)
        if not (beyond > slack).any():
            return
        joint = int(beyond.argmax())
        below = low[joint] - extremes.low[joint] > extremes.high[joint] - high[joint]
        value, time, limit = (
            (extremes.low, extremes.low_time, low) if below else (extremes.high, extremes.high_time, high)
        )
        amounts = {
            "value": Amount(float(value[joint]), 0, joint),
            "limit": Amount(float(limit[joint]), 0, joint),
            "place": self._s(float(time[joint])),
        }
        message = "{joint} would be at {value} at s = {place} of the path, its limit is {limit}"
        hint = "start in another configuration, or move the path"
        when = None if self.law is None else float(time[joint])  # without a law it is s
        raise PlanningError(of_joint(self.robot.joint_names[joint], message, hint, amounts, time=when))

    def _s(self, at: float) -> Amount:
        s = at if self.law is None else float(self.law.evaluate(min(at, self.law.end))[0])
        return Amount(s, 0, None, "angle" if self.angular else "length")

    def _unreachable(self, at: float) -> PlanningError | None:
        """Return the error that the path leaves the arm's workspace, if it does so beyond `at`."""
        samples = np.linspace(at, self.end, _SAMPLES)
        samples[0] = min(at + _NEXT * self.end, self.end)
        reference = self.reference(samples, "left")
        answers, shortfall = self._answers(reference)
        valid = np.array([len(joints) > 0 for joints in answers])
        if valid.all():
            return None
        first, last = int(np.argmin(valid)), at
        if first:
            last = self._last_reached(float(samples[first - 1]), float(samples[first]), answers[first - 1])
        missed, kind = self._largest_miss(samples, shortfall)
        amounts: Amounts = {
            "robot": self.robot.name,
            "place": self._s(last),
            "missed": Amount(missed, 0, None, ("length", "angle")[kind]),
        }
        message = "{robot} does not reach the path beyond s = {place}: it stays up to {missed} away"
        hint = "move the path into the reach of the arm"
        if reference.pinned:
            names = ", ".join(self.robot.joint_names[joint] for joint in reference.pinned)
            message = f"with {names} as it is pinned, {message}"
            hint += f", or give {names} another value at the target"
        far = shortfall[~valid, 0].argsort()[::-1]
        if self._reached_with_free_roll(samples[~valid][far]):
            axis = self.reference(samples[:1], "left").tool_axis
            hint += f", or give only the `direction` of the tool's {axis} axis at the target"
        return UnreachablePathError(Problem(message, hint, amounts=amounts))

    def _largest_miss(self, samples: Array, shortfall: Array) -> tuple[float, int]:
        """Return the largest of what is missed (N, 2) at samples (N,), or between: 0 a length, 1 an angle."""
        weights = np.array([1.0, characteristic_length(self.robot)])
        missed = shortfall * weights
        worst, last = int(missed.max(axis=1).argmax()), len(samples) - 1
        for _ in range(_CLOSER if worst < last else 0):
            samples = np.linspace(samples[max(worst - 1, 0)], samples[min(worst + 1, last)], len(samples))
            missed = self._answers(self.reference(samples, "left"))[1] * weights
            worst = int(missed.max(axis=1).argmax())
        kind = int(missed[worst].argmax())
        return float(missed[worst, kind] / weights[kind]), kind

    def _answers(self, reference: ToolReference) -> tuple[list[Array], Array]:
        """Return joint values (k, n) that meet each of N references, and by how much each is missed, (N, 2).

        They are those of the joints that are not pinned.
        """
        from trajcli.kinematics.inverse.solve import solve

        target = reference.target()
        count = len(target.poses)
        parts = [slice(None)] if reference.pins is None else [slice(k, k + 1) for k in range(count)]
        found = [solve(self._arm(reference, part.start), target.rows(part), None) for part in parts]
        joints = [q[valid] for each in found for q, valid in zip(each.joints, each.valid, strict=True)]
        return joints, np.concatenate([each.shortfall for each in found])

    def _arm(self, reference: ToolReference, row: int | None) -> Robot:
        """Return the arm of the joints that are not pinned in a row of a reference."""
        if reference.pins is None or row is None:
            return self.robot
        from trajcli.kinematics.inverse.pinned_joints import without_pinned

        return without_pinned(
            self.robot, dict(zip(reference.pinned, reference.pins[0, row].tolist(), strict=True))
        )

    def _reached_with_free_roll(self, samples: Array) -> bool:
        """Return whether the arm reaches the path, at samples (k,) from the worst on, with a free roll."""
        if self.reference(samples[:1], "left").orientation != "all":
            return False
        for part in filter(len, (samples[:1], samples[1:])):  # failures cost most
            reference = replace(self.reference(part, "left"), orientation="direction")
            answers, _ = self._answers(reference)
            if not all(len(joints) for joints in answers):
                return False
        return True

    def _last_reached(self, low: float, high: float, near: Array) -> float:
        """Return how far beyond `low`, where joint values (k, n) are near, some meet the target."""
        from trajcli.kinematics.inverse.numeric import descend

        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            reference = self.reference(np.full(len(near), middle), "left")
            joints, met = descend(self._arm(reference, 0), reference.target(), near, None)
            if met.any():
                low, near = middle, joints[met]
            else:
                high = middle
        return low

    def _singular(self, at: float, joints: Array, rates: Array, allowed: int | None = None) -> PlanningError:
        """Return the error that names the singularity at `at`, and the joint that goes fastest there."""
        bare = Follower(self.robot, self.reference, joints, np.empty((0, joints.size)))
        rows = bare.rows(self.reference(np.array([at]), "right"), *linearisation(self.robot, joints[None]))
        values = np.linalg.svd(rows[0], compute_uv=False)
        ratio = float(values[len(joints) - self.free - 1] / values[0])
        if ratio > _REGULAR and (self.free or allowed is not None):
            return self._regular(at, allowed)
        joint = int(np.abs(rates).argmax())
        unit = "rad" if self.robot.joint_types[joint] == "revolute" else "m"
        per = "s" if self.law is not None else "rad of the path" if self.angular else "m of the path"
        symptom = f"{{joint}} would have to go {abs(float(rates[joint])):.4g} {unit} for each {per}"
        length = characteristic_length(self.robot)
        racing = _SLOW * (1.0 if unit == "rad" else length) / (1.0 if self.angular else length)
        if self.law is None and abs(float(rates[joint])) < racing:
            symptom = "branches of the arm meet, and it would pass from one to another"
        message = (
            f"the path runs into a singularity at s = {{place}}: there {symptom} (smallest over largest "
            f"singular value {ratio:.2g})"
        )
        hint = "move the path, start in another configuration, or use a move in joint space there"
        return PlanningError(of_joint(self.robot.joint_names[joint], message, hint, {"place": self._s(at)}))

    def _regular(self, at: float, allowed: int | None) -> PlanningError:
        message = f"{allowed} pieces do not meet the tolerance on this path, worst around s = {{place}}"
        hint = "choose a larger `tolerance`, or split the path"
        if limits_tool(self.robot):
            hint = "split the path, or move it: limits of the tool ask for 1e-6 m and rad"
        if allowed is None:
            message = (
                "what the target leaves free cannot be held beyond s = {place} of the path: "
                "{robot} would have to turn round in its place"
            )
            hint = "start in another configuration, fix more of the target's orientation, or split the move"
        amounts: Amounts = {"robot": self.robot.name, "place": self._s(at)}
        return PlanningError(Problem(message, hint, amounts=amounts))


@frozen
class JointMotion:
    """A motion of tool and joints.

    Attributes:
        curve: q(t).
        motion: What the tool shall do.
        phases: Named intervals of time.
        events: What was conceded.
        phase_plane: Of a time-optimal law.
        continuity: Of the curve, where its law promises less.
    """

    curve: PiecewisePolynomial
    motion: ToolMotion
    phases: tuple[Phase, ...] = ()
    events: tuple[Event, ...] = ()
    phase_plane: PhasePlane | None = None
    continuity: Literal[1, 2] | None = None


@frozen
class FollowedPath:
    """Joints along a path, as a function of its parameter s.

    Attributes:
        robot: The arm.
        path: Of the tool.
        follower: Gives the exact joints at any s.
        coarse: Joints near the exact ones, a curve over s.
    """

    robot: Robot
    path: ToolPath
    follower: Follower
    coarse: PiecewisePolynomial

    @cached_property
    def executed(self) -> ToolPath:
        """The path as the tool follows it: with the turn that its targets leave free, where they do."""
        if self.path.orientation == "all":
            return self.path
        return replace(self.path, poses=ExecutedPoses(self.path.poses, self.follower, self.coarse))

    def limited_by(self, tcp: ToolLimits) -> ToolPath:
        """Return the path as limits of the tool see it: a turn that is left free counts where one limits it.

        Where the tcp goes is known without the joints, which are found anew at each s for the turn alone.
        """
        speeds = self.path.speeds
        turning = min(tcp.angular_speed, tcp.angular_acceleration)
        if speeds is not None:
            turning = min(turning, speeds.angular_speed.min())
        return self.executed if turning < np.inf else self.path

    @contextmanager
    def diagnosed(self) -> Iterator[None]:
        """Say where and why the arm cannot follow where the joints are lost between their coarse values.

        Raises:
            PlanningError: Names the singularity.
        """
        try:
            yield
        except LostError as error:
            diagnosis = diagnosis_on_path(self.robot, self.path, self.follower)
            allowed = most_pieces(self.path.breaks)
            raise diagnosis.unfit(float(error.s[0]), self.coarse.evaluate, allowed) from None

    def by_s(self, tolerance: Tolerance) -> PiecewisePolynomial:
        """Return q(s) within half of a tolerance: what a law multiplies the rest with must still be within.

        Raises:
            PlanningError: When no pieces of the allowed number are enough: names the singularity.
        """
        tolerance = Tolerance(0.5 * tolerance.position, 0.5 * tolerance.angle)
        diagnosis = diagnosis_on_path(self.robot, self.path, self.follower)
        return _fitted(self.follower, self.path.breaks, self.coarse.evaluate, tolerance, diagnosis)

    def by_time(self, motion: ToolMotion) -> PiecewisePolynomial:
        """Return q(t) within the motion's tolerance.

        Raises:
            PlanningError: As `by_s`.
        """
        timed = replace(self.follower, reference_at=motion.reference_at)

        def guess(times: Array) -> Array:
            s = motion.law.evaluate(times)[:, 0]
            return self.coarse.evaluate(s.clip(self.coarse.start, self.coarse.end))

        diagnosis = diagnosis_of_motion(self.robot, motion, timed)
        return _fitted(timed, motion.breaks, guess, motion.tolerance, diagnosis)


def diagnosis_on_path(robot: Robot, path: ToolPath, exact: Follower) -> FollowingDiagnosis:
    """Return the diagnosis of an arm along a path."""
    return FollowingDiagnosis(robot, path.at_s, path.length, None, path.poses.pure_rotation, len(exact.held))


def diagnosis_of_motion(
    robot: Robot, motion: ToolMotion, exact: Follower | None = None
) -> FollowingDiagnosis:
    """Return the diagnosis of an arm in a motion."""
    law, free = motion.law, 0 if exact is None else len(exact.held)
    return FollowingDiagnosis(robot, motion.reference_at, law.end, law, motion.pure_rotation, free)


def followed(robot: Robot, path: ToolPath, start: Array) -> FollowedPath:
    """Return the joints along a path from the joint values `start` (n,).

    Raises:
        PlanningError: Where the arm cannot follow, and why.
    """
    exact = follower(robot, path.at_s, start, 0.0)
    try:
        return FollowedPath(robot, path, exact, track_branch(exact, path.breaks))
    except StuckError as error:
        raise diagnosis_on_path(robot, path, exact).stuck(error) from None


def followed_in_time(robot: Robot, motion: ToolMotion, start: Array) -> PiecewisePolynomial:
    """Return q(t) of a motion that is known by its time alone.

    Raises:
        PlanningError: Where the arm cannot follow, and why.
    """
    middle = np.array([0.5 * motion.law.end])
    held = follower(robot, lambda _, side: motion.reference_at(middle, side), start, 0.0)
    exact = replace(held, reference_at=motion.reference_at)
    diagnosis = diagnosis_of_motion(robot, motion, exact)
    try:
        coarse = track_branch(exact, motion.breaks)
    except StuckError as error:
        raise diagnosis.stuck(error) from None
    return _fitted(exact, motion.breaks, coarse.evaluate, motion.tolerance, diagnosis)


def _fitted(
    exact: Follower,
    breaks: Array,
    guess: Callable[[Array], Array],
    tolerance: Tolerance,
    diagnosis: FollowingDiagnosis,
) -> PiecewisePolynomial:
    if limits_tool(diagnosis.robot):
        tolerance = Tolerance(
            min(tolerance.position, _KEEPS_RATES.position), min(tolerance.angle, _KEEPS_RATES.angle)
        )
    try:
        ratio = tolerance_ratio(exact, tolerance, breaks, guess(probes(breaks)))
        return fit(exact.joint_state, ratio, breaks, guess)
    except (LostError, FitError) as error:
        at = float(error.s[0]) if isinstance(error, LostError) else error.at
        raise diagnosis.unfit(at, guess, most_pieces(breaks)) from None
