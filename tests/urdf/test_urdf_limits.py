"""Limits, friction and inertia of a URDF: what counts, and what is a placeholder."""

from __future__ import annotations

from math import inf

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.kinematics.robot import Friction, LinkInertia
from trajcli.urdf.serial_robot import UrdfRobot, robot_of_urdf


def arm(inside: str, kind: str = "revolute", link: str = "", **options: object) -> UrdfRobot:
    text = (
        f'<robot name="r"><link name="a"/><link name="b">{link}</link><joint name="j" type="{kind}">'
        f'<parent link="a"/><child link="b"/><axis xyz="0 0 1"/>{inside}</joint></robot>'
    )
    return robot_of_urdf(text.encode(), "r.urdf", **options)  # type: ignore[arg-type]


def bounds(found: UrdfRobot) -> dict[str, tuple[float, float]]:
    names = ("position", "velocity", "acceleration", "jerk")
    rows = {name: tuple(getattr(found.robot.limits, name)[0].tolist()) for name in names}
    return {**rows, "effort": found.robot.joints[0].effort}


NONE = (-inf, inf)


@pytest.mark.parametrize(
    ("limit", "wanted"),
    [
        ('lower="-1" upper="2" velocity="3" effort="4"', {"position": (-1, 2), "velocity": (-3, 3), "effort": (-4, 4)}),
        ('upper="2" velocity="3"', {"position": (0, 2), "effort": NONE}),
        ('lower="0" upper="0"', {"position": NONE}),
        ('lower="1" upper="-1"', {"position": NONE}),
        ('lower="-1e6" upper="1000000"', {"position": NONE}),
        ('lower="-inf" upper="inf"', {"position": NONE}),
        ("", {"position": NONE, "velocity": NONE, "acceleration": NONE, "jerk": NONE, "effort": NONE}),
        ('velocity="0"', {"velocity": NONE}),
        ('velocity="-1"', {"velocity": NONE}),
        ('velocity="100"', {"velocity": NONE}),
        ('velocity="99.9"', {"velocity": (-99.9, 99.9)}),
        ('effort="0"', {"effort": NONE}),
        ('effort="1000"', {"effort": NONE}),
        ('effort="999"', {"effort": (-999, 999)}),
        ('acceleration="5" deceleration="7" jerk="11"', {"acceleration": (-7, 5), "jerk": (-11, 11)}),
        ('acceleration="5"', {"acceleration": (-5, 5)}),
        ('deceleration="7"', {"acceleration": (-7, 7)}),
        ('acceleration="inf" jerk="inf"', {"acceleration": NONE, "jerk": NONE}),
        ('acceleration="0" jerk="-1"', {"acceleration": NONE, "jerk": NONE}),
    ],
)  # fmt: skip
def test_limits(limit: str, wanted: dict[str, tuple[float, float]]) -> None:
    found = arm(f"<limit {limit}/>")
    got = bounds(found)
    assert {name: got[name] for name in wanted} == wanted
    for name in ("position", "velocity"):  # an effort that is absent needs no note, as it is not judged
        assert (got[name] == NONE) == any(f"{name} null" in note for note in found.notes)


def test_a_continuous_joint_has_no_range() -> None:
    found = arm('<limit lower="-1" upper="1" velocity="2"/>', "continuous")
    assert bounds(found)["position"] == NONE
    assert found.notes == ()


def test_soft_limits_count_on_request() -> None:
    inside = '<limit lower="-2" upper="2" velocity="1"/><safety_controller soft_lower_limit="-1.5" soft_upper_limit="9"/>'
    assert bounds(arm(inside))["position"] == (-2, 2)
    assert bounds(arm(inside, soft=True))["position"] == (-1.5, 2)
    far = inside.replace('"-1.5"', '"3"')
    assert bounds(arm(far, soft=True))["position"] == (-2, 2)
    assert "leave no range" in arm(far, soft=True).notes[0]
    assert "no soft limits" in arm('<limit upper="1" velocity="1"/>', soft=True).notes[0]


