"""Distances along paths, and rates of several tools, beside joints: each move by its own path, promise and tool.

A line of a UR5e is driven twice, and its distances stand beside the joints; one link carries two tools, whose
velocities and accelerations are those of a point on a wheel: w k x p, and w' k x p - w^2 p.
"""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from line_of_ur5e import plan

from trajcli.columns import parse_column
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.findings import Finding
from trajcli.judge.rows.tool_rows import ArmsOfMoves
from trajcli.judge.tool_columns import ToolTable, judge_tool_columns
from trajcli.kinematics.following.motion import ToolMotion
from trajcli.kinematics.following.tolerance import Tolerance
from trajcli.kinematics.robot import Joint, MountedTool, Robot, unlimited
from trajcli.streams.recorded_motion import RecordedMotion, Resolution, blocks_of_size

PERIOD, COUNT, SIZE = 0.008, 250, 100
TIMES = PERIOD * np.arange(COUNT)
LAST = np.eye(6)[5]


def judged(
    arms: ArmsOfMoves,
    q: np.ndarray,
    names: str,
    values: np.ndarray,
    moves: np.ndarray,
    tolerance: Tolerance | None = None,
    paths: dict[int, ToolMotion | None] | None = None,
    halves: np.ndarray | None = None,
) -> list[Finding]:
    """Return what columns beside joints are found to be wrong, in blocks of a hundred rows."""
    nothing = np.zeros(q.shape[1])
    blocks = [
        RecordedMotion(
            PERIOD * np.arange(low, low + len(q[low : low + SIZE])),
            q[low : low + SIZE],
            *(None,) * 4,
            moves[low : low + SIZE],
            None,
            Resolution(0.0, nothing, nothing, nothing),
            "rows",
            low + 1,
        )
        for low in range(0, len(q), SIZE)
    ]
    columns = tuple(parse_column(name) for name in names.split())
    of_columns = np.zeros(len(columns)) if halves is None else halves
    table = ToolTable(columns, of_columns, lambda: blocks_of_size([values], SIZE))
    of_plan = plan().moves[0].planned.tool
    if tolerance is not None:
        driven_along = dict.fromkeys(range(3), replace(of_plan, tolerance=tolerance))
        return judge_tool_columns(blocks, table, arms, driven_along, arms)
    return judge_tool_columns(blocks, table, arms, paths, arms)


