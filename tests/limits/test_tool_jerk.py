"""Limits of the tool's jerk for all t, in joint space and on paths.

A link of length L that turns by q has |p'''|^2 = L^2 ((q''' - q'^3)^2 + (3 q' q'')^2).
"""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from independent_motion import TOOL, largest, tool_rates
from random_jobs import loaded
from tiers import few

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.job.report import Report
from trajcli.judge.file import CheckOptions, check_file
from trajcli.kinematics.robot import Joint, Robot, ToolLimits, unlimited
from trajcli.limits.kinds import TOOL_KINDS, LimitedMove
from trajcli.limits.tool import ToolFamily, ToolStep, ToolSurvey, limits_tool, unjudged
from trajcli.limits.tool_bound import ToolPeak
from trajcli.output.delivery.joined import write_plan
from trajcli.output.report import report_of
from trajcli.planning.plan import Plan, plan_job
from trajcli.trajectory import Span, State, Trajectory

LEVER, DURATION, TURN = 0.5, 1.6, 1.2
THIRD = ["jerk", "angular_jerk"]


def link(tcp: dict[str, float], move: dict[str, Any], **more: Any) -> dict[str, Any]:
    """Return a job of an arm of one link."""
    return {
        "version": 1,
        "robot": {"convention": "standard", "joints": [{"a": LEVER}]},
        "limits": {"velocity": 9, "acceleration": 99, "tcp": tcp},
        "start": {"joints": [0.1]},
        "moves": [{"planner": "quintic", "to": {"joints": [0.1 + TURN]}, **move}],
        **more,
    }


def peak_of_quintic(duration: float, order: str) -> float:
    s = np.linspace(0, 1, 400_001)
    rates = [np.polyval(np.polyder([6.0, -15, 10, 0, 0, 0], k), s) * TURN / duration**k for k in (1, 2, 3)]
    if order == "angular_jerk":
        return float(np.abs(rates[2]).max())
    return float(LEVER * np.hypot(rates[2] - rates[0] ** 3, 3 * rates[0] * rates[1]).max())


@pytest.mark.parametrize("key", THIRD)
@pytest.mark.parametrize(("part", "passes"), [(1 - 3e-6, False), (1 + 3e-6, True)])
def test_a_move_in_joint_space_is_judged_on_both_sides_of_the_limit(
    key: str, part: float, passes: bool
) -> None:
    peak = peak_of_quintic(DURATION, key)
    plan = plan_job(loaded(link({key: peak * part}, {"duration": DURATION})))
    assert plan.verdict.passed == passes
    for finding in plan.verdict.findings:
        assert finding.kind == f"tool_{key}"
        assert (finding.value, finding.method) == (pytest.approx(peak, rel=1e-6), "bounded")
        assert finding.factor == pytest.approx(part ** (-1 / 3), rel=1e-6)


@pytest.mark.parametrize("key", THIRD)
@pytest.mark.parametrize("move", [{}, {"duration": DURATION, "when_over_limit": "slow"}])
def test_a_move_is_stretched_to_the_limit(key: str, move: dict[str, Any]) -> None:
    limit = peak_of_quintic(2 * DURATION, key)
    plan = plan_job(loaded(link({key: limit}, move)))
    assert plan.verdict.passed
    assert plan.trajectory.duration == pytest.approx(2 * DURATION, rel=1e-6)
    assert f"to keep the {key.replace('_', ' ')} limit of the tool" in plan.events[0].message
    (peak,) = [each for each in report_of(plan).moves[0].tool_peaks or [] if each.quantity == key]
    assert (peak.value, peak.limit) == (pytest.approx(limit, rel=1e-6), limit)
    Report.model_validate_json(report_of(plan).model_dump_json())


@pytest.mark.parametrize("key", few(THIRD, 1))
def test_between_moving_states_the_search_sees_it(key: str) -> None:
    move = {"to": {"joints": [0.1 + TURN], "velocity": [0.3]}, "when_over_limit": "slow"}
    plan = plan_job(loaded(link({key: 4.0}, move)))
    assert plan.verdict.passed
    assert used(plan, key) == pytest.approx(1, abs=1e-4)


@pytest.mark.parametrize("key", THIRD)
def test_acceleration_that_steps_breaks_it(key: str) -> None:
    plan = plan_job(loaded(link({key: 500.0}, {"planner": "trapezoid"})), advise=False)
    findings = [finding for finding in plan.verdict.findings if finding.kind.endswith("_jump")]
    assert [f.kind for f in findings] == [f"tool_{key.replace('jerk', 'acceleration')}_jump"]
    assert findings[0].value == pytest.approx(99 * (LEVER if key == "jerk" else 1) * 1, rel=1e-9)


