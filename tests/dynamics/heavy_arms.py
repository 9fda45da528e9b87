"""Arms with random masses for tests, and their energies by Jacobians of their links' centres of mass."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from trajcli.dynamics.newton_euler import InverseDynamics
from trajcli.kinematics.forward import forward
from trajcli.kinematics.jacobian import jacobian
from trajcli.kinematics.robot import Friction, Joint, LinkInertia, Payload, Robot, unlimited

RIGHT = np.pi / 2


def solid(rng: np.random.Generator, mass: float, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Return centre and tensor of three point masses on crossed rods, so that a solid has them."""
    moments = rng.uniform(0.0, 1.0, 3) ** 2 * size**2 * mass
    turn = Rotation.random(rng=rng).as_matrix()
    tensor = (
        turn @ np.diag([moments[1] + moments[2], moments[0] + moments[2], moments[0] + moments[1]]) @ turn.T
    )
    return rng.normal(size=3) * size, (tensor + tensor.T) / 2


def link_inertia(rng: np.random.Generator, mass: float, size: float) -> LinkInertia:
    com, i = solid(rng, mass, size)
    return LinkInertia(mass, tuple(com), (i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2]))


def random_arm(
    rng: np.random.Generator,
    joints: int,
    convention: str = "standard",
    prismatic: float = 0.25,
    friction=False,
) -> Robot:
    """Return an arm with masses, both signs, tilted axes, a tilted base and a tool."""
    rows = []
    for i in range(joints):
        twist = rng.choice([0.0, RIGHT, -RIGHT, np.pi, rng.uniform(-2, 2)])
        rows.append(
            Joint(
                f"j{i + 1}",
                "prismatic" if rng.random() < prismatic else "revolute",
                *rng.uniform(-0.5, 0.5, 3),
                float(twist),
                int(rng.choice([-1, 1])),
                float(rng.choice([0.0, rng.uniform(-1, 1)])),
                friction=Friction(*rng.uniform(0.0, 2.0, 2)) if friction else Friction(),
                rotor=float(rng.uniform(0.0, 0.1)),
                link=link_inertia(rng, rng.uniform(0.5, 8.0), 0.2),
            )
        )
    base, tool = np.eye(4), np.eye(4)
    for pose in (base, tool):
        pose[:3, :3], pose[:3, 3] = Rotation.random(rng=rng).as_matrix(), 0.3 * rng.normal(size=3)
    return Robot("random", tuple(rows), unlimited(joints), convention, base, tool)


def random_payload(rng: np.random.Generator) -> Payload:
    return Payload(3.2, *solid(rng, 3.2, 0.1))


def carried(dynamics: InverseDynamics):
    """Yield mass, tensor in its own axes, and the arm that ends in its centre, for links and payload."""
    robot, payload = dynamics.robot, dynamics.payload
    for k, joint in enumerate(robot.joints, 1):
        xx, yy, zz, xy, xz, yz = joint.link.inertia
        tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        yield joint.link.mass, tensor, _ending(robot, k, np.eye(4), joint.link.com)
    if payload is not None:
        yield payload.mass, payload.inertia, _ending(robot, len(robot.joints), robot.tool, payload.com)


def _ending(robot: Robot, count: int, tool: np.ndarray, com) -> Robot:
    pose = np.eye(4)
    pose[:3, 3] = com
    return replace(robot, joints=robot.joints[:count], limits=unlimited(count), tool=tool @ pose)


def mass_matrix(dynamics: InverseDynamics, q: np.ndarray) -> np.ndarray:
    """Return the sum of J^T diag(m, I) J over all solids, and the rotors, (*batch, n, n)."""
    n = q.shape[-1]
    total = np.zeros((*q.shape, n)) + np.diag([joint.rotor for joint in dynamics.robot.joints])
    for mass, tensor, arm in carried(dynamics):
        k = len(arm.joints)
        slopes = jacobian(arm, q[..., :k], "tcp")
        linear, angular = slopes[..., :3, :], slopes[..., 3:, :]
        part = mass * np.swapaxes(linear, -1, -2) @ linear + np.swapaxes(angular, -1, -2) @ tensor @ angular
        total[..., :k, :k] += part
    return total


def gravity_effort(dynamics: InverseDynamics, q: np.ndarray) -> np.ndarray:
    """Return the gradient of the potential energy, by Jacobians."""
    total = np.zeros(q.shape)
    for mass, _, arm in carried(dynamics):
        k = len(arm.joints)
        total[..., :k] -= mass * np.einsum(
            "i,...ij->...j", dynamics.gravity, jacobian(arm, q[..., :k])[..., :3, :]
        )
    return total


def energy(dynamics: InverseDynamics, q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """Return kinetic and potential energy, (*batch,)."""
    kinetic = 0.5 * np.einsum("...i,...ij,...j->...", qd, mass_matrix(dynamics, q), qd)
    for mass, _, arm in carried(dynamics):
        kinetic = kinetic - mass * forward(arm, q[..., : len(arm.joints)])[..., :3, 3] @ dynamics.gravity
    return kinetic
