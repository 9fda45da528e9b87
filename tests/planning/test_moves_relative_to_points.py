"""Moves relative to points and to where the arm stands: which branch they take, and what is handed from move to move."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import trajcli
from trajcli.limits.tolerances import JUMP_ABSOLUTE
from trajcli.planning.plan import Plan
from trajcli.planning.planned_move import handed_over
from trajcli.trajectory import State

START = [0.3, -1.2, 1.4, -0.7, 0.9, 0.2]


def planned(*moves: dict[str, Any], **job: Any) -> Plan:
    limits = {"acceleration": 5}
    return trajcli.plan(
        {
            "version": 1,
            "robot": "ur5e",
            "limits": limits,
            "start": {"joints": START},
            "moves": [*moves],
            **job,
        }
    )


def to(target: Any, planner: str = "quintic") -> dict[str, Any]:
    return {
        "planner": planner,
        "to": target,
        **({"law": {"shape": "quintic", "duration": 8}} if planner == "line" else {"duration": 8}),
    }


def ends(plan: Plan) -> list[np.ndarray]:
    return [np.asarray(move.planned.end.position) for move in plan.moves]


@pytest.mark.parametrize("chain", [1, 2, 3])
def test_a_target_relative_to_a_point_given_as_joints_is_on_the_branch_of_that_point(chain: int) -> None:
    """Of eight answers the one that is nearest to the joints of the point, also through points that are relative to it."""
    robot = trajcli.load_robot("ur5e")
    far = robot.ik(robot.fk(START), near=START)[-1].joints
    assert np.abs(far - START).max() > 1
    lift = {"offset": {"xyz": [0, 0, -0.005]}}
    points = {"p1": {"joints": far.tolist()}} | {
        f"p{k}": {"from": f"p{k - 1}", **lift} for k in range(2, chain + 1)
    }
    (end,) = ends(planned(to({"from": f"p{chain}", **lift}), points=points))
    assert np.abs(end - far).max() < 0.2
    shift = robot.fk(far)[:3, :3] @ [0, 0, -0.005 * chain]
    np.testing.assert_allclose(robot.fk(end)[:3, 3], robot.fk(far)[:3, 3] + shift, atol=1e-8)
    np.testing.assert_allclose(robot.fk(end)[:3, :3], robot.fk(far)[:3, :3], atol=1e-8)


def test_here_is_where_the_tool_stands_behind_a_target_without_orientation() -> None:
    robot = trajcli.load_robot("ur5e")
    place = (robot.fk(START)[:3, 3] + [0.02, -0.03, 0.01]).tolist()
    first, second = ends(
        planned(to({"xyz": place}, "line"), to({"from": "here", "offset": {"xyz": [0.01, 0, 0]}}))
    )
    pose = robot.fk(first)
    np.testing.assert_allclose(pose[:3, 3], place, atol=1e-6)
    np.testing.assert_allclose(robot.fk(second)[:3, 3], pose[:3, 3] + 0.01 * pose[:3, 0], atol=1e-6)
    np.testing.assert_allclose(robot.fk(second)[:3, :3], pose[:3, :3], atol=1e-6)


def test_here_is_where_a_move_has_ended_that_names_no_target() -> None:
    """A motion whose last blend is centred on its last point goes on beyond it."""
    pose = {"xyz": [0.4, 0.1, 0.25], "rpy": [np.pi, 0, 0]}
    beyond = [value + 0.2 for value in START]
    blends = {"planner": "blends", "through": [{"joints": beyond, "time": 4}], "blend_durations": 0.5}
    up = to({"from": "here", "offset": {"xyz": [0, 0, 0.05]}})
    plan = planned(to(pose), {**blends, "end_blends": "centred"}, up, limits={"acceleration": 20})
    robot = trajcli.load_robot("ur5e")
    before, after = (robot.fk(end) for end in ends(plan)[1:])
    np.testing.assert_allclose(after[:3, 3], before[:3, 3] + 0.05 * before[:3, 2], atol=1e-8)
    np.testing.assert_allclose(after[:3, :3], before[:3, :3], atol=1e-8)


@pytest.mark.parametrize(
    "between", [[], [{"planner": "hold", "duration": 1}], [{"signal": "lamp", "value": 1}]]
)
def test_angles_are_typed_on_behind_what_moves_nothing(between: list[dict[str, Any]]) -> None:
    """From 360 to 200 degrees of yaw as they are typed, where from 0 to 200 is meant otherwise."""
    turn = to({"xyz": [0.4, 0.1, 0.3], "rpy": [np.pi, 0, np.radians(200)]}, "line")
    pose = {"xyz": [0.4, 0.1, 0.25], "rpy": [np.pi, 0, 2 * np.pi]}
    plan = planned(to(pose), *between, {**turn, "orientation": "euler"}, limits={"acceleration": 20})
    begin, end = (
        plan.trajectory.curve.evaluate(span)
        for span in (plan.trajectory.spans[-1].start, plan.trajectory.duration)
    )
    assert abs(end - begin)[5] == pytest.approx(np.radians(160), abs=0.3)


def test_rounds_that_are_the_same_motion_have_numbers_of_their_own() -> None:
    there, back = to({"joints": [0.5, -1.2, 1.4, -0.7, 0.9, 0.2]}), to({"joints": START})
    plan = planned({"repeat": 3, "moves": [there, back]})
    assert [move.index for move in plan.moves] == [0, 1, 2, 3, 4, 5]
    assert [span.index for span in plan.trajectory.spans] == [0, 1, 2, 3, 4, 5]
    np.testing.assert_array_equal(ends(plan)[0], ends(plan)[4])


def test_rounds_that_begin_elsewhere_are_other_motions() -> None:
    by = {"joints_by": [0.1, 0, 0, -0.05, 0, 0]}
    found = ends(planned({"repeat": 3, "moves": [to(by)]}))
    for k, end in enumerate(found, 1):
        np.testing.assert_allclose(end - START, [0.1 * k, 0, 0, -0.05 * k, 0, 0], atol=1e-12)


@pytest.mark.parametrize("continuities", [(2, 2), (1, 2), (2, 1), (None, 1)])
def test_an_acceleration_is_handed_over_between_smooth_moves_alone(
    continuities: tuple[int | None, int],
) -> None:
    """A first move takes that of the start; what is too small to be seen as a jump is rest."""
    small, large = 0.5 * JUMP_ABSOLUTE, 2 * JUMP_ABSOLUTE
    state = State(np.zeros(3), np.array([small, -small, -large]), np.array([1.0, small, -large]))
    planners = {1: "cubic", 2: "quintic"}
    moves = [
        None if each is None else planned(to({"joints": START}, planners[each])).loaded.job.moves[0]
        for each in continuities
    ]
    assert moves[1] is not None
    handed = handed_over(state, moves[0], moves[1])
    assert handed.velocity.tolist() == [0, 0, -large]
    smooth = continuities in ((2, 2), (None, 1))
    assert handed.acceleration.tolist() == ([1, 0, -large] if smooth else [0, 0, 0])
