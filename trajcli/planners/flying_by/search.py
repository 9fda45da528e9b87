"""Speeds and accelerations at the borders of zones for which a chain of moves lasts least.

A chain is a row of nodes, each with the speed and the acceleration of a law; between two of them lies a part
of a path, on which one variable is fastest, or a zone, through which each joint is. Dynamic programming over
a grid of states at every node finds the basin; grids around the best chain, turned from round to round, and
smaller where they gain nothing, lead to its ground.

Source: Bellman (1957); Torczon, On the convergence of pattern search algorithms, SIAM Journal on Optimization
7(1), 1997.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.planners.flying_by.chain_parts import (
    BorderNode,
    ChainPart,
    PathPart,
    ZonePart,
    ZoneStates,
    without_repeats,
)

_ROUNDS = 120
_FIRST, _SMALLER, _FINEST = 0.2, 0.4, 3e-5  # sizes of grids around a chain, of the bounds of the speed
_NEARBY = 0.05  # size of the first grids around the states of a chain that is much the same
_WIDER, _NARROW = 5.0, 2e-3  # times what these states were changed by; the smallest of these grids
_GOLDEN = math.pi * (3 - math.sqrt(5))  # by which grids are turned
_GAIN = 1e-3  # of the grid's size, relative: what is less does not keep a grid from being halved
_LOOKED_UP = 2000  # zones of one row of grids
_SUMMED = 1 + 1e-12  # durations are added up in another order
_REPEATED = np.array([[1.0], [2.5]])  # times a step that was made
_AT_ONCE = 4  # moves of a chain that are searched together
_AT_FIRST = 3  # of the first grid


@frozen
class FoundStates:
    """States at the nodes of a chain.

    Attributes:
        states: Shape (N, 2), the start and the end among them.
        durations: Of the parts, where no joint waits for another, s; infinite where there is no motion.
    """

    states: Array
    durations: tuple[float, ...]

    @property
    def duration(self) -> float:
        """Of the chain, s."""
        return math.fsum(self.durations)

    def part(self, low: int, high: int) -> FoundStates:
        """Return what is found from one node to another."""
        return FoundStates(self.states[low : high + 1], self.durations[low:high])

    def with_part(self, low: int, part: FoundStates) -> FoundStates:
        """Return the chain with other states from one node on."""
        states, high = self.states.copy(), low + len(part.durations)
        states[low : high + 1] = part.states
        return FoundStates(states, (*self.durations[:low], *part.durations, *self.durations[high:]))


@frozen
class ChainSearch:
    """A search that is under way.

    Long chains are searched by windows, one after another: between their ends, whose states stay, they are
    chains of their own. Each begins at the last path of the one before it.

    Attributes:
        nodes: The inner ones of the chain, k of them.
        parts: What lies between, before and behind them, k + 1.
        best: What is found so far.
        sizes: Of the next grids around it, of the bounds of the speed, for each window.
        steps: What the last round of each window has changed; None where it gained nothing.
        number: Of the next round.
    """

    nodes: tuple[BorderNode, ...]
    parts: tuple[ChainPart, ...]
    best: FoundStates
    sizes: tuple[float, ...]
    steps: tuple[Array | None, ...]
    number: int = 0

    def until(self, size: float = _FINEST) -> ChainSearch:
        """Return the search after as many rounds as make grids smaller than a size."""
        best, sizes, steps, number = self.best, list(self.sizes), list(self.steps), self.number
        if not self.nodes or not math.isfinite(best.duration):
            return self
        windows = _windows(len(self.parts), _AT_ONCE)
        while max(sizes) >= size and number < _ROUNDS:
            for k, (low, high) in enumerate(windows):
                if sizes[k] < size:
                    continue
                before = best.part(low, high)
                other = self._round(before, low, sizes[k], number, steps[k])
                gain = before.duration - other.duration
                steps[k] = other.states - before.states if gain > 0 else None
                if gain < _GAIN * sizes[k] * before.duration:
                    sizes[k] *= _SMALLER
                if gain > 0:
                    best = best.with_part(low, other)
            number += 1
        return ChainSearch(self.nodes, self.parts, best, tuple(sizes), tuple(steps), number)

    def _round(
        self, before: FoundStates, low: int, size: float, number: int, step: Array | None
    ) -> FoundStates:
        """Return the fastest chain among grids around the states of a window, and along its last step."""
        states, high = before.states, low + len(before.durations)
        nodes, parts = self.nodes[low : high - 1], self.parts[low:high]
        inner = [
            node.around(state, size, number * _GOLDEN)
            for node, state in zip(nodes, states[1:-1], strict=True)
        ]
        if step is not None:
            for k, node in enumerate(nodes):
                repeated = node.inside(states[k + 1] + _REPEATED * step[k + 1])
                inner[k] = without_repeats(np.concatenate([inner[k], repeated]))
        grids = _completed([states[:1], *inner, states[-1:]], nodes, parts, back=bool(number % 2))
        return _fastest(grids, parts, before.duration)

    def found(self) -> FoundStates:
        """Return the best states, rounded where their chain still has a motion."""
        if not self.nodes or not math.isfinite(self.best.duration):
            return self.best
        return _rounded(self.nodes, self.parts, self.best)


def _windows(parts: int, moves: int) -> list[tuple[int, int]]:
    """Return the first and the last node of each window of a chain: paths and zones in turns."""
    windows = [(0, min(parts, 2 * moves - 1))]
    while windows[-1][1] < parts:
        low = windows[-1][1] - 1
        windows.append((low, min(parts, low + 2 * moves - 1)))
    return windows


def begin_search(
    nodes: Sequence[BorderNode],
    parts: Sequence[ChainPart],
    ends: tuple[Array, Array],
    near: Array | None = None,
    changes: Array | None = None,
) -> ChainSearch:
    """Return the search of the states at nodes for which a chain lasts least, with its first grid done.

    Args:
        nodes: The inner ones, k of them.
        parts: What lies between, before and behind them, k + 1.
        ends: The states (2,) at the start and at the end.
        near: States at all nodes of a chain that is much the same, (N, 2): the search begins there.
        changes: By what these were changed, (N,), relative: near states of small changes is the best chain.
    """
    first, last = ends[0][None], ends[1][None]
    windows = _windows(len(parts), _AT_ONCE)
    steps = (None,) * len(windows)
    if near is not None:
        inner = [node.inside(state[None]) for node, state in zip(nodes, near[1:-1], strict=True)]
        found = _fastest([first, *inner, last], parts)
        if math.isfinite(found.duration):
            sizes = [_NEARBY] * len(windows)
            if changes is not None:
                largest = (float(changes[low : high + 1].max()) for low, high in windows)
                sizes = [min(max(_WIDER * change, _NARROW), _NEARBY) for change in largest]
            return ChainSearch(tuple(nodes), tuple(parts), found, tuple(sizes), steps)
    grids = [first, *(node.grid() for node in nodes), last]
    found = _by_windows(grids, nodes, parts)
    if not math.isfinite(found.duration):
        found = _fastest(_completed(grids, nodes, parts), parts)
    return ChainSearch(tuple(nodes), tuple(parts), found, (_FIRST,) * len(windows), steps)


def _by_windows(grids: list[Array], nodes: Sequence[BorderNode], parts: Sequence[ChainPart]) -> FoundStates:
    """Return a fast chain whose nodes have states of their grids: window by window, each with an open end."""
    states, durations = grids[0], list[float]()
    for low, high in _windows(len(parts), _AT_FIRST):
        some = [states[low : low + 1], *grids[low + 1 : high + 1]]
        found = _fastest(_completed(some, nodes[low : high - 1], parts[low:high]), parts[low:high])
        states = np.concatenate([states[: low + 1], found.states[1:]])
        durations[low:] = found.durations
    return FoundStates(states, tuple(durations))


def _completed(
    grids: list[Array], nodes: Sequence[BorderNode], parts: Sequence[ChainPart], *, back: bool = False
) -> list[Array]:
    """Return grids that on one side of a zone have the states, too, that are nearest to the other's."""
    completed = list(grids)
    for k, part in enumerate(parts):
        if isinstance(part, ZonePart):
            one, other = (k, k + 1) if back else (k + 1, k)
            near = nodes[one - 1].inside(part.carried(grids[other], back=back))
            completed[one] = without_repeats(np.concatenate([grids[one], near]))
    return completed


