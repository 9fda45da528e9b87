"""Targets that fix a part of the orientation: closed forms with all answers, and their names."""

from __future__ import annotations

import zlib
from dataclasses import replace

import numpy as np
import pytest
from inverse_arms import arm, gap, random_joints
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError, PlanningError
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.families.choose import method_for
from trajcli.kinematics.inverse.numeric import distinct, search
from trajcli.kinematics.inverse.solutions import check_reachable
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.inverse.target import partial_target
from trajcli.kinematics.robot import Joint, Robot, unlimited

H = np.pi / 2
# arm, what is given, of which tool axis, whether base and tool are arbitrary; then the most answers
KINDS = [
    ("planar 3R", "yaw", "x", False, 2),
    ("planar 3R", "direction", "y", True, 2),
    ("planar 3R", "pitch", "x", True, 4),
    ("planar RPR", "yaw", "y", False, 2),
    ("planar RPR", "direction", "x", True, 2),
    ("SCARA", "yaw", "x", False, 2),
    ("SCARA", "direction", "x", True, 2),
    ("SCARA, slide first", "yaw", "y", False, 2),
    ("elbow and pitch", "pitch", "x", False, 8),
    ("elbow and pitch", "pitch", "y", True, 8),
    ("elbow and pitch", "direction", "x", True, 4),
    ("scorbot", "direction", "x", False, 8),
    ("scorbot", "direction", "y", True, 8),
    ("scorbot", "pitch", "z", False, 8),
    ("scorbot", "pitch", "z", True, 8),
    ("scorbot", "direction", "z", True, 4),
]
IDS = [f"{name}-{kind}-{axis}{'-anyhow' * anyhow}" for name, kind, axis, anyhow, _ in KINDS]


def robot_of(name, rng):
    """Return an arm; of five joints one whose tcp is on axis 5, wherever its base is."""
    if name != "scorbot":
        return arm(name, rng)
    rows = [(0, 0.36, 0.02, H), (0, 0, 0.22, 0), (0, 0, 0.22, 0), (0, 0, 0, H), (0, 0.15, 0, 0)]
    joints = tuple(Joint(f"j{i}", "revolute", *row) for i, row in enumerate(rows))
    base, tool = np.eye(4), np.eye(4)
    if rng is not None:
        base[:3, :3], base[:3, 3] = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3) * 0.1
        tool[2, 3] = 0.07
    return Robot("scorbot", joints, unlimited(5), "standard", base, tool)


def part_of(poses, kind, axis):
    """Return the part of poses' orientation, and the target that fixes it and the position."""
    tool = poses[..., :3, "xyz".index(axis)]
    part = {
        "direction": tool,
        "yaw": np.arctan2(tool[..., 1], tool[..., 0]),
        "pitch": np.arctan2(tool[..., 2], np.hypot(tool[..., 0], tool[..., 1])),
    }[kind]
    return part, partial_target(poses[..., :3, 3], tool_axis=axis, **{kind: part})


def case(name, kind, axis, anyhow, count):
    rng = np.random.default_rng(zlib.crc32(f"{name}{kind}{axis}".encode()))
    robot = robot_of(name, rng if anyhow else None)
    joints = random_joints(robot, rng, count)
    return robot, joints, *part_of(forward(robot, joints), kind, axis)


def missed(poses, position, part, kind, axis):
    """Return by how much poses (N, branches, 4, 4) miss what was asked for: m, and rad or a sine."""
    reached, _ = part_of(poses, kind, axis)
    off = reached - part[:, None]
    turn = np.linalg.norm(off, axis=-1) if kind == "direction" else np.abs(np.angle(np.exp(1j * off)))
    return np.linalg.norm(poses[..., :3, 3] - position[:, None], axis=-1), turn


@pytest.mark.parametrize(("name", "kind", "axis", "anyhow", "most"), KINDS, ids=IDS)
def test_the_closed_form_answers_what_is_fixed(name, kind, axis, anyhow, most):
    robot, joints, part, target = case(name, kind, axis, anyhow, 80)
    found = solve(robot, target, near=joints)
    assert found.method.family == method_for(robot).family
    assert len(found.names) == len(set(map(str, found.names))) == most
    position, turn = missed(forward(robot, found.joints), target.poses[:, :3, 3], part, kind, axis)
    assert max(position[found.valid].max(), turn[found.valid].max()) < 1e-9
    there = np.where(found.valid, gap(robot, found.joints, joints[:, None]), np.inf).min(axis=1)
    assert there.max() < 1e-6
    assert found.singular.sum() == 0


