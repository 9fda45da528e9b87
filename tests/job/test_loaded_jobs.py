"""A job that was read: its units, frames, names of moves and files, and what does not fit its robot."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.job.read import LoadedJob, files_of, job_from_text, load_job
from trajcli.job.robot import load_robot
from trajcli.job.yaml.load import parse_document
from trajcli.kinematics.forward import forward
from trajcli.units import Units

MODELS = Path(__file__).parents[1] / "urdf" / "models"
HEAD = "version: 1\nunits: {angle: deg, length: mm}\n"
HOLD = "{planner: hold, duration: 1}"


def job(moves: str = HOLD, more: str = "", robot: str = "ur5e", start: str = "{joints: 0}") -> LoadedJob:
    return job_from_text(
        f"{HEAD}robot: {robot}\nstart: {start}\n{more}\nmoves: [{moves}]\n", "cell/pick.yaml"
    )


@pytest.mark.parametrize(
    ("output", "units"),
    [
        ("{}", ("deg", "mm")),
        ("{units: {angle: rad}}", ("rad", "mm")),
        ("{units: {length: m}}", ("deg", "m")),
        ("{units: {angle: rad, length: m}}", ("rad", "m")),
    ],
)
def test_rows_are_in_the_units_of_the_output_else_of_the_job(output: str, units: tuple[str, str]) -> None:
    loaded = job(more=f"output: {output}")
    assert loaded.output_units == Units(*units)
    assert loaded.units == Units("deg", "mm")


def test_options_take_the_place_of_what_the_file_says(tmp_path: Path) -> None:
    path = tmp_path / "job.yaml"
    path.write_text(
        f"{HEAD}robot: ur5e\nstart: {{joints: 0}}\nmoves: [{HOLD}]\noutput: {{rate: 100}}\n", encoding="utf-8"
    )
    assert load_job(path).job.output.rate == 100
    assert load_job(path, si=True).output_units == Units("rad", "m")
    assert load_job(path, rows="both").job.output.rows == "both"
    found = load_job(path, ["moves.0.duration=3", "output.rate=50"], rate="200", rows="knots", si=True)
    assert (found.job.output.rate, found.job.output.rows) == (200, "knots")
    assert (found.job.moves[0].duration, found.output_units) == (3, Units("rad", "m"))
    assert load_job(path, rate="200").job.output.rate == 200


RAIL = "{rail: {axis: y, position: [0, 2000]}, arm: ur5e}"
STAND = "base: {xyz: [100, 0, 200], rotvec: [0, 0, 90]}\ngravity: [0, 1, -9]\n"
T_STAND = np.eye(4)
T_STAND[:3, :3] = Rotation.from_rotvec([0, 0, np.pi / 2]).as_matrix()
T_STAND[:3, 3] = (0.1, 0, 0.2)


@pytest.mark.parametrize(("robot", "count"), [("ur5e", 6), (RAIL, 7)])
def test_base_is_where_the_arm_stands_and_its_frame_is_one_of_poses_and_rows(robot: str, count: int) -> None:
    points = "points: {there: {in: base, xyz: [10, 20, 30]}}\nframes: {table: {xyz: [5, 0, 0], rotvec: [90, 0, 0]}}\n"
    q = np.linspace(0.1, 0.9, count)
    plain = job(robot=robot)
    table = np.eye(4)
    table[:3, :3], table[0, 3] = Rotation.from_rotvec([np.pi / 2, 0, 0]).as_matrix(), 0.005
    for frame, pose in (("world", np.eye(4)), ("base", T_STAND), ("table", table)):
        loaded = job(more=f"{STAND}{points}output: {{in: {frame}}}", robot=robot)
        np.testing.assert_allclose(loaded.robot.stand, T_STAND, atol=1e-15)
        there = T_STAND @ np.linalg.inv(plain.robot.stand) @ forward(plain.robot, q)
        np.testing.assert_allclose(forward(loaded.robot, q), there, atol=1e-14)
        np.testing.assert_allclose(forward(loaded.robot_of_rows, q), np.linalg.inv(pose) @ there, atol=1e-14)
        np.testing.assert_allclose(loaded.robot.gravity, [0, 1, -9])
        np.testing.assert_allclose(
            loaded.job.points["there"].xyz, (T_STAND @ [0.01, 0.02, 0.03, 1])[:3], atol=1e-15
        )


def test_the_tool_of_a_job_weighs_what_it_says() -> None:
    tools = "tools: {torch: {xyz: [0, 0, 50], mass: 2}}\ntool: torch\n"
    robot = job(more=tools).robot
    assert robot.tool_load is not None
    assert (robot.tool_name, robot.tool_load.mass, robot.tool[2, 3]) == ("torch", 2.0, 0.05)


def test_the_flange_of_an_arm_is_told_where_its_own_tool_is_replaced() -> None:
    """The pose of the message, in front of the tool of the job, leads from the last row of the table again."""
    for name in ("irb120", "panda", "gp7", "ur5e"):
        own = load_robot(name).tool
        events = {event.kind: event for event in job(more="tool: {xyz: [0, 0, 10]}\n", robot=name).events}
        if np.array_equal(own, np.eye(4)):
            assert name == "ur5e"
            assert "own_tool_replaced" not in events
            continue
        amounts = events["own_tool_replaced"].amounts
        pose = np.eye(4)
        pose[:3, :3] = Rotation.from_rotvec(amounts["rotvec"].value).as_matrix()
        pose[:3, 3] = amounts["xyz"].value
        np.testing.assert_allclose(pose, own, atol=1e-12)
        assert not [e for e in job(robot=name).events if e.kind == "own_tool_replaced"]
        rail = job(more="tool: {xyz: [0, 0, 10]}\n", robot=f"{{rail: {{axis: y}}, arm: {name}}}")
        assert not [e for e in rail.events if e.kind == "own_tool_replaced"]


POINTS = """points:
  a: {xyz: [400, 0, 300], rpy: [180, 0, 0]}
  b: {xyz: [400, 0, 300], rpy: [180, 0, 90]}
  c: {joints: 0}
  d: {xyz: [300, 0, 300], rpy: [180, 0, 0]}
