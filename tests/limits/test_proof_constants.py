"""Remainders of the tool's bound against motions whose true peak is where nine rows cannot see it.

Between nine equidistant rows a polynomial of degree 9 may be beside the one of degree 8 through these rows by the
product of the distances from them, and by no more: a motion of just that kind shows its rows a constant, and peaks
between the first two of them.
"""

from __future__ import annotations

from dataclasses import replace
from math import factorial

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from trajcli.job.robot import load_robot
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.limits import tool_bound
from trajcli.limits.tool_bound import tool_bounds

NODES = np.linspace(0.0, 1.0, 9)
HIDDEN = 1e-7  # of what the rows show: as little is not worth halving the piece
SPEED, ANGULAR_SPEED, ACCELERATION, ANGULAR_ACCELERATION = range(4)


def hidden_peak() -> tuple[np.ndarray, float]:
    """Return a polynomial that is 1 at all nodes, highest power first, and its largest value between them."""
    product = np.poly(NODES)
    largest = minimize_scalar(lambda x: -np.polyval(product, x), bounds=(0.0, NODES[1]), method="bounded")
    product *= HIDDEN / -largest.fun
    product[-1] += 1.0
    return product, 1.0 + HIDDEN


@pytest.mark.parametrize(
    ("quantity", "name", "order"),
    [
        (SPEED, "cartesian", 1),
        (ANGULAR_SPEED, "planar2r", 1),
        (ACCELERATION, "cartesian", 2),
        (ANGULAR_ACCELERATION, "planar2r", 2),
    ],
)
@pytest.mark.parametrize(("size", "length"), [(1.0, 1.0), (40.0, 0.05), (0.1, 7.0)])
def test_a_peak_that_no_row_shows_is_within_the_bound(quantity, name, order, size, length, monkeypatch):
    """One joint alone moves the tool, which has its speed and its acceleration: what is true is known.

    The tool is on the axis of the joint if it turns. A steady speed on top leaves the acceleration as it is, and makes
    the speed well enough known: the piece is not halved, and the bound is what the rows show plus the remainder.
    """
    shown, peak = hidden_peak()
    joint = shown * size * length**order
    for _ in range(order):
        joint = np.polyint(joint)
    if order == 2:
        joint[-2] += 100 * size * length**2
    robot = load_robot(name)
    robot = replace(robot, joints=tuple(replace(one, a=0.0) for one in robot.joints))
    coefficients = np.zeros((joint.size, 1, len(robot.joints)))
    coefficients[:, 0, 0] = joint / length ** np.arange(joint.size - 1, -1, -1)
    t = np.linspace(0.0, length, 20_001)
    true = np.abs(np.polyval(np.polyder(coefficients[:, 0, 0], order), t)).max()
    assert true == pytest.approx(size * peak, rel=1e-11)
    found = tool_bounds(robot, np.array([0.0, length]), coefficients)[quantity]
    assert found.value <= true * (1 + 1e-12)
    assert found.upper_bound >= true * (1 - 1e-12)
    assert found.upper_bound - size >= (1 - 1e-6) * (true - size)
    monkeypatch.setattr(tool_bound, "_HALVINGS", 0)  # which would hide that a remainder is too large
    found = tool_bounds(robot, np.array([0.0, length]), coefficients)[quantity]
    # Isaacson and Keller bound the product by 8!/4 (h/8)^9, about twice what it is; of degree 9 the ninth derivative
    # is the same everywhere
    remainder = size * abs(shown[0]) * factorial(8) / 4 / 8**9
    assert found.upper_bound - size == pytest.approx(remainder, rel=1e-5)


def test_a_peak_that_no_row_shows_counts_by_how_far_a_slide_stands_out():
    """A tool on a slide that stands 5 m out goes 5 m around the first joint for each radian of it."""
    joints = Joint("turn", alpha=np.pi / 2), Joint("slide", "prismatic")
    robot = Robot("polar", joints, unlimited(2), "standard", np.eye(4), np.eye(4))
    shown, peak = hidden_peak()
    turn = np.polyint(shown)
    coefficients = np.zeros((turn.size, 1, 2))
    coefficients[:, 0, 0], coefficients[-1, 0, 1] = turn, 5.0
    speed = tool_bounds(robot, np.array([0.0, 1.0]), coefficients)[SPEED]
    assert speed.value == pytest.approx(5.0)
    assert speed.upper_bound - 5.0 >= 5.0 * (peak - 1.0) * (1 - 1e-6)


@pytest.mark.parametrize("size", [1e-3, 2e-3])
def test_a_slow_tool_is_known_as_well(size):
    """From a millimetre a second on a bound is a millionth above what is found: where rows hide more, pieces are halved."""
    shown, _ = hidden_peak()
    joint = np.polyint((shown - np.eye(1, shown.size, shown.size - 1)[0]) * 10 * size)
    joint[-2] += size
    robot = load_robot("cartesian")
    coefficients = np.zeros((joint.size, 1, 3))
    coefficients[:, 0, 0] = joint
    true = np.polyval(np.polyder(joint), np.linspace(0.0, 1.0, 20_001)).max()
    assert true == pytest.approx(size * (1 + 10 * HIDDEN), rel=1e-9)
    found = tool_bounds(robot, np.array([0.0, 1.0]), coefficients)[SPEED]
    assert found.upper_bound >= true * (1 - 1e-12)
    assert found.upper_bound <= found.value * (1 + 1e-6)


def test_a_tool_that_turns_fast_is_not_known_worse_for_where_it_is():
    """A slide in front of a wrist that turns at 1000 rad/s: of the speed as much is known as without it."""
    shown, peak = hidden_peak()
    joint = np.polyint(shown + 19 * (shown - np.eye(1, shown.size, shown.size - 1)[0]))
    joints = Joint("slide", "prismatic"), Joint("turn")
    robot = Robot("drill", joints, unlimited(2), "standard", np.eye(4), np.eye(4))
    coefficients = np.zeros((joint.size, 1, 2))
    coefficients[:, 0, 0], coefficients[-2, 0, 1] = joint, 1000.0
    found = tool_bounds(robot, np.array([0.0, 1.0]), coefficients)
    true = 1.0 + 20 * (peak - 1.0)
    assert true * (1 - 1e-9) <= found[SPEED].upper_bound <= true * (1 + 5e-7)
    assert found[ANGULAR_SPEED].upper_bound == pytest.approx(1000.0, rel=1e-6)


def test_many_equal_peaks_are_all_known_well():
    """Eight thousand equal steps, each of which is fastest in its middle: 3 / 2 of its mean speed."""
    count, duration, step = 8000, 0.01, 0.002
    coefficients = np.zeros((4, count, 3))
    coefficients[:, :, 0] = np.array([-2 * step / duration**3, 3 * step / duration**2, 0.0, 0.0])[:, None]
    coefficients[-1, :, 0] = step * np.arange(count)
    found = tool_bounds(load_robot("cartesian"), duration * np.arange(count + 1), coefficients)[SPEED]
    true = 1.5 * step / duration
    assert true * (1 - 1e-9) <= found.upper_bound <= true * (1 + 1e-6)
