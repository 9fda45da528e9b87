"""Rows in the files of every format against the planned curve, evaluated by numpy at the times that are asked for."""

from __future__ import annotations

import csv
import json
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from streams.mcap.conftest import read_mcap
from tiers import few

from trajcli.errors import InputError, VerificationError
from trajcli.job.read import job_from_text
from trajcli.output.delivery.joined import write_plan
from trajcli.output.recording import LogOptions
from trajcli.output.write import grid_of, points_of, write_rows
from trajcli.planning.plan import Plan, plan_job
from trajcli.progress import listening
from trajcli.streams.formats import FORMATS

JOB: dict[str, Any] = {
    "version": 1,
    "units": {"angle": "deg", "length": "mm"},
    "robot": {"joints": [{}, {"type": "prismatic"}]},
    "limits": {"velocity": 60, "acceleration": 90, "jerk": 900},
    "start": {"joints": [10, -20]},
    "moves": [
        {"planner": "jerk_limited", "to": {"joints": [45, 30]}},
        {"signal": "grip", "value": 1},
        {"planner": "quintic", "to": {"joints": [-5, 12]}, "duration": 2.3456789},
    ],
}
FACTORS = np.array([np.pi / 180, 1e-3])
COLUMNS = ["t", "q", "qd", "qdd", "signals", "move"]


@cache
def _planned(text: str) -> Plan:
    return plan_job(job_from_text(text))


def planned(**output: Any) -> Plan:
    plan = _planned(json.dumps({**JOB, "output": {"columns": COLUMNS, **output}}))
    assert plan.verdict.passed
    return plan


def wanted(plan: Plan, local: np.ndarray, order: int) -> np.ndarray:
    """Return a derivative (N, 2) of the curve, SI; at a break the later piece counts."""
    curve = plan.trajectory.curve
    piece = np.clip(np.searchsorted(curve.breaks, local + 1e-12, "right") - 1, 0, curve.pieces - 1)
    rows = np.empty((local.size, curve.dimension))
    for k in np.unique(piece).tolist():
        at = piece == k
        for joint, each in enumerate(curve.coefficients[:, k].T):
            rows[at, joint] = np.polyval(np.polyder(each, order), local[at] - curve.breaks[k])
    return rows


def table(path: Path) -> dict[str, np.ndarray]:
    with path.open(newline="") as stream:
        names, *rows = csv.reader(stream)
    return dict(zip(names, np.array(rows, dtype=float).T, strict=True))


def delivered(plan: Plan, path: Path, **options: Any) -> Path:
    write_rows(plan, grid_of(plan), str(path), options.pop("digits", "fixed"), **options)
    return path


def grid(plan: Plan, rate: float) -> np.ndarray:
    """Return whole periods from the start, and the end."""
    whole = np.arange(int(plan.trajectory.duration * rate) + 1) / rate
    return np.append(whole, plan.trajectory.duration)


@pytest.mark.parametrize("start", few([0.0, -1.25, 7.5], 2))
@pytest.mark.parametrize("digits", ["fixed", "full"])
@pytest.mark.parametrize("rate", few([1.0, 125.0, 2000.0], 2))
def test_rows_at_a_rate_are_of_the_curve_in_the_units_of_the_job(
    start: float, digits: str, rate: float, tmp_path: Path
) -> None:
    """Of 2000 Hz they are more than a block of 4096; the last one is the end, at rest in the target."""
    plan = planned(rate=rate, start_time=start)
    rows = table(delivered(plan, tmp_path / "a.csv", digits=digits))
    local = grid(plan, rate)
    near = 6e-10 if digits == "fixed" else 1e-14
    assert rows["t"] == pytest.approx(start + local, abs=near, rel=1e-15)
    for order, kind in enumerate(("q", "qd", "qdd")):
        names = [name for name in rows if name.startswith((f"{kind}1_deg", f"{kind}2_mm"))]
        values = np.stack([rows[name] for name in names], axis=1)
        close = near + (1e-7 if order == 2 else 1e-9)
        inside = slice(None) if order < 2 else slice(0, -1)
        assert (np.abs(values * FACTORS - wanted(plan, local, order))[inside] <= close).all()
    assert [rows["q1_deg"][-1], rows["q2_mm"][-1]] == pytest.approx([-5, 12], abs=1e-9)
    border = plan.moves[0].duration
    assert rows["move"].tolist() == np.where(local < border - 1e-12, 0, 2).tolist()
    assert rows["signal.grip"].tolist() == (local >= border - 1e-9).astype(float).tolist()


