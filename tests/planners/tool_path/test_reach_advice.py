"""Advice of paths that are out of reach: freeing the orientation is proposed where it helps, and then helps."""

from __future__ import annotations

import numpy as np
import pytest
from tiers import few
from tool_jobs import arm, line, plan, refusal

from trajcli.kinematics.forward import forward

FREE = {"velocity": None, "acceleration": None, "jerk": None}
LAW = {"shape": "quintic", "duration": 3}
JOINTS = [0.2, 0.5, -1.2, 0.0]


def outwards(by):
    """Return the position `by` further from the base than the tool in JOINTS, and the rotation there."""
    pose = forward(arm("elbow4r"), np.array(JOINTS))
    return pose[:3, 3] + by * np.array([np.cos(0.2), np.sin(0.2), 0.0]), pose[:3, :3]


@pytest.mark.full
@pytest.mark.parametrize(("by", "helps"), few([(0.1, True), (0.15, False), (0.5, False)], 1))
def test_freeing_the_orientation_is_proposed_where_it_helps(by, helps):
    xyz, rotation = outwards(by)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = rotation, xyz
    start = {"joints": JOINTS}
    error = refusal("elbow4r", start, line({"matrix": matrix.tolist()}, law=LAW), limits=FREE)
    assert ("`direction`" in error.problems[0].advice()) == helps
    assert "move the path into the reach of the arm" in error.problems[0].advice()
    to = {"xyz": xyz.tolist(), "direction": rotation[:, 2].tolist(), "tool_axis": "z"}
    if helps:
        plan("elbow4r", start, line(to, law=LAW), limits=FREE)
    else:
        refusal("elbow4r", start, line(to, law=LAW), limits=FREE)


@pytest.mark.full
def test_a_target_by_joints_says_how_the_way_to_its_place_is_free():
    """An arm of four joints cannot turn the tool evenly on a line; it can go there with the turn that it has."""
    start, to = {"joints": JOINTS}, np.array([0.5, 0.4, -1.1, 0.2])
    error = refusal("elbow4r", start, line({"joints": to.tolist()}, law=LAW), limits=FREE)
    assert error.problems[0].advice().endswith("give the target by `xyz` alone")
    xyz = forward(arm("elbow4r"), to)[:3, 3]
    plan("elbow4r", start, line({"xyz": xyz.tolist()}, law=LAW), limits=FREE)
    pose = refusal("elbow4r", start, line({"xyz": xyz.tolist(), "rpy": [0, 0, 0]}, law=LAW), limits=FREE)
    assert "alone" not in pose.problems[0].advice()


@pytest.mark.parametrize(
    ("name", "start", "to", "helps"),
    [
        ("planar2r", [0.3, 2.0], [3.4, 2.0], False),
        ("planar3r", [0.3, 0.7, 0.4], [3.3, 0.7, 0.4], True),
        pytest.param(
            *("ur5e", [0.3, -1.4, 1.6, -1.7, -1.5, 0.1], [3.3, -1.4, 1.6, -1.7, -1.5, 0.1], False),
            marks=pytest.mark.full,
        ),
    ],
)
def test_a_place_alone_is_proposed_where_it_leaves_more_free(
    name: str, start: list[float], to: list[float], helps: bool
) -> None:
    """From one side of the base to the other, too near to it: two joints are decided by the place as it is."""
    error = refusal(name, {"joints": start}, line({"joints": to}, law=LAW), limits=FREE)
    assert "does not reach the path beyond" in str(error)
    assert ("give the target by `xyz` alone" in error.problems[0].advice()) == helps
    xyz = forward(arm(name), np.array(to))[:3, 3].tolist()
    placed = refusal(name, {"joints": start}, line({"xyz": xyz}, law=LAW), limits=FREE)
    assert "alone" not in placed.problems[0].advice()
    assert ("does not reach" in str(placed)) == (not helps)
