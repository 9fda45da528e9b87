"""Sampling of a trajectory on a grid of times.

Rows are evaluated in blocks of bounded size, so that memory does not grow with their number.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from trajcli.columns import (
    EFFORT,
    JOINT_ORDERS,
    SIGNALS,
    TOOL_COLUMNS,
    Group,
    check_groups,
    group_factors,
    joint_factors,
)
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import InputError
from trajcli.grids import AT_BREAK, NANOSECOND, ROWS, Grid, KnotGrid, leave_short_pieces, onto_breaks
from trajcli.kinematics.robot import Robot
from trajcli.trajectory import Trajectory
from trajcli.units import Units

_TOOL_ORDERS = {"pose": 0, "twist": 1, "twistd": 2}  # the highest derivative of q that each group needs


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
        robot: Whose tool it is, base and tool included; needed for the groups of `TOOL_COLUMNS` and for
            efforts only. What it carries is what the spans say.
        size: Most rows of a block.

    Raises:
        InputError: When `groups` is empty, or holds an unknown group or one twice, or one about the tool of
            no robot or of one without geometry, or efforts of one without inertias.
    """
    units = units or Units()
    check_groups(groups)
    factors = joint_factors(trajectory.joint_types, units)
    curve, starts = trajectory.curve, _Starts(trajectory)
    orders, last, first = _orders(groups), None, 0
    for times, local in grid.blocks(size):
        local = onto_breaks(local, curve.breaks)
        window = _window(curve, local, factors)
        motion = window.evaluate_orders(local, orders)
        leave_short_pieces(window, local, orders, motion)
        if isinstance(grid, KnotGrid):
            motion = motion * factors
            grid.put_states(first, orders, motion)
            motion = motion / factors
        first += len(local)
        parts = []
        for group in groups:
            if group in JOINT_ORDERS:
                parts.append(motion[:, orders.index(JOINT_ORDERS[group])])
            elif group == EFFORT:
                parts.append(_efforts(trajectory, robot, starts.spans(local), motion * factors))
            elif group in TOOL_COLUMNS:
                part = _of_tool(group, trajectory, local, robot, motion * factors, last)
                last = part[-1, 3:] if group == "pose" else last
                parts.append(part / group_factors(group, units))
            elif group == "path":
                parts.append(_path_law(trajectory, starts, local) / group_factors(group, units))
            elif group == SIGNALS:
                parts += [signal.values(local)[:, None] for signal in trajectory.signals]
            elif group == "zone":
                parts.append(_zones(trajectory, local)[:, None])
            else:
                parts.append((times if group == "t" else starts.moves(local))[:, None])
        yield np.concatenate(parts, axis=1)


def _orders(groups: Sequence[Group]) -> list[int]:
    """Return the orders of derivatives that `groups` need, rising; at least one."""
    orders = {JOINT_ORDERS[group] for group in groups if group in JOINT_ORDERS}
    for group in groups:
        orders |= set(range((2 if group == EFFORT else _TOOL_ORDERS.get(group, -1)) + 1))
    return sorted(orders) or [0]


def _of_tool(
    group: Group, trajectory: Trajectory, local: Array, robot: Robot | None, motion: Array, last: Array | None
) -> Array:
    """Return a group of `TOOL_COLUMNS`, (N, columns), of a motion (N, orders, n); `last` is a quaternion."""
    # a plan without these columns does not pay for the imports
    from trajcli.geometry.rotation import quaternion_from_matrix, without_jumps
    from trajcli.kinematics.forward import forward
    from trajcli.kinematics.jacobian import tcp_acceleration, tcp_twist

    if robot is None:
        raise InputError(
            f"the columns '{group}' are about a tool, and there is no robot", hint="give the robot"
        )
    if group == "twist":
        return trajectory.of_tools(robot, local, lambda arm, k: tcp_twist(arm, motion[k, 0], motion[k, 1]))
    if group == "twistd":
        return trajectory.of_tools(
            robot, local, lambda arm, k: tcp_acceleration(arm, motion[k, 0], motion[k, 1], motion[k, 2])
        )
    poses = trajectory.of_tools(robot, local, lambda arm, k: forward(arm, motion[k, 0]))
    quaternions = without_jumps(quaternion_from_matrix(poses[:, :3, :3]), last)
    return np.concatenate([poses[:, :3, 3], quaternions], axis=1)


