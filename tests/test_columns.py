from __future__ import annotations

import math

import numpy as np
import pytest

from trajcli.columns import Column, column_names, joint_factors, parse_column, whole_number_columns
from trajcli.errors import InputError
from trajcli.units import Units

JOINTS = ("revolute", "revolute", "prismatic")


def test_si_columns_have_plain_names():
    assert column_names(("t", "q", "qd", "move"), JOINTS, Units()) == [
        "t", "q1", "q2", "q3", "qd1", "qd2", "qd3", "move",
    ]  # fmt: skip


def test_other_units_stand_in_the_name_of_the_joints_they_are_of():
    names = column_names(("qdd", "t", "q"), JOINTS, Units("deg", "mm"))
    assert names == ["qdd1_deg", "qdd2_deg", "qdd3_mm", "t", "q1_deg", "q2_deg", "q3_mm"]
    assert column_names(("q",), JOINTS, Units("deg", "m")) == ["q1_deg", "q2_deg", "q3"]


@pytest.mark.parametrize(
    ("name", "column"),
    [
        ("t", Column("t")),
        ("q1", Column("q", 0)),
        ("qddd12_deg", Column("qddd", 11, "deg")),
        ("q3_mm", Column("q", 2, "mm")),
        ("move", Column("move")),
        ("x_mm", Column("x", None, "mm")),
        ("q0", Column("q0")),
        ("q01", Column("q01")),
        ("qdddd1", Column("qdddd1")),
        ("qw", Column("qw")),
        ("_deg", Column("_deg")),
        ("weight\n_kg", Column("weight\n_kg")),
    ],
)
def test_a_name_says_its_column_and_comes_back(name, column):
    assert parse_column(name) == column
    assert column.name == name


def test_what_is_named_is_what_is_parsed():
    for units in (Units(), Units("deg", "mm")):
        for name in column_names(("t", "q", "qd", "qdd", "qddd", "move"), JOINTS, units):
            assert parse_column(name).name == name
            assert parse_column(name).unit in (None, "deg", "mm")


def test_factors():
    assert Column("q", 0, "deg").factor == math.pi / 180
    assert Column("q", 0, "mm").factor == 1e-3
    assert Column("q", 0).factor == 1.0
    np.testing.assert_array_equal(joint_factors(JOINTS, Units("deg", "mm")), [math.pi / 180] * 2 + [1e-3])


def test_only_move_is_written_without_decimals():
    assert whole_number_columns(["t", "move", "q1"]) == (1,)


@pytest.mark.parametrize(
    ("groups", "message"),
    [((), "no columns"), (("t", "pos"), "no columns 'pos'"), (("q", "t", "q"), "'q' are asked for twice")],
)
def test_a_choice_that_cannot_be_written_is_refused(groups, message):
    with pytest.raises(InputError, match=message):
        column_names(groups, JOINTS, Units())
