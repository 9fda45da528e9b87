"""What answers say beside joints: tool axes that no joint turns, whether another orientation helps, joints that are free."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from inverse_arms import arm, gap
from tiers import few

from trajcli.errors import InputError
from trajcli.geometry.rotation import exp
from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.solve import reached_if_turned, solve
from trajcli.kinematics.inverse.target import IkTarget, partial_target, pose_target
from trajcli.kinematics.robot import Robot

PLACE = np.array([0.35, 0.2, 0.3])


def turned_down(pose: np.ndarray) -> IkTarget:
    return partial_target(pose[:3, 3], direction=-pose[:3, 2])


def place_of(pose: np.ndarray) -> IkTarget:
    return partial_target(pose[:3, 3], fixed=(True, False, False))


ON_ITS_SIDE = np.array(
    [[0.0, 0.0, 1.0, 0.0], [1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]]
)
"""T_world_base of an arm whose z axis is the world's x axis."""


def lying(robot: Robot) -> Robot:
    return replace(robot, base=ON_ITS_SIDE)


@pytest.mark.parametrize(("axis", "unturned"), few([("z", "z"), ("x", None), ("y", None)], 2))
@pytest.mark.parametrize(
    "given", few([{"direction": [1.0, 0.0, 0.0]}, {"direction": [0.0, 0.0, -1.0]}, {"pitch": 0.3}], 2)
)
def test_an_axis_that_no_joint_turns_is_named(given: dict, axis: str, unturned: str | None) -> None:
    """That of a SCARA's tool along its own joints, whether or not it can be met."""
    found = solve(arm("SCARA"), partial_target(PLACE, tool_axis=axis, **given))  # type: ignore[arg-type]
    assert found.fixed_axis == unturned
    assert solve(arm("UR"), partial_target(PLACE, tool_axis=axis, **given)).fixed_axis is None  # type: ignore[arg-type]


def test_a_yaw_of_an_axis_that_stays_vertical_is_refused_and_of_one_that_lies_is_not() -> None:
    with pytest.raises(InputError, match="always vertical and has no yaw") as caught:
        solve(arm("SCARA"), partial_target(PLACE, yaw=0.3))
    assert caught.value.problems[0].hint == "say which axis of the tool heads there, with `tool_axis: x or y`"
    solve(arm("SCARA"), partial_target(PLACE, yaw=0.3, tool_axis="x"))
    assert solve(lying(arm("SCARA")), partial_target(PLACE, yaw=0.3)).fixed_axis == "z"
    solve(arm("UR"), partial_target(PLACE, yaw=0.3))


def test_another_orientation_helps_where_the_coordinates_that_count_are_within_reach() -> None:
    flat = arm("planar 2R")
    above = np.array([0.3, 0.2, 5.0])
    assert reached_if_turned(flat, partial_target(above, fixed=(True, True, False), direction=[0, 0, 1.0]))
    assert not reached_if_turned(flat, partial_target(above, direction=[0, 0, 1.0]))
    assert not reached_if_turned(flat, partial_target([0.3, 0.2, 0.0]))  # it has none, and is met
    assert not reached_if_turned(flat, partial_target([3.0, 0.2, 0.0], direction=[0, 0, 1.0]))
    for alone in ({"direction": [1.0, 0, 0]}, {"pitch": 0.2}, {"rotation": np.diag([1.0, -1, -1])}):
        assert reached_if_turned(
            arm("SCARA"), partial_target(**alone)
        )  # nothing is left that could be missed


@pytest.mark.parametrize("name", ["planar 2R", "planar RP"])
@pytest.mark.parametrize("side", [False, True])
def test_a_coordinate_across_the_plane_of_an_arm_need_not_count(name: str, side: bool) -> None:
    """Wherever its base has that plane: both answers are those of the whole position, by the closed form."""
    robot = lying(arm(name)) if side else arm(name)
    q = np.array([0.7, 0.5])
    position = forward(robot, q[None])[0, :3, 3]
    plane_normal = robot.base[:3, :3] @ (
        np.array([0.0, 0.0, 1.0]) if name == "planar 2R" else normal_of(robot)
    )
    across = int(np.abs(plane_normal).argmax())
    fixed = tuple(k != across for k in range(3))
    moved = position + 7.0 * np.eye(3)[across]
    found = solve(robot, partial_target(moved, fixed=fixed))  # type: ignore[arg-type]
    whole = solve(robot, partial_target(position))
    assert found.method == whole.method
    assert found.count == whole.count == 2
    assert min(gap(robot, each, q) for each in found.joints[found.valid]) < 1e-9
    assert np.abs(found.joints - whole.joints).max() < 1e-9


def normal_of(robot: Robot) -> np.ndarray:
    """Return the normal of the plane in which an arm of two joints moves, in its base."""
    bare = replace(robot, base=np.eye(4))
    rng = np.random.default_rng(3)
    points = forward(bare, rng.uniform(0.1, 1.0, (20, 2)))[:, :3, 3]
    return np.linalg.svd(points - points.mean(axis=0))[2][2]


