"""Advice works when it is followed to the letter: the program judges the job that does exactly what it said.

The oracle is a second run with the changed job: what the advice was against is gone, whatever the advice.
"""

from __future__ import annotations

import copy
import json
import re
import time
from typing import Any

import numpy as np
import pytest
from followed_advice import ALONG_PATHS, Complaint, Job, alternatives, complaints, disappears
from random_jobs import TAGS, random_job
from tiers import few

from trajcli.errors import MissingLimitError
from trajcli.job.read import job_from_text
from trajcli.output.report import verification_error
from trajcli.planners import PLANNERS
from trajcli.planning.plan import Plan, plan_job

TWO = {"joints": [{"velocity": 2, "acceleration": 8}, {"velocity": 2, "acceleration": 8}]}
JERKY = {
    "joints": [{"velocity": 2, "acceleration": 8, "jerk": 50}, {"velocity": 2, "acceleration": 8, "jerk": 50}]
}
TO = {"joints": [1, 0.4]}
THROUGH = [{"joints": [1, 1]}]
TCP = {"speed": 0.5, "acceleration": 2, "angular_speed": 2, "angular_acceleration": 9}
ARM = {"joints": [0, -1.57, 1.57, 0, 1.57, 0]}
BENT = {"joints": [0.4, -1.57, 1.57, 0, 1.57, 0.3]}
AWAY = {"xyz": [0.4, 0.3, 0.4]}
ARC = {"via": {"xyz": [0.45, 0.25, 0.42]}, "to": AWAY}


def job(*moves: Job, robot: Any = TWO, start: Job | None = None, **rest: Any) -> Job:
    return {"version": 1, "robot": robot, "start": start or {"joints": [0, 0]}, "moves": list(moves), **rest}


def tool_job(move: Job, **limits: Any) -> Job:
    return job(move, robot="ur5e", start=ARM, limits={"acceleration": 8, "jerk": None, **limits})


def follows_every(failing: Job) -> list[str]:
    """Follow each advice about a job; return what was followed."""
    found = complaints(failing)
    assert found, "this job passes"
    steps = {c.move for c in found if c.what == "acceleration_jump"}
    followed = []
    for complaint in found:
        if complaint.what == "jerk" and complaint.move in steps:
            assert complaint.hint == next(c.hint for c in found if c.what == "acceleration_jump")
            continue
        for words, changed in alternatives(failing, complaint):
            after = complaints(changed)
            assert disappears(complaint, after), f"{words}: {complaint} became {after[:3]} in {changed}"
            followed.append(re.sub(r"[-+\d.e]*\d[\d.]*", "#", words))
    return followed


SHORT = {
    "cubic": job({"planner": "cubic", "to": TO, "duration": 0.3}),
    "quintic": job({"planner": "quintic", "to": TO, "duration": 0.3}, robot=JERKY),
    "septic": job({"planner": "septic", "to": TO, "duration": 0.3}, robot=JERKY),
    "cycloidal": job({"planner": "cycloidal", "to": TO, "duration": 0.3}, robot=JERKY),
    "trapezoid": job({"planner": "trapezoid", "to": TO, "velocity": 3, "acceleration": 20}),
    "spline": job({"planner": "spline", "to": TO, "through": THROUGH, "duration": 0.3}),
    "blends": job({"planner": "blends", "to": TO, "through": THROUGH, "duration": 0.3}),
    "time_optimal": job({"planner": "time_optimal", "to": TO, "through": THROUGH, "duration": 0.3}),
    "waypoints": job({"planner": "waypoints", "to": TO, "through": THROUGH}, robot={"joints": 2}),
    "line": tool_job({"planner": "line", "to": AWAY, "law": {"shape": "quintic", "duration": 0.2}}),
    "arc": tool_job({"planner": "arc", **ARC, "law": {"shape": "cubic", "duration": 0.2}}),
    "screw": tool_job(
        {"planner": "screw", "to": {**AWAY, "rpy": [3, 0, 0]}, "law": {"shape": "cycloidal", "duration": 0.2}}
    ),
    "path": tool_job(
        {
            "planner": "path",
            "corner": "stop",
            "segments": [{"line": AWAY}],
            "law": {"speed": 5, "acceleration": 30},
        }
    ),
    "jerk_limited": job({"planner": "jerk_limited", "to": TO}, robot={"joints": 2}),
    "hold": job({"planner": "cubic", "to": TO, "duration": 0.3}, {"planner": "hold", "duration": 1}),
}


