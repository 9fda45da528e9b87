"""Lines, arcs, screws and paths as jobs: what must hold of the joints, by inverse kinematics and by laws."""

from __future__ import annotations

import copy
import re

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp
from tool_jobs import LIMITS, TCP, arm, plan, planned, poses_of, refusal, rows, times_of

from trajcli.errors import MissingLimitError, PlanningError
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.jacobian import tcp_acceleration, tcp_twist

DOWN = [np.pi, 0, 0]
LEFT = {"shoulder": "left", "elbow": "up", "wrist": "no_flip"}
START = {"xyz": [0.4, 0.1, 0.05], "rpy": DOWN, "configuration": LEFT}
TO = {"xyz": [0.4, 0.3, 0.25], "rpy": [np.pi, 0, 0.8]}
LENGTH = np.hypot(0.2, 0.2)
FINE = {"tolerance": {"position": 1e-9, "angle": 1e-9}}
PUMA = [0.3, 0.6, -0.7, 0.4, 0.9, -0.3]
SHAPES = ["trapezoid", "cubic", "quintic", "cycloidal", "jerk_limited", "time_optimal"]


def line(to=TO, **fields):
    return {"planner": "line", "to": to, **fields}


def tool_rates(made, times):
    """Return the magnitudes (4, N) of the tool's speed, angular speed and accelerations."""
    robot, curve = made.moves[0].robot, made.trajectory.curve
    q, qd, qdd = (curve.evaluate(times, order) for order in range(3))
    both = tcp_twist(robot, q, qd), tcp_acceleration(robot, q, qd, qdd)
    return np.stack(
        [np.linalg.norm(rates[:, part], axis=1) for rates in both for part in (slice(3), slice(3, 6))]
    )


def nearest(robot, poses, near):
    """Return the nearest answers (N, n) of inverse kinematics to joints (N, n), and their branch numbers (N,)."""
    found = solve(robot, poses, near)
    away = np.where(found.valid, np.abs(found.joints - near[:, None]).max(axis=-1), np.inf)
    branch = away.argmin(axis=1)
    return found.joints[np.arange(len(near)), branch], branch


def puma_target(turn=(0.2, 0.3, -0.4), way=(-0.05, 0.15, 0.05)):
    from trajcli.kinematics.forward import forward

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


def peaks_of(shape, length, tcp=TCP):
    """Return how long a law lasts with the tool's speed and acceleration, from its own peaks."""
    v, a, j = tcp["speed"], tcp["acceleration"], tcp.get("jerk", np.inf)
    if shape in ("trapezoid", "time_optimal"):
        return length / v + v / a if length > v * v / a else 2 * np.sqrt(length / a)
    if shape == "jerk_limited":
        return length / v + v / a + a / j
    c1, c2, c3 = {
        "cubic": (1.5, 6, 12),
        "quintic": (15 / 8, 10 / np.sqrt(3), 60),
        "cycloidal": (2, 2 * np.pi, 4 * np.pi**2),
    }[shape]
    return max(c1 * length / v, np.sqrt(c2 * length / a), np.cbrt(c3 * length / j))


@pytest.mark.parametrize("shape", SHAPES)
def test_the_fastest_law_of_each_shape(shape):
    tcp = TCP | ({"jerk": 25.0} if shape == "jerk_limited" else {})
    to = {"xyz": TO["xyz"], "rpy": DOWN}
    made = plan("ur5e", START, line(to, law={"shape": shape}), limits={**LIMITS, "tcp": tcp})
    assert made.trajectory.duration == pytest.approx(peaks_of(shape, LENGTH, tcp), rel=2e-3)
    speed, spin, acceleration, _ = tool_rates(made, times_of(made, 4001))
    assert speed.max() <= TCP["speed"] * (1 + 1e-5)
    assert acceleration.max() <= TCP["acceleration"] * (1 + 1e-5)
    assert max(speed.max() / TCP["speed"], acceleration.max() / TCP["acceleration"]) > 0.99
    assert spin.max() < 1e-5
    offsets = poses_of(made, times_of(made))[:, :3, 3] - START["xyz"]
    along = np.array([0, 1, 1]) / np.sqrt(2)
    assert np.linalg.norm(np.cross(offsets, along), axis=1).max() < 1e-6
    assert (np.diff(offsets @ along) > -1e-9).all()


