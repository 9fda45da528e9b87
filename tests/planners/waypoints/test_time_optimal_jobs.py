"""`time_optimal` as a job: closed forms, a peer's numbers, and what no parametrisation may change.

The solver is compared with toppra in tests/curves/time_optimal.
"""

from __future__ import annotations

import json

import numpy as np
import pytest
from through_jobs import assert_joins, cases, curve_of, job_text, plan, refusal

import trajcli
from trajcli.errors import PlanningError
from trajcli.output.explain import explanation
from trajcli.output.report import report_of
from trajcli.planners.planner import stretched
from trajcli.planning.binding_limits import times_at_limits
from trajcli.planning.retime import with_duration

V, A = 2.0, 8.0
LIMITS = {"velocity": V, "acceleration": A}
ALLOWED = 1 + 1e-9


def fastest(q, *, passes=True, limits=LIMITS, start=None, **fields):
    rows = np.asarray(q, dtype=float).tolist()
    move = {"planner": "time_optimal", "through": [{"joints": row} for row in rows[1:]], **fields}
    return plan({"joints": rows[0], **(start or {})}, move, limits=limits, passes=passes)


def points(seed=0, count=6, joints=3):
    return np.cumsum(np.random.default_rng(seed).uniform(-1, 1, (count, joints)), axis=0)


def along(distance):
    """Return the least time over a straight way between rests: a trapezoid, or a triangle."""
    return distance / V + V / A if distance > V * V / A else 2 * np.sqrt(distance / A)


@cases("time_optimal", "path_time_optimal")
def test_a_peers_cases(case):
    inputs = case["inputs"]
    fields = {"parameter": inputs["s"]} if len(inputs["s"]) > 2 else {}
    limits = {"velocity": inputs["vmax"], "acceleration": inputs["amax"]}
    made = fastest(inputs["waypoints"], limits=limits, **fields)
    assert made.trajectory.duration == pytest.approx(case["expected"]["duration"], rel=case["tolerance"])
    assert made.trajectory.duration >= case["expected"]["duration"] * (1 - 1e-9)


@pytest.mark.parametrize("path", ["spline", "polyline"])
@pytest.mark.parametrize("distance", [0.01, 0.4, 3.0])
def test_a_straight_way(path, distance):
    made = fastest([[0, 0], [distance / 3, distance / 6], [distance, distance / 2]], path=path)
    assert made.trajectory.duration == pytest.approx(along(distance), rel=1e-4)


@pytest.mark.parametrize(
    "fields", [{}, {"rule": "natural"}, {"parameter": "centripetal"}, {"path": "polyline"}]
)
def test_points_are_passed_in_order_within_the_limits(fields):
    q = points()
    made = fastest(q, **fields)
    curve, passage = curve_of(made), made.moves[0].planned.via_points
    assert (np.diff(passage.times) > 0).all()
    np.testing.assert_allclose(curve.evaluate(passage.times), q, atol=1e-9)
    assert_joins(curve, 1)
    at = np.sort(np.concatenate([np.linspace(0, curve.duration, 20_001), curve.breaks]))
    for order, bound in ((1, V), (2, A)):
        peaks = [np.abs(curve.evaluate(at, order, side=side)).max() for side in ("left", "right")]
        assert max(peaks) <= bound * ALLOWED
    assert curve.evaluate(0.0, 1) == pytest.approx(0)


@pytest.mark.parametrize("rule", ["not_a_knot", "quintic", "computed"])
def test_always_some_limit_is_used(rule):
    """Bang-bang: at almost every time one joint moves or accelerates as fast as it may."""
    curve = curve_of(fastest(points(2), rule=rule))
    at = np.linspace(0, curve.duration, 2001)[1:-1]
    used = np.maximum(
        np.abs(curve.evaluate(at, 1)).max(axis=1) / V, np.abs(curve.evaluate(at, 2)).max(axis=1) / A
    )
    assert np.mean(used > 0.9) > 0.98  # the grid is as coarse as a duration within 1 % allows