def test_every_planner_is_here() -> None:
    assert set(SHORT) == set(PLANNERS)


@pytest.mark.full
@pytest.mark.parametrize("tag", few(sorted(SHORT), 5))
def test_moves_that_are_too_fast(tag: str) -> None:
    assert follows_every(SHORT[tag])


@pytest.mark.parametrize(
    "move",
    [
        {"planner": "trapezoid", "to": TO, "duration": np.sqrt(0.5) * 0.8},
        {"planner": "trapezoid", "to": {"joints": [np.sqrt(2) / 2, 0.1]}, "duration": 1, "acceleration": 2},
        {"planner": "trapezoid", "to": {"joints": [1 / 3, 0.1]}, "duration": 0.7, "velocity": 1.9},
        {"planner": "trapezoid", "to": TO, "duration": 0.5, "velocity": 3},
        {"planner": "trapezoid", "to": {"joints": [1 / 3, 0.1]}, "duration": 0.3, "synchronize": "none"},
        {"planner": "time_optimal", "to": {"joints": [np.sqrt(2), 0.3]}, "duration": 0.1},
        {"planner": "blends", "to": TO, "through": THROUGH, "duration": 2, "end_blends": "inside"},
    ],
)
def test_bounds_in_messages_are_given_back(move: Job) -> None:
    for robot in (TWO, JERKY):
        if complaints(job(move, robot=robot)):
            assert follows_every(job(move, robot=robot))


@pytest.mark.full
@pytest.mark.parametrize(
    "law",
    few(
        [
            {"shape": "quintic", "speed": 0.1, "duration": 0.2},
            {"shape": "trapezoid", "speed": 1, "acceleration": 100},
            {"shape": "trapezoid", "duration": 0.2, "acceleration": 100},
            {"shape": "trapezoid", "duration": 0.2, "speed": 2},
            {"shape": "jerk_limited", "speed": 3, "acceleration": 50, "jerk": 900},
        ],
        2,
    ),
)
@pytest.mark.parametrize("jerk", [None, 300])
def test_laws_of_the_tool(law: Job, jerk: float | None) -> None:
    failing = tool_job({"planner": "line", "to": AWAY, "law": law}, jerk=jerk)
    if complaints(failing):
        assert follows_every(failing)


@pytest.mark.parametrize(
    ("move", "limit", "named"),
    [
        pytest.param({"planner": "trapezoid", "to": BENT}, "jerk", 3, marks=pytest.mark.full),
        pytest.param(
            {"planner": "cubic", "duration": 1.5, "to": BENT}, "angular_jerk", 3, marks=pytest.mark.full
        ),
        ({"planner": "line", "to": AWAY, "law": {"shape": "trapezoid"}}, "jerk", 3),
        ({"planner": "spline", "rule": "clamped", "through": [BENT], "to": ARM, "duration": 3}, "jerk", 2),
    ],
    ids=["trapezoid", "cubic", "line", "spline"],
)
def test_what_has_no_steps_is_named_where_the_tool_has_a_limit_of_jerk(
    move: Job, limit: str, named: int
) -> None:
    """Each planner is tried beforehand; none is named by words that leave the choice open."""
    tcp = {"speed": 0.5, "acceleration": 2, limit: 30}
    failing = job(move, robot="ur5e", start=ARM, limits={"velocity": 3, "acceleration": 8, "tcp": tcp})
    steps = [c for c in complaints(failing) if c.what.startswith("tool_")]
    assert steps
    assert "whose acceleration does not step" not in steps[0].hint
    assert len(set(follows_every(failing))) >= named


