"""Paths of joints through points: how far corners are passed, where a path turns back, and speeds at its ends."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from trajcli.errors import PlanningError
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.planners.waypoints.joint_path import (
    JointPath,
    path_of_motion,
    polyline_through,
    spline_through,
)
from trajcli.planners.waypoints.spline_rules import curve_through
from trajcli.planners.waypoints.through_points import PointTable

CORNERS = np.array([0.03, 0.01, 0.02])


def robot(joints: int) -> Robot:
    every = tuple(Joint(f"j{k + 1}") for k in range(joints))
    return Robot("bare", every, unlimited(joints), None, np.eye(4), np.eye(4))


def table(positions: object, first: object = 0.0, last: object = 0.0) -> PointTable:
    """Return points, with velocities at the ends."""
    q = np.array(positions, dtype=float)
    rates, given = np.zeros((2, *q.shape)), np.zeros((2, len(q)), dtype=bool)
    rates[0, 0], rates[0, -1], given[0, [0, -1]] = first, last, True
    return PointTable(q, None, rates, given, np.zeros(len(q)))


def polyline(positions: object, corner: object, *, smooth: bool = True, **ends: object) -> JointPath:
    points = table(positions, **ends)
    count = points.positions.shape[1]
    return polyline_through(
        points, np.broadcast_to(np.array(corner, dtype=float), (count,)), robot(count), smooth=smooth
    )


@pytest.mark.parametrize("smooth", [True, False])
@pytest.mark.parametrize("seed", range(4))
def test_the_joint_that_is_turned_most_passes_each_corner_as_far_as_it_may(seed: int, smooth: bool) -> None:
    rng = np.random.default_rng(seed)
    q = np.cumsum(rng.uniform(1.0, 2.0, (5, 3)) * rng.choice([-1.0, 1.0], (5, 3)), axis=0)
    path = polyline(q, CORNERS, smooth=smooth)
    passed = np.abs(path.curve.evaluate(path.s) - q)
    np.testing.assert_allclose(path.missed, passed, rtol=0, atol=1e-12)
    shares = (passed / CORNERS).max(axis=1)
    along = np.diff(q, axis=0) / np.linalg.norm(np.diff(q, axis=0), axis=1)[:, None]
    back = (along[1:] * along[:-1]).sum(axis=1) < -np.cos(np.radians(1.0))
    np.testing.assert_allclose(shares, [0, *np.where(back, 0.0, 1.0), 0], atol=1e-9)


@pytest.mark.parametrize("smooth", [True, False])
@pytest.mark.parametrize("lengths", [(1.0, 0.1), (0.1, 1.0), (0.1, 0.1)])
def test_rounded_corners_leave_the_middles_of_short_segments_straight(
    lengths: tuple[float, float], smooth: bool
) -> None:
    q = np.cumsum([[0, 0], [lengths[0], 0], [0, lengths[1]], [lengths[0], 0]], axis=0)
    path = polyline(q, 0.5, smooth=smooth)
    middles = path.curve.evaluate((path.s[1:] + path.s[:-1]) / 2)
    np.testing.assert_allclose(middles, (q[1:] + q[:-1]) / 2, atol=1e-12)
    (event,) = path.events
    assert event.kind == "shrunk"
    missed = path.missed[1:-1].max(axis=1)
    assert f"{100 * missed.min() / 0.5:.4g} % of the deviation" in event.message
    longest = 0.999 * min(lengths) / (8 if not smooth else 1)
    assert (
        missed.max() == pytest.approx(longest, rel=1e-9) if not smooth else missed.max() > 0.01 * min(lengths)
    )


def test_of_several_corners_that_are_shrunk_the_one_that_is_shrunk_most_is_named() -> None:
    path = polyline(np.cumsum([[0, 0], [1, 0], [0, 1], [0.1, 0], [0, 0.1]], axis=0), 0.5, smooth=False)
    (event,) = path.events
    assert "the corner at point 2 is" in event.message or "the corner at point 3 is" in event.message
    assert event.message.endswith("2 more likewise")


@pytest.mark.parametrize(("degrees", "stops"), [(0.5, True), (1.5, False), (5.0, False)])
@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("smooth", [True, False])
def test_a_path_turns_back_within_a_degree_of_half_a_turn(
    degrees: float, stops: bool, side: float, smooth: bool
) -> None:
    angle = np.pi - side * np.radians(degrees)
    path = polyline([[0, 0], [1, 0], [1 + np.cos(angle), np.sin(angle)]], 1e-3, smooth=smooth)
    assert [event.kind for event in path.events] == (["turns_back"] if stops else [])
    assert bool(path.missed[1].any()) is not stops


@pytest.mark.parametrize("turn", [0.005, -0.005, 1e-9])
@pytest.mark.parametrize("smooth", [True, False])
def test_a_corner_is_rounded_however_little_it_turns(turn: float, smooth: bool) -> None:
    curve = polyline([[0.0, 0.0], [1.0, 1.0], [2.0, 2.0 + turn]], 0.1, smooth=smooth).curve
    first, last = curve.piece_ends(1)
    np.testing.assert_allclose(first[1:], last[:-1], rtol=0, atol=1e-13)


def test_a_straight_line_of_points_has_no_corner() -> None:
    path = polyline(np.outer([0.0, 0.1, 0.3, 0.7], [1.0, 3.0]), 0.1)
    assert path.curve.degree == 1
    assert not path.missed.any()


ENDS = [[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]]


def test_velocities_at_the_ends_of_a_polyline_are_speeds_along_its_segments() -> None:
    for corner in (0.0, 0.1):
        assert polyline(ENDS, corner, first=[0.5, 0.0], last=[0.0, 0.25]).speeds == (0.5, 0.25)
        assert polyline(ENDS, corner, first=[0.5, 4e-10], last=[0.0, 0.0]).speeds == (0.5, 0.0)


@pytest.mark.parametrize(
    "ends",
    [
        {"first": [0.5, 5e-7]},
        {"first": [0.5, -5e-7]},
        {"first": [-0.5, 0.0]},
        {"last": [0.25, 0.0]},
        {"last": [-1e-6, 0.5]},
        {"last": [0.0, -0.5]},
    ],
)
def test_a_velocity_that_leaves_the_polyline_is_refused(ends: dict[str, object]) -> None:
    with pytest.raises(PlanningError, match="leaves it"):
        polyline(ENDS, 0.1, **ends)


@pytest.mark.parametrize("rule", ["not_a_knot", "clamped", "quintic", "shape_preserving"])
@pytest.mark.parametrize("parameter", ["chord", "centripetal", "uniform", (0.0, 0.5, 3.0, 3.5)])
def test_a_spline_has_the_velocities_of_its_ends(rule: str, parameter: object) -> None:
    """Of chords of unequal lengths: q'(s) times sd is the velocity, whatever the parameter is."""
    points = table([[0.0, 0.0], [0.3, 0.2], [1.0, 1.5], [3.0, 1.7]], first=[0.2, 0.1], last=[0.3, 0.05])
    path = spline_through(rule, parameter, points, robot(2))
    for k, end in ((0, path.curve.start), (1, path.curve.end)):
        slope = path.curve.evaluate(end, 1, side="left" if k else "right")
        np.testing.assert_allclose(slope * path.speeds[k], points.rates[0, -k], atol=1e-12)
        chord = np.diff(points.positions, axis=0)[-k] / np.diff(path.s)[-k]
        assert np.linalg.norm(slope) == pytest.approx(np.linalg.norm(chord))
    np.testing.assert_allclose(path.curve.evaluate(path.s), points.positions, atol=1e-12)