def _efforts(trajectory: Trajectory, robot: Robot | None, owner: NDArray[np.intp], motion: Array) -> Array:
    """Return the efforts of the joints with their loads, (N, n), of q, qd and qdd (N, 3 or more, n), SI."""
    from trajcli.dynamics.newton_euler import InverseDynamics

    if robot is None:
        raise InputError(
            f"the columns '{EFFORT}' are about a robot, and there is none", hint="give the robot"
        )
    efforts = np.empty((motion.shape[0], motion.shape[2]))
    for index in np.unique(owner).tolist():
        rows = owner == index
        dynamics = InverseDynamics(trajectory.spans[index].arm(robot))
        efforts[rows] = dynamics.effort(*(motion[rows, order] for order in range(3)))
    return efforts


def _window(curve: PiecewisePolynomial, local: Array, factors: Array) -> PiecewisePolynomial:
    """Return the pieces that hold the sorted times `local`, and those beside: a block costs what it holds."""
    ends = np.searchsorted(curve.breaks, (local[0] - NANOSECOND, local[-1] + NANOSECOND), "right")
    first, last = np.clip((ends[0] - 2, ends[1]), 0, curve.pieces - 1)
    return PiecewisePolynomial(
        curve.breaks[first : last + 2], curve.coefficients[:, first : last + 1] / factors
    )


class _Starts:
    """Where the spans of a trajectory start, gathered once for all blocks."""

    def __init__(self, trajectory: Trajectory) -> None:
        # a move of no length has no rows, the last one neither
        moving = [k for k, span in enumerate(trajectory.spans) if span.duration > 0] or [0]
        self._moving = np.array(moving)
        self._starts = np.array([trajectory.spans[k].start for k in moving])
        self._indices = np.array([span.index for span in trajectory.spans], dtype=np.float64)

    def moves(self, local: Array) -> Array:
        """Return the index of the move at each time, shape (N,)."""
        return self._indices[self.spans(local)]

    def spans(self, local: Array) -> NDArray[np.intp]:
        """Return which span holds each time, shape (N,)."""
        owner = np.searchsorted(self._starts, local + AT_BREAK, "right") - 1
        return self._moving[np.maximum(owner, 0)]


def _zones(trajectory: Trajectory, local: Array) -> Array:
    """Return the number of the zone about a corner at each time, from 1, shape (N,); 0 on a path."""
    if not trajectory.zones:
        return np.zeros(local.size)
    entered, left = np.array(trajectory.zones).T
    last = np.searchsorted(entered, local + AT_BREAK, "right")
    inside = (last > 0) & (local + AT_BREAK < left[np.maximum(last - 1, 0)])
    return np.where(inside, last, 0).astype(np.float64)


def _path_law(trajectory: Trajectory, starts: _Starts, local: Array) -> Array:
    """Return s along the path and two derivatives, shape (N, 3), SI; zero where a move has no path."""
    values = np.zeros((local.size, 3))
    owner = starts.spans(local)
    for index in np.unique(owner):
        law = trajectory.laws[index] if index < len(trajectory.laws) else None
        if law is not None:
            rows = np.flatnonzero(owner == index)
            times = np.clip(local[rows] - trajectory.spans[index].start, law.start, law.end)
            times = onto_breaks(times, law.breaks)
            of_law = law.evaluate_orders(times, (0, 1, 2))
            leave_short_pieces(law, times, (0, 1, 2), of_law)
            values[rows] = of_law[:, :, 0]
    return values
