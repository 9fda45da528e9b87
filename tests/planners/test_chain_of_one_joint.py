"""Bounds of chains of one joint, which goes as if there were no corners: by its phase plane, and by ruckig with jerk.

Over the way x of a joint the square of its velocity rises by 2 a and falls by 2 d at the most, below that of each
part: the largest such function is the fastest motion (Bobrow, Dubowsky and Gibson 1985).
"""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import ruckig
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from tiers import few

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.kinematics.robot import Limits
from trajcli.planners.flying_by.between_stops import CornerZone, FlyByChain
from trajcli.planners.flying_by.second_order import second_order_duration

Array = NDArray[np.float64]
UP, DOWN, FAST = 3.0, 5.0, 1.6
HERE = 0.9  # rad or m: where the joint starts
GRID = 500


def chain_of(
    slopes: list[Polynomial],
    zone: float,
    ends: tuple[tuple[float, float], tuple[float, float]] = ((0.0, 0.0), (0.0, 0.0)),
    *,
    speeds: tuple[float, ...] | None = None,
    jerk: float = np.inf,
    sign: float = 1.0,
) -> FlyByChain:
    """Return a chain of courses with given q' of s from 0 to 1, zones of a length in s on both sides of corners.

    Args:
        slopes: Of the joint.
        zone: Its length on either side.
        ends: sd and sdd at the start and at the end.
        speeds: Limits of sd along each course; None for none.
        jerk: Limit of both directions.
        sign: Of the direction of all: at -1 the joint goes the other way, with limits that are mirrored.
    """
    bounds = ([-1e9, 1e9], [-9.0, FAST], [-DOWN, UP], [-jerk, jerk])
    position, *others = (np.sort(sign * np.array([each])) for each in bounds)
    robot: Any = SimpleNamespace(limits=Limits(position, others[0], others[1], others[2]))
    courses: list[Any] = []
    here = HERE
    for k, slope in enumerate(slopes):
        row = np.array(slope.integ(k=[here]).coef, dtype=np.float64)
        here = float(row.sum())
        curve = PiecewisePolynomial(np.array([0.0, 1.0]), sign * row[::-1][:, None, None])
        along = None if speeds is None else (speeds[k], np.inf, np.inf)
        courses.append(SimpleNamespace(curve=curve, robot=robot, limits_along=along, length=1.0))
    around: Any = None
    corners = (CornerZone(around, 1.0 - zone, zone, robot),) * (len(slopes) - 1)
    own: Any = tuple(courses)
    return FlyByChain(own, corners, (np.array(ends[0]), np.array(ends[1])), (1.0,) * len(courses))


def fastest(parts: list[tuple[float, float]], first: float, last: float) -> float:
    """Return the least duration over parts of a way with their largest velocities, between two velocities."""
    lengths = np.concatenate([np.full(GRID, length / GRID) for length, _ in parts])
    caps = np.concatenate([np.full(GRID, cap**2) for _, cap in parts])
    tops = np.minimum(np.append(caps, caps[-1]), np.insert(caps, 0, caps[0]))
    tops[0], tops[-1] = first**2, last**2
    for k, length in enumerate(lengths):
        tops[k + 1] = min(tops[k + 1], tops[k] + 2 * UP * length)
    for k in range(len(lengths) - 1, -1, -1):
        tops[k] = min(tops[k], tops[k + 1] + 2 * DOWN * lengths[k])
    assert (tops[0], tops[-1]) == (first**2, last**2)
    velocity = np.sqrt(tops)
    return float((2 * lengths / (velocity[1:] + velocity[:-1])).sum())


STRAIGHT = [2.0, 0.5, 1.0]


@pytest.mark.parametrize(
    ("speeds", "ends", "known", "sign"),
    [
        ((9.0, 9.0, 9.0), (0.0, 0.0), 1.01, 1.0),
        ((9.0, 9.0, 9.0), (0.3, 0.8), 1.5, -1.0),
        ((0.3, 9.0, 0.7), (0.6, 0.0), 1.01, -1.0),
        ((0.3, 9.0, 0.7), (0.0, 0.6), 1.5, 1.0),
        ((9.0, 0.9, 0.3), (0.7, 0.3), 1.01, 1.0),
        ((9.0, 0.9, 0.3), (0.7, 0.3), 1.5, -1.0),
    ],
)
def test_along_straight_courses_it_is_near_to_the_fastest_motion(
    speeds: tuple[float, ...], ends: tuple[float, float], known: float, sign: float
) -> None:
    """Whether the motion that is known is nearly the fastest, or far from it."""
    zone = 0.08
    parts = []
    for k, (slope, speed) in enumerate(zip(STRAIGHT, speeds, strict=True)):
        parts += [(slope * (1 - zone * (1 if k in (0, 2) else 2)), min(FAST, slope * speed))]
        parts += [(zone * (slope + STRAIGHT[k + 1]), FAST)] if k < 2 else []
    exact = fastest(parts, *ends)
    rates = (ends[0] / STRAIGHT[0], -0.4), (ends[1] / STRAIGHT[2], 0.3)
    chain = chain_of([Polynomial([slope]) for slope in STRAIGHT], zone, rates, speeds=speeds, sign=sign)
    bound = second_order_duration(chain, known * exact)
    assert 0.999 * exact <= bound <= exact


