"""The few problems of turning a vector about an axis that every closed form is made of.

Angles are carried as pairs (cosine, sine) until the end, so that no accuracy is lost near 0 and pi and no
trigonometric function is called. Where a problem has two answers they come along a new first axis of length
two; everything after it broadcasts. An aim out of reach is replaced by the nearest one that can be reached:
forward kinematics then says by how much the target is missed.

Source: Paden, Kinematics and Control of Robot Manipulators (1986); Murray, Li and Sastry, A Mathematical
Introduction to Robotic Manipulation (1994), section 3.3.2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.columns import (
    Column,
    Entry,
    combine,
    cross,
    difference,
    dot,
    minus,
    plus,
    product,
    scaled,
    total,
)
from trajcli.kinematics.inverse.lines import PARALLEL, Floats, across_floats

Turn = tuple[Entry, Entry]
FREE = 1e-8  # of the length at hand: closer to its axis a point does not tell its angle
TANGENT = 1e-6  # rad, within which two answers are one: the square root of rounding, and room


class Watch:
    """Notes in which poses of a block an angle is free, or two answers fall together.

    Attributes:
        rows: Shape (B,), True where something was noted.
        length: The arm's length, m, that lengths are compared with.
        choices: How many choices were met so far: every value has at most that many axes before the poses.
    """

    def __init__(self, count: int, length: float) -> None:
        self.rows: Flags = np.zeros(count, dtype=bool)
        self.length = length
        self.choices = 0

    def both(self, value: Entry) -> Array:
        """Return plus and minus a value (..., B) along the new first axis of one more choice."""
        self.choices += 1
        values = np.asarray(value)
        full = values.reshape((1,) * (self.choices - values.ndim) + values.shape)
        return np.stack([full, -full])

    def mirrored(self, turn: Turn) -> Mirrored:
        """Return a turn (..., B) as the first answer of the last choice, with axes for the choices before."""
        cosine, sine = np.broadcast_arrays(*turn)
        shape = (1,) * (self.choices - cosine.ndim) + cosine.shape
        return Mirrored((cosine.reshape(shape), sine.reshape(shape)))

    def note(self, where: Flags) -> None:
        """Note the poses of `where` (..., B)."""
        if where.any():
            self.rows |= where.reshape(-1, where.shape[-1]).any(axis=0)


def across(vector: Column, axis: Floats) -> Column:
    """Return the part of a vector at right angles to a unit axis."""
    for i in range(3):
        if abs(axis[i]) == 1.0:
            x, y, z = vector
            return (0.0, y, z) if i == 0 else (x, 0.0, z) if i == 1 else (x, y, 0.0)
    return minus(vector, scaled(dot(axis, vector), axis))


def along(vector: Column, axis: Floats) -> Column:
    """Return the part of a vector along a unit axis."""
    for i in range(3):
        if abs(axis[i]) == 1.0:
            x, y, z = vector
            return (x, 0.0, 0.0) if i == 0 else (0.0, y, 0.0) if i == 1 else (0.0, 0.0, z)
    return scaled(dot(axis, vector), axis)


def turned(vector: Column, axis: Floats, turn: Turn) -> Column:
    """Return a vector turned about a unit axis."""
    swung = combine(turn[0], across(vector, axis), turn[1], cross(axis, vector))
    return plus(along(vector, axis), swung)


def turned_back(vector: Column, axis: Floats, turn: Turn) -> Column:
    """Return a vector turned about a unit axis the other way."""
    return turned(vector, axis, (turn[0], difference(0.0, turn[1])))


def added(first: Turn, second: Turn, sign: float = 1.0) -> Turn:
    """Return the turn by the first angle plus `sign` (1 or -1) times the second."""
    (ca, sa), (cb, sb) = first, (second[0], product(sign, second[1]))
    return difference(product(ca, cb), product(sa, sb)), total(product(sa, cb), product(ca, sb))


def angle(turn: Turn) -> Array:
    """Return angles in [-pi, pi] of turns of length 1.

    tan(t / 2) = sin t / (1 + cos t), taken from the half turn where the cosine is negative, so that nothing
    cancels: two roundings from the arc tangent of both, in half its time.
    """
    cosine, sine = np.asarray(turn[0]), np.asarray(turn[1]) + 0.0
    half = np.arctan(sine / (1.0 + np.abs(cosine)))
    result: Array = half + half
    behind = cosine < 0.0
    np.subtract(np.copysign(np.pi, sine), result, out=result, where=behind)
    return result


def half_turn_more(angles: Array) -> Array:
    """Return angles in [-pi, pi] half a turn further, in the same range."""
    return np.asarray(angles - np.copysign(np.pi, angles))


def onto(axis: Floats, vector: Column, aim: Column) -> Turn:
    """Return the turn about `axis` that brings `vector` into the half-plane of `aim`; its length is not 1.

    One answer. Both vectors' parts along the axis do not matter; it is the nearest where they differ.
    """
    return dot(across(vector, axis), aim), dot(cross(axis, vector), aim)


def unit(turn: Turn, watch: Watch, scale: float = 1.0) -> Turn:
    """Return a turn of length 1; where it has none (1e-8 `scale`) the angle is free, zero is taken."""
    size = np.sqrt(np.square(turn[0]) + np.square(turn[1]))
    free = np.asarray(size < FREE * scale)
    if free.any():
        watch.note(free)
        cosine = np.where(free, 1.0, turn[0] / np.where(free, 1.0, size))
        return cosine, np.where(free, 0.0, turn[1] / np.where(free, 1.0, size))
    return turn[0] / size, turn[1] / size


def levels(
    axis: Floats,
    vector: Column,
    normal: Column,
    level: Entry,
    watch: Watch,
    scale: float = 1.0,
    sign: Entry = 1.0,
) -> Turn:
    """Return the two turns about `axis` after which normal . vector is `level` (or comes nearest to it).

    normal . R(t) vector = A cos t + B sin t + C. With x = level - C and r^2 = A^2 + B^2 the answers are
    cos t = (A x - B y) / r^2, sin t = (B x + A y) / r^2 for y = +-sqrt(r^2 - x^2).

    Args:
        axis: Unit vector.
        vector: What is turned.
        normal: What it is measured along.
        level: The aim.
        watch: Is told where r vanishes (the angle is free) and where the answers fall together.
        scale: The size that r is compared with.
        sign: Of y in the first answer, by pose if it is an array; then axis . (vector x normal) = -y there.
    """
    a, b = dot(across(vector, axis), normal), dot(cross(axis, vector), normal)
    x = difference(level, product(dot(axis, vector), dot(axis, normal)))
    square = np.square(a) + np.square(b)
    return _solved(a, b, x, np.asarray(square), np.asarray(square - np.square(x)), watch, (scale, sign))


def _solved(
    a: Entry, b: Entry, x: Entry, square: Array, rest: Array, watch: Watch, scale_sign: tuple[float, Entry]
) -> Turn:
    scale, sign = scale_sign
    watch.note(np.abs(rest) <= TANGENT**2 * square)
    out = rest < 0.0
    if out.any():
        x = np.where(out, np.copysign(np.sqrt(square), x), x)
        rest = np.where(out, 0.0, rest)
    y = watch.both(
        product(sign, np.sqrt(rest)) if isinstance(sign, float) else np.copysign(np.sqrt(rest), sign)
    )
    free = square < (FREE * scale) ** 2
    if free.any():
        square = np.where(free, 1.0, square)
        watch.note(np.asarray(free & np.ones_like(rest, dtype=bool)))
    cosine = (product(a, x) - product(b, y)) / square
    sine = (product(b, x) + product(a, y)) / square
    return (np.where(free, 1.0, cosine), np.where(free, 0.0, sine)) if free.any() else (cosine, sine)


@dataclass(frozen=True, eq=False)
class Mirrored:
    """Turns of two answers half a turn apart: of a choice whose second answer mirrors the first.

    Attributes:
        turn: The turns of the first answer, of length 1, with axes for the choices before.
    """

    turn: tuple[Array, Array]

    def angles(self) -> Array:
        """Return both answers' angles, shape (2, ..., B)."""
        one = angle(self.turn)
        return np.stack([one, half_turn_more(one)])

    def both(self) -> Turn:
        """Return both answers as turns (2, ..., B)."""
        cosine, sine = self.turn
        return np.stack([cosine, -cosine]), np.stack([sine, -sine])


