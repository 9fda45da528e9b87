"""Inverse kinematics of streams: joint values that follow the poses of a CSV without jumps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import NamedTuple

import numpy as np

from trajcli.columns import Column, Group, columns_of, parse_column
from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, Place, PlanningError, Problem
from trajcli.geometry.rotation import QUATERNION_DEFECT, Flags, matrix_from_quaternion
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.families.choose import method_for
from trajcli.kinematics.inverse.joint_turns import FULL, beyond, revolute, widened
from trajcli.kinematics.inverse.numeric import descend
from trajcli.kinematics.inverse.solutions import Solutions, check_reachable
from trajcli.kinematics.inverse.solve import fits, solve
from trajcli.kinematics.inverse.target import IkTarget, closure_of, partial_target
from trajcli.queries.arm import ArmInUnits
from trajcli.queries.forward import Stream, refuse_far
from trajcli.streams.csv import encoder_of
from trajcli.streams.decimals import Digits
from trajcli.streams.table import TableBlocks

_AHEAD = 256  # rows that are looked at together at most, where one branch stays the nearest
_FEW = 8  # rows that are looked at together at first
_STAYS = 5  # rows on one branch, after which it is the only one that is followed
_TOGETHER = 128  # rows whose branches are all compared with those of the rows before
_HALF = 3.14159  # rad: closer than this no other turn is nearer
_CLOSE = 0.2  # rad or m: a larger step may have missed a nearer answer, so all are sought
_AXES, _QUATERNION = ("x", "y", "z"), ("qw", "qx", "qy", "qz")


class _PoseColumns(NamedTuple):
    """Index of the time; index and metres per unit of x, y, z; indices of the quaternion, or none."""

    time: int | None
    position: list[int]
    factors: Array
    rotation: list[int]


def joints_of(arm: ArmInUnits, rows: TableBlocks, near: Array | None, tolerance: float) -> Stream:
    """Return t, where there is one, and joint values for each row of poses (x y z, and qw qx qy qz or none).

    Of all answers within the limits the one nearest to the row before is taken, in the first row the one
    nearest to `near`; the distance is the largest difference of any joint. Where no closed form fits, the row
    before is continued by the shortest steps instead, and all answers are sought only where that fails.

    Raises:
        InputError: When a column is missing; when taken, if a row is wrong.
        PlanningError: When taken, if a row cannot be reached within the limits.
    """
    inputs = _pose_columns(rows)
    groups: tuple[Group, ...] = ("q",) if inputs.time is None else ("t", "q")
    columns = columns_of(groups, arm.robot.joint_types, arm.units)
    return Stream(columns, _follow(arm, rows, inputs, near, tolerance))


class EveryAnswer:
    """All answers to each row of poses, as lines of a CSV: row, names of the branch, joints, within_limits.

    Attributes:
        missed: The first row, from 0, that no answer within the limits meets; None while there is none.
    """

    def __init__(self, arm: ArmInUnits, rows: TableBlocks, near: Array | None, tolerance: float) -> None:
        """Take what `joints_of` takes."""
        self.missed: int | None = None
        self._arm, self._rows, self._near, self._tolerance = arm, rows, near, tolerance
        self._inputs = _pose_columns(rows)

    def lines(self, digits: Digits) -> Iterator[bytes]:
        """Yield the header, then the lines of the answers to each block.

        Raises:
            InputError: When a row is wrong.
        """
        encode = encoder_of(digits)
        joints = columns_of(("q",), self._arm.robot.joint_types, self._arm.units)
        done, header = 0, True
        for block in self._rows.blocks:
            target = _targets(block, self._inputs, done, self._rows.file)
            solutions = solve(self._arm.robot, target, self._near, self._tolerance)
            names = [tuple(filter(None, asdict(branch).values())) for branch in solutions.names]
            if header:
                choices = [key for key, name in asdict(solutions.names[0]).items() if name is not None]
                yield f"{','.join(['row', *choices, *(c.name for c in joints), 'within_limits'])}\n".encode()
                header = False
            rows, branches = np.nonzero(solutions.valid)
            inside = solutions.within_limits
            values = (
                encode(solutions.joints[rows, branches] / self._arm.joint_factors, ()).decode()
                if len(rows)
                else ""
            )
            for row, branch, text in zip(rows.tolist(), branches.tolist(), values.splitlines(), strict=True):
                words = [str(done + row), *names[branch], text, str(int(inside[row, branch]))]
                yield f"{','.join(words)}\n".encode()
            none = np.flatnonzero(~inside.any(axis=1))
            if len(none) and self.missed is None:
                self.missed = done + int(none[0])
            done += len(block)


def _follow(
    arm: ArmInUnits, rows: TableBlocks, inputs: _PoseColumns, near: Array | None, tolerance: float
) -> Iterator[Array]:
    last = np.zeros(len(arm.robot.joints)) if near is None else near
    done = 0
    for block in rows.blocks:
        follower = _Follower(arm, _targets(block, inputs, done, rows.file), last, tolerance)
        joints = np.empty((len(block), len(last)))
        row = 0
        while row < len(block):
            try:
                answers = follower.take(row, last)
            except PlanningError as error:
                raise _of_row(arm, error, block, inputs, row, done) from None
            joints[row : row + len(answers)] = answers
            row, last = row + len(answers), answers[-1]
        done += len(block)
        times = block[:, :0] if inputs.time is None else block[:, [inputs.time]]
        yield np.hstack([times, joints / arm.joint_factors])


class _Follower:
    """Takes the nearest answer row by row; a closed form solves the rows of a block together."""

    def __init__(self, arm: ArmInUnits, target: IkTarget, last: Array, tolerance: float) -> None:
        self._arm, self._target, self._tolerance = arm, target, tolerance
        self._turning = revolute(arm.robot)
        method = method_for(arm.robot)
        self._solutions: Solutions | None = None
        if method.solve is not None and fits(method, target, arm.robot.base):
            self._solutions = solve(arm.robot, target, last, tolerance)
            self._usable = self._solutions.within_limits
            alone = self._solutions.singular.any(axis=-1) | ~self._usable.any(axis=-1)
            self._alone: Flags = np.asarray(alone)
            self._ahead, self._stays = _FEW, False
            self._table, self._table_start = list[list[int]](), 0
            self._bounds: list[list[float]] = widened(self._solutions.bounds).T.tolist()
            self._turning_joints = np.flatnonzero(self._turning).tolist()
            self._prepare_turns(self._solutions)

    def _prepare_turns(self, solutions: Solutions) -> None:
        """Find how many full turns down and up the limits leave each joint of all answers."""
        low, high = widened(solutions.bounds).T
        with np.errstate(invalid="ignore"):
            down, up = np.ceil((low - solutions.joints) / FULL), np.floor((high - solutions.joints) / FULL)
        usable = self._usable[..., None]
        turns = np.where(self._turning & usable, [np.minimum(down, 0.0), np.maximum(up, 0.0)], 0.0)
        self._down, self._up = np.ascontiguousarray(turns)  # numbers of a row beside each other
        self._joints: Array = np.ascontiguousarray(np.where(usable, solutions.joints, np.inf))

    def take(self, row: int, last: Array) -> Array:
        """Return the answers (k, n), k >= 1, of the rows from `row` on, each nearest to the one before.

        Args:
            row: Of the block.
            last: Joint values (n,) of the row before.

        Raises:
            PlanningError: When the row has none within the limits.
        """
        if self._solutions is None:
            continued = self._continued(row, last)
            return self._solved_alone(row, last)[None] if continued is None else continued
        if self._alone[row]:
            return self._solved_alone(row, last)[None]
        answers, branch = self._nearest(row, last)
        if row + 1 == len(self._alone):
            return answers
        if self._stays:
            more = self._on_one_branch(self._solutions, row + 1, answers[0])
            self._stays = len(more) > 0
            self._ahead = min(2 * self._ahead, _AHEAD) if len(more) == self._ahead else _FEW
        else:
            more = self._across_branches(self._solutions, row + 1, answers[0], branch)
        return np.concatenate([answers, more]) if len(more) else answers

    def _across_branches(self, solutions: Solutions, row: int, last: Array, branch: int) -> Array:
        """Return the answers of some rows from `row` on, which start from a branch of the row before.

        The answer that is nearest but for full turns is the nearest, where the turn next to the row before is
        inside the limits. Plain numbers: arrays of six cost more than the work on them.
        """
        if not self._table_start <= row < self._table_start + len(self._table):
            self._table, self._table_start = self._nearest_branches(solutions, row), row
        answers: list[list[float]] = []
        values, stayed, start = last.tolist(), 0, self._table_start
        for k in range(row, start + len(self._table)):
            if self._alone[k]:
                break
            nearest = self._table[k - start][branch]
            turned = self._turned(self._joints[k, nearest].tolist(), values)
            if turned is None:
                rows, nearest = self._nearest(k, np.array(values))
                turned = rows[0].tolist()
            stayed = stayed + 1 if nearest == branch else 0
            values, branch = turned, nearest
            answers.append(values)
            if stayed == _STAYS:
                self._stays = True
                break
        return np.array(answers)

    def _turned(self, joints: list[float], last: list[float]) -> list[float] | None:
        """Return an answer in the turns next to the row before; None where one is outside its limits."""
        low, high = self._bounds
        for j in self._turning_joints:
            gap = last[j] - joints[j]
            if -_HALF < gap < _HALF:
                continue
            turn = round(gap / FULL)
            joints[j] += FULL * turn
            if not low[j] <= joints[j] <= high[j]:
                return None
        return joints

    def _nearest_branches(self, solutions: Solutions, row: int) -> list[list[int]]:
        """Return the nearest branch of some rows from `row` on, for each branch of the row before."""
        joints = solutions.joints[row - 1 : row + _TOGETHER].T  # (n, branches, rows), as they are stored
        usable = self._usable[row : row + _TOGETHER].T
        farthest = np.zeros((len(usable), *usable.shape))  # (from, to, rows)
        for values, turns in zip(joints, self._turning, strict=True):
            gap = values[:, 1:] - values[:, None, :-1]
            if turns:
                gap -= FULL * np.rint(gap * (1.0 / FULL))
            np.maximum(farthest, np.abs(gap, out=gap), out=farthest)
        farthest += np.where(usable, 0.0, np.inf)
        nearest: list[list[int]] = farthest.argmin(axis=1).T.tolist()
        return nearest

    def _on_one_branch(self, solutions: Solutions, row: int, last: Array) -> Array:
        """Return the answers while one branch stays the nearest and inside the limits; maybe none."""
        rows = slice(row, row + self._ahead)
        joints, usable = solutions.joints[rows], self._usable[rows]
        branch = int(self._apart(joints[0] - last, usable[0]).argmin())
        along = joints[:, branch]
        gaps = joints - np.concatenate([last[None], along[:-1]])[:, None]
        same = self._apart(gaps, usable).argmin(axis=1) == branch
        turns = np.where(self._turning, np.round(gaps[:, branch] / FULL), 0.0).cumsum(axis=0)
        values = along - FULL * turns
        inside = (beyond(values, solutions.bounds) == 0.0).all(axis=1)
        ends = np.flatnonzero(~(same & inside & ~self._alone[rows]))
        return np.asarray(values[: ends[0]] if len(ends) else values)

    def _apart(self, gaps: Array, usable: Flags) -> Array:
        """Return the largest difference of any joint, whole turns left out; infinite where not usable."""
        wrapped = np.where(self._turning, gaps - FULL * np.round(gaps / FULL), gaps)
        return np.where(usable, np.abs(wrapped).max(axis=-1), np.inf)

    def _nearest(self, row: int, last: Array) -> tuple[Array, int]:
        """Return the nearest answer (1, n) of one row, and its branch; few steps, as rows may be many."""
        joints = self._joints[row]
        turns = last - joints
        turns /= FULL
        np.rint(turns, out=turns)
        np.maximum(turns, self._down[row], out=turns)
        np.minimum(turns, self._up[row], out=turns)
        values = FULL * turns
        values += joints
        gaps = values - last
        branch = int(np.maximum.reduce(np.abs(gaps, out=gaps), axis=1).argmin())
        return values[branch : branch + 1], branch

    def _continued(self, row: int, last: Array) -> Array | None:
        """Return the answer (1, n) that Newton's steps find near to the row before; None where they fail."""
        robot, target = self._arm.robot, self._target.rows([row])
        joints, converged = descend(robot, target, last[None], robot.limits.position)
        close = np.abs(joints - last).max() <= _CLOSE
        inside = (beyond(joints, robot.limits.position) == 0.0).all()
        met = converged[0] and closure_of(target, forward(robot, joints)).max() <= self._tolerance
        return joints if close and inside and met else None

    def _solved_alone(self, row: int, last: Array) -> Array:
        solutions = solve(self._arm.robot, self._target.rows(row), last, self._tolerance)
        check_reachable(self._arm.robot, solutions)
        return np.array(solutions.joints[int(solutions.nearest(last))])


