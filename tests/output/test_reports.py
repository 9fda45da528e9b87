"""Numbers of reports against dense samples of the motion that they are about."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import numpy as np
import pytest

from trajcli.job.read import job_from_text
from trajcli.job.report import MoveReport, PeakReport, Report
from trajcli.kinematics.forward import forward
from trajcli.output.report import report_of
from trajcli.planning.plan import Plan, plan_job

ORDERS = ("position", "velocity", "acceleration", "jerk")
JOB: dict[str, Any] = {
    "version": 1,
    "robot": {
        "joints": [
            {"name": "a", "position": [0.5, 3], "velocity": [-1, 2], "acceleration": [-4, 3], "jerk": 30},
            {"name": "b", "type": "prismatic", "position": [-3, -0.1], "velocity": 1, "acceleration": 5, "jerk": 20},
            {"name": "c", "velocity": 3, "acceleration": [-9, 2], "jerk": [-25, 40]},
        ]
    },
    "start": {"joints": [1.0, -1.0, 0.0]},
    "moves": [
        {"planner": "jerk_limited", "to": {"joints": [2.5, -0.4, -0.7]}, "label": "up"},
        {"planner": "quintic", "to": {"joints": [0.9, -2.5, 0.9]}, "duration": 4.5},
        {"planner": "hold", "duration": 0.25},
        {"planner": "spline", "through": [{"joints": [1.4, -1.2, 0.1]}, {"joints": [1.1, -2.6, 1.6]}, {"joints": [2.0, -1.0, 1.0]}]},
        {"planner": "jerk_limited", "to": {"joints": [0.8, -1.5, 0.5]}, "limits": {"acceleration": 2}},
    ],
    "output": {"start_time": 2.5},
}  # fmt: skip


@cache
def planned() -> tuple[Plan, Report]:
    plan = plan_job(job_from_text(json.dumps(JOB)))
    assert plan.verdict.passed
    return plan, report_of(plan)


def sampled(plan: Plan, move: MoveReport, order: int) -> tuple[np.ndarray, np.ndarray]:
    """Return times within the pieces of a move, and a derivative of all joints there."""
    curve, times, values = plan.trajectory.curve, [], []
    for k in range(curve.pieces):
        if curve.breaks[k + 1] > move.start and curve.breaks[k] < move.end:
            local = np.linspace(1e-9, 1 - 1e-9, 801) * (curve.breaks[k + 1] - curve.breaks[k])
            rows = [np.polyval(np.polyder(row, order), local) for row in curve.coefficients[:, k].T]
            times.append(curve.breaks[k] + local)
            values.append(np.stack(rows, axis=1))
    return np.concatenate(times), np.concatenate(values)


@cache
def samples_of(index: int, order: int) -> tuple[np.ndarray, np.ndarray]:
    plan, report = planned()
    return sampled(plan, report.moves[index], order)


def peak_of(move: MoveReport, joint: str, order: int) -> PeakReport:
    (found,) = [each for each in move.peaks if (each.joint, each.quantity) == (joint, ORDERS[order])]
    return found


@pytest.mark.parametrize("index", range(5))
@pytest.mark.parametrize("order", range(4))
def test_extremes_and_their_times_are_those_of_dense_samples(index: int, order: int) -> None:
    _, report = planned()
    move = report.moves[index]
    t, values = samples_of(index, order)
    size = np.abs(values).max() + 1e-12
    for joint, name in enumerate("abc"):
        peak, of_joint = peak_of(move, name, order), values[:, joint]
        assert [peak.low, peak.high] == pytest.approx([of_joint.min(), of_joint.max()], abs=1e-5 * size)
        for value, time in ((peak.low, peak.low_time), (peak.high, peak.high_time)):
            assert move.start <= time <= move.end
            beside = of_joint[np.argsort(np.abs(t - time))[:4]]  # on both sides of a break
            assert np.abs(beside - value).min() <= 2e-2 * size
    assert {peak.unit.partition("/")[0] for peak in move.peaks if peak.joint == "b"} == {"m"}
    assert {peak.unit for peak in move.peaks if peak.joint == "a"} == {"rad", "rad/s", "rad/s^2", "rad/s^3"}


def parts_of(bounds: list[float | None], low: float, high: float, middle: float) -> list[float]:
    ends = zip((low, high), bounds, strict=True)
    return [(value - middle) / (bound - middle) for value, bound in ends if bound is not None]


@pytest.mark.parametrize("index", range(5))
def test_what_is_used_of_a_bound_is_that_of_its_direction(index: int) -> None:
    """Of positions from the middle of their range, which holds 0 as little here as that of an elbow may."""
    _, report = planned()
    move, robot = report.moves[index], JOB["robot"]["joints"]
    own = JOB["moves"][index].get("limits", {})
    best = (0.0, "", "")
    for joint in robot:
        for order, quantity in enumerate(ORDERS):
            stated = own.get(quantity, joint.get(quantity))
            bounds = stated if isinstance(stated, list) else [-stated, stated] if stated else [None, None]
            peak = peak_of(move, joint["name"], order)
            assert list(peak.limit) == bounds
            if bounds[0] is None:
                assert peak.used is None
                continue
            _, values = samples_of(index, order)
            column = values[:, "abc".index(joint["name"])]
            middle = 0.0 if order else sum(bounds) / 2
            used = max(0.0, *parts_of(bounds, column.min(), column.max(), middle))
            assert peak.used == pytest.approx(used, abs=1e-4)
            assert 0 <= peak.used <= 1 + 1e-6
            best = max(best, (used if order else 0.0, joint["name"], quantity))
    if best[0] > 0:
        assert move.binding is not None
        assert move.binding.used == pytest.approx(best[0], rel=1e-4)
        used_there = peak_of(move, str(move.binding.joint), ORDERS.index(move.binding.quantity)).used
        assert used_there == move.binding.used
    else:
        assert move.binding is None


def test_a_range_that_is_open_on_one_side_has_no_middle() -> None:
    """Nothing says which part of it is used, nor does the distance from 0."""
    one = {"name": "a", "position": [0.5, None], "velocity": 1, "acceleration": 2}
    job = {**JOB, "robot": {"joints": [one]}, "start": {"joints": [2.5]}}
    job["moves"] = [{"planner": "trapezoid", "to": {"joints": [1]}}]
    (move,) = report_of(plan_job(job_from_text(json.dumps(job)))).moves
    assert move.peaks[0].limit == (0.5, None)
    assert move.peaks[0].used is None
    assert [peak.used for peak in move.peaks[1:3]] == pytest.approx([1.0, 1.0])


def test_moves_follow_each_other_and_times_count_from_the_start() -> None:
    plan, report = planned()
    ends = np.cumsum([move.duration for move in report.moves])
    assert [move.end for move in report.moves] == pytest.approx(ends.tolist())
    assert [move.start for move in report.moves] == [0.0, *(move.end for move in report.moves[:-1])]
    assert report.duration == report.moves[-1].end == plan.trajectory.duration
    assert [move.label for move in report.moves] == ["up", None, None, None, None]
    assert [move.planner for move in report.moves] == [move["planner"] for move in JOB["moves"]]


@pytest.mark.parametrize("index", [0, 4])
def test_for_how_long_a_limit_binds(index: int) -> None:
    """Of laws with plateaus: the share of even times at which the motion is at a limit."""
    _, report = planned()
    move = report.moves[index]
    assert move.at_limit
    assert [one.seconds for one in move.at_limit] == sorted(
        (one.seconds for one in move.at_limit), reverse=True
    )
    for one in move.at_limit:
        peak = peak_of(move, str(one.joint), ORDERS.index(str(one.quantity)))
        t, values = samples_of(index, ORDERS.index(str(one.quantity)))
        column = values[:, "abc".index(str(one.joint))]
        low, high = (bound * (1 - 1e-6) for bound in peak.limit if bound is not None)
        at = (column <= low) | (column >= high)
        seconds = np.trapezoid(at.astype(float), t)
        assert one.seconds == pytest.approx(seconds, abs=2e-3 * move.duration)
        assert one.share == pytest.approx(one.seconds / move.duration)


def test_points_on_the_way_are_passed_at_their_times_and_left_by_as_much_as_is_said() -> None:
    plan, report = planned()
    move = report.moves[3]
    points = np.array([[0.9, -2.5, 0.9], *([p["joints"] for p in JOB["moves"][3]["through"]])])
    assert move.waypoints is not None
    times = [point.time for point in move.waypoints]
    assert [times[0], times[-1]] == [move.start, move.end]
    reached = plan.trajectory.curve.evaluate(np.array(times))
    missed = np.array([point.missed for point in move.waypoints])
    assert np.abs(reached - points) == pytest.approx(missed, abs=1e-9)
    t, q = samples_of(3, 0)
    wanted = {}
    for joint, name in enumerate("abc"):
        over, under = q[:, joint].max() - points[:, joint].max(), q[:, joint].min() - points[:, joint].min()
        wanted |= {(name, 1): (over, t[q[:, joint].argmax()])} if over > 1e-6 else {}
        wanted |= {(name, -1): (under, t[q[:, joint].argmin()])} if under < -1e-6 else {}
    assert move.outside is not None
    found = {(one.joint, int(np.sign(one.beyond))): (one.beyond, one.time) for one in move.outside}
    assert found.keys() == wanted.keys()
    assert {sign for _, sign in wanted} == {-1, 1}
    for key, (beyond, time) in wanted.items():
        assert found[key] == pytest.approx((beyond, time), abs=5e-3 * move.duration, rel=1e-3)
        assert found[key][0] == pytest.approx(beyond, rel=1e-3, abs=1e-6)
    assert [one.unit for one in move.outside] == ["m" if one.joint == "b" else "rad" for one in move.outside]


def reported(moves: list[dict[str, Any]], **fields: Any) -> tuple[Plan, Report]:
    plan = plan_job(job_from_text(json.dumps({**JOB, "moves": moves, **fields})))
    return plan, report_of(plan)


def test_signals_of_all_names_are_said_in_order_of_time() -> None:
    there = {"planner": "quintic", "to": {"joints": [1.5, -1.2, 0.2]}, "duration": 3}
    back = {
        "planner": "quintic",
        "to": {"joints": [1.0, -1.0, 0.0]},
        "duration": 4,
        "at": {"signal": "z", "value": 7, "before": 1.5},
    }
    moves = [
        {"signal": "z", "value": 1},
        there,
        {"signal": "a", "value": 2},
        back,
        {"signal": "z", "value": 0},
    ]
    _, report = reported(moves)
    found = [(one.name, one.value, one.move, one.time) for one in report.signals]
    assert found == [("z", 1, 0, 0.0), ("a", 2, 2, 3.0), ("z", 7, 3, 5.5), ("z", 0, 4, 7.0)]


def test_every_concession_and_every_remark_is_said_once() -> None:
    short = {"planner": "quintic", "duration": 0.5, "when_over_limit": "slow"}
    moves = [{**short, "to": {"joints": joints}} for joints in ([1.5, -1.2, 0.2], [1.0, -1.0, 0.0])]
    plan, report = reported([*moves, JOB["moves"][3]])
    assert [event.move for event in report.events if event.kind == "slowed"] == [0, 1]
    said = [(one.kind, one.message, one.move) for one in (*report.events, *report.remarks)]
    assert said == [(one.kind, one.message, one.move) for one in (*plan.events, *plan.remarks)]
    assert [move.stretch > 1 for move in report.moves] == [True, True, False]


def test_steps_and_knots_are_in_the_units_of_the_joint_that_they_are_about() -> None:
    """Of a slide and a hinge; the hinge stands, so that what knots miss is of the slide."""
    joints = [{"velocity": 1, "acceleration": 2}, {"type": "prismatic", "velocity": 1, "acceleration": 2}]
    moves = [{"planner": "septic", "to": {"joints": [0, 1]}, "duration": 4}]
    _, report = reported(moves, robot={"joints": joints}, start={"joints": [0, 0]})
    assert report.knots is not None
    missed = report.knots.deviation
    assert (missed.position_unit, missed.velocity_unit) == ("m", "m/s")
    assert 0 < missed.position <= 1e-6
    moves = [{"planner": "trapezoid", "to": {"joints": [1, 0.5]}, "synchronize": "none"}]
    _, report = reported(moves, robot={"joints": joints}, start={"joints": [0, 0]})
    assert {step.unit for step in report.steps} == {"rad/s^2", "m/s^2"}
    assert {abs(step.size) for step in report.steps} == {2.0, 4.0} or {abs(s.size) for s in report.steps} == {
        2.0
    }


def test_a_finding_is_said_with_its_value_its_limit_and_its_time() -> None:
    moves = [
        {"planner": "hold", "duration": 1},
        {"planner": "quintic", "to": {"joints": [1.0, -1.0, 2.0]}, "duration": 1},
    ]
    plan, report = reported(moves)
    assert report.verdict == "violated"
    found = {one.kind: one for one in report.findings}
    assert found["velocity"].value == pytest.approx(2 * 15 / 8)
    assert (found["velocity"].limit, found["velocity"].move, found["velocity"].joint) == (3, 1, "c")
    assert found["velocity"].time == pytest.approx(1.5)
    assert len(report.findings) == len(plan.verdict.findings)


LINE: dict[str, Any] = {
    "robot": "ur5e",
    "limits": {"acceleration": 6, "velocity": {"shoulder_pan_joint": 0.5}},
    "start": {"joints": [0, -1.6, 1.6, -1.6, -1.6, 0]},
}


@pytest.mark.parametrize("speed", [0.3, 0.6, 3.0])
def test_the_wanted_speed_along_a_path(speed: float) -> None:
    """Held where a joint lets it, all the way but for the ends, or nowhere; by the forward kinematics."""
    away = {
        "planner": "jerk_limited",
        "to": {"joints": [0.4, -1.4, 1.6, -1.6, -1.6, 0]},
        "limits": {"jerk": 60},
    }
    line = {"planner": "line", "to": {"from": "here", "offset": {"xyz": [0.6, -0.2, 0.1]}}}
    plan, report = reported([away, {**line, "law": {"shape": "time_optimal", "speed": speed}}], **LINE)
    assert plan.verdict.passed
    move = report.moves[1]
    tool = move.tool
    assert tool is not None
    t = np.linspace(move.start, move.end, 4001)
    places = forward(plan.loaded.robot, plan.trajectory.curve.evaluate(t))[:, :3, 3]
    gone = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(places, axis=0), axis=1))])
    rates = np.gradient(gone, t)
    fast = rates >= 0.999 * speed
    assert tool.length == pytest.approx(np.linalg.norm([0.6, 0.2, 0.1]), rel=1e-6)
    assert (tool.wanted_speed, tool.unit, tool.speed_unit) == (speed, "m", "m/s")
    assert tool.held == pytest.approx(np.diff(gone)[fast[1:] & fast[:-1]].sum() / gone[-1], abs=0.02)
    assert tool.deviation <= 1e-5
    (peak,) = [each for each in tool.peaks if each.quantity == "speed"]
    assert peak.value == pytest.approx(rates.max(), rel=1e-3)
    assert move.start < peak.time < move.end
    assert np.interp(peak.time, t, rates) == pytest.approx(rates.max(), rel=1e-3)
    assert tool.lowest is None  # it is not left and taken up again
