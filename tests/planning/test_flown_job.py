"""Corners of a job that are flown by: their chains, remarks and refusals, and bounds of the whole job."""

from __future__ import annotations

import json
from functools import cache
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from trajcli.errors import Amount, InputError, MissingLimitError, PlanningError, Problem
from trajcli.job.read import LoadedJob, job_from_text
from trajcli.kinematics.zone import Zone
from trajcli.planners.flying_by import stretched_chain
from trajcli.planners.flying_by.within_limits import FlownChain
from trajcli.planning import flown_job
from trajcli.planning.flown_job import FlownCorner, FlyBy, chains, flown_corners
from trajcli.planning.plan import Plan, plan_job


def loaded(*moves: dict[str, Any], robot: Any = "planar2r", **fields: Any) -> LoadedJob:
    job = {"version": 1, "robot": robot, "start": {"joints": 0.3}, "zone": 0.02, **fields}
    return job_from_text(json.dumps({**job, "moves": list(moves)}, indent=1))


def to(*joints: float, **fields: Any) -> dict[str, Any]:
    return {"planner": "jerk_limited", "to": {"joints": list(joints)}, **fields}


SLOW = {"planner": "line", "to": {"xyz": [0.3, 0.3, 0]}, "law": {"shape": "quintic", "duration": 3}}
HOLD = {"planner": "hold", "duration": 1}


def test_corners_of_moves_that_follow_each_other_make_a_chain() -> None:
    corners = [FlownCorner(k, Zone(position=0.1), explicit=False) for k in (0, 1, 3, 5, 6, 7)]
    assert [[corner.move for corner in chain] for chain in chains(corners)] == [[0, 1], [3], [5, 6, 7]]
    assert list(chains([])) == []


def test_the_zone_of_a_move_counts_before_that_of_the_job() -> None:
    found = flown_corners(loaded(to(1, 1, zone=0.05), to(0, 1), to(1, 0, zone="stop"), to(0, 0)))
    assert [(corner.move, corner.zone.position, corner.explicit) for corner in found.flown] == [
        (0, 0.05, True),
        (1, 0.02, False),
    ]
    assert [(remark.move, remark.message) for remark in found.remarks] == [
        (3, "stops at its end: it is the last move")
    ]


@pytest.mark.parametrize(
    ("moves", "reason"),
    [
        ([to(1, 1), HOLD], "of move 1 (hold) behind it, hold stops at its ends"),
        ([to(1, 1), {"tool": {"xyz": [0.1, 0, 0]}}, to(0, 0)], "the arm stands for `tool` behind it"),
        ([SLOW, to(0, 0)], "its law has a `duration`"),
        ([to(1, 1), SLOW], "of move 1 (line) behind it, its law has a `duration`"),
    ],
)
def test_a_default_zone_that_cannot_be_is_a_remark_and_one_of_the_move_is_refused(
    moves: list[dict[str, Any]], reason: str
) -> None:
    found = flown_corners(loaded(*moves))
    assert [corner.move for corner in found.flown if corner.move == 0] == []
    assert [remark.move for remark in found.remarks] == [
        k for k in (0, len(moves) - 1) if moves[k] is not HOLD
    ]
    first = found.remarks[0]
    assert (first.kind, first.move, first.message) == ("zone_stops", 0, f"stops at its end: {reason}")
    given = loaded({**moves[0], "zone": 0.03}, *moves[1:])
    with pytest.raises(InputError) as caught:
        flown_corners(given)
    (problem,) = caught.value.problems
    assert problem.message == f"move 0 ({moves[0]['planner']}): its corner cannot be flown by: {reason}"
    assert problem.place == given.document.place(("moves", 0, "zone"))


def test_a_move_that_stands_has_no_corner_to_remark_on() -> None:
    found = flown_corners(loaded(HOLD, to(1, 1), to(0, 0)))
    assert [corner.move for corner in found.flown] == [1]
    assert [remark.move for remark in found.remarks] == [2]
    with pytest.raises(InputError, match="move 0"):
        flown_corners(loaded({**HOLD, "zone": 0.03}, to(1, 1)))


