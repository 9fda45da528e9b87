"""Agreement of text and numbers: whatever `float` reads otherwise is not agreed with."""

from __future__ import annotations

import numpy as np
import pytest

from trajcli.streams.decimals import encode_fixed
from trajcli.streams.fixed_agreement import FixedLayout


def rows_of(scale, count=700):
    return np.random.default_rng(4).uniform(-scale, scale, (count, 5))


@pytest.mark.parametrize("scale", [1e-10, 1e-6, 1e-3, 1.0, 12.0, 150.0, 2000.0, 9999.0])
def test_text_with_nine_decimals_agrees(scale):
    rows = rows_of(scale)
    text = "".join(",".join(f"{value:.9f}" for value in row) + "\n" for row in rows.tolist())
    text = text.replace("-0.000000000", "0.000000000").encode()
    assert FixedLayout(rows).size == len(text)
    assert FixedLayout(rows).agrees(text)


def test_columns_of_whole_numbers_agree():
    rows = rows_of(300.0)
    rows[:, 1], rows[:, 4] = np.arange(700), np.arange(700) * 14
    text = encode_fixed(rows, (1, 4))
    assert FixedLayout(rows, (1, 4)).agrees(text)
    assert not FixedLayout(rows, (1, 4)).agrees(text.replace(b",350,", b",351,"))
    assert not FixedLayout(rows, (1, 4)).agrees(text.replace(b",140\n", b",150\n"))
    assert not FixedLayout(rows, (1, 4)).agrees(text.replace(b",140\n", b",140,"))


@pytest.mark.full
def test_no_changed_byte_agrees():
    rows = np.array([[0.0, -12.5, 3.25, 1234.0], [0.001, 99.125, -9999.5, 7.0], [-0.25, 1e-9, 2.0, -3.0]])
    text = encode_fixed(rows)
    layout = FixedLayout(rows)
    assert layout.agrees(text)
    for place in range(len(text)):
        for byte in range(256):
            if byte != text[place]:
                assert not layout.agrees(text[:place] + bytes([byte]) + text[place + 1 :]), (place, byte)


def test_no_number_off_by_a_unit_agrees():
    rows = rows_of(500.0, 40)
    text = encode_fixed(rows)
    for index in range(rows.size):
        moved = rows.copy()
        moved.flat[index] += 1e-9
        assert not FixedLayout(moved).agrees(text)


@pytest.mark.parametrize("change", [lambda t: t[:-1], lambda t: t + b"\n", lambda t: t[1:], lambda t: b""])
def test_no_text_of_another_length_agrees(change):
    rows = rows_of(5.0, 10)
    assert not FixedLayout(rows).agrees(change(encode_fixed(rows)))


@pytest.mark.parametrize("value", [1e4, -2e5, 1e13, 9999.9999999999])
def test_larger_numbers_are_left_to_a_reader(value):
    rows = np.array([[value]])
    assert not FixedLayout(rows).agrees(encode_fixed(rows))
