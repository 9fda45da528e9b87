"""What a consumer makes of `output` of a job, which of the two goes before, and how broken rules are said."""

from __future__ import annotations

import json
from typing import Any

import pytest

from trajcli.consumers.judgement import ProfileJudgement, load_profile
from trajcli.errors import InputError
from trajcli.findings import Finding
from trajcli.job.read import LoadedJob, job_from_text
from trajcli.output.consumer import consumer_report, counted, job_for, refusal_of
from trajcli.planning.plan import Plan, plan_job

ALL = ("t", "q", "qd", "qdd")


def read(**output: Any) -> LoadedJob:
    hold = {"planner": "hold", "duration": 1}
    job = {
        "version": 1,
        "robot": {"joints": 1},
        "start": {"joints": [0]},
        "moves": [hold] * 3,
        "output": output,
    }
    return job_from_text(json.dumps(job, indent=1))


@pytest.mark.parametrize(
    ("name", "output", "kept", "wanted"),
    [
        # asked for on the command line, it goes before the job
        ("ros-jtc", {"rows": "knots", "rate": 50, "columns": ["t", "q"]}, {}, (None, 50, None, False, ALL, True)),
        ("ros-jtc", {"rows": "knots", "columns": ["t", "q"]}, {"rows": True}, ("knots", None, None, False, ALL, True)),
        ("ros-jtc", {"rate": 50, "columns": list(ALL)}, {}, (None, 50, None, False, ALL, False)),
        ("ros-jtc", {"times": [0, 1]}, {}, (None, None, (0, 1), False, ALL, False)),
        ("ur-servoj", {"rate": 125}, {}, ("rate", 500, None, True, ALL, True)),
        ("ur-servoj", {"rows": "both"}, {}, ("rate", 500, None, True, ALL, True)),
        ("ur-servoj", {"rows": "rate", "rate": 500}, {"rows": True, "rate": True}, ("rate", 500, None, True, ALL, False)),
        ("ur-servoj", {"times": [0, 1]}, {}, ("rate", 500, None, True, ALL, True)),
        ("ur-servoj", {"align": False}, {}, ("rate", 500, None, True, ALL, True)),
        ("ur-passthrough", {"times": [0, 1]}, {}, (None, None, None, True, ALL, True)),
        ("ur-passthrough", {"for": "ur-servoj", "rate": 50}, {}, (None, 50, None, True, ALL, False)),
        # named by the job, it goes behind what the job says of its rows
        (None, {"for": "ros-jtc", "rows": "knots", "columns": ["t", "q"]}, {}, ("knots", None, None, False, ("t", "q"), False)),
        (None, {"for": "ros-jtc", "rate": 50}, {}, (None, 50, None, False, ALL, False)),
        (None, {"for": "ur-servoj"}, {}, ("rate", 500, None, True, ALL, False)),
        (None, {"for": "ur-servoj", "align": False, "rate": 500}, {}, ("rate", 500, None, False, ALL, False)),
        (None, {"for": "ur-passthrough", "align": True}, {}, (None, None, None, True, ALL, False)),
        (None, {"for": "ur-passthrough", "times": [0, 1]}, {}, (None, None, (0, 1), False, ALL, False)),
    ],
)  # fmt: skip
def test_rows_are_as_their_consumer_takes_them_or_as_they_are_said(
    name: str | None, output: dict[str, Any], kept: dict[str, bool], wanted: tuple[Any, ...]
) -> None:
    loaded, profile, said = job_for(read(**output), name, kept)
    made, default = loaded.job.output, read().job.output.rate
    rows, rate, times, align, columns, before = wanted
    assert made.consumer == profile.name == (name or output["for"])
    assert (made.rows, made.rate) == (rows, default if rate is None else rate)
    assert made.times == (None if times is None else pytest.approx(times))
    assert (made.align, tuple(made.columns)) == (align, columns)
    assert said == (
        f"{profile.name} takes {profile.rows.words}: that goes before `output` of the job" if before else ""
    )


