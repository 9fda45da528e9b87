"""Recorded tool along the line, arc or path of a job: distance, orientation and branch, on rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.extrema import peaks
from trajcli.curves.piecewise import Array, horner
from trajcli.findings import Certainty, Collector, Finding, at_time, tool_excess_amounts
from trajcli.judge.intervals import DENSE, Intervals
from trajcli.judge.rounding import stated_errors
from trajcli.kinematics.dexterity import changes_of_sign, characteristic_length
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.inverse.target import determinants, residuals
from trajcli.kinematics.jacobian import linearisation
from trajcli.kinematics.robot import Robot
from trajcli.limits.tolerances import exceeds
from trajcli.trajectory import MoveInterval

_SAMPLES = 1000  # of a path, where the nearest point is looked for first
_STEPS = 8  # of Gauss and Newton from there
_ROWS = 1024  # at a time
_INSIDE = 1e-6  # of the distance of samples: so far from a corner a place is on its side
_LATE = 1e-9  # s: by so much the stamp of a row at the end of a move is beyond it
_FURTHER = 2.0  # times the longer of two steps of the tool from row to row: how far along the path it may get


class RecordedPath:
    """The tool of one move beside the path on which it shall be."""

    def __init__(
        self,
        robot: Robot,
        motion: ToolMotion,
        move: int,
        worst: Collector,
        parts: Sequence[MoveInterval] = (),
    ) -> None:
        """Begin with no rows.

        Args:
            robot: An arm with geometry.
            motion: Where its tool shall go; with a path.
            move: Index of the move.
            worst: What is added to.
            parts: Of a move that flies by a corner: in a zone its tool is on no path.
        """
        assert motion.path is not None  # noqa: S101
        self._robot, self._motion, self._move, self._worst = robot, motion, move, worst
        self._path: ToolPath = motion.path
        self._arm = characteristic_length(robot)
        inner = np.linspace(0.0, self._path.length, _SAMPLES)
        self._s = np.unique(np.concatenate([inner, self._path.breaks]))
        self._poses = self._path.poses.evaluate(self._s, "right")[0]
        self._signs = [0.0, 0.0]  # of the determinant in the last row, and in the last middle between rows
        step = self._path.length / _SAMPLES
        self._slack, self._near = 2.0 * step, step**2  # samples beside a place, and squared distances alike
        self._limits = np.array([motion.tolerance.position, motion.tolerance.angle])
        self._fast = float(peaks(motion.law, (1,))[0].magnitude[0])
        self._before: tuple[float, Array, float] | None = None  # place, coordinates and time of a row
        self._step = 0.0  # of the tool, up to that row
        self._begins = next((part.start for part in parts if part.tool is motion), 0.0)
        self._ends = parts[-1].end if parts else motion.law.end
        borders = motion.law.evaluate(np.array([motion.law.start, motion.law.end]))[:, 0]
        self._zones = [  # with the place of the path on its border
            (part.around, float(borders[int(part.start > self._begins)])) for part in parts if part.around
        ]

    def see(self, window: Intervals, pieces: slice, *, asked: bool) -> None:
        """Judge the rows of some pieces, and the middle between them.

        Straight lines of joints between rows that stand dense, for which nobody asked, are only warned of.
        """
        last = pieces.stop + (window.ends and pieces.stop == window.last)
        q = np.asarray(window.states[0])
        for low in range(pieces.start, last, _ROWS):
            rows = np.arange(low, min(low + _ROWS, last))
            slack = self._slack_of(q[rows], window)
            along = self._judge(q[rows], window.t[rows], window.rows[rows], slack)
            kept = (rows < pieces.stop) & (window.moves[np.minimum(rows + 1, window.last)] == self._move)
            inner, along = rows[kept], along[kept]
            degree = int(window.highest[pieces].max(initial=0))
            if degree > 0 and inner.size:
                half = 0.5 * window.lengths[inner]
                middle = horner(window.coefficients[:, inner], half[:, None])
                warned = degree == 1 and not asked and 2.0 * half.max() <= DENSE
                t, rows = window.t[inner] + half, window.rows[inner]
                slack = self._slack_between(inner, window)
                self._judge(middle, t, rows, slack, (along, half), warned=warned)

    def see_between(self, window: Intervals, pieces: slice, since: Array) -> None:
        """Judge the middles of pieces that begin in places of the planned motion.

        Args:
            window: The rows, whose pieces need not be neighbours.
            pieces: Which ones.
            since: When each of them begins, s from the start of the move, shape (pieces,).
        """
        law = self._motion.law
        own = np.flatnonzero(
            since + window.lengths[pieces] <= self._ends + _LATE
        )  # of others the next move has part
        chosen = pieces.start + own
        if not chosen.size:
            return
        half = 0.5 * window.lengths[chosen]
        middle = horner(window.coefficients[:, chosen], half[:, None])
        along = law.evaluate(np.clip(since[own] - self._begins, law.start, law.end))[:, 0]
        slack = self._slack_of(middle, window)
        self._judge(middle, window.t[chosen] + half, window.rows[chosen], slack, (along, half))

    def _slack_of(self, q: Array, window: Intervals) -> Array:
        """Return by how much the tool may be off by the rounding of the rows, m and rad alike, (N,)."""
        off = stated_errors(q, *window.resolution.roundings[0])
        return np.asarray(2.0 * max(self._arm, 1.0) * off.sum(axis=1))

    def _slack_between(self, pieces: NDArray[np.intp], window: Intervals) -> Array:
        """Return the same of the curves between rows, which rounding of their rates moves, too, (m,)."""
        off = np.empty(pieces.size)
        for chosen, rows in window.rows_by_level(pieces):
            error = replace(rows, late=np.zeros_like(rows.late)).error(0)
            off[chosen] = error.reshape(chosen.size, -1).sum(axis=1)
        return np.asarray(2.0 * max(self._arm, 1.0) * off)

    def _judge(
        self,
        q: Array,
        t: Array,
        numbers: NDArray[np.int64],
        slack: Array,
        before: tuple[Array, Array] | None = None,
        *,
        warned: bool = False,
    ) -> Array:
        """Judge rows, or what lies behind rows of known s by some seconds; return their s (N,)."""
        s, on_path = np.empty(len(q)), np.ones(len(q), dtype=bool)
        for around, border in self._zones:
            within = around.holds(q, slack[:, None] + self._limits)
            s[within], on_path[within] = border, False
        rows = np.flatnonzero(on_path)
        if rows.size:
            near = None if before is None else (before[0][rows], before[1][rows])
            s[rows] = self._judge_on_path(q[rows], (t[rows], numbers[rows], slack[rows]), near, warned=warned)
        return s

    def _judge_on_path(
        self,
        q: Array,
        rows: tuple[Array, NDArray[np.int64], Array],
        before: tuple[Array, Array] | None,
        *,
        warned: bool,
    ) -> Array:
        """Judge rows outside of zones, with their times, numbers and slacks; return their s (N,)."""
        t, numbers, _ = rows
        poses, jacobians = linearisation(self._robot, q)
        s = self._nearest(poses, t, before)
        sizes, limits = self._sizes(s, poses), self._limits
        self._across_corners(s, sizes, poses)
        for quantity, size, limit in zip(("position", "orientation"), sizes.T, limits, strict=True):
            self._add(quantity, size, limit, rows, warned=warned)
        target = self._path.at_s(s, "right").target()
        of_rows = determinants(target, poses, jacobians, self._arm)
        if of_rows is not None:
            self._watch_branch(np.sign(of_rows), t, numbers, int(before is not None))
        return s

    def _sizes(self, s: Array, poses: Array) -> Array:
        """Return how far the tool is from places of the path, m, and turned from there, rad, shape (N, 2)."""
        target = self._path.at_s(s, "right").target()
        off, split = residuals(target, poses), sum(target.position)
        return np.stack([np.linalg.norm(part, axis=1) for part in (off[:, :split], off[:, split:])], axis=1)

    def _across_corners(self, s: Array, sizes: Array, poses: Array) -> None:
        """Put rows that are beside the path on the other side of the nearest corner, where they are nearer.

        Both sides of a sharp corner are as near as the samples are apart, and further on, too, where a path
        comes back on its own way: only the orientation tells them apart. Of the rows put there s (N,) and
        `sizes` (N, 2) are replaced.
        """
        inner = self._path.breaks[1:-1]
        beside = np.flatnonzero(exceeds(sizes, self._limits).any(axis=1))
        if not (beside.size and inner.size):
            return
        corner = 1 + np.abs(s[beside, None] - inner).argmin(axis=1)
        side = np.where(s[beside] < self._path.breaks[corner], 0, -1)  # the segment behind, or before it
        within = self._path.breaks[corner + side], self._path.breaks[corner + side + 1]
        other = self._refined(2.0 * self._path.breaks[corner] - s[beside], poses[beside], within)
        found = self._sizes(other, poses[beside])
        nearer = (found / self._limits).max(axis=1) < (sizes[beside] / self._limits).max(axis=1)
        s[beside[nearer]], sizes[beside[nearer]] = other[nearer], found[nearer]

    def _nearest(self, poses: Array, t: Array, before: tuple[Array, Array] | None) -> Array:
        """Return the values of s (N,) at which the path is nearest to the tool, each near the one before."""
        turning = self._path.poses.pure_rotation
        rows = slice(0, 3)
        of_path, own = (
            (each[:, rows, :3].reshape(len(each), -1) if turning else each[:, :3, 3])
            for each in (self._poses, poses)
        )
        square = (own**2).sum(axis=1)[:, None] - 2.0 * own @ of_path.T + (of_path**2).sum(axis=1)
        if before is None:
            return self._refined(self._s[self._followed(square, own, t, poses)], poses)
        far = np.abs(self._s - before[0][:, None]) > (self._slack + self._fast * before[1])[:, None]
        square[far] = np.inf
        found = square.argmin(axis=1)
        near = square <= square.min(axis=1)[:, None] + self._near
        for k in np.flatnonzero(np.diff(near, prepend=False, axis=1).sum(axis=1) > 2).tolist():
            passed = self._on_path(np.flatnonzero(near[k]), square[k], poses[k])
            found[k] = passed[square[k, passed].argmin()]
        return self._refined(self._s[found], poses)

    def _on_path(self, near: NDArray[np.intp], square: Array, pose: Array) -> NDArray[np.intp]:
        """Return of samples that are as near those beside places where the tool is on the path, if any is.

        Where a path comes back to a place, or goes to and fro, the orientation tells when it is there.
        """
        if near[-1] - near[0] < near.size:
            return near
        groups = np.split(near, np.flatnonzero(np.diff(near) > 1) + 1)
        poses = np.broadcast_to(pose, (len(groups), 4, 4))
        nearest = [group[square[group].argmin()] for group in groups]
        off = (self._sizes(self._refined(self._s[nearest], poses), poses) / self._limits).max(axis=1)
        return np.concatenate([groups[k] for k in np.flatnonzero(off <= max(1.0, off.min()))])

    def _refined(self, s: Array, poses: Array, within: tuple[Array, Array] | None = None) -> Array:
        """Return the values of s (N,) at which the path is nearest to the tool, from values beside them."""
        turning, step = self._path.poses.pure_rotation, self._path.length / _SAMPLES
        low, high = (0.0, self._path.length) if within is None else within
        if within is not None:
            low, high = low + _INSIDE * step, high - _INSIDE * step
            s = np.clip(s, low, high)
        for _ in range(_STEPS):
            reference = self._path.at_s(s, "right")
            slope = reference.first[:, 3:] if turning else reference.first[:, :3]
            apart = self._apart(reference.poses, poses, turning=turning)
            size = np.maximum((slope**2).sum(axis=1), 1e-300)
            change = np.clip((slope * apart).sum(axis=1) / size, -step, step)
            before, s = s, np.clip(s + change, low, high)
            if np.array_equal(s, before):
                break
        return np.asarray(s)

    def _followed(self, square: Array, own: Array, t: Array, poses: Array) -> NDArray[np.intp]:
        """Return the indices of the nearest samples, each no further from the one before than the tool gets.

        A path may pass a place twice, or end where it starts: of the first row the earliest place counts, and
        behind it, of places that are as near, the one to which the tool gets when it goes on along the path.
        `square` (N, samples) are squared distances of the rows, `own` (N, d) their coordinates.
        """
        found = np.empty(len(own), dtype=np.intp)
        for k, coordinates in enumerate(own):
            if self._before is None:
                near = square[k] <= square[k].min() + self._near
                start = int(near.argmax())
                end = start + int(np.append(near[start:], False).argmin())
                found[k] = start + square[k, start:end].argmin()
            else:
                at, last, time = self._before
                moved = float(np.sqrt((coordinates - last) @ (coordinates - last)))
                reach = _FURTHER * max(moved, self._step) + self._fast * (float(t[k]) - time) + self._slack
                self._step = moved  # around the end of a way that is its own way back the next one is short
                low, high = np.searchsorted(self._s, [at - reach, at + reach])
                window = square[k, low : max(high, low + 1)]
                near = low + np.flatnonzero(window <= window.min() + self._near)
                near = self._on_path(near, square[k], poses[k])
                onward = near[self._s[near] >= at]
                near = onward if onward.size else near
                found[k] = near[np.abs(self._s[near] - at - moved).argmin()]
            self._before = float(self._s[found[k]]), coordinates, float(t[k])
        return found

    @staticmethod
    def _apart(reference: Array, poses: Array, *, turning: bool) -> Array:
        """Return the vector from the reference to the tool, or about which it is turned to first order."""
        if not turning:
            return np.asarray(poses[:, :3, 3] - reference[:, :3, 3])
        axes = (np.cross(reference[:, :3, k], poses[:, :3, k]) for k in range(3))
        return np.asarray(0.5 * sum(axes))

    def _add(
        self,
        quantity: str,
        sizes: Array,
        limit: float,
        rows: tuple[Array, NDArray[np.int64], Array],
        *,
        warned: bool,
    ) -> None:
        t, numbers, slack = rows
        over = np.flatnonzero(exceeds(sizes, limit + slack if warned else limit))
        if not over.size:
            return

        def make(k: int) -> Finding:
            row = over[k]
            value, off = float(sizes[row]), float(slack[row])
            return _deviation(quantity, value, limit, float(t[row]), int(numbers[row]), off)

        certain = sizes[over] - limit > slack[over]
        joints = np.full(over.size, -1)
        groups: tuple[tuple[NDArray[np.bool_], Certainty], ...] = (
            (certain, "exceeded"),
            (~certain, "within rounding"),
        )
        for chosen, certainty in groups:
            self._worst.add(
                "deviation",
                self._move,
                joints,
                sizes[over],
                make,
                quantity=quantity,
                severity="warning" if warned else "error",
                certainty=certainty,
                chosen=chosen,
            )

    def _watch_branch(self, signs: Array, t: Array, numbers: NDArray[np.int64], kind: int) -> None:
        """Note where the determinant that the path fixes changes its sign, in rows, 0, or in middles, 1."""
        signs = np.append(self._signs[kind], signs)
        changes = changes_of_sign(signs) - 1
        self._signs[kind] = float(signs[signs != 0.0][-1]) if signs.any() else 0.0
        if not changes.size:
            return

        def make(k: int) -> Finding:
            time = float(t[changes[k]])
            return Finding(
                rule="path",
                kind="branch",
                time=time,
                row=int(numbers[changes[k]]),
                method="sampled",
                message=f"the arm changes its branch {at_time(time)}: it passes a singularity",
                hint="move the path",
            )

        self._worst.add("branch", self._move, np.full(changes.size, -1), np.ones(changes.size), make)


def _deviation(quantity: str, value: float, limit: float, time: float, row: int, rounding: float) -> Finding:
    """Return that the tool is beside its path, m, or turned from it, rad."""
    dimension: Literal["length", "angle"] = "length" if quantity == "position" else "angle"
    what = "is beside" if quantity == "position" else "is turned from"
    return Finding(
        rule="path",
        kind="deviation",
        value=value,
        limit=limit,
        time=time,
        row=row,
        method="sampled",
        quantity=quantity,
        rounding=rounding,
        message=f"the tool {what} its path by {{value}} {at_time(time)}, promised are {{limit}}",
        amounts=tool_excess_amounts(value, limit, 0, dimension),
    )
