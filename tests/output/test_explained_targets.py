"""Explained targets: of the tool on the flange when the move goes there, and of the branch that was chosen."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

import trajcli
from trajcli.job.read import job_from_text
from trajcli.kinematics.forward import forward
from trajcli.output.explain import explanation
from trajcli.planning.plan import Plan, plan_job

START = [0.2, -1.2, 1.4, -0.9, 0.8, 0.3]


def planned(*moves: dict[str, Any], start: list[float] = START, **job: Any) -> Plan:
    return plan_job(
        job_from_text(
            json.dumps({"version": 1, "robot": "ur5e", "start": {"joints": start}, "moves": moves, **job})
        )
    )


def moved(plan: Plan, index: int, joints: np.ndarray, along: np.ndarray, step: float) -> np.ndarray:
    """Return the tcp of the tool in force in a move, (4, 4), a step along a direction of the joints away."""
    return forward(plan.moves[index].robot, joints + step * along)


def test_what_a_target_leaves_free_leaves_the_tip_of_the_tool_in_force() -> None:
    """Behind a change of the tool it is that of the new one, which is beside all axes of the wrist."""
    there = {"planner": "quintic", "to": {"xyz": [0.4, 0.2, 0.3]}, "duration": 9}
    tools = {"bent": {"xyz": [0.1, 0.05, 0.2]}, "long": {"xyz": [0, 0, 0.1]}}
    plan = planned(there, {"tool": "bent"}, there, tools=tools, tool="long")
    moves = explanation(plan).moves
    for index in (0, 2):
        pose = moves[index].to_pose
        assert pose is not None
        assert pose.free_direction is not None
        joints, along = np.array(pose.joints), np.array(pose.free_direction)
        assert np.abs(along).max() > 0.1
        np.testing.assert_allclose(moved(plan, index, joints, along, 0.0)[:3, 3], [0.4, 0.2, 0.3], atol=1e-8)
        ahead, behind = (moved(plan, index, joints, along, step)[:3, 3] for step in (1e-4, -1e-4))
        np.testing.assert_allclose(ahead, behind, rtol=0, atol=1e-7)
        assert (pose.rank, pose.singular) == ({"here": 3, "nearby": 3}, False)


def test_directions_are_those_of_the_branch_that_was_chosen() -> None:
    """An aligned wrist turns on the spot in its own branch, and in none of the others that reach the same pose."""
    robot = trajcli.load_robot("ur5e")
    aligned = np.array([0.2, -1.2, 1.4, -0.9, 0.0, 0.3])
    pose = robot.fk(aligned)
    to = {"matrix": pose[:3, :3].tolist(), "xyz": pose[:3, 3].tolist()}
    answers = robot.ik(pose)
    kinds = set()
    for answer in answers:
        joints = np.asarray(answer.joints)
        plan = planned({"planner": "quintic", "to": to, "duration": 9}, start=(joints + 0.01).tolist())
        (move,) = explanation(plan).moves
        assert move.to_pose is not None
        reached, along = np.array(move.to_pose.joints), move.to_pose.free_direction
        turning = bool(abs(np.sin(reached[4])) < 1e-6)
        kinds.add(turning)
        assert (along is not None, move.to_pose.singular) == (turning, turning)
        assert move.to_pose.rank == {"here": 6 - turning, "nearby": 6}
        if along is not None:
            ahead, behind = (moved(plan, 0, reached, np.array(along), step) for step in (1e-4, -1e-4))
            np.testing.assert_allclose(ahead, behind, rtol=0, atol=1e-7)
    assert kinds == {True, False}
