"""Fastest motions of one variable under bounds on velocity, acceleration and jerk, solved by ruckig.

Ruckig sees one variable at a time, from position zero, in units that suit it. What it returns are phases; the
phases are then corrected to end in their target, which ruckig misses by up to 1e-8. Several variables arrive
together in the shortest time in which each can arrive: the set of such times may have gaps, so the time is
raised until all agree.

Source: Berscheid and Kroeger (2021).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property
from itertools import accumulate, islice, product
from typing import Any, Literal

import numpy as np

from trajcli.curves.phases import PhaseChain, merged_curve
from trajcli.curves.piecewise import Array, PiecewisePolynomial
from trajcli.errors import Amount, PlanningError, of_joint
from trajcli.frozen import frozen
from trajcli.planners.planner import Phase

Control = Literal["position", "velocity"]

_STILL = 1e-9  # of the peak velocity: less counts as rest


@frozen
class BoundaryProblem:
    """Boundary states and bounds of the motion of one variable.

    Attributes:
        name: For messages.
        initial: (position, velocity, acceleration) at the start.
        final: The same at the end; the position is ignored under velocity control.
        bounds: Shape (3, 2), lower and upper, of velocity, acceleration and jerk; infinite ones are allowed.
            Of the two bounds of the jerk the smaller magnitude holds both ways.
        control: Whether the final position is imposed.
        brake: Whether a start outside the bounds is brought inside first also under velocity control, where
            ruckig bounds no velocity; under position control it always is.
    """

    name: str
    initial: tuple[float, float, float]
    final: tuple[float, float, float]
    bounds: Array
    control: Control = "position"
    brake: bool = False

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
        """Whether constant velocity, or rest, fulfils it."""
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
class PhaseProfile:
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

    @cached_property
    def _curve(self) -> PiecewisePolynomial:
        return self.chain.curve(self.position, self.duration)

    def curve(self) -> PiecewisePolynomial:
        """Return the position over [0, duration], n = 1."""
        return self._curve

    def phases(self, joint: int | None) -> list[Phase]:
        """Return the phases by name, equal neighbours joined."""
        ends = [*accumulate(self.chain.durations)][:-1]
        named: list[Phase] = []
        for name, start, end in zip(self._names(), [0.0, *ends], [*ends, self.duration], strict=False):
            if named and named[-1].name == name:
                named[-1] = Phase(name, named[-1].start, end, joint)
            else:
                named.append(Phase(name, start, end, joint))
        return named

    def _names(self) -> list[str]:
        chain, names = self.chain, []
        states, speed = chain.states, chain.peaks[1] if chain.order > 1 else 1.0
        for k, constant in enumerate(chain.constants):
            velocity, acceleration, jerk = (*states[k][1:], constant, 0.0, 0.0)[:3]
            if k < self.braking:
                names.append("brake")
            elif jerk:
                names.append("jerk +" if jerk > 0 else "jerk -")
            elif acceleration:
                names.append("constant acceleration")
            else:
                names.append("cruise" if abs(velocity) > _STILL * speed else "rest")
        return names


def joined(profiles: Sequence[PhaseProfile]) -> PiecewisePolynomial:
    """Return the curve of variables whose motions last equally long, n = as many as there are."""
    motions = [(profile.position, profile.chain) for profile in profiles]
    return merged_curve(motions, profiles[0].duration)


_EXACT = 1e-12  # relative to the joint's peaks: a larger miss means that other units may do better
_ACCEPTABLE = 1e-9  # the same: a larger miss is a jump, and the phases are wrong
_COARSE = 1e-11  # the same: what rounding times may do to the velocity
_ROUNDING = 1e-12
_ROOM = 2e-10  # relative; a fifth of the tolerance with which limits are verified
_SHARES = (1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3)  # of acceleration and jerk: given up in turn
_COMMON = 1e6  # times larger or smaller than 1 in SI: beyond it closed forms may overflow
_SHORT = 1e-6  # of the longest phase: a shorter one may be what rounding leaves of none
_LONG = 1e-4  # of the longest phase: rounding the ends of such a phase changes its constant by 1e-11
_SAME = 1e-10  # relative: of states that are the same but for the direction of the velocity
_HIDDEN = 1e-11  # over velocity and acceleration in ruckig's units: so unlike are states it takes for alike
_MARGINS = (0.0, 1e-14, 1e-13, 5e-13)  # of the acceleration limits: tried in turn where ruckig finds nothing


def fastest(problem: BoundaryProblem) -> PhaseProfile:
    """Return the fastest motion.

    Raises:
        PlanningError: When there is none.
    """
    return _solve(problem, None)


def fastest_of(
    problem: BoundaryProblem, duration: float, quickest: PhaseProfile | None = None
) -> PhaseProfile:
    """Return the motion that lasts `duration`, or longer where none lasts just that long.

    Args:
        problem: Boundary states and bounds.
        duration: Seconds.
        quickest: Its fastest motion, where that is known already.

    Raises:
        PlanningError: When there is none.
    """
    return _solve(problem, duration, quickest)


def together(
    problems: Sequence[BoundaryProblem], profiles: Sequence[PhaseProfile], minimum_duration: float = 0.0
) -> list[PhaseProfile]:
    """Return motions of one common duration, the shortest that all problems allow.

    Args:
        problems: One for each variable.
        profiles: Their fastest motions.
        minimum_duration: The common duration is at least this, s.

    Raises:
        PlanningError: When some problem has no motion of such a duration.
    """
    chosen = list(profiles)
    duration = max([minimum_duration, *(profile.duration for profile in profiles)])
    agreed = False
    while not agreed:
        agreed = True
        for k, problem in enumerate(problems):
            if chosen[k].duration == duration:
                continue
            chosen[k] = (
                profiles[k]
                if profiles[k].duration == duration
                else fastest_of(problem, duration, profiles[k])
            )
            if chosen[k].duration > duration:
                duration, agreed = chosen[k].duration, False
    return chosen


def _solve(
    problem: BoundaryProblem, duration: float | None, quickest: PhaseProfile | None = None
) -> PhaseProfile:
    if problem.steady or (problem.done and duration is None):
        return _steady(problem, duration or 0.0)
    if not problem.rests:
        return _solved_by_ruckig(problem, duration)
    if duration is not None:
        return _slowed(problem, quickest or fastest(problem), duration)
    return _double_s(problem, None) or _solved_by_ruckig(problem, None)


def _slowed(problem: BoundaryProblem, quickest: PhaseProfile, duration: float) -> PhaseProfile:
    """Return a motion from rest to rest that takes longer than it needs.

    Full jerk for a tiny displacement in a long time would make phases that are too short for the resolution
    of time; these, and what ruckig cannot do, are done by stretching the fastest motion.
    """
    profile = _double_s(problem, duration)
    if profile is None:
        with suppress(PlanningError):
            profile = _solved_by_ruckig(problem, duration)
    if profile is not None and profile.chain.coarseness <= _COARSE:
        return profile
    longer = max(duration, quickest.duration)
    return PhaseProfile(quickest.position, quickest.chain.stretched(longer), longer)


def _double_s(problem: BoundaryProblem, duration: float | None) -> PhaseProfile | None:
    """Return a motion from rest to rest in closed form; None where its numbers are not of common size.

    Nor where the bounds of acceleration differ by direction, or where a phase is so short that it may be
    rounding.
    """
    displacement = problem.displacement
    (lowest, highest), (low, high), jerks = problem.bounds.tolist()
    sizes = abs(displacement), highest if displacement > 0 else -lowest, high, min(-jerks[0], jerks[1])
    if low != -high or not (min(sizes) > 1 / _COMMON and max(sizes) < _COMMON):
        return None
    from trajcli.curves.rest_to_rest import DoubleS, double_s_of, fastest_double_s

    distance, velocity, acceleration, jerk = sizes
    if duration is None:
        found: DoubleS | None = fastest_double_s(distance, velocity, acceleration, jerk)
    else:
        found = double_s_of(distance, duration, acceleration, jerk) if duration < _COMMON else None
    if found is None:
        return None
    lengths, constants = found.phases(math.copysign(jerk, displacement))
    if min(lengths) < _SHORT * max(lengths):
        return None
    cruise = frozenset([len(lengths) // 2]) if found.cruising else frozenset[int]()
    final, still = (displacement, 0.0, 0.0), (0.0, 0.0, 0.0)
    chain = PhaseChain(still, final, tuple(lengths), tuple(constants), cruise)
    profile = PhaseProfile(problem.initial[0], chain, chain.duration)
    if duration is not None and duration < profile.duration * (1 - _ROUNDING):
        return None
    profile, miss = _corrected(profile, duration)
    return profile if miss <= _EXACT and _within(profile, problem.bounds) else None


def _solved_by_ruckig(problem: BoundaryProblem, duration: float | None) -> PhaseProfile:
    """Return a motion within the bounds; where rounding leads outside, with a little less of them.

    A phase of 1e-12 s has no room for rounding its ends, and ruckig itself exceeds bounds by up to 1e-6 where
    one of its cases ends and the next begins.
    """
    profile = _accurate(problem, duration)
    for part in _SHARES:
        if profile.braking or _within(profile, problem.bounds):
            break
        with suppress(PlanningError):
            profile = _accurate(_with_less(problem, part), duration)
    return profile


def _within(profile: PhaseProfile, bounds: Array) -> bool:
    """Return whether velocity, acceleration and jerk at the ends of phases keep the bounds.

    Where all phases are long, rounding their ends changes less than half of the room: their states tell.
    """
    if profile.chain.order == 3 and _clearly_within(profile.chain, bounds.tolist()):
        return True
    curve, slack = profile.curve(), _ROOM * np.abs(bounds)
    ends = np.array([np.ravel(curve.piece_ends(order)) for order in (1, 2, 3)])
    low, high = (bounds + np.where(np.isfinite(slack), slack, 0.0) * [-1.0, 1.0]).T[:, :, None]
    return bool(((low <= ends) & (ends <= high)).all())


def _clearly_within(chain: PhaseChain, bounds: Sequence[Sequence[float]]) -> bool:
    """Return whether all phases are long, and their states keep the bounds with half of the room."""
    times = chain.durations
    if not times or min(times) < _LONG * max(times):
        return False
    _, velocities, accelerations = zip(*chain.states, strict=True)
    slack = 1 + 0.5 * _ROOM
    for values, (low, high) in zip((velocities, accelerations, chain.constants), bounds, strict=True):
        if not (low * slack <= min(values) and max(values) <= high * slack):
            return False
    return True


def _with_less(problem: BoundaryProblem, part: float) -> BoundaryProblem:
    """Return the problem with less jerk, and with less acceleration where its ends allow it."""
    ends = max(abs(problem.initial[2]), abs(problem.final[2]))
    inside = ends <= np.abs(problem.bounds[1]).min() * (1 - part)
    less = np.array([[0.0], [part if inside else 0.0], [part]])
    return replace(problem, bounds=problem.bounds * (1.0 - less))


def _accurate(problem: BoundaryProblem, duration: float | None) -> PhaseProfile:
    """Return the motion that misses its target least, of those that units and margins of ruckig lead to."""
    best, least = None, _ACCEPTABLE
    for margin, (time_unit, length_unit) in _attempts(problem, duration):
        answer = _call_ruckig(_with_margin(problem, margin), duration, time_unit, length_unit)
        if answer is None:
            continue
        profile, miss = _corrected(answer, duration)
        if miss <= _EXACT:
            return profile
        if miss <= least:
            best, least = profile, miss
    if best is not None:
        return best
    message = "{joint}: no motion within the velocity, acceleration and jerk limits could be found"
    message += " that lasts {duration}" if duration else ""
    hint = "change the end velocity or acceleration, or the duration, or raise the limits"
    raise PlanningError(of_joint(problem.name, message, hint, {"duration": Amount(duration or 0.0)}))


def _with_margin(problem: BoundaryProblem, part: float) -> BoundaryProblem:
    """Return the problem with a little less acceleration.

    Where a limit is just reached, a case of ruckig's ends and the next begins, and rounding may leave it with
    neither: so it is at a displacement of 2 a^3 / j^2.
    """
    if not part:
        return problem
    return replace(problem, bounds=problem.bounds * (1.0 - part * np.array([[0.0], [1.0], [0.0]])))


def _steady(problem: BoundaryProblem, duration: float) -> PhaseProfile:
    """Return the motion of constant velocity, or the one of no length that has arrived already."""
    order = problem.order
    initial = (0.0, *problem.initial[1:])[:order]
    final = (problem.initial[1] * duration, *problem.final[1:])[:order]
    constants = (problem.initial[1] if order == 1 else 0.0,) if duration > 0 else ()
    chain = PhaseChain(initial, final, (duration,) * len(constants), constants)
    return PhaseProfile(problem.initial[0], chain.with_cruises() if constants else chain, duration)


def _corrected(answer: PhaseProfile, duration: float | None) -> tuple[PhaseProfile, float]:
    """Return the motion corrected to end in its target, and by how much it still misses it."""
    if duration is None or answer.duration > duration * (1 + 1e-12):
        free, miss = answer.chain.polished()
        if duration is None or free.duration > duration:
            return PhaseProfile(answer.position, free, free.duration, answer.braking), miss
    kept, miss = answer.chain.polished(duration)
    return PhaseProfile(answer.position, kept, duration, answer.braking), miss


def _attempts(
    problem: BoundaryProblem, duration: float | None
) -> Iterator[tuple[float, tuple[float, float]]]:
    """Yield margins of the acceleration with units of time and length for ruckig."""
    return ((margin, units) for margin in _MARGINS for units in _units(problem, duration))


def _units(problem: BoundaryProblem, duration: float | None) -> Iterator[tuple[float, float]]:
    """Yield units of time (s) and length for ruckig.

    Its tolerances are absolute, and it refuses durations above 7600. Units that are powers of two change
    nothing else. Those of the problem itself come first.
    """
    yield 1.0, 1.0
    bounds = np.abs(problem.bounds).min(axis=1)
    change, distance = abs(problem.final[1] - problem.initial[1]), abs(problem.displacement)
    times = [
        distance / bounds[0],
        change / bounds[1],
        (change / bounds[2]) ** 0.5,
        (distance / bounds[2]) ** (1 / 3),
    ]
    time = 2.0 ** round(math.log2(duration or max(times) or 1.0))
    units = product((0, 8, -8, 16, -16), (1.0, time / 1024, time))
    yield from ((time_unit, 2.0**power) for power, time_unit in islice(units, 1, None))


def _call_ruckig(
    problem: BoundaryProblem, duration: float | None, time_unit: float, length_unit: float
) -> PhaseProfile | None:
    """Return ruckig's answer, or None when it fails."""
    import ruckig

    lead = _lead(problem)
    initial = problem.initial[1:] if lead is None else (*lead.states[-1][1:], 0.0)
    waited = 0.0 if lead is None else lead.duration
    _, velocity, acceleration, _ = units = [length_unit / time_unit**order for order in range(4)]
    lower, upper = (
        [value / unit for value, unit in zip(values, units[1:], strict=True)]
        for values in problem.bounds.T.tolist()
    )
    if (asked := _askable(problem, units)) is None:
        return None
    wanted = ruckig.InputParameter(1)
    wanted.control_interface = getattr(ruckig.ControlInterface, asked.control.capitalize())
    wanted.current_position, wanted.target_position = [0.0], [asked.displacement / length_unit]
    wanted.current_velocity = [initial[0] / velocity]
    wanted.current_acceleration = [initial[1] / acceleration]
    wanted.target_velocity = [inside(problem.final[1] / velocity, lower[0], upper[0])]
    reached = problem.final[2] / acceleration if problem.order == 3 else 0.0  # else none is too high
    wanted.target_acceleration = [inside(reached, lower[1], upper[1])]
    wanted.min_velocity, wanted.max_velocity = [lower[0]], [upper[0]]
    wanted.min_acceleration, wanted.max_acceleration = [lower[1]], [upper[1]]
    wanted.max_jerk = [min(-lower[2], upper[2])]
    if duration is not None:
        wanted.minimum_duration = max(duration - waited, 0.0) / time_unit
    answer = ruckig.Trajectory(1)
    try:
        if ruckig.Ruckig(1).calculate(wanted, answer) not in (ruckig.Result.Working, ruckig.Result.Finished):
            return None
    except (ruckig.RuckigError, ValueError):
        return None
    profile = _profile(asked, answer, time_unit, units, lead)
    # ruckig bounds no velocity where it controls the velocity
    return profile if not duration or asked is problem or _within(profile, problem.bounds) else None


