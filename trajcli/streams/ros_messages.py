"""Joint trajectories in YAML, as ROS tools print and take them: messages, goals, and streams of them.

Read are JointTrajectory, the RobotTrajectory and DisplayTrajectory of MoveIt, goals of FollowJointTrajectory,
and the first message of `ros2 topic echo`, with the names of ROS 1 as well.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import FileError, InputError, Place, Problem
from trajcli.frozen import frozen

_LARGEST = 512 << 20  # bytes: a text that is larger is no message
_KEYS = ("positions", "velocities", "accelerations")
_WRAPPERS = ("joint_trajectory", "trajectory", "goal", "planned_trajectory", "robot_trajectory")
_CUT = re.compile(r"^\s*-?\s*'?\.\.\.'?\s*$|, '?\.\.\.'?\s*\]", re.MULTILINE)
_SHOWN = 40  # characters of a value in a message


@frozen
class JointMessage:
    """A joint trajectory, SI.

    Attributes:
        file: Its name.
        joint_names: n names.
        times: Time from the start of each point, s, shape (N,).
        position: Shape (N, n).
        velocity: Shape (N, n), or (N, 0) where no point has any.
        acceleration: Likewise.
    """

    file: str
    joint_names: tuple[str, ...]
    times: Array
    position: Array
    velocity: Array
    acceleration: Array


def read_ros_yaml(path: str | Path) -> JointMessage:
    """Return the joint trajectory of a YAML file.

    Raises:
        FileError: When it cannot be read.
        InputError: When it is no YAML, holds no joint trajectory, or one that is cut or incomplete.
    """
    file = str(path)
    text = _text(file)
    cut = _CUT.search(text)
    if cut is not None and "'...'" in cut[0]:
        line = text.count("\n", 0, cut.start()) + 1 + cut[0].startswith("\n")
        place = Place(file, line, 1, cut[0].strip())
        hint = "print it again with `ros2 topic echo --full-length`"
        raise InputError(Problem("the message is cut: long arrays end in '...'", hint, place))
    return _message(_trajectory(_first_document(text, file), file), file)


def _text(file: str) -> str:
    try:
        size = Path(file).stat().st_size
        if size > _LARGEST:
            raise InputError(f"{file} has {size} bytes, a message in YAML at most {_LARGEST}")
        return Path(file).read_text(encoding="utf-8")
    except UnicodeDecodeError as error:
        raise InputError(f"{file} is no UTF-8 text: {error.reason} at byte {error.start}") from error
    except OSError as error:
        raise FileError(f"{file} cannot be read: {error.strerror}") from error


def _first_document(text: str, file: str) -> Any:  # noqa: ANN401
    """Return the first document of a YAML stream."""
    import yaml

    loader = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        return next(iter(yaml.load_all(text, Loader=loader)), None)
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = None if mark is None else Place(file, mark.line + 1, mark.column + 1)
        problem = getattr(error, "problem", None) or "it is no YAML"
        raise InputError(Problem(f"{file} is no YAML: {problem}", None, place)) from error
    except RecursionError:
        raise InputError(f"{file} is nested too deeply to be a message") from None


def _trajectory(document: Any, file: str) -> Mapping[str, Any]:  # noqa: ANN401
    """Return the message inside of what wraps it."""
    inner = document
    for _ in range(len(_WRAPPERS) + 1):
        if isinstance(inner, Sequence) and not isinstance(inner, str) and inner:
            inner = inner[0]
        if not isinstance(inner, Mapping):
            break
        if "points" in inner and "joint_names" in inner:
            return inner
        inner = next((inner[key] for key in _WRAPPERS if key in inner), None)
    raise InputError(
        f"{file} holds no joint trajectory",
        hint="expected the keys joint_names and points, as in trajectory_msgs/msg/JointTrajectory",
    )


def _message(message: Mapping[str, Any], file: str) -> JointMessage:
    names, points = message["joint_names"], message["points"]
    if not isinstance(names, list) or not names or not all(isinstance(name, str) for name in names):
        raise InputError(f"{file}: joint_names are {_shown(names)}, expected a list of names")
    if not isinstance(points, list) or not points:
        raise InputError(f"{file}: points are {_shown(points)}, expected at least one point")
    states = {key: np.array(list(_values(points, key, len(names), file))) for key in _KEYS}
    for key in _KEYS[1:]:
        if not states[key].size:
            states[key] = np.empty((len(points), 0))
    times = np.array([_seconds(point, index, file) for index, point in enumerate(points)])
    return JointMessage(file, tuple(names), times, *(states[key] for key in _KEYS))


def _values(points: Sequence[Any], key: str, joints: int, file: str) -> Iterator[list[float]]:
    """Yield the numbers of one key of all points; nothing where no point has any."""
    given = [isinstance(point, Mapping) and bool(point.get(key)) for point in points]
    if not any(given) and key != "positions":
        return
    for index, point in enumerate(points):
        values = point.get(key) if isinstance(point, Mapping) else None
        if not isinstance(values, list) or len(values) != joints or not all(map(_is_number, values)):
            raise InputError(
                f"{file}: {key} of point {index} are {_shown(values)}, expected {joints} finite numbers",
                hint="a point has a number for each joint" if all(given) else f"give {key} for all points",
            )
        yield [float(value) for value in values]


def _seconds(point: Mapping[str, Any], index: int, file: str) -> float:
    """Return the time of a point from the start, s."""
    value = point.get("time_from_start")
    if isinstance(value, Mapping):
        parts = [value.get(key, value.get(old, 0)) for key, old in (("sec", "secs"), ("nanosec", "nsecs"))]
        known = {"sec", "secs", "nanosec", "nsecs"}
        if value and value.keys() <= known and all(map(_is_number, parts)):
            return float(parts[0]) + float(parts[1]) * 1e-9
    elif _is_number(value):
        return float(value)  # type: ignore[arg-type]
    raise InputError(
        f"{file}: time_from_start of point {index} is {_shown(value)}",
        hint="expected {sec: 1, nanosec: 500000000}",
    )


def _is_number(value: Any) -> bool:  # noqa: ANN401
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)


def _shown(value: Any) -> str:  # noqa: ANN401
    text = repr(value)
    return text if len(text) <= _SHOWN else text[:_SHOWN] + " ..."
