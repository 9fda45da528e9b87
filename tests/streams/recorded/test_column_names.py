"""Names of columns against a list written by hand: quantity, joint, unit, kind."""

from __future__ import annotations

import pytest

from trajcli.streams.recorded.column_names import read_name, split_unit

NAMES = {
    "thetadot_1": ("qd", 1, None, ""),
    "setpoint_pos_1": ("q", 1, None, "reference"),
    "q_dot_dot_1": ("qdd", 1, None, ""),
    "dd_q1": ("qdd", 1, None, ""),
    "q dot 2": ("qd", 2, None, ""),
    "position_w": (None, None, None, ""),
    "move_1": (None, None, None, ""),
    "q1_2": (None, None, None, ""),
    "robot_1": (None, None, None, ""),
    "time_offset": (None, None, None, ""),
    "position_v_1": ("q", "v_1", None, ""),
    "t": ("t", None, None, ""),
    "Time [ms]": ("t", None, "ms", ""),
    "timestamp_ns": ("t", None, "ns", ""),
    "time_from_start": ("t", None, None, ""),
    "field.header.stamp": ("t", None, None, ""),
    "q1": ("q", 1, None, ""),
    "q12": ("q", 12, None, ""),
    "Axis 3": ("q", 3, None, ""),
    "J1_deg": ("q", 1, "deg", ""),
    "Joint 2 (°)": ("q", 2, "deg", ""),
    "q3_mm": ("q", 3, "mm", ""),
    "pts_J4": ("q", 4, None, ""),
    "theta1": ("q", 1, None, ""),
    "actual_q_0": ("q", 0, None, "actual"),
    "target_qd_5": ("qd", 5, None, "target"),
    "q_d_1": ("q", 1, None, "desired"),
    "dq_d_1": ("qd", 1, None, "desired"),
    "q_des1": ("q", 1, None, "desired"),
    "field.desired.positions3": ("q", 3, None, "desired"),
    "v1": ("qd", 1, None, ""),
    "Qdot1": ("qd", 1, None, ""),
    "q1_dot": ("qd", 1, None, ""),
    "qd1_deg_s": ("qd", 1, "deg/s", ""),
    "vel 2 [rad/s]": ("qd", 2, "rad/s", ""),
    "ddq7": ("qdd", 7, None, ""),
    "acc 2 [rad/s²]": ("qdd", 2, "rad/s^2", ""),
    "jerk_J1": ("qddd", 1, None, ""),
    "tau_1 [Nm]": ("tau", 1, "Nm", ""),
    "effort0": ("tau", 0, None, ""),
    "shoulder_pan_joint_position": ("q", "shoulder_pan_joint", None, ""),
    "velocity_elbow": ("qd", "elbow", None, ""),
    "wrist_1_joint": ("q", "wrist_1_joint", None, ""),
    "shoulder_pan.pos": ("q", "shoulder_pan", None, ""),
    "move": ("move", None, None, ""),
    "q1/deg": ("q", 1, "deg", ""),  # as ISO 80000 heads columns of tables
    "qd1/(deg/s)": ("qd", 1, "deg/s", ""),
    "t/ms": ("t", None, "ms", ""),
    "time/s": ("t", None, "s", ""),
    "q1 in deg": ("q", 1, "deg", ""),
    "velocity/s": ("qd", "s", None, ""),  # of a joint s
    "t [\u00b5s]": ("t", None, "us", ""),  # the micro sign
    "t [\u03bcs]": ("t", None, "us", ""),  # the Greek letter
    "q1 [\u00ba]": ("q", 1, "deg", ""),  # an ordinal sign, which looks like a degree
    "ms": ("t", None, "ms", ""),
    "Seconds": ("t", None, "s", ""),
    "current_joint_1": ("q", 1, None, "actual"),
}
OTHERS = ["x", "yaw", "position_x", "actual_TCP_pose_0", "tool_speed_1", "actual_current_0", "do_port", "s", "second", "motor_1_current", "joint_2_current", "", "1", "é", "description", "actual_joint_voltage_0"]  # fmt: skip


@pytest.mark.parametrize("text", NAMES)
def test_what_a_name_says(text):
    read = read_name(text)
    assert (read.quantity, read.joint, read.unit, read.kind) == NAMES[text]
    assert read.text == text


@pytest.mark.parametrize("text", OTHERS)
def test_names_of_other_things_say_no_quantity(text):
    assert read_name(text).quantity is None


@pytest.mark.parametrize(
    ("text", "unit"),
    [("q1", None), ("q_m", "m"), ("q [1]", None), ("a_s", "s"), ("t(us)", "us"), ("v1 [mm/s]", "mm/s"), ("n [rpm]", "rpm")],
)  # fmt: skip
def test_units_behind_a_name(text, unit):
    assert split_unit(text)[1] == unit


def test_stems_are_what_a_user_writes():
    assert read_name("actual_q_0").stem == "actual_q"
    assert read_name("Axis 3").stem == "Axis"
    assert read_name("joint_1_vel").stem == "joint_*_vel"
    assert read_name("/joint_states/a/position").stem == "/joint_states/*/position"


def test_a_unit_stands_behind_a_name() -> None:
    assert split_unit("q1_ [deg]") == split_unit("q1 (deg)") == ("q1", "deg")
    assert split_unit("_deg") == ("_deg", None)
