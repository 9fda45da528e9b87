"""What is said of a robot that was read from a URDF, and angles next to right ones; bounds are of closed form."""

from __future__ import annotations

import re
from math import pi

import numpy as np
import pytest

from trajcli.urdf.serial_robot import SnappedAngle, UrdfRobot, robot_of_urdf

LIMIT = '<limit lower="-1" upper="1" effort="5" velocity="2"/>'
MASS = (
    '<inertial><origin xyz="{}"/><mass value="{}"/>'
    '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial>'
)


def link(name: str, com: str = "", mass: float = 1.0) -> str:
    return f'<link name="{name}">{MASS.format(com, mass) if com else ""}</link>'


def joint(
    name: str, parent: str, child: str, origin: str = "", kind: str = "revolute", limit: str = LIMIT
) -> str:
    inside = f'<parent link="{parent}"/><child link="{child}"/><axis xyz="0 0 1"/><origin {origin}/>'
    return f'<joint name="{name}" type="{kind}">{inside}{"" if kind == "fixed" else limit}</joint>'


def read(*parts: str, **options: str | bool) -> UrdfRobot:
    return robot_of_urdf(f'<robot name="arm">{"".join(parts)}</robot>'.encode(), "arm.urdf", **options)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "distance", [*np.geomspace(1.23e-9, 9.87e3, 60).tolist(), 0.01, 1.0, 1.0049, 9.999, 99.96]
)
def test_a_bound_in_words_is_above_the_bound_and_next_to_it(distance: float) -> None:
    angle = SnappedAngle("j1", "y", 1.5708, pi / 2, distance)
    said = f"j1: rpy about y 1.5708 taken as {pi / 2!r}, moves the tcp by at most "
    found = re.fullmatch(re.escape(said) + r"(\S+) m", str(angle))
    assert found is not None
    assert distance <= float(found[1]) <= 1.0101 * distance


@pytest.mark.parametrize("count", [1, 2])
def test_remarks_hold_the_chain_the_sums_and_each_angle(count: int) -> None:
    """Behind the last angle is 1 m, behind the first one 3 m: each moves the tcp by its size times that."""
    off = 7.7049e-6  # rounded to three digits this, its double and its fourfold are smaller
    first = pi / 2 + (off if count == 2 else 0.0)
    arm = read(
        *map(link, ("base", "l1", "l2", "tip", "lamp", *(["camera"] if count == 2 else ()))),
        joint("j1", "base", "l1", f'rpy="{first!r} 0 0"'),
        joint("j2", "l1", "l2", f'xyz="2 0 0" rpy="0 {off!r} 0"'),
        joint("end", "l2", "tip", 'xyz="0 1 0"', "fixed"),
        *([joint("side", "l2", "camera", kind="fixed")] if count == 2 else ()),
        joint("other", "base", "lamp"),
        tip="tip",
    )
    assert arm.robot.name == "arm"
    chain, sums, *angles = arm.remarks
    assert chain.startswith("from link base to link tip; the tree also ends in ")
    assert set(chain.partition("ends in ")[2].split(", ")) == {"lamp", "camera"} - (
        {"camera"} if count == 1 else set()
    )
    begins = "1 angle of" if count == 1 else "2 angles of"
    assert sums.startswith(f"{begins} joint origins within 0.001 rad of whole right angles taken as these: ")
    found = re.search(r"at most (\S+) m and turns by at most (\S+) rad; `exact` keeps all digits", sums)
    assert found is not None
    moved, turned = off * (4 if count == 2 else 1), off * count
    assert moved * (1 - 1e-9) <= float(found[1]) <= 1.0101 * moved
    assert turned * (1 - 1e-9) <= float(found[2]) <= 1.0101 * turned
    assert [text.partition(" rpy")[0] for text in angles] == ["j1:", "j2:"][2 - count :]
    exact = read(*map(link, ("base", "l1")), joint("j1", "base", "l1", f'rpy="{first!r} 0 0"'), exact=True)
    assert exact.remarks == ("from link base to link l1",)


@pytest.mark.parametrize("off", [-9.9e-4, -1e-5, 1e-5, 9.9e-4])
def test_an_angle_is_taken_as_right_from_either_side_whatever_the_others_are(off: float) -> None:
    arm = read(*map(link, ("base", "l1")), joint("j1", "base", "l1", f'rpy="{pi / 2 + off!r} 0.3 -0.7"'))
    (angle,) = arm.snapped
    assert (angle.joint, angle.axis, angle.taken) == ("j1", "x", pi / 2)
    assert angle.written == pi / 2 + off
    assert arm.turn == pytest.approx(abs(off), rel=1e-9)
    outside = pi / 2 + (1.02e-3 if off > 0 else -1.02e-3)
    beyond = read(*map(link, ("base", "l1")), joint("j1", "base", "l1", f'rpy="{outside!r} 0 0"'))
    assert beyond.snapped == ()


def test_the_mass_behind_a_fixed_joint_stands_where_the_snapped_angle_puts_it() -> None:
    arm = read(
        link("base"), link("l1"), link("tip", "0 2 0"),
        joint("j1", "base", "l1"), joint("end", "l1", "tip", 'rpy="1.5708 0 0"', "fixed"),
    )  # fmt: skip
    inertia = arm.robot.joints[0].link
    assert inertia is not None
    assert np.abs(np.array(inertia.com)).max() == 2.0
    assert np.count_nonzero(np.abs(np.array(inertia.com)) > 1e-12) == 1


def test_a_flaw_beside_the_chain_leaves_out_what_is_behind_it_alone() -> None:
    arm = read(
        link("base"), link("l1", "0 0 0", 2.0), link("a", "0 0 0", 3.0), link("b", "0 0 0", 5.0),
        joint("j1", "base", "l1"), joint("x", "l1", "a", 'xyz="0 q 0"', "fixed"), joint("y", "l1", "b", "", "fixed"),
        tip="l1",
    )  # fmt: skip
    inertia = arm.robot.joints[0].link
    assert inertia is not None
    assert inertia.mass == 2.0 + 5.0
    (note,) = [note for note in arm.remarks if note.startswith("joint x: ")]
    assert note.endswith("; the links behind it are left out")


def test_a_note_on_any_joint_is_a_remark() -> None:
    bare = '<limit lower="-1" upper="1" effort="5"/>'
    arm = read(
        *map(link, ("base", "l1", "l2")), joint("j1", "base", "l1"), joint("j2", "l1", "l2", limit=bare)
    )
    assert np.isinf(arm.robot.limits.velocity[1]).all()
    assert [note for note in arm.remarks if "j2" in note]
    assert not [note for note in arm.remarks if "j1" in note]


def test_all_trees_that_were_passed_over_are_named() -> None:
    arm = read(
        *map(link, ("base", "l1", "l2", "b1", "b2", "c1", "c2")),
        joint("j1", "base", "l1"), joint("j2", "l1", "l2"), joint("k", "b1", "b2"), joint("m", "c1", "c2"),
    )  # fmt: skip
    said = "the file has 3 trees of links, and the arm is that of root 'base'; the others begin at b1, c1: "
    assert arm.choice is not None
    assert arm.choice.startswith(said)
    assert arm.choice in arm.remarks
