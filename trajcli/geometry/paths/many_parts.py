"""Lines and rounded corners of a chain of very many parts, evaluated together.

What one part is asked for costs much the same for one place as for a hundred, and on a path that was recorded
there are hardly more places than parts. Here straight parts are one table and blends are another one.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from trajcli.frozen import frozen
from trajcli.geometry.paths.arc_length import derivative, inverted_length
from trajcli.geometry.paths.corner import Blend
from trajcli.geometry.paths.position import Line, PartOfCurve, PositionCurve, Triple
from trajcli.geometry.rotation import Array

Indices = NDArray[np.intp]
_STRAIGHT, _ROUNDED, _OTHER = range(3)


@frozen
class ManyParts:
    """Parts of a chain, m of them.

    Attributes:
        kinds: Of each part, shape (m,): straight, rounded, or another one.
        numbers: Of each part within the table of its kind, shape (m,).
        lines: The straight parts.
        blends: The rounded ones.
    """

    kinds: Indices
    numbers: Indices
    lines: _Lines
    blends: _Blends

    def evaluate(
        self, part: Indices, local: Array, other: Callable[[int, Array], Triple]
    ) -> tuple[Array, Array, Array]:
        """Return p, p', p'' (N, 3) at arc lengths of parts.

        Args:
            part: Indices (N,).
            local: Arc lengths within these, shape (N,), m.
            other: Evaluates a part of another kind.
        """
        result = np.empty((3, part.size, 3))
        kinds = self.kinds[part]
        for kind, table in ((_STRAIGHT, self.lines), (_ROUNDED, self.blends)):
            rows = np.flatnonzero(kinds == kind)
            if rows.size:
                result[:, rows] = table.evaluate(self.numbers[part[rows]], local[rows])
        others = np.flatnonzero(kinds == _OTHER)
        for k in np.unique(part[others]).tolist():
            rows = others[part[others] == k]
            result[:, rows] = other(k, local[rows])
        return result[0], result[1], result[2]

    def majorants(
        self, part: Indices, rising: Array, other: Callable[[int, Indices], tuple[Array, Array]]
    ) -> tuple[Array, Array]:
        """Return the bounds of p and Q as `PositionCurve` says, of pieces that lie in parts.

        Args:
            part: Indices (P,).
            rising: Shape (order + 1, P).
            other: The bounds of some of the pieces, which lie in a part of another kind.
        """
        kinds = self.kinds[part]
        position, turned = rising.copy(), np.zeros(rising.shape)
        for bounds in (position, turned):
            bounds[:, kinds == _ROUNDED] = np.inf
        others = np.flatnonzero(kinds == _OTHER)
        for k in np.unique(part[others]).tolist():
            rows = others[part[others] == k]
            position[:, rows], turned[:, rows] = other(k, rows)
        return position, turned


@frozen
class _Lines:
    """Straight parts, k of them.

    Attributes:
        starts: Of the whole lines, shape (k, 3), m.
        ends: Likewise.
        lengths: Of the whole lines, shape (k,), m.
        firsts: Where the parts begin on these, shape (k,), m.
    """

    starts: Array
    ends: Array
    lengths: Array
    firsts: Array

    def evaluate(self, number: Indices, local: Array) -> Array:
        """Return p, p', p'', shape (3, N, 3)."""
        start, end, length = self.starts[number], self.ends[number], self.lengths[number][:, None]
        fraction = np.minimum((local + self.firsts[number])[:, None] / length, 1.0)
        return np.stack(
            [(1.0 - fraction) * start + fraction * end, (end - start) / length, np.zeros(start.shape)]
        )


