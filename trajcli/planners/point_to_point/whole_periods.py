"""Laws from rest to rest whose phases last whole periods, so that their breaks fall on rows.

Between two rows such a law is one polynomial, which the rows determine: of degree three where the jerk is
limited, of degree two without. The numbers of periods are searched; velocity, acceleration and jerk follow.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from trajcli.curves.operations import along_line, merge_breaks
from trajcli.curves.phases import PhaseChain
from trajcli.curves.piecewise import Array, constant
from trajcli.kinematics.robot import Robot
from trajcli.planners.planner import Phase, Planned
from trajcli.planners.ruckig import PhaseProfile
from trajcli.trajectory import State

_WHOLE = 1e-9  # of a period: what is this close to whole is whole
_LONGEST = 4.0  # times the fastest: a period that is too coarse for more is no help
_MOST_PERIODS = 1_000_000
_SHARE = 1 - 1e-12  # of a limit: what rounding may add


class PhasesInPeriods:
    """How many periods the phases of laws last, all of which take as long.

    A law has the distance d, of N periods h: n_j of rising acceleration, then n_a of constant one, both twice
    on either side, and the rest at its velocity. With m = n_j + n_a it is v = d / (h (N - n_j - m)), the
    acceleration v / (h m), and the jerk that over h n_j. With n_j = 0 there is no jerk.

    Source: Biagiotti and Melchiorri (2008), section 3.4, for given lengths of the phases.
    """

    def __init__(self, period: float, *, smooth: bool) -> None:
        """Take the period, s, and whether the acceleration is continuous."""
        self._period, self._smooth = period, smooth

    def lengths(self, distance: float, bounds: Sequence[float], count: int) -> tuple[int, int, int] | None:
        """Return n_j, n_a and the periods at constant velocity; None where no law keeps its limits.

        Args:
            distance: Above 0.
            bounds: Largest velocity, acceleration and jerk.
            count: Periods in all.
        """
        h = self._period
        rises = np.arange(1, count // 4 + 1) if self._smooth else np.zeros(1, dtype=np.int64)
        # the velocity is lower, and the acceleration higher, the shorter the ramps are
        slowest = np.floor(count - rises - distance / (h * bounds[0] * _SHARE) + _WHOLE)
        ramps = np.minimum(count // 2 - rises, slowest).astype(np.int64)
        possible = ramps >= np.maximum(rises, 1)
        rises, ramps = rises[possible], ramps[possible]
        if not rises.size:
            return None
        velocity = distance / (h * (count - rises - ramps))
        acceleration = velocity / (h * ramps)
        used = np.maximum(velocity / bounds[0], acceleration / bounds[1])
        if self._smooth:
            used = np.maximum(used, acceleration / (h * rises) / bounds[2])
        best = int(used.argmin())
        if used[best] > 1 + _WHOLE:
            return None
        rise, ramp = int(rises[best]), int(ramps[best])
        return rise, ramp - rise, count - 2 * (rise + ramp)

    def common(
        self, distances: Sequence[float], bounds: Sequence[Sequence[float]], least: float
    ) -> tuple[int, list[tuple[int, int, int]]] | None:
        """Return the smallest number of periods that all laws can last, and their phases; None for none.

        Args:
            distances: Of the laws, above 0.
            bounds: Of each.
            least: Shortest duration, s.
        """
        for distance, (velocity, acceleration, *_) in zip(distances, bounds, strict=True):
            top = min(velocity, math.sqrt(distance * acceleration))  # of a trapezoid, which no law undercuts
            least = max(least, (distance / top + top / acceleration) * (1 - 10 * _WHOLE))
        first = max(math.ceil(least / self._period - _WHOLE), 4 if self._smooth else 2)
        if first > _MOST_PERIODS:
            return None
        for count in range(first, max(int(_LONGEST * first), first + 16)):
            found: list[tuple[int, int, int]] = []
            for distance, bound in zip(distances, bounds, strict=True):
                lengths = self.lengths(distance, bound, count)
                if lengths is None:
                    break
                found.append(lengths)
            else:
                return count, found
        return None


def rates_forward(displacement: Array, robot: Robot) -> Array:
    """Return largest velocity, acceleration and jerk of moves along a displacement, either way, (n, 3)."""
    limits = robot.limits
    forward = (displacement > 0).astype(int)
    joints = np.arange(displacement.size)
    velocity = np.abs(limits.velocity[joints, forward])
    return np.stack([velocity, np.abs(limits.acceleration).min(axis=1), np.abs(limits.jerk).min(axis=1)], 1)


def profile_in_periods(
    start: float, displacement: float, lengths: tuple[int, int, int], period: float, *, smooth: bool
) -> PhaseProfile:
    """Return the motion of one variable whose phases last so many periods.

    Args:
        start: Where it begins.
        displacement: Signed, not 0.
        lengths: From `PhasesInPeriods`.
        period: s.
        smooth: Whether the acceleration is continuous.
    """
    rise, flat, cruise = lengths
    ramp = rise + flat
    velocity = displacement / (period * (2 * (rise + ramp) + cruise - rise - ramp))
    acceleration = velocity / (period * ramp)
    counts: tuple[int, ...] = (ramp, cruise, ramp)
    constants: tuple[float, ...] = (acceleration, 0.0, -acceleration)
    if smooth:
        jerk = acceleration / (period * rise)
        counts, constants = (rise, flat, rise, cruise, rise, flat, rise), (jerk, 0, -jerk, 0, -jerk, 0, jerk)
    phases = [(count * period, constant) for count, constant in zip(counts, constants, strict=True) if count]
    times, values = zip(*phases, strict=True)
    rates = (0.0,) * (2 if smooth else 1)
    chain = PhaseChain((0.0, *rates), (displacement, *rates), times, values).with_cruises()
    return PhaseProfile(start, chain, sum(counts) * period)


def jerk_limited_in_periods(
    start: State, end: State, robot: Robot, period: float, least: float, *, on_line: bool
) -> Planned | None:
    """Return a move between states of rest whose phases last whole periods; None where none keeps its limits.

    Args:
        start: At rest.
        end: At rest.
        robot: With the limits in force.
        period: s.
        least: Shortest duration, s.
        on_line: Whether one law moves all joints along a straight line; else they arrive together.
    """
    displacement = end.position - start.position
    moving = np.flatnonzero(displacement)
    bounds = rates_forward(displacement, robot)[moving]
    if not moving.size or not np.isfinite(bounds[:, :2]).all():
        return None
    smooth, sizes = bool(np.isfinite(bounds[:, 2]).any()), np.abs(displacement[moving])
    distances = [1.0] if on_line else sizes.tolist()
    each = [(bounds / sizes[:, None]).min(axis=0)] if on_line else [*bounds]
    found = PhasesInPeriods(period, smooth=smooth).common(distances, each, least)
    if found is None:
        return None
    count, lengths = found
    if on_line:
        profile = profile_in_periods(0.0, 1.0, lengths[0], period, smooth=smooth)
        law = profile.curve()
        return Planned(along_line(start.position, displacement, law), end, law, tuple(profile.phases(None)))
    curves = [constant([origin], count * period) for origin in start.position.tolist()]
    phases: list[Phase] = []
    for joint, own in zip(moving.tolist(), lengths, strict=True):
        origin, distance = float(start.position[joint]), float(displacement[joint])
        profile = profile_in_periods(origin, distance, own, period, smooth=smooth)
        curves[joint] = profile.curve()
        phases += profile.phases(joint)
    phases.sort(key=lambda phase: (phase.start, phase.joint or 0))
    return Planned(merge_breaks(curves), end, phases=tuple(phases))
