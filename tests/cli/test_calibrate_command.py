"""`trajcli calibrate`: files of measurements, the corrected robot's file, what is refused, plans."""

from __future__ import annotations

import csv
import io
import json

import numpy as np
import pytest
import yaml
from arm_calls import ORACLES, Arms
from scipy.spatial.transform import Rotation
from yaml_files import read_yaml

from trajcli.job.robot import load_robot, load_sheet
from trajcli.kinematics.forward import forward
from trajcli.streams.table import read_csv

CASES = {case["id"]: case for case in read_yaml(ORACLES / "calibration.yaml")["cases"]}
PLANAR = CASES["A-2.4-cal2R"]
SPATIAL = CASES["A-2.4-cal3R"]
DH = ",".join(f"j{i}.{name}" for i in (1, 2, 3) for name in ("theta", "d", "a", "alpha"))
FREE = "j1.a,j1.theta,j2.a,j2.theta"


@pytest.fixture
def arms(capfd, monkeypatch):
    return Arms(capfd, monkeypatch)


@pytest.fixture
def planar(tmp_path):
    return nominal(tmp_path, PLANAR)


@pytest.fixture
def spatial(tmp_path):
    return nominal(tmp_path, SPATIAL)


def nominal(folder, case):
    rows = [{key: row[key] for key in ("theta", "d", "a", "alpha")} for row in case["inputs"]["nominal"]]
    path = folder / "nominal.yaml"
    path.write_text(json.dumps({"convention": "standard", "joints": rows}))
    return path


def listed(folder, items, name="measured.yaml"):
    path = folder / name
    path.write_text(json.dumps(items))
    return path


def headings():
    given = PLANAR["inputs"]
    for q, (x, y, angle) in zip(given["q"], given["measured_xy_heading"], strict=True):
        yield {"joints": q, "pose": {"xyz": [x, y, None], "yaw": angle, "tool_axis": "x"}}


def matrices():
    for q, pose in zip(SPATIAL["inputs"]["q"], SPATIAL["inputs"]["measured_T"], strict=True):
        yield {"joints": q, "pose": {"matrix": pose}}


def rows(name, units=("", "")):
    """Return the spatial case as CSV."""
    angle, length = (180 / np.pi if units[0] else 1.0), (1000.0 if units[1] else 1.0)
    text = io.StringIO()
    writer = csv.writer(text)
    turns = ["qw", "qx", "qy", "qz"] if name == "pose" else []
    writer.writerow(
        [*(f"q{i}{units[0]}" for i in (1, 2, 3)), *(f"{axis}{units[1]}" for axis in "xyz"), *turns]
    )
    for q, pose in zip(SPATIAL["inputs"]["q"], np.array(SPATIAL["inputs"]["measured_T"]), strict=True):
        x, y, z, w = Rotation.from_matrix(pose[:3, :3]).as_quat()
        writer.writerow([*(np.array(q) * angle), *(pose[:3, 3] * length), *([w, x, y, z] if turns else [])])
    return text.getvalue()


def values(report):
    return {f"{row['joint']}.{row['name']}": row["value"] for row in report["parameters"]}


def test_planar_case_by_null_coordinate_and_by_whole_pose(arms, planar, tmp_path):
    whole = [
        {"joints": q, "pose": {"xyz": [x, y, 0], "rpy": [0, 0, angle]}}
        for q, (x, y, angle) in zip(
            PLANAR["inputs"]["q"], PLANAR["inputs"]["measured_xy_heading"], strict=True
        )
    ]
    for items in (list(headings()), whole):
        report = arms.json("calibrate", "-r", planar, "--free", FREE, listed(tmp_path, items))
        found = values(report)
        assert [found[name] for name in FREE.split(",")] == pytest.approx(
            PLANAR["expected"]["parameters"], abs=1e-9
        )
        assert (report["rank"], report["count"], report["unidentifiable"]) == (4, 4, [])
        assert report["residual"]["after"]["position"] == pytest.approx(0, abs=1e-9)
        assert report["residual"]["before"]["position"] > 1e-3
        assert [row["nominal"] for row in report["parameters"]] == [0.0, 0.3, 0.0, 0.2]
        assert all(row["std"] < 1e-12 for row in report["parameters"])


