"""Segments that overlap in time: each begins before the one before it has ended, so that corners are cut.

The position is p0 + sum_i (c_i(s_i(t)) - c_i(0)), the textbook's formula for anticipated segments, and the
orientation R0 prod_i exp(f_i(t) v_i) with the rotation vectors v_i of the segments and the part f_i of each
that is done.

Source: Siciliano et al. (2009), section 4.3.2, eq. 4.43.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property, partial
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.operations import merge_breaks
from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side
from trajcli.errors import Amount, PlanningError, Problem
from trajcli.frozen import frozen
from trajcli.geometry.paths.orientation import turn_vectors
from trajcli.geometry.paths.position import PositionCurve
from trajcli.geometry.rotation import exp
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.following.tolerance import probes
from trajcli.kinematics.following.tool_path import ToolPath, ToolReference
from trajcli.kinematics.robot import ToolLimits
from trajcli.planners.tool_path.derivatives import PathDerivatives, largest, largest_norm
from trajcli.planners.tool_path.law import LawSegment, lasting_at_least, law_bounds
from trajcli.planners.tool_path.move import ToolPathMove, ToolTarget, orientation_along

_ONE_TIME = 1e-9  # of the duration: times this close to each other are one
_ROUNDS = 30  # in which segments that are over a limit together are slowed down


@frozen
class OverlappingSegments:
    """Segments of which two are in progress at once around each corner, and never more.

    Attributes:
        before: Pose at the start, (4, 4).
        curves: Positions of the segments.
        vectors: Rotation vectors of the segments, in the axes of where they begin, shape (k, 3).
        laws: s_i(t), each from the time at which its segment begins to that at which it is done.
        last: The target of the last segment.
        turns: Changes of yaw or pitch, rad, one for each segment.
    """

    before: Array
    curves: tuple[PositionCurve, ...]
    vectors: Array
    laws: tuple[PiecewisePolynomial, ...]
    last: ToolTarget
    turns: Array

    def reference_at(self, times: Array, side: Side) -> ToolReference:
        """Return what the tool shall do at times (N,)."""
        order = np.argsort(times, kind="stable")
        ordered, first, second = times[order], np.zeros((times.size, 6)), np.zeros((times.size, 6))
        begun, done = self._rows_in_progress(ordered, side)
        behind = np.searchsorted(done, np.arange(times.size), "right")
        poses, aims = self._poses[behind], np.zeros((times.size, 3))
        aims[:, 0] = np.append(0.0, np.cumsum(self.turns))[behind]
        for k in np.flatnonzero(begun < done).tolist():
            rows = slice(begun[k], done[k])
            self._add(k, ordered[rows], side, poses[rows], first[rows], second[rows], aims[rows])
        back = np.argsort(order)
        target = self.last
        if target.orientation not in ("yaw", "pitch"):
            aims = aims[:, :0]
        else:
            aims[:, 0] += ToolPath.angle_of(self.before, target.orientation, target.tool_axis)
        return ToolReference(
            poses[back],
            first[back],
            second[back],
            target.position,
            target.orientation,
            target.tool_axis,
            aims[back],
        )

    def _rows_in_progress(self, ordered: Array, side: Side) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return the first row (k,) of increasing times in which each segment is begun, and is done."""
        opposite: Side = "right" if side == "left" else "left"
        starts, ends = (np.array([getattr(law, name) for law in self.laws]) for name in ("start", "end"))
        begun, done = (np.searchsorted(ordered, edges, opposite) for edges in (starts, ends))
        begun[0], done[-1] = 0, ordered.size  # start and end have one side only
        return begun, done

    def _add(
        self, k: int, times: Array, side: Side, poses: Array, first: Array, second: Array, aims: Array
    ) -> None:
        """Add what segment k does at times (m,) to the rows of those that began before it."""
        curve, law = self.curves[k], self.laws[k]
        rates = law.evaluate_orders(np.clip(times, law.start, law.end), (0, 1, 2), side=side)[:, :, 0]
        s = np.clip(rates[:, 0], 0.0, curve.length)
        p, tangent, curvature = curve.evaluate(s, side)
        poses[:, :3, 3] += p - curve.evaluate(np.zeros(1))[0]
        first[:, :3] += tangent * rates[:, 1:2]
        second[:, :3] += curvature * rates[:, 1:2] ** 2 + tangent * rates[:, 2:]
        part = rates / curve.length
        axis = poses[:, :3, :3] @ self.vectors[k]
        own = axis * part[:, 1:2]
        second[:, 3:] += axis * part[:, 2:] + np.cross(first[:, 3:], own)
        first[:, 3:] += own
        poses[:, :3, :3] = poses[:, :3, :3] @ exp(self.vectors[k] * part[:, :1])
        aims += self.turns[k] * part

    @cached_property
    def _poses(self) -> Array:
        """The pose (k + 1, 4, 4) after no segment, after the first one, and so on to the last."""
        poses = np.tile(self.before, (len(self.curves) + 1, 1, 1))
        for k, (curve, turned) in enumerate(zip(self.curves, exp(self.vectors), strict=True), 1):
            ends = curve.evaluate(np.array([0.0, curve.length]), "left")[0]
            poses[k, :3, 3] = poses[k - 1, :3, 3] + ends[1] - ends[0]
            poses[k, :3, :3] = poses[k - 1, :3, :3] @ turned
        return poses