@pytest.mark.parametrize(("beside", "steps"), [(0.0, False), (1e-8, True)])
def test_a_joint_whose_axis_the_tool_is_on_does_not_move_it(beside: float, steps: bool) -> None:
    """The axis is oblique, so that rounding leaves 1e-17 m/s^2 of the step at the tool."""
    joints = [{"a": 0.3, "alpha": 1.1}, {"d": 0.1, "a": beside}]
    job = link(
        {"jerk": 100.0}, {"planner": "cubic", "to": {"joints": [0.7, 1.0]}}, start={"joints": [0.7, 0.0]}
    )
    arm = {"convention": "standard", "joints": joints}
    found = plan_job(loaded({**job, "robot": arm}), advise=False).verdict.findings
    assert ["tool_acceleration_jump"] * steps == [finding.kind for finding in found]


def test_a_step_belongs_to_the_move_with_the_acceleration() -> None:
    still = {"planner": "hold", "duration": 0.5}
    job = link({"jerk": 500.0}, {"planner": "trapezoid"})
    job["moves"] = [still, *job["moves"], still]
    plan = plan_job(loaded(job), advise=False)
    assert {finding.move for finding in plan.verdict.findings} == {1}


def test_a_step_is_found_when_it_is() -> None:
    """A trapezoid that brakes harder than it speeds up, alone and after a rest of half a second."""
    job = link({"jerk": 500.0}, {"planner": "trapezoid"})
    job["limits"]["acceleration"] = [[-99, 40]]
    alone = plan_job(loaded(job), advise=False).verdict.findings
    job["moves"] = [{"planner": "hold", "duration": 0.5}, *job["moves"]]
    plan = plan_job(loaded(job), advise=False)
    (before,), (found,) = alone, plan.verdict.findings
    assert before.time is not None
    assert before.time > 0.1
    assert found.time == pytest.approx(before.time + 0.5, abs=1e-9)
    curve, time = plan.trajectory.curve, float(found.time or 0.0)
    steps = [curve.evaluate(time, 2, side=side)[0] for side in ("left", "right")]
    assert abs(steps[1] - steps[0]) > 90


def test_speeds_are_reported_where_no_limit_is_stated() -> None:
    plan = plan_job(
        loaded({**JOB_ON_PATH, "moves": [PATHS["line"] | {"law": {"shape": "quintic", "duration": 3}}]})
    )
    tool = report_of(plan).moves[0].tool
    assert tool is not None
    assert [each.quantity for each in tool.peaks] == [
        "speed",
        "angular_speed",
        "acceleration",
        "angular_acceleration",
    ]


def used(plan: Plan, key: str) -> float:
    """Return the largest share of a limit, by an evaluation of its own."""
    (index,) = [k for k, name in enumerate(TOOL) if name == key]
    shares = []
    for move in plan.moves:
        robot = move.robot
        rates = largest(move.planned.curve, lambda q, robot=robot: tool_rates(robot, q))  # type: ignore[misc]
        shares.append(rates[index] / getattr(robot.limits.tcp, key))
    return float(max(shares))


DOWN = {"xyz": [0.45, 0.2, 0.3], "rpy": [np.pi, 0, 0], "configuration": {"elbow": "up"}}
PATHS = {
    "line": {"planner": "line", "to": {"xyz": [0.45, -0.2, 0.3], "rpy": [np.pi, 0, 0.8]}},
    "arc": {"planner": "arc", "via": {"xyz": [0.5, 0, 0.3]}, "to": {"xyz": [0.45, -0.2, 0.3]}},
    "path": {
        "planner": "path",
        "corner": "round",
        "radius": 0.05,
        "segments": [
            {"line": {"xyz": [0.45, 0, 0.3]}},
            {"line": {"xyz": [0.45, -0.2, 0.4], "rpy": [np.pi, 0, 0.8]}},
        ],
    },
}


JOB_ON_PATH = {"version": 1, "robot": "ur5e", "limits": {"acceleration": 20}, "start": DOWN}


