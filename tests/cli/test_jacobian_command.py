"""`trajcli jacobian`: against the oracles, in every frame, singular arms, units, rows."""

from __future__ import annotations

import numpy as np
import pytest
from arm_calls import Arms, cases, ids, robot_file

from trajcli.queries.jacobian import simplest

F = "forward.yaml"
FRAMES = {"base": "base", "tool": "tcp", "world": "world"}


@pytest.fixture
def arms(capfd, monkeypatch):
    return Arms(capfd, monkeypatch)


@pytest.mark.parametrize("name", ids(F, "jacobian"))
def test_oracles(arms, name, tmp_path):
    case = cases(F)[name]
    path, frame = robot_file(tmp_path, case["inputs"]), FRAMES[case["inputs"]["frame"]]
    told = arms.json("jacobian", "--robot", path, "--frame", frame, "--", *case["inputs"]["q"])
    expected = np.array(case["expected"]["J"])
    assert np.array(told["jacobian"]) == pytest.approx(expected, abs=case["tolerance"])
    assert told["rank"] == np.linalg.matrix_rank(expected)


def test_measures_of_a_published_arm(arms):
    told = arms.json("jacobian", "--robot", "puma560", "0", "45", "-180", "0", "45", "0")
    assert told["manipulability"] == pytest.approx(0.078617, abs=5e-7)  # Robotics Toolbox: 0.0786
    assert (told["rank"], told["singular_directions"]) == (6, [])
    assert 1 < told["condition"] < 100
    assert {"jacobian", "manipulability", "condition", "rank", "singular_directions"} <= set(told)
    assert "jdot_qd" not in told


Q = np.array([0.3, -0.7, 1.1, 0.4, -0.9, 0.2])
QD = np.array([0.5, -1.0, 0.3, 0.7, 0.2, -0.4])


def test_jdot_qd_is_the_derivative_of_the_twist(arms):
    def twist(time):
        words = ("--si", "--robot", "puma560", "--qd", *QD, "--", *(Q + time * QD))
        told = arms.json("jacobian", *words)
        return np.array(told["jacobian"]) @ QD, np.array(told["jdot_qd"])

    h = 1e-5
    slope = (twist(h)[0] - twist(-h)[0]) / (2 * h)
    assert twist(0)[1] == pytest.approx(slope, abs=1e-9)


def test_units_of_the_file_agree_with_si(arms, tmp_path):
    path = tmp_path / "arm.yaml"
    path.write_text(
        "units: {angle: deg, length: mm}\nconvention: standard\n"
        "joints: [{a: 300, alpha: 90}, {type: prismatic}, {a: 100}]\n"
    )
    si = arms.json("jacobian", "--si", "--robot", path, "--qd", 0.2, -0.3, 0.4, "--", 0.5, 0.1, 0.7)
    q, qd = (np.rad2deg(0.5), 100, np.rad2deg(0.7)), (np.rad2deg(0.2), -300, np.rad2deg(0.4))
    own = arms.json("jacobian", "--robot", path, *q, "--qd", *qd)
    scale = np.array([1000.0, 1000, 1000, 1, 1, 1])  # of textbooks: rad and mm
    assert np.array(own["jdot_qd"]) == pytest.approx(scale * si["jdot_qd"], rel=1e-9)
    twist = np.array(own["jacobian"]) @ [0.2, -300, 0.4]
    assert twist == pytest.approx(scale * (np.array(si["jacobian"]) @ [0.2, -0.3, 0.4]), rel=1e-9)
    for key in ("manipulability", "condition", "rank"):
        assert own[key] == pytest.approx(si[key])


@pytest.mark.parametrize("frame", ["world", "base", "tcp"])
def test_singular_directions_are_never_reached(arms, frame):
    q = ("10", "-60", "90", "20", "0", "30")  # the wrist is stretched
    words = ("--si", "--robot", "ur5e", "--frame", frame, "--")
    told = arms.json("jacobian", *words, *np.deg2rad(np.array(q, dtype=float)))
    (direction,) = told["singular_directions"]
    (idle,) = told["idle_motions"]
    jacobian = np.array(told["jacobian"])
    assert (told["rank"], told["condition"]) == (5, None)
    assert np.linalg.norm(direction) == pytest.approx(1)
    assert np.array(direction) @ jacobian == pytest.approx(np.zeros(6), abs=1e-12)
    assert jacobian @ idle == pytest.approx(np.zeros(6), abs=1e-12)


