"""Progress on a terminal, and its silence everywhere else."""

from __future__ import annotations

import io
import os
import pty
import subprocess
import sys
import time
from pathlib import Path

from trajcli.cli.progress import ProgressLine
from trajcli.progress import listening, report_progress

JOB = Path(__file__).parents[2] / "examples/ur5e_pick.yaml"


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_short_work_shows_nothing() -> None:
    stream = Terminal()
    with ProgressLine(stream, quiet=5.0) as line:
        line.show("planning")
    assert stream.getvalue() == ""


def test_long_work_shows_the_last_text_and_erases_it() -> None:
    stream = Terminal()
    with ProgressLine(stream, quiet=0.01, period=0.01) as line:
        line.show("planning move 1 of 2")
        time.sleep(0.1)
        line.show("x" * 200)
        time.sleep(0.1)
    shown = stream.getvalue().split("\r\x1b[2K")
    assert shown[1] == "planning move 1 of 2, 0 s"
    assert shown[-2] == "x" * 79
    assert shown[-1] == ""


def test_a_lost_terminal_is_no_error() -> None:
    stream = Terminal()
    with ProgressLine(stream, quiet=0.01, period=0.01):
        stream.close()
        time.sleep(0.05)


def test_texts_reach_whoever_listens_and_nobody_else() -> None:
    texts: list[str] = []
    report_progress("before")
    with listening(texts.append):
        report_progress("inside")
    report_progress("behind")
    assert texts == ["inside"]


def run(*arguments: str, terminal: bool, stdout: Path) -> str:
    """Return what `trajcli` writes to standard error, which is a terminal or a pipe."""
    command = [sys.executable, "-m", "trajcli", *arguments]
    environment = {**os.environ, "TERM": "xterm"}
    with stdout.open("wb") as out:
        if not terminal:
            return subprocess.run(
                command, stdout=out, stderr=subprocess.PIPE, text=True, env=environment, check=True
            ).stderr
        ours, theirs = pty.openpty()
        with subprocess.Popen(command, stdout=out, stderr=theirs, env=environment) as process:
            os.close(theirs)
            chunks = []
            try:
                while chunk := os.read(ours, 4096):
                    chunks.append(chunk)
            except OSError:  # the other side has closed it
                pass
        os.close(ours)
        assert process.returncode == 0
        return b"".join(chunks).decode()


def test_a_terminal_sees_the_rows_count_and_a_pipe_does_not(tmp_path: Path) -> None:
    # with all their digits, 700000 rows take more than a second
    long_work = ("plan", str(JOB), "--rate", "100000", "--digits", "full")
    seen = run(*long_work, terminal=True, stdout=tmp_path / "a.csv")
    assert "\r\x1b[2Kwriting row " in seen
    assert " of 685131, " in seen
    assert seen.index("verified, 9 moves") > seen.rindex("\r\x1b[2K")
    assert "writing row" not in run("plan", str(JOB), terminal=True, stdout=tmp_path / "b.csv")
    assert "\x1b" not in run(*long_work[:4], terminal=False, stdout=tmp_path / "b.csv")
