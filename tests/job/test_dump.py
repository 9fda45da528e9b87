"""A job that is written as it was understood reads as the same job, bit by bit."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from planned_examples import planned_example
from random_mappings import jobs
from tiers import QUICK, few

from trajcli.errors import InputError
from trajcli.job.dump import dump_job, dump_robot, mapping_text
from trajcli.job.read import LoadedJob, job_from_text, load_job
from trajcli.job.robot import read_sheet
from trajcli.planners.planner import Planner
from trajcli.planning.plan import plan_job

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.yaml"))
QUICK_ONES = [path for path in EXAMPLES if "zone: " not in path.read_text()]  # corners take seconds each
PLANNED = {*few(QUICK_ONES, 8)} - {path for path in EXAMPLES if QUICK and path.stem == "time_optimal_jerk"}


def fields_of(move: Planner) -> tuple[Any, ...]:
    """Return what a move consists of, bit for bit."""
    tool = getattr(move, "tool", None)
    parts = () if tool is None else (tool.name, tool.pose.tobytes(), tool.load and tool.load.bits)
    return type(move), *parts, *((name, value) for name, value in move if name != "tool")


def assert_same(a: LoadedJob, b: LoadedJob) -> None:
    """Everything that planning, judging and writing look at is equal."""
    assert (a.name, a.units) == (b.name, b.units)
    for key in ("name", "joints", "convention"):
        assert getattr(a.robot, key) == getattr(b.robot, key)
    for key in ("base", "tool"):
        assert np.array_equal(getattr(a.robot, key), getattr(b.robot, key))
    for order in range(4):
        assert np.array_equal(a.robot.limits.of_order(order), b.robot.limits.of_order(order))
    for key in ("points", "start", "when_over_limit", "output"):
        assert getattr(a.job, key) == getattr(b.job, key), key
    assert list(map(fields_of, a.job.moves)) == list(map(fields_of, b.job.moves))


@pytest.mark.full
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(jobs())
def test_load_dump_load_is_identity(plain: dict[str, Any]) -> None:
    first = job_from_text(json.dumps(plain, ensure_ascii=False))
    text = dump_job(first)
    second = job_from_text(text)
    assert_same(first, second)
    assert dump_job(second) == text


@pytest.mark.parametrize("example", few(EXAMPLES, 4), ids=lambda path: path.stem)
def test_the_resolved_example_gives_the_same_curve(example: Path) -> None:
    first = load_job(example)
    second = job_from_text(dump_job(first))
    assert_same(first, second)
    if example not in PLANNED:
        return
    plans = planned_example(example.stem), plan_job(second)
    curves = [plan.trajectory.curve for plan in plans]
    assert np.array_equal(curves[0].breaks, curves[1].breaks)
    assert np.array_equal(curves[0].coefficients, curves[1].coefficients)


RICH = """
version: 1
units: {angle: deg, length: mm}
robot:
  name: two
  convention: modified
  joints:
    - {a: 10, beta: 0, position: [-90, 90], velocity: 90, effort: 3,
       link: {mass: 2, com: [1, 2, 3], inertia: [1, 1, 1, 0, 0, 0]}}
    - {a: 400, beta: 0.01, type: prismatic, position: [-1000, 2000], velocity: [-100, 200], sign: -1,
       velocity_by_position: {deceleration: 300, offset: 20}, acceleration: 70,
       link: {mass: 1, com: [0, 0, 0], inertia: [1, 1, 1, 0, 0, 0]}}
  tool: {xyz: [1, 2, 3]}
base: {xyz: [10, 20, 30], rpy: [1, 2, 3]}
frames: {f: {xyz: [4, 5, 6], rpy: [7, 8, 9]}, unused: {}}
tools: {grip: {xyz: [0, 0, 50], mass: 2}, light: {xyz: [0, 0, 7]}}
gravity: [0, 9.81, 0]
limits: {effort: robot, tcp: {speed: 500}}
zone: {joints: [1, 2]}
start: {joints: [0, 0]}
when_over_limit: slow
moves:
  - {planner: quintic, to: {joints: [10, 10]}, label: there}
  - attach: {mass: 1, com: [0, 0, 10]}
  - detach: {}
  - tool: grip
  - {planner: quintic, to: {joints: [0, 0]}, zone: stop}