@pytest.mark.parametrize(
    ("shape", "key"),
    few(
        [
            ("quintic", "jerk"),
            ("quintic", "angular_jerk"),
            ("jerk_limited", "angular_jerk"),
            ("jerk_limited", "jerk"),
            ("time_optimal", "jerk"),
            ("time_optimal", "angular_jerk"),
        ],
        3,
    ),
)
@pytest.mark.parametrize("planner", few(["path", "line", "arc"], 1))
def test_on_a_path_the_whole_vector_counts(planner: str, shape: str, key: str) -> None:
    """On a rounded corner the tool turns at speed: its jerk was 2.5 times that along the path."""
    tcp = {
        "speed": 0.5,
        "acceleration": 3,
        "angular_speed": 3,
        "angular_acceleration": 30,
        "jerk": 30.0,
        key: 20.0,
    }
    job = {
        "version": 1,
        "robot": "ur5e",
        "limits": {
            "velocity": 3,
            "acceleration": 20,
            "jerk": 1000 if shape == "time_optimal" else None,
            "tcp": tcp,
        },
        "start": DOWN,
        "moves": [{**PATHS[planner], "law": {"shape": shape}}],
    }
    plan = plan_job(loaded(job))
    assert plan.verdict.passed
    share = used(plan, key)
    assert share <= 1 + 2e-4
    if planner == "path" and key == "jerk":
        assert share > 1 - 1e-6
        keeps_it = shape == "time_optimal"  # the law itself, which needs no stretch of the whole
        assert [event.kind for event in plan.events] == ([] if keeps_it else ["stretched"])


@pytest.mark.parametrize("key", THIRD)
def test_recorded_rows_are_judged_by_it(key: str, tmp_path: Path) -> None:
    peak = peak_of_quintic(DURATION, key)
    file = tmp_path / "rows.csv"
    write_plan(plan_job(loaded(link({}, {"duration": DURATION}))), str(file))
    for part, kinds in ((0.98, {f"tool_{key}"}), (1.02, set())):
        job = tmp_path / "job.json"
        job.write_text(json.dumps(link({key: part * peak}, {"duration": DURATION})))
        judged = check_file(str(file), CheckOptions(job=str(job))).judgement
        assert {finding.kind for finding in judged.findings if finding.severity == "error"} == kinds


@pytest.mark.parametrize("planner", PATHS)
def test_a_law_at_a_limit_keeps_it_whatever_the_tolerance_of_its_path_is(planner: str) -> None:
    job = JOB_ON_PATH | {
        "limits": {"acceleration": 200, "tcp": {"speed": 0.1, "acceleration": 1, "angular_speed": 9}},
        "moves": [
            PATHS[planner] | {"law": {"shape": "trapezoid"}, "tolerance": {"position": 1e-3, "angle": 1e-3}}
        ],
    }
    plan = plan_job(loaded(job))
    assert plan.verdict.passed
    assert 1 - 1e-6 < used(plan, "speed") < 1 + 1e-6


def survey_of(steps: tuple[ToolStep, ...], uses: dict[str, float], moves: bool = True) -> ToolSurvey:
    """Return what a move uses of limits of one, all of them stated."""
    limits = replace(unlimited(1), tcp=ToolLimits(*[1.0] * 6))
    peaks = {kind.key: ToolPeak(0.5, 0.25, uses.get(kind.key, 0.5), np.zeros(3)) for kind in TOOL_KINDS}
    return ToolSurvey(limits, peaks, steps, 10.0, moves)


ONE = Robot("link", (Joint("j1", a=LEVER),), unlimited(1), "standard", np.eye(4), np.eye(4))
KIND_OF = {kind.key: kind for kind in TOOL_KINDS}


@pytest.mark.parametrize("turns", [False, True])
def test_a_step_stands_in_the_place_of_the_jerk_of_its_own_kind_alone(turns: bool) -> None:
    """A jerk is not bounded where the acceleration steps; speeds, accelerations and the other jerk are."""
    uses = {kind.key: 2.0 for kind in TOOL_KINDS}
    stepping, instead = ("angular_acceleration", "angular_jerk") if turns else ("acceleration", "jerk")
    survey = survey_of((ToolStep(KIND_OF[stepping], 3.0, 0.75),), uses)
    found = {finding.kind: finding for finding in survey.over(ONE)}
    assert len(list(survey.over(ONE))) == 6
    assert set(found) == {f"tool_{key}" for key in uses if key != instead} | {f"tool_{stepping}_jump"}
    step = found[f"tool_{stepping}_jump"]
    assert (step.value, step.limit, step.time) == (3.0, 0.0, 10.75)
    size, dimension = step.amounts["value"], KIND_OF[stepping].dimension
    assert (size.value, size.order, size.dimension) == (3.0, 2, dimension)
    assert step.message.startswith(f"the {KIND_OF[stepping].words} of the tool steps by")
    assert (step.hint or "").endswith(f"or leave the limit of the tool's {KIND_OF[instead].words} out")
    assert survey.excess() == np.inf
    assert {found[kind].time for kind in found if not kind.endswith("jump")} == {10.25}


