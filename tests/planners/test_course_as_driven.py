"""Bounds of courses against motions that use up limits: what some motion does must be possible, in its time.

Of a motion as polynomials of t all derivatives are known, and limits are set to what it takes. In a cell of s the
squares of the speed and its changes that limits of velocity and acceleration allow are a polygon at each s.
"""

from __future__ import annotations

from itertools import combinations
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from numpy.typing import NDArray
from tiers import few

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.kinematics.robot import Limits
from trajcli.planners.flying_by.second_order import CoursePart, course_part

Array = NDArray[np.float64]
LONGEST = 99.0
INFINITE = (np.inf, np.inf, np.inf)
CELLS = 48


def part_of(
    joints: list[Polynomial],
    limits: list[Array],
    stops: tuple[bool, bool] = (False, False),
    along: tuple[float, ...] = INFINITE,
    at: float = 0.5,
) -> CoursePart:
    """Return the course of cubics of s from 0 to 1 in two pieces that meet at some s, with limits of its joints.

    Those are of velocity, acceleration and jerk, each (n, 2).
    """
    pieces = [[row(Polynomial([low, 1.0])).coef for row in joints] for low in (0.0, at)]
    coefficients = [[np.pad(row, (0, 4 - row.size))[::-1] for row in piece] for piece in pieces]
    curve = PiecewisePolynomial(np.array([0.0, at, 1.0]), np.array(coefficients).transpose(2, 0, 1))
    robot = SimpleNamespace(
        limits=Limits(np.tile([-np.inf, np.inf], (len(joints), 1)), limits[0], limits[1], limits[2])
    )
    course: Any = SimpleNamespace(curve=curve, robot=robot, limits_along=along)
    return course_part(course, (0.0, 1.0), stops)


def lasting(part: CoursePart, first: float, last: float) -> float:
    return float(part.durations(np.full((1, 2), first), np.full((1, 2), last), LONGEST)[0, 0])


def states_at(
    s: float, joints: list[Polynomial], velocity: Array, acceleration: Array, along: tuple[float, ...]
) -> Array:
    """Return the corners (m, 2) of the polygon of sd^2 and sdd at a place."""
    first, bend = (np.array([row.deriv(order)(s) for row in joints]) for order in (1, 2))
    with np.errstate(divide="ignore"):
        speeds = np.where(first > 0, velocity[:, 1], -velocity[:, 0]) / np.abs(first)
    most = [min(float(speeds.min()), along[0]) ** 2, *along[1:]]
    both = np.stack([bend, first], axis=1)
    rows = np.concatenate([both, -both, [[-1.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.0, -1.0]]])
    bounds = np.concatenate([acceleration[:, 1], -acceleration[:, 0], [0.0], np.minimum(most, 1e9)])
    one, other = np.array(list(combinations(range(len(rows)), 2))).T
    (a, b), (c, d), e, f = rows[one].T, rows[other].T, bounds[one], bounds[other]
    cross = a * d - b * c
    kept = np.abs(cross) > 1e-12
    found = (np.stack([e * d - b * f, a * f - e * c])[:, kept] / cross[kept]).T
    rounding = 1e-9 * np.maximum(np.abs(found) @ np.abs(rows.T), 1.0)
    return np.asarray(found[(found @ rows.T <= bounds + rounding).all(axis=1)])


BENT = {
    "forth and back": [[0.0, 0.8, 0.3, -0.2], [0.0, -0.9, 0.2, 0.1]],
    "one turns": [[0.0, 1.0, 0.2], [0.0, -1.5, 2.0, 0.0]],
    "one turns the other way": [[0.0, -1.0, 0.1], [0.0, 1.5, -2.0, 0.0]],
    "bends change": [[0.0, 1.0, -9.0, 9.0], [0.0, 0.4]],
    "bends change, mirrored": [[0.0, -1.0, 9.0, -9.0], [0.0, 0.4]],
    "both turn": [[0.0, 0.6, 0.0, -1.0], [0.0, -0.4, 1.2, 0.0]],
}
FURTHER = {
    "to and fro": [[0.0, 1.0], [0.0, 0.32, -1.2, 1.0]],
    "fro and to": [[0.0, 1.0], [0.0, -0.32, 1.2, -1.0]],
    "turns at once": [[0.0, 1.0], [0.0, -0.01, 1.0]],
    "turns at once, mirrored": [[0.0, -1.0], [0.0, 0.01, -1.0]],
    "straight": [[0.0, 1e-4], [0.0, -5e-5]],
}