def test_one_coordinate_that_counts_leaves_an_arm_answers_by_search() -> None:
    """Of two that do not count one lies in the plane of the arm."""
    robot = arm("planar 2R")
    for fixed in ((True, False, False), (False, True, False)):
        found = solve(robot, partial_target([0.3, 0.3, 9.0], fixed=fixed), near=[0.1, 0.2])  # type: ignore[arg-type]
        assert found.valid.any()
        reached = forward(robot, found.joints[found.valid])[:, :3, 3]
        assert np.abs(reached[:, fixed.index(True)] - 0.3).max() < 1e-9
        grid = np.stack(np.meshgrid(*[np.linspace(-np.pi, np.pi, 401)] * 2), axis=-1).reshape(-1, 2)
        meet = np.abs(forward(robot, grid)[:, fixed.index(True), 3] - 0.3) < 5e-3
        nearest = np.linalg.norm(grid[meet] - [0.1, 0.2], axis=1).min()
        assert np.linalg.norm(found.joints[found.valid] - [0.1, 0.2], axis=1).min() <= nearest + 0.02


def test_a_yaw_of_an_axis_that_is_vertical_at_zero_but_turned_by_a_wrist_is_no_fault() -> None:
    robot = arm("wrist over SCARA")
    home = forward(robot, np.zeros((1, 6)))[0, :3, :3]
    vertical = [axis for k, axis in enumerate("xyz") if abs(home[2, k]) > 0.999]
    assert vertical
    for axis in vertical:
        assert solve(robot, partial_target(PLACE, yaw=0.3, tool_axis=axis)).fixed_axis is None  # type: ignore[arg-type]


class Asked(Exception):  # noqa: N818
    """What an answer was asked for with."""


UR = arm("UR").joints
NUMERIC = replace(arm("UR"), joints=(*UR[:4], replace(UR[4], a=0.05), UR[5]))  # axes 5 and 6 do not meet
ROUTES = {
    "seven joints": ("panda", pose_target, "searched.by_held_joint"),
    "no closed form": (NUMERIC, pose_target, "searched.by_search"),
    "a direction of six joints": (arm("UR"), turned_down, "partial_targets.by_postures"),
    "a place of three in a plane": (arm("planar 3R"), place_of, "searched.by_search"),
    "suspects": (arm("wrist over elbow"), pose_target, "searched.resolve_suspects"),
}


@pytest.mark.parametrize(("robot", "target_of", "route"), ROUTES.values(), ids=ROUTES)
def test_tolerance_and_the_configuration_to_be_near_to_reach_whoever_answers(
    robot: Robot | str, target_of: Any, route: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = load_robot(robot) if isinstance(robot, str) else robot
    near = np.zeros(len(asked.joints))
    near[0], near[-1] = 0.25, 0.5

    def answered(*arguments: Any) -> Any:
        raise Asked(arguments)

    monkeypatch.setattr(f"trajcli.kinematics.inverse.{route}", answered)
    with pytest.raises(Asked) as caught:
        solve(asked, target_of(forward(asked, near)), near, tolerance=1e-4)
    *_, given, tolerance = caught.value.args[0]
    assert tolerance == 1e-4
    np.testing.assert_array_equal(given, [near])


def test_a_tolerance_is_a_positive_number() -> None:
    for tolerance in (0.0, -1e-9, np.nan):
        with pytest.raises(InputError, match="the tolerance must be positive"):
            solve(arm("UR"), np.eye(4), tolerance=tolerance)


@pytest.mark.parametrize("name", ["elbow and pitch", "RRP Stanford"])
def test_a_pose_that_is_missed_by_less_than_the_tolerance_is_met(name: str) -> None:
    """Turned by a millionth about an axis about which the arm cannot turn its tool."""
    robot = arm(name)
    q = np.array([0.3, 0.6, -0.9, 0.2][: len(robot.joints)])
    pose = forward(robot, q)
    axis = pose[:3, :3] @ np.array([0.6, 0.0, 0.8])
    pose[:3, :3] = exp(1e-6 * axis) @ pose[:3, :3]
    assert not solve(robot, pose).valid.any()
    found = solve(robot, pose, q, tolerance=1e-5)
    np.testing.assert_allclose(found.joints[found.nearest(q)], q, atol=1e-5)


def test_an_arm_in_a_slanted_plane_is_searched_where_its_height_is_left_free() -> None:
    """Twenty degrees are not the plane of x and y: the height of the target says nothing of x and y."""
    slanted = np.eye(4)
    slanted[:3, :3] = exp(np.array([np.radians(20.0), 0.0, 0.0]))
    robot = replace(arm("planar 2R"), base=slanted)
    q = np.array([0.4, 0.9])
    position = forward(robot, q)[:3, 3] + [0.0, 0.0, 5.0]
    found = solve(robot, partial_target(position, fixed=(True, True, False)), q)
    np.testing.assert_allclose(found.joints[found.nearest(q)], q, atol=1e-9)


def test_another_orientation_is_no_help_where_the_place_is_reached_outside_the_limits_alone() -> None:
    """Three links that are almost stretched reach it with the tool outward alone, and with the first joint at 0.1 rad."""
    free = arm("planar 3R")
    straight = -free.joints[1].theta
    pose = forward(free, np.array([0.1, straight + 0.2, 0.1]))
    pose[:3, :3] = exp(np.array([0.0, 0.0, np.pi])) @ pose[:3, :3]
    assert not solve(free, pose).valid.any()
    assert reached_if_turned(free, pose_target(pose))
    bounds = free.limits.position.copy()
    bounds[0] = 1.5, 2.0
    held = replace(free, limits=replace(free.limits, position=bounds))
    assert not reached_if_turned(held, pose_target(pose))