"""


def test_moves_are_called_by_the_points_between_which_they_go() -> None:
    moves = """
  {planner: jerk_limited, to: a}, {signal: grip, value: 1},
  {planner: hold, duration: 1, limits: {jerk: 9}, when_over_limit: slow}, {planner: line, to: b},
  {planner: spline, through: [a, d]}, {planner: path, radius: 5, segments: [{line: a}, {line: d}]},
  {planner: line, to: {xyz: [400, 0, 300], rpy: [180, 0, 10]}}, {planner: jerk_limited, to: c, label: home},
  {planner: arc, via: a, to: b}, {planner: spline, through: [a], to: d}"""
    loaded = job(moves, POINTS, start="c")
    ends = ["c -> a", "", "", "a -> b", "b -> d", "d -> d", "", "-> c", "c -> b", "b -> d"]
    assert [loaded.ends(index) for index in range(10)] == ends
    assert loaded.move_count == 9
    assert loaded.called(3) == "move 3, a -> b (line)"
    assert loaded.start_meant()[0] == "the start, point 'c'"
    assert job().start_meant()[0] == "the start"


def test_a_point_is_meant_where_all_of_it_is_what_the_value_names() -> None:
    moves = "{planner: spline, through: [a, {xyz: [0, 1, 2]}, b], to: d}"
    loaded = job(moves, POINTS)
    for name in ("a", "b"):
        assert loaded.point_meant(loaded.job.points[name], ("moves", 0, "through")) == name
        assert loaded.point_meant(loaded.job.points[name], ("moves", 0, "to")) is None
    assert loaded.point_meant(loaded.job.moves[0].to, ("moves", 0)) == "d"


def test_a_job_is_made_of_its_robots_its_limits_and_its_recordings() -> None:
    for robot, named in (
        ("{file: a.yaml}", ["a.yaml"]),
        ("{urdf: a.urdf}", ["a.urdf"]),
        ("{rail: {axis: x}, arm: {file: b.yaml}}", ["b.yaml"]),
        ("{rail: {axis: x}, arm: {rail: {axis: y}, arm: {urdf: ../b.urdf}}}", ["../b.urdf"]),
        ("ur5e", []),
    ):
        text = f"robot: {robot}\nlimits: {{file: l.yaml}}\nmoves: [{{planner: path, segments: {{csv: s.csv}}}}]\n"
        found = list(files_of(parse_document(text, "cell/job.yaml")))
        wanted = [("the robot's file", name) for name in named]
        wanted += [("the file of limits", "l.yaml"), ("the recording", "s.csv")]
        assert found == [
            ("the job", "cell/job.yaml"),
            *((what, str(Path("cell") / name)) for what, name in wanted),
        ]
    for name in ("-", "<stdin>"):
        assert list(files_of(parse_document("robot: ur5e\n", name))) == [("the job", "-")]


@pytest.mark.parametrize(
    "moves",
    [
        "{planner: line, to: a}, {planner: line, to: d, retreat: 10}",
        "{planner: line, to: a, approach: 10}",
        "{repeat: 2, moves: [{planner: line, to: a}]}",
        "{call: one}",
    ],
)
def test_what_stands_for_other_moves_is_written_out(moves: str) -> None:
    loaded = job(moves, f"{POINTS}sequences: {{one: [{{planner: line, to: a}}, {{planner: line, to: d}}]}}")
    assert len(loaded.job.moves) >= 2
    assert all(move.tag == "line" for move in loaded.job.moves)
    again = job(moves, POINTS) if "call" not in moves else loaded
    assert len(again.job.moves) == len(loaded.job.moves)


def test_defaults_alone_and_points_that_are_many_alone_are_written_out() -> None:
    loaded = job("{planner: line, to: a}", f"{POINTS}defaults: {{law: {{shape: quintic, duration: 7}}}}")
    assert loaded.job.moves[0].law.duration == 7
    for many in ("[a, b]", "{grid: {from: a, steps: [{count: 2, xyz: [1, 0, 0]}]}}"):
        with pytest.raises(InputError, match="many"):
            job("{planner: line, to: many}", f"{POINTS}  many: {many}\n")


MOVEIT = "joint_limits: {j1: {has_velocity_limits: true, max_velocity: 0.5, has_effort_limits: true}}\n"


def test_limits_of_a_file_count_and_what_is_noted_comes_first(tmp_path: Path) -> None:
    (tmp_path / "l.yaml").write_text(MOVEIT, encoding="utf-8")
    text = f"{HEAD}robot: {{urdf: {MODELS / 'ur5.urdf'}}}\nstart: {{joints: 0}}\nlimits: {{file: l.yaml}}\nmoves: [{HOLD}]\n"
    (tmp_path / "job.yaml").write_text(text, encoding="utf-8")
    names = load_robot(MODELS / "ur5.urdf").joint_names
    (tmp_path / "l.yaml").write_text(MOVEIT.replace("j1", names[0]).replace("0.5", "50"), encoding="utf-8")
    loaded = load_job(tmp_path / "job.yaml")
    np.testing.assert_allclose(loaded.robot.limits.velocity[0], [-50, 50])
    kinds = [event.kind for event in loaded.events]
    snapped, looser = kinds.index("angles_snapped"), kinds.index("looser_limit")
    assert (
        0 < snapped < looser
    )  # first what the file of limits says, then the robot, then what the job loosens


@pytest.mark.parametrize(
    ("limits", "said", "column"),
    [
        ("{velocity: {j2: 100}}", "velocity", "100"),
        ("{velocity: [10, 100]}", "velocity", "100"),
        ("{velocity: 100}", "velocity", "100"),
        ("{tcp: {speed: 300}}", "the speed of the tool is 250 mm/s, got 300 mm/s", "300"),
    ],
)
def test_a_move_that_loosens_a_limit_is_refused_at_the_number(limits: str, said: str, column: str) -> None:
    robot = "{convention: standard, joints: [{a: 100, velocity: 100}, {a: 100, velocity: 50}]}"
    move = f"{HOLD}, {{planner: hold, duration: 1, limits: {limits}}}"
    with pytest.raises(InputError) as caught:
        job(move, "limits: {tcp: {speed: 250}}", robot)
    (problem,) = caught.value.problems
    assert said in problem.text()
    assert problem.move == 1
    assert problem.place is not None
    assert problem.place.source[problem.place.column - 1 :].startswith(column)


@pytest.mark.parametrize("group", ["pose", "twist", "twistd"])
def test_columns_of_the_tool_need_geometry(group: str) -> None:
    with pytest.raises(InputError, match=f"columns '{group}' need a robot with geometry"):
        job(more=f"output: {{columns: [t, q, {group}]}}", robot="{joints: 2}")
    job(more="output: {columns: [t, q, path]}", robot="{joints: 2}")


def test_flaws_come_in_the_order_of_the_file() -> None:
    text = f"{HEAD}moves: [{{planner: hold, duration: -1}}]\nstart: {{joints: z}}\nrobot: {{joints: [{{velocity: -3}}]}}\n"
    with pytest.raises(InputError) as caught:
        job_from_text(text)
    assert [problem.place.line for problem in caught.value.problems if problem.place] == [3, 4, 5]
    with pytest.raises(InputError, match="above 0"):
        job("{planner: hold, duration: -1}")
    effort = "{convention: standard, joints: [{a: 100, effort: 5}]}"
    with pytest.raises(InputError) as caught:
        job(more="limits: {effort: robot}\noutput: {columns: [t, tau]}", robot=effort)
    assert caught.value.problems
