"""Limits of the jerk of the tool along paths of joints: a circle by hand, a UR5e by differences of its poses."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest
from numpy.polynomial import Polynomial
from scipy.spatial.transform import Rotation

from trajcli.curves.piecewise import PiecewisePolynomial
from trajcli.curves.third_order.jerk import JerkRows, LawState
from trajcli.curves.time_optimal.time_law import LawPieces
from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.planners.tool_constraint import ToolJerkConstraint, ToolOfJoints

LEVER, TURN = 0.5, 1.2
STATE: LawState = (
    np.array([0.0, 0.3, 0.6, 1.0]),
    np.array([0.7, 1.1, 0.0, 0.4]),
    np.array([-0.5, 2.0, 0.0, 0.0]),
    np.array([3.0, -1.0, 2.0, 0.0]),
)


def one_link(lever: float = LEVER) -> ToolOfJoints:
    """Return a tool on a circle about the base, along a straight line of the joint."""
    robot = Robot("link", (Joint("j1", "revolute", a=lever),), unlimited(1), "standard", np.eye(4), np.eye(4))
    return ToolOfJoints(PiecewisePolynomial(np.array([0.0, 1.0]), np.array([[[TURN]], [[0.1]]])), robot)


def used(rows: JerkRows, state: LawState) -> np.ndarray:
    """Return the share of each row's limit, (p, k)."""
    v, a, u = (each[:, None] for each in state[1:])
    return (rows.first * u + 3 * rows.second * v * a + rows.third * v**3) / rows.limit


def on_circle(v: np.ndarray, a: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the sizes of the jerk of a point at LEVER and of its angular jerk."""
    along, across = LEVER * (TURN * u - (TURN * v) ** 3), 3 * LEVER * TURN**2 * v * a
    return np.hypot(along, across), np.abs(TURN * u)


@pytest.mark.parametrize("limits", [(2.0, inf), (inf, 3.0), (2.0, 3.0)])
def test_the_nearest_row_is_the_size_of_the_jerk_and_p_is_in_their_plane(
    limits: tuple[float, float],
) -> None:
    rows = ToolJerkConstraint(one_link(), limits).rows(STATE, "right")
    sizes = [size / limit for size, limit in zip(on_circle(*STATE[1:]), limits, strict=True) if limit < inf]
    shares = used(rows, STATE).reshape(4, len(sizes), 18)
    np.testing.assert_allclose(shares.max(axis=2), np.transpose(sizes), atol=1e-12)
    np.testing.assert_allclose(shares.min(axis=2), -np.transpose(sizes), atol=1e-12)
    around = np.square(rows.first / rows.limit).reshape(4, len(sizes), 18)[..., :16].sum(axis=2)
    tangents = [size / limit for size, limit in zip((LEVER * TURN, TURN), limits, strict=True) if limit < inf]
    np.testing.assert_allclose(
        around, np.tile(8 * np.square(tangents), (4, 1)), rtol=1e-12
    )  # 16 of mean cos^2


def test_a_tool_on_the_axis_has_angular_jerk_alone() -> None:
    rows = ToolJerkConstraint(one_link(0.0), (2.0, 3.0)).rows(STATE, "right")
    shares = used(rows, STATE)
    assert not shares[:, :18].any()
    np.testing.assert_allclose(shares[:, 18:].max(axis=1), np.abs(TURN * STATE[3]) / 3.0, atol=1e-12)


@pytest.mark.parametrize("limits", [(2.0, inf), (inf, 3.0), (2.0, 3.0), (9.0, 0.1)])
def test_the_excess_is_the_largest_share_in_each_piece(limits: tuple[float, float]) -> None:
    """Its samples are six in a piece, its ends among them: the true one is a little larger in between."""
    columns = np.array([[0.3, -0.2], [-0.4, 0.5], [0.2, -0.1], [0.4, 0.6], [0.0, 0.5]])
    law = LawPieces(np.array([0.8, 0.6]), columns)
    found = ToolJerkConstraint(one_link(), limits).excess(law)
    for k, (duration, column) in enumerate(zip(law.durations, columns.T, strict=True)):
        s, t = Polynomial(column[::-1]), np.linspace(0.0, duration, 2001)
        sizes = on_circle(*(s.deriv(order)(t) for order in (1, 2, 3)))
        true = max(float(size.max()) / limit for size, limit in zip(sizes, limits, strict=True))
        assert 0.97 * true <= found[k] <= true * (1 + 1e-9)


@pytest.mark.parametrize("part", [0, 1])
def test_six_joints_against_differences_of_poses(part: int) -> None:
    """Third differences of a position, second ones of turning, of q(s(t)) about t = 0."""
    rng = np.random.default_rng(4)
    curve = PiecewisePolynomial(np.array([0.0, 1.0]), rng.normal(size=(4, 1, 6)))
    tool, h = ToolOfJoints(curve, load_robot("ur5e")), 2e-3
    limits = (1.0, inf) if part == 0 else (inf, 1.0)
    found = used(ToolJerkConstraint(tool, limits).rows(STATE, "left"), STATE).max(axis=1)
    for k, (s, v, a, u) in enumerate(zip(*STATE, strict=True)):
        t = h * np.arange(-4, 5)
        q = np.stack(
            [np.polyval(row, s + v * t + a * t**2 / 2 + u * t**3 / 6) for row in curve.coefficients[:, 0].T]
        )
        poses = forward(tool.robot, q.T)
        if part == 0:
            weights = np.array([-7, 72, -338, 488, 0, -488, 338, -72, 7]) / (240 * h**3)
            jerk = weights @ poses[:, :3, 3]
        else:
            turns = Rotation.from_matrix(poses[:, :3, :3])
            rates = [(turns[i + 1] * turns[i - 1].inv()).as_rotvec() / (2 * h) for i in range(1, 8)]
            jerk = (rates[4] - 2 * rates[3] + rates[2]) / h**2
        assert found[k] == pytest.approx(np.linalg.norm(jerk), rel=2e-3, abs=1e-3)
