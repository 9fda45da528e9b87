"""What a hostile job file cannot do: run code, open connections, write files, ask for memory without bound."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from tests.cli.running import EXAMPLES, JOB, ROOT, call

Capture = pytest.CaptureFixture[str]
WATCHED = """\
import sys

def watch(event, arguments):
    if event.startswith(("socket.", "subprocess.", "os.system", "os.exec", "os.posix_spawn", "pickle.", "urllib.")):
        sys.stderr.write(f"EVENT {event}\\n")

sys.addaudithook(watch)
import socket
from trajcli.cli.app import app
for words in (["plan", "JOB", "-o", "rows.csv"], ["view", "JOB", "-o", "view.html"], ["explain", "JOB"]):
    try:
        app([word.replace("JOB", sys.argv[1]) for word in words])
    except SystemExit as left:
        assert not left.code, left.code
if len(sys.argv) > 2:
    socket.socket()
"""


@pytest.mark.parametrize("planted", [False, True], ids=["job", "planted"])
def test_commands_ask_the_system_for_no_connection_and_no_process(planted: bool, tmp_path: Path) -> None:
    words = [sys.executable, "-c", WATCHED, str(EXAMPLES / "cubic.yaml"), *(["planted"] if planted else [])]
    done = subprocess.run(
        words,
        cwd=tmp_path,
        env={"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=60,
        check=True,
    )
    assert ("EVENT socket." in done.stderr) == planted
    assert ("EVENT" in done.stderr) == planted
    assert {path.name for path in tmp_path.iterdir()} == {"rows.csv", "view.html"}


@pytest.mark.parametrize(
    ("hostile", "said"),
    [
        ("a: !!python/object/apply:os.system [touch pwned]\n", "tags are not read"),
        ("a: &a [x, x]\nb: &b [*a, *a]\nc: [*b, *b]\n", "anchors are not read"),
        ("a: " + "[" * 10_000 + "]" * 10_000 + "\n", "nest"),
        ("a: " + "x" * 5_000_001 + "\n", "at most 5 MB"),
        (
            JOB.replace("moves:", "moves:\n  - {repeat: 1000000000, moves: [{planner: hold, duration: 1}]}"),
            "1000000",
        ),
        (JOB.replace("version: 1", "version: 1\nname: ../../../etc/x"), ""),
    ],
    ids=["tag", "aliases", "depth", "size", "repeat", "name"],
)
def test_hostile_text_is_refused_or_is_just_text(
    hostile: str, said: str, capfd: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "job.yaml").write_text(hostile)
    code, _, err = call(capfd, "plan", "job.yaml", "--no-output")
    assert code == (2 if said else code)
    assert said in err
    assert "Traceback" not in err
    assert [path.name for path in tmp_path.iterdir()] == ["job.yaml"]
