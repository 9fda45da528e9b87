"""Hostile and sloppy URDFs: what is refused, with its place, and what does no harm."""

from __future__ import annotations

import re

import pytest

import trajcli
from trajcli.errors import InputError
from trajcli.urdf.read import MAX_BYTES, MAX_DEPTH
from trajcli.urdf.serial_robot import UrdfRobot, robot_of_urdf

ARM = """\
<?xml version="1.0"?>
<robot name="arm">
  <link name="base"><visual><geometry><mesh filename="package://arm/base.stl"/></geometry></visual></link>
  <joint name="j1" type="revolute">
    <parent link="base"/><child link="upper"/>
    <origin xyz="0 0 0.3" rpy="0 0 0"/>
    <axis xyz="0 0 2"/>
    <limit lower="-1" upper="1" velocity="2" effort="30"/>
  </joint>
  <link name="upper"/>
  <joint name="j2" type="continuous">
    <parent link="upper"/><child link="fore"/>
    <origin xyz="0.4 0 0" rpy="1.5707963267948966 0 0"/>
    <axis xyz="0 0 -1"/>
  </joint>
  <link name="fore"/>
  <joint name="grip" type="prismatic">
    <parent link="fore"/><child link="left_finger"/>
    <axis xyz="1 0 0"/>
    <limit lower="0" upper="0.04" velocity="2" effort="30"/>
  </joint>
  <link name="left_finger"/>
  <joint name="grip_mirror" type="prismatic">
    <parent link="fore"/><child link="right_finger"/>
    <mimic joint="grip"/>
  </joint>
  <link name="right_finger"/>
</robot>
"""


def read(text: str | bytes, **options: object) -> UrdfRobot:
    data = text.encode() if isinstance(text, str) else text
    return robot_of_urdf(data, "arm.urdf", **options)  # type: ignore[arg-type]


def changed(old: str, new: str) -> str:
    assert old in ARM
    return ARM.replace(old, new)


def test_the_arm_itself_reads_and_ends_before_its_gripper() -> None:
    found = read(ARM)
    assert (found.root, found.tip, found.other_tips) == ("base", "fore", ("left_finger", "right_finger"))
    assert found.robot.joint_names == ("j1", "j2")
    assert read(ARM, tip="left_finger").robot.joint_types == ("revolute", "revolute", "prismatic")


REFUSED = [
    ('<robot name="arm">', '<!DOCTYPE robot [<!ENTITY a "b">]>\n<robot name="arm">', 2, "DOCTYPE"),
    ("<axis xyz=\"0 0 2\"/>", "<axis xyz=\"0 0 0\"/>", 7, "the axis of joint 'j1' is 0 0 0"),
    ('xyz="0 0 0.3"', 'xyz="0, 0 0.3"', 6, 'xyz: expected 3 numbers with spaces between, got "0, 0 0.3"'),
    ('xyz="0 0 0.3"', 'xyz="0 0 nan"', 6, "expected 3 numbers"),
    ('xyz="0 0 0.3"', 'xyz="0 0 1e300"', 6, "magnitude of at most 1e+12"),
    ('xyz="0 0 0.3"', 'xyz="0 0 1_0"', 6, "expected 3 numbers"),
    ('rpy="0 0 0"', 'rpy="0 0 0 0"', 6, "4 of them"),
    ('lower="-1"', 'lower="-1.57."', 8, "lower: expected a number"),
    ('velocity="2" effort="30"/>\n  </joint>\n  <link name="upper"/>', 'velocity="fast"/>\n  </joint>\n  <link name="upper"/>', 8, "velocity: expected a number"),
    ('type="continuous"', 'type="planar"', 11, "joint 'j2' is planar"),
    ('type="continuous"', 'type="floating"', 11, "joint 'j2' is floating"),
    ('type="continuous"', 'type="continous"', 11, "unknown type 'continous'"),
    ('<parent link="upper"/>', '<parent link="uper"/>', 12, "has the parent 'uper', and there is no such link"),
    ('<child link="fore"/>', "", 11, "joint 'j2' has no <child"),
    ('<joint name="j2"', '<joint name="j1"', 11, "the name of joint 'j1' stands twice"),
    ('<joint name="j2"', "<joint", 11, "a <joint> has no name"),
    ('<child link="right_finger"/>', '<child link="upper"/>', 23, "is the child of 'j1' and of 'grip_mirror'"),
    ('<robot name="arm">', '<robot name="arm"><xacro:include filename="a"/>', 2, "<xacro:include> is xacro"),
    ('xyz="0.4 0 0"', 'xyz="${l} 0 0"', 13, "is xacro"),
    ('xyz="0.4 0 0"', 'xyz="$(arg l) 0 0"', 13, "is xacro"),
    ('<robot name="arm">', '<sdf name="arm">', 28, "no XML: mismatched tag"),
    ("</robot>", "", 29, "no XML: no element found"),
    ("<axis xyz=\"0 0 2\"/>", "<axis xyz=\"0 0 2\" xyz=\"0 0 1\"/>", 7, "duplicate attribute"),
    ("<axis xyz=\"0 0 2\"/>", "<axis>&bomb;</axis>", 7, "undefined entity"),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "line", "message"), REFUSED, ids=[row[3][:30] for row in REFUSED])
