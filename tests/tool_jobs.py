"""Jobs of moves along a path of the tool: what they plan to, and how they are refused."""

from __future__ import annotations

import json
from functools import cache
from typing import Any

import numpy as np
import pytest

from trajcli.errors import TrajcliError
from trajcli.job.read import job_from_text
from trajcli.job.robot import load_robot
from trajcli.kinematics.forward import forward
from trajcli.kinematics.jacobian import tcp_acceleration, tcp_twist
from trajcli.kinematics.robot import Robot
from trajcli.planning.plan import Plan, plan_job

Fields = dict[str, Any]
TCP = {"speed": 0.25, "acceleration": 2.0, "angular_speed": 1.5, "angular_acceleration": 12.0}
LIMITS = {"velocity": 6.0, "acceleration": 100.0, "jerk": None, "tcp": TCP}
DOWN = [np.pi, 0, 0]
LEFT = {"shoulder": "left", "elbow": "up", "wrist": "no_flip"}
START = {"xyz": [0.4, 0.1, 0.05], "rpy": DOWN, "configuration": LEFT}
TO = {"xyz": [0.4, 0.3, 0.25], "rpy": [np.pi, 0, 0.8]}
LENGTH = np.hypot(0.2, 0.2)
FINE = {"tolerance": {"position": 1e-9, "angle": 1e-9}}
SHAPES = ["trapezoid", "cubic", "quintic", "cycloidal", "jerk_limited", "time_optimal"]
ROUND = {"center": [0.4, 0.15, 0.05], "axis": "z", "angle": 2.0}


@cache
def arm(name: str) -> Robot:
    return load_robot(name)


def job_text(robot: Any, start: Fields, *moves: Fields, **rest: Any) -> str:
    job = {"version": 1, "robot": robot, "limits": LIMITS, "start": start, "moves": list(moves), **rest}
    return json.dumps(job)


def planned(robot: Any, start: Fields, *moves: Fields, advise: bool = True, **rest: Any) -> Plan:
    """Return the plan of a job, read from its text; its verdict may be any."""
    return plan_job(job_from_text(job_text(robot, start, *moves, **rest)), advise=advise)


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


def line(to=TO, **fields):
    return {"planner": "line", "to": to, **fields}


def tool_rates(made, times):
    """Return the magnitudes (4, N) of the tool's speed, angular speed and accelerations."""
    robot, curve = made.moves[0].robot, made.trajectory.curve
    q, qd, qdd = (curve.evaluate(times, order) for order in range(3))
    both = tcp_twist(robot, q, qd), tcp_acceleration(robot, q, qd, qdd)
    return np.stack(
        [np.linalg.norm(rates[:, part], axis=1) for rates in both for part in (slice(3), slice(3, 6))]
    )


def peaks_of(shape, length, tcp=TCP):
    """Return how long a law lasts with the tool's speed and acceleration, from its own peaks."""
    v, a, j = tcp["speed"], tcp["acceleration"], tcp.get("jerk", np.inf)
    if shape in ("trapezoid", "time_optimal"):
        return length / v + v / a if length > v * v / a else 2 * np.sqrt(length / a)
    if shape == "jerk_limited":
        return length / v + v / a + a / j
    c1, c2, c3 = {
        "cubic": (1.5, 6, 12),
        "quintic": (15 / 8, 10 / np.sqrt(3), 60),
        "cycloidal": (2, 2 * np.pi, 4 * np.pi**2),
    }[shape]
    return max(c1 * length / v, np.sqrt(c2 * length / a), np.cbrt(c3 * length / j))
