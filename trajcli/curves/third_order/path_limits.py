"""Limits along a path of all three orders, what a time law uses of them, and the time that it loses.

At every moment of the fastest motion some limit is met. An interval in which none is met on average holds a
switching point, or cannot follow a limit that bends; it loses no more of its time than the share by which all
limits are missed, and less where the acceleration hardly changes in it.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial, Side
from trajcli.curves.third_order.jerk import ThirdOrderConstraint
from trajcli.curves.third_order.quartic_law import QuarticLaw
from trajcli.curves.time_optimal.constraints import PathConstraint
from trajcli.frozen import frozen

SHARES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Of an interval, at which limits are kept."""

_MOST, _MORE = 40, 1000  # nodes: of a piece on average, and of the whole path on top
_TINY = 1e-9  # of the limits: less acceleration is none
_ORDER_COSTS = np.array([[1.0], [0.5], [1.0 / 3.0]])  # of time for each share by which a limit is passed


@frozen
class LawLimits:
    """What a law must keep.

    Attributes:
        second: Limits of velocity and acceleration along the path.
        third: Limits of jerk.
    """

    second: tuple[PathConstraint, ...]
    third: tuple[ThirdOrderConstraint, ...]

    def excess(self, law: QuarticLaw) -> Array:
        """Return what each piece uses of velocity, acceleration and jerk, in multiples of limits, (3, N)."""
        pieces = law.pieces
        second = np.maximum.reduce([constraint.excess(pieces) for constraint in self.second])
        third = np.maximum.reduce([constraint.excess(pieces) for constraint in self.third])
        return np.concatenate([second, third[None]])

    def used(self, sample: Sample) -> tuple[Array, Array]:
        """Return what is used of any limit at samples, (k N,), and the share of each row of acceleration."""
        s, v, a, u = sample.state
        parts, rows = [np.zeros(s.size)], []
        for constraint in self.second:
            given = constraint.rows(s, sample.side)
            with np.errstate(divide="ignore", invalid="ignore"):
                parts.append(np.where(v > 0, v**2 / given.cap, 0.0))
            rows.append((given.a.T * a + given.b.T * v**2) / given.c.T)
        for jerk in self.third:
            turn = jerk.rows(sample.state, sample.side)
            value = turn.first.T * u + 3.0 * turn.second.T * (v * a) + turn.third.T * v**3
            parts.append((value / turn.limit.T).max(axis=0, initial=0.0))
        shares = np.concatenate(rows)
        return np.maximum.reduce([*parts, shares.max(axis=0, initial=0.0)]), shares


@frozen
class Sample:
    """The law at some shares of all its intervals, share by share; numbers for Hermite's (b, h b', b, h b').

    Attributes:
        state: s, sd, sdd and sddd, each (k N,).
        side: From which side of breaks the path is seen there.
        value: Of b, shape (4, k N).
        slope: Of b', shape (4, k N).
        bend: Of b'', shape (4, k N).
    """

    state: tuple[Array, Array, Array, Array]
    side: Side
    value: Array
    slope: Array
    bend: Array


def sampled(law: QuarticLaw, *shares: float) -> Sample:
    """Return the law at shares of its intervals, their ends seen from inside: 1 comes alone."""
    x, h = np.array(shares)[:, None], law.lengths
    ones = np.ones(h.size)
    value = [2 * x**3 - 3 * x**2 + 1, x**3 - 2 * x**2 + x, 3 * x**2 - 2 * x**3, x**3 - x**2]
    slope = [6 * x**2 - 6 * x, 3 * x**2 - 4 * x + 1, 6 * x - 6 * x**2, 3 * x**2 - 2 * x]
    bend = [12 * x - 6, 6 * x - 4, 6 - 12 * x, 6 * x - 2]
    side: Side = "left" if shares[-1] == 1.0 else "right"
    states = [np.concatenate(each) for each in zip(*map(law.states, shares), strict=True)]
    numbers = (np.array(each) * by for each, by in ((value, ones), (slope, 1 / h), (bend, 1 / h**2)))
    s, v, a, u = states
    return Sample((s, v, a, u), side, *(each.reshape(4, -1) for each in numbers))


def all_samples(law: QuarticLaw, shares: Sequence[float]) -> tuple[Sample, Sample]:
    """Return the law at shares of its intervals, the last of which is 1: the inner ones, and the ends."""
    return sampled(law, *shares[:-1]), sampled(law, shares[-1])


def by_share(parts: Iterable[Array], count: int) -> Array:
    """Return what was found at all samples of `count` intervals, (..., k N) each, as (..., shares, N)."""
    shaped = (part.reshape(*part.shape[:-1], part.shape[-1] // count, count) for part in parts)
    return np.concatenate([*shaped], axis=-2)


def time_lost(law: QuarticLaw, limits: LawLimits, excess: Array) -> Array:
    """Return an estimate of the time lost in each interval, shape (N,).

    Args:
        law: Of N pieces.
        limits: That it is to keep.
        excess: What it uses of them, shape (3, N).
    """
    count = law.lengths.size
    found = zip(*map(limits.used, all_samples(law, SHARES)), strict=True)
    used, accelerations = (by_share(each, count) for each in found)
    unused = np.clip(1.0 - used, 0.0, 1.0).mean(axis=0)
    peak = np.minimum(np.abs(accelerations).max(axis=(1, 2), initial=_TINY), 1.0)
    steps = np.abs(accelerations[:, -1] - accelerations[:, 0]) / peak[:, None]
    change = np.minimum(steps.max(axis=0, initial=0.0), 1.0)
    over = (_ORDER_COSTS * np.maximum(excess - 1.0, 0.0)).max(axis=0)
    return np.asarray(law.lengths * (unused * change + over))


def most_nodes(path: PiecewisePolynomial) -> int:
    """Return how many nodes a law may have: proportional to the number of pieces."""
    return _MOST * path.pieces + _MORE
