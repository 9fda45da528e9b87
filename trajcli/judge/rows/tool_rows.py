"""Rows of the tool alone: joints found back from recorded poses, velocities, or distances along paths.

Poses name their joints by inverse kinematics: of all answers within the limits the one nearest to the row
before, from the start that the job says. Velocities V and accelerations A of the tool are then those of the
joints by the inverse of the Jacobian J: qd = J^-1 V, qdd = J^-1 (A - Jdot qd), where it has one. Without
poses qd is integrated from the start; of an arm with more than six joints the smallest is taken. Where a
file has distances s along the paths of the job alone, the joints follow these paths, as the plan does.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from trajcli.columns import Column, kinds_of
from trajcli.curves.operations import times_at
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.frozen import frozen
from trajcli.geometry.rotation import matrix_from_quaternion, quaternion_from_matrix
from trajcli.grids import AT_BREAK
from trajcli.kinematics.jacobian import jacobian, jacobian_dot_qd
from trajcli.kinematics.robot import MountedTool, Robot
from trajcli.planners.planner import PlannedMove
from trajcli.planning.plan import Plan
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.reading import open_rows_of
from trajcli.streams.recorded.column_roles import NamedFile
from trajcli.streams.recorded.column_units import SaidUnits, columns_said
from trajcli.streams.row_sources import EXACT, ArrayRows, RowSource, unplaced
from trajcli.streams.table import TableBlocks
from trajcli.units import Units

_TOLERANCE = 1e-6  # m and rad: what the answers may miss of rounded poses
_REGULAR = 1e3  # largest over smallest singular value: beyond it rates of the tool do not tell the joints'
_NONE_SAID = SaidUnits()
_LOST = 1  # decimals of a pose, or of s, that its joints do not have
_RATES_LOST = 3  # likewise of rates of the tool
_SAME_DURATION = 1e-6  # s: a file that lasts as long as the plan, within that, has its moves

Moves = NDArray[np.int64] | None
"""Index of the move of each row, (N,), where the tool changes; None where it does not."""


@frozen
class _ToolRows:
    """Rows about the tool, of a whole file: what each column is, and values (N, m) in their units."""

    rows: RowSource
    columns: tuple[Column, ...]
    values: Array

    def index(self, kind: str) -> int | None:
        return next((k for k, column in enumerate(self.columns) if column.kind == kind), None)

    def has(self, group: str) -> bool:
        return all(self.index(kind) is not None for kind in kinds_of(group))

    def group(self, group: str) -> Array:
        """Return the columns of a group in SI, (N, k)."""
        at = [index for kind in kinds_of(group) if (index := self.index(kind)) is not None]
        return np.asarray(self.values[:, at] * [self.columns[k].factor for k in at])

    def decimals(self, *quantities: Sequence[str], lost: Sequence[int]) -> tuple[int, ...]:
        """Return the decimals, in m or rad, that are left of the coarsest quantity; `EXACT` of exact ones.

        Whole numbers that stay as they are do not count.

        Args:
            quantities: The kinds of their columns.
            lost: How many states of joints do not have.
        """
        written, coarsest = self.rows.decimals(range(len(self.columns))), list[int]()
        for kinds in quantities:
            at = [k for kind in kinds if (k := self.index(kind)) is not None and written[k] != EXACT]
            # a millimetre has three decimals of a metre, a degree nearly two of a radian
            found = [
                int(written[k]) + {"mm": 3, "deg": 1}.get(self.columns[k].unit or "", 0)
                for k in at
                if written[k] or np.ptp(self.values[:, k])
            ]
            coarsest += [max(found)] if found else []
        return tuple(max(min(coarsest) - less, 1) if coarsest else EXACT for less in lost)


@frozen
class _Found:
    """Joints found back: positions, and velocities and accelerations where they are known, each (N, n).

    Attributes:
        states: Of them.
        decimals: That each has, `EXACT` where nothing was rounded.
        note: How they were found.
    """

    states: tuple[Array, ...]
    decimals: tuple[int, ...]
    note: str


def joints_found_back(
    source: ByteSource, robot: Robot, plan: Plan, said: SaidUnits = _NONE_SAID
) -> ArrayRows | None:
    """Return rows of joints that move the tool as a file says; None where it has joints, or none.

    Args:
        source: The file.
        robot: Whose tool it is, as it stands in the frame of the rows.
        plan: Of the job: the joints from which the first row is reached, and the paths of its moves.
        said: Units of columns whose names say none.

    Raises:
        InputError: When the file cannot be read as rows, or nothing says of which move a row is.
        PlanningError: When a pose cannot be reached within the limits.
    """
    if robot.convention is None:
        return None
    rows = open_rows_of(source)
    columns = columns_said(rows.named.names, said)
    kinds = {column.kind for column in columns}
    groups = [group for group in ("pose", "twist", "path") if {*kinds_of(group)} <= kinds]
    placed = {"x", "y", "z"} <= kinds
    if any(column.joint is not None for column in columns) or "t" not in kinds or not (groups or placed):
        return None
    if said.time not in (None, "s"):
        raise InputError(f"{rows.named.file}: rows of the tool alone have their times in s, not {said.time}")
    of_tool = _ToolRows(rows, columns, np.concatenate(list(rows.blocks(range(len(columns)), ()))))
    start, arms = plan.trajectory.start.position, ArmsOfMoves(robot, plan.moves)
    moves = _moves_of(of_tool, plan).astype(np.int64) if arms.changes else None
    if placed:
        found = _of_poses(of_tool, arms, moves, start)
    elif "twist" in groups:
        found = _of_twists(of_tool, arms, moves, start)
    else:
        found = _along_paths(of_tool, plan)
    return _as_rows(of_tool, found)


def _as_rows(of_tool: _ToolRows, found: _Found) -> ArrayRows:
    """Return the joints as rows of a file in SI, with its times and moves."""
    time = of_tool.index("t")
    assert time is not None  # noqa: S101
    decimals = of_tool.rows.decimals(range(len(of_tool.columns)))
    names, parts, written = ["t"], [of_tool.values[:, [time]]], [int(decimals[time])]
    for kind, states, digits in zip(("q", "qd", "qdd"), found.states, found.decimals, strict=False):
        names += [f"{kind}{joint + 1}" for joint in range(states.shape[1])]
        parts.append(states)
        written += [digits] * states.shape[1]
    move = of_tool.index("move")
    if move is not None:
        names.append("move")
        parts.append(of_tool.values[:, [move]])
        written.append(0)
    return ArrayRows(
        "csv",
        NamedFile(of_tool.rows.named.file, tuple(names), unplaced),
        np.concatenate(parts, axis=1),
        np.array(written, dtype=np.int64),
        np.zeros(len(names)),
        si=True,
        notes=(found.note,),
    )


def _of_poses(of_tool: _ToolRows, arms: ArmsOfMoves, moves: Moves, start: Array) -> _Found:
    """Return the joints by inverse kinematics, row by row from a start."""
    from trajcli.queries.arm import ArmInUnits
    from trajcli.queries.inverse_stream import joints_of

    named = of_tool.rows.named
    values = of_tool.values if moves is None else _with_first_tool(of_tool, arms, moves)
    names = tuple(column.name for column in of_tool.columns)
    poses = TableBlocks(names, iter([values]), named.file)
    stream = joints_of(ArmInUnits(arms.own, Units()), poses, start, _TOLERANCE)
    q = np.concatenate(list(stream.blocks))[:, 1:]
    slopes = arms.values(len(q), moves, lambda arm, k: jacobian(arm, q[k]))
    inverse = np.asarray(np.linalg.pinv(slopes, rcond=0.0), dtype=np.float64)
    states = (q, *_rates(arms, moves, q, of_tool, inverse))
    # a turn is off by up to four times its quaternion
    off = np.abs(inverse[..., :3]).sum(axis=2) + 4.0 * np.linalg.norm(inverse[..., 3:], axis=2)
    more = int(np.log10(max(off.max(), 1.0)))
    rates, kinds = max(2 * more + 1, _RATES_LOST), kinds_of("pose")
    decimals = of_tool.decimals(kinds[:3], kinds[3:], lost=(_LOST + more, rates, rates))
    return _Found(states, decimals, "the joints are found back from the poses, from the job's start on")


def _with_first_tool(of_tool: _ToolRows, arms: ArmsOfMoves, moves: NDArray[np.int64]) -> Array:
    """Return the rows of a file, (N, m), with the poses that the first tool has there."""
    if not of_tool.has("pose"):
        raise InputError(
            f"{of_tool.rows.named.file} has positions of several tools, and no orientation",
            hint="write the columns `pose`, or joints",
        )
    pose, values = of_tool.group("pose"), of_tool.values.copy()
    turned = matrix_from_quaternion(pose[:, 3:] / np.linalg.norm(pose[:, 3:], axis=1)[:, None])
    inverse = np.linalg.inv([arms.of(move).tool for move in moves.tolist()])
    change = inverse @ arms.own.tool
    pose[:, :3] += (turned @ change[:, :3, 3:])[..., 0]
    pose[:, 3:] = quaternion_from_matrix(turned @ change[:, :3, :3])
    for k, kind in enumerate(kinds_of("pose")):
        at = of_tool.index(kind)
        assert at is not None  # noqa: S101
        values[:, at] = pose[:, k] / of_tool.columns[at].factor
    return values


def _rates(arms: ArmsOfMoves, moves: Moves, q: Array, of_tool: _ToolRows, inverse: Array) -> list[Array]:
    """Return the rates of the joints (N, n) that the file's rates of the tool say, velocities first."""
    if not of_tool.has("twist") or q.shape[1] > 6:
        return []
    if np.linalg.cond(inverse).max() > _REGULAR:
        return []
    qd = np.asarray((inverse @ of_tool.group("twist")[..., None])[..., 0])
    if not of_tool.has("twistd"):
        return [qd]
    remainder = of_tool.group("twistd") - arms.values(
        len(q), moves, lambda arm, k: jacobian_dot_qd(arm, q[k], qd[k])
    )
    return [qd, np.asarray((inverse @ remainder[..., None])[..., 0])]


