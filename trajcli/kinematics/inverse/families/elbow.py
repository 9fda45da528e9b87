"""Elbow arm and the pair of parallel axes in it.

The pair: R2 (l + R3 v) = w with l from axis 2 to axis 3, v from axis 3 to the point (beyond the elbow), all
at right angles to the axes. Lengths give l . R3 v = (|w|^2 - |l|^2 - |v|^2) / 2 = x, two solutions for the
third angle, mirror images of each other in the line of w. Along l and across it l + R3 v is then
(|l|^2 + x, +-y) / |l|, and the second angle leads from there to the direction of w.

The elbow arm (axes 2 and 3 parallel, axis 1 not): turns about axes 2 and 3 do not change the component along
them, so that h2 . R1^-1 t = h2 . p holds with the shoulder's offset and a1 in it. It has two solutions for
the first angle, the shoulder facing the target or turned away from it; with the pair's two there are four.

"Left" faces the side where axis 2 lies, seen from axis 1; where they meet, that of the first link's x axis.
"Up" has the elbow above the line from shoulder to point, along axis 1: it is the higher one.

Source: Siciliano et al. (2009), section 2.12.4, here without assuming right angles or lengths.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from trajcli.kinematics.columns import (
    VectorEntries,
    difference,
    dot,
    minus,
    plus,
    product,
    total,
)
from trajcli.kinematics.inverse.families.screw_axes import Floats, ScrewAxis, across_floats, parallel
from trajcli.kinematics.inverse.families.subproblems import (
    DegeneracyFlags,
    Turn,
    across,
    levels,
    onto,
    turned_back,
    unit,
)


def same_direction(a: ScrewAxis, b: ScrewAxis) -> float:
    """Return 1 or -1 for parallel axes of the same or the opposite direction."""
    return float(np.sign(dot(a.direction, b.direction)))


def parallel_pair(
    two: ScrewAxis,
    three: ScrewAxis,
    point: VectorEntries,
    aim: VectorEntries,
    flags: DegeneracyFlags,
    up: Floats | None = None,
) -> tuple[Turn, Turn]:
    """Return the turns about two parallel axes that bring `point` to `aim`, both (2, ..., B).

    The first solution has the elbow on the side of h2 x w if `up` is None, with h2 as the table draws it,
    else on the side where w . up counts it as up: up is axis 1, taken upward, x axis 2.
    """
    axis = two.direction
    link = across(minus(three.point, two.point), axis)
    beyond_elbow = across(minus(point, three.point), axis)
    to_aim = across(minus(aim, two.point), axis)
    level = product(
        0.5, difference(difference(dot(to_aim, to_aim), dot(beyond_elbow, beyond_elbow)), dot(link, link))
    )
    same = same_direction(two, three)
    sign = -same * two.sign if up is None else product(-same, dot(to_aim, up))
    third, (x, y) = levels(three.direction, beyond_elbow, link, level, flags, flags.length**2, sign)
    square = float(dot(link, link))
    scale = flags.length * float(np.sqrt(square))
    along, aside = unit((total(square, x), product(same, y)), flags, scale)
    cosine, sine = unit(onto(axis, link, to_aim), flags, scale)
    middle = product(cosine, along), product(sine, along)
    apart = product(sine, aside), product(difference(0.0, cosine), aside)
    return flags.fork_last(middle, apart), third


def shoulder_turn(
    one: ScrewAxis,
    normal: VectorEntries,
    point: VectorEntries,
    target: VectorEntries,
    flags: DegeneracyFlags,
    sign: float,
) -> Turn:
    """Return the turns (2, ..., B) about axis 1 that give normal . R1^-1 (t - o) the value of the point."""
    level = dot(normal, minus(point, one.point))
    direction = one.opposite.direction
    return levels(direction, minus(target, one.point), normal, level, flags, flags.length, sign)[0]


def before_turn(one: ScrewAxis, target: VectorEntries, turn: Turn) -> VectorEntries:
    """Return where a point was before the turn about an axis."""
    return plus(turned_back(minus(target, one.point), one.direction, turn), one.point)


def forward_sign(one: ScrewAxis, two: ScrewAxis, forward: Floats) -> float:
    """Return the sign with which the first solution of `shoulder_turn` faces `forward`."""
    return float(np.copysign(1.0, dot(forward, across_floats(two.direction, one.direction))))


def elbow(
    axes: Sequence[ScrewAxis],
    point: VectorEntries,
    target: VectorEntries,
    flags: DegeneracyFlags,
    forward: Floats,
    upward: Floats,
) -> tuple[Turn, Turn, Turn]:
    """Return the turns that bring `point` (at zero) to `target`: choices shoulder, then elbow."""
    one, two, three = axes
    first = shoulder_turn(one, two.direction, point, target, flags, forward_sign(one, two, forward))
    up = across_floats(upward, two.direction)
    second, third = parallel_pair(two, three, point, before_turn(one, target, first), flags, up)
    return first, second, third


def is_elbow(axes: Sequence[ScrewAxis]) -> bool:
    """Return whether `elbow` fits."""
    return parallel(axes[1], axes[2]) and not parallel(axes[0], axes[1])
