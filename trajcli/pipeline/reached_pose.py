"""How a pose of a job is reached: joints, branch, why that branch, and whether the arm is singular there."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

import numpy as np

from trajcli.pipeline.arm import Arm
from trajcli.pipeline.inverse_answers import free_directions, ranks
from trajcli.pipeline.pose_view import plain
from trajcli.pipeline.reach import Reached, asked_names


def reached_in_units(reached: Reached, arm: Arm) -> dict[str, Any]:
    """Return {joints, branch, method, chosen, singular, rank, free_direction?} in the arm's units.

    `chosen` says whether the names of a configuration or nearness decided, near to which joints, between how
    many candidates, and how many answers there are within the limits. The arm is singular where the tcp can
    move in fewer directions, among those that the pose fixes, than it can nearby: `rank` has both numbers.
    `free_direction` is a unit vector of joint values: the arm can move along it while the tcp keeps the pose.
    """
    found, joints = reached.found, reached.joints
    asked = asked_names(reached.pose.configuration)
    here, nearby = ranks(arm.robot, joints[None], reached.goal)
    told = {
        "joints": plain(joints / arm.joint_factors),
        "branch": {key: name for key, name in asdict(found.names[reached.branch]).items() if name},
        "method": found.method.name,
        "chosen": {
            "by": "configuration" if asked else "nearest",
            "configuration": asked,
            "near": plain(reached.near / arm.joint_factors),
            "candidates": int(np.count_nonzero(reached.usable)),
            "within_limits": int(np.count_nonzero(found.within_limits)),
        },
        "singular": bool(here[0] < nearby),
        "rank": {"here": int(here[0]), "nearby": nearby},
    }
    if found.free[reached.branch].any():
        told["free_direction"] = plain(next(free_directions(arm, joints, reached.goal)))
    return told
