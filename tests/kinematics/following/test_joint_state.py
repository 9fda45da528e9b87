"""The acceleration that joint velocities alone make, against differences of the Jacobian."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.job.robot import load_robot
from trajcli.kinematics.jacobian import acceleration_bias, jacobian


@pytest.mark.parametrize("name", ["puma560", "panda", "cobra600", "rrp", "cartesian_wrist", "planar3r"])
def test_it_is_the_change_of_the_columns_along_the_motion(name):
    robot, rng, step = load_robot(name), np.random.default_rng(5), 1e-5
    q, rates = rng.uniform(-1, 1, (2, 20, len(robot.joints)))
    behind, ahead = (jacobian(robot, q + sign * step * rates) for sign in (-1, 1))
    change = (ahead - behind) / (2 * step)
    expected = (change @ rates[..., None])[..., 0]
    np.testing.assert_allclose(acceleration_bias(jacobian(robot, q), rates), expected, rtol=0, atol=1e-8)
