"""Calibration of an arm in degrees and millimetres: report in SI, robot file in its own units, plan of measurements."""

from __future__ import annotations

import csv
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.job.robot import load_robot
from trajcli.kinematics.calibration.fit import Options
from trajcli.kinematics.calibration.measuring_plan import MeasuredPart
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Robot
from trajcli.queries.arm import ArmInUnits, open_arm, open_sheet
from trajcli.queries.calibration import (
    Calibration,
    calibrated_text,
    calibration_of,
    calibration_report,
    plan_report,
    planned_measurements,
)

ROBOT = """\
name: three
units: {angle: deg, length: mm}
note: As delivered.
convention: standard
joints:
  - {name: j1, d: 300, alpha: 90, position: [-170, 170]}
  - {name: j2, a: 400, alpha: 40, position: [-90, 90]}
  - {name: j3, theta: 10, d: 50, a: 250, position: [-90, 90]}
base: {xyz: [10, 20, 30], rpy: [0, 0, 15]}
tool: {xyz: [60, 0, 20], rpy: [0, 30, 0]}
"""
RAD = np.pi / 180


@pytest.fixture
def file(tmp_path: Path) -> str:
    (tmp_path / "three.yaml").write_text(ROBOT)
    return str(tmp_path / "three.yaml")


def built(robot: Robot) -> Robot:
    """Return the arm as it was built: an angle, two lengths and the tool are off."""
    one, two, three = robot.joints
    tool = robot.tool.copy()
    tool[:3, 3] += [0.002, -0.001, 0.003]
    joints = (
        one,
        replace(two, a=two.a + 0.0015, alpha=two.alpha + 0.004),
        replace(three, theta=three.theta - 0.01),
    )
    return replace(robot, joints=joints, tool=tool)


def measured(
    arm: ArmInUnits, folder: Path, q: np.ndarray, noise: tuple[float, float] = (0, 0), turns: bool = True
) -> str:
    """Write poses of the arm as it was built, with noise (m, rad), as a CSV in its units."""
    chance = np.random.default_rng(5)
    poses = forward(built(arm.robot), q)
    names = ["q1_deg", "q2_deg", "q3_deg", "x_mm", "y_mm", "z_mm"] + ["qw", "qx", "qy", "qz"] * turns
    with (folder / "measured.csv").open("w") as out:
        writer = csv.writer(out)
        writer.writerow(names)
        for row, pose in zip(q, poses, strict=True):
            at = pose[:3, 3] + noise[0] * chance.normal(size=3)
            turn = Rotation.from_rotvec(noise[1] * chance.normal(size=3)) * Rotation.from_matrix(pose[:3, :3])
            x, y, z, w = turn.as_quat().tolist()
            writer.writerow([*(row / RAD).tolist(), *(1000 * at).tolist(), *([w, x, y, z] if turns else [])])
    return str(folder / "measured.csv")


def drawn(count: int) -> np.ndarray:
    return np.random.default_rng(3).uniform(-1.4, 1.4, (count, 3))


def calibrated(file: str, folder: Path, noise: tuple[float, float] = (0, 0), count: int = 40) -> Calibration:
    arm = open_arm(file)
    return calibration_of(
        arm, measured(arm, folder, drawn(count), noise), "j2.a,j2.alpha,j3.theta,tool.x,tool.y,tool.z"
    )


def test_the_file_has_the_found_numbers_in_its_own_units(file: str, tmp_path: Path) -> None:
    calibration = calibrated(file, tmp_path)
    text = calibrated_text(calibration, open_sheet(file))
    written = yaml.safe_load(text)
    assert written["units"] == {"angle": "deg", "length": "mm"}
    two, three = written["joints"][1:]
    assert (two["a"], two["alpha"]) == pytest.approx((401.5, 40 + 0.004 / RAD), abs=1e-5)
    assert three["theta"] == pytest.approx(10 - 0.01 / RAD, abs=1e-6)
    assert (three["d"], three["a"], written["joints"][0]) == (50, 250, yaml.safe_load(ROBOT)["joints"][0])
    assert written["tool"]["xyz"] == pytest.approx([62, -1, 23], abs=1e-5)
    assert written["tool"]["rpy"] == pytest.approx([0, 30, 0], abs=1e-9)
    assert written["base"] == yaml.safe_load(ROBOT)["base"]
    (tmp_path / "found.yaml").write_text(text)
    q = drawn(9)[5:]
    truth = built(open_arm(file).robot)
    assert forward(load_robot(tmp_path / "found.yaml"), q) == pytest.approx(forward(truth, q), abs=1e-8)


