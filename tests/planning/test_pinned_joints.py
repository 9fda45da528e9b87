"""Joints that a target pins beside its pose, and arms on rails: the others are solved, by forward kinematics."""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tiers import few

from trajcli.catalogue.entries import catalogue_names, robot_file
from trajcli.errors import InputError, TrajcliError
from trajcli.job.dump import dump_job
from trajcli.job.read import files_of, job_from_text, load_job
from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.pinned_joints import without_pinned
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.robot import Robot
from trajcli.planning.plan import Plan, plan_job
from trajcli.urdf.chain import chain_of

RAIL = {"axis": "x", "position": [0, 6], "velocity": 2, "acceleration": 3, "jerk": 20}
HEAD: dict[str, Any] = {
    "version": 1,
    "robot": {"rail": RAIL, "arm": "irb4600"},
    "limits": {"acceleration": 4, "jerk": 40},
    "start": {"joints": [0, 0, 0, 0, 0, 0.5, 0]},
}
PICK = {"xyz": [2.5, 0.2, 0.9], "rpy": [3.141592653589793, 0, 0]}
LAW = {"shape": "quintic", "duration": 3}


def turn(axis: int, angle: float) -> np.ndarray:
    result, i, j = np.eye(4), (axis + 1) % 3, (axis + 2) % 3
    result[i, i] = result[j, j] = np.cos(angle)
    result[j, i], result[i, j] = np.sin(angle), -np.sin(angle)
    return result


def shift(x: float, y: float, z: float) -> np.ndarray:
    result = np.eye(4)
    result[:3, 3] = x, y, z
    return result


