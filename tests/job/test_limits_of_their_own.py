"""Limits in a file of their own, or in an option: in which units, of which form, over which of the robot."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.job.limits_file import with_limits, with_limits_file
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.units import Units

ROBOT = Robot(
    "arm", (Joint("turn"), Joint("slide", type="prismatic")), unlimited(2), None, np.eye(4), np.eye(4)
)
MOVEIT = "joint_limits: {turn: {has_velocity_limits: true, max_velocity: 2.0}}\n"


@pytest.mark.parametrize("given", ["option", "file"])
@pytest.mark.parametrize(
    ("stated", "units", "angle", "length"),
    [
        ("", Units(), 1.0, 1.0),
        ("", Units("deg", "mm"), np.pi / 180, 1e-3),
        ("units: {angle: deg}, ", Units("rad", "mm"), np.pi / 180, 1e-3),
        ("units: {length: mm}, ", Units("deg", "m"), np.pi / 180, 1e-3),
        ("units: {angle: rad, length: m}, ", Units("deg", "mm"), 1.0, 1.0),
    ],
)
def test_units_are_those_that_are_stated_else_those_of_the_caller(
    tmp_path: Path, given: str, stated: str, units: Units, angle: float, length: float
) -> None:
    text = f"{{{stated}velocity: [30, 40], acceleration: {{slide: 50}}}}"
    (tmp_path / "limits.yaml").write_text(text, encoding="utf-8")
    path = text if given == "option" else str(tmp_path / "limits.yaml")
    limits = with_limits_file(ROBOT, path, units)[0].limits
    bound = np.array([30 * angle, 40 * length])
    np.testing.assert_allclose(limits.velocity, np.column_stack([-bound, bound]))
    np.testing.assert_allclose(limits.acceleration[1], [-50 * length, 50 * length])
    assert np.isinf(limits.acceleration[0]).all()


def test_a_mapping_is_in_si_unless_it_says_its_units() -> None:
    np.testing.assert_allclose(with_limits(ROBOT, {"jerk": [2, 3]})[0].limits.jerk, [[-2, 2], [-3, 3]])
    said = with_limits(ROBOT, {"units": {"length": "mm"}, "jerk": [2, 3]})[0]
    np.testing.assert_allclose(said.limits.jerk, [[-2, 2], [-3e-3, 3e-3]])


@pytest.mark.parametrize(
    "text",
    [
        MOVEIT,
        f"default_velocity_scaling_factor: 0.1\n{MOVEIT}",
        f"robot_description_planning:\n  {MOVEIT}",
        f"move_group:\n  ros__parameters:\n    robot_description_planning:\n      {MOVEIT}",
        "{file: other.yaml}",
    ],
)
def test_limits_of_moveit_are_told_by_their_keys(tmp_path: Path, text: str) -> None:
    (tmp_path / "other.yaml").write_text(MOVEIT, encoding="utf-8")
    (tmp_path / "limits.yaml").write_text(text, encoding="utf-8")
    robot, events = with_limits_file(ROBOT, str(tmp_path / "limits.yaml"), Units("deg", "mm"))
    np.testing.assert_allclose(robot.limits.velocity[0], [-2, 2])  # SI whatever the units
    assert np.isinf(robot.limits.velocity[1]).all()
    assert events  # of the joint that it says nothing of


def test_what_is_noted_of_a_file_comes_before_what_is_looser(tmp_path: Path) -> None:
    arm = with_limits(ROBOT, {"velocity": [1, 1]})[0]
    (tmp_path / "limits.yaml").write_text(MOVEIT, encoding="utf-8")
    robot, events = with_limits_file(arm, str(tmp_path / "limits.yaml"), Units())
    np.testing.assert_allclose(robot.limits.velocity, [[-2, 2], [-1, 1]])
    alone = with_limits_file(ROBOT, str(tmp_path / "limits.yaml"), Units())[1]
    assert alone
    assert [event.kind for event in events][: len(alone)] == [event.kind for event in alone]
    assert len(events) > len(alone)


@pytest.mark.parametrize("word", ["2", "2.5"])
def test_a_number_is_no_file(word: str) -> None:
    with pytest.raises(InputError, match="expects a file") as caught:
        with_limits_file(ROBOT, word, Units())
    advice = str(caught.value.problems[0].hint).rpartition("--limits ")[2].strip("'")
    np.testing.assert_allclose(with_limits_file(ROBOT, advice, Units())[0].limits.velocity[:, 1], float(word))
