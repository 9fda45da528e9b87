"""States at borders from laws that stop: they have laws and motions, and a chain with them is no slower."""

from __future__ import annotations

import itertools
import json
from copy import copy
from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from tiers import few

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.parameterization import UnsettledSpeedError
from trajcli.curves.time_optimal.passes import UnreachableSpeedError
from trajcli.findings import Finding
from trajcli.job.read import job_from_text
from trajcli.kinematics.robot import ToolLimits
from trajcli.kinematics.zone import ZoneAround
from trajcli.planners.flying_by import flown_parts as looked_for
from trajcli.planners.flying_by import motion_search
from trajcli.planners.flying_by.between_stops import FlyByChain, chain_of
from trajcli.planners.flying_by.chain_parts import BorderNode, PathPart, row_of
from trajcli.planners.flying_by.flown_parts import (
    CourseLaws,
    FlownPart,
    NoLawError,
    along_path,
    flown_parts,
    zone_motion,
)
from trajcli.planners.flying_by.flown_parts import _law_between as law_between
from trajcli.planners.flying_by.motion_search import POWERS, duration_of, with_shares
from trajcli.planners.flying_by.search import FoundStates, begin_search
from trajcli.planners.flying_by.stopping_laws import StoppingLaws
from trajcli.planning.plan import plan_job

LIMITS = {"velocity": 3, "acceleration": 8, "jerk": 60}
LINE = {"planner": "line", "law": {"shape": "time_optimal"}}
MOVES = {
    "lines": [{**LINE, "to": {"xyz": [x, 0.392283, 0]}} for x in (0.300748, 0.154969)],
    "joints": [{"planner": "jerk_limited", "to": {"joints": each}} for each in ([0.9, 1.25], [1.0, 2.0])],
    "back": [{"planner": "jerk_limited", "to": {"joints": each}} for each in ([0.9, 1.25], [0.3, 1.2])],
}


@cache
def chain_with(moves: str) -> tuple[FlyByChain, float]:
    """Return a chain of a planar arm with a zone of 20 mm, and how long it takes with a stop."""
    job = {"version": 1, "robot": "planar2r", "limits": LIMITS, "start": {"joints": [0.3, 1.2]}, "zone": 0.02}
    loaded = job_from_text(json.dumps({**job, "moves": MOVES[moves]}))
    plan = plan_job(job_from_text(json.dumps({**job, "zone": "stop", "moves": MOVES[moves]})))
    courses = [move.planner.course(move.start.position, move.robot, move.planned) for move in plan.moves]
    zone = loaded.job.zone
    assert zone is not None
    around = ZoneAround(plan.moves[0].robot, plan.moves[0].planned.end.position, zone)
    rest = np.zeros(2)
    return chain_of(courses, [around], (rest, rest), [1.0]), plan.trajectory.duration


@cache
def known_laws() -> CourseLaws:
    """Return laws along the courses of these chains, each looked for once."""
    return CourseLaws()


@cache
def _searched() -> motion_search.MotionSearch:
    search = motion_search.MotionSearch(known_laws(), by_order=True)
    search.fastest(chain_with("lines")[0])
    return search


def searched() -> motion_search.MotionSearch:
    """Return a search that has found the motion along the lines, and knows no laws any more."""
    search = copy(_searched())
    search._laws, search._doubtful = CourseLaws(), set()
    return search


@pytest.mark.parametrize("pace", few([0.6, 1.0], 1))
@pytest.mark.parametrize("moves", MOVES)
def test_a_chain_with_the_states_of_a_motion_that_stops_is_no_slower(moves, pace):
    """Even at a lower pace in its zone than elsewhere its motion is one: then it takes that much longer."""
    chain, stopping = chain_with(moves)
    chain = with_shares(chain, pace ** POWERS[None])
    laws = StoppingLaws(known_laws())
    assert laws.slow_all(chain)
    assert not laws.slow_all(chain)
    row = row_of(chain, [1.0, 1.0], [1.0, 1.0], laws.states(chain))
    states = begin_search(row.nodes, row.parts, chain.ends).found().states
    parts = flown_parts(chain, row, states, CourseLaws(), laws.parts(chain))
    assert sum(part.curve.duration for part in parts) <= stopping / pace * (1 + 1e-5)
    for before, after in itertools.pairwise(parts):
        for order in range(3):
            gap = before.curve.piece_ends(order)[1][-1] - after.curve.piece_ends(order)[0][0]
            assert np.abs(gap).max() < 1e-9
    for order, limit in ((1, 3.0), (2, 8.0), (3, 60.0)):
        for part in parts:
            times = np.linspace(0, part.curve.end, 500)
            assert np.abs(part.curve.evaluate(times, order)).max() <= limit * (1 + 1e-8)


