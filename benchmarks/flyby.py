"""Programs whose corners are flown by: the time of planning, for itself, and against that with stops."""

from __future__ import annotations

import json
import sys
from functools import partial

from benchmarks import flying_programs as programs
from benchmarks.contest import Function, compete
from benchmarks.figures import Figure

FEW, MANY = 12, 50  # joint moves


def _planning(job, *, zones):
    """Prepare the planning of a job, with its zones or without."""
    import numpy as np

    from trajcli.job.read import job_from_text
    from trajcli.planning.plan import plan_job

    loaded = job_from_text(json.dumps(job if zones else programs.without_zones(job)))
    return lambda: plan_job(loaded), lambda plan: np.array([len(plan.moves)])


joints_flown = partial(_planning, programs.random_joint_moves(1), zones=True)
joints_stopping = partial(_planning, programs.random_joint_moves(1), zones=False)
lines_flown = partial(_planning, programs.mixed_moves(), zones=True)
lines_stopping = partial(_planning, programs.mixed_moves(), zones=False)
few_flown = partial(_planning, programs.random_joint_moves(1, FEW), zones=True)
many_flown = partial(_planning, programs.random_joint_moves(1, MANY), zones=True)


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: seconds, quotients to planning with stops, with `long` growth."""
    del peers
    result = []
    for kind, what, goal, times in (
        ("joints", "three joint moves with zones", 0.5, 100),
        ("lines", "two joint moves and two lines with zones", 2.0, 30),
    ):
        names = f"{kind}_flown", f"{kind}_stopping"
        runs = compete({name: Function(sys.executable, "benchmarks.flyby", name) for name in names})
        ours, stopping = (runs[name].seconds for name in names)
        result.append(Figure(what, "seconds", ours, [], goal, kind="seconds"))
        result.append(Figure(what, "the same with stops", ours, stopping, times))
    return [*result, _growth()] if long else result


def _growth() -> Figure:
    """Return the time for each of many moves against that for each of few."""
    few, many = (
        compete({name: Function(sys.executable, "benchmarks.flyby", name)})[name].seconds
        for name in ("few_flown", "many_flown")
    )
    each = [s / MANY for s in many], [s / FEW for s in few]
    return Figure(f"{MANY} joint moves with zones, each", f"each of {FEW}", *each, 1.25)