@pytest.mark.parametrize("shape", SHAPES)
def test_the_fastest_law_of_a_short_way_is_ruled_by_acceleration(shape):
    law = {"shape": shape} | ({"jerk": 1e4} if shape == "jerk_limited" else {})
    made = plan("ur5e", START, line({"xyz": [0.4, 0.105, 0.05], "rpy": DOWN}, law=law))
    wanted = peaks_of("trapezoid" if shape == "jerk_limited" else shape, 0.005)
    assert made.trajectory.duration == pytest.approx(wanted, rel=5e-3)
    acceleration = tool_rates(made, times_of(made, 4001))[2]
    assert acceleration.max() == pytest.approx(TCP["acceleration"], rel=1e-3)


@pytest.mark.parametrize("shape", ["trapezoid", "cubic", "quintic", "cycloidal"])
def test_a_duration_is_kept(shape):
    made = plan("ur5e", START, line(law={"shape": shape, "duration": 3.0}))
    assert made.trajectory.duration == 3.0
    middle = poses_of(made, np.array([1.5]))[0, :3, 3]
    np.testing.assert_allclose(middle, [0.4, 0.2, 0.15], atol=2e-6)


@pytest.mark.parametrize("shape", SHAPES)
def test_a_minimum_duration_is_no_less(shape):
    jerk = {"jerk": 25.0} if shape == "jerk_limited" else {}
    made = plan("ur5e", START, line(law={"shape": shape, "minimum_duration": 4.0, **jerk}))
    assert made.trajectory.duration == pytest.approx(4.0, rel=1e-12)
    short = plan("ur5e", START, line(law={"shape": shape, "minimum_duration": 0.01, **jerk}))
    assert short.trajectory.duration > 1.0


def test_a_law_names_its_own_speeds():
    law = {"speed": 0.1, "acceleration": 0.5, "deceleration": 0.25}
    made = plan("ur5e", START, line({"xyz": TO["xyz"], "rpy": DOWN}, law=law))
    assert made.trajectory.duration == pytest.approx(LENGTH / 0.1 + 0.1 / 2 * (1 / 0.5 + 1 / 0.25), rel=1e-9)
    names = [phase.name for phase in made.moves[0].planned.phases]
    assert len(names) == 3
    speed = tool_rates(made, np.array([made.trajectory.duration / 2]))[0]
    assert speed == pytest.approx(0.1, rel=1e-6)


def test_the_slower_of_translation_and_rotation_rules():
    near = {"xyz": [0.4, 0.12, 0.05], "rpy": [np.pi, 0, 0.8]}
    slow = plan("ur5e", START, line(near))
    assert slow.moves[0].planned.tool.ruled_by == "rotation"
    assert slow.trajectory.duration == pytest.approx(0.8 / 1.5 + 1.5 / 12, rel=1e-9)
    assert tool_rates(slow, times_of(slow))[1].max() == pytest.approx(1.5, rel=1e-5)
    assert plan("ur5e", START, line(TO)).moves[0].planned.tool.ruled_by == "translation"


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


ROUND = {"center": [0.4, 0.15, 0.05], "axis": "z", "angle": 2.0}


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
    from trajcli.kinematics.forward import forward

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
    from trajcli.kinematics.forward import forward

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


def test_a_move_over_a_joints_limit_is_judged_and_slowed():
    fast = line(law={"shape": "quintic", "duration": 0.05})
    made = planned("ur5e", START, fast, limits={"acceleration": 14})
    assert {finding.kind for finding in made.verdict.findings} >= {"acceleration", "velocity"}
    slow = plan("ur5e", START, {**fast, "when_over_limit": "slow"}, limits={"acceleration": 14})
    peak = np.abs(slow.trajectory.curve.evaluate(times_of(slow, 4001), 2)).max()
    assert 13.5 < peak <= 14 * (1 + 1e-9)
    assert "slowed" in {event.kind for event in slow.events}
    law = slow.moves[0].planned.tool.law
    assert law.duration == pytest.approx(slow.trajectory.duration, rel=1e-12)


