"""Findings of a check, and legal steps in acceleration."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import field
from typing import Literal, overload

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import Amount, Amounts, said
from trajcli.frozen import comparable, frozen
from trajcli.limits.kinds import LimitName
from trajcli.trajectory import Trajectory

FindingKind = Literal[
    LimitName,
    "position_jump",
    "velocity_jump",
    "acceleration_jump",
    "waypoint",
    "target",
    "tool_path",
    "tool_orientation",
    "tool_acceleration_jump",
    "branch",
]
FindingMethod = Literal["exact", "bounded", "sampled"]
_RATES = ("", "/s", "/s^2", "/s^3")


@comparable
class Finding:
    """Something that is wrong with a trajectory.

    Attributes:
        move: Index of the move; None when it is about the whole trajectory.
        joint: Name of the joint; None when it is about the tool.
        kind: The quantity that breaks its limit, or that jumps; a waypoint or an end
            that is not where it should be; a
            tool that leaves its path or its limits; an arm that changes its branch.
        value: SI, signed as on the curve; for a jump the value after minus the value before; for a waypoint
            or target the distance from it.
        limit: The bound it breaks, SI, signed as the value; for a jump the size that rounding explains; for a
            waypoint or target the distance that was promised.
        time: Seconds from the start of the trajectory.
        method: "exact": from the roots of derivatives; "bounded": at most that for all t, proven between rows
            within 1e-6; "sampled": on rows, without a proof of what is between them.
        factor: By what factor the move must last longer for the limit to hold; None where that does not help.
        hint: What would fix it.
        message: What is wrong, one sentence for people.
        amounts: Numbers and names that the message holds as `{name}`.
        unit: Of value and limit, where the message has no amounts any more.
    """

    move: int | None
    joint: str | None
    kind: FindingKind
    value: float
    limit: float
    time: float
    method: FindingMethod = "exact"
    factor: float | None = None
    hint: str | None = None
    message: str = ""
    amounts: Amounts = field(default_factory=dict)
    unit: str | None = None

    @property
    def si_unit(self) -> str | None:
        """Unit of value and limit, such as "rad/s"; None where they are no quantities."""
        amount = self.amounts.get("value")
        if not isinstance(amount, Amount):
            return self.unit
        if amount.unit is not None:
            return amount.unit
        return ("m" if amount.dimension == "length" else "rad") + _RATES[amount.order]

    def text(self, say: Callable[[Amount], str] = str) -> str:
        """Return the message with its amounts said by `say`."""
        return said(self.message, self.amounts, say)


def joint_amounts(trajectory: Trajectory, joint: int, order: int, **values: float) -> Amounts:
    """Return a joint's name, and values of its position or of a derivative of it, as amounts of a message."""
    dimension: Literal["length", "angle"] = (
        "length" if trajectory.joint_types[joint] == "prismatic" else "angle"
    )
    amounts = {name: Amount(value, order, joint, dimension) for name, value in values.items()}
    return {"joint": trajectory.joint_names[joint], **amounts}


def at_time(time: float) -> str:
    """Return the words that say when, in s from the start of the trajectory."""
    return f"at t = {time:.9g} s"


@comparable
class AccelerationStep:
    """A step in a joint's acceleration, which is legal where the joint has no jerk limit.

    Attributes:
        move: Index of the move it belongs to: the one that begins with it, or the one that ends with it where
            the acceleration is zero afterwards.
        joint: Name of the joint.
        time: Seconds from the start of the trajectory.
        size: Acceleration after minus before, SI.
    """

    move: int
    joint: str
    time: float
    size: float


@frozen
class AccelerationSteps(Sequence[AccelerationStep]):
    """Steps in order of time; a long motion has one for every joint at every break, made when asked for.

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
    def __getitem__(self, index: int) -> AccelerationStep: ...

    @overload
    def __getitem__(self, index: slice) -> list[AccelerationStep]: ...

    def __getitem__(self, index: int | slice) -> AccelerationStep | list[AccelerationStep]:
        if isinstance(index, slice):
            return [self[k] for k in range(*index.indices(len(self)))]
        name = self.joint_names[int(self.joints[index])]
        return AccelerationStep(
            int(self.moves[index]), name, float(self.times[index]), float(self.sizes[index])
        )
