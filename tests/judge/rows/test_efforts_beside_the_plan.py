"""Efforts that a file has beside the motion of a job: of a robot without masses nothing says what they should be."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from trajcli.job.read import job_from_text
from trajcli.judge.rows.planned_rows import compare_with_plan
from trajcli.planning.plan import plan_job
from trajcli.streams.byte_source import ByteSource

LINK = {"mass": 2.0, "com": [0, 0, 0.1], "inertia": [0.1, 0.1, 0.02, 0, 0, 0]}


@pytest.mark.parametrize(
    ("links", "planned", "said"),
    [
        ([None, None], False, "it has efforts, and the robot of the job has no masses"),
        ([LINK, None], False, "it has efforts, and the robot of the job has no masses"),
        ([LINK, LINK], True, None),
    ],
)
def test_efforts_are_compared_where_they_follow_from_masses(
    links: list[Any], planned: bool, said: str | None, tmp_path: Path
) -> None:
    """About vertical axes, at rest: no torque in either joint."""
    rows = [{"a": 0.5} | ({} if link is None else {"link": link}) for link in links]
    job = {"version": 1, "robot": {"convention": "standard", "joints": rows}, "start": {"joints": [0.5, 1]}}
    job |= {"moves": [{"planner": "hold", "duration": 0.2}], "output": {"rate": 10}}
    stamps = np.arange(3)[:, None] / 10
    lines = [
        ",".join(f"{value:.9f}" for value in row)
        for row in np.hstack([stamps, np.tile([0.5, 1, 0, 0], (3, 1))])
    ]
    (tmp_path / "rows.csv").write_text("\n".join(["t,q1,q2,tau1,tau2", *lines]) + "\n", encoding="utf-8")
    found = compare_with_plan(
        ByteSource(str(tmp_path / "rows.csv")), plan_job(job_from_text(json.dumps(job)))
    )
    assert found.planned is planned
    assert (found.difference or "").startswith(said or "")
