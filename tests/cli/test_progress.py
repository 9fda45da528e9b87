"""Progress on a terminal, and its silence everywhere else."""

from __future__ import annotations

import io
import os
import pty
import subprocess
import time
from contextlib import suppress
from pathlib import Path
from threading import Event, Thread

from running import warm

from trajcli.cli.progress import ProgressLine
from trajcli.progress import listening, progress_of, report_progress

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


def test_steps_say_of_which_work_they_are() -> None:
    texts: list[str] = []
    with progress_of("nobody listens"):
        report_progress("step")
    with listening(texts.append), progress_of("trial 2, 4 kg"):
        report_progress("checking")
    assert texts == ["trial 2, 4 kg", "trial 2, 4 kg: checking"]


def run(*arguments: str, terminal: bool, late: float = 0.0) -> str:
    """Return what `trajcli` writes to standard error, which is a terminal or a pipe.

    Its rows are read when there is progress, or after `late` seconds.
    """
    command = [*warm(), *arguments]
    ours, theirs = pty.openpty() if terminal else os.pipe()
    with subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=theirs, env={**os.environ, "TERM": "xterm"}
    ) as process:
        os.close(theirs)
        seen, rows = Event(), process.stdout
        assert rows is not None
        reader = Thread(target=lambda: (seen.wait(late), rows.read()))
        reader.start()
        text = b""
        with suppress(OSError):  # the other side has closed it
            while chunk := os.read(ours, 4096):
                text += chunk
                if b"writing row" in text:
                    seen.set()
        reader.join()
    os.close(ours)
    assert process.returncode == 0
    return text.decode()


def test_a_terminal_sees_the_rows_count_and_a_pipe_does_not() -> None:
    long_work = ("plan", str(JOB), "--rate", "1000")  # more than a pipe holds: it waits for its reader
    seen = run(*long_work, terminal=True, late=30.0)
    assert "\r\x1b[2Kwriting row " in seen
    assert " of 6853, " in seen
    assert seen.index("verified\x1b[0m, 9 moves") > seen.rindex("\r\x1b[2K")
    assert "writing row" not in run("plan", str(JOB), terminal=True)
    assert "\x1b" not in run(*long_work, terminal=False, late=2.0)
