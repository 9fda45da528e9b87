"""What zones came to, against the motion of a planar arm by textbook formulas, on dense rows."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial import cKDTree
from tiers import few

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.errors import PlanningError
from trajcli.job.read import job_from_text
from trajcli.kinematics.robot import Robot
from trajcli.planners.flying_by.flown_moves import (
    _least_at,
    _passed,
    _size,
    flown_zones,
    moves_as_flown,
    stretched_chain,
    zone_events,
)
from trajcli.planners.planner import Event
from trajcli.planning.plan import Plan, plan_job

LIMITS: dict[str, Any] = {
    "velocity": [[-1.0, 3.0], [-3.0, 0.5]],
    "acceleration": [[-2.0, 8.0], [-8.0, 3.0]],
    "jerk": 60.0,
}
PLACES = np.array([[0.3, 1.2], [0.9, 1.25], [1.0, 2.0], [1.0, 2.0], [0.2, 0.4], [0.6, 0.1]])
SIZE = 0.02
ZONES: dict[str, Any] = {
    "position": SIZE,
    "joints": {"joints": [0.03, 0.3]},
    "orientation": {"orientation": 0.05},
}


def to(place: np.ndarray, **fields: Any) -> dict[str, Any]:
    return {"planner": "jerk_limited", "to": {"joints": place.tolist()}, **fields}


@cache
def _planned(text: str) -> Plan:
    return plan_job(job_from_text(text))


def plan(zone: str = "position", **fields: Any) -> Plan:
    """Return a plan of two chains with a hold between them, the second move of no length among them."""
    first, second, third, fourth, fifth = (to(place) for place in PLACES[1:])
    moves = [first, second, third, fourth, {"planner": "hold", "duration": 0.25}, fifth, to(PLACES[0])]
    job = {"version": 1, "robot": "planar2r", "limits": LIMITS, "start": {"joints": PLACES[0].tolist()}}
    return _planned(json.dumps({**job, "zone": ZONES.get(zone, zone), **fields, "moves": moves}))


def bare(sizes: tuple[float, float]) -> Plan:
    """Return the plan of the same places by joints without geometry, in one chain."""
    moves = [to(place) for place in PLACES[[1, 2, 4]]]
    job = {"version": 1, "robot": {"joints": 2}, "limits": LIMITS, "start": {"joints": PLACES[0].tolist()}}
    return plan_job(job_from_text(json.dumps({**job, "zone": {"joints": sizes}, "moves": moves})))


def tool(q: np.ndarray) -> np.ndarray:
    """Return where the tool is, m, and its angle, rad, (N, 3)."""
    both = q.sum(axis=-1)
    return np.stack(
        [
            0.3 * np.cos(q[..., 0]) + 0.2 * np.cos(both),
            0.3 * np.sin(q[..., 0]) + 0.2 * np.sin(both),
            both,
        ],
        axis=-1,
    )


def away_from(path: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Return how far places (N, 2) are from the nearest one of a path (m, 2), (N,)."""
    return np.asarray(cKDTree(path).query(places)[0])


FLOWN = [
    (0, PLACES[0], PLACES[1], PLACES[2]),
    (1, PLACES[1], PLACES[2], PLACES[4]),
    (5, PLACES[4], PLACES[5], PLACES[0]),
]


