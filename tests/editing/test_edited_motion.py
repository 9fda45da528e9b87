"""Motions with the columns of their file: how numbers are rounded, which decimals stamps need, what is no motion."""

from __future__ import annotations

from dataclasses import replace
from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest

from trajcli.editing.edited_motion import EditedMotion, ReadingOptions, decimals_for, read_motion
from trajcli.errors import InputError

TEXT = """\
time_ms,q1_deg,q2_deg,qd1_deg,qd2_deg,move
0.00,1.50,0.2500,0.0,0.000,0
10.25,2.50,0.5000,10.5,0.125,0
20.50,2.75,1.2500,3.5,-0.500,1
"""
DECIMALS = {"time_ms": 2, "q1_deg": 2, "q2_deg": 4, "qd1_deg": 1, "qd2_deg": 3, "move": 0}


@pytest.fixture
def motion(tmp_path: Path) -> EditedMotion:
    (tmp_path / "rows.csv").write_text(TEXT)
    return read_motion(str(tmp_path / "rows.csv"), ReadingOptions())


def test_columns_know_their_decimals_and_their_units(motion: EditedMotion) -> None:
    assert {column.name: column.decimals for column in motion.columns} == DECIMALS
    assert [column.factor for column in motion.columns] == pytest.approx([1e-3, *[np.pi / 180] * 4, 1])


def test_each_number_is_rounded_as_its_own_column_writes_it(motion: EditedMotion) -> None:
    """By decimal arithmetic, in the unit of the column; what is half of a last digit is its rounding."""
    generator = np.random.default_rng(5)
    exact = motion.with_rows(
        np.cumsum(generator.uniform(0.001, 0.01, 50)),
        {name: generator.normal(size=(50, 2)) for name in ("q", "qd")},
        np.arange(50),
    )
    exact.rows.q[0], exact.rows.qd[0] = -1e-9, -1e-9
    written = exact.as_written()
    for column in written.columns:
        if column.joint is None:
            before, after = exact.rows.t, written.rows.t
        else:
            before, after = (
                getattr(each.rows, column.quantity)[:, column.joint] for each in (exact, written)
            )
        if column.quantity == "move":
            assert written.rows.move is not None
            assert written.rows.move.tolist() == list(range(50))
            continue
        unit = Decimal(1).scaleb(-DECIMALS[column.name])
        expected = [float(Decimal(value).quantize(unit)) for value in (before / column.factor).tolist()]
        np.testing.assert_allclose(after / column.factor, expected, rtol=1e-14, atol=0)
    assert not np.signbit(written.rows.q[0]).any()
    assert not np.signbit(written.rows.qd[0]).any()
    resolution, degree = written.rows.resolution, np.pi / 180
    assert resolution.time == pytest.approx(0.5e-5)
    assert resolution.q == pytest.approx(np.array([0.5e-2, 0.5e-4]) * degree)
    assert resolution.qd == pytest.approx(np.array([0.5e-1, 0.5e-3]) * degree)


def test_a_column_of_bits_is_exact(motion: EditedMotion) -> None:
    columns = tuple(replace(column, decimals=None) for column in motion.columns)
    exact = replace(motion, columns=columns, rows=replace(motion.rows, q=motion.rows.q * np.pi))
    written = exact.as_written()
    np.testing.assert_allclose(written.rows.q, exact.rows.q, rtol=1e-15)
    assert (written.rows.resolution.time, *written.rows.resolution.q) == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(("asked", "expected"), [(9, 6), (12, 9), (4, 2), (None, 2)])
def test_stamps_in_milliseconds_need_three_decimals_fewer(
    motion: EditedMotion, asked: int | None, expected: int
) -> None:
    found = motion.with_rows(motion.rows.t, motion.quantities, motion.rows.move, decimals=asked)
    assert {column.name: column.decimals for column in found.columns} == {**DECIMALS, "time_ms": expected}


def test_other_rows_count_from_one_and_lose_the_columns_that_they_lack(motion: EditedMotion) -> None:
    later = replace(motion, rows=replace(motion.rows, first_row=7))
    found = later.with_rows(motion.rows.t, {"q": motion.rows.q}, None, "a note")
    assert found.rows.first_row == 1
    assert [column.name for column in found.columns] == ["time_ms", "q1_deg", "q2_deg"]
    assert (found.rows.qd, found.rows.move, found.notes) == (None, None, ("a note",))


