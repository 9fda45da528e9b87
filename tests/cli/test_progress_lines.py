"""The line that shows what is under way, by a clock that passes where somebody waits; and who hears of which work."""

from __future__ import annotations

import fcntl
import io
import os
import pty
import struct
import subprocess
import termios
from contextlib import suppress
from pathlib import Path
from threading import Event

import pytest
from running import FAST, warm

from trajcli.cli import progress as shown
from trajcli.cli.progress import ProgressLine, progress
from trajcli.progress import listening, progress_of, report_progress


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


class Clock:
    """Time that passes where somebody waits, at once: the work ends after so many looks."""

    def __init__(self, looks: int) -> None:
        self.now, self.looks, self.waits = 100.0, looks, list[float]()
        self.begins = Event()
        self.begins.set()

    def wait(self, seconds: float) -> bool:
        self.begins.wait(5)
        self.waits.append(seconds)
        self.now += seconds
        return len(self.waits) > self.looks

    def set(self) -> None:
        pass


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    clock = Clock(4)
    monkeypatch.setattr(shown, "Event", lambda: clock)
    monkeypatch.setattr(shown, "monotonic", lambda: clock.now)
    monkeypatch.setenv("TERM", "xterm")
    return clock


def test_a_line_comes_after_a_second_and_five_times_a_second_then(clock: Clock) -> None:
    stream = Terminal()
    line = ProgressLine(stream)
    clock.now += 50  # it counts from when the work begins
    with line:
        pass
    assert clock.waits == [1.0, 0.2, 0.2, 0.2, 0.2]
    assert stream.getvalue().split("\r\x1b[2K") == ["", "1 s", "1 s", "1 s", "2 s", ""]


def test_nothing_is_erased_where_nothing_was_shown(clock: Clock) -> None:
    clock.looks = 0
    stream = Terminal()
    with ProgressLine(stream):
        pass
    assert stream.getvalue() == ""


@pytest.mark.parametrize(
    ("err", "out", "to_terminal", "seen"),
    [
        (True, True, False, True),
        (True, True, True, False),  # rows go there
        (True, False, True, True),
        (False, True, False, False),
        (False, False, False, False),
    ],
)
def test_steps_are_shown_on_a_terminal_that_has_no_rows(
    err: bool, out: bool, to_terminal: bool, seen: bool, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    streams = {
        name: Terminal() if is_one else io.StringIO() for name, is_one in (("stderr", err), ("stdout", out))
    }
    for name, stream in streams.items():
        monkeypatch.setattr(f"sys.{name}", stream)
    clock.begins.clear()  # nobody looks before something is said
    with progress(to_terminal=to_terminal):
        report_progress("step 7")
        clock.begins.set()
    assert ("step 7, " in streams["stderr"].getvalue()) == seen
    assert streams["stdout"].getvalue() == ""


class Gone(Terminal):
    def __init__(self, error: Exception) -> None:
        super().__init__()
        self.error = error

    def write(self, text: str) -> int:
        raise self.error


@pytest.mark.parametrize("error", [BrokenPipeError(), ValueError("closed")])
def test_a_terminal_that_is_gone_is_no_error(error: Exception, clock: Clock) -> None:
    with ProgressLine(Gone(error)):
        pass
    assert len(clock.waits) == 5  # the thread has looked to its end


def test_listeners_are_those_of_their_work_alone() -> None:
    inner: list[str] = []
    outer: list[str] = []
    with listening(outer.append):
        with listening(inner.append):
            report_progress("in")
        with progress_of("job 1"), progress_of("trial 2"):
            report_progress("step 3")
        report_progress("out")
    report_progress("nobody")
    assert inner == ["in"]
    assert outer == ["job 1", "job 1: trial 2", "job 1: trial 2: step 3", "out"]


def test_a_listener_is_gone_where_its_work_has_failed() -> None:
    texts: list[str] = []
    with suppress(ValueError), listening(texts.append), progress_of("work"):
        raise ValueError
    report_progress("behind")
    assert texts == ["work"]


@pytest.mark.parametrize(("said", "shows"), [("50", 49), ("200", 100), ("3", 39)])
def test_a_line_is_no_wider_than_its_terminal(
    said: str, shows: int, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What wraps is not erased."""
    monkeypatch.setenv("COLUMNS", said)
    clock.looks, stream = 1, Terminal()
    line = ProgressLine(stream)
    line.show("x" * 95)
    with line:
        pass
    assert stream.getvalue().split("\r\x1b[2K")[1] == f"{'x' * 95}, 1 s"[:shows]


@pytest.mark.parametrize(("said", "width"), [(60, 60), (0, 80), (120, 120)])
def test_where_rows_go_elsewhere_lines_are_as_wide_as_standard_error(
    said: int, width: int, tmp_path: Path
) -> None:
    """A terminal of no columns has not said how many."""
    (tmp_path / "fast.yaml").write_text(FAST.replace("quintic", "quintic, label: " + "word " * 30))
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 50, said, 0, 0))
    command = [*warm(), "plan", str(tmp_path / "fast.yaml"), "--no-output"]
    environment = {**os.environ, "TERM": "xterm", "COLUMNS": "", "NO_COLOR": "1"}
    subprocess.run(command, stdout=subprocess.PIPE, stderr=theirs, env=environment, check=False)
    os.close(theirs)
    text = os.read(ours, 10_000).decode()
    os.close(ours)
    lines = [line for line in text.splitlines() if "word" in line and "/" not in line]
    assert len(lines) > 1
    assert max(map(len, lines)) == pytest.approx(width - 2.5, abs=2.5)  # a word has four letters
