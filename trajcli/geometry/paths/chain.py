"""Composite paths: curves joined to one of one arc length, their corners stopped at or rounded."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.errors import InputError, PlanningError, Problem
from trajcli.frozen import frozen
from trajcli.geometry.paths.corner import (
    REVERSAL,
    Blend,
    CornerKind,
    asked_radii,
    corner_values,
    fitting_radii,
    round_corner,
    sharp_kind,
    turn_between,
)
from trajcli.geometry.paths.orientation import SegmentProgress
from trajcli.geometry.paths.position import (
    SAME_POINT,
    PartOfCurve,
    PositionCurve,
    Side,
    Triple,
    angle_between,
    inside,
    shown_length,
    shown_position,
)
from trajcli.geometry.rotation import Array, exp

if TYPE_CHECKING:
    from trajcli.geometry.paths.many_parts import ManyParts

_MANY = 64  # parts from which on it pays to evaluate many of them together
_NOTHING = 1e-12  # of a segment, which is rounding where two blends meet


@frozen
class Corner:
    """A corner between two segments, as it is in the path.

    Attributes:
        kind: "smooth": direction and curvature go on, nothing to do; "bend": the direction goes on and the
            curvature jumps; "stop": the direction jumps, a law must stop there; "rounded".
        s: Arc length of the chain, m; of a rounded corner the middle of the blend.
        point: Shape (3,), m, where the two segments meet.
        turn: Rad.
        asked: Radius, m.
        used: Radius, m, after shrinking; 0 where nothing was rounded. In a smooth corner the path stays as it
            is, and it is over which one rotation fades into the next one.
        deviation: How far the curve passes from the point, m.
    """

    kind: CornerKind
    s: float
    point: Array
    turn: float
    asked: float
    used: float
    deviation: float


@frozen
class Chain:
    """Curves joined end to start.

    Attributes:
        segments: As they were given, k of them.
        corners: Between them, k - 1.
        parts: What the chain consists of: parts of the segments, and blends.
        borders: Shape (k + 1,), m: where segments begin and end, in the middle of a blend where there is one.
        half_widths: Shape (k - 1,), m: half the length of each blend; the used radius of smooth corners; else
            0.
    """

    segments: tuple[PositionCurve, ...]
    corners: tuple[Corner, ...]
    parts: tuple[PositionCurve, ...]
    borders: Array
    half_widths: Array

    @cached_property
    def offsets(self) -> Array:
        """Where each part begins, and the end, m, one number more than parts."""
        return _offsets(self.parts)

    @cached_property
    def _lengths(self) -> Array:
        return np.array([part.length for part in self.parts])

    @property
    def length(self) -> float:
        """Arc length, m."""
        return float(self.offsets[-1])

    @property
    def breaks(self) -> Array:
        """Where one part ends and the next one begins, m."""
        return self.offsets[1:-1]

    @property
    def stops(self) -> Array:
        """Arc lengths of the corners at which a law must stop, m."""
        return np.array([corner.s for corner in self.corners if corner.kind == "stop"])

    @property
    def progress(self) -> SegmentProgress:
        """How far each segment is done."""
        return SegmentProgress(self.borders, self.half_widths)

    @cached_property
    def _together(self) -> ManyParts | None:
        """Its parts as tables, where these are very many."""
        if len(self.parts) < _MANY:
            return None
        from trajcli.geometry.paths.many_parts import many_parts

        return many_parts(self.parts)

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return p, p', p'' as `PositionCurve` says."""
        if self._together is not None:
            s = inside(s, self.length)
            part = np.searchsorted(self.breaks, s, side)
            local = np.clip(s - self.offsets[part], 0.0, self._lengths[part])
            return self._together.evaluate(part, local, lambda k, own: self.parts[k].evaluate(own, side))
        return self._by_part(s, side, lambda k, local: self.parts[k].evaluate(local, side))

    def transport(self, s: Array, side: Side = "right") -> Triple:
        """Return Q, w', w'' as `PositionCurve` says.

        In a corner that is not rounded Q jumps by the shortest rotation.

        Raises:
            PlanningError: When the path turns back in such a corner: then no rotation is the shortest.
        """

        def turned(k: int, local: Array) -> Triple:
            rotation, rate, change = self.parts[k].transport(local, side)
            before = self._turned_before[k]
            # the rate in world axes is that of the part: its turning starts from the attitude there
            return rotation @ before, rate, change

        return self._by_part(s, side, turned)

    def majorants(self, s: Array, rising: Array) -> tuple[Array, Array]:
        """Return the bounds of p and Q as `PositionCurve` says."""
        part = np.searchsorted(self.breaks, s, "right")

        def of_part(k: int, rows: NDArray[np.intp]) -> tuple[Array, Array]:
            return self.parts[k].majorants(self._local(k, s[rows]), rising[:, rows])

        if self._together is not None:
            return self._together.majorants(part, rising, of_part)
        position, turned = np.zeros(rising.shape), np.zeros(rising.shape)
        for k in np.flatnonzero(np.bincount(part)).tolist():
            rows = np.flatnonzero(part == k)
            position[:, rows], turned[:, rows] = of_part(k, rows)
        return position, turned

    @cached_property
    def _turned_before(self) -> list[Array]:
        """The rotation with which each part begins."""
        result = [np.eye(3)]
        for k, (part, following) in enumerate(pairwise(self.parts)):
            rotation, _, _ = part.transport(np.array([part.length]), "left")
            (arriving, leaving), _ = corner_values(part, following)
            result.append(self._shortest(k, arriving, leaving) @ rotation[0] @ result[-1])
        return result

    def _shortest(self, k: int, first: Array, last: Array) -> Array:
        """Return the shortest rotation from one direction to another, after part k."""
        angle = angle_between(first, last)
        if angle > np.pi - REVERSAL:
            text = (
                f"at s = {{s}} the path turns back by {np.degrees(angle):.6g} deg: "
                "about which axis a tool that keeps its attitude to the path should follow is not determined"
            )
            hint = "orientation: axis_angle or fixed; or a path without a reversal"
            raise PlanningError(Problem(text, hint, amounts={"s": shown_length(self.offsets[k + 1])}))
        axis = np.cross(first, last)
        sine = float(np.linalg.norm(axis))
        return exp(axis * (angle / sine)) if sine > 0.0 else np.eye(3)

    def _by_part(self, s: Array, side: Side, values: Callable[[int, Array], Triple]) -> Triple:
        """Return the values at s (N,), asked of each part by its index and its own arc lengths."""
        s = inside(s, self.length)
        part = np.searchsorted(self.breaks, s, side)
        here = np.flatnonzero(np.bincount(part)) if part.size else part
        if here.size <= 1:
            only = int(here[0]) if here.size else 0
            return values(only, self._local(only, s))
        order = np.argsort(part, kind="stable")
        ends = np.cumsum(np.bincount(part))[here]
        by_part = []
        for k, rows in zip(here.tolist(), np.split(order, ends[:-1]), strict=True):
            by_part.append((rows, values(k, self._local(k, s[rows]))))
        result = tuple(np.empty((s.size, *row.shape[1:])) for row in by_part[0][1])
        for rows, triple in by_part:
            for column, row in zip(result, triple, strict=True):
                column[rows] = row
        return result[0], result[1], result[2]

    def _local(self, part: int, s: Array) -> Array:
        local: Array = np.clip(s - self.offsets[part], 0.0, self._lengths[part])
        return local