@pytest.mark.full
@pytest.mark.parametrize(("findings", "times"), [([SimpleNamespace(kind="zone", factor=None)], 1), ([], 2)])
def test_laws_beside_a_zone_that_has_to_change_are_not_made_better(findings, times, monkeypatch):
    made = []
    monkeypatch.setattr(motion_search, "flown_parts", lambda *given: made.append(0) or flown_parts(*given))
    monkeypatch.setattr(
        motion_search, "findings_of", lambda chain, number, part: findings if number == 1 else []
    )
    motion_search.MotionSearch(CourseLaws(), by_order=True).fastest(chain_with("lines")[0])
    assert len(made) == times


def test_a_state_comes_from_that_of_a_faster_law_to_that_of_the_one_that_stops():
    chain, _ = chain_with("joints")
    laws, found = StoppingLaws(CourseLaws()), np.array([[0.0, 0.0], [1.2, -3.0], [1.1, 2.0], [0.0, 0.0]])
    speeds = []
    for _ in range(3):
        laws.slow(chain, 0, None, found)
        (state,) = laws.states(chain).values()
        speeds.append(state[0])
    law = laws.law(chain, 0).law
    assert law is not None
    times = np.linspace(0, law.end, 200001)
    passed = np.interp(chain.corners[0].left, law.evaluate(times)[:, 0], law.evaluate(times, 1)[:, 0])
    assert speeds[2] == pytest.approx(passed, rel=1e-6)
    squares = np.square(speeds)
    assert squares[0] - squares[2] == pytest.approx(0.6 * (1.2**2 - passed**2), rel=1e-6)
    assert squares[1] - squares[2] == pytest.approx(0.3 * (1.2**2 - passed**2), rel=1e-6)


@pytest.mark.full
def test_a_law_between_the_same_states_is_looked_for_once(monkeypatch):
    made = []
    monkeypatch.setattr(looked_for, "along_path", lambda *given: made.append(0) or along_path(*given))
    chain, _ = chain_with("lines")
    course, laws, rest, fast = (
        chain.courses[0],
        CourseLaws(),
        np.zeros((2, 2)),
        np.array([[0.0, 0.0], [9.0, 0.0]]),
    )
    whole, half = (0.0, course.length), (0.0, course.length / 2)
    found = laws.along(course, 0, whole, rest, 1.0)
    assert laws.along(course, 0, whole, rest.copy(), 1.0) is found
    assert len(made) == 1
    for _ in range(2):
        with pytest.raises(NoLawError, match="between two zones") as refused:
            laws.along(course, 0, whole, fast, 1.0)
        assert refused.value.failing.keys() == {0}
    assert len(made) == 2
    others = [
        laws.along(course, 0, half, rest, 1.0),
        laws.along(course, 0, whole, rest, 0.5),
        laws.along(chain.courses[1], 0, whole, rest, 1.0),
    ]
    assert len(made) == 5
    assert len({part.curve.duration for part in (found, *others)}) == 4


def test_a_zone_between_the_same_states_is_judged_once(monkeypatch):
    """Where nothing but the share of another zone changes, the motion through it is as it was."""
    made = []
    monkeypatch.setattr(motion_search, "zone_motion", lambda *given: made.append(0) or zone_motion(*given))
    search, (chain, _) = motion_search.MotionSearch(CourseLaws(), by_order=True), chain_with("joints")
    search.chain, states = chain, np.array([[0.0, 0.0], [0.1, 0.0], [0.1, 0.0], [0.0, 0.0]])
    over = search._over(states)
    assert search._over(states.copy()) == over
    assert len(made) == 1
    for other in (with_shares(chain, 0.9 ** POWERS[None]), chain_with("back")[0]):
        search.chain = other
        search._over(states)
    search._over(0.5 * states)
    assert len(made) == 4


