"""Why rows are not written for a consumer: the worst of what they pass, by scipy's curves, and how little is too much."""

from __future__ import annotations

import json
import re
from typing import Any

import numpy as np
import pytest
from joined_by_scipy import largest_share
from scipy.interpolate import BPoly

from trajcli.errors import InputError, VerificationError
from trajcli.job.read import LoadedJob, job_from_text
from trajcli.kinematics.robot import point_mass
from trajcli.output.consumer import job_for
from trajcli.output.delivery.delivered import delivered
from trajcli.output.delivery.for_consumer import ForConsumer, Writing, _Search, plan_for, refusal, rows_for
from trajcli.output.write import grid_of
from trajcli.planning.plan import plan_job
from trajcli.streams.decimals import Digits

ONE: dict[str, Any] = {"version": 1, "robot": {"joints": 1}, "start": {"joints": [0]}}
SEPTIC = [{"planner": "septic", "to": {"joints": [1]}, "duration": 1}]


def read(job: dict[str, Any], **output: Any) -> LoadedJob:
    return job_from_text(json.dumps({**ONE, **job, "output": output}))


def made_for(loaded: LoadedJob, profile: str | None = None, writing: Writing | None = None) -> ForConsumer:
    return plan_for(*job_for(loaded, profile, {"rows": True}), writing or Writing())


def joined_share(job: dict[str, Any], **output: Any) -> float:
    """Return the largest share of a limit that rows use, as scipy joins them."""
    plan = plan_job(read(job, **output))
    assert plan.verdict.passed
    return largest_share(plan, grid_of(plan), 1e-6)


@pytest.mark.parametrize(("above", "delivers"), [(-1e-8, True), (2e-5, False), (5e-4, False)])
def test_rows_that_pass_a_limit_by_little_are_refused_by_more_than_rounding(
    above: float, delivers: bool
) -> None:
    """Cubics through three rows a second of the polynomial of degree seven, whose own acceleration is less."""
    output = {"for": "ros-jtc", "columns": ["t", "q", "qd"], "rate": 3}
    highest = 100 * joined_share({"limits": {"acceleration": 100}, "moves": SEPTIC}, **output)
    assert highest > 9
    loaded = read({"limits": {"acceleration": highest / (1 + above)}, "moves": SEPTIC}, **output)
    if delivers:
        assert made_for(loaded).keeps
        return
    with pytest.raises(VerificationError) as refused:
        made_for(loaded)
    (problem,) = refused.value.problems
    assert problem.value is not None
    assert abs(problem.value) == pytest.approx(highest, rel=1e-6)


MOVES = [
    {"planner": "jerk_limited", "to": {"joints": [to]}, "limits": {"jerk": jerk}}
    for to, jerk in ((1.0, 40), (0.1, 25), (1.1, 30))
]
SLOWLY = {"planner": "quintic", "to": {"joints": [1.2]}, "duration": 3}
LIMITS = {"velocity": 2, "acceleration": 8, "jerk": 50}


def largest_jerk(job: dict[str, Any], limits: list[float]) -> float:
    """Return the largest share of the jerk of scipy's quintics; between rows of two moves the looser limit is in force."""
    plan = plan_job(read(job, rate=7))
    spans, t = (
        plan.trajectory.spans,
        np.append(np.arange(0, plan.trajectory.duration, 1 / 7), plan.trajectory.duration),
    )
    rows = np.stack([plan.trajectory.curve.evaluate(t, order) for order in range(3)], axis=1)
    jerk = BPoly.from_derivatives(t, rows).derivative(3)
    owners = np.searchsorted([span.start for span in spans], t + 1e-9, "right") - 1
    bounds = np.maximum(
        np.array(limits)[owners[:-1]], np.array(limits)[np.minimum(owners[1:], len(limits) - 1)]
    )
    inside = t[:-1, None] + np.diff(t)[:, None] * np.linspace(1e-9, 1 - 1e-9, 99)
    return float((np.abs(jerk(inside)[..., 0]).max(axis=1) / bounds).max())


