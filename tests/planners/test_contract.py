"""What every planner promises, whichever it is, over arms of every kind."""

from __future__ import annotations

import numpy as np
import pytest
from random_jobs import MOST_JOINTS, TAGS, only_move, random_job
from tiers import few

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.errors import InputError, MissingLimitError, PlanningError
from trajcli.kinematics.robot import Robot
from trajcli.planners import PLANNERS, Planner
from trajcli.planners.planner import Planned
from trajcli.trajectory import State

MET = 1e-12  # relative to the joint's peak of the same quantity
JOINED = 1e-9  # the same, between pieces
ROUNDS = 40
ATTRIBUTES = ("position", "velocity", "acceleration")


def planned_twice(planner: Planner, start: State, robot: Robot) -> Planned | None:
    """Return what the planner returns, or None where it refuses; both times alike."""
    outcomes: list[Planned | str] = []
    for _ in range(2):
        try:
            outcomes.append(planner.plan(start, robot))
        except (PlanningError, MissingLimitError) as error:
            outcomes.append("\n".join(f"{problem.text()} ({problem.hint})" for problem in error.problems))
    first, second = outcomes
    if isinstance(first, str) or isinstance(second, str):
        assert first == second
        assert "(None)" not in first, "an error says what would fix it"
        assert not first.startswith(" ")
        return None
    assert first.curve.breaks.tobytes() == second.curve.breaks.tobytes()
    assert first.curve.coefficients.tobytes() == second.curve.coefficients.tobytes()
    assert (first.phases, first.events, first.arrivals) == (second.phases, second.events, second.arrivals)
    return first


def peaks_of(curve: PiecewisePolynomial, order: int) -> np.ndarray:
    """Return the largest absolute value by joint, (n,), from samples: near enough for a scale."""
    inside = curve.breaks[:-1, None] + curve.lengths[:, None] * np.linspace(0, 1, 9)[None, 1:-1]
    values = np.concatenate([*curve.piece_ends(order), curve.evaluate(inside.ravel(), order)])
    return np.abs(values).max(axis=0)


def assert_keeps_contract(planner: Planner, start: State, robot: Robot, planned: Planned) -> None:
    curve, n = planned.curve, len(robot.joints)
    assert curve.start == 0.0
    assert curve.dimension == n
    assert np.isfinite(curve.coefficients).all()
    assert np.isfinite(curve.breaks).all()
    if curve.duration == 0:  # nothing moves: the arm is there already
        assert np.array_equal(start.position, planned.end.position)
        return
    start = planned.begins or start
    for order, quantity in enumerate(ATTRIBUTES[: (planned.continuity or planner.joins) + 1]):
        scale = peaks_of(curve, order)
        first, last = curve.piece_ends(order)
        assert (np.abs(first[0] - getattr(start, quantity)) <= MET * scale).all(), (quantity, "start")
        assert (np.abs(last[-1] - getattr(planned.end, quantity)) <= MET * scale).all(), (quantity, "end")
        assert (np.abs(first[1:] - last[:-1]) <= JOINED * scale).all(), (quantity, "inside")


def assert_ends_at_target(planner: Planner, start: State, end: State) -> None:
    target = getattr(planner, "to", None)
    n = start.position.size
    if target is None:
        assert np.array_equal(end.position, start.position)
        assert end.at_rest
        return
    if target.joints is not None:
        np.testing.assert_allclose(end.position, target.joints, rtol=MET, atol=MET)
    assert np.array_equal(end.velocity, target.velocity or np.zeros(n))
    assert np.array_equal(end.acceleration, target.acceleration or np.zeros(n))


