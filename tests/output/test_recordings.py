"""What a log holds beside its rows: times in whole nanoseconds, the path of the tool, and what is refused."""

from __future__ import annotations

import hashlib
import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.errors import InputError
from trajcli.job.read import job_from_text, load_job
from trajcli.kinematics.forward import forward
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.output.recording import LogOptions, check_log_options, recording_of
from trajcli.planning.plan import Plan, plan_job

HEAD = {"version": 1, "robot": "ur5e", "start": {"joints": [0, -1.5, 1.5, 0, 0.1, 0.2]}}
THERE = {"planner": "quintic", "to": {"joints": [0.3, -1.2, 1.4, 0.1, 0.2, 0.4]}}
BARE = Robot("bare", (Joint("a"),), unlimited(1), None, np.eye(4), np.eye(4))


@cache
def _planned(text: str) -> Plan:
    return plan_job(job_from_text(text))


def planned(duration: float, start: float = 0.0, *more: dict[str, Any]) -> Plan:
    moves = [{**THERE, "duration": duration}, *more]
    return _planned(json.dumps({**HEAD, "moves": moves, "output": {"start_time": start}}))


@pytest.mark.parametrize(
    ("epoch", "start", "origin"),
    [
        (None, 0.25, 250_000_000),
        ("1700000000.123456789", 0.0, 1_700_000_000_123_456_789),  # more digits than a float has
        ("5", -4.9999999996, 0),
        ("5", 2.0000000006, 7_000_000_001),
        ("0", 0.0, 0),
    ],
)
def test_times_are_whole_nanoseconds_behind_the_epoch(epoch: str | None, start: float, origin: int) -> None:
    made = recording_of(planned(1.2345678916, start), LogOptions(epoch=epoch, compression="lz4"))
    assert (made.origin, made.duration, made.compression) == (origin, 1_234_567_892, "lz4")
    assert made.origin - made.epoch == round(start * 1e9)
    assert made.metadata["epoch"] == str(made.epoch)


def test_signals_are_set_at_the_nearest_nanosecond() -> None:
    set_at = {"at": {"signal": "s", "value": 3, "before": 0.5}}
    plan = planned(1.2345678916, 0.0, {"signal": "s", "value": 2}, {**THERE, "duration": 2, **set_at})
    found = recording_of(plan, LogOptions()).signals
    assert found == {"s": ((1_234_567_892, 2.0), (2_734_567_892, 3.0))}


@pytest.mark.parametrize(("duration", "count"), [(1.0, 62), (0.99, 61), (30.0, 1000), (0.001, 2)])
def test_the_path_is_shown_sixty_times_a_second_a_thousand_times_at_most(duration: float, count: int) -> None:
    plan = planned(duration)
    path = recording_of(plan, LogOptions()).path
    assert path is not None
    assert path.nanoseconds.tolist() == np.rint(np.linspace(0, duration * 1e9, count)).astype(int).tolist()
    reached = forward(plan.loaded.robot, plan.trajectory(path.nanoseconds * 1e-9))[:, :3, 3]
    assert path.poses[:, :3] == pytest.approx(reached, abs=1e-9)
    assert (np.sum(path.poses[1:, 3:] * path.poses[:-1, 3:], axis=1) > 0).all()  # no quaternion jumps


@pytest.mark.parametrize(
    ("options", "start", "message", "hint"),
    [
        ({"topics": "/tool_twists"}, 0.0, "there is no topic '/tool_twists'", "did you mean '/tool_twist'"),
        ({"topics": "/tool_twist"}, 0.0, "robot bare has no geometry", "convention"),
        ({"epoch": "-5"}, 0.0, "expected seconds since 1970, got '-5'", "not negative"),
        ({"epoch": "1e9"}, 0.0, "expected seconds since 1970, got '1e9'", "decimal number"),
        ({}, -0.25, "output.start_time is -0.25 s", "--epoch 0.25 or more makes that possible"),
        ({"epoch": "1.5"}, -2.0, "output.start_time is -2 s", "--epoch 2 or more makes that possible"),
        ({"epoch": "2147483648"}, 0.0, "the log would reach 2147483648 s", "small enough"),
        ({"epoch": "2147483647"}, 0.001, "times of ROS 2 end at 2147483647 s", "small enough"),
    ],
)
def test_what_no_log_can_hold_is_refused_before_anything_is_planned(
    options: dict[str, str], start: float, message: str, hint: str
) -> None:
    with pytest.raises(InputError) as error:
        check_log_options(LogOptions(**options), BARE, start)  # type: ignore[arg-type]
    (problem,) = error.value.problems
    assert message in problem.message
    assert hint in (problem.hint or "")


def test_the_end_must_be_a_time_too_and_topics_may_stand_apart() -> None:
    check_log_options(LogOptions(epoch="2147483646"), BARE, 0.0)
    assert recording_of(planned(1.0), LogOptions(epoch="2147483646")).epoch == 2_147_483_646 * 10**9
    with pytest.raises(InputError, match=r"the log would reach 2147483647\.5"):
        recording_of(planned(1.5), LogOptions(epoch="2147483646"))
    asked = LogOptions(topics=" /tool_twist , /joint_trajectory_point")
    assert asked.names == ("/tool_twist", "/joint_trajectory_point")
    assert recording_of(planned(1.0), asked).topics == asked.names


def test_options_that_are_given_are_named_and_every_topic_is_looked_at() -> None:
    assert LogOptions(topics="", epoch="0").given == ("--topics", "--epoch")
    assert LogOptions(compression="none").given == ("--compression",)
    with pytest.raises(InputError, match="there is no topic '/tff'"):
        check_log_options(LogOptions(topics="/tool_path,/tff"), planned(1.0).loaded.robot, 0.0)
    made = recording_of(planned(1.0), LogOptions(epoch="0.0000000019"))
    assert (made.epoch, made.origin) == (2, 2)