@pytest.mark.parametrize(
    ("name", "along"),
    [
        (name, along)
        for k, name in enumerate(BENT)
        for j, along in enumerate([INFINITE, (0.7, 0.4, 5.0), (0.7, 5.0, 0.4)])
        if (k + j) % 2 == 0
    ],
)
def test_bounds_of_cells_are_those_of_the_states_that_limits_allow_in_them(
    name: str, along: tuple[float, ...]
) -> None:
    """None is beyond them; most cells are so short that they are hardly higher than at their ends and middle."""
    joints = [Polynomial(row) for row in BENT[name]]
    velocity, acceleration = np.array([[-1.0, 2.0], [-3.0, 0.8]]), np.array([[-2.0, 6.0], [-0.5, 1.5]])
    part = part_of(joints, [velocity, acceleration, np.tile([-np.inf, np.inf], (2, 1))], along=along)
    states = [states_at(s, joints, velocity, acceleration, along) for s in np.linspace(0, 1, 2 * CELLS + 1)]
    largest = np.array([[each[:, 0].max(), 2 * each[:, 1].max(), -2 * each[:, 1].min()] for each in states])
    allowed = np.maximum(largest[1::2], np.maximum(largest[:-1:2], largest[2::2]))
    beyond = np.stack([part.caps, part.rises, part.falls], axis=1) / allowed
    assert (beyond >= 1 - 1e-6).all()
    assert (np.median(beyond, axis=0) <= 1.05).all()
    assert (beyond <= 4.0).all()


LAWS = {  # of the time from 0 to 1, with which ends are stops
    "from rest by one jerk": ([0.0, 0.0, 0.0, 1.0], (True, False)),
    "to rest by one jerk": ([0.0, 3.0, -3.0, 1.0], (False, True)),
    "from rest by two jerks": ([0.0, 0.0, 0.0, 4.0, -3.0], (True, False)),
    "from rest to rest": ([0.0, 0.0, 0.0, 10.0, -15.0, 6.0], (True, True)),
    "faster": ([0.0, 0.4, 0.6], (False, False)),
    "slower": ([0.0, 1.7, -0.7], (False, False)),
    "slower, then faster": ([0.0, 2.0, -3.0, 2.0], (False, False)),
}


EXACT = {"from rest by one jerk": 3, "to rest by one jerk": 3, "faster": 2, "slower": 2}
"""The derivatives by s or t that are the same throughout, so that a joint that goes straight uses up its limit."""
STRAIGHT = ("bends change", "bends change, mirrored", "to and fro", "fro and to", "straight")


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("law", few(LAWS, 4))
@pytest.mark.parametrize("name", few([*BENT, *FURTHER], 4))
def test_a_motion_that_uses_up_limits_is_not_below_the_bound(name: str, law: str, order: int) -> None:
    """Limits of one derivative, or of all up to it, are what it takes; others are far away."""
    time, stops, joints = 1.7, LAWS[law][1], [Polynomial(row) for row in {**BENT, **FURTHER}[name]]
    s = Polynomial(LAWS[law][0])(Polynomial([0.0, 1 / time]))
    moved = [joint(s) for joint in joints]
    t = np.linspace(0.0, time, 1001)
    limits, loose = [], np.array([-1e6, 1e6])
    for each in (1, 2, 3):
        values = np.array([row.deriv(each)(t) for row in moved])
        little = 1e-3 * np.abs(values).max(axis=1) + 1e-9
        both = np.minimum(values.min(axis=1), -little), np.maximum(values.max(axis=1), little)
        limits.append(np.stack(both, axis=1))
    first, last = (max(float(s.deriv()(at)), 0.0) for at in (0.0, time))
    only = [own if k + 1 == order else np.tile(loose, (2, 1)) for k, own in enumerate(limits)]
    up_to = [own if k < order else np.tile(loose, (2, 1)) for k, own in enumerate(limits)]
    for chosen in (only, up_to):
        part = part_of(joints, [(1 + 1e-5) * own for own in chosen], stops)
        found = lasting(part, first, last)
        assert found <= time
        if name in STRAIGHT and order == EXACT.get(law):
            assert found >= 0.9999 * time
            assert lasting(part, 1.05 * first, 1.05 * last) == LONGEST  # not within its limits


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("bend", [2.7, -2.7])
def test_along_a_bent_course_the_jerk_of_one_joint_counts_for_its_own_way(bend: float, sign: float) -> None:
    """From rest, or to rest, by one jerk: q takes (6 q / J)^(1/3), and its velocity at the end is J t^2 / 2."""
    row, jerk = Polynomial([0.0, 1.5 - 0.5 * bend, 0.5 * bend]), 30.0
    loose, time = np.array([[-1e6, 1e6]]), (6 * 1.5 / jerk) ** (1 / 3)
    limits = [loose, loose, np.sort(sign * np.array([[-7.0, jerk]]))]
    for stops, end in (((True, False), 1.0), ((False, True), 0.0)):
        part = part_of([sign * row], limits, stops)
        speed = 0.5 * jerk * time**2 / row.deriv()(end)
        for share, possible in ((0.99, True), (1.12, False)):
            moving = share * speed
            found = lasting(part, 0.0, moving) if stops[0] else lasting(part, moving, 0.0)
            assert 0.95 * time <= found <= time if possible else found == LONGEST
    both = lasting(part_of([sign * row], limits, (True, True)), 0.0, 0.0)
    assert 0.88 <= both / (32 * 1.5 / jerk) ** (1 / 3) <= 1.0  # of jerk alone, with its four phases


