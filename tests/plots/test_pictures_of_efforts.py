"""Efforts in pictures against the equation of motion of a pendulum, and of a lift: values, steps, limits, findings."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from trajcli.curves.piecewise import Array
from trajcli.errors import InputError
from trajcli.job.read import job_from_text
from trajcli.output.delivery.joined import write_plan
from trajcli.planning.plan import Plan, plan_job
from trajcli.plots.panel import Panel, Picture
from trajcli.plots.picture import picture_of
from trajcli.plots.planned_motion import PlannedMotion, effort_samples
from trajcli.streams.reading import read_table
from trajcli.streams.table import Table

LENGTH, MASS, OUT, INERTIA, ROTOR = 0.5, 4.0, 0.2, 0.1, 0.03
COULOMB, VISCOUS, CARRIED, G = 1.5, 0.7, 1.2, 9.81
PENDULUM = f"""
version: 1
units: {{angle: deg, length: mm}}
robot:
  convention: standard
  joints:
    - {{name: swivel, a: {1e3 * LENGTH}, velocity: 120, acceleration: 400, effort: [-28, 30], rotor: {ROTOR},
       friction: {{coulomb: {COULOMB}, viscous: {VISCOUS}}},
       link: {{mass: {MASS}, com: [{1e3 * (OUT - LENGTH)}, 0, 0], inertia: [0.01, 0.1, {INERTIA}, 0, 0, 0]}}}}
gravity: [0, -{G}, 0]
start: {{joints: [10]}}
moves:
  - {{planner: spline, through: [{{joints: [60]}}, {{joints: [20]}}], to: {{joints: [40]}}, duration: 3}}
  - {{attach: {{mass: {CARRIED}}}}}
  - {{planner: trapezoid, to: {{joints: [-20]}}, limits: {{effort: 25}}}}
output: {{rate: 50, start_time: 10, columns: [t, q, qd, qdd, tau]}}
"""


def pendulum(q: Array, qd: Array, qdd: Array, carried: float) -> Array:
    """Return (I + m c^2 + M L^2 + rotor) qdd + (m c + M L) g cos q and friction, shape (N,)."""
    inertia = INERTIA + MASS * OUT**2 + carried * LENGTH**2 + ROTOR
    held = (MASS * OUT + carried * LENGTH) * G * np.cos(q)
    return np.asarray(inertia * qdd + held + COULOMB * np.sign(qd) + VISCOUS * qd)


@pytest.fixture(scope="module")
def plan() -> Plan:
    plan = plan_job(job_from_text(PENDULUM))
    assert plan.verdict.passed
    return plan


def panel_of(picture: Picture) -> Panel:
    ((panel,),) = (block.panels for block in picture.blocks)
    return panel


def steps_of(panel: Panel) -> dict[float, float]:
    """Return by how much the first trace steps, and when."""
    trace = panel.traces[0]
    at = np.flatnonzero((np.diff(trace.x) == 0) & (np.abs(np.diff(trace.y)) > 1e-6))
    return {float(trace.x[k]): float(trace.y[k + 1] - trace.y[k]) for k in at}


def test_values_are_those_of_the_equation_of_motion_with_what_each_move_carries(plan: Plan) -> None:
    panel = panel_of(picture_of(plan, quantities=["tau"]))
    assert (panel.title, panel.y_label) == ("swivel: effort", "τ [N m]")
    trace, border = panel.traces[0], 10 + plan.trajectory.spans[0].end
    assert trace.x[0] == 10.0
    assert trace.x[-1] == pytest.approx(10 + plan.trajectory.duration)
    assert trace.x.size > 300
    steps = np.array([*steps_of(panel), 10.0, trace.x[-1]])
    inside = np.abs(trace.x[:, None] - steps).min(axis=1) > 1e-9
    for carried, of_move in ((0.0, trace.x < border), (CARRIED, trace.x > border)):
        rows = inside & of_move
        q, qd, qdd = (plan.trajectory.curve.evaluate(trace.x[rows] - 10, k)[:, 0] for k in range(3))
        assert rows.sum() > 80
        np.testing.assert_allclose(trace.y[rows], pendulum(q, qd, qdd, carried), rtol=1e-9, atol=1e-9)


def test_steps_are_upright_where_friction_turns_and_where_the_payload_is_attached(plan: Plan) -> None:
    curve, border = plan.trajectory.curve, plan.trajectory.spans[0].end
    steps = steps_of(panel_of(picture_of(plan, quantities=["tau"])))
    dense = np.linspace(1e-3, border - 1e-3, 20001)
    speeds = curve.evaluate(dense, 1)[:, 0]
    turns = dense[1:][np.sign(speeds[1:]) != np.sign(speeds[:-1])]
    assert turns.size == 2  # up to 60 deg, down to 20, up again
    for turn, sign in zip(turns, (-1, 1), strict=True):
        (size,) = [size for when, size in steps.items() if abs(when - 10 - turn) < 1e-3]
        assert size == pytest.approx(2 * sign * COULOMB, rel=1e-9)
    q = curve.evaluate(border)
    before, after = (curve.evaluate(border, 2, side=side) for side in ("left", "right"))
    away = np.array([1.0])  # upwards before the border, downwards behind it
    expected = pendulum(q, -1e-15 * away, after, CARRIED) - pendulum(q, 1e-15 * away, before, 0.0)
    (size,) = [size for when, size in steps.items() if abs(when - 10 - border) < 1e-9]
    assert size == pytest.approx(float(expected[0]), rel=1e-9)


def test_limits_are_those_in_force_and_the_panel_is_there_where_there_are_any(
    plan: Plan, example: Callable[[str], Plan]
) -> None:
    panel, border = panel_of(picture_of(plan, quantities=["tau"])), 10 + plan.trajectory.spans[0].end
    low, high = panel.limits
    of_first = high[:, 0] < border
    assert {*low[of_first, 1].tolist()} == {-28.0}
    assert {*high[of_first, 1].tolist()} == {30.0}
    assert (low[-1, 1], high[-1, 1]) == (-25.0, 25.0)
    assert not panel.unlimited
    titles = [panel.title for block in picture_of(plan).blocks for panel in block.panels]
    assert "swivel: effort" in titles
    labels = [panel.y_label for block in picture_of(example("ur5e_pick")).blocks for panel in block.panels]
    assert "tau [N m]" not in labels
    unlimited = picture_of(example("ur5e_pick"), quantities=["tau"])  # has masses, and no limit in force
    assert {panel.unlimited for panel in unlimited.blocks[0].panels} == {True}


def test_peaks_of_the_check_are_drawn_and_findings_are_marked() -> None:
    text = PENDULUM.replace("[-28, 30]", "[-28, 12.5]").replace("effort: 25", "acceleration: 400")
    plan = plan_job(job_from_text(text.replace("trapezoid, to", "cubic, duration: 1, to")))
    findings = [finding for finding in plan.verdict.findings if finding.kind == "effort"]
    assert findings
    assert len(findings) == len(plan.verdict.findings)
    picture = picture_of(plan, quantities=["q", "tau"])
    position, effort = (panel for block in picture.blocks for panel in block.panels)
    np.testing.assert_allclose(effort.findings, [[f.time + 10, f.value] for f in findings])
    np.testing.assert_allclose(effort.traces[0].y.max(), max(f.value for f in findings), rtol=1e-6)
    assert np.isnan(position.findings[:, 1]).all()


def test_the_largest_efforts_to_either_side_are_points_of_the_line(plan: Plan) -> None:
    samples = effort_samples(plan)
    assert sum(peaks is not None for peaks in plan.verdict.efforts) >= 2
    for peaks in plan.verdict.efforts:
        for sign, side in () if peaks is None else ((1, peaks.highest), (-1, peaks.lowest)):
            own = sign * samples.values[np.abs(samples.times - side[0].time) < 1e-12, 0]
            assert np.abs(own - side[0].value).min() < 1e-9


def test_one_move_that_limits_an_effort_is_enough() -> None:
    motion = PlannedMotion(plan_job(job_from_text(PENDULUM.replace("effort: [-28, 30], ", ""))))
    assert motion.has_effort_limits
    assert motion.carries
    free = PENDULUM.replace("effort: [-28, 30], ", "").replace("effort: 25", "velocity: 50")
    motion = PlannedMotion(plan_job(job_from_text(free.replace(f"mass: {CARRIED}", "mass: 0"))))
    assert not motion.has_effort_limits
    assert not motion.carries


def test_a_lift_is_driven_by_a_force() -> None:
    text = f"""
