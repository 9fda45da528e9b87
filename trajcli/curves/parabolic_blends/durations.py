"""Durations of blends of given acceleration: each joint takes |dv| / a for its own.

A blend inside an end segment changes that segment's velocity, so its duration follows from a quadratic. With
e = dq - v0 h, the displacement that is left when the joint keeps its first velocity v0 for the duration h:

    one blend of duration d inside:    a d (h - d / 2) = |e|,    real for a >= 2 |e| / h^2.

Source: Craig (2005), section 7.3, equations 7.24 to 7.28, for v0 = 0.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from trajcli.curves.parabolic_blends.corners import (
    OFFSET,
    CornerSpec,
    RoundedPolyline,
    corners,
    scaled_to_fit,
)
from trajcli.curves.piecewise import Array

_ROUNDING = 1e-12  # relative: what an acceleration may miss its least value by
_STRAIGHT = 8 * np.finfo(np.float64).eps  # of positions over durations: a velocity step that is only rounding
_ROUNDS = 60  # at most; where there is room, a few settle the offsets
_SETTLED = 1e-12  # of the shorter segment beside the waypoint


class BlendAccelerationError(ValueError):
    """An acceleration is too small to blend inside an end segment.

    Attributes:
        joint: Index of the joint that lacks most.
        point: Index of the end point.
        acceleration: What was given.
        least: What would do.
    """

    def __init__(self, joint: int, point: int, acceleration: float, least: float) -> None:
        super().__init__(
            f"joint {joint} needs an acceleration of at least {least:.9g} for the blend at point {point}, "
            f"got {acceleration:.9g}"
        )
        self.joint, self.point, self.acceleration, self.least = joint, point, acceleration, least


def offsets_and_blends(spec: CornerSpec, acceleration: Array) -> tuple[Array, Array]:
    """Return the offsets (m, n) of the corners and the blends (M, n) that the accelerations ask for, s.

    Args:
        spec: m waypoints of n joints.
        acceleration: Magnitudes, shape (n,).

    Raises:
        BlendAccelerationError: When an end blend cannot lie inside its segment.
    """
    offsets = np.zeros_like(spec.positions)
    if spec.exactly:
        offsets = _offsets(spec, acceleration)
    sharp = _sharp(spec, offsets)
    if spec.ends == "inside":
        _refuse_slow_ends(spec, sharp, acceleration)
    return offsets, _asked(spec, sharp, acceleration)


def _sharp(spec: CornerSpec, offsets: Array) -> RoundedPolyline:
    """Return the corners before any blend inside the end segments moves them."""
    return corners(replace(spec, ends="centred"), offsets, np.zeros((spec.points.size, 1)))


def _asked(spec: CornerSpec, sharp: RoundedPolyline, a: Array) -> Array:
    """Return the duration of each blend, shape (M, n); zero where the velocity changes by rounding only."""
    velocities = sharp.velocities.copy()
    if spec.ends == "inside":
        velocities[1], velocities[-2] = _end_segments(spec, sharp, a)
    steps = np.abs(np.diff(velocities, axis=0))
    segments = np.pad(np.diff(spec.times), 1, mode="edge")
    shortest = np.minimum(segments[:-1], segments[1:])[spec.points, None]
    return np.where(steps * shortest > _STRAIGHT * np.abs(spec.positions).max(axis=0), steps / a, 0.0)


def _end_segments(spec: CornerSpec, sharp: RoundedPolyline, a: Array) -> tuple[Array, Array]:
    """Return the velocities (n,) of the first and last segment, which hold the end blends."""
    displacements, lengths = np.diff(sharp.positions, axis=0), np.diff(sharp.times, axis=0)
    if displacements.shape[0] == 1:
        only = _only_segment(spec, displacements[0], lengths[0], a)
        return only, only
    return (
        _one_blend(spec.start_velocity, displacements[0], lengths[0], a),
        _one_blend(spec.end_velocity, displacements[-1], lengths[-1], a),
    )


def _one_blend(v: Array, distance: Array, h: Array, a: Array) -> Array:
    """Return the velocity of a segment with one blend inside, from or to velocity `v`."""
    e = distance - v * h
    root = np.sqrt(np.maximum(h * h - 2 * np.abs(e) / a, 0.0))
    return v + 2 * e / (h + root)


def _only_segment(spec: CornerSpec, distance: Array, h: Array, a: Array) -> Array:
    """Return the velocity of a segment with both blends inside.

    With y and d its difference to the mean of the end velocities and half their difference, it is where
    y h - ((y + d)|y + d| + (y - d)|y - d|) / (2 a) is the displacement that is left.
    """
    mean = (spec.start_velocity + spec.end_velocity) / 2
    d = np.abs(spec.end_velocity - spec.start_velocity) / 2
    e = distance - mean * h
    left = np.abs(e)
    root = np.sqrt(np.maximum((a * h) ** 2 - 4 * (a * left + d * d), 0.0))
    beyond = 2 * (a * left + d * d) / (a * h + root)
    slack = h - 2 * d / a
    within = left / np.where(slack > 0, slack, 1.0)
    y: Array = np.sign(e) * np.where((slack > 0) & (left <= d * slack), within, beyond)
    return mean + y


def _refuse_slow_ends(spec: CornerSpec, sharp: RoundedPolyline, a: Array) -> None:
    """Raise BlendAccelerationError where a blend does not fit into its end segment."""
    displacements, lengths = np.diff(sharp.positions, axis=0), np.diff(sharp.times, axis=0)
    ends = np.stack([spec.start_velocity, spec.end_velocity])
    if displacements.shape[0] == 1:
        left = np.abs(displacements - ends.mean(axis=0) * lengths)
        apart = np.abs(ends[1:] - ends[:1]) / 2
        least = 2 * (left + np.hypot(left, lengths * apart)) / lengths**2
    else:
        least = 2 * np.abs(displacements[[0, -1]] - ends * lengths[[0, -1]]) / lengths[[0, -1]] ** 2
    worst = np.unravel_index(int((least / a).argmax()), least.shape)
    end, joint = int(worst[0]), int(worst[1])
    if least[end, joint] > a[joint] * (1 + _ROUNDING):
        point = 0 if end == 0 else spec.times.size - 1
        raise BlendAccelerationError(joint, point, float(a[joint]), float(least[end, joint]))


def _offsets(spec: CornerSpec, a: Array) -> Array:
    """Return offsets (m, n) for the longer of the two blends at each waypoint, where there is room.

    The blends depend on the offsets, which shorten the segments: a fixed point.
    """
    segments = np.diff(spec.times)[:, None]
    near = np.zeros_like(spec.positions)
    near[1:-1] = np.minimum(segments[:-1], segments[1:])
    offsets = np.zeros_like(near)
    for _ in range(_ROUNDS):
        asked = _asked(spec, _sharp(spec, offsets), a)
        wanted = np.concatenate([asked[:1], np.maximum(asked[1:-1:2], asked[2:-1:2]), asked[-1:]])
        fitting = OFFSET * scaled_to_fit(wanted, segments, *spec.blend_room())
        fitting[[0, -1]] = 0.0
        settled = (np.abs(fitting - offsets) <= _SETTLED * near).all()
        offsets = fitting
        if settled:
            break
    return offsets