@pytest.mark.parametrize("name", few(["position", "joints", "orientation"], 2))
def test_what_is_said_of_a_zone_is_what_rows_in_it_show(name: str) -> None:
    made = plan(name)
    assert made.flyby is not None
    zones, curve = made.flyby.zones, made.trajectory.curve
    assert [zone.number for zone in zones] == [1, 2, 3]
    assert [zone.move for zone in zones] == [move for move, *_ in FLOWN]
    for zone, (_, before, corner, behind) in zip(zones, FLOWN, strict=True):
        times = np.linspace(zone.entered, zone.left, 20_001)
        q = curve.evaluate(times)
        here, there = tool(q), tool(corner)
        distance, turn = np.linalg.norm(here[:, :2] - there[:2], axis=1), np.abs(here[:, 2] - there[2])
        assert zone.nearest == pytest.approx(distance.min(), abs=1e-7)
        assert zone.farthest == pytest.approx(distance.max(), rel=1e-6)
        assert zone.turn == pytest.approx(turn.max(), rel=1e-6)
        assert zone.passed == pytest.approx(times[distance.argmin()], abs=2 * (times[1] - times[0]))
        ends = q[[0, -1]]
        for end, other in zip(ends, (before, behind), strict=True):  # the borders are on the programmed lines
            way, off = corner - other, end - other
            assert abs(way[0] * off[1] - way[1] * off[0]) < 1e-8
        shares = {
            "position": distance[[0, -1]] / SIZE,
            "orientation": turn[[0, -1]] / 0.05,
            "joints": (np.abs(ends - corner) / [0.03, 0.3]).max(axis=1),
        }[name]
        assert zone.of == name
        assert zone.used / zone.asked == pytest.approx(shares.min(), rel=1e-6)
        lines = [np.linspace(a, corner, 4001) for a in (ends[0], ends[1])]
        path = tool(np.concatenate(lines))[:, :2]
        most = 50 * int(away_from(path, here[::50, :2]).argmax())
        off = away_from(path, here[max(most - 50, 0) : most + 50, :2]).max()
        assert zone.deviation == pytest.approx(off, rel=5e-4)  # of rows apart in time


@pytest.mark.parametrize("sizes", [(0.03, 0.3), (0.3, 0.06)])
def test_of_a_zone_of_joints_the_one_that_uses_most_of_its_size_is_named(sizes: tuple[float, float]) -> None:
    """Of bare joints, too, and these are nearest by their sizes."""
    made = plan("joints") if sizes[0] < sizes[1] else bare(sizes)
    assert made.flyby is not None
    assert len(made.flyby.zones) >= 2
    for zone in made.flyby.zones:
        ends = made.trajectory.curve.evaluate(np.array([zone.entered, zone.left]))
        corner = PLACES[{0: 1, 1: 2, 5: 5}[zone.move]]
        shares = np.abs(ends - corner) / sizes
        nearer = shares.max(axis=1).argmin()
        assert zone.joint is not None
        assert shares[nearer, zone.joint] == pytest.approx(shares[nearer].max(), rel=1e-9)
        assert zone.asked == sizes[zone.joint]
        assert zone.used == pytest.approx(np.abs(ends - corner)[nearer, zone.joint], rel=1e-9)
        assert zone.ball(made.moves[0].robot) is None
        if zone.nearest is None:
            times = np.linspace(zone.entered, zone.left, 20_001)
            off = np.linalg.norm((made.trajectory.curve.evaluate(times) - corner) / sizes, axis=1)
            assert zone.passed == pytest.approx(times[off.argmin()], abs=2 * (times[1] - times[0]))


@pytest.mark.parametrize("sign", [1, -1])
def test_the_limit_of_which_a_zone_uses_most_counts_by_its_direction(sign: int) -> None:
    """In both of a motion and the mirror image of another one."""
    places = sign * PLACES[[0, 1, 2] if sign > 0 else [1, 2, 4]]
    bounds = np.array([LIMITS["velocity"], LIMITS["acceleration"], [[-60.0, 60.0]] * 2])
    bounds = bounds if sign > 0 else -bounds[:, :, ::-1]
    limits = dict(zip(("velocity", "acceleration"), bounds[:2].tolist(), strict=True)) | {"jerk": 60.0}
    job = {"version": 1, "robot": "planar2r", "limits": limits, "start": {"joints": places[0].tolist()}}
    moves = [to(place) for place in places[1:]]
    made = plan_job(job_from_text(json.dumps({**job, "zone": SIZE, "moves": moves})))
    assert made.flyby is not None
    (zone,) = made.flyby.zones
    times = np.linspace(zone.entered, zone.left, 20_001)[1:-1]
    used = {}
    for order, name in enumerate(("velocity", "acceleration", "jerk"), 1):
        rows, (low, high) = made.trajectory.curve.evaluate(times, order), bounds[order - 1].T
        share = np.maximum(rows / high, rows / low).max(axis=0)
        used |= {f"{name} of j{joint}": value for joint, value in enumerate(share, 1)}
    assert used[zone.binds] == pytest.approx(max(used.values()), rel=1e-4)


