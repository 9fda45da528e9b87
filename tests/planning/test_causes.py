"""Causes of findings: a move that is too short, a point outside its limit, and what is apart stays apart."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from trajcli.findings import Finding
from trajcli.job.read import job_from_text, load_job
from trajcli.output.report import verification_error
from trajcli.planning.causes import causes_of
from trajcli.planning.plan import Plan, plan_job

PICK = Path(__file__).parents[2] / "examples/ur5e_pick.yaml"
LIFT = """\
version: 1
units: {angle: deg, length: mm}
robot:
  joints:
    - {name: turn, position: [-90, 90], velocity: 500}
    - {name: lift, type: prismatic, position: [0, 100], velocity: 500}
points:
  low: {joints: [10, 20]}
  high: {joints: [20, 120]}
start: {joints: [0, 0]}
moves:
  - {planner: quintic, to: low, duration: 1}
  - {planner: quintic, to: high, duration: 1}
  - {planner: hold, duration: 0.5}
  - {planner: quintic, to: low, duration: 1}
  - {planner: quintic, to: {joints: [95, 20]}, duration: 1}
  - {planner: spline, through: [{joints: [-95, 20]}], to: {joints: [95, 20]}, duration: 4}
"""


def test_a_move_that_is_too_short_is_one_finding() -> None:
    plan = plan_job(load_job(PICK, ["moves.8.duration=0.5"]))
    (cause,) = causes_of(plan)
    assert len(plan.verdict.findings) == len(cause.findings) == 7
    assert {finding.kind for finding in cause.findings} == {"velocity", "acceleration", "jerk"}
    (problem,) = verification_error(plan, every=False).problems
    assert "(and 6 more like it: --all)" in problem.message


def test_a_point_outside_its_limit_is_one_finding_at_the_number() -> None:
    plan = plan_job(job_from_text(LIFT, "lift.yaml"))
    causes = causes_of(plan)
    assert [len(cause.findings) for cause in causes[:1]] == [3]  # there, meanwhile, and from there
    assert [cause.worst.joint for cause in causes] == ["lift", "turn", "turn"]
    lines = LIFT.splitlines()
    for problem, number in zip(
        verification_error(plan, every=False).problems, ("120", "95", "-95"), strict=True
    ):
        place = problem.place
        assert place is not None
        assert lines[place.line - 1][place.column - 1 :].startswith(number)
        assert place.length == len(number)


def test_what_has_other_causes_is_apart() -> None:
    short = (
        LIFT[: LIFT.index("moves:")]
        + """\
moves:
  - {planner: quintic, to: low, duration: 0.01}
  - {planner: quintic, to: {joints: [80, 90]}, duration: 0.1}
  - {planner: quintic, to: {joints: [95, 90]}, duration: 0.001}
