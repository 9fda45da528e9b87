"""Recorded motions beside those of peers: closed forms between the ends, and along the points."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from trajcli.cli.app import app

LIMITS = "{velocity: 1, acceleration: 2, jerk: null}"
ROBOT = "joints: [{velocity: 1, acceleration: 2}, {velocity: 1, acceleration: 2}]\n"


def check(
    folder: Path, rows: np.ndarray, capfd: pytest.CaptureFixture[str], *more: str
) -> tuple[int, dict[str, Any]]:
    robot, file = folder / "arm.yaml", folder / "rows.csv"
    robot.write_text(ROBOT)
    names = ["t", *(f"{k}{j}" for k in ("q", "qd", "qdd") for j in (1, 2))][: rows.shape[1]]
    lines = [",".join(names), *(",".join(f"{v:.12f}" for v in row) for row in rows)]
    file.write_text("\n".join(lines) + "\n")
    with pytest.raises(SystemExit) as left:
        app(["check", str(file), "--robot", str(robot), "--units", "rad", "--format", "json", *more])
    return int(left.value.code or 0), json.loads(capfd.readouterr().out)


def quintic(duration: float, count: int = 401) -> np.ndarray:
    """Return rows of a quintic by (3, 1.5) over a duration."""
    u = np.linspace(0, 1, count)[:, None]
    change = np.array([3.0, 1.5])
    q = (10 * u**3 - 15 * u**4 + 6 * u**5) * change
    qd = (30 * u**2 - 60 * u**3 + 30 * u**4) * change / duration
    qdd = (60 * u - 180 * u**2 + 120 * u**3) * change / duration**2
    return np.concatenate([u * duration, q, qd, qdd], axis=1)


def test_a_quintic_beside_the_fastest(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Both peers need D/v + v/a = 3.5 s; along the line toppra has the same trapezoid."""
    code, view = check(tmp_path, quintic(7.0), capfd, "--reference")
    assert code == 0
    beside = view["reference"]
    assert beside["duration"] == pytest.approx(7.0)
    assert beside["ruckig"]["duration"] == pytest.approx(3.5, rel=1e-9)
    assert beside["ruckig"]["ratio"] == pytest.approx(2.0, rel=1e-9)
    assert beside["ruckig"]["joint"] == "j1"
    assert beside["ruckig"]["violations"] == []
    assert beside["toppra"]["duration"] == pytest.approx(3.5, rel=2e-3)
    assert beside["toppra"]["ratio"] == pytest.approx(2.0, rel=2e-3)
    assert beside["toppra"]["deviation"] < 1e-9
    assert "reference" not in check(tmp_path, quintic(7.0), capfd)[1]


def test_a_motion_that_breaks_its_limits_may_be_faster(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    code, view = check(tmp_path, quintic(3.0), capfd, "--reference")
    assert code == 1
    assert view["reference"]["ruckig"]["ratio"] == pytest.approx(3.0 / 3.5, rel=1e-9)
    assert not [finding for finding in view["findings"] if finding["rule"] == "reference"]


def test_positions_alone(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    code, view = check(tmp_path, quintic(7.0)[:, :3], capfd, "--reference")
    assert code == 0
    assert view["reference"]["ruckig"]["duration"] == pytest.approx(3.5, rel=1e-9)


def test_a_contradiction_is_an_error(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A bound that is wrong on purpose: ruckig that takes three times as long as it needs."""
    from trajcli.peers import motion_reference
    from trajcli.peers.lower_bound import LowerBound

    right = motion_reference.fastest_duration

    def wrong(*arguments: Any) -> Any:
        bound = right(*arguments)
        return LowerBound(3 * bound.duration, bound.joint) if isinstance(bound, LowerBound) else bound

    monkeypatch.setattr(motion_reference, "fastest_duration", wrong)
    code, view = check(tmp_path, quintic(7.0), capfd, "--reference")
    assert code == 1
    (finding,) = [finding for finding in view["findings"] if finding["rule"] == "reference"]
    assert (finding["severity"], finding["joint"], finding["row"]) == ("error", "j1", 401)
    assert finding["value"] == pytest.approx(7.0)
    assert finding["limit"] == pytest.approx(10.5, rel=1e-9)
    assert view["verdict"] == "exceeded"


def test_the_fastest_motion_is_no_contradiction(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Rows of the trapezoid itself, rounded to three decimals of a radian and a second."""
    t = np.round(np.linspace(0, 3.5, 36), 3)
    v, a, end = 1.0, 2.0, 3.5
    q = np.where(t < 0.5, a * t**2 / 2, np.where(t > 3.0, 3 - a * (end - t) ** 2 / 2, 0.25 + v * (t - 0.5)))
    qd = np.minimum(np.minimum(a * t, a * (end - t)), v)
    rows = np.stack([t, np.round(q, 3), np.round(q / 2, 3), np.round(qd, 3), np.round(qd / 2, 3)], axis=1)
    _, view = check(tmp_path, rows, capfd, "--reference")
    assert view["reference"]["ruckig"]["ratio"] == pytest.approx(1.0, abs=1e-3)
    assert not [finding for finding in view["findings"] if finding["rule"] == "reference"]


def test_a_stop_is_no_contradiction_though_its_end_is_rounded(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """From v = 1 with a = 2 it takes v / a = 0.5 s and v^2 / 2a = 0.25 rad: to 0.25 - 5e-13 it takes longer."""
    t = np.linspace(0, 0.5, 51)[:, None]
    q, qd = np.repeat(t - t**2, 2, axis=1), np.repeat(1 - 2 * t, 2, axis=1)
    for rows in (np.concatenate([t, q, qd], axis=1), np.concatenate([t, 0.25 - q[::-1], qd[::-1]], axis=1)):
        code, view = check(tmp_path, rows, capfd, "--reference")
        assert code == 0, view["findings"]
        assert view["reference"]["ruckig"]["ratio"] == pytest.approx(1, rel=1e-9)
