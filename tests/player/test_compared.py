"""Pages of two motions: both from their starts, both with their verdicts, and the difference of their joints."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from cli.running import call

from trajcli.errors import InputError
from trajcli.job.read import job_from_text
from trajcli.kinematics.forward import forward
from trajcli.planning.plan import plan_job
from trajcli.player.page import page_of
from trajcli.player.recorded import scene_of_file
from trajcli.player.scene import scene_of_plan, scene_of_two

ARM = """\
version: 1
units: {angle: deg, length: mm}
robot: {convention: standard, joints: [{a: 500, velocity: 100}, {a: 300, velocity: 100}]}
start: {joints: [0, 0]}
"""
SLOW = ARM + "moves: [{planner: quintic, to: {joints: [60, -40]}, duration: 2}]\n"
QUICK = ARM + "moves: [{planner: quintic, to: {joints: [60, -40]}, duration: 1.5}]\n"
FAST = ARM + "moves: [{planner: quintic, to: {joints: [60, -40]}, duration: 0.5}]\n"


def test_both_are_played_from_their_starts(view: Callable[..., Any], tmp_path: Path) -> None:
    slow, quick = (plan_job(job_from_text(text, "job.yaml")) for text in (QUICK, SLOW))
    page = tmp_path / "view.html"
    page.write_bytes(page_of(scene_of_two(scene_of_plan(slow), scene_of_plan(quick))))
    viewed = view(page)
    assert viewed.page.evaluate("trajcli.clock.end") == 2
    for time in (0.0, 0.7, 1.4, 1.8, 2.0):
        q = [plan.trajectory.curve.evaluate(min(time, plan.trajectory.duration)) for plan in (slow, quick)]
        viewed.page.evaluate("time => trajcli.seek(time)", time)
        places = viewed.page.evaluate(
            "[trajcli.stage.arm, trajcli.stage.otherArm].map((arm) => arm.toolPosition().toArray())"
        )
        expected = [
            forward(plan.loaded.robot, row)[:3, 3] for plan, row in zip((slow, quick), q, strict=True)
        ]
        assert np.abs(np.array(places) - expected).max() < 3e-6
        shown = viewed.page.locator(".joints tbody td:nth-child(5)").all_inner_texts()
        assert [float(text.replace("\N{MINUS SIGN}", "-")) for text in shown] == pytest.approx(
            np.rad2deg(q[1] - q[0]).tolist(), rel=0.006, abs=2e-4
        )
    assert viewed.page.locator("[data-quantity=dq] canvas").count() == 1
    drawn = viewed.page.evaluate("trajcli.plots.dataOf('dq')[1]")
    times = viewed.page.evaluate("[...trajcli.motion.times]")
    there, here = (plan.trajectory.curve.evaluate(np.array(times))[:, 0] for plan in (quick, slow))
    assert np.abs(np.rad2deg(there - here) - drawn).max() < 1e-3
    assert viewed.messages == []
    viewed.page.keyboard.press("c")
    assert not viewed.page.evaluate("trajcli.stage.otherArm.root.visible")


def test_each_has_its_own_verdict(view: Callable[..., Any], tmp_path: Path) -> None:
    plan = plan_job(job_from_text(SLOW, "job.yaml"))
    rows = tmp_path / "rows.csv"
    rows.write_text("t,q1,q2\n5,0,0\n6,1,0.5\n")
    page = tmp_path / "view.html"
    scene = scene_of_two(scene_of_plan(plan), scene_of_file(str(rows)))
    page.write_bytes(page_of(scene))
    viewed = view(page)
    assert viewed.page.locator(".verdict").all_inner_texts() == ["verified", "not judged"]
    assert viewed.page.locator(".verdict.verified").count() == 1
    assert viewed.page.evaluate("[trajcli.other.start, trajcli.other.end]") == [0, 1]
    assert viewed.messages == []


def test_what_is_no_pair_is_refused() -> None:
    one = scene_of_plan(plan_job(job_from_text(SLOW, "job.yaml")))
    bare = "version: 1\nrobot: {joints: %s}\nstart: {joints: 0}\nmoves: [{planner: cubic, to: {joints: 1}, duration: 1}]\n"
    alone = scene_of_plan(plan_job(job_from_text(bare % "1", "alone.yaml")))
    with pytest.raises(InputError, match="job has 2, alone has 1"):
        scene_of_two(one, alone)
    lift = scene_of_plan(plan_job(job_from_text(bare % "[{type: prismatic}, {}]", "lift.yaml")))
    with pytest.raises(InputError, match="joint 1 is an angle in job and a length in lift"):
        scene_of_two(one, lift)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    for name, text in {"slow.yaml": SLOW, "fast.yaml": FAST}.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "rows.csv").write_text("t,q1_deg,q2_deg\n0,0,0\n1,30,-20\n2,60,-40\n")
    (tmp_path / "late.csv").write_text("t,q1_deg,q2_deg\n0,0,0\n1,31,-20\n2,60,-40\n")
    return tmp_path


def test_two_jobs_and_a_job_with_a_file(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    done = call(capfd, "view", "slow.yaml", "fast.yaml", "-o", "two.html")
    assert done.code == 1
    assert "slow: verified, 2 s; fast: not verified, two.html (" in done.err
    assert "velocity of j1 reaches" in done.err
    page = (folder / "two.html").read_bytes()
    assert b'"other":{"title":"fast"' in page
    judged = call(capfd, "view", "slow.yaml", "rows.csv", "-o", "two.html")
    assert "slow: verified, 2 s; rows.csv: " in judged.err
    assert "not judged" not in judged.err  # by the job
    many = call(capfd, "view", "slow.yaml", "rows.csv", "late.csv", "-o", "three.html")
    assert (many.code, "shows one motion or two, and 3 are named" in many.err) == (2, True)


def test_diff_writes_a_page_of_both(folder: Path, capfd: pytest.CaptureFixture[str]) -> None:
    done = call(capfd, "diff", "rows.csv", "late.csv", "--view", "both.html", "--robot", "slow.yaml")
    assert done.code == 1
    assert "both.html (" in done.err
    assert b'"other":{"title":"late.csv"' in (folder / "both.html").read_bytes()
    assert call(capfd, "diff", "rows.csv", "late.csv").out == done.out
    alone = call(capfd, "diff", "rows.csv", "late.csv", "--robot", "slow.yaml")
    assert (alone.code, "add --view FILE.html" in alone.err) == (2, True)
    many = call(capfd, "diff", "rows.csv", "late.csv", ".", "--view", "both.html")
    assert (many.code, "--view is of two files" in many.err) == (2, True)


@pytest.mark.parametrize("name", ["-", "both.txt", "rows.csv"])
def test_a_page_beside_what_differs_is_a_file_of_html(
    name: str, folder: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Standard output has what differs, and nothing is said before the name of the page is known to do."""
    before = (folder / "rows.csv").read_text()
    refused = call(capfd, "diff", "rows.csv", "late.csv", "--view", name)
    assert (refused.code, refused.out) == (2, "")
    assert f"a page is HTML, and '{name}' is the name of something else" in refused.err
    assert (folder / "rows.csv").read_text() == before
