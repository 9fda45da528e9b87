"""Rows of a planned motion: whether those of a file are samples of it, on a whole grid of times.

They are when each number is that of the planned curve to half a unit of its last decimal (the ninth where all
digits are given: they may come from a CSV), and the stamps are all times of one rate from the start to the
end, the times that the job lists, its knots, or its knots and all times of the job's rate. The start time
may be another. A row that is missing, doubled or out of order makes them a motion of its own.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

from trajcli.columns import GROUPS, Column, Group, columns_of, group_of
from trajcli.curves.piecewise import Array
from trajcli.frozen import comparable, frozen
from trajcli.grids import Grid, ListedGrid, UniformGrid
from trajcli.judge.rows.stamps import simplest_between
from trajcli.knots import has_knots, knot_grid, knots_of
from trajcli.planning.plan import Plan
from trajcli.samples import sample
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.reading import open_rows_of
from trajcli.streams.recorded.column_units import SaidUnits, columns_said
from trajcli.streams.recorded_motion import WrittenColumn, blocks_of_size
from trajcli.streams.row_sources import EXACT, FULL_DECIMALS, ColumnExtents, RowSource, decimals_of_still
from trajcli.units import Units

_ROWS = 4096  # compared at a time
_KEPT = 1 << 22  # numbers that are kept in memory; of a longer file rows are read anew
_HALF = 0.5 * (1 + 1e-6)  # of a unit: what rounding may have moved a number by
_OF_CSV = _HALF * 1e-9  # SI: of exact numbers that were converted from what `plan` writes
_BITS = 1e-11  # relative, and SI: what other processors, and units, leave of the last bits
_ULPS = 8.0  # of a stamp
_NO_GRID = (
    "its stamps are neither all times of one rate, nor the times of the job, nor the knots of its motion"
)
_ODD = ("qd", "qddd", "vx", "vy", "vz", "wx", "wy", "wz", "sd")  # change their sign when time goes back
_NONE_SAID = SaidUnits()
_NANOSECOND = 0.5e-9  # s: by how much the stamps of messages are rounded


@comparable
class RowComparison:
    """What a comparison of rows with a planned motion finds.

    Attributes:
        planned: Whether they are rows of it.
        difference: Why not, one sentence; None where they are.
    """

    planned: bool
    difference: str | None = None


@frozen
class _Stamps:
    """The stamps of a file: how many, the first, the last two, and by how much they may be rounded, s."""

    count: int
    first: float
    last: tuple[float, float]
    rounding: float

    @property
    def doubt(self) -> float:
        """By how much two of them may be off, s: those of exact numbers were perhaps converted from a CSV."""
        return 2 * max(self.rounding, _NANOSECOND)


@frozen
class _Rows:
    """Rows of a file in its units, with what its columns are.

    Attributes:
        source: The file.
        columns: What each of them is.
        factors: SI per unit of each, shape (m,).
        groups: Of which the columns are some.
        index: Where each column stands among those of the groups, shape (m,).
        kept: The rows; None where they are too many.
    """

    source: RowSource
    columns: tuple[Column, ...]
    factors: Array
    groups: tuple[Group, ...]
    index: NDArray[np.intp]
    kept: Array | None

    @property
    def time(self) -> int:
        """Index of the column of time."""
        return next(k for k, column in enumerate(self.columns) if column.kind == "t")

    def blocks(self) -> Iterator[Array]:
        """Yield the rows in SI, so many at a time."""
        every = [self.kept] if self.kept is not None else self.source.blocks(range(len(self.columns)), ())
        for block in blocks_of_size(every, _ROWS):
            yield block * self.factors


def compare_with_plan(
    source: ByteSource,
    plan: Plan,
    topic: str | None = None,
    field: str | None = None,
    said: SaidUnits = _NONE_SAID,
    read: Sequence[WrittenColumn] = (),
) -> RowComparison:
    """Return whether the rows of a file are those of a planned motion.

    Args:
        source: The file.
        plan: Of the job.
        topic: Of MCAP, the one that is read.
        field: Of messages with several states, the one that is read.
        said: Units of columns whose names say none.
        read: What columns are where somebody says it; the others are what their names say.

    Raises:
        InputError: When the file cannot be read as rows at all.
        FileError: When it cannot be read.
    """
    joints = len(plan.loaded.robot.joints)
    rows = open_rows_of(source, topic=topic, field=field, joints=joints)
    columns = columns_said(rows.named.names, said, plan.loaded.robot.joint_types)
    found = _read_otherwise(columns, rows.named.names, read, said) or _comparable(
        columns, rows.joint_names, plan
    )
    if isinstance(found, str):
        return RowComparison(planned=False, difference=found)
    groups, index = found
    kept, stamps, halves = _read(rows, columns)
    if stamps is None:
        return RowComparison(planned=False, difference="its time stamps do not increase from row to row")
    mapped = {column.name: column.factor for column in read}
    named = zip(rows.named.names, columns, strict=True)
    factors = np.array([mapped.get(name, column.factor) for name, column in named])
    halves = np.where(halves > 0, halves * factors, _OF_CSV)
    of_file = _Rows(rows, columns, factors, groups, index, kept)
    difference = None
    for grid in _grids(plan, stamps, groups):
        if grid.count != stamps.count or not _stands_on(of_file, grid, stamps):
            continue
        first = _first_difference(of_file, plan, grid, halves, stamps)
        if first is None:
            return RowComparison(planned=True)
        difference = difference or first
    backward = _backward(of_file, plan, halves, stamps)
    return RowComparison(
        planned=False, difference=backward or difference or _beside(of_file, plan, halves, stamps)
    )


def _comparable(
    columns: Sequence[Column], names: tuple[str, ...] | None, plan: Plan
) -> tuple[tuple[Group, ...], NDArray[np.intp]] | str:
    """Return the groups of the columns and where each stands in them; what is no column of the plan."""
    robot = plan.loaded.robot
    if names is not None and names != robot.joint_names:
        return f"its joints are {', '.join(names)}, those of the job are {', '.join(robot.joint_names)}"
    groups: list[Group] = []
    for column in columns:
        group = group_of(column)
        if group in GROUPS and group not in groups:
            groups.append(group)
    signals = [signal.name for signal in plan.trajectory.signals]
    every = columns_of(groups, robot.joint_types, Units(), signals) if groups else ()
    where = {(column.kind, column.joint): at for at, column in enumerate(every)}
    for column in columns:
        if (column.kind, column.joint) not in where:
            return f"the column {column.name} is none that `plan` writes"
    if not any(column.kind == "t" for column in columns) or len(columns) < 2:
        return "it has no column of time"
    if robot.convention is None and {"pose", "twist", "twistd"} & set(groups):
        return "its columns are about a tool, and the robot has no geometry"
    if "tau" in groups and (robot.convention is None or robot.without_inertia):
        return "it has efforts, and the robot of the job has no masses, of which they follow"
    index = np.array([where[column.kind, column.joint] for column in columns], dtype=np.intp)
    return tuple(groups), index


def _read_otherwise(
    columns: Sequence[Column], names: Sequence[str], read: Sequence[WrittenColumn], said: SaidUnits
) -> str | None:
    """Return what column somebody takes for another than its name says; stamps of `plan` are in seconds."""
    otherwise = {column.name: column for column in read}
    for name, column in zip(names, columns, strict=True):
        other = otherwise.get(name)
        if column.kind == "t" and (said.time not in (None, "s") or (other and other.factor != 1.0)):
            return f"its column {name} is not read in s"
        if other is not None and (other.quantity, other.joint) != (column.kind, column.joint):
            what = other.quantity if other.joint is None else f"{other.quantity}{other.joint + 1}"
            return f"its column {name} is read as {what}"
    return None


def _read(rows: RowSource, columns: Sequence[Column]) -> tuple[Array | None, _Stamps | None, Array]:
    """Return the rows where they are few, their stamps where these increase, and half a unit of each column.

    These are in the units of the columns, shape (m,); zero where nothing is rounded.
    """
    every = range(len(columns))
    time = next(k for k, column in enumerate(columns) if column.kind == "t")
    kept: list[Array] | None = []
    count, numbers, ends, rising = 0, 0, np.empty(0), True
    first, extents = 0.0, ColumnExtents(len(columns))
    for block in rows.blocks(every, ()):
        if not len(block):
            continue
        extents.add(block)
        t = block[:, time]
        first = first if count else float(t[0])
        rising &= bool((np.diff(np.append(ends[-1:], t)) > 0).all())
        ends = np.append(ends, t)[-2:]
        count, numbers = count + len(block), numbers + block.size
        if kept is not None:
            kept.append(block)
            kept = kept if numbers <= _KEPT else None
    halves = halves_of(rows, columns, extents.still)
    if not rising or count < 1:
        return None, None, halves
    rounding = halves[time] if halves[time] else (_NANOSECOND if rows.format in ("mcap", "ros") else 0.0)
    stamps = _Stamps(count, first, (float(ends[0]), float(ends[-1])), float(rounding))
    return (None if kept is None else np.concatenate(kept)), stamps, halves


def halves_of(rows: RowSource, columns: Sequence[Column], still: NDArray[np.bool_]) -> Array:
    """Return half a unit of the last decimal of each column, once all rows were taken, in its units, (m,).

    Args:
        rows: The file.
        columns: What each of its columns is.
        still: Which of them show one number alone, shape (m,).
    """
    alike = [(group_of(column), column.unit) for column in columns]
    decimals = decimals_of_still(rows.decimals(range(len(columns))), still, alike)
    exact = (decimals == EXACT) | (decimals.max() >= FULL_DECIMALS)
    halves = np.where(exact, 0.0, _HALF * 10.0 ** -np.maximum(decimals, 0).astype(np.float64))
    halves[[column.whole_numbers for column in columns]] = 0.0
    return np.asarray(halves)


def _grids(plan: Plan, stamps: _Stamps, groups: Sequence[Group]) -> Iterator[Grid]:
    """Yield the grids of a plan on which rows may stand, one after the other: knots cost a search."""
    output, trajectory = plan.loaded.job.output, plan.trajectory
    if output.times is not None:
        yield ListedGrid(trajectory.duration, np.array(output.times), output.start_time)
    for rate in _rates(plan, stamps):
        yield UniformGrid(trajectory.duration, rate, stamps.first)
    for stated in ((3,) if "qdd" in groups else (2, 3)) if has_knots(trajectory) else ():
        knots = knots_of(trajectory, stated)
        yield knot_grid(trajectory, knots, None, stamps.first)
        if stamps.count > knots.times.size:
            yield knot_grid(trajectory, knots, output.rate, stamps.first)


def _rates(plan: Plan, stamps: _Stamps) -> Iterator[float]:
    """Yield the rates of which the stamps may be all times, the simplest ones; the job's first."""
    duration, count = plan.trajectory.duration, stamps.count
    if count <= 2:
        if count == 2 and duration > 0:
            yield 0.5 / duration
        elif duration == 0:
            yield plan.loaded.job.output.rate
        return
    period = (stamps.last[0] - stamps.first) / (count - 2)
    largest = max(abs(stamps.first), abs(stamps.last[1]))
    off = (stamps.doubt + _ULPS * float(np.spacing(largest))) / (count - 2)
    if period <= 2 * off:
        return
    asked = plan.loaded.job.output.rate
    if abs(1 / asked - period) <= off:
        yield asked
    yield float(simplest_between(Fraction(1 / (period + off)), Fraction(1 / (period - off))))
    yield 1 / period


