"""States at nodes of chains: every choice of small grids tried, windows of long chains, and what a search ends with."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from planners.test_chain_rows import PATH, same_everywhere, zone
from ruckig import InputParameter, Result, Ruckig, Trajectory
from tiers import few

from trajcli.planners.flying_by import search
from trajcli.planners.flying_by.chain_parts import BorderNode, PathPart, ZonePart
from trajcli.planners.flying_by.search import ChainSearch, FoundStates, begin_search, least_sums

REST = np.zeros((1, 2))


def border(leads: bool) -> BorderNode:
    return BorderNode(same_everywhere, leads=leads, goes_on=not leads, distance=0.1)


def lasts(part: Any, first: np.ndarray, last: np.ndarray) -> float:
    """Return the duration of a part between two states: in a zone that of the slowest joint, or of all together."""
    if isinstance(part, PathPart):
        return float(part.durations(first[None], last[None])[0, 0])
    index = np.zeros(1, dtype=int)
    alone = part.between(first[None], last[None]).durations(index, index, np.arange(part.steps.size))
    return max(float(alone.max()), part.together(first, last))


def every_chain(grids: list[np.ndarray], parts: list[Any]) -> list[tuple[float, ...]]:
    """Return the durations of the parts of each choice of states."""
    found = []
    for chosen in itertools.product(*grids):
        pairs = zip(chosen, chosen[1:], parts, strict=False)
        found.append(tuple(lasts(part, *map(np.array, (before, after))) for before, after, part in pairs))
    return found


def random_row(seed: int, zones: int, states: int) -> tuple[list[np.ndarray], list[Any]]:
    rng = np.random.default_rng(seed)
    parts: list[Any] = [PathPart(PATH, 0.7)]
    for _ in range(zones):
        wide = zone(rng)
        near = replace(wide, steps=0.1 * wide.before[0] + 0.1 * wide.after[0] + 0.05 * wide.steps)
        parts += [near, PathPart(PATH, float(rng.uniform(0.3, 0.9)))]
    inner = [rng.uniform([0.1, -1.0], [1.2, 1.0], (states, 2)) for _ in range(2 * zones)]
    return [REST, *inner, REST], parts


@pytest.mark.parametrize(("zones", "states"), [(1, 6), (2, 3)])
@pytest.mark.parametrize("seed", few(range(8), 3))
def test_the_fastest_of_all_choices_of_states_is_found(seed: int, zones: int, states: int) -> None:
    grids, parts = random_row(seed, zones, states)
    every = every_chain(grids, parts)
    best = min(every, key=math.fsum)
    for longest in (math.inf, math.fsum(best) * 1.001):
        found = search._fastest(grids, parts, longest)
        assert found.duration == pytest.approx(math.fsum(best), rel=1e-9)
        assert found.durations == pytest.approx(best, rel=1e-9)
        pairs = zip(found.states, found.states[1:], parts, strict=False)
        assert [lasts(part, *pair) for *pair, part in pairs] == pytest.approx(best, rel=1e-9)
    assert search._fastest(grids, parts, 0.9 * math.fsum(best)).duration >= 0.9 * math.fsum(best)


@pytest.mark.parametrize("seed", few(range(8), 3))
def test_least_sums_are_those_of_all_rows_of_choices(seed: int) -> None:
    rng = np.random.default_rng(seed)
    sizes = [1, 3, 4, 2, 3]
    costs = [rng.uniform(0.1, 9.0, shape) for shape in itertools.pairwise(sizes)]
    reached, left = least_sums(costs)
    every = {
        chosen: [cost[i, j] for cost, i, j in zip(costs, chosen, chosen[1:], strict=False)]
        for chosen in itertools.product(*map(range, sizes))
    }
    for node, count in enumerate(sizes):
        for k in range(count):
            some = [row for chosen, row in every.items() if chosen[node] == k]
            assert reached[node][k] == pytest.approx(min(math.fsum(row[:node]) for row in some))
            assert left[node][k if node < 4 else 0] == pytest.approx(
                min(math.fsum(row[node:]) for row in some)
            )
    assert tuple(search._cheapest(costs)) == min(every, key=lambda chosen: math.fsum(every[chosen]))


def fastest_of_one(bounds: np.ndarray, length: float) -> float:
    """Return ruckig's time of one joint from rest to rest."""
    asked, found = InputParameter(1), Trajectory(1)
    asked.target_position = [length]
    asked.min_velocity, asked.max_velocity = [bounds[0]], [bounds[1]]
    asked.min_acceleration, asked.max_acceleration = [bounds[2]], [bounds[3]]
    asked.max_jerk = [bounds[5]]
    assert Ruckig(1).calculate(asked, found) == Result.Working
    return float(found.duration)


