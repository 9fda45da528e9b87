"""Files of other programs against the limits that these were given, and closed forms of their laws."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import BPoly, PPoly

from trajcli.judge.file import CheckOptions, check_file
from trajcli.judge.judgement import Judgement

FOLDER = Path(__file__).parent.parent / "oracles/recorded"


def judged(name: str, tmp_path: Path, limits: str, robot: str = "", **options: str) -> Judgement:
    """Return the judgement of a file by limits alone: of bare joints, unless an arm is named."""
    (tmp_path / "arm.yaml").write_text("joints: 6\n")
    (tmp_path / "limits.yaml").write_text(limits)
    asked = CheckOptions(
        robot=robot or str(tmp_path / "arm.yaml"), limits=str(tmp_path / "limits.yaml"), **options
    )
    return check_file(str(FOLDER / name), asked).judgement


def errors(judgement: Judgement) -> set[str]:
    return {found.kind for found in judgement.findings if found.severity == "error"}


def test_jtraj_is_a_quintic_whose_peaks_stand_between_its_rows(tmp_path: Path) -> None:
    """From rest to rest in 2 s: 15/8 d/T and 10/sqrt(3) d/T^2 (Siciliano, section 4.2.1)."""
    distance = 0.5  # of the first joint, the furthest
    velocity, acceleration = 15 / 8 * distance / 2, 10 / 3**0.5 * distance / 4
    kept = f"{{velocity: {velocity * 1.000001}, acceleration: {acceleration * 1.000001}}}"
    assert judged("jtraj.csv", tmp_path, kept).verdict == "satisfied"
    broken = judged("jtraj.csv", tmp_path, f"{{acceleration: {acceleration * 0.9999}}}")
    found = broken.findings[0]
    assert (found.kind, found.joint, broken.verdict) == ("acceleration", "j1", "exceeded")
    assert abs(found.value) == pytest.approx(acceleration, rel=1e-9)
    times = 2 * (0.5 - 3**0.5 / 6), 2 * (0.5 + 3**0.5 / 6)
    assert min(abs(found.time - time) for time in times) < 1e-5


def test_ruckig_keeps_its_limits(tmp_path: Path) -> None:
    assert judged("ruckig.csv", tmp_path, "{velocity: 1, acceleration: 4, jerk: 20}").passed
    for kind, limit in (("velocity", 0.9999), ("acceleration", 3.9996), ("jerk", 19.9)):
        judgement = judged("ruckig.csv", tmp_path, f"{{{kind}: {limit}}}")
        assert judgement.verdict == "exceeded", kind
        assert errors(judgement) == {kind}


def test_toppra_goes_beyond_its_limits_between_its_rows(tmp_path: Path) -> None:
    """It was given 1 rad/s and 4 rad/s^2: its rows reach 4.05, the quintics between them 4.28."""
    rows = np.loadtxt(FOLDER / "toppra.csv", delimiter=",", skiprows=1)
    states = np.stack([rows[:, 5], rows[:, 11], rows[:, 17]], axis=1)  # of the fifth joint
    curve = PPoly.from_bernstein_basis(BPoly.from_derivatives(rows[:, 0], states))
    dense = np.linspace(rows[0, 0], rows[-1, 0], 200_001)
    for interpolate in (None, "quintic"):
        asked = {} if interpolate is None else {"interpolate": interpolate}
        judgement = judged("toppra.csv", tmp_path, "{velocity: 1, acceleration: 4}", **asked)
        found = {(each.kind, each.joint): each for each in judgement.findings}
        assert judgement.verdict == "exceeded"
        for order, kind in ((1, "velocity"), (2, "acceleration")):
            peak = np.abs(curve(dense, order)).max()
            value = abs(found[kind, "j5"].value)
            assert peak * (1 - 1e-9) <= value <= peak * (1 + 1e-5)


def test_positions_of_mstraj_are_joined_by_straight_lines(tmp_path: Path) -> None:
    rows = np.loadtxt(FOLDER / "mstraj.csv", delimiter=",", skiprows=1)
    fastest = np.abs(np.diff(rows[:, 1:], axis=0) / np.diff(rows[:, :1], axis=0)).max()
    assert judged("mstraj.csv", tmp_path, f"{{velocity: {fastest * 1.000001}}}").verdict == "satisfied"
    broken = judged("mstraj.csv", tmp_path, f"{{velocity: {fastest * 0.9999}}}")
    assert broken.interpolation == "linear"
    assert errors(broken) == {"velocity"}
    assert abs(broken.findings[0].value) == pytest.approx(fastest, rel=1e-9)


def test_24_hz_in_six_decimals_and_in_degrees(tmp_path: Path) -> None:
    """The last axis turns by 113 deg in 2 s, by a quintic: between two rows by 105.85 deg/s at most."""
    s = np.arange(49) / 48
    slopes = np.diff(113 * (10 * s**3 - 15 * s**4 + 6 * s**5)) * 24
    limits = "units: {angle: deg}\nvelocity: " + f"{slopes.max() - 0.01:.9f}\n"
    judgement = judged("degrees_24hz.csv", tmp_path, limits, units="deg")
    assert judgement.period == pytest.approx(1 / 24, rel=1e-15)
    found = judgement.findings[0]
    assert (found.kind, found.joint, found.certainty) == ("velocity", "j6", "exceeded")
    assert np.degrees(found.value) == pytest.approx(slopes.max(), abs=24e-4)
    assert any("24 Hz" in note for note in judgement.notes)


def test_a_chunk_in_single_precision(tmp_path: Path) -> None:
    judgement = judged("chunk_float32.npy", tmp_path, "{velocity: 2.0}", robot="panda", units="rad")
    assert judgement.verdict == "satisfied"
    assert (judgement.rows, judgement.period) == (50, 0.02)


def test_five_points_of_a_goal_for_an_arm_of_universal_robots(tmp_path: Path) -> None:
    """6.87 rad/s^2 in the first segment, 5.54 in the last: UR driver, issue 1273."""
    judgement = judged("ur_goal.yaml", tmp_path, "acceleration: 5.0001", robot="ur10e", interpolate="jtc")
    named = {
        (found.joint, found.row, round(abs(found.value), 2))
        for found in judgement.findings
        if found.kind == "acceleration"
    }
    assert {("elbow_joint", 1, 6.87), ("wrist_3_joint", 4, 5.54)} <= named


@pytest.mark.parametrize(
    "kinds", [("f8", "f2", "f2"), ("f8", "f4", "f2"), ("f4", "f8", "f2"), ("f8", "f2", "f8")]
)
@pytest.mark.parametrize("form", ["npy", "npz"])
def test_rates_of_fewer_bits_than_their_positions_are_no_fault(
    kinds: tuple[str, ...], form: str, tmp_path: Path
) -> None:
    """Sine and cosine rounded by numpy are each other's derivatives; with a step of some half units they are not.

    Half a unit of a velocity is up to 2^-11 rad/s, and two of these make 0.5 rad/s^2 within 2 ms.
    """
    t = np.arange(0.0, 6.0, 0.002)
    (tmp_path / "arm.yaml").write_text("joints: 1\n")
    for wrong, step in ((None, 0.0), ("qd", 0.01), ("qdd", 2.0)):
        fields = [("t", "f8"), *zip(("q1", "qd1", "qdd1"), kinds, strict=True)]
        rows = np.empty(t.size, fields)
        for (name, _), values in zip(fields, (t, np.sin(t), np.cos(t), -np.sin(t)), strict=True):
            rows[name] = values + step * (name == f"{wrong}1") * (t > 2.0)
        file = tmp_path / f"rows.{form}"
        if form == "npz":
            np.savez(file, **{name: rows[name] for name, _ in fields})
        else:
            np.save(file, rows)
        found = check_file(str(file), CheckOptions(robot=str(tmp_path / "arm.yaml"), units="rad")).judgement
        assert found.verdict == ("satisfied" if wrong is None else "exceeded")
        assert (wrong is None) == (not errors(found))