def _first_difference(rows: _Rows, plan: Plan, grid: Grid, halves: Array, stamps: _Stamps) -> str | None:
    """Return where the first row differs from the plan on a grid that its stamps fit; None where none."""
    robot, done = plan.loaded.robot_of_rows, 0
    wanted = sample(plan.trajectory, grid, rows.groups, robot=robot, size=_ROWS)
    for block, planned, (_, local) in zip(rows.blocks(), wanted, grid.blocks(_ROWS), strict=True):
        expected = planned[:, rows.index]
        off = np.abs(block - expected)
        off[:, rows.time] = 0.0
        slack = halves + _BITS * np.maximum(1.0, np.abs(expected))
        wrong = np.flatnonzero((off > slack).any(axis=1))
        if wrong.size:
            of_rows = _Known(rows, plan, halves, stamps)
            at = of_rows.first_wrong(block, local, wrong)
            if at is not None:
                return of_rows.said(block[at], expected[at], off[at] - slack[at], done + at + 1)
        done += len(block)
    return None


def _beside(rows: _Rows, plan: Plan, halves: Array, stamps: _Stamps) -> str:
    """Return what rows are whose stamps are none of the motion: a part of it, or others."""
    duration = plan.trajectory.duration
    if rows.kept is None or stamps.count < 2 or np.diff(rows.kept[:, rows.time]).min() <= 2 * _NANOSECOND:
        return _NO_GRID
    first, last = stamps.first - plan.loaded.job.output.start_time, stamps.last[1] - stamps.first
    if abs(last - duration) <= 2 * _NANOSECOND:
        return _NO_GRID
    others = f"they last {last:.9g} s, and the motion {duration:.9g} s"
    if first + last - duration > 2 * _NANOSECOND:
        return others
    part = ListedGrid(duration, rows.kept[:, rows.time] - stamps.first + max(first, 0.0))
    if first < -2 * _NANOSECOND or _first_difference(rows, plan, part, halves, stamps) is not None:
        return others
    return f"they are a part of it alone, from {first:.9g} s to {first + last:.9g} s of {duration:.9g} s"