def test_a_stretched_planar_arm(arms):
    directions = arms.json("jacobian", "--robot", "planar2r", "30", "0")["singular_directions"]
    assert len(directions) == 4
    radial = np.array([np.cos(np.pi / 6), np.sin(np.pi / 6), 0, 0, 0, 0])
    basis = np.linalg.qr(np.array(directions).T)[0]
    assert basis @ (basis.T @ radial) == pytest.approx(radial, abs=1e-12)


@pytest.mark.parametrize("turn", [0.0, 0.4, 2.5, np.pi])
def test_directions_have_their_signs_whatever_basis_an_arm_has(turn):
    """Signs of singular vectors are those of a library; two components alike have no larger one."""
    rows = np.array([[0.0, -0.6, 0.0, 0.8, 0.0], [0.5, 0.0, -0.5, 0.0, np.sqrt(0.5)]])
    turned = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) @ rows
    wanted = [[0.5, 0, -0.5, 0, np.sqrt(0.5)], [0, 0.6, 0, -0.8, 0]]
    assert simplest(turned) == pytest.approx(np.array(wanted), abs=1e-12)
    assert simplest(rows[:1] * np.cos(turn)) == pytest.approx(np.array(wanted[1:]), abs=1e-12)
    alike = np.array([[0.0, -1.0, 1.0 - 1e-15, 1.0 + 1e-15]]) * (1 if turn < 1 else -1)
    assert simplest(alike) == pytest.approx(np.array([[0, 1, -1, -1]]) / np.sqrt(3), abs=1e-12)


def test_text(arms):
    code, out, err = arms.call(
        "jacobian", "--robot", "cobra600", "--qd", "1", "-2", "0.1", "0", "5", "--", "0", "0", "0.1", "0"
    )
    assert code == 2
    assert "--qd has 5 values, Cobra 600 has 4 joints" in err
    code, out, err = arms.call("jacobian", "--robot", "cobra600", "--qd", "1,-2,0.1,0", "0", "0", "0.1", "0")
    assert (code, err) == (0, "")
    assert "rows vx vy vz in m/s, wx wy wz in rad/s; joint rates in rad/s, m/s" in out
    assert "condition number: infinite" in out
    assert "always zero: wx (in m/s and rad/s)" in out
    assert "acceleration at constant joint rates" in out


def test_rows(arms):
    rows = "t,q1_deg,q2_deg\n0,30,0\n0.5,30,90\n"
    code, out, err = arms.call("jacobian", "--robot", "planar2r", "-", stdin=rows)
    head, *lines = out.splitlines()
    values = np.array([[float(cell) for cell in line.split(",")] for line in lines])
    names = head.split(",")
    assert (code, err, len(names)) == (0, "", 3 + 12)
    assert names[:5] == ["t", "manipulability", "inverse_condition", "J11", "J12"]
    assert values[:, 0].tolist() == [0, 0.5]
    assert values[0, 2] > 0  # the last row of J, about z, still tells the joints apart
    one = arms.json("jacobian", "--si", "--robot", "planar2r", np.pi / 6, np.pi / 2)
    assert values[1, 3:].reshape(6, 2) == pytest.approx(np.array(one["jacobian"]), abs=1e-9)
    assert values[1, 1] == pytest.approx(one["manipulability"], abs=1e-9)
    assert arms.call("jacobian", "--robot", "planar2r", "--qd", "1", "2", "-", stdin=rows).code == 2


def test_rows_that_look_like_degrees_are_remarked(arms):
    rows = "q1,q2\n0.1,0.2\n-90,45\n0,90\n"
    code, out, err = arms.call("jacobian", "--robot", "planar2r", "-", stdin=rows)
    assert (code, len(out.splitlines())) == (0, 4)
    assert err.count("\n") == 1
    assert "-90 rad, more than two turns from zero" in err
    for same in ("q1_deg,q2_deg\n-90,45\n", "q1,q2\n-1.5,0.7\n"):
        assert arms.call("jacobian", "--robot", "planar2r", "-", stdin=same).err == ""
