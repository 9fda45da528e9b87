"""Methods of inverse kinematics: names of their branches, and which side of the wrist each name is."""

from __future__ import annotations

import numpy as np
import pytest
from inverse_arms import arm, random_joints

from trajcli.kinematics.forward import forward, link_poses
from trajcli.kinematics.inverse.families.choose import method_for
from trajcli.kinematics.inverse.families.method import Branch, IkMethod
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.inverse.target import partial_target


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


SAID = {  # what the rows of an arm say of its axes, as a person reads them
    "planar 3R": ("planar 3R", "all turns are about parallel axes"),
    "SCARA, slide first": ("SCARA", "all turns are about parallel axes, and the slide runs along them"),
    "wrist over Stanford": (
        "spherical wrist over Stanford base",
        "axes 4, 5 and 6 meet in one point, and joints 1 to 3 (RRP) place it (Stanford base)",
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
