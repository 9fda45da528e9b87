"""Identifiability of parameters: rank of the identification Jacobian, and combinations that it cannot tell.

The rank is that of the Jacobian at the nominal parameters, its columns scaled to unit length: singular values
below 1e-8 of the largest count as zero.

Source: Khosla and Kanade, Parameter identification of robot dynamics, IEEE CDC (1985), for the categories of
parameters; Meggiolaro and Dubowsky, An analytical method to eliminate the redundant parameters in robot
calibration, IEEE ICRA (2000), for the combinations.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import comparable, frozen
from trajcli.kinematics.calibration.parameters import ArmParameter, units_of

RANK_TOLERANCE = 1e-8
"""Of the largest singular value; below it a combination of parameters counts as unidentifiable."""

_NO_COLUMN = 1e-10  # of the longest column: what rounding leaves of a parameter that does nothing
_NO_WEIGHT = 1e-6  # of the largest weight of a combination: rounding of a zero
_DEPENDENT = 1e-6  # a pivot below it is rounding: the rows of a basis are unit vectors


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
