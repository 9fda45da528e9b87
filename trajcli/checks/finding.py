"""What a check has to say."""

from __future__ import annotations

from typing import Literal

from trajcli.frozen import comparable

Kind = Literal[
    "position",
    "velocity",
    "acceleration",
    "jerk",
    "position_jump",
    "velocity_jump",
    "acceleration_jump",
    "waypoint",
    "tool_path",
    "tool_orientation",
    "tool_speed",
    "tool_angular_speed",
    "tool_acceleration",
    "tool_angular_acceleration",
    "tool_acceleration_jump",
    "tool_jerk",
    "branch",
]
Method = Literal["exact", "bounded", "sampled"]


@comparable
class Finding:
    """Something that is wrong with a trajectory.

    Attributes:
        move: Index of the move; None when it is about the whole trajectory.
        joint: Name of the joint; None when it is about the tool.
        kind: The quantity that breaks its limit, or that jumps; a waypoint that is not where it should be; a
            tool that leaves its path or its limits; an arm that changes its branch.
        value: SI, signed as on the curve; for a jump the value after minus the value before; for a waypoint
            the distance from it.
        limit: The bound it breaks, SI, signed as the value; for a jump the size that rounding explains; for a
            waypoint the distance that was promised.
        time: Seconds from the start of the trajectory.
        method: "exact": from the roots of derivatives; "bounded": at most that for all t, proven between rows
            within 1e-6; "sampled": on rows, without a proof of what is between them.
        factor: By what factor the move must last longer for the limit to hold; None where that does not help.
        hint: What would fix it.
    """

    move: int | None
    joint: str | None
    kind: Kind
    value: float
    limit: float
    time: float
    method: Method = "exact"
    factor: float | None = None
    hint: str | None = None


@comparable
class Step:
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
