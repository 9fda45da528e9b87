"""Laws that every curve by arc length must keep, stated by differences of its values: shared by the tests."""

from __future__ import annotations

import itertools

import numpy as np
from scipy.spatial.transform import Rotation

_BESIDE = 1e-10  # m


def pieces(curve):
    """Return the ends of the smooth pieces of a curve."""
    edges = np.concatenate([[0.0], curve.breaks, [curve.length]])
    assert (np.diff(edges) > 0).all()
    return list(itertools.pairwise(edges))


def slope(values, s, step):
    """Return the derivative by differences of fourth order."""
    near, far = values(s + step) - values(s - step), values(s + 2 * step) - values(s - 2 * step)
    return (8 * near - far) / (12 * step)


def turning(rotations, s, step):
    """Return the rate of rotation, in world axes, by differences of fourth order of rotation vectors."""
    here = rotations(s)

    def vector(shift):
        return Rotation.from_matrix(rotations(s + shift) @ np.swapaxes(here, -1, -2)).as_rotvec()

    near, far = vector(step) - vector(-step), vector(2 * step) - vector(-2 * step)
    return (8 * near - far) / (12 * step)


def interior(low, high, count=9):
    step = 2e-3 * (high - low)
    return np.linspace(low + 3 * step, high - 3 * step, count), step


def keeps_the_laws_of_a_place(curve, scale=1.0, tolerance=1e-7):
    """Assert |p'| = 1, that p' and p'' are derivatives, and that a whole evaluation is that of its pieces."""
    _, first, second = curve.evaluate(np.linspace(0, curve.length, 101))
    np.testing.assert_allclose(np.linalg.norm(first, axis=-1), 1, rtol=0, atol=1e-13)
    np.testing.assert_allclose(np.einsum("ni,ni->n", first, second) * scale, 0, rtol=0, atol=1e-10)
    for low, high in pieces(curve):
        s, step = interior(low, high)
        place, first, second = curve.evaluate(s)
        np.testing.assert_allclose(
            slope(lambda x: curve.evaluate(x)[0], s, step), first, rtol=0, atol=tolerance
        )
        bend = slope(lambda x: curve.evaluate(x)[1], s, step)
        size = max(1.0, np.abs(second).max())
        np.testing.assert_allclose(bend, second, rtol=0, atol=tolerance * size)
        for side in ("left", "right"):
            np.testing.assert_array_equal(curve.evaluate(s, side)[0], place)


def keeps_the_laws_of_a_rotation(evaluate, curve, tolerance=1e-7):
    """Assert that what `evaluate` returns are rotations, their rate and its derivative."""
    for low, high in pieces(curve):
        s, step = interior(low, high)
        rotation, rate, change = evaluate(s)
        np.testing.assert_allclose(
            rotation @ np.swapaxes(rotation, -1, -2), np.tile(np.eye(3), (s.size, 1, 1)), rtol=0, atol=1e-13
        )
        np.testing.assert_allclose(np.linalg.det(rotation), 1, rtol=0, atol=1e-13)
        size = max(1.0, np.abs(rate).max())
        np.testing.assert_allclose(
            turning(lambda x: evaluate(x)[0], s, step), rate, rtol=0, atol=tolerance * size
        )
        size = max(1.0, np.abs(change).max())
        np.testing.assert_allclose(
            slope(lambda x: evaluate(x)[1], s, step), change, rtol=0, atol=tolerance * size
        )


def attitude_is_kept(curve, tolerance=1e-10):
    """Assert that the transport begins with no rotation and carries the first direction along."""
    s = np.linspace(0, curve.length, 101)
    rotation, rate, _ = curve.transport(s)
    _, first, second = curve.evaluate(s)
    np.testing.assert_allclose(rotation[0], np.eye(3), rtol=0, atol=1e-14)
    np.testing.assert_allclose(rotation @ first[0], first, rtol=0, atol=tolerance)
    np.testing.assert_allclose(
        np.cross(rate, first), second, rtol=0, atol=tolerance * max(1, np.abs(second).max())
    )


def sides(evaluate, places):
    """Return the values on the left and on the right of places."""
    return evaluate(np.asarray(places), "left"), evaluate(np.asarray(places), "right")


def continuous(evaluate, places, orders=3, tolerance=1e-9, beside=1e-5):
    """Assert that the first `orders` of what `evaluate` returns do not jump: on the sides, and beside."""
    places = np.asarray(places)
    near = evaluate(places - _BESIDE, "right"), evaluate(places + _BESIDE, "left")
    for (left, right), allowed in ((sides(evaluate, places), tolerance), (near, beside)):
        for before, after in zip(left[:orders], right[:orders], strict=True):
            size = max(1.0, np.abs(before).max(initial=0.0))
            np.testing.assert_allclose(before, after, rtol=0, atol=allowed * size)
