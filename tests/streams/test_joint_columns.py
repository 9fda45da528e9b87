"""Columns of joints: by number or by name, in whatever order and unit, and what of them is refused."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.kinematics.robot import Joint, Robot, unlimited
from trajcli.streams.joint_columns import joint_columns, refuse_zero, time_column

DEG = math.pi / 180


def robot(*names: str, slides: tuple[int, ...] = (1,)) -> Robot:
    joints = tuple(Joint(name, "prismatic" if k in slides else "revolute") for k, name in enumerate(names))
    return Robot("pair", joints, replace(unlimited(len(names))), "standard", np.eye(4), np.eye(4))


PAIR = robot("turn", "lift")


@pytest.mark.parametrize(
    ("names", "row", "values"),
    [
        ("q1,q2", (30, 40), (30, 40)),
        ("q2,t,q1", (40, 9, 30), (30, 40)),
        ("q2_mm,q1_deg", (40, 30), (30 * DEG, 0.04)),
        ("lift_mm,turn_deg", (40, 30), (30 * DEG, 0.04)),
        ("lift,q1_deg,qd1,qd2,tau1", (40, 30, 5, 6, 7), (30 * DEG, 40)),
        ("t,q1,q2", (9, 30, 40), (30, 40)),
        ("t,q1,q2_mm", (9, 30, 40), (30, 0.04)),
        ("q1,x,q2", (30, 9, 40), (30, 40)),
    ],
)
def test_columns_say_joint_and_unit(names: str, row: tuple[float, ...], values: tuple[float, ...]) -> None:
    split = names.split(",")
    found = joint_columns(PAIR, split, "rows.csv")
    rows = np.array([row, np.multiply(row, 2)], dtype=float)
    np.testing.assert_allclose(found.values(rows), [values, np.multiply(values, 2)], rtol=1e-15)
    times = found.times(rows)
    if "t" in split:
        assert times[:, 0].tolist() == [row[split.index("t")], 2 * row[split.index("t")]]
    assert times.shape == (2, split.count("t"))
    units = [
        unit if f"_{unit}" in names else plain for unit, plain in (("deg", "rad"), ("mm", "m"))
    ]  # of a turn, of a slide
    assert found.units == units


@pytest.mark.parametrize("kind", ["q", "qd", "qdd", "qddd", "tau"])
def test_each_kind_has_columns_of_its_own(kind: str) -> None:
    names = [f"{each}{k}" for each in ("tau", "qddd", "qdd", "qd", "q") for k in (2, 1)]
    found = joint_columns(PAIR, names, "rows.csv", kind)
    assert [names[k] for k in found.joints] == [f"{kind}1", f"{kind}2"]
    with pytest.raises(InputError, match=f"pair has 2 joints, and there is no column {kind}2"):
        joint_columns(PAIR, [name for name in names if name != f"{kind}2"], "rows.csv", kind)


def test_names_of_the_tool_of_times_and_of_moves_are_joints_only_where_nothing_else_is() -> None:
    slides = robot("x", "t", "move", slides=(0, 1, 2))
    found = joint_columns(slides, ["t", "move", "x", "q1", "q2", "q3"], "rows.csv")
    assert found.joints.tolist() == [3, 4, 5]
    assert found.time == 0
    assert joint_columns(slides, ["t", "q3", "q2", "x_mm"], "rows.csv").joints.tolist() == [3, 2, 1]
    with pytest.raises(InputError, match="no column q2, q3"):
        joint_columns(slides, ["t", "move", "x"], "rows.csv")
    # only positions go by the name of a joint
    with pytest.raises(InputError, match="no column qd1, qd2"):
        joint_columns(PAIR, ["turn", "lift"], "rows.csv", "qd")


@pytest.mark.parametrize(
    ("names", "message", "hint", "column"),
    [
        ("t,q1_mm,q2", "q1_mm cannot be in mm: turn is revolute", "expected q1 or q1_deg", 3),
        ("t,q1,lift_deg", "lift_deg cannot be in deg: lift is prismatic", "expected q2 or q2_mm", 6),
        ("q1,q2,q3", "q3 is the column of joint 3, pair has 2 joints", "", 7),
        ("q1,q2,q1_deg", "q1_deg and q1 are columns of the same joint", "leave one out", 7),
        ("q1,q2,turn", "turn and q1 are columns of the same joint", "leave one out", 7),
        ("t,x", "pair has 2 joints, and there is no column q1, q2", "q1_deg or q1_mm", 1),
        ("t,q0,q1,q2", "q0: joints are counted from 1", "`trajcli convert FILE --si`", 3),
        ("t,q1,q2,qd0_deg", "qd0_deg: joints are counted from 1", "rename them", 9),
        ("tau0,q1,q2", "tau0: joints are counted from 1", "rename them", 1),
    ],
)
def test_wrong_columns_are_refused_where_they_stand(names: str, message: str, hint: str, column: int) -> None:
    with pytest.raises(InputError) as caught:
        joint_columns(PAIR, names.split(","), "rows.csv")
    (problem,) = caught.value.problems
    assert message in problem.message
    assert hint in str(problem.hint)
    assert problem.place is not None
    assert (problem.place.file, problem.place.line, problem.place.column) == ("rows.csv", 1, column)


def test_what_is_called_alike_is_not_counted_from_zero() -> None:
    refuse_zero(["q10", "q1", "signal.q0", "q0x", "aq0", "zone0"], "rows.csv")


def test_of_two_columns_of_times_the_last_is_taken_and_other_units_are_none() -> None:
    assert time_column(["q1", "t", "t"]) == 2
    assert time_column(["q1", "t_ms"]) is None


def test_values_that_stand_so_in_the_rows_are_not_copied() -> None:
    rows = np.zeros((3, 4))
    assert joint_columns(PAIR, ["t", "q1", "q2", "x"], "rows.csv").values(rows).base is rows
    for names in (["t", "q2", "q1", "x"], ["q1", "t", "q2", "x"], ["t", "q1_deg", "q2", "x"]):
        assert joint_columns(PAIR, names, "rows.csv").values(rows).base is not rows
    four = joint_columns(robot("a", "b", "c", "d"), ["q1", "q3", "q2", "q4"], "rows.csv")
    assert four.values(np.array([[1.0, 3.0, 2.0, 4.0]])).tolist() == [[1, 2, 3, 4]]


@pytest.mark.parametrize(
    ("names", "helps"),
    [
        ("time,a_pos,b_pos", True),
        ("a_pos,b_pos", False),  # rows without times are not converted
        ("t,x,y,z", False),
        ("t,q1", False),  # of one joint, whatever it is called
        ("t,a_pos", False),
        ("t,q0,q1", True),
        ("q0,q1", False),
    ],
)
def test_convert_is_advised_where_it_helps(names: str, helps: bool) -> None:
    with pytest.raises(InputError) as caught:
        joint_columns(PAIR, names.split(","), "rows.csv")
    assert ("`trajcli convert FILE --si`" in str(caught.value.problems[0].hint)) == helps
