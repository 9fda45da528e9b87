"""Lower bounds of durations against closed forms, and against motions on grids of any density."""

from __future__ import annotations

import numpy as np
import pytest
from topp_paths import SpeedCap, polyline, random_bounds, spline, symmetric

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.constraints import JointConstraint
from trajcli.curves.time_optimal.lower_bound import lower_bound
from trajcli.curves.time_optimal.parameterization import time_optimal

FREE, REST, NOWHERE = (np.inf, np.inf), (0.0, 0.0), np.empty(0)


@pytest.mark.parametrize(("speed", "exact"), [(9.0, 2.0 * 3.0**0.5), (1.0, 3.0 + 1.0)])
@pytest.mark.parametrize("ends", [[0.0, 3.0], [2.0, -1.0]])
def test_from_rest_to_rest_it_is_the_trapezoid_on_any_grid(speed, exact, ends):
    """Over the distance 3 with the acceleration 1: 2 sqrt(D / a), or D / v + v / a."""
    joints = JointConstraint(polyline([[ends[0]], [ends[1]]]), symmetric(speed), symmetric(1.0))
    for count in (2, 3, 100):
        found = lower_bound(joints, (), FREE, (np.linspace(0.0, 1.0, count), NOWHERE), REST)
        assert found == pytest.approx(exact, rel=1e-7)
        assert found < exact


def test_a_cap_and_limits_along_the_path_count_too():
    joints = JointConstraint(polyline([[0.0], [1.0]]), symmetric(9.0), symmetric(100.0))
    places = np.linspace(0.0, 1.0, 51), NOWHERE
    plain = lower_bound(joints, (), FREE, places, REST)
    assert plain == pytest.approx(1.0 / 9.0 + 0.09, rel=1e-6)
    assert lower_bound(joints, (), (0.5, 4.0), places, REST) == pytest.approx(2.0 + 0.125, rel=1e-6)
    half = SpeedCap(lambda s: np.where((s > 0.45) & (s < 0.55), 0.0, np.inf) + 0.5)
    assert lower_bound(joints, (half,), FREE, places, REST) > 1.2 * plain


@pytest.mark.parametrize("seed", range(4))
def test_the_fewer_points_the_lower_and_never_above_a_motion(seed):
    """The motion keeps its limits for all t, which other tests show; on its own grid it is near to the bound."""
    rng = np.random.default_rng(seed)
    joints = int(rng.integers(2, 8))
    path, bounds = spline(rng.uniform(-1, 1, (7, joints))), random_bounds(rng, joints)
    motion = time_optimal(path, *bounds)
    constraint = JointConstraint(path, *bounds)
    grids = [np.union1d(np.linspace(0.0, 1.0, 1 + 6 * n), path.breaks) for n in (1, 5, 30, 600)]
    found = [lower_bound(constraint, (), FREE, (grid, NOWHERE), REST) for grid in grids]
    assert (np.diff(found) > 0).all()
    assert found[-1] <= motion.trajectory.duration <= 1.001 * found[-1]
    assert 0.9995 * found[-1] <= motion.lower_bound <= motion.trajectory.duration


def test_ends_in_motion_need_less_and_stops_more():
    path, bounds = spline(np.random.default_rng(1).uniform(-1, 1, (6, 2))), (symmetric(2, 2), symmetric(5, 5))
    rest, places = time_optimal(path, *bounds).lower_bound, (np.linspace(0, 1, 301), path.breaks[2:3])
    assert time_optimal(path, *bounds, start_velocity=0.1).lower_bound < rest
    assert lower_bound(JointConstraint(path, *bounds), (), FREE, places, REST) > 1.02 * rest


def ramps(distance, speed, up, down, first, last):
    """The time of the fastest motion over a distance, all rates positive."""
    peak = min(speed, np.sqrt((2 * distance + first**2 / up + last**2 / down) / (1 / up + 1 / down)))
    ramp = (peak**2 - first**2) / (2 * up) + (peak**2 - last**2) / (2 * down)
    return (peak - first) / up + (peak - last) / down + (distance - ramp) / peak


@pytest.mark.parametrize("count", [2, 3, 40])
@pytest.mark.parametrize("joint", [0, 1])
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize(("first", "last"), [(0.0, 0.0), (1.0, 0.0), (0.0, 0.7), (1.3, 0.4)])
def test_limits_by_direction_and_ends_in_motion_of_any_joint(first, last, side, joint, count):
    """One joint goes over 3, forth or back, another one by a hundredth of that."""
    slopes = np.where(np.arange(2) == joint, 3.0 * side, 0.03)
    velocity, acceleration = np.tile([-1e3, 1e3], (2, 1)), np.tile([-1e3, 1e3], (2, 1))
    velocity[joint] = np.sort([2.0 * side, -9.0 * side])
    acceleration[joint] = np.sort([1.0 * side, -4.0 * side])
    joints = JointConstraint(polyline([[0.0, 0.0], slopes]), velocity, acceleration)
    places = np.linspace(0.0, 1.0, count), NOWHERE
    found = lower_bound(joints, (), FREE, places, (first / 3, last / 3))
    exact = ramps(3.0, 2.0, 1.0, 4.0, first, last)
    assert found == pytest.approx(exact, rel=1e-6)
    assert found < exact


