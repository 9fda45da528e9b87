"""Fastest moves through points: which law is asked for, what a longer duration changes, ends, and what is refused."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest
from scipy.interpolate import CubicSpline
from through_jobs import curve_of, job_text, plan, refusal

from trajcli.errors import MissingLimitError, PlanningError
from trajcli.job.read import job_from_text
from trajcli.kinematics.robot import Joint, Robot, ToolLimits, unlimited
from trajcli.planners.planner import Planned
from trajcli.planners.waypoints import time_optimal
from trajcli.planners.waypoints.time_optimal import TimeOptimal
from trajcli.planning.planned_move import handed_over
from trajcli.trajectory import State, resting

LIMITS = {"velocity": 2.0, "acceleration": 8.0}
POINTS = [[0.0, 0.0], [0.6, -0.2], [0.9, 0.5]]


def planned(
    rows: list[list[float]] = POINTS, *, limits: Any = LIMITS, start: Any = None, **fields: Any
) -> Planned:
    move = {"planner": "time_optimal", "through": [{"joints": row} for row in rows[1:]], **fields}
    return plan({"joints": rows[0], **(start or {})}, move, limits=limits).moves[0].planned


def refused(
    rows: list[list[float]] = POINTS, *, limits: Any = LIMITS, start: Any = None, **fields: Any
) -> str:
    move = {"planner": "time_optimal", "through": [{"joints": row} for row in rows[1:]], **fields}
    return str(refusal({"joints": rows[0], **(start or {})}, move, limits=limits))


@pytest.mark.parametrize("values", [[0, 1, 1], [0, 2, 1], [0.5, 1, 2], [-1, 1, 2], [0]])
def test_values_of_a_parameter_begin_with_zero_and_increase(values: list[float]) -> None:
    assert "must begin with 0 and increase" in refused(parameter=values)


@pytest.mark.parametrize("bound", [(-np.inf, 8.0), (-8.0, np.inf), (-np.inf, np.inf)])
def test_joints_that_move_need_an_acceleration_in_both_directions(bound: tuple[float, float]) -> None:
    to_and_fro = replace(arm().limits, acceleration=np.array([bound, bound]))
    with pytest.raises(MissingLimitError, match="the acceleration of j1, j2 to find"):
        mover().plan(resting(np.array(POINTS[0])), replace(arm(), limits=to_and_fro))
    beside = replace(arm().limits, acceleration=np.array([[-8.0, 8.0], bound]))
    still = mover([[0.0, 1.0], [1.0, 1.0]])
    found = still.plan(resting(np.array([0.0, 1.0])), replace(arm(), limits=beside))
    assert found.curve.duration == pytest.approx(1.0 / 2.0 + 2.0 / 8.0, rel=1e-4)


def test_a_longer_duration_slows_everything_that_is_told() -> None:
    fastest = planned()
    slower = planned(duration=1.5 * fastest.curve.duration)
    kinds = [[event.kind for event in found.events] for found in (fastest, slower)]
    assert "bound" in kinds[0]
    assert "bound" not in kinds[1]
    assert fastest.via_points is not None
    assert slower.via_points is not None
    np.testing.assert_allclose(slower.via_points.times, 1.5 * fastest.via_points.times)
    np.testing.assert_allclose(
        [(phase.start, phase.end) for phase in slower.phases],
        [(1.5 * phase.start, 1.5 * phase.end) for phase in fastest.phases],
    )
    assert slower.phases[-1].end == pytest.approx(slower.curve.duration)
    assert slower.phase_plane is not None
    assert slower.phase_plane.law.duration == pytest.approx(slower.curve.duration)
    at = np.linspace(0.0, 1.0, 33)
    np.testing.assert_allclose(
        slower.curve.evaluate(at * slower.curve.end),
        fastest.curve.evaluate(at * fastest.curve.end),
        atol=1e-12,
    )


def test_the_least_duration_that_is_told_is_kept_and_a_millionth_less_is_not() -> None:
    text = refused(duration=0.1)
    least = float(text.split("needs ")[1].split(" s,")[0])
    assert planned(duration=least).curve.duration == pytest.approx(least, rel=1e-12)
    assert "it shall last" in refused(duration=planned().curve.duration * (1 - 1e-6))


@pytest.mark.parametrize("end", ["start", "to"])
def test_a_motion_from_or_into_a_motion_has_its_own_duration(end: str) -> None:
    moving = {"velocity": [0.3, -0.1]}
    fields: dict[str, Any] = {"start": moving} if end == "start" else {"to": {"joints": [1.2, 0.4], **moving}}
    assert planned(**fields).curve.duration < 5.0
    assert "cannot last a given time when it starts or ends in motion" in refused(**fields, duration=5.0)


@pytest.mark.parametrize(
    ("jerk", "continuity"),
    [(None, 1), ([80.0, None], 2), ([None, 80.0], 2)],
)
def test_one_limit_of_jerk_of_a_joint_that_moves_makes_the_acceleration_join(
    jerk: Any, continuity: int
) -> None:
    found = planned(limits=LIMITS | {"jerk": jerk})
    assert found.continuity == continuity
    begins, ends = found.curve.piece_ends(2)
    steps = np.abs(begins[1:] - ends[:-1]).max()
    assert steps < 1e-6 if continuity == 2 else steps > 1.0


def test_a_limit_of_jerk_of_a_joint_that_stands_changes_nothing() -> None:
    rows = [[0.0, 1.0], [1.0, 1.0]]
    found = planned(rows, limits=LIMITS | {"jerk": [None, 80.0]})
    assert found.continuity == 1
    assert found.curve.duration == pytest.approx(1.0 / 2.0 + 2.0 / 8.0, rel=1e-4)


class AskedError(Exception):
    """Raised in the place of a law, with what was asked for."""


def arm(tool: ToolLimits | None = None, jerk: float = np.inf) -> Robot:
    bounds = (("velocity", 2.0), ("acceleration", 8.0), ("jerk", jerk))
    limits = replace(unlimited(2), **{name: np.array([[-b, b]] * 2) for name, b in bounds})
    limits = limits if tool is None else replace(limits, tcp=tool)
    return Robot("bare", (Joint("j1"), Joint("j2")), limits, None, np.eye(4), np.eye(4))


@pytest.fixture
def laws(monkeypatch: pytest.MonkeyPatch) -> None:
    def within_jerk(path: object, acceleration: object, robot: object, *, bends: bool, of_tool: bool) -> None:
        raise AskedError("jerk", np.asarray(acceleration).tolist(), bends, of_tool)

    def second_order(path: object, robot: object, *, of_tool: bool) -> None:
        raise AskedError("second order", of_tool)

    monkeypatch.setattr(time_optimal, "solve_within_jerk", within_jerk)
    monkeypatch.setattr(time_optimal, "solve_second_order", second_order)


def mover(rows: list[list[float]] = POINTS, **fields: Any) -> TimeOptimal:
    """Return the planner of a move through the points, as a job makes it."""
    move = {"planner": "time_optimal", "through": [{"joints": row} for row in rows[1:]], **fields}
    loaded = job_from_text(job_text({"joints": rows[0]}, move, limits=LIMITS))
    return cast("TimeOptimal", loaded.job.moves[0])


def law_of(
    planner: TimeOptimal, robot: Robot, *, of_tool: bool, start: State | None = None
) -> tuple[Any, ...]:
    begin = resting(np.array(POINTS[0])) if start is None else start
    with pytest.raises(AskedError) as caught:
        (planner.within_tool_limits if of_tool else planner.plan)(begin, robot)
    return caught.value.args


def test_which_law_is_asked_for(monkeypatch: pytest.MonkeyPatch, request: pytest.FixtureRequest) -> None:
    """That within jerk, where a joint or the tool that is kept has a limit of it, unless it is ignored."""
    spline, quintic, polyline = mover(), mover(rule="quintic"), mover(path="polyline")
    ignoring = mover(jerk="ignore")
    moving = State(np.array(POINTS[0]), np.array([0.3, -0.1]), np.array([0.6, -0.2]))
    request.getfixturevalue("laws")
    still = [0.0, 0.0]
    for tool in (ToolLimits(jerk=9.0), ToolLimits(angular_jerk=9.0)):
        assert law_of(spline, arm(tool), of_tool=True) == ("jerk", still, True, True)
        assert law_of(spline, arm(tool), of_tool=False) == ("second order", False)
        assert law_of(ignoring, arm(tool), of_tool=True) == ("second order", True)
    assert law_of(spline, arm(), of_tool=True) == ("second order", True)
    assert law_of(spline, arm(jerk=80.0), of_tool=False) == ("jerk", still, True, False)
    assert law_of(spline, arm(jerk=80.0), of_tool=False, start=moving) == ("jerk", [0.6, -0.2], True, False)
    assert law_of(quintic, arm(jerk=80.0), of_tool=False) == ("jerk", still, False, False)
    assert law_of(polyline, arm(jerk=80.0), of_tool=False) == ("jerk", still, False, False)


def test_what_limits_a_law_stands_in_its_phase_plane(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(time_optimal, "path_constraints", lambda curve, robot: ("path", "further"))
    monkeypatch.setattr(time_optimal, "effort_constraints", lambda curve, robot: ("effort",))
    plane = planned().phase_plane
    assert plane is not None
    assert plane.constraints[1:] == ("path", "further", "effort")


@pytest.mark.parametrize(
    ("types", "fields", "dimension"),
    [
        (("revolute", "revolute"), {}, "angle"),
        (("prismatic", "prismatic"), {}, "length"),
        (("revolute", "prismatic"), {}, "ratio"),
        (("revolute", "revolute"), {"parameter": "chord"}, "angle"),
        (("revolute", "revolute"), {"parameter": "centripetal"}, "ratio"),
        (("prismatic", "prismatic"), {"parameter": [0, 1, 2]}, "ratio"),
        (("prismatic", "prismatic"), {"path": "polyline"}, "length"),
        (("prismatic", "revolute"), {"path": "polyline"}, "ratio"),
    ],
)
def test_the_parameter_of_a_path_has_a_unit_where_it_is_a_length_of_chords(
    types: tuple[str, str], fields: dict[str, Any], dimension: str
) -> None:
    joints = [{"type": kind} for kind in types]
    move = {"planner": "time_optimal", "through": [{"joints": row} for row in POINTS[1:]], **fields}
    made = plan({"joints": POINTS[0]}, move, limits=LIMITS, robot={"joints": joints})
    plane = made.moves[0].planned.phase_plane
    assert plane is not None
    assert plane.dimension == dimension


@pytest.mark.parametrize(
    ("fields", "why"),
    [
        ({}, None),
        ({"duration": 9.0}, "`duration` is given"),
        ({"to": {"joints": [1.2, 0.4], "velocity": [0.3, -0.1]}}, "ends in motion"),
        ({"to": {"joints": [1.2, 0.4], "velocity": [0.0, 0.0]}}, None),
        ({"rule": "computed"}, "the curvature of its path jumps"),
        ({"rule": "shape_preserving"}, "the curvature of its path jumps"),
        ({"rule": "quintic"}, None),
    ],
)
def test_why_no_motion_flies_by_a_corner_of_it(fields: dict[str, Any], why: str | None) -> None:
    told = mover(**fields).why_not_flown_by
    assert (told is None) if why is None else (why in (told or ""))


def test_its_course_passes_its_points_as_far_as_its_corners_are_rounded() -> None:
    start = np.array(POINTS[0])
    for planner in (mover(path="polyline", corner=0.05), mover()):
        course = planner.course(start, arm(), planned())
        passed = course.passed  # type: ignore[attr-defined]
        np.testing.assert_allclose(passed.points, POINTS[1:-1])
        beside = np.abs(course.curve.evaluate(passed.s) - passed.points)  # type: ignore[attr-defined]
        np.testing.assert_allclose(beside, passed.missed, atol=1e-12)


@pytest.mark.parametrize("end", ["starts", "ends"])
@pytest.mark.parametrize("velocity", [[0.0, -0.5], [0.25, 0.0]])
def test_no_path_leads_out_of_a_point_and_back(end: str, velocity: list[float]) -> None:
    state = {"velocity": velocity}
    one = {"joints": [0.3, 0.1]}
    text = str(refusal(
        one | (state if end == "starts" else {}),
        {"planner": "time_optimal", "to": one | (state if end == "ends" else {})},
        limits=LIMITS,
    ))  # fmt: skip
    joint = "j1" if velocity[0] else "j2"
    assert f"{end} with {joint} at {sum(velocity):g} rad/s" in text


@pytest.mark.parametrize("duration", [None, 2.0])
def test_points_in_one_place_are_a_rest(duration: float | None) -> None:
    one = {"joints": [0.3, 0.1]}
    fields = {} if duration is None else {"duration": duration}
    made = plan(one, {"planner": "time_optimal", "to": one, **fields}, limits=LIMITS)
    assert curve_of(made).duration == (duration or 0.0)
    moving = one | {"velocity": [0.5, 0.0]}
    if duration is None:  # there at once, in the motion that is asked for
        passing = plan(moving, {"planner": "time_optimal", "to": moving}, limits=LIMITS)
        np.testing.assert_array_equal(passing.moves[0].planned.end.velocity, [0.5, 0.0])
    else:
        assert "no path leads out" in str(
            refusal(moving, {"planner": "time_optimal", "to": moving, **fields}, limits=LIMITS)
        )


def test_a_motion_into_a_motion_may_last_as_long_as_it_does() -> None:
    moving: dict[str, Any] = {"start": {"velocity": [0.3, -0.1]}}
    duration = planned(**moving).curve.duration
    assert planned(**moving, duration=duration).curve.duration == duration


def test_what_ignores_jerk_starts_with_no_acceleration() -> None:
    """Its acceleration steps anyway: one that is stated is refused, one of a move before is left there."""
    start = {"velocity": [0.3, -0.1], "acceleration": [0.6, -0.2]}
    assert "time_optimal cannot start with an acceleration" in refused(start=start, jerk="ignore")
    state = State(np.array(POINTS[-1]), np.zeros(2), np.array([0.5, 0.0]))
    still = mover([POINTS[-1], POINTS[-1]])
    assert still.plan(state, arm()).curve.duration == 0.0
    with pytest.raises(PlanningError, match="starts with j1"):
        still.plan(state, arm(jerk=80.0))


def test_its_course_has_no_jumps_of_curvature_to_fly_by() -> None:
    course = mover(path="polyline", corner=0.05).course(np.array(POINTS[0]), arm(), planned())
    begins, ends = course.curve.piece_ends(2)  # type: ignore[attr-defined]
    np.testing.assert_allclose(begins[1:], ends[:-1], atol=1e-9)


def test_where_a_limit_of_jerk_binds_is_told() -> None:
    names = {phase.name.split()[0] for phase in planned(limits=LIMITS | {"jerk": 80.0}).phases}
    assert "jerk" in names
    assert "jerk" not in {phase.name.split()[0] for phase in planned().phases}


def test_times_of_a_recording_neither_bind_nor_keep_rests() -> None:
    positions = [[0.6, -0.2], [0.6, -0.2], [0.9, 0.5]]
    recorded = {"positions": positions, "times": [1.0, 2.0, 9.0]}
    found = plan({"joints": POINTS[0]}, {"planner": "time_optimal", "through": recorded}, limits=LIMITS)
    passed = found.moves[0].planned.via_points
    assert passed is not None
    np.testing.assert_allclose(passed.points, POINTS)
    assert found.trajectory.duration == pytest.approx(planned().curve.duration, rel=1e-9)


def test_an_acceleration_is_handed_over_to_what_keeps_jerk_alone() -> None:
    state = State(np.array(POINTS[0]), np.zeros(2), np.array([0.5, 0.0]))
    for jerk, kept in (("keep", [0.5, 0.0]), ("ignore", [0.0, 0.0])):
        np.testing.assert_array_equal(handed_over(state, mover(), mover(jerk=jerk)).acceleration, kept)


def test_a_corner_of_nothing_is_stopped_at() -> None:
    kinds = [event.kind for event in planned(path="polyline", corner=0).events]
    assert "stops" in kinds


def test_left_out_a_path_is_the_spline_of_scipy_by_the_length_of_its_chords() -> None:
    rows = [*POINTS, [1.6, 0.7], [1.2, 1.5]]
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(rows, axis=0), axis=1))])
    at = np.linspace(0.0, s[-1], 41)
    curve = mover(rows).course(np.array(rows[0]), arm(), planned()).curve  # type: ignore[attr-defined]
    np.testing.assert_allclose(curve.evaluate(at), CubicSpline(s, rows)(at), atol=1e-12)
