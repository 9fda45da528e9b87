"""Values on the command line: numbers with and without unit, poses, targets and payloads, as words or as files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.job.inline import inline_number, inline_payload, inline_pose, inline_target
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.units import Quantity, Units

DEG_MM = Units("deg", "mm")
ANGLE, LENGTH = Quantity("angle"), Quantity("length")


@pytest.mark.parametrize(
    ("word", "quantity", "si"),
    [
        ("90", ANGLE, np.pi / 2),
        ("-45.", ANGLE, -np.pi / 4),
        ("+.5e+2", LENGTH, 0.05),
        ("25E-1", LENGTH, 0.0025),
        ("1rad", ANGLE, 1.0),
        ("90 deg", ANGLE, np.pi / 2),
        ("2 m", LENGTH, 2.0),
        ("3 mm", LENGTH, 0.003),
        ("30", Quantity("angle", 1), np.pi / 6),
        ("0.5 rad/s", Quantity("angle", 1), 0.5),
        ("1e12", ANGLE, 1e12 * np.pi / 180),
        ("1e15", LENGTH, 1e12),
    ],
)
def test_a_plain_number_has_the_units_of_the_caller_any_other_its_own(
    word: str, quantity: Quantity, si: float
) -> None:
    assert inline_number(word, "q1", quantity, DEG_MM) == pytest.approx(si, rel=1e-15)


@pytest.mark.parametrize(
    "word", ["", "x", "1,5", "nan", "inf", "1e", "0x10", "1_000", "5 kg", "1e16", "1e13 m", "1e400", "²"]
)
def test_a_word_that_is_no_number_is_named(word: str) -> None:
    with pytest.raises(InputError, match=r"^q1: ") as caught:
        inline_number(word, "q1", LENGTH, DEG_MM)
    assert caught.value.problems[0].hint


POSE = "{xyz: [100, 0, -50], rotvec: [0, 0, 90]}"


@pytest.mark.parametrize("given", ["word", "file"])
def test_a_pose_and_a_payload_are_words_or_a_file(given: str, tmp_path: Path) -> None:
    load = "{mass: 2, com: [0, 10, 0], inertia: [1, 2, 3, 0, 0, 0]}"

    def word(text: str) -> str:
        if given == "word":
            return text
        (tmp_path / "value.yaml").write_text(text, encoding="utf-8")
        return f"@{tmp_path / 'value.yaml'}"

    wanted = [[0, -1, 0, 0.1], [1, 0, 0, 0], [0, 0, 1, -0.05], [0, 0, 0, 1]]
    np.testing.assert_allclose(inline_pose(word(POSE), "--tool", DEG_MM), wanted, atol=1e-15)
    np.testing.assert_allclose(inline_pose(word("{xyz: [1, 2, 3]}"), "--tool", Units())[:3, 3], [1, 2, 3])
    payload = inline_payload(word(load), DEG_MM)
    assert (payload.mass, *payload.com) == (2.0, 0.0, 0.01, 0.0)
    np.testing.assert_allclose(payload.inertia, np.diag([1.0, 2.0, 3.0]))  # kg m^2 in any units


@pytest.mark.parametrize(
    ("text", "places"),
    [
        ("{xyz: [1, 2, 3],\n  rotvec: [0, b, 1]}", [(2, 15)]),
        ("{xyz: [1, 2, 3],\n rotvec: [0, 0, 1],\n   tol: 3}", [(3, 4)]),
    ],
)
def test_a_flaw_of_a_pose_has_its_place(text: str, places: list[tuple[int, int]]) -> None:
    with pytest.raises(InputError) as caught:
        inline_pose(text, "--tool", DEG_MM)
    found = [problem.place for problem in caught.value.problems]
    assert [(place.line, place.column) for place in found if place is not None] == places


ROBOT = Robot(
    "arm", (Joint("turn"), Joint("slide", type="prismatic")), unlimited(2), "standard", np.eye(4), np.eye(4)
)


def test_a_target_is_read_in_the_units_and_may_pin_joints() -> None:
    target = inline_target("{xyz: [100, 0, 50], joints: {slide: 30}}", DEG_MM, ROBOT)
    np.testing.assert_allclose(target.xyz, [0.1, 0, 0.05])
    assert target.pins == pytest.approx({1: 0.03})
    with pytest.raises(InputError, match="fixes nothing"):
        inline_target("{joints: {turn: 30}}", DEG_MM, ROBOT)
