"""Time-optimal motion within limits of effort, against dense rows of inverse dynamics, toppra, and closed forms."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from tiers import few

from trajcli.api.plans import plan
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.parameterization import time_optimal
from trajcli.curves.time_optimal.time_law import LawPieces
from trajcli.dynamics.effort_constraint import EffortConstraint, HeldOverLimitError
from trajcli.dynamics.newton_euler import InverseDynamics
from trajcli.errors import MissingLimitError, PlanningError
from trajcli.kinematics.robot import Friction, Joint, LinkInertia, Robot, point_mass, unlimited
from trajcli.planners.effort_limits import solved_within_efforts
from trajcli.urdf.serial_robot import robot_of_urdf

MODELS = Path(__file__).parents[1] / "urdf" / "models"
EFFORTS = {
    "ur5": [150, 150, 150, 28, 28, 28],
    "panda": [87, 87, 87, 87, 12, 12, 12],
    "xarm7": [50, 50, 30, 30, 30, 20, 20],
}
UR5_POINTS = [
    [0.0, -1.5, 1.5, -1.5, -1.5, 0.0],
    [1.0, -1.0, 1.0, -1.0, -1.0, 0.5],
    [1.0, -1.2, 1.9, -0.4, -1.5, 1.5],
]


def arm(name: str, *, velocity: float = 20.0, mass: float = 0.0, friction: Friction | None = None) -> Robot:
    """Return an arm whose only limits are velocities and efforts."""
    robot = robot_of_urdf((MODELS / f"{name}.urdf").read_bytes(), name).robot
    joints = tuple(replace(joint, friction=friction or Friction()) for joint in robot.joints)
    n, size = len(joints), np.array(EFFORTS[name], dtype=float)
    free = np.tile([-np.inf, np.inf], (n, 1))
    limits = replace(
        robot.limits,
        velocity=np.tile([-velocity, velocity], (n, 1)),
        acceleration=free,
        jerk=free,
        effort=np.stack([-size, size], axis=1),
    )
    return replace(robot, joints=joints, limits=limits, payload=point_mass(mass) if mass else None)


def spline_of(robot: Robot, seed: int) -> tuple[PiecewisePolynomial, np.ndarray]:
    """Return a random spline on which gravity alone takes at most 0.8 of the limits, and its points."""
    rng, dynamics = np.random.default_rng(seed), InverseDynamics(robot)
    while True:
        points = rng.uniform(-1.5, 1.5, (6, len(robot.joints)))
        curve = CubicSpline(np.linspace(0, 1, 6), points)
        held = np.abs(dynamics.gravity_effort(curve(np.linspace(0, 1, 401))))
        if (held < 0.8 * robot.limits.effort[:, 1]).all():
            return PiecewisePolynomial(curve.x, curve.c), points


def solved(path: PiecewisePolynomial, robot: Robot):
    limits = robot.limits
    return solved_within_efforts(
        path, robot, lambda more: time_optimal(path, limits.velocity, limits.acceleration, further=more)
    )


def shares(curve: PiecewisePolynomial, robot: Robot, count: int = 10_001) -> np.ndarray:
    """Return the efforts by dense rows, as shares of the limits; where an arm comes to rest, just before."""
    t = np.linspace(curve.start, curve.end, count)[1:-1]
    efforts = InverseDynamics(robot).effort(*(curve.evaluate(t, order) for order in range(3)))
    return efforts / robot.limits.effort[:, 1]


def at_all_of(states: list[np.ndarray], robot: Robot) -> Callable[..., np.ndarray]:
    """Return inverse dynamics that knows these states (3, n), found all at once."""
    efforts = InverseDynamics(robot).rigid_effort(*np.array(states).transpose(1, 0, 2))
    known = dict(zip((state.tobytes() for state in states), efforts, strict=True))
    return lambda *state: known[np.array(state).tobytes()]


def toppra_duration(robot: Robot, points: np.ndarray, count: int = 1600) -> float:
    """Return the duration that toppra finds with torques at the points of a fine grid."""
    toppra = pytest.importorskip("toppra")
    from toppra import algorithm, constraint

    logging.getLogger("toppra").setLevel(logging.CRITICAL)
    n, limits, states = len(robot.joints), robot.limits, []

    def asked(*state: np.ndarray) -> np.ndarray:
        states.append(np.array(state))
        return np.zeros(n)

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        path = toppra.SplineInterpolator(np.linspace(0, 1, len(points)), points, bc_type="not-a-knot")
        torque = constraint.JointTorqueConstraint(
            asked,
            limits.effort,
            np.zeros(n),
            discretization_scheme=constraint.DiscretizationType.Collocation,
        )
        grid = np.linspace(0, 1, count + 1)
        torque.compute_constraint_params(path, grid)
        torque.inv_dyn = at_all_of(states, robot)
        bounds = [constraint.JointVelocityConstraint(limits.velocity), torque]
        instance = algorithm.TOPPRA(bounds, path, gridpoints=grid, solver_wrapper="seidel")
        _, speeds, _ = instance.compute_parameterization(0, 0)
    return float((2 * np.diff(grid) / (speeds[1:] + speeds[:-1])).sum())


@pytest.mark.parametrize(("name", "seed"), few([("ur5", 1), ("panda", 4), ("xarm7", 2)], 1))
def test_durations_against_toppra(name, seed):
    """toppra keeps its limits at grid points only: it is a lower mark."""
    robot = arm(name)
    path, points = spline_of(robot, seed)
    motion = solved(path, robot)
    assert np.abs(shares(motion.trajectory, robot)).max() <= 1 + 1e-6
    assert motion.trajectory.duration <= 1.003 * toppra_duration(robot, points, 800)


def test_where_a_grid_lets_nothing_move_on_it_is_made_finer():
    """Next to its end the arm stands between two places of the first grid: nearer ones leave it a speed."""
    robot = arm("xarm7")
    path, points = spline_of(robot, 15)
    motion = solved(path, robot)
    assert np.abs(shares(motion.trajectory, robot)).max() <= 1 + 1e-6
    assert motion.trajectory.duration <= 1.003 * toppra_duration(robot, points, 800)


@pytest.mark.soak
@pytest.mark.parametrize("name", EFFORTS)
def test_durations_against_toppra_on_many_splines(name):
    for seed in range(34):
        robot = arm(name)
        path, points = spline_of(robot, seed)
        motion = solved(path, robot)
        assert np.abs(shares(motion.trajectory, robot)).max() <= 1 + 1e-6
        assert motion.trajectory.duration <= 1.007 * motion.stretch * toppra_duration(robot, points)
        assert motion.stretch <= 1.06  # as efforts that are proven for all t ask for it


@pytest.mark.full
@pytest.mark.parametrize("mass", [0.0, 5.0])
def test_a_joint_is_at_its_limit_nearly_always(mass):
    robot = arm("ur5", mass=mass)
    path, _ = spline_of(robot, 11)
    used = np.abs(shares(solved(path, robot).trajectory, robot)).max(axis=1)
    assert used.max() <= 1 + 1e-6
    assert (used > 0.97).mean() > 0.9


@pytest.mark.full
@pytest.mark.parametrize("friction", [Friction(5.0, 0.0), Friction(0.0, 8.0), Friction(3.0, 5.0)])
def test_friction_is_kept(friction):
    robot = arm("ur5", velocity=3.0, friction=friction)
    path, _ = spline_of(robot, 7)
    motion = solved(path, robot)
    assert np.abs(shares(motion.trajectory, robot)).max() <= 1 + 1e-6


def lift(limit: float, friction: Friction = Friction()) -> Robot:  # noqa: B008
    """Return a vertical slide of 5 kg with a limit of its force alone."""
    from trajcli.kinematics.robot import Joint, Limits, LinkInertia

    joint = Joint("lift", "prismatic", friction=friction, link=LinkInertia(5.0, (0.0, 0.0, 0.0), (0.0,) * 6))
    free = np.array([[-np.inf, np.inf]])
    limits = Limits(free, np.array([[-50.0, 50.0]]), free, free, effort=np.array([[-limit, limit]]))
    return Robot("lift", (joint,), limits, "standard", np.eye(4), np.eye(4))


def test_bang_bang_of_a_lift_in_closed_form():
    """Up with (F - m g) / m, then down with (F + m g) / m: T = sqrt(2 L (1 / a + 1 / d))."""
    path = PiecewisePolynomial([0.0, 1.0], np.array([[[3.0]], [[0.0]]]))
    motion = solved(path, lift(80.0))
    up, down = 80 / 5 - 9.81, 80 / 5 + 9.81
    assert motion.trajectory.duration == pytest.approx((2 * 3.0 * (1 / up + 1 / down)) ** 0.5, rel=1e-6)


def test_coulomb_friction_of_a_lift_in_closed_form():
    path = PiecewisePolynomial([0.0, 1.0], np.array([[[3.0]], [[0.0]]]))
    motion = solved(path, lift(80.0, Friction(6.0, 0.0)))
    up, down = (80 - 6) / 5 - 9.81, (80 + 6) / 5 + 9.81
    assert motion.trajectory.duration == pytest.approx((2 * 3.0 * (1 / up + 1 / down)) ** 0.5, rel=1e-6)


def test_viscous_friction_of_a_lift_in_closed_form():
    """m a = F - m g - v sd upwards; braking counts on no help of friction beyond the chord."""
    path = PiecewisePolynomial([0.0, 1.0], np.array([[[3.0]], [[0.0]]]))
    robot = lift(80.0, Friction(0.0, 4.0))
    motion = solved(path, robot)
    used = shares(motion.trajectory, robot)
    assert np.abs(used).max() <= 1 + 1e-6
    terminal, rate = (80 - 49.05) / 4.0, 4.0 / 5.0
    t = np.linspace(0, 3, 300_001)
    speed = terminal * (1 - np.exp(-rate * t))
    rise = terminal * (t - (1 - np.exp(-rate * t)) / rate)
    brake = speed**2 / (2 * (80 / 5 + 9.81))  # without any help of friction
    turn = int(np.argmax(rise + brake >= 3.0))
    slowest = t[turn] + speed[turn] / (80 / 5 + 9.81)
    assert slowest * 0.9 < motion.trajectory.duration <= slowest * (1 + 3e-3)


def test_rows_are_inverse_dynamics_along_the_path():
    """a u + b x + g is the effort of q(s(t)) with sd^2 = x and sdd = u."""
    robot = arm("panda", mass=2.0, friction=Friction(1.5, 0.0))
    path, _ = spline_of(robot, 3)
    rng, dynamics = np.random.default_rng(0), InverseDynamics(robot)
    s = rng.uniform(0, 1, 9)
    constraint = EffortConstraint(dynamics, path, robot.limits.effort, robot.limits.velocity)
    rows = constraint.rows(s, "right")
    x, u = rng.uniform(0.1, 4, (9, 1)), rng.normal(size=(9, 1))
    q, first, second = path.evaluate_orders(s, (0, 1, 2)).transpose(1, 0, 2)
    efforts = dynamics.effort(q, first * np.sqrt(x), first * u + second * x)
    limits = robot.limits.effort[:, 1]
    wanted = np.concatenate([limits - efforts, limits + efforts], axis=1)
    np.testing.assert_allclose(rows.c - rows.a * u - rows.b * x, wanted, rtol=1e-9, atol=1e-9)
    again = constraint.rows(s, "left")
    np.testing.assert_allclose(again.b, rows.b, rtol=1e-12, atol=1e-12)


def test_viscous_rows_are_on_the_safe_side():
    robot = arm("ur5", velocity=3.0, friction=Friction(0.0, 6.0))
    path, _ = spline_of(robot, 3)
    dynamics, s = InverseDynamics(robot), np.linspace(0.02, 0.98, 25)
    q, first, second = path.evaluate_orders(s, (0, 1, 2)).transpose(1, 0, 2)
    cap = 3.0 / np.abs(first).max(axis=1)
    limits = robot.limits.effort[:, 1]
    for speed in (None, lambda s: 0.3 + s):
        rows = EffortConstraint(dynamics, path, robot.limits.effort, robot.limits.velocity, speed).rows(
            s, "right"
        )
        assert (rows.c > 0).all()
        for share in (0.01, 0.3, 0.7, 1.0):
            x = (share * cap[:, None]) ** 2
            efforts = dynamics.effort(q, first * np.sqrt(x), second * x)
            left = np.concatenate([limits - efforts, limits + efforts], axis=1)
            assert (rows.c - rows.b * x <= left + 1e-9).all()


def test_excess_is_the_share_of_what_gravity_leaves():
    robot = lift(80.0)
    path = PiecewisePolynomial([0.0, 1.0], np.array([[[3.0]], [[0.0]]]))
    law = LawPieces(np.array([0.1]), np.array([[2.0], [0.0], [0.0]]))  # sdd = 4, so qdd = 12
    excess = EffortConstraint(
        InverseDynamics(robot), path, robot.limits.effort, robot.limits.velocity
    ).excess(law)
    assert excess[:, 0] == pytest.approx([0.0, 60.0 / (80.0 - 49.05)])


def test_gravity_over_the_limit_is_named():
    robot = lift(49.0)
    path = PiecewisePolynomial([0.0, 1.0], np.array([[[3.0]], [[0.0]]]))
    constraint = EffortConstraint(InverseDynamics(robot), path, robot.limits.effort, robot.limits.velocity)
    with pytest.raises(HeldOverLimitError, match=r"joint 0 is held with 49\.05, its limit is 49"):
        constraint.rows(np.array([0.5]), "right")
    with pytest.raises(
        PlanningError,
        match=r"gravity alone takes 49\.05 N of lift .* 0\.05 N more than its effort limit of 49 N",
    ):
        solved(path, robot)


def job(**fields):
    start, via, last = UR5_POINTS
    move = {"planner": "time_optimal", "through": [{"joints": via}], "to": {"joints": last}}
    return {
        "version": 1,
        "robot": {"urdf": str(MODELS / "ur5.urdf"), "tip": "ee_link"},
        "limits": {"velocity": 3.14, "effort": "robot"},
        "start": {"joints": start},
        "moves": [{**move, **fields}],
    }


@cache
def planned_job():
    return plan(job())


def test_jobs_need_no_acceleration_limits_then():
    planned = planned_job()
    assert planned.verdict.passed
    (efforts,) = planned.verdict.efforts
    assert 0.999 <= efforts.share() <= 1 + 1e-6
    without = job()
    del without["limits"]["effort"]
    with pytest.raises(MissingLimitError, match="time_optimal needs a limit on the acceleration"):
        plan(without)


@pytest.mark.parametrize(
    "path", [{"path": "polyline", "corner": 0.1}, {"path": "polyline"}, {"rule": "quintic"}]
)
def test_other_paths(path):
    planned = plan(job(**path))
    assert planned.verdict.passed
    assert 0.99 <= planned.verdict.efforts[0].share() <= 1 + 1e-6


def test_ends_in_motion():
    given = job()
    given["moves"][0]["to"]["velocity"] = [0.1, -0.1, 0.2, 0.1, -0.2, 0.3]
    given["moves"].append({"planner": "quintic", "to": {"joints": UR5_POINTS[0]}, "duration": 3})
    planned = plan(given)
    assert planned.verdict.passed


def test_a_payload_slows_it_down():
    light, heavy = planned_job(), job()
    heavy["moves"].insert(0, {"attach": {"mass": 5}})
    loaded = plan(heavy)
    assert loaded.verdict.passed
    assert loaded.trajectory.duration > 1.01 * light.trajectory.duration


@pytest.mark.parametrize(
    "limits",
    [{"velocity": 3.14, "effort": "robot"}, {"velocity": 3.14, "acceleration": 8, "effort": "robot"}],
)
def test_a_line_of_the_tool(limits):
    given = job()
    given["limits"] = limits
    given["start"] = {"joints": [0.3, -1.2, 1.8, -2.1, -1.5, 0.2]}
    given["moves"] = [
        {"attach": {"mass": 4}},
        {
            "planner": "line",
            "to": {"from": "there", "offset": {"xyz": [0.0, 0.0, 0.15]}},
            "law": {"shape": "time_optimal"},
        },
    ]
    planned = read_line(given)
    assert planned.verdict.passed
    assert planned.verdict.efforts[1].share() <= 1 + 1e-6


def read_line(given):
    from trajcli.kinematics.forward import forward

    robot = robot_of_urdf((MODELS / "ur5.urdf").read_bytes(), "ur5", tip="ee_link").robot
    pose = forward(robot, given["start"]["joints"])
    given["points"] = {"there": {"matrix": pose.tolist()}}
    return plan(given)


def test_phases_name_the_efforts_that_bind():
    """A lift is at its upper limit until it switches, and at its lower one from there on."""
    given = {
        "version": 1,
        "robot": {
            "convention": "standard",
            "joints": [
                {
                    "name": "lift",
                    "type": "prismatic",
                    "link": {"mass": 5, "com": [0, 0, 0], "inertia": [0] * 6},
                }
            ],
        },
        "limits": {"velocity": 50, "effort": 80},
        "start": {"joints": [0]},
        "moves": [{"planner": "time_optimal", "through": [{"joints": [1]}], "to": {"joints": [3]}}],
    }
    planned = plan(given)
    first, second = planned.moves[0].planned.phases
    up, down = 80 / 5 - 9.81, 80 / 5 + 9.81
    switch = (2 * 3.0 * down / (up * (up + down))) ** 0.5
    assert (first.name, second.name) == ("effort +", "effort -")
    assert first.end == pytest.approx(switch, rel=1e-3)
    assert second.start == pytest.approx(switch, rel=1e-3)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("excess", "kept"), [(2e-7, True), (2e-6, False), (3e-5, False)])
def test_a_motion_over_its_efforts_by_more_than_half_of_what_checks_allow_is_made_longer(excess, kept, sign):
    """A solution that comes out above the limit of a slide, by so much: the force falls with the square of the time."""
    mass, limit = 5.0, 40.0
    joint = Joint("lift", "prismatic", link=LinkInertia(mass, (0.0, 0.0, 0.0), (0.0,) * 6))
    bounds = np.array([[-limit, np.inf] if sign < 0 else [-np.inf, limit]])
    robot = Robot("lift", (joint,), replace(unlimited(1), effort=bounds), "standard", np.eye(4), np.eye(4))
    robot = replace(robot, gravity=np.zeros(3))
    path = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([1.0, 0.0])[:, None, None])
    fastest = limit / mass * (1.0 + excess)
    motion = time_optimal(path, [[-np.inf, np.inf]], [[-fastest, fastest]])
    made = solved_within_efforts(path, robot, lambda _: motion)
    longer = made.trajectory.duration / motion.trajectory.duration
    used = sign * mass * made.trajectory.evaluate(np.linspace(0, made.trajectory.end, 4001), 2)
    assert used.max() / limit == pytest.approx(1.0 + (excess if kept else 0.0), abs=6e-7)
    assert (longer == 1.0) == kept
    assert longer == pytest.approx(1.0 if kept else (1.0 + excess) ** 0.5, abs=4e-7)
