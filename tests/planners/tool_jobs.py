"""Jobs of one move along a path of the tool: what they plan to, and how they are refused."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import numpy as np
import pytest

from trajcli.errors import TrajcliError
from trajcli.job.read import job_from_text
from trajcli.job.robot_source import load_robot
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Robot
from trajcli.pipeline.plan import Plan, plan_job

Fields = dict[str, Any]
TCP = {"speed": 0.25, "acceleration": 2.0, "angular_speed": 1.5, "angular_acceleration": 12.0}
LIMITS = {"velocity": 6.0, "acceleration": 100.0, "jerk": None, "tcp": TCP}


@cache
def arm(name: str) -> Robot:
    return load_robot(name)


def job_text(robot: Any, start: Fields, *moves: Fields, **rest: Any) -> str:
    job = {"version": 1, "robot": robot, "limits": LIMITS, "start": start, "moves": list(moves), **rest}
    return json.dumps(job)


def planned(robot: Any, start: Fields, *moves: Fields, **rest: Any) -> Plan:
    """Return the plan of a job, read from its text; its verdict may be any."""
    return plan_job(job_from_text(job_text(robot, start, *moves, **rest)))


def plan(robot: Any, start: Fields, *moves: Fields, **rest: Any) -> Plan:
    """Return the plan of a job, read from its text; it passes."""
    made = planned(robot, start, *moves, **rest)
    assert made.verdict.passed, made.verdict.findings
    return made


def refusal(robot: Any, start: Fields, *moves: Fields, **rest: Any) -> TrajcliError:
    """Return the error with which a job is refused."""
    with pytest.raises(TrajcliError) as caught:
        planned(robot, start, *moves, **rest)
    return caught.value


def times_of(made: Plan, count: int = 401) -> np.ndarray:
    return np.linspace(0.0, made.trajectory.duration, count)


def poses_of(made: Plan, times: np.ndarray) -> np.ndarray:
    """Return the tcp's poses (N, 4, 4) at times, from the joints alone."""
    return forward(made.moves[0].robot, made.trajectory.curve.evaluate(times))


def rows(joints: Any) -> list[float]:
    return np.asarray(joints, dtype=float).tolist()