@pytest.mark.parametrize(("s", "slowed"), [(0.1, 1), (0.9, 2), (None, 3)])
def test_the_border_nearer_to_where_a_law_fails_is_slowed(s, slowed):
    """Borders count from the start: course 1 has 1 and 2."""
    chain, _ = chain_with("back")
    corner = chain.corners[0]
    longer = replace(
        chain, courses=(*chain.courses, chain.courses[0]), corners=(corner, corner), tempos=(1.0,) * 3
    )
    laws = StoppingLaws(CourseLaws())
    laws.slow(longer, 1, s, np.full((6, 2), 0.1))
    assert sum(laws.states(longer)) == slowed


def test_no_law_along_a_path_is_taken_to_be_faster_than_its_bounds():
    """At its largest speed a path of length L takes L / v at least, whatever it accelerates to at its end."""
    part = PathPart(np.array([-0.25, 0.25, -4, 4, -60, 60]), 0.3, typical=True)
    start, end = np.zeros((1, 2)), np.array([[0.246, 4.0]])
    assert part.durations(start, end)[0, 0] > 0.3 / 0.25
    assert part.durations(end * [1, -1], start)[0, 0] > 0.3 / 0.25
    slow = np.array([[0.0, -12.0]])  # what was built up before it asks for 1.2 there, not on the whole path
    assert part.durations(start, slow)[0, 0] >= 0.3 / 0.25
    assert part.durations(slow * [1, -1], start)[0, 0] >= 0.3 / 0.25
    assert part.durations(np.array([[0.5, 0.0]]), np.array([[0.5, 0.0]]))[0, 0] == pytest.approx(0.3 / 0.5)


@pytest.mark.parametrize("moves", MOVES)
def test_a_search_that_stops_at_rough_grids_goes_on_as_if_it_had_not(moves):
    chain, _ = chain_with(moves)
    row = row_of(chain, [1.0, 1.0], [0.95, 0.95], {})
    begun = begin_search(row.nodes, row.parts, chain.ends)
    rough, fine = begun.until(1e-3), begun.until()
    assert rough.number < fine.number
    assert rough.best.duration > fine.best.duration
    again = rough.until()
    assert np.array_equal(again.best.states, fine.best.states)
    assert again.number == fine.number


def test_typical_bounds_of_the_same_part_of_a_course_are_looked_for_once(monkeypatch):
    course = chain_with("lines")[0].courses[0]
    whole = course.typical_bounds(0.0, course.length)
    half = course.typical_bounds(0.0, course.length / 2)
    assert not np.array_equal(whole, half)
    monkeypatch.setattr(type(course), "rates", None)
    assert course.typical_bounds(0.0, course.length) is whole
    assert course.typical_bounds(0.0, course.length / 2) is half


class EasedError(Exception):
    """The pace of a course was lowered."""


def refusing(index, side, largest):
    """Return a search of laws that finds none where the acceleration at an end of a course is too large."""

    def found(course, number, stretch, states, tempo):
        if number == index and abs(states[side, 1]) > largest:
            return NoLawError("the acceleration is too large", {number: stretch[side]})
        return law_between(course, number, stretch, states, tempo)

    return found


