from __future__ import annotations

from decimal import ROUND_HALF_EVEN, Context, Decimal

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tiers import QUICK

from trajcli.streams import decimals
from trajcli.streams.decimals import encode_fixed
from trajcli.streams.number_cells import encode_full

EXACT = Context(prec=400, rounding=ROUND_HALF_EVEN)


def exact_text(value: float) -> str:
    """The two roundings, 1e-12 and then 1e-9, half to even, in decimal arithmetic."""
    number = Decimal(value).quantize(Decimal("1e-12"), context=EXACT).quantize(Decimal("1e-9"), context=EXACT)
    return f"{number:f}" if number else "0.000000000"


def encoded(values) -> list[str]:
    return encode_fixed(np.array(values, dtype=float)[:, None]).decode().splitlines()


HARD = [
    0.0, -0.0, 1e-300, -1e-300, 5e-10, -5e-10, 5.01e-10, -5.01e-10, 4.99e-10, 1e-9, -1e-9, 1.5e-9, 2.5e-9, -2.5e-9,
    0.1, -0.1, 0.5, 0.999999999, 0.9999999994, 0.9999999996, 0.9999999995, -0.9999999999, 1.0, 9.9999999999, 99.9999999999,
    999.0, 999.9999999995, 999.9999999994, -999.9999999996, 1000.0, -1000.0, 1000.5, 1009.25, 9999.9999999999, 10000.0,
    -10000.0, 10001.000000001, 12345.678901234, 99999.5, 100000.0, 1e6, -1e6, 1234567.125, 9007199.254740993, 9999999.0,
    -9999999.999999999, 9999999.9999999991, 1e7, 1e12, -1e12, 1e15 + 0.125, 2.0**53, 1e22, 1e300, -1.7976931348623157e308,
]  # fmt: skip


def test_hard_values_equal_decimal_arithmetic():
    for value in HARD:  # each alone, so that each kind of word is taken by what needs it
        assert encoded([value]) == [exact_text(value)], value


def test_a_value_has_the_same_bytes_in_any_company():
    for ceiling in (1e3, 1e7, np.inf):
        values = [value for value in HARD if abs(value) < ceiling]
        assert encoded(values) == [exact_text(value) for value in values]


def test_values_on_ties_are_told_by_their_even_neighbour():
    rng = np.random.default_rng(0)
    units = rng.integers(-(10**12), 10**12, 20000)
    values = (units * 10 + 5) / 1e10  # the float64 next to a tie at 1e-9
    for value, unit, text in zip(values, units.tolist(), encoded(values), strict=True):
        even = unit + unit % 2
        assert Decimal(text) == Decimal(even).scaleb(-9), value


def test_random_values_equal_decimal_arithmetic():
    rng = np.random.default_rng(1)
    for scale in (1e-9, 1e-3, 1.0, 300.0, 2e3, 1e5, 5e6, 1e9, 1e14):
        values = rng.normal(size=3000) * scale
        texts = encoded(values)
        for value, text in zip(values.tolist(), texts, strict=True):
            # A product by 1e12 rounds, by less than 1e-4: where that decides, either neighbour is right.
            apart = abs(Decimal(text) - Decimal(value))
            assert text == exact_text(value) or apart <= Decimal("5.01e-10"), value
        assert sum(text != exact_text(value) for value, text in zip(values.tolist(), texts, strict=True)) <= 1


@settings(max_examples=300, deadline=None)
@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=30))
def test_any_value_is_within_half_a_unit(values):
    for value, text in zip(values, encoded(values), strict=True):
        assert abs(Decimal(text) - Decimal(value)) <= Decimal("5.01e-10")
        assert len(text.partition(".")[2]) == 9
        assert not (text.startswith("-") and Decimal(text) == 0)


def test_rows_are_lines_of_cells():
    rows = np.array([[1.0, -2.5, 3.0], [0.0, 1234.5, 2.0]])
    assert encode_fixed(rows, (2,)) == b"1.000000000,-2.500000000,3\n0.000000000,1234.500000000,2\n"
    assert encode_fixed(rows, (0, 2)) == b"1,-2.500000000,3\n0,1234.500000000,2\n"
    huge = np.array([[1e8, -2.0], [3.0, 12.0]])
    assert encode_fixed(huge, (1,)) == b"100000000.000000000,-2\n3.000000000,12\n"
    assert encode_full(rows, (2,)) == b"1.0,-2.5,3\n0.0,1234.5,2\n"


def test_many_rows_are_encoded_like_few(monkeypatch):
    rows = np.random.default_rng(2).normal(size=(501, 7)) * 900
    whole = encode_fixed(rows)
    monkeypatch.setattr(decimals, "_VALUES", 20)
    assert encode_fixed(rows) == whole
    assert whole.decode() == "".join(",".join(map(exact_text, row)) + "\n" for row in rows.tolist())


