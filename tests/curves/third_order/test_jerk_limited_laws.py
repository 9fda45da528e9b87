"""Jerk-limited laws along paths: against ruckig, reference durations, copp, and by laws of scale and symmetry."""

from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from jerk_paths import PANDA, both, copp_problem, judged, polyline, spline
from tiers import QUICK, few
from yaml_files import read_yaml

from trajcli.curves.operations import reverse
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.third_order import parameterization
from trajcli.curves.third_order.convex_step import faster
from trajcli.curves.third_order.curved_paths import rounded_polyline
from trajcli.curves.third_order.interior_point import ChainProgram
from trajcli.curves.third_order.parameterization import jerk_limited_time_optimal
from trajcli.curves.time_optimal.constraints import JointConstraint
from trajcli.curves.time_optimal.parameterization import UnsettledSpeedError, time_optimal

ORACLES = Path(__file__).parents[2] / "oracles" / "jerk_limited_splines.yaml"
LINE = -np.array([1.243052, 0.789568, -0.903823, -0.246486, 1.217614, 0.200619, 0.062846])


def ruckig_duration(distance, velocity, acceleration, jerk, start_velocity=0.0, end_velocity=0.0):
    from ruckig import InputParameter, Ruckig, Trajectory

    problem, result = InputParameter(1), Trajectory(1)
    problem.current_position, problem.target_position = [0.0], [distance]
    problem.current_velocity, problem.target_velocity = [start_velocity], [end_velocity]
    problem.max_velocity, problem.max_acceleration, problem.max_jerk = [velocity], [acceleration], [jerk]
    Ruckig(1).calculate(problem, result)
    return result.duration


@pytest.mark.parametrize("factor", [1, 0.1, 0.02, 0.005])
def test_a_straight_line_takes_what_ruckig_takes_with_its_tightest_joint(factor):
    V, A, J = PANDA[0], PANDA[1], factor * PANDA[2]
    path = spline([0, 0.3, 0.7, 1], np.outer([0, 0.3, 0.7, 1], LINE))
    tightest = [float((limits / np.abs(LINE)).min()) for limits in (V, A, J)]
    best = ruckig_duration(1.0, *tightest)
    duration = judged(path, both(V), both(A), both(J)).law.duration
    assert best * (1 - 1e-9) <= duration <= 1.001 * best


@pytest.mark.parametrize(
    ("speed", "jerk"),
    few([(speed, jerk) for jerk in (10.0, 100.0, 1000.0) for speed in (0.2, 0.5, 0.9)], 4),
)
def test_a_line_that_begins_in_motion_takes_what_ruckig_takes(speed, jerk):
    path = PiecewisePolynomial(np.array([0.0, 2.0]), np.array([[[1.0]], [[0.0]]]))
    best = ruckig_duration(2.0, 1.0, 5.0, jerk, speed)
    bounds = both([1.0]), both([5.0]), both([jerk])
    duration = judged(path, *bounds, start=(speed, 0.0)).law.duration
    assert best * (1 - 1e-9) <= duration <= 1.001 * best


@pytest.mark.parametrize(
    ("velocity", "acceleration", "jerk", "start", "end"),
    [
        ((-0.694615, 0.130033), (-2.07999, 0.837957), 240.537, (0.0415536, -0.0467556), 0.083127),
        ((-0.29386, 0.308), (-0.4325, 2.011), 148.5, (0.12869, 0.0), 0.03565),
    ],
)
def test_a_limit_that_control_points_alone_pass_is_found_kept(velocity, acceleration, jerk, start, end):
    """Next to an end in motion, where nothing can be slowed down as a whole."""
    path = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[1.0]], [[0.0]]]))
    bounds = np.array([velocity]), np.array([acceleration]), both([jerk])
    judged(path, *bounds, start=start, end=(end, 0.0))


@pytest.mark.parametrize("factor", few([1, 0.02, 0.005], 2))
@pytest.mark.parametrize(("start", "end"), few([(0.9, 0.0), (0.0, 0.5), (0.2, 0.9), (1.0, 1.0)], 2))
def test_a_line_of_seven_joints_between_motions(factor, start, end):
    """Reversed in time it takes as long; from the tightest limits ruckig knows how long."""
    V, A, J = PANDA[0], PANDA[1], factor * PANDA[2]
    path = spline([0, 0.3, 0.7, 1], np.outer([0, 0.3, 0.7, 1], LINE))
    tightest = [float((limits / np.abs(LINE)).min()) for limits in (V, A, J)]
    ends = {"start": (start * tightest[0], 0.0), "end": (end * tightest[0], 0.0)}
    best = ruckig_duration(1.0, *tightest, ends["start"][0], ends["end"][0])
    duration = judged(path, both(V), both(A), both(J), **ends).law.duration
    assert best * (1 - 1e-9) <= duration <= 1.001 * best