def test_a_plan_has_nine_decimals_and_whoever_has_more_keeps_them(motion: EditedMotion) -> None:
    columns = (*motion.columns[:3], replace(motion.columns[3], decimals=11), *motion.columns[4:])
    found = replace(motion, columns=columns).with_planned_decimals(["qd"])
    decimals = {column.name: column.decimals for column in found.columns}
    assert decimals == {**DECIMALS, "qd1_deg": 11, "qd2_deg": 9}


@pytest.mark.parametrize("begin", [0.0, 3.0, 1.7e9])
def test_stamps_that_decimals_say_need_no_more(motion: EditedMotion, begin: float) -> None:
    """Hundredths of a millisecond are said, and of far stamps all that a float64 tells; others need nine decimals."""
    steps = np.array([0.0, 1.07e-3, 4.11e-3])
    assert decimals_for(motion, begin + steps) is None
    assert decimals_for(motion, begin + steps + [0, 4e-6, 0]) == 9
    exact = tuple(replace(column, decimals=None) for column in motion.columns)
    assert decimals_for(replace(motion, columns=exact), begin + steps / 3) is None


def arrays(path: Path, **changed: list[float]) -> Path:
    """Write a motion of one joint as arrays, which may hold what is no number."""
    fields = {"t": [0.0, 1.0, 2.0], **{name: [0.0, 0.5, 0.25] for name in ("q", "qd", "qdd")}, **changed}
    columns = {name: np.array(v) if name == "t" else np.array(v)[:, None] for name, v in fields.items()}
    np.savez(path, **columns)
    return path


@pytest.mark.parametrize("name", ["t", "q", "qd", "qdd"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_named_with_its_row(tmp_path: Path, name: str, value: float) -> None:
    path = arrays(tmp_path / "rows.npz", **{name: [0.0, value, 0.25]})
    with pytest.raises(InputError, match=rf"{name}1? is {value} in row 2"):
        read_motion(str(path), ReadingOptions(units="rad"))


@pytest.mark.parametrize("text", ["NaN", "Infinity", "1e999"])
def test_what_is_not_finite_is_refused_in_lines_of_json(tmp_path: Path, text: str) -> None:
    lines = [f'{{"t": {k}, "q": [{q}], "qd": [{qd}]}}' for k, q, qd in ((0, "0.5", "0.5"), (1, "0.5", text))]
    (tmp_path / "rows.jsonl").write_text("\n".join(lines) + "\n")
    with pytest.raises(InputError):
        read_motion(str(tmp_path / "rows.jsonl"), ReadingOptions())


@pytest.mark.parametrize(
    ("late", "said"), [(1.0, "is 1 s, that before it 1 s"), (0.5, "is 0.5 s, that before it 1 s")]
)
def test_stamps_increase(tmp_path: Path, late: float, said: str) -> None:
    path = arrays(tmp_path / "rows.npz", t=[0.0, 1.0, late])
    with pytest.raises(InputError, match=f"the time stamp of row 3 {said}"):
        read_motion(str(path), ReadingOptions(units="rad"))


def test_one_row_is_no_motion_and_two_are(tmp_path: Path) -> None:
    path = tmp_path / "rows.csv"
    path.write_text("t,q1\n0,0\n")
    with pytest.raises(InputError, match="has 1 row, a motion has two at least"):
        read_motion(str(path), ReadingOptions())
    path.write_text("t,q1,other\n0,0,9\n1,1,9\n")
    found = read_motion(str(path), ReadingOptions(units="rad"))
    assert found.rows.t.tolist() == [0, 1]
    assert found.notes == ("columns that are left out: other",)


@pytest.mark.parametrize("names", ["t,q1,q2,qd1,qd2", "time_ms,q1_deg,q2_mm,qd1_deg,qd2_mm"])
@pytest.mark.parametrize("second", ["1,2,3,4,5", "0.5,1.25,2.5,3,4.125"])
def test_who_reads_what_is_written_takes_it_for_as_certain(names: str, second: str, tmp_path: Path) -> None:
    """The peer is the reader of the same rows: whole degrees are rounded, whole radians are not."""
    (tmp_path / "rows.csv").write_text(f"{names}\n0,0,0,0,0\n{second}\n")
    slide = ("revolute", "prismatic")
    motion = read_motion(str(tmp_path / "rows.csv"), ReadingOptions(), joint_types=slide)
    read, said = motion.rows.resolution, motion.as_written().rows.resolution
    for name in ("time", "q", "qd"):
        assert getattr(said, name) == pytest.approx(getattr(read, name), rel=1e-12)
