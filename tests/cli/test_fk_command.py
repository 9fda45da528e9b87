"""`trajcli fk`: poses against the oracles, units, frames, pipes, errors."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from arm_calls import Arms, cases, ids, robot_file

from trajcli.job.robot import load_robot

HOME = ("0", "-90", "90", "0", "90", "0")


@pytest.fixture
def arms(capfd, monkeypatch):
    return Arms(capfd, monkeypatch)


@pytest.mark.parametrize("name", ids("forward.yaml", "dh_fk"))
def test_every_pose_of_the_oracles(arms, name, tmp_path):
    case = cases("forward.yaml")[name]
    told = arms.json("fk", "--robot", robot_file(tmp_path, case["inputs"]), "--", *case["inputs"]["q"])
    assert set(told) == {"matrix", "xyz", "rpy", "quat_wxyz"}
    expected = np.array(case["expected"]["T"])
    assert np.array(told["matrix"]) == pytest.approx(expected, abs=case["tolerance"])
    if "misprint_trap" in case:
        assert np.abs(np.array(told["matrix"]) - case["misprint_trap"]["T"]).max() > 1e-3


def test_the_numbers_of_a_pose_belong_together(arms):
    from scipy.spatial.transform import Rotation

    told = arms.json("fk", "--robot", "puma560", "--", 10, -20, 30, 40, -50, 60)
    matrix = np.array(told["matrix"])
    assert matrix[:3, 3].tolist() == told["xyz"]
    turned = Rotation.from_euler("xyz", told["rpy"], degrees=True)
    assert turned.as_matrix() == pytest.approx(matrix[:3, :3], abs=1e-12)
    w, x, y, z = told["quat_wxyz"]
    assert Rotation.from_quat([x, y, z, w]).as_matrix() == pytest.approx(matrix[:3, :3], abs=1e-12)


def test_units_are_those_of_the_file_or_si(arms, tmp_path):
    path = tmp_path / "slide.yaml"
    path.write_text(
        "units: {angle: deg, length: mm}\nconvention: standard\n"
        "joints: [{a: 300}, {type: prismatic, d: 50}]\n"
    )
    told = arms.json("fk", "--robot", path, "90", "25")
    assert told["xyz"] == pytest.approx([0, 300, 75], abs=1e-12)
    assert told["rpy"] == pytest.approx([0, 0, 90])
    si = arms.json("fk", "--robot", path, "--si", np.pi / 2, 0.025)
    assert si["xyz"] == pytest.approx([0, 0.3, 0.075], abs=1e-15)
    assert si["rpy"] == pytest.approx([0, 0, np.pi / 2])
    own = arms.json("fk", "--robot", path, "0.25rev", "2.5 cm")
    assert np.array(own["matrix"]) == pytest.approx(np.array(told["matrix"]))
    assert arms.json("fk", "--robot", path, "90,25") == told


def test_the_base_frame_leaves_the_robots_base_out(arms):
    world = np.array(arms.json("fk", "--robot", "ur5e", *HOME)["matrix"])
    base = np.array(arms.json("fk", "--robot", "ur5e", "--frame", "base", *HOME)["matrix"])
    assert np.diag([-1.0, -1, 1, 1]) @ base == pytest.approx(world, abs=1e-15)


def test_a_tool_replaces_the_robots_own(arms, tmp_path):
    bare = np.array(arms.json("fk", "--robot", "irb120", "--tool", "{}", *HOME, "--si")["matrix"])
    own = np.array(arms.json("fk", "--robot", "irb120", *HOME, "--si")["matrix"])
    assert bare @ np.diag([-1.0, -1, 1, 1]) == pytest.approx(own, abs=1e-12)
    (tmp_path / "tool.yaml").write_text("xyz: [0, 0, 0.1]\n")
    for tool in ("{xyz: [0, 0, 0.1]}", "xyz: [0, 0, 10 cm]", f"@{tmp_path / 'tool.yaml'}"):
        longer = np.array(arms.json("fk", "--robot", "irb120", "--tool", tool, *HOME, "--si")["matrix"])
        assert longer[:3, 3] == pytest.approx(bare[:3, 3] + 0.1 * bare[:3, 2], abs=1e-12)


def test_links_are_the_frames_of_the_table(arms, tmp_path):
    case = cases("forward.yaml")["A-vd2.09"]
    path = robot_file(tmp_path, case["inputs"])
    links = arms.json("fk", "--links", "--robot", path, "--", 0.4, -0.9, 0.5)["links"]
    assert [link["name"] for link in links] == ["j1", "j2", "j3"]
    x, y = 0.3 * np.cos(0.4), 0.3 * np.sin(0.4)
    assert links[0]["xyz"] == pytest.approx([x, y, 0])
    assert links[1]["xyz"] == pytest.approx([x + 0.2 * np.cos(-0.5), y + 0.2 * np.sin(-0.5), 0])
    assert set(links[0]) == {"name", "matrix", "xyz", "rpy", "quat_wxyz"}


def test_text_says_units_and_frames(arms):
    code, out, err = arms.call("fk", "--robot", "ur5e", "--links", *HOME)
    assert (code, err) == (0, "")
    assert out.startswith("pose of the tcp of UR5e in world:\n")
    assert "  xyz (m): 0.4918  0.1333  0.4878\n" in out
    assert "  rpy (deg, about fixed x, y, z): 90  0  90\n" in out
    assert "frame of link wrist_3_joint in world:" in out


def rows_of(out: str) -> tuple[list[str], np.ndarray]:
    head, *lines = out.splitlines()
    return head.split(","), np.array([[float(cell) for cell in line.split(",")] for line in lines])


def test_rows_say_their_units(arms):
    q = np.array([[10, -90, 90, 0, 90, 0], [20, -80, 70, 5, 80, 10]])
    inputs = {
        "deg": ("q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg", q),
        "rad": ("q1,q2,q3,q4,q5,q6", np.deg2rad(q)),
    }
    results = []
    for head, values in inputs.values():
        body = "".join(",".join(map(repr, row)) + "\n" for row in values.tolist())
        code, out, err = arms.call("fk", "--robot", "ur5e", "-", stdin=f"{head}\n{body}")
        assert (code, err) == (0, "")
        results.append(rows_of(out))
    assert results[0][0] == ["x", "y", "z", "qw", "qx", "qy", "qz"]
    assert results[0][1] == pytest.approx(results[1][1], abs=2e-9)
    one = arms.json("fk", "--robot", "ur5e", "--", *q[1])
    assert results[0][1][1] == pytest.approx([*one["xyz"], *one["quat_wxyz"]], abs=2e-9)


def test_rows_in_millimetres_and_in_si(arms, tmp_path):
    path = tmp_path / "arm.yaml"
    path.write_text("units: {length: mm}\nconvention: standard\njoints: [{a: 300}, {type: prismatic}]\n")
    rows = "t,q2_mm,extra,q1_deg,q3x\n0.5,20,7,90,1\n"
    code, out, _ = arms.call("fk", "--robot", path, "-", stdin=rows)
    names, values = rows_of(out)
    assert (code, names[:4]) == (0, ["t", "x_mm", "y_mm", "z_mm"])
    assert values[0, :4] == pytest.approx([0.5, 0, 300, 20])
    names, values = rows_of(arms.call("fk", "--robot", path, "--si", "-", stdin=rows).out)
    assert names[:4] == ["t", "x", "y", "z"]
    assert values[0, :4] == pytest.approx([0.5, 0, 0.3, 0.02])


def test_full_digits_are_lossless(arms):
    head, row = "q1,q2\n", "0.1,0.2\n"
    code, out, _ = arms.call("fk", "--robot", "planar2r", "--digits", "full", "-", stdin=head + row)
    expected = 0.3 * np.cos(0.1) + 0.2 * np.cos(0.1 + 0.2)
    assert code == 0
    assert float(out.splitlines()[1].split(",")[0]) == pytest.approx(expected, abs=1e-16)


BAD_CALLS = [
    (["--robot", "ur5ee", *HOME], 2, "did you mean 'ur5e'?"),
    (["--robot", "none.yaml", *HOME], 4, "there is no file 'none.yaml'"),
    (["--robot", "ur5e", "1", "2"], 2, "q has 2 values, UR5e has 6 joints"),
    (["--robot", "ur5e", "rows.csv"], 2, "wrist_3_joint (deg); `- < FILE` reads rows of a CSV"),
    (["--robot", "ur5e", *HOME[:5], "nan"], 2, "q of wrist_3_joint: expected a number (deg), got nan"),
    (["--robot", "ur5e", *HOME[:5], "1e400"], 2, "expected a magnitude of at most"),
    (["--robot", "ur5e", *HOME[:5], "10mm"], 2, "expected an angle"),
    (["--robot", "ur5e", "--jsn", *HOME], 2, "No such option: --jsn"),
    (["--robot", "ur5e", "--tool", "{xyz: [1, 2]}", *HOME], 2, "--tool:1:7: error: expected 3 numbers"),
    (["--robot", "ur5e", "--tool", "{xzy: [1, 2, 3]}", *HOME], 2, "unknown key 'xzy'"),
    (["--robot", "ur5e", "--tool", "@no.yaml", *HOME], 4, "there is no file 'no.yaml'"),
    (["--robot", "ur5e", "--links", "-"], 2, "--links is for one configuration"),
    (["--robot", "ur5e", "--json", "-"], 2, "--json is for one configuration"),
]


@pytest.mark.parametrize(("words", "code", "message"), BAD_CALLS, ids=[row[2] for row in BAD_CALLS])
def test_wrong_calls(arms, words, code, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    outcome = arms.call("fk", *words)
    assert (outcome.code, outcome.out) == (code, "")
    assert message in outcome.err


def test_bare_joints_have_no_pose(arms, tmp_path):
    (tmp_path / "bare.yaml").write_text("joints: 2\n")
    outcome = arms.call("fk", "--robot", tmp_path / "bare.yaml", "1", "2")
    assert outcome.code == 2
    assert "bare joints and no geometry" in outcome.err


BAD_ROWS = [
    ("q1\n1\n", "Planar 2R has 2 joints, and there is no column q2"),
    ("q1,q2,q3\n1,2,3\n", "q3 is the column of joint 3, Planar 2R has 2 joints"),
    ("q1,q1_deg,q2\n1,2,3\n", "q1_deg and q1 are columns of the same joint"),
    ("q1_mm,q2\n1,2\n", "q1_mm cannot be in mm: j1 is revolute"),
    ("q1,q2\n1,nan\n", "stdin:2:3: error: q2 is 'nan', expected a finite number"),
    ("q1,q2\n", "the file has no rows"),
    ("", "stdin is empty"),
]


@pytest.mark.parametrize(("rows", "message"), BAD_ROWS, ids=[row[1] for row in BAD_ROWS])
def test_wrong_rows(arms, rows, message):
    outcome = arms.call("fk", "--robot", "planar2r", "-", stdin=rows)
    assert outcome.code == 2
    assert message in outcome.err


def test_errors_as_json(arms):
    outcome = arms.call("fk", "--robot", "ur5e", "--errors", "json", "--tool", "{xyz: [1, 2]}", *HOME)
    told = json.loads(outcome.err)
    assert (outcome.code, told["exit"]) == (2, 2)
    assert (told["problems"][0]["file"], told["problems"][0]["column"]) == ("--tool", 7)


def test_a_robot_file_may_have_any_name(arms, tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    Path("myarm").write_text("convention: standard\njoints: [{a: 1}]\n")
    assert arms.json("fk", "--robot", "myarm", "0")["xyz"] == [1, 0, 0]


def test_joint_values_outside_the_limits_are_remarked(arms):
    turned = arms.call("fk", "--robot", "ur5e", "--", 0, -90, 190, 0, 90, 0)
    same = arms.call("fk", "--robot", "ur5e", "--", 0, -90, -170, 0, 90, 0)  # a full turn away
    assert (turned.code, turned.out) == (0, same.out)
    assert turned.err == "outside the limits of UR5e: elbow_joint is at 190 deg, its limit is 180 deg\n"
    assert same.err == ""
    below = arms.call("fk", "--robot", "ur5e", "--si", "--", 0, -8, -4, 0, 0, 0)
    lower = f"shoulder_lift_joint is at -8 rad, its limit is {-2 * np.pi:.9g} rad, and 1 more joint"
    assert below.err == f"outside the limits of UR5e: {lower}\n"


def test_a_remark_leaves_json_as_it_is(arms):
    told = arms.json("fk", "--robot", "ur5e", "--", 0, -90, 190, 0, 90, 0)
    assert set(told) == {"matrix", "xyz", "rpy", "quat_wxyz"}
    assert "its limit is 180 deg" in arms.call("fk", "--robot", "ur5e", "--json", 0, -90, 190, 0, 90, 0).err


def test_at_the_limit_is_not_outside(arms):
    assert arms.call("fk", "--robot", "ur5e", "--", 360, -360, 180, 0, 90, 0).err == ""
    assert "180.000001 deg" in arms.call("fk", "--robot", "ur5e", "--", 0, 0, "180.000001", 0, 90, 0).err
    assert arms.call("fk", "--robot", "rrp", "--", 1e4, -1e4, 1e4).err == ""  # has no limits


def test_rows_outside_the_limits_are_counted(arms):
    head = "t,q1_deg,q2_deg,q3_deg,q4_deg,q5_deg,q6_deg\n"
    long = f"0.{'0' * 80}"  # one joint's text
    ramp = "".join(f"{k / 1000},{long},-90,{k / 50},0,{k / 20000},{-k / 25}\n" for k in range(10000))
    assert len(ramp) > 1 << 20  # more than is read at a time
    code, out, err = arms.call("fk", "--robot", "ur5e", "-", stdin=head + ramp)
    assert (code, len(out.splitlines())) == (0, 10001)
    # after k = 9000 the elbow is over 180, and the last wrist over -360 by twice as much
    where = "in 999 of 10000 rows, first in row 9001 (from 0, t = 9.001 s)"
    what = "wrist_3_joint is at -360.04 deg, its limit is -360 deg, and 1 more joint"
    assert err == f"outside the limits of UR5e {where}: {what}\n"
    short = head + ramp[: ramp.index("9.001,")]
    assert arms.call("fk", "--robot", "ur5e", "-", stdin=short).err == ""


def test_a_remark_speaks_the_units_of_the_columns(arms, tmp_path):
    path = tmp_path / "slide.yaml"
    path.write_text(
        "convention: standard\n"
        "joints: [{position: [-5 deg, 5 deg]}, {type: prismatic, position: [0.02, 0.1]}]\n"
    )
    rows = "q1,q2_mm\n0,50\n0,19\n0.2,10\n"
    err = arms.call("fk", "--robot", path, "-", stdin=rows).err
    where = "in 2 of 3 rows, first in row 1 (from 0)"
    assert err == f"outside the limits of slide {where}: j2 is at 19 mm, its limit is 20 mm\n"
    # 5 deg = 0.08726646259971647 rad: nine decimals round it up, beyond the limit
    assert arms.call("fk", "--robot", path, "-", stdin="q1,q2\n0.087266463,0.05\n").err == ""
    assert "in 1 of 1 rows" in arms.call("fk", "--robot", path, "-", stdin="q1,q2\n0.087266464,0.05\n").err


@pytest.mark.parametrize("command", ["fk", "ik", "jacobian"])
def test_a_base_may_be_said(arms, command):
    base, joints = "{xyz: [0.1, 0.2, 0.3], rpy: [0, 0, 90]}", (10, -80, 70, 20, 80, 30)
    from_base = np.array(arms.json("fk", "-r", "ur5e", "--frame", "base", *joints)["matrix"])
    moved = arms.json("fk", "-r", "ur5e", "--base", base, *joints)
    turned = np.array([[0, -1, 0, 0.1], [1, 0, 0, 0.2], [0, 0, 1, 0.3], [0, 0, 0, 1]])
    assert np.array(moved["matrix"]) == pytest.approx(turned @ from_base, abs=1e-12)
    if command == "ik":
        w, x, y, z = moved["quat_wxyz"]
        asked = f"{{xyz: {moved['xyz']}, quat_wxyz: [{w}, {x}, {y}, {z}]}}"
        answers = arms.json("ik", "-r", "ur5e", "--base", base, "--pose", asked)
        nearest = [np.abs(np.array(one["joints"]) - joints).max() for one in answers]
        assert min(nearest) < 1e-6
    if command == "jacobian":
        told = [arms.json("jacobian", "-r", "ur5e", *more, *joints) for more in ((), ("--base", base))]
        own, there = (np.array(each["jacobian"]) for each in told)
        in_world = np.array(arms.json("fk", "-r", "ur5e", *joints)["matrix"])
        turn = turned[:3, :3] @ from_base[:3, :3] @ in_world[:3, :3].T
        assert there == pytest.approx(np.kron(np.eye(2), turn) @ own, abs=1e-12)


def test_a_base_counts_for_nothing_from_the_base(arms):
    refused = arms.call("fk", "-r", "ur5e", "--frame", "base", "--base", "{xyz: [0, 0, 1]}", *HOME)
    assert refused.code == 2
    assert "leave --base out" in refused.err


def test_rows_made_with_a_tool_say_that_it_is_missing(arms):
    tool = "{xyz: [0, 0, 0.12]}"
    pose = arms.json("fk", "-r", "ur5e", "--tool", tool, *HOME)
    cells = [*np.radians(np.array(HOME, float)), *pose["xyz"], *pose["quat_wxyz"]]
    rows = "q1,q2,q3,q4,q5,q6,x,y,z,qw,qx,qy,qz\n" + ",".join(map(repr, map(float, cells))) + "\n"
    bare = arms.call("fk", "-r", "ur5e", "-", stdin=rows)
    assert "up to 0.12 m from that of UR5e" in bare.err
    assert "--tool, --base or --robot JOB" in bare.err
    for more in (("--tool", tool), ("--frame", "base")):
        assert arms.call("fk", "-r", "ur5e", *more, "-", stdin=rows).err == ""


def test_rows_of_a_job_say_their_tool_in_the_frame_of_the_job(arms, tmp_path):
    job = tmp_path / "job.yaml"
    job.write_text(
        "version: 1\nrobot: planar2r\nframes: {table: {xyz: [0.1, 0, 0], rpy: [0, 0, 1.5707963267948966]}}\n"
        "start: {joints: [0, 0]}\nmoves: [{planner: hold, duration: 1}]\noutput: {in: table}\n"
    )
    # stretched to (0.5, 0) m in world, which is (0, -0.4) m from the table
    head = "q1,q2,x,y,z,qw,qx,qy,qz\n"
    assert arms.call("fk", "-r", job, "-", stdin=head + "0,0,0,-0.4,0,1,0,0,0\n").err == ""
    other = arms.call("fk", "-r", job, "-", stdin=head + "0,0,0,-0.6,0,1,0,0,0\n").err
    assert "up to 0.2 m from that of Planar 2R" in other
    assert "JOB" not in other


@pytest.mark.parametrize("frame", ["world", "base"])
def test_the_frame_is_named_with_each_pose(arms, frame):
    lines = arms.call("fk", "-r", "rp", "0.1", "0.2", "--links", "--frame", frame).out.splitlines()
    heads = [line for line in lines if line.endswith(":")]
    assert heads == [
        f"pose of the tcp of Planar RP in {frame}:",
        *(f"frame of link {name} in {frame}:" for name in load_robot("rp").joint_names),
    ]
