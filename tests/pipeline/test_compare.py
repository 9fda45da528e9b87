from __future__ import annotations

import numpy as np
import pytest

from trajcli.errors import InputError
from trajcli.pipeline.column_tolerances import ALL, parse_tolerances
from trajcli.pipeline.compare import compare
from trajcli.pipeline.difference import describe
from trajcli.streams.table import Table


def table(columns, file="a.csv"):
    values = np.stack([np.asarray(column, dtype=float) for column in columns.values()], axis=1)
    return Table(tuple(columns), values, np.full(len(columns), 9), file)


def motion(count=101, period=0.01, file="a.csv", start=0.0, **more):
    """q1 = sin 3t and its derivatives."""
    t = start + np.arange(count) * period
    columns = {"t": t, "q1": np.sin(3 * t), "qd1": 3 * np.cos(3 * t), "qdd1": -9 * np.sin(3 * t)}
    return table(columns | {name: function(t) for name, function in more.items()}, file)


def changed(source, name, row, by, file="b.csv"):
    columns = source.columns.copy()
    columns[row, source.names.index(name)] += by
    return Table(source.names, columns, source.decimals, file)


def without(source, *names, file="b.csv"):
    kept = [place for place, name in enumerate(source.names) if name not in names]
    return Table(tuple(source.names[k] for k in kept), source.columns[:, kept], source.decimals[kept], file)


def cut(source, count, file="b.csv"):
    return Table(source.names, source.columns[:count], source.decimals, file)


def exactly(a, b, **options):
    return compare(a, b, {}, {}, **options)


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
    ],
)
def test_other_grids_are_refused(b, words):
    with pytest.raises(InputError, match="different times") as caught:
        exactly(motion(), b)
    assert words in str(caught.value)
    assert "--resample" in caught.value.problems[0].hint
    assert caught.value.exit_code == 2


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


def worst_of(found, kind):
    return next(column.worst.difference for column in found.columns if column.worst.column == kind)


def test_resampling_interpolates_with_what_derivatives_there_are():
    a = motion(1001, 1e-3)
    h = 0.01
    b = motion(101, h, "b.csv")
    found = exactly(a, b, resample=True)
    # The errors of cubic Hermite, h^4/384 max|f''''|, and linear interpolation, h^2/8 max|f''|.
    assert worst_of(found, "q1") < h**4 / 384 * 81 * 1.01
    assert worst_of(found, "qd1") < h**4 / 384 * 243 * 1.01
    assert h**2 / 8 * 81 * 0.5 < worst_of(found, "qdd1") < h**2 / 8 * 81 * 1.01
    linear = exactly(without(a, "qd1", file="a.csv"), without(b, "qd1"), resample=True)
    assert h**2 / 8 * 9 * 0.5 < worst_of(linear, "q1") < h**2 / 8 * 9 * 1.01
    assert found.notes == (
        "b.csv is interpolated from 0 s to 1 s (cubic for q, qd; linear for qdd); "
        "a.csv lasts from 0 s to 1 s, b.csv lasts from 0 s to 1 s",
    )
    assert found.notes[0] in describe(found)
    assert compare(a, b, {"q": 1e-8, "qd": 1e-7, "qdd": 2e-3}, {}, resample=True).equal


def test_resampling_is_exact_where_rows_meet():
    a, b = motion(101, 0.01), motion(51, 0.02, "b.csv")
    for kept in ((), ("qd1", "qdd1")):
        found = exactly(without(b, *kept, file="b.csv"), without(a, *kept, file="a.csv"), resample=True)
        assert found.worst.difference < 1e-15


def test_a_real_difference_survives_resampling():
    a, b = motion(1001, 1e-3), motion(101, 0.01, "b.csv")
    found = compare(a, changed(b, "q1", 40, 1e-4), {"q": 1e-8, ALL: 1.0}, {}, resample=True)
    assert not found.equal
    assert found.worst.column == "q1"
    assert found.worst.time == pytest.approx(0.4)


def test_resampling_keeps_to_the_common_interval_and_to_units():
    a = motion(200, 0.01, start=0.2)
    b = motion(101, 0.015, "b.csv")
    b = Table(("t", "q1_deg", "qd1_deg", "qdd1_deg"), b.columns * [1, *[180 / np.pi] * 3], b.decimals, "b.csv")
    found = compare(a, b, {"q": 1e-7, "qd": 1e-6, "qdd": 1e-2}, {}, resample=True)
    assert found.equal
    assert found.rows == 131  # from 0.2 s to 1.5 s
    assert "from 0.2 s to 1.5 s" in found.notes[0]


def test_a_count_is_never_interpolated():
    a = table({"t": np.arange(11) / 10, "move": np.arange(11) >= 5})
    b = table({"t": np.arange(6) / 5, "move": np.arange(6) >= 3}, "b.csv")
    found = exactly(a, b, resample=True)
    assert {found.worst.a, found.worst.b} == {0.0, 1.0}
    assert "(the earlier row for move)" in found.notes[0]
    assert found.columns[0].count == 1


@pytest.mark.parametrize(
    ("a", "b", "words"),
    [
        (motion(), motion(start=5.0, file="b.csv"), "no row of a.csv lies inside the times of b.csv"),
        (motion(), without(motion(), "t"), "do not both have a column t"),
        (
            motion(),
            table({"t": [0.0, 0.2, 0.2], "q1": [0, 0, 0]}, "b.csv"),
            "0.2 s is followed by 0.2 s in row 2",
        ),
        (motion(), table({"t": [0.0, 1.0]}, "b.csv"), "no column in common but t"),
    ],
)
def test_what_cannot_be_resampled_is_refused(a, b, words):
    with pytest.raises(InputError) as caught:
        exactly(a, b, resample=True)
    assert words in str(caught.value)


def test_one_row_is_resampled_by_itself():
    found = exactly(motion(), motion(1, 1.0, "b.csv"), resample=True)
    assert (found.equal, found.rows) == (True, 1)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1e-9", {ALL: 1e-9}),
        ("q=1e-9,qd=1e-6", {"q": 1e-9, "qd": 1e-6}),
        (" q1_deg = 0.5 , 0", {"q1_deg": 0.5, ALL: 0.0}),
        ("*=2", {ALL: 2.0}),
        ("a=b=1", {"a=b": 1.0}),
    ],
)
def test_tolerances_are_read(text, expected):
    assert parse_tolerances(text) == expected


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "does not end in a number"),
        ("q", "'q' does not end in a number"),
        ("q=", "does not end in a number"),
        ("q=1,", "does not end in a number"),
        ("q=-1", "'q=-1' is -1"),
        ("q=nan", "is nan"),
        ("inf", "is inf"),
        ("=1", "names no column"),
        ("q=1,q=2", "'q=2' comes after another one"),
        ("1,2", "'2' comes after another one"),
    ],
)
def test_wrong_tolerances_are_refused(text, words):
    with pytest.raises(InputError) as caught:
        parse_tolerances(text)
    assert words in str(caught.value)


def test_a_tolerance_for_nothing_is_refused():
    with pytest.raises(InputError, match="'qe' fits no column") as caught:
        compare(motion(), motion(), {"qe": 1.0}, {})
    assert caught.value.problems[0].hint.startswith("did you mean 'q")
    with pytest.raises(InputError, match="'move' fits no column"):
        compare(motion(), motion(), {}, {"move": 1.0})
