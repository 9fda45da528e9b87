"""Dexterity of a configuration: manipulability, condition number, rank, singular directions.

Metres and radians cannot be compared, so everything but the manipulability is computed from the scaled
Jacobian, whose linear rows are divided by a characteristic length: the total of the arm's lengths, so that a
turn of the outstretched arm counts as much in position as in orientation.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.kinematics.jacobian import jacobian
from trajcli.kinematics.robot import Robot

RANK_TOLERANCE = 1e-9  # of the largest singular value: far above rounding, far below what a joint resolves


@frozen
class Dexterity:
    """Measures of one Jacobian or of a batch of them.

    Attributes:
        manipulability: Shape (*batch,): Yoshikawa's measure of the Jacobian as it is, in m and rad: the
            product of its min(6, n) singular values, which is sqrt(det(J J^T)) for six joints and more and
            sqrt(det(J^T J)) for fewer.
        condition: Shape (*batch,): largest over smallest singular value; infinite where the rank is lost.
        rank: Shape (*batch,): number of singular values above 1e-9 of the largest.
        length: The characteristic length, m.
    """

    manipulability: Array
    condition: Array
    rank: NDArray[np.intp]
    length: float


@frozen
class SingularDirections:
    """What an arm cannot do, or does in vain, in one configuration.

    Attributes:
        blocked: Shape (6 - rank, 6): directions of motion that no joint velocities reach. Unit rows, at right
            angles to each other and, with v / length for v, to every twist (v, w) that can be reached.
        idle: Shape (n - rank, n): joint velocities that leave the tcp at rest. Unit rows, at right angles to
            each other.
        length: The characteristic length, m.
    """

    blocked: Array
    idle: Array
    length: float


def dexterity(robot: Robot, q: ArrayLike) -> Dexterity:
    """Return the measures at joint values q (*batch, n), rad or m.

    Raises:
        InputError: When the robot has no geometry, or q has not n finite values.

    Source: Yoshikawa, Manipulability of robotic mechanisms, Int. J. Robotics Research 4 (1985); for the
    scaling by a characteristic length Angeles, Fundamentals of Robotic Mechanical Systems (2014).
    """
    length = characteristic_length(robot)
    plain = jacobian(robot, q)
    manipulability: Array = np.linalg.svd(plain, compute_uv=False).prod(axis=-1)
    values = np.asarray(np.linalg.svd(_scaled(plain, length), compute_uv=False), dtype=np.float64)
    rank = _rank(values)
    full = rank == values.shape[-1]
    smallest = np.where(full, values[..., -1], 1.0)
    condition: Array = np.where(full, values[..., 0] / smallest, np.inf)
    return Dexterity(manipulability, condition, rank, length)


def singular_directions(robot: Robot, q: ArrayLike) -> SingularDirections:
    """Return what is blocked and idle at one configuration q (n,), in the axes of the world.

    An arm of fewer than six joints always has blocked directions, one of more than six always idle ones.

    Raises:
        InputError: When the robot has no geometry, or q has not n finite values.
    """
    length = characteristic_length(robot)
    left, values, right = np.linalg.svd(_scaled(jacobian(robot, q), length))
    rank = int(_rank(values))
    return SingularDirections(left[:, rank:].T + 0.0, right[rank:] + 0.0, length)


@lru_cache(maxsize=16)
def characteristic_length(robot: Robot) -> float:
    """Return the sum of |a| and |d| of all rows and of the length of the tool, m; 1 where that is zero."""
    lengths = [abs(joint.a) + abs(joint.d) for joint in robot.joints]
    total = math.fsum(lengths) + float(np.linalg.norm(robot.tool[:3, 3]))
    return total if total > 0.0 else 1.0


def changes_of_sign(determinants: Array) -> NDArray[np.intp]:
    """Return the indices from which on determinants (N,) have the other sign than before, shape (k,).

    Zeros have none: the sign before them counts.
    """
    nonzero = np.flatnonzero(determinants)
    signs = np.sign(determinants[nonzero])
    return np.asarray(nonzero[1:][signs[1:] != signs[:-1]])


def _scaled(plain: Array, length: float) -> Array:
    scaled: Array = plain / np.array([length, length, length, 1.0, 1.0, 1.0])[:, None]
    return scaled


def _rank(values: Array) -> NDArray[np.intp]:
    return np.asarray(np.count_nonzero(values > RANK_TOLERANCE * values[..., :1], axis=-1))
