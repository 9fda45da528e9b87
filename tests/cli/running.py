"""Run the command line, in a process of its own or in this one.

A process of its own is a fresh one where a test is about its start or streams that are closed (`COMMAND`), a copy of this
one where it is about signals (`begun`), and a copy of one that has imported everything elsewhere: these cost a tenth.
`tests/test_docs.py` compares the first with the last.
"""

from __future__ import annotations

import fcntl
import gc
import io
import os
import pty
import signal
import struct
import subprocess
import sys
import termios
from contextlib import nullcontext, suppress
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple
from unittest.mock import patch

import pytest

from docs.warm import warm_commands

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
COMMAND = [sys.executable, "-m", "trajcli"]

JOB = """\
version: 1
units: {angle: deg}
robot: {joints: [{velocity: 90}]}
start: {joints: 0}
moves:
  - {planner: quintic, to: {joints: 30}, duration: 1}
output: {rate: 10, columns: [t, q]}
"""
FAST = JOB.replace("duration: 1", "duration: 0.25")  # 225 deg/s
SLOWED = FAST.replace("duration: 0.25", "duration: 0.25, when_over_limit: slow")
IMPOSSIBLE = JOB.replace("quintic, to: {joints: 30}", "trapezoid, to: {joints: 30}, velocity: 20")
ENDLESS = JOB.replace("rate: 10", "rate: 1e6")
LONG = JOB.replace("rate: 10", "rate: 2e4")  # more than a pipe holds: who writes it waits for its reader


class Outcome(NamedTuple):
    """What a command left behind."""

    code: int
    out: str
    err: str


def warm() -> list[str]:
    """Return the words of the command that is a copy of a process which waits."""
    return [str(warm_commands() / "trajcli")]


def run(*arguments: str | Path, stdin: str = "", fresh: bool = False, **options: Any) -> Outcome:
    """Run the command in a process of its own."""
    words = [*(COMMAND if fresh else warm()), *map(str, arguments)]
    done = subprocess.run(
        words, input=stdin, capture_output=True, text=True, timeout=60, check=False, **options
    )
    return Outcome(done.returncode, done.stdout, done.stderr)


def begun(*arguments: str | Path, **options: Any) -> subprocess.Popen[bytes]:
    """Begin the command in a copy of this process, which has imported it: signals reach it as they reach a fresh one."""
    import_module(f"trajcli.cli.{arguments[0]}")
    words = ["trajcli", *map(str, arguments)]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen(words, preexec_fn=partial(_become, words), **pipes, **options)  # noqa: PLW1509


def _become(words: list[str]) -> None:
    """Run the command in place of the program that a process, just begun, would run."""
    os.closerange(3, 4096)  # who began it waits for one of these to be closed
    gc.enable()
    signal.signal(signal.SIGPIPE, signal.SIG_IGN)  # as Python starts
    signal.signal(signal.SIGINT, signal.default_int_handler)
    for number in (signal.SIGTERM, signal.SIGHUP):
        if callable(
            signal.getsignal(number)
        ):  # what is handled here is not handled there, what is ignored is
            signal.signal(number, signal.SIG_DFL)
    sys.stdin, sys.stdout, sys.stderr = os.fdopen(0), os.fdopen(1, "w"), os.fdopen(2, "w")
    sys.argv = words
    from trajcli.__main__ import main

    main()


def on_terminal(*arguments: str | Path, columns: int = 80, **environment: str) -> tuple[int, str]:
    """Run the command on a terminal of so many columns; return its exit code, and all that it shows there."""
    command = warm()
    process, ours = pty.fork()
    if process == 0:
        fcntl.ioctl(1, termios.TIOCSWINSZ, struct.pack("HHHH", 50, columns, 0, 0))
        words = {"TERM": "xterm", "COLUMNS": "", "NO_COLOR": "", "FORCE_COLOR": "", **environment}
        os.execve(command[0], [*command, *map(str, arguments)], {**os.environ, **words})
    shown = b""
    with suppress(OSError):  # the other side has closed it
        while chunk := os.read(ours, 1 << 16):
            shown += chunk
    os.close(ours)
    return os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]), shown.decode().replace("\r\n", "\n")


def call(capfd: pytest.CaptureFixture[str], *arguments: str | Path, stdin: str | None = None) -> Outcome:
    """Run the command in this process: quicker, with the same exit."""
    from trajcli.cli.app import app

    capfd.readouterr()
    text = None if stdin is None else io.TextIOWrapper(io.BufferedReader(io.BytesIO(stdin.encode())), "utf-8")
    with pytest.raises(SystemExit) as left, nullcontext() if text is None else patch("sys.stdin", text):
        app([str(argument) for argument in arguments])
    return Outcome(left.value.code or 0, *capfd.readouterr())  # type: ignore[arg-type]