def said_at(error: InputError, **output: Any) -> str:
    """Return the text of the job that an error is about."""
    place = error.problems[0].place
    assert place is not None
    text = json.dumps({**JOB, "output": {"columns": COLUMNS, **output}})[place.column - 1 :]
    return text[: text.index("]") + 1] if text.startswith("[") else text.partition(",")[0]


def test_rows_at_listed_times_are_where_they_are_asked_for(tmp_path: Path) -> None:
    end = planned().trajectory.duration
    times = [5.0, 5.123456789, 6.0, 5.0 + end]
    for name, asked in (("a.csv", times), ("b.csv", [5.5])):
        plan = planned(times=asked, start_time=5.0)
        rows = table(delivered(plan, tmp_path / name, digits="full"))
        assert rows["t"] == pytest.approx(asked, abs=1e-14)
        position = np.stack([rows["q1_deg"], rows["q2_mm"]], axis=1) * FACTORS
        local = np.minimum(np.array(asked) - 5.0, end)
        assert position == pytest.approx(wanted(plan, local, 0), abs=1e-12)
    with pytest.raises(InputError, match="lies outside the trajectory") as error:
        grid_of(planned(times=[0.5, 6.0], start_time=5.0))
    assert said_at(error.value, times=[0.5, 6.0], start_time=5.0) == "[0.5, 6.0]"
    with pytest.raises(InputError) as error:
        grid_of(planned(rate=1e9, start_time=1e9))
    assert said_at(error.value, rate=1e9, start_time=1e9) == "1000000000.0"


def test_rows_at_knots_and_at_both(tmp_path: Path) -> None:
    knots = planned(rows="knots", start_time=-2.0)
    alone = table(delivered(knots, tmp_path / "a.csv", digits="full"))
    breaks = knots.trajectory.curve.breaks
    assert [alone["t"][0], alone["t"][-1]] == pytest.approx([-2.0, -2.0 + breaks[-1]], abs=1.1e-9)
    assert (
        np.abs(alone["t"][:, None] + 2.0 - breaks).min(axis=0).max() <= 2.1e-4
    )  # at each, or beside its step
    both = table(delivered(planned(rows="both", rate=50, start_time=-2.0), tmp_path / "b.csv", digits="full"))
    assert {*alone["t"].tolist()} <= {*both["t"].tolist()}
    regular = grid(knots, 50.0) - 2.0
    assert np.abs(both["t"][:, None] - regular).min(axis=0).max() <= 1.1e-6  # but where a knot is as near
    assert len(both["t"]) <= len(alone["t"]) + len(regular)
    assert (np.diff(both["t"]) > 0).all()
    for plan, rows in ((knots, alone), (knots, both)):
        position = np.stack([rows["q1_deg"], rows["q2_mm"]], axis=1) * FACTORS
        local = np.minimum(rows["t"] + 2.0, breaks[-1])
        assert np.abs(position - wanted(plan, local, 0)).max() <= 3e-8
    short = table(delivered(planned(rows="knots", columns=["t", "q", "qd"]), tmp_path / "c.csv"))
    assert len(short["t"]) != len(alone["t"])  # cubics through fewer columns need others


