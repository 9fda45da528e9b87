"""Points of moves as numbers: times in proportion, points that repeat the one before, and what goes with each."""

from __future__ import annotations

from typing import Any, cast

import numpy as np
import pytest
from through_jobs import job_text, refusal

from trajcli.errors import PlanningError
from trajcli.job.read import job_from_text
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.language.recorded import SAME_POSITION
from trajcli.language.targets import Target
from trajcli.planners.waypoints.through_points import PointTable, ThroughPoints
from trajcli.trajectory import State, resting

ORIGIN = {"joints": [0.0, 0.0]}
ROBOT = Robot("bare", (Joint("j1"), Joint("j2")), unlimited(2), None, np.eye(4), np.eye(4))
NEAR = 0.5 * SAME_POSITION


def planner(move: dict[str, Any]) -> ThroughPoints:
    """Return the planner of a move as it is read."""
    return cast("ThroughPoints", job_from_text(job_text(ORIGIN, {"planner": "spline", **move})).job.moves[0])


def table(move: dict[str, Any], start: State | None = None) -> PointTable:
    return planner(move).waypoints(resting(np.zeros(2)) if start is None else start, ROBOT)


def points(*times: float | None, **last: Any) -> list[dict[str, Any]]:
    """Return points, one for each time."""
    rows = [{"joints": [k + 1.0, -k]} | ({} if t is None else {"time": t}) for k, t in enumerate(times)]
    rows[-1] |= last
    return rows


@pytest.mark.parametrize("off", [4e-9, -4e-9, 1e-6, -1e-6, 0.3, -0.3])
def test_a_duration_is_the_time_of_the_last_point_to_a_billionth(off: float) -> None:
    through = points(1.0, 2.0)
    assert "is not the duration" in str(
        refusal(ORIGIN, {"planner": "spline", "through": through, "duration": 2.0 + off})
    )
    assert "is not the duration" in str(
        refusal(
            ORIGIN, {"planner": "spline", "through": through[:1], "to": through[1], "duration": 2.0 + off}
        )
    )
    assert table({"through": through, "duration": 2.0 + np.sign(off) * 1e-10}).count == 3
    assert table({"through": points(1.0, 2000.0), "duration": 2000.0 + np.sign(off) * 1e-6}).count == 3


@pytest.mark.parametrize(
    ("times", "at"),
    [((1.0, 1.0, 2.0), 1), ((1.0, 2.0, 2.0), 2), ((2.0, 1.0, 3.0), 1), ((1.0, 3.0, 2.0), 2)],
)
@pytest.mark.parametrize("last", ["through", "to", "duration"])
def test_times_increase_to_the_target(times: tuple[float, ...], at: int, last: str) -> None:
    move: dict[str, Any] = {"planner": "spline", "through": points(*times)}
    if last != "through":
        move["to"] = move["through"].pop()
        if last == "duration":
            move["duration"] = move["to"].pop("time")
    (problem,) = refusal(ORIGIN, move).problems
    assert f"times must increase, but {times[at]:g} s comes after {times[at - 1]:g} s" in problem.text()


@pytest.mark.parametrize("last", ["through", "to", "duration"])
def test_another_duration_moves_all_times_in_proportion(last: str) -> None:
    move: dict[str, Any] = {"through": points(1.0, 2.0, 4.0)}
    if last != "through":
        move["to"] = move["through"].pop()
        if last == "duration":
            move["duration"] = move["to"].pop("time")
    ((name, longer),) = planner(move).lasting(6.0)
    assert name == "`duration: 6`"
    found = longer.waypoints(resting(np.zeros(2)), ROBOT)
    np.testing.assert_allclose(cast("Any", found.times), [0.0, 1.5, 3.0, 6.0])
    if last == "to":
        assert cast("Any", longer.to).time == 6.0


RECORDED = {"positions": [[1.0, 0.0], [2.0, -1.0]], "times": [1.0, 2.0]}


def test_another_duration_moves_the_times_of_a_recording() -> None:
    longer = planner({"through": RECORDED, "to": {"joints": [0.0, 0.0], "time": 4.0}}).with_duration(6.0)
    found = longer.waypoints(resting(np.zeros(2)), ROBOT)
    np.testing.assert_allclose(cast("Any", found.times), [0.0, 1.5, 3.0, 6.0])
    alone = planner({"through": RECORDED}).with_duration(6.0).waypoints(resting(np.zeros(2)), ROBOT)
    np.testing.assert_allclose(cast("Any", alone.times), [0.0, 3.0, 6.0])
    assert alone.events == ()


