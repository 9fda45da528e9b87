"""Chains that keep all limits: lines that go straight on, moves that count, and what is lowered for a finding."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from ruckig import InputParameter, Result, Ruckig, Trajectory

from trajcli.curves.operations import scale_time
from trajcli.curves.piecewise import PiecewisePolynomial, constant
from trajcli.errors import MissingLimitError, PlanningError
from trajcli.findings import Finding
from trajcli.job.robot import load_robot
from trajcli.kinematics.robot import Limits, Robot, ToolLimits
from trajcli.kinematics.zone import Zone, ZoneAround
from trajcli.planners.course import JointCourse
from trajcli.planners.flying_by import within_limits
from trajcli.planners.flying_by.between_stops import FlyByChain, chain_of
from trajcli.planners.flying_by.flown_parts import CourseLaws, FlownPart
from trajcli.planners.flying_by.motion_search import POWERS, with_shares
from trajcli.planners.flying_by.within_limits import FlownChain, flown, straightened
from trajcli.trajectory import State, resting

BOUNDS = {"velocity": 3.0, "acceleration": 8.0, "jerk": 60.0}
WAYS = np.array([[0.6, 0.05], [1.2, 0.1], [0.3, 0.025], [0.1, 0.8], [0.05, 0.4]])  # 0 to 2, and 3 to 4: lines
POINTS = np.cumsum([[0.3, 1.2], *WAYS], axis=0)
LENGTHS = (1.0, 2.0, 0.5, 1.0, 3.0)  # last s of each
START = np.array([0.4, -0.3])  # sd and sdd of the first


def arm(**bounds: Any) -> Robot:
    """Return planar2r with some bounds of both joints, or rows of theirs."""
    robot, rows = load_robot("planar2r"), {}
    for name, bound in {"position": np.inf, **BOUNDS, **bounds}.items():
        rows[name] = np.broadcast_to(bound, (2, 2)) * [-1.0, 1.0] if np.ndim(bound) < 2 else np.array(bound)
    return replace(robot, limits=Limits(**rows))


def line(start: np.ndarray, way: np.ndarray, robot: Robot, length: float = 1.0) -> JointCourse:
    rows = np.stack([way / length, start])[:, None, :]
    return JointCourse(PiecewisePolynomial(np.array([0.0, length]), rows), robot)


def zone_at(point: np.ndarray, robot: Robot, size: float = 0.05) -> ZoneAround:
    return ZoneAround(robot, point, Zone(joints=(size, size)))


def five_lines() -> FlyByChain:
    robot = arm()
    courses = [line(POINTS[k], WAYS[k], robot, length) for k, length in enumerate(LENGTHS)]
    zones = [zone_at(point, robot) for point in POINTS[1:-1]]
    return chain_of(courses, zones, (START, np.zeros(2)), [1.0] * 4)


def test_lines_that_go_straight_on_are_one_with_the_same_places_and_speeds() -> None:
    chain = five_lines()
    straight = straightened(chain)
    joined = straight.joined
    assert straight.groups == ((0, 2), (3, 4))
    assert straight.corners == [2]
    (corner,), (given) = joined.corners, chain.corners[2]
    assert corner.around is given.around
    for (course, s), (other, place) in zip(
        ((joined.courses[0], corner.left), (joined.courses[1], corner.joined)),
        ((chain.courses[2], given.left), (chain.courses[3], given.joined)),
        strict=True,
    ):
        np.testing.assert_allclose(course.curve.evaluate(s), other.curve.evaluate(place), atol=1e-14)
    np.testing.assert_allclose(joined.courses[1].curve.evaluate(0.0), POINTS[3])
    np.testing.assert_allclose(joined.courses[1].curve.evaluate(1.0), POINTS[5])
    for order in (0, 1):  # velocities and accelerations of the joints at the start are as they were
        want = chain.courses[0].curve.evaluate(0.0, 1) * START[order]
        np.testing.assert_allclose(joined.courses[0].curve.evaluate(0.0, 1) * joined.ends[0][order], want)
    alone = chain_of(chain.courses[2:4], [given.around], chain.ends, [1.0])
    assert straightened(alone).joined is alone
    assert straightened(alone).parts(["a", "b", "c"]) == ["a", "b", "c"]  # type: ignore[comparison-overlap, list-item]


@pytest.mark.parametrize("slow", [0, 1, 2, 3, 4, "first zone", "second zone", "zone between"])
def test_a_line_is_as_slow_as_what_it_is_made_of(slow: int | str) -> None:
    """As the slowest of its moves, and as a zone that it goes straight through; others count for nothing."""
    chain, pace = five_lines(), 0.4
    if isinstance(slow, int):
        chain = replace(chain, tempos=tuple(pace if k == slow else 1.0 for k in range(5)))
    else:
        shares = np.ones((4, 3))
        shares[["first zone", "second zone", "zone between"].index(slow)] = pace**POWERS
        chain = with_shares(chain, shares)
    want = {3: (1.0, pace), 4: (1.0, pace), "zone between": (1.0, 1.0)}.get(slow, (pace, 1.0))
    assert straightened(chain).joined.tempos == pytest.approx(want)


def turned(way: np.ndarray, angle: float) -> np.ndarray:
    cosine, sine = np.cos(angle), np.sin(angle)
    return np.asarray(np.array([[cosine, -sine], [sine, cosine]]) @ way)


@pytest.mark.parametrize(
    ("way", "bounds", "one"),
    [
        (3.0 * WAYS[0], {}, True),
        (turned(WAYS[0], 1e-14), {}, True),
        (turned(WAYS[0], 1e-9), {}, False),
        (-WAYS[0], {}, False),
        (WAYS[0], {"velocity": [[-3.0, 2.9], [-3, 3]]}, False),
        (WAYS[0], {"acceleration": [[-8.0, 8], [-7, 8]]}, False),
        (WAYS[0], {"jerk": 59.0}, False),
        (WAYS[0], {"position": 9.0}, True),
    ],
)
def test_a_line_goes_on_in_the_same_direction_within_the_same_limits(
    way: np.ndarray, bounds: dict[str, Any], *, one: bool
) -> None:
    robots = arm(), arm(**bounds)
    courses = [line(POINTS[0], WAYS[0], robots[0]), line(POINTS[1], way, robots[1])]
    chain = chain_of(courses, [zone_at(POINTS[1], robots[0])], (np.zeros(2), np.zeros(2)), [1.0])
    assert straightened(chain).groups == (((0, 1),) if one else ((0, 0), (1, 1)))
    for k in (0, 1):  # nor where the tool is limited along either
        robot = replace(robots[k], limits=replace(robots[k].limits, tcp=ToolLimits(speed=1.0)))
        limited = [replace(course, robot=robot) if k == j else course for j, course in enumerate(courses)]
        assert len(straightened(replace(chain, courses=tuple(limited))).groups) == 2


def rest_to_rest(way: np.ndarray) -> Trajectory:
    """Return ruckig's motion of the joint that goes farthest."""
    asked, found = InputParameter(1), Trajectory(1)
    asked.target_position = [float(way.max())]
    asked.max_velocity, asked.max_acceleration, asked.max_jerk = ([bound] for bound in BOUNDS.values())
    assert Ruckig(1).calculate(asked, found) == Result.Working
    return found


