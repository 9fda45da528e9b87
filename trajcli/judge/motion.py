"""Judgement of a recorded motion, block of rows by block of rows."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import field, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, Problem
from trajcli.findings import Collector, Finding, NamedJoints, at_time
from trajcli.frozen import frozen
from trajcli.judge.consistency import changes_of, judge_consistency
from trajcli.judge.ends import judge_end, judge_order_of_stamps, judge_start
from trajcli.judge.intervals import BESIDE, Intervals
from trajcli.judge.joint_limits import JudgedRun, judge_limits
from trajcli.judge.judgement import Judgement, worst_first
from trajcli.judge.reconstruction import Interpolation, chosen_interpolation
from trajcli.judge.rows.stamps import Stamps, UnfitError
from trajcli.kinematics.robot import QUANTITIES, Limits, Robot
from trajcli.streams.recorded_motion import RecordedMotion, Resolution
from trajcli.trajectory import State

if TYPE_CHECKING:
    from trajcli.consumers.judgement import ConsumerJudge
    from trajcli.judge.recorded_tool import ToolJudge

JUDGED_ROWS = 16384
"""Rows of a block: what is computed of them takes some 100 MB at most."""
_FIRST_ROWS = 256  # that are seen together: they show the period
_EXACT = 4.0  # units in the last place of a length between exact stamps
_SEEN = 1e-9  # of the period: stamps that are moved by less are as they were
_MOST = 9  # intervals of one period for each longer one: then a longer one is a hole
_STANDS = 1.0  # s: any length will do
_NAMED = 5  # moves that the job does not have
_FAR_OVER = 3.0  # times a limit of a rate: degrees are 57 times as large as radians
_TURNS = 4.0 * np.pi  # rad: no joint goes there, and degrees read as radians do


@frozen
class Requirements:
    """What a recorded motion is judged by.

    Attributes:
        robot: The arm with the limits in force where no move has others.
        by_move: The arm with the limits of each move, by its index.
        interpolate: How rows are joined; None for the highest that the columns allow.
        start: The state in which it shall begin; None where nobody says.
        start_tolerance: How near, rad or m by joint, shape (n,).
        end: The state in which it shall end; None where nobody says; an acceleration of NaN is not judged.
        tool: Makes the judge of the tool; None for an arm without geometry.
        consumer: Makes the judge by the rules of a consumer; None for none.
        planned: Whether they are rows of a verified motion: then all is told that their curve passes.
    """

    robot: Robot
    by_move: Mapping[int, Robot] = field(default_factory=dict)
    interpolate: str | None = None
    start: State | None = None
    start_tolerance: Array | None = None
    end: State | None = None
    tool: Callable[[], ToolJudge] | None = None
    consumer: Callable[[], ConsumerJudge] | None = None
    planned: bool = False

    def robot_between(self, before: int, after: int) -> Robot:
        """Return the arm with the limits in force between rows of two moves: the looser of both."""
        first, second = self.by_move.get(before, self.robot), self.by_move.get(after, self.robot)
        return first if first is second else replace(first, limits=_looser(first.limits, second.limits))

    def carries_one(self, before: int, after: int) -> bool:
        """Return whether the tool carries the same in two moves: else no row says when it changed."""
        first, second = self.by_move.get(before, self.robot), self.by_move.get(after, self.robot)
        return first.payload is second.payload and first.tool_load is second.tool_load


def judge_motion(blocks: Callable[[], Iterable[RecordedMotion]], requirements: Requirements) -> Judgement:
    """Return the judgement of a recorded motion.

    Args:
        blocks: Returns its rows in order, from the first one whenever it is called.
        requirements: What it is judged by.

    Raises:
        InputError: When it has not the joints of the robot, fewer than two rows, values that are not finite,
            or not the columns that the interpolation takes.
    """
    try:
        return _judgement_of(blocks(), MotionJudge(requirements))
    except UnfitError:
        return _judgement_of(blocks(), MotionJudge(requirements, snap=False))


def _judgement_of(blocks: Iterable[RecordedMotion], judge: MotionJudge) -> Judgement:
    for block in blocks:
        judge.see(block)
    return judge.judgement()


@frozen
class _Rows:
    """Rows that are kept: stamps as they are meant, how far they may be off, states, numbers, moves."""

    t: Array
    errors: Array
    states: tuple[Array | None, ...]
    rows: NDArray[np.int64]
    moves: NDArray[np.int64]

    def part(self, index: slice | NDArray[np.bool_]) -> _Rows:
        states = tuple(None if values is None else values[index] for values in self.states)
        return _Rows(self.t[index], self.errors[index], states, self.rows[index], self.moves[index])

    def followed_by(self, other: _Rows) -> _Rows:
        states = tuple(
            None if a is None or b is None else np.concatenate([a, b])
            for a, b in zip(self.states, other.states, strict=True)
        )
        pairs = ((self.t, other.t), (self.errors, other.errors))
        t, errors = (np.concatenate(pair) for pair in pairs)
        rows, moves = np.concatenate([self.rows, other.rows]), np.concatenate([self.moves, other.moves])
        return _Rows(t, errors, states, rows, moves)


class MotionJudge:
    """A judgement in the making: rows are seen block by block, two intervals at the end of each wait."""

    def __init__(self, requirements: Requirements, *, snap: bool = True) -> None:
        self._requirements, self._snap, self._worst = requirements, snap, Collector()
        robot = requirements.robot
        self._axes = robot
        self._revolute = [kind == "revolute" for kind in robot.joint_types]
        self._farthest = 0.0
        self._holes, self._regular = Collector(), 0
        self._stamps: Stamps | None = None
        self._interpolation: Interpolation = "linear"
        self._kept: _Rows | None = None
        self._judged, self._count = 0, 0
        self._last_stamp, self._waiting = -np.inf, list[RecordedMotion]()
        self._first_state: _Rows | None = None
        self._resolution: Resolution | None = None
        self._source: str | None = None
        self._tool = None if requirements.tool is None else requirements.tool()
        self._consumer = None if requirements.consumer is None else requirements.consumer()
        self._of_no_move = set[int]()

    def see(self, block: RecordedMotion) -> None:
        """Judge more rows.

        Raises:
            InputError: When they cannot be judged.
            UnfitError: When their stamps do not fit the period of those before.
        """
        self._count += len(block.t)
        if self._consumer is not None:
            self._consumer.take(block)
        if self._stamps is None:  # a period takes some rows to show
            self._waiting.append(block)
            if self._count < _FIRST_ROWS:
                return
            block = _one_block(self._waiting)
            self._begin(block)
        self._see(block)
        if self._kept is not None and self._interpolation != "jtc-upsampling":  # a spline needs all rows
            self._judge(self._kept.t.size - 1 - BESIDE, ends=False)

    def _see(self, block: RecordedMotion) -> None:
        rows = self._taken(block)
        if not rows.t.size:
            return
        self._kept = rows if self._kept is None else self._kept.followed_by(rows)
        of_angles = np.asarray(rows.states[0])[:, self._revolute]
        self._farthest = max(self._farthest, float(np.abs(of_angles).max(initial=0.0)))
        if self._first_state is None:
            self._first_state = rows.part(slice(0, 1))

    def judgement(self) -> Judgement:
        """Return what there is to say of all rows.

        Raises:
            InputError: When there are fewer than two.
        """
        if self._stamps is None and self._waiting:
            block = _one_block(self._waiting)
            self._begin(block)
            self._see(block)
        kept, stamps = self._kept, self._stamps
        if kept is None or stamps is None or self._first_state is None:
            raise InputError(f"{self._source or 'the motion'} has no rows, a motion has one at least")
        if kept.t.size == 1:  # a motion of no duration: the arm stands there
            self._interpolation, held = "hold", replace(kept, states=(kept.states[0], None, None))
            self._kept = held.followed_by(replace(held, t=held.t + _STANDS))
        self._judge(max(kept.t.size - 1, 1), ends=True)
        findings = [*self._worst.findings(), *self._of_ends(self._first_state, kept.part(slice(-1, None)))]
        if self._tool is not None:
            findings += self._tool.findings()
        holes = () if self._requirements.planned else tuple(self._holes.findings())
        if self._regular >= _MOST * sum(finding.count for finding in holes):
            findings += holes
        notes = [*_note_on_stamps(stamps), *(() if self._tool is None else self._tool.notes)]
        if self._of_no_move:
            numbers = ", ".join(map(str, sorted(self._of_no_move)[:_NAMED]))
            notes.append(
                f"the job has no move {numbers}: such rows are judged by what it says of all moves alone, "
                "without limits, paths and payloads of single ones"
            )
        if self._consumer is not None:
            of_consumer, unjudged = self._consumer.result()
            findings, notes = [*findings, *of_consumer], [*notes, *unjudged]
        period = stamps.lattice.period if stamps.lattice is not None and stamps.regular else None
        hinted = _with_unit_hint(worst_first(_causes(findings)), self._axes, self._farthest)
        return Judgement(tuple(hinted), self._interpolation, self._count, period, self._source, tuple(notes))

    def _begin(self, block: RecordedMotion) -> None:
        """Decide what the first rows decide for all: how they are joined, and the period."""
        count, joints = block.q.shape[1], len(self._axes.joint_names)
        if count != joints:
            robot = self._requirements.robot.name
            raise InputError(
                f"{block.source} has {count} joint{'s' * (count != 1)}, {robot} has {joints}",
                hint="say with --columns which columns are meant, or name another robot",
            )
        asked = self._requirements.interpolate
        complete = [
            rows is not None and (asked == "jtc" or bool(np.isfinite(rows).all()))
            for rows in (block.qd, block.qdd)
        ]
        self._interpolation = chosen_interpolation(asked, complete[0], complete[1])
        self._columns = complete
        self._resolution, self._source = block.resolution, block.source
        self._stamps = Stamps(block.resolution.time, block.resolution.relative_time, snap=self._snap)

    def _taken(self, block: RecordedMotion) -> _Rows:
        """Return the rows whose stamps increase, as they are meant; the others are findings."""
        assert self._stamps is not None  # noqa: S101
        numbers = block.first_row + np.arange(len(block.t))
        moves = np.full(len(block.t), -1) if block.move is None else block.move
        states = tuple(
            rows if wanted else None
            for rows, wanted in zip((block.q, block.qd, block.qdd), (True, *self._columns), strict=True)
        )
        for rows in states[: 1 if self._interpolation == "jtc" else 3]:
            _check_finite(rows, block, numbers)
        increasing = judge_order_of_stamps(block.t, numbers, self._last_stamp, moves, self._worst)
        stamps = block.t if increasing.all() else block.t[increasing]
        if not stamps.size:
            return _Rows(stamps, stamps, states, numbers, moves).part(slice(0, 0))
        self._last_stamp = float(stamps[-1])
        meant, exact = self._stamps.taken(stamps)
        errors = np.where(exact, 0.0, self._stamps.errors(stamps))
        everything = _Rows(block.t, block.t, states, numbers, moves)
        return replace(
            everything if increasing.all() else everything.part(increasing), t=meant, errors=errors
        )

    def _judge(self, last: int, *, ends: bool) -> None:
        """Judge the intervals that wait, up to the last one, and let go of rows that are not needed more."""
        kept = self._kept
        if kept is None or self._resolution is None or last <= self._judged:
            return
        window = self._window(kept, last, ends=ends)
        self._see_holes(window)
        changes = changes_of(window)
        flips = None if self._tool is None else self._tool.changes_branch
        asked = self._requirements.interpolate is not None or self._requirements.planned
        for (before, after), low, high in window.runs():
            if self._requirements.by_move:
                self._of_no_move |= {before, after} - self._requirements.by_move.keys() - {-1}
            robot, pieces = self._requirements.robot_between(before, after), slice(low, high)
            arguments = (window, pieces, robot.limits, before, self._axes, self._worst)
            carries_one = self._requirements.carries_one(before, after)
            run = JudgedRun(window, pieces, robot, self._worst, asked, carries_one)
            judge_limits(run)
            if run.limits_efforts:
                from trajcli.judge.recorded_efforts import judge_efforts

                judge_efforts(run)
            judge_consistency(*arguments, changes, flips)
            if self._tool is not None:
                self._tool.see(window, pieces, robot, before, asked=asked)
        gone = max(last - BESIDE, 0)
        self._kept, self._judged = kept.part(slice(gone, None)), last - gone

    def _see_holes(self, window: Intervals) -> None:
        """Note intervals of two periods and more, and count those of one."""
        if self._stamps is None or self._stamps.lattice is None:
            return
        periods = window.lengths[window.first : window.last] / self._stamps.lattice.period
        neighbours = np.diff(window.rows[window.first : window.last + 1]) == 1  # no wrong stamp between them
        long = np.flatnonzero((np.rint(periods) > 1) & neighbours)
        self._regular += int((np.rint(periods) == 1).sum())

        def make(k: int) -> Finding:
            at = window.first + int(long[k])
            row, length, times = int(window.rows[at + 1]), float(window.lengths[at]), float(periods[long[k]])
            text = f"row {row} stands {times:.4g} periods after the row before it {at_time(window.t[at + 1])}"
            return Finding(
                rule="time",
                severity="warning",
                kind="time",
                value=length,
                limit=length / times,
                time=float(window.t[at + 1]),
                row=row,
                message=f"{text}, and most rows stand one: is one missing?",
            )

        if long.size:
            nothing = np.full(long.size, -1)
            self._holes.add("time", -1, nothing, periods[long], make, severity="warning")

    def _window(self, kept: _Rows, last: int, *, ends: bool) -> Intervals:
        assert self._stamps is not None and self._resolution is not None  # noqa: S101, PT018
        lengths, late = np.diff(kept.t), kept.errors[:-1] + kept.errors[1:]
        if self._stamps.lattice is not None:
            lattice, exact = self._stamps.lattice, late == 0.0
            steps, counted = (np.rint(each / lattice.period) for each in (lengths, kept.t - lattice.origin))
            beside = lattice.slack + counted[:-1] * lattice.loose  # a last row that is no multiple
            late += np.where(kept.errors[:-1] == 0.0, beside, 0.0)
            lengths = np.where(exact, steps * lattice.period, lengths)
            late = np.where(exact, steps * lattice.loose, late)
        return Intervals(
            t=kept.t,
            lengths=lengths,
            late=late + _EXACT * np.spacing(lengths),
            states=kept.states,
            rows=kept.rows,
            moves=kept.moves,
            interpolation=self._interpolation,
            resolution=self._resolution,
            first=self._judged,
            last=last,
            ends=ends,
        )

    def _of_ends(self, first: _Rows, last: _Rows) -> list[Finding]:
        required, resolution = self._requirements, self._resolution
        assert resolution is not None  # noqa: S101
        findings: list[Finding] = []
        if required.start is not None and required.start_tolerance is not None:
            state = (float(first.t[0]), int(first.rows[0]), first.states)
            findings += judge_start(state, required.start, required.start_tolerance, resolution, self._axes)
        state = (float(last.t[0]), int(last.rows[0]), last.states)
        return findings + judge_end(state, required.end, required.start_tolerance, resolution, self._axes)


def _one_block(blocks: list[RecordedMotion]) -> RecordedMotion:
    if len(blocks) == 1:
        return blocks[0]
    names = ("t", "q", "qd", "qdd", "move")
    parts = {name: [getattr(block, name) for block in blocks] for name in names}
    joined: dict[str, Any] = {
        name: None if each[0] is None else np.concatenate(each) for name, each in parts.items()
    }
    return replace(blocks[0], qddd=None, tau=None, **joined)


def _looser(a: Limits, b: Limits) -> Limits:
    """Return limits that two moves both keep."""
    both = {name: (getattr(a, name), getattr(b, name)) for name in (*QUANTITIES, "effort")}
    rows = {
        name: np.stack([np.minimum(one[:, 0], other[:, 0]), np.maximum(one[:, 1], other[:, 1])], axis=1)
        for name, (one, other) in both.items()
    }
    tcp = {name: max(value, getattr(b.tcp, name)) for name, value in vars(a.tcp).items()}
    (d, offset), (other_d, other_offset) = a.velocity_by_position.T, b.velocity_by_position.T
    looser = (other_d > d) | ((other_d == d) & (other_offset < offset))  # those of moves differ by one factor
    near = np.where(looser[:, None], b.velocity_by_position, a.velocity_by_position)
    return replace(a, **rows, tcp=type(a.tcp)(**tcp), velocity_by_position=near)


def _check_finite(rows: Array | None, block: RecordedMotion, numbers: NDArray[np.int64]) -> None:
    if rows is None or np.isfinite(rows).all():
        return
    row, joint = (int(index[0]) for index in np.nonzero(~np.isfinite(rows)))
    value = float(rows[row, joint])
    raise InputError(
        Problem(f"{block.source}: row {numbers[row]} has {value!r} for joint {joint + 1}, expected numbers")
    )


def _note_on_stamps(stamps: Stamps) -> list[str]:
    """Return that stamps were taken as multiples of a period, where that moved them."""
    lattice = stamps.lattice
    if lattice is None or stamps.largest_snap <= _SEEN * lattice.period:
        return []
    rate = f"{lattice.period:.9g} s ({1 / lattice.period:.9g} Hz)"
    moved = f"by {stamps.largest_snap:.3g} s at most, within their rounding"
    return [f"the time stamps are taken as multiples of {rate}: that moves them {moved}"]


def _causes(findings: list[Finding]) -> list[Finding]:
    """Return the findings without accelerations that disagree with velocities which are wrong themselves."""
    wrong = {(f.joint, f.move) for f in findings if f.kind == "derivative" and f.quantity == "velocity"}
    return [
        f
        for f in findings
        if f.kind != "derivative" or f.quantity == "velocity" or (f.joint, f.move) not in wrong
    ]


def _with_unit_hint(findings: Sequence[Finding], axes: NamedJoints, farthest: float) -> list[Finding]:
    """Return findings, the first of which says that the file looks like degrees (`farthest` in rad)."""
    found = list(findings)
    if farthest <= _TURNS:
        return found
    revolute = {
        name for name, kind in zip(axes.joint_names, axes.joint_types, strict=True) if kind == "revolute"
    }
    of_joints = [
        k
        for k, f in enumerate(found)
        if f.joint in revolute and (f.kind == "position" or (f.kind in QUANTITIES and f.excess > _FAR_OVER))
    ]
    if of_joints:
        at = min(of_joints, key=lambda k: found[k].kind != "position")
        if found[at].hint is None:
            hint = f"values up to {farthest:.6g}: degrees? then say --units deg, or q1_deg in a CSV"
            found[at] = replace(found[at], hint=hint)
    return found
