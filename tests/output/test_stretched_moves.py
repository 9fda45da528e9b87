"""Moves that are all stretched alike: which of them are over a limit between rows, against scipy's curves."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pytest
from joined_by_scipy import largest_share
from random_jobs import loaded as job_of

from trajcli.output.delivery.joined_rows import JoinedRows
from trajcli.output.delivery.slower_motion import StretchedMoves
from trajcli.output.write import grid_of
from trajcli.planners.planner import PlannedMove
from trajcli.planning.adaptation import Adaptation
from trajcli.planning.plan import plan_job

SURE = 2e-3  # shares of a limit that are nearer to 1 than this may be missed by samples
ALIKE = {"velocity": 1.5, "acceleration": 4.0, "jerk": 60.0}
BY_DIRECTION = {
    "velocity": [[-2.0, 1.5], [-1.5, 2.0]],
    "acceleration": [[-9, 4], [-4, 9]],
    "jerk": [[-90, 60], [-60, 90]],
}
THERE_AND_BACK = ([1, -0.4], [0.1, 0.3])
Said = list[tuple[bool, float]]


def said_of(
    moves: Sequence[dict[str, Any]],
    limits: Mapping[str, Any],
    columns: Sequence[str],
    rate: float,
    factors: Sequence[float],
    start: float = 0.0,
) -> Said:
    """Return for each factor whether stretched moves are said to be over a limit, and the share that scipy finds."""
    loaded = job_of(
        {
            "version": 1,
            "robot": {"joints": 2},
            "limits": dict(limits),
            "start": {"joints": [start, start]},
            "moves": list(moves),
            "output": {"rate": rate, "columns": ["t", *columns], "align": True},
            "when_over_limit": "slow",
        }
    )
    known: dict[Any, PlannedMove] = {}
    plan = plan_job(loaded, adapted=Adaptation(fastest=known))
    stretched, said = (
        StretchedMoves(JoinedRows(plan, grid_of(plan), ("t", *columns), exact=True), rate, known),
        [],
    )
    for factor in factors:
        stretches = dict.fromkeys(range(len(moves)), factor)
        slower = plan_job(loaded, adapted=Adaptation(stretches=stretches, fastest=known))
        said.append((stretched.are_over(factor), largest_share(slower, grid_of(slower), 1e-6)))
    return said


@pytest.mark.parametrize("columns", [("q", "qd"), ("q", "qd", "qdd")])
@pytest.mark.parametrize("limits", [ALIKE, BY_DIRECTION], ids=["alike", "by direction"])
@pytest.mark.parametrize("planner", ["trapezoid", "jerk_limited"])
@pytest.mark.parametrize("targets", [THERE_AND_BACK, [joints[::-1] for joints in THERE_AND_BACK]])
def test_moves_are_said_to_be_over_where_scipys_curve_is(
    planner: str, limits: Mapping[str, Any], columns: Sequence[str], targets: Sequence[list[float]]
) -> None:
    """The breaks of either lie between rows, where Hermite curves swing out."""
    if planner == "trapezoid":
        limits = {name: limit for name, limit in limits.items() if name != "jerk"}
    moves = [{"planner": planner, "to": {"joints": joints}} for joints in targets]
    said = said_of(moves, limits, columns, 23.0, (1.0, 1.05, 1.1, 1.2))
    assert [over for over, _ in said] == [share > 1 + SURE for _, share in said]
    assert [over for over, _ in said] != [False] * 4


def test_a_velocity_alone_that_swings_out_counts() -> None:
    """Ramps of little more than an interval; the acceleration is far below its limit."""
    moves = [{"planner": "jerk_limited", "to": {"joints": joints}} for joints in ([4, -1], [0, 0.3])]
    limits = {"velocity": 1.5, "acceleration": 1000, "jerk": 1000}
    said = said_of(moves, limits, ("q", "qd"), 17.0, (1.0, 1.05))
    assert [over for over, _ in said] == [share > 1 + SURE for _, share in said] == [True, False]


def test_the_row_between_two_moves_states_how_the_second_begins() -> None:
    """Cubics without a break inside: what swings out is the last interval, by the step of acceleration behind it."""
    moves = [{"planner": "cubic", "to": {"joints": joints}, "duration": 1.0} for joints in THERE_AND_BACK]
    said = said_of(moves, {"acceleration": 6.12}, ("q", "qd", "qdd"), 50.0, (1.0, 1.1))
    assert [over for over, _ in said] == [share > 1 + SURE for _, share in said] == [True, False]


def test_positions_alone_are_joined_by_lines_that_are_never_faster() -> None:
    moves = [{"planner": "jerk_limited", "to": {"joints": joints}} for joints in THERE_AND_BACK]
    assert not any(over for over, _ in said_of(moves, ALIKE, ("q",), 23.0, (1.0, 1.05)))


def test_rounding_of_far_positions_is_no_jerk() -> None:
    """A quintic's jerk is 60 / T^3 at its ends; at 1000 rad, 4000 rows a second, the last bits of rows add to it."""
    start, far, jerk = 1000.0, [1001.0, 1001.1], 60 / 0.2**3
    moves = [{"planner": "quintic", "to": {"joints": to}, "duration": 0.2} for to in (far, [start, start])]
    limits = {"jerk": [jerk, 1.1 * jerk]}
    ((over, share),) = said_of(moves, limits, ("q", "qd", "qdd"), 4000.0, (1.0,), start)
    assert 1 + 3e-6 < share < 1 + 1e-3
    assert not over
