"""Methods of inverse kinematics: names of their branches, and which side of the wrist each name is."""

from __future__ import annotations

import numpy as np
import pytest
from inverse_arms import arm, random_joints

from trajcli.kinematics.forward import forward, link_poses
from trajcli.kinematics.inverse.families.method import Branch, IkMethod
from trajcli.kinematics.inverse.solve import solve


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
