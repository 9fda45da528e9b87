"""Writes the files of this folder as their producers do: toppra, ruckig, the Robotics Toolbox, own numbers.

The five points of a MoveIt goal are facts from UniversalRobots/Universal_Robots_ROS2_Driver, issue 1273, with
the four decimals of the report; its points are 0.1 s apart. Run it with the name of the part, in an environment
that has the library:

    python make_files.py toolbox | toppra | ruckig | own
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parent
WAYPOINTS = np.array(
    [[0.0, -1.2, 1.4, 0.0, 0.6, 0.0], [0.5, -0.9, 1.1, 0.3, 0.2, -0.4], [1.1, -1.1, 0.7, 0.1, 0.9, -0.8]]
)

UR_NAMES = [
    "shoulder_pan_joint",
    "shoulder_lift_joint",
    "elbow_joint",
    "wrist_1_joint",
    "wrist_2_joint",
    "wrist_3_joint",
]
UR_POINTS = [
    ("-0.5827, -0.9838, 1.6202, -2.1541, -1.4901, -3.6974",
     "0.0000, -0.0000, 0.0000, -0.0000, -0.0000, 0.0000",
     "0.0000, 0.0000, 0.0000, 0.0000, 0.0000, 0.0000"),
    ("-0.5761, -1.0009, 1.6452, -2.1632, -1.4907, -3.6906",
     "0.1366, -0.3434, 0.4999, -0.1793, -0.0110, 0.1393",
     "1.4946, -3.5218, 4.9993, -1.7165, -0.1151, 1.5221"),
    ("-0.5540, -1.0535, 1.7201, -2.1891, -1.4924, -3.6681",
     "0.3165, -0.7159, 0.9997, -0.3331, -0.0237, 0.3221",
     "2.2328, -4.0092, 4.9995, -1.2883, -0.1450, 2.2650"),
    ("-0.5087, -1.1467, 1.8451, -2.2274, -1.4956, -3.6220",
     "0.6240, -1.1675, 1.4967, -0.4141, -0.0415, 0.6332",
     "4.1831, -5.0001, 4.6394, -0.0610, -0.2166, 4.2241"),
    ("-0.4225, -1.2854, 2.0098, -2.2640, -1.5008, -3.5348",
     "1.0987, -1.5267, 1.6638, -0.2576, -0.0621, 1.1110",
     "2.8090, 1.4260, -4.9968, 3.5676, -0.0593, 2.7999"),
]  # fmt: skip


def header(*kinds: str, joints: int = 6) -> str:
    """Return the names of columns, numbered from 1."""
    return ",".join(["t", *(f"{kind}{joint + 1}" for kind in kinds for joint in range(joints))])


def save(name: str, rows: np.ndarray, form: str, names: str) -> None:
    """Write rows as numpy.savetxt does."""
    np.savetxt(FOLDER / name, rows, form, ",", header=names, comments="")


def toolbox() -> None:
    """Robotics Toolbox for Python: quintic point to point, and segments with parabolic blends."""
    import roboticstoolbox as rtb

    t = np.arange(0, 2.0001, 0.02)
    motion = rtb.jtraj(WAYPOINTS[0], WAYPOINTS[1], t)
    save(
        "jtraj.csv", np.column_stack([t, motion.q, motion.qd, motion.qdd]), "%.18e", header("q", "qd", "qdd")
    )
    via = rtb.mstraj(WAYPOINTS, dt=0.02, tacc=0.2, qdmax=1.0)
    # its stamps are what its own plots show: multiples of dt
    save("mstraj.csv", np.column_stack([via.t, via.q]), "%.18e", header("q"))


def toppra_default() -> None:
    """toppra: a cubic spline through points, with its default gridpoints and parametrization."""
    import toppra
    from toppra import algorithm, constraint

    toppra.setup_logging("ERROR")
    path = toppra.SplineInterpolator(np.linspace(0, 1, len(WAYPOINTS)), WAYPOINTS)
    limits = [
        constraint.JointVelocityConstraint(np.full((6, 1), 1.0) * [-1, 1]),
        constraint.JointAccelerationConstraint(np.full((6, 1), 4.0) * [-1, 1]),
    ]
    motion = algorithm.TOPPRA(limits, path).compute_trajectory(0, 0)
    t = np.arange(0, motion.duration, 0.01)
    rows = np.column_stack([t, motion(t), motion(t, 1), motion(t, 2)])
    save("toppra.csv", rows, "%.18e", header("q", "qd", "qdd"))


def ruckig_default() -> None:
    """ruckig: point to point, sampled each 4 ms and at the end."""
    import ruckig

    given = ruckig.InputParameter(6)
    given.current_position, given.target_position = WAYPOINTS[0].tolist(), WAYPOINTS[2].tolist()
    given.max_velocity, given.max_acceleration, given.max_jerk = [1.0] * 6, [4.0] * 6, [20.0] * 6
    motion = ruckig.Trajectory(6)
    ruckig.Ruckig(6).calculate(given, motion)
    rows = []
    for t in [*np.arange(0, motion.duration, 0.004), motion.duration]:
        position, velocity, acceleration = motion.at_time(t)
        rows.append([t, *position, *velocity, *acceleration])
    save("ruckig.csv", np.array(rows), "%.9f", header("q", "qd", "qdd"))


def own() -> None:
    """Numbers of our own in the forms of others: 24 Hz in degrees, a chunk in single precision, a goal in YAML."""
    k = np.arange(49)
    s = k / 48
    blend = 10 * s**3 - 15 * s**4 + 6 * s**5
    axes = np.array([0.0, 20.0, -35.0, 10.0, 45.0, 0.0]) + blend[:, None] * [
        60.0,
        -30.0,
        25.0,
        80.0,
        -50.0,
        113.0,
    ]
    lines = ["Time, Axis 1, Axis 2, Axis 3, Axis 4, Axis 5, Axis 6"]
    lines += [
        f"{n / 24:.6f}, " + ", ".join(f"{value:.4f}" for value in row) for n, row in zip(k, axes, strict=True)
    ]
    (FOLDER / "degrees_24hz.csv").write_text("\n".join(lines) + "\n")
    k = np.arange(50)
    s = k / 49
    blend = 10 * s**3 - 15 * s**4 + 6 * s**5
    chunk = np.array([0.1, -0.4, 0.2, -1.9, 0.3, 1.6, 0.8]) + blend[:, None] * [
        0.4,
        0.3,
        -0.2,
        0.5,
        0.1,
        -0.3,
        0.6,
    ]
    np.save(FOLDER / "chunk_float32.npy", np.column_stack([k / 50, chunk]).astype(np.float32))
    points = "".join(
        f"- positions: [{q}]\n  velocities: [{qd}]\n  accelerations: [{qdd}]\n"
        f"  time_from_start: {{sec: 0, nanosec: {index * 100_000_000}}}\n"
        for index, (q, qd, qdd) in enumerate(UR_POINTS)
    )
    names = ", ".join(UR_NAMES)
    (FOLDER / "ur_goal.yaml").write_text(f"joint_names: [{names}]\npoints:\n{points}")


if __name__ == "__main__":
    {"toolbox": toolbox, "toppra": toppra_default, "ruckig": ruckig_default, "own": own}[sys.argv[1]]()
