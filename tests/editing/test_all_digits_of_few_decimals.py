"""Rows of few decimals that are retimed into formats of all digits, where no decimal excuses anything."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.interpolate import CubicHermiteSpline

from trajcli.editing.edited_motion import EditedMotion, ReadingOptions, read_motion
from trajcli.editing.requirements import kept_limits
from trajcli.editing.retiming import Stretch, retime
from trajcli.editing.writing import as_read, write_motion
from trajcli.errors import VerificationError
from trajcli.judge.file import CheckOptions, check_file

ALL_DIGITS = ["mcap", "jsonl", "yaml", "npz"]


@pytest.fixture
def swing(tmp_path: Path) -> Path:
    """Rows of q = (1 - cos 2 t) / 2, which reach 1 rad/s; velocities of three decimals are 0.02 % too high."""
    t = np.arange(158) / 50
    lines = [f"{x:.2f},{(1 - np.cos(2 * x)) / 2:.4f},{1.0002 * np.sin(2 * x):.3f}" for x in t.tolist()]
    path = tmp_path / "swing.csv"
    path.write_text("t,q1,qd1\n" + "\n".join(lines) + "\n")
    return path


@pytest.fixture
def coarse(tmp_path: Path) -> Path:
    """Rows of q = t^2 / 2 and back in 2 s, by thousandths of a radian at 100 Hz: accelerations are noise."""
    t = np.arange(201) / 100
    q = np.where(t < 1, t**2 / 2, 1 - (2 - t) ** 2 / 2)
    lines = [
        f"{x:.2f},{y:.3f},{z:.3f}"
        for x, y, z in zip(t.tolist(), q.tolist(), (1 - abs(1 - t)).tolist(), strict=True)
    ]
    path = tmp_path / "coarse.csv"
    path.write_text("t,q1,qd1\n" + "\n".join(lines) + "\n")
    return path


def arm(folder: Path, velocity: float, more: str = ", acceleration: 5") -> str:
    (folder / "arm.yaml").write_text(f"joints: [{{velocity: {velocity}{more}}}]\n")
    return str(folder / "arm.yaml")


def retimed(source: Path, robot: str, output: Path) -> tuple[EditedMotion, Stretch]:
    motion = read_motion(str(source), ReadingOptions())
    reader = partial(as_read, path=str(output))
    found, (stretch,) = retime(motion, kept_limits(None, robot).requirements, as_read=reader)
    write_motion(found, str(output))
    return found, stretch


@pytest.mark.parametrize("ending", ALL_DIGITS)
def test_what_its_decimals_excused_is_kept_by_a_slower_motion(
    ending: str, swing: Path, tmp_path: Path
) -> None:
    robot, output = arm(tmp_path, 1.0), tmp_path / f"slower.{ending}"
    _, stretch = retimed(swing, robot, output)
    rows = np.loadtxt(swing, delimiter=",", skiprows=1)
    fastest = CubicHermiteSpline(rows[:, 0], rows[:, 1], rows[:, 2]).derivative()
    peak = np.abs(fastest(np.linspace(0, 3.14, 314_001))).max()
    assert stretch.factor == pytest.approx(peak, rel=1e-4)
    assert stretch.factor >= peak * (1 - 1e-9) > 1.0005
    assert check_file(str(output), CheckOptions(robot=robot)).judgement.passed


def test_a_csv_of_the_same_decimals_keeps_its_time(swing: Path, tmp_path: Path) -> None:
    output = tmp_path / "same.csv"
    found, stretch = retimed(swing, arm(tmp_path, 1.0), output)
    assert (stretch.factor, stretch.binding) == (1.0, None)
    assert output.read_text() == swing.read_text()
    assert found.rows.t[-1] == 3.14


@pytest.mark.parametrize("velocity", [2.0, 0.9], ids=["as it is", "slower"])
@pytest.mark.parametrize("ending", ALL_DIGITS)
def test_where_no_time_helps_a_csv_does(ending: str, velocity: float, coarse: Path, tmp_path: Path) -> None:
    robot, output = arm(tmp_path, velocity), tmp_path / f"refused.{ending}"
    with pytest.raises(VerificationError) as caught:
        retimed(coarse, robot, output)
    (problem,) = caught.value.problems
    assert problem.hint == "the decimals of a CSV leave room for that, all digits do not: `-o FILE.csv`"
    assert (problem.joint, problem.kind) == ("j1", "jump")
    assert not output.exists()
    advised = tmp_path / "advised.csv"
    _, stretch = retimed(coarse, robot, advised)
    assert stretch.factor == pytest.approx(max(1 / velocity, 1), rel=0.02)
    assert check_file(str(advised), CheckOptions(robot=robot)).judgement.passed


def test_what_a_csv_does_not_keep_either_is_not_advised(tmp_path: Path) -> None:
    """Of velocities made ten times as large no decimal is certain."""
    t = np.arange(501) / 500
    q, qd = t**3 * (10 - 15 * t + 6 * t**2), 30 * t**2 * (1 - t) ** 2
    source = tmp_path / "rows.csv"
    lines = (f"{a:.3f},{b:.9f},{c:.2f}\n" for a, b, c in zip(t, q, qd, strict=True))
    source.write_text("t,q1,qd1\n" + "".join(lines))
    motion, kept = read_motion(str(source), ReadingOptions()), kept_limits(None, arm(tmp_path, 20.0, ""))
    for ending in ("mcap", "csv"):
        reader = partial(as_read, path=f"out.{ending}")
        with pytest.raises(VerificationError) as caught:
            retime(motion, kept.requirements, fastest=True, as_read=reader)
        assert caught.value.problems[0].hint == "another time of the motion does not help"


@pytest.mark.parametrize("ending", ["mcap", "csv"])
def test_numbers_of_single_precision_excuse_nothing_in_those_of_double(ending: str, tmp_path: Path) -> None:
    """The float32 next to 0.1 is above it by 1.5e-8 of it."""
    t, source, output = np.arange(101) / 100, tmp_path / "rows.npz", tmp_path / f"out.{ending}"
    q, qd = 0.1 * t[:, None], np.full((101, 1), 0.1)
    np.savez(source, t=t.astype(np.float32), q=q.astype(np.float32), qd=qd.astype(np.float32))
    robot = arm(tmp_path, 0.1, "")
    assert check_file(str(source), CheckOptions(robot=robot)).judgement.passed
    retimed(source, robot, output)
    assert check_file(str(output), CheckOptions(robot=robot)).judgement.passed
