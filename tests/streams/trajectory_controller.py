"""The rules and the interpolation of ros2_control's joint_trajectory_controller, written from its documentation.

A goal is accepted or refused as the controller does, and run as it does: between two points linear, cubic or quintic,
decided by what both ends hold.
"""

from __future__ import annotations

from bisect import bisect_right
from itertools import pairwise

import numpy as np

FLOAT_EPSILON = 1.1920928955078125e-07  # of the last velocity


class RefusedError(Exception):
    """Why a goal is not run."""


def check(trajectory: dict, joints: list[str]) -> None:
    """Do nothing where the controller of these joints accepts a trajectory_msgs/JointTrajectory."""
    names, points = trajectory["joint_names"], trajectory["points"]
    if not names or len(set(names)) != len(names):
        raise RefusedError("joint names are empty or doubled")
    if set(names) != set(joints):
        raise RefusedError("other joints than the controller's")
    if not points:
        raise RefusedError("no points")
    stamp = trajectory["header"]["stamp"]
    if (stamp["sec"], stamp["nanosec"]) != (0, 0):
        raise RefusedError("not to be started at once")
    times = [nanoseconds(point) for point in points]
    if any(after <= before for before, after in pairwise(times)):
        raise RefusedError("times do not increase")
    for index, point in enumerate(points):
        _check_point(index, point, len(names))
    if any(abs(value) > FLOAT_EPSILON for value in points[-1].get("velocities", [])):
        raise RefusedError("ends in motion")


def _check_point(index: int, point: dict, joints: int) -> None:
    for key in ("positions", "velocities", "accelerations"):
        values = point.get(key, [])
        if (values or key == "positions") and len(values) != joints:
            raise RefusedError(f"{key} of point {index}")
        if not all(type(value) is float and np.isfinite(value) for value in values):
            raise RefusedError(f"{key} of point {index} are no floats")
    if point.get("effort"):
        raise RefusedError("effort without an effort interface")


def nanoseconds(point: dict) -> int:
    time = point["time_from_start"]
    if not (type(time["sec"]) is int and 0 <= time["sec"] < 2**31 and 0 <= time["nanosec"] < 10**9):
        raise RefusedError(f"no duration: {time}")
    return time["sec"] * 10**9 + time["nanosec"]


def run(trajectory: dict, times: np.ndarray) -> np.ndarray:
    """Return positions, velocities and accelerations (3, N, n) that the controller commands at `times` (N,), s."""
    points = trajectory["points"]
    stamps = [nanoseconds(point) * 1e-9 for point in points]
    out = np.empty((3, len(times), len(trajectory["joint_names"])))
    for row, time in enumerate(times):
        index = bisect_right(stamps, time) - 1
        if index >= len(points) - 1:
            out[:, row] = _state(points[-1])
        else:
            out[:, row] = _between(
                points[index], points[index + 1], time - stamps[index], stamps[index + 1] - stamps[index]
            )
    return out


def _state(point: dict) -> np.ndarray:
    zeros = np.zeros(len(point["positions"]))
    return np.array(
        [point.get(key) or zeros for key in ("positions", "velocities", "accelerations")], dtype=float
    )


def _between(a: dict, b: dict, t: float, T: float) -> np.ndarray:
    """Return the state after t seconds of the polynomial that joins two points in T seconds."""
    order = 0
    if a.get("velocities") and b.get("velocities"):
        order = 2 if a.get("accelerations") and b.get("accelerations") else 1
    ends = [state[: order + 1] for state in (_state(a), _state(b))]
    degree = 2 * order + 1
    # rows: the derivatives of 1, t, t^2, ... at 0 and T
    rows = np.array([_derivative_row(degree, k, time) for time in (0.0, T) for k in range(order + 1)])
    coefficients = np.linalg.solve(rows, np.concatenate(ends))
    return np.array([_derivative_row(degree, k, t) @ coefficients for k in range(3)])


def _derivative_row(degree: int, order: int, t: float) -> np.ndarray:
    row = np.zeros(degree + 1)
    for power in range(order, degree + 1):
        factor = np.prod(np.arange(power - order + 1, power + 1)) if order else 1.0
        row[power] = factor * t ** (power - order)
    return row
