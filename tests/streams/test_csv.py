from __future__ import annotations

import io
import os
import tracemalloc

import numpy as np
import pytest

from trajcli.columns import parse_column
from trajcli.errors import FileError, TrajcliError
from trajcli.streams import csv
from trajcli.streams.csv import verify_csv, write_csv
from trajcli.streams.formats import WriteOptions, write_verified

NAMES = ["t", *(f"q{k}" for k in range(1, 6)), "move"]
COLUMNS = [parse_column(name) for name in NAMES]


def table(count=3000, scale=3.0):
    rows = np.random.default_rng(0).normal(size=(count, len(NAMES))) * scale
    rows[:, 0] = np.arange(count) / 1000
    rows[:, -1] = np.arange(count) // 1000
    return rows


def blocks_of(rows, size=700):
    return (rows[low : low + size] for low in range(0, len(rows), size))


def written(rows, digits="fixed"):
    out = io.BytesIO()
    write_csv(blocks_of(rows), COLUMNS, out, digits)
    return out.getvalue()


def test_a_file_is_its_names_and_its_rows():
    rows = np.array([[0.0, 1, -2, 3.25, 4, 5, 0], [0.001, 1, 2, 3, 4, -1e-10, 1]])
    assert written(rows).decode() == (
        "t,q1,q2,q3,q4,q5,move\n"
        "0.000000000,1.000000000,-2.000000000,3.250000000,4.000000000,5.000000000,0\n"
        "0.001000000,1.000000000,2.000000000,3.000000000,4.000000000,0.000000000,1\n"
    )
    assert written(rows, "full").decode().splitlines()[2] == "0.001,1.0,2.0,3.0,4.0,-1e-10,1"


def test_block_size_changes_no_byte():
    rows = table()
    whole = io.BytesIO()
    write_csv([rows], COLUMNS, whole)
    assert whole.getvalue() == written(rows)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("digits", ["fixed", "full"])
def test_what_is_not_finite_is_never_written(bad, digits):
    rows = table()
    rows[2001, 3] = bad
    out = io.BytesIO()
    with pytest.raises(TrajcliError, match=rf"q3 is {bad} in row 2001") as caught:
        write_csv(blocks_of(rows), COLUMNS, out, digits)
    assert caught.value.exit_code == 70
    assert b"nan" not in out.getvalue()
    assert b"inf" not in out.getvalue()


@pytest.mark.parametrize("digits", ["fixed", "full"])
@pytest.mark.parametrize("scale", [1e-10, 3.0, 2e4, 1e8, 1e13])
def test_what_was_written_is_read_back(digits, scale):
    rows = table(scale=scale)
    verify_csv(io.BytesIO(written(rows, digits)), blocks_of(rows, 997), COLUMNS, digits)


def numbers(text):
    return [float(cell) for line in text.split()[1:] for cell in line.split(b",")]


@pytest.mark.parametrize("digits", ["fixed", "full"])
def test_every_flipped_digit_is_found(digits):
    rows = table(40)
    text = written(rows, digits)
    flipped = bytearray(text)
    start = text.index(b"\n") + 1
    digit_places = [k for k in range(start, len(text)) if text[k : k + 1].isdigit()]
    for place in digit_places[::17] + digit_places[-3:]:
        flipped[place] = ord("0") + (text[place] - ord("0") + 1) % 10
        if numbers(flipped) == numbers(text):  # a last digit below what a float64 can tell
            assert digits == "full"
            flipped[place] = text[place]
            continue
        with pytest.raises(TrajcliError, match="read back says"):
            verify_csv(io.BytesIO(bytes(flipped)), [rows], COLUMNS, digits)
        flipped[place] = text[place]


def test_one_unit_of_the_last_decimal_is_found_with_its_place():
    rows = table()
    moved = rows.copy()
    moved[2345, 2] += 1e-9
    with pytest.raises(TrajcliError, match=r"in row 2345 of q2, where the curve is"):
        verify_csv(io.BytesIO(written(moved)), blocks_of(rows), COLUMNS)