def test_pictures_of_a_zone_are_about_its_corner() -> None:
    made = plan()
    assert made.flyby is not None
    robot = made.moves[0].robot
    for zone, (_, _, corner, _) in zip(made.flyby.zones, FLOWN, strict=True):
        ball = zone.ball(robot)
        assert ball is not None
        np.testing.assert_allclose(ball, [*tool(corner)[:2], 0.0, zone.used], atol=1e-9)
        half = replace(zone, used=zone.used / 2).ball(robot)
        assert half is not None
        assert half[3] == ball[3] / 2
        path = zone.tool_path(robot)
        ends = tool(made.trajectory.curve.evaluate(np.array([zone.entered, zone.left])))[:, :2]
        np.testing.assert_allclose(path[[0, -1], :2], ends, atol=1e-7)
        assert np.linalg.norm(path[:, :2] - tool(corner)[:2], axis=1).min() < 1e-9


def test_moves_change_where_the_tool_is_nearest_and_their_parts_are_in_turns() -> None:
    made = plan()
    assert made.flyby is not None
    spans = {span.index: span for span in made.trajectory.spans}
    assert spans[2].start == spans[2].end  # the move of no length
    for zone in made.flyby.zones:
        assert spans[zone.move].end == pytest.approx(zone.passed, abs=1e-6)
    first, second = made.moves[0].planned, made.moves[1].planned
    assert [phase.name for phase in first.phases] == ["along the path", "within the zone"]
    assert [phase.name for phase in second.phases] == ["within the zone", "along the path", "within the zone"]
    for move in made.moves:
        ends = [0.0, *(phase.end for phase in move.planned.phases)]
        if move.planned.parts:
            assert [phase.start for phase in move.planned.phases] == ends[:-1]
        if move.planned.parts and ends[-1]:
            assert ends[-1] == move.planned.curve.end


def test_what_flying_by_gains_is_counted_from_the_same_job_with_stops() -> None:
    made, stopping = plan(), plan("stop")
    assert made.flyby is not None
    assert made.flyby.stopping == pytest.approx(stopping.trajectory.duration, rel=1e-12)
    assert made.flyby.duration == pytest.approx(made.trajectory.duration, rel=1e-12)
    assert made.flyby.searched <= made.flyby.duration < made.flyby.stopping
    assert made.flyby.chains is not None
    assert [chain.moves for chain in made.flyby.chains] == [(0, 1, 3), (5, 6)]
    left = 0.25 + sum(chain.duration for chain in made.flyby.chains)
    assert left == pytest.approx(made.flyby.duration, rel=1e-12)


@pytest.mark.parametrize(
    ("share", "shares", "kinds"),
    [
        (1.0, (1.0, 1.0, 1.0), []),
        (1 - 1e-9, (1.0, 1.0, 1.0), []),
        (0.7, (1.0, 1.0, 1.0), ["shrunk"]),
        (0.995, (1.0, 1.0, 1.0), ["shrunk"]),
        (1.0, (1.0, 0.5, 0.25), ["lowered"]),
        (0.5, (0.5, 1.0, 1.0), ["shrunk", "lowered"]),
    ],
)
def test_what_a_zone_concedes_is_said(
    share: float, shares: tuple[float, float, float], kinds: list[str]
) -> None:
    made = plan()
    assert made.flyby is not None
    zone = made.flyby.zones[1]
    changed = replace(zone, asked=0.02, used=0.02 * share, shares=shares)
    events = list(zone_events([changed]))
    assert [event.kind for event in events] == kinds
    assert [event.move for event in events] == [zone.move] * len(kinds)
    if "lowered" in kinds:
        names = ("velocity", "acceleration", "jerk")
        parts = [f"{part:g} of the {name}" for part, name in zip(shares, names, strict=True) if part < 1]
        assert f"at most {' and '.join(parts)} that" in events[-1].message
    if "shrunk" in kinds:
        assert f"{share:.3g} of the" in events[0].message


