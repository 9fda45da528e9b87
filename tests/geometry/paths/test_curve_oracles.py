"""Worked examples of paths with answers known independently; misprints must not come out.

The time laws are written out here: v = X' sd and a = X'' sd^2 + X' sdd.
"""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from euler_curves import euler_between
from yaml_files import read_yaml

from trajcli.geometry.paths.arc import Arc
from trajcli.geometry.paths.chain import join
from trajcli.geometry.paths.orientation import AxisAngleOrientation
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.geometry.paths.position import SAME_POINT, Line, Pivot

FILE = Path(__file__).parents[2] / "oracles" / "operational.yaml"
CASES = read_yaml(FILE)["cases"]


def of(*kinds):
    cases = [case for case in CASES if case["kind"] in kinds]
    assert cases
    return pytest.mark.parametrize("case", cases, ids=[case["id"] for case in cases])


def close(got, case, key):
    np.testing.assert_allclose(got, case["expected"][key], rtol=0, atol=case["tolerance"])


def trapezoid(length, duration, speed, t):
    """Return s, sd, sdd of the law that cruises at `speed`, its ramps `length / speed` short of the duration."""
    ramp = duration - length / speed
    a = speed / ramp
    rising, falling = t < ramp, t > duration - ramp
    left = duration - t
    s = np.where(rising, a * t**2 / 2, np.where(falling, length - a * left**2 / 2, speed * (t - ramp / 2)))
    sd = np.where(rising, a * t, np.where(falling, a * left, speed))
    return s, sd, np.where(rising, a, np.where(falling, -a, 0.0))


def cubic(length, duration, t):
    x = t / duration
    return (
        length * x**2 * (3 - 2 * x),
        length * 6 * x * (1 - x) / duration,
        length * (6 - 12 * x) / duration**2,
    )


def moved(curve, s, sd, sdd):
    """Return what a law makes of a curve: value, v and a."""
    value, first, second = curve.evaluate(s)
    return value, first * sd[:, None], second * sd[:, None] ** 2 + first * sdd[:, None]


def test_every_kind_of_the_file_is_tested():
    tested = {case["kind"] for mark in MARKS for case in mark.args[1]}
    assert tested == {case["kind"] for case in CASES}


@of("cart_line_trapezoid")
def test_a_line_under_a_trapezoid(case):
    given, rows = case["inputs"], np.array(case["expected"]["samples_t_p_v"])
    line = Line(given["p0"], given["p1"])
    close(line.length, case, "length")
    place, velocity, _ = moved(line, *trapezoid(line.length, given["T"], given["cruise_speed"], rows[:, 0]))
    np.testing.assert_allclose(place, rows[:, 1:4], rtol=0, atol=case["tolerance"])
    np.testing.assert_allclose(velocity, rows[:, 4:], rtol=0, atol=case["tolerance"])


def clockwise(given):
    """Return the half circle in each way it can be described: clockwise is a negative rotation."""
    return [
        Arc(given["p0"], given["centre"], given["plane_normal"], -np.pi),
        Arc.around(given["p0"], given["centre"], given["p1"], -np.array(given["plane_normal"])),
    ]


@of("cart_arc_trapezoid")
def test_an_arc_under_a_trapezoid(case):
    given, rows = case["inputs"], np.array(case["expected"]["samples_t_p_v_a"], dtype=float)
    for arc in clockwise(given):
        close(arc.length, case, "length")
        close(arc.evaluate(np.array([arc.length / 2]))[0][0], case, "mid_point")
        law = trapezoid(arc.length, given["T"], given["cruise_speed"], rows[:, 0])
        for got, columns in zip(moved(arc, *law), (slice(1, 4), slice(4, 7), slice(7, 10)), strict=True):
            np.testing.assert_allclose(got, rows[:, columns], rtol=0, atol=case["tolerance"])
        law = trapezoid(arc.length, given["T"], given["cruise_speed"], np.array([0.2]))
        trap = case["misprint_trap"]["acceleration_at_0p2_from_authors_script"]
        assert np.abs(moved(arc, *law)[2][0] - trap).max() > 0.1


@of("cart_polyline")
def test_a_polyline_with_stops(case):
    given, rows = case["inputs"], np.array(case["expected"]["samples_t_p"], dtype=float)
    points, times = given["points"], np.array(given["t"])
    chain = join([Line(a, b) for a, b in itertools.pairwise(points)])
    s = np.zeros(rows.shape[0])
    for low, high, start, length in zip(
        times, times[1:], chain.borders, np.diff(chain.borders), strict=False
    ):
        here = (rows[:, 0] >= low) & (rows[:, 0] <= high)
        s[here] = start + trapezoid(length, high - low, 0.75, rows[here, 0] - low)[0]
    np.testing.assert_allclose(chain.evaluate(s)[0], rows[:, 1:], rtol=0, atol=case["tolerance"])
    assert chain.stops.size == len(points) - 2


