"""Inverse dynamics of a UR5, the proof of its efforts, and time-optimal motion within them."""

from __future__ import annotations

import sys
from pathlib import Path

from benchmarks.contest import Function, Runs, compete
from benchmarks.figures import Figure

STATES = 100_000
POINTS, INTERVALS = 10, 1000
VELOCITY, ACCELERATION = 3.14, 10.0  # of every joint, rad/s and rad/s^2
EFFORTS = (150.0, 150.0, 150.0, 28.0, 28.0, 28.0)
_URDF = Path(__file__).parents[1] / "tests" / "urdf" / "models" / "ur5.urdf"


def ours():
    """Prepare our recursion over all states at once."""
    q, qd, qdd = _states()
    dynamics = _dynamics()
    return lambda: dynamics.effort(q, qd, qdd), _few


def pinocchio():
    """Prepare pinocchio's recursion, state by state from Python."""
    import numpy as np
    import pinocchio as pin

    model = pin.buildModelFromUrdf(str(_URDF))
    data, states = model.createData(), _states()

    def run():
        return np.array([pin.rnea(model, data, *state) for state in zip(*states, strict=True)])

    return run, _few


def along_path():
    """Prepare rows, passes and time law within velocities and efforts on a fixed grid."""
    from trajcli.dynamics.effort_constraint import EffortConstraint

    path, velocity, _, effort = _path()
    dynamics = _dynamics()
    return _on_grid(path, lambda: EffortConstraint(dynamics, path, effort, velocity))


def toppra():
    """Prepare toppra with pinocchio's inverse dynamics on the same grid."""
    import numpy as np
    import pinocchio as pin
    from toppra import SplineInterpolator
    from toppra.algorithm import TOPPRA
    from toppra.constraint import DiscretizationType, JointTorqueConstraint, JointVelocityConstraint

    model = pin.buildModelFromUrdf(str(_URDF))
    data, (s, points) = model.createData(), _points()
    limits, grid = np.array(EFFORTS), np.linspace(0.0, 1.0, INTERVALS + 1)
    path = SplineInterpolator(s, points, bc_type="not-a-knot")

    def run():
        torques = JointTorqueConstraint(
            lambda q, v, a: pin.rnea(model, data, q, v, a).copy(),
            np.stack([-limits, limits], axis=1),
            np.zeros(limits.size),
            discretization_scheme=DiscretizationType.Interpolation,
        )
        bounds = np.tile([-VELOCITY, VELOCITY], (limits.size, 1))
        solver = TOPPRA([JointVelocityConstraint(bounds), torques], path, gridpoints=grid)
        _, sd, _ = solver.compute_parameterization(0.0, 0.0)
        return float((2.0 * np.diff(grid) / (sd[1:] + sd[:-1])).sum())

    return run, _shown


def whole():
    """Prepare the whole time-optimal solution within efforts: refined, kept between grid points."""
    from trajcli.curves.time_optimal.parameterization import time_optimal
    from trajcli.dynamics.effort_constraint import EffortConstraint

    path, velocity, acceleration, effort = _path()
    dynamics = _dynamics()

    def run():
        constraint = EffortConstraint(dynamics, path, effort, velocity)
        return time_optimal(path, velocity, acceleration * float("inf"), further=[constraint]).trajectory

    return run, lambda _: [0.0]


def whole_without():
    """Prepare the same within accelerations."""
    from trajcli.curves.time_optimal.parameterization import time_optimal

    path, velocity, acceleration, _ = _path()
    return lambda: time_optimal(path, velocity, acceleration).trajectory, lambda _: [0.0]


