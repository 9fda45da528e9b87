"""The largest speeds of a tool for all t: against calculus on a crank, and dense rows of forward kinematics."""

from __future__ import annotations

import numpy as np
import pytest
from tiers import few

from trajcli.job.robot import load_robot
from trajcli.kinematics.jacobian import tcp_acceleration, tcp_twist
from trajcli.kinematics.robot import Robot
from trajcli.limits import tool_bound
from trajcli.limits.tool_bound import tool_bounds

RNG = np.random.default_rng(5)
WITHIN = 1e-6  # relative, what is promised


def on_a_crank(coefficients: list[float]) -> np.ndarray:
    """Return the curve of a planar arm whose first joint follows a polynomial."""
    rows = np.zeros((len(coefficients), 1, 2))
    rows[:, 0, 0] = coefficients
    return rows


def dense(robot: Robot, breaks: np.ndarray, coefficients: np.ndarray, each: int = 4001) -> np.ndarray:
    """Return the largest sizes of v, w, a, e on rows of each piece."""
    best = np.zeros(4)
    for k, length in enumerate(np.diff(breaks)):
        t = np.linspace(0, length, each)
        q, qd, qdd = (
            np.stack([np.polyval(np.polyder(row, order), t) for row in coefficients[:, k].T], axis=1)
            for order in range(3)
        )
        moved = np.hstack([tcp_twist(robot, q, qd), tcp_acceleration(robot, q, qd, qdd)]).reshape(-1, 4, 3)
        best = np.maximum(best, np.linalg.norm(moved, axis=2).max(axis=0))
    return best


def test_a_crank_has_the_speed_of_its_joint() -> None:
    """q = t^3 - t^4 / 2: qd = 3 t^2 - 2 t^3 is largest at t = 1; w = qd, v = 0.5 qd."""
    robot = load_robot("planar2r")
    reach = sum(joint.a for joint in robot.joints)
    speed, spin, _, _ = tool_bounds(robot, np.array([2.0, 3.3]), on_a_crank([-0.5, 1.0, 0.0, 0.0, 0.0]))
    assert spin.value == pytest.approx(1.0, rel=WITHIN)
    assert speed.value == pytest.approx(reach, rel=WITHIN)
    assert speed.time == pytest.approx(3.0, abs=1e-3)
    assert 1.0 <= spin.upper_bound <= 1.0 + WITHIN
    assert reach * (1 - 1e-12) <= speed.upper_bound <= reach * (1 + WITHIN)


def test_between_rows_the_tool_is_as_near_as_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """A steady turn by 5 rad on one piece: the interpolation is beside it by up to a fifth of what is said."""
    robot, length = load_robot("planar2r"), 1.0
    coefficients = on_a_crank([5.0, 0.0])
    monkeypatch.setattr(tool_bound, "_HALVINGS", 0)
    t = np.linspace(0, length, 2001)
    velocity = tcp_twist(robot, np.outer(t, [5.0, 0.0]), np.tile([5.0, 0.0], (t.size, 1)))[:, :2]
    nodes = np.linspace(0, length, 9)
    rows = tcp_twist(robot, np.outer(nodes, [5.0, 0.0]), np.tile([5.0, 0.0], (9, 1)))[:, :2]
    beside = np.stack([np.polyval(np.polyfit(nodes, rows[:, k], 8), t) for k in range(2)], axis=1)
    apart = np.linalg.norm(beside - velocity, axis=1).max()
    (speed, *_) = tool_bounds(robot, np.array([0.0, length]), coefficients)
    largest = np.linalg.norm(beside, axis=1).max()
    assert apart <= speed.upper_bound - largest < 10 * apart


@pytest.mark.parametrize("name", few(["ur5e", "panda", "cobra600", "planar3r", "scorbot"], 3))
@pytest.mark.parametrize("degree", [5, 9])
def test_no_peak_hides_between_rows(name: str, degree: int) -> None:
    robot = load_robot(name)
    for _ in few(range(4), 2):
        lengths = RNG.uniform(0.05, 1.0, size=3)
        breaks = np.concatenate([[0.0], np.cumsum(lengths)])
        coefficients = RNG.normal(size=(degree + 1, 3, len(robot.joints))) * 0.8
        found = tool_bounds(robot, breaks, coefficients)
        for one, largest in zip(found, dense(robot, breaks, coefficients), strict=True):
            assert largest <= one.upper_bound
            assert one.upper_bound <= one.value * (1 + WITHIN) + 1e-9
            assert one.value <= largest * (1 + WITHIN) + 1e-9


def test_a_tool_that_rests_has_no_speed() -> None:
    robot = load_robot("ur5e")
    still = np.concatenate([np.zeros((5, 1, 6)), np.full((1, 1, 6), 0.3)])
    for breaks in ([1.0, 2.0], [1.0, 1.0]):
        for one in tool_bounds(robot, np.array(breaks), still):
            assert one.value == one.upper_bound == 0.0
