"""What a user of Robotics Toolbox writes today for the rows of `line.yaml`, unverified."""

import sys

import numpy as np
import roboticstoolbox as rtb
from spatialmath import SE3

robot = rtb.models.DH.Puma560()
ets, q0 = robot.ets(), np.array([-0.5, 0.6, -0.5, -0.2, -0.6, -0.4])
t = np.linspace(0, 10, 10001)
start = robot.fkine(q0)
goal = SE3.Rt(start.R, start.t + np.array([0.3, 0.4, 0.0]))
poses = rtb.ctraj(start, goal, rtb.quintic(0, 1, t).q)
q, last = np.empty((t.size, 6)), q0
for k, pose in enumerate(poses):
    last = ets.ik_LM(pose.A, q0=last, tol=1e-12)[0]
    q[k] = last
qd = np.gradient(q, t, axis=0)
rows = np.column_stack([t, q, qd, np.gradient(qd, t, axis=0)])
names = ["t", *(f"{kind}{joint}" for kind in ("q", "qd", "qdd") for joint in range(1, 7))]
np.savetxt(sys.stdout, rows, fmt="%.9f", delimiter=",", header=",".join(names), comments="")
