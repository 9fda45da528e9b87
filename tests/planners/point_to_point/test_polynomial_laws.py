"""Laws that hold for every motion of their kind: derivatives, symmetry, scaling, and the fastest duration."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.polynomial import polynomial
from random_jobs import MOST_JOINTS, RATES, TAGS, only_move, plan_of, random_job

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.errors import InputError, PlanningError
from trajcli.planners.planner import Planned

POLYNOMIALS = {"cubic": 3, "quintic": 5, "septic": 7}
LAWS = [*POLYNOMIALS, "cycloidal", "trapezoid"]
SEEDS = st.integers(0, 2**32 - 1)
few = settings(max_examples=20, deadline=None)


def some_plan(seed: int, tag: str, joints: int, *, rest: bool = False) -> tuple[dict[str, Any], Planned]:
    """Return a random job that can be planned."""
    for k in range(20):
        job = random_job(np.random.default_rng([seed, k]), tag, joints, rest=rest, unlimited=0.05)
        planned = plan_of(job)
        if planned is not None and planned.curve.duration > 0:
            return job, planned
    assume(False)
    raise AssertionError


def derivative_of(curve: PiecewisePolynomial, piece: int, joint: int, order: int, local: np.ndarray) -> Any:
    """Differentiate and evaluate with numpy's own polynomials."""
    ascending = curve.coefficients[::-1, piece, joint]
    return polynomial.polyval(local, polynomial.polyder(ascending, order))


@few
@given(seed=SEEDS, tag=st.sampled_from(TAGS), joints=st.integers(1, MOST_JOINTS))
def test_derivatives_are_those_of_the_position(seed: int, tag: str, joints: int) -> None:
    _, planned = some_plan(seed, tag, joints)
    curve = planned.curve
    step = 1e-4
    for piece in np.flatnonzero(curve.lengths > 1e-9 * curve.duration).tolist():
        length = float(curve.lengths[piece])
        inside = length * np.linspace(0.05, 0.95, 7)
        values = curve.evaluate_orders(curve.breaks[piece] + inside, range(4))
        around = [curve.evaluate(curve.breaks[piece] + inside + sign * step * length) for sign in (-1, 1)]
        difference = (around[1] - around[0]) / (2 * step * length)
        for joint in range(joints):
            for order in range(4):
                exact = derivative_of(curve, piece, joint, order, inside)
                scale = np.abs(derivative_of(curve, piece, joint, 0, inside)).max() / length**order
                assert np.abs(values[:, order, joint] - exact).max() <= 1e-9 * max(np.abs(exact).max(), scale)
            # central differences miss by q''' h^2 / 6, and by the rounding of q over h
            jerk = np.abs(derivative_of(curve, piece, joint, 3, length * np.linspace(0, 1, 50))).max()
            rounding = 1e-15 * max(np.abs(values[:, 0, joint]).max(), curve.end * np.abs(difference).max())
            room = jerk * (step * length) ** 2 / 5 + rounding / (step * length)
            assert np.abs(values[:, 1, joint] - difference[:, joint]).max() <= room + 1e-12


@few
@given(seed=SEEDS, tag=st.sampled_from(LAWS), joints=st.integers(1, MOST_JOINTS))
def test_reversed_time_is_the_way_back(seed: int, tag: str, joints: int) -> None:
    job, _ = some_plan(seed, tag, joints, rest=True)
    (move,) = job["moves"]
    if "synchronize" in move:
        move["synchronize"] = "time"  # those who arrive by themselves wait at the end, not at the start
    there = plan_of(job)
    assume(there is not None)
    assert there is not None
    limits = job["robot"]["joints"]
    for row in limits:  # backwards in time velocity and jerk change sign, acceleration does not
        for quantity in ("velocity", "jerk"):
            if isinstance(row[quantity], list):
                row[quantity] = [-row[quantity][1], -row[quantity][0]]
    job["start"], move["to"] = move["to"], job["start"]
    if "acceleration" in move or "deceleration" in move:
        up = move.get("acceleration")
        move["acceleration"], move["deceleration"] = move.get("deceleration", up), up
        assume(None not in (move["acceleration"], move["deceleration"]))
    back = plan_of(job)
    assert back is not None
    assert back.curve.duration == pytest.approx(there.curve.duration, rel=1e-12)
    u = np.linspace(0, 1, 30)
    for order, sign in enumerate((1, -1, 1)):
        want = there.curve.evaluate(there.curve.end * (1 - u), order, side="left")
        got = back.curve.evaluate(back.curve.end * u, order)
        if order == 2 and tag == "trapezoid":
            continue  # its steps lie a rounding apart
        scale = np.abs(want).max()
        np.testing.assert_allclose(sign * got, want, rtol=0, atol=1e-10 * max(scale, 1.0))


@few
@given(seed=SEEDS, tag=st.sampled_from([*POLYNOMIALS, "cycloidal"]), factor=st.floats(0.05, 20))
def test_longer_by_k_is_slower_by_k(seed: int, tag: str, factor: float) -> None:
    job, _ = some_plan(seed, tag, 3, rest=True)
    curves = []
    for duration in (1.3, 1.3 * factor):
        job["moves"][0]["duration"] = duration
        planned = plan_of(job)
        assert planned is not None
        curves.append(planned.curve)
    u = np.linspace(0, 1, 40)
    for order in range(4):
        first, second = (curve.evaluate(np.minimum(u * curve.end, curve.end), order) for curve in curves)
        np.testing.assert_allclose(
            second * (curves[1].end / curves[0].end) ** order, first, rtol=0, atol=1e-9 * np.abs(first).max()
        )


