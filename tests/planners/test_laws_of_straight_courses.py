"""Laws between states along straight lines in joint space within limits of the tool, by rates of their own.

Along such a line q' is constant and q'' is zero: joints move as one variable does. What the tool does is found
here from the arm's Denavit-Hartenberg table, by differences of positions along the line.
"""

from __future__ import annotations

import numpy as np
import pytest
from planning.test_flown_cells import tool_poses
from ruckig import InputParameter, Result, Ruckig, Trajectory
from tiers import few

from trajcli.job.read import job_from_text
from trajcli.planners.course import JointCourse, joint_line
from trajcli.planners.flying_by import flown_parts
from trajcli.planners.flying_by.flown_parts import CourseLaws, FlownPart, along_path

JERK, CHANGE, SPEED = 40.0, 12.0, 3.0
SHORT = np.array([0.2, -1.7, 1.8, -1.6, -1.5, 0.1]), np.array([0.31, -1.62, 1.74, -1.57, -1.52, 0.05])
LONG = (
    np.array([0.0, -1.2, 2.0, -1.0, -1.5, 0.0]),
    np.array([1.6, -1.2, 0.9, -1.0, -1.5, 0.0]),
)  # it reaches out


def course_of(ends: tuple[np.ndarray, np.ndarray], tcp: str) -> JointCourse:
    """Return the straight line of a UR5e between joints within limits of its tool, m and s."""
    limits = f"{{velocity: {SPEED}, acceleration: {CHANGE}, jerk: {JERK}, tcp: {tcp}}}"
    start = ends[0].tolist()
    moves = f"[{{planner: jerk_limited, to: {{joints: {ends[1].tolist()}}}}}]"
    loaded = job_from_text(
        f"{{version: 1, robot: ur5e, limits: {limits}, start: {{joints: {start}}}, moves: {moves}}}"
    )
    return joint_line(*ends, loaded.robot)


