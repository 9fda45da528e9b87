"""Rows of a job whose tool changes: judged, found back, drawn and logged with the tool of each move."""

from __future__ import annotations

from functools import cache
from pathlib import Path

import numpy as np
import pytest
from tiers import few

from trajcli.editing.edited_motion import ReadingOptions, read_motion
from trajcli.editing.operations import cut
from trajcli.editing.requirements import kept_limits
from trajcli.editing.retiming import retime
from trajcli.errors import InputError
from trajcli.grids import ListedGrid
from trajcli.job.read import job_from_text
from trajcli.judge.file import CheckOptions, check_file
from trajcli.judge.judgement import Judgement
from trajcli.output.delivery.joined import write_plan
from trajcli.output.recording import LogOptions, recording_of
from trajcli.planning.plan import Plan, plan_job
from trajcli.player.scene import scene_of_plan
from trajcli.plots.planned_motion import PlannedMotion
from trajcli.samples import sample

JOB = """\
version: 1
units: {angle: deg}
robot: ur5e
limits: {acceleration: 800, tcp: {angular_speed: 200, speed: 0.3}}
tools: {long: {xyz: [0, 0, 0.15]}, bent: {xyz: [0.06, -0.02, 0.22], rpy: [10, 30, -20]}}
tool: long
start: {joints: [0, -90, 90, 0, 90, 0]}
moves:
  - {planner: line, to: {from: here, offset: {xyz: [0, 0, 0.05]}}, law: {shape: quintic, duration: 1}}
  - {tool: bent}
  - {planner: line, to: {from: here, offset: {xyz: [0, 0, -0.05]}}, law: {shape: quintic, duration: 1}}
  - {tool: long}
  - {planner: quintic, to: {joints: [5, -85, 85, 0, 85, 5]}, duration: 1}
output: {rate: 100, columns: [COLUMNS]}
"""


@cache
def planned(columns: str) -> Plan:
    plan = plan_job(job_from_text(JOB.replace("COLUMNS", columns)))
    assert plan.verdict.passed
    return plan


def judged(folder: Path, columns: str, change: tuple[str, str] = ("", "")) -> Judgement:
    (folder / "job.yaml").write_text(JOB.replace("COLUMNS", columns).replace(*change))
    write_plan(planned(columns), str(folder / "rows.csv"), 9)
    return check_file(str(folder / "rows.csv"), CheckOptions(job=str(folder / "job.yaml"))).judgement


@pytest.mark.parametrize(
    "columns",
    few(
        [
            "t, q, qd, qdd, pose, twist, twistd",
            "t, q, twist, twistd",
            "t, q, qd, pose, path, move",
            "t, pose",
            "t, pose, twist, twistd",
        ],
        2,
    ),
)
def test_rows_of_the_plan_are_accepted(tmp_path: Path, columns: str) -> None:
    judgement = judged(tmp_path, columns)
    assert judgement.passed
    assert judgement.planned_rows
    assert not judgement.errors


def test_poses_of_another_tool_are_a_finding(tmp_path: Path) -> None:
    wrong = judged(tmp_path, "t, q, qd, qdd, pose", ("xyz: [0.06,", "xyz: [0.061,"))
    finding = next(found for found in wrong.errors if found.kind == "tool")
    assert finding.value == pytest.approx(1e-3, rel=1e-6)
    assert finding.time is not None
    assert 1.0 <= finding.time <= 2.0


def test_velocities_of_several_tools_alone_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="has velocities of several tools, and no poses"):
        judged(tmp_path, "t, twist")


def test_the_tool_is_a_moving_frame_of_the_log() -> None:
    plan = planned("t, q")
    recording = recording_of(plan, LogOptions())
    frames, path = recording.frames, recording.path
    assert frames is not None
    assert path is not None
    assert [child for _, child, _ in frames.fixed] == ["base_link"]
    assert frames.chain[-1] == "tool0"
    nanoseconds = (np.array([0.5, 0.999999999, 1.0, 1.7, 2.0]) * 1e9).astype(np.int64)
    tips = frames.poses(nanoseconds)[:, -1, :3]
    flange = tips[0] - [0, 0, 0.15]  # the frame of the last link, turned by nothing
    np.testing.assert_allclose(tips[[0, 1, 4]] - flange, [[0, 0, 0.15]] * 3, atol=1e-12)
    np.testing.assert_allclose(tips[[2, 3]] - flange, [[0.06, -0.02, 0.22]] * 2, atol=1e-12)
    grid = ListedGrid(plan.trajectory.duration, path.nanoseconds[::20] / 1e9)
    rows = np.concatenate([*sample(plan.trajectory, grid, ("pose",), robot=plan.loaded.robot)])
    np.testing.assert_allclose(path.poses[::20, :3], rows[:, :3], atol=1e-9)


def test_pictures_and_pages_draw_the_tool_of_each_move() -> None:
    plan = planned("t, q")
    tool = PlannedMotion(plan).tool()
    end = tool.times < 1.0
    after = (tool.times > 1.0) & (tool.times < 2.0)
    grid = ListedGrid(plan.trajectory.duration, np.array([0.9999999, 1.0000001]))
    rows = np.concatenate([*sample(plan.trajectory, grid, ("pose",), robot=plan.loaded.robot)])
    np.testing.assert_allclose(tool.positions[end][-1], rows[0, :3], atol=2e-3)
    np.testing.assert_allclose(tool.positions[after][0], rows[1, :3], atol=2e-3)
    assert np.linalg.norm(rows[1, :3] - rows[0, :3]) > 0.05
    changes = scene_of_plan(plan)["robot"]["changes"]
    assert [change["time"] for change in changes] == [1.0, 2.0]
    assert changes[0]["tool"][0][3] == 0.06


def test_retiming_needs_to_know_the_tool_of_a_row(tmp_path: Path) -> None:
    judged(tmp_path, "t, q, qd, qdd")
    limits = kept_limits(str(tmp_path / "job.yaml"), None)
    names, types = limits.robot.joint_names, limits.robot.joint_types
    motion = read_motion(str(tmp_path / "rows.csv"), ReadingOptions(), joints=names, joint_types=types)
    assert np.unique(np.asarray(limits.with_moves(motion).rows.move)).tolist() == [0, 2, 4]
    part = limits.with_moves(cut(motion, 0.0, 1.5))
    with pytest.raises(InputError, match=r"has no column `move` and .* differ in limits, tool or load"):
        retime(part, limits.requirements)


def test_velocities_beside_joints_are_judged_with_the_tool_of_their_move(tmp_path: Path) -> None:
    """Stretched rows are none of the plan: their velocities are judged by how the tool moves."""
    judged(tmp_path, "t, q, twist")
    names, *lines = (tmp_path / "rows.csv").read_text().splitlines()
    assert names.split(",")[7:] == ["vx", "vy", "vz", "wx_deg", "wy_deg", "wz_deg"]
    rows = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    for factor, kinds in ((1.0, set()), (1.2, {"derivative"})):
        turned = rows.copy()
        turned[:, 1] += 1e-6  # joints a little elsewhere
        turned[120:180, 7:10] *= factor
        text = [names, *(",".join(f"{cell:.9f}" for cell in row) for row in turned)]
        (tmp_path / "rows.csv").write_text("\n".join(text) + "\n")
        found = check_file(str(tmp_path / "rows.csv"), CheckOptions(job=str(tmp_path / "job.yaml"))).judgement
        assert {finding.kind for finding in found.errors if finding.quantity != "position"} >= kinds
        assert bool(found.errors) == bool(kinds)
