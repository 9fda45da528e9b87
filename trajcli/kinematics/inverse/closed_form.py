"""Runs a closed form over blocks of poses and judges every answer by forward kinematics.

Of two mirrored answers (joints 4 and 6 half a turn further, joint 5 bent the other way) the first is judged:
the hand's rotation is the same product in both.

Blocks do not know of each other, so that the answers are the same whatever the number of threads. What else
is to be done with every answer is handed in, and done while the block is in the processor's cache.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.columns import Entry
from trajcli.kinematics.inverse.judge import Judge
from trajcli.kinematics.inverse.lines import Arm, Goal
from trajcli.kinematics.inverse.method import Choice, Method
from trajcli.kinematics.inverse.subproblems import (
    Mirrored,
    Opposed,
    Turn,
    Value,
    Watch,
    angle,
)
from trajcli.kinematics.robot import Robot

_BLOCK = 6250  # poses at a time: in the processor's cache, and long enough to hide the cost of a call
_EACH = 3  # blocks for each thread at least: with fewer, threads cost more than they gain
_WORKSPACE = 1 << 21  # numbers: more than the temporary arrays of a block
_ORDER: tuple[Choice, ...] = ("shoulder", "elbow", "wrist")
Settle = Callable[[slice, Array, Array], None]


@frozen
class Candidates:
    """Every branch of a flat batch of N poses, also where the pose is out of reach. Joints come first.

    Attributes:
        joints: Shape (n, branches, N).
        gaps: Shape (2, branches, N): m, and an upper bound of the angle in rad, at most 1.5 times too large.
        watched: Shape (N,): an angle is free, or two branches fall together.
    """

    joints: Array
    gaps: Array
    watched: Flags


def candidates(
    robot: Robot, arm: Arm, method: Method, poses: Array, settle: Settle | None = None
) -> Candidates:
    """Return all branches of poses (N, 4, 4) by a method that has a closed form.

    Args:
        robot: The arm.
        arm: Its lines.
        method: Its closed form.
        poses: T_world_tcp.
        settle: (which poses, their joints, their gaps) for each block, in any thread; may change them.

    Raises:
        ValueError: When the method has none.
    """
    if method.solve is None:
        raise ValueError(f"the method {method.name} has no closed form")
    # freed at once: the allocator then keeps blocks of this size instead of returning them
    np.empty(_WORKSPACE)
    count, twos = len(poses), (2,) * len(method.choices)
    joints, gaps = np.empty((len(robot.joints), *twos, count)), np.empty((2, *twos, count))
    watched = np.zeros(count, dtype=bool)
    order, judge, solve = _order(method), Judge(robot), method.solve
    places, misses, flat = joints.transpose(order), gaps.transpose(order), poses.reshape(-1, 16)
    found = Candidates(
        joints.reshape(len(joints), 2 ** len(twos), count), gaps.reshape(2, 2 ** len(twos), count), watched
    )

    def fill(block: slice) -> None:
        rows = np.ascontiguousarray(flat[block, :12].T)
        goal, watch = Goal(arm, rows), Watch(rows.shape[1], arm.length)
        values = solve(goal, watch)
        for value, place in zip(values, places[..., block], strict=True):
            _write(value, place)
        misses[0, ..., block], misses[1, ..., block] = judge.gaps(_judged(values, len(twos)), goal)
        watched[block] = watch.rows
        if settle is not None:
            settle(block, found.joints[..., block], found.gaps[..., block])

    _each(fill, [slice(low, low + _BLOCK) for low in range(0, count, _BLOCK)])
    return found


def _each(work: Callable[[slice], None], blocks: Sequence[slice]) -> None:
    """Work on all blocks, in threads where there are many: numpy computes without the interpreter's lock."""
    threads = min(os.cpu_count() or 1, len(blocks) // _EACH)
    if threads < 2:
        for block in blocks:
            work(block)
        return
    from concurrent.futures import ThreadPoolExecutor

    with ThreadPoolExecutor(threads) as pool:
        for _ in pool.map(work, blocks):
            pass


def _order(method: Method) -> list[int]:
    """Return the axes of results (k, *branches, N) in the order of the solver's values, last choice first."""
    present = [choice for choice in _ORDER if choice in method.choices]
    return [0, *(1 + present.index(choice) for choice in reversed(method.choices)), 1 + len(present)]


def _write(value: Value, out: Array) -> None:
    """Write angles or slides into (2, ..., 2, B); what is the same for several branches is computed once."""
    if not isinstance(value, tuple | Mirrored | Opposed):
        out[...] = value
        return
    pair, answers = (value, ()) if isinstance(value, tuple) else (value.turn, (2,))
    shape = (*answers, *np.broadcast(*pair).shape)
    place = out if shape == out.shape else np.empty(shape)
    if isinstance(value, tuple):
        angle(value, place)
    else:
        value.write(place)
    if place is not out:
        out[...] = place


def _judged(values: Sequence[Value], choices: int) -> list[Turn | Entry]:
    """Return turns and slides; of a mirrored hand (two joints half a turn further) the first answer's."""
    if sum(isinstance(value, Mirrored) for value in values) < 2:
        return [value.both() if isinstance(value, Mirrored | Opposed) else value for value in values]
    return [_first_of(value, choices) for value in values]


def _first_of(value: Value, choices: int) -> Turn | Entry:
    if isinstance(value, Mirrored | Opposed):
        return value.turn
    if isinstance(value, tuple):
        return _without_last_choice(value[0], choices), _without_last_choice(value[1], choices)
    return _without_last_choice(value, choices)


def _without_last_choice(entry: Entry, choices: int) -> Entry:
    return entry[0] if isinstance(entry, np.ndarray) and entry.ndim > choices else entry
