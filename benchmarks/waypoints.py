"""Jerk-limited motion through lists of points of seven joints: ours against ruckig's stops at each point.

Ruckig stops at each point, so that the time for the search is what the shorter motion costs. The same lists
are planned by time_optimal without limits of jerk, too.
"""

from __future__ import annotations

import sys
from functools import partial

from benchmarks.contest import Function, compete
from benchmarks.figures import Figure

JOINTS = 7
COUNTS = (5, 20, 50)
VELOCITY = (2.175,) * 4 + (2.61,) * 3  # of a Panda, rad/s
ACCELERATION = (15.0, 7.5, 10.0, 12.5, 15.0, 20.0, 20.0)  # rad/s^2
JERK = (150.0, 75.0, 100.0, 125.0, 150.0, 200.0, 200.0)  # rad/s^3


def _points(count):
    import numpy as np

    return np.cumsum(np.random.default_rng(count).normal(0.0, 0.4, (count, JOINTS)), axis=0)


def _job(count, jerk, move):
    start, *through = [{"joints": row} for row in _points(count).tolist()]
    limits = {"velocity": list(VELOCITY), "acceleration": list(ACCELERATION)}
    if jerk:
        limits["jerk"] = list(JERK)
    moves = [{**move, "through": through}]
    return {"version": 1, "robot": {"joints": JOINTS}, "limits": limits, "start": start, "moves": moves}


def _planned(count, jerk, move):
    import json

    from trajcli.job.read import job_from_text

    loaded = job_from_text(json.dumps(_job(count, jerk, move)))
    planner, start, robot = loaded.job.moves[0], loaded.job.start.as_state(), loaded.robot
    return lambda: planner.plan(start, robot).curve.duration, _shown


def _ruckig(count):
    from itertools import pairwise

    import ruckig

    points = _points(count).tolist()

    def run():
        total = 0.0
        for before, after in pairwise(points):
            wanted = ruckig.InputParameter(JOINTS)
            wanted.current_position, wanted.target_position = before, after
            wanted.max_velocity, wanted.max_acceleration = list(VELOCITY), list(ACCELERATION)
            wanted.max_jerk = list(JERK)
            answer = ruckig.Trajectory(JOINTS)
            ruckig.Ruckig(JOINTS).calculate(wanted, answer)
            total += answer.duration
        return total

    return run, _shown


def _shown(_duration):
    return []  # the motions are different ones


_OURS = {"planner": "waypoints"}
_WITHOUT_JERK = {"planner": "time_optimal"}
ours_5, ours_20, ours_50 = (partial(_planned, count, True, _OURS) for count in COUNTS)
path_5, path_20, path_50 = (partial(_planned, count, False, _WITHOUT_JERK) for count in COUNTS)
stops_5, stops_20, stops_50 = (partial(_ruckig, count) for count in COUNTS)


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: beside stops at each point, and beside time_optimal without limits of jerk."""
    module, result = "benchmarks.waypoints", []
    for count in COUNTS:
        runs = compete(
            {
                "ours": Function(sys.executable, module, f"ours_{count}"),
                "path": Function(sys.executable, module, f"path_{count}"),
                "stops": Function(sys.executable, module, f"stops_{count}", peer=True),
            }
        )
        name = f"waypoints, {count} points of {JOINTS} joints"
        ours, path, stops = (runs[who] for who in ("ours", "path", "stops"))
        points = 0.25 if count == 5 else 0.04 * count
        result.append(Figure(name, "seconds", ours.seconds, [], points, kind="seconds"))
        result.append(Figure(f"{name}", "time_optimal without jerk", ours.seconds, path.seconds, 50))
        result.append(
            Figure(name, "ruckig, stops", ours.seconds, stops.seconds, 20000, skipped=stops.skipped)
        )
    return result
