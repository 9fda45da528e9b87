"""Files of motions for tests of tools: analytic ones, and those that `trajcli plan` writes."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from trajcli.curves.piecewise import Array
from trajcli.job.read import job_from_text
from trajcli.output.delivery.joined import write_plan
from trajcli.planning.plan import plan_job

JOB = """\
version: 1
units: {angle: deg}
robot: {joints: [{name: base, velocity: 90}, {name: arm}]}
start: {joints: [0, 10]}
moves:
  - {planner: quintic, to: {joints: [30, -20]}, duration: 1}
  - {planner: septic, to: {joints: [-10, 5]}, duration: 2}
output: {rate: 100, columns: [t, q, qd, qdd, qddd, move]}
"""


def planned(path: Path, job: str = JOB) -> Path:
    """Write the rows of a job."""
    write_plan(plan_job(job_from_text(job)), str(path))
    return path


def quintic(t: Array, distance: float, duration: float) -> tuple[Array, ...]:
    """Return q and three derivatives of the quintic from rest to rest, shape (N,) each."""
    u = t / duration
    law = (
        10 * u**3 - 15 * u**4 + 6 * u**5,
        (30 * u**2 - 60 * u**3 + 30 * u**4) / duration,
        (60 * u - 180 * u**2 + 120 * u**3) / duration**2,
        (60 - 360 * u + 360 * u**2) / duration**3,
    )
    return tuple(distance * values for values in law)


def table(path: Path) -> tuple[list[str], Array]:
    """Return names and rows of a CSV, read by numpy."""
    names = path.read_text().split("\n", 1)[0].split(",")
    return names, np.loadtxt(path, delimiter=",", skiprows=1)
