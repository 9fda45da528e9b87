"""Phase chains: motion of one variable with constant jerk, acceleration or velocity in each phase.

A solver returns its phases with an error of its own. Newton's method on the durations lays the end of the
motion exactly into its target: the least relative change of the durations that does it, so that phases of
length zero stay away and long ones carry the correction. Where the durations alone cannot do it (a motion of
given duration with few phases), the constants change too, a thousand times less willingly.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cached_property, reduce
from itertools import chain as in_turn
from itertools import pairwise
from math import factorial
from operator import add
from typing import NamedTuple

import numpy as np

from trajcli.curves.operations import merge_breaks, merge_pieces
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.frozen import frozen

_GOAL = 4e-15  # relative: what summing a few phases leaves
_ROUNDS = 12
_RELUCTANCE = 1e-3
_MANY = 8
_ORDER = 3
_WEAK = 1e-5  # changes of constants with less than this influence on the end are left alone
_LARGEST_STEP = 0.5
_FACTORIALS = [np.array([[float(factorial(k))] for k in range(order, -1, -1)]) for order in range(4)]
_LEVEL = 1e-9  # of the peak: an acceleration below this in a phase without jerk means a cruise


_Walk = tuple[list[list[float]], list[float], list[float]]


class _Seen(NamedTuple):
    states: list[list[float]]
    leftover: list[float]
    peaks: tuple[float, ...]
    duration: float
    rounding: list[float]
    missed: list[float]


@frozen
class PhaseChain:
    """A motion from a given state, relative to its first position.

    Attributes:
        initial: As many as the order: position 0 and its derivatives below the constant one at the start.
        final: The same at the end, as wanted; NaN where it is free.
        durations: Of k phases, positive.
        constants: The derivative of the given order in each phase, k of them.
        cruising: Phases in which the derivative below is zero, not only small: else its rounding error would
            drift through the longest phases.
    """

    initial: tuple[float, ...]
    final: tuple[float, ...]
    durations: tuple[float, ...]
    constants: tuple[float, ...]
    cruising: frozenset[int] = frozenset()

    @property
    def order(self) -> int:
        """The derivative that is constant in each phase: 1, 2 or 3."""
        return len(self.initial)

    @cached_property
    def _seen(self) -> _Seen:
        states, leftover, driving = self._walk_of_third_order() if self.order == _ORDER else self._walk()
        columns, final = zip(*states, strict=True), self.final
        # NaN is larger than nothing
        peaks = [max(*each, -min(each), to, -to) for each, to in zip(columns, final, strict=True)]
        duration, sizes = _total(self.durations), [*peaks]
        if len(sizes) > 1:
            sizes[0] = max(sizes[0], sizes[1] * duration)
        if len(sizes) > 2:
            sizes[1] = max(sizes[1], sizes[2] * math.fsum(driving))
        missed = [value - wanted for value, wanted in zip(states[-1], final, strict=True)]
        return _Seen(states, leftover, tuple(peaks), duration, [size or 1.0 for size in sizes], missed)

    def _walk(self) -> _Walk:
        """Return the states before each phase and at the end, and what is seen at cruises and beside them."""
        rows = [[*self.initial]]
        for time, constant in zip(self.durations, self.constants, strict=True):
            rows.append(_after(rows[-1], constant, time))
        return rows, [], []

    def _walk_of_third_order(self) -> _Walk:
        """Return the same of phases with constant jerk, of which there are many."""
        x, v, a = self.initial
        rows, leftover, driving, cruising = [], [], [], self.cruising
        for k, (time, jerk) in enumerate(zip(self.durations, self.constants, strict=True)):
            if k in cruising:
                leftover.append(a)
                a = 0.0
            else:
                driving.append(time)
            rows.append([x, v, a])
            change = jerk * time
            x += (v + (a + change / 3) * time / 2) * time
            v += (a + change / 2) * time
            a += change
        rows.append([x, v, a])
        return rows, leftover, driving

    @property
    def duration(self) -> float:
        """Sum of the phases' durations."""
        return self._seen.duration

    @property
    def states(self) -> list[list[float]]:
        """Derivatives of order 0 to `order` - 1 before each phase and at the end, k + 1 of them."""
        return self._seen.states

    @property
    def peaks(self) -> tuple[float, ...]:
        """Largest magnitude of each derivative at the ends of phases and in the target."""
        return self._seen.peaks

    @property
    def _rounding(self) -> list[float]:
        """What rounding is relative to: the peaks, or what the next derivative's peak adds up to."""
        return self._seen.rounding

    def with_cruises(self) -> PhaseChain:
        """Return the motion with its cruises marked: phases without jerk and without acceleration."""
        if self.order < 3:
            return self
        level, states = _LEVEL * self.peaks[-1], self.states
        constants = enumerate(self.constants)
        cruising = frozenset(k for k, constant in constants if not constant and abs(states[k][-1]) <= level)
        if not cruising:
            return self
        return PhaseChain(self.initial, self.final, self.durations, self.constants, cruising)

    def defect(self, duration: float | None = None) -> float:
        """Return by how much the end misses its target (and `duration`, if given).

        Rates count relative to their peaks, the position relative to peak velocity times duration.
        """
        sizes = [peak if peak > 0 else 1.0 for peak in self.peaks]
        sizes[0] = self._rounding[0]
        return _largest(self._residual(sizes, duration))

    @property
    def coarseness(self) -> float:
        """What rounding a break does to the derivative below the last, relative to its peak."""
        if self.order < 3 or not self.peaks[1]:
            return 0.0
        return math.ulp(self.duration) * self.peaks[2] / self.peaks[1]

    def stretched(self, duration: float) -> PhaseChain:
        """Return the motion over the same positions in `duration`; boundary derivatives must be zero."""
        factor = duration / self.duration
        slower = factor**self.order
        return self._with([time * factor for time in self.durations], [c / slower for c in self.constants])

    def polished(self, duration: float | None = None) -> tuple[PhaseChain, float]:
        """Return the motion whose end is its target to rounding, if the phases allow it, and its `defect`.

        Args:
            duration: Kept exactly if given; else the duration is free.
        """
        best = self.corrected(1.0, 0.0, duration)
        miss = best.defect(duration)
        if duration is not None and miss > 10 * _GOAL:
            other = self.corrected(1.0, _RELUCTANCE, duration)
            less = other.defect(duration)
            if less < miss:
                return other, less
        return best, miss

    def curve(self, position: float, duration: float) -> PiecewisePolynomial:
        """Return the motion from `position` as a curve (n = 1) over [0, `duration`]."""
        if not self.durations:
            return PiecewisePolynomial(np.zeros(2), np.full((1, 1, 1), position))
        breaks, derivatives = self.pieces(duration)
        rows = np.array(derivatives)
        rows /= _FACTORIALS[self.order]
        rows[-1] += position
        return PiecewisePolynomial(np.array(breaks), rows[:, :, None])

    def pieces(self, duration: float) -> tuple[list[float], list[Sequence[float]]]:
        """Return breaks from 0 to `duration`, and at each phase's start all derivatives, the highest first.

        Break times are rounded so that no phase but the longest gets shorter: no constant need grow. What
        that does to the end is taken back by the constants, and what is left by steps of rounding size into
        the longest phase.
        """
        breaks = _rounded_breaks(self.durations, duration)
        lengths = [end - start for start, end in pairwise(breaks)]
        phases = zip(self.constants, self.durations, lengths, strict=True)
        chain = self._with(lengths, [constant * time / length for constant, time, length in phases])
        chain = chain.corrected(0.0, 1.0, None)
        states = [*zip(*chain._landing_states(), strict=True)]  # noqa: SLF001
        return breaks, [chain.constants, *reversed(states)]

    def _landing_states(self) -> list[list[float]]:
        """Return the states before each phase, (k, order), shifted from the longest on to meet the end."""
        longest = self.durations.index(max(self.durations))
        states = [list(state) for state in self.states[:-1]]
        phases = list(zip(self.constants, self.durations, strict=True))
        final = self.final
        lowest = 1 if math.isnan(final[0]) else 0
        highest = 0 if longest in self.cruising else self.order - 2
        end = self.states[-1]
        for level in range(highest, lowest - 1, -1):
            states[longest][level + 1] += (final[level] - end[level]) / phases[longest][1]
            end = self._walk_on(states, phases, longest)
        if lowest == 0:
            for state in states[longest + 1 :]:
                state[0] += final[0] - end[0]
        return states

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
        scales = self._rounding
        if _largest(self._residual(scales, duration)) <= _GOAL:
            return self
        chain, best = self, self
        weights = np.repeat([yield_duration, yield_constant], len(self.durations))
        weak, least = None if yield_duration else _WEAK, np.inf
        for _ in range(_ROUNDS):
            residual = chain._residual(scales, duration)
            miss = _largest(residual)
            if miss < least:
                best, least = chain, miss
            if miss <= _GOAL:
                break
            matrix = chain._sensitivity(scales, duration) * weights
            step = weights * np.linalg.lstsq(matrix, -np.array(residual), rcond=weak)[0]
            change = 1 + np.clip(step, -_LARGEST_STEP, _LARGEST_STEP).reshape(2, -1)
            changed = np.array([chain.durations, chain.constants]) * change
            chain = chain._with(*changed.tolist())
        return best

    def _residual(self, scales: Sequence[float], duration: float | None) -> list[float]:
        """Return by how much the end, the cruises and the duration miss what they should be."""
        seen = self._seen
        ends = zip(seen.missed, self.final, scales, strict=True)
        miss = [value / scale for value, wanted, scale in ends if wanted == wanted]
        if seen.leftover:
            miss += [value / scales[-1] for value in seen.leftover]
        if duration is not None:
            miss.append(self.duration / duration - 1)
        return miss

    def _sensitivity(self, scales: Sequence[float], duration: float | None) -> Array:
        """Return the derivative of the residual by the relative changes of durations and constants."""
        count, order = len(self.durations), self.order
        by_change = np.zeros((order, 2 * count))
        at_cruises = []
        for k, (time, constant) in enumerate(zip(self.durations, self.constants, strict=True)):
            if k in self.cruising:
                at_cruises.append(by_change[-1] / scales[-1])
                by_change[-1] = 0.0
            flow = _flow(time, order)
            by_change = flow[:, :order] @ by_change
            by_change[:, k] += np.append(self.states[k + 1][1:], constant) * time
            by_change[:, count + k] += flow[:, order] * constant
        wanted = ~np.isnan(np.array(self.final))
        rows = [*(by_change / np.array(scales)[:, None])[wanted], *at_cruises]
        if duration is not None:
            rows.append(np.concatenate([np.array(self.durations) / duration, np.zeros(count)]))
        return np.array(rows)

    def _with(self, durations: Sequence[float], constants: Sequence[float]) -> PhaseChain:
        return PhaseChain(self.initial, self.final, tuple(durations), tuple(constants), self.cruising)


