from __future__ import annotations

import math

import numpy as np
import pytest

from trajcli.columns import (
    GROUPS,
    TOOL_COLUMNS,
    Column,
    columns_of,
    group_factors,
    group_of,
    joint_factors,
    kinds_of,
    parse_column,
    require_finite,
    row_fields,
    whole_number_columns,
)
from trajcli.errors import InputError, TrajcliError
from trajcli.units import Quantity, Units, factor

JOINTS = ("revolute", "revolute", "prismatic")
ANGLE, LENGTH, TIME, RATIO = (Quantity(dimension) for dimension in ("angle", "length", "time", "ratio"))


def names_of(groups, units):
    return [column.name for column in columns_of(groups, JOINTS, units)]


def test_si_columns_have_plain_names():
    assert names_of(("t", "q", "qd", "move"), Units()) == [
        "t", "q1", "q2", "q3", "qd1", "qd2", "qd3", "move",
    ]  # fmt: skip


def test_other_units_stand_in_the_name_of_the_joints_they_are_of():
    names = names_of(("qdd", "t", "q"), Units("deg", "mm"))
    assert names == ["qdd1_deg", "qdd2_deg", "qdd3_mm", "t", "q1_deg", "q2_deg", "q3_mm"]
    assert names_of(("q",), Units("deg", "m")) == ["q1_deg", "q2_deg", "q3"]


@pytest.mark.parametrize(
    ("name", "column"),
    [
        ("t", Column("t", None, None, TIME)),
        ("q1", Column("q", 0)),
        ("qddd12_deg", Column("qddd", 11, "deg", Quantity("angle", 3))),
        ("q3_mm", Column("q", 2, "mm", LENGTH)),
        ("move", Column("move", None, None, RATIO)),
        ("x_mm", Column("x", None, "mm", LENGTH)),
        ("x_deg", Column("x", None, "deg")),
        ("q0", Column("q0")),
        ("q01", Column("q01")),
        ("qdddd1", Column("qdddd1")),
        ("qw", Column("qw", None, None, RATIO)),
        ("_deg", Column("_deg")),
        ("weight\n_kg", Column("weight\n_kg")),
    ],
)
def test_a_name_says_its_column_and_comes_back(name, column):
    assert parse_column(name) == column
    assert column.name == name


def test_what_is_named_is_what_is_parsed():
    for units in (Units(), Units("deg", "mm")):
        for column in columns_of(GROUPS, JOINTS, units):
            parsed = parse_column(column.name)
            assert (parsed.kind, parsed.joint, parsed.unit) == (column.kind, column.joint, column.unit)
            assert parsed.factor == column.factor
            assert parsed.quantity in (column.quantity, None)
            assert (parsed.quantity is None) == (column.joint is not None and column.unit is None)


def test_a_column_says_what_it_measures():
    columns = columns_of(GROUPS, JOINTS, Units("deg", "mm"))
    by_name = {column.name: column for column in columns}
    assert by_name["t"].quantity == TIME
    assert by_name["q2_deg"] == Column("q", 1, "deg", ANGLE)
    assert by_name["qddd3_mm"] == Column("qddd", 2, "mm", Quantity("length", 3))
    assert by_name["x_mm"].quantity == by_name["s_mm"].quantity == LENGTH
    assert by_name["wz_deg"].quantity == Quantity("angle", 1)
    assert by_name["ax_mm"].quantity == by_name["sdd_mm"].quantity == Quantity("length", 2)
    assert by_name["qw"].quantity == by_name["move"].quantity == RATIO
    for column in columns:
        assert column.factor == factor(column.quantity, Units("deg", "mm"))
    assert {kind for group in TOOL_COLUMNS.values() for kind in group} <= {c.kind for c in columns}


def test_factors():
    assert Column("q", 0, "deg").factor == math.pi / 180
    assert Column("q", 0, "mm").factor == 1e-3
    assert Column("q", 0).factor == 1.0
    np.testing.assert_array_equal(joint_factors(JOINTS, Units("deg", "mm")), [math.pi / 180] * 2 + [1e-3])


def test_only_move_is_written_without_decimals():
    assert whole_number_columns(map(parse_column, ["t", "move", "q1"])) == (1,)


