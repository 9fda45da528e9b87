"""Linear segments with parabolic blends: straight from waypoint to waypoint, with rounded corners.

Every corner is rounded by a parabola of duration d centred on the time of the waypoint, at the constant
acceleration dv / d for the velocity step dv; so the curve passes the waypoint at the distance |dv| d / 8.

Where the half blends of neighbours need more than the segment between them lasts, all its blends are
shrunk by the same factor, so that they just touch; a blend that two segments shrink takes the smaller factor.

Source: Siciliano et al. (2009), section 4.2.2, for "centred" ends; Craig (2005), section 7.3, for "inside"
ends and blends by acceleration.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.curves.parabolic_blends.corners import (
    OFFSET,
    CornerSpec,
    Ends,
    RoundedPolyline,
    corners,
    scaled_to_fit,
)
from trajcli.curves.parabolic_blends.durations import offsets_and_blends
from trajcli.curves.piecewise import Array, PiecewisePolynomial, read_only
from trajcli.frozen import comparable, frozen

_SHRUNK = 1e-12  # relative: less is rounding
_JUMP = 1e-9  # of a joint's fastest segment: a velocity step that needs a blend


@comparable
class Shrunk:
    """A blend that had to be shortened.

    Attributes:
        point: Index of the waypoint.
        joint: Index of the joint, None where all joints share the blend.
        asked: Duration that was asked for, s.
        used: Duration that there was room for, s.
    """

    point: int
    joint: int | None
    asked: float
    used: float


@frozen
class Blended:
    """Linear segments with parabolic blends through m waypoints of n joints.

    There is one corner for each waypoint, M = m; with `exactly` two for each inner one, M = 2m - 2. Where all
    joints share the blends, `times` and `blends` repeat the same column.

    Attributes:
        curve: q(t), from t = 0.
        shift: What was added to the given times, s.
        points: Index of the waypoint that each corner belongs to, shape (M,).
        times: When each corner would be reached, on the curve's time, s, shape (M, n).
        positions: The corners, shape (M, n).
        blends: Durations used, s, shape (M, n); zero where a joint with its own blends does not turn.
        velocities: Of the straight segments between the corners, shape (M - 1, n).
        missed: How far the curve is from each waypoint at the waypoint's time, |dv| d / 8, shape (m, n).
        shrunk: The blends that had to be shortened, by waypoint.
    """

    curve: PiecewisePolynomial
    shift: float
    points: NDArray[np.intp]
    times: Array
    positions: Array
    blends: Array
    velocities: Array
    missed: Array
    shrunk: tuple[Shrunk, ...]


def blended(
    times: ArrayLike,
    positions: ArrayLike,
    durations: ArrayLike,
    *,
    ends: Ends = "centred",
    exactly: bool = False,
    start_velocity: ArrayLike = 0.0,
    end_velocity: ArrayLike = 0.0,
) -> Blended:
    """Return the segments with blends of given durations, which all joints share.

    With `exactly` the corner at an inner waypoint becomes two, 5/8 of the blend before and after it in time,
    on the line through the waypoint with the slower of the two velocities around it where these agree in
    sign, else with velocity zero. Each takes the given blend; so the curve runs straight through the
    waypoint at its time, for a quarter of the blend, and no joint overshoots.

    Args:
        times: Of the waypoints, s, shape (m,), strictly increasing, m >= 2.
        positions: Shape (m, n).
        durations: Of the blends, s: one for all, or shape (m,). Zero only where no joint changes velocity.
        ends: "centred": the first and last blend are centred on the first and last time, so the motion lasts
            half a blend longer at either end. "inside": they lie inside the end segments, which are faster.
        exactly: Whether to pass exactly through the inner waypoints.
        start_velocity: Shape (n,) or one for all. A moving centred start lies before the first point, by half
            a blend times this velocity.
        end_velocity: Shape (n,) or one for all. A moving centred end lies likewise behind the last point.

    Raises:
        ValueError: For times that do not increase, durations that are negative, or zero at a corner.
    """
    spec = CornerSpec.of(times, positions, start_velocity, end_velocity, ends, exactly=exactly)
    asked = np.broadcast_to(np.asarray(durations, dtype=np.float64), (spec.times.size,))[:, None]
    if not (np.isfinite(asked) & (asked >= 0)).all():
        raise ValueError(f"blend durations must be finite and not negative, got {asked.min():.9g} s")
    used = scaled_to_fit(asked, np.diff(spec.times)[:, None], *spec.blend_room())
    knots = corners(spec, OFFSET * used, used[spec.points])
    _refuse_jumps(knots)
    shrunk = tuple(
        Shrunk(k, None, float(asked[k, 0]), float(used[k, 0]))
        for k in np.flatnonzero(used[:, 0] < asked[:, 0] * (1 - _SHRUNK)).tolist()
    )
    return _finished(spec, knots, shrunk)


def blended_by_acceleration(
    times: ArrayLike,
    positions: ArrayLike,
    acceleration: ArrayLike,
    *,
    ends: Ends = "centred",
    exactly: bool = False,
    start_velocity: ArrayLike = 0.0,
    end_velocity: ArrayLike = 0.0,
) -> Blended:
    """Return the segments with blends of given acceleration: each joint takes |dv| / a for its own.

    With centred ends, a joint whose first blend is shorter than another's starts to move later, and likewise
    stops earlier. With `exactly`, the offset of a joint's two corners is 5/8 of the longer of its blends
    there. A shrunk blend has a higher acceleration than given.

    Args:
        times: Of the waypoints, s, shape (m,), strictly increasing, m >= 2.
        positions: Shape (m, n).
        acceleration: Magnitude, shape (n,) or one for all, positive.
        ends: As for `blended`.
        exactly: As for `blended`.
        start_velocity: As for `blended`.
        end_velocity: As for `blended`.

    Raises:
        BlendAccelerationError: When an acceleration is too small for an end segment with its blend inside.
        ValueError: For times that do not increase, or accelerations that are not positive and finite.
    """
    spec = CornerSpec.of(times, positions, start_velocity, end_velocity, ends, exactly=exactly)
    a = np.broadcast_to(np.asarray(acceleration, dtype=np.float64), (spec.positions.shape[1],))
    if not (np.isfinite(a) & (a > 0)).all():
        raise ValueError(f"blend accelerations must be positive and finite, got {a.min():.9g}")
    offsets, asked = offsets_and_blends(spec, a)
    sharp = spec.times[spec.points, None] + spec.side * offsets[spec.points]
    beside = np.where(spec.side == 0, asked, 2 * offsets[spec.points])  # not beyond its waypoint
    used = scaled_to_fit(np.minimum(asked, beside), np.diff(sharp, axis=0), *spec.corner_room())
    knots = corners(spec, offsets, used)
    shrunk = tuple(
        Shrunk(int(spec.points[k]), j, float(asked[k, j]), float(used[k, j]))
        for k, j in np.argwhere(used < asked * (1 - _SHRUNK)).tolist()
    )
    return _finished(spec, knots, shrunk)


def _refuse_jumps(knots: RoundedPolyline) -> None:
    """Raise ValueError where a blend of no length stands at a corner."""
    steps = np.abs(np.diff(knots.velocities, axis=0))
    sharp = (steps > _JUMP * np.abs(knots.velocities).max(axis=0)) & (knots.blends == 0)
    if sharp.any():
        k, joint = np.argwhere(sharp)[0].tolist()
        raise ValueError(
            f"a blend of 0 s at point {knots.points[k]}, where joint {joint} changes its velocity by "
            f"{steps[k, joint]:.9g}"
        )


def _finished(spec: CornerSpec, knots: RoundedPolyline, shrunk: tuple[Shrunk, ...]) -> Blended:
    """Return the curve of `knots`, moved so that it starts at zero, and what is to be said about it."""
    inside = spec.ends == "inside"
    start, end = (float(spec.times[0]), float(spec.times[-1])) if inside else (knots.start, knots.end)
    knots = replace(knots, times=knots.times - start)
    steps = np.abs(np.diff(knots.velocities, axis=0)) * knots.blends / 8
    missed = np.zeros_like(spec.positions)
    if not spec.exactly:
        missed[1:-1] = steps[1:-1]
    if not inside:
        missed[[0, -1]] = steps[[0, -1]]
    shape = knots.positions.shape
    return Blended(
        curve=knots.curve(end - start),
        shift=0.0 - start,
        points=knots.points,
        times=read_only(np.broadcast_to(knots.times, shape)),
        positions=read_only(knots.positions),
        blends=read_only(np.broadcast_to(knots.blends, shape)),
        velocities=read_only(knots.velocities[1:-1]),
        missed=read_only(missed),
        shrunk=shrunk,
    )