@pytest.mark.parametrize(("name", "kind", "axis", "anyhow", "most"), KINDS, ids=IDS)
def test_a_search_finds_as_many_answers(name, kind, axis, anyhow, most):
    robot, joints, _, target = case(name, kind, axis, anyhow, 4)
    found = solve(robot, target, near=joints)
    assert found.count.max() <= most
    searched = search(robot, target, None)
    fixed = ~found.free[found.valid].any(axis=0)
    counted = distinct(robot, searched.joints * fixed, searched.met).sum(axis=1)
    assert found.count.tolist() == counted.tolist()


@pytest.mark.parametrize(("name", "kind", "axis", "anyhow", "most"), KINDS, ids=IDS)
def test_answers_have_the_names_that_the_whole_pose_gives_them(name, kind, axis, anyhow, most):
    robot, joints, _, target = case(name, kind, axis, anyhow, 20)
    found = solve(robot, target, near=joints)
    rows, branches = np.nonzero(found.valid)
    answers = found.joints[rows, branches]
    whole = solve(robot, forward(robot, answers))
    gaps = np.where(whole.valid, gap(robot, whole.joints, answers[:, None]), np.inf)
    assert gaps.min(axis=1).max() < 1e-6
    for row, branch, own, same in zip(rows, branches, answers, gaps, strict=True):
        name, named = whole.names[int(same.argmin())], found.names[branch]
        assert name.elbow == named.elbow
        if len(joints[0]) == 4:
            assert name.shoulder == named.shoulder
        if len(joints[0]) == 5:  # the whole pose goes by axis 5, a part of it by the tcp
            x, y, _ = np.linalg.solve(robot.base, [*target.poses[row, :3, 3], 1.0])[:3]
            assert named.shoulder == ("left" if x * np.cos(own[0]) + y * np.sin(own[0]) > 0 else "right")


def test_the_tool_of_no_flip_heads_to_the_side_of_the_first_link():
    for turned_over in (1.0, -1.0):
        robot = replace(arm("elbow and pitch"), base=np.diag([1.0, turned_over, turned_over, 1.0]))
        joints = random_joints(robot, np.random.default_rng(3), 50)
        _, target = part_of(forward(robot, joints), "pitch", "x")
        found = solve(robot, target)
        rows, branches = np.nonzero(found.valid)
        answers = found.joints[rows, branches]
        ahead = robot.base[:3, :3] @ np.stack(
            [np.cos(answers[:, 0]), np.sin(answers[:, 0]), 0 * rows]
        ).astype(float)
        heads = np.einsum("ik,ki->k", ahead, forward(robot, answers)[:, :3, 0]) > 0.0
        assert [found.names[i].wrist for i in branches] == ["no_flip" if side else "flip" for side in heads]


def test_names_choose_branches_over_a_batch():
    robot, rng = arm("elbow and pitch"), np.random.default_rng(4)
    joints = random_joints(robot, rng, 6).reshape(2, 3, 4)
    _, target = part_of(forward(robot, joints), "pitch", "x")
    found = solve(robot, target, near=joints)
    assert found.joints.shape == (2, 3, 8, 4)
    (branch,) = np.flatnonzero(found.named(shoulder="right", elbow="down", wrist="flip"))
    assert str(found.names[branch]) == "right down flip"
    assert found.named(elbow="up", wrist=None).sum() == 4
    assert found.named().all()


def test_a_long_batch_is_answered_row_by_row():
    robot = arm("elbow and pitch")
    joints = random_joints(robot, np.random.default_rng(5), 700)
    _, target = part_of(forward(robot, joints), "pitch", "x")
    found = solve(robot, target, joints)
    for row in (0, 255, 256, 257, 699):
        alone = solve(robot, target.rows([row]), joints[row : row + 1])
        assert alone.valid[0].tolist() == found.valid[row].tolist()
        assert alone.joints[0] == pytest.approx(found.joints[row], abs=1e-9)


def test_along_a_path_a_branch_keeps_its_name():
    robot = arm("elbow and pitch")
    start, end = np.array([0.3, 0.9, -1.2, 0.5]), np.array([0.8, 1.2, -0.8, 0.1])
    joints = start + np.linspace(0, 1, 40)[:, None] * (end - start)
    found = solve(robot, part_of(forward(robot, joints), "pitch", "x")[1])
    own = gap(robot, found.joints, joints[:, None])
    assert set(own.argmin(axis=1)) == {int(own[0].argmin())}
    assert str(found.names[int(own[0].argmin())]) == "left up no_flip"


