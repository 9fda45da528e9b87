"""`trajcli urdf`, and URDFs wherever a robot is named: in jobs, by --robot, from Python."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from running import ROOT, call

import trajcli
from trajcli.job.robot import load_robot, load_sheet, read_urdf
from trajcli.kinematics.robot import QUANTITIES

MODELS = ROOT / "tests/urdf/models"
NAMES = sorted(path.stem for path in MODELS.glob("*.urdf"))
Capture = pytest.CaptureFixture[str]

JOB = """\
version: 1
robot: {urdf: URDF}
limits: {acceleration: 5, jerk: 50}
start: {joints: 0}
moves:
  - {planner: jerk_limited, to: {joints: 0.2}}
"""


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("exact", [False, True])
def test_the_robot_file_reads_as_the_same_robot(
    name: str, exact: bool, capfd: Capture, tmp_path: Path
) -> None:
    path, file = MODELS / f"{name}.urdf", tmp_path / "robot.yaml"
    assert call(capfd, "urdf", path, *["--exact"] * exact, "-o", file).code == 0
    found = read_urdf(str(path), exact=exact)
    robot, back = found.robot, load_robot(file)
    assert (back.name, back.joints, back.convention) == (robot.name, robot.joints, robot.convention)
    assert np.array_equal(back.base, robot.base)
    assert np.array_equal(back.tool, robot.tool)
    for quantity in QUANTITIES:
        assert np.array_equal(getattr(back.limits, quantity), getattr(robot.limits, quantity))
    note = str(load_sheet(file).note)
    assert all(str(snapped) in note for snapped in found.snapped)
    assert ("the tcp moves by at most" in note) == bool(found.snapped)
    assert call(capfd, "urdf", path, *["--exact"] * exact).out == file.read_text()
    assert call(capfd, "robots", file).code == 0


def test_what_was_decided_is_said(capfd: Capture) -> None:
    code, out, err = call(capfd, "urdf", "-v", MODELS / "xarm7.urdf")
    assert code == 0
    (short,) = call(capfd, "urdf", MODELS / "xarm7.urdf").err.splitlines()
    assert short == f"{err.splitlines()[0]}; {len(err.splitlines()) - 1} more notes: -v says them"
    lines = err.splitlines()
    assert "from link world to link link_eef" in lines[0]
    assert "6 angles of joint origins" in lines[1]
    assert sum("taken as" in line and "moves the tcp by at most" in line for line in lines) == 6
    assert out.startswith("name: UF_ROBOT\nunits: {angle: rad, length: m}\n")
    assert "effort: [-50.0, 50.0]" in out
    assert "the tree also ends in ee_link" in call(capfd, "urdf", MODELS / "ur5.urdf").err
    assert "effort 0 is a placeholder, effort null" in call(capfd, "urdf", "-v", MODELS / "iiwa14.urdf").err


def test_root_tip_and_refusals(capfd: Capture, tmp_path: Path) -> None:
    panda = MODELS / "panda.urdf"
    out = call(capfd, "urdf", panda, "--root", "panda_link2", "--tip", "panda_link5").out
    assert out.count("type: revolute") == 3
    code, out, err = call(capfd, "urdf", panda, "--tip", "panda_link55")
    assert (code, out) == (2, "")
    assert "did you mean 'panda_link5'?" in err
    code, out, err = call(capfd, "urdf", panda, "--tip", "panda_rightfinger", "--errors", "json")
    problem = json.loads(err)["problems"][0]
    assert (code, out) == (2, "")
    assert "mimics panda_finger_joint1" in problem["message"]
    assert call(capfd, "urdf", tmp_path / "none.urdf").code == 4
    assert call(capfd, "urdf", tmp_path).code == 4
    copy = tmp_path / "copy.urdf"
    copy.write_bytes(panda.read_bytes())
    code, _, err = call(capfd, "urdf", copy, "-o", copy)
    assert code == 2
    assert "overwrite" in err
    assert copy.read_bytes() == panda.read_bytes()


def test_a_urdf_by_its_name(capfd: Capture) -> None:
    path = MODELS / "ur5.urdf"
    answer = json.loads(call(capfd, "fk", "--robot", path, "--json", *["0"] * 6).out)
    # the arm stretched along x: a2 + a3, d4 + d6, d1 - d5
    assert answer["xyz"] == pytest.approx([0.425 + 0.39225, 0.10915 + 0.0823, 0.089159 - 0.09465], abs=1e-9)
    arm = trajcli.load_robot(str(path))
    assert np.abs(arm.fk(np.zeros(6)) - answer["matrix"]).max() <= 1e-9
    assert call(capfd, "ik", "-r", path, "--pose", "{xyz: [0.4, 0.1, 0.3], rpy: [0, 3, 0]}").code == 0
    shown = call(capfd, "robots", path).out
    assert "three parallel axes (UR)" in shown
    assert call(capfd, "robots", path, "--yaml").out == call(capfd, "urdf", path).out
    assert call(capfd, "mobility", "-r", path).out.startswith("mobility: 6")
    code, _, err = call(capfd, "fk", "--robot", "none.urdf", "0")
    assert (code, "there is no file 'none.urdf'" in err) == (4, True)


def test_a_urdf_in_a_job(capfd: Capture, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_bytes((MODELS / "xarm7.urdf").read_bytes())
    job = tmp_path / "job.yaml"
    job.write_text(JOB.replace("URDF", "arm.urdf"))
    resolved = tmp_path / "resolved.yaml"
    code, _, err = call(capfd, "plan", job, "--no-output", "--resolved", resolved)
    assert code == 0
    assert "6 angles of joint origins within 0.001 rad" in err
    assert call(capfd, "plan", job, "--no-output", "--strict").code == 1
    planned = trajcli.plan(job)
    assert [event.kind for event in planned.events] == ["angles_snapped"]
    again = trajcli.plan(resolved)
    assert again.loaded.robot.joints == planned.loaded.robot.joints
    assert again.loaded.robot.joints[0].link is not None
    job.write_text(JOB.replace("URDF", "arm.urdf, exact: true"))
    assert call(capfd, "plan", job, "--no-output", "--strict").code == 0
    job.write_text(JOB.replace("URDF", "arm.urdf, root: link1, tip: link5"))
    assert len(trajcli.plan(job).loaded.robot.joints) == 4
    job.write_text(JOB.replace("{urdf: URDF}", "{file: arm.urdf}"))
    assert len(trajcli.plan(job).loaded.robot.joints) == 7


def test_flaws_of_a_urdf_in_a_job_have_their_place(capfd: Capture, tmp_path: Path) -> None:
    job = tmp_path / "job.yaml"
    (tmp_path / "arm.urdf").write_bytes((MODELS / "ur5.urdf").read_bytes())
    job.write_text(JOB.replace("URDF", "arm.urdf, tip: tool1"))
    code, _, err = call(capfd, "plan", job)
    assert code == 2
    assert "job.yaml:2:30: error: the robot has no link 'tool1' for its tip" in err
    job.write_text(JOB.replace("URDF", "gone.urdf"))
    code, _, err = call(capfd, "plan", job)
    assert code == 4
    assert "job.yaml:2:15" in err
    (tmp_path / "arm.urdf").write_text("<robot>")
    job.write_text(JOB.replace("URDF", "arm.urdf"))
    code, _, err = call(capfd, "plan", job)
    assert code == 2
    assert "arm.urdf:1:8: error: the file is no XML" in err


def test_a_job_does_not_overwrite_its_urdf(capfd: Capture, tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_bytes((MODELS / "ur5.urdf").read_bytes())
    job = tmp_path / "job.yaml"
    job.write_text(JOB.replace("URDF", "arm.urdf"))
    code, _, err = call(capfd, "plan", job, "--report", tmp_path / "arm.urdf")
    assert code == 2
    assert "would overwrite the robot's file" in err


TURN = """\
<robot name="one"><link name="a"/><link name="b"/><joint name="turn" type="revolute">
<parent link="a"/><child link="b"/><axis xyz="0 0 1"/><limit lower="-2" upper="1.5" velocity="1" effort="5"/>
<safety_controller soft_lower_limit="-1.25" soft_upper_limit="1" k_velocity="1"/></joint></robot>
"""


@pytest.mark.parametrize(("words", "held"), [([], (-2, 1.5)), (["--soft"], (-1.25, 1))])
def test_soft_limits_tighten_the_ranges_where_they_are_asked_for(
    words: list[str], held: tuple[float, float], capfd: Capture, tmp_path: Path
) -> None:
    file, robot = tmp_path / "arm.urdf", tmp_path / "robot.yaml"
    file.write_text(TURN)
    done = call(capfd, "urdf", file, *words, "-o", robot)
    assert (done.code, done.out, done.err) == (0, "", f"{file}: from link a to link b\n")
    assert load_robot(robot).limits.position.tolist() == [list(held)]


def test_standard_streams_have_names(capfd: Capture, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("arm.urdf").write_text(TURN)
    named = call(capfd, "urdf", "arm.urdf")
    assert call(capfd, "urdf", "arm.urdf", "-o", "-") == named
    piped = call(capfd, "urdf", "-", stdin=TURN)
    assert piped.out == named.out.replace('"arm.urdf"', '"<stdin>"')
    assert piped.err == named.err.replace("arm.urdf", "<stdin>")
    assert call(capfd, "urdf", "-", "-o", "robot.yaml", stdin=TURN).code == 0
    assert Path("robot.yaml").read_text() == piped.out
    assert not Path("-").exists()


def test_a_flaw_of_the_whole_file_stands_at_its_beginning_and_one_of_a_line_at_the_line(
    capfd: Capture, tmp_path: Path
) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(TURN)
    said = "error: the robot has no link 'c' for its tip"
    assert call(capfd, "urdf", file, "--tip", "c").err.startswith(f"{file}:1:1: {said}\n")
    assert call(capfd, "urdf", "-", "--tip", "c", stdin=TURN).err.startswith(f"<stdin>:1:1: {said}\n")
    file.write_text("<robot>\n")
    assert call(capfd, "urdf", file).err.startswith(f"{file}:2:1: error: the file is no XML")


def test_one_more_note_is_no_notes(capfd: Capture, tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    file.write_text(TURN.replace(' effort="5"', ' effort="0"'))
    (line,) = call(capfd, "urdf", file).err.splitlines()
    assert line == f"{file}: from link a to link b; 1 more note: -v says them"
    first, second = call(capfd, "urdf", file, "-v").err.splitlines()
    assert first == f"{file}: from link a to link b"
    assert "effort" in second