@pytest.mark.full
@pytest.mark.parametrize("scale", [1e-4, 1e4])
def test_the_scale_of_the_parameter_does_not_matter(scale):
    q = points(3)
    s = np.array([0, 1, 2.5, 3, 4.2, 5])
    a = fastest(q, parameter=s.tolist()).trajectory.duration
    b = fastest(q, parameter=(s * scale).tolist()).trajectory.duration
    assert a == pytest.approx(b, rel=1e-4)


def test_there_and_back_take_the_same_time():
    q = points(4)
    assert fastest(q).trajectory.duration == pytest.approx(fastest(q[::-1]).trajectory.duration, rel=1e-3)


def test_directions_have_their_own_limits():
    limits = {"velocity": [[-0.5, 2.0]], "acceleration": [[-2.0, 8.0]]}
    there = fastest([[0.0], [3.0]], limits=limits).trajectory.duration
    back = fastest([[3.0], [0.0]], limits=limits).trajectory.duration
    for got, v, up, down in ((there, 2.0, 8.0, 2.0), (back, 0.5, 2.0, 8.0)):
        assert got == pytest.approx(3.0 / v + v / 2 * (1 / up + 1 / down), rel=1e-4)


def test_a_corner_is_stopped_at_or_rounded_by_no_more_than_asked_for():
    q = [[0, 0], [1, 0], [1, 1]]
    stopping = fastest(q, path="polyline")
    assert stopping.trajectory.duration == pytest.approx(2 * along(1.0), rel=1e-6)
    (event,) = stopping.events
    assert event.kind == "stops"
    assert event.message.startswith("stops at 1 corner, ")
    durations = [stopping.trajectory.duration]
    for corner in (0.01, 0.05, 0.1):
        made = fastest(q, path="polyline", corner=corner)
        rows = curve_of(made).evaluate(np.linspace(0, made.trajectory.duration, 20_001))
        missed = np.abs(rows - [1, 0]).max(axis=1).min()
        assert missed == pytest.approx(corner, rel=1e-3)
        # each row lies on a segment, or nowhere further from both than the corner
        away = np.minimum(np.abs(rows[:, 1]), np.abs(rows[:, 0] - 1))
        assert away.max() <= corner * ALLOWED
        np.testing.assert_allclose(made.moves[0].planned.via_points.missed[1], corner, rtol=1e-9)
        durations.append(made.trajectory.duration)
    assert durations == sorted(durations, reverse=True)


def test_a_corner_is_an_angle_or_a_length_as_the_joint_is():
    robot = {"joints": [{"type": "prismatic"}, {"type": "revolute"}]}
    start, move = {"joints": [0, 0]}, {"planner": "time_optimal", "path": "polyline"}
    move["through"] = [{"joints": [300, 10]}, {"joints": [-350, 60]}, {"joints": [0, 0]}]
    rest = {"robot": robot, "units": {"angle": "deg", "length": "mm"}, "limits": {"acceleration": 300}}

    def missed(corner):
        made = plan(start, move | {"corner": corner}, **rest)
        return made.moves[0].planned.via_points.missed[1:-1] / [1e-3, np.pi / 180]

    alike = missed(1)
    assert alike.max(axis=1) == pytest.approx([1, 1], rel=1e-9)  # mm, degrees
    np.testing.assert_allclose(missed([1, "1 deg"]), alike, rtol=1e-9)
    np.testing.assert_allclose(missed([0.5, 2]), alike / 2, rtol=1e-9)  # the slide is what turns


def test_a_corner_that_has_no_room_is_shrunk():
    made = fastest([[0, 0], [0.1, 0], [0.1, 1]], path="polyline", corner=0.5)
    assert [event.kind for event in made.events if event.kind != "refined"] == ["shrunk"]


