"""Plans that the tests of pictures draw."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from picture_jobs import ALONG_A_PATH, TWO
from planned_examples import planned_example

from trajcli.job.read import job_from_text
from trajcli.planning.plan import Plan, plan_job


@pytest.fixture
def two() -> Plan:
    return plan_job(job_from_text(TWO))


@pytest.fixture(scope="session")
def led() -> Plan:
    """Return the plan of a tool along a path with rounded corners, and of a move in joint space."""
    return plan_job(job_from_text(ALONG_A_PATH))


@pytest.fixture(scope="session")
def example() -> Callable[[str], Plan]:
    return planned_example
