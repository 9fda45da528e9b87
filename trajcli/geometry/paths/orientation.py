"""Orientation along a path by its arc length: fixed, about fixed axes, or with the tangent.

A rotation along a segment follows the fraction of the segment that is done. Segment i goes from border i to
border i+1, and its fraction from 0 to 1 with slope 1/length. Through a rounded corner, from h before its
border to h after it, the slope of the segment behind falls to zero as 1 - S and that of the one ahead rises
as S, with S = 3x^2 - 2x^3: the fractions are twice continuously differentiable there.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from functools import cached_property
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from trajcli.errors import InputError
from trajcli.frozen import frozen
from trajcli.geometry.paths.position import Parametrised, PositionCurve, Side, Smooth, Triple, inside
from trajcli.geometry.power_series import series_exponential, series_product
from trajcli.geometry.rotation import Array, Flags, axis_angle_from_matrix, check_rotation, exp

_ROUNDING = 1e-12  # of the length, by which two blends that meet may be apart
_RATE_JUMP = 1e-9  # of the larger of two rates
_RATE_NOISE = 1e-10  # rad/m, what remains of the difference of two orientations that are meant to be the same
_NOISE = 1e-9  # a component of an axis as small as this says nothing by its sign


class OrientationCurve(Parametrised, Protocol):
    """A rotation R(s), s from 0 to `length`.

    Attributes:
        length: How far s goes: m, or rad where the position is fixed.
        breaks: Inner s (k,), increasing, where a derivative may jump.
        stops: Those of them where the rate w' jumps, or R: a law must stop there.
        jumps: Those of them where R jumps: the tool must turn there, or the path be refused.
    """

    @property
    def jumps(self) -> Array:
        """Where the orientation jumps."""
        ...

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return R (N, 3, 3), its rate w' (N, 3), rad for each unit of s, in world axes, and w'' (N, 3).

        Args:
            s: Shape (N,).
            side: Which of two neighbouring pieces speaks at a break.

        Raises:
            ValueError: When s lies outside.
        """
        ...

    def majorant(self, s: Array, rising: Array) -> Array:
        """Return bounds of |R^(m)| / m!, in the operator norm, by the time of a law s(t), from m = 1 on.

        They hold on whole pieces of it, none of which passes a break.

        Args:
            s: Within each piece, shape (P,).
            rising: Bounds of |s^(m)| / m! as `growth` of power series gives them, shape (order + 1, P).

        Returns:
            The shape of `rising`; infinite where nothing is known.
        """
        ...


@frozen
class FixedOrientation(Smooth):
    """An orientation that stays.

    Attributes:
        rotation: Shape (3, 3).
        length: How far s goes.
    """

    rotation: Array
    length: float

    def __post_init__(self) -> None:
        check_rotation(self.rotation)

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return R, w', w'' as `OrientationCurve` says; both sides are the same."""
        count = inside(s, self.length).size
        return np.tile(self.rotation, (count, 1, 1)), np.zeros((count, 3)), np.zeros((count, 3))

    def majorant(self, s: Array, rising: Array) -> Array:
        """Return the bounds as `OrientationCurve` says: nothing turns."""
        del s
        return np.zeros(rising.shape)


class OverSegments(Smooth, ABC):
    """What orientations that go from border to border of segments share.

    Attributes:
        progress: How far each segment is done.
    """

    progress: SegmentProgress

    @property
    def length(self) -> float:
        """How far s goes."""
        return self.progress.length

    @property
    def breaks(self) -> Array:
        """Where one rotation begins to fade into the next one, the border, and where it has done so."""
        return self.progress.breaks

    @property
    def stops(self) -> Array:
        """Borders without a blend at which the rate jumps."""
        sharp = self.progress.borders[1:-1][self.progress.half_widths == 0.0]
        left, right = self.evaluate(sharp, "left")[1], self.evaluate(sharp, "right")[1]
        return np.asarray(sharp[_differ(left, right)])

    @property
    @abstractmethod
    def angles_turned(self) -> Array:
        """Sums (k,), rad, of the angles by which each segment turns about its axes."""

    @abstractmethod
    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return R, w', w'' as `OrientationCurve` says."""

    def majorant(self, s: Array, rising: Array) -> Array:
        """Return the bounds as `OrientationCurve` says: R is a product of exponentials of angles."""
        return series_exponential(self.progress.majorant(self.angles_turned, s, rising))

    def require_targets(self, count: int) -> None:
        """Check that there is one target for each border of the segments.

        Raises:
            InputError: When there is not.
        """
        wanted = self.progress.segments + 1
        if count != wanted:
            raise InputError(f"{wanted - 1} segments need {wanted} orientations, not {count}")


