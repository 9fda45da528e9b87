"""Chains as rows of nodes and parts: borders with speeds and accelerations, paths and zones between them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.kinematics.robot import Limits
from trajcli.planners.course import BoundsAbout, Course, law_bounds
from trajcli.planners.fastest_through_points.state_times import (
    common_duration,
    fastest_durations,
    reachable,
)
from trajcli.planners.flying_by.between_stops import CornerZone, FlyByChain

_INSIDE = 0.999999  # of the bounds: states on the edge have no motion at all for ruckig
_SPEEDS, _ACCELERATIONS = 7, 5  # of the first grid
_LONGER = 3.0  # times as large they are in accelerations, which matter less
_SLOW = (1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 0.01, 0.03)  # speeds of the first grid between rest and the next one
_SLOW_SHARES = np.array([0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8])  # times cbrt(jerk * distance^2)
_BUILT_UP = np.array([-0.9, -0.6, 0.0, 0.6, 0.9])  # of what jerk builds up from rest: edges hold a search
_NEAR = 4.0  # times its speed: as far a slow state may be changed
_REST = 1e-12  # of squares of joint velocities: a zone is not entered slower
_FINE = 2.0**-26  # of the largest speed: the grid of speeds, between whose points those behind a zone lie
_GRID = 2.0**-22  # of the bounds, to which states are rounded: last bits of processors do not show
_SHORT = 0.4  # of a grid's size: its inner states
_ACCELERATION_ALONE = np.array([[0.0, -1.0], [0.0, 1.0]])


@frozen
class BorderNode:
    """A border, or a point of a path where its bounds change.

    Attributes:
        bounds: Of the law about states.
        leads: Whether a path leads to it, along which an acceleration was built up.
        goes_on: Whether one goes on from it.
        given: The only state that it may have, (2,); None where it may have others.
        distance: Of s, between it and the corner.
    """

    bounds: BoundsAbout
    leads: bool
    goes_on: bool
    given: Array | None = None
    distance: float = 0.0

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
        return without_repeats(self.inside(np.concatenate([pairs, self._slow_states()])))

    def _slow_states(self) -> Array:
        """Return states of the slow laws that jerk lets turn on the way to the corner, and back, (N, 2)."""
        top, largest = self._sizes
        if not largest:
            return np.zeros((0, 2))
        jerk = float(self.bounds(np.zeros((1, 2)))[0, 5])
        speeds = _SLOW_SHARES * math.cbrt(jerk * self.distance**2)
        speeds = speeds[speeds < _SLOW[-1] * top][:, None]
        pairs = np.broadcast_arrays(speeds, _BUILT_UP * np.sqrt(2 * jerk * speeds))
        return np.stack(pairs, axis=2).reshape(-1, 2)

    def around(self, state: Array, size: float, angle: float) -> Array:
        """Return a state (2,), first, and states around it, (N, 2)."""
        top, largest = self._sizes
        turns = angle + np.arange(8) * math.pi / 4
        circle = np.stack([np.cos(turns), np.sin(turns)], axis=1)
        steps = np.concatenate([np.zeros((1, 2)), size * circle, _SHORT * size * circle[::2]])
        near = min(1.0, _NEAR * float(state[0]) / top)  # slow states are looked at as closely as fast ones
        steps *= [near * top, _LONGER * math.sqrt(near) * largest]
        if near < 1:  # where it turns back, a slow state may have any acceleration
            steps = np.concatenate([steps, size * _LONGER * largest * _ACCELERATION_ALONE])
        return without_repeats(self.inside(state + steps))

    def rounded(self, state: Array) -> Array:
        """Return a state (2,) rounded to a part of the bounds: last bits of processors do not show."""
        grid = np.maximum(_GRID * np.array(self._sizes), 1e-200)  # a bound may be zero
        return np.asarray(self.inside((np.round(state / grid) * grid)[None])[0])


def without_repeats(states: Array) -> Array:
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
        ends, steps = np.hstack([before, after]), np.full(len(before), self.length)
        least = steps / ends[:, ::2].max(axis=1, initial=self.bounds[1])
        found: Array = np.maximum(fastest_durations(steps, ends, limits), least)
        return found.reshape(len(first), len(last))


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

    def between(self, before: Array, after: Array) -> ZoneStates:
        """Return what joints do in states (p, 2) before, and in states (q, 2) behind."""
        first, last = joint_rates(before, self.before), joint_rates(after, self.after)
        limits = np.tile(self.bounds, (len(before), 1))
        backwards = (first * [1.0, -1.0]).reshape(-1, 2)
        return ZoneStates(self, first, last, reachable(backwards, limits).reshape(first.shape[:2]))

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


@frozen
class ZoneStates:
    """States of joints on both sides of a zone.

    Attributes:
        part: The zone.
        first: Velocities and accelerations before it, (p, n, 2).
        last: The same behind it, (q, n, 2).
        kept: Whether each can go on from a state before within its limits: ruckig would pass one, (p, n).
    """

    part: ZonePart
    first: Array
    last: Array
    kept: NDArray[np.bool_]

    def durations(self, before: NDArray[np.int_], after: NDArray[np.int_], joints: NDArray[np.int_]) -> Array:
        """Return what some joints need by themselves between states (N,), by index, one to one, (N, k)."""
        rows, shape = np.ix_(before, joints), (len(before), len(joints))
        pairs = np.concatenate([self.first[rows], self.last[np.ix_(after, joints)]], axis=2)
        steps = np.broadcast_to(self.part.steps[joints], shape).reshape(-1)
        limits = np.broadcast_to(self.part.bounds[joints], (*shape, 6)).reshape(-1, 6)
        alone = fastest_durations(steps, pairs.reshape(-1, 4), limits).reshape(shape)
        return np.where(self.kept[rows], alone, np.inf)


def joint_rates(states: Array, path: Array) -> Array:
    """Return qd and qdd (N, n, 2) of joints on a path with q' and q'' (2, n) under sd and sdd (N, 2)."""
    speed, change = states[:, :1], states[:, 1:]
    return np.stack([speed * path[0], change * path[0] + speed**2 * path[1]], axis=2)


