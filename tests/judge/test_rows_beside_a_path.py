"""A tool on three slides beside the lines of a job: its place is a linear function of the joints, known by hand."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import trajcli
from trajcli.api.plans import PlannedJob
from trajcli.findings import Finding
from trajcli.judge.motion import Requirements, judge_motion
from trajcli.judge.recorded_tool import ToolJudge
from trajcli.kinematics.forward import forward
from trajcli.streams.recorded_motion import RecordedMotion, Resolution

GANTRY = {
    "convention": "standard",
    "joints": [
        {"type": "prismatic", "alpha": -np.pi / 2},
        {"type": "prismatic", "theta": -np.pi / 2, "alpha": -np.pi / 2},
        {"type": "prismatic"},
    ],
}
START = np.array([0.1, 0.2, 0.3])
CORNERS = START + np.array([[0.3, 0.0, 0.0], [0.3, 0.2, 0.0], [0.0, 0.2, 0.0], [0.0, 0.0, 0.0]])
SLACK, PERIOD = 1e-6, 0.02
"""m and s: how near a tool that follows a path promises to be, and from row to row."""


@cache
def planned(corners: int, near: float | None = None, *, apart: bool = False) -> PlannedJob:
    """Return the plan of a line along x, or of the first sides of a rectangle.

    Args:
        corners: How many sides.
        near: Tolerance of the position, m; None for what any path has.
        apart: Whether each side is a move of its own.
    """
    segments = [{"line": {"xyz": corner.tolist()}} for corner in CORNERS[:corners]]
    tolerance = {} if near is None else {"tolerance": {"position": near}}
    parts = [[segment] for segment in segments] if apart else [segments]
    return trajcli.plan(
        {
            "version": 1,
            "robot": GANTRY,
            "limits": {"velocity": 9, "acceleration": 90, "tcp": {"speed": 0.2, "acceleration": 1.0}},
            "start": {"xyz": START.tolist()},
            "moves": [{"planner": "path", "corner": "stop", "segments": part} | tolerance for part in parts],
        }
    )


def deviations(
    places: np.ndarray,
    corners: int = 1,
    velocities: np.ndarray | None = None,
    off: np.ndarray | None = None,
    blocks: int = 1000,
    near: float | None = None,
    moves: np.ndarray | None = None,
) -> list[Finding]:
    """Return where rows of the tool, and what joins them, are beside the path, in order of rows."""
    made = planned(corners, near, apart=moves is not None)
    owner = np.zeros(len(places), dtype=np.int64) if moves is None else moves
    robot = made.moves[0].robot
    count, exact = len(places), np.zeros(3) if off is None else off
    origin = forward(robot, np.zeros(3))[:3, 3]
    axes = np.stack([forward(robot, unit)[:3, 3] - origin for unit in np.eye(3)], axis=1)
    q = (places - origin) @ axes
    qd = None if velocities is None else velocities @ axes
    rows = [
        RecordedMotion(
            PERIOD * np.arange(low, min(low + blocks, count)),
            q[low : low + blocks],
            None if qd is None else qd[low : low + blocks],
            None,
            None,
            None,
            owner[low : low + blocks],
            None,
            Resolution(0.0, exact, exact, exact),
            "rows",
            low + 1,
        )
        for low in range(0, count, blocks)
    ]
    required = Requirements(
        robot, tool=lambda: ToolJudge(robot, {move.index: move.planned.tool for move in made.moves})
    )
    found = judge_motion(lambda: rows, required).findings
    return [each for each in found if each.kind == "deviation"]


def along(corners: int, count: int = 61) -> np.ndarray:
    """Return places (N, 3) at equal distances along the first sides of the rectangle."""
    points = np.vstack([START, CORNERS[:corners]])
    s = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    here = np.linspace(0.0, s[-1], count)
    return np.stack([np.interp(here, s, points[:, k]) for k in range(3)], axis=1)


@pytest.mark.parametrize(
    ("corners", "rows", "blocks"), [(1, 141, 60), (2, 101, 1000), (4, 161, 60), (4, 61, 1000)]
)
def test_rows_on_the_path_are_beside_it_nowhere(corners: int, rows: int, blocks: int) -> None:
    """The last ones are four times as fast as the plan."""
    assert deviations(along(corners, rows), corners, blocks=blocks) == []


@pytest.mark.parametrize("axis", [1, 2])
@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("row", [0, 1, 20, 39, 40])
def test_a_row_beside_the_line_is_found_by_how_much(row: int, sign: int, axis: int) -> None:
    for by, over in ((0.9 * SLACK, False), (1.1 * SLACK, True), (5e-4, True)):
        places = along(1, 41)
        places[row, axis] += sign * by
        found = [(each.row, each.value, each.limit, each.time, each.certainty) for each in deviations(places)]
        wanted = (row + 1, pytest.approx(by, rel=1e-6), SLACK, pytest.approx(PERIOD * row), "exceeded")
        assert found == ([wanted] if over else [])


@pytest.mark.parametrize(("row", "by"), [(0, -2e-4), (60, 2e-4)])
def test_a_row_before_the_start_or_behind_the_end_is_beside_the_line(row: int, by: float) -> None:
    places = along(1)
    places[row, 0] += by
    (found,) = deviations(places)
    assert (found.row, found.value) == (row + 1, pytest.approx(abs(by), rel=1e-6))


@pytest.mark.parametrize(("piece", "blocks"), [(0, 60), (1, 1000), (59, 60), (60, 60), (69, 1000), (139, 60)])
@pytest.mark.parametrize("sign", [1, -1])
def test_what_bulges_between_rows_on_the_line_is_found_in_the_middle(
    sign: int, piece: int, blocks: int
) -> None:
    """Cubics from v to -v across the line are h v / 4 beside it in their middle (Hermite)."""
    places = along(1, 141)
    velocities = np.zeros_like(places)
    velocities[:, 0] = (places[1, 0] - places[0, 0]) / PERIOD
    velocities[piece, 2], velocities[piece + 1, 2] = sign * 0.01, -sign * 0.01
    bulge = PERIOD * 0.01 / 4
    found = deviations(places, 1, velocities, blocks=blocks)
    assert [(each.row, each.value) for each in found] == [(piece + 1, pytest.approx(bulge, rel=1e-6))]
    assert found[0].time == pytest.approx(PERIOD * (piece + 0.5))


@pytest.mark.parametrize("side", [0, 2])
def test_what_bulges_to_the_other_side_of_the_rectangle_is_beside_its_own(side: int) -> None:
    """The middle between two rows is on the path, 0.2 m across from its rows and 0.15 m from the sides at their corners."""
    places, piece = along(4, 201), 30 + 50 * side
    velocities = np.zeros_like(places)
    velocities[piece, 1] = (1 - side) * 4 * 0.2 / PERIOD
    velocities[piece + 1, 1] = -velocities[piece, 1]
    (found,) = deviations(places, 4, velocities)
    assert found.row == piece + 1
    assert 0.1475 <= (found.value or 0.0) <= 0.2 * (1 + 1e-9)


def test_the_rectangle_is_driven_in_its_order() -> None:
    """Backward around it, or across it from one corner to the next but one, rows are not where the tool goes."""
    assert deviations(along(4, 201)[::-1], 4)
    places = along(4, 201)
    places[75:150] = places[75] + np.linspace(0, 1, 75)[:, None] * (START - places[75])
    assert max(each.value or 0.0 for each in deviations(places, 4)) > 0.05


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("corner", range(4))
def test_each_side_of_the_rectangle_has_its_own_direction(corner: int, sign: int) -> None:
    """A row in the middle of a side is moved across it, in the plane: to the inside or to the outside."""
    places = along(4, 201)
    ends = np.vstack([START, CORNERS])
    middle, way = 0.5 * (ends[corner] + ends[corner + 1]), ends[corner + 1] - ends[corner]
    row = int(np.linalg.norm(places - middle, axis=1).argmin())
    places[row] += sign * 2e-4 * np.cross(way / np.linalg.norm(way), [0.0, 0.0, 1.0])
    (found,) = deviations(places, 4)
    assert (found.row, found.value) == (row + 1, pytest.approx(2e-4, rel=1e-6))


@pytest.mark.parametrize("order", [[0, 1, 2], [1, 2, 0], [2, 0, 1]])
def test_rounding_of_all_joints_together_explains_how_far_the_tool_is_off(order: list[int]) -> None:
    """Every joint is off by its half unit: that much is explained; ten times as much is by no rounding."""
    off = np.array([1e-5, 2e-5, 4e-5])[order]
    for factor, certainty in ((1.0, "within rounding"), (10.0, "exceeded")):
        places = along(1)
        places[30] += factor * off
        (found,) = deviations(places, off=off)
        assert (found.row, found.certainty) == (31, certainty)


@pytest.mark.parametrize(("by", "over"), [(0.9e-4, False), (1.1e-4, True)])
def test_a_path_may_promise_another_distance(by: float, *, over: bool) -> None:
    places = along(1)
    places[30, 1] += by
    found = deviations(places, near=1e-4)
    assert [(each.row, each.limit) for each in found] == ([(31, 1e-4)] if over else [])


@pytest.mark.parametrize("last", [30, 36])
def test_what_joins_the_rows_of_two_moves_is_on_the_path_of_neither(last: int) -> None:
    """The corner is between two rows, and cut. A row of the second move counts for its own line alone."""
    places = along(2, 61)  # 0.3 m and 0.2 m: the corner is at row 36
    places = np.delete(places, 36, axis=0)
    velocities = np.gradient(places, PERIOD, axis=0)
    velocities[[34, 35, 36, 37]] = (places[36] - places[35]) / PERIOD
    velocities[34], velocities[37] = [0.4, 0.0, 0.0], [0.0, 0.4, 0.0]
    moves = (np.arange(60) >= last).astype(np.int64)
    found = [each for each in deviations(places, 2, velocities, moves=moves) if each.row not in (35, 37)]
    assert bool(found) is (last == 30)


@pytest.mark.parametrize("by", [1e-5, 2e-4, 4e-4])
@pytest.mark.parametrize("corner", [0, 1, 2])
def test_rows_right_beside_a_corner_are_on_its_sides(corner: int, by: float) -> None:
    """Nearer to it than the places where the path is looked at first; a row across it is off by how far it is."""
    places, ends = along(4, 401), np.vstack([START, CORNERS])
    row = int(np.linalg.norm(places - ends[corner + 1], axis=1).argmin())
    for k, end in ((row - 1, corner), (row + 1, corner + 2)):
        way = ends[end] - ends[corner + 1]
        places[k] = ends[corner + 1] + by * way / np.linalg.norm(way)
    places, row = places[row - 40 : row + 40], 40
    assert deviations(places, 4) == []
    places[row - 1] += [0.0, 0.0, 3e-5]
    assert [(each.row, each.value) for each in deviations(places, 4)] == [
        (row, pytest.approx(3e-5, rel=1e-6))
    ]


@pytest.mark.parametrize("blocks", [1000, 40])
@pytest.mark.parametrize("back", [5, 45])
def test_a_tool_that_goes_back_on_its_line_is_on_it(back: int, blocks: int) -> None:
    """By 5 mm a row, which is many of the places at which the path is looked at first; aside it is found there, too."""
    forth = along(1)
    places = np.concatenate([forth[:46], forth[45 - back : 45][::-1], forth[45 - back :]])
    assert deviations(places, blocks=blocks) == []
    places[48, 2] += 3e-5
    assert [(each.row, each.value) for each in deviations(places, blocks=blocks)] == [
        (49, pytest.approx(3e-5, rel=1e-6))
    ]
