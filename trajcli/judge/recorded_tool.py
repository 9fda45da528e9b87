"""Tool of an arm over recorded rows: its limits, its path, and nearness to singularities."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.node_bound import NODES_DEGREE, at_nodes
from trajcli.curves.piecewise import Array, derivative_coefficients, horner
from trajcli.findings import Collector, Finding, FindingMethod, at_time
from trajcli.frozen import frozen
from trajcli.geometry.rotation import log
from trajcli.judge.intervals import DENSE, Intervals, largest_first
from trajcli.judge.rounding import PieceRows
from trajcli.judge.tool_path import RecordedPath
from trajcli.kinematics.dexterity import characteristic_length
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.joint_turns import revolute
from trajcli.kinematics.jacobian import jacobian, jacobian_dot_qd
from trajcli.kinematics.robot import Robot
from trajcli.kinematics.tool_derivatives import tool_derivatives
from trajcli.limits.kinds import TOOL_KINDS, LimitKind
from trajcli.limits.tolerances import TOOL_RELATIVE
from trajcli.limits.tool import limits_tool, tool_excess, tool_peaks
from trajcli.limits.tool_bound import ToolPeak

if TYPE_CHECKING:
    from trajcli.planners.planner import PlannedMove

_PIECES = 2048  # at a time: nine configurations of each are looked at
_TURN = 0.05  # rad or m that a joint moves between the rows at which nearness to a singularity is looked at
_NEAR_SINGULAR = (
    1e-3  # smallest over largest singular value: a joint turns a thousand times as fast as the tool
)
_TWICE = 2.0  # times a limit: no interpolation of dense rows that keep it goes so far beyond
_CLOSE = 1e-6  # relative: what the slack of checks leaves of a chord
_SAME_STEP = 4.0  # times the steps beside it: more is a jump of the tool
_MEET = 1e-9  # of the shortest piece: as near to where two meet, either may have a peak
_STEP = 1e-6  # m or rad: a step of the tool that is none


def judge_of_moves(robot: Robot, moves: Sequence[PlannedMove]) -> ToolJudge:
    """Return what judges the tool of an arm in moves of a job, each along its path outside of zones."""
    from trajcli.planning.planned_move import path_of_tool

    return ToolJudge(robot, {move.index: path_of_tool(move) for move in moves}, moves)


@frozen
class _Excess:
    """A derivative of the tool over its limit.

    Attributes:
        piece: Where it is.
        local: Seconds from the start of the piece.
        value: SI.
        rounding: By how much it may be off, SI.
        method: Of the finding.
    """

    piece: int
    local: float
    value: float
    rounding: float
    method: FindingMethod = "bounded"


class ToolJudge:
    """What is judged of the tool.

    Attributes:
        notes: What could not be judged.
    """

    def __init__(
        self,
        robot: Robot,
        paths: Mapping[int, ToolMotion | None] | None = None,
        moves: Iterable[PlannedMove] = (),
    ) -> None:
        """Begin with no rows.

        Args:
            robot: An arm with geometry.
            paths: By move, where its tool shall go; None for a move in joint space. None without a job.
            moves: With the tools that are then on the flange, and zones; the first tool where left out.
        """
        self._robot, self._paths = robot, paths
        self._length = characteristic_length(robot)
        self._recorded: dict[int, RecordedPath] = {}
        self._worst = Collector()
        self._moved, self._seen = 0.0, -1
        self.notes: list[str] = []
        by_index = {move.index: move for move in moves}
        for move, motion in (paths or {}).items():
            if motion is not None and (motion.path is None or motion.overlaps):
                self.notes.append(f"move {move}: its segments overlap, the distance from them is not judged")
            elif motion is not None:
                arm, parts = (
                    (by_index[move].robot, by_index[move].planned.parts) if move in by_index else (robot, ())
                )
                self._recorded[move] = RecordedPath(arm, motion, move, self._worst, parts)

    def see(
        self,
        window: Intervals,
        pieces: slice,
        robot: Robot,
        move: int,
        *,
        asked: bool = True,
        since: Array | None = None,
    ) -> None:
        """Judge the tool in the pieces of one move.

        Args:
            window: The rows.
            pieces: Which ones.
            robot: The arm with the limits in force.
            move: Its index, -1 for none.
            asked: Whether somebody asked for the curve between the rows.
            since: Where the rows are those of a planned motion, and the pieces need not be neighbours: when
                each begins, s from the start of the move, shape (pieces,).
        """
        if limits_tool(robot) and int(window.highest[pieces].max(initial=0)) > 0:
            for low in range(pieces.start, pieces.stop, _PIECES):
                some = slice(low, min(low + _PIECES, pieces.stop))
                self._judge_limits(window, some, robot, move, asked=asked)
        path = self._recorded.get(move)
        if path is not None and since is not None:
            path.see_between(window, pieces, since)
        elif path is not None:
            path.see(window, pieces, asked=asked)
        if since is None and (self._paths is None or path is not None):
            self._judge_singularity(window, pieces, robot, move)

    def findings(self) -> Iterator[Finding]:
        """Return what was found."""
        return self._worst.findings()

    def changes_branch(self, q: Array, jump: int) -> bool:
        """Return whether the tool goes on smoothly where joints jump.

        Args:
            q: Rows (N, n) around, rad or m.
            jump: Index of the row before the jump.
        """
        poses = forward(self._robot, q)
        poses[:, :3, 3] /= self._length
        steps = np.linalg.norm(np.diff(poses, axis=0), axis=(1, 2))
        others = np.delete(steps, jump)
        return bool(steps[jump] <= _SAME_STEP * others.max(initial=0.0) + _STEP)

    def _judge_limits(
        self, window: Intervals, pieces: slice, robot: Robot, move: int, *, asked: bool
    ) -> None:
        levels, surveys = window.highest[pieces], dict[int, tuple[Array, Mapping[str, ToolPeak]]]()
        for kind in (kind for kind in TOOL_KINDS if kind.stated(robot.limits)):
            limit, order = float(getattr(robot.limits.tcp, kind.key)), kind.order or 1
            chosen = np.flatnonzero(levels >= order) + pieces.start  # points may state more than others
            if chosen.size and chosen.size not in surveys:
                breaks = np.append(0.0, np.cumsum(window.lengths[chosen]))  # stamps of some years are coarse
                surveys[chosen.size] = breaks, tool_peaks(robot, breaks, window.coefficients[:, chosen])
            if not chosen.size or kind.key not in surveys[chosen.size][1]:
                continue
            breaks, peak = surveys[chosen.size][0], surveys[chosen.size][1][kind.key]
            if peak.upper_bound <= limit * (1 + TOOL_RELATIVE):
                continue
            piece, local = self._piece_at(window, chosen, robot, kind, breaks, peak.time)
            (rounding,) = self._roundings(window, np.array([piece]), np.array([local]), kind).tolist()
            found = _Excess(piece, local, peak.upper_bound, rounding)
            certain = found.value - limit > rounding
            slack = limit * (1 + _CLOSE) + rounding
            between = certain and not asked and found.value <= _TWICE * limit
            warned = between and self._only_between(window, pieces, robot, kind, slack)
            if not certain or warned:  # rounding, or dense rows, explain the largest: not what is elsewhere
                other = self._curve_over(window, pieces, robot, kind, limit, asked=asked)
                other = other or self._stated_over(window, pieces, robot, kind, limit)
                if other is not None:
                    found, certain, warned = other, True, False
            self._note(window, pieces, robot, kind, limit, move, found, certain=certain, warned=warned)

    def _note(
        self,
        window: Intervals,
        pieces: slice,
        robot: Robot,
        kind: LimitKind,
        limit: float,
        move: int,
        found: _Excess,
        *,
        certain: bool,
        warned: bool,
    ) -> None:
        count = max(self._over(window, pieces, robot, kind, limit), 1)
        time, row = float(window.t[found.piece]) + found.local, window.row_at(found.piece, found.local)
        excess = tool_excess(kind, found.value, limit, time)
        finding = replace(excess, row=row, rounding=found.rounding, method=found.method)
        self._worst.add(
            kind.name,
            move,
            np.full(count, -1),
            np.full(count, found.value / limit),
            lambda _: finding,
            severity="warning" if warned else "error",
            certainty="exceeded" if certain else "within rounding",
        )

    def _curve_over(
        self, window: Intervals, pieces: slice, robot: Robot, kind: LimitKind, limit: float, *, asked: bool
    ) -> _Excess | None:
        """Return the largest derivative that rounding does not explain, nor that rows are dense."""
        order, angular = kind.order or 1, kind.dimension == "angle"
        coefficients, lengths = window.coefficients[:, pieces], window.lengths[pieces]
        rates = at_nodes(coefficients, lengths, order)
        vectors = tool_derivatives(robot, rates).reshape(*rates[0].shape[:2], 2 * order, 3)
        sizes = np.linalg.norm(vectors[:, :, 2 * order - 2 + angular], axis=2)
        reached, local = sizes.max(axis=1), sizes.argmax(axis=1) * lengths / NODES_DEGREE
        over = (reached > limit * (1 + TOOL_RELATIVE)) & (window.highest[pieces] >= order)
        if not asked:
            over &= (lengths > DENSE) | (reached > _TWICE * limit)
        for some in largest_first(reached, over):
            roundings = self._roundings(window, some + pieces.start, local[some], kind)
            certain = np.flatnonzero(reached[some] - limit > roundings)
            if certain.size:
                at, rounding = int(some[certain[0]]), float(roundings[certain[0]])
                whole = np.array([0.0, lengths[at]])
                peak = tool_peaks(robot, whole, coefficients[:, [at]])[kind.key]
                return _Excess(at + pieces.start, peak.time, peak.upper_bound, rounding)
        return None

    def _stated_over(
        self, window: Intervals, pieces: slice, robot: Robot, kind: LimitKind, limit: float
    ) -> _Excess | None:
        """Return the largest mean between two rows that is over a limit by more than rounding explains."""
        order, numbers, worst = kind.order or 1, np.arange(pieces.start, pieces.stop), None
        for chosen, rows in window.rows_by_level(numbers):
            if len(rows.ends) < order:
                continue
            length, late = (each.reshape(chosen.size, -1)[:, 0] for each in (rows.length, rows.late))
            change, off = self._change(rows, robot, kind)
            mean, least = change / length, (change - off) / (length + late)
            mean = np.where(least > limit * (1 + _CLOSE), mean, -np.inf)
            at = int(mean.argmax())
            if mean[at] > (limit if worst is None else worst.value):
                rounding = float(mean[at] - least[at])
                worst = _Excess(
                    int(numbers[chosen[at]]), float(length[at]) / 2, float(mean[at]), rounding, "sampled"
                )
        return worst

    def _change(self, rows: PieceRows, robot: Robot, kind: LimitKind) -> tuple[Array, Array]:
        """Return how the derivative below a limited one changes between two rows, and its error, (m,)."""
        order, angular = kind.order or 1, kind.dimension == "angle"
        arm, turns = self._lever(kind)
        q, *rates = (both.reshape(2, -1, turns.size) for both in rows.ends[:order])
        errors = [np.reshape(each, (-1, turns.size)) @ turns for each in rows.errors[:order]]
        if order == 1:
            first, last = forward(robot, q)
            turned = np.swapaxes(first[:, :3, :3], 1, 2) @ last[:, :3, :3]
            change = log(turned) if angular else last[:, :3, 3] - first[:, :3, 3]
            off = errors[0]
        else:
            below = tool_derivatives(robot, (q, *rates))[..., order - 2, int(angular), :]
            change = below[1] - below[0]
            sizes = [(np.abs(each) @ turns).max(axis=0) for each in rates]
            off = errors[1] + errors[0] * sizes[0]
            if order == 3:
                off = errors[2] + 2.0 * sizes[0] * errors[1] + errors[0] * (sizes[1] + sizes[0] ** 2)
        return np.linalg.norm(change, axis=1), 2.0 * arm * off

    def _lever(self, kind: LimitKind) -> tuple[float, Array]:
        """Return how far the tool goes when a joint turns by 1, and as what turns joints count, shape (n,).

        What a slide moves by counts as a turn of the arm that moves its end as far; it turns nothing itself.
        """
        angular = kind.dimension == "angle"
        arm = 1.0 if angular else self._length
        return arm, np.where(revolute(self._robot), 1.0, 0.0 if angular else 1.0 / arm)

    @staticmethod
    def _piece_at(
        window: Intervals, pieces: NDArray[np.intp], robot: Robot, kind: LimitKind, breaks: Array, time: float
    ) -> tuple[int, float]:
        """Return which piece has its peak at a time, and when in it; of two that meet the higher one."""
        near = _MEET * float(window.lengths[pieces].min())
        found = np.searchsorted(breaks, [time - near, time + near], "right") - 1
        before, after = np.clip(found, 0, breaks.size - 2).tolist()
        if before != after:
            high, other = (
                tool_peaks(robot, breaks[k : k + 2], window.coefficients[:, pieces[[k]]])
                for k in (before, after)
            )
            after = before if high[kind.key].upper_bound > other[kind.key].upper_bound else after
        return int(pieces[after]), time - float(breaks[after])

    def _only_between(
        self, window: Intervals, pieces: slice, robot: Robot, kind: LimitKind, slack: float
    ) -> bool:
        """Return whether rows that stand dense keep a limit, as far as their differences make it certain."""
        order, angular, lengths = kind.order or 1, kind.dimension == "angle", window.lengths[pieces, None]
        if lengths.max() > DENSE:
            return False
        rows = slice(pieces.start, pieces.stop + 1)
        states = tuple(None if values is None else values[rows] for values in window.states)
        q = np.asarray(states[0])
        if order == 1:
            poses = forward(robot, q)
            turns = np.swapaxes(poses[:-1, :3, :3], 1, 2) @ poses[1:, :3, :3]
            moved = log(turns) if angular else np.diff(poses[:, :3, 3], axis=0)
            return bool((np.linalg.norm(moved / lengths, axis=1) <= slack).all())
        rates = [np.asarray(values) for values in states[1:order]]
        below = (jacobian(robot, q) @ rates[-1][..., None])[..., 0]
        if order == 3:
            below = below + jacobian_dot_qd(robot, q, rates[0])
        part = below[:, 3:] if angular else below[:, :3]
        changes = np.linalg.norm(np.diff(part, axis=0) / lengths, axis=1)
        return bool((changes <= slack).all())

    def _over(self, window: Intervals, pieces: slice, robot: Robot, kind: LimitKind, limit: float) -> int:
        """Return at how many rows a speed of the tool is over its limit; 0 for accelerations."""
        if kind.order != 1:
            return 0
        coefficients = window.coefficients[:, pieces]
        q, qd = coefficients[-1], derivative_coefficients(coefficients, 1)[-1]
        twist = (jacobian(robot, q) @ qd[..., None])[..., 0]
        part = twist[:, 3:] if kind.dimension == "angle" else twist[:, :3]
        return int((np.linalg.norm(part, axis=1) > limit).sum())

    def _roundings(self, window: Intervals, pieces: NDArray[np.intp], local: Array, kind: LimitKind) -> Array:
        """Return by how much a derivative of the tool may be off by rounding, at times of some pieces."""
        order, (arm, turns), result = kind.order or 1, self._lever(kind), np.empty(pieces.size)
        counted = turns > 0.0  # what a length that rounding hides makes unknown of others is no matter
        for chosen, rows in window.rows_by_level(pieces):
            curves = window.coefficients[:, pieces[chosen]][..., counted]
            errors = [
                rows.error(k).reshape(chosen.size, -1)[:, counted] @ turns[counted] for k in range(order + 1)
            ]
            rates = [
                np.abs(horner(derivative_coefficients(curves, k), local[chosen, None])) @ turns[counted]
                for k in range(order + 1)
            ]
            total = errors[-1] + errors[0] * rates[order]
            if order == 2:
                total = total + 2.0 * rates[1] * (errors[1] + errors[0] * rates[1])
            if order == 3:
                q, first, second = errors[:3]
                total = total + 3.0 * (rates[1] * second + (rates[2] + rates[1] ** 2) * first)
                total = total + q * rates[1] * (3.0 * rates[2] + rates[1] ** 2)
            result[chosen] = arm * total
        return result

    def _judge_singularity(self, window: Intervals, pieces: slice, robot: Robot, move: int) -> None:
        """Warn where the smallest singular value of the scaled Jacobian is a small part of the largest."""
        rows = self._sparse_rows(window, pieces)
        if not rows.size:
            return
        q = np.asarray(window.states[0])[rows]
        scaled = jacobian(robot, q)
        scaled[:, :3] /= self._length
        values = np.linalg.svd(scaled, compute_uv=False)
        share = values[:, -1] / values[:, 0]
        near = np.flatnonzero(share < _NEAR_SINGULAR)
        if not near.size:
            return

        def make(k: int) -> Finding:
            row, time = int(rows[near[k]]), float(window.t[rows[near[k]]])
            return Finding(
                rule="path",
                severity="warning",
                kind="singularity",
                value=float(share[near[k]]),
                limit=_NEAR_SINGULAR,
                time=time,
                row=int(window.rows[row]),
                method="sampled",
                message=f"the arm is near to a singularity {at_time(time)}: the smallest singular value of "
                f"its Jacobian is {share[near[k]]:.3g} of the largest",
            )

        self._worst.add(
            "singularity",
            move,
            np.full(near.size, -1),
            1.0 / np.maximum(share[near], 1e-300),
            make,
            severity="warning",
        )

    def _sparse_rows(self, window: Intervals, pieces: slice) -> NDArray[np.intp]:
        """Return indices of rows between which some joint moves by a twentieth of a radian, and the first."""
        q = np.asarray(window.states[0])[pieces.start : pieces.stop + 1]
        steps = np.abs(np.diff(q, axis=0)).max(axis=1)
        moved = self._moved + np.append(0.0, np.cumsum(steps))
        number = np.floor(moved / _TURN).astype(np.int64)
        new = np.flatnonzero(np.diff(number, prepend=self._seen) > 0)
        self._moved, self._seen = float(moved[-1]), int(number[-1])
        return np.asarray(new + pieces.start, dtype=np.intp)