@pytest.mark.parametrize("form", ["yaml", "csv", "csv_deg_mm", "stdin"])
def test_spatial_case_in_every_form_of_file(arms, spatial, tmp_path, form):
    stdin, file = "", tmp_path / "measured.csv"
    if form == "yaml":
        file = listed(tmp_path, list(matrices()))
    elif form == "stdin":
        stdin, file = rows("pose"), "-"
    else:
        file.write_text(rows("pose", ("_deg", "_mm") if form.endswith("mm") else ("", "")))
    out = tmp_path / "calibrated.yaml"
    outcome = arms.call("calibrate", "-r", spatial, "--free", DH, "--json", file, "-o", out, stdin=stdin)
    assert outcome.code == 0, outcome.err
    report = json.loads(outcome.out)
    assert (report["rank"], report["count"]) == (11, 12)
    (shares,) = report["unidentifiable"]
    assert [(share["joint"], share["name"]) for share in shares] == [("j2", "d"), ("j3", "d")]
    assert shares[0]["weight"] == pytest.approx(-shares[1]["weight"])
    pose = forward(load_robot(out), np.array(SPATIAL["inputs"]["q_test"]))
    np.testing.assert_allclose(pose, SPATIAL["expected"]["T_test"], atol=1e-8)


def test_positions_alone(arms, spatial, tmp_path):
    file = tmp_path / "positions.csv"
    file.write_text(rows("position"))
    report = arms.json("calibrate", "-r", spatial, file)
    assert report["residual"]["after"]["angle"] is None
    assert report["residual"]["after"]["position"] < 1e-9
    alone = [shares[0] for shares in report["unidentifiable"] if len(shares) == 1]
    assert {"tool.rx", "tool.ry", "tool.rz"} <= {f"{share['joint']}.{share['name']}" for share in alone}
    stds = {f"{row['joint']}.{row['name']}": row["std"] for row in report["parameters"]}
    assert stds["tool.rx"] is None
    assert stds["j2.a"] is not None


def test_the_corrected_file_keeps_what_is_not_calibrated(arms, tmp_path):
    sheet = load_sheet("ur5e")
    q = np.random.default_rng(0).uniform(-2, 2, (20, 6))
    poses = forward(load_robot("ur5e"), q)
    poses[:, 2, 3] += 0.01
    items = [
        {"joints": np.degrees(row).tolist(), "pose": {"matrix": pose.tolist()}}
        for row, pose in zip(q, poses, strict=True)
    ]
    out = tmp_path / "calibrated.yaml"
    outcome = arms.call("calibrate", "-r", "ur5e", "--free", "base", listed(tmp_path, items), "-o", out)
    assert outcome.code == 0, outcome.err
    new, text = load_sheet(out), yaml.safe_load(out.read_text())
    assert (new.units, new.source, new.licence) == (sheet.units, sheet.source, sheet.licence)
    assert new.note.startswith(sheet.note)
    assert "Calibrated by trajcli" in new.note
    assert text["joints"] == yaml.safe_load(sheet.text)["joints"]
    assert new.robot.joints == sheet.robot.joints
    assert np.array_equal(new.robot.limits.position, sheet.robot.limits.position)
    assert new.robot.base[2, 3] == pytest.approx(0.01)
    np.testing.assert_allclose(new.robot.base[:3, :3], sheet.robot.base[:3, :3], atol=1e-12)
    assert "tool" not in text