def test_doubled_points_and_reversals():
    once = fastest([[0.0, 0], [1, 1], [0, 0.5], [1, 1]])
    twice = fastest([[0.0, 0], [0, 0], [1, 1], [0, 0.5], [0, 0.5], [1, 1], [1, 1]])
    assert twice.trajectory.duration == once.trajectory.duration
    (event,) = [event for event in twice.events if event.kind == "merged"]
    assert event.message == "left out 3 waypoints that repeat the one before"
    turning = fastest([[0.0], [1.0], [0.5]], path="polyline")
    assert turning.trajectory.duration == pytest.approx(along(1.0) + along(0.5), rel=1e-4)


def test_velocities_at_the_ends():
    made = fastest([[0.0, 0], [1, 0.5]], start={"velocity": [0.5, 0.25]}, path="polyline")
    curve = curve_of(made)
    np.testing.assert_allclose(curve.evaluate(0.0, 1), [0.5, 0.25], atol=1e-12)
    up, down = (V - 0.5) / A, V / A
    way = 1 - (V**2 - 0.5**2) / (2 * A) - V**2 / (2 * A)
    assert made.trajectory.duration == pytest.approx(up + down + way / V, rel=1e-4)
    move = {
        "planner": "time_optimal",
        "through": [{"joints": [1, 1]}],
        "to": {"joints": [2, 1], "velocity": [1, 0.2]},
    }
    ending = plan({"joints": [0, 0]}, move, limits=LIMITS)
    np.testing.assert_allclose(ending.trajectory.end.velocity, [1, 0.2])
    np.testing.assert_allclose(curve_of(ending).piece_ends(1)[1][-1], [1, 0.2], atol=1e-9)


def test_a_velocity_at_an_end_is_in_time_whatever_the_parameter():
    for parameter in ("chord", [0, 10, 30], [0, 1e-3, 2e-3]):
        made = fastest([[0.0, 0], [1, 0.5], [2, 0]], start={"velocity": [0.5, 0.25]}, parameter=parameter)
        np.testing.assert_allclose(curve_of(made).evaluate(0.0, 1), [0.5, 0.25], rtol=1e-9)


def test_a_longer_duration_is_kept():
    q = points(6)
    shortest = fastest(q).trajectory.duration
    made = fastest(q, duration=2 * shortest)
    assert made.trajectory.duration == pytest.approx(2 * shortest, rel=1e-12)
    np.testing.assert_allclose(curve_of(made).evaluate(made.moves[0].planned.via_points.times), q, atol=1e-9)


def test_where_which_limit_binds():
    """A trapezoid of the joint that is slowest: accelerate, cruise, brake."""
    told = explanation(fastest([[0, 0], [1, 3.0]])).model_dump()["moves"][0]
    phases = [(p["name"], p["joint"]) for p in told["phases"]]
    assert phases == [("acceleration +", "j2"), ("velocity +", "j2"), ("acceleration -", "j2")]
    borders = [p["end"] for p in told["phases"]]
    duration = along(3.0)
    np.testing.assert_allclose(borders, [V / A, duration - V / A, duration], rtol=1e-2)


def test_a_limit_of_jerk_that_is_ignored_is_a_violation_with_a_way_out():
    from trajcli.output.report import verification_error

    made = fastest([[0.0], [1.0]], limits={**LIMITS, "jerk": 100}, passes=False, jerk="ignore")
    assert {finding.kind for finding in made.verdict.findings} >= {"acceleration_jump"}
    assert "use spline with rule continuous_acceleration" in (verification_error(made).problems[0].hint or "")
    assert len(report_of(made).findings) < 5


