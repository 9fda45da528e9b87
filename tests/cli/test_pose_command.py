"""`trajcli pose`: compositions, representations and ways against the oracles."""

from __future__ import annotations

import json

import numpy as np
import pytest
from arm_calls import Arms, cases, ids
from scipy.spatial.transform import Rotation

R = "rotations.yaml"
KEYS = ["matrix", "xyz", "rpy", "quat_wxyz", "axis_angle", "determinant"]


@pytest.fixture
def arms(capfd, monkeypatch):
    return Arms(capfd, monkeypatch)


def units_of(case):
    return ("--units", f"{case['units']['angle']},m")


def steps_of(sequence):
    return [
        json.dumps({"axis_angle": {"axis": turn["axis"], "angle": turn["angle"]}, "frame": turn["frame"]})
        for turn in sequence
    ]


def matrix(rows):
    return json.dumps({"matrix": np.array(rows).tolist()})


@pytest.mark.parametrize("name", ids(R, "rotation_compose", "rotate_point"))
def test_turns_about_fixed_and_current_axes(arms, name):
    case = cases(R)[name]
    steps, expected = steps_of(case["inputs"]["sequence"]), case["expected"]
    point = case["inputs"].get("point", [0, 0, 0])
    told = arms.json("pose", *units_of(case), *steps, "--point", *point)
    for key, shown in (("R", np.array(told["matrix"])[:3, :3]), ("point", np.array(told["point"]))):
        if key in expected:
            assert shown == pytest.approx(np.array(expected[key]), abs=1e-12)
            if "misprint_trap" in case:
                assert np.abs(shown - case["misprint_trap"][key]).max() > 1e-3
    assert told["determinant"] == pytest.approx(1)


def test_angles_are_read_off_the_raw_entries(arms):
    case = cases(R)["A-vd2.06"]
    told = arms.json("pose", "--units", "deg", matrix(case["inputs"]["R"]))
    expected = case["expected"]
    assert told["rpy"] == pytest.approx([expected["psi"], expected["theta"], expected["phi"]], abs=1e-9)
    assert np.array(told["matrix"])[:3, :3].tolist() == case["inputs"]["R"]
    text = arms.call("pose", matrix(case["inputs"]["R"])).out
    assert "the matrix is off a rotation by 1.9" in text


@pytest.mark.parametrize("name", ids(R, "euler_zyz_from_matrix"))
def test_both_euler_solutions(arms, name):
    case = cases(R)[name]
    told = arms.json("pose", "--euler", "ZYZ", matrix(case["inputs"]["R"]))
    found = sorted(told["euler"])
    assert np.array(found) == pytest.approx(np.array(sorted(case["expected"]["solutions"])), abs=1e-12)
    assert set(told) == {*KEYS, "euler"}


@pytest.mark.parametrize("frame", ["current", "fixed"])
@pytest.mark.parametrize("sequence", ["ZYZ", "XYZ", "YZX", "XZX"])
def test_both_solutions_of_any_sequence_are_the_rotation(arms, sequence, frame):
    turn = Rotation.random(rng=np.random.default_rng(3)).as_matrix()
    told = arms.json("pose", "--units", "deg", "--euler", f"{sequence}:{frame}", matrix(turn))
    first, second = told["euler"]
    assert np.abs(np.subtract(first, second)).max() > 1
    axes = sequence if frame == "current" else sequence.lower()  # scipy's way to say it
    for angles in told["euler"]:
        made = Rotation.from_euler(axes, angles, degrees=True).as_matrix()
        assert made == pytest.approx(turn, abs=1e-12)


@pytest.mark.parametrize("name", ids(R, "rpy_zyx_singular"))
def test_gimbal_lock_is_said(arms, name):
    case = cases(R)[name]
    unit = case["units"]["angle"]
    told = arms.json("pose", "--units", unit, matrix(case["inputs"]["R"]))
    x, y, z = told["rpy"]
    expected = case["expected"]
    assert y == pytest.approx(expected["theta"], abs=1e-9)
    determined = {"phi_minus_psi": z - x, "phi_plus_psi": z + x}
    for key in determined.keys() & expected.keys():
        assert determined[key] == pytest.approx(expected[key], abs=1e-9)
    word = "difference" if "phi_minus_psi" in expected else "sum"
    assert "gimbal lock" in told["singular"]["rpy"]
    assert word in told["singular"]["rpy"]


