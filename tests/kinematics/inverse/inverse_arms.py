"""One arm of each closed-form family, and what must be true of it. Lengths are arbitrary."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy.spatial.transform import Rotation

from trajcli.kinematics.inverse.numeric import distinct, search
from trajcli.kinematics.inverse.target import pose_target
from trajcli.kinematics.robot import Joint, Robot, unlimited

H = np.pi / 2
WRIST = ["R 0 0 0 -1", "R 0 0 0 1", "R 0 .1 0 0"]
# rows: type, theta, d, a, alpha in quarter turns; then the most branches and the family
FAMILIES = {
    "planar 2R": (["R 0 0 .4 0", "R .3 0 .3 0"], 2, "planar 2R"),
    "planar 3R": (["R 0 0 .4 0", "R .3 0 .3 2", "R 0 .1 .2 0"], 2, "planar 3R"),
    "planar RP": (["R .2 0 0 1", "P 0 0 .1 0"], 2, "planar RP"),
    "planar RPR": (["R 0 0 0 1", "P 0 0 0 -1", "R 0 0 .2 0"], 2, "planar RPR"),
    "SCARA": (["R 0 .4 .3 0", "R 0 0 .25 2", "P 0 0 0 0", "R .5 .05 0 0"], 2, "SCARA"),
    "SCARA, slide first": (["P 0 .4 0 0", "R 0 0 .3 0", "R 0 0 .25 0", "R .5 .05 .1 0"], 2, "SCARA"),
    "elbow": (["R 0 .5 0 1", "R 0 0 .3 0", "R 0 0 .25 0"], 4, "positioning"),
    "elbow with offsets": (["R .2 .5 .1 1", "R 0 -.15 .3 0", "R 0 .02 .25 .3"], 4, "positioning"),
    "elbow on a slanted axis": (["R .2 .5 .1 .6", "R 0 -.1 .4 0", "R 0 .02 .35 .3"], 4, "positioning"),
    "elbow read backwards": (["R 0 .1 .3 0", "R 0 .1 .05 -1", "R 0 0 .4 0"], 4, "positioning"),
    "two axes that meet": (["R 0 .3 0 1", "R 0 .2 0 -.7", "R 0 .3 .4 0"], 4, "positioning"),
    "RRP Stanford": (["R 0 .4 .05 -1", "R 0 .15 0 1", "P 0 .2 .1 0"], 4, "positioning"),
    "RRP SCARA": (["R 0 .4 .3 0", "R 0 0 .25 2", "P 0 0 0 0"], 2, "positioning"),
    "RPP cylindrical": (["R 0 .2 0 0", "P 0 .3 .1 -1", "P 0 .1 0 0"], 2, "positioning"),
    "PRP": (["P 0 .2 0 0", "R 0 .3 .1 -1", "P 0 .1 0 0"], 2, "positioning"),
    "PPP": (["P 0 0 0 -1", "P -1 0 0 -1", "P 0 0 .1 0"], 1, "positioning"),
    "PPP askew": (["P 0 0 0 -1", "P -.7 0 0 -.8", "P 0 0 .1 0"], 1, "positioning"),
    "elbow and pitch": (
        ["R 0 .3 .1 1", "R 0 .05 .3 0", "R 0 0 .25 2", "R .4 .02 .1 0"],
        4,
        "elbow and pitch",
    ),
    "elbow, pitch and roll": (
        ["R 0 .3 .1 1", "R 0 .05 .3 0", "R 0 0 .25 2", "R 1 .02 .03 1", "R 0 .15 .04 .3"],
        4,
        "elbow, pitch and roll",
    ),
    "UR": (
        ["R 0 .16 0 1", "R 0 0 -.42 0", "R 0 0 -.39 0", "R 0 .13 0 1", "R 0 .1 0 -1", "R 0 .1 0 0"],
        8,
        "three parallel axes (UR)",
    ),
    "UR askew": (
        [
            "R 0 .16 .05 .9",
            "R 0 0 -.42 0",
            "R 0 0 -.39 2",
            "R 0 .13 .04 .8",
            "R 0 .1 0 -1.1",
            "R 0 .1 .02 .4",
        ],
        8,
        "three parallel axes (UR)",
    ),
    "wrist over elbow": (
        ["R 0 .4 .1 1", "R 0 .05 .4 0", "R 0 .02 .05 1", "R 0 .4 0 -1", "R 0 0 0 1", "R 0 .1 .02 0"],
        8,
        "spherical wrist",
    ),
    "slanted wrist over elbow": (
        ["R 0 .4 .1 -1", "R 0 .05 .4 0", "R 0 .02 .05 1", "R 0 .4 0 -.8", "R 0 0 0 .9", "R 0 .1 .02 0"],
        8,
        "spherical wrist",
    ),
    "wrist over two axes that meet": (
        ["R 0 .4 0 -1", "R 0 .1 0 .9", "R 0 .4 .4 1", *WRIST],
        8,
        "spherical wrist",
    ),
    "wrist over Stanford": (["R 0 .4 0 -1", "R 0 .154 0 1", "P -1 .2 .02 0", *WRIST], 8, "spherical wrist"),
    "wrist over cylindrical": (["R 0 .2 0 0", "P 0 .3 .1 -1", "P 0 .1 0 0", *WRIST], 4, "spherical wrist"),
    "wrist over Cartesian": (["P 0 0 0 -1", "P -1 0 0 -1", "P 0 0 0 0", *WRIST], 2, "spherical wrist"),
    "wrist over SCARA": (["R 0 .4 .3 0", "R 0 0 .25 2", "P 0 0 0 0", *WRIST], 4, "spherical wrist"),
    "spherical shoulder": (
        ["R 0 0 0 1", "R 0 0 0 -1", "R 0 .4 .1 1", "R 0 .05 .4 0", "R 0 .02 .05 1", "R 0 .1 .1 .5"],
        8,
        "spherical wrist",
    ),
    "RRP with a slanted slide": (["R 0 .3 0 .8", "R 0 .1 0 .6", "P 0 .2 .1 0"], 4, "positioning"),
}


def arm(name, rng=None, limits=None):
    """Return the arm of a family; `rng` adds base, tool and signs of the joints."""
    joints = []
    for i, row in enumerate(FAMILIES[name][0]):
        kind, theta, d, a, alpha = row.split()
        sign = 1 if rng is None else int(rng.choice([-1, 1]))
        kind = {"R": "revolute", "P": "prismatic"}[kind]
        joints.append(Joint(f"j{i + 1}", kind, float(theta) * H, float(d), float(a), float(alpha) * H, sign))
    base, tool = np.eye(4), np.eye(4)
    if rng is not None:
        for pose in (base, tool):
            pose[:3, :3], pose[:3, 3] = Rotation.random(rng=rng).as_matrix(), rng.normal(size=3) * 0.1
    robot = Robot(name, tuple(joints), unlimited(len(joints)), "standard", base, tool)
    return (
        robot if limits is None else replace(robot, limits=replace(robot.limits, position=np.array(limits)))
    )


def turning(robot):
    return np.array([kind == "revolute" for kind in robot.joint_types])


def random_joints(robot, rng, count):
    size = (count, len(robot.joints))
    return np.where(turning(robot), rng.uniform(-np.pi, np.pi, size), rng.uniform(0.05, 0.6, size))


def gap(robot, a, b):
    """Return the largest difference of any joint, full turns apart counted as none."""
    difference = a - b
    turns = np.where(turning(robot), 2 * np.pi * np.round(difference / (2 * np.pi)), 0.0)
    return np.abs(difference - turns).max(axis=-1)


def counts_by_search(robot, poses):
    """Return how many different answers the numeric solver finds."""
    found = search(robot, pose_target(poses), None)
    return distinct(robot, found.joints, found.met).sum(axis=1)