def test_velocity_limits_by_position_are_those_of_the_robot() -> None:
    near = '<position_based_velocity_limits velocity_offset="0.3" deceleration_limit="6"/>'
    found = arm(f'<limit lower="-2" upper="2" velocity="1"/>{near}')
    assert found.robot.limits.velocity_by_position.tolist() == [[6.0, 0.3]]
    endless = arm(near).robot.limits  # no range, no end to be near to
    assert not np.isfinite(endless.velocity_by_position[:, 0]).any()
    with pytest.raises(InputError, match="deceleration_limit above 0"):
        arm('<position_based_velocity_limits velocity_offset="0.3" deceleration_limit="0"/>')


def test_friction() -> None:
    assert arm('<dynamics damping="0.5" friction="2"/>').robot.joints[0].friction == Friction(2.0, 0.5)
    assert arm("").robot.joints[0].friction == Friction()
    with pytest.raises(InputError, match="friction of joint 'j'"):
        arm('<dynamics friction="-1"/>')


def inertial(mass: object, *moments: object, origin: str = "") -> str:
    names = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
    tensor = " ".join(f'{name}="{value}"' for name, value in zip(names, moments, strict=False))
    return f'<inertial>{origin}<mass value="{mass}"/><inertia {tensor}/></inertial>'


def test_inertia_of_links_that_are_fixed_together() -> None:
    """Two point masses of 2 kg and 1 kg, 0.3 m apart: reduced mass 2/3 kg, moment 0.06 kg m^2."""
    fixed = (
        '<link name="c">' + inertial(1, 0, 0, 0, 0, 0, 0) + "</link>"
        '<joint name="k" type="fixed"><parent link="b"/><child link="c"/><origin xyz="0.3 0 0"/></joint>'
    )
    text = (
        '<robot name="r"><link name="a"/><link name="b">' + inertial(2, 0, 0, 0) + "</link>" + fixed + ""
        '<joint name="j" type="revolute"><parent link="a"/><child link="b"/><axis xyz="0 0 1"/></joint></robot>'
    )
    link = robot_of_urdf(text.encode(), "r.urdf").robot.joints[0].link
    assert link is not None
    assert link.mass == 3.0
    assert link.com == pytest.approx((0.1, 0, 0), abs=1e-15)
    assert link.inertia == pytest.approx((0, 0.06, 0.06, 0, 0, 0), abs=1e-15)


def test_a_turned_inertia() -> None:
    origin = '<origin xyz="0 0 0.1" rpy="0 0 0.5"/>'
    link = arm("", link=inertial(1, 1, 2, 2.5, origin=origin)).robot.joints[0].link
    assert link is not None
    c, s = np.cos(0.5), np.sin(0.5)  # R diag(1, 2, 2.5) R'
    wanted = (c * c + 2 * s * s, s * s + 2 * c * c, 2.5, -c * s, 0, 0)
    assert link.inertia == pytest.approx(wanted, abs=1e-15)
    assert link.com == pytest.approx((0, 0, 0.1))


@pytest.mark.parametrize(
    ("numbers", "message"),
    [
        ((-1, 1, 1, 1), "mass above 0"),
        ((0, 1, 1, 1), "mass above 0"),
        ((1, 1, 1, -0.1), "negative moment"),
        ((1, 1, 1, 2.1), "sum of the two others"),
        ((1, 1, 1, 1, 1.5), "negative moment"),
    ],
)
def test_an_inertia_that_no_solid_has_is_left_out_with_a_note(
    numbers: tuple[float, ...], message: str
) -> None:
    found = arm('<limit upper="1" velocity="1"/>', link=inertial(*numbers))
    assert found.robot.joints[0].link is None
    (note,) = found.notes
    assert note.startswith("link b: ")
    assert message in note
    moments = (*numbers[1:], *[0.0] * 6)[:6]
    with pytest.raises(InputError, match=message):
        LinkInertia(numbers[0], (0, 0, 0), moments)  # type: ignore[arg-type]


def test_inertias_of_solids_are_accepted() -> None:
    rng = np.random.default_rng(2)
    for _ in range(100):
        points = rng.normal(size=(5, 3))
        tensor = sum(point @ point * np.eye(3) - np.outer(point, point) for point in points)
        xx, yy, zz, xy, xz, yz = (
            float(tensor[i, j]) for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
        )
        LinkInertia(1.0, (0.0, 0.0, 0.0), (xx, yy, zz, xy, xz, yz))
