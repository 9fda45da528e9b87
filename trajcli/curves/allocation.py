"""When to pass the points of a spline so that it is over soonest: durations of its pieces from its limits.

The durations h minimise their sum while every piece keeps its limits. With y = log h, and c_i(y) the
logarithm of what a piece uses of a limit, the minimiser of

    sum h - mu sum_i log(-c_i(y))

tends to the optimum as mu does to zero, and is never more than mu times the number of limits above it where c
is convex. Newton's steps need the slopes of c: durations far from a piece hardly matter to it, so every ninth
one is varied at once, and the Hessian diag(h) + mu sum (c'_i c'_i^T) / c_i^2 is banded. All costs are
proportional to the number of points.

Source: Boyd and Vandenberghe, Convex Optimization (2004), sections 11.2 and 11.3; Curtis, Powell and Reid, On
the estimation of sparse Jacobian matrices, J. Inst. Math. Appl. 13 (1974).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from trajcli.curves.block_tridiagonal import solve_block_tridiagonal
from trajcli.curves.extrema import piece_extremes
from trajcli.curves.feasible import smallest_feasible
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.frozen import frozen

Family = Callable[[Array], PiecewisePolynomial]

_REACH = 4  # durations to either side that matter to a piece: in a C2 cubic each further one counts a quarter
_WINDOW = 2 * _REACH + 1
_BAND = _WINDOW - 1
_VARIED = 1e-6  # of a duration
_ROOM = 1e-10  # relative; a tenth of the tolerance with which limits are verified
_HIDDEN = -3.0  # log of a share of 5 %: limits of which less is used do not steer
_INSIDE = 1.03  # times the feasible start, to begin inside
_BARRIERS = (1.0, 0.2, 0.05, 0.01, 0.002)  # of the sum of durations
_STEPS = 12  # of Newton for each barrier
_HALVINGS = 12
_LONGEST = 0.7  # of log h in one step
_CALM = 1e-3  # of log h: a step this short ends a round
_AMPLE = 1e4


@frozen
class _Barrier:
    """The problem of one barrier.

    Attributes:
        family: The curve from 0 whose pieces, or runs of pieces, last as long as it is told.
        bounds: Shape (3, n, 2).
        weight: mu, s.
    """

    family: Family
    bounds: Array
    weight: float

    def value(self, y: Array) -> float:
        """Return what is minimised; infinite outside the limits."""
        uses = _uses(self.family, np.exp(y), self.bounds)
        if uses.max() >= 0:
            return np.inf
        return float(np.exp(y).sum() - self.weight * np.log(-uses).sum())

    def step(self, y: Array) -> Array:
        """Return Newton's step, shape (m,)."""
        h = np.exp(y)
        uses = _uses(self.family, h, self.bounds)
        slopes = self._slopes(y, uses)
        inverse = 1.0 / -uses
        m = y.size
        gradient = _scattered(self.weight * np.einsum("kr,krw->kw", inverse, slopes), m) + h
        curvature = self.weight * np.einsum("kr,krv,krw->kvw", inverse**2, slopes, slopes)
        step = -solve_block_tridiagonal(*_blocks(curvature, h), gradient)
        return np.clip(step, -_LONGEST, _LONGEST)

    def _slopes(self, y: Array, uses: Array) -> Array:
        """Return d c / d y, shape (m, r, window): entry w of piece k is about duration k - reach + w."""
        places = np.arange(y.size)
        slopes = np.zeros((*uses.shape, _WINDOW))
        for colour in range(min(_WINDOW, y.size)):
            varied = y + _VARIED * (places % _WINDOW == colour)
            change = (_uses(self.family, np.exp(varied), self.bounds) - uses) / _VARIED
            entry = (colour - places + _REACH) % _WINDOW
            owner = places - _REACH + entry
            inside = (owner >= 0) & (owner < y.size)
            slopes[places[inside], :, entry[inside]] = change[inside]
        return slopes


def fastest_durations(family: Family, guess: Array, bounds: Array) -> Array | None:
    """Return the durations (m,) of the pieces of the fastest curve of a family that keeps its limits.

    The optimum is a local one. None where no stretch of the guess keeps the limits.

    Args:
        family: The curve from 0 whose pieces, or runs of pieces, last as long as it is told, shape (m,).
        guess: Positive, shape (m,).
        bounds: Lower and upper limits of velocity, acceleration and jerk, shape (3, n, 2), infinite if none.
    """
    start = _stretched(family, guess, bounds)
    if start is None or guess.size == 1:
        return start
    y, total = np.log(start * _INSIDE), float(start.sum())
    count = _uses(family, start, bounds).size
    for cost in _BARRIERS:
        y = _centred(_Barrier(family, bounds, cost * total / count), y)
    best = _stretched(family, np.exp(y), bounds)
    return best if best is not None and best.sum() < start.sum() else start


