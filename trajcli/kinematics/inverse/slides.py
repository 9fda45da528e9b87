"""Bases with slides, and those whose first two axes meet: the rows of the table in `bases` beside the elbow.

Every function takes the three lines, a point at zero and the place it shall reach, and returns the values of
the joints, turns as (cosine, sine). Two answers come along a new first axis.

* `cartesian`: t - p = D q with the directions as columns of D. One solution.
* `cylindrical`: slides do not move a point along their common normal n, so n . R1^-1 t = n . p: two angles,
  and the rest is linear. "Left" is the answer with the last slide the further out.
* `stanford`: as the elbow, with (d + b)^2 = |w|^2 - |p|^2 + b^2 in the plane, b = p . h3, for the slide d.
  "Up" is the longer slide. Four solutions.
* `scara`: the height gives the slide, then a pair of parallel turns. Two solutions.
* `ball`: axes 1 and 2 meet in o, so |joint 3 (p) - o| = |t - o|: two answers, each with two
  for joints 1 and 2.

Source: Spong, Hutchinson and Vidyasagar, Robot Modeling and Control (2006), section 3.3; Pieper, The
Kinematics of Manipulators under Computer Control (1968).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.kinematics.columns import (
    Column,
    Entry,
    advance,
    cross,
    difference,
    dot,
    minus,
    plus,
    product,
)
from trajcli.kinematics.inverse.elbow import before, forward_sign, parallel_pair, shoulder_turn
from trajcli.kinematics.inverse.lines import Floats, Line, across_floats
from trajcli.kinematics.inverse.subproblems import (
    FREE,
    TANGENT,
    Turn,
    Watch,
    across,
    levels,
    onto,
    turned,
    unit,
)

INDEPENDENT = 1e-6  # volume of three unit directions: below, an arm hardly moves in one direction


def ahead_of(one: Line, two: Line) -> Floats:
    """Return a direction at right angles to two axes, for arms that are read in another order."""
    return across_floats(two.direction, one.direction)


def cartesian(lines: Sequence[Line], point: Column, target: Column, watch: Watch) -> tuple[Entry, ...]:
    """Return the slides of three independent prismatic joints."""
    way = minus(target, point)
    return tuple(dot(row, way) for row in _rows([line.direction for line in lines]))


def cylindrical(
    lines: Sequence[Line], point: Column, target: Column, watch: Watch
) -> tuple[Turn, Entry, Entry]:
    """Return a turn and two slides."""
    one, two, three = lines
    normal = across_floats(two.direction, three.direction)
    first = shoulder_turn(one, normal, point, target, watch, 1.0)
    way = minus(before(one, target, first), point)
    rows = _rows([two.direction, three.direction, normal])
    return first, dot(rows[0], way), dot(rows[1], way)


def stanford(
    lines: Sequence[Line], point: Column, target: Column, watch: Watch, forward: Floats
) -> tuple[Turn, Turn, Entry]:
    """Return two turns and a slide at right angles to the second."""
    one, two, three = lines
    first = shoulder_turn(one, two.direction, point, target, watch, forward_sign(one, two, forward))
    second, slide = turn_and_slide(two, three, point, before(one, target, first), watch)
    return first, second, slide


def turn_and_slide(turn: Line, slide: Line, point: Column, aim: Column, watch: Watch) -> tuple[Turn, Array]:
    """Return the turns and slides (2, ..., B) in one plane that bring `point` to `aim`."""
    hand, way = (
        across(minus(point, turn.point), turn.direction),
        across(minus(aim, turn.point), turn.direction),
    )
    ahead = dot(hand, slide.direction)
    rest = plus_square(difference(dot(way, way), dot(hand, hand)), ahead)
    distance = difference(_lengths(rest, watch), ahead)
    reached = advance(hand, distance, slide.direction)
    return unit(onto(turn.direction, reached, way), watch, FREE * watch.length**2), np.asarray(distance)


def scara(lines: Sequence[Line], point: Column, target: Column, watch: Watch) -> tuple[Turn, Turn, Entry]:
    """Return two turns about parallel axes and a slide that is not at right angles to them."""
    one, two, three = lines
    height = dot(one.direction, minus(target, point))
    slide = product(1.0 / float(dot(one.direction, three.direction)), height)
    first, second = parallel_pair(one, two, advance(point, slide, three.direction), target, watch)
    return first, second, slide


def ball(
    lines: Sequence[Line], center: Floats, point: Column, target: Column, watch: Watch
) -> tuple[Turn, Turn, Turn | Entry]:
    """Return two turns about axes that meet in `center` after a turn or slide of the third joint."""
    one, two, three = lines
    way = minus(target, center)
    third: Turn | Entry
    if three.prismatic:
        hand = minus(point, center)
        ahead = dot(hand, three.direction)
        rest = plus_square(difference(dot(way, way), dot(hand, hand)), ahead)
        third = difference(_lengths(rest, watch), ahead)
        hand = advance(hand, third, three.direction)
    else:
        link, hand = minus(three.point, center), minus(point, three.point)
        level = product(0.5, difference(difference(dot(way, way), dot(hand, hand)), dot(link, link)))
        third, _ = levels(three.direction, hand, link, level, watch, watch.length**2)
        hand = plus(link, turned(hand, three.direction, third))
    second, _ = levels(two.direction, hand, one.direction, dot(one.direction, way), watch, watch.length)
    first = onto(one.direction, turned(hand, two.direction, second), way)
    return unit(first, watch, FREE * watch.length**2), second, third


def plus_square(value: Entry, root: Entry) -> Array:
    """Return value + root^2."""
    return np.asarray(value + np.square(root))


def _lengths(square: Array, watch: Watch) -> Array:
    """Return plus and minus the root along a new first axis, zero where the square is negative."""
    watch.note(np.abs(square) <= (TANGENT * watch.length) ** 2)
    return watch.both(np.sqrt(np.maximum(square, 0.0)))


def _rows(columns: Sequence[Floats]) -> list[Floats]:
    """Return the rows of the inverse of the matrix with the given columns."""
    a, b, c = columns
    volume = float(dot(a, cross(b, c)))
    rows = []
    for u, v in ((b, c), (c, a), (a, b)):
        x, y, z = across_floats(u, v)
        rows.append((x / volume, y / volume, z / volume))
    return rows
