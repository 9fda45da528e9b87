"""Robots of files, of the catalogue, of URDFs and of jobs: every number of the table at its place, in SI."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.job.dump import robot_as_mapping
from trajcli.job.read import job_from_text, load_job
from trajcli.job.robot import load_robot, load_sheet
from trajcli.kinematics.robot import Friction, LinkInertia, Robot
from trajcli.units import Units

MODELS = Path(__file__).parents[1] / "urdf" / "models"
LINK = "link: {mass: 2, com: [10, 20, 30], inertia: [1, 1.1, 1.2, 0.01, 0.02, 0.03]}"
ARM = f"""
name: bench
units: {{angle: deg, length: mm}}
source: a book
licence: CC0-1.0
note: made up
maker: nobody
origin: textbook
date: 2026-11
convention: modified
base: {{xyz: [100, 0, 0]}}
tool: {{xyz: [0, 50, 0]}}
joints:
  - {{theta: 10, d: 200, a: 300, alpha: 40, beta: 5, sign: -1, position: [-90, 180], velocity: 20, acceleration: 30,
      jerk: 40, effort: [-50, 60], friction: {{coulomb: 1.5, viscous: 2.5}}, rotor: 0.3, {LINK},
      velocity_by_position: {{deceleration: 70, offset: 8}}}}
  - {{name: lift, type: prismatic, position: [-100, 200], velocity: 20, acceleration: 30, jerk: 40, effort: 70, {LINK}}}
