"""Convex step: the fastest change of a time law, with the limit of jerk replaced by its tangent.

The time tau of the law at hand is the parameter of the path, and the square b of its rate dtau / dt the
unknown: 1 at the law at hand. With primes for derivatives by tau, velocities are q' sqrt(b), accelerations
q' b' / 2 + q'' b, jerks sqrt(b) L b with

    L b = q' b'' / 2 + 3/2 q'' b' + q''' b,

and |L b| <= J b^(-1/2). The right side is convex, so its tangent at b = 1, J (3 - b) / 2, lies below it:
what keeps the tangent keeps the limit. Between nodes b is cubic in tau, given by b and b' at both; where the
motion begins or ends at rest it is linear: a quartic law from rest leaves no more freedom.

Velocity and acceleration are kept by the control points of what five samples of each interval tell: a rule
of quadratics and quartics is bounded by them for all t. Jerk, which is nearly linear, is kept at three.

Source: Debrouwere et al. (2013); the parameter and the elements are our own.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import comb

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.curves.third_order.interior_point import ChainProgram
from trajcli.curves.third_order.jerk import ThirdOrderConstraint
from trajcli.curves.third_order.path_limits import SHARES, LawLimits, Sample, all_samples, by_share
from trajcli.curves.third_order.quartic_law import QuarticLaw
from trajcli.curves.time_optimal.constraints import PathConstraint

_WEIGHTS = np.array([7.0, 32.0, 12.0, 32.0, 7.0]) / 90.0
_CONTROL = np.linalg.inv([[comb(4, k) * x**k * (1 - x) ** (4 - k) for k in range(5)] for x in SHARES])
_KEPT = 36  # rows of an interval beside those of velocity: the nearest to their limits
_NEAR, _RANKS = 1e-6, 16.0  # distances of rows: the finest, and how many there are for each factor of e
_TINY = 1e-300
_FASTEST = 9.0  # b: a law gets no more than three times as fast in a step
_SLOWEST = 1e-6  # b: it stays positive

_Rows = tuple[Array, Array]


def faster(
    law: QuarticLaw, limits: LawLimits, lowered: Array, gap: float, penalty: float
) -> tuple[Array, Array]:
    """Return b and b' at the nodes of a law that make it the fastest, each of shape (N + 1,).

    Args:
        law: Of N pieces.
        limits: That it shall keep.
        lowered: By what velocity, acceleration and jerk limits are divided in each interval, shape (3, N).
        gap: Of the duration, by which it may be missed.
        penalty: What it costs, as a share of the duration, to pass a limit by its size; infinite where it
            must not be passed.
    """
    h = law.lengths
    scale = np.concatenate([h[:1], 0.5 * (h[1:] + h[:-1]), h[-1:]])  # of b'
    rows, slack = _rows(law, limits, lowered)
    values = by_share((sample.value for sample in all_samples(law, SHARES)), h.size)
    rows, values = (_of_nodes(each, law, scale) for each in (rows, values))
    weights = np.outer(_WEIGHTS, h / law.duration)
    change = ChainProgram(values, weights, rows, slack, penalty).minimum(gap)
    return np.maximum(1.0 + change[:, 0], _SLOWEST), change[:, 1] / scale


def _rows(law: QuarticLaw, limits: LawLimits, lowered: Array) -> _Rows:
    """Return rows (4, m, N) for Hermite's numbers, and what b = 1 leaves of their limits, (m, N).

    Of the many rows of an interval only those count that a change of the unknowns meets first.
    """
    caps, others, crowded = list[_Rows](), list[_Rows](), 0
    inner, ends = all_samples(law, SHARES)
    for constraint in limits.second:
        found = [_second_order(sample, constraint, lowered) for sample in (inner, ends)]
        for kept, parts in zip((caps, others), zip(*found, strict=True), strict=True):
            kept.append(_of_intervals(parts, lowered.shape[1], throughout=True))
    inner, ends = all_samples(law, SHARES[::2])
    for jerk in limits.third:
        third = [_third_order(sample, jerk, lowered[2]) for sample in (inner, ends)]
        others.append(_of_intervals(third, lowered.shape[1]))
        crowded += len(others[-1][1]) if jerk.curved else 0
    # rows of a vector crowd around its direction: they must not take the places of all others
    nearest = _nearest(_joined(others), _KEPT + crowded // 2)
    return _joined([_joined(caps), nearest])


def _joined(parts: Iterable[_Rows]) -> _Rows:
    rows, slack = (np.concatenate(each, axis=-2) for each in zip(*parts, strict=True))
    return rows, slack


def _nearest(rows: _Rows, count: int) -> _Rows:
    """Return so many rows of each interval: those that a change of the unknowns meets first."""
    weights, slack = rows
    if len(slack) <= count:
        return rows
    size = np.sqrt((weights[0] + weights[2]) ** 2 + weights[1] ** 2 + weights[3] ** 2 + _TINY)
    rank = np.rint(_RANKS * np.arcsinh(slack / size / _NEAR))  # rounding must not choose between equals
    nearest = np.argsort(rank, axis=0, kind="stable")[:count]
    return np.take_along_axis(weights, nearest[None], axis=1), np.take_along_axis(slack, nearest, axis=0)


def _of_intervals(parts: Sequence[_Rows], count: int, *, throughout: bool = False) -> _Rows:
    """Return the rows at all samples of `count` intervals, share by share.

    Throughout an interval they are bounded by the control points of what was sampled.
    """
    found = []
    for each in zip(*parts, strict=True):
        values = np.moveaxis(by_share(each, count), -2, 0)
        found.append(
            np.concatenate(np.tensordot(_CONTROL, values, axes=1) if throughout else values, axis=-2)
        )
    return found[0], found[1]


def _second_order(sample: Sample, constraint: PathConstraint, lowered: Array) -> tuple[_Rows, _Rows]:
    """Return the row of the cap and the others, each with what b = 1 leaves."""
    s, v, a, _ = sample.state
    given, (slower, weaker) = constraint.rows(s, sample.side), _at(sample, lowered[:2])
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(v > 0, v**2 / given.cap, 0.0)
    share = np.maximum(share * slower**2, 1.0 / _FASTEST)
    cap = sample.value[:, None] * share, 1.0 - share[None]
    limit = (given.c / weaker[:, None]).T
    slope = given.a.T * v / limit
    value = (given.a.T * a + given.b.T * v**2) / limit
    rows = 0.5 * slope * sample.slope[:, None] + value * sample.value[:, None]
    return cap, (rows, 1.0 - value)


def _third_order(sample: Sample, constraint: ThirdOrderConstraint, lowered: Array) -> _Rows:
    """Return the rows of jerk, with what b = 1 leaves of the tangents."""
    _, v, a, u = sample.state
    given = constraint.rows(sample.state, sample.side)
    limit = (given.limit / _at(sample, lowered)[:, None]).T
    first, second, third = given.first.T / limit, given.second.T / limit, given.third.T / limit
    by_bend, by_slope = 0.5 * first * v, 1.5 * (first * a + second * v**2)
    by_value = first * u + 3.0 * second * (v * a) + third * v**3
    rows = by_bend * sample.bend[:, None] + by_slope * sample.slope[:, None]
    return rows + (by_value + 0.5) * sample.value[:, None], 1.0 - by_value


def _at(sample: Sample, intervals: Array) -> Array:
    """Return what is known of N intervals, (..., N), at samples of them, (..., k N)."""
    return np.tile(intervals, sample.state[0].size // intervals.shape[-1])


def _of_nodes(rows: Array, law: QuarticLaw, scale: Array) -> Array:
    """Return rows (4, m, N) of Hermite's numbers as rows of the unknowns of the nodes.

    Where an interval begins or ends at rest b is linear: its value there follows from those at the other end.
    At an end of the law in motion nothing changes.
    """
    h, rows = law.lengths, rows.copy()
    leaves, arrives = np.flatnonzero(law.speed[:-1] == 0.0), np.flatnonzero(law.speed[1:] == 0.0)
    value, slope = rows[0][:, leaves], rows[1][:, leaves]
    rows[2][:, leaves] += value
    rows[3][:, leaves] += slope - value
    value, slope = rows[2][:, arrives], rows[3][:, arrives]
    rows[0][:, arrives] += value
    rows[1][:, arrives] += slope + value
    rows[:2, :, leaves], rows[2:, :, arrives] = 0.0, 0.0
    rows[:2, :, 0], rows[2:, :, -1] = 0.0, 0.0
    rows[1] *= h / scale[:-1]
    rows[3] *= h / scale[1:]
    return rows