@pytest.mark.parametrize("key", KIND_OF)
def test_each_limit_of_the_tool_is_judged_by_itself(key: str) -> None:
    survey = survey_of((), {key: 2.0})
    (finding,) = survey.over(ONE)
    assert (finding.kind, finding.value, finding.limit) == (f"tool_{key}", 2.0, 1.0)
    assert finding.factor == pytest.approx(2.0 ** (1 / (KIND_OF[key].order or 1)))
    for name, number in (("value", 2.0), ("limit", 1.0)):
        told = finding.amounts[name]
        assert (told.value, told.order) == (number, KIND_OF[key].order)
        assert told.dimension == KIND_OF[key].dimension
    assert survey.excess() == 1.0
    (unbounded,) = survey_of((), {key: np.inf}).over(ONE)
    assert (unbounded.value, unbounded.factor) == (np.inf, None)
    (still,) = survey_of((), {key: 2.0}, moves=False).over(ONE)
    assert still.factor is None
    assert [each.kind for each in survey_of((), {key: np.nan}).over(ONE)] == [f"tool_{key}"]
    assert list(survey_of((), {key: 1.0 + 0.9e-6}).over(ONE)) == []


@pytest.mark.parametrize(
    ("limits", "over"), [((0.9, 2.1), True), ((1.1, 1.9), True), ((1.1, 2.1), False), ((0.9, 1.9), True)]
)
@pytest.mark.parametrize("end", [0, 1])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_tool_that_is_too_fast_at_an_end_is_so_by_its_speed_or_its_turning(
    sign: float, end: int, limits: tuple[float, float], over: bool
) -> None:
    """At 2 rad/s a link of half a metre moves its end at 1 m/s."""
    arm = replace(ONE, limits=replace(unlimited(1), tcp=ToolLimits(speed=limits[0], angular_speed=limits[1])))
    states = [State(np.zeros(1), np.array([sign * 2.0 * (k == end)]), np.zeros(1)) for k in range(2)]
    assert ToolFamily().over_at_ends(arm, states, ("tool_speed", 0, 1.0)) is over


@pytest.mark.parametrize(("share", "over"), [(1 + 3e-6, True), (1 - 1e-9, False)])
@pytest.mark.parametrize("key", ["speed", "angular_speed"])
def test_a_tool_is_too_fast_at_the_end_where_its_arm_is_stretched(
    key: str, share: float, *, over: bool
) -> None:
    """Two links of 0.5 m that turn as one: folded they do not move their end, stretched by 1 m for each radian."""
    pair = (Joint("j1", a=LEVER), Joint("j2", a=LEVER))
    tcp = ToolLimits(**{key: 2.0 / share})
    arm = Robot("pair", pair, replace(unlimited(2), tcp=tcp), "standard", np.eye(4), np.eye(4))
    turning, still = np.array([2.0, 0.0]), np.zeros(2)
    folded, stretched = (State(np.array([0.3, elbow]), turning, still) for elbow in (np.pi, 0.0))
    for ends in ([folded, stretched], [stretched, folded]):
        assert ToolFamily().over_at_ends(arm, ends, ("tool_speed", 0, 1.0)) is over
    assert ToolFamily().over_at_ends(arm, [folded] * 2, ("tool_speed", 0, 1.0)) is (over and key != "speed")


def test_limits_of_the_tool_that_nobody_can_judge_are_those_that_are_stated() -> None:
    stated = replace(unlimited(1), tcp=ToolLimits(speed=1.0, angular_jerk=2.0))
    blind = replace(ONE, convention=None)
    assert unjudged(stated, None) == unjudged(stated, blind) == {"speed", "angular_jerk"}
    assert unjudged(stated, ONE) == unjudged(unlimited(1), None) == set()
    assert limits_tool(replace(ONE, limits=stated))
    assert not limits_tool(ONE)
    assert not limits_tool(replace(blind, limits=stated))


