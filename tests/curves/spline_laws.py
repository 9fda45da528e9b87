"""What must hold for a curve through waypoints, and cubic splines solved exactly, in rational numbers."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from math import perm

import numpy as np
from hypothesis import strategies as st

from trajcli.curves.extrema import peaks

SEEDS = st.integers(0, 2**32 - 1)


def uneven_times(rng, count, ratio, start=0.0):
    """Return times whose distances differ by up to `ratio`; their mean is one."""
    lengths = ratio ** rng.uniform(0, 1, count - 1)
    return start + np.concatenate([[0.0], np.cumsum(lengths / lengths.mean())])


def jump(curve, order):
    """Return the largest difference between the sides of a break over the peak, all t and components."""
    first, last = curve.piece_ends(order)
    gap = np.abs(first[1:] - last[:-1]).max(axis=0, initial=0.0)
    peak = peaks(curve, (order,))[0].magnitude
    return float((gap / np.where(peak > 0, peak, 1.0)).max())


def missed(curve, times, positions):
    """Return by how much either side of a break misses a waypoint, over the largest position of the curve."""
    first, last = curve.piece_ends()
    place = np.searchsorted(curve.breaks, times)
    assert (curve.breaks[place] == times).all()
    right = np.concatenate([first, last[-1:]])[place]
    left = np.concatenate([first[:1], last])[place]
    distance = np.maximum(np.abs(right - positions), np.abs(left - positions))
    return float((distance / peaks(curve, (0,))[0].magnitude).max())


def assert_through(curve, times, positions, continuity):
    assert missed(curve, times, positions) < 1e-12
    for order in range(continuity + 1):
        assert jump(curve, order) < 1e-12, order


def exact_spline(times, positions, conditions):
    """Return coefficients [piece][power] as Fractions: cubics whose first two derivatives are continuous.

    Args:
        times: Of all knots.
        positions: One for each, None for a virtual one.
        conditions: As many as are needed; (knot, order, value) for a derivative at the first or last knot,
            (knot,) for a third derivative that is continuous there.
    """
    t = [Fraction(x) for x in times]
    system = _Conditions([b - a for a, b in pairwise(t)])
    for k, q in enumerate(positions):
        if q is not None:
            for side in system.sides(k):
                system.add(q, (*side, 0, 1))
        for order in (1, 2) if q is not None else (0, 1, 2):
            system.meet(k, order)
    for knot, *given in conditions:
        if given:
            order, value = given
            system.add(value, (*system.sides(knot)[0], order, 1))
        else:
            system.meet(knot, 3)
    solution = _solved(system.rows, system.right)
    return [solution[k : k + 4] for k in range(0, len(solution), 4)]


class _Conditions:
    """Linear equations for the coefficients of cubics with the given lengths."""

    def __init__(self, lengths):
        self.lengths, self.rows, self.right = lengths, [], []

    def sides(self, knot):
        """Return (piece, local time) of each piece at a knot."""
        before = [(knot - 1, self.lengths[knot - 1])] if knot else []
        return before + ([(knot, Fraction(0))] if knot < len(self.lengths) else [])

    def add(self, value, *terms):
        """Add: the sum of sign times derivative, over terms (piece, local time, order, sign), is `value`."""
        row = [Fraction(0)] * (4 * len(self.lengths))
        for piece, local, order, sign in terms:
            for power in range(order, 4):
                row[4 * piece + power] += sign * perm(power, order) * local ** (power - order)
        self.rows.append(row)
        self.right.append(Fraction(value))

    def meet(self, knot, order):
        """Add: the derivative has no jump, where the knot is an inner one."""
        sides = self.sides(knot)
        if len(sides) == 2:
            self.add(0, (*sides[0], order, 1), (*sides[1], order, -1))


def _solved(rows, right):
    """Return the solution of a square system by elimination in rational numbers."""
    size = len(rows)
    assert all(len(row) == size for row in rows)
    table = [[*row, value] for row, value in zip(rows, right, strict=True)]
    for k in range(size):
        pivot = next(i for i in range(k, size) if table[i][k])
        table[k], table[pivot] = table[pivot], table[k]
        head = table[k][k]
        table[k] = [x / head if x else x for x in table[k]]
        for i in range(size):
            factor = table[i][k]
            if i != k and factor:
                table[i] = [x - factor * y if y else x for x, y in zip(table[i], table[k], strict=True)]
    return [row[-1] for row in table]


def assert_equals_exact(curve, coefficients, tolerance):
    """Compare each derivative at the ends and middles of pieces, over its peak."""
    lengths = curve.lengths
    for order in range(3):
        scale = peaks(curve, (order,))[0].magnitude[0]
        for piece, (exact, length) in enumerate(zip(coefficients, lengths.tolist(), strict=True)):
            own = [Fraction(x) for x in curve.coefficients[::-1, piece, 0].tolist()]
            for local in (Fraction(0), Fraction(length) / 2, Fraction(length)):
                values = [
                    sum(perm(power, order) * c[power] * local ** (power - order) for power in range(order, 4))
                    for c in (own, exact)
                ]
                assert abs(float(values[0] - values[1])) <= tolerance * scale, (order, piece, local)
