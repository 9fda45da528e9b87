"""The robots of the catalogue against published tables, joint chains and limits."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from trajcli.errors import FileError, InputError
from trajcli.job.robot import CATALOGUE, catalogue_names, load_robot
from trajcli.kinematics.forward import forward

ORACLES = Path(__file__).parents[1] / "oracles"
ARMS = {
    "cobra600": "C-cobra600",
    "irb120": "C-irb120",
    "panda": "C-panda",
    "puma560": "C-puma560",
    "scorbot": "C-scorbot",
    "stanford": "C-stanford",
    "ur10e": "C-ur10e",
    "ur5e": "C-ur5e",
}
EXAMPLES = {  # arms of the lecture notes: the cases of forward.yaml that they come from
    "cartesian": ("A-bt3-fk", "A-bt7-fk"),
    "cartesian_wrist": ("A-bt4-fk",),
    "cylindrical": ("A-bt2-fk",),
    "elbow": ("A-vd2.10",),
    "elbow4r": ("A-vd2.14",),
    "elbow6r": ("A-vd2.16",),
    "elbow_offset": ("A-vd2.11",),
    "planar2r": ("A-eq2.35",),
    "planar3r": ("A-vd2.09",),
    "rpr": ("A-vd2.13",),
    "rrp": ("A-vd2.12",),
}


@cache
def oracle(file: str, key: str, name: str) -> dict[str, Any]:
    rows = yaml.safe_load((ORACLES / file).read_text(encoding="utf-8"))[key]
    found: dict[str, Any] = next(row for row in rows if row["id"] == ARMS[name])
    return found


def test_every_robot_has_its_oracle() -> None:
    assert catalogue_names() == sorted([*ARMS, *EXAMPLES])


@pytest.mark.parametrize("name", ARMS)
def test_rows(name: str) -> None:
    expected, robot = oracle("robots.yaml", "robots", name), load_robot(name)
    assert robot.convention == {"std": "standard", "mdh": "modified"}[expected["convention"]]
    for joint, row in zip(robot.joints, expected["dh"], strict=True):
        assert joint.type == {"R": "revolute", "P": "prismatic"}[row["type"]]
        values = [joint.theta, joint.d, joint.a, joint.alpha]
        assert values == pytest.approx([row[key] for key in ("theta", "d", "a", "alpha")], abs=1e-15)


@pytest.mark.parametrize("name", ARMS)
def test_poses(name: str) -> None:
    expected, robot = oracle("robots.yaml", "robots", name), load_robot(name)
    assert len(expected["fk"]) >= 4
    for case in expected["fk"]:
        assert forward(robot, case["q"]) == pytest.approx(np.array(case["T"]), abs=1e-12), case["id"]


@pytest.mark.parametrize("name", EXAMPLES)
def test_poses_of_the_lecture_notes(name: str) -> None:
    cases = yaml.safe_load((ORACLES / "forward.yaml").read_text(encoding="utf-8"))["cases"]
    found = [case for case in cases if case["id"] in EXAMPLES[name]]
    assert len(found) == len(EXAMPLES[name])
    robot = load_robot(name)
    for case in found:
        tool = np.array(case["inputs"].get("tool", np.eye(4)))
        pose = forward(robot, case["inputs"]["q"]) @ tool
        assert pose == pytest.approx(np.array(case["expected"]["T"]), abs=1e-12), case["id"]
    assert all(np.isinf(robot.limits.of_order(order)).all() for order in range(4))  # none are given


@pytest.mark.parametrize("name", ARMS)
def test_limits(name: str) -> None:
    robot = load_robot(name)
    for joint, row in enumerate(oracle("limits.yaml", "limits", name)["limits"]):
        low, high = (np.inf if row[key] is None else row[key] for key in ("lower", "upper"))
        speed = np.inf if row["velocity"] is None else row["velocity"]
        assert robot.limits.position[joint].tolist() == pytest.approx(
            [low if np.isfinite(low) else -np.inf, high]
        )
        assert robot.limits.velocity[joint].tolist() == pytest.approx([-speed, speed])
        for quantity in ("acceleration", "jerk"):  # hardly anybody publishes these
            bound = row.get(quantity) or np.inf
            assert getattr(robot.limits, quantity)[joint].tolist() == [-bound, bound]


def test_joint_names_of_the_ur5e_are_those_of_its_description() -> None:
    chain = oracle("robots.yaml", "robots", "ur5e")["chain"]
    assert list(load_robot("ur5e").joint_names) == [row["name"] for row in chain if row["type"] == "revolute"]


@pytest.mark.parametrize("name", [*ARMS, *EXAMPLES])
def test_sources_are_named(name: str) -> None:
    plain = yaml.safe_load((CATALOGUE / f"{name}.yaml").read_text(encoding="utf-8"))
    assert plain["source"]
    assert plain["licence"]
    assert plain["note"]


def test_load_robot_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text("joints: 3\n")
    assert load_robot(path).name == load_robot(str(path)).name == "arm"
    with pytest.raises(FileError):
        load_robot(tmp_path / "none.yaml")
    with pytest.raises(InputError, match="the catalogue has no robot 'ur5'") as caught:
        load_robot("ur5")
    hint = caught.value.problems[0].hint or ""
    assert hint.startswith("did you mean 'ur5e'? `trajcli robots` lists all ")
    with pytest.raises(InputError) as caught:
        load_robot("xyzzy")
    hint = caught.value.problems[0].hint or ""
    names = catalogue_names()
    near = hint.removeprefix("its nearest names are ").partition(";")[0].split(", ")
    assert len(near) == 3
    assert set(near) < set(names)
    assert hint.endswith(f"; `trajcli robots` lists all {len(names)}")
