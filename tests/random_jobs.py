"""Random jobs of one move, for every planner and for arms of every kind. SI."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from trajcli.errors import InputError, PlanningError
from trajcli.job.read import LoadedJob, job_from_text
from trajcli.kinematics.robot import Robot
from trajcli.planners import PLANNERS, Planner
from trajcli.planners.planner import Planned
from trajcli.planners.waypoints.spline_rules import IMPOSES
from trajcli.trajectory import State

Fields = dict[str, Any]
RULES = sorted(IMPOSES)
RATES = ("velocity", "acceleration", "jerk")
MOST_JOINTS = 12


def random_bound(rng: np.random.Generator, unlimited: float) -> Any:
    """Return a magnitude, a pair by direction, or None with the given probability."""
    if rng.random() < unlimited:
        return None
    low, high = np.exp(rng.uniform(np.log(0.3), np.log(30.0), 2)).tolist()
    return [-low, high] if rng.random() < 0.3 else high


def random_robot(rng: np.random.Generator, joints: int, unlimited: float) -> Fields:
    """Return an inline robot of revolute and prismatic joints with limits of their own."""
    rows = [
        {
            "type": str(rng.choice(["revolute", "prismatic"])),
            **{quantity: random_bound(rng, unlimited) for quantity in RATES},
        }
        for _ in range(joints)
    ]
    return {"joints": rows}


def random_values(rng: np.random.Generator, joints: int, size: float) -> list[float]:
    values: list[float] = np.where(rng.random(joints) < 0.2, 0.0, rng.uniform(-size, size, joints)).tolist()
    return values


def random_duration(rng: np.random.Generator) -> float:
    return float(np.exp(rng.uniform(np.log(0.1), np.log(20.0))))


def random_job(
    rng: np.random.Generator, tag: str, joints: int, *, rest: bool = False, unlimited: float = 0.2
) -> Fields:
    """Return a job of one move; it need not be possible.

    Args:
        rng: Everything comes from here.
        tag: The planner.
        joints: How many.
        rest: Whether the move starts and ends at rest.
        unlimited: Probability of a limit to be missing.
    """
    start = {"joints": rng.uniform(-3, 3, joints).tolist()}
    move = {"planner": tag, **_FIELDS[tag](rng, start, joints, rest)}
    return {
        "version": 1,
        "robot": random_robot(rng, joints, unlimited),
        "start": start,
        "moves": [move],
    }


def _target(rng: np.random.Generator, start: Fields) -> Fields:
    """Return a target, of which some joints stay where they are."""
    joints = len(start["joints"])
    change = np.where(rng.random(joints) < 0.2, 0.0, rng.uniform(-3, 3, joints))
    return {"joints": (np.array(start["joints"]) + change).tolist()}


def _maybe(rng: np.random.Generator, **fields: Any) -> Fields:
    return {name: value for name, value in fields.items() if rng.random() < 0.5}


def _polynomial(rng: np.random.Generator, start: Fields, joints: int, rest: bool, orders: int) -> Fields:
    target = _target(rng, start)
    for state in () if rest else (start, target):
        for quantity in RATES[:orders]:
            state |= _maybe(rng, **{quantity: random_values(rng, joints, 0.3)})
    return {"to": target, **_maybe(rng, duration=random_duration(rng))}


def _cubic(rng: np.random.Generator, start: Fields, joints: int, rest: bool) -> Fields:
    return _polynomial(rng, start, joints, rest, 1)


def _quintic(rng: np.random.Generator, start: Fields, joints: int, rest: bool) -> Fields:
    return _polynomial(rng, start, joints, rest, 2)


def _cycloidal(rng: np.random.Generator, start: Fields, joints: int, rest: bool) -> Fields:
    return _polynomial(rng, start, joints, True, 0)


def _trapezoid(rng: np.random.Generator, start: Fields, joints: int, rest: bool) -> Fields:
    target = _target(rng, start)
    together = rng.random() < 0.5
    change = np.array(target["joints"]) - start["joints"]
    for state in () if rest else (start, target):
        along = (change * rng.uniform(0.0, 0.3)).tolist()
        state |= _maybe(rng, velocity=along if together else random_values(rng, joints, 0.3))
    fields = _maybe(
        rng,
        duration=random_duration(rng),
        velocity=float(rng.uniform(0.1, 2.0)),
        acceleration=float(rng.uniform(0.5, 10.0)),
        deceleration=float(rng.uniform(0.5, 10.0)),
        overshoot=True,
    )
    if {"duration", "velocity"} <= fields.keys():
        del fields[rng.choice(["duration", "velocity"])]
    if "duration" not in fields:
        fields |= _maybe(rng, minimum_duration=random_duration(rng))
    return {"to": target, **fields, "synchronize": "time" if together else "none"}


def _jerk_limited(rng: np.random.Generator, start: Fields, joints: int, rest: bool) -> Fields:
    target = _target(rng, start)
    if not rest:
        start |= _maybe(rng, velocity=random_values(rng, joints, 0.25))
        target |= _maybe(rng, velocity=random_values(rng, joints, 0.25))
        if rng.random() < 0.2:
            target = {"velocity": random_values(rng, joints, 0.25)}
    fields = _maybe(rng, minimum_duration=random_duration(rng))
    return {"to": target, **fields, "synchronize": str(rng.choice(["time", "none"]))}


def _hold(rng: np.random.Generator, start: Fields, joints: int, rest: bool) -> Fields:
    return {"duration": random_duration(rng)}


def _points_on_the_way(
    rng: np.random.Generator, start: Fields, *, timed: bool
) -> tuple[list[Fields], Fields]:
    """Return waypoints and a target, each where joints have moved on from the one before."""
    position, points = np.array(start["joints"]), []
    times = np.cumsum(rng.uniform(0.3, 2.0, 5))
    for time in times[: rng.integers(1, 5)].tolist():
        position = position + np.where(
            rng.random(position.size) < 0.2, 0.0, rng.uniform(-1, 1, position.size)
        )
        points.append({"joints": position.tolist(), **({"time": time} if timed else {})})
    return points[:-1], points[-1]


def _spline(rng: np.random.Generator, start: Fields, joints: int, rest: bool) -> Fields:
    timed = bool(rng.random() < 0.7)
    through, target = _points_on_the_way(rng, start, timed=timed)
    rule = str(rng.choice(RULES))
    orders = IMPOSES[rule]
    for state in () if rest or orders == 0 else (start, target):
        for quantity in RATES[:orders]:
            state |= _maybe(rng, **{quantity: random_values(rng, joints, 0.1)})
    if rule == "imposed":
        for point in through:
            point["velocity"] = random_values(rng, joints, 0.3)
    return {"rule": rule, "through": through, "to": target}


def _blends(rng: np.random.Generator, start: Fields, joints: int, rest: bool) -> Fields:
    timed = bool(rng.random() < 0.7)
    through, target = _points_on_the_way(rng, start, timed=timed)
    fields = _maybe(rng, end_blends="inside", exactly=True)
    if timed and rng.random() < 0.5:
        fields["blend_durations"] = float(rng.uniform(0.05, 0.5))
    return {"through": through, "to": target, **fields}


def _time_optimal(rng: np.random.Generator, start: Fields, joints: int, rest: bool) -> Fields:
    through, target = _points_on_the_way(rng, start, timed=False)
    if rng.random() < 0.5:
        return {"path": "polyline", "through": through, "to": target, **_maybe(rng, corner=0.05)}
    if not rest and rng.random() < 0.3:
        target["velocity"] = random_values(rng, joints, 0.05)
    fields = _maybe(rng, rule=str(rng.choice(["not_a_knot", "natural", "shape_preserving", "quintic"])))
    return {"through": through, "to": target, **fields, **_maybe(rng, parameter="centripetal")}


def _waypoints(rng: np.random.Generator, start: Fields, joints: int, rest: bool) -> Fields:
    through, target = _points_on_the_way(rng, start, timed=False)
    if not rest:
        start |= _maybe(rng, velocity=random_values(rng, joints, 0.05))
        if rng.random() < 0.3:
            target["velocity"] = random_values(rng, joints, 0.05)
    fields: Fields = {"starts": 1, "straight": bool(rest and rng.random() < 0.3)}
    if rng.random() < 0.3:
        fields["minimum_durations"] = rng.uniform(0, 1, len(through) + 1).tolist()
    return {"through": through, "to": target, **fields}


_FIELDS = {
    "cubic": _cubic,
    "quintic": _quintic,
    "septic": _quintic,
    "cycloidal": _cycloidal,
    "trapezoid": _trapezoid,
    "jerk_limited": _jerk_limited,
    "spline": _spline,
    "blends": _blends,
    "time_optimal": _time_optimal,
    "waypoints": _waypoints,
    "hold": _hold,
}
TAGS = sorted(_FIELDS)
# moves along a path need arms with geometry: tests/tool_campaign.py draws them
ALONG_PATHS = {"line", "arc", "path", "screw"}
assert set(TAGS) == set(PLANNERS) - ALONG_PATHS, "say here how a move of the new planner is drawn"


def loaded(job: Fields) -> LoadedJob:
    return job_from_text(json.dumps(job))


def only_move(job: Fields) -> tuple[Planner, State, Robot]:
    """Return the planner, the start and the robot of a job of one move."""
    read = loaded(job)
    return read.job.moves[0], read.job.start.as_state(), read.robot


def plan_of(job: Fields) -> Planned | None:
    """Return the plan of a job's only move, or None where it is impossible."""
    planner, start, robot = only_move(job)
    try:
        return planner.plan(start, robot)
    except (PlanningError, InputError):
        return None
