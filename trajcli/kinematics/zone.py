"""Zones about a corner: a ball for the tool, an angle for its orientation, a box for the joints.

Between two times the position of the tool lies no further from the chord between its ends than M h^2 / 8,
with M a bound of its second derivative, and a distance from the corner is convex: on the chord it is largest
at an end. An angle changes no faster than the angular velocity.

Source: de Boor, A Practical Guide to Splines (1978), chapter 2 (error of linear interpolation).
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import (
    Array,
    PiecewisePolynomial,
    control_points,
    derivative_coefficients,
    horner,
    taylor_shift,
)
from trajcli.frozen import comparable, frozen
from trajcli.geometry.rotation import log
from trajcli.kinematics.forward import forward, link_poses
from trajcli.kinematics.robot import Robot

ZONE_RELATIVE = 1e-6
"""A zone's border is found, and its proof ends, to this part of it."""
_STILL = 1e-12  # rad or m: a joint that stays in the corner
_HALVINGS = 60  # of an interval: one that is shorter is a point
_AT_ONCE = 4096  # intervals that are looked at together; a motion with more is not within its zone


@comparable
class Zone:
    """How far from its corner a motion may be that flies by; what is None is not limited.

    Attributes:
        position: Distance of the tool, m.
        orientation: Angle between the tool and how it stands in the corner, rad.
        joints: Distance of each joint, rad or m, (n,).
    """

    position: float | None = None
    orientation: float | None = None
    joints: tuple[float, ...] | None = None

    @property
    def stops(self) -> bool:
        """Whether it leaves nothing but to stop in the corner."""
        sizes = [self.position, self.orientation, None if self.joints is None else max(self.joints)]
        return all(size is None for size in sizes) or any(size == 0 for size in sizes)

    @property
    def needs_geometry(self) -> bool:
        """Whether it is about the tool."""
        return self.position is not None or self.orientation is not None

    def scaled(self, factor: float) -> Zone:
        """Return the zone of `factor` times the size."""
        joints = None if self.joints is None else tuple(factor * size for size in self.joints)
        position, angle = (None if v is None else factor * v for v in (self.position, self.orientation))
        return Zone(position, angle, joints)


