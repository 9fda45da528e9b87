"""What a user of scipy writes today: a smooth curve through the rows of a CSV file, unverified."""

import sys

import numpy as np
from scipy.interpolate import CubicSpline

points = np.loadtxt(sys.argv[1], delimiter=",", skiprows=1)
spline = CubicSpline(points[:, 0], points[:, 1:], bc_type="clamped")
t = np.arange(round(points[-1, 0] * 100) + 1) / 100
rows = np.column_stack([t, spline(t), spline(t, 1), spline(t, 2)])
names = ["t", *(f"{kind}{joint}" for kind in ("q", "qd", "qdd") for joint in range(1, 7))]
np.savetxt(sys.stdout, rows, fmt="%.9f", delimiter=",", header=",".join(names), comments="")
