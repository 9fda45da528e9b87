from __future__ import annotations

import numpy as np
import pytest
from tables import changed, cut, exactly, motion, table, without

from trajcli.comparison.difference import ALL, as_json, compare, describe
from trajcli.errors import InputError
from trajcli.streams.table import Table


def test_a_table_equals_itself_in_any_order_of_columns():
    a = motion()
    b = Table(a.names[::-1], a.columns[:, ::-1], a.decimals, "b.csv")
    found = exactly(a, b)
    assert found.equal
    assert found.first is None
    assert found.worst.difference == 0
    assert [column.worst.column for column in found.columns] == list(a.names)
    assert describe(found) == "equal: a.csv and b.csv (101 rows, 4 columns compared)"


@pytest.mark.parametrize("name", ["t", "q1", "qdd1"])
@pytest.mark.parametrize("row", [0, 50, 100])
def test_the_smallest_change_is_found_where_it_is(name, row):
    a = motion()
    b = changed(a, name, row, 1e-9)
    found = exactly(a, b)
    assert not found.equal
    for deviation in (found.first, found.worst):
        assert (deviation.column, deviation.row, deviation.time) == (name, row, a.columns[row, 0])
        assert deviation.a == a.column(name)[row]
        assert deviation.b == b.column(name)[row]
        assert deviation.difference == pytest.approx(1e-9, rel=1e-6)
        assert deviation.tolerance == 0
    assert sum(column.count for column in found.columns) == 1


def test_first_and_worst_are_told_apart():
    a = motion()
    b = changed(changed(changed(a, "q1", 80, 0.5), "qd1", 20, 1e-3), "qd1", 30, 2e-3)
    found = exactly(a, b)
    assert (found.first.column, found.first.row) == ("qd1", 20)
    assert (found.worst.column, found.worst.row) == ("q1", 80)
    assert [column.count for column in found.columns] == [0, 1, 2, 0]
    text = describe(found).splitlines()
    assert text[0] == "different: a.csv and b.csv (101 rows, 4 columns compared)"
    assert text[1].startswith("first: qd1 at t = 0.2 s: ")
    assert text[2].startswith("worst: q1 at t = 0.8 s: ")
    assert "0.5 apart (tolerance 0)" in text[2]
    assert text[3:][0] == "2 columns differ, each with its worst:"
    assert text[5].startswith("  2 rows of qd1 at t = 0.3 s: ")


@pytest.mark.parametrize(
    ("atol", "rtol", "equal"),
    [
        ({"q": 1e-6}, {}, True),
        ({"q1": 1e-6}, {}, True),
        ({ALL: 1e-6}, {}, True),
        ({"q": 0.9e-6}, {}, False),
        ({"qd": 1.0}, {}, False),
        ({ALL: 1.0, "q": 1e-7}, {}, False),
        ({"q": 1.0, "q1": 1e-7}, {}, False),
        ({"q": 1e-7, "q1": 1.0}, {}, True),
        ({}, {"q": 1.1e-6 / np.sin(1.5)}, True),
        ({}, {ALL: 0.9e-6 / np.sin(1.5)}, False),
        ({"q": 0.5e-6}, {"q": 0.6e-6 / np.sin(1.5)}, True),
    ],
)
def test_the_nearest_tolerance_decides(atol, rtol, equal):
    a = motion()
    assert compare(a, changed(a, "q1", 50, 0.999999e-6), atol, rtol).equal is equal


def test_the_worst_is_measured_by_its_tolerance():
    a = motion()
    b = changed(changed(a, "q1", 10, 1e-3), "qdd1", 20, 1e-2)
    found = compare(a, b, {"q": 1e-4, "qdd": 1e-1}, {})
    assert (found.worst.column, found.worst.tolerance) == ("q1", 1e-4)
    found = compare(a, b, {"q": 1.0, "qdd": 1e-1}, {})
    assert found.equal
    assert found.worst.column == "qdd1"
    assert describe(found).splitlines()[1].endswith("0.01 apart (tolerance 0.1)")


def test_the_worst_row_is_measured_by_its_tolerance():
    a, b = table({"q1": [100.0, 1e-3, 1.0]}), table({"q1": [100.05, 1.5e-3, 1.0]}, "b.csv")
    found = compare(a, b, {}, {"q": 1e-3})
    assert (found.worst.row, found.columns[0].count) == (1, 1)
    assert exactly(a, b).worst.row == 0


