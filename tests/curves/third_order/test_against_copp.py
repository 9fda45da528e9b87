"""Jerk-limited laws against COPP (TOPP3-SOCP) on its published rule of random splines.

COPP keeps the limits at its stations. Between them its law has sdd linear in s; what it uses of the limits there
says by how much it has to be slowed down to be feasible.
"""

import numpy as np
import pytest
from extras import require_module
from jerk_paths import both, copp_problem, judged
from tiers import few

STATIONS = 1001
BETWEEN = np.linspace(0.0, 1.0, 11)


def copp_durations(path, velocity, acceleration, jerk):
    """Return the duration of COPP's law, and that of the same law once it keeps the limits between stations."""
    require_module("copp_py")
    import copp_py as copp

    s = np.linspace(path.start, path.end, STATIONS)
    robot = copp.Robot(path.dimension, capacity=STATIONS)
    robot.append_s(s)
    q, first, second, third = (np.ascontiguousarray(path.evaluate(s, order)) for order in range(4))
    robot.set_q(q, first, second, 0, dddq=third)
    robot.add_velocity_limits(velocity, -velocity, start_idx_s=0, length=STATIONS)
    robot.add_acceleration_limits(acceleration, -acceleration, start_idx_s=0, length=STATIONS)
    robot.add_jerk_limits(jerk, -jerk, start_idx_s=0, length=STATIONS)
    ends = {"a_boundary": (0.0, 0.0)}
    begin = copp.solver.topp2_ra.Problem(robot.constraints, idx_s_interval=(0, STATIONS - 1), **ends)
    a = copp.solver.topp2_ra.solve(begin, copp.solver.topp2_ra.Options())
    for _ in range(2):
        problem = copp.solver.topp3_socp.Problem(
            robot.constraints,
            np.maximum(a, 1e-9),
            idx_s_start=0,
            b_boundary=(0.0, 0.0),
            num_stationary_max=1,
            **ends,
        )
        profile = copp.solver.topp3_socp.solve(problem)
        a = np.array(profile.a)
    duration = copp.interpolation.s_to_t_topp3(s, profile)[0]
    limits = velocity, acceleration, jerk
    return duration, duration * _stretch(path, s, a, np.array(profile.b), limits)


def _stretch(path, s, a, b, limits):
    """Return by what factor a law must last longer to keep limits between its stations, without the ends."""
    inner = slice(2, -3)
    h, slope = np.diff(s)[inner], (np.diff(b) / np.diff(s))[inner]
    worst = 1.0
    for share in BETWEEN:
        d = share * h
        square = a[:-1][inner] + 2.0 * b[:-1][inner] * d + slope * d**2
        sd = np.sqrt(np.maximum(square, 0.0))[:, None]
        sdd = (b[:-1][inner] + slope * d)[:, None]
        sddd = slope[:, None] * sd
        first, second, third = (path.evaluate(s[:-1][inner] + d, order) for order in (1, 2, 3))
        used = (
            first * sd,
            first * sdd + second * sd**2,
            first * sddd + 3.0 * second * sd * sdd + third * sd**3,
        )
        for order, (values, limit) in enumerate(zip(used, limits, strict=True), 1):
            worst = max(worst, float((np.abs(values) / limit).max()) ** (1 / order))
    return worst


def compared(seed):
    path, *limits = copp_problem(seed)
    at_stations, made_feasible = copp_durations(path, *limits)
    duration = judged(path, *map(both, limits)).law.duration
    assert duration <= 1.005 * at_stations
    assert duration < made_feasible
    return duration / at_stations


@pytest.mark.full
@pytest.mark.parametrize("seed", few([0, 7], 1))
def test_a_part_of_the_published_rule(seed):
    compared(seed)


@pytest.mark.soak
@pytest.mark.parametrize("seed", range(100))
def test_the_published_rule(seed, tally):
    tally({"splines": 1, "duration / copp at its stations": float(compared(seed))})
