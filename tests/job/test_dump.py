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
from tiers import few

from trajcli.errors import InputError
from trajcli.job.dump import dump_job, mapping_text
from trajcli.job.read import LoadedJob, job_from_text, load_job
from trajcli.planners.planner import Planner
from trajcli.planning.plan import plan_job

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.yaml"))
PLANNED = few([path for path in EXAMPLES if "zone: " not in path.read_text()], 8)  # corners take seconds each


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


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(jobs())
def test_load_dump_load_is_identity(plain: dict[str, Any]) -> None:
    first = job_from_text(json.dumps(plain, ensure_ascii=False))
    text = dump_job(first)
    second = job_from_text(text)
    assert_same(first, second)
    assert dump_job(second) == text


@pytest.mark.parametrize("example", few(EXAMPLES, 12), ids=lambda path: path.stem)
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
