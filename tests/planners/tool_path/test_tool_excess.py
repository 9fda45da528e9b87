"""How far a law exceeds the limits of the tool between grid points, against differences of the poses."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.time_optimal.parameterization import time_optimal
from trajcli.curves.time_optimal.time_law import LawPieces, law_pieces
from trajcli.geometry.paths.arc import Arc
from trajcli.geometry.paths.chain import join
from trajcli.geometry.paths.orientation import AxisAngleOrientation
from trajcli.geometry.paths.pose import PoseCurve
from trajcli.geometry.paths.position import Line
from trajcli.kinematics.following.tool_path import ToolPath
from trajcli.kinematics.robot import ToolLimits
from trajcli.planners.tool_constraint import ToolConstraint


def rounded_path() -> ToolPath:
    """Return a line, an arc and a line, the corners rounded, along which the tool also turns."""
    arc = Arc(np.array([0.5, 0.2, 0.0]), np.array([0.5, 0.4, 0.0]), np.array([0.0, 0.0, 1.0]), 1.2)
    segments = [Line(np.zeros(3), arc.start), arc, Line(arc.end, arc.end + np.array([0.1, 0.3, 0.2]))]
    chain = join(segments, 0.05)
    turns = Rotation.from_rotvec([[0, 0, 0], [0.5, 0.1, 0], [0.3, -0.4, 0.6], [0.9, 0, 0.2]]).as_matrix()
    poses = PoseCurve(chain, AxisAngleOrientation(turns, chain.progress))
    return ToolPath(poses, (True, True, True), "all")


def by_differences(path: ToolPath, law: LawPieces, limits: ToolLimits) -> np.ndarray:
    """Return the shares of speed and acceleration, shape (2, N), from the poses at 81 times of each piece."""
    shares = []
    for duration, column in zip(law.durations, law.coefficients.T, strict=True):
        t, step = np.linspace(0.0, duration, 81, retstep=True)
        s = np.polyval(column, t).clip(0.0, path.length)
        poses = path.poses.evaluate(s)[0]
        positions, rotations = poses[:, :3, 3], Rotation.from_matrix(poses[:, :3, :3])
        steps = np.diff(positions, axis=0) / step, (rotations[1:] * rotations[:-1].inv()).as_rotvec() / step
        speeds = [np.linalg.norm(rate, axis=1).max() for rate in steps]
        changes = [np.linalg.norm(np.diff(rate, axis=0), axis=1).max() / step for rate in steps]
        shares.append(
            [
                max(speeds[0] / limits.speed, speeds[1] / limits.angular_speed),
                max(changes[0] / limits.acceleration, changes[1] / limits.angular_acceleration),
            ]
        )
    return np.array(shares).T


@pytest.mark.parametrize(
    "limits", [ToolLimits(0.3, 0.8), ToolLimits(inf, inf, inf, 0.7, 2.0), ToolLimits(0.5, 1.5, inf, 1.0, 4.0)]
)
def test_the_excess_is_the_largest_share_of_a_limit(limits):
    path, rng = rounded_path(), np.random.default_rng(3)
    parts = np.linspace(0.0, 1.0, 9)[:-1]
    grid = np.append((path.breaks[:-1, None] + np.diff(path.breaks)[:, None] * parts).ravel(), path.length)
    x = rng.uniform(0.05, 0.2, grid.size)
    law = law_pieces(grid, x)
    excess, used = ToolConstraint(path, limits).excess(law), by_differences(path, law, limits)
    assert (used > 1.0).any(axis=1).all()
    np.testing.assert_allclose(excess, used, rtol=0.02, atol=0.02)
    np.testing.assert_array_equal(
        ToolConstraint(path, limits).excess(law.chosen(np.array([5]))), excess[:, [5]]
    )


def test_limits_of_the_tool_are_kept_between_grid_points():
    path, limits = rounded_path(), ToolLimits(0.3, 0.8, inf, 0.7, 2.0)
    breaks = path.breaks
    lengths = np.ones((1, breaks.size - 1, 1))
    joint = PiecewisePolynomial(breaks, np.concatenate([lengths, breaks[:-1, None][None]]))
    wide = np.array([[-50.0, 50.0]])
    found = time_optimal(joint, wide, 20 * wide, further=[ToolConstraint(path, limits)])
    law = LawPieces(found.law.lengths, found.law.coefficients[:, :, 0])
    assert ToolConstraint(path, limits).excess(law).max() <= 1.0 + 1e-9
    assert found.stretch <= 1.001
    assert found.tightened > 0
