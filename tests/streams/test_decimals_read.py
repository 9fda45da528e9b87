from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trajcli.streams.decimals import NotFixedError, scan_fixed

CELL = st.tuples(st.sampled_from(["", "-"]), st.integers(0, 8_999_999), st.integers(0, 999_999_999))


@settings(max_examples=300, deadline=None)
@given(
    st.lists(st.tuples(CELL, CELL, st.integers(0, 99_999_999)), min_size=1, max_size=20),
    st.tuples(st.integers(1, 9), st.integers(1, 9)),
)
def test_every_cell_is_what_float_reads(rows, decimals):
    lines = [
        [
            *(
                f"{sign}{whole}.{part:09d}"[: count - 9 or None]
                for (sign, whole, part), count in zip(row[:2], decimals, strict=True)
            ),
            str(row[2]),
        ]
        for row in rows
    ]
    text = "".join(",".join(line) + "\n" for line in lines)
    read = scan_fixed(text.encode(), (*decimals, 0))
    expected = np.array([[float(cell) for cell in line] for line in lines])
    np.testing.assert_array_equal(read.view(np.int64), expected.view(np.int64))  # -0.0 too


def test_leading_zeros_are_digits():
    np.testing.assert_array_equal(scan_fixed(b"00000012.500000000\n", [9]), [[12.5]])


@pytest.mark.parametrize(
    "text",
    [
        "", "\n", "1.000000000", "1.000000000\n2.00000000\n", "1.0000000000\n", "1\n", ".000000000\n", "-.000000000\n",
        "+1.000000000\n", "--1.000000000\n", "1.000000000,1.000000000\n", "1.000000000,", "1.000000000\r\n", " 1.000000000\n",
        "1.000000000 \n", "1.000000000\n\n", "\n1.000000000\n", "1,000000000\n", "1.00000000x\n", "1.x00000000\n",
        "1.0000x0000\n", "x.000000000\n", "1:000000000\n", "123456789.000000000\n", "9007199.254740993\n", "1.00000-000\n",
        "1.-00000000\n", "1.\x7f00000000\n", "1.0000\xff000\n", "1.:00000000\n", "1.0000000:0\n", "/.000000000\n", "nan\n",
        "1e0.000000000\n", "1.00000e-10\n", "1.000000000;2.000000000\n", "1.0000\x0000000\n",
    ],
)  # fmt: skip
def test_any_other_form_is_refused(text):
    with pytest.raises(NotFixedError):
        scan_fixed(text.encode("latin-1"), [9])


@pytest.mark.parametrize(
    "text", ["1.000000000,1.000000000\n", "1.000000000,\n", "1.000000000,123456789\n", "1,1\n"]
)
def test_a_whole_number_has_one_to_eight_digits(text):
    with pytest.raises(NotFixedError):
        scan_fixed(text.encode(), [9, 0])


@pytest.mark.parametrize(
    "text", ["1.00\n", "1.0000\n", "1.000\n1.00\n", "1\n", ".000\n", "1.0x0\n", "1.0.0\n", "100000000.000\n"]
)
def test_each_cell_has_as_many_decimals_as_are_said(text):
    assert scan_fixed(b"-1.125\n99999999.999\n", [3]).tolist() == [[-1.125], [99999999.999]]
    with pytest.raises(NotFixedError):
        scan_fixed(text.encode(), [3])
    with pytest.raises(NotFixedError):
        scan_fixed(b"0.1234567890\n", [10])


def test_lines_must_be_as_wide_as_said():
    assert scan_fixed(b"1.000000000,2.000000000\n", [9, 9]).shape == (1, 2)
    for text in (b"1.000000000\n2.000000000,3.000000000\n4.000000000\n", b"1.000000000\n2.000000000\n"):
        with pytest.raises(NotFixedError):
            scan_fixed(text, [9, 9])


@pytest.mark.parametrize("text", ["1.000000000\n2", "1.000000000\n2.00000000", "1.000000000\n "])
def test_what_stands_behind_the_last_line_is_not_lost(text):
    with pytest.raises(NotFixedError):
        scan_fixed(text.encode(), [9])
