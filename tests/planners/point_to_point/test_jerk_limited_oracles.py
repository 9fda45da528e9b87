"""jerk_limited against the cases of peers and books."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from yaml_files import read_yaml

from trajcli.kinematics.robot import Joint, Limits, Robot
from trajcli.language.numbers import ReadingContext
from trajcli.planners.point_to_point.jerk_limited import JerkLimited
from trajcli.trajectory import State

CASES = read_yaml(Path(__file__).parents[2] / "oracles" / "jerk_limited.yaml")["cases"]


def of_kind(kind):
    return [pytest.param(case, id=case["id"]) for case in CASES if case["kind"] == kind]


def symmetric(values):
    return np.array([[-value, value] for value in values])


def plan(case, **fields):
    """Plan the move of a case; scalars stand for one joint."""
    given = {
        key: np.atleast_1d(np.array(value, dtype=float))
        for key, value in case["inputs"].items()
        if not isinstance(value, str)
    }
    n = given["amax"].size
    unlimited, zero = np.full(n, np.inf), np.zeros(n)
    limits = Limits(*(symmetric(given.get(key, unlimited)) for key in ("", "vmax", "amax", "jmax")))
    names = tuple(f"j{k + 1}" for k in range(n))
    robot = Robot("arm", tuple(Joint(name) for name in names), limits, None, np.eye(4), np.eye(4))
    start = State(given.get("p0", given.get("q0", zero)), given.get("v0", zero), given.get("a0", zero))
    to = {"velocity": given.get("vf", zero).tolist(), "acceleration": given.get("af", zero).tolist()}
    if "pf" in given or "qf" in given:
        to["joints"] = given.get("pf", given.get("qf")).tolist()
    if "minimum_duration" in given:
        fields["minimum_duration"] = float(given["minimum_duration"][0])
    context = ReadingContext(joint_names=names, joint_types=("revolute",) * n)
    move = JerkLimited.model_validate({"planner": "jerk_limited", "to": to, **fields}, context=context)
    return start, robot, move.plan(start, robot)


def follow(start, joint, phases, times):
    """Return (position, velocity, acceleration) at sorted times of a motion given as (duration, jerk)."""
    state = np.array([values[joint] for values in (start.position, start.velocity, start.acceleration)])
    found, begin, left = [], 0.0, list(times)
    for length, jerk in [*phases, (np.inf, 0.0)]:
        while left and left[0] <= begin + length:
            found.append(after(state, jerk, left.pop(0) - begin))
        if np.isfinite(length):
            state, begin = after(state, jerk, length), begin + length
    return np.array(found)


def after(state, jerk, t):
    p, v, a = state
    return np.array([p + v * t + a * t**2 / 2 + jerk * t**3 / 6, v + a * t + jerk * t**2 / 2, a + jerk * t])


@pytest.mark.parametrize("case", of_kind("jerk_limited"))
def test_durations_and_independent_minima(case):
    _, _, planned = plan(case)
    assert planned.curve.duration == pytest.approx(case["expected"]["duration"], rel=1e-9)
    np.testing.assert_allclose(planned.arrivals, case["expected"]["independent_min_durations"], rtol=1e-9)


@pytest.mark.parametrize("case", of_kind("jerk_limited"))
def test_motion_follows_the_certificate(case):
    start, _, planned = plan(case)
    times = np.linspace(0, planned.curve.duration, 101)
    for joint, certificate in enumerate(case["expected"]["certificate"]):
        expected = follow(start, joint, certificate["phases_dt_jerk"], times)
        found = np.stack([planned.curve.evaluate(times, order)[:, joint] for order in (0, 1, 2)], axis=1)
        scale = np.abs(expected).max(axis=0)
        assert (np.abs(found - expected) <= 1e-9 * scale + 1e-12).all()
        brakes = [phase for phase in planned.phases if phase.joint == joint and phase.name == "brake"]
        assert bool(brakes) == bool(certificate["brake_phases"])


@pytest.mark.parametrize("case", of_kind("jerk_limited") + of_kind("phase_sync"))
def test_samples(case):
    fields = {"synchronize": "phase"} if case["kind"] == "phase_sync" else {}
    start, _, planned = plan(case, **fields)
    assert planned.curve.duration == pytest.approx(case["expected"]["duration"], rel=1e-9)
    n = start.position.size
    rows = case["expected"].get("samples_t_p", case["expected"].get("samples_t_p_v_a", []))
    for time, *values in rows:
        t = min(time, planned.curve.end)
        orders = range(len(values) // n)
        found = np.concatenate([planned.curve.evaluate(t, order) for order in orders])
        np.testing.assert_allclose(found, values, atol=case["tolerance"])


@pytest.mark.parametrize("case", of_kind("jerk_velocity"))
def test_velocity_control(case):
    start, _, planned = plan(case)
    np.testing.assert_allclose(planned.arrivals, case["expected"]["durations"], rtol=1e-9)
    assert planned.curve.duration == pytest.approx(max(case["expected"]["durations"]), rel=1e-9)
    reached = planned.curve.piece_ends(1)[1][-1]
    np.testing.assert_allclose(reached, case["inputs"]["vf"], atol=1e-12)
    np.testing.assert_array_equal(planned.curve.evaluate(0.0), start.position)


@pytest.mark.parametrize("case", of_kind("double_s"))
def test_double_s_of_the_book(case):
    _, _, planned = plan(case)
    assert planned.curve.duration == pytest.approx(case["expected"]["optimal_duration"], rel=1e-9)
    book = case["expected"]["book"]
    first = planned.phases[0]
    assert (first.name, first.start) == ("jerk +", 0.0)
    assert first.end == pytest.approx(book["Tj1"], abs=1e-4)
    accelerating = next(phase.end for phase in planned.phases if phase.name == "jerk -")
    assert planned.curve.duration == pytest.approx(book["Ta"] + book["Tv"] + book["Td"], abs=2e-4)
    if book["Tv"]:
        assert accelerating == pytest.approx(book["Ta"], abs=1e-4)
        cruise = next(phase for phase in planned.phases if phase.name == "cruise")
        assert cruise.end - cruise.start == pytest.approx(book["Tv"], abs=1e-4)
    else:
        peak = max(np.abs(side).max() for side in planned.curve.piece_ends(1))
        assert peak == pytest.approx(book["vlim"], abs=1e-4)
