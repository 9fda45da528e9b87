"""`trajcli calibrate` for people: the numbers of its data (SI) in the units of the robot's file."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest
from arm_calls import Arms

from trajcli.cli import calibrate
from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward

ROBOT = """\
name: Bench
units: {angle: deg, length: mm}
convention: standard
joints: [{d: 400, alpha: 90}, {a: 300}, {a: 200}]
"""
SI = {"deg": math.pi / 180, "mm": 1e-3, "rad": 1.0, "m": 1.0}


@pytest.fixture
def arms(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Arms:
    monkeypatch.chdir(tmp_path)
    Path("arm.yaml").write_text(ROBOT, encoding="utf-8")
    measured(0.0)
    return Arms(capfd, monkeypatch)


def measured(noise: float, *outliers: int) -> None:
    """Write poses of an arm that is off by 1 deg and 2 mm, in the units of its file."""
    true = ROBOT.replace("{a: 300}", "{a: 302}").replace("alpha: 90", "alpha: 91")
    Path("true.yaml").write_text(true, encoding="utf-8")
    draws = np.random.default_rng(5)
    q = draws.uniform(-2, 2, (20, 3))
    poses = forward(load_robot("true.yaml"), q)
    xyz = 1e3 * poses[:, :3, 3] + draws.normal(0, noise, (20, 3))
    for number in outliers:
        xyz[number - 1] += 50
    items = [
        {"joints": row, "pose": {"xyz": at}}
        for row, at in zip(np.degrees(q).tolist(), xyz.tolist(), strict=True)
    ]
    Path("measured.yaml").write_text(json.dumps(items), encoding="utf-8")


WORDS = ("-r", "arm.yaml", "--free", "j1.alpha,j2.a,j3.a", "measured.yaml")


@pytest.mark.parametrize("units", [(), ("--units", "rad,m"), ("--si",)])
def test_the_table_has_the_numbers_of_the_data_in_its_units(units: tuple[str, ...], arms: Arms) -> None:
    measured(0.1)
    if units:  # of the measurements, too
        items = json.loads(Path("measured.yaml").read_text(encoding="utf-8"))
        for item in items:
            item["joints"] = np.radians(item["joints"]).tolist()
            item["pose"]["xyz"] = [x / 1e3 for x in item["pose"]["xyz"]]
        Path("measured.yaml").write_text(json.dumps(items), encoding="utf-8")
    lines = arms.call("calibrate", *WORDS, *units).out.splitlines()
    told = arms.json("calibrate", *WORDS, *units)
    angle, length = ("rad", "m") if units else ("deg", "mm")
    assert lines[0].startswith("Bench: 3 parameters from 20 measurements, rank 3, ")
    scale = lines[1].removeprefix("one radian counts like ").split()
    assert (float(scale[0]) * SI[length], scale[1]) == (pytest.approx(told["scale"]), length)
    rows = [line.split() for line in lines[3:6]]
    for (name, unit, nominal, value, change, std), row in zip(rows, told["parameters"], strict=True):
        assert (name, unit) == (f"{row['joint']}.{row['name']}", angle if row["name"] == "alpha" else length)
        shown = [float(text) * SI[unit] for text in (nominal, value, change, std)]
        data = [row["nominal"], row["value"], row["value"] - row["nominal"], row["std"]]
        assert shown == pytest.approx(data, rel=5e-3, abs=2e-8)
    assert told["parameters"][0]["value"] == pytest.approx(math.radians(91), abs=2e-3)
    residual, noise = told["residual"], told["noise"]["position"]
    (line,) = [line for line in lines if line.startswith("position, root mean square: ")]
    numbers = [float(word) * SI[length] for word in line.split() if word[0].isdigit()]
    assert numbers == pytest.approx(
        [residual["before"]["position"], residual["after"]["position"], noise], rel=5e-3
    )


def test_what_counts_less_is_named(arms: Arms) -> None:
    measured(0.1, 7, 12)
    plain = arms.call("calibrate", *WORDS, "--loss", "huber")
    listed = plain.out[plain.out.index("outliers ") :].splitlines()[0].removeprefix("outliers ").split(", ")
    assert listed == [
        str(number) for number in arms.json("calibrate", *WORDS, "--loss", "huber")["loss"]["outliers"]
    ]
    assert listed == ["7", "12"]
    assert "huber loss from" in plain.out


def test_what_no_measurement_tells_is_named_with_its_signs(arms: Arms) -> None:
    """Along the axis of the first joint only the sum of base.z and j1.d counts."""
    words = ("calibrate", "-r", "arm.yaml", "--free", "base.z,j1.d,j2.a", "measured.yaml")
    lines = arms.call(*words).out.splitlines()
    at = next(k for k, line in enumerate(lines) if line.startswith("not identifiable"))
    parts = lines[at + 1].split()
    assert {parts[1], parts[3]} == {"base.z", "j1.d"}
    assert float(parts[0]) == pytest.approx(-float(parts[2]), abs=1e-3)
    assert abs(float(parts[0])) > 0.5
    outcome = arms.call(*words)
    remarks = arms.json(*words)["remarks"]
    assert [" ".join(line.split()) for line in outcome.err.splitlines()] == [
        " ".join(text.split()) for text in remarks
    ]


def test_options_that_do_not_go_together(arms: Arms) -> None:
    for words, said in (
        (("--plan", "4", "--loss-scale", "2"), "--loss is for measurements"),
        ((*WORDS[4:], "--loss", "huber", "--loss-scale", "inf"), "--loss-scale must be above 0 and finite"),
        ((*WORDS[4:], "-o", "new.csv"), "expected a name that ends in .yaml or .yml"),
        (("--plan", "4", "-o", "new.yaml"), "expected a name that ends in .csv"),
    ):
        refused = arms.call("calibrate", "-r", "arm.yaml", *words)
        assert (refused.code, refused.out, said in refused.err) == (2, "", True), words
    assert not list(Path().glob("new*"))


def test_a_plan_says_how_many_parameters_it_tells(arms: Arms) -> None:
    words = ("calibrate", "-r", "arm.yaml", "--plan", "8", "--free", "base.z,j1.d,j2.a")
    outcome = arms.call(*words)
    told = arms.json(*words)
    assert (told["rank"], told["count"]) == (2, 3)
    assert outcome.err.startswith("8 configurations tell 2 of 3 parameters or combinations: O1 ")
    said = [arms.call(*words[:5], "--scale", scale).err.split("condition ")[1] for scale in ("5mm", "5m")]
    assert float(said[0]) != pytest.approx(float(said[1]), rel=1e-3)


def test_a_loss_has_its_scale_where_none_is_given(arms: Arms) -> None:
    measured(0.1, 7)
    given = arms.json("calibrate", *WORDS, "--loss", "huber", "--loss-scale", "1.5")
    assert arms.json("calibrate", *WORDS, "--loss", "huber") == given
    assert arms.json("calibrate", *WORDS, "--loss", "huber", "--loss-scale", "3")["loss"] != given["loss"]


def test_remarks_and_what_has_no_deviation(arms: Arms) -> None:
    items = json.loads(Path("measured.yaml").read_text(encoding="utf-8"))
    at = forward(load_robot("true.yaml"), np.radians([[*item["joints"][:1], 20, 30] for item in items]))[
        :, :3, 3
    ]
    for item, xyz in zip(items, (1e3 * at).tolist(), strict=True):
        item["joints"][1:], item["pose"]["xyz"] = [20, 30], xyz
    Path("measured.yaml").write_text(json.dumps(items), encoding="utf-8")
    words = ("calibrate", "-r", "arm.yaml", "--free", "j1.theta,j2.theta,j2.a,j2.d", "measured.yaml")
    outcome, told = arms.call(*words), arms.json(*words)
    assert told["remarks"]
    said = " ".join(outcome.err.split())
    assert all(" ".join(text.split()) in said for text in told["remarks"])
    lines = [line.split() for line in outcome.out.splitlines()[3:7]]
    shown = {name: std for name, _, _, _, _, std in lines}
    assert {name for name, std in shown.items() if std == "-"} == {
        f"{row['joint']}.{row['name']}" for row in told["parameters"] if row["std"] is None
    }
    assert 0 < list(shown.values()).count("-") < 4


def test_each_correlation_is_named(arms: Arms, monkeypatch: pytest.MonkeyPatch) -> None:
    names = [("j1", "a"), ("j2", "theta"), ("j3", "d")]
    ends = [{"joint": joint, "name": name} for joint, name in names]
    pairs = [
        {"first": ends[k], "second": ends[k + 1], "value": value} for k, value in enumerate((0.99, -0.98765))
    ]
    true = calibrate.calibration_report
    monkeypatch.setattr(calibrate, "calibration_report", lambda found: {**true(found), "correlations": pairs})
    lines = arms.call("calibrate", *WORDS).out.splitlines()
    said = ["correlated: j1.a and j2.theta, 0.990", "correlated: j2.theta and j3.d, -0.988"]
    assert [line for line in lines if line.startswith("correlated")] == said
