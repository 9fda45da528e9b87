"""Executed poses: a path as the arm follows it, turns that its targets leave free included.

Source: Siciliano et al. (2009), section 3.7: v = J q', a = J q'' + J' q'.
"""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.frozen import frozen
from trajcli.geometry.paths.pose import PosePath
from trajcli.geometry.paths.position import Side, Triple
from trajcli.kinematics.following.follower import Follower
from trajcli.kinematics.jacobian import acceleration_bias, linearisation


@frozen
class ExecutedPoses:
    """The poses X(s) of the tcp while an arm follows a path; where the tcp goes is the path's own.

    Attributes:
        wanted: The path.
        follower: Of the arm along it.
        coarse: Joints near the exact ones, a curve over s.
    """

    wanted: PosePath
    follower: Follower
    coarse: PiecewisePolynomial

    @property
    def length(self) -> float:
        """How far s goes, m or rad."""
        return self.wanted.length

    @property
    def pure_rotation(self) -> bool:
        """Whether the position is fixed."""
        return self.wanted.pure_rotation

    @property
    def breaks(self) -> Array:
        """Where a derivative may jump."""
        return self.wanted.breaks

    @property
    def stops(self) -> Array:
        """Where a law must stop."""
        return self.wanted.stops

    @property
    def jumps(self) -> Array:
        """Where the orientation jumps."""
        return self.wanted.jumps

    def evaluate(self, s: Array, side: Side = "right") -> Triple:
        """Return the poses (N, 4, 4), X' = [v', w'] (N, 6) and X'' (N, 6) in world axes, at s (N,).

        Raises:
            LostError: When no joint values near the coarse ones meet the target.
        """
        poses, first, second = (part.copy() for part in self.wanted.evaluate(s, side))
        guess = self.coarse.evaluate(np.clip(s, self.coarse.start, self.coarse.end))
        state = self.follower.joint_state(s, side, guess)
        joints, rates, changes = state.values
        moved = (state.jacobians @ np.stack([rates, changes], axis=-1)).transpose(2, 0, 1)
        poses[:, :3, :3] = linearisation(self.follower.robot, joints)[0][:, :3, :3]
        first[:, 3:] = moved[0][:, 3:]
        second[:, 3:] = (moved[1] + acceleration_bias(state.jacobians, rates))[:, 3:]
        return poses, first, second

    def majorants(self, s: Array, rising: Array) -> tuple[Array, Array]:
        """Return the bounds of p and R as `PosePath` says: nothing is known of R."""
        return self.wanted.majorants(s, rising)[0], np.full(rising.shape, np.inf)
