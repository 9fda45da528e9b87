"""Speeds and accelerations at the borders of zones for which a chain of moves lasts least.

A chain is a row of nodes, each with the speed and the acceleration of a law; between two of them lies a part
of a path, on which one variable is fastest, or a zone, through which each joint is. Dynamic programming over
a grid of states at every node finds the basin; grids around the best chain, turned from round to round and
halved where they gain nothing, lead to its ground. Each is exact among its states, and no round is slower.

Source: Bellman, Dynamic Programming (1957); Torczon, On the convergence of pattern search algorithms, SIAM
Journal on Optimization 7(1), 1997.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.planners.fastest_through_points.state_times import (
    common_duration,
    fastest_durations,
    reachable,
)

_INSIDE = 0.999999  # of the bounds: states on the edge have no motion at all for ruckig
_SPEEDS, _ACCELERATIONS = 9, 5  # of the first grid
_ROUNDS = 120
_FIRST, _SMALLER, _FINEST = 0.2, 0.6, 3e-5  # sizes of grids around a chain, of the bounds of the speed
_NEARBY = 0.05  # size of the first grids around the states of a chain that is much the same
_LONGER = 3.0  # times as large they are in accelerations, which matter less
_SLOW = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.03)  # speeds of the first grid between rest and the next one
_NEAR = 4.0  # times its speed: as far a slow state may be changed
_REST = 1e-12  # of squares of joint velocities: a zone is not entered slower
_FINE = 2.0**-26  # of the largest speed: the grid of speeds, between whose points those behind a zone lie
_GOLDEN = math.pi * (3 - math.sqrt(5))  # by which grids are turned
_GAIN = 1e-3  # of the grid's size, relative: what is less does not keep a grid from being halved
_GRID = 2.0**-22  # of the bounds, to which states are rounded: last bits of processors do not show
_LOOKED_UP = 2000  # zones of one row of grids
_SUMMED = 1 + 1e-12  # durations are added up in another order
_SHORT = 0.4  # of a grid's size: its inner states


BoundsAbout = Callable[[Array], Array]
"""Bounds of a law about states (N, 2): lower and upper ones of sd, sdd and sddd, (N, 6)."""


@frozen
class BorderNode:
    """A border, or a point of a path where its bounds change.

    Attributes:
        bounds: Of the law about states.
        leads: Whether a path leads to it, along which an acceleration was built up.
        goes_on: Whether one goes on from it.
        given: The only state that it may have, (2,); None where it may have others.
    """

    bounds: BoundsAbout
    leads: bool
    goes_on: bool
    given: Array | None = None

    @cached_property
    def _sizes(self) -> tuple[float, float]:
        """The largest speed, and the largest acceleration at rest."""
        _, top, low, high, _, jerk = self.bounds(np.zeros((1, 2)))[0].tolist()
        return top, max(high, -low) if math.isfinite(jerk) else 0.0

    def inside(self, states: Array) -> Array:
        """Return states (N, 2) of sd and sdd moved to where a law within the bounds can have them.

        An acceleration a that was built up from zero changed the speed by a |a| / (2 jerk), and so does one
        that is taken back; before and after it the law must go forward, and keep its largest speed. Speeds
        behind a zone are none of those before it: where a joint comes back exactly as it went, with the same
        acceleration, ruckig 0.19 crashes.
        """
        if self.given is not None:
            return np.tile(self.given, (len(states), 1))
        top, largest = self._sizes
        speed, grid = np.clip(states[:, 0], 0.0, _INSIDE * top), _FINE * top
        if grid:
            speed = (np.floor(speed / grid) + 0.5 * (not self.leads)) * grid
        if not largest:
            return np.stack([speed, np.zeros(len(states))], axis=1)
        about = self.bounds(np.stack([speed, np.clip(states[:, 1], -largest, largest)], axis=1))
        change = np.clip(states[:, 1], _INSIDE * about[:, 2], _INSIDE * about[:, 3])
        falling, rising = -_INSIDE * about[:, 4], _INSIDE * about[:, 5]
        to_top = np.maximum(_INSIDE * top - speed, 0.0)
        if self.leads:
            change = np.clip(change, -np.sqrt(2 * falling * to_top), np.sqrt(2 * rising * speed))
        if self.goes_on:
            change = np.clip(change, -np.sqrt(2 * rising * speed), np.sqrt(2 * falling * to_top))
        return np.stack([speed, change], axis=1)

    def grid(self) -> Array:
        """Return states all over the bounds, and of speeds that small zones have, (N, 2)."""
        top, largest = self._sizes
        speeds = np.append(np.linspace(0.0, 1.0, _SPEEDS), _SLOW)[:, None] * top
        changes = np.append(np.linspace(-largest, largest, _ACCELERATIONS), 0.0)
        pairs = np.stack(np.broadcast_arrays(speeds, changes), axis=2).reshape(-1, 2)
        return _without_repeats(self.inside(pairs))

    def around(self, state: Array, size: float, angle: float) -> Array:
        """Return a state (2,), first, and states around it, (N, 2)."""
        top, largest = self._sizes
        turns = angle + np.arange(8) * math.pi / 4
        circle = np.stack([np.cos(turns), np.sin(turns)], axis=1)
        steps = np.concatenate([np.zeros((1, 2)), size * circle, _SHORT * size * circle[::2]])
        near = min(1.0, _NEAR * float(state[0]) / top)  # slow states are looked at as closely as fast ones
        return _without_repeats(
            self.inside(state + steps * [near * top, _LONGER * math.sqrt(near) * largest])
        )

    def rounded(self, state: Array) -> Array:
        """Return a state (2,) rounded to a part of the bounds: last bits of processors do not show."""
        grid = _GRID * np.maximum(self._sizes, np.finfo(np.float64).tiny)
        return np.asarray(self.inside((np.round(state / grid) * grid)[None])[0])


def _without_repeats(states: Array) -> Array:
    """Return states (N, 2) each once, in the order in which they come."""
    kept = dict.fromkeys(map(tuple, states.tolist()))
    return np.array(list(kept))


@frozen
class PathPart:
    """A part of a path between two nodes.

    Attributes:
        bounds: Of its law, (6,).
        length: Of s.
        typical: Whether the bounds stand for others that differ from place to place.
    """

    bounds: Array
    length: float
    typical: bool = False

    def durations(self, first: Array, last: Array) -> Array:
        """Return the shortest durations between states (p, 2) and (q, 2), shape (p, q)."""
        before, after = _pairs(first, last)
        limits = np.tile(self.bounds, (len(before), 1))
        if self.typical:
            _leave_room(limits, before, after)
        steps = np.full(len(before), self.length)
        return fastest_durations(steps, np.hstack([before, after]), limits).reshape(len(first), len(last))


def _leave_room(limits: Array, before: Array, after: Array) -> None:
    """Widen bounds (N, 6), which are typical ones, until states (N, 2) at borders are within them.

    An acceleration at the start is taken back behind it, and one at the end was built up before it: only
    there does it ask for a larger speed.
    """
    for each, sign in ((before, 1.0), (after, -1.0)):
        change = np.abs(each[:, 1]) / _INSIDE
        limits[:, 2], limits[:, 3] = np.minimum(limits[:, 2], -change), np.maximum(limits[:, 3], change)
        beyond = np.maximum(sign * each[:, 1], 0.0) / _INSIDE
        limits[:, 1] = np.maximum(limits[:, 1], each[:, 0] / _INSIDE + beyond**2 / (2 * limits[:, 5]))


@frozen
class ZonePart:
    """A zone between two nodes: all joints go from the path before to the path behind.

    Attributes:
        bounds: Of each joint, (n, 6).
        steps: How far each goes, (n,).
        before: q' and q'' at the node before, (2, n).
        after: The same at the node behind.
    """

    bounds: Array
    steps: Array
    before: Array
    after: Array

    def durations(self, before: Array, after: Array, joints: NDArray[np.int_]) -> Array:
        """Return what some joints need by themselves between states (N, 2), one to one, (N, k)."""
        count = len(before)
        rates = [
            joint_rates(states, path[:, joints])
            for states, path in ((before, self.before), (after, self.after))
        ]
        steps, limits = np.tile(self.steps[joints], count), np.tile(self.bounds[joints], (count, 1))
        pairs = np.concatenate(rates, axis=2).reshape(-1, 4)
        alone = fastest_durations(steps, pairs, limits)
        alone[~reachable(pairs[:, :2] * [1.0, -1.0], limits)] = np.inf  # ruckig would pass a limit and brake
        return np.asarray(alone.reshape(count, len(joints)))

    def carried(self, states: Array, *, back: bool = False) -> Array:
        """Return the states (N, 2) behind a zone to which constant accelerations lead, or before it, back."""
        origin, path = (self.after, self.before) if back else (self.before, self.after)
        rates = joint_rates(states, origin)
        velocity, acceleration = rates[:, :, 0], rates[:, :, 1]
        squares = np.maximum(np.square(velocity).sum(axis=1), np.finfo(np.float64).tiny)
        size, time = float(path[0] @ path[0]), np.maximum(velocity @ self.steps, 0.0) / squares
        signed = np.where(squares > _REST, -time if back else time, 0.0)
        speed = (velocity + signed[:, None] * acceleration) @ path[0] / size
        change = (acceleration - (speed**2)[:, None] * path[1]) @ path[0] / size
        return np.stack([speed, change], axis=1)

    def together(self, first: Array, last: Array) -> float:
        """Return the duration in which all joints arrive together, from state (2,) to state (2,)."""
        before, after = joint_rates(first[None], self.before)[0], joint_rates(last[None], self.after)[0]
        return common_duration(self.steps, np.concatenate([before, after], axis=1), self.bounds)


def joint_rates(states: Array, path: Array) -> Array:
    """Return qd and qdd (N, n, 2) of joints on a path with q' and q'' (2, n) under sd and sdd (N, 2)."""
    speed, change = states[:, :1], states[:, 1:]
    return np.stack([speed * path[0], change * path[0] + speed**2 * path[1]], axis=2)