@pytest.mark.full
@pytest.mark.parametrize(("index", "side"), [(0, 1), (1, 0)])
def test_where_a_law_fails_beside_a_border_the_state_there_is_calmed(index, side, monkeypatch):
    """Nothing else is slower for it, but the zone beside it."""
    chain, _ = chain_with("lines")
    free = motion_search.MotionSearch(CourseLaws(), by_order=True)
    before = motion_search.duration_of(free.fastest(chain))
    asked = abs(free._motion.states[1 + index, 1])
    monkeypatch.setattr(looked_for, "_law_between", refusing(index, side, 0.85 * asked))
    monkeypatch.setattr(motion_search.MotionSearch, "_ease", lambda *given: pytest.fail("eased"))
    search = motion_search.MotionSearch(CourseLaws(), by_order=True)
    parts = search.fastest(chain)
    states = search._motion.states
    assert 0.7 * asked < abs(states[1 + index, 1]) <= 0.85 * asked
    assert before < motion_search.duration_of(parts) < 1.01 * before
    for part, row in ((parts[0], states[1]), (parts[2], states[2])):
        assert part.law is not None
        ends = part.law.evaluate_orders(np.array([part.law.start, part.law.end]), (1, 2))
        reached = ends[1 if part is parts[0] else 0, :, 0]
        assert reached == pytest.approx(row, rel=3e-4)


@pytest.mark.parametrize(("index", "side", "largest"), [(0, 0, -1.0), (1, 1, -1.0), (0, 1, 0.0)])
def test_where_a_calmer_state_is_no_help_the_pace_is_lowered(index, side, largest, monkeypatch):
    """At the start and at the end of a chain the state is given; nor are states calmed for ever."""

    def eased(search, error, paces, states):
        asked.append((error.failing, states))
        raise EasedError

    asked: list = []
    chain, search = chain_with("lines")[0], searched()
    row, found = search._motion.row, FoundStates(search._motion.states, (search.model,))
    search._near = found.states
    search._laws._found = {
        key: law
        for key, law in known_laws()._found.items()
        if key[1] != index  # of the other course
    }
    monkeypatch.setattr(motion_search.MotionSearch, "_searched", lambda *given: (found, row))
    monkeypatch.setattr(looked_for, "_law_between", refusing(index, side, largest))
    monkeypatch.setattr(motion_search.MotionSearch, "_ease", eased)
    monkeypatch.setattr(motion_search.MotionSearch, "_pace", lambda search, number: 1.0)
    with pytest.raises(EasedError):
        search.fastest(chain)
    failing, states = asked[0]
    assert failing == {index: chain.stretch(index)[side]}
    assert np.array_equal(states, search._near), "the states that were found, not calmed ones"


@pytest.mark.parametrize(("part", "node"), [(0.1, 1), (0.9, 2), (None, 1)])
def test_a_law_fails_at_the_node_that_is_nearer(part, node):
    chain, _ = chain_with("back")
    corner = chain.corners[0]
    courses = (*chain.courses, chain.courses[0])
    longer = replace(chain, courses=courses, corners=(corner, corner), tempos=(1.0,) * 3)
    search = motion_search.MotionSearch(CourseLaws(), by_order=True)
    search.chain = longer
    first, last = longer.stretch(1)
    assert search._failing(1, None if part is None else first + part * (last - first)) == node


@pytest.mark.full
def test_the_state_at_the_start_of_a_chain_is_not_calmed(monkeypatch):
    def found(course, number, stretch, states, tempo):
        if number == 0 and states[0, 1] > 0.95 * started:
            return NoLawError("the acceleration is too large", {0: 0.0})
        return law_between(course, number, stretch, states, tempo)

    def eased(search, error, paces, states):
        raise EasedError

    chain, started = chain_with("lines")[0], 0.3
    chain = replace(chain, ends=(np.array([0.02, started]), np.zeros(2)))
    monkeypatch.setattr(looked_for, "_law_between", found)
    monkeypatch.setattr(motion_search.MotionSearch, "_ease", eased)
    monkeypatch.setattr(motion_search.MotionSearch, "_pace", lambda search, number: 1.0)
    with pytest.raises(EasedError):
        motion_search.MotionSearch(CourseLaws(), by_order=True).fastest(chain)


@pytest.mark.full
def test_states_on_both_sides_of_a_zone_are_calmed_together():
    search = searched()
    row, states = search._motion.row, search._motion.states
    both = search._calmed({0, 1}, row, states).states
    assert both[1:3] == pytest.approx(states[1:3] * [0.99, 0.9], rel=1e-5)
    one = search._calmed({1}, row, states).states
    assert one[2] == pytest.approx(states[2] * [0.99, 0.9], rel=1e-5)
    assert not np.allclose(one[1], states[1], rtol=1e-5)


