"""A line of a UR5e, planned once for the tests of judges."""

from __future__ import annotations

from functools import cache

import trajcli
from trajcli.api.plans import PlannedJob

JOB = {
    "version": 1,
    "robot": "ur5e",
    "limits": {"acceleration": 20.0},
    "start": {"joints": [0.2, -1.2, 1.6, -1.0, -1.3, 0.4]},
    "moves": [
        {"planner": "line", "to": {"xyz": [0.45, 0.25, 0.35]}, "law": {"shape": "quintic", "duration": 2}}
    ],
}


@cache
def plan() -> PlannedJob:
    return trajcli.plan(JOB)
