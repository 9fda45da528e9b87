"""MoveIt's joint_limits.yaml under `limits: {file: ...}`: its flags, nesting, notes and flaws."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from math import inf
from pathlib import Path

import numpy as np
import pytest

from trajcli.errors import FileError, InputError
from trajcli.job.dump import dump_job
from trajcli.job.limits_file import with_limits, with_limits_file
from trajcli.job.read import LoadedJob, files_of, job_from_text, load_job
from trajcli.kinematics.robot import unlimited
from trajcli.units import Units

JOB = """\
version: 1
units: {{angle: deg, length: mm}}
robot:
  joints:
    - {{name: turn, velocity: 200, acceleration: 500, position: [-170, 170]}}
    - {{name: slide, type: prismatic, velocity: 1000}}
limits: {{file: joint_limits.yaml{more}}}
start: {{joints: [0, 0]}}
moves: [{{planner: hold, duration: 1}}]
"""
TURN = "    has_velocity_limits: true\n    max_velocity: 2\n"


def load(folder: Path, limits: str, more: str = "") -> LoadedJob:
    (folder / "joint_limits.yaml").write_text(limits)
    (folder / "job.yaml").write_text(JOB.format(more=more))
    return load_job(folder / "job.yaml")


def of_joint(loaded: LoadedJob, joint: int = 0) -> dict[str, list[float]]:
    limits = loaded.robot.limits
    names = ("position", "velocity", "acceleration", "jerk")
    return {name: getattr(limits, name)[joint].tolist() for name in names}


def notes(loaded: LoadedJob) -> list[str]:
    return [event.text() for event in loaded.events if event.kind == "limits_file"]


def test_values_are_si_integers_are_numbers_and_what_is_left_out_is_the_robots(tmp_path: Path) -> None:
    loaded = load(
        tmp_path,
        "joint_limits:\n  turn:\n" + TURN + "    has_jerk_limits: true\n    max_jerk: 40\n"
        "  slide:\n    has_velocity_limits: true\n    max_velocity: 0.25\n"
        "    has_position_limits: true\n    min_position: 0\n    max_position: 1\n",
    )
    own = np.deg2rad([500, 170])
    assert of_joint(loaded) == {
        "position": pytest.approx([-own[1], own[1]]),
        "velocity": [-2.0, 2.0],
        "acceleration": pytest.approx([-own[0], own[0]]),
        "jerk": [-40.0, 40.0],
    }
    assert of_joint(loaded, 1) == {
        "position": [0.0, 1.0],
        "velocity": [-0.25, 0.25],
        "acceleration": [-inf, inf],
        "jerk": [-inf, inf],
    }
    assert notes(loaded) == []


@pytest.mark.parametrize(
    "around",
    [
        "joint_limits:\n",
        "robot_description_planning:\n  joint_limits:\n",
        "/**:\n  ros__parameters:\n    robot_description_planning:\n      joint_limits:\n",
        "move_group:\n  ros__parameters:\n    joint_limits:\n",
    ],
)
def test_the_limits_are_found_where_packages_nest_them(tmp_path: Path, around: str) -> None:
    indent = " " * (len(around.splitlines()[-1]) - len(around.splitlines()[-1].lstrip()) + 2)
    text = f"{around}{indent}turn: {{has_velocity_limits: true, max_velocity: 2}}\n"
    assert of_joint(load(tmp_path, text))["velocity"] == [-2.0, 2.0]


def test_the_flags_decide(tmp_path: Path) -> None:
    off = "{has_velocity_limits: false, max_velocity: 2, max_acceleration: 3, has_position_limits: false}"
    loaded = load(tmp_path, f"joint_limits: {{turn: {off}, slide: {{has_velocity_limits: no}}}}\n")
    turn = of_joint(loaded)
    assert turn["velocity"] == [-inf, inf]
    assert turn["acceleration"] == [-3.0, 3.0]  # no flag: the value counts
    assert turn["position"] == [-inf, inf]
    assert of_joint(loaded, 1)["velocity"] == [-inf, inf]
    looser = [event for event in loaded.events if event.kind == "looser_limit"]
    assert len(looser) == 3


def test_pilz_deceleration_makes_a_pair_by_direction_and_is_noted(tmp_path: Path) -> None:
    text = "joint_limits: {turn: {max_acceleration: 4, has_deceleration_limits: true, max_deceleration: -6}}"
    loaded = load(tmp_path, text + "\n")
    assert of_joint(loaded)["acceleration"] == [-6.0, 4.0]
    assert any("turn" in note and "by direction" in note for note in notes(loaded))
    loaded = load(tmp_path, "joint_limits: {turn: {max_deceleration: -6}}\n")
    assert of_joint(loaded)["acceleration"] == pytest.approx([-6.0, np.deg2rad(500)])
    loaded = load(tmp_path, "joint_limits: {turn: {has_deceleration_limits: false, max_deceleration: -6}}\n")
    assert of_joint(loaded)["acceleration"] == pytest.approx(np.deg2rad([-500, 500]))


def test_other_keys_of_limits_win_joint_by_joint_and_scale_comes_last(tmp_path: Path) -> None:
    text = "joint_limits: {turn: {max_velocity: 2, max_jerk: 9}, slide: {max_velocity: 0.2}}\n"
    loaded = load(tmp_path, text, ", velocity: {turn: 90}, jerk: null, scale: {velocity: 0.5}")
    assert of_joint(loaded)["velocity"] == pytest.approx(np.deg2rad([-45, 45]))
    assert of_joint(loaded, 1)["velocity"] == [-0.1, 0.1]
    assert of_joint(loaded)["jerk"] == [-inf, inf]


def test_what_is_ignored_is_said(tmp_path: Path) -> None:
    loaded = load(
        tmp_path,
        "default_velocity_scaling_factor: 0.1\ndefault_acceleration_scaling_factor: 0.2\n"
        "joint_limits:\n  turn:\n" + TURN + "    angle_wraparound: false\n    has_effort_limits: true\n"
        "    max_effort: 20\n    soft_lower_limit: -2\n    k_velocity: 3\n"
        "    pid: {p: 100, i: 1, d: 10}\n  finger: {has_velocity_limits: true, max_velocity: 1}\n",
    )
    assert of_joint(loaded)["velocity"] == [-2.0, 2.0]
    said = "\n".join(notes(loaded))
    assert "default_velocity_scaling_factor 0.1 and default_acceleration_scaling_factor 0.2 ignored" in said
    assert "has limits of finger, which the robot does not have: ignored" in said
    assert "has no limits of slide: the robot's own hold" in said
    assert len(notes(loaded)) == 3


def test_a_limit_looser_than_the_robots_is_an_event(tmp_path: Path) -> None:
    loaded = load(tmp_path, "joint_limits: {turn: {max_velocity: 100}}\n")
    (event,) = [event for event in loaded.events if event.kind == "looser_limit"]
    assert "the job's velocity limit of turn is looser than the robot's" in event.text()


def test_a_resolved_job_holds_the_numbers_and_needs_no_file(tmp_path: Path) -> None:
    loaded = load(tmp_path, "joint_limits: {turn: {max_velocity: 1.7, max_acceleration: 3}}\n")
    second = job_from_text(dump_job(loaded))
    for name in ("position", "velocity", "acceleration", "jerk"):
        assert np.array_equal(getattr(loaded.robot.limits, name), getattr(second.robot.limits, name))
    assert not [event for event in second.events if event.kind == "limits_file"]


AROUND = {"joint_limits": {"turn": {"max_velocity": 1.7, "has_velocity_limits": True}}}


@pytest.mark.parametrize("limits", [AROUND, {"/**": {"ros__parameters": AROUND}}])
@pytest.mark.parametrize("given", ["option", "file", "named", "mapping"])
def test_limits_of_a_check_may_be_of_moveit_however_they_are_given(
    tmp_path: Path, limits: dict[str, object], given: str
) -> None:
    """In an option, in its file, in a file that it names, and from Python: as the job does that names them."""
    loaded = load(tmp_path, json.dumps(limits))
    robot = replace(loaded.robot, limits=unlimited(2))
    texts = {
        "option": json.dumps(limits),
        "file": str(tmp_path / "joint_limits.yaml"),
        "named": f"{{file: {tmp_path / 'joint_limits.yaml'}}}",
    }
    if given == "mapping":
        found, events = with_limits(robot, limits)
    else:
        found, events = with_limits_file(robot, texts[given], Units())
    assert found.limits.velocity.tolist() == [[-1.7, 1.7], [-inf, inf]]
    assert [event.text().partition(" has no ")[2] for event in events] == [
        "limits of slide: the robot's own hold"
    ]


def test_a_flaw_of_limits_in_an_option_has_its_place_there(tmp_path: Path) -> None:
    robot, text = load(tmp_path, json.dumps(AROUND)).robot, "{joint_limits: {turn: {max_velocity: -2}}}"
    with pytest.raises(InputError, match="expected a number above 0, got -2") as caught:
        with_limits_file(robot, text, Units())
    assert str(caught.value.problems[0].place) == f"--limits:1:{text.index('-2') + 1}"


def test_the_file_is_one_that_outputs_may_not_overwrite(tmp_path: Path) -> None:
    loaded = load(tmp_path, "joint_limits: {turn: {max_velocity: 1.7}}\n")
    assert ("the file of limits", str(tmp_path / "joint_limits.yaml")) in list(files_of(loaded.document))


@pytest.mark.parametrize(
    ("turn", "message", "at"),
    [
        ("max_velocity: -1", "expected a number above 0, got -1", (3, 19)),
        ("max_velocity: fast", 'expected a number, got "fast"', (3, 19)),
        ("max_velocity: true", "expected a number .rad/s., got true", (3, 19)),
        ("max_velocity: null", "got null", (3, 19)),
        ("max_velocity: 1e40", "expected a magnitude of at most", (3, 19)),
        ("has_velocity_limits: true", "has_velocity_limits is true, but max_velocity is not given", (3, 5)),
        ("has_position_limits: true", "min_position and max_position is not given", (3, 5)),
        ("has_velocity_limits: 3", "expected true or false, got 3", (3, 26)),
        ("max_deceleration: 6", "expected a number below 0, got 6", (3, 23)),
        ("max_velocty: 2", "unknown key 'max_velocty'", (3, 5)),
        ("min_position: 1\n    max_position: 1", "expected min_position below max_position", (4, 19)),
        ("max_position: -9", "expected min_position below max_position", (3, 19)),
    ],
)
def test_flaws_say_where_they_stand_in_that_file(
    tmp_path: Path, turn: str, message: str, at: tuple[int, int]
) -> None:
    with pytest.raises(InputError, match=message) as caught:
        load(tmp_path, f"joint_limits:\n  turn:\n    {turn}\n")
    (problem,) = caught.value.problems
    place = problem.place
    assert place is not None
    assert (Path(place.file).name, place.line, place.column) == ("joint_limits.yaml", *at)


def test_all_flaws_of_the_file_come_at_once(tmp_path: Path) -> None:
    text = "joint_limits: {turn: {max_velocity: 0, max_jerk: x}, slide: {max_deceleration: 0}}\n"
    with pytest.raises(InputError) as caught:
        load(tmp_path, text)
    assert len(caught.value.problems) == 3


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("limits: {turn: {max_velocity: 1}}\n", "expected a key `joint_limits`"),
        ("joint_limits: [1, 2]\n", "expected a mapping, got a list"),
        ("joint_limits: {turn: 3}\n", "expected a mapping, got 3"),
        ("joint_limits: {}\n", "no joint has limits here"),
        ("joint_limits: {trun: {max_velocity: 1}}\n", "none of the joints here is one of the robot's"),
    ],
)
def test_files_of_something_else_are_refused(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load(tmp_path, text)


def test_the_job_says_what_names_the_file(tmp_path: Path) -> None:
    (tmp_path / "job.yaml").write_text(JOB.format(more=""))
    with pytest.raises(FileError) as caught:
        load_job(tmp_path / "job.yaml")
    place = caught.value.problems[0].place
    assert place is not None
    assert (Path(place.file).name, place.line) == ("job.yaml", 7)


@pytest.mark.parametrize("value", ["3", "[a]", "null", '""'])
def test_the_name_of_the_file_is_a_text(tmp_path: Path, value: str) -> None:
    text = JOB.format(more="").replace("joint_limits.yaml", value)
    (tmp_path / "job.yaml").write_text(text)
    with pytest.raises(InputError) as caught:
        load_job(tmp_path / "job.yaml")
    assert caught.value.problems[0].place is not None


def test_a_move_names_no_file(tmp_path: Path) -> None:
    text = JOB.format(more="").replace("duration: 1", "duration: 1, limits: {file: joint_limits.yaml}")
    (tmp_path / "joint_limits.yaml").write_text("joint_limits: {turn: {max_velocity: 1}}\n")
    (tmp_path / "job.yaml").write_text(text)
    with pytest.raises(InputError, match="unknown key 'file'"):
        load_job(tmp_path / "job.yaml")


def test_one_sided_limits_are_written_with_null_and_read_again(tmp_path: Path) -> None:
    text = "joint_limits: {turn: {max_jerk: 3}, slide: {max_deceleration: -2, min_position: 1}}\n"
    loaded = load(tmp_path, text)
    assert of_joint(loaded, 1)["position"] == [1, inf]
    assert of_joint(loaded, 1)["acceleration"] == [-2, inf]
    again = job_from_text(dump_job(loaded))
    assert [of_joint(again, joint) for joint in (0, 1)] == [of_joint(loaded, joint) for joint in (0, 1)]


def test_factors_beside_the_joints_are_noted_and_are_none_of_them(tmp_path: Path) -> None:
    factors = "  default_velocity_scaling_factor: 0.1\n  default_acceleration_scaling_factor: 0.2\n"
    loaded = load(tmp_path, "joint_limits:\n" + factors + "  turn:\n" + TURN + "  slide: {max_jerk: 3}\n")
    (said,) = [note for note in notes(loaded) if "ignored" in note]
    assert "default_velocity_scaling_factor 0.1 and default_acceleration_scaling_factor 0.2 ignored" in said


@pytest.mark.parametrize(
    ("entry", "unit"),
    [("max_velocity", "m/s"), ("max_deceleration", "m/s^2"), ("max_jerk", "m/s^3"), ("min_position", "m")],
)
def test_numbers_of_a_slide_are_lengths(entry: str, unit: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=re.escape(f"expected a number ({unit}), got true")):
        load(tmp_path, f"joint_limits:\n  slide:\n    {entry}: true\n")


def test_a_number_that_no_robot_has_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected at least 1e-12 rad/s, got 1e-300"):
        load(tmp_path, "joint_limits:\n  turn:\n    max_velocity: 1e-300\n")


@pytest.mark.parametrize(
    ("turn", "velocity"),
    [(word, 2.0) for word in ("yes", "ON", "on", "true", '"Yes"')]
    + [(word, inf) for word in ("no", "Off", "off", "false", '"NO"')],
)
def test_flags_are_the_words_that_ros_reads(turn: str, velocity: float, tmp_path: Path) -> None:
    loaded = load(tmp_path, f"joint_limits: {{turn: {{has_velocity_limits: {turn}, max_velocity: 2}}}}\n")
    assert of_joint(loaded)["velocity"] == [-velocity, velocity]


def test_one_end_that_leaves_nothing_of_the_robots_range_is_shown_where_it_stands(tmp_path: Path) -> None:
    """The robot's own range ends at 170 deg, 2.967 rad."""
    with pytest.raises(InputError, match=r"got 3 and 2\.96705973") as caught:
        load(tmp_path, "joint_limits:\n  turn:\n    max_velocity: 1\n    min_position: 3\n")
    (place,) = (problem.place for problem in caught.value.problems)
    assert place is not None
    assert (place.line, place.column) == (4, 19)