def test_a_tcp_on_the_first_axis_is_singular_and_the_member_near_is_taken():
    robot = arm("elbow and pitch", limits=[[-4, 4]] * 4)
    straight = replace(robot, joints=tuple(replace(joint, d=0.0) for joint in robot.joints))
    # lengths .1, .3, .25, .1 with theta offset on joint 4: fold the arm until the tcp is above the base
    found = solve(
        straight, partial_target([0.0, 0.0, 0.5], pitch=0.3, tool_axis="x"), near=[0.7, 0.5, -1.0, 0.2]
    )
    own = found.joints[found.valid & found.singular]
    assert len(own) > 0
    assert found.free[found.valid & found.singular].tolist() == [[True, False, False, False]] * len(own)
    assert np.abs(own[:, 0] - 0.7).min() < 1e-9


def test_arms_that_a_closed_form_does_not_solve_keep_the_names():
    robot, rng = arm("elbow, pitch and roll"), np.random.default_rng(6)  # the tcp is off axis 5
    joints = random_joints(robot, rng, 4)
    _, target = part_of(forward(robot, joints), "direction", "x")
    found = solve(robot, target, near=joints)
    assert found.method.family == "numeric"
    assert {str(name) for name in found.names} == {"left up", "left down", "right up", "right down"}
    there = np.where(found.valid, gap(robot, found.joints, joints[:, None]), np.inf)
    assert there.min(axis=1).max() < 1e-6
    for row in range(4):
        whole = solve(robot, forward(robot, joints[row]))
        own = np.where(whole.valid, gap(robot, whole.joints, joints[row]), np.inf)
        assert found.names[int(there[row].argmin())] == whole.names[int(own.argmin())]


def test_a_tool_axis_that_is_always_vertical_has_no_yaw():
    for name in ("planar 3R", "SCARA"):
        robot = arm(name)
        position = forward(robot, random_joints(robot, np.random.default_rng(1), 1)[0])[:3, 3]
        with pytest.raises(InputError, match=r"the z axis of the tool of .* is always vertical") as caught:
            solve(robot, partial_target(position, yaw=0.0))
        assert "tool_axis: x or y" in str(caught.value.problems[0].hint)
        found = solve(robot, partial_target(position, pitch=0.3))
        with pytest.raises(PlanningError) as refused:
            check_reachable(robot, found)
        assert "no joint turns the z axis of the tool" in str(refused.value.problems[0].hint)


def test_what_is_out_of_reach_says_how_far():
    robot = robot_of("scorbot", None)
    far = solve(robot, partial_target([1.5, 0.0, 0.36], pitch=0.0))
    assert int(far.count) == 0
    assert far.shortfall[0] == pytest.approx(1.5 - (0.02 + 0.22 + 0.22 + 0.15), abs=1e-9)
    aside = solve(robot, partial_target([0.3, 0.0, 0.3], direction=[np.cos(0.2), np.sin(0.2), 0.0]))
    assert int(aside.count) == 0
    assert aside.shortfall == pytest.approx([0.0, 0.2], abs=1e-9)


@pytest.mark.parametrize("beyond", [1e-10, 1e-8, 3e-7])
def test_an_answer_misses_its_target_by_at_most_a_nanometre_and_a_nanoradian(beyond: float) -> None:
    """Of an arm that is stretched out, and of a tool that is asked to point aside of its plane."""
    robot, reach = robot_of("scorbot", None), 0.02 + 0.22 + 0.22 + 0.15
    for part in ({"pitch": 0.0}, {"direction": [1.0, 0.0, 0.0]}, {}):
        found = solve(robot, partial_target([reach + beyond, 0.0, 0.36], **part))
        assert (int(found.count) > 0) == (beyond < 1e-9)
        assert found.shortfall[0] == pytest.approx(0.0 if beyond < 1e-9 else beyond, rel=1e-3)
    aside = [np.cos(beyond), np.sin(beyond), 0.0]
    found = solve(robot, partial_target([0.4, 0.0, 0.3], direction=aside))
    assert (int(found.count) > 0) == (beyond < 1e-9)


def test_the_tool_of_no_flip_of_a_planar_arm_heads_along_up_times_axis():
    base = np.eye(4)
    base[:3, :3] = Rotation.from_euler("x", 90, degrees=True).as_matrix()  # the axes point along -y in world
    robot = replace(arm("planar 3R"), base=base)
    joints = random_joints(robot, np.random.default_rng(8), 20)
    found = solve(robot, part_of(forward(robot, joints), "pitch", "x")[1])
    rows, branches = np.nonzero(found.valid)
    heads = forward(robot, found.joints[rows, branches])[:, 0, 0]
    ahead = np.cross([0.0, 0.0, 1.0], [0.0, -1.0, 0.0])[0]
    assert [found.names[i].wrist for i in branches] == ["no_flip" if x * ahead > 0 else "flip" for x in heads]