def _of_row(
    arm: ArmInUnits, error: PlanningError, block: Array, inputs: _PoseColumns, row: int, done: int
) -> PlanningError:
    """Return the error with the row's number and time in front."""
    when = "" if inputs.time is None else f" (t = {block[row, inputs.time]:.9g} s)"
    problems = error.said_by(arm.say).problems
    return PlanningError(problems[0].within(f"row {done + row}{when}"), *problems[1:])


def _targets(block: Array, inputs: _PoseColumns, done: int, file: str) -> IkTarget:
    refuse_far(block[:, [*inputs.position, *inputs.rotation]], file)
    position = block[:, inputs.position] * inputs.factors
    if not inputs.rotation:
        return partial_target(position)
    quaternions = block[:, inputs.rotation]
    length = np.linalg.norm(quaternions, axis=1)
    wrong = np.flatnonzero(np.abs(length - 1.0) > QUATERNION_DEFECT)
    if wrong.size:
        row = int(wrong[0])
        raise InputError(
            f"{file}, row {done + row}: the quaternion has length {length[row]:.6g} instead of 1",
            hint=f"the allowed difference is {QUATERNION_DEFECT:g}; the columns are qw, qx, qy, qz",
        )
    return partial_target(position, rotation=matrix_from_quaternion(quaternions))


