"""Every answer of a closed-form arm by other mathematics than the package's, for arms of the standard convention.

Unknown joints are eliminated until one is left. What it must satisfy is a polynomial of known degree in exp(i q), or
in q itself for a slide: its coefficients come from samples, its roots from the companion matrix. Forward kinematics
from products of exponentials then decides which candidates are answers. Nothing of `trajcli.kinematics` is used.

Source: Pieper, The kinematics of manipulators under computer control (1968); Tsai and Morgan, J. Mechanisms 107 (1985).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

NONE = 1e-9  # lengths, m, and sines below are zero: the arms' numbers have three digits
CLOSES = 1e-7  # m and rad: what a candidate may miss its target by
APART = 1e-5  # rad or m: nearer answers are one


@dataclass(frozen=True)
class Axis:
    slides: bool
    h: np.ndarray
    o: np.ndarray

    def turned(self, q, vectors):
        """Return vectors (..., 3) turned by q (...) about the direction."""
        c, s, along = np.cos(q)[..., None], np.sin(q)[..., None], (vectors @ self.h)[..., None]
        return c * vectors + s * np.cross(self.h, vectors) + (1 - c) * along * self.h

    def moved(self, q, points):
        if self.slides:
            return points + q[..., None] * self.h
        return self.o + self.turned(q, points - self.o)

    def matrix(self, q):
        result = np.tile(np.eye(4), (len(q), 1, 1))
        if not self.slides:
            result[:, :3, :3] = np.stack([self.turned(q, unit) for unit in np.eye(3)], axis=-1)
        result[:, :3, 3] = self.moved(q, np.zeros(3))
        return result

    def angle(self, before, after):
        """Return by how much vectors (..., 3) must turn about the direction."""
        along = (before @ self.h) * (after @ self.h)
        return np.arctan2(np.cross(before, after) @ self.h, (before * after).sum(axis=-1) - along)

    def value(self, before, after):
        """Return which joint value moves points (..., 3)."""
        return (after - before) @ self.h if self.slides else self.angle(before - self.o, after - self.o)

    @property
    def reversed(self):
        return Axis(self.slides, -self.h, self.o)


def arm_axes(robot):
    """Return the axes at zero, in the base, and the pose of the tcp at zero."""
    frame, axes = np.eye(4), []
    for joint in robot.joints:
        axes.append(Axis(joint.type == "prismatic", joint.sign * frame[:3, 2], frame[:3, 3]))
        c, s, ca, sa = np.cos(joint.theta), np.sin(joint.theta), np.cos(joint.alpha), np.sin(joint.alpha)
        rows = [[c, -s * ca, s * sa, joint.a * c], [s, c * ca, -c * sa, joint.a * s], [0, sa, ca, joint.d]]
        frame = frame @ np.array([*rows, [0, 0, 0, 1]])
    return axes, frame @ robot.tool


def displacement(axes, q):
    """Return the product of exponentials (K, 4, 4) of joint values (K, n)."""
    result = np.tile(np.eye(4), (len(q), 1, 1))
    for axis, values in zip(axes, q.T, strict=True):
        result = result @ axis.matrix(values)
    return result


def roots(coefficients):
    """Return the roots (K, m) of polynomials, coefficients (m + 1, K) of ascending order."""
    while len(coefficients) > 1 and np.abs(coefficients[-1]).max() <= NONE * np.abs(coefficients).max():
        coefficients = coefficients[:-1]
    degree = len(coefficients) - 1
    companion = np.zeros((coefficients.shape[1], degree, degree), dtype=coefficients.dtype)
    companion[:, 1:, :-1] = np.eye(max(degree - 1, 0))
    companion[:, :, -1:] = -(coefficients[:-1] / coefficients[-1]).T[..., None]
    return np.linalg.eigvals(companion)


def zeros(axis, function, degree):
    """Return the rows (M,) and the joint values (M,) at which a function vanishes.

    It takes values (S, 1) and gives (S, K): polynomials of the degree, for a turn in its cosine and sine.
    """
    if axis.slides:
        at = np.cos(np.pi * (np.arange(degree + 1) + 0.5) / (degree + 1))
        found = roots(np.linalg.solve(np.vander(at, increasing=True), function(at[:, None])))
        real, values = np.abs(found.imag) < 1e-3, found.real
    else:
        count = 2 * degree + 1
        at, orders = 0.3 + 2 * np.pi * np.arange(count) / count, np.arange(-degree, degree + 1)
        found = roots(np.exp(-1j * np.outer(orders, at)) @ function(at[:, None]) / count)
        real, values = np.abs(np.abs(found) - 1) < 1e-3, np.angle(found)
    rows, columns = np.nonzero(real)
    return rows, values[rows, columns]


def square(vectors):
    return (vectors * vectors).sum(axis=-1)


def position(axes, point, targets):
    """Return the rows (M,) and values (M, n) of candidates that bring a point (3,) to targets (K, 3)."""
    one, last = axes[0], axes[-1]
    if all(axis.slides for axis in axes):
        return np.arange(len(targets)), np.linalg.solve(
            np.array([axis.h for axis in axes]).T, (targets - point).T
        ).T
    if len(axes) == 2:
        far = square(targets - one.o)
        rows, q = zeros(last, lambda q: square(last.moved(q, point) - one.o) - far, 2 if last.slides else 1)
        second = np.empty((len(q), 0))
    elif axes[1].slides:
        rows, second, q = _after_a_slide(axes, point, targets)
    else:
        rows, second, q = _after_a_turn(axes, point, targets)
    reached = last.moved(q, np.broadcast_to(point, (len(q), 3)))
    if len(axes) == 3:
        reached = axes[1].moved(second[:, 0], reached)
    return rows, np.column_stack([one.value(reached, targets[rows]), second, q])


def _after_a_slide(axes, point, targets):
    """Candidates where joint 1 turns and joint 2 slides, not across it: its height gives the slide."""
    one, two, three = axes

    def slide(q, t):
        return (t - three.moved(q, point)) @ one.h / (two.h @ one.h)

    def miss(q):
        return square(two.moved(slide(q, targets), three.moved(q, point)) - one.o) - square(targets - one.o)

    rows, q = zeros(three, miss, 2)
    return rows, slide(q, targets[rows])[:, None], q


def _after_a_turn(axes, point, targets):
    """Candidates where joint 2 turns: what joint 1 leaves alone is linear in the cosine and sine of joint 2."""
    one, two, three = axes
    across = np.linalg.svd(one.h[None])[2][1:] if one.slides else np.array([one.h, 2 * (two.o - one.o)])

    def linear(q, t):
        x = three.moved(q, np.broadcast_to(point, (*q.shape, 3)))
        foot = two.o + ((x - two.o) @ two.h)[..., None] * two.h
        arm = x - foot
        left = np.stack([arm @ across.T, np.cross(two.h, arm) @ across.T], axis=-1)
        right = (t - foot) @ across.T
        if not one.slides:
            right[..., 1] = square(t - one.o) - square(foot - one.o) - square(arm)
        return left, right, square(arm)

    flat = across - np.outer(across @ two.h, two.h)
    if abs(np.cross(*flat) @ two.h) > NONE:
        return _both_levels(three, linear, targets)
    level = int(np.linalg.norm(flat[0]) <= NONE)  # the one that joint 2 changes
    factor = flat[1 - level] @ flat[level] / square(flat[level])
    degree = 2 if three.slides else 1
    rows, q = zeros(three, lambda q: linear(q, targets)[1] @ _other(level, factor), degree)
    left, right, _ = linear(q, targets[rows])
    cosine, sine = left[:, level].T
    with np.errstate(invalid="ignore"):
        half_angle = np.arccos(right[:, level] / np.hypot(cosine, sine))
    middle, keep = np.arctan2(sine, cosine), np.isfinite(half_angle)
    rows, q = rows[keep], q[keep]
    second = np.concatenate([(middle + half_angle)[keep], (middle - half_angle)[keep]])
    return np.tile(rows, 2), second[:, None], np.tile(q, 2)


def _other(level, factor):
    weights = np.ones(2)
    weights[level] = -factor
    return weights


def _both_levels(three, linear, targets):
    def solved(q, t):
        left, right, size = linear(q, t)
        cosine = right[..., 0] * left[..., 1, 1] - right[..., 1] * left[..., 0, 1]
        sine = left[..., 0, 0] * right[..., 1] - left[..., 1, 0] * right[..., 0]
        return cosine, sine, np.linalg.det(left), size

    def miss(q):
        cosine, sine, det, size = solved(q, targets)
        return (cosine**2 + sine**2 - det**2) / size  # the point is never on axis 2 where this is sampled

    rows, q = zeros(three, miss, 4 if three.slides else 2)
    cosine, sine, det, _ = solved(q, targets[rows])
    return rows, np.arctan2(sine / det, cosine / det)[:, None], q


def by_last_turn(axes, goals):
    """A point on the last axis is brought to its position by the joints before; the last one turns the tool."""
    last = axes[-1]
    rows, q = position(axes[:-1], last.o, (goals @ np.append(last.o, 1.0))[:, :3])
    rest = np.linalg.inv(displacement(axes[:-1], q)) @ goals[rows]
    side = np.cross(last.h, np.eye(3)[np.abs(last.h).argmin()])
    return rows, np.column_stack([q, last.angle(side, rest[:, :3, :3] @ side)])


def by_parallel_axes(axes, goals):
    """Axes 2, 3, 4 keep their direction h: joint 1 and the joints after 4 must agree on it."""
    one, h, (five, *six) = axes[0], axes[1].h, axes[4:]
    if six:
        w = meeting(axes[4:])
        target = (goals @ np.append(w, 1.0))[:, :3]
        rows, first = zeros(one, lambda q: (one.moved(-q, target) - w) @ h, 1)
        seen = np.einsum("kji,kj->ki", goals[rows, :3, :3], one.turned(first, h))
        more, fifth = zeros(five, lambda q: (five.turned(-q, h) - seen) @ six[0].h, 1)
        rows, first = rows[more], first[more]
        after = np.column_stack([fifth, -six[0].angle(five.turned(-fifth, h), seen[more])])
    else:
        rotations = goals[:, :3, :3]
        rows, fifth = zeros(
            five, lambda q: (five.turned(-q, h) * (one.h @ rotations)).sum(axis=-1) - one.h @ h, 1
        )
        after = fifth[:, None]
        first = one.angle(h, np.einsum("kij,kj->ki", rotations[rows], five.turned(-fifth, h)))
    rest = np.linalg.inv(one.matrix(first)) @ goals[rows] @ np.linalg.inv(displacement(axes[4:], after))
    inner, middle = by_last_turn(axes[1:4], rest)
    return rows[inner], np.column_stack([first[inner], middle, after[inner]])


def by_wrist(axes, goals):
    """The last three axes meet in a point that the first three joints bring to its position."""
    w = meeting(axes[3:])
    four, five, six = axes[3:]
    rows, q = position(axes[:3], w, (goals @ np.append(w, 1.0))[:, :3])
    rest = np.linalg.inv(displacement(axes[:3], q))[:, :3, :3] @ goals[rows, :3, :3]
    more, fifth = zeros(five, lambda q: (five.turned(q, six.h) - rest @ six.h) @ four.h, 1)
    rows, q, rest = rows[more], q[more], rest[more]
    fourth = four.angle(five.turned(fifth, six.h), rest @ six.h)
    side = np.cross(six.h, five.h)
    seen = five.turned(-fifth, four.turned(-fourth, rest @ side))
    return rows, np.column_stack([q, fourth, fifth, six.angle(side, seen)])


def by_shoulder(axes, goals):
    """The first three axes meet: the arm read from the tool to the base has a wrist."""
    rows, q = by_wrist([axis.reversed for axis in axes[::-1]], np.linalg.inv(goals))
    return rows, q[:, ::-1]


def meeting(axes):
    """Return the point (3,) nearest to lines."""
    squares = [np.eye(3) - np.outer(axis.h, axis.h) for axis in axes]
    return np.linalg.solve(sum(squares), sum(m @ axis.o for m, axis in zip(squares, axes, strict=True)))
