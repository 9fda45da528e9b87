"""Roles of columns by their names alone, and by what `--columns` says: which column is which joint's what."""

from __future__ import annotations

import pytest

from trajcli.errors import InputError
from trajcli.streams.recorded.column_roles import NamedFile, assign_roles


def roles(names: str, columns: str | None = None, joints: list[str] | None = None) -> dict[str, str]:
    """Return by quantity the names of its columns."""
    listed = tuple(names.split(","))
    found = assign_roles(NamedFile("in.csv", listed, lambda name: None), columns, joints)
    taken = {key: " ".join(listed[index] for index in each) for key, each in found.joints.items()}
    return {"t": listed[found.time], **taken, "rest": " ".join(found.unread)}


@pytest.mark.parametrize(
    ("names", "columns", "wanted"),
    [
        ("t,q2,q1", None, {"q": "q1 q2"}),
        ("t,q0,q1,qd1,qd2", None, {"q": "q0 q1", "qd": "qd1 qd2"}),
        ("t,q1,q2,qd2,qd1", None, {"qd": "qd1 qd2"}),
        ("t,q0,q1,qd2,qd1", None, {"qd": "qd1 qd2"}),
        ("t,q1,q2,qd1,qd2", "qd=none", {"q": "q1 q2", "rest": "qd1 qd2"}),
        ("t,q1,none", "qd1=none", {"qd": "none"}),
        ("t,q1,none", "qd=none", {"q": "q1", "rest": "none"}),
        ("t,q1,none,tau1", "tau=none", {"q": "q1", "rest": "none tau1"}),
        ("t,q1,q2,q_error1,q_error2", None, {"q": "q1 q2", "rest": "q_error1 q_error2"}),
        ("t,actual_q_1,target_q_1,actual_qd_1,target_qd_1", "q=target_q", {"q": "target_q_1", "qd": "target_qd_1"}),
        ("t,A1,A2,A3", "q=A", {"q": "A1 A2 A3"}),
        ("t,Pos1,Pos2", "q=pos", {"q": "Pos1 Pos2"}),
        ("t,left_2_at_7,left_2_at_9", "q1=left_2_at_9,q2=left_2_at_7", {"q": "left_2_at_9 left_2_at_7"}),
        ("t,x 3 a_1,x 3 a_2", "q=x 3 a_", {"q": "x 3 a_1 x 3 a_2"}),
        ("stamp,clock,q1", "t=clock", {"t": "clock", "rest": "stamp"}),
        ("t,elbow_position,wrist_position,elbow_velocity,wrist_velocity", None, {"q": "elbow_position wrist_position"}),
        ("t,q1,q2,x_position,y_position", None, {"q": "q1 q2"}),
        ("t,q1,q2,elbow_position", None, {"q": "q1 q2", "rest": "elbow_position"}),
    ],
)  # fmt: skip
def test_which_columns_are_taken(names: str, columns: str | None, wanted: dict[str, str]) -> None:
    found = roles(names, columns)
    assert {key: found.get(key) for key in wanted} == wanted


@pytest.mark.parametrize(
    ("names", "columns", "message", "hint"),
    [
        ("t,actual_q_1,target_q_1", None, "the positions are ambiguous", "--columns q=actual_q or --columns q=target_q"),
        ("t,q1,q2,qd1", None, "2 positions (q1, q2), but 1 of qd (qd1)", "--columns qd=none leaves these out"),
        ("t,q1,q2,a", "qd=none,qd2=a", "2 positions (q1, q2), but 1 of qd (a)", "--columns qd=none leaves these out"),
        ("t,q1,q3", None, "the positions are q1, q3: q2 is missing", "joints are numbered from 0 or from 1"),
        ("t,q2,q3", None, "the positions are q2, q3: q1 is missing", "joints are numbered from 0 or from 1"),
        ("t,q1,vel1,speed1", None, "two sets of columns are qd: vel1 or speed1", "--columns qd=vel or --columns qd=speed"),
        ("t,time,q1", None, "2 columns are times: t, time", "--columns t=t or --columns t=time"),
        ("q1,q2", None, "no column is the time", "name it: --columns t=NAME"),
        ("t,A1,A2", None, "no columns are positions of joints", "--columns q=A takes A1, A2 as positions"),
        ("t,x,y,z", None, "no columns are positions of joints", "`trajcli check FILE --job JOB`"),
        ("t,q1", "q=p", "--columns: there is no column 'p'", "its columns are"),
        ("t,q1,q2", "qdx=q1", "--columns: unknown quantity 'qdx'", "did you mean"),
        ("t,q1,q2", "q=q,q=q", "--columns: q is mapped twice", "map it once"),
        ("t,q1,q2", "q", "--columns: 'q' is no mapping", "such as t=time,q=target_q"),
    ],
)  # fmt: skip
def test_what_names_leave_open_is_refused_with_the_choices(
    names: str, columns: str | None, message: str, hint: str
) -> None:
    with pytest.raises(InputError) as caught:
        roles(names, columns)
    (problem,) = caught.value.problems
    assert message in problem.message
    assert hint in (problem.hint or "")