def test_a_zone_in_rounds_is_refused_only_where_no_round_can_be_flown_by() -> None:
    rounds = [{"repeat": 3, "moves": [to(1, 1), to(0, 0, zone=0.03)]}]
    found = flown_corners(loaded(*rounds))
    assert [corner.move for corner in found.flown if corner.explicit] == [1, 3]
    assert [remark.move for remark in found.remarks] == [5]
    with pytest.raises(InputError, match="move 1"):
        flown_corners(loaded({**rounds[0], "repeat": 1}))


def test_bare_joints_have_no_zone_of_a_tool() -> None:
    bare: dict[str, Any] = {"robot": {"joints": 2}}
    found = flown_corners(loaded(to(1, 1), to(0, 0), **bare))
    assert not found.flown
    assert "has no geometry" in found.remarks[0].message
    assert len(flown_corners(loaded(to(1, 1), to(0, 0), zone={"joints": 0.1}, **bare)).flown) == 1


def flyby(monkeypatch: pytest.MonkeyPatch, close: list[float | None]) -> FlyBy:
    """Return what flying by gained of chains of 3 s and 5 s, of which second-order bounds are 2.5 s and 4 s."""
    some: Any = tuple(
        SimpleNamespace(duration=duration, second=second, close=bound)
        for duration, second, bound in zip((3.0, 5.0), (2.5, 4.0), close, strict=True)
    )
    monkeypatch.setattr(flown_job, "second_order_bound", lambda chain: chain.second)
    monkeypatch.setattr(flown_job, "close_bound", lambda chain: chain.close)
    return FlyBy(10.0, 12.0, 10.0, (), some)


