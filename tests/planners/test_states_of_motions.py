"""States of motions that were found, bolder and calmer ones, and searches of another kind."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from planners.test_searches_of_motions import NO_LAW, USED, begun, chain, lasting, over, search_of

from trajcli.errors import PlanningError
from trajcli.planners.flying_by import motion_search
from trajcli.planners.flying_by.flown_parts import FlownPart, NoLawError
from trajcli.planners.flying_by.motion_search import MotionSearch
from trajcli.planners.flying_by.search import FoundStates


@pytest.mark.parametrize(("expected", "begun"), [(1.9, True), (2.0, True), (2.1, False), (None, False)])
def test_a_second_search_is_begun_where_it_looks_no_slower(
    expected: float | None, monkeypatch: pytest.MonkeyPatch, *, begun: bool
) -> None:
    of = chain("lb")
    search, seen = search_of(chain("lb")), list[Any]()
    search._near, search._paces, search._lowering = np.ones((4, 2)), {id(of.courses[1]): 0.7}, 0.5

    def searched(self: MotionSearch, eased: np.ndarray, *, roughly: bool = False) -> Any:
        seen.append((self.chain, self._near, self._by_order, eased.tolist(), roughly))
        assert self._within == pytest.approx(2.002)
        self._lowering = 9.0
        if expected is None:
            raise PlanningError("none")
        return FoundStates(np.zeros((4, 2)), (expected,)), None

    monkeypatch.setattr(MotionSearch, "_searched", searched)
    other = search.by_pace(of, 2.0)
    assert seen == [(of, search._near, False, [1.0, 0.985], True)]
    assert (other is not None) == begun
    if other is not None:
        assert (other._lowering, other._paces) == (0.0, search._paces)


def boldly(
    monkeypatch: pytest.MonkeyPatch, durations: list[float], **fields: Any
) -> tuple[list[float], list[Any], MotionSearch]:
    """Return durations of what a bolder search returns, and the states that it tries."""
    of = chain(fields.get("kinds", "lbb"))
    search, tried = search_of(of), list[Any]()
    states = np.arange(1.0, 13.0).reshape(6, 2)
    row: Any = "row"
    search._motion = motion_search._Motion(of, row, states, 0.125)
    search._stopping = SimpleNamespace(parts=lambda chain: fields.get("given", {}))  # type: ignore[assignment]

    def made(chain: Any, row: Any, states: np.ndarray, laws: Any, given: Any) -> list[FlownPart]:
        tried.append(states / search._motion.states)
        if len(tried) > len(durations):
            raise NoLawError("none", {0: None})
        return lasting(durations[len(tried) - 1])

    monkeypatch.setattr(motion_search, "flown_parts", made)
    raised = fields.get("raised", list[float]())
    monkeypatch.setattr(search, "_raise_shares", lambda parts: raised.append(parts[0].curve.duration))
    monkeypatch.setattr(search, "_over", lambda states: [(fields.get("zones", {}).get(len(tried), []), USED)])
    monkeypatch.setattr(
        motion_search, "findings_of", lambda chain, k, part: fields.get("parts", {}).get(len(tried), [])
    )
    parts = search.bolder(lasting(2.0))
    return [part.curve.duration for part in parts], tried, search


def test_bolder_states_are_tried_as_long_as_they_are_faster(monkeypatch: pytest.MonkeyPatch) -> None:
    found, tried, search = boldly(monkeypatch, [1.9, 1.8])
    assert (found, len(tried)) == ([1.8], 3)
    assert search.model == 1.8 - 0.125
    boldly(monkeypatch, [1.9, 1.8, 1.85], raised=(raised := list[float]()))
    assert raised == [1.9, 1.8], "of motions that are taken"
    for turn, ratios in enumerate(tried, 1):
        want = np.ones((6, 2))
        want[2:5] = [1.01**turn, 1.06**turn]  # not of the line, nor the end of the chain
        np.testing.assert_allclose(ratios, want)
    assert boldly(monkeypatch, [1.9 - 0.1 * k for k in range(9)])[0] == [pytest.approx(1.4)], "six times"
    assert boldly(monkeypatch, [1.9, 1.9 * (1 - 0.9e-4), 1.0])[0] == [1.9]
    assert boldly(monkeypatch, [1.9, 1.9 * (1 - 1.1e-4)])[0] == [1.9 * (1 - 1.1e-4)]
    assert boldly(monkeypatch, [1.9, 1.8, 1.7], zones={2: [over("zone")]})[0] == [1.8]
    assert boldly(monkeypatch, [1.9, 1.8, 1.7], parts={2: [over("zone")]})[0] == [1.9]
    for index, kept in ((1, [2, 3]), (2, [4])):
        ratios = boldly(monkeypatch, [1.9], given={index: "part"})[1][0]
        assert (ratios[kept] == 1).all()
        assert (ratios[[k for k in (2, 3, 4) if k not in kept]] > 1).all()
    (ratios, *_) = boldly(monkeypatch, [1.9], kinds="bbl")[1]
    np.testing.assert_array_equal((ratios > 1).all(axis=1), [False, True, True, True, False, False])
    exact = search_of(chain())
    assert exact.bolder(parts := lasting(1.0)) is parts


def test_the_node_nearer_to_where_a_law_fails_is_calmed() -> None:
    of = chain("lll")
    search, (first, last) = search_of(of), of.stretch(1)
    middle = 0.5 * (first + last)
    assert [search._failing(1, s) for s in (None, first, middle - 0.01, middle + 0.01, last)] == [
        1,
        1,
        1,
        2,
        2,
    ]
    assert search._failing(2, of.stretch(2)[0]) == 3
    assert search._failing(0, of.stretch(0)[1]) == 0


@pytest.mark.parametrize(("calm", "free"), [({1}, {0}), ({0}, {1}), ({2, 3}, set()), ({1, 2}, {0, 3})])
def test_calmer_states_leave_those_on_the_other_side_of_their_zones_free(
    calm: set[int], free: set[int], monkeypatch: pytest.MonkeyPatch
) -> None:
    from trajcli.planners.flying_by.chain_parts import BorderNode

    search, states = search_of(chain("lll")), np.arange(1.0, 13.0).reshape(6, 2)
    nodes = tuple(
        BorderNode(lambda states: states, leads=True, goes_on=False, distance=float(k)) for k in range(4)
    )
    row: Any = SimpleNamespace(nodes=nodes, parts="parts")
    searches = begun(monkeypatch, [2.0, 1.5])
    assert search._calmed(calm, row, states).duration == 1.5
    given, parts, ends, near = searches[0].asked
    want = states.copy()
    for node in calm:
        want[node + 1] *= [0.99, 0.9]
    np.testing.assert_allclose(near, want)
    assert (parts, ends) == ("parts", search.chain.ends)
    for k, node in enumerate(given):
        assert node.distance == k
        if k in free:
            assert node is nodes[k]
        else:
            np.testing.assert_allclose(node.given, want[k + 1])
    np.testing.assert_array_equal(states, np.arange(1.0, 13.0).reshape(6, 2))


@pytest.mark.parametrize(
    ("errors", "slower", "flown"),
    [
        ([], 1.0, True),
        ([NO_LAW] * 3, 1.049, True),
        ([NoLawError(f"law {k}", {0: None}) for k in range(4)], 1.0, False),
        ([NO_LAW], 1.051, False),
        ([NoLawError("far", {0: None}, far=True)], 1.0, False),
        ([NO_LAW, NoLawError("far", {0: None}, far=True)], 1.0, False),
    ],
)
def test_states_are_calmed_three_times_and_for_a_twentieth_at_most(
    errors: list[NoLawError], slower: float, monkeypatch: pytest.MonkeyPatch, *, flown: bool
) -> None:
    search, asked = search_of(chain("bb")), list[Any]()
    first, calmer = (FoundStates(np.full((4, 2), size), (2.0 * size,)) for size in (1.0, slower))

    def made(
        chain: Any, row: Any, states: np.ndarray, laws: Any, given: Any, doubtful: Any
    ) -> list[FlownPart]:
        asked.append((states[0, 0], set(doubtful)))
        if len(asked) <= len(errors):
            raise errors[len(asked) - 1]
        return lasting(1.0)

    monkeypatch.setattr(motion_search, "flown_parts", made)
    monkeypatch.setattr(search, "_calmed", lambda *given: calmer)
    if flown:
        found, _ = search._flown("row", first)  # type: ignore[arg-type]
        assert found is (calmer if errors else first)
        assert asked == [(1.0, set())] + [(slower, {0})] * len(errors)
    else:
        with pytest.raises(NoLawError) as refused:
            search._flown("row", first)  # type: ignore[arg-type]
        assert refused.value is errors[0]


def test_only_zones_tell_whether_a_motion_has_to_change(monkeypatch: pytest.MonkeyPatch) -> None:
    search, judged = search_of(chain("lll")), list[tuple[int, Any]]()
    monkeypatch.setattr(
        motion_search,
        "findings_of",
        lambda chain, k, part: judged.append((k, part)) or ([1] if k == 3 else []),
    )
    assert search._leaves_zones(["a", "b", "c", "d", "e"])  # type: ignore[list-item]
    assert judged == [(1, "b"), (3, "d")]