def _pairs(first: Array, last: Array) -> tuple[Array, Array]:
    """Return all pairs of states (p, 2) and (q, 2), each (p q, 2)."""
    return np.repeat(first, len(last), axis=0), np.tile(last, (len(first), 1))


ChainPart = PathPart | ZonePart


@frozen
class ChainRow:
    """A chain as nodes and parts: courses and zones in turns.

    Attributes:
        nodes: Between the parts.
        parts: One for each course and for each zone.
    """

    nodes: tuple[BorderNode, ...]
    parts: tuple[ChainPart, ...]


def backwards(row: ChainRow) -> ChainRow:
    """Return the row of a chain from its end to its start: speeds stay, accelerations change their sign."""
    nodes = [
        BorderNode(
            _mirrored(node.bounds),
            node.goes_on,
            node.leads,
            None if node.given is None else node.given * [1.0, -1.0],
            node.distance,
        )
        for node in reversed(row.nodes)
    ]
    return ChainRow(tuple(nodes), tuple(_backwards(part) for part in reversed(row.parts)))


def _mirrored(bounds: BoundsAbout) -> BoundsAbout:
    def mirrored(states: Array) -> Array:
        rows = bounds(states * [1.0, -1.0])
        return np.stack([rows[:, 0], rows[:, 1], -rows[:, 3], -rows[:, 2], rows[:, 4], rows[:, 5]], axis=1)

    return mirrored