@dataclass(frozen=True, eq=False)
class Opposed:
    """Turns of two answers by the same angle in opposite directions.

    Attributes:
        turn: The turns of the first answer, of length 1, with axes for the choices before.
    """

    turn: tuple[Array, Array]

    def angles(self) -> Array:
        """Return both answers' angles, shape (2, ..., B)."""
        one = angle(self.turn)
        return np.stack([one, -one])

    def both(self) -> Turn:
        """Return both answers as turns (2, ..., B)."""
        cosine, sine = self.turn
        return np.stack([cosine, cosine]), np.stack([sine, -sine])


def two_turns(
    first: Floats, second: Floats, vector: Floats, aim: Column, watch: Watch
) -> tuple[Turn | Mirrored, Turn | Opposed]:
    """Return the turns about `first`, and those about `second` before, that bring `vector` to `aim`.

    Two answers; all are unit vectors. In the first one `vector` stands on the positive side of the plane of
    both axes: second . (first x vector) >= 0. Where the axes are at right angles, and the vector to the
    second one, the sine is found from the aim's distance to the first axis and keeps all its digits near 0
    and pi.
    """
    if not square_wrist(first, second, vector):
        turn = levels(second, vector, first, dot(first, aim), watch)
        return unit(onto(first, turned(vector, second, turn), aim), watch), turn
    side = across_floats(second, first)
    away = across(aim, first)
    sine = np.sqrt(np.asarray(dot(away, away)))
    watch.choices += 1
    around = watch.mirrored(unit((dot(side, aim), dot(second, aim)), watch))
    bend = Opposed(watch.mirrored((dot(first, aim), sine)).turn)
    if dot(vector, side) == 0.0 and dot(vector, first) == 1.0:
        return around, bend
    return around, added(bend.both(), (dot(vector, first), dot(vector, side)), -1.0)


def square_wrist(first: Floats, second: Floats, vector: Floats) -> bool:
    """Return whether `second` is at right angles to both others."""
    return max(abs(float(dot(first, second))), abs(float(dot(second, vector)))) <= PARALLEL


Value = Turn | Entry | Mirrored | Opposed