@pytest.mark.parametrize(
    ("text", "message", "hint", "at"),
    [
        (
            "a: 1\njoint_limts: {turn: {max_velocity: 1}}\n",
            "expected a key",
            "is `joint_limts` meant?",
            (1, 1),
        ),
        ("joint_limits:\n  trun: {max_jerk: 1}\n", "the first is 'trun'", "did you mean 'turn'?", (2, 3)),
        (
            "joint_limits:\n  default_velocity_scaling_factor: 1\n  finger: {max_jerk: 1}\n",
            "the first is 'finger'",
            "turn, slide",
            (3, 3),
        ),
        (
            "joint_limits:\n  default_velocity_scaling_factor: 1\n",
            "no joint has limits here",
            "turn, slide",
            (2, 3),
        ),
        (
            "joint_limits:\n  slide: {max_deceleration: 1}\n",
            "expected a number below 0, got 1",
            "a deceleration is negative",
            (2, 29),
        ),
        ("joint_limits:\n  slide: {max_deceleration: -1e-300}\n", "at least 1e-12 m/s^2", "", (2, 29)),
    ],
)
def test_what_is_wrong_says_what_is_meant_and_where(
    tmp_path: Path, text: str, message: str, hint: str, at: tuple[int, int]
) -> None:
    with pytest.raises(InputError) as caught:
        load(tmp_path, text)
    (problem,) = caught.value.problems
    assert message in problem.text()
    assert hint in (problem.hint or "")
    assert problem.place is not None
    assert (problem.place.line, problem.place.column) == at


