"""How much of every limit a motion uses, by code that shares nothing with planners and checks.

Poses are products of 4 x 4 matrices of Taylor series in time, cut off behind the third derivative; the efforts are
those of d'Alembert's principle in the frame of the base. The largest values are looked for on a grid of each piece
and around the best places of it.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np
from independent_judge import KINDS, extremes

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.kinematics.robot import Robot

ORDERS = 4
GRID, ZOOMS, FINER = 24, 3, 17
TOOL = ("speed", "acceleration", "jerk", "angular_speed", "angular_acceleration", "angular_jerk")
Series = np.ndarray  # (orders, N, ...): Taylor coefficients at N times


def product(one: Series, other: Series) -> Series:
    return np.array([sum(one[m] @ other[k - m] for m in range(k + 1)) for k in range(len(one))])


def circle(angle: Series) -> Series:
    """Return the series of exp(i f), by its differential equation."""
    result = np.zeros(angle.shape, dtype=complex)
    result[0] = np.exp(1j * angle[0])
    for k in range(1, len(angle)):
        result[k] = 1j * sum(m * angle[m] * result[k - m] for m in range(1, k + 1)) / k
    return result


def fixed(matrix: np.ndarray, like: Series) -> Series:
    result = np.zeros((*like.shape[:2], 4, 4))
    result[0] = matrix
    return result


def about(axis: int, angle: Series) -> Series:
    turned, result = circle(angle), fixed(np.eye(4), angle)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    result[..., i, i] = result[..., j, j] = turned.real
    result[..., j, i], result[..., i, j] = turned.imag, -turned.imag
    return result


def along(axis: int, distance: Series) -> Series:
    result = fixed(np.eye(4), distance)
    result[..., axis, 3] += distance
    return result


def poses(robot: Robot, q: Series) -> tuple[list[Series], list[Series]]:
    """Return the pose of each joint's axis and of the frame behind it, of joints q (orders, N, n)."""
    one = np.zeros(q.shape[:2])
    one[0] = 1.0
    pose, axes, frames = fixed(robot.base, one), [], []
    for i, joint in enumerate(robot.joints):
        own, slides = joint.sign * q[..., i], joint.type == "prismatic"
        screw = [along(0, joint.a * one), about(0, joint.alpha * one), about(1, joint.beta * one)]
        axial = [
            about(2, joint.theta * one + (0 if slides else own)),
            along(2, joint.d * one + (own if slides else 0)),
        ]
        for step in screw if robot.convention == "modified" else []:
            pose = product(pose, step)
        axes.append(pose)
        for step in axial if robot.convention == "modified" else axial + screw:
            pose = product(pose, step)
        frames.append(pose)
    return axes, frames


def angular_velocity(pose: Series) -> Series:
    """Return the series of w (orders - 1, N, 3)."""
    rotation = pose[..., :3, :3]
    change = rotation[1:] * np.arange(1, len(pose))[:, None, None, None]
    spin = product(change, np.swapaxes(rotation[:-1], -1, -2))
    return np.stack([spin[..., 2, 1], spin[..., 0, 2], spin[..., 1, 0]], axis=-1)


def tool_rates(robot: Robot, q: Series) -> np.ndarray:
    """Return the magnitudes of the six rates of the tool, (N, 6)."""
    pose = product(poses(robot, q)[1][-1], fixed(robot.tool, q))
    position, w = pose[..., :3, 3], angular_velocity(pose)
    vectors = [position[1], 2 * position[2], 6 * position[3], w[0], w[1], 2 * w[2]]
    return np.stack([np.linalg.norm(vector, axis=-1) for vector in vectors], axis=-1)


