"""Forward kinematics of a Puma 560 at a million configurations."""

from __future__ import annotations

import sys
from math import pi

from benchmarks.contest import Function, compete
from benchmarks.figures import Figure

CONFIGURATIONS = 10**6
ROWS = (  # d, a, alpha of the standard rows; m and rad
    (0.6718, 0.0, pi / 2),
    (0.0, 0.4318, 0.0),
    (0.15005, 0.0203, -pi / 2),
    (0.4318, 0.0, pi / 2),
    (0.0, 0.0, -pi / 2),
    (0.0, 0.0, 0.0),
)


def ours():
    """Prepare our poses of the tool."""
    import numpy as np

    from trajcli.kinematics.forward import forward
    from trajcli.kinematics.robot import Joint, Robot, unlimited

    joints = tuple(Joint(f"j{k}", d=d, a=a, alpha=alpha) for k, (d, a, alpha) in enumerate(ROWS, 1))
    robot = Robot("puma560", joints, unlimited(6), "standard", np.eye(4), np.eye(4))
    q = configurations()
    return lambda: forward(robot, q), _some


def toolbox():
    """Prepare Robotics Toolbox's elementary transforms, whose evaluation is written in C."""
    import roboticstoolbox as rtb

    ets = rtb.DHRobot([rtb.RevoluteDH(d=d, a=a, alpha=alpha) for d, a, alpha in ROWS]).ets()
    q = configurations()
    return lambda: ets.eval(q), _some


def compiled():
    """Prepare the same with constant transforms multiplied beforehand."""
    import roboticstoolbox as rtb

    ets = rtb.DHRobot([rtb.RevoluteDH(d=d, a=a, alpha=alpha) for d, a, alpha in ROWS]).ets().compile()
    q = configurations()
    return lambda: ets.eval(q), _some


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: against Robotics Toolbox's transforms, as they come and compiled."""
    module = "benchmarks.forward_kinematics"
    runs = compete(
        {
            "ours": Function(sys.executable, module, "ours"),
            "toolbox": Function(peers, module, "toolbox", peer=True),
            "compiled": Function(peers, module, "compiled", peer=True),
        }
    )
    name, seconds = "forward kinematics, 10^6 x 6", runs["ours"].seconds
    names = {"toolbox": "Robotics Toolbox ets.eval", "compiled": "the same, ets.compile() before"}
    return [
        Figure(name, text, seconds, runs[key].seconds, 0.4, skipped=runs[key].skipped)
        for key, text in names.items()
    ]


def configurations(count=CONFIGURATIONS):
    """Return joint values, shape (count, 6), rad, spread over the whole range."""
    import numpy as np

    steps = np.sqrt(np.array([2, 3, 5, 7, 11, 13]))
    return (np.arange(count)[:, None] * steps) % (2 * np.pi) - np.pi


def _some(poses):
    return poses[:: CONFIGURATIONS // 4].reshape(-1)
