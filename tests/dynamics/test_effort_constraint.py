"""Rows of efforts along a path: each joint, each direction, one-sided limits, breaks, friction, places between points."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from heavy_arms import random_arm

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.time_law import LawPieces
from trajcli.dynamics.effort_constraint import EffortConstraint, HeldOverLimitError
from trajcli.dynamics.newton_euler import InverseDynamics
from trajcli.kinematics.robot import Friction, Joint, LinkInertia, Robot, unlimited

MASS, G, FREE = 5.0, 9.81, np.inf
SIDES = pytest.mark.parametrize("side", [1.0, -1.0])


def constraint(robot: Robot, path: PiecewisePolynomial, limits, velocity=None, **more) -> EffortConstraint:
    n = len(robot.joints)
    velocity = np.tile([-FREE, FREE], (n, 1)) if velocity is None else np.asarray(velocity)
    return EffortConstraint(InverseDynamics(robot), path, np.asarray(limits, dtype=float), velocity, **more)


def curved(seed: int, joints: int, kink: float = 0.0) -> PiecewisePolynomial:
    """Return a path of two parabolas over [0, 2]; at 1 q'' jumps by a part of itself, and nothing else."""
    rows = np.random.default_rng(seed).normal(size=(3, joints))
    behind = np.stack([(1 + kink) * rows[0], 2 * rows[0] + rows[1], rows.sum(axis=0)])
    return PiecewisePolynomial(np.arange(3.0), np.stack([rows, behind], axis=1))


@pytest.mark.parametrize("seed", range(4))
def test_each_row_is_what_one_limit_of_one_joint_leaves(seed):
    """Upper limits come first; joints have one, the other, both or none of them, and friction of their direction."""
    robot = random_arm(np.random.default_rng(seed), 4, friction=True)
    joints = tuple(replace(j, friction=replace(j.friction, viscous=0.0)) for j in robot.joints)
    robot = replace(robot, joints=joints)
    limits = np.array([[-FREE, 900.0], [-800.0, FREE], [-700.0, 600.0], [-FREE, FREE]])
    one = constraint(robot, curved(seed, 4), limits)
    assert one.bounds_sdd
    assert not one.has_viscous
    s = np.array([0.1, 0.4, 0.9, 1.3, 1.9])
    rows = one.rows(s, "right")
    q, first, second = one.path.evaluate_orders(s, (0, 1, 2)).transpose(1, 0, 2)
    for sd, sdd in ((0.5, 0.0), (2.0, -3.0), (1.0, 4.0)):
        effort = one.dynamics.effort(q, first * sd, first * sdd + second * sd**2)
        left = np.stack(
            [900.0 - effort[:, 0], 600.0 - effort[:, 2], effort[:, 1] + 800.0, effort[:, 2] + 700.0], axis=1
        )
        np.testing.assert_allclose(rows.c - rows.a * sdd - rows.b * sd**2, left, rtol=1e-9, atol=1e-9)
    assert not constraint(robot, one.path, np.tile([-FREE, FREE], (4, 1))).bounds_sdd
    assert (one.shortest(s).tolist(), one.largest(s, "left").tolist()) == ([0.0] * 4, [FREE] * 5)


@pytest.mark.parametrize("order", [("left", "right"), ("right", "left"), ("left", "right", "left")])
@pytest.mark.parametrize(("kink", "far"), [(0.5, 0.0), (1e-5, 0.0), (1e-9, 0.0), (1e-9, 1e4)])
def test_both_sides_of_a_break_have_their_own_rows(kink, far, order):
    """q'' jumps there; what one side was told is not what the other one is, however little it differs."""
    robot = random_arm(np.random.default_rng(1), 3)
    path, dynamics = curved(5, 3, kink), InverseDynamics(robot)
    path = PiecewisePolynomial(
        path.breaks, path.coefficients + far * np.array([0.0, 0.0, 1.0])[:, None, None]
    )
    one = constraint(robot, path, np.tile([-900.0, 900.0], (3, 1)))
    q, first, second = path.evaluate_orders(np.array([1.0]), (0, 1, 2), side="left").transpose(1, 0, 2)
    for side in order:
        wanted = dynamics.rigid_effort(q, first, second * (1 + kink * (side == "right")), weight=False)
        rows = one.rows(np.array([0.5, 1.0, 1.5]), side)
        np.testing.assert_allclose(rows.b[1, :3], wanted[0], rtol=1e-10 if far else 1e-12)
        np.testing.assert_array_equal(rows.b[:, 3:], -rows.b[:, :3])


def test_points_of_a_finer_grid_have_their_own_rows_and_are_told_once(monkeypatch):
    """On a straight line neighbours differ by their positions alone, by which gravity and inertia do."""
    robot, line = random_arm(np.random.default_rng(2), 3), np.array([[[0.7, -0.4, 1.1]], [[0.2, 0.1, -0.3]]])
    one, other = (
        constraint(robot, PiecewisePolynomial(np.array([0.0, 1.0]), line), [[-900.0, 900.0]] * 3)
        for _ in "12"
    )
    grids = [np.linspace(0.0, 1.0, count) for count in (5, 17, 9)]
    fresh = other.rows(grids[1], "right")
    asked, told = [], InverseDynamics.along_path
    monkeypatch.setattr(
        InverseDynamics, "along_path", lambda self, q, *more: asked.append(len(q)) or told(self, q, *more)
    )
    for grid, step in zip(grids, (4, 1, 2), strict=True):
        rows = one.rows(grid, "right")
        np.testing.assert_allclose(rows.a, fresh.a[::step], rtol=1e-12)
        np.testing.assert_allclose(rows.c, fresh.c[::step], rtol=1e-12)
    assert asked == [5, 12], "the third grid is part of the second one"


def lifts(side: float, friction: float = 0.0, viscous: float = 0.0) -> Robot:
    """Return two slides along one vertical line, the second of 5 kg, the first of none; gravity may point up."""
    links = (LinkInertia(mass, (0.0, 0.0, 0.0), (0.0,) * 6) for mass in (1e-12, MASS))
    rubs = Friction(friction, viscous)
    joints = tuple(Joint(f"s{k}", "prismatic", friction=rubs, link=each) for k, each in enumerate(links))
    gravity = np.array([0.0, 0.0, -side * G])
    return Robot("lifts", joints, unlimited(2), "standard", np.eye(4), np.eye(4), gravity=gravity)


def straight(slope: float) -> PiecewisePolynomial:
    return PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[slope, slope]], [[0.0, 0.0]]]))


@SIDES
@pytest.mark.parametrize("joint", [0, 1])
def test_what_holds_a_joint_at_its_limit_is_refused_by_its_name(joint, side):
    """It is held with 49.05 N; a limit of just that leaves nothing to move with."""
    limits = np.tile([-900.0, 900.0], (2, 1))
    held = float(InverseDynamics(lifts(side)).gravity_effort([0.0, 0.0])[joint])
    assert held == pytest.approx(side * MASS * G)
    for beyond, refused in ((-1e-6, True), (0.0, True), (1e-6, False)):
        limit = held + side * beyond
        limits[joint, int(side > 0)] = limit
        one = constraint(lifts(side), straight(1.0), limits)
        if not refused:
            assert one.rows(np.array([0.0, 0.5]), "right").c.min() == pytest.approx(1e-6, rel=1e-6)
            continue
        with pytest.raises(HeldOverLimitError) as caught:
            one.rows(np.array([0.0, 0.5]), "right")
        error = caught.value
        assert (error.joint, error.effort, error.limit) == (joint, held, limit)


@SIDES
@pytest.mark.parametrize(("begins", "worst"), [(-1.0, 0.5), (0.0, 0.0), (-2.0, 1.0)])
def test_the_place_where_a_beam_is_heaviest_is_named(begins, worst, side):
    """A beam that turns from one angle to one that is 2 further; it is level at the angle 0."""
    link = LinkInertia(MASS, (0.0, 0.0, 0.0), (0.0,) * 6)
    level = Joint("beam", "revolute", a=1.0, link=link)
    gravity = np.array([0.0, -side * G, 0.0])
    robot = Robot("beam", (level,), unlimited(1), "standard", np.eye(4), np.eye(4), gravity=gravity)
    path = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[2.0]], [[begins]]]))
    limits = [[-900.0, 48.0]] if side > 0 else [[-48.0, 900.0]]
    with pytest.raises(HeldOverLimitError) as caught:
        constraint(robot, path, limits).rows(np.linspace(0.0, 1.0, 5), "right")
    assert caught.value.s == worst
    assert caught.value.effort == pytest.approx(side * MASS * G)


@SIDES
@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("velocity", [(-3.0, 1.0), (-1.0, 3.0)])
def test_viscous_friction_that_helps_is_a_chord_up_to_the_largest_speed(velocity, joint, side):
    """It meets the friction at rest and at the speed that the limits of that direction allow, and gives less between."""
    robot = lifts(1.0, viscous=4.0)
    assert constraint(robot, straight(1.0), [[-900.0, 900.0]] * 2).has_viscous
    limits = np.tile([-900.0, 900.0], (2, 1))
    velocities = np.tile([-9.0, 9.0], (2, 1))
    velocities[joint] = velocity
    one = constraint(robot, straight(side), limits, velocities)
    rows = one.rows(np.array([0.5]), "right")
    cap = velocity[1] if side > 0 else -velocity[0]
    for share in (0.0, 0.3, 1.0):
        sd = share * cap
        effort = one.dynamics.effort([[0.0, 0.0]], [[side * sd, side * sd]], [[0.0, 0.0]])
        left = np.concatenate([900.0 - effort, effort + 900.0], axis=1)
        given = rows.c - rows.b * sd**2
        assert (given <= left + 1e-9).all()
        if share != 0.3:
            helped = slice(2, 4) if side > 0 else slice(0, 2)
            np.testing.assert_allclose(given[:, helped], left[:, helped], rtol=1e-12)


@SIDES
@pytest.mark.parametrize(
    ("speed", "touches", "taken"), [(0.5, 0.5, 10.0), (1.5, 1.5, 30.0), (50.0, 2.0, 40.0)]
)
def test_viscous_friction_that_resists_is_a_tangent_that_leaves_half_at_rest(speed, touches, taken, side):
    """It takes v r / 2 of 80 N at rest, of v = 40 N s/m at a speed r: at most half, which is that of 2 m/s.

    At the speed at which it touches it is exact, and at no other speed too little.
    """
    robot = replace(lifts(1.0, viscous=40.0), gravity=np.zeros(3))
    limits = np.tile([-80.0, 80.0], (2, 1))
    one = constraint(robot, straight(side), limits, speed=lambda s: np.full(s.size, speed))
    rows = one.rows(np.array([0.25, 0.5]), "right")
    resisted = slice(0, 2) if side > 0 else slice(2, 4)
    np.testing.assert_allclose(rows.c[:, resisted], 80.0 - taken, rtol=1e-12)
    for sd in (0.0, 0.3, 1.0, 1.9, 2.5, 10.0, touches):
        left = 80.0 - 40.0 * sd
        given = (rows.c - rows.b * sd**2)[:, resisted]
        assert (given <= left + 1e-9).all()
    np.testing.assert_allclose(given, left, atol=1e-9)


def test_viscous_friction_of_one_joint_is_some():
    robot = lifts(1.0)
    joints = robot.joints[0], replace(robot.joints[1], friction=Friction(0.0, 2.0))
    assert constraint(replace(robot, joints=joints), straight(1.0), [[-900.0, 900.0]] * 2).has_viscous


def used(
    side: float, limit: float, sdd: float, speed: float, slope: float, rubs: Friction | None = None
) -> float:
    """Return the share that a tenth of a second with one sdd uses of what a lift has against gravity."""
    whole = lifts(side)
    joint = replace(whole.joints[1], friction=rubs or Friction())
    lift = replace(whole, joints=(joint,), limits=unlimited(1))
    limits = [[-FREE, limit]] if side > 0 else [[-limit, FREE]]
    path = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[slope]], [[0.0]]]))
    law = LawPieces(np.array([0.1]), np.array([[sdd / 2], [speed], [0.2]]))
    velocities, shares = constraint(lift, path, limits).excess(law)
    assert velocities.tolist() == [0.0]
    return float(shares[0])


@SIDES
def test_friction_counts_where_a_motion_begins_or_ends_at_rest(side):
    """Against gravity 80 N are there, less friction on the way against it, and more on the way back."""
    rubs = Friction(6.0, 0.0)
    assert used(side, 80.0, 4.0, 0.0, side, rubs) == pytest.approx(MASS * 4.0 / (80.0 - MASS * G - 6.0))
    assert used(side, 80.0, 4.0, 0.0, -side, rubs) == 0.0
    assert used(side, 80.0, -4.0, 0.4, -side, rubs) == pytest.approx(MASS * 4.0 / (80.0 - MASS * G + 6.0))
    assert used(side, 80.0, -4.0, 0.4, side, rubs) == 0.0


@SIDES
def test_viscous_friction_counts_with_the_speed_of_the_faster_end(side):
    """10 N s/m are held by the motor on the way against gravity, and help it to brake on the way back."""
    slack, rubs = 80.0 - MASS * G, Friction(0.0, 10.0)
    assert used(side, 80.0, 4.0, 0.6, side, rubs) == pytest.approx((MASS * 4.0 + 10.0 * 1.0) / slack)
    assert used(side, 80.0, -1.0, 1.0, side, rubs) == pytest.approx((-MASS * 1.0 + 10.0 * 1.0) / slack)
    assert used(side, 80.0, -4.0, 1.0, -side, rubs) == pytest.approx((MASS * 4.0 - 10.0 * 0.6) / slack)
    assert used(side, 80.0, -4.0, 2.5, -side, rubs) == 0.0


@SIDES
def test_what_gravity_alone_exceeds_between_points_is_told_as_much_as_can_be(side):
    """Of 40 N nothing is left: to stand takes all that is told, to fall as fast as that asks nothing."""
    assert used(side, 40.0, 0.0, 0.5, side) == 1e3
    assert used(side, 40.0, -1.0, 0.5, side) == 1e3
    assert used(side, 40.0, -1.82, 0.5, side) == 0.0
    held = abs(float(InverseDynamics(lifts(side)).gravity_effort([0.0, 0.0])[1]))
    assert used(side, held, 0.0, 0.5, side) == 0.0  # just what it takes to stand
    assert used(side, held + 1e-6, 4.0, 0.5, side) == 1e3  # of a millionth of a newton


@SIDES
@pytest.mark.parametrize("piece", [0, 1, 2])
def test_each_interval_is_told_alone(piece, side):
    """Three tenths of a second, of which one is fast: the shares of the others stay as they are."""
    rows = np.zeros((3, 3))
    rows[0, piece], rows[1], rows[2] = 2.0 * side, 0.5, [0.1, 0.4, 0.7]
    limits = [[-80.0, 80.0]] * 2
    shares = constraint(lifts(1.0), straight(1.0), limits).excess(LawPieces(np.full(3, 0.1), rows))[1]
    slack = 80.0 - side * MASS * G
    wanted = np.where(np.arange(3) == piece, 2 * MASS * 4.0 / slack, 0.0)  # both slides lift the mass
    np.testing.assert_allclose(shares, wanted, atol=1e-9)


@pytest.mark.parametrize("begins", [0.1, 1.0, 1.2])
def test_shares_are_those_of_efforts_at_both_ends_and_in_the_middle(begins):
    """Gravity of an arm changes on the way; what it takes at the near end counts as not there to be used.

    The path breaks at 1, where q'' jumps.
    """
    robot, times, worst = random_arm(np.random.default_rng(3), 3), np.array([0.0, 0.2, 0.4]), set()
    dynamics, path = InverseDynamics(robot), curved(3, 3, 0.5)
    for joint, sdd in np.ndindex(3, 5):
        limits = np.tile([-FREE, FREE], (3, 1))
        limits[joint, 1] = 1e4
        law = np.array([[sdd - 2.0], [1.0], [begins]])
        s, sd = np.polyval(law[:, 0], times), 1.0 + 2.0 * law[0] * times
        q, first, second = path.evaluate_orders(s, (0, 1, 2)).transpose(1, 0, 2)
        efforts = dynamics.effort(q, first * sd[:, None], first * 2.0 * law[0] + second * sd[:, None] ** 2)
        gravity = dynamics.gravity_effort(q[0])[joint]
        shares = (efforts[:, joint] - gravity) / (1e4 - gravity)
        worst.add(int(shares.argmax()))
        found = constraint(robot, path, limits).excess(LawPieces(np.array([0.4]), law))
        np.testing.assert_allclose(found[1], max(shares.max(), 0.0), rtol=1e-9, atol=1e-12)
    assert len(worst) > 1
