"""Plans that the tests of pictures draw."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from picture_jobs import EXAMPLES, TWO

from trajcli.job.read import job_from_text, load_job
from trajcli.planning.plan import Plan, plan_job


@pytest.fixture
def two() -> Plan:
    return plan_job(job_from_text(TWO))


@pytest.fixture(scope="session")
def example() -> Callable[[str], Plan]:
    plans: dict[str, Plan] = {}

    def planned(name: str) -> Plan:
        if name not in plans:
            plans[name] = plan_job(load_job(EXAMPLES / f"{name}.yaml"))
        return plans[name]

    return planned
