"""The linear system of a step of a motion with free knots, and derivatives of distances from limits in it.

Of the system the unknowns of each segment and joint are eliminated first, then the durations of each segment;
what is left, velocities and accelerations at points, is block-tridiagonal, so that a step costs time in
proportion to the number of segments.

Source: Nocedal and Wright (2006), chapters 16 and 19.
"""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.planners.fastest_through_points.free_knots.knot_motion import (
    ENDS,
    LANDINGS,
    Change,
    KnotMotion,
    KnotProblem,
    Walk,
)

_TINY = 1e-8  # added to the diagonal of what is eliminated
_POSITIONS = 8  # where the distances of positions begin, in `Walk.spare`


class Slopes:
    """Derivatives of what `Walk` holds, by the columns of `Change.local`.

    Attributes:
        rows: Of velocities, of their middle Bezier points, of positions where they have limits, and of the
            landing, shape (K, n, R, C).
    """

    def __init__(self, problem: KnotProblem, motion: KnotMotion, walk: Walk) -> None:
        self._walk, self._h, self._bend = walk, motion.lengths, problem.bend[:, None]
        self._steep = (problem.bend / problem.jerk)[:, None]
        self._free, self._walled = problem.free, problem.spare is not None
        bends, lengths, speeds = self._parts()
        joints, count = problem.steps.shape[1], motion.lengths.shape[1]
        first, free = bends[:, None] * self._bend[:, None], problem.free.astype(np.float64)
        rows = np.zeros((len(bends), joints, bends.shape[1], 2 * count + 3))
        rows[..., : count - 1] = first[..., 1:-1]
        rows[..., count - 1] = speeds[:, None] * free[:-1, :, :1]
        rows[..., count] = first[..., 0] * free[:-1, :, 1:]
        rows[..., -LANDINGS, count + 1] = -free[1:, :, 0]
        rows[..., count + 2] = first[..., -1] * free[1:, :, 1:]
        rows[..., count + 3 :] = lengths
        self.rows = rows

    def _parts(self) -> tuple[Array, Array, Array]:
        """Return rows by accelerations (K, R, M + 1), durations (K, n, R, M) and velocity (K, R)."""
        h, walk, a = self._h, self._walk, self._walk.accelerations
        segments, count = h.shape
        each, below = np.arange(count), np.tril(np.ones((count, count)))
        v_bends = np.zeros((segments, count, count + 1))
        v_bends[:, each, each] = v_bends[:, each, each + 1] = 0.5 * h
        v_bends = np.cumsum(v_bends, axis=1)
        v_lengths = walk.means[:, :, None] * below
        m_bends, m_lengths = np.zeros_like(v_bends), np.zeros_like(v_lengths)
        m_bends[:, 1:], m_lengths[:, :, 1:] = v_bends[:, :-1], v_lengths[:, :, :-1]
        m_bends[:, each, each] += 0.5 * h
        m_lengths[:, :, each, each] += 0.5 * a[..., :-1]
        passed = np.cumsum(h, axis=1)
        after, wide = (passed[:, :, None] - passed[:, None]) * below, h[:, None] * below
        p_bends = np.zeros_like(v_bends)
        p_bends[..., :-1] += wide * (0.5 * after + h[:, None] / 3)
        p_bends[..., 1:] += wide * (0.5 * after + h[:, None] / 6)
        rate = walk.speeds[..., :-1] + h[:, None] * (2 * a[..., :-1] + a[..., 1:]) / 3
        p_lengths = rate[:, :, None] * below + walk.means[:, :, None] * after[:, None]
        bends, lengths = [v_bends, m_bends, p_bends], [v_lengths, m_lengths, p_lengths]
        speeds, kept = [np.ones_like(h), np.ones_like(h), passed], 3 if self._walled else 2
        bends = [*bends[:kept], v_bends[:, -1:], p_bends[:, -1:]]
        lengths = [*lengths[:kept], v_lengths[:, :, -1:], p_lengths[:, :, -1:]]
        speeds = [*speeds[:kept], np.ones_like(h[:, -1:]), passed[:, -1:]]
        return np.concatenate(bends, axis=1), np.concatenate(lengths, axis=2), np.concatenate(speeds, axis=1)

    def apply(self, change: Change) -> Array:
        """Return the changes of `Walk.spare`."""
        along = (self.rows @ change.local()[..., None])[..., 0]
        count = self._h.shape[1]
        ends = change.ends[..., 1:]
        bends = np.concatenate([ends[:-1], change.bends, ends[1:]], axis=2)
        bent, longer = np.diff(bends, axis=2) * self._steep, change.lengths[:, None]
        v, middle, a = along[..., :count], along[..., count : 2 * count], bends[..., 1:]
        rows = [v, -v, middle, -middle, a, -a, longer + bent, longer - bent]
        if self._walled:
            position = along[..., 2 * count : 3 * count]
            rows += [position, -position]
        return np.stack(rows)

    def adjoint(self, forces: Array, landing: Array) -> Array:
        """Return the columns (K, n, C) of forces on `Walk.spare`, and on `Walk.landing`."""
        count = self._h.shape[1]
        pairs = forces[::2] - forces[1::2]
        kinds = [pairs[0], pairs[1], *pairs[_POSITIONS // 2 :], landing]
        columns: Array = (np.concatenate(kinds, axis=2)[..., None, :] @ self.rows)[..., 0, :]
        bends = np.zeros(self._walk.accelerations.shape)
        bends[..., 1:] = pairs[2] + pairs[3] * self._steep
        bends[..., :-1] -= pairs[3] * self._steep
        columns[..., self._bend_columns(count)] += bends * self._unknown
        columns[..., count + 3 :] += forces[6] + forces[7]
        return columns

    @staticmethod
    def _bend_columns(count: int) -> Array:
        """Return where the accelerations of all knots stand among the columns."""
        return np.concatenate([[count], np.arange(count - 1), [count + 2]])

    @property
    def _unknown(self) -> Array:
        """One for each acceleration that is unknown, else zero, shape (K, n, M + 1)."""
        unknown = np.ones(self._walk.accelerations.shape)
        unknown[..., 0], unknown[..., -1] = self._free[:-1, :, 1], self._free[1:, :, 1]
        return unknown

    def stiffness(self, weights: Array) -> Array:
        """Return the matrices (K, n, C, C) of the squares of `Walk.spare`'s changes with such weights."""
        rows = self.rows[:, :, :-LANDINGS]
        pairs = weights[::2] + weights[1::2]
        kinds = np.concatenate([pairs[0], pairs[1], *pairs[_POSITIONS // 2 :]], axis=2)
        matrix: Array = rows.swapaxes(2, 3) @ (rows * kinds[..., None])
        count, unknown = self._h.shape[1], self._unknown
        at, lengths = self._bend_columns(count), np.arange(count + 3, 2 * count + 3)
        square, both = pairs[3] * self._steep**2, (weights[6] - weights[7]) * self._steep
        diagonal = np.zeros(unknown.shape)
        diagonal[..., 1:] += pairs[2] + square
        diagonal[..., :-1] += square
        matrix[:, :, at, at] += diagonal * unknown
        beside = [(at[1:], at[:-1], -square * unknown[..., 1:] * unknown[..., :-1])]
        beside += [(at[1:], lengths, both * unknown[..., 1:]), (at[:-1], lengths, -both * unknown[..., :-1])]
        for row, column, value in beside:
            matrix[:, :, row, column] += value
            matrix[:, :, column, row] += value
        matrix[:, :, lengths, lengths] += pairs[3]
        return matrix

    def bending(self, forces: Array, landing: Array) -> Array:
        """Return second derivatives (K, n, C, C) of sums of `Walk.spare` and `Walk.landing` times these."""
        h, walk, a = self._h[:, None], self._walk, self._walk.accelerations
        count = self._h.shape[1]
        pairs = forces[::2] - forces[1::2]
        v, p = pairs[0].copy(), np.zeros_like(pairs[0]) if not self._walled else pairs[4].copy()
        v[..., -1] += landing[..., 0]
        p[..., -1] += landing[..., 1]
        v, p = _from_here_on(v), _from_here_on(p)
        v[..., :-1] += _from_here_on(pairs[1])[..., 1:]
        late = _from_here_on(h * p) - h * p
        each = np.arange(count)
        above = np.triu(np.ones((count, count)), 1)
        beside = 0.5 * h[..., None] * p[..., None, :] * above
        bends = np.zeros((*a.shape, count))
        bends[:, :, :-1] += beside
        bends[:, :, 1:] += beside
        bends[:, :, each, each] += 0.5 * (v + pairs[1] + late) + p * h * (2 / 3)
        bends[:, :, each + 1, each] += 0.5 * (v + late) + p * h / 3
        own = above * walk.means[..., None] * p[..., None, :]
        own += own.swapaxes(2, 3)
        own[:, :, each, each] += p * (2 * a[..., :-1] + a[..., 1:]) / 3
        matrix = np.zeros((*a.shape[:2], 2 * count + 3, 2 * count + 3))
        lengths = slice(count + 3, None)
        matrix[:, :, self._bend_columns(count), lengths] = bends * (self._bend * self._unknown)[..., None]
        matrix[:, :, count - 1, lengths] = p * self._free[:-1, :, :1]
        matrix[:, :, lengths, : count + 3] = matrix[:, :, : count + 3, lengths].swapaxes(2, 3)
        matrix[:, :, lengths, lengths] = own
        return matrix


def _from_here_on(values: Array) -> Array:
    """Return the sums of values (..., M) from each on."""
    return np.cumsum(values[..., ::-1], axis=-1)[..., ::-1].copy()


class KnotSystem:
    """Matrix of a step, of which what each segment and joint has alone is eliminated."""

    def __init__(self, problem: KnotProblem, matrix: Array, landing: Array, shared: Array) -> None:
        """Eliminate what segments and joints have alone.

        Args:
            problem: What the unknowns belong to.
            matrix: Shape (K, n, C, C), by the columns of `Change.local`.
            landing: Rows (K, n, 2, C) that must be met.
            shared: Added to the diagonal of the durations, then to all of them together, shape (K, M + 1).
        """
        segments, joints, size = matrix.shape[:3]
        self._free, self._sizes = problem.free, (segments, joints)
        own = size - ENDS - shared.shape[1] + 1 + LANDINGS
        whole = np.zeros((segments, joints, size + LANDINGS, size + LANDINGS))
        whole[..., LANDINGS:, LANDINGS:] = matrix
        whole[..., :LANDINGS, LANDINGS:] = landing
        whole[..., LANDINGS:, :LANDINGS] = landing.swapaxes(2, 3)
        at = np.arange(own)
        whole[..., at, at] += np.where(at < LANDINGS, -_TINY / 10, _TINY)
        self.inverse = np.linalg.inv(whole[..., :own, :own])
        across = whole[..., :own, own:]
        self._gain = self.inverse @ across
        left = whole[..., own:, own:] - across.swapaxes(2, 3) @ self._gain
        lengths = left[..., ENDS:, ENDS:].sum(axis=1) + shared[:, -1, None, None]
        lengths += shared[:, :-1, None] * np.eye(lengths.shape[1])
        self._values, self._vectors = np.linalg.eigh(lengths)
        self._coupling = left[..., :ENDS, ENDS:].reshape(segments, joints * ENDS, -1)
        self._ends = left[..., :ENDS, :ENDS]

    def factor(self, least: float) -> bool:
        """Eliminate the durations, whose curvatures are made positive and at least so large.

        Returns:
            Whether the matrix of what remains is positive, so that the step goes down.
        """
        segments, joints = self._sizes
        vectors, size = self._vectors, 2 * joints
        values = np.maximum(np.abs(self._values), least)
        self._lengths_inverse = (vectors / values[:, None]) @ vectors.swapaxes(1, 2)
        self._lengths_gain = self._coupling @ self._lengths_inverse
        blocks = -(self._lengths_gain @ self._coupling.swapaxes(1, 2))
        blocks = blocks.reshape(segments, joints, ENDS, joints, ENDS)
        blocks[:, range(joints), :, range(joints), :] += self._ends.swapaxes(0, 1)
        shape = (segments, size, size)
        first, last = blocks[:, :, :2, :, :2].reshape(shape), blocks[:, :, 2:, :, 2:].reshape(shape)
        diagonal = last[:-1] + first[1:]
        fixed = ~self._free[1:-1].reshape(segments - 1, size)
        diagonal[:, range(size), range(size)] += np.where(fixed, 1.0, _TINY)
        self._across = blocks[:, :, :2, :, 2:].reshape(shape)[1:-1]
        self._inverses: list[Array] = []
        for k, block in enumerate(diagonal):
            if k:
                block -= self._across[k - 1].T @ self._inverses[-1] @ self._across[k - 1]
            try:
                np.linalg.cholesky(block)
            except np.linalg.LinAlgError:
                return False
            self._inverses.append(np.linalg.inv(block))
        return True

    def solve(self, landing: Array, columns: Array, lengths: Array) -> tuple[Change, Array]:
        """Return the change, and that of the multipliers of the landing (K, n, 2).

        Args:
            landing: Right side of the landing, shape (K, n, 2).
            columns: Right side of each segment and joint, shape (K, n, C); that of lengths is added up.
            lengths: Right side of the durations beside that, shape (K, M).
        """
        segments, joints = self._sizes
        own = self.inverse.shape[2]
        right = np.concatenate([landing, columns], axis=2)
        alone = right[..., :own, None]
        left = right[..., own:] - (self._gain.swapaxes(2, 3) @ alone)[..., 0]
        duration = left[..., ENDS:].sum(axis=1) + lengths
        ends = left[..., :ENDS] - (self._lengths_gain @ duration[..., None]).reshape(segments, joints, ENDS)
        x = np.zeros((segments + 1, joints, 2))
        between = (ends[:-1, :, 2:] + ends[1:, :, :2]) * self._free[1:-1]
        x[1:-1] = self._points(between.reshape(segments - 1, -1)).reshape(between.shape)
        both = np.concatenate([x[:-1], x[1:]], axis=2)
        along = (both.reshape(segments, 1, -1) @ self._coupling)[:, 0]
        h = (self._lengths_inverse @ (duration - along)[..., None])[..., 0]
        shared = np.broadcast_to(h[:, None], (segments, joints, h.shape[1]))
        others = np.concatenate([both, shared], axis=2)[..., None]
        u = (self.inverse @ alone - self._gain @ others)[..., 0]
        return Change(h, x, u[..., LANDINGS:]), u[..., :LANDINGS]

    def _points(self, constants: Array) -> Array:
        """Return the solution (K - 1, 2 n) of the block-tridiagonal system."""
        rows = [constants[0]]
        for k in range(1, len(constants)):
            rows.append(constants[k] - self._across[k - 1].T @ (self._inverses[k - 1] @ rows[-1]))
        for k in range(len(constants) - 1, -1, -1):
            right = rows[k] - self._across[k] @ rows[k + 1] if k + 1 < len(constants) else rows[k]
            rows[k] = self._inverses[k] @ right
        return np.array(rows)
