"""Inverse dynamics against closed forms of textbooks, and against laws of mechanics."""

from __future__ import annotations

from dataclasses import replace
from math import cos, sin

import numpy as np
import pytest
from heavy_arms import energy, gravity_effort, mass_matrix, random_arm, random_payload

from trajcli.dynamics.newton_euler import InverseDynamics, RigidSolid
from trajcli.errors import InputError
from trajcli.kinematics.jacobian import jacobian
from trajcli.kinematics.robot import Friction, Joint, LinkInertia, Payload, Robot, point_mass, unlimited

CONVENTIONS = ["standard", "modified"]


def close(one, other, relative=1e-10):
    assert np.abs(one - other).max() <= relative * np.abs(other).max()


def planar_arm(masses=(7.0, 4.0), lengths=(0.6, 0.5), centers=(0.25, 0.2), moments=(0.3, 0.1)):
    """The two-link planar arm of Siciliano section 7.3.2, in the vertical plane, without motors."""
    joints = tuple(
        Joint(
            f"j{i + 1}", a=a, link=LinkInertia(m, (lc - a, 0.0, 0.0), (moment, moment, moment, 0.0, 0.0, 0.0))
        )
        for i, (m, a, lc, moment) in enumerate(zip(masses, lengths, centers, moments, strict=True))
    )
    return Robot("planar", joints, unlimited(2), "standard", np.eye(4), np.eye(4))


def test_two_link_planar_arm_in_closed_form():
    m1, m2, a1, l1, l2, i1, i2, g = 7.0, 4.0, 0.6, 0.25, 0.2, 0.3, 0.1, 9.81
    dynamics = InverseDynamics(planar_arm(), np.array([0.0, -g, 0.0]))
    for q1, q2, v1, v2, c1, c2 in np.random.default_rng(5).uniform(-3, 3, (20, 6)):
        b11 = i1 + m1 * l1**2 + i2 + m2 * (a1**2 + l2**2 + 2 * a1 * l2 * cos(q2))
        b12, b22 = i2 + m2 * (l2**2 + a1 * l2 * cos(q2)), i2 + m2 * l2**2
        h = -m2 * a1 * l2 * sin(q2)
        g2 = m2 * l2 * g * cos(q1 + q2)
        g1 = (m1 * l1 + m2 * a1) * g * cos(q1) + g2
        wanted = [
            b11 * c1 + b12 * c2 + 2 * h * v1 * v2 + h * v2**2 + g1,
            b12 * c1 + b22 * c2 - h * v1**2 + g2,
        ]
        q, qd, qdd = np.array([q1, q2]), np.array([v1, v2]), np.array([c1, c2])
        close(dynamics.effort(q, qd, qdd), np.array(wanted))
        close(dynamics.mass_matrix(q), np.array([[b11, b12], [b12, b22]]))
        close(dynamics.gravity_effort(q), np.array([g1, g2]))
        close(dynamics.coriolis(q, qd), np.array([2 * h * v1 * v2 + h * v2**2, -h * v1**2]))


def test_gyroscopic_moment_of_a_wheel_on_a_turntable():
    """A wheel that spins with w about y on a table that turns with u about z: its precession takes I_y w u about x."""
    nothing = LinkInertia(1e-12, (0.0, 0.0, 0.0), (0.0,) * 6)
    wheel = LinkInertia(1.0, (0.0, 0.0, 0.0), (0.01, 0.01, 0.02, 0.0, 0.0, 0.0))
    joints = (
        Joint("tilt", link=nothing),
        Joint("table", alpha=np.pi / 2, link=nothing),
        Joint("wheel", alpha=np.pi / 2, link=wheel),
    )
    robot = Robot("wheel", joints, unlimited(3), "modified", np.eye(4), np.eye(4))
    dynamics = InverseDynamics(robot, np.zeros(3))
    # with q2 = pi / 2 the wheel's axis is square to that of the tilt; L = I_z w along it turns with the table
    q, qd = np.array([0.0, np.pi / 2, 0.0]), np.array([0.0, 3.0, 40.0])
    turn = jacobian(robot, q)[3:]
    axis = turn[:, 2]
    moment = np.cross(turn[:, 1] * 3.0, 0.02 * 40.0 * axis)  # the table's own momentum keeps its direction
    assert dynamics.effort(q, qd, np.zeros(3)) == pytest.approx(turn.T @ moment, abs=1e-9)
    assert np.abs(moment).max() > 1.0