@pytest.mark.full
def test_a_calmer_state_that_costs_too_much_is_left(monkeypatch):
    search = searched()
    chain, row, states = search.chain, search._motion.row, search._motion.states
    asked = abs(states[1, 1])
    monkeypatch.setattr(looked_for, "_law_between", refusing(0, 1, 0.95 * asked))
    found = begin_search(
        [replace(node, given=state) for node, state in zip(row.nodes, states[1:-1], strict=True)],
        row.parts,
        chain.ends,
        states,
    ).found()
    other, parts = search._flown(row, found)
    assert abs(other.states[1, 1]) == pytest.approx(0.9 * asked, rel=1e-3)
    assert len(parts) == 3
    for longer, taken in ((1.04, True), (1.06, False)):
        calmed = FoundStates(other.states, tuple(longer * duration for duration in found.durations))
        monkeypatch.setattr(motion_search.MotionSearch, "_calmed", lambda *given, calmed=calmed: calmed)
        if taken:
            assert search._flown(row, found)[0] is calmed
        else:
            with pytest.raises(NoLawError):
                search._flown(row, found)


def test_a_state_with_an_acceleration_where_only_speeds_count_is_rounded_to_one_without() -> None:
    """Without a limit of jerk no acceleration is kept: dividing it by the grid of none overflowed, aloud."""

    def bounds(states):
        return np.tile([-1e-6, 1e-6, -4.0, 4.0, -np.inf, np.inf], (len(states), 1))

    speed, change = BorderNode(bounds, leads=True, goes_on=False).rounded(np.array([1e-7, 3.0]))
    assert speed == pytest.approx(1e-7, rel=1e-6)
    assert change == 0.0


@pytest.mark.full
@pytest.mark.parametrize(("doubtful", "asked"), [((), [0, 1]), ({1}, [1])])
def test_courses_that_had_no_law_are_tried_before_the_others(doubtful, asked, monkeypatch):
    def found(course, number, stretch, states, tempo):
        looked.append(number)
        return refusing(1, 0, -1.0)(course, number, stretch, states, tempo)

    looked, search = list[int](), searched()
    chain, row, states = search.chain, search._motion.row, search._motion.states
    monkeypatch.setattr(looked_for, "_law_between", found)
    with pytest.raises(NoLawError) as refused:
        flown_parts(chain, row, states, CourseLaws(), None, doubtful)
    assert (list(refused.value.failing), looked) == ([1], asked)


@pytest.mark.full
def test_a_search_knows_which_course_had_no_law(monkeypatch):
    """While it fails no other is looked for: laws of long paths cost most of the time of a search."""

    def found(course, number, stretch, states, tempo):
        looked.append(number)
        return refusing(1, 0, 0.75 * asked)(course, number, stretch, states, tempo)

    looked, search = list[int](), searched()
    states = search._motion.states
    asked = abs(states[2, 1])
    monkeypatch.setattr(looked_for, "_law_between", found)
    free = FoundStates(states, (search.model,))
    search._flown(search._motion.row, free)
    assert looked[:2] == [0, 1]
    assert looked[2:] == [1] * (len(looked) - 3) + [0]
    assert len(looked) > 4


def test_what_joints_do_not_use_in_a_zone_is_lowered_at_once():
    """The speed of the tool is too high by a tenth, while joints use a quarter of their velocities."""
    chain, _ = chain_with("lines")
    over = Finding("tool_speed", factor=1.1)
    used = np.array([0.25, 0.9, 1.0])
    for by_order, lowered in ((True, [0.25 / 1.1, 1.0, 1.0]), (False, 1.1**-POWERS)):
        search = motion_search.MotionSearch(CourseLaws(), by_order=by_order)
        assert search._kept_shares([over], used) == pytest.approx(np.array(lowered), rel=1e-5)
    limits = chain.corners[0].limits
    line = limits.velocity.max() / 4 * np.array([[[1.0, -0.5]], [[0.0, 0.0]]])
    for times, share in ((1.0, 0.25), (-2.0, 0.5), (8.0, 2.0)):
        motion = FlownPart(PiecewisePolynomial(np.array([0.0, 1.0]), times * line))
        uses = looked_for.joint_uses(motion.curve, limits)
        assert uses == pytest.approx(np.array([[share, share / 2], [0, 0], [0, 0]]))