def merged_curve(motions: Sequence[tuple[float, PhaseChain]], duration: float) -> PiecewisePolynomial:
    """Return the curve of variables over [0, `duration`], each from its position, with the breaks of all."""
    if len({chain.order for _, chain in motions}) > 1 or not all(chain.durations for _, chain in motions):
        return merge_breaks([chain.curve(position, duration) for position, chain in motions])
    pieces = [chain.pieces(duration) for _, chain in motions]
    derivatives = zip(*(of_order for _, of_order in pieces), strict=True)
    rows = np.array([[*in_turn.from_iterable(of_order)] for of_order in derivatives])
    rows /= _FACTORIALS[len(rows) - 1]
    rows[-1] += np.repeat([position for position, _ in motions], [len(times) - 1 for times, _ in pieces])
    return merge_pieces([np.array(times) for times, _ in pieces], rows)


def _total(values: Sequence[float]) -> float:
    """Return the sum as numpy has it, which of few values is that from left to right."""
    return float(np.sum(values)) if len(values) >= _MANY else reduce(add, values, 0.0)


def _largest(values: Sequence[float]) -> float:
    """Return the largest magnitude; NaN where there is one, 0 where there is none."""
    largest = 0.0
    for value in values:
        size = abs(value)
        if size > largest:
            largest = size
        elif value != value:
            return math.nan
    return largest