def test_columns_in_other_units_are_converted():
    a = motion(q2=np.cos)
    b = motion(file="b.csv", q2=np.cos)
    b = Table(
        ("t", "q1_deg", "qd1_deg", "qdd1", "q2_mm"),
        b.columns * [1, *[180 / np.pi] * 2, 1, 1e3],
        b.decimals,
        "b.csv",
    )
    assert compare(a, b, {ALL: 1e-12}, {}).equal
    assert compare(b, a, {ALL: 1e-11}, {}).equal
    wrong = compare(changed(b, "q1_deg", 5, 1e-3, "b.csv"), a, {ALL: 1e-9}, {})
    assert (wrong.worst.column, wrong.worst.row) == ("q1_deg", 5)
    assert wrong.worst.difference == pytest.approx(1e-3, rel=1e-6)  # in degrees, as the first file


def test_the_same_name_is_paired_first():
    a = table({"q1": [1.0], "q1_deg": [2.0]})
    b = table({"q1_deg": [2.0], "q1": [1.0]}, "b.csv")
    assert exactly(a, b).equal


def test_a_column_is_paired_once():
    found = exactly(table({"q1_deg": [0.0], "q1_mm": [0.0]}), table({"q1": [0.0]}, "b.csv"))
    assert [column.worst.column for column in found.columns] == ["q1_deg"]
    assert found.missing == (("q1_mm", 1),)


def test_an_angle_is_no_length():
    with pytest.raises(InputError, match="an angle and a length"):
        exactly(table({"q1_deg": [1.0]}), table({"q1_mm": [1.0]}, "b.csv"))


def test_a_missing_column_is_a_difference():
    a = motion()
    found = exactly(a, without(a, "qd1"))
    assert not found.equal
    assert found.missing == (("qd1", 1),)
    assert "b.csv has no column qd1" in describe(found)
    found = exactly(without(a, "q1", "qd1", file="c.csv"), a)
    assert found.missing == (("q1", 0), ("qd1", 0))
    assert "c.csv has no column q1" in describe(found)


def test_a_file_that_ends_early_differs():
    a = motion()
    for one, other, index in ((a, cut(a, 60), 1), (cut(a, 60), a, 0)):
        found = exactly(one, other)
        assert not found.equal
        assert (found.rows, found.first, found.worst.difference) == (60, None, 0)
        assert found.ended == (index, a.columns[59, 0])
        assert "ends at t = 0.59 s, before" in describe(found)
        assert as_json(found)["ended"] == {"file": (one.file, other.file)[index], "time": a.columns[59, 0]}


@pytest.mark.parametrize(
    ("count", "more"), [(1, []), (20, []), (21, ["  and 1 more"]), (25, ["  and 5 more"])]
)
def test_columns_that_differ_are_listed_up_to_a_number(count, more):
    steps = np.arange(4.0)
    names = {"t": steps} | {f"q{number}": steps for number in range(1, count + 1)}
    a = table(names, "a.csv")
    b = table({name: values + 0.5 * (name != "t") for name, values in names.items()}, "b.csv")
    lines = describe(exactly(a, b)).splitlines()
    listed = [line for line in lines if line.startswith("  4 rows of")]
    assert len(listed) == (min(count, 20) if count > 1 else 0)
    assert lines[len(lines) - len(more) :] == more
    assert sum("more" in line for line in lines) == len(more)


def test_a_last_row_off_the_grid_is_no_other_grid():
    a = motion()
    short = cut(a, 60)
    columns = short.columns.copy()
    columns[-1, 0] = 0.585
    short = Table(a.names, columns, a.decimals, "b.csv")
    found = exactly(a, short)
    assert found.ended == (1, 0.585)
    assert (found.rows, found.first) == (59, None)
    same_length = exactly(cut(a, 60, "a.csv"), short)
    assert not same_length.equal
    assert same_length.ended is None
    assert (same_length.first.column, same_length.first.row) == ("t", 59)


@pytest.mark.parametrize(
    ("b", "words"),
    [
        (motion(51, 0.02, "b.csv"), "a.csv has one every 0.01 s from 0 s on, b.csv has one every 0.02 s"),
        (motion(101, 0.02, "b.csv"), "row 1 is at 0.01 s and 0.02 s"),
        (motion(101, 0.01, "b.csv", start=0.5), "from 0.5 s on"),
        (motion(2, 0.02, "b.csv"), "0.02 s"),
        (motion(1, 0.02, "b.csv", start=0.5), "b.csv has one row, at 0.5 s"),
        (table({"t": [0.0, 0.3, 0.9], "q1": [0, 0, 0]}, "b.csv"), "b.csv has 3 rows from 0 s to 0.9 s"),
    ],
)
def test_other_grids_are_refused(b, words):
    with pytest.raises(InputError, match="different times") as caught:
        exactly(motion(), b)
    assert words in str(caught.value)
    assert "--resample" in caught.value.problems[0].hint
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(
    ("b", "words"),
    [
        (motion(start=5.0, file="b.csv"), "no row of a.csv lies inside the times of b.csv"),
        (table({"t": [0.0, 0.2, 0.2], "q1": [0, 0, 0]}, "b.csv"), "the times of b.csv do not increase"),
    ],
)
def test_resampling_is_not_advised_where_it_is_refused(b, words):
    with pytest.raises(InputError, match="different times") as caught:
        exactly(motion(), b)
    assert words in caught.value.problems[0].hint


