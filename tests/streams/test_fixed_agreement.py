"""Agreement of text and numbers: whatever `float` reads otherwise is not agreed with."""

from __future__ import annotations

import numpy as np
import pytest
from tiers import few

from trajcli.streams.decimals import FixedLayout, encode_fixed


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


ALL_KINDS = np.array([[0.0, -12.5, 3.25, 1234.0], [0.001, 99.125, -9999.5, 7.0], [-0.25, 1e-9, 2.0, 103.0]])


@pytest.mark.parametrize("whole", [(), (3,), (0,)])
def test_no_changed_byte_agrees(whole):
    """Of every place, and in the full tier every byte: else other digits, other separators, and single bits."""
    rows = ALL_KINDS[:, ::-1] if whole == (0,) else ALL_KINDS
    text = encode_fixed(rows, whole)
    layout = FixedLayout(rows, whole)
    assert layout.agrees(text)
    others = sorted({*b"0123456789/:,-.\n\0 +e", *(1 << k for k in range(8))})
    for place in range(len(text)):
        near = {text[place] ^ 1 << bit for bit in range(8)} | {*others}
        for byte in few([*near, *({*range(256)} - near)], len(near)) if len(near) < 256 else near:
            if byte != text[place]:
                assert not layout.agrees(text[:place] + bytes([byte]) + text[place + 1 :]), (place, byte)


def with_values(text, changes):
    """Return text with other characters, by place: a base, and a value that is laid over it bit by bit."""
    changed = bytearray(text)
    for place, base, value in changes:
        changed[place] = base ^ value
    return bytes(changed)


def test_no_two_characters_that_make_up_for_each_other_agree():
    """Such as 1: for 20, and 2/4 for 2.5: characters that are no digits, and make the same number."""
    rows = np.array([[1234.567891234, -987.123456789, 355.355355355, -3555.355355355]] * 2)
    layout, text, tried = FixedLayout(rows), encode_fixed(rows), 0
    assert layout.agrees(text)
    zero, point = ord("0"), ord(".")
    for k in range(len(text) - 2):
        first, second, third = text[k : k + 3]
        pairs = []
        if chr(first).isdigit() and chr(second).isdigit():
            pairs += [
                ((k, zero, first - zero - n), (k + 1, zero, second - zero + 10 * n))
                for n in range(1, first - zero + 1)
            ]
        if chr(first).isdigit() and second == point:
            pairs += [
                ((k, zero, first - zero - n), (k + 1, point, 10 * n)) for n in range(1, first - zero + 1)
            ]
            pairs += [
                ((k, zero, first - zero - n), (k + 2, zero, third - zero + 10 * n))
                for n in range(1, first - zero + 1)
            ]
        if first == point:
            pairs += [((k, point, n), (k + 1, zero, second - zero - n)) for n in range(1, second - zero + 1)]
        if (
            text[k : k + 3].isdigit()
            and (over := int(text[k : k + 3]) - 250 - (third - zero)) >= 0
            and third <= zero + 5
        ):
            # 250 to 255 in the last place: with the six that tell digits from others no eight bits are left, and ten times
            # that carries nine into the two places behind
            tens, last = divmod(over // 10, 10), 250 + third - zero
            three = (k, zero, tens[0]), (k + 1, zero, tens[1]), (k + 2, zero, last)
            pairs.append(three)
            if text[k + 3 : k + 5].isdigit() and int(text[k + 3 : k + 5]) >= 9:
                less = divmod(int(text[k + 3 : k + 5]) - 9, 10)
                pairs.append((*three, (k + 3, zero, less[0]), (k + 4, zero, less[1])))
            if text[k + 4 : k + 5] == b".":  # ten less before the point, and one more behind it
                units, tenths = text[k + 3] - zero - 1, text[k + 5] - zero + 1
                pairs.append((*three, (k + 3, zero, units), (k + 5, zero, tenths)))
        for pair in pairs:
            assert not layout.agrees(with_values(text, pair)), (k, pair)
        tried += len(pairs)
    assert tried > 300


@pytest.mark.parametrize("power", [1, 10, 100, 1000])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_numbers_next_to_another_length_agree_with_what_they_are_rounded_to(power, sign):
    for below in (0.4e-9, 0.6e-9, 1.4e-9):
        rows = np.full((3, 2), sign * (power - below))
        text = encode_fixed(rows)
        assert text.startswith(f"{rows[0, 0]:.9f},".encode())
        assert FixedLayout(rows).agrees(text)


def test_no_other_whole_number_agrees():
    rows = np.array([[1.5, 350.0], [2.5, 7.0]])
    layout, text = FixedLayout(rows, (1,)), encode_fixed(rows, (1,))
    assert layout.agrees(text)
    for wrong in (b"349", b"351", b"34:", b"3\x360", b" 50"):
        assert not layout.agrees(text.replace(b"350", wrong)), wrong
    assert not FixedLayout(-rows, (1,)).agrees(text.replace(b"1.5", b"-1.5").replace(b"2.5", b"-2.5"))
    assert not FixedLayout(rows, (1,)).agrees(text.replace(b"2.500000000", b"2.600000000"))


@pytest.mark.parametrize("row", [0, 3, 699])
@pytest.mark.parametrize("column", [0, 2, 4])
@pytest.mark.parametrize("by", [1e-9, -1e-9, 1e-3, 500.0])
def test_one_cell_of_many_is_enough(row, column, by):
    rows = rows_of(300.0)
    other = rows.copy()
    other[row, column] += by
    if FixedLayout(other).size == FixedLayout(rows).size:
        assert not FixedLayout(rows).agrees(encode_fixed(other))
    assert not FixedLayout(other).agrees(encode_fixed(rows))


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