def test_what_is_refused(old: str, new: str, line: int, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)) as refused:
        read(changed(old, new), tip="fore")
    (problem,) = refused.value.problems
    assert problem.place is not None
    assert (problem.place.file, problem.place.line) == ("arm.urdf", line)
    assert problem.place.column >= 1


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "no element found"),
        (b"\x00\x01", "no XML"),
        (b"name: arm\n", "no XML: syntax error"),
        (b"<sdf><model/></sdf>", "expected <robot>, got <sdf>"),
        (b"<robot/>", "the robot has no links"),
        (b'<robot><link name="a"/></robot>', "no joint that moves"),
        (b"<a>" * (MAX_DEPTH + 1), f"more than {MAX_DEPTH} elements"),
        (b" " * (MAX_BYTES + 1), "at most 10 MB"),
        (b'<?xml version="1.0" encoding="klingon"?><robot/>', "unknown encoding"),
        (b"<!-- a -->\n<?xml version='1.0'?><robot/>", "declaration not at start"),
        (ARM.replace("base", "b\xe9se").encode("latin-1"), "not well-formed"),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_what_is_no_urdf(data: bytes, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(message)) as refused:
        read(data)
    assert refused.value.problems[0].place is not None


def test_links_in_a_circle_are_refused() -> None:
    joint = '<joint name="{0}" type="revolute"><parent link="{1}"/><child link="{2}"/></joint>'
    circle = '<robot name="r"><link name="a"/><link name="b"/>' + joint.format("j", "a", "b")
    with pytest.raises(InputError, match="circle"):
        read(circle + joint.format("k", "b", "a") + "</robot>")
    with pytest.raises(InputError, match="circle"):
        read(circle + joint.format("k", "b", "a") + "</robot>", tip="b")
    with pytest.raises(InputError, match="behind link 'a' go in a circle"):
        read(circle + joint.format("k", "b", "a") + "</robot>", root="a")


def test_a_flaw_beyond_the_tip_is_noted() -> None:
    joint = '<joint name="{}" type="{}"><parent link="{}"/><child link="{}"/>{}<axis xyz="0 0 1"/></joint>'
    arm = "".join(f'<link name="{name}"/>' for name in "wabc") + joint.format("j", "continuous", "w", "a", "")
    flawed = joint.format("g", "fixed", "a", "b", '<origin rpy="0 0 0 1"/>')
    other = joint.format("k", "continuous", "w", "c", '<origin xyz="0 1,5 0"/>')
    found = read(f'<robot name="r">{arm}{flawed}{other}</robot>', tip="a")
    left_out = [note for note in found.notes if note.endswith("the links behind it are left out")]
    assert sorted(note.split(":")[0] for note in left_out) == ["joint g", "joint k"]
    with pytest.raises(InputError, match="rpy"):
        read(f'<robot name="r">{arm}{flawed}{other}</robot>', tip="b")