def along(q: np.ndarray, s: np.ndarray, tolerance: Tolerance) -> list[Finding]:
    """Return what distances along the line, and their rates, (N, 3), are found to be wrong; it is driven anew each time."""
    moves = np.repeat(np.arange(len(q) // COUNT), COUNT)
    return judged(ArmsOfMoves(plan().moves[0].robot, []), q, "s sd sdd", s, moves, tolerance)


def driven(times: int) -> tuple[np.ndarray, np.ndarray]:
    """Return joints (N, 6) along the line, so many times one after the other, and s with its rates (N, 3)."""
    law = plan().moves[0].planned.tool.law
    s = np.concatenate([law.evaluate(TIMES, order) for order in range(3)], axis=1)
    return np.tile(plan().trajectory.curve.evaluate(TIMES), (times, 1)), np.tile(s, (times, 1))


@pytest.mark.parametrize(("position", "angle"), [(1e-6, 1e-3), (1e-3, 1e-6), (1e-6, 1e-6)])
def test_a_tool_is_turned_from_its_path_by_more_than_that_promises_of_angles(
    position: float, angle: float
) -> None:
    """The last joint turns the tool where it is."""
    q, s = driven(1)
    for turned in (5e-4, -2e-3):
        beside = q.copy()
        beside[60] += turned * LAST
        found = along(beside, s, Tolerance(position, angle))
        assert [each.quantity for each in found] == ["orientation"] * (abs(turned) > angle)
        assert [(each.row, each.move) for each in found] == [(61, 0)] * len(found)
        assert [each.value for each in found] == [pytest.approx(abs(turned), rel=1e-2)] * len(found)


@pytest.mark.parametrize("position", [1e-3, 1e-6])
def test_a_tool_is_beside_its_path_by_more_than_that_promises_of_distances(position: float) -> None:
    q, s = driven(1)
    for off in (5e-4, -2e-3):
        beside = s.copy()
        beside[60, 0] += off  # s is that far from where the joints are
        found = [each for each in along(q, beside, Tolerance(position, 1e-6)) if each.kind == "tool"]
        assert [each.quantity for each in found] == ["position"] * (abs(off) > position)
        assert [each.value for each in found] == [pytest.approx(abs(off), rel=1e-2)] * len(found)


@pytest.mark.parametrize("order", [1, 2])
@pytest.mark.parametrize("wrong", [None, 0, 1, 2])
def test_each_move_has_a_law_of_its_own(wrong: int | None, order: int) -> None:
    """A distance begins anew in each move; a rate, or its rate, that is too large by a tenth is found in its own."""
    q, s = driven(3)
    if wrong is not None:
        s[wrong * COUNT : (wrong + 1) * COUNT, order] *= 1.1
    found = along(q, s, Tolerance())
    assert {(each.kind, each.move) for each in found} == (
        {("derivative", wrong)} if wrong is not None else set()
    )


@pytest.mark.parametrize(("rates", "on_path"), [((0.0, -1.0), True), ((0.1, 0.0), True), ((0.0, 0.0), False)])
@pytest.mark.parametrize("row", [40, 150, 200])
def test_a_row_that_only_begins_to_stand_at_the_border_of_a_zone_is_on_its_path(
    row: int, rates: tuple[float, float], *, on_path: bool
) -> None:
    """In a zone a distance stands: it has neither a velocity nor an acceleration, and the tool may be turned there."""
    q, s = driven(1)
    of_plan, tolerance = plan().moves[0].planned.tool, Tolerance(1e-3, 1e-6)
    law = of_plan.law
    until = PiecewisePolynomial(law.breaks, law.coefficients * (s[row, 0] / of_plan.path.length))
    q[row] += 5e-4 * LAST
    s[row, 1:] = rates
    arms = ArmsOfMoves(plan().moves[0].robot, [])
    path = replace(of_plan, law=until, tolerance=tolerance)
    found = judged(arms, q, "s sd sdd", s, np.zeros(COUNT, dtype=int), paths={0: path})
    turned = [(each.row, each.value) for each in found if each.quantity == "orientation"]
    assert turned == ([(row + 1, pytest.approx(5e-4, rel=1e-2))] if on_path else [])


@pytest.mark.parametrize("share", [0.9, -0.9, 1.1, -1.1, 2.0, -2.0])
def test_a_distance_that_stands_in_a_zone_is_that_of_its_border(share: float) -> None:
    """As near as the path promises to be to its places."""
    q, s = driven(1)
    of_plan, row, near = plan().moves[0].planned.tool, 150, 1e-3
    until = PiecewisePolynomial(
        of_plan.law.breaks, of_plan.law.coefficients * (s[row, 0] / of_plan.path.length)
    )
    s[row] = s[row, 0] + share * near, 0.0, 0.0
    arms = ArmsOfMoves(plan().moves[0].robot, [])
    path = replace(of_plan, law=until, tolerance=Tolerance(near, 1e-3))
    found = judged(arms, q, "s sd sdd", s, np.zeros(COUNT, dtype=int), paths={0: path})
    told = [(each.row, each.value) for each in found if each.quantity == "position" and each.kind == "tool"]
    assert told == ([(row + 1, pytest.approx(abs(share) * near, rel=1e-6))] if abs(share) > 1 else [])


@pytest.mark.parametrize("off", [0.0, 2e-3, -2e-3])
def test_decimals_of_the_second_derivative_of_a_distance_say_nothing_of_the_first(off: float) -> None:
    """One is known to 0.05 m/s^2, the other one exactly."""
    q, s = driven(1)
    s[:, 2] += 0.04 * np.cos(np.arange(COUNT))
    s[:, 1] += off
    arms = ArmsOfMoves(plan().moves[0].robot, [])
    path = replace(plan().moves[0].planned.tool, tolerance=Tolerance(1e-3, 1e-3))
    moves, halves = np.zeros(COUNT, dtype=int), np.array([0.0, 0.0, 0.05])
    found = judged(arms, q, "s sd sdd", s, moves, paths={0: path}, halves=halves)
    assert ("derivative" in {each.kind for each in found}) is (off != 0.0)


@pytest.mark.parametrize("cut", [0, 1])
@pytest.mark.parametrize("row", [30, 90])
def test_a_path_whose_corners_are_cut_says_nothing_of_another_move(row: int, cut: int) -> None:
    """Of two moves in the same rows the distances of one are judged alone."""
    q, s = driven(2)
    s[[COUNT - row, COUNT + row], 0] += 5e-3
    path = replace(plan().moves[0].planned.tool, tolerance=Tolerance(1e-4, 1e-4))
    paths = {cut: replace(path, overlaps=True), 1 - cut: path}
    arms = ArmsOfMoves(plan().moves[0].robot, [])
    found = judged(arms, q, "s sd sdd", s, np.repeat([0, 1], COUNT), paths=paths)
    told = [(each.move, each.row) for each in found if each.quantity == "position" and each.kind == "tool"]
    assert told == [(0, COUNT - row + 1) if cut else (1, COUNT + row + 1)]


@pytest.mark.parametrize("off", [0.0, 2e-9, -2e-9])
@pytest.mark.parametrize("part", [0, 1])
@pytest.mark.parametrize("moves", [[0, 1], [1, 0]])
def test_a_move_without_a_path_has_no_distance_along_one(moves: list[int], part: int, off: float) -> None:
    """Neither a distance forward nor one back; of whichever number the moves are."""
    q, s = driven(2)
    s[:] = 0.0
    s[part * COUNT + 50, 0] = off
    arms = ArmsOfMoves(plan().moves[0].robot, [])
    found = judged(arms, q, "s sd sdd", s, np.repeat(moves, COUNT), paths={0: None, 1: None})
    assert [(each.quantity, each.move, each.row) for each in found] == (
        [("position", moves[part], part * COUNT + 51)] if off else []
    )


@pytest.mark.parametrize("moves", [[0, 1], [1, 0]])
def test_a_path_ends_where_another_move_begins_whichever_number_that_has(moves: list[int]) -> None:
    """Of two moves in one block of rows the first one has a path, and the second one none."""
    q, s = driven(2)
    s[COUNT:] = 0.0
    s[COUNT + 10, 0] = 1e-3
    paths = {moves[0]: plan().moves[0].planned.tool, moves[1]: None}
    arms = ArmsOfMoves(plan().moves[0].robot, [])
    found = judged(arms, q, "s sd sdd", s, np.repeat(moves, COUNT), paths=paths)
    assert [(each.quantity, each.move, each.row) for each in found] == [("position", moves[1], COUNT + 11)]


@pytest.mark.parametrize("to", [2e-3, -2e-3])
@pytest.mark.parametrize("move", [0, 1])
def test_a_distance_that_jumps_is_found(move: int, to: float) -> None:
    """The path promises so little that its rows are on it before and behind the jump."""
    q, s = driven(2)
    at = move * COUNT + 50
    s[at : (move + 1) * COUNT, 0] += to
    (found,) = along(q, s, Tolerance(1e-2, 1e-2))
    assert (found.kind, found.severity, found.row, found.move) == ("jump", "error", at, move)
    assert found.value == pytest.approx(s[at, 0] - s[at - 1, 0], abs=1e-12)


@pytest.mark.parametrize("term", [None, "along", "inward"])
def test_rates_of_several_tools_are_those_of_the_points_of_a_wheel(term: str | None) -> None:
    """One that leaves out what turns faster, or what pulls inward, is found."""
    lever, further = 0.5, np.array([0.2, 0.1, 0.05])
    both = Joint("turn", "revolute", a=lever), Joint("slide", "prismatic")
    link = Robot("link", both, unlimited(2), "standard", np.eye(4), np.eye(4))
    tool = np.eye(4)
    tool[:3, 3] = further
    arms = ArmsOfMoves(link, [SimpleNamespace(index=1, robot=link.with_tool(MountedTool(tool)))])
    angle, rate, change = 3 * np.sin(TIMES), 3 * np.cos(TIMES), -3 * np.sin(TIMES)
    moves = (np.arange(COUNT) > 120).astype(int)
    out = np.stack([lever + further[0] * moves, further[1] * moves], axis=1)
    p = np.stack(
        [
            np.cos(angle) * out[:, 0] - np.sin(angle) * out[:, 1],
            np.sin(angle) * out[:, 0] + np.cos(angle) * out[:, 1],
            0 * angle,
        ],
        axis=1,
    )
    k_x_p = np.stack([-p[:, 1], p[:, 0], 0 * angle], axis=1)
    faster, inward = change[:, None] * k_x_p, -(rate**2)[:, None] * p
    linear = (term != "along") * faster + (term != "inward") * inward
    spin, spun = (each[:, None] * np.array([0.0, 0.0, 1.0]) for each in (rate, change))
    values = np.hstack([rate[:, None] * k_x_p, spin, linear, spun])
    q = np.stack([angle, 0 * angle], axis=1)
    found = judged(arms, q, "vx vy vz wx wy wz ax ay az ex ey ez", values, moves)
    assert {each.kind for each in found} == (set() if term is None else {"derivative"})
