"""Searches of the fastest motions of chains: what lowers zones, which of two counts, and when a search ends."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from planners.test_chains_within_limits import POINTS, WAYS, arm, line, zone_at

from trajcli.curves.piecewise import PiecewisePolynomial, constant
from trajcli.errors import PlanningError
from trajcli.findings import Finding
from trajcli.planners.course import JointCourse
from trajcli.planners.flying_by import motion_search
from trajcli.planners.flying_by.between_stops import FlyByChain, chain_of
from trajcli.planners.flying_by.chain_parts import PathPart
from trajcli.planners.flying_by.flown_parts import CourseLaws, FlownPart, NoLawError
from trajcli.planners.flying_by.motion_search import MotionSearch, with_shares
from trajcli.planners.flying_by.search import FoundStates

POWERS = np.array([1, 2, 3])
REST = np.zeros(2)


def curved(start: np.ndarray, way: np.ndarray) -> JointCourse:
    """Return a path that is no straight line."""
    rows = np.stack([0.1 * way, 0.9 * way, start])[:, None, :]
    return JointCourse(PiecewisePolynomial(np.array([0.0, 1.0]), rows), arm())


def chain(kinds: str = "ll") -> FlyByChain:
    """Return a chain of lines (l) and bent paths (b)."""
    ways = [WAYS[0] if k % 2 == 0 else WAYS[3] for k in range(len(kinds))]
    points = np.cumsum([POINTS[0], *ways], axis=0)
    courses = [
        (line(points[k], way, arm()) if kind == "l" else curved(points[k], way))
        for k, (kind, way) in enumerate(zip(kinds, ways, strict=True))
    ]
    zones = [zone_at(point, arm()) for point in points[1:-1]]
    return chain_of(courses, zones, (REST, REST), [1.0] * len(zones))


def search_of(of: FlyByChain, **fields: Any) -> MotionSearch:
    found = MotionSearch(CourseLaws(), **fields)
    found.chain = of
    return found


def lasting(*durations: float) -> list[FlownPart]:
    return [FlownPart(constant(np.zeros(2), duration)) for duration in durations]


def over(kind: str, factor: float | None = 1.25) -> Finding:
    return Finding(kind, factor=factor)


USED = np.array([0.25, 0.9, 1.0])
ORDER = {
    "tool_speed": 1,
    "tool_angular_speed": 1,
    "tool_acceleration": 2,
    "tool_angular_acceleration": 2,
    "tool_jerk": 3,
    "tool_angular_jerk": 3,
    "effort": None,
    "velocity": None,
    "velocity_by_position": None,
}


@pytest.mark.parametrize(("kind", "order"), ORDER.items())
def test_a_limit_of_the_tool_lowers_of_what_joints_use_the_derivative_that_it_is_about(
    kind: str, order: int | None
) -> None:
    """Others lower the pace: velocity by f, acceleration by f^2, jerk by f^3."""
    pace = 1.25**-POWERS
    want = pace.astype(float)
    if order is not None:
        want = np.ones(3)
        want[order - 1] = USED[order - 1] * pace[order - 1]
    for by_order, shares in ((True, want), (False, pace)):
        search = search_of(chain(), by_order=by_order)
        found = search._kept_shares([over(kind)], USED)
        np.testing.assert_allclose(found, shares, rtol=4e-6)
        assert (found[shares < 1] < shares[shares < 1] * (1 - 0.9e-6)).all()
        assert search.lowered == (by_order and order is not None)


def test_what_several_findings_leave_is_the_least_of_each() -> None:
    search = search_of(chain())
    found = search._kept_shares(
        [over("tool_speed", 1.1), over("tool_jerk", 1.2), over("tool_speed", 1.5)], USED
    )
    np.testing.assert_allclose(found, [0.25 / 1.5, 1.0, 1 / 1.2**3], rtol=4e-6)
    found = search._kept_shares([over("tool_acceleration", 2.0), over("effort", 1.1)], USED)
    np.testing.assert_allclose(found, [1 / 1.1, 0.9 / 4, 1 / 1.1**3], rtol=4e-6)
    assert search.lowered
    none = search_of(chain())
    for factor in (None, 1.0):
        np.testing.assert_array_equal(
            none._kept_shares([over("zone", factor), over("tool_speed", factor)], USED), 1.0
        )
    assert not none.lowered


def test_states_beside_a_lowered_zone_are_as_much_slower(monkeypatch: pytest.MonkeyPatch) -> None:
    """A path at pace p has speeds p and accelerations p^2; acceleration of joints at 0.81 is a pace of 0.9."""
    search = search_of(with_shares(chain("lll"), np.ones((2, 3))))
    states = np.arange(1.0, 13.0).reshape(6, 2)
    monkeypatch.setattr(search, "_over", lambda states: [([], USED), ([], USED)])
    assert not search._lowered(states)
    assert search._near is None
    assert search._changes is None
    kept = iter([np.array([1.0, 0.81, 1.0]), np.ones(3)])
    monkeypatch.setattr(search, "_kept_shares", lambda *given: next(kept))
    assert search._lowered(states)
    paces = np.array([1.0, 0.9, 0.9, 1.0, 1.0, 1.0])
    np.testing.assert_allclose(search._near, states * np.column_stack([paces, paces**2]), rtol=1e-15)
    np.testing.assert_allclose(search._changes, 1 - paces, atol=1e-15)


def test_what_lasts_longer_than_is_known_is_not_searched_any_further(monkeypatch: pytest.MonkeyPatch) -> None:
    """By more than a thousandth, which is how rough the states may be."""
    for durations, count in (((2.0, 2.0019, 2.0021, 3.0), 3), ((2.5, 3.0), 1)):
        search = MotionSearch(CourseLaws(), within=2.0)
        search.chain, given = chain("ll"), list[float]()

        def found(*row: Any, twice: bool, durations: Any = durations, given: Any = given) -> Any:
            for duration in durations[len(given) :]:
                given.append(duration)
                yield FoundStates(np.zeros((4, 2)), (duration,))

        monkeypatch.setattr(motion_search, "_found", found)
        monkeypatch.setattr(search, "_lowered", lambda states: True)
        with pytest.raises(PlanningError, match="no motion"):
            search.fastest(search.chain)
        assert len(given) == count


def test_each_zone_is_lowered_from_what_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    of = with_shares(chain("lll"), np.array([[0.5, 0.6, 0.7], [0.9, 0.8, 0.7]]))
    search = search_of(of)
    monkeypatch.setattr(search, "_over", lambda states: [([], USED), ([over("tool_speed")], USED)])
    assert search._lowered(np.zeros((6, 2)))
    np.testing.assert_allclose(search.shares, [[0.5, 0.6, 0.7], [0.9 * 0.25 / 1.25, 0.8, 0.7]], rtol=4e-6)
    monkeypatch.setattr(search, "_over", lambda states: [([], USED), ([], USED)])
    before = search.shares
    assert not search._lowered(np.zeros((6, 2)))
    np.testing.assert_array_equal(search.shares, before)
    assert not search_of(FlyByChain(of.courses[:1], (), of.ends, (1.0,)))._lowered(np.zeros((2, 2)))


def test_what_joints_use_in_each_zone_is_the_most_of_all_and_no_more_than_their_limits(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    of = with_shares(chain("lll"), np.array([[1.0, 1.0, 1.0], [0.5, 0.25, 0.125]]))
    search, asked = search_of(of), list[Any]()
    rows = np.array([[0.75, -2.25, 0.0], [1.5, 0.0, -9.0]]).T  # of velocity 3, acceleration 8, jerk 60
    coefficients = np.stack([rows[2] / 6, rows[1] / 2, rows[0], rows[0] * 0])[:, None, :]

    def motion(chain: Any, number: int, borders: np.ndarray) -> FlownPart:
        asked.append((number, borders.tolist()))
        return FlownPart(PiecewisePolynomial(np.array([0.0, 1e-9]), coefficients))

    monkeypatch.setattr(motion_search, "zone_motion", motion)
    monkeypatch.setattr(motion_search, "findings_of", lambda chain, number, part: [over(f"part {number}")])
    states = np.arange(12.0).reshape(6, 2)
    (first, used), (second, others) = search._over(states)
    assert asked == [(0, states[1:3].tolist()), (1, states[3:5].tolist())]
    assert [first[0].kind, second[0].kind] == ["part 1", "part 3"]
    np.testing.assert_allclose(used, [0.5, 2.25 / 8, 9 / 60], rtol=1e-6)
    np.testing.assert_allclose(others, [1.0, 1.0, 1.0], rtol=1e-6)


def test_each_zone_is_judged_once_for_its_borders_states_and_shares(monkeypatch: pytest.MonkeyPatch) -> None:
    of = chain("lll")
    one, other = of.corners
    of = replace(of, corners=(one, replace(other, left=one.left, joined=one.joined)))
    search, asked = search_of(of), list[int]()

    def motion(chain: Any, number: int, borders: Any) -> FlownPart:
        asked.append(number)
        return lasting(1.0)[0]

    monkeypatch.setattr(motion_search, "zone_motion", motion)
    monkeypatch.setattr(motion_search, "findings_of", lambda *given: [])
    for states in (np.zeros((6, 2)), np.zeros((6, 2)), np.ones((6, 2))):
        search._over(states)
    search.chain = with_shares(of, np.array([[1.0, 1.0, 1.0], [0.9, 1.0, 1.0]]))
    search._over(np.ones((6, 2)))
    search.chain = replace(of, corners=(replace(one, left=0.1), of.corners[1]))
    search._over(np.ones((6, 2)))
    search.chain = replace(of, corners=(one, replace(of.corners[1], joined=0.2)))
    search._over(np.ones((6, 2)))
    assert asked == [0, 1, 0, 1, 1, 0, 1]


def test_where_an_acceleration_steps_no_size_and_no_pace_is_tried(monkeypatch: pytest.MonkeyPatch) -> None:
    search = search_of(chain())
    monkeypatch.setattr(motion_search, "zone_motion", lambda *given: lasting(1.0)[0])
    monkeypatch.setattr(
        motion_search, "findings_of", lambda *given: [over("zone"), over("tool_acceleration_jump")]
    )
    with pytest.raises(PlanningError, match="the tool's jerk cannot be limited where that of joints is not"):
        search._over(np.zeros((4, 2)))


class Under:
    """A search of states under way: as many times faster as it went on."""

    def __init__(self, durations: list[float], asked: tuple[Any, ...]) -> None:
        self.durations, self.asked, self.sizes = durations, asked, list[float | None]()

    @property
    def best(self) -> Any:
        return SimpleNamespace(duration=self.durations[min(len(self.sizes), len(self.durations) - 1)])

    def until(self, size: float | None = None) -> Under:
        self.sizes.append(size)
        return self

    def found(self) -> FoundStates:
        rows = np.array([[0.0, 0.0], [0.1, 1.0], [0.2, -2.0], [0.0, 0.0]])
        return FoundStates(rows, (0.25 * self.best.duration, 0.0, 0.75 * self.best.duration))


def begun(monkeypatch: pytest.MonkeyPatch, *durations: list[float]) -> list[Under]:
    searches = list[Under]()

    def begin(*given: Any) -> Under:
        searches.append(Under(durations[len(searches)], given))
        return searches[-1]

    monkeypatch.setattr(motion_search, "begin_search", begin)
    return searches


ROW = SimpleNamespace(nodes=("a", "b"), parts=("c", "d", "e"))
ENDS = np.array([0.5, 1.5]), np.array([0.0, -0.5])


@pytest.mark.parametrize("near", [None, np.arange(8.0).reshape(4, 2)])
@pytest.mark.parametrize(
    ("forth", "back"),
    [([9, 2.0, 1.9], [9, 3.0, 1.0]), ([9, 3.0, 1.0], [9, 2.0, 1.9]), ([9, 2.0, 1.9], [9, 2.0, 1.0])],
)
def test_of_a_search_from_either_end_the_faster_one_goes_on(
    forth: list[float], back: list[float], near: np.ndarray | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Backwards accelerations change their sign, and all stands in the opposite order."""
    monkeypatch.setattr(motion_search, "backwards", lambda row: SimpleNamespace(nodes="nodes", parts="parts"))
    searches = begun(monkeypatch, forth, back)
    (found,) = motion_search._found(ROW, ENDS, near, twice=True)  # type: ignore[arg-type]
    first, second = searches
    assert first.asked[:2] == (ROW.nodes, ROW.parts)
    assert second.asked[:2] == ("nodes", "parts")
    np.testing.assert_array_equal(first.asked[2], ENDS)
    np.testing.assert_array_equal(second.asked[2], [[0.0, 0.5], [0.5, -1.5]])
    if near is None:
        assert first.asked[3] is second.asked[3] is None
    else:
        np.testing.assert_array_equal(first.asked[3], near)
        np.testing.assert_array_equal(second.asked[3], [[6, -7], [4, -5], [2, -3], [0, -1]])
    forwards = forth[1] <= back[1]
    assert [len(each.sizes) for each in searches] == ([2, 1] if forwards else [1, 2])
    if forwards:
        assert found.durations == pytest.approx(
            [0.25 * 1.9, 0, 0.75 * 1.9] if forth[2] == 1.9 else [0.25, 0, 0.75]
        )
        np.testing.assert_array_equal(found.states, first.found().states)
    else:
        assert found.durations == pytest.approx([0.75 * back[2], 0, 0.25 * back[2]])
        np.testing.assert_array_equal(found.states, [[0, 0], [0.2, 2.0], [0.1, -1.0], [0, 0]])


