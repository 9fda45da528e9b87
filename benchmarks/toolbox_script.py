"""What a user of Robotics Toolbox writes today for the rows of `quintic.yaml`, unverified."""

import sys

import numpy as np
import roboticstoolbox as rtb

t = np.linspace(0, 10, 10001)
motion = rtb.jtraj(np.zeros(6), np.array([1, -1, 1.5, 0.5, -0.5, 2]), t)
rows = np.column_stack([t, motion.q, motion.qd, motion.qdd])
names = ["t", *(f"{kind}{joint}" for kind in ("q", "qd", "qdd") for joint in range(1, 7))]
np.savetxt(sys.stdout, rows, fmt="%.9f", delimiter=",", header=",".join(names), comments="")
