"""Lower bounds of durations against closed forms, and against motions on grids of any density."""

from __future__ import annotations

import numpy as np
import pytest
from topp_paths import SpeedCap, polyline, random_bounds, spline, symmetric

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
