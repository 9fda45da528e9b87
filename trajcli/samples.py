"""Sampling of a trajectory on a grid of times.

Rows are evaluated in blocks of bounded size, so that memory does not grow with their number.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import ceil, isfinite

import numpy as np
from numpy.typing import NDArray

from trajcli.columns import (
    JOINT_ORDERS,
    TOOL_COLUMNS,
    Group,
    check_groups,
    group_factors,
    joint_factors,
)
from trajcli.curves.piecewise import Array, PiecewisePolynomial, read_only
from trajcli.errors import InputError
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.robot import Robot
from trajcli.trajectory import Trajectory
from trajcli.units import Units

ROWS = 4096  # rows of a block: long enough to hide the cost of a call, short enough for the cache

_NANOSECOND = 1e-9  # the last decimal of a time in a file: rows closer than this would show the same time
_END = 1e-6  # of a period: an end this close to a grid time replaces that row
_BREAK = 1e-12  # s: a row this close before a break is at it; rounding decides no row's side

_TOOL_ORDERS = {"pose": 0, "twist": 1, "twistd": 2}  # the highest derivative of q that each group needs


@comparable
class UniformGrid:
    """Rows at `start_time` + k / rate, and one exactly at the end.

    Attributes:
        duration: Seconds, at least 0.
        rate: Hz.
        start_time: Time of the first row, s.
    """

    duration: float
    rate: float
    start_time: float = 0.0

    def __post_init__(self) -> None:
        if not (isfinite(self.rate) and self.rate > 0):
            raise InputError(f"the rate is {self.rate:g} Hz, expected a finite number above 0")
        if not isfinite(self.start_time):
            raise InputError(f"the start time is {self.start_time:g} s, expected a finite number")
        finest = max(2 * _NANOSECOND, 8 * self._spacing)
        if 1 / self.rate < finest:
            raise InputError(
                f"the rate of {self.rate:g} Hz is too high: the times of neighbouring rows would be equal",
                hint=f"from {self.start_time:g} s on, the rate can be at most {1 / finest:g} Hz",
            )

    @property
    def count(self) -> int:
        """Number of rows, at least 1."""
        near = max(_END / self.rate, _NANOSECOND, 2 * self._spacing)
        return max(ceil((self.duration - near) * self.rate), 0) + 1

    @property
    def _spacing(self) -> float:
        """Distance of neighbouring float64 numbers at the largest time, s."""
        return float(np.spacing(abs(self.start_time) + self.duration))

    def blocks(self, size: int = ROWS) -> Iterator[tuple[Array, Array]]:
        """Yield, for `size` rows at a time, their times as written and from the start, each (N,), s."""
        count = self.count
        for low in range(0, count, size):
            high = min(low + size, count)
            local = np.arange(low, high) / self.rate
            if high == count:
                local[-1] = self.duration
            yield self.start_time + local, local


@frozen
class ListedGrid:
    """Rows at given times.

    Attributes:
        duration: Seconds, at least 0.
        times: Shape (N,), s, counted like `start_time`: strictly increasing, inside the trajectory.
        start_time: Time at which the trajectory starts, s.
    """

    duration: float
    times: Array
    start_time: float = 0.0

    def __post_init__(self) -> None:
        times = read_only(self.times)
        low, high = self.start_time, self.start_time + self.duration
        if times.ndim != 1 or times.size == 0:
            raise InputError("the list of times is empty", hint="give at least one time, or a rate")
        inside = (times >= low - _NANOSECOND) & (times <= high + _NANOSECOND)
        if not inside.all():
            raise InputError(
                f"the time {times[~inside][0]:.12g} s lies outside the trajectory",
                hint=f"it lasts from {low:.12g} s to {high:.12g} s",
            )
        times = read_only(np.clip(times, low, high))
        close = np.flatnonzero(np.diff(times) <= _NANOSECOND)
        if close.size:
            first, second = times[close[0]], times[close[0] + 1]
            raise InputError(
                f"the time {first:.12g} s is followed by {second:.12g} s",
                hint="times must increase, by more than 1e-9 s each",
            )
        object.__setattr__(self, "times", times)

    @property
    def count(self) -> int:
        """Number of rows, at least 1."""
        return int(self.times.size)

    def blocks(self, size: int = ROWS) -> Iterator[tuple[Array, Array]]:
        """Yield, for `size` rows at a time, their times as written and from the start, each (N,), s."""
        for low in range(0, self.count, size):
            times = self.times[low : low + size]
            yield times, np.clip(times - self.start_time, 0.0, self.duration)


Grid = UniformGrid | ListedGrid


def sample(
    trajectory: Trajectory,
    grid: Grid,
    groups: Sequence[Group],
    units: Units | None = None,
    *,
    robot: Robot | None = None,
    size: int = ROWS,
) -> Iterator[Array]:
    """Yield blocks of at most `size` rows, each of shape (N, columns).

    At a break the later piece speaks, and at a border the later move; the end belongs to what ends there.
    The quaternion of the pose never jumps to the other sign, from the first row, where w >= 0, to the last.

    Args:
        trajectory: What is sampled.
        grid: Where; of the trajectory's duration.
        groups: Groups of columns in the order wanted, as `columns_of` lists them.
        units: Units of the rows; SI if left out.
        robot: Whose tool it is, base and tool included; needed for the groups of `TOOL_COLUMNS` only.
        size: Most rows of a block.

    Raises:
        InputError: When `groups` is empty, or holds an unknown group or one twice, or one about the tool of
            no robot or of one without geometry.
    """
    units = units or Units()
    check_groups(groups)
    factors = joint_factors(trajectory.joint_types, units)
    curve, starts = trajectory.curve, _Starts(trajectory)
    orders, last = _orders(groups), None
    for times, local in grid.blocks(size):
        local = _onto_breaks(local, curve.breaks)
        motion = _in_units(_window(curve, local), factors).evaluate_orders(local, orders)
        parts = []
        for group in groups:
            if group in JOINT_ORDERS:
                parts.append(motion[:, orders.index(JOINT_ORDERS[group])])
            elif group in TOOL_COLUMNS:
                part = _of_tool(group, robot, motion * factors, last)
                last = part[-1, 3:] if group == "pose" else last
                parts.append(part / group_factors(group, units))
            elif group == "path":
                parts.append(_path_law(trajectory, starts, local) / group_factors(group, units))
            else:
                parts.append((times if group == "t" else starts.moves(local))[:, None])
        yield np.concatenate(parts, axis=1)


def _orders(groups: Sequence[Group]) -> list[int]:
    """Return the orders of derivatives that `groups` need, rising; at least one."""
    orders = {JOINT_ORDERS[group] for group in groups if group in JOINT_ORDERS}
    for group in groups:
        orders |= set(range(_TOOL_ORDERS.get(group, -1) + 1))
    return sorted(orders) or [0]


def _of_tool(group: Group, robot: Robot | None, motion: Array, last: Array | None) -> Array:
    """Return a group of `TOOL_COLUMNS`, shape (N, columns), in SI.

    Args:
        group: Which.
        robot: Whose tool.
        motion: q and as many of its derivatives as the group needs, SI, shape (N, orders, n).
        last: Quaternion of the row before, (4,); None before the first.
    """
    # a plan without these columns does not pay for the imports
    from trajcli.geometry.rotation import quaternion_from_matrix, without_jumps
    from trajcli.kinematics.forward import forward
    from trajcli.kinematics.jacobian import tcp_acceleration, tcp_twist

    if robot is None:
        raise InputError(
            f"the columns '{group}' are about a tool, and there is no robot", hint="give the robot"
        )
    if group == "twist":
        return tcp_twist(robot, motion[:, 0], motion[:, 1])
    if group == "twistd":
        return tcp_acceleration(robot, motion[:, 0], motion[:, 1], motion[:, 2])
    poses = forward(robot, motion[:, 0])
    quaternions = without_jumps(quaternion_from_matrix(poses[:, :3, :3]), last)
    return np.concatenate([poses[:, :3, 3], quaternions], axis=1)


def _in_units(curve: PiecewisePolynomial, factors: Array) -> PiecewisePolynomial:
    return PiecewisePolynomial(curve.breaks, curve.coefficients / factors)


def _onto_breaks(local: Array, breaks: Array) -> Array:
    """Return the times (N,), those that rounding put just before a break moved onto it; the start stays."""
    following = breaks[np.minimum(np.searchsorted(breaks, local, "right"), breaks.size - 1)]
    near = max(_BREAK, 4 * float(np.spacing(breaks[-1])))
    return np.where((following - local <= near) & (local > breaks[0]), np.maximum(following, local), local)


def _window(curve: PiecewisePolynomial, local: Array) -> PiecewisePolynomial:
    """Return the pieces that hold the sorted times `local`, so that a block costs what it holds."""
    ends = np.searchsorted(curve.breaks, local[[0, -1]], "right") - 1
    first, last = np.clip(ends, 0, curve.pieces - 1)
    return PiecewisePolynomial(curve.breaks[first : last + 2], curve.coefficients[:, first : last + 1])


class _Starts:
    """Where the spans of a trajectory start, gathered once for all blocks."""

    def __init__(self, trajectory: Trajectory) -> None:
        # a move of no length has no rows
        moving = [span for span in trajectory.spans if span.duration > 0] or list(trajectory.spans[:1])
        self._moving = np.array([span.start for span in moving])
        self._indices = np.array([span.index for span in moving], dtype=np.float64)
        self._all = np.array([span.start for span in trajectory.spans])

    def moves(self, local: Array) -> Array:
        """Return the index of the move at each time, shape (N,)."""
        owner = np.searchsorted(self._moving, local + _BREAK, "right") - 1
        return self._indices[np.maximum(owner, 0)]

    def spans(self, local: Array) -> NDArray[np.intp]:
        """Return which span holds each time, shape (N,)."""
        return np.searchsorted(self._all, local + _BREAK, "right") - 1


def _path_law(trajectory: Trajectory, starts: _Starts, local: Array) -> Array:
    """Return s along the path and two derivatives, shape (N, 3), SI; zero where a move has no path."""
    values = np.zeros((local.size, 3))
    owner = starts.spans(local)
    for index in np.unique(owner):
        law = trajectory.laws[index] if 0 <= index < len(trajectory.laws) else None
        if law is not None:
            rows = np.flatnonzero(owner == index)
            times = np.clip(local[rows] - trajectory.spans[index].start, law.start, law.end)
            values[rows] = law.evaluate_orders(_onto_breaks(times, law.breaks), (0, 1, 2))[:, :, 0]
    return values
