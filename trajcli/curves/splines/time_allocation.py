"""Time allocation: durations of the pieces of a spline with which it is fastest within its limits.

The durations h minimise their sum while every piece keeps its limits. With y = log h, and c_i(y) the
logarithm of what a piece uses of a limit, the minimiser of

    sum h - mu sum_i log(-c_i(y))

tends to the optimum as mu does to zero, and is never more than mu times the number of limits above it where c
is convex. Newton's steps need the slopes of c: durations far from a piece hardly matter to it, so every ninth
one is varied at once, and the Hessian diag(h) + mu sum (c'_i c'_i^T) / c_i^2 is banded. The slopes change
slowly, so that they serve several steps. All costs are proportional to the number of points.

Where points are dense, a jerk limit ties the durations of many pieces together, and to change one by itself
helps nobody. So they are passed by a smooth law u(t) of a parameter u of theirs, a cubic spline through some
of them, whose durations are found: a few, then more in steps, each beginning with what was found before.

Source: Boyd and Vandenberghe (2004), sections 11.2 and 11.3; Curtis, Powell and Reid, On the estimation of
sparse Jacobian matrices, J. Inst. Math. Appl. 13 (1974).
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.extrema import piece_extremes
from trajcli.curves.linear_systems import solve_block_tridiagonal
from trajcli.curves.operations import times_at
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.smallest_feasible import smallest_feasible
from trajcli.curves.splines.cubic import not_a_knot
from trajcli.curves.splines.virtual_points import continuous_acceleration
from trajcli.frozen import frozen

_NEAR = 4  # durations to either side that matter to a piece: in a C2 cubic each further one counts a quarter
_WINDOW = 2 * _NEAR + 1
_BAND = _WINDOW - 1
_VARIED = 1e-6  # of a duration
_ROOM = 1e-10  # relative; a tenth of the tolerance with which limits are verified
_HIDDEN = -3.0  # log of a share of 5 %: limits of which less is used do not steer
_INSIDE = 1.03  # times the feasible start, to begin inside
# mu, of the mean duration; and the gain, of the sum of durations, below which a step ends the round
_BARRIERS = ((0.04, 1e-2), (0.004, 3e-3), (0.0008, 3e-4))
_STEPS = 12  # of Newton for each barrier
_HALVINGS = 12
_LONGEST = 0.7  # of log h in one step
_NEARER = 0.6  # of the distance to the limits in one step, by the slopes
_FAR = 0.2  # of log h: slopes from further away are computed anew
_AMPLE = 1e4
_WIDTHS = (4, 16, 64)  # pieces to either side of one that exceeds a limit
_EASINGS = 30


CurveFamily = Callable[[Array], PiecewisePolynomial]


def fastest_durations(
    family: CurveFamily, guess: Array, bounds: Array, further: Iterable[Array] = ()
) -> Array | None:
    """Return the durations (m,) of the pieces of the fastest curve of a family that keeps its limits.

    The optimum is a local one, looked for from the guess that is the fastest when stretched to keep the
    limits. None where no guess keeps them with any factor of time.

    Args:
        family: The curve from 0 whose pieces, or runs of pieces, last as long as asked, shape (m,).
        guess: Positive, shape (m,).
        bounds: Lower and upper limits of velocity, acceleration and jerk, shape (3, n, 2), infinite if none.
        further: Other guesses, which may exceed the limits in few places: these are passed more slowly.
    """
    eased = (_eased(family, durations, bounds, width) for durations in further for width in _WIDTHS)
    stretched = (_stretched(family, durations, bounds) for durations in (guess, *eased))
    start = min((h for h in stretched if h is not None), key=np.sum, default=None)
    if start is None or start.size == 1:
        return start
    problem, y = _Problem(family, bounds), np.log(start * _INSIDE)
    uses = problem.uses(y)
    point = _Point(y, uses, y, problem.slopes(y, uses))
    for cost, enough in _BARRIERS:
        point = _centred(problem, point, cost * float(start.mean()), enough)
    best = _stretched(family, np.exp(point.y), bounds)
    return best if best is not None and best.sum() < start.sum() else start


@frozen
class _Problem:
    """What is solved.

    Attributes:
        family: The curve from 0 whose pieces, or runs of pieces, last as long as asked.
        bounds: Shape (3, n, 2).
    """

    family: CurveFamily
    bounds: Array

    def uses(self, y: Array) -> Array:
        """Return c, the log of what each piece uses of those limits that count, shape (m, r)."""
        return np.maximum(_all_uses(self.family, np.exp(y), self.bounds), _HIDDEN)

    def slopes(self, y: Array, uses: Array) -> Array:
        """Return d c / d y, shape (m, r, window): entry w of piece k is about duration k - near + w."""
        pieces = np.arange(y.size)
        slopes = np.zeros((*uses.shape, _WINDOW))
        for colour in range(min(_WINDOW, y.size)):
            varied = y + _VARIED * (pieces % _WINDOW == colour)
            change = (self.uses(varied) - uses) / _VARIED
            entry = (colour - pieces + _NEAR) % _WINDOW
            owner = pieces - _NEAR + entry
            inside = (owner >= 0) & (owner < y.size)
            slopes[pieces[inside], :, entry[inside]] = change[inside]
        return slopes


@frozen
class _Point:
    """Durations, and what is known of the limits there.

    Attributes:
        y: Their logarithms, shape (m,).
        uses: c, shape (m, r).
        origin: Where the slopes are from, shape (m,).
        slopes: Shape (m, r, window).
    """

    y: Array
    uses: Array
    origin: Array
    slopes: Array

    def values(self, weight: float) -> Array:
        """Return each piece's part of what is minimised, shape (m,); infinite outside the limits."""
        with np.errstate(divide="ignore", invalid="ignore"):
            barriers = np.log(-self.uses).sum(axis=1)
        inside = self.uses.max(axis=1) < 0
        return np.where(inside, np.exp(self.y) - weight * np.where(inside, barriers, 0.0), np.inf)

    def step(self, weight: float) -> Array:
        """Return Newton's step, shape (m,), nowhere more of it than stays inside the limits by the slopes."""
        h, steep = np.exp(self.y), self.slopes / -self.uses[:, :, None]
        gradient = _scattered(weight * steep.sum(axis=1), h.size) + h
        curvature = weight * (steep.transpose(0, 2, 1) @ steep)
        step = -solve_block_tridiagonal(*_blocks(curvature, h), gradient)
        step = np.clip(step, -_LONGEST, _LONGEST)
        nearer = (steep @ _windows(step, 0.0)[:, :, None]).max(axis=(1, 2))  # 1: at the limits
        return np.asarray(step * _windows(_NEARER / np.maximum(nearer, _NEARER), 1.0).min(axis=1))


