from __future__ import annotations

import zlib

import numpy as np
import pytest
from conventions import in_convention
from inverse_arms import FAMILIES, WRIST, arm, counts_by_search, gap, random_joints, turning
from tiers import few

from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.families.choose import method_for
from trajcli.kinematics.inverse.solve import solve

NAMES = [pytest.param(name, id=name) for name in FAMILIES]


def generator(name):
    return np.random.default_rng(zlib.crc32(name.encode()))


def check_random_poses(robot, rng, count):
    joints = random_joints(robot, rng, count)
    poses = forward(robot, joints)
    found = solve(robot, poses)
    reached = forward(robot, found.joints)
    off = np.abs(reached - poses[:, None]).max(axis=(-2, -1))
    assert off[found.valid].max() < 1e-10
    assert found.closure[found.valid].max() < 1e-10
    there = np.where(found.valid, gap(robot, found.joints, joints[:, None]), np.inf).min(axis=1)
    assert there.max() < 1e-6
    return poses, found


@pytest.mark.parametrize("name", few(NAMES, 2))
@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_closed_forms_close_and_contain_the_generating_joints(name, convention):
    rng = generator(name)
    robot = in_convention(arm(name, rng), convention)
    _, branches, family = FAMILIES[name]
    method = method_for(robot)
    assert (method.family, len(method.branches)) == (family, branches)
    poses, found = check_random_poses(robot, rng, 150)
    few = slice(0, 4)
    assert found.count[few].tolist() == counts_by_search(robot, poses[few]).tolist()


@pytest.mark.soak
@pytest.mark.parametrize("name", NAMES)
def test_closed_forms_hold_for_ten_thousand_poses(name):
    rng = generator(name)
    robot = arm(name, rng)
    poses, found = check_random_poses(robot, rng, 10_000)
    few = slice(0, 200)
    same = found.count[few] == counts_by_search(robot, poses[few])
    assert np.count_nonzero(~same) <= 1  # a branch whose basin no seed meets


@pytest.mark.parametrize(
    "rows", [["P 0 .4 0 0", "R 0 0 .3 0", "R 0 0 .25 2"], ["R 0 .4 .3 0", "P 0 0 0 0", "R 0 0 .25 2"]]
)
def test_a_wrist_over_a_slide_that_turns_follow(rows, monkeypatch):
    """The slide is before, or between, the turns that move the wrist."""
    rng = np.random.default_rng(4)
    monkeypatch.setitem(FAMILIES, "lifted", ([*rows, *WRIST], 4, "spherical wrist"))
    robot = arm("lifted", rng)
    assert (method_for(robot).family, len(method_for(robot).branches)) == ("spherical wrist", 4)
    poses, found = check_random_poses(robot, rng, 40)
    assert found.count[:2].tolist() == counts_by_search(robot, poses[:2]).tolist()


def test_a_slide_that_is_slanted_to_two_parallel_turns_gives_more_than_its_height(monkeypatch):
    monkeypatch.setitem(FAMILIES, "slanted", (["R 0 .4 .3 0", "R 0 0 .25 .4", "P 0 0 0 0"], 2, "positioning"))
    robot = arm("slanted", np.random.default_rng(4))
    assert method_for(robot).name == "SCARA base (RRP)"
    assert [str(branch) for branch in method_for(robot).branches] == ["up", "down"]
    check_random_poses(robot, np.random.default_rng(5), 40)


@pytest.mark.parametrize("name", few(NAMES, 9))
def test_right_angles_everywhere_are_solved_where_the_arm_is(name):
    robot, rng = arm(name), generator(name)
    size = (60, len(robot.joints))
    quarters, slides = rng.integers(-1, 3, size) * np.pi / 2, rng.choice([0.0, 0.2, 0.4], size)
    joints = np.where(turning(robot), quarters, slides)
    poses = forward(robot, joints)
    found = solve(robot, poses, near=joints)
    there = np.where(found.valid, gap(robot, found.joints, joints[:, None]), np.inf).min(axis=1)
    assert there.max() < 1e-6
    off = np.abs(forward(robot, found.joints) - poses[:, None]).max(axis=(-2, -1))
    assert off[found.valid].max() < 1e-9
    alone = solve(robot, poses)
    assert (alone.count > 0).all()


@pytest.mark.parametrize("name", NAMES)
def test_branches_are_named_apart(name):
    method = method_for(arm(name))
    _, branches, family = FAMILIES[name]
    assert method.family == family
    assert len(set(map(str, method.branches))) == len(method.branches) == branches
    assert method.reason
    assert method.name


def test_branches_keep_their_names_along_a_motion():
    robot = arm("wrist over elbow")
    start, end = np.array([0.3, 0.5, 0.8, 0.4, 0.6, 0.2]), np.array([0.9, 0.9, 1.2, 1.0, 1.1, 0.9])
    joints = start + np.linspace(0, 1, 50)[:, None] * (end - start)
    found = solve(robot, forward(robot, joints))
    here = gap(robot, found.joints, joints[:, None])
    assert set(here.argmin(axis=1)) == {int(here[0].argmin())}
    jumps = gap(robot, found.joints[1:], found.joints[:-1])
    assert jumps.max() < 0.2


def test_left_reaches_forward_up_is_above_and_no_flip_bends_positively():
    robot = arm("elbow")
    found = solve(robot, forward(robot, [0.4, 0.7, -1.2]))
    best = int(gap(robot, found.joints, np.array([0.4, 0.7, -1.2])).argmin())
    assert (found.names[best].shoulder, found.names[best].elbow, found.names[best].wrist) == (
        "left",
        "up",
        None,
    )
    robot = arm("wrist over elbow")
    found = solve(robot, forward(robot, [0.4, 0.7, -1.2, 0.3, 0.5, 0.2]))
    flips = [name.wrist for name in found.names]
    bends = np.sign(found.joints[:, 4])
    assert flips == ["no_flip" if bend > 0 else "flip" for bend in bends]


@pytest.mark.parametrize("name", ["elbow with offsets", "wrist over elbow", "UR", "elbow, pitch and roll"])
def test_the_elbow_of_up_is_higher(name):
    robot = arm(name)
    rng = generator(name)
    found = solve(robot, forward(robot, random_joints(robot, rng, 100)))
    names = [str(branch) for branch in found.names]
    for i, branch in enumerate(found.names):
        if branch.elbow == "up":
            j = names.index(str(branch).replace("up", "down"))
            both = found.valid[:, i] & found.valid[:, j]
            heights = [np.sin(found.joints[both, k, 1]) * robot.joints[1].a for k in (i, j)]
            assert (heights[0] > heights[1] - 1e-12).all()
