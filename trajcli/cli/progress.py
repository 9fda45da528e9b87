"""Progress on a terminal: one line on standard error for work above a second, and nothing in a pipe."""

from __future__ import annotations

import os
import shutil
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from threading import Event, Thread
from time import monotonic
from typing import Self, TextIO

from trajcli.progress import listening

_QUIET = 1.0  # s: work that is done by then shows nothing
_PERIOD = 0.2  # s between two looks at what is under way
_NARROW = 40  # columns: a terminal that says less is taken for one of so many
ERASE = "\r\x1b[2K"


@contextmanager
def progress(*, to_terminal: bool = False) -> Iterator[None]:
    """Show what is under way inside, for as long as it takes more than a second.

    Args:
        to_terminal: Whether rows may go to standard output: nothing is shown where that is a terminal, too.
    """
    stream = sys.stderr
    if not is_terminal(stream) or (to_terminal and is_terminal(sys.stdout)):
        yield
        return
    line = ProgressLine(stream)
    with listening(line.show), line:
        yield


def is_terminal(stream: TextIO | None) -> bool:
    """Return whether a stream is a terminal that can erase a line."""
    try:
        return stream is not None and stream.isatty() and os.environ.get("TERM") != "dumb"
    except ValueError:  # it is closed
        return False


def columns() -> int:
    """Return how many columns the terminal has: that of standard error where rows go elsewhere."""
    aside = 80
    with suppress(OSError):
        aside = os.get_terminal_size(2).columns or aside
    return max(shutil.get_terminal_size((aside, 24)).columns, _NARROW)


class ProgressLine:
    """A line of text that is written over and over by a thread of its own, and erased in the end.

    Args:
        stream: A terminal.
        quiet: How long nothing is shown, s.
        period: Time between two lines, s.
    """

    def __init__(self, stream: TextIO, quiet: float = _QUIET, period: float = _PERIOD) -> None:
        self._stream, self._quiet, self._period = stream, quiet, period
        self._text, self._shown = "", False
        self._done, self._thread = Event(), Thread(target=self._run, daemon=True)
        self._begun = monotonic()

    def show(self, text: str) -> None:
        """Show a text at the next occasion."""
        self._text = text

    def __enter__(self) -> Self:
        self._begun = monotonic()
        self._thread.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._done.set()
        self._thread.join()
        if self._shown:
            self._write(ERASE)

    def _run(self) -> None:
        wait = self._quiet
        while not self._done.wait(wait):
            text = f"{self._text}, {monotonic() - self._begun:.0f} s".removeprefix(", ")
            self._write(f"{ERASE}{text[: columns() - 1]}")
            self._shown, wait = True, self._period

    def _write(self, text: str) -> None:
        with suppress(OSError, ValueError):  # the terminal is gone: nobody reads it
            self._stream.write(text)
            self._stream.flush()