def test_a_log_says_whose_motion_it_is_and_holds_the_job_to_the_letter() -> None:
    """Each signal, the types of joints, and names of any letters."""
    joints = [
        {"name": "lift", "type": "prismatic", "acceleration": 9},
        {"name": "drehen é", "acceleration": 9},
    ]
    moves = [
        {"signal": "glue", "value": 1},
        {"planner": "quintic", "to": {"joints": [0.1, 0.2]}, "duration": 1.23456789},
        {"signal": "valve", "value": 2},
    ]
    job = {
        "version": 1,
        "robot": {"name": "arm", "joints": joints},
        "start": {"joints": [0, 0]},
        "moves": moves,
    }
    text = json.dumps(job, ensure_ascii=False)
    made = recording_of(plan_job(job_from_text(text)), LogOptions())
    attached = made.attachments[0].data
    assert attached.decode() == text
    assert made.metadata["job_sha256"] == hashlib.sha256(text.encode()).hexdigest()
    assert (made.metadata["robot"], json.loads(made.metadata["joints"])) == ("arm", ["lift", "drehen é"])
    assert json.loads(made.metadata["joint_types"]) == ["prismatic", "revolute"]
    assert float(made.metadata["duration"]) == 1.23456789
    assert made.signals == {"glue": ((0, 1.0),), "valve": ((1_234_567_890, 2.0),)}
    assert json.loads(made.attachments[1].data)["knots"]["count"] == made.knots.times.size
    assert made.metadata["geometry"] == "none: there is no /robot_description, /tf_static, /tf, /tool_path"


def test_a_changed_job_is_held_as_it_was_changed(tmp_path: Path) -> None:
    (tmp_path / "job.yaml").write_text(json.dumps({**HEAD, "moves": [{**THERE, "duration": 2}]}))
    changed = plan_job(load_job(tmp_path / "job.yaml", ("moves.0.duration=3",)))
    held = recording_of(changed, LogOptions()).attachments[0].data.decode()
    assert plan_job(job_from_text(held)).trajectory.duration == 3.0


LONG, BENT = {"xyz": [0, 0, 0.1]}, {"xyz": [0.05, 0, 0.2], "rpy": [0, 0.5, 0.3]}


def matrix(pose: np.ndarray) -> np.ndarray:
    """Return the transform of x, y, z and the quaternion x, y, z, w."""
    found = np.eye(4)
    found[:3, :3], found[:3, 3] = Rotation.from_quat(pose[3:]).as_matrix(), pose[:3]
    return found


@pytest.mark.parametrize("first", ["long", None])
@pytest.mark.parametrize("changes", [False, True])
def test_frames_one_behind_the_other_lead_to_the_tool_and_so_does_its_path(
    changes: bool, first: str | None
) -> None:
    """Of a base that is turned, and of a tool that may change: at its change the new one is on the flange."""
    base = {"xyz": [0.3, -0.2, 0.5], "rpy": [0.4, 0.2, -0.3]}
    back = {"planner": "quintic", "to": {"joints": [0.1, -1.5, 1.5, 0, 0.1, 0.2]}, "duration": 1}
    moves = [{**THERE, "duration": 1}, *([{"tool": "bent"}] if changes else []), back]
    tools = {"tools": {"long": LONG, "bent": BENT}, **({"tool": first} if first else {})}
    plan = plan_job(job_from_text(json.dumps({**HEAD, **tools, "base": base, "moves": moves})))
    made = recording_of(plan, LogOptions())
    assert made.frames is not None
    assert made.path is not None
    times = np.array([0, 300_000_000, 999_999_999, 1_000_000_000, 1_700_000_000, 2_000_000_000])
    robot = plan.loaded.robot
    bent = replace(
        robot, tool=matrix(np.append(BENT["xyz"], Rotation.from_euler("xyz", BENT["rpy"]).as_quat()))
    )
    links = made.frames.chain
    poses = made.frames.poses(times)
    assert poses.shape == (6, len(links) - 1, 7)
    at_base = [
        matrix(pose) for parent, child, pose in made.frames.fixed if (parent, child) == ("world", links[0])
    ]
    at_tool = [matrix(pose) for parent, child, pose in made.frames.fixed if parent == links[-1]]
    for time, each in zip(times.tolist(), poses, strict=True):
        arm = bent if changes and time >= 1_000_000_000 else robot
        chain = [*at_base, *map(matrix, each), *at_tool]
        reached = forward(arm, plan.trajectory(time * 1e-9))
        np.testing.assert_allclose(np.linalg.multi_dot(chain), reached, rtol=0, atol=1e-9)
    for time, pose in list(zip(made.path.nanoseconds.tolist(), made.path.poses, strict=True))[::20]:
        arm = bent if changes and time >= 1_000_000_000 else robot
        np.testing.assert_allclose(
            matrix(pose), forward(arm, plan.trajectory(time * 1e-9)), rtol=0, atol=1e-9
        )


@pytest.mark.parametrize("efforts", [False, True])
def test_it_is_said_whether_efforts_are_in_the_messages(efforts: bool) -> None:
    output = {"columns": ["q", "qd", "tau"]} if efforts else {}
    plan = plan_job(
        job_from_text(json.dumps({**HEAD, "moves": [{**THERE, "duration": 2}], "output": output}))
    )
    said = recording_of(plan, LogOptions()).metadata["joint_states"]
    assert ("effort is empty" in said, "inverse dynamics" in said) == (not efforts, efforts)