def test_a_line_is_cut_where_it_is_on_borders_of_zones() -> None:
    """Between rest and rest it takes as long as ruckig; its parts are the moves and zones that were given."""
    chain = replace(five_lines(), ends=(np.zeros(2), np.zeros(2)))
    straight = straightened(
        chain_of(chain.courses[:3], [c.around for c in chain.corners[:2]], chain.ends, [1.0] * 2)
    )
    whole = CourseLaws().along(straight.joined.courses[0], 0, (0.0, 1.0), np.zeros((2, 2)), 1.0)
    parts = straight.parts([whole])
    assert len(parts) == 5
    want = rest_to_rest(WAYS[:3].sum(axis=0))
    assert np.sum([part.curve.duration for part in parts]) == pytest.approx(want.duration, rel=1e-12)
    assert all(part.curve.start == 0.0 for part in parts)
    ends = [(part.curve.evaluate(0.0), part.curve.evaluate(part.curve.end)) for part in parts]
    off = (0.05, WAYS[0, 1] / WAYS[0, 0] * 0.05)  # of the first joint the zones are full
    borders = [POINTS[0], POINTS[1] - off, POINTS[1] + off, POINTS[2] - off, POINTS[2] + off, POINTS[3]]
    for k, (first, last) in enumerate(ends):
        np.testing.assert_allclose(first, borders[k], atol=1e-9)
        np.testing.assert_allclose(last, borders[k + 1], atol=1e-9)
    without = FlownPart(whole.curve)
    assert straight.parts([without]) == [without]