@pytest.mark.parametrize("number", few(range(3), 1))
def test_splines_whose_best_durations_are_known(number):
    known = read_yaml(ORACLES)[number]
    path = spline(known["parameter"], np.array(known["points"]))
    duration = judged(path, both(PANDA[0]), both(PANDA[1]), both(0.02 * PANDA[2])).law.duration
    assert duration <= 1.001 * known["best"]


@pytest.mark.parametrize(
    ("count", "factor"),
    [(2, 1), (5, 1), (5, 0.02)] if QUICK else list(product([2, 3, 5, 12], [1, 0.02, 0.005])),
)
def test_reversed_scaled_and_mirrored_paths_take_as_long(count, factor):
    """The limits are alike in both directions, so time may run backwards, and s may be measured otherwise."""
    points = np.cumsum(np.random.default_rng(count).uniform(-0.7, 0.7, (count, 7)), axis=0)
    path = spline(np.linspace(0, 1, count), points)
    bounds = both(PANDA[0]), both(PANDA[1]), both(factor * PANDA[2])
    duration = judged(path, *bounds).law.duration
    scaled = PiecewisePolynomial(
        path.breaks * 7.0, path.coefficients / 7.0 ** np.arange(path.degree, -1, -1)[:, None, None]
    )
    mirrored = PiecewisePolynomial(path.breaks, -path.coefficients)
    others = (reverse(path), scaled, mirrored)
    turn = [1, 0.02, 0.005].index(factor) + count % 5  # in the quick tier each of them is met once
    for other in few(others[turn % 3 :] + others[: turn % 3], 1):
        assert judged(other, *bounds).law.duration == pytest.approx(duration, rel=2e-3)


@pytest.mark.full
def test_twice_the_time_for_limits_of_slower_joints():
    """Limits divided by 2, 4 and 8 are those of the same motion at half the speed."""
    path = spline(np.linspace(0, 1, 6), np.random.default_rng(1).uniform(-1, 1, (6, 7)))
    fast = judged(path, both(PANDA[0]), both(PANDA[1]), both(0.02 * PANDA[2])).law.duration
    slow = judged(path, both(PANDA[0] / 2), both(PANDA[1] / 4), both(0.02 * PANDA[2] / 8)).law.duration
    assert slow == pytest.approx(2 * fast, rel=1e-6)


@cache
def within(size):
    """Return a motion whose speed and acceleration are at most so large, and whose jerk is at most 10."""
    path = spline(np.linspace(0, 1, 5), np.random.default_rng(0).uniform(-2, 2, (5, 2)))
    wide, jerk = (both(np.full(2, each)) for each in (size, 10.0))
    return judged(path, wide, wide, jerk)


@pytest.mark.parametrize("size", few([1e4, 1e12, 1e9], 2))
def test_limits_that_are_never_reached_do_not_matter(size):
    """The law without limits of jerk, from which the search begins, is up to half a million times too fast."""
    motion = within(size)
    assert motion.law.duration == pytest.approx(within(60.0).law.duration, rel=3e-3)
    assert motion.stretch < 1.01


@pytest.mark.parametrize("make", [polyline, lambda points: spline(np.linspace(0, 1, 4), points)])
def test_ramps_shorter_than_rounding_of_the_duration(make):
    """A ramp of acceleration lasts 1e-12 s, the motion 1e9 s: no float64 tells when the ramp ends."""
    path = make(np.random.default_rng(4).uniform(-2, 2, (4, 2)))
    bounds = (both(np.full(2, size)) for size in (1e-9, 1e-3, 1e9))
    motion = judged(path, *bounds)
    assert motion.lower_bound <= motion.law.duration <= 1.1 * motion.lower_bound


