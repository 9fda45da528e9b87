"""Ends of moves: trajectories that end in their targets, and mutants that do not."""

from __future__ import annotations

import numpy as np
import pytest
from motions import between, limits, trajectory
from random_jobs import loaded

from trajcli.checks.target import check_targets
from trajcli.checks.verify import verify
from trajcli.errors import PlanningError
from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.target import partial_target, pose_target
from trajcli.planning.plan import plan_job
from trajcli.trajectory import Destination, Promise, Trajectory

END = np.array([0.9, -1.0, 1.2, -0.7, -1.4, 0.3])
BEGIN = END + 0.2
ROBOT = load_robot("ur5e")


def to_joints(*targets) -> list[Promise]:
    return [Promise(destination=Destination(np.array(target))) for target in targets]


def swing(end=END) -> Trajectory:
    return trajectory(between(BEGIN.tolist(), list(end)))


def to_pose(pose, tolerance=None) -> list[Promise]:
    return [Promise(robot=ROBOT, destination=Destination(None, pose, tolerance))]


def test_right_ends_pass():
    assert check_targets(swing(), to_joints(END)) == []
    assert check_targets(swing(), to_pose(pose_target(forward(ROBOT, END)))) == []
    assert check_targets(swing(), [Promise()]) == []


@pytest.mark.parametrize("off", [1e-8, -0.3])
def test_a_mutant_that_ends_beside_its_joints(off):
    mutant = END + np.array([0, 0, off, 0, 0, 0])
    (finding,) = check_targets(swing(mutant), to_joints(END))
    assert (finding.kind, finding.move, finding.joint, finding.time) == ("target", 0, "j3", 2.0)
    assert finding.value == pytest.approx(abs(off), rel=1e-6)
    assert "beside its target at t = 2 s" in finding.text()


def test_the_end_is_the_moves_own_although_the_next_one_jumps():
    jumping = trajectory(between([0.0], [1.0]), between([1.5], [2.0]))
    assert check_targets(jumping, to_joints([1.0], [2.0])) == []
    assert [f.move for f in check_targets(jumping, to_joints([1.5], [2.0]))] == [0]


def test_a_mutant_that_ends_beside_its_pose():
    """The first joint of an arm turns the tool about z by its angle, and moves it by that times the lever."""
    pose, turn = forward(ROBOT, END), 1e-3
    mutant = END + np.array([turn, 0, 0, 0, 0, 0])
    beside, turned = check_targets(swing(mutant), to_pose(pose_target(pose)))
    assert beside.value == pytest.approx(2 * np.sin(turn / 2) * np.hypot(*pose[:2, 3]), rel=1e-6)
    assert turned.value == pytest.approx(turn, rel=1e-6)
    assert {finding.kind for finding in (beside, turned)} == {"target"}
    assert len(check_targets(swing(mutant), to_pose(pose_target(pose), (1e-6, 2e-3)))) == 1


def test_what_a_target_leaves_free_does_not_count():
    mutant = END + np.array([0, 0, 0, 0, 0, 0.5])  # about the tool's own axis, on which the tcp lies
    place = partial_target(forward(ROBOT, END)[:3, 3])
    assert check_targets(swing(mutant), to_pose(place)) == []
    assert check_targets(swing(mutant), to_pose(pose_target(forward(ROBOT, END))))


def test_the_verdict_holds_it():
    verdict = verify(swing(END + 0.1), [limits(6)], to_joints(END))
    assert {finding.kind for finding in verdict.findings} == {"target"}


def far_job(x: float) -> dict:
    segments = [{"line": {"xyz": [x, 0, 0]}}, {"line": {"xyz": [400, 0, 0]}}]
    return {
        "version": 1,
        "robot": "ur5e",
        "units": {"angle": "deg", "length": "mm"},
        "limits": {"tcp": {"speed": 500, "acceleration": 2500}},
        "start": {"xyz": [400, 100, 300]},
        "moves": [{"planner": "path", "corner": "stop", "segments": segments}],
    }


@pytest.mark.parametrize("x", [1e14, -1e13, 2e12])
def test_a_path_far_outside_of_any_robot_has_no_curve(x):
    """It was verified with one move of 0 s."""
    with pytest.raises(PlanningError, match="no robot reaches so far"):
        plan_job(loaded(far_job(x)))


@pytest.mark.parametrize("planner", ["quintic", "line", "screw"])
def test_a_target_far_outside_of_any_robot_has_no_curve(planner):
    move = {"planner": planner, "to": {"xyz": [1e14, 0, 0], "rpy": [180, 0, 0]}}
    with pytest.raises(PlanningError, match="no robot reaches so far"):
        plan_job(loaded({**far_job(0), "moves": [move]}))
