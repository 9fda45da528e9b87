"""Bounds of functions of time for all t, from their values at nine nodes of each piece.

Through nine values goes a polynomial of degree 8. The function is off it between the nodes by at most
f^(9) / 9! times 8! / 4 (h / 8)^9, the remainder. The polynomial itself lies within the hull of its control
points, which closes in on it when it is divided: pieces are halved until the remainder is small, and divided
until the hull is. Users bring the values, and the majorants of f^(9) / 9!.

Source: Isaacson and Keller, Analysis of Numerical Methods (1966), section 6.3 (equidistant nodes); Farouki,
The Bernstein polynomial basis: a centennial retrospective, Computer Aided Geometric Design 29 (2012),
section 3.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import comb, factorial

import numpy as np

from trajcli.curves.piecewise import Array, derivative_coefficients, horner, taylor_shift
from trajcli.frozen import frozen

NODES_DEGREE = 8
"""Of the polynomial through values at nine equidistant nodes."""

BETWEEN_NODES = factorial(NODES_DEGREE) / 4 / NODES_DEGREE ** (NODES_DEGREE + 1)
"""Bounds the product of the distances from nine equidistant nodes of a piece of length 1."""

_DIVISIONS, _MOST_PARTS = 24, 1 << 16
_HALVES = 1 << 14  # pieces halved no more, or 16 times those given: their bound stays looser

KnownAtNodes = Callable[[Array, Array], tuple[Array, Array]]
"""From coefficients (degree + 1, P, n) and lengths (P,) of pieces of the joints' curve: values of m functions
at the nodes, shape (P, 9, m, d), and majorants of |f^(9)| / 9! on the whole pieces, shape (P, m)."""


@frozen
class BoundedPeak:
    """The largest size of a function over time.

    Attributes:
        value: The largest one sampled.
        time: Where that is.
        upper_bound: What it does not exceed at any time.
        entries: Of the function there, shape (d,).
    """

    value: float
    time: float
    upper_bound: float
    entries: Array


@frozen
class NodeSurvey:
    """Values of m functions at the nodes of P pieces, in no order, and how far off they may be between them.

    Attributes:
        starts: Of the pieces, shape (P,).
        lengths: Of the pieces, shape (P,).
        values: With d entries each, shape (P, 9, m, d).
        remainder: Of each function, in the norm of its entries, shape (P, m).
    """

    starts: Array
    lengths: Array
    values: Array
    remainder: Array

    def largest(
        self,
        function: int,
        size: Callable[[Array], Array],
        slack: Callable[[float], float],
        *,
        least: float = -np.inf,
    ) -> BoundedPeak:
        """Return the largest size of one function.

        Args:
            function: Index.
            size: A convex function of its entries, from (..., d) to (...), that grows by no more than these.
            slack: From a value reached to how near to it the hull must come.
            least: What no size is below.
        """
        values, remainder, starts, lengths = (
            self.values[:, :, function],
            self.remainder[:, function],
            self.starts,
            self.lengths,
        )
        value, time, upper_bound = least, float(starts.min()), least
        if not (np.isfinite(values).all() and np.isfinite(remainder).all()):
            nothing = np.append(np.inf, np.zeros(values.shape[-1] - 1))
            return BoundedPeak(np.inf, time, np.inf, nothing)  # nothing is proven of what no float64 holds
        hull, halves = hull_matrices()
        points = hull @ values
        entries = points[0, 0]
        for division in range(_DIVISIONS + 1):
            sizes = size(points)
            ends, highest = sizes[:, [0, -1]], sizes.max(axis=1)
            piece, end = np.unravel_index(int(ends.argmax()), ends.shape)
            if ends[piece, end] > value:
                value, time = float(ends[piece, end]), float(starts[piece] + end * lengths[piece])
                entries = points[piece, -1 if end else 0]
            wide = highest > value + slack(value)
            if not wide.any() or len(points) > _MOST_PARTS or division == _DIVISIONS:
                break
            upper_bound = max(upper_bound, float((highest + remainder)[~wide].max(initial=least)))
            points = (halves[:, None] @ points[wide]).reshape(-1, *points.shape[1:])
            remainder, lengths = np.tile(remainder[wide], 2), np.tile(lengths[wide] / 2, 2)
            starts = np.concatenate([starts[wide], starts[wide] + lengths[: len(lengths) // 2]])
        return BoundedPeak(value, time, max(upper_bound, float((highest + remainder).max())), entries)


def node_survey(
    values_at_nodes: KnownAtNodes,
    pieces: tuple[Array, Array, Array],
    slack: Callable[[Array], Array],
    halvings: int,
) -> NodeSurvey:
    """Return the values at nodes of pieces, halved until the remainders are small enough.

    Args:
        values_at_nodes: Values and majorants on pieces.
        pieces: Starts and lengths above 0, each (P,), and coefficients (degree + 1, P, n) from the starts on.
        slack: From values (P, 9, m, d) to the largest remainders that are small enough, shape (m,).
        halvings: How many times at most.
    """
    starts, lengths, coefficients = pieces
    found = _surveyed(values_at_nodes, starts, lengths, coefficients)
    for _ in range(halvings):
        coarse = (found.remainder > slack(found.values)).any(axis=1)
        coarse &= np.isfinite(found.remainder).all(axis=1)
        if not coarse.any() or len(found.starts) > max(_HALVES, 16 * len(starts)):
            break
        half, early = found.lengths[coarse] / 2, coefficients[:, coarse]
        late = taylor_shift(early, np.broadcast_to(half[:, None], early.shape[1:]))
        both, begins = np.concatenate([early, late], axis=1), found.starts[coarse]
        more = _surveyed(values_at_nodes, np.concatenate([begins, begins + half]), np.tile(half, 2), both)
        coefficients = np.concatenate([coefficients[:, ~coarse], both], axis=1)
        found = NodeSurvey(
            np.concatenate([found.starts[~coarse], more.starts]),
            np.concatenate([found.lengths[~coarse], more.lengths]),
            np.concatenate([found.values[~coarse], more.values]),
            np.concatenate([found.remainder[~coarse], more.remainder]),
        )
    return found


def _surveyed(
    values_at_nodes: KnownAtNodes, starts: Array, lengths: Array, coefficients: Array
) -> NodeSurvey:
    values, majorants = values_at_nodes(coefficients, lengths)
    remainder = majorants * BETWEEN_NODES * lengths[:, None] ** (NODES_DEGREE + 1)
    return NodeSurvey(starts, lengths, values, remainder)


def at_nodes(coefficients: Array, lengths: Array, order: int = 2) -> tuple[Array, ...]:
    """Return a curve and its derivatives at the nodes of its pieces, each (P, 9, n).

    Args:
        coefficients: Of the pieces, (degree + 1, P, n), highest power first.
        lengths: Of the pieces, (P,).
        order: Of the last derivative.
    """
    inside = (lengths[:, None] * np.linspace(0.0, 1.0, NODES_DEGREE + 1))[..., None]
    derivatives = (derivative_coefficients(coefficients, k) for k in range(order + 1))
    return tuple(horner(each[:, :, None], inside) for each in derivatives)


@cache
def hull_matrices() -> tuple[Array, Array]:
    """Return what makes control points of values at nodes (9, 9), and those of both halves (2, 9, 9)."""
    n, x = NODES_DEGREE, np.linspace(0.0, 1.0, NODES_DEGREE + 1)[:, None]
    k = np.arange(n + 1)
    chosen = np.array([comb(n, j) for j in range(n + 1)], dtype=np.float64)
    hull = np.asarray(np.linalg.inv(chosen * x**k * (1.0 - x) ** (n - k)), dtype=np.float64)
    first = np.array([[comb(i, j) / 2**i for j in range(n + 1)] for i in range(n + 1)])
    return hull, np.stack([first, first[::-1, ::-1]])