def test_one_job_through_the_command_line(tmp_path, capfd):
    from trajcli.cli.app import app

    job = tmp_path / "fast.yaml"
    job.write_text(
        "version: 1\nunits: {angle: deg}\nrobot: {joints: 1}\nlimits: {velocity: 90, acceleration: 180}\n"
        "start: {joints: 0}\nmoves:\n  - {planner: time_optimal, through: [{joints: 30}], to: {joints: 90}}\n"
        "output: {rate: 10, columns: [t, q]}\n"
    )
    for command in (["plan", "-q"], ["explain", "--json"], ["explain"]):
        with pytest.raises(SystemExit) as left:
            app([command[0], str(job), *command[1:]])
        assert not left.value.code
        out = capfd.readouterr().out
        if command[0] == "plan":
            assert float(out.split()[-1].split(",")[1]) == 90
        elif "--json" in command:
            assert json.loads(out)["duration"] == pytest.approx(1.5, rel=1e-4)
        else:
            assert "  which limit binds when (s):\n    0..0.5: acceleration + of j1\n" in out


def test_a_law_that_is_slowed_down_is_at_none_of_its_limits():
    """Limits bind in the fastest motion: of one that lasts twice as long half and a quarter of them are in use."""
    q = [[0, 0], [1, 1], [2, 0]]
    fast = fastest(q, path="polyline").moves[0]
    shares = {(use.joint, use.quantity): use.seconds / fast.duration for use in times_at_limits(fast)}
    assert sum(shares.values()) == pytest.approx(1, rel=1e-3)
    for longer in (
        fastest(q, path="polyline", duration=2 * fast.duration).moves[0],
        with_duration(fast, 2 * fast.duration),
    ):
        assert longer.duration == pytest.approx(2 * fast.duration)
        assert not times_at_limits(longer)
        assert not longer.planned.binding_phases
    for hardly in (
        fastest(q, path="polyline", duration=1.0005 * fast.duration).moves[0],
        with_duration(fast, 1.0005 * fast.duration),
    ):
        assert hardly.planned.binding_phases


def test_stops_of_a_law_that_is_slowed_down_are_when_it_stops():
    made = fastest([[0, 0], [1, 1], [2, 0.5], [3, 3]], path="polyline", duration=9.0)
    (text,) = (event.message for event in made.events if event.kind == "stops")
    times = [float(each) for each in text.partition("t = ")[2].partition(" s of")[0].split(", ")]
    assert curve_of(made).evaluate(np.array(times)) == pytest.approx(np.array([[1, 1], [2, 0.5]]), abs=1e-4)


def test_a_stretch_is_a_concession_from_a_thousandth_on():
    for factor, conceded in ((1.002, True), (1.3, True)):
        event = stretched(factor)
        assert event.concedes == conceded
        assert f"stretched {factor} times" in event.message


@pytest.mark.full
@pytest.mark.parametrize(("middle", "merged"), [([[60, 30]], set()), ([[60, 30], [60, 30]], {"merged"})])
def test_a_finer_grid_is_no_concession_and_a_point_left_out_is(tmp_path, capfd, middle, merged):
    from trajcli.cli.app import app

    job = tmp_path / "fast.json"
    through = [{"joints": q} for q in [*middle, [20, 80], [90, 10], [0, 0]]]
    fields = {"planner": "time_optimal", "through": through}
    limits = {"velocity": 90, "acceleration": 180}
    job.write_text(job_text({"joints": [0, 0]}, fields, limits=limits, units={"angle": "deg"}))
    report = tmp_path / "report.json"
    with pytest.raises(SystemExit):
        app(["plan", str(job), "--report", str(report), "--no-output", "-v"])
    conceded = {event["kind"] for event in json.loads(report.read_text())["events"]}
    assert conceded - {"joined_over_limit"} == merged
    told = capfd.readouterr().err
    assert "refined: " in told
    assert ("left out 1 waypoint that repeats the one before" in told) is bool(merged)
    with pytest.raises(SystemExit):
        app(["explain", str(job)])
    assert "  q1(t) .. q2(t): " in capfd.readouterr().out