def proof():
    """Prepare the proof of the efforts of a spline of 10 s through ten points."""
    import numpy as np

    from trajcli.dynamics.effort_bound import effort_survey

    path, *_, effort = _path()
    degrees = np.arange(len(path.coefficients) - 1, -1, -1)[:, None, None]
    breaks, coefficients = path.breaks * 10.0, path.coefficients / 10.0**degrees
    dynamics = _dynamics()

    def run():
        survey = effort_survey(dynamics, breaks, coefficients, effort)
        return [peak.upper_bound for peak in (*survey.highest(), *survey.lowest())]

    return run, lambda _: [0.0]


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: against pinocchio and toppra, without efforts, and the proof in seconds."""
    module, mine = "benchmarks.dynamics", sys.executable
    recursion = compete(
        {
            "ours": Function(mine, module, "ours"),
            "pinocchio": Function(peers, module, "pinocchio", peer=True),
        }
    )
    on_grid = compete(
        {
            "ours": Function(mine, module, "along_path"),
            "toppra": Function(peers, module, "toppra", peer=True),
        }
    )
    pairs = (("whole", "whole_without"), ("proof",))
    alone: dict[str, Runs] = {}
    for pair in pairs:
        alone |= compete({name: Function(mine, module, name) for name in pair})
    theirs, path = recursion["pinocchio"], on_grid["toppra"]
    title = "time-optimal within torques, 6 joints"
    return [
        Figure(
            f"inverse dynamics of {STATES} states",
            "pinocchio, state by state",
            recursion["ours"].seconds,
            theirs.seconds,
            0.5,
            skipped=theirs.skipped,
        ),
        Figure(
            f"{title}, {INTERVALS} grid points",
            "toppra, JointTorqueConstraint",
            on_grid["ours"].seconds,
            path.seconds,
            0.5,
            skipped=path.skipped,
        ),
        Figure(
            title,
            "the same within accelerations",
            alone["whole"].seconds,
            alone["whole_without"].seconds,
            1.8,
        ),
        Figure("proof of torques, 10 s", "seconds", alone["proof"].seconds, [], 0.3, kind="seconds"),
    ]


def _states():
    import numpy as np

    return tuple(np.random.default_rng(1).uniform(-3.0, 3.0, (3, STATES, 6)))


def _dynamics():
    from trajcli.dynamics.newton_euler import InverseDynamics
    from trajcli.urdf.serial_robot import robot_of_urdf

    return InverseDynamics(robot_of_urdf(_URDF.read_bytes(), "ur5.urdf").robot)


def _points():
    import numpy as np

    return np.linspace(0.0, 1.0, POINTS), np.random.default_rng(3).uniform(-1.0, 1.0, (POINTS, 6))


def _path():
    import numpy as np
    from scipy.interpolate import CubicSpline

    from trajcli.curves.piecewise import PiecewisePolynomial

    spline = CubicSpline(*_points(), bc_type="not-a-knot")
    bounds, efforts = np.tile([-1.0, 1.0], (6, 1)), np.array(EFFORTS)
    path = PiecewisePolynomial(spline.x, spline.c)
    return path, VELOCITY * bounds, ACCELERATION * bounds, np.stack([-efforts, efforts], axis=1)


def _on_grid(path, constraint):
    """Prepare rows, passes and time law on a fixed grid, within velocities and another constraint."""
    import numpy as np

    from trajcli.curves.time_optimal.collocation import interval_rows
    from trajcli.curves.time_optimal.constraints import JointConstraint
    from trajcli.curves.time_optimal.passes import solve
    from trajcli.curves.time_optimal.time_law import law_pieces

    velocity = np.tile([-VELOCITY, VELOCITY], (6, 1))
    velocities = JointConstraint(path, velocity, velocity * np.inf)
    grid, nowhere = np.linspace(0.0, 1.0, INTERVALS + 1), np.empty(0)

    def run():
        rows = interval_rows(grid, [velocities, constraint()], nowhere)
        return float(law_pieces(grid, solve(rows, 0.0, 0.0).x).durations.sum())

    return run, _shown


def _shown(duration):
    """Return the duration to 0.1 %: the peer's solver has a tolerance of its own."""
    return [float(f"{duration:.3g}")]


def _few(efforts):
    return efforts[:: STATES // 10].reshape(-1).tolist()
