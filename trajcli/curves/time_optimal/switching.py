"""Switching structure of a time-optimal motion: which limit of which joint binds when."""

from __future__ import annotations

from itertools import groupby
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.frozen import comparable

_BINDS = 0.95  # of a limit, on average over a piece: its ends reach the limit only as far as the grid is fine
_STAYS = 0.01  # by which another limit must be nearer before it takes over


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