def test_a_job_and_a_tool_of_the_command_line(arms, tmp_path):
    job = tmp_path / "job.yaml"
    job.write_text(
        "version: 1\nunits: {angle: deg, length: mm}\nrobot: planar2r\nbase: {xyz: [0, 0, 500]}\n"
        "start: {joints: 0}\nmoves: [{planner: hold, duration: 1}]\n"
    )
    q = np.random.default_rng(0).uniform(-2, 2, (20, 2))
    from dataclasses import replace

    robot = load_robot("planar2r")
    base, tool = np.eye(4), np.eye(4)
    base[2, 3], tool[0, 3] = 0.5, 0.1
    poses = forward(replace(robot, base=base, tool=tool), q)
    poses[:, 2, 3] += 0.002
    items = [
        {"joints": np.degrees(row).tolist(), "pose": {"xyz": (1000 * pose[:3, 3]).tolist()}}
        for row, pose in zip(q, poses, strict=True)
    ]
    out = tmp_path / "calibrated.yaml"
    words = [
        "-r",
        job,
        "--tool",
        "{xyz: [100, 0, 0]}",
        "--free",
        "base.z",
        listed(tmp_path, items),
        "-o",
        out,
    ]
    report = arms.json("calibrate", *words)
    assert values(report)["base.z"] == pytest.approx(0.502)
    new = load_sheet(out)
    assert (new.units.angle, new.units.length) == ("deg", "mm")
    assert new.robot.tool[0, 3] == pytest.approx(0.1)
    np.testing.assert_allclose(forward(new.robot, q)[:, :3, 3], poses[:, :3, 3], atol=1e-9)


def test_the_output_appears_whole_or_not_at_all(arms, planar, tmp_path):
    file = listed(tmp_path, list(headings()))
    job = tmp_path / "job.yaml"
    job.write_text(
        f"version: 1\nrobot: {{file: {planar}}}\nstart: {{joints: 0}}\nmoves: [{{planner: hold, duration: 1}}]\n"
    )
    for arm, out in (
        *((planar, out) for out in ("nowhere/x.yaml", "x.txt", "nominal.yaml", "measured.yaml")),
        *((job, out) for out in ("nominal.yaml", "job.yaml")),
    ):
        before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
        assert arms.call("calibrate", "-r", arm, file, "-o", tmp_path / out).code in (2, 4)
        assert {path.name: path.read_bytes() for path in tmp_path.iterdir()} == before


def test_text_is_in_the_units_of_the_robot(arms, tmp_path):
    out = arms.call("calibrate", "-r", "ur5e", "examples/measurements/ur5e.csv").out
    assert "deg" in out
    assert "one radian counts like" in out
    assert "position, root mean square" in out
    assert "elbow_joint.beta" in out


def test_sigma_scale_and_loss(arms, planar, tmp_path):
    items = [{**item, "sigma": {"position": 1e-4, "angle": 1e-3}} for item in headings()]
    report = arms.json("calibrate", "-r", planar, "--free", FREE, listed(tmp_path, items))
    assert report["noise"] == {"position": None, "angle": None}
    assert all(1e-6 < row["std"] < 1e-2 for row in report["parameters"])
    items[2]["pose"]["xyz"][0] += 0.1
    plain = listed(tmp_path, [{key: item[key] for key in ("joints", "pose")} for item in items])
    report = arms.json(
        "calibrate", "-r", planar, "--free", FREE, plain, "--loss", "cauchy", "--scale", "250mm"
    )
    assert report["scale"] == 0.25
    assert report["loss"]["outliers"] == [3]
    found = values(report)
    assert [found[name] for name in FREE.split(",")] == pytest.approx(
        PLANAR["expected"]["parameters"], abs=1e-6
    )


def test_a_joint_that_never_moved_is_named(arms, spatial, tmp_path):
    robot = load_robot(spatial)
    q = np.random.default_rng(0).uniform(-2, 2, (20, 3))
    q[:, 1] = 0.3
    items = [
        {"joints": row.tolist(), "pose": {"matrix": pose.tolist()}}
        for row, pose in zip(q, forward(robot, q), strict=True)
    ]
    report = arms.json("calibrate", "-r", spatial, listed(tmp_path, items))
    assert any("never moved: j2" in remark for remark in report["remarks"])
    assert any("the configurations tell" in remark for remark in report["remarks"])