def test_a_zone_that_is_passed_in_no_time_is_refused() -> None:
    """Its borders are a few last digits of s apart, those of its times are none."""
    robot, corner = arm(), np.array([1000.0, 500.0])
    courses = [line(start, corner, robot) for start in (np.zeros(2), corner)]
    chain = chain_of(courses, [zone_at(corner, robot, 1e-12)], (np.zeros(2), np.zeros(2)), [1.0])
    straight = straightened(chain)
    whole = CourseLaws().along(straight.joined.courses[0], 0, (0.0, 1.0), np.zeros((2, 2)), 1.0)
    with pytest.raises(PlanningError, match="in less time than numbers can tell"):
        straight.parts([whole])


class Search:
    """Stands for a search: it has a motion of a given duration for each turn, and knows what it was asked for."""

    def __init__(self, durations: list[float | None], shares: Any = None) -> None:
        self.durations, self.asked, self.bolder_of = durations, [], []
        self.lowered, self.model, self.shares = False, min([d for d in durations if d] or [9.0]) / 2, shares
        self.given = shares
        self.next: Search | None = None
        self.least: list[float] = []

    def fastest(self, chain: FlyByChain) -> list[FlownPart]:
        self.asked.append(chain)
        duration = self.durations[min(len(self.asked), len(self.durations)) - 1]
        if duration is None:
            raise PlanningError("nothing is found" if self.next else "nothing is found either")
        if self.given is None or len(self.asked) > 1:
            self.shares = np.array([corner.shares for corner in chain.corners]).reshape(-1, 3)
        count = 2 * len(chain.courses) - 1
        return [FlownPart(constant(np.zeros(2), duration / count)) for _ in range(count)]

    def bolder(self, parts: list[FlownPart]) -> list[FlownPart]:
        self.bolder_of.append(parts)
        return [FlownPart(scale_time(part.curve, 0.9)) for part in parts]

    def by_pace(self, chain: FlyByChain, least: float) -> Search | None:
        self.least.append(least)
        assert [corner.shares for corner in chain.corners] == [(1.0, 1.0, 1.0)], (
            "one of four: lines are joined"
        )
        return self.next


def corner_chain(count: int = 2) -> tuple[list[JointCourse], list[ZoneAround]]:
    robot = arm()
    ways = [WAYS[0] if k % 2 == 0 else WAYS[3] for k in range(count)]
    points = POINTS[0] + np.concatenate([[np.zeros(2)], np.cumsum(ways, axis=0)])
    courses = [line(points[k], way, robot) for k, way in enumerate(ways)]
    return courses, [zone_at(point, robot) for point in points[1:-1]]


def over(kind: str = "effort", factor: float | None = None) -> Finding:
    return Finding(kind, factor=factor)


def kept(
    monkeypatch: pytest.MonkeyPatch,
    found: dict[tuple[int, int], list[Finding]],
    count: int = 2,
    turns: int = 60,
) -> tuple[Search, list[FlyByChain], FlyByChain, list[FlownPart]]:
    """Return what is asked for where a part (turn, number) is found to be over limits."""
    courses, zones = corner_chain(count)
    search, ends = Search([2.0] * turns), (np.zeros(2), np.zeros(2))
    judged: list[FlyByChain] = []

    def findings_of(chain: FlyByChain, number: int, part: FlownPart) -> list[Finding]:
        judged.append(chain)
        return found.get((len(search.asked), number), [])

    monkeypatch.setattr(within_limits, "findings_of", findings_of)
    chain, parts = within_limits._kept(courses, zones, ends, search)  # type: ignore[arg-type]
    return search, judged, chain, parts


