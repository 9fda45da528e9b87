"""Rows P x + R y <= C of the constraints over the intervals of a grid, where x and y are sd^2 at their ends.

A row a u + b x <= c times |a| is, integrated over an interval in which a keeps its sign, one about the change
of (a sd)^2: its rate is 2 a (a u + a' x). For the acceleration of a joint a = q' and b = q'', so that

    |q1'^2 y - q0'^2 x| <= 2 c |q1 - q0|,

the equation of work and energy, without any error: no motion passes the ends of the interval otherwise. Of
other constraints the integrals are trapezoids. Where a changes its sign the row holds at both ends with the
mean of sdd; where all a vanish at an end and nothing bounds x there, the interval is passed without sdd.

Source: Verscheure et al. (2009), for sd^2 as the variable; the rows by work and energy are our own.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.time_optimal.constraints import ConstraintRows, PathConstraint
from trajcli.frozen import frozen

_FLAT = 1e-9  # a coefficient this much smaller than its neighbour is zero: it shifts the bound by as little
_SMALL = 0.03  # of an integral up to a point: a difference as small is rounded
_FADING = 8  # grid points around an interval with lower limits: so far they grow back, by half at each


@frozen
class IntervalRows:
    """Rows of the N intervals of a grid, made of the k rows at their ends.

    Attributes:
        grid: Grid points, shape (N + 1,), strictly increasing.
        P: Shape (m, N).
        R: Shape (m, N).
        C: Shape (m, N).
        whole: C before any limit was lowered, shape (m, N).
        eased: By what each constraint's c are multiplied at the grid points, shape (constraints, N + 1).
        cap: Largest x at each grid point, shape (N + 1,).
        turning: At which it is that of a row whose a vanishes, shape (N + 1,).
        owners: Which constraint each row is of, shape (m,).
        sources: Of which of the k rows each is made, shape (m,).
        near: a, b and c at the near ends, each of shape (k, N).
        far: The same at the far ends.
    """

    grid: Array
    P: Array
    R: Array
    C: Array
    whole: Array
    eased: Array
    cap: Array
    turning: NDArray[np.bool_]
    owners: NDArray[np.intp]
    sources: NDArray[np.intp]
    near: tuple[Array, Array, Array]
    far: tuple[Array, Array, Array]

    @property
    def straight(self) -> NDArray[np.bool_]:
        """Which intervals have constant rows up to rounding, as on a straight line, shape (N,)."""
        return np.asarray((np.abs(self.P + self.R) <= _FLAT * np.abs(self.R)).all(axis=0))

    def tightened(self, velocity: Array, acceleration: Array) -> IntervalRows:
        """Return the intervals with caps and every c divided by factors of their own.

        Args:
            velocity: What speeds are divided by, shape (N,).
            acceleration: What the c of each of the constraints are divided by, shape (constraints, N).
        """
        less = _spread(acceleration, self.grid)
        cap, eased = self.cap / _spread(velocity[None], self.grid)[0] ** 2, self.eased / less
        cap[self.turning] /= less.max(axis=0)[self.turning]
        mean = 0.5 * (eased[:, 1:] + eased[:, :-1])
        return replace(self, C=self.whole * mean[self.owners], eased=eased, cap=cap)


def _spread(factors: Array, grid: Array) -> Array:
    """Return factors of intervals (k, N) at the grid points (k, N + 1), fading around those above one."""
    lengths, edge = np.diff(grid), np.ones((len(factors), 1))
    around = np.maximum(np.append(lengths[1:], 0.0), np.append(0.0, lengths[:-1]))
    fade = 0.5 ** (lengths / np.maximum(lengths, around))
    at = np.maximum(np.concatenate([edge, factors], axis=1), np.concatenate([factors, edge], axis=1)) - 1.0
    for _ in range(_FADING):
        at[:, 1:] = np.maximum(at[:, 1:], fade * at[:, :-1])
        at[:, :-1] = np.maximum(at[:, :-1], fade * at[:, 1:])
    return np.asarray(1.0 + at)


def interval_rows(grid: Array, constraints: Sequence[PathConstraint], stops: Array) -> IntervalRows:
    """Return the rows of all constraints over every interval.

    Args:
        grid: Grid points, shape (N + 1,), strictly increasing.
        constraints: At least one.
        stops: Grid points where x must be zero.
    """
    at_ends = [_at_ends(constraint, grid) for constraint in constraints]
    near_rows, far_rows = zip(*at_ends, strict=True)
    near, far, D = _coefficients_of(near_rows), _coefficients_of(far_rows), np.diff(grid)
    cap, turns = (np.append(each, np.inf) for each in (_cap(near_rows), _turning_cap(near, D)))
    cap[1:] = np.minimum(cap[1:], _cap(far_rows))
    turns[1:] = np.minimum(turns[1:], _turning_cap(far, D))
    cap[np.isin(grid, stops)] = 0.0
    turning, cap = turns < cap, np.minimum(cap, turns)
    owners = np.repeat(np.arange(len(near_rows)), [rows.a.shape[1] for rows in near_rows])
    parts = [_integrated(*ends, D) for ends in at_ends]
    P, R, C = (np.concatenate(part) for part in zip(*parts, strict=True))
    sources = np.arange(owners.size)
    turned = np.isnan(C)
    if turned.any():
        P, R, C, sources = _at_both_ends((P, R, C), near, far, D)
    for end, free in enumerate(_unbounded(near[0], far[0], cap)):
        if free.any():
            P, R, C, sources = _at_constant_speed((P, R, C, sources), (near, far)[1 - end], D, free, end)
    size_P, size_R = np.abs(P), np.abs(R)
    P[size_P <= _FLAT * size_R] = 0.0
    R[size_R <= _FLAT * size_P] = 0.0
    eased = np.ones((len(near_rows), grid.size))
    return IntervalRows(grid, P, R, C, C, eased, cap, turning, owners[sources], sources, near, far)


def _at_ends(constraint: PathConstraint, grid: Array) -> tuple[ConstraintRows, ConstraintRows]:
    """Return the rows at the near and at the far ends of the intervals of a grid.

    Where a constraint is about a path of the joints, both sides of a point say the same but at its breaks.
    """
    path = getattr(constraint, "path", None)
    if not isinstance(path, PiecewisePolynomial):
        return constraint.rows(grid[:-1], "right"), constraint.rows(grid[1:], "left")
    right, steps = constraint.rows(grid, "right"), np.flatnonzero(np.isin(grid[1:-1], path.breaks))
    left = constraint.rows(grid[1 + steps], "left") if steps.size else right
    near, far = {}, {}
    for name in ConstraintRows.__match_args__:
        if (values := getattr(right, name)) is not None:
            near[name], far[name], at_breaks = values[:-1], values[1:], getattr(left, name)
            if steps.size and not np.array_equal(far[name][steps], at_breaks):
                far[name] = far[name].copy(order="K")
                far[name][steps] = at_breaks
    return ConstraintRows(**near), ConstraintRows(**far)


def _integrated(near: ConstraintRows, far: ConstraintRows, D: Array) -> tuple[Array, Array, Array]:
    """Return P, R and C of the k rows times |a|, integrated, each (k, N); C is NaN where a changes its sign.

    Where the integrals of c a are not known the others are trapezoids.
    """
    a0, a1 = near.a.T, far.a.T
    sign = np.sign(a0 + a1)
    if near.work is not None and far.work is not None:
        works = _works(near, far, near.work.T, far.work.T, D)
        return sign * a0 * -a0, sign * a1 * a1, np.maximum(sign * (2.0 * works), 0.0)
    with np.errstate(invalid="ignore"):
        C = sign * (D * (a0 * near.c.T + a1 * far.c.T))
    same = a0 * a1 >= -_FLAT * np.maximum(a0**2, a1**2)
    C = np.where(same, np.where(np.isnan(C), np.inf, np.maximum(C, 0.0)), np.nan)
    return sign * a0 * (near.b.T * D - a1), sign * a1 * (far.b.T * D + a0), C


def _works(near: ConstraintRows, far: ConstraintRows, start: Array, end: Array, D: Array) -> Array:
    """Return the integrals of c a over the intervals (k, N) from their antiderivatives at both ends (k, N).

    Where they are small against what they are the difference of, the trapezoidal rule with end correction,
    which is exact up to the third degree of a, is free of its rounding.
    """
    found, sizes = end - start, _SMALL * np.maximum(np.abs(end), np.abs(start))
    rule = 0.5 * D * (near.a + far.a).T - D**2 / 12.0 * (far.b - near.b).T
    return np.where(np.abs(found) > sizes, found, near.c.T * rule)


def _at_both_ends(
    rows: tuple[Array, Array, Array],
    near: tuple[Array, Array, Array],
    far: tuple[Array, Array, Array],
    D: Array,
) -> tuple[Array, Array, Array, NDArray[np.intp]]:
    """Return P, R and C with rows at both ends, of the mean sdd, where C is NaN; and what each is made of."""
    P, R, C = rows
    (a0, b0, c0), (a1, b1, c1), turned = near, far, np.isnan(C)
    P, R = np.where(turned, 2.0 * D * b0 - a0, P), np.where(turned, a0, R)
    more = np.flatnonzero(turned.any(axis=1))
    a, b, c, also = a1[more], b1[more], c1[more], turned[more]
    return (
        np.concatenate([P, np.where(also, -a, 0.0)]),
        np.concatenate([R, np.where(also, 2.0 * D * b + a, 0.0)]),
        np.concatenate([np.where(turned, 2.0 * D * c0, C), np.where(also, 2.0 * D * c, 1.0)]),
        np.concatenate([np.arange(len(P)), more]),
    )


def _unbounded(a0: Array, a1: Array, cap: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
    """Return at whose near, and at whose far end all a vanish and nothing bounds x, each (N,)."""
    size_0, size_1 = np.abs(a0).max(axis=0, initial=0.0), np.abs(a1).max(axis=0, initial=0.0)
    free = np.isinf(cap)
    moves = np.maximum(size_0, size_1) > 0.0
    return moves & (size_0 <= _FLAT * size_1) & free[:-1], moves & (size_1 <= _FLAT * size_0) & free[1:]


def _at_constant_speed(
    rows: tuple[Array, Array, Array, NDArray[np.intp]],
    other: tuple[Array, Array, Array],
    D: Array,
    free: NDArray[np.bool_],
    end: int,
) -> tuple[Array, Array, Array, NDArray[np.intp]]:
    """Return rows by which intervals with an unbounded end are passed without sdd."""
    P, R, C, sources = rows
    held, none = 2.0 * D * other[1][sources], np.zeros_like(P)
    P, R = (np.where(free, each, was) for each, was in zip((none, held)[:: 1 - 2 * end], (P, R), strict=True))
    C = np.where(free, 2.0 * D * other[2][sources], C)
    faster = np.where(free, 1.0 - 2.0 * end, 0.0)
    return (
        np.concatenate([P, faster[None]]),
        np.concatenate([R, -faster[None]]),
        np.concatenate([C, np.where(free, 0.0, 1.0)[None]]),
        np.append(sources, 0),
    )


def _cap(all_rows: Sequence[ConstraintRows]) -> Array:
    """Return the lowest caps, shape (N,)."""
    return np.asarray(np.fmin.reduce([rows.cap for rows in all_rows]))


def _turning_cap(rows: tuple[Array, Array, Array], D: Array) -> Array:
    """Return the lowest x of rows whose a vanishes, shape (N,)."""
    a, b, c = rows
    with np.errstate(divide="ignore", invalid="ignore"):
        bounds = np.where((b > 0) & (np.abs(a) <= _FLAT * 2.0 * D * b), c / b, np.inf)
    return np.asarray(bounds.min(axis=0, initial=np.inf))


def _coefficients_of(all_rows: Sequence[ConstraintRows]) -> tuple[Array, Array, Array]:
    """Return a, b and c of all rows, each of shape (k, N)."""
    a, b, c = (np.concatenate([getattr(rows, name).T for rows in all_rows]) for name in "abc")
    return a, b, c
