"""Words that the shell is offered, from the files that a command line names: paths, joints and quantities."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from typer.main import get_command

from trajcli.cli.app import app
from trajcli.cli.completion import joints_that_begin, paths_that_begin, quantities_that_begin
from trajcli.cli.options import profile_words, quantity_names, robot_names
from trajcli.consumers.profile import profile_names
from trajcli.job.schema import schema_of

JOB = """
version: 1
robot: {joints: [{name: turn}, {name: tilt}, {name: lift}]}
points: {home: {joints: [0, 0, 0]}, far: {joints: [1, 0, 0]}}
start: home
limits: {position: [[-1, 1], 2, 3]}
moves:
  - {planner: quintic, to: far, duration: 2}
  - {planner: hold, duration: 1}
output: {times: [0, 1, 3]}
"""


SCHEMA = cache(schema_of)


class Nobody:
    """Standard input while a word is completed: nobody types a file there."""

    def __getattr__(self, name: str) -> Any:
        pytest.fail(f"standard input is read: {name}")


def line(*args: str, **params: Any) -> Any:
    """Return what typer has understood of a command line."""
    return SimpleNamespace(params=params, args=list(args))


@pytest.fixture
def job(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setattr("sys.stdin", Nobody())
    monkeypatch.setattr("trajcli.job.schema.schema_of", SCHEMA)  # it takes its time, and is always the same
    (tmp_path / "rows.csv").write_text("t,q1\n0,0\n")
    (tmp_path / "points.yaml").write_text("[1, 2]\n")
    (tmp_path / "job.yaml").write_text(JOB)
    monkeypatch.chdir(tmp_path)
    return "job.yaml"


OTHERS = ("-", "nothing.yaml", "rows.csv", "points.yaml")


@pytest.mark.parametrize("key", ["job", "sources", "files", None])
def test_the_job_is_found_wherever_the_command_line_names_it(job: str, key: str | None) -> None:
    several = key in ("sources", "files")
    words = line(*OTHERS, job) if key is None else line(**{key: [*OTHERS, job] if several else job})
    assert joints_that_begin(words, "t") == ["turn", "tilt"]
    assert paths_that_begin(words, "moves.1.du") == ["moves.1.duration="]


@pytest.mark.parametrize("name", OTHERS)
def test_without_a_job_no_joint_is_offered_and_what_every_job_may_have(job: str, name: str) -> None:
    assert job
    words = line(job=name)
    assert joints_that_begin(words, "") == []
    assert paths_that_begin(words, "moves") == []
    assert paths_that_begin(words, "units.l") == ["units.length="]


def test_a_job_whose_robot_is_wrong_offers_its_paths(job: str) -> None:
    Path(job).write_text(JOB.replace("lift}", "turn}"))
    assert joints_that_begin(line(job), "") == []
    assert paths_that_begin(line(job), "points.h") == ["points.home.joints="]


def test_paths_are_those_that_are_stated_and_those_that_the_planner_knows(job: str) -> None:
    paths = paths_that_begin(line(job), "")
    assert paths == sorted(set(paths))
    assert {
        "version=",
        "robot.joints.0.name=",
        "robot.joints.2.name=",
        "limits.position.0=",
        "limits.position.1=",
        "output.times=",
        "moves.0.to=",
        "zone=",
        "output.rate=",
    } <= set(paths)
    assert not {
        "robot=",
        "moves=",
        "output=",
        "limits.position.0.0=",
        "output.times.0=",
        "points.home=",
    } & set(paths)
    assert {
        "limits.tcp.speed=",
        "limits.scale.velocity=",
        "units.angle=",
        "when_over_limit=",
        "defaults.law.shape=",
    } <= set(paths)
    of_move = {
        "moves.1.label=",
        "moves.0.limits.velocity=",
        "moves.0.when_over_limit=",
        "moves.0.limits.tcp.speed=",
    }
    assert of_move <= set(paths)
    assert not [path for path in paths if path.startswith("moves.1.") and "law" in path]


def test_moves_that_are_none_offer_nothing(job: str) -> None:
    Path(job).write_text(JOB.replace("  - {planner: hold, duration: 1}", "  - home\n  - {planner: hopp}"))
    assert paths_that_begin(line(job), "moves.0.du") == ["moves.0.duration="]
    assert paths_that_begin(line(job), "moves.1") == ["moves.1="]
    assert paths_that_begin(line(job), "moves.2") == ["moves.2.planner="]


def test_names_behind_commas_are_not_offered_twice(job: str) -> None:
    assert joints_that_begin(line(job), "tilt,t") == ["tilt,turn"]
    assert joints_that_begin(line(job), "lift,tilt,") == ["lift,tilt,turn"]
    assert joints_that_begin(line(job), "urn") == []
    assert quantities_that_begin("q,q") == ["q,qd", "q,qdd", "q,qddd"]
    assert quantity_names("pa") == ["path"]


def test_names_of_robots_and_consumers_are_those_that_begin_so() -> None:
    assert profile_words("ur") == ["ur-passthrough", "ur-servoj"]
    assert profile_words("jtc") == []
    assert profile_words("") == sorted(profile_names())
    assert robot_names("r5e") == []
    assert robot_names("ur5") == ["ur5", "ur5e"]


@pytest.mark.parametrize(
    ("command", "field", "begun", "offered"),
    [
        ("profiles", "name", "ur", ["ur-passthrough", "ur-servoj"]),
        *((name, "consumer", "ros", ["ros-jtc"]) for name in ("plan", "batch")),
        ("check", "profile", "ros", ["ros-jtc"]),
        *((name, "robot", "ur5", ["ur5", "ur5e"]) for name in ("check", "retime", "convert", "fk", "ik")),
        ("plot", "quantities", "pa", ["path"]),
        ("plot", "joints", "ti", ["tilt"]),
        *((name, "override", "moves.1.du", ["moves.1.duration="]) for name in ("plan", "check", "view")),
        ("sweep", "vary", "moves.1.du", ["moves.1.duration="]),
    ],
)
def test_each_option_offers_its_words(
    command: str, field: str, begun: str, offered: list[str], job: str
) -> None:
    one = get_command(app).commands[command]  # type: ignore[attr-defined]
    (param,) = (param for param in one.params if param.name == field)
    found = param.shell_complete(line(job), begun)
    assert [getattr(item, "value", item) for item in found] == offered
