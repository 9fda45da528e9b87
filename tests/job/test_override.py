"""`--set` and `--rate`."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.job.read import LoadedJob, load_job
from trajcli.job.yaml.load import MAX_DEPTH

JOB = """\
version: 1
units: {angle: deg}
robot: {joints: 2}
points: {a: {joints: [0, 0]}}
start: a
moves:
  - {planner: quintic, to: {joints: [10, 10]}, duration: 2}
"""


@pytest.fixture
def path(tmp_path: Path) -> Path:
    file = tmp_path / "job.yaml"
    file.write_text(JOB)
    return file


def moved(loaded: LoadedJob) -> object:
    move = loaded.job.moves[0].model_dump(exclude_none=True)
    return {key: move[key] for key in ("planner", "duration") if key in move}


SETTINGS = [  # settings, what came of them
    (["moves.0.duration=3"], {"planner": "quintic", "duration": 3.0}),
    ([" moves.0.duration = 3"], {"planner": "quintic", "duration": 3.0}),
    (["moves.0.duration=3 ms"], {"planner": "quintic", "duration": 0.003}),
    (["moves.0.duration=3", "moves.0.duration=4"], {"planner": "quintic", "duration": 4.0}),
    (["moves.0={planner: hold, duration: 5}"], {"planner": "hold", "duration": 5.0}),
    (["moves.0={planner: hold}", "moves.0.duration=6"], {"planner": "hold", "duration": 6.0}),
    (["moves.0.planner=cubic"], {"planner": "cubic", "duration": 2.0}),
]


@pytest.mark.parametrize(("settings", "expected"), SETTINGS)
def test_values_are_replaced(path: Path, settings: list[str], expected: object) -> None:
    assert moved(load_job(path, settings)) == expected


def test_values_are_added(path: Path) -> None:
    loaded = load_job(
        path, ["output.columns=[t, q]", "limits.velocity=30", "name=x=y", "points.b={joints: 3}"]
    )
    assert (loaded.job.output.columns, loaded.name) == (("t", "q"), "x=y")
    assert loaded.robot.limits.velocity[0, 1] == pytest.approx(0.5235987755982988)
    assert set(loaded.job.points) == {"a", "b"}


@pytest.mark.parametrize(("rate", "hertz"), [("250", 250.0), ("1 kHz", 1000.0), ("2.5e2", 250.0)])
def test_rate(path: Path, rate: str, hertz: float) -> None:
    assert load_job(path, ["output.rate=7"], rate=rate).job.output.rate == hertz


WRONG = [  # settings, rate, message, place
    (["moves.0.duration"], None, "--set moves.0.duration: expected PATH=VALUE", None),
    (["=3"], None, "--set =3: expected PATH=VALUE", None),
    (["moves..duration=3"], None, "--set moves..duration=3: expected PATH=VALUE", None),
    (["moves.1.duration=3"], None, "--set moves.1.duration=3: there is no '1' in a list of 1 entry", None),
    (["moves.x=3"], None, "--set moves.x=3: there is no 'x' in a list of 1 entry", None),
    (["moves.-1=3"], None, "--set moves.-1=3: there is no '-1' in a list of 1 entry", None),
    (
        ["start.joints=3"],
        None,
        "--set start.joints=3: 'joints' would stand inside a, which holds no keys",
        None,
    ),
    (["moves.0.duration=-3"], None, "expected a number above 0 s, got -3", "--set moves.0.duration=-3:1:1"),
    (["moves.0.speed=3"], None, "unknown key 'speed'", "--set moves.0.speed=3:1:1"),
    (["moves.0.speed.x=3"], None, "unknown key 'speed'", "--set moves.0.speed.x=3:1:1"),
    (["moves.0.to.0=3"], None, "unknown key '0'", "--set moves.0.to.0=3:1:1"),
    (["moves.0.to.0.1=3", "moves.0.to.0=7"], None, "unknown key '0'", "--set moves.0.to.0=7:1:1"),
    (
        ["moves.0={planner: hold, duration: 1, durtion: 1}"],
        None,
        "unknown key 'durtion'",
        "--set moves.0={planner: hold, duration: 1, durtion: 1}:1:30",
    ),
    (["moves.0.duration="], None, "expected a number (s), got null", "--set moves.0.duration=:1:1"),
    (["moves.0.duration=[1"], None, "'[' is never closed", "--set moves.0.duration=[1:1:1"),
    (
        ["moves.0.duration=-1", "moves.0={planner: quintic, to: a, duration: -2}"],
        None,
        "expected a number above 0 s, got -2",
        "--set moves.0={planner: quintic, to: a, duration: -2}:1:37",
    ),
    (
        ["moves.0={planner: quintic, to: a, duration: 2}", "moves.0.duration=-3"],
        None,
        "expected a number above 0 s, got -3",
        "--set moves.0.duration=-3:1:1",
    ),
    (
        ["a" + ".a" * MAX_DEPTH + "=1"],
        None,
        f"--set {('a.' * 20)}...: a path of {MAX_DEPTH + 1} parts, a job is at most {MAX_DEPTH} levels deep",
        None,
    ),
    ([], "fast", 'expected a frequency such as "500 Hz", got "fast"', "--rate fast:1:1"),
    ([], "0", "expected a number above 0 Hz, got 0", "--rate 0:1:1"),
]


@pytest.mark.parametrize(("settings", "rate", "message", "place"), WRONG)
def test_wrong_settings(
    path: Path, settings: list[str], rate: str | None, message: str, place: str | None
) -> None:
    with pytest.raises(InputError) as caught:
        load_job(path, settings, rate=rate)
    problem = caught.value.problems[0]
    assert problem.message == message
    assert (str(problem.place) if problem.place else None) == place


def test_a_rate_against_times(path: Path) -> None:
    path.write_text(JOB + "output: {times: [0, 1]}\n")
    with pytest.raises(InputError, match="rate and times exclude each other"):
        load_job(path, rate="5")


def test_the_rest_of_the_file_keeps_its_places(path: Path) -> None:
    path.write_text(JOB.replace("to: {joints: [10, 10]}", "to: b"))
    with pytest.raises(InputError) as caught:
        load_job(path, ["moves.0.duration=3"])
    assert str(caught.value.problems[0].place) == f"{path}:7:28"


ARM = """\
version: 1
units: {angle: deg, length: mm}
robot: ur5e
start: {joints: [0, -90, 90, 0, 90, 0]}
moves: [{planner: quintic, to: {joints: [10, -80, 90, 0, 90, 0]}, duration: 2}]
"""


@pytest.fixture
def arm(tmp_path: Path) -> Path:
    file = tmp_path / "arm.yaml"
    file.write_text(ARM)
    return file


def test_what_the_job_leaves_out_is_written_first(arm: Path) -> None:
    """The rest stays as it is without the setting; lengths are in mm and angles in degrees."""
    plain = load_job(arm).robot
    moved = load_job(arm, ["base.xyz.1=250", "tool.xyz.2=80"]).robot
    assert moved.base[:3, 3].tolist() == [plain.base[0, 3], 0.25, plain.base[2, 3]]
    np.testing.assert_allclose(moved.base[:3, :3], plain.base[:3, :3], atol=1e-15)  # half a turn about z
    assert moved.base[0, 0] == -1
    np.testing.assert_array_equal(moved.tool[:3, 3], [*plain.tool[:2, 3], 0.08])
    turned = load_job(arm, ["base.rpy.2=90"]).robot
    np.testing.assert_allclose(turned.base[:3, :3], [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-15)
    assert load_job(arm, ["gravity.2=-1.62"]).job.gravity == (0, 0, -1.62)
    assert load_job(arm, ["output.columns.3=pose"]).job.output.columns == ("t", "q", "qd", "pose")
    start = load_job(arm, ["start.velocity.1=5"]).job.start
    assert start.velocity == pytest.approx([0, np.radians(5), 0, 0, 0, 0])


def test_a_limit_of_one_joint_leaves_the_others(arm: Path) -> None:
    plain, other = (load_job(arm, settings).robot.limits for settings in ([], ["limits.velocity.2=[-7, 9]"]))
    expected = plain.velocity.copy()
    expected[2] = np.radians([-7, 9])
    np.testing.assert_allclose(other.velocity, expected, rtol=1e-15)
    np.testing.assert_array_equal(other.position, plain.position)
    effort = load_job(arm, ["limits.effort.0=12"]).robot.limits.effort
    assert effort.tolist() == [[-12, 12], *[[-np.inf, np.inf]] * 5]  # the maker's are not in force
    both = load_job(arm, ["limits.effort=robot", "moves.0.limits.effort.0=12"]).job.moves[0].limits
    assert both.effort == ((-12, 12), (-150, 150), (-150, 150), *[(-28, 28)] * 3)
    once = load_job(arm, ["limits={velocity: [1, 2, 3, 4, 5, 6]}", "moves.0.limits.velocity.2=2"])
    assert once.job.moves[0].limits.velocity[2] == pytest.approx(np.radians([-2, 2]))
    assert once.job.moves[0].limits.velocity[5] == pytest.approx(np.radians([-6, 6]))


REST = [  # lines of a job, a setting, the same written out
    ("frames: {f: {rpy: [10, 20, 30]}}", "frames.f.xyz.1=7", "frames.f.xyz=[0, 7, 0]"),
    ("frames: {f: {xyz: [1, 2, 3]}}", "frames.f.rpy.2=7", "frames.f.rpy=[0, 0, 7]"),
    ("tools: {t: {rpy: [10, 20, 30]}}", "tools.t.xyz.2=7", "tools.t.xyz=[0, 0, 7]"),
    ("tools: {t: {mass: 2}}", "tools.t.com.2=7", "tools.t.com=[0, 0, 7]"),
    ("points: {p: {joints: 3}}", "points.p.velocity.3=7", "points.p.velocity=[0, 0, 0, 7, 0, 0]"),
    ("", "moves.0.to={from: here, offset: {rpy: [1, 2, 3]}}", "moves.0.to.offset.xyz=[0, 7, 0]"),
]


@pytest.mark.parametrize(("line", "setting", "whole"), REST)
def test_the_rest_of_a_list_is_zero_where_nothing_else_counts(
    arm: Path, line: str, setting: str, whole: str
) -> None:
    arm.write_text(ARM + line + "\n")
    before = [setting] if "offset" in setting else []
    part = "moves.0.to.offset.xyz.1=7" if before else setting
    one, other = (load_job(arm, [*before, last]) for last in (part, whole))
    assert repr(one.job) == repr(other.job)


def test_the_rest_of_gravity_is_that_in_force(arm: Path) -> None:
    plain = load_job(arm).job.gravity
    assert plain[2] != 0
    assert load_job(arm, ["gravity.0=3"]).job.gravity == (3, *plain[1:])


@pytest.mark.parametrize("key", ["base", "tool"])
def test_the_rest_of_base_and_tool_is_that_of_the_robot(arm: Path, key: str) -> None:
    """On a rail, too, whose arm may stand anywhere on it: what is set to what it is changes nothing."""
    place = "base: {xyz: [70, 80, 90], rpy: [10, 20, 30]}, tool: {xyz: [1, 2, 3], rpy: [40, 50, 60]}"
    robot = f"{{convention: standard, joints: [{{a: 100}}, {{a: 200}}], {place}}}"
    tail = "moves: [{planner: hold, duration: 1}]\n"
    for written, joints in (
        (robot, 2),
        (f"{{rail: {{axis: x}}, arm: {robot}, mount: {{xyz: [5, 0, 0]}}}}", 3),
    ):
        start = f"start: {{joints: {[0] * joints}}}\n"
        arm.write_text(f"version: 1\nunits: {{angle: deg, length: mm}}\nrobot: {written}\n{start}{tail}")
        plain = load_job(arm).robot
        pose = plain.stand if key == "base" else plain.tool
        same = load_job(arm, [f"{key}.xyz.1={float(pose[1, 3])!r} m"]).robot
        np.testing.assert_allclose(same.base, plain.base, rtol=0, atol=1e-15)
        np.testing.assert_allclose(same.tool, plain.tool, rtol=0, atol=1e-15)


def test_settings_go_on_where_others_have_written(arm: Path) -> None:
    whole = load_job(arm, ["base={xyz: [1, 2, 3]}"]).robot.base
    parts = load_job(
        arm, ["base={xyz: [0, 0, 0]}", "base.xyz.0=1", "base.xyz.1=2", "base.xyz.2=3"]
    ).robot.base
    np.testing.assert_array_equal(whole, parts)
    turned = load_job(arm, ["base={xyz: [1, 2, 3]}", "base.rpy.0=90"]).robot.base
    np.testing.assert_array_equal(turned[:3, 3], whole[:3, 3])
    assert turned[2, 1] == 1


def test_what_nothing_takes_the_place_of_is_asked_for(arm: Path) -> None:
    with pytest.raises(InputError) as refused:
        load_job(arm, ["moves.0.to.xyz.0=3"])
    (problem,) = refused.value.problems
    assert problem.message == (
        "--set moves.0.to.xyz.0=3: the job has no moves.0.to.xyz, and nothing takes its place"
    )
    assert problem.hint == "write the whole of it: moves.0.to.xyz=[...]"


@pytest.mark.parametrize("setting", ["start.joints.0=3", "start.joints=3"])
def test_a_path_into_the_name_of_a_point_is_led_to_the_point(path: Path, setting: str) -> None:
    """Nothing can be put inside a name, so that no list is asked for there; the advice works as it stands."""
    with pytest.raises(InputError) as refused:
        load_job(path, [setting])
    (problem,) = refused.value.problems
    assert problem.message == f"--set {setting}: 'joints' would stand inside a, which holds no keys"
    point = f"points.a.{setting.removeprefix('start.').removesuffix('=3')}="
    assert problem.hint == f"it is a point: {point}..."
    assert load_job(path, [f"{point}4"]).job.start.joints is not None


IN_FORCE = [  # limits, setting, the limit of the move, of each joint, deg/s or deg/s^2
    ("{velocity: 400}", "velocity.2=7", [400, 400, 7, 400, 400, 400]),
    ("{velocity: {elbow_joint: 9}}", "velocity.2=7", [180, 180, 7, 180, 180, 180]),
    ("{acceleration: 90}", "acceleration.2=7", [90, 90, 7, 90, 90, 90]),
    ("{velocity: 100, scale: {velocity: 0.5}}", "velocity.0=7", [7, 50, 50, 50, 50, 50]),
    ("{file: limits.yaml}", "velocity.0=7", [7, 180, 20, 180, 180, 180]),
    ("{file: limits.yaml, velocity: {wrist_3_joint: 3}}", "velocity.0=7", [7, 180, 20, 180, 180, 3]),
]


@pytest.mark.parametrize(("limits", "setting", "expected"), IN_FORCE)
def test_the_other_joints_of_a_limit_of_a_move_have_those_in_force(
    arm: Path, limits: str, setting: str, expected: list[float]
) -> None:
    arm.with_name("limits.yaml").write_text(f"joint_limits: {{elbow_joint: {{max_velocity: {np.pi / 9}}}}}\n")
    arm.write_text(ARM + f"limits: {limits}\n")
    (move,) = load_job(arm, [f"moves.0.limits.{setting}"]).job.moves
    bounds = getattr(move.limits, setting.partition(".")[0])
    np.testing.assert_allclose(np.degrees(bounds)[:, 1], expected, rtol=1e-12)
    np.testing.assert_array_equal(np.degrees(bounds)[:, 0], -np.degrees(bounds)[:, 1])


def test_the_other_joints_of_a_limit_of_a_job_have_those_before_its_scale(arm: Path) -> None:
    arm.with_name("limits.yaml").write_text(f"joint_limits: {{elbow_joint: {{max_velocity: {np.pi / 9}}}}}\n")
    arm.write_text(ARM + "limits: {file: limits.yaml, scale: {velocity: 0.5}}\n")
    limits = load_job(arm, ["limits.velocity.0=7"]).robot.limits
    np.testing.assert_allclose(np.degrees(limits.velocity[:, 1]), [3.5, 90, 10, 90, 90, 90], rtol=1e-12)


WRONG_BELOW = [  # the job's lines, settings, message of the first problem, its place
    ("limits: {velocty: 3}", ["limits.velocity.0=7"], "unknown key 'velocty'", 6),
    ("limits: 3", ["moves.0.limits.velocity.0=7"], "expected a mapping, got 3", 6),
    (
        "frames: {f: {xyz: no}}",
        ["units.angle=degree", "base.xyz.0=1"],
        'expected rad or deg, got "degree"',
        1,
    ),
]


@pytest.mark.parametrize(("more", "given", "message", "line"), WRONG_BELOW)
def test_flaws_of_what_is_written_first_are_those_of_the_job(
    arm: Path, more: str, given: list[str], message: str, line: int
) -> None:
    arm.write_text(ARM + more + "\n")
    with pytest.raises(InputError) as refused:
        load_job(arm, given)
    first = next(problem for problem in refused.value.problems if problem.message == message)
    assert first.place is not None
    assert first.place.line == line


BARE = [  # what a list is asked for
    "moves.0.velocity",
    "moves.0.deceleration",
    "moves.0.attach.inertia",
    "output.times",
]


@pytest.mark.parametrize("left_out", BARE)
def test_a_list_that_is_left_out_is_asked_for(arm: Path, left_out: str) -> None:
    with pytest.raises(InputError) as refused:
        load_job(arm, [f"{left_out}.0=3"])
    (problem,) = refused.value.problems
    assert problem.message == f"--set {left_out}.0=3: the job has no {left_out}, and nothing takes its place"
    assert problem.hint == f"write the whole of it: {left_out}=[...]"


@pytest.mark.parametrize("rate", ["velocity", "acceleration"])
def test_other_joints_at_a_point_between_are_not_stopped(path: Path, rate: str) -> None:
    """What such a point leaves out is free, not zero; a joint is named, or all of them are given."""
    path.write_text(
        JOB.replace("{planner: quintic, ", "{planner: waypoints, through: [{joints: [5, 9]}], ").replace(
            ", duration: 2", ""
        )
    )
    with pytest.raises(InputError) as refused:
        load_job(path, [f"moves.0.through.0.{rate}.0=3"])
    (problem,) = refused.value.problems
    assert problem.hint == f"write the whole of it: moves.0.through.0.{rate}=[...]"
    (point,) = load_job(path, [f"moves.0.through.0.{rate}.j1=3"]).job.moves[0].through
    assert getattr(point, rate).named == (True, False)
    (point,) = load_job(path, [f"moves.0.through.0.{rate}=[3, 0]"]).job.moves[0].through
    assert getattr(point, rate) == pytest.approx(np.radians([3, 0]))


def test_a_number_of_the_tool_is_no_list(arm: Path) -> None:
    with pytest.raises(InputError) as refused:
        load_job(arm, ["limits.tcp.acceleration.0=3"])
    assert refused.value.problems[0].message == "expected a number (mm/s^2), got a mapping"


def test_the_arm_of_a_rail_that_an_option_names_is_placed_there(arm: Path) -> None:
    arm.write_text(ARM.replace("robot: ur5e", "robot: {rail: {axis: x}, arm: ur5e}"))
    with pytest.raises(InputError) as refused:
        load_job(arm, ["robot.arm=ur55"])
    assert str(refused.value.problems[0].place) == "--set robot.arm=ur55:1:1"


def test_an_index_of_any_length_is_none_of_the_list(path: Path) -> None:
    with pytest.raises(InputError, match="in a list of 1 entry"):
        load_job(path, [f"moves.{'1' * 5000}.duration=3"])
