"""`trajcli jacobian`: the base counts, units are named, and each direction that is lost has its line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from arm_calls import Arms

ARM = """\
name: Crane
units: {angle: deg, length: mm}
convention: standard
joints: [{a: 300}, {type: prismatic, theta: 90, alpha: 90}, {a: 200}]
"""


@pytest.fixture
def arms(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Arms:
    monkeypatch.chdir(tmp_path)
    Path("arm.yaml").write_text(ARM, encoding="utf-8")
    return Arms(capfd, monkeypatch)


def test_a_base_turns_the_rows(arms: Arms) -> None:
    """A quarter of a turn about z: what went along x goes along y."""
    words = ("jacobian", "-r", "arm.yaml", "10", "20", "30")
    plain = np.array(arms.json(*words)["jacobian"])
    turned = np.array(arms.json(*words, "--base", "{rpy: [0, 0, 90]}")["jacobian"])
    quarter = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    assert turned == pytest.approx(np.vstack([quarter @ plain[:3], quarter @ plain[3:]]), abs=1e-9)
    assert np.abs(turned - plain).max() > 1


def test_units_are_named(arms: Arms) -> None:
    lines = arms.call("jacobian", "-r", "arm.yaml", "10", "20", "30", "--qd", "1", "2", "3").out.splitlines()
    assert lines[0] == "Jacobian of Crane in the axes of the world frame"
    assert lines[1] == "(rows vx vy vz in mm/s, wx wy wz in rad/s; joint rates in rad/s, mm/s):"
    assert lines[-1].startswith("acceleration at constant joint rates (mm/s^2 and rad/s^2): ")
    err = arms.call("jacobian", "-r", "arm.yaml", "10", "20", "30", "--qd", "1").err
    assert "--qd has 1 value" in err
    assert "j1 (deg/s), j2 (mm/s), j3 (deg/s)" in err
    assert (
        "more than two turns from zero" in arms.call("jacobian", "-r", "arm.yaml", "--si", "90", "0", "0").err
    )


def test_each_direction_that_is_lost_and_each_idle_motion_has_a_line(arms: Arms) -> None:
    """Of seven joints one may always move; stretched straight up a second one may, and two directions are lost."""
    q = [0.0] * 7
    words = ("jacobian", "-r", "iiwa14", *q)
    told, lines = arms.json(*words), arms.call(*words).out.splitlines()
    jacobian = np.array(told["jacobian"])
    rank = np.linalg.matrix_rank(jacobian, tol=1e-9)
    lost = [line for line in lines if line.startswith("always zero: ")]
    idle = [line for line in lines if line.startswith("moves nothing: ")]
    assert (told["rank"], len(lost), len(idle)) == (rank, 6 - rank, 7 - rank)
    assert (len(lost) > 1, len(idle) > 1) == (True, True)
    assert f"rank: {rank}" in lines
    assert np.array(told["idle_motions"]) @ jacobian.T == pytest.approx(0, abs=1e-9)


def vector(line: str, names: list[str]) -> np.ndarray:
    """Return the factors of a sum of names, such as `0.5 vx - 0.1 wz`."""
    found = np.zeros(len(names))
    words = (
        line.partition(": ")[2]
        .partition(" (in")[0]
        .replace("d/dt ", "")
        .replace("- ", "-")
        .replace("+ ", "")
        .split()
    )
    factors = iter(words)
    for word in factors:
        if word.removeprefix("-") in names:
            found[names.index(word.removeprefix("-"))] = -1.0 if word[0] == "-" else 1.0
        else:
            found[names.index(next(factors))] = float(word)
    return found


@pytest.mark.parametrize("q", [(10, 20, 30), (40, 0, -70)])
def test_what_is_always_zero_is_zero_for_all_rates(q: tuple[float, ...], arms: Arms) -> None:
    told = arms.json("jacobian", "-r", "arm.yaml", "--si", *map(str, np.radians(q)))
    jacobian = np.array(told["jacobian"])  # m and rad
    lines = arms.call("jacobian", "-r", "arm.yaml", "--si", *map(str, np.radians(q))).out.splitlines()
    lost = [vector(line, ["vx", "vy", "vz", "wx", "wy", "wz"]) for line in lines if line.startswith("always")]
    assert np.linalg.matrix_rank(np.array(lost)) == 3
    assert np.array(lost) @ jacobian == pytest.approx(0, abs=1e-5)
    words = ("jacobian", "-r", "iiwa14", *[0.0] * 7)
    idle = [line for line in arms.call(*words).out.splitlines() if line.startswith("moves nothing: ")]
    told = arms.json(*words)
    rates = [vector(line, [f"A{k}" for k in range(1, 8)]) for line in idle]
    assert np.array(rates) @ np.array(told["jacobian"]).T == pytest.approx(0, abs=1e-5)


def test_rows_have_the_frame_that_is_asked_for(arms: Arms) -> None:
    words = ("jacobian", "-r", "arm.yaml", "--si", "--frame", "tcp")
    told = np.array(arms.json(*words, "0.1", "0.2", "0.3")["jacobian"])
    head, row = arms.call(*words, "-", stdin="q1,q2,q3\n0.1,0.2,0.3\n").out.splitlines()
    cells = dict(zip(head.split(","), map(float, row.split(",")), strict=True))
    found = [[cells[f"J{i}{k}"] for k in range(1, 4)] for i in range(1, 7)]
    assert np.array(found) == pytest.approx(told, abs=1e-9)
    assert (
        np.abs(told - np.array(arms.json(*words[:-1], "world", "0.1", "0.2", "0.3")["jacobian"])).max() > 0.1
    )


@pytest.mark.parametrize(
    ("arm", "q", "measure", "rank"),
    [
        ("planar2r", [30, 90], 0.3 * 0.2, 2),  # a1 a2 |sin q2|
        ("planar2r", [30, -20], 0.3 * 0.2 * np.sin(np.radians(20)), 2),
        ("planar2r", [30, 0], 0, 1),  # stretched
        ("planar2r", [30, 180], 0, 1),
        ("planar3r", [30, 90, 90], np.sqrt(0.06**2 + 2 * 0.02**2), 2),  # by Cauchy and Binet
        ("planar3r", [30, 0, 0], 0, 1),
        ("rrp", [10, 0, 0.2], 0, 2),  # the first axis goes through the tool, but for the offset
        ("cartesian", [0, 0, 0], 1, 3),
        ("ur5e", [0, -90, 90, 0, 90, 0], None, 3),
    ],
)
def test_the_position_alone_has_the_manipulability_of_textbooks(
    arm: str, q: list[float], measure: float | None, rank: int, arms: Arms
) -> None:
    """Of an arm in a plane they count two rows; of all six rows even a stretched arm has rank 2."""
    told = arms.json("jacobian", "-r", arm, *q)["position"]
    lines = arms.call("jacobian", "-r", arm, *q).out.splitlines()
    (line,) = [line for line in lines if line.startswith("position alone: ")]
    if measure is None:
        rows = np.array(arms.json("jacobian", "-r", arm, *q)["jacobian"])[:3]
        measure = float(np.sqrt(np.linalg.det(rows @ rows.T)))
    assert told["manipulability"] == pytest.approx(measure, abs=1e-12)
    assert told["rank"] == rank
    singular = measure == 0
    assert (told["rank"] < told["nearby"], line.endswith("nearby: singular")) == (singular, singular)
    assert f" (in m), rank {rank}" in line
