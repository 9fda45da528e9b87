"""Primal-dual interior point for a chain of intervals: rows tie the unknowns of neighbouring nodes alone.

Each of N + 1 nodes has two unknowns, so an interval sees four of them, p. Minimised is the sum of
w (1 + f p)^-1/2 over some samples f of each interval, under rows g p <= c. Newton's matrix then has blocks of
2 x 2 along three diagonals, and each step takes time in proportion to N.

Source: Mehrotra (1992); Nocedal and Wright (2006), section 16.6.
"""

from __future__ import annotations

import numpy as np

from trajcli.curves.linear_systems import BlockFactors, block_factors
from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen

_STEPS = 50  # of Newton: twice what the hardest problems took
_TO_BORDER = 0.99  # of the way to where a slack, or a multiplier, vanishes
_SHRINK = 0.9  # of the way to where 1 + f p vanishes
_LEAST_SLACK = 0.05  # of a limit, to begin with
_GAP = 0.2  # between the objective and its bound, to begin with
_FEASIBLE = 1e-7  # of a limit: a row passed by less is kept
_PINNED = 1e-9  # on the diagonal: unknowns that no row knows stay zero
_ROUNDING = 1e-13  # of the diagonal, and of 1 + f p
_TINY = 1e-300


@frozen
class ChainProgram:
    """What is minimised, and its rows; all limits are of size one.

    Attributes:
        samples: f, shape (4, k, N).
        weights: w, shape (k, N).
        rows: g, shape (4, m, N).
        limits: c, shape (m, N), not negative where p = 0 is a solution.
        penalty: What it costs to pass a row by one: a finite one makes every program solvable.
    """

    samples: Array
    weights: Array
    rows: Array
    limits: Array
    penalty: float = np.inf

    def minimum(self, gap: float) -> Array:
        """Return the unknowns (N + 1, 2) whose objective is within `gap` of the least, by its dual bound."""
        x, pairs = np.zeros((self.limits.shape[1] + 1, 2)), self._first_pairs()
        for _ in range(_STEPS):
            gradient, curvature = self._objective(x)
            down = gradient + _scattered(self.rows, pairs.dual)
            off = _times(self.rows, x) + pairs.slack - pairs.passed - self.limits
            between = pairs.gap
            if between < gap and np.abs(off).max() < _FEASIBLE and np.abs(down).sum() < 10.0 * gap:
                break
            try:
                matrix = self._factored(pairs.weight, curvature)
            except np.linalg.LinAlgError:  # as near as rounding allows
                break
            newton = _Newton(self.rows, pairs, down, off, matrix)
            dx, change = newton.step(0.0, None)
            ahead = pairs.ahead(change, 1.0).gap
            centre = min(1.0, max(ahead, 0.0) / between) ** 3 * between / pairs.count
            dx, change = newton.step(centre, change)
            bound = self._positive(x, dx)
            moved = x + min(pairs.reach(change, _TO_BORDER)[0], bound) * dx
            if not (1.0 + _times(self.samples, moved) > _ROUNDING).all():
                break
            x = moved
            pairs = pairs.ahead(change, _TO_BORDER, bound)
        return x

    def _first_pairs(self) -> _Pairs:
        slack = np.maximum(self.limits, _LEAST_SLACK)
        dual = _GAP / slack.size / slack
        if np.isinf(self.penalty):
            return _Pairs(slack, dual, np.zeros(1), np.full(1, np.inf))
        dual = np.minimum(dual, 0.5 * self.penalty)
        over = self.penalty - dual
        return _Pairs(slack, dual, _GAP / slack.size / over, over)

    def _objective(self, x: Array) -> tuple[Array, Array]:
        """Return gradient (N + 1, 2) and the curvature of each interval, shape (N, 4, 4)."""
        root = 1.0 / np.sqrt(1.0 + _times(self.samples, x))
        slopes, curvatures = -0.5 * self.weights * root**3, 0.75 * self.weights * root**5
        return _scattered(self.samples, slopes), _squares(self.samples, curvatures)

    def _factored(self, weight: Array, curvature: Array) -> BlockFactors:
        """Return the factors of Newton's matrix with the rows weighed by (m, N)."""
        local = curvature + _squares(self.rows, weight)
        diagonal = np.zeros((len(local) + 1, 2, 2))
        diagonal[:-1] += local[:, :2, :2]
        diagonal[1:] += local[:, 2:, 2:]
        unknowns = diagonal[:, [0, 1], [0, 1]]
        diagonal[:, [0, 1], [0, 1]] = unknowns + np.maximum(_PINNED, _ROUNDING * unknowns)
        return block_factors(diagonal, local[:, :2, 2:])

    def _positive(self, x: Array, dx: Array) -> float:
        """Return how far a step may go so that all 1 + f p stay positive."""
        return _reach(1.0 + _times(self.samples, x), _times(self.samples, dx), _SHRINK)


