"""Tables from files of every format: the same motion, and one clear error for what is none."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from trajcli.errors import FileError, InputError
from trajcli.job.read import load_job
from trajcli.output.delivery.joined import write_plan
from trajcli.planning.plan import Plan, plan_job
from trajcli.streams.reading import holds_motion, is_job, is_ros_message, motion_files, read_table
from trajcli.streams.recorded_motion import open_motion
from trajcli.streams.ros_messages import read_ros_yaml

EXAMPLES = Path(__file__).parents[2] / "examples"
POINTS = [
    {
        "positions": [0.0, 1.0],
        "velocities": [0.0, 0.0],
        "accelerations": [0.0, 0.0],
        "time_from_start": {"sec": 0, "nanosec": 0},
    },
    {
        "positions": [0.5, 1.5],
        "velocities": [0.1, 0.2],
        "accelerations": [1.0, 2.0],
        "time_from_start": {"sec": 1, "nanosec": 500_000_000},
    },
]
MESSAGE = {"header": {"frame_id": ""}, "joint_names": ["a", "b"], "points": POINTS}


@pytest.fixture(scope="module")
def plan() -> Plan:
    return plan_job(load_job(EXAMPLES / "sync.yaml", ["units={angle: deg, length: mm}"], si=True))


def test_all_formats_hold_the_same_rows(plan, tmp_path):
    for ending in ("csv", "jsonl", "mcap"):
        write_plan(plan, str(tmp_path / f"rows.{ending}"), "full" if ending == "csv" else "fixed")
    csv, jsonl, mcap = (read_table(tmp_path / f"rows.{ending}") for ending in ("csv", "jsonl", "mcap"))
    assert csv.names == jsonl.names
    np.testing.assert_array_equal(csv.columns, jsonl.columns)
    for name in mcap.names[1:]:
        np.testing.assert_array_equal(mcap.column(name), csv.column(name))
    np.testing.assert_allclose(mcap.column("t"), csv.column("t"), atol=5e-10)


def test_a_log_is_known_by_its_first_bytes(plan, tmp_path):
    write_plan(plan, str(tmp_path / "rows.mcap"))
    (tmp_path / "rows.log").write_bytes((tmp_path / "rows.mcap").read_bytes())
    assert read_table(tmp_path / "rows.log").names == read_table(tmp_path / "rows.mcap").names
    logged = open_motion(tmp_path / "rows.log")
    assert logged.joints == plan.trajectory.joint_names
    assert logged.whole().message_joints is None  # it is no goal, of which some joints may be left out


def test_a_goal_that_was_written_is_read(plan, tmp_path):
    write_plan(plan, str(tmp_path / "goal.yaml"))
    table = read_table(tmp_path / "goal.yaml")
    n = len(plan.trajectory.joint_names)
    q = np.column_stack([table.column(f"q{joint + 1}") for joint in range(n)])
    np.testing.assert_allclose(
        q, plan.trajectory.curve.evaluate(np.minimum(table.column("t"), plan.trajectory.duration)), atol=1e-9
    )
    assert is_ros_message(tmp_path / "goal.yaml")
    assert not is_ros_message(EXAMPLES / "sync.yaml")


@pytest.mark.parametrize("ending", ["yaml", "yml", "json"])
def test_a_message_is_a_motion_and_no_job_whatever_its_name(ending: str, tmp_path: Path) -> None:
    """JSON is YAML, too: who draws or checks a file is to take the same for it."""
    message, job, folder = (tmp_path / f"{name}.{ending}" for name in ("message", "job", "folder"))
    message.write_text(json.dumps(MESSAGE, indent=2))
    job.write_text(json.dumps({"version": 1, "robot": {"joints": 1}, "start": {"joints": 0}, "moves": []}))
    folder.mkdir()
    assert [holds_motion(path) for path in (message, job, folder)] == [True, False, False]
    assert [is_job(str(path)) for path in (message, job, folder)] == [False, True, True]
    assert motion_files(str(tmp_path)) == [str(message)]
    assert read_table(message).column("q2").tolist() == [1.0, 1.5]


WRAPPED = {
    "message": MESSAGE,
    "goal": {"trajectory": MESSAGE, "path_tolerance": []},
    "action": {"goal": {"trajectory": MESSAGE}},
    "RobotTrajectory": {"joint_trajectory": MESSAGE, "multi_dof_joint_trajectory": {"points": []}},
    "DisplayTrajectory": {"model_id": "arm", "trajectory": [{"joint_trajectory": MESSAGE}]},
}


@pytest.mark.parametrize("name", WRAPPED)
def test_messages_inside_of_others(name, tmp_path):
    file = tmp_path / "message.yaml"
    file.write_text(yaml.safe_dump(WRAPPED[name]))
    message = read_ros_yaml(file)
    assert message.joint_names == ("a", "b")
    assert message.times.tolist() == [0.0, 1.5]
    assert message.position.tolist() == [[0.0, 1.0], [0.5, 1.5]]
    assert message.acceleration.tolist() == [[0.0, 0.0], [1.0, 2.0]]


def test_an_echo_stream_times_of_ros_1_and_positions_alone(tmp_path):
    points = [
        {"positions": [1, 2], "velocities": [], "time_from_start": {"secs": k, "nsecs": 250_000_000}}
        for k in (0, 1)
    ]
    text = yaml.safe_dump({"joint_names": ["a", "b"], "points": points})
    (tmp_path / "echo.yaml").write_text(text + "---\n" + "joint_names: [x]\npoints: []\n---\n")
    message = read_ros_yaml(tmp_path / "echo.yaml")
    assert message.times.tolist() == [0.25, 1.25]
    assert message.velocity.shape == message.acceleration.shape == (2, 0)
    assert read_table(tmp_path / "echo.yaml").names == ("t", "q1", "q2")


def changed(**values):
    return {**MESSAGE, "points": [POINTS[0], {**POINTS[1], **values}]}


WRONG = [
    ("joint_names: [a\n", "no YAML"),
    ("a: 1\n", "holds no joint trajectory"),
    ("", "holds no joint trajectory"),
    ("[" * 3000, "YAML|deep"),
    (yaml.safe_dump({**MESSAGE, "points": []}), "at least one point"),
    (yaml.safe_dump({**MESSAGE, "joint_names": [1, 2]}), "expected a list of names"),
    (
        yaml.safe_dump(changed(positions=[1.0])),
        "positions of point 1 are \\[1.0\\], expected 2 finite numbers",
    ),
    (yaml.safe_dump(changed(positions=[1.0, float("nan")])), "positions of point 1"),
    (yaml.safe_dump(changed(velocities=[])), "velocities of point 1 are \\[\\]"),
    (yaml.safe_dump(changed(accelerations=["x", "y"])), "accelerations of point 1"),
    (yaml.safe_dump(changed(time_from_start="soon")), "time_from_start of point 1 is 'soon'"),
    (yaml.safe_dump(changed(time_from_start={"seconds": 1})), "time_from_start of point 1"),
    (yaml.safe_dump({**MESSAGE, "points": [*POINTS, None]}), "positions of point 2 are None"),
    ("joint_names: [a, b]\npoints:\n- positions: [1.0, '...']\n", "the message is cut"),
    ("joint_names: [a, b]\npoints:\n- positions:\n  - 1.0\n  - '...'\n", "the message is cut"),
]


@pytest.mark.parametrize(("text", "message"), WRONG)
def test_a_wrong_message_is_one_clear_error(text, message, tmp_path):
    file = tmp_path / "goal.yaml"
    file.write_text(text)
    with pytest.raises(InputError, match=message) as caught:
        read_ros_yaml(file)
    assert len(caught.value.problems) == 1


def test_files_that_cannot_be_read(tmp_path):
    for ending in ("csv", "jsonl", "mcap", "yaml"):
        with pytest.raises(FileError):
            read_table(tmp_path / f"nothing.{ending}")
        (tmp_path / f"folder.{ending}").mkdir()
        with pytest.raises(FileError):
            read_table(tmp_path / f"folder.{ending}")
    (tmp_path / "large.yaml").touch()
    with (tmp_path / "large.yaml").open("r+b") as stream:
        stream.truncate(2 << 30)
    with pytest.raises(InputError, match="has at most"):
        read_table(tmp_path / "large.yaml")
    (tmp_path / "bytes.yaml").write_bytes(b"joint_names: \xff")
    with pytest.raises(InputError, match="no UTF-8"):
        read_table(tmp_path / "bytes.yaml")


LINES = [
    ("", "has no rows"),
    ("[1]\n", "expected an object"),
    ("{}\n", "expected an object"),
    ('{"t": 1\n', "no JSON"),
    ('{"t": NaN}\n', "no JSON"),
    ('{"t": 1}\n{"s": 1}\n', "other keys"),
    ('{"t": 1, "q": [1]}\n{"t": 1, "q": [1, 2]}\n', "other keys or lists"),
    ('{"t": "1"}\n', "a value is no number"),
    ('{"t": true}\n', "a value is no number"),
    ('{"t": 1, "pose": [1, 2]}\n', "unexpected list 'pose' of 2 numbers"),
    ('{"t": 1, "names": [1, 2]}\n', "unexpected list 'names' of 2 numbers"),
]


@pytest.mark.parametrize(("text", "message"), LINES)
def test_wrong_json_lines_are_one_clear_error(text, message, tmp_path):
    (tmp_path / "rows.jsonl").write_text(text)
    with pytest.raises(InputError, match=message):
        read_table(tmp_path / "rows.jsonl")


def test_json_lines_of_others(tmp_path):
    rows = [{"t": k / 10, "q": [k, 2 * k], "temperature": 20 + k} for k in range(5000)]
    (tmp_path / "rows.jsonl").write_text("".join(json.dumps(row) + "\n" for row in rows))
    table = read_table(tmp_path / "rows.jsonl")
    assert table.names == ("t", "q1", "q2", "temperature")
    assert table.columns.shape == (5000, 4)
    assert table.columns[4999].tolist() == [499.9, 4999, 9998, 5019]


def test_joints_of_a_message_stand_in_the_order_that_is_wanted(tmp_path: Path) -> None:
    path = tmp_path / "goal.yaml"
    path.write_text(yaml.safe_dump(MESSAGE))
    found = read_table(path, joints=["b", "a"])
    assert (found.joints, found.names) == (("b", "a"), ("t", "q1", "q2", "qd1", "qd2", "qdd1", "qdd2"))
    assert found.columns[1].tolist() == [1.5, 1.5, 0.5, 0.2, 0.1, 2.0, 1.0]
    alone = read_table(path, joints=["b"])
    assert (alone.names, alone.columns[1].tolist()) == (("t", "q1", "qd1", "qdd1"), [1.5, 1.5, 0.2, 2.0])
    with pytest.raises(InputError, match="there is no joint 'c'"):
        read_table(path, joints=["b", "c"])