def _of_twists(of_tool: _ToolRows, arms: ArmsOfMoves, moves: Moves, start: Array) -> _Found:
    """Return the joints by integration of their velocities from a start, by the method of Runge and Kutta.

    Between two rows the velocity of the tool changes linearly, or as its derivative says at both.
    """
    if moves is not None:
        raise InputError(
            f"{of_tool.rows.named.file} has velocities of several tools, and no poses",
            hint="write the columns `pose`, or joints",
        )
    robot = arms.own
    twist, t = of_tool.group("twist"), of_tool.values[:, of_tool.index("t")]
    twistd = of_tool.group("twistd") if of_tool.has("twistd") else None

    def slope(q: Array, velocity: Array) -> Array:
        return np.asarray(np.linalg.pinv(jacobian(robot, q), rcond=1.0 / _REGULAR) @ velocity)

    steps = np.diff(t)
    middle = 0.5 * (twist[:-1] + twist[1:])
    if twistd is not None:
        middle = middle + steps[:, None] * (twistd[:-1] - twistd[1:]) / 8.0
    q, qd = np.empty((t.size, start.size)), np.empty((t.size, start.size))
    q[0], qd[0] = start, slope(start, twist[0])
    for k, step in enumerate(steps.tolist()):
        second = slope(q[k] + 0.5 * step * qd[k], middle[k])
        third = slope(q[k] + 0.5 * step * second, middle[k])
        fourth = slope(q[k] + step * third, twist[k + 1])
        q[k + 1] = q[k] + step / 6.0 * (qd[k] + 2.0 * second + 2.0 * third + fourth)
        qd[k + 1] = slope(q[k + 1], twist[k + 1])
    states = [q, qd]
    if twistd is not None:
        remainder = twistd - jacobian_dot_qd(robot, q, qd)
        inverse = np.linalg.pinv(jacobian(robot, q), rcond=1.0 / _REGULAR)
        states.append(np.asarray((inverse @ remainder[..., None])[..., 0]))
    lost = _RATES_LOST + int(np.ceil(np.log10(max(float(t[-1] - t[0]), 1.0))))  # roundings add up
    decimals = of_tool.decimals(kinds_of("twist")[:3], kinds_of("twist")[3:], lost=(lost,) * 3)
    note = "the joints are integrated from the velocities of the tool, from the job's start on"
    return _Found(tuple(states), decimals, note)


