"""What a picture takes from a plan: values, limits and marks in the units of the job, at the times of its rows."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from trajcli.job.read import job_from_text
from trajcli.kinematics.forward import forward
from trajcli.planning.plan import Plan, plan_job
from trajcli.plots.planned_motion import PlannedMotion, rows_of_plan

START, DECELERATION, OFFSET = 5.0, 200.0, 10.0
JOB = f"""
version: 1
units: {{angle: deg, length: mm}}
robot:
  convention: standard
  joints:
    - {{name: turn, a: 300, position: [-170, 100], velocity: [-100, 120], acceleration: 500,
       velocity_by_position: {{deceleration: {DECELERATION}, offset: {OFFSET}}}}}
    - {{name: bend, a: 200, alpha: 180, position: [-150, 150], velocity: 90, acceleration: [-300, 400]}}
    - {{name: lift, type: prismatic, position: [0, 200], velocity: 500, acceleration: 2000}}
tools: {{long: {{xyz: [50, 0, 0], mass: 1}}}}
limits: {{tcp: {{speed: 900}}}}
points: {{high: {{joints: [95, 30, 20]}}}}
start: {{joints: [10, 20, 30]}}
output: {{start_time: {START}}}
moves:
  - {{planner: trapezoid, to: {{joints: [40, -20, 100]}}}}
  - {{planner: quintic, to: high, duration: 3, limits: {{velocity: {{turn: 80}}, tcp: {{speed: 700, angular_speed: 200}}}}}}
  - {{tool: long}}
  - {{planner: trapezoid, to: {{joints: [-100, 0, 10]}}}}
