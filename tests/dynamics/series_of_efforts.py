"""Taylor coefficients of efforts, by power series in the axes of the base: an oracle of bounds.

Poses are products of 4 x 4 matrices whose entries are power series in time; a cosine and a sine are the parts
of exp(i q), by its differential equation. Forces are masses times accelerations of centres of mass, moments
the derivatives of angular momenta. No recursion along the arm, no frame of a joint, no difference of values.
"""

from __future__ import annotations

import re
from math import comb

import numpy as np

from trajcli.dynamics.newton_euler import InverseDynamics


def shifted(coefficients: np.ndarray, t: float, count: int) -> np.ndarray:
    """Return Taylor coefficients (count, n) at t, lowest first, of polynomials (degree + 1, n), highest first."""
    rows = np.zeros((max(count, len(coefficients)), coefficients.shape[1]))
    for power, row in enumerate(coefficients[::-1]):
        for k in range(power + 1):
            rows[k] += comb(power, k) * t ** (power - k) * row
    return rows[:count]


def exponential(series: np.ndarray) -> np.ndarray:
    """Return exp(i f) of a series: its derivative is i f' times itself."""
    result = np.zeros(len(series), dtype=complex)
    result[0] = np.exp(1j * series[0])
    for k in range(1, len(series)):
        result[k] = 1j * sum(m * series[m] * result[k - m] for m in range(1, k + 1)) / k
    return result


def times(one: np.ndarray, other: np.ndarray, subscripts: str) -> np.ndarray:
    """Return the product of two series of arrays, cut off as they are."""
    first, second, both = re.split(",|->", subscripts)
    each = f"{first},z{second}->z{both}"
    products = [np.einsum(each, term, other[: len(one) - m]) for m, term in enumerate(one)]
    result = products[0]
    for m, product in enumerate(products[1:], 1):
        result[m:] += product
    return result


def cross(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    """Return the cross product of two series of vectors."""
    products = times(one, other, "i,j->ij")
    return np.stack([products[:, i, j] - products[:, j, i] for i, j in ((1, 2), (2, 0), (0, 1))], axis=1)


def slope(series: np.ndarray) -> np.ndarray:
    """Return the derivative of a series, one coefficient shorter."""
    return (series[1:].T * np.arange(1, len(series))).T


def constant(matrix: np.ndarray, count: int) -> np.ndarray:
    series = np.zeros((count, *matrix.shape))
    series[0] = matrix
    return series


def turn(axis: int, angle: np.ndarray) -> np.ndarray:
    """Return the series of a rotation by a series of angles about x (0), y (1) or z (2)."""
    circle, result = exponential(angle), constant(np.eye(4), len(angle))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    result[:, i, i] = result[:, j, j] = circle.real
    result[:, j, i], result[:, i, j] = circle.imag, -circle.imag
    return result


def along(axis: int, distance: np.ndarray) -> np.ndarray:
    result = constant(np.eye(4), len(distance))
    result[:, axis, 3] += distance
    return result


def chain(dynamics: InverseDynamics, series: np.ndarray) -> tuple[list[np.ndarray], list[np.ndarray]]:
    """Return the pose of each joint's axis, z, and of the frame behind it, as series (count, 4, 4)."""
    robot, count = dynamics.robot, len(series)
    pose, axes, frames = constant(robot.base, count), [], []
    first = np.eye(count)[0]
    for i, joint in enumerate(robot.joints):
        own = joint.sign * series[:, i]
        prismatic = joint.type == "prismatic"
        screw = [along(0, joint.a * first), turn(0, joint.alpha * first), turn(1, joint.beta * first)]
        axial = [
            turn(2, joint.theta * first + (0 if prismatic else own)),
            along(2, joint.d * first + (own if prismatic else 0)),
        ]
        modified = robot.convention == "modified"
        for step in screw if modified else []:
            pose = times(pose, step, "ij,jk->ik")
        axes.append(pose)
        for step in axial if modified else axial + screw:
            pose = times(pose, step, "ij,jk->ik")
        frames.append(pose)
    return axes, frames


def effort_series(dynamics: InverseDynamics, coefficients: np.ndarray, t: float, count: int) -> np.ndarray:
    """Return Taylor coefficients (count, n) of the efforts at t, without Coulomb friction.

    Args:
        dynamics: Of the arm with what it carries.
        coefficients: Of q(t), (degree + 1, n), highest power first.
        t: Time.
        count: How many.
    """
    series = shifted(coefficients, t, count + 2)
    axes, frames = chain(dynamics, series)
    robot, payload = dynamics.robot, dynamics.payload
    solids = []
    for i, joint in enumerate(robot.joints):
        xx, yy, zz, xy, xz, yz = joint.link.inertia
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        solids.append((i, joint.link.mass, np.array(joint.link.com), tensor, frames[i]))
    if payload is not None:
        tool = times(frames[-1], constant(robot.tool, count + 2), "ij,jk->ik")
        solids.append((len(frames) - 1, payload.mass, payload.com, payload.inertia, tool))
    efforts = np.zeros((count, len(robot.joints)))
    for owner, mass, com, tensor, frame in solids:
        center, rotation = frame[:, :3] @ np.append(com, 1.0), frame[:, :3, :3]
        force = mass * slope(slope(center))
        force[0] -= mass * dynamics.gravity
        changing = slope(rotation)
        spin = times(changing, rotation[:-1], "ij,kj->ik")
        w = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
        turned = times(rotation @ tensor, rotation, "ij,kj->ik")
        moment = slope(times(turned[:-1], w, "ij,j->i"))
        for j in range(owner + 1):
            z, origin = axes[j][:count, :3, 2], axes[j][:count, :3, 3]
            if robot.joints[j].type == "prismatic":
                part = times(z, force, "i,i->")
            else:
                part = times(z, moment + cross(center[:count] - origin, force), "i,i->")
            efforts[:, j] += robot.joints[j].sign * part
    rate, change = slope(series)[:count], slope(slope(series))[:count]
    for j, joint in enumerate(robot.joints):
        efforts[:, j] += joint.rotor * change[:, j] + joint.friction.viscous * rate[:, j]
    return efforts
