"""What a user of toppra writes today: through the rows of a CSV file as fast as limits allow, unverified."""

import sys

import numpy as np
from toppra import SplineInterpolator
from toppra.algorithm import TOPPRA
from toppra.constraint import DiscretizationType, JointAccelerationConstraint, JointVelocityConstraint

points = np.loadtxt(sys.argv[1], delimiter=",", skiprows=1)
s = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
bounds = np.tile([-1.0, 1.0], (6, 1))
limits = [
    JointVelocityConstraint(2 * bounds),
    JointAccelerationConstraint(5 * bounds, discretization_scheme=DiscretizationType.Interpolation),
]
path = SplineInterpolator(s, points, bc_type="not-a-knot")
grid = np.linspace(0, s[-1], 1001)
solver = TOPPRA(limits, path, gridpoints=grid, parametrizer="ParametrizeConstAccel")
motion = solver.compute_trajectory(0, 0)
t = np.append(np.arange(0, motion.duration, 0.001), motion.duration)
rows = np.column_stack([t, motion(t), motion(t, 1), motion(t, 2)])
names = ["t", *(f"{kind}{joint}" for kind in ("q", "qd", "qdd") for joint in range(1, 7))]
np.savetxt(sys.stdout, rows, fmt="%.9f", delimiter=",", header=",".join(names), comments="")
