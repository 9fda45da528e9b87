"""Linear programmes over the segments of a list of points, by an interior-point method.

The unknowns are those of each joint at each inner point (x), and those that all joints of a segment share
(s). A row sees one segment and one joint: x at both ends, and s. Eliminating s leaves a system for x that is
block-tridiagonal by points, so that a step costs time in proportion to the number of segments.

Source: Mehrotra (1992); Nocedal and Wright (2006), chapter 14.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from trajcli.curves.linear_systems import cyclic_factors
from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen

_ENDS = 2  # unknowns of a joint at a point: velocity and acceleration
_STEP = 0.995  # of the way to where a slack or a multiplier becomes zero
_TINY = 1e-300
_SMALL = 1e-6  # the least scale by which a gap is judged
_KEPT = 1e-9  # a row missed by less is kept
_BEGIN = 1e-3  # of the scale: the least slack to begin with
_WHOLE = 150  # unknowns up to which a programme is one matrix
_STIFF = 1e14  # a larger ratio of multiplier and slack changes nothing


@frozen
class SegmentProgramme:
    """Minimise cost @ s + weight |y|^2 / 2 over y = (x, s) with low <= rows y <= high and s within bounds.

    Attributes:
        rows: Shape (K, n, R, 4 + m): columns for x at the point before and after, s. Columns of x that is
            fixed, as at both ends, are zero.
        low: Shape (K, n, R), finite.
        high: Shape (K, n, R), finite.
        cost: Shape (K, m).
        least: Lower bound of s, shape (K, m).
        upper_bound: Upper bound of s, shape (K, m).
        weight: Of the square; makes the answer unique.
    """

    rows: Array
    low: Array
    high: Array
    cost: Array
    least: Array
    upper_bound: Array
    weight: float = 1e-6

    def split(self, y: Array) -> tuple[Array, Array]:
        """Return x (K + 1, n, 2) and s (K, m)."""
        segments, joints = self.rows.shape[:2]
        last = y.size - self.cost.size
        return y[:last].reshape(segments + 1, joints, _ENDS), y[last:].reshape(self.cost.shape)

    @property
    def size(self) -> int:
        """How many unknowns there are, those at both ends counted."""
        segments, joints = self.rows.shape[:2]
        return int((segments + 1) * joints * _ENDS + self.cost.size)

    @cached_property
    def whole(self) -> Array | None:
        """The rows, then those of s, as one matrix for x at inner points and s; None of a large programme.

        Of some fifty unknowns the products of one matrix take less time than those of its blocks.
        """
        segments, joints, count = self.low.shape
        if self.size > _WHOLE:
            return None
        ends = np.zeros((segments, joints, count, segments + 1, joints, _ENDS))
        shared = np.zeros((segments, joints, count, *self.cost.shape))
        k, j = np.arange(segments)[:, None], np.arange(joints)
        ends[k, j, :, k, j] = self.rows[..., :_ENDS]
        ends[k, j, :, k + 1, j] = self.rows[..., _ENDS : 2 * _ENDS]
        shared[k, j, :, k] = self.rows[..., 2 * _ENDS :]
        above = np.concatenate(
            [ends[..., 1:-1, :, :].reshape(self.low.size, -1), shared.reshape(self.low.size, -1)], axis=1
        )
        below = np.zeros((self.cost.size, above.shape[1]))
        below[:, -self.cost.size :] = np.eye(self.cost.size)
        return np.concatenate([above, below])

    def inner(self, y: Array) -> Array:
        """Return x at inner points, and s, of unknowns y."""
        ends = self.rows.shape[1] * _ENDS
        return np.concatenate([y[ends : -ends - self.cost.size], y[-self.cost.size :]])

    def with_ends(self, inner: Array) -> Array:
        """Return unknowns y from x at inner points, and s; x at both ends is zero."""
        none = np.zeros(self.rows.shape[1] * _ENDS)
        return np.concatenate([none, inner[: -self.cost.size], none, inner[-self.cost.size :]])

    def apply(self, y: Array) -> Array:
        """Return the rows times y, then s, as one vector."""
        if self.whole is not None:
            return self.whole @ self.inner(y)
        x, s = self.split(y)
        segments, joints = self.rows.shape[:2]
        shared = np.broadcast_to(s[:, None], (segments, joints, s.shape[1]))
        local = np.concatenate([x[:-1], x[1:], shared], axis=2)
        return np.concatenate([(self.rows @ local[..., None])[..., 0].ravel(), s.ravel()])

    def adjoint(self, z: Array) -> Array:
        """Return the transposed rows times z, which has a number for each row and for each bound of s."""
        if self.whole is not None:
            return self.with_ends(z @ self.whole)
        at, count = self.cost.size, self.low.size
        local = (z[:count].reshape(self.low.shape)[..., None, :] @ self.rows)[..., 0, :]
        y = np.zeros(self.size)
        x, s = self.split(y)
        x[:-1] += local[..., :_ENDS]
        x[1:] += local[..., _ENDS : 2 * _ENDS]
        s += local[..., 2 * _ENDS :].sum(axis=1) + z[count : count + at].reshape(s.shape)
        return y


class _WholeNewton:
    """The matrix weight I + rows' D rows of a small programme."""

    def __init__(self, programme: SegmentProgramme, rows: Array, scale: Array) -> None:
        self._programme = programme
        self._matrix = rows.T @ (rows * scale[:, None])
        self._matrix.flat[:: len(self._matrix) + 1] += programme.weight

    def solve(self, right: Array) -> Array:
        programme = self._programme
        inner = np.asarray(np.linalg.solve(self._matrix, programme.inner(right)), dtype=np.float64)
        return programme.with_ends(inner)


