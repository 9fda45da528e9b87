"""Search for the duration of a move between moving states, and reasons why there is none."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from trajcli.checks.braking import judged_peaks
from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, Amounts, PlanningError, Problem
from trajcli.kinematics.robot import ToolLimits
from trajcli.limits.joints import JointSurvey, peaks_by_move
from trajcli.limits.kinds import LimitedMove, families, family
from trajcli.limits.tolerances import exceeds
from trajcli.planners.planner import PlannedMove
from trajcli.trajectory import State

_PROBED = (1.5, 4.0, 30.0)  # times the duration: a planner that refuses all of them refuses any


def why_no_duration(move: PlannedMove) -> Problem | None:
    """Return why no motion whatever between the ends of a move keeps the limits, where that is plain."""
    limits, ends = move.robot.limits, (move.start, move.planned.end)
    if limits.tcp != ToolLimits() and family("tool").over_at_ends(move.robot, ends, ("tool_speed", -1, 0.0)):
        return Problem("the tool is too fast where the move starts or ends")
    if move.planned.begins is not None or move.planned.origin:
        return None  # where the curve begins and ends depends on its duration
    if move.planned.braking is not None:
        return None  # it may start outside its limits
    judges = [family("joints"), *(each for _, each in families(limits, further=True))]
    for state, verb in zip(ends, ("starts", "ends"), strict=True):
        for judge in judges:
            reason = judge.why_not_in_state(move.robot, state)
            if reason is not None:
                return Problem(reason[0].replace("{verb}", verb), amounts=reason[1])
        short = _no_room(move, state, verb)
        if short is not None:
            return short
    return None


def _no_room(move: PlannedMove, state: State, verb: str) -> Problem | None:
    """Return that a joint is too near to the end of its range to stop, or to have come to its velocity.

    Within the acceleration a a velocity v takes the distance v^2 / (2 a), however long the move lasts.
    """
    positions, accelerations = move.robot.limits.of_order(0), move.robot.limits.of_order(2)
    forward = state.velocity > 0
    ahead = forward if verb == "starts" else ~forward
    left = np.where(ahead, positions[:, 1] - state.position, state.position - positions[:, 0])
    rate = np.where(ahead, -accelerations[:, 0], accelerations[:, 1])
    needed = state.velocity**2 / (2 * rate)
    short = np.flatnonzero((state.velocity != 0) & exceeds(needed, left))
    if not short.size:
        return None
    joint = int(short[0])
    purpose = "to stop" if verb == "starts" else "to come to that velocity"
    message = f"{{joint}} {verb} with {{velocity}}, {{room}} from its limit, and needs {{needed}} {purpose}"
    amounts: Amounts = {
        "joint": move.robot.joint_names[joint],
        "velocity": Amount(float(state.velocity[joint]), 1, joint),
        "room": Amount(float(left[joint]), 0, joint),
        "needed": Amount(float(needed[joint]), 0, joint, rounded="up"),
    }
    return Problem(message, amounts=amounts)


class StretchSearch:
    """The excess of a move over its limits by how many times longer it lasts, and what is learned of it.

    Where the times of all parts of a curve are scaled alike, its position at each part of the duration T is
    a + b T, but for terms of accelerations at its ends. What the range is left by, the largest of such lines,
    is convex in T: once it grows, it grows for ever.
    """

    def __init__(self, move: PlannedMove, with_duration: Callable[[PlannedMove, float], PlannedMove]) -> None:
        """Prepare the search.

        Args:
            move: That does not start and end at rest.
            with_duration: Plans it for a duration, s.
        """
        self._move, self._with_duration = move, with_duration
        self._refusal = self._why_no_longer()
        bent = move.start.acceleration.any() or move.planned.end.acceleration.any()
        self._convex = move.planner.proportional and not bent
        self._hopeless, self._joint = np.inf, 0
        self._last = (0.0, -np.inf)

    def excess(self, factors: Array) -> Array:
        """Return by how much of a limit the move is over its limits when stretched by each of the factors."""
        return np.array([self._excess(factor) for factor in factors.tolist()])

    def in_vain(self) -> Problem:
        """Return why no factor was found."""
        if self._refusal is not None:
            return self._refusal
        if np.isfinite(self._hopeless):
            name = self._move.robot.joint_names[self._joint]
            message = "the longer it lasts, the further {joint} goes beyond its position limit"
            return Problem(message, amounts={"joint": name})
        return Problem("no duration keeps all limits between these moving states")

    def _why_no_longer(self) -> Problem | None:
        """Return the refusal of a planner that refuses to last longer, whatever the duration."""
        refusal = None
        for factor in _PROBED:
            try:
                self._with_duration(self._move, self._move.duration * factor)
            except PlanningError as error:
                refusal = error.problems[0]
            else:
                return None
        return refusal

    def _excess(self, factor: float) -> float:
        if self._refusal is not None or factor >= self._hopeless:
            return np.inf
        try:
            longer = self._with_duration(self._move, self._move.duration * factor)
        except PlanningError:
            return np.inf
        alone, robot = longer.alone(), longer.robot
        (peaks,) = judged_peaks(alone, [robot.limits], [longer.promise], peaks_by_move(alone))
        self._learn(factor, peaks[0].low, peaks[0].high)
        limited = LimitedMove(alone, alone.spans[0], robot.limits, robot)
        further = (each.survey(limited) for _, each in families(robot.limits, further=True))
        surveys = (JointSurvey(tuple(peaks), robot.limits), *further)
        return max(survey.excess() for survey in surveys if survey is not None)

    def _learn(self, factor: float, lowest: Array, highest: Array) -> None:
        """Note from which factor on the range of a joint is left, and ever more so."""
        low, high = self._move.robot.limits.of_order(0).T
        beyond = np.maximum(low - lowest, highest - high)
        by, joint = float(beyond.max()), int(beyond.argmax())
        before, by_before = self._last
        if self._convex and by > max(by_before, 0.0) and factor > before and np.isfinite(by_before):
            self._hopeless, self._joint = min(self._hopeless, factor), joint
        self._last = (factor, by)
