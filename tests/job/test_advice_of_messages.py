"""What the hints of wrong jobs advise: read as it is written, it is what was meant."""

from __future__ import annotations

from pathlib import Path

import pytest

from trajcli.errors import InputError
from trajcli.job.read import job_from_text
from trajcli.job.robot import load_robot


def hint_of(move: str, more: str = "", robot: str = "ur5e") -> str:
    text = (
        f"version: 1\nrobot: {robot}\nstart: {{joints: [0, -1.5, 1.5, 0, 1.5, 0]}}\n{more}\nmoves: [{move}]\n"
    )
    with pytest.raises(InputError) as caught:
        job_from_text(text)
    return str(caught.value.problems[0].hint)


TO = "to: {xyz: [0.4, 0, 0.3]}"
TCP = "limits: {tcp: {speed: 0.2, acceleration: 1}}"


@pytest.mark.parametrize(
    ("move", "more", "law"),
    [
        (f"{{planner: line, {TO}, duration: 2}}", "", "{shape: quintic, duration: 2}"),
        (f"{{planner: line, {TO}, duration: 2}}", TCP, "{duration: 2}"),
        (f"{{planner: line, {TO}, duration: 2, law: {{shape: cubic}}}}", "", "{shape: cubic, duration: 2}"),
        (f"{{planner: line, {TO}, time: 2, law: {{duration: 3}}}}", "", "{shape: quintic, duration: 3}"),
    ],
)
def test_fields_beside_a_law_join_it(move: str, more: str, law: str) -> None:
    assert hint_of(move, more).endswith(f"write `law: {law}`")


def test_arms_of_the_catalogue_have_limits_beside_them_and_keys_are_those_of_the_file() -> None:
    assert "`limits` beside `robot`" in hint_of(
        "{planner: hold, duration: 1}", robot="{name: ur5e, limits: {velocity: 1}}"
    )
    names = hint_of("{planner: hold, duration: 1}", "output: {zzzzzz: 1}")
    assert " for" in names
    assert "consumer" not in names


WORDS = {  # of other programs, and what they mean here
    "shape": "shape",
    "duration": "duration",
    "time": "duration",
    "minimum_duration": "minimum_duration",
    **dict.fromkeys(("speed", "velocity", "vel"), "speed"),
    **dict.fromkeys(("acceleration", "acc"), "acceleration"),
    "deceleration": "deceleration",
    "jerk": "jerk",
    "angular_speed": "angular_speed",
    "angular_acceleration": "angular_acceleration",
}


@pytest.mark.parametrize(("word", "field"), WORDS.items())
def test_a_word_beside_a_line_is_the_field_of_its_law(word: str, field: str) -> None:
    hint = hint_of(f"{{planner: line, {TO}, {word}: 0.5}}", TCP)
    assert hint == f"`{field}` stands under `law`: write `law: {{{field}: 0.5}}`"
    whole = hint_of(f"{{planner: line, {TO}, {word}: {{a: 1, b: 2}}}}", TCP)
    assert whole == f"`{field}` stands under `law`"


KEYS = [  # a move, a point or a joint with a word of other programs, and what is meant
    *((f"planner: cubic, duration: 1, {word}: home", "to") for word in ("target", "goal", "end", "waypoint")),
    ("planner: cubic, to: home, time: 1", "duration"),
    *((f"planner: spline, to: home, {word}: [home]", "through") for word in ("waypoints", "points")),
    *((f"planner: trapezoid, to: home, {word}: 1", "velocity") for word in ("vel", "Speed")),
    *((f"planner: trapezoid, to: home, {word}: 1", "acceleration") for word in ("acc", "ACCEL")),
    ("planner: trapezoid, to: home, decel: 1", "deceleration"),
    ("planner: cubic, to: {position: [1, 1, 1]}, duration: 1", "xyz"),
    ("planner: cubic, to: {xyz: [1, 1, 1], orientation: [1, 0, 0]}, duration: 1", "rpy"),
    ("planner: cubic, to: home, duration: 1, limits: {torque: 1}", "effort"),
    *((f"planner: jerk_limited, to: home, {word}: 1", "zone") for word in ("blend", "cnt", "z50", "C_PTP")),
]


@pytest.mark.parametrize(("move", "meant"), KEYS)
def test_a_word_of_another_program_is_the_key_that_is_meant(move: str, meant: str) -> None:
    assert hint_of(f"{{{move}}}", "points: {home: {joints: 0}}") == f"did you mean '{meant}'?"


def test_a_tool_has_its_word_in_the_job() -> None:
    assert hint_of("{planner: hold, duration: 1}", "tcp: {xyz: [0, 0, 0.1]}") == "did you mean 'tool'?"


def test_flaws_of_a_robot_file_come_in_the_order_of_the_file(tmp_path: Path) -> None:
    """Which is neither that of the model nor that of columns."""
    path = tmp_path / "arm.yaml"
    path.write_text(
        "tool: {xyz: [0, 0]}\nconvention: nope\njoints: [{a: x, theta: y}]\nbase: {xyz: [1, 2]}\n"
    )
    with pytest.raises(InputError) as caught:
        load_robot(path)
    places = [problem.place for problem in caught.value.problems]
    assert [(place.line, place.column) for place in places if place] == [
        (1, 13),
        (2, 13),
        (3, 14),
        (3, 24),
        (4, 13),
    ]
