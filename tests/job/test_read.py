"""Jobs become SI values: units, points by name, values by joint, robots from everywhere."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

from trajcli.errors import FileError, InputError
from trajcli.job.dump import dump_job
from trajcli.job.read import LoadedJob, files_of, job_from_text, load_job
from trajcli.job.yaml.load import parse_document
from trajcli.kinematics.robot import Friction, LinkInertia
from trajcli.planners.point_to_point.point_to_point import Hold
from trajcli.planners.point_to_point.polynomial import Quintic
from trajcli.planners.point_to_point.trapezoid import Trapezoid

DEG = math.pi / 180


def job(moves: str = "{planner: hold, duration: 1}", **keys: str) -> LoadedJob:
    parts = {"version": "1", "robot": "{joints: 2}", "start": "{joints: 0}", **keys}
    return job_from_text("\n".join(f"{k}: {v}" for k, v in parts.items()) + f"\nmoves: [{moves}]\n", "j.yaml")


def test_a_job_in_si() -> None:
    loaded = job("{planner: quintic, to: {joints: [1, 2], velocity: [0.5, 0], acceleration: 3}, duration: 4}")
    (move,) = loaded.job.moves
    assert isinstance(move, Quintic)
    assert (move.duration, move.to.joints, move.to.velocity) == (4.0, (1.0, 2.0), (0.5, 0.0))
    assert move.to.acceleration == (3.0, 3.0)
    assert (loaded.name, loaded.robot.name, loaded.robot.joint_names) == ("j", "robot", ("j1", "j2"))
    assert loaded.job.output.rate == 1000
    assert loaded.job.output.columns == ("t", "q", "qd", "qdd")
    assert loaded.events == ()


UNITS = [  # in the file, units, SI
    ("90", "{angle: deg}", 90 * DEG),
    ("90", "{}", 90.0),
    ("-90.5", "{angle: deg, length: mm}", -90.5 * DEG),
    ("90 deg", "{}", 90 * DEG),
    ("90deg", "{angle: deg}", 90 * DEG),
    ("0.25 rev", "{angle: deg}", math.pi / 2),
    ("1e2 mrad", "{angle: deg}", 0.1),
]


@pytest.mark.parametrize(("text", "units", "si"), UNITS)
def test_units_of_angles(text: str, units: str, si: float) -> None:
    loaded = job(units=units, start=f"{{joints: [{text}, 0]}}")
    assert loaded.job.start.joints is not None
    assert loaded.job.start.joints[0] == pytest.approx(si, rel=1e-15)


MIXED = "{joints: [{name: turn}, {name: lift, type: prismatic}]}"
FORMS = ["90", "[90, 90]", "{lift: 90, turn: 90}", "[90 deg, 9 cm]", '{turn: "90 deg", lift: 0.09 m}']


@pytest.mark.parametrize("form", FORMS)
def test_values_by_joint_in_every_form_on_mixed_joints(form: str) -> None:
    loaded = job(robot=MIXED, units="{angle: deg, length: mm}", start=f"{{joints: {form}}}")
    assert loaded.job.start.joints == pytest.approx((math.pi / 2, 0.09), rel=1e-15)


RATES = [
    ("velocity", "1 rev/s", "10 mm/s", "/s"),
    ("velocity", "60 rpm", "0.6 m/min", "/min"),
    ("acceleration", "1 rev/s^2", "10 mm/s²", "/s^2"),
]


@pytest.mark.parametrize(("key", "turn", "lift", "_unit"), RATES)
def test_rates_on_mixed_joints(key: str, turn: str, lift: str, _unit: str) -> None:
    loaded = job(
        robot=MIXED,
        start=f"{{joints: 0, {key}: {{turn: {turn}, lift: {lift}}}}}",
        moves="""
      {planner: quintic, to: {joints: 0}, duration: 1}""",
    )
    assert getattr(loaded.job.start, key) == pytest.approx((2 * math.pi, 0.01), rel=1e-15)


def test_joints_that_a_mapping_of_rates_leaves_out_are_zero() -> None:
    loaded = job(
        robot=MIXED,
        start="{joints: 0, velocity: {lift: 2}}",
        moves="""
      {planner: jerk_limited, to: {velocity: {turn: 1}}}""",
    )
    assert loaded.job.start.velocity == (0.0, 2.0)
    assert loaded.job.moves[0].to.velocity == (1.0, 0.0)  # type: ignore[union-attr]


def test_points_by_name() -> None:
    loaded = job(
        "{planner: cubic, to: there, duration: 1}, {planner: cubic, to: near, duration: 1}",
        points="{there: {joints: [1, 2]}, near: {joints: 3, velocity: 1}, again: there}",
        start="again",
    )
    assert loaded.job.start.joints == (1.0, 2.0)
    assert [m.to.joints for m in loaded.job.moves] == [(1.0, 2.0), (3.0, 3.0)]  # type: ignore[union-attr]
    assert loaded.job.moves[1].to.velocity == (1.0, 1.0)  # type: ignore[union-attr]


def test_bare_joints_have_no_geometry_and_no_limits() -> None:
    robot = job(robot="{joints: 12}").robot
    assert (robot.convention, len(robot.joints), set(robot.joint_types)) == (None, 12, {"revolute"})
    assert all(np.isinf(robot.limits.of_order(order)).all() for order in range(4))


def test_an_inline_robot_uses_the_units_of_the_job() -> None:
    robot = job(
        units="{angle: deg, length: mm}",
        robot="""{name: arm, convention: modified, joints: [{d: 100, alpha: 90, position: [-90, 45], velocity: 30},
          {type: prismatic, theta: 90, a: 2.5, sign: -1, position: [0, 300], acceleration: [-10, 20], jerk: null}],
          base: {xyz: [1000, 0, 0]}, tool: {xyz: [0, 0, 5], rpy: [0, 0, 90]}}""",
    ).robot
    first, second = robot.joints
    assert (robot.name, robot.convention, second.sign) == ("arm", "modified", -1)
    assert (first.d, first.alpha, second.theta, second.a) == pytest.approx(
        (0.1, math.pi / 2, math.pi / 2, 0.0025)
    )
    assert robot.limits.position == pytest.approx(np.array([[-math.pi / 2, math.pi / 4], [0, 0.3]]))
    assert robot.limits.velocity[0] == pytest.approx([-30 * DEG, 30 * DEG])
    assert robot.limits.acceleration[1] == pytest.approx([-0.01, 0.02])
    assert np.isinf(robot.limits.jerk).all()
    assert robot.base[:3, 3] == pytest.approx([1, 0, 0])
    quarter_turn = [[0, -1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0.005], [0, 0, 0, 1]]
    assert robot.tool == pytest.approx(np.array(quarter_turn), abs=1e-15)


ROBOT_FILE = "units: {angle: deg, length: mm}\njoints: [{velocity: 90}, {type: prismatic, velocity: 250}]\n"


@pytest.mark.parametrize("by", ["relative", "absolute", "from another folder"])
def test_a_robot_file_has_its_own_units(tmp_path: Path, by: str, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "jobs").mkdir()
    (tmp_path / "arms").mkdir()
    file = tmp_path / "arms" / "slider.yaml"
    file.write_text(ROBOT_FILE)
    path = tmp_path / "jobs" / "job.yaml"
    named = str(file) if by == "absolute" else "../arms/slider.yaml"
    path.write_text(
        f"version: 1\nrobot: {{file: {named}}}\nstart: {{joints: 1}}\nmoves: [{{planner: hold, duration: 1}}]\n"
    )
    if by != "relative":
        monkeypatch.chdir("/")
        loaded = load_job(str(path))
    else:
        monkeypatch.chdir(tmp_path)
        loaded = load_job("jobs/job.yaml")
    assert loaded.robot.name == "slider"
    assert loaded.robot.limits.velocity[:, 1] == pytest.approx([math.pi / 2, 0.25])
    assert loaded.job.start.joints == (1.0, 1.0)  # the units of the job, not those of the robot's file


def test_flaws_of_a_robot_file_come_with_those_of_the_job(tmp_path: Path) -> None:
    (tmp_path / "arm.yaml").write_text("units: {angle: deg}\njoints: [{velocity: -3}]\n")
    path = tmp_path / "job.yaml"
    path.write_text(
        "version: 1\nrobot: {file: arm.yaml}\nstart: {joints: 1}\nmoves: [{planner: hold, duration: 0}]\n"
    )
    with pytest.raises(InputError) as caught:
        load_job(path)
    places = [
        (Path(p.place.file).name, p.place.line, p.place.column) for p in caught.value.problems if p.place
    ]
    assert places == [("arm.yaml", 2, 21), ("job.yaml", 4, 35)]


def test_a_missing_robot_file_is_said_where_it_is_named(tmp_path: Path) -> None:
    path = tmp_path / "job.yaml"
    path.write_text(
        "version: 1\nrobot: {file: arm.yaml}\nstart: {joints: 1}\nmoves: [{planner: hold, duration: 1}]\n"
    )
    with pytest.raises(FileError) as caught:
        load_job(path)
    (problem,) = caught.value.problems
    assert "arm.yaml" in problem.message
    assert problem.place is not None
    assert (problem.place.file, problem.place.line, problem.place.column) == (str(path), 2, 15)


def test_fields_of_a_trapezoid_and_a_hold() -> None:
    loaded = job(
        "{planner: trapezoid, to: {joints: 1}, velocity: [1, 2], overshoot: true}, {planner: hold, duration: 3 ms}"
    )
    trapezoid, hold = loaded.job.moves
    assert isinstance(trapezoid, Trapezoid)
    assert isinstance(hold, Hold)
    assert (trapezoid.velocity, trapezoid.overshoot, trapezoid.synchronize) == ((1.0, 2.0), True, "time")
    assert hold.duration == pytest.approx(0.003)


def test_the_name_of_a_job() -> None:
    assert job().name == "j"
    assert job(name="pick").name == "pick"


SAID = [
    ((math.pi, 0, 0), "180 deg"),
    ((0.25, 1, 1), "250 mm/s"),
    ((math.pi, 3, 0), "180 deg/s^3"),
    ((1.5, 0, None), "1.5 s"),
    ((math.inf, 2, 1), "unlimited"),
]


@pytest.mark.parametrize(("amount", "text"), SAID)
def test_amounts_are_said_in_the_units_of_the_job(amount: tuple[float, int, int | None], text: str) -> None:
    from trajcli.errors import Amount

    assert job(robot=MIXED, units="{angle: deg, length: mm}").say(Amount(*amount)) == text


QUARTER = "0.7071067811865476"
POSES = [  # the same pose in every form
    "{xyz: [1, 2, 3], rpy: [0, 0, 90]}",
    f"{{xyz: [1, 2, 3], quat_wxyz: [{QUARTER}, 0, 0, {QUARTER}]}}",
    f"{{xyz: [1, 2, 3], quat_wxyz: [-{QUARTER}, 0, 0, -{QUARTER}]}}",
    f"{{xyz: [1, 2, 3], quat_xyzw: [0, 0, {QUARTER}, {QUARTER}]}}",
    "{xyz: [1, 2, 3], rotvec: [0, 0, 90]}",
    "{xyz: [1, 2, 3], matrix: [[0, -1, 0], [1, 0, 0], [0, 0, 1]]}",
    "{matrix: [[0, -1, 0, 1], [1, 0, 0, 2 mm], [0, 0, 1, 3], [0, 0, 0, 1]]}",
    "{xyz: [1, 2, 0.3 cm], axis_angle: {axis: z, angle: 90}}",
    "{xyz: [1, 2, 3], axis_angle: {axis: [0, 0, -2], angle: -0.25 rev}}",
    "{xyz: [1, 2, 3], euler: {sequence: ZYX, angles: [90, 0, 0]}}",
    "{xyz: [1, 2, 3], euler: {sequence: XYZ, frame: fixed, angles: [0, 0, 90]}}",
]


@pytest.mark.parametrize("form", POSES)
def test_poses_in_every_form(form: str) -> None:
    robot = job(units="{angle: deg, length: mm}", robot=f"{{joints: 2, tool: {form}}}").robot
    expected = [[0, -1, 0, 0.001], [1, 0, 0, 0.002], [0, 0, 1, 0.003], [0, 0, 0, 1]]
    assert robot.tool == pytest.approx(np.array(expected), abs=1e-15)
    assert np.array_equal(robot.base, np.eye(4))


DYNAMIC = """\
version: 1
units: {angle: deg, length: mm}
robot:
  joints:
    - {effort: 30, friction: {coulomb: 1.5, viscous: 0.25}, rotor: 0.1,
       link: {mass: 2, com: [10, 0, -5], inertia: [1, 2, 2.5, 0.1, 0, 0]}}
    - {effort: [-5, 7]}
    - {effort: null}
