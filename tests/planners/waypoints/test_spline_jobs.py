"""`spline` as a job: scipy's splines, laws that hold for every set of points, wrong input."""

from __future__ import annotations

import json

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import CubicSpline, make_interp_spline
from through_jobs import (
    assert_joins,
    assert_passes,
    curve_of,
    in_time,
    plan,
    refusal,
    timed,
)

from trajcli.output.explain import explanation
from trajcli.output.report import report_of

RULES = [
    "imposed",
    "computed",
    "continuous_acceleration",
    "natural",
    "clamped",
    "not_a_knot",
    "quintic",
    "shape_preserving",
]
JOINS = {"imposed": 1, "computed": 1, "shape_preserving": 1}  # the others: 2


waypoints = st.integers(0, 2**32 - 1)


def drawn(seed, least=2):
    """Return times (m,) and points (m, n) of all kinds: some joints rest over some intervals."""
    rng = np.random.default_rng(seed)
    m, n = int(rng.integers(least, 9)), int(rng.integers(1, 4))
    steps = rng.uniform(-2, 2, (m, n)) * (rng.random((m, n)) > 0.2)
    return np.concatenate([[0.0], np.cumsum(rng.uniform(0.05, 3, m - 1))]), np.cumsum(steps, axis=0)


@pytest.mark.parametrize(
    ("rule", "ends"), [("natural", "natural"), ("clamped", "clamped"), ("not_a_knot", "not-a-knot")]
)
@settings(max_examples=40)
@given(seed=waypoints)
def test_as_scipy(rule, ends, seed):
    t, q = drawn(seed, least=4)
    start, points = timed(t, q)
    made = plan(start, {"planner": "spline", "rule": rule, "through": points})
    at = np.linspace(0, t[-1], 101)
    for order in range(3):
        expected = CubicSpline(t, q, bc_type=ends)(at, order)
        got = curve_of(made).evaluate(at, order)
        np.testing.assert_allclose(got, expected, rtol=0, atol=1e-12 * max(1.0, np.abs(expected).max()))


@pytest.mark.parametrize("rule", RULES)
@settings(max_examples=25)
@given(seed=waypoints)
def test_laws(rule, seed):
    t, q = drawn(seed)
    rng = np.random.default_rng(seed)
    start, points = timed(t, q)
    if rule in ("imposed", "quintic"):
        for point in points[:-1]:
            point["velocity"] = rng.uniform(-1, 1, q.shape[1]).tolist()
    if rule in ("continuous_acceleration", "quintic"):
        start["acceleration"] = points[-1]["acceleration"] = rng.uniform(-1, 1, q.shape[1]).tolist()
    made = plan(start, {"planner": "spline", "rule": rule, "through": points})
    assert made.trajectory.duration == t[-1]
    assert_passes(made, t, q)
    assert_joins(curve_of(made), JOINS.get(rule, 2))


@settings(max_examples=50)
@given(seed=waypoints)
def test_shape_preserving_never_leaves_the_box(seed):
    t, q = drawn(seed)
    start, points = timed(t, q)
    curve = curve_of(plan(start, {"planner": "spline", "rule": "shape_preserving", "through": points}))
    for k in range(t.size - 1):
        low, high = np.minimum(q[k], q[k + 1]), np.maximum(q[k], q[k + 1])
        rows = curve.evaluate(np.linspace(t[k], t[k + 1], 201))
        assert (rows >= low - 1e-12).all()
        assert (rows <= high + 1e-12).all()
        assert (np.diff(rows, axis=0) * np.sign(q[k + 1] - q[k]) >= -1e-12).all()


def test_the_report_says_how_far_the_curve_leaves_the_box():
    t, q = [0, 1, 2, 3], [[0, 0], [1, 0], [1, 1], [0, 2]]
    start, points = timed(t, q)
    made = plan(start, {"planner": "spline", "rule": "natural", "through": points})
    dense = np.linspace(0, 3, 300_001)
    rows = CubicSpline(t, q, bc_type="natural")(dense)
    told = {(one.joint, one.beyond > 0): one for one in report_of(made).moves[0].outside}
    assert set(told) == {("j1", True), ("j2", False)}
    for (joint, above), one in told.items():
        values = rows[:, int(joint[1]) - 1]
        peak = values.argmax() if above else values.argmin()
        assert one.beyond == pytest.approx(values[peak] - (1 if above else 0), abs=1e-9)
        assert one.time == pytest.approx(dense[peak], abs=1e-4)


