"""Phase plane (s, sd) of a law along a path, and the maximum velocity curve of its constraints.

At a point of the path the rows a u + b x <= c leave room for some u = sdd up to the largest x = sd^2 at
which no upper bound of u falls below a lower one. Eliminating u (Fourier and Motzkin) gives one bound of x
for each pair of a row with a > 0 and a row with a < 0; rows with a = 0 bound x alone.

Source: Pham and Pham (2018), section III (maximum velocity curve); Lynch and Park (2017), section 9.4 (phase
plane).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Literal

import numpy as np

from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side, read_only
from trajcli.curves.time_optimal.constraints import PathConstraint
from trajcli.frozen import frozen

_BLOCK = 256  # points at a time: the pairs of their rows stay small
_NOTHING = 1e-12  # of the largest a at a point: a smaller one does not bound sdd


@frozen
class PhasePlane:
    """A law in the phase plane, and what limits it there.

    Attributes:
        law: s(t) from t = 0, of dimension 1.
        constraints: All that limits sd and sdd along the path.
        breaks: Values of s where a constraint may jump, the ends of the path included, shape (k,).
        stops: Values of s at corners, where the motion must stop, shape (m,).
        dimension: What s measures; "ratio" where it has no unit.
    """

    law: PiecewisePolynomial
    constraints: tuple[PathConstraint, ...]
    breaks: Array
    stops: Array
    dimension: Literal["length", "angle", "ratio"]

    def __post_init__(self) -> None:
        for name in ("breaks", "stops"):
            object.__setattr__(self, name, read_only(getattr(self, name)))

    def scaled(self, factor: float) -> PhasePlane:
        """Return the same plane with the law in `factor` times the time; the constraints stay."""
        return replace(self, law=scale_time(self.law, factor))

    def largest_speed(self, s: Array, side: Side = "right") -> Array:
        """Return the largest sd that the constraints leave room for at points (p,), infinite without a bound.

        Args:
            s: Within the path.
            side: From which side of a break the path is seen.
        """
        largest = np.empty(s.size)
        for low in range(0, s.size, _BLOCK):
            rows = [constraint.rows(s[low : low + _BLOCK], side) for constraint in self.constraints]
            a, b, c = (np.concatenate([getattr(row, name) for row in rows], axis=1) for name in "abc")
            cap = np.minimum.reduce([row.cap for row in rows])
            largest[low : low + _BLOCK] = np.minimum(cap, _largest_square(a, b, c))
        root: Array = np.sqrt(largest)
        return root


def _largest_square(a: Array, b: Array, c: Array) -> Array:
    """Return the largest x for which some u obeys all rows a u + b x <= c, each (p, k), shape (p,)."""
    scale = _NOTHING * np.abs(a).max(axis=1, initial=0.0)[:, None]
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        alone = np.where((np.abs(a) <= scale) & (b > 0), c / b, np.inf).min(axis=1, initial=np.inf)
        upper, lower = (
            np.where(a > scale, a, np.nan)[:, :, None],
            np.where(a < -scale, -a, np.nan)[:, None, :],
        )
        slope = b[:, :, None] * lower + b[:, None, :] * upper
        bound = (c[:, :, None] * lower + c[:, None, :] * upper) / slope
    pairs = np.where(slope > 0, bound, np.inf).reshape(len(a), -1).min(axis=1, initial=np.inf)
    return np.asarray(np.minimum(alone, pairs))
