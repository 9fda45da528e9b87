"""Worked examples of lines, arcs and orientations as jobs: a Cartesian arm serves where the text names none.

The answers are those of tests/oracles/operational.yaml; a misprint there must not come out.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tool_jobs import plan, poses_of
from yaml_files import read_yaml

from trajcli.kinematics.jacobian import tcp_acceleration, tcp_twist

FILE = Path(__file__).parents[2] / "oracles" / "operational.yaml"
CASES = read_yaml(FILE)["cases"]
PPP = {
    "convention": "standard",
    "joints": [
        {"type": "prismatic", "alpha": -np.pi / 2},
        {"type": "prismatic", "theta": -np.pi / 2, "alpha": -np.pi / 2},
        {"type": "prismatic"},
    ],
}
WRIST = [{"alpha": -np.pi / 2}, {"alpha": np.pi / 2}, {}]
PPPRRR = {**PPP, "joints": [*PPP["joints"], *WRIST]}
FREE = {"limits": {}}


def of(*kinds):
    cases = [case for case in CASES if case["kind"] in kinds]
    assert cases
    return pytest.mark.parametrize("case", cases, ids=[case["id"] for case in cases])


def state_of(made, times):
    """Return place, velocity and acceleration of the tool (N, 3) and its rotations (N, 3, 3), from the joints."""
    robot, curve, times = (
        made.moves[0].robot,
        made.trajectory.curve,
        np.minimum(times, made.trajectory.duration),
    )
    q, qd, qdd = (curve.evaluate(times, order) for order in range(3))
    poses = poses_of(made, times)
    rates = tcp_twist(robot, q, qd), tcp_acceleration(robot, q, qd, qdd)
    return poses[:, :3, 3], rates[0], rates[1], poses[:, :3, :3]


def close(got, wanted, case, peak=1.0):
    """Compare within the case's tolerance; accelerations are met relative to their peak."""
    np.testing.assert_allclose(
        got, np.array(wanted, dtype=float), rtol=0, atol=case["tolerance"] * max(peak, 1.0)
    )


def exact(job_move):
    return job_move | {"tolerance": {"position": 5e-10, "angle": 5e-10}}


@of("cart_line_trapezoid")
def test_a_line_under_a_trapezoid(case):
    given, rows = case["inputs"], np.array(case["expected"]["samples_t_p_v"])
    law = {"shape": "trapezoid", "duration": given["T"], "speed": given["cruise_speed"]}
    move = exact({"planner": "line", "to": {"xyz": given["p1"]}, "law": law})
    made = plan(PPP, {"xyz": given["p0"]}, move, **FREE)
    place, velocity, acceleration, _ = state_of(made, rows[:, 0])
    close(place, rows[:, 1:4], case)
    close(velocity[:, :3], rows[:, 4:], case)
    close(np.linalg.norm(acceleration[0, :3]), case["expected"]["acceleration"], case)
    ramp = made.moves[0].planned.phases[0]
    close(ramp.end, case["expected"]["tc"], case)
    close(made.moves[0].planned.tool.path.length, case["expected"]["length"], case)


def clockwise(given):
    axis = np.array(given["plane_normal"], dtype=float)
    center = {"center": given["centre"]}
    return {
        "by its angle": {**center, "axis": axis.tolist(), "angle": -np.pi},
        "to its end": {**center, "axis": (-axis).tolist(), "to": {"xyz": given["p1"]}},
        "through its lowest point": {"via": {"xyz": [0, 0, 0.5]}, "to": {"xyz": given["p1"]}},
    }


@pytest.mark.parametrize("form", ["by its angle", "to its end", "through its lowest point"])
@of("cart_arc_trapezoid")
def test_an_arc_under_a_trapezoid(case, form):
    given, rows = case["inputs"], np.array(case["expected"]["samples_t_p_v_a"], dtype=float)
    law = {"shape": "trapezoid", "duration": given["T"], "speed": given["cruise_speed"]}
    move = exact({"planner": "arc", **clockwise(given)[form], "law": law})
    made = plan(PPP, {"xyz": given["p0"]}, move, **FREE)
    place, velocity, acceleration, _ = state_of(made, rows[:, 0])
    close(place, rows[:, 1:4], case)
    close(velocity[:, :3], rows[:, 4:7], case)
    close(acceleration[:, :3], rows[:, 7:], case, np.abs(rows[:, 7:]).max())
    middle, *_ = state_of(made, np.array([given["T"] / 2]))
    close(middle[0], case["expected"]["mid_point"], case)
    trap = case["misprint_trap"]["acceleration_at_0p2_from_authors_script"]
    assert np.abs(state_of(made, np.array([0.2]))[2][0, :3] - trap).max() > 0.1


