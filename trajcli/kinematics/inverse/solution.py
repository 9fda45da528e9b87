"""All answers of inverse kinematics over a batch of targets."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.geometry.rotation import AxisName, Flags
from trajcli.kinematics.inverse.method import Branch, Method
from trajcli.kinematics.inverse.turns import beyond


@frozen
class Solutions:
    """Every branch of every target.

    Attributes:
        method: How they were found.
        joints: Shape (*batch, branches, n), rad or m. Where a branch is not valid, the configuration that
            comes near the target on that branch.
        valid: Shape (*batch, branches): the tcp meets the target within the tolerance, and no earlier branch
            is the same configuration. Limits do not enter.
        closure: Shape (*batch, branches, 2): how far forward kinematics is from the target, m and rad.
        singular: Shape (*batch, branches): the arm can move there in more ways than the target leaves free
            elsewhere.
        free: Shape (*batch, branches, n): the joints that are free together, because the arm is singular or
            because the target leaves them free. The member nearest to the given configuration is in `joints`.
        bounds: Position limits, shape (n, 2).
        fixed_axis: The axis of the tool that the targets mean, if no joint turns it.
    """

    method: Method
    joints: Array
    valid: Flags
    closure: Array
    singular: Flags
    free: Flags
    bounds: Array
    fixed_axis: AxisName | None = None

    @property
    def names(self) -> tuple[Branch, ...]:
        """Names of the branches; unnamed ones where the method is numeric."""
        return self.method.branches or (Branch(),) * self.joints.shape[-2]

    @property
    def count(self) -> NDArray[np.intp]:
        """Number of valid branches, shape (*batch,)."""
        return np.asarray(np.count_nonzero(self.valid, axis=-1))

    @property
    def within_limits(self) -> Flags:
        """Which branches are valid and inside the limits, shape (*batch, branches)."""
        return np.asarray(self.valid & (self.excess == 0.0).all(axis=-1))

    @property
    def excess(self) -> Array:
        """By how much joints are outside their limits, shape (*batch, branches, n), negative below."""
        return beyond(self.joints, self.bounds)

    @property
    def shortfall(self) -> Array:
        """How far the nearest branch stays away, shape (*batch, 2), m and rad; zero where one is valid.

        The wrist of a closed form then stands where it can come nearest to its aim, with the orientation met.
        """
        size = np.where(np.isfinite(self.closure), self.closure, np.inf).sum(axis=-1)
        best = np.asarray(np.argmin(size, axis=-1))[..., None, None]
        nearest = np.take_along_axis(self.closure, best, axis=-2)[..., 0, :]
        reached = np.asarray(self.valid.any(axis=-1))
        return np.where(reached[..., None], 0.0, nearest)

    def named(self, **choices: str | None) -> Flags:
        """Return which branches have the given names, shape (branches,); a choice of None does not matter.

        Args:
            choices: Of `shoulder`, `elbow` and `wrist`, in the words of a job's `configuration`.
        """
        wanted = {choice: name for choice, name in choices.items() if name is not None}
        return np.array(
            [all(getattr(own, key) == value for key, value in wanted.items()) for own in self.names]
        )

    def nearest(self, near: Array, within_limits: bool = True) -> NDArray[np.intp]:
        """Return the index (*batch,) of the branch nearest to `near` (*batch, n), rad or m; -1 for none.

        The distance is the largest difference of any joint.
        """
        usable = self.within_limits if within_limits else self.valid
        distance = np.abs(self.joints - np.asarray(near)[..., None, :]).max(axis=-1)
        best = np.argmin(np.where(usable, distance, np.inf), axis=-1)
        return np.where(usable.any(axis=-1), best, -1)
