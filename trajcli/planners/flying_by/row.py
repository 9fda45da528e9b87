"""Chains as rows of nodes and parts, for the search of the states at their borders."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.kinematics.robot import Limits
from trajcli.planners.course import BoundsAbout, Course, law_bounds
from trajcli.planners.flying_by.between_stops import CornerZone, FlyByChain
from trajcli.planners.flying_by.chain_parts import BorderNode, ChainPart, PathPart, ZonePart


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
