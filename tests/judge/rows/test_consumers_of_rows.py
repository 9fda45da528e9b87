"""Consumers for whose plan a file may hold the rows: by its ends, how long it lasts, its rate and its joints."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
import random_jobs

from trajcli.judge.rows.rows_for_consumers import consumers_of
from trajcli.planning.plan import Plan, plan_job
from trajcli.streams.byte_source import ByteSource

DURATION = 0.5
FRANKA = {"franka-fer", "franka-fr3"}
"""They take rows of seven joints at 1 kHz."""


@cache
def plan(joints: int) -> Plan:
    """Return the plan of a quintic from 0 to 0.1 rad, whose rows stand 0.1 s apart."""
    job = {
        "version": 1,
        "robot": {"joints": joints},
        "start": {"joints": [0.0] * joints},
        "output": {"rate": 10},
    }
    job |= {"limits": {"velocity": 9, "acceleration": 90, "jerk": None}}
    move = {"planner": "quintic", "to": {"joints": [0.1] * joints}, "duration": DURATION}
    return plan_job(random_jobs.loaded(job | {"moves": [move]}))


def found(
    folder: Path, t: np.ndarray, joints: int = 7, columns: int = 7, beside: tuple[float, float] = (0.0, 0.0)
) -> dict[str, list[float | None]]:
    """Return the rates by consumer that rows on straight lines between the ends of a plan, or beside them, may be at."""
    rows = np.column_stack([t, *[0.1 * t / t[-1]] * columns])
    rows[[0, -1], -1] += beside
    names = ",".join(["t", *(f"q{number + 1}" for number in range(columns))])
    np.savetxt(folder / "rows.csv", rows, "%.9f", ",", header=names, comments="")
    rates = dict[str, list[float | None]]()
    for each in consumers_of(ByteSource(str(folder / "rows.csv")), plan(joints)):
        rates.setdefault(each.profile, []).append(each.rate)
        rate = each.loaded.job.output.rate
        assert (rate, each.loaded.job.when_over_limit) == (each.rate or 10, "slow")
    return rates


@pytest.mark.parametrize("joints", [3, 7])
@pytest.mark.parametrize("rate", [10.0, 25.0, 1000.0])
def test_consumers_that_take_any_rate_are_tried_at_that_of_the_rows_too(
    rate: float, joints: int, tmp_path: Path
) -> None:
    """One that has a rate is tried at its own, where the rows have it and as many joints as it moves."""
    rates = found(tmp_path, np.arange(int(0.6 * rate) + 1) / rate, joints, joints)
    assert FRANKA & rates.keys() == (FRANKA if (rate, joints) == (1000.0, 7) else set())
    assert "ros-jtc" in rates
    for profile, tried in rates.items():
        assert tried == ([None] if profile in FRANKA or rate == 10.0 else [None, rate])


@pytest.mark.parametrize("last", [0.001, 0.0399])
def test_the_last_row_at_any_time_is_no_matter_to_the_rate(last: float, tmp_path: Path) -> None:
    rates = found(tmp_path, np.append(np.arange(16) / 25, 0.6 + last))
    assert rates["ros-jtc"] == [None, 25.0]


@pytest.mark.parametrize("beside", [(1e-8, 0.0), (0.0, 1e-8), (0.0, 0.0)])
def test_rows_that_begin_or_end_elsewhere_are_for_nobody(beside: tuple[float, float], tmp_path: Path) -> None:
    """By more than half a unit of their last decimal, of one joint."""
    assert bool(found(tmp_path, np.linspace(0.0, 0.6, 7), beside=beside)) == (not any(beside))


def test_rows_at_no_rate_are_tried_once(tmp_path: Path) -> None:
    rates = found(tmp_path, np.array([0.0, 0.1, 0.25, 0.37, 0.5, 0.6]))
    assert "ros-jtc" in rates
    assert all(tried == [None] for tried in rates.values())


@pytest.mark.parametrize("second", [0.0, -0.1, 1e-9])
@pytest.mark.parametrize("count", [1, 3])
def test_stamps_that_repeat_or_go_back_have_no_rate(count: int, second: float, tmp_path: Path) -> None:
    rates = found(tmp_path, np.append(second * np.arange(count + 1), 0.6))
    assert rates["ros-jtc"] == [None]


@pytest.mark.parametrize(
    ("lasting", "any_one"), [(0.999, False), (1.0, False), (1.001, True), (2.0, True), (2.001, False)]
)
def test_rows_for_a_consumer_last_longer_and_not_more_than_twice_as_long(
    lasting: float, tmp_path: Path, *, any_one: bool
) -> None:
    assert bool(found(tmp_path, lasting * DURATION * np.linspace(0.0, 1.0, 6))) == any_one


@pytest.mark.parametrize("columns", [6, 8])
def test_rows_of_other_joints_are_for_nobody(columns: int, tmp_path: Path) -> None:
    assert found(tmp_path, np.linspace(0.0, 0.6, 7), columns=columns) == {}