def _pose_columns(rows: TableBlocks) -> _PoseColumns:
    by_kind: dict[str, tuple[int, Column]] = {}
    for index, name in enumerate(rows.names):
        column = parse_column(name)
        usual = column.unit is None or (column.unit == "mm" and column.kind in _AXES)
        if column.joint is None and column.kind in ("t", *_AXES, *_QUATERNION) and usual:
            if column.kind in by_kind:
                raise _refused(
                    rows, f"{by_kind[column.kind][1].name} and {name} are columns of the same number"
                )
            by_kind[column.kind] = index, column
    missing = [name for name in _AXES if name not in by_kind]
    part = [name for name in _QUATERNION if name in by_kind]
    if part and len(part) < len(_QUATERNION):
        missing += [name for name in _QUATERNION if name not in by_kind]
    if missing:
        raise _refused(
            rows, f"a pose has x, y, z and qw, qx, qy, qz: there is no column {', '.join(missing)}"
        )
    position = [by_kind[name] for name in _AXES]
    time = by_kind["t"][0] if "t" in by_kind else None
    factors = np.array([column.factor for _, column in position])
    return _PoseColumns(time, [index for index, _ in position], factors, [by_kind[name][0] for name in part])


def _refused(rows: TableBlocks, message: str) -> InputError:
    hint = "x_mm, y_mm, z_mm are in mm; without quaternion the orientation is free"
    return InputError(Problem(message, hint, Place(rows.file, 1, 1, ",".join(rows.names))))