MUTANTS = {
    "a sign lost": lambda text: text.replace(b",-", b",", 1),
    "a comma for a point": lambda text: text.replace(b"0.", b"0,", 1),
    "lines swapped": lambda text: b"\n".join([*text.split(b"\n")[:5], *text.split(b"\n")[6:4:-1], *text.split(b"\n")[7:]]),
    "a line lost": lambda text: text.replace(text.split(b"\n")[9] + b"\n", b""),
    "the last line lost": lambda text: text[: text.rindex(b"\n", 0, -1) + 1],
    "the last byte lost": lambda text: text[:-1],
    "a line more": lambda text: text + text.split(b"\n")[-2] + b"\n",
    "an empty line more": lambda text: text + b"\n",
    "line feeds moved": lambda text: text.replace(b",", b"\n", 50).replace(b"\n", b",", 1),
    "a letter": lambda text: text.replace(b",1.", b",l.", 1),
    "a NUL": lambda text: text.replace(b",1.", b",\0.", 1),
    "a name changed": lambda text: b"T" + text[1:],
    "all lost": lambda text: b"",
    "the rows lost": lambda text: text[: text.index(b"\n") + 1],
}  # fmt: skip


@pytest.mark.parametrize("digits", ["fixed", "full"])
@pytest.mark.parametrize("mutant", MUTANTS)
def test_every_damage_is_found(mutant, digits):
    rows = table(300)
    text = written(rows, digits)
    damaged = MUTANTS[mutant](text)
    assert damaged != text
    with pytest.raises(TrajcliError, match="read back"):
        verify_csv(io.BytesIO(damaged), blocks_of(rows), COLUMNS, digits)


def test_a_lost_negative_zero_is_found_where_digits_are_full():
    rows = np.zeros((1, len(NAMES)))
    text = written(rows, "full")
    verify_csv(io.BytesIO(text), [rows], COLUMNS, "full")
    rows[0, 1] = -0.0
    with pytest.raises(TrajcliError, match="q1"):
        verify_csv(io.BytesIO(text), [rows], COLUMNS, "full")


def test_a_verified_file_appears_whole(tmp_path):
    rows = table()
    write_verified(tmp_path / "out.csv", blocks_of(rows), COLUMNS)
    assert (tmp_path / "out.csv").read_bytes() == written(rows)
    assert [path.name for path in tmp_path.iterdir()] == ["out.csv"]


@pytest.mark.parametrize("digits", ["fixed", "full"])
def test_a_file_that_fails_its_check_does_not_appear(tmp_path, monkeypatch, digits):
    def off(rows, whole_numbers):
        return encode(rows + 1e-8 * (np.arange(rows.size).reshape(rows.shape) == 2345), whole_numbers)

    encode = csv.encoder_of(digits)
    monkeypatch.setattr(csv, "encoder_of", lambda _: off)
    with pytest.raises(TrajcliError, match="read back says"):
        write_verified(tmp_path / "out.csv", blocks_of(table()), COLUMNS, WriteOptions(digits))
    assert list(tmp_path.iterdir()) == []


def test_a_file_of_numbers_that_end_does_not_appear(tmp_path):
    rows = table()
    rows[2500, 1] = np.nan
    (tmp_path / "out.csv").write_text("old")
    with pytest.raises(TrajcliError, match="q1 is nan"):
        write_verified(tmp_path / "out.csv", blocks_of(rows), COLUMNS)
    assert (tmp_path / "out.csv").read_text() == "old"
    assert len(list(tmp_path.iterdir())) == 1


def test_a_full_disk_is_an_error_of_the_file():
    with pytest.raises(FileError, match="cannot write /dev/full: No space left") as caught:
        write_verified("/dev/full", blocks_of(table()), COLUMNS)
    assert caught.value.exit_code == 4


def test_a_closed_pipe_is_said_as_such():
    read, write = os.pipe()
    os.close(read)
    with pytest.raises(BrokenPipeError), os.fdopen(write, "wb", buffering=0) as out:
        write_csv(blocks_of(table()), COLUMNS, out)


@pytest.mark.full
def test_memory_is_the_same_for_many_rows(tmp_path):
    def rows(count):
        for low in range(0, count, 4096):
            yield np.full((min(4096, count - low), 3), low / 1e6)

    def peak(count):
        tracemalloc.start()
        write_verified(tmp_path / "out.csv", rows(count), COLUMNS[:3])
        result = tracemalloc.get_traced_memory()[1]
        tracemalloc.stop()
        return result

    peak(5000)  # fills the tables
    few, many = peak(200_000), peak(1_000_000)
    # the file of many rows has 28 MB more; some blocks more or less wait for their comparison
    assert many < 1.05 * few + 6e6
    assert many < 15e6