output: {in: f, times: [0, 0.1]}
"""


@pytest.mark.parametrize(
    "more", ["", "tool: grip", "tool: light", "tool: {mass: 3, xyz: [1, 0, 0]}", "tool: {xyz: [1, 0, 0]}"]
)
def test_what_a_job_says_beside_its_moves_is_kept(more: str) -> None:
    for text in (f"{RICH}{more}\n", f"{RICH}{more}\n".replace("effort: robot", "effort: {j2: 5}")):
        first = job_from_text(text)
        second = job_from_text(dump_job(first))
        assert_same(first, second)
        for key in ("gravity", "zone"):
            assert getattr(first.job, key) == getattr(second.job, key)
        for key in ("velocity_by_position", "effort"):
            assert np.array_equal(getattr(first.robot.limits, key), getattr(second.robot.limits, key))
        assert first.robot.limits.tcp == second.robot.limits.tcp
        assert first.robot.equipment == second.robot.equipment
        assert first.robot.tool_name == second.robot.tool_name
        assert np.array_equal(first.robot_of_rows.base, second.robot_of_rows.base)


def test_the_frame_of_rows_of_a_robot_on_a_rail_is_where_the_rail_stands() -> None:
    text = RICH.replace("\nrobot:\n", "\nrobot:\n rail: {axis: y, name: rail}\n arm:\n").replace(
        "joints: [0, 0]}", "joints: 0}"
    )
    text = text.replace("joints: [10, 10]", "joints: 10").replace("in: f,", "in: base,")
    first = job_from_text(text.replace("zone: {joints: [1, 2]}\n", "").replace("effort: robot, ", ""))
    second = job_from_text(dump_job(first))
    assert np.array_equal(first.robot_of_rows.base, second.robot_of_rows.base)
    assert not np.array_equal(first.robot.base, first.robot_of_rows.base)


def test_a_robot_file_keeps_where_the_robot_is_from(tmp_path: Path) -> None:
    beside = {"source": "a book", "licence": "CC0", "note": "measured"}
    file = tmp_path / "arm.yaml"
    robot: dict[str, Any] = {"name": "arm", "joints": [{"velocity": 3}], **beside}
    file.write_text(json.dumps(robot))
    sheet = read_sheet(str(file))
    other = tmp_path / "other.yaml"
    other.write_text(dump_robot(sheet))
    again = read_sheet(str(other))
    for key, text in beside.items():
        assert getattr(again, key) == getattr(sheet, key) == text


def test_values_of_python_are_written_as_those_of_a_job() -> None:
    text = mapping_text({"a": Path("b") / "c", "d": np.array([1.5, 2]), "e": (np.int64(3), np.inf, -np.inf)})
    assert text == 'a: "b/c"\nd: [1.5, 2.0]\ne: [3, .inf, -.inf]\n'
    assert mapping_text({"n": float("nan")}) == "n: .nan\n"
    with pytest.raises(InputError, match="the job's a: expected texts as keys, got 1"):
        mapping_text({"a": {1: 2}})
    deep: Any = 1
    for _ in range(150):
        deep = [deep]
    with pytest.raises(InputError, match="more than 100 levels deep"):
        mapping_text({"a": deep})


def test_what_a_resolved_job_looks_like() -> None:
    text = dump_job(
        job_from_text(
            """
version: 1
name: a job
units: {angle: deg}
robot: {joints: [{name: turn, velocity: 180}, {name: "null", type: prismatic}]}
limits: {scale: {velocity: 0.5}}
points: {home: {joints: [0, 1]}}
start: home
moves: [{planner: quintic, to: home, duration: 20 ms, limits: {velocity: {turn: [-1 rad/s, 0.5 rad/s]}}}]
"""
        )
    )
    assert (
        text
        == """\
version: 1
name: "a job"
units: {angle: deg, length: m}
robot:
  name: robot
  joints:
    - {name: turn, type: revolute, sign: 1, position: null, velocity: ["-1.5707963267948966 rad/s", \
"1.5707963267948966 rad/s"], acceleration: null, jerk: null}
    - {name: "null", type: prismatic, sign: 1, position: null, velocity: null, acceleration: null, jerk: null}
points:
  home: {joints: ["0.0 rad", "1.0 m"]}
start: {joints: ["0.0 rad", "1.0 m"]}
moves:
  - {planner: quintic, limits: {velocity: {turn: ["-1.0 rad/s", "0.5 rad/s"]}, scale: {velocity: 1.0, \
acceleration: 1.0, jerk: 1.0}}, to: {joints: ["0.0 rad", "1.0 m"]}, duration: 0.02}
when_over_limit: error
output: {rate: 1000.0, start_time: 0.0, align: false, columns: [t, q, qd, qdd]}
"""
    )


@pytest.mark.parametrize(
    "name",
    [
        "true",
        "Null",
        "FALSE",
        "~",
        "1",
        "1e3",
        "-",
        "a: b",
        'q"\\',
        "#",
        "\u00e9\u0301",
        "\U0001f600",
        "0x1",
        " ",
    ],
)
def test_names_survive(name: str) -> None:
    plain = {
        "version": 1,
        "name": name,
        "robot": {"joints": [{"name": name}]},
        "start": {"joints": {name: 1}},
    }
    point = f"p {name}"  # a number is no name of a point
    plain |= {"points": {point: {"joints": 2}}, "moves": [{"planner": "cubic", "to": point, "duration": 1}]}
    first = job_from_text(json.dumps(plain, ensure_ascii=name.isascii() or not name.isprintable()))
    assert_same(first, job_from_text(dump_job(first)))


@pytest.mark.parametrize("number", [10**5000, -(10**5000), 2**1024], ids=["long", "below", "next"])
def test_whole_numbers_beyond_floats_are_refused(number: int) -> None:
    with pytest.raises(
        InputError, match=r"the job's moves\.1\.duration: too large: a number is at most 1\.8e"
    ):
        mapping_text({"moves": [{"duration": 2**1023}, {"duration": number}]})
