"""Signals: when they are set, how rows, logs and reports show them, and what is refused."""

from __future__ import annotations

import json
from functools import cache
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.optimize import minimize_scalar
from tiers import few

from trajcli.errors import InputError
from trajcli.grids import ListedGrid
from trajcli.job.dump import dump_job
from trajcli.job.read import job_from_text
from trajcli.kinematics.forward import forward
from trajcli.output.report import report_of
from trajcli.output.write import grid_of
from trajcli.planning.plan import Plan, plan_job
from trajcli.samples import sample

HEAD: dict[str, Any] = {
    "version": 1,
    "units": {"angle": "deg", "length": "mm"},
    "robot": "ur5e",
    "limits": {"acceleration": 800, "jerk": 8000},
    "start": {"joints": [0, -90, 90, -90, -90, 0]},
}
LAW = {"shape": "time_optimal", "speed": 250}
PLAIN = {"law": {"shape": "quintic", "duration": 0.5}}
SLIDES = [
    {"type": "prismatic", "theta": theta, "alpha": alpha} for theta, alpha in ((0, -90), (-90, -90), (0, 0))
]
GANTRY: dict[str, Any] = {
    "robot": {"convention": "standard", "joints": SLIDES},
    "limits": {"velocity": 1000, "acceleration": 3000},
    "start": {"joints": [100, 200, 300]},
}


def line(*xyz: float, **fields: Any) -> dict[str, Any]:
    return {"planner": "line", "to": {"from": "here", "offset": {"xyz": xyz}}, "law": LAW, **fields}


def at(when: Any = "nearest", before: float = 0.0, value: float = 1) -> dict[str, Any]:
    return {"signal": "s", "value": value, "when": when, "before": before}


@cache
def _planned(text: str) -> Plan:
    return plan_job(job_from_text(text))


def planned(*moves: dict[str, Any], **fields: Any) -> Plan:
    plan = _planned(json.dumps({**HEAD, "moves": moves, **fields}))
    assert plan.verdict.passed
    return plan


def times_of(plan: Plan, name: str = "s") -> list[float]:
    return next([c.time for c in signal.changes] for signal in plan.trajectory.signals if signal.name == name)


def tool(plan: Plan, *times: float) -> np.ndarray:
    return forward(plan.loaded.robot, plan.trajectory.curve.evaluate(np.array(times)))[:, :3, 3]


@pytest.mark.full
def test_at_a_stop_every_moment_is_the_arrival() -> None:
    some = [at("enter"), at("nearest", 0.03), at("leave", -0.02)]
    plan = planned(line(0, 0, 80, at=some), line(80, 0, 0))
    arrival = plan.moves[0].duration
    assert times_of(plan) == pytest.approx([arrival - 0.03, arrival, arrival + 0.02], abs=1e-12)


@pytest.mark.full
def test_a_signal_between_moves_is_set_where_the_arm_stands() -> None:
    plan = planned(line(0, 0, 80), {"signal": "s", "value": 2.5}, line(80, 0, 0))
    assert times_of(plan) == [plan.moves[0].duration]
    assert plan.trajectory.duration == planned(line(0, 0, 80), line(80, 0, 0)).trajectory.duration


def test_a_signal_along_a_path_is_set_where_the_tool_has_gone_so_far() -> None:
    plan = planned(line(0, 0, 80, at=[at({"path": 25}), at({"path": -10})]))
    start, early, late, end = tool(plan, 0.0, *times_of(plan), plan.trajectory.duration)
    assert np.linalg.norm(early - start) == pytest.approx(0.025, abs=2e-6)
    assert np.linalg.norm(end - late) == pytest.approx(0.01, abs=2e-6)


