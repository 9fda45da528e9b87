"""Limits of torques and forces for all t, on the curve through recorded rows.

What rows state holds for every consumer: an effort at each of them where they have accelerations, else the
mean of one between two velocities. What the curve does between the rows is told from the rounding of their
numbers piece by piece, as a short one makes large accelerations of it, and says nothing of the others. Where
rows stand dense, an effort that only the curve between them has is a warning, unless somebody asked for that
curve.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.node_bound import NodeSurvey
from trajcli.curves.piecewise import Array, derivative_coefficients, horner
from trajcli.dynamics.effort_bound import EffortPeak, EffortSurvey, effort_survey
from trajcli.dynamics.newton_euler import InverseDynamics
from trajcli.findings import Certainty, FindingMethod, FindingSeverity
from trajcli.frozen import frozen
from trajcli.judge.intervals import DENSE, Intervals, largest_first
from trajcli.judge.joint_limits import JudgedRun
from trajcli.judge.rounding import PieceRows
from trajcli.limits.effort import effort_excess
from trajcli.limits.tolerances import EFFORT_RELATIVE

_STILL = 1e-9  # rad/s or m/s: rest, as files of nine decimals tell it
_UNKNOWN = 1e9  # SI: of a rate that rounding hides
_ACCELERATED = 2  # derivatives that a piece determines where it has an acceleration
_MOMENT = 1e-12  # s: a motion so short has one effort
_SPACING = 4.0  # units in the last place by which times of one moment differ


def judge_efforts(run: JudgedRun) -> None:
    """Add where joints of an arm are over their limits of torque or force.

    Raises:
        InputError: When a link of the arm has no inertia, or the arm no geometry.
    """
    window, limits = run.window, run.robot.limits.effort
    curved = np.flatnonzero(window.highest[run.pieces] >= _ACCELERATED) + run.pieces.start
    if not curved.size:
        return
    dynamics, coefficients = InverseDynamics(run.robot), window.coefficients[:, curved]
    breaks = np.concatenate([[0.0], np.cumsum(window.lengths[curved])])
    survey = effort_survey(dynamics, breaks, coefficients, limits, _still(window))
    judge = _EffortJudge(run, dynamics, survey, curved, breaks)
    for joint, bounds in enumerate(limits.tolist()):
        for sign, limit in ((1, bounds[1]), (-1, -bounds[0])):
            peak = survey.peak(joint, sign)
            if not peak.upper_bound <= limit * (1 + EFFORT_RELATIVE):
                judge.add(joint, sign, limit, peak)


def _still(window: Intervals) -> float:
    """Return how fast a joint at rest may seem by the rounding of rows, rad/s or m/s."""
    return max(_STILL, 2 * float(np.max(window.resolution.qd)))


@frozen
class _States:
    """What rows state of all joints, k times, and how far it may be off.

    Attributes:
        at: Index of the curved piece, shape (k,).
        local: Seconds from its start, shape (k,).
        values: Positions, velocities and accelerations, shape (3, k, n).
        errors: Of these, shape (3, k, n).
        friction: By how much the efforts may be off as nobody knows in which direction a joint goes, (k, n).
        efforts: Shape (k, n).
    """

    at: NDArray[np.intp]
    local: Array
    values: Array
    errors: Array
    friction: Array
    efforts: Array


@frozen
class _Excess:
    """An effort over its limit.

    Attributes:
        piece: Where it is.
        local: Seconds from the start of the piece.
        peak: The effort.
        survey: Of what it is the largest.
        rounding: By how much it may be off, N m or N.
        method: Of the finding.
    """

    piece: int
    local: float
    peak: EffortPeak
    survey: EffortSurvey
    rounding: float
    method: FindingMethod = "bounded"


@frozen
class _EffortJudge:
    """Efforts on the pieces `curved` of a window, which stand one behind the other from break to break."""

    run: JudgedRun
    dynamics: InverseDynamics
    survey: EffortSurvey
    curved: NDArray[np.intp]
    breaks: Array

    def add(self, joint: int, sign: int, limit: float, peak: EffortPeak) -> None:
        """Add one joint that is over its limit in one direction, by what is certain about it."""
        at = self._piece_of(peak.time, joint, sign)
        found, stated = self._on_curve(at, joint, peak, self.survey), self._stated_over(joint, sign, limit)
        certain = found.peak.upper_bound - limit > found.rounding
        warned = not self.run.asked and bool(self._lengths[at] <= DENSE) and stated is None
        if not certain or warned:  # rounding, or dense rows, explain the largest: not what is elsewhere
            other = self._curve_over(joint, sign, limit) or stated
            if other is not None:
                found, certain, warned = other, True, False
        self._note(joint, sign, limit, found, "exceeded" if certain else "within rounding", warned=warned)

    def _note(
        self, joint: int, sign: int, limit: float, found: _Excess, certainty: Certainty, *, warned: bool
    ) -> None:
        window = self.run.window
        time = float(window.t[found.piece]) + found.local
        excess = effort_excess(
            self.run.robot, found.survey, joint, sign, limit, replace(found.peak, time=time)
        )
        row = window.row_at(found.piece, found.local)
        finding = replace(excess, row=row, rounding=found.rounding, method=found.method)
        severity: FindingSeverity = "warning" if warned else "error"
        self.run.worst.add(
            "effort",
            int(window.moves[found.piece]),
            np.array([joint]),
            np.array([found.peak.upper_bound / limit]),
            lambda _: finding,
            severity=severity,
            certainty=certainty,
        )

    @property
    def _lengths(self) -> Array:
        return np.asarray(self.run.window.lengths[self.curved])

    @cached_property
    def _owners(self) -> NDArray[np.intp]:
        """Which of the curved pieces each piece of the survey is part of, shape (P,)."""
        nodes = self.survey.nodes
        found = np.searchsorted(self.breaks, nodes.starts + nodes.lengths / 2) - 1
        return np.clip(found, 0, self.curved.size - 1)

    def _reached(self, joint: int, sign: int) -> tuple[Array, Array]:
        """Return the largest effort at nodes of each curved piece, in one direction, and when, (m,) each."""
        nodes, size = self.survey.nodes, self.curved.size
        efforts = sign * nodes.values[:, :, joint].sum(axis=2)
        owners, inside = np.repeat(self._owners, efforts.shape[1]), np.linspace(0.0, 1.0, efforts.shape[1])
        order = np.lexsort((efforts.ravel(), owners))
        last = order[np.diff(owners[order], append=size) > 0]
        reached, local, at = np.full(size, -np.inf), np.zeros(size), owners[last]
        reached[at] = efforts.ravel()[last]
        local[at] = (nodes.starts[:, None] + nodes.lengths[:, None] * inside).ravel()[last] - self.breaks[at]
        return reached, local

    def _piece_of(self, time: float, joint: int, sign: int) -> int:
        """Return the curved piece of a peak: at a break that of the two which reaches more there."""
        nodes, near = self.survey.nodes, _SPACING * float(np.spacing(self.breaks[-1]))
        ends = nodes.starts[:, None] + nodes.lengths[:, None] * np.arange(2.0)
        efforts = sign * nodes.values[:, [0, -1], joint].sum(axis=2)
        there = np.where(np.abs(ends - time) <= near, efforts, -np.inf).max(axis=1)
        if np.isfinite(there.max()):
            return int(self._owners[there.argmax()])
        return max(int(np.searchsorted(self.breaks, time, "right")) - 1, 0)

    def _on_curve(self, at: int, joint: int, peak: EffortPeak, survey: EffortSurvey) -> _Excess:
        """Return a peak on a curved piece, with what rounding makes of the effort there."""
        local = float(np.clip(peak.time - self.breaks[at], 0.0, self._lengths[at]))
        (rounding,) = self._roundings(joint, np.array([at]), np.array([local])).tolist()
        return _Excess(int(self.curved[at]), local, peak, survey, rounding)

    def _curve_over(self, joint: int, sign: int, limit: float) -> _Excess | None:
        """Return the largest effort of the curve that rounding does not explain, where rows are not dense."""
        reached, local = self._reached(joint, sign)
        over = reached > limit * (1 + EFFORT_RELATIVE)
        if not self.run.asked:
            over &= self._lengths > DENSE
        for some in largest_first(reached, over):
            certain = reached[some] - limit > self._roundings(joint, some, local[some])
            if certain.any():
                at = int(some[certain.argmax()])
                peak = _part(self.survey, self._owners == at).peak(joint, sign)
                return self._on_curve(
                    at, joint, peak, _part(self.survey, reached[self._owners] <= reached[at])
                )
        return None

    def _stated_over(self, joint: int, sign: int, limit: float) -> _Excess | None:
        """Return the largest effort that rows state, of those that rounding does not explain."""
        stated = self._stated
        efforts = sign * stated.efforts[:, joint]
        for some in largest_first(efforts, efforts > limit * (1 + EFFORT_RELATIVE)):
            rounding = self._spread(joint, stated.values[:, some], stated.errors[:, some])
            rounding = rounding + stated.friction[some, joint]
            certain = efforts[some] - limit > rounding
            if certain.any():
                first = int(certain.argmax())
                k = int(some[first])
                moment = self._at_moment(stated.values[:, k])
                at, local = int(self.curved[stated.at[k]]), float(stated.local[k])
                return _Excess(at, local, moment.peak(joint, sign), moment, float(rounding[first]), "sampled")
        return None

    def _at_moment(self, state: Array) -> EffortSurvey:
        """Return the efforts of one state (3, n)."""
        q, qd, qdd = state
        coefficients, limits = np.stack([qdd / 2, qd, q])[:, None], self.run.robot.limits.effort
        return effort_survey(self.dynamics, np.array([0.0, _MOMENT]), coefficients, limits)

    @cached_property
    def _stated(self) -> _States:
        """What rows state on the curved pieces; at rest friction is that of the motion beside."""
        still, lengths, count = _still(self.run.window), self._lengths, len(self.dynamics.links)
        parts = [
            (chosen, np.full(chosen.size, share) * lengths[chosen], *state)
            for chosen, rows in self.run.window.rows_by_level(self.curved)
            for share, state in _states_of(rows)
        ]
        at = np.concatenate([np.empty(0, dtype=np.intp), *(part[0] for part in parts)])
        local = np.concatenate([np.empty(0), *(part[1] for part in parts)])
        values, errors = (
            np.concatenate([np.empty((3, 0)), *(part[k] for part in parts)], axis=1).reshape(
                3, at.size, count
            )
            for k in (2, 3)
        )
        slopes = derivative_coefficients(self.run.window.coefficients[:, self.curved[at]], 1)
        beside = still * np.sign(horner(slopes, lengths[at, None] / 2))
        q, qd, qdd = values
        rates = np.where(np.abs(qd) <= still, beside, qd)
        coulomb = np.array([joint.friction.coulomb for joint in self.dynamics.robot.joints])
        either = (np.abs(qd) <= np.maximum(still, errors[1])) & (beside != 0.0)
        friction = np.where(either, 2.0 * coulomb, 0.0)
        values = np.stack([q, rates, qdd])
        return _States(at, local, values, errors, friction, self.dynamics.effort(q, rates, qdd))

    def _roundings(self, joint: int, pieces: NDArray[np.intp], local: Array) -> Array:
        """Return by how much the effort of a joint may be off at a time of each of some curved pieces."""
        result, count = np.empty(pieces.size), len(self.dynamics.links)
        for chosen, rows in self.run.window.rows_by_level(self.curved[pieces]):
            errors = np.reshape([rows.error(order) for order in range(3)], (3, chosen.size, count))
            curves = self.run.window.coefficients[:, self.curved[pieces[chosen]]]
            state = [horner(derivative_coefficients(curves, k), local[chosen, None]) for k in range(3)]
            result[chosen] = self._spread(joint, np.stack(state), errors)
        return result

    def _spread(self, joint: int, states: Array, errors: Array) -> Array:
        """Return by how much an effort may be off by the errors of states (3, k, n), shape (k,)."""
        finite = np.minimum(errors, _UNKNOWN)
        sides = np.eye(3 * states.shape[2]).reshape(-1, 3, 1, states.shape[2])
        every = [*(sides * finite + states), states]
        efforts = self.dynamics.rigid_effort(*np.swapaxes(every, 0, 1))[..., joint]
        viscous = self.dynamics.robot.joints[joint].friction.viscous
        return np.asarray(np.abs(efforts[:-1] - efforts[-1]).sum(axis=0) + viscous * finite[1, :, joint])


def _states_of(rows: PieceRows) -> Iterator[tuple[float, tuple[Array, Array]]]:
    """Yield where on pieces rows state positions, velocities and accelerations, these, and their errors.

    Shape (3, m) each. Of a spline through positions rows state no rates.
    """
    if len(rows.ends) > _ACCELERATED:
        for end in (0, 1):
            yield float(end), (np.stack([both[end] for both in rows.ends]), np.stack(rows.errors))
    elif len(rows.ends) == _ACCELERATED:
        change, off = rows.difference(1)
        means = [both.mean(axis=0) for both in rows.ends]
        apart = [e + np.abs(both[1] - both[0]) / 2 for e, both in zip(rows.errors, rows.ends, strict=True)]
        yield 0.5, (np.stack([*means, change]), np.stack([*apart, off]))


def _part(survey: EffortSurvey, chosen: NDArray[np.bool_]) -> EffortSurvey:
    """Return some of the pieces of a survey, chosen (P,)."""
    nodes = survey.nodes
    some = NodeSurvey(
        nodes.starts[chosen], nodes.lengths[chosen], nodes.values[chosen], nodes.remainder[chosen]
    )
    return replace(survey, nodes=some)
