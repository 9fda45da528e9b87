"""`trajcli plan` as a user runs it: from the shell's prompt to the last row."""

from __future__ import annotations

import sys

from benchmarks.contest import ROOT, Command, compete
from benchmarks.figures import Figure

NEEDED = "import numpy, yaml; from pydantic import BaseModel"  # what no program of this kind can do without


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: against the imports that are needed, and against the script of a toolbox's user."""
    runs = compete(
        {
            "plan": Command(
                [sys.executable, "-m", "trajcli", "plan", f"{ROOT}/benchmarks/quintic.yaml"], compared=True
            ),
            "imports": Command([sys.executable, "-c", NEEDED]),
            "unchecked": Command(
                [sys.executable, f"{ROOT}/benchmarks/unchecked_script.py", f"{ROOT}/benchmarks/quintic.yaml"],
                compared=True,
            ),
            "script": Command([peers, f"{ROOT}/benchmarks/toolbox_script.py"], peer=True, compared=True),
        }
    )
    name, ours, script = "plan, whole process, 10001 x 19", runs["plan"].seconds, runs["script"]
    return [
        Figure(name, "import numpy, yaml, pydantic", ours, runs["imports"].seconds, 2.0),
        Figure(name, "same imports and arithmetic", ours, runs["unchecked"].seconds, 1.15),
        Figure(name, "Robotics Toolbox jtraj + savetxt", ours, script.seconds, 0.12, skipped=script.skipped),
    ]
