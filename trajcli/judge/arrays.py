"""Judgement of motions that are arrays: of notebooks, of robot policies, of gateways."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache, partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array, numeric
from trajcli.errors import InputError
from trajcli.judge.judgement import Judgement
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.kinematics.robot import Joint, Limits, Robot, unlimited
from trajcli.streams.npy import share_of
from trajcli.streams.recorded_motion import RecordedMotion, Resolution
from trajcli.units import Units, amount_text

_NAMES = ("times", "q", "qd", "qdd")
_ROWS_AND_JOINTS = 2  # dimensions


def judge_arrays(
    times: ArrayLike,
    q: ArrayLike,
    qd: ArrayLike | None,
    qdd: ArrayLike | None,
    requirements: Requirements,
    events: tuple[str, ...] = (),
) -> Judgement:
    """Return the judgement of rows that are arrays.

    Args:
        times: s, shape (N,).
        q: rad or m, shape (N, n).
        qd: Shape (N, n); None where there are none.
        qdd: Shape (N, n); likewise.
        requirements: What they are judged by.
        events: What was taken for granted for that.

    Raises:
        InputError: When shapes do not fit, or something is not a finite number.
    """
    given = {
        name: None if values is None else numeric(values, name)
        for name, values in zip(_NAMES, (times, q, qd, qdd), strict=True)
    }
    joints = len(requirements.robot.joints)
    arrays: dict[str, Array | None] = {}
    for name, values in given.items():
        arrays[name] = None if values is None else _checked(name, values)
    t, positions = arrays["times"], arrays["q"]
    if t is None or positions is None:
        raise InputError("times and q are needed")
    _check_shapes(t, arrays, joints)
    shares = [0.0 if values is None else share_of(values.dtype) for values in given.values()]
    nothing = np.zeros(joints)
    resolution = Resolution(0.0, nothing, nothing, nothing, tuple(shares[1:]), shares[0])
    motion = RecordedMotion(
        t, positions, arrays["qd"], arrays["qdd"], None, None, None, None, resolution, "the motion"
    )
    return replace(judge_motion(lambda: (motion,), requirements), events=events)


def _checked(name: str, values: np.ndarray) -> Array:
    numbers = values.astype(np.float64)
    if not np.isfinite(numbers).all():
        where = ", ".join(str(int(index[0])) for index in np.nonzero(~np.isfinite(numbers)))
        raise InputError(f"{name}[{where}] is not a finite number")
    return numbers


def _check_shapes(t: Array, arrays: Mapping[str, Array | None], joints: int) -> None:
    if t.ndim != 1 or t.size < 2:
        raise InputError(f"times: expected shape (N,) with N at least 2, got {t.shape}")
    for name, values in arrays.items():
        if name != "times" and values is not None and values.shape != (t.size, joints):
            expected = f"({t.size}, {joints}), a row for each time and a column for each joint"
            raise InputError(f"{name}: expected shape {expected}, got {values.shape}")


def requirements_of(
    robot: str | Path | Robot | None,
    limits: Limits | Mapping[str, Any] | None,
    interpolate: str | None,
    q: ArrayLike,
) -> tuple[Requirements, tuple[str, ...]]:
    """Return what arrays are judged by, and what is taken for granted; what a name stands for is read once.

    Args:
        robot: A robot, the name of one, or the path of a file; None for bare joints, as many as q has.
        limits: That replace those of the robot: as under `limits` in a job, in SI, or as they are.
        interpolate: How rows are joined.
        q: The positions, for bare joints.

    Raises:
        InputError: When there is no such robot, or the limits have flaws.
        FileError: When a file cannot be read.
    """
    if robot is None:
        positions = numeric(q, "q")
        bare = _bare(positions.shape[1] if positions.ndim == _ROWS_AND_JOINTS else 0)
    elif isinstance(robot, Robot):
        bare = robot
    else:
        bare = _read(str(robot), _changed(str(robot)))
    conceded: tuple[str, ...] = ()
    if isinstance(limits, Limits):
        bare = replace(bare, limits=limits)
    elif limits is not None:
        bare, conceded = _limited(_Held(bare), _Held(limits, repr(_plain(limits))))
    return Requirements(bare, interpolate=interpolate, tool=_tool_of(_Held(bare))), conceded


def _plain(value: Any) -> Any:  # noqa: ANN401
    """Return the same with lists for arrays: numpy prints as many digits of these as a user wants to see."""
    if isinstance(value, Mapping):
        return {key: _plain(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(each) for each in value]
    return value.tolist() if hasattr(value, "tolist") else value


class _Held:
    """A value under a key, for caches of what is made of it."""

    def __init__(self, value: Any, key: str | None = None) -> None:  # noqa: ANN401
        self.value = value
        self._key: object = id(value) if key is None else key

    def __hash__(self) -> int:
        return hash(self._key)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Held) and self._key == other._key


@lru_cache(maxsize=16)
def _bare(joints: int) -> Robot:
    if joints < 1:
        raise InputError("q: expected shape (N, n), a row for each time and a column for each joint")
    names = tuple(Joint(f"j{number}") for number in range(1, joints + 1))
    return Robot("the motion", names, unlimited(joints), None, np.eye(4), np.eye(4))


def _changed(name: str) -> float:
    """Return when a file was changed, so that it is read anew; 0 for what is no file."""
    try:
        return Path(name).stat().st_mtime
    except (OSError, ValueError):
        return 0.0


@lru_cache(maxsize=16)
def _read(name: str, _changed: float) -> Robot:
    from trajcli.queries.arm import open_sheet

    return open_sheet(name).robot


@lru_cache(maxsize=16)
def _limited(robot: _Held, limits: _Held) -> tuple[Robot, tuple[str, ...]]:
    from trajcli.job.limits_file import with_limits

    if not isinstance(limits.value, Mapping):
        raise InputError(f"limits: expected a mapping or Limits, got {type(limits.value).__name__}")
    limited, events = with_limits(robot.value, limits.value)
    say = partial(amount_text, joint_types=limited.joint_types, units=Units())
    return limited, tuple(event.text(say) for event in events if event.concedes)


@lru_cache(maxsize=16)
def _tool_of(robot: _Held) -> Any:  # noqa: ANN401
    """Return what makes the judge of the tool; None for an arm without geometry."""
    if robot.value.convention is None:
        return None
    from trajcli.judge.recorded_tool import ToolJudge

    return lambda: ToolJudge(robot.value)