class CornerError(PlanningError):
    """A corner between two segments cannot be rounded as it is asked for."""


def join(segments: Sequence[PositionCurve], radii: ArrayLike = 0.0) -> Chain:
    """Return the chain of segments, each of which starts where the one before ends.

    A radius that does not fit is shrunk: neighbours on a short segment share it, one that needs less than
    half leaves the rest to the other. A corner that goes on in direction and curvature is left as it is.

    Args:
        segments: At least one.
        radii: m, one for all corners or one for each (k - 1,); 0 leaves the corner sharp, to be stopped at.

    Raises:
        InputError: When there is no segment, one does not start where the other ends, or radii do not fit.
        CornerError: When a corner to be rounded turns back.
    """
    if not segments:
        raise InputError("a path needs at least one segment")
    _check_joints(segments)
    asked = asked_radii(radii, len(segments) - 1)
    kinds = [sharp_kind(before, after) for before, after in pairwise(segments)]
    cut, faded = fitting_radii(segments, kinds, asked)
    ends = [0.0, *cut, 0.0]
    parts: list[PositionCurve] = []
    joints, blends = [], []
    for i, segment in enumerate(segments):
        first, last = ends[i], segment.length - ends[i + 1]
        if last - first > _NOTHING * segment.length:
            whole = first == 0.0 and last == segment.length
            parts.append(segment if whole else PartOfCurve(segment, first, last))
        if i + 1 < len(segments):
            joints.append(len(parts))
            blends.append(_blend(i, segment, segments[i + 1], cut[i]))
            parts.extend(blend for blend in blends[-1:] if blend is not None)
    half = np.array(
        [blend.length / 2.0 if blend else fade for blend, fade in zip(blends, faded, strict=True)]
    )
    offsets = _offsets(parts)
    middles = offsets[joints] + np.where(np.array(cut) > 0.0, half, 0.0)
    corners = [
        _corner(pair, blends[i], kinds[i], float(middles[i]), asked[i], cut[i] + faded[i])
        for i, pair in enumerate(pairwise(segments))
    ]
    borders = np.concatenate([[0.0], middles, offsets[-1:]])
    return Chain(tuple(segments), tuple(corners), tuple(parts), borders, half)