@pytest.mark.parametrize("rows", [None, "rate", "both", "knots"])
@pytest.mark.parametrize("form", ["ros", "ros-goal"])
def test_points_of_a_message_are_in_si_from_its_start(rows: str | None, form: str, tmp_path: Path) -> None:
    asked = {} if rows is None else {"rows": rows}
    plan = planned(start_time=3.0, **asked, **({} if rows == "knots" else {"rate": 40}))
    path = delivered(plan, tmp_path / "a.yaml", form=FORMATS[form])
    message = yaml.load(path.read_text(), yaml.CSafeLoader)
    points = message["trajectory"]["points"] if form == "ros-goal" else message["points"]
    stamps = [p["time_from_start"]["sec"] * 10**9 + p["time_from_start"]["nanosec"] for p in points]
    assert stamps[0] == 0
    assert stamps[-1] == pytest.approx(plan.trajectory.duration * 1e9, abs=1.1)
    local = np.minimum(np.array(stamps) * 1e-9, plan.trajectory.duration)
    position = np.array([point["positions"] for point in points])
    assert np.abs(position - wanted(plan, local, 0)).max() <= 3e-8
    if rows == "rate":
        assert np.abs(local - grid(plan, 40.0)).max() <= 0.6e-9
    if rows == "both":
        assert len(points) == grid_of(plan).count


def test_points_without_accelerations_are_those_of_cubics(tmp_path: Path) -> None:
    """As many as rows at knots are with the same columns."""
    plan = planned(columns=["t", "q", "qd"])
    text = delivered(plan, tmp_path / "a.yaml", form=FORMATS["ros"]).read_text()
    points = yaml.load(text, yaml.CSafeLoader)["points"]
    assert {*points[0]} == {"positions", "velocities", "time_from_start"}
    assert len(points) == grid_of(planned(rows="knots", columns=["t", "q", "qd"])).count
    assert len(points) != grid_of(planned(rows="knots")).count


def test_a_log_is_in_si_at_the_times_of_the_rows(tmp_path: Path) -> None:
    plan = planned(rate=100, start_time=0.75)
    motion = read_mcap(delivered(plan, tmp_path / "a.mcap", log=LogOptions(epoch="1700000000.5")))
    local = grid(plan, 100.0)
    assert motion.times == pytest.approx(0.75 + local, abs=1.1e-9)
    assert motion.position == pytest.approx(wanted(plan, local, 0), abs=1e-12)
    assert motion.velocity[1:-1] == pytest.approx(wanted(plan, local, 1)[1:-1], abs=1e-9)


@pytest.mark.parametrize("name", ["a.jsonl", "a.npy", "a.npz"])
def test_other_formats_hold_every_bit_in_si(name: str, tmp_path: Path) -> None:
    plan = planned(rate=100, start_time=0.75, columns=["t", "q", "qd"])
    path, local = delivered(plan, tmp_path / name), grid(plan, 100.0)
    if name.endswith("jsonl"):
        rows = [json.loads(line) for line in path.read_text().splitlines()]
        found = np.array([[row["t"], *row["q"], *row["qd"]] for row in rows])
    else:
        arrays = np.load(path)  # of fields, or of arrays with names
        found = np.column_stack([arrays[key] for key in ("t", "q", "qd")])
    expected = np.column_stack([0.75 + local, wanted(plan, local, 0), wanted(plan, local, 1)])
    assert found == pytest.approx(expected, abs=1e-9)


def test_a_plan_that_breaks_a_limit_is_not_written(tmp_path: Path) -> None:
    moves = [{"planner": "quintic", "to": {"joints": [90, 0]}, "duration": 0.5}]
    plan = plan_job(job_from_text(json.dumps({**JOB, "moves": moves})))
    with pytest.raises(VerificationError):
        write_plan(plan, str(tmp_path / "a.csv"))
    assert [*tmp_path.iterdir()] == []
    write_plan(planned(), str(tmp_path / "a.csv"), "full")
    assert len(table(tmp_path / "a.csv")["t"]) == grid_of(planned()).count