def test_times_within_their_tolerance_are_those_of_one_grid():
    a = motion()
    b = Table(a.names, a.columns + np.array([1e-3, 0, 0, 0]), a.decimals, "b.csv")
    assert compare(a, b, {"t": 2e-3}, {}).equal
    with pytest.raises(InputError, match="different times"):
        compare(a, b, {"t": 0.5e-3}, {})
    near = Table(a.names, a.columns + np.array([1e-9, 0, 0, 0]), a.decimals, "b.csv")
    assert exactly(a, near).columns[0].count == 101


def test_without_times_rows_are_counted():
    a, b = without(motion(), "t", file="a.csv"), without(motion(), "t")
    assert exactly(a, b).equal
    found = exactly(a, changed(b, "q1", 7, 1e-3))
    assert (found.first.row, found.first.time) == (7, None)
    assert "q1 in row 7" in describe(found)
    for one, other in ((a, cut(b, 50)), (motion(), cut(b, 50))):
        with pytest.raises(InputError, match=r"101 rows, b\.csv has 50, and not both have times"):
            exactly(one, other)


def test_files_with_nothing_in_common_are_refused():
    with pytest.raises(InputError, match=r"a\.csv and b\.csv have no column in common") as caught:
        exactly(table({"t": [0.0]}), table({"x": [0.0]}, "b.csv"))
    assert caught.value.problems[0].hint == "the first has t; the second has x"


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("pair", [(1.0, 1.1), (1.1, 1.0), (-0.05, 0.05), (0.0, 0.1)])
def test_the_larger_magnitude_of_both_counts_in_a_relative_tolerance(pair, sign):
    a, b = table({"q1": [sign * pair[0]]}), table({"q1": [sign * pair[1]]}, "b.csv")
    share = 0.1 / max(map(abs, pair))
    assert compare(a, b, {}, {"q": share * (1 + 1e-9)}).equal
    assert not compare(a, b, {}, {"q": share * (1 - 1e-9)}).equal
    allowed = compare(a, b, {"q": 0.025}, {"q": share * 0.75}).worst.tolerance
    assert allowed == pytest.approx(0.1)


def test_without_a_tolerance_the_smallest_difference_is_worse_than_any_that_is_accepted():
    a = table({"q1": [0.0], "qd1": [0.0]})
    found = compare(a, table({"q1": [0.5], "qd1": [1e-9]}, "b.csv"), {"q": 1.0}, {})
    assert (found.worst.column, found.first.column) == ("qd1", "qd1")


def test_a_column_has_one_partner_at_most():
    found = exactly(table({"q1": [1.0], "q1_deg": [5.0]}), table({"q1": [1.0]}, "b.csv"))
    assert found.missing == (("q1_deg", 1),)
    assert found.columns[0].count == 0


def test_an_angle_is_no_length_in_any_column():
    with pytest.raises(InputError, match=r"q2_mm in a.csv and q2_deg in b.csv are a length and an angle"):
        exactly(table({"q1": [1.0], "q2_mm": [1.0]}), table({"q1": [1.0], "q2_deg": [1.0]}, "b.csv"))


@pytest.mark.parametrize("one_first", [True, False])
def test_one_row_is_near_that_of_a_grid_by_the_period_of_the_grid(one_first):
    for off, near in ((1e-9, True), (1e-6, False)):
        one, many = table({"t": [off], "q1": [0.0]}, "one.csv"), motion()
        pair = (one, many) if one_first else (many, one)
        if near:
            found = exactly(*pair)
            assert (found.rows, found.ended) == (1, (int(not one_first), off))
        else:
            with pytest.raises(InputError, match="different times"):
                exactly(*pair)


def test_two_rows_at_different_times_are_not_compared():
    with pytest.raises(InputError, match="different times"):
        exactly(table({"t": [0.0], "q1": [0.0]}), table({"t": [0.1], "q1": [0.0]}, "b.csv"))


@pytest.mark.parametrize("by", [1e-6, -1e-6])
def test_a_ten_thousandth_of_a_period_is_another_time(by):
    a = motion()
    with pytest.raises(InputError, match="row 0 is at"):
        exactly(a, Table(a.names, a.columns + np.array([by, 0, 0, 0]), a.decimals, "b.csv"))