def test_what_is_said_of_a_path_is_said_of_it_as_it_is_flown_and_what_is_of_its_law_is_not(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    made = plan()
    assert made.flyby is not None
    assert made.flyby.chains is not None
    of_paths = ["merged", "moved_center", "shrunk", "turns_back", "jerk_limit_both_ways"]
    events = tuple(Event(kind, "it is so") for kind in [*of_paths, "bound", "refined", "stretched", "braked"])
    chain, moves = replace(made.flyby.chains[0], stretch=1.25), made.moves[:4]
    said = [
        replace(
            move,
            planned=replace(move.planned, events=events, wanted_speed=0.5 + k, continuity=1),
            robot=faster(move.robot, factor),
        )
        for k, (move, factor) in enumerate(zip(moves, (1.0, 2.0, 9.0, 1.5), strict=True))
    ]
    monkeypatch.setattr("trajcli.planners.flying_by.flown_moves._passed", lambda _, number, __: number)
    flown = list(moves_as_flown(said, chain))
    assert [move.planned.via_points for move in flown] == [0, 1, None, 2]
    kinds = {move.index: [event.kind for event in move.planned.events] for move in flown}
    assert kinds == {0: of_paths, 1: of_paths, 2: [], 3: of_paths}  # the third one stands in a corner
    assert [move.planned.wanted_speed for move in flown] == [0.5, 1.5, None, 3.5]
    assert [move.planned.continuity for move in flown] == [1, 1, None, 1]
    assert [move.stretch for move in flown] == [1.25, 1.25, 1.0, 1.25]
    # the looser limits of neighbours that move are in force
    for move, factor in zip(flown, (2.0, 2.0, 9.0, 2.0), strict=True):
        np.testing.assert_array_equal(
            move.robot.limits.velocity, factor * np.array(LIMITS["velocity"]), strict=True
        )
    for before, behind in pairwise(flown):
        np.testing.assert_array_equal(behind.start.position, before.planned.end.position)
        np.testing.assert_array_equal(behind.start.velocity, before.planned.end.velocity)
    (resting,) = flown[2].planned.parts
    assert resting.around is flown[1].planned.parts[-1].around is not None
    assert (resting.start, resting.end) == (0.0, 0.0)


def faster(robot: Robot, factor: float) -> Robot:
    return replace(robot, limits=replace(robot.limits, velocity=factor * robot.limits.velocity))


def test_what_is_said_of_a_zone_is_of_its_corner() -> None:
    """Its shares and its pace, and the limits there: the second joint has hardly any acceleration."""
    made = plan()
    assert made.flyby is not None
    assert made.flyby.chains is not None
    chain = made.flyby.chains[0]
    corners = []
    for k, corner in enumerate(chain.chain.corners):
        slow = np.where([[False], [True]], 1e-3, 1.0) * corner.robot.limits.acceleration
        robot = replace(corner.robot, limits=replace(corner.robot.limits, acceleration=slow))
        corners.append(replace(corner, robot=robot, shares=(1.0, 0.5, 0.125 / 8**k)))
    zones = flown_zones(replace(chain, chain=replace(chain.chain, corners=tuple(corners))))
    assert [zone.binds for zone in zones] == ["acceleration of j2"] * 2
    assert [zone.shares for zone in zones] == [(1.0, 0.5, 0.125), (1.0, 0.5, 0.125 / 8)]
    assert [zone.pace for zone in zones] == pytest.approx([0.5, 0.25])  # the jerk goes with its third power


@pytest.mark.parametrize(
    ("offsets", "wanted"),
    [
        (((0.010, 0.016), (0.09, 0.07)), ("position", 0.02, 0.016)),
        (((0.016, 0.019), (0.07, 0.04)), ("position", 0.02, 0.016)),
        (((0.016, 0.019), (0.09, 0.04)), ("orientation", 0.1, 0.09)),
    ],
)
def test_of_several_sizes_of_a_zone_the_one_of_which_most_is_used_at_the_nearer_border_is_named(
    offsets: tuple[tuple[float, float], tuple[float, float]], wanted: tuple[str, float, float]
) -> None:
    zone = SimpleNamespace(needs_geometry=True, position=0.02, orientation=0.1, joints=None)
    distance, angle = (np.array(each) for each in offsets)
    around = SimpleNamespace(zone=zone, joint_sizes=np.ones(2), offsets=lambda _: (distance, angle))
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), np.zeros((1, 1, 2)))
    name, joint, asked, used = _size(around, curve)  # type: ignore[arg-type]
    assert (name, asked, used) == wanted
    assert joint is None


@pytest.mark.parametrize("slope", [1.0, -1.0])
def test_a_place_is_never_at_the_end_of_a_motion(slope: float) -> None:
    """No part of a move would be left before it, or behind it."""
    curve = PiecewisePolynomial(np.array([2.0, 3.0]), np.array([[[1.0]], [[0.0]]]))
    time = _least_at(lambda times: slope * times, curve)
    assert 2.0 < time < 3.0
    assert 0.9e-6 < min(time - 2.0, 3.0 - time) < 1e-5


