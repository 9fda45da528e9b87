"""A tool on three slides along lines with zones: in a ball about a corner it is free, outside it is on its line."""

from __future__ import annotations

from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from judge.test_rows_beside_a_path import CORNERS, GANTRY, PERIOD, START

import trajcli
from trajcli.api.plans import PlannedJob
from trajcli.findings import Finding
from trajcli.grids import UniformGrid
from trajcli.judge.file import CheckOptions, check_file
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.judge.reconstruction import Interpolation
from trajcli.judge.recorded_tool import judge_of_moves
from trajcli.kinematics.forward import forward
from trajcli.output.delivery.joined_rows import JoinedRows
from trajcli.samples import sample
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

RADIUS = 0.05
ENDS = np.vstack([START, CORNERS[:3]])
NEAR = 1e-6  # m: how near a tool that follows a path promises to be


@cache
def flown() -> PlannedJob:
    """Return the plan of three sides of a rectangle, with a zone about both corners."""
    lines = [
        {"planner": "line", "to": {"xyz": corner.tolist()}, "law": {"shape": "time_optimal"}}
        for corner in ENDS[1:]
    ]
    limits = {"velocity": 1, "acceleration": 1.4}
    job = {"version": 1, "robot": GANTRY, "limits": limits, "zone": RADIUS, "start": {"xyz": START.tolist()}}
    made = trajcli.plan({**job, "moves": lines})
    assert made.flyby is not None
    return made


def beside(
    places: np.ndarray, moves: np.ndarray, half_unit: float = 0.0, joined: Interpolation = "hold"
) -> list[Finding]:
    """Return where rows of the tool (N, 3), and what joins them, are beside the lines of their moves (N,)."""
    made = flown()
    robot, off = made.moves[0].robot, np.full(3, half_unit)
    origin = forward(robot, np.zeros(3))[:3, 3]
    axes = np.stack([forward(robot, unit)[:3, 3] - origin for unit in np.eye(3)], axis=1)
    rows = RecordedMotion(
        PERIOD * np.arange(len(places)),
        (places - origin) @ axes,
        *(None,) * 4,
        moves,
        None,
        Resolution(0.0, off, off, off),
        "rows",
        1,
    )
    required = Requirements(
        robot, interpolate=joined, tool=lambda: judge_of_moves(made.loaded.robot, made.moves)
    )
    found = judge_motion(lambda: (rows,), required).findings
    return [each for each in found if each.kind == "deviation"]


def cut(corner: int, before: float, count: int = 40, chord: int = 200) -> tuple[np.ndarray, np.ndarray]:
    """Return places along the sides that leave one so far before a corner, and are on the next so far behind it.

    There are so many of each part, and of what cuts the corner.
    """
    ways = np.diff(ENDS, axis=0) / np.linalg.norm(np.diff(ENDS, axis=0), axis=1)[:, None]
    middle = ENDS[corner]
    stations = [*ENDS[:corner], middle - before * ways[corner - 1], middle + before * ways[corner]]
    stations += [*ENDS[corner + 1 :]]
    counts = [chord if part == corner else count for part in range(4)]
    places = [
        np.linspace(a, b, n, endpoint=False) for (a, b), n in zip(pairwise(stations), counts, strict=True)
    ]
    of_moves = np.full(3, count)
    of_moves[corner - 1 : corner + 1] += chord // 2
    return np.vstack(places), np.repeat(np.arange(3), of_moves)


@pytest.mark.parametrize("corner", [1, 2])
@pytest.mark.parametrize(("before", "over"), [(0.0, False), (0.02, False), (0.0499, False), (0.06, True)])
def test_a_corner_may_be_cut_within_its_zone(before: float, corner: int, *, over: bool) -> None:
    """The chord from 60 mm before it to 60 mm behind it is outside the ball while it is less than 11.3 mm beside."""
    places, moves = cut(corner, before, chord=200 if over else 40)
    found = beside(places, moves)
    assert {each.move for each in found} == ({corner - 1, corner} if over else set())
    for each in found:
        assert each.value == pytest.approx(0.03 - np.sqrt((RADIUS**2 - 0.06**2 / 2) / 2), abs=3e-4)
        assert (each.certainty, each.method) == ("exceeded", "sampled")


@pytest.mark.parametrize("move", [0, 1, 2])
@pytest.mark.parametrize("by", [0.9 * NEAR, 1.1 * NEAR, 2e-4])
def test_between_its_zones_the_tool_is_on_its_line(move: int, by: float) -> None:
    places, moves = cut(1, 0.03, chord=40)
    row = int(np.linalg.norm(places - ENDS[move : move + 2].mean(axis=0), axis=1).argmin())
    places[row, 2] += by
    found = [(each.row, each.move, each.value) for each in beside(places, moves)]
    assert found == ([(row + 1, move, pytest.approx(by, rel=1e-6))] if by > NEAR else [])


