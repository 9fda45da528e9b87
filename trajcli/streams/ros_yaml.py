"""Goals of joint trajectory controllers as YAML: the message JointTrajectory, and the action that wraps it.

`ros2 topic pub` takes the message, `ros2 action send_goal` the goal. Numbers have all their digits, in
the form in which YAML 1.1 reads a float: with a point, and a sign in the exponent.
"""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from typing import BinaryIO, Literal

from trajcli.curves.piecewise import Array
from trajcli.errors import TrajcliError
from trajcli.knots import Knots

RosMessage = Literal["ros", "ros-goal"]

_USES = {
    "ros": (
        "ros2 topic pub --once /joint_trajectory_controller/joint_trajectory "
        'trajectory_msgs/msg/JointTrajectory "$(cat FILE)"'
    ),
    "ros-goal": (
        "ros2 action send_goal /joint_trajectory_controller/follow_joint_trajectory "
        'control_msgs/action/FollowJointTrajectory "$(cat FILE)"'
    ),
}
_BILLION = 1_000_000_000
_BLOCK = 1024  # points written at a time
_KEYS = ("positions", "velocities", "accelerations")
_STATED = {1: [True, False, False], 2: [True, True, False], 3: [True, True, True]}
_NUMBERS = r"\[([^\]]*)\]"
_POINT = re.compile(
    rf" *- \{{positions: {_NUMBERS}(?:, velocities: {_NUMBERS})?(?:, accelerations: {_NUMBERS})?, "
    r"time_from_start: \{sec: ([0-9]+), nanosec: ([0-9]+)\}\}\n"
)


def write_ros_yaml(
    joint_names: Sequence[str], knots: Knots, out: BinaryIO, message: RosMessage, orders: int = 3
) -> None:
    """Write the knots as a message, or as a goal.

    Args:
        joint_names: n names.
        knots: With n joints.
        out: Where to.
        message: "ros" for JointTrajectory, "ros-goal" for the goal of FollowJointTrajectory.
        orders: How many of position, velocity and acceleration the points state, 1 to 3.
    """
    out.write("".join(_head(joint_names, message)).encode())
    indent = "  " * (message == "ros-goal")
    for low in range(0, len(knots.nanoseconds), _BLOCK):
        out.write("".join(_points(knots, slice(low, low + _BLOCK), indent, orders)).encode())


def verify_ros_yaml(
    written: BinaryIO, joint_names: Sequence[str], knots: Knots, message: RosMessage, orders: int = 3
) -> None:
    """Read a stream from its beginning and compare every number, bit by bit, with the knots behind it.

    Args:
        written: What `write_ros_yaml` wrote.
        joint_names: As in `write_ros_yaml`.
        knots: As in `write_ros_yaml`.
        message: As in `write_ros_yaml`.
        orders: As in `write_ros_yaml`.

    Raises:
        TrajcliError: When the head, a number or the count of points differs.
    """
    written.seek(0)
    for line in _head(joint_names, message):
        if written.readline() != line.encode():
            raise TrajcliError(f"the file read back does not hold {line.strip()!r} where it was written")
    states = (knots.position, knots.velocity, knots.acceleration)[:orders]
    for index, time in enumerate(knots.nanoseconds.tolist()):
        point = _POINT.fullmatch(written.readline().decode(errors="replace"))
        if point is None or [group is not None for group in point.groups()[:3]] != _STATED[orders]:
            raise TrajcliError(f"point {index} of the file read back is none")
        same = all(
            [float(text) for text in point[k + 1].split(", ")] == rows[index].tolist()
            for k, rows in enumerate(states)
        )
        if not same or int(point[4]) * _BILLION + int(point[5]) != time:
            raise TrajcliError(f"point {index} of the file read back differs from what was written")
    if written.read(1):
        raise TrajcliError(f"the file read back goes on after the {len(knots.nanoseconds)} points written")


def _head(joint_names: Sequence[str], message: RosMessage) -> Iterator[str]:
    """Yield the lines before the points."""
    yield f"# {_USES[message]}\n"
    if message == "ros-goal":
        yield "trajectory:\n"
    indent = "  " * (message == "ros-goal")
    yield f"{indent}header: {{stamp: {{sec: 0, nanosec: 0}}, frame_id: ''}}\n"
    names = ", ".join(json.dumps(name, ensure_ascii=True) for name in joint_names)
    yield f"{indent}joint_names: [{names}]\n"
    yield f"{indent}points:\n"


def _points(knots: Knots, rows: slice, indent: str, orders: int) -> Iterator[str]:
    states = (knots.position[rows], knots.velocity[rows], knots.acceleration[rows])[:orders]
    for time, *values in zip(knots.nanoseconds[rows].tolist(), *states, strict=True):
        seconds, nanoseconds = divmod(time, _BILLION)
        said = ", ".join(f"{key}: {_list(each)}" for key, each in zip(_KEYS, values, strict=False))
        yield f"{indent}- {{{said}, time_from_start: {{sec: {seconds}, nanosec: {nanoseconds}}}}}\n"


def _list(values: Array) -> str:
    return f"[{', '.join(map(_number, (values + 0.0).tolist()))}]"


def _number(value: float) -> str:
    """Return a float as YAML 1.1 reads it: `1e-05` would be a text."""
    text = repr(value)
    if "e" in text and "." not in text:
        mantissa, exponent = text.split("e")
        return f"{mantissa}.0e{exponent}"
    return text