@pytest.mark.parametrize(
    ("of", "joint", "text"),
    [
        ("position", None, "has 50 mm, 0.5 of the 100 mm that"),
        ("orientation", None, "has 2.86478898 deg, 0.5 of the 5.72957795 deg that"),
        ("joints", 0, "has 2.86478898 deg, 0.5 of the 5.72957795 deg that"),
        ("joints", 1, "has 50 mm, 0.5 of the 100 mm that"),
    ],
)
def test_sizes_of_zones_are_said_in_the_units_of_what_they_measure(
    of: str, joint: int | None, text: str
) -> None:
    job = {"version": 1, "units": {"angle": "deg", "length": "mm"}, "start": {"joints": [0, 0]}}
    robot = {"joints": [{"name": "turn"}, {"name": "lift", "type": "prismatic"}]}
    moves = [{"planner": "hold", "duration": 1}]
    say = job_from_text(json.dumps({**job, "robot": robot, "moves": moves})).say
    made = plan()
    assert made.flyby is not None
    zone = replace(made.flyby.zones[0], of=of, joint=joint, asked=0.1, used=0.05, shares=(1.0, 1.0, 1.0))
    (event,) = zone_events([zone])
    assert text in event.text(say)


def test_a_chain_that_takes_longer_passes_the_same_places() -> None:
    made = plan()
    assert made.flyby is not None
    assert made.flyby.chains is not None
    chain = made.flyby.chains[0]
    tool: Any = SimpleNamespace(scaled=lambda factor: ("slower", factor))
    chain = replace(chain, parts=(replace(chain.parts[0], tool=tool), *chain.parts[1:]))
    longer = stretched_chain(chain, 2.0)
    assert longer.duration == pytest.approx(2 * chain.duration, rel=1e-12)
    for own, other in zip(chain.parts, longer.parts, strict=True):
        assert (own.law is None) == (other.law is None)
        curves = [(own.curve, other.curve)]
        if own.law is not None and other.law is not None:
            curves.append((own.law, other.law))
        for one, slow in curves:
            times = np.linspace(0.0, one.duration, 7)
            for order in range(4):
                rates = slow.evaluate(slow.start + 2 * times, order) * 2.0**order
                np.testing.assert_allclose(rates, one.evaluate(one.start + times, order), rtol=0, atol=1e-9)
    assert longer.parts[0].tool == ("slower", 2.0)
    again = stretched_chain(replace(chain, stretch=2.0), 1.5)
    assert (longer.stretch, again.stretch) == (2.0, 3.0)
    assert stretched_chain(chain, 1.0) is chain
    moving = replace(chain, chain=replace(chain.chain, ends=(np.array([0.1, 0.0]), np.zeros(2))))
    with pytest.raises(PlanningError, match="begins in motion"):
        stretched_chain(moving, 2.0)


def test_points_between_zones_are_passed_when_the_law_is_there() -> None:
    """Points at s of 0.1 to 0.6; the course is followed from 0.25 to 0.5, at 0.1 m/s, behind a zone of 0.75 s."""
    points = SimpleNamespace(
        s=np.array([0.1, 0.3, 0.4, 0.6]),
        points=np.arange(8.0).reshape(4, 2),
        missed=np.arange(8.0).reshape(4, 2) * 1e-3,
    )
    law = PiecewisePolynomial(np.array([2.0, 4.5]), np.array([[[0.1]], [[0.25]]]))
    courses = (None, SimpleNamespace(passed=points))
    of_moves = SimpleNamespace(courses=courses, stretch=lambda number: {1: (0.25, 0.5)}[number])
    parts = (None, None, SimpleNamespace(law=law))
    chain: Any = SimpleNamespace(chain=of_moves, parts=parts)
    zone, path = SimpleNamespace(start=0.0, around=1), SimpleNamespace(start=0.75, around=None)
    intervals: Any = (zone, path)
    passed = _passed(chain, 1, intervals)
    assert passed is not None
    np.testing.assert_allclose(passed.times, [1.25, 2.25], rtol=1e-12)
    np.testing.assert_array_equal(passed.points, points.points[1:3])
    np.testing.assert_array_equal(passed.missed, points.missed[1:3])
    points.s = np.array([0.1, 0.2, 0.6, 0.7])
    assert _passed(chain, 1, intervals) is None