def _offsets(parts: Sequence[PositionCurve]) -> Array:
    """Return where each part begins, and the end, m."""
    return np.concatenate([[0.0], np.cumsum([part.length for part in parts])])


def _corner(
    pair: tuple[PositionCurve, PositionCurve],
    blend: Blend | None,
    kind: CornerKind,
    s: float,
    asked: float,
    used: float,
) -> Corner:
    where, turn = pair[1].evaluate(np.zeros(1))[0][0], turn_between(*pair)
    if blend is None:
        return Corner(kind, s, where, turn, asked, used, 0.0)
    return Corner("rounded", s, where, turn, asked, used, blend.distance(where))


def _blend(index: int, before: PositionCurve, after: PositionCurve, radius: float) -> Blend | None:
    if radius == 0.0:
        return None
    try:
        return round_corner(before, after, radius)
    except PlanningError as error:
        (why,) = error.problems
        text = f"corner {index + 1} of the path, at {{where}}: {why.message}"
        amounts = {**why.amounts, "where": shown_position(after.evaluate(np.zeros(1))[0][0])}
        raise CornerError(replace(why, message=text, amounts=amounts)) from error


def _check_joints(segments: Sequence[PositionCurve]) -> None:
    """Raise InputError where a segment does not start where the one before ends."""
    for i, (before, after) in enumerate(pairwise(segments)):
        end = before.evaluate(np.array([before.length]), "left")[0][0]
        start = after.evaluate(np.zeros(1))[0][0]
        gap = float(np.linalg.norm(start - end))
        if gap > SAME_POINT:
            text = (
                f"segment {i + 2} of the path starts at {{start}}, {{gap}} from {{end}}, "
                f"where segment {i + 1} ends (allowed is {{most}})"
            )
            amounts = {
                "start": shown_position(start),
                "gap": shown_length(gap),
                "end": shown_position(end),
                "most": shown_length(SAME_POINT),
            }
            raise InputError(Problem(text, amounts=amounts))
