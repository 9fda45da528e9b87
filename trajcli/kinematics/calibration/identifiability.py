"""Identifiability of parameters: the identification Jacobian, its rank, and combinations that it cannot tell.

The Jacobian says how the tool moves with the parameters of its kinematics. A DH row is a product of turns
about and slides along one axis each, Rz(theta) Tz(d) Tx(a) Rx(alpha) Ry(beta): the derivative by one of them
is the velocity of the tool in a motion about or along that axis, where it stands in the product.

The rank is that of the Jacobian at the nominal parameters, its columns scaled to unit length: singular values
below 1e-8 of the largest count as zero.

Source: Khosla and Kanade, Parameter identification of robot dynamics, IEEE CDC (1985), for the categories of
parameters; Meggiolaro and Dubowsky, An analytical method to eliminate the redundant parameters in robot
calibration, IEEE ICRA (2000), for the combinations.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.calibration.parameters import POSE, ArmParameter, units_of
from trajcli.kinematics.columns import ZERO, VectorEntries, cross, minus
from trajcli.kinematics.forward import Link, MovingFrame, configurations, links_of
from trajcli.kinematics.robot import Robot

RANK_TOLERANCE = 1e-8
"""Of the largest singular value; below it a combination of parameters counts as unidentifiable."""

_NO_COLUMN = 1e-10  # of the longest column: what rounding leaves of a parameter that does nothing
_NO_WEIGHT = 1e-6  # of the largest weight of a combination: rounding of a zero
_DEPENDENT = 1e-6  # a pivot below it is rounding: the rows of a basis are unit vectors
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


@comparable
class Share:
    """A parameter's part in a combination.

    Attributes:
        parameter: Which.
        weight: By how much it changes, rad or m.
    """

    parameter: ArmParameter
    weight: float


@frozen
class Identifiability:
    """What measurements tell of p parameters.

    Attributes:
        rank: How many combinations of parameters they determine.
        basis: Shape (p, rank): changes of the parameters, rad and m, that span what is determined; they have
            no part of what is not (orthogonal in the scaled parameters).
        combinations: Changes of the parameters that leave all measured numbers as they are, each a list of
            those that take part. As few as can be take part: each combination is what one parameter, that
            no other combination holds, does alike with parameters before it.
    """

    rank: int
    basis: Array
    combinations: tuple[tuple[Share, ...], ...]


def identifiability(jacobian: Array, parameters: Sequence[ArmParameter], length: float) -> Identifiability:
    """Return what rows of measurements determine.

    Args:
        jacobian: Shape (m, p), the rows weighted, the columns per rad and per m.
        parameters: The p parameters.
        length: Metres that count like a radian.
    """
    units = units_of(parameters, length)
    triangle = np.linalg.qr(jacobian * units, mode="r")
    lengths = np.linalg.norm(triangle, axis=0)
    seen = lengths > _NO_COLUMN * lengths.max(initial=0.0)
    scale = np.where(seen, 1.0 / np.where(seen, lengths, 1.0), 0.0)
    _, found, right = np.linalg.svd(triangle * scale)
    rank = int(np.count_nonzero(found > RANK_TOLERANCE * found[:1]))
    # a parameter without a column stays in its own unit, and is a combination by itself
    changes = units * np.where(seen, scale, 1.0)
    combinations = _combinations(right[rank:] * changes, parameters, length)
    return Identifiability(rank, right[:rank].T * changes[:, None], combinations)


def _combinations(
    kernel: Array, parameters: Sequence[ArmParameter], length: float
) -> tuple[tuple[Share, ...], ...]:
    """Return the combinations (k, p) of a kernel with few parameters each, sorted by their first."""
    units = units_of(parameters, length)
    reduced = _reduced(kernel / units) * units
    combinations = []
    for row in reduced:
        weights = row / np.linalg.norm(row)
        kept = np.flatnonzero(np.abs(row / units) > _NO_WEIGHT * np.abs(row / units).max()).tolist()
        weights = weights * np.sign(weights[kept[0]])
        combinations.append(tuple(Share(parameters[i], float(weights[i])) for i in kept))
    order = [[parameters.index(share.parameter) for share in shares] for shares in combinations]
    return tuple(combinations[i] for i in sorted(range(len(order)), key=order.__getitem__))


def _reduced(kernel: Array) -> Array:
    """Return the rows in reduced echelon form from the right: each has one parameter that no other has."""
    rows = np.array([row / np.linalg.norm(row) for row in kernel]).reshape(kernel.shape)
    done = 0
    for column in reversed(range(kernel.shape[1])):
        if done == len(rows):
            break
        best = done + int(np.abs(rows[done:, column]).argmax())
        if abs(rows[best, column]) <= _DEPENDENT:
            continue
        rows[[done, best]] = rows[[best, done]]
        rows[done] /= rows[done, column]
        others = np.arange(len(rows)) != done
        rows[others] -= rows[others, column, None] * rows[done]
        done += 1
    return rows