@pytest.mark.parametrize("share", [5e-4, 0.5])
@pytest.mark.parametrize("at_end", [False, True])
def test_a_joint_that_hardly_moves_at_first_counts_from_there(share: float, *, at_end: bool) -> None:
    """It moves with s all the same; what it takes by one jerk is known whatever the path over s is."""
    row, loose = Polynomial([0.0, share, 1.0 - share]), np.array([[-1e6, 1e6]])
    if at_end:
        row = 1.0 - row(Polynomial([1.0, -1.0]))
    part = part_of([row], [loose, loose, np.array([[-30.0, 30.0]])], (not at_end, at_end))
    time, first = (6 / 30.0) ** (1 / 3), row.deriv()(0.0 if at_end else 1.0)
    speeds = 0.0, 0.5 * 30.0 * time**2 / first
    assert 0.97 * time <= lasting(part, *(speeds[::-1] if at_end else speeds)) <= time


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("at_end", [False, True])
def test_a_joint_that_goes_back_first_may_be_faster_behind_its_start(sign: float, *, at_end: bool) -> None:
    """It turns with an acceleration, after a little time by a jerk ten times as large, all within the first cell."""
    back = 0.04  # of s, behind which it is where it started
    row, loose = Polynomial([0.0, -back, 1.0]), np.array([[-1e6, 1e6]])
    limits = [loose, loose, np.sort(sign * np.array([[-10.0, 1.0]]) * (-1.0 if at_end else 1.0))]
    little = 0.25 * back**2 / (5 / 3 + 5 * 20.4881 + 5 * 20.4881**2 - 20.4881**3 / 6)
    t1 = little ** (1 / 3)  # at t1 (1 + 10 + sqrt(110)) its velocity is zero
    gone = Polynomial([-10 / 6 * t1**3, -5 * t1**2, -5 * t1, 1 / 6])  # from t1 on
    left = float((gone - (1 - back)).roots().real.max())
    assert float(gone(t1 * 20.4881)) == pytest.approx(-0.25 * back**2, rel=1e-4)
    moving = float(gone.deriv()(left) / row.deriv()(1.0))
    if at_end:
        row = row(Polynomial([1.0, -1.0]))
    part = part_of([sign * row], limits, (not at_end, at_end), at=1e-4 if at_end else 1 - 1e-4)
    bound = lasting(part, moving, 0.0) if at_end else lasting(part, 0.0, moving)
    assert bound <= t1 + left


@pytest.mark.parametrize("jerk", [1e-9, np.inf])
@pytest.mark.parametrize("still", [[2.0], [2.0, 1e-17], [1000.0, 3e-13], [-1000.0, 3e-13]])
def test_a_joint_that_rounding_moves_does_not_count(still: list[float], jerk: float) -> None:
    loose = np.tile([-1e6, 1e6], (2, 1))
    limits = [loose, loose, np.array([[-30.0, 30.0], [-jerk, jerk]])]
    time = (6 / 30.0) ** (1 / 3)
    for stops in ((True, False), (False, True)):
        part = part_of([Polynomial([0.0, 1.0]), Polynomial(still)], limits, stops)
        moving = 0.5 * 30.0 * time**2
        found = lasting(part, 0.0, moving) if stops[0] else lasting(part, moving, 0.0)
        assert found == pytest.approx(time, rel=1e-6)
