"""Adaptations: which limits are tightened for which move, in proportion by direction, and what a move depends on."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from trajcli.job.read import job_from_text
from trajcli.kinematics.robot import Joint, Robot, ToolLimits, unlimited
from trajcli.planners.planner import Event, Planned, PlannedMove
from trajcli.planners.point_to_point.jerk_limited import JerkLimited
from trajcli.planning import planned_move
from trajcli.planning.adaptation import Adaptation, proportions, without_bounds
from trajcli.planning.plan import plan_job
from trajcli.planning.retime import with_duration
from trajcli.trajectory import resting

BOTH = np.array([[-2.0, 4.0], [-np.inf, 3.0]])
LIMITS = replace(
    unlimited(2),
    position=np.array([[-9.0, 9.0], [-9.0, 9.0]]),
    velocity=BOTH,
    acceleration=2 * BOTH,
    jerk=np.array([[-50.0, 50.0], [-60.0, 60.0]]),
    velocity_by_position=np.array([[5.0, 0.1], [6.0, 0.2]]),
    tcp=ToolLimits(speed=1.0, acceleration=4.0),
)
ARM = Robot("arm", (Joint("a"), Joint("b")), LIMITS, None, np.eye(4), np.eye(4))
START = resting(np.zeros(2))


@pytest.mark.parametrize(
    ("bounds", "shares"),
    [([-2, 4], [0.5, 1]), ([-4, 2], [1, 0.5]), ([-np.inf, 3], [1, 1]), ([-3, np.inf], [1, 1])],
)
def test_the_nearer_bound_is_as_many_times_nearer(bounds: list[float], shares: list[float]) -> None:
    assert proportions(np.array(bounds, float)).tolist() == shares


def test_a_cap_tightens_one_limit_of_one_joint_of_one_move() -> None:
    """A cap of 1 where the larger bound is 4 leaves -0.5 and 1; an infinite bound takes the cap itself."""
    caps = {(3, "velocity", 0): 1.0, (3, "acceleration", 1): 2.0, (4, "jerk", 0): 5.0}
    adapted = Adaptation(caps)
    limits = adapted.within(ARM, 3).limits
    assert limits.velocity.tolist() == [[-0.5, 1.0], [-np.inf, 3.0]]
    assert limits.acceleration.tolist() == [[-4.0, 8.0], [-2.0, 2.0]]
    assert np.array_equal(limits.jerk, LIMITS.jerk)
    assert adapted.within(ARM, 4).limits.jerk.tolist() == [[-5.0, 5.0], [-60.0, 60.0]]
    assert adapted.within(ARM, 0) is ARM
    assert [adapted.tightens(move) for move in (0, 3, 4)] == [False, True, True]
    looser = Adaptation({(0, "velocity", 0): 9.0}).within(ARM, 0).limits
    assert looser.velocity.tolist() == LIMITS.velocity.tolist()


def test_caps_of_the_tool_and_of_velocities_by_position() -> None:
    caps = {(0, "tool_speed", -1): 0.3, (0, "velocity_by_position", 1): 2.5}
    limits = Adaptation(caps).within(ARM, 0).limits
    assert (limits.tcp.speed, limits.tcp.acceleration) == (0.3, 4.0)
    assert limits.velocity_by_position.tolist() == [[5.0, 0.1], [2.5, 0.2]]


def test_what_a_move_depends_on_are_its_own_caps_stretch_rows_and_start() -> None:
    plain = Adaptation()
    grid = (100.0, False)
    assert plain.changes_nothing
    for changed in (
        Adaptation({(0, "velocity", 0): 1.0}),
        Adaptation(stretches={0: 1.1}),
        Adaptation(period=0.01),
    ):
        assert not changed.changes_nothing
        assert changed.whole_key(0, START, grid) != plain.whole_key(0, START, grid)
        assert changed.key(1, START) == plain.key(1, START)
    assert Adaptation(stretches={0: 1.1}).key(0, START) == plain.key(0, START)
    assert Adaptation({(0, "velocity", 0): 1.0}).key(0, START) != plain.key(0, START)
    assert Adaptation({(0, "velocity", 0): 1.0}).whole_key(1, START, grid) == plain.whole_key(1, START, grid)
    assert plain.whole_key(0, START, grid) != plain.whole_key(0, START, (200.0, False))
    assert plain.key(0, START) != plain.key(0, resting(np.ones(2)))


def test_moves_of_a_plan_are_stretched_repeated_and_slowed() -> None:
    moves = [
        {"planner": "quintic", "to": {"joints": [1, 0]}, "duration": 0.5},
        {"planner": "quintic", "to": {"joints": [0, 0]}, "duration": 0.5, "when_over_limit": "error"},
    ]
    job = {"version": 1, "robot": {"joints": 2}, "limits": {"velocity": 1}, "start": {"joints": [0, 0]}}
    plan = plan_job(job_from_text(json.dumps({**job, "moves": moves})))
    first, second = plan.moves
    adapted = Adaptation(stretches={0: 3.0})
    assert adapted.stretched(first).duration == pytest.approx(1.5)
    assert adapted.stretched(second) is second
    adapted.fastest.update({"a": first, "b": second})
    slowed = adapted.where_slowed()
    assert slowed.fastest.keys() == {"a"}  # the other one says itself what is done
    assert slowed.fastest["a"].duration == pytest.approx(0.5 * 15 / 8 / 0.5, rel=1e-6)
    assert slowed.chains is adapted.chains
    grid = (100.0, False)
    adapted.planned[adapted.whole_key(0, START, grid)] = first
    adapted.note_repeated(0, 7, START, grid)
    again = adapted.planned[adapted.whole_key(7, START, grid)]
    assert (again.index, again.duration) == (7, first.duration)
    kept = without_bounds(replace(first.planned, binding_phases=True))
    assert not kept.binding_phases
    assert kept.certificate is None


def test_breaks_on_rows_are_given_up_where_another_law_is_as_fast(monkeypatch: pytest.MonkeyPatch) -> None:
    """A straight line within limits of the tool has a law of its own: asked again, it is the same."""

    def counted(move: JerkLimited, *given: Any) -> Planned | None:
        asked.append(given[-1])
        return on_rows(move, *given)

    asked, on_rows = list[float](), JerkLimited.on_rows
    monkeypatch.setattr(JerkLimited, "on_rows", counted)
    limits = {"velocity": 3, "acceleration": 8, "jerk": 60, "tcp": {"acceleration": 1.2}}
    job = {"version": 1, "robot": "planar2r", "limits": limits, "start": {"joints": [0.3, 1.2]}}
    move = {"planner": "jerk_limited", "to": {"joints": [0.9, 0.8]}, "when_over_limit": "slow"}
    loaded = job_from_text(json.dumps({**job, "moves": [move]}))
    made = plan_job(loaded, adapted=Adaptation(period=0.002))
    assert made.verdict.passed
    assert made.trajectory.duration == pytest.approx(plan_job(loaded).trajectory.duration, rel=1e-12)
    assert len(asked) == 1


def test_breaks_on_rows_are_asked_for_as_late_as_all_limits_need(monkeypatch: pytest.MonkeyPatch) -> None:
    """Another limit asks for a fifth more at a time, up to 2.5 s; rows of 0.4 s give 2.8 s, and all is still said."""
    joint = {"velocity": 9, "acceleration": 4, "jerk": 99}
    job = {"version": 1, "robot": {"joints": 1}, "limits": joint, "start": {"joints": [0]}}
    loaded = job_from_text(
        json.dumps(
            {**job, "moves": [{"planner": "jerk_limited", "to": {"joints": [0.5]}, "minimum_duration": 1}]}
        )
    )
    (move,) = plan_job(loaded).moves
    said = (Event("slowed", "it is so", 0),)
    move = replace(move, planned=replace(move.planned, events=said))
    asked: list[float] = []

    def on_rows(own: JerkLimited, start: Any, robot: Any, period: float, least: float) -> Planned:
        asked.append(least)
        return replace(with_duration(move, period * np.ceil(least / period - 1e-9)).planned, events=())

    def within(other: PlannedMove) -> PlannedMove:
        return other if other.duration >= 2.5 else with_duration(other, min(1.2 * other.duration, 2.5))

    monkeypatch.setattr(JerkLimited, "on_rows", on_rows)
    monkeypatch.setattr(planned_move, "_within_limits", within)
    made = planned_move._on_rows(move, 0.4)
    assert made is not None
    assert asked == pytest.approx([1.0, 1.44, 1.92, 2.4, 2.5])
    assert made.duration == pytest.approx(2.8)
    assert made.planned.events == said


def test_rounds_of_one_motion_are_adapted_each_by_itself() -> None:
    there, back = ({"planner": "quintic", "to": {"joints": [q]}, "duration": 1} for q in (1, 0))
    job = {"version": 1, "robot": {"joints": 1}, "start": {"joints": [0]}, "when_over_limit": "slow"}
    loaded = job_from_text(json.dumps({**job, "moves": [{"repeat": 2, "moves": [there, back]}]}))
    for stretches, expected in (
        ({0: 2.0, 3: 1.5}, [2, 1, 1, 1.5]),
        ({2: 3.0}, [1, 1, 3, 1]),
        ({}, [1, 1, 1, 1]),
    ):
        made = plan_job(loaded, adapted=Adaptation(stretches=stretches))
        assert [move.duration for move in made.moves] == pytest.approx(expected)


def test_what_is_tightened_says_nothing_of_the_fastest_motion() -> None:
    job = {"version": 1, "robot": {"joints": 1}, "start": {"joints": [0]}, "when_over_limit": "slow"}
    limits = {"velocity": 1, "acceleration": 2}
    move = {"planner": "time_optimal", "through": [{"joints": [1]}], "to": {"joints": [2]}}
    loaded = job_from_text(json.dumps({**job, "limits": limits, "moves": [move]}))
    plain, capped = (
        plan_job(loaded, adapted=Adaptation(caps)).moves[0] for caps in ({}, {(0, "velocity", 0): 0.5})
    )
    assert (plain.planned.binding_phases, capped.planned.binding_phases) == (True, False)
    assert capped.planned.curve.evaluate(capped.duration / 2, 1) == pytest.approx(0.5)
    assert capped.robot.limits.velocity.tolist() == [[-1, 1]]


def test_moves_of_whole_periods_are_planned_anew_for_other_rows() -> None:
    job = {"version": 1, "robot": {"joints": 1}, "start": {"joints": [0]}, "limits": {"velocity": 1}}
    move = {"planner": "quintic", "to": {"joints": [1]}, "duration": 3.456}
    adapted = Adaptation()
    for rate in (10, 4, 1):
        output = {"rate": rate, "align": True}
        made = plan_job(
            job_from_text(json.dumps({**job, "output": output, "moves": [move]})), adapted=adapted
        )
        assert made.moves[0].duration * rate == pytest.approx(np.ceil(3.456 * rate))
