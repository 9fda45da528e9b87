"""Tridiagonal systems, of numbers and of square blocks, in linear time.

The splines of this package lead to rows whose diagonal is larger than the sum of its neighbours; elimination
without exchanges is then stable, whatever the ratio of the lengths between waypoints. The precondition is
checked. Systems of blocks are symmetric and positive definite.

Long systems are halved until they are short: every other unknown is eliminated at once, which leaves rows of
the same kind, as dominated by their diagonal. Sweeps over a short one run over plain floats, faster than
arrays for few components, and the same to the last bit on every machine.

Source: Golub and Van Loan, Matrix Computations, 4th edition (2013), sections 4.1, 4.3 and 4.5 (cyclic
reduction); Higham, Accuracy and Stability of Numerical Algorithms, 2nd edition (2002), section 9.6.
"""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen

_SHORT = 48  # unknowns: fewer are not worth halving
_DENSE = 64  # unknowns: fewer are solved by their inverse
_ROUNDING = 8 * np.finfo(np.float64).eps  # of a diagonal element: what forming a row may have cost


def solve_tridiagonal(lower: Array, diagonal: Array, upper: Array, right: Array) -> Array:
    """Return x, shape (m, n), with lower[k] x[k-1] + diagonal[k] x[k] + upper[k] x[k+1] = right[k].

    Args:
        lower: Shape (m,); the first element is not used.
        diagonal: Shape (m,), positive.
        upper: Shape (m,); the last element is not used.
        right: Shape (m, n).

    Raises:
        ValueError: When a diagonal element is not positive, or smaller than its two neighbours together.
    """
    beside = np.abs(upper)
    beside[-1] = 0.0
    beside[1:] += np.abs(lower[1:])
    dominant = (diagonal > 0) & (beside <= diagonal * (1 + _ROUNDING))
    if not dominant.all():
        k = int(np.argmin(dominant))
        raise ValueError(
            f"row {k} of the system has diagonal {float(diagonal[k])!r}, which is less than "
            f"its neighbours together, {float(beside[k])!r}, or not positive"
        )
    columns = np.ascontiguousarray(right.T)
    solution = _cyclic_reduction(lower, diagonal, upper, columns)
    if diagonal.size > _SHORT:  # halving loses a digit in rows of mixed sizes: the residual gives it back
        residual = columns - diagonal * solution
        residual[:, 1:] -= lower[1:] * solution[:, :-1]
        residual[:, :-1] -= upper[:-1] * solution[:, 1:]
        solution += _cyclic_reduction(lower, diagonal, upper, residual)
    return np.ascontiguousarray(solution.T)


def solve_block_tridiagonal(diagonal: Array, right: Array, values: Array) -> Array:
    """Return x, shape (m,), of the symmetric positive definite system A x = values.

    Every other block is eliminated, which leaves a system of the same kind with half the blocks.

    Args:
        diagonal: Blocks A[i, i], shape (b, k, k).
        right: Blocks A[i, i + 1], shape (b - 1, k, k).
        values: Shape (m,), m <= b k; what is missing is zero.
    """
    blocks, size = diagonal.shape[:2]
    padded = np.zeros(blocks * size)
    padded[: values.size] = values
    return cyclic_factors(diagonal, right).solve(padded.reshape(blocks, size)).reshape(-1)[: values.size]


