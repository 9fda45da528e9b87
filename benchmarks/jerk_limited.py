"""Jerk-limited moves of six joints that arrive together: ours against ruckig's own call."""

from __future__ import annotations

import sys
from functools import partial

from benchmarks.contest import Function, compete
from benchmarks.figures import Figure

MOVES, JOINTS = 100, 6
VELOCITY, ACCELERATION, JERK = 2.0, 5.0, 30.0  # of every joint, rad/s, rad/s^2, rad/s^3


def _ours(moving):
    import numpy as np

    from trajcli.kinematics.robot import Joint, Limits, Robot
    from trajcli.planners.point_to_point.jerk_limited import Request, plan_motion
    from trajcli.trajectory import State

    position, *rates = (
        np.tile([-value, value], (JOINTS, 1)) for value in (np.inf, VELOCITY, ACCELERATION, JERK)
    )
    limits = Limits(position, rates[0], rates[1], jerk=rates[2])
    joints = tuple(Joint(f"j{k}") for k in range(1, JOINTS + 1))
    robot = Robot("arm", joints, limits, "standard", np.eye(4), np.eye(4))
    none = np.zeros(JOINTS)
    requests = [
        Request(State(start[0], start[1], none), State(end[0], end[1], none), "position", "time", 0.0)
        for start, end in zip(*_states(moving), strict=True)
    ]
    return lambda: [plan_motion(request, robot).curve.duration for request in requests], _shown


def _ruckig(moving):
    import ruckig

    starts, ends = _states(moving)

    def duration(start, end):
        wanted = ruckig.InputParameter(JOINTS)
        wanted.current_position, wanted.current_velocity = start.tolist()
        wanted.target_position, wanted.target_velocity = end.tolist()
        wanted.max_velocity, wanted.max_acceleration = [VELOCITY] * JOINTS, [ACCELERATION] * JOINTS
        wanted.max_jerk = [JERK] * JOINTS
        answer = ruckig.Trajectory(JOINTS)
        ruckig.Ruckig(JOINTS).calculate(wanted, answer)
        return answer.duration

    return lambda: [duration(*states) for states in zip(starts, ends, strict=True)], _shown


def _states(moving):
    """Return position and velocity (MOVES, 2, JOINTS) at the starts and at the ends."""
    import numpy as np

    states = np.random.default_rng(1).uniform(-2.0, 2.0, (2, MOVES, 2, JOINTS))
    states[:, :, 1] *= 0.3 if moving else 0.0
    return states


def _shown(durations):
    return durations[:: MOVES // 10]


ours_resting, ours_moving = partial(_ours, False), partial(_ours, True)
ruckig_resting, ruckig_moving = partial(_ruckig, False), partial(_ruckig, True)


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: from rest to rest, and between moving states."""
    module, result = "benchmarks.jerk_limited", []
    for kind, states in (("resting", "from rest to rest"), ("moving", "between moving states")):
        runs = compete(
            {
                "ours": Function(sys.executable, module, f"ours_{kind}"),
                "ruckig": Function(sys.executable, module, f"ruckig_{kind}", peer=True),
            }
        )
        theirs = runs["ruckig"]
        name = f"{MOVES} jerk-limited moves {states}"
        result.append(
            Figure(name, "ruckig", runs["ours"].seconds, theirs.seconds, 120, skipped=theirs.skipped)
        )
    return result
