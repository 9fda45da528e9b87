"""The planner waypoints: what may be given at points, limits of position, straight moves, degenerate lists."""

from __future__ import annotations

import json
from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiers import few
from waypoint_problems import job_of, most_used, stopping

import trajcli
from trajcli.errors import InputError, MissingLimitError, PlanningError

LIMITS = {"velocity": [1.0, 2.0, 1.5], "acceleration": [3.0, 4.0, 2.0], "jerk": [20.0, 15.0, 30.0]}
POINTS = [[0.0, 0.0, 0.0], [0.4, -0.3, 0.2], [0.1, 0.5, 0.6], [0.9, 0.2, 0.3]]
CASE = {"waypoints": POINTS, "limits": LIMITS}


def plan_of(case=CASE, start=None, points=None, robot=None, **fields):
    """Return the verified plan of a case; `points` is merged into its points by index."""
    job = job_of(case, **{"starts": 1, **fields})
    for k, more in (points or {}).items():
        job["moves"][0]["through"][k - 1] |= more
    job["start"] |= start or {}
    if robot is not None:
        job["robot"] = robot
    plan = trajcli.plan(job)
    assert plan.verdict.passed, plan.verdict.text
    return plan


def at_points(plan, order):
    """Return a derivative at the points, shape (m, n)."""
    times = np.minimum(plan.moves[0].planned.via_points.times, plan.trajectory.curve.end)
    return plan.trajectory.curve.evaluate(times, order)


def refusal(error, **fields):
    with pytest.raises(error) as caught:
        plan_of(**fields)
    return caught.value.problems


