"""Forward kinematics: poses of the links and of the tool.

Angles that are whole quarter turns in the DH table enter with exact zeros and ones.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array
from trajcli.kinematics.robot import Robot
from trajcli.kinematics.serial_chain import MovingFrame, blocks, configurations, links_of, travel


def forward(robot: Robot, q: ArrayLike) -> Array:
    """Return T_world_tcp, shape (*batch, 4, 4), of joint values q (*batch, n), rad or m.

    Raises:
        InputError: When the robot has no geometry, or q has not n finite values.

    Source: Denavit and Hartenberg, A kinematic notation for lower-pair mechanisms, J. Applied Mechanics 22
    (1955); modified rows after Craig (2005), section 3.4.
    """
    links, values = links_of(robot), configurations(robot, q)
    poses = np.empty((values.size // values.shape[-1], 4, 4))
    for rows, (block,) in blocks(values):
        travel(links, robot.base, robot.tool, block)[1].write(poses[rows])
    return poses.reshape(*values.shape[:-1], 4, 4)


def link_poses(robot: Robot, q: ArrayLike) -> Array:
    """Return the poses in world of all frames of the chain, shape (*batch, n + 2, 4, 4).

    The first is the base, then follows the DH frame of each link, the last of which is the flange, and in the
    end the tcp. The frame of link i stands at the end of a standard row (on the axis of joint i + 1), and on
    the axis of joint i in the modified convention.

    Raises:
        InputError: When the robot has no geometry, or q has not n finite values.
    """
    links, values = links_of(robot), configurations(robot, q)
    poses = np.empty((values.size // values.shape[-1], len(links) + 2, 4, 4))
    poses[:, 0] = robot.base
    for rows, (block,) in blocks(values):
        frame = MovingFrame(robot.base)
        for i, (link, value) in enumerate(zip(links, block, strict=True)):
            frame.screw(*link.before)
            frame.move(link, value)
            frame.screw(*link.after)
            frame.write(poses[rows, i + 1])
        frame.attach(robot.tool)
        frame.write(poses[rows, -1])
    return poses.reshape(*values.shape[:-1], len(links) + 2, 4, 4)
