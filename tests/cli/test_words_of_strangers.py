"""Command lines that people type first: each is answered with the one that does what they mean."""

from __future__ import annotations

from pathlib import Path

import pytest
from running import EXAMPLES, call

Capture = pytest.CaptureFixture[str]
ROBOT_JOB = str(EXAMPLES / "cubic.yaml")
ROWS = "t,q1\n0.000000,0.000000\n1.000000,0.100000\n"


@pytest.mark.parametrize("command", ["fk", "ik", "jacobian", "dynamics"])
@pytest.mark.parametrize("robot", ["ur5e", "arm.urdf", "cell.yaml"])
def test_a_robot_as_argument_is_an_option(command: str, robot: str, capfd: Capture) -> None:
    code, _, err = call(capfd, command, robot, 0, -90, 90, 0, 90, 0)
    assert code == 2
    assert f"The robot is an option: trajcli {command} --robot {robot} ..." in err


def test_only_a_robot_is_taken_for_one(capfd: Capture) -> None:
    assert "The robot is an option" not in call(capfd, "fk", "rows.csv").err
    assert "The robot is an option" not in call(capfd, "fk", "--robot", "two_link", "ur5e").err


@pytest.mark.parametrize(
    "words",
    [("check",), ("retime",), ("resample", "--rate", 10), ("convert",), ("reverse",), ("diff", "a.csv")],
)
def test_a_job_in_the_place_of_a_motion_is_planned_first(words: tuple[str, ...], capfd: Capture) -> None:
    code, _, err = (
        call(capfd, *words, ROBOT_JOB) if words[0] != "diff" else call(capfd, "diff", ROBOT_JOB, "a")
    )
    assert code == 2
    assert f"{ROBOT_JOB} is a job, and no motion yet" in err
    assert f"`trajcli plan {ROBOT_JOB} -o rows.csv`" in err


def test_rows_in_the_place_of_a_job_are_checked(tmp_path: Path, capfd: Capture) -> None:
    path = tmp_path / "rows.csv"
    path.write_text(ROWS, encoding="utf-8")
    code, _, err = call(capfd, "plan", path)
    assert code == 2
    assert "rows are judged by `trajcli check`" in err


@pytest.mark.parametrize("command", ["check", "retime"])
def test_a_file_that_is_not_there_is_said_before_more_is_asked_for(command: str, capfd: Capture) -> None:
    assert call(capfd, command, "nowhere.csv").code == 4


@pytest.mark.parametrize(
    ("name", "said"), [("ur", "'ur-passthrough' or 'ur-servoj'"), ("rosjtc", "'ros-jtc'")]
)
def test_the_beginning_of_a_profile_is_completed(name: str, said: str, capfd: Capture) -> None:
    code, _, err = call(capfd, "profiles", name)
    assert code == 2
    assert f"did you mean {said}?" in err


@pytest.mark.parametrize("option", ["--limits", "--velocity"])
def test_limits_of_a_job_are_set_in_it(option: str, capfd: Capture) -> None:
    code, _, err = call(capfd, "plan", ROBOT_JOB, option, "5")
    assert code == 2
    assert "--set limits.velocity=NUMBER changes one, in the units of the job" in " ".join(err.split())
    assert call(capfd, "plan", ROBOT_JOB, "--set", "limits.velocity=60").code == 0
    code, _, err = call(capfd, "plan", ROBOT_JOB, "--set", "limits.velocity=5")
    assert code == 1
    assert "velocity" in err
    assert "--set" not in call(capfd, "fk", option, "5").err


def test_limits_stand_in_a_file_or_between_braces(tmp_path: Path, capfd: Capture) -> None:
    path = tmp_path / "rows.csv"
    path.write_text(ROWS, encoding="utf-8")
    words = ("check", path, "--robot", ROBOT_JOB, "--units", "rad")
    code, _, err = call(capfd, *words, "--limits", "5")
    assert code == 2
    assert "--limits expects a file, got 5" in err
    assert "--limits '{velocity: 5}'" in err
    assert call(capfd, *words, "--limits", "{velocity: 5}").code == 0
    assert call(capfd, *words, "--limits", "{velocity: 0.05}").code == 1  # the rows go at 0.1 rad/s