def _backward(rows: _Rows, plan: Plan, halves: Array, stamps: _Stamps) -> str | None:
    """Return that rows are those of the motion from its end to its start; None where they are others."""
    duration = plan.trajectory.duration
    if rows.kept is None or abs(stamps.last[1] - stamps.first - duration) > 2 * _NANOSECOND:
        return None
    if np.diff(rows.kept[:, rows.time]).min(initial=np.inf) <= 2 * _NANOSECOND:
        return None
    signs = np.array([-1.0 if (column.kind in _ODD) else 1.0 for column in rows.columns])
    turned = rows.kept[::-1] * signs
    turned[:, rows.time] = stamps.last[1] - rows.kept[::-1, rows.time]
    moves = [k for k, column in enumerate(rows.columns) if column.kind == "move"]
    # as `reverse` writes it: a row is of the move that follows, on the way back as well
    edited = turned.copy()
    edited[:, moves] = np.concatenate([rows.kept[-2::-1, moves], rows.kept[:1, moves]])
    grid = ListedGrid(duration, np.clip(turned[:, rows.time], 0.0, duration))
    for back in (turned, edited) if moves else (turned,):
        if _first_difference(replace(rows, kept=back), plan, grid, halves, stamps) is None:
            return "they are it backward, from its end to its start"
    return None