@pytest.mark.full
@settings(max_examples=12, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_random_lists_keep_limits_and_points_and_are_not_slower_than_stopping(seed):
    rng = np.random.default_rng(seed)
    n, count = int(rng.integers(1, 5)), int(rng.integers(2, 6))
    steps = rng.uniform(-1, 1, (count, n)) * (rng.random((count, n)) < 0.8)
    limits = {
        "velocity": 10 ** rng.uniform(-0.5, 0.5, n),
        "acceleration": 10 ** rng.uniform(0, 1, n),
        "jerk": 10 ** rng.uniform(0.5, 3, n),
    }
    case = {"waypoints": np.cumsum(steps, axis=0), "limits": limits}
    plan = plan_of(case)
    assert most_used(plan, case) < 1 + 1e-9
    assert plan.trajectory.duration <= stopping(case) * (1 + 1e-9)


@pytest.mark.full
def test_same_job_same_motion():
    curves = [plan_of(starts=2).trajectory.curve for _ in range(2)]
    np.testing.assert_array_equal(curves[0].breaks, curves[1].breaks)
    np.testing.assert_array_equal(curves[0].coefficients, curves[1].coefficients)


def test_faster_limits_scale_the_time():
    faster = {"velocity": 3.0, "acceleration": 9.0, "jerk": 27.0}
    limits = {name: [factor * value for value in LIMITS[name]] for name, factor in faster.items()}
    ratio = plan_of().trajectory.duration / plan_of({**CASE, "limits": limits}).trajectory.duration
    assert ratio == pytest.approx(3, rel=1e-3)


@pytest.mark.full
def test_more_starts_are_not_slower():
    durations = [plan_of(starts=starts).trajectory.duration for starts in (1, 2, 4)]
    assert durations[0] >= durations[1] * (1 - 1e-9) >= durations[2] * (1 - 2e-9)


@pytest.mark.full
def test_velocity_of_a_joint_is_kept_and_the_others_are_found():
    plan = plan_of(points={1: {"velocity": {"j2": -0.5}}, 2: {"acceleration": {"j1": 0.25, "j3": 0.0}}})
    velocity, acceleration = at_points(plan, 1), at_points(plan, 2)
    assert velocity[1, 1] == pytest.approx(-0.5, abs=1e-12)
    assert acceleration[2, [0, 2]] == pytest.approx([0.25, 0.0], abs=1e-9)
    assert np.abs(velocity[1, [0, 2]]).min() > 1e-3
    free = plan_of().trajectory.duration
    assert plan.trajectory.duration >= free * (1 - 1e-3)


def test_what_a_point_names_survives_writing():
    job = job_of(CASE)
    job["moves"][0]["through"][0]["velocity"] = {"j2": -0.5}
    from trajcli.job.read import job_from_text

    loaded = job_from_text(json.dumps(job))
    assert loaded.job.moves[0].through[0].velocity.named == (False, True, False)


def test_stop_at_every_point_where_all_is_given():
    still = {"velocity": 0, "acceleration": 0}
    plan = plan_of(points={1: still, 2: still})
    assert plan.trajectory.duration == pytest.approx(stopping(CASE), rel=1e-8)


def test_start_and_end_in_motion():
    ends = {"velocity": [0.3, -0.2, 0.1], "acceleration": [0.5, 0.0, -0.2]}
    plan = plan_of(start=ends, points={3: {"velocity": [-0.1, 0.4, 0.0]}})
    np.testing.assert_allclose(at_points(plan, 1)[[0, -1]], [ends["velocity"], [-0.1, 0.4, 0.0]], atol=1e-12)
    np.testing.assert_allclose(at_points(plan, 2)[[0, -1]], [ends["acceleration"], [0] * 3], atol=1e-9)


def test_minimum_durations():
    least = [1.5, 0.0, 2.5]
    times = np.diff(plan_of(minimum_durations=least).moves[0].planned.via_points.times)
    assert (times >= np.array(least) - 1e-12).all()
    (short,) = refusal(InputError, minimum_durations=[1.0])
    assert "expected 3 times" in short.text()
    (negative,) = refusal(InputError, minimum_durations=[1.0, -1.0, 0.0])
    assert "at least 0" in negative.text()


def test_two_points_are_a_move_from_state_to_state():
    case = {**CASE, "waypoints": POINTS[:2]}
    job = job_of(case)
    job["moves"][0] = {"planner": "jerk_limited", "to": job["moves"][0]["through"][0]}
    assert plan_of(case).trajectory.duration == pytest.approx(
        trajcli.plan(job).trajectory.duration, rel=1e-12
    )


@pytest.mark.full
def test_doubled_points_count_once_and_leave_their_duration_to_the_next():
    doubled = {**CASE, "waypoints": [POINTS[0], POINTS[0], POINTS[1], POINTS[1], *POINTS[2:], POINTS[3]]}
    plan = plan_of(doubled, minimum_durations=[0.5, 0, 1.25, 0, 0, 1.5])
    assert plan.moves[0].planned.via_points.points.shape == (4, 3)
    assert any("left out 3 waypoints" in event.message for event in plan.events)
    times = np.diff(plan.moves[0].planned.via_points.times)
    assert (times >= np.array([0.5, 1.25, 1.5]) - 1e-12).all()
    assert plan_of(doubled).trajectory.duration == pytest.approx(plan_of().trajectory.duration, rel=1e-9)
    still = {**CASE, "waypoints": [POINTS[0]] * 3}
    assert plan_of(still, minimum_durations=[0.5, 0.25]).trajectory.duration == 0.75


def test_different_velocities_in_one_place_are_refused():
    doubled = {**CASE, "waypoints": [*POINTS[:2], *POINTS[1:]]}
    points = {1: {"velocity": {"j1": 0.1}}, 2: {"velocity": {"j1": 0.2}}}
    (problem,) = refusal(PlanningError, case=doubled, points=points)
    assert "j1" in problem.text()
    assert "0.1" in problem.text()
    assert "0.2" in problem.text()


def test_joints_that_do_not_move_stand_still_and_need_no_limits():
    case = {
        "waypoints": [[q[0], 0.7, q[2]] for q in POINTS],
        "limits": {name: [values[0], 1.0, values[2]] for name, values in LIMITS.items()},
    }
    robot = {"joints": [{}, {}, {}]}
    job = job_of(case, starts=1)
    job["limits"] = {name: [values[0], None, values[2]] for name, values in job["limits"].items()}
    plan = trajcli.plan({**job, "robot": robot})
    assert (plan.trajectory(np.linspace(0, plan.trajectory.duration, 50))[:, 1] == 0.7).all()
    job["limits"]["jerk"] = [20.0, None, None]
    with pytest.raises(MissingLimitError, match="j3"):
        trajcli.plan({**job, "robot": robot})


@pytest.mark.full
@pytest.mark.parametrize("margin", few([0.02, 0.0], 1))
def test_position_limits_are_kept(margin):
    q = np.array(POINTS)
    bounds = [[low - margin, high + margin] for low, high in zip(q.min(0), q.max(0), strict=True)]
    robot = {"joints": [{"position": bound} for bound in bounds]}
    plan = plan_of(robot=robot)
    reached = plan.trajectory(np.linspace(0, plan.trajectory.duration, 20001))
    assert (reached >= q.min(0) - margin - 1e-9).all()
    assert (reached <= q.max(0) + margin + 1e-9).all()
    assert plan_of().trajectory.duration <= plan.trajectory.duration <= stopping(CASE) * (1 + 1e-9)


def test_position_limits_that_cannot_be_kept():
    robot = {"joints": [{"position": [0, 0.9]}, {"position": [-0.31, 0.51]}, {"position": [0, 0.6]}]}
    (problem,) = refusal(PlanningError, robot=robot, points={1: {"velocity": {"j2": -1.5}}})
    assert "j2" in problem.text()
    assert "position limits" in problem.text()


def test_straight_keeps_to_the_polyline():
    line = np.array([[0.0, 0.0, 0.0], [0.1, 0.2, -0.1], [0.3, 0.6, -0.3], [0.4, 0.8, -0.4], [0.4, 0.3, 0.0]])
    case = {**CASE, "waypoints": line}
    plan = plan_of(case, straight=True)
    corners = {**CASE, "waypoints": line[[0, 3, 4]]}
    phases = 0.0
    for before, after in ((line[0], line[3]), (line[3], line[4])):
        job = job_of({**CASE, "waypoints": [before, after]})
        to = job["moves"][0]["through"][0]
        job["moves"] = [{"planner": "jerk_limited", "synchronize": "phase", "to": to}]
        phases += trajcli.plan(job).trajectory.duration
    assert plan.trajectory.duration == pytest.approx(phases, rel=1e-9)
    assert plan.moves[0].planned.certificate.off_chords.max() < 1e-12
    assert np.abs(at_points(plan, 1)[1:3]).min() > 0.01
    assert plan_of(corners, straight=True).trajectory.duration == pytest.approx(phases, rel=1e-9)
    slow = plan_of(case, straight=True, minimum_durations=[0.5, 0.8, 0, 0])
    assert np.diff(slow.moves[0].planned.via_points.times)[1] >= 0.8 - 1e-12
    assert slow.moves[0].planned.certificate.off_chords.max() < 1e-12
    (problem,) = refusal(PlanningError, case=case, straight=True, points={1: {"velocity": [0.1, 0, 0]}})
    assert "j1" in problem.text() or "j2" in problem.text()


@pytest.mark.parametrize("kind", ["velocity", "acceleration"])
def test_a_joint_that_stands_on_a_line_says_nothing_about_its_law(kind):
    """Of such a joint a velocity of zero was taken for a stop of all joints."""
    corners = [[0.0, 0.0, 0.0], [0.4, 0.0, -0.2], [0.8, 0.0, -0.4], [0.8, 0.5, 0.0]]
    case = {**CASE, "waypoints": corners}
    free = plan_of(case, straight=True).trajectory.duration
    plan = plan_of(case, straight=True, points={1: {kind: {"j2": 0.0}}})
    assert plan.trajectory.duration == pytest.approx(free, rel=1e-9)
    slow = plan_of(case, straight=True, points={1: {"velocity": {"j1": 0.3, "j2": 0.0}}})
    np.testing.assert_allclose(at_points(slow, 1)[1], [0.3, 0.0, -0.15], rtol=0, atol=1e-9)
    assert slow.trajectory.duration > free


@pytest.mark.parametrize(
    ("limits", "step", "length"), [((0.05, 1.0, 50.0), 2e-9, 30.0), ((0.01, 1.0, 1000.0), 1e-6, 5.0)]
)
def test_a_segment_far_shorter_than_the_others_takes_next_to_no_time(limits, step, length):
    bounds = dict(zip(LIMITS, ([limit, limit] for limit in limits), strict=True))
    case = {"waypoints": [[0.0, 0.0], [-step, step], [length, length]], "limits": bounds}
    assert plan_of(case).trajectory.duration == pytest.approx(length / limits[0], rel=1e-3)


def test_a_straight_move_with_time_to_spare_takes_no_run_up_beyond_its_corners():
    """From three seconds before its first point it could pass that faster: it went 0.04 rad back to do so."""
    line = [[0.0, 0.0], [0.1, 0.2], [0.3, 0.6], [1.0, 2.0]]
    bounds = {"velocity": [1.0, 1.0], "acceleration": [3.0, 3.0], "jerk": [20.0, 20.0]}
    case = {"waypoints": line, "limits": bounds}
    curve = plan_of(case, straight=True, minimum_durations=[3, 0, 0]).trajectory.curve
    positions = curve.evaluate(np.linspace(curve.start, curve.end, 4001))
    assert positions.min() >= -1e-9
    assert (positions.max(axis=0) <= np.array(line[-1]) + 1e-9).all()
    assert curve.duration < 3 + 2.1


def test_late_short_ramps_of_a_straight_move_keep_the_acceleration():
    """After an hour times are rounded to 5e-13 s, in which the jerk changes the acceleration by 5e-8."""
    bounds = {"velocity": [0.01, 0.01], "acceleration": [1.0, 1.0], "jerk": [1e5, 1e5]}
    corners = [[0.0, 0.0], [20.0, 10.0], [0.0, 1.0], [17.0, 10.0], [3.0, 0.0]]
    plan = plan_of({"waypoints": corners, "limits": bounds}, straight=True)
    assert plan.trajectory.duration == pytest.approx(100 * (20 + 20 + 17 + 14), rel=1e-4)


def test_a_polyline_of_no_length_lets_nothing_move():
    still = {**CASE, "waypoints": [POINTS[0], POINTS[0]]}
    start = {"velocity": [0.0, 0.2, 0.0]}
    (problem,) = refusal(PlanningError, case=still, straight=True, start=start)
    assert (problem.joint, "0.2 rad/s" in problem.text()) == ("j2", True)
    plan_of(still, start=start)


IMPOSSIBLE = {
    "start too fast": ({"start": {"velocity": [1.5, 0, 0]}}, "j1", "at its start"),
    "point too fast": ({"points": {1: {"velocity": {"j2": 2.5}}}}, "j2", "at point 1"),
    "target accelerates too much": ({"points": {3: {"acceleration": [0, 0, 2.5]}}}, "j3", "in its target"),
    "leads outside": ({"start": {"velocity": [0.9, 0, 0], "acceleration": [2.9, 0, 0]}}, "j1", "after"),
}


@pytest.mark.parametrize(("fields", "joint", "words"), IMPOSSIBLE.values(), ids=IMPOSSIBLE)
def test_what_cannot_be_is_named(fields, joint, words):
    problem = refusal(PlanningError, **fields)[0]
    assert problem.joint == joint
    assert words in problem.text()


@pytest.mark.parametrize(
    ("point", "words"),
    [({"time": 1.0}, "finds the times"), ({"blend": 0.1}, "has no blends")],
)
def test_what_points_may_not_say(point, words):
    (problem,) = refusal(InputError, points={2: point})
    assert words in problem.text()


def test_what_is_said_of_a_stretched_motion_is_about_that_motion():
    job = job_of(CASE, starts=1) | {"output": {"align": True, "rate": 2}}
    plan = trajcli.plan(job)
    known = plan.moves[0].planned.certificate
    assert plan.trajectory.duration == pytest.approx(2 * round(plan.trajectory.duration * 2) / 4)
    (said,) = [event.message for event in plan.remarks if event.kind == "fastest_found"]
    above = float(said.split("at most ")[1].split(" %")[0])
    assert above == pytest.approx(100 * (plan.trajectory.duration / known.lower - 1), abs=0.01)
    assert above > 1


@pytest.mark.full
def test_report_says_how_near_to_the_fastest_it_is():
    from trajcli.output.report import report_of

    plan = plan_of(starts=3)
    known = report_of(plan).moves[0].fastest
    assert known.method == "bounded"
    assert known.above == pytest.approx(plan.trajectory.duration / known.lower - 1)
    assert (known.starts, len(known.found)) == (3, 3)
    assert known.stopping == pytest.approx(stopping(CASE), rel=1e-8)
    worst = max(known.off_chords, key=lambda off: off.distance)
    assert worst.distance == pytest.approx(off_chords(plan), rel=1e-3)


def off_chords(plan):
    """Return the largest distance of a joint from the chords, by looking closely."""
    points, curve = plan.moves[0].planned.via_points, plan.trajectory.curve
    largest = 0.0
    for k in range(len(points.points) - 1):
        times = np.linspace(points.times[k], min(points.times[k + 1], curve.end), 4001)
        q, first = curve.evaluate(times), points.points[k]
        weight = 1 / np.array(LIMITS["velocity"]) ** 2
        line = points.points[k + 1] - first
        along = ((q - first) * weight) @ line / (line @ (weight * line))
        largest = max(largest, float(np.abs(q - first - along[:, None] * line).max()))
    return largest


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("straight", [False, True])
def test_a_jerk_that_differs_by_direction_bounds_the_fastest_by_its_larger_side(straight, sign):
    """The oracle is a motion within all limits, of jerks 1000, -10 and 1000 in turn: the bound was 1.47 s."""
    low, high = np.array([10.0, 1000.0])
    rise, fall = 1 / high, 2 / low  # s for each unit of acceleration
    times, jerks = np.array([rise, fall, rise]), np.array([high, -low, high])
    p = v = a = 0.0
    for t, j in zip(times, jerks, strict=True):
        p, v, a = p + v * t + a * t**2 / 2 + j * t**3 / 6, v + a * t + j * t**2 / 2, a + j * t
    assert abs(v) < 1e-12
    assert abs(a) < 1e-12
    faster = times.sum() * p ** (-1 / 3)  # with as much jerk the distance grows with the third power of time
    case = {"waypoints": [[0.0], [0.5 * sign], [1.0 * sign]], "limits": {}}
    jerk = [-10, 1000] if sign > 0 else [-1000, 10]
    robot = {"name": "one", "joints": [{"velocity": 10, "acceleration": 10, "jerk": jerk}]}
    plan = plan_of(case, robot=robot, straight=straight)
    certificate = plan.moves[0].planned.certificate
    assert 0.5 < certificate.lower < faster < plan.trajectory.duration
    assert [event.kind for event in plan.events] == ["jerk_limit_both_ways"]
    assert "of j1 differs by direction" in plan.events[0].message


@cache
def by_jerk_alone() -> float:
    free = {"velocity": [100.0] * 3, "acceleration": [100.0] * 3, "jerk": [20.0] * 3}
    return float(plan_of({"waypoints": POINTS, "limits": free}).trajectory.duration)


@pytest.mark.parametrize(("limit", "jerk"), [(1e6, 20.0), (1e12, 20.0), (10.0, 2e-8), (1e12, 2e13)])
def test_limits_out_of_reach_do_not_matter(limit, jerk):
    """Where jerk alone limits, times go with its third root; 1e6 beside 20 ended in a traceback."""
    wide = {"velocity": [limit] * 3, "acceleration": [limit] * 3, "jerk": [jerk] * 3}
    ratio = plan_of({"waypoints": POINTS, "limits": wide}).trajectory.duration / by_jerk_alone()
    assert ratio == pytest.approx((20.0 / jerk) ** (1 / 3), rel=1e-3)


@pytest.mark.parametrize("speed", [3.0, -30.0])
def test_limits_out_of_reach_from_a_start_in_motion(speed):
    start = {"velocity": [speed] * 3, "acceleration": [0.5 * speed] * 3}
    found = []
    for velocity, acceleration in ((50.0, 80.0), (1e6, 1e6)):
        limits = {"velocity": [velocity] * 3, "acceleration": [acceleration] * 3, "jerk": LIMITS["jerk"]}
        found.append(plan_of({"waypoints": POINTS, "limits": limits}, start=start).trajectory.duration)
    assert found[1] < 1.02 * found[0]