@pytest.mark.parametrize("seed", few(range(45), 6))
def test_random_jobs(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tag = TAGS[seed % len(TAGS)]
    failing = random_job(rng, tag, int(rng.integers(1, 3)), rest=seed % 3 > 0, unlimited=0.2 * (seed % 2))
    move = failing["moves"][0]
    if "duration" in move or tag == "time_optimal":
        move["duration"] = float(rng.uniform(0.05, 0.6))
    for point in [*move.get("through", []), move.get("to", {})]:
        if "time" in point:
            point["time"] *= 0.3
    if seed % 5 == 0:
        failing["moves"].append({"planner": "jerk_limited", "to": {"joints": failing["start"]["joints"]}})
    if complaints(failing):
        follows_every(failing)


def planned(failing: Job) -> Plan:
    return plan_job(job_from_text(json.dumps(failing), "job.yaml"))


def test_two_findings_give_one_duration() -> None:
    plan = planned(SHORT["quintic"])
    assert len({f.kind for f in plan.verdict.findings}) == 3
    assert len({f.hint for f in plan.verdict.findings}) == 1
    (factor,) = {f.factor for f in plan.verdict.findings}
    assert factor == pytest.approx(
        (60 / (50 * 0.3**3)) ** (1 / 3), rel=1e-9
    )  # the peak of the jerk is 60 / T^3


@pytest.mark.full
@pytest.mark.parametrize("tag", ["cubic", "quintic", "septic"])
def test_the_factor_of_a_move_between_moving_states_passes(tag: str) -> None:
    start = {"joints": [0, 0.1], "velocity": [0.4, -0.2]}
    failing = job({"planner": tag, "to": {**TO, "velocity": [0.2, 0.1]}, "duration": 0.3}, start=start)
    (factor,) = {f.factor for f in planned(failing).verdict.findings}
    assert factor is not None
    for times, passes in ((factor, True), (factor * (1 - 1e-5), False)):
        longer = copy.deepcopy(failing)
        longer["moves"][0]["duration"] *= times
        assert planned(longer).verdict.passed == passes


def test_slow_is_not_offered_where_the_acceleration_steps() -> None:
    failing = job({"planner": "cubic", "to": TO, "duration": 0.3}, robot=JERKY)
    for finding in planned(failing).verdict.findings:
        assert "when_over_limit" not in (finding.hint or "")


def test_the_limit_of_jerk_is_left_out_where_another_move_can_do_without() -> None:
    moves = [
        {"planner": "cubic", "to": TO, "duration": 5},
        {"planner": "jerk_limited", "to": {"joints": [0, 0]}},
    ]
    for failing, offered in ((job(*moves, robot=JERKY), True), (job(moves[0], robot=JERKY), True)):
        without = job(*failing["moves"], robot=JERKY, limits={"jerk": None})
        assert (not complaints(without)) == offered
        hints = [c.hint for c in complaints(failing)]
        assert hints
        assert all(("jerk: null" in hint) == offered for hint in hints)


def test_a_limit_of_jerk_of_the_move_itself() -> None:
    move = {"planner": "cubic", "to": TO, "duration": 5, "limits": {"jerk": 40}}
    failing = job(move, robot=JERKY)
    assert any("leave `jerk` out" in words for words in follows_every(failing))


def test_all_limits_that_lack_are_asked_for_at_once() -> None:
    failing = job(
        {"planner": "cubic", "to": TO},
        {"planner": "time_optimal", "to": {"joints": [0, 0.2]}, "through": THROUGH},
        {"planner": "cubic", "to": {"joints": [0.5, 0.1]}},
        robot={"joints": 2},
    )
    with pytest.raises(MissingLimitError) as caught:
        planned(failing)
    texts = [problem.text() for problem in caught.value.problems]
    assert len(texts) == 2
    assert "velocity" in texts[0]
    assert "(and 1 more move likewise)" in texts[0]
    assert "acceleration" in texts[1]
    assert follows_every(failing)
    law = {"shape": "jerk_limited"}
    with pytest.raises(MissingLimitError) as caught:
        planned(tool_job({"planner": "line", "to": AWAY, "law": law}))
    (problem,) = caught.value.problems
    assert "{tcp: {speed: ..., acceleration: ..., jerk: ...}}" in (problem.advice() or "")
    assert follows_every(tool_job({"planner": "line", "to": AWAY, "law": law}))


@pytest.mark.parametrize(
    "move",
    [
        {"planner": "cubic", "to": {"joints": [-1, 0.4]}, "duration": 0.3},
        {
            "planner": "spline",
            "to": {"joints": [-1, 0.4]},
            "through": [{"joints": [0.5, 0]}] * 40,
            "duration": 1,
        },
        {"planner": "quintic", "to": {"joints": [-1, 0.4]}, "duration": 0.3},
    ],
)
@pytest.mark.parametrize("speed", [1.9, 0.8])
def test_a_hopeless_search_for_a_duration_ends_soon_and_says_why(move: Job, speed: float) -> None:
    """Within 8 rad/s^2 a joint at v goes on for v^2 / 16: that far from its limit, or less, it cannot stop."""
    rows = [{**row, "position": [-1.2, 1.2]} for row in TWO["joints"]]
    near = 1.2 - 0.9 * speed**2 / 16
    start = {"joints": [near, 0], "velocity": [speed, 0]}
    began = time.monotonic()
    found = complaints(job(move, robot={"joints": rows}, start=start, when_over_limit="slow"))
    assert time.monotonic() - began < 3
    assert found
    hints = {c.hint for c in found}
    assert all(f"slowing down does not help: j1 starts with {speed:g} rad/s, " in hint for hint in hints)


def test_a_search_ends_where_the_range_is_left_ever_further() -> None:
    """A cubic that starts away from its target swings out by a part of v T: 4/27 of it and more."""
    start = {"joints": [0, 0], "velocity": [-1, 0]}
    failing = job(
        {"planner": "cubic", "to": TO, "duration": 0.3},
        start=start,
        robot={"joints": [{"position": [-0.13, 2], "velocity": 1.1, "acceleration": 8}, {}]},
        when_over_limit="slow",
    )
    hints = {c.hint for c in complaints(failing) if c.joint == "j1"}
    assert hints == {
        "slowing down does not help: the longer it lasts, the further j1 goes beyond its position limit"
    }
    failing["robot"]["joints"][0]["position"] = [-9, 9]
    assert not complaints(failing)


@pytest.mark.parametrize("tag", ["trapezoid", "time_optimal", "line"])
def test_a_duration_that_is_too_short_is_stretched_where_that_is_asked_for(tag: str) -> None:
    law = {"shape": "quintic", "duration": 0.2, "speed": 0.1}
    move = {"planner": tag, "to": TO, "duration": 0.3}
    failing = job(move) if tag != "line" else tool_job({"planner": "line", "to": AWAY, "law": law})
    assert complaints(failing)
    plan = planned({**failing, "when_over_limit": "slow"})
    assert plan.verdict.passed
    fastest = 1 / 2 + 2 / 8  # up to 2 rad/s within 8 rad/s^2: 1 rad takes 1 / v + v / a
    if tag == "line":
        tool = plan.moves[0].planned.tool
        assert tool is not None
        fastest = 15 / 8 * tool.path.length / 0.1
    assert plan.trajectory.duration == pytest.approx(fastest, rel=1e-6)
    (event,) = [event for event in plan.events if event.kind == "slowed"]
    assert f"to {fastest:.5g}"[:7] in event.message


def test_messages_of_a_verdict_are_in_the_units_of_the_job() -> None:
    moves = [{"planner": "quintic", "to": {"joints": [90, 100]}, "duration": 1}]
    robot = {"joints": [{"velocity": 30}, {"type": "prismatic", "velocity": 50}]}
    plan = planned(job(*moves, robot=robot, units={"angle": "deg", "length": "mm"}))
    texts = [finding.text() for finding in plan.verdict.findings]
    assert [re.sub(r" at t.*", "", text) for text in texts] == [
        f"the velocity of j1 reaches {90 * 1.875:g} deg/s",
        f"the velocity of j2 reaches {100 * 1.875:g} mm/s",
    ]
    assert [finding.si_unit for finding in plan.verdict.findings] == ["rad/s", "m/s"]


def test_one_cause_is_one_error() -> None:
    """Degrees read as radians break limits of every kind, in every move."""
    moves = [
        {"planner": "quintic", "to": {"joints": [30 + k, -90, 90, 0, 90, 0]}, "duration": 3} for k in range(3)
    ]
    plan = planned(job(*moves, robot="ur5e", start={"joints": [0, -90, 90, 0, 90, 0]}))
    assert len({f.kind for f in plan.verdict.findings}) > 1
    (problem,) = verification_error(plan, every=False).problems
    assert "position" in problem.text()
    assert "units: {angle: deg}" in (problem.advice() or "")
    assert f"(and {len(plan.verdict.findings) - 1} more like it: --all)" in problem.text()
    assert len(verification_error(plan).problems) == len(plan.verdict.findings)
    step = planned(job({"planner": "cubic", "to": TO, "duration": 0.3}, robot=JERKY))
    kinds = [f.kind for f in step.verdict.findings]
    assert {"jerk", "acceleration_jump"} <= set(kinds)
    errors = verification_error(step, every=False).problems
    assert sum("jerk" in (p.advice() or "") for p in errors) == 1


@pytest.mark.full
def test_the_time_of_an_error_in_a_later_move_counts_from_the_start_of_the_trajectory() -> None:
    """The same line is refused where the arm waits before it, later by as long as it waits."""
    robot = {
        "convention": "standard",
        "joints": [{"a": 1, "position": [-3, 3]}, {"a": 1, "position": [-0.9, 3]}, {"a": 0.1}],
    }
    leave = {"planner": "line", "to": {"xyz": [0.75, 0.1, 0]}, "law": {"shape": "quintic", "duration": 2}}
    start = {"joints": [0.5, -0.8, 0.1]}
    times = []
    for wait in ([], [{"planner": "hold", "duration": 2.5}], [{"planner": "hold", "duration": 0.5}] * 3):
        with pytest.raises(Exception, match="its limit is") as caught:
            planned(job(*wait, leave, robot=robot, start=start))
        (problem,) = caught.value.problems
        times.append(problem.time)
    assert 0 < times[0] <= 2
    assert times[1:] == pytest.approx([times[0] + 2.5, times[0] + 1.5], rel=1e-12)


@pytest.mark.full
def test_a_hint_about_orientation_stands_where_it_helps() -> None:
    far, turned = {"xyz": [3, 0, 0]}, {"xyz": [0.93, 0, 0.1], "rpy": [0, 0, 1]}
    for to, helps in ((far, False), ({**far, "rpy": [0, 0, 1]}, False), (turned, True)):
        failing = job({"planner": "quintic", "to": to, "duration": 9}, robot="ur5e", start=ARM)
        (complaint,) = complaints(failing)
        assert ("orientation" in complaint.hint) == helps
        free = copy.deepcopy(failing)
        free["moves"][0]["to"].pop("rpy", None)
        assert (not complaints(free)) == helps


def test_a_complaint_that_stays_is_seen() -> None:
    stays = Complaint("velocity", "", "", 0, "j1")
    assert not disappears(stays, [stays])
    assert set(ALONG_PATHS) < set(PLANNERS)
