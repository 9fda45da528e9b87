"""Segments of a path from a file of poses: what it means written out, in a frame, and what of a file is refused."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import yaml

from trajcli.errors import FileError, TrajcliError
from trajcli.job.dump import dump_job
from trajcli.job.read import job_from_text, load_job
from trajcli.kinematics.forward import forward
from trajcli.planners.tool_path.segments import merged_events, segments_from
from trajcli.planning.plan import plan_job

START = [0.4, 0.1, 0.3]
AROUND = [[0.40, 0.10, 0.30], [0.40, 0.16, 0.30], [0.45, 0.16, 0.30], [0.45, 0.16, 0.30], [0.45, 0.10, 0.32]]
TILTS = [0.0, 0.1, 0.2, 0.2, 0.1]  # about x, from the tool upside down
HEADER = "x,y,z,qw,qx,qy,qz\n"


def quaternion(tilt):
    """Return w, x, y, z of half a turn about x, and then some."""
    return [float(np.cos((np.pi + tilt) / 2)), float(np.sin((np.pi + tilt) / 2)), 0.0, 0.0]


def rows(places=AROUND, tilts=TILTS, scale=1.0):
    return "".join(
        ",".join(f"{value:.9f}" for value in [*(np.array(place) * scale), *quaternion(tilt)]) + "\n"
        for place, tilt in zip(places, tilts, strict=True)
    )


def content_of(segments, move=None, **rest):
    return {
        "version": 1,
        "robot": "ur5e",
        "limits": {
            "acceleration": 20.0,
            "tcp": {"speed": 0.2, "acceleration": 2.0, "angular_speed": 2.0, "angular_acceleration": 9.0},
        },
        "start": {"xyz": START, "rpy": [np.pi, 0, 0]},
        "moves": [{"planner": "path", "radius": 0.01, "segments": segments, **(move or {})}],
        **rest,
    }


def job(folder, text, segments, move=None, **rest):
    """Return a job in a folder beside the file of poses."""
    (folder / "poses.csv").write_text(text)
    content = content_of(segments, move, **rest)
    file = folder / "job.yaml"
    file.write_text(yaml.safe_dump(content))
    return load_job(file)


def planned(*args, **kwargs):
    made = plan_job(job(*args, **kwargs))
    assert made.verdict.passed, made.verdict.findings
    return made


def written(places, tilts):
    return [
        {"line": {"xyz": place, **({} if tilt is None else {"quat_wxyz": quaternion(tilt)})}}
        for place, tilt in zip(places, tilts, strict=True)
    ]


@cache
def as_lines():
    """Return the plan of the lines to the poses of the file."""
    made = plan_job(job_from_text(yaml.safe_dump(content_of(written(AROUND[1:], TILTS[1:])))))
    assert made.verdict.passed
    return made


def same_motion(one, other, atol=1e-7):
    assert one.trajectory.duration == pytest.approx(other.trajectory.duration, rel=1e-6)
    times = np.linspace(0.0, min(one.trajectory.duration, other.trajectory.duration), 40)
    apart = one.trajectory.curve.evaluate(times) - other.trajectory.curve.evaluate(times)
    assert np.abs(apart).max() < atol


def test_a_file_is_the_lines_to_its_poses(tmp_path):
    """The first row is where the arm stands; the doubled pose counts once."""
    made = planned(tmp_path, HEADER + rows(), {"csv": "poses.csv"})
    same_motion(made, as_lines())
    assert [e.kind for e in made.moves[0].planned.events] == ["merged"]
    said = made.moves[0].planned.events[0].message
    assert said == "segment 2 counts for nothing: it ends where it begins"
    merged = merged_events(6, [0, 2, 4])
    assert [each.message for each in merged] == [
        "segment 1 counts for nothing: it ends where it begins; 2 more likewise"
    ]
    assert merged_events(2, [0, 1]) == []


def test_lengths_may_be_in_mm_and_the_first_row_somewhere_else(tmp_path):
    header = HEADER.replace("x,y,z", "x_mm,y_mm,z_mm")
    made = planned(tmp_path, header + rows(AROUND[1:], TILTS[1:], 1000.0), {"csv": "poses.csv"})
    same_motion(made, as_lines())


def test_without_orientation_it_is_kept(tmp_path):
    text = "x,y,z\n" + "".join(",".join(map(str, place)) + "\n" for place in AROUND)
    made = planned(tmp_path, text, {"csv": "poses.csv"})
    poses = forward(
        made.moves[0].robot, made.trajectory.curve.evaluate(np.linspace(0, made.trajectory.duration, 30))
    )
    assert np.abs(poses[:, :3, :3] - np.diag([1.0, -1.0, -1.0])).max() < 1e-5
    assert np.abs(poses[-1, :3, 3] - AROUND[-1]).max() < 1e-6


def test_poses_in_a_frame_are_turned_and_moved_with_it(tmp_path):
    turn = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    origin = np.array([0.5, -0.2, 0.1])
    places = [(turn.T @ (np.array(place) - origin)).tolist() for place in AROUND]
    frames = {"table": {"xyz": origin.tolist(), "rpy": [0, 0, np.pi / 2]}}
    text = HEADER
    for place, tilt in zip(places, TILTS, strict=True):
        half = np.array(quaternion(tilt))  # rotated by -90 deg about z from the left: q_z(-90) q
        c, s = np.cos(-np.pi / 4), np.sin(-np.pi / 4)
        w, x, y, z = half
        text += (
            ",".join(f"{v:.9f}" for v in [*place, c * w - s * z, c * x - s * y, c * y + s * x, c * z + s * w])
            + "\n"
        )
    made = planned(tmp_path, text, {"csv": "poses.csv", "in": "table"}, frames=frames)
    same_motion(made, as_lines(), 1e-6)


def test_near_poses_are_left_out_and_told(tmp_path):
    places = [*AROUND[:2], [0.4, 0.1604, 0.3], *AROUND[2:]]
    text = HEADER + rows(places, [*TILTS[:2], 0.1, *TILTS[2:]])
    made = planned(tmp_path, text, {"csv": "poses.csv", "merge": 0.001})
    kinds = [(e.kind, e.message) for e in made.moves[0].planned.events]
    assert kinds[0][0] == "merged"
    assert kinds[0][1].startswith("left out 2 of 6 poses of ")
    same_motion(made, as_lines())


@pytest.mark.full
def test_a_path_of_poses_is_flown_by(tmp_path):
    """With a zone at its end, as lines are."""
    more = {"planner": "line", "to": {"xyz": [0.40, 0.12, 0.32]}, "law": {"speed": 0.2}}
    text = HEADER + rows()
    content = job(tmp_path, text, {"csv": "poses.csv"}, {"law": {"shape": "time_optimal"}})
    raw = yaml.safe_load((tmp_path / "job.yaml").read_text())
    raw["moves"].append(more)
    raw["zone"] = 0.01
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(raw))
    made = plan_job(load_job(tmp_path / "job.yaml"))
    assert made.verdict.passed
    assert content.job.moves[0].target is not None
    assert made.flyby is not None


def test_a_job_written_out_is_the_same_plan(tmp_path):
    loaded = job(tmp_path, HEADER + rows(), {"csv": "poses.csv", "merge": 0.001})
    same_motion(plan_job(job_from_text(dump_job(loaded))), as_lines())


@pytest.mark.parametrize(
    ("text", "segments", "message"),
    [
        ("x,y\n1,2\n", {"csv": "poses.csv"}, "no column z"),
        ("x,x_mm,y,z\n1,2,3,4\n", {"csv": "poses.csv"}, "two columns for x: x and x_mm"),
        ("x,y,z,qw,qx\n1,2,3,1,0\n", {"csv": "poses.csv"}, "no column qy, qz"),
        ("x,y,z,rx,ry,rz\n1,2,3,1,0,0\n", {"csv": "poses.csv"}, "this file has 'rx'"),
        ("x,y,z,Yaw_deg\n1,2,3,1\n", {"csv": "poses.csv"}, "this file has 'Yaw_deg'"),
        (
            HEADER + "0.4,0.1,0.3,1,1,0,0\n",
            {"csv": "poses.csv"},
            "row 1: the quaternion has length 1.41421, not 1",
        ),
        (HEADER + "0.4,0.1,nan,1,0,0,0\n", {"csv": "poses.csv"}, "nan"),
        (HEADER + "0.4,0.1,1e30,1,0,0,0\n", {"csv": "poses.csv"}, "a value is larger than"),
        (HEADER + rows(), {"csv": "poses.csv", "in": "tabel"}, "there is no frame 'tabel'"),
        (HEADER + rows(), {"csv": "poses.csv", "merge": -1}, "expected a number at least 0 m, got -1"),
        (HEADER + rows(), {"csv": "poses.csv", "file": 1}, "unknown key 'file'"),
        (HEADER + rows(), {"csv": 3}, "expected the path of a file, got 3"),
        (HEADER + rows(), [], "the list is too short: expected at least 1"),
    ],
)
def test_what_is_wrong_with_a_file_is_said_at_its_line(tmp_path, text, segments, message):
    with pytest.raises(TrajcliError) as caught:
        job(tmp_path, text, segments)
    (problem,) = caught.value.problems
    assert message in problem.message
    assert problem.place is not None


@pytest.mark.parametrize(
    ("segments", "key"),
    [
        ({"csv": "poses.csv", "in": "tabel", "merge": 1e-3}, "in"),
        ({"csv": "poses.csv", "in": "world", "merge": -1}, "merge"),
        ({"csv": "poses.csv", "file": 1, "merge": 1e-3}, "file"),
        ({"csv": 3, "merge": 1e-3}, "csv"),
    ],
)
def test_what_is_wrong_with_a_key_is_said_at_its_line(tmp_path, segments, key):
    with pytest.raises(TrajcliError) as caught:
        job(tmp_path, HEADER + rows(), segments)
    (problem,) = caught.value.problems
    lines = (tmp_path / "job.yaml").read_text().splitlines()
    assert problem.place is not None
    assert lines[problem.place.line - 1].strip().startswith(f"{key}:")


@pytest.mark.parametrize("frame", [{}, {"in": "table"}])
def test_near_poses_are_left_out_in_a_frame_too(tmp_path, frame):
    """Each third one of poses that are 0.4 mm apart stays; the first one counts as where the arm stands."""
    text = "x,y,z\n" + "".join(f"{0.4 + 4e-4 * k},0.1,0.3\n" for k in range(1, 7))
    recorded = {"csv": "poses.csv", "merge": 1e-3, **frame}
    loaded = job(tmp_path, text, recorded, frames={"table": {"rpy": [0, 0, 0]}})
    before = np.eye(4)
    before[:3, 3] = START
    segments, (event,) = segments_from(loaded.job.moves[0].segments, before)
    np.testing.assert_allclose([each.line.xyz[0] for each in segments], [0.4012, 0.4024], atol=1e-12)
    assert event.message.startswith("left out 3 of 6 poses")


@pytest.mark.parametrize("count", [1, 2, 5])
def test_poses_need_a_radius_as_lines_do(tmp_path, count):
    (tmp_path / "poses.csv").write_text(HEADER + rows(AROUND[:count], TILTS[:count]))
    move = {"planner": "path", "segments": {"csv": "poses.csv"}}
    content = {"version": 1, "robot": "ur5e", "start": {"xyz": START, "rpy": [np.pi, 0, 0]}, "moves": [move]}
    (tmp_path / "job.yaml").write_text(yaml.safe_dump(content))
    if count == 1:  # a line, without a corner
        assert load_job(tmp_path / "job.yaml").job.moves[0].radius is None
        return
    with pytest.raises(TrajcliError) as caught:
        load_job(tmp_path / "job.yaml")
    (problem,) = caught.value.problems
    assert problem.message.endswith("the corners between recorded poses have no radius")
    assert problem.hint == "give the move a `radius`"


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(FileError) as caught:
        job(tmp_path, HEADER, {"csv": "none.csv"})
    (problem,) = caught.value.problems
    assert problem.place is not None
    assert "none.csv" in problem.message
