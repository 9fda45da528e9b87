"""Waypoint problems as jobs, and judges of their motions, written without the code under test."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import numpy as np
from yaml_files import read_yaml

import trajcli
from trajcli.curves.piecewise import PiecewisePolynomial, derivative_coefficients

ORACLES = Path(__file__).parents[2] / "oracles" / "waypoint_lists.yaml"
LISTS = read_yaml(ORACLES)


def job_of(case, **fields):
    """Return the job of a reference problem."""
    points, limits = case["waypoints"], case["limits"]
    start, *through = [{"joints": list(map(float, q))} for q in points]
    ends = case.get("ends", {})
    for name in ("velocity", "acceleration"):
        if ends:
            start[name] = list(map(float, ends[f"start_{name}"]))
            through[-1][name] = list(map(float, ends[f"end_{name}"]))
    move = {"planner": "waypoints", "through": through, **fields}
    return {
        "version": 1,
        "robot": {"joints": len(points[0])},
        "limits": {name: list(map(float, values)) for name, values in limits.items()},
        "start": start,
        "moves": [move],
    }


def planned(case, **fields):
    """Return the plan of a reference problem, which must verify."""
    plan = trajcli.plan(job_of(case, **fields))
    assert plan.verdict.passed, plan.verdict.text
    return plan


def stopping(case):
    """Return the sum of ruckig's rest-to-rest times from point to point."""
    import ruckig

    points, total = np.array(case["waypoints"], dtype=float), 0.0
    n = points.shape[1]
    for before, after in pairwise(points):
        wanted, answer = ruckig.InputParameter(n), ruckig.Trajectory(n)
        wanted.current_position, wanted.target_position = before.tolist(), after.tolist()
        for name in ("velocity", "acceleration", "jerk"):
            setattr(wanted, f"max_{name}", list(map(float, case["limits"][name])))
        assert ruckig.Ruckig(n).calculate(wanted, answer) == ruckig.Result.Working
        total += answer.duration
    return total


def most_used(plan, case):
    """Return the largest part of a limit that is used anywhere: of all pieces, at their ends and extremes."""
    curve, used = plan.trajectory.curve, 0.0
    for order, name in ((1, "velocity"), (2, "acceleration"), (3, "jerk")):
        rows = PiecewisePolynomial(curve.breaks, derivative_coefficients(curve.coefficients, order))
        values = [np.abs(part) for part in rows.piece_ends()]
        if rows.degree == 2:  # the vertex of each parabola
            a, b, c = rows.coefficients
            with np.errstate(divide="ignore", invalid="ignore"):
                at = np.where(a != 0, -b / (2 * a), 0.0)
            inside = (at > 0) & (at < curve.lengths[:, None])
            values.append(np.abs(np.where(inside, c + at * (b + a * at), 0.0)))
        used = max(used, float((np.max(values, axis=(0, 1)) / np.array(case["limits"][name])).max()))
    return used


def missed(plan, case):
    """Return by how much the points are missed, in order."""
    points = plan.moves[0].planned.via_points
    assert (np.diff(points.times) > 0).all()
    passed = plan.trajectory.curve.evaluate(np.minimum(points.times, plan.trajectory.curve.end))
    return float(np.abs(passed - np.array(case["waypoints"], dtype=float)).max())