ONE = np.array([-2.0, 2.0, -3.0, 5.0, -40.0, 40.0])


def one_joint(*lengths: float) -> tuple[list[BorderNode], list[Any]]:
    """Return the row of a joint that goes straight through zones."""

    def about(states: np.ndarray) -> np.ndarray:
        return np.tile(ONE, (len(states), 1))

    rates = np.array([[1.0], [0.0]])
    parts = [
        ZonePart(ONE[None], np.array([length]), rates, rates) if k % 2 else PathPart(ONE, length)
        for k, length in enumerate(lengths)
    ]
    return [replace(border(k % 2 == 0), bounds=about) for k in range(len(parts) - 1)], parts


@pytest.mark.parametrize("lengths", [(0.3, 0.2, 0.5), (0.02, 0.1, 1.5), (0.3, 0.2, 0.25, 0.1, 0.5)])
def test_one_joint_that_goes_straight_on_is_found_as_fast_as_without_zones(
    lengths: tuple[float, ...],
) -> None:
    nodes, parts = one_joint(*lengths)
    ends = np.zeros(2), np.zeros(2)
    begun = begin_search(nodes, parts, ends)
    found = begun.until().found()
    want = fastest_of_one(ONE, math.fsum(lengths))
    assert want * (1 - 1e-9) <= found.duration <= want * (1 + 2e-4)
    assert found.duration < begun.best.duration
    again = begin_search(nodes, parts, ends, found.states)
    assert again.best.duration == pytest.approx(found.duration, rel=1e-6)
    assert again.sizes[0] == 0.05
    lost = begin_search(nodes, parts, ends, np.full((len(nodes) + 2, 2), np.nan))
    assert (lost.best.duration, lost.sizes[0]) == (begun.best.duration, 0.2)
    assert min(again.until().found().duration, math.inf) <= found.duration * (1 + 1e-9)


def test_grids_around_states_that_were_hardly_changed_are_small() -> None:
    """Five times the largest change in the window, from 0.002 to 0.05."""
    nodes, parts = one_joint(*[0.2, 0.1] * 5, 0.2)
    states = begin_search(nodes, parts, (REST[0], REST[0])).found().states
    for first, last, sizes in ((0.0, 0.004, [0.002, 0.02]), (0.003, 0.5, [0.015, 0.05])):
        changes = np.zeros(len(states))
        changes[1], changes[-2] = first, last
        begun = begin_search(nodes, parts, (REST[0], REST[0]), states, changes)
        assert begun.sizes == pytest.approx(sizes)
    for node, sizes in ((0, [0.02, 0.002]), (6, [0.02, 0.02]), (7, [0.02, 0.02]), (8, [0.002, 0.02])):
        changes = 0.004 * (np.arange(len(states)) == node)
        begun = begin_search(nodes, parts, (REST[0], REST[0]), states, changes)
        assert begun.sizes == pytest.approx(sizes), "its ends count, too"


@pytest.mark.parametrize("moves", [3, 4])
def test_windows_of_a_chain_begin_at_the_last_path_of_the_one_before(moves: int) -> None:
    for count in range(1, 60, 2):
        windows = search._windows(count, moves)
        assert windows[0][0] == 0
        assert windows[-1][1] == count
        assert all(0 < high - low <= 2 * moves - 1 and low % 2 == 0 for low, high in windows)
        assert all(low == high - 1 for (_, high), (low, _) in itertools.pairwise(windows))
        assert (len(windows) == 1) == (count <= 2 * moves - 1)


def test_parts_of_what_is_found_are_put_in_the_place_of_others() -> None:
    found = FoundStates(np.arange(12.0).reshape(6, 2), (1.0, 2.0, 3.0, 4.0, 5.0))
    part = found.part(1, 4)
    np.testing.assert_array_equal(part.states, np.arange(2.0, 10.0).reshape(4, 2))
    assert (part.durations, part.duration) == ((2.0, 3.0, 4.0), 9.0)
    other = found.with_part(1, FoundStates(-part.states, (0.5, 0.25, 0.125)))
    assert other.durations == (1.0, 0.5, 0.25, 0.125, 5.0)
    np.testing.assert_array_equal(other.states[[0, 5]], found.states[[0, 5]])
    np.testing.assert_array_equal(other.states[1:5], -found.states[1:5])


