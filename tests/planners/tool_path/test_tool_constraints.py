"""What a law names is what comes out, or is refused: durations, speeds and turns against the textbook's formulas."""

from __future__ import annotations

import json

import numpy as np
import pytest
from tool_jobs import LENGTH, LIMITS, START, TCP, TO, line, plan, planned, poses_of, refusal, times_of

from trajcli.errors import TrajcliError
from trajcli.job.read import job_from_text
from trajcli.planning.plan import plan_job

TURN = {"rpy": [np.pi, 0, 0.8]}
ANGLE = 0.8
PLACE = {"xyz": TO["xyz"]}
IN_MM = {"angle": "deg", "length": "mm"}
START_MM = {"xyz": [400, 100, 50], "rpy": [180, 0, 0], "configuration": START["configuration"]}
LIMITS_MM = {"acceleration": 6000, "tcp": {"speed": 250, "acceleration": 2000, "angular_speed": 90}}


def tcp(**values):
    return {**LIMITS, "tcp": {**TCP, **values}}


def peak_of_law(made):
    law = made.moves[0].planned.tool.law
    return np.abs(law.evaluate_orders(times_of(made, 4001), (1,))[:, 0, 0]).max()


def trapezoid_speed(way, duration, acceleration):
    """The smaller root of v^2 / a - v T + way = 0."""
    return (duration - np.sqrt(duration**2 - 4 * way / acceleration)) * acceleration / 2


def in_mm(*moves):
    job = {"version": 1, "units": IN_MM, "robot": "ur5e", "limits": LIMITS_MM, "start": START_MM}
    return json.dumps({**job, "moves": list(moves)})


def refused_in_mm(move):
    with pytest.raises(TrajcliError) as caught:
        plan_job(job_from_text(in_mm(move)))
    return caught.value.problems[0]


def test_a_speed_and_a_duration_are_kept_although_the_rotation_is_too_fast_then():
    """At 0.2 m/s the tool turns by 0.8 rad / LENGTH x 0.2 m/s: that breaks its limit, and is not made slower."""
    made = planned(
        "ur5e", START, line(law={"duration": 2, "speed": 0.2}), limits=tcp(angular_speed=0.5), advise=False
    )
    assert peak_of_law(made) == pytest.approx(0.2, rel=1e-12)
    (found,) = made.verdict.findings
    assert found.kind == "tool_angular_speed"
    assert found.value == pytest.approx(ANGLE / LENGTH * 0.2, rel=1e-6)


@pytest.mark.parametrize(
    ("target", "law", "way", "acceleration"),
    [
        (TURN, {"duration": 2, "speed": 0.6}, ANGLE, TCP["angular_acceleration"]),
        (PLACE, {"duration": 2, "angular_speed": 0.6}, LENGTH, TCP["acceleration"]),
        (TO, {"duration": 2, "angular_acceleration": 1.0}, LENGTH, LENGTH / ANGLE),
        (TO, {"duration": 2, "acceleration": 5.0}, LENGTH, 5.0),
    ],
)
def test_a_trapezoid_of_a_duration_has_the_ramps_that_are_named(target, law, way, acceleration):
    """A speed of what the tool does not do says nothing; ramps that are named are not made flatter by limits."""
    made = planned("ur5e", START, line(target, law=law), advise=False)
    assert made.trajectory.duration == pytest.approx(2, abs=1e-12)
    assert peak_of_law(made) == pytest.approx(trapezoid_speed(way, 2, acceleration), rel=1e-9)


@pytest.mark.parametrize(
    ("shape", "law", "said"),
    [
        ("cubic", {"speed": 0.1}, 1.5 * LENGTH / 2),
        ("quintic", {"speed": 0.1}, 1.875 * LENGTH / 2),
        ("quintic", {"acceleration": 0.1}, 10 / np.sqrt(3) * LENGTH / 4),
        ("cycloidal", {"acceleration": 0.1, "speed": 0.25}, 2 * np.pi * LENGTH / 4),
        ("cubic", {"jerk": 0.3}, 12 * LENGTH / 8),
    ],
)
def test_a_polynomial_does_not_exceed_in_a_duration_what_the_law_names(shape, law, said):
    error = refusal("ur5e", START, line(law={"shape": shape, "duration": 2, **law}))
    assert error.exit_code == 3
    assert f"reaches {said:.9g} m/s" in str(error)
    enough = {name: 1.01 * value for name, value in zip(law, [said] * len(law), strict=True)} | {
        "speed": 2 * LENGTH
    }
    plan("ur5e", START, line(law={"shape": shape, "duration": 2, **enough}), limits=tcp(speed=1))


def test_a_turn_is_said_in_the_unit_of_angles():
    problem = refused_in_mm(line({"rpy": [180, 0, 45]}, law={"duration": 1, "angular_speed": 200}))
    assert "over 45 deg in 1 s cannot have 200 deg/s" in problem.message
    assert "above 45 deg/s and at most 90 deg/s" in problem.message


def test_a_turn_in_place_has_no_jerk_that_could_be_limited():
    error = refusal("ur5e", START, line(TURN, law={"shape": "jerk_limited", "jerk": 20}))
    assert error.exit_code == 2
    assert "no limit of it" in str(error)
    assert "limits" not in error.problems[0].hint


