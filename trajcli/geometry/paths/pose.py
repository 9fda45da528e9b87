"""Pose curves X(s): a position curve and an orientation by the same s, or a screw motion.

A screw is the motion at constant twist from one pose to another: the tool goes along a helix by its arc
length.

Source: Murray, Li and Sastry (1994), section 2.3.
"""

from __future__ import annotations

from functools import cached_property
from typing import Protocol

import numpy as np

from trajcli.frozen import frozen
from trajcli.geometry.paths.orientation import OrientationCurve, turn_vectors
from trajcli.geometry.paths.position import (
    SAME_POINT,
    Parametrised,
    Pivot,
    PositionCurve,
    Side,
    Smooth,
    Triple,
    inside,
    nearest,
)
from trajcli.geometry.pose import build, check_pose, exp_pose, invert
from trajcli.geometry.power_series import series_exponential
from trajcli.geometry.rotation import Array

_SAME = 1e-9  # of the length: two breaks as near as this are one


class PosePath(Parametrised, Protocol):
    """A pose X(s), s from 0 to `length`; with a law s(t), v = X' sd and a = X'' sd^2 + X' sdd.

    Attributes:
        length: m of arc length, or rad where the position is fixed; zero for no motion.
        pure_rotation: Whether the position is fixed and s is an angle.
        breaks: Inner s (k,), increasing, where a derivative may jump.
        stops: Those of them where X' jumps, or X: a law must stop there.
        jumps: Those of them where the orientation jumps.
    """

    @property
    def pure_rotation(self) -> bool:
        """Whether the position is fixed."""
        ...

    @property
    def jumps(self) -> Array:
        """Where the orientation jumps."""
        ...

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return the poses X (N, 4, 4), X' = [v', w'] (N, 6) and X'' = [v'', w''] (N, 6) in world axes.

        Args:
            s: Shape (N,), m or rad.
            side: Which of two neighbouring pieces speaks at a break.

        Raises:
            ValueError: When s lies outside.
        """
        ...

    def majorants(self, s: Array, rising: Array) -> tuple[Array, Array]:
        """Return bounds of |p^(m)| / m! and |R^(m)| / m! by the time of a law s(t), from m = 1 on.

        They hold on whole pieces of it, none of which passes a break. Of R the operator norm is bounded.

        Args:
            s: Within each piece, shape (P,).
            rising: Bounds of |s^(m)| / m! as `growth` of power series gives them, shape (order + 1, P).

        Returns:
            Two of the shape of `rising`; infinite where nothing is known.
        """
        ...


@frozen
class PoseCurve:
    """Position and orientation side by side.

    Attributes:
        position: p(s), of some length, or a `Pivot`.
        orientation: R(s), as long.
    """

    position: PositionCurve
    orientation: OrientationCurve

    def __post_init__(self) -> None:
        lengths = self.position.length, self.orientation.length
        if abs(lengths[0] - lengths[1]) > _SAME * lengths[0]:
            raise ValueError(f"position and orientation differ in length: {lengths[0]!r}, {lengths[1]!r}")

    @property
    def length(self) -> float:
        """Length of the position curve, m, or of the rotation alone, rad."""
        return self.position.length

    @property
    def pure_rotation(self) -> bool:
        """Whether the position is fixed and s is an angle."""
        return isinstance(self.position, Pivot)

    @cached_property
    def breaks(self) -> Array:
        """Where a derivative may jump."""
        return self._united(self.position.breaks, self.orientation.breaks)

    @cached_property
    def stops(self) -> Array:
        """Where a law must stop."""
        return self._united(self.position.stops, self.orientation.stops)

    @property
    def jumps(self) -> Array:
        """Where the orientation jumps."""
        return self.orientation.jumps

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return X, X', X'' as `PosePath` says."""
        positions, velocity, bend = self.position.evaluate(s, side)
        rotations, rate, change = self.orientation.evaluate(s, side)
        first, second = np.concatenate([velocity, rate], axis=-1), np.concatenate([bend, change], axis=-1)
        return build(rotations, positions), first, second

    def majorants(self, s: Array, rising: Array) -> tuple[Array, Array]:
        """Return the bounds of p and R as `PosePath` says."""
        return self.position.majorants(s, rising)[0], self.orientation.majorant(s, rising)

    def _united(self, first: Array, second: Array) -> Array:
        """Return s of both, those of the second that are beside one of the first left out."""
        if not first.size:
            return second
        near = np.abs(second - nearest(first, second)) <= _SAME * self.length
        return np.sort(np.concatenate([first, second[~near]]))


@frozen
class Screw(Smooth):
    """Poses X(s) = start exp(s twist), the twist constant in the tool's axes.

    For half a turn there are two; the rotation is the one that `AxisAngleOrientation` takes.

    Attributes:
        start: Shape (4, 4).
        end: Shape (4, 4).
    """

    start: Array
    end: Array

    def __post_init__(self) -> None:
        check_pose(self.start)
        check_pose(self.end)

    @cached_property
    def twist(self) -> Array:
        """The whole motion as a twist (6,), m and rad, in axes of the start."""
        motion = invert(self.start) @ self.end
        vector = turn_vectors(self.start[:3, :3], self.end[:3, :3])
        # exp takes v to V v, linear in v: its columns are where unit vectors go
        units = np.concatenate([np.eye(3), np.tile(vector, (3, 1))], axis=-1)
        columns = exp_pose(units)[:, :3, 3].T
        return np.concatenate([np.linalg.solve(columns, motion[:3, 3]), vector])

    @cached_property
    def length(self) -> float:
        """Arc length of the tool's helix, m, or the angle, rad, where the tool does not go anywhere."""
        distance, angle = np.linalg.norm(self.twist[:3]), np.linalg.norm(self.twist[3:])
        return float(angle if distance <= SAME_POINT else distance)

    @property
    def pure_rotation(self) -> bool:
        """Whether the tool only turns and s is an angle."""
        return bool(np.linalg.norm(self.twist[:3]) <= SAME_POINT)

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return X, X', X'' as `PosePath` says; both sides are the same."""
        twist = self.twist / (self.length or 1.0)
        poses = self.start @ exp_pose(inside(s, self.length)[:, None] * twist)
        velocity, rate = (poses[:, :3, :3] @ part for part in (twist[:3], twist[3:]))
        return (
            poses,
            np.concatenate([velocity, rate], axis=-1),
            np.concatenate([np.cross(rate, velocity), np.zeros_like(rate)], axis=-1),
        )

    def majorants(self, s: Array, rising: Array) -> tuple[Array, Array]:
        """Return the bounds of p and R as `PosePath` says.

        R is an exponential of the angle w s, and p' = R v: p is bounded by v times the integral of exp(w s)
        over s, which is (exp(w s) - 1) / w.
        """
        del s
        v, w = (float(np.linalg.norm(part)) / (self.length or 1.0) for part in np.split(self.twist, 2))
        turned = series_exponential(w * rising)
        return v * (turned / w if w > 0.0 else rising), turned
