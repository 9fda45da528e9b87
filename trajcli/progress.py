"""Progress of long work: the text of the step that runs, and its listener."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar

Listener = Callable[[str], None]
"""Takes the step that runs, such as `move 3 of 9 (path)`."""

_LISTENER: ContextVar[Listener | None] = ContextVar("listener", default=None)


def report_progress(text: str) -> None:
    """Say the step that runs from now on; it costs nothing where nobody listens."""
    listener = _LISTENER.get()
    if listener is not None:
        listener(text)


@contextmanager
def progress_of(work: str) -> Iterator[None]:
    """Say of which work every step inside is one, as `trial 3, 4.5 kg: planning move 2 (line)`."""
    outer = _LISTENER.get()
    if outer is None:
        yield
        return
    outer(work)
    with listening(lambda text: outer(f"{work}: {text}")):
        yield


@contextmanager
def listening(listener: Listener) -> Iterator[None]:
    """Let `listener` have every text that is said inside."""
    token = _LISTENER.set(listener)
    try:
        yield
    finally:
        _LISTENER.reset(token)