"""
FACTORS = np.array([np.pi / 180, np.pi / 180, 1e-3])
LIMITS = (
    ({"low": -100.0, "high": 120.0}, 0),
    ({"low": -80.0, "high": 80.0}, 1),
    ({"low": -100.0, "high": 120.0}, 3),
)


@cache
def planned(text: str = JOB) -> Plan:
    return plan_job(job_from_text(text))


@pytest.fixture(scope="module")
def motion() -> PlannedMotion:
    return PlannedMotion(planned())


def inside(plan: Plan, index: int, times: np.ndarray) -> np.ndarray:
    span = plan.trajectory.spans[index]
    return (times > START + span.start + 1e-9) & (times < START + span.end - 1e-9)


@pytest.mark.parametrize(("quantity", "order"), [("q", 0), ("qd", 1), ("qdd", 2), ("qddd", 3)])
def test_traces_are_the_curve_in_the_unit_of_each_joint(
    quantity: str, order: int, motion: PlannedMotion
) -> None:
    curve = motion.plan.trajectory.curve
    for joint in range(3):
        times, values = motion.joint_trace(joint, quantity)
        assert (times[0], times[-1]) == pytest.approx((START, START + curve.duration))
        alone = np.append(True, np.diff(times) > 1e-9) & np.append(np.diff(times) > 1e-9, True)
        expected = curve.evaluate(times - START, order)[:, joint] / FACTORS[joint]
        assert values[alone] == pytest.approx(expected[alone], abs=1e-6)
        assert alone.sum() > 0 or order == 3


def test_limits_are_narrowed_by_the_way_left_and_step_upright_between_moves(motion: PlannedMotion) -> None:
    plan, curve = motion.plan, motion.plan.trajectory.curve
    low, high = motion.joint_limits(0, "qd")
    for bounds, index in LIMITS:
        for line, side, end in ((low, "low", -170.0), (high, "high", 100.0)):
            own = line[inside(plan, index, line[:, 0])]
            assert len(own) > 20
            left = np.abs(end - curve.evaluate(own[:, 0] - START)[:, 0] / FACTORS[0])
            most = np.maximum(0.0, np.sqrt(2 * DECELERATION * left) - OFFSET)
            assert own[:, 1] == pytest.approx(np.sign(bounds[side]) * np.minimum(most, abs(bounds[side])))
    border = START + plan.trajectory.spans[0].end
    assert high[high[:, 0] == border][:, 1].tolist() == pytest.approx([120, 80])
    assert low[low[:, 0] == border][:, 1].tolist() == pytest.approx([-100, -80])


def test_other_limits_are_those_of_each_move(motion: PlannedMotion) -> None:
    spans = motion.plan.trajectory.spans
    ends = [START + end for span in spans for end in (span.start, span.end)]
    low, high = motion.joint_limits(1, "qdd")
    assert low[:, 0].tolist() == high[:, 0].tolist() == pytest.approx(ends)
    assert (low[:, 1].tolist(), high[:, 1].tolist()) == (pytest.approx([-300] * 8), pytest.approx([400] * 8))
    low, high = motion.joint_limits(2, "qd")
    assert (low[:, 1].tolist(), high[:, 1].tolist()) == (pytest.approx([-500] * 8), pytest.approx([500] * 8))
    speed = motion.tool_limit(angular=False)
    assert speed[:, 0].tolist() == pytest.approx(ends)
    assert speed[:, 1].tolist() == pytest.approx([900, 900, 700, 700, 900, 900, 900, 900])
    angular = motion.tool_limit(angular=True)[:, 1]
    assert angular[2:4] == pytest.approx([200, 200])
    assert np.isnan(np.delete(angular, [2, 3])).all()


def test_borders_and_marks_are_at_the_times_of_rows(motion: PlannedMotion) -> None:
    spans = motion.plan.trajectory.spans
    borders = motion.borders
    assert borders.indices == (0, 1, 3)
    assert borders.times == pytest.approx(START + np.array([0, spans[0].end, spans[1].end, spans[3].end]))
    ((time, index, _),) = borders.marks
    assert (time, index) == (pytest.approx(START + spans[1].end), 2)
    marked = motion.waypoints(0)
    assert marked[:, 0] == pytest.approx(START + np.array([span.end for span in spans]))
    assert marked[:, 1] == pytest.approx([40, 95, 95, -100])
    assert motion.waypoints(2)[:, 1] == pytest.approx([100, 20, 20, 10])


def test_the_tool_is_the_one_on_the_flange_then(motion: PlannedMotion) -> None:
    plan, samples = motion.plan, motion.tool()
    assert samples.times[0] == START
    for index, reach in ((0, 0.2), (1, 0.2), (3, 0.25)):
        rows = inside(plan, index, samples.times)
        q = plan.trajectory.curve.evaluate(samples.times[rows] - START)
        qd = plan.trajectory.curve.evaluate(samples.times[rows] - START, 1)
        first, both = q[:, 0], q[:, 0] + q[:, 1]
        x = 0.3 * np.cos(first) + reach * np.cos(both)
        y = 0.3 * np.sin(first) + reach * np.sin(both)
        assert samples.positions[rows] == pytest.approx(np.stack([x, y, -q[:, 2]], axis=1))
        turning = qd[:, 0] + qd[:, 1]
        vx = -0.3 * np.sin(first) * qd[:, 0] - reach * np.sin(both) * turning
        vy = 0.3 * np.cos(first) * qd[:, 0] + reach * np.cos(both) * turning
        assert samples.speeds[rows, 0] == pytest.approx(np.sqrt(vx**2 + vy**2 + qd[:, 2] ** 2), abs=1e-9)
        assert samples.speeds[rows, 1] == pytest.approx(np.abs(turning), abs=1e-9)
    points = motion.tool_waypoints()
    robots = [plan.moves[k].robot for k in (0, 0, 1, 2, 3)]
    states = np.radians([[10, 20], [40, -20], [95, 30], [95, 30], [-100, 0]])
    lifts = [0.03, 0.1, 0.02, 0.02, 0.01]
    expected = [
        1000 * forward(robot, [*turns, lift])[:3, 3]
        for robot, turns, lift in zip(robots, states, lifts, strict=True)
    ]
    assert points == pytest.approx(np.array(expected))
    named = dict(motion.named())
    assert named["high"] in (pytest.approx(expected[2]), pytest.approx(expected[3]))


def test_a_second_plan_has_the_tool_of_each_of_its_rows(motion: PlannedMotion) -> None:
    table = rows_of_plan(motion.plan, 20.0)
    samples = motion.tool()
    times = table.column("t")
    assert (times[0], times[-1]) == pytest.approx((20.0, 20.0 + motion.plan.trajectory.duration))
    for axis, name in enumerate("xyz"):
        for index in (0, 1, 3):
            rows = inside(motion.plan, index, times - 20.0 + START)
            shown = np.interp(times[rows] - 20.0 + START, samples.times, samples.positions[:, axis])
            assert table.column(name)[rows] == pytest.approx(shown, abs=1e-4)
    breaks, flat = motion.plan.trajectory.curve.breaks, np.flatnonzero(np.diff(times) == 0)
    for row, axis, order in ((flat, "qd", 1), (flat, "qdd", 2)):
        for side, rows in (("left", row), ("right", row + 1)):
            at = breaks[np.abs(breaks - (times[rows] - 20.0)[:, None]).argmin(axis=1)]
            expected = motion.plan.trajectory.curve.evaluate(at, order, side=side)
            assert table.column(f"{axis}1")[rows] == pytest.approx(expected[:, 0])
    change = flat[np.abs(times[flat] - 20.0 - motion.plan.trajectory.spans[3].start) < 1e-9]
    steps = [table.column(axis)[[change[0], change[-1] + 1]] for axis in "xy"]
    assert np.linalg.norm(np.diff(steps)) == pytest.approx(0.05)  # from the flange to the tcp of the tool
    x, vx = table.column("x"), table.column("vx")
    rows = np.flatnonzero(inside(motion.plan, 1, times - 20.0 + START))[1:-1]
    slope = (x[rows + 1] - x[rows - 1]) / (times[rows + 1] - times[rows - 1])
    assert vx[rows] == pytest.approx(slope, abs=2e-3)
    speed = np.linalg.norm([table.column(name) for name in ("vx", "vy", "vz")], axis=0)
    rows = inside(motion.plan, 3, times - 20.0 + START)
    shown = np.interp(times[rows] - 20.0 + START, samples.times, samples.speeds[:, 0])
    assert speed[rows] == pytest.approx(shown, abs=1e-3)


def test_findings_stand_at_their_values_on_the_axis_of_their_joint_and_quantity() -> None:
    text = JOB.replace("duration: 3", "duration: 0.7").replace("position: [0, 200]", "position: [0, 90]")
    motion = PlannedMotion(planned(text))
    plan = motion.plan
    kinds = {(finding.kind, finding.joint) for finding in plan.verdict.findings}
    assert {("velocity", "turn"), ("position", "lift")} <= kinds
    for joint, name in enumerate(motion.display.joint_names):
        for quantity, kind, order in (
            ("q", "position", 0),
            ("qd", "velocity", 1),
            ("qdd", "acceleration", 2),
        ):
            marked = motion.joint_findings(joint, quantity)
            own = [f for f in plan.verdict.findings if f.joint == name and f.kind.split("_by_")[0] == kind]
            shown = marked[np.isfinite(marked[:, 1])]
            assert len(shown) == len(own)
            for (time, value), finding in zip(shown.tolist(), own, strict=True):
                at = plan.trajectory.curve.evaluate(time - START, order)[joint] / FACTORS[joint]
                before = (
                    plan.trajectory.curve.evaluate(time - START, order, side="left")[joint] / FACTORS[joint]
                )
                assert time == pytest.approx(START + (finding.time or 0.0))
                assert min(abs(value - at), abs(value - before)) < 1e-6
    of_tool = 0
    for angular, scale in ((False, 1e-3), (True, np.pi / 180)):
        marked = motion.tool_findings(angular).tolist()
        for (time, value), finding in zip(marked, plan.verdict.findings, strict=True):
            assert time == pytest.approx(START + (finding.time or 0.0))
            own = (
                finding.joint is None
                and finding.kind.endswith("speed")
                and ("angular" in finding.kind) == angular
            )
            assert np.isfinite(value) == own, finding.kind
            assert not own or value == pytest.approx((finding.value or 0.0) / scale)
            of_tool += own
    assert of_tool == 2


SEAM = """
version: 1
units: {angle: deg, length: mm}
robot: ur5e
start: home
points:
  home: {xyz: [400, 100, 300], rpy: [180, 0, 0], configuration: {shoulder: left, elbow: up, wrist: no_flip}}
  goal: {xyz: [500, 0, 300], rpy: [180, 0, 0]}