def test_a_chain_that_keeps_all_limits_is_left_and_made_bolder(monkeypatch: pytest.MonkeyPatch) -> None:
    search, _, chain, parts = kept(monkeypatch, {})
    assert len(search.asked) == 1
    assert np.sum([part.curve.duration for part in parts]) == pytest.approx(0.9 * 2.0)
    assert (chain.tempos, chain.corners[0].shares) == ((1.0, 1.0), (1.0, 1.0, 1.0))


@pytest.mark.parametrize(("number", "course"), [(0, 0), (2, 1), (4, 2)])
def test_a_course_is_as_much_slower_as_the_finding_that_needs_most(
    number: int, course: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And by no more than some millionths; twice over twice; one that nobody can tell by a fifth."""
    first = [over(factor=1.1), over(factor=1.5), over(factor=1.2)]
    search, _, chain, _ = kept(
        monkeypatch,
        {(1, number): first, (2, number): [over(factor=1.25)], (3, number): [over(factor=9.0), over()]},
        3,
    )
    tempos = [asked.tempos[course] for asked in search.asked]
    want = np.cumprod([1.0, 1 / 1.5, 1 / 1.25, 0.8])
    assert tempos == pytest.approx(want, rel=6e-6)
    assert (np.array(tempos)[1:3] < want[1:3] * (1 - 0.9e-6)).all()
    assert [tempo for k, tempo in enumerate(chain.tempos) if k != course] == [1.0, 1.0]
    assert all(corner.shares == (1.0, 1.0, 1.0) for corner in chain.corners)


@pytest.mark.parametrize(("number", "zone"), [(1, 0), (3, 1)])
def test_a_zone_is_as_much_slower_of_each_derivative_its_power(
    number: int, zone: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    search, _, chain, _ = kept(monkeypatch, {(1, number): [over(factor=1.1), over(factor=1.25)]}, 3)
    shares = np.array([corner.shares for corner in search.asked[1].corners])
    np.testing.assert_allclose(shares[zone], [0.8, 0.64, 0.512], rtol=4e-6)
    assert (shares[zone] < [0.8, 0.64, 0.512]).all()
    np.testing.assert_array_equal(shares[1 - zone], 1.0)
    assert chain.tempos == (1.0, 1.0, 1.0)
    np.testing.assert_array_equal([corner.shares for corner in chain.corners], shares)


def test_a_zone_that_is_left_has_its_borders_nearer_and_then_a_slower_pace(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The zone that is judged stays as large as it was asked for."""
    left = [over("zone"), over(factor=2.0)]
    search, judged, chain, _ = kept(monkeypatch, {(turn, 3): left for turn in range(1, 8)}, 3)
    used = []
    for asked in search.asked:
        corner, before = asked.corners[1], asked.courses[1]
        used.append(float(np.abs(before.curve.evaluate(corner.left) - corner.around.corner).max()) / 0.05)
        assert asked.corners[0].left == search.asked[0].corners[0].left
    assert used == pytest.approx([1.0, 0.9, 0.7, 0.5, 0.3, 0.15, 0.15, 0.15])
    shares = [asked.corners[1].shares for asked in search.asked]
    np.testing.assert_allclose(shares[:6], 1.0)
    np.testing.assert_allclose(shares[6:], [0.8**POWERS, 0.64**POWERS])
    assert all(one.corners[1].around.zone.joints == (0.05, 0.05) for one in judged)
    assert chain.corners[1].left == search.asked[-1].corners[1].left


def test_what_a_search_lowers_stays_lowered(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the chain that is judged, in the one that is returned, and where the search goes on."""
    courses, zones = corner_chain(3)
    search, judged = Search([2.0, 2.0], np.array([[0.5, 0.6, 0.7], [1.0, 0.9, 1.0]])), []

    def findings_of(chain: FlyByChain, number: int, part: FlownPart) -> list[Finding]:
        judged.append([corner.shares for corner in chain.corners])
        return [over(factor=2.0)] if number == 3 and len(search.asked) == 1 else []

    monkeypatch.setattr(within_limits, "findings_of", findings_of)
    first = search.shares.copy()
    chain, _ = within_limits._kept(courses, zones, (np.zeros(2), np.zeros(2)), search)  # type: ignore[arg-type]
    np.testing.assert_allclose(judged[:5], [first] * 5)
    again = [corner.shares for corner in search.asked[1].corners]
    np.testing.assert_allclose(again, first * [[1, 1, 1], [0.5, 0.25, 0.125]], rtol=4e-6)
    np.testing.assert_allclose([corner.shares for corner in chain.corners], again)


@pytest.mark.parametrize(("number", "factor"), [(0, 1.5), (1, 1.5), (2, 21.0)])
def test_parts_that_would_be_too_slow_are_stopped_at(
    number: int, factor: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Slower than a twentieth: 1.5 is needed eight times, 21 once."""
    turns = 8 if factor == 1.5 else 1
    with pytest.raises(PlanningError, match="no motion through its zones keeps all limits"):
        kept(monkeypatch, {(turn, number): [over(factor=factor)] for turn in range(1, turns + 1)})
    search, *_ = kept(monkeypatch, {(turn, number): [over(factor=factor)] for turn in range(1, turns)})
    assert len(search.asked) == turns


def test_little_by_little_a_pace_is_lowered_forty_times(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(PlanningError, match="keeps all limits"):
        kept(monkeypatch, {(turn, 0): [over(factor=1.01)] for turn in range(1, 60)})
    search, *_ = kept(monkeypatch, {(turn, 0): [over(factor=1.01)] for turn in range(1, 40)})
    assert len(search.asked) == 40


def test_what_is_lowered_again_and_again_is_lowered_beyond_what_is_needed(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """By a millionth at first, four times as much each time, by a hundredth at most."""
    search, *_ = kept(monkeypatch, {(turn, 0): [over(factor=1.01)] for turn in range(1, 13)})
    tempos = np.array([asked.tempos[0] for asked in search.asked])
    more = tempos[:-1] / tempos[1:] / 1.01 - 1
    np.testing.assert_allclose(more, np.minimum(1e-6 * 4.0 ** np.arange(12), 1e-2), rtol=1e-6)


def within(
    monkeypatch: pytest.MonkeyPatch, first: Search, second: Search | None, *, lowered: bool
) -> tuple[float, float]:
    """Return duration and `model` of the fastest that searches lead to."""
    first.lowered, first.next = lowered, second
    monkeypatch.setattr(within_limits, "MotionSearch", lambda laws: first)
    monkeypatch.setattr(within_limits, "findings_of", lambda *given: [])
    chain = five_lines()
    zones = [corner.around for corner in chain.corners]
    _, parts, model = within_limits._within_limits(chain.courses, zones, chain.ends)
    return within_limits.duration_of(parts), model


@pytest.mark.parametrize(
    ("one", "other", "best"), [(2.0, 3.0, 2.0), (3.0, 2.0, 2.0), (None, 3.0, 3.0), (3.0, None, 3.0)]
)
def test_the_faster_of_two_searches_counts(
    one: float | None, other: float | None, best: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second = Search([one]), Search([other])
    duration, model = within(monkeypatch, first, second, lowered=True)
    assert (duration, model) == (pytest.approx(0.9 * best), best / 2)
    assert first.least == [np.inf if one is None else pytest.approx(0.9 * one)]
    assert not second.least, "what lowers nothing is not tried again"


def test_a_second_search_is_begun_where_one_has_lowered_something_and_is_worth_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    first, second = Search([3.0]), Search([1.0])
    assert within(monkeypatch, first, second, lowered=False)[0] == pytest.approx(2.7)
    assert not second.asked
    assert within(monkeypatch, Search([3.0]), None, lowered=True)[0] == pytest.approx(2.7)
    with pytest.raises(PlanningError, match=r"nothing is found$"):
        within(monkeypatch, Search([None]), Search([None]), lowered=True)


class Line:
    """Stands for a planner of lines."""

    tag = "line"

    def course(self, start: np.ndarray, robot: Robot, planned: Any) -> JointCourse:
        return line(np.array(start), planned.end.position - start, robot)


def moves_through(points: list[np.ndarray], start: State | None = None) -> list[Any]:
    """Return planned moves between points, of the given start; two equal points are a move of no length."""
    moves = []
    for k, (before, after) in enumerate(pairwise(points)):
        curve = constant(before, float(np.abs(after - before).max()))
        planned = SimpleNamespace(curve=curve, end=resting(after))
        begun = start if start is not None and k == 0 else resting(before)
        robot = arm(jerk=70.0 + k)
        moves.append(SimpleNamespace(index=3 + k, planner=Line(), start=begun, robot=robot, planned=planned))
    return moves


def flown_with(
    monkeypatch: pytest.MonkeyPatch, moves: list[Any], robots: list[Robot] | None = None
) -> tuple[FlownChain, dict[str, Any]]:
    """Return a chain without a search, and what that was asked for."""
    asked: dict[str, Any] = {}

    def found(courses: Any, zones: Any, ends: Any) -> tuple[FlyByChain, list[FlownPart], float]:
        asked.update(courses=courses, zones=zones, ends=ends)
        return (
            chain_of(courses, zones, ends, [0.5] * len(zones)),
            [FlownPart(constant(np.zeros(2), 2.5))],
            1.5,
        )

    monkeypatch.setattr(within_limits, "_within_limits", found)
    zones = [Zone(joints=(size, size)) for size in (0.01, 0.02, 0.03, 0.04)][: len(moves) - 1]
    return flown(moves, zones, robots or [arm(jerk=50.0 + k) for k in range(len(moves))]), asked


def test_the_corner_of_a_move_of_no_length_is_one_zone_of_the_earlier_move(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    corners = [POINTS[k] for k in (0, 0, 1, 1, 4, 5)]
    chain, asked = flown_with(monkeypatch, moves_through(corners))
    assert chain.moves == (4, 6, 7)
    assert [around.zone.joints for around in asked["zones"]] == [(0.02, 0.02), (0.04, 0.04)]
    np.testing.assert_array_equal([around.corner for around in asked["zones"]], [POINTS[1], POINTS[4]])
    for k, (course, number) in enumerate(zip(asked["courses"], (1, 3, 4), strict=True)):
        np.testing.assert_allclose(course.curve.evaluate(0.0), (POINTS[0], POINTS[1], POINTS[4])[k])
        assert course.robot.limits.jerk[0, 1] == 50.0 + number, "within which it is planned"
        assert chain.robots[k].limits.jerk[0, 1] == 70.0 + number, "which its move has to keep"
        assert k == 2 or asked["zones"][k].robot is course.robot
    assert (chain.duration, chain.model) == (2.5, 1.5)
    np.testing.assert_array_equal(asked["ends"], np.zeros((2, 2)))
    with pytest.raises(PlanningError, match="its moves have no length"):
        flown_with(monkeypatch, moves_through([POINTS[0], POINTS[0], POINTS[1]]))


def test_a_bound_is_of_what_moves_have_to_keep_with_whole_zones(monkeypatch: pytest.MonkeyPatch) -> None:
    chain, _ = flown_with(monkeypatch, moves_through([POINTS[0], POINTS[1], POINTS[4]]))
    allowed = chain.allowed
    assert [course.robot.limits.jerk[0, 1] for course in allowed.courses] == [70.0, 71.0]
    (corner,), (smaller,) = allowed.corners, chain.chain.corners
    used = [
        np.abs(allowed.courses[0].curve.evaluate(each.left) - POINTS[1]).max() for each in (corner, smaller)
    ]
    assert used == pytest.approx([0.01, 0.005])
    assert corner.robot.limits.jerk[0, 1] == 71.0
    asked: list[Any] = []
    from trajcli.planners.flying_by import proven_bound, second_order

    monkeypatch.setattr(second_order, "second_order_duration", lambda *given: asked.append(given) or 1.25)
    monkeypatch.setattr(proven_bound, "least_duration", lambda *given: asked.append(given) or 1.75)
    for provable, want in ((True, 1.75), (False, None)):
        monkeypatch.setattr(proven_bound, "is_provable", lambda chain, provable=provable: provable)
        assert within_limits.close_bound(chain) == want
    assert within_limits.second_order_bound(chain) == 1.25
    assert len(asked) == 2
    monkeypatch.setattr(proven_bound, "is_provable", lambda chain: True)
    for of, duration in asked:
        assert duration == 2.5
        assert [course.robot.limits.jerk[0, 1] for course in of.courses] == [70.0, 71.0]
    monkeypatch.setattr(within_limits, "find_spec", lambda name: None)
    assert within_limits.close_bound(chain) is None


@pytest.mark.parametrize("number", [0, 1])
def test_other_limits_of_a_move_are_those_of_its_course_alone(
    number: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    chain, asked = flown_with(monkeypatch, moves_through([POINTS[0], POINTS[1], POINTS[4]]))
    before = dict(asked)
    assert within_limits.duration_within(chain, 3 + number, arm(jerk=90.0)) == 2.5
    jerks = [course.robot.limits.jerk[0, 1] for course in asked["courses"]]
    assert jerks == [90.0 if k == number else 50.0 + k for k in range(2)]
    assert asked["zones"][0] is before["zones"][0]
    assert asked["ends"] is before["ends"]


@pytest.mark.parametrize("number", [0, 1])
@pytest.mark.parametrize(
    ("bounds", "names"),
    [
        ({"velocity": [[-3, 3], [-np.inf, 3]]}, "velocity of j2"),
        ({"velocity": [[-3, np.inf], [-3, 3]]}, "velocity of j1"),
        ({"acceleration": np.inf}, "acceleration of j1, j2"),
    ],
)
def test_a_joint_without_a_limit_of_velocity_or_acceleration_is_named(
    number: int, bounds: dict[str, Any], names: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    moves = moves_through([POINTS[0], POINTS[1], POINTS[4]])
    robots = [arm(**bounds) if k == number else arm(jerk=np.inf) for k in range(2)]
    with pytest.raises(
        MissingLimitError, match=f"line needs a limit on the {names} to fly by a corner"
    ) as refused:
        flown_with(monkeypatch, moves, robots)
    assert "`zone: stop`" in str(refused.value.problems[0].hint)
    flown_with(monkeypatch, moves, [arm(jerk=np.inf)] * 2)


def test_a_chain_begins_with_the_rates_of_its_joints(monkeypatch: pytest.MonkeyPatch) -> None:
    way = POINTS[1] - POINTS[0]
    start = State(POINTS[0], 0.5 * way, -2.0 * way)
    _, asked = flown_with(monkeypatch, moves_through([POINTS[0], POINTS[1], POINTS[4]], start))
    np.testing.assert_allclose(asked["ends"], [[0.5, -2.0], [0.0, 0.0]])
    aside = State(POINTS[0], 0.5 * way, np.array([0.1, 0.3]))
    with pytest.raises(PlanningError, match="acceleration"):
        flown_with(monkeypatch, moves_through([POINTS[0], POINTS[1], POINTS[4]], aside))


@pytest.mark.parametrize(("jerk", "refused"), [([[-60, 60], [-np.inf, np.inf]], True), (np.inf, False)])
def test_a_path_that_bends_where_joints_start_in_motion_is_flown_where_their_jerk_has_no_limit(
    jerk: Any, *, refused: bool
) -> None:
    """With q = q0 + q' s + q'' s^2 / 2 the acceleration at a constant speed is none along the path."""
    robot = arm(jerk=jerk)
    rows = np.array([[0.3, 0.2], [0.6, 0.1], POINTS[0]])[:, None, :]
    course = JointCourse(PiecewisePolynomial(np.array([0.0, 1.0]), rows), robot)
    start = State(POINTS[0], 0.5 * rows[1, 0], np.zeros(2))
    if refused:
        with pytest.raises(PlanningError, match="its path bends where the joints start in motion"):
            within_limits._rates_along(course, start)
        assert not within_limits._rates_along(course, resting(POINTS[0])).any()
    else:
        np.testing.assert_allclose(within_limits._rates_along(course, start), [0.5, 0.0])


def test_a_chain_says_what_bolder_states_use_of_its_zones(monkeypatch: pytest.MonkeyPatch) -> None:
    def bolder(self: Search, parts: list[FlownPart]) -> list[FlownPart]:
        self.shares = np.array([[0.75, 0.5, 0.25]])
        return parts

    monkeypatch.setattr(Search, "bolder", bolder)
    _, _, chain, _ = kept(monkeypatch, {})
    assert chain.corners[0].shares == (0.75, 0.5, 0.25)
