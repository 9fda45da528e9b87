"""Parallel transport: the rotation that a rate w(u) makes, dQ/du = [w] Q, where the axis may wander.

Source: Blanes, Casas, Oteo and Ros, The Magnus expansion and some of its applications, Physics Reports 470
(2009), section 5.4: order six with three Gauss nodes a step; commutators of cross matrices are cross
products.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np

from trajcli.frozen import frozen
from trajcli.geometry.rotation import Array, exp

_OFFSET = np.sqrt(15.0) / 10.0  # of the outer Gauss nodes from the middle


@frozen
class FrameTransport:
    """The rotation Q(u) from Q = I at the first knot.

    Attributes:
        rate: Returns w (*u.shape, 3), rad for each unit of u, in fixed axes.
        knots: Shape (k + 1,), increasing: the steps.
    """

    rate: Callable[[Array], Array]
    knots: Array

    @cached_property
    def _at_knots(self) -> Array:
        steps = exp(self._logarithm(self.knots[:-1], self.knots[1:]))
        result = np.empty((self.knots.size, 3, 3))
        result[0] = np.eye(3)
        for k, step in enumerate(steps):
            result[k + 1] = step @ result[k]
        return result

    def at(self, u: Array) -> Array:
        """Return Q (N, 3, 3) at u (N,)."""
        panel = np.clip(np.searchsorted(self.knots, u, "right") - 1, 0, self.knots.size - 2)
        return np.asarray(exp(self._logarithm(self.knots[panel], u)) @ self._at_knots[panel])

    def _logarithm(self, low: Array, high: Array) -> Array:
        """Return the rotation vectors (*batch, 3) of the steps from `low` to `high` (*batch,)."""
        width = high - low
        middle = (low + high) / 2.0
        before, here, after = (self.rate(middle + k * _OFFSET * width) for k in (-1, 0, 1))
        h = width[..., None]
        a1 = h * here
        a2 = h * np.sqrt(15.0) / 3.0 * (after - before)
        a3 = h * 10.0 / 3.0 * (after - 2.0 * here + before)
        c1 = np.cross(a1, a2)
        c2 = -np.cross(a1, 2.0 * a3 + c1) / 60.0
        return np.asarray(a1 + a3 / 12.0 + np.cross(-20.0 * a1 - a3 + c1, a2 + c2) / 240.0)