def test_a_quintic_at_rest_leaves_its_ends_along_its_chords() -> None:
    points = table([[0.0, 0.0], [0.3, 0.2], [1.0, 1.5]])
    path = spline_through("quintic", "chord", points, robot(2))
    chords = np.diff(points.positions, axis=0) / np.diff(path.s)[:, None]
    np.testing.assert_allclose(path.curve.evaluate(path.curve.start, 1), chords[0], atol=1e-12)
    np.testing.assert_allclose(path.curve.evaluate(path.curve.end, 1, side="left"), chords[-1], atol=1e-12)
    assert path.speeds == (0.0, 0.0)


@pytest.mark.parametrize(
    ("parameter", "wanted"),
    [
        ("chord", [0.0, 5.0, 18.0, 18.25]),
        ("centripetal", np.cumsum([0.0, 5.0**0.5, 13.0**0.5, 0.5])),
        ("uniform", [0.0, 1.0, 2.0, 3.0]),
        ((0.0, 0.5, 3.0, 3.5), [0.0, 0.5, 3.0, 3.5]),
    ],
)
def test_the_parameter_grows_with_distances_their_roots_or_points(parameter: object, wanted: object) -> None:
    """Between points that are 5, 13 and 1/4 apart."""
    points = table(np.cumsum([[0, 0], [3, -4], [5, 12], [-0.25, 0]], axis=0))
    np.testing.assert_allclose(
        spline_through("not_a_knot", parameter, points, robot(2)).s, wanted, rtol=1e-12
    )


