"""What `waypoints` asks the search: which joints with which limits, from where; and what it makes of the answer."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from functools import cache
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest

import trajcli
from trajcli.errors import MissingLimitError, PlanningError, TrajcliError
from trajcli.job.read import job_from_text
from trajcli.planners.fastest_through_points import assembly
from trajcli.planning.plan import Plan
from trajcli.trajectory import State

LIMITS = {
    "velocity": [[-9, 9], [-2, 1], [-1, 3]],
    "acceleration": [[-9, 9], [-8, 4], [-3, 6]],
    "jerk": [[-9, 9], [-60, 40], [-50, 90]],
    "position": [[-9, 9], [-1, 2], [-3, 4]],
}
"""Of three joints, each otherwise and by direction; the first one rests."""
POINTS = [{"joints": [0.5, 0.2, 0.4]}, {"joints": [0.5, 0.6, 0.1]}, {"joints": [0.5, 0.3, 0.7]}]


def job(through: list[dict[str, object]] = POINTS, **fields: object) -> dict[str, object]:
    limits = fields.pop("limits", LIMITS)
    move = {"planner": "waypoints", "starts": 1, "through": through, **fields}
    start = {"joints": [0.5, 0, 0]}
    return {"version": 1, "robot": {"joints": 3}, "limits": limits, "start": start, "moves": [move]}


@cache
def planned_once() -> Plan:
    """Return the plan of the job as it is."""
    return trajcli.plan(job())


def planner_of(through: list[dict[str, object]] = POINTS, **fields: object) -> object:
    return job_from_text(json.dumps(job(through, **fields))).job.moves[0]


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> Iterator[SimpleNamespace]:
    """Keep what the search was last asked."""
    kept = SimpleNamespace()

    def keeping(name: str) -> None:
        found = getattr(assembly, name)

        def search(problem: object, names: list[str], starts: int, known: object = None) -> object:
            kept.problem, kept.names, kept.starts, kept.known = problem, names, starts, known
            return found(problem, names, starts, *([] if known is None else [known]))

        monkeypatch.setattr(assembly, name, search)

    keeping("fastest_motion")
    keeping("straight_only")
    return kept


def test_the_joints_that_move_have_their_own_limits_and_what_is_given_of_them(asked: SimpleNamespace) -> None:
    """Of a jerk that differs by direction the smaller one counts, of all others both."""
    given = {"velocity": {"j3": -0.25}, "acceleration": {"j2": 0.5}}
    plan = trajcli.plan(job([POINTS[0], POINTS[1] | given, POINTS[2]]))
    problem = asked.problem
    assert asked.names == ["j2", "j3"]
    for name in ("velocity", "acceleration", "position"):
        np.testing.assert_array_equal(getattr(problem, name), LIMITS[name][1:])
    np.testing.assert_array_equal(problem.jerk, [40, 50])
    np.testing.assert_array_equal(problem.points, [[0, 0], *(each["joints"][1:] for each in POINTS)])
    assert problem.fixed[2].tolist() == [[False, True], [True, False]]
    assert problem.states[2].tolist() == [[0, 0.5], [-0.25, 0]]
    assert plan.verdict.passed


def test_the_joint_that_needs_the_time_is_named_among_all() -> None:
    """Only the second one goes far."""
    far = [{"joints": [0.5, 1.0, 0.01]}, {"joints": [0.5, 1.8, 0.0]}]
    certificate = trajcli.plan(job(far)).moves[0].planned.certificate
    assert certificate.joint == 1


@pytest.mark.parametrize("straight", [False, True])
def test_as_many_starts_are_tried_as_are_asked_for(straight: bool, asked: SimpleNamespace) -> None:
    trajcli.plan(job(starts=2, straight=straight))
    assert asked.starts == 2


def test_a_search_from_a_motion_begins_with_its_rates_at_the_points(asked: SimpleNamespace) -> None:
    plan = planned_once()
    planner, planned = plan.loaded.job.moves[0], plan.moves[0].planned
    again = planner.searched_from(planned).plan(
        State(np.array([0.5, 0, 0]), np.zeros(3), np.zeros(3)), plan.loaded.robot
    )
    times = np.minimum(planned.via_points.times, planned.curve.end)
    for order in (1, 2):
        rates = planned.curve.evaluate(times, order)[:, 1:]
        np.testing.assert_allclose(asked.known[:, :, order - 1], rates)
        assert np.abs(rates[1:-1]).max() > 0
    assert again.curve.duration <= planned.curve.duration * (1 + 1e-6)
    flown = replace(planned, parts=(SimpleNamespace(),))  # such a motion does not pass all of its points
    assert planner.searched_from(flown)._begun is None


@pytest.mark.parametrize("still", [False, True])
def test_points_that_are_left_out_are_told(still: bool) -> None:
    """Where all of them are one as well."""
    through = [{"joints": [0.5, 0, 0]}] * 2 if still else [POINTS[0], POINTS[0], POINTS[1]]
    events = trajcli.plan(job(through)).moves[0].planned.events
    both_ways = [] if still else ["jerk_limit_both_ways"]  # one of the limits differs by direction
    assert [event.kind for event in events] == ["merged", *both_ways]


def test_every_joint_without_a_limit_is_named() -> None:
    limits = LIMITS | {"jerk": [9, None, None]}
    with pytest.raises(MissingLimitError, match="j2, j3"):
        trajcli.plan(job(limits=limits))


def refusal(through: list[dict[str, object]], **fields: object) -> tuple[str, str]:
    """Return what is wrong, and the text where it stands."""
    with pytest.raises(TrajcliError) as caught:
        trajcli.plan_job(job_from_text(json.dumps(job(through, **fields))))
    (problem,) = caught.value.problems
    return problem.text(), problem.place.source[problem.place.column - 1 :]


@pytest.mark.parametrize("count", [2, 4])
def test_there_is_a_minimum_duration_for_each_segment(count: int, tmp_path: object) -> None:
    """Of recorded points, that is known when the file is read."""
    text, _ = refusal(POINTS, minimum_durations=[0.1] * count)
    assert f"expected 3 times, one for each segment from the start on, got {count}" in text
    (tmp_path / "points.csv").write_text("q1,q2,q3\n0.5,0.2,0.4\n0.5,0.6,0.1\n")
    said = job({"csv": "points.csv"}, to=POINTS[2], minimum_durations=[0.1] * count)
    (tmp_path / "job.json").write_text(json.dumps(said))
    with pytest.raises(TrajcliError, match=f"{count} minimum durations, but the recorded points make 3"):
        trajcli.plan(tmp_path / "job.json")


@pytest.mark.parametrize("at_target", [False, True])
def test_the_last_recorded_point_is_not_the_end_where_a_target_follows(
    at_target: bool, tmp_path: object
) -> None:
    """It is left out where it is next to the one before, or the target next to it."""
    last = "0.5,0.3,0.7" if at_target else "0.5,0.21,0.4"
    (tmp_path / "points.csv").write_text(f"q1,q2,q3\n0.5,0.2,0.4\n{last}\n")
    said = job({"csv": "points.csv", "merge": 0.05}, to=POINTS[2])
    (tmp_path / "job.json").write_text(json.dumps(said))
    planned = trajcli.plan(tmp_path / "job.json").moves[0].planned
    np.testing.assert_array_equal(planned.via_points.points[:, 1], [0, 0.2, 0.3])


def test_what_cannot_be_at_the_target_is_underlined_there() -> None:
    text, source = refusal(POINTS[:2], to=POINTS[2] | {"velocity": [0, 5, 0]})
    assert "5" in text
    assert source.startswith(("[0, 5", '"velocity"', '{"joints": [0.5, 0.3'))


@pytest.mark.parametrize("to", [False, True])
@pytest.mark.parametrize("k", [0, 1])
@pytest.mark.parametrize("name", ["velocity", "acceleration"])
@pytest.mark.parametrize("value", [0, 0.1])
def test_a_point_between_that_gives_a_rate_keeps_a_motion_from_flying_by(
    value: float, name: str, k: int, to: bool
) -> None:
    """A rate of zero as well: all of the points between have to be passed in it."""
    through = [dict(each) for each in POINTS]
    through[k][name] = {"j2": value}
    planner = planner_of(through[:2], to=through[2]) if to else planner_of(through)
    assert planner.why_not_flown_by == "a point between gives its velocity or acceleration"


def test_minimum_durations_and_polylines_are_not_flown_by() -> None:
    assert planner_of(minimum_durations=[0, 1, 0]).why_not_flown_by == "its `minimum_durations` are given"
    assert planner_of(straight=True).why_not_flown_by.startswith("it keeps to the polyline")
    assert planner_of().why_not_flown_by is None


@pytest.mark.parametrize("at_target", [False, True])
def test_a_time_is_underlined_where_it_stands(at_target: bool) -> None:
    through, target = [dict(each) for each in POINTS[:2]], dict(POINTS[2])
    (target if at_target else through[0])["time"] = 1.625
    text, source = refusal(through, to=target)
    assert "finds the times" in text
    assert source.startswith("1.625")


def test_times_of_a_recording_do_not_bind(tmp_path: object) -> None:
    """Nor must the target that comes after it have one."""
    (tmp_path / "points.csv").write_text("t,q1,q2,q3\n50,0.5,0.2,0.4\n90,0.5,0.6,0.1\n")
    (tmp_path / "job.json").write_text(json.dumps(job({"csv": "points.csv"}, to=POINTS[2])))
    timed, free = trajcli.plan(tmp_path / "job.json"), planned_once()
    assert timed.trajectory.duration == pytest.approx(free.trajectory.duration, rel=1e-6)


@pytest.mark.parametrize("straight", [False, True])
def test_phases_follow_each_other_to_the_end_with_the_jerk_that_they_name(straight: bool) -> None:
    plan = trajcli.plan(job(straight=True)) if straight else planned_once()
    planned = plan.moves[0].planned
    joints = {phase.joint for phase in planned.phases}
    assert joints == ({None} if straight else {1, 2})
    for joint in joints:
        own = [phase for phase in planned.phases if phase.joint == joint]
        assert (own[0].start, own[-1].end) == (0.0, pytest.approx(planned.curve.end))
        assert all(one.end == pytest.approx(other.start) for one, other in pairwise(own))
        for phase in own:
            jerk = planned.curve.evaluate((phase.start + phase.end) / 2, 3)[joint or slice(1, None)]
            assert (np.abs(jerk).max() > 1e-6) == phase.name.startswith("jerk")


def test_a_path_has_its_points_as_far_off_as_the_motion() -> None:
    plan = planned_once()
    planner, planned = plan.loaded.job.moves[0], plan.moves[0].planned
    missed = 1e-3 * np.arange(12.0).reshape(4, 3)
    off = replace(planned, via_points=replace(planned.via_points, missed=missed))
    course = planner.course(np.zeros(3), plan.loaded.robot, off)
    np.testing.assert_array_equal(course.passed.missed, missed[1:-1])
    np.testing.assert_array_equal(course.passed.points, [each["joints"] for each in POINTS[:2]])
    with pytest.raises(PlanningError, match="no path to follow"):
        planner.course(np.zeros(3), plan.loaded.robot, replace(planned, via_points=None))


@pytest.mark.parametrize(
    ("fields", "point", "said"),
    [
        ({"starts": 1}, {"velocity": {"turn": 50}}, "turn goes to 60.125 deg, beyond 58.5 deg"),
        ({"straight": True}, {"velocity": {"turn": 50, "other": 20}}, "velocity 50 deg/s of turn"),
        ({"straight": True}, {"velocity": {"turn": 57, "other": 5}}, "turn has velocity 57 deg/s"),
    ],
)
def test_numbers_of_joints_behind_one_that_rests_have_their_own_units(
    fields: dict[str, object], point: dict[str, object], said: str
) -> None:
    """Braking from 50 deg/s with 400 deg/s^2 and 4000 deg/s^3 takes 3.125 deg, from 57 deg on."""
    assert 57 + 50**2 / (2 * 400) == 60.125
    slide = {"name": "slide", "type": "prismatic"}
    turn = {"name": "turn"} if "straight" in fields else {"name": "turn", "position": [0, 58.5]}
    through = [{"joints": [100, 57, 5], **point}, {"joints": [100, 10, 10]}]
    made = {
        "version": 1,
        "units": {"angle": "deg", "length": "mm"},
        "robot": {"joints": [slide, turn, {"name": "other"}]},
        "limits": {"velocity": 100, "acceleration": 400, "jerk": 4000},
        "start": {"joints": [100, 0, 0]},
        "moves": [{"planner": "waypoints", "through": through, **fields}],
    }
    with pytest.raises(TrajcliError) as caught:
        trajcli.plan(made)
    assert said in caught.value.problems[0].text()
