"""Geometric Jacobian and its time derivative, twist and acceleration of the tool.

Linear rows come first and belong to the tcp as the point of reference; angular rows follow.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.columns import (
    ZERO,
    VectorEntries,
    cross,
    dot,
    minus,
)
from trajcli.kinematics.dh_rows import row_pose
from trajcli.kinematics.forward import (
    JointAxis,
    MovingFrame,
    blocks,
    configurations,
    links_of,
    travel,
)
from trajcli.kinematics.robot import Robot

ReferenceFrame = Literal["world", "base", "tcp"]
FEW = 96  # configurations up to which products of matrices are faster


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


class _Constants(NamedTuple):
    """What does not depend on the joints of an arm.

    The product of a joint's own matrix with that to the next axis, or to the tcp, is
    `cos(angle) * along + sin(angle) * across + slide * slid + fixed`, each of shape (n, 1, 4, 4).

    Attributes:
        first: From world to the axis of the first joint, (4, 4).
        along: Times the cosine.
        across: Times the sine.
        slid: Times the slide of a joint.
        fixed: What no joint changes.
        sign: Of each joint, (n,).
        angle: At zero, (n, 1).
        turning: Sign of joints that turn, zero for the others, (n, 1).
        sliding: Which joints slide, (n,).
        slides: Whether any does.
    """

    first: Array
    along: Array
    across: Array
    slid: Array
    fixed: Array
    sign: Array
    angle: Array
    turning: Array
    sliding: Flags
    slides: bool


@lru_cache(maxsize=16)
def _constants(robot: Robot) -> _Constants:
    links = links_of(robot)
    own = np.array([row_pose((0.0, 0.0, joint.a, joint.alpha, joint.beta)) for joint in robot.joints])
    none = np.broadcast_to(np.eye(4), own.shape)
    before, behind = (none, own) if robot.convention == "standard" else (own, none)
    after = behind @ [*before[1:], robot.tool]
    sign, angle, distance = np.array([[link.sign, link.theta, link.d] for link in links]).T
    sliding = np.array([link.prismatic for link in links])
    quarter, lift = np.zeros((4, 4)), np.zeros((4, 4))
    quarter[1, 0], quarter[0, 1], lift[2, 3] = 1.0, -1.0, 1.0
    still = np.diag([0.0, 0.0, 1.0, 1.0]) + distance[:, None, None] * lift
    parts = (np.diag([1.0, 1.0, 0.0, 0.0]), quarter, sign[:, None, None] * lift, still)
    along, across, slid, fixed = ((part @ after)[:, None] for part in parts)
    turning = np.where(sliding, 0.0, sign)[:, None]
    base = robot.base @ before[0]
    slides = bool(sliding.any())
    return _Constants(base, along, across, slid, fixed, sign, angle[:, None], turning, sliding, slides)


def poses_and_jacobians(robot: Robot, q: Array) -> tuple[Array, Array]:
    """Return poses of the tcp (K, 4, 4) and Jacobians (K, 6, n) in world, linear rows first.

    For many configurations each entry by itself is faster, because most of them are zeros and ones; for few
    the number of operations counts, and not their length: there they are products of the links' matrices.

    Args:
        robot: One with a geometry.
        q: Shape (K, n).

    Raises:
        InputError: When the robot has none.
    """
    if len(q) > FEW:
        return linearisation(robot, q)
    constants, values = _constants(robot), q.T
    angles = (constants.angle + constants.turning * values)[..., None, None]
    local = np.cos(angles) * constants.along
    local += np.sin(angles) * constants.across
    local += constants.fixed
    if constants.slides:
        slides = np.where(constants.sliding[:, None], values, 0.0)
        local += slides[..., None, None] * constants.slid
    frames = np.empty((len(values) + 1, len(q), 4, 4))
    frames[0] = constants.first
    for before, link, behind in zip(frames, local, frames[1:], strict=False):
        np.matmul(before, link, out=behind)
    up, origin = frames[..., :3, 2:].T  # each (3, K, n + 1)
    jacobians = np.empty((len(q), 6, len(values)))
    by_row = jacobians.swapaxes(0, 1)
    (x, y, z), (a, b, c) = up[..., :-1] * constants.sign, origin[..., -1:] - origin[..., :-1]
    for out, entry in zip(by_row, (y * c - z * b, z * a - x * c, x * b - y * a, x, y, z), strict=True):
        out[...] = entry
    if constants.slides:
        jacobians[:, :3] = np.where(constants.sliding, jacobians[:, 3:], jacobians[:, :3])
        jacobians[:, 3:] = np.where(constants.sliding, 0.0, jacobians[:, 3:])
    return frames[-1], jacobians


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


def tcp_acceleration(robot: Robot, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> Array:
    """Return the tcp's acceleration (a, e) in world, shape (*batch, 6), m/s^2 and rad/s^2.

    Raises:
        InputError: When the robot has no geometry, or q, qd and qdd have not n finite values of one batch.
    """
    values, second = _state(robot, q, qdd)
    return np.asarray(tcp_twist(robot, values, second) + jacobian_dot_qd(robot, values, qd))


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