def test_the_name_of_standard_output_makes_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    monkeypatch.chdir(tmp_path)
    plan = planned(rate=10)
    write_rows(plan, grid_of(plan), "-", "fixed")
    found = capfdbinary.readouterr().out
    assert found == delivered(plan, tmp_path / "rows.csv").read_bytes()
    assert [path.name for path in tmp_path.iterdir()] == ["rows.csv"]


def test_points_and_progress_count_all_rows_of_many(tmp_path: Path) -> None:
    """More than are evaluated at a time."""
    plan = planned(rate=5000, rows="rate", columns=["t", "q"])
    many = grid_of(plan)
    assert len(list(many.blocks())) > 1
    points = points_of(plan, many)
    assert points.nanoseconds.size == many.count
    at = np.append(np.arange(many.count - 1) / 5000, plan.trajectory.duration)
    assert points.nanoseconds.tolist() == np.rint(at * 1e9).astype(int).tolist()
    said: list[str] = []
    with listening(said.append):
        delivered(plan, tmp_path / "rows.npy")
    last = [text for text in said if text.startswith("writing row ")][-1]
    assert last == f"writing row {many.count} of {many.count}"


ARM: dict[str, Any] = {
    "version": 1,
    "robot": {
        "joints": [
            {"a": 1, "link": {"mass": 2, "com": [-0.5, 0, 0], "inertia": [0.1, 0.1, 0.1, 0, 0, 0]}},
            {"a": 0.5, "link": {"mass": 1, "com": [-0.25, 0, 0], "inertia": [0.1, 0.1, 0.1, 0, 0, 0]}},
        ],
        "convention": "standard",
        "base": {"xyz": [0, 0, 7], "rpy": [1.5, 0, 0]},
    },
    "units": {"angle": "rad", "length": "m"},
    "start": {"joints": [0.25, 0.5]},
    "moves": [{"planner": "quintic", "to": {"joints": [1.0, -0.5]}, "duration": 2}],
}


def test_a_log_has_efforts_where_the_job_asks_for_them(tmp_path: Path) -> None:
    output = {"rate": 20, "columns": ["t", "q", "qd", "qdd", "tau"]}
    plan = _planned(json.dumps({**ARM, "output": output}))
    rows = table(delivered(plan, tmp_path / "rows.csv"))
    efforts = read_mcap(delivered(plan, tmp_path / "log.mcap")).effort
    assert efforts == pytest.approx(np.stack([rows["tau1"], rows["tau2"]], axis=1), abs=1e-8)
    assert np.abs(efforts).max() > 1.0
    bare = _planned(json.dumps({**ARM, "output": {**output, "columns": ["t", "q"]}}))
    assert read_mcap(delivered(bare, tmp_path / "bare.mcap")).effort.shape == (41, 0)
    with pytest.raises(InputError):
        delivered(planned(rate=10), tmp_path / "none.mcap", log=LogOptions(topics="/tool_twist"))
    with pytest.raises(InputError, match="start"):
        delivered(planned(rate=10, start_time=-1.0), tmp_path / "none.mcap")
    assert not (tmp_path / "none.mcap").exists()


@pytest.mark.parametrize("frame", ["base", "world"])
def test_rows_say_where_the_tool_is_in_the_frame_that_the_job_names(frame: str, tmp_path: Path) -> None:
    """The base lies on its side 7 m above the floor: about the x axis of world."""
    plan = _planned(json.dumps({**ARM, "output": {"rate": 20, "columns": ["t", "q", "pose"], "in": frame}}))
    rows = table(delivered(plan, tmp_path / "rows.csv"))
    angle = np.cumsum([rows["q1"], rows["q2"]], axis=0)
    x, y = np.cos(angle[0]) + 0.5 * np.cos(angle[1]), np.sin(angle[0]) + 0.5 * np.sin(angle[1])
    places = {"base": (x, y, 0 * y), "world": (x, np.cos(1.5) * y, 7 + np.sin(1.5) * y)}
    found = np.stack([rows["x"], rows["y"], rows["z"]])
    assert found == pytest.approx(np.stack(places[frame]), abs=1e-8)