def _pairs(first: Array, last: Array) -> tuple[Array, Array]:
    """Return all pairs of states (p, 2) and (q, 2), each (p q, 2)."""
    return np.repeat(first, len(last), axis=0), np.tile(last, (len(first), 1))


ChainPart = PathPart | ZonePart


@frozen
class FoundStates:
    """States at the nodes of a chain.

    Attributes:
        states: Shape (N, 2), the start and the end among them.
        duration: Of the chain, where no joint waits for another, s; infinite where there is no motion.
    """

    states: Array
    duration: float


@frozen
class ChainSearch:
    """A search that is under way.

    Attributes:
        nodes: The inner ones of the chain, k of them.
        parts: What lies between, before and behind them, k + 1.
        best: What is found so far.
        size: Of the next grids around it, of the bounds of the speed.
        number: Of the next round.
    """

    nodes: tuple[BorderNode, ...]
    parts: tuple[ChainPart, ...]
    best: FoundStates
    size: float = _FIRST
    number: int = 0

    def until(self, size: float = _FINEST) -> ChainSearch:
        """Return the search after as many rounds as make grids smaller than a size."""
        best, own, number = self.best, self.size, self.number
        if not self.nodes or not math.isfinite(best.duration):
            return self
        first, last = best.states[:1], best.states[-1:]
        while own >= size and number < _ROUNDS:
            inner = [
                node.around(state, own, number * _GOLDEN)
                for node, state in zip(self.nodes, best.states[1:-1], strict=True)
            ]
            grids = _completed([first, *inner, last], self.nodes, self.parts, back=bool(number % 2))
            other = _fastest(grids, self.parts, best.duration)
            if best.duration - other.duration < _GAIN * own * best.duration:
                own *= _SMALLER
            if other.duration < best.duration:
                best = other
            number += 1
        return ChainSearch(self.nodes, self.parts, best, own, number)

    def found(self) -> FoundStates:
        """Return the best states, rounded where their chain still has a motion."""
        if not self.nodes or not math.isfinite(self.best.duration):
            return self.best
        return _rounded(self.nodes, self.parts, self.best)


