"""Data sheet of a robot: every number in the unit that its file has, reach by closed forms."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from trajcli.queries.arm import open_sheet
from trajcli.queries.robot_card import reach_of, robot_card, robot_row

FILE = """\
convention: standard
joints:
  - name: turn
    theta: 0.2
    d: 0.1
    a: 0.3
    alpha: 0.4
    position: [-2, 1.5]
    velocity: [-1, 2]
    acceleration: 3
    jerk: 50
    velocity_by_position: {deceleration: 5, offset: 0.5}
    effort: [-30, 20]
    friction: {coulomb: 1.5, viscous: 0.5}
    rotor: 0.02
    link: {mass: 3, com: [0.01, -0.02, 0.03], inertia: [0.1, 0.1, 0.1, 0, 0, 0]}
  - {name: slide, type: prismatic, sign: -1, theta: -0.3, d: 0.5, a: 0.2, position: [-0.1, 0.4], velocity: 0.6, acceleration: 0.7}
  - {name: roll, alpha: -1, beta: 0.01, velocity: [null, 2]}
base: {xyz: [1, 2, 3], rpy: [0.1, 0.2, 0.3]}
tool: {xyz: [0.04, 0, 0.03]}
"""
DEG = 180.0 / math.pi


def card_of(text: str, folder: Path) -> dict[str, Any]:
    path = folder / "arm.yaml"
    path.write_text(text)
    return robot_card("arm", open_sheet(str(path)))


def in_deg_and_mm(folder: Path) -> dict[str, Any]:
    """Return the card of the same arm in a file with units of its own."""
    text = FILE
    for plain, own in (
        ("theta: 0.2", f"theta: {0.2 * DEG!r}"),
        ("d: 0.1\n", "d: 100\n"),
        ("a: 0.3\n", "a: 300\n"),
        ("alpha: 0.4", f"alpha: {0.4 * DEG!r}"),
        ("[-2, 1.5]", f"[{-2 * DEG!r}, {1.5 * DEG!r}]"),
        ("[-1, 2]", f"[{-DEG!r}, {2 * DEG!r}]"),
        ("acceleration: 3", f"acceleration: {3 * DEG!r}"),
        ("jerk: 50", f"jerk: {50 * DEG!r}"),
        ("deceleration: 5, offset: 0.5", f"deceleration: {5 * DEG!r}, offset: {0.5 * DEG!r}"),
        ("[0.01, -0.02, 0.03]", "[10, -20, 30]"),
        ("theta: -0.3, d: 0.5, a: 0.2", f"theta: {-0.3 * DEG!r}, d: 500, a: 200"),
        ("[-0.1, 0.4], velocity: 0.6, acceleration: 0.7", "[-100, 400], velocity: 600, acceleration: 700"),
        ("alpha: -1, beta: 0.01", f"alpha: {-DEG!r}, beta: {0.01 * DEG!r}"),
        ("[null, 2]", f"[null, {2 * DEG!r}]"),
        (
            "[1, 2, 3], rpy: [0.1, 0.2, 0.3]",
            f"[1000, 2000, 3000], rpy: [{0.1 * DEG!r}, {0.2 * DEG!r}, {0.3 * DEG!r}]",
        ),
        ("[0.04, 0, 0.03]", "[40, 0, 30]"),
    ):
        assert plain in text
        text = text.replace(plain, own, 1)
    return card_of("units: {angle: deg, length: mm}\n" + text, folder)


@pytest.mark.parametrize("own", [False, True])
def test_every_number_of_the_file_comes_back_in_its_unit(own: bool, tmp_path: Path) -> None:
    angle, length = (DEG, 1000.0) if own else (1.0, 1.0)
    card = in_deg_and_mm(tmp_path) if own else card_of(FILE, tmp_path)
    turn, slide, roll = card["joints"]
    for joint, row in (
        (turn, (0.2, 0.1, 0.3, 0.4, 0)),
        (slide, (-0.3, 0.5, 0.2, 0, 0)),
        (roll, (0, 0, 0, -1, 0.01)),
    ):
        shown = [joint[key] for key in ("theta", "d", "a", "alpha", "beta")]
        assert shown == pytest.approx(np.array(row) * [angle, length, length, angle, angle])
    assert [joint["sign"] for joint in card["joints"]] == [1, -1, 1]
    for joint, limits, scale in (
        (
            turn,
            {"position": (-2, 1.5), "velocity": (-1, 2), "acceleration": (-3, 3), "jerk": (-50, 50)},
            angle,
        ),
        (slide, {"position": (-0.1, 0.4), "velocity": (-0.6, 0.6), "acceleration": (-0.7, 0.7)}, length),
    ):
        for quantity, bounds in limits.items():
            assert joint[quantity] == pytest.approx(np.array(bounds) * scale)
    assert slide["jerk"] is None
    assert roll["velocity"] == [None, pytest.approx(2 * angle)]
    assert turn["velocity_by_position"] == pytest.approx({"deceleration": 5 * angle, "offset": 0.5 * angle})
    dynamics = card["dynamics"]
    assert dynamics[0]["effort"] == [-30, 20]
    assert dynamics[0]["friction"] == {"coulomb": 1.5, "viscous": 0.5}
    assert dynamics[0]["rotor"] == 0.02
    assert dynamics[0]["link"]["com"] == pytest.approx(np.array([0.01, -0.02, 0.03]) * length)
    assert dynamics[1] == {"joint": "slide", "effort": None, "link": None}
    assert card["base"]["xyz"] == pytest.approx(np.array([1, 2, 3]) * length)
    assert card["base"]["rpy"] == pytest.approx(np.array([0.1, 0.2, 0.3]) * angle)
    turned = Rotation.from_euler("xyz", [0.1, 0.2, 0.3]).as_matrix()
    assert np.array(card["base"]["matrix"])[:3, :3] == pytest.approx(turned)
    assert card["tool"]["xyz"] == pytest.approx(np.array([0.04, 0, 0.03]) * length)
    bound = np.hypot(0.3, 0.1) + np.hypot(0.2, 0.6) + 0.05  # d of the slide: 0.5 + 0.1 to 0.5 - 0.4
    assert card["reach"]["bound"] == pytest.approx(bound * length)
    assert 0.5 * bound * length < card["reach"]["sampled"] < bound * length


def arm(joints: str, folder: Path, more: str = "") -> Path:
    (folder / "arm.yaml").write_text(f"convention: standard\njoints: [{joints}]\n{more}")
    return folder / "arm.yaml"


@pytest.mark.parametrize(
    ("joints", "more", "furthest"),
    [
        ("{a: 0.4}, {a: 0.3}", "base: {xyz: [5, -6, 7]}", 0.7),
        ("{a: 0.4}, {a: 0.3, position: [1.5707963267948966, 3]}", "", 0.5),
        (
            "{a: 0.4, position: [-7, 7]}, {a: 0.3, position: [-3, -2]}",
            "base: {xyz: [1, 2, 3]}",
            np.sqrt(0.25 + 0.24 * np.cos(2)),
        ),
        (
            "{type: prismatic, position: [-0.9, 0.4], alpha: 1.5707963267948966}, {type: prismatic, position: [0, 0.3]}",
            "base: {xyz: [0, 0, 9]}",
            np.hypot(0.9, 0.3),
        ),
        ("{type: prismatic, sign: -1, d: 0.1, position: [-0.2, 0.4]}", "tool: {xyz: [0.4, 0, 0]}", 0.5),
    ],
)
def test_the_reach_is_counted_from_the_base(joints: str, more: str, furthest: float, tmp_path: Path) -> None:
    reach = reach_of(open_sheet(str(arm(joints, tmp_path, more))).robot)
    assert reach is not None
    assert reach.sampled == pytest.approx(furthest, rel=2e-4)
    assert reach.bound >= furthest - 1e-12


def test_only_slides_without_an_end_make_it_unlimited(tmp_path: Path) -> None:
    for position in ("", ", position: [0, null]", ", position: [null, 0]"):
        two = "{type: prismatic, position: [0, 1]}"
        sheet = open_sheet(str(arm(f"{{type: prismatic{position}}}, {two}, {{a: 1}}", tmp_path)))
        reach = reach_of(sheet.robot)
        assert reach is not None
        assert (reach.sampled, reach.bound) == (np.inf, np.inf)
        assert robot_row("arm", sheet)["reach"] is None
        assert robot_card("arm", sheet)["reach"] == {"sampled": None, "bound": None}


@pytest.mark.parametrize(
    ("joints", "kind", "limits", "closed"),
    [
        ("{a: 1}, {a: 1, velocity: 2}, {a: 1}", "RRR", ["velocity"], True),
        ("{type: prismatic}, {a: 1}", "PR", [], False),
        (
            "{a: 1, position: [0, 1]}, {a: 1, alpha: 1}, {a: 1, alpha: 2}, {a: 1, d: 1, jerk: 1}",
            "4R",
            ["position", "jerk"],
            False,
        ),
    ],
)
def test_a_row_of_the_list(joints: str, kind: str, limits: list[str], closed: bool, tmp_path: Path) -> None:
    row = robot_row("arm", open_sheet(str(arm(joints, tmp_path))))
    assert (row["kind"], row["limits"], row["closed_form"]) == (kind, limits, closed)
    assert row["joints"] == joints.count("{")
    if kind == "RRR":
        assert row["reach"] == pytest.approx(3, rel=2e-4)


def test_the_reach_of_the_list_is_what_was_found_not_the_bound(tmp_path: Path) -> None:
    sheet = open_sheet(str(arm("{a: 1}, {a: 1, position: [1.5707963267948966, 3]}", tmp_path)))
    assert robot_row("arm", sheet)["reach"] == pytest.approx(np.sqrt(2), rel=2e-4)
