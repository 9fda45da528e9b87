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

from collections.abc import Sequence
from math import comb

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.curves.third_order.interior_point import ChainProgram
from trajcli.curves.third_order.jerk import ThirdOrderConstraint
from trajcli.curves.third_order.path_limits import SHARES, LawLimits, Sample, sampled
from trajcli.curves.third_order.quartic_law import QuarticLaw
from trajcli.curves.time_optimal.constraints import PathConstraint

_WEIGHTS = np.array([7.0, 32.0, 12.0, 32.0, 7.0]) / 90.0
_CONTROL = np.linalg.inv([[comb(4, k) * x**k * (1 - x) ** (4 - k) for k in range(5)] for x in SHARES])
_KEPT = 36  # rows of an interval beside those of velocity: the nearest to their limits
_NEAR, _RANKS = 1e-6, 16.0  # distances of rows: the finest, and how many there are for each factor of e
_TINY = 1e-300
_FASTEST = 9.0  # b: a law gets no more than three times as fast in a step
_SLOWEST = 1e-6  # b: it stays positive


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
    samples = [sampled(law, share) for share in SHARES]
    rows, slack = _rows(samples, limits, lowered)
    values = np.stack([np.broadcast_to(sample.value, (4, h.size)) for sample in samples], axis=1)
    rows, values = (_of_nodes(each, law, scale) for each in (rows, values))
    weights = np.outer(_WEIGHTS, h / law.duration)
    change = ChainProgram(values, weights, rows, slack, penalty).minimum(gap)
    return np.maximum(1.0 + change[:, 0], _SLOWEST), change[:, 1] / scale


def _rows(samples: Sequence[Sample], limits: LawLimits, lowered: Array) -> tuple[Array, Array]:
    """Return rows (4, m, N) for Hermite's numbers, and what b = 1 leaves of their limits, (m, N).

    Of the many rows of an interval only those count that a change of the unknowns meets first.
    """
    second = [[_second_order(sample, each, lowered) for sample in samples] for each in limits.second]
    caps = [row for cap, _ in map(_over_interval, second) for row in cap]
    others = [row for _, rows in map(_over_interval, second) for row in rows]
    third = [
        (each, _third_order(sample, each, lowered[2])) for each in limits.third for sample in samples[::2]
    ]
    others += [row for _, row in third]
    rows, slack = (np.concatenate(parts, axis=-2) for parts in zip(*others, strict=True))
    # rows of a vector crowd around its direction: they must not take the places of all others
    kept = _KEPT + sum(len(row[1]) for each, row in third if each.curved) // 2
    if len(slack) > kept:
        size = np.sqrt((rows[0] + rows[2]) ** 2 + rows[1] ** 2 + rows[3] ** 2 + _TINY)
        rank = np.rint(_RANKS * np.arcsinh(slack / size / _NEAR))  # rounding must not choose between equals
        nearest = np.argsort(rank, axis=0, kind="stable")[:kept]
        slack = np.take_along_axis(slack, nearest, axis=0)
        rows = np.take_along_axis(rows, nearest[None], axis=1)
    cap_rows, cap_slack = (np.concatenate(parts, axis=-2) for parts in zip(*caps, strict=True))
    return np.concatenate([cap_rows, rows], axis=1), np.concatenate([cap_slack, slack])


def _over_interval(
    samples: Sequence[tuple[tuple[Array, Array], tuple[Array, Array]]],
) -> tuple[list[tuple[Array, Array]], list[tuple[Array, Array]]]:
    """Return caps and rows of the control points of what was sampled: they bound it throughout."""
    both = list[list[tuple[Array, Array]]]()
    for values in zip(*samples, strict=True):
        rows, slack = (np.stack(each) for each in zip(*values, strict=True))
        rows, slack = (np.tensordot(_CONTROL, each, axes=1) for each in (rows, slack))
        both.append(list(zip(rows, slack, strict=True)))
    return both[0], both[1]


def _second_order(
    sample: Sample, constraint: PathConstraint, lowered: Array
) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    """Return the row of the cap and the others, each with what b = 1 leaves."""
    s, v, a, _ = sample.state
    given = constraint.rows(s, sample.side)
    with np.errstate(divide="ignore", invalid="ignore"):
        share = np.where(v > 0, v**2 / given.cap, 0.0)
    share = np.maximum(share * lowered[0] ** 2, 1.0 / _FASTEST)
    cap = sample.value[:, None] * share, 1.0 - share[None]
    limit = (given.c / lowered[1][:, None]).T
    slope = given.a.T * v / limit
    value = (given.a.T * a + given.b.T * v**2) / limit
    rows = 0.5 * slope * sample.slope[:, None] + value * sample.value[:, None]
    return cap, (rows, 1.0 - value)


def _third_order(sample: Sample, constraint: ThirdOrderConstraint, lowered: Array) -> tuple[Array, Array]:
    """Return the rows of jerk, with what b = 1 leaves of the tangents."""
    _, v, a, u = sample.state
    given = constraint.rows(sample.state, sample.side)
    limit = (given.limit / lowered[:, None]).T
    first, second, third = given.first.T / limit, given.second.T / limit, given.third.T / limit
    by_bend, by_slope = 0.5 * first * v, 1.5 * (first * a + second * v**2)
    by_value = first * u + 3.0 * second * (v * a) + third * v**3
    rows = by_bend * sample.bend[:, None] + by_slope * sample.slope[:, None]
    return rows + (by_value + 0.5) * sample.value[:, None], 1.0 - by_value


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
