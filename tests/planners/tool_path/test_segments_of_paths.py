"""Paths of segments before any joint follows: their corners, events, places of targets, and steps of their speeds."""

from __future__ import annotations

from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from tool_jobs import DOWN, job_text, refusal

from trajcli.errors import TrajcliError
from trajcli.geometry.paths.position import Line
from trajcli.job.read import job_from_text
from trajcli.kinematics.robot import ToolLimits
from trajcli.planners.tool_path.move import PlannedPath
from trajcli.planners.tool_path.segments import corner_radii, stepping_speeds, turning_back

HERE = {"xyz": [0.4, 0.1, 0.3], "rpy": DOWN}
POINTS = np.array([[0.4, 0.1, 0.3], [0.4, 0.3, 0.3], [0.5, 0.3, 0.3], [0.5, 0.2, 0.4]])
BEFORE = np.array([[1.0, 0, 0, 0.4], [0, -1, 0, 0.1], [0, 0, -1, 0.3], [0, 0, 0, 1]])


def line(place: Any, **fields: Any) -> dict[str, Any]:
    return {"line": {"xyz": np.asarray(place).tolist()}, **fields}


def path_of(
    *segments: dict[str, Any], before: np.ndarray = BEFORE, robot: str = "ur5e", **fields: Any
) -> PlannedPath:
    """Return the path of a move from a pose."""
    move = {"planner": "path", "segments": list(segments), "corner": "stop", **fields}
    loaded = job_from_text(job_text(robot, HERE, move))
    return loaded.job.moves[0].path_from(before, loaded.robot)  # type: ignore[attr-defined, no-any-return]


def kinds(planned: PlannedPath) -> list[str]:
    return [event.kind for event in planned.events]


def test_each_segment_ends_where_its_target_is_and_names_it() -> None:
    """The field of each target, and s where the path is there; a doubled point has none of its own."""
    planned = path_of(*(line(POINTS[k]) for k in (1, 1, 2, 3)))
    s = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(POINTS, axis=0), axis=1))])
    assert [field for field, _ in planned.targets] == [("segments", k, "line") for k in (0, 2, 3)]
    np.testing.assert_allclose([at for _, at in planned.targets], s[1:], rtol=1e-14)
    np.testing.assert_allclose(planned.path.poses.evaluate(s)[0][:, :3, 3], POINTS, atol=1e-15)
    assert kinds(planned) == ["merged"]


def test_an_arc_of_an_angle_has_no_target_and_one_to_a_point_has() -> None:
    quarter = {"arc": {"center": [0.5, 0.3, 0.3], "axis": "z", "angle": np.pi / 2}}
    back = {"arc": {"center": [0.5, 0.3, 0.3], "to": {"xyz": [0.6, 0.3, 0.3]}}}
    planned = path_of(line(POINTS[1]), quarter, back)
    assert [field for field, _ in planned.targets] == [("segments", 0, "line"), ("segments", 2, "arc", "to")]


def test_what_is_conceded_is_said_in_one_list() -> None:
    back, aside = line([0.4, 0.2, 0.3]), line([0.45, 0.2, 0.3], radius=0)
    beside = {"arc": {"center": [0.4500001, 0.25, 0.3], "to": {"xyz": [0.5, 0.25, 0.3]}}}
    planned = path_of(line(POINTS[1]), line(POINTS[1]), back, aside, beside, corner="round", radius=0.5)
    assert kinds(planned) == ["merged", "turns_back", "moved_center", "shrunk"]
    assert "behind segment 0" in planned.events[1].message
    assert "corner 2 " in planned.events[3].message  # in the first one it turns back


