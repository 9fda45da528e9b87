"""Parameters by name: which there are, in which order, their values, and between which axes beta stands for d."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from arms import arm, configurations, measured
from product_of_rows import difference_jacobian
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.kinematics.calibration.measurements import MeasuredKind, Measurements
from trajcli.kinematics.calibration.measuring_plan import attainable_rank, measuring_plan
from trajcli.kinematics.calibration.parameters import (
    all_parameters,
    parallel_rows,
    parse_parameters,
    units_of,
    values_of,
)
from trajcli.kinematics.inverse.target import partial_target

DEGREE = np.pi / 180


@pytest.mark.parametrize("convention", ["standard", "modified"])
@pytest.mark.parametrize(
    ("alpha", "beta", "parallel"),
    [
        (4.9, 0.0, True),
        (5.1, 0.0, False),
        (-4.9, 0.0, True),
        (175.1, 0.0, True),
        (174.9, 0.0, False),
        (4.0, 4.0, False),
    ],
)
def test_axes_within_five_degrees_are_parallel_either_way(alpha, beta, parallel, convention) -> None:
    """The angle between two axes of a row has the cosine cos(alpha) cos(beta); a slide is an axis, too."""
    robot = arm("scara", convention)
    row = 1
    joints = list(robot.joints)
    joints[row] = replace(joints[row], alpha=alpha * DEGREE, beta=beta * DEGREE)
    assert (row in parallel_rows(replace(robot, joints=tuple(joints)))) == parallel


def test_what_is_named_in_any_order_stands_in_that_of_the_robot() -> None:
    robot = arm("puma")
    names = [
        str(each) for each in parse_parameters(robot, " tool.rz, j2.alpha ,j2.d,base.rx,tool.x, j1 ,base.z")
    ]
    row = ["j1.theta", "j1.d", "j1.a", "j1.alpha"]
    assert names == ["base.z", "base.rx", *row, "j2.d", "j2.alpha", "tool.x", "tool.rz"]
    beta = [str(each) for each in parse_parameters(robot, "j2")]
    assert beta == ["j2.theta", "j2.a", "j2.alpha", "j2.beta"]
    rows = parse_parameters(robot, "dh")
    assert len(rows) == 24
    every = all_parameters(robot)
    assert set(parse_parameters(robot, "all")) == set(every)
    assert {each for each in every if each.joint is not None} == set(rows)
    assert len(every) == 36


def test_joints_may_be_named_like_frames_and_with_dots() -> None:
    robot = arm("puma")
    names = ("base", "arm.2", "j3", "j4", "j5", "tool")
    joints = tuple(replace(joint, name=name) for joint, name in zip(robot.joints, names, strict=True))
    robot = replace(robot, joints=joints)
    for word in ("base", "tool"):
        with pytest.raises(InputError, match=f"'{word}' is a joint"):
            parse_parameters(robot, word)
    found = parse_parameters(robot, "base.theta,base.x,arm.2.a,tool.d,tool.rx")
    assert [(each.owner, each.name, each.joint) for each in found] == [
        ("base", "x", None),
        ("base", "theta", 0),
        ("arm.2", "a", 1),
        ("tool", "d", 5),
        ("tool", "rx", None),
    ]


def test_values_are_those_of_the_robot_and_turns_those_from_the_nominal_one() -> None:
    """Of frames that are turned alike exactly zero, whatever their rotation is."""
    nominal = arm("puma")
    base = np.eye(4)
    base[:3, :3], base[:3, 3] = Rotation.from_rotvec([0.3, -0.4, 0.5]).as_matrix(), [0.1, 0.2, 0.3]
    nominal = replace(nominal, base=base)
    moved = base.copy()
    moved[0, 3] += 0.01
    robot = replace(nominal, base=moved)
    parameters = all_parameters(robot)
    values = dict(zip(map(str, parameters), values_of(robot, nominal, parameters).tolist(), strict=True))
    assert [values[f"base.{name}"] for name in ("rx", "ry", "rz")] == [0.0, 0.0, 0.0]
    np.testing.assert_allclose(
        [values[f"base.{name}"] for name in "xyz"], [0.11, 0.2, 0.3], rtol=0, atol=1e-15
    )
    assert values["j1.d"] == 0.6718
    assert units_of(parse_parameters(robot, "j1,base.z,base.rz"), 0.4).tolist() == [
        0.4,
        1.0,
        1.0,
        0.4,
        0.4,
        1.0,
    ]


def o1(rows: np.ndarray, rank: int) -> float:
    """Return the index by its definition, of rows (N, m, p)."""
    values = np.linalg.svd(rows.reshape(-1, rows.shape[-1]), compute_uv=False)[:rank]
    return float(np.exp(np.log(values).mean()) / np.sqrt(len(rows)))


def test_angles_count_like_the_given_length_in_rows_and_in_parameters() -> None:
    robot, length = arm("scara"), 0.3
    parameters = parse_parameters(robot, "j1.a,j2.a,j2.theta,j1.alpha")
    q = configurations(robot, 12, np.random.default_rng(3))
    plan = measuring_plan(robot, q, parameters, 4, length)
    rows = difference_jacobian(robot, q[plan.chosen], parameters) * np.repeat([1.0, length], 3)[:, None]
    rows = rows * units_of(parameters, length)
    values = np.linalg.svd(rows.reshape(-1, 4), compute_uv=False)
    assert plan.index == pytest.approx(o1(rows, 4), rel=1e-6)
    assert plan.smallest == pytest.approx(values[-1], rel=1e-6)
    assert plan.condition == pytest.approx(values[0] / values[-1], rel=1e-6)


def test_all_candidates_may_be_wanted_and_are_chosen_once_each() -> None:
    robot = arm("scara")
    q = configurations(robot, 6, np.random.default_rng(4))
    for first in range(6):  # even if the first one, twice, would tell more than another
        plan = measuring_plan(
            robot, np.roll(q, first, axis=0), parse_parameters(robot, "j1.a,j2.theta"), 6, 1.0
        )
        assert sorted(plan.chosen.tolist()) == list(range(6))
    with pytest.raises(InputError, match=r"at least 2 measurements"):
        measuring_plan(robot, q, parse_parameters(robot, "j1.a,j2.a,j2.theta,tool.z"), 1, 1.0, "position")


@pytest.mark.parametrize("axis", ["x", "z"])
def test_a_rank_counts_slides_that_move_and_every_kind_of_measurement(axis: str) -> None:
    """Heights alone and places in the plane alone; where an axis of the base leans a slide moves the tool aside."""
    robot = arm("scara")
    rng = np.random.default_rng(5)
    q = configurations(robot, 6, rng)
    poses = measured(robot, q, {}).kinds[0].target.poses
    plane = partial_target(poses[:3, :3, 3], fixed=(True, True, False))
    other = partial_target(poses[3:, :3, 3], fixed=(False, False, True))
    both = Measurements(q, (MeasuredKind(np.arange(3), plane), MeasuredKind(np.arange(3, 6), other)))
    parameters = parse_parameters(robot, f"base.{axis},base.r{axis},base.y,base.ry,j1.a,j2.a,j3.alpha")
    wide = configurations(robot, 200, rng) * [1.0, 1.0, 5.0, 1.0]
    rows = difference_jacobian(robot, wide, parameters)
    for kinds, kept in ((both, [0, 1, 2]), (replace(both, joints=q[:3], kinds=both.kinds[:1]), [0, 1])):
        values = np.linalg.svd(rows[:, kept].reshape(-1, len(parameters)), compute_uv=False)
        assert attainable_rank(robot, kinds, parameters, 1.0) == int((values > 1e-6 * values[0]).sum())