@of("cart_polyline")
def test_a_polyline_with_stops(case):
    given, rows = case["inputs"], np.array(case["expected"]["samples_t_p"], dtype=float)
    times, points = given["t"], given["points"]
    speed = 0.75
    ramp = times[1] - 1.0 / speed
    segments = [{"line": {"xyz": point}} for point in points[1:]]
    law = {"shape": "trapezoid", "speed": speed, "acceleration": speed / ramp}
    move = exact({"planner": "path", "segments": segments, "corner": "stop", "law": law})
    made = plan(PPP, {"xyz": points[0]}, move, **FREE)
    assert made.trajectory.duration == pytest.approx(times[-1], abs=1e-12)
    place, velocity, _, _ = state_of(made, rows[:, 0])
    close(place, rows[:, 1:], case)
    close(velocity[rows[:, 0] == times[1]], 0.0, case)
    by_time = exact({"planner": "path", "segments": segments, "corner": "stop"})
    by_time |= {"law": {"shape": "trapezoid", "duration": times[-1], "speed": speed}}
    close(state_of(plan(PPP, {"xyz": points[0]}, by_time, **FREE), rows[:, 0])[0], rows[:, 1:], case)


@of("arc_parameter")
def test_the_parameter_of_an_arc_is_its_length(case):
    """An arc of radius r at the rate of two radians per second goes 2 r metres per second."""
    given, speed = case["inputs"], case["expected"]["speed"]
    arc = {"center": [0, 0, 0], "axis": "z", "angle": 3.0}
    law = {"shape": "trapezoid", "speed": given["r"] * given["s_angle_rate"], "acceleration": 4.0}
    made = plan(PPP, {"xyz": [given["r"], 0, 0]}, exact({"planner": "arc", **arc, "law": law}), **FREE)
    _, velocity, _, _ = state_of(made, np.array([made.trajectory.duration / 2]))
    assert np.linalg.norm(velocity[0, :3]) == pytest.approx(speed, abs=1e-9)


@of("arc_three_points")
def test_an_arc_through_three_points(case):
    given, expected = case["inputs"], case["expected"]
    move = {"planner": "arc", "via": {"xyz": given["via"]}, "to": {"xyz": given["p1"]}}
    made = plan(PPP, {"xyz": given["p0"]}, exact(move | {"law": {"shape": "cubic", "duration": 2}}), **FREE)
    place, velocity, _, _ = state_of(made, np.linspace(0, 2, 41))
    close(np.linalg.norm(place - expected["centre"], axis=1), np.full(41, expected["radius"]), case)
    close(place[20], expected["mid_point"], case)
    close(place[-1], given["p1"], case)
    close(made.moves[0].planned.tool.path.length, expected["length"], case)
    normal = np.cross(place[20] - expected["centre"], velocity[20, :3])
    np.testing.assert_allclose(
        normal / np.linalg.norm(normal), expected["normal_direction_of_travel"], atol=1e-8
    )


def wrist_start(rotation):
    angles = Rotation.from_matrix(rotation).as_euler("ZYZ")
    return {"xyz": [0.3, 0.2, 0.4], "euler": {"sequence": "ZYZ", "angles": angles.tolist()}}


@of("orient_euler")
def test_angles_under_a_cubic(case):
    given, rows = case["inputs"], np.array(case["expected"]["samples_t_phi_dphi"])
    start = {"xyz": [0.3, 0.2, 0.4], "euler": {"sequence": "ZYZ", "angles": given["phi_i"]}}
    to = {"euler": {"sequence": "ZYZ", "angles": given["phi_f"]}}
    move = {
        "planner": "line",
        "to": to,
        "orientation": "euler",
        "law": {"shape": "cubic", "duration": given["T"]},
    }
    made = plan(PPPRRR, start, exact(move), **FREE)
    _, velocity, _, rotations = state_of(made, rows[:, 0])
    close(rotations[rows[:, 0] == given["T"] / 2][0], case["expected"]["R_mid"], case)
    for rotation, spin, row in zip(rotations, velocity[:, 3:], rows, strict=True):
        np.testing.assert_allclose(rotation, Rotation.from_euler("ZYZ", row[1:4]).as_matrix(), atol=1e-9)
        phi, theta = row[1:3]
        axes = [[0, -np.sin(phi), np.cos(phi) * np.sin(theta)], [0, np.cos(phi), np.sin(phi) * np.sin(theta)]]
        axes.append([1, 0, np.cos(theta)])
        np.testing.assert_allclose(spin, np.array(axes) @ row[4:], atol=1e-8)