def test_every_corner_is_a_stop_between_motions_from_rest_to_rest():
    points = np.array([[0.0, 0.0], [1.0, 0.2], [0.3, 1.0], [0.3, 1.5]])
    bounds = both([1.0, 1.2]), both([5.0, 4.0]), both([60.0, 50.0])
    motion = judged(polyline(points), *bounds)
    best = 0.0
    for step in np.diff(points, axis=0):
        length = np.linalg.norm(step)
        with np.errstate(divide="ignore"):
            tightest = [float((limits[:, 1] / np.abs(step)).min()) * length for limits in bounds]
        best += ruckig_duration(length, *tightest)
    assert best * (1 - 1e-9) <= motion.law.duration <= 1.001 * best
    assert motion.stops.size == 2
    at_rest = motion.trajectory.evaluate_orders(motion.stop_times, (0, 1, 2))
    np.testing.assert_allclose(at_rest[:, 0], points[1:3], atol=1e-9)
    np.testing.assert_allclose(at_rest[:, 1:], 0.0, atol=1e-7)


@pytest.mark.parametrize("length", few([1e-8, 1e-6], 1))
def test_a_corner_that_is_hardly_rounded_takes_little_longer_than_a_stop(length):
    """Where the first law is a thousand times too slow as a whole, or its nodes are nearly one."""
    corner = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]])
    path, _ = rounded_polyline(np.array([0.0, 1.0, 2.0]), corner, np.array([0.0, length, 0.0]))
    motion = jerk_limited_time_optimal(path, both([3.0, 3.0]), both([8.0, 8.0]), both([60.0, 60.0]))
    assert motion.law.duration <= 1.01 * 2.0 * ruckig_duration(1.0, 3.0, 8.0, 60.0)


@pytest.mark.full
def test_a_tight_bend_does_not_slow_down_all_the_rest():
    """Between two points next to each other, where the first law passes its limits by far."""
    points = np.array([[0.3, 1.2], [0.5, 1.3], [0.5001, 1.2999], [0.9, 1.25], [1.0, 2.0]])
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    motion = judged(spline(s, points), both([3.0, 3.0]), both([8.0, 8.0]), both([60.0, 60.0]))
    assert motion.law.duration < 1.55


def test_a_program_without_a_solution_ends_where_rounding_does():
    """Of one unknown p in 1 / sqrt(1 + p) that shall be less than -1.5."""
    one = np.array([1.0, 0.0, 0.0, 0.0]).reshape(4, 1, 1)
    found = ChainProgram(one, np.ones((1, 1)), one, np.full((1, 1), -1.5)).minimum(1e-6)
    assert -1.0 <= found[0, 0] < -0.99


def test_a_loose_limit_of_jerk_costs_next_to_nothing():
    path = spline(np.linspace(0, 1, 8), np.random.default_rng(3).uniform(-1, 1, (8, 7)))
    motion = judged(path, both(PANDA[0]), both(PANDA[1]), both(100 * PANDA[2]))
    fastest = time_optimal(path, both(PANDA[0]), both(PANDA[1]))
    assert motion.lower_bound <= motion.law.duration <= 1.003 * fastest.law.duration


@pytest.mark.full
@pytest.mark.parametrize("seed", few([0, 1], 1))
def test_below_the_stations_of_copp(seed):
    """COPP keeps the limits at 1001 stations only; figures of its release 0.2.3."""
    path, *limits = copp_problem(seed)
    at_stations = (38.9617263, 42.466653)[seed]
    made_feasible = (40.6169777, 44.9772806)[seed]
    duration = judged(path, *map(both, limits)).law.duration
    assert duration <= 1.005 * at_stations < made_feasible


@pytest.mark.parametrize("seed", few(range(24), 3))
def test_random_problems_keep_all_limits(seed):
    judged_problem(seed)


def between_states(seed):
    """Return a path of two joints with its bounds, and the states at its ends, for laws that are given up early."""
    draws = np.random.default_rng(seed)
    path = spline(np.linspace(0, 1, 5), draws.uniform(-1, 1, (5, 2)).round(3))
    bounds = [both([size, size]) for size in (2.0, 6.0, float(draws.choice([60, 120, 240])))]
    speeds, rates = draws.uniform(0.02, 0.3, 2).round(3), draws.uniform(-1, 1, 2).round(3)
    ends = {"start": (speeds[0], rates[0]), "end": (speeds[1], rates[1])}
    return (path, *bounds), {**ends, "hopeless": 1.3, "slower": 1e-4}