@pytest.mark.parametrize("count", [8, 9])
def test_of_many_corners_that_are_shrunk_the_one_that_is_shrunk_most_is_told(count: int) -> None:
    x = np.cumsum([0.0, *np.linspace(0.02, 0.01, count + 1)])
    ends = [[0.4 + at, 0.1 + 0.01 * (k % 2), 0.3] for k, at in enumerate(x.tolist())]
    planned = path_of(*(line(end) for end in ends[1:]), corner="round", radius=0.05)
    shrunk = [event for event in planned.events if event.kind == "shrunk"]
    used = [corner.used for corner in planned.path.poses.position.corners]  # type: ignore[union-attr]
    assert len(used) == count
    if count == 8:
        assert [event.amounts["used"].value for event in shrunk] == used  # type: ignore[union-attr]
        return
    (event,) = shrunk
    assert event.amounts["used"].value == min(used)  # type: ignore[union-attr]
    assert event.message.endswith(f"{count - 1} more corners likewise, by less")


def test_what_an_event_says_of_a_shrunk_corner_is_where_the_path_passes() -> None:
    planned = path_of(line(POINTS[1]), line(POINTS[2]), corner="round", radius=0.5)
    (event,) = planned.events
    places = planned.path.poses.evaluate(np.linspace(0.0, planned.path.length, 20001))[0][:, :3, 3]
    near = np.linalg.norm(places - POINTS[1], axis=1)
    amounts: dict[str, Any] = dict(event.amounts)
    assert amounts["by"].value == pytest.approx(near.min(), abs=1e-8)
    assert amounts["asked"].value == 0.5
    begins = np.linalg.norm(places[np.abs(places[:, 0] - 0.4) > 1e-9][0] - POINTS[1])
    assert amounts["used"].value == pytest.approx(begins, rel=2e-2)


def test_a_tool_that_keeps_its_attitude_to_the_path_would_jump_at_the_first_corner() -> None:
    with pytest.raises(TrajcliError, match=r"at the corner at s = 0\.2 m"):
        path_of(*(line(point) for point in POINTS[1:]), orientation="tangent")


@pytest.mark.parametrize("robot", ["ur5e", "planar3r"])
def test_an_orientation_that_follows_from_the_path_is_fixed_whole(robot: str) -> None:
    planned = path_of(line([0.3, 0.1, 0.3]), robot=robot, orientation="tangent")
    assert planned.path.orientation == "all"


def test_a_single_segment_overlaps_nothing_and_more_are_no_path_that_could_be_flown_by() -> None:
    fields = {"corner": "overlap", "overlap": 0.1, "law": {"speed": 0.1, "acceleration": 1.0}}
    assert path_of(line(POINTS[1]), line(POINTS[1]), **fields).overlap is None
    both = path_of(line(POINTS[1]), line(POINTS[2]), **fields)
    assert both.overlap is not None
    assert both.overlap.overlaps
    move = {"planner": "path", "segments": [line(POINTS[1]), line(POINTS[2])]}
    for given, reason in (({**move, **fields}, "overlap in time"), ({**move, "corner": "stop"}, None)):
        (planner,) = job_from_text(job_text("ur5e", HERE, given)).job.moves
        assert (planner.why_not_flown_by is None) == (reason is None)
        assert reason is None or reason in str(planner.why_not_flown_by)


def test_joints_are_pinned_in_the_last_segment_alone() -> None:
    pinned = {"line": {"xyz": POINTS[1].tolist(), "joints": {"wrist_3_joint": 0.1}}}
    assert path_of(line(POINTS[2]), pinned).path.length > 0
    with pytest.raises(TrajcliError, match="a joint is pinned in segment 1") as caught:
        path_of(line(POINTS[2]), pinned, line(POINTS[3]))
    assert caught.value.problems[0].field == ("segments", 1)


def test_the_configuration_of_the_last_target_is_that_of_the_path() -> None:
    named = {"configuration": {"elbow": "up"}}
    quarter = {"center": [0.5, 0.3, 0.3], "to": {"xyz": [0.5, 0.2, 0.3], **named}}
    for last in ({"line": {"xyz": POINTS[2].tolist(), **named}}, {"arc": quarter}):
        configuration = path_of(line(POINTS[1]), last).configuration
        assert configuration is not None
        assert configuration.branch_names == {"elbow": "up"}
        assert path_of(last if "line" in last else line(POINTS[1]), line(POINTS[3])).configuration is None


