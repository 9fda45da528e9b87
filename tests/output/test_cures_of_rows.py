"""Other rows of a motion, as a cure says them: they are those of the job that follows it, and keep the limits."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import yaml
from joined_by_scipy import largest_share

from trajcli.grids import ListedGrid, UniformGrid
from trajcli.job.read import job_from_text
from trajcli.output.delivery import joined
from trajcli.output.delivery.joined import (
    joined_rows,
    keeps,
    rate_that_keeps,
    rows_report,
    rows_that_keep,
    with_event,
)
from trajcli.output.delivery.joined_rows import JoinedRows
from trajcli.output.write import grid_of
from trajcli.planning.plan import Plan, plan_job
from trajcli.streams.formats import FORMATS

JOB: dict[str, Any] = {
    "version": 1,
    "robot": {"joints": 2},
    "limits": {"velocity": 2, "acceleration": 8, "jerk": 40},
    "start": {"joints": [0, 1]},
    "moves": [
        {"planner": "jerk_limited", "to": {"joints": [1, 0.3]}},
        {"planner": "septic", "to": {"joints": [1, 0.5]}},
    ],
}
ONE = {**JOB, "moves": JOB["moves"][:1]}
STATES = ["t", "q", "qd", "qdd"]
CUBICS = '--set "output.columns=[t, q, qd]"'
QUINTICS = '--set "output.columns=[t, q, qd, qdd]"'
MOVES = [option.replace("]", ", move]") for option in (CUBICS, QUINTICS)]


@cache
def _planned(text: str) -> Plan:
    return plan_job(job_from_text(text))


def planned(job: dict[str, Any], output: dict[str, Any]) -> Plan:
    return _planned(json.dumps({**job, "output": output}))


def rows_of(job: dict[str, Any], output: dict[str, Any], form: Any) -> JoinedRows:
    plan = planned(job, output)
    return joined_rows(plan, grid_of(plan), FORMATS[form])


def followed(output: dict[str, Any], options: str) -> dict[str, Any]:
    """Return what a job says of its output with the options of `trajcli plan` that a cure names."""
    said = dict(output)
    for kind, value, columns in re.findall(r'--(\w+) (?:"output\.columns=(.*?)"|(\S+))', options):
        said |= {"columns": yaml.safe_load(value)} if kind == "set" else {kind: yaml.safe_load(columns)}
    return said


def times(rows: JoinedRows) -> np.ndarray:
    return np.concatenate([written for written, _ in rows.grid.blocks()])


@pytest.mark.parametrize(
    ("form", "rows", "columns", "cures"),
    [
        ("csv", None, STATES, ["--rows knots", f"--rows knots {CUBICS}", CUBICS, "--rate 100"]),
        (
            "csv",
            "rate",
            ["t", "q", "qd"],
            ["--rows knots", f"--rows knots {QUINTICS}", QUINTICS, "--rate 100"],
        ),
        (
            "npy",
            None,
            ["t", "move", "q"],
            ["--rows knots", *(f"--rows knots {MOVES[k]}" for k in (1, 0)), MOVES[1], "--rate 100"],
        ),
        (
            "csv",
            None,
            ["t", "qd"],
            [f"--rows knots {QUINTICS}", f"--rows knots {CUBICS}", QUINTICS, "--rate 100"],
        ),
        ("csv", "knots", STATES, [CUBICS]),
        ("csv", "knots", ["t", "q", "qd"], [QUINTICS]),
        ("csv", "both", ["t", "q", "qd"], [QUINTICS]),
        ("csv", "both", [*STATES, "move"], [MOVES[0]]),
        ("mcap", None, ["t", "q", "qd"], ["--rows knots", "--rate 100"]),
        ("mcap", None, STATES, ["--rows knots", "--rate 100"]),
        ("ros", None, STATES, [CUBICS]),
        ("ros", "knots", ["t", "q", "qd"], []),
        ("ros", "rate", STATES, ["--rows knots", CUBICS, "--rate 100"]),
    ],
)
def test_rows_that_a_cure_names_are_those_of_the_job_that_follows_it(
    form: Any, rows: str | None, columns: list[str], cures: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Their number, their times and what joins them: cubics have more knots than quintics."""
    output = {"columns": columns, "rate": 50, "start_time": 2.5, **({"rows": rows} if rows else {})}
    monkeypatch.setattr(joined, "keeps", lambda rows: True)
    others = list(rows_that_keep(rows_of(JOB, output, form), FORMATS[form]))
    assert [other.options for other in others] == cures
    for other in others:
        made = rows_of(JOB, followed(output, other.options), form)
        assert {*columns} - {*STATES} <= {
            *followed(output, other.options)["columns"]
        }  # what a job asks for stays
        assert times(other.rows).tolist() == times(made).tolist()
        assert (other.rows.groups, other.rows.interpolation) == (made.groups, made.interpolation)
        assert other.rows.grid.start_time == 2.5


