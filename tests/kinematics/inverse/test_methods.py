"""Methods of inverse kinematics: names of their branches, and which side of the wrist each name is."""

from __future__ import annotations

import numpy as np
import pytest
from inverse_arms import FAMILIES, arm, random_joints

from trajcli.kinematics.forward import forward, link_poses
from trajcli.kinematics.inverse.families.choose import method_for
from trajcli.kinematics.inverse.families.method import Branch, IkMethod
from trajcli.kinematics.inverse.solutions import Solutions
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.inverse.target import partial_target
from trajcli.kinematics.robot import Robot


def test_branches_stand_by_shoulder_elbow_and_wrist_however_the_solver_chooses() -> None:
    method = IkMethod("", "", ("wrist", "shoulder"), "", solve=lambda goal, flags: [])
    assert [str(each) for each in method.branches] == [
        "left no_flip",
        "left flip",
        "right no_flip",
        "right flip",
    ]
    assert [str(each) for each in IkMethod("", "", ("elbow",), "", solve=method.solve).branches] == [
        "up",
        "down",
    ]
    assert IkMethod("", "", (), "", solve=method.solve).branches == (Branch(),)
    assert IkMethod("", "numeric", ("elbow",), "").branches == ()
    labels = (Branch("right"), Branch("right"))
    assert IkMethod("", "", ("elbow",), "", solve=method.solve, labels=labels).branches == labels


def test_a_branch_is_called_by_its_names_in_their_order_or_is_the_only_one() -> None:
    assert str(Branch("left", "down", "flip")) == "left down flip"
    assert str(Branch(elbow="up")) == "up"
    assert str(Branch()) == "only"


@pytest.mark.parametrize(
    "name", ["UR", "wrist over elbow", "slanted wrist over elbow", "wrist over Stanford"]
)
def test_the_wrist_bends_from_axis_4_to_axis_6_about_axis_5_without_a_flip(name: str) -> None:
    """By the axes of forward kinematics."""
    rng = np.random.default_rng(5)
    robot = arm(name, rng)
    for q in random_joints(robot, rng, 5):
        solutions = solve(robot, forward(robot, q))
        seen = set()
        for k in np.flatnonzero(solutions.valid):
            four, five, six = link_poses(robot, solutions.joints[k])[[3, 4, 5], :3, 2]
            wrist = solutions.names[k].wrist
            seen.add(wrist)
            assert (np.cross(four, six) @ five > 0) == (wrist == "no_flip")
        assert seen == {"flip", "no_flip"}


def answers_of(robot: Robot, q: np.ndarray) -> tuple[Solutions, np.ndarray]:
    """Return the solutions for the pose of a configuration, of short arms for its position, and the valid ones."""
    pose = forward(robot, q)
    solutions = solve(robot, pose if len(robot.joints) > 4 else partial_target(pose[:3, 3]))
    return solutions, np.flatnonzero(solutions.valid)