def _rounded_breaks(durations: Sequence[float], end: float) -> list[float]:
    """Return breaks from 0 to `end`: all phases but the longest last at least as long as given."""
    longest = durations.index(max(durations))
    before, after = [0.0], [end]
    for length in durations[:longest]:
        time = before[-1] + length
        before.append(time if time - before[-1] >= length else math.nextafter(time, math.inf))
    for length in durations[:longest:-1]:
        time = after[-1] - length
        after.append(time if after[-1] - time >= length else math.nextafter(time, -math.inf))
    return before + after[::-1]


def _after(state: Sequence[float], constant: float, time: float) -> list[float]:
    """Return the derivatives `time` later, when the one of order len(state) is constant."""
    if len(state) == 3:
        x, v, a = state
        x += (v + (a + constant * time / 3) * time / 2) * time
        return [x, v + (a + constant * time / 2) * time, a + constant * time]
    if len(state) == 2:
        x, v = state
        return [x + (v + constant * time / 2) * time, v + constant * time]
    return [state[0] + constant * time]


def _flow(time: float, order: int) -> Array:
    """Return the matrix (order, order + 1) that takes a state and the constant to the state `time` later."""
    taylor = [time**k / factorial(k) for k in range(order + 1)]
    return np.array([[taylor[j - i] if j >= i else 0.0 for j in range(order + 1)] for i in range(order)])