def test_wrong_units_are_remarked(arms, planar, tmp_path):
    items = [
        {
            "joints": np.degrees(item["joints"]).tolist(),
            "pose": {"xyz": [900 * item["pose"]["xyz"][0], None, 0]},
        }
        for item in headings()
    ]
    report = arms.json("calibrate", "-r", planar, "--free", "j1.a,base.x", listed(tmp_path, items))
    assert any("more than two turns" in remark for remark in report["remarks"])
    assert any("more than its own length" in remark for remark in report["remarks"])


def test_steps_that_do_not_come_to_rest_are_remarked(arms, planar, tmp_path, monkeypatch):
    from trajcli.kinematics.calibration import fit

    file = listed(tmp_path, list(headings()))
    assert arms.json("calibrate", "-r", planar, "--free", FREE, file)["converged"] is True
    monkeypatch.setattr(fit, "_MOST_STEPS", 1)
    report = arms.json("calibrate", "-r", planar, "--free", FREE, file)
    assert report["converged"] is False
    assert any("come to rest" in remark for remark in report["remarks"])


POSE = {"xyz": [0.4, 0.1, 0.3]}
WRONG = [
    ([], "empty list"),
    ({"joints": [0, 0]}, "expected a list"),
    ([{"joints": [0, 0, 0], "pose": POSE}], "expected 2 values"),
    ([{"joints": {"j1": 0.1}, "pose": POSE}], "no value for j2"),
    ([{"joints": [0, 0]}], "pose"),
    ([{"joints": [0, 0], "pose": {}}], "says nothing"),
    ([{"joints": [0, 0], "pose": {"xyz": [None, None, None]}}], "no coordinate"),
    ([{"joints": [0, 0], "pose": {"xzy": [0, 0, 0]}}], "xzy"),
    ([{"joints": [0, 0], "pose": {**POSE, "configuration": {"elbow": "up"}}}], "configuration"),
    ([{"joints": [0, 0], "pose": POSE, "sigma": {"position": -1}}], "above 0"),
    (
        [{"joints": [0, 0], "pose": POSE, "sigma": {"position": 1}}, {"joints": [0, 0], "pose": POSE}],
        "measurement 2",
    ),
    ([{"joints": [0, 0], "pose": {"matrix": np.diag([1, 1, -1]).tolist()}}], "mirror"),
    ([{"joints": [0, 0], "pose": {"xyz": [1e11, 0, 0]}}], "no robot reaches"),
    ([{"joints": [0.1, 0.2], "pose": POSE}], "at least"),
]


@pytest.mark.parametrize(("items", "said"), WRONG)
def test_wrong_lists_are_refused_where_they_are_wrong(arms, planar, tmp_path, items, said):
    file = listed(tmp_path, items)
    outcome = arms.call("calibrate", "-r", planar, file)
    assert outcome.code == 2
    assert said in outcome.err
    assert str(file) in outcome.err


TABLES = [
    ("q1,x,y,z\n0,0,0,0\n", "q2"),
    ("q1,q2\n0,0\n", "no columns of a measured pose"),
    ("q1,q2,x,y,z,qw,qx,qy\n0,0,0,0,0,1,0,0\n", "qz"),
    ("q1,q2,x,y,z,qw,qx,qy,qz\n0,0,0,0,0,2,0,0,0\n", "length 2"),
    ("q1,q2,x_deg,y,z\n0,0,0,0,0\n", "x_deg"),
    ("q1,q2,x,x_mm\n0,0,0,0\n", "same number"),
    ("q1,q2,x,y,zz\n0,0,0,0,0\n", "zz"),
    ("q1,q2,x,sigma_position\n0,0,0,0\n", "above 0"),
    ("q1,q2,x,sigma_angle\n0,0,0,1\n", "sigma_position"),
    ("q1,q2,x\n0,0,nan\n", "finite"),
    ("q1,q2,x\n0,0,0.1\n", "at least"),
]