def _cyclic_reduction(lower: Array, diagonal: Array, upper: Array, right: Array) -> Array:
    """Return the solution (n, m) for right sides (n, m)."""
    m = diagonal.size
    if m <= _SHORT:
        factors, pivots = _factors(lower.tolist(), diagonal.tolist(), upper.tolist())
        above = upper.tolist()
        return np.array([_solution(factors, pivots, above, column) for column in right.tolist()])
    pairs, links = m // 2, (m - 1) // 2  # odd unknowns, and those of them that have one after them
    odd_lower, odd_upper = lower[1::2] / diagonal[1::2], upper[1::2] / diagonal[1::2]
    odd_right = right[:, 1::2] / diagonal[1::2]
    after, before = upper[0 : 2 * pairs : 2], lower[2::2]
    kept, others = diagonal[0::2].copy(), right[:, 0::2].copy()
    kept[:pairs] -= after * odd_lower
    kept[1:] -= before * odd_upper[:links]
    others[:, :pairs] -= after * odd_right
    others[:, 1:] -= before * odd_right[:, :links]
    beyond, back = np.zeros(kept.size), np.zeros(kept.size)
    beyond[:links] = -after[:links] * odd_upper[:links]
    back[1:] = -before * odd_lower[:links]
    even = _cyclic_reduction(back, kept, beyond, others)
    solution = np.empty_like(right)
    solution[:, 0::2] = even
    odd_right -= odd_lower * even[:, :pairs]
    odd_right[:, :links] -= odd_upper[:links] * even[:, 1 : links + 1]
    solution[:, 1::2] = odd_right
    return solution


def _factors(
    lower: list[float], diagonal: list[float], upper: list[float]
) -> tuple[list[float], list[float]]:
    """Return by how much each row is subtracted from the next one, and the pivots that remain."""
    factors, pivots = [0.0], [diagonal[0]]
    pivot = diagonal[0]
    for k in range(1, len(diagonal)):
        factor = lower[k] / pivot
        pivot = diagonal[k] - factor * upper[k - 1]
        factors.append(factor)
        pivots.append(pivot)
    return factors, pivots


def _solution(
    factors: list[float], pivots: list[float], upper: list[float], right: list[float]
) -> list[float]:
    """Return the solution of a factored system, in place of its right side."""
    x = right
    value = x[0]
    for k in range(1, len(x)):
        value = x[k] - factors[k] * value
        x[k] = value
    value = x[-1] / pivots[-1]
    x[-1] = value
    for k in range(len(x) - 2, -1, -1):
        value = (x[k] - upper[k] * value) / pivots[k]
        x[k] = value
    return x


@frozen
class _Level:
    """What eliminating every other block leaves behind.

    Attributes:
        inverse: Of the odd blocks, shape (i, k, k).
        before: From each even block to the odd one after it, shape (i, k, k).
        after: From each odd block to the even one after it, shape (j, k, k).
        down: before times inverse, shape (i, k, k).
        up: Transposed after times inverse, shape (j, k, k).
    """

    inverse: Array
    before: Array
    after: Array
    down: Array
    up: Array


@frozen
class CyclicFactors:
    """A symmetric matrix of blocks beside its diagonal, factored for any number of right sides.

    Attributes:
        levels: From the finest on.
        last: Inverse of what the last level leaves, shape (m k, m k).
    """

    levels: tuple[_Level, ...]
    last: Array

    def solve(self, values: Array) -> Array:
        """Return x, shape (b, k), with A x = values, shape (b, k)."""
        return self._solved(values[..., None], 0)[..., 0]

    def _solved(self, right: Array, depth: int) -> Array:
        """Return the solution (b, k, 1) from one level on."""
        if depth == len(self.levels):
            return (self.last @ right.ravel()).reshape(right.shape)
        level = self.levels[depth]
        count, links = len(level.before), len(level.after)
        odd, even = right[1::2], right[0::2].copy()
        even[:count] -= level.down @ odd
        even[1 : 1 + links] -= level.up @ odd[:links]
        even = self._solved(even, depth + 1)
        odd = odd - np.swapaxes(level.before, 1, 2) @ even[:count]
        odd[:links] -= level.after @ even[1 : 1 + links]
        result = np.empty_like(right)
        result[0::2], result[1::2] = even, level.inverse @ odd
        return result


