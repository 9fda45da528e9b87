"""Roles of columns beside a robot: names of joints that say something else, too, and joints that are doubled."""

from __future__ import annotations

from pathlib import Path

import pytest

from trajcli.errors import InputError, Place
from trajcli.streams.recorded.column_roles import NamedFile, assign_roles
from trajcli.streams.recorded_motion import MotionFile, open_motion


def opened(folder: Path, text: str, joints: list[str], columns: str | None = None) -> MotionFile:
    path = folder / ("in.yaml" if text.startswith("joint_names") else "in.csv")
    path.write_text(text)
    return open_motion(path, columns=columns, units="rad", joints=joints)


def message(names: str, positions: str) -> str:
    time = "time_from_start: {sec: 1, nanosec: 0}"
    return f"joint_names: [{names}]\npoints:\n- {{positions: [{positions}], {time}}}\n"


@pytest.mark.parametrize("columns", [None, "q1=joint_1_s,q2=joint_2_m"])
def test_the_name_of_a_joint_may_end_as_a_unit_does(columns: str | None, tmp_path: Path) -> None:
    found = opened(tmp_path, "t,joint_1_s,joint_2_m\n0,1,2\n", ["joint_1_s", "joint_2_m"], columns)
    assert found.whole().q.tolist() == [[1.0, 2.0]]


@pytest.mark.parametrize(
    "joints", [["x", "y"], ["q0", "q1"], ["q2", "q1"], ["s", "t"], ["x", "qx"]], ids=" ".join
)
def test_our_own_columns_are_about_joints_by_number(joints: list[str], tmp_path: Path) -> None:
    """Whatever the joints are called, plans are written as t, q1, q2 and the pose of the tool."""
    found = opened(tmp_path, "t,q1,q2,x,y,z,qw,qx,qy,qz\n0,1,2,3,4,5,1,0,0,0\n", joints)
    motion = found.whole()
    assert (motion.t.tolist(), motion.q.tolist(), found.joints) == ([0.0], [[1.0, 2.0]], tuple(joints))


@pytest.mark.parametrize("name", ["segment", "part 3", "q9", "none"])
@pytest.mark.parametrize("joints", [["a"], ["a", "b"]])
def test_any_column_may_be_said_to_count_moves(name: str, joints: list[str], tmp_path: Path) -> None:
    head = ",".join(["t", *(f"q{k + 1}" for k in range(len(joints))), name])
    rows = [",".join([f"{k}", *("0.5" for _ in joints), f"{k // 2}"]) for k in range(4)]
    said = [f"q{k + 1}=q{k + 1}" for k in range(len(joints))]
    found = opened(tmp_path, "\n".join([head, *rows, ""]), joints, ",".join([*said, f"move={name}"]))
    motion = found.whole()
    assert motion.move is not None
    assert (motion.move.tolist(), motion.q.shape) == ([0, 0, 1, 1], (4, len(joints)))
    assert (found.quantities, found.unread) == (("q", "move"), ())


def test_joints_may_be_called_as_columns_of_the_tool_are(tmp_path: Path) -> None:
    found = opened(tmp_path, "t,y,x\n0,1,2\n", ["x", "y"])
    assert found.whole().q.tolist() == [[2.0, 1.0]]


@pytest.mark.parametrize("columns", [None, "q=q"])
def test_two_columns_of_one_joint_are_refused(columns: str | None, tmp_path: Path) -> None:
    text = "t,q1,q1_deg,q2\n0,1,90,2\n"
    with pytest.raises(InputError, match=r"two columns are of one joint: q1, q1_deg"):
        opened(tmp_path, text, ["a", "b"], columns)
    chosen = opened(tmp_path, text, ["a", "b"], "q1=q1,q2=q2")  # as the hint says
    assert chosen.whole().q.tolist() == [[1.0, 2.0]]


def test_a_joint_that_stands_twice_in_a_message_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there are two joints 'a'"):
        opened(tmp_path, message("a, b, a", "1.0, 2.0, 3.0"), ["a", "b"])


def test_a_message_keeps_the_names_of_joints_that_are_left_out(tmp_path: Path) -> None:
    motion = opened(tmp_path, message("a, finger, b", "1.0, 2.0, 3.0"), ["b", "a"]).whole()
    assert (motion.q.tolist(), motion.joints) == ([[3.0, 1.0]], ("b", "a"))
    assert motion.message_joints == ("a", "finger", "b")


@pytest.mark.parametrize("move", ["1e30", "-1e17"])
def test_a_number_of_a_move_that_is_none_is_refused(move: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"move is -?1e\+\d+ in row 2"):
        opened(tmp_path, f"t,q1,move\n0,0,0\n1,1,{move}\n", ["a"])


def test_a_message_about_other_joints_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="there is no joint 'a'") as caught:
        opened(tmp_path, message("foo, bar", "1.0, 2.0"), ["a", "b"])
    assert "foo, bar; rows that `trajcli convert` makes of it number them" in str(
        caught.value.problems[0].hint
    )


@pytest.mark.parametrize("quantity", ["q", "qd", "qdd", "tau"])
def test_columns_of_one_joint_are_told_apart_by_the_quantity_that_the_hint_names(quantity: str) -> None:
    names = ("t", "q1", "q2", f"{quantity}1_deg", f"{quantity}1_rad", f"{quantity}2_deg")
    names = names if quantity != "q" else (names[0], *names[3:])
    file = NamedFile("in.csv", names, lambda name: None)
    with pytest.raises(InputError) as caught:
        assign_roles(file)
    hint = str(caught.value.problems[0].hint)
    said = hint.rpartition("--columns ")[2]
    for number in (1, 2):
        said = said.replace("NAME", f"{quantity}{number}_deg", 1)
    roles = assign_roles(file, said)
    assert [names[index] for index in roles.joints[quantity]] == [f"{quantity}1_deg", f"{quantity}2_deg"]
    assert names[roles.joints["q"][0]].startswith("q1")


def test_an_error_without_a_place_names_its_file() -> None:
    place = Place("in.csv", 3, 4)
    bare, placed = (NamedFile("in.csv", ("t",), lambda name, at=at: at) for at in (None, place))
    (found,) = bare.wrong("no column", "name one").problems
    assert (found.message, found.hint, found.place) == ("in.csv: no column", "name one", None)
    (found,) = placed.wrong("no column").problems
    assert (found.message, found.hint, found.place) == ("no column", None, place)
