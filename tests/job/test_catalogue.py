"""The robots of the catalogue against published tables, joint chains and limits.

Oracles: `robots.yaml`, tables and poses of eight arms; `catalogue_poses.yaml`, poses of every real arm from a source other
than the catalogue's file; `forward.yaml`, the examples of the lecture notes.
"""

from __future__ import annotations

import json
import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from yaml_files import read_yaml

from trajcli.catalogue.entries import catalogue_names, robot_file
from trajcli.errors import FileError, InputError
from trajcli.job.read import job_from_text
from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward

ORACLES = Path(__file__).parents[1] / "oracles"
ARMS = {
    "cobra600": "C-cobra600",
    "irb120": "C-irb120",
    "panda": "C-panda",
    "puma560": "C-puma560",
    "scorbot_er4u": "C-scorbot",
    "stanford_scheinman": "C-stanford",
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
    "rp": ("A-bt5-fk",),
    "rpr": ("A-vd2.13",),
    "rrp": ("A-vd2.12",),
    "scara": ("A-vd2.18",),
    "scorbot": ("A-vd2.17",),
    "stanford": ("A-vd2.19",),
}
SOLVED = {  # arms of the lecture notes whose dimensions stand in an exercise of inverse kinematics, in inverse.yaml
    "elbow_spherical": "A-vd2.26",
    "planar2r": "A-vd2.20",
    "planar2r_equal": "A-vd2.22",
    "stanford": "A-vd2.21-fixed",
}
BOOK = {*EXAMPLES, *SOLVED}


@cache
def oracle(file: str, key: str, name: str) -> dict[str, Any]:
    rows = read_yaml(ORACLES / file)[key]
    found: dict[str, Any] = next(row for row in rows if row["id"] == ARMS[name])
    return found


@cache
def checks() -> list[dict[str, Any]]:
    rows: list[dict[str, Any]] = read_yaml(ORACLES / "catalogue_poses.yaml")["checks"]
    return rows


REAL = sorted({row["robot"] for row in checks()})


def test_every_robot_has_its_oracle() -> None:
    assert not BOOK & set(REAL)
    assert catalogue_names() == sorted([*REAL, *BOOK])
    assert len(REAL) >= 30


@pytest.mark.parametrize("index", range(len(checks())), ids=lambda index: checks()[index]["robot"])
def test_poses_of_a_second_source(index: int) -> None:
    check = checks()[index]
    robot = load_robot(check["robot"])
    assert check["source"]
    assert check["kind"] in ("peer", "table", "chain")
    assert len({tuple(case["q"]) for case in check["poses"]}) >= 3
    for case in check["poses"]:
        assert np.abs(forward(robot, case["q"])[:3] - np.array(case["T"])).max() <= check["accuracy"]


@pytest.mark.parametrize("name", REAL)
def test_poses_are_exact_wherever_a_source_is(name: str) -> None:
    best = min(check["accuracy"] for check in checks() if check["robot"] == name)
    rounded = {  # what these sources write for a right angle, or their lengths, have so few digits
        "gen3": 3e-5,
        "lite6": 3e-5,
        "m1013": 1e-5,
        "so100": 2e-5,
        "so101": 1e-7,
        "xarm5": 5e-6,
        "xarm7": 2e-5,
    }
    assert best <= rounded.get(name, 1e-9)


def test_most_arms_agree_with_another_publication() -> None:
    exact = {check["robot"] for check in checks() if check["kind"] == "peer" and check["accuracy"] <= 1e-9}
    assert len(exact) >= 30


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
    cases = read_yaml(ORACLES / "forward.yaml")["cases"]
    found = [case for case in cases if case["id"] in EXAMPLES[name]]
    assert len(found) == len(EXAMPLES[name])
    robot = load_robot(name)
    for case in found:
        tool = np.array(case["inputs"].get("tool", np.eye(4)))
        pose = forward(robot, case["inputs"]["q"]) @ tool
        assert pose == pytest.approx(np.array(case["expected"]["T"]), abs=1e-12), case["id"]