@pytest.mark.full
@pytest.mark.parametrize("jerk", [None, pytest.param(8000, marks=pytest.mark.full)])
def test_about_a_corner_the_tool_enters_is_nearest_and_leaves(jerk: float | None) -> None:
    some = [at("leave"), at("nearest"), at("enter"), at({"path": 30}), at({"path": -5})]
    limits = {"acceleration": 800, "jerk": jerk}
    plan = planned(line(0, 0, 80, zone=20, at=some), line(80, 0, 0), limits=limits)
    corner = planned(line(0, 0, 80), line(80, 0, 0), limits=limits)
    where = tool(corner, corner.moves[0].duration)[0]
    on_path, enter, inside, nearest, leave = times_of(plan)
    distances = np.linalg.norm(tool(plan, enter, nearest, leave) - where, axis=1)
    assert distances[[0, 2]] == pytest.approx(0.02, rel=1e-3)
    fine = np.linspace(enter, leave, 4001)
    assert distances[1] == pytest.approx(np.linalg.norm(tool(plan, *fine) - where, axis=1).min(), rel=1e-6)
    begin = tool(plan, 0.0)[0]
    assert np.linalg.norm(tool(plan, on_path)[0] - begin) == pytest.approx(0.03, abs=3e-6)
    wanted = where + (begin - where) * (5 / 80)
    off = np.linalg.norm(tool(plan, *fine) - wanted, axis=1)
    assert inside == pytest.approx(fine[off.argmin()], abs=fine[1] - fine[0])


def test_between_two_zones_each_length_is_passed_where_the_tool_is_nearest_to_it() -> None:
    """In the first zone, on the path, in the second: against a minimum that scipy finds."""
    lengths = (4.0, 40.0, -3.0)
    some = [at({"path": length}, value=k) for k, length in enumerate(lengths, 1)]
    moves = [line(0, 0, 80, zone=20, at=at()), line(80, 0, 0, zone=15, at=[*some, at("enter", value=9)])]
    plan = planned(*moves, line(0, 60, 0, at=at("nearest", value=7)), **GANTRY)
    (first, second), end = plan.trajectory.zones, plan.trajectory.duration
    corner = planned(line(0, 0, 80, **PLAIN), line(80, 0, 0, **PLAIN), **GANTRY)
    where, to = tool(corner, corner.moves[0].duration, corner.trajectory.duration)
    set_at = dict(zip([c.value for c in plan.trajectory.signals[0].changes], times_of(plan), strict=True))
    for value, length, within in zip((1, 2, 3), lengths, (first, (first[1], second[0]), second), strict=True):
        point = where + (to - where) * (length / 80 if length > 0 else 1 + length / 80)
        found = minimize_scalar(
            lambda time, point=point: np.linalg.norm(tool(plan, time)[0] - point),
            bounds=within,
            method="bounded",
            options={"xatol": 1e-9},
        )
        assert set_at[value] == pytest.approx(found.x, abs=1e-5), length
        assert within[0] < set_at[value] < within[1]
    assert set_at[9] == second[0]
    assert first[0] < times_of(plan)[0] < first[1]
    assert set_at[7] == end  # no zone: its arrival, whatever others are


def test_lengths_count_from_both_ends_and_times_from_the_arrival() -> None:
    alone = planned(line(0, 0, 80, at=[at({"path": 0}), at({"path": -80}, value=2)], **PLAIN))
    assert times_of(alone) == pytest.approx([0.0, 0.0], abs=1e-5)
    with pytest.raises(InputError, match="is set 81 mm along its path, which is 80 mm long"):
        planned(line(0, 0, 80, at=at({"path": -81}), **PLAIN))
    arrival = alone.trajectory.duration
    for before, time in [(arrival + 5e-13, 0.0), (-5e-13, arrival), (arrival, 0.0), (0.0, arrival)]:
        assert times_of(planned(line(0, 0, 80, at=at("leave", before), **PLAIN))) == [time]
    for before in (arrival + 5e-4, -5e-4):
        with pytest.raises(InputError, match="outside of the job"):
            planned(line(0, 0, 80, at=at("leave", before), **PLAIN))


@pytest.mark.full
@pytest.mark.parametrize("length", few([210.0, 100.0, 130.0, 290.0], 1))
def test_the_whole_length_of_a_path_is_within_it_however_it_is_rounded(length: float) -> None:
    """Without a zone, and where there is one about another corner."""
    alone = planned(line(0, length, 0, at=[at({"path": length}), at({"path": -length}, value=2)]))
    assert times_of(alone) == pytest.approx([0.0, alone.trajectory.duration], abs=1e-5)
    moves = [line(0, 50, 0, zone=20), line(50, 0, 0), line(0, length, 0, at=[at({"path": length})])]
    both = planned(*moves)
    assert times_of(both) == pytest.approx([both.trajectory.duration], abs=1e-5)
    with pytest.raises(InputError, match="along its path, which is"):
        planned(line(0, length, 0, at=[at({"path": length * (1 + 1e-6)})]))


