"""On which side of the singular configurations an arm is: a branch ends where it would change."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.geometry.rotation import AXES
from trajcli.kinematics.following.demand import Demand

_FLAT = 1e-12  # a determinant of scaled rows, which are of the size 1, that is none
_OUTSIDE = 1e-9  # of a scaled row: what a basis of dependent rows may leave out


@frozen
class Hand:
    """The sign of the determinant of the rows that joint rates must meet.

    Attributes:
        sign: 1 or -1; 0 where it cannot be told, as in a singular configuration.
        basis: Of the rows where they depend on each other, as those of a planar arm do, shape (n, m).
    """

    sign: float
    basis: Array

    def changed(self, demand: Demand, poses: Array, rows: Array) -> NDArray[np.bool_]:
        """Return where it is the other one, (N,), at tcp poses (N, 4, 4) with scaled rows (N, m, n)."""
        if self.sign == 0:
            return np.zeros(len(rows), dtype=bool)
        return np.asarray(self.sign * _signs(_completed(demand, poses, rows), self.basis) < 0)


NO_HAND = Hand(0.0, np.empty((0, 0)))


def hand_of(demand: Demand, poses: Array, rows: Array) -> Hand:
    """Return the hand of one configuration, a batch of one.

    Args:
        demand: Of the tool there.
        poses: Of the tcp, shape (1, 4, 4).
        rows: Scaled, shape (1, m, n).
    """
    completed = _completed(demand, poses, rows)
    basis = np.linalg.svd(completed[0])[0][:, : completed.shape[2]].T
    return Hand(float(_signs(completed, basis)[0]), basis)


def _signs(rows: Array, basis: Array) -> Array:
    if rows.shape[1] > rows.shape[2]:
        square = basis @ rows
        if np.abs(rows - basis.T @ square).max() > _OUTSIDE:
            return np.zeros(len(rows))  # the rows span another space here: their bases do not compare
        rows = square
    values = np.linalg.det(rows)
    return np.asarray(np.where(np.abs(values) > _FLAT, np.sign(values), 0.0))


def _completed(demand: Demand, poses: Array, rows: Array) -> Array:
    """Return the rows; the three of a direction are two, a column of the axis makes up for the third."""
    if demand.orientation != "direction":
        return rows
    column = np.zeros((*rows.shape[:2], 1))
    split = sum(demand.position)
    column[:, split : split + 3, 0] = poses[:, :3, AXES.index(demand.tool_axis)]
    return np.concatenate([rows, column], axis=2)
