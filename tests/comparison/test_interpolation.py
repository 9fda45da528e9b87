from __future__ import annotations

import numpy as np
import pytest
from tables import changed, exactly, motion, table, without

from trajcli.comparison.difference import ALL, compare, describe
from trajcli.errors import InputError
from trajcli.streams.table import Table


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
        (
            "b.csv is interpolated from 0 s to 1 s (cubic for q, qd; linear for qdd); "
            "a.csv lasts from 0 s to 1 s, b.csv lasts from 0 s to 1 s"
        ),
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
    b = Table(
        ("t", "q1_deg", "qd1_deg", "qdd1_deg"), b.columns * [1, *[180 / np.pi] * 3], b.decimals, "b.csv"
    )
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


@pytest.mark.parametrize("name", ["signal.glue", "zone", "move"])
def test_what_is_set_at_a_time_stays_until_then_between_rows_of_a_lower_rate(name):
    """A signal of 1 from 2 s on has no half of it at 1.5 s."""
    fine = table({"t": np.arange(7) / 2, name: np.arange(7) >= 4}, "a.csv")
    coarse = table({"t": np.arange(4.0), name: np.arange(4) >= 2}, "b.csv")
    assert exactly(fine, coarse, resample=True).equal


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


CUBIC, SLOPE, BEND = np.array([2.0, -1.0, 0.5, 0.3]), np.array([6.0, -2.0, 0.5]), np.array([12.0, -2.0])
PAIRS = [
    ("q1", "qd1"), ("qd1", "qdd1"), ("qdd1", "qddd1"), ("s", "sd"), ("sd", "sdd"), ("x", "vx"), ("z", "vz"),
    ("vy", "ay"), ("wx", "ex"), ("wz", "ez"),
]  # fmt: skip


@pytest.mark.parametrize(("name", "rate"), PAIRS)
def test_a_cubic_is_interpolated_exactly_with_its_derivative_and_not_without(name, rate):
    fine, coarse = np.linspace(0, 1, 41), np.linspace(0, 1, 5)
    a = table({"t": fine, name: np.polyval(CUBIC, fine)})
    b = table({"t": coarse, name: np.polyval(CUBIC, coarse), rate: np.polyval(SLOPE, coarse)}, "b.csv")
    assert worst_of(exactly(a, b, resample=True), name) < 1e-14
    assert worst_of(exactly(a, without(b, rate), resample=True), name) > 1e-2


@pytest.mark.parametrize("other", ["qd2", "qd1_deg", "qd1_mm", "qdd1", "vx"])
def test_a_derivative_of_another_joint_or_in_another_unit_is_none(other):
    fine, coarse = np.linspace(0, 1, 41), np.linspace(0, 1, 5)
    a = table({"t": fine, "q1": np.polyval(CUBIC, fine)})
    b = table({"t": coarse, "q1": np.polyval(CUBIC, coarse), other: 7 + coarse}, "b.csv")
    assert exactly(a, b, resample=True).worst == exactly(a, without(b, other), resample=True).worst
    assert "linear for q" in exactly(a, b, resample=True).notes[0]


def test_rows_before_the_second_file_are_counted_but_not_compared():
    a, b = motion(101, 0.01), motion(51, 0.01, "b.csv", start=0.3)
    found = compare(a, changed(b, "q1", 7, 0.25), {"q": 1e-9, ALL: 1.0}, {}, resample=True)
    for deviation in (found.first, found.worst):
        assert (deviation.row, deviation.time) == (37, pytest.approx(0.37))
        assert deviation.a == pytest.approx(np.sin(3 * 0.37))
    assert (found.rows, found.columns[0].count) == (51, 1)


@pytest.mark.parametrize("first", [True, False])
def test_times_of_either_file_must_increase_to_be_interpolated(first):
    falling = table({"t": [0.0, 0.2, 0.1], "q1": [0, 0, 0]}, "a.csv" if first else "b.csv")
    pair = (falling, motion(file="b.csv")) if first else (motion(), falling)
    with pytest.raises(InputError, match=f"the times of {falling.file} do not increase"):
        exactly(*pair, resample=True)
