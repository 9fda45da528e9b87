"""Segments that overlap in time: each begins before the one before it has ended, so that corners are cut.

The place is p0 + sum_i (c_i(s_i(t)) - c_i(0)), the textbook's formula for a chain of anticipated segments,
and the orientation R0 prod_i exp(f_i(t) v_i) with the rotation vectors v_i of the segments and the part f_i
of each that is done.

Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 4.3.2, eq. 4.43.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from trajcli.curves.operations import merge_breaks
from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side, concatenate, constant
from trajcli.errors import Amount, PlanningError, Problem
from trajcli.frozen import frozen
from trajcli.geometry.paths.orientation import turn_vectors
from trajcli.geometry.paths.position import PositionCurve
from trajcli.geometry.rotation import exp
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.following.tolerance import Tolerance
from trajcli.kinematics.following.tool_path import ToolPath, ToolReference
from trajcli.kinematics.robot import ToolLimits
from trajcli.planners.law_shapes import Stretch, stretch_of
from trajcli.planners.path import PathMove
from trajcli.planners.tool_law import bounds_for, rates_of_segment
from trajcli.planners.tool_orientation import orientation_along
from trajcli.planners.tool_target import ToolTarget

_ONE_TIME = 1e-9  # of the duration: times this close to each other are one


@frozen
class Overlapped:
    """Segments under way, some at once.

    Attributes:
        before: Pose at the start, (4, 4).
        places: The segments.
        vectors: Rotation vectors of the segments, in the axes of where they begin, shape (k, 3).
        laws: s_i(t) over the whole duration.
        last: The target of the last segment.
        turns: Changes of yaw or pitch, rad, one for each segment.
    """

    before: Array
    places: tuple[PositionCurve, ...]
    vectors: Array
    laws: tuple[PiecewisePolynomial, ...]
    last: ToolTarget
    turns: Array

    def timed(self, times: Array, side: Side) -> ToolReference:
        """Return the demand at times (N,)."""
        count = times.size
        poses = np.tile(self.before, (count, 1, 1))
        first, second = np.zeros((count, 6)), np.zeros((count, 6))
        aims = np.zeros((count, 3))
        for place, vector, law, turn in zip(self.places, self.vectors, self.laws, self.turns, strict=True):
            rates = law.evaluate_orders(times, (0, 1, 2), side=side)[:, :, 0]
            s = np.clip(rates[:, 0], 0.0, place.length)
            p, slope, bend = place.evaluate(s, side)
            poses[:, :3, 3] += p - place.evaluate(np.zeros(1))[0]
            first[:, :3] += slope * rates[:, 1:2]
            second[:, :3] += bend * rates[:, 1:2] ** 2 + slope * rates[:, 2:]
            part = rates / place.length
            axis = poses[:, :3, :3] @ vector
            own = axis * part[:, 1:2]
            second[:, 3:] += axis * part[:, 2:] + np.cross(first[:, 3:], own)
            first[:, 3:] += own
            poses[:, :3, :3] = poses[:, :3, :3] @ exp(vector * part[:, :1])
            aims += turn * part
        target = self.last
        if target.orientation not in ("yaw", "pitch"):
            aims = aims[:, :0]
        else:
            aims[:, 0] += ToolPath.begins(self.before, target.orientation, target.tool_axis)
        return ToolReference(
            poses, first, second, target.position, target.orientation, target.tool_axis, aims
        )


def overlapped(
    before: Array,
    places: Sequence[PositionCurve],
    targets: Sequence[ToolTarget],
    move: PathMove,
    limits: ToolLimits,
    tolerance: Tolerance,
) -> ToolMotion:
    """Return the motion of segments that overlap by the move's time.

    Raises:
        PlanningError: When a segment is shorter than the overlap.
    """
    rotations = np.stack([before[:3, :3], *(target.pose[:3, :3] for target in targets)])
    if move.orientation == "fixed":
        orientation_along("fixed", before[:3, :3], targets, places[0], None)
    vectors = turn_vectors(rotations[:-1], rotations[1:])
    stretches = _stretches(places, vectors, move, limits)
    begins = np.concatenate([[0.0], np.cumsum([s.law.duration - (move.overlap or 0.0) for s in stretches])])
    _check(stretches, move.overlap or 0.0)
    end = float(begins[-1] + (move.overlap or 0.0))
    laws = [
        _padded(stretch.law, float(start), end) for stretch, start in zip(stretches, begins[:-1], strict=True)
    ]
    merged = merge_breaks(laws)
    whole = PiecewisePolynomial(merged.breaks, merged.coefficients.sum(axis=2, keepdims=True))
    edges = [stretch.breaks + start for stretch, start in zip(stretches, begins[:-1], strict=True)]
    breaks = _distinct(np.concatenate(edges), end)
    turns = np.array([target.turn for target in targets])
    segments = Overlapped(before, tuple(places), vectors, tuple(laws), targets[-1], turns)
    return ToolMotion(None, whole, segments.timed, breaks, tolerance)


def _stretches(
    places: Sequence[PositionCurve],
    vectors: Array,
    move: PathMove,
    limits: ToolLimits,
) -> list[Stretch]:
    spec, total = move.law, sum(place.length for place in places)
    whole = None
    if spec.duration is not None:
        whole = spec.duration + (len(places) - 1) * (move.overlap or 0.0)
    stretches, crowd = [], _crowd(places)
    lower = replace(
        limits, acceleration=limits.acceleration / crowd, jerk=limits.jerk / 2
    )  # two at once add up
    for place, vector in zip(places, vectors, strict=True):
        rates = rates_of_segment(place, float(np.linalg.norm(vector)) / place.length)
        bounds, _ = bounds_for(spec, lower, rates, "path")
        share = None if whole is None else whole * place.length / total
        stretches.append(stretch_of(spec, place.length, bounds, share))
    if spec.minimum_duration is None:
        return stretches
    lasts = sum(stretch.law.duration for stretch in stretches)
    least = spec.minimum_duration + (len(places) - 1) * (move.overlap or 0.0)
    return stretches if lasts >= least else [stretch.scaled(least / lasts) for stretch in stretches]


def _crowd(places: Sequence[PositionCurve]) -> float:
    """Return how many accelerations along a segment add up to where one slows down and the next speeds up."""
    turns = [
        after.evaluate(np.zeros(1))[1][0] - before.evaluate(np.array([before.length]), "left")[1][0]
        for before, after in pairwise(places)
    ]
    return max(1.0, *(float(np.linalg.norm(turn)) for turn in turns))


def _check(stretches: Sequence[Stretch], overlap: float) -> None:
    for index, stretch in enumerate(stretches):
        sides = 1 if index in (0, len(stretches) - 1) else 2
        if stretch.law.duration < sides * overlap:
            message = f"segment {index} lasts {{lasts}}, too short to overlap its neighbours by {{overlap}}"
            amounts = {"lasts": Amount(stretch.law.duration), "overlap": Amount(overlap)}
            hint = "shorten `overlap`, or go slower"
            raise PlanningError(Problem(message, hint, amounts=amounts))


def _padded(law: PiecewisePolynomial, start: float, end: float) -> PiecewisePolynomial:
    """Return the law at rest before `start` and after it is done, over [0, end]."""
    before = constant(np.zeros(1), start)
    rest = end - start - law.duration
    after = constant(law.piece_ends()[1][-1], rest if rest > _ONE_TIME * end else 0.0)
    joined = concatenate([before, law, after])
    breaks = joined.breaks.copy()
    breaks[-1] = end
    return PiecewisePolynomial(breaks, joined.coefficients)


def _distinct(times: Array, end: float) -> Array:
    """Return the distinct times within [0, end], those that rounding keeps apart made one."""
    ordered = np.sort(np.clip(times, 0.0, end))
    keep = np.append(True, np.diff(ordered) > _ONE_TIME * end)
    distinct = ordered[keep]
    distinct[-1] = end
    return np.asarray(distinct)