BENT = {
    "speeds rise to the zone, and fall behind it": [Polynomial([2.0, -1.5]), Polynomial([0.5, 1.5])],
    "speeds fall to the zone, and rise behind it": [Polynomial([0.5, 1.5]), Polynomial([2.0, -1.5])],
    "speeds rise": [Polynomial([2.0, -1.5]), Polynomial([2.0, -1.5])],
    "speeds fall": [Polynomial([0.5, 1.5]), Polynomial([0.5, 1.5])],
}


@pytest.mark.parametrize(("name", "zone"), list(zip(BENT, [0.02, 0.02, 0.2, 0.2], strict=True)))
def test_along_bent_courses_it_is_not_above_the_fastest_motion(name: str, zone: float) -> None:
    """Speeds over s are the joint's velocity by q', which is four times as large at one end as at the other."""
    exact = fastest([(2 * 1.25, FAST)], 0.0, 0.0)
    bound = second_order_duration(chain_of(BENT[name], zone), 1.3 * exact)
    assert 0.93 * exact <= bound <= exact


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_where_the_joint_turns_back_it_stops(sign: float) -> None:
    """Before a zone of next to nothing: what is behind it is the same way, the other way round."""
    chain = chain_of([Polynomial([1.0]), Polynomial([-0.7])], 1e-6, sign=sign)
    peak = np.sqrt(2 * 0.7 / (1 / UP + 1 / DOWN))  # on the way back, speeding up by DOWN
    exact = fastest([(1.0, FAST)], 0.0, 0.0) + peak / UP + peak / DOWN
    for known, near in ((1.01, 0.992), (1.2, 0.983)):
        assert near * exact <= second_order_duration(chain, known * exact) <= exact


def by_ruckig(way: float, first: tuple[float, float], last: tuple[float, float], jerk: float) -> float:
    otg, given, found = ruckig.Ruckig(1), ruckig.InputParameter(1), ruckig.Trajectory(1)
    given.current_velocity, given.current_acceleration = [first[0]], [first[1]]
    given.target_position, given.target_velocity, given.target_acceleration = [way], [last[0]], [last[1]]
    given.max_velocity, given.max_acceleration, given.min_acceleration = [FAST], [UP], [-DOWN]
    given.max_jerk = [jerk]
    assert otg.calculate(given, found) == ruckig.Result.Working
    return float(found.duration)


@pytest.mark.parametrize(
    ("jerk", "near", "moving", "at_end"),
    [
        (*limit, moving, (k + j) % 2 == 1)
        for k, moving in enumerate(
            few([(0.0, 0.0), (0.0, 2.9), (0.5, 0.0), (0.5, 2.0), (1.2, -1.0), (0.3, 1.0)], 3)
        )
        for j, limit in enumerate([(4.0, 0.64), (30.0, 0.94)])
    ],
)
def test_with_jerk_it_is_not_above_the_motion_of_ruckig(
    moving: tuple[float, float], jerk: float, near: float, *, at_end: bool
) -> None:
    """From a state in motion, or one with an acceleration alone: jerk from rest counts at the other end only."""
    slopes, rest = [Polynomial([0.5]), Polynomial([0.2]), Polynomial([0.3])], (0.0, 0.0)
    states = (rest, (moving[0], -moving[1])) if at_end else (moving, rest)
    exact = by_ruckig(1.0, *states, jerk)
    first, last = (
        (state[0] / each(0.0), state[1] / each(0.0)) for state, each in zip(states, slopes[::2], strict=True)
    )
    chain = chain_of(slopes, 0.1, (first, last), jerk=jerk, sign=-1.0 if at_end else 1.0)
    bound = second_order_duration(chain, 1.4 * exact)
    assert near * exact <= bound <= exact


def test_a_border_that_rounding_leaves_without_states_ends_the_search(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The least of all ways is the same at every border, but for rounding: what it made of the first look stands."""
    from trajcli.planners.flying_by import second_order

    chain = chain_of([Polynomial([1.0]), Polynomial([1.0])], 0.2)
    sums, looks = second_order.least_sums, list[int]()

    def rounded(lasting: list[Array]) -> Any:
        looks.append(len(lasting))
        before, behind = sums(lasting)
        return before, [rows + (k == 1) * 1e9 for k, rows in enumerate(behind)]

    bound = second_order_duration(chain, 10.0)
    monkeypatch.setattr(second_order, "least_sums", rounded)
    assert 0.5 * bound < second_order_duration(chain, 10.0) <= bound
    assert len(looks) == 1