def test_euler_lock_and_free_axes_are_said(arms):
    case = cases(R)["B-sm-eul-sing"]
    told = arms.json("pose", "--euler", "ZYZ", matrix(case["inputs"]["R"]))
    first, middle, last = told["euler"][0]
    assert middle == pytest.approx(0, abs=1e-9)
    assert first + last == pytest.approx(case["expected"]["phi_plus_psi"], abs=1e-9)
    assert "first plus third = 0.4 rad" in told["singular"]["euler"]
    still = arms.json("pose", "{xyz: [1, 2, 3]}")
    assert "any axis" in still["singular"]["axis_angle"]
    assert still["axis_angle"]["angle"] == 0
    half = arms.json("pose", matrix(cases(R)["A-eq2.24-pi"]["inputs"]["R"]))
    assert "opposite axis" in half["singular"]["axis_angle"]
    axis = np.array(half["axis_angle"]["axis"])
    expected = np.array(cases(R)["A-eq2.24-pi"]["expected"]["axis"])
    assert min(np.abs(axis - expected).max(), np.abs(axis + expected).max()) < 1e-7


@pytest.mark.parametrize("name", ["A-eq2.24", "B-mr-log3"])
def test_axis_and_angle(arms, name):
    case = cases(R)[name]
    about = arms.json("pose", matrix(case["inputs"]["R"]))["axis_angle"]
    assert about["axis"] == pytest.approx(case["expected"]["axis"], abs=1e-9)
    assert about["angle"] == pytest.approx(case["expected"]["angle"], abs=1e-9)


@pytest.mark.parametrize("name", ids(R, "homogeneous_inverse"))
def test_inverse(arms, name):
    case = cases(R)[name]
    pose = matrix(case["inputs"]["T"])
    expected = pytest.approx(np.array(case["expected"]["T_inv"]), abs=1e-12)
    assert np.array(arms.json("pose", pose, "--inverse")["matrix"]) == expected
    inverted = json.dumps({**json.loads(pose), "invert": True})
    assert np.array(arms.json("pose", inverted)["matrix"]) == expected


def test_a_tool_taken_away_and_a_change_of_frame(arms):
    case = cases(R)["A-vd2.25-tool"]
    tool = json.dumps({"matrix": case["inputs"]["T_5_v"], "invert": True})
    told = arms.json("pose", matrix(case["inputs"]["T_0_v"]), tool)
    assert np.array(told["matrix"]) == pytest.approx(np.array(case["expected"]["T_0_5"]), abs=1e-12)
    case = cases(R)["A-bt1"]
    point = arms.json("pose", matrix(case["inputs"]["R_1_2"]), "--inverse", "--point", 1, 2, 3)["point"]
    assert point == pytest.approx(case["expected"]["p_in_2"], abs=1e-12)
    assert np.abs(np.subtract(point, case["misprint_trap"]["p_in_2"])).max() > 0.1


@pytest.mark.parametrize("name", ids(R, "is_rotation"))
def test_what_is_no_rotation_is_refused(arms, name):
    for key, rows in cases(R)[name]["inputs"].items():
        outcome = arms.call("pose", matrix(rows))
        assert (outcome.code, outcome.out) == (2, ""), key
        assert "determinant" in outcome.err


@pytest.mark.parametrize("name", ids(R, "pose_interpolation"))
def test_poses_on_the_way(arms, name):
    inputs, expected = cases(R)[name]["inputs"], cases(R)[name]["expected"]["T"]
    s = ",".join(map(repr, inputs["s"]))
    told = arms.json("pose", matrix(inputs["T0"]), "--to", matrix(inputs["T1"]), "--s", s)
    assert [pose["s"] for pose in told] == inputs["s"]
    for pose, rows in zip(told, expected, strict=True):
        assert np.array(pose["matrix"]) == pytest.approx(np.array(rows), abs=1e-9)


def test_even_euler_angles_are_those_that_were_typed(arms):
    case = cases(R)["A-sl-euler"]
    start, end = (
        json.dumps({"euler": {"sequence": "ZYZ", "angles": case["inputs"][key]}})
        for key in ("phi_i", "phi_f")
    )
    (told,) = arms.json("pose", start, "--to", end, "--s", "0.5", "--orientation", "euler")
    expected = np.array(case["expected"]["R_mid"])
    assert np.array(told["matrix"])[:3, :3] == pytest.approx(expected, abs=1e-9)
    # a matrix has no typed angles: the triple nearest to the end's typed ones stands for it
    turned = Rotation.from_euler("ZYZ", case["inputs"]["phi_i"]).as_matrix()
    (read,) = arms.json("pose", matrix(turned), "--to", end, "--s", "0.5", "--orientation", "euler")
    assert np.array(read["matrix"])[:3, :3] == pytest.approx(expected, abs=1e-9)
    (one_axis,) = arms.json("pose", start, "--to", end, "--s", "0.5")
    assert np.abs(np.array(one_axis["matrix"])[:3, :3] - expected).max() > 1e-3


