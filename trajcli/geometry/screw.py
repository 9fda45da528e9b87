"""The motion at constant twist from one pose to another: the tool goes along a helix by its arc length.

Source: Murray, Li and Sastry, A Mathematical Introduction to Robotic Manipulation (1994), section 2.3.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from trajcli.frozen import frozen
from trajcli.geometry.orientation_curve import turn_vectors
from trajcli.geometry.place_curve import SAME_PLACE, Side, Smooth, Triple, inside
from trajcli.geometry.pose import check_pose, exp_pose, invert
from trajcli.geometry.rotation import Array


@frozen
class Screw(Smooth):
    """Poses X(s) = start exp(s twist), the twist constant in the tool's axes.

    Half a turn has two ways; the rotation is the one that `AboutAxes` takes.

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
        way, angle = np.linalg.norm(self.twist[:3]), np.linalg.norm(self.twist[3:])
        return float(angle if way <= SAME_PLACE else way)

    @property
    def in_place(self) -> bool:
        """Whether the tool only turns and s is an angle."""
        return bool(np.linalg.norm(self.twist[:3]) <= SAME_PLACE)

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