@pytest.mark.full
def test_a_second_search_lowers_paces_where_that_looks_faster():
    """Of the acceleration of the tool in a zone: it ends where one does that knows nothing of the first."""
    free, _ = chain_with("joints")
    corner = free.corners[0]
    limits = replace(corner.robot.limits, tcp=ToolLimits(acceleration=1.5))
    chain = replace(free, corners=(replace(corner, robot=replace(corner.robot, limits=limits)),))
    search = motion_search.MotionSearch(CourseLaws())
    by_order = duration_of(search.fastest(chain))
    alone = motion_search.MotionSearch(CourseLaws(), by_order=False)
    by_pace = duration_of(alone.fastest(chain))
    assert by_order < by_pace * 0.99
    assert search.by_pace(chain, by_order) is None
    for least in (by_pace * 1.01, np.inf):
        other = search.by_pace(chain, least)
        assert other is not None
        assert duration_of(other.fastest(chain)) == pytest.approx(by_pace, rel=1e-3)
        assert not other.lowered
        assert other.model == pytest.approx(alone.model, rel=1e-3)
    unlimited = motion_search.MotionSearch(CourseLaws())
    unlimited.fastest(free)
    assert not unlimited.lowered


@pytest.mark.parametrize(
    ("error", "far"),
    [
        (UnsettledSpeedError(0.1, 1.3), False),
        (UnsettledSpeedError(0.1, 1.9), True),
        (UnreachableSpeedError("end", 0.1, 1.01, 1.0), False),
        (UnreachableSpeedError("end", 0.1, 1.2, 1.0), True),
    ],
)
def test_where_a_law_is_far_from_its_limits_no_calmer_state_is_tried(error, far, monkeypatch):
    """States are calmed by 3 % of their speeds and 27 % of their accelerations at most."""

    def refused(*given):
        asked.append(given)
        raise error

    asked, search = list[object](), searched()
    chain, row, states = search.chain, search._motion.row, search._motion.states
    monkeypatch.setattr(looked_for, "along_path", refused)
    monkeypatch.setattr(looked_for, "_within_tightest", lambda *given: (None, False))
    with pytest.raises(NoLawError) as failure:
        search._flown(row, FoundStates(states, (search.model,)))
    assert failure.value.far == far
    assert (len(asked) == len(chain.courses)) == far
    index = next(iter(failure.value.failing))
    with pytest.raises(NoLawError) as again:
        search._laws.along(
            chain.courses[index],
            index,
            chain.stretch(index),
            states[2 * index : 2 * index + 2],
            chain.tempos[index],
        )
    assert again.value.far == far


@pytest.mark.parametrize(("moves", "start"), [("lines", [0.05, 0.2]), ("joints", [0.3, -0.5])])
def test_a_chain_that_begins_in_motion_does_so_at_any_pace(moves, start):
    """Also as fast as it is told to and not by a ten thousandth slower, as laws beside zones may be."""
    chain, _ = chain_with(moves)
    chain = replace(chain, ends=(np.array(start), np.zeros(2)))
    first, bend = chain.courses[0].curve.evaluate_orders(np.zeros(1), (1, 2))[0]
    asked, known = (start[0] * first, start[1] * first + start[0] ** 2 * bend), known_laws()
    for pace in (1.0, 0.6):
        laws, slow = StoppingLaws(known), with_shares(chain, pace ** POWERS[None])
        laws.slow_all(slow)
        states = np.array([*laws.states(slow).values()])
        for part in (
            laws.parts(slow)[0],
            known.along(chain.courses[0], 0, chain.stretch(0), np.stack([chain.ends[0], states[0]]), 1.0),
        ):
            for order, rates in enumerate(asked, 1):
                assert part.curve.evaluate(part.curve.start, order) == pytest.approx(
                    rates, rel=1e-9, abs=1e-12
                )
