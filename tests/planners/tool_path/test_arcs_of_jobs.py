"""Arcs and upright lines as jobs give them: circles through points of any form, refusals at the field that is wrong."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from tool_jobs import START, arm, line, plan, poses_of, refusal, rows, times_of

from trajcli.kinematics.forward import forward

SLOW: dict[str, Any] = {"law": {"shape": "quintic", "duration": 3}}
HERE = np.array([0.4, 0.1, 0.05])


def beside(x: float, y: float, z: float) -> np.ndarray:
    """Return a point beside the start."""
    return HERE + np.array([x, y, z])


def arc(**fields: Any) -> dict[str, Any]:
    return {"planner": "arc", **SLOW, **fields}


def away_from_circle(points: np.ndarray, a: np.ndarray, b: np.ndarray, c: np.ndarray) -> np.ndarray:
    """Return how far points (N, 3) are from the circle through three: the center is as far from each of them."""
    axis = np.cross(b - a, c - a)
    sides = np.stack([b - a, c - a, axis])
    center = np.linalg.solve(sides, [(b - a) @ (b + a) / 2, (c - a) @ (c + a) / 2, axis @ a])
    out = np.linalg.norm(points - center, axis=1) - np.linalg.norm(a - center)
    return np.hypot(out, (points - a) @ (axis / np.linalg.norm(axis)))


@pytest.mark.parametrize("form", ["joints", "offset", "xyz"])
def test_the_point_that_an_arc_passes_is_given_as_any_other(form: str) -> None:
    to = beside(0.1, 0.1, 0.0)
    via = beside(0.09, 0.02, 0.03)
    if form == "joints":
        first = plan("ur5e", START, line({"xyz": rows(via)}, **SLOW), limits={"jerk": None})
        point: dict[str, Any] = {"joints": rows(first.trajectory.end.position)}
    else:
        point = {"xyz": rows(via)} if form == "xyz" else {"from": "here", "offset": {"xyz": rows(via - HERE)}}
        point |= {"frame": "world"} if form == "offset" else {}
    made = plan("ur5e", START, arc(via=point, to={"xyz": rows(to)}), limits={"jerk": None})
    places = poses_of(made, times_of(made, 2001))[:, :3, 3]
    assert away_from_circle(places, HERE, via, to).max() < 2e-6
    assert np.linalg.norm(places - via, axis=1).min() < 2e-4
    assert places[-1] == pytest.approx(to, abs=2e-6)


@pytest.mark.parametrize("field", ["via", "to"])
def test_no_point_of_an_arc_is_passed_at_a_given_speed(field: str) -> None:
    fields = {"via": {"xyz": rows(beside(0.1, 0, 0))}, "to": {"xyz": rows(beside(0.1, 0.1, 0))}}
    fields[field]["velocity"] = 0.1
    (problem,) = refusal("ur5e", START, arc(**fields)).problems
    assert "an arc ends at rest" in problem.text()
    assert problem.place is not None
    behind_to = problem.place.column > problem.place.source.index('"to"')
    assert behind_to == (field == "to")


@pytest.mark.parametrize("by", [0.0, 3e-5])
def test_a_center_beside_its_circle_is_moved_and_that_is_said(by: float) -> None:
    center = beside(0.1 + by, 0.0, 0.0)
    move = arc(center=rows(center), axis="z", to={"xyz": rows(beside(0.2, 0.0, 0.0))})
    made = plan("ur5e", START, move, limits={"jerk": None})
    events = [event for event in made.events if event.kind == "moved_center"]
    assert [event.text() for event in events] == [
        "the center of the arc was moved by 3e-05 m to fit its ends"
    ] * (by > 0)
    circle = poses_of(made, times_of(made))[:, :3, 3] - (beside(0.1, 0.0, 0.0))
    assert np.linalg.norm(circle, axis=1) == pytest.approx(0.1, abs=1e-6 + by)


FAR, SAID = np.array([0.45, 0.1, 0.0]), {"through": (0.3, 4.5), "via": (2.2, 4.5), "to": (0.3, 3.0)}


@pytest.mark.parametrize("name", SAID)
def test_of_an_arc_out_of_reach_the_first_point_that_is_so_is_named(name: str) -> None:
    """Neither, where the arm reaches both points and not what is between them: 0.5 m is the reach of planar2r."""
    start = np.array([0.4, 0.0, 0.0])
    x, y = start - FAR, np.cross([0, 0, 1], start - FAR)
    via, to = (FAR + np.cos(turn) * x + np.sin(turn) * y for turn in SAID[name])
    beyond = [np.linalg.norm(point) > 0.5 for point in (via, to)]
    assert beyond == [name == "via", name == "to"]
    move = arc(via={"xyz": rows(via)}, to={"xyz": rows(to)})
    (problem,) = refusal("planar2r", {"xyz": rows(start)}, move).problems
    assert "does not reach" in problem.text()
    assert problem.field == (None if name == "through" else (name,))


@pytest.mark.parametrize("up", [0.1, -0.02])
def test_an_upright_line_is_one(up: float) -> None:
    made = plan("ur5e", START, line({"xyz": rows(beside(0, 0, up))}, **SLOW), limits={"jerk": None})
    places = poses_of(made, times_of(made))[:, :3, 3]
    assert places[-1] == pytest.approx(beside(0, 0, up), abs=2e-6)
    assert np.abs(places - HERE)[:, :2].max() < 2e-6
    assert forward(arm("ur5e"), made.trajectory.end.position)[2, 3] == pytest.approx(0.05 + up, abs=2e-6)
