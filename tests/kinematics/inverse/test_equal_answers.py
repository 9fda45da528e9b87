"""One answer for each family and for each root: at singular poses, double roots and wide tolerances."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward
from trajcli.kinematics.inverse.solve import solve
from trajcli.kinematics.jacobian import jacobian
from trajcli.kinematics.robot import Joint, Robot, unlimited

H = np.pi / 2
GENERAL = [(0.3, 0.1, -1.0), (0.1, 0.4, 0.3), (0.05, 0.2, H), (0.4, 0, -H), (0, 0, H), (0.1, 0, 0)]
XARM = [(0.267, 0, -H), (0, 0.2895, 0), (0, 0.0775, -H), (0.3425, 0, H), (0, 0.076, -H), (0.097, 0, 0)]


def chain(rows):
    """Return an arm of DH rows (d, a, alpha), without limits; no closed form fits these."""
    joints = tuple(Joint(f"j{k + 1}", d=d, a=a, alpha=alpha) for k, (d, a, alpha) in enumerate(rows))
    return Robot("arm", joints, unlimited(len(joints)), "standard", np.eye(4), np.eye(4))


def apart(a, b):
    return float(np.abs((a - b + np.pi) % (2 * np.pi) - np.pi).max())


def nearest_pair(joints):
    """Return the smallest distance between two of the answers (k, n)."""
    return min(apart(a, b) for i, a in enumerate(joints) for b in joints[:i])


@pytest.mark.parametrize("near", [None, [0.3, -0.5, 0.7, 0.4, 0.0, 0.2]])
@pytest.mark.parametrize("tolerance", [1e-9, 1e-6, 1e-3])
def test_numeric_solver_lists_a_family_once_and_loses_no_other_answer(near, tolerance):
    """With axes 4 and 6 in line their sum alone counts; 1e-4 rad beside that there are two more postures."""
    arm, q = chain(GENERAL), np.array([0.3, -0.5, 0.7, 0.4, 0.0, 0.2])
    found = solve(arm, forward(arm, q), near, tolerance)
    joints, singular = found.joints[found.valid], found.singular[found.valid]
    assert singular.sum() == 1
    family = joints[singular][0]
    np.testing.assert_allclose(
        [*family[:3], family[3] + family[5], family[4]], [0.3, -0.5, 0.7, 0.6, 0], atol=1e-6
    )
    assert found.free[found.valid][singular].tolist() == [[False, False, False, True, False, True]]
    if near is not None:
        np.testing.assert_allclose(family, near, atol=1e-6)
    beside = solve(arm, forward(arm, q + np.array([0, 0, 0, 0, 1e-4, 0])))
    assert int(beside.valid.sum()) == 4  # the wrist flips in either posture
    assert len(joints) == 3  # which the aligned wrist does within its family


@pytest.mark.parametrize("tolerance", [1e-9, 1e-3])
@pytest.mark.parametrize("bracket", [(-1.5, -1.2), (1.2, 1.4), (1.6, 2.0)])
def test_a_double_root_is_one_answer(bracket, tolerance):
    """Where the determinant of the Jacobian vanishes two answers have met."""
    from scipy.optimize import brentq

    arm, q = chain(XARM), np.array([0.3, -0.5, 0.0, 0.4, 0.8, 0.2])

    def at(value):
        return np.where(np.arange(6) == 2, value, q)

    root = at(brentq(lambda value: float(np.linalg.det(jacobian(arm, at(value)))), *bracket, xtol=1e-15))
    found = solve(arm, forward(arm, root), None, tolerance)
    joints = found.joints[found.valid]
    assert min(apart(row, root) for row in joints) < 1e-4
    assert nearest_pair(joints) > 1e-4


@pytest.mark.parametrize("beyond", [1e-5, 1e-4])
def test_closed_form_gives_equal_answers_once_at_a_wide_tolerance(beyond):
    """A UR that cannot quite reach has its elbow stretched on both branches."""
    arm = load_robot("ur5e")
    pose = forward(arm, np.array([0.3, -0.5, 0.0, 0.4, 0.8, 0.2]))
    outwards = pose[:3, 3] - [0, 0, 0.16]
    pose[:3, 3] += beyond * outwards / np.linalg.norm(outwards)
    exact, wide = solve(arm, pose, None, 1e-9), solve(arm, pose, None, 1e-3)
    assert wide.valid.sum() > exact.valid.sum()
    assert nearest_pair(wide.joints[wide.valid]) > 1e-4