def _along_paths(of_tool: _ToolRows, plan: Plan) -> _Found:
    """Return the joints that follow the job's paths; in moves without a path those of the plan."""
    from trajcli.kinematics.following.follower import LostError, follower

    t = of_tool.values[:, of_tool.index("t")]
    along, owner = of_tool.group("path"), _moves_of(of_tool, plan)
    since, faster = _in_plan(t - t[0], owner, plan)
    q, qd, qdd = (plan.trajectory.curve.evaluate(since, k) * faster[:, None] ** k for k in range(3))
    for move, span in zip(plan.moves, plan.trajectory.spans, strict=True):
        motion, rows = move.planned.tool, np.flatnonzero(owner == span.index)
        if motion is None or motion.path is None or motion.pure_rotation or motion.overlaps or not rows.size:
            continue
        s_of_rows, sd, sdd = along[rows].T
        times = times_at(motion.law, s_of_rows)
        guess = move.planned.curve.evaluate(np.clip(times, 0.0, move.planned.curve.end))
        first = move.planned.curve.evaluate(np.zeros(1))[0]
        try:
            found = follower(move.robot, motion.path.at_s, first, 0.0).exact(s_of_rows, "right", guess)
        except LostError as error:
            file, s = of_tool.rows.named.file, float(error.s[0])
            raise InputError(
                f"{file}: no joints near those of the plan are at s = {s:.9g} of move {span.index}"
            ) from error
        q[rows], qd[rows] = found[0], found[1] * sd[:, None]
        qdd[rows] = found[2] * np.square(sd)[:, None] + found[1] * sdd[:, None]
    decimals = of_tool.decimals(("s",), lost=(_LOST, _RATES_LOST, _RATES_LOST))
    note = "the joints follow the paths of the job; in moves without a path they are those of the plan"
    return _Found((q, qd, qdd), decimals, note)


