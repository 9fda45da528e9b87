"""Columns about the tool beside joints, and what these make of its pose, velocity and path.

Poses are compared with the forward kinematics of the joints, row by row; velocities and accelerations with
J qd and J qdd + Jdot qd where the rows have qd and qdd, else with the changes of the pose; the distance s
with where the path of the move is there, and its derivatives with its changes.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from trajcli.columns import Column, group_of, kinds_of
from trajcli.curves.piecewise import Array
from trajcli.errors import Amount
from trajcli.findings import Collector, Finding, at_time, tool_excess_amounts
from trajcli.frozen import frozen
from trajcli.geometry.rotation import log, matrix_from_quaternion
from trajcli.judge.motion import MotionJudge, Requirements
from trajcli.judge.rounding import stated_errors
from trajcli.judge.rows.planned_rows import halves_of
from trajcli.judge.rows.tool_rows import ArmsOfMoves
from trajcli.kinematics.dexterity import characteristic_length
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.target import residuals
from trajcli.kinematics.jacobian import jacobian_dot_qd, tcp_twist
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.streams.recorded.column_units import SaidUnits, columns_said
from trajcli.streams.recorded_motion import RecordedMotion, Resolution, blocks_of_size
from trajcli.streams.row_sources import ColumnExtents, RowSource

_EXACT = 1e-9  # m or rad, and of their derivatives: what FK of another processor leaves
_REACH = 2.0  # times the arm: how far a joint may be from the tool
_AXES = ("x", "y", "z")
_TURNS = ("rotation about x", "rotation about y", "rotation about z")


@frozen
class ToolTable:
    """Columns about the tool of a file, beside its joints.

    Attributes:
        columns: What each is; whole groups only.
        halves: Half a unit of the last decimal of each, SI, shape (m,).
        blocks: Returns the rows in SI, (N, m), as many at a time as those of the joints.
    """

    columns: tuple[Column, ...]
    halves: Array
    blocks: Callable[[], Iterable[Array]]

    def index(self, group: str) -> list[int]:
        """Return where the columns of a group stand; empty where it is not there."""
        kinds = {column.kind: k for k, column in enumerate(self.columns)}
        found = [kinds[kind] for kind in kinds_of(group) if kind in kinds]
        return found if len(found) == len(kinds_of(group)) else []

    def half(self, group: str) -> float:
        """Return half a unit of the last decimal of a group, in all its columns together."""
        return float(np.linalg.norm(self.halves[self.index(group)]))


def open_tool_table(rows: RowSource, size: int, said: SaidUnits) -> ToolTable | None:
    """Return the columns about the tool of a file, whole groups; None where none says more than the joints.

    Joints that were integrated from velocities of the tool drift, and these are all that there is.

    Args:
        rows: The file.
        size: Rows of a block.
        said: Units of columns whose names say none.

    Raises:
        InputError: When a row is none.
    """
    every = columns_said(rows.named.names, said)
    kinds = {column.kind for column in every if column.joint is None and column.quantity is not None}
    whole = {group for group in ("pose", "twist", "twistd", "path") if {*kinds_of(group)} <= kinds}
    taken = [k for k, column in enumerate(every) if column.joint is None and group_of(column) in whole]
    integrated = "twist" in whole and "pose" not in whole and all(column.joint is None for column in every)
    if not taken or integrated:
        return None
    columns = tuple(every[k] for k in taken)
    factors = np.array([column.factor for column in columns])
    extents = ColumnExtents(len(every))
    for block in rows.blocks(range(len(every)), ()):  # only all rows say the decimals
        extents.add(block)
    halves = halves_of(rows, every, extents.still)[taken] * factors

    def blocks() -> Iterator[Array]:
        return (block * factors for block in blocks_of_size(rows.blocks(taken, ()), size))

    return ToolTable(columns, halves, blocks)


def judge_tool_columns(
    blocks: Iterable[RecordedMotion],
    table: ToolTable,
    arms: ArmsOfMoves,
    paths: Mapping[int, ToolMotion | None] | None,
    seen: ArmsOfMoves,
) -> list[Finding]:
    """Return where columns about the tool are not what the joints beside them make of it.

    Args:
        blocks: Rows of the joints.
        table: The columns.
        arms: The arm.
        paths: Of the moves, where a job has a plan.
        seen: The arm as it stands in the frame of the columns.
    """
    judge = _Judge(table, arms, paths, seen)
    for motion, values in zip(blocks, table.blocks(), strict=True):
        judge.see(motion, values)
    return judge.findings()


class _Judge:
    """A comparison in the making."""

    def __init__(
        self,
        table: ToolTable,
        arms: ArmsOfMoves,
        paths: Mapping[int, ToolMotion | None] | None,
        seen: ArmsOfMoves,
    ) -> None:
        self._table, self._in_world, self._paths, self._seen = table, arms, paths, seen
        self._arm = _REACH * max(characteristic_length(arms.own), 1.0)
        self._worst = Collector()
        self._rates: MotionJudge | None = None
        self._laws: list[tuple[int, MotionJudge]] = []
        self._turned = np.zeros(3)
        self._last: Array | None = None

    def see(self, motion: RecordedMotion, values: Array) -> None:
        """Compare more rows of joints, and those of the tool beside them, (N, m)."""
        poses = self._seen.values(motion.t.size, motion.move, lambda arm, k: forward(arm, motion.q[k]))
        off = motion.resolution.roundings
        errors = [
            stated_errors(rows, *each).sum(axis=1)
            for rows, each in zip((motion.q, motion.qd, motion.qdd), off, strict=True)
            if rows is not None
        ]
        if self._table.index("pose"):
            self._compare_poses(motion, values[:, self._table.index("pose")], poses, errors[0])
        twists = self._table.index("twist")
        if twists and motion.qd is not None:
            self._compare_rates(motion, values, errors)
        elif twists:
            self._see_rates(motion, values, poses)
        if self._table.index("path") and self._paths is not None and motion.move is not None:
            if self._seen.own is not self._in_world.own:
                poses = self._in_world.values(
                    motion.t.size, motion.move, lambda arm, k: forward(arm, motion.q[k])
                )
            self._compare_along_paths(motion, values[:, self._table.index("path")], poses, errors[0])

    def findings(self) -> list[Finding]:
        found = list(self._worst.findings())
        for move, judge in [(-1, self._rates), *self._laws]:
            if judge is not None:
                found += [
                    _of_tool(finding, move)
                    for finding in judge.judgement().findings
                    if finding.rule in ("derivative", "continuity") and finding.severity == "error"
                ]
        return found

    def _compare_poses(self, motion: RecordedMotion, values: Array, poses: Array, errors: Array) -> None:
        """Compare positions and quaternions with the forward kinematics (N, 4, 4)."""
        slack = self._arm * errors + self._table.half("pose") + _EXACT
        away = np.linalg.norm(values[:, :3] - poses[:, :3, 3], axis=1)
        self._add("position", away, slack, motion, "is {value} from where the joints take it")
        lengths = np.linalg.norm(values[:, 3:], axis=1)
        turned = matrix_from_quaternion(values[:, 3:] / np.where(lengths > 0.0, lengths, 1.0)[:, None])
        chord = np.linalg.norm(turned - poses[:, :3, :3], axis=(1, 2)) / np.sqrt(8.0)
        angle = 2.0 * np.arcsin(np.minimum(chord, 1.0)) + np.abs(lengths - 1.0)
        self._add("orientation", angle, 2.0 * slack, motion, "is turned by {value} from what the joints make")

    def _compare_rates(self, motion: RecordedMotion, values: Array, errors: list[Array]) -> None:
        assert motion.qd is not None  # noqa: S101
        speed, text = np.abs(motion.qd).sum(axis=1), "is {value} from what the joints make"
        slack = self._arm * (errors[1] + errors[0] * speed) + self._table.half("twist") + _EXACT
        qd, move = motion.qd, motion.move
        made = self._seen.values(motion.t.size, move, lambda arm, k: tcp_twist(arm, motion.q[k], qd[k]))
        away = values[:, self._table.index("twist")] - made
        self._add("velocity", np.linalg.norm(away[:, :3], axis=1), slack, motion, text)
        self._add("angular velocity", np.linalg.norm(away[:, 3:], axis=1), slack, motion, text)
        if not self._table.index("twistd") or motion.qdd is None:
            return
        qdd = motion.qdd
        change = np.abs(qdd).sum(axis=1)
        slack = errors[2] + 2.0 * speed * errors[1] + errors[0] * (change + speed**2)
        slack = self._arm * slack + self._table.half("twistd") + _EXACT
        made = self._seen.values(motion.t.size, move, lambda arm, k: tcp_twist(arm, motion.q[k], qdd[k]))
        made = made + self._seen.values(
            motion.t.size, move, lambda arm, k: jacobian_dot_qd(arm, motion.q[k], qd[k])
        )
        away = values[:, self._table.index("twistd")] - made
        self._add("acceleration", np.linalg.norm(away[:, :3], axis=1), slack, motion, text)
        self._add("angular acceleration", np.linalg.norm(away[:, 3:], axis=1), slack, motion, text)

    def _see_rates(self, motion: RecordedMotion, values: Array, poses: Array) -> None:
        """Judge velocities beside positions alone: by how the tool moves and turns from row to row.

        Where the tool changes, that is how the first one moves: another one hangs elsewhere on the flange.
        """
        if self._seen.changes:
            first = forward(self._seen.own, motion.q)
            values, poses = self._of_first_tool(values, first[:, :3, 3] - poses[:, :3, 3]), first
        before = poses[:1, :3, :3] if self._last is None else self._last
        turns = np.concatenate([before, poses[:, :3, :3]])
        turned = self._turned + np.cumsum(log(turns[1:] @ np.swapaxes(turns[:-1], 1, 2)), axis=0)
        self._turned, self._last = turned[-1], poses[-1:, :3, :3]
        if self._rates is None:
            self._rates = MotionJudge(Requirements(_bare((*_AXES, *_TURNS), 3)))
        half = float(self._arm * np.asarray(motion.resolution.q).sum())
        rates = [values[:, at] for at in map(self._table.index, ("twist", "twistd")) if at]
        halves = [half, *(self._table.half(group) for group in ("twist", "twistd"))]
        self._rates.see(_as_motion(motion, [np.hstack([poses[:, :3, 3], turned]), *rates], halves))

    def _of_first_tool(self, values: Array, arms: Array) -> Array:
        """Return the columns (N, m) with the rates of a point at `arms` (N, 3) from the tcp, m."""
        moved = values.copy()
        twist, twistd = self._table.index("twist"), self._table.index("twistd")
        spin = values[:, twist][:, 3:]
        across = np.cross(spin, arms)
        moved[:, twist[:3]] += across
        if twistd:
            moved[:, twistd[:3]] += np.cross(values[:, twistd][:, 3:], arms) + np.cross(spin, across)
        return moved

    def _compare_along_paths(
        self, motion: RecordedMotion, values: Array, poses: Array, errors: Array
    ) -> None:
        """Compare where s is on the paths with where the joints take the tool, and judge its derivatives."""
        assert motion.move is not None and self._paths is not None  # noqa: S101, PT018
        edges = np.flatnonzero(np.diff(motion.move)) + 1
        for rows in np.split(np.arange(motion.t.size), edges):
            move = int(motion.move[rows[0]])
            of_move = self._paths.get(move)
            if of_move is not None and of_move.overlaps:
                continue
            if of_move is None or of_move.path is None or of_move.pure_rotation:
                self._add_along_path(
                    motion, np.abs(values[rows, 0]), self._table.half("path") + _EXACT, rows, "position"
                )
                continue
            rows = self._outside_zones(motion, values, rows, of_move)
            if not rows.size:
                continue
            path, s = of_move.path, values[rows, 0]
            target = path.at_s(s, "right").target()
            off, split = residuals(target, poses[rows]), sum(target.position)
            beyond = np.maximum(np.maximum(s - path.length, -s), 0.0)
            slack = self._arm * errors[rows] + self._table.half("path") + _EXACT
            away = np.linalg.norm(off[:, :split], axis=1) + beyond
            turned = np.linalg.norm(off[:, split:], axis=1)
            self._add_along_path(motion, away, slack + of_move.tolerance.position, rows, "position")
            self._add_along_path(motion, turned, slack + of_move.tolerance.angle, rows, "orientation")
            self._see_law(motion, values, rows, move)

    def _outside_zones(
        self, motion: RecordedMotion, values: Array, rows: NDArray[np.intp], of_move: ToolMotion
    ) -> NDArray[np.intp]:
        """Return the rows of a move on its path: in a zone s stays what it is on its border."""
        (first, *_), (*_, last) = (ends[:, 0].tolist() for ends in of_move.law.piece_ends())
        if of_move.path is None or abs(first) + abs(of_move.path.length - last) <= of_move.tolerance.position:
            return rows
        stays = ~values[rows, 1:].any(axis=1)
        slack = self._table.half("path") + of_move.tolerance.position
        for some in np.split(rows[stays], np.flatnonzero(np.diff(rows[stays]) > 1) + 1):
            away = np.abs(values[some, 0][:, None] - [first, last]).min(axis=1)
            if some.size:
                self._add_along_path(motion, away, slack, some, "position")
        return rows[~stays]

    def _add_along_path(
        self, motion: RecordedMotion, away: Array, slack: Array | float, rows: NDArray[np.intp], quantity: str
    ) -> None:
        part = replace(motion, t=motion.t[rows], first_row=motion.first_row + int(rows[0]), move=None)
        text = "is {value} from where s is on its path"
        assert motion.move is not None  # noqa: S101
        self._add(quantity, away, slack, part, text, int(motion.move[rows[0]]))

    def _see_law(self, motion: RecordedMotion, values: Array, rows: NDArray[np.intp], move: int) -> None:
        """Judge s and its derivatives in a move as the motion of one axis."""
        if not self._laws or self._laws[-1][0] != move:
            self._laws.append((move, MotionJudge(Requirements(_bare(("s",), 1)))))
        part = replace(motion, t=motion.t[rows], first_row=motion.first_row + int(rows[0]))
        states = [values[rows, k : k + 1] for k in range(3)]
        self._laws[-1][1].see(_as_motion(part, states, self._table.halves[self._table.index("path")]))

    def _add(
        self,
        quantity: str,
        away: Array,
        slack: Array | float,
        motion: RecordedMotion,
        text: str,
        move: int = -1,
    ) -> None:
        """Add where the tool is away by more than a slack."""
        slacks = np.broadcast_to(slack, away.shape)
        over = np.flatnonzero(away > slacks)
        if not over.size:
            return
        order = 2 if "acceleration" in quantity else 1 if "velocity" in quantity else 0
        turns = quantity.startswith(("orientation", "angular"))
        dimension: Literal["length", "angle"] = "angle" if turns else "length"
        what = quantity if order else "tool"

        def make(k: int) -> Finding:
            row = int(over[k])
            value, limit, time = float(away[row]), float(slacks[row]), float(motion.t[row])
            subject = "the tool" if what == "tool" else f"the {what} of the tool"
            return Finding(
                rule="derivative" if order else "path",
                kind="tool",
                value=value,
                limit=limit,
                time=time,
                row=motion.first_row + row,
                method="differences",
                quantity=quantity,
                rounding=limit,
                message=f"by its columns {subject} {text} {at_time(time)}; rounding explains {{limit}}",
                amounts=tool_excess_amounts(value, limit, order, dimension),
            )

        self._worst.add(
            "tool", move, np.full(over.size, -1), away[over] / slacks[over], make, quantity=quantity
        )


def _bare(names: tuple[str, ...], sliding: int) -> Robot:
    """Return axes without limits, the first of them sliding ones."""
    axes = tuple(Joint(name, type="prismatic" if k < sliding else "revolute") for k, name in enumerate(names))
    return Robot("the tool", axes, unlimited(len(names)), None, np.eye(4), np.eye(4))


def _as_motion(motion: RecordedMotion, states: list[Array], halves: Array | list[float]) -> RecordedMotion:
    """Return rows of the tool as those of as many axes."""
    count = states[0].shape[1]
    q, qd, qdd = (np.full(count, half) for half in halves)
    resolution = Resolution(motion.resolution.time, q, qd, qdd, relative_time=motion.resolution.relative_time)
    more: Iterator[Array | None] = iter([*states[1:], None, None])
    return replace(
        motion,
        q=states[0],
        qd=next(more),
        qdd=next(more),
        qddd=None,
        tau=None,
        move=None,
        joints=None,
        resolution=resolution,
    )


def _of_tool(finding: Finding, move: int) -> Finding:
    """Return a finding about an axis as one about the tool."""
    amounts = {
        name: replace(amount, joint=None) if isinstance(amount, Amount) else amount
        for name, amount in finding.amounts.items()
    }
    return replace(finding, joint=None, move=None if move < 0 else move, amounts=amounts)
