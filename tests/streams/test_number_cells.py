"""Numbers of any form against `float`, which reads each correctly rounded."""

from __future__ import annotations

from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from trajcli.streams import text_rows
from trajcli.streams.decimals import NotFixedError
from trajcli.streams.number_cells import decimals_of, encode_full, scan_decimals
from trajcli.streams.table import read_csv

FORMS = ["{!r}", "{:.18e}", "{:.6f}", "{:.3e}", "{:.15g}", "{:+.12f}", "{:.16E}", " {:.9f}"]
SIZED = st.floats(-1e15, 1e15, allow_subnormal=False)
CELL = st.one_of(
    st.tuples(st.sampled_from(FORMS), SIZED).map(lambda pair: pair[0].format(pair[1])),
    st.tuples(st.integers(0, 10**19), st.integers(-30, 30)).map(lambda pair: f"{pair[0]}e{pair[1]}"),
    st.tuples(st.integers(0, 10**9), st.integers(0, 10**10)).map(lambda pair: f"{pair[0]}.{pair[1]}"),
    st.sampled_from(["5.", ".5", "-0", "-0.0", "0e0", "1e5", "00012.50", "12345678901234567"]),
)


def bits(values):
    return np.asarray(values, dtype=np.float64).view(np.int64)


@settings(max_examples=300, deadline=None)
@given(st.lists(st.tuples(CELL, CELL), min_size=1, max_size=30))
def test_every_cell_is_what_float_reads(rows):
    text = "".join(",".join(row) + "\n" for row in rows).encode()
    read, _ = scan_decimals(text, 2)
    np.testing.assert_array_equal(bits(read), bits([[float(cell) for cell in row] for row in rows]))


def middles(count):
    """Return decimal texts of 17 to 19 digits next to the middle of two float64 numbers, and on it."""
    generator = np.random.default_rng(3)
    for mantissa, power in zip(
        generator.integers(2**52, 2**53, count), generator.integers(-40, 10, count), strict=True
    ):
        exact = Fraction(2 * int(mantissa) + 1) * Fraction(2) ** int(power)
        shift = 0
        while exact * Fraction(10) ** shift < 10**18:
            shift += 1
        while exact * Fraction(10) ** shift >= 10**19:
            shift -= 1
        near = int(exact * Fraction(10) ** shift)
        yield from (f"{near + step}e{-shift}" for step in (-1, 0, 1))


def test_the_middle_of_two_numbers_is_rounded_as_float_rounds_it():
    cells = (
        list(middles(4000)) + [f"{2**k}.0" for k in range(50, 63)] + [f"{2**53 + k}" for k in range(-3, 200)]
    )
    cells += [f"{2**k - 1}e-3" for k in range(40, 63)]
    read, _ = scan_decimals("".join(cell + "\n" for cell in cells).encode(), 1)
    np.testing.assert_array_equal(bits(read[:, 0]), bits(list(map(float, cells))))


def test_random_bits_are_restored():
    exponents = np.random.default_rng(1).integers(1023 - 130, 1023 + 150, 50_000).astype(np.uint64)
    mantissas = np.random.default_rng(2).integers(0, 2**52, 50_000).astype(np.uint64)
    values = ((exponents << np.uint64(52)) | mantissas).view(np.float64)
    for form in ("{!r}", "{:.18e}", "{:.16e}"):
        read, _ = scan_decimals("".join(form.format(v) + "\n" for v in values.tolist()).encode(), 1)
        np.testing.assert_array_equal(bits(read[:, 0]), bits(values))


@pytest.mark.parametrize(
    "text",
    ["", "\n", "1\n\n2\n", "1,2\n", "1", "nan\n", "inf\n", "1e999\n", "1_0\n", "x\n", "1.2.3\n", "1e\n", "e5\n", ".\n",
     "-\n", "--1\n", "+-1\n", "1e5.5\n", "1e1e1\n", "1 2\n", "0x10\n", "1e+-5\n", "\xb2\n", "1;2\n", "1:\n", "1/\n"],
)  # fmt: skip
def test_what_is_no_number_is_refused(text):
    with pytest.raises(NotFixedError):
        scan_decimals(text.encode("latin-1"), 1)


