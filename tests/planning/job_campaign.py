"""Random jobs of every planner on arms and on bare joints, with limits that bind, and their independent judgement."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import numpy as np
from independent_motion import shares
from random_jobs import ALONG_PATHS, TAGS, random_job
from tool_campaign import ROBOTS, task

from trajcli.errors import InputError, PlanningError
from trajcli.job.read import job_from_text
from trajcli.job.robot import load_robot
from trajcli.planning.plan import plan_job

PLANNERS = (*TAGS, *sorted(ALONG_PATHS))
STEPPING = (
    "blends",
    "cubic",
    "spline",
    "trapezoid",
)  # their acceleration steps, which a limit of jerk forbids
SIX = ("puma560", "ur5e", "panda")
ARMS = ("ur5e", "ur3e", "panda", "puma560", "cobra600", "planar3r", "irb140", "iiwa7", "z1")
HEAVY = ("ur5e", "ur3e", "panda", "z1")  # with masses and efforts
TOOL = {
    "speed": (0.1, 2.0),
    "acceleration": (1.0, 20.0),
    "jerk": (20.0, 500.0),
    "angular_speed": (0.5, 5.0),
    "angular_acceleration": (5.0, 50.0),
    "angular_jerk": (50.0, 2000.0),
}


def job_of(number: int) -> dict[str, Any]:
    """Return the random job of a number: all planners take turns."""
    rng = np.random.default_rng([number, 21])
    planner = PLANNERS[number % len(PLANNERS)]
    if planner in ALONG_PATHS:
        return _along_path(rng, number // len(PLANNERS), planner)
    arm = str(rng.choice(ARMS)) if rng.random() < 0.7 else None
    joints = len(load_robot(arm).joints) if arm else int(rng.integers(1, 7))
    unlimited = 0.0 if planner in ("waypoints", "trapezoid") else 0.15
    job = random_job(rng, planner, joints, rest=bool(rng.random() < 0.7), unlimited=unlimited)
    move = job["moves"][0] | {"when_over_limit": "slow"}
    stated: dict[str, Any] = {}
    if arm is not None:
        low, high = np.clip(load_robot(arm).limits.position.T, -3.0, 3.0)
        middle, half = (low + high) / 2, 0.45 * (high - low)
        for state in (job["start"], *move.get("through", []), move.get("to", {})):
            if "joints" in state:
                state["joints"] = (middle + half * np.tanh(state["joints"])).tolist()
        job["robot"], stated = arm, _limits(rng, arm)
    if planner in STEPPING and rng.random() < 0.9:
        stated["jerk"] = None
        stated["tcp"] = {key: bound for key, bound in stated.get("tcp", {}).items() if "jerk" not in key}
    job |= {"limits": stated, "moves": [move]}
    if arm in HEAVY and rng.random() < 0.6:
        stated["effort"] = "robot"
        com = rng.uniform(-0.1, 0.1, 3).tolist()
        job["moves"].insert(0, {"attach": {"mass": float(rng.uniform(0.1, 4)), "com": com}})
    return job


def _limits(rng: np.random.Generator, arm: str) -> dict[str, Any]:
    """Return limits of joints and of the tool, within those of the arm."""
    known = load_robot(arm).limits.velocity[:, 1]
    stated: dict[str, Any] = {
        "velocity": np.minimum(rng.uniform(0.3, 2.0, len(known)), known).tolist(),
        "acceleration": rng.uniform(1.0, 15.0, len(known)).tolist(),
        "jerk": rng.uniform(10.0, 300.0, len(known)).tolist(),
        "tcp": {key: _between(rng, *bounds) for key, bounds in TOOL.items() if rng.random() < 0.3},
    }
    return stated


def _between(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


def _along_path(rng: np.random.Generator, number: int, planner: str) -> dict[str, Any]:
    robot = SIX[number % len(SIX)] if planner == "screw" else ROBOTS[number % len(ROBOTS)]
    made = task(number, "line" if planner == "screw" else planner, robot)
    while planner == "screw" and "quat_wxyz" not in made.move["to"]:
        number += 100_000
        made = task(number, "line", robot)
    move = made.move | {"planner": planner}
    stated = _limits(rng, made.robot) | {"tcp": {key: _between(rng, *bounds) for key, bounds in TOOL.items()}}
    if move["law"]["shape"] not in ("jerk_limited", "time_optimal", "quintic"):
        stated["jerk"] = None
        del stated["tcp"]["jerk"], stated["tcp"]["angular_jerk"]
    return {
        "version": 1,
        "robot": made.robot,
        "limits": stated,
        "start": {"joints": made.start},
        "moves": [move],
    }


@cache
def judged(number: int) -> tuple[str, bool, dict[str, float]]:
    """Return the planner of a job, whether it is verified, and then the largest share of each limit."""
    planner, used = PLANNERS[number % len(PLANNERS)], dict[str, float]()
    try:
        plan = plan_job(job_from_text(json.dumps(job_of(number))))
    except (PlanningError, InputError):
        return planner, False, used
    for move in plan.moves if plan.verdict.passed else ():
        if move.duration > 0:
            for kind, share in shares(move.planned.curve, move.robot).items():
                used[kind] = max(used.get(kind, 0.0), share)
    return planner, plan.verdict.passed, used
