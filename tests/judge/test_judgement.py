"""What a judgement says as a whole: by severity and certainty, the worst first, and of rows of a verified motion."""

from __future__ import annotations

from dataclasses import replace
from itertools import permutations
from typing import Any

import pytest

from trajcli.findings import Finding
from trajcli.judge.judgement import Judgement, as_joined, as_planned, worst_first
from trajcli.limits.tolerances import JOINED_RELATIVE


def finding(value: float = 2.0, **fields: Any) -> Finding:
    given: dict[str, Any] = {"kind": "velocity", "joint": "j1", "limit": 1.0, "time": 0.5, "message": "fast"}
    return Finding(**{**given, "value": value, **fields})


WARNING = finding(severity="warning")
ROUNDED = finding(certainty="within rounding")
CERTAIN = finding()


@pytest.mark.parametrize(
    ("found", "verdict", "errors"),
    [
        ((), "satisfied", 0),
        ((WARNING,), "satisfied", 0),
        ((ROUNDED,), "within rounding", 0),
        ((CERTAIN,), "exceeded", 1),
        ((WARNING, ROUNDED), "within rounding", 0),
        ((WARNING, ROUNDED, CERTAIN, CERTAIN), "exceeded", 2),
        ((finding(severity="warning", certainty="within rounding"), WARNING), "satisfied", 0),
    ],
)
def test_errors_make_the_verdict_and_the_certain_ones_fail(found, verdict, errors) -> None:
    for order in permutations(found):
        judgement = Judgement(order, "linear", 3)
        assert judgement.verdict == verdict
        assert judgement.passed == (verdict != "exceeded")
        assert len(judgement.errors) == errors


def test_the_worst_comes_first() -> None:
    far, later = finding(3.0), finding(2.0, time=0.9)
    order = (far, CERTAIN, later, ROUNDED, WARNING)
    for mixed in permutations(order):
        assert worst_first(mixed) == order


def planned(*found: Finding) -> Judgement:
    judgement = as_planned(Judgement(found, "cubic", 9), 1e-5)
    assert judgement.planned_rows is True
    assert judgement.verdict == "satisfied"
    return judgement


@pytest.mark.parametrize(("value", "told"), [(1 + 2e-5, True), (1 + 0.5e-5, False), (-1 - 2e-5, True)])
def test_what_joined_rows_of_a_verified_motion_pass_is_a_warning_and_an_event(
    value: float, told: bool
) -> None:
    judgement = planned(finding(value, limit=1.0 if value > 0 else -1.0, rule="limit"))
    assert [each.severity for each in judgement.findings] == ["warning"] * told
    assert len(judgement.events) == told
    assert all(event.startswith("joined_over_limit") for event in judgement.events)


@pytest.mark.parametrize("rule", ["continuity", "derivative", "time"])
def test_rows_of_a_verified_motion_have_no_jumps_whatever_their_rate(rule: str) -> None:
    assert planned(finding(rule=rule)).findings == ()
    assert planned(finding(rule=rule, severity="warning")).findings != ()


def test_of_rows_of_a_verified_motion_what_is_further_beyond_its_limit_comes_first() -> None:
    """Whether it was an error or a warning before."""
    error, warning = finding(2.0, rule="limit"), finding(3.0, rule="limit", severity="warning")
    assert [each.value for each in planned(error, warning).findings] == [3.0, 2.0]


@pytest.mark.parametrize(("beyond", "told"), [(2.0, True), (0.5, False)])
def test_joined_rows_may_be_so_far_above_a_limit(beyond: float, told: bool) -> None:
    found = finding(1 + beyond * JOINED_RELATIVE, rule="limit")
    judgement = as_planned(Judgement((found,), "cubic", 9))
    assert (len(judgement.findings), len(judgement.events)) == (told, told)
    assert as_joined(Judgement((found,), "cubic", 9)).planned_rows is True