class _Newton:
    """The matrix weight I + rows' D rows, factored."""

    def __init__(self, programme: SegmentProgramme, scale: Array) -> None:
        rows, weight = programme.rows, programme.weight
        segments, joints = rows.shape[:2]
        self._programme, self._sizes = programme, (segments, joints)
        local = scale[: programme.low.size].reshape(programme.low.shape)
        matrix = rows.swapaxes(2, 3) @ (rows * local[..., None])
        inner = 2 * _ENDS
        shared = matrix[:, :, inner:, inner:].sum(axis=1)
        m = shared.shape[1]
        shared[:, range(m), range(m)] += weight + scale[programme.low.size :].reshape(segments, m)
        self._s_inverse = np.linalg.inv(shared)
        self._coupling = matrix[:, :, :inner, inner:].reshape(segments, joints * inner, m)
        self._s_gain = self._coupling @ self._s_inverse
        self._factor(matrix[:, :, :inner, :inner])

    def _factor(self, ends: Array) -> None:
        """Assemble and factor the block-tridiagonal matrix of x at the inner points."""
        segments, joints = self._sizes
        size = joints * _ENDS
        blocks = np.zeros((segments, joints, 2 * _ENDS, joints, 2 * _ENDS))
        blocks[:, range(joints), :, range(joints), :] = ends.swapaxes(0, 1)
        lower = self._s_gain @ self._coupling.swapaxes(1, 2)
        blocks -= lower.reshape(blocks.shape)
        left, right = slice(0, _ENDS), slice(_ENDS, 2 * _ENDS)
        first = blocks[:, :, left, :, left].reshape(segments, size, size)
        last = blocks[:, :, right, :, right].reshape(segments, size, size)
        across = blocks[:, :, left, :, right].reshape(segments, size, size)
        diagonal = last[:-1] + first[1:]
        diagonal[:, range(size), range(size)] += self._programme.weight
        self._points = cyclic_factors(diagonal, across[1:-1])

    def solve(self, right: Array) -> Array:
        programme = self._programme
        segments, joints = self._sizes
        x, s = programme.split(right)
        ends = -(self._s_gain @ s[..., None]).reshape(segments, joints, 2 * _ENDS)
        unknowns = (x[1:-1] + ends[:-1, :, _ENDS:] + ends[1:, :, :_ENDS]).reshape(segments - 1, -1)
        x_answer = np.zeros((segments + 1, joints, _ENDS))
        x_answer[1:-1] = self._points.solve(unknowns).reshape(segments - 1, joints, _ENDS)
        both = np.concatenate([x_answer[:-1], x_answer[1:]], axis=2)
        along = (both.reshape(segments, 1, -1) @ self._coupling)[:, 0]
        s_answer = (self._s_inverse @ (s - along)[..., None])[..., 0]
        return np.concatenate([x_answer.ravel(), s_answer.ravel()])