@pytest.mark.full
def test_overlapping_segments_last_at_least_as_long_as_they_are_told():
    segments = [{"line": {"xyz": place}} for place in ([0.5, 0.1, 0.05], [0.5, 0.3, 0.05], [0.4, 0.3, 0.05])]
    move = {"planner": "path", "segments": segments, "corner": "overlap", "overlap": 0.1}
    made = plan("ur5e", START, {**move, "law": {"shape": "quintic", "minimum_duration": 9}})
    assert made.trajectory.duration == pytest.approx(9, rel=1e-12)
    free = plan("ur5e", START, {**move, "law": {"shape": "quintic", "minimum_duration": 0.5}})
    assert (
        free.trajectory.duration
        == plan("ur5e", START, {**move, "law": {"shape": "quintic"}}).trajectory.duration
    )


def test_a_screw_to_where_the_tool_is_holds():
    still = {name: START[name] for name in ("xyz", "rpy")}
    assert plan("ur5e", START, {"planner": "screw", "to": still}).trajectory.duration == 0
    made = plan("ur5e", START, {"planner": "screw", "to": still, "law": {"duration": 2}})
    assert made.trajectory.duration == 2
    assert np.ptp(poses_of(made, times_of(made, 11)), axis=0).max() == 0


@pytest.mark.parametrize("planner", ["line", "screw"])
def test_no_way_leads_to_another_branch(planner):
    still = {name: START[name] for name in ("xyz", "rpy")}
    move = {"planner": planner, "to": {**still, "configuration": {"elbow": "down"}}}
    error = refusal("ur5e", START, move)
    assert error.exit_code == 3
    assert "not down" in str(error)


def test_a_center_within_a_path_is_moved_with_an_event():
    """Half of 0.1 mm out of place: what typed digits leave."""
    arc = {"arc": {"center": [450, 150.02, 50], "axis": "z", "to": {"xyz": [450, 200, 50]}}}
    segments = [{"line": {"xyz": [450, 100, 50]}}, arc]
    for corner in ({"corner": "stop"}, {"corner": "overlap", "overlap": 0.1}):
        move = {"planner": "path", "segments": segments, **corner, "law": {"shape": "quintic", "duration": 5}}
        (event,) = plan_job(job_from_text(in_mm(move))).events
        assert event.kind == "moved_center"
        assert float(event.message.split("moved by ")[1].split(" mm")[0]) == pytest.approx(0.02, rel=1e-6)


@pytest.mark.parametrize(
    ("move", "said", "advice"),
    [
        (
            {"planner": "arc", "via": {"xyz": [450, 100, 50]}, "to": {"xyz": [500, 100, 50]}},
            "start [400, 100, 50] mm, via [450, 100, 50] mm and target [500, 100, 50] mm are collinear",
            "line",
        ),
        (
            {"planner": "arc", "center": [400, 130, 50], "to": {"xyz": [450, 130, 50]}},
            "is 30 mm from the start and 50 mm from the target",
            "] mm",
        ),
        (
            {"planner": "arc", "center": [400, 150, 40], "axis": "z", "angle": 90},
            "along the axis they are 10 mm apart",
            "[400, 150, 50] mm",
        ),
        (
            {"planner": "arc", "center": [400, 150, 50], "axis": "z", "to": {"xyz": [440, 150, 80]}},
            "the target lies 30 mm off the plane",
            "helix",
        ),
        ({"planner": "arc", "center": [400, 150, 50], "axis": "z", "angle": 0}, "an angle of 0 deg", None),
        (
            {"planner": "arc", "center": [400, 100, 70], "axis": "z", "angle": 9},
            "through [400, 100, 70] mm",
            "",
        ),
        (
            {"planner": "path", "corner": "stop", "segments": [{"line": {"xyz": [400, 100, 50]}}]},
            "needs more than 1e-06 mm",
            "leave it out",
        ),
    ],
)
def test_what_is_no_path_is_said_in_the_units_of_the_job(move, said, advice):
    problem = refused_in_mm(move)
    assert said in problem.message
    assert (advice or "") in (problem.hint or "")
    assert "{" not in problem.message.replace("{to", "")


def test_a_corner_that_takes_a_whole_segment_joins_the_end():
    """The blend ends where the path does, up to rounding: there is no break, and no piece, between them."""
    joints = [-1.66752011948737, 0.29942741921032, -0.62341586190313, 0.82016953970214, -1.8197573599624, 0.6]
    ends = [
        [0.0955806261384, -0.4284773513887, 0.4435896067094],
        [0.0858429133187, -0.4040183860336, 0.4476855770441],
    ]
    segments = [{"line": {"xyz": end}} for end in ends]
    limits = {**LIMITS, "acceleration": 30.0}
    for law in ({"shape": "time_optimal"}, {"shape": "quintic"}):
        move = {"planner": "path", "segments": segments, "radius": 0.05, "law": law}
        made = plan("elbow6r", {"joints": joints}, move, limits=limits)
        breaks = made.moves[0].planned.tool.path.breaks
        assert np.diff(breaks).min() > 1e-6
        assert made.events[0].kind == "shrunk"
        np.testing.assert_allclose(poses_of(made, times_of(made, 2))[-1, :3, 3], ends[-1], atol=2e-6)
