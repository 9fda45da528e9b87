"""Limits that parabolic blends keep where they find their accelerations, times or durations themselves."""

from __future__ import annotations

import re
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from through_jobs import curve_of, job_text, plan, refusal, timed

from trajcli.errors import MissingLimitError, PlanningError
from trajcli.job.read import job_from_text
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.planners.waypoints import blends as module
from trajcli.planners.waypoints.blends import blend_times
from trajcli.planners.waypoints.through_points import PointTable
from trajcli.trajectory import State

POINTS = [[0.0, 0.0], [0.6, -0.2], [0.5, 0.4], [1.2, 0.1]]


def largest(made: object) -> float:
    """Return the largest acceleration anywhere."""
    return float(np.abs(np.concatenate(curve_of(made).piece_ends(2))).max())


def untimed(limits: dict[str, object], **fields: object) -> object:
    start, *through = [{"joints": q} for q in POINTS]
    return plan(start, {"planner": "blends", "through": through, **fields}, limits={"jerk": None, **limits})


@pytest.mark.parametrize("bounds", [(-2.0, 5.0), (-5.0, 2.0)])
def test_of_a_limit_that_differs_by_direction_blends_use_the_smaller_one(bounds: tuple[float, float]) -> None:
    start, through = timed([0, 1, 2, 3], [[0.0], [0.3], [0.1], [0.4]])
    made = plan(
        start, {"planner": "blends", "through": through}, limits={"jerk": None, "acceleration": [bounds]}
    )
    assert largest(made) == pytest.approx(2.0, rel=1e-9)


