"""Time-optimal motion along a path within limits of velocity, acceleration and jerk.

The law of second order, without limits of jerk, is the lower bound and the start: its moving average has
ramps of acceleration. Convex steps make it faster, its nodes are refined where time is lost, and limits are
lowered in intervals that exceed them between samples. Of all laws on the way, each slowed down as a whole
until it keeps every limit for all t, the fastest is taken.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.curves.third_order.convex_step import faster
from trajcli.curves.third_order.first_law import EndStates, smoothed_law
from trajcli.curves.third_order.jerk import JointJerkConstraint, ThirdOrderConstraint, curvature_jumps
from trajcli.curves.third_order.path_limits import LawLimits, most_nodes, time_lost
from trajcli.curves.third_order.quartic_law import QuarticLaw, ReversingLawError
from trajcli.curves.time_optimal.constraints import JointConstraint, PathConstraint
from trajcli.curves.time_optimal.parameterization import (
    TimeOptimalMotion,
    UnsettledSpeedError,
    time_optimal,
)
from trajcli.curves.time_optimal.refinement import parts_for
from trajcli.curves.time_optimal.time_law import law_and_trajectory
from trajcli.curves.turning_bound import bound_between_stops
from trajcli.frozen import frozen

_FIRST_GAP = 1e-3  # of the duration: what the first step may miss
_FAR = 30.0  # times as long as it is: a first law that has to last so long is slowed down before any step
_FIRST_STEPS, _MORE_STEPS = 12, 6  # on the first nodes and on the last ones
_CHANGED = 3e-4  # of the duration: a step that changes less is the last one
_FURTHER = 0.8  # of the duration: a step to less leads on, as from a law that is far too slow
_STEADY = 0.7  # of the change before: a step that changes more leads nowhere
_NEARLY = 1.5  # excess that is worth finer nodes
_GAP, _LAST_GAP = 1e-4, 1e-5  # the same of those while nodes are refined, and of the last ones
_REFINEMENTS = 7
_SETTLING, _MOST_SETTLING = 8, 30  # steps with lowered limits; where nothing can be slowed down
_FEWER, _IDLE = 512, 1  # nodes, and last steps without a gain, where nobody waits for what is hopeless
_PATIENCE, _HOPE = 4, 0.5  # steps, and what part they must leave of the slowing that limits ask for
_NEAR = 5e-3  # slowing that is so little is always worth another step
_LOST = 1e-3  # of the duration, by estimate: finer nodes would not gain more
_FEW_NEW = 0.02  # of the intervals: fewer new ones are not worth another step
_LOWERED, _LOWERED_MORE = 1.1, 1.5  # times the excess that limits are lowered by
_LOWEST = 1e6  # times that a limit is lowered by: where that does not help nothing does
_PENALTY = 1.0  # of the duration, for passing a limit by its size at one place
_STUBBORN = 1.005  # of a limit: where it is passed by more although it was lowered, nodes are missing
_ACCEPTED = 5.0  # times how much slower a motion may be, in the end
_EXACT = 1e-10  # a limit exceeded by less is kept
_SETTLED = 2e-5  # of the duration: less is left to slowing down
_SHARES = (1.0, 0.5, 0.25, 0.1)  # of a step, the largest first that leads forward


@frozen
class JerkLimitedMotion(TimeOptimalMotion):
    """A near time-optimal motion, whose law has quartic pieces.

    Attributes:
        steps: Number of convex steps.
        bounding_joint: The joint that alone needs the lower bound between its turning points; None where it
            is that without limits of jerk, or where the motion stops.
        bounded_by_stops: Whether the lower bound is what the slowest joint needs between each two stops.
    """

    steps: int
    bounding_joint: int | None
    bounded_by_stops: bool


def jerk_limited_time_optimal(
    path: PiecewisePolynomial,
    velocity: ArrayLike,
    acceleration: ArrayLike,
    jerk: ArrayLike,
    *,
    start: tuple[float, float] = (0.0, 0.0),
    end: tuple[float, float] = (0.0, 0.0),
    further: Sequence[PathConstraint] = (),
    further_jerk: Sequence[ThirdOrderConstraint] = (),
    along: tuple[float, float] = (np.inf, np.inf),
    hopeless: float = np.inf,
    slower: float = 0.0,
) -> JerkLimitedMotion:
    """Return the fastest motion that is found along a path within bounds that hold for all t.

    At a corner, and where q'' jumps, the motion stops. Where it rests, the acceleration is zero.

    Args:
        path: q(s) with n joints, of degree at most 5, without jumps.
        velocity: Lower and upper bounds, shape (n, 2), lower < 0 < upper, infinite for none; per second.
        acceleration: The same, per second squared; not all infinite.
        jerk: The same, per second cubed.
        start: sd at the start, not negative, and sdd.
        end: The same at the end.
        further: Other constraints of velocity and acceleration; kept as far as their excess tells.
        further_jerk: Other constraints of jerk.
        along: As for `time_optimal`.
        hopeless: With velocities at the ends, how many times a limit may be passed after the first steps:
            with more nobody waits for it to be kept.
        slower: By what part the velocities at the ends may be lower than given, where the whole is slowed
            down by that little to keep the limits; five times that where no step leads there.

    Raises:
        UnlimitedSpeedError: When nothing limits the motion somewhere.
        UnreachableSpeedError: When the velocities at the ends are too high.
        UnsettledSpeedError: When they leave no room to keep the limits.
        ReversingLawError: When no law leads forward from the states at the ends.
        ValueError: When bounds have another shape or sign.
    """
    bounds = [np.asarray(each, dtype=np.float64) for each in (velocity, acceleration, jerk)]
    ends = EndStates(start, end)
    speeds = {"start_velocity": start[0], "end_velocity": end[0]}
    curved = any(constraint.curved for constraint in further_jerk)
    stops = curvature_jumps(path, np.zeros_like(bounds[2]) if curved else bounds[2])
    second = time_optimal(path, bounds[0], bounds[1], **speeds, further=further, stops=stops, along=along)
    limits = LawLimits(
        (JointConstraint(path, bounds[0], bounds[1]), *further),
        (JointJerkConstraint(path, bounds[2]), *further_jerk),
    )
    hasty = np.isfinite(hopeless) and not ends.rests
    law = smoothed_law(path, second, (bounds[1], bounds[2]), ends)
    search = _Search(limits, law, ends.rests, slower, hasty=hasty)
    allowed = min(most_nodes(path), _FEWER) if hasty else most_nodes(path)
    lost = search.refine(allowed, np.inf if ends.rests else hopeless)
    search.settle(allowed, _SETTLING if ends.rests or hasty else _MOST_SETTLING)
    law, stretch = search.best, search.stretch
    if stretch > 1.0 + max(_ACCEPTED * slower, _EXACT) and not ends.rests:
        raise search.unsettled()
    curve, trajectory = law_and_trajectory(path, law.pieces)
    if stretch > 1.0 + _EXACT:
        curve, trajectory = scale_time(curve, stretch), scale_time(trajectory, stretch)
    times = curve.breaks[np.searchsorted(law.s, second.stops)]
    lowered = int((search.lowered > 1.0).any(axis=0).sum())
    alone, joint = bound_between_stops(
        path, (bounds[0], bounds[1], bounds[2]), (start[0], end[0]), second.stops
    )
    return JerkLimitedMotion(
        trajectory,
        curve,
        stretch,
        lowered,
        search.refinements,
        law.s,
        lost / law.duration,
        second.stops,
        times,
        max(second.lower_bound, alone),
        search.steps,
        joint if alone > second.lower_bound else None,
        joint is None and alone > second.lower_bound,
    )


class _Search:
    """The laws on the way to the fastest one.

    Attributes:
        limits: To be kept.
        rests: Whether it may be slowed down as a whole.
        slower: By what part it may be where it does not rest.
        hasty: Whether nobody waits for limits that steps hardly come nearer to.
        law: The present one.
        excess: What it uses of the limits, shape (3, N).
        lowered: By what its limits are divided in each interval, shape (3, N).
        best: The law that is the fastest once it is slowed down until it keeps the limits.
        stretch: By what factor that is.
        steps: How many were made.
        refinements: How often nodes were refined.
    """

    def __init__(
        self, limits: LawLimits, law: QuarticLaw, rests: bool, slower: float, *, hasty: bool = False
    ) -> None:
        self.limits, self.rests, self.steps, self.refinements = limits, rests, 0, 0
        self.slower, self.hasty = max(slower, _EXACT), hasty
        self._passed = [np.inf] * _PATIENCE
        self.lowered = np.ones((3, law.lengths.size))
        self.best, self.stretch = law, np.inf
        self._take(law)
        if rests and self.stretch > _FAR:
            self._take(law.slowed(self.stretch))

    def refine(self, allowed: int, hopeless: float) -> float:
        """Refine the nodes while that pays; return the estimate of what is lost, in seconds."""
        self._step(_FIRST_GAP)
        self._converge(_FIRST_STEPS, hopeless)
        if self.excess.max() > hopeless and self.limits.excess(self.best).max() > hopeless:
            raise self.unsettled()
        if self.rests and self.excess.max() > _NEARLY:  # where much is passed, steps may lead nowhere
            self._take(self.best.slowed(self.stretch))
            self._converge(_FIRST_STEPS)
        for _ in range(_REFINEMENTS):
            lost = time_lost(self.law, self.limits, self.excess)
            duration = self.law.duration
            if lost.sum() <= _LOST * duration:
                break
            parts = parts_for(lost, 0.5 * _LOST * duration, allowed - lost.size)
            if (parts - 1).sum() <= _FEW_NEW * parts.size:
                break
            self._cut(parts)
            self._step(_GAP)
        self._converge(_MORE_STEPS)
        return float(time_lost(self.law, self.limits, self.excess).sum())

    @property
    def _slowed_duration(self) -> float:
        """How long the best law lasts once it keeps the limits."""
        return self.best.duration * self.stretch

    def _converge(self, allowed: int, hopeless: float = np.inf) -> None:
        """Make steps until the duration settles or oscillates, and limits are nearly kept.

        What is hopeless is left where a step does not halve the excess; a step that leads far does not count.
        """
        last, left = np.inf, allowed
        while left > 0:
            before, passed, best = self.law.duration, float(self.excess.max()), self._slowed_duration
            self._step(_GAP)
            if float(self.excess.max()) > max(hopeless, 0.5 * passed):
                break
            if self.rests and self._slowed_duration < _FURTHER * best:
                continue
            left -= 1
            change = abs(self.law.duration - before) / before
            settled = change <= _CHANGED or change > _STEADY * last
            if settled and (self.rests or self.excess.max() <= _NEARLY):
                break
            last = change

    def settle(self, allowed: int, steps: int) -> None:
        """Lower limits in the intervals that exceed them until little is left."""
        lowered, enough = (_LOWERED, _SETTLED) if self.rests else (_LOWERED_MORE, min(self.slower, _SETTLED))
        best, idle = self.stretch, 0
        for step in range(steps):
            if _stretch(self.excess) <= 1.0 + enough or (self.hasty and idle > _IDLE and best > 1.0 + _NEAR):
                break
            # what is left after many steps may be the bound's own: it is nearer in shorter pieces
            passed = 1.0 if step and step % _SETTLING == 0 else _STUBBORN
            stubborn = ((self.excess > passed) & (self.lowered > passed)).any(axis=0)
            if stubborn.any() and self.law.lengths.size + stubborn.sum() <= allowed:
                if self.rests:
                    self.lowered[:, stubborn] = 1.0
                self._cut(np.where(stubborn, 2, 1))
            self.lowered = self.lowered * (1.0 + lowered * np.maximum(self.excess - 1.0, 0.0))
            self.lowered = np.minimum(self.lowered, _LOWEST)
            self._step(_LAST_GAP)
            idle = 0 if self.stretch < best else idle + 1
            best = self.stretch

    def _cut(self, parts: NDArray[np.intp]) -> None:
        """Cut each interval into so many (N,) parts."""
        self.refinements += 1
        self.lowered = np.repeat(self.lowered, parts, axis=1)
        self._take(self.law.cut(parts))

    def _step(self, gap: float) -> None:
        """Make one convex step, or less of it where the whole leads to no law."""
        self.steps += 1
        b, slope = faster(self.law, self.limits, self.lowered, gap, np.inf if self.rests else _PENALTY)
        for share in _SHARES:
            try:
                law = self.law.changed(1.0 + share * (b - 1.0), share * slope)
            except ReversingLawError:
                continue
            self._take(law)
            break
        self._passed.append(self.stretch - 1.0)
        if self.hasty and self._passed[-1] > max(_NEAR, _HOPE * self._passed[-1 - _PATIENCE]):
            raise self.unsettled()

    def _take(self, law: QuarticLaw) -> None:
        """Go on from a law, and keep it where it is better than all before."""
        self.law, self.excess = law, self.limits.excess(law)
        stretch = max(_stretch(self.excess), 1.0)
        if self.rests:
            better = law.duration * stretch < self.best.duration * self.stretch
        else:
            kept = max(stretch, self.stretch) <= 1.0 + self.slower
            better = law.duration < self.best.duration if kept else stretch < self.stretch
        if better:
            self.best, self.stretch = law, stretch

    def unsettled(self) -> UnsettledSpeedError:
        """Return the error of limits that cannot be kept with these states at the ends."""
        excess = self.limits.excess(self.best).max(axis=0)
        worst = int(excess.argmax())
        return UnsettledSpeedError(float(self.best.s[worst]), float(excess[worst]))


def _stretch(excess: Array) -> float:
    """Return by what factor a law must be slowed down that uses so much of its limits, (3, N)."""
    return float((excess.max(axis=1) ** np.array([1.0, 0.5, 1.0 / 3.0])).max())