def test_a_judgement_says_in_json_what_it_knows() -> None:
    bare = Judgement((), "linear", 3).as_json()
    assert bare == {
        "verdict": "satisfied",
        "findings": [],
        "interpolation": "linear",
        "rows": 3,
        "notes": [],
        "events": [],
    }
    whole = Judgement(
        (finding(rounding=0.25),),
        "cubic",
        3,
        0.01,
        None,
        ("n",),
        ("e",),
        planned_rows=False,
        planned_with="--for x",
    ).as_json()
    (one,) = whole.pop("findings")
    assert (one["rounding"], one["value"], one["limit"], one["joint"]) == (0.25, 2.0, 1.0, "j1")
    said = {"period": 0.01, "planned_rows": False, "planned_with": "--for x", "notes": ["n"], "events": ["e"]}
    assert whole == {"verdict": "exceeded", "interpolation": "cubic", "rows": 3, **said}


def test_what_rounding_explains_of_a_verified_motion_is_nothing() -> None:
    assert planned(finding(rule="limit", certainty="within rounding")).findings == ()


def test_what_rounding_explains_is_nothing_where_a_consumer_joins_them_either() -> None:
    """What a limit is passed by between them is an error, as much as it is."""
    explained, passed = finding(rule="limit", certainty="within rounding"), finding(rule="limit")
    joined = as_joined(Judgement((explained, passed), "cubic", 2))
    assert (joined.findings, joined.verdict) == ((passed,), "exceeded")
    assert as_joined(Judgement((explained,), "cubic", 2)).verdict == "satisfied"


@pytest.mark.parametrize("rule", ["limit", "path"])
def test_of_joined_rows_what_is_just_above_a_limit_is_nothing(rule: str) -> None:
    """Certain or not: knots stand in whole nanoseconds. Of a limit of zero there is no share: what is certain counts."""
    near, far = finding(1 + 0.5e-5, rule=rule), finding(1 + 2e-5, rule=rule)
    rounded, nothing = (finding(limit=limit, rule=rule, certainty="within rounding") for limit in (1.0, 0.0))
    zero, unlimited = finding(limit=0.0, rule=rule), replace(rounded, limit=None)
    found = as_joined(Judgement((near, rounded, far, nothing, zero, unlimited), "cubic", 2)).findings
    assert found == (far, zero, unlimited)


@pytest.mark.parametrize("limit", [-1.0, 1.0])
@pytest.mark.parametrize("beyond", [-0.01, 0.01])
def test_joined_rows_beyond_an_end_of_a_range_are_so_on_either_side_of_zero(
    limit: float, beyond: float
) -> None:
    """Such as beyond -0.07 rad, the upper end of the fourth joint of a Panda."""
    found = finding(limit + beyond, kind="position", limit=limit, rule="limit")
    assert as_joined(Judgement((found,), "cubic", 2)).verdict == "exceeded"
    (event,) = planned(found).events
    assert event.endswith("pass the limit of the position of j1, by a factor of 1.01")


@pytest.mark.parametrize("rule", ["continuity", "derivative", "time", "state", "franka-jerk"])
@pytest.mark.parametrize("value", [0.5, 1 + 1e-9, 2.0])
def test_of_joined_rows_everything_but_limits_is_judged_as_of_any_others(rule: str, value: float) -> None:
    """Whatever number stands beside which, as of a distance that is too short, and whatever rounding explains."""
    for certainty in ("exceeded", "within rounding"):
        judgement = Judgement((finding(value, rule=rule, certainty=certainty),), "cubic", 2)
        assert as_joined(judgement).findings == judgement.findings


def test_the_worst_of_what_is_passed_is_named() -> None:
    tool = finding(3.0, rule="limit", kind="tool_speed", joint=None)
    (event,) = planned(finding(rule="limit"), tool).events
    assert event.endswith("pass the limit of the speed of the tool, by a factor of 3")
    (event,) = planned(finding(rule="limit")).events
    assert event.endswith("pass the limit of the velocity of j1, by a factor of 2")
    (event,) = planned(finding(rule="path", kind="deviation", joint=None)).events
    assert "pass the tolerance of the path of the tool" in event
    assert planned(finding(rule="state", kind="start")).events == ()
