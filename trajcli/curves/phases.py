"""Phase chains: motion of one variable with constant jerk, acceleration or velocity in each phase.

A solver returns its phases with an error of its own. Newton's method on the durations lays the end of the
motion exactly into its target: the least relative change of the durations that does it, so that phases of
length zero stay away and long ones carry the correction. Where the durations alone cannot do it (a motion of
given duration with few phases), the constants change too, a thousand times less willingly.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cached_property
from math import factorial

import numpy as np

from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.frozen import frozen

_GOAL = 4e-15  # relative: what summing a few phases leaves
_ROUNDS = 12
_RELUCTANCE = 1e-3
_WEAK = 1e-5  # changes of constants with less than this influence on the end are left alone
_LARGEST_STEP = 0.5
_LEVEL = 1e-9  # of the peak: an acceleration below this in a phase without jerk means a cruise


@frozen
class PhaseChain:
    """A motion from a given state, relative to its first position.

    Attributes:
        initial: Shape (order,): position 0 and its derivatives below the constant one at the start.
        final: Shape (order,): the same at the end, as wanted; NaN where it is free.
        durations: Shape (k,), positive.
        constants: Shape (k,): the derivative of the given order in each phase.
        cruising: Phases in which the derivative below is zero, not only small: else its rounding error would
            drift through the longest phases.
    """

    initial: Array
    final: Array
    durations: Array
    constants: Array
    cruising: frozenset[int] = frozenset()

    @property
    def order(self) -> int:
        """The derivative that is constant in each phase: 1, 2 or 3."""
        return int(self.initial.size)

    @cached_property
    def duration(self) -> float:
        """Sum of the phases' durations."""
        return float(self.durations.sum())

    @cached_property
    def _walk(self) -> tuple[Array, Array]:
        """The states (k + 1, order) before each phase and at the end, and what cruises had instead of 0."""
        state = self.initial.tolist()
        rows, leftover = [], []
        for k, (time, constant) in enumerate(
            zip(self.durations.tolist(), self.constants.tolist(), strict=True)
        ):
            if k in self.cruising:
                leftover.append(state[-1])
                state[-1] = 0.0
            rows.append(state)
            state = _after(state, constant, time)
        return np.array([*rows, state]), np.array(leftover)

    @property
    def states(self) -> Array:
        """Derivatives of order 0 to `order` - 1 before each phase and at the end, shape (k + 1, order)."""
        return self._walk[0]

    @cached_property
    def peaks(self) -> Array:
        """Largest magnitude of each derivative at the ends of phases and in the target, shape (order,)."""
        peaks: Array = np.fmax(np.abs(self.states).max(axis=0), np.abs(self.final))
        return peaks

    @cached_property
    def _rounding(self) -> Array:
        """What rounding is relative to: the peaks, or what the next derivative's peak adds up to."""
        sizes = self.peaks.copy()
        if self.order > 1:
            sizes[0] = max(sizes[0], sizes[1] * self.duration)
        if self.order > 2:
            driving = [time for k, time in enumerate(self.durations.tolist()) if k not in self.cruising]
            sizes[1] = max(sizes[1], sizes[2] * math.fsum(driving))
        sizes[sizes == 0] = 1.0
        return sizes

    def with_cruises(self) -> PhaseChain:
        """Return the motion with its cruises marked: phases without jerk and without acceleration."""
        if self.order < 3:
            return self
        level = (np.abs(self.states[:-1, -1]) <= _LEVEL * self.peaks[-1]) & (self.constants == 0)
        return replace(self, cruising=frozenset(np.flatnonzero(level).tolist()))

    def defect(self, duration: float | None = None) -> float:
        """Return by how much the end misses its target (and `duration`, if given).

        Rates count relative to their peaks, the position relative to peak velocity times duration.
        """
        sizes = np.where(self.peaks > 0, self.peaks, 1.0)
        sizes[0] = self._rounding[0]
        return float(np.abs(self._residual(sizes, duration)).max(initial=0.0))

    @property
    def coarseness(self) -> float:
        """What rounding a break does to the derivative below the last, relative to its peak."""
        if self.order < 3 or not self.peaks[1]:
            return 0.0
        return float(np.spacing(self.duration) * self.peaks[2] / self.peaks[1])

    def stretched(self, duration: float) -> PhaseChain:
        """Return the motion over the same positions in `duration`; boundary derivatives must be zero."""
        factor = duration / self.duration
        return replace(self, durations=self.durations * factor, constants=self.constants / factor**self.order)

    def polished(self, duration: float | None = None) -> PhaseChain:
        """Return the motion whose end is its target to rounding, if the phases allow it; see `defect`.

        Args:
            duration: Kept exactly if given; else the duration is free.
        """
        best = self.corrected(1.0, 0.0, duration)
        if best.defect(duration) > 10 * _GOAL and duration is not None:
            other = self.corrected(1.0, _RELUCTANCE, duration)
            best = min(best, other, key=lambda chain: chain.defect(duration))
        return best

    def curve(self, position: float, duration: float) -> PiecewisePolynomial:
        """Return the motion from `position` as a curve (n = 1) over [0, `duration`].

        Break times are rounded so that no phase but the longest gets shorter: no constant need grow. What
        that does to the end is taken back by the constants, and what is left by steps of rounding size into
        the longest phase.
        """
        if not self.durations.size:
            return PiecewisePolynomial(np.zeros(2), np.full((1, 1, 1), position))
        breaks = _rounded_breaks(self.durations.tolist(), duration)
        lengths = np.diff(breaks)
        chain = replace(self, durations=lengths, constants=self.constants * self.durations / lengths)
        chain = chain.corrected(0.0, 1.0, None)
        rows = np.stack([chain.constants, *chain._landing_states().T[::-1]])  # noqa: SLF001
        rows /= np.array([factorial(k) for k in range(self.order, -1, -1)])[:, None]
        rows[-1] += position
        return PiecewisePolynomial(breaks, rows[:, :, None])

    def _landing_states(self) -> Array:
        """Return the states before each phase, (k, order), shifted from the longest on to meet the end."""
        longest = int(self.durations.argmax())
        states = self.states[:-1].tolist()
        phases = list(zip(self.constants.tolist(), self.durations.tolist(), strict=True))
        lowest = 1 if np.isnan(self.final[0]) else 0
        highest = 0 if longest in self.cruising else self.order - 2
        for level in [*range(highest, lowest - 1, -1), None]:
            end = self._walk_on(states, phases, longest)
            if level is not None:
                states[longest][level + 1] += (float(self.final[level]) - end[level]) / phases[longest][1]
        shifted = np.array(states)
        if lowest == 0:
            shifted[longest + 1 :, 0] += self.final[0] - end[0]
        return shifted

    def _walk_on(
        self, states: list[list[float]], phases: list[tuple[float, float]], first: int
    ) -> list[float]:
        """Lay the states after the phase `first` anew, and return the end."""
        state = states[first]
        for k in range(first, len(phases)):
            if k in self.cruising:
                state = [*state[:-1], 0.0]
            states[k] = state
            state = _after(state, *phases[k])
        return state

    def corrected(self, yield_duration: float, yield_constant: float, duration: float | None) -> PhaseChain:
        """Return the chain after Newton steps.

        Args:
            yield_duration: How willingly durations change, relative to themselves.
            yield_constant: The same for the constants.
            duration: Kept if given.
        """
        chain, best, scales = self, self, self._rounding
        weights = np.repeat([yield_duration, yield_constant], self.durations.size)
        weak, least = None if yield_duration else _WEAK, np.inf
        for _ in range(_ROUNDS):
            residual = chain._residual(scales, duration)
            miss = float(np.abs(residual).max(initial=0.0))
            if miss < least:
                best, least = chain, miss
            if miss <= _GOAL:
                break
            matrix = chain._sensitivity(scales, duration) * weights
            step = weights * np.linalg.lstsq(matrix, -residual, rcond=weak)[0]
            change = 1 + np.clip(step, -_LARGEST_STEP, _LARGEST_STEP).reshape(2, -1)
            chain = replace(
                chain, durations=chain.durations * change[0], constants=chain.constants * change[1]
            )
        return best

    def _residual(self, scales: Array, duration: float | None) -> Array:
        """Return by how much the end, the cruises and the duration miss what they should be."""
        states, leftover = self._walk
        miss = ((states[-1] - self.final) / scales)[~np.isnan(self.final)]
        total = [] if duration is None else [self.duration / duration - 1]
        return np.concatenate([miss, leftover / scales[-1], total])

    def _sensitivity(self, scales: Array, duration: float | None) -> Array:
        """Return the derivative of the residual by the relative changes of durations and constants."""
        count, order = self.durations.size, self.order
        by_change = np.zeros((order, 2 * count))
        at_cruises = []
        for k, (time, constant) in enumerate(
            zip(self.durations.tolist(), self.constants.tolist(), strict=True)
        ):
            if k in self.cruising:
                at_cruises.append(by_change[-1] / scales[-1])
                by_change[-1] = 0.0
            flow = _flow(time, order)
            by_change = flow[:, :order] @ by_change
            by_change[:, k] += np.append(self.states[k + 1][1:], constant) * time
            by_change[:, count + k] += flow[:, order] * constant
        rows = [*(by_change / scales[:, None])[~np.isnan(self.final)], *at_cruises]
        if duration is not None:
            rows.append(np.concatenate([self.durations / duration, np.zeros(count)]))
        return np.array(rows)


def _rounded_breaks(durations: list[float], end: float) -> Array:
    """Return breaks from 0 to `end`: all phases but the longest last at least as long as given."""
    longest = durations.index(max(durations))
    before, after = [0.0], [end]
    for length in durations[:longest]:
        time = before[-1] + length
        before.append(time if time - before[-1] >= length else math.nextafter(time, math.inf))
    for length in durations[:longest:-1]:
        time = after[-1] - length
        after.append(time if after[-1] - time >= length else math.nextafter(time, -math.inf))
    return np.array(before + after[::-1])


def _after(state: list[float], constant: float, time: float) -> list[float]:
    """Return the derivatives `time` later, when the one of order len(state) is constant."""
    later = []
    for order in range(len(state)):
        value = constant
        for power in range(len(state) - order, 0, -1):
            value = state[order + power - 1] + value * time / power
        later.append(value)
    return later


def _flow(time: float, order: int) -> Array:
    """Return the matrix (order, order + 1) that takes a state and the constant to the state `time` later."""
    taylor = [time**k / factorial(k) for k in range(order + 1)]
    return np.array([[taylor[j - i] if j >= i else 0.0 for j in range(order + 1)] for i in range(order)])
