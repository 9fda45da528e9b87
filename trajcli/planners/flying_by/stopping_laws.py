"""Laws of courses from stop to stop: states that they have at borders, where searched ones have no law.

A motion that stops passes all borders. From the states that it has there a law leads on along every path, a
part of its own, and a motion through every zone: a chain with these states is no slower than stopping.
Between them and faster states squares of speeds, and accelerations, are mixed: the mixture of two laws that
keep limits of velocity and acceleration keeps them, too.

Source: Verscheure et al. (2009).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from trajcli.curves.operations import cut, scale_time, times_at
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.frozen import frozen
from trajcli.planners.flying_by.between_stops import FlyByChain
from trajcli.planners.flying_by.flown_parts import CourseLaws, FlownPart

_SHARES = (0.6, 0.3, 0.0)  # of the faster state, one after another
_APART = (
    1e-6  # by which each other course is slower: ruckig crashes where a joint comes back exactly as it went
)


@frozen
class _Mixture:
    """A state at a border between that of a motion that stops and a faster one.

    Attributes:
        level: Which of the shares it has of the faster one.
        fast: The faster one, (2,).
    """

    level: int
    fast: Array

    @property
    def share(self) -> float:
        return _SHARES[self.level]


class StoppingLaws:
    """Laws from stop to stop, and the borders whose states are taken from them.

    The border of a course before zone k is number 2 k, that of the course behind it 2 k + 1.
    """

    def __init__(self, laws: CourseLaws) -> None:
        """Begin without such borders."""
        self._laws = laws
        self._mixtures: dict[int, _Mixture] = {}

    def law(self, chain: FlyByChain, index: int) -> FlownPart:
        """Return the fastest motion along a whole course; the first one begins as the chain does."""
        course = chain.courses[index]
        return self._laws.along(course, index, (0.0, course.length), self.ends(chain, index), 1.0)

    def ends(self, chain: FlyByChain, index: int) -> Array:
        """Return the states of that motion at the start and at the end, (2, 2), before it is slowed down."""
        start = np.zeros(2) if index else chain.ends[0] / self._pace(chain, 0) ** np.arange(1, 3)
        return np.stack([start, np.zeros(2)])

    def slow(self, chain: FlyByChain, index: int, s: float | None, states: Array) -> None:
        """Take the state at a border of a course that has no law nearer to that of a motion that stops.

        Args:
            chain: The chain.
            index: Of the course.
            s: Where its law fails: the nearer border is taken; None for both.
            states: At the start, at the borders and at the end, (N, 2).
        """
        borders = self._borders(chain, index)
        slower = [border for border in borders if self._level(border) + 1 < len(_SHARES)]
        if s is not None and len(slower) > 1:
            first, last = chain.stretch(index)
            slower = slower[:1] if s - first <= last - s else slower[1:]
        for border in slower:
            earlier = self._mixtures.get(border)
            fast = states[border + 1] if earlier is None else earlier.fast
            self._mixtures[border] = _Mixture(self._level(border) + 1, fast)

    def slow_all(self, chain: FlyByChain) -> bool:
        """Take all states from the motion that stops; return whether there were others."""
        before = len(self._kept(chain))
        for border in range(2 * len(chain.corners)):
            self._mixtures[border] = _Mixture(len(_SHARES) - 1, np.zeros(2))
        return bool(chain.corners) and before < len(chain.courses)

    def states(self, chain: FlyByChain) -> dict[int, Array]:
        """Return the states (2,) at borders that are taken from laws that stop, by number of the border."""
        found = {}
        for border, mixture in self._mixtures.items():
            index = (border + 1) // 2
            corner = chain.corners[border // 2]
            state = self._state_at(chain, index, corner.joined if border % 2 else corner.left)
            squares = (1 - mixture.share) * state[0] ** 2 + mixture.share * mixture.fast[0] ** 2
            change = (1 - mixture.share) * state[1] + mixture.share * mixture.fast[1]
            found[border] = np.array([np.sqrt(squares), change])
        return found

    def parts(self, chain: FlyByChain) -> Mapping[int, FlownPart]:
        """Return the motions along courses that are as they are where the arm stops, by number."""
        return {index: self._between(chain, index) for index in self._kept(chain)}

    def _kept(self, chain: FlyByChain) -> list[int]:
        """Return the courses at all of whose borders the states are those of the motion that stops."""
        borders = [self._borders(chain, k) for k in range(len(chain.courses))]
        last = len(_SHARES) - 1
        return [k for k, some in enumerate(borders) if min(map(self._level, some), default=-1) == last]

    def _level(self, border: int) -> int:
        mixture = self._mixtures.get(border)
        return -1 if mixture is None else mixture.level

    @staticmethod
    def _borders(chain: FlyByChain, index: int) -> list[int]:
        last = 2 * len(chain.corners)
        return [border for border in (2 * index - 1, 2 * index) if 0 <= border < last]

    def _pace(self, chain: FlyByChain, index: int) -> float:
        """Return the pace of a course at which the states at its borders are possible in the zones, too."""
        zones = [chain.corners[border // 2].pace for border in self._borders(chain, index)]
        return min(chain.tempos[index], *zones) * (1 - _APART * (index % 2))

    def _state_at(self, chain: FlyByChain, index: int, s: float) -> Array:
        """Return the state at s of the motion that stops, (2,)."""
        law, pace = _law_of(self.law(chain, index)), self._pace(chain, index)
        time = times_at(law, np.array([s]))
        return np.asarray(law.evaluate_orders(time, (1, 2))[0, :, 0] * [pace, pace**2])

    def _between(self, chain: FlyByChain, index: int) -> FlownPart:
        """Return the part between its borders of the motion that stops."""
        whole, course = self.law(chain, index), chain.courses[index]
        law = _law_of(whole)
        first, last = chain.stretch(index)
        begun, ended = times_at(law, np.array([first, last])).tolist()
        curves = []
        for curve in (whole.curve, law):
            after = cut(curve, begun)[1] if first > 0 else curve
            some = cut(after, ended)[0] if last < course.length else after
            curves.append(scale_time(some.shifted(-some.start), 1 / self._pace(chain, index)))
        return FlownPart(curves[0], course.reference(curves[1]), curves[1])


def _law_of(part: FlownPart) -> PiecewisePolynomial:
    if part.law is None:
        raise TypeError("a motion along a course has a law")
    return part.law
