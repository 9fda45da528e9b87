"""A spline of six joints through ten points as fast as its limits allow, on 1000 grid points."""

from __future__ import annotations

import sys

from benchmarks.contest import Function, compete
from benchmarks.figures import Figure

POINTS, JOINTS, INTERVALS = 10, 6, 1000
VELOCITY, ACCELERATION = 2.0, 5.0  # of every joint, rad/s and rad/s^2


def ours():
    """Prepare our solution: rows of the limits, both passes, time law."""
    import numpy as np
    from scipy.interpolate import CubicSpline

    from trajcli.curves.piecewise import PiecewisePolynomial
    from trajcli.curves.time_optimal.collocation import interval_rows
    from trajcli.curves.time_optimal.constraints import JointConstraint
    from trajcli.curves.time_optimal.passes import solve
    from trajcli.curves.time_optimal.time_law import law_pieces

    s, points, velocity, acceleration = _problem()
    spline = CubicSpline(s, points, bc_type="not-a-knot")
    path = PiecewisePolynomial(spline.x, spline.c)
    grid, nowhere = np.linspace(0.0, 1.0, INTERVALS + 1), np.empty(0)

    def run():
        rows = interval_rows(grid, [JointConstraint(path, velocity, acceleration)], nowhere)
        return float(law_pieces(grid, solve(rows, 0.0, 0.0).x).durations.sum())

    return run, _shown


def toppra():
    """Prepare toppra with the same rows, the interpolation scheme; its trajectory is not asked for."""
    import numpy as np
    from toppra import SplineInterpolator
    from toppra.algorithm import TOPPRA
    from toppra.constraint import DiscretizationType, JointAccelerationConstraint, JointVelocityConstraint

    s, points, velocity, acceleration = _problem()
    path = SplineInterpolator(s, points, bc_type="not-a-knot")
    scheme = DiscretizationType.Interpolation
    grid = np.linspace(0.0, 1.0, INTERVALS + 1)

    def run():
        limits = [
            JointVelocityConstraint(velocity),
            JointAccelerationConstraint(acceleration, discretization_scheme=scheme),
        ]
        solver = TOPPRA(limits, path, gridpoints=grid, parametrizer="ParametrizeConstAccel")
        _, sd, _ = solver.compute_parameterization(0.0, 0.0)
        return float((2.0 * np.diff(grid) / (sd[1:] + sd[:-1])).sum())

    return run, _shown


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figure: against toppra."""
    module = "benchmarks.time_optimal"
    runs = compete(
        {
            "ours": Function(sys.executable, module, "ours"),
            "toppra": Function(peers, module, "toppra", peer=True),
        }
    )
    ours, theirs = runs["ours"].seconds, runs["toppra"]
    name = "time-optimal, 6 joints, 1000 grid points"
    return [Figure(name, "toppra", ours, theirs.seconds, 0.1, skipped=theirs.skipped)]


def _problem():
    import numpy as np

    points = np.random.default_rng(1).uniform(-1.0, 1.0, (POINTS, JOINTS))
    bounds = np.tile([-1.0, 1.0], (JOINTS, 1))
    return np.linspace(0.0, 1.0, POINTS), points, VELOCITY * bounds, ACCELERATION * bounds


def _shown(duration):
    """Return the duration to 1 %: the peer's solver has a tolerance of its own, here of 0.2 %."""
    return [float(f"{duration:.2g}")]