def efforts(robot: Robot, q: Series) -> np.ndarray:
    """Return torques and forces (N, n); a joint that rests at the very time has no Coulomb friction."""
    axes, frames = poses(robot, q)
    solids = []
    for i, joint in enumerate(robot.joints):
        if joint.link is not None:
            xx, yy, zz, xy, xz, yz = joint.link.inertia
            tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            solids.append((i, joint.link.mass, np.array(joint.link.com), tensor, frames[i]))
    if robot.payload is not None:
        carried = robot.payload
        tool = product(frames[-1], fixed(robot.tool, q))
        solids.append((len(frames) - 1, carried.mass, carried.com, carried.inertia, tool))
    result = np.zeros(q.shape[1:])
    for owner, mass, com, tensor, frame in solids:
        center, rotation, w = (
            frame[..., :3, :] @ np.append(com, 1.0),
            frame[..., :3, :3],
            angular_velocity(frame),
        )
        force = mass * (2 * center[2] - robot.gravity)
        inertia = np.zeros_like(rotation)
        inertia[0] = tensor
        inertia = product(product(rotation, inertia), np.swapaxes(rotation, -1, -2))
        moment = (inertia[1] @ w[0][..., None] + inertia[0] @ w[1][..., None])[..., 0]
        for j in range(owner + 1):
            z, origin = axes[j][0, :, :3, 2], axes[j][0, :, :3, 3]
            turning = moment + np.cross(center[0] - origin, force)
            part = force if robot.joints[j].type == "prismatic" else turning
            result[:, j] += robot.joints[j].sign * (z * part).sum(axis=-1)
    for j, joint in enumerate(robot.joints):
        rubbing = joint.friction.coulomb * np.sign(q[1, :, j]) + joint.friction.viscous * q[1, :, j]
        result[:, j] += 2 * joint.rotor * q[2, :, j] + rubbing
    return result


def series_of(curve: PiecewisePolynomial, piece: np.ndarray, time: np.ndarray) -> Series:
    """Return the Taylor coefficients of q at times (N,) from the starts of pieces (N,)."""
    coefficients = curve.coefficients[::-1, piece]
    result = np.zeros((ORDERS, len(piece), curve.dimension))
    for k in range(ORDERS):
        for power in range(len(coefficients) - 1, k - 1, -1):
            binomial = float(np.prod([(power - m) / (m + 1) for m in range(k)]))
            result[k] = result[k] * time[:, None] + binomial * coefficients[power]
    return result


def largest(curve: PiecewisePolynomial, values: Callable[[Series], np.ndarray]) -> np.ndarray:
    """Return the largest values (m,) of functions (N, m) of the motion, over its curve."""
    pieces = np.flatnonzero(curve.lengths > 0)
    piece = np.repeat(pieces, GRID)
    share = np.tile(np.linspace(0, 1, GRID), len(pieces))
    found = values(series_of(curve, piece, share * curve.lengths[piece]))
    best, half = found.max(axis=0), 1 / (GRID - 1)
    places = found.argmax(axis=0)
    center, of_piece = share[places], piece[places]
    for _ in range(ZOOMS):
        near = np.clip(center[:, None] + half * np.linspace(-1, 1, FINER), 0, 1)
        rows = np.repeat(of_piece, FINER)
        looked = values(series_of(curve, rows, near.ravel() * curve.lengths[rows]))
        own = looked.reshape(len(center), FINER, -1)[np.arange(len(center)), :, np.arange(len(center))]
        best = np.maximum(best, own.max(axis=1))
        center = near[np.arange(len(center)), own.argmax(axis=1)]
        half /= (FINER - 1) / 2
    return best


def shares(curve: PiecewisePolynomial, robot: Robot) -> dict[str, float]:
    """Return the largest share of each kind of limit that a curve uses: above 1 where it breaks one."""
    result: dict[str, float] = {}
    for order, kind in enumerate(KINDS):
        low, high = extremes(curve, order)
        lower, upper = robot.limits.of_order(order).T
        result[kind] = float(
            1 + np.fmax(high - upper, lower - low).max()
            if order == 0
            else np.fmax(high / upper, low / lower).max()
        )
    bounds = np.array([getattr(robot.limits.tcp, key, np.inf) for key in TOOL])
    if np.isfinite(bounds).any():
        used = largest(curve, partial(tool_rates, robot)) / bounds
        result |= {f"tool_{key}": float(share) for key, share in zip(TOOL, used, strict=True)}
    if np.isfinite(robot.limits.effort).any():
        lower, upper = robot.limits.effort.T
        result["effort"] = float(largest(curve, lambda q: both(efforts(robot, q), lower, upper)).max())
    return result


def both(values: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return the shares of limits in both directions, (N, 2 n)."""
    return np.concatenate([values / upper, values / lower], axis=1)
