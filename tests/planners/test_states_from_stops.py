"""States at borders of zones between a faster one and that of the law that stops, border by border."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest

from trajcli.job.robot import load_robot
from trajcli.kinematics.robot import Limits
from trajcli.kinematics.zone import Zone, ZoneAround
from trajcli.planners.course import joint_line
from trajcli.planners.flying_by.between_stops import FlyByChain, chain_of
from trajcli.planners.flying_by.flown_parts import CourseLaws
from trajcli.planners.flying_by.motion_search import POWERS, with_shares
from trajcli.planners.flying_by.stopping_laws import StoppingLaws

POINTS = np.array([[0.3, 1.2], [0.9, 1.25], [1.0, 2.0], [0.4, 2.4]])
FAST = np.array([[0.0, 0.0], [2.0, -3.0], [1.9, 4.0], [1.8, -5.0], [1.7, 2.5], [0.0, 0.0]])
OF_BORDERS = [0, 1, 1, 2]  # the course that each is on


@cache
def chain() -> FlyByChain:
    """Return three lines of planar2r with zones of 20 mm between them."""
    rows = [np.tile([-most, most], (2, 1)) for most in (np.inf, 3.0, 8.0, 60.0)]
    robot = replace(load_robot("planar2r"), limits=Limits(*rows))
    courses = [joint_line(*ends, robot) for ends in pairwise(POINTS)]
    zones = [ZoneAround(robot, point, Zone(position=0.02)) for point in POINTS[1:-1]]
    return chain_of(courses, zones, (np.zeros(2), np.zeros(2)), [1.0, 1.0])


@cache
def stopping(border: int) -> np.ndarray:
    """Return speed and acceleration of the law from stop to stop where it is at a border, by samples."""
    of = chain()
    corner = of.corners[border // 2]
    law = StoppingLaws(CourseLaws()).law(of, OF_BORDERS[border]).law
    assert law is not None
    times = np.linspace(0.0, law.end, 200_001)
    place = corner.joined if border % 2 else corner.left
    rates = [law.evaluate(times, order)[:, 0] for order in range(3)]
    return np.array([np.interp(place, rates[0], rate) for rate in rates[1:]])


@pytest.mark.parametrize("border", range(4))
def test_a_state_comes_from_the_faster_one_in_three_steps_and_stays(border: int) -> None:
    """Squares of speeds, and accelerations, are mixed; what was faster at first counts."""
    of, laws, index = chain(), StoppingLaws(CourseLaws()), OF_BORDERS[border]
    first, last = of.stretch(index)
    near = None if index != 1 else first if border % 2 else last
    slow, fast = stopping(border), FAST[border + 1]
    for step, share in enumerate((0.6, 0.3, 0.0, 0.0)):
        laws.slow(of, index, near, 0.1 * FAST if step else FAST)
        found = laws.states(of)
        assert len(found) == 1 + (step == 3 and index == 1)  # then the other end of the course
        square = (1 - share) * slow[0] ** 2 + share * fast[0] ** 2
        change = (1 - share) * slow[1] + share * fast[1]
        assert found[border] == pytest.approx([np.sqrt(square), change], rel=1e-4)


def test_a_course_is_that_of_the_stop_once_both_its_borders_are() -> None:
    of, laws = chain(), StoppingLaws(CourseLaws())
    first, last = of.stretch(1)
    for near, kept in ((first, []), (last, [1])):
        for _ in range(3):
            laws.slow(of, 1, near, FAST)
        assert list(laws.parts(of)) == kept
    assert laws.slow_all(of)
    assert list(laws.parts(of)) == [0, 1, 2]
    assert not laws.slow_all(of)
    alone = FlyByChain(of.courses[:1], (), of.ends, (1.0,))
    assert not StoppingLaws(CourseLaws()).slow_all(alone)


@pytest.mark.parametrize("slower", ["tempo", "first zone", "last zone"])
def test_states_are_as_slow_as_course_and_zones_beside_it(slower: str) -> None:
    """Every other course by a millionth more: joints that come back as they went would have the same speeds."""
    of, pace = chain(), 0.6
    shares = np.ones((2, 3))
    if slower == "tempo":
        other = replace(of, tempos=(1.0, pace, 1.0))
    else:
        shares[int(slower == "last zone")] = pace**POWERS
        other = with_shares(of, shares)
    laws = StoppingLaws(CourseLaws())
    laws.slow_all(other)
    paces = np.ones(3)
    paces[{"tempo": [1], "first zone": [0, 1], "last zone": [1, 2]}[slower]] = pace
    paces[1] *= 1 - 1e-6
    plain = StoppingLaws(CourseLaws())
    plain.slow_all(of)
    for border, state in laws.states(other).items():
        index = OF_BORDERS[border]
        share = paces[index] / (1 - 1e-6 * (index == 1))
        assert state == pytest.approx(plain.states(of)[border] * [share, share**2], rel=1e-9)
        assert state[0] == pytest.approx(stopping(border)[0] * paces[index], rel=3e-7)
    states = laws.states(other)
    for index, part in laws.parts(other).items():
        way = POINTS[index + 1] - POINTS[index]
        for border, time in ((2 * index - 1, part.curve.start), (2 * index, part.curve.end)):
            asked = states[border][0] * way if border in states else np.zeros(2)
            assert part.curve.evaluate(time, 1) == pytest.approx(asked, abs=1e-9)


def test_where_a_chain_begins_in_motion_it_does_so_at_any_pace() -> None:
    start = np.array([0.3, -0.5])
    of = replace(with_shares(chain(), np.tile(0.6**POWERS, (2, 1))), ends=(start, np.zeros(2)))
    laws = StoppingLaws(CourseLaws())
    laws.slow_all(of)
    curve, way = laws.parts(of)[0].curve, POINTS[1] - POINTS[0]
    for order in (1, 2):
        assert curve.evaluate(curve.start, order) == pytest.approx(start[order - 1] * way)
