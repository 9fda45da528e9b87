"""Steps in acceleration as a sequence: a long motion has one for every joint at every break."""

from __future__ import annotations

from collections.abc import Sequence
from typing import overload

import numpy as np
from numpy.typing import NDArray

from trajcli.checks.finding import Step
from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen


@frozen
class Steps(Sequence[Step]):
    """Steps in order of time, each made when it is asked for.

    Attributes:
        moves: Index of the move that each belongs to, shape (k,).
        joints: Index of the joint, shape (k,).
        times: Seconds from the start of the trajectory, shape (k,).
        sizes: Acceleration after minus before, SI, shape (k,).
        joint_names: Of all joints.
    """

    moves: NDArray[np.intp]
    joints: NDArray[np.intp]
    times: Array
    sizes: Array
    joint_names: tuple[str, ...]

    def __len__(self) -> int:
        return self.times.size

    @overload
    def __getitem__(self, index: int) -> Step: ...

    @overload
    def __getitem__(self, index: slice) -> list[Step]: ...

    def __getitem__(self, index: int | slice) -> Step | list[Step]:
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        name = self.joint_names[int(self.joints[index])]
        return Step(int(self.moves[index]), name, float(self.times[index]), float(self.sizes[index]))
