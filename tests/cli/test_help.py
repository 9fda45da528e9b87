"""Help that helps: an example for each command, which runs, and commands by their other names."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest
from running import ROOT, call
from tiers import QUICK, few

from trajcli.cli.app import GROUPS, app

Capture = pytest.CaptureFixture[str]
NAMES = [info.callback.__name__ for info in app.registered_commands if info.callback]
OTHER_NAMES = {
    "validate": "plan JOB --no-output",
    "run": "plan",
    "simulate": "plan",
    "transform": "pose",
    "forward": "fk",
    "inverse": "ik",
    "kinematics": "jacobian",
    "list": "robots",
    "Compare": "diff",
}


# the command as it is shown, and moves whose times need no search: the example plans them anew for each mass
SHORTER = {
    "payload": [
        *("--set", "moves.0={planner: hold, duration: 1}"),
        *("--set", "moves.2={planner: quintic, to: place, duration: 4}"),
        *("--set", "moves.4={planner: hold, duration: 1}"),
    ]
}


@pytest.mark.parametrize("name", few([name for name in NAMES if name != "payload"], 7) if QUICK else NAMES)
def test_each_command_has_an_example_that_runs(
    name: str, capfd: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    text = call(capfd, name, "--help").out
    (example,) = re.findall(r"^ *Example: trajcli (.*)$", text, flags=re.MULTILINE)
    monkeypatch.chdir(tmp_path)
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    for file in ("old.csv", "new.csv"):
        (tmp_path / file).write_text("t,q1\n0,0\n1,1\n")
    (tmp_path / "there.csv").write_text("t,q1\n0,0\n1,1\n")
    (tmp_path / "back.csv").write_text("t,q1\n0,1\n1,0\n")
    (tmp_path / "arm.urdf").symlink_to(ROOT / "tests/urdf/models/ur5.urdf")
    words = shlex.split(example) + SHORTER.get(name, [])
    if "rows.csv" in words[1:]:
        call(capfd, "plan", "examples/ur5e_pick.yaml", "-o", "rows.csv")
    assert words[0] == name
    assert call(capfd, *words).code == 0


@pytest.mark.parametrize(("word", "named"), OTHER_NAMES.items())
def test_a_command_that_exists_under_another_name_is_named(word: str, named: str, capfd: Capture) -> None:
    code, out, err = call(capfd, word, "job.yaml")
    assert (code, out) == (2, "")
    assert f"No such command '{word}'" in err
    assert f"trajcli {named}" in err


def test_each_command_stands_in_one_group_of_the_help(capfd: Capture) -> None:
    listed = [word for words in GROUPS.values() for word in words]
    assert sorted(listed) == sorted(NAMES)
    text = call(capfd, "--help").out
    assert [title for title in GROUPS if f"{title}:\n" in text] == list(GROUPS)
    assert "..." not in text.split("\n", 1)[1]  # no line is cut
    assert "Compute the pose of the tool" in text


@pytest.mark.parametrize("name", NAMES)
def test_help_fits_80_columns_and_speaks_no_python(name: str, capfd: Capture) -> None:
    text = call(capfd, name, "--help").out
    assert max(map(len, text.splitlines())) <= 80
    assert not re.search(r"<(str|int|float|list\[str\])>|default: \(|\{JOB\}", text)