def cyclic_factors(diagonal: Array, right: Array) -> CyclicFactors:
    """Return the factors of a symmetric matrix.

    Args:
        diagonal: Blocks A[i, i], shape (b, k, k).
        right: Blocks A[i, i + 1], shape (b - 1, k, k).

    Raises:
        LinAlgError: When a block that is eliminated is singular.
    """
    blocks, links, levels = diagonal, right, []
    while len(blocks) > 1 and blocks.shape[0] * blocks.shape[1] > _DENSE:
        inverse, before, after = _inverse(blocks[1::2]), links[0::2], links[1::2]
        down, up = before @ inverse, np.swapaxes(after, 1, 2) @ inverse[: len(after)]
        kept = blocks[0::2].copy()
        kept[: len(before)] -= down @ np.swapaxes(before, 1, 2)
        kept[1 : 1 + len(after)] -= up @ after
        levels.append(_Level(inverse, before, after, down, up))
        blocks, links = kept, -(down[: len(after)] @ after)
    return CyclicFactors(tuple(levels), _inverse(_whole(blocks, links)))


def _whole(blocks: Array, links: Array) -> Array:
    """Return the matrix (b k, b k) of blocks (b, k, k) on its diagonal and links (b - 1, k, k) beside it."""
    count, size, _ = blocks.shape
    whole, at = np.zeros((count, size, count, size)), np.arange(count)
    whole[at, :, at] = blocks
    whole[at[:-1], :, at[1:]] = links
    whole[at[1:], :, at[:-1]] = np.swapaxes(links, 1, 2)
    return whole.reshape(count * size, count * size)


@frozen
class BlockFactors:
    """The factored matrix.

    Attributes:
        diagonal: Its blocks A[i, i], shape (b, 2, 2).
        right: Its blocks A[i, i + 1], shape (b - 1, 2, 2).
        pairs: Of its blocks, two by two.
    """

    diagonal: Array
    right: Array
    pairs: CyclicFactors

    def solve(self, values: Array) -> Array:
        """Return x, shape (b, 2), with A x = values, shape (b, 2), refined by its residual."""
        x = self._solution(values)
        residual = values - _applied(self.diagonal, x)
        residual[:-1] -= _applied(self.right, x[1:])
        residual[1:] -= _applied(np.swapaxes(self.right, 1, 2), x[:-1])
        return np.asarray(x + self._solution(residual))

    def _solution(self, values: Array) -> Array:
        blocks = len(values)
        joined = np.zeros((2 * ((blocks + 1) // 2), 2))
        joined[:blocks] = values
        return self.pairs.solve(joined.reshape(-1, 4)).reshape(-1, 2)[:blocks]


def block_factors(diagonal: Array, right: Array) -> BlockFactors:
    """Return the factors of a matrix.

    Args:
        diagonal: Blocks A[i, i], shape (b, 2, 2).
        right: Blocks A[i, i + 1], shape (b - 1, 2, 2).
    """
    return BlockFactors(diagonal, right, cyclic_factors(*_paired(diagonal, right)))


def _paired(diagonal: Array, right: Array) -> tuple[Array, Array]:
    """Return it as blocks of shape (4, 4); a missing last one is the identity."""
    size, pairs = len(diagonal), (len(diagonal) + 1) // 2
    blocks, links = np.tile(np.eye(4), (pairs, 1, 1)), np.zeros((pairs - 1, 4, 4))
    blocks[:, :2, :2] = diagonal[0::2]
    blocks[: size // 2, 2:, 2:] = diagonal[1::2]
    within = right[0::2]
    blocks[: size // 2, :2, 2:], blocks[: size // 2, 2:, :2] = within, np.swapaxes(within, 1, 2)
    links[:, 2:, :2] = right[1::2]
    return blocks, links


def _applied(blocks: Array, x: Array) -> Array:
    """Return the products (b, 2) of blocks (b, 2, 2) and vectors (b, 2)."""
    return np.asarray((blocks @ x[:, :, None])[:, :, 0])


def _inverse(blocks: Array) -> Array:
    return np.asarray(np.linalg.inv(blocks), dtype=np.float64)
