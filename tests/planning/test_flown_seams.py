"""What is said of moves that fly by corners, against their motion by textbook formulas: columns, reports, bounds."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from cli.running import call
from planned_examples import planned_once, share_plans

from trajcli.grids import ListedGrid
from trajcli.job.read import job_from_text, load_job
from trajcli.kinematics.robot import Limits
from trajcli.output.report import report_of
from trajcli.peers.lower_bound import LowerBound, fastest_duration
from trajcli.planning.plan import Plan, plan_job
from trajcli.samples import sample
from trajcli.trajectory import State

START = (0.3, 1.2)
FAST = {"law": {"shape": "time_optimal"}}
CORNER, END = (0.300748, 0.392283), (0.154969, 0.392283)
LINES = {
    "version": 1,
    "robot": "planar2r",
    "limits": {"velocity": 3, "acceleration": 8, "jerk": 60},
    "zone": 0.02,
    "start": {"joints": list(START)},
    "moves": [
        {"planner": "line", "to": {"xyz": [*CORNER, 0]}, **FAST},
        {"planner": "line", "to": {"xyz": [*END, 0]}, **FAST},
    ],
    "output": {"rate": 500, "columns": ["t", "q", "qd", "path", "zone", "move"]},
}


def place(q: np.ndarray) -> np.ndarray:
    """Return the place of the tool of planar2r by its textbook formula, m."""
    both = q.sum(axis=-1)
    arms = (0.3 * np.cos(q[..., 0]) + 0.2 * np.cos(both), 0.3 * np.sin(q[..., 0]) + 0.2 * np.sin(both))
    return np.stack(arms, axis=-1)


def speed(q: np.ndarray, qd: np.ndarray) -> np.ndarray:
    """Return the speed of the tool, m/s."""
    x, y = place(q).T
    reach = 0.2 * np.stack([-np.sin(q.sum(axis=-1)), np.cos(q.sum(axis=-1))])
    rates = qd[:, 0] * np.stack([-y, x]) + qd[:, 1] * reach
    return np.asarray(np.hypot(*rates))


@pytest.fixture(scope="module")
def job(tmp_path_factory) -> Path:
    """Return the file of the job, whose plan the tests share."""
    file = tmp_path_factory.mktemp("lines") / "job.yaml"
    file.write_text(json.dumps(LINES))
    return file


@pytest.fixture
def lines(job: Path) -> Plan:
    plan = planned_once(load_job(job))
    assert plan.verdict.passed
    return plan


@pytest.mark.full
def test_columns_of_the_path_say_where_the_tool_is_on_it_and_stand_in_a_zone(lines):
    plan = lines
    (zone,) = plan.flyby.zones
    times = np.arange(0, plan.trajectory.duration, 1 / 2048)
    (rows,) = sample(
        plan.trajectory, ListedGrid(plan.trajectory.duration, times), ("q", "qd", "path", "zone", "move")
    )
    q, qd, (s, sd, sdd), inside, move = rows[:, :2], rows[:, 2:4], rows[:, 4:7].T, rows[:, 7], rows[:, 8]
    begins = np.where(move[:, None] == 0, place(np.array(START)), CORNER)
    on_path = inside == 0
    assert np.abs(np.linalg.norm(place(q) - begins, axis=1) - s)[on_path].max() < 1e-6
    assert np.abs(speed(q, qd) - sd)[on_path].max() < 1e-5
    whole = np.linalg.norm(place(np.array(START)) - CORNER)
    standing = np.where(move == 0, whole - zone.used, 0.02)
    assert np.abs(s - standing)[~on_path].max() < 1e-6
    assert not sd[~on_path].any()
    assert not sdd[~on_path].any()
    changes = np.diff(sd)[on_path[1:] & on_path[:-1]] * 2048
    assert np.abs(changes - sdd[:-1][on_path[1:] & on_path[:-1]]).max() < 0.1 * np.abs(sdd).max()


@pytest.mark.full
def test_the_report_of_the_tool_is_that_of_its_path_between_zones(lines):
    """Its peaks beside zones are those of the tool by the textbook; the whole path has the length that it has."""
    plan = lines
    (zone,) = plan.flyby.zones
    ends = (0.0, zone.entered), (zone.left, plan.trajectory.duration)
    lengths = [np.linalg.norm(place(np.array(START)) - CORNER), CORNER[0] - END[0]]
    for move, (first, last), length in zip(report_of(plan).moves, ends, lengths, strict=True):
        times = np.linspace(first, last, 20001)
        speeds = speed(*(plan.trajectory.curve.evaluate(times, order) for order in (0, 1)))
        peak = next(peak for peak in move.tool.peaks if peak.quantity == "speed")
        assert peak.value == pytest.approx(speeds.max(), rel=1e-6)
        assert peak.time == pytest.approx(times[speeds.argmax()], abs=1e-3)
        assert move.tool.length == pytest.approx(length, rel=1e-6)
        assert move.tool.deviation <= move.tool.deviation_bound < 1e-6
        assert move.tool.method == "bounded"


@pytest.mark.full
def test_a_wanted_speed_is_held_on_so_much_of_a_path_between_zones_and_explained_with_its_law(
    tmp_path: Path, capfd, monkeypatch
):
    """By the speed of the tool by the textbook; in a zone none is held."""
    share_plans(monkeypatch)
    paced = {**LINES, "moves": [{**move, "law": {**FAST["law"], "speed": 0.2}} for move in LINES["moves"]]}
    plan, job = plan_job(job_from_text(json.dumps(paced))), tmp_path / "paced.yaml"
    (zone,) = plan.flyby.zones
    job.write_text(json.dumps(paced))
    explained = json.loads(call(capfd, "explain", job, "--json").out)["moves"]
    ends = (0.0, zone.entered), (zone.left, plan.trajectory.duration)
    for move, begin, (first, last) in zip(explained, (place(np.array(START)), CORNER), ends, strict=True):
        times = np.linspace(first, last, 20001)
        q, qd = (plan.trajectory.curve.evaluate(times, order) for order in (0, 1))
        speeds = speed(q, qd)
        fast = speeds[speeds >= 0.999 * 0.2].sum() * (times[1] - times[0])
        assert move["tool"]["wanted_speed"] == 0.2
        assert 0.2 < move["tool"]["held"] == pytest.approx(fast / move["path"]["length"], abs=5e-3)
        law, since = move["path"]["law"], times - move["start"]
        assert law[0]["start"] == 0
        assert law[-1]["end"] == pytest.approx(move["duration"], abs=1e-9)
        pieces = np.searchsorted([piece["end"] for piece in law[:-1]], since)
        s = [np.polyval(law[k]["absolute"][::-1], time) for k, time in zip(pieces, since, strict=True)]
        assert np.abs(np.linalg.norm(place(q) - begin, axis=1) - s).max() < 1e-6
    text = call(capfd, "explain", job).out
    assert text.count("tool speed of 0.2 m/s held on") == 2
    assert text.count("line from") == 2


@pytest.mark.full
def test_rows_of_another_motion_are_compared_with_the_path_outside_of_zones(
    job: Path, tmp_path: Path, capfd, monkeypatch
):
    share_plans(monkeypatch)
    rows = tmp_path / "rows.csv"
    assert call(capfd, "plan", job, "-q", "-o", rows).code == 0
    head, *lines_of = rows.read_text().splitlines()
    columns = head.split(",")
    at, zone = columns.index("s"), columns.index("zone")
    states = [line.split(",") for line in lines_of]
    inside = [k for k, state in enumerate(states) if state[zone] != "0"]

    def verdict(*changed: int) -> str:
        other = [list(state) for state in states]
        other[0][zone] = "1"  # no rows of the plan, which are not judged one by one
        for k in changed:
            other[k][at] = str(float(other[k][at]) + 1e-4)
        rows.write_text("\n".join([head, *(",".join(state) for state in other)]) + "\n")
        found = call(capfd, "check", rows, "--job", job)
        return found.out + found.err

    assert "tool of position" not in verdict()
    assert "tool of position" in verdict(inside[0] - 5)
    assert "tool of position" in verdict(inside[-1])


def test_a_joint_that_only_carries_rounding_bounds_nothing_and_one_on_its_limit_is_within_it():
    """The other one needs 2 * sqrt(d / a): 1 s for 2 rad at 8 rad/s^2, with hardly any limit of jerk."""
    bounds = np.array([[-8.0, 8.0]] * 2)
    limits = Limits(np.full((2, 2), [-np.inf, np.inf]), bounds * 10, bounds, np.array([[-1e9, 1e9]] * 2))
    for start, end in ((1e-16, 3e-15), (0.0, 0.0)):
        first = State(np.zeros(2), np.array([0.0, start]), np.array([0.0, -end]))
        last = State(np.array([2.0, 0.0]), np.array([0.0, -start]), np.array([0.0, end]))
        found = fastest_duration(first, last, limits)
        assert isinstance(found, LowerBound)
        assert found.duration == pytest.approx(1.0, rel=1e-6)
    beyond = State(np.zeros(2), np.zeros(2), np.array([8.0 * (1 + 4e-16), 0.0]))
    assert isinstance(fastest_duration(beyond, last, limits), LowerBound)


@pytest.mark.full
def test_a_joint_move_by_so_much_can_be_flown_by():
    """Where it ends is known from where the arm stands, as that of a move to joints."""
    to = [{"planner": "jerk_limited", "to": {"joints": joints}} for joints in ([0.9, 1.25], [1.0, 2.0])]
    by = [to[0], {"planner": "jerk_limited", "to": {"joints_by": {"j1": 0.1, "j2": 0.75}}}]
    found = [plan_job(job_from_text(json.dumps({**LINES, "moves": moves}))).flyby for moves in (to, by)]
    assert found[1].duration == pytest.approx(found[0].duration, rel=1e-9)
    assert found[1].duration < 0.9 * found[1].stopping