def _newton(programme: SegmentProgramme, scale: Array) -> _Newton | _WholeNewton:
    whole = programme.whole
    return _Newton(programme, scale) if whole is None else _WholeNewton(programme, whole, scale)


def solved(programme: SegmentProgramme, scale: float, rounds: int = 30, exactness: float = 1e-7) -> Array:
    """Return y (size,) to which a fixed rule of steps leads; see `SegmentProgramme.split`.

    Where rows exclude each other, or rounding ends the method, it is what was reached.

    Args:
        programme: What to minimise; y = 0 keeps its rows, or nearly so.
        scale: What unknowns typically amount to: it sets where the method begins.
        rounds: The most steps.
        exactness: Relative: the duality gap at which it ends.
    """
    iterate = _Iterate(programme, scale)
    goal = exactness * iterate.total * max(scale, _SMALL)
    with np.errstate(all="ignore"):
        for _ in range(rounds):
            if iterate.gap <= goal and iterate.missed <= _KEPT:
                break
            try:
                advanced = iterate.advanced()
            except np.linalg.LinAlgError:
                break
            if not np.isfinite(advanced):
                break
    return iterate.y


class _Iterate:
    """Unknowns, slacks (lower, upper) and multipliers (lower, upper) of the method."""

    def __init__(self, programme: SegmentProgramme, scale: float) -> None:
        low = np.concatenate([programme.low.ravel(), programme.least.ravel()])
        high = np.concatenate([programme.high.ravel(), programme.upper_bound.ravel()])
        self._programme, self._bounds = programme, np.stack([low, -high])
        self._cost = np.zeros(programme.size)
        programme.split(self._cost)[1][:] = programme.cost
        self.total = float(np.abs(programme.cost).sum())
        self.y = np.zeros(programme.size)
        self._value = np.zeros(low.size)
        self._slack = np.maximum(-self._bounds, _BEGIN * scale)
        self._force = self.total * scale / low.size / self._slack

    @property
    def gap(self) -> float:
        """The sum of the products of slacks and multipliers."""
        return float((self._slack * self._force).sum())

    @property
    def _miss(self) -> Array:
        miss: Array = np.stack([self._value, -self._value]) - self._bounds - self._slack
        return miss

    @property
    def missed(self) -> float:
        """The largest amount by which a row and its slack disagree."""
        return float(np.abs(self._miss).max())

    def advanced(self) -> float:
        """Take one step of the predictor and the corrector; return the sum of what changed."""
        programme, slack, force, miss = self._programme, self._slack, self._force, self._miss
        pushed = programme.adjoint(force[0] - force[1])
        dual = self._cost + programme.weight * self.y - pushed
        newton = _newton(programme, np.minimum((force / slack).sum(axis=0), _STIFF))

        def change(wanted: Array | float) -> tuple[Array, Array, Array]:
            """Return the changes of y, slacks and multipliers for products that are wanted."""
            pull = (wanted - force * miss) / slack - force
            dy = newton.solve(programme.adjoint(pull[0] - pull[1]) - dual)
            along = programme.apply(dy)
            d_slack = np.stack([along, -along]) + miss
            return dy, d_slack, (wanted - force * d_slack) / slack - force

        _, d_slack, d_force = change(0.0)
        left = (slack + _length(slack, d_slack) * d_slack) * (force + _length(force, d_force) * d_force)
        count = slack.size
        centre = self.gap / count * (float(left.sum()) / self.gap) ** 3
        dy, d_slack, d_force = change(centre - d_slack * d_force)
        size = float(np.abs(dy).sum())
        if not np.isfinite(size):
            return size
        step = min(1.0, _STEP * _length(slack, d_slack))
        self.y = self.y + step * dy
        self._value = programme.apply(self.y)
        self._slack = slack + step * d_slack
        self._force = force + min(1.0, _STEP * _length(force, d_force)) * d_force
        return size


def _length(values: Array, changes: Array) -> float:
    """Return how far, at most 1, positive numbers may go along their changes."""
    worst = float((-changes / (values + _TINY)).max())
    return 1.0 if worst <= 1 else 1.0 / worst