@frozen
class AxisAngleOrientation(OverSegments):
    """From each orientation to the next one about the fixed axis of the shortest rotation.

    Over a chain the rotation goes evenly along each segment; through a rounded corner one rotation fades into
    the next one: R = R_i exp(g v) exp(h w), with v and w the rotation vectors of the two segments and g and h
    their fractions done. Of the two shortest rotations for half a turn that one is taken whose axis has its
    first component positive that is not zero.

    Attributes:
        rotations: Shape (k + 1, 3, 3), at the borders of the k segments.
        progress: How far each segment is done.

    Source: Kim, Kim and Shin, A general construction scheme for unit quaternion curves, SIGGRAPH (1995):
    products of exponentials with cumulative weights.
    """

    rotations: Array
    progress: SegmentProgress

    def __post_init__(self) -> None:
        self.require_targets(len(self.rotations))
        for rotation in self.rotations:
            check_rotation(rotation)

    @classmethod
    def between(cls, start: Array, end: Array, length: float | None = None) -> AxisAngleOrientation:
        """Return the rotation from one orientation to another, each (3, 3).

        Args:
            start: At s = 0.
            end: At s = `length`.
            length: How far s goes; None: as far as the angle, rad.
        """
        rotations = np.array([start, end], dtype=np.float64)
        angle = float(np.linalg.norm(turn_vectors(rotations[:1], rotations[1:])))
        return cls(rotations, SegmentProgress.even(angle if length is None else length))

    @cached_property
    def vectors(self) -> Array:
        """Rotation vectors (k, 3), rad, of the segments, in axes of the orientation each starts from."""
        return turn_vectors(self.rotations[:-1], self.rotations[1:])

    @property
    def angles_turned(self) -> Array:
        """Angles (k,), rad, of the segments."""
        return np.asarray(np.linalg.norm(self.vectors, axis=-1))

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return R, w', w'' as `OrientationCurve` says."""
        if self.progress.segments == 1:
            return self._evenly(s)
        done = self.progress.at(s, side)
        vectors = np.concatenate([self.vectors, np.zeros((1, 3))])
        v, w = vectors[done.segment], vectors[done.segment + 1]
        start = self.rotations[done.segment]
        middle = start @ exp(v * done.value[0][:, None])
        first, second = (start @ v[..., None])[..., 0], (middle @ w[..., None])[..., 0]
        one, other = first * done.slope[0][:, None], second * done.slope[1][:, None]
        change = first * done.bend[0][:, None] + second * done.bend[1][:, None] + np.cross(one, other)
        return middle @ exp(w * done.value[1][:, None]), one + other, change

    def _evenly(self, s: Array) -> Triple:
        """Return what `evaluate` does for the one rotation of a single segment."""
        done = inside(s, self.length) / (self.length or 1.0)
        vector, start = self.vectors[0], self.rotations[0]
        rate = np.tile(start @ vector / (self.length or 1.0), (done.size, 1))
        turned = exp(vector * done[:, None]) if vector.any() else np.eye(3)[None]
        return np.broadcast_to(start @ turned, (done.size, 3, 3)), rate, np.zeros((done.size, 3))


