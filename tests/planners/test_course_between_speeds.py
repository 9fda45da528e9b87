"""What a bent course lasts at least between speeds, against linear programmes on a grid of its own.

With b = sd^2 as a function of s all limits are linear in b and b', and of all b the largest is the fastest
(Verscheure et al. 2009): a programme finds it without any of the cells of the bound.
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import linprog
from test_zone_between_velocities import fastest as fastest_alone

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.kinematics.robot import Limits
from trajcli.planners.flying_by.second_order import CoursePart, course_part

Array = NDArray[np.float64]
LONGEST = 99.0
GRID = 100
LOOSE = 1e6
VELOCITY = np.array([[-1.0, 2.0], [-3.0, 0.8]])
ACCELERATION = np.array([[-2.0, 6.0], [-9.0, 3.0]])
BENDS = {
    "forth": [[0.3, 0.0, 1.0, 0.0], [-0.2, 0.4, 0.7, 0.0]],
    "back": [[-0.3, 0.0, -1.0, 0.0], [0.2, -0.4, -0.7, 0.0]],
    "one turns": [[0.0, 0.0, 1.2, 0.0], [0.0, 1.0, -0.8, 0.0]],
    "the other one turns": [[0.0, -1.0, 0.8, 0.0], [0.0, 0.3, -1.5, 0.0]],
    "bent more and more": [[0.9, 0.0, 0.4, 0.0], [0.0, 0.0, 0.5, 0.0]],
    "bent less and less": [[-0.9, 2.7, 0.2, 0.0], [0.0, 0.0, -0.5, 0.0]],
}
"""Polynomials of s from 0 to 1, by the joint, highest power first."""
NEAR = dict(zip(BENDS, (0.92, 0.985, 0.985, 0.86, 0.78, 0.91), strict=True))
"""Shares of the duration that the bound reaches, with limits of joints alone."""
INFINITE = (np.inf, np.inf, np.inf)
ALONG = {"free": INFINITE, "slow": (0.5, np.inf, np.inf), "up": (9.0, 0.6, 9.0), "down": (9.0, 9.0, 0.6)}
SPEEDS = [(0.05, 0.3), (0.4, 0.1)]


def part_of(
    name: str, along: tuple[float, ...] = INFINITE, stretch: tuple[float, float] = (0.1, 0.9)
) -> CoursePart:
    """Return the course of some polynomials without limits of jerk, which knows its own limits of the law."""
    coefficients = np.array(BENDS[name]).T[:, None]
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), coefficients)
    none = np.tile([-np.inf, np.inf], (2, 1))
    limits = Limits(none, VELOCITY, ACCELERATION, none)
    course: Any = SimpleNamespace(curve=curve, robot=SimpleNamespace(limits=limits), limits_along=along)
    return course_part(course, stretch, (False, False))


def fastest(name: str, along: tuple[float, ...], ends: tuple[float, float]) -> float:
    """Return the duration between two speeds from 0.1 to 0.9 by a linear programme; infinite where there is none."""
    s = np.linspace(0.1, 0.9, GRID + 1)
    step = s[1] - s[0]
    slopes = np.stack([np.polyval(np.polyder(row), s) for row in BENDS[name]], axis=1)
    bends = np.stack([np.polyval(np.polyder(row, 2), s) for row in BENDS[name]], axis=1)
    with np.errstate(divide="ignore"):
        speeds = np.where(slopes > 0, VELOCITY[:, 1], -VELOCITY[:, 0]) / np.abs(slopes)
    tops = np.minimum(speeds.min(axis=1), min(along[0], LOOSE)) ** 2
    up, down = (min(each, LOOSE) for each in along[1:])
    rows, bounds = [], []
    for k in range(GRID):
        change = np.zeros(GRID + 1)
        change[k : k + 2] = -0.5 / step, 0.5 / step
        rows += [change, -change]
        bounds += [up, down]
        for at in (k, k + 1):
            for joint in range(2):
                row = slopes[at, joint] * change
                row[at] += bends[at, joint]
                rows += [row, -row]
                bounds += [ACCELERATION[joint, 1], -ACCELERATION[joint, 0]]
    limits = np.stack([np.zeros(GRID + 1), tops], axis=1)
    for at, speed in zip((0, -1), ends, strict=True):
        if speed**2 > tops[at]:
            return float("inf")
        limits[at] = speed**2
    found = linprog(-np.ones(GRID + 1), A_ub=np.array(rows), b_ub=np.array(bounds), bounds=limits)
    if not found.success:
        return float("inf")
    sd = np.sqrt(found.x)
    return float((2 * step / (sd[1:] + sd[:-1])).sum())


def lasting(part: CoursePart, first: tuple[float, float], last: tuple[float, float]) -> float:
    return float(part.durations(np.array([first]), np.array([last]), LONGEST)[0, 0])


CASES = [(name, "free") for name in BENDS] + [
    (name, along) for name in ("forth", "bent more and more") for along in ("slow", "up", "down")
]


@pytest.mark.parametrize(("name", "along"), CASES)
def test_it_is_below_the_fastest_motion_and_near_to_it(name: str, along: str) -> None:
    """How near depends on how much joints bend within a cell; limits of the law are known exactly."""
    part = part_of(name, ALONG[along])
    for ends in SPEEDS:
        exact = fastest(name, ALONG[along], ends)
        first, last = ((speed, speed) for speed in ends)
        bound = lasting(part, first, last)
        assert (NEAR[name] if along == "free" else 0.87) * exact <= bound <= exact * 1.003


@pytest.mark.parametrize("name", ["forth", "back", "the other one turns"])
def test_of_speeds_anywhere_in_intervals_it_is_that_of_the_fastest(name: str) -> None:
    """Upper ends that no motion reaches do no harm; where no speed is reached nothing is possible."""
    part = part_of(name)
    exact = fastest(name, INFINITE, (0.4, 0.3))
    assert NEAR[name] * exact <= lasting(part, (0.05, 0.4), (0.1, 0.3)) <= exact * 1.003
    assert lasting(part, (0.05, 50.0), (0.05, 0.3)) <= exact * 1.003
    assert lasting(part, (0.4, 0.4), (0.05, 50.0)) <= exact * 1.003
    assert lasting(part, (50.0, 60.0), (0.05, 0.3)) == LONGEST
    assert lasting(part, (0.05, 0.3), (50.0, 60.0)) == LONGEST


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("at_end", [False, True])
def test_next_to_a_stop_the_jerk_of_the_direction_counts(sign: float, *, at_end: bool) -> None:
    """With hardly any other limit s takes (6 s / J)^(1/3) from rest, and to rest: from there jerk has the same sign."""
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[2.0 * sign]], [[0.3]]]))
    loose, jerk = np.array([[-1e6, 1e6]]), np.array([[-30.0, 60.0]])
    limits = SimpleNamespace(limits=Limits(loose, loose, loose, jerk))
    course: Any = SimpleNamespace(curve=curve, robot=limits, limits_along=None)
    part = course_part(course, (0.5, 1.0) if at_end else (0.0, 0.5), (not at_end, at_end))
    speeds = [(0.0, 0.0), (0.0, 1e5)]
    exact = (6 * 0.5 * 2 / (60.0 if sign > 0 else 30.0)) ** (1 / 3)
    assert lasting(part, *(speeds[::-1] if at_end else speeds)) == pytest.approx(exact, rel=1e-9)
    reached = (4.5 * (60.0 if sign > 0 else 30.0) * 1.0**2) ** (1 / 3) / 2  # by s, behind 1 rad
    fast, slow = (1.02 * reached,) * 2, (0.98 * reached,) * 2
    for other, possible in ((fast, False), (slow, True)):
        found = lasting(part, *((other, (0.0, 0.0)) if at_end else ((0.0, 0.0), other)))
        assert (found < LONGEST) == possible


MONOTONE = {
    "more": [1.0, 0.0, 0.02, 0.0],
    "less": [1.0, -3.0, 3.02, 0.0],
    "both": [2.0, -3.0, 1.6, 0.0],
    "straight": [0.0, 0.0, 1.0, 0.0],
}
"""Polynomials that rise from 0 to 1, whose slopes differ within a cell."""


def alone(pieces: Array, velocity: float, acceleration: tuple[float, float]) -> CoursePart:
    """Return the course of one joint from 0.1 to 0.9, in one piece or two."""
    breaks = np.linspace(0.0, 1.01, len(pieces) + 1)
    curve = PiecewisePolynomial(breaks, pieces.T[:, :, None])
    limits = Limits(
        *(np.array([row]) for row in ([-(LOOSE**2), LOOSE**2], [-velocity, velocity])),
        np.array([[-acceleration[0], acceleration[1]]]),
        np.array([[-np.inf, np.inf]]),
    )
    course: Any = SimpleNamespace(curve=curve, robot=SimpleNamespace(limits=limits), limits_along=None)
    return course_part(course, (0.1, 0.9), (False, False))


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("velocity", [0.6, 9.0])
@pytest.mark.parametrize("name", MONOTONE)
def test_of_one_joint_alone_it_is_never_above_its_fastest_motion(
    name: str, velocity: float, sign: float
) -> None:
    """However its path is bent over s, the joint goes its way as on a straight line; strong bends widen cells."""
    row = sign * np.array(MONOTONE[name])
    part = alone(row[None], velocity, (5.0, 2.0))
    step = np.polyval(row, 0.9) - np.polyval(row, 0.1)
    v0, v1 = np.polyval(np.polyder(row), [0.1, 0.9])
    for first, last in ((0.1, 0.1), (0.05, 0.25), (0.25, 0.05)):
        exact = fastest_alone(step, v0 * first, v1 * last, (-velocity, velocity, 5.0, 2.0))
        bound = lasting(part, (first, first), (last, last))
        assert (0.7 if velocity < 1 else 0.05) * exact <= bound <= exact * (1 + 1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("slopes", [(1.0, 3.0), (3.0, 1.0)])
def test_a_break_within_a_cell_parts_it(slopes: tuple[float, float], sign: float) -> None:
    """At the largest velocity throughout the joint takes its way by it, behind the break as before."""
    half = 0.505
    part = alone(sign * np.array([[slopes[0], 0.0], [slopes[1], half * slopes[0]]]), 0.5, (1e9, 1e9))
    exact = ((half - 0.1) * slopes[0] + (0.9 - half) * slopes[1]) / 0.5
    bound = lasting(part, *((0.5 / slope,) * 2 for slope in slopes))
    assert 0.95 * exact <= bound <= exact * (1 + 1e-9)