def test_hints_say_what_to_do() -> None:
    with pytest.raises(InputError) as refused:
        read(changed('xyz="0.4 0 0"', 'xyz="${l} 0 0"'))
    assert "xacro arm.urdf.xacro > arm.urdf" in str(refused.value.problems[0].hint)
    with pytest.raises(InputError, match="mimics grip") as refused:
        read(ARM, tip="right_finger")
    assert "`tip: fore`" in str(refused.value.problems[0].hint)
    with pytest.raises(InputError, match="no link 'for' for its tip") as refused:
        read(ARM, tip="for")
    assert refused.value.problems[0].hint == "did you mean 'fore'?"
    with pytest.raises(InputError, match="no link 'bas' for its root"):
        read(ARM, root="bas")
    with pytest.raises(InputError, match="link 'base' is not behind link 'fore'"):
        read(ARM, root="fore", tip="base")
    with pytest.raises(InputError, match="0 joints that move"):
        read(ARM, root="fore", tip="fore")


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("package://arm/base.stl", "package://no such/../../etc/passwd"),
        ("package://arm/base.stl", "$(find arm)/base.stl"),
        ("<visual>", '<visual><origin rpy="a b c"/>'),
        ('<mimic joint="grip"/>', '<mimic joint="grip"/><origin xyz="1 2"/>'.replace('xyz="1 2"', 'xyz="1 2 3"')),
        ('<robot name="arm">', '<robot name="arm" xmlns:a="b"><gazebo:plugin rpy="x"/>'),
        ('<?xml version="1.0"?>', '\n\n  <?xml version="1.0"?>'),
        ('<?xml version="1.0"?>', '\ufeff<?xml version="1.0"?>'),
        ('<?xml version="1.0"?>', "<!-- ${a} <xacro:macro/> -->"),
    ],
)  # fmt: skip
def test_what_does_no_harm(old: str, new: str) -> None:
    assert read(changed(old, new)).robot.joints == read(ARM).robot.joints


def test_text_in_utf16_is_read() -> None:
    assert read(ARM.encode("utf-16")).robot.joints == read(ARM).robot.joints


def test_flaws_beyond_the_tip_do_no_harm() -> None:
    text = changed('<axis xyz="1 0 0"/>', '<axis xyz="0 0 0"/>').replace('upper="0.04"', 'upper="wide"')
    assert read(text).robot.joint_names == ("j1", "j2")
    with pytest.raises(InputError):
        read(text, tip="left_finger")


def test_more_joints_than_a_robot_has() -> None:
    joint = '<joint name="j{0}" type="revolute"><parent link="l{0}"/><child link="l{1}"/></joint>'
    links = "".join(f'<link name="l{k}"/>' for k in range(14))
    text = f'<robot name="r">{links}{"".join(joint.format(k, k + 1) for k in range(13))}</robot>'
    with pytest.raises(InputError, match="13 joints that move"):
        read(text)
    assert len(read(text, root="l1").robot.joints) == 12


def _joint(name: str, parent: str, child: str, more: str = "") -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/><axis xyz="0 0 1"/>{more}'
    return f'<link name="{child}"/><joint name="{name}" type="continuous">{ends}</joint>'


@pytest.mark.parametrize("joints", [2, 6])
def test_a_mimic_between_root_and_tip_is_refused_by_its_name(joints: int) -> None:
    """Not taken as a gripper, which would end the arm before it or leave it without joints."""
    inner = [
        _joint(f"j{k}", f"l{k - 1}", f"l{k}", '<mimic joint="j1"/>' if k == 2 else "")
        for k in range(1, joints + 1)
    ]
    with pytest.raises(InputError, match="joint 'j2' mimics j1") as refused:
        read(f'<robot name="r"><link name="l0"/>{"".join(inner)}</robot>')
    assert "`tip: l1`" in str(refused.value.problems[0].hint)


def test_a_linkage_beside_the_arm_is_no_gripper() -> None:
    """A rod that mimics the second of six joints from another branch: the arm is whole."""
    arm = [_joint(f"j{k}", f"l{k - 1}", f"l{k}") for k in range(1, 7)]
    rod = _joint("rod", "l1", "rod_link", '<mimic joint="j2"/>')
    found = read(f'<robot name="r"><link name="l0"/>{"".join(arm)}{rod}</robot>')
    assert (found.tip, len(found.robot.joints)) == ("l6", 6)


def test_trees_that_were_passed_over_are_named(tmp_path) -> None:
    """Two arms in one file and a lone link: the file has two trees with joints, and one is planned."""
    two = _joint("ja1", "a0", "a1") + _joint("ja2", "a1", "a2") + _joint("jb1", "b0", "b1")
    text = f'<robot name="two"><link name="a0"/><link name="b0"/><link name="table"/>{two}</robot>'
    assert read(text).other_roots == ("b0",)
    assert "2 trees" in " ".join(read(text).remarks)
    for chosen in ({"root": "a0"}, {"tip": "b1"}):
        assert read(text, **chosen).other_roots == ()
    (tmp_path / "two.urdf").write_text(text)
    start = {"joints": [0.0, 0.0]}
    job = {"version": 1, "robot": {"urdf": str(tmp_path / "two.urdf")}, "start": start}
    job["moves"] = [{"planner": "quintic", "to": start, "duration": 1}]
    (event,) = (each for each in trajcli.plan(job).events if each.kind == "root_chosen")
    assert "root 'a0'" in event.message and "b0" in event.message  # noqa: PT018
