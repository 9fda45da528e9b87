"""Identification Jacobian: how the tool moves with the parameters of its kinematics, each of them a screw.

A DH row is a product of turns about and slides along one axis each, Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta):
the derivative by one of them is the velocity of the tool in a motion about or along that axis, where it
stands in the product.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array
from trajcli.kinematics.calibration.parameters import POSE, ArmParameter
from trajcli.kinematics.columns import ZERO, VectorEntries, cross, minus
from trajcli.kinematics.robot import Robot
from trajcli.kinematics.serial_chain import Link, MovingFrame, configurations, links_of

Axes = dict[str, tuple[VectorEntries, VectorEntries]]
"""Direction of the axis of each parameter of an owner, and a point on it."""

_WORLD: tuple[VectorEntries, ...] = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


def identification_jacobian(
    robot: Robot, q: ArrayLike, parameters: Sequence[ArmParameter]
) -> tuple[Array, Array]:
    """Return the poses T_world_tcp (N, 4, 4), and how they change with the parameters, (N, 6, p), in world.

    The linear rows are of the tcp, m per rad or m; the angular ones rad per rad or m.

    Args:
        robot: The arm.
        q: Joint values (N, n), rad or m.
        parameters: The p parameters.

    Raises:
        InputError: When the robot has no geometry, or q has not n finite values.

    Source: Mooring, Roth and Driels, Fundamentals of Manipulator Calibration (1991), chapter 3; screws of the
    factors of a row as in Okamura and Park, Kinematic calibration using the product of exponentials formula,
    Robotica 14 (1996).
    """
    values = configurations(robot, q)
    axes, tcp = _axes_of(robot, values)
    poses = np.empty((len(values), 4, 4))
    tcp.write(poses)
    slopes = np.zeros((len(values), 6, len(parameters)))
    for column, parameter in enumerate(parameters):
        direction, point = axes[parameter.joint if parameter.joint is not None else parameter.owner][
            parameter.name
        ]
        linear, angular = (
            (cross(direction, minus(tcp.p, point)), direction) if parameter.angular else (direction, ZERO)
        )
        for row, entry in enumerate((*linear, *angular)):
            slopes[:, row, column] = entry
    return poses, slopes


def _axes_of(robot: Robot, values: Array) -> tuple[dict[int | str, Axes], MovingFrame]:
    """Return the axes of all parameters by owner, a joint's index or its name, and the frame of the tcp."""
    frame, standard = MovingFrame(robot.base), robot.convention == "standard"
    axes: dict[int | str, Axes] = {"base": _pose_axes(_WORLD, frame.p)}
    for index, (link, value) in enumerate(zip(links_of(robot), values.T, strict=True)):
        axes[index] = dict(_row_axes(frame, link, np.ascontiguousarray(value), standard))
    flange = frame.x, frame.y, frame.z
    frame.attach(robot.tool)
    axes["tool"] = _pose_axes(flange, frame.p)
    return axes, frame


def _row_axes(
    frame: MovingFrame, link: Link, value: Array, standard: bool
) -> Iterator[tuple[str, tuple[VectorEntries, VectorEntries]]]:
    """Move a frame along a row, and yield the axis of each of its parameters."""
    if not standard:
        yield from _screw_axes(frame, link.before)
    axis = frame.z, frame.p
    yield from (("theta", axis), ("d", axis))
    frame.move(link, value)
    if standard:
        yield from _screw_axes(frame, link.after)


def _screw_axes(
    frame: MovingFrame, screw: tuple[float, ...]
) -> Iterator[tuple[str, tuple[VectorEntries, VectorEntries]]]:
    """Move a frame by the part of a row that is fixed, and yield the axes of a, alpha and beta."""
    axis = frame.x, frame.p
    yield from (("a", axis), ("alpha", axis))
    frame.screw(*screw[:3])
    yield "beta", (frame.y, frame.p)
    if screw[3:]:
        frame.screw(0.0, 1.0, 0.0, *screw[3:])


def _pose_axes(directions: Sequence[VectorEntries], point: VectorEntries) -> Axes:
    """Return the axes of a base or a tool, whose turns leave its own origin where it is."""
    return dict(zip(POSE, [(direction, point) for direction in (*directions, *directions)], strict=True))
