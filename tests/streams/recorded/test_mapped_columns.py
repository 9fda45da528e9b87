"""Roles of columns where a mapping, the first row or the names of joints decide."""

from __future__ import annotations

from typing import Any

import pytest

from trajcli.errors import InputError
from trajcli.streams.recorded.column_roles import (
    ColumnRoles,
    NamedFile,
    assign_roles,
    note_of_unread,
    ordered_joints,
)


def file_of(names: str, first: str = "") -> NamedFile:
    texts = tuple(first.split(",")) if first else ()
    return NamedFile("in.csv", tuple(names.split(",")), lambda name: None, texts)


@pytest.mark.parametrize(
    ("names", "time"), [("secs,nsecs,time,q1", 2), ("q1,ms", 1), ("s,t,q1", 1), ("stamp_ns,ns,q1", 0)]
)
def test_a_column_called_as_its_unit_is_the_time_where_no_other_is(names: str, time: int) -> None:
    assert assign_roles(file_of(names)).time == time
    with pytest.raises(InputError, match="2 columns are times: sec, nanoseconds"):
        assign_roles(file_of("sec,nanoseconds,q1"))


def taken(names: str, found: ColumnRoles, quantity: str) -> str:
    return " ".join(names.split(",")[k] for k in found.joints[quantity])


@pytest.mark.parametrize(
    ("names", "columns", "joints", "wanted"),
    [
        ("t,elbow_deg,wrist_deg", None, ["elbow", "wrist"], {"q": "elbow_deg wrist_deg"}),
        ("t,x_2,x_1", "q=x_", None, {"q": "x_1 x_2"}),  # by their numbers
        ("t,q1,q2", "qd1=q2", None, {"q": "q1", "qd": "q2"}),  # what is taken is not taken twice
        ("t,q_error1,q_error2", None, None, {"q": "q_error1 q_error2"}),  # where there is nothing else
        ("t,q2,q1,qd0,qd1", None, None, {"q": "q1 q2", "qd": "qd0 qd1"}),
        ("t,q2,q1,qd1,qd0", None, None, {"q": "q1 q2", "qd": "qd0 qd1"}),
        ("t,wrist_position,elbow_position", None, None, {"q": "wrist_position elbow_position"}),
        ("t,q0,q1", None, None, {"q": "q0 q1"}),
        ("t,A1,A2", "q1=A2 [deg],q2=A1", None, {"q": "A2 A1"}),
        ("t,A1,A2", " q1 = A2 , q2= A1", None, {"q": "A2 A1"}),  # as somebody writes in quotes
        ("t,q1,q2,qd1,qd2", "qd=None", None, {"q": "q1 q2"}),
        ("t,q1,q2,a1,a2", "qd=a", None, {"q": "q1 q2", "qd": "a1 a2"}),  # and are no accelerations, too
    ],
)
def test_which_columns_are_taken(
    names: str, columns: str | None, joints: list[str] | None, wanted: dict[str, str]
) -> None:
    found = assign_roles(file_of(names), columns, joints)
    assert {quantity: taken(names, found, quantity) for quantity in found.joints} == wanted


@pytest.mark.parametrize(
    ("names", "columns", "joints", "words"),
    [
        ("t,q1,q3", None, None, "q2 is missing"),
        ("t,q0,q2", None, None, "q1 is missing"),
        ("t,q2,q3", None, None, "q1 is missing"),
        ("clock1,q1", "t=clock", None, "there is no column 'clock'"),  # one column is the time, by its name
        ("ch1,q1", "t=ch", None, "there is no column 'ch'"),
        ("t,q1,elbow_position", None, ["elbow"], "the positions are ambiguous"),
        ("t,q1", "q=", None, "'q=' is no mapping"),
    ],
)
def test_what_is_refused(names: str, columns: str | None, joints: list[str] | None, words: str) -> None:
    with pytest.raises(InputError) as error:
        assign_roles(file_of(names), columns, joints)
    assert words in error.value.problems[0].message


@pytest.mark.parametrize(
    ("columns", "units"), [("q=A [deg]", ["deg", "deg"]), ("q1=A1 [deg],q2=A2", ["deg", None])]
)
def test_a_mapping_may_say_the_unit(columns: str, units: list[Any]) -> None:
    found = assign_roles(file_of("t,A1,A2"), columns)
    assert [found.names[k].unit for k in found.joints["q"]] == units


def test_moves_may_be_left_out() -> None:
    found = assign_roles(file_of("t,q1,move"), "move=none")
    assert (found.move, found.unread) == (None, ("move",))


ECHO = "%time,field.header.stamp,field.name0,field.name1,field.position0,field.position1"


def test_of_printed_messages_the_first_row_says_the_joints_and_which_stamp_counts() -> None:
    stamped = assign_roles(file_of(ECHO, '17,16,"a","b",1.0,2.0'))
    assert (stamped.time, stamped.joint_names, stamped.fixed, stamped.unread) == (
        1,
        ("a", "b"),
        (2, 3),
        ("%time",),
    )
    assert stamped.nanoseconds
    for stamp in ("0", "0.0", " 0 "):
        assert assign_roles(file_of(ECHO, f'17,{stamp},"a","b",1.0,2.0')).time == 0
    alone = ECHO.removeprefix("%time,")
    assert assign_roles(file_of(alone, '0,"a","b",1.0,2.0')).time == 0  # there is no other
    ours = assign_roles(file_of("t,q1,field.comment", "0,1,2"))
    assert (ours.time, ours.nanoseconds) == (0, False)


def test_joints_of_other_names_are_taken_in_their_order_and_that_is_said() -> None:
    file = file_of("t,j_position,k_position")
    roles = assign_roles(file)
    order, names, notes = ordered_joints(file, roles, ("j", "k"), ("a", "b"))
    assert (order, names) == ([0, 1], ("a", "b"))
    assert notes == ("joints are taken in the order of the file: j, k as a, b",)
    assert ordered_joints(file, roles, ("j", "k"), ("k", "j"))[0] == [1, 0]
    with pytest.raises(InputError, match=r"2 joints \(j, k\), expected 3"):
        ordered_joints(file, roles, ("j", "k"), ("a", "b", "c"))


def test_columns_that_are_not_read_are_named_up_to_twelve() -> None:
    assert note_of_unread(()) == ()
    names = [f"c{k}" for k in range(15)]
    assert note_of_unread(names[:12]) == (f"columns that are not read: {', '.join(names[:12])}",)
    assert note_of_unread(names) == (f"columns that are not read: {', '.join(names[:12])} and 3 more",)


def test_a_file_that_names_its_joints_has_them_all_or_those_that_are_wanted() -> None:
    """Whoever wants none has those of the file; what is left out is told."""
    file = file_of("t,wrist_position,elbow_position,finger_position")
    roles = assign_roles(file)
    names = ("wrist", "elbow", "finger")
    assert ordered_joints(file, roles, roles.joint_names, None) == ([0, 1, 2], names, ())
    found = ordered_joints(file, roles, roles.joint_names, ["elbow", "wrist"])
    assert found == ([1, 0], ("elbow", "wrist"), ("joints that are not of the robot: finger",))
    assert ordered_joints(file_of("t,q1"), assign_roles(file_of("t,q1")), None, None) == ([0], None, ())