def begin_search(
    nodes: Sequence[BorderNode],
    parts: Sequence[ChainPart],
    ends: tuple[Array, Array],
    near: Array | None = None,
) -> ChainSearch:
    """Return the search of the states at nodes for which a chain lasts least, with its first grid done.

    Args:
        nodes: The inner ones, k of them.
        parts: What lies between, before and behind them, k + 1.
        ends: The states (2,) at the start and at the end.
        near: States at all nodes of a chain that is much the same, (N, 2): the search begins there.
    """
    first, last = ends[0][None], ends[1][None]
    if near is not None:
        inner = [node.inside(state[None]) for node, state in zip(nodes, near[1:-1], strict=True)]
        found = _fastest([first, *inner, last], parts)
        if math.isfinite(found.duration):
            return ChainSearch(tuple(nodes), tuple(parts), found, _NEARBY)
    grids = _completed([first, *(node.grid() for node in nodes), last], nodes, parts)
    return ChainSearch(tuple(nodes), tuple(parts), _fastest(grids, parts))


def _completed(
    grids: list[Array], nodes: Sequence[BorderNode], parts: Sequence[ChainPart], *, back: bool = False
) -> list[Array]:
    """Return grids that on one side of a zone have the states, too, that are nearest to the other's."""
    completed = list(grids)
    for k, part in enumerate(parts):
        if isinstance(part, ZonePart):
            one, other = (k, k + 1) if back else (k + 1, k)
            near = nodes[one - 1].inside(part.carried(grids[other], back=back))
            completed[one] = _without_repeats(np.concatenate([grids[one], near]))
    return completed


