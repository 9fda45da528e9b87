"""Inverse kinematics: all branches of two kinds of arm, one answer each, and one call of the command."""

from __future__ import annotations

import json
import subprocess
import sys
from functools import partial
from math import pi
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.contest import Command, Function, compete
from benchmarks.figures import Figure
from benchmarks.forward_kinematics import ROWS as PUMA
from benchmarks.forward_kinematics import configurations

POSES = 10**5
ARMS_OF_SEVEN = 1000  # poses of an arm with seven joints
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


def _panda_poses(count):
    """Return poses (count, 4, 4) of a Panda's flange at joints (count, 7) within its limits."""
    import numpy as np

    from trajcli.job.robot import load_robot
    from trajcli.kinematics.forward import forward

    robot = load_robot("panda")
    low, high = robot.limits.position.T
    return robot, forward(robot, np.random.default_rng(1).uniform(low, high, (count, 7)))


def panda_together():
    """Prepare our solution of redundant poses, all of them at once."""
    from trajcli.kinematics.inverse.solve import solve

    robot, poses = _panda_poses(ARMS_OF_SEVEN)
    return lambda: solve(robot, poses), lambda found: found.within_limits.any(axis=1)[::100]


def panda_alone():
    """Prepare our solution of redundant poses, one after another."""
    from trajcli.kinematics.inverse.solve import solve

    robot, poses = _panda_poses(ARMS_OF_SEVEN // 10)
    return lambda: [solve(robot, pose) for pose in poses], lambda found: [
        bool(answers.within_limits.any()) for answers in found[::10]
    ]


def toolbox_panda(count):
    """Prepare Robotics Toolbox's Levenberg-Marquardt for a Panda, one answer each within the limits."""
    import numpy as np
    import roboticstoolbox as rtb

    robot = rtb.models.DH.Panda()
    ets = robot.ets()
    low, high = robot.qlim
    poses = ets.eval(np.random.default_rng(1).uniform(low, high, (count, 7)))
    return lambda: [ets.ik_LM(pose, tol=1e-12) for pose in poses], lambda found: [1.0] * 10


ours_puma, ours_ur5e, ours_few = (
    partial(_ours, PUMA, POSES),
    partial(_ours, UR5E, POSES),
    partial(_ours, PUMA, FEW),
)
eaik_puma, eaik_ur5e = partial(_eaik, PUMA), partial(_eaik, UR5E)

toolbox_panda_together = partial(toolbox_panda, ARMS_OF_SEVEN)
toolbox_panda_alone = partial(toolbox_panda, ARMS_OF_SEVEN // 10)


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: against EAIK, against Robotics Toolbox, and one call against imports alone."""
    module, found = "benchmarks.inverse_kinematics", []
    for arm in ("puma", "ur5e"):
        peer = Function(peers, module, f"eaik_{arm}", peer=True)
        runs = compete({"ours": Function(sys.executable, module, f"ours_{arm}"), "peer": peer})
        name = f"inverse kinematics of 10^5 poses, {arm}"
        found.append(_figure(name, "EAIK IK_batched", runs, 0.15))
    peer = Function(peers, module, "toolbox", peer=True)
    runs = compete({"ours": Function(sys.executable, module, "ours_few"), "peer": peer})
    found.append(_figure(f"inverse kinematics of {FEW} poses, puma", "Robotics Toolbox ik_LM", runs, 0.015))
    for kind, count, goal in (("alone", ARMS_OF_SEVEN // 10, 5.0), ("together", ARMS_OF_SEVEN, 2.0)):
        peer = Function(peers, module, f"toolbox_panda_{kind}", peer=True)
        runs = compete({"ours": Function(sys.executable, module, f"panda_{kind}"), "peer": peer})
        found.append(_figure(f"{count} poses of a Panda, {kind}", "Robotics Toolbox ik_LM", runs, goal))
    call = ["-m", "trajcli", "ik", "--robot", "ur5e", "--pose", _POSE]
    contestants = {
        "ours": Command([sys.executable, *call]),
        "peer": Command([sys.executable, "-c", _IMPORTS]),
    }
    found.append(_figure("ik, whole process", "import numpy, yaml, pydantic", compete(contestants), 2.0))
    return [*found, _of_a_stream()]


def _of_a_stream() -> Figure:
    """Return the figure of `ik -`: time of a pose at random beyond the first, written as CSV."""
    with TemporaryDirectory() as folder:
        files = {count: Path(folder, f"{count}.csv") for count in (1, POSES)}
        rows = (",".join(f"{value:.12f}" for value in pose) for pose in _poses_of("ur5e", POSES))
        text = ["x,y,z,qw,qx,qy,qz\n", *(f"{row}\n" for row in rows)]
        for count, file in files.items():
            file.write_text("".join(text[: count + 1]), encoding="utf-8")
        call = f"exec '{sys.executable}' -m trajcli ik - --robot ur5e < "
        runs = compete(
            {str(count): Command(["sh", "-c", f"{call}'{file}'"]) for count, file in files.items()}
        )
    one, all_of_them = (runs[str(count)].seconds for count in files)
    each = [(many - few) / (POSES - 1) for many, few in zip(all_of_them, one, strict=True)]
    return Figure("ik -, each pose of a UR5e", "seconds", each, [], 1e-5, kind="seconds")


def _poses_of(name: str, count: int) -> list[list[float]]:
    """Return positions and quaternions at random configurations, made in a process of its own."""
    script = (
        "import json, sys, numpy as np\n"
        "from trajcli.geometry.rotation import quaternion_from_matrix\n"
        "from trajcli.job.robot import load_robot\n"
        "from trajcli.kinematics.forward import forward\n"
        "name, count = sys.argv[1], int(sys.argv[2])\n"
        "q = np.random.default_rng(1).uniform(-3, 3, (count, 6))\n"
        "poses = forward(load_robot(name), q)\n"
        "rows = np.concatenate([poses[:, :3, 3], quaternion_from_matrix(poses[:, :3, :3])], axis=1)\n"
        "json.dump(rows.tolist(), sys.stdout)\n"
    )
    done = subprocess.run([sys.executable, "-c", script, name, str(count)], capture_output=True, check=True)
    found: list[list[float]] = json.loads(done.stdout)
    return found


def _figure(name, peer, runs, goal):
    return Figure(name, peer, runs["ours"].seconds, runs["peer"].seconds, goal, skipped=runs["peer"].skipped)