def along_tool(course: JointCourse, s: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return p' and p'' by s, each (N, 3), by differences."""
    step, (line, start) = 1e-4, course.curve.coefficients[:, 0]
    low, here, high = (
        tool_poses(start + (s + k * step)[:, None] * line, np.eye(4))[:, :3, 3] for k in (-1, 0, 1)
    )
    return (high - low) / (2 * step), (high - 2 * here + low) / step**2


def used(course: JointCourse, part: FlownPart, tempo: float = 1.0) -> float:
    """Return what a motion uses of its limits at most, at a slower pace of lower ones."""
    assert part.law is not None
    times = np.linspace(part.law.start, part.law.end, 1501)
    s, sd, sdd, sddd = part.law.evaluate_orders(times, (0, 1, 2, 3), side="left")[..., 0].T
    line = np.abs(course.curve.coefficients[0, 0]).max()
    first, second = along_tool(course, s)
    tcp = course.robot.limits.tcp
    velocity = np.linalg.norm(first * sd[:, None], axis=1).max()
    acceleration = np.linalg.norm(first * sdd[:, None] + second * sd[:, None] ** 2, axis=1).max()
    shares = [sd / SPEED * line, sdd / CHANGE * line, sddd / JERK * line]
    shares += [velocity / tcp.speed, acceleration / tcp.acceleration]
    return float(
        max(np.abs(share).max() / tempo**k for share, k in zip(shares, (1, 2, 3, 1, 2), strict=True))
    )


def bounds_of(course: JointCourse, s: np.ndarray) -> tuple[float, float, float]:
    """Return the tightest bounds of the law at some s, without what bends of the tool's path take."""
    line, tcp = np.abs(course.curve.coefficients[0, 0]).max(), course.robot.limits.tcp
    size = np.linalg.norm(along_tool(course, s)[0], axis=1).max()
    return min(SPEED / line, tcp.speed / size), min(CHANGE / line, tcp.acceleration / size), JERK / line


def from_rest(length: float, bounds: tuple[float, float, float]) -> Trajectory:
    """Return ruckig's motion of one variable from rest to rest."""
    asked, found = InputParameter(1), Trajectory(1)
    asked.target_position = [length]
    asked.max_velocity, asked.max_acceleration, asked.max_jerk = ([each] for each in bounds)
    assert Ruckig(1).calculate(asked, found) == Result.Working
    return found


def states_at(motion: Trajectory, times: list[float]) -> np.ndarray:
    """Return s, sd and sdd at some times, (N, 3)."""
    return np.array([[row[0] for row in motion.at_time(time)] for time in times])


@pytest.mark.parametrize("parts", few([(0.003, 0.7), (0.2, 0.999), (0.001, 0.9995), (0.3, 0.6)], 2))
@pytest.mark.parametrize("tempo", few([0.8, 1.0], 1))
def test_between_states_of_a_motion_that_keeps_its_limits_one_as_fast_is_found(parts, tempo):
    """Also between those next to rest: there a law of sd^2 by s has a pole in its jerk."""
    course = course_of(SHORT, "{speed: 0.5, acceleration: 1.1}")
    bounds = bounds_of(course, np.linspace(0, 1, 101))
    allowed = tuple(0.95 * bound * tempo**order for order, bound in enumerate(bounds, 1))
    motion = from_rest(1.0, allowed)
    times = [part * motion.duration for part in parts]
    rows = states_at(motion, times)
    found = CourseLaws().along(course, 0, (rows[0, 0], rows[1, 0]), rows[:, 1:], tempo)
    assert found.curve.duration <= (times[1] - times[0]) * (1 + 1e-6)
    assert used(course, found) <= 1 + 1e-6
    assert used(course, found, tempo) <= 1.02, (
        "at a slower pace it is slower, but for bends of the tool's path"
    )
    assert found.law is not None
    ends = [found.law.evaluate_orders(np.array([found.law.start]), (0, 1, 2))]
    ends.append(found.law.evaluate_orders(np.array([found.law.end]), (0, 1, 2), side="left"))
    for reached, row in zip(ends, rows, strict=True):
        assert reached[0, :, 0] == pytest.approx(row, rel=3e-4, abs=1e-6 * allowed[1])


def test_where_what_the_tool_may_changes_along_a_course_the_law_follows_it():
    """Within the tightest bounds of the whole course the motion lasts longer."""
    course = course_of(LONG, "{speed: 0.6, acceleration: 90}")
    found = CourseLaws().along(course, 0, (0.0, 1.0), np.zeros((2, 2)), 1.0)
    assert used(course, found) <= 1 + 1e-6
    tight = from_rest(1.0, bounds_of(course, np.linspace(0, 1, 101)))
    assert found.curve.duration < 0.98 * tight.duration


@pytest.mark.parametrize(("ends", "parts", "times"), [(SHORT, (0.49, 0.51), 0), (LONG, (0.0, 0.99), 1)])
def test_where_bounds_hardly_change_no_other_law_is_looked_for(ends, parts, times, monkeypatch):
    made = []
    monkeypatch.setattr(flown_parts, "along_path", lambda *given: made.append(0) or along_path(*given))
    course = course_of(ends, "{speed: 0.6, acceleration: 90}")
    motion = from_rest(1.0, bounds_of(course, np.linspace(0, 1, 101)))
    rows = states_at(motion, [part * motion.duration for part in parts])
    CourseLaws().along(course, 0, (rows[0, 0], rows[1, 0]), rows[:, 1:], 1.0)
    assert len(made) == times


def test_where_the_tool_bends_what_its_path_takes_is_left_to_it():
    """At its largest speed a turning arm needs acceleration: bounds at rest do not know of it."""
    ends = np.array([0.0, -1.6, 0.3, -1.2, -1.5, 0.0]), np.array([2.5, -1.6, 0.3, -1.2, -1.5, 0.0])
    course = course_of(ends, "{speed: 1.5, acceleration: 2.6}")
    found = CourseLaws().along(course, 0, (0.0, 1.0), np.zeros((2, 2)), 1.0)
    radius = np.linalg.norm(along_tool(course, np.zeros(1))[0]) / 2.5
    assert 1.5**2 / radius > 1.2 * 2.6, "the speed alone keeps the acceleration"
    assert 0.97 <= used(course, found) <= 1 + 1e-6
