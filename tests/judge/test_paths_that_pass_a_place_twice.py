"""Rows of a tool beside paths that cross themselves, come back on their own way or are driven in laps.

On three slides the place of the tool is a linear function of the joints. A row on the path at the s that the tool
has reached is beside it nowhere, wherever else the path passes; from there to elsewhere it does not get in no time.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from judge.test_rows_beside_a_path import GANTRY, START
from numpy.typing import NDArray

import trajcli
from trajcli.api.plans import PlannedJob
from trajcli.findings import Finding
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.judge.reconstruction import Interpolation
from trajcli.judge.recorded_tool import ToolJudge
from trajcli.kinematics.forward import forward
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

Array = NDArray[np.float64]
Corners = tuple[tuple[float, float], ...]
SPEED, PERIOD = 0.2, 0.02
"""m/s of the plan, and s from row to row."""
LINE = ((0.3, 0.0),)
RECTANGLE = ((0.3, 0.0), (0.3, 0.2), (0.0, 0.2), (0.0, 0.0))
TO_AND_FRO = ((0.3, 0.0), (0.0, 0.0), (0.0, 0.2))
LOOP = ((0.051, 0.0), (0.051, 0.001), (0.05, 0.001), (0.05, 0.0), (0.05, -0.04))
HAIRPIN = ((0.3, 0.0), (0.3, 0.004), (0.0, 0.004))
NARROW = ((0.3, 0.0), (0.3, 0.0003), (0.0, 0.0003))


@cache
def planned(corners: Corners) -> PlannedJob:
    """Return the plan of lines from (0, 0) to some corners, m, one after the other."""
    segments = [{"line": {"xyz": (START + np.append(corner, 0.0)).tolist()}} for corner in corners]
    return trajcli.plan(
        {
            "version": 1,
            "robot": GANTRY,
            "limits": {"velocity": 9, "acceleration": 90, "tcp": {"speed": SPEED, "acceleration": 1.0}},
            "start": {"xyz": START.tolist()},
            "moves": [{"planner": "path", "corner": "stop", "segments": segments}],
        }
    )


def along(corners: Corners, s: Array) -> Array:
    """Return places (N, 3) at lengths of the way, of z = 0."""
    points = np.vstack([[0.0, 0.0], corners])
    reached = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    return np.stack([np.interp(s, reached, points[:, 0]), np.interp(s, reached, points[:, 1]), 0 * s], axis=1)


def deviations(
    corners: Corners,
    places: Array,
    joined: Interpolation = "hold",
    period: float = PERIOD,
    velocities: Array | None = None,
) -> list[Finding]:
    """Return where rows of the tool at places (N, 3), and what joins them, are beside the path."""
    made, count, exact = planned(corners), len(places), np.zeros(3)
    robot = made.moves[0].robot
    origin = forward(robot, np.zeros(3))[:3, 3]
    axes = np.stack([forward(robot, unit)[:3, 3] - origin for unit in np.eye(3)], axis=1)
    q, moves = (START + places - origin) @ axes, np.zeros(count, dtype=np.int64)
    resolution = Resolution(0.0, exact, exact, exact)
    qd = None if velocities is None else velocities @ axes
    t = period * np.arange(count)
    rows = RecordedMotion(t, q, qd, *(None,) * 3, moves, None, resolution, "rows", 1)
    required = Requirements(
        robot, interpolate=joined, tool=lambda: ToolJudge(robot, {0: made.moves[0].planned.tool})
    )
    found = judge_motion(lambda: (rows,), required).findings
    return [each for each in found if each.kind == "deviation"]


@pytest.mark.parametrize(
    ("spacing", "offset"),
    [
        *((0.025, offset) for offset in (0.05, 0.35, 0.5, 0.65, 0.95)),
        (0.011, 0.35),
        (0.011, 0.65),
        (0.002, 0.35),
    ],
)
def test_a_way_forth_and_back_is_gone_to_its_end(spacing: float, offset: float) -> None:
    """However the rows fall about the turn, and however far they are apart: what is behind the way back counts."""
    s = np.arange(0.3 - (int(0.3 / spacing) + offset - 1) * spacing, 0.8, spacing)
    places = along(TO_AND_FRO, s)
    assert deviations(TO_AND_FRO, places) == []
    row = len(s) - 3
    places[row, 2] += 3e-5
    assert [(each.row, each.value) for each in deviations(TO_AND_FRO, places)] == [
        (row + 1, pytest.approx(3e-5, rel=1e-6))
    ]


def test_a_leap_to_another_side_of_a_rectangle_is_found() -> None:
    """From one side to that across it the way is 0.5 m; twice 0.2 m, and what the law goes in a period, do not get there."""
    s = np.concatenate([np.linspace(0.0, 0.15, 40), np.linspace(0.65, 1.0, 80)])
    found = deviations(RECTANGLE, along(RECTANGLE, s))
    reach = (
        2 * 0.2 + SPEED * PERIOD
    )  # and some of the places at which the path is looked at first, 1 mm apart
    assert [(each.row, each.value) for each in found] == [(41, pytest.approx(0.5 - reach, abs=1.1e-2))]


@pytest.mark.parametrize(("standing", "before"), [(0, 0.0), (3, 0.0), (1, 1e-6), (1, 0.4e-4), (3, 0.8e-4)])
def test_a_loop_that_is_shorter_than_its_reach_is_gone_around(before: float, standing: int) -> None:
    """Where it crosses itself the first time the tool goes straight on, also after it stood right there."""
    s = np.arange(0.05 - before - 100 * 3e-4, 0.09, 3e-4)
    corners = 0.05 + 1e-3 * np.arange(1, 5)
    s = np.sort(np.concatenate([s, corners, np.full(standing, s[100])]))
    assert deviations(LOOP, along(LOOP, s), "linear") == []


@pytest.mark.parametrize("first", [0.0, 2e-4, 5e-4, 1.1e-3, 1.7e-3])
def test_rows_begin_in_the_first_lap(first: float) -> None:
    """The second one passes the same places, of which those that are looked at first are others."""
    laps = (*RECTANGLE, (0.31, 0.0), (0.31, 0.2), *RECTANGLE[2:])
    assert deviations(laps, along(laps, np.arange(first, 2.02, 0.01))) == []


@pytest.mark.parametrize("first", [0.0, 0.15, 0.31, 0.45])
def test_rows_may_begin_on_their_way(first: float) -> None:
    """Beside another part of the path, which is 4 mm away and passed before."""
    s = np.arange(first, 0.604, 0.004)
    assert deviations(HAIRPIN, along(HAIRPIN, s)) == []
    aside = along(HAIRPIN, s)
    aside[0, 1] += 1e-4
    assert [(each.row, each.value) for each in deviations(HAIRPIN, aside)] == [
        (1, pytest.approx(1e-4, rel=1e-6))
    ]


@pytest.mark.parametrize("spacing", [2e-5, 1e-4])
def test_dense_rows_get_from_place_to_place(spacing: float) -> None:
    """The path is looked at first at places that are many rows apart."""
    s = np.arange(0.0, 0.3, spacing)[:900]
    assert deviations(LINE, along(LINE, s), period=1e-4) == []


@pytest.mark.parametrize("offset", [0.1, 0.3, 0.7, 0.9])
def test_a_way_back_beside_the_way_there_is_told_from_it_by_where_it_is(offset: float) -> None:
    """It is 0.3 mm away, half of how far apart the places are at which the path is looked at first."""
    s = np.arange(offset * 3e-3, 0.6003, 3e-3)
    places = along(NARROW, s)
    assert deviations(NARROW, places) == []
    places[150, 1] -= 1e-4
    assert [(each.row, each.value) for each in deviations(NARROW, places)] == [
        (151, pytest.approx(1e-4, rel=1e-6))
    ]


@pytest.mark.parametrize("left", [0.15, 0.006, 0.003])
def test_a_curve_that_bulges_as_far_as_the_way_back_is_beside_the_way_there(left: float) -> None:
    """Cubics from v to -v across the line are h v / 4 beside it in their middle (Hermite)."""
    s = np.arange(0.0, 0.3 - left + 0.003, 0.002)
    velocities = np.tile([0.002 / PERIOD, 0.0, 0.0], (len(s), 1))
    velocities[-3:-1, 1] = 4 * 0.004 / PERIOD, -4 * 0.004 / PERIOD
    found = deviations(HAIRPIN, along(HAIRPIN, s), "cubic", velocities=velocities)
    worst = max(found, key=lambda each: each.value or 0.0)
    assert (worst.row, worst.value) == (len(s) - 2, pytest.approx(0.004, rel=1e-6))
