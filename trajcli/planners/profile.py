"""What one variable shall do, and the motion that does it: how a solver is asked, and how it answers."""

from __future__ import annotations

from typing import Literal

import numpy as np

from trajcli.curves.phases import PhaseChain
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.frozen import frozen
from trajcli.planners.planner import Phase

Control = Literal["position", "velocity"]

_STILL = 1e-9  # of the peak velocity: less counts as rest


@frozen
class Task:
    """What one variable shall do.

    Attributes:
        name: For messages.
        initial: (position, velocity, acceleration) at the start.
        final: The same at the end; the position is ignored under velocity control.
        bounds: Shape (3, 2), lower and upper, of velocity, acceleration and jerk; infinite ones are allowed.
            Of the two bounds of the jerk the smaller magnitude holds both ways.
        control: Whether the final position is imposed.
    """

    name: str
    initial: tuple[float, float, float]
    final: tuple[float, float, float]
    bounds: Array
    control: Control = "position"

    @property
    def order(self) -> int:
        """The derivative that is constant in each phase: the lowest above which nothing is bounded."""
        _, acceleration, jerk = (bool(np.isfinite(bound).all()) for bound in self.bounds)
        return 3 if jerk else 2 if acceleration else 1

    @property
    def displacement(self) -> float:
        """Position to cover; zero under velocity control."""
        return self.final[0] - self.initial[0] if self.control == "position" else 0.0

    @property
    def steady(self) -> bool:
        """Whether constant velocity, or rest, is all that is asked."""
        anywhere = self.control == "velocity" or self.displacement == self.initial[1] == 0
        return anywhere and self.initial[1] == self.final[1] and self.initial[2] == self.final[2] == 0

    @property
    def rests(self) -> bool:
        """Whether it goes from rest to rest."""
        return self.control == "position" and not any((*self.initial[1:], *self.final[1:]))

    @property
    def done(self) -> bool:
        """Whether the start is the target already."""
        return self.displacement == 0 and self.initial[1:] == self.final[1:]


@frozen
class Profile:
    """The motion of one variable.

    Attributes:
        position: At the start.
        chain: Its phases, relative to that position.
        duration: Seconds.
        braking: How many of the first phases only lead back into the bounds.
    """

    position: float
    chain: PhaseChain
    duration: float
    braking: int = 0

    def curve(self) -> PiecewisePolynomial:
        """Return the position over [0, duration], n = 1."""
        return self.chain.curve(self.position, self.duration)

    def phases(self, joint: int | None) -> list[Phase]:
        """Return the phases by name, equal neighbours joined."""
        times = np.concatenate([[0.0], np.cumsum(self.chain.durations)])
        times[-1] = self.duration
        named: list[Phase] = []
        for k, name in enumerate(self._names()):
            start, end = float(times[k]), float(times[k + 1])
            if named and named[-1].name == name:
                start = named.pop().start
            named.append(Phase(name, start, end, joint))
        return named

    def _names(self) -> list[str]:
        chain, names = self.chain, []
        for k, constant in enumerate(chain.constants.tolist()):
            velocity, acceleration, jerk = (*chain.states[k][1:].tolist(), constant, 0.0, 0.0)[:3]
            speed = chain.peaks[1] if chain.order > 1 else 1.0
            if k < self.braking:
                names.append("brake")
            elif jerk:
                names.append("jerk +" if jerk > 0 else "jerk -")
            elif acceleration:
                names.append("constant acceleration")
            else:
                names.append("cruise" if abs(velocity) > _STILL * speed else "rest")
        return names