"""
DEG = np.pi / 180


def saved(folder: Path, text: str = ARM, name: str = "arm.yaml") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def of_job(folder: Path, robot: str, more: str = "") -> Robot:
    text = (
        f"version: 1\nrobot: {robot}\n{more}start: {{joints: 0}}\nmoves: [{{planner: hold, duration: 1}}]\n"
    )
    path = saved(folder, text, "job.yaml")
    return load_job(path).robot


def test_every_number_of_a_robot_file_is_in_si_and_at_its_place(tmp_path: Path) -> None:
    sheet = load_sheet(saved(tmp_path))
    robot, (turn, lift) = sheet.robot, sheet.robot.joints
    assert (robot.name, robot.convention, robot.joint_names) == ("bench", "modified", ("j1", "lift"))
    np.testing.assert_allclose(
        (turn.theta, turn.d, turn.a, turn.alpha, turn.beta, turn.sign),
        (10 * DEG, 0.2, 0.3, 40 * DEG, 5 * DEG, -1),
    )
    assert (turn.friction, turn.rotor, turn.effort) == (Friction(1.5, 2.5), 0.3, (-50.0, 60.0))
    assert turn.link == LinkInertia(2.0, (0.01, 0.02, 0.03), (1.0, 1.1, 1.2, 0.01, 0.02, 0.03))
    assert (lift.type, lift.friction, lift.rotor, lift.sign) == ("prismatic", Friction(), 0.0, 1)
    limits = robot.limits
    np.testing.assert_allclose(limits.position, [[-90 * DEG, 180 * DEG], [-0.1, 0.2]])
    for order, size in ((1, 20), (2, 30), (3, 40)):
        bound = np.array([size * DEG, size * 1e-3])
        np.testing.assert_allclose(limits.of_order(order), np.column_stack([-bound, bound]))
    np.testing.assert_allclose(limits.velocity_by_position, [[70 * DEG, 8 * DEG], [np.inf, 0]])
    np.testing.assert_allclose(limits.effort, [[-50, 60], [-70, 70]])
    np.testing.assert_allclose(robot.base[:3, 3], [0.1, 0, 0])
    np.testing.assert_allclose(robot.tool[:3, 3], [0, 0.05, 0])
    said = (sheet.source, sheet.licence, sheet.note, sheet.maker, sheet.origin, sheet.date)
    assert said == ("a book", "CC0-1.0", "made up", "nobody", "textbook", "2026-11")
    assert sheet.units == Units("deg", "mm")
    assert sheet.text is not None
    assert sheet.text.strip() == ARM.strip()


def test_numbers_of_a_table_that_are_written_have_their_units(tmp_path: Path) -> None:
    row = robot_as_mapping(load_robot(saved(tmp_path)))["joints"][0]
    units = {key: str(row[key]).split()[-1] for key in ("theta", "d", "a", "alpha", "beta")}
    assert units == {"theta": "rad", "d": "m", "a": "m", "alpha": "rad", "beta": "rad"}


@pytest.mark.parametrize(
    ("units", "angle", "length"),
    [
        ("", 1, 1),
        ("units: {angle: deg}", DEG, 1),
        ("units: {length: mm}", 1, 1e-3),
        ("units: {angle: rad}", 1, 1),
    ],
)
def test_each_unit_of_a_file_stands_for_itself(
    tmp_path: Path, units: str, angle: float, length: float
) -> None:
    path = saved(tmp_path, f"{units}\nconvention: standard\njoints: [{{alpha: 2, a: 3}}]\n", "My Arm.yaml")
    joint = load_robot(path).joints[0]
    np.testing.assert_allclose((joint.alpha, joint.a), (2 * angle, 3 * length))
    assert load_robot(path).name == "My Arm"


def test_efforts_are_in_force_where_all_links_have_a_mass_and_somebody_looked_at_them(tmp_path: Path) -> None:
    """A catalogue's or a URDF's own efforts count only where a job asks for them."""
    assert load_robot(saved(tmp_path)).limits.has_effort
    assert not load_robot(
        saved(tmp_path, ARM.replace(f"40, effort: 70, {LINK}", "40, effort: 70"))
    ).limits.has_effort
    assert not load_robot(
        saved(tmp_path, ARM.replace("source: a book", "source: arm.urdf"))
    ).limits.has_effort
    assert not load_robot("panda").limits.has_effort
    assert of_job(tmp_path, "{file: arm.yaml}").limits.has_effort is False  # of the last file, from a URDF
    bare = "{joints: [{effort: 5}]}"
    assert not of_job(tmp_path, bare).limits.has_effort


def test_robots_of_one_file_share_nothing_that_is_computed_of_them(tmp_path: Path) -> None:
    for name in (saved(tmp_path), "ur5e", MODELS / "ur5.urdf"):
        assert load_robot(name) is not load_robot(name)


@pytest.mark.parametrize("count", [1, 12])
def test_a_number_of_joints_is_that_many_bare_ones(tmp_path: Path, count: int) -> None:
    robot = of_job(tmp_path, f"{{joints: {count}}}")
    assert robot.joint_names == tuple(f"j{k}" for k in range(1, count + 1))
    assert robot.convention is None


@pytest.mark.parametrize(
    ("robot", "said"),
    [
        ("{joints: 0}", "expected 1 to 12 joints, got 0"),
        ("{joints: 13}", "expected 1 to 12 joints, got 13"),
        ("{joints: true}", "expected a list of joints or their number"),
        ("{joints: 1.5}", "expected a list of joints or their number"),
        ("{joints: [{name: a}, {name: b}, {name: b}]}", "'b' stands twice"),
        ("{joints: [{name: j2}, {}]}", "'j2' stands twice"),
        ("{joints: [{velocity_by_position: {deceleration: 1}}]}", "needs its position limits"),
        *(
            (f"{{joints: [{{{key}: 1}}]}}", "need a `convention`")
            for key in ("theta", "d", "a", "alpha", "beta")
        ),
        ("{joints: 2, units: {angle: deg}}", "uses the job's units"),
        ("{name: ur5e}", "ur5e is a robot of the catalogue"),
        ("{fil: arm.yaml}", "unknown key 'fil'"),
        ("{file: arm.yaml, limits: {velocity: 1}}", "unknown key 'limits' beside `file`"),
        ("{file: 3}", "expected a path"),
        ("{urdf: ur5.urdf, exact: 1}", "expected true or false"),
        ("{urdf: ur5.urdf, root: 1}", "expected the name of a link"),
        ("{urdf: ur5.urdf, top: a}", "unknown key 'top' beside `urdf`"),
        ("ur5.urdf", "no robot 'ur5.urdf'"),
        ("ur55", "no robot 'ur55'"),
        ("3", "expected a robot's name"),
    ],
)
def test_what_is_no_robot_is_refused(tmp_path: Path, robot: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        of_job(tmp_path, robot)
    problem = caught.value.problems[0]
    assert said in problem.message
    assert problem.place is not None
    assert (problem.place.line, Path(problem.place.file).name) == (2, "job.yaml")


def test_a_robot_inside_a_job_is_in_the_units_of_the_job(tmp_path: Path) -> None:
    robot = of_job(
        tmp_path,
        "{joints: [{velocity: 90}, {type: prismatic, velocity: 90}]}",
        "units: {angle: deg, length: mm}\n",
    )
    np.testing.assert_allclose(robot.limits.velocity[:, 1], [np.pi / 2, 0.09])


def test_a_urdf_of_a_job_is_read_from_its_folder_between_the_links_that_are_named(tmp_path: Path) -> None:
    saved(tmp_path, (MODELS / "ur5.urdf").read_text(encoding="utf-8"), "Arm.URDF")
    own = load_robot(tmp_path / "Arm.URDF")
    assert len(own.joints) == 6
    names = own.joint_names
    whole = of_job(tmp_path, "{urdf: Arm.URDF}")
    assert whole.joint_names == names
    exact = of_job(tmp_path, "{urdf: Arm.URDF, exact: true}")
    assert not np.array_equal([exact.base, exact.tool], [whole.base, whole.tool])
    part = of_job(tmp_path, "{urdf: Arm.URDF, root: upper_arm_link, tip: wrist_2_link}")
    assert part.joint_names == names[2:5]


def test_what_was_taken_for_granted_in_a_urdf_is_an_event() -> None:
    text = f"version: 1\nrobot: {{urdf: {MODELS / 'ur5.urdf'}}}\nstart: {{joints: 0}}\nmoves: [{{planner: hold, duration: 1}}]\n"
    assert "angles_snapped" in [event.kind for event in job_from_text(text).events]
    exact = text.replace("ur5.urdf", "ur5.urdf, exact: true")
    assert "angles_snapped" not in [event.kind for event in job_from_text(exact).events]