def _stands_on(rows: _Rows, grid: Grid, stamps: _Stamps) -> bool:
    """Return whether the stamps are the times of a grid that has as many, but for where they begin."""
    shift: float | None = None
    for block, (times, _) in zip(rows.blocks(), grid.blocks(_ROWS), strict=True):
        t = block[:, rows.time]
        shift = float(t[0] - times[0]) if shift is None else shift
        slack = stamps.doubt + _ULPS * np.spacing(np.abs(t) + abs(shift))
        if (np.abs(t - times - shift) > slack).any():
            return False
    return True


@frozen
class _Known:
    """What it takes to look at single rows once more: its moment is known to the rounding of its stamp."""

    rows: _Rows
    plan: Plan
    halves: Array
    stamps: _Stamps

    def first_wrong(self, block: Array, local: Array, wrong: NDArray[np.intp]) -> int | None:
        """Return the first of the rows `wrong` (k,) that is none within the rounding of its stamp."""
        within = self.stamps.rounding + _ULPS * float(np.spacing(abs(self.stamps.last[1]) + local[-1]))
        near = np.stack([self._at(local[wrong] + shift) for shift in (-within, 0.0, within)])
        values = block[wrong]
        self._turn_signs(near, values)
        between = np.abs(np.diff(near, axis=0)).min(axis=0)  # the larger one of both is a step
        slack = self.halves + between + _BITS * np.maximum(1.0, np.abs(near[1]))
        off = np.abs(values - near).min(axis=0)
        off[:, self.rows.time] = 0.0
        differs = np.flatnonzero((off > slack).any(axis=1))
        return int(wrong[differs[0]]) if differs.size else None

    def _turn_signs(self, near: Array, values: Array) -> None:
        """Give the quaternions of rows that were sampled alone the sign that they have in the file."""
        parts = [k for k, column in enumerate(self.rows.columns) if column.kind in ("qw", "qx", "qy", "qz")]
        against = (near[..., parts] * values[:, parts]).sum(axis=-1) < 0
        near[..., parts] = np.where(against[..., None], -near[..., parts], near[..., parts])

    def _at(self, local: Array) -> Array:
        """Return the rows of the motion at some times, SI, shape (k, m)."""
        trajectory = self.plan.trajectory
        times = np.clip(local, 0.0, trajectory.duration)
        apart = (np.diff(times) > 2 * _NANOSECOND).all()
        together = [times] if apart else times[:, None]
        grids = (ListedGrid(trajectory.duration, each) for each in together)
        robot = self.plan.loaded.robot_of_rows
        parts = [part for grid in grids for part in sample(trajectory, grid, self.rows.groups, robot=robot)]
        return np.concatenate(parts)[:, self.rows.index]

    def said(self, found: Array, expected: Array, over: Array, number: int) -> str:
        """Return what is wrong with a row, by its worst column."""
        worst = int(over.argmax())
        column = self.rows.columns[worst]
        value, wanted = found[worst] / column.factor, expected[worst] / column.factor
        return f"row {number} has {column.name} {value:.12g}, the motion has {wanted:.12g} there"
