"""`trajcli dynamics` for people: the numbers of its data, the limit on their side, and how much of it is used."""

from __future__ import annotations

from pathlib import Path

import pytest
from arm_calls import Arms

ARM = """\
name: Lift
units: {angle: deg, length: mm}
convention: standard
joints:
  - {name: a, d: 100, alpha: 90, effort: [-40, 10], friction: {coulomb: 0.5, viscous: 0.1}, LINK}
  - {name: b, type: prismatic, theta: 90, effort: [-30, 50], LINK}
  - {name: c, a: 20, effort: 4, LINK}
base: {rpy: [90, 0, 0]}
""".replace("LINK", "link: {mass: 1, com: [0, 9, 0], inertia: [0.1, 0.1, 0.1, 0, 0, 0]}")
JOB = """\
version: 1
units: {angle: deg, length: mm}
robot: {file: arm.yaml}
limits: {EFFORT}
start: {joints: [0, 0, 0]}
moves: [{planner: hold, duration: 1}]
"""
STATE = ("30", "100", "20", "--qd", "10", "-20", "30", "--qdd", "5", "6", "7", "--payload", "{mass: 1.2345}")


@pytest.fixture
def arms(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Arms:
    monkeypatch.chdir(tmp_path)
    Path("arm.yaml").write_text(ARM, encoding="utf-8")
    return Arms(capfd, monkeypatch)


@pytest.mark.parametrize(
    ("robot", "effort", "bounds"),
    [
        ("arm.yaml", "", [(-40, 10), (-30, 50), (-4, 4)]),
        ("job.yaml", "velocity: 1", [(-40, 10), (-30, 50), (-4, 4)]),
        ("job.yaml", "effort: [[-80, 90], null, 5]", [(-80, 90), (-30, 50), (-5, 5)]),
    ],
)
def test_each_effort_stands_with_its_part_of_the_limit(
    robot: str, effort: str, bounds: list[tuple[float, float]], arms: Arms
) -> None:
    """Efforts in force count before those that the maker states."""
    Path("job.yaml").write_text(JOB.replace("EFFORT", effort), encoding="utf-8")
    lines = arms.call("dynamics", "-r", robot, *STATE).out.splitlines()
    told = arms.json("dynamics", "-r", robot, *STATE)
    assert lines[0] == "efforts of Lift with 1.2345 kg (N m, N):"
    assert lines[1].split() == ["joint", "tau", "gravity", "Coriolis", "friction", "limit", "%", "used"]
    signs = set()
    for k, line in enumerate(lines[2:5]):
        name, *cells = line.split()
        tau = told["tau"][k]
        shown = [told[key][k] for key in ("tau", "gravity", "coriolis", "friction")]
        assert name == "abc"[k]
        assert [float(cell) for cell in cells[:4]] == pytest.approx(shown, rel=1e-8, abs=1e-12)
        bound = bounds[k][tau > 0]
        signs.add(tau > 0)
        assert float(cells[4]) == bound
        assert float(cells[5]) == pytest.approx(100 * tau / bound, rel=1e-3)
    assert signs == {True, False}


def test_values_that_are_missing_are_asked_for_in_their_units(arms: Arms) -> None:
    for option, unit in (("--qd", "deg/s"), ("--qdd", "deg/s^2")):
        err = arms.call("dynamics", "-r", "arm.yaml", "0", "0", "0", option, "1").err
        assert f"{option} has 1 value" in err
        assert f"a ({unit})" in err


@pytest.mark.parametrize("option", ["--json", "--qd", "--qdd"])
def test_rows_have_their_rates_beside_them(option: str, arms: Arms) -> None:
    words = (option,) if option == "--json" else (option, "1")
    refused = arms.call("dynamics", "-r", "arm.yaml", *words, "-", stdin="t,q1,q2,q3\n0,0,0,0\n")
    assert (refused.code, refused.out) == (2, "")
    assert f"{option} is for one state" in refused.err


def test_degrees_for_radians_are_remarked(arms: Arms) -> None:
    err = arms.call("dynamics", "-r", "arm.yaml", "--si", "90", "0.1", "0").err
    assert "a is at 90 rad, more than two turns from zero" in err