@pytest.mark.parametrize(
    ("name", "output", "kept", "asked", "key"),
    [
        ("ur-servoj", {"rate": 125}, {"rate": True}, "125 Hz", "rate"),
        ("franka-fr3", {"rate": 2000}, {"rate": True}, "2000 Hz", "rate"),
        ("ur-servoj", {"rows": "both"}, {"rows": True}, "`rows: both`", "rows"),
        ("ur-servoj", {"rows": "knots"}, {"rows": True}, "`rows: knots`", "rows"),
        (None, {"for": "ur-servoj", "rows": "knots"}, {}, "`rows: knots`", "rows"),
        (None, {"for": "ur-servoj", "rate": 125}, {}, "125 Hz", "rate"),
        (None, {"for": "ur-servoj", "times": [0, 1]}, {}, "`times`", "times"),
    ],
)
def test_rows_at_other_times_than_a_rate_are_refused_at_their_place_and_the_hint_helps(
    name: str | None, output: dict[str, Any], kept: dict[str, bool], asked: str, key: str
) -> None:
    loaded = read(**output)
    with pytest.raises(InputError) as caught:
        job_for(loaded, name, kept)
    (problem,) = caught.value.problems
    rate = load_profile(name or output["for"]).rows.rate
    assert problem.message == f"{name or output['for']} takes rows at {rate:g} Hz, and {asked} is asked for"
    assert problem.hint == f"leave the {key} out"
    assert problem.place == loaded.document.place(("output", key))
    job_for(read(**{k: value for k, value in output.items() if k != key}), name, {**kept, key: False})


def test_a_consumer_that_nobody_knows_is_refused_where_it_is_named() -> None:
    loaded = read(**{"for": "nobody"})
    with pytest.raises(InputError, match="nobody") as caught:
        job_for(loaded, None, {})
    assert caught.value.problems[0].place == loaded.document.place(("output", "for"))
    with pytest.raises(InputError, match="somebody") as caught:
        job_for(loaded, "somebody", {})
    assert caught.value.problems[0].place is None


@pytest.mark.parametrize(("count", "words"), [(1, ""), (2, " (and 1 more row)"), (3, " (and 2 more rows)")])
def test_rows_that_break_a_rule_are_counted(count: int, words: str) -> None:
    assert counted(Finding("velocity", count=count)) == words


def judged() -> tuple[Plan, ProfileJudgement]:
    """Return a plan of three moves of a second from 7 s on, and what its rows are said to do."""
    plan = plan_job(read(start_time=7))
    broken = Finding(
        "velocity", time=8.5, row=40, rule="jtc-a", count=2, message="too fast", method="differences"
    )
    warned = Finding(
        "state", time=9.0, row=60, rule="jtc-b", severity="warning", message="not still", method="exact"
    )
    said = Finding(
        "state", time=7.0, move=1, row=1, rule="jtc-c", severity="warning", message="odd", method="exact"
    )
    unjudged = (("jtc-d", "nothing says it"), ("jtc-e", "nor that"))
    return plan, ProfileJudgement(load_profile("ros-jtc"), (broken, warned, said), unjudged)


def test_broken_rules_are_said_of_their_moves() -> None:
    """At a border of the later one, unless the finding says which."""
    plan, found = judged()
    for strict, rules, moves in ((False, ["jtc-a"], [1]), (True, ["jtc-a", "jtc-b", "jtc-c"], [1, 2, 1])):
        refused = refusal_of(plan, found, strict=strict)
        assert refused is not None
        assert [problem.kind for problem in refused.problems] == rules
        assert [problem.move for problem in refused.problems] == moves
        assert [problem.place for problem in refused.problems] == [
            plan.loaded.place_of_move(move) for move in moves
        ]
        assert refused.problems[0].message == "jtc-a: too fast (and 1 more row)"
        assert refused.problems[0].time == 1.5
    harmless = ProfileJudgement(found.profile, found.findings[1:], ())
    assert refusal_of(plan, harmless, strict=False) is None
    assert refusal_of(plan, ProfileJudgement(found.profile, (), ()), strict=True) is None


def test_a_report_counts_times_from_the_start_of_the_motion() -> None:
    plan, found = judged()
    report = consumer_report(plan, found)
    assert (report.profile, report.accepted) == ("ros-jtc", False)
    assert [(each.rule, each.move, each.time, each.row, each.count) for each in report.findings] == [
        ("jtc-a", 1, 1.5, 40, 2),
        ("jtc-b", 2, 2.0, 60, 1),
        ("jtc-c", 1, 0.0, 1, 1),
    ]
    assert [(each.rule, each.reason) for each in report.unjudged] == list(found.unjudged)
    assert consumer_report(plan, ProfileJudgement(found.profile, found.findings[1:], ())).accepted
