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
from trajcli.kinematics.robot import Robot
from trajcli.kinematics.serial_chain import links_of

FEW = 32  # configurations of a redundant arm up to which products of matrices are faster


class _Constants(NamedTuple):
    """What does not depend on the joints of an arm.

    Attributes:
        first: From world to the axis of the first joint, (4, 4).
        after: From each joint to the axis of the next, from the last to the tcp, (n, 1, 4, 4).
        sign: Of each joint, (n, 1).
        angle: At zero, (n, 1).
        distance: At zero, (n, 1).
        sliding: Which joints slide, (n, 1).
    """

    first: Array
    after: Array
    sign: Array
    angle: Array
    distance: Array
    sliding: Flags


@lru_cache(maxsize=16)
def _constants(robot: Robot) -> _Constants:
    links = links_of(robot)
    screws = [[_screw(*link.before) for link in links], [_screw(*link.after) for link in links]]
    following = [*screws[0][1:], robot.tool]
    after = np.array([own @ next_one for own, next_one in zip(screws[1], following, strict=True)])
    rows = np.array([[link.sign, link.theta, link.d] for link in links])[..., None]
    sliding = np.array([link.prismatic for link in links])[:, None]
    return _Constants(robot.base @ screws[0][0], after[:, None], rows[:, 0], rows[:, 1], rows[:, 2], sliding)


def _screw(a: float, cosine: float, sine: float) -> Array:
    """Return the slide along x by a with the turn about it."""
    return np.array(
        [[1.0, 0.0, 0.0, a], [0.0, cosine, -sine, 0.0], [0.0, sine, cosine, 0.0], [0.0, 0.0, 0.0, 1.0]]
    )


def poses_and_jacobians(robot: Robot, q: Array) -> tuple[Array, Array]:
    """Return poses of the tcp (K, 4, 4) and Jacobians (K, 6, n) in world, linear rows first.

    Args:
        robot: One with a geometry.
        q: Shape (K, n).

    Raises:
        InputError: When the robot has none.
    """
    known, values = _constants(robot), q.T
    change = known.sign * values
    angles = np.where(known.sliding, known.angle, known.angle + change)
    local = np.zeros((*values.shape, 4, 4))
    cosine, sine = np.cos(angles), np.sin(angles)
    local[..., 0, 0] = local[..., 1, 1] = cosine
    local[..., 1, 0], local[..., 0, 1] = sine, -sine
    local[..., 2, 3] = np.where(known.sliding, known.distance + change, known.distance)
    local[..., 2, 2] = local[..., 3, 3] = 1.0
    local = local @ known.after
    frames = np.empty((len(values) + 1, len(q), 4, 4))
    frames[0] = known.first
    for i in range(len(values)):
        np.matmul(frames[i], local[i], out=frames[i + 1])
    axes = frames[:-1, :, :3, 2] * known.sign[..., None]
    arms = frames[-1, :, :3, 3] - frames[:-1, :, :3, 3]
    jacobians = np.empty((len(q), 6, len(values)))
    linear = np.moveaxis(jacobians, 2, 0)
    for i in range(3):
        j, k = (i + 1) % 3, (i + 2) % 3
        linear[..., i] = axes[..., j] * arms[..., k] - axes[..., k] * arms[..., j]
    linear[..., 3:] = axes
    if known.sliding.any():
        sliding = known.sliding[:, 0]
        linear[sliding, :, :3], linear[sliding, :, 3:] = axes[sliding], 0.0
    return frames[-1], jacobians
