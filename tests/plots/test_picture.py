"""What stands in a picture: values against formulas and independent kinematics, limits, markers, units, choice."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from planned_examples import flown_cell

from trajcli.errors import InputError
from trajcli.job.read import job_from_text
from trajcli.kinematics.forward import forward
from trajcli.output.delivery.joined import write_plan
from trajcli.planning.plan import Plan, plan_job
from trajcli.plots.panel import Panel, Picture
from trajcli.plots.picture import MOST_PLANES, picture_of
from trajcli.streams.table import Table, read_csv

Example = Callable[[str], Plan]


def panels(picture: Picture) -> dict[str, Panel]:
    return {panel.title: panel for block in picture.blocks for panel in block.panels}


def cubic(t: np.ndarray) -> dict[str, np.ndarray]:
    """Return 20 to 50 deg in 1 s: q = 20 + 90 t^2 - 60 t^3."""
    return {
        "position": 20 + 90 * t**2 - 60 * t**3,
        "velocity": 180 * t - 180 * t**2,
        "acceleration": 180 - 360 * t,
        "jerk": np.full_like(t, -360.0),
    }


def test_the_textbook_cubic_in_degrees(example: Example) -> None:
    picture = picture_of(example("cubic"), quantities=["q", "qd", "qdd", "qddd"])
    shown = panels(picture)
    units = ("q [deg]", "q\u0307 [deg/s]", "q\u0308 [deg/s²]", "q\u20db [deg/s³]")
    assert [panel.y_label for panel in shown.values()] == list(units)
    assert {panel.x_label for panel in shown.values()} == {"t [s]"}
    for name in ("position", "velocity", "acceleration", "jerk"):
        (trace,) = shown[f"j1: {name}"].traces
        np.testing.assert_allclose(trace.y, cubic(trace.x)[name], atol=1e-9)
    assert shown["j1: velocity"].traces[0].y.max() == pytest.approx(45.0, rel=1e-14)
    assert picture.title == "cubic: verified, 1 s"


def test_limits_step_from_move_to_move_in_the_units_of_their_joints(two: Plan) -> None:
    shown = panels(picture_of(two, quantities=["q", "qd", "qdd"]))
    end = 10 + two.trajectory.spans[0].end
    low, high = shown["turn: velocity"].limits
    assert low[:, 0].tolist() == high[:, 0].tolist() == [10.0, end, end, end + 2]
    np.testing.assert_allclose(high[:, 1], [50, 50, 90, 90])
    np.testing.assert_allclose(low[:, 1], [-50, -50, -90, -90])
    low, high = shown["lift: velocity"].limits
    np.testing.assert_allclose(low[:, 1], [-150, -150, -300, -300])
    np.testing.assert_allclose(high[:, 1], [150, 150, 200, 200])
    assert shown["lift: velocity"].y_label == "q̇ [mm/s]"
    np.testing.assert_allclose(shown["turn: position"].limits[1][:, 1], 100.0)
    assert np.isnan(shown["lift: acceleration"].limits[0][:, 1]).all()
    assert shown["lift: acceleration"].unlimited
    assert not shown["turn: acceleration"].unlimited


def test_a_trapezoid_steps_upright_and_time_counts_from_its_start_time(two: Plan) -> None:
    (trace,) = panels(picture_of(two))["turn: acceleration"].traces
    assert trace.x[0] == 10.0
    first = trace.y[trace.x < 10 + two.trajectory.spans[0].end]
    assert set(np.round(first, 9)) == {160.0, 0.0, -160.0}
    steps = trace.x[:-1][(np.diff(trace.x) == 0) & (np.abs(np.diff(trace.y)) > 100)]
    # 60 deg at most 40 deg/s and 160 deg/s^2: 0.25 s to accelerate, 1.25 s to cruise
    np.testing.assert_allclose(steps[:2], [10.25, 11.5])
    borders = picture_of(two).borders
    assert borders is not None
    assert (borders.indices, borders.titles) == ((0, 1), ("trapezoid", "quintic"))
    np.testing.assert_allclose(borders.times, [10.0, 11.75, 13.75])


def test_waypoints_and_virtual_points_stand_where_the_job_and_the_rule_put_them(example: Example) -> None:
    panel = panels(picture_of(example("spline")))["j1: position"]
    job = example("spline").loaded.job
    times = [0.0, *(point.time for point in job.moves[0].listed)]
    assert panel.waypoints[:, 0].tolist() == times
    middles = [(times[0] + times[1]) / 2, (times[-2] + times[-1]) / 2]
    assert panel.virtual_points[:, 0].tolist() == middles
    (trace,) = panel.traces
    np.testing.assert_allclose(panel.virtual_points[:, 1], np.interp(middles, trace.x, trace.y), atol=1e-4)
    others = panels(picture_of(example("spline")))["j1: velocity"]
    assert not others.waypoints.size
    assert not others.virtual_points.size


def test_blends_pass_beside_their_waypoints(example: Example) -> None:
    panel = panels(picture_of(example("blends")))["j1: position"]
    (trace,) = panel.traces
    beside = np.abs(np.interp(panel.waypoints[:, 0], trace.x, trace.y) - panel.waypoints[:, 1])
    assert beside.max() > 0.1


def test_the_speed_of_the_tool_is_the_change_of_its_position(example: Example) -> None:
    plan = example("weld_seam")
    shown = panels(picture_of(plan, quantities=["tool"]))
    speed, angular = shown["speed of the tool"], shown["angular speed of the tool"]
    assert (speed.y_label, angular.y_label) == ("speed [mm/s]", "angular speed [deg/s]")
    np.testing.assert_allclose(speed.limits[0][:, 1], 300.0)
    np.testing.assert_allclose(angular.limits[0][:, 1], 120.0)
    t = np.random.default_rng(3).uniform(0.1, plan.trajectory.duration - 0.1, 50)
    h = 1e-5
    after, before = (forward(plan.loaded.robot, plan.trajectory.curve.evaluate(t + s)) for s in (h, -h))
    by_difference = np.linalg.norm(after[:, :3, 3] - before[:, :3, 3], axis=1) / (2 * h) * 1000
    turned = np.einsum("nij,nkj->nik", after[:, :3, :3], before[:, :3, :3])
    axis = np.stack([turned[:, a, b] - turned[:, b, a] for a, b in ((2, 1), (0, 2), (1, 0))], axis=1) / 2
    turning = np.degrees(np.linalg.norm(axis, axis=1) / (2 * h))
    np.testing.assert_allclose(np.interp(t, speed.traces[0].x, speed.traces[0].y), by_difference, atol=1.0)
    np.testing.assert_allclose(np.interp(t, angular.traces[0].x, angular.traces[0].y), turning, atol=0.5)
    assert speed.traces[0].y.max() == pytest.approx(300.0, abs=0.1)  # what the lines are limited to


def test_the_path_of_the_tool_goes_through_the_poses_of_the_job(example: Example) -> None:
    views = picture_of(example("weld_seam")).views
    assert views is not None
    assert views.unit == "mm"
    ((_, path),) = views.traces
    for xyz in ([350, -80, 120], [350, -80, 50], [510, -40, 50], [380, 30, 120]):
        assert np.linalg.norm(path - xyz, axis=1).min() < 1.5
    assert np.linalg.norm(views.waypoints - [350, -80, 50], axis=1).min() < 1e-3


@pytest.mark.full
def test_the_phase_plane_of_a_move_along_a_path_has_its_speed_as_limit(example: Example) -> None:
    (panel,) = panels(picture_of(example("dispense"), quantities=["phase"])).values()
    assert (panel.x_label, panel.y_label) == ("s [m]", "s\u0307 [m/s]")
    (trace,), (limit,) = panel.traces, panel.limits
    assert limit[:, 1].max() == pytest.approx(0.25)  # law: {speed: 0.25}
    assert trace.y.max() <= 0.25 * (1 + 1e-6)
    assert (trace.y <= np.interp(trace.x, limit[:, 0], limit[:, 1]) * 1.001 + 1e-6).all()
    np.testing.assert_allclose(trace.y[[0, -1]], 0.0, atol=1e-12)


def test_where_the_curvature_jumps_the_limit_of_the_phase_plane_steps_upright(example: Example) -> None:
    picture = picture_of(example("time_optimal"), quantities=["phase"])
    smooth, rounded = panels(picture).values()

    def steps(panel: Panel) -> np.ndarray:
        (limit,) = panel.limits
        upright = np.abs(np.diff(limit[:, 1])) > 0.3 * limit[:-1, 1]
        return np.diff(limit[:, 0])[upright]

    assert steps(rounded).tolist() == [0.0] * 6  # into and out of each of three parabolas
    assert steps(smooth).size == 0


@pytest.mark.parametrize("slower", ["", "output: {align: true, rate: 7}"])
def test_marks_and_planes_follow_a_move_that_is_stretched(slower: str) -> None:
    head = "version: 1\nrobot: {joints: [{velocity: 1, acceleration: 2}]}\nstart: {joints: [0]}\nmoves:\n"
    moves = "  - {planner: spline, through: [{joints: [2]}], to: {joints: [3]}}\n"
    moves += "  - {planner: time_optimal, through: [{joints: [1]}], to: {joints: [0]}}\n"
    plan = plan_job(job_from_text(head + moves + slower))
    shown = panels(picture_of(plan))
    curve, panel = plan.trajectory.curve, shown["j1: position"]
    for marks in (panel.waypoints, panel.virtual_points):
        np.testing.assert_allclose(curve.evaluate(marks[:, 0])[:, 0], marks[:, 1], atol=1e-6)
    assert panel.virtual_points.shape == (2, 2)
    plane = plan.moves[1].planned.phase_plane
    assert plane is not None
    assert plane.law.duration == pytest.approx(plan.moves[1].duration, rel=1e-12)
    assert (plan.trajectory.duration * 7 % 1 < 1e-9) == bool(slower)


def test_sharp_corners_take_the_limit_of_the_phase_plane_to_zero() -> None:
    plan = plan_job(
        job_from_text(
            """\