def _lead(problem: BoundaryProblem) -> PhaseChain | None:
    """Return the phases that bring the start inside the bounds; None where ruckig does it, or none do."""
    if not problem.brake or problem.control != "velocity":
        return None
    from trajcli.curves.braking import braking

    phases = braking(*problem.initial[1:], problem.bounds).phases
    initial = (0.0, *problem.initial[1:])[: problem.order]
    return PhaseChain(initial, (math.nan,) * len(initial), *_apart(phases))


def _askable(problem: BoundaryProblem, units: Sequence[float]) -> BoundaryProblem | None:
    """Return what ruckig is asked for in units of the derivatives, None for nothing.

    Ruckig 0.19 ends the process where a variable comes back as it went: it has no room for so many cases. The
    fastest change to the opposite velocity and the same acceleration leads back, being the same backwards.
    """
    (start, speed, change), (end, back, last) = problem.initial, problem.final
    if problem.control == "velocity" or not speed or not change:
        return problem
    rounding = 4 * math.ulp(max(abs(start), abs(end)))
    missed = max(abs(problem.displacement) - rounding, 0.0) / (abs(speed / change * speed) or math.inf)
    unlike = max(missed, abs(1 + back / speed), abs(1 - last / change))
    if unlike <= _SAME:
        return replace(problem, control="velocity")
    hidden = _HIDDEN * (units[1] / abs(speed) + units[2] / abs(change))
    return None if unlike <= min(0.1, hidden) else problem


