"""States of trajectory controllers in logs, written by mcap_ros2 from the definition of control_msgs."""

from __future__ import annotations

import gc
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.streams.mcap.definitions import definition_of, point_fields
from trajcli.streams.recorded_motion import open_motion

KIND = "control_msgs/msg/JointTrajectoryControllerState"
STATE = "sensor_msgs/msg/JointState"
RULE = "=" * 80
POINT = "trajectory_msgs/JointTrajectoryPoint"
PARTS = definition_of("trajectory_msgs/msg/JointTrajectory").partition(RULE)[2]
DEFINITION = f"""# state of the controller
std_msgs/Header header
string[] joint_names
{POINT} reference  # where it should be
{POINT} feedback
{POINT} error
{POINT} output
string[] multi_dof_joint_names
{RULE}{PARTS}"""
NAMES = ["elbow", "wrist"]


def stamp(nanoseconds):
    return {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}


def point(values, *, accelerations=True):
    return {
        "positions": values[:2].tolist(),
        "velocities": values[2:4].tolist(),
        "accelerations": values[4:6].tolist() if accelerations else [],
        "effort": [],
        "time_from_start": stamp(int(abs(values[0]) * 1e9)),
    }


def log(
    path: Path,
    count: int,
    kind=KIND,
    definition=DEFINITION,
    fields=("reference", "feedback", "error", "output"),
):
    from mcap_ros2.writer import Writer

    values = np.random.default_rng(1).normal(size=(len(fields), count, 6))
    with path.open("wb") as stream:
        writer = Writer(stream, chunk_size=20000)
        schema = writer.register_msgdef(kind, definition)
        for k in range(count):
            message = {
                "header": {"stamp": stamp(10**18 + k * 2 * 10**6), "frame_id": "base"[: k % 5]},
                "joint_names": NAMES,
                **{
                    name: point(values[f, k], accelerations=name != "feedback")
                    for f, name in enumerate(fields)
                },
                "multi_dof_joint_names": ["x"],
            }
            writer.write_message("/controller_state", schema, message, log_time=k, publish_time=k)
        writer.finish()
    return values


def test_the_field_that_is_asked_for_is_read(tmp_path):
    path = tmp_path / "a.mcap"
    values = log(path, 300)
    for field, f in (("reference", 0), ("feedback", 1), ("output", 3)):
        found = open_motion(path, field=field)
        motion = found.whole()
        assert found.joints == tuple(NAMES)
        assert motion.t.tolist() == [k * 2 * 10**6 / 1e9 for k in range(300)]
        np.testing.assert_array_equal(motion.q, values[f, :, :2])
        np.testing.assert_array_equal(motion.qd, values[f, :, 2:4])
        assert (motion.qdd is None) == (field == "feedback")
    assert found.resolution.time == 5e-10
    assert found.resolution.q.tolist() == [0.0, 0.0]


def test_older_definitions_name_other_fields(tmp_path):
    fields = ("desired", "actual", "error")
    definition = "\n".join(
        ["std_msgs/Header header", "string[] joint_names", *(f"{POINT} {f}" for f in fields)]
    )
    definition += f"\nstring[] multi_dof_joint_names\n{RULE}{PARTS}"
    assert point_fields(definition) == fields
    values = log(tmp_path / "a.mcap", 20, definition=definition, fields=fields)
    np.testing.assert_array_equal(
        open_motion(tmp_path / "a.mcap", field="actual").whole().q, values[1, :, :2]
    )


@pytest.mark.parametrize(
    ("options", "message", "hint"),
    [
        ({}, "holds the states reference, feedback, error, output", "--field reference or --field feedback"),
        ({"field": "refrence"}, "and no 'refrence'", "did you mean 'reference'?"),
        ({"topic": "/controller_stat"}, "no topic '/controller_stat'", "did you mean '/controller_state'?"),
    ],
)
def test_what_is_open_is_refused_with_the_choices(options, message, hint, tmp_path):
    log(tmp_path / "a.mcap", 3)
    with pytest.raises(InputError, match=message) as caught:
        open_motion(tmp_path / "a.mcap", **options)
    assert hint in (caught.value.problems[0].hint or "")


def test_a_field_of_another_type_or_format_is_refused(pick_log, tmp_path):
    with pytest.raises(InputError, match="which has one state"):
        open_motion(pick_log, field="reference")
    (tmp_path / "a.csv").write_text("t,q1\n0,1\n")
    with pytest.raises(InputError, match="--field is about MCAP"):
        open_motion(tmp_path / "a.csv", field="reference")
    with pytest.raises(InputError, match="--topic is about MCAP"):
        open_motion(tmp_path / "a.csv", topic="/x")


@pytest.fixture
def few_objects():
    """Let the collector run as often as in a process of its own: what others have made does not count."""
    gc.collect()
    gc.freeze()
    gc.collect()
    yield
    gc.unfreeze()


@pytest.mark.full
@pytest.mark.usefixtures("few_objects")
def test_memory_does_not_grow_with_the_log(tmp_path, monkeypatch):
    monkeypatch.setattr("trajcli.streams.recorded_motion._KEPT", 0)
    peaks = []
    for count in (2400, 9600):  # Python keeps up to 2000 freed tuples of each size
        log(tmp_path / f"{count}.mcap", count)
        tracemalloc.start()
        found = open_motion(tmp_path / f"{count}.mcap", field="reference")
        assert sum(len(block.t) for block in found.blocks(300)) == count
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
    assert peaks[1] < 2.4 * peaks[0], peaks  # of four times as many