def test_where_paths_bend_a_search_is_from_the_start_and_shows_rough_states_first(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    searches = begun(monkeypatch, [9.0, 4.0, 3.0])
    found = motion_search._found(ROW, ENDS, None, twice=False)  # type: ignore[arg-type]
    assert next(found).duration == 4.0
    assert searches[0].sizes == [1e-3]
    assert [each.duration for each in found] == [3.0]
    assert len(searches) == 1


def motions(
    monkeypatch: pytest.MonkeyPatch,
    search: MotionSearch,
    durations: list[Any],
    *,
    leaves: bool = False,
    changes: float = 0.5,
) -> dict[str, list[Any]]:
    """Have a search find motions of some durations; inf for none, an error for no law."""
    asked: dict[str, list[Any]] = {"eased": [], "slow": []}
    turns = iter(durations)
    one = FoundStates(np.zeros((4, 2)), (1.0,))

    def searched(eased: np.ndarray) -> tuple[Any, Any]:
        asked["next"] = [next(turns)]
        search.chain = with_shares(search.chain, 0.9 * search.shares)
        return (one if asked["next"][0] != math.inf else FoundStates(one.states, (math.inf,))), None

    def made(row: Any, found: Any) -> tuple[Any, list[FlownPart]]:
        (duration,) = asked["next"]
        if isinstance(duration, NoLawError):
            raise duration
        return found, lasting(duration)

    monkeypatch.setattr(search, "_searched", searched)
    monkeypatch.setattr(search, "_flown", made)
    monkeypatch.setattr(search, "_leaves_zones", lambda parts: leaves)
    monkeypatch.setattr(search, "_adapted", lambda found: changes)
    monkeypatch.setattr(search, "_ease", lambda *given: asked["eased"].append(given[0]))
    monkeypatch.setattr(motion_search, "_changes", lambda *given: np.ones(2))
    stopping = SimpleNamespace(slow_all=lambda chain: asked["slow"].append(chain) or len(asked["slow"]) < 2)
    search._stopping = stopping  # type: ignore[assignment]
    return asked


NO_LAW = NoLawError("none", {0: None})


@pytest.mark.parametrize(
    ("kinds", "durations", "best", "left"),
    [
        ("ll", [2.0, 1.0], 2.0, 1),
        ("lb", [2.0, 1.0, 0.5], 1.0, 1),
        ("lb", [2.0, 3.0, 0.5], 2.0, 1),
        ("lb", [NO_LAW, NO_LAW, 2.0, 1.5, 0.5], 1.5, 1),
        ("lb", [2.0, NO_LAW, 0.5], 2.0, 1),
        ("lb", [2.0, math.inf, 0.5], 2.0, 1),
        ("lb", [math.inf, 2.0, 1.5], 1.5, 0),
        ("lb", [math.inf, math.inf, 1.5], None, 1),
        ("lb", [NO_LAW] * 15 + [2.0], 2.0, 0),
        ("lb", [NO_LAW] * 16 + [2.0], None, 1),
    ],
)
def test_a_search_ends_with_the_faster_of_the_first_two_motions(
    kinds: str, durations: list[Any], best: float | None, left: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    of = chain(kinds)
    search = search_of(of)
    asked = motions(monkeypatch, search, durations)
    if best is None:
        with pytest.raises(PlanningError, match="no motion through its zones is found within the limits"):
            search.fastest(of)
    else:
        parts = search.fastest(of)
        assert [part.curve.duration for part in parts] == [best]
        assert search.model == best
        turn = durations.index(best) + 1
        np.testing.assert_allclose(search.shares, 0.9**turn, err_msg="its zones are those of that motion")
    before = durations[: durations.index(best)] if best else durations
    if best != 2.0:
        assert len(asked["eased"]) == sum(each is NO_LAW for each in before[:16])


@pytest.mark.parametrize(("leaves", "changes"), [(True, 0.5), (False, 0.029)])
def test_no_second_motion_is_looked_for_where_zones_change_or_laws_are_as_expected(
    leaves: bool,
    changes: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    of = chain("lb")
    search = search_of(of)
    motions(monkeypatch, search, [2.0, 1.0], leaves=leaves, changes=changes)
    search._lowering = 0.25
    assert [part.curve.duration for part in search.fastest(of)] == [2.0]
    assert search.model == 1.75, "without what lowered zones cost"
    motions(monkeypatch, search, [2.5])
    search.fastest(chain("ll"))
    assert search.model == 1.75


def test_courses_that_had_another_law_than_expected_have_another_pace() -> None:
    of = chain("bl")
    search = search_of(of)
    search._paces = {id(of.courses[0]): 0.8}
    assert search._adapted(np.array([0.9, 1.0])) == pytest.approx(0.1)
    assert search._paces == {id(of.courses[0]): pytest.approx(0.72)}
    assert search._adapted(np.array([1.2, 1.0])) == pytest.approx(0.2)


def test_a_law_is_as_much_faster_as_it_lasts_less() -> None:
    of = chain("blb")
    bounds = np.array([-2.0, 2.0, -8.0, 8.0, -60.0, 60.0])
    parts = [PathPart(bounds, 1.0), None, PathPart(bounds, 1.0), None, PathPart(bounds, 2.0)]
    states = np.array([[0.0, 0.0]] + [[1.0, 0.0]] * 4 + [[0.0, 0.0]])
    found = FoundStates(states, (1.0,) * 5)
    row: Any = SimpleNamespace(parts=parts)
    expected = [float(parts[k].durations(states[k : k + 1], states[k + 1 : k + 2])[0, 0]) for k in (0, 4)]  # type: ignore[union-attr]
    actual = lasting(2.0, 0.1, 9.0, 0.1, 0.5)
    want = [expected[0] / 2.0, 1.0, expected[1] / 0.5]
    np.testing.assert_allclose(motion_search._changes(of, row, found, actual), want)


def test_the_pace_of_a_bent_course_comes_from_its_law_from_stop_to_stop() -> None:
    """And is a little less, since a state that is too fast costs a law in vain."""
    of = chain("lb")
    search = search_of(of)
    course, asked = of.courses[1], list[int]()

    def law(chain: Any, index: int) -> FlownPart:
        asked.append(index)
        return lasting(2.5)[0]

    search._stopping = SimpleNamespace(law=law, ends=lambda chain, index: np.zeros((2, 2)))  # type: ignore[assignment]
    part = PathPart(course.typical_bounds(0.0, 1.0), 1.0)
    expected = float(part.durations(np.zeros((1, 2)), np.zeros((1, 2)))[0, 0])
    for _ in range(2):
        assert search._pace(1) == pytest.approx(0.97 * expected / 2.5)
    assert search._pace(0) == 1.0
    assert asked == [1]


def test_of_a_course_without_a_law_less_is_asked_four_times_and_then_its_border_slows_down() -> None:
    of = chain("lbb")
    search, slowed = search_of(of), list[Any]()
    search._stopping = SimpleNamespace(slow=lambda *given: slowed.append(given))  # type: ignore[assignment]
    search._paces = {id(of.courses[1]): 1.0, id(of.courses[2]): 0.5}
    eased, states = search._eased(of), np.zeros((6, 2))
    np.testing.assert_allclose(eased, [1.0, 0.985, 0.985])
    for turn in range(1, 5):
        search._ease(NoLawError("none", {1: 0.25}), eased, states)
        assert search._paces[id(of.courses[1])] == pytest.approx(0.95**turn)
        np.testing.assert_allclose(eased, [1.0, 0.985 ** (turn + 1), 0.985])
    assert not slowed
    search._ease(NoLawError("none", {0: None, 1: 0.25}), eased, states)
    assert [given[1:] for given in slowed] == [(0, None, states), (1, 0.25, states)]
    assert search._paces == {id(of.courses[2]): 0.5}, "what is next is that of the law that stops"


def test_states_are_searched_until_no_zone_is_over_a_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    of = chain()
    search, lowered = search_of(of), iter([True, True, False])
    durations = iter([2.0, 2.5, 2.25])
    rows, near = list[Any](), list[Any]()

    def found(row: Any, ends: Any, states: Any, changes: Any, *, twice: bool) -> Any:
        near.append(states)
        yield FoundStates(np.full((4, 2), len(near)), (next(durations),))

    def row_of(chain: Any, paces: Any, eased: Any, states: Any) -> str:
        rows.append((paces, eased))
        return f"row {len(rows)}"

    monkeypatch.setattr(motion_search, "_found", found)
    monkeypatch.setattr(motion_search, "row_of", row_of)
    monkeypatch.setattr(search, "_lowered", lambda states: next(lowered))
    last, row = search._searched(np.array([0.5, 0.6]))
    assert (last.duration, row) == (2.25, "row 3")
    assert rows == [([1.0, 1.0], [0.5, 0.6])] * 3
    assert near[0] is None
    assert [states[0, 0] for states in near[1:]] == [1, 2], "each begins where the last one ended"
    assert search.model == 2.0, "before any zone was lowered"
    assert search._lowering == pytest.approx(0.5)


def test_zones_are_lowered_seven_times_before_laws_are_looked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    search, count = search_of(chain()), [0, 0]

    def found(*given: Any, twice: bool) -> Any:
        count[0] += 1
        yield FoundStates(np.zeros((4, 2)), (2.0,))

    def lowered(states: Any) -> bool:
        count[1] += 1
        return True

    monkeypatch.setattr(motion_search, "_found", found)
    monkeypatch.setattr(search, "_lowered", lowered)
    search._searched(np.ones(2))
    assert count == [8, 7]


def test_rough_states_are_enough_where_that_is_asked_and_none_are_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    search, asked = search_of(chain("ll")), list[float]()

    def found(*given: Any, twice: bool) -> Any:
        for duration in (3.0, 2.0):
            asked.append(duration)
            yield FoundStates(np.zeros((4, 2)), (duration,))

    monkeypatch.setattr(motion_search, "_found", found)
    monkeypatch.setattr(search, "_lowered", lambda states: False)
    assert search._searched(np.ones(2), roughly=True)[0].duration == 3.0
    assert search._searched(np.ones(2))[0].duration == 2.0
    assert asked == [3.0, 3.0, 2.0]
    none = FoundStates(np.zeros((4, 2)), (math.inf,))
    monkeypatch.setattr(motion_search, "_found", lambda *given, twice: iter([none]))
    monkeypatch.setattr(search, "_lowered", lambda states: pytest.fail("nothing is there to be lowered"))
    assert search._searched(np.ones(2))[0] is none


def test_shares_of_zones_and_durations_of_motions() -> None:
    of = with_shares(chain("lll"), np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6]]))
    assert [corner.shares for corner in of.corners] == [(0.1, 0.2, 0.3), (0.4, 0.5, 0.6)]
    assert motion_search.duration_of(lasting(0.1, 0.2, 0.3)) == 0.6
    assert search_of(replace(of, corners=())).shares.shape == (0, 3)
    assert search_of(chain("ll")).exact
    assert not search_of(chain("lb")).exact
    assert not search_of(chain("bl")).exact


def test_zones_that_use_more_than_their_shares_say_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """Bolder states may: the tool keeps its limits. What is not used leaves a share as it is, and all is one."""
    search = search_of(with_shares(chain("lll"), np.array([[0.5, 0.6, 0.7], [0.98, 1.0, 0.5]])))
    uses = iter(
        [np.array([[1.02, 0.3], [0.9, 0.5], [0.2, 1.1]]), np.array([[1.1, 1.0], [0.5, 1.0], [0.9, 0.1]])]
    )
    monkeypatch.setattr(motion_search, "joint_uses", lambda curve, limits: next(uses))
    search._raise_shares([SimpleNamespace(curve=None)] * 5)
    np.testing.assert_allclose(search.shares, [[0.51, 0.6, 0.77], [1.0, 1.0, 0.5]], rtol=1e-12)
