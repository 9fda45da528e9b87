"""Bounds of laws along courses, against the inequalities of each joint and of the tool one by one."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np
import pytest
from tiers import few

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.third_order.jerk import LawJerkConstraint
from trajcli.geometry.rotation import axis_angle_from_matrix
from trajcli.job.read import job_from_text
from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Limits, ToolLimits
from trajcli.planners.course import Course, JointCourse, PathRates, joint_line, law_bounds
from trajcli.planners.tool_constraint import ToolJerkConstraint
from trajcli.planners.tool_path.course import ToolCourse
from trajcli.planning.plan import plan_job

INFINITE = np.array([-np.inf, np.inf])
CUBIC = [[0.2, -0.5], [-0.6, 0.4], [0.9, 0.5], [0.1, 1.0]]


def drawn(rng: np.random.Generator, joints: int) -> tuple[np.ndarray, Limits]:
    """Return q', q'' and q''' of joints at one place, and limits that differ by direction; some joints rest."""
    rates = rng.normal(size=(3, 1, joints))
    rates[0] *= rng.choice([0.0, 1.0, 1.0], size=joints)
    rates[0, 0, 0] = rng.choice([-0.7, 0.7])
    rows = rng.uniform([-3, 0.5], [-0.5, 3], size=(3, joints, 2))
    return rates, Limits(np.tile(INFINITE, (joints, 1)), *rows)


def interval(slopes: np.ndarray, offsets: np.ndarray, rows: np.ndarray) -> tuple[float, float]:
    """Return between which u all of low <= slope u + offset <= high hold: each is an interval or everything."""
    low, high = -np.inf, np.inf
    for slope, offset, (least, most) in zip(slopes, offsets, rows, strict=True):
        if slope:
            ends = sorted([(least - offset) / slope, (most - offset) / slope])
            low, high = max(low, ends[0]), min(high, ends[1])
    return low, high


@pytest.mark.parametrize("seed", few(range(60), 25))
def test_a_law_has_the_room_that_the_inequalities_of_its_joints_leave(seed: int) -> None:
    """A bend has nine tenths of an acceleration and of a jerk at most, a law at least a tenth of a jerk."""
    rng = np.random.default_rng(seed)
    joints, limits = drawn(rng, int(rng.integers(1, 4)))
    first, second, third = joints[:, 0]
    least = np.abs(limits.jerk).min(axis=1)
    possible = [
        *(
            row[1] / slope if slope > 0 else row[0] / slope
            for slope, row in zip(first, limits.velocity, strict=True)
            if slope
        ),
        *(0.9 * np.abs(limits.acceleration).min(axis=1) / np.abs(second)) ** 0.5,
        *(0.9 * least / np.abs(third)) ** (1 / 3),
    ]
    top = min(possible)
    states = np.array(list(product([0.0, 0.5 * top, top, 2 * top], [-0.4, 0.0, 0.7])))
    found = law_bounds(PathRates(joints, None), limits, ToolLimits())(states)
    assert found[:, 1] == pytest.approx(top)
    assert np.array_equal(found[:, 0], -found[:, 1])
    for (speed, change), row in zip(states, found, strict=True):
        v = min(speed, top)
        assert row[2:4] == pytest.approx(interval(first, second * v**2, limits.acceleration))
        assert row[2] < 0 < row[3]
        used = 3 * second * v * change + third * v**3
        sides = [np.maximum(least + sign * np.sign(first) * used, 0.1 * least) for sign in (1, -1)]
        expected = [min(side[first != 0] / np.abs(first[first != 0])) for side in sides]
        assert row[4:] == pytest.approx([-expected[0], expected[1]])


@pytest.mark.parametrize("seed", few(range(30), 12))
def test_a_law_has_the_room_that_the_tool_leaves(seed: int) -> None:
    """Along and across its path accelerations add up as sides of a right angle do."""
    rng = np.random.default_rng(seed)
    tool = rng.uniform(0.3, 2.0, size=(4, 2))
    speed, acceleration, jerk, angular_speed, angular_acceleration = rng.uniform(0.5, 2.0, size=5)
    tcp = ToolLimits(speed, acceleration, jerk, angular_speed, angular_acceleration)
    free = Limits(*np.tile(INFINITE, (4, 1, 1)))
    rates = PathRates(np.concatenate([np.ones((1, 2, 1)), np.zeros((2, 2, 1))]), tool)
    top = min(
        speed / tool[0].max(),
        angular_speed / tool[2].max(),
        np.sqrt(0.9 * acceleration / tool[1].max()),
        np.sqrt(0.9 * angular_acceleration / tool[3].max()),
    )
    states = np.array([[0.0, 0.0], [0.6 * top, 0.3], [top, -0.3]])
    found = law_bounds(rates, free, tcp)(states)
    assert found[:, 1] == pytest.approx(top)
    for v, row in zip(states[:, 0], found, strict=True):
        linear = np.sqrt(acceleration**2 - (tool[1] * v**2) ** 2) / tool[0]
        angular = np.sqrt(angular_acceleration**2 - (tool[3] * v**2) ** 2) / tool[2]
        most = min(*linear, *angular)
        assert row[2:4] == pytest.approx([-most, most])
        assert row[4:] == pytest.approx([-jerk / tool[0].max(), jerk / tool[0].max()])
    for name, least in (("speed", speed / tool[0].max()), ("angular_speed", angular_speed / tool[2].max())):
        alone = ToolLimits(**{name: getattr(tcp, name)})
        assert law_bounds(rates, free, alone)(states[:1])[0, 1] == pytest.approx(least)


def bent(**tcp: float) -> JointCourse:
    """Return a cubic path of two joints of planar2r, s from 0 to 2."""
    robot = load_robot("planar2r")
    limits = Limits(
        np.tile(INFINITE, (2, 1)),
        np.array([[-1.0, 2.0], [-2.0, 1.5]]),
        np.array([[-4.0, 3.0], [-5.0, 6.0]]),
        np.array([[-40.0, 40.0], [-30.0, 60.0]]),
        ToolLimits(**tcp),
    )
    curve = PiecewisePolynomial(np.array([0.0, 2.0]), np.array(CUBIC)[:, None, :])
    return JointCourse(curve, replace(robot, limits=limits))


@pytest.mark.parametrize("tcp", [{}, {"speed": 0.4, "angular_acceleration": 2.0}])
def test_typical_bounds_are_geometric_means_of_those_at_nine_places(tcp: dict[str, float]) -> None:
    course = bent(**tcp)
    rows = [course.bounds(course.rates(np.array([s])))(np.zeros((1, 2)))[0] for s in np.linspace(0.3, 1.7, 9)]
    sizes = np.prod(np.abs(rows), axis=0) ** (1 / 9)
    assert course.typical_bounds(0.3, 1.7) == pytest.approx(sizes * [-1, 1, -1, 1, -1, 1])
    line = joint_line(np.array([0.1, 0.2]), np.array([1.1, 0.7]), course.robot)
    assert line.tool.length == 1.0
    assert line.uniform == (not tcp)
    assert line.straight
    assert not course.straight
    corner = PiecewisePolynomial(
        np.array([0.0, 1.0, 2.0]), np.array([[[1.0, 0.5], [-1.0, 0.5]], [[0, 0], [1.0, 0.5]]])
    )
    assert not JointCourse(corner, course.robot).straight


def rates_by_differences(course: Course, s: float) -> np.ndarray:
    """Return the sizes of p', p'', w and w' from poses nearby."""
    h = 1e-4
    poses = forward(course.robot, course.curve.evaluate(s + h * np.arange(-2, 3)))
    places = poses[:, :3, 3]
    steps = [axis_angle_from_matrix(poses[k + 1, :3, :3] @ poses[k, :3, :3].T) for k in range(4)]
    turns = np.array([step.angle * np.asarray(step.axis) for step in steps]) / h
    first, second = (places[3] - places[1]) / (2 * h), (places[3] - 2 * places[2] + places[1]) / h**2
    vectors = first, second, (turns[1] + turns[2]) / 2, (turns[2] - turns[1]) / h
    return np.array([np.linalg.norm(vector) for vector in vectors])


def test_rates_of_the_tool_are_differences_of_its_poses() -> None:
    course, s = bent(speed=1.0), np.array([0.2, 0.9, 1.8])
    expected = np.stack([rates_by_differences(course, each) for each in s.tolist()], axis=1)
    assert course.rates(s).tool == pytest.approx(expected, rel=1e-5, abs=1e-6)
    assert bent().rates(s).tool is None
    orders = [course.curve.evaluate(s, order) for order in (1, 2, 3)]
    assert course.rates(s).joints == pytest.approx(np.array(orders))


def test_what_limits_the_tool_limits_laws_along_a_course() -> None:
    free, limited = bent(), bent(acceleration=0.5)
    assert free.constraints(free.curve) == ()
    (constraint,) = limited.constraints(limited.curve)
    assert constraint.bounds_sdd
    assert limited.reference(limited.curve) is None
    robot = load_robot("fr3")  # whose velocities are limited by position, too
    middle = robot.limits.position.mean(axis=1)
    (approach,) = joint_line(middle, middle + 0.1, robot).constraints(
        joint_line(middle, middle + 0.1, robot).curve
    )
    assert np.isfinite(approach.rows(np.array([0.5]), "left").cap).all()


def test_the_tool_of_a_path_of_joints_has_the_derivatives_of_either_side_of_a_break() -> None:
    """One that bends at s = 1, and an acceleration of the tool along its path as well as across."""
    pieces = np.array([[[0.4, 0.0], [-0.8, 0.6]], [[1.0, 0.5], [1.0, -0.5]], [[0.1, 1.0], [1.5, 1.5]]])
    course = JointCourse(PiecewisePolynomial(np.array([0.0, 1.0, 2.0]), pieces), bent(acceleration=2.0).robot)
    assert course.curve.evaluate(np.array([1.0 - 1e-12]))[0] == pytest.approx([1.5, 1.5])
    at, h = np.array([1.0]), 1e-4
    for side, sign in (("left", -1), ("right", 1)):
        places = forward(course.robot, course.curve.evaluate(1.0 + sign * h * np.arange(4)))[:, :3, 3]
        first = sign * (-11 * places[0] + 18 * places[1] - 9 * places[2] + 2 * places[3]) / (6 * h)
        second = (2 * places[0] - 5 * places[1] + 4 * places[2] - places[3]) / h**2
        _, one, two = course.tool.evaluate(at, side)
        assert one[0, :3] == pytest.approx(first, abs=1e-5)
        assert two[0, :3] == pytest.approx(second, abs=1e-3)
        orders = course.tool.derivatives(at, side)
        assert orders[:2, 0, 0] == pytest.approx(np.stack([one[0, :3], two[0, :3]]))
        rows = course.tool_constraint().rows(at, side)
        for change, square in ((0.0, 1.0), (0.7, 0.3), (-0.7, 0.3), (-2.0, 1.0)):
            size = np.linalg.norm(first * change + second * square)
            used = (rows.a * change + rows.b * square)[np.isfinite(rows.c)].max()
            assert size * np.cos(np.pi / 16) - 1e-3 <= used <= size + 1e-3


@pytest.mark.parametrize("name", ["jerk", "angular_jerk"])
def test_either_jerk_of_the_tool_limits_a_path_of_joints(name: str) -> None:
    assert bent(speed=1.0).jerk_constraints == ()
    (constraint,) = bent(**{name: 3.0}).jerk_constraints
    assert isinstance(constraint, ToolJerkConstraint)
    assert constraint.jerk == ((3.0, np.inf) if name == "jerk" else (np.inf, 3.0))


def course_of(move: dict[str, Any], **limits: Any) -> ToolCourse:
    """Return the course of a move of planar2r from (0.35, 0.3) m."""
    job = {
        "version": 1,
        "robot": "planar2r",
        "limits": {"velocity": 3, "acceleration": 8, **limits},
        "start": {"xyz": [0.35, 0.30, 0]},
        "moves": [move],
    }
    (planned,) = plan_job(job_from_text(json.dumps(job))).moves
    course = planned.planner.course(planned.start.position, planned.robot, planned.planned)
    assert isinstance(course, ToolCourse)
    return course


def turning(course: ToolCourse, s: float) -> float:
    """Return by how much the tool of planar2r turns per length: both joints turn it."""
    return abs(float(course.curve.evaluate(s, 1).sum()))


def test_where_limits_of_speed_step_along_a_path_the_lower_ones_count_at_the_step() -> None:
    segments = [
        {"line": {"xyz": [0.30, 0.30, 0]}, "law": {"speed": 0.3, "angular_speed": 0.2}},
        {"line": {"xyz": [0.20, 0.30, 0]}, "law": {"speed": 0.1, "angular_speed": 9.0}},
        {"line": {"xyz": [0.10, 0.30, 0]}, "law": {"speed": 0.2, "angular_speed": 9.0}},
    ]
    law = {"shape": "time_optimal"}
    course = course_of({"planner": "path", "corner": "stop", "segments": segments, "law": law})
    assert course.limits_tool
    assert course.tcp.speed == 0.3
    first, second = course.joints.path.poses.breaks.tolist()
    assert (first, second) == (pytest.approx(0.05), pytest.approx(0.15))
    for s, speed, angular in (
        (0.01, 0.3, 0.2),
        (first, 0.1, 0.2),
        (0.1, 0.1, 9.0),
        (second, 0.1, 9.0),
        (0.2, 0.2, 9.0),
    ):
        rates = course.rates(np.array([s]))
        assert rates.speeds == (pytest.approx(speed), angular)
        assert rates.tool is not None
        assert rates.tool[2, 0] == pytest.approx(turning(course, s), rel=1e-5)
        most = min(speed, angular / turning(course, s))
        assert course.bounds(rates)(np.zeros((1, 2)))[0, 1] == pytest.approx(most, rel=1e-5)
        if s not in (first, second):
            cap = course.tool_constraint().rows(np.array([s]), "right").cap[0]
            assert cap == pytest.approx(most**2, rel=1e-5)
    assert course.limits_along is not None
    assert course.limits_along[0] == 0.3


def test_what_a_law_names_bounds_laws_along_its_line() -> None:
    line = {"planner": "line", "to": {"xyz": [0.20, 0.30, 0]}}
    slowing = course_of({**line, "law": {"speed": 0.5, "acceleration": 2.0, "deceleration": 0.4}})
    assert slowing.limits_along == (0.5, 2.0, 0.4)
    row = slowing.bounds(slowing.rates(np.array([0.05])))(np.zeros((1, 2)))[0]
    assert row[1:4] == pytest.approx([0.5, -0.4, 2.0], rel=0.3)
    assert row[2] == -0.4
    assert slowing.jerk_constraints == ()
    (jerk,) = course_of({**line, "law": {"shape": "time_optimal", "jerk": 5.0}}).jerk_constraints
    assert isinstance(jerk, LawJerkConstraint)
    assert jerk.limit == 5.0
