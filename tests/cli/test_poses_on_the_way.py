"""`trajcli pose`: poses on the way to another one, and what is said of a pose beside its matrix."""

from __future__ import annotations

import numpy as np
import pytest
from arm_calls import Arms
from scipy.spatial.transform import Rotation

TURNED = "{rpy: [0, 0, 350]}"


@pytest.fixture
def arms(capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Arms:
    return Arms(capfd, monkeypatch)


@pytest.mark.parametrize(
    ("steps", "yaw"),
    [
        ((TURNED,), 175.0),  # as typed: from 350 down to 0
        ((TURNED, "{xyz: [1, 0, 0]}"), -5.0),  # a product has no angles that somebody typed
        ((TURNED, "--inverse"), 5.0),
    ],
)
def test_angles_go_evenly_as_they_were_typed(steps: tuple[str, ...], yaw: float, arms: Arms) -> None:
    words = ("pose", *steps, "--units", "deg", "--to", "{rpy: [0, 0, 0]}", "--orientation", "euler")
    told = arms.json(*words)
    assert [one["s"] for one in told] == [0.0, 0.5, 1.0]
    assert told[1]["rpy"] == pytest.approx([0, 0, yaw], abs=1e-9)


def test_the_triple_that_is_asked_for_goes_evenly(arms: Arms) -> None:
    first, last = ([0.1, 0.5, 0.3], [0.9, 1.1, -0.5])
    start, end = (f"{{euler: {{sequence: ZYZ, angles: {angles}}}}}" for angles in (first, last))
    words = (
        "pose",
        start,
        "--to",
        end,
        "--orientation",
        "euler",
        "--euler",
        "ZYZ",
        "--s",
        "0.5",
        "--point",
        "1",
        "2",
        "3",
    )
    (told,) = arms.json(*words)
    half = [0.5, 0.8, -0.1]
    assert told["euler"][0] == pytest.approx(half, abs=1e-12)
    turn = Rotation.from_euler("ZYZ", half)
    assert told["point"] == pytest.approx(turn.apply([1, 2, 3]), abs=1e-12)
    lines = [line.strip() for line in arms.call(*words).out.splitlines()]
    assert lines[0] == "s = 0.5"
    assert "euler ZYZ (rad): 0.5  0.8  -0.1" in lines
    other = [float(word) for word in lines[lines.index("euler ZYZ (rad): 0.5  0.8  -0.1") + 1].split()[1:]]
    assert Rotation.from_euler("ZYZ", other).as_matrix() == pytest.approx(turn.as_matrix(), abs=1e-8)
    (point,) = [line for line in lines if line.startswith("point (m): ")]
    assert [float(word) for word in point.split()[2:]] == pytest.approx(turn.apply([1, 2, 3]), abs=1e-8)


def test_angles_that_are_not_determined_are_said(arms: Arms) -> None:
    out = arms.call("pose", "{rpy: [0, 0, 30]}", "--units", "deg", "--euler", "ZYZ").out
    assert "\neuler: gimbal lock: " in out
    assert "first plus third = 30 deg" in out
    up = Rotation.from_euler("xyz", [np.pi / 2, 0, 0]).as_matrix().tolist()
    assert "gimbal lock" not in arms.call("pose", f"{{matrix: {up}}}", "--units", "deg", "--euler", "ZYZ").out


def test_options_of_the_way_need_its_end(arms: Arms) -> None:
    for words in (("--s", "0.5"), ("--path", "screw"), ("--orientation", "euler")):
        refused = arms.call("pose", TURNED, *words)
        assert (refused.code, refused.out) == (2, "")
        assert f"{words[0]} is about the way to another pose\n  name that pose with --to" in refused.err


def test_matrices_go_by_the_triple_that_is_asked_for(arms: Arms) -> None:
    ends = [
        Rotation.from_euler("ZYZ", angles).as_matrix().tolist()
        for angles in ([0.1, 0.5, 0.3], [0.9, 1.1, -0.5])
    ]
    start, end = (f"{{matrix: {matrix}}}" for matrix in ends)
    (told,) = arms.json("pose", start, "--to", end, "--orientation", "euler", "--euler", "ZYZ", "--s", "0.5")
    assert told["euler"][0] == pytest.approx([0.5, 0.8, -0.1], abs=1e-9)