@frozen
class TangentOrientation:
    """The tool keeps its attitude to the path: R = Q(s) R(0), Q how the path has turned.

    On a line it stays, on an arc it turns about the arc's axis, on a rounded corner it turns with the
    direction and does not roll about it.

    Attributes:
        path: The position curve.
        start: Orientation (3, 3) at its start.
    """

    path: PositionCurve
    start: Array

    def __post_init__(self) -> None:
        check_rotation(self.start)

    @property
    def length(self) -> float:
        """Length of the path, m."""
        return self.path.length

    @property
    def breaks(self) -> Array:
        """Breaks of the path."""
        return self.path.breaks

    @property
    def stops(self) -> Array:
        """Where the direction jumps, or the curvature, with which the rate jumps."""
        breaks = self.path.breaks
        if not breaks.size:
            return breaks
        left, right = self.path.transport(breaks, "left")[1], self.path.transport(breaks, "right")[1]
        return np.array(sorted({*breaks[_differ(left, right)].tolist(), *self.jumps.tolist()}))

    @property
    def jumps(self) -> Array:
        """Corners of the path: there the tool would have to turn by the corner's angle in no time."""
        return self.path.stops

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return R, w', w'' as `OrientationCurve` says."""
        rotation, rate, change = self.path.transport(s, side)
        return rotation @ self.start, rate, change

    def majorant(self, s: Array, rising: Array) -> Array:
        """Return the bounds as `OrientationCurve` says: those of Q."""
        return self.path.majorants(s, rising)[1]


class SegmentFractions(NamedTuple):
    """Fractions of the two neighbouring segments that matter at each s.

    Attributes:
        segment: Index (N,) of the first one; those before it are done, those after the second not begun.
        value: Shape (2, N).
        slope: Shape (2, N), 1/m.
        bend: Shape (2, N), 1/m^2.
    """

    segment: NDArray[np.intp]
    value: Array
    slope: Array
    bend: Array


@frozen
class SegmentProgress:
    """The fractions done of the k segments of a path.

    Attributes:
        borders: Shape (k + 1,), m, from 0 to the path's length.
        half_widths: Shape (k - 1,), m: half the length of the blend at each inner border, 0 where there is
            none.
    """

    borders: Array
    half_widths: Array

    @classmethod
    def even(cls, length: float) -> SegmentProgress:
        """Return the progress of one segment from 0 to `length`."""
        return cls(np.array([0.0, length]), np.empty(0))

    @property
    def length(self) -> float:
        """Length of the path."""
        return float(self.borders[-1])

    @property
    def segments(self) -> int:
        """Number k of segments."""
        return self.borders.size - 1

    @property
    def breaks(self) -> Array:
        """Inner s, increasing, where a derivative of a fraction jumps."""
        inner, slack = self.borders[1:-1], _ROUNDING * self.length
        breaks = np.sort(np.concatenate([inner - self.half_widths, inner, inner + self.half_widths]))
        breaks = breaks[(breaks > slack) & (breaks < self.length - slack)]  # a blend may begin at an end
        return np.asarray(breaks[np.diff(breaks, prepend=-np.inf) > slack])

    def at(self, s: Array, side: Side = "right") -> SegmentFractions:
        """Return the fractions at s (N,).

        Raises:
            ValueError: When s lies outside the path.
        """
        s = inside(s, self.length)
        inner, widths = self.borders[1:-1], self.half_widths
        # within a segment, from which s on its end is the border to look at
        turns = (inner[:-1] + widths[:-1] + inner[1:] - widths[1:]) / 2.0
        lengths = np.where(
            np.diff(self.borders) > 0.0, np.diff(self.borders), 1.0
        )  # or it stays at its start
        if self.segments == 1:  # a neighbour that never begins
            inner, widths, lengths = np.array([np.inf]), np.zeros(1), np.append(lengths, 1.0)
        segment = np.searchsorted(turns, s, side)
        value, slope, bend = _ramp(s, inner[segment], widths[segment], side)
        first, second = lengths[segment], lengths[segment + 1]
        behind = (s - self.borders[segment] - value) / first
        return SegmentFractions(
            segment,
            np.array([behind, value / second]),
            np.array([(1.0 - slope) / first, slope / second]),
            np.array([-bend / first, bend / second]),
        )

    def between(self, targets: Array, s: Array, side: Side = "right") -> Triple:
        """Return values (N, d) that go evenly along each segment, and their first and second derivative by s.

        Args:
            targets: At the borders, shape (k + 1, d).
            s: Shape (N,).
            side: Which of two neighbouring pieces speaks at a break.

        Raises:
            ValueError: When s lies outside the path.
        """
        done = self.at(s, side)
        steps = np.concatenate([np.diff(targets, axis=0), np.zeros((1, targets.shape[1]))])
        one, other = steps[done.segment], steps[done.segment + 1]
        values, slopes, bends = (
            one * row[0][:, None] + other * row[1][:, None] for row in (done.value, done.slope, done.bend)
        )
        return targets[done.segment] + values, slopes, bends

    def majorant(self, sizes: Array, s: Array, rising: Array) -> Array:
        """Return bounds of derivatives of what is done of all segments together, by the time of a law s(t).

        The ramp from one segment to the next one, over the length w, is w (x^3 - x^4 / 2) with x = s / w: its
        m-th derivative by x over m! is at most 1, 3/4, 1, 1/2 for m = 1 to 4; and so is what it leaves of s.

        Args:
            sizes: Of the segments, at least 0, shape (k,).
            s: Within each piece of the law, shape (P,).
            rising: Bounds of |s^(m)| / m!, m = 0 to the order, shape (order + 1, P).
        """
        rates = np.append(sizes / np.where(np.diff(self.borders) > 0.0, np.diff(self.borders), 1.0), 0.0)
        inner, widths = np.append(self.borders[1:-1], np.inf), np.append(self.half_widths, 0.0)
        border = np.searchsorted((inner + widths)[:-1], s, "right")
        fading = s > (inner - widths)[border]
        whole = np.where(fading, 2.0 * widths[border], 1.0)
        x = np.concatenate([np.zeros((1, s.size)), rising[1:] / whole])
        squared = series_product(x, x)
        ramp = x + 0.75 * squared + series_product(squared, x + 0.5 * squared)
        total = (rates[border] + rates[np.minimum(border + 1, rates.size - 1)]) * whole
        return np.where(fading, total * ramp, rates[border] * rising)


