"""`trajcli plan` through points, as a user runs it; and how its planning grows with their number."""

from __future__ import annotations

import sys
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.contest import ROOT, Command, Function, compete
from benchmarks.figures import Figure

LINEAR = 12.0  # ten times as many points may take so many times as long
_MODULE = "benchmarks.through_points"
_JOB = """\
version: 1
robot: {{joints: 6}}
limits: {{velocity: {velocity}, acceleration: {acceleration}}}
start: {{joints: [{start}]}}
moves:
  - {{planner: {planner}, through: {{csv: {csv}}}}}
output: {{rate: {rate}, columns: [t, q, qd, qdd]}}
"""


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: against the scripts of scipy's and toppra's users, and ten times as many points."""
    return [*_processes(peers), *_growth()]


def _processes(peers: str | None) -> list[Figure]:
    with TemporaryDirectory() as folder:
        spline = _job(
            Path(folder), "spline, rule: clamped", 1000, timed=True, velocity=1e3, acceleration=1e5, rate=100
        )
        fastest = _job(Path(folder), "time_optimal", 10, timed=False, velocity=2, acceleration=5, rate=1000)
        plan = [sys.executable, "-m", "trajcli", "plan", "-q"]
        smooth = compete(
            {
                "ours": Command([*plan, f"{spline}.yaml"], compared=True),
                "scipy": Command(
                    [peers, f"{ROOT}/benchmarks/spline_script.py", f"{spline}.csv"], peer=True, compared=True
                ),
            }
        )
        quick = compete(
            {
                "ours": Command([*plan, f"{fastest}.yaml"]),
                "toppra": Command(
                    [peers, f"{ROOT}/benchmarks/toppra_script.py", f"{fastest}.csv"], peer=True
                ),
            }
        )
    name = "spline through 1000 points, whole process"
    found = [(name, "scipy CubicSpline + savetxt", smooth["ours"], smooth["scipy"], 1 / 2)]
    name = "time-optimal through 10 points, whole process"
    found.append((name, "toppra + savetxt", quick["ours"], quick["toppra"], 0.2))
    return [
        Figure(a, b, ours.seconds, peer.seconds, goal, skipped=peer.skipped)
        for a, b, ours, peer, goal in found
    ]


def _growth() -> list[Figure]:
    found = []
    for name, few, many in (
        ("spline, times given", 1000, 10_000),
        ("spline, times found", 100, 1000),
        ("blends, times found", 100, 1000),
        ("time_optimal", 100, 1000),
    ):
        word = name.replace(", ", "_").replace(" ", "_")
        runs = compete(
            {str(count): Function(sys.executable, _MODULE, f"{word}_{count}") for count in (few, many)},
            repeats=3,
        )
        title, ours, theirs = f"plan {many} points: {name}", runs[str(many)].seconds, runs[str(few)].seconds
        found.append(Figure(title, f"{few} points", ours, theirs, LINEAR))
    return found


def _job(folder: Path, planner: str, count: int, *, timed: bool, **numbers: float) -> Path:
    """Write a job and its points, and return their path without an ending."""
    points = _points(count)
    rows = [[0.1 * k, *row] if timed else row for k, row in enumerate(points)]
    names = [*(["t"] if timed else []), *(f"q{joint}" for joint in range(1, 7))]
    path = folder / f"{planner.split(',', maxsplit=1)[0]}_{count}"
    lines = [",".join(names), *(",".join(f"{value:.6f}" for value in row) for row in rows)]
    path.with_suffix(".csv").write_text("\n".join(lines) + "\n")
    start = ", ".join(f"{value:.6f}" for value in points[0])
    text = _JOB.format(planner=planner, csv=path.with_suffix(".csv").name, start=start, **numbers)
    path.with_suffix(".yaml").write_text(text)
    return path


def _points(count: int) -> list[list[float]]:
    import random

    draw, position, points = random.Random(1), [0.0] * 6, []
    for _ in range(count):
        position = [value + draw.uniform(-0.3, 0.3) for value in position]
        points.append([round(value, 6) for value in position])
    return points


def _planned(planner: str, count: int, *, timed: bool = False):
    """Prepare the planning of a move, its verdict included; the reading of the job is not counted."""
    import json

    from trajcli.job.read import job_from_text
    from trajcli.planning.plan import plan_job

    points = _points(count)
    table = {
        "positions": points[1:],
        **({"times": [0.1 * (k + 1) for k in range(count - 1)]} if timed else {}),
    }
    job = {
        "version": 1,
        "robot": {"joints": 6},
        "limits": {"velocity": 1e3, "acceleration": 1e5} if timed else {"velocity": 2, "acceleration": 5},
        "start": {"joints": points[0]},
        "moves": [{"planner": planner, "through": table}],
    }
    loaded = job_from_text(json.dumps(job))
    return partial(plan_job, loaded), lambda plan: []


spline_times_given_1000 = partial(_planned, "spline", 1000, timed=True)
spline_times_given_10000 = partial(_planned, "spline", 10_000, timed=True)
spline_times_found_100 = partial(_planned, "spline", 100)
spline_times_found_1000 = partial(_planned, "spline", 1000)
blends_times_found_100 = partial(_planned, "blends", 100)
blends_times_found_1000 = partial(_planned, "blends", 1000)
time_optimal_100 = partial(_planned, "time_optimal", 100)
time_optimal_1000 = partial(_planned, "time_optimal", 1000)