version: 1
units: {{length: mm}}
robot:
  convention: standard
  joints: [{{type: prismatic, velocity: 500, acceleration: 2000, effort: 100,
            link: {{mass: {MASS}, com: [0, 0, 0], inertia: [0.1, 0.1, 0.1, 0, 0, 0]}}}}]
start: {{joints: [0]}}
moves: [{{planner: trapezoid, to: {{joints: [400]}}}}]
"""
    panel = panel_of(picture_of(plan_job(job_from_text(text)), quantities=["tau"]))
    assert panel.y_label == "τ [N]"
    np.testing.assert_allclose([line[:, 1] for line in panel.limits], [[-100, -100], [100, 100]])
    expected = [MASS * (G + a) for a in (-2.0, 0.0, 2.0)]
    assert sorted({*np.round(panel.traces[0].y, 9).tolist()}) == pytest.approx(expected)


def test_columns_of_a_file_are_drawn_over_the_plan_and_alone(plan: Plan, tmp_path: Path) -> None:
    write_plan(plan, str(tmp_path / "rows.csv"), "full")
    table = read_table(str(tmp_path / "rows.csv"))
    written = table.columns[:, table.names.index("tau1")]
    ours, theirs = panel_of(picture_of(plan, [table], quantities=["tau"])).traces
    assert theirs.y.tolist() == written.tolist()  # N m, though the job is in degrees
    inside = slice(1, -1)
    off = np.abs(np.interp(theirs.x, ours.x, ours.y) - theirs.y)[inside]
    assert np.median(off) < 1e-3
    alone = panel_of(picture_of(None, [table], quantities=["tau"]))
    assert alone.y_label == "τ [N m]"
    assert alone.traces[0].y.tolist() == written.tolist()
    bare = Table(("t", "tau1"), np.array([[0.0, 3.0], [1.0, 4.0]]), np.zeros(2, dtype=np.int64), "a.csv")
    assert panel_of(picture_of(None, [bare])).y_label == "τ [N m or N]"


@pytest.mark.parametrize(
    ("robot", "message"),
    [
        (
            "{name: arm, convention: standard, joints: [{name: turn, a: 1}, {name: lift, a: 1}]}",
            "the robot 'arm' has no mass and inertia of the links behind turn, lift$",
        ),
        ("{joints: 2}", "the robot 'robot' has no geometry"),
    ],
)
def test_an_arm_without_inertials_is_refused_by_name(robot: str, message: str) -> None:
    text = f"version: 1\nrobot: {robot}\nstart: {{joints: [0, 0]}}\nmoves: [{{planner: hold, duration: 1}}]\n"
    with pytest.raises(InputError, match=f"'tau' cannot be plotted: {message}") as refused:
        picture_of(plan_job(job_from_text(text)), quantities=["tau"])
    assert refused.value.exit_code == 2