def _centred(problem: _Problem, point: _Point, weight: float, enough: float) -> _Point:
    """Return the minimiser of a barrier from a start inside the limits; a start outside comes back."""
    for _ in range(_STEPS):
        if np.abs(point.y - point.origin).max() > _FAR:
            point = _renewed(problem, point)
        exact, better, gain = point.origin is point.y, _improved(problem, point, weight), 0.0
        if better is not None:
            gain = float((point.values(weight) - better.values(weight)).sum() / np.exp(point.y).sum())
            point = better
        if gain < enough and exact:
            break
        if gain < enough:  # by slopes from far away
            point = _renewed(problem, point)
    return point


def _renewed(problem: _Problem, point: _Point) -> _Point:
    return _Point(point.y, point.uses, point.y, problem.slopes(point.y, point.uses))


def _improved(problem: _Problem, point: _Point, weight: float) -> _Point | None:
    """Return a point with a smaller value in about the direction of Newton's step, or None if there is none.

    The step is halved around those pieces where it makes things worse.
    """
    values = point.values(weight)
    if not np.isfinite(values).all():
        return None
    step = point.step(weight)
    for _ in range(_HALVINGS):
        y = point.y + step
        better = _Point(y, problem.uses(y), point.origin, point.slopes)
        gains = better.values(weight) - values
        if gains.sum() < 0:
            return better
        step = np.where(_windows(gains, 0.0).sum(axis=1) > 0, step / 2, step)
    return None


def _eased(family: CurveFamily, durations: Array, bounds: Array, width: int) -> Array:
    """Return the durations made longer around those pieces that exceed a limit, again and again."""
    orders = np.repeat(np.array(_orders(bounds), dtype=np.float64), bounds.shape[1])
    best, least = durations, np.inf
    for _ in range(_EASINGS):
        excess = np.maximum((_all_uses(family, durations, bounds) / orders).max(axis=1), 0.0)
        total = float(durations.sum() * np.exp(excess.max()))
        if total < least:
            best, least = durations, total
        if not excess.any():
            break
        for combine in (np.max, np.mean):
            around = np.pad(excess, width, mode="edge")
            excess = combine(np.lib.stride_tricks.sliding_window_view(around, 2 * width + 1), axis=1)
        durations = durations * np.exp(excess)
    return best


def _stretched(family: CurveFamily, durations: Array, bounds: Array) -> Array | None:
    """Return the durations times the smallest factor that keeps the limits."""
    orders = np.repeat(np.array(_orders(bounds), dtype=np.float64), bounds.shape[1])
    factor = float(np.exp((_all_uses(family, durations, bounds) / orders).max()))
    if factor == 0:
        return None
    if _excess(family, durations * factor, bounds) <= _ROOM:  # ends at rest: limits scale as powers of time
        return durations * factor * (1 + _ROOM)

    def excess(factors: Array) -> Array:
        return np.array([_excess(family, durations * f, bounds) for f in factors.tolist()]) - _ROOM

    least = smallest_feasible(excess, factor / 10, factor * _AMPLE, block=1)
    return None if least is None else durations * least


def _excess(family: CurveFamily, durations: Array, bounds: Array) -> float:
    """Return the log of the largest share of a limit that is used."""
    return float(_all_uses(family, durations, bounds).max())


def _orders(bounds: Array) -> list[int]:
    return [order for order in (1, 2, 3) if np.isfinite(bounds[order - 1]).any()] or [1]