def test_evaluation_order_changes_no_byte():
    """The slides' 10 + 15 t^2 - 5/2 t^3 at 1 kHz: half of its rows stand on a tie of the ninth decimal."""
    t = np.arange(2001) / 1000
    orders = {
        "horner": ((-2.5 * t + 15) * t + 0) * t + 10,
        "monomials": 10 + 15 * t**2 - 2.5 * t**3,
        "matrix": np.stack([t * t * t, t * t, t, np.ones_like(t)], 1) @ np.array([-2.5, 15, 0, 10]),
        "radians": np.rad2deg(np.deg2rad(10.0) + np.deg2rad(15.0) * t**2 + ((np.deg2rad(-2.5) * t) * t) * t),
    }
    assert len({tuple(values) for values in orders.values()}) == 4
    texts = {name: encoded(values) for name, values in orders.items()}
    exact = [
        str((Decimal(10) + 15 * s * s - Decimal("2.5") * s**3).quantize(Decimal("1e-9"), ROUND_HALF_EVEN))
        for s in (Decimal(k) / 1000 for k in range(2001))
    ]
    for name, text in texts.items():
        assert text == exact, name
    # The naive way does differ: the test would not pass without the first rounding.
    assert [f"{value:.9f}" for value in orders["radians"]] != exact


@settings(max_examples=100, deadline=None)
@given(st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=30))
def test_full_digits_restore_every_bit(values):
    rows = np.array(values)[:, None]
    back = np.array([float(line) for line in encode_full(rows).split()])
    np.testing.assert_array_equal(back.view(np.int64), rows[:, 0].view(np.int64))


@pytest.mark.parametrize("columns", [1, 2, 19, 40000])
def test_any_width(columns):
    rows = np.arange(2 * columns, dtype=float).reshape(2, columns) / 8
    lines = encode_fixed(rows).decode().splitlines()
    assert [[float(cell) for cell in line.split(",")] for line in lines] == rows.tolist()


def digits_of(cell):
    """Return sign, digits without zeros around them, and the power of ten of the last one."""
    sign, digits, power = Decimal(cell).normalize().as_tuple()
    return sign, digits, power


def test_full_digits_are_those_of_repr():
    generator = np.random.default_rng(5)
    count = 10_000 if QUICK else 40_000
    drawn = generator.integers(0, 2**64, count, dtype=np.uint64).view(np.float64)
    sized = generator.normal(size=count) * 10.0 ** generator.integers(-9, 19, count)
    edges = [
        0.0,
        -0.0,
        1e-4,
        9.999999999999999e-05,
        1e15,
        1e16,
        9999999999999998.0,
        1e17,
        5e-324,
        1e22,
        0.1,
        -2.0,
    ]
    powers = [10.0**k for k in range(-30, 30)] + [2.0**k for k in range(-60, 70)]
    below = [np.nextafter(value, 0.0) for value in powers]
    above = [np.nextafter(value, np.inf) for value in powers]
    grids = (
        [k / 1000 for k in range(3000)]
        + [k / 4096 for k in range(3000)]
        + [k + 0.5 for k in range(9990, 10010)]
    )
    rounded = [*np.round(sized, 3), *np.round(sized, 12)]
    values = np.concatenate([drawn[np.isfinite(drawn)], sized, edges, powers, below, above, grids, rounded])
    values = values[: values.size // 2 * 2].reshape(-1, 2)
    cells = encode_full(values).decode().replace(",", "\n").split()
    assert [digits_of(cell) for cell in cells] == [
        digits_of(repr(value)) for value in values.reshape(-1).tolist()
    ]


def test_full_digits_of_a_motion_with_whole_numbers():
    t = np.arange(20_000) / 1000
    rows = np.column_stack(
        [t, np.sin(t), 1e-3 * np.cos(t), 1e-7 * np.sin(3 * t) ** 3, 900 * np.cos(t), 0 * t, t // 5]
    )
    lines = [line.split(",") for line in encode_full(rows, (6,)).decode().splitlines()]
    assert [[*map(float, line[:6]), int(line[6])] for line in lines] == rows.tolist()
    assert all(line[6].isdigit() and "." in line[0] for line in lines)


def test_whole_numbers_of_any_size_have_no_decimals():
    rows = np.array([[1.5, 9999.0], [-2.25, 10_000.0], [0.0, 1e15], [1.0, -0.0], [3.0, -17.0]])
    assert encode_full(rows, (1,)) == b"1.5,9999\n-2.25,10000\n0.0,1000000000000000\n1.0,0\n3.0,-17\n"
    assert encode_full(np.array([[1e300, 2.0]]), (0,)).decode() == f"{int(1e300)},2.0\n"