def test_a_slower_move_keeps_the_tools_limits_too():
    fast = line({"xyz": TO["xyz"], "rpy": DOWN}, law={"shape": "cubic", "duration": 0.5})
    made = planned("ur5e", START, fast)
    assert {finding.kind for finding in made.verdict.findings} >= {"tool_speed", "tool_acceleration"}
    slow = plan("ur5e", START, {**fast, "when_over_limit": "slow"})
    assert slow.trajectory.duration == pytest.approx(peaks_of("cubic", LENGTH), rel=1e-3)


def test_align_stretches_to_whole_periods():
    made = plan("ur5e", START, line(), output={"rate": 100, "align": True})
    ticks = made.trajectory.duration * 100
    assert ticks == pytest.approx(round(ticks), abs=1e-9)
    assert made.moves[0].planned.tool.law.duration == pytest.approx(made.trajectory.duration, rel=1e-12)


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


def test_limits_of_a_move_are_tighter():
    to = {"xyz": TO["xyz"], "rpy": DOWN}
    slower = plan("ur5e", START, line(to, limits={"tcp": {"speed": 0.1}}))
    assert slower.trajectory.duration == pytest.approx(LENGTH / 0.1 + 0.1 / 2, rel=1e-9)
    for name in TCP:
        error = refusal("ur5e", START, line(to, limits={"tcp": {name: TCP[name] * 2}}))
        assert error.exit_code == 2
        assert "can only tighten" in str(error)
        assert name.replace("_", " ") in str(error)
    assert plan("ur5e", START, line(to, limits={"tcp": dict(TCP)})).verdict.passed


def test_limits_are_scaled():
    to = {"xyz": TO["xyz"], "rpy": DOWN}
    scaled = {**LIMITS, "scale": {"velocity": 0.5, "acceleration": 0.25}}
    made = plan("ur5e", START, line(to), limits=scaled)
    assert made.trajectory.duration == pytest.approx(LENGTH / 0.125 + 0.125 / 0.5, rel=1e-9)


def without(*names):
    limits = copy.deepcopy(LIMITS)
    for name in names:
        del limits["tcp"][name]
    return limits


MISSING = [
    (line(), ("speed", "acceleration", "angular_speed", "angular_acceleration"), "acceleration"),
    (
        line(law={"shape": "cubic"}),
        ("speed", "acceleration", "angular_speed", "angular_acceleration"),
        "speed",
    ),
    (line(law={"shape": "jerk_limited"}), (), "jerk"),
    (line({"rpy": [np.pi, 0, 0.8]}), ("angular_acceleration",), "angular_acceleration"),
    (
        line({"rpy": [np.pi, 0, 0.8]}, law={"shape": "cubic"}),
        ("angular_speed", "angular_acceleration"),
        "angular_speed",
    ),
    (line(law={"duration": 3}), ("acceleration", "angular_acceleration"), "speed"),
]


@pytest.mark.parametrize(("move", "names", "key"), MISSING)
def test_a_missing_limit_is_named_by_its_key(move, names, key):
    error = refusal("ur5e", START, move, limits=without(*names))
    assert isinstance(error, MissingLimitError)
    assert error.exit_code == 2
    assert f"tcp: {{{key}: ...}}" in error.problems[0].hint
    assert error.problems[0].place is not None


def test_the_fastest_law_needs_the_joints_limits():
    error = refusal("ur5e", START, line(law={"shape": "time_optimal"}), limits={"tcp": TCP})
    assert isinstance(error, MissingLimitError)
    assert "acceleration of shoulder_pan_joint" in str(error)


def segment(**fields):
    return {"planner": "path", "segments": [{"line": {"xyz": [0.4, 0.3, 0.05]}}, {"line": TO}], **fields}