@pytest.mark.parametrize(
    "name",
    [
        "elbow with offsets",
        "RRP Stanford",
        "RRP Stanford, turned over",
        "elbow and pitch",
        "UR",
        "UR askew",
        "wrist over elbow",
        "wrist over Stanford",
        "two axes that meet",
        "wrist over two axes that meet",
        "RRP with a slanted slide",
    ],
)
def test_left_reaches_to_the_side_of_the_first_link_or_across_two_axes_that_meet(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By the poses of links: of six joints it is where axes 5 and 6 meet that reaches there, else the tcp."""
    rows = ["R 0 .4 .05 1", "R 0 .15 0 -1", "P 0 .2 .1 0"]
    monkeypatch.setitem(FAMILIES, "RRP Stanford, turned over", (rows, 4, "positioning"))
    robot, seen = arm(name, np.random.default_rng(3)), set()
    for q in random_joints(robot, np.random.default_rng(6), 6):
        solutions, valid = answers_of(robot, q)
        for k in valid:
            links = link_poses(robot, solutions.joints[k])
            reached = (
                links[5][:3, 3] if len(robot.joints) == 6 else forward(robot, solutions.joints[k])[:3, 3]
            )
            side = links[1][:3, 0]
            if "meet" in name or "slanted" in name:
                side = np.cross(links[1][:3, 2], links[0][:3, 2])
            shoulder = solutions.names[k].shoulder
            seen.add(shoulder)
            assert ((reached - links[0][:3, 3]) @ side > 0) == (shoulder == "left")
    assert seen == {"left", "right"}


@pytest.mark.parametrize(
    ("name", "choice"),
    [
        ("planar RP", "elbow"),
        ("planar RPR", "elbow"),
        ("RRP Stanford", "elbow"),
        ("RRP with a slanted slide", "elbow"),
        ("RPP cylindrical", "shoulder"),
        ("wrist over Stanford", "elbow"),
        ("wrist over cylindrical", "shoulder"),
    ],
)
def test_up_and_left_have_the_longer_slide(name: str, choice: str) -> None:
    """Of cylindrical arms the last slide; whichever way it counts."""
    robot = arm(name, np.random.default_rng(3))
    compared = 0
    last = max(k for k, joint in enumerate(robot.joints) if joint.type == "prismatic")
    for q in random_joints(robot, np.random.default_rng(6), 6):
        solutions, valid = answers_of(robot, q)
        out = robot.joints[last].sign * solutions.joints[valid, last]
        names = [getattr(solutions.names[k], choice) for k in valid]
        if len(set(names)) == 2:  # else the other one does not reach there
            longer = out > 0.5 * (out.min() + out.max())
            assert [each in ("up", "left") for each in names] == longer.tolist()
            compared += 1
    assert compared >= 2


SAID = {  # what the rows of an arm say of its axes, as a person reads them
    "planar 3R": ("planar 3R", "all turns are about parallel axes"),
    "SCARA, slide first": ("SCARA", "all turns are about parallel axes, and the slide runs along them"),
    "wrist over Stanford": (
        "spherical wrist over Stanford base",
        "axes 4, 5 and 6 meet in one point, and joints 1 to 3 (RRP) place it (Stanford base)",
    ),
    "elbow and pitch": ("elbow and pitch", "axes 2, 3 and 4 are parallel"),
    "elbow, pitch and roll": ("elbow, pitch and roll", "axes 2, 3 and 4 are parallel and axis 5 is not"),
    "UR": ("three parallel axes (UR)", "axes 2, 3 and 4 are parallel and axes 5 and 6 meet"),
    "RRP SCARA": ("SCARA base (RRP)", "three joints (RRP) that place the tcp: SCARA base"),
    "RPP cylindrical": (
        "cylindrical base (RPP)",
        "three joints (RPP) that place the tcp: cylindrical base",
    ),
    "spherical shoulder": (
        "spherical shoulder under elbow",
        "axes 3, 2 and 1 meet in one point, and joints 6 to 4 (RRR) place it (elbow)",
    ),
}


@pytest.mark.parametrize("name", SAID)
def test_a_method_says_which_axes_it_goes_by(name: str) -> None:
    method = method_for(arm(name))
    assert (method.name, method.reason) == SAID[name]


@pytest.mark.parametrize("name", ["planar 2R", "planar RP"])
def test_a_planar_arm_answers_without_a_search_where_its_height_is_left_free(name: str) -> None:
    robot = arm(name)
    q = np.array([0.4, 0.3])
    position = forward(robot, q)[:3, 3] + [0.0, 0.0, 5.0]
    found = solve(robot, partial_target(position, fixed=(True, True, False)), q)
    assert found.method.family == name
    assert found.valid.sum() == 2
    np.testing.assert_allclose(found.joints[found.nearest(q)], q, atol=1e-9)
    assert not solve(robot, partial_target(position), q).valid.any()


@pytest.mark.parametrize(
    "rows",
    [
        ["R 0 .3 .1 1", "R 0 .05 .3 0", "R 0 0 .25 2", "R 1 .02 .03 1", "P 0 .15 .04 .3"],
        ["R 0 .3 .1 1", "R 0 .05 .3 0", "P 0 0 .25 2", "R .4 .02 .1 0"],
        ["R 0 .3 .1 0", "R 0 .05 .3 0", "R 0 0 .25 2", "R 1 .02 .03 1", "R 0 .15 .04 .3"],
        ["R 0 .3 .1 1", "R 0 .05 .3 0", "R 0 0 .25 0", "R 1 .02 .03 0", "R 0 .15 .04 .3"],
        ["R 0 .3 .1 1", "R 0 .05 .3 0", "R 0 0 .25 0", "R 1 .02 .03 0", "R 0 .1 0 -1", "R 0 .1 0 0"],
    ],
    ids=["a slide last", "a slide between", "four parallel axes", "axis 5 parallel, too", "of six, too"],
)
def test_arms_that_are_nearly_those_of_a_closed_form_are_searched(
    rows: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(FAMILIES, "nearly", (rows, 0, ""))
    assert method_for(arm("nearly")).family == "numeric"