@pytest.mark.parametrize(("time", "late"), [(1.5, True), (2.0, True), (2.5, False)])
@pytest.mark.parametrize("stated", ["time", "duration"])
def test_the_target_comes_after_the_last_recorded_point(time: float, late: bool, stated: str) -> None:
    to: dict[str, Any] = {"joints": [0.0, 0.0]}
    move: dict[str, Any] = {"through": RECORDED, "to": to}
    (to if stated == "time" else move)[stated] = time
    if not late:
        np.testing.assert_allclose(cast("Any", table(move).times), [0.0, 1.0, 2.0, time])
        return
    with pytest.raises(PlanningError, match=f"after {time:g} s, the last recorded point after 2 s"):
        table(move)


@pytest.mark.parametrize(("first", "apart"), [([1.0, 0.0], True), ([0.0, 0.0], False), ([0.0, -0.25], True)])
def test_a_recording_that_begins_at_once_begins_where_the_arm_stands(first: list[float], apart: bool) -> None:
    move = {"through": {"positions": [first, [2.0, -1.0]], "times": [0.0, 2.0]}}
    if not apart:
        assert table(move).positions.tolist() == [[0.0, 0.0], [2.0, -1.0]]
        return
    with pytest.raises(PlanningError, match="not where the arm then stands") as caught:
        table(move)
    assert caught.value.problems[0].amounts["joint"] == ("j1" if first[0] else "j2")


def test_a_target_with_a_time_needs_points_with_times() -> None:
    """None of them is passed over in silence."""
    move = {"planner": "spline", "through": points(None, None), "to": {"joints": [3.0, 3.0], "time": 3.0}}
    assert "has no `time`, others have" in str(refusal(ORIGIN, move))


@pytest.mark.parametrize("listed", [True, False])
def test_poses_become_joints_each_near_to_the_point_before_it(listed: bool) -> None:
    """After a recording that is its last point; what else is said of a point stays with it."""
    pose = {"xyz": [0.1, 0.2, 0.3], "rpy": [0.0, 0.0, 0.0]}
    move: dict[str, Any] = {"planner": "blends", "blend_durations": 0.1}
    if listed:
        first = [point | {"blend": 0.125} for point in points(1.0, 2.0)]
        move |= {"through": [*first, pose | {"time": 3.0, "blend": 0.25}, pose | {"time": 4.0, "blend": 0.5}]}
    else:
        recorded = {"positions": [[1.0, 0.0], [2.0, -1.0]], "times": [1.0, 2.0]}
        move |= {"through": recorded, "to": pose | {"time": 3.0}}
    nears: list[list[float]] = []

    def resolve(point: Any, near: np.ndarray) -> Target:
        if not point.gives_pose:
            return cast("Target", point)
        nears.append(near.tolist())
        return Target(joints=(near + 1.0).tolist())

    found = planner(move).with_joint_targets(resolve, np.array([9.0, 9.0]))
    assert nears == ([[2.0, -1.0], [3.0, 0.0]] if listed else [[2.0, -1.0]])
    last = found.listed[2:] if listed else found.listed
    assert [point.as_state().position.tolist() for point in last] == [[3.0, 0.0], [4.0, 1.0]][: len(last)]
    assert [point.time for point in last] == [3.0, 4.0][: len(last)]
    filled = found.waypoints(resting(np.zeros(2)), ROBOT)
    assert filled.blends.tolist() == ([0.0, 0.125, 0.125, 0.25, 0.5] if listed else [0.0] * 4)


@pytest.mark.parametrize(("to", "name"), [(True, "target"), (False, "waypoint 1")])
def test_a_pose_that_is_not_reached_is_named_by_its_place(to: bool, name: str) -> None:
    pose = {"xyz": [0.1, 0.2, 0.3]}
    last = {"to": pose} if to else {}
    through = points(None) if to else [*points(None), pose]

    def resolve(point: Any, near: np.ndarray) -> Target:
        del near
        if point.gives_pose:
            raise PlanningError("out of reach")
        return cast("Target", point)

    move = planner({"planner": "time_optimal", "through": through, **last})
    with pytest.raises(PlanningError, match=f"^{name}: out of reach"):
        move.with_joint_targets(resolve, np.zeros(2))


def test_a_recording_of_the_row_where_the_arm_stands_leaves_nothing_to_do() -> None:
    with pytest.raises(PlanningError, match="the recording has one row, where the arm stands, at t = 0 s"):
        table({"through": {"positions": [[0.0, 0.0]], "times": [0.0]}})


def test_a_recording_that_begins_elsewhere_says_where_by_joint() -> None:
    with pytest.raises(PlanningError) as caught:
        table({"through": {"positions": [[0.0, -0.25], [2.0, -1.0]], "times": [0.0, 2.0]}})
    amounts = caught.value.problems[0].amounts
    assert [(amounts[key].value, amounts[key].joint) for key in ("there", "here", "distance")] == [
        (-0.25, 1),
        (0.0, 1),
        (0.25, 1),
    ]


