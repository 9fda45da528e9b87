"""Planners within limits of velocity by position: FR3's numbers, judged by samples; fastest motions by integrals."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from random_jobs import loaded

from trajcli.cli.plan import summary
from trajcli.errors import InputError, PlanningError
from trajcli.job.dump import dump_job
from trajcli.job.read import job_from_text
from trajcli.output.report import report_of
from trajcli.planning.plan import Plan, plan_job

# libfranka test/fr3.urdf: upper end of the range, deceleration, offset of joints 1 and 2
JOINTS = [(2.7501, 6.0, 0.30), (1.7918, 2.585, 0.20)]
ROBOT = {
    "joints": [
        {
            "position": [-end, end],
            "velocity": 20,
            "acceleration": 30,
            "velocity_by_position": {"deceleration": d, "offset": o},
        }
        for end, d, o in JOINTS
    ]
}


def planned(*moves: dict[str, Any], **more: Any) -> Plan:
    start = more.pop("start", {"joints": [0, 0]})
    return plan_job(loaded({"version": 1, "robot": ROBOT, "start": start, "moves": list(moves), **more}))


def sampled_use(plan: Plan) -> float:
    """Return the largest v / (sqrt(2 d x) - o) of all joints, by its definition at many times."""
    curve, worst = plan.trajectory.curve, 0.0
    t = np.linspace(curve.start, curve.end, 200_001)
    for joint, (end, d, o) in enumerate(JOINTS):
        q, v = curve.evaluate(t)[:, joint], curve.evaluate(t, 1)[:, joint]
        bound = np.sqrt(2 * d * np.where(v > 0, end - q, q + end)) - o
        worst = max(worst, float((np.abs(v) / bound).max()))
    return worst


FAR = {"joints": [2.5, -1.6]}
MOVES: dict[str, dict[str, Any]] = {
    "jerk_limited": {"to": FAR, "limits": {"jerk": 5000}},
    "trapezoid": {"to": FAR},
    "cubic": {"to": FAR},
    "quintic": {"to": FAR},
    "septic": {"to": FAR},
    "cycloidal": {"to": FAR},
    "spline": {"through": [{"joints": [1.5, -1.2]}], "to": FAR},
    "blends": {"through": [{"joints": [1.5, -1.2]}], "to": FAR},
    "time_optimal": {"through": [{"joints": [1.5, -1.2]}], "to": FAR},
}


@pytest.mark.parametrize("planner", MOVES)
def test_planners_that_find_their_duration_keep_the_limits_and_use_all_of_them(planner: str) -> None:
    plan = planned({"planner": planner, **MOVES[planner]})
    assert plan.verdict.passed
    assert 0.999 < sampled_use(plan) <= 1 + 1e-7
    stretches = [e for e in plan.events if "velocity by position" in e.message]
    assert bool(stretches) is (planner != "time_optimal")


@pytest.mark.full
def test_without_the_limits_the_same_moves_are_faster() -> None:
    free = {"joints": [{k: v for k, v in j.items() if k != "velocity_by_position"} for j in ROBOT["joints"]]}
    for planner, move in MOVES.items():
        job = {
            "version": 1,
            "robot": free,
            "start": {"joints": [0, 0]},
            "moves": [{"planner": planner, **move}],
        }
        other = plan_job(loaded(job))
        assert other.trajectory.duration < planned({"planner": planner, **move}).trajectory.duration
        assert sampled_use(other) > 1.01


@pytest.mark.full
def test_a_time_optimal_motion_follows_the_limit_as_the_integral_says() -> None:
    """Without other limits it takes the integral of dq / (sqrt(2 d x) - o): (y + o ln(y - o)) / d, y^2 = 2 d x."""
    d, o, end = 2.0, 0.3, 3.0
    near = {"deceleration": d, "offset": o}
    robot = {"joints": [{"position": [-end, end], "acceleration": 1e5, "velocity_by_position": near}]}

    def antiderivative(x: float) -> float:
        y = np.sqrt(2 * d * x)
        return float((y + o * np.log(y - o)) / d)

    for target in (2.0, 2.9, -2.9):
        job = {
            "version": 1,
            "robot": robot,
            "start": {"joints": [0]},
            "moves": [
                {"planner": "time_optimal", "through": [{"joints": [target / 3]}], "to": {"joints": [target]}}
            ],
        }
        plan = plan_job(loaded(job))
        assert plan.verdict.passed
        fastest = antiderivative(end) - antiderivative(end - abs(target))
        assert fastest < plan.trajectory.duration < 1.0025 * fastest


def test_a_given_duration_is_judged_and_slowed_only_where_that_is_asked_for() -> None:
    move = {"planner": "quintic", "to": FAR, "duration": 1.4}
    plan = planned(move)
    assert {f.kind for f in plan.verdict.findings} >= {"velocity_by_position"}
    assert plan.trajectory.duration == 1.4
    slowed = planned({**move, "when_over_limit": "slow"})
    assert slowed.verdict.passed
    assert slowed.trajectory.duration == pytest.approx(1.4 * sampled_use(plan), rel=1e-8)
    assert [e.kind for e in slowed.events] == ["slowed"]


@pytest.mark.full
def test_a_move_between_moving_states_is_slowed_too() -> None:
    moves = [
        {"planner": "quintic", "to": {"joints": [0.5, 0], "velocity": [0.5, 0]}, "duration": 1.5},
        {"planner": "quintic", "to": {"joints": [2.6, 0]}, "duration": 0.8, "when_over_limit": "slow"},
    ]
    plan = planned(*moves)
    assert plan.verdict.passed
    assert sampled_use(plan) == pytest.approx(1.0, abs=1e-6)


def test_a_move_that_must_start_too_fast_says_so() -> None:
    start = {"joints": [2.7, 0], "velocity": [0.8, 0]}
    move = {"planner": "quintic", "to": {"joints": [2.72, 0]}, "duration": 0.2, "when_over_limit": "slow"}
    plan = planned(move, start=start)
    hints = {str(f.hint) for f in plan.verdict.findings if f.kind == "velocity_by_position"}
    assert any("so near to its position limit" in hint for hint in hints)


def test_a_target_where_the_joint_may_not_move_is_refused_by_name() -> None:
    end, d, o = JOINTS[0]
    target = {"joints": [end - 0.5 * o**2 / (2 * d), 0]}
    with pytest.raises(PlanningError, match="j1 would move towards its position limit"):
        planned({"planner": "time_optimal", "through": [{"joints": [1, 0]}], "to": target})
    plan = planned({"planner": "quintic", "to": target, "when_over_limit": "slow"})
    (found,) = plan.verdict.findings
    assert (found.kind, found.factor) == ("velocity_by_position", None)
    assert "it may not move towards it" in found.message


def test_a_scale_of_velocities_scales_this_limit_too() -> None:
    whole = planned({"planner": "quintic", "to": FAR}, limits={"velocity": None, "acceleration": 1000})
    half = planned(
        {"planner": "quintic", "to": FAR},
        limits={"velocity": None, "acceleration": 1000, "scale": {"velocity": 0.5}},
    )
    assert half.trajectory.duration == pytest.approx(2 * whole.trajectory.duration, rel=1e-9)


def test_a_tighter_range_of_a_move_brings_the_limit_nearer() -> None:
    move = {"planner": "quintic", "to": FAR, "limits": {"position": {"j2": [-1.65, 1.65]}}}
    assert (
        planned(move).trajectory.duration
        > 1.2 * planned({"planner": "quintic", "to": FAR}).trajectory.duration
    )


@pytest.mark.full
@pytest.mark.parametrize("shape", ["quintic", "jerk_limited", "time_optimal", "cycloidal"])
def test_laws_of_tool_paths_keep_the_limits(shape: str) -> None:
    near = {"deceleration": 1.0, "offset": 0.1}
    joint = {"a": 0.5, "velocity": 5, "acceleration": 30}
    robot = {
        "convention": "standard",
        "joints": [
            {**joint, "position": [-1, 1], "velocity_by_position": near},
            {**joint, "position": [-3, 3]},
        ],
    }
    tcp = {"speed": 4, "acceleration": 40} | ({"jerk": 2000} if shape == "jerk_limited" else {})
    job = {
        "version": 1,
        "robot": robot,
        "limits": {"tcp": tcp},
        "start": {"joints": [0.0, 1.0]},
        "moves": [{"planner": "line", "to": {"xyz": [0.15, 0.86, 0]}, "law": {"shape": shape}}],
    }
    plan = plan_job(loaded(job))
    assert plan.verdict.passed, plan.verdict.findings
    curve = plan.trajectory.curve
    t = np.linspace(0, curve.end, 50_001)
    q, v = curve.evaluate(t)[:, 0], curve.evaluate(t, 1)[:, 0]
    used = v / (np.sqrt(2 * (1 - q)) - 0.1)
    assert any(e.kind == "stretched" for e in plan.events) is (shape != "time_optimal")
    assert 0.99 < used.max() <= 1 + 1e-7


def test_report_summary_and_explanation_say_how_much_is_used() -> None:
    plan = planned({"planner": "quintic", "to": FAR})
    move = report_of(plan).moves[0]
    assert move.velocity_by_position is not None
    most = max(move.velocity_by_position, key=lambda each: each.used)
    assert most.used == pytest.approx(sampled_use(plan), abs=1e-6)
    assert (most.unit, most.distance_unit) == ("rad/s", "rad")
    assert move.binding is not None
    assert move.binding.quantity == "velocity_by_position"
    assert "velocity by position of " + most.joint in summary(plan, 1)


def test_a_resolved_job_has_the_same_limits() -> None:
    first = loaded(
        {
            "version": 1,
            "robot": ROBOT,
            "start": {"joints": [0, 0]},
            "moves": [{"planner": "quintic", "to": FAR}],
        }
    )
    second = job_from_text(dump_job(first))
    assert np.array_equal(first.robot.limits.velocity_by_position, second.robot.limits.velocity_by_position)


def test_units_of_the_job_count() -> None:
    near = {"deceleration": 180, "offset": "0.1 rad/s"}
    slide = {
        "type": "prismatic",
        "position": [0, 500],
        "velocity_by_position": {"deceleration": 2000, "offset": 50},
    }
    job = {
        "version": 1,
        "units": {"angle": "deg", "length": "mm"},
        "robot": {"joints": [{"position": [-90, 90], "velocity_by_position": near}, slide]},
        "start": {"joints": [0, 100]},
        "moves": [{"planner": "hold", "duration": 1}],
    }
    assert loaded(job).robot.limits.velocity_by_position == pytest.approx(
        np.array([[np.pi, 0.1], [2.0, 0.05]])
    )


@pytest.mark.parametrize(
    ("joint", "limits", "message"),
    [
        ({"velocity_by_position": {"deceleration": 2}}, None, "of j1 needs its position limits"),
        *(
            (
                {"position": ends, "velocity_by_position": {"deceleration": 2}},
                None,
                "of j1 needs its position",
            )
            for ends in ([None, 1], [-1, None])
        ),
        *(
            (
                {"position": 1, "velocity_by_position": {"deceleration": 2}},
                {"position": [ends]},
                "j1 has velo",
            )
            for ends in ([None, 1], [-1, None])
        ),
        ({"position": 1, "velocity_by_position": {"deceleration": 0}}, None, "expected a number above 0"),
        ({"position": 1, "velocity_by_position": {"deceleration": 1, "offset": -1}}, None, "at least 0"),
        ({"position": 1, "velocity_by_position": {"offset": 1}}, None, "deceleration"),
        ({"position": 1, "velocity_by_position": {"decel": 1}}, None, "decel"),
        (
            {"position": 1, "velocity_by_position": {"deceleration": 2}},
            {"position": None},
            "j1 has velocity_by",
        ),
    ],
)
def test_what_is_wrong_is_refused_where_it_stands(joint: Any, limits: Any, message: str) -> None:
    job = {
        "version": 1,
        "robot": {"joints": [joint]},
        "start": {"joints": [0]},
        "limits": limits or {"jerk": 1},
    }
    with pytest.raises(InputError, match=message) as caught:
        loaded({**job, "moves": [{"planner": "hold", "duration": 1}]})
    assert caught.value.problems[0].place is not None