limits: {acceleration: 900, tcp: {speed: 250, angular_speed: 60}}
output: {start_time: 5}
moves:
  - {planner: hold, duration: 1}
  - planner: path
    law: {shape: time_optimal}
    segments:
      - {line: {xyz: [450, 100, 300]}, radius: 10, law: {speed: 40, angular_speed: 20}}
      - {line: {xyz: [500, 100, 300]}, radius: 10}
      - {line: goal, law: {speed: 90}}
  - {planner: hold, duration: 0.5}
"""


def test_where_segments_have_speeds_of_their_own_the_limit_of_the_tool_steps_along_the_path() -> None:
    motion = PlannedMotion(planned(SEAM))
    plan = motion.plan
    samples = motion.tool()
    seam = plan.trajectory.spans[1]
    line, angular = motion.tool_limit(angular=False), motion.tool_limit(angular=True)
    assert line[[0, -1], 0] == pytest.approx([START, START + plan.trajectory.duration])
    assert line[[0, 1, -2, -1], 1] == pytest.approx(250)
    own = line[2:-2]
    assert own[[0, -1], 0] == pytest.approx([START + seam.start, START + seam.end])
    steps = np.flatnonzero(np.abs(np.diff(own[:, 1])) > 1)
    assert own[[0, *(steps + 1)], 1] == pytest.approx([40, 250, 90])
    assert own[steps, 0] == pytest.approx(own[steps + 1, 0])
    for time, corner in zip(own[steps, 0], ([0.45, 0.1, 0.3], [0.5, 0.1, 0.3]), strict=True):
        at = [np.interp(time, samples.times, samples.positions[:, axis]) for axis in range(3)]
        assert np.linalg.norm(np.subtract(at, corner)) < 0.011  # within the radius of the corner
    assert {round(value, 6) for value in angular[inside(plan, 1, angular[:, 0])][:, 1].tolist()} == {20, 60}
    assert samples.speeds[:, 0].max() <= 0.25 + 1e-6


def test_the_fastest_that_a_check_saw_is_drawn_and_points_stand_where_they_are_left() -> None:
    seen = 0
    for motion in (PlannedMotion(planned()), PlannedMotion(planned(SEAM))):
        samples, verdict = motion.tool(), motion.plan.verdict
        for span, peaks in zip(motion.plan.trajectory.spans, verdict.tool_peaks, strict=True):
            for peak in () if peaks is None else (peaks[kind] for kind in ("speed", "angular_speed")):
                assert np.abs(samples.times - START - span.start - peak.time).min() < 1e-12
                seen += 1
    assert seen > 3
    named = dict(motion.named())
    assert named["home"] == pytest.approx([400, 100, 300])
    assert named["goal"] == pytest.approx([500, 0, 300], abs=1e-3)