"""
    )
    causes = causes_of(plan_job(job_from_text(short)))
    assert sorted((cause.worst.move, cause.worst.kind) for cause in causes) == [
        (0, "velocity"),
        (1, "velocity"),
        (2, "position"),
        (2, "velocity"),
    ]


def place_of(job: str, *, every: bool = False) -> list[str]:
    """Return what stands in the job where its findings are shown."""
    lines = job.splitlines()
    places = [problem.place for problem in verification_error(plan_of(job), every=every).problems]
    return [lines[place.line - 1][place.column - 1 :] for place in places if place is not None]


def plan_of(job: str) -> Plan:
    return plan_job(job_from_text(job, "lift.yaml"))


HEAD = LIFT[: LIFT.index("moves:")]


def test_points_that_are_a_millimetre_apart_are_two_causes_each_at_its_own_number() -> None:
    """Of joints in a list, and by their names, also where the next move has the only finding that is said."""
    moves = "moves:\n" + "\n".join(
        [
            "  - {planner: quintic, to: {joints: [10, 121]}, duration: 1}",
            "  - {planner: quintic, to: {joints: {turn: 10, lift: 120}}, duration: 1}",
            "  - {planner: quintic, to: low, duration: 1}",
            "  - {planner: spline, through: [{joints: [5, 118]}, {joints: [0, 119]}], to: low, duration: 2}",
        ]
    )
    causes = causes_of(plan_of(HEAD + moves))
    worst = [(cause.worst.joint, round(1e3 * (cause.worst.value or 0), 3)) for cause in causes]
    assert worst[:2] == [("lift", 121.0), ("lift", 120.0)]
    assert 119 < worst[2][1] < 121  # between the points, where no number stands
    found = place_of(HEAD + moves)
    assert [text.partition("]")[0].partition("}")[0] for text in found[:2]] == ["121", "120"]
    assert found[2].startswith("{planner: spline")


def test_a_start_outside_its_limit_is_said_of_the_start() -> None:
    job = HEAD.replace("start: {joints: [0, 0]}", "start: {joints: [0, -30]}")
    job += "moves: [{planner: quintic, to: low, duration: 1}]\n"
    (problem,) = verification_error(plan_of(job), every=False).problems
    assert problem.message.startswith("the start: ")
    assert place_of(job)[0].startswith("{joints: [0, -30]}")


def _causes(*findings: Finding) -> list[tuple[int, ...]]:
    """Return which of some findings have one cause, the worst first."""
    plan = plan_of(LIFT)
    made = replace(plan, verdict=replace(plan.verdict, findings=findings))
    causes = causes_of(made)
    assert all(cause.findings == tuple(findings[k] for k in cause.indices) for cause in causes)
    assert sorted(k for cause in causes for k in cause.indices) == list(range(len(findings)))
    return [cause.indices for cause in causes]


def found(kind: str, move: int = 0, joint: str = "turn", value: float = 2.0, **fields: Any) -> Finding:
    return Finding(kind, joint, value, fields.pop("limit", 1.0), 0.5, move, **fields)


def test_findings_that_one_change_would_end_are_one_cause() -> None:
    longer, smooth = {"hint": "give it more time", "factor": 2.0}, {"hint": "use another curve"}
    assert _causes(found("velocity", **longer), found("jerk", 0, **longer)) == [(0, 1)]
    assert _causes(found("velocity", **longer), found("velocity", 1, **longer)) == [(0,), (1,)]
    assert _causes(found("acceleration_jump", **smooth), found("jerk", **smooth)) == [(0, 1)]
    assert _causes(found("jerk", 0, **smooth), found("jerk", 1, **smooth)) == [(0,), (1,)]
    # without a factor the hint is no cure by time: the kind tells them apart
    assert _causes(found("velocity", **smooth), found("tool_path", **smooth)) == [(0,), (1,)]
    assert _causes(found("velocity"), found("velocity", joint="lift"), found("effort")) == [(0, 1), (2,)]
    assert _causes(found("velocity", 0), found("velocity", 1)) == [(0,), (1,)]
    assert _causes(found("position", 0), found("position", 1), found("position", 1, "lift")) == [(0, 1), (2,)]


def test_the_worst_of_a_cause_asks_for_the_longest_motion_or_is_furthest_beyond() -> None:
    def timed(kind: str, factor: float, value: float) -> Finding:
        return found(kind, value=value, factor=factor, hint="give it more time")

    # a jerk that is 8 times its limit asks for twice the time, a velocity that is 3 times for three times
    assert _causes(timed("jerk", 2.0, 8.0), timed("velocity", 3.0, 3.0)) == [(1, 0)]
    assert _causes(timed("velocity", 3.0, 3.0), timed("jerk", 2.0, 8.0)) == [(0, 1)]
    assert _causes(timed("jerk", 2.0, 4.0), timed("jerk", 2.0, 8.0), timed("jerk", 2.0, -5.0)) == [(1, 0, 2)]
    step = found("acceleration_jump", value=1.0, hint="use another curve")
    assert _causes(found("jerk", value=99.0, hint="use another curve"), step) == [(1, 0)]
    # of positions by distance, on either side, however near to 0 the limit is
    low, lower = (found("position", value=-0.5, limit=limit) for limit in (-0.4, -0.1))
    assert _causes(low, lower) == [(1, 0)]
    high, higher = (found("position", value=0.5, limit=limit) for limit in (0.4, 0.0))
    assert _causes(high, higher) == [(1, 0)]
