"""Geometric Jacobian and its time derivative, twist and acceleration of the tool.

Linear rows come first and belong to the tcp as the point of reference; angular rows follow.
"""

from __future__ import annotations

from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.kinematics.columns import (
    ZERO,
    VectorEntries,
    cross,
    dot,
    minus,
)
from trajcli.kinematics.robot import Robot
from trajcli.kinematics.serial_chain import (
    JointAxis,
    MovingFrame,
    blocks,
    configurations,
    links_of,
    travel,
)

ReferenceFrame = Literal["world", "base", "tcp"]


def jacobian(robot: Robot, q: ArrayLike, frame: ReferenceFrame = "world") -> Array:
    """Return J with (v, w) = J qd of the tcp, shape (*batch, 6, n), m and rad by the joint's unit.

    Args:
        robot: The arm.
        q: Joint values (*batch, n), rad or m.
        frame: In whose axes the rows are written. The velocity is against the world in all three.

    Raises:
        InputError: When the robot has no geometry, or q has not n finite values.

    Source: Siciliano et al. (2009), section 3.1.3.
    """
    links, values = links_of(robot), configurations(robot, q)
    result = np.zeros((values.size // values.shape[-1], 6, len(links)))
    for rows, (block,) in blocks(values):
        axes, tcp = travel(links, _start(robot, frame), robot.tool, block)
        for i, axis in enumerate(axes):
            linear, angular = _columns(axis, tcp.p)
            _write(result[rows, :3, i], _in_frame(linear, tcp, frame))
            _write(result[rows, 3:, i], _in_frame(angular, tcp, frame))
    return result.reshape(*values.shape[:-1], 6, len(links))


def linearisation(robot: Robot, q: ArrayLike) -> tuple[Array, Array]:
    """Return T_world_tcp (*batch, 4, 4) and J in world (*batch, 6, n) in one pass along the chain.

    Raises:
        InputError: When the robot has no geometry, or q has not n finite values.
    """
    links, values = links_of(robot), configurations(robot, q)
    count = values.size // values.shape[-1]
    poses, slopes = np.empty((count, 4, 4)), np.empty((count, 6, len(links)))
    for rows, (block,) in blocks(values):
        axes, tcp = travel(links, robot.base, robot.tool, block)
        tcp.write(poses[rows])
        for i, axis in enumerate(axes):
            linear, angular = _columns(axis, tcp.p)
            _write(slopes[rows, :3, i], linear)
            _write(slopes[rows, 3:, i], angular)
    batch = values.shape[:-1]
    return poses.reshape(*batch, 4, 4), slopes.reshape(*batch, 6, len(links))


def jacobian_dot_qd(robot: Robot, q: ArrayLike, qd: ArrayLike, frame: ReferenceFrame = "world") -> Array:
    """Return the part of the tcp's acceleration that does not come from qdd, shape (*batch, 6).

    (a, e) = J qdd + this. In the world and base frames it is the time derivative of J times qd; for the tcp
    the same acceleration is written in the axes of the tcp.

    Raises:
        InputError: When the robot has no geometry, or q and qd have not n finite values of the same batch.
    """
    values, rates = _state(robot, q, qd)
    return acceleration_bias(jacobian(robot, values, frame), rates)


def acceleration_bias(jacobians: Array, rates: Array) -> Array:
    """Return the part of the tcp's acceleration that does not come from qdd, shape (*batch, 6).

    A joint turns the columns of those behind it, and moves the tcp under the axes of those before it: either
    way the change of the linear column is the angular column of the joint nearer to the base times the linear
    column of the other.

    Args:
        jacobians: Shape (*batch, 6, n), in any axes: those of the result.
        rates: Joint velocities, shape (*batch, n).

    Source: Haviland and Corke, A systematic approach to computing the manipulator Jacobian and Hessian using
    the elementary transform sequence (2020), section 4.
    """
    moved = jacobians * rates[..., None, :]
    linear, angular = moved[..., :3, :], moved[..., 3:, :]
    spin = np.cumsum(angular, axis=-1)
    before = np.zeros_like(spin)
    before[..., 1:] = spin[..., :-1]
    bias = _across(spin + before, linear), _across(before, angular)
    return np.asarray(np.concatenate(bias, axis=-2).sum(axis=-1))


def _across(a: Array, b: Array) -> Array:
    """Return the vector products of columns (*batch, 3, n)."""
    y, z = [1, 2, 0], [2, 0, 1]
    return np.asarray(a[..., y, :] * b[..., z, :] - a[..., z, :] * b[..., y, :])


def tcp_twist(robot: Robot, q: ArrayLike, qd: ArrayLike, frame: ReferenceFrame = "world") -> Array:
    """Return the tcp's velocity (v, w), shape (*batch, 6), m/s and rad/s, in the axes of `frame`.

    Raises:
        InputError: When the robot has no geometry, or q and qd have not n finite values of the same batch.
    """
    values, rates = _state(robot, q, qd)
    return np.asarray((jacobian(robot, values, frame) @ rates[..., None])[..., 0])


def tcp_acceleration(
    robot: Robot, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, frame: ReferenceFrame = "world"
) -> Array:
    """Return the tcp's acceleration (a, e), shape (*batch, 6), m/s^2 and rad/s^2, in the axes of `frame`.

    Raises:
        InputError: When the robot has no geometry, or q, qd and qdd have not n finite values of one batch.
    """
    values, second = _state(robot, q, qdd)
    return np.asarray(tcp_twist(robot, values, second, frame) + jacobian_dot_qd(robot, values, qd, frame))


def _state(robot: Robot, q: ArrayLike, rates: ArrayLike) -> tuple[Array, Array]:
    values, given = configurations(robot, q), configurations(robot, rates, "the vector of joint rates")
    if values.shape != given.shape:
        raise InputError(f"the joint rates have shape {given.shape}, q has shape {values.shape}")
    return values, given


def _start(robot: Robot, frame: ReferenceFrame) -> Array:
    return robot.standing_at(np.eye(4)).base if frame == "base" else robot.base


def _columns(axis: JointAxis, p: VectorEntries) -> tuple[VectorEntries, VectorEntries]:
    """Return the linear and the angular velocity of the point p for unit speed of one joint."""
    if axis.prismatic:
        return axis.direction, ZERO
    return cross(axis.direction, minus(p, axis.point)), axis.direction


def _in_frame(vector: VectorEntries, tcp: MovingFrame, frame: ReferenceFrame) -> VectorEntries:
    return (dot(tcp.x, vector), dot(tcp.y, vector), dot(tcp.z, vector)) if frame == "tcp" else vector


def _write(out: Array, vector: VectorEntries) -> None:
    for i, entry in enumerate(vector):
        out[:, i] = entry
