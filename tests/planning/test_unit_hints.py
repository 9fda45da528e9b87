"""Degrees read as radians and millimetres read as metres are recognised; doing what the hint says works."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from trajcli.errors import MissingLimitError, PlanningError
from trajcli.job.read import job_from_text, load_job
from trajcli.planning.advice import unit_hint
from trajcli.planning.plan import plan_job

JOINTS = "start: {joints: [0, -90, 90, 0, 90, 0]}\n"
SWING = "moves: [{planner: quintic, to: {joints: [30, -90, 90, 0, 90, 0]}, duration: 3}]\n"
POSE = "moves: [{planner: quintic, to: {xyz: [400, 100, 250], rpy: [180, 0, 0]}, duration: 6}]\n"
LINE = (
    "points: {pick: {xyz: [400, 100, 250], rpy: [3.14159, 0, 0]}}\nstart: {joints: [0, -1.6, 1.6, 0, 1.6, 0]}\n"
    "moves: [{planner: quintic, to: {from: pick}, duration: 6}]\n"
)


def hints_of(text: str) -> list[str]:
    try:
        verdict = plan_job(job_from_text(text, "job.yaml")).verdict
    except PlanningError as error:
        return [problem.hint or "" for problem in error.problems]
    return [finding.hint or "" for finding in verdict.findings if finding.kind == "position"]


@pytest.mark.parametrize(
    ("head", "units"),
    [
        (f"version: 1\nrobot: ur5e\n{JOINTS}{SWING}", "{angle: deg}"),
        (f"version: 1\nrobot: ur5e\nunits: {{length: mm}}\n{JOINTS}{SWING}", "{angle: deg, length: mm}"),
        (f"version: 1\nrobot: ur5e\n{JOINTS}{POSE}", "{angle: deg, length: mm}"),
        (f"version: 1\nrobot: ur5e\nunits: {{angle: deg}}\n{JOINTS}{POSE}", "{angle: deg, length: mm}"),
        (f"version: 1\nrobot: ur5e\n{LINE}", "{length: mm}"),
    ],
)
def test_following_the_hint_to_the_letter_works(head: str, units: str) -> None:
    hints = hints_of(head)
    assert hints
    assert all(f"say `units: {units}`" in hint for hint in hints), hints
    said = re.search(r"say `(units: \{.*?\})`", hints[0])
    assert said is not None
    without = re.sub(r"^units:.*\n", "", head, flags=re.MULTILINE)
    assert plan_job(job_from_text(f"{without}{said[1]}\n")).verdict.passed


def test_numbers_that_fit_or_have_their_unit_get_no_hint_about_units() -> None:
    near = POSE.replace("[400, 100, 250]", "[4 m, 100 mm, 250 mm]").replace("180", "180 deg")
    (hint,) = hints_of(f"version: 1\nrobot: ur5e\nstart: {{joints: [0, -90 deg, 90 deg, 0, 1, 0]}}\n{near}")
    assert "units" not in hint
    moving = "start: {joints: 0}\nmoves: [{planner: quintic, to: {joints: 90}, duration: 3}]\n"
    assert hints_of(f"version: 1\nrobot: {{joints: 2}}\n{moving}") == []  # a conveyor may turn often


def test_an_arc_that_goes_round_several_times_is_no_arc_in_degrees() -> None:
    """Five turns are 31.4 rad: read in degrees they would be a tenth of one. A pose turns by one at most."""
    head = "version: 1\nrobot: ur5e\nstart: {joints: [0, -1.6, 1.6, 0, 1.6, 0]}\n"
    helix = "{planner: arc, center: [0.5, 0.1, 0.3], axis: [0, 0, 1], angle: 31.4, pitch: 0.01}"
    assert unit_hint(job_from_text(f"{head}moves: [{helix}]\n", "job.yaml")) is None
    pose = "{xyz: [0.5, 0.1, 0.3], axis_angle: {axis: [1, 0, 0], angle: 31.4}}"
    hint = unit_hint(job_from_text(f"{head}moves: [{{planner: quintic, to: {pose}}}]\n", "job.yaml"))
    assert hint is not None
    assert "angles up to 31.4 look like degrees" in hint


def test_an_unreachable_point_is_named_where_it_stands_in_the_units_of_the_job() -> None:
    text = (
        "version: 1\nunits: {angle: deg, length: mm}\nrobot: ur5e\npoints:\n  far: {xyz: [4000, 0, 300]}\n"
        f"{JOINTS}moves: [{{planner: quintic, to: far, duration: 3}}]\n"
    )
    with pytest.raises(PlanningError) as caught:
        plan_job(job_from_text(text, "job.yaml"))
    (problem,) = caught.value.problems
    assert str(problem.place) == "job.yaml:5:8"
    assert problem.message.startswith("move 0, -> far (quintic): the point 'far': UR5e cannot reach the pose")
    millimetres = re.search(r"within ([0-9.]+) mm and ([0-9.]+) deg", problem.message)
    assert millimetres is not None
    assert 2500 < float(millimetres[1]) < 4000  # the arm is about 0.95 m long, its shoulder at the origin


def test_a_start_is_the_first_row_of_a_recording(tmp_path: Path) -> None:
    rows = np.rad2deg([[0.1, 0.2], [0.3, 0.5], [0.4, 0.9]])
    lines = ["t,q1_deg,q2_deg", *(f"{k},{a!r},{b!r}" for k, (a, b) in enumerate(rows.tolist()))]
    (tmp_path / "led.csv").write_text("\n".join(lines) + "\n")
    job = tmp_path / "job.yaml"
    moves = "moves: [{planner: spline, through: {csv: led.csv}}]\n"
    job.write_text(f"version: 1\nrobot: {{joints: 2}}\nstart: {{csv: led.csv}}\n{moves}")
    plan = plan_job(load_job(job))
    assert plan.trajectory.duration == 2
    np.testing.assert_allclose(
        plan.trajectory.curve.evaluate(np.array([0.0, 1, 2])), np.deg2rad(rows), atol=1e-12
    )
    job.write_text(f"version: 1\nunits: {{angle: deg}}\nrobot: {{joints: 2}}\nstart: {{joints: 0}}\n{moves}")
    with pytest.raises(PlanningError) as caught:
        plan_job(load_job(job))
    (problem,) = caught.value.problems
    assert (
        f"it has j2 at {np.rad2deg(0.2):.9g} deg, the arm at 0 deg, {np.rad2deg(0.2):.9g} deg apart"
        in problem.message
    )
    assert "`start: {csv: ...}`" in (problem.hint or "")


GANTRY = "robot: {convention: standard, joints: [{name: turn, a: 0.4, d: -0.2}, {name: lift, type: prismatic, a: 0.3, d: 0.1}]}\n"  # 1 m of lengths: what is ten times as far is meant otherwise


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("start: {joints: [-90, 0]}\nmoves: [{planner: hold, duration: 1}]\n", "angles up to 90 |deg"),
        ("start: {joints: [0, 0]}\nmoves: [{planner: hold, duration: 1}]\npoints: {a: {joints: [90, 0]}}\n", "90 |deg"),
        ("start: {joints: [0, 0]}\nmoves: [{planner: quintic, to: {joints: {turn: -90, lift: 0}}}]\n", "90 |deg"),
        ("start: {joints: [0, 0]}\nmoves: [{planner: quintic, to: {joints: {lift: -90, turn: 0}}}]\n", "lengths up to 90 |mm"),
        ("start: {joints: [13, -90]}\nmoves: [{planner: hold, duration: 1}]\n", "13 .*lengths up to 90 |deg, length: mm"),
        ("start: {joints: [0, 10.1]}\nmoves: [{planner: hold, duration: 1}]\n", "lengths up to 10.1 |mm"),
        ("start: {joints: [0, 9.9]}\nmoves: [{planner: hold, duration: 1}]\n", ""),
        ("start: {joints: [12.5, 0]}\nmoves: [{planner: hold, duration: 1}]\n", ""),
        ("start: {joints: [-12.6, 0]}\nmoves: [{planner: hold, duration: 1}]\n", "12.6 |deg"),
        ("start: {joints: [0, 0]}\nbase: {xyz: [0, 0, -700]}\nmoves: [{planner: hold, duration: 1}]\n", "700 |mm"),
        ("start: {joints: [0, 0]}\ntool: {rpy: [0, 0, -180]}\nmoves: [{planner: hold, duration: 1}]\n", "180 |deg"),
        ("units: {angle: deg}\nstart: {joints: [90, 0]}\nmoves: [{planner: hold, duration: 1}]\n", ""),
        ("units: {length: mm}\nstart: {joints: [0, 90]}\nmoves: [{planner: hold, duration: 1}]\n", ""),
        (
            "units: {length: mm}\nstart: {joints: [90, 90]}\nmoves: [{planner: hold, duration: 1}]\n",
            "90 |{angle: deg, length: mm}",
        ),
    ],
)  # fmt: skip
def test_which_numbers_are_too_large_for_what_they_measure(text: str, said: str) -> None:
    hint = unit_hint(job_from_text(f"version: 1\n{GANTRY}{text}", "job.yaml"))
    words, _, units = said.partition("|")
    assert (hint is None) == (not said)
    if hint is not None:
        assert re.search(words, hint)
        assert hint.endswith(f"{units.removesuffix('}')}}}`")
        assert ("look like degrees" in hint) == ("deg" in units)


def test_of_bare_joints_what_is_fifty_metres_away_is_too_far() -> None:
    for value, hinted in ((51, True), (49, False)):
        text = f"version: 1\nrobot: {{joints: [{{type: prismatic}}]}}\nstart: {{joints: {value}}}\n"
        hint = unit_hint(job_from_text(text + "moves: [{planner: hold, duration: 1}]\n", "job.yaml"))
        assert (hint is not None) == hinted


def findings_of(limits: str, *targets: float) -> dict[tuple[int | None, str], str]:
    """Return the hints of what is wrong with moves of a turning joint, by move and kind."""
    moves = "".join(f"  - {{planner: cubic, to: {{joints: {target}}}, duration: 1}}\n" for target in targets)
    text = f"version: 1\nrobot: {{joints: 1}}\nlimits: {limits}\nstart: {{joints: 0}}\nmoves:\n{moves}"
    verdict = plan_job(job_from_text(text, "job.yaml")).verdict
    return {(finding.move, finding.kind): finding.hint or "" for finding in verdict.findings}


def test_rates_are_over_their_limits_because_of_units_where_a_position_is() -> None:
    """A spindle may turn often, and too fast; one of four turns at most is meant in degrees, in all its moves."""
    spindle = findings_of("{velocity: 20}", 20, 90)
    assert set(spindle) == {(0, "velocity"), (1, "velocity")}
    assert not any("units" in hint for hint in spindle.values())
    found = findings_of("{velocity: 20, position: [[-25, 25]], jerk: 1000}", 20, 90)
    assert {(0, "velocity"), (1, "velocity"), (1, "position")} <= set(found)
    for (_, kind), hint in found.items():
        assert ("angles up to 90 look like degrees" in hint) == (kind in ("velocity", "position")), (
            kind,
            hint,
        )


def test_an_error_keeps_what_else_would_help() -> None:
    """What lacks is no matter of units; a point that is not reached may be, or not."""
    (hint,) = hints_of(f"version: 1\nrobot: ur5e\n{JOINTS}{POSE}")
    (own,) = hints_of(
        "version: 1\nrobot: ur5e\nstart: {joints: 0}\n"
        + POSE.replace("[400, 100, 250], rpy: [180", "[4, 1, 2], rpy: [1")
    )
    assert own
    assert hint.startswith("angles up to 180 look like degrees")
    assert hint.endswith(f"; else {own}")
    lacking = "moves: [{planner: trapezoid, to: {joints: [90, 0, 0, 0, 0, 0]}}]\n"
    with pytest.raises(MissingLimitError) as caught:
        plan_job(job_from_text(f"version: 1\nrobot: ur5e\nstart: {{joints: 0}}\n{lacking}", "job.yaml"))
    assert "units" not in (caught.value.problems[0].hint or "")


def test_an_angle_of_a_pose_that_looks_like_degrees_is_an_event() -> None:
    """It is reached as it stands: 180 rad are 5.8 degrees more than 28 turns and a half."""
    text = "version: 1\nrobot: ur5e\nstart: {joints: [0, -1.5, 1, 0, 1, 0]}\n"
    for roll, events in (("180", ["units"]), ("180 deg", []), ("3", [])):
        target = f"{{xyz: [0.4, 0.1, 0.2], rpy: [{roll}, 0, 0]}}"
        plan = plan_job(job_from_text(f"{text}moves: [{{planner: quintic, to: {target}, duration: 9}}]\n"))
        assert [event.kind for event in plan.events] == events
        assert all("angles up to 180 look like degrees" in event.message for event in plan.events)
