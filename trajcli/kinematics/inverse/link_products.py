"""Forward kinematics and Jacobian of few configurations, by products of the links' matrices.

For many configurations each entry by itself is faster, because most of them are zeros and ones; for few the
number of operations counts, and not their length.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.dh_rows import row_pose
from trajcli.kinematics.robot import Robot
from trajcli.kinematics.serial_chain import links_of

FEW = 96  # configurations up to which products of matrices are faster


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

    Args:
        robot: One with a geometry.
        q: Shape (K, n).

    Raises:
        InputError: When the robot has none.
    """
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