def test_slide_lifts_its_load():
    slide = Joint(
        "lift", "prismatic", sign=-1, link=LinkInertia(2.0, (0.1, 0.2, 0.3), (1.0,) * 3 + (0.0,) * 3)
    )
    robot = Robot("lift", (slide,), unlimited(1), "modified", np.eye(4), np.eye(4))
    dynamics = InverseDynamics(robot, payload=point_mass(3.0))
    assert dynamics.effort([0.4], [1.0], [2.0]) == pytest.approx([5.0 * (2.0 - 9.81)], rel=1e-14)


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("seed", range(6))
def test_mass_matrix_and_gravity_by_jacobians(convention, seed):
    rng = np.random.default_rng(seed)
    n = 1 + seed
    payload = random_payload(rng) if seed % 2 else None
    dynamics = InverseDynamics(random_arm(rng, n, convention), rng.normal(size=3) * 9, payload)
    q = rng.uniform(-3, 3, (7, 2, n))
    close(dynamics.mass_matrix(q), mass_matrix(dynamics, q))
    close(dynamics.gravity_effort(q), gravity_effort(dynamics, q))


@pytest.mark.parametrize("convention", CONVENTIONS)
@pytest.mark.parametrize("seed", range(6))
def test_power_is_the_change_of_energy(convention, seed):
    rng = np.random.default_rng(100 + seed)
    n = 2 + seed
    dynamics = InverseDynamics(random_arm(rng, n, convention), rng.normal(size=3) * 9, random_payload(rng))
    powers = rng.normal(size=(5, n))
    nodes, weights = np.polynomial.legendre.leggauss(60)
    t = 0.5 + 0.5 * np.append(nodes, [-1.0, 1.0])
    q, qd, qdd = (
        sum(
            np.prod(range(k - order + 1, k + 1)) * t[:, None] ** max(k - order, 0) * powers[k]
            for k in range(order, 5)
        )
        for order in range(3)
    )
    power = (dynamics.effort(q, qd, qdd) * qd).sum(axis=1)
    before, after = energy(dynamics, q, qd)[-2:]
    scale = np.abs(power).max()
    assert abs(0.5 * weights @ power[:60] - (after - before)) <= 1e-9 * scale


@pytest.mark.parametrize("convention", CONVENTIONS)
def test_parts_add_up(convention):
    rng = np.random.default_rng(3)
    dynamics = InverseDynamics(random_arm(rng, 6, convention, friction=True), payload=random_payload(rng))
    q, qd, qdd = rng.normal(size=(3, 11, 6))
    whole = (dynamics.mass_matrix(q) @ qdd[..., None])[..., 0] + dynamics.coriolis(q, qd)
    whole += dynamics.gravity_effort(q) + dynamics.friction(qd)
    close(dynamics.effort(q, qd, qdd), whole)


def test_friction_by_the_sign_of_the_velocity():
    robot = planar_arm()
    joints = tuple(replace(joint, friction=Friction(2.0, 0.5)) for joint in robot.joints)
    friction = InverseDynamics(replace(robot, joints=joints)).friction([[3.0, -1.0], [0.0, 0.25]])
    assert friction.tolist() == [[3.5, -2.5], [0.0, 2.125]]


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(
    ("rate", "rubs"), [(0.0, 0.0), (0.9e-12, 0.0), (1.1e-12, 1.0), (1e-9, 1.0), (1e-3, 1.0)]
)
def test_what_rounding_leaves_of_rest_has_no_friction(rate, rubs, side):
    """A joint that is a little off its place at rest is not pushed by all of its friction."""
    robot = planar_arm()
    joints = tuple(replace(joint, friction=Friction(2.0, 0.0)) for joint in robot.joints)
    friction = InverseDynamics(replace(robot, joints=joints)).friction([side * rate, 0.0])
    assert friction.tolist() == [side * rubs * 2.0, 0.0]


