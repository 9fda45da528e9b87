"""Curves between rows beside an arc: straight ones are the height of their chord inside of it, r (1 - cos(d / 2)).

Between rows that stand dense a straight line is only warned of, unless somebody asked for it; and not where the
rounding of rows explains it.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from judge.test_rows_beside_a_path import GANTRY, START
from judge.test_rows_beside_a_path import planned as planned_lines
from numpy.typing import NDArray

import trajcli
from trajcli.api.plans import PlannedJob
from trajcli.findings import Finding
from trajcli.grids import UniformGrid
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.judge.reconstruction import Interpolation
from trajcli.judge.recorded_tool import ToolJudge
from trajcli.kinematics.forward import forward
from trajcli.output.delivery.joined_rows import JoinedRows
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

Array = NDArray[np.float64]
RADIUS, NEAR, DENSE = 0.1, 1e-6, 4e-3
"""m, and s from row to row of dense rows; arcs promise to be as near as that."""


@cache
def planned(arcs: int, near: float = NEAR, duration: float = 0.3) -> PlannedJob:
    """Return the plan of quarter circles, each a move of its own."""
    moves = [
        {
            "planner": "arc",
            "center": (START + np.array([0.0, RADIUS, 0.0])).tolist(),
            "axis": [0.0, 0.0, 1.0],
            "angle": np.pi / 2,
            "law": {"shape": "quintic", "duration": duration},
            "tolerance": {"position": near},
        }
    ] * arcs
    limits = {"velocity": 9, "acceleration": 900}
    return trajcli.plan(
        {"version": 1, "robot": GANTRY, "limits": limits, "start": {"xyz": START.tolist()}, "moves": moves}
    )


def on_arc(angles: Array) -> Array:
    """Return places (N, 3) of the tool from its start on."""
    return START + RADIUS * np.stack([np.sin(angles), 1.0 - np.cos(angles), 0 * angles], axis=1)


def height(angle: float) -> float:
    """Return by how much the middle of a chord is inside."""
    return RADIUS * (1.0 - np.cos(angle / 2))


def deviations(
    t: Array,
    places: Array,
    joined: Interpolation | None = None,
    velocities: Array | None = None,
    off: tuple[float, float] = (0.0, 0.0),
    rates: float | None = None,
) -> list[Finding]:
    """Return where rows of the tool, and what joins them, are beside the arc.

    `off` are roundings, also relative ones; of velocities it may be another.
    """
    made, count = planned(1), len(places)
    robot = made.moves[0].robot
    origin = forward(robot, np.zeros(3))[:3, 3]
    axes = np.stack([forward(robot, unit)[:3, 3] - origin for unit in np.eye(3)], axis=1)
    half = np.full(3, off[0])
    of_rates = half if rates is None else np.full(3, rates)
    resolution = Resolution(0.0, half, of_rates, half, relative=(off[1],) * 3)
    qd = None if velocities is None else velocities @ axes
    moves = np.zeros(count, dtype=np.int64)
    rows = RecordedMotion(
        t, (places - origin) @ axes, qd, None, None, None, moves, None, resolution, "rows", 1
    )
    tools = {0: made.moves[0].planned.tool}
    required = Requirements(robot, interpolate=joined, tool=lambda: ToolJudge(robot, tools))
    found = judge_motion(lambda: (rows,), required).findings
    return [each for each in found if each.kind == "deviation"]


ANGLES = np.linspace(0.0, 1.5, 101)


@pytest.mark.parametrize(
    ("joined", "period", "severity"),
    [
        (None, DENSE, "warning"),
        (None, 0.0102, "error"),
        ("linear", DENSE, "error"),
        ("linear", 0.0102, "error"),
    ],
)
def test_chords_between_dense_rows_are_warned_of_unless_they_were_asked_for(
    joined: Interpolation | None, period: float, severity: str
) -> None:
    (found,) = deviations(period * np.arange(101), on_arc(ANGLES), joined)
    assert (found.severity, found.count, found.certainty) == (severity, 100, "exceeded")
    assert found.value == pytest.approx(height(0.015), rel=1e-6)


def test_chords_of_rows_among_which_one_is_late_are_no_warnings() -> None:
    t = DENSE * np.arange(101)
    t[50:] += 0.05
    (found,) = deviations(t, on_arc(ANGLES))
    assert found.severity == "error"


def test_cubics_between_dense_rows_that_bulge_are_no_warnings() -> None:
    """A velocity that is off by w puts the middles beside it off by w T / 8."""
    rate = 0.015 / DENSE * RADIUS
    velocities = rate * np.stack([np.cos(ANGLES), np.sin(ANGLES), 0 * ANGLES], axis=1)
    assert deviations(DENSE * np.arange(101), on_arc(ANGLES), None, velocities) == []
    velocities[30, 2] += 8 * 1e-4 / DENSE
    (found,) = deviations(DENSE * np.arange(101), on_arc(ANGLES), None, velocities)
    assert (found.severity, found.value) == ("error", pytest.approx(1e-4, rel=1e-3))


@pytest.mark.parametrize(
    ("off", "joined", "certainty"),
    [(4e-6, None, None), (4e-6, "linear", "within rounding"), (1e-7, None, "exceeded")],
)
def test_chords_that_rounding_explains_are_not_warned_of(
    off: float, joined: Interpolation | None, certainty: str | None
) -> None:
    """Rounding of three slides by so much each explains six times that, above what the path promises."""
    found = deviations(DENSE * np.arange(101), on_arc(ANGLES), joined, off=(off, 0.0))
    assert [each.certainty for each in found] == ([] if certainty is None else [certainty])


@pytest.mark.parametrize(("row", "certainty"), [(2, "exceeded"), (98, "within rounding")])
def test_relative_rounding_explains_more_of_rows_that_are_far_out(row: int, certainty: str) -> None:
    relative = 1e-5
    places = on_arc(ANGLES)
    sums = np.abs(places).sum(axis=1)
    slack = 2 * relative * sums
    places[row, 2] += NEAR + 0.5 * (slack[0] + slack[-1])
    (found,) = deviations(DENSE * np.arange(101), places, "hold", off=(0.0, relative))
    assert (found.row, found.certainty) == (row + 1, certainty)


def of_plan(plan: PlannedJob, rate: float, *, exact: bool = True) -> list[Finding]:
    """Return where straight lines between rows of a plan itself are beside the paths of its moves, by move."""
    judged = JoinedRows(
        plan, UniformGrid(plan.trajectory.duration, rate), ("t", "q"), exact=exact
    ).judgement()
    assert judged is not None
    found = [each for each in judged.findings if each.kind == "deviation"]
    return sorted(found, key=lambda each: each.move or 0)


@pytest.mark.parametrize(("arcs", "duration"), [(1, 0.3), (4, 0.1), (4, 0.7)])
def test_rows_at_ends_of_planned_moves_belong_to_both(arcs: int, duration: float) -> None:
    """Three rows each: the two chords of every move count, whatever rounding makes of the ends of moves."""
    for pieces in (1, 2):
        found = of_plan(planned(arcs, duration=duration), pieces / duration)
        numbers = [(each.move, each.row, each.count) for each in found]
        assert numbers == [(move, pieces * move + 1, pieces) for move in range(arcs)]
        for each in found:
            assert each.value == pytest.approx(height(np.pi / 2 / pieces), rel=1e-6)


@pytest.mark.parametrize("rate", [3, 7])
def test_what_joins_the_rows_of_two_planned_moves_is_on_the_path_of_neither(rate: int) -> None:
    """It cuts the corner between two lines, on which all else is."""
    assert of_plan(planned_lines(2, apart=True), rate) == []


@pytest.mark.parametrize(("less", "over"), [(1e-9, False), (2e-8, True)])
def test_rounding_of_planned_rows_explains_a_little(less: float, *, over: bool) -> None:
    """Nine decimals of three slides explain 3e-9: where the path promises little less than the height of a chord."""
    turned = [np.pi / 2 * (10 * u**3 - 15 * u**4 + 6 * u**5) for u in (0.5, 0.5 + 0.002 / 0.3)]
    plan = planned(1, height(turned[1] - turned[0]) - less)
    (found,) = of_plan(plan, 500)
    assert found.row in (75, 76)  # the chords on both sides of the middle are equal
    assert bool(of_plan(plan, 500, exact=False)) is over


@pytest.mark.parametrize(("off", "certain"), [(2e-4, False), (3e-2, True)])
def test_rounding_of_velocities_explains_what_a_cubic_between_rows_does(off: float, certain: bool) -> None:
    """Velocities off inwards and outwards in turns move the middle by a quarter of that in 60 ms: 3 um, or 0.45 mm."""
    t = 0.06 * np.arange(6)
    angles = 5.0 * t
    along = RADIUS * 5.0 * np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=1)
    aside = np.stack([-np.sin(angles), np.cos(angles), 0 * angles], axis=1) * (-1.0) ** np.arange(6)[:, None]
    (found,) = deviations(t, on_arc(angles), "cubic", along + off * aside, (1e-9, 0.0), rates=2e-4)
    assert (found.certainty == "exceeded") == certain