def _fastest(grids: Sequence[Array], parts: Sequence[ChainPart], known: float = math.inf) -> FoundStates:
    """Return the fastest chain whose nodes have states of their grids, if it lasts less than is `known`.

    What the slowest joint needs in a zone bounds what all need together from below. That is looked up for the
    zones of the best chain alone, until the best chain has no zone left for which it is not known.
    """
    pairs = list(zip(grids[:-1], grids[1:], parts, strict=True))
    costs = _costs(pairs, known)
    looked_up: set[tuple[int, int, int]] = set()
    for _ in range(_LOOKED_UP):
        total, chosen = _cheapest(costs)
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
        total = math.inf
    states = np.array([grid[k] for grid, k in zip(grids, chosen, strict=True)])
    return FoundStates(states, total)


def _costs(pairs: Sequence[tuple[Array, Array, ChainPart]], known: float) -> list[Array]:
    """Return durations of parts between states of grids, (p, q) each, those of zones from below.

    They are what the slowest joint needs by itself. The joints of a zone come one after another, those first
    that are slow between the first states; pairs of states through which no chain is faster than is `known`
    are left out.
    """
    orders = [_slowest_first(*pair) for pair in pairs]
    costs = [
        part.durations(before, after) if isinstance(part, PathPart) else np.zeros((len(before), len(after)))
        for before, after, part in pairs
    ]
    first = not math.isfinite(known)
    for turn in range(max(map(len, orders))):
        reached, left = _sums(costs)
        for k, ((before, after, part), order) in enumerate(zip(pairs, orders, strict=True)):
            if isinstance(part, ZonePart) and turn < len(order):
                least = reached[k][:, None] + costs[k] + left[k + 1]
                i, j = np.nonzero(least <= known * _SUMMED)
                slower = part.durations(before[i], after[j], order[turn : turn + 1])[:, 0]
                costs[k][i, j] = np.maximum(costs[k][i, j], slower)
        if first:
            known = min(known, _lasts(pairs, _cheapest(costs)[1]))
    return costs


def _slowest_first(before: Array, after: Array, part: ChainPart) -> NDArray[np.int_]:
    """Return the joints of a zone, the slowest between the first states of grids first; none of a path."""
    if isinstance(part, PathPart):
        return np.zeros(0, dtype=int)
    return np.argsort(-part.durations(before[:1], after[:1], np.arange(part.steps.size))[0], kind="stable")


def _lasts(pairs: Sequence[tuple[Array, Array, ChainPart]], chosen: Sequence[int]) -> float:
    """Return the duration of the chain of chosen states."""
    total = 0.0
    for (before, after, part), i, j in zip(pairs, chosen, chosen[1:], strict=False):
        if isinstance(part, PathPart):
            total += float(part.durations(before[i : i + 1], after[j : j + 1])[0, 0])
        else:
            total += part.together(before[i], after[j])
    return total


def _sums(costs: Sequence[Array]) -> tuple[list[Array], list[Array]]:
    """Return the least sums along a row of matrices up to each node, and from there on."""
    reached, left = [np.zeros(1)], [np.zeros(1)]
    for cost in costs:
        reached.append((reached[-1][:, None] + cost).min(axis=0))
    for cost in reversed(costs):
        left.append((cost + left[-1]).min(axis=1))
    return reached, left[::-1]


def _cheapest(costs: Sequence[Array]) -> tuple[float, list[int]]:
    """Return the least sum along a row of matrices, and the index at each node."""
    total, back = np.zeros(1), []
    for cost in costs:
        reached = total[:, None] + cost
        back.append(reached.argmin(axis=0))
        total = reached.min(axis=0)
    index, chosen = 0, [0]
    for row in reversed(back):
        index = int(row[index])
        chosen.append(index)
    return float(total[0]), chosen[::-1]


def _rounded(nodes: Sequence[BorderNode], parts: Sequence[ChainPart], found: FoundStates) -> FoundStates:
    """Return the chain with rounded states, where it has a motion."""
    states = found.states.copy()
    states[1:-1] = [node.rounded(state) for node, state in zip(nodes, states[1:-1], strict=True)]
    other = _fastest(list(states[:, None, :]), parts)
    return other if other.duration <= found.duration * (1 + 1e-5) else found