def _in_plan(since: Array, owner: Array, plan: Plan) -> tuple[Array, Array]:
    """Return for each row the time in the plan with as much of its move done, and how much faster it is."""
    duration = plan.trajectory.duration
    found, faster = np.clip(since, 0.0, duration), np.ones(since.size)
    if abs(since[-1] - duration) <= _SAME_DURATION:
        return found, faster
    for span in plan.trajectory.spans:
        rows = np.flatnonzero(owner == span.index)
        if rows.size > 1:
            after = since[min(int(rows[-1]) + 1, since.size - 1)]
            faster[rows] = span.duration / max(after - since[rows[0]], 1e-9)
            within = span.start + (since[rows] - since[rows[0]]) * faster[rows]
            found[rows] = np.minimum(within, min(span.end, duration))
    return found, faster


def _moves_of(of_tool: _ToolRows, plan: Plan) -> Array:
    """Return the index of the move of each row, (N,)."""
    at, trajectory = of_tool.index("move"), plan.trajectory
    if at is not None:
        return np.asarray(of_tool.values[:, at])
    since = of_tool.values[:, of_tool.index("t")]
    since = since - since[0]
    if len(trajectory.spans) > 1 and abs(since[-1] - trajectory.duration) > _SAME_DURATION:
        raise InputError(
            f"{of_tool.rows.named.file} lasts {since[-1]:.9g} s, the plan {trajectory.duration:.9g} s: "
            "which moves its distances s are of is not known",
            hint="write the column `move`, too, or the pose",
        )
    spans = [span for span in trajectory.spans if span.duration > 0] or list(trajectory.spans[:1])
    starts = np.array([span.start for span in spans])
    later = np.clip(np.searchsorted(starts, since + AT_BREAK, "right") - 1, 0, None)
    return np.asarray(np.array([float(span.index) for span in spans])[later])


class ArmsOfMoves:
    """An arm whose tool may differ from move to move.

    Attributes:
        own: The arm with its first tool.
        changes: Whether any move has another one.
    """

    def __init__(self, own: Robot, moves: Iterable[PlannedMove]) -> None:
        """Take the tools of moves.

        Args:
            own: The arm with its first tool, as it stands in some frame.
            moves: Of the job; those without another tool count as none.
        """
        self.own = own
        by_tool: dict[bytes, Robot] = {own.tool.tobytes(): own}
        self._by_move: dict[int, Robot] = {}
        for move in moves:
            bits = move.robot.tool.tobytes()
            if bits not in by_tool:
                by_tool[bits] = own.with_tool(MountedTool(move.robot.tool))
            if by_tool[bits] is not own:
                self._by_move[move.index] = by_tool[bits]
        self.changes = bool(self._by_move)

    def of(self, move: int) -> Robot:
        """Return the arm of a move."""
        return self._by_move.get(move, self.own)

    def values(
        self,
        count: int,
        moves: NDArray[np.int64] | None,
        of_arm: Callable[[Robot, NDArray[np.intp]], Array],
    ) -> Array:
        """Return values of rows (N, ...), each of the arm of its move.

        Args:
            count: How many rows.
            moves: Index of the move of each row, (N,); None where nothing says it: the first tool counts.
            of_arm: Values of an arm and of the indices of some rows, shape (k, ...).
        """
        if moves is None or not self.changes:
            return of_arm(self.own, np.arange(count))
        found: Array | None = None
        arms = {id(self.of(move)): self.of(move) for move in np.unique(moves).tolist()}
        owner = np.array([id(self.of(move)) for move in moves.tolist()])
        for key, arm in arms.items():
            rows = np.flatnonzero(owner == key)
            part = of_arm(arm, rows)
            found = np.empty((moves.size, *part.shape[1:])) if found is None else found
            found[rows] = part
        return np.empty(0) if found is None else found