def test_rows_of_the_tool_alone_and_at_listed_times_have_few_others(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(joined, "keeps", lambda rows: True)
    listed = rows_of(JOB, {"columns": ["t", "q"], "times": [0, 0.5, 0.75]}, "csv")
    assert isinstance(listed.grid, ListedGrid)
    assert [other.options for other in rows_that_keep(listed)] == [QUINTICS]
    tool = replace(listed, groups=("t", "pose"), plan=planned(JOB, {"columns": STATES}))
    assert "--rate" not in " ".join(other.options for other in rows_that_keep(tool))


@pytest.mark.parametrize(
    ("form", "rows", "columns", "groups", "at_knots", "exact"),
    [
        ("csv", None, ["t", "q", "move"], ["t", "q", "move"], False, False),
        ("npy", None, ["t", "q", "qd"], ["t", "q", "qd"], False, True),
        ("csv", "knots", ["t", "q"], ["t", "q"], True, False),
        ("mcap", None, ["t", "q", "qd"], STATES, False, True),
        ("ros", None, ["t", "q", "qd", "move"], ["t", "q", "qd"], True, True),
        ("ros", "rate", ["t", "q", "qd"], ["t", "q", "qd"], False, True),
        ("ros-goal", None, ["t", "q"], STATES, True, True),
    ],
)
def test_rows_are_judged_as_their_format_writes_them(
    form: Any, rows: str | None, columns: list[str], groups: list[str], at_knots: bool, exact: bool
) -> None:
    """A log has all states, a message those of its columns, at knots unless a rate is asked for; both every bit."""
    output = {"columns": columns, "rate": 50, "start_time": -1.5, **({"rows": rows} if rows else {})}
    made = rows_of(JOB, output, form)
    assert (list(made.groups), made.exact) == (groups, exact)
    assert isinstance(made.grid, UniformGrid) != at_knots
    assert times(made)[0] == -1.5
    assert joined_rows(made.plan, grid_of(made.plan), FORMATS[form], "full").exact


@pytest.mark.parametrize(
    ("rate", "needed", "duration", "found"),
    [
        (50.0, 50.0, 2.0, 100.0),  # the next one
        (50.0, 101.0, 2.0, 200.0),
        (50.0, 800.0, 2.0, 800.0),  # sixteen times it
        (50.0, 801.0, 2.0, None),
        (1000.0, 7000.0, 2.0, 8000.0),  # no controller takes rows at more than 8 kHz
        (1001.0, 7000.0, 2.0, None),
        (500.0, 900.0, 200.0, 1000.0),  # 200,000 rows
        (500.0, 900.0, 201.0, None),
    ],
)
def test_rates_that_are_tried(
    rate: float, needed: float, duration: float, found: float | None, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two, four, eight and sixteen times the rate, the lowest first, with the same start and end."""
    tried: list[UniformGrid] = []
    monkeypatch.setattr(joined, "keeps", lambda rows: tried.append(rows.grid) or rows.grid.rate >= needed)
    given = JoinedRows(SimpleNamespace(), UniformGrid(duration, rate, -3.0), ("t", "q"))  # type: ignore[arg-type]
    assert rate_that_keeps(given) == found
    assert [grid.rate for grid in tried] == [rate * 2**k for k in range(1, 1 + len(tried))]
    assert {(grid.duration, grid.start_time) for grid in tried} <= {(duration, -3.0)}


def test_a_rate_whose_rows_show_equal_times_is_none_that_keeps(monkeypatch: pytest.MonkeyPatch) -> None:
    """Since 1970, at 10^6 s of a float64 that tells a tenth of a microsecond apart."""
    monkeypatch.setattr(joined, "keeps", lambda rows: False)
    given = JoinedRows(SimpleNamespace(), UniformGrid(1.0, 500.0, 1.7e12), ("t", "q"))  # type: ignore[arg-type]
    assert rate_that_keeps(given) is None


@pytest.mark.parametrize(("columns", "cure"), [(STATES, "--rows knots"), (["t", "q", "qd"], "--rows knots")])
def test_a_cure_that_is_named_cures_by_scipy(columns: list[str], cure: str) -> None:
    """At 7 Hz the rows do not follow a jerk that switches; the worst finding is that of the report."""
    output = {"columns": columns, "rate": 7}
    plan = planned(ONE, output)
    rows = rows_of(ONE, output, "csv")
    shown, judged = with_event(plan, rows, FORMATS["csv"])
    assert judged is not None
    (event,) = shown.events
    assert (event.kind, event.message.rpartition("; ")[2]) == (
        "joined_over_limit",
        f"`{cure}` keeps every limit",
    )
    share = largest_share(plan, grid_of(plan), 1e-4)
    report = rows_report(rows, judged)
    assert report.worst is not None
    assert report.verdict == "exceeded"
    assert report.worst.value / report.worst.limit == pytest.approx(share, rel=2e-3)
    cured = planned(ONE, followed(output, cure))
    assert largest_share(cured, grid_of(cured), 1e-4) < 1 + 1e-4
    assert with_event(cured, rows_of(ONE, followed(output, cure), "csv"), FORMATS["csv"])[0].events == ()


@pytest.mark.parametrize(
    ("jerk", "columns", "rate", "kept"),
    [
        ([900, None], STATES, 50, False),
        ([None, None], STATES, 50, True),
        ([900, None], STATES[:3], 50, True),  # whoever asks for these knows that the acceleration steps
        ([None, None], STATES, 1.5, False),
    ],
)
def test_cubics_instead_of_quintics_keep_no_limit_of_the_jerk(
    jerk: list[float | None], columns: list[str], rate: float, kept: bool
) -> None:
    """Of a slow quintic, far within its limits; with 1.5 rows in a second the acceleration is too high."""
    move = {"planner": "quintic", "to": {"joints": [1, 0.3]}, "duration": 1.9}
    job = {**JOB, "limits": {"velocity": 1.1, "acceleration": 1.7, "jerk": jerk}, "moves": [move]}
    rows = rows_of(job, {"columns": columns, "rate": rate}, "csv")
    assert keeps(replace(rows, groups=("t", "q", "qd"))) == kept


def test_cubics_with_rows_where_the_jerk_switches_are_the_motion() -> None:
    """Every 0.2 s: a/j = v/a = 0.2 s, and 1.6 s at the velocity."""
    limits = {"velocity": 1, "acceleration": 5, "jerk": 25}
    move = {"planner": "jerk_limited", "to": {"joints": [2, 1]}}
    job = {**JOB, "limits": limits, "moves": [move]}
    for rate, kept in ((10, True), (9, False)):
        rows = rows_of(job, {"columns": STATES, "rate": rate}, "csv")
        assert keeps(replace(rows, groups=("t", "q", "qd"))) == kept


def test_where_nothing_helps_the_event_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """A message is of knots or rows of its columns: that quintics would help is no cure of one without accelerations."""
    monkeypatch.setattr(joined, "keeps", lambda rows: rows.interpolation == "quintic")
    rows = rows_of(ONE, {"columns": STATES[:3], "rate": 7, "rows": "rate"}, "ros")
    (event,) = with_event(rows.plan, rows, FORMATS["ros"])[0].events
    assert event.message.endswith("; neither its knots nor higher rates cure that")
    (event,) = with_event(rows.plan, rows, FORMATS["csv"])[0].events
    assert event.message.endswith(f"`--rows knots {QUINTICS}` keeps every limit")


def test_a_motion_of_months_has_no_knots(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its nanoseconds are more than the whole numbers of a float64."""
    monkeypatch.setattr(joined, "keeps", lambda rows: True)
    job = {**JOB, "moves": [{"planner": "quintic", "to": {"joints": [1, 0.3]}, "duration": 2**53 / 1e9 + 1}]}
    rows = rows_of(job, {"columns": STATES, "rate": 0.001}, "csv")
    assert [other.options for other in rows_that_keep(rows)] == [CUBICS, "--rate 0.002"]