def test_a_yaw_changes_by_what_each_of_its_segments_says() -> None:
    yaws = [0.1, 0.5, -0.3, 0.4]
    ahead = np.eye(4)
    c, s = np.cos(yaws[0]), np.sin(yaws[0])
    ahead[:3] = [[0, -s, c, 0.4], [0, c, s, 0.1], [-1, 0, 0, 0.3]]  # z of the tool is level
    ends = [{"line": {"xyz": p.tolist(), "yaw": yaw}} for p, yaw in zip(POINTS[1:], yaws[1:], strict=True)]
    planned = path_of(*ends, before=ahead)
    np.testing.assert_allclose(planned.path.angle_changes, np.diff(yaws), atol=1e-12)


@pytest.mark.parametrize(
    "other", [{"direction": [0, 0, -1]}, {"direction": [1, 0, 0], "tool_axis": "x"}, {"rpy": DOWN}]
)
def test_segments_fix_the_same_part_of_the_orientation_by_the_same_axis(other: dict[str, Any]) -> None:
    first = {"xyz": POINTS[1].tolist(), "direction": [0, 0, -1]}
    segments = [{"line": first}, {"line": {"xyz": POINTS[2].tolist(), **other}}]
    if other == {"direction": [0, 0, -1]}:
        assert path_of(*segments).path.orientation == "direction"
        return
    with pytest.raises(TrajcliError, match="segment 1 fixes another part"):
        path_of(*segments)


def test_a_line_that_turns_the_tool_in_its_place_is_no_doubled_point() -> None:
    turn = {"line": {"xyz": POINTS[1].tolist(), "rpy": [np.pi, 0, 1e-4]}}
    with pytest.raises(TrajcliError, match=r"segment 1: .* has no direction"):
        path_of(line(POINTS[1]), turn, line(POINTS[2]))
    near = line(POINTS[1] + [0.0, 1e-7, 0.0])
    assert kinds(path_of(line(POINTS[1]), near, line(POINTS[2]))) == []
    ends = (line(POINTS[0]), line(POINTS[1]), line(POINTS[1]))
    assert kinds(path_of(*ends)) == ["merged"]
    with pytest.raises(TrajcliError, match=r"segment 0: .* has no direction"):
        path_of(ends[0])


@pytest.mark.parametrize(
    ("move", "said"),
    [
        ({"segments": [{}]}, "either a `line` or an `arc`"),
        ({"segments": [{"line": {**HERE, "velocity": 0.1}}]}, "a segment ends at rest"),
        (
            {"segments": [line(POINTS[1], law={})], "law": {"shape": "time_optimal"}},
            "gives `speed`, `angular",
        ),
        ({"segments": [line(POINTS[1], radius=0.1), line(POINTS[2])]}, "corner: stop has no radius"),
        (
            {
                "segments": [line(POINTS[1]), line(POINTS[2])],
                "corner": "overlap",
                "overlap": 0.1,
                "weave": {"amplitude": 0.01, "length": 0.05},
            },
            "no path to weave about",
        ),
        (
            {
                "segments": [line(POINTS[1]), line(POINTS[2])],
                "corner": "overlap",
                "overlap": 0.1,
                "orientation": "tangent",
            },
            "tangent is not defined where",
        ),
    ],
)
def test_fields_of_segments_that_do_not_fit_are_refused(move: dict[str, Any], said: str) -> None:
    error = refusal("ur5e", HERE, {"planner": "path", "corner": "stop", **move})
    (problem,) = error.problems
    assert said in problem.text()


def test_the_radius_of_the_move_or_of_each_segment_but_the_last_is_enough() -> None:
    for segments, fields in (
        ([line(POINTS[1], radius=0.01), line(POINTS[2])], {}),
        ([line(POINTS[1]), line(POINTS[2])], {"radius": 0.01}),
        ([line(POINTS[1])], {}),
    ):
        planned = path_of(*segments, corner="round", **fields)
        corners = planned.path.poses.position.corners  # type: ignore[union-attr]
        assert [corner.used for corner in corners] == [0.01] * (len(segments) - 1)
    error = refusal("ur5e", HERE, {"planner": "path", "segments": [line(p) for p in POINTS[1:]]})
    assert ["after this segment" in problem.message for problem in error.problems] == [True, True]


