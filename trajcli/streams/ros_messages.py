"""Joint trajectories in YAML, as ROS tools print and take them: messages, goals, and streams of them.

Read are JointTrajectory, the RobotTrajectory and DisplayTrajectory of MoveIt, goals of FollowJointTrajectory,
and the first message of `ros2 topic echo`, with the names of ROS 1 as well. Numbers know how many decimals
they were written with.
"""

from __future__ import annotations

import re
from codecs import BOM_UTF8
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from math import isfinite
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError, Place, Problem
from trajcli.frozen import frozen
from trajcli.streams.byte_source import ByteSource
from trajcli.streams.number_cells import decimals_of

_LARGEST = 64 << 20  # bytes: a text that is larger is no message
_KEYS = ("positions", "velocities", "accelerations", "effort")
_LARGEST_NUMBER = 1e300
_NANOSECONDS = 9  # decimals of a time that is given as sec and nanosec
_WRAPPERS = ("joint_trajectory", "trajectory", "goal", "planned_trajectory", "robot_trajectory", "msg")
_CUT = re.compile(r"^\s*-?\s*'?\.\.\.'?\s*$|, '?\.\.\.'?\s*\]", re.MULTILINE)
_SHOWN = 40  # characters of a value in a message


@frozen
class JointMessage:
    """A joint trajectory, SI.

    Attributes:
        joint_names: n names.
        times: Time from the start of each point, s, shape (N,).
        position: Shape (N, n).
        velocity: Shape (N, n), or (N, 0) where no point has any.
        acceleration: Likewise.
        effort: Likewise.
        decimals: The most that a number of each column shows: of the times, the positions and so on, (m,).
    """

    joint_names: tuple[str, ...]
    times: Array
    position: Array
    velocity: Array
    acceleration: Array
    effort: Array
    decimals: NDArray[np.int64]


class WrittenNumber(float):
    """A number that knows its decimals."""

    decimals = 0


def read_ros_yaml(source: str | Path | ByteSource) -> JointMessage:
    """Return the joint trajectory of a YAML file.

    Raises:
        FileError: When it cannot be read.
        InputError: When it is no YAML, holds no joint trajectory, or one that is cut or incomplete.
    """
    bytes_of = source if isinstance(source, ByteSource) else ByteSource(source)
    file = bytes_of.file
    text = _text(bytes_of)
    cut = _CUT.search(text)
    if cut is not None and "'...'" in cut[0]:
        line = text.count("\n", 0, text.index("'...'", cut.start())) + 1
        place = Place(file, line, 1, cut[0].strip())
        hint = "print it again with `ros2 topic echo --full-length`"
        raise InputError(Problem("the message is cut: long arrays end in '...'", hint, place))
    return _message(_trajectory(_document(text, file), file), file)


def _text(source: ByteSource) -> str:
    """Return the first document of a stream of them."""
    lines: list[bytes] = []
    size, content = 0, False
    with source.open() as stream:
        while line := stream.readline(_LARGEST + 1):
            size += len(line)
            line = line if lines else line.removeprefix(BOM_UTF8)
            if size > _LARGEST:
                hint = "longer motions are read from CSV, JSON lines and MCAP"
                raise InputError(f"{source.file}: a message in YAML has at most {_LARGEST} bytes", hint=hint)
            if content and line.startswith((b"---", b"...")):
                break
            content = content or (bool(line.strip()) and not line.startswith((b"---", b"#", b"%")))
            lines.append(line)
    try:
        return b"".join(lines).decode()
    except UnicodeDecodeError as error:
        at = f"{error.reason} at byte {error.start}"
        raise InputError(f"{source.file} is no UTF-8 text: {at}") from error


def _document(text: str, file: str) -> Any:  # noqa: ANN401
    import yaml

    try:
        return yaml.load(text, Loader=_loader())  # noqa: S506
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None)
        place = None if mark is None else Place(file, mark.line + 1, mark.column + 1)
        problem = getattr(error, "problem", None) or "it is no YAML"
        raise InputError(Problem(f"{file} is no YAML: {problem}", None, place)) from error
    except (RecursionError, ValueError) as error:
        raise InputError(f"{file} is no message in YAML: {type(error).__name__}") from None


@cache
def _loader() -> Any:  # noqa: ANN401
    """Return a safe loader whose numbers know their decimals; 1e-05 is a number, as ROS 1 prints it."""
    import yaml

    class Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
        pass

    def number(loader: Any, node: Any) -> float:  # noqa: ANN401
        value = WrittenNumber(loader.construct_yaml_float(node))
        shown = node.value.lower().replace(".0e", "e")  # YAML 1.1 asks for the point
        value.decimals = decimals_of(shown.encode()) if isfinite(value) else 0
        return value

    form = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)[eE][-+]?[0-9]+$")
    Loader.add_implicit_resolver("tag:yaml.org,2002:float", form, list("-+0123456789."))
    Loader.add_constructor("tag:yaml.org,2002:float", number)
    return Loader


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
    if isinstance(document, Mapping) and "moves" in document:
        hint = f"`trajcli plan {file} -o rows.csv` writes its rows"
        raise InputError(f"{file} is a job, and no motion yet", hint=hint)
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
    written = {key: list(_values(points, key, len(names), file)) for key in _KEYS}
    times = [_seconds(point, index, file) for index, point in enumerate(points)]
    columns = [column for rows in written.values() for column in zip(*rows, strict=True)]
    decimals = [max(decimals for _, decimals in times), *(max(map(_decimals, each)) for each in columns)]
    position, velocity, acceleration, effort = (
        np.array(written[key], dtype=np.float64).reshape(len(points), -1) for key in _KEYS
    )
    seconds = np.array([time for time, _ in times])
    shown = np.array(decimals, dtype=np.int64)
    return JointMessage(tuple(names), seconds, position, velocity, acceleration, effort, shown)


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
        yield values


def _seconds(point: Mapping[str, Any], index: int, file: str) -> tuple[float, int]:
    """Return the time of a point from the start, s, and its decimals."""
    value = point.get("time_from_start")
    if isinstance(value, Mapping):
        parts = [value.get(key, value.get(old, 0)) for key, old in (("sec", "secs"), ("nanosec", "nsecs"))]
        keys = {"sec", "secs", "nanosec", "nsecs"}
        if value and value.keys() <= keys and all(map(_is_number, parts)):
            nanoseconds = parts[0] * 10**9 + parts[1]
            if abs(nanoseconds) < 2**63:
                return nanoseconds / 10**9, _NANOSECONDS
    elif _is_number(value):
        return float(value), _decimals(value)  # type: ignore[arg-type]
    raise InputError(
        f"{file}: time_from_start of point {index} is {_shown(value)}",
        hint="expected {sec: 1, nanosec: 500000000}",
    )


def _decimals(value: float) -> int:
    return value.decimals if isinstance(value, WrittenNumber) else 0


def _is_number(value: Any) -> bool:  # noqa: ANN401
    if not isinstance(value, int | float) or isinstance(value, bool):
        return False
    return abs(value) <= _LARGEST_NUMBER  # also of whole numbers that no float holds


def _shown(value: Any) -> str:  # noqa: ANN401
    text = repr(value)
    return text if len(text) <= _SHOWN else text[:_SHOWN] + " ..."
