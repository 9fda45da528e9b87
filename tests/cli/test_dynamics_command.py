"""`trajcli dynamics`: a planar arm in closed form, a slide, units, payload, rows, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from arm_calls import Arms

ARM = """
name: planar
units: {angle: deg, length: mm}
convention: standard
joints:
  - {a: 500, effort: [-80, 40], friction: {coulomb: 1.5, viscous: 0.2},
     link: {mass: 4, com: [-300, 0, 0], inertia: [0.01, 0.1, 0.1, 0, 0, 0]}}
  - {a: 400, rotor: 0.03, link: {mass: 2, com: [-250, 0, 0], inertia: [0.01, 0.05, 0.05, 0, 0, 0]}}
base: {rpy: [90, 0, 0]}
"""
G = 9.81


@pytest.fixture
def arms(capfd, monkeypatch):
    return Arms(capfd, monkeypatch)


@pytest.fixture
def arm(tmp_path):
    path = tmp_path / "arm.yaml"
    path.write_text(ARM)
    return path


def closed_form(q, qd, carried=0.0):
    """Mass matrix, Coriolis efforts and gravity of the arm upright, a point mass at its tcp.

    Source: Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 7.3.2.
    """
    l1, l2, c1, c2 = 0.5, 0.4, 0.2, 0.15
    s2, k2 = np.sin(q[1]), np.cos(q[1])
    m22 = 0.05 + 2 * c2**2 + carried * l2**2
    m12 = m22 + (2 * c2 + carried * l2) * l1 * k2
    m11 = 0.1 + 4 * c1**2 + 2 * (l1**2) + carried * l1**2 + 2 * m12 - m22
    h = (2 * c2 + carried * l2) * l1 * s2
    g2 = (2 * c2 + carried * l2) * G * np.cos(q[0] + q[1])
    g1 = (4 * c1 + 2 * l1 + carried * l1) * G * np.cos(q[0]) + g2
    coriolis = [-h * (2 * qd[0] * qd[1] + qd[1] ** 2), h * qd[0] ** 2]
    return np.array([[m11, m12], [m12, m22 + 0.03]]), np.array(coriolis), np.array([g1, g2])


@pytest.mark.parametrize("carried", [0.0, 3.0])
def test_a_planar_arm_in_closed_form(arms, arm, carried):
    q, qd, qdd = (20.0, 50.0), (30.0, -70.0), (200.0, 100.0)
    payload = ["--payload", f"{{mass: {carried}}}"] if carried else []
    told = arms.json("dynamics", "-r", arm, *payload, *q, "--qd", *qd, "--qdd", *qdd)
    rates = np.radians(qd)
    mass, coriolis, gravity = closed_form(np.radians(q), rates, carried)
    friction = [1.5 + 0.2 * rates[0], 0]
    assert np.array(told["mass_matrix"]) == pytest.approx(mass, rel=1e-12)
    assert told["coriolis"] == pytest.approx(coriolis, rel=1e-12)
    assert told["gravity"] == pytest.approx(gravity, rel=1e-12)
    assert told["friction"] == pytest.approx(friction, rel=1e-12)
    total = mass @ np.radians(qdd) + coriolis + gravity + friction
    assert told["tau"] == pytest.approx(total, rel=1e-12)


def test_the_com_is_in_the_units_of_the_arm_and_masses_are_not(arms, arm):
    near = arms.json("dynamics", "-r", arm, "--payload", "{mass: 3, com: [100, 0, 0]}", 0, 0)
    si = arms.json("dynamics", "-r", arm, "--si", "--payload", '{mass: "3000 g", com: [0.1, 0, 0]}', 0, 0)
    assert near == si
    empty = arms.json("dynamics", "-r", arm, 0, 0)
    assert near["tau"][1] - empty["tau"][1] == pytest.approx(3 * G * 0.5, rel=1e-12)


def test_another_base_and_tool(arms, arm):
    upright = arms.json("dynamics", "-r", arm, 30, 40)["tau"]
    hung = arms.json("dynamics", "-r", arm, "--base", "{rpy: [-90, 0, 0]}", 30, 40)["tau"]
    assert hung == pytest.approx([-tau for tau in upright], rel=1e-12)
    flat = arms.json("dynamics", "-r", arm, "--base", "{xyz: [0, 0, 500]}", 30, 40)["tau"]
    assert flat == pytest.approx([0, 0], abs=1e-12)
    longer = ("--tool", "{xyz: [100, 0, 0]}", "--payload", "{mass: 2}")
    told = arms.json("dynamics", "-r", arm, *longer, 0, 0)["gravity"]
    bare = arms.json("dynamics", "-r", arm, 0, 0)["gravity"]
    assert told[1] - bare[1] == pytest.approx(2 * G * 0.5, rel=1e-12)


def test_the_tool_of_a_job_weighs_where_it_is_and_nothing_where_another_one_is(arms, arm, tmp_path):
    job = tmp_path / "job.yaml"
    job.write_text(
        "version: 1\nunits: {angle: deg, length: mm}\nrobot: {file: arm.yaml}\n"
        "tools: {gripper: {xyz: [100, 0, 0], mass: 2, com: [-40, 0, 0]}}\ntool: gripper\n"
        "start: {joints: [0, 0]}\nmoves: [{planner: hold, duration: 1}]\n"
    )
    bare, mounted = (arms.json("dynamics", "-r", name, 0, 0)["gravity"] for name in (arm, job))
    assert mounted[1] - bare[1] == pytest.approx(2 * G * 0.46, rel=1e-12)
    other = arms.json("dynamics", "-r", job, "--tool", "{xyz: [300, 0, 0]}", 0, 0)["gravity"]
    assert other == pytest.approx(bare, rel=1e-12)
    carried = ("--tool", "{xyz: [300, 0, 0]}", "--payload", "{mass: 1}")
    loaded = arms.json("dynamics", "-r", job, *carried, 0, 0)["gravity"]
    assert loaded[1] - bare[1] == pytest.approx(G * 0.7, rel=1e-12)


def test_rows_become_rows_of_efforts(arms, arm):
    states = [((20, 50), (30, -70), (200, 100)), ((-10, 5), (0, 3), (1, -2))]
    lines = ["t,q1_deg,q2_deg,qd1_deg,qd2_deg,qdd1_deg,qdd2_deg"]
    lines += [f"0.{k}," + ",".join(map(str, sum(state, ()))) for k, state in enumerate(states)]
    outcome = arms.call("dynamics", "-r", arm, "--digits", "full", "-", stdin="\n".join(lines) + "\n")
    assert outcome.code == 0, outcome.err
    assert outcome.err == ""
    head, *rows = outcome.out.splitlines()
    assert head == "t,tau1,tau2"
    for row, (q, qd, qdd), time in zip(rows, states, (0.0, 0.1), strict=True):
        told = arms.json("dynamics", "-r", arm, *q, "--qd", *qd, "--qdd", *qdd)["tau"]
        assert [float(cell) for cell in row.split(",")] == pytest.approx([time, *told], rel=1e-12)


def test_columns_that_are_left_out_are_zero_and_named(arms, arm):
    outcome = arms.call("dynamics", "-r", arm, "-", stdin="q1,q2\n0.3,0.4\n")
    assert outcome.err.strip().endswith("without columns qd and qdd, which count as zero")
    told = arms.json("dynamics", "-r", arm, "--si", 0.3, 0.4)["gravity"]
    assert [float(cell) for cell in outcome.out.splitlines()[1].split(",")] == pytest.approx(told, abs=1e-9)


def test_rows_that_no_arm_has_are_refused_and_degrees_read_as_radians_remarked(arms, arm):
    for kind in ("qd", "qdd"):
        outcome = arms.call("dynamics", "-r", arm, "-", stdin=f"q1,q2,{kind}1,{kind}2\n0,0,1e30,0\n")
        assert outcome.code == 2
        assert "got 1e+30" in outcome.err
    outcome = arms.call("dynamics", "-r", arm, "-", stdin="q1,q2\n0.3,90\n")
    assert "is at 90 rad, more than two turns from zero" in outcome.err
    assert outcome.out.splitlines()[0] == "tau1,tau2"


def test_the_table_for_people(arms, arm):
    outcome = arms.call("dynamics", "-r", arm, "--payload", "{mass: 3}", 0, 0)
    assert outcome.code == 0
    assert "efforts of planar with 3 kg (N m):" in outcome.out
    _, first, second = outcome.out.splitlines()[1:4]
    tau = closed_form((0, 0), (0, 0), 3.0)[2]
    assert f"{tau[0]:.9g}" in first
    assert first.split()[-2:] == ["40", f"{100 * tau[0] / 40:.4g}"]
    assert second.split()[-2:] == ["-", "-"]


def test_a_slide_has_forces(arms, tmp_path):
    path = tmp_path / "lift.yaml"
    path.write_text(
        "convention: standard\njoints:\n- {type: prismatic, rotor: 0.5, "
        "link: {mass: 3, com: [0, 0, 0], inertia: [1, 1, 1, 0, 0, 0]}}\n"
    )
    told = arms.json("dynamics", "-r", path, 0.2, "--qdd", 2)
    assert told["tau"] == pytest.approx([3 * (G + 2) + 0.5 * 2])
    assert told["mass_matrix"] == [[3.5]]
    assert "(N):" in arms.call("dynamics", "-r", path, 0.2).out


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["1", "2", "3"], "q has 3 values, planar has 2 joints"),
        (["1", "2", "--qd", "3"], "--qd has 1 value, planar has 2 joints"),
        (["1", "2", "--payload", "{mass: -1}"], "expected a number at least 0 kg, got -1"),
        (["1", "2", "--payload", "{com: [0, 0, 0]}"], "`mass` is missing"),
        (
            ["1", "2", "--payload", "{mass: 1, inertia: [1, 1, 3, 0, 0, 0]}"],
            "above the sum of the two others",
        ),
        (["1", "2", "--payload", "5"], "expected a mapping"),
        (["-", "--qd", "1", "2"], "--qd is for one state"),
        (["-"], "there is no column q2"),
    ],
)
def test_one_clear_error(arms, arm, words, message):
    outcome = arms.call("dynamics", "-r", arm, *words, stdin="q1\n1\n")
    assert outcome.code == 2
    assert outcome.err.count("error:") == 1
    assert message in outcome.err


def test_an_arm_without_inertias_is_refused_by_joint(arms, tmp_path):
    path = tmp_path / "arm.yaml"
    path.write_text("convention: standard\njoints: [{a: 1}, {name: elbow, a: 1}]\n")
    outcome = arms.call("dynamics", "-r", path, 1, 2)
    assert outcome.code == 2
    assert "no mass and inertia of the link behind joints j1, elbow" in outcome.err
