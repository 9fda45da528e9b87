"""Subproblems of closed forms: rotations of a vector about one axis, or two, with given results.

Angles are carried as pairs (cosine, sine) until the end, so that no accuracy is lost near 0 and pi and no
trigonometric function is called. Where a subproblem has two solutions they come along a new first axis of
length two; everything after it broadcasts. An aim out of reach is replaced by the nearest one that can be
reached: forward kinematics then says by how much the target is missed.

Source: Paden, Kinematics and Control of Robot Manipulators (1986); Murray, Li and Sastry (1994), section
3.3.2.
"""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.frozen import frozen
from trajcli.geometry.rotation import Flags
from trajcli.kinematics.columns import (
    Entry,
    VectorEntries,
    combine,
    cross,
    difference,
    dot,
    minus,
    minus_product,
    plus,
    plus_product,
    product,
    scaled,
)
from trajcli.kinematics.inverse.families.screw_axes import PARALLEL, Floats, across_floats

Turn = tuple[Entry, Entry]
FREE = 1e-8  # of the length in question: closer to its axis a point does not determine its angle
TANGENT = 1e-6  # rad, within which two solutions are one: the square root of rounding, with a margin


@frozen
class Mirrored:
    """Turns of two solutions half a turn apart: of a choice whose second solution mirrors the first.

    Attributes:
        turn: The turns of the first solution, of length 1, with axes for the choices before.
    """

    turn: tuple[Array, Array]

    def write(self, out: Array) -> None:
        """Write both solutions' angles into (2, ..., B)."""
        half_turn_more(angle(self.turn, out[0]), out[1])

    def both(self) -> Turn:
        """Return both solutions as turns (2, ..., B)."""
        cosine, sine = self.turn
        return np.stack([cosine, -cosine]), np.stack([sine, -sine])


@frozen
class Opposed:
    """Turns of two solutions by the same angle in opposite directions.

    Attributes:
        turn: The turns of the first solution, of length 1, with axes for the choices before.
    """

    turn: tuple[Array, Array]

    def write(self, out: Array) -> None:
        """Write both solutions' angles into (2, ..., B)."""
        np.negative(angle(self.turn, out[0]), out=out[1])

    def both(self) -> Turn:
        """Return both solutions as turns (2, ..., B)."""
        cosine, sine = self.turn
        return cosine[None], np.stack([sine, -sine])


Value = Turn | Entry | Mirrored | Opposed


class DegeneracyFlags:
    """Which poses of a block leave an angle free or have a double solution, and how many choices were made.

    Attributes:
        rows: Shape (B,), True where something was noted.
        length: The arm's length, m, that lengths are compared with.
        choices: How many choices were made so far: every value has at most that many axes before the poses,
            the last choice first.
    """

    def __init__(self, count: int, length: float) -> None:
        self.rows: Flags = np.zeros(count, dtype=bool)
        self.length = length
        self.choices = 0

    def both(self, value: Entry) -> Array:
        """Return plus and minus a value (..., B) along the new first axis of one more choice."""
        self.choices += 1
        return self._either(0.0, value)

    def fork(self, middle: Turn, aside: Turn) -> Turn:
        """Return middle + aside, and middle - aside, along the new first axis of one more choice."""
        self.choices += 1
        return self.fork_last(middle, aside)

    def fork_last(self, middle: Turn, aside: Turn) -> Turn:
        """Return middle + aside, and middle - aside, along the axis of the last choice."""
        return self._either(middle[0], aside[0]), self._either(middle[1], aside[1])

    def _either(self, middle: Entry, aside: Entry) -> Array:
        shape = np.broadcast(middle, aside).shape
        result = np.empty((2, *(1,) * (self.choices - len(shape)), *shape))
        np.add(middle, aside, out=result[0])
        np.subtract(middle, aside, out=result[1])
        return result

    def mirrored(self, turn: Turn) -> Mirrored:
        """Return a turn (..., B) as the first solution of the last choice, with axes for those before."""
        cosine, sine = (np.asarray(entry) for entry in turn)
        shapes = [(1,) * (self.choices - entry.ndim) + entry.shape for entry in (cosine, sine)]
        return Mirrored((cosine.reshape(shapes[0]), sine.reshape(shapes[1])))

    def note(self, where: Flags) -> None:
        """Note the poses of `where` (..., B)."""
        if where.any():
            self.rows |= where.reshape(-1, where.shape[-1]).any(axis=0)