@pytest.mark.parametrize(("count", "begins"), [(1, 0.0), (2, 7.0), (3, -2.5)])
def test_a_refusal_names_the_worst_move_and_counts_the_others(count: int, begins: float) -> None:
    """The later a move the more of its limit it uses; the time is one of the trajectory, whenever its rows begin."""
    job = {"limits": LIMITS, "moves": [*MOVES[:count], {**SLOWLY, "to": {"joints": [2]}}]}
    loaded = read(job, rate=7, start_time=begins)
    with pytest.raises(VerificationError) as refused:
        made_for(loaded, "ros-jtc")
    (problem,) = refused.value.problems
    others = re.search(r"\(and in (\d) more move(s?)\)", problem.message)
    assert (others and (int(others[1]), others[2])) == {1: None, 2: (1, ""), 3: (2, "s")}[count]
    assert (problem.kind, problem.severity, problem.move) == ("jerk", "error", count - 1)
    assert problem.value is not None
    assert problem.limit is not None
    jerks = [float(move["limits"]["jerk"]) for move in MOVES[:count]]  # type: ignore[index]
    assert problem.value / problem.limit == pytest.approx(largest_jerk(job, [*jerks, 50.0]), rel=1e-6)
    assert problem.place == loaded.place_of_move(count - 1)
    assert problem.time is not None
    spans = plan_job(loaded).trajectory.spans
    assert spans[count - 1].start <= problem.time <= spans[count - 1].end
    assert f"at t = {problem.time + begins:.9g} s" in problem.message


def test_what_a_consumer_brings_is_said_of_rows_that_are_slowed_too() -> None:
    job = {
        "robot": "ur5e",
        "start": {"joints": [0] * 6},
        "limits": {"acceleration": 5, "jerk": 60},
        "when_over_limit": "slow",
        "moves": [{"planner": "jerk_limited", "to": {"joints": [0.5] * 6}}],
    }
    made = made_for(read(job, rate=125), "ur-servoj")
    assert made.duration > made.shortest
    assert made.said[0].startswith("ur-servoj takes rows at 500 Hz")
    assert "qdd" in made.plan.loaded.job.output.columns, "without it nobody keeps the jerk between rows"
    with pytest.raises(VerificationError) as refused:
        made_for(read({**job, "when_over_limit": "error"}, rate=125), "ur-servoj")
    advice = refused.value.problems[0].hint or ""
    assert re.fullmatch(r"`--set when_over_limit=slow` keeps all limits, with [\d.]+ s", advice), (
        "rows at another rate are not what it takes"
    )
    assert float(advice.split()[-2]) == pytest.approx(made.duration, rel=1e-5)


@pytest.mark.parametrize(("rate", "digits", "chosen"), [(200, "fixed", False), (400, "full", True)])
def test_nine_decimals_are_few_where_they_are_a_twentieth_of_a_limit(
    rate: int, digits: str, chosen: bool
) -> None:
    """60 / h^3 of the rounding of two ends: 0.48 and 3.8 of 20 rad/s^3."""
    limits = {"velocity": 0.1, "acceleration": 1, "jerk": 20}
    moves = [{"planner": "quintic", "to": {"joints": [0.1]}, "duration": 3}]
    made = made_for(read({"limits": limits, "moves": moves}, rate=rate), "ros-jtc")
    assert (made.digits, made.chosen) == (digits, chosen)
    asked = made_for(read({"limits": limits, "moves": moves}, rate=rate), "ros-jtc", Writing(digits="fixed"))
    assert (asked.digits, asked.chosen) == ("fixed", False)


