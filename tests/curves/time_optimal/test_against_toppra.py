"""Random splines against toppra, whose own result is stretched until it keeps the limits for all t too."""

from __future__ import annotations

import logging
from math import sqrt

import numpy as np
import pytest
from tiers import few
from topp_paths import TOLERANCE, assert_motion, over, random_bounds, spline

from trajcli.curves.operations import compose
from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.parameterization import time_optimal

EACH = 500  # intervals of its grid for each waypoint


def toppra_duration(path, waypoints, s, velocity, acceleration):
    """Return toppra's duration, stretched, or None where it finds nothing."""
    from toppra import SplineInterpolator
    from toppra.algorithm import TOPPRA
    from toppra.constraint import DiscretizationType, JointAccelerationConstraint, JointVelocityConstraint

    logging.getLogger("toppra").setLevel(logging.CRITICAL)
    rows = JointAccelerationConstraint(acceleration, discretization_scheme=DiscretizationType.Interpolation)
    places = np.linspace(path.start, path.end, EACH * len(waypoints) + 1)
    solver = TOPPRA(
        [JointVelocityConstraint(velocity), rows],
        SplineInterpolator(s, waypoints, bc_type="not-a-knot"),
        gridpoints=places,
        parametrizer="ParametrizeConstAccel",
    )
    _, sd, _ = solver.compute_parameterization(0, 0)
    if sd is None or np.isnan(sd).any():
        return None
    times = np.concatenate([[0.0], np.cumsum(2 * np.diff(places) / (sd[1:] + sd[:-1]))])
    sdd = np.diff(sd**2) / (2 * np.diff(places))
    law = PiecewisePolynomial(times, np.stack([sdd / 2, sd[:-1], places[:-1]])[:, :, None])
    v, a = over(compose(path, law), velocity, acceleration)
    return times[-1] * max(1.0, v, sqrt(a))


def contest(seed, points):
    rng = np.random.default_rng(seed)
    joints = int(rng.integers(2, 8))
    waypoints = rng.uniform(-1, 1, (points, joints))
    chords = np.linalg.norm(np.diff(waypoints, axis=0), axis=1)
    s = np.concatenate([[0.0], np.cumsum(chords)])
    velocity, acceleration = random_bounds(rng, joints)
    path = spline(waypoints, s)
    found = time_optimal(path, velocity, acceleration)
    assert max(over(found.trajectory, velocity, acceleration)) <= 1 + TOLERANCE
    theirs = toppra_duration(path, waypoints, s, velocity, acceleration)
    return found, path, velocity, acceleration, theirs


@pytest.mark.parametrize(("seed", "points"), few([(0, 5), (2, 20), (1, 5)], 2))
def test_as_fast_as_toppra(seed, points):
    found, path, velocity, acceleration, theirs = contest(seed, points)
    assert found.stretch <= 1.0005
    assert found.trajectory.duration <= 1.001 * theirs
    assert found.trajectory.duration >= 0.999 * theirs  # on so fine a grid toppra is near the optimum too
    assert found.lower_bound <= theirs
    assert_motion(found, path, velocity, acceleration)


@pytest.mark.soak
@pytest.mark.parametrize("points", [5, 20, 100, 1000])
def test_as_fast_as_toppra_on_fifty_splines(points):
    for seed in range(100, 150):
        found, path, velocity, acceleration, theirs = contest(seed, points)
        assert_motion(found, path, velocity, acceleration)
        if theirs is not None:
            assert found.trajectory.duration <= 1.002 * theirs, f"seed {seed}"
            if points <= 20:
                assert found.trajectory.duration >= 0.99 * theirs, f"seed {seed}"