def assert_explains_itself(planned: Planned, start: State) -> None:
    duration = planned.curve.duration
    times = [0.0, *(t for phase in planned.phases for t in (phase.start, phase.end)), duration]
    assert min(times) >= 0
    assert max(times) <= duration * (1 + 1e-12)
    assert [phase.start for phase in planned.phases] == sorted(
        phase.start for phase in planned.phases
    ) or any(phase.joint is not None for phase in planned.phases)
    if planned.arrivals is not None:
        assert max(planned.arrivals) <= duration * (1 + 1e-12)
    if planned.law is not None:
        t = np.linspace(0, duration, 40)
        path = start.position + planned.law.evaluate(t) * (planned.end.position - start.position)
        np.testing.assert_allclose(planned.curve.evaluate(t), path, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("tag", few(TAGS, 6))
def test_contract(tag: str) -> None:
    seeds, kept = few(range(ROUNDS), 4), 0
    for seed in seeds:
        rng = np.random.default_rng([seed, *tag.encode()])
        job = random_job(
            rng, tag, 1 + seed % MOST_JOINTS, rest=seed % 3 == 0, unlimited=(0.0, 0.2, 1.0)[seed % 8 % 3]
        )
        try:
            planner, start, robot = only_move(job)
        except InputError as error:
            pytest.fail(f"{job}: {error}")
        planned = planned_twice(planner, start, robot)
        if planned is not None:
            kept += 1
            assert_keeps_contract(planner, start, robot, planned)
            if planned.begins is None:  # else the method decides with what velocity it ends
                assert_ends_at_target(planner, start, planned.end)
            assert_explains_itself(planned, start)
    assert kept >= len(seeds) / 4, "too few of the moves were possible for this to say something"


@pytest.mark.parametrize("tag", TAGS)
@pytest.mark.parametrize("joints", [1, 6])
def test_a_move_of_no_length_is_held(tag: str, joints: int) -> None:
    rng = np.random.default_rng(joints)
    job = random_job(rng, tag, joints, rest=True, unlimited=0.0)
    durations = {}
    for field in ("duration", "minimum_duration", None):
        if (field is None and tag == "hold") or (field and field not in PLANNERS[tag].model_fields):
            continue
        to = {} if tag == "hold" else {"to": {"joints": job["start"]["joints"]}}
        job["moves"] = [{"planner": tag, **to, **({field: 2.0} if field else {})}]
        planner, start, robot = only_move(job)
        planned = planner.plan(start, robot)
        durations[field] = planned.curve.duration
        assert np.array_equal(planned.end.position, start.position)
        at = np.linspace(0, planned.curve.duration, 5)
        assert np.array_equal(planned.curve.evaluate(at), np.tile(start.position, (5, 1)))
        assert planned.end.at_rest
    assert durations.pop(None, 0.0) == 0.0
    assert set(durations.values()) <= {2.0}
    assert durations or tag == "waypoints"  # whose segments have shortest durations


@pytest.mark.parametrize("tag", [tag for tag in TAGS if tag != "hold"])
def test_a_move_without_limits_says_which_limit_it_needs(tag: str) -> None:
    job = {
        "version": 1,
        "robot": {"joints": 2},
        "start": {"joints": [0, 0]},
        "moves": [{"planner": tag, "to": {"joints": [0, 1]}}],
    }
    planner, start, robot = only_move(job)
    with pytest.raises(MissingLimitError, match="j2") as caught:
        planner.plan(start, robot)
    assert "j1" not in str(caught.value), "a joint that does not move needs no limit"
    assert "limits" in (caught.value.problems[0].hint or "")


@pytest.mark.parametrize("tag", ["cycloidal", "hold"])
@pytest.mark.parametrize("quantity", ["velocity", "acceleration"])
def test_rest_is_required_where_it_is_promised(tag: str, quantity: str) -> None:
    job = {
        "version": 1,
        "robot": {"joints": 2},
        "start": {"joints": [0, 0]},
        "moves": [{"planner": tag, "duration": 1.0, **({} if tag == "hold" else {"to": {"joints": [0, 1]}})}],
    }
    planner, start, robot = only_move(job)
    moving = {name: getattr(start, name) for name in ATTRIBUTES} | {quantity: np.array([0.0, 0.1])}
    with pytest.raises(PlanningError, match=f"{quantity} of j2"):
        planner.plan(State(**moving), robot)


@pytest.mark.parametrize("tag", [tag for tag in TAGS if tag != "hold"])
def test_opposite_displacements_are_mirror_images(tag: str) -> None:
    curves = []
    for sign in (1, -1):
        limits = {"velocity": 2.0, "acceleration": 5.0, "jerk": 40.0}
        job = {
            "version": 1,
            "robot": {"joints": 2},
            "limits": limits,
            "start": {"joints": [0, 0]},
            "moves": [{"planner": tag, "to": {"joints": [sign * 1.5, sign * -0.4]}}],
        }
        planner, start, robot = only_move(job)
        curves.append(planner.plan(start, robot).curve)
    there, back = curves
    searched = tag == "time_optimal"  # by steps whose rows of both signs come in another order
    near = 1e-9 if searched else 1e-12
    assert there.duration == pytest.approx(back.duration, rel=near if searched else 0, abs=0)
    t = np.linspace(0, min(there.duration, back.duration), 50)
    for order in range(3):
        np.testing.assert_allclose(back.evaluate(t, order), -there.evaluate(t, order), rtol=near, atol=near)