def test_what_is_given_goes_with_its_point() -> None:
    start = State(np.zeros(2), np.array([0.1, 0.2]), np.array([0.3, 0.4]))
    through = points(None, None, None, None)
    through[1] |= {"velocity": [0.5, 0.6]}
    through[2] |= {"acceleration": [-0.5, -0.6]}
    through[3] |= {"velocity": [1.5, 1.6], "acceleration": [1.7, 1.8]}
    found = table({"rule": "quintic", "through": through}, start)
    zero = [0.0, 0.0]
    np.testing.assert_array_equal(found.rates[0], [[0.1, 0.2], zero, [0.5, 0.6], zero, [1.5, 1.6]])
    np.testing.assert_array_equal(found.rates[1], [[0.3, 0.4], zero, zero, [-0.5, -0.6], [1.7, 1.8]])
    np.testing.assert_array_equal(found.given, [[1, 0, 1, 0, 1], [1, 0, 0, 1, 1]])
    np.testing.assert_array_equal(found.target.velocity, [1.5, 1.6])
    np.testing.assert_array_equal(found.target.acceleration, [1.7, 1.8])


@pytest.mark.parametrize(
    ("places", "kept"),
    [
        ([0, 1, 1, 2], [0, 1, 3]),
        ([0, 0, 1, 2], [0, 2, 3]),
        ([0, 1, 2, 2], [0, 1, 3]),  # the target stays
        ([0, 0, 1, 1], [0, 3]),
        ([0, 1, 1, 1, 2, 2, 1], [0, 1, 4, 6]),
        ([0, 0, 0], [0, 2]),
        ([0, 0], [0, 1]),
        ([0, 1, 0], [0, 1, 2]),
    ],
)
def test_points_that_repeat_the_one_before_are_left_out_with_all_that_is_theirs(
    places: list[int], kept: list[int]
) -> None:
    through = [
        {"joints": [place, -place + NEAR * (k % 2)]} | ({"velocity": [0.01 * k, 0.02 * k]} if k % 3 else {})
        for k, place in enumerate(places)
    ]
    stated = np.arange(len(places)) % 3 > 0
    found = table({"rule": "quintic", "through": through[1:]})
    np.testing.assert_array_equal(found.positions, [[0.0, 0.0], *([through[k]["joints"] for k in kept[1:]])])
    np.testing.assert_array_equal(
        found.rates[0], [[0.01 * k * stated[k], 0.02 * k * stated[k]] for k in kept]
    )
    np.testing.assert_array_equal(found.given[0], [True, *stated[kept[1:]]])
    np.testing.assert_array_equal(found.given[1], [True, *[False] * (len(kept) - 1)])
    assert found.blends.shape == (len(kept),)
    count = len(places) - len(kept)
    told = [event.message for event in found.events]
    assert told == (
        [f"left out {count} waypoint{'s that repeat' if count > 1 else ' that repeats'} the one before"]
        * (count > 0)
    )


@pytest.mark.parametrize("step", [[1.0, 0.0], [0.0, -1.0], [-1.0, 0.0], [-2 * SAME_POSITION, 0.0]])
def test_one_joint_that_moves_either_way_makes_another_point(step: list[float]) -> None:
    rows = np.cumsum([[1.0, 1.0], step, [1.0, 1.0]], axis=0)
    assert table({"through": [{"joints": row} for row in rows.tolist()]}).count == 4


def test_points_with_times_may_stand_still() -> None:
    through = [{"joints": [1.0, 1.0], "time": float(t)} for t in (1, 2, 3)]
    assert table({"through": through}).count == 4


@pytest.mark.parametrize("target", [{}, {"to": {"joints": [3.0, 0.0]}}])
@pytest.mark.parametrize(
    ("rows", "dropped"),
    [
        ([0.0, 1.0, 2.0], 0),
        ([1.0, 2.0], 0),
        ([0.0, 1.0, 1.0, 2.0], 1),
        ([1.0, 1.0, 1.0, 2.0], 2),
        ([0.0, 0.0, 2.0], 1),
    ],
)
def test_what_is_left_out_of_a_recording_is_counted(
    rows: list[float], dropped: int, target: dict[str, Any]
) -> None:
    """Its first row is where the arm stands, and is no point of its own."""
    found = table({"through": {"positions": [[row, 0.0] for row in rows]}, **target})
    kept = [*dict.fromkeys([0.0, *rows, *([3.0] if target else [])])]
    assert found.positions[:, 0].tolist() == kept
    told = [event.message for event in found.events]
    assert [text[: text.index(" points")] for text in told] == [f"left out {dropped} of {len(rows)}"] * (
        dropped > 0
    )