def _fastest(grids: Sequence[Array], parts: Sequence[ChainPart], longest: float = math.inf) -> FoundStates:
    """Return the fastest chain whose nodes have states of their grids, if it lasts less than `longest`.

    What all joints need together in a zone is looked up for those of the best chain alone.
    """
    pairs = list(zip(grids[:-1], grids[1:], parts, strict=True))
    costs = _costs(pairs, longest)
    looked_up: set[tuple[int, int, int]] = set()
    for _ in range(_LOOKED_UP):
        chosen = _cheapest(costs)
        open_ended = False
        for k, (before, after, part) in enumerate(pairs):
            i, j = chosen[k], chosen[k + 1]
            if isinstance(part, PathPart) or (k, i, j) in looked_up:
                continue
            looked_up.add((k, i, j))
            together = part.together(before[i], after[j])
            open_ended |= together > costs[k][i, j]
            costs[k][i, j] = max(together, costs[k][i, j])
        if not open_ended:
            break
    else:
        costs[0][:] = math.inf
    states = np.array([grid[k] for grid, k in zip(grids, chosen, strict=True)])
    pairs_chosen = zip(costs, chosen, chosen[1:], strict=False)
    return FoundStates(states, tuple(float(cost[i, j]) for cost, i, j in pairs_chosen))


