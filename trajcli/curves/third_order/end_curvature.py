"""Curvature of a path at its ends: the first and the last piece are replaced by three cubics each.

Over thirds of a piece q''' is constant; the three values follow from q, q' and q'' at both ends.
"""

from __future__ import annotations

import numpy as np

from trajcli.curves.operations import reverse
from trajcli.curves.piecewise import Array, PiecewisePolynomial

_EFFECT = np.array([[19.0 / 6.0, 7.0 / 6.0, 1.0 / 6.0], [2.5, 1.5, 0.5], [1.0, 1.0, 1.0]])
"""Of q''' in each third on q, q' and q'' at the end, in powers of the length of a third."""


def with_end_curvature(
    path: PiecewisePolynomial, start: Array | None, end: Array | None
) -> PiecewisePolynomial:
    """Return the path with the given q'' (n,) at its start and at its end; None leaves it as it is.

    Args:
        path: q(s) of degree at most 3.
        start: Second derivative at the start.
        end: Second derivative at the end.
    """
    if start is not None:
        path = _with_start_curvature(path, start)
    if end is not None:
        path = reverse(_with_start_curvature(reverse(path), end))
    return path


def _with_start_curvature(path: PiecewisePolynomial, curvature: Array) -> PiecewisePolynomial:
    length = float(path.lengths[0])
    third = length / 3.0
    q, slope = path.evaluate(path.start), path.evaluate(path.start, 1)
    wanted = [path.evaluate(path.breaks[1], order, side="left") for order in range(3)]
    free = [
        wanted[0] - q - slope * length - 0.5 * curvature * length**2,
        wanted[1] - slope - curvature * length,
        wanted[2] - curvature,
    ]
    scaled = np.stack([each / third**power for each, power in zip(free, (3, 2, 1), strict=True)])
    pieces = []
    for jerk in np.linalg.solve(_EFFECT, scaled):
        pieces.append(np.stack([jerk / 6.0, 0.5 * curvature, slope, q]))
        q = q + slope * third + 0.5 * curvature * third**2 + jerk * third**3 / 6.0
        slope = slope + curvature * third + 0.5 * jerk * third**2
        curvature = curvature + jerk * third
    breaks = path.start + third * np.arange(3)
    rest = path.coefficients[:, 1:]
    rest = np.concatenate([np.zeros((4 - len(rest), *rest.shape[1:])), rest])
    return PiecewisePolynomial(
        np.concatenate([breaks, path.breaks[1:]]), np.concatenate([np.stack(pieces, axis=1), rest], axis=1)
    )