FREE = [{"joints": [1, 2]}, {"joints": [2, 1]}]
WRONG = {
    "time": ({"through": [FREE[0] | {"time": 1}, FREE[1] | {"time": 2}]}, "finds the times", 2, LIMITS),
    "one time": ({"through": [FREE[0] | {"time": 1}, FREE[1]]}, "finds the times", 2, LIMITS),
    "blend": ({"through": [FREE[0] | {"blend": 1}, FREE[1]]}, "has no blends", 2, LIMITS),
    "velocity": (
        {"through": [FREE[0] | {"velocity": 1}, FREE[1]]},
        "does not impose the velocity",
        2,
        LIMITS,
    ),
    "acceleration": (
        {"through": [FREE[0], FREE[1] | {"acceleration": 1}]},
        "not impose the accel",
        2,
        LIMITS,
    ),
    "corner": ({"through": FREE, "corner": 0.1}, "a spline has no corner", 2, LIMITS),
    "some corner": (
        {"through": FREE, "path": "polyline", "corner": [0, 1]},
        "rounded for all joints or for none",
        2,
        LIMITS,
    ),
    "rule": ({"through": FREE, "path": "polyline", "rule": "natural"}, "a polyline has no rule", 2, LIMITS),
    "parameter": ({"through": FREE, "path": "polyline", "parameter": "chord"}, "has no parameter", 2, LIMITS),
    "imposed": ({"through": FREE, "rule": "imposed"}, "imposes derivatives in time", 2, LIMITS),
    "count": ({"through": FREE, "parameter": [0, 1]}, "expected 3 values", 2, LIMITS),
    "from zero": ({"through": FREE, "parameter": [1, 2, 3]}, "must begin with 0 and increase", 2, LIMITS),
    "increase": ({"through": FREE, "parameter": [0, 2, 1]}, "must begin with 0 and increase", 2, LIMITS),
    "name": ({"through": FREE, "parameter": "arc"}, 'or a list of numbers from 0, got "arc"', 2, LIMITS),
    "no limit": ({"through": FREE}, "needs a limit on the acceleration of j1, j2", 2, {"velocity": 1}),
    "too short": ({"through": FREE, "duration": 0.1}, "it shall last 0.1 s", 3, LIMITS),
    "too fast": (
        {"through": [FREE[0], FREE[1] | {"velocity": 50}]},
        "cannot have so high a velocity at its ends",
        3,
        LIMITS,
    ),
    "off the line": (
        {"path": "polyline", "through": [FREE[0], FREE[1] | {"velocity": [0.1, 0.1]}]},
        "a polyline is straight at its ends",
        3,
        LIMITS,
    ),
}


@pytest.mark.parametrize(("fields", "message", "code", "limits"), WRONG.values(), ids=WRONG)
def test_wrong_input_is_one_clear_error(fields, message, code, limits):
    error = refusal({"joints": [0, 0]}, {"planner": "time_optimal", **fields}, limits=limits)
    assert message in error.problems[0].text()
    assert error.problems[0].place is not None
    assert error.exit_code == code


@pytest.mark.parametrize(
    "fields",
    [
        {"planner": "time_optimal", "parameter": [0, 1, 2, 3]},
        {"planner": "blends", "blend_durations": [0.1, 0.1, 0.1, 0.1]},
    ],
)
def test_a_list_with_a_value_for_a_repeated_point_says_how_it_is_taken(fields):
    """The repeated point counts for nothing: its value has none, and the advice, followed, is a plan."""
    (name, values) = list(fields.items())[1]

    def job(points, values):
        move = {**fields, name: values, "through": [{"joints": q} for q in points]}
        limits = {"velocity": 1, "acceleration": 4}
        return {
            "version": 1,
            "robot": {"joints": 2},
            "limits": limits,
            "start": {"joints": [0, 0]},
            "moves": [move],
        }

    points = [[0.5, 0.2], [0.5, 0.2], [1.0, 0.0]]
    with pytest.raises(PlanningError) as caught:
        trajcli.plan(job(points, values))
    assert "4 " in str(caught.value)
    assert "none twice" in caught.value.problems[0].hint
    assert trajcli.plan(job(points[1:], values[:3])).verdict.passed