def test_rounding_explains_a_row_just_outside_a_zone() -> None:
    places, moves = cut(1, 0.03)
    row = int(np.linalg.norm(places - ENDS[1], axis=1).argmin())
    places[row] = ENDS[1] + [0.0, 0.0, RADIUS + 2e-5]
    assert beside(places, moves, 1e-5) == []
    (found,) = beside(places, moves)
    assert found.value == pytest.approx(RADIUS + 2e-5, abs=1e-3)
    places[row] = ENDS[1] + [0.0, 0.0, RADIUS + 0.9 * NEAR]
    assert beside(places, moves) == []


@pytest.mark.parametrize("later", [False, True])
@pytest.mark.parametrize("corner", [1, 2])
def test_what_joins_a_row_in_a_zone_and_one_outside_is_on_the_side_that_it_is_nearest_to(
    corner: int, *, later: bool
) -> None:
    """A row in the ball is 20 mm beside a side, 20 mm from its corner, and the next one 80 mm from it: 10 mm off."""
    places, moves = cut(corner, 0.03, 20, 20)
    ways = np.diff(ENDS, axis=0) / np.linalg.norm(np.diff(ENDS, axis=0), axis=1)[:, None]
    inward = ways[corner] if not later else -ways[corner - 1]
    along = -ways[corner - 1] if not later else ways[corner]
    row = (
        int(np.flatnonzero(moves == corner - 1)[-1]) if not later else int(np.flatnonzero(moves == corner)[0])
    )
    places[row] = ENDS[corner] + 0.02 * (along + inward)
    places[row + 1 :] = ENDS[corner] + 0.08 * along
    moves[row + 1 :] = moves[row]
    found = beside(places, moves, joined="linear")
    assert [(each.row, each.value) for each in found] == [(row + 1, pytest.approx(0.01, rel=1e-6))]


@pytest.mark.parametrize("rate", [1000.0, 20.0, 9.0, 7.0, 5.0, 3.0])
def test_what_joins_rows_of_flown_lines_is_beside_them_outside_of_zones_alone(rate: float) -> None:
    """The middle between two rows of one line, joined by a straight one, is as far beside it as its coordinates say."""
    plan = flown()
    grid = UniformGrid(plan.trajectory.duration, rate)
    judged = JoinedRows(plan, grid, ("t", "q"), exact=True).judgement()
    assert judged is not None
    times = np.minimum(np.arange(grid.count) / rate, grid.duration)
    places = forward(plan.moves[0].robot, plan.trajectory.curve.evaluate(times))[:, :3, 3]
    wanted = dict[int, float]()
    for move, span in enumerate(plan.trajectory.spans):
        both = (times[:-1] >= span.start) & (times[1:] <= span.end)
        middles = 0.5 * (places[:-1] + places[1:])[both]
        free = np.linalg.norm(middles[:, None] - ENDS[1:3], axis=2).min(axis=1) <= RADIUS + NEAR
        off = np.delete(middles - ENDS[move], int(np.abs(ENDS[move + 1] - ENDS[move]).argmax()), axis=1)
        worst = float(np.linalg.norm(off[~free], axis=1).max(initial=0.0))
        if worst > NEAR:
            wanted[move] = worst
    found = {each.move: each.value for each in judged.findings if each.kind == "deviation"}
    assert found == {move: pytest.approx(value, rel=1e-6) for move, value in wanted.items()}
    assert bool(wanted) is (rate < 100.0)


@pytest.mark.parametrize("last", [True, False], ids=["behind", "before"])
@pytest.mark.parametrize("inside", [0, 3, -1])
def test_a_distance_that_does_not_stand_in_a_zone_is_found_in_its_row(
    inside: int, last: bool, tmp_path: Path
) -> None:
    """Of the second line s is 50 mm in the zone before it, and 150 mm in the one behind it; one row says 2 mm more."""
    plan, names, file = flown(), ["t", "q1", "q2", "q3", "s", "sd", "sdd", "move"], tmp_path / "rows.csv"
    grid = UniformGrid(plan.trajectory.duration, 50.0)
    (rows,) = sample(plan.trajectory, grid, ("t", "q", "path", "move"), robot=plan.loaded.robot)
    in_zone = (rows[:, -1] == 1) & (rows[:, 5] == 0.0)
    row = int(np.flatnonzero(in_zone & ((rows[:, 4] > 0.1) == last))[inside])
    assert rows[row, 4] == pytest.approx(0.15 if last else 0.05, abs=1e-9)
    rows[row, 4] += 2e-3
    np.savetxt(file, rows, "%.9f", ",", header=",".join(names), comments="")
    findings = check_file(str(file), CheckOptions(), plan).judgement.findings
    (found,) = (each for each in findings if each.kind == "tool")
    assert (found.quantity, found.row, found.move, found.count) == ("position", row + 1, 1, 1)
    assert found.value == pytest.approx(2e-3, abs=1e-6)
