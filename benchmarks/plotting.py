"""`trajcli plot` as a user runs it, against importing matplotlib's Figure and planning."""

from __future__ import annotations

import os
import sys

from benchmarks.contest import ROOT, Command, compete
from benchmarks.figures import Figure

IMPORT_AND_PLAN = "import matplotlib.figure; from trajcli.__main__ import main; main()"


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: of six joints for 10 s, and of the main example, whose moves are many."""
    jobs = {"six joints, 10 s": "benchmarks/quintic.yaml", "ur5e_pick": "examples/ur5e_pick.yaml"}
    found = []
    for name, job in jobs.items():
        path = f"{ROOT}/{job}"
        runs = compete(
            {
                "plot": Command([sys.executable, "-m", "trajcli", "plot", path, "-q", "-o", os.devnull]),
                "plan": Command([sys.executable, "-c", IMPORT_AND_PLAN, "plan", path, "--no-output", "-q"]),
            }
        )
        peer = "import matplotlib.figure, and plan --no-output, in one process"
        found.append(
            Figure(
                f"plot as SVG, whole process, {name}", peer, runs["plot"].seconds, runs["plan"].seconds, 1.3
            )
        )
    return found