class Needs(SpeedCap):
    """A limit that says what each interval needs, and nothing of sd."""

    def __init__(self, *times):
        super().__init__(lambda s: np.full(s.size, np.inf))
        self.times = np.array(times)

    def shortest(self, s):
        assert s.size == self.times.size + 1
        return self.times


@pytest.mark.parametrize("acceleration", [np.inf, 1e9])
def test_in_each_interval_what_needs_longest_counts(acceleration):
    """The joint 1, 2 and 1 s in three intervals; one limit 3 s in the first, another one 2.5 s in the last."""
    joints = JointConstraint(polyline([[0.0], [4.0]], s=[0.0, 4.0]), symmetric(1.0), symmetric(acceleration))
    caps = Needs(3.0, 0.0, 0.5), Needs(0.0, 1.0, 2.5)
    places = np.array([0.0, 1.0, 3.0, 4.0]), NOWHERE
    for chosen in (caps, caps[::-1]):
        assert lower_bound(joints, chosen, FREE, places, REST) == pytest.approx(3.0 + 2.0 + 2.5, rel=1e-6)
    assert lower_bound(joints, caps[:1], FREE, places, REST) == pytest.approx(3.0 + 2.0 + 1.0, rel=1e-6)
    assert lower_bound(joints, (), FREE, places, REST) == pytest.approx(4.0, rel=1e-6)


class BySide(SpeedCap):
    """A limit of sd that is another one from s = 1 on."""

    def __init__(self, before, behind):
        self.before, self.behind = before, behind
        super().__init__(None)

    def largest(self, s, side):
        behind = (s >= 1.0) if side == "right" else (s > 1.0)
        return np.where(behind, self.behind, self.before) ** 2


@pytest.mark.parametrize(("before", "behind"), [(0.5, np.inf), (np.inf, 0.5)])
def test_a_cap_counts_on_either_side_of_a_grid_point_and_so_does_each_of_several(before, behind):
    """Where it goes fast it is held in the middle alone: from rest to 0.5 and on to rest with the acceleration 1."""
    joints = JointConstraint(polyline([[0.0], [2.0]], s=[0.0, 2.0]), symmetric(100.0), symmetric(1.0))
    places = np.array([0.0, 1.0, 2.0]), NOWHERE
    loose = SpeedCap(lambda s: np.full(s.size, 50.0))
    for caps in ((BySide(before, behind),), (loose, BySide(before, behind)), (BySide(before, behind), loose)):
        found = lower_bound(joints, caps, FREE, places, REST)
        assert found == pytest.approx(2 * ramps(1.0, 100.0, 1.0, 1.0, 0.0, 0.5), rel=1e-6)
    moving = lower_bound(joints, (BySide(before, behind),), FREE, places, FREE)
    held = ramps(1.0, 100.0, 1.0, 1.0, 0.5, 0.5)
    free = 2.0 * 1.0 / (0.5 + np.sqrt(0.25 + 2.0))
    assert moving == pytest.approx(held + free, rel=1e-6)


def test_limits_along_a_path_of_several_pieces_need_no_break_in_the_grid():
    straight = polyline([[0.0], [1.0], [4.0]], s=[0.0, 1.0, 4.0])
    joints = JointConstraint(straight, symmetric(1e3), symmetric(1e3))
    found = lower_bound(joints, (), (0.5, 4.0), (np.array([0.0, 4.0]), NOWHERE), REST)
    assert found == pytest.approx(4.0 / 0.5 + 0.5 / 4.0, rel=1e-6)


def test_a_joint_without_a_limit_of_acceleration_counts_by_its_velocity_beside_others():
    joints = JointConstraint(polyline([[0.0, 0.0], [1.0, 3.0]]), symmetric(9.0, 0.5), symmetric(50.0, np.inf))
    for count in (2, 30):
        found = lower_bound(joints, (), FREE, (np.linspace(0, 1, count), NOWHERE), FREE)
        assert found == pytest.approx(6.0, rel=1e-6)


def test_a_joint_that_turns_is_counted_there_and_back():
    """q = s (2 - s): 1 rad and back from rest to rest, twice 2 sqrt(1 / a), also without a grid point at the turn."""
    path = PiecewisePolynomial(np.array([0.0, 2.0]), np.array([-1.0, 2.0, 0.0])[:, None, None])
    joints = JointConstraint(path, symmetric(1e3), symmetric(4.0))
    for count in (2, 4, 8):
        found = lower_bound(joints, (), FREE, (np.linspace(0, 2, count), NOWHERE), REST)
        assert found == pytest.approx(2.0, rel=1e-6)


def test_what_cannot_be_kept_bounds_nothing():
    """An end that is too fast for the way there; a path on which no joint moves, along which nothing is limited."""
    line = polyline([[0.0], [1.0]])
    joints, places = JointConstraint(line, symmetric(9.0), symmetric(1.0)), (np.linspace(0, 1, 5), NOWHERE)
    for ends in ((0.0, 5.0), (5.0, 0.0)):
        assert lower_bound(joints, (), FREE, places, ends) == 0.0
    still = JointConstraint(polyline([[1.0], [1.0]]), symmetric(9.0), symmetric(1.0))
    assert lower_bound(still, (), FREE, places, FREE) == 0.0
