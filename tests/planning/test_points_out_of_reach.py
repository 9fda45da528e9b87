"""Points named where a line, an arc, a screw or a path cannot reach them, at the line of the point."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np
import pytest
from tiers import few

from trajcli.errors import PlanningError, Problem
from trajcli.geometry.paths.arc import Arc
from trajcli.job.read import job_from_text
from trajcli.planning.plan import plan_job

HEAD = """\
version: 1
units: {angle: deg, length: mm}
robot: ur5e
limits: {tcp: {speed: 250, acceleration: 1000, angular_speed: 90, angular_acceleration: 700}}
points:
  near: {xyz: [430, 150, 300], rpy: [180, 0, 0]}
  high: {xyz: [400, 100, 400], rpy: [180, 0, 0]}
  far: {xyz: [400, 1500, 300], rpy: [180, 0, 0]}
  bare: {xyz: [1400, 100, 300]}
start: {xyz: [400, 100, 300], rpy: [180, 0, 0], configuration: {elbow: up}}
moves:
"""
FAR, BARE = 8, 9


def refused(moves: str) -> Problem:
    with pytest.raises(PlanningError) as caught:
        plan_job(job_from_text(HEAD + moves, "job.yaml"))
    assert type(caught.value) is PlanningError
    (problem,) = caught.value.problems
    return problem


@pytest.mark.parametrize(
    ("move", "line", "name"),
    few(
        [
            ("{planner: line, to: far}", FAR, "far"),
            ("{planner: line, to: bare}", BARE, "bare"),
            ("{planner: line, to: far, law: {shape: time_optimal}, limits: {acceleration: 500}}", FAR, "far"),
            ("{planner: screw, to: far}", FAR, "far"),
            ("{planner: arc, via: far, to: near}", FAR, "far"),
            ("{planner: arc, via: near, to: far}", FAR, "far"),
            (
                "{planner: path, corner: stop, segments: [{line: near}, {line: bare}, {line: high}]}",
                BARE,
                "bare",
            ),
            ("{planner: path, radius: 5, segments: [{line: high}, {line: far}, {line: bare}]}", FAR, "far"),
            ("{planner: path, radius: 5, segments: [{line: high}, {arc: {via: near, to: far}}]}", FAR, "far"),
            (
                "{planner: path, corner: overlap, overlap: 0.1, segments: [{line: high}, {line: far}]}",
                FAR,
                "far",
            ),
        ],
        2,
    ),
)
def test_a_named_point_is_named_at_its_line(move: str, line: int, name: str) -> None:
    problem = refused(f"  - {move}\n")
    planner = move.split()[1].rstrip(",")
    assert re.match("move 0, -> [a-z]+ ", problem.message)
    assert f"({planner}): the point '{name}': UR5e does not reach the path" in problem.message
    assert " mm" in problem.message
    assert problem.place is not None
    assert (problem.place.line, problem.move) == (line, 0)


@pytest.mark.full
@pytest.mark.parametrize(
    ("move", "pointed"),
    few(
        [
            ("{planner: line, to: {xyz: [400, 1500, 300]}}", "{xyz: [400, 1500, 300]}"),
            ("{planner: line, to: {from: near, offset: {xyz: [0, 0, 2000]}}}", "{from: near"),
            (
                "{planner: path, radius: 5, segments: [{line: high}, {line: {xyz: [9e3, 0, 0]}}]}",
                "{xyz: [9e3",
            ),
        ],
        1,
    ),
)
def test_another_target_is_pointed_at(move: str, pointed: str) -> None:
    problem = refused(f"  - {{planner: hold, duration: 1}}\n  - {move}\n")
    assert "the point" not in problem.message
    assert problem.place is not None
    assert problem.place.line == 13
    assert problem.place.source[problem.place.column - 1 :].startswith(pointed)


@pytest.mark.full
def test_a_path_that_is_out_of_reach_between_its_points_names_none() -> None:
    problem = refused("  - {planner: arc, center: [400, 1000, 300], axis: z, angle: 180}\n")
    assert "the point" not in problem.message
    # through the column of the arm, where no wrist fits, from a point to a point that are both reached
    problem = refused("  - {planner: line, to: {xyz: [-400, -100, 300], rpy: [180, 0, 0]}}\n")
    assert "the point" not in problem.message


def test_where_an_arc_passes_its_via_point() -> None:
    arcs: Sequence[tuple[list[float], list[float], list[float]]] = (
        ([0, 0, 0], [1, 1, 0], [2, 0, 0]),
        ([0.3, 0.1, 0], [0.2, 0.5, 0.4], [-0.3, 0.2, 0.9]),
    )
    for start, via, end in arcs:
        arc = Arc.through(start, via, end)
        s = arc.s_of(np.array(via))
        np.testing.assert_allclose(arc.evaluate(np.array([s]))[0][0], via, atol=1e-12)
    arc = Arc(np.array([1.0, 0, 0]), np.zeros(3), np.array([0, 0, 1.0]), -2.0, 0.0)
    there = arc.evaluate(np.array([0.7]))[0][0]
    assert arc.s_of(there) == pytest.approx(0.7)


def test_a_pose_of_a_later_move_is_named_where_it_stands() -> None:
    """No point has its name: the second segment of the second move, behind a list of others."""
    away = "{xyz: [400, 1500, 300], rpy: [180, 0, 0]}"
    moves = f"  - {{planner: line, to: near}}\n  - planner: path\n    radius: 5\n    segments: [{{line: high}}, {{line: {away}}}]\n"
    problem = refused(moves)
    assert problem.move == 1
    assert problem.place is not None
    lines = (HEAD + moves).splitlines()
    assert problem.place.line == len(lines)
    assert lines[-1][problem.place.column - 1 :].startswith(away)


def test_a_path_between_points_in_reach_is_named_as_a_whole() -> None:
    """It passes too near to the base: neither of its ends is wrong."""
    line = "{planner: line, to: {xyz: [-430, -100, 300], rpy: [180, 0, 0]}}"
    problem = refused(f"  - {line}\n")
    assert "does not reach the path beyond" in problem.message
    assert problem.place is not None
    assert (problem.place.line, problem.place.column) == (len(HEAD.splitlines()) + 1, 5)