def across(vector: VectorEntries, axis: Floats) -> VectorEntries:
    """Return the part of a vector at right angles to a unit axis."""
    for i in range(3):
        if abs(axis[i]) == 1.0:
            x, y, z = vector
            return (0.0, y, z) if i == 0 else (x, 0.0, z) if i == 1 else (x, y, 0.0)
    return minus(vector, scaled(dot(axis, vector), axis))


def along(vector: VectorEntries, axis: Floats) -> VectorEntries:
    """Return the part of a vector along a unit axis."""
    for i in range(3):
        if abs(axis[i]) == 1.0:
            x, y, z = vector
            return (x, 0.0, 0.0) if i == 0 else (0.0, y, 0.0) if i == 1 else (0.0, 0.0, z)
    return scaled(dot(axis, vector), axis)


def turned(vector: VectorEntries, axis: Floats, turn: Turn) -> VectorEntries:
    """Return a vector turned about a unit axis."""
    plane = _plane(axis)
    if plane is None:
        rotated = combine(turn[0], across(vector, axis), turn[1], cross(axis, vector))
        return plus(along(vector, axis), rotated)
    i, j = plane
    result = list(vector)
    result[i], result[j] = added((vector[i], vector[j]), turn)
    return result[0], result[1], result[2]


def turned_back(vector: VectorEntries, axis: Floats, turn: Turn) -> VectorEntries:
    """Return a vector turned about a unit axis the other way."""
    return turned(vector, (-axis[0], -axis[1], -axis[2]), turn)


def _plane(axis: Floats) -> tuple[int, int] | None:
    """Return the two coordinates that a turn about a coordinate axis mixes, first to second."""
    for i in range(3):
        if abs(axis[i]) == 1.0:
            j, k = (i + 1) % 3, (i + 2) % 3
            return (j, k) if axis[i] > 0.0 else (k, j)
    return None


def added(first: Turn, second: Turn, sign: float = 1.0) -> Turn:
    """Return the turn by the first angle plus `sign` (1 or -1) times the second."""
    (ca, sa), (cb, sb) = first, second
    if sign < 0.0:
        return plus_product(product(ca, cb), sa, sb), minus_product(product(sa, cb), ca, sb)
    return minus_product(product(ca, cb), sa, sb), plus_product(product(sa, cb), ca, sb)


def angle(turn: Turn, out: Array) -> Array:
    """Write the angles in [-pi, pi] of turns into `out` and return it; a sine of -0 counts as 0."""
    np.arctan2(np.add(turn[1], 0.0), turn[0], out=out)
    return out


def half_turn_more(angles: Array, out: Array) -> None:
    """Write angles in [-pi, pi] half a turn further, in the same range, into `out`."""
    np.subtract(angles, np.copysign(np.pi, angles), out=out)


def onto(axis: Floats, vector: VectorEntries, aim: VectorEntries) -> Turn:
    """Return the turn about `axis` that brings `vector` into the half-plane of `aim`; its length is not 1.

    One solution. Both vectors' parts along the axis do not matter; it is the nearest where they differ.
    """
    plane = _plane(axis)
    if plane is None:
        return dot(across(vector, axis), aim), dot(cross(axis, vector), aim)
    i, j = plane
    return added((aim[i], aim[j]), (vector[i], vector[j]), -1.0)


def unit(turn: Turn, flags: DegeneracyFlags, scale: float = 1.0) -> Turn:
    """Return a turn of length 1; where it has none (1e-8 `scale`) the angle is free, zero is taken."""
    return _divided(turn, length(turn), flags, scale)


def length(turn: Turn) -> Array:
    """Return the root of cosine^2 + sine^2."""
    square = np.asarray(plus_product(product(turn[0], turn[0]), turn[1], turn[1]))
    return np.asarray(np.sqrt(square, out=square if square.ndim else None))


