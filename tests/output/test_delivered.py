"""Plans as they are delivered: what the job or the caller says of consumer, form and rows counts, and what is strict."""

from __future__ import annotations

import json
from typing import Any

import pytest

from trajcli.errors import TrajcliError, VerificationError
from trajcli.job.read import LoadedJob, job_from_text
from trajcli.kinematics.robot import point_mass
from trajcli.output.delivery.delivered import delivered, plan_of, report_as_delivered
from trajcli.streams.formats import FORMATS

UR: dict[str, Any] = {
    "version": 1,
    "robot": "ur5e",
    "limits": {"acceleration": 5, "jerk": 300},
    "start": {"joints": [0, -1.2, 1.1, 0.2, 0.4, 0]},
    "moves": [{"planner": "quintic", "to": {"joints": [0.5, -1, 1, 0.2, 0.4, 0.3]}, "duration": 2}],
}
COARSE: dict[str, Any] = {
    "version": 1,
    "robot": {"joints": 1},
    "limits": {"velocity": 2, "acceleration": 8, "jerk": 40},
    "start": {"joints": [0]},
    "moves": [{"planner": "jerk_limited", "to": {"joints": [1]}}],
    "output": {"rate": 7},
}


def read(job: dict[str, Any], **output: Any) -> LoadedJob:
    return job_from_text(json.dumps({**job, "output": {**job.get("output", {}), **output}}))


def refused(*given: Any, **named: Any) -> str | None:
    """Return the error by which a plan is refused; None where it is delivered."""
    try:
        assert delivered(*given, **named)[0].verdict.passed
    except VerificationError as error:
        return error.problems[0].message
    return None


def test_a_consumer_that_the_job_names_brings_its_rows_and_one_that_is_asked_for_goes_before_it() -> None:
    """At 500 Hz of the UR; a goal of ROS has knots, and no rate of its own."""
    own = read(UR, **{"for": "ur-servoj"})
    assert plan_of(own).loaded.job.output.rate == 500
    other = plan_of(own, "ros-jtc").loaded.job.output
    assert (other.consumer, other.rows) == ("ros-jtc", None)
    assert plan_of(read(UR)).loaded.job.output.rate == 1000


def test_rows_are_the_consumers_unless_the_caller_says_where_they_stand() -> None:
    asked = read(UR, rows="knots")
    assert delivered(asked, "ros-jtc", rows=True)[0].loaded.job.output.rows == "knots"
    assert delivered(asked, "ros-jtc")[0].loaded.job.output.rows is None


def test_what_is_strict_is_refused_by_rows_that_pass_a_limit_between_them() -> None:
    """At seven rows per second a quintic does not follow a jerk that switches; a message has a point at each switch."""
    loaded = read(COARSE)
    assert delivered(loaded)[0].events == ()
    said = refused(loaded, strict=True)
    assert said is not None
    assert "joined between them, pass the limit of the jerk of j1" in said
    assert refused(loaded, form=FORMATS["ros"], strict=True) is None
    assert refused(read(COARSE, rows="knots"), strict=True) is None


@pytest.mark.parametrize(("form", "delivers"), [("csv", False), ("ros", True)])
def test_rows_for_a_consumer_are_judged_in_the_form_in_which_they_are_written(
    form: Any, delivers: bool
) -> None:
    said = refused(read(COARSE), "ros-jtc", FORMATS[form])
    assert (said is None) == delivers


def test_events_for_a_consumer_are_refused_where_all_is_strict() -> None:
    """The motion is slowed for its rows, and that is an event."""
    loaded = read({**COARSE, "when_over_limit": "slow"}, rate=50)
    plan, _ = delivered(loaded, "ros-jtc", rows=True)
    assert {event.kind for event in plan.events} & {"slowed", "other_rows", "for_consumer"}
    assert refused(loaded, "ros-jtc", rows=True, strict=True) is not None


def test_warnings_of_a_consumers_rules_are_errors_where_all_is_strict() -> None:
    moving = {**UR, "robot": "fr3", "limits": {}}
    moving["start"] = {"joints": [0, -0.3, 0, -2.0, 0, 1.8, 0.5]}
    moving["moves"] = [
        {
            "planner": "quintic",
            "to": {"joints": [0.5, 0, 0.2, -1.7, 0.2, 2.0, 0.2], "velocity": [0.01, 0, 0, 0, 0, 0, 0]},
            "duration": 2,
        }
    ]
    loaded = read(moving)
    assert refused(loaded, "franka-fr3") is None
    assert (refused(loaded, "franka-fr3", strict=True) or "").startswith(
        "fr3-rest-end: at its end, at t = 2 s"
    )


@pytest.mark.parametrize(("rate", "expected"), [(50, "fixed"), (1000, "full")])
def test_every_bit_is_written_where_nine_decimals_are_few(rate: float, expected: str) -> None:
    """The jerk of a quintic over h has 60 / h^3 times the rounding of its ends: 60 of 20 rad/s^3 in a millisecond."""
    limits = {"velocity": 0.1, "acceleration": 1, "jerk": 20}
    jerky = {**UR, "robot": {"joints": 1}, "limits": limits, "start": {"joints": [0]}}
    jerky["moves"] = [{"planner": "quintic", "to": {"joints": [0.1]}, "duration": 3}]
    assert delivered(read(jerky, rate=rate), "ros-jtc", rows=True)[1] == expected
    assert delivered(read(jerky, rate=rate))[1] == "fixed"


HEAVY: dict[str, Any] = {
    "version": 1,
    "robot": {
        "convention": "standard",
        "joints": [
            {
                "a": 1.0, "velocity": 1, "acceleration": 2, "jerk": 20, "effort": 60,
                "link": {"mass": 4, "com": [-0.5, 0, 0], "inertia": [0.01, 0.1, 0.1, 0, 0, 0]},
            }
        ],
    },
    "gravity": [0, -9.81, 0],
    "limits": {"effort": "robot"},
    "start": {"joints": [0]},
    "moves": [{"planner": "hold", "duration": 1}],
}  # fmt: skip


@pytest.mark.parametrize("profile", [None, "ros-jtc"])
def test_what_the_tool_carries_instead_is_carried_for_a_consumer_too(profile: str | None) -> None:
    """9.81 (4 kg at 0.5 m and m at 1 m) against 60 N m: 4 kg may be held, 5 kg not."""

    def carrying(mass: float) -> Any:
        return lambda _, __: point_mass(mass)

    def held(mass: float) -> bool:
        try:
            return plan_of(read(HEAVY), profile, carrying(mass)).verdict.passed
        except TrajcliError:
            return False

    assert [held(mass) for mass in (0.1, 4.0, 4.2, 5.0)] == [True, True, False, False]


def test_the_report_has_the_rows_and_the_rules_of_the_consumer() -> None:
    report = report_as_delivered(plan_of(read(UR), "ros-jtc"))
    assert report.rows is not None
    assert report.consumer is not None
    assert (report.rows.verdict, report.consumer.profile, report.consumer.accepted) == (
        "satisfied",
        "ros-jtc",
        True,
    )
    alone = report_as_delivered(plan_of(read(COARSE)))
    assert alone.rows is not None
    assert alone.rows.worst is not None
    assert (alone.rows.worst.kind, abs(alone.rows.worst.limit)) == ("jerk", 40)
    assert abs(alone.rows.worst.value) > 40
    (event,) = alone.events
    assert event.message.endswith("`--rows knots` keeps every limit")
    assert alone.consumer is None