@pytest.mark.parametrize("seed", range(4))
def test_along_a_path_efforts_are_linear_in_the_law(seed):
    """With q(s(t)): M q' sdd + (M q'' + C q') sd^2 + g, each against its own column of inverse dynamics."""
    rng = np.random.default_rng(seed)
    dynamics = InverseDynamics(random_arm(rng, 5), payload=random_payload(rng))
    q, first, second = rng.normal(size=(3, 7, 5))
    a, b, held = dynamics.along_path(q, first, second)
    close(held, gravity_effort(dynamics, q))
    close(a, (mass_matrix(dynamics, q) @ first[..., None])[..., 0])
    for sd, sdd in ((1.0, 0.0), (-1.0, 0.0), (3.0, -2.0)):
        moving = dynamics.rigid_effort(q, first * sd, first * sdd + second * sd**2)
        close(a * sdd + b * sd**2 + held, moving)


def test_what_the_tool_weighs_is_carried_as_a_payload_is():
    """Both at once weigh what both weigh."""
    rng = np.random.default_rng(12)
    robot, tool, load = random_arm(rng, 3), random_payload(rng), random_payload(rng)
    q, qd, qdd = rng.normal(size=(3, 4, 3))
    bare, with_tool, loaded, both = (
        InverseDynamics(replace(robot, tool_load=one, payload=other)).effort(q, qd, qdd)
        for one, other in ((None, None), (tool, None), (None, load), (tool, load))
    )
    close(with_tool, InverseDynamics(robot, payload=tool).effort(q, qd, qdd))
    close(with_tool + loaded, both + bare)
    assert np.abs(with_tool - bare).max() > 1.0


def test_masses_are_symmetric_to_the_last_bit():
    matrix = InverseDynamics(random_arm(np.random.default_rng(2), 6)).mass_matrix(np.linspace(-1, 2, 6))
    assert (matrix == matrix.T).all()


@pytest.mark.parametrize("gravity", [[0.0, np.nan, 0.0], [0.0, 0.0, -np.inf], [0.0, 0.0], 9.81])
def test_gravity_that_is_no_vector_is_refused(gravity):
    with pytest.raises(InputError, match="three finite numbers"):
        InverseDynamics(planar_arm(), np.asarray(gravity))


def test_hanging_base_turns_gravity_over():
    robot = planar_arm()
    upright = InverseDynamics(robot, np.array([1.0, 2.0, 3.0]))
    turn = np.diag([1.0, -1.0, -1.0, 1.0])
    hanging = InverseDynamics(replace(robot, base=turn), np.array([1.0, -2.0, -3.0]))
    q = np.random.default_rng(0).normal(size=(5, 2))
    close(hanging.gravity_effort(q), upright.gravity_effort(q))


def test_payload_is_the_same_as_a_heavier_last_link():
    rng = np.random.default_rng(8)
    robot = replace(random_arm(rng, 4, "modified"), tool=np.eye(4))
    last = robot.joints[-1]
    weightless = replace(last, link=LinkInertia(1e-9, (0.0, 0.0, 0.0), (0.0,) * 6))
    xx, yy, zz, xy, xz, yz = last.link.inertia
    payload = Payload(
        last.link.mass, np.array(last.link.com), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    )
    light = InverseDynamics(replace(robot, joints=(*robot.joints[:-1], weightless)), payload=payload)
    q, qd, qdd = rng.normal(size=(3, 9, 4))
    close(light.effort(q, qd, qdd), InverseDynamics(robot).effort(q, qd, qdd), 1e-7)


def test_rates_are_not_changed_and_shapes_kept():
    dynamics = InverseDynamics(planar_arm())
    q = np.zeros((2, 3, 2))
    assert dynamics.effort(q, q, q).shape == (2, 3, 2)
    assert dynamics.mass_matrix(q).shape == (2, 3, 2, 2)
    with pytest.raises(InputError, match=r"qd has shape \(2,\), q has shape \(2, 3, 2\)"):
        dynamics.effort(q, [0.0, 0.0], q)