def test_the_report_is_in_si_and_the_note_says_its_residuals(file: str, tmp_path: Path) -> None:
    calibration = calibrated(file, tmp_path, (2e-4, 5e-4), 300)
    report = calibration_report(calibration)
    rows = {(row["joint"], row["name"]): row for row in report["parameters"]}
    assert rows["j2", "alpha"]["unit"] == "rad"
    assert rows["j2", "alpha"]["value"] == pytest.approx(40 * RAD + 0.004, abs=3e-4)
    assert rows["j2", "a"]["unit"] == "m"
    assert (rows["j2", "a"]["nominal"], rows["j2", "a"]["value"]) == pytest.approx((0.4, 0.4015), abs=1e-4)
    assert report["noise"]["position"] == pytest.approx(2e-4, rel=0.1)
    assert report["noise"]["angle"] == pytest.approx(5e-4, rel=0.1)
    robot, truth, q = open_arm(file).robot, built(open_arm(file).robot), drawn(300)
    off = np.linalg.norm(forward(robot, q)[:, :3, 3] - forward(truth, q)[:, :3, 3], axis=1)
    before, after = report["residual"]["before"], report["residual"]["after"]
    assert before["position"] == pytest.approx(np.sqrt((off**2).mean() + 3 * 2e-4**2), rel=0.02)
    turned = Rotation.from_matrix(
        forward(robot, q)[:, :3, :3] @ forward(truth, q)[:, :3, :3].swapaxes(1, 2)
    ).magnitude()
    assert before["angle"] == pytest.approx(np.sqrt((turned**2).mean() + 3 * 5e-4**2), rel=0.02)
    assert after["position"] == pytest.approx(np.sqrt(3) * 2e-4, rel=0.1)
    assert after["angle"] == pytest.approx(np.sqrt(3) * 5e-4, rel=0.1)
    note = yaml.safe_load(calibrated_text(calibration, open_sheet(file)))["note"]
    assert note.startswith("As delivered. Calibrated by trajcli")
    said = re.search(r"position (\S+) to (\S+) mm, angle (\S+) to (\S+) deg\.", note)
    assert said is not None
    shown = (before["position"] * 1e3, after["position"] * 1e3, before["angle"] / RAD, after["angle"] / RAD)
    assert [float(text) for text in said.groups()] == pytest.approx(shown, rel=1e-3)
    assert "from 300 measurements (measured.csv)" in note


def test_lengths_count_like_angles_by_the_length_of_the_arm(file: str, tmp_path: Path) -> None:
    lengths = 0.3 + 0.4 + 0.05 + 0.25 + np.hypot(0.06, 0.02)
    assert calibration_report(calibrated(file, tmp_path))["scale"] == pytest.approx(lengths)
    arm = open_arm(file)
    other = calibration_of(arm, str(tmp_path / "measured.csv"), "j2.a", Options(0.3))
    assert calibration_report(other)["scale"] == 0.3


@pytest.mark.parametrize(("turns", "count", "least"), [(False, 2, 3), (False, 1, 3), (True, 1, 2)])
def test_too_few_measurements_are_refused_with_how_many_it_takes(
    turns: bool, count: int, least: int, file: str, tmp_path: Path
) -> None:
    arm = open_arm(file)
    free = "j1.theta,j1.d,j2.theta,j2.a,j2.alpha,j3.theta,j3.a"
    with pytest.raises(InputError) as refused:
        calibration_of(arm, measured(arm, tmp_path, drawn(count), turns=turns), free)
    numbers = (6 if turns else 3) * count
    assert f"{count} measurements are {numbers} numbers, and 7 of 7 free" in str(refused.value)
    assert f"take at least {least} measurements" in str(refused.value.problems[0].hint)