def worst_ratio(planned: Planned, limits: list[dict[str, Any]]) -> np.ndarray:
    """Return the largest share of the limits that each order 1..3 uses, from the roots of numpy's polynomials."""
    curve, ratios = planned.curve, np.zeros(3)
    for joint, row in enumerate(limits):
        for order, quantity in enumerate(RATES, 1):
            if row.get(quantity) is None:
                continue
            bound = row[quantity]
            low, high = bound if isinstance(bound, list) else (-bound, bound)
            for piece in range(curve.pieces):
                values = extreme_values(curve, piece, joint, order)
                ratios[order - 1] = max(ratios[order - 1], values.max() / high, values.min() / low)
    return ratios


def extreme_values(curve: PiecewisePolynomial, piece: int, joint: int, order: int) -> np.ndarray:
    length = float(curve.lengths[piece])
    # over unit time, so that the companion matrix is well scaled
    ascending = curve.coefficients[::-1, piece, joint] * length ** np.arange(curve.degree + 1)
    of_order = polynomial.polyder(ascending, order)
    slope = polynomial.polytrim(polynomial.polyder(of_order), 1e-14 * max(np.abs(of_order).max(), 1e-300))
    roots = polynomial.polyroots(slope)
    inside = np.clip(roots[np.abs(roots.imag) < 1e-6].real, 0, 1) if roots.size else roots.real
    return polynomial.polyval(np.concatenate([inside, [0.0, 1.0]]), of_order) / length**order


@pytest.mark.full
@few
@given(seed=SEEDS, tag=st.sampled_from(LAWS), joints=st.integers(1, MOST_JOINTS))
def test_the_fastest_from_rest_to_rest_touches_a_limit(seed: int, tag: str, joints: int) -> None:
    job = random_job(np.random.default_rng(seed), tag, joints, rest=True, unlimited=0.2)
    job["moves"] = [{"planner": tag, "to": job["moves"][0]["to"]}]
    planned = plan_of(job)
    assume(planned is not None and planned.curve.duration > 0)
    assert planned is not None
    ratios = worst_ratio(planned, job["robot"]["joints"])
    if tag == "trapezoid":  # its own law knows no jerk, and has none but in its steps
        ratios = ratios[:2]
    assert ratios.max() == pytest.approx(1, abs=1e-9)
    if tag != "trapezoid":
        job["moves"][0]["duration"] = planned.curve.duration * (1 - 1e-6)
        shorter = plan_of(job)
        assert shorter is not None
        assert worst_ratio(shorter, job["robot"]["joints"]).max() > 1 + 5e-7


@few
@given(seed=SEEDS, tag=st.sampled_from(sorted(POLYNOMIALS)), joints=st.integers(1, 4))
def test_the_fastest_between_moving_states_touches_a_limit(seed: int, tag: str, joints: int) -> None:
    job = random_job(np.random.default_rng(seed), tag, joints, unlimited=0.1)
    job["moves"][0].pop("duration", None)
    planned = plan_of(job)
    assume(planned is not None and planned.curve.duration > 0)
    assert planned is not None
    limits = job["robot"]["joints"]
    assert worst_ratio(planned, limits).max() <= 1 + 1e-9
    shorter = [1 - 1e-6, *np.geomspace(0.999, 0.01, 12)]
    for factor in shorter:
        job["moves"][0]["duration"] = planned.curve.duration * factor
        attempt = plan_of(job)
        assert attempt is not None
        assert worst_ratio(attempt, limits).max() > 1, f"{factor} of the fastest duration would do"


@pytest.mark.parametrize("tag", sorted(POLYNOMIALS))
def test_the_fastest_is_found_in_a_narrow_interval(tag: str) -> None:
    """Nearly constant speed: only durations within 1e-4 of distance over speed keep the acceleration."""
    job = {
        "version": 1,
        "robot": {"joints": 1},
        "limits": {"velocity": 11, "acceleration": 0.01},
        "start": {"joints": [0], "velocity": 10},
        "moves": [{"planner": tag, "to": {"joints": [1], "velocity": 10}}],
    }
    planned = plan_of(job)
    assert planned is not None
    assert planned.curve.duration == pytest.approx(0.1, rel=1e-4)


def test_a_loose_direction_does_not_hide_the_fastest() -> None:
    job = {
        "version": 1,
        "robot": {"joints": [{"velocity": [-0.001, 10], "acceleration": 1e4}]},
        "start": {"joints": [0], "velocity": [1]},
        "moves": [{"planner": "cubic", "to": {"joints": [10], "velocity": [1]}}],
    }
    planned = plan_of(job)
    assert planned is not None
    # mean speed 10/T with ends at 1: the peak 1.5 * 10 / T - 0.5 * 1 is at its limit of 10
    assert planned.curve.duration == pytest.approx(15 / 10.5, rel=1e-9)


@pytest.mark.parametrize("tag", sorted(POLYNOMIALS))
def test_an_impossible_boundary_velocity_has_no_fastest(tag: str) -> None:
    job = {
        "version": 1,
        "robot": {"joints": 1},
        "limits": {"velocity": 1, "acceleration": 1, "jerk": 1},
        "start": {"joints": [0], "velocity": 2},
        "moves": [{"planner": tag, "to": {"joints": [1]}}],
    }
    planner, start, robot = only_move(job)
    with pytest.raises(PlanningError, match="no duration"):
        planner.plan(start, robot)


def test_a_change_of_acceleration_alone_needs_a_limit_to_have_a_fastest_duration() -> None:
    job = {
        "version": 1,
        "robot": {"joints": 1},
        "limits": {"velocity": 1, "acceleration": 1},
        "start": {"joints": [0]},
        "moves": [{"planner": "quintic", "to": {"joints": [0], "acceleration": 0.1}}],
    }
    planner, start, robot = only_move(job)
    with pytest.raises(InputError, match="jerk of j1"):
        planner.plan(start, robot)
