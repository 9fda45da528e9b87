"""Angle wrapping: the choice between full turns of a joint by its limits and by the nearest configuration.

A value counts as inside while it is within `limit * (1 + 1e-9) + 1e-12`, as everywhere.
"""

from __future__ import annotations

from collections.abc import Collection
from functools import lru_cache
from math import prod

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.robot import Robot

FULL = 2.0 * np.pi
_LISTED = 100000  # choices of turns of one configuration
_FEW = 4096  # values of a joint up to which all joints are moved together


def widened(bounds: Array) -> Array:
    """Return position limits (n, 2) with the tolerance of a limit added."""
    return np.asarray(bounds + (np.abs(bounds) * 1e-9 + 1e-12) * [-1.0, 1.0])


def beyond(joints: Array, bounds: Array) -> Array:
    """Return by how much joints (..., n) are outside their limits, negative below; zero inside."""
    wide = widened(bounds)
    over, under = joints - bounds[:, 1], joints - bounds[:, 0]
    return np.where(joints > wide[:, 1], over, np.where(joints < wide[:, 0], under, 0.0))


@lru_cache(maxsize=16)
def revolute(robot: Robot) -> Flags:
    """Return which joints turn, shape (n,), read-only."""
    turning = np.array([kind == "revolute" for kind in robot.joint_types])
    turning.flags.writeable = False
    return turning


def choose_turns(robot: Robot, joints: Array, near: Array | None, within: float = np.inf) -> None:
    """Move revolute joints (n, branches, N), in place, by full turns into their limits.

    Of several turns inside the limits the one nearest to `near` (n, N), or to zero, is taken; of none the one
    with the smallest excess.

    Args:
        robot: The arm.
        joints: What is moved; one row is one joint.
        near: Joint values.
        within: Bound of the revolute joints' absolute values, rad: spares those with wider limits the search.
    """
    wide, turning = widened(robot.limits.position)[..., None, None], revolute(robot)
    if near is None and within <= np.pi:
        turning = turning & ((wide[:, 0, 0, 0] > -within) | (within > wide[:, 1, 0, 0]))
    some = np.flatnonzero(turning)
    for part in [some] if joints[0].size <= _FEW else [slice(i, i + 1) for i in some]:
        values, low, high = joints[part], wide[part, 0], wide[part, 1]
        aim = np.zeros((len(values), 1, 1)) if near is None else near[part][:, None]
        outside = values < np.maximum(low, aim - np.pi)
        outside |= values > np.minimum(high, aim + np.pi)
        index = np.flatnonzero(outside)
        if len(index):
            rows, poses = index // values[0].size, index % values.shape[-1] if near is not None else 0
            moved = _wrapped(values.take(index), aim[rows, 0, poses], low[rows, 0, 0], high[rows, 0, 0])
            values.put(index, moved)
            joints[part] = values


def _wrapped(values: Array, aims: Array, low: Array, high: Array) -> Array:
    """Return values (K,) in the turn nearest to their aims inside the limits, or with the smallest excess."""
    first, last = np.ceil((low - values) / FULL), np.floor((high - values) / FULL)
    wanted = np.round((aims - values) / FULL)
    inside = np.minimum(np.maximum(wanted, first), last)
    below, above = values + FULL * last, values + FULL * first
    outside = np.where(low - below <= above - high, last, first)
    with np.errstate(invalid="ignore"):
        result: Array = values + FULL * np.where(first <= last, inside, outside)
    return result


def all_turns(robot: Robot, joints: Array, pinned: Collection[int] = ()) -> Array:
    """Return one configuration (n,) with every choice of turns inside the limits, shape (choices, n).

    A joint without limits keeps its value; so does one that no turn brings inside, and one that is pinned.

    Raises:
        InputError: When there are too many to list.
    """
    wide, choices = widened(robot.limits.position), []
    for joint, (value, turns, (low, high)) in enumerate(zip(joints, revolute(robot), wide, strict=True)):
        options = joints[:0]
        if turns and joint not in pinned and np.isfinite([low, high]).all():
            first, last = np.ceil((low - value) / FULL), np.floor((high - value) / FULL)
            options = value + FULL * np.arange(first, min(last, first + _LISTED) + 1)
        choices.append(options if options.size else [value])
    if prod(map(len, choices)) > _LISTED:
        raise InputError(
            f"the limits of {robot.name} allow over {_LISTED} choices of full turns",
            hint="narrow the position limits of its joints",
        )
    return np.stack(np.meshgrid(*choices, indexing="ij"), axis=-1).reshape(-1, len(choices))
