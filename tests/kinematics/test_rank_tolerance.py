"""Where an arm loses a direction: nearly singular arms whose singular values are known in closed form."""

from __future__ import annotations

from math import inf, tan

import numpy as np
import oracle_robots as oracle
import pytest

from trajcli.kinematics.dexterity import dexterity, singular_directions
from trajcli.kinematics.inverse.families.choose import method_for
from trajcli.kinematics.jacobian import jacobian


def slides(angle):
    """Two slides at an angle: of their unit directions the Gram matrix has the eigenvalues 1 + cos and 1 - cos."""
    rows = [{"type": "P", "theta": 0.0, "d": 0.0, "a": 0.0, "alpha": alpha} for alpha in (angle, 0.0)]
    return oracle.robot_of({"dh": rows, "convention": "std"})


def wrist(angle):
    """Three axes through a point, the first and the last at an angle: 1 is the third singular value."""
    angles = (np.pi / 2, -np.pi / 2, 0.0)
    rows = [{"type": "R", "theta": 0.0, "d": 0.0, "a": 0.0, "alpha": alpha} for alpha in angles]
    return oracle.robot_of({"dh": rows, "convention": "std"}), [0.3, angle, -0.8]


@pytest.mark.parametrize("ratio", [1e-3, 1e-6, 3e-9, 1.2e-9, 0.8e-9, 3e-10, 1e-14])
@pytest.mark.parametrize("arm", ["slides", "wrist"])
def test_a_direction_counts_from_a_billionth_of_the_largest_on(arm, ratio):
    """sqrt(1 - cos) / sqrt(1 + cos) is the tangent of half the angle."""
    angle = 2 * np.arctan(ratio)
    robot, q = (slides(angle), [0.1, 0.2]) if arm == "slides" else wrist(angle)
    there = ratio > 1e-9
    found, lost = dexterity(robot, q), singular_directions(robot, q)
    assert found.rank == len(q) - (not there)
    assert found.condition == pytest.approx(1 / tan(angle / 2), rel=1e-5) if there else found.condition == inf
    assert lost.idle.shape == (0 if there else 1, len(q))
    for idle in lost.idle:
        assert np.linalg.norm(jacobian(robot, q) @ idle) <= 1.5e-9


@pytest.mark.parametrize(("second", "closed"), [(0.2, True), (3e-7, True), (3e-9, True), (0.0, False)])
def test_a_short_link_is_a_link(second, closed):
    """The tip of two links goes along the second one's circle, however small: both joints count."""
    rows = [{"type": "R", "theta": 0.0, "d": 0.0, "a": a, "alpha": 0.0} for a in (0.3, second)]
    robot = oracle.robot_of({"dh": rows, "convention": "std"})
    assert (method_for(robot).solve is not None) == closed


@pytest.mark.parametrize(("behind", "closed"), [(-0.3, False), (-0.3 + 3e-7, True)])
def test_a_tip_that_rounding_keeps_off_an_axis_is_on_it(behind, closed):
    """0.1 + 0.2 is 0.3 but for rounding: the second joint does not move the tip, and its row is no zero."""
    rows = [{"type": "R", "theta": 0.0, "d": 0.0, "a": a, "alpha": 0.0} for a in (0.3, 0.1 + 0.2)]
    tool = np.eye(4)
    tool[0, 3] = behind
    robot = oracle.robot_of({"dh": rows, "convention": "std", "tool": tool})
    assert np.abs(jacobian(robot, [0.3, 0.4])[:3, 1]).max() > 0.0
    assert (method_for(robot).solve is not None) == closed
