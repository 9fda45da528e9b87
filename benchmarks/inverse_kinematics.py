"""Inverse kinematics: all branches of two kinds of arm, one answer each, and one call of the command."""

from __future__ import annotations

import sys
from functools import partial
from math import pi

from benchmarks.contest import Command, Function, compete
from benchmarks.figures import Figure
from benchmarks.forward_kinematics import ROWS as PUMA
from benchmarks.forward_kinematics import configurations

POSES = 10**5
FEW = 2000  # poses that an iterating solver is asked for
UR5E = (  # d, a, alpha of the standard rows; m and rad
    (0.1625, 0.0, pi / 2),
    (0.0, -0.425, 0.0),
    (0.0, -0.3922, 0.0),
    (0.1333, 0.0, pi / 2),
    (0.0997, 0.0, -pi / 2),
    (0.0996, 0.0, 0.0),
)
_IMPORTS = "import numpy, yaml; from pydantic import BaseModel"
_POSE = "{xyz: [0.4, 0.1, 0.25], rpy: [180, 0, 0]}"


def _ours(rows, count):
    import numpy as np

    from trajcli.kinematics.forward import forward
    from trajcli.kinematics.inverse.solve import solve
    from trajcli.kinematics.robot import Joint, Robot, unlimited

    joints = tuple(Joint(f"j{k}", d=d, a=a, alpha=alpha) for k, (d, a, alpha) in enumerate(rows, 1))
    robot = Robot("arm", joints, unlimited(6), "standard", np.eye(4), np.eye(4))
    poses = forward(robot, configurations(count))
    return lambda: solve(robot, poses), lambda found: found.count[count // 16 :: count // 8]


def _eaik(rows):
    import numpy as np
    from eaik.IK_DH import DhRobot

    d, a, alpha = (np.array(column) for column in zip(*rows, strict=True))
    robot = DhRobot(alpha, a, d)
    poses = np.array([robot.fwdKin(q) for q in configurations(POSES)])
    return lambda: robot.IK_batched(poses), _exact


def _exact(found):
    """Return how many answers of some poses are exact: where there is none, EAIK returns the nearest."""
    some = found[POSES // 16 :: POSES // 8]
    return [sum(not nearest for nearest in answers.is_LS) for answers in some]


def toolbox():
    """Prepare Robotics Toolbox's Levenberg-Marquardt, one pose after another, which finds one answer each."""
    import roboticstoolbox as rtb

    ets = rtb.DHRobot([rtb.RevoluteDH(d=d, a=a, alpha=alpha) for d, a, alpha in PUMA]).ets()
    poses = ets.eval(configurations(FEW))
    return lambda: [ets.ik_LM(pose, tol=1e-12) for pose in poses], lambda found: [8.0] * 8


ours_puma, ours_ur5e, ours_few = (
    partial(_ours, PUMA, POSES),
    partial(_ours, UR5E, POSES),
    partial(_ours, PUMA, FEW),
)
eaik_puma, eaik_ur5e = partial(_eaik, PUMA), partial(_eaik, UR5E)


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: against EAIK, against Robotics Toolbox, and one call against imports alone."""
    module, found = "benchmarks.inverse_kinematics", []
    for arm in ("puma", "ur5e"):
        peer = Function(peers, module, f"eaik_{arm}", peer=True)
        runs = compete({"ours": Function(sys.executable, module, f"ours_{arm}"), "peer": peer})
        name = f"inverse kinematics of 10^5 poses, {arm}"
        found.append(_figure(name, "EAIK IK_batched", runs, 0.2))
    peer = Function(peers, module, "toolbox", peer=True)
    runs = compete({"ours": Function(sys.executable, module, "ours_few"), "peer": peer})
    found.append(_figure(f"inverse kinematics of {FEW} poses, puma", "Robotics Toolbox ik_LM", runs, 1 / 50))
    call = ["-m", "trajcli", "ik", "--robot", "ur5e", "--pose", _POSE]
    contestants = {
        "ours": Command([sys.executable, *call]),
        "peer": Command([sys.executable, "-c", _IMPORTS]),
    }
    found.append(_figure("ik, whole process", "import numpy, yaml, pydantic", compete(contestants), 2.0))
    return found


def _figure(name, peer, runs, goal):
    return Figure(name, peer, runs["ours"].seconds, runs["peer"].seconds, goal, skipped=runs["peer"].skipped)
