"""`trajcli view` as a user runs it, against `trajcli plan` of the same job."""

from __future__ import annotations

import sys

from benchmarks.contest import ROOT, Command, compete
from benchmarks.figures import Figure

JOB = f"{ROOT}/examples/ur5e_pick.yaml"


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: a page, and a compressed one."""
    runs = compete(
        {
            "plan": Command([sys.executable, "-m", "trajcli", "plan", JOB]),
            "view": Command([sys.executable, "-m", "trajcli", "view", JOB]),
            "compressed": Command([sys.executable, "-m", "trajcli", "view", JOB, "--compress"]),
        }
    )
    plan = runs["plan"].seconds
    return [
        Figure("view, whole process", "plan of the same job", runs["view"].seconds, plan, 1.3),
        Figure("view --compress", "plan of the same job", runs["compressed"].seconds, plan, 1.3),
    ]
