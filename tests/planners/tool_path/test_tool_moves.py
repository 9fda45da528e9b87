"""Lines, arcs and screws as jobs: what must hold of the joints, by inverse kinematics and by laws."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp
from tool_jobs import (
    DOWN,
    FINE,
    LEFT,
    LENGTH,
    LIMITS,
    ROUND,
    START,
    TCP,
    TO,
    arm,
    line,
    plan,
    poses_of,
    refusal,
    rows,
    times_of,
    tool_rates,
)

from trajcli.errors import PlanningError
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.solve import solve

PUMA = [0.3, 0.6, -0.7, 0.4, 0.9, -0.3]


def nearest(robot, poses, near):
    """Return the nearest answers (N, n) of inverse kinematics to joints (N, n), and their branch numbers (N,)."""
    found = solve(robot, poses, near)
    away = np.where(found.valid, np.abs(found.joints - near[:, None]).max(axis=-1), np.inf)
    branch = away.argmin(axis=1)
    return found.joints[np.arange(len(near)), branch], branch


def puma_target(turn=(0.2, 0.3, -0.4), way=(-0.05, 0.15, 0.05)):
    pose = forward(arm("puma560"), np.array(PUMA))
    pose[:3, :3] = Rotation.from_rotvec(turn).as_matrix() @ pose[:3, :3]
    pose[:3, 3] += way
    return {"matrix": rows(pose)}


LAW_2S = {"law": {"shape": "quintic", "duration": 2}}
ARMS = {
    "ur5e": ("ur5e", START, TO),
    "puma560": ("puma560", {"joints": PUMA}, puma_target()),
}


@pytest.mark.parametrize("name", ARMS)
def test_a_fine_line_agrees_with_inverse_kinematics_at_every_sample(name):
    """The poses of a line, interpolated here, are solved for all branches; rows at 1 kHz are on one of them."""
    robot, start, to = ARMS[name]
    made = plan(robot, start, line(to, **LAW_2S, **FINE), limits={**LIMITS, "tcp": {}})
    times = times_of(made, 2001)
    q = made.trajectory.curve.evaluate(times)
    ends = poses_of(made, np.array([0.0, made.trajectory.duration]))
    x = times / 2
    part = 10 * x**3 - 15 * x**4 + 6 * x**5
    poses = np.tile(np.eye(4), (times.size, 1, 1))
    poses[:, :3, 3] = ends[0, :3, 3] + part[:, None] * (ends[1, :3, 3] - ends[0, :3, 3])
    turning = Slerp([0, 1], Rotation.from_matrix(ends[:, :3, :3]))
    poses[:, :3, :3] = turning(np.clip(part, 0, 1)).as_matrix()
    answers, branch = nearest(arm(name), poses, q)
    assert np.abs(answers - q).max() < 1e-9
    assert len(set(branch)) == 1


def test_the_rate_does_not_matter():
    curves = [plan("ur5e", START, line(), output={"rate": rate}).trajectory.curve for rate in (100, 10_000)]
    np.testing.assert_array_equal(curves[0].breaks, curves[1].breaks)
    np.testing.assert_array_equal(curves[0].coefficients, curves[1].coefficients)


def test_a_rotation_in_place():
    made = plan("ur5e", START, line({"rpy": [np.pi, 0, 0.8]}))
    poses = poses_of(made, times_of(made))
    assert np.abs(poses[:, :3, 3] - START["xyz"]).max() < 1e-6
    vectors = Rotation.from_matrix(poses[:, :3, :3] @ poses[0, :3, :3].T).as_rotvec()
    assert vectors[-1] == pytest.approx([0, 0, 0.8], abs=1e-6)
    assert np.abs(vectors[:, :2]).max() < 1e-6
    assert made.trajectory.duration == pytest.approx(0.8 / 1.5 + 1.5 / 12, rel=1e-9)


@pytest.mark.parametrize(
    "move", [line({"xyz": START["xyz"], "rpy": DOWN}), line({"rpy": DOWN}), line({"xyz": START["xyz"]})]
)
@pytest.mark.parametrize("law", [{}, {"law": {"shape": "quintic", "duration": 1.5}}])
def test_a_move_without_length_is_held(move, law):
    made = plan("ur5e", START, {**move, **law})
    assert made.trajectory.duration == (1.5 if law else 0.0)
    q = made.trajectory.curve.evaluate(times_of(made, 5))
    np.testing.assert_array_equal(q, np.tile(q[0], (5, 1)))


def test_axis_angle_is_the_shortest_rotation_about_a_fixed_axis():
    to = {"xyz": TO["xyz"], "rpy": [2.5, 0.4, 0.7]}
    made = plan("ur5e", START, line(to))
    poses = poses_of(made, times_of(made))
    first = poses[0, :3, :3]
    vectors = Rotation.from_matrix(poses[:, :3, :3] @ first.T).as_rotvec()
    axis = vectors[-1] / np.linalg.norm(vectors[-1])
    assert np.abs(np.cross(vectors, axis)).max() < 3e-6
    assert np.linalg.norm(vectors[-1]) < np.pi
    part = np.linalg.norm(poses[:, :3, 3] - poses[0, :3, 3], axis=1) / LENGTH
    np.testing.assert_allclose(vectors @ axis, part * np.linalg.norm(vectors[-1]), atol=5e-6)


def test_euler_goes_evenly_in_the_targets_angles():
    to = {"xyz": TO["xyz"], "euler": {"sequence": "XYZ", "angles": [2.6, 0.3, -0.4]}}
    made = plan("ur5e", START, line(to, orientation="euler"))
    poses = poses_of(made, times_of(made, 41))
    part = np.linalg.norm(poses[:, :3, 3] - poses[0, :3, 3], axis=1) / LENGTH
    wanted = np.array([np.pi, 0, 0]) + part[:, None] * (np.array([2.6, 0.3, -0.4]) - [np.pi, 0, 0])
    peers = Rotation.from_euler("XYZ", wanted).as_matrix()
    np.testing.assert_allclose(poses[:, :3, :3], peers, atol=5e-6)


def test_fixed_keeps_the_orientation():
    made = plan("ur5e", START, line({"xyz": TO["xyz"]}, orientation="fixed"))
    poses = poses_of(made, times_of(made))
    assert np.abs(poses[:, :3, :3] - poses[0, :3, :3]).max() < 2e-6
    assert "asks for another one" in str(refusal("ur5e", START, line(orientation="fixed")))


def test_tangent_keeps_the_tools_attitude_to_the_path():
    made = plan("ur5e", START, {"planner": "arc", **ROUND, "orientation": "tangent"})
    poses = poses_of(made, times_of(made))
    spokes = poses[:, :3, 3] - ROUND["center"]
    local = np.einsum("nji,nj->ni", poses[:, :3, :3], spokes)
    np.testing.assert_allclose(local, np.tile(local[0], (len(local), 1)), atol=2e-6)
    assert np.linalg.norm(spokes, axis=1) == pytest.approx(np.full(len(spokes), 0.05), abs=2e-6)


def test_several_turns_of_a_helix():
    turns = 2.5
    move = {"planner": "arc", **ROUND, "angle": -turns * 2 * np.pi, "pitch": 0.02}
    made = plan("ur5e", START, move)
    poses = poses_of(made, times_of(made, 2001))
    around = np.unwrap(np.arctan2(*(poses[:, :2, 3] - ROUND["center"][:2]).T[::-1]))
    np.testing.assert_allclose(poses[:, 2, 3] - 0.05, (around - around[0]) / (2 * np.pi) * 0.02, atol=2e-6)
    assert around[-1] - around[0] == pytest.approx(-turns * 2 * np.pi, abs=1e-4)
    length = turns * np.hypot(2 * np.pi * 0.05, 0.02)
    assert made.moves[0].planned.tool.law.evaluate(made.trajectory.duration)[0] == pytest.approx(
        length, rel=1e-9
    )


def test_an_arc_to_its_center_goes_the_shorter_way():
    move = {"planner": "arc", "center": ROUND["center"], "to": {"xyz": [0.45, 0.15, 0.05]}}
    made = plan("ur5e", START, move)
    assert made.moves[0].planned.tool.path.length == pytest.approx(0.05 * np.pi / 2)
    longer = plan("ur5e", START, {**move, "axis": [0, 0, -1]})
    assert longer.moves[0].planned.tool.path.length == pytest.approx(0.05 * np.pi * 1.5)


def test_a_bent_path_keeps_the_whole_acceleration_in_its_limit():
    tcp = TCP | {"speed": 1.0, "acceleration": 0.5}
    made = plan("ur5e", START, {"planner": "arc", **ROUND}, limits={**LIMITS, "tcp": tcp})
    acceleration = tool_rates(made, times_of(made, 4001))[2]
    assert 0.35 < acceleration.max() <= 0.5 * (1 + 1e-5)


def test_a_screw_has_a_constant_twist():
    made = plan("ur5e", START, {"planner": "screw", "to": TO})
    poses = poses_of(made, times_of(made, 31))
    relative = poses[0, :3, :3].T @ poses[:, :3, :3]
    vectors = Rotation.from_matrix(relative).as_rotvec()
    assert np.abs(np.cross(vectors, vectors[-1])).max() < 2e-6
    first = poses[1:-1, :3, 3]
    axis = Rotation.from_matrix(poses[-1, :3, :3] @ poses[0, :3, :3].T).as_rotvec()
    angle = np.linalg.norm(axis)
    axis /= angle
    pitch = axis @ (poses[-1, :3, 3] - poses[0, :3, 3]) / angle
    turned = Rotation.from_matrix(poses[1:-1, :3, :3] @ poses[0, :3, :3].T).as_rotvec() @ axis
    np.testing.assert_allclose((first - poses[0, :3, 3]) @ axis, pitch * turned, atol=3e-6)
    # all points are as far from the axis of the screw
    across = np.eye(3) - np.outer(axis, axis)
    chord = across @ (poses[-1, :3, 3] - poses[0, :3, 3])
    center = poses[0, :3, 3] + chord / 2 + np.cross(axis, chord) / (2 * np.tan(angle / 2))
    away = np.linalg.norm((poses[:, :3, 3] - center) @ across, axis=1)
    np.testing.assert_allclose(away, away[0], atol=3e-6)


@pytest.mark.parametrize("planner", ["line", "screw"])
@pytest.mark.parametrize("turn", [pytest.param(5e-4, marks=pytest.mark.full), 1e-7])
def test_the_tool_turns_in_its_place_however_little(planner, turn):
    to = {**START, "rpy": [np.pi, 0, turn]}
    made = plan("ur5e", START, {"planner": planner, "to": to, **FINE})
    reached = poses_of(made, times_of(made, 2))
    vector = Rotation.from_matrix(reached[1, :3, :3] @ reached[0, :3, :3].T).as_rotvec()
    np.testing.assert_allclose(vector, [0, 0, turn], rtol=0, atol=1e-12)


FEW = {
    "scorbot, place": ("scorbot", [0.1, -0.5, 0.8, -0.2, 0.3], {}, [0.02, 0.03, -0.02]),
    "scorbot, pitch": ("scorbot", [0.1, 0.4, -1.3, 1.2, 0.3], {"pitch": -0.9}, [0.02, 0.03, -0.02]),
    "cobra600": ("cobra600", [0.2, 1.4, 0.1, 0.5], {}, [0.03, 0.02, -0.02]),
    "cobra600, yaw": ("cobra600", [0.2, 1.4, 0.1, 0.5], {"yaw": 1.4, "tool_axis": "x"}, [0.03, 0.02, -0.02]),
    "elbow4r": ("elbow4r", [0.3, 0.6, -0.9, 0.2], {}, [0.02, 0.03, 0.02]),
    "planar3r, yaw": ("planar3r", [0.3, 0.5, 0.4], {"yaw": 1.5, "tool_axis": "x"}, [-0.05, 0.02, 0]),
    "planar3r, place": ("planar3r", [0.3, 0.5, 0.4], {}, [-0.05, 0.02, 0]),
    "rrp": ("rrp", [0.3, 0.5, 0.3], {}, [0.02, 0.02, 0.02]),
}


@pytest.mark.parametrize("name", FEW)
def test_arms_with_fewer_joints_follow_what_their_targets_fix(name):
    robot, q, aim, way = FEW[name]
    place = forward(arm(robot), np.array(q))[:3, 3]
    to = {"xyz": rows(place + way), **aim}
    made = plan(robot, {"joints": q}, line(to), when_over_limit="slow")
    poses = poses_of(made, times_of(made))
    away = np.cross(poses[:, :3, 3] - place, np.array(way) / np.linalg.norm(way))
    assert np.linalg.norm(away, axis=1).max() < 2e-6
    np.testing.assert_allclose(poses[-1, :3, 3], place + way, atol=2e-6)
    k = "xyz".index(aim.get("tool_axis", "z"))
    axis = poses[:, :3, k]
    if "yaw" in aim:
        heading = np.unwrap(np.arctan2(axis[:, 1], axis[:, 0]))
        assert heading[-1] == pytest.approx(aim["yaw"], abs=2e-6)
    if "pitch" in aim:
        assert np.arcsin(axis[-1, 2]) == pytest.approx(aim["pitch"], abs=2e-6)
        part = np.linalg.norm(poses[:, :3, 3] - place, axis=1) / np.linalg.norm(way)
        elevation = np.arcsin(axis[:, 2])
        np.testing.assert_allclose(elevation, elevation[0] + part * (aim["pitch"] - elevation[0]), atol=5e-6)


def test_a_seven_joint_arm_comes_back_to_where_it_was():
    """What its target leaves free is a function of the place, on one path."""
    start = [0, -0.5, 0.2, -2, 0.1, 1.6, 0.7]
    place = forward(arm("panda"), np.array(start))[:3, 3]
    there, back = ({"line": {"xyz": rows(place + way)}} for way in ([0.1, 0.1, -0.1], [0, 0, 0]))
    move = {"planner": "path", "segments": [there, back], "corner": "stop"}
    made = plan("panda", {"joints": start}, move, when_over_limit="slow")
    assert np.abs(made.trajectory.curve.evaluate(made.trajectory.duration / 2) - start).max() > 0.1
    np.testing.assert_allclose(made.trajectory.end.position, start, atol=3e-6)


def test_the_branch_is_the_starts_and_a_configuration_must_be_it():
    made = plan("ur5e", START, line({**TO, "configuration": LEFT}))
    _, branch = nearest(
        arm("ur5e"), poses_of(made, times_of(made, 99)), made.trajectory.curve.evaluate(times_of(made, 99))
    )
    assert len(set(branch)) == 1
    error = refusal("ur5e", START, line({**TO, "configuration": {"elbow": "down"}}))
    assert isinstance(error, PlanningError)
    assert "arrives in the configuration left up no_flip, not down" in str(error)
    assert "keeps its branch" in error.problems[0].hint


def test_joints_as_target():
    end = plan("ur5e", START, line(TO)).trajectory.end.position
    made = plan("ur5e", START, line({"joints": rows(end)}))
    np.testing.assert_allclose(made.trajectory.end.position, end, atol=3e-6)
    other = end.copy()
    other[5] += 2 * np.pi
    error = refusal("ur5e", START, line({"joints": rows(other)}))
    assert "wrist_3_joint" in str(error)
    assert "instead of" in str(error)


@pytest.mark.parametrize(
    ("name", "q", "to"),
    [
        ("planar2r", [0.2, 1.0], [0.7, 1.6]),
        ("elbow", [0.2, 1.0, -0.9], [0.7, 0.9, -1.1]),
        ("cylindrical", [0.2, 0.3, 0.3], [0.7, 0.4, 0.4]),
        ("planar3r", [0.2, 1.0, 0.2], [0.7, 1.5, -0.3]),
        ("scara", [0.2, 1.0, 0.1, 0.0], [0.7, 1.5, 0.2, 0.9]),
    ],
)
def test_joints_are_a_target_of_arms_with_few_joints(name, q, to):
    """Where the place decides them the tool turns as the arm lets it, else evenly."""
    places = forward(arm(name), np.array([q, to]))[:, :3, 3]
    made = plan(name, {"joints": q}, line({"joints": to}), when_over_limit="slow")
    np.testing.assert_allclose(made.trajectory.end.position, to, atol=3e-6)
    along = poses_of(made, times_of(made))[:, :3, 3] - places[0]
    assert np.linalg.norm(np.cross(along, np.diff(places, axis=0)[0]), axis=1).max() < 2e-6


def test_moves_one_after_the_other():
    moves = [
        line(TO),
        {"planner": "hold", "duration": 0.2},
        {"planner": "arc", **ROUND, "center": [0.4, 0.35, 0.25]},
    ]
    made = plan("ur5e", START, *moves)
    assert [span.planner for span in made.trajectory.spans] == ["line", "hold", "arc"]
    q = [
        made.trajectory.curve.evaluate(made.trajectory.spans[1].start, side=side)
        for side in ("left", "right")
    ]
    np.testing.assert_allclose(*q, atol=1e-12)
