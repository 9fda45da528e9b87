"""Arms of three joints that bring the tcp to a place in space: the bases of `bases` by themselves.

The number of solutions is that of the base: four for the elbow (with or without offsets of the shoulder), RRP
two or four, RPP two, PPP one. The orientation follows; a target that fixes it is met only if it agrees.

Three joints that bring a point to a place: the arms of three axes, and what carries a spherical wrist.

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

Bases with slides, and those whose first two axes meet: the rows of the table in `bases` beside the elbow.

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

from collections.abc import Callable, Iterator, Sequence
from functools import partial

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.kinematics.columns import (
    Entry,
    VectorEntries,
    advance,
    cross,
    difference,
    dot,
    minus,
    plus,
    product,
)
from trajcli.kinematics.inverse.families.elbow import (
    before,
    elbow,
    forward_sign,
    is_elbow,
    parallel_pair,
    shoulder_turn,
)
from trajcli.kinematics.inverse.families.method import Choice, IkMethod
from trajcli.kinematics.inverse.families.screw_axes import (
    AxisGeometry,
    Displacement,
    Floats,
    ScrewAxis,
    across_floats,
    meeting_point,
    parallel,
    perpendicular,
)
from trajcli.kinematics.inverse.families.subproblems import (
    FREE,
    TANGENT,
    DegeneracyFlags,
    Turn,
    Value,
    across,
    levels,
    onto,
    turned,
    unit,
)

INDEPENDENT = 1e-6  # volume of three unit directions: below, an arm hardly moves in one direction


def ahead_of(one: ScrewAxis, two: ScrewAxis) -> Floats:
    """Return a direction at right angles to two axes, for arms that are read in another order."""
    return across_floats(two.direction, one.direction)


def cartesian(
    lines: Sequence[ScrewAxis], point: VectorEntries, target: VectorEntries, watch: DegeneracyFlags
) -> tuple[Entry, ...]:
    """Return the slides of three independent prismatic joints."""
    way = minus(target, point)
    return tuple(dot(row, way) for row in _rows([line.direction for line in lines]))


def cylindrical(
    lines: Sequence[ScrewAxis], point: VectorEntries, target: VectorEntries, watch: DegeneracyFlags
) -> tuple[Turn, Entry, Entry]:
    """Return a turn and two slides."""
    one, two, three = lines
    normal = across_floats(two.direction, three.direction)
    first = shoulder_turn(one, normal, point, target, watch, 1.0)
    way = minus(before(one, target, first), point)
    rows = _rows([two.direction, three.direction, normal])
    return first, dot(rows[0], way), dot(rows[1], way)


def stanford(
    lines: Sequence[ScrewAxis],
    point: VectorEntries,
    target: VectorEntries,
    watch: DegeneracyFlags,
    forward: Floats,
) -> tuple[Turn, Turn, Entry]:
    """Return two turns and a slide at right angles to the second."""
    one, two, three = lines
    first = shoulder_turn(one, two.direction, point, target, watch, forward_sign(one, two, forward))
    second, slide = turn_and_slide(two, three, point, before(one, target, first), watch)
    return first, second, slide


def turn_and_slide(
    turn: ScrewAxis, slide: ScrewAxis, point: VectorEntries, aim: VectorEntries, watch: DegeneracyFlags
) -> tuple[Turn, Array]:
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


def scara(
    lines: Sequence[ScrewAxis], point: VectorEntries, target: VectorEntries, watch: DegeneracyFlags
) -> tuple[Turn, Turn, Entry]:
    """Return two turns about parallel axes and a slide that is not at right angles to them."""
    one, two, three = lines
    height = dot(one.direction, minus(target, point))
    slide = product(1.0 / float(dot(one.direction, three.direction)), height)
    first, second = parallel_pair(one, two, advance(point, slide, three.direction), target, watch)
    return first, second, slide


def ball(
    lines: Sequence[ScrewAxis],
    center: Floats,
    point: VectorEntries,
    target: VectorEntries,
    watch: DegeneracyFlags,
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


def _lengths(square: Array, watch: DegeneracyFlags) -> Array:
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


PositionSolver = Callable[[VectorEntries, VectorEntries, DegeneracyFlags], Sequence[Value]]
StructureMatch = tuple[str, tuple[Choice, ...], PositionSolver]


@frozen
class PositioningStructure:
    """Three joints that bring a point to a place.

    Attributes:
        name: As "elbow".
        choices: In the order of their axes.
        reach: (point at zero, target, watch) -> the three values: turns of length 1, or slides.
        lines: The three joints.
    """

    name: str
    choices: tuple[Choice, ...]
    reach: PositionSolver
    lines: tuple[ScrewAxis, ...]


def positioning_structure(arm: AxisGeometry) -> PositioningStructure | None:
    """Return how the first three joints of an arm reach a point; None where no row of the table fits."""
    lines = arm.lines[:3]
    for order, ordered in _orders(lines):
        for backwards in (False, True):
            chain = tuple(line.opposite for line in reversed(ordered)) if backwards else ordered
            given = not backwards and order == (0, 1, 2)
            found = _match(chain, arm.length, arm.forward if given else None)
            if found is not None:
                name, choices, reach = found
                return PositioningStructure(name, choices, partial(_restored, reach, order, backwards), lines)
    return None


def _restored(
    reach: PositionSolver,
    order: tuple[int, ...],
    backwards: bool,
    point: VectorEntries,
    target: VectorEntries,
    watch: DegeneracyFlags,
) -> list[Value]:
    values = list(reach(target, point, watch))[::-1] if backwards else reach(point, target, watch)
    result: list[Value] = [0.0, 0.0, 0.0]
    for place, value in zip(order, values, strict=True):
        result[place] = value
    return result


def _orders(lines: Sequence[ScrewAxis]) -> Iterator[tuple[tuple[int, ...], tuple[ScrewAxis, ...]]]:
    yield (0, 1, 2), tuple(lines)
    for order, (i, j) in (((1, 0, 2), (0, 1)), ((0, 2, 1), (1, 2))):
        if lines[i].prismatic != lines[j].prismatic and parallel(lines[i], lines[j]):
            yield order, tuple(lines[k] for k in order)


def _match(lines: tuple[ScrewAxis, ...], length: float, forward: Floats | None) -> StructureMatch | None:
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


def _match_turns(
    lines: tuple[ScrewAxis, ...], length: float, forward: Floats | None
) -> StructureMatch | None:
    one, two, three = lines
    if is_elbow(lines):
        ahead = forward or ahead_of(one, two)
        return "elbow", ("shoulder", "elbow"), partial(elbow, lines, forward=ahead)
    center = meeting_point(one, two, length)
    if center is not None and not parallel(two, three):
        return "two axes that meet", ("elbow", "shoulder"), partial(ball, lines, center)
    return None


def _match_turns_and_slide(
    lines: tuple[ScrewAxis, ...], length: float, forward: Floats | None
) -> StructureMatch | None:
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


@frozen
class Positioning:
    """The solver of one arm."""

    base: PositioningStructure
    tip: Floats

    def __call__(self, goal: Displacement, watch: DegeneracyFlags) -> Sequence[Value]:
        """Return the joints, with the choices of the base."""
        return self.base.reach(self.tip, goal.point(self.tip), watch)


def match(arm: AxisGeometry) -> IkMethod | None:
    """Return the method where the arm has three joints that `bases` knows."""
    base = positioning_structure(arm) if len(arm.lines) == 3 else None
    if base is None:
        return None
    tip = (float(arm.home[0, 3]), float(arm.home[1, 3]), float(arm.home[2, 3]))
    name = f"{base.name} ({arm.kinds})"
    reason = f"three joints ({arm.kinds}) that place the tcp: {base.name}"
    return IkMethod(name, "positioning", base.choices, reason, Positioning(base, tip), "position")