@pytest.mark.parametrize("rule", ["natural", "not_a_knot"])
def test_ends_that_the_rule_leaves_open(rule):
    t, q = [0, 1, 2, 4], [0, 1, 0, 2]
    start, points = timed(t, q)
    move = {"planner": "spline", "rule": rule, "through": points}
    made = plan(start, move)
    begins, ends = made.events
    spline = CubicSpline(t, q, bc_type=rule.replace("_", "-"))
    assert (begins.kind, ends.kind) == ("begins_moving", "ends_moving")
    assert f"{spline(0, 1):.9g} rad/s" in begins.message
    assert f"{spline(4, 1):.9g} rad/s" in ends.message
    asked = plan({**start, "velocity": 0}, move, passes=rule == "never")  # 0 is said: the rule breaks it
    assert {finding.kind for finding in asked.verdict.findings} == {"velocity_jump"}
    given_speed = plan({**start, "velocity": [0.7]}, move)
    assert curve_of(given_speed).evaluate(0.0, 1)[0] == pytest.approx(0.7)
    assert [event.kind for event in given_speed.events] == ["ends_moving"]


@pytest.mark.parametrize("speed", [0.0, 0.5, -1.5])
def test_an_end_velocity_that_is_stated_is_imposed(speed):
    t, q = [0, 1, 2, 4], [0, 1, 0, 2]
    start, points = timed(t, q)
    points[-1]["velocity"] = [speed]
    made = plan({**start, "velocity": [0.5]}, {"planner": "spline", "rule": "natural", "through": points})
    dense = np.linspace(0, 4, 101)
    expected = CubicSpline(t, q, bc_type=((1, 0.5), (1, speed)))(dense)
    np.testing.assert_allclose(curve_of(made).evaluate(dense)[:, 0], expected, atol=1e-12)
    assert made.moves[0].planned.end.velocity == [speed]
    assert not made.events
    free = plan(start, {"planner": "spline", "rule": "natural", "through": points})
    expected = CubicSpline(t, q, bc_type=((2, 0.0), (1, speed)))(dense)
    np.testing.assert_allclose(curve_of(free).evaluate(dense)[:, 0], expected, atol=1e-12)
    assert [event.kind for event in free.events] == ["begins_moving"]


def test_after_another_move_an_open_end_is_a_jump():
    start, points = timed([0, 1, 2], [1, 2, 0])
    moves = [{"planner": "hold", "duration": 1}, {"planner": "spline", "rule": "natural", "through": points}]
    made = plan(start, moves[0], passes=False, moves=moves)
    assert [(f.kind, f.move) for f in made.verdict.findings] == [("velocity_jump", 1)]


def test_one_job_through_the_command_line(tmp_path, capfd):
    from trajcli.cli.app import app

    job = tmp_path / "slides.yaml"
    job.write_text(
        "version: 1\nunits: {angle: rad}\nrobot: {joints: 1}\nstart: {joints: 0}\nmoves:\n"
        "  - planner: spline\n    rule: continuous_acceleration\n    virtual_times: [1, 3]\n"
        "    through: [{joints: 2, time: 2}, {joints: 3, time: 4}]\noutput: {rate: 2, columns: [t, q]}\n"
    )
    for command in (["plan", "-q"], ["explain", "--json"], ["explain"]):
        with pytest.raises(SystemExit) as left:
            app([command[0], str(job), *command[1:]])
        assert not left.value.code
        out = capfd.readouterr().out
        if command[0] == "plan":  # exercise 5 of the slides: 9/4, -3/2, -3/4
            expected = ["0", "0.046875", "0.375", "1.140625", "2", "2.578125", "2.875", "2.984375", "3"]
            assert [float(line.split(",")[1]) for line in out.split()[1:]] == [float(q) for q in expected]
        elif "--json" in command:
            move = json.loads(out)["moves"][0]
            bends = [2 * piece["local"][2] for piece in move["polynomials"]["j1"]]
            np.testing.assert_allclose(bends, [0, 2.25, -1.5, -0.75], atol=1e-9)
            assert [point["time"] for point in move["waypoints"]] == [0, 2, 4]
        else:
            assert "3 points at (s): 0, 2, 4" in out


def test_explain_agrees_with_itself():
    """Local and absolute coefficients are the same polynomial."""
    start, points = timed([0, 0.7, 1.5, 4], [[0, 1], [2, -1], [1, 0], [3, 3]])
    made = plan(start, {"planner": "spline", "through": points})
    for pieces in explanation(made).model_dump()["moves"][0]["polynomials"].values():
        for piece in pieces:
            np.testing.assert_allclose(in_time(piece["local"], piece["start"]), piece["absolute"], atol=1e-9)


@pytest.mark.parametrize(("rule", "ends"), [("not_a_knot", 0), ("clamped", 1)])
def test_there_is_a_polynomial_for_each_interval_also_where_two_are_one_cubic(rule, ends):
    """A PPoly of scipy has as many, in the same order; not_a_knot joins its first two, and its last two."""
    t, q = np.array([0, 1, 2.5, 3, 5]), np.array([[0, 7], [2, 7], [1, 7], [3, 7], [4, 7]])
    start, through = timed(t, q)
    made = plan(start, {"planner": "spline", "rule": rule, "through": through})
    told = explanation(made).model_dump()["moves"][0]
    assert told["breaks"] == t.tolist()
    spline = CubicSpline(t, q, bc_type="clamped" if ends else "not-a-knot")
    for joint, pieces in enumerate(told["polynomials"].values()):
        got = [piece["local"] for piece in pieces]
        np.testing.assert_allclose(got, spline.c[::-1, :, joint].T, atol=1e-12)


