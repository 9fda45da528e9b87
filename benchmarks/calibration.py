"""Calibration of a UR5e, 36 parameters, from 1000 measured poses."""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

from benchmarks.contest import Command, Function, compete
from benchmarks.figures import Figure
from benchmarks.forward_kinematics import configurations

POSES = 1000
_ERROR = 1e-3  # of each parameter, rad or m
_NOISE = 1e-4  # rad and m


def ours():
    """Prepare our least squares with the analytic Jacobian."""
    from trajcli.kinematics.calibration.fit import Options, calibrate

    robot, parameters, measurements, length = _problem()
    run = lambda: calibrate(robot, measurements, parameters, Options(length))  # noqa: E731
    return run, lambda fit: _residuals(measurements, fit.robot)


def scipy():
    """Prepare scipy's least_squares, which differentiates our batched residuals by finite differences."""
    import numpy as np
    from scipy.optimize import least_squares

    from trajcli.kinematics.calibration.parameters import shifted
    from trajcli.kinematics.forward import forward
    from trajcli.kinematics.inverse.target import residuals

    robot, parameters, measurements, length = _problem()
    target = measurements.kinds[0].target
    weights = np.repeat([1.0, length], 3)

    def missed(change):
        poses = forward(shifted(robot, parameters, change), measurements.joints)
        return (residuals(target, poses) * weights).ravel()

    run = lambda: least_squares(missed, np.zeros(len(parameters)), method="trf")  # noqa: E731
    return run, lambda found: _residuals(measurements, shifted(robot, parameters, found.x))


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: against scipy, and the whole command against start-up and one second."""
    module = "benchmarks.calibration"
    runs = compete({name: Function(sys.executable, module, name) for name in ("ours", "scipy")})
    name = f"calibration, 36 parameters, {POSES} poses"
    found = [
        Figure(name, "scipy least_squares, differences", runs["ours"].seconds, runs["scipy"].seconds, 0.2)
    ]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "measured.csv"
        _write(file)
        words = [sys.executable, "-m", "trajcli"]
        runs = compete(
            {
                "ours": Command([*words, "calibrate", "--robot", "ur5e", str(file)]),
                "start": Command([*words, "robots", "ur5e"]),
            }
        )
    allowed = [seconds + 1.0 for seconds in runs["start"].seconds]
    found.append(Figure("calibrate, whole process", "robots ur5e + 1 s", runs["ours"].seconds, allowed, 1.0))
    return found


def _problem():
    """Return robot, parameters, measurements and scale."""
    import numpy as np

    from trajcli.geometry.rotation import exp
    from trajcli.job.robot import load_robot
    from trajcli.kinematics.calibration.measurements import MeasuredKind, Measurements
    from trajcli.kinematics.calibration.parameters import all_parameters, shifted
    from trajcli.kinematics.dexterity import characteristic_length
    from trajcli.kinematics.forward import forward
    from trajcli.kinematics.inverse.target import pose_target

    robot, rng = load_robot("ur5e"), np.random.default_rng(1)
    parameters = all_parameters(robot)
    q = configurations(POSES)
    poses = forward(shifted(robot, parameters, rng.normal(size=len(parameters)) * _ERROR), q)
    poses[:, :3, 3] += rng.normal(size=(POSES, 3)) * _NOISE
    poses[:, :3, :3] = exp(rng.normal(size=(POSES, 3)) * _NOISE) @ poses[:, :3, :3]
    measurements = Measurements(q, (MeasuredKind(np.arange(POSES), pose_target(poses)),))
    return robot, parameters, measurements, characteristic_length(robot)


def _residuals(measurements, robot):
    """Return the root mean squares rounded to what two optima share."""
    return [round(value, 8) for value in measurements.root_mean_squares(robot)]


def _write(file):
    import numpy as np

    from trajcli.geometry.rotation import quaternion_from_matrix

    _, _, measurements, _ = _problem()
    poses = measurements.kinds[0].target.poses
    rows = np.hstack([measurements.joints, poses[:, :3, 3], quaternion_from_matrix(poses[:, :3, :3])])
    names = [*(f"q{i}" for i in range(1, 7)), "x", "y", "z", "qw", "qx", "qy", "qz"]
    np.savetxt(file, rows, delimiter=",", header=",".join(names), comments="")