def _backwards(part: ChainPart) -> ChainPart:
    if isinstance(part, PathPart):
        low, high, falling, rising, *jerks = part.bounds.tolist()
        return PathPart(np.array([low, high, -rising, -falling, *jerks]), part.length, part.typical)
    bounds = part.bounds.copy()
    bounds[:, :2] = -part.bounds[:, 1::-1]
    turned = [rates * np.array([[-1.0], [1.0]]) for rates in (part.after, part.before)]
    return ZonePart(bounds, -part.steps, *turned)


def row_of(
    chain: FlyByChain, paces: Sequence[float], eased: Sequence[float], given: Mapping[int, Array]
) -> ChainRow:
    """Return a chain as a row.

    Args:
        chain: Moves between two stops.
        paces: By what the law of each course is faster than its typical bounds let it be: 1 where these are
            its bounds everywhere.
        eased: What part of the pace of each course the states at its borders may use.
        given: States (2,) at nodes that may have no others, by number.
    """
    nodes: list[BorderNode] = []
    parts: list[ChainPart] = []
    for k, course in enumerate(chain.courses):
        first, last = chain.stretch(k)
        bounds = slowed(course.typical_bounds(first, last), chain.tempos[k] * paces[k])
        if k:
            nodes.append(_border(chain, k - 1, course, eased[k], leads=False))
        parts.append(PathPart(bounds, last - first, not course.uniform))
        if k < len(chain.corners):
            nodes.append(_border(chain, k, course, eased[k], leads=True))
            parts.append(_zone_part(chain.corners[k], course, chain.courses[k + 1]))
    for number, state in given.items():
        nodes[number] = replace(nodes[number], given=state)
    return ChainRow(tuple(nodes), tuple(parts))


def slowed(bounds: Array, tempo: float) -> Array:
    """Return bounds (..., 6) of velocity, acceleration and jerk at a slower pace."""
    return np.asarray(bounds * np.repeat([tempo, tempo**2, tempo**3], 2))


def joint_bounds(limits: Limits) -> Array:
    """Return the bounds of the joints, (n, 6)."""
    jerk = np.abs(limits.jerk).min(axis=1)[:, None]
    return np.concatenate([limits.velocity, limits.acceleration, -jerk, jerk], axis=1)


def _border(chain: FlyByChain, number: int, course: Course, eased: float, *, leads: bool) -> BorderNode:
    """Return the node on the border of a zone: what its path allows, and its joints inside."""
    corner = chain.corners[number]
    s, tempo = (corner.left, chain.tempos[number]) if leads else (corner.joined, chain.tempos[number + 1])
    tempo *= eased
    rates, limits = course.rates(np.array([s])), corner.limits
    along, inside = course.bounds(rates), law_bounds(rates, limits, limits.tcp)

    def bounds(states: Array) -> Array:
        return _tighter(slowed(along(states / [tempo, tempo**2]), tempo), inside(states))

    about, distance = (
        _same_everywhere(bounds) if course.uniform else bounds,
        course.length - s if leads else s,
    )
    return BorderNode(about, leads=leads, goes_on=not leads, distance=distance)


def _same_everywhere(bounds: BoundsAbout) -> BoundsAbout:
    """Return bounds that do not depend on the state, evaluated once."""
    row = bounds(np.zeros((1, 2)))

    def about(states: Array) -> Array:
        return np.repeat(row, len(states), axis=0)

    return about


def _zone_part(corner: CornerZone, before: Course, behind: Course) -> ZonePart:
    first, last = before.curve.evaluate(corner.left), behind.curve.evaluate(corner.joined)
    rates = [
        np.stack([course.curve.evaluate(s, order) for order in (1, 2)])
        for course, s in ((before, corner.left), (behind, corner.joined))
    ]
    return ZonePart(joint_bounds(corner.limits), last - first, rates[0], rates[1])


def _tighter(one: Array, other: Array) -> Array:
    """Return the tighter of each of two bounds (N, 6)."""
    return np.where(np.arange(6) % 2, np.minimum(one, other), np.maximum(one, other))
