"""`spline` as a job against the worked examples of the slides, of textbooks and of a peer."""

from __future__ import annotations

import numpy as np
import pytest
from through_jobs import cases, curve_of, in_time, plan, printed, timed


def unit(case):
    return np.pi / 180 if case["units"]["angle"] == "deg" else 1.0


def through(case, rule, start, points, **fields):
    units = {"angle": case["units"]["angle"]}
    return plan(start, {"planner": "spline", "rule": rule, "through": points, **fields}, units=units)


def compare_pieces(case, made, local, knots):
    for start, end, coefficients in zip(knots[:-1], knots[1:], local, strict=True):
        expected = in_time(coefficients, start)
        np.testing.assert_allclose(
            printed(made, (start + end) / 2), expected, rtol=1e-12, atol=case["tolerance"]
        )


def compare_segment_samples(case, made):
    times, curve = case["inputs"]["t"], curve_of(made)
    for segment, t, *row in case["expected"].get("samples_seg_t_q_v_a", []):
        side = "right" if t == times[segment] else "left"
        got = [curve.evaluate(t, order, side=side)[0] / unit(case) for order in range(3)]
        np.testing.assert_allclose(got, row, rtol=0, atol=case["tolerance"])


@cases("splines", "cubic_via")
def test_imposed_velocities(case):
    inputs, expected = case["inputs"], case["expected"]
    start, points = timed(inputs["t"], inputs["q"])
    start["velocity"] = [inputs["v"][0]]
    for point, velocity in zip(points, inputs["v"][1:], strict=True):
        point["velocity"] = [velocity]
    made = through(case, "imposed", start, points)
    compare_pieces(case, made, expected["local_coefficients"], inputs["t"])
    compare_segment_samples(case, made)


@cases("splines", "cubic_via_auto")
def test_computed_velocities(case):
    inputs, expected = case["inputs"], case["expected"]
    made = through(case, "computed", *timed(inputs["t"], inputs["q"]))
    compare_pieces(case, made, expected["local_coefficients"], inputs["t"])
    compare_segment_samples(case, made)
    got = curve_of(made).evaluate(np.array(inputs["t"], dtype=float), 1)[:, 0]
    np.testing.assert_allclose(got, expected["velocities"], atol=case["tolerance"])
    if "misprint_trap" in case:
        assert not np.allclose(got, case["misprint_trap"]["velocities"])


@cases("splines", "piecewise_rest")
def test_rest_at_every_point(case):
    inputs = case["inputs"]
    start, points = timed(inputs["t"], np.transpose(inputs["q"]))
    still = {"velocity": 0} if inputs["order"] == 3 else {"velocity": 0, "acceleration": 0}
    points = [point | still for point in points]
    curve = curve_of(through(case, {3: "imposed", 5: "quintic"}[inputs["order"]], start, points))
    rows = np.array(case["expected"]["samples_t_then_q_v_a_per_axis"])
    for joint in range(curve.dimension):
        got = np.array([curve.evaluate(rows[:, 0], order)[:, joint] for order in range(3)]).T
        np.testing.assert_allclose(got, rows[:, 1 + 3 * joint : 4 + 3 * joint], atol=case["tolerance"])


@cases("splines", "two_quintics")
def test_two_quintics(case):
    inputs = case["inputs"]
    start, points = timed(inputs["t"], inputs["q"])
    points[0] |= {"velocity": [inputs["mid_velocity"]], "acceleration": [inputs["mid_acceleration"]]}
    made = through(case, "quintic", start, points)
    for piece, absolute in enumerate(case["expected"]["coefficients_absolute"]):
        got = printed(made, sum(inputs["t"][piece : piece + 2]) / 2)
        np.testing.assert_allclose(got, absolute, atol=case["tolerance"])
        if "misprint_trap" in case:
            assert not np.allclose(got, case["misprint_trap"]["coefficients_absolute"][piece])


@cases("splines", "spline_clamped")
def test_clamped(case):
    inputs, expected = case["inputs"], case["expected"]
    start, points = timed(inputs["t"], inputs["q"], velocity=[inputs["vf"]])
    made = through(case, "clamped", {**start, "velocity": [inputs["v0"]]}, points)
    t, curve = np.array(inputs["t"]), curve_of(made)
    np.testing.assert_allclose(curve.evaluate(t, 1)[:, 0], expected["velocities"], atol=case["tolerance"])
    np.testing.assert_allclose(curve.evaluate(t, 2)[:, 0], expected["accelerations"], atol=case["tolerance"])
    for time, q in expected["samples_t_q"]:
        assert curve.evaluate(time)[0] == pytest.approx(q, abs=case["tolerance"])


@cases("splines", "spline_virtual")
def test_virtual_points(case):
    inputs, expected = case["inputs"], case["expected"]
    virtual, origin = inputs["virtual_indices"], inputs["t"][0]
    knots = [t - origin for t in inputs["t"]]
    real = [t for k, t in enumerate(knots) if k not in virtual]
    start, points = timed(real, inputs["q_real"], velocity=[inputs["vf"]], acceleration=[inputs["af"]])
    start |= {"velocity": [inputs["v0"]], "acceleration": [inputs["a0"]]}
    times = [knots[k] for k in virtual]
    made = through(case, "continuous_acceleration", start, points, virtual_times=times)
    compare_pieces(case, made, expected["local_coefficients"], knots)
    got = curve_of(made).evaluate(np.array(times, dtype=float))[:, 0]
    np.testing.assert_allclose(got, expected["q_virtual"], atol=case["tolerance"])
    if "misprint_trap" in case:
        assert not np.allclose(got, case["misprint_trap"]["q_virtual"])
    for t, *row in expected["samples_t_q_v_a"]:
        found = [curve_of(made).evaluate(t - origin, order)[0] for order in range(3)]
        np.testing.assert_allclose(found, row, atol=case["tolerance"])