@pytest.mark.parametrize("seed", few([219, 132], 1))
def test_a_law_that_comes_no_nearer_to_its_limits_is_given_up_early(seed, monkeypatch):
    """It took 12 steps, two thirds of them on many nodes."""
    problem, how = between_states(seed)
    steps = []
    monkeypatch.setattr(parameterization, "faster", lambda *given: steps.append(0) or faster(*given))
    with pytest.raises(UnsettledSpeedError):
        jerk_limited_time_optimal(*problem, **how)
    assert len(steps) <= 8


@pytest.mark.parametrize("seed", few([110, 264, 255], 2))
def test_a_law_that_comes_nearer_slowly_is_waited_for(seed):
    """Of the first two it is late that a step halves what they pass, the last one is nearly there for seven steps."""
    problem, how = between_states(seed)
    judged(*problem, **how)


@pytest.mark.parametrize(("left", "accepted"), few([(4e-4, True), (6e-4, False), (0.8e-4, True)], 2))
def test_what_no_step_takes_away_is_left_to_slowing_down_by_little(left, accepted, monkeypatch):
    """Five times as much as steps may leave; the ends are slower by it, which those who ask for it can bear."""

    def settle(search, *given):
        search.stretch = 1.0 + left
        found.append(search.best)

    (problem, how), found = between_states(110), []
    monkeypatch.setattr(parameterization._Search, "settle", settle)
    if not accepted:
        with pytest.raises(UnsettledSpeedError):
            jerk_limited_time_optimal(*problem, **how)
        return
    law = jerk_limited_time_optimal(*problem, **how).law
    assert law.duration == pytest.approx(found[0].duration * (1.0 + left), rel=1e-9)
    assert law.evaluate(0.0, 1)[0] == pytest.approx(how["start"][0] / (1.0 + left), rel=1e-9)


@pytest.mark.parametrize(("bent", "start", "end"), [(0.75, 0.05, 0.0), (0.25, 0.0, 0.05)])
def test_a_limit_that_is_passed_without_hope_is_named_where_it_is_passed(bent, start, end):
    """It is one of a second arm, which bends about that place alone."""
    knots = np.array([0.0, bent - 0.05, bent, bent + 0.05, 1.0])
    bend = spline(knots, np.array([[0.0], [0.0], [0.03], [0.0], [0.0]]))
    other = JointConstraint(bend, both([1.0]), both([2.0]))
    line = PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[1.0]], [[0.0]]]))
    ends = {"start": (start, 0.0), "end": (end, 0.0), "hopeless": 1.0001}
    with pytest.raises(UnsettledSpeedError) as caught:
        jerk_limited_time_optimal(line, both([9.0]), both([9.0]), both([100.0]), further=[other], **ends)
    assert caught.value.s == pytest.approx(bent, abs=0.1)
    assert 1.0 < caught.value.over < 3.0


@pytest.mark.soak
@pytest.mark.parametrize("block", range(100))
def test_a_thousand_random_problems_keep_all_limits(block, tally):
    for seed in range(1000 + 10 * block, 1010 + 10 * block):
        judged(*random_problem(seed))
    tally({"laws": 10})


@cache
def judged_problem(seed):
    """Return the motion of a random problem, which keeps all limits."""
    return judged(*random_problem(seed))


def random_problem(seed):
    """Return path and bounds: walks, scattered, collinear and slow points, polylines, joints that do not move."""
    random = np.random.default_rng(seed)
    n, count = int(random.integers(1, 8)), int(random.integers(2, 20))
    kind = random.choice(["walk", "scattered", "collinear", "polyline", "slow"])
    factor = float(random.choice([10, 1, 0.1, 0.02, 0.005, 0.001]))

    def bounds(limits):
        high = limits[:n] * random.uniform(0.5, 1.5, n)
        return np.stack([-high * random.uniform(0.6, 1.4, n), high], axis=1)

    limits = bounds(PANDA[0]), bounds(PANDA[1]), bounds(factor * PANDA[2])
    step = 0.01 if kind == "slow" else 0.7
    if kind == "scattered":
        points = random.uniform(-1, 1, (count, n))
    elif kind == "collinear":
        points = np.sort(random.uniform(0, 1, count))[:, None] * random.uniform(-1, 1, n)
    else:
        points = np.cumsum(random.uniform(-step, step, (count, n)), axis=0)
    if n > 2 and random.random() < 0.3:
        points[:, 1] = 0.3
    if kind == "polyline":
        return polyline(points), *limits
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1) + 1e-9)])
    return spline(s, points), *limits
