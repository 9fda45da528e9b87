"""Inverse kinematics of streams: joint values that follow the poses of a CSV without jumps."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

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
_RUN = 3  # rows on one branch, below which segments are followed
_LENGTH = 128  # rows of a segment: where the row before was another, seldom more are taken otherwise
_SEGMENTS = 128  # that are followed at once at most
_ROUNDS = 6  # of segments, after which fewer are followed at once
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
    done, segments = 0, 1
    for block in rows.blocks:
        follower = _Follower(arm, _targets(block, inputs, done, rows.file), last, tolerance, segments)
        joints = np.empty((len(block), len(last)))
        row = 0
        while row < len(block):
            try:
                answers = follower.take(row, last)
            except PlanningError as error:
                raise _of_row(arm, error, block, inputs, row, done) from None
            joints[row : row + len(answers)] = answers
            row, last = row + len(answers), answers[-1]
        done, segments = done + len(block), follower.segments
        times = block[:, :0] if inputs.time is None else block[:, [inputs.time]]
        yield np.hstack([times, joints / arm.joint_factors])


class _Follower:
    """Takes the nearest answer row by row; a closed form solves the rows of a block together.

    Attributes:
        segments: How many are to be followed at once, the next time.
    """

    def __init__(
        self, arm: ArmInUnits, target: IkTarget, last: Array, tolerance: float, segments: int
    ) -> None:
        self._arm, self._target, self._tolerance, self.segments = arm, target, tolerance, segments
        self._turning = revolute(arm.robot)
        method = method_for(arm.robot)
        self._solutions: Solutions | None = None
        if method.solve is not None and fits(method, target, arm.robot.base):
            self._solutions = solve(arm.robot, target, last, tolerance)
            self._usable = self._solutions.within_limits
            alone = self._solutions.singular.any(axis=-1) | ~self._usable.any(axis=-1)
            self._alone: Flags = np.append(alone, True)
            self._ahead = _FEW
            self._prepare_turns(self._solutions)

    def _prepare_turns(self, solutions: Solutions) -> None:
        """Find how many full turns down and up the limits leave each joint of all answers."""
        low, high = widened(solutions.bounds).T
        with np.errstate(invalid="ignore"):
            down, up = np.ceil((low - solutions.joints) / FULL), np.floor((high - solutions.joints) / FULL)
        usable = self._usable[..., None]
        down, up = (
            np.where(self._turning & usable, turns, 0.0)
            for turns in (np.minimum(down, 0.0), np.maximum(up, 0.0))
        )
        joints = np.where(usable, solutions.joints, np.inf)
        # numbers of a row beside each other, (rows, 3, n, branches)
        self._choices: Array = np.ascontiguousarray(np.stack([joints, down, up], axis=1).swapaxes(2, 3))

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
        answers = self._nearest(np.array([row]), last[None])
        if self._alone[row + 1]:
            return answers
        more = self._on_one_branch(self._solutions, row + 1, answers[0])
        stays = len(more) == self._ahead
        self._ahead = min(2 * self._ahead, _AHEAD) if stays else _FEW
        self.segments = 1 if stays else self.segments
        if len(more) < _RUN:  # the nearest branch is now this one and now that one
            more = self._in_segments(row + 1, answers[0])
        return np.concatenate([answers, more])

    def _in_segments(self, row: int, last: Array) -> Array:
        """Return the answers of some rows from `row` on, followed in segments, all of them at once.

        A segment starts from an answer to the row before it. Where another one is taken there, it is followed
        again until what it takes is what it took: from there on all would be the same.
        """
        alone = self._alone[row : row + self.segments * _LENGTH + 1]
        free = int(alone.argmax()) if alone.any() else len(alone) - 1
        length = min(_FEW * self.segments, _LENGTH, free)
        count = min(self.segments, free // length)
        rows = row + np.arange(count * length).reshape(count, length)
        taken = np.full((count, length, len(last)), np.nan)
        starts, changed = np.tile(last, (count, 1)), np.arange(count)
        starts[1:] = self._nearest(rows[1:, 0] - 1, starts[1:])
        for _ in range(_ROUNDS):
            values = starts[changed]
            for k in range(length):
                values = self._nearest(rows[changed, k], values)
                differs = (values != taken[changed, k]).any(axis=1)
                taken[changed, k] = values
                changed, values = changed[differs], values[differs]
                if not len(changed):
                    break
            changed = changed[changed + 1 < count] + 1
            if not len(changed):
                self.segments = min(2 * self.segments, _SEGMENTS)
                return taken.reshape(-1, len(last))
            starts[changed] = taken[changed - 1, -1]
        self.segments = max(self.segments // 2, 1)
        return taken[: changed[0]].reshape(-1, len(last))

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
        ends = np.flatnonzero(~(same & inside & ~self._alone[:-1][rows]))
        return np.asarray(values[: ends[0]] if len(ends) else values)

    def _apart(self, gaps: Array, usable: Flags) -> Array:
        """Return the largest difference of any joint, whole turns left out; infinite where not usable."""
        wrapped = np.where(self._turning, gaps - FULL * np.round(gaps / FULL), gaps)
        return np.where(usable, np.abs(wrapped).max(axis=-1), np.inf)

    def _nearest(self, rows: NDArray[np.intp], last: Array) -> Array:
        """Return the nearest answers (k, n) of rows (k,), each to its own `last` (k, n); few steps."""
        choices = self._choices[rows]
        joints, before = choices[:, 0], last[..., None]
        turns = before - joints
        turns /= FULL
        np.rint(turns, out=turns)
        np.maximum(turns, choices[:, 1], out=turns)
        np.minimum(turns, choices[:, 2], out=turns)
        turns *= FULL
        turns += joints
        gaps = turns - before
        nearest = np.maximum.reduce(np.abs(gaps, out=gaps), axis=1).argmin(axis=1)
        return np.asarray(turns[np.arange(len(rows)), :, nearest])

    def _continued(self, row: int, last: Array) -> Array | None:
        """Return the answer (1, n) that Newton's steps find near to the row before; None where they fail."""
        robot, target = self._arm.robot, self._target.rows([row])
        joints, converged = descend(robot, target, last[None], robot.limits.position, self._tolerance)
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
    when = "" if inputs.time is None else f", t = {block[row, inputs.time]:.9g} s"
    problems = error.said_by(arm.say).problems
    return PlanningError(problems[0].within(f"row {done + row} (from 0{when})"), *problems[1:])


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
            f"{file}, row {done + row} (from 0): the quaternion has length {length[row]:.6g} instead of 1",
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
