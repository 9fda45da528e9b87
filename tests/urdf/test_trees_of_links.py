"""Trees of links: the chain that is chosen where no names are given, places of flaws, and numbers of attributes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.urdf.read import MAX_DEPTH, Element, UrdfDocument, parse_urdf
from trajcli.urdf.tree import serial_path


def joint(text: str) -> str:
    """Return a joint given as "name type parent child [mimicked]"."""
    name, kind, parent, child, *mimicked = text.split()
    inside = f'<parent link="{parent}"/><child link="{child}"/>' + "".join(
        f'<mimic joint="{j}"/>' for j in mimicked
    )
    return f'<joint name="{name}" type="{kind}">{inside}</joint>'


def document(*joints: str, order: str = "") -> UrdfDocument:
    """Return a robot of joints; its links stand in the order in which joints name them, or in another."""
    links = order.split() or dict.fromkeys(link for text in joints for link in text.split()[2:4])
    names = "".join(f'<link name="{link}"/>' for link in links)
    return parse_urdf(f'<robot name="r">{names}{"".join(map(joint, joints))}</robot>'.encode(), "arm.urdf")


ARM = ("j1 revolute l0 l1", "j2 prismatic l1 l2", "j3 continuous l2 l3")


@pytest.mark.parametrize(
    ("joints", "tip", "others"),
    [
        (ARM, "l3", ()),
        ((*ARM, "f fixed l3 flange", "g fixed flange tcp"), "tcp", ()),
        ((*ARM, "f fixed l3 flange", "g fixed flange camera"), "flange", ("camera",)),
        ((*ARM, "f fixed l3 a", "g fixed a b", "h fixed l3 c"), "b", ("c",)),  # the one behind most fixed joints
        ((*ARM, "f fixed l3 a", "g fixed l3 b"), "a", ("b",)),  # the one that the file has first
        ((*ARM, "f fixed l3 tcp", "g fixed l3 tool0"), "tool0", ("tcp",)),
        ((*ARM, "f fixed l3 xtool0", "g fixed l3 tool0_x", "h fixed l3 my_tool0"), "my_tool0", ("xtool0", "tool0_x")),
        ((*ARM, "f fixed l3 sensor", "g fixed l3 ee_link"), "ee_link", ("sensor",)),
        ((*ARM, "f fixed l2 tool0"), "l3", ("tool0",)),  # not behind the last joint
        ((*ARM, "s revolute l0 s1"), "l3", ("s1",)),
        (("s revolute l0 s1", *ARM), "l3", ("s1",)),
        ((*ARM, "k1 revolute l0 k1", "k2 revolute k1 k2", "k3 revolute k2 k3"), "l3", ("k3",)),
        ((*ARM, "table fixed l0 table"), "l3", ()),  # behind no joint that moves
        ((*ARM, "f floating l3 ball"), "l3", ("ball",)),
        ((*ARM, "finger_1 revolute l3 f1"), "l3", ("f1",)),
        ((*ARM, "finger_1 revolute l3 f1", "finger_2 revolute f1 f2", "finger_3 revolute f2 f3", "finger_4 revolute f3 f4"), "l3", ("f4",)),
        ((*ARM, "finger_1 revolute l3 f1", *(f"x{k} revolute f{k} f{k + 1}" for k in range(1, 5))), "f5", ()),
        ((*ARM, "gripper_roll revolute l3 f1"), "f1", ()),  # a wrist
        ((*ARM, "gripper_mount fixed l3 f1", "turn revolute f1 f2"), "f2", ()),
        ((*ARM, "index revolute l3 f1"), "l3", ("f1",)),
        ((*ARM, "indexer revolute l3 f1"), "f1", ()),
        ((*ARM, "left prismatic l3 a", "right prismatic l3 b left"), "l3", ("a", "b")),
        ((*ARM, "left prismatic l3 a", "right prismatic l3 b left", "f fixed l3 hand"), "hand", ("a", "b")),
        (("finger_1 revolute l0 f1", "finger_2 revolute f1 f2"), "f2", ()),  # nothing but a gripper
        (("f fixed world l0", *ARM), "l3", ()),
    ],
)  # fmt: skip
def test_the_chain_ends_behind_the_last_joint_before_the_gripper(
    joints: tuple[str, ...], tip: str, others: tuple[str, ...]
) -> None:
    found = serial_path(document(*joints))
    assert (found.tip, found.other_tips, found.other_roots) == (tip, others, ())
    assert found.root == joints[-1 if joints[0].startswith("s ") else 0].split()[2] or found.root == "l0"
    links = [found.root, *(one.child for one in found.joints)]
    assert [one.parent for one in found.joints] == links[:-1]
    assert links[-1] == tip


def test_links_are_told_in_the_order_of_the_file() -> None:
    branches = ("a revolute l0 a", "b revolute l0 b", "c revolute l0 c")
    found = serial_path(document(*branches, order="c l0 b a"))
    assert (found.tip, found.other_tips) == ("c", ("b", "a"))
    found = serial_path(document(*branches, order="l0 b a c"), tip="a")
    assert found.other_tips == ("b", "c")


def test_other_trees_are_those_with_a_joint_that_moves() -> None:
    two = document(*ARM, "k revolute m0 m1", "f fixed n0 n1", order="n0 n1 m0 m1 l0 l1 l2 l3")
    assert serial_path(two).other_roots == ("m0",)
    assert serial_path(two).other_tips == ()
    assert serial_path(two, root="l0").other_roots == serial_path(two, tip="l3").other_roots == ()
    assert serial_path(two, root="m0").tip == "m1"


def test_named_ends_are_those_of_the_chain() -> None:
    found = serial_path(document(*ARM), "l1", "l2")
    assert (found.root, found.tip, [one.name for one in found.joints]) == ("l1", "l2", ["j2"])
    for ends, said in (
        (("l2", "l1"), "link 'l1' is not behind link 'l2'"),
        (("l3", None), "no joint that moves behind link 'l3'"),
        (("l3", "l3"), "from 'l3' to 'l3' has 0 joints that move"),
    ):
        with pytest.raises(InputError, match=said):
            serial_path(document(*ARM), *ends)


@pytest.mark.parametrize(
    ("kind", "said", "advice"),
    [
        ("planar", "joint 'j2' is planar", "`root: l2`, or end before it: `tip: l1`"),
        ("floating", "joint 'j2' is floating", "`root: l2`, or end before it: `tip: l1`"),
        ("revolut", "unknown type 'revolut'", "did you mean 'revolute'?"),
    ],
)
def test_a_joint_that_no_serial_robot_has_is_refused_and_the_advice_works(
    kind: str, said: str, advice: str
) -> None:
    arm = document(ARM[0], f"j2 {kind} l1 l2", ARM[2])
    with pytest.raises(InputError) as caught:
        serial_path(arm, tip="l3")
    assert said in caught.value.problems[0].message
    assert advice in str(caught.value.problems[0].hint)
    assert [one.name for one in serial_path(arm, root="l2").joints] == ["j3"]
    assert [one.name for one in serial_path(arm, tip="l1").joints] == ["j1"]


def test_a_joint_without_a_type_is_refused() -> None:
    text = '<robot><link name="a"/><link name="b"/><joint name="j"><parent link="a"/><child link="b"/></joint></robot>'
    with pytest.raises(InputError, match="joint 'j' has the unknown type ''") as caught:
        serial_path(parse_urdf(text.encode(), "a.urdf"), tip="b")
    assert "types: revolute, continuous" in str(caught.value.problems[0].hint)


@pytest.mark.parametrize("length", [1, 12, 13])
def test_a_chain_has_one_to_twelve_joints_that_move(length: int) -> None:
    chain = [f"j{k} {'fixed' if k == 5 else 'revolute'} l{k} l{k + 1}" for k in range(length + (length > 5))]
    if length > 12:
        with pytest.raises(InputError, match="13 joints that move"):
            serial_path(document(*chain))
    else:
        assert sum(one.moves for one in serial_path(document(*chain)).joints) == length


NUMBERS = parse_urdf(b'<robot name="r"><link name="a" three="1 -2e1  .5" inf=" -INF " plus="+inf" half=" 2.5 "\n big="-1e300" far="1 -2e12 3" four="1 2 3 4" two="1 x"/></robot>', "a.urdf")  # fmt: skip
LINK = NUMBERS.links["a"]


def test_numbers_of_attributes() -> None:
    np.testing.assert_array_equal(NUMBERS.numbers(LINK, "three", 3, (0, 0, 0)), [1, -20, 0.5])
    np.testing.assert_array_equal(NUMBERS.numbers(LINK, "none", 3, (1, 0, 2)), [1, 0, 2])
    np.testing.assert_array_equal(NUMBERS.numbers(None, "three", 3, (1, 0, 2)), [1, 0, 2])
    assert NUMBERS.number(LINK, "inf") == -math.inf
    assert NUMBERS.number(LINK, "plus") == math.inf
    assert NUMBERS.number(LINK, "half") == 2.5
    assert NUMBERS.number(LINK, "none") is NUMBERS.number(None, "half") is None
    for attribute, count, said in (
        ("far", 3, "magnitude"),
        ("four", 3, "4 of them"),
        ("two", 2, "expected 2 numbers"),
    ):
        with pytest.raises(InputError, match=said) as caught:
            NUMBERS.numbers(LINK, attribute, count, (0,) * count)
        assert caught.value.problems[0].place is not None
    for attribute in ("big", "three"):
        with pytest.raises(InputError, match="magnitude" if attribute == "big" else "expected a number"):
            NUMBERS.number(LINK, attribute)


def test_a_place_is_that_of_the_attribute_where_it_stands_on_the_line() -> None:
    text = b'\n\n<robot name="r">\n <link name="a"/> <link axis_name="b" name="a" />\n</robot>'
    with pytest.raises(InputError, match="'a' stands twice") as caught:
        parse_urdf(text, "a.urdf")
    place = caught.value.problems[0].place
    assert place is not None
    assert (place.line, place.column, place.length) == (4, 39, 8)
    with pytest.raises(InputError, match="'a' stands twice") as caught:
        parse_urdf(b'<robot><link name="a"/><link name="a"/></robot>', "a.urdf")
    assert caught.value.problems[0].place is not None
    assert caught.value.problems[0].place.column == 30
    with pytest.raises(InputError, match="mismatched tag") as caught:
        parse_urdf(b"\n<robot>\n<link></robot>", "a.urdf")
    place = caught.value.problems[0].place
    assert place is not None
    assert (place.line, place.column) == (3, 9)


@pytest.mark.parametrize(
    ("inside", "said"),
    [
        ('<link name="a b "/><link name=" "/>', "a <link> has no name"),
        ('<link name="a&#10;b"/>', "name"),
        (
            '<link name="a"/><link name="b"/><joint name="j"><parent link="a"/><child link="c"/></joint>',
            "the child 'c'",
        ),
        ('<link name="a"/><link name="b"/><joint name="j"><parent link="a"/><child/></joint>', "no <child"),
        ('<link name="a"><visual x="${pi}"/></link>', "is xacro"),
        ('<link name="a"><a x="1 + ${pi}"/></link>', "is xacro"),
        ("<xacro:macro/>", "is xacro"),
    ],
)
def test_elements_that_are_wrong_are_refused(inside: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        parse_urdf(f"<robot>{inside}</robot>".encode(), "a.urdf")


def test_elements_are_kept_with_what_is_in_them() -> None:
    text = '<robot><link name="a"><visual><b/></visual><collision/><c x="1"/><c x="2"/></link><material name="red"/></robot>'
    for visuals, inside in ((False, ["c", "c"]), (True, ["visual", "c", "c"])):
        found = parse_urdf(text.encode(), "my arm.urdf", visuals=visuals)
        assert [element.name for element in found.links["a"].inside] == inside
        assert found.links["a"].first("c") == Element("c", {"x": "1"}, 1, text.index("<c x") + 1, [])
        assert (found.name, list(found.materials)) == ("my arm", ["red"] if visuals else [])
    deep = f"<robot><link name='a'>{'<x>' * (MAX_DEPTH - 2)}{'</x>' * (MAX_DEPTH - 2)}</link></robot>"
    assert parse_urdf(deep.encode(), "a.urdf").links
    with pytest.raises(InputError, match="elements stand in each other"):
        parse_urdf(deep.replace("<x>", "<y><x>", 1).replace("</x>", "</x></y>", 1).encode(), "a.urdf")
    kinds = document(
        "a revolute l0 l1", "b continuous l1 l2", "c prismatic l2 l3", "d fixed l3 l4", "e planar l4 l5"
    )
    assert kinds.name == "r"
    assert [one.moves for one in kinds.joints.values()] == [True, True, True, False, False]


@pytest.mark.parametrize(
    ("file", "advice"),
    [
        ("arm.urdf", "xacro arm.urdf.xacro > arm.urdf"),
        ("arm.xacro", "xacro arm.xacro > arm.urdf"),
        ("cell/arm.urdf.xacro", "xacro cell/arm.urdf.xacro > arm.urdf"),
        ("arm.xml", "xacro arm.urdf.xacro > arm.urdf"),
    ],
)
def test_the_advice_expands_the_file_that_was_named(file: str, advice: str) -> None:
    with pytest.raises(InputError) as caught:
        parse_urdf(b"<robot><xacro:a/></robot>", file)
    assert str(caught.value.problems[0].hint).endswith(advice)