@pytest.mark.parametrize(("own", "limit", "used"), [(2.0, 4.0, 2.0), (9.0, 4.0, 4.0), (None, 4.0, 4.0)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_times_that_are_found_keep_the_smaller_of_limit_and_own_acceleration(
    own: float | None, limit: float, used: float, sign: float
) -> None:
    """In either direction: of one joint the motion is mirrored."""
    start, *through = [{"joints": [sign * q]} for q in (0.0, 0.5, 0.7, 1.5)]
    move = {"planner": "blends", "through": through} | ({} if own is None else {"acceleration": own})
    made = plan(start, move, limits={"jerk": None, "velocity": 1, "acceleration": limit})
    assert largest(made) == pytest.approx(used, rel=1e-6)


@pytest.mark.parametrize(
    ("ends", "blends"),
    [
        ("centred", {}),
        ("inside", {}),
        ("centred", {"blend_durations": [0.2, 0.3, 0.35, 0.25]}),
        ("inside", {"blend_durations": 3}),
    ],
)
def test_a_duration_is_that_of_the_whole_motion_with_its_blends(ends: str, blends: dict[str, object]) -> None:
    """Ends may have other blends, or too little room for them; with them all times keep their proportions."""
    limits = {"velocity": 1, "acceleration": [9, 7] if blends else [3, 1]}
    free = untimed(limits, end_blends=ends, **blends)
    long = untimed(limits, end_blends=ends, **blends, duration=9)
    assert long.trajectory.duration == pytest.approx(9, rel=1e-12)
    factor = 9 / free.trajectory.duration
    np.testing.assert_allclose(curve_of(long).breaks, factor * curve_of(free).breaks, rtol=1e-9, atol=1e-9)
    assert largest(long) == pytest.approx(largest(free) / factor**2, rel=1e-9)


def table(points: object) -> PointTable:
    q = np.array(points)
    return PointTable(q, None, np.zeros((2, *q.shape)), np.zeros((2, len(q)), dtype=bool), np.zeros(len(q)))


def robot() -> Robot:
    limits = replace(unlimited(2), velocity=np.array([[-1.0, 1.0]] * 2))
    return Robot("bare", (Joint("j1"), Joint("j2")), limits, None, np.eye(4), np.eye(4))


@pytest.mark.parametrize("bounds", [(-np.inf, 3.0), (-3.0, np.inf), (-np.inf, np.inf)])
def test_a_joint_that_moves_needs_its_acceleration_in_both_directions(bounds: tuple[float, float]) -> None:
    limits = np.array([(-3.0, 3.0), bounds])
    with pytest.raises(MissingLimitError, match="j2"):
        blend_times(table(POINTS), None, robot(), limits, "inside", exactly=False)
    still = table([[q, 0.5] for q, _ in POINTS])
    times, _ = blend_times(still, None, robot(), limits, "inside", exactly=False)
    assert (np.diff(times) > 0).all()


@pytest.mark.full
@pytest.mark.parametrize("points", [POINTS])
def test_of_several_shares_of_the_segments_the_fastest_is_taken(
    points: object, monkeypatch: pytest.MonkeyPatch
) -> None:
    limits = np.array([[-3.0, 3.0], [-2.0, 2.0]])

    def lasts() -> float:
        return float(blend_times(table(points), None, robot(), limits, "inside", exactly=True)[0][-1])

    best, shares = lasts(), module._SHARES
    assert max(shares) < 0.5 * (1 - 0.1)  # beside a point that is passed exactly there are two blends
    single = []
    for share in shares:
        monkeypatch.setattr(module, "_SHARES", (share,))
        single.append(lasts())
    assert best == pytest.approx(min(single), rel=1e-12)
    monkeypatch.setattr(module, "_SHARES", shares[::-1])
    assert lasts() == pytest.approx(best, rel=1e-12)
    assert np.ptp(single) > 1e-3 * best


@pytest.mark.parametrize(("ends", "shift"), [("inside", 0.0), ("centred", 0.15)])
def test_a_motion_through_its_ends_begins_and_ends_as_far_beside_them_as_it_goes_in_half_a_blend(
    ends: str, shift: float
) -> None:
    q, v = np.array([[0.0, 1.0], [2.0, 0.0], [1.0, 3.0]]), np.array([[0.5, 0.0], [-1.0, 0.25]])
    start, through = timed([0, 1, 3], q, velocity=v[1].tolist())
    move = {"planner": "blends", "through": through, "blend_durations": 0.3, "end_blends": ends}
    made = plan(start | {"velocity": v[0].tolist()}, move)
    curve, planned = curve_of(made), made.moves[0].planned
    assert curve.duration == pytest.approx(3 + 2 * shift)
    first, last = q[0] - shift * v[0], q[-1] + shift * v[1]
    np.testing.assert_allclose([curve.evaluate(0.0), curve.evaluate(curve.end)], [first, last], atol=1e-12)
    np.testing.assert_allclose([curve.evaluate(0.0, 1), curve.evaluate(curve.end, 1)], v, atol=1e-12)
    np.testing.assert_allclose([planned.begins.position, planned.end.position], [first, last], atol=1e-12)
    np.testing.assert_allclose([planned.begins.velocity, planned.end.velocity], v)


def planner_of(move: dict[str, object], joints: int = 2) -> object:
    """Return the planner of a move from zero, as it is read."""
    return job_from_text(job_text({"joints": [0.0] * joints}, move)).job.moves[0]


def test_a_joint_that_goes_and_comes_back_moves() -> None:
    limits = np.array([(-3.0, 3.0), (-np.inf, np.inf)])
    with pytest.raises(MissingLimitError, match="j2"):
        blend_times(
            table([[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]]), None, robot(), limits, "inside", exactly=False
        )


@pytest.mark.parametrize("exactly", [False, True])
@pytest.mark.parametrize(("sign", "speed"), [(1.0, 0.5), (-1.0, 0.25)])
def test_a_way_takes_its_length_over_the_limit_of_its_direction_and_a_ramp(
    sign: float, speed: float, exactly: bool
) -> None:
    """From rest to rest over D within v and a: D / v + v / a, by a trapezoid; the first joint rests."""
    move = {"planner": "blends", "through": [{"joints": [0.0, sign * 2.0]}], "end_blends": "inside"}
    limits = {"velocity": [[-1, 1], [-0.25, 0.5]], "acceleration": 2, "jerk": None}
    made = plan({"joints": [0, 0]}, move | {"exactly": exactly}, limits=limits)
    fastest = 2.0 / speed + speed / 2.0
    assert made.trajectory.duration >= fastest * (1 - 1e-9)
    if not exactly:  # that one takes the best of a few shares of the segment as the length of its ramps
        assert made.trajectory.duration <= fastest * (1 + 1e-6)
    rates = np.concatenate(curve_of(made).piece_ends(1))[:, 1]
    assert np.abs(rates).max() <= speed * (1 + 1e-9)


@pytest.mark.parametrize("ends", ["centred", "inside"])
def test_where_points_are_passed_exactly_some_limit_is_just_met(ends: str) -> None:
    """The durations that are found go with the blends for which they were found."""
    bounds = {"velocity": [[-0.6, 0.9], [-0.9, 0.6]], "acceleration": [[-3, 5], [-5, 3]]}
    curve = curve_of(untimed(bounds, exactly=True, end_blends=ends))
    used = []
    for order, name in ((1, "velocity"), (2, "acceleration")):
        values = np.concatenate(curve.piece_ends(order))
        low, high = np.array(bounds[name], dtype=float).T
        used.append(np.maximum(values / high, values / low).max())
    assert max(used) == pytest.approx(1.0, rel=1e-3)
    assert max(used) <= 1.0 + 1e-9


@pytest.mark.parametrize("exactly", [False, True])
def test_blends_that_are_given_last_as_long_as_that_though_times_are_found(exactly: bool) -> None:
    limits = {"velocity": 1, "acceleration": [9, 7]}
    made = untimed(limits, blend_durations=[0.2, 0.3, 0.35, 0.25], exactly=exactly, end_blends="inside")
    lasts = {0: 0.2, 1: 0.3, 2: 0.35, 3: 0.25}
    blends = [phase for phase in made.moves[0].planned.phases if phase.name != "straight"]
    assert {phase.point for phase in blends} == set(lasts)
    for phase in blends:
        assert phase.end - phase.start == pytest.approx(lasts[phase.point], rel=1e-9)
    assert largest(made) <= 9 * (1 + 1e-9)


def test_a_share_is_that_of_the_shorter_segment_beside_a_point() -> None:
    family = module._Family(np.array(POINTS), None, 0.4, "inside", True)
    np.testing.assert_allclose(family.blends(np.array([1.0, 3.0, 0.5])), [0.4, 0.4, 0.2, 0.2])


def test_where_no_times_are_found_that_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "fastest_durations", lambda *_: None)
    with pytest.raises(PlanningError, match="no times let the blends keep all limits"):
        untimed({"velocity": 1, "acceleration": 3}, exactly=True)


@pytest.mark.parametrize("default", [0.1, 0.4])
def test_a_point_has_its_own_blend_and_others_the_common_one(default: float) -> None:
    start, through = timed([0, 1, 2, 4], POINTS)
    through[1]["blend"] = 0.25
    made = plan(start, {"planner": "blends", "through": through, "blend_durations": default})
    found = [p.end - p.start for p in made.moves[0].planned.phases if p.name != "straight"]
    assert found == pytest.approx([default, default, 0.25, default])


@pytest.mark.parametrize("count", [3, 5])
def test_of_recorded_points_there_must_be_as_many_as_blends(count: int) -> None:
    """How many there are is known when the file is read, and not before."""
    _, through = timed([0, 1, 2, 4], POINTS)
    planner = planner_of({"planner": "blends", "through": through, "blend_durations": [0.1, 0.2, 0.3, 0.4]})
    with pytest.raises(PlanningError, match=f"4 durations of blends for {count} points"):
        planner._durations(table(np.zeros((count, 2))))


def test_an_acceleration_that_is_given_with_times_is_used_as_it_is() -> None:
    """More than the limit allows is over the limit, and no other motion is taken in its place."""
    start, through = timed([0, 1, 2, 4], POINTS)
    move = {"planner": "blends", "through": through, "acceleration": 8}
    for limit, passes in ((9, True), (7, False)):
        made = plan(start, move, passes=passes, limits={"acceleration": limit, "jerk": None})
        assert largest(made) == pytest.approx(8, rel=1e-6)


def test_phases_are_those_of_each_joint_where_its_acceleration_makes_its_blends() -> None:
    """At point 1 both joints turn by 2 rad/s: with 4 and 8 rad/s^2 in 0.5 s and 0.25 s about it."""
    start, through = timed([0, 2, 4], [[0.0, 0.0], [2.0, 2.0], [2.0, 2.0]])
    through[1]["joints"] = [0.0, 0.0]
    made = plan(start, {"planner": "blends", "through": through, "acceleration": [4, 8]})
    planned = made.moves[0].planned
    for joint, lasts in ((0, 0.5), (1, 0.25)):
        (own,) = [p for p in planned.phases if p.joint == joint and p.point == 1]
        assert own.start - planned.origin == pytest.approx(2.0 - lasts / 2)
        assert own.end - planned.origin == pytest.approx(2.0 + lasts / 2)


def test_the_joint_whose_blend_is_shortened_is_named() -> None:
    """Both segments of 1 s have room for 1 s about the point between them; the second joint asks for 2 s."""
    start, through = timed([0, 1, 2], [[0.0, 0.0], [1.0, 1.0], [0.0, 0.0]])
    made = plan(start, {"planner": "blends", "through": through, "acceleration": [20, 1]})
    (event,) = [event for event in made.moves[0].planned.events if event.kind == "shrunk"]
    assert event.amounts["joint"] == "j2"
    assert event.message.endswith("; 2 more likewise")  # the blends at both ends, for which 0.5 s are left
    both = plan(start, {"planner": "blends", "through": through, "acceleration": [1, 1]})
    (event,) = [event for event in both.moves[0].planned.events if event.kind == "shrunk"]
    assert event.message.endswith("; 5 more likewise")


@pytest.mark.parametrize("backwards", [False, True])
@pytest.mark.parametrize("way", [0.8, 0.77, 0.71, 0.67, 0.61])
def test_the_least_acceleration_that_a_refusal_names_is_enough(backwards: bool, way: float) -> None:
    """Of the first segment or of the last one, whichever is too short; what is printed is rounded up."""
    q = [[0.0], [0.1], [0.1 + way]] if backwards else [[0.0], [way], [way + 0.1]]
    times = [0, 3, 3.9] if backwards else [0, 0.9, 4]
    start, through = timed(times, q)
    move = {"planner": "blends", "through": through, "end_blends": "inside"}
    (problem,) = refusal(start, move | {"acceleration": 0.4}).problems
    assert f"inside the {'last' if backwards else 'first'} segment" in problem.text()
    assert "of j1, 0.4 rad/s^2, is too small" in problem.text()
    least = float(re.search(r"it takes (\S+) rad/s\^2", problem.text()).group(1))
    assert plan(start, move | {"acceleration": least}).verdict.passed
    refusal(start, move | {"acceleration": least * (1 - 1e-4)})


def test_accelerations_exclude_the_blend_of_a_single_point_too() -> None:
    start, through = timed([0, 1, 2, 4], POINTS)
    through[1]["blend"] = 0.25
    move = {"planner": "blends", "through": through, "acceleration": 8}
    assert "exclude each other" in str(refusal(start, move))


def test_what_a_point_may_not_say_is_underlined_there_and_not_at_the_target() -> None:
    start, through = timed([0, 1, 2], [[0.0, 0.0], [1.0, 1.0], [0.0, 0.0]])
    through[0]["velocity"] = [0.625, 0]
    move = {"planner": "blends", "through": through[:1], "to": through[1], "blend_durations": 0.1}
    (problem,) = refusal(start, move).problems
    place = problem.place
    assert place.source[place.column - 1 :].startswith(("[0.625", '"velocity"'))


@pytest.mark.parametrize("rates", [((0.0, 0.0), (0.0, 0.5)), ((0.5, 0.0), (0.0, 0.5))])
def test_a_start_that_accelerates_is_refused_with_times_too(rates: object) -> None:
    _, through = timed([0, 1, 2, 4], POINTS)
    planner = planner_of({"planner": "blends", "through": through, "blend_durations": 0.1})
    start = State(np.zeros(2), *(np.array(values) for values in rates))
    with pytest.raises(PlanningError, match="at its start"):
        planner.plan(start, robot())


def test_points_that_are_all_one_last_as_long_as_the_move_says() -> None:
    points = [{"joints": [0.5, 0.5]}] * 2
    limits = {"velocity": 1, "acceleration": 1}
    made = plan(
        {"joints": [0.5, 0.5]}, {"planner": "blends", "through": points, "duration": 1.75}, limits=limits
    )
    assert made.trajectory.duration == 1.75


def test_the_joint_whose_acceleration_is_too_small_is_named() -> None:
    start, through = timed([0, 1, 4], [[0.0, 0.0], [0.01, 0.8], [0.02, 0.9]])
    move = {"planner": "blends", "through": through, "end_blends": "inside", "acceleration": 0.4}
    (problem,) = refusal(start, move).problems
    assert problem.joint == "j2"
    assert "acceleration of j2, 0.4 rad/s^2, is too small" in problem.text()


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(
    "limits", [{"velocity": 0.5, "acceleration": 50}, {"velocity": 50, "acceleration": 0.5}]
)
def test_a_way_with_blends_about_its_ends_uses_its_limits(limits: dict[str, float], sign: float) -> None:
    """One way that begins and ends with half a blend beyond its points: D / T is its speed, by T / 7 or more in a blend."""
    move = {"planner": "blends", "through": [{"joints": [sign * 2.0]}], "exactly": True}
    curve = curve_of(plan({"joints": [0]}, move, limits=limits | {"jerk": None}))
    speed, steepest = (np.abs(np.concatenate(curve.piece_ends(order))).max() for order in (1, 2))
    used = max(speed / limits["velocity"], steepest / limits["acceleration"])
    assert used == pytest.approx(1.0, rel=1e-6)


def test_accelerations_of_blends_step_and_velocities_do_not() -> None:
    start, through = timed([0, 1, 2, 4], POINTS)
    made = plan(start, {"planner": "blends", "through": through, "blend_durations": 0.2})
    curve = curve_of(made)
    steps = []
    for order in range(3):
        begins, ends = curve.piece_ends(order)
        steps.append(np.abs(begins[1:] - ends[:-1]).max())
    assert max(steps[:2]) < 1e-9 < 0.1 < steps[2]
    assert made.loaded.job.moves[0].continuity == 1


@pytest.mark.parametrize("fields", [{"blend_durations": 0.95}, {"acceleration": [40, 60]}])
def test_phases_follow_each_other_from_the_start_on(fields: dict[str, object]) -> None:
    start, through = timed([0, 1, 2, 4], POINTS)
    made = plan(start, {"planner": "blends", "through": through, **fields})
    phases = made.moves[0].planned.phases
    for joint in {phase.joint for phase in phases}:
        own = [phase for phase in phases if phase.joint == joint]
        assert own[0].start == 0.0
        assert own[-1].end <= curve_of(made).end * (1 + 1e-12)
        assert all(one.end == other.start for one, other in pairwise(own))


def test_a_joint_that_rests_needs_no_acceleration() -> None:
    start, through = timed([0, 1, 2, 4], [[q, 0.5] for q, _ in POINTS])
    limits = {"acceleration": [9, None], "jerk": None}
    made = plan(start, {"planner": "blends", "through": through}, limits=limits)
    assert largest(made) == pytest.approx(9.0)
    assert (curve_of(made).evaluate(np.linspace(0, curve_of(made).end, 9))[:, 1] == 0.5).all()


@pytest.mark.parametrize("count", [3, 5])
def test_a_list_of_blends_has_one_for_each_point(count: int) -> None:
    start, through = timed([0, 1, 2, 4], POINTS)
    move = {"planner": "blends", "through": through, "blend_durations": [0.1] * count}
    assert f"expected 4 durations, start and target included, got {count}" in str(refusal(start, move))