@pytest.mark.parametrize(("text", "said"), TABLES)
def test_wrong_tables_are_refused(arms, planar, tmp_path, text, said):
    file = tmp_path / "measured.csv"
    file.write_text(text)
    outcome = arms.call("calibrate", "-r", planar, file)
    assert outcome.code == 2
    assert said in outcome.err


OPTIONS = [
    (["--free", "j1.tetha"], "j1.theta"),
    (["--scale", "-1"], "above 0"),
    (["--scale", "5 deg"], "--scale"),
    (["--loss-scale", "2"], "--loss huber"),
    (["--loss", "huber", "--loss-scale", "0"], "above 0"),
    (["--measure", "pose"], "--plan"),
    (["--plan", "0"], "at least 1"),
    (["--plan", "3", "--loss", "huber"], "--plan"),
]


@pytest.mark.parametrize(("words", "said"), OPTIONS)
def test_wrong_options_are_refused(arms, planar, tmp_path, words, said):
    outcome = arms.call("calibrate", "-r", planar, listed(tmp_path, list(headings())), *words)
    assert outcome.code == 2
    assert said in outcome.err


def test_a_file_or_a_plan_is_needed(arms, planar):
    outcome = arms.call("calibrate", "-r", planar)
    assert outcome.code == 2
    assert "--plan" in outcome.err
    assert arms.call("calibrate", "-r", planar, "none.csv").code == 4
    assert arms.call("calibrate", "-r", "examples/robots/none.yaml", "x.csv").code == 4


def test_parameters_that_nothing_tells_are_refused(arms, planar, tmp_path):
    items = [{"joints": q, "pose": {"xyz": [0.1, 0.2, 0]}} for q in PLANAR["inputs"]["q"]]
    outcome = arms.call("calibrate", "-r", planar, "--free", "tool.rx", listed(tmp_path, items))
    assert outcome.code == 2
    assert "tool.rx" in outcome.err


def test_a_plan_as_csv_and_json(arms, tmp_path):
    out = tmp_path / "plan.csv"
    first = arms.call("calibrate", "-r", "ur5e", "--plan", 12)
    assert first.code == 0
    assert arms.call("calibrate", "-r", "ur5e", "--plan", 12, "-o", out).code == 0
    assert out.read_text() == first.out
    table = read_csv(out)
    assert table.names == tuple(f"q{i}_deg" for i in range(1, 7))
    limits = np.degrees(load_robot("ur5e").limits.position)
    assert ((table.columns >= limits[:, 0]) & (table.columns <= limits[:, 1])).all()
    report = arms.json("calibrate", "-r", "ur5e", "--plan", 12)
    np.testing.assert_allclose(np.degrees(report["configurations"]), table.columns, atol=1e-8)
    assert (report["rank"], report["count"]) == (30, 36)


def test_a_plan_from_candidates(arms, tmp_path):
    q = np.random.default_rng(0).uniform(-2, 2, (40, 6))
    file = listed(tmp_path, [{"joints": np.degrees(row).tolist()} for row in q])
    report = arms.json("calibrate", "-r", "ur5e", "--plan", 12, file)
    assert all((np.abs(q - row).max(axis=1) < 1e-9).any() for row in np.array(report["configurations"]))
    assert arms.call("calibrate", "-r", "ur5e", "--plan", 41, file).code == 2
    assert arms.call("calibrate", "-r", "ur5e", "--plan", 4, file).code == 2
    assert arms.call("calibrate", "-r", "ur5e", "--plan", 8, "--measure", "position", file).code == 2


def test_measurements_that_are_wrong_alike_are_one_error(arms, planar, tmp_path):
    items = [{"joints": [0.1 * k] * 5, "pose": {"xyz": [1, 1, 0]}} for k in range(30)]
    outcome = arms.call("calibrate", "-r", planar, listed(tmp_path, items))
    assert outcome.code == 2
    assert outcome.err.count("error:") == 1
    assert "29 more measurements are like this" in outcome.err
