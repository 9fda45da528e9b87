"""Limits of joints for all t, on the curve through recorded rows.

Three things are told apart. What a row states, or what the difference of two rows makes certain by the mean
value theorem, holds for every consumer. What the curve does between the rows holds for those who join them by
it. And where rows stand so dense that controllers take them one by one, a curve that goes beyond a limit only
because the motion changes its law between two rows is a warning, unless somebody asked for that curve.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.extrema import critical_points
from trajcli.curves.piecewise import Array, derivative_coefficients, horner
from trajcli.findings import Certainty, Collector, Finding, FindingSeverity
from trajcli.frozen import frozen
from trajcli.judge.intervals import Intervals, explained_by_law
from trajcli.judge.rounding import PieceRows, stated_errors
from trajcli.kinematics.robot import Robot
from trajcli.limits.joints import joint_excess
from trajcli.limits.kinds import JOINT_KINDS, KIND_OF
from trajcli.limits.tolerances import exceeds

_MANY = 20000  # pieces and joints over a limit from which on only the worst of them are looked at closely


@frozen
class _Offences:
    """Pieces that go beyond one bound of one order, m of them; values are turned so that more is worse.

    Attributes:
        piece: Index of each, shape (m,).
        joint: Index of its joint.
        value: The largest on the piece.
        local: Seconds from the start of the piece.
        bound: The limit.
    """

    piece: NDArray[np.intp]
    joint: NDArray[np.intp]
    value: Array
    local: Array
    bound: Array


@frozen
class JudgedRun:
    """Pieces of recorded rows, of moves for which the same limits are in force.

    Attributes:
        window: The rows.
        pieces: Which ones.
        robot: With the limits in force, gravity, and what its tool carries.
        worst: To which findings are added.
        asked: Whether somebody asked for this curve.
        carries_one: Whether the tool carries the same in all of them: else no row says when it changed.
    """

    window: Intervals
    pieces: slice
    robot: Robot
    worst: Collector
    asked: bool
    carries_one: bool = True

    @property
    def limits_efforts(self) -> bool:
        """Whether torques or forces are limited, and it is known what the tool carries."""
        return self.carries_one and KIND_OF["effort"].stated(self.robot.limits)

    def add(
        self,
        kind: str,
        found_at: tuple[NDArray[np.intp], NDArray[np.intp]],
        excess: Array,
        make: Callable[[int], Finding],
        certain: NDArray[np.bool_],
        warned: NDArray[np.bool_],
    ) -> None:
        """Add offences by what is certain about them: m of one kind, `warned` where they are warnings.

        They are found at the indices of pieces, and of joints.
        """
        groups: tuple[tuple[NDArray[np.bool_], FindingSeverity, Certainty], ...] = (
            (certain & ~warned, "error", "exceeded"),
            (~certain & ~warned, "error", "within rounding"),
            (certain & warned, "warning", "exceeded"),
        )
        for chosen, severity, certainty in groups:
            self.worst.add(
                kind,
                self.window.moves[found_at[0]],
                found_at[1],
                excess,
                make,
                severity=severity,
                certainty=certainty,
                chosen=chosen,
            )


def judge_limits(run: JudgedRun) -> None:
    """Add where joints go beyond their limits in pieces with the same limits."""
    _judge_derivatives(run)
    if run.window.states[2] is not None and run.window.interpolation == "linear" and not run.asked:
        _judge_lone_accelerations(run, run.window.states[2])
    if KIND_OF["velocity_by_position"].stated(run.robot.limits):
        _judge_approaches(run)


def _judge_derivatives(run: JudgedRun) -> None:
    """Add where joints go beyond their limits of position, velocity, acceleration and jerk."""
    window, pieces, limits = run.window, run.pieces, run.robot.limits
    coefficients, highest = window.coefficients[:, pieces], window.highest[pieces]
    for order in range(int(highest.max(initial=0)) + 1):
        bounds = limits.of_order(order)
        if not np.isfinite(bounds).any():
            continue
        least, largest = (points[pieces] for points in window.hulls[order])
        turned = ((1.0, bounds[:, 1], largest), (-1.0, -bounds[:, 0], -least))
        for sign, bound, upper_bound in turned:
            over = exceeds(upper_bound, bound)
            if not over.any():
                continue
            for level in set(highest[over.any(axis=1)].tolist()):
                side = _Side(window, order, sign, bound, level, pieces.start)
                alike = over & (highest == level)[:, None]
                derivative = sign * derivative_coefficients(coefficients, order)
                offences = side.offences(derivative, alike, upper_bound) if order <= level else None
                if offences is not None:
                    side.add(offences, run)


def _judge_lone_accelerations(run: JudgedRun, stated: Array) -> None:
    """Add accelerations of rows beyond their limits; without velocities beside them no curve has them."""
    window, first, limits = run.window, run.pieces.start, run.robot.limits.acceleration
    rows = slice(first, run.pieces.stop + (window.ends and run.pieces.stop == window.last))
    off = stated_errors(stated, *window.resolution.roundings[2])
    for sign, side in ((1.0, 1), (-1.0, 0)):
        values, bounds = sign * stated[rows], sign * limits[:, side]
        row, joint = np.nonzero(exceeds(values, bounds))
        excess, at = (values - bounds)[row, joint], row + first
        certain = excess > off[at, joint]
        make = partial(_lone_acceleration, run, stated, off, at, joint, side)
        used = values[row, joint] / bounds[joint]
        run.add("acceleration", (at, joint), used, make, certain, np.zeros_like(certain))


def _lone_acceleration(
    run: JudgedRun,
    stated: Array,
    off: Array,
    at: NDArray[np.intp],
    joints: NDArray[np.intp],
    side: int,
    k: int,
) -> Finding:
    row, joint = int(at[k]), int(joints[k])
    value, limit = float(stated[row, joint]), float(run.robot.limits.acceleration[joint, side])
    found = joint_excess(run.robot, 2, joint, value, limit, float(run.window.t[row]))
    return replace(found, row=int(run.window.rows[row]), rounding=float(off[row, joint]))


@frozen
class _Side:
    """The limits of one side of one order, for pieces of one degree.

    Attributes:
        window: The rows.
        order: 0 for positions.
        sign: 1 for upper limits, -1 for lower ones.
        bound: Times the sign, shape (n,).
        level: Order of the highest derivative that the pieces determine.
        first: Index of the first piece.
    """

    window: Intervals
    order: int
    sign: float
    bound: Array
    level: int
    first: int

    def offences(self, polynomials: Array, over: NDArray[np.bool_], upper_bound: Array) -> _Offences | None:
        """Return the pieces whose polynomials go beyond the bound, from those whose control points do."""
        piece, joint = np.nonzero(over)
        chosen, length = polynomials[:, piece, joint], self.window.lengths[self.first + piece]
        start, end, bound = chosen[-1], horner(chosen, length), self.bound[joint]
        if len(self.window.coefficients) == 1:  # rows are held
            end = self.sign * self.window.behind[self.first + piece, joint]
        value, local = np.maximum(start, end), np.where(end > start, length, 0.0)
        if len(chosen) > 2:
            near = np.arange(piece.size)
            if piece.size > _MANY:
                worst = np.full(self.bound.size, -np.inf)
                np.maximum.at(worst, joint, value)
                near = np.flatnonzero(~exceeds(value, bound) | (upper_bound[piece, joint] > worst[joint]))
            for low in range(0, near.size, _MANY):
                _refine(chosen, length, near[low : low + _MANY], value, local)
        beyond = np.flatnonzero(exceeds(value, bound))
        if not beyond.size:
            return None
        return _Offences(
            self.first + piece[beyond], joint[beyond], value[beyond], local[beyond], bound[beyond]
        )

    def add(self, found: _Offences, run: JudgedRun) -> None:
        """Add pieces beyond the bound, by what is certain about them."""
        count = 1 if self.window.interpolation == "jtc-upsampling" else max(self.level, 1)
        rows = self.window.piece_rows(found.piece, found.joint, count)
        error = rows.error(self.order)
        stated, certain_part = _stated(rows, self.order, self.sign)
        by_rows = exceeds(stated, found.bound) & (certain_part > found.bound)
        by_curve = found.value - found.bound > error
        value = np.where(by_rows & ~by_curve, np.minimum(stated, found.value), found.value)
        certain, warned = by_rows | by_curve, np.zeros(value.shape, dtype=bool)
        if not run.asked:
            silent = ~exceeds(stated, found.bound)  # a little beyond between rows is no worse than far beyond
            slack = np.where(by_curve, error, np.where(silent, 0.0, -np.inf))
            warned = ~by_rows & self._unresolved(found, slack)
        excess = value / found.bound if self.order else value - found.bound

        def make(k: int) -> Finding:
            return self._finding(
                found, k, float(value[k]), float(error[k]), run.robot, warned=bool(warned[k])
            )

        found_at = found.piece, found.joint
        run.add(JOINT_KINDS[self.order].name, found_at, excess, make, certain, warned)

    def _unresolved(self, found: _Offences, slack: Array) -> NDArray[np.bool_]:
        """Return where a change of the law between two rows explains what the curve goes beyond the bound."""
        explained = explained_by_law(self.window, found.piece, found.joint, self.order, self.level)
        return np.asarray(found.value - found.bound <= explained + slack)

    def _finding(
        self, found: _Offences, k: int, value: float, error: float, robot: Robot, *, warned: bool
    ) -> Finding:
        piece, joint, local = int(found.piece[k]), int(found.joint[k]), float(found.local[k])
        time, limit = float(self.window.t[piece]) + local, self.sign * float(found.bound[k])
        found_one = joint_excess(robot, self.order, joint, self.sign * value, limit, time)
        between = "; between the rows only, where the motion changes its law" if warned else ""
        row, message = self.window.row_at(piece, local), found_one.message + between
        return replace(found_one, row=row, rounding=error, message=message)


def _refine(polynomials: Array, lengths: Array, near: NDArray[np.intp], value: Array, local: Array) -> None:
    """Raise values of some polynomials to their largest ones, and move times to where these are."""
    chosen, length = polynomials[:, near], lengths[near]
    (inside,) = critical_points(chosen[:, :, None], length, (0,))
    times = inside[:, :, 0]
    values = horner(chosen, times)
    best, columns = values.argmax(axis=0), np.arange(near.size)
    top, when = values[best, columns], times[best, columns]
    better = top > value[near]
    value[near[better]], local[near[better]] = top[better], when[better]


def _stated(rows: PieceRows, order: int, sign: float) -> tuple[Array, Array]:
    """Return what rows, or their differences, state of a derivative, and what of it is certain."""
    stated = certain = np.full(rows.length.shape, -np.inf)
    if order < len(rows.ends):
        stated = (sign * rows.ends[order]).max(axis=0)
        certain = stated - rows.errors[order]
    if 0 < order <= len(rows.ends):
        slope, least = rows.difference(order - 1)[0], rows.certain_difference(order - 1, sign)
        stated = np.where(least > certain, sign * slope, stated)
        certain = np.maximum(certain, least)
    return stated, certain


def _judge_approaches(run: JudgedRun) -> None:
    """Add where joints move faster towards the end of their range than their distance from there allows."""
    from trajcli.curves.approach import uses_of_pieces

    window, pieces, limits = run.window, run.pieces, run.robot.limits
    if int(window.highest[pieces].max(initial=0)) < 1:
        return
    used, times = uses_of_pieces(window.coefficients[:, pieces], window.lengths[pieces], limits.approach, 1.0)
    over = np.nonzero(exceeds(used, 1.0))
    levels = window.highest[pieces][over[0]]
    for level in set(levels.tolist()):  # what rounding makes of pieces depends on their degree
        found = tuple(index[levels == level] for index in over)
        _add_approaches(run, found, (times[found], used[found]), level)


def _add_approaches(
    run: JudgedRun, found: tuple[NDArray[np.intp], ...], at: tuple[Array, Array], level: int
) -> None:
    """Add those of pieces of one degree, which determine derivatives up to a level."""
    window, fast = run.window, _fast_approaches(run, found, at)
    by_curve, rounding = fast.certain, fast.rounding
    excess, warned = np.abs(fast.speed) - np.abs(fast.bound), np.zeros_like(fast.certain)
    if not run.asked:
        explained = explained_by_law(window, fast.piece, fast.joint, 1, level)
        warned = by_curve & (excess <= explained + rounding)
    for end in (np.zeros_like(fast.local), window.lengths[fast.piece]):
        stated = _fast_approaches(run, found, (end, fast.used), of_rows=True)
        warned &= ~stated.certain
        worse = ~fast.certain | (stated.used > fast.used)
        fast = fast.replaced(stated, stated.certain & ~by_curve & worse)
    certain = fast.certain
    make = partial(fast.finding, run)
    found_at = fast.piece, fast.joint
    run.add("velocity_by_position", found_at, fast.used, make, certain, warned)


@frozen
class _FastApproaches:
    """Where joints approach the ends of their ranges too fast, m of them.

    Attributes:
        piece: Index of each, shape (m,).
        joint: Index of its joint.
        local: Seconds from the start of the piece.
        distance: To the end of the range, SI.
        speed: Signed, SI.
        bound: On it, with its sign.
        rounding: By how much the speed may be off beside its bound.
        used: Share of the bound.
    """

    piece: NDArray[np.intp]
    joint: NDArray[np.intp]
    local: Array
    distance: Array
    speed: Array
    bound: Array
    rounding: Array
    used: Array

    @property
    def certain(self) -> NDArray[np.bool_]:
        """Which of them rounding does not explain."""
        towards = np.where(np.signbit(self.bound), -self.speed, self.speed)
        return np.asarray(towards - np.abs(self.bound) > self.rounding)

    def replaced(self, other: _FastApproaches, where: NDArray[np.bool_]) -> _FastApproaches:
        """Return the same with those of others in some places."""
        every = {name: np.where(where, getattr(other, name), own) for name, own in vars(self).items()}
        return _FastApproaches(**every)

    def finding(self, run: JudgedRun, k: int) -> Finding:
        from trajcli.curves.approach import ApproachUse
        from trajcli.limits.velocity_by_position import approach_excess

        piece, joint, local = int(self.piece[k]), int(self.joint[k]), float(self.local[k])
        rates = float(self.used[k]), float(self.speed[k]), float(self.bound[k])
        time = float(run.window.t[piece]) + local
        found = approach_excess(run.robot, ApproachUse(joint, *rates, float(self.distance[k]), time))
        return replace(found, row=run.window.row_at(piece, local), rounding=float(self.rounding[k]))


def _fast_approaches(
    run: JudgedRun, found: tuple[NDArray[np.intp], ...], at: tuple[Array, Array], *, of_rows: bool = False
) -> _FastApproaches:
    """Return the states in which limits are used most, from indices of uses, their times and sizes.

    With `of_rows` these are rows, whose own rounding counts where they state velocities.
    """
    from trajcli.curves.approach import ROOM, allowed_speed

    window, pieces, limits = run.window, run.pieces, run.robot.limits
    limited, (piece, column), (local, used) = limits.approach.limited, found, at
    joint, piece = limited[column % limited.size], piece + pieces.start
    chosen = window.coefficients[:, piece, joint]
    position, speed = horner(chosen, local), horner(derivative_coefficients(chosen, 1), local)
    rows = window.piece_rows(piece, joint, int(window.highest[piece[0]]))
    upwards = column < limited.size
    low, high = limits.position[joint].T
    distance = np.where(upwards, high - position, position - low)
    d, o = limits.approach.deceleration[joint], limits.approach.offset[joint]
    own = of_rows and len(rows.ends) > 1 and not rows.spline
    errors = rows.errors[:2] if own else (rows.error(0), rows.error(1))
    bound, roomy = (allowed_speed(distance + more, d, o) - ROOM for more in (0.0, errors[0]))
    bound = np.where(bound > ROOM, bound, 0.0)
    sign = np.where(upwards, 1.0, -1.0)
    rounding = errors[1] + np.maximum(roomy - bound, 0.0)
    if of_rows:
        with np.errstate(divide="ignore", invalid="ignore"):
            used = np.abs(speed) / bound
    return _FastApproaches(piece, joint, local, distance, speed, sign * bound, rounding, used)
