"""What starting up costs: the modules that a run of the command line has loaded when it leaves."""

from __future__ import annotations

import os
import subprocess
import sys

from sources import ROOT

SHOW_MODULES = """\
import os, sys
from trajcli.__main__ import main

def leave(code):
    os.write(2, " ".join(sys.modules).encode())
    leave_now(code)

leave_now, os._exit = os._exit, leave
main()
"""


def modules_after(*arguments: str) -> set[str]:
    """Return the names of all modules that a run of the command line has loaded when it leaves."""
    environment = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    command = [sys.executable, "-c", SHOW_MODULES, *arguments]
    run = subprocess.run(
        command, capture_output=True, text=True, cwd=ROOT, env=environment, check=True, timeout=60
    )
    modules = set(run.stderr.split())
    assert "trajcli.cli.app" in modules, "the modules could not be read"
    return modules


def test_help_imports_no_numbers() -> None:
    modules = modules_after("--help")
    assert not modules & {
        "numpy",
        "scipy",
        "pydantic",
        "pydantic_core",
        "ruckig",
        "toppra",
        "matplotlib",
        "yaml",
        "tempfile",
        "trajcli.streams",
    }


HEAVY_FOR_A_PLAN = {"scipy", "ruckig", "toppra", "matplotlib", "mcap", "trajcli.geometry", "jsonschema"}
LOOKS_FOR_PLUGINS = {"importlib.metadata", "email", "zipfile", "socket"}
OF_OTHER_JOBS = {
    "trajcli.planners.point_to_point.cycloidal",
    "trajcli.planners.waypoints.spline",
    "trajcli.kinematics.forward",
    "trajcli.job.report",
}


def test_a_small_plan_imports_nothing_heavy() -> None:
    modules = modules_after("plan", "examples/quintic.yaml", "--quiet")
    assert {"numpy", "pydantic", "yaml"} <= modules
    assert not modules & (HEAVY_FOR_A_PLAN | LOOKS_FOR_PLUGINS | OF_OTHER_JOBS)
    assert_few(modules, 72)


def test_inverse_kinematics_imports_nothing_heavy() -> None:
    modules = modules_after("ik", "--robot", "ur5e", "--pose", "{xyz: [0.4, 0.1, 0.25], rpy: [180, 0, 0]}")
    planning = {"trajcli.planners.point_to_point.point_to_point", "trajcli.planning.plan", "trajcli.checks"}
    assert "trajcli.kinematics.inverse.solve" in modules
    assert not modules & ((HEAVY_FOR_A_PLAN | LOOKS_FOR_PLUGINS | planning) - {"trajcli.geometry"})


def assert_few(modules: set[str], most: int) -> None:
    """Of trajcli itself: what a job does not use is not imported."""
    walked = {name for name in modules if name.partition(".")[0] == "trajcli"}
    assert 50 < len(walked) <= most, sorted(walked)


def test_a_longer_command_walks_few_files() -> None:
    assert_few(modules_after("explain", "examples/weld_seam.yaml"), 140)