def textbook(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Return the pose of the tcp without the base, from single turns and shifts."""
    pose = np.eye(4)
    for joint, value in zip(robot.joints, q, strict=True):
        slides = joint.type == "prismatic"
        theta, d = joint.theta + (0 if slides else joint.sign * value), joint.d + slides * joint.sign * value
        along, across = turn(2, theta) @ shift(0, 0, d), shift(joint.a, 0, 0) @ turn(0, joint.alpha)
        pose = pose @ (across @ along if robot.convention == "modified" else along @ across)
    return pose @ robot.tool


@cache
def _planned(text: str) -> Plan:
    return plan_job(job_from_text(text))


def planned(*moves: dict[str, Any], **fields: Any) -> Plan:
    plan = _planned(json.dumps({**HEAD, "moves": moves, **fields}))
    assert plan.verdict.passed, plan.verdict.findings[0].message
    return plan


def go(**fields: Any) -> dict[str, Any]:
    return {"planner": "jerk_limited", "to": {**PICK, **fields}}


def test_a_pinned_rail_is_where_it_is_said_and_the_arm_reaches_the_pose() -> None:
    arm = load_robot("irb4600")
    for place in (1.0, 1.7):
        plan = planned(go(joints={"rail": place}))
        end = plan.moves[0].planned.end.position
        assert end[0] == place
        tip = shift(place, 0, 0) @ textbook(arm, end[1:])
        np.testing.assert_allclose(tip[:3, 3], PICK["xyz"], atol=1e-9)
        np.testing.assert_allclose(tip[:3, :3], np.diag([1, -1, -1]), atol=1e-9)


def test_branches_of_the_arm_keep_their_names_on_a_rail() -> None:
    ends = {}
    for wrist in ("flip", "no_flip"):
        plan = planned(
            go(joints={"rail": 1.2}, configuration={"wrist": wrist}), limits={"acceleration": 4, "jerk": 40}
        )
        ends[wrist] = plan.moves[0].planned.end.position
        resolved = plan.poses[0]
        assert resolved is not None
        assert resolved.solutions.method.name == "spherical wrist over elbow"
    assert not np.allclose(ends["flip"], ends["no_flip"])


def test_on_a_path_the_rail_goes_evenly_with_s() -> None:
    line = {"planner": "line", "to": {"xyz": [4.5, 0.2, 0.9], "joints": {"rail": 3.4}}, "law": LAW}
    plan = planned(go(joints={"rail": 1.0}), line)
    begun, arm = plan.trajectory.spans[1].start, load_robot("irb4600")
    for time in np.linspace(0, 3, 13):
        q = plan.trajectory.curve.evaluate(min(begun + time, plan.trajectory.curve.end), side="left")
        tip = shift(q[0], 0, 0) @ textbook(arm, q[1:])
        s = tip[0, 3] - 2.5
        assert q[0] == pytest.approx(1.0 + 2.4 * s / 2.0, abs=1e-5)
        np.testing.assert_allclose(tip[1:3, 3], [0.2, 0.9], atol=2e-6)
    assert q[0] == pytest.approx(3.4, abs=1e-6)


def test_the_course_along_which_zones_are_flown_keeps_the_rail() -> None:
    line = {"planner": "line", "to": {"xyz": [4.5, 0.2, 0.9], "joints": {"rail": 3.4}}, "law": LAW}
    move = planned(go(joints={"rail": 1.0}), line).moves[1]
    curve = move.planner.course(move.start.position, move.robot, move.planned).curve
    share = np.linspace(0, 1, 5)
    rail = curve.evaluate(curve.start + share * (curve.end - curve.start), side="left")[:, 0]
    np.testing.assert_allclose(rail, 1.0 + 2.4 * share, atol=1e-5)


def test_nothing_is_pinned_where_segments_overlap_in_time() -> None:
    ends = ({"xyz": [2.6, 0.2, 0.9]}, {"xyz": [2.6, 0.3, 0.9], "joints": {"rail": 1.2}})
    path = {
        "planner": "path",
        "corner": "overlap",
        "overlap": 0.1,
        "segments": [{"line": end} for end in ends],
    }
    said = refused(go(joints={"rail": 1.0}), {**path, "law": {"speed": 0.2, "acceleration": 1}})
    assert "no joint is pinned where segments overlap in time" in said


@pytest.mark.full
@pytest.mark.parametrize(
    "law", [{"shape": "quintic", "speed": 0.4, "acceleration": 1}, {"shape": "time_optimal"}]
)
def test_arcs_and_laws_keep_pinned_joints(law: dict[str, Any]) -> None:
    arc = {
        "planner": "arc",
        "via": {"xyz": [2.7, 0.4, 0.9]},
        "to": {"xyz": [2.9, 0.2, 0.9], "joints": {"rail": 1.3}},
    }
    plan = planned(go(joints={"rail": 1.0}), {**arc, "law": law}, limits={"acceleration": 4})
    assert plan.moves[1].planned.end.position[0] == pytest.approx(1.3, abs=1e-6)


def test_a_pinned_point_is_approached_at_its_place_on_the_rail() -> None:
    points = {"pick": {**PICK, "joints": {"rail": 1.0}}}
    plan = planned(
        {"planner": "jerk_limited", "to": "pick", "approach": 0.1}, points=points, defaults={"law": LAW}
    )
    assert [move.planned.end.position[0] for move in plan.moves] == pytest.approx([1.0, 1.0], abs=1e-6)
    above = {"from": "pick", "offset": {"xyz": [0, 0, -0.1]}, "joints": {"rail": 1.5}}
    plan = planned({"planner": "jerk_limited", "to": above}, points=points)
    assert plan.moves[0].planned.end.position[0] == 1.5


def test_a_job_with_pins_and_a_rail_is_resolved_to_the_same_curve() -> None:
    line = {"planner": "line", "to": {"xyz": [3.5, 0.2, 0.9], "joints": {"rail": 2.1}}, "law": LAW}
    fields = {
        "base": {"xyz": [0, 0, 0.2], "rpy": [0, 0, 0.1]},
        "output": {"in": "base", "columns": ["t", "pose"]},
    }
    plan = planned(go(joints={"rail": 1.0}), line, **fields)
    again = plan_job(job_from_text(dump_job(plan.loaded)))
    assert again.trajectory.curve.coefficients.tobytes() == plan.trajectory.curve.coefficients.tobytes()
    np.testing.assert_allclose(again.loaded.robot_of_rows.base, plan.loaded.robot_of_rows.base, atol=1e-15)


@pytest.mark.parametrize(
    "name", ["ur5e", "irb4600", "kr210_l150", "panda", "scara", "puma560_akb", "stanford"]
)
@pytest.mark.parametrize("axis", ["x", "y", "z", [1, -2, 0.5], [0, 0, -1]])
def test_an_arm_on_a_rail_is_the_arm_moved_along_the_axis(name: str, axis: Any) -> None:
    job = {
        **HEAD,
        "robot": {"rail": {"axis": axis}, "arm": name},
        "base": {"xyz": [1, 2, 3], "rpy": [0.1, 0.2, 0.3]},
    }
    arm, rng = load_robot(name), np.random.default_rng(3)
    job |= {
        "start": {"joints": 0},
        "moves": [{"planner": "hold", "duration": 1}],
        "limits": {"acceleration": 1},
    }
    robot = job_from_text(json.dumps(job)).robot
    unit = {"x": [1, 0, 0], "y": [0, 1, 0], "z": [0, 0, 1]}.get(str(axis), axis)
    base = shift(1, 2, 3) @ turn(2, 0.3) @ turn(1, 0.2) @ turn(0, 0.1)
    for _ in range(3):
        q = rng.uniform(-1, 1, len(arm.joints) + 1)
        along = q[0] * np.array(unit) / np.linalg.norm(unit)
        wanted = base @ shift(*along) @ arm.base @ textbook(arm, q[1:])
        np.testing.assert_allclose(forward(robot, q), wanted, atol=1e-12)
    urdf = chain_of(robot)
    assert urdf.joints[0].prismatic


def test_a_mount_turns_the_arm_on_its_carriage() -> None:
    hanging = {"rail": RAIL, "arm": "ur5e", "mount": {"xyz": [0, 0.1, 2], "rpy": [np.pi, 0, 0]}}
    plan = planned(
        {"planner": "hold", "duration": 1}, robot=hanging, start={"joints": [1, 0, -1, 1, 0, 1, 0]}
    )
    arm, q = load_robot("ur5e"), np.array([0, -1, 1, 0, 1, 0.0])
    wanted = shift(1, 0.1, 2) @ turn(0, np.pi) @ textbook(arm, q)
    np.testing.assert_allclose(forward(plan.loaded.robot, np.array([1, *q])), wanted, atol=1e-12)


def test_the_force_on_a_rail_is_mass_times_acceleration() -> None:
    from trajcli.dynamics.newton_euler import InverseDynamics

    rail = {
        "axis": [0, 1, 0],
        "mass": 100,
        "rotor": 20,
        "friction": {"coulomb": 30, "viscous": 4},
        "effort": 2000,
    }
    plan = planned(
        {"planner": "hold", "duration": 1}, robot={"rail": rail, "arm": "ur5e"}, limits={"effort": "robot"}
    )
    robot, arm = plan.loaded.robot, load_robot("ur5e")
    mass = 100 + sum(joint.link.mass for joint in arm.joints if joint.link is not None)
    rest, moving = np.zeros(7), np.array([0.5, *[0] * 6])
    force = InverseDynamics(robot).effort(np.ones(7)[None], moving[None], (4 * moving)[None])[0, 0]
    assert force == pytest.approx((mass + 20) * 2 + 30 + 4 * 0.5)
    assert robot.limits.effort[0].tolist() == [-2000, 2000]
    held = InverseDynamics(robot).effort(np.ones(7)[None], rest[None], rest[None])[0, 1:]
    np.testing.assert_allclose(
        held, InverseDynamics(arm).effort(np.ones((1, 6)), rest[None, 1:], rest[None, 1:])[0]
    )


@pytest.mark.parametrize(
    "name", few([name for name in catalogue_names() if len(load_robot(name).joints) == 7], 3)
)
@pytest.mark.parametrize("pinned", [0, 2, 4, 6])
def test_an_arm_without_a_pinned_joint_reaches_the_same_poses(name: str, pinned: int) -> None:
    robot, rng = load_robot(name), np.random.default_rng(5)
    q = rng.uniform(*robot.limits.position.T.clip(-1.2, 1.2))
    others = [joint for joint in range(7) if joint != pinned]
    rest = without_pinned(robot, {pinned: float(q[pinned])})
    np.testing.assert_allclose(forward(rest, q[others]), robot.base @ textbook(robot, q), atol=1e-12)
    found = solve(rest, forward(robot, q), q[others])
    gap = np.where(found.valid, np.abs(found.joints - q[others]).max(axis=-1), np.inf)
    assert gap.min() < 1e-6


def test_the_elbow_of_a_redundant_arm_is_pinned() -> None:
    start = [0, 0.5, 0, -1.2, 0, 1.0, 0]
    pose = forward(load_robot("iiwa14"), np.array([0.2, 0.6, 0.3, -1.1, 0.1, 0.9, 0.2]))
    to = {"xyz": pose[:3, 3].tolist(), "matrix": pose[:3, :3].tolist(), "joints": {"joint_a3": 0.3}}
    names = load_robot("iiwa14").joint_names
    to["joints"] = {names[2]: 0.3}
    plan = planned({"planner": "jerk_limited", "to": to}, robot="iiwa14", start={"joints": start})
    end = plan.moves[0].planned.end.position
    assert end[2] == 0.3
    np.testing.assert_allclose(forward(plan.loaded.robot, end), pose, atol=1e-9)


def refused(*moves: dict[str, Any], **fields: Any) -> str:
    with pytest.raises(TrajcliError) as caught:
        planned(*moves, **fields)
    return "".join(f"{problem.message}\n{problem.hint or ''}\n" for problem in caught.value.problems)


@pytest.mark.full
@pytest.mark.parametrize(
    ("begin", "end", "rail"),
    few([((2.5, 0.2, 0.9), 4.5, 0.5), ((2.5, 0.2, 0.9), 4.5, 0.0), ((1.8, 0.0, 1.6), -1.5, 1.1)], 1),
)
def test_a_pinned_rail_that_leaves_the_arm_behind_is_named(begin, end: float, rail: float) -> None:
    """The wrist is as far from the shoulder as both links are long: in a plane through the first axis."""
    line = {"planner": "line", "law": LAW}
    text = refused(
        go(xyz=begin, joints={"rail": 1.0}),
        {**line, "to": {"xyz": [end, *begin[1:]], "joints": {"rail": rail}}},
    )
    found = re.search(r"with rail as it is pinned, .* beyond s = (\S+) m: it stays up to (\S+) m away", text)
    assert found is not None, text
    (place, away), (first, shoulder, elbow, wrist, _, flange) = found.groups(), load_robot("irb4600").joints
    share = np.array([float(place) / abs(end - begin[0]), 1.0])
    beside = np.hypot(begin[0] - 1.0 + share * (end - begin[0] - rail + 1.0), begin[1])
    distances = np.hypot(beside - first.a, begin[2] + flange.d - first.d)
    reached = shoulder.a + np.hypot(elbow.a, wrist.d)
    np.testing.assert_allclose(distances, reached + np.array([0.0, float(away)]), atol=1e-5)
    assert ", or give rail another value at the target" in text


def test_no_other_orientation_is_advised_where_the_arm_is_left_behind_in_any() -> None:
    far = json.dumps({**HEAD, "moves": [go(xyz=[5.9, 0.2, 0.9], joints={"rail": 0})]})
    with pytest.raises(TrajcliError, match="cannot reach the pose") as caught:
        plan_job(job_from_text(far))
    assert caught.value.problems[0].hint == "move the target"


def test_another_value_of_a_pinned_rail_lets_the_arm_reach_the_path() -> None:
    line = {"planner": "line", "to": {"xyz": [4.5, 0.2, 0.9], "joints": {"rail": 3.4}}, "law": LAW}
    planned(go(joints={"rail": 1.0}), line)


def test_a_singularity_on_the_way_of_a_pinned_rail_is_named() -> None:
    """The wrist passes the axis of the first joint after 0.8 m."""
    line = {"planner": "line", "to": {"xyz": [0.5, 0.0, 1.6], "joints": {"rail": 1.0}}, "law": LAW}
    text = refused(go(xyz=[1.8, 0.0, 1.6], joints={"rail": 1.0}), line)
    found = re.search(r"runs into a singularity at s = ([0-9.]+) m.* singular value ([0-9.e-]+)\)", text)
    assert found is not None, text
    assert float(found[1]) == pytest.approx(0.8, abs=1e-4)
    assert float(found[2]) < 1e-5


@pytest.mark.full
def test_what_cannot_be_pinned_is_refused() -> None:
    line = {"planner": "line", "law": LAW}
    two = {"joints": {"rail": 1.1, "joint_1": 0.1}}
    said = refused(go(joints={"rail": 1.0}), {**line, "to": {**PICK, "xyz": [2.6, 0.2, 0.9], **two}})
    assert "2 joints cannot be pinned (rail, joint_1): the pose leaves 1 of 7 joints" in said
    said = refused(go(joints={"rail": 1.0}), {**line, "to": {**PICK, "joints": {"rail": 1.1}}})
    assert "rail cannot go evenly along a path of no length" in said
    said = refused(go(joints={"rail": 6.5}))
    assert "has rail at 6.5 m, its limit is 6 m" in said or "cannot reach the pose" in said
    assert "no value for joint_1" in refused({"planner": "jerk_limited", "to": {"joints": {"rail": 1}}})
    assert "joints and xyz exclude each other" in refused(go(joints=[1, 0, 0, 0, 0, 0, 0]))
    assert "the robot has no joint 'track'" in refused(go(joints={"track": 1}))
    inner = {
        "planner": "path",
        "law": LAW,
        "segments": [{"line": {"xyz": [2.6, 0.2, 0.9], "joints": {"rail": 1}}}],
    }
    inner["radius"] = 0.02
    inner["segments"].append({"line": {"xyz": [2.6, 0.3, 0.9]}})  # type: ignore[attr-defined]
    assert "goes evenly along the whole path" in refused(
        go(joints={"rail": 1.0}),
        inner,
        limits={"acceleration": 4, "jerk": 40, "tcp": {"speed": 1, "acceleration": 2}},
    )


@pytest.mark.parametrize(
    ("robot", "message"),
    [
        ({"rail": {}, "arm": "ur5e"}, "`axis` is missing"),
        ({"rail": {"axis": "w"}, "arm": "ur5e"}, "expected 3 numbers"),
        ({"rail": {"axis": "x", "positon": [0, 1]}, "arm": "ur5e"}, "unknown key 'positon'"),
        ({"rail": RAIL}, "`arm` is missing"),
        ({"rail": RAIL, "arm": "ur55"}, "the catalogue has no robot 'ur55'"),
        ({"rail": RAIL, "arm": {"joints": 6}}, "has bare joints and no geometry to stand on a rail"),
        ({"rail": {**RAIL, "name": "wrist_1_joint"}, "arm": "ur5e"}, "'wrist_1_joint' is a joint of UR5e"),
        ({"rail": RAIL, "arm": "ur5e", "tool": {}}, "unknown key 'tool'"),
    ],
)
def test_wrong_rails_are_refused_where_they_are_wrong(robot: Any, message: str) -> None:
    with pytest.raises(InputError) as caught:
        job_from_text(json.dumps({**HEAD, "robot": robot, "moves": [go()]}), "job.yaml")
    problem = next(problem for problem in caught.value.problems if message in problem.message)
    assert problem.place is not None


def test_the_file_of_an_arm_on_a_rail_is_one_of_the_files_of_the_job(tmp_path: Path) -> None:
    (tmp_path / "arm.yaml").write_text(robot_file("irb4600"))
    robot = {"rail": RAIL, "arm": {"file": "arm.yaml"}}
    (tmp_path / "job.yaml").write_text(
        json.dumps({**HEAD, "robot": robot, "moves": [go(joints={"rail": 1})]})
    )
    loaded = load_job(tmp_path / "job.yaml")
    assert ("the robot's file", str(tmp_path / "arm.yaml")) in list(files_of(loaded.document))
    assert loaded.robot.joint_names == ("rail", *load_robot("irb4600").joint_names)