def test_just_as_many_numbers_as_parameters_leave_nothing_for_the_noise(file: str, tmp_path: Path) -> None:
    arm = open_arm(file)
    rows = measured(arm, tmp_path, drawn(2), turns=False)
    six = "j1.theta,j1.d,j2.theta,j2.a,j2.alpha,j3.theta"
    assert any(
        "nothing is left to estimate the noise" in each for each in calibration_of(arm, rows, six).remarks
    )
    five = calibration_of(arm, rows, six.removesuffix(",j3.theta"))
    assert not any("noise" in each for each in five.remarks)


def test_only_joints_that_stand_are_called_never_moved(file: str, tmp_path: Path) -> None:
    arm, q = open_arm(file), drawn(20)
    q[:, 1], q[:, 2] = 0.3, 0.2 + 1e-6 * np.arange(20)
    remarks = calibration_of(arm, measured(arm, tmp_path, q), "j1.theta,j2.a").remarks
    assert [each for each in remarks if each.startswith("never moved")] == [
        "never moved: j2; the links on both sides count as one there"
    ]


@pytest.mark.parametrize(("off", "remarked"), [(0.5, False), (2.0, True)])
def test_an_arm_that_misses_by_more_than_its_length_is_remarked(
    off: float, remarked: bool, file: str, tmp_path: Path
) -> None:
    arm = open_arm(file, base=f"{{xyz: [{10 + 1e3 * off}, 20, 30], rpy: [0, 0, 15]}}")
    rows = measured(open_arm(file), tmp_path, drawn(20))
    assert (
        any("more than its own length" in each for each in calibration_of(arm, rows, "base").remarks)
        == remarked
    )


PARTS: tuple[tuple[MeasuredPart, slice], ...] = (("position", slice(3)), ("pose", slice(6)))


@pytest.mark.parametrize(("part", "rows"), PARTS)
def test_a_plan_chooses_what_tells_most_and_says_how_much(
    part: MeasuredPart, rows: slice, file: str, tmp_path: Path
) -> None:
    """Of 60 candidates, of which the first 50 are one and the same."""
    arm, q = open_arm(file), drawn(60)
    q[:50] = q[0]
    lines = "\n".join(",".join(map(repr, (row / RAD).tolist())) for row in q)
    (tmp_path / "candidates.csv").write_text(f"q1_deg,q2_deg,q3_deg\n{lines}\n")
    free = "j2.a,j3.theta,j3.a"
    chosen, plan, parameters = planned_measurements(
        arm, 8, free, None, str(tmp_path / "candidates.csv"), part
    )
    assert chosen.shape == (8, 3)
    assert chosen == pytest.approx(q[plan.chosen])
    assert len(set(map(tuple, chosen.tolist()))) > 3
    report = plan_report(arm, chosen, plan, parameters)
    length = 0.3 + 0.4 + 0.05 + 0.25 + np.hypot(0.06, 0.02)
    columns = []
    for joint, name in ((1, "a"), (2, "theta"), (2, "a")):
        poses = []
        for step in (1e-6, -1e-6):
            joints = list(arm.robot.joints)
            joints[joint] = replace(joints[joint], **{name: getattr(joints[joint], name) + step})
            poses.append(forward(replace(arm.robot, joints=tuple(joints)), chosen))
        turns = Rotation.from_matrix(poses[0][:, :3, :3] @ poses[1][:, :3, :3].swapaxes(1, 2)).as_rotvec()
        moved = np.hstack([poses[0][:, :3, 3] - poses[1][:, :3, 3], length * turns])[:, rows] / 2e-6
        columns.append(moved.reshape(-1) * (length if name == "a" else 1))  # a radian counts like the length
    values = np.linalg.svd(np.array(columns).T, compute_uv=False)
    assert report["rank"] == 3
    found = report["observability"]
    assert found["condition"] == pytest.approx(values[0] / values[-1], rel=1e-5)
    assert found["smallest_singular_value"] == pytest.approx(values[-1], rel=1e-5)
    assert found["O1"] == pytest.approx(np.cbrt(values.prod()) / np.sqrt(8), rel=1e-5)
