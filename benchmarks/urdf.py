"""`trajcli fk` of an arm from its URDF, and from the robot file that is made of it."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path

from benchmarks.contest import ROOT, Command, compete
from benchmarks.figures import Figure

URDF = ROOT / "tests/urdf/models/ur5.urdf"
JOINTS = ["0", "-1.5", "1.5", "0.1", "1.5", "0.2"]


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figure: the whole process against the same with the robot file."""
    ours = [sys.executable, "-m", "trajcli"]
    with tempfile.TemporaryDirectory() as folder:
        robot = str(Path(folder) / "ur5.yaml")
        subprocess.run([*ours, "urdf", str(URDF), "-o", robot], check=True, capture_output=True)
        runs = compete(
            {
                "urdf": Command([*ours, "fk", "--json", "--robot", str(URDF), *JOINTS]),
                "yaml": Command([*ours, "fk", "--json", "--robot", robot, *JOINTS]),
            }
        )
    urdf, yaml = runs["urdf"].seconds, runs["yaml"].seconds
    return [Figure("fk of a UR5 from URDF, whole process", "fk of the same from YAML", urdf, yaml, 1.3)]
