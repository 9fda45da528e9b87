"""Limits and stretches of moves whose rows pass something: by the powers of time with which derivatives fall."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest

from trajcli.errors import VerificationError
from trajcli.findings import Finding
from trajcli.job.read import job_from_text
from trajcli.output.delivery.slower_motion import may_be_cured, refuse_braking, tightened
from trajcli.planning.adaptation import Adaptation
from trajcli.planning.plan import Plan, plan_job

LIMITS = {"velocity": [[-1, 2], 1.5], "acceleration": [4, [-6, 3]], "jerk": [40, 30]}
KINDS = ("velocity", "acceleration", "jerk")


@cache
def planned(when: str = "slow") -> Plan:
    """Return the plan of three moves, of which nothing moves in the second; the last one moves the second joint."""
    joint = {"velocity_by_position": {"deceleration": 5, "offset": 0.1}, "position": [-4, 4]}
    job = {
        "version": 1,
        "robot": {"joints": [joint, {}]},
        "limits": LIMITS,
        "when_over_limit": when,
        "start": {"joints": [0, 0]},
        "moves": [
            {"planner": "quintic", "to": {"joints": [-0.5, 0.2]}, "duration": 2},
            {"planner": "hold", "duration": 0.5},
            {"planner": "quintic", "to": {"joints": [-0.5, 0.6]}, "duration": 2, "when_over_limit": when},
        ],
    }
    plan = plan_job(job_from_text(json.dumps(job)))
    assert plan.verdict.passed
    return plan


def found(kind: str, excess: float, move: int, joint: str | None = "j1") -> Finding:
    return Finding(kind, joint, excess, 1.0, time=0.0, move=move, message="over")


def changed(
    *uses: tuple[float, int, int, int], over: Any = (), adapted: Adaptation | None = None, **options: Any
) -> Adaptation:
    result = tightened(planned(), over, uses, adapted or Adaptation(), **options)
    assert result is not None
    return result


@pytest.mark.parametrize("order", [1, 2, 3])
def test_a_move_that_passes_little_is_stretched_by_the_root_of_it(order: int) -> None:
    """A derivative of order k falls with the k-th power of time; what is passed by more than that is tightened."""
    little = changed((1.002, order, 0, 0))
    assert little.stretches == {0: pytest.approx(1.002 ** (1 / order), rel=1e-8)}
    assert 1 < little.stretches[0] ** order / 1.002 < 1 + 1e-7
    assert not little.caps
    assert changed((1.3, order, 0, 0), stretched=True).stretches[0] == pytest.approx(1.3 ** (1 / order))


def test_the_worst_of_a_move_counts_and_stretches_go_on_top_of_each_other() -> None:
    uses = [(1.002, 1, 0, 0), (1.0025, 1, 1, 0), (1.001, 1, 0, 0)]
    assert changed(*uses).stretches == {0: pytest.approx(1.0025)}
    before = Adaptation(stretches={0: 1.1, 2: 1.2})
    assert changed(*uses, adapted=before).stretches == {0: pytest.approx(1.1 * 1.0025), 2: 1.2}


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("joint", [0, 1])
def test_what_is_passed_by_more_lowers_what_the_joint_has_reached(order: int, joint: int) -> None:
    """Of bounds that differ by direction in proportion; a quintic over D in T has 15/8 D/T, 10/sqrt(3) D/T^2, 60 D/T^3."""
    distance = (0.5, 0.2)[joint]
    peak = distance * (15 / 8 / 2, 10 / 3**0.5 / 4, 60 / 8)[order - 1]
    low, high = {
        (1, 0): (1, 2), (2, 0): (4, 4), (3, 0): (40, 40), (1, 1): (1.5, 1.5), (2, 1): (6, 3), (3, 1): (30, 30),
    }[order, joint]  # fmt: skip
    largest, both = max(low, high), order > 1  # a velocity has one sign, the others both
    sides = [low, high] if both else [low] if joint == 0 else [high]
    reached = max(peak * largest / side for side in sides)
    caps = changed((1.25, order, joint, 0)).caps
    assert caps == {(0, KINDS[order - 1], joint): pytest.approx(min(reached, largest) / 1.25, rel=1e-6)}


def test_a_cap_that_is_lower_already_is_what_is_lowered() -> None:
    lower = Adaptation(caps={(0, "velocity", 1): 0.05})
    assert changed((1.25, 1, 1, 0), adapted=lower).caps == {(0, "velocity", 1): pytest.approx(0.04)}


def test_the_speed_by_position_falls_with_the_root_of_its_deceleration() -> None:
    """|v| <= sqrt(2 d s) - o: for four fifths of the speed d is 16 twenty-fifths."""
    caps = changed(over=[found("velocity_by_position", 1.25, 0)]).caps
    assert caps == {(0, "velocity_by_position", 0): pytest.approx(5 / 1.25**2, rel=1e-6)}


def test_an_effort_is_limited_by_less_than_its_larger_bound() -> None:
    """What is reached of it is not asked: the proportion of a limit by direction is kept by who plans."""
    plan = planned()
    first, robot = plan.moves[0], plan.moves[0].robot
    effort = np.array([[-60.0, 20.0], [-np.inf, np.inf]])
    limited = replace(first, robot=replace(robot, limits=replace(robot.limits, effort=effort)))
    heavy = replace(plan, moves=(limited, *plan.moves[1:]))
    result = tightened(heavy, [found("effort", 1.25, 0)], (), Adaptation())
    assert result is not None
    assert result.caps == {(0, "effort", 0): pytest.approx(48)}


def test_a_tool_that_leaves_its_path_is_slowed_by_the_root_of_it() -> None:
    """Rows leave a path by the square of the speed, at most to 0.7 of it in a round; derivatives fall by its powers."""
    for excess, share in ((1.21, 1 / 1.1), (25.0, 0.7)):
        caps = changed(over=[found("deviation", excess, 0, None)]).caps
        speed = 0.5 * 15 / 8 / 2 * 2  # of the bound of 2 the other way, of 1 this way
        assert caps[0, "velocity", 0] == pytest.approx(speed * share, rel=1e-6)
        assert caps[0, "jerk", 1] == pytest.approx(0.2 * 60 / 8 * share**3, rel=1e-6)
        assert len(caps) == 6
    assert changed(over=[found("deviation", 1.21, 0, None)], stretched=True).stretches == {
        0: pytest.approx(1.1)
    }


def test_where_the_arm_stands_the_moves_beside_it_are_slowed() -> None:
    assert changed((1.002, 1, 1, 1)).stretches.keys() == {0, 2}
    assert changed((1.002, 1, 1, 2)).stretches.keys() == {2}


def test_what_no_slowness_cures_is_left() -> None:
    hopeless = [
        found("velocity", 1e4, 0),
        found("deviation", 31.0, 0, None),
        found("position", 1.1, 0),
        Finding("velocity", "j1", 1.1, 1.0),
    ]
    for one in hopeless:
        assert tightened(planned(), [found("velocity", 1.1, 0), one], (), Adaptation()) is None
    assert [may_be_cured(one) for one in hopeless] == [True, True, True, False]
    assert tightened(planned("error"), (), [(1.1, 1, 0, 0)], Adaptation()) is None
    assert tightened(planned(), (), (), Adaptation()) is None


@pytest.mark.parametrize(
    ("start", "used", "kind", "joint"),
    [
        ({"velocity": [0.5, -3]}, "150 % of the velocity", "velocity", "b"),
        ({"velocity": [1.25, -2.1]}, "125 % of the velocity", "velocity", "a"),
        ({"velocity": [0.5, 0], "acceleration": [-5, 0]}, "125 % of the acceleration", "acceleration", "a"),
        ({"velocity": [0, 0.5], "acceleration": [0, 12]}, "150 % of the acceleration", "acceleration", "b"),
    ],
)
def test_no_consumer_gets_rows_of_a_move_that_brakes_from_outside_of_its_limits(
    start: dict[str, Any], used: str, kind: str, joint: str
) -> None:
    """Bounds that differ by direction count in theirs, and a signal before the move is none that brakes."""
    text = (
        "version: 1\nrobot: {joints: [{name: a}, {name: b}]}\n"
        "limits: {velocity: [1, 2], acceleration: [[-4, 6], 8], jerk: 60}\n"
        f"start: {json.dumps({'joints': [0, 0], **start})}\nmoves:\n"
        "  - {signal: lamp, value: 1}\n  - {planner: jerk_limited, to: {joints: 1}, brake: true}\n"
    )
    plan = plan_job(job_from_text(text))
    assert plan.verdict.passed
    with pytest.raises(VerificationError) as caught:
        refuse_braking(plan, "for nobody")
    (problem,) = caught.value.problems
    said = f"for nobody: the move starts outside of its limits, and brakes: {used} of {joint} used"
    assert (problem.text(), problem.kind, problem.joint, problem.move) == (said, kind, joint, 1)
    assert problem.place is not None
    assert problem.place.line == 7
    refuse_braking(planned(), "for nobody")


def test_a_move_that_ends_on_a_row_is_stretched_from_there() -> None:
    """A trapezoid over 1 rad at 1 rad/s and 4 rad/s^2 lasts 1.25 s, and 1.3 s with rows at 10 Hz."""
    job = {
        "version": 1,
        "robot": {"joints": 1},
        "limits": {"velocity": 1, "acceleration": 4},
        "when_over_limit": "slow",
        "start": {"joints": [0]},
        "moves": [{"planner": "trapezoid", "to": {"joints": [1]}}],
        "output": {"rate": 10, "align": True},
    }
    adapted = Adaptation()
    plan = plan_job(job_from_text(json.dumps(job)), adapted=adapted)
    assert plan.trajectory.duration == pytest.approx(1.3, rel=1e-12)
    longer = tightened(plan, (), [(1.002, 1, 0, 0)], adapted)
    assert longer is not None
    assert longer.stretches == {0: pytest.approx(1.3 / 1.25 * 1.002, rel=1e-8)}
    again = plan_job(job_from_text(json.dumps(job)), adapted=longer)
    assert again.trajectory.duration == pytest.approx(1.4, rel=1e-12)


def test_what_one_move_of_a_chain_passes_makes_the_chain_slower_than_it_is() -> None:
    """All of a chain is stretched alike, by the most that is asked for in any of its moves."""
    move = {"planner": "jerk_limited", "zone": {"joints": 0.1}}
    job = {
        "version": 1,
        "robot": {"joints": 2},
        "limits": {"velocity": 2, "acceleration": 4, "jerk": 40},
        "when_over_limit": "slow",
        "start": {"joints": [0, 0]},
        "moves": [move | {"to": {"joints": to}} for to in ([1, 0], [1, 1])],
    }
    job["moves"][-1].pop("zone")
    loaded, adapted = job_from_text(json.dumps(job)), Adaptation(stretches={0: 1.2})
    plan, fastest = plan_job(loaded, adapted=adapted), plan_job(loaded).trajectory.duration
    assert plan.trajectory.duration == pytest.approx(1.2 * fastest, rel=1e-12)
    longer = tightened(plan, (), [(1.331, 3, 0, 1)], adapted, stretched=True)
    assert longer is not None
    assert longer.stretches == {0: 1.2, 1: pytest.approx(1.2 * 1.1, rel=1e-8)}
    assert plan_job(loaded, adapted=longer).trajectory.duration == pytest.approx(1.32 * fastest, rel=1e-8)


def test_a_move_that_limits_have_stretched_already_is_not_stretched_for_that_again() -> None:
    """A quintic over 0.5 rad in 0.25 s reaches 15/8 * 2 rad/s: within 1.5 it lasts 2.5 times as long."""
    job = {
        "version": 1,
        "robot": {"joints": 1},
        "limits": {"velocity": 1.5},
        "when_over_limit": "slow",
        "start": {"joints": [0]},
        "moves": [{"planner": "quintic", "to": {"joints": [0.5]}, "duration": 0.25}],
    }
    adapted = Adaptation()
    plan = plan_job(job_from_text(json.dumps(job)), adapted=adapted)
    assert plan.moves[0].stretch == pytest.approx(2.5, rel=1e-9)
    longer = tightened(plan, (), [(1.002, 1, 0, 0)], adapted)
    assert longer is not None
    assert longer.stretches == {0: pytest.approx(1.002, rel=1e-8)}