def test_at_the_end_the_path_is_that_of_the_move_that_ends_there() -> None:
    """Neither of what follows without length, nor of a line to where the arm is."""
    plan = planned(line(0, 100, 0, **PLAIN), line(0, 0, 0), {"signal": "s", "value": 1})
    end = ListedGrid(plan.trajectory.duration, np.array([plan.trajectory.duration]))
    row = np.concatenate(list(sample(plan.trajectory, end, ("path", "move"))))[0]
    assert row == pytest.approx([0.1, 0.0, 0.0, 0.0], abs=1e-9)


@pytest.mark.full
def test_behind_a_zone_lengths_still_count_from_the_start_of_the_programmed_path() -> None:
    some = [at({"path": 40}), at({"path": 5})]
    plan = planned(line(0, 0, 80, zone=20), line(80, 0, 0, at=some))
    corner = planned(line(0, 0, 80), line(80, 0, 0))
    where, end = tool(corner, corner.moves[0].duration, corner.trajectory.duration)
    inside, on_path = times_of(plan)
    assert tool(plan, on_path)[0] == pytest.approx(where + (end - where) * 0.5, abs=3e-6)
    zone = plan.trajectory.zones[0]
    fine = np.linspace(*zone, 4001)
    off = np.linalg.norm(tool(plan, *fine) - (where + (end - where) / 16), axis=1)
    assert inside == pytest.approx(fine[off.argmin()], abs=fine[1] - fine[0])


@pytest.mark.full
def test_a_row_at_the_very_time_has_the_new_value_and_before_the_first_it_is_0() -> None:
    plan = planned(line(0, 0, 80, at=at(before=0.1, value=3)), {"signal": "s", "value": 2}, line(80, 0, 0))
    first, second = times_of(plan)
    times = np.array([0.0, first - 1e-6, first, second - 1e-6, second, plan.trajectory.duration])
    (rows,) = sample(plan.trajectory, ListedGrid(plan.trajectory.duration, times), ("t", "signals"))
    assert rows[:, 1].tolist() == [0, 0, 3, 3, 2, 2]


@pytest.mark.full
@pytest.mark.parametrize("distance", few([30.0, 40.0, 55.0, 70.0, 90.0, 120.0], 2))
def test_the_row_of_a_knot_at_the_time_of_a_signal_has_its_value(distance: float) -> None:
    """A knot stands at the nearest nanosecond, which may be before the break at which the signal is set."""
    moves = [
        part
        for k in range(1, 9)
        for part in (line(0, 0, distance + k), {"signal": "s", "value": k}, line(0, 0, -distance))
    ]
    plan = planned(*moves, output={"rows": "knots", "columns": ["t", "q", "qd", "qdd", "signals"]})
    rows = np.concatenate(list(sample(plan.trajectory, grid_of(plan), ("t", "signals"))))
    for value, time in enumerate(times_of(plan), 1):
        near = np.abs(rows[:, 0] - time) < 0.6e-9
        assert rows[near, 1].tolist() == [value] * near.sum()


def test_slowed_moves_set_their_signals_where_they_did() -> None:
    slow = {"limits": {"acceleration": 800, "jerk": 8000, "velocity": 20}, "when_over_limit": "slow"}
    plan = planned(line(0, 0, 80, law={"shape": "quintic", "duration": 0.5}, at=at({"path": 25})), **slow)
    assert plan.moves[0].stretch > 1
    start, early = tool(plan, 0.0, *times_of(plan))
    assert np.linalg.norm(early - start) == pytest.approx(0.025, abs=2e-6)


@pytest.mark.full
def test_report_explain_and_the_resolved_job_say_them() -> None:
    plan = planned(line(0, 0, 80, at=at({"path": 25})), {"signal": "lamp", "value": 0.5}, line(80, 0, 0))
    said = [(s.name, s.value, s.move, s.time) for s in report_of(plan).signals]
    assert said == [("s", 1.0, 0, times_of(plan)[0]), ("lamp", 0.5, 1, plan.moves[0].duration)]
    resolved = plan_job(job_from_text(dump_job(plan.loaded)))
    assert resolved.trajectory.signals == plan.trajectory.signals