version: 1
units: {angle: deg}
robot: {joints: [{velocity: 90, acceleration: 400}, {velocity: 90, acceleration: 400}]}
start: {joints: [0, 0]}
moves:
  - {planner: time_optimal, path: polyline, through: [{joints: [30, 0]}], to: {joints: [30, 40]}}
"""
        )
    )
    (panel,) = panels(picture_of(plan, quantities=["phase"])).values()
    (limit,) = panel.limits
    assert panel.x_label == "s [deg]"
    np.testing.assert_allclose(limit[limit[:, 1] == 0][:, 0], [30.0])
    np.testing.assert_allclose(limit[limit[:, 1] > 0][:, 1], 90.0)


def test_findings_are_marked_at_their_time_and_value() -> None:
    text = "version: 1\nunits: {angle: deg}\nrobot: {joints: [{velocity: 40}]}\nstart: {joints: [20]}\n"
    plan = plan_job(job_from_text(text + "moves: [{planner: cubic, to: {joints: [50]}, duration: 1}]\n"))
    picture = picture_of(plan)
    shown = panels(picture)
    np.testing.assert_allclose(shown["j1: velocity"].findings, [[0.5, 45.0]])
    (row,) = shown["j1: position"].findings
    assert row[0] == 0.5
    assert np.isnan(row[1])
    assert "NOT VERIFIED, 1 finding" in picture.title


@pytest.mark.full
def test_points_of_a_path_have_their_names(example: Example) -> None:
    views = picture_of(example("flying_cell"), quantities=["path"]).views
    assert views is not None
    named = dict(views.named)
    assert set(named) == {"home", "above_pick", "pick", "above_place", "place"}
    plan = example("flying_cell")
    q = plan.trajectory.curve.evaluate([plan.trajectory.spans[k].end for k in (1, 5)])
    expected = forward(plan.loaded.robot, q)[:, :3, 3] * 1000
    assert np.abs(np.array([named["pick"], named["place"]]) - expected).max() < 1e-6


NAMED = {"q\u0307": "qd", "q\u0308": "qdd", "q\u20db": "qddd", "\u03c4": "tau", "s\u0307": "sd"}


@pytest.mark.full
def test_what_suits_a_job(example: Example) -> None:
    def kinds(name: str) -> set[str]:
        picture = picture_of(example(name))
        first = [
            NAMED.get(label, label)
            for block in picture.blocks
            for panel in block.panels
            for label in [panel.y_label.split(" [")[0]]
        ]
        return {*first, *(["path"] if picture.views else [])}

    assert kinds("cubic") == {"q", "qd", "qdd"}  # its acceleration steps, and no jerk is limited
    assert kinds("quintic") == {"q", "qd", "qdd", "qddd"}
    assert kinds("ur5e_pick") == {"q", "qd", "qdd", "qddd"}
    assert kinds("time_optimal") == {"q", "qd", "qdd", "sd"}
    assert kinds("dispense") == {"q", "qd", "qdd", "speed", "angular speed", "sd", "path"}


@pytest.mark.parametrize(("count", "columns"), [(1, 1), (2, 2), (3, 4), (12, 4)])
def test_rows_are_quantities_for_few_joints_and_joints_for_many(count: int, columns: int) -> None:
    from picture_jobs import many_joints

    (block,) = picture_of(plan_job(job_from_text(many_joints(count)))).blocks
    assert block.columns == columns
    assert len(block.panels) == 4 * count
    assert bool(block.headings) == (count > 2)


def test_joints_are_chosen_by_name_in_their_own_order(example: Example) -> None:
    plan = example("ur5e_pick")
    shown = panels(picture_of(plan, quantities=["q"], joints=["elbow_joint", "shoulder_pan_joint"]))
    assert list(shown) == ["shoulder_pan_joint: position", "elbow_joint: position"]


@pytest.mark.parametrize(
    ("name", "quantities", "joints", "message"),
    [
        ("cubic", ["tool"], [], "'tool' cannot be plotted: the robot 'robot' has no geometry"),
        ("cubic", ["path", "q"], [], "'path' cannot be plotted"),
        ("ur5e_pick", ["phase"], [], "'phase' cannot be plotted: no move of the job has a time-optimal law"),
        ("ur5e_pick", None, ["elbow"], "there is no joint 'elbow'"),
        ("ur5e_pick", None, ["elbow_joint", "elbow_joint"], "the joint 'elbow_joint' is asked for twice"),
    ],
)
def test_what_does_not_apply_is_refused_by_name(
    name: str, quantities: list[str] | None, joints: list[str], message: str, example: Example
) -> None:
    with pytest.raises(InputError, match=message.replace("(", r"\(")):
        picture_of(example(name), quantities=quantities, joints=joints)


def test_of_many_time_optimal_moves_the_first_planes_are_shown() -> None:
    moves = "".join(
        f"  - {{planner: time_optimal, through: [{{joints: [{k % 2 + 1}]}}], to: {{joints: [{k + 3}]}}}}\n"
        for k in range(MOST_PLANES + 2)
    )
    text = f"version: 1\nrobot: {{joints: [{{velocity: 1, acceleration: 2}}]}}\nstart: {{joints: [0]}}\nmoves:\n{moves}"
    (block,) = picture_of(plan_job(job_from_text(text)), quantities=["phase"]).blocks
    assert len(block.panels) == MOST_PLANES


def table_of(name: str, header: str, *rows: list[float]) -> Table:
    names = tuple(header.split(","))
    return Table(names, np.array(rows, dtype=float), np.zeros(len(names), dtype=np.int64), name)


def test_files_alone_have_the_units_of_their_names() -> None:
    rows = [[0.0, 10.0, 500.0, 1.0], [1.0, 20.0, 600.0, 2.0]]
    table = table_of("a.csv", "t,q1_deg,q2_mm,q3", *rows)
    picture = picture_of(None, [table])
    (block,) = picture.blocks
    labels = [panel.y_label for panel in block.panels]
    assert labels == ["q [deg]", "q [mm]", "q [rad or m]"]
    assert [panel.title for panel in block.panels] == ["j1", "j2", "j3"]
    assert block.panels[1].traces[0].y.tolist() == [500.0, 600.0]
    assert picture.borders is None


def test_files_over_a_job_are_brought_to_its_units(two: Plan) -> None:
    si = table_of("si.csv", "t,q1,q2", [10.0, np.pi / 2, 0.1], [11.0, np.pi, 0.2])
    picture = picture_of(two, [si], quantities=["q"])
    shown = panels(picture)
    assert picture.sources == ("<text>", "si.csv")
    trace = shown["turn: position"].traces[1]
    assert trace.source == 1
    np.testing.assert_allclose(trace.y, [90.0, 180.0])
    np.testing.assert_allclose(shown["lift: position"].traces[1].y, [100.0, 200.0])


def test_rows_of_a_plan_lie_on_its_curves(example: Example, tmp_path: Path) -> None:
    plan = example("weld_seam")  # its columns are t, pose, path, move
    write_plan(plan, str(tmp_path / "rows.csv"))
    picture = picture_of(plan, [read_csv(tmp_path / "rows.csv")])
    assert picture.views is not None
    (_, path), (source, rows) = picture.views.traces
    assert source == 1
    nearest = np.linalg.norm(rows[:, None] - path[None], axis=2).min(axis=1)
    assert nearest.max() < 10.0  # mm


def test_a_file_of_joints_moves_the_tool_of_the_job(example: Example, tmp_path: Path) -> None:
    plan = example("ur5e_pick")
    write_plan(plan, str(tmp_path / "rows.csv"))
    shown = panels(picture_of(plan, [read_csv(tmp_path / "rows.csv")], quantities=["tool"]))
    ours, rows = shown["speed of the tool"].traces
    np.testing.assert_allclose(np.interp(rows.x, ours.x, ours.y), rows.y, atol=12.0)  # mm/s of 1000


def test_columns_of_the_tool_are_drawn_without_a_job() -> None:
    header = "t,x_mm,y_mm,z_mm,vx_mm,vy_mm,vz_mm,wx_deg,wy_deg,wz_deg"
    table = table_of("a.csv", header, [0, 1, 2, 3, 30, 40, 0, 0, 0, 5], [1, 2, 2, 3, 0, 0, 7, 3, 4, 0])
    picture = picture_of(None, [table])
    shown = panels(picture)
    assert shown["speed of the tool"].traces[0].y.tolist() == [50.0, 7.0]
    np.testing.assert_allclose(shown["angular speed of the tool"].traces[0].y, [5.0, 5.0])
    assert shown["speed of the tool"].y_label == "speed [mm/s]"
    assert picture.views is not None
    np.testing.assert_allclose(picture.views.traces[0][1], [[1, 2, 3], [2, 2, 3]])


@pytest.mark.parametrize(
    ("header", "message"),
    [
        ("q1,q2", "a.csv has no column t"),
        ("t,q1_mm", "a.csv has a column q1_mm, and turn is a revolute joint"),
        ("t,q3", "a.csv has a column q3, and the robot of the job 2 joints"),
        ("t,move", "a.csv has no columns for q, qd, qdd"),
    ],
)
def test_files_that_do_not_fit_are_refused(header: str, message: str, two: Plan) -> None:
    with pytest.raises(InputError, match=message):
        picture_of(two, [table_of("a.csv", header, [1.0] * len(header.split(",")))])


def test_two_files_must_agree_about_a_joint_and_something_must_be_there() -> None:
    a, b = table_of("a.csv", "t,q1_mm", [0, 1]), table_of("b.csv", "t,q1_deg", [0, 1])
    with pytest.raises(InputError, match=r"joint 1 is in mm in a\.csv, in deg"):
        picture_of(None, [a, b])
    with pytest.raises(InputError, match="there is nothing to plot"):
        picture_of(None, [table_of("a.csv", "t,move", [0, 1])])
    with pytest.raises(InputError, match="'qd' cannot be plotted: no file has columns qd1"):
        picture_of(None, [a], quantities=["qd"])
    with pytest.raises(InputError, match="'phase' cannot be plotted: a file does not say"):
        picture_of(None, [a], quantities=["phase"])


def test_zones_are_circles_about_their_corners() -> None:
    """The corners are the targets of the job; outside a ball the tool is on the programmed path."""
    plan = flown_cell()
    views = picture_of(plan, quantities=["path"]).views
    assert views is not None
    flown = [zone for zone in plan.flyby.zones if zone.of == "position"] if plan.flyby else []
    assert len(views.zones) == len(flown) == len(views.programmed) > 0
    tool = views.traces[0][1]
    for zone, ball, line in zip(flown, views.zones, views.programmed, strict=True):
        target = plan.loaded.job.moves[zone.move].target
        np.testing.assert_allclose(ball[:3], np.array(target.xyz) * 1000, atol=1e-6)
        assert ball[3] == pytest.approx(zone.used * 1000)
        off = np.linalg.norm(line - ball[:3], axis=1)
        assert off[len(off) // 2] < 1e-6
        assert max(off[0], off[-1]) <= zone.asked * 1000 * (1 + 1e-9)
        assert min(off[0], off[-1]) == pytest.approx(ball[3], rel=1e-6)
        assert 0 < np.linalg.norm(tool - ball[:3], axis=1).min() < ball[3]
