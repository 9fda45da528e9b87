"""Positive definite systems of square blocks on three diagonals, in linear time."""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array


def solve_block_tridiagonal(diagonal: Array, right: Array, values: Array) -> Array:
    """Return x, shape (m,), of the symmetric positive definite system A x = values.

    Every other block is eliminated, which leaves a system of the same kind with half the blocks.

    Args:
        diagonal: Blocks A[i, i], shape (b, k, k).
        right: Blocks A[i, i + 1], shape (b - 1, k, k).
        values: Shape (m,), m <= b k; what is missing is zero.

    Source: Golub and Van Loan, Matrix Computations, 4th edition (2013), section 4.5 (cyclic reduction).
    """
    blocks, size = diagonal.shape[:2]
    known = np.zeros(blocks * size)
    known[: values.size] = values
    return _reduced(diagonal, right, known.reshape(blocks, size, 1)).reshape(-1)[: values.size]


def _reduced(diagonal: Array, right: Array, values: Array) -> Array:
    """Return the solution (b, k, 1)."""
    blocks, size = diagonal.shape[:2]
    if blocks == 1:
        return np.asarray(np.linalg.solve(diagonal, values), dtype=np.float64)
    before, after = right[0::2], right[1::2]
    links = after.shape[0]  # between neighbours that stay; an odd block at the end has none behind it
    after = np.concatenate([after, np.zeros((before.shape[0] - links, size, size))])
    left = np.swapaxes(before, 1, 2)
    odd = np.linalg.solve(diagonal[1::2], np.concatenate([left, after, values[1::2]], axis=2))
    to_before, to_after, alone = odd[:, :, :size], odd[:links, :, size:-1], odd[:, :, -1:]
    back = np.swapaxes(after[:links], 1, 2)
    kept, rest = diagonal[0::2].copy(), values[0::2].copy()
    kept[: before.shape[0]] -= before @ to_before
    rest[: before.shape[0]] -= before @ alone
    kept[1:] -= back @ to_after
    rest[1:] -= back @ alone[:links]
    even = _reduced(kept, -(before[:links] @ to_after), rest)
    result = np.empty_like(values)
    result[0::2] = even
    result[1::2] = alone - to_before @ even[: before.shape[0]]
    result[1 : 2 * links : 2] -= to_after @ even[1:]
    return result
