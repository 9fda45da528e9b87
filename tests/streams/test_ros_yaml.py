"""Goals for ROS controllers: accepted by the controller's rules, and run by its interpolation as they were planned."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
import pytest
import trajectory_controller as controller
import yaml
from tiers import few

from trajcli.errors import TrajcliError
from trajcli.job.read import load_job
from trajcli.knots import Knots, knots_of
from trajcli.planning.plan import plan_job
from trajcli.streams.ros_yaml import verify_ros_yaml, write_ros_yaml

EXAMPLES = Path(__file__).parents[2] / "examples"
QUINTICS = ["quintic", "line", "ur5e_pick", "planar_arc"]
OTHERS = ["cubic", "trapezoid", "septic", "cycloidal", "time_optimal", "blends", "weld_seam"]


def planned(name):
    trajectory = plan_job(load_job(EXAMPLES / f"{name}.yaml")).trajectory
    return trajectory, knots_of(trajectory)


def text_of(trajectory, knots, message="ros"):
    out = io.BytesIO()
    write_ros_yaml(trajectory.joint_names, knots, out, message)
    return out.getvalue()


def content_of(text):
    return yaml.load(text, Loader=yaml.CSafeLoader)


@pytest.mark.parametrize("name", few(list(QUINTICS + OTHERS), 4))
def test_the_controller_accepts_the_goal_and_runs_it_as_planned(name):
    trajectory, knots = planned(name)
    message = content_of(text_of(trajectory, knots))
    controller.check(message, list(trajectory.joint_names))
    times = np.linspace(0, trajectory.duration, 400)
    position, velocity, acceleration = controller.run(message, times)
    smooth = knots.deviation.position <= 1e-9
    bounds = (1e-9, 1e-8) if smooth else (knots.deviation.position + 1e-9, knots.deviation.velocity + 1e-8)
    assert np.abs(position - trajectory.curve.evaluate(times)).max() <= bounds[0]
    assert np.abs(velocity - trajectory.curve.evaluate(times, 1)).max() <= bounds[1]
    assert knots.deviation.position <= 1e-6
    if name in QUINTICS and all(span.continuity == 2 for span in trajectory.spans):
        assert smooth
        assert np.abs(acceleration - trajectory.curve.evaluate(times, 2)).max() <= 1e-6


def test_the_goal_of_the_action_wraps_the_same_trajectory():
    trajectory, knots = planned("ur5e_pick")
    goal = content_of(text_of(trajectory, knots, "ros-goal"))
    assert goal == {"trajectory": content_of(text_of(trajectory, knots))}


def test_the_head_says_how_to_send_it():
    trajectory, knots = planned("cubic")
    assert b"ros2 topic pub --once" in text_of(trajectory, knots).splitlines()[0]
    assert b"ros2 action send_goal" in text_of(trajectory, knots, "ros-goal").splitlines()[0]


def small(values):
    values = np.array(values)
    return Knots(np.array([0, 1_500_000_000]), values, 2 * values, 0 * values, None)


def test_numbers_keep_every_bit_in_the_form_of_yaml_1_1():
    knots = small([[1e-5, 1e16, -0.0], [0.1 + 0.2, 1e-300, 123456789.125]])
    out = io.BytesIO()
    write_ros_yaml(("a", "b: c", "no"), knots, out, "ros")
    message = yaml.safe_load(out.getvalue())
    assert message["joint_names"] == ["a", "b: c", "no"]
    for index, point in enumerate(message["points"]):
        assert point["positions"] == knots.position[index].tolist()
        assert all(type(value) is float for value in point["positions"])
    assert message["points"][1]["time_from_start"] == {"sec": 1, "nanosec": 500_000_000}
    assert "-0.0" not in out.getvalue().decode()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (b"positions: [0.1", b"positions: [0.2"),
        (b"sec: 1,", b"sec: 2,"),
        (b'"b"', b'"c"'),
        (b"points:\n", b"points:\n\n"),
        (b"nanosec: 500000000}}\n", b"nanosec: 500000000}}"),
    ],
)
def test_a_file_that_is_not_what_was_written_is_noticed(old, new):
    knots = small([[0.1, 0.2], [0.3, 0.4]])
    out = io.BytesIO()
    write_ros_yaml(("a", "b"), knots, out, "ros")
    verify_ros_yaml(out, ("a", "b"), knots, "ros")
    assert old in out.getvalue()
    for wrong in (out.getvalue().replace(old, new), out.getvalue() + b"x", out.getvalue()[:-40]):
        with pytest.raises(TrajcliError, match="the file read back"):
            verify_ros_yaml(io.BytesIO(wrong), ("a", "b"), knots, "ros")


GOOD = {
    "header": {"stamp": {"sec": 0, "nanosec": 0}},
    "joint_names": ["a"],
    "points": [
        {
            "positions": [0.0],
            "velocities": [0.0],
            "accelerations": [0.0],
            "time_from_start": {"sec": 0, "nanosec": 0},
        },
        {
            "positions": [1.0],
            "velocities": [0.0],
            "accelerations": [0.0],
            "time_from_start": {"sec": 1, "nanosec": 0},
        },
    ],
}


def test_the_controller_of_these_tests_refuses_what_the_real_one_refuses():
    controller.check(GOOD, ["a"])
    first, last = GOOD["points"]
    wrong = [
        {**GOOD, "points": []},
        {**GOOD, "joint_names": ["b"]},
        {**GOOD, "points": [first, {**last, "time_from_start": {"sec": 0, "nanosec": 0}}]},
        {**GOOD, "points": [first, {**last, "velocities": [2e-7]}]},
        {**GOOD, "points": [first, {**last, "effort": [1.0]}]},
        {**GOOD, "points": [first, {**last, "positions": [1]}]},
    ]
    for each in wrong:
        with pytest.raises(controller.RefusedError):
            controller.check(each, ["a"])
    # the quintic from rest to rest
    position, velocity, _ = controller.run(GOOD, np.array([0.5]))
    assert (position[0, 0], velocity[0, 0]) == pytest.approx((0.5, 1.875))


@pytest.mark.parametrize("message", ["ros", "ros-goal"])
def test_points_without_accelerations_state_two_derivatives_and_no_more(message):
    knots, names, out = small([[0.1, -0.2], [0.3, 0.4]]), ("a", "b"), io.BytesIO()
    write_ros_yaml(names, knots, out, message, orders=2)
    verify_ros_yaml(out, names, knots, message, orders=2)
    content = content_of(out.getvalue())
    points = (content["trajectory"] if message == "ros-goal" else content)["points"]
    assert all(point.keys() == {"positions", "velocities", "time_from_start"} for point in points)
    assert [point["velocities"] for point in points] == knots.velocity.tolist()
    with pytest.raises(TrajcliError, match="point 0"):
        verify_ros_yaml(out, names, knots, message)


def test_many_points_are_all_there():
    """2500 points are more than are written at a time."""
    values = np.arange(2500.0)[:, None]
    knots = Knots(np.arange(2500) * 10**6, values, values, values, None)
    out = io.BytesIO()
    write_ros_yaml(("a",), knots, out, "ros")
    verify_ros_yaml(out, ("a",), knots, "ros")
    assert out.getvalue().count(b"positions:") == 2500
