"""Pages in headless Chromium, without a network and without a graphics card."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from extras import require_module
from one_browser import RUNNING, started

from docs.player_picture import wait_until


class Viewed:
    """A page in a browser, with all that it asked for and said.

    Attributes:
        page: Of playwright.
        requests: Addresses.
        messages: Of the console, and errors.
    """

    def __init__(self, page: Any) -> None:
        self.page = page
        self.requests: list[str] = []
        self.messages: list[str] = []
        page.on("request", lambda request: self.requests.append(request.url))
        page.on("console", lambda message: self.messages.append(f"{message.type}: {message.text}"))
        page.on("pageerror", lambda error: self.messages.append(f"error: {error}"))

    def open(self, file: Path) -> Viewed:
        self.page.goto(file.as_uri())
        wait_until(self.page, "window.trajcli?.ready")
        return self

    def time(self) -> float:
        return float(self.page.evaluate("trajcli.clock.time"))


def pytest_sessionfinish() -> None:
    RUNNING.close()


@pytest.fixture(scope="session")
def chromium() -> Any:
    require_module("playwright")
    return started()


@pytest.fixture
def view(chromium: Any) -> Iterator[Callable[..., Viewed]]:
    """Return a function that opens a file in a window of a size, offline."""
    contexts = []

    def opened(file: Path, width: int = 1280, height: int = 800, **options: Any) -> Viewed:
        context = chromium.new_context(offline=True, viewport={"width": width, "height": height}, **options)
        contexts.append(context)
        return Viewed(context.new_page()).open(file)

    yield opened
    for context in contexts:
        context.close()