def _costs(pairs: Sequence[tuple[Array, Array, ChainPart]], longest: float) -> list[Array]:
    """Return durations of parts between states of grids, (p, q) each: in zones what the slowest joint needs.

    The joints come one after another; pairs whose chains all last more than `longest` are left out.
    """
    zones = [
        part.between(before, after) if isinstance(part, ZonePart) else None for before, after, part in pairs
    ]
    orders = [_slowest_first(zone) for zone in zones]
    costs = [
        part.durations(before, after) if isinstance(part, PathPart) else np.zeros((len(before), len(after)))
        for before, after, part in pairs
    ]
    first = not math.isfinite(longest)
    for turn in range(max(map(len, orders))):
        reached, left = least_sums(costs)
        for k, (zone, order) in enumerate(zip(zones, orders, strict=True)):
            if zone is not None and turn < len(order):
                least = reached[k][:, None] + costs[k] + left[k + 1]
                i, j = np.nonzero(least <= longest * _SUMMED)
                slower = zone.durations(i, j, order[turn : turn + 1])[:, 0]
                costs[k][i, j] = np.maximum(costs[k][i, j], slower)
        if first:
            longest = min(longest, _lasts(pairs, _cheapest(costs)))
    return costs


def _slowest_first(zone: ZoneStates | None) -> NDArray[np.int_]:
    """Return the joints of a zone, the slowest between the first states of grids first; none of a path."""
    if zone is None:
        return np.zeros(0, dtype=int)
    first = np.zeros(1, dtype=int)
    return np.argsort(-zone.durations(first, first, np.arange(zone.part.steps.size))[0], kind="stable")


def _lasts(pairs: Sequence[tuple[Array, Array, ChainPart]], chosen: Sequence[int]) -> float:
    total = 0.0
    for (before, after, part), i, j in zip(pairs, chosen, chosen[1:], strict=False):
        if isinstance(part, PathPart):
            total += float(part.durations(before[i : i + 1], after[j : j + 1])[0, 0])
        else:
            total += part.together(before[i], after[j])
    return total


def least_sums(costs: Sequence[Array]) -> tuple[list[Array], list[Array]]:
    """Return the least sums along a row of matrices up to each node, and from there on."""
    reached, left = [np.zeros(1)], [np.zeros(1)]
    for cost in costs:
        reached.append((reached[-1][:, None] + cost).min(axis=0))
    for cost in reversed(costs):
        left.append((cost + left[-1]).min(axis=1))
    return reached, left[::-1]


def _cheapest(costs: Sequence[Array]) -> list[int]:
    """Return the index at each node of the least sum along a row of matrices."""
    total, back = np.zeros(1), []
    for cost in costs:
        reached = total[:, None] + cost
        back.append(reached.argmin(axis=0))
        total = reached.min(axis=0)
    chosen = [int(total.argmin())]
    for row in reversed(back):
        chosen.append(int(row[chosen[-1]]))
    return chosen[::-1]


def _rounded(nodes: Sequence[BorderNode], parts: Sequence[ChainPart], found: FoundStates) -> FoundStates:
    """Return the chain with rounded states, where it has a motion."""
    states = found.states.copy()
    states[1:-1] = [node.rounded(state) for node, state in zip(nodes, states[1:-1], strict=True)]
    other = _fastest(list(states[:, None, :]), parts)
    return other if other.duration <= found.duration * (1 + 1e-5) else found
