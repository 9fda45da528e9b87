"""What others run in their CI: the hook of pre-commit and the steps of the GitHub Action, run as they stand."""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest
from yaml_files import read_yaml

from docs.warm import warm_commands

ROOT = Path(__file__).parents[1]
INPUT = re.compile(r"\$\{\{ inputs\.([\w-]+) \}\}")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A repository with two jobs of this one."""
    monkeypatch.chdir(tmp_path)
    Path("jobs/deep").mkdir(parents=True)
    shutil.copy(ROOT / "examples/quintic.yaml", "jobs")
    shutil.copy(ROOT / "examples/stop.yaml", "jobs/deep")
    return tmp_path


def break_one() -> None:
    job = Path("jobs/quintic.yaml")
    job.write_text(job.read_text().replace("moves:", "limits: {velocity: 1e-3}\nmoves:"))


def commands() -> str:
    """Return the folder of the program that is tried: `make release-check` names that of the built wheel."""
    return os.environ.get("TRAJCLI_COMMANDS") or str(warm_commands())


def run(command: list[str], **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        command,
        capture_output=True,
        text=True,
        env={**os.environ, "PATH": f"{commands()}:{os.environ['PATH']}", **environment},
        timeout=60,
        check=False,
    )


def hook() -> dict[str, Any]:
    (entry,) = read_yaml(ROOT / ".pre-commit-hooks.yaml")
    return dict(entry)


def test_the_hook_takes_the_jobs_of_a_commit(folder: Path) -> None:
    words = shlex.split(hook()["entry"])
    good = run([*words, "jobs/quintic.yaml", "jobs/deep/stop.yaml"])
    assert (good.returncode, good.stdout) == (0, "")
    break_one()
    bad = run([*words, "jobs/quintic.yaml", "jobs/deep/stop.yaml"])
    assert (bad.returncode, bad.stdout) == (1, "")
    assert "jobs/quintic.yaml:" in bad.stderr
    assert "stop: verified" in bad.stderr
    assert {path.suffix for path in folder.rglob("*") if path.is_file()} == {".yaml"}


@pytest.mark.parametrize(
    ("name", "taken"),
    [
        ("jobs/a.yaml", True),
        ("cell/jobs/deep/a.yml", True),
        ("cell/pick.job.yaml", True),
        ("docker-compose.yaml", False),
        ("myjobs/a.yaml", False),
        ("jobs/a.csv", False),
    ],
)
def test_the_hook_takes_no_other_yaml(name: str, taken: bool) -> None:
    assert bool(re.search(hook()["files"], name)) == taken


def action() -> dict[str, Any]:
    return dict(read_yaml(ROOT / "action.yml"))


def step(name: str, **inputs: str) -> subprocess.CompletedProcess[str]:
    """Run a step as GitHub's runner does, with the defaults of the inputs that are not given."""
    values = {key: spec.get("default", "") for key, spec in action()["inputs"].items()} | inputs
    (found,) = [each for each in action()["runs"]["steps"] if each.get("name") == name]
    environment = {key: INPUT.sub(lambda m: values[m[1]], text) for key, text in found["env"].items()}
    assert "${{" not in found["run"], "what a user says is no text of a script"
    return run(["bash", "--noprofile", "--norc", "-eo", "pipefail", "-c", found["run"]], **environment)


def test_every_input_of_the_action_is_used_and_described() -> None:
    text = (ROOT / "action.yml").read_text()
    assert set(INPUT.findall(text)) == set(action()["inputs"])
    assert all(spec["description"] for spec in action()["inputs"].values())
    page = (ROOT / "docs/ci.md").read_text()
    assert all(f"`{name}`" in page for name in action()["inputs"])


@pytest.mark.usefixtures("folder")
def test_the_action_judges_all_jobs() -> None:
    good = step("Plan and verify")
    warned = [line.partition("::the rows")[0] for line in good.stderr.splitlines()]
    assert good.returncode == 0
    assert warned == ["::warning file=jobs/deep/stop.yaml,title=trajcli%3A joined_over_limit"]
    break_one()
    bad = step("Plan and verify")
    assert bad.returncode == 1
    assert "\n::error file=jobs/quintic.yaml,line=" in bad.stderr
    assert step("Plan and verify", jobs="jobs/deep/*.yaml").returncode == 0
    assert step("Plan and verify", jobs="jobs/deep/*.yaml jobs/q*").returncode == 1
    nothing = step("Plan and verify", jobs="none/*.yaml")
    assert (nothing.returncode, nothing.stdout) == (2, "::error title=trajcli::no file matches none/*.yaml\n")


@pytest.mark.usefixtures("folder")
def test_the_action_passes_options_on() -> None:
    shutil.copy(ROOT / "examples/slow.yaml", "jobs")
    assert step("Plan and verify").returncode == 0
    strict = step("Plan and verify", options="--strict")
    assert strict.returncode == 1
    assert "title=trajcli%3A slowed" in strict.stderr


@pytest.mark.usefixtures("folder")
def test_the_action_compares_with_golden_files() -> None:
    Path("golden").mkdir()
    for name in ("quintic", "stop"):
        shutil.copy(ROOT / f"tests/golden/{name}.csv", "golden")
    name = "Compare with golden files"
    assert step(name, golden="golden").returncode == 0
    golden = Path("golden/stop.csv")
    golden.write_text(golden.read_text().replace("0.010000000,", "0.010000001,"))
    differs = step(name, golden="golden")
    assert differs.returncode == 1
    assert "::error file=golden/stop.csv,title=trajcli::the rows of the job differ" in differs.stdout
    assert step(name, golden="golden", tolerances="--atol 1e-6").returncode == 0
    Path("golden/other.csv").write_text("t,q1\n0,0\n1,1\n")
    assert step(name, golden="golden", tolerances="--atol 1e-6").returncode == 1