def _ramp(s: Array, border: Array, width: Array, side: Side) -> tuple[Array, Array, Array]:
    """Return a function of slope 0 before border - width and 1 after border + width, and two derivatives."""
    after = s > border if side == "left" else s >= border
    sharp = width == 0.0
    whole = np.where(sharp, 1.0, 2.0 * width)
    x = np.clip((s - np.where(sharp, 0.0, border - width)) / whole, 0.0, 1.0)
    value = np.where(sharp | (x >= 1.0), np.maximum(s - border, 0.0), whole * x**3 * (1.0 - x / 2.0))
    slope = np.where(sharp, after, x * x * (3.0 - 2.0 * x))
    return value, slope, np.where(sharp, 0.0, 6.0 * x * (1.0 - x) / whole)


def turn_vectors(start: Array, end: Array) -> Array:
    """Return the rotation vectors (*batch, 3), rad, of the shortest rotations from `start` (*batch, 3, 3).

    They are in axes of `start`. Of half a turn within 1e-9 rad, where rounding would choose, the axis has
    its first component positive.
    """
    read = axis_angle_from_matrix(np.swapaxes(start, -1, -2) @ end)
    first = np.argmax(np.abs(read.axis) > _NOISE, axis=-1)[..., None]
    opposite = read.sign_free & (np.take_along_axis(read.axis, first, axis=-1)[..., 0] < 0.0)
    angle = np.where(opposite, read.angle - 2.0 * np.pi, read.angle)
    return np.asarray(read.axis * angle[..., None])


def _differ(left: Array, right: Array) -> Flags:
    """Return where rates (*batch, 3) differ by more than rounding."""
    larger = np.maximum(np.linalg.norm(left, axis=-1), np.linalg.norm(right, axis=-1))
    differ: Flags = np.linalg.norm(left - right, axis=-1) > _RATE_JUMP * larger + _RATE_NOISE
    return differ
