"""`trajcli batch` of many small jobs, against one process each."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from benchmarks.contest import Command, compete
from benchmarks.figures import Figure

JOBS, ALONE = 100, 10
_JOB = """\
version: 1
units: {{angle: deg}}
robot: ur5e
start: {{joints: [0, -90, 90, 0, 90, 0]}}
moves:
  - {{planner: quintic, to: {{joints: [{angle}, -60, 60, 10, 80, 20]}}, duration: 2}}
output: {{rate: 100}}
"""
_ONE_BY_ONE = """\
import subprocess, sys
folder = sys.argv[1]
for number in range(int(sys.argv[2])):
    words = ["plan", f"{folder}/job{number}.yaml", "-q", "-o", f"{folder}/alone{number}.csv"]
    subprocess.run([sys.executable, "-m", "trajcli", *words], check=True)
"""


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figure: by one process on one core, also of jobs that are unchanged."""
    del peers, long
    with tempfile.TemporaryDirectory() as folder:
        for number in range(JOBS):
            Path(folder, f"job{number}.yaml").write_text(_JOB.format(angle=number / 2), encoding="utf-8")
        batch = [sys.executable, "-m", "trajcli", "batch", folder, "-o", f"{folder}/rows", "-j", "1", "-q"]
        runs = compete(
            {
                "batch": Command([*batch, "--force"]),
                "unchanged": Command(batch),
                "alone": Command([sys.executable, "-c", _ONE_BY_ONE, folder, str(ALONE)]),
            }
        )
        _check_rows(Path(folder))
    alone = [seconds * JOBS / ALONE for seconds in runs["alone"].seconds]
    return [
        Figure(
            f"batch of {JOBS} small jobs, one core", "one process each", runs["batch"].seconds, alone, 1 / 6
        ),
        Figure(
            "the same, unchanged", "the same batch", runs["unchanged"].seconds, runs["batch"].seconds, 0.5
        ),
    ]


def _check_rows(folder: Path) -> None:
    """Require that both have written the same."""
    for number in range(ALONE):
        alone = (folder / f"alone{number}.csv").read_bytes()
        if (folder / f"rows/job{number}.csv").read_bytes() != alone:
            raise RuntimeError(f"job {number} has other rows in a batch")
