"""Three joints that bring a point to a place: the arms of three axes, and what carries a spherical wrist.

| joints | condition | way | solutions |
|---|---|---|---|
| RRR | 2 parallel 3 | `elbow` | 4 |
| RRR | 1 meets 2 | the distance from where they meet gives joint 3, then two turns | 4 |
| RRP | 3 at right angles to 2 | as the elbow; the length of the arm in its plane gives the slide | 4 |
| RRP | 1 meets 2 | the distance gives the slide, then two turns | 4 |
| RRP | 1 parallel 2 | the height gives the slide, then a pair of parallel turns (SCARA) | 2 |
| RPP | any | the normal of both slides gives joint 1, the rest is linear (cylindrical) | 2 |
| PPP | independent | linear (Cartesian) | 1 |

Every row is also tried from the tool backwards (the inverse motion is that of the opposite lines), and with
neighbours exchanged where a slide runs along the axis of a turn beside it: such motions commute.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from trajcli.frozen import frozen
from trajcli.kinematics.columns import Column
from trajcli.kinematics.inverse.elbow import elbow, is_elbow
from trajcli.kinematics.inverse.lines import (
    Arm,
    Floats,
    Line,
    meeting_point,
    parallel,
    perpendicular,
)
from trajcli.kinematics.inverse.method import Choice
from trajcli.kinematics.inverse.slides import (
    INDEPENDENT,
    ahead_of,
    ball,
    cartesian,
    cylindrical,
    scara,
    stanford,
)
from trajcli.kinematics.inverse.subproblems import Value, Watch

Reach = Callable[[Column, Column, Watch], Sequence[Value]]
Found = tuple[str, tuple[Choice, ...], Reach]


@frozen
class Base:
    """Three joints that bring a point to a place.

    Attributes:
        name: As "elbow".
        choices: In the order of their axes.
        reach: (point at zero, target, watch) -> the three values: turns of length 1, or slides.
        lines: The three joints.
    """

    name: str
    choices: tuple[Choice, ...]
    reach: Reach
    lines: tuple[Line, ...]


def base_of(arm: Arm) -> Base | None:
    """Return how the first three joints of an arm reach a point; None where no row of the table fits."""
    lines = arm.lines[:3]
    for order, ordered in _orders(lines):
        for backwards in (False, True):
            chain = tuple(line.opposite for line in reversed(ordered)) if backwards else ordered
            given = not backwards and order == (0, 1, 2)
            found = _match(chain, arm.length, arm.forward if given else None)
            if found is not None:
                name, choices, reach = found
                return Base(name, choices, partial(_restored, reach, order, backwards), lines)
    return None


def _restored(
    reach: Reach, order: tuple[int, ...], backwards: bool, point: Column, target: Column, watch: Watch
) -> list[Value]:
    values = list(reach(target, point, watch))[::-1] if backwards else reach(point, target, watch)
    result: list[Value] = [0.0, 0.0, 0.0]
    for place, value in zip(order, values, strict=True):
        result[place] = value
    return result


def _orders(lines: Sequence[Line]) -> Iterator[tuple[tuple[int, ...], tuple[Line, ...]]]:
    yield (0, 1, 2), tuple(lines)
    for order, (i, j) in (((1, 0, 2), (0, 1)), ((0, 2, 1), (1, 2))):
        if lines[i].prismatic != lines[j].prismatic and parallel(lines[i], lines[j]):
            yield order, tuple(lines[k] for k in order)


def _match(lines: tuple[Line, ...], length: float, forward: Floats | None) -> Found | None:
    kinds = "".join("P" if line.prismatic else "R" for line in lines)
    match kinds:
        case "RRR":
            return _match_turns(lines, length, forward)
        case "RRP":
            return _match_turns_and_slide(lines, length, forward)
        case "RPP":
            normal = np.cross(lines[1].direction, lines[2].direction)
            fits = np.linalg.norm(np.cross(normal, lines[0].direction)) > INDEPENDENT
            return ("cylindrical base", ("shoulder",), partial(cylindrical, lines)) if fits else None
        case "PPP":
            independent = abs(np.linalg.det([line.direction for line in lines])) > INDEPENDENT
            return ("Cartesian base", (), partial(cartesian, lines)) if independent else None
    return None


def _match_turns(lines: tuple[Line, ...], length: float, forward: Floats | None) -> Found | None:
    one, two, three = lines
    if is_elbow(lines):
        ahead = forward or ahead_of(one, two)
        return "elbow", ("shoulder", "elbow"), partial(elbow, lines, forward=ahead)
    center = meeting_point(one, two, length)
    if center is not None and not parallel(two, three):
        return "two axes that meet", ("elbow", "shoulder"), partial(ball, lines, center)
    return None


def _match_turns_and_slide(lines: tuple[Line, ...], length: float, forward: Floats | None) -> Found | None:
    one, two, three = lines
    if parallel(one, two):
        if perpendicular(one, three):
            return None
        return "SCARA base", ("elbow",), partial(scara, lines)
    if perpendicular(two, three):
        ahead = forward or ahead_of(one, two)
        return "Stanford base", ("shoulder", "elbow"), partial(stanford, lines, forward=ahead)
    center = meeting_point(one, two, length)
    if center is None or parallel(two, three):
        return None
    return "Stanford base", ("elbow", "shoulder"), partial(ball, lines, center)