def test_a_screw_keeps_its_twist(arms):
    from scipy.linalg import expm, logm

    end = "{xyz: [0.3, -0.2, 0.5], rpy: [20, 40, 100]}"
    one, third = arms.json(
        "pose", "--units", "deg", "{xyz: [0, 0, 0]}", "--to", end, "--s", "1,0.25", "--path", "screw"
    )
    assert np.array(third["matrix"]) == pytest.approx(
        expm(0.25 * logm(np.array(one["matrix"])).real), abs=1e-9
    )


def test_units_of_lengths_and_angles(arms):
    told = arms.json(
        "pose", "--units", "deg,mm", "{xyz: [1, 2, 3 cm], rpy: [0, 0, 90]}", "--point", "1", "0", "-5"
    )
    assert told["xyz"] == pytest.approx([1, 2, 30])
    assert told["point"] == pytest.approx([1, 3, 25])
    assert told["axis_angle"]["angle"] == pytest.approx(90)
    assert np.array(told["matrix"])[:3, 3] == pytest.approx([1, 2, 30])


def test_steps_from_files_and_text(arms, tmp_path):
    (tmp_path / "step.yaml").write_text("rpy: [0, 0, 90]\nframe: fixed\n")
    code, out, err = arms.call("pose", "--units", "deg", "xyz: [1, 0, 0]", f"@{tmp_path / 'step.yaml'}")
    assert (code, err) == (0, "")
    assert "xyz (m): 0  1  0\n" in out
    assert "axis_angle: axis 0  0  1, angle 90 deg\n" in out


BAD = [
    (["{rpy: [0, 0]}"], "STEP:1:7: error: expected 3 numbers, got 2 values"),
    (["{xyz: [0, 0, 0]}", "{frame: moved, xyz: [1, 1, 1]}"], "STEP 2:1:9: error: expected current or fixed"),
    (["{invert: 1, xyz: [1, 1, 1]}"], "expected true or false, got 1"),
    (["{frame: fixed}"], "neither a position nor an orientation"),
    (["{rpy: [0, 0, 0], quat_wxyz: [1, 0, 0, 0]}"], "exclude each other"),
    (["{quat_wxyz: [1, 1, 0, 0]}"], "the quaternion has length 1.41421"),
    (["[1, 2, 3]"], "expected a mapping"),
    (["{}", "--units", "grad"], "unknown unit 'grad'"),
    (["{}", "--units", "deg,rad"], "both units of angle"),
    (["{xyz: [0, 0, 0]}", "--euler", "ZZY"], "is no sequence of Euler angles"),
    (["{xyz: [0, 0, 0]}", "--euler", "ZYZ:fxed"], "did you mean 'fixed'?"),
    (["{xyz: [0, 0, 0]}", "--point", "1", "2"], "--point has 2 values, a point has x, y, z"),
    (["{xyz: [0, 0, 0]}", "--point", "1,2,x"], "--point, z: expected a number (m), got x"),
    (["{xyz: [0, 0, 0]}", "--point", "1", "2", "nan"], "--point, z: expected a number (m), got nan"),
    (["{euler: {sequence: zyz, angles: [0, 0, 0]}}"], "did you mean 'ZYZ'?"),
    (["{matrix: [[1, 0, 0], [0, 1, 0]]}"], "expected a 3x3 or 4x4 matrix, row by row, got 2 rows"),
    (
        ["{matrix: [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 2]]}"],
        "the last row of a 4x4 matrix must be [0, 0, 0, 1], it is [0, 0, 0, 2]",
    ),
    (
        ["{matrix: [[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}"],
        "STEP:1:10: error: the matrix mirrors space: its determinant is -1",
    ),
    (["{xyz: [0, 0, 0]}", "--s", "0.5"], "name that pose with --to"),
    (["{xyz: [0, 0, 0]}", "--path", "screw"], "name that pose with --to"),
    (["{xyz: [0, 0, 0]}", "--to", "{xyz: [1, 0, 0]}", "--s", "1.5"], "from 0 to 1, got 1.5"),
    (["{xyz: [0, 0, 0]}", "--to", "{xyz: [1, 0, 0], frame: fixed}"], "unknown key 'frame'"),
    (
        ["{xyz: [0, 0, 0]}", "--to", "{xyz: [1, 0, 0]}", "--path", "screw", "--orientation", "euler"],
        "a screw turns about its own axis",
    ),
]


@pytest.mark.parametrize(("words", "message"), BAD, ids=[row[1] for row in BAD])
def test_wrong_calls(arms, words, message):
    outcome = arms.call("pose", *words)
    assert (outcome.code, outcome.out) == (2, "")
    assert message in outcome.err