@pytest.mark.parametrize("count", [2, 4])
def test_a_parameter_has_one_value_for_each_point(count: int) -> None:
    with pytest.raises(PlanningError, match=f"{count} values of the parameter for 3 points"):
        spline_through("not_a_knot", tuple(range(count)), table([[0, 0], [1, 2], [2, 1]]), robot(2))


def test_of_a_velocity_that_no_monotone_path_has_the_joint_is_named() -> None:
    points = table([[0.0, 0.0], [1.0, 0.1], [2.0, 1.0]], first=[0.1, 3.0])
    with pytest.raises(PlanningError) as caught:
        spline_through("shape_preserving", "chord", points, robot(2))
    (problem,) = caught.value.problems
    assert problem.joint == "j2"
    assert "the velocity of j2 at the first point" in problem.text()


@pytest.mark.parametrize("first", [True, False])
def test_points_beside_one_where_all_joints_turn_back_are_bent_as_the_rule_says(first: bool) -> None:
    """One in three turns back, among chords of unequal lengths: it alone has the acceleration of its parabola."""
    q = np.array([[0.0, 0.0], [1.0, 0.5], [0.7, 0.1], [0.6, -0.2], [-1.0, -0.4], [-3.0, -0.5]])
    turn, points = (1, table(q)) if first else (4, table(q[::-1]))
    points.given[1, [0, -1]] = True  # at rest, without an acceleration
    path = spline_through("quintic", "chord", points, robot(2))
    slopes = np.diff(points.positions, axis=0) / np.diff(path.s)[:, None]
    rates = np.zeros_like(points.rates)
    rates[0, [0, -1]] = slopes[[0, -1]]
    plain = curve_through("quintic", replace(points, rates=rates), path.s)
    for k in range(6):
        bent = path.curve.evaluate(path.s[k], 2, side="left" if k == 5 else "right")
        if k == turn:
            around = slice(k - 1, k + 2)
            wanted = [
                2 * np.polyfit(path.s[around] - path.s[k], column[around], 2)[0]
                for column in points.positions.T
            ]
        else:
            wanted = plain.evaluate(path.s[k], 2, side="left" if k == 5 else "right")
        np.testing.assert_allclose(bent, wanted, rtol=1e-9, atol=1e-9)
    assert np.abs(plain.evaluate(path.s[2 if first else 3], 2)).max() > 1e-3


def test_a_path_that_turns_back_twice_stops_twice_and_says_where() -> None:
    path = polyline([[0, 0], [1, 0], [1, 1], [1, 0], [2, 0], [1.5, 0]], 0.05, smooth=False)
    stops = [event.message for event in path.events if event.kind == "turns_back"]
    assert stops == [f"the path turns back at point {k}, and stops there" for k in (2, 4)]
    np.testing.assert_allclose(path.curve.evaluate(path.s[[2, 4]]), [[1, 1], [2, 0]], atol=1e-12)
    np.testing.assert_allclose(path.missed[[1, 3]].max(axis=1), 0.05, rtol=1e-9)
    passed = np.abs(path.curve.evaluate(path.s) - [[0, 0], [1, 0], [1, 1], [1, 0], [2, 0], [1.5, 0]])
    np.testing.assert_allclose(path.missed, passed, atol=1e-12)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e3])
