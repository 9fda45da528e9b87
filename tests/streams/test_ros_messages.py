"""Joint trajectories of ROS in YAML: every form of the same message is the same motion, and others are refused."""

from __future__ import annotations

import json
from decimal import Decimal
from pathlib import Path
from typing import Any

import pytest
import yaml

from trajcli.errors import InputError
from trajcli.streams.ros_messages import JointMessage, read_ros_yaml

TIMES = ["{sec: 2, nanosec: 500000000}", "{secs: 2, nsecs: 500000000}", "{sec: 2, nsecs: 500000000}", "2.5"]


def read(path: Path, text: str | bytes) -> JointMessage:
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return read_ros_yaml(path)


def message(time: str = "2.5", first: str = "[0, 1.25]", last: str = "[1e-3, 2.5]", more: str = "") -> str:
    return (
        "joint_names: [a, b]\npoints:\n"
        f"- {{positions: {first}, time_from_start: {{sec: 0, nanosec: 0}}{more}}}\n"
        f"- {{positions: {last}, time_from_start: {time}{more}}}\n"
    )


@pytest.mark.parametrize("time", TIMES)
def test_numbers_and_their_decimals(tmp_path: Path, time: str) -> None:
    """The most decimals of each column: a whole number has none, 1e-3 has three, a time in nanoseconds nine."""
    found = read(tmp_path / "a.yaml", message(time, more=", velocities: [0.5, 1], effort: []"))
    assert found.joint_names == ("a", "b")
    assert found.times.tolist() == [0, 2.5]
    assert found.position.tolist() == [[0, 1.25], [1e-3, 2.5]]
    assert found.velocity.tolist() == [[0.5, 1]] * 2
    assert (found.acceleration.shape, found.effort.shape) == ((2, 0), (2, 0))
    assert found.decimals.tolist() == [9, 3, 2, 1, 0]
    plain = read(tmp_path / "a.yaml", message(time).replace("{sec: 0, nanosec: 0}", "0.0"))
    assert plain.decimals[0] == (1 if time == "2.5" else 9)


def indented(text: str, by: str) -> str:
    return "".join(f"{by}{line}\n" for line in text.splitlines())


@pytest.mark.parametrize(
    "around",
    [
        "{0}",
        "\ufeff{0}",
        "# a word\n---\n{0}",
        "\ufeff# a word\n---\n{0}",
        "%YAML 1.1\n---\n{0}",
        "{0}---\njoint_names: [c]\npoints: []\n",
        "{0}...\n",
        "goal:\n  trajectory:\n{4}",
        "trajectory:\n- joint_trajectory:\n{4}- joint_trajectory: {{joint_names: [c], points: []}}\n",
        "planned_trajectory: {{robot_trajectory: {json}}}\n",
    ],
)
def test_a_message_is_found_in_what_is_around_it(tmp_path: Path, around: str) -> None:
    inner = {"joint_names": ["a"], "points": [{"positions": [0.5], "time_from_start": {"sec": 1}}]}
    text = "joint_names: [a]\npoints: [{positions: [0.5], time_from_start: {sec: 1}}]\n"
    parts: dict[str, Any] = {"json": json.dumps(inner)}
    found = read(tmp_path / "a.yaml", around.format(text, "", "", "", indented(text, "    "), **parts))
    assert (found.joint_names, found.times.tolist(), found.position.tolist()) == (("a",), [1], [[0.5]])


WRONG = [
    (message(last="[1, 2, 3]"), "positions of point 1"),
    (message(last="[1]"), "positions of point 1"),
    (message(last="[1, true]"), "positions of point 1"),
    (message(last="[1, 1e301]"), "positions of point 1"),
    (message(last="[1, .nan]"), "positions of point 1"),
    (message().replace("}\n-", ", velocities: [1, 2]}\n-"), "give velocities for all points"),
    (message("{}"), "time_from_start of point 1"),
    (message("{sec: 1, minutes: 2}"), "time_from_start of point 1"),
    (message("{sec: 99999999999}"), "time_from_start of point 1"),
    (message("soon"), "time_from_start of point 1"),
    (message().replace("[a, b]", "[a, 2]"), "joint_names are"),
    (message().replace("[a, b]", "[]"), "joint_names are"),
    ("joint_names: [a]\npoints: []\n", "points are"),
    ("points: [{positions: [1]}]\n", "holds no joint trajectory"),
    ("version: 1\nmoves: []\n", "is a job, and no motion yet"),
    (message() + "- '...'\n", "the message is cut"),
    (message(first="[0, '...']"), "the message is cut"),
]


@pytest.mark.parametrize(("text", "said"), WRONG)
def test_what_is_no_message_is_refused(tmp_path: Path, text: str, said: str) -> None:
    with pytest.raises(InputError) as caught:
        read(tmp_path / "a.yaml", text)
    (problem,) = caught.value.problems
    assert said in f"{problem.message} ({problem.hint})"


@pytest.mark.parametrize("gap", ["", "\n", "\n\n\n", "  \n\n"])
@pytest.mark.parametrize("dash", ["- ", "  - "])
def test_the_line_at_which_a_message_is_cut_is_told(tmp_path: Path, gap: str, dash: str) -> None:
    text = f"{message()}{gap}{dash}'...'\n"
    with pytest.raises(InputError, match="the message is cut") as caught:
        read(tmp_path / "a.yaml", text)
    place = caught.value.problems[0].place
    assert place is not None
    assert text.splitlines()[place.line - 1].strip() == "- '...'"


def test_what_is_no_yaml_is_told_at_its_place(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is no YAML") as caught:
        read(tmp_path / "a.yaml", "joint_names: [a]\npoints: @\n")
    place = caught.value.problems[0].place
    assert place is not None
    assert (place.line, place.column) == (2, 9)


def test_numbers_with_exponents_alone_are_numbers_with_any_sign(tmp_path: Path) -> None:
    """As ROS 1 prints them, without a point."""
    found = read(tmp_path / "a.yaml", message(first="[-1e-05, 1e-05]", last="[+1e1, -5e+0]"))
    assert found.position.tolist() == [[-1e-05, 1e-05], [10.0, -5.0]]
    assert found.decimals[1:].tolist() == [5, 5]


@pytest.mark.parametrize("number", [7e-9, -2e-5, 1.5e-8, 3e-10])
def test_a_point_that_yaml_asks_for_is_no_decimal(tmp_path: Path, number: float) -> None:
    """As PyYAML, and so ROS 2 and `convert`, print numbers: 7.0e-09 has nine decimals, as 0.000000007 has."""
    printed = yaml.safe_dump(number, default_flow_style=True).split()[0]
    found = read(tmp_path / "a.yaml", message(first=f"[{printed}, 0.5]"))
    assert found.position[0, 0] == number
    assert found.decimals[1] == -Decimal(repr(number)).as_tuple().exponent