@pytest.mark.parametrize("begins", [0.0, 7.0])
@pytest.mark.parametrize("when", ["error", "slow"])
def test_a_rule_that_no_slowness_keeps_is_refused_where_it_is_broken(when: str, begins: float) -> None:
    """A motion that ends moving, which the controller of ROS refuses: in its last move, at its end."""
    moves = [MOVES[0], {"planner": "quintic", "to": {"joints": [2], "velocity": [0.5]}, "duration": 2}]
    job = {"limits": LIMITS, "moves": moves, "when_over_limit": when}
    loaded = read(job, rate=7, start_time=begins)
    made = made_for(loaded, "ros-jtc")
    end = made.plan.trajectory.duration
    assert not made.keeps
    with pytest.raises(VerificationError) as delivery:
        delivered(loaded, "ros-jtc", rows=True)
    for error in (refusal(made, ()), delivery.value):
        (problem,) = error.problems
        assert (problem.kind, problem.move, problem.severity) == ("jtc-last-velocity", 1, "error")
        assert problem.message.startswith("jtc-last-velocity: ")
        assert problem.time == pytest.approx(end, abs=1e-9)
        assert problem.place == loaded.place_of_move(1)
    assert delivery.value.problems[0].hint == "end at rest, with a last velocity of exactly 0.0"


@pytest.mark.parametrize("begins", [7.0, -3.0])
def test_a_rule_that_slowness_keeps_is_refused_in_the_move_that_breaks_it(begins: float) -> None:
    """The FR3 takes 2.62 rad/s less a thousandth; a quintic of 2.2 rad reaches 15 / 8 of its mean speed, in the middle."""
    speed = 2.6195
    turns = [(-1.0, 2.0), (1.2, 15 / 8 * 2.2 / speed), (0.8, 2.0)]
    moves = [
        {"planner": "quintic", "to": {"joints": [to, -0.3, 0, -2, 0, 1.8, 0.5]}, "duration": duration}
        for to, duration in turns
    ]
    arm = {"robot": "fr3", "start": {"joints": [-1.2, -0.3, 0, -2, 0, 1.8, 0.5]}, "moves": moves}
    limits = {"velocity": 2.62, "acceleration": 10, "jerk": 4900}
    loaded = read({**arm, "limits": limits}, start_time=begins)
    for_fr3, profile, _ = job_for(loaded, "franka-fr3", {})
    made = _Search(for_fr3, profile, Writing(), None).first()
    assert [(found.rule, found.move) for found in made.over] == [("fr3-velocity", 1)]
    (problem,) = refusal(made, ()).problems
    assert (problem.kind, problem.move, problem.joint) == ("fr3-velocity", 1, "fr3_joint1")
    assert problem.place == loaded.place_of_move(1)
    assert problem.value == pytest.approx(speed, rel=1e-3)
    assert problem.time == pytest.approx(2.0 + turns[1][1] / 2, abs=0.02)


@pytest.mark.parametrize(("digits", "broken"), [("fixed", True), ("full", False)])
def test_rules_are_of_numbers_as_they_are_written(digits: Digits, broken: bool) -> None:
    """A cubic of D in N ms begins with D (3 / N^2 - 2 / N^3): 4.9996 um, of which nine decimals make 5 um, and jerk of it."""
    count = 700
    distance = 4.9996e-6 / (3 / count**2 - 2 / count**3)
    arm = [0, -0.3, 0, -2, 0, 1.8, 0.5]
    move = {"planner": "cubic", "to": {"joints": [distance, *arm[1:]]}, "duration": count / 1000}
    job = {
        "robot": "fr3",
        "start": {"joints": arm},
        "limits": {"jerk": None, "acceleration": 20},
        "moves": [move],
    }
    loaded, profile, _ = job_for(read(job), "franka-fr3", {})
    made = rows_for(plan_job(loaded), profile, Writing(digits=digits))
    assert made.plan.verdict.passed
    assert ("fr3-jerk" in [found.rule for found in made.over]) is broken