def rounds(
    gains: list[float], monkeypatch: pytest.MonkeyPatch, zones: int = 1
) -> tuple[ChainSearch, list[Any], list[Any]]:
    """Return a search whose rounds gain parts of its duration, none at last, and what each round is given."""
    nodes = [border(k % 2 == 0) for k in range(2 * zones)]
    parts: list[Any] = [PathPart(PATH, 1.0)] * (2 * zones + 1)
    asked, left = list[Any](), list(gains)

    def made(
        self: ChainSearch, before: FoundStates, low: int, size: float, number: int, step: Any
    ) -> FoundStates:
        asked.append((low, len(before.durations), size, number, step))
        gain = left.pop(0) if left else 0.0
        return FoundStates(before.states + 1.0, tuple((1 - gain) * each for each in before.durations))

    monkeypatch.setattr(ChainSearch, "_round", made)
    windows = len(search._windows(len(parts), 4))
    best = FoundStates(np.zeros((len(parts) + 1, 2)), (1.0,) * len(parts))
    return ChainSearch(tuple(nodes), tuple(parts), best, (0.2,) * windows, (None,) * windows), [], asked


def test_a_grid_gets_smaller_where_it_gains_little_and_steps_that_gained_are_repeated(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Little is less than a thousandth of the grid's size; what loses is not taken."""
    begun, _, asked = rounds([0.1, 1e-4, 0.0, -0.5, 0.01], monkeypatch)
    ended = begun.until(0.003)
    sizes = [size for _, _, size, _, _ in asked]
    assert sizes == pytest.approx([0.2, 0.2, 0.08, 0.032, 0.0128, 0.0128, 0.00512])
    assert [step is not None for *_, step in asked] == [False, True, True, False, False, True, False]
    np.testing.assert_array_equal(asked[1][-1], 1.0)
    assert [number for *_, number, _ in asked] == list(range(7))
    assert ended.number == 7
    assert ended.best.duration == pytest.approx(3 * 0.9 * (1 - 1e-4) * 0.99)
    np.testing.assert_array_equal(ended.best.states, 3.0)
    assert ended.sizes == (pytest.approx(0.2 * 0.4**5),)
    assert ended.until(0.003).number == 7
    before = len(asked)
    finer = ended.until(0.001)
    assert len(asked) == before + 1
    assert finer.number == 8


def test_a_search_that_gains_without_end_has_120_rounds(monkeypatch: pytest.MonkeyPatch) -> None:
    begun, _, asked = rounds([0.01] * 500, monkeypatch)
    assert begun.until().number == len(asked) == 120


def test_windows_are_searched_one_after_another_each_until_its_grid_is_small(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    begun, _, asked = rounds([0.0, 0.1, 0.0, 0.1, 0.0, 0.0], monkeypatch, zones=6)
    ended = begun.until(0.02)
    assert ended.best.durations == pytest.approx((1.0,) * 6 + (0.81,) * 7)
    assert [(low, count) for low, count, *_ in asked] == [
        (0, 7),
        (6, 7),
        (0, 7),
        (6, 7),
        (0, 7),
        (6, 7),
        (6, 7),
        (6, 7),
    ]
    assert [size for _, _, size, _, _ in asked[:6]] == pytest.approx([0.2, 0.2, 0.08, 0.2, 0.032, 0.2])


def test_where_nothing_is_to_be_found_a_search_ends_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    alone = begin_search([], [PathPart(ONE, 0.7)], (REST[0], REST[0]))
    assert alone.until() is alone
    assert alone.found().duration == pytest.approx(fastest_of_one(ONE, 0.7))
    nodes, parts = one_joint(0.3, 0.2, 0.5)
    lost = FoundStates(np.zeros((4, 2)), (1.0, math.inf, 1.0))
    monkeypatch.setattr(search, "_fastest", lambda *given: replace(lost))
    none = begin_search(nodes, parts, (REST[0], REST[0]))
    assert none.best.duration == math.inf
    assert none.until() is none
    assert none.found() is none.best


def test_states_are_rounded_where_that_costs_next_to_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    nodes, parts = one_joint(0.3, 0.2, 0.5)
    states = np.array([[0.0, 0.0], [0.6180339887, 0.3], [0.7, -0.1234567891], [0.0, 0.0]])
    best = search._fastest(list(states[:, None, :]), parts)
    found = search._rounded(nodes, parts, best)
    want = [nodes[k].rounded(states[k + 1]) for k in (0, 1)]
    np.testing.assert_array_equal(found.states, [states[0], *want, states[3]])
    assert found.duration == pytest.approx(best.duration, rel=1e-5)
    for longer, taken in ((1 + 0.9e-5, True), (1 + 1.1e-5, False), (math.inf, False)):
        other = FoundStates(states, (best.duration * longer,))
        monkeypatch.setattr(search, "_fastest", lambda *given, other=other: other)
        assert search._rounded(nodes, parts, best) is (other if taken else best)


@pytest.mark.parametrize("back", [False, True])
def test_grids_have_the_states_to_which_those_on_the_other_side_of_a_zone_lead(*, back: bool) -> None:
    grids, parts = random_row(5, 2, 4)
    nodes = [border(k % 2 == 0) for k in range(4)]
    completed = search._completed(grids, nodes, parts, back=back)
    for node in range(6):
        changed = node in ((1, 3) if back else (2, 4))
        if not changed:
            np.testing.assert_array_equal(completed[node], grids[node])
            continue
        part, other = (parts[node], grids[node + 1]) if back else (parts[node - 1], grids[node - 1])
        near = nodes[node - 1].inside(part.carried(other, back=back))
        found = {tuple(row) for row in completed[node].tolist()}
        assert found == {tuple(row) for row in np.concatenate([grids[node], near]).tolist()}


def test_the_slowest_joint_of_a_zone_is_looked_at_first() -> None:
    part = zone(np.random.default_rng(1))
    states = part.between(np.array([[0.2, 0.1], [0.9, 0.5]]), np.array([[0.3, -0.1]]))
    index = np.zeros(1, dtype=int)
    alone = [float(states.durations(index, index, np.array([joint]))[0, 0]) for joint in range(3)]
    assert search._slowest_first(states).tolist() == sorted(range(3), key=lambda joint: -alone[joint])
    assert search._slowest_first(None).size == 0


def test_a_round_looks_around_the_states_of_its_window_and_along_its_last_step(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Grids are turned by the golden angle from round to round, and completed in turns from either side."""
    nodes, parts = one_joint(0.2, 0.1, 0.2, 0.1, 0.3)
    states = np.array([[0, 0], [0.5, 0.1], [0.6, 0.0], [0.7, -0.1], [0.6, 0.2], [0, 0.0]])
    found = FoundStates(states, (1.0, 2.0, 3.0, 4.0, 5.0))
    seen: dict[str, Any] = {}

    def fastest(grids: Any, some: Any, longest: float) -> FoundStates:
        seen.update(grids=grids, parts=some, longest=longest)
        return found

    def completed(grids: Any, some: Any, between: Any, *, back: bool) -> Any:
        seen.update(nodes=some, back=back)
        return grids

    monkeypatch.setattr(search, "_fastest", fastest)
    monkeypatch.setattr(search, "_completed", completed)
    begun = ChainSearch(tuple(nodes), tuple(parts), found, (0.1,), (None,))
    step = np.full((4, 2), 0.01)
    for number, moved in ((4, None), (5, step)):
        before = found.part(2, 5)
        assert begun._round(before, 2, 0.1, number, moved) is found
        assert (seen["nodes"], seen["parts"]) == (tuple(nodes[2:4]), tuple(parts[2:5]))
        assert (seen["longest"], seen["back"]) == (12.0, number == 5)
        np.testing.assert_array_equal(seen["grids"][0], states[2:3])
        np.testing.assert_array_equal(seen["grids"][3], states[5:])
        for k in (1, 2):
            around = nodes[k + 1].around(states[k + 2], 0.1, number * (math.pi * (3 - math.sqrt(5))))
            rows = {tuple(row) for row in around.tolist()}
            if moved is not None:
                further = nodes[k + 1].inside(states[k + 2] + np.array([[0.01, 0.01], [0.025, 0.025]]))
                rows |= {tuple(row) for row in further.tolist()}
            assert {tuple(row) for row in seen["grids"][k].tolist()} == rows


@pytest.mark.parametrize("seed", few(range(4), 2))
def test_a_long_chain_begins_with_what_is_fastest_window_by_window(seed: int) -> None:
    grids, parts = random_row(seed, 4, 2)
    nodes = [border(k % 2 == 0) for k in range(8)]
    found = search._by_windows(grids, nodes, parts)
    pairs = zip(found.states, found.states[1:], parts, strict=False)
    assert found.durations == pytest.approx([lasts(part, *pair) for *pair, part in pairs], rel=1e-9)
    alone = search._fastest(search._completed(grids[:6], nodes[:4], parts[:5]), parts[:5])
    np.testing.assert_array_equal(found.states[:5], alone.states[:5])
    start = np.array([[0.7, 0.2]])
    assert search._by_windows([start, *grids[1:]], nodes, parts).states[0].tolist() == start[0].tolist()


def test_a_search_begins_near_states_that_have_a_motion_else_with_windows_and_else_with_all_at_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    nodes, parts = one_joint(*(0.2, 0.1) * 4, 0.3)
    some, none = (FoundStates(np.full((10, 2), size), (size,)) for size in (1.0, math.inf))
    asked = list[str]()

    def found(kind: str, one: FoundStates) -> Any:
        return lambda *given: asked.append(kind) or one

    for near, windowed, want in (
        (some, some, (["all"], (0.05, 0.05))),
        (none, some, (["all", "windows"], (0.2, 0.2))),
        (none, none, (["all", "windows", "all"], (0.2, 0.2))),
    ):
        asked.clear()
        monkeypatch.setattr(search, "_fastest", found("all", near))
        monkeypatch.setattr(search, "_by_windows", found("windows", windowed))
        begun = begin_search(nodes, parts, (REST[0], REST[0]), np.zeros((10, 2)))
        assert (asked, begun.sizes, begun.steps) == (*want, (None, None))


class Waiting:
    """Stands for a zone in which joints wait for each other: its durations are those of a table."""

    def __init__(self, table: np.ndarray) -> None:
        self.table = table

    def together(self, first: np.ndarray, last: np.ndarray) -> float:
        return float(self.table[int(first[0]), int(last[0])])


@pytest.mark.parametrize("seed", few(range(20), 6))
def test_where_joints_wait_for_each_other_the_fastest_chain_is_found(
    seed: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What each joint needs alone is less, and chooses another chain; given up, there is none."""
    rng = np.random.default_rng(seed)
    alone = [rng.uniform(1.0, 2.0, shape) for shape in itertools.pairwise([1, 3, 3, 3, 1])]
    tables = [each + rng.uniform(0.0, 2.0, each.shape) for each in alone]
    tables[-1] = alone[-1] if seed % 2 else tables[-1]
    grids = [np.stack([np.arange(count), np.zeros(count)], axis=1) for count in (1, 3, 3, 3, 1)]
    every = [
        math.fsum(table[i, j] for table, i, j in zip(tables, chosen, chosen[1:], strict=False))
        for chosen in itertools.product(*map(range, (1, 3, 3, 3, 1)))
    ]
    monkeypatch.setattr(search, "_costs", lambda *given: [each.copy() for each in alone])
    parts: list[Any] = [Waiting(table) for table in tables]
    assert search._fastest(grids, parts).duration == pytest.approx(min(every))
    monkeypatch.setattr(search, "_LOOKED_UP", 1)
    assert search._fastest(grids, parts).duration == math.inf


def test_a_window_begins_in_the_state_in_which_the_one_before_it_ends(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    grids = [np.arange(6.0).reshape(3, 2) + 10.0 * k for k in range(10)]
    seen = list[Any]()

    def fastest(some: Any, parts: Any) -> FoundStates:
        seen.append(some)
        return FoundStates(np.stack([grid[-1] for grid in some]), (1.0,) * len(parts))

    monkeypatch.setattr(search, "_fastest", fastest)
    monkeypatch.setattr(search, "_completed", lambda some, nodes, parts: some)
    found = search._by_windows([grids[0][:1], *grids[1:]], [None] * 8, [None] * 9)  # type: ignore[list-item]
    assert [len(some) for some in seen] == [6, 6]
    np.testing.assert_array_equal(seen[1][0], grids[4][-1:])
    for k in range(1, 6):
        np.testing.assert_array_equal(seen[1][k], grids[4 + k])
    np.testing.assert_array_equal(found.states[1:], [grid[-1] for grid in grids[1:]])
    assert found.durations == (1.0,) * 9
