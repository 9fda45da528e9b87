"""Splines of seven joints as fast as velocity, acceleration and jerk allow, by COPP's published rule.

Ours keeps all limits for all t; COPP's TOPP3-SOCP keeps them at its stations. The same spline without limits
of jerk says what they cost.
"""

from __future__ import annotations

import sys
from importlib import import_module
from typing import Any

from benchmarks.contest import Function, compete
from benchmarks.figures import Figure

COUNTS = (10, 50)
JOINTS, STATIONS, ROUNDS = 7, 20, 2  # stations: for each piece of the path
GOALS = {10: 2.5, 50: 1.0}


def ten():
    """Prepare ours through 10 points."""
    return _ours(10)


def fifty():
    """Prepare ours through 50 points."""
    return _ours(50)


def ten_without():
    """Prepare the law without limits of jerk through 10 points."""
    return _without(10)


def fifty_without():
    """Prepare the law without limits of jerk through 50 points."""
    return _without(50)


def ten_copp():
    """Prepare COPP through 10 points."""
    return _copp(10)


def fifty_copp():
    """Prepare COPP through 50 points."""
    return _copp(50)


def figures(peers: str | None, *, long: bool) -> list[Figure]:
    """Return the figures: against COPP, and against the law without limits of jerk."""
    module, names = "benchmarks.third_order", {10: "ten", 50: "fifty"}
    shown = []
    for count in COUNTS:
        name = names[count]
        runs = compete(
            {
                "ours": Function(sys.executable, module, name),
                "copp": Function(peers, module, f"{name}_copp", peer=True),
            }
        )
        alone = compete(
            {
                "ours": Function(sys.executable, module, name),
                "without": Function(sys.executable, module, f"{name}_without"),
            }
        )
        title = f"time-optimal within jerk, 7 joints, {count} points"
        ours, theirs = runs["ours"].seconds, runs["copp"]
        shown.append(Figure(title, "COPP", ours, theirs.seconds, GOALS[count], skipped=theirs.skipped))
        shown.append(Figure(title, "without jerk", alone["ours"].seconds, alone["without"].seconds, 30.0))
    return shown


def _ours(count):
    from trajcli.curves.piecewise import PiecewisePolynomial
    from trajcli.curves.third_order.parameterization import jerk_limited_time_optimal

    (breaks, coefficients), limits = _problem(count)
    path, bounds = PiecewisePolynomial(breaks, coefficients), [_both(limit) for limit in limits]
    return lambda: jerk_limited_time_optimal(path, *bounds).law.duration, _nothing


def _without(count):
    from trajcli.curves.piecewise import PiecewisePolynomial
    from trajcli.curves.time_optimal.parameterization import time_optimal

    (breaks, coefficients), limits = _problem(count)
    path, bounds = PiecewisePolynomial(breaks, coefficients), [_both(limit) for limit in limits[:2]]
    return lambda: time_optimal(path, *bounds).law.duration, _nothing


def _copp(count):
    import numpy as np
    from scipy.interpolate import PPoly

    copp: Any = import_module("copp_py")  # its types say less than it takes
    (breaks, coefficients), limits = _problem(count)
    n = STATIONS * (count - 1) + 1
    s, path = np.linspace(0.0, 1.0, n), PPoly(coefficients, breaks)

    def run():
        robot = copp.Robot(JOINTS, capacity=n)
        robot.append_s(s)
        q, first, second, third = (np.ascontiguousarray(path(s, order)) for order in range(4))
        robot.set_q(q, first, second, 0, dddq=third)
        add = (robot.add_velocity_limits, robot.add_acceleration_limits, robot.add_jerk_limits)
        for limit, put in zip(limits, add, strict=True):
            put(limit, -limit, start_idx_s=0, length=n)
        rest = {"a_boundary": (0.0, 0.0)}
        begin = copp.solver.topp2_ra.Problem(robot.constraints, idx_s_interval=(0, n - 1), **rest)
        a = copp.solver.topp2_ra.solve(begin, copp.solver.topp2_ra.Options())
        for _ in range(ROUNDS):
            problem = copp.solver.topp3_socp.Problem(
                robot.constraints,
                np.maximum(a, 1e-9),
                idx_s_start=0,
                b_boundary=(0.0, 0.0),
                num_stationary_max=1,
                **rest,
            )
            profile = copp.solver.topp3_socp.solve(problem)
            a = np.array(profile.a)
        return copp.interpolation.s_to_t_topp3(s, profile)[0]

    return run, _nothing


def _problem(count):
    """Return breaks and coefficients of the spline, and limits of velocity, acceleration and jerk."""
    import numpy as np
    from scipy.interpolate import CubicSpline

    random = np.random.default_rng(0)
    points = random.uniform(-0.5, 0.5, (count, JOINTS))
    limits = [size * random.uniform(0.9, 1.1, JOINTS) for size in (1, 5, 50)]
    spline = CubicSpline(np.linspace(0.0, 1.0, count), points, bc_type="not-a-knot")
    return (spline.x, np.ascontiguousarray(spline.c)), limits


def _both(limit):
    import numpy as np

    return np.stack([-limit, limit], axis=1)


def _nothing(duration):
    """Return nothing to compare: COPP's law keeps the limits at its stations only."""
    del duration
    return []