start: {joints: 0}
moves: [{planner: hold, duration: 1}]
"""


def test_dynamics_of_joints_are_in_si_but_for_the_centre_of_mass() -> None:
    first, second, third = job_from_text(DYNAMIC).robot.joints
    assert first.effort == (-30, 30)
    assert first.friction == Friction(1.5, 0.25)
    assert first.rotor == 0.1
    assert first.link == LinkInertia(2.0, (0.01, 0.0, -0.005), (1, 2, 2.5, 0.1, 0, 0))
    assert second.effort == (-5, 7)
    assert third.effort == (-math.inf, math.inf)
    assert third.friction == Friction()
    assert third.link is None
    again = job_from_text(dump_job(job_from_text(DYNAMIC)))
    assert again.robot.joints == (first, second, third)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mass: 2,", "mass: 0,", "expected a number above 0 kg, got 0"),
        ("mass: 2,", "mass: -1,", "expected a number above 0 kg, got -1"),
        ("mass: 2, ", "", "`mass` is missing"),
        ("[1, 2, 2.5, 0.1, 0, 0]", "[1, 2, -0.1, 0, 0, 0]", "no solid has a negative moment of inertia"),
        ("[1, 2, 2.5, 0.1, 0, 0]", "[1, 1, 1, 2, 0, 0]", "no solid has a negative moment of inertia"),
        ("[1, 2, 2.5, 0.1, 0, 0]", "[1, 2, 3.1, 0, 0, 0]", "above the sum of the two others"),
        ("[1, 2, 2.5, 0.1, 0, 0]", "[1, 2, 3]", "expected 6 numbers, got 3 values"),
        ("com: [10, 0, -5]", "com: 3", "expected 3 numbers, got 3"),
        ("coulomb: 1.5", "coulomb: -1", "expected a number at least 0, got -1"),
        ("rotor: 0.1", "rotor: -0.1", "expected a number at least 0 kg m^2, got -0.1"),
        ("effort: 30", "effort: 0", "expected a number above 0 (N m or N)"),
        ("[-5, 7]", "[5, 7]", "got [5, 7]"),
        ("[-5, 7]", "[-5, 6, 7]", "got [-5, 6, 7]"),
    ],
)
def test_impossible_dynamics_are_refused(old: str, new: str, message: str) -> None:
    assert old in DYNAMIC
    with pytest.raises(InputError, match=re.escape(message)) as refused:
        job_from_text(DYNAMIC.replace(old, new))
    place = refused.value.problems[0].place
    assert place is not None
    assert place.line in (5, 6, 7)


def test_files_of_places_are_files_of_the_job() -> None:
    named = """\
start: {csv: a.csv}
moves:
  - {planner: path, segments: {csv: b.csv, merge: 0}}
  - {planner: spline, through: {csv: c.csv}}
  - {repeat: 2, moves: [{planner: path, segments: {csv: d.csv}}, {planner: path, segments: {csv: b.csv}}]}
  - {planner: path, segments: [{line: {xyz: [0, 0, 1]}}]}
sequences: {one: [{planner: path, segments: {csv: e.csv}}]}
"""
    files = list(files_of(parse_document(named, "cell/job.yaml")))
    assert files == [
        ("the job", "cell/job.yaml"),
        *(("the recording", str(Path(f"cell/{name}.csv"))) for name in "abcde"),
    ]
