"""Vectors in space for many configurations at once: three entries, each an array over the configurations.

An entry that is the same for all of them is a plain number. The zeros and ones of an arm's geometry (right
angles between axes, a base at the origin) then cost nothing, and entries that must vanish are exactly zero.
"""

from __future__ import annotations

import numpy as np

from trajcli.curves.piecewise import Array

Entry = float | Array
VectorEntries = tuple[Entry, Entry, Entry]
ZERO: VectorEntries = (0.0, 0.0, 0.0)


def product(a: Entry, b: Entry) -> Entry:
    """Return a * b; nothing is computed for a number 0 or 1."""
    if isinstance(b, float):
        a, b = b, a
    if isinstance(a, float):
        if a == 0.0:
            return 0.0
        if a == 1.0:
            return b
        if a == -1.0:
            return -b
    return a * b


def total(a: Entry, b: Entry) -> Entry:
    """Return a + b; nothing is computed for a number 0."""
    if isinstance(a, float) and a == 0.0:
        return b
    return a if isinstance(b, float) and b == 0.0 else a + b


def difference(a: Entry, b: Entry) -> Entry:
    """Return a - b; nothing is computed for a number 0, nor when both are the same array."""
    if a is b:
        return 0.0
    if isinstance(b, float) and b == 0.0:
        return a
    return -b if isinstance(a, float) and a == 0.0 else a - b


def plus_product(p: Entry, a: Entry, b: Entry) -> Entry:
    """Return p + a b, written over the product where that is a new array: half the time of another one."""
    step = product(a, b)
    if step is a or step is b or isinstance(step, float) or isinstance(p, float):
        return total(p, step)
    if step.shape[-p.ndim :] != p.shape:
        return p + step
    step += p
    return step


def minus_product(p: Entry, a: Entry, b: Entry) -> Entry:
    """Return p - a b, likewise."""
    step = product(a, b)
    if step is a or step is b or isinstance(step, float) or isinstance(p, float):
        return difference(p, step)
    if step.shape[-p.ndim :] != p.shape:
        return p - step
    np.subtract(p, step, out=step)
    return step


def combine(c: Entry, x: VectorEntries, s: Entry, y: VectorEntries) -> VectorEntries:
    """Return c x + s y."""
    return advance(scaled(c, x), s, y)


def uncombine(c: Entry, x: VectorEntries, s: Entry, y: VectorEntries) -> VectorEntries:
    """Return c x - s y."""
    first, second, third = scaled(c, x)
    return minus_product(first, s, y[0]), minus_product(second, s, y[1]), minus_product(third, s, y[2])


def advance(p: VectorEntries, distance: Entry, axis: VectorEntries) -> VectorEntries:
    """Return p + distance * axis."""
    if p is ZERO or axis is ZERO or (isinstance(distance, float) and distance in (0.0, 1.0)):
        return plus(p, scaled(distance, axis))
    return (
        plus_product(p[0], distance, axis[0]),
        plus_product(p[1], distance, axis[1]),
        plus_product(p[2], distance, axis[2]),
    )


def plus(a: VectorEntries, b: VectorEntries) -> VectorEntries:
    """Return a + b."""
    if a is ZERO or b is ZERO:
        return b if a is ZERO else a
    return total(a[0], b[0]), total(a[1], b[1]), total(a[2], b[2])


def minus(a: VectorEntries, b: VectorEntries) -> VectorEntries:
    """Return a - b."""
    if b is ZERO:
        return a
    return difference(a[0], b[0]), difference(a[1], b[1]), difference(a[2], b[2])


def scaled(factor: Entry, a: VectorEntries) -> VectorEntries:
    """Return factor * a."""
    if isinstance(factor, float) and factor in (0.0, 1.0):
        return a if factor else ZERO
    return product(factor, a[0]), product(factor, a[1]), product(factor, a[2])


def dot(a: VectorEntries, b: VectorEntries) -> Entry:
    """Return the scalar product."""
    return plus_product(plus_product(product(a[0], b[0]), a[1], b[1]), a[2], b[2])


def cross(a: VectorEntries, b: VectorEntries) -> VectorEntries:
    """Return the vector product."""
    return (
        minus_product(product(a[1], b[2]), a[2], b[1]),
        minus_product(product(a[2], b[0]), a[0], b[2]),
        minus_product(product(a[0], b[1]), a[1], b[0]),
    )