FIRST = [{"joints": [1, 2], "time": 1}, {"joints": [2, 1], "time": 3}]
FREE = [{"joints": [1, 2]}, {"joints": [2, 1]}]
WRONG = {
    "no points": ({"through": []}, "needs points"),
    "a time is missing": ({"through": [FREE[0], FIRST[1]]}, "has no `time`"),
    "times go back": ({"through": FIRST[::-1]}, "times must increase, but 1 s comes after 3 s"),
    "the target has no time": ({"through": FIRST, "to": FREE[0]}, "the target has no time"),
    "two durations": ({"through": FIRST, "duration": 4}, "reached after 3 s"),
    "a blend": ({"through": [FIRST[0] | {"blend": 0.1}, FIRST[1]]}, "a spline goes through its points"),
    "a blend at the target": (
        {"through": [FIRST[0]], "to": FIRST[1] | {"blend": 0.1}},
        "a spline goes through its points",
    ),
    "not somewhere": ({"through": [{"velocity": 1, "time": 1}]}, "a waypoint needs `joints` or a pose"),
    "no velocity": ({"rule": "imposed", "through": FIRST}, "needs the velocity of every waypoint"),
    "inner velocity": ({"through": [FIRST[0] | {"velocity": 1}, FIRST[1]]}, "computes the velocity between"),
    "end acceleration": (
        {"rule": "clamped", "through": [FIRST[0], FIRST[1] | {"acceleration": 1}]},
        "clamped does not impose the acceleration at its end",
    ),
    "virtual times outside": ({"through": FIRST, "virtual_times": [0.5, 4]}, "0 to 1 s and 1 to 3 s"),
    "virtual times of free points": ({"through": FREE, "virtual_times": [0.5, 4]}, "waypoints with times"),
    "no virtual points": (
        {"rule": "natural", "through": FIRST, "virtual_times": [0.5, 2]},
        "no virtual points",
    ),
    "joints": ({"through": [{"joints": [1], "time": 1}]}, "expected 2 values, one for each joint, got 1"),
    "an unknown rule": ({"rule": "monotone", "through": FIRST}, "expected imposed, computed"),
    "no limit": ({"through": FREE}, "spline needs a limit on the velocity of j1, j2"),
}


@pytest.mark.parametrize(("fields", "message"), WRONG.values(), ids=WRONG)
def test_wrong_input_is_one_clear_error(fields, message):
    error = refusal({"joints": [0, 0]}, {"planner": "spline", **fields})
    (problem,) = error.problems
    assert message in problem.text()
    assert problem.place is not None
    assert error.exit_code == 2


def test_a_velocity_that_forbids_to_be_monotone():
    start, points = timed([0, 1, 2], [[0, 0], [1, 1], [2, 2]], velocity=[0, -0.5])
    move = {"planner": "spline", "rule": "shape_preserving", "through": points}
    error = refusal(start, move)
    assert error.exit_code == 3
    assert "-0.5 rad/s of j2 at the last point keeps the curve from being monotone" in str(error)
    # a + b <= 3 or a^2 + ab + b^2 - 6a - 6b + 9 <= 0 (Fritsch and Carlson) with b = 1 inside: a <= 4
    assert "0 rad/s to 4 rad/s would not" in str(error)
    for point in points:
        del point["time"]
    error = refusal(start, move, limits={"velocity": 1, "acceleration": 4})
    assert str(error).endswith("-0.5 rad/s of j2 at the last point keeps the curve from being monotone")
    assert "`time`" not in str(error.problems[0].hint)  # against the way none helps
    points[-1]["velocity"] = [0, 4]
    slow = refusal(start, move, limits={"velocity": 10, "acceleration": 0.5})
    assert "give every waypoint a `time`" in str(slow.problems[0].hint)


def test_virtual_times_follow_a_stretch():
    """A start in motion is planned anew for each duration: the virtual points go along."""
    start, points = timed([0, 0.1, 0.4], [0, 0.2, 1])
    move = {"planner": "spline", "through": points, "virtual_times": [0.04, 0.3]}
    made = plan(
        {**start, "velocity": 0.5}, move, limits={"velocity": 2, "acceleration": 10}, when_over_limit="slow"
    )
    stretch = made.moves[0].stretch
    assert stretch > 1
    knots = np.array([0.04, 0.3]) * stretch
    t = np.array([0, 0.1, 0.4]) * stretch
    spline = make_interp_spline(
        t, [0, 0.2, 1], k=3, t=[*[0] * 4, knots[0], t[1], knots[1], *[t[2]] * 4],
        bc_type=([(1, 0.5), (2, 0)], [(1, 0), (2, 0)]),
    )  # fmt: skip
    at = np.linspace(0, t[-1], 50)
    np.testing.assert_allclose(curve_of(made).evaluate(at)[:, 0], spline(at), atol=1e-9)
