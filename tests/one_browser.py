"""The one browser of a process: Playwright refuses a second, which a fixture imported elsewhere would start."""

from __future__ import annotations

from contextlib import ExitStack
from functools import cache
from typing import Any

from extras import require_program

from docs.player_picture import BROWSERS, browser

RUNNING = ExitStack()
"""Closed at the end of the session."""


@cache
def started() -> Any:
    """Return the browser, which is started when it is first asked for."""
    return RUNNING.enter_context(browser(require_program(*BROWSERS)))