@pytest.mark.parametrize("key", ["speed", "acceleration", "jerk", "angular_jerk"])
@pytest.mark.parametrize("move", [0, 1])
def test_a_move_is_surveyed_with_times_from_its_own_start(move: int, key: str) -> None:
    """Two moves that rest but for a short pulse of angle each, 0.25 s behind the start of the first, 0.5 of the second."""
    pulse = np.polyint(np.poly([0.0, 0.0, 0.25, 0.25]))
    rows = np.zeros((6, 4, 1))
    rows[:, 1, 0], rows[:, 3, 0] = 40.0 * pulse, 40.0 * pulse
    gone = float(np.polyval(40.0 * pulse, 0.25))
    rows[-1, 2:, 0], rows[-1, 3, 0] = gone, gone
    curve = PiecewisePolynomial(np.array([0.0, 0.25, 0.5, 1.0, 1.25]), rows)
    spans = (Span(0, "quintic", 0.0, 0.5, 2), Span(1, "quintic", 0.5, 1.25, 2))
    start, end = (State(np.array([q]), np.zeros(1), np.zeros(1)) for q in (0.0, 2 * gone))
    whole = Trajectory(curve, ("j1",), ("revolute",), spans, start, end)
    arm = replace(ONE, limits=replace(unlimited(1), tcp=ToolLimits(**{key: 1e-9})))
    survey = ToolFamily().survey(LimitedMove(whole, spans[move], arm.limits, arm))
    assert survey is not None
    assert survey.begins == spans[move].start
    quiet = (0.25, 0.5)[move]  # until the pulse begins
    assert quiet < survey.peaks[key].time < quiet + 0.25 or key.endswith("jerk")
    assert all(spans[move].start + quiet <= each.time <= spans[move].end for each in survey.over(whole))
    assert {each.kind for each in survey.over(whole)} == {f"tool_{key}"}
    assert (survey.moves, survey.on_path) == (True, False)


@pytest.mark.parametrize("ends", [1.0, 0.0])
@pytest.mark.parametrize("limited", [True, False])
@pytest.mark.parametrize("along", [True, False])
def test_the_tool_is_surveyed_where_it_has_limits_or_a_path(along: bool, limited: bool, ends: float) -> None:
    """A joint that turns at 2 rad/s for a second, or for no time at all."""
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([2.0, 0.0])[:, None, None])
    span = Span(0, "quintic", 0.0, ends, 2)
    whole = Trajectory(curve, ("j1",), ("revolute",), (span,), *[State(*np.zeros((3, 1)))] * 2)
    arm = replace(ONE, limits=replace(unlimited(1), tcp=ToolLimits(speed=0.25))) if limited else ONE
    motion = SimpleNamespace() if along else None
    survey = ToolFamily().survey(LimitedMove(whole, span, arm.limits, arm, motion))  # type: ignore[arg-type]
    assert (survey is not None) == (limited or along)
    if survey is not None:
        assert (survey.on_path, survey.moves, bool(survey.peaks)) == (along, ends > 0, limited)
        assert [each.value for each in survey.over(whole)] == [pytest.approx(1.0)] * (limited and ends > 0)
    assert ToolFamily().survey(LimitedMove(whole, span, arm.limits, None, motion)) is None  # type: ignore[arg-type]


def test_a_step_has_its_time_from_the_start_of_the_move() -> None:
    """Of two moves the second rests for half a second, and gains 1 rad/s^2 at once for a quarter."""
    rows = np.zeros((3, 3, 1))
    rows[0, 2] = 0.5
    curve = PiecewisePolynomial(np.array([0.0, 1.0, 1.5, 1.75]), rows)
    spans = (Span(0, "quintic", 0.0, 1.0, 2), Span(1, "quintic", 1.0, 1.75, 2))
    end = State(*(curve.piece_ends(order)[1][-1] for order in range(3)))
    start = State(*np.zeros((3, 1)))
    whole = Trajectory(curve, ("j1",), ("revolute",), spans, start, end)
    arm = replace(ONE, limits=replace(unlimited(1), tcp=ToolLimits(jerk=99.0)))
    survey = ToolFamily().survey(LimitedMove(whole, spans[1], arm.limits, arm))
    assert survey is not None
    assert [(step.kind.key, step.size, step.time) for step in survey.steps] == [
        ("acceleration", pytest.approx(LEVER), 0.5)
    ]
    (found,) = survey.over(whole)
    assert (found.kind, found.time) == ("tool_acceleration_jump", 1.5)