@frozen
class _Pairs:
    """Slacks with their multipliers, and how far rows are passed with the multipliers of that.

    Where rows must not be passed, the last two are zero and infinity, of shape (1,).

    Attributes:
        slack: Shape (m, N).
        dual: Shape (m, N).
        passed: Shape (m, N).
        over: The penalty less dual, shape (m, N).
    """

    slack: Array
    dual: Array
    passed: Array
    over: Array

    @property
    def elastic(self) -> bool:
        """Whether rows may be passed."""
        return self.passed.size == self.slack.size and bool(np.isfinite(self.over.flat[0]))

    @property
    def count(self) -> int:
        """Number of products that tend to zero."""
        return self.slack.size * (1 + self.elastic)

    @property
    def gap(self) -> float:
        passed = float((self.passed * self.over).sum()) if self.elastic else 0.0
        return float((self.slack * self.dual).sum()) + passed

    @property
    def weight(self) -> Array:
        """By how much each multiplier grows with its row, shape (m, N)."""
        return 1.0 / (self.slack / self.dual + self.passed / self.over)

    def reach(self, change: _Pairs, share: float) -> tuple[float, float]:
        """Return how much of a change of slacks, and of multipliers, may be taken."""
        slack, dual = _reach(self.slack, change.slack, share), _reach(self.dual, change.dual, share)
        if not self.elastic:
            return slack, dual
        passed, over = _reach(self.passed, change.passed, share), _reach(self.over, change.over, share)
        return min(slack, passed), min(dual, over)

    def ahead(self, change: _Pairs, share: float, bound: float = 1.0) -> _Pairs:
        """Return the pairs after as much of a change as may be taken."""
        slack, dual = self.reach(change, share)
        slack = min(slack, bound)
        return _Pairs(
            self.slack + slack * change.slack,
            self.dual + dual * change.dual,
            self.passed + slack * change.passed,
            self.over + dual * change.over,
        )


@frozen
class _Newton:
    """A linearisation of the optimality conditions.

    Attributes:
        rows: Of the program, shape (4, m, N).
        pairs: Slacks and multipliers.
        down: Residual of the gradient, shape (N + 1, 2).
        off: Residual of the rows, shape (m, N).
        matrix: Factored.
    """

    rows: Array
    pairs: _Pairs
    down: Array
    off: Array
    matrix: BlockFactors

    def step(self, centre: float, before: _Pairs | None) -> tuple[Array, _Pairs]:
        """Return the changes that make all products `centre`."""
        now = self.pairs
        less, more = (
            (0.0, 0.0) if before is None else (before.slack * before.dual, before.passed * before.over)
        )
        want = (centre - less) / now.dual - now.slack
        beyond = (centre - more) / now.over - now.passed if now.elastic else np.zeros(1)
        base = self.off + want - beyond
        dx = self.matrix.solve(-(self.down + _scattered(self.rows, now.weight * base)))
        dual = now.weight * (_times(self.rows, dx) + base)
        slack = want - now.slack / now.dual * dual
        if not now.elastic:
            return dx, _Pairs(slack, dual, np.zeros(1), np.zeros(1))
        return dx, _Pairs(slack, dual, beyond + now.passed / now.over * dual, -dual)


def _times(rows: Array, x: Array) -> Array:
    """Return rows (4, m, N) times the unknowns around each interval, shape (m, N)."""
    return np.asarray(np.einsum("imn,in->mn", rows, np.concatenate([x[:-1].T, x[1:].T])))


def _scattered(rows: Array, factors: Array) -> Array:
    """Return the sum of rows times factors (m, N), by unknown, shape (N + 1, 2)."""
    local = np.einsum("imn,mn->ni", rows, factors)
    total = np.zeros((len(local) + 1, 2))
    total[:-1] += local[:, :2]
    total[1:] += local[:, 2:]
    return total


def _squares(rows: Array, factors: Array) -> Array:
    """Return the sum over rows of factor g g^T for each interval, shape (N, 4, 4)."""
    return np.asarray((rows * factors).transpose(2, 0, 1) @ rows.transpose(2, 1, 0))


def _reach(values: Array, steps: Array, share: float) -> float:
    """Return how much of the steps may be taken, at most 1, to go that share of the way to zero."""
    return min(1.0, share / max(_TINY, float((-steps / values).max(initial=0.0))))