@frozen
class ZoneAround:
    """A zone about a corner.

    Attributes:
        robot: The arm, with the tool that flies by.
        corner: Joint values (n,) in the corner.
        zone: Its size.
    """

    robot: Robot
    corner: Array
    zone: Zone

    @cached_property
    def _pose(self) -> Array:
        return forward(self.robot, self.corner)

    @property
    def joint_sizes(self) -> Array:
        """Distance of each joint from the corner that is allowed, (n,): rounding where it is none."""
        return np.maximum(self.zone.joints or 0.0, _STILL)

    def offsets(self, joints: Array) -> tuple[Array, Array]:
        """Return the distance of the tool from the corner, m, and its angle, rad, at joint values (N, n)."""
        poses = forward(self.robot, joints)
        distance = np.linalg.norm(poses[:, :3, 3] - self._pose[:3, 3], axis=1)
        turns = poses[:, :3, :3].transpose(0, 2, 1) @ self._pose[:3, :3]
        return distance, np.linalg.norm(log(turns), axis=1)

    def shares(self, joints: Array) -> Array:
        """Return how much of the zone is used at joint values (N, n): above 1 it has been left."""
        used = [np.zeros(len(joints))]
        if self.zone.needs_geometry:
            sizes = (self.zone.position, self.zone.orientation)
            parts = zip(self.offsets(joints), sizes, strict=True)
            used += [values / size for values, size in parts if size is not None]
        if self.zone.joints is not None:
            used.append((np.abs(joints - self.corner) / self.joint_sizes).max(axis=1))
        return np.asarray(np.max(used, axis=0))

    def holds(self, joints: Array, further: Array) -> NDArray[np.bool_]:
        """Return which joint values (N, n) are off the zone by no more than `further` (N, 2), m and rad."""
        off = []
        if self.zone.needs_geometry:
            parts = zip(
                self.offsets(joints), (self.zone.position, self.zone.orientation), further.T, strict=True
            )
            off += [values - size - more for values, size, more in parts if size is not None]
        if self.zone.joints is not None:
            off += [*(np.abs(joints - self.corner) - self.zone.joints - further[:, 1:]).T]
        return np.asarray(np.max(off, axis=0) <= 0.0)

    def largest_share(self, curve: PiecewisePolynomial, enough: float = 1.0) -> tuple[float, float]:
        """Return how much of the zone a curve q(t) uses for all t, and when it is most.

        The bound is above the largest value by at most a millionth, or it is at most `enough`.

        Args:
            curve: q(t).
            enough: Intervals that use no more are not looked at closer.
        """
        pieces = _Intervals(curve.breaks[:-1], curve.lengths, curve.coefficients)
        worst, when = 0.0, curve.start
        for _ in range(_HALVINGS):
            at_ends, bound = self._bounds(pieces)
            largest = float(at_ends.max())
            if largest > worst:
                worst = largest
                when = min(self._reached(pieces, int(at_ends.argmax()), largest), curve.end)
            open_ended = bound > max(enough, worst) * (1 + ZONE_RELATIVE)
            if not open_ended.any():
                settled = bound if bound.size else np.zeros(1)
                return max(worst, min(float(settled.max()), max(enough, worst))), when
            if open_ended.sum() > _AT_ONCE:
                break
            pieces = pieces.halved(open_ended)
        return float("inf"), when

    def _reached(self, pieces: _Intervals, at: int, share: float) -> float:
        """Return at which end of an interval a share is reached, s."""
        (at_start,) = self.shares(pieces.coefficients[-1, at : at + 1])
        later = 0.0 if at_start >= share * (1 - ZONE_RELATIVE) else float(pieces.lengths[at])
        return float(pieces.starts[at]) + later

    def _bounds(self, pieces: _Intervals) -> tuple[Array, Array]:
        """Return the larger share at the ends of intervals, and a bound of it within, each (P,)."""
        first, last = pieces.ends()
        speed, rise = pieces.rates()
        at_ends, bound = np.zeros(len(first)), np.zeros(len(first))
        if self.zone.needs_geometry:
            (p0, w0), (p1, w1) = self.offsets(first), self.offsets(last)
            bend, turning = self._tool_rates(first, speed, rise, pieces.lengths)
            if self.zone.position is not None:
                larger = np.maximum(p0, p1)
                at_ends = larger / self.zone.position
                bound = (larger + bend * pieces.lengths**2 / 8) / self.zone.position
            if self.zone.orientation is not None:
                at_ends = np.maximum(at_ends, np.maximum(w0, w1) / self.zone.orientation)
                angle = 0.5 * (w0 + w1 + turning * pieces.lengths)
                bound = np.maximum(bound, angle / self.zone.orientation)
        if self.zone.joints is not None:
            off = np.maximum(np.abs(first - self.corner), np.abs(last - self.corner))
            at_ends = np.maximum(at_ends, (off / self.joint_sizes).max(axis=1))
            bowed = off + rise * pieces.lengths[:, None] ** 2 / 8
            bound = np.maximum(bound, (bowed / self.joint_sizes).max(axis=1))
        return at_ends, bound

    def _tool_rates(self, start: Array, speed: Array, rise: Array, lengths: Array) -> tuple[Array, Array]:
        """Return bounds of |p''| and of |w| on intervals (P,), from q, |q'| and |q''| (P, n) there.

        p'' is the sum of the columns of the Jacobian times q'', and of their changes: a column of a joint is
        turned by the joints before it, and by those behind it its lever is moved.
        """
        robot = self.robot
        links = np.linalg.norm(np.diff(link_poses(robot, start)[..., :3, 3], axis=1), axis=2)
        slides = np.array([joint.type == "prismatic" for joint in robot.joints])
        n = len(robot.joints)
        travel = np.where(slides, speed * lengths[:, None], 0.0)
        links[:, :n] += travel
        levers = np.cumsum(links[:, ::-1], axis=1)[:, ::-1][:, :n]
        column = np.where(slides, 1.0, levers)
        bend = (column * rise).sum(axis=1)
        for i in range(n):
            for j in range(n):
                if slides[max(i, j)]:
                    change: Array | float = 0.0 if slides[min(i, j)] or i == j else 1.0
                else:
                    change = 0.0 if slides[min(i, j)] else levers[:, max(i, j)]
                bend += change * speed[:, i] * speed[:, j]
        return bend, (speed * ~slides).sum(axis=1)


@frozen
class _Intervals:
    """Pieces of a curve q(t), or parts of them.

    Attributes:
        starts: Shape (P,), s.
        lengths: Shape (P,), s.
        coefficients: Shape (degree + 1, P, n).
    """

    starts: Array
    lengths: Array
    coefficients: Array

    def ends(self) -> tuple[Array, Array]:
        """Return joint values (P, n) at both ends."""
        return self.coefficients[-1], horner(self.coefficients, self.lengths[:, None])

    def rates(self) -> tuple[Array, Array]:
        """Return bounds of |q'| and of |q''|, each (P, n)."""
        hulls = [
            control_points(derivative_coefficients(self.coefficients, order), self.lengths[:, None])
            for order in (1, 2)
        ]
        speed, rise = (np.abs(hull).max(axis=0) for hull in hulls)
        return speed, rise

    def halved(self, some: NDArray[np.bool_]) -> _Intervals:
        coefficients, half = self.coefficients[:, some], 0.5 * self.lengths[some]
        later = taylor_shift(coefficients, half[:, None])
        starts = self.starts[some]
        return _Intervals(
            np.concatenate([starts, starts + half]),
            np.concatenate([half, half]),
            np.concatenate([coefficients, later], axis=1),
        )
