"""What is known of an arm at places of a path where its joints meet the demand."""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.kinematics.following.demand import Demand
from trajcli.kinematics.inverse.target import Target


@frozen
class Solved:
    """Joints at N places, and what was computed to find them: judging a fit there asks for it again.

    Attributes:
        values: Joint values and their first and second derivative, shape (3, N, n).
        demand: Of the tool there.
        target: Of that demand.
        columns: Jacobians in world, shape (N, 6, n).
    """

    values: Array
    demand: Demand
    target: Target
    columns: Array


def acceleration_bias(columns: Array, rates: Array) -> Array:
    """Return the part of the tcp's acceleration that does not come from qdd, shape (N, 6).

    A joint turns the columns of those behind it, and moves the tcp under the axes of those before it: either
    way the change of the linear column is the angular column of the joint nearer to the base times the linear
    column of the other.

    Args:
        columns: Jacobians in world, shape (N, 6, n).
        rates: Joint velocities, shape (N, n).

    Source: Haviland and Corke, A systematic approach to computing the manipulator Jacobian and Hessian using
    the elementary transform sequence (2020), section 4.
    """
    moved = columns * rates[:, None, :]
    linear, angular = moved[:, :3], moved[:, 3:]
    spin = np.cumsum(angular, axis=2)
    before = np.zeros_like(spin)
    before[:, :, 1:] = spin[:, :, :-1]
    bias = np.cross(spin + before, linear, axis=1), np.cross(before, angular, axis=1)
    return np.asarray(np.concatenate(bias, axis=1).sum(axis=2))