@pytest.mark.parametrize(
    ("close", "bound", "method"),
    [
        ([None, None], 8.5, "second_order"),
        ([2.9, None], 8.9, "second_order"),
        ([2.9, 4.75], 9.65, "proven"),
        ([2.4, 4.75], 9.25, "proven"),
        ([2.9, 3.0], 8.9, "proven"),
    ],
)
def test_the_bound_of_a_job_is_the_highest_that_is_known_of_each_chain(
    close: list[float | None], bound: float, method: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What each chain takes longer than its bound is taken from the duration of the job, stops and all."""
    whole = flyby(monkeypatch, close)
    assert whole.second_order == 8.5
    assert whole.best_bound == (pytest.approx(bound), method)


@pytest.mark.parametrize("chains_of_job", [None, ()])
def test_where_a_chain_stops_or_none_flies_nothing_bounds_the_job(chains_of_job: tuple[()] | None) -> None:
    stopping = FlyBy(10.0, 12.0, 10.0, (), chains_of_job)
    assert stopping.second_order is None
    assert stopping.best_bound is None


def test_a_job_whose_only_corner_is_its_end_is_not_proven_to_be_fast() -> None:
    """A move that dawdles, with a zone for all corners: a tenth of the time is enough."""
    text = {"planner": "quintic", "to": {"joints": [0.9, 1.25]}, "duration": 3}
    quick = plan_job(loaded({**text, "duration": 0.3}, start={"joints": [0.3, 1.2]}))
    slow = plan_job(loaded(text, start={"joints": [0.3, 1.2]}))
    assert quick.trajectory.duration == 0.3
    assert slow.flyby is not None
    assert slow.flyby.best_bound is None


def test_each_corner_that_is_refused_is_named_at_its_place() -> None:
    given = loaded(to(1, 1, zone=0.03), HOLD, to(0, 0), to(1, 0, zone=0.03))
    with pytest.raises(InputError) as caught:
        flown_corners(given)
    assert [problem.move for problem in caught.value.problems] == [0, 3]
    places = [given.document.place(("moves", move, "zone")) for move in (0, 3)]
    assert [problem.place for problem in caught.value.problems] == places
    assert "leave `zone` out" in (caught.value.problems[1].hint or "")


def test_a_path_has_corners_although_it_names_no_target() -> None:
    path = {"planner": "path", "radius": 0.01, "segments": [{"line": {"xyz": [0.3, 0.3, 0]}}]}
    found = flown_corners(loaded(to(0.9, 1.2), path, to(1, 1)))
    assert sorted([corner.move for corner in found.flown] + [remark.move for remark in found.remarks]) == [
        0,
        1,
        2,
    ]


@pytest.mark.parametrize(
    ("duration", "periods"), [(1.2345, 124), (1.24, 124), (1.24 + 1e-13, 124), (1.2401, 125), (0.001, 1)]
)
def test_an_aligned_chain_lasts_the_next_whole_number_of_periods(
    duration: float, periods: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(flown_job, "stretched_chain", lambda chain, factor: chain.duration * factor)
    assert flown_job._aligned(SimpleNamespace(duration=duration), 100.0) == pytest.approx(periods / 100.0)  # type: ignore[arg-type]


def test_a_chain_that_is_stretched_twice_says_by_what_in_all() -> None:
    found = FlownChain((), SimpleNamespace(ends=[np.zeros((2, 2))]), (), 1.0, ())  # type: ignore[arg-type]
    assert found.stretch == 1.0
    assert stretched_chain(stretched_chain(found, 1.25), 1.5).stretch == 1.875


def made(index: int, duration: float) -> Any:
    """Return what counts of a planned move."""
    return SimpleNamespace(index=index, duration=duration, robot=("arm", index))


def corner(move: int, zone: float = 0.02) -> FlownCorner:
    return FlownCorner(move, Zone(position=zone), explicit=False)


def test_zones_and_durations_of_several_chains_are_of_the_job(monkeypatch: pytest.MonkeyPatch) -> None:
    """Moves of 1 to 7 s: of three chains the first saves 0.5 s of 5, the second stops, the third saves 1 s of 13."""
    durations, saved, lowered = (1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0), {1: 0.5, 5: 1.0}, {1: 0.25, 5: 0.125}
    moves = [made(k, duration) for k, duration in enumerate(durations)]
    tried = []

    def chain(_: Any, some: Any, group: Any, adapted: Any, stopping: float, events: list[Any]) -> Any:
        first = group[0].move
        assert [move.index for move in some] == [first, first + 1]
        tried.append((first, adapted, stopping))
        if first not in saved:
            events.append(f"stops {first}")
            return None
        lasts = stopping - saved[first]
        return SimpleNamespace(first=first, duration=lasts, model=lasts - lowered[first])

    def zones(of: Any) -> list[Any]:
        return [SimpleNamespace(shifted=lambda begun, before: (of.first, begun, before))]

    def as_flown(some: Any, of: Any) -> list[Any]:
        return [made(move.index, of.duration / 2) for move in some]

    monkeypatch.setattr(flown_job, "_chain", chain)
    monkeypatch.setattr(flown_job, "flown_zones", zones)
    monkeypatch.setattr(flown_job, "moves_as_flown", as_flown)
    monkeypatch.setattr(flown_job, "zone_events", lambda found: [found[0][0]])
    job = loaded(HOLD)
    found, flyby, events = flown_job._fly(job, moves, [corner(1), corner(3), corner(5)], None)
    assert tried == [(1, None, 5.0), (3, None, 9.0), (5, None, 13.0)]
    assert [move.duration for move in found] == [1.0, 2.25, 2.25, 4.0, 5.0, 6.0, 6.0]
    assert flyby.zones == ((1, 1.0, 0), (5, 14.5, 1))
    assert (flyby.duration, flyby.stopping, flyby.searched) == (26.5, 28.0, 26.125)
    assert flyby.chains is None
    assert events == [1, "stops 3", 5]
    _, flyby, events = flown_job._fly(job, moves, [corner(1), corner(5)], None)
    assert [chain.first for chain in flyby.chains or ()] == [1, 5]
    lowered |= {1: -0.25, 5: -0.125}  # the search has found nothing faster than what is flown
    assert flown_job._fly(job, moves, [corner(1), corner(5)], None)[1].searched == 26.5


ADAPTED: Any = SimpleNamespace(
    stretches={1: 1.25, 2: 1.5},
    within=lambda robot, index: (*robot, index),
    chain_key=lambda moves: tuple(move.index for move in moves),
)


def chain_of(
    monkeypatch: pytest.MonkeyPatch, lasts: float, adapted: Any = None, stopping: float = 3.0, **fields: Any
) -> tuple[Any, list[Any]]:
    """Return the chain of moves 1 to 3 about two zones, its fastest motion known, and events."""
    monkeypatch.setattr(flown_job, "flown", lambda *given: SimpleNamespace(duration=lasts, given=given))
    monkeypatch.setattr(
        flown_job,
        "stretched_chain",
        lambda of, by: SimpleNamespace(duration=of.duration * by, given=of.given),
    )
    events: list[Any] = []
    moves = [made(k, 1.0) for k in (1, 2, 3)]
    corners = [corner(1, 0.1), corner(2, 0.2)]
    found = flown_job._chain(loaded(HOLD, **fields), moves, corners, adapted, stopping, events)
    return found, events


def test_a_chain_is_stretched_as_the_slowest_of_its_moves_and_within_the_limits_of_all(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    ADAPTED.chains = {}
    found, events = chain_of(monkeypatch, 1.5, ADAPTED)
    assert found.duration == 1.5 * 1.5
    moves, zones, robots = found.given
    assert [zone.position for zone in zones] == [0.1, 0.2]
    assert robots == [("arm", move.index, 1, 2, 3) for move in moves]
    again, _ = chain_of(monkeypatch, 1.0, ADAPTED)
    assert again.duration == found.duration, "the search is done once"
    assert not events
    aligned, _ = chain_of(monkeypatch, 1.501, output={"rate": 100, "align": True})
    assert aligned.duration == pytest.approx(1.51)
    alone, _ = chain_of(monkeypatch, 1.501)
    assert (alone.duration, [robot for _, robot in alone.given[2]]) == (1.501, [1, 2, 3])


@pytest.mark.parametrize(("lasts", "flies"), [(3.0, False), (3.0 * (1 - 1e-12), False), (2.9999, True)])
def test_a_chain_that_gains_nothing_stops(lasts: float, flies: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    found, events = chain_of(monkeypatch, lasts)
    assert (found is not None) == flies
    assert [(event.kind, event.move) for event in events] == ([] if flies else [("not_faster", 1)])
    if not flies:
        assert events[0].text(lambda amount: f"{amount.value} s").endswith("which takes 3.0 s")


def test_why_a_chain_stops_is_said_of_its_corners(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(*_: Any) -> Any:
        raise PlanningError(Problem("{joint} is at {value}", amounts={"joint": "j1", "value": Amount(2.0)}))

    def lack(*_: Any) -> Any:
        raise MissingLimitError(Problem("no limit"))

    monkeypatch.setattr(flown_job, "_fastest", refuse)
    events: list[Any] = []
    moves = [made(k, 1.0) for k in (1, 2, 3)]
    job = loaded(HOLD, HOLD)
    assert flown_job._chain(job, moves, [], None, 3.0, events) is None
    assert flown_job._chain(job, moves[:2], [], None, 3.0, events) is None
    assert [event.text(lambda amount: f"{amount.value} rad") for event in events] == [
        "stops at the corners of moves 1 to 2: j1 is at 2.0 rad",
        "stops at the corner of move 1: j1 is at 2.0 rad",
    ]
    assert [(event.kind, event.move) for event in events] == [("not_faster", 1)] * 2
    monkeypatch.setattr(flown_job, "_fastest", lack)
    with pytest.raises(MissingLimitError) as caught:
        flown_job._chain(job, moves, [], None, 3.0, events)
    assert caught.value.problems[0].place == job.place_of_move(1) != job.place_of_move(0)


@cache
def planned(zone: float, *, align: bool = False) -> Plan:
    limits = {"velocity": 3, "acceleration": 8, "jerk": 60}
    fields = {"limits": limits, "zone": zone, "output": {"rate": 100, "align": align}}
    return plan_job(loaded(to(0.9, 1.25), to(1.0, 2.0), start={"joints": [0.3, 1.2]}, **fields))


def test_a_zone_of_next_to_nothing_is_stopped_in_and_that_is_said() -> None:
    made = planned(1e-12)
    assert made.flyby is not None
    assert made.flyby.chains is None
    assert made.flyby.duration == made.flyby.stopping == made.trajectory.duration
    assert made.flyby.best_bound is None
    (event,) = made.events
    assert (event.kind, event.move) == ("not_faster", 0)
    assert f"{made.flyby.stopping:.6g}"[:6] in event.message
    assert [(remark.kind, remark.move) for remark in made.remarks] == [("zone_stops", 1)]


@pytest.mark.full
def test_a_job_that_is_aligned_flies_by_in_whole_periods() -> None:
    free, aligned = planned(0.02), planned(0.02, align=True)
    assert free.flyby is not None
    assert aligned.flyby is not None
    periods = 100 * aligned.trajectory.duration
    assert periods == pytest.approx(round(periods), abs=1e-9)
    assert 0 <= periods - 100 * free.trajectory.duration < 1
    assert aligned.flyby.searched == pytest.approx(free.flyby.searched, rel=1e-9)
    longer = [slow.duration / fast.duration for slow, fast in zip(aligned.moves, free.moves, strict=True)]
    assert min(longer) > 1
    assert [move.stretch for move in aligned.moves] == pytest.approx(longer, rel=1e-9)
    assert [move.stretch for move in free.moves] == [1.0, 1.0]


@pytest.mark.full
def test_a_start_in_motion_is_kept_where_a_chain_would_have_to_be_stretched() -> None:
    """Another duration of the same motion begins at another speed: then the arm stops, in whole periods, too."""
    rates = [0.6, 0.05]  # along the first line
    fields = {"limits": {"velocity": 3, "acceleration": 8, "jerk": 60}, "zone": 0.02}
    start = {"joints": [0.3, 1.2], "velocity": rates}
    moves = to(0.9, 1.25), to(1.0, 2.0)
    free, aligned = (
        plan_job(loaded(*moves, start=start, **fields, output={"rate": 100, "align": align}))
        for align in (False, True)
    )
    assert free.flyby is not None
    assert free.flyby.zones
    assert aligned.trajectory(0.0, 1) == pytest.approx(rates, abs=1e-12)
    assert 100 * aligned.trajectory.duration == pytest.approx(round(100 * aligned.trajectory.duration))
    (event,) = aligned.events
    assert event.kind == "not_faster"
    assert "begins in motion" in event.message


@pytest.mark.full
def test_a_path_that_bends_where_the_arm_moves_already_is_left_to_the_move_that_stops() -> None:
    """The joints come without the acceleration that its curvature takes at that speed: a step of it is none."""
    path = {"planner": "time_optimal", "through": [{"joints": [0.6, 1.5]}], "to": {"joints": [0.9, 1.25]}}
    fields = {"limits": {"velocity": 3, "acceleration": 8, "jerk": 60}, "zone": 0.02}
    free = loaded(path, to(1.0, 2.0), start={"joints": [0.3, 1.2]}, **fields)
    first = plan_job(free).moves[0]
    along = first.planner.course(first.start.position, first.robot, first.planned).curve.evaluate(0.0, 1)
    rates = (0.4 / abs(along).max() * along).tolist()
    run_up = {"planner": "jerk_limited", "to": {"joints": [0.3, 1.2], "velocity": rates}}
    start = {"joints": [0.3 - 0.2 * rates[0], 1.2 - 0.2 * rates[1]]}
    made = plan_job(loaded({**run_up, "zone": "stop"}, path, to(1.0, 2.0), start=start, **fields))
    assert not made.verdict.findings
    (event,) = made.events
    assert event.kind == "not_faster"
    assert "bends where the joints start in motion" in event.message