def _all_uses(family: CurveFamily, durations: Array, bounds: Array) -> Array:
    """Return log of what each piece uses of each limit, shape (m, r); what it does not use is -inf."""
    curve = family(durations)
    begins = np.concatenate([[0.0], np.cumsum(durations)[:-1]]) + 0.25 * durations.min()
    owner = np.minimum(np.searchsorted(curve.breaks, begins, "right") - 1, curve.pieces - 1)
    first = np.maximum.accumulate(owner)
    first[0] = 0
    orders, parts = _orders(bounds), []
    extremes = piece_extremes(curve.coefficients, curve.lengths, orders)
    for order, (low, high) in zip(orders, extremes, strict=True):
        limits = bounds[order - 1]
        share = np.maximum(low / limits[:, 0], high / limits[:, 1])
        parts.append(np.maximum.reduceat(share, first, axis=0))
    with np.errstate(divide="ignore"):
        return np.asarray(np.log(np.maximum(np.concatenate(parts, axis=1), 0.0)))


def _windows(values: Array, filling: float) -> Array:
    """Return what stands around each of the values (m,), shape (m, window)."""
    return np.lib.stride_tricks.sliding_window_view(np.pad(values, _NEAR, constant_values=filling), _WINDOW)


def _scattered(values: Array, size: int) -> Array:
    """Return the sums over all windows, shape (size,), of values (m, window)."""
    total = np.zeros(size + 2 * _NEAR)
    for entry in range(_WINDOW):
        total[entry : entry + size] += values[:, entry]
    return total[_NEAR : _NEAR + size]


def _blocks(curvature: Array, diagonal: Array) -> tuple[Array, Array]:
    """Return the diagonal blocks (b, band, band) of the Hessian and those to their right (b - 1, ...)."""
    m = diagonal.size
    count = -(-m // _BAND)
    band = np.zeros((_BAND + 1, m + 2 * _NEAR))
    for v in range(_WINDOW):
        for w in range(v, _WINDOW):
            band[w - v, v : v + m] += curvature[:, v, w]
    band = np.pad(band[:, _NEAR : _NEAR + m], ((0, 0), (0, (count + 1) * _BAND - m)))
    band[0, :m] += diagonal
    band[0, m:] = 1.0
    rows = np.arange(count)[:, None, None] * _BAND + np.arange(_BAND)[:, None]
    ahead = np.arange(_BAND) - np.arange(_BAND)[:, None]
    upper = np.where(ahead >= 0, band[np.clip(ahead, 0, _BAND), rows], 0.0)
    inner = upper + np.swapaxes(np.where(ahead > 0, upper, 0.0), 1, 2)
    beyond = ahead + _BAND
    right = np.where(beyond <= _BAND, band[np.clip(beyond, 0, _BAND), rows], 0.0)
    return inner, right[:-1]


_FIRST = 24  # durations to begin with
_MORE = 3  # times as many in the next step
_POINTS = 3  # to each duration at least: below that the points' own durations do
_LEAST = 1e-9  # of the mean duration: pieces that a law passes backwards


@frozen
class DensePoints:
    """Points that are passed by a law of few durations.

    Attributes:
        family: The curve through the points whose pieces last as long as asked, shape (m,).
        parameter: u at the points, increasing, shape (m + 1,).
        bounds: Lower and upper limits of velocity, acceleration and jerk, shape (3, n, 2).
        slopes: du/dt at both ends; None where they are free.
    """

    family: CurveFamily
    parameter: Array
    bounds: Array
    slopes: tuple[float, float] | None = (0.0, 0.0)

    def durations(self, guess: Array) -> Array | None:
        """Return the durations of all pieces (m,) that were found, None where no law keeps the limits.

        Args:
            guess: Positive, shape (m,): what to begin with.
        """
        best: Array | None = None
        pieces, count = guess.size, _FIRST
        while count * _POINTS <= pieces:
            chosen = np.round(np.linspace(0, pieces, count + 1)).astype(np.intp)
            begin = guess if best is None else best
            coarse = np.add.reduceat(begin, chosen[:-1])
            found = fastest_durations(self._family_of(chosen), coarse, self.bounds)
            if found is not None:
                fine = self._passed(chosen, found)
                best = fine if best is None or fine.sum() < best.sum() else best
            count *= _MORE
        return best

    def _family_of(self, chosen: NDArray[np.intp]) -> CurveFamily:
        return lambda durations: self.family(self._passed(chosen, durations))

    def _passed(self, chosen: NDArray[np.intp], durations: Array) -> Array:
        """Return the durations of all pieces under the law with durations between the chosen points."""
        law = self._law(np.concatenate([[0.0], np.cumsum(durations)]), self.parameter[chosen])
        times = np.diff(times_at(law, self.parameter))
        return np.asarray(np.maximum(times, _LEAST * durations.sum() / times.size))

    def _law(self, times: Array, values: Array) -> PiecewisePolynomial:
        if self.slopes is None:
            return not_a_knot(times, values[:, None])
        first, last = (np.array([slope]) for slope in self.slopes)
        still = np.zeros(1)
        return continuous_acceleration(times, values[:, None], (first, last), (still, still), None)
