"""Proven lower bound of the duration of two straight moves in joint space with a zone between them.

Whatever the motion, it lasts h1 T along the first line, h2 T in the zone and h3 T along the second one. In
the time of each part from 0 to 1, limits bound its derivatives by h T v, (h T)^2 a and (h T)^3 j, and all
that a motion obeys is linear: sums over intervals, limits at nodes, moments of bounded accelerations and
jerks, one state at each border of the zone. Over a box of shares (h1, h3) powers of them lie below their
secants, and products with states at the borders in the hull of McCormick. The linear programme that is left
says what part of its distance any motion covers in T. Any multipliers of its rows bound that by a polynomial
of T, whose coefficients are linear in the shares: where it stays below 1 in all corners of the box, there is
no such motion, nor a faster one. Branch and bound over boxes does the rest. Ball, ranges, limits of the tool
and of efforts are left out, so that the bound holds all the more.

Source: McCormick, Computability of global solutions to factorable nonconvex programs I, Mathematical
Programming 10 (1976), for products; Neumaier and Shcherbina, Safe bounds in linear and mixed-integer linear
programming, Mathematical Programming 99 (2004), for bounds by any multipliers.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.curves.turning_bound import bounds_along
from trajcli.frozen import frozen
from trajcli.kinematics.robot import Limits
from trajcli.planners.flying_by.between_stops import FlyByChain
from trajcli.planners.flying_by.second_order import SAFE, rounded_down

_GRIDS = (
    (0.3, 4, 3),
    (0.08, 8, 6),
    (0.0, 16, 10),
)  # width of a box from which on: intervals of line, of zone
_PROGRAMMES = ((0.005, 280), (0.03, 700))  # at most, while a bound is further from the duration that is known
_THIN = 0.02  # of the whole: a share below which it counts as large
_SWITCHES = (0.25, 0.5, 0.75)  # of an interval, before which extremes have another sign than behind
_MOST = 10.0  # times its distance, that a motion covers in the programme

Orders = NDArray[np.int64]


@frozen
class ShareBox:
    """Shares of the first and of the last part in the duration.

    Attributes:
        low: Of both.
        high: Of both.
    """

    low: tuple[float, float]
    high: tuple[float, float]

    @property
    def shares(self) -> tuple[tuple[float, float], ...]:
        """Least and largest share of each of the three parts."""
        middle = max(1.0 - math.fsum(self.high), 0.0), min(1.0 - math.fsum(self.low), 1.0)
        return (self.low[0], self.high[0]), middle, (self.low[1], self.high[1])

    @property
    def width(self) -> float:
        """Largest width of a share, relative to it."""
        return max((high - low) / max(0.5 * (low + high), _THIN) for low, high in self.shares)

    def halves(self) -> list[ShareBox]:
        """Return both halves, without one that leaves the zone no time."""
        low, high = np.array(self.low), np.array(self.high)
        means = np.maximum(0.5 * (low + high), _THIN)
        zone = max(1.0 - 0.5 * float((low + high).sum()), _THIN)
        side = int(((high - low) * (1 / means + 1 / zone)).argmax())
        middle = 0.5 * (self.low[side] + self.high[side])
        if side == 0:
            halves = replace(self, high=(middle, self.high[1])), replace(self, low=(middle, self.low[1]))
        else:
            halves = replace(self, high=(self.high[0], middle)), replace(self, low=(self.low[0], middle))
        return [half for half in halves if math.fsum(half.low) < 1.0]


def is_provable(chain: FlyByChain) -> bool:
    """Return whether this proof knows a chain: two straight moves in joint space, from rest to rest."""
    straight = all(course.curve.degree == 1 and course.curve.pieces == 1 for course in chain.courses)
    return len(chain.courses) == 2 and straight and not any(rates.any() for rates in chain.ends)


def least_duration(chain: FlyByChain, duration: float) -> float:
    """Return a duration, s, that no motion of a chain falls below.

    Args:
        chain: One that `is_provable`, with the borders of its whole zone.
        duration: Of a motion that is known, s.
    """
    programmes = [ShareProgramme(chain, line, zone) for _, line, zone in _GRIDS]
    queue = [(0.0, 0, ShareBox((0.0, 0.0), (1.0, 1.0)))]
    count = 0
    while any(count < n and queue[0][0] < duration * (1 - gap) for gap, n in _PROGRAMMES):
        least, _, box = heapq.heappop(queue)
        for half in box.halves():
            count += 1
            programme = next(p for p, row in zip(programmes, _GRIDS, strict=True) if half.width >= row[0])
            found = programme.least_duration(half, max(least, 0.5 * duration), duration)
            heapq.heappush(queue, (max(least, found), count, half))
    return rounded_down(queue[0][0])


@frozen
class _Variable:
    """s along a line, or a joint in the zone.

    Attributes:
        part: 0, 1 or 2.
        distance: What it covers.
        bounds: Of velocity, acceleration and jerk, (3, 2).
        intervals: How many its part is divided into.
        start: Column of its first position; velocity and acceleration follow, then those at the next node.
        slopes: By number of the border, its rates there over those of s.
    """

    part: int
    distance: float
    bounds: Array
    intervals: int
    start: int
    slopes: tuple[tuple[int, float], ...]

    @property
    def width(self) -> int:
        return 3 * (self.intervals + 1)

    def node(self, border: int) -> int:
        """Return the column of its position at a border of the zone."""
        first = self.part == border + 1
        return self.start if first else self.start + 3 * self.intervals


class ShareProgramme:
    """The linear programme of all boxes: what part of its distance a motion can cover in T."""

    def __init__(self, chain: FlyByChain, on_line: int, in_zone: int) -> None:
        """Prepare what is the same in every box.

        Args:
            chain: Two straight moves.
            on_line: Intervals into which parts on lines are divided.
            in_zone: Intervals of the zone.
        """
        import scipy.sparse

        self.variables = list(_variables(chain, on_line, in_zone))
        self.states = sum(variable.width for variable in self.variables)
        self.columns = self.states + 5  # sd and sdd at both borders, and the part of the distance
        rows, orders, sizes, parts = [], [], [], []
        distances = np.zeros((len(self.variables), self.columns))
        for k, variable in enumerate(self.variables):
            own, order, size = moment_rows(variable.bounds, variable.intervals)
            wide = np.zeros((len(own), self.columns))
            wide[:, variable.start : variable.start + variable.width] = own
            rows.append(wide)
            orders.append(order)
            sizes.append(size)
            parts.append(np.full(len(own), variable.part))
            distances[k, [variable.start, variable.start + 3 * variable.intervals, -1]] = (
                -1.0,
                1.0,
                -variable.distance,
            )
        self._rows, self._distances = (
            scipy.sparse.csr_matrix(each) for each in (np.concatenate(rows), distances)
        )
        self._orders, self._sizes = np.concatenate(orders), np.concatenate(sizes)
        self._parts = np.concatenate(parts)

    def least_duration(self, box: ShareBox, guess: float, longest: float) -> float:
        """Return a duration, s, that no motion with shares in a box falls below.

        Args:
            box: Of shares.
            guess: The duration for which multipliers are found, s.
            longest: The longest that matters, s.
        """
        from scipy.optimize import linprog
        from scipy.sparse import csr_matrix, hstack

        A, orders, sides = self.rows(box)
        low, high, own_orders = self.ranges(box)
        now, scale = guess**orders, guess**own_orders
        cost = np.zeros(self.columns + 2)
        cost[self.columns - 1] = -1.0
        states = np.stack([low * scale, high * scale], axis=1)
        distances = hstack([self._distances, csr_matrix((len(self.variables), 2))])
        given = (
            cost,
            hstack([A, csr_matrix(-now[:, None] * sides[:, 1:])]),
            now * sides[:, 0],
            distances,
            np.zeros(len(self.variables)),
            np.concatenate([states, np.stack([box.low, box.high], axis=1)]),
        )
        # without a presolve, which takes longer than it saves
        options = {"presolve": False, "maxiter": sum(A.shape)}
        solved: Any = linprog(*given, method="highs-ds", options=options)
        if solved.status == 1:  # a third of these steps are enough, or it goes round in circles
            solved = linprog(*given, method="highs-ipm")
        if solved.status != 0:
            return 0.0  # nothing is known
        y = np.maximum(-solved.ineqlin.marginals, 0.0)
        left = -cost[: self.columns] - A.T @ y + self._distances.T @ solved.eqlin.marginals
        weights = np.zeros((4, 3))
        np.add.at(weights, orders, y[:, None] * sides)
        np.add.at(weights[:, 0], own_orders, np.maximum(left * low, left * high))
        corners = [[1.0, *corner] for corner in product(*zip(box.low, box.high, strict=True))]
        return _largest_refuted(weights @ np.transpose(corners), longest)

    def rows(self, box: ShareBox) -> tuple[Any, Orders, Array]:
        """Return rows A, orders k and sides (c, g1, g2) with A x <= T^k (c + g1 h1 + g2 h3) in a box."""
        from scipy.sparse import csr_matrix, vstack

        sides = np.zeros((self._orders.size, 3))
        for part, (low, high) in enumerate(box.shares):
            for k in (1, 2, 3):
                chosen = (self._parts == part) & (self._orders == k)
                sides[chosen] = self._sizes[chosen, None] * _in_shares(part, *secant(low, high, k))
        ties = list(self._ties(box))
        orders = np.concatenate([self._orders, [order for _, order, _ in ties]])
        more = csr_matrix(np.array([row for row, _, _ in ties]))
        return vstack([self._rows, more]).tocsr(), orders, np.concatenate([sides, [t[2] for t in ties]])

    def ranges(self, box: ShareBox) -> tuple[Array, Array, Orders]:
        """Return the least and the largest value of each column for T = 1, and the power of T of both."""
        low, high = np.zeros(self.columns), np.zeros(self.columns)
        orders = np.zeros(self.columns, dtype=np.int64)
        for variable in self.variables:
            share = box.shares[variable.part][1]
            for k in range(3):
                columns = slice(variable.start + k, variable.start + variable.width, 3)
                orders[columns] = max(k, 1)
                low[columns], high[columns] = share ** max(k, 1) * variable.bounds[max(k, 1) - 1]
            low[variable.start] = high[variable.start] = 0.0  # positions count from the start of the part
        first, last = self.variables[0], self.variables[-1]
        for column in (first.start, last.start + 3 * last.intervals):  # rest
            low[column + 1 : column + 3] = high[column + 1 : column + 3] = 0.0
        for number, line in enumerate((first, last)):
            columns = slice(self.states + 2 * number, self.states + 2 * number + 2)
            low[columns], high[columns], orders[columns] = *line.bounds[:2].T, [1, 2]
        low[-1], high[-1] = 0.0, _MOST
        return low, high, orders

    def _ties(self, box: ShareBox) -> Iterator[tuple[Array, int, Array]]:
        """Yield rows that tie states of parts to those at the borders: w = h^k d u, with the slope d."""
        for variable in self.variables:
            low, high = box.shares[variable.part]
            for (number, slope), k in product(variable.slopes, (1, 2)):
                line = self.variables[-number]
                least, largest = line.bounds[k - 1].tolist()
                above, below = secant(low, high, k), _tangent(low, high, k)
                sign, size = (1.0 if slope >= 0 else -1.0), abs(slope)
                for side, factor, value, envelope in (
                    (-1.0, low**k, least, above),
                    (-1.0, high**k, largest, below),
                    (1.0, high**k, least, below),
                    (1.0, low**k, largest, above),
                ):
                    row = np.zeros(self.columns)
                    row[variable.node(number) + k] = side * sign
                    row[self.states + 2 * number + k - 1] = -side * factor * size
                    constant = np.array([factor, 0.0, 0.0])
                    of_shares = _in_shares(variable.part, *envelope) - constant
                    yield row, k, side * size * value * of_shares


def _variables(chain: FlyByChain, on_line: int, in_zone: int) -> Iterator[_Variable]:
    """Yield s along the first line, each joint in the zone, and s along the second line."""
    (before, behind), corner = chain.courses, chain.corners[0]
    limits = corner.robot.limits
    yield _Variable(0, corner.left, _along(before.curve, before.robot.limits), on_line, 0, ((0, 1.0),))
    start = 3 * (on_line + 1)
    steps = behind.curve.evaluate(corner.joined) - before.curve.evaluate(corner.left)
    slopes = [course.curve.coefficients[0, 0] for course in (before, behind)]
    for joint, step in enumerate(steps.tolist()):
        if not (step or slopes[0][joint] or slopes[1][joint]):
            continue  # it may stand still, however long it takes
        bounds = np.stack([limits.of_order(order)[joint] for order in (1, 2, 3)])
        rates = (0, float(slopes[0][joint])), (1, float(slopes[1][joint]))
        yield _Variable(1, step, bounds, in_zone, start, rates)
        start += 3 * (in_zone + 1)
    distance = behind.length - corner.joined
    yield _Variable(2, distance, _along(behind.curve, behind.robot.limits), on_line, start, ((1, 1.0),))


def _along(line: Any, limits: Limits) -> Array:  # noqa: ANN401
    """Return the bounds (3, 2) of a law forward along a line, by the limits of the joints that move."""
    bounds = np.stack([bounds_along(line.coefficients[0, 0], limits.of_order(order)) for order in (1, 2, 3)])
    bounds[0, 0] = 0.0
    return bounds


def moment_rows(bounds: Array, intervals: int) -> tuple[Array, Orders, Array]:
    """Return what states at nodes obey in the time from 0 to 1.

    On an interval of length l, with r from 1 to 0 over it, the integrals of the jerk times 1, l r and
    (l r)^2 / 2 are differences of the states at its ends, and so are those of the acceleration times 1 and
    l r. Times a function of r that changes its sign they are largest where the jerk, or the acceleration,
    has its bounds where that has its sign.

    Args:
        bounds: Of velocity, acceleration and jerk, (3, 2); infinite for none.
        intervals: N.

    Returns:
        Rows (m, 3 (N + 1)) on position, velocity and acceleration at each node, the orders of the bounds that
        their sides grow with, (m,), and the sides, (m,).
    """
    step = 1.0 / intervals
    eye = np.eye(3 * (intervals + 1))
    rows: list[Array] = []
    orders: list[int] = []
    sizes: list[float] = []

    def add(row: Array, order: int, positive: float, negative: float) -> None:
        low, high = bounds[order - 1]
        if not np.isfinite([low, high]).all():
            return
        for sign, upper_bound in (
            (1.0, positive * high - negative * low),
            (-1.0, negative * high - positive * low),
        ):
            rows.append(sign * row)
            orders.append(order)
            sizes.append(float(upper_bound))

    for k in range(intervals):
        x, v, a = (eye[3 * k + 3 + order] - eye[3 * k + order] for order in range(3))
        x = x - step * eye[3 * k + 1]
        add(x + step * eye[3 * k + 1], 1, step, 0.0)
        add(v, 2, step, 0.0)
        add(a, 3, step, 0.0)
        for row, zeroth, order in ((x, v, 2), (v - step * eye[3 * k + 2], a, 3)):
            for switch in _SWITCHES:  # l r - (1 - switch) l
                sides = 0.5 * step**2 * switch**2, 0.5 * step**2 * (1 - switch) ** 2
                add(row - (1 - switch) * step * zeroth, order, *sides)
        second = x - 0.5 * step**2 * eye[3 * k + 2]
        first = v - step * eye[3 * k + 2]
        # l^2 (r - 1/4) (r - 3/4) / 2: its positive part has the integral l^3 / 48, its negative part l^3 / 96
        add(second - 0.5 * step * first + step**2 * 3 / 32 * a, 3, step**3 / 48, step**3 / 96)
    return np.array(rows), np.array(orders, dtype=np.int64), np.array(sizes)


def secant(low: float, high: float, k: int) -> tuple[float, float]:
    """Return c and g with h^k <= c + g h for h from low to high."""
    slope = sum(high**i * low ** (k - 1 - i) for i in range(k))
    return low**k - slope * low, slope


def _tangent(low: float, high: float, k: int) -> tuple[float, float]:
    """Return c and g with h^k >= c + g h for h from 0 on."""
    middle = 0.5 * (low + high)
    return (1 - k) * middle**k, k * middle ** (k - 1)


def _in_shares(part: int, constant: float, slope: float) -> Array:
    """Return a linear function of the share of a part as c, g1 and g2 of one of the outer shares."""
    outer = {0: (constant, slope, 0.0), 1: (constant + slope, -slope, -slope), 2: (constant, 0.0, slope)}
    return np.array(outer[part])


def _largest_refuted(weights: Array, longest: float) -> float:
    """Return a duration, up to `longest`, at which all of several cubic polynomials of it are below 1."""

    def refuted(duration: float) -> bool:
        return bool((duration ** np.arange(4.0) @ weights < 1.0 - SAFE).all())

    if refuted(longest):
        return longest
    low, high = 0.0, longest
    for _ in range(50):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if refuted(middle) else (low, middle)
    return low