TWO = [{"line": {"xyz": [0.4, 0.3, 0.05]}}, {"line": {"xyz": [0.5, 0.3, 0.05]}}]
WRONG = {
    "moving end": (line({**TO, "velocity": 0.1}), "line ends at rest", 2),
    "no place": (line({"velocity": 0}), "needs a pose or `joints`", 2),
    "duration of the fastest": (
        line(law={"shape": "time_optimal", "duration": 2}),
        "as short as its limits",
        2,
    ),
    "jerk of a trapezoid": (line(law={"jerk": 5}), "its jerk cannot be limited", 2),
    "deceleration": (line(law={"shape": "cubic", "deceleration": 1}), "slows down as it speeds up", 2),
    "three of trapezoid": (line(law={"duration": 2, "speed": 0.2, "acceleration": 1}), "ask too much", 2),
    "both durations": (
        line(law={"shape": "cubic", "duration": 2, "minimum_duration": 1}),
        "exclude each other",
        2,
    ),
    "speed out of the interval": (line(law={"duration": 2, "speed": 0.05}), "it must be above", 3),
    "too little time": (line(law={"duration": 0.1}), "no trapezoid|trapezoid over|cannot", 3),
    "tolerance": (line(tolerance={"position": 0}), "above 0", 2),
    "shape": (line(law={"shape": "parabola"}), "parabola", 2),
    "orientation": (line(orientation="euler", to_=1), "to_", 2),
    "euler without angles": (
        line({"xyz": TO["xyz"], "quat_wxyz": [0, 1, 0, 0]}, orientation="euler"),
        "no angles",
        2,
    ),
    "tangent in place": (line({"rpy": DOWN}, orientation="tangent"), "tangent", 3),
    "tangent and a target's": (line(orientation="tangent"), "follows from the path", 3),
    "screw of a place": (
        {"planner": "screw", "to": {"xyz": [0.4, 0.2, 0.1], "yaw": 1, "tool_axis": "x"}},
        "a screw needs the whole",
        2,
    ),
    "arc of nothing": ({"planner": "arc"}, "not given by nothing", 2),
    "arc of too much": ({"planner": "arc", **ROUND, "to": TO}, "not given by", 2),
    "pitch of a via": ({"planner": "arc", "via": TO, "to": TO, "pitch": 0.1}, "a helix is given by", 2),
    "via without place": ({"planner": "arc", "via": {"rpy": DOWN}, "to": TO}, "needs `xyz`", 2),
    "points in a row": (
        {"planner": "arc", "via": {"xyz": [0.4, 0.2, 0.05]}, "to": {"xyz": [0.4, 0.3, 0.05]}},
        "line",
        3,
    ),
    "center at the start": (
        {"planner": "arc", "center": START["xyz"], "axis": "z", "angle": 1.0},
        "needs a radius",
        2,
    ),
    "center not between": (
        {"planner": "arc", "center": [0.4, 0.2, 0.05], "to": {"xyz": [0.4, 0.5, 0.05]}},
        "center",
        3,
    ),
    "no radius": (segment(corner="round"), "has no radius", 2),
    "radius of a stop": (segment(corner="stop", radius=0.01), "corner: stop has no radius", 2),
    "overlap of a stop": (segment(corner="stop", overlap=0.1), "does not overlap", 2),
    "overlap without time": (segment(corner="overlap"), "needs the time", 2),
    "overlap and fastest": (
        segment(corner="overlap", overlap=0.1, law={"shape": "time_optimal"}),
        "laws of their own",
        2,
    ),
    "overlap and euler": (
        segment(corner="overlap", overlap=0.1, orientation="euler"),
        "not defined where",
        2,
    ),
    "overlap too long": (segment(corner="overlap", overlap=5), "too short to overlap", 3),
    "no segments": ({"planner": "path", "segments": []}, "at least 1|segments", 2),
    "two in one": (
        {"planner": "path", "segments": [{"line": TO, "arc": ROUND}]},
        "either a `line` or an `arc`",
        2,
    ),
    "another kind": (
        {
            "planner": "path",
            "corner": "stop",
            "segments": [{"line": TO}, {"line": {"xyz": [0.5, 0.3, 0.05], "yaw": 1, "tool_axis": "x"}}],
        },
        "fixes another part",
        2,
    ),
    "tangent in a corner": (
        {"planner": "path", "corner": "stop", "segments": TWO, "orientation": "tangent"},
        "would jump",
        3,
    ),
}