def inside(value: float, lower: float, upper: float) -> float:
    """Return the value, laid onto the bound that it exceeds by rounding."""
    laid = min(max(value, lower), upper)
    return laid if abs(value - laid) <= _ROUNDING * abs(value) else value


def _profile(
    problem: BoundaryProblem,
    answer: Any,  # noqa: ANN401
    time_unit: float,
    units: Sequence[float],
    lead: PhaseChain | None,
) -> PhaseProfile:
    """Return the phases of ruckig's answer in SI; those of length zero are left out."""
    profile, order = answer.profiles[0][0], problem.order
    parts = [(part.t, getattr(part, " vaj"[order])) for part in (profile.brake, profile, profile.accel)]
    phases = [
        [(t * time_unit, c * units[order]) for t, c in zip(*part, strict=False) if t > 0] for part in parts
    ]
    if lead is not None:
        phases[0] = [*zip(lead.durations, lead.constants, strict=True), *phases[0]]
    free = problem.control == "velocity"
    final = (math.nan if free else problem.displacement, *problem.final[1:])[:order]
    times, constants = _apart([phase for part in phases for phase in part])
    chain = PhaseChain((0.0, *problem.initial[1:])[:order], final, times, constants).with_cruises()
    duration = answer.duration * time_unit + (0.0 if lead is None else lead.duration)
    return PhaseProfile(problem.initial[0], chain, duration, len(phases[0]))


def _apart(phases: Sequence[tuple[float, float]]) -> tuple[tuple[float, ...], tuple[float, ...]]:
    return tuple(time for time, _ in phases), tuple(constant for _, constant in phases)
