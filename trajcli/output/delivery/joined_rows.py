"""Rows of a plan as their consumer joins them: whether that curve keeps the limits that the plan keeps.

Between two rows stands the polynomial that their columns determine. Where the planned curve is no more than
that polynomial itself, of its degree and without a break inside, both are one curve, and no row is read. The
other intervals are judged by what `trajcli check` judges recorded rows by.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trajcli.columns import Group, joint_factors
from trajcli.curves.extrema import Peaks, piece_extremes
from trajcli.curves.piecewise import Array, PiecewisePolynomial, derivative_coefficients, horner
from trajcli.findings import Collector, Finding, at_time
from trajcli.frozen import frozen
from trajcli.grids import AT_BREAK, NANOSECOND, Grid, KnotGrid, ListedGrid, UniformGrid
from trajcli.judge.judgement import Judgement, as_planned
from trajcli.judge.reconstruction import Interpolation, chosen_interpolation
from trajcli.kinematics.robot import QUANTITIES, Robot, ToolLimits
from trajcli.limits.tolerances import JOINED_RELATIVE
from trajcli.planners.planner import PlannedMove
from trajcli.planning.plan import Plan
from trajcli.planning.planned_move import path_of_tool
from trajcli.samples import sample

if TYPE_CHECKING:
    from trajcli.judge.intervals import JoinedPairs
    from trajcli.judge.joint_limits import JudgedRun
    from trajcli.judge.motion import Requirements
    from trajcli.judge.recorded_tool import ToolJudge

_ROWS = 65536  # whose times are looked at together
_PIECES = 8192  # whose ends are looked at together
_JUDGED = 1024  # intervals that are judged together
_DEGREES = {"linear": 1, "cubic": 3, "quintic": 5}
_SPACING = 4.0  # units in the last place of a length
_CONTINUOUS = 1e-9  # of the smaller size of a derivative in two pieces: a step below that is none
_ROUNDING = 1e-13  # of the larger one
_PERIOD = 1e-9  # relative: what the last row may be off its grid by
_HALF_UNIT = 0.5e-9  # of nine decimals
_NEGLIGIBLE = 2e-7  # relative: what is above a limit between rows by less needs no look
_MOVED = 1e-13  # rad or m
_OF_ROUNDING = {"linear": (1.0,), "cubic": (1.5, 6.0), "quintic": (1.875, 10 / 3**0.5, 60.0)}
_STATES: tuple[Group, ...] = ("q", "qd", "qdd")
_OF_POSES: tuple[Group, ...] = ("pose", "twist", "twistd")  # from which the joints are found back
_OF_A_TOOL = 6  # joints whose rates those of the tool tell


@frozen
class JoinedRows:
    """Rows of a plan that a consumer joins.

    Attributes:
        plan: A plan that verifies.
        grid: Where its rows stand.
        groups: Its columns.
        exact: Whether the numbers are written with every bit.
    """

    plan: Plan
    grid: Grid
    groups: tuple[Group, ...]
    exact: bool = False

    @property
    def interpolation(self) -> Interpolation | None:
        """How the columns join the rows; None where no positions or poses with times are among them."""
        of_poses = _OF_POSES[: 3 if len(self.plan.trajectory.joint_names) <= _OF_A_TOOL else 1]
        wanted = _STATES if set(_STATES) & set(self.groups) else of_poses
        there = [group in self.groups for group in wanted]
        if "t" not in self.groups or not there[0]:
            return None
        return chosen_interpolation(None, *[*there, False, False][1:3])

    @property
    def judged_orders(self) -> int:
        """How many derivatives of the joined curve are judged: what steps from row to row has no next one."""
        chosen = self.interpolation
        return 0 if chosen is None else (_DEGREES[chosen] + 1) // 2

    def judgement(
        self, *, first_only: bool = False, worst_only: bool = False, slack: float = JOINED_RELATIVE
    ) -> Judgement | None:
        """Return what the joined curve does against the limits; None where nothing says how it is joined.

        Args:
            first_only: Whether one group of intervals that is over a limit is enough.
            worst_only: Whether of each kind and joint the worst finding among moves of the same limits is
                enough; so it is with the first group.
            slack: Relative: what the joined curve may be above a limit.

        Raises:
            InputError: When efforts are limited, and a link of the arm has no inertia.
        """
        chosen, plan = self.interpolation, self.plan
        if chosen is None:
            return None
        tool, worst = _tool_of(plan), _Collectors(first_only or worst_only)
        begun = Judgement((), chosen, self.grid.count, planned_rows=True)
        for window in self._windows(chosen):
            from trajcli.judge.joint_limits import judge_limits

            for run in self._runs(window, worst):
                judge_limits(run)
                if run.limits_efforts:
                    from trajcli.judge.recorded_efforts import judge_efforts

                    judge_efforts(run)
            if tool is not None:
                self._see_tool(tool, window)
            if first_only and self._judgement(begun, worst, tool, slack).findings:
                break
        return self._judgement(begun, worst, tool, slack)

    def _judgement(
        self, begun: Judgement, worst: _Collectors, tool: ToolJudge | None, slack: float
    ) -> Judgement:
        findings = (*worst.findings(), *(() if tool is None else tool.findings()))
        return as_planned(replace(begun, findings=tuple(map(self._in_time, findings))), slack)

    def _runs(self, window: JoinedPairs, worst: _Collectors) -> Iterator[JudgedRun]:
        """Yield the pieces of moves, of neighbours with equal limits at once."""
        from trajcli.judge.joint_limits import JudgedRun

        required = self._requirements
        runs = [
            (required.robot_between(*moves), required.carries_one(*moves), low, high)
            for moves, low, high in window.runs()
        ]
        first = 0
        for k, (robot, carries_one, _, high) in enumerate(runs):
            if k + 1 == len(runs) or runs[k + 1][0] is not robot:  # of one robot, whose payload is one
                pieces = slice(runs[first][2], high)
                yield JudgedRun(window, pieces, robot, worst.of(robot), True, carries_one)
                first = k + 1

    def _see_tool(self, tool: ToolJudge, window: JoinedPairs) -> None:
        """Judge the tool in the pieces of each move."""
        spans = self.plan.trajectory.spans
        for (before, after), low, high in window.runs():
            since = window.begun[low:high] - spans[self._numbers[before]].start
            robot = self._requirements.robot_between(before, after)
            tool.see(window, slice(low, high), robot, before, since=since)

    @cached_property
    def _numbers(self) -> Mapping[int, int]:
        """Of moves, counted from 0, by their index."""
        return {move.index: number for number, move in enumerate(self.plan.moves)}

    @cached_property
    def _requirements(self) -> Requirements:
        from trajcli.judge.motion import Requirements

        plan = self.plan
        moves = zip(plan.moves, plan.verdict.peaks, strict=True)
        return Requirements(plan.loaded.robot, {move.index: _allowed(move, peaks) for move, peaks in moves})

    @cached_property
    def same_curve(self) -> bool:
        """Whether the joined curve is the planned one itself, by its degree and its breaks."""
        chosen = self.interpolation
        blocks = () if chosen is None else self._blocks(_DEGREES[chosen])
        return chosen is not None and not any(self._unproven(t, _DEGREES[chosen]).size for t, _ in blocks)

    def rounding(self) -> float:
        """Return which share of a limit nine decimals alone may make up, between the nearest two rows.

        A position that is off by e at one end of a quintic of length h makes a jerk of 60 e / h^3, an
        acceleration of 10 e / (sqrt(3) h^2) and a velocity of 15 e / (8 h); of a cubic it is 6 e / h^2 and
        3 e / (2 h).
        """
        chosen, plan = self.interpolation, self.plan
        if chosen is None or self.grid.count == 1:
            return 0.0
        length = self._shortest()
        factors = joint_factors(plan.trajectory.joint_types, plan.loaded.output_units)
        unit = 2 * _HALF_UNIT * np.asarray(factors) / length ** np.arange(1, 4)[:, None]
        noise = unit[: len(_OF_ROUNDING[chosen])] * np.array(_OF_ROUNDING[chosen])[:, None]
        limits = [[np.abs(m.robot.limits.of_order(k)).min(axis=1) for k in (1, 2, 3)] for m in plan.moves]
        least = np.min(limits, axis=0)[: len(noise)]
        return float((noise / least).max(initial=0.0))

    def uses(self) -> Iterator[tuple[float, int, int, int]]:
        """Yield what the planned curve and the joined one use at most of limits of joints.

        Yields:
            Which share, of which derivative, 1 to 3, which joint, and the index of the move.
        """
        for move, peaks in zip(self.plan.moves, self.plan.verdict.peaks, strict=True):
            yield from _shares(move.robot, [(each.low, each.high) for each in peaks[1:4]], move.index)
        chosen = self.interpolation
        for window in () if chosen is None else self._windows(chosen):
            required = self._requirements
            extremes = piece_extremes(window.coefficients, window.lengths, (1, 2, 3))
            for (before, after), first, last in window.runs():
                robot = required.robot_between(before, after)
                part = [(low[first:last].min(axis=0), high[first:last].max(axis=0)) for low, high in extremes]
                yield from _shares(robot, part, before)

    def _in_time(self, finding: Finding) -> Finding:
        """Return a finding about intervals one behind the other with the time of its row."""
        grid, row = self.grid, (finding.row or 1) - 1
        if isinstance(grid, UniformGrid):
            time = min(row / grid.rate, grid.duration) + grid.start_time
        else:
            time = float(next(grid.blocks(grid.count))[0][row])
        message = finding.message.replace(at_time(finding.time or 0.0), at_time(time))
        return replace(finding, time=time, message=message)

    def _windows(self, chosen: Interpolation) -> Iterator[JoinedPairs]:
        """Yield the intervals in which the joined curve may be another than the planned one, many at once."""
        kept: list[tuple[Array, NDArray[np.int64]]] = []
        count = 0
        for times, first in self._blocks(_DEGREES[chosen]):
            index = self._unproven(times, _DEGREES[chosen])
            for low in range(0, index.size, _JUDGED):
                part = index[low : low + _JUDGED]
                kept.append((np.stack([times[part], times[part + 1]]), part + first))
                count += part.size
                if count >= _JUDGED:
                    yield self._pairs(kept, chosen)
                    kept, count = [], 0
        if kept:
            yield self._pairs(kept, chosen)

    def _shortest(self) -> float:
        """Return the shortest distance of two rows, s."""
        grid = self.grid
        if isinstance(grid, UniformGrid):
            last = grid.local(grid.count - 2, grid.count)
            return float(last[1] - last[0])  # no other is shorter
        return float(np.diff(np.concatenate([local for _, local in grid.blocks(_ROWS)])).min())

    def _blocks(self, degree: int) -> Iterator[tuple[Array, int]]:
        """Yield times of rows from the start, with the last one before them, and the index of the first.

        Of rows of one rate, which may be very many, only blocks in which an interval may be unproven.
        """
        if isinstance(self.grid, UniformGrid):
            for number in self._unproven_blocks(self.grid, degree):
                low = max(number * _ROWS - 1, 0)
                yield self.grid.local(low, (number + 1) * _ROWS), low
            return
        before, first = np.empty(0), 0
        for _, local in self.grid.blocks(_ROWS):
            times = np.append(before, local)
            yield times, first - before.size
            before, first = local[-1:], first + local.size

    def _unproven_blocks(self, grid: UniformGrid, degree: int) -> Iterator[int]:
        """Yield the blocks of rows about breaks, and on pieces that are no curve of the rows, rising."""
        breaks, count = self.plan.trajectory.curve.breaks, grid.count
        other = np.flatnonzero(self._others(degree))
        begins, ends = np.append(breaks, breaks[other]), np.append(breaks, breaks[other + 1])
        first = np.clip(np.floor(begins * grid.rate), 0, count - 1).astype(np.intp) // _ROWS
        last = np.clip(np.floor(ends * grid.rate) + 3, 0, count - 1).astype(np.intp) // _ROWS
        opened, closed = (np.bincount(each, minlength=(count - 1) // _ROWS + 1) for each in (first, last))
        yield from np.flatnonzero(np.cumsum(opened) - np.cumsum(closed) + closed).tolist()

    def _unproven(self, times: Array, degree: int) -> NDArray[np.int64]:
        """Return the intervals in which the curve is not what their rows determine, rising indices."""
        curve, count = self.plan.trajectory.curve, times.size - 1
        near = max(AT_BREAK, _SPACING * float(np.spacing(curve.end)))
        found = np.zeros(count + 2, dtype=bool)
        low, high = np.searchsorted(curve.breaks, (times[0] - near, times[-1] + near))
        inside = curve.breaks[low:high]
        after = np.searchsorted(times, inside - near)  # the first row that is not before it
        off: Array = np.abs(times[np.minimum(after, count)] - inside)
        on_row = off <= near
        found[after[np.logical_not(on_row)]] = True  # the interval before the row `after`, counted from 1
        steps: NDArray[np.bool_] = self._steps(degree)[low:high]
        at = after[np.logical_and(on_row, steps)]
        found[at] = found[at + 1] = True
        other = self._others(degree)
        for piece in np.flatnonzero(other[max(low - 1, 0) : high]) + max(low - 1, 0):
            ends = np.searchsorted(times, curve.breaks[piece : piece + 2])
            found[ends[0] : ends[1] + 1] = True
        low, high = np.searchsorted(self._moved, (times[0] - NANOSECOND, times[-1] + NANOSECOND))
        at = np.searchsorted(times, self._moved[low:high] - NANOSECOND)
        found[at] = found[at + 1] = True
        return np.flatnonzero(found[1 : count + 1])

    def _others(self, degree: int) -> NDArray[np.bool_]:
        """Return which pieces are not of the degree of the joined curve, nor as near to one as counts."""
        if degree not in self._others_of_degree:
            self._others_of_degree[degree] = self._pieces_of_others(degree)
        return self._others_of_degree[degree]

    @cached_property
    def _others_of_degree(self) -> dict[int, NDArray[np.bool_]]:
        return {}

    def _pieces_of_others(self, degree: int) -> NDArray[np.bool_]:
        curve = self.plan.trajectory.curve
        other: NDArray[np.bool_] = np.any(curve.coefficients[: -(degree + 1)], axis=(0, 2))
        if degree > 1 and isinstance(self.grid, UniformGrid) and other.any():
            from trajcli.output.delivery.period_bound import pieces_within

            within = pieces_within(self.plan, 1 / self.grid.rate, (degree + 1) // 2, _NEGLIGIBLE)
            other = np.logical_and(other, np.logical_not(within))
        return other

    @cached_property
    def _moved(self) -> Array:
        """Times at which rows may state what the curve does not, rising.

        Knots behind steps of the acceleration state another position, rows near short pieces other rates.
        """
        grid, curve = self.grid, self.plan.trajectory.curve
        short = curve.breaks[:-1][curve.lengths <= NANOSECOND]
        if not isinstance(grid, KnotGrid):
            return short
        times = grid.local[grid.at]
        off = np.abs(grid.states[0] - curve.evaluate(np.minimum(times + curve.start, curve.end)))
        return np.sort(np.append(times[(off > _MOVED).any(axis=1)], short))

    def _steps(self, degree: int) -> NDArray[np.bool_]:
        """Return at which breaks a derivative steps that the rows state, shape (pieces + 1,)."""
        return self._steps_of_order[degree // 2]

    @cached_property
    def _steps_of_order(self) -> tuple[NDArray[np.bool_], ...]:
        curve = self.plan.trajectory.curve
        steps = [np.zeros(curve.pieces + 1, dtype=bool)]
        for order in (1, 2):
            steps.append(steps[-1] | _stepping(curve, order))
        return tuple(steps)

    def _pairs(self, kept: list[tuple[Array, NDArray[np.int64]]], chosen: Interpolation) -> JoinedPairs:
        """Return the rows before and after intervals as a window in which all are judged."""
        from trajcli.judge.intervals import JoinedPairs
        from trajcli.streams.recorded_motion import Resolution

        ends, index = (np.concatenate([part[k] for part in kept], axis=-1) for k in (0, 1))
        times, where = np.unique(ends, return_inverse=True)
        rows = self._rows(times, np.unique(np.stack([index, index + 1])), (_DEGREES[chosen] + 1) // 2)
        where = where.reshape(2, -1)
        lengths = ends[1] - ends[0]
        if isinstance(self.grid, UniformGrid):
            period = 1.0 / self.grid.rate
            lengths = np.where(np.abs(lengths - period) <= _PERIOD * period, period, lengths)
        joints = len(self.plan.trajectory.joint_names)
        states = rows[:, :-1].reshape(len(rows), -1, joints)[where]
        moves = rows[:, -1].astype(np.int64)[where]
        factors = joint_factors(self.plan.trajectory.joint_types, self.plan.loaded.output_units)
        rounding = np.zeros(joints) if self.exact else _HALF_UNIT * np.asarray(factors)
        return JoinedPairs(
            t=np.append(0.0, np.cumsum(lengths)),
            lengths=lengths,
            late=_SPACING * np.spacing(lengths),
            states=tuple(
                np.concatenate([states[0, :, k], states[1, -1:, k]]) if k < states.shape[2] else None
                for k in range(3)
            ),
            rows=index + 1,
            moves=moves[0],
            interpolation=chosen,
            resolution=Resolution(0.0, rounding, rounding, rounding),
            first=0,
            last=lengths.size,
            ends=False,
            stated=states.transpose(2, 0, 1, 3),
            moves_after=moves[1],
            begun=ends[0],
        )

    def _rows(self, times: Array, index: NDArray[np.int64], stated: int) -> Array:
        """Return states and moves of some rows, SI, shape (N, stated n + 1)."""
        plan, grid = self.plan, self.grid
        part: Grid = ListedGrid(plan.trajectory.duration, times)
        if isinstance(grid, KnotGrid):
            _, at, of_knot = np.intersect1d(index, grid.at, assume_unique=True, return_indices=True)
            part = KnotGrid(grid.duration, times, at, grid.states[:, of_knot])
        groups = (*_STATES[:stated], "move")
        return np.concatenate([*sample(plan.trajectory, part, groups, robot=plan.loaded.robot)])


class _Collectors:
    """Collectors of findings: one of all moves, or where the worst will do one for each of their limits."""

    def __init__(self, together: bool) -> None:
        self.together = together
        self._all = Collector()
        self._of_robots: dict[int, tuple[Robot, Collector]] = {}

    def of(self, robot: Robot) -> Collector:
        if not self.together:
            return self._all
        return self._of_robots.setdefault(id(robot), (robot, Collector(by_move=False)))[1]

    def findings(self) -> Iterator[Finding]:
        for collector in (self._all, *(one for _, one in self._of_robots.values())):
            yield from collector.findings()


def _stepping(curve: PiecewisePolynomial, order: int) -> NDArray[np.bool_]:
    """Return at which breaks a derivative steps by more than rounding, shape (pieces + 1,).

    Rounding is measured by the pieces on both sides: others may be short, and immense.
    """
    steps = np.zeros(curve.pieces + 1, dtype=bool)
    for low in range(0, curve.pieces, _PIECES):
        block = slice(low, low + _PIECES + 1)
        first, last = curve.piece_ends(order, block)
        terms = np.abs(derivative_coefficients(curve.coefficients[:, block], order))
        sizes = horner(terms, curve.lengths[block, None])
        near = _CONTINUOUS * np.minimum(sizes[1:], sizes[:-1]) + _ROUNDING * np.maximum(sizes[1:], sizes[:-1])
        steps[low + 1 : low + len(first)] = (np.abs(first[1:] - last[:-1]) > near).any(axis=1)
    return steps


def _allowed(move: PlannedMove, peaks: Sequence[Peaks]) -> Robot:
    """Return the robot of a move, of one that brakes with what its start outside of the limits leads to."""
    if move.planned.braking is None:
        return move.robot
    limits: dict[str, Any] = {}
    for order in (1, 2):
        low, high = move.robot.limits.of_order(order).T
        bounds = np.minimum(low, peaks[order].low), np.maximum(high, peaks[order].high)
        limits[QUANTITIES[order]] = np.stack(bounds, axis=1)
    return replace(move.robot, limits=replace(move.robot.limits, **limits))


def _shares(
    robot: Robot, extremes: Sequence[tuple[Array, Array]], move: int
) -> Iterator[tuple[float, int, int, int]]:
    """Yield for each derivative from the first on the largest share of a limit, and whose it is."""
    for order, (low, high) in enumerate(extremes, 1):
        bounds = robot.limits.of_order(order)
        used = np.maximum(low / bounds[:, 0], high / bounds[:, 1])
        joint = int(used.argmax())
        yield float(used[joint]), order, joint, move


def _tool_of(plan: Plan) -> ToolJudge | None:
    """Return the judge of the limits of the tool, and of its paths, where there are any."""
    robots = {id(move.robot): move.robot for move in plan.moves}.values()
    limited = any(robot.limits.tcp != ToolLimits() for robot in robots)
    if not limited and not any(map(path_of_tool, plan.moves)):
        return None
    from trajcli.judge.recorded_tool import judge_of_moves

    return judge_of_moves(plan.loaded.robot, plan.moves)
