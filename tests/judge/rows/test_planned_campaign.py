"""Random jobs of every planner, written in every format: known as rows of their motion, and exit code 0."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import pytest
from planning.job_campaign import PLANNERS, job_of
from tiers import few

from trajcli.errors import InputError, PlanningError
from trajcli.job.read import job_from_text
from trajcli.judge.file import CheckOptions, check_file
from trajcli.output.delivery.joined import write_plan
from trajcli.planning.plan import plan_job

ENDINGS = ("csv", "jsonl", "mcap", "yaml")
RATES = (500, 250, 125, 100, 30)


def known(numbers: Sequence[int], folder: Path) -> int:
    """Write the jobs of some numbers and read them again; return how many of them verify."""
    jobs = 0
    for number in numbers:
        turn = number // len(PLANNERS)
        job = job_of(number) | {"output": {"rate": RATES[turn % len(RATES)]}}
        try:
            with np.errstate(all="ignore"):
                plan = plan_job(job_from_text(json.dumps(job)))
        except (PlanningError, InputError):
            continue
        if not plan.verdict.passed:
            continue
        file = folder / f"rows.{ENDINGS[turn % len(ENDINGS)]}"
        write_plan(plan, str(file))
        found = check_file(str(file), CheckOptions(), plan).judgement
        assert (found.planned_rows, found.passed) == (True, True), (number, file.suffix, found.notes)
        jobs += 1
    return jobs


def test_rows_of_every_planner_are_known(tmp_path: Path) -> None:
    assert known(few(range(4 * len(PLANNERS)), 6), tmp_path) >= 3


@pytest.mark.soak
@pytest.mark.parametrize("block", range(10))
def test_rows_of_every_planner_at_length(block: int, tmp_path: Path) -> None:
    assert known(range(100 * block, 100 * block + 100), tmp_path) >= 30