def _divided(turn: Turn, size: Array, flags: DegeneracyFlags, scale: float = 1.0) -> Turn:
    free = np.asarray(size < FREE * scale)
    if free.any():
        flags.note(free)
        size = np.where(free, 1.0, size)
        return np.where(free, 1.0, turn[0] / size), np.where(free, 0.0, turn[1] / size)
    return turn[0] / size, turn[1] / size


def levels(
    axis: Floats,
    vector: VectorEntries,
    normal: VectorEntries,
    level: Entry,
    flags: DegeneracyFlags,
    scale: float = 1.0,
    sign: Entry = 1.0,
) -> tuple[Turn, Turn]:
    """Return the two turns about `axis` after which normal . vector is `level` (or comes nearest to it).

    normal . R(t) vector = A cos t + B sin t + C. With x = level - C and r^2 = A^2 + B^2 the solutions are
    cos t = (A x - B y) / r^2, sin t = (B x + A y) / r^2 for y = +-sqrt(r^2 - x^2).

    (x, y) of the first solution come second: where all is at right angles to the axis, they are the parts of
    R(t) vector along normal and axis x normal, times the length of normal.

    Args:
        axis: Unit vector.
        vector: What is turned.
        normal: What it is measured along.
        level: The aim.
        flags: Note where r vanishes (the angle is free) and where the solutions coincide.
        scale: The size that r is compared with.
        sign: Of y in the first solution, by pose if it is an array.
    """
    a, b = onto(axis, vector, normal)
    x = difference(level, product(dot(axis, vector), dot(axis, normal)))
    square = np.asarray(np.square(a) + np.square(b))
    remainder = np.asarray(minus_product(square, x, x))
    flags.note(np.abs(remainder) <= TANGENT**2 * square)
    out = remainder < 0.0
    if out.any():
        x = np.where(out, np.copysign(np.sqrt(square), x), x)
        remainder = np.where(out, 0.0, remainder)
    root = np.sqrt(remainder)
    y = product(sign, root) if isinstance(sign, float) else np.copysign(root, sign)
    free = square < (FREE * scale) ** 2
    some = bool(free.any())
    if some:
        square = np.where(free, 1.0, square)
        flags.note(np.asarray(free & np.ones_like(remainder, dtype=bool)))
    a, b = a / square, b / square
    cosine, sine = flags.fork((product(a, x), product(b, x)), (product(difference(0.0, b), y), product(a, y)))
    return (np.where(free, 1.0, cosine), np.where(free, 0.0, sine)) if some else (cosine, sine), (x, y)


def two_turns(
    first: Floats,
    second: Floats,
    vector: Floats,
    aim: VectorEntries,
    flags: DegeneracyFlags,
    sign: float = 1.0,
) -> tuple[Turn | Mirrored, Turn | Opposed]:
    """Return the turns about `first`, and those about `second` before, that bring `vector` to `aim`.

    Two solutions; all are unit vectors. In the first one `vector` stands on the positive side of the plane of
    both axes: sign * second . (first x vector) >= 0. Where the axes are at right angles, and the vector to
    the second one, the sine is found from the aim's distance to the first axis and keeps all its digits near
    0 and pi.
    """
    if not square_wrist(first, second, vector):
        turn, _ = levels(second, vector, first, dot(first, aim), flags, sign=sign)
        return unit(onto(first, turned(vector, second, turn), aim), flags, FREE), turn
    side = across_floats(second, first)
    turn = dot(side, aim), dot(second, aim)
    sine = length(turn)
    flags.choices += 1
    signed = (product(sign, turn[0]), product(sign, turn[1])) if sign < 0.0 else turn
    around = flags.mirrored(_divided(signed, sine, flags))
    bend = Opposed(flags.mirrored((dot(first, aim), sign * sine)).turn)
    if dot(vector, side) == 0.0 and dot(vector, first) == 1.0:
        return around, bend
    return around, added(bend.both(), (dot(vector, first), dot(vector, side)), -1.0)


def square_wrist(first: Floats, second: Floats, vector: Floats) -> bool:
    """Return whether `second` is at right angles to both others."""
    return max(abs(float(dot(first, second))), abs(float(dot(second, vector)))) <= PARALLEL
