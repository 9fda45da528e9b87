"""A path of many rounded segments: the cost of a segment, for itself and against a path of few of them."""

from __future__ import annotations

import sys

from benchmarks.contest import Function, compete
from benchmarks.figures import Figure

FEW, MANY = 100, 1000
COLUMNS = 40  # of the zigzag, before it goes on in the next row


def planning(segments: int):
    """Prepare the planning of a zigzag with so many rounded segments."""
    import numpy as np

    from trajcli.job.read import job_from_text
    from trajcli.planning.plan import plan_job

    row, column = np.divmod(np.arange(1, segments + 1), COLUMNS)
    x = 0.4 + 0.002 * np.where(row % 2, COLUMNS - column, column)
    y = 0.1 + 0.003 * (np.arange(1, segments + 1) % 2) + 0.004 * row
    points = zip(x.tolist(), y.tolist(), strict=True)
    lines = "\n".join(f"  - line: {{xyz: [{a!r}, {b!r}, 0.3]}}" for a, b in points)
    law = "{shape: trapezoid, speed: 0.02, acceleration: 0.1}"
    job = job_from_text(
        "version: 1\nrobot: ur5e\nstart: {xyz: [0.4, 0.1, 0.3], rpy: [3.141592653589793, 0, 0]}\n"
        f"moves:\n- planner: path\n  radius: 0.001\n  law: {law}\n  segments:\n{lines}\n"
    )
    return lambda: plan_job(job), lambda plan: np.asarray(plan.trajectory.curve.piece_ends()[1][-1])


def few():
    """Prepare the short path."""
    return planning(FEW)


def many():
    """Prepare the long path."""
    return planning(MANY)


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figure: seconds for each segment of the long path against those of the short one."""
    del peers, long
    short, whole = (
        compete({name: Function(sys.executable, "benchmarks.long_path", name)})[name].seconds
        for name in ("few", "many")
    )
    name = f"path of {MANY} rounded segments, each segment"
    each = [s / MANY for s in whole], [s / FEW for s in short]
    return [
        Figure(name, f"each segment of {FEW}", *each, 1.5),
        Figure(name, "seconds", each[0], [], 0.008, kind="seconds"),
    ]
