"""The points that moves pass: listed, named, as poses, from a file; and a job of them written out."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml
from through_jobs import assert_passes, curve_of, job_text, plan, refusal
from tiers import few

from trajcli.errors import FileError, TrajcliError
from trajcli.job.dump import dump_job
from trajcli.job.read import job_from_text, load_job
from trajcli.kinematics.forward import forward
from trajcli.language.recorded import Recorded
from trajcli.planning.plan import plan_job

LIMITS = {"velocity": 2, "acceleration": 8}
PLANNERS = ["spline", "blends", "time_optimal"]


def recorded(folder: Path, text: str, move=None, **rest):
    """Plan a job whose points stand in a file beside it."""
    (folder / "points.csv").write_text(text)
    fields = {"planner": "spline", "through": {"csv": "points.csv"}, **(move or {})}
    start = rest.pop("start", {"joints": [0, 0]})
    job = folder / "job.json"
    job.write_text(job_text(start, fields, **{"limits": LIMITS, **rest}))
    return plan_job(load_job(job))


def wrong_file(folder: Path, text: str | None, **rest) -> str:
    with pytest.raises(TrajcliError) as caught:
        recorded(folder, text or "", **rest)
    (problem,) = caught.value.problems
    assert problem.place is not None
    assert caught.value.exit_code in (2, 3)
    return f"{problem.text()} ({problem.hint})"


def test_units_stand_in_the_columns_names(tmp_path):
    robot = {"joints": [{"name": "turn"}, {"name": "lift", "type": "prismatic"}]}
    text = "lift_mm,t,q1_deg\n0,0,0\n500,1,90\n100,3,-180\n"
    made = recorded(tmp_path, text, robot=robot, limits={}, units={"length": "mm"})
    assert_passes(made, [0, 1, 3], [[0, 0], [np.pi / 2, 0.5], [-np.pi, 0.1]])
    si = recorded(
        tmp_path, "t,lift,turn\n0,0,0\n1,0.5,1\n3,0.1,2\n", robot=robot, limits={}, units={"angle": "deg"}
    )
    assert_passes(
        si, [0, 1, 3], [[0, 0], [1, 0.5], [2, 0.1]]
    )  # a plain name is SI whatever the job's units are


@pytest.mark.parametrize(
    "columns", ["t,q1,q2", "t,q1_mm,q2_mm", "t,x,y", "t,q1,q2,x,y,z,qw,qx,qy,qz", "x_mm,y,z,q2,q1,t"]
)
def test_joints_of_a_slide_may_be_called_as_the_tool_moves(tmp_path, columns):
    """Beside numbered columns x, y, z are the tool's, as `plan` writes them; alone they are the joints' own."""
    robot = {"joints": [{"name": "x", "type": "prismatic"}, {"name": "y", "type": "prismatic"}]}
    points = [[0.0, 0.0], [0.5, 0.25], [1.0, -0.5]]
    names = columns.split(",")
    first, second = ("q1", "q2") if "q1" in columns else ("x", "y")

    def cell(name, k):
        plain, mm = name.removesuffix("_mm"), 1000 if name.endswith("_mm") else 1
        return {"t": k, first: points[k][0], second: points[k][1]}.get(plain, 7.0 + k) * mm

    rows = [columns, *(",".join(str(cell(name, k)) for name in names) for k in range(3))]
    made = recorded(tmp_path, "\n".join(rows) + "\n", robot=robot, limits={})
    assert_passes(made, [0, 1, 2], points)


def test_times_count_from_the_first_row_where_the_arm_stands(tmp_path):
    made = recorded(tmp_path, "t,q1,q2\n10,0,0\n11,1,0\n13,1,1\n")
    assert made.moves[0].planned.via_points.times.tolist() == [0, 1, 3]
    elsewhere = recorded(tmp_path, "t,q1,q2\n1,1,0\n3,1,1\n", limits={"velocity": 5})
    assert elsewhere.moves[0].planned.via_points.times.tolist() == [0, 1, 3]
    halved = recorded(tmp_path, "t,q1,q2\n10,0,0\n11,1,0\n13,1,1\n", {"duration": 1.5}, limits={})
    assert halved.moves[0].planned.via_points.times.tolist() == [0, 0.5, 1.5]


def test_a_target_after_the_recording(tmp_path):
    to = {"to": {"joints": [0, 0], "time": 4}}
    made = recorded(tmp_path, "t,q1,q2\n0,0,0\n1,1,0\n3,1,1\n", to)
    assert_passes(made, [0, 1, 3, 4], [[0, 0], [1, 0], [1, 1], [0, 0]])
    free = recorded(tmp_path, "q1,q2\n0,0\n1,0\n1,1\n", {"to": {"joints": [1, 1]}})
    assert len(free.moves[0].planned.via_points.times) == 3, "the last row and the target are one point"


@pytest.mark.full
@pytest.mark.parametrize("planner", [*PLANNERS, "waypoints"])
def test_repeated_rows_are_left_out_and_told(tmp_path, planner):
    text = "q1,q2\n0,0\n0,0\n0.5,0\n0.5,0.0005\n1,1\n1,1\n"
    limits = LIMITS if planner in PLANNERS else {**LIMITS, "jerk": 50}
    made = recorded(tmp_path, text, {"planner": planner}, limits=limits)
    (told,) = [event.message for event in made.events if event.kind == "merged"]
    assert told.startswith("left out 2 of 6 points of ")
    assert told.endswith("points.csv: too near to the one before")
    move = {"planner": planner, "through": {"csv": "points.csv", "merge": 0.001}}
    made = recorded(tmp_path, text, move, limits=limits)
    assert "left out 3 of 6" in made.events[0].message
    np.testing.assert_allclose(made.moves[0].planned.via_points.points, [[0, 0], [0.5, 0], [1, 1]])


def test_near_is_an_angle_or_a_length_as_the_joint_is(tmp_path):
    robot = {"joints": [{"name": "turn"}, {"name": "lift", "type": "prismatic"}]}
    text = "turn_deg,lift_mm\n10,0\n10.4,0.4\n11,0\n11,0.6\n20,5\n"
    move = {"through": {"csv": "points.csv", "merge": 0.5}}
    made = recorded(tmp_path, text, move, robot=robot, units={"angle": "deg", "length": "mm"})
    left = made.moves[0].planned.via_points.points / [np.pi / 180, 1e-3]
    np.testing.assert_allclose(left, [[0, 0], [10, 0], [11, 0], [11, 0.6], [20, 5]], atol=1e-9)


def test_the_end_of_a_recording_is_kept_even_where_it_is_near(tmp_path):
    text = "q1,q2\n0,0\n1,0\n2,0\n2.001,0\n"
    made = recorded(tmp_path, text, {"through": {"csv": "points.csv", "merge": 0.01}})
    np.testing.assert_array_equal(made.trajectory.end.position, [2.001, 0])
    np.testing.assert_allclose(made.moves[0].planned.via_points.points, [[0, 0], [1, 0], [2.001, 0]])


def test_standing_still_may_be_meant_where_rows_have_times(tmp_path):
    text = "t,q1,q2\n0,0,0\n1,0,0\n2,1,1\n3,1,1\n"
    made = recorded(tmp_path, text, {"rule": "shape_preserving"}, limits={})
    assert not made.events
    np.testing.assert_allclose(curve_of(made).evaluate(np.linspace(0, 1, 9)), 0, atol=1e-15)
    fast = recorded(tmp_path, text, {"planner": "time_optimal"})  # has no use for the times
    assert "left out 2 of 4" in fast.events[0].message
    assert fast.trajectory.duration < 1.5


def test_one_row_is_a_target(tmp_path):
    made = recorded(tmp_path, "q1,q2\n1,1\n")
    np.testing.assert_array_equal(made.trajectory.end.position, [1, 1])
    held = recorded(tmp_path, "q1,q2\n0,0\n", {"duration": 2})
    assert held.trajectory.duration == 2
    assert "comes" not in wrong_file(tmp_path, "t,q1,q2\n0,0,0\n")


WRONG_FILES = {
    "": "points.csv is empty (a CSV begins with",
    "q1,q2\n": "points.csv:1:1: the file has no rows",
    "q1\n0\n1\n": "points.csv:1:1: robot has 2 joints, and there is no column q2 (columns are called q1 in SI",
    "q1,q2,q3_deg\n0,0,0\n": "points.csv:1:7: q3_deg is the column of joint 3, robot has 2",
    "q1,q2\n0,0\n1\n": "points.csv:3:1: the line has 1 values, expected 2",
    "q1,q2\n0,0\n1,x\n": "points.csv:3:3: q2 is 'x', expected a finite number",
    "q1,q2\n0,0\n1,nan\n": "q2 is 'nan', expected a finite number",
    "q1,q1_deg,q2\n0,0,0\n": "q1_deg and q1 are columns of the same joint",
    "q1,j1,q2\n0,0,0\n": "j1 and q1 are columns of the same joint",
    "q1,q2_mm\n0,0\n": "q2_mm cannot be in mm: j2 is revolute (expected q2 or q2_deg)",
    "t,q1,q2\n0,0,0\n1,1,1\n1,2,2\n": "times must increase, but row 3 has t = 1 s after 1 s (remove the rows",
    "time,q1,q2\n1,1,0\n2,1,1\n": "times stand in the column t, in s; this file has 'time' (call it t",
    "T_ms,q1,q2\n1,1,0\n2,1,1\n": "this file has 'T_ms'",
    "t,q1,q2\n0,1,0\n1,1,1\n": "the recording begins at t = 0 s, but not where the arm then stands: it has j1 at 1 rad, the arm at 0 rad, 1 rad apart (go to",
}


@pytest.mark.parametrize(("text", "message"), WRONG_FILES.items(), ids=map(repr, WRONG_FILES))
def test_a_wrong_file_is_one_clear_error(tmp_path, text, message):
    told = wrong_file(tmp_path, text)
    assert message in told
    assert "\n" not in told


def test_a_missing_file_names_the_path(tmp_path):
    with pytest.raises(FileError) as caught:
        recorded(tmp_path, "", move={"through": {"csv": "lost/points.csv"}})
    (problem,) = caught.value.problems
    assert "lost/points.csv: No such file" in problem.text()
    assert problem.place.source[problem.place.column - 1 :].startswith('"lost/points.csv"')
    assert caught.value.exit_code == 4


def test_a_target_with_a_time_after_points_without(tmp_path):
    text = wrong_file(tmp_path, "q1,q2\n1,0\n", move={"to": {"joints": [0, 0], "time": 2}})
    assert "the target has a time, but the recorded points have none" in text


def test_the_times_of_a_recording_do_not_bind_the_fastest_motion(tmp_path):
    """With and without its times, a recording before a target is the same path."""
    move = {"planner": "time_optimal", "to": {"joints": [0, 0]}}
    timed = recorded(tmp_path, "t,q1,q2\n1,1,0\n9,1,1\n", move)
    assert timed.trajectory.duration == recorded(tmp_path, "q1,q2\n1,0\n1,1\n", move).trajectory.duration


def test_a_target_before_the_end_of_the_recording(tmp_path):
    to = {"to": {"joints": [0, 0], "time": 2}}
    told = wrong_file(tmp_path, "t,q1,q2\n0,0,0\n1,1,0\n3,1,1\n", move=to)
    assert "the target is reached after 2 s, the last recorded point after 3 s" in told


@pytest.mark.parametrize(
    ("through", "message"),
    [
        ({}, "expected a list of waypoints, {csv: PATH} or {positions: [...]}"),
        ({"csv": "a", "positions": [[0, 0]]}, "expected a list of waypoints, {csv: PATH}"),
        ({"cvs": "a"}, "unknown key 'cvs'"),
        ({"csv": 3}, "expected the path of a file, got 3"),
        ({"csv": "a.csv", "times": [1]}, "a file's times stand in its column t"),
        ({"positions": [[0, 1], [2]]}, "expected 2 values, one for each joint, got 1"),
        ({"positions": []}, "expected a list of rows of joint values"),
        ({"positions": [[0, 1], [2, 3]], "times": [1]}, "expected 2 numbers, got 1"),
        ({"positions": [[0, 1], [2, 3]], "times": [2, 1]}, "times must increase"),
        ({"positions": [[0, 1]], "merge": -1}, "expected a number at least 0 rad, got -1"),
        ("points.csv", "expected"),
    ],
)
def test_a_wrong_table(through, message):
    error = refusal({"joints": [0, 0]}, {"planner": "spline", "through": through})
    assert message in error.problems[0].text()
    assert error.exit_code == 2


@pytest.mark.full
@pytest.mark.parametrize("planner", PLANNERS)
def test_a_table_is_the_list_of_its_rows(planner):
    rows = np.random.default_rng(1).uniform(-1, 1, (4, 2)).tolist()
    listed = plan(
        {"joints": [0, 0]}, {"planner": planner, "through": [{"joints": q} for q in rows]}, limits=LIMITS
    )
    table = plan({"joints": [0, 0]}, {"planner": planner, "through": {"positions": rows}}, limits=LIMITS)
    assert curve_of(listed).coefficients.tobytes() == curve_of(table).coefficients.tobytes()


def test_names_poses_and_joints_may_be_mixed():
    home, via = [0, -1.5, 1.5, 0, 1.5, 0], [0.3, -1.2, 1.6, -0.4, 1.5, 0.2]
    pose = {"xyz": [0.4, 0.1, 0.25], "rpy": ["180 deg", 0, 0]}
    for end in (
        {"through": ["via", pose | {"time": 2}, {"joints": home, "time": 3}]},
        {"through": ["via"], "to": "place"},
    ):
        job = {
            "version": 1,
            "robot": "ur5e",
            "points": {"via": {"joints": via}, "place": pose},
            "start": {"joints": home},
            "moves": [{"planner": "spline", **end}],
        }
        if "to" not in end:
            job["moves"][0]["through"][0] = {"joints": via, "time": 1}
        else:
            job["limits"] = {"acceleration": 8}
        made = plan_job(job_from_text(json.dumps(job)))
        assert made.verdict.passed
        place = forward(made.loaded.robot, made.moves[0].planned.via_points.points[2])
        np.testing.assert_allclose(place[:3, 3], [0.4, 0.1, 0.25], atol=1e-9)
        np.testing.assert_allclose(np.diag(place)[:3], [1, -1, -1], atol=1e-9)


@pytest.mark.parametrize("table", [False, True])
def test_a_pose_is_reached_near_the_point_before_it(table):
    """The elbow is down at the start, and up at the point before the pose."""
    down, up = [0, -0.3, -1.6, 0.4, 1.5, 0], [0, -1.5, 1.5, 0, 1.5, 0]
    job = {
        "version": 1,
        "robot": "ur5e",
        "start": {"joints": down},
        "moves": [
            {
                "planner": "spline",
                "through": {"positions": [up], "times": [2]} if table else [{"joints": up, "time": 2}],
                "to": {"xyz": [0.4, 0.1, 0.25], "rpy": ["180 deg", 0, 0], "time": 4},
            }
        ],
    }
    joints = plan_job(job_from_text(json.dumps(job))).trajectory.end.position
    answers = []
    for elbow in ("up", "down"):
        job["moves"] = [
            {"planner": "cubic", "duration": 1, "to": {"xyz": [0.4, 0.1, 0.25], "rpy": ["180 deg", 0, 0]}}
        ]
        job["moves"][0]["to"]["configuration"] = {"elbow": elbow}
        job["start"] = {"joints": up}
        answers.append(plan_job(job_from_text(json.dumps(job))).trajectory.end.position)
    assert np.linalg.norm(joints - answers[0]) < 1e-9
    assert np.linalg.norm(joints - answers[1]) > 1


@pytest.mark.full
def test_a_pose_out_of_reach_names_the_waypoint():
    job = {
        "version": 1,
        "robot": "ur5e",
        "start": {"joints": [0, -1.5, 1.5, 0, 1.5, 0]},
        "moves": [
            {"planner": "spline", "through": [{"xyz": [4, 0, 0], "time": 1}, {"joints": [0] * 6, "time": 2}]}
        ],
    }
    from trajcli.errors import PlanningError

    with pytest.raises(PlanningError, match="waypoint 0: "):
        plan_job(job_from_text(json.dumps(job)))


@pytest.mark.parametrize("to", [True, False], ids=["to", "without to"])
@pytest.mark.parametrize("wrong", range(3))
def test_a_flaw_of_a_point_stands_at_its_field(wrong, to):
    points = [{"joints": [k + 1, k]} for k in range(3)]
    points[wrong]["blend"] = 0.1
    move = {"through": points[:-1], "to": points[-1]} if to else {"through": points}
    start, move = {"joints": [0, 0]}, {"planner": "time_optimal", **move}
    (problem,) = refusal(start, move).problems
    assert problem.place is not None
    assert problem.place.column == job_text(start, move).index("0.1") + 1


@pytest.mark.full
@pytest.mark.parametrize("planner", PLANNERS)
@pytest.mark.parametrize("times", ["t,", ""])
def test_a_job_written_out_is_the_same_plan(tmp_path, planner, times):
    rows = [[0, 0], [20, 10], [30, 50], [31, 50], [0, 90]]
    body = "".join((f"{k}," if times else "") + ",".join(map(str, row)) + "\n" for k, row in enumerate(rows))
    move = {"planner": planner, "through": {"csv": "points.csv", "merge": "2 deg"}}
    made = recorded(
        tmp_path,
        f"{times}q1_deg,q2_deg\n{body}",
        move,
        units={"angle": "deg"},
        limits={"velocity": 100, "acceleration": 400},
    )
    text = dump_job(made.loaded)
    again = plan_job(job_from_text(text))
    assert curve_of(again).coefficients.tobytes() == curve_of(made).coefficients.tobytes()
    assert dump_job(again.loaded) == text
    assert "csv" not in yaml.safe_load(text)["moves"][0]["through"]


@pytest.mark.full
def test_a_recording_that_follows_a_stretch(tmp_path):
    """A start in motion is planned anew for each duration; a later target and the recording go along."""
    text = "t,q1,q2\n0,0,0\n0.1,1,0\n0.3,1,1\n"
    start = {"joints": [0, 0], "velocity": [1, 0]}
    for move in ({}, {"to": {"joints": [0, 0], "time": 0.4}}, {"duration": 0.2}):
        made = recorded(tmp_path, text, move, start=start, when_over_limit="slow")
        assert made.verdict.passed
        times = made.moves[0].planned.via_points.times
        assert made.moves[0].stretch > 1
        np.testing.assert_allclose(times[1:3] / times[2], [1 / 3, 1], rtol=1e-9)


def test_points_of_a_recording_are_frozen():
    one = Recorded(np.zeros((2, 1)), np.arange(2.0))
    assert not one.positions.flags.writeable
    assert not one.times.flags.writeable


def test_aligned_moves_end_on_whole_periods(tmp_path):
    for planner in PLANNERS:
        made = recorded(
            tmp_path,
            "q1,q2\n0,0\n1,0\n1,1\n",
            {"planner": planner},
            output={"rate": 125, "align": True},
        )
        periods = made.trajectory.duration * 125
        assert periods == pytest.approx(round(periods), abs=1e-6)
        passage = made.moves[0].planned.via_points
        missed = np.abs(
            curve_of(made).evaluate(np.clip(passage.times, 0, made.trajectory.duration)) - passage.points
        )
        np.testing.assert_allclose(missed, passage.missed, atol=1e-9)


@pytest.mark.parametrize(
    "fields",
    few(
        [
            {"planner": "spline"},
            {"planner": "blends"},
            {"planner": "waypoints"},
            {"planner": "time_optimal"},
            {"planner": "time_optimal", "path": "polyline", "corner": 0.05},
        ],
        2,
    ),
    ids=lambda fields: fields.get("path", fields["planner"]),
)
def test_points_that_rounding_keeps_apart_are_one(fields):
    """As robots record them, with a turn-back: the motion is that of the points without doubles."""
    rows = [[0.1, 0.2], [0.2, 0.4], [0.2 + 1e-12, 0.4], [0.1, 0.2], [0.1, 0.2 - 9e-10], [0.3, 0.1]]
    limits = {"velocity": 2.0, "acceleration": 8.0, "jerk": None if fields["planner"] == "blends" else 80.0}
    start = {"joints": [0.0, 0.0]}
    moves = [
        {**fields, "through": [{"joints": row} for row in some]}
        for some in (rows, [rows[k] for k in (0, 1, 3, 5)])
    ]
    doubled, single = (plan(start, move, limits=limits) for move in moves)
    assert [event.kind for event in doubled.moves[0].planned.events].count("merged") == 1
    assert doubled.trajectory.duration == pytest.approx(single.trajectory.duration, rel=2e-4)
    times = np.linspace(0, single.trajectory.duration, 50)
    apart = doubled.trajectory.curve.evaluate(
        times * doubled.trajectory.duration / single.trajectory.duration
    )
    assert np.abs(apart - single.trajectory.curve.evaluate(times)).max() < 5e-3


@pytest.mark.parametrize("jerk", [None, 80.0])
@pytest.mark.parametrize("off", few([0.0, 1e-9, 1e-3], 1))
def test_a_polyline_that_turns_back_stops_there(jerk, off):
    """By half a turn, or nearly: a corner with a radius would be a spike."""
    rows, start = [[0.3, 0.6], [0.1, 0.2 + off]], {"joints": [0.0, 0.0]}
    move = {"planner": "time_optimal", "path": "polyline", "corner": 0.05}
    limits = {"velocity": 2.0, "acceleration": 8.0, "jerk": jerk}
    made = plan(start, {**move, "through": [{"joints": row} for row in rows]}, limits=limits)
    (event,) = (event for event in made.moves[0].planned.events if event.kind == "turns_back")
    assert event.message == "the path turns back at point 1, and stops there"
    ways = zip((start["joints"], rows[0]), rows, strict=True)
    single = [plan({"joints": a}, {**move, "to": {"joints": b}}, limits=limits) for a, b in ways]
    assert made.trajectory.duration == pytest.approx(sum(one.trajectory.duration for one in single), rel=2e-3)


def test_a_straight_line_of_points_has_no_corner_that_is_shrunk():
    """Slopes of thirds differ by rounding, which is no corner."""
    rows = [[0.1 * k, 0.2 * k, -0.7 * k] for k in (1, 3, 4.7, 5)]
    move = {"planner": "time_optimal", "path": "polyline", "corner": 0.05}
    move["through"] = [{"joints": row} for row in rows]
    made = plan(
        {"joints": [0.0, 0.0, 0.0]}, move, limits={"velocity": 2.0, "acceleration": 8.0, "jerk": None}
    )
    assert not [event for event in made.moves[0].planned.events if event.kind == "shrunk"]
    straight = plan(
        {"joints": [0.0, 0.0, 0.0]},
        {"planner": "time_optimal", "through": [], "to": {"joints": rows[-1]}},
        limits={"velocity": 2.0, "acceleration": 8.0, "jerk": None},
    )
    assert made.trajectory.duration == pytest.approx(straight.trajectory.duration, rel=1e-6)
