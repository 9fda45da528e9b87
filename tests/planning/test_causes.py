"""Causes of findings: a move that is too short, a point outside its limit, and what is apart stays apart."""

from __future__ import annotations

from pathlib import Path

from trajcli.job.read import job_from_text, load_job
from trajcli.output.report import verification_error
from trajcli.planning.causes import causes_of
from trajcli.planning.plan import plan_job

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
