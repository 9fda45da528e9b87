"""Limits of the tool in joint space: an arm of one link, whose tool obeys v = L qd, and a UR5e by differences."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from random_jobs import loaded
from tiers import few

from trajcli.cli.plan import summary
from trajcli.kinematics.forward import forward
from trajcli.output.report import report_of
from trajcli.planning.plan import Plan, plan_job

LEVER, TURN, SPEED = 0.5, 1.2, 0.25
ONE_LINK = {"convention": "standard", "joints": [{"a": LEVER}]}
UR5E_SWING = {
    "version": 1,
    "robot": "ur5e",
    "units": {"angle": "deg", "length": "mm"},
    "limits": {"acceleration": 800, "jerk": 8000, "tcp": {"speed": 250}},
    "start": {"joints": [0, -90, 90, -90, -90, 0]},
    "moves": [{"planner": "jerk_limited", "to": {"joints": [90, -60, 60, -90, -90, 0]}}],
}
PEAKS = {"cubic": 1.5, "quintic": 15 / 8, "septic": 35 / 16, "cycloidal": 2.0}  # of the speed, by textbook


def job(move: dict[str, Any], tcp: dict[str, float], **more: Any) -> dict[str, Any]:
    return {
        "version": 1,
        "robot": ONE_LINK,
        "limits": {"velocity": 3, "acceleration": 20, "tcp": tcp},
        "start": {"joints": [0.1]},
        "moves": [{"to": {"joints": [0.1 + TURN]}, **move}],
        **more,
    }


def planned(*arguments: Any, **more: Any) -> Plan:
    return plan_job(loaded(job(*arguments, **more)))


def fastest_sampled(plan: Plan) -> float:
    """Return the largest speed of the tool by differences of positions at 5000 times."""
    t = np.linspace(0, plan.trajectory.duration, 5001)
    positions = forward(plan.loaded.robot, plan.trajectory.curve.evaluate(t))[:, :3, 3]
    return float(np.linalg.norm(np.diff(positions, axis=0), axis=1).max() / (t[1] - t[0]))


@pytest.mark.parametrize("planner", PEAKS)
def test_the_fastest_duration_of_a_law_respects_the_speed_of_the_tool(planner: str) -> None:
    plan = planned({"planner": planner}, {"speed": SPEED})
    assert plan.verdict.passed
    assert plan.trajectory.duration == pytest.approx(PEAKS[planner] * LEVER * TURN / SPEED, rel=2e-6)
    (event,) = plan.events
    assert (event.kind, event.concedes) == ("within_tool_limits", True)
    assert "to keep the speed limit of the tool" in event.message


@pytest.mark.parametrize("planner", ["trapezoid", "spline", "blends"])
def test_other_planners_are_stretched_and_say_so(planner: str) -> None:
    move: dict[str, Any] = {"planner": planner}
    if planner in ("spline", "blends"):
        move |= {"through": [{"joints": [0.7]}]}
    plan = planned(move, {"speed": SPEED})
    assert plan.verdict.passed
    assert fastest_sampled(plan) == pytest.approx(SPEED, rel=1e-4)
    event = next(event for event in plan.events if event.kind == "stretched")
    assert event.concedes
    assert "a faster motion may exist" in event.message


@pytest.mark.parametrize("planner", ["jerk_limited", "time_optimal"])
def test_the_fastest_law_on_the_same_line_keeps_the_tool(planner: str) -> None:
    """One link: v = L qd is a limit of the joint, and of that the fastest law is known in closed form."""
    jerk, top = 300.0, SPEED / LEVER
    more = {"limits": {"jerk": jerk}} if planner == "jerk_limited" else {}
    plan = planned({"planner": planner, **more}, {"speed": SPEED})
    assert plan.verdict.passed
    ramps = 2 * np.sqrt(top / jerk) if more else top / 20
    assert plan.trajectory.duration == pytest.approx(TURN / top + ramps, rel=2e-3)
    assert fastest_sampled(plan) == pytest.approx(SPEED, rel=1e-4)
    (event,) = [event for event in plan.events if event.kind == "within_tool_limits"]
    assert event.concedes
    assert "to keep the speed limit of the tool" in event.message
    assert ("straight line" in event.message) == (planner == "jerk_limited")


@pytest.mark.parametrize(
    ("tcp", "most"),
    few(
        [
            ({"speed": 1000}, 1.18),
            ({"speed": 250}, 3.91),
            ({"speed": 1000, "acceleration": 5000}, 1.24),
            ({"angular_speed": 60, "speed": 1000}, 1.69),
            ({"jerk": 50_000}, 0.918),
            ({"speed": 700, "acceleration": 3000, "jerk": 20_000}, 1.74),
        ],
        2,
    ),
)
def test_a_swing_is_not_stretched_as_a_whole(tcp: dict[str, float], most: float) -> None:
    """Stretched alike everywhere it took 1.641, 6.563, 1.641, 2.475, 1.137 and 2.344 s.

    No motion along the line is faster than its length at the largest speed of the tool.
    """
    swing = UR5E_SWING | {"limits": {"acceleration": 800, "jerk": 8000, "tcp": tcp}}
    plan = plan_job(loaded(swing))
    assert plan.verdict.passed
    duration = plan.trajectory.duration
    line = np.linspace(*np.radians([[0, -90, 90, -90, -90, 0], [90, -60, 60, -90, -90, 0]]), 4001)
    steps = np.diff(forward(plan.loaded.robot, line)[:, :3, 3], axis=0)
    assert np.linalg.norm(steps, axis=1).sum() / (tcp.get("speed", 1e9) / 1000) <= duration <= most
    on_line = plan.trajectory.curve.evaluate(np.linspace(0, duration, 301)) - line[0]
    along = (on_line @ (line[-1] - line[0])) / np.square(line[-1] - line[0]).sum()
    np.testing.assert_allclose(on_line, along[:, None] * (line[-1] - line[0]), atol=1e-9)
    bounds = [event for event in plan.remarks if event.kind == "bound"]
    assert all("at most" in event.message for event in bounds)


@pytest.mark.parametrize("least", few([1.2, 0.5], 1))
def test_a_swing_within_a_limit_of_the_tool_lasts_as_long_as_it_is_to_last_at_least(least: float) -> None:
    """Within the speed it lasts 1.18 s, and 1.641 s where it is stretched alike everywhere."""
    (move,) = UR5E_SWING["moves"]
    swing = UR5E_SWING | {"limits": {"acceleration": 800, "jerk": 8000, "tcp": {"speed": 1000}}}
    plan = plan_job(loaded(swing | {"moves": [move | {"minimum_duration": least}]}))
    assert plan.verdict.passed
    assert plan.trajectory.duration == pytest.approx(max(least, 1.175), rel=1e-9 if least > 1 else 0.01)
    assert "within_tool_limits" in {event.kind for event in plan.events}


@pytest.mark.parametrize(
    ("planner", "of_joint"),
    few(
        [
            ("jerk_limited", {}),
            ("jerk_limited", {"jerk": 300}),
            ("time_optimal", {"jerk": 300}),
            ("time_optimal", {}),
        ],
        2,
    ),
)
def test_the_fastest_law_within_an_angular_jerk(planner: str, of_joint: dict[str, float]) -> None:
    """w = qd: four ramps of one length, (32 L / J)^(1/3) s in all, with or without a limit of the joint."""
    plan = planned({"planner": planner, "limits": of_joint}, {"angular_jerk": 6.0})
    assert plan.verdict.passed
    assert plan.trajectory.duration == pytest.approx((32 * TURN / 6.0) ** (1 / 3), rel=3e-4)
    (event,) = [event for event in plan.events if event.kind == "within_tool_limits"]
    assert "to keep the angular jerk limit of the tool" in event.message


@pytest.mark.parametrize("jerk", [1.0, 5.0])
def test_a_jerk_of_the_tool_of_a_slide_is_that_of_its_joint(jerk: float) -> None:
    slide = {"convention": "standard", "joints": [{"type": "prismatic"}]}
    more = {"robot": slide, "moves": [{"planner": "jerk_limited", "to": {"joints": [1.3]}}]}
    durations = []
    for limits in ({"jerk": jerk}, {"tcp": {"jerk": jerk}}):
        plan = plan_job(loaded(job({}, {}) | more | {"limits": {"velocity": 1, "acceleration": 2, **limits}}))
        assert plan.verdict.passed
        durations.append(plan.trajectory.duration)
    assert durations[0] * (1 - 1e-9) <= durations[1] <= durations[0] * 1.001


@pytest.mark.parametrize("tcp", [{"speed": 0.02}, {"angular_speed": 0.04}])
def test_the_bound_counts_the_way_and_the_turn_of_the_tool(tcp: dict[str, float]) -> None:
    """So slow a link needs nothing but its way: L times the turn, or the turn itself, at the largest speed."""
    plan = planned({"planner": "time_optimal"}, tcp)
    way = TURN * LEVER / 0.02 if "speed" in tcp else TURN / 0.04
    (bound,) = [event for event in plan.remarks if event.kind == "bound"]
    seconds = float(bound.message.split(" ask for ")[1].split()[0])
    assert way * (1 - 1e-5) <= seconds <= plan.trajectory.duration <= 1.01 * way


def test_a_least_duration_is_kept() -> None:
    plan = planned(
        {"planner": "jerk_limited", "minimum_duration": 2.6, "limits": {"jerk": 300}}, {"speed": SPEED}
    )
    assert plan.trajectory.duration == pytest.approx(2.6, rel=1e-9)
    assert fastest_sampled(plan) < SPEED


def test_an_acceleration_counts_as_a_vector() -> None:
    """|a| = L sqrt(qdd^2 + qd^4) of a tool on a circle; scaled by time it goes with 1 / T^2."""
    plan = planned({"planner": "quintic"}, {"acceleration": 0.5})
    t = np.linspace(0, 1, 200_001)
    qd, qdd = TURN * (30 * t**2 - 60 * t**3 + 30 * t**4), TURN * (60 * t - 180 * t**2 + 120 * t**3)
    assert plan.trajectory.duration == pytest.approx(
        np.sqrt(LEVER * np.hypot(qdd, qd**2).max() / 0.5), rel=2e-6
    )


def test_a_given_duration_is_judged_and_not_changed() -> None:
    plan = planned({"planner": "quintic", "duration": 1}, {"speed": SPEED})
    assert plan.trajectory.duration == 1
    (finding,) = plan.verdict.findings
    peak = 15 / 8 * LEVER * TURN
    assert (finding.kind, finding.joint, finding.method) == ("tool_speed", None, "bounded")
    assert (finding.value, finding.limit) == (pytest.approx(peak, rel=1e-6), SPEED)
    assert (finding.time, finding.factor) == (
        pytest.approx(0.5, abs=0.02),
        pytest.approx(peak / SPEED, rel=1e-6),
    )
    assert finding.hint is not None
    assert f"{finding.factor:.6g} times longer" in finding.hint
    again = planned({"planner": "quintic", "duration": finding.factor}, {"speed": SPEED})
    assert again.verdict.passed


def test_slow_stretches_a_given_duration() -> None:
    plan = planned({"planner": "quintic", "duration": 1}, {"speed": SPEED}, when_over_limit="slow")
    assert plan.verdict.passed
    assert plan.trajectory.duration == pytest.approx(15 / 8 * LEVER * TURN / SPEED, rel=2e-6)
    assert [event.kind for event in plan.events] == ["slowed"]


@pytest.mark.full
@pytest.mark.parametrize("given", [{}, {"duration": 0.9}])
def test_between_moving_states_the_search_sees_the_tool(given: dict[str, float]) -> None:
    move = {"planner": "quintic", "to": {"joints": [0.1 + TURN], "velocity": [0.3]}, **given}
    plan = planned(move, {"speed": SPEED}, when_over_limit="slow")
    assert plan.verdict.passed
    assert fastest_sampled(plan) == pytest.approx(SPEED, rel=1e-4)
    assert plan.trajectory.curve.evaluate(plan.trajectory.duration, 1)[0] == pytest.approx(0.3, rel=1e-9)


def test_a_boundary_speed_over_the_limit_is_past_help() -> None:
    move = {"planner": "quintic", "to": {"joints": [0.1 + TURN], "velocity": [0.6]}}
    plan = planned(move, {"speed": SPEED}, when_over_limit="slow")
    assert {finding.kind for finding in plan.verdict.findings} == {"tool_speed"}
    strict = planned(move, {"speed": SPEED})
    assert strict.verdict.findings[0].hint == (
        "slowing down does not help: the tool is too fast where the move starts or ends"
    )


def test_the_collaborative_speed_of_a_cell() -> None:
    """A swing of a UR5e at 1601 mm/s was verified under 250 mm/s."""
    plan = plan_job(loaded(UR5E_SWING))
    assert plan.verdict.passed
    assert fastest_sampled(plan) == pytest.approx(0.25, rel=1e-4)
    assert fastest_sampled(plan) < 0.25 * (1 + 1e-6)
    report = report_of(plan)
    (speed,) = [peak for peak in report.moves[0].tool_peaks or [] if peak.quantity == "speed"]
    assert (speed.value, speed.limit) == (pytest.approx(0.25, rel=1e-6), 0.25)
    assert "in move 0, 100 % used" in summary(plan, 0)


def test_what_cannot_be_judged_is_named() -> None:
    bare = job({"planner": "quintic", "duration": 9}, {"speed": SPEED, "jerk": 1.0})
    with_geometry = plan_job(loaded(bare))
    assert with_geometry.verdict.passed
    assert with_geometry.verdict.unchecked_of_tool == ()
    plan = plan_job(loaded({**bare, "robot": {"joints": 1}}))
    assert plan.verdict.passed
    assert plan.verdict.unchecked_of_tool == ("speed", "jerk")
    assert "  limited, but not checked in every move: speed, jerk of the tool" in summary(plan, 0)
    assert [each.quantity for each in report_of(plan).unchecked_of_tool] == ["speed", "jerk"]


def test_what_is_only_sampled_is_said() -> None:
    """On a path the branch is looked at on rows; in joint space there is no such thing."""
    line = {"planner": "line", "to": {"xyz": [0.4, 0.0, 0.3]}}
    lines = {
        "version": 1,
        "robot": "ur5e",
        "limits": {"acceleration": 10, "tcp": {"speed": 0.2, "acceleration": 1}},
        "start": {"xyz": [0.4, 0.1, 0.3]},
        "moves": [line, {"planner": "cubic", "to": {"xyz": [0.4, 0.1, 0.3]}}, line],
    }
    plan = plan_job(loaded(lines))
    assert plan.verdict.passed
    assert plan.verdict.sampled == (("branch", (0, 2)),)
    assert "\n  on samples only: branch, moves 0, 2" in summary(plan, 0)
    tools = [move.tool for move in report_of(plan).moves]
    assert [tool and tool.method for tool in tools] == ["bounded", None, "bounded"]
    assert all(tool.deviation <= (tool.deviation_bound or 0) <= 1e-6 for tool in tools if tool)
    assert all(tool.turned <= (tool.turned_bound or 0) <= 1e-6 for tool in tools if tool)
    joints = planned({"planner": "quintic", "duration": 3}, {"speed": 1})
    assert "on samples only" not in summary(joints, 0)


def test_what_of_a_path_with_overlapping_segments_is_sampled_is_said() -> None:
    points = [{"xyz": [0.4, 0.05, 0.3]}, {"xyz": [0.45, 0.1, 0.3]}]
    job = {
        "version": 1,
        "robot": "ur5e",
        "limits": {"acceleration": 10, "tcp": {"speed": 0.2, "acceleration": 1}},
        "start": {"xyz": [0.4, 0.0, 0.3]},
        "moves": [
            {
                "planner": "path",
                "segments": [{"line": each} for each in points],
                "corner": "overlap",
                "overlap": 0.05,
            }
        ],
    }
    plan = plan_job(loaded(job))
    what = "distance from the path and angle from its orientation and branch"
    assert plan.verdict.sampled == ((what, (0,)),)
    (move,) = report_of(plan).moves
    assert move.tool is not None
    assert (move.tool.method, move.tool.deviation_bound, move.tool.turned_bound) == ("sampled", None, None)