def overlapping_motion(
    before: Array,
    curves: Sequence[PositionCurve],
    targets: Sequence[ToolTarget],
    move: ToolPathMove,
    overlap: float,
    limits: ToolLimits,
) -> ToolMotion:
    """Return the motion of segments that overlap by a time, s.

    Raises:
        PlanningError: When a segment is shorter than the overlap.
    """
    rotations = np.stack([before[:3, :3], *(target.pose[:3, :3] for target in targets)])
    if move.orientation == "fixed":
        orientation_along("fixed", before[:3, :3], targets, curves[0], None)
    vectors = turn_vectors(rotations[:-1], rotations[1:])
    bounds = np.array([*vars(limits).values()]).reshape(2, 3)
    turns = [
        after.evaluate(np.zeros(1))[1] - until.evaluate(np.array([until.length]), "left")[1]
        for until, after in pairwise(curves)
    ]
    slowing = max(1.0, largest_norm(np.array(turns)))  # one, and the next speeding up: that adds up
    lower = bounds / [[1.0, slowing, 2.0], [1.0, 1.0, 2.0]]
    for number in range(_ROUNDS if move.law.duration is None else 1):
        limits = ToolLimits(*lower.ravel().tolist())
        motion = _motion(before, curves, vectors, targets, move, overlap, limits)
        times = np.sort(np.append(motion.breaks, probes(motion.breaks)))
        over = largest(partial(_sizes, motion), times).reshape(2, 2) / bounds[:, :2]
        if over.max() <= 1 + 1e-9:
            break
        over[:, 1] = over.max(axis=1)  # with longer ramps less of the full speeds adds up
        over[:, 0] *= number >= _ROUNDS / 2
        lower[:, :2] /= np.maximum(1.001 * over, 1.0)  # by a bit more, so that few rounds do
    return motion


def _sizes(motion: ToolMotion, times: Array) -> Array:
    """Return speed and acceleration, and angular ones, at times (N,): the larger of both sides, (N, 4)."""
    sides = [motion.reference(times, side) for side in ("left", "right")]
    rates = np.array([[each.first, each.second] for each in sides]).reshape(2, 2, -1, 2, 3)
    return np.asarray(np.linalg.norm(rates, axis=-1).max(axis=0).transpose(1, 2, 0).reshape(-1, 4))


def _motion(
    before: Array,
    curves: Sequence[PositionCurve],
    vectors: Array,
    targets: Sequence[ToolTarget],
    move: ToolPathMove,
    overlap: float,
    limits: ToolLimits,
) -> ToolMotion:
    """Return the motion of segments of which each keeps limits."""
    spec, total = move.law, math.fsum(curve.length for curve in curves)
    shared, segments = (len(curves) - 1) * overlap, []
    for curve, vector in zip(curves, vectors, strict=True):
        curvature = largest_norm(curve.evaluate(np.zeros(1))[2])  # of a line or an arc: the same everywhere
        derivatives = PathDerivatives(True, curvature, float(np.linalg.norm(vector)) / curve.length, 0.0)
        bounds, _ = law_bounds(spec, limits, derivatives, "path")
        share = None if spec.duration is None else (spec.duration + shared) * curve.length / total
        segments.append(spec.time_law.segment(spec, curve.length, bounds, share))
    segments = lasting_at_least(spec.minimum_duration and spec.minimum_duration + shared, segments)
    _check(segments, overlap)
    starts = np.cumsum([0.0, *(segment.law.duration - overlap for segment in segments)])
    end = float(starts[-1] + overlap)
    pairs = list(zip(segments, starts[:-1], strict=True))
    laws = [PiecewisePolynomial(each.law.breaks + start, each.law.coefficients) for each, start in pairs]
    merged = merge_breaks([_in_turn(laws[first::2], end) for first in (0, 1)])
    whole = PiecewisePolynomial(merged.breaks, merged.coefficients.sum(axis=2, keepdims=True))
    times = np.sort(np.concatenate([each.breaks + start for each, start in pairs]).clip(0.0, end))
    breaks = times[np.append(True, np.diff(times) > _ONE_TIME * end)]
    breaks[-1] = end
    turns = np.array([target.turn for target in targets])
    tool = OverlappingSegments(before, tuple(curves), vectors, tuple(laws), targets[-1], turns)
    return ToolMotion(None, whole, tool.reference_at, breaks, move.tolerance.tolerance)


def _check(segments: Sequence[LawSegment], overlap: float) -> None:
    """Refuse segments that are too short for their overlaps."""
    for index, segment in enumerate(segments):
        sides = 1 if index in (0, len(segments) - 1) else 2
        if segment.law.duration < sides * overlap:
            message = f"segment {index} lasts {{lasts}}, too short to overlap its neighbours by {{overlap}}"
            amounts = {"lasts": Amount(segment.law.duration), "overlap": Amount(overlap)}
            raise PlanningError(Problem(message, "shorten `overlap`, or go slower", amounts=amounts))


def _in_turn(laws: Sequence[PiecewisePolynomial], end: float) -> PiecewisePolynomial:
    """Return what laws that do not overlap add up to over [0, end], at rest between them."""
    breaks, coefficients, s = np.zeros(1), list[Array](), np.zeros(1)
    for start, law in [*((law.start, law) for law in laws), (end, None)]:
        if start - breaks[-1] > _ONE_TIME * end:
            coefficients.append(np.zeros_like(laws[0].coefficients[:, :1]))
            coefficients[-1][-1] = s
            breaks = np.append(breaks, start)
        if law is not None:
            coefficients.append(law.coefficients.copy())
            coefficients[-1][-1] += s
            breaks = np.append(breaks, law.breaks[1:])
            s = s + law.piece_ends()[1][-1]
    breaks[-1] = end
    return PiecewisePolynomial(breaks, np.concatenate(coefficients, axis=1))