def test_an_end_next_to_zero_is_one(tmp_path: Path) -> None:
    loaded = load(tmp_path, "joint_limits: {slide: {min_position: 1e-300}}\n")
    assert of_joint(loaded, 1)["position"] == [1e-300, inf]


def test_the_note_on_a_deceleration_names_its_joints_in_the_order_of_the_robot(tmp_path: Path) -> None:
    text = "joint_limits: {slide: {max_deceleration: -2}, turn: {max_deceleration: -6}}\n"
    (note,) = notes(load(tmp_path, text))
    wanted = " gives turn, slide a deceleration: this pair of limits is by direction, not by braking"
    assert note.endswith(wanted)


@pytest.mark.parametrize(
    ("count", "listed"),
    [(8, "f0, f1, f2, f3, f4, f5, f6, f7"), (11, "f0, f1, f10, f2, f3, f4, f5, f6 and 3 more")],
)
def test_a_note_lists_eight_names_and_counts_the_others(count: int, listed: str, tmp_path: Path) -> None:
    others = "".join(f", f{k}: {{max_jerk: 1}}" for k in reversed(range(count)))
    loaded = load(tmp_path, f"joint_limits: {{turn: {{max_jerk: 1}}, slide: {{max_jerk: 1}}{others}}}\n")
    (note,) = notes(loaded)
    assert f"has limits of {listed}, which the robot does not have: ignored" in note


def test_a_joint_of_which_the_file_says_nothing_keeps_its_own(tmp_path: Path) -> None:
    loaded = load(tmp_path, "joint_limits:\n  turn:\n  slide: {max_velocity: 0.5}\n")
    assert of_joint(loaded)["velocity"] == pytest.approx(np.deg2rad([-200, 200]))
    assert of_joint(loaded, 1)["velocity"] == [-0.5, 0.5]
