"""Masses, inertias and efforts of the catalogue, against pinocchio on the URDFs that they come from.

Oracle: `catalogue_efforts.yaml`, recorded from pinocchio, which reads the URDFs itself.
"""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from yaml_files import read_yaml

from trajcli.catalogue.entries import catalogue_names
from trajcli.dynamics.newton_euler import InverseDynamics
from trajcli.errors import InputError
from trajcli.job.read import job_from_text
from trajcli.job.robot import load_robot, load_sheet
from trajcli.urdf.joint_properties import LEAST_PLACEHOLDER_EFFORT
from trajcli.urdf.serial_robot import robot_of_urdf
from trajcli.urdf.write import urdf_of

HEAVY = [name for name in catalogue_names() if not load_robot(name).without_inertia]


@cache
def cases() -> list[dict[str, Any]]:
    file = Path(__file__).parents[1] / "oracles" / "catalogue_efforts.yaml"
    found: list[dict[str, Any]] = read_yaml(file)["cases"]
    return found


def test_every_arm_with_inertias_was_recorded() -> None:
    assert set(HEAVY) == {case["arm"] for case in cases()}
    assert len(HEAVY) == 14


@pytest.mark.parametrize("number", range(len(cases())))
def test_efforts_are_those_of_pinocchio(number: int) -> None:
    case = cases()[number]
    q, qd, qdd = (np.array(case[key]) for key in ("q", "qd", "qdd"))
    tau = InverseDynamics(load_robot(case["arm"])).rigid_effort(q, qd, qdd)
    assert tau == pytest.approx(case["tau"], rel=1e-10, abs=1e-10 * np.abs(case["tau"]).max())


@pytest.mark.parametrize("name", HEAVY)
def test_a_file_has_all_links_or_none_and_says_where_they_come_from(name: str) -> None:
    sheet = load_sheet(name)
    assert "inertia" in (sheet.source or "")
    for joint in sheet.robot.joints:
        bounds = np.array(joint.effort)
        assert np.isinf(bounds).all() or (np.abs(bounds) < LEAST_PLACEHOLDER_EFFORT).all()
    assert not sheet.robot.limits.has_effort  # they count where a job says so


@pytest.mark.parametrize("name", catalogue_names())
def test_no_arm_has_some_links_only(name: str) -> None:
    assert len(load_robot(name).without_inertia) in (0, len(load_robot(name).joints))


def test_robots_that_are_advised_for_their_inertias_have_them() -> None:
    text = """
        version: 1
        robot: ur10e
        limits: {velocity: 1, acceleration: 1, effort: 100}
        start: {joints: [0, -1, 1, 0, 0, 0]}
        moves: [{planner: trapezoid, to: {joints: [0.1, -1, 1, 0, 0, 0]}}]
    """
    with pytest.raises(InputError, match="UR10e has none behind joints") as caught:
        job_from_text(text)
    advised = caught.value.problems[0].hint.rpartition("such as ")[2].split(" or ")  # type: ignore[union-attr]
    assert len(advised) == 2
    assert set(advised) <= set(HEAVY)
    assert job_from_text(text.replace("ur10e", advised[0])).robot.limits.has_effort


@pytest.mark.parametrize("name", [*HEAVY, "fr3"])
def test_a_urdf_that_is_written_has_the_same_dynamics_and_limits(name: str) -> None:
    robot = load_robot(name)
    read = robot_of_urdf(urdf_of(robot).encode(), "written", exact=True).robot
    generator = np.random.default_rng(3)
    q, qd, qdd = generator.uniform(-2, 2, (3, 20, len(robot.joints)))
    tau = InverseDynamics(robot).rigid_effort(q, qd, qdd)
    assert InverseDynamics(read).rigid_effort(q, qd, qdd) == pytest.approx(tau, rel=1e-9, abs=1e-9)
    assert [joint.effort for joint in read.joints] == [joint.effort for joint in robot.joints]
    bounded = np.isfinite(robot.limits.velocity_by_position[:, 0])
    assert read.limits.velocity_by_position[bounded] == pytest.approx(
        robot.limits.velocity_by_position[bounded]
    )
    assert read.limits.has_velocity_by_position == (name == "fr3")