@of("arc_parameter")
def test_the_parameter_of_an_arc_is_its_length(case):
    radius, rate = case["inputs"]["r"], case["inputs"]["s_angle_rate"]
    arc = Arc([radius, 0, 0], [0, 0, 0], [0, 0, 1], 1.0)
    first = arc.evaluate(np.array([0.3]))[1][0]
    close(np.linalg.norm(first * rate * arc.length / arc.angle), case, "speed")


@of("arc_three_points")
def test_an_arc_through_three_points(case):
    arc = Arc.through(*(case["inputs"][name] for name in ("p0", "via", "p1")))
    close(arc.center, case, "centre")
    close(arc.radius, case, "radius")
    close(arc.angle, case, "angle")
    close(arc.length, case, "length")
    close(arc.axis, case, "normal_direction_of_travel")
    close(arc.evaluate(np.array([arc.length / 2]))[0][0], case, "mid_point")
    np.testing.assert_allclose(arc.end, case["inputs"]["p1"], rtol=0, atol=case["tolerance"])


@of("orient_euler")
def test_angles_under_a_cubic(case):
    given, rows = case["inputs"], np.array(case["expected"]["samples_t_phi_dphi"])
    sequence, frame = given["convention"].split()
    curve = euler_between(given["phi_i"], given["phi_f"], sequence, frame)
    s, sd, _ = cubic(curve.length, given["T"], rows[:, 0])
    angles, slopes, _ = curve.angles_at(s)
    np.testing.assert_allclose(angles, rows[:, 1:4], rtol=0, atol=case["tolerance"])
    np.testing.assert_allclose(slopes * sd[:, None], rows[:, 4:], rtol=0, atol=case["tolerance"])
    close(curve.evaluate(np.array([curve.length / 2]))[0][0], case, "R_mid")


@of("orient_axis_angle")
def test_a_rotation_under_a_cubic(case):
    start, end = (np.array(case["inputs"][name]) for name in ("R_i", "R_f"))
    curve, rows = AxisAngleOrientation.between(start, end), np.array(case["expected"]["samples_t_theta"])
    close(curve.length, case, "theta_f")
    close(curve.vectors[0] / curve.angles_turned[0], case, "axis_in_initial_frame")
    s, sd, sdd = cubic(curve.length, case["inputs"]["T"], rows[:, 0])
    _, velocity, acceleration = moved(curve, s, sd, sdd)
    axis = start @ case["expected"]["axis_in_initial_frame"]
    np.testing.assert_allclose(
        np.column_stack([s, velocity @ axis, acceleration @ axis]), rows[:, 1:], atol=1e-9
    )
    middle = rows[:, 0] == case["inputs"]["T"] / 2
    close(velocity[middle][0] @ start, case, "omega_initial_frame_mid")
    close(curve.evaluate(np.array([curve.length / 2]))[0][0], case, "R_mid")


@of("orient_axis_angle_pi")
def test_half_a_turn(case):
    start, end = (np.array(case["inputs"][name]) for name in ("R_i", "R_f"))
    curve = AxisAngleOrientation.between(start, end)
    close(curve.length, case, "theta_f")
    close(curve.vectors[0] / np.pi, case, "axis_up_to_sign")  # its first component is positive
    np.testing.assert_allclose(curve.angles_turned, np.pi)
    ends = curve.evaluate(np.array([0, curve.length]))[0]
    np.testing.assert_allclose(ends, [start, end], rtol=0, atol=1e-14)


@of("orient_axis_angle_zero")
def test_equal_orientations_are_held(case):
    start, end = (np.array(case["inputs"][name]) for name in ("R_i", "R_f"))
    curve = AxisAngleOrientation.between(start, end, 2.0)
    close(curve.angles_turned[0], case, "theta_f")
    for rotation in curve.evaluate(np.linspace(0, 2, 7))[0]:
        close(rotation, case, "R_any_t")


@of("pose_interpolation")
def test_poses_on_a_line(case):
    start, end = (np.array(case["inputs"][name], dtype=float) for name in ("T0", "T1"))
    line = Line(start[:3, 3], end[:3, 3])
    curve = PoseCurve(line, AxisAngleOrientation.between(start[:3, :3], end[:3, :3], line.length))
    close(curve.evaluate(np.array(case["inputs"]["s"]) * curve.length)[0], case, "T")


def test_a_line_without_length_is_held():
    """The seed's formula divides by the distance of the points."""
    place = np.array([0.1, 0.2, 0.3])
    assert np.linalg.norm(place - place) <= SAME_POINT
    turn = AxisAngleOrientation.between(np.eye(3), np.eye(3))
    held = PoseCurve(Pivot(place, place, turn.length), turn)
    pose, first, second = held.evaluate(np.zeros(2))
    np.testing.assert_array_equal(pose[:, :3, 3], [place, place])
    np.testing.assert_array_equal(np.hstack([first, second]), 0)


MARKS = [mark for test in list(globals().values()) for mark in getattr(test, "pytestmark", [])]