def test_a_velocity_leaves_a_polyline_by_a_share_of_itself(size: float) -> None:
    """A slow one as well as a fast one; the joint that leaves it is named."""
    with pytest.raises(PlanningError) as caught:
        polyline(ENDS, 0.1, first=[0.5 * size, 5e-7 * size])
    (problem,) = caught.value.problems
    assert problem.joint == "j2"
    speeds = polyline(ENDS, 0.1, first=[0.5 * size, 4e-10 * size]).speeds
    assert speeds == (pytest.approx(0.5 * size), 0.0)


@pytest.mark.parametrize(("length", "told"), [(1.3, True), (1.7, False)])
def test_a_corner_that_is_rounded_by_a_part_of_what_is_asked_for_is_told(length: float, told: bool) -> None:
    """Parabolas pass a right angle by an eighth of their length: of segments of 1.3 and 1.7, at most."""
    path = polyline([[0, 0], [length, 0], [length, 3]], 0.2, smooth=False)
    assert [event.kind for event in path.events] == ["shrunk"] * told
    assert path.missed[1].max() == pytest.approx(min(0.999 * length / 8, 0.2))


def test_of_a_motion_from_rest_to_rest_the_path_leaves_its_ends_with_a_slope() -> None:
    """q = 10 u^3 - 15 u^4 + 6 u^5: over the third power of time it has a slope of 10 at rest, there as here."""
    from trajcli.curves.piecewise import PiecewisePolynomial

    law = np.array([6.0, -15.0, 10.0, 0.0, 0.0, 0.0])
    motion = PiecewisePolynomial(np.array([0.0, 1.0]), law[:, None, None])
    times = np.array([0.0, 0.02, 0.05, 0.3, 0.62, 0.95, 1.0])
    path, s = path_of_motion(motion, times)
    np.testing.assert_allclose(path.evaluate(s)[:, 0], np.polyval(law, times), atol=1e-12)
    inner = np.linspace(0.1, 0.9, 9)  # where s grows as time does
    np.testing.assert_allclose(path.evaluate(inner - 0.04)[:, 0], np.polyval(law, inner), rtol=0, atol=2e-5)
    # its rate is 2 u^2 up to u = 1/2, and 1 - 2 (1 - u)^2 from there to u = 1, of u = t / 0.08
    u = np.linspace(0.0, 0.625, 200001)
    whole = np.where(u < 0.5, 2 * u**2, 1 - 2 * (1 - u) ** 2)
    grown = 0.08 * float(((whole[1:] + whole[:-1]) / 2 * np.diff(u)).sum())
    wanted = [0.0, 0.08 * 2 * 0.25**3 / 3, grown, 0.26, 0.58, 0.92 - grown, 0.92]
    np.testing.assert_allclose(s, wanted, rtol=0, atol=1e-9)
    slopes = [float(path.evaluate(end, 1)[0]) for end in (path.start, path.end)]
    assert slopes == pytest.approx([10 * 1.5 * 0.08**2] * 2, rel=0.12)  # q = 10 t^3 and s = 2 t^3 / (3 w^2)


def test_where_all_joints_turn_back_a_quintic_is_bent_as_a_parabola_through_the_points_beside() -> None:
    q = np.array([[0.0, 0.0], [0.4, 0.3], [1.0, 0.5], [0.7, 0.1], [0.1, 0.0]])
    path = spline_through("quintic", "chord", table(q), robot(2))
    near = slice(1, 4)
    parabolas = [np.polyfit(path.s[near] - path.s[2], q[near, joint], 2)[0] for joint in (0, 1)]
    np.testing.assert_allclose(path.curve.evaluate(path.s[2], 2), 2 * np.array(parabolas), rtol=1e-9)
    assert not path.curve.evaluate(path.s[2], 1).any()


def test_where_one_joint_goes_on_a_quintic_has_what_its_rule_computes() -> None:
    """The means of slopes and of their changes beside it, and zero where these change their sign."""
    q = np.array([[0.0, 0.0], [0.4, 0.3], [1.0, 0.5], [1.5, 0.1], [2.5, 0.0]])
    points = table(q)
    path = spline_through("quintic", "chord", points, robot(2))
    slopes = np.diff(q, axis=0) / np.diff(path.s)[:, None]
    rates = np.zeros_like(points.rates)
    rates[0, [0, -1]] = slopes[[0, -1]]
    plain = curve_through("quintic", replace(points, rates=rates), path.s)
    np.testing.assert_array_equal(path.curve.coefficients, plain.coefficients)
