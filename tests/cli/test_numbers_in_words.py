"""Numbers, poses and tables as the commands print them for people."""

from __future__ import annotations

import pytest

from trajcli.cli.numbers import matrix_lines, number, numbers, pose_lines, table_lines
from trajcli.units import Units


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (-0.0, "0"),
        (-4e-13, "0"),
        (6e-13, "1e-12"),
        (1.5e-7, "1.5e-07"),
        (-1 / 3, "-0.333333333"),
        (123456.7891234, "123456.789"),
        (2e9, "2e+09"),
        (float("inf"), "inf"),
    ],
)
def test_a_number_has_nine_digits_and_no_rounding_of_a_zero(value: float, text: str) -> None:
    assert number(value) == text
    assert numbers([1.0, value]) == f"1  {text}"


def test_a_pose_has_each_form_in_its_line() -> None:
    view = {
        "matrix": [[1.0, 0.0], [-10.0, 2.5]],
        "xyz": [1.0, 2.0, 3.0],
        "rpy": [4.0, 5.0, 6.0],
        "quat_wxyz": [0.1, 0.2, 0.3, 0.4],
    }
    units = Units("deg", "mm")
    assert list(pose_lines(view, units)) == [
        "    1    0",
        "  -10  2.5",
        "  xyz (mm): 1  2  3",
        "  rpy (deg, about fixed x, y, z): 4  5  6",
        "  quat_wxyz: 0.1  0.2  0.3  0.4",
    ]
    assert list(matrix_lines([[1.0], [-1.0]], "")) == [" 1", "-1"]


def test_numbers_stand_to_the_right_and_words_to_the_left() -> None:
    rows = [
        ["joint", "limit", "note"],
        ["a", "-1", "far"],
        ["bb", "+-10", "1 m"],
        ["c", "-", ""],
        ["d", "", "x"],
    ]
    assert list(table_lines(rows)) == [
        "  joint  limit  note",
        "  a         -1  far",
        "  bb      +-10  1 m",
        "  c          -",
        "  d             x",
    ]
