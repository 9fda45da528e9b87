"""Ends of moves: trajectories that end in their targets, and mutants that do not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from motions import between, limits, trajectory
from random_jobs import loaded

from trajcli.checks import target
from trajcli.checks.target import check_targets
from trajcli.checks.verify import verify
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.errors import PlanningError
from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.target import partial_target, pose_target
from trajcli.planning.plan import plan_job
from trajcli.trajectory import Destination, Promise, Trajectory, resting

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
    assert check_targets(swing(), [Promise(robot=ROBOT, destination=Destination(END))]) == []


@pytest.mark.parametrize("off", [1e-8, -0.3])
def test_a_mutant_that_ends_beside_its_joints(off):
    mutant = END + np.array([0, 0, off, 0, 0, 0])
    (finding,) = check_targets(swing(mutant), to_joints(END))
    assert (finding.kind, finding.move, finding.joint, finding.time) == ("target", 0, "j3", 2.0)
    assert finding.value == pytest.approx(abs(off), rel=1e-6)
    assert finding.si_unit == "rad"
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


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("share", "count"), [(0.99, 1), (1.01, 0)])
@pytest.mark.parametrize("turns", [True, False])
def test_the_tool_may_be_beside_and_turned_by_so_much(
    turns: bool, share: float, count: int, side: float
) -> None:
    """Each by its own tolerance, in its own unit: the last joint turns the tool in its place."""
    off, wide = 1e-4, (9.0, 1.0)
    mutant, pose = END.copy(), forward(ROBOT, END)
    if turns:
        mutant[5] += side * off
    else:
        pose[2, 3] += side * off
    tolerance = (wide[0], share * off) if turns else (share * off, wide[1])
    found = check_targets(swing(mutant), to_pose(pose_target(pose), tolerance))
    assert len(found) == count
    for each in found:
        assert (each.value, each.limit) == (pytest.approx(off, rel=1e-6), pytest.approx(share * off))
        said = "ends turned by 0.0001 rad from its" if turns else "ends 0.0001 m beside its"
        assert said in each.text()
        assert each.text().endswith("promised were 9.9e-05 rad" if turns else "promised were 9.9e-05 m")


def test_each_move_ends_in_its_target_with_the_tool_that_it_has() -> None:
    """A tool is changed between moves: what another one would meet does not count."""
    whole, targets = three_moves(3, np.zeros(6))
    arms = []
    for k in range(3):
        tool = ROBOT.tool.copy()
        tool[0, 3] += 0.1 * k
        arms.append(replace(ROBOT, tool=tool))
    promises = [
        Promise(robot=arm, destination=Destination(None, pose_target(forward(arm, each))))
        for arm, each in zip(arms, targets, strict=True)
    ]
    assert check_targets(whole, promises) == []
    changed = [replace(each, robot=arms[(k + 1) % 3]) for k, each in enumerate(promises)]
    assert {each.move for each in check_targets(whole, changed)} == {0, 1, 2}


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


def three_moves(wrong: int, by: np.ndarray) -> tuple[Trajectory, list[np.ndarray]]:
    """Return moves of the arm to three targets, one of which it misses; each begins where it should."""
    targets = [END + 0.2 * np.sin(np.arange(6) + k) for k in range(4)]
    moves = [
        between(targets[k].tolist(), (targets[k + 1] + (by if k == wrong else 0.0)).tolist())
        for k in range(3)
    ]
    return trajectory(*moves), targets[1:]


@pytest.mark.parametrize("block", [1, 2, 16_384])
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("wrong", range(3))
def test_every_move_ends_in_its_own_target(wrong: int, side: float, block: int, monkeypatch) -> None:
    """Whether its target is of joints, a pose, or a pose with joints that are pinned; on a path or not."""
    monkeypatch.setattr(target, "_BLOCK", block)
    by = side * 1e-4 * np.array([0.1, 0.0, 0.0, 0.0, 0.0, 1.0])
    whole, targets = three_moves(wrong, by)
    poses = [pose_target(forward(ROBOT, each)) for each in targets]
    of_joints = to_joints(*targets)
    (found,) = check_targets(whole, of_joints)
    assert (found.move, found.joint, found.value) == (wrong, "j6", pytest.approx(1e-4))
    of_poses = [Promise(robot=ROBOT, destination=Destination(None, pose)) for pose in poses]
    assert {each.move for each in check_targets(whole, of_poses)} == {wrong}
    loose = (1.0, 1.0)
    pinned = [
        Promise(robot=ROBOT, destination=Destination(None, pose, loose, {0: each[0], 5: each[5]}))
        for pose, each in zip(poses, targets, strict=True)
    ]
    (found,) = check_targets(whole, pinned)
    assert (found.move, found.joint, found.value) == (wrong, "j6", pytest.approx(1e-4))
    alone = [of_joints[k] if k == wrong else Promise() for k in range(3)]
    assert len(check_targets(whole, alone)) == 1
    assert check_targets(whole, [Promise() if k == wrong else of_joints[k] for k in range(3)]) == []


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize(("off", "found"), [(1.9e-5, 0), (2.1e-5, 1)])
def test_on_a_path_joints_are_met_as_well_as_the_tool_tells(off: float, found: int, side: float) -> None:
    mutant, near = END + side * off * np.eye(6)[3], (1e-6, 1e-6)
    joints = [Promise(destination=Destination(END, tolerance=near))]
    pins = {3: float(END[3])}
    pinned = [
        Promise(robot=ROBOT, destination=Destination(None, partial_target(np.zeros(3)), (9.0, 9.0), pins))
    ]
    assert len(check_targets(swing(mutant), joints)) == found
    assert len(check_targets(swing(mutant), pinned)) == found


def test_as_many_promises_as_moves_are_asked_for() -> None:
    with pytest.raises(ValueError, match="2 promises for 1 moves"):
        check_targets(swing(), [Promise(), Promise()])


@pytest.mark.parametrize("kind", ["joints", "pose", "pinned"])
def test_a_motion_that_ends_at_infinity_ends_in_no_target(kind: str) -> None:
    curve = between(BEGIN.tolist(), END.tolist())
    coefficients = curve.coefficients.copy()
    coefficients[0, -1, 3] = 1e308  # times 2^5
    whole = trajectory(
        PiecewisePolynomial(curve.breaks, coefficients), start=resting(BEGIN), end=resting(END)
    )
    pose = pose_target(forward(ROBOT, END))
    promises = {
        "joints": Promise(destination=Destination(END)),
        "pose": Promise(robot=ROBOT, destination=Destination(None, pose)),
        "pinned": Promise(
            robot=ROBOT, destination=Destination(None, pose, (np.inf, np.inf), {3: float(END[3])})
        ),
    }
    with np.errstate(over="ignore", invalid="ignore"):
        found = check_targets(whole, [promises[kind]])
    assert {each.kind for each in found} == {"target"}
    assert "j4" in {each.joint for each in found} if kind != "pose" else len(found) == 2


def test_of_joints_within_and_beyond_their_tolerance_one_beyond_is_named() -> None:
    """A billionth of the target is allowed, and of one at least: the first one is off by less, the second by more."""
    wanted = np.array([1000.0, 1.0])
    mutant = wanted + np.array([9e-7, 5e-9])
    (found,) = check_targets(trajectory(between([0.0, 0.0], mutant.tolist())), to_joints(wanted))
    assert (found.joint, found.value) == ("j2", pytest.approx(5e-9, rel=1e-5))