def test_decimals_are_those_of_the_text():
    text = b"1.25,3,1e-3,5.,2.50e1\n-1.5,3,1.25e-3,7,1e3\n"
    assert scan_decimals(text, 5)[1].tolist() == [2, 0, 5, 0, 1]


ODD = [
    "5.",
    ".5",
    "1e+05",
    "1.25e+3",
    "2.5E-03",
    "-1e-007",
    "3E+2",
    "12",
    "-0.50",
    "7e-0",
    "1.e-4",
    "1e-2500",
]
ODD += [f"1.5e{sign}{'0' * 30}12" for sign in ("", "-")]


def shown(cell):
    """Return how many decimals a text has when it is written without an exponent, by exact arithmetic."""
    return min(max(0, -Decimal(cell).as_tuple().exponent), 2000)


def test_decimals_of_every_form_are_those_of_exact_arithmetic():
    """Alone, and in lines where some cells have a point or an exponent and others have none."""
    generator = np.random.default_rng(4)
    cells = ODD + [
        f"{generator.normal():.{generator.integers(0, 7)}{kind}}" for kind in "feE" for _ in range(8)
    ]
    for cell in cells:
        assert scan_decimals(f"{cell}\n".encode(), 1)[1].tolist() == [shown(cell)], cell
        assert decimals_of(f" {cell} ".encode()) == shown(cell), cell
    for _ in range(40):
        rows = [[str(cell) for cell in generator.choice(cells, 3)] for _ in range(3)]
        text = "".join(",".join(row) + "\n" for row in rows).encode()
        assert scan_decimals(text, 3)[1].tolist() == [
            max(map(shown, column)) for column in zip(*rows, strict=True)
        ], rows


@pytest.mark.parametrize("line", ["-0,1", "1,-0", "-0.0,-0"])
def test_a_zero_keeps_its_sign_in_either_cell(line):
    expected = bits([list(map(float, line.split(",")))])
    np.testing.assert_array_equal(bits(scan_decimals(f"{line}\n".encode(), 2)[0]), expected)


@pytest.mark.parametrize("text", ["1.25 ,3\n", "3,1.25 \n", "1\n2\n", "1,2\n3\n", "1,2,3\n4\n"])
def test_lines_of_another_form_than_two_cells_are_refused(text):
    with pytest.raises(NotFixedError):
        scan_decimals(text.encode(), 2)


@pytest.mark.parametrize("cell", ["true", "null", '"5"', "[1]", "1" + "0" * 400])
def test_values_of_json_that_are_no_numbers_are_refused(cell):
    with pytest.raises(NotFixedError):
        scan_decimals(f"{cell}\n".encode(), 1)


def test_every_column_of_whole_numbers_is_written_without_a_point():
    lines = encode_full(np.array([[1.0, 0.1, -3.0], [2.0, 1e-30, 4.0]]), [0, 2]).decode().splitlines()
    assert [(int(a), float(b), int(c)) for a, b, c in (line.split(",") for line in lines)] == [
        (1, 0.1, -3),
        (2, 1e-30, 4),
    ]


def test_ordinary_files_are_read_by_blocks(tmp_path, monkeypatch):
    def never(*_):
        raise AssertionError("read cell by cell")

    monkeypatch.setattr(text_rows.RowReader, "_numbers_of_any_form", never)
    values = np.random.default_rng(0).normal(size=(500, 3)) * [1, 1e-4, 1e3]
    for form in ("%.6f", "%.18e", "%.17g", "%.3f"):
        np.savetxt(tmp_path / "a.csv", values, form, ",", header="a,b,c", comments="")
        expected = np.loadtxt(tmp_path / "a.csv", delimiter=",", skiprows=1)
        np.testing.assert_array_equal(bits(read_csv(tmp_path / "a.csv").columns), bits(expected))
