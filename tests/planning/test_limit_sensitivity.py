"""Sensitivity: times at limits and savings, against closed forms and against jobs with higher limits."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import trajcli
from trajcli.curves.approach import ApproachLimits, durations_at_limit
from trajcli.curves.extrema import durations_above
from trajcli.job.read import job_from_text
from trajcli.planning.binding_limits import NEAR, RAISED, raised, savings_of, times_at_limits
from trajcli.planning.plan import Plan, plan_job


def planned(move: dict[str, Any], limits: dict[str, Any], joints: int = 1, **more: Any) -> Plan:
    fields = {
        "version": 1,
        "robot": {"joints": joints},
        "limits": limits,
        "start": {"joints": [0] * joints},
        "moves": [move],
        **more,
    }
    return trajcli.plan(fields)


def at_limits(plan: Plan, index: int = 0) -> dict[tuple[int, int], float]:
    verdict = plan.verdict
    times = times_at_limits(plan.moves[index], verdict.peaks[index], verdict.by_position[index])
    assert times == times_at_limits(plan.moves[index])  # peaks only spare work
    orders = ("", "velocity", "acceleration", "jerk", "velocity_by_position")
    return {(one.joint, orders.index(one.quantity)): one.seconds for one in times}


def saved(plan: Plan, index: int = 0) -> dict[tuple[int, int], float | None]:
    return {(one.joint, one.order): one.saved for one in savings_of(plan, [index])}


def test_a_trapezoid_of_velocity() -> None:
    """D = 3, v = 1, a = 2: v/a = 0.5 s of acceleration at each end, D/v - v/a = 2.5 s at the velocity.

    Near the velocity the ramp counts as soon as it is within a millionth: v/a 1e-6 at each end.
    """
    plan = planned({"planner": "trapezoid", "to": {"joints": [3]}}, {"velocity": 1, "acceleration": 2})
    times = at_limits(plan)
    assert times[0, 1] == pytest.approx(2.5 + 2 * 0.5 * NEAR, abs=1e-9)
    assert times[0, 2] == pytest.approx(1.0, abs=1e-9)
    # the duration is the distance over v, and v over a
    duration = lambda v, a: 3 / v + v / a  # noqa: E731
    savings = saved(plan)
    assert savings[0, 1] == pytest.approx(duration(1, 2) - duration(RAISED, 2), abs=1e-9)
    assert savings[0, 2] == pytest.approx(duration(1, 2) - duration(1, 2 * RAISED), abs=1e-9)


def test_a_double_s_velocity_profile() -> None:
    """D = 3, v = 1, a = 2, j = 20: jerk for 4 a/j, acceleration for 2 (v/a - a/j), T = D/v + v/a + a/j.

    Source: Biagiotti and Melchiorri, Trajectory Planning for Automatic Machines and Robots (2008), section 3.4.
    """
    v, a, j = 1.0, 2.0, 20.0
    plan = planned(
        {"planner": "jerk_limited", "to": {"joints": [3]}}, {"velocity": v, "acceleration": a, "jerk": j}
    )
    times = at_limits(plan)
    assert times[0, 3] == pytest.approx(4 * a / j, abs=1e-9)
    # the ramps of acceleration are near to it for a/j 1e-6 at each of four ends
    assert times[0, 2] == pytest.approx(2 * (v / a - a / j) + 4 * a / j * NEAR, abs=1e-9)
    # the velocity is near to its limit from sqrt(2 v 1e-6 / j) before it is there
    cruise = 3 / v - v / a - a / j
    assert times[0, 1] == pytest.approx(cruise + 2 * np.sqrt(2 * v * NEAR / j), abs=1e-9)
    duration = lambda v, a, j: 3 / v + v / a + a / j  # noqa: E731
    savings = saved(plan)
    for order, limits in ((1, (v * RAISED, a, j)), (2, (v, a * RAISED, j)), (3, (v, a, j * RAISED))):
        assert savings[0, order] == pytest.approx(duration(v, a, j) - duration(*limits), abs=1e-9)


def test_a_quintic_touches_its_limit() -> None:
    """Its peak velocity 15/8 D/T is inversely proportional to T: a tenth more saves T (1 - 1/1.1).

    Near its peak v (1 - 8 (u - 1/2)^2 + ...): within 1e-6 for 2 sqrt(1e-6 / 8) T.
    """
    plan = planned({"planner": "quintic", "to": {"joints": [1.5]}}, {"velocity": 1})
    duration = 15 / 8 * 1.5
    assert plan.trajectory.duration == pytest.approx(duration, rel=1e-9)
    times = at_limits(plan)
    assert times.keys() == {(0, 1)}
    assert times[0, 1] == pytest.approx(2 * np.sqrt(NEAR / 8) * duration, rel=1e-5)
    assert saved(plan)[0, 1] == pytest.approx(duration * (1 - 1 / RAISED), rel=1e-9)


def test_an_acceleration_counts_with_its_square_root() -> None:
    plan = planned({"planner": "quintic", "to": {"joints": [1.5]}}, {"velocity": 100, "acceleration": 1})
    assert saved(plan) == {(0, 2): pytest.approx(plan.trajectory.duration * (1 - RAISED**-0.5), rel=1e-9)}


def test_joints_that_bind_together_save_nothing_alone() -> None:
    plan = planned({"planner": "quintic", "to": {"joints": [1, 1]}}, {"velocity": 1}, joints=2)
    assert saved(plan) == {(0, 1): pytest.approx(0, abs=1e-12), (1, 1): pytest.approx(0, abs=1e-12)}


def test_a_given_duration_saves_nothing() -> None:
    plan = planned({"planner": "quintic", "to": {"joints": [1]}, "duration": 5}, {"velocity": 1})
    assert saved(plan) == {}
    slow = planned(
        {"planner": "quintic", "to": {"joints": [1]}, "duration": 1, "when_over_limit": "slow"},
        {"velocity": 1},
    )
    assert saved(slow)[0, 1] == pytest.approx(15 / 8 * (1 - 1 / RAISED), rel=1e-6)
    # no faster than it is told to be
    nearly = planned(
        {"planner": "quintic", "to": {"joints": [1]}, "duration": 1.8, "when_over_limit": "slow"},
        {"velocity": 1},
    )
    assert saved(nearly)[0, 1] == pytest.approx(15 / 8 - 1.8, rel=1e-6)


MOVES = {
    "jerk_limited": {"planner": "jerk_limited", "to": {"joints": [1.0, -0.7, 0.4]}},
    "path": {
        "planner": "time_optimal",
        "through": [{"joints": [0.5, 0.2, 0.1]}, {"joints": [0.2, -0.4, 0.9]}],
    },
    "trapezoid": {"planner": "trapezoid", "to": {"joints": [1.0, -0.7, 0.4]}},
    "spline": {"planner": "spline", "through": [{"joints": [0.5, 0.2, 0.1]}, {"joints": [0.2, -0.4, 0.9]}]},
}


@pytest.mark.parametrize("kind", MOVES)
def test_the_job_with_the_raised_limit_is_faster_by_that(kind: str) -> None:
    """An oracle beside: the same job, the limit written into its file."""
    values = {"velocity": [1.0, 0.8, 1.2], "acceleration": [2.0, 3.0, 2.5]}
    if kind == "jerk_limited":
        values["jerk"] = [30.0, 25.0, 20.0]
    plan = planned(MOVES[kind], values, joints=3)
    savings = saved(plan)
    assert savings
    for (joint, order), saving in savings.items():
        name = ("", "velocity", "acceleration", "jerk")[order]
        higher = {**values, name: [v * (RAISED if k == joint else 1) for k, v in enumerate(values[name])]}
        faster = planned(MOVES[kind], higher, joints=3)
        assert saving == pytest.approx(
            plan.trajectory.duration - faster.trajectory.duration, rel=1e-9, abs=1e-12
        )


@pytest.mark.full
def test_a_limit_of_a_move_that_is_flown_by_saves_what_the_whole_chain_gains() -> None:
    """An oracle beside: the same job, the limit written into its file, and taken back for the other move."""
    limits = {"velocity": [3.0, 3.0], "acceleration": [8.0, 8.0], "jerk": [60.0, 60.0]}
    higher = {**limits, "jerk": [60.0, 60.0 * RAISED]}
    moves = [{"planner": "jerk_limited", "to": {"joints": each}} for each in ([0.9, 1.25], [1.0, 2.0])]
    job = {"version": 1, "robot": "planar2r", "start": {"joints": [0.3, 1.2]}, "zone": 0.02}
    plan = plan_job(job_from_text(json.dumps({**job, "limits": limits, "moves": moves})))
    savings = {(one.joint, one.order): one.saved for one in savings_of(plan, [1])}
    assert min(savings.values()) >= 0
    moves[0] = {**moves[0], "limits": {"jerk": limits["jerk"]}}
    faster = plan_job(job_from_text(json.dumps({**job, "limits": higher, "moves": moves})))
    gained = plan.trajectory.duration - faster.trajectory.duration
    assert savings[1, 3] == pytest.approx(gained, rel=1e-3)
    assert gained > 0.005


def test_a_path_binds_all_the_time() -> None:
    """A time-optimal law is at a limit at every time; a corner-free line in joint space has a closed form."""
    plan = planned(
        {"planner": "time_optimal", "through": [{"joints": [1.5]}, {"joints": [3]}]},
        {"velocity": 1, "acceleration": 2},
    )
    times = at_limits(plan)
    assert sum(times.values()) == pytest.approx(plan.trajectory.duration, rel=1e-6)
    assert times[0, 2] == pytest.approx(1.0, abs=0.02)
    assert saved(plan)[0, 1] == pytest.approx(3.5 - (3 / RAISED + RAISED / 2), abs=1e-4)


@pytest.mark.full
def test_a_limit_by_position_against_dense_samples() -> None:
    """x = (2 - t)^2 ahead of the end is what a deceleration of 2 leaves: at the limit all the time.

    Beside it the share of 10^5 times at which random cubics are above their limits.
    """
    stop = ApproachLimits(np.array([[-10.0, 0.0]]), np.array([2.0]), np.array([0.0]))
    q, lengths = np.array([-1.0, 4.0, -4.0])[:, None, None], np.array([1.5])
    assert durations_at_limit(q, lengths, stop, 1e-6)[0] == pytest.approx(1.5, abs=1e-9)
    assert durations_at_limit(0.999 * q, lengths, stop, 1e-6)[0] == 0
    # away from the end nothing holds it
    away = np.array([-1.0, -1.0, -0.25])[:, None, None]
    assert durations_at_limit(away, lengths, stop, 1e-6)[0] == 0
    rng = np.random.default_rng(4)
    pieces, joints = 30, 2
    coefficients, spans = rng.normal(size=(4, pieces, joints)), rng.uniform(0.4, 1.2, pieces)
    some = ApproachLimits(np.tile([-4.0, 4.0], (joints, 1)), np.array([0.5, 1.5]), np.array([0.1, 0.3]))
    counted, u = np.zeros(joints), (np.arange(100_000) + 0.5) / 100_000
    for piece in range(pieces):
        for joint in range(joints):
            own, t = coefficients[:, piece, joint], u * spans[piece]
            position, velocity = np.polyval(own, t), np.polyval(np.polyder(own), t)
            low, high = some.bounds(np.stack([position] * joints, axis=1))
            over = (velocity >= high[:, joint]) | (velocity <= low[:, joint])
            counted[joint] += over.mean() * spans[piece]
    assert (counted > 1).all()
    assert durations_at_limit(coefficients, spans, some, 1e-6) == pytest.approx(counted, abs=1e-3)


def test_a_move_that_slides_along_its_limit_by_position() -> None:
    """Both with and without what the verdict knows: the fastest approach is at the limit for a moment."""
    arm = {
        "position": [-2, 2],
        "velocity": 3,
        "acceleration": 20,
        "velocity_by_position": {"deceleration": 1, "offset": 0.1},
    }
    plan = trajcli.plan(
        {
            "version": 1,
            "robot": {"joints": [arm]},
            "start": {"joints": [0]},
            "moves": [{"planner": "quintic", "to": {"joints": [1.9]}}],
        }
    )
    times = at_limits(plan)
    assert times.keys() == {(0, 4)}
    assert 0 < times[0, 4] < 0.05 * plan.trajectory.duration


def test_against_dense_samples() -> None:
    """Durations above a level of random polynomials, by counting at a million times."""
    rng = np.random.default_rng(11)
    coefficients = rng.normal(size=(6, 20, 2))
    lengths = rng.uniform(0.3, 2.0, 20)
    levels = np.array([0.2, -0.4])
    got = durations_above(coefficients, lengths, levels)
    u = (np.arange(200_000) + 0.5) / 200_000
    for piece in range(20):
        for component in range(2):
            values = np.polyval(coefficients[:, piece, component], u * lengths[piece])
            counted = np.mean(values >= levels[component]) * lengths[piece]
            assert got[piece, component] == pytest.approx(counted, abs=2e-5)


def test_a_raised_limit_is_one_limit() -> None:
    plan = planned(
        {"planner": "quintic", "to": {"joints": [1, 1]}}, {"velocity": 1, "acceleration": 3}, joints=2
    )
    before = plan.moves[0].robot.limits
    after = raised(before, 1, 2)
    assert (after.acceleration == [[-3, 3], [-3 * RAISED, 3 * RAISED]]).all()
    assert (after.velocity == before.velocity).all()


def test_time_is_bounded() -> None:
    plan = planned({"planner": "quintic", "to": {"joints": [1]}}, {"velocity": 1})
    (one,) = savings_of(plan, [0], seconds=-1.0)
    assert one.saved is None
    assert one.reason == "not planned: -1 s have passed"


def test_explain_says_it(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    from trajcli.cli.app import app

    job = tmp_path / "job.json"
    fields = {
        "version": 1,
        "units": {"angle": "deg"},
        "robot": {"joints": 1},
        "limits": {"velocity": 90},
        "start": {"joints": [0]},
        "moves": [
            {"planner": "quintic", "to": {"joints": [90]}},
            {"planner": "quintic", "to": {"joints": [0]}},
            {"planner": "hold", "duration": 1},
        ],
    }
    job.write_text(json.dumps(fields))
    with pytest.raises(SystemExit):
        app(["explain", str(job), "--sensitivity", "--json"])
    view = json.loads(capfd.readouterr().out)
    duration = 15 / 8
    for move in view["moves"][:2]:
        assert move["at_limit"] == [
            {
                "joint": "j1",
                "quantity": "velocity",
                "seconds": pytest.approx(2 * np.sqrt(NEAR / 8) * duration, rel=1e-5),
                "share": pytest.approx(2 * np.sqrt(NEAR / 8), rel=1e-5),
                "method": "exact",
            }
        ]
        saving = move["savings"][0]
        assert saving["saved"] == pytest.approx(duration * (1 - 1 / RAISED))
        assert saving["share"] == pytest.approx(1 - 1 / RAISED)
    assert view["moves"][2]["savings"] == []
    assert view["savings"][0]["saved"] == pytest.approx(2 * duration * (1 - 1 / RAISED))
    with pytest.raises(SystemExit):
        app(["explain", str(job), "--sensitivity"])
    out = capfd.readouterr().out
    assert "  10 % more velocity of j1 would save 0.170455 s (9.091 %)" in out
    assert "all moves together:\n  10 % more velocity of j1 would save 0.340909 s (9.091 %)" in out
    assert "  at its limits: velocity of j1 for 0.00132583 s (0.07071 %)" in out
    with pytest.raises(SystemExit):
        app(["explain", str(job), "--json"])
    assert json.loads(capfd.readouterr().out)["savings"] is None


@pytest.mark.full
def test_a_search_from_the_motion_that_is_known_finds_what_one_from_nothing_finds() -> None:
    """What a job with the higher limits lasts, searched from all of its own starting points."""
    points = [{"joints": at} for at in ([0.5, 0.2], [0.8, 0.9])]
    move = {"planner": "waypoints", "through": points, "to": {"joints": [1.5, 1.0]}, "starts": 1}
    limits = {"velocity": 3, "acceleration": 8, "jerk": 60}
    plan = planned(move, limits, 2)
    savings = saved(plan)
    assert len(savings) > 1
    for (joint, order), seconds in savings.items():
        name = ("", *limits)[order]
        higher = {**limits, name: [limits[name] * (RAISED if k == joint else 1) for k in range(2)]}
        anew = planned(move, higher, 2)
        assert seconds is not None
        assert seconds >= -1e-9
        assert plan.trajectory.duration - seconds == pytest.approx(anew.trajectory.duration, rel=1e-3)


@pytest.mark.full
def test_a_higher_limit_costs_no_time() -> None:
    """What keeps a limit keeps a higher one: a search that finds a slower motion with it saves nothing."""
    through = [{"joints": q} for q in np.random.default_rng(1).uniform(-1, 1, (5, 2)).tolist()]
    limits = {"velocity": [1, 2], "acceleration": [3, 4], "jerk": [20, 30]}
    plan = planned({"planner": "time_optimal", "through": through}, limits, joints=2)
    found = saved(plan)
    assert len(found) >= 4
    assert min(0.0 if value is None else value for value in found.values()) == 0.0


def test_a_duration_that_was_asked_for_is_the_least_that_a_higher_limit_saves() -> None:
    """2 rad with v = 1 and a = 3 take 2 + 1/3 s: asked for are 2.3 s, which v = 1.1 would allow."""
    move = {"planner": "time_optimal", "through": [{"joints": [1]}], "to": {"joints": [2]}, "duration": 2.3}
    plan = planned({**move, "when_over_limit": "slow"}, {"velocity": 1, "acceleration": 3})
    assert plan.trajectory.duration == pytest.approx(7 / 3, rel=1e-3)
    assert saved(plan)[0, 1] == pytest.approx(plan.trajectory.duration - 2.3, rel=1e-6)
    enough = planned({**move, "duration": 5, "when_over_limit": "slow"}, {"velocity": 1, "acceleration": 3})
    assert saved(enough) == {}


def test_of_a_law_at_its_limits_the_joints_that_bind_are_named_the_longest_first() -> None:
    """The second joint goes half as far with a tenth of the limit: it binds, and the first one never."""
    through = [{"joints": [0.5, 0.25]}]
    move = {"planner": "time_optimal", "through": through, "to": {"joints": [1, 0.5]}}
    plan = planned(move, {"velocity": [5, 0.5], "acceleration": [20, 2]}, joints=2)
    times = times_at_limits(plan.moves[0])
    assert {(one.joint, one.method) for one in times} == {(1, "phases")}
    # 0.5 rad with 0.5 rad/s and 2 rad/s^2: 0.25 s of acceleration at each end, 0.75 s of velocity
    assert [one.quantity for one in times] == ["velocity", "acceleration"]
    assert [one.seconds for one in times] == pytest.approx([0.75, 0.5], abs=0.02)
    swapped = planned(move, {"velocity": [5, 5], "acceleration": [20, 2]}, joints=2)
    assert [one.quantity for one in times_at_limits(swapped.moves[0])] == ["acceleration"]


def test_the_longest_time_at_a_limit_comes_first() -> None:
    """3 rad: 2.5 s at the velocity, 1 s of acceleration; 1.2 rad: 0.7 s and 1 s."""
    for distance, first in ((3, "velocity"), (1.2, "acceleration")):
        plan = planned(
            {"planner": "trapezoid", "to": {"joints": [distance]}}, {"velocity": 1, "acceleration": 2}
        )
        times = times_at_limits(plan.moves[0])
        assert times[0].quantity == first
        assert sorted((one.seconds for one in times), reverse=True) == [one.seconds for one in times]


def test_after_its_time_each_limit_is_named_and_none_is_planned() -> None:
    plan = planned({"planner": "trapezoid", "to": {"joints": [3, 3]}}, {"velocity": 1, "acceleration": 2}, 2)
    late = list(savings_of(plan, [0], seconds=-1.0))
    assert {(one.joint, one.order, one.saved) for one in late} == {
        (joint, order, None) for joint in (0, 1) for order in (1, 2)
    }
    assert {one.reason for one in late} == {"not planned: -1 s have passed"}


def test_where_no_limit_of_a_joint_binds_those_of_joints_that_move_are_tried() -> None:
    """The speed of the tool holds it: a joint that stands still has nothing to do with that."""
    move = {"planner": "quintic", "to": {"joints": [1, 0]}}
    limits = {"velocity": 5, "acceleration": [30, 40], "tcp": {"speed": 0.2}}
    plan = planned(move, limits, joints=2, robot="planar2r")
    assert saved(plan) == {(0, 1): pytest.approx(0, abs=1e-9), (0, 2): pytest.approx(0, abs=1e-9)}