@pytest.mark.full
def test_a_log_has_a_topic_for_each_signal(tmp_path: Path) -> None:
    from mcap.reader import make_reader
    from streams.mcap.conftest import write_log

    plan = planned(line(0, 0, 80, at=at({"path": 25}, value=3)), {"signal": "s", "value": 2}, line(80, 0, 0))
    found = [
        (message.sequence, message.log_time, schema.name, np.frombuffer(message.data[4:], "<f8")[0])
        for schema, channel, message in make_reader(
            BytesIO(write_log(plan, tmp_path / "log.mcap").read_bytes())
        ).iter_messages("/signal/s")
    ]
    times = [0, *(round(1e9 * time) for time in times_of(plan))]
    values = zip(times, (0, 3, 2), strict=True)
    assert found == [(k, t, "std_msgs/msg/Float64", v) for k, (t, v) in enumerate(values)]


@pytest.mark.full
def test_rows_whose_signal_is_another_are_none_of_the_plan(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    from cli.running import call

    job, rows = tmp_path / "job.yaml", tmp_path / "rows.csv"
    columns = {"output": {"rate": 20, "columns": ["t", "q", "signals", "move"]}}
    job.write_text(json.dumps({**HEAD, "moves": [line(0, 0, 80, at=at({"path": 25}))], **columns}))
    assert call(capfd, "plan", job, "-o", rows, "--quiet").code == 0
    text = rows.read_text()
    found = []
    for written in (text, text.replace(",1.000000000,", ",0.000000000,")):
        rows.write_text(written)
        judged = json.loads(call(capfd, "check", rows, "--job", job, "--format", "json").out)
        found.append((judged["planned_rows"], [note for note in judged["notes"] if "not read" in note]))
    assert found == [(True, []), (False, ["columns that are not read: signal.s"])]
    assert text.splitlines()[0].endswith(",signal.s,move")


@pytest.mark.parametrize(
    ("moves", "fields", "line_of", "words"),
    [
        (
            [line(0, 0, 80, at=at({"path": 90}), **PLAIN)],
            {},
            "at",
            "90 mm along its path, which is 80 mm long",
        ),
        ([line(0, 0, 80, at=[at(), at("leave", 9)], **PLAIN)], {}, "at", "outside of the job"),
        ([line(0, 0, 80, at=[at("leave", -0.1)], **PLAIN)], {}, "at", "outside of the job"),
        ([line(0, 0, 80, at=at("arrive"))], {}, "at", "expected enter, nearest, leave or {path: L}"),
        ([line(0, 0, 80, at=[at(), {"signal": "s"}])], {}, "at", "`value` is missing"),
        ([line(0, 0, 80, at={**at(), "time": 3})], {}, "at", "a signal has no 'time'"),
        ([line(0, 0, 80, at={**at(), "signal": "a.b"})], {}, "at", "'a.b' is no name of a signal"),
        ([line(0, 0, 80)], {"output": {"columns": ["t", "signals"]}}, "output", "no move of the job sets"),
        ([{"signal": "s", "value": 1}], {}, "moves", "nothing moves"),
        ([line(0, 0, 80, zone=20), {"signal": "s", "value": 1}, line(80, 0, 0)], {}, "zone", "for `signal`"),
        (
            [{"planner": "jerk_limited", "to": {"joints": [0, -80, 90, -90, -90, 0]}, "at": at({"path": 3})}],
            {},
            "at",
            "no signal can be set along its path: it has none",
        ),
    ],
)
def test_what_cannot_be_is_refused_on_its_line(
    moves: list[Any], fields: dict[str, Any], line_of: str, words: str
) -> None:
    text = json.dumps({**HEAD, "moves": moves, **fields}, indent=1)
    with pytest.raises(InputError) as error:
        plan_job(job_from_text(text))
    problem = error.value.problems[0]
    assert words in problem.message
    assert problem.place is not None
    before = text.splitlines()[: problem.place.line]
    assert any(f'"{line_of}"' in row for row in before)


def test_arms_of_bare_joints_have_signals_too() -> None:
    job = {
        **HEAD,
        "robot": {"joints": 1},
        "limits": {"velocity": 1, "acceleration": 2},
        "start": {"joints": [0]},
    }
    moves = [{"signal": "s", "value": 1}, {"planner": "trapezoid", "to": {"joints": [9]}}]
    assert times_of(planned(*moves, **{key: job[key] for key in ("robot", "limits", "start")})) == [0.0]
