"""Time allocation through dense points: many durations from few parameters.

Where points are dense, a jerk limit ties the durations of many pieces together, and to change one by itself
helps nobody. So the points are passed by a smooth law u(t) of a parameter u of theirs, a cubic spline through
some of them, whose durations are found: first a few, then more in steps, each beginning with what was found
before.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.operations import times_at
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.splines.cubic import not_a_knot
from trajcli.curves.splines.time_allocation import CurveFamily, fastest_durations
from trajcli.curves.splines.virtual_points import continuous_acceleration
from trajcli.frozen import frozen

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
        rest = np.zeros(1)
        return continuous_acceleration(times, values[:, None], (first, last), (rest, rest), None)