def test_missing_inertias_are_named():
    robot = planar_arm()
    bare = replace(robot, joints=(robot.joints[0], replace(robot.joints[1], link=None)))
    with pytest.raises(InputError, match="robot planar: no mass and inertia of the link behind joint j2"):
        InverseDynamics(bare)


@pytest.mark.parametrize(
    ("mass", "inertia", "message"),
    [
        (-1.0, np.zeros((3, 3)), "expected a mass of at least 0 kg, got -1"),
        (np.nan, np.zeros((3, 3)), "expected a mass of at least 0 kg, got nan"),
        (1.0, np.diag([1.0, 1.0, 2.1]), "above the sum of the two others"),
        (1.0, np.diag([-0.1, 1.0, 1.0]), "negative moment of inertia"),
        (1.0, np.array([[1.0, 0.5, 0], [0, 1.0, 0], [0, 0, 1.0]]), "symmetric"),
        (1.0, np.diag([1.0, np.inf, 1.0]), "finite"),
        (1.0, np.zeros(6), r"expected inertia of shape \(3, 3\), got \(6,\)"),
    ],
)
def test_impossible_payloads_are_refused(mass, inertia, message):
    with pytest.raises(InputError, match=message):
        Payload(mass, np.zeros(3), inertia)


@pytest.mark.parametrize("moments", [(0.0, 0.0, 0.0), (0.0, 1.0, 1.0), (1.0, 1.0, 2.0)])
def test_point_rod_and_disc_are_possible(moments):
    assert Payload(1.0, np.zeros(3), np.diag(moments)).mass == 1.0


MANY = 4096 + 300
"""States, more than what is calculated at a time; some of them, the first and the last among these."""
SOME = [0, 1, 4095, 4096, 4100, MANY - 1]


def many_states(count):
    """Return an arm of three joints in weight, and states of it, each (count, 3)."""
    rng = np.random.default_rng(11)
    dynamics = InverseDynamics(random_arm(rng, 3), rng.normal(size=3) * 9, random_payload(rng))
    return dynamics, *rng.uniform(-3, 3, (3, count, 3))


def test_each_of_many_states_has_its_own_efforts():
    dynamics, q, qd, qdd = many_states(MANY)
    efforts, matrices = dynamics.effort(q, qd, qdd), dynamics.mass_matrix(q)
    weights = dynamics.gravity_effort(q)
    for row in SOME:
        close(efforts[row], dynamics.effort(q[row], qd[row], qdd[row]))
        close(weights[row], gravity_effort(dynamics, q[row]))
        close(matrices[row], mass_matrix(dynamics, q[row]))


def test_parts_of_many_states_are_apart():
    """Both parts of a state, and the three of a point of a path, are calculated together: in several steps here."""
    dynamics, q, qd, qdd = many_states(MANY)
    moved, held = dynamics.apart_from_gravity(q, qd, qdd)
    a, b, weight = dynamics.along_path(q, qd, qdd)
    for row in SOME:
        matrix = mass_matrix(dynamics, q[row])
        fast = dynamics.coriolis(q[row], qd[row])
        for own in (held[row], weight[row]):
            close(own, gravity_effort(dynamics, q[row]))
        for own in (moved[row], b[row]):
            close(own, matrix @ qdd[row] + fast, 1e-9)
        close(a[row], matrix @ qd[row], 1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_sizes_of_a_point_mass_in_any_direction(seed):
    """A mass m at p has the first moment m p, and moments of inertia m p^2 about what is square to p; 0 about p."""
    x, y, z = p = np.random.default_rng(seed).normal(size=3)
    mass = 2.5
    second = mass * np.array([y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z])
    sizes = RigidSolid(mass, tuple((mass * p).tolist()), tuple(second.tolist())).sizes
    assert sizes == pytest.approx([mass, mass * np.linalg.norm(p), mass * p @ p, mass * p @ p / 2], rel=1e-12)