def test_the_radius_of_a_corner_is_the_least_that_is_given_between_its_segments() -> None:
    radii = (None, 0.3, 0.2, 0.2, 0.3, None, 0.5, None)
    given = [SimpleNamespace(radius=radius) for radius in radii]
    assert corner_radii(given, [0, 1, 3, 5, 7], 0.1) == [0.1, 0.2, 0.2, 0.5]  # type: ignore[arg-type]


def law_of(speed: float | None, angular_speed: float | None) -> Any:
    law = SimpleNamespace(speed=speed, angular_speed=angular_speed)
    return SimpleNamespace(law=None if speed is angular_speed is None else law)


def test_speeds_step_where_those_of_neighbours_differ() -> None:
    """What a segment does not say the law of the move does, and else the limits of the tool."""
    laws = [
        law_of(0.1, None),
        law_of(0.1, None),
        law_of(9, 9),
        law_of(0.1, 2.0),
        law_of(None, 2.0),
        law_of(None, None),
    ]
    kept = [0, 1, 3, 4, 5]  # the third one has no length
    borders = np.array([0.0, 0.5, 1.0, 1.25, 2.0, 3.0])
    limits = ToolLimits(speed=0.7, angular_speed=5.0)
    for speed, angular in ((0.4, None), (None, 3.0), (None, None)):
        own = SimpleNamespace(speed=speed, angular_speed=angular)
        found = stepping_speeds(laws, kept, borders, own, limits)  # type: ignore[arg-type]
        assert found is not None
        other, turning = speed or 0.7, angular or 5.0
        np.testing.assert_array_equal(found.speed, [0.1, 0.1, other, other])
        np.testing.assert_array_equal(found.angular_speed, [turning, 2.0, 2.0, turning])
        np.testing.assert_array_equal(found.borders, [0.0, 1.0, 1.25, 2.0, 3.0])
        assert found.segments == (0, 3, 4, 5, 6)
    assert stepping_speeds([laws[5]] * 2, [0, 1], borders[:3], own, limits) is None  # type: ignore[arg-type]


def test_a_path_stops_where_it_turns_back_and_nowhere_else() -> None:
    places = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 0.5, 0], [1, 0, 0], [1, 1, 0.0]])
    curves = [Line(*pair) for pair in pairwise(places)]
    left, events = turning_back(curves, [0.1, 0.2, 0.3, 0.0], [0, 2, 3, 5, 6])
    assert left == [0.1, 0.0, 0.3, 0.0]
    assert [event.message for event in events] == ["the path turns back behind segment 2, and stops there"]


def test_a_law_of_one_segment_is_refused_where_the_law_is_one() -> None:
    error = refusal(
        "ur5e", HERE, {"planner": "path", "segments": [line(POINTS[1], law={"angular_speed": 1})]}
    )
    assert "a trapezoid law is one for the whole path" in str(error)


def test_where_segments_overlap_a_yaw_is_that_of_the_poses_and_its_rate_that_of_its_change() -> None:
    """The heading of the tool's x axis, by arctan2, over two changes of it."""
    places = zip(POINTS[1:3], (0.5, -0.2), strict=True)
    segments = [{"line": {"xyz": p.tolist(), "yaw": yaw, "tool_axis": "x"}} for p, yaw in places]
    law = {"speed": 0.1, "acceleration": 1.0, "angular_speed": 1.0, "angular_acceleration": 9.0}
    turned = BEFORE.copy()
    turned[:3, :3] = Rotation.from_euler("z", 0.3).as_matrix() @ BEFORE[:3, :3]
    motion = path_of(*segments, before=turned, corner="overlap", overlap=0.1, law=law).overlap
    assert motion is not None
    times = np.linspace(0.0, motion.law.end, 60)
    found = motion.reference(times)
    np.testing.assert_allclose(
        found.aims[:, 0], np.arctan2(found.poses[:, 1, 0], found.poses[:, 0, 0]), atol=1e-12
    )
    np.testing.assert_allclose(found.aims[:, 1], found.first[:, 5], atol=1e-12)