def test_what_a_consumer_brings_goes_before_the_job_where_it_is_asked_for_and_behind_where_the_job_names_it() -> (
    None
):
    ur = {"robot": "ur5e", "start": {"joints": [0] * 6}, "moves": [{"planner": "hold", "duration": 1}]}
    asked, _, said = job_for(read(ur, times=[0, 0.5]), "ur-servoj", {})
    output = asked.job.output
    assert (output.times, output.rate, output.rows, output.align) == (None, 500, "rate", True)
    assert said.endswith("that goes before `output` of the job")
    named, _, said = job_for(read(ur, **{"for": "ur-passthrough"}), None, {})
    assert (named.job.output.align, said) == (True, "")
    other, _, said = job_for(read(ur, **{"for": "ur-servoj"}), "ur-passthrough", {})
    assert (other.job.output.consumer, said) == ("ur-passthrough", "")
    for own in ({"align": False}, {"times": [0, 0.5]}):
        kept, _, _ = job_for(read(ur, **{"for": "ur-passthrough"}, **own), None, {})
        assert not kept.job.output.align
    text = json.dumps({**ONE, **ur, "output": {"for": "ur-servoj", "rate": 125}})
    with pytest.raises(InputError, match="takes rows at 500 Hz, and 125 Hz is asked for") as refused:
        job_for(job_from_text(text), None, {})
    place = refused.value.problems[0].place
    assert place is not None
    assert text[place.column - 1 :].startswith("125")


def test_a_plan_that_breaks_its_own_limits_is_as_it_is_for_any_consumer() -> None:
    """Nothing is said of its rows: it is refused for what it does itself."""
    made = made_for(read({"limits": {"velocity": 0.5}, "moves": SEPTIC}, rate=50), "ros-jtc")
    assert [finding.kind for finding in made.plan.verdict.findings] == ["velocity"]
    assert (made.joined, made.rules, made.keeps) == (None, None, False)


def test_rows_are_judged_by_rules_whatever_they_do_to_limits() -> None:
    """The last velocity is not zero: and the curve through few rows passes the limit of the jerk."""
    job = {"limits": LIMITS, "moves": [*MOVES[:1], {**SLOWLY, "to": {"joints": [2], "velocity": [0.5]}}]}
    loaded, profile, _ = job_for(read(job, rate=7), "ros-jtc", {"rows": True})
    made = rows_for(plan_job(loaded), profile, Writing())
    assert made.joined is not None
    assert {finding.kind for finding in made.joined.findings if finding.limit is not None} >= {"jerk"}
    assert made.rules is not None
    assert [found.rule for found in made.rules.findings if found.severity == "error"]
    assert {found.rule for found in made.over} >= {
        found.rule for found in made.rules.findings if found.severity == "error"
    }


def test_what_is_carried_instead_is_carried_in_plans_for_consumers() -> None:
    hold = {"planner": "hold", "duration": 1}
    loaded = job_for(
        read({"robot": "planar2r", "start": {"joints": [0, 0]}, "moves": [hold, hold]}), "ros-jtc", {}
    )
    made = plan_for(*loaded, Writing(), lambda index, _: point_mass(3.0 + index))
    masses = [move.robot.payload.mass for move in made.plan.moves if move.robot.payload is not None]
    assert masses == [3.0, 4.0]


BRAKING = {"planner": "jerk_limited", "to": {"velocity": 0}, "brake": True}


@pytest.mark.parametrize("rows", ["rate", "knots"])
@pytest.mark.parametrize(
    ("velocity", "acceleration", "used"),
    [(3.5, 0.0, "175 % of the velocity"), (-3.5, 0.0, "175 %"), (0.0, 12.0, "150 % of the acceleration")],
)
def test_a_start_outside_of_the_limits_is_refused_wherever_rows_stand(
    rows: str, velocity: float, acceleration: float, used: str
) -> None:
    """Of some of them no row is beside the planned curve, so that nothing of it is judged between rows."""
    start = {"joints": [0], "velocity": [velocity], "acceleration": [acceleration]}
    limits = {"velocity": 2, "acceleration": 8, "jerk": 99}
    loaded = read({"limits": limits, "start": start, "moves": [BRAKING]}, rate=100, rows=rows)
    with pytest.raises(
        VerificationError, match=f"starts outside of its limits, and brakes: {used}"
    ) as refused:
        made_for(loaded, "ros-jtc")
    (problem,) = refused.value.problems
    assert (problem.move, problem.joint) == (0, "j1")
    within = {**start, "velocity": [1.0], "acceleration": [0.0]}
    allowed = read({"limits": limits, "start": within, "moves": [BRAKING]}, rate=100, rows=rows)
    assert rows == "rate" or made_for(allowed, "ros-jtc").keeps
