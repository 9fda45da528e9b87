"""Curves through waypoints against worked examples and exercises with known answers."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from yaml_files import read_yaml

from trajcli.curves.splines.cubic import clamped
from trajcli.curves.splines.hermite import (
    computed_accelerations,
    computed_velocities,
    cubic_through,
    parabola_velocities,
    quintic_through,
)
from trajcli.curves.splines.virtual_points import continuous_acceleration, virtual_points

FOLDER = Path(__file__).parents[2] / "oracles"
CASES = read_yaml(FOLDER / "splines.yaml")["cases"]
MOVES = read_yaml(FOLDER / "point_to_point.yaml")["cases"]


def of(kind, cases=CASES):
    chosen = [case for case in cases if case["kind"] == kind]
    assert chosen
    return pytest.mark.parametrize("case", chosen, ids=[case["id"] for case in chosen])


def column(values):
    return np.array(values, dtype=float)[:, None]


def close(got, case, key):
    """Assert that `got` is the expected value and not the wrong one."""
    np.testing.assert_allclose(got, case["expected"][key], rtol=0, atol=case["tolerance"])
    if key in case.get("misprint_trap", {}):
        assert np.abs(got - np.array(case["misprint_trap"][key])).max() > 1000 * case["tolerance"]


def ascending(curve):
    """Return local coefficients [piece][power]."""
    return curve.coefficients[::-1, :, 0].T


def absolute(curve):
    """Return coefficients [piece][power] in absolute time."""
    composed = [
        Polynomial(row)(Polynomial([-start, 1.0])).coef
        for row, start in zip(ascending(curve), curve.breaks, strict=False)
    ]
    return np.array([np.pad(row, (0, curve.degree + 1 - row.size)) for row in composed])


def orders(curve, t, piece=None):
    """Return position, velocity and acceleration at t, of the given piece at a break."""
    side = "left" if piece is not None and t == curve.breaks[piece + 1] else "right"
    return [curve.evaluate(float(t), order, side=side)[0] for order in range(3)]


def check_cubics(curve, case):
    expected = case["expected"]
    close(ascending(curve), case, "local_coefficients")
    if "absolute_coefficients" in expected:
        np.testing.assert_allclose(absolute(curve), expected["absolute_coefficients"], atol=1e-9)
    for piece, t, *values in expected.get("samples_seg_t_q_v_a", []):
        np.testing.assert_allclose(orders(curve, t, piece), values, rtol=0, atol=case["tolerance"])


@of("cubic_via")
def test_imposed_velocities(case):
    given = case["inputs"]
    check_cubics(cubic_through(given["t"], column(given["q"]), column(given["v"])), case)


@of("cubic_via_auto")
def test_computed_velocities(case):
    given = case["inputs"]
    ends = given.get("v_ends", [0, 0])
    velocities = computed_velocities(given["t"], column(given["q"]), ends[:1], ends[1:])
    close(velocities[:, 0], case, "velocities")
    check_cubics(cubic_through(given["t"], column(given["q"]), velocities), case)


@of("two_quintics")
def test_two_quintics(case):
    given = case["inputs"]
    start, end = given["start"], given["end"]
    velocities = column([start[1], given["mid_velocity"], end[1]])
    accelerations = column([start[2], given["mid_acceleration"], end[2]])
    curve = quintic_through(given["t"], column(given["q"]), velocities, accelerations)
    close(absolute(curve), case, "coefficients_absolute")


def test_the_rule_for_quintics_finds_what_the_exercise_leaves_open():
    case = next(case for case in CASES if case["id"] == "A-sl-e4.3")
    times, positions = case["inputs"]["t"], column(case["inputs"]["q"])
    velocities = parabola_velocities(times, positions, [0], [0])
    accelerations = computed_accelerations(times, velocities, [0], [0])
    np.testing.assert_allclose(velocities[:, 0], [0, 0.75, 0], rtol=1e-15)
    np.testing.assert_array_equal(accelerations, 0)
    close(
        absolute(quintic_through(times, positions, velocities, accelerations)), case, "coefficients_absolute"
    )


@of("spline_virtual")
def test_virtual_points(case):
    given = case["inputs"]
    times = np.array(given["t"], dtype=float)
    virtual = times[given["virtual_indices"]]
    real = np.delete(times, given["virtual_indices"])
    ends = [[given["v0"]], [given["vf"]]], [[given["a0"]], [given["af"]]]
    curve = continuous_acceleration(real, column(given["q_real"]), *ends, virtual)
    check_cubics(curve, case)
    shown_times, shown = virtual_points(curve)
    np.testing.assert_array_equal(shown_times, virtual)
    close(shown[:, 0], case, "q_virtual")
    np.testing.assert_array_equal(curve.breaks, times)
    knots = np.append(curve.piece_ends(2)[0], curve.piece_ends(2)[1][-1:])
    close(knots, case, "knot_accelerations")
    for t, *values in case["expected"]["samples_t_q_v_a"]:
        np.testing.assert_allclose(orders(curve, t), values, rtol=0, atol=case["tolerance"])


@pytest.mark.parametrize("name", ["A-sl-bt5", "A-sl-bt6c", "A-sl-spline-N2"])
def test_virtual_times_that_are_not_given(name):
    case = next(case for case in CASES if case["id"] == name)
    given = case["inputs"]
    real = np.delete(np.array(given["t"], dtype=float), given["virtual_indices"])
    curve = continuous_acceleration(real, column(given["q_real"]), [[0], [0]], [[0], [0]])
    np.testing.assert_allclose(curve.breaks, given["t"], rtol=1e-15)
    close(ascending(curve), case, "local_coefficients")


@of("spline_clamped")
def test_clamped_ends(case):
    given = case["inputs"]
    curve = clamped(given["t"], column(given["q"]), [given["v0"]], [given["vf"]])
    for order, key in ((1, "velocities"), (2, "accelerations")):
        first, last = curve.piece_ends(order)
        close(np.append(first, last[-1:]), case, key)
    for t, position in case["expected"]["samples_t_q"]:
        assert abs(curve.evaluate(t)[0] - position) <= case["tolerance"]


@of("piecewise_rest")
def test_rest_at_every_point(case):
    given = case["inputs"]
    positions = np.array(given["q"]).T
    rest = np.zeros_like(positions)
    through = cubic_through if given["order"] == 3 else quintic_through
    curve = through(given["t"], positions, *[rest] * (given["order"] // 2))
    for t, *values in case["expected"]["samples_t_then_q_v_a_per_axis"]:
        got = curve.evaluate_orders(np.array([t]), (0, 1, 2))[0]
        np.testing.assert_allclose(got.T.ravel(), values, rtol=0, atol=case["tolerance"])


@of("polynomial_ptp", MOVES)
def test_one_piece(case):
    given = case["inputs"]
    derivatives = np.array([given["start"], given["end"]], dtype=float).T[:, :, None]
    through = {2: cubic_through, 3: quintic_through}.get(len(derivatives))
    if through is None:
        return
    curve = through([given["t0"], given["tf"]], *derivatives)
    for t, *values in case["expected"]["samples_t_q_v_a"]:
        np.testing.assert_allclose(orders(curve, t), values, rtol=0, atol=case["tolerance"])
