"""Completion in the shell: what the script of `--install-completion` asks for, and what it gets.

Oracle: the files of the catalogue.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from running import call, warm

from trajcli.catalogue.entries import catalogue_names


def completed(*words: str) -> list[str]:
    """Return what bash is offered for the last word."""
    asked = {
        "_TRAJCLI_COMPLETE": "complete_bash",
        "COMP_WORDS": " ".join(words),
        "COMP_CWORD": str(len(words) - 1),
    }
    done = subprocess.run(warm(), env=os.environ | asked, capture_output=True, text=True, check=True)
    assert done.stderr == ""
    return done.stdout.split()


@pytest.mark.parametrize(
    "words",
    [
        ("robots",),
        ("fk", "--robot"),
        ("ik", "-r"),
        ("jacobian", "--robot"),
        ("mobility", "--robot"),
    ],
    ids=" ".join,
)
def test_names_of_robots_complete(words: tuple[str, ...]) -> None:
    beginning = {name for name in catalogue_names() if name.startswith("ur")}
    assert len(beginning) > 5
    assert set(completed("trajcli", *words, "ur")) == beginning


def test_one_name_or_none_completes() -> None:
    assert completed("trajcli", "robots", "kr16") == ["kr16_2"]
    assert completed("trajcli", "fk", "--robot", "no_such") == []


def test_commands_complete() -> None:
    assert completed("trajcli", "rob") == ["robots"]


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("plan JOB --set moves.8.du", {"moves.8.duration="}),
        ("plan JOB --set limits.v", {"limits.velocity="}),
        ("plan JOB --set output.ra", {"output.rate="}),
        ("plan nothing.yaml --set units.an", {"units.angle="}),
        ("plan --set moves.0.du", set()),
        ("sweep JOB --vary points.above_pi", {"points.above_pick.joints="}),
        ("plot JOB --joints shoulder_pan_joint,shoulder", {"shoulder_pan_joint,shoulder_lift_joint"}),
        ("plot nothing.yaml --joints sh", set()),
        ("plot JOB --quantities q,qdd", {"q,qdd", "q,qddd"}),
    ],
)
def test_paths_joints_and_quantities_complete(words: str, offered: set[str]) -> None:
    job = Path(__file__).parents[2] / "examples/ur5e_pick.yaml"
    assert set(completed("trajcli", *words.replace("JOB", str(job)).split())) == offered


def test_every_path_that_completes_is_one_of_the_job(capfd: pytest.CaptureFixture[str]) -> None:
    """Oracle: `--set` itself, which refuses names that a job has not."""
    job = Path(__file__).parents[2] / "examples/ur5e_pick.yaml"
    for path in completed("trajcli", "plan", str(job), "--set", "limits."):
        err = call(capfd, "plan", job, "--no-output", "--set", f"{path}x").err
        assert "unknown key" not in err
        assert "did you mean" not in err


def test_completion_is_installed(tmp_path: Path) -> None:
    command = [*warm(), "--install-completion", "bash"]
    # a test has no shell around it that typer could find by itself
    asked = {"HOME": str(tmp_path), "_TYPER_COMPLETE_TEST_DISABLE_SHELL_DETECTION": "1"}
    done = subprocess.run(command, env=os.environ | asked, capture_output=True, text=True, check=True)
    assert "completion installed" in done.stdout
    assert "_TRAJCLI_COMPLETE=complete_bash" in (tmp_path / ".bash_completions/trajcli.sh").read_text("utf-8")


def test_completion_reads_no_robot() -> None:
    code = (
        "import sys; from trajcli.cli.options import robot_names; names = robot_names('ur5');"
        "print(*names, 'pydantic' in sys.modules and 'trajcli.job.robot' in sys.modules)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["ur5", "ur5e", "False"]
