"""`python -m benchmarks`: run them, print one table."""

from __future__ import annotations

import argparse
import json
import os
import platform
import subprocess
import sys
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from benchmarks.contest import REPEATS, ContestError
from benchmarks.figures import Figure, table

BENCHMARKS = (
    "planning",
    "batch",
    "help",
    "writing",
    "logs",
    "reading",
    "checking",
    "evaluation",
    "forward_kinematics",
    "urdf",
    "inverse_kinematics",
    "calibration",
    "time_optimal",
    "third_order",
    "dynamics",
    "through_points",
    "operational",
    "long_path",
    "jerk_limited",
    "waypoints",
    "flyby",
    "plotting",
    "viewing",
    "waiting",
)
OURS = ("trajcli", "numpy", "pydantic", "pyyaml", "typer")
THEIRS = ("roboticstoolbox-python", "eaik", "pin", "toppra", "copp-py", "numpy", "scipy")
_VERSIONS = """
import json, platform, sys
from importlib.metadata import version
print(json.dumps({"python": platform.python_version(), **{name: version(name) for name in sys.argv[1:]}}))
"""


def main() -> int:
    """Run the benchmarks asked for; return 0 unless something breaks: a missed goal is only said."""
    options = _options()
    peers, why_not = _peer_interpreter(options.peers)
    machine = _machine(peers, why_not)
    print("\n".join(f"{key}: {value}" for key, value in machine.items()), flush=True)
    figures: list[Figure] = []
    broken = False
    for name in options.only or BENCHMARKS:
        print(f"{name} ...", file=sys.stderr, flush=True)
        try:
            figures += import_module(f"benchmarks.{name}").figures(peers, long=options.long)
        except ContestError as error:
            print(f"{name} broke: {error}", file=sys.stderr, flush=True)
            broken = True  # what the others measure is not lost
    print(f"\nCPU time, children included: medians of {REPEATS} runs in turns, spread of those of one turn")
    print(f"\n{table(figures)}")
    if options.json:
        found = {"machine": machine, "figures": [figure.as_json() for figure in figures]}
        Path(options.json).write_text(json.dumps(found, indent=2) + "\n", encoding="utf-8")
    return int(broken)


def _options() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks", description="Ratios against peers, in one run."
    )
    parser.add_argument(
        "only", nargs="*", metavar="NAME", help=f"some of: {', '.join(BENCHMARKS)} (default: all)"
    )
    parser.add_argument(
        "--peers", metavar="PYTHON", help="interpreter of the environment made from peers.txt"
    )
    parser.add_argument("--long", action="store_true", help="also the peak memory of 10^7 rows")
    parser.add_argument("--json", metavar="FILE", help="write figures and all runs as JSON")
    options = parser.parse_args()
    unknown = [name for name in options.only if name not in BENCHMARKS]
    if unknown:
        parser.error(f"there is no benchmark {unknown[0]}; there are {', '.join(BENCHMARKS)}")
    return options


def _peer_interpreter(given: str | None) -> tuple[str | None, str]:
    """Return the peers' interpreter with an absolute path, or None and why there is none."""
    if given is None:
        return None, "none: --peers was not given"
    path = Path(given).absolute()  # not resolved: a link inside an environment is what makes it one
    return (str(path), "") if path.exists() else (None, f"none: there is no {given}")


def _machine(peers: str | None, why_not: str) -> dict[str, str]:
    """Return what the figures depend on, for the head of the table."""
    return {
        "processor": f"{_processor()}, {os.cpu_count()} cores, {platform.system()}",
        "ours": _listed({"python": platform.python_version(), **{name: _version(name) for name in OURS}}),
        "peers": _peer_versions(peers) if peers else why_not,
    }


def _processor() -> str:
    listed = Path("/proc/cpuinfo")
    lines = listed.read_text(encoding="utf-8").splitlines() if listed.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def _version(name: str) -> str:
    try:
        return version(name)
    except PackageNotFoundError:
        return "absent"


def _peer_versions(peers: str) -> str:
    try:
        done = subprocess.run([peers, "-c", _VERSIONS, *THEIRS], capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return "incomplete; what is missing is skipped"
    return _listed(json.loads(done.stdout))


def _listed(versions: dict[str, str]) -> str:
    return ", ".join(f"{name} {number}" for name, number in versions.items())


if __name__ == "__main__":
    sys.exit(main())