@of("orient_axis_angle")
def test_a_rotation_under_a_cubic(case):
    given, rows = case["inputs"], np.array(case["expected"]["samples_t_theta"])
    to = {"matrix": given["R_f"]}
    move = {"planner": "line", "to": to, "law": {"shape": "cubic", "duration": given["T"]}}
    made = plan(PPPRRR, wrist_start(given["R_i"]), exact(move), **FREE)
    _, velocity, acceleration, rotations = state_of(made, rows[:, 0])
    start = np.array(given["R_i"])
    axis = start @ case["expected"]["axis_in_initial_frame"]
    turned = [Rotation.from_matrix(rotation @ start.T).as_rotvec() @ axis for rotation in rotations]
    got = np.column_stack([turned, velocity[:, 3:] @ axis, acceleration[:, 3:] @ axis])
    np.testing.assert_allclose(got, rows[:, 1:], rtol=0, atol=3e-9)
    middle = rows[:, 0] == given["T"] / 2
    close(rotations[middle][0], case["expected"]["R_mid"], case)
    close(velocity[middle][0, 3:] @ start, case["expected"]["omega_initial_frame_mid"], case)


@of("orient_axis_angle_pi")
def test_half_a_turn(case):
    given = case["inputs"]
    move = {
        "planner": "line",
        "to": {"matrix": given["R_f"]},
        "law": {"shape": "cubic", "duration": given["T"]},
    }
    made = plan(PPPRRR, wrist_start(given["R_i"]), exact(move), **FREE)
    close(made.moves[0].planned.tool.path.length, case["expected"]["theta_f"], case)
    _, velocity, _, rotations = state_of(made, np.array([given["T"] / 2, given["T"]]))
    axis = velocity[0, 3:] @ np.array(given["R_i"])
    axis /= np.linalg.norm(axis)
    wanted = np.array(case["expected"]["axis_up_to_sign"])
    close(axis * np.sign(axis @ wanted), wanted, case)
    close(rotations[1], given["R_f"], case)


@of("orient_axis_angle_zero")
def test_equal_orientations_are_held(case):
    given = case["inputs"]
    move = {
        "planner": "line",
        "to": {"matrix": given["R_f"]},
        "law": {"shape": "cubic", "duration": given["T"]},
    }
    made = plan(PPPRRR, wrist_start(given["R_i"]), exact(move), **FREE)
    assert made.trajectory.duration == given["T"]
    for rotation in state_of(made, np.linspace(0, given["T"], 5))[3]:
        np.testing.assert_allclose(rotation, case["expected"]["R_any_t"], rtol=0, atol=1e-11)


def of_pose(matrix):
    matrix = np.array(matrix, dtype=float)
    return {"matrix": matrix.tolist()}


@of("pose_interpolation")
def test_poses_on_a_line(case):
    """A quintic passes s at the time where its polynomial says so; a peer's poses at s are those of that time."""
    given = case["inputs"]
    move = {"planner": "line", "to": of_pose(given["T1"]), "law": {"shape": "quintic", "duration": 2}}
    move |= {"tolerance": {"position": 5e-9, "angle": 5e-9}}  # metres in seconds: accelerations are large
    made = plan({**PPPRRR, "tool": {"rpy": [0.4, 0.9, 0.3]}}, of_pose(given["T0"]), move, **FREE)
    for s, wanted in zip(given["s"], case["expected"]["T"], strict=True):
        roots = np.roots([6, -15, 10, 0, 0, -s]) if s not in (0, 1) else np.array([s], dtype=complex)
        real = roots[np.abs(roots.imag) < 1e-9].real
        x = real[(real > -1e-9) & (real < 1 + 1e-9)][0]
        place, _, _, rotations = state_of(made, np.array([2 * np.clip(x, 0, 1)]))
        close(place[0], np.array(wanted)[:3, 3], case)
        np.testing.assert_allclose(rotations[0], np.array(wanted)[:3, :3], rtol=0, atol=3e-9)


def test_every_kind_of_the_file_is_tested():
    tested = {case["kind"] for mark in MARKS for case in mark.args[1] if mark.args[0] == "case"}
    assert tested == {case["kind"] for case in CASES}


MARKS = [mark for test in list(globals().values()) for mark in getattr(test, "pytestmark", [])]