@frozen
class _Blends:
    """Rounded corners, k of them.

    Attributes:
        coefficients: Of r(u), shape (6, k, 3), m, highest power first.
        squares: Of |r'(u)|^2, shape (9, k), likewise.
        knots: Of all blends, one behind the other, in u.
        lengths: From the start of each blend to its knots, likewise, m.
        first: Index of the first knot of each blend, and of the one behind the last, shape (k + 1,).
    """

    coefficients: Array
    squares: Array
    knots: Array
    lengths: Array
    first: Indices

    def evaluate(self, number: Indices, local: Array) -> Array:
        """Return p, p', p'', shape (3, N, 3)."""
        rows = self.coefficients[:, number]
        slopes = derivative(rows)
        panel = self._panel(number, local)
        u = inverted_length(
            self.squares[:, number],
            (self.knots[panel], self.knots[panel + 1]),
            self.lengths[panel + 1] - self.lengths[panel],
            local - self.lengths[panel],
        )
        position, slope, bend = (_at(each, u) for each in (rows, slopes, derivative(slopes)))
        speed = np.linalg.norm(slope, axis=-1, keepdims=True)
        first = slope / speed
        across = bend - (bend * first).sum(axis=-1, keepdims=True) * first
        return np.stack([position, first, across / speed**2])

    def _panel(self, number: Indices, local: Array) -> Indices:
        """Return the index of the knot at or before each arc length, the last one of a blend left out."""
        ends = np.cumsum(self.lengths[self.first[1:] - 1])
        before = np.append(0.0, ends[:-1])
        counts = np.diff(self.first)
        whole = self.lengths + np.repeat(before, counts)
        found = np.searchsorted(whole, before[number] + local, "right") - 1
        return np.clip(found, self.first[number], self.first[number + 1] - 2)


def many_parts(parts: Sequence[PositionCurve]) -> ManyParts:
    """Return the tables of parts."""
    kinds, numbers = np.full(len(parts), _OTHER), np.zeros(len(parts), dtype=np.intp)
    lines, blends = list[tuple[Line, float]](), list[Blend]()
    for k, part in enumerate(parts):
        whole, first = (part.curve, part.first) if isinstance(part, PartOfCurve) else (part, 0.0)
        if isinstance(whole, Line):
            kinds[k], numbers[k] = _STRAIGHT, len(lines)
            lines.append((whole, first))
        elif isinstance(part, Blend):
            kinds[k], numbers[k] = _ROUNDED, len(blends)
            blends.append(part)
    return ManyParts(kinds, numbers, _table_of_lines(lines), _table_of_blends(blends))


def _table_of_lines(lines: Sequence[tuple[Line, float]]) -> _Lines:
    starts, ends = (
        np.array([getattr(line, name) for line, _ in lines]).reshape(-1, 3) for name in ("start", "end")
    )
    lengths = np.array([line.length for line, _ in lines])
    return _Lines(starts, ends, lengths, np.array([first for _, first in lines]))


def _table_of_blends(blends: Sequence[Blend]) -> _Blends:
    arcs = [blend.arc for blend in blends]
    first = np.cumsum([0, *(arc.knots.size for arc in arcs)])
    coefficients = np.array([arc.coefficients for arc in arcs]).reshape(-1, 6, 3).transpose(1, 0, 2)
    knots, lengths = (
        np.concatenate([np.empty(0), *(getattr(arc, name) for arc in arcs)]) for name in ("knots", "lengths")
    )
    return _Blends(np.ascontiguousarray(coefficients), _squares(coefficients), knots, lengths, first)


def _squares(coefficients: Array) -> Array:
    """Return the coefficients (9, k) of |r'(u)|^2, of those of r, (6, k, 3)."""
    slopes = derivative(coefficients)
    result = np.zeros((2 * len(slopes) - 1, coefficients.shape[1]))
    for k, row in enumerate(slopes):
        result[k : k + len(slopes)] += np.einsum("pki,ki->pk", slopes, row)
    return result


def _at(coefficients: Array, u: Array) -> Array:
    """Return polynomials (degree + 1, N, 3) at u (N,), shape (N, 3)."""
    result: Array = coefficients[0].copy()
    for row in coefficients[1:]:
        result *= u[:, None]
        result += row
    return result