@pytest.mark.parametrize("name", sorted(BOOK))
def test_limits_of_the_lecture_notes(name: str) -> None:
    limits = load_robot(name).limits
    given = name == "scorbot"  # example 2.17 alone gives ranges, in degrees
    assert all(np.isinf(limits.of_order(order)).all() for order in range(1 if given else 0, 4))
    if given:
        degrees = np.degrees(limits.position).round(9).tolist()
        assert degrees == [[-155, 155], [-35, 130], [-130, 130], [-130, 130], [-570, 570]]


@pytest.mark.parametrize("name", SOLVED)
def test_dimensions_of_the_exercises(name: str) -> None:
    cases = read_yaml(ORACLES / "inverse.yaml")["cases"]
    case = next(case for case in cases if case["id"] == SOLVED[name])
    for joint, row in zip(load_robot(name).joints, case["inputs"]["dh"], strict=True):
        values = [joint.theta, joint.d, joint.a, joint.alpha]
        assert values == pytest.approx([row[key] for key in ("theta", "d", "a", "alpha")], abs=1e-15)


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


@pytest.mark.parametrize("name", [*REAL, *sorted(BOOK)])
def test_sources_are_named(name: str) -> None:
    plain = yaml.load(robot_file(name), Loader=yaml.CSafeLoader)
    assert plain["source"]
    assert plain["licence"]
    assert plain["note"]
    assert re.fullmatch(r"20\d\d-\d\d", plain["date"])
    assert plain["origin"] == ("textbook" if name in BOOK else "real")
    assert bool(plain.get("maker")) == (name not in BOOK)
    bare = [joint for joint in plain["joints"] if "acceleration" not in joint or "jerk" not in joint]
    assert not bare or re.search(
        r"limits (are|is) (not|given)|imits.*not (published|in the source|given)", plain["note"]
    )


def test_load_robot_from_a_file(tmp_path: Path) -> None:
    path = tmp_path / "arm.yaml"
    path.write_text("joints: 3\n")
    assert load_robot(path).name == load_robot(str(path)).name == "arm"
    with pytest.raises(FileError):
        load_robot(tmp_path / "none.yaml")
    with pytest.raises(InputError, match="the catalogue has no robot 'ur5ee'") as caught:
        load_robot("ur5ee")
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


OWN_TOOLS = [name for name in catalogue_names() if not np.array_equal(load_robot(name).tool, np.eye(4))]


@pytest.mark.parametrize("name", OWN_TOOLS)
def test_the_tool_that_leads_to_a_flange_is_named_where_another_takes_its_place(name: str) -> None:
    """A tool that begins with what is named, and holds nothing else, is the arm's own."""
    own = load_robot(name)
    job = {
        "version": 1,
        "robot": name,
        "start": {"joints": [0] * len(own.joints)},
        "tool": {"xyz": [0, 0, 1]},
    }
    job |= {"moves": [{"planner": "hold", "duration": 1}]}
    events = [event for event in job_from_text(json.dumps(job)).events if event.kind == "own_tool_replaced"]
    (said,) = (event.text() for event in events)
    xyz, rotvec = (json.loads(text) for text in re.findall(r"\[.*?\]", said))
    named = job_from_text(json.dumps(job | {"tool": {"xyz": xyz, "rotvec": rotvec}}))
    assert named.robot.tool == pytest.approx(own.tool, abs=1e-8)
    assert not job_from_text(json.dumps({key: value for key, value in job.items() if key != "tool"})).events


def test_most_arms_end_at_their_flange() -> None:
    assert {"panda", "fr3", "irb120", "irb1200", "m10ia", "gp7"} <= set(OWN_TOOLS)
    assert not {"ur5e", "irb140", "kr6_r900"} & set(OWN_TOOLS)
