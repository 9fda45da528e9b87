"""Rows of which some columns are taken: values, decimals, and lines that are no rows."""

from __future__ import annotations

import io
from collections.abc import Sequence

import pytest

from trajcli.errors import InputError
from trajcli.streams.text_layout import read_header
from trajcli.streams.text_rows import RowReader


def reader_of(names: str, taken: Sequence[int], fixed: Sequence[int] = ()) -> RowReader:
    """Return a reader of some columns of a file with these names, whose rows begin in line 2."""
    header, _ = read_header(io.BytesIO(f"{names}\n".encode()), "in.csv")
    return RowReader(header, taken, fixed)


@pytest.mark.parametrize(
    ("taken", "expected"), [([0], [[1], [4]]), ([1, 2], [[2.5, 3], [5, 6]]), ([0, 2], [[1, 3], [4, 6]])]
)
@pytest.mark.parametrize("text", ["1,2.5,3\n4,5.0,6\n", '1,"2.5",3\n4,5.0,6\n', "1,25e-1,3\n4,5,6"])
def test_the_columns_that_are_taken_are_those_of_their_names(
    taken: list[int], expected: list[list[float]], text: str
) -> None:
    assert reader_of("t,q1,q2", taken).read(text.encode()).tolist() == expected


@pytest.mark.parametrize("end", ["\n", ",note\n"])
@pytest.mark.parametrize(
    ("text", "line", "values"),
    [
        ("1,2{0}3{0}", 2, 2),  # together they would have three
        ("1{0}2,3{0}", 2, 1),
        ("1,2{0}3,4,5,6{0}", 2, 2),
        ("1,2,3{0}1,2,3,4{0}5,6{0}", 3, 4),
        ('1,"2,3"{0}', 2, 2),  # of which a comma divides nothing
    ],
)
def test_lines_of_other_widths_make_no_row_together(end: str, text: str, line: int, values: int) -> None:
    others = end.count(",")
    reader = reader_of("t,q1,q2" + ",said" * others, [0, 2])
    with pytest.raises(InputError) as caught:
        reader.read(text.format(end).encode())
    problem = caught.value.problems[0]
    assert problem.message == f"the line has {values + others} values, expected {3 + others} as in line 1"
    assert problem.place is not None
    assert problem.place.line == line


def test_decimals_are_the_most_of_all_blocks_whatever_their_form() -> None:
    reader = reader_of("t,q1,said", [0, 1])
    for block in ('0,"1.125",a\n', "1,1.5,a\n", "2,2.5,a\n", "3,1.25e0,a\n"):
        reader.read(block.encode())
    assert reader.decimals.tolist() == [0, 3]


@pytest.mark.parametrize("form", ["{},{},{}\n", '{},"{}",{}\n', "{}e0,{},{}\n"])
def test_texts_that_must_be_the_same_are_compared_in_each_block(form: str) -> None:
    """The column between them is taken, and the one behind holds other texts in each row."""
    rows = [form.format(k, "a" if k < 5 else "b", 10 * k) for k in range(6)]
    assert reader_of("t,name,q1", [0, 2], [1]).read("".join(rows[:5]).encode()).tolist()[4] == [4, 40]
    with pytest.raises(InputError) as caught:
        reader_of("t,name,q1", [0, 2], [1]).read("".join(rows).encode())
    assert caught.value.problems[0].message == "the rows are about other joints than the first one"
    reader = reader_of("t,name,q1", [0, 2], [1])
    for row in rows[:5]:
        reader.read(row.encode())
    with pytest.raises(InputError, match="about other joints than the first one") as caught:
        reader.read(rows[5].encode())
    assert caught.value.problems[0].place is not None
    assert caught.value.problems[0].place.line == 7


def test_a_comma_in_a_text_that_is_not_taken_makes_no_cell_more() -> None:
    reader = reader_of("t,said,q1,q2", [0, 3])
    with pytest.raises(InputError, match="the line has 3 values, expected 4"):
        reader.read(b'1,"a,b",7\n')
    assert reader_of("t,said,q1", [0, 2]).read(b'1,"a,b",7\n').tolist() == [[1, 7]]