@pytest.mark.parametrize(
    ("groups", "message"),
    [((), "no columns"), (("t", "pos"), "no columns 'pos'"), (("q", "t", "q"), "'q' are asked for twice")],
)
def test_a_choice_that_cannot_be_written_is_refused(groups, message):
    with pytest.raises(InputError, match=message):
        columns_of(groups, JOINTS, Units())


NAMES = """t q1_deg q2_deg q3_mm qd1_deg qd2_deg qd3_mm qdd1_deg qdd2_deg qdd3_mm qddd1_deg qddd2_deg qddd3_mm
x_mm y_mm z_mm qw qx qy qz vx_mm vy_mm vz_mm wx_deg wy_deg wz_deg ax_mm ay_mm az_mm ex_deg ey_deg ez_deg
s_mm sd_mm sdd_mm tau1 tau2 tau3 zone signal.on signal.t move"""
OF_GROUPS = dict(zip(GROUPS, (1, 3, 3, 3, 3, 7, 6, 6, 3, 3, 1, 2, 1), strict=True))
ORDERS = {"q": 0, "qd": 1, "qdd": 2, "qddd": 3, "twist": 1, "twistd": 2}


def test_the_groups_have_the_columns_of_the_job_language():
    """Names, order, units and derivatives as JOB.md lists them: efforts and counts have no unit in their name."""
    columns = columns_of(GROUPS, JOINTS, Units("deg", "mm"), ("on", "t"))
    assert [column.name for column in columns] == NAMES.split()
    groups = [group for group, count in OF_GROUPS.items() for _ in range(count)]
    for column, group in zip(columns, groups, strict=True):
        assert group_of(column) == group_of(parse_column(column.name)) == group
        assert column.quantity is not None
        assert column.whole_numbers == (column.name in ("zone", "move"))
        order = {"sd": 1, "sdd": 2}.get(column.kind, ORDERS.get(group, 0))
        dimension = {"deg": "angle", "mm": "length"}.get(column.unit)
        if dimension is not None:
            assert column.quantity == Quantity(dimension, order)
    assert [c.quantity.dimension for c in columns if c.kind == "tau"] == ["torque", "torque", "force"]
    assert parse_column("signal.t") == Column("signal.t", None, None, RATIO)
    assert parse_column("tau2_deg").joint is None
    assert parse_column("tau12") == Column("tau", 11)
    assert group_of(Column("weight")) == "weight"


def test_columns_beside_those_of_joints_have_their_own_kinds_and_factors():
    assert kinds_of("path") == ("s", "sd", "sdd")
    assert kinds_of("twist") == ("vx", "vy", "vz", "wx", "wy", "wz")
    assert kinds_of("q") == kinds_of("none") == ()
    units = Units("deg", "mm")
    np.testing.assert_allclose(group_factors("twist", units), [1e-3] * 3 + [math.pi / 180] * 3)
    np.testing.assert_allclose(group_factors("pose", units), [1e-3] * 3 + [1.0] * 4)
    np.testing.assert_allclose(group_factors("twistd", Units()), [1.0] * 6)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_the_first_row_that_is_not_finite_is_told(value):
    columns = columns_of(("t", "q"), JOINTS, Units())
    rows = np.zeros((4, 4))
    require_finite(rows, columns, 100)
    rows[2, 3] = rows[3, 1] = value
    with pytest.raises(TrajcliError, match=f"q3 is {value} in row 102"):
        require_finite(rows, columns, 100)


def test_rows_have_a_field_for_each_group_and_for_each_signal() -> None:
    names = ["t", "q1", "q2", "qd1", "x", "y", "z", "signal.a", "signal.b", "move"]
    found = [
        (f.name, f.first, f.stop, f.alone, f.whole_numbers) for f in row_fields([*map(parse_column, names)])
    ]
    assert found == [
        ("t", 0, 1, True, False),
        ("q", 1, 3, False, False),
        ("qd", 3, 4, False, False),
        ("pose", 4, 7, False, False),
        ("signal.a", 7, 8, True, False),
        ("signal.b", 8, 9, True, False),
        ("move", 9, 10, True, True),
    ]


def test_columns_of_a_group_that_stand_apart_are_no_field() -> None:
    with pytest.raises(TrajcliError, match="the columns q stand apart"):
        row_fields([parse_column(name) for name in ("q1", "t", "q2")])
