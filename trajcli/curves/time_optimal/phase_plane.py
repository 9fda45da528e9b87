"""Phase plane (s, sd) of a law along a path: its maximum velocity curve, and which limit binds when.

At a point of the path the rows a u + b x <= c leave room for some u = sdd up to the largest x = sd^2 at
which no upper bound of u falls below a lower one. Eliminating u (Fourier and Motzkin) gives one bound of x
for each pair of a row with a > 0 and a row with a < 0; rows with a = 0 bound x alone.

Source: Pham and Pham (2018), section III (maximum velocity curve); Lynch and Park (2017), section 9.4 (phase
plane).
"""

from __future__ import annotations

from dataclasses import replace
from itertools import groupby
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side, read_only
from trajcli.curves.time_optimal.constraints import PathConstraint
from trajcli.frozen import comparable, frozen

_BLOCK = 256  # points at a time: the pairs of their rows stay small
_NOTHING = 1e-12  # of the largest a at a point: a smaller one does not bound sdd
_BINDS = 0.95  # of a limit, on average over a piece: its ends reach the limit only as far as the grid is fine
_STAYS = 0.01  # by which another limit must be nearer before it takes over


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


@comparable
class Binding:
    """An interval of time in which one limit binds.

    Attributes:
        start: s.
        end: s.
        joint: Index from 0.
        quantity: Of the limit.
        sign: 1 for the upper limit, -1 for the lower one.
    """

    start: float
    end: float
    joint: int
    quantity: Literal["velocity", "acceleration", "jerk", "effort"]
    sign: Literal[-1, 1]


def switching_structure(
    trajectory: PiecewisePolynomial,
    velocity: ArrayLike,
    acceleration: ArrayLike,
    jerk: ArrayLike | None = None,
    efforts: Array | None = None,
) -> list[Binding]:
    """Return the intervals of time in which a limit binds; where none is named, the motion switches.

    Of several limits that bind the one that already did is named, else the one that is nearest.

    Args:
        trajectory: q(t) with n joints, in short pieces.
        velocity: Bounds, shape (n, 2).
        acceleration: Bounds, shape (n, 2).
        jerk: Bounds, shape (n, 2), where it follows them.
        efforts: Shares of their upper and of their lower limits in use, means over both ends of each piece,
            shape (pieces, 2 n), where it follows limits of efforts.
    """
    bounds = [velocity, acceleration] if jerk is None else [velocity, acceleration, jerk]
    shares = [_used(trajectory, k + 1, each) for k, each in enumerate(bounds)]
    names: list[Literal["velocity", "acceleration", "jerk", "effort"]] = ["velocity", "acceleration", "jerk"]
    names[len(bounds) :] = ["effort"]
    used = np.concatenate(shares if efforts is None else [*shares, efforts], axis=1)
    labels = _labels(used)
    bindings, times, n = [], trajectory.breaks, trajectory.dimension
    for label, group in groupby(range(trajectory.pieces), labels.__getitem__):
        pieces = list(group)
        if label < 0:
            continue
        side, joint = divmod(label, n)
        bindings.append(
            Binding(
                float(times[pieces[0]]),
                float(times[pieces[-1] + 1]),
                joint,
                names[side // 2],
                1 if side % 2 == 0 else -1,
            )
        )
    return bindings


def _used(trajectory: PiecewisePolynomial, order: int, bounds: ArrayLike) -> Array:
    """Return the shares of the upper and of the lower bounds in use, means over both ends, (pieces, 2 n)."""
    limits = np.asarray(bounds, dtype=np.float64)
    mean = 0.5 * np.add(*trajectory.piece_ends(order))
    return np.concatenate([mean / limits[:, 1], mean / limits[:, 0]], axis=1)


def _labels(used: Array) -> list[int]:
    """Return for each piece which column binds, or -1."""
    best, share = used.argmax(axis=1).tolist(), used.max(axis=1).tolist()
    labels: list[int] = []
    last = -1
    for piece, (column, share_of_piece) in enumerate(zip(best, share, strict=True)):
        stays = column == last and share_of_piece >= _BINDS
        if not stays and (last < 0 or used[piece, last] < max(_BINDS, share_of_piece - _STAYS)):
            last = column if share_of_piece >= _BINDS else -1
        labels.append(last)
    return labels
