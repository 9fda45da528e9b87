"""`trajcli --help` as a user runs it."""

from __future__ import annotations

import sys

from benchmarks.contest import ROOT, Command, compete
from benchmarks.figures import Figure


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figure: against a typer application that does nothing, without rich."""
    runs = compete(
        {
            "ours": Command([sys.executable, "-m", "trajcli", "--help"]),
            "bare": Command([sys.executable, f"{ROOT}/benchmarks/bare_application.py", "--help"]),
        }
    )
    ours, bare = runs["ours"].seconds, runs["bare"].seconds
    return [Figure("--help, whole process", "bare typer application", ours, bare, 1.3)]
