"""Positioning structures: three joints that bring a point to a position, alone or under a spherical wrist.

| joints | condition | solver | solutions |
|---|---|---|---|
| RRR | 2 parallel 3 | `elbow` | 4 |
| RRR | 1 meets 2 | `ball`: the distance from where they meet gives joint 3, then two turns | 4 |
| RRP | 3 at right angles to 2 | `stanford`: as the elbow; the length in its plane gives the slide | 4 |
| RRP | 1 meets 2 | `ball`: the distance gives the slide, then two turns | 4 |
| RRP | 1 parallel 2 | `scara`: the height gives the slide, then a pair of parallel turns | 2 |
| RPP | any | `cylindrical`: the normal of both slides gives joint 1, the rest is linear | 2 |
| PPP | independent | `cartesian`: linear | 1 |

Every row is also tried from the tool backwards (the inverse motion is that of the opposite axes), and with
neighbours exchanged where a slide runs along the axis of a turn beside it: such motions commute.

Every solver takes the three axes, a point p at zero and its target t, and returns the values of the joints,
turns as (cosine, sine). Two solutions come along a new first axis.

* `cartesian`: t - p = D q with the directions as columns of D.
* `cylindrical`: slides do not move a point along their common normal n, so n . R1^-1 t = n . p: two angles.
  "Left" is the solution with the last slide the further out.
* `stanford`: (d + b)^2 = |w|^2 - |p|^2 + b^2 in the plane, b = p . h3, for the slide d. "Up" is the longer
  slide.
* `ball`: axes 1 and 2 meet in o, so |joint 3 (p) - o| = |t - o|: two solutions, each with two for joints 1
  and 2.

An arm of three joints has the solutions of its structure; its orientation follows, and a target that fixes it
is met only if it agrees.

Source: Spong, Hutchinson and Vidyasagar, Robot Modeling and Control (2006), section 3.3; Pieper (1968).
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
    before_turn,
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

PositionSolver = Callable[[VectorEntries, VectorEntries, DegeneracyFlags], Sequence[Value]]
StructureMatch = tuple[str, tuple[Choice, ...], PositionSolver]
Sides = tuple[Floats, Floats] | None  # what is forward and what is upward, seen from the base
INDEPENDENT = 1e-6  # volume of three unit directions: below, an arm hardly moves in one direction


def cartesian(
    axes: Sequence[ScrewAxis], point: VectorEntries, target: VectorEntries, flags: DegeneracyFlags
) -> tuple[Entry, ...]:
    """Return the slides of three independent prismatic joints."""
    displacement = minus(target, point)
    return tuple(dot(row, displacement) for row in _rows([axis.direction for axis in axes]))


def cylindrical(
    axes: Sequence[ScrewAxis], point: VectorEntries, target: VectorEntries, flags: DegeneracyFlags
) -> tuple[Turn, Entry, Entry]:
    """Return a turn and two slides."""
    one, two, three = axes
    normal = across_floats(two.direction, three.direction)
    first = shoulder_turn(one, normal, point, target, flags, one.sign * two.sign * three.sign)
    displacement = minus(before_turn(one, target, first), point)
    rows = _rows([two.direction, three.direction, normal])
    return first, dot(rows[0], displacement), dot(rows[1], displacement)


def stanford(
    axes: Sequence[ScrewAxis],
    point: VectorEntries,
    target: VectorEntries,
    flags: DegeneracyFlags,
    forward: Floats,
) -> tuple[Turn, Turn, Entry]:
    """Return two turns and a slide at right angles to the second."""
    one, two, three = axes
    first = shoulder_turn(one, two.direction, point, target, flags, forward_sign(one, two, forward))
    second, slide = turn_and_slide(two, three, point, before_turn(one, target, first), flags)
    return first, second, slide


def turn_and_slide(
    turn: ScrewAxis, slide: ScrewAxis, point: VectorEntries, aim: VectorEntries, flags: DegeneracyFlags
) -> tuple[Turn, Array]:
    """Return the turns and slides (2, ..., B) in one plane that bring `point` to `aim`."""
    arm, to_aim = (
        across(minus(point, turn.point), turn.direction),
        across(minus(aim, turn.point), turn.direction),
    )
    ahead = dot(arm, slide.direction)
    square = _plus_square(difference(dot(to_aim, to_aim), dot(arm, arm)), ahead)
    distance = difference(_lengths(square, flags, slide.sign), ahead)
    reached = advance(arm, distance, slide.direction)
    return unit(onto(turn.direction, reached, to_aim), flags, FREE * flags.length**2), np.asarray(distance)


def scara(
    axes: Sequence[ScrewAxis], point: VectorEntries, target: VectorEntries, flags: DegeneracyFlags
) -> tuple[Turn, Turn, Entry]:
    """Return two turns about parallel axes and a slide that is not at right angles to them."""
    one, two, three = axes
    height = dot(one.direction, minus(target, point))
    slide = product(1.0 / float(dot(one.direction, three.direction)), height)
    first, second = parallel_pair(one, two, advance(point, slide, three.direction), target, flags)
    return first, second, slide


def ball(
    axes: Sequence[ScrewAxis],
    center: Floats,
    point: VectorEntries,
    target: VectorEntries,
    flags: DegeneracyFlags,
) -> tuple[Turn, Turn, Turn | Entry]:
    """Return two turns about axes that meet in `center` after a turn or slide of the third joint."""
    one, two, three = axes
    to_aim = minus(target, center)
    third: Turn | Entry
    if three.prismatic:
        arm = minus(point, center)
        ahead = dot(arm, three.direction)
        square = _plus_square(difference(dot(to_aim, to_aim), dot(arm, arm)), ahead)
        third = difference(_lengths(square, flags, three.sign), ahead)
        arm = advance(arm, third, three.direction)
    else:
        link, arm = minus(three.point, center), minus(point, three.point)
        level = product(0.5, difference(difference(dot(to_aim, to_aim), dot(arm, arm)), dot(link, link)))
        third, _ = levels(three.direction, arm, link, level, flags, flags.length**2, three.sign)
        arm = plus(link, turned(arm, three.direction, third))
    height, sign = dot(one.direction, to_aim), one.sign * two.sign
    second, _ = levels(two.direction, arm, one.direction, height, flags, flags.length, sign)
    first = onto(one.direction, turned(arm, two.direction, second), to_aim)
    return unit(first, flags, FREE * flags.length**2), second, third


def _plus_square(value: Entry, root: Entry) -> Array:
    return np.asarray(value + np.square(root))


def _lengths(square: Array, flags: DegeneracyFlags, sign: float) -> Array:
    """Return `sign` times the root, zero of a negative square, and the opposite, along a new first axis."""
    flags.note(np.abs(square) <= (TANGENT * flags.length) ** 2)
    return flags.both(sign * np.sqrt(np.maximum(square, 0.0)))


def _rows(columns: Sequence[Floats]) -> list[Floats]:
    """Return the rows of the inverse of the matrix with the given columns."""
    a, b, c = columns
    volume = float(dot(a, cross(b, c)))
    rows = []
    for u, v in ((b, c), (c, a), (a, b)):
        x, y, z = across_floats(u, v)
        rows.append((x / volume, y / volume, z / volume))
    return rows


@frozen
class PositioningStructure:
    """Three joints that bring a point to a position.

    Attributes:
        name: As "elbow".
        choices: In the order in which the solver makes them.
        solve: (point at zero, target, flags) -> the three values: turns of length 1, or slides.
        axes: The three joints.
    """

    name: str
    choices: tuple[Choice, ...]
    solve: PositionSolver
    axes: tuple[ScrewAxis, ...]


def positioning_structure(arm: AxisGeometry, *, from_base: bool = True) -> PositioningStructure | None:
    """Return the structure of the first three joints of an arm; None where no row of the table fits.

    Args:
        arm: The arm.
        from_base: Whether its first joint stands on the base; what is forward and upward has no meaning else.
    """
    axes = arm.axes[:3]
    for order, ordered in _orders(axes):
        for backwards in (False, True):
            chain = tuple(axis.opposite for axis in reversed(ordered)) if backwards else ordered
            given = from_base and not backwards and order == (0, 1, 2)
            matched = _match(chain, arm.length, (arm.forward, arm.upward) if given else None)
            if matched is not None:
                name, choices, solve = matched
                return PositioningStructure(name, choices, partial(_restored, solve, order, backwards), axes)
    return None


def _restored(
    solve: PositionSolver,
    order: tuple[int, ...],
    backwards: bool,
    point: VectorEntries,
    target: VectorEntries,
    flags: DegeneracyFlags,
) -> list[Value]:
    """Return the values in the order of the chain, of a solver that was matched in another order."""
    values = list(solve(target, point, flags))[::-1] if backwards else solve(point, target, flags)
    result: list[Value] = [0.0, 0.0, 0.0]
    for index, value in zip(order, values, strict=True):
        result[index] = value
    return result


def _orders(axes: Sequence[ScrewAxis]) -> Iterator[tuple[tuple[int, ...], tuple[ScrewAxis, ...]]]:
    """Yield the chain as it is, and with neighbours exchanged that commute."""
    yield (0, 1, 2), tuple(axes)
    for order, (i, j) in (((1, 0, 2), (0, 1)), ((0, 2, 1), (1, 2))):
        if axes[i].prismatic != axes[j].prismatic and parallel(axes[i], axes[j]):
            yield order, tuple(axes[k] for k in order)


def _match(axes: tuple[ScrewAxis, ...], length: float, sides: Sides) -> StructureMatch | None:
    kinds = "".join("P" if axis.prismatic else "R" for axis in axes)
    match kinds:
        case "RRR":
            return _match_turns(axes, length, sides)
        case "RRP":
            return _match_turns_and_slide(axes, length, sides)
        case "RPP":
            normal = np.cross(axes[1].direction, axes[2].direction)
            fits = np.linalg.norm(np.cross(normal, axes[0].direction)) > INDEPENDENT
            return ("cylindrical base", ("shoulder",), partial(cylindrical, axes)) if fits else None
        case "PPP":
            independent = abs(np.linalg.det([axis.direction for axis in axes])) > INDEPENDENT
            return ("Cartesian base", (), partial(cartesian, axes)) if independent else None
    return None


def _sides_of(one: ScrewAxis, two: ScrewAxis) -> tuple[Floats, Floats]:
    """Return what is forward and upward for arms that are read in another order."""
    return across_floats(two.drawn, one.drawn), one.drawn


def _match_turns(axes: tuple[ScrewAxis, ...], length: float, sides: Sides) -> StructureMatch | None:
    one, two, _ = axes
    if is_elbow(axes):
        ahead, upward = sides or _sides_of(one, two)
        return "elbow", ("shoulder", "elbow"), partial(elbow, axes, forward=ahead, upward=upward)
    center = meeting_point(one, two, length)
    if center is not None:
        return "two axes that meet", ("elbow", "shoulder"), partial(ball, axes, center)
    return None


def _match_turns_and_slide(axes: tuple[ScrewAxis, ...], length: float, sides: Sides) -> StructureMatch | None:
    one, two, three = axes
    if parallel(one, two):
        if perpendicular(one, three):
            return None
        return "SCARA base", ("elbow",), partial(scara, axes)
    if perpendicular(two, three):
        ahead, _ = sides or _sides_of(one, two)
        return "Stanford base", ("shoulder", "elbow"), partial(stanford, axes, forward=ahead)
    center = meeting_point(one, two, length)
    if center is None or parallel(two, three):
        return None
    return "Stanford base", ("elbow", "shoulder"), partial(ball, axes, center)


@frozen
class Positioning:
    """The solver of one arm."""

    structure: PositioningStructure
    tip: Floats

    def __call__(self, goal: Displacement, flags: DegeneracyFlags) -> Sequence[Value]:
        """Return the joints, with the choices of the structure."""
        return self.structure.solve(self.tip, goal.point(self.tip), flags)


def match(arm: AxisGeometry) -> IkMethod | None:
    """Return the method where the arm is a positioning structure by itself."""
    structure = positioning_structure(arm) if len(arm.axes) == 3 else None
    if structure is None:
        return None
    name = f"{structure.name} ({arm.kinds})"
    reason = f"three joints ({arm.kinds}) that place the tcp: {structure.name}"
    return IkMethod(
        name, "positioning", structure.choices, reason, Positioning(structure, arm.tip), "position"
    )