def _centred(barrier: _Barrier, y: Array) -> Array:
    """Return the minimiser of a barrier from a start inside the limits; a start outside comes back."""
    value = barrier.value(y)
    if not np.isfinite(value):
        return y
    for _ in range(_STEPS):
        step, part = barrier.step(y), 1.0
        for _ in range(_HALVINGS):
            trial = barrier.value(y + part * step)
            if trial < value:
                break
            part /= 2
        else:
            break
        y, value = y + part * step, trial
        if part * np.abs(step).max() < _CALM:
            break
    return y


def _stretched(family: Family, durations: Array, bounds: Array) -> Array | None:
    """Return the durations times the smallest factor that keeps the limits."""
    orders = np.repeat([1.0, 2.0, 3.0], bounds.shape[1])
    factor = float(np.exp((_all_uses(family, durations, bounds) / orders).max()))
    if factor == 0:
        return None
    if _excess(family, durations * factor, bounds) <= _ROOM:  # ends at rest: limits scale as powers of time
        return durations * factor * (1 + _ROOM)

    def excess(factors: Array) -> Array:
        return np.array([_excess(family, durations * f, bounds) for f in factors.tolist()]) - _ROOM

    found = smallest_feasible(excess, factor / 10, factor * _AMPLE, block=1)
    return None if found is None else durations * found


def _excess(family: Family, durations: Array, bounds: Array) -> float:
    return float(_all_uses(family, durations, bounds).max())


def _uses(family: Family, durations: Array, bounds: Array) -> Array:
    """Return log of what each piece uses of those limits that count, shape (m, r)."""
    uses: Array = np.maximum(_all_uses(family, durations, bounds), _HIDDEN)
    return uses


def _all_uses(family: Family, durations: Array, bounds: Array) -> Array:
    """Return log of what each piece uses of each limit, shape (m, 3 n); what it does not use is -inf."""
    curve = family(durations)
    begins = np.concatenate([[0.0], np.cumsum(durations)[:-1]]) + 0.25 * durations.min()
    first = np.maximum.accumulate(np.searchsorted(curve.breaks, begins, "right") - 1)
    parts = []
    for (low, high), limits in zip(
        piece_extremes(curve.coefficients, curve.lengths, (1, 2, 3)), bounds, strict=True
    ):
        share = np.maximum(low / limits[:, 0], high / limits[:, 1])
        parts.append(np.maximum.reduceat(share, first, axis=0))
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(np.maximum(np.concatenate(parts, axis=1), 0.0)))


def _scattered(values: Array, size: int) -> Array:
    """Return the sums over all windows, shape (size,), of values (m, window)."""
    total = np.zeros(size + 2 * _REACH)
    for entry in range(_WINDOW):
        total[entry : entry + size] += values[:, entry]
    return total[_REACH : _REACH + size]


def _blocks(curvature: Array, diagonal: Array) -> tuple[Array, Array]:
    """Return the diagonal blocks (b, band, band) and those to their right (b - 1, band, band) of the Hessian.

    Args:
        curvature: Shape (m, window, window).
        diagonal: What is added to the diagonal, shape (m,).
    """
    m = diagonal.size
    count = -(-m // _BAND)
    band = np.zeros((_BAND + 1, m + 2 * _REACH))
    for v in range(_WINDOW):
        for w in range(v, _WINDOW):
            band[w - v, v : v + m] += curvature[:, v, w]
    band = np.pad(band[:, _REACH : _REACH + m], ((0, 0), (0, (count + 1) * _BAND - m)))
    band[0, :m] += diagonal
    band[0, m:] = 1.0
    rows = np.arange(count)[:, None, None] * _BAND + np.arange(_BAND)[:, None]
    ahead = np.arange(_BAND) - np.arange(_BAND)[:, None]
    upper = np.where(ahead >= 0, band[np.clip(ahead, 0, _BAND), rows], 0.0)
    inner = upper + np.swapaxes(np.where(ahead > 0, upper, 0.0), 1, 2)
    reach = ahead + _BAND
    right = np.where(reach <= _BAND, band[np.clip(reach, 0, _BAND), rows], 0.0)
    return inner, right[:-1]
