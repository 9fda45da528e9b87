"""Consumers for whose plan a file may hold the rows: by its ends, how long it lasts, its rate and its joints."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
import random_jobs

from trajcli.judge.rows.rows_for_consumers import RowsForConsumer, consumers_of
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
    folder: Path,
    t: np.ndarray,
    joints: int = 7,
    columns: int = 7,
    beside: tuple[float, float] = (0.0, 0.0),
    decimals: int = 9,
) -> dict[str, list[float | None]]:
    """Return the rates by consumer that rows on straight lines between the ends of a plan, or beside them, may be at."""
    rows = np.column_stack([t, *[0.1 * t / t[-1]] * columns])
    rows[[0, -1], -1] += beside
    names = ",".join(["t", *(f"q{number + 1}" for number in range(columns))])
    np.savetxt(folder / "rows.csv", rows, f"%.{decimals}f", ",", header=names, comments="")
    rates = dict[str, list[float | None]]()
    for each in consumers_of(ByteSource(str(folder / "rows.csv")), plan(joints)):
        rates.setdefault(each.profile, []).append(each.rate)
        rate = each.loaded.job.output.rate
        assert (rate, each.loaded.job.when_over_limit) == (each.rate or 10, "slow")
    return rates


@pytest.mark.parametrize("joints", [3, 7, 8])
@pytest.mark.parametrize("rate", [10.0, 25.0, 1000.0, 2000.0])
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


@pytest.mark.parametrize(("beside", "same"), [(5e-10, True), (2e-9, False)])
@pytest.mark.parametrize("last", [True, False])
def test_of_many_decimals_a_billionth_is_no_other_place(
    beside: float, last: bool, tmp_path: Path, *, same: bool
) -> None:
    """A motion that is planned anew for a consumer is rounded anew."""
    ends = (0.0, beside) if last else (beside, 0.0)
    assert bool(found(tmp_path, np.linspace(0.0, 0.6, 7), beside=ends, decimals=15)) == same


def test_a_job_that_lists_its_times_has_none_at_the_rate_of_the_rows(tmp_path: Path) -> None:
    own = plan(7)
    output = own.loaded.job.output.model_copy(update={"rate": None, "times": (0.0, 0.2, DURATION)})
    job = own.loaded.job.model_copy(update={"output": output})
    listed = replace(own, loaded=replace(own.loaded, job=job))
    found(tmp_path, np.arange(16) / 25)
    told = list(consumers_of(ByteSource(str(tmp_path / "rows.csv")), listed))
    outputs = {each.rate: each.loaded.job.output for each in told if each.profile == "ros-jtc"}
    assert {rate: (each.rate, each.times) for rate, each in outputs.items()} == {
        None: (None, (0.0, 0.2, DURATION)),
        25.0: (25.0, None),
    }


@pytest.mark.parametrize(
    "steps",
    [
        [0.1, 0.15, 0.12, 0.13, 0.1],
        0.1 + 1.5e-6 * np.arange(6),  # each differs by little from the one before
        [0.6],  # of two rows there is one step, which may be any
    ],
)
def test_rows_at_no_rate_are_tried_once(steps: list[float], tmp_path: Path) -> None:
    rates = found(tmp_path, np.append(0.0, np.cumsum(steps)))
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


@pytest.mark.parametrize("beside", [0.0, 0.2, -0.2])
def test_columns_may_stand_in_any_order_and_in_units_of_their_own(beside: float, tmp_path: Path) -> None:
    """One joint in degrees, one in radians; of those in degrees one decimal is known."""
    job = {"version": 1, "robot": {"joints": 2}, "start": {"joints": [0.1, 0.5]}, "output": {"rate": 10}}
    job |= {"limits": {"velocity": 9, "acceleration": 90, "jerk": None}}
    move = {"planner": "quintic", "to": {"joints": [0.2, 0.9]}, "duration": DURATION}
    own = plan_job(random_jobs.loaded(job | {"moves": [move]}))
    t = np.linspace(0.0, 0.6, 7)
    second = np.degrees(0.5 + 0.4 * t / t[-1])
    second[-1] += beside
    rows = np.column_stack([second, 7.0 + t, 0.1 + 0.1 * t / t[-1]])
    np.savetxt(tmp_path / "rows.csv", rows, ("%.1f", "%.9f", "%.9f"), ",", header="q2_deg,t,q1", comments="")
    told = {each.profile for each in consumers_of(ByteSource(str(tmp_path / "rows.csv")), own)}
    assert ("ros-jtc" in told) == (abs(beside) < 0.1)


@pytest.mark.parametrize("rate", [None, 1000 / 3, 125.0])
@pytest.mark.parametrize("kind", ["slowed", "other_rows", "for_consumer", None])
@pytest.mark.parametrize("own", ["error", "slow"])
def test_options_are_those_that_the_plan_of_the_job_alone_has_not(
    own: str, kind: str | None, rate: float | None
) -> None:
    """A job that slows down by itself needs no word for it, nor one whose plan for the consumer changes nothing."""
    alone = SimpleNamespace(
        loaded=SimpleNamespace(job=SimpleNamespace(when_over_limit=own)),
        events=[SimpleNamespace(kind="slowed")],
    )
    kinds = ["stretched", *([kind] if kind else [])]
    found = SimpleNamespace(events=[SimpleNamespace(kind=each) for each in kinds])
    words = RowsForConsumer("ur-servoj", alone.loaded, rate).options(alone, found).split()  # type: ignore[arg-type]
    assert words[:2] == ["--for", "ur-servoj"]
    assert ("--rate" in words) == (rate is not None)
    if rate is not None:
        assert float(words[words.index("--rate") + 1]) == pytest.approx(rate, rel=1e-14)
    assert (words[-2:] == ["--set", "when_over_limit=slow"]) == (own == "error" and kind is not None)


def test_rates_are_those_of_stamps_as_exact_as_they_stand(tmp_path: Path) -> None:
    """At 1000 / 3 Hz, at 100 Hz less what nine decimals round, and at 100.01 Hz."""
    for rate, wanted in ((1000 / 3, 1000 / 3), (100 * (1 - 1e-8), 100.0), (100.01, 100.01)):
        rates = found(tmp_path, np.arange(int(0.6 * rate) + 1) / rate)
        assert rates["ros-jtc"] == [None, pytest.approx(wanted, rel=1e-9)]
        assert (rates["ros-jtc"][1] == 100.0) == (wanted == 100.0)
