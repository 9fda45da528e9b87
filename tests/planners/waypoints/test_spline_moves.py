"""Splines as moves: the states in which they begin and end, virtual points, and what their points may give."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.interpolate import CubicSpline, make_interp_spline
from through_jobs import curve_of, plan, refusal, timed

from trajcli.planners.planner import Event, Planned
from trajcli.planners.waypoints import spline
from trajcli.planners.waypoints.through_points import OPEN_END_REMEDIES, REMEDIES

T = [0.0, 1.0, 2.5, 4.0]
Q = [[0.0, 1.0], [2.0, 0.5], [2.5, 0.0], [4.0, -1.0]]
CLOSED = ["imposed", "computed", "continuous_acceleration", "clamped", "quintic", "shape_preserving"]


def move_of(rule: str, first: list[float] | None = None, last: list[float] | None = None) -> Planned:
    """Return the plan of a spline through the points, from one stated velocity to another."""
    start, through = timed(T, Q, **({} if last is None else {"velocity": last}))
    if rule == "imposed":
        through[:-1] = [point | {"velocity": 0} for point in through[:-1]]
    made = plan(
        start | ({} if first is None else {"velocity": first}),
        {"planner": "spline", "rule": rule, "through": through},
    )
    return made.moves[0].planned


@pytest.mark.parametrize("rule", CLOSED)
def test_what_imposes_its_ends_begins_and_ends_in_their_states(rule: str) -> None:
    planned = move_of(rule, [0.5, -0.25], [0.75, -0.5])
    assert planned.begins is None
    assert not planned.ends_open
    np.testing.assert_array_equal(planned.end.position, Q[-1])
    np.testing.assert_array_equal(planned.end.velocity, [0.75, -0.5])
    first, last = planned.curve.piece_ends(1)
    np.testing.assert_allclose([first[0], last[-1]], [[0.5, -0.25], [0.75, -0.5]], atol=1e-12)
    assert planned.remedies == REMEDIES


@pytest.mark.parametrize("rule", ["natural", "not_a_knot"])
@pytest.mark.parametrize("last", [None, [0.0, 0.0], [-0.75, 0.5]])
def test_an_open_end_has_the_velocity_of_the_curve_unless_one_is_stated(
    rule: str, last: list[float] | None
) -> None:
    planned = move_of(rule, last=last)
    ends = (rule.replace("_", "-") if rule != "natural" else (2, [0.0, 0.0]),) * 2
    found = CubicSpline(T, Q, bc_type=(ends[0], ends[1] if last is None else (1, last)))
    assert planned.begins is not None
    np.testing.assert_array_equal(planned.begins.position, Q[0])
    np.testing.assert_allclose(planned.begins.velocity, found(0.0, 1), atol=1e-12)
    assert planned.ends_open is (last is None)
    np.testing.assert_array_equal(planned.end.position, Q[-1])
    np.testing.assert_allclose(planned.end.velocity, found(4.0, 1) if last is None else last, atol=1e-12)
    assert planned.remedies == OPEN_END_REMEDIES


@pytest.mark.parametrize("rule", [*CLOSED, "natural", "not_a_knot"])
def test_only_the_rule_with_virtual_points_has_some(rule: str) -> None:
    planned = move_of(rule)
    if rule != "continuous_acceleration":
        assert planned.virtual_points is None
        assert not planned.virtual
        return
    still = [(1, [0.0, 0.0]), (2, [0.0, 0.0])]
    found = make_interp_spline(T, Q, k=3, t=[*[0] * 4, 0.5, 1, 2.5, 3.25, *[4] * 4], bc_type=(still, still))
    assert planned.virtual_points is not None
    np.testing.assert_allclose(planned.virtual_points.times, [0.5, 3.25])
    np.testing.assert_allclose(planned.virtual_points.points, found([0.5, 3.25]), atol=1e-12)
    assert planned.curve.breaks[list(planned.virtual)].tolist() == [0.5, 3.25]


@pytest.mark.parametrize(
    ("times", "fits"),
    [
        ([0.25, 2.75], True),
        ([0.999, 2.501], True),
        ([0.0, 2.75], False),
        ([-0.5, 2.75], False),
        ([1.0, 2.75], False),
        ([1.5, 2.75], False),
        ([0.25, 2.5], False),
        ([0.25, 1.5], False),
        ([0.25, 4.0], False),
        ([0.25, 5.0], False),
    ],
)
def test_virtual_points_lie_inside_the_first_interval_and_the_last_one(
    times: list[float], fits: bool
) -> None:
    start, through = timed(T, Q)
    move = {"planner": "spline", "through": through, "virtual_times": times}
    if fits:
        found = plan(start, move).moves[0].planned.virtual_points
        assert found is not None
        np.testing.assert_allclose(found.times, times)
    else:
        assert "the first interval and inside the last one, 0 to 1 s and 2.5 to 4 s" in str(
            refusal(start, move)
        )


@pytest.mark.parametrize("stated", ["time", "duration"])
@pytest.mark.parametrize(
    ("times", "fits"), [([0.5, 1.5], True), ([1.5, 0.5], False), ([0.5, 0.5], False), ([0.5, 2.5], False)]
)
def test_of_two_points_both_virtual_ones_lie_in_order_between_them(
    stated: str, times: list[float], fits: bool
) -> None:
    to: dict[str, Any] = {"joints": [1.0, 2.0]}
    move: dict[str, Any] = {"planner": "spline", "to": to, "virtual_times": times}
    (to if stated == "time" else move)[stated] = 2.0
    if not fits:
        assert "must lie inside the first interval" in str(refusal({"joints": [0.0, 0.0]}, move))
        return
    planned = plan({"joints": [0.0, 0.0]}, move).moves[0].planned
    assert planned.curve.end == 2.0
    assert planned.virtual_points is not None
    np.testing.assert_allclose(planned.virtual_points.times, times)


def test_virtual_times_of_a_move_over_a_duration_follow_its_stretch() -> None:
    """Nothing but `duration` says when the target is reached: the virtual points go along."""
    move = {"planner": "spline", "to": {"joints": [1.0]}, "duration": 0.4, "virtual_times": [0.1, 0.3]}
    made = plan(
        {"joints": [0.0], "velocity": 0.5},
        move,
        limits={"velocity": 2, "acceleration": 10},
        when_over_limit="slow",
    )
    alone, planned = made.moves[0].stretch, made.moves[0].planned
    assert alone > 1
    assert planned.virtual_points is not None
    np.testing.assert_allclose(planned.virtual_points.times, np.array([0.1, 0.3]) * alone)


@pytest.mark.parametrize(
    ("count", "duration"),
    [(1, {}), (2, {}), (3, {}), (2, {"duration": 4.0}), (3, {"duration": 4.0})],
)
def test_virtual_points_need_times_of_the_points_between(count: int, duration: dict[str, float]) -> None:
    through = [{"joints": row} for row in Q[1 : count + 1]]
    move = {"planner": "spline", "through": through, "virtual_times": [0.5, 3.5], **duration}
    assert "virtual times need waypoints with times" in str(refusal({"joints": Q[0]}, move))


POINT = {"joints": [1.0], "time": 1.0}
END = {"joints": [2.0], "time": 2.0}


@pytest.mark.parametrize("last", ["to", "through"])
@pytest.mark.parametrize(
    ("rule", "inner", "outer", "flaws"),
    [
        ("imposed", {}, {}, ["needs the velocity of every waypoint between"]),
        ("imposed", {"velocity": 1}, {}, []),
        ("imposed", {"velocity": 1, "acceleration": 0}, {}, ["imposed computes the acceleration"]),
        ("quintic", {"velocity": 1, "acceleration": 1}, {"velocity": 1, "acceleration": 1}, []),
        ("computed", {"velocity": 0}, {}, ["computed computes the velocity between"]),
        ("natural", {"acceleration": 0}, {}, ["natural computes the acceleration between"]),
        ("clamped", {}, {"velocity": 1, "acceleration": 0}, []),
        ("clamped", {}, {"acceleration": -1}, ["clamped does not impose the acceleration at its end"]),
        ("continuous_acceleration", {}, {"velocity": -1, "acceleration": -1}, []),
    ],
)
def test_what_points_between_and_the_last_may_give(
    last: str, rule: str, inner: dict[str, float], outer: dict[str, float], flaws: list[str]
) -> None:
    move: dict[str, Any] = {
        "planner": "spline",
        "rule": rule,
        "through": [POINT | inner, POINT | inner | {"time": 1.5}],
    }
    if last == "to":
        move["to"] = END | outer
    else:
        move["through"].append(END | outer)
    if not flaws:
        planned = plan({"joints": [0.0]}, move).moves[0].planned
        assert planned.end.velocity.tolist() == [outer.get("velocity", 0.0)]
        assert planned.end.acceleration.tolist() == [outer.get("acceleration", 0.0)]
        return
    problems = [problem.text() for problem in refusal({"joints": [0.0]}, move).problems]
    count = 2 if inner or rule == "imposed" else 1
    assert len(problems) == count
    assert all(flaws[0] in problem for problem in problems)


@pytest.mark.parametrize("duration", [None, 2.0])
@pytest.mark.parametrize("velocity", [0.0, 0.5])
def test_points_in_one_place_are_a_rest_or_a_loop(duration: float | None, velocity: float) -> None:
    """At rest there is nothing to do; in motion the arm stays only where nobody says how long."""
    to = {"joints": [0.3], "velocity": velocity}
    move = {
        "planner": "spline",
        "rule": "clamped",
        "to": to,
        **({} if duration is None else {"duration": duration}),
    }
    made = plan({"joints": [0.3], "velocity": velocity}, move)
    curve = curve_of(made)
    assert curve.duration == (duration or 0.0)
    at = np.linspace(0.0, curve.end, 9)
    expected = (
        CubicSpline([0, 2], [0.3, 0.3], bc_type=((1, velocity), (1, velocity)))(at)
        if duration
        else 0.3 + 0 * at
    )
    np.testing.assert_allclose(curve.evaluate(at)[:, 0], expected, atol=1e-12)
    np.testing.assert_array_equal(made.moves[0].planned.end.velocity, [velocity])


@pytest.mark.parametrize(("end", "low", "high"), [(0, 0.0, 4.0), (-1, -4.0, 0.0)])
def test_a_velocity_that_forbids_to_be_monotone_is_told_with_those_that_do_not(
    end: int, low: float, high: float
) -> None:
    """Up to four times the chord where the other end goes with it: a + b <= 3, or in the ellipse (b = 1: a <= 4)."""
    start, through = timed([0, 1, 2], [[0, 0], [1, 1], [2, 2]] if end == 0 else [[2, 2], [1, 1], [0, 0]])
    (start if end == 0 else through[-1])["velocity"] = [0, 4.5 if end == 0 else -4.5]
    text = str(refusal(start, {"planner": "spline", "rule": "shape_preserving", "through": through}))
    assert f"of j2 at the {'first' if end == 0 else 'last'} point" in text
    assert f"{low:g} rad/s to {high:g} rad/s would not" in text


def test_times_found_over_a_duration_are_those_of_the_fastest_in_proportion() -> None:
    limits = {"velocity": 1.0, "acceleration": 4.0}
    move = {"planner": "spline", "rule": "clamped", "through": [{"joints": [1.0]}, {"joints": [3.0]}]}
    alone = plan({"joints": [0.0]}, move, limits=limits).moves[0].planned.via_points
    slower = plan({"joints": [0.0]}, move | {"duration": 9.0}, limits=limits).moves[0].planned.via_points
    assert alone is not None
    assert slower is not None
    assert slower.times[-1] == 9.0
    np.testing.assert_allclose(slower.times, alone.times * (9.0 / alone.times[-1]))


@pytest.mark.parametrize("rule", [*CLOSED, "natural", "not_a_knot"])
def test_an_acceleration_joins_where_the_rule_imposes_it_at_both_ends(rule: str) -> None:
    start, through = timed(T, Q, velocity=[0.0, 0.0])
    if rule == "imposed":
        through[:-1] = [point | {"velocity": 0} for point in through[:-1]]
    start |= {"acceleration": [0.5, -0.25]}
    move = {"planner": "spline", "rule": rule, "through": through}
    if rule in ("continuous_acceleration", "quintic"):
        through[-1]["acceleration"] = [-0.75, 1.0]
        begins, ends = curve_of(plan(start, move)).piece_ends(2)
        np.testing.assert_allclose([begins[0], ends[-1]], [[0.5, -0.25], [-0.75, 1.0]], atol=1e-12)
    else:
        assert "spline cannot start with an acceleration" in str(refusal(start, move))


@pytest.mark.parametrize("rule", ["clamped", "natural", "continuous_acceleration"])
def test_points_with_times_in_one_place_are_a_rest_of_that_time(rule: str) -> None:
    start, through = timed([0, 1, 3], [0.5, 0.5, 0.5])
    curve = curve_of(plan(start, {"planner": "spline", "rule": rule, "through": through}))
    assert curve.duration == 3.0
    np.testing.assert_allclose(curve.evaluate(np.linspace(0, 3, 7)), 0.5, atol=1e-15)


@pytest.mark.parametrize("rule", [*CLOSED, "natural", "not_a_knot"])
def test_two_derivatives_are_promised_where_the_rule_imposes_both_at_its_ends(rule: str) -> None:
    start, through = timed(T[:2], Q[:2])
    made = plan(start, {"planner": "spline", "rule": rule, "through": through})
    assert made.moves[0].continuity == (2 if rule in ("continuous_acceleration", "quintic") else 1)


@pytest.mark.parametrize(
    ("first", "last", "duration"),
    [(0.0, 0.5, None), (0.5, 0.0, None), (0.0, -0.5, 2.0), (0.5, 0.0, 2.0), (0.5, 0.25, None)],
)
def test_an_arm_that_returns_to_its_place_with_another_velocity_moves(
    first: float, last: float, duration: float | None
) -> None:
    move = {"planner": "spline", "rule": "clamped", "to": {"joints": [0.3], "velocity": last}}
    move |= {} if duration is None else {"duration": duration}
    limits = {"acceleration": 4.0}
    curve = curve_of(plan({"joints": [0.3], "velocity": first}, move, limits=limits))
    begins, ends = curve.piece_ends(1)
    np.testing.assert_allclose([begins[0, 0], ends[-1, 0]], [first, last], atol=1e-12)


def test_what_was_left_out_and_that_faster_times_may_exist_are_told(monkeypatch: pytest.MonkeyPatch) -> None:
    found = np.array([0.0, 1.0, 2.0]), (Event("local_optimum", "faster ones may exist"),)
    monkeypatch.setattr(spline, "fastest_spline_times", lambda *_: found)
    through = [{"joints": [value]} for value in (1.0, 1.0, 2.0)]
    planned = plan({"joints": [0.0]}, {"planner": "spline", "through": through}).moves[0].planned
    assert [event.kind for event in planned.events] == ["merged", "local_optimum"]
    assert planned.via_points is not None
    assert planned.via_points.times.tolist() == [0.0, 1.0, 2.0]


@pytest.mark.parametrize("last", ["to", "through"])
@pytest.mark.parametrize("at", [0, 1, 2])
def test_a_blend_is_refused_where_it_stands(last: str, at: int) -> None:
    through: list[dict[str, Any]] = [{"joints": [1.0 + k], "time": 1.0 + k} for k in range(3)]
    through[at]["blend"] = 0.125
    move: dict[str, Any] = {"planner": "spline", "through": through}
    if last == "to":
        move["to"] = through.pop()
    (problem,) = refusal({"joints": [0.0]}, move).problems
    assert problem.place is not None
    assert problem.place.source[problem.place.column - 1 :].startswith("0.125")