@pytest.mark.parametrize(("move", "message", "code"), WRONG.values(), ids=WRONG)
def test_wrong_input_is_one_clear_error(move, message, code):
    error = refusal("ur5e", START, move)
    (problem,) = error.problems
    assert any(part in problem.text() for part in message.split("|")), problem.text()
    assert problem.place is not None
    assert problem.place.line == 1
    assert error.exit_code == code


def test_a_moving_start_is_refused():
    run = {"planner": "jerk_limited", "to": {"joints": [0.1, -1.5, 1.5, 0, 1.5, 0], "velocity": 0.1}}
    limits = {**LIMITS, "jerk": 500}
    error = refusal("ur5e", {"joints": [0, -1.5, 1.5, 0, 1.5, 0]}, run, line(), limits=limits)
    assert "rest" in str(error)
    assert error.problems[0].move == 1


def test_bare_joints_have_no_tool():
    error = refusal({"joints": 6}, {"joints": 0}, line())
    assert error.exit_code == 2
    assert "no geometry" in str(error)


def test_out_of_reach_says_where_and_by_how_much():
    """The wrist of a planar arm with the hand along x reaches 0.5 m: by Pythagoras the line ends there."""
    start = {"xyz": [0.45, 0.05, 0], "yaw": 0, "tool_axis": "x", "configuration": {"elbow": "up"}}
    to = {"xyz": [0.45, 0.55, 0], "yaw": 0, "tool_axis": "x"}
    error = refusal("planar3r", start, line(to))
    edge = np.sqrt(0.25 - 0.35**2) - 0.05
    text = str(error)
    assert isinstance(error, PlanningError)
    assert "does not reach" in text
    said, missed = (float(re.search(f"{word} ([0-9.e-]+) m", text).group(1)) for word in ("s =", "up to"))
    assert said == pytest.approx(edge, abs=1e-5)
    assert missed == pytest.approx(np.hypot(0.35, 0.55) - 0.5, abs=1e-6)


def test_a_singularity_says_where_and_which_joint():
    """A wrist that must turn through its middle: the third axis of the hand lines up with the fourth joint's."""
    start = [0.1, 0.7, -0.6, 0.9, 0.5, 0.2]
    from trajcli.kinematics.forward import forward

    robot = arm("puma560")
    here, beyond = np.array(start), np.array(start)
    beyond[4] = -0.5
    to = {"matrix": rows(forward(robot, beyond))}
    error = refusal("puma560", {"joints": rows(here)}, line(to))
    assert isinstance(error, PlanningError)
    assert "singularity" in str(error)
    assert "singular value" in str(error)
    middle = np.linalg.norm(forward(robot, beyond)[:3, 3] - forward(robot, here)[:3, 3])
    assert 0 <= float(str(error).split("s = ")[1].split()[0]) <= max(middle, 1.0)


def test_a_joints_limit_is_named_with_its_place():
    start = [0.0, -1.5, 1.5, 0, 1.5, 0]
    narrow = {**LIMITS, "position": {"shoulder_pan_joint": [-0.2, 0.2]}}
    from trajcli.kinematics.forward import forward

    place = forward(arm("ur5e"), np.array(start))[:3, 3]
    error = refusal(
        "ur5e", {"joints": start}, line({"xyz": rows(place + np.array([0.0, 0.25, 0.0]))}), limits=narrow
    )
    assert isinstance(error, PlanningError)
    assert "shoulder_pan_joint would be at" in str(error)
    assert "its limit is" in str(error)
    assert error.problems[0].joint == "shoulder_pan_joint"
    free = plan("ur5e", {"joints": start}, line({"xyz": rows(place + np.array([0.0, 0.25, 0.0]))}))
    worst = np.abs(free.trajectory.curve.evaluate(times_of(free, 2001))[:, 0]).max()
    assert worst > 0.2
    assert f"{worst:.4f}"[:5] in str(error)
